/* Tests of tonemap.h. The implementation is in this file's translation unit, so that private functions can be called. */

#include "support.h"
#include "reference_tonemap.h"

#ifdef HAVE_OPENEXR
#include "image.h"
#endif

/* ---- tools */

typedef struct shot { unsigned char *u8; float *f32; tonemap_stats stats; } shot;

static void shot_free(shot *s)
{
    free(s->u8);
    free(s->f32);
}

/* The same picture as codes and as floats. */
static shot shoot(const sat_image *picture, const tonemap_options *options)
{
    shot s;
    tonemap *map = NULL;
    size_t n = (size_t)picture->width * (size_t)picture->height * (size_t)picture->channels;
    ptrdiff_t row = (ptrdiff_t)picture->width * picture->channels;
    memset(&s, 0, sizeof s);
    s.u8 = (unsigned char *)malloc(n);
    s.f32 = (float *)malloc(n * sizeof(float));
    EXPECT_EQ(tonemap_create(&map, picture->width, picture->height, options), SAT_OK);
    EXPECT_EQ(tonemap_apply_u8(map, s.u8, row, picture, 0, NULL), SAT_OK);
    EXPECT_EQ(tonemap_apply_f32(map, s.f32, row * (ptrdiff_t)sizeof(float), picture, 0, &s.stats), SAT_OK);
    tonemap_destroy(map);
    return s;
}

static float *hdr_pixels(int width, int height, int channels, uint64_t seed)
{
    float *p = (float *)malloc((size_t)width * (size_t)height * (size_t)channels * sizeof(float));
    support_hdr_image(p, width, height, channels, seed);
    return p;
}

/* A picture of even and busy places, shadows and lamps: what the search is for. */
static float *room_pixels(int width, int height, uint64_t seed)
{
    float *p = (float *)malloc((size_t)width * (size_t)height * 3 * sizeof(float));
    int x, y, c;
    for (y = 0; y < height; ++y)
        for (x = 0; x < width; ++x) {
            double u = (double)x / width, v = (double)y / height, light = 0.05 + 0.4 * u;
            if (u > 0.6 && v < 0.5) light = 40 + 30 * sin(12 * v);
            if (u < 0.3 && v > 0.6) light = 0.01 * (1 + (x / 3 + y / 3) % 2 * 2);
            if ((x - width / 2) * (x - width / 2) + (y - height / 2) * (y - height / 2) < 30) light = 5000;
            light *= 1 + 0.04 * (support_uniform(&seed) - 0.5);
            for (c = 0; c < 3; ++c) p[3 * ((size_t)y * (size_t)width + (size_t)x) + (size_t)c] = (float)(light * (1 + 0.4 * sin(5 * u + 2 * c + 3 * v)));
        }
    return p;
}

static uint64_t shot_hash(const shot *s, const sat_image *picture)
{
    size_t n = (size_t)picture->width * (size_t)picture->height * (size_t)picture->channels;
    return support_hash_add(support_hash(s->u8, n), s->f32, n * sizeof(float));
}

/* ---- arguments */

TEST(defaults_are_as_written)
{
    tonemap_options o = tonemap_defaults();
    EXPECT_EQ(o.operation, TONEMAP_PHOTOGRAPHIC_LOCAL);
    EXPECT_NEAR(o.key, 0.18, 0);
    EXPECT(o.white > 1e300);
    EXPECT_NEAR(o.phi, 8, 0);
    EXPECT_NEAR(o.epsilon, 0.05, 0);
    EXPECT_EQ(o.scales, 8);
    EXPECT_EQ(o.mesopic, TONEMAP_MESOPIC_OFF);
    EXPECT_NEAR(o.lux_per_cd, 1, 0);
    EXPECT(o.soft == 0 && o.cd_per_unit == 0 && o.tolerance_codes == 0 && o.selective == 0 && o.adapt_seconds == 0);
    EXPECT_EQ(tonemap_version(), TONEMAP_VERSION);
}

static void refuses(const tonemap_options *o)
{
    tonemap *map = (tonemap *)1;
    EXPECT_EQ(tonemap_create(&map, 8, 8, o), SAT_ERR_ARGUMENT);
    EXPECT(map == NULL);
}

TEST(bad_options_are_refused)
{
    const tonemap_options good = tonemap_defaults();
    const double bad[4] = {(double)NAN, (double)INFINITY, -1, 1e31};
    tonemap_options o;
    int i;
    o = good, o.operation = (tonemap_operator)(TONEMAP_LINEAR + 1), refuses(&o);
    o = good, o.mesopic = (tonemap_mesopic)3, refuses(&o);
    o = good, o.scales = 0, refuses(&o);
    o = good, o.scales = 9, refuses(&o);
    o = good, o.key = (double)NAN, refuses(&o);
    o = good, o.key = 11, refuses(&o);
    o = good, o.white = -1, refuses(&o);
    o = good, o.white = (double)NAN, refuses(&o);
    o = good, o.phi = 17, refuses(&o);
    o = good, o.epsilon = 0, refuses(&o);
    o = good, o.soft = 1.5, refuses(&o);
    o = good, o.threads.workers = 5, refuses(&o);
    o = good, o.allocator.alloc = support_alloc, refuses(&o);
    for (i = 0; i < 4; ++i) {
        o = good, o.cd_per_unit = bad[i], refuses(&o);
        o = good, o.lux_per_cd = bad[i], refuses(&o);
        o = good, o.tolerance_codes = bad[i], refuses(&o);
        o = good, o.selective = bad[i], refuses(&o);
        o = good, o.adapt_seconds = bad[i], refuses(&o);
        o = good, o.phi = i == 2 ? -17 : bad[i], refuses(&o);
        o = good, o.soft = bad[i], refuses(&o);
    }
}

TEST(bad_calls_are_refused_and_touch_nothing)
{
    float pixels[8 * 8 * 3] = {0};
    unsigned char out[8 * 8 * 3];
    sat_image view = sat_image_f32(pixels, 8, 8, 3), bad;
    tonemap *map = NULL;
    tonemap_options o = tonemap_defaults();
    memset(out, 77, sizeof out);
    EXPECT_EQ(tonemap_create(NULL, 8, 8, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(tonemap_create(&map, 0, 8, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(tonemap_create(&map, 8, -1, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(tonemap_create(&map, 2000000000, 8, NULL), SAT_ERR_ARGUMENT);
    if (sizeof(size_t) == 4) EXPECT_EQ(tonemap_create(&map, 1 << 20, 1 << 20, NULL), SAT_ERR_SIZE);
    if (!EXPECT_EQ(tonemap_create(&map, 8, 8, NULL), SAT_OK)) return;
    EXPECT_EQ(tonemap_apply_u8(NULL, out, 24, &view, 0, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(tonemap_apply_u8(map, NULL, 24, &view, 0, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(tonemap_apply_u8(map, out, 24, NULL, 0, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(tonemap_apply_u8(map, out, 23, &view, 0, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(tonemap_apply_u8(map, out, 24, &view, -1, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(tonemap_apply_u8(map, out, 24, &view, (double)NAN, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(tonemap_apply_f32(map, (float *)(void *)out, 8 * 12 + 2, &view, 0, NULL), SAT_ERR_ARGUMENT);
    bad = sat_image_f32(pixels, 8, 7, 3);
    EXPECT_EQ(tonemap_apply_u8(map, out, 24, &bad, 0, NULL), SAT_ERR_MISMATCH);
    bad = sat_image_f32(pixels, 8, 8, 2);
    EXPECT_EQ(tonemap_apply_u8(map, out, 24, &bad, 0, NULL), SAT_ERR_ARGUMENT);
    o.epsilon = -1;
    EXPECT_EQ(tonemap_set_options(map, &o), SAT_ERR_ARGUMENT);
    o = tonemap_defaults();
    o.threads = support_threads(3);
    EXPECT_EQ(tonemap_set_options(map, &o), SAT_ERR_ARGUMENT);
    EXPECT_EQ(tonemap_set_options(NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT(out[0] == 77 && out[8 * 8 * 3 - 1] == 77);
    EXPECT_EQ(tonemap_apply_u8(map, out, 24, &view, (double)INFINITY, NULL), SAT_OK);
    tonemap_destroy(map);
    tonemap_destroy(NULL);
}

TEST(one_allocation_and_none_a_frame)
{
    support_memory memory;
    tonemap_options o = tonemap_defaults();
    tonemap *map = NULL;
    float *pixels = hdr_pixels(50, 40, 3, 1);
    unsigned char *out = (unsigned char *)malloc(50 * 40 * 3);
    sat_image view = sat_image_f32(pixels, 50, 40, 3);
    tonemap_stats stats;
    o.allocator = support_allocator(&memory);
    o.tolerance_codes = 1;
    o.threads = support_odd_threads(3);
    EXPECT_EQ(tonemap_create(&map, 50, 40, &o), SAT_OK);
    EXPECT_EQ(memory.calls, 1);
    EXPECT_EQ(tonemap_apply_u8(map, out, 150, &view, 0, &stats), SAT_OK);
    EXPECT_EQ(memory.calls, 1);
    tonemap_destroy(map);
    EXPECT(support_memory_clean(&memory));
    memory.fail_at = memory.calls + 1;
    EXPECT_EQ(tonemap_create(&map, 50, 40, &o), SAT_ERR_MEMORY);
    EXPECT(map == NULL && support_memory_clean(&memory));
    free(pixels);
    free(out);
}

/* ---- the equations */

TEST(log_average_is_eq_A1)
{
    float *pixels = hdr_pixels(131, 67, 3, 5);
    sat_image view = sat_image_f32(pixels, 131, 67, 3);
    double *luminance = metrics_alloc(131 * 67), average;
    shot s = shoot(&view, NULL);
    reference_luminance(luminance, pixels, 131 * 67);
    average = reference_log_average(luminance, 131 * 67);
    EXPECT_REL(s.stats.log_average, average, 3e-6);
    EXPECT_EQ(s.stats.positive, 131 * 67);
    shot_free(&s);
    free(luminance);
    free(pixels);
}

static void check_global(double white)
{
    enum { W = 61, H = 47 };
    float *pixels = hdr_pixels(W, H, 3, 2);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    double *luminance = metrics_alloc(W * H), average, worst = 0;
    tonemap_options o = tonemap_defaults();
    shot s;
    int i, c;
    o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL;
    o.white = white;
    s = shoot(&view, &o);
    reference_luminance(luminance, pixels, W * H);
    average = reference_log_average(luminance, W * H);
    for (i = 0; i < W * H; ++i) {
        double lr = 0.18 * luminance[i] / average, rgb[3];
        reference_colour(rgb, pixels + 3 * i, lr * (1 + lr / (white * white)) / (1 + lr), 1, 1);
        for (c = 0; c < 3; ++c) {
            double v = rgb[c] < 0 ? 0 : rgb[c] > 1 ? 1 : rgb[c], off = fabs(v - (double)s.f32[3 * i + c]);
            if (!(off <= worst)) worst = off;
            if (!EXPECT_NEAR(s.u8[3 * i + c], metrics_code(v), 0.75)) break;
        }
    }
    EXPECT_NEAR(worst, 0, 1e-5);
    shot_free(&s);
    free(luminance);
    free(pixels);
}

TEST(global_operator_is_eq_A3) { check_global((double)INFINITY); }
TEST(burn_out_maps_white_to_one) { check_global(3); }

/* Against direct sums over the rounded luminances. Where the contrast of a step is within float rounding of epsilon the
   two may choose different scales: those pixels are few. */
static void check_local(int width, int height, int scales, double epsilon)
{
    float *pixels = room_pixels(width, height, 9);
    sat_image view = sat_image_f32(pixels, width, height, 3);
    size_t n = (size_t)width * (size_t)height, i, flips = 0, total = 0;
    double *scaled = metrics_alloc(n), *rounded = metrics_alloc(n), *la = metrics_alloc(n), average;
    reference_photographic r = reference_photographic_defaults(0);
    tonemap_options o = tonemap_defaults();
    shot s;
    int k;
    o.scales = r.scales = scales;
    o.epsilon = r.epsilon = epsilon;
    s = shoot(&view, &o);
    reference_luminance(scaled, pixels, n);
    average = s.stats.adapted;
    for (i = 0; i < n; ++i) {
        scaled[i] *= 0.18 / average;
        rounded[i] = floor((scaled[i] < 256 ? scaled[i] : 256) * 4096 + 0.5) / 4096;
    }
    reference_local(la, rounded, width, height, &r);
    for (i = 0; i < n; ++i) {
        double rgb[3];
        reference_colour(rgb, pixels + 3 * i, scaled[i] / (1 + la[i]), 1, 1);
        for (k = 0; k < 3; ++k) rgb[k] = rgb[k] < 0 ? 0 : rgb[k] > 1 ? 1 : rgb[k];
        flips += scaled[i] < 200 && fabs(rgb[1] - (double)s.f32[3 * i + 1]) > 2e-4 * rgb[1] + 1e-5;
    }
    EXPECT((double)flips <= 0.002 * (double)n + 1);
    for (k = 0; k < 10; ++k) total += s.stats.scale[k];
    EXPECT_EQ(s.stats.searched, scales > 1 ? n : 0);
    EXPECT_EQ(total, s.stats.searched);
    shot_free(&s);
    free(scaled);
    free(rounded);
    free(la);
    free(pixels);
}

TEST(local_operator_is_eq_A4_to_A9) { check_local(150, 131, 8, 0.05); }
TEST(local_operator_with_fewer_scales) { check_local(90, 77, 4, 0.05); check_local(40, 30, 1, 0.05); check_local(40, 30, 2, 0.05); }
TEST(local_operator_on_small_and_thin_pictures)
{
    int sizes[][2] = {{1, 1}, {1, 90}, {90, 1}, {2, 3}, {15, 16}, {16, 15}, {17, 33}, {41, 41}, {42, 20}, {3, 200}}, i;
    for (i = 0; i < 10; ++i) check_local(sizes[i][0], sizes[i][1], 8, 0.05);
}
TEST(local_operator_with_a_strict_threshold) { check_local(100, 70, 8, 0.0025); }

#ifdef SAT__VECTOR
/* Four pixels at a time give the bits of one at a time. */
TEST(vector_and_plain_code_give_the_same_bits)
{
    enum { W = 203, H = 60 };
    float *pixels = room_pixels(W, H, 3), *local = (float *)calloc(512, sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    unsigned char *out = (unsigned char *)malloc(W * H * 3);
    tonemap *map = NULL;
    int kind, y, differ = 0, x, j;
    for (kind = 0; kind < 3; ++kind) {
        tonemap_options o = tonemap_defaults();
        tonemap__window window;
        tonemap__worker *w;
        size_t scale[2][10];
        if (kind == 1) o.soft = 0.7;
        if (kind == 2) o.operation = TONEMAP_ASHIKHMIN;
        tonemap_create(&map, W, H, &o);
        EXPECT_EQ(tonemap_apply_u8(map, out, W * 3, &view, 0, NULL), SAT_OK);
        w = &map->worker[0];
        for (y = 0; y < H; ++y) {
            const float *luminance = map->luminance + (size_t)y * (size_t)map->row;
            memset(scale, 0, sizeof scale);
            if (y == 0) memset(tonemap__ring_row(map, w, 0), 0, (size_t)map->ring_row * 4);
            for (j = y == 0 ? 0 : y + map->frame.reach; j < H && j <= y + map->frame.reach; ++j) tonemap__add_ring_row(map, w, j);
            tonemap__open_window(&window, map, w, y);
            scale[0][0] = W;
            if (kind == 0) tonemap__search_vector(w->local, luminance, &window, &map->frame, scale[0], 0, W);
            if (kind == 1) tonemap__search_soft_vector(w->local, luminance, &window, &map->frame, scale[0], 0, W);
            if (kind == 2) tonemap__search_ashikhmin_vector(w->local, luminance, &window, &map->frame, scale[0], 0, W);
            if (kind == 0) tonemap__search_plain(local, luminance, &window, &map->frame, scale[1], 0, W);
            if (kind == 1) tonemap__search_soft_plain(local, luminance, &window, &map->frame, scale[1], 0, W);
            if (kind == 2) tonemap__search_ashikhmin_plain(local, luminance, &window, &map->frame, scale[1], 0, W);
            differ += memcmp(local, w->local, W * sizeof(float)) != 0;
            differ += memcmp(scale[0], scale[1], sizeof scale[0]) != 0;
        }
        tonemap_destroy(map);
    }
    EXPECT_EQ(differ, 0);
    for (x = 0; x < 4000; ++x) {
        float v = (float)exp2(-90 + 0.045 * x), a[4], b[4];
        sat__f32x4_store(a, tonemap__log2_4(sat__f32x4_set1(v)));
        differ += a[2] != tonemap__log2(v);
        sat__f32x4_store(a, tonemap__exp2_4(sat__f32x4_set1(-50 + 0.025f * (float)x)));
        differ += a[1] != tonemap__exp2(-50 + 0.025f * (float)x);
        sat__f32x4_store(b, tonemap__cbrt4(sat__f32x4_set1(v)));
        differ += b[3] != tonemap__cbrt(v);
        EXPECT_NEAR(tonemap__log2(v), -90 + 0.045 * x, 1e-5);
        EXPECT_REL(tonemap__exp2(-50 + 0.025f * (float)x), exp2((double)(-50 + 0.025f * (float)x)), 1e-5);
        if (v > 1 && v < 1e6f) EXPECT_REL(tonemap__cbrt(v), cbrt((double)v), 5e-5);
    }
    EXPECT_EQ(differ, 0);
    free(out);
    free(local);
    free(pixels);
}
#endif

TEST(same_bits_for_any_number_of_workers)
{
    enum { W = 171, H = 300 };
    float *pixels = room_pixels(W, H, 4);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    int counts[] = {1, 2, 3, 7}, kind, i;
    for (kind = 0; kind < 5; ++kind) {
        tonemap_options o = tonemap_defaults();
        uint64_t hash = 0;
        if (kind == 1) o.tolerance_codes = 2, o.mesopic = TONEMAP_MESOPIC_UNIFORM;
        if (kind == 2) o.operation = TONEMAP_ASHIKHMIN;
        if (kind == 3) o.selective = 0.1, o.mesopic = TONEMAP_MESOPIC_LOCAL;
        if (kind == 4) o.soft = 1, o.key = 0, o.white = 0;
        for (i = 0; i < 8; ++i) {
            shot s;
            o.threads = i < 4 ? support_threads(counts[i]) : support_odd_threads(counts[i - 4]);
            s = shoot(&view, &o);
            if (i == 0) hash = shot_hash(&s, &view);
            EXPECT(shot_hash(&s, &view) == hash);
            shot_free(&s);
        }
    }
    free(pixels);
}

TEST(units_that_are_powers_of_two_change_no_bit)
{
    enum { W = 90, H = 70, N = W * H * 3 };
    float *pixels = hdr_pixels(W, H, 3, 6), *scaled = (float *)malloc(N * sizeof(float));
    sat_image view = sat_image_f32(scaled, W, H, 3);
    int operation, k, i;
    for (operation = 0; operation < 5; ++operation) {
        uint64_t hash = 0;
        for (k = -20; k <= 20; k += 5) {
            tonemap_options o = tonemap_defaults();
            shot s;
            o.operation = (tonemap_operator)operation;
            o.key = operation & 1 ? 0 : 0.18;
            o.white = operation & 1 ? 0 : (double)INFINITY;
            o.mesopic = TONEMAP_MESOPIC_LOCAL;
            for (i = 0; i < N; ++i) scaled[i] = ldexpf(pixels[i], k);
            s = shoot(&view, &o);
            if (k == -20) hash = shot_hash(&s, &view);
            EXPECT(shot_hash(&s, &view) == hash);
            shot_free(&s);
        }
    }
    free(pixels);
    free(scaled);
}

/* ---- bad and extreme pixels */

/* Largest difference of codes outside (or also inside) the 41 x 41 pixels around the centre. */
static int worst_outside(const unsigned char *a, const unsigned char *b, int width, int height)
{
    int x, y, c, worst = 0;
    for (y = 0; y < height; ++y)
        for (x = 0; x < width; ++x)
            for (c = 0; c < 3; ++c) {
                int d = abs((int)a[3 * (y * width + x) + c] - (int)b[3 * (y * width + x) + c]);
                if (abs(x - width / 2) <= 20 && abs(y - height / 2) <= 20) continue;
                if (d > worst) worst = d;
            }
    return worst;
}

TEST(a_bad_pixel_stays_in_its_window)
{
    enum { W = 120, H = 100 };
    const float bad[6] = {NAN, -1, -INFINITY, INFINITY, FLT_MAX, 1e8f};
    float *pixels = room_pixels(W, H, 8), *centre = pixels + 3 * (H / 2 * W + W / 2);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    int operation, i, c;
    for (operation = 0; operation < 4; ++operation) {
        tonemap_options o = tonemap_defaults();
        shot clean;
        o.operation = (tonemap_operator)operation;
        centre[0] = centre[1] = centre[2] = 0;
        clean = shoot(&view, &o);
        for (i = 0; i < 6; ++i) {
            shot s;
            centre[0] = bad[i];
            centre[1] = centre[2] = i < 3 ? 1 : bad[i];
            s = shoot(&view, &o);
            /* -1 in red alone leaves a positive luminance; that and 1e8 are light, and move the log-average by less than a code */
            EXPECT_NEAR(worst_outside(clean.u8, s.u8, W, H), 0, i == 1 || i == 5);
            for (c = 0; c < 3; ++c) EXPECT_EQ(s.u8[3 * (H / 2 * W + W / 2) + c], i == 1 && c ? s.u8[3 * (H / 2 * W + W / 2) + c] : i < 3 ? 0 : 255);
            EXPECT_EQ(s.stats.nan, i == 0);
            EXPECT_EQ(s.stats.negative, i == 2);
            EXPECT_EQ(s.stats.infinite, i == 3 || i == 4); /* the sum of three FLT_MAX overflows */
            shot_free(&s);
        }
        shot_free(&clean);
    }
    free(pixels);
}

TEST(any_bits_give_values_from_0_to_1)
{
    enum { W = 64, H = 50, N = W * H * 4 };
    float *pixels = (float *)malloc(N * sizeof(float));
    uint64_t seed = 11;
    int round, i, bad = 0;
    for (round = 0; round < 60; ++round) {
        tonemap_options o = tonemap_defaults();
        sat_image view = sat_image_f32(pixels, W, H, round % 3 == 0 ? 1 : round % 3 == 1 ? 3 : 4);
        shot s;
        for (i = 0; i < N; ++i) pixels[i] = sat__float_from_bits((uint32_t)support_random(&seed));
        o.operation = (tonemap_operator)(round % 5);
        o.mesopic = (tonemap_mesopic)(round / 5 % 3);
        o.soft = round & 1;
        o.tolerance_codes = round & 2;
        o.selective = round & 4;
        o.key = round & 8 ? 0.18 : 0;
        o.white = round & 16 ? 0 : (double)INFINITY;
        s = shoot(&view, &o);
        for (i = 0; i < W * H * view.channels; ++i) bad += !(s.f32[i] >= 0 && s.f32[i] <= 1);
        EXPECT(s.stats.nan > 0 && s.stats.negative > 0);
        shot_free(&s);
    }
    EXPECT_EQ(bad, 0);
    free(pixels);
}

TEST(black_is_black_and_constant_is_the_key)
{
    enum { W = 50, H = 30 };
    float *pixels = (float *)calloc(W * H * 3, sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    int operation, i, automatic;
    for (operation = 0; operation < 5; ++operation)
        for (automatic = 0; automatic < 2; ++automatic) {
            tonemap_options o = tonemap_defaults();
            double expected;
            shot s;
            o.operation = (tonemap_operator)operation;
            if (automatic) o.key = o.white = 0;
            memset(pixels, 0, W * H * 3 * sizeof(float));
            s = shoot(&view, &o);
            for (i = 0; i < W * H * 3 && s.f32[i] == 0 && s.u8[i] == 0; ++i) {}
            EXPECT_EQ(i, W * H * 3);
            EXPECT_EQ(s.stats.positive, 0);
            shot_free(&s);
            for (i = 0; i < W * H * 3; ++i) pixels[i] = 0.037f;
            s = shoot(&view, &o);
            expected = operation >= 2 || automatic ? 0.18 : 0.18 / 1.18; /* with the estimated white of 1 the curve is a line */
            for (i = 0; i < W * H * 3; i += 31) EXPECT_REL(s.f32[i], expected, operation == 0 ? 2e-4 : 1e-5);
            shot_free(&s);
        }
    free(pixels);
}

TEST(fourteen_decades_and_one_hot_pixels)
{
    enum { W = 256, H = 256 };
    float *pixels = hdr_pixels(W, H, 3, 12);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    shot s = shoot(&view, NULL);
    int y, rising = 0;
    EXPECT_NEAR(log10(s.stats.high / s.stats.low), 12.9, 0.5);
    for (y = 8; y < H; ++y) rising += s.u8[3 * (y * W + 100) + 1] > s.u8[3 * ((y - 8) * W + 100) + 1] + 12; /* brightness falls downwards */
    EXPECT_EQ(rising, 0);
    shot_free(&s);
    for (y = 0; y < W * H * 3; ++y) pixels[y] = 0;
    for (y = 0; y < 3; ++y) pixels[3 * (100 * W + 50) + y] = 1e8f;
    s = shoot(&view, NULL);
    EXPECT(s.f32[3 * (100 * W + 50) + 1] > 0.15f && s.f32[3 * (100 * W + 50) + 1] <= 0.18f); /* the only light there is: the key */
    EXPECT(s.f32[3 * (100 * W + 51)] == 0);
    shot_free(&s);
    free(pixels);
}

/* ---- formats */

TEST(formats_channels_and_strides)
{
    enum { W = 37, H = 29 };
    float *rgb = room_pixels(W, H, 13), *floats = (float *)malloc(W * H * 4 * sizeof(float));
    uint16_t *halves = (uint16_t *)malloc(W * H * 4 * 2), *shorts = (uint16_t *)malloc(W * H * 3 * 2);
    unsigned char *flipped = (unsigned char *)malloc(W * H * 4);
    sat_image view, other;
    shot a, b;
    tonemap *map;
    int i, c, y;
    for (i = 0; i < W * H; ++i)
        for (c = 0; c < 4; ++c) {
            halves[4 * i + c] = sat__half_from_float(c == 3 ? (float)(i % 3) * 0.4f : rgb[3 * i + c]);
            floats[4 * i + c] = sat__half_to_float(halves[4 * i + c]);
        }
    view = sat_image_f32(floats, W, H, 4);
    other = view;
    other.pixels = halves;
    other.format = SAT_F16;
    other.stride /= 2;
    a = shoot(&view, NULL);
    b = shoot(&other, NULL);
    EXPECT(shot_hash(&a, &view) == shot_hash(&b, &other));
    for (i = 0; i < W * H; i += 7) {
        EXPECT_NEAR(a.f32[4 * i + 3], i % 3 * 0.4, 1e-3);
        EXPECT_NEAR(a.u8[4 * i + 3], i % 3 * 0.4 * 255, 0.6);
    }
    shot_free(&b);
    /* bottom row first, in and out */
    view.pixels = floats + (H - 1) * W * 4;
    view.stride = -view.stride;
    tonemap_create(&map, W, H, NULL);
    EXPECT_EQ(tonemap_apply_u8(map, flipped, W * 4, &view, 0, NULL), SAT_OK);
    tonemap_destroy(map);
    view.pixels = floats;
    view.stride = -view.stride;
    tonemap_create(&map, W, H, NULL);
    EXPECT_EQ(tonemap_apply_u8(map, flipped + (H - 1) * W * 4, -(W * 4), &view, 0, NULL), SAT_OK);
    for (y = 0; y < H; ++y) EXPECT(memcmp(flipped + (H - 1 - y) * W * 4, a.u8 + y * W * 4, W * 4) == 0);
    EXPECT_EQ(tonemap_apply_f32(map, floats, W * 16, &view, 0, NULL), SAT_OK); /* in place */
    EXPECT(memcmp(floats, a.f32, W * H * 16) == 0);
    tonemap_destroy(map);
    shot_free(&a);
    /* integers keep their value */
    for (i = 0; i < W * H * 3; ++i) {
        shorts[i] = (uint16_t)(rgb[i] * 10 + 1);
        floats[i] = (float)shorts[i];
    }
    view = sat_image_f32(floats, W, H, 3);
    other = view;
    other.pixels = shorts;
    other.format = SAT_U16;
    other.stride /= 2;
    a = shoot(&view, NULL);
    b = shoot(&other, NULL);
    EXPECT(shot_hash(&a, &view) == shot_hash(&b, &other));
    shot_free(&a);
    shot_free(&b);
    free(rgb);
    free(floats);
    free(halves);
    free(shorts);
    free(flipped);
}

TEST(grey_is_the_colour_operator_on_equal_channels)
{
    enum { W = 83, H = 54 };
    float *rgb = room_pixels(W, H, 14), *grey = (float *)malloc(W * H * sizeof(float));
    sat_image one = sat_image_f32(grey, W, H, 1), three = sat_image_f32(rgb, W, H, 3);
    shot a, b;
    int i, off = 0;
    for (i = 0; i < W * H; ++i) rgb[3 * i] = rgb[3 * i + 2] = grey[i] = rgb[3 * i + 1];
    a = shoot(&one, NULL);
    b = shoot(&three, NULL);
    for (i = 0; i < W * H; ++i) off += fabsf(a.f32[i] - b.f32[3 * i + 1]) > 1e-5f;
    EXPECT(off <= 2); /* the weights sum to 1 + 1e-7 */
    shot_free(&a);
    shot_free(&b);
    free(rgb);
    free(grey);
}

TEST(codes_are_srgb)
{
    float ramp[4096], out[4096];
    unsigned char codes[4096];
    sat_image view = sat_image_f32(ramp, 4096, 1, 1);
    tonemap_options o = tonemap_defaults();
    tonemap *map = NULL;
    int i, off = 0;
    o.operation = TONEMAP_LINEAR;
    for (i = 0; i < 4096; ++i) ramp[i] = (float)i / 4095;
    tonemap_create(&map, 4096, 1, &o);
    tonemap_apply_u8(map, codes, 4096, &view, 0, NULL);
    tonemap_apply_f32(map, out, 4096 * 4, &view, 0, NULL);
    for (i = 0; i < 4096; ++i) {
        EXPECT_NEAR(codes[i], metrics_code((double)out[i]), 0.61);
        off += codes[i] != (int)(metrics_code((double)out[i]) + 0.5);
        if (i) EXPECT(codes[i] >= codes[i - 1]);
    }
    EXPECT(codes[0] == 0 && codes[4095] == (int)(metrics_code((double)out[4095]) + 0.5));
    EXPECT(off < 300);
    REPORT("sRGB codes that differ from the rounded value", off / 40.96, "%");
    tonemap_destroy(map);
}
