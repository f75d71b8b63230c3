/* Tests of tonemap.h. The implementation is in this file's translation unit, so that private functions can be
   called. */

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
            for (c = 0; c < 3; ++c)
                p[3 * ((size_t)y * (size_t)width + (size_t)x) + (size_t)c] =
                    (float)(light * (1 + 0.4 * sin(5 * u + 2 * c + 3 * v)));
        }
    return p;
}

static uint64_t shot_hash(const shot *s, const sat_image *picture)
{
    size_t n = (size_t)picture->width * (size_t)picture->height * (size_t)picture->channels;
    return support_hash_add(support_hash(s->u8, n), s->f32, n * sizeof(float));
}

/* The photographic local operator without burn-out, as in the thesis; its other options are the defaults. */
static tonemap_options local_options(void)
{
    tonemap_options o = tonemap_defaults();
    o.operation = TONEMAP_PHOTOGRAPHIC_LOCAL;
    o.white = (double)INFINITY;
    return o;
}

static double code_of(float linear) { return metrics_code((double)linear); }

/* ---- arguments */

TEST(defaults_are_as_written)
{
    tonemap_options o = tonemap_defaults();
    EXPECT_EQ(o.operation, TONEMAP_GUIDED);
    EXPECT_NEAR(o.edge, 0.45, 0);
    EXPECT_NEAR(o.key, 0.18, 0);
    EXPECT_NEAR(o.white, 0, 0);
    EXPECT_NEAR(o.phi, 8, 0);
    EXPECT_NEAR(o.epsilon, 0.05, 0);
    EXPECT_EQ(o.scales, 8);
    EXPECT_EQ(o.mesopic, TONEMAP_MESOPIC_OFF);
    EXPECT_NEAR(o.lux_per_cd, 1, 0);
    EXPECT_NEAR(o.gamut, 0.5, 0);
    EXPECT(o.soft == 1 && o.cd_per_unit == 0 && o.selective == 0 && o.adapt_seconds == 0);
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
    const tonemap_options good = local_options();
    const double bad[4] = {(double)NAN, (double)INFINITY, -1, 1e31};
    tonemap_options o;
    int i;
    o = good, o.operation = (tonemap_operator)(TONEMAP_HABLE + 1), refuses(&o);
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
    tonemap_options o = local_options();
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
    o = local_options();
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
    tonemap_options o = local_options();
    tonemap *map = NULL;
    float *pixels = hdr_pixels(50, 40, 3, 1);
    unsigned char *out = (unsigned char *)malloc(50 * 40 * 3);
    sat_image view = sat_image_f32(pixels, 50, 40, 3);
    tonemap_stats stats;
    o.allocator = support_allocator(&memory);
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

TEST(memory_is_as_written)
{
    static const int sizes[][2] = {{1, 1}, {1, 3000}, {3000, 1}, {15, 16}, {640, 480}, {1920, 1080}};
    int i, workers;
    for (i = 0; i < 6; ++i)
        for (workers = 1; workers < 8; workers += 3) {
            tonemap_options o = tonemap_defaults();
            tonemap *map = NULL;
            size_t row = 4 * (size_t)(sizes[i][0] + 31), height = (size_t)sizes[i][1], n = (size_t)workers;
            o.threads = support_threads(workers);
            EXPECT_EQ(tonemap_create(&map, sizes[i][0], sizes[i][1], &o), SAT_OK);
            EXPECT(map->block_size <= row * (height + 80 * n) + 5 * height + 61440 + 32768 * n);
            EXPECT(map->block_size >= (row - 60) * (height + 80 * n));
            tonemap_destroy(map);
        }
}

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
    tonemap_options o = local_options();
    shot s;
    int i, c;
    o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL;
    o.white = white;
    o.gamut = -1;
    o.metering = TONEMAP_METERING_LOG_AVERAGE;
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
    tonemap_options o = local_options();
    shot s;
    int k;
    o.scales = r.scales = scales;
    o.epsilon = r.epsilon = epsilon;
    o.soft = 0;
    o.gamut = -1;
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
TEST(local_operator_with_fewer_scales)
{
    check_local(90, 77, 4, 0.05);
    check_local(40, 30, 1, 0.05);
    check_local(40, 30, 2, 0.05);
}
TEST(local_operator_on_small_and_thin_pictures)
{
    int sizes[][2] = {{1, 1}, {1, 90}, {90, 1}, {2, 3}, {15, 16}, {16, 15}, {17, 33}, {41, 41}, {42, 20}, {3, 200}}, i;
    for (i = 0; i < 10; ++i) check_local(sizes[i][0], sizes[i][1], 8, 0.05);
}
TEST(local_operator_with_a_strict_threshold) { check_local(100, 70, 8, 0.0025); }

/* ---- the guided filter */

static void check_guided(int width, int height, double edge)
{
    size_t n = (size_t)width * (size_t)height, i;
    float *pixels = room_pixels(width, height, 4);
    sat_image view = sat_image_f32(pixels, width, height, 3);
    tonemap_options o = tonemap_defaults();
    double *scaled = metrics_alloc(n), *la = metrics_alloc(n), worst = 0;
    shot s;
    o.edge = edge;
    o.gamut = -1;
    o.white = (double)INFINITY;
    s = shoot(&view, &o);
    reference_luminance(scaled, pixels, n);
    for (i = 0; i < n; ++i) scaled[i] *= 0.18 / s.stats.adapted;
    reference_guided(la, scaled, width, height, edge);
    for (i = 0; i < n; ++i) {
        double gain = 0.18 / s.stats.adapted / (1 + la[i]),
               off = fabs(metrics_code((double)pixels[3 * i + 1] * gain) - metrics_code((double)s.f32[3 * i + 1]));
        if (!(off <= worst)) worst = off;
    }
    EXPECT(worst < 0.12);
    shot_free(&s);
    free(scaled);
    free(la);
    free(pixels);
}

TEST(guided_operator_is_he_2013)
{
    check_guided(150, 131, 0.45);
    check_guided(97, 66, 0.05);
    check_guided(61, 190, 3);
}
/* Steps of 10:1 to 10000:1: how many codes the sides leave their plateaus by. */
TEST(guided_operator_has_no_halos)
{
    enum { W = 160, H = 60 };
    float *pixels = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    double contrast;
    for (contrast = 10; contrast <= 10001; contrast *= 10) {
        double halo[2] = {0, 0};
        int k, i;
        for (k = 0; k < 2; ++k) {
            tonemap_options o = local_options();
            shot s;
            if (k) o.operation = TONEMAP_GUIDED;
            for (i = 0; i < W * H * 3; ++i) pixels[i] = i / 3 % W < W / 2 ? 1.0f : (float)contrast;
            o.metering = TONEMAP_METERING_LOG_AVERAGE;
            s = shoot(&view, &o);
            for (i = 21; i < W - 21; ++i)
                halo[k] = fmax(halo[k], fabs(code_of(s.f32[3 * (30 * W + i)]) -
                                             code_of(s.f32[3 * (30 * W + (i < W / 2 ? 22 : W - 23))])));
            shot_free(&s);
        }
        EXPECT(halo[1] <= 8 && (contrast > 1001 || halo[1] < 0.5 * halo[0]));
        REPORT("halo of the search", halo[0], "codes");
        REPORT("halo of the guided filter", halo[1], "codes");
    }
    free(pixels);
}

TEST(guided_operator_on_small_and_thin_pictures)
{
    int sizes[][2] = {{1, 1}, {1, 40}, {40, 1}, {7, 5}, {20, 20}, {21, 21}, {22, 64}, {25, 129}, {10, 300}, {300, 11}},
        i;
    for (i = 0; i < 10; ++i) check_guided(sizes[i][0], sizes[i][1], 0.45);
}

/* Where the groups of pixels begin and end changes no bit. (Vectors against plain C: tests/same_bits.c.) */
TEST(pixels_do_not_depend_on_their_group)
{
    enum { W = 203, H = 60 };
    float *pixels = room_pixels(W, H, 3), *whole = (float *)calloc(512, sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    unsigned char *out = (unsigned char *)malloc(W * H * 3);
    tonemap *map = NULL;
    int kind, y, differ = 0, x, j;
    for (kind = 0; kind < 3; ++kind) {
        tonemap_options o = local_options();
        tonemap__window window;
        tonemap__worker *w;
        size_t scale[2][10];
        o.soft = 0;
        if (kind == 1) o.soft = 0.7;
        if (kind == 2) o.operation = TONEMAP_ASHIKHMIN;
        tonemap_create(&map, W, H, &o);
        EXPECT_EQ(tonemap_apply_u8(map, out, W * 3, &view, 0, NULL), SAT_OK);
        w = &map->worker[0];
        for (y = 0; y < H; ++y) {
            memset(scale, 0, sizeof scale);
            if (y == 0) memset(tonemap__ring_row(map, w, 0), 0, (size_t)map->ring_row * 4);
            for (j = y == 0 ? 0 : y + map->frame.reach; j < H && j <= y + map->frame.reach; ++j)
                tonemap__add_ring_row(map, w, j);
            tonemap__open_window(&window, map, w, y);
            for (j = 0; j < 2; ++j) /* the row at once, and pixel for pixel */
                for (x = 0; x < W; x += j ? 1 : W) {
                    int end = j ? x + 1 : W;
                    scale[j][0] += (size_t)(end - x);
                    if (kind == 0) tonemap__search_hard(&window, scale[j], x, end);
                    if (kind == 1) tonemap__search_soft(&window, scale[j], x, end);
                    if (kind == 2) tonemap__search_ashikhmin(&window, scale[j], x, end);
                    if (!j) memcpy(whole, w->local, W * sizeof(float));
                }
            differ += memcmp(whole, w->local, W * sizeof(float)) != 0;
            differ += memcmp(scale[0], scale[1], sizeof scale[0]) != 0;
        }
        tonemap_destroy(map);
    }
    EXPECT_EQ(differ, 0);
    for (x = 0; x < 4000; ++x) {
        float v = (float)exp2(-90 + 0.045 * x), a[4], b[4], light[4];
        sat__f32x4_store(a, tonemap__log2_4(sat__f32x4_set1(v)));
        differ += a[2] != sat__log2(v);
        sat__f32x4_store(a, tonemap__exp2_4(sat__f32x4_set1(-50 + 0.025f * (float)x)));
        differ += a[1] != tonemap__exp2(-50 + 0.025f * (float)x);
        sat__f32x4_store(b, tonemap__cbrt4(sat__f32x4_set1(v)));
        sat__f32x4_store(a, tonemap__capacity4(sat__f32x4_set1(v)));
        differ += a[0] != tonemap__capacity(v);
        sat__f32x4_store(light, sat__f32x4_set1(v));
        tonemap__rho_row(a, light, 1, 1);
        differ += a[0] != tonemap__rho(v);
        EXPECT_NEAR(sat__log2(v), -90 + 0.045 * x, 1e-5);
        EXPECT_REL(tonemap__exp2(-50 + 0.025f * (float)x), exp2((double)(-50 + 0.025f * (float)x)), 1e-5);
        if (v > 1 && v < 1e6f) EXPECT_REL(b[3], cbrt((double)v), 5e-5);
    }
    EXPECT_EQ(differ, 0);
    free(out);
    free(whole);
    free(pixels);
}

/* The same of the guided filter and the colours. */
TEST(colours_do_not_depend_on_their_group)
{
    enum { W = 61, H = 40 };
    float *pixels = room_pixels(W, H, 3), gain[W + 3], rho[W + 3];
    sat_image view = sat_image_f32(pixels, W, H, 3);
    unsigned char *out = (unsigned char *)malloc(W * H * 3);
    uint32_t a[2][W + 3], b[2][W + 3];
    float local[2][W + 3];
    int kind, x, y, differ = 0;
    for (kind = 0; kind < 4; ++kind) {
        tonemap_options o = tonemap_defaults();
        tonemap *map = NULL;
        if (kind) o.primaries = TONEMAP_PRIMARIES_2020, o.balance_red = 1.3;
        if (kind == 2) o.gamut = -1, o.peak = 3;
        if (kind == 3) o.operation = TONEMAP_NEUTRAL;
        EXPECT_EQ(tonemap_create(&map, W, H, &o), SAT_OK);
        EXPECT_EQ(tonemap_apply_u8(map, out, W * 3, &view, 0, NULL), SAT_OK);
        for (y = 0; y < H; ++y) {
            const float *luminance = map->luminance + (size_t)y * (size_t)map->row;
            tonemap__shading shading;
            tonemap__planes v[2];
            tonemap__worker *w = &map->worker[0];
            uint32_t *sum = tonemap__guided_ring(map, w, 3, 0), *square = tonemap__guided_ring(map, w, 3, 1);
            tonemap__run fits = {0, W, 1 / 441.0f}, means = {0, W, 1e-3f / 441};
            float steps[W + 3];
            memset(&shading, 0, sizeof shading);
            memset(v, 0, sizeof v);
            shading.pixels = pixels + 3 * y * W;
            shading.luminance = luminance;
            shading.gain = gain;
            shading.rho = kind == 1 ? rho : NULL;
            shading.colours = &map->colours;
            shading.channels = 3;
            shading.floor = kind == 1 ? TONEMAP__CODE_FLOOR : 0;
            shading.most = kind == 3 ? 1e9f : 1;
            shading.gamut = kind == 3 ? -1 : map->frame.gamut;
            for (x = 0; x < W + 3; ++x) {
                gain[x] = 0.1f + (float)(x % 7);
                rho[x] = (float)(x % 5) / 4;
                steps[x] = (float)(x * y % 1153);
            }
            tonemap__shade(v[0], &shading, 0, W);
            for (x = 0; x < W; ++x) {
                int c;
                tonemap__shade(v[1], &shading, x, 1);
                for (c = 0; c < 3; ++c) differ += memcmp(&v[0][c][x], &v[1][c][0], sizeof(float)) != 0;
            }
            for (x = -TONEMAP__RADIUS; x < W + TONEMAP__RADIUS + 4; ++x) {
                sum[x] = (uint32_t)(x + 10) * 5000u;
                square[x] = (uint32_t)(x + 10) * 3000000u + (uint32_t)(x * x * 70 * y);
            }
            tonemap__guided_fit(a[0], b[0], sum, square, &fits, map->frame.edge2);
            tonemap__guided_local(local[0], steps, sum, square, &means);
            for (x = 0; x < W; ++x) {
                fits.x = means.x = x;
                fits.end = means.end = x + 1;
                tonemap__guided_fit(a[1], b[1], sum, square, &fits, map->frame.edge2);
                tonemap__guided_local(local[1], steps, sum, square, &means);
            }
            differ += memcmp(a[0], a[1], W * sizeof a[0][0]) != 0 || memcmp(b[0], b[1], W * sizeof b[0][0]) != 0;
            differ += memcmp(local[0], local[1], W * sizeof local[0][0]) != 0;
        }
        tonemap_destroy(map);
    }
    EXPECT_EQ(differ, 0);
    free(out);
    free(pixels);
}

TEST(same_bits_for_any_number_of_workers)
{
    enum { W = 171, H = 300 };
    float *pixels = room_pixels(W, H, 4);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    float *mask = (float *)malloc(W * H * sizeof(float));
    int counts[] = {1, 2, 3, 7}, kind, i;
    support_fill(mask, W * H, 0, 1, 9);
    pixels[3 * (W * 77 + 50)] = NAN;
    for (kind = 0; kind < 7; ++kind) {
        tonemap_options o = local_options();
        uint64_t hash = 0;
        if (kind == 1) o.mesopic = TONEMAP_MESOPIC_UNIFORM;
        if (kind == 2) o.operation = TONEMAP_ASHIKHMIN;
        if (kind == 3) o.selective = 0.1, o.mesopic = TONEMAP_MESOPIC_LOCAL;
        if (kind == 4) o.soft = 1, o.key = 0, o.white = 0;
        if (kind > 4) o = tonemap_defaults();
        if (kind == 6) o.meter_weights = mask, o.dither = 1, o.encoding = TONEMAP_ENCODING_PQ, o.peak = 2;
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
    free(mask);
}

TEST(units_that_are_powers_of_two_change_no_bit)
{
    enum { W = 90, H = 70, N = W * H * 3 };
    float *pixels = hdr_pixels(W, H, 3, 6), *scaled = (float *)malloc(N * sizeof(float));
    sat_image view = sat_image_f32(scaled, W, H, 3);
    int operation, k, i;
    for (operation = 0; operation <= TONEMAP_HABLE; ++operation) {
        uint64_t hash = 0;
        for (k = -20; k <= 20; k += 5) {
            tonemap_options o = local_options();
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
    for (operation = 0; operation < 5; ++operation) {
        tonemap_options o = local_options();
        shot clean;
        o.operation = (tonemap_operator)operation;
        if (operation == 4) o = tonemap_defaults();
        centre[0] = centre[1] = centre[2] = 0;
        clean = shoot(&view, &o);
        for (i = 0; i < 6; ++i) {
            shot s;
            centre[0] = bad[i];
            centre[1] = centre[2] = i < 3 ? 1 : bad[i];
            s = shoot(&view, &o);
            /* -1 in red alone leaves a positive luminance; that and 1e8 are light, and move the log-average by less
               than a code */
            EXPECT_NEAR(worst_outside(clean.u8, s.u8, W, H), 0, i == 1 || i == 5);
            for (c = 0; c < 3; ++c) { /* unusable pixels show the mean of those around them */
                int shown = s.u8[3 * (H / 2 * W + W / 2) + c], sum = -shown, u, v;
                for (v = -1; v <= 1; ++v)
                    for (u = -1; u <= 1; ++u) sum += s.u8[3 * ((H / 2 + v) * W + W / 2 + u) + c];
                if (i == 0 || i == 2) EXPECT_NEAR(shown, sum / 8.0, 0.5);
                else if (i > 2) EXPECT_EQ(shown, 255);
                else if (c == 0) EXPECT_EQ(shown, 0);
            }
            EXPECT_EQ(s.stats.nan, i == 0);
            EXPECT_EQ(s.stats.negative, i == 2);
            EXPECT_EQ(s.stats.infinite, i == 3 || i == 4); /* the sum of three FLT_MAX overflows */
            shot_free(&s);
        }
        shot_free(&clean);
    }
    free(pixels);
}

/* Infinity is white in any colours, and light beyond the range keeps its place above all else. */
TEST(infinity_is_white)
{
    enum { W = 28, H = 18, INFINITE = 4, MARKS = 6 };
    const float mark[MARKS][3] = {{INFINITY, INFINITY, INFINITY}, {INFINITY, 0, 0}, {0.1f, INFINITY, -1},
                                  {0, 2, INFINITY}, {3e38f, 0, 0}, {3e38f, 3e38f, 3e38f}};
    float p[W * H * 3];
    unsigned char out[W * H * 3];
    int i, k, variant, operation;
    for (operation = 0; operation <= TONEMAP_HABLE; operation++)
        for (variant = 0; variant < 8; variant++) {
            tonemap_options o = tonemap_defaults();
            o.operation = (tonemap_operator)operation;
            if (tonemap__left_out(&o)) continue;
            o.primaries = variant & 1 ? TONEMAP_PRIMARIES_2020 : TONEMAP_PRIMARIES_709;
            o.display = variant == 2 ? TONEMAP_PRIMARIES_P3 : TONEMAP_PRIMARIES_709;
            o.mesopic = TONEMAP__HAS_MESOPIC && variant > 3 ? TONEMAP_MESOPIC_LOCAL : TONEMAP_MESOPIC_OFF;
            o.gamut = variant == 6 ? -1 : 0.5;
            if (variant > 5) o.balance_red = 1.5, o.balance_blue = 0.6;
            for (i = 0; i < W * H * 3; i++) p[i] = 0.1f + 0.01f * (float)(i % 30);
            for (k = 0; k < MARKS; k++) memcpy(p + 3 * (2 * W + k + 1), mark[k], sizeof mark[k]);
            EXPECT_EQ(tonemap_once_u8(out, p, W, H, 3, &o), SAT_OK);
            for (k = 0; k < MARKS; k++) {
                const unsigned char *c = out + 3 * (2 * W + k + 1);
                int most = sat__max_int(sat__max_int(c[0], c[1]), c[2]);
                if (k < INFINITE ? !EXPECT(c[0] >= 254 && c[1] >= 254 && c[2] >= 254) : !EXPECT(most > 250))
                    printf("    operator %d, variant %d: mark %d is %d %d %d\n", operation, variant, k, c[0], c[1], c[2]);
            }
        }
}

TEST(any_bits_give_values_from_0_to_1)
{
    enum { W = 64, H = 50, N = W * H * 4 };
    float *pixels = (float *)malloc(N * sizeof(float));
    uint64_t seed = 11;
    int round, i, bad = 0;
    for (round = 0; round < 60; ++round) {
        tonemap_options o = local_options();
        sat_image view = sat_image_f32(pixels, W, H, round % 3 == 0 ? 1 : round % 3 == 1 ? 3 : 4);
        shot s;
        for (i = 0; i < N; ++i) pixels[i] = sat__float_from_bits((uint32_t)support_random(&seed));
        o.operation = (tonemap_operator)(round % (TONEMAP_HABLE + 1));
        o.mesopic = (tonemap_mesopic)(round / 5 % 3);
        o.soft = round & 1;
        o.selective = round & 4;
        o.key = round & 8 ? 0.18 : 0;
        o.white = round & 16 ? 0 : (double)INFINITY;
        o.display = (tonemap_primaries)(round % 3);
        o.encoding = (tonemap_encoding)(round / 7 % 4);
        o.dither = round / 3 & 1;
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
            tonemap_options o = local_options();
            double expected;
            shot s;
            o.operation = (tonemap_operator)operation;
            o.metering = TONEMAP_METERING_LOG_AVERAGE;
            if (automatic) o.key = o.white = 0;
            memset(pixels, 0, W * H * 3 * sizeof(float));
            s = shoot(&view, &o);
            for (i = 0; i < W * H * 3 && s.f32[i] == 0 && s.u8[i] == 0; ++i) {}
            EXPECT_EQ(i, W * H * 3);
            EXPECT_EQ(s.stats.positive, 0);
            shot_free(&s);
            for (i = 0; i < W * H * 3; ++i) pixels[i] = 0.037f;
            s = shoot(&view, &o);
            expected = operation >= 2 || automatic ? 0.18 : 0.18 / 1.18; /* with the estimated white of 1 the curve is a
                                                                            line */
            for (i = 0; i < W * H * 3; i += 31) EXPECT_REL(s.f32[i], expected, operation == 0 ? 2e-4 : 1e-5);
            shot_free(&s);
            o.metering = TONEMAP_METERING_PERCENTILES; /* to half a step of 1/64 octave */
            s = shoot(&view, &o);
            for (i = 0; i < W * H * 3; i += 31) EXPECT_REL(s.f32[i], expected, 0.0056);
            shot_free(&s);
        }
    free(pixels);
}

TEST(fourteen_decades_and_one_hot_pixels)
{
    enum { W = 256, H = 256 };
    float *pixels = hdr_pixels(W, H, 3, 12);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = local_options();
    shot s = shoot(&view, &o);
    int y, rising = 0;
    EXPECT_NEAR(log10(s.stats.high / s.stats.low), 12.9, 0.5);
    for (y = 8; y < H; ++y)
        rising += s.u8[3 * (y * W + 100) + 1] > s.u8[3 * ((y - 8) * W + 100) + 1] + 12; /* brightness falls downwards */
    EXPECT_EQ(rising, 0);
    shot_free(&s);
    for (y = 0; y < W * H * 3; ++y) pixels[y] = 0;
    for (y = 0; y < 3; ++y) pixels[3 * (100 * W + 50) + y] = 1e8f;
    s = shoot(&view, &o);
    EXPECT(s.f32[3 * (100 * W + 50) + 1] > 0.15f &&
           s.f32[3 * (100 * W + 50) + 1] <= 0.18f); /* the only light there is: the key */
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
    view.stride = 0; /* packed */
    EXPECT_EQ(tonemap_apply_u8(map, flipped, 0, &view, 0, NULL), SAT_OK);
    EXPECT(memcmp(flipped, a.u8, W * 4 * H) == 0);
    EXPECT_EQ(tonemap_apply_f32(map, floats, W * 16, &view, 0, NULL), SAT_OK); /* in place */
    EXPECT(memcmp(floats, a.f32, W * H * 16) == 0);
    tonemap_destroy(map);
    shot_free(&a);
    /* integers keep their value */
    for (i = 0; i < W * H * 3; ++i) {
        shorts[i] = (uint16_t)(rgb[i] < 6000 ? rgb[i] * 10 + 1 : 60001); /* beyond 65535 a conversion says nothing */
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
    tonemap_options o = local_options();
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

/* ---- leaving out searches */


/* Michael 2010, section 4.4: where the Sobel gradient is small La is the pixel itself. */
TEST(selective_searches_only_edges)
{
    enum { W = 97, H = 66 };
    float *pixels = room_pixels(W, H, 24);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = local_options();
    shot full = shoot(&view, &o), global, selective;
    double *lr = metrics_alloc(W * H), average = full.stats.adapted;
    int x, y, wrong = 0, marked = 0;
    o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL;
    global = shoot(&view, &o);
    o.operation = TONEMAP_PHOTOGRAPHIC_LOCAL;
    o.selective = 0.1;
    selective = shoot(&view, &o);
    reference_luminance(lr, pixels, W * H);
    for (y = 0; y < H; ++y)
        for (x = 0; x < W; ++x) {
            double g[2] = {0, 0}, size;
            int i, j;
            for (j = -1; j <= 1; ++j)
                for (i = -1; i <= 1; ++i) {
                    int px = x + i < 0    ? 0
                             : x + i >= W ? W - 1
                                          : x + i,
                        py = y + j < 0    ? 0
                             : y + j >= H ? H - 1
                                          : y + j;
                    double v = 0.18 / average * lr[py * W + px];
                    g[0] += i * (2 - abs(j)) * v;
                    g[1] += j * (2 - abs(i)) * v;
                }
            size = hypot(g[0], g[1]);
            marked += size > 0.1;
            if (fabs(size - 0.1) < 1e-4) continue;
            wrong +=
                memcmp(selective.f32 + 3 * (y * W + x), (size > 0.1 ? full : global).f32 + 3 * (y * W + x), 12) != 0;
        }
    EXPECT_EQ(wrong, 0);
    EXPECT(marked > 100 && marked < W * H - 100);
    EXPECT(selective.stats.skipped > 0);
    EXPECT_EQ(selective.stats.skipped + selective.stats.searched, W * H);
    shot_free(&full);
    shot_free(&global);
    shot_free(&selective);
    free(lr);
    free(pixels);
}

/* ---- mesopic vision */

/* Random colours inside Rec. 709, against the eight steps of section A.5.3 with the pixel's own white. */
static void check_mesopic(tonemap_mesopic mode, double cd)
{
    enum { W = 64, H = 64 };
    float *pixels = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = local_options();
    double *luminance = metrics_alloc(W * H), worst = 0;
    shot s;
    int i, c;
    support_fill(pixels, W * H * 3, 0, 1, 31);
    for (i = 0; i < W * H; i += 5) pixels[3 * i + 1] = pixels[3 * i + 2] = 0; /* primaries, too */
    for (i = 1; i < W * H; i += 7) pixels[3 * i] = pixels[3 * i + 1] = 0;
    o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL;
    o.mesopic = mode;
    o.cd_per_unit = cd;
    o.lux_per_cd = 2;
    s = shoot(&view, &o);
    reference_luminance(luminance, pixels, W * H);
    for (i = 0; i < W * H; ++i) {
        double rgb[3], lr = 0.18 * luminance[i] / s.stats.adapted;
        double rho = reference_rho(2 * (cd > 0 ? cd : 1 / s.stats.adapted) *
                                   (mode == TONEMAP_MESOPIC_UNIFORM ? s.stats.adapted : luminance[i]));
        reference_colour(rgb, pixels + 3 * i, lr / (1 + lr), rho, 0);
        for (c = 0; c < 3; ++c) {
            double off = fabs(metrics_code(rgb[c]) - code_of(s.f32[3 * i + c]));
            if (!(off <= worst)) worst = off;
        }
    }
    REPORT("mesopic filter against Lab, largest", worst, "codes");
    EXPECT(worst <= 1); /* 8-bit codes */
    shot_free(&s);
    free(luminance);
    free(pixels);
}

TEST(mesopic_filter_is_eq_A10_to_A14)
{
    double lux;
    check_mesopic(TONEMAP_MESOPIC_UNIFORM, 0);
    check_mesopic(TONEMAP_MESOPIC_LOCAL, 0);
    check_mesopic(TONEMAP_MESOPIC_UNIFORM, 0.01);
    check_mesopic(TONEMAP_MESOPIC_UNIFORM, 3);
    check_mesopic(TONEMAP_MESOPIC_LOCAL, 1e-6);
    check_mesopic(TONEMAP_MESOPIC_LOCAL, 0.5);
    check_mesopic(TONEMAP_MESOPIC_LOCAL, 8);
    EXPECT_NEAR(tonemap__rho(0), 22.0 / 57, 2e-3);
    for (lux = 1e-9; lux < 20; lux *= 1.1)
        EXPECT_NEAR(tonemap__rho((float)lux), reference_rho(lux), lux > 1e-6 ? 1e-3 : 2e-3);
    EXPECT_NEAR(tonemap__rho(9.99f), 1, 2e-4);
    EXPECT(tonemap__rho(10) == 1 && tonemap__rho(FLT_MAX) == 1);
}

TEST(bright_scenes_and_greys_are_not_mesopic)
{
    enum { W = 60, H = 40 };
    float *pixels = room_pixels(W, H, 32);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = local_options();
    shot plain = shoot(&view, &o), bright;
    int i, mode;
    for (mode = 1; mode <= 2; ++mode) {
        o.mesopic = (tonemap_mesopic)mode;
        o.cd_per_unit = 1e6;
        bright = shoot(&view, &o);
        EXPECT(memcmp(plain.f32, bright.f32, W * H * 12) == 0);
        shot_free(&bright);
    }
    shot_free(&plain);
    for (i = 0; i < W * H * 3; i += 3) pixels[i] = pixels[i + 2] = pixels[i + 1];
    o.mesopic = TONEMAP_MESOPIC_OFF;
    plain = shoot(&view, &o);
    o.mesopic = TONEMAP_MESOPIC_LOCAL;
    o.cd_per_unit = 1e-3;
    bright = shoot(&view, &o);
    for (i = 0; i < W * H * 3; ++i) EXPECT_NEAR(plain.f32[i], bright.f32[i], 2e-5);
    shot_free(&plain);
    shot_free(&bright);
    free(pixels);
}

TEST(a_red_lamp_stays_red_only_with_the_local_filter)
{
    enum { W = 80, H = 80, LAMP = 3 * (40 * W + 40), WALL = 3 * (5 * W + 5) };
    float *pixels = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = local_options();
    shot off, uniform, local;
    int x, y;
    for (y = 0; y < H; ++y)
        for (x = 0; x < W; ++x) {
            int lamp = abs(x - 40) < 8 && abs(y - 40) < 8;
            pixels[3 * (y * W + x)] = lamp ? 100.0f : 0.02f;
            pixels[3 * (y * W + x) + 1] = pixels[3 * (y * W + x) + 2] = lamp ? 10.0f : 0.002f;
        }
    o.cd_per_unit = 1;
    o.white = 0;
    off = shoot(&view, &o);
    o.mesopic = TONEMAP_MESOPIC_UNIFORM;
    o.cd_per_unit = 0.05;
    uniform = shoot(&view, &o);
    o.mesopic = TONEMAP_MESOPIC_LOCAL;
    o.cd_per_unit = 1;
    local = shoot(&view, &o);
    EXPECT_NEAR(local.u8[LAMP + 1], off.u8[LAMP + 1], 1);
    EXPECT(uniform.u8[LAMP + 1] > off.u8[LAMP + 1]);
    EXPECT(local.u8[WALL] < off.u8[WALL] - 10 && local.u8[WALL + 1] > off.u8[WALL + 1]);
    shot_free(&off);
    shot_free(&uniform);
    shot_free(&local);
    free(pixels);
}

/* ---- Ashikhmin */

TEST(capacity_is_continuous_and_rises)
{
    double cd, before = 0;
    for (cd = 1e-5; cd < 1e6; cd *= 1.01) {
        double c = (double)tonemap__capacity((float)cd);
        EXPECT_NEAR(c, reference_capacity(cd, 1), 4e-4 + 2e-6 * c);
        EXPECT(c > before && c - before < 1.3);
        EXPECT_NEAR(c, reference_capacity(cd, 0), 0.05);
        before = c;
    }
}

static void check_ashikhmin(tonemap_operator operation, double cd)
{
    enum { W = 140, H = 111, N = W * H };
    float *pixels = room_pixels(W, H, 41);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = local_options();
    double *luminance = metrics_alloc(N), *rounded = metrics_alloc(N), *la = metrics_alloc(N), low, high, unit, octave;
    int i, k, off = 0;
    shot s;
    tonemap *map = NULL;
    o.operation = operation;
    o.cd_per_unit = cd;
    o.gamut = -1;
    s = shoot(&view, &o);
    tonemap_create(&map, W, H, &o);
    tonemap_apply_u8(map, s.u8, W * 3, &view, 0, NULL);
    low = exp2(map->state[TONEMAP__LOW]);
    high = exp2(map->state[TONEMAP__HIGH]);
    tonemap_destroy(map);
    reference_luminance(luminance, pixels, N);
    unit = cd > 0 ? cd : 10 / s.stats.adapted;
    octave = exp2(ceil(log2(high)));
    for (i = 0; i < N; ++i) {
        rounded[i] = luminance[i] / octave < 1 ? luminance[i] / octave : 1;
        rounded[i] = floor(rounded[i] * 1048576 + 0.5) / 1048576;
    }
    if (operation == TONEMAP_ASHIKHMIN) reference_ashikhmin(la, rounded, W, H, 0);
    for (i = 0; i < N; ++i) {
        double rgb[3], c0 = reference_capacity(low * unit, 1), c1 = reference_capacity(high * unit, 1), tm;
        double a = operation == TONEMAP_ASHIKHMIN ? la[i] * octave : luminance[i];
        if (rounded[i] * 1048576 < 64) continue; /* the operator takes the pixel itself unrounded */
        tm = (reference_capacity(a * unit, 1) - c0) / (c1 - c0);
        reference_colour(rgb, pixels + 3 * i, (tm > 0 ? tm : 0) * luminance[i] / a, 1, 1);
        for (k = 1, rgb[1] = rgb[1] < 0 ? 0 : rgb[1] > 1 ? 1 : rgb[1]; k < 2; ++k)
            off += fabs(rgb[k] - (double)s.f32[3 * i + k]) > 2e-3 * rgb[k] + 2e-4;
    }
    EXPECT(off <= N / 200);
    shot_free(&s);
    free(luminance);
    free(rounded);
    free(la);
    free(pixels);
}

TEST(ashikhmin_is_its_equations)
{
    check_ashikhmin(TONEMAP_ASHIKHMIN_GLOBAL, 0);
    check_ashikhmin(TONEMAP_ASHIKHMIN_GLOBAL, 50);
    check_ashikhmin(TONEMAP_ASHIKHMIN, 0);
    check_ashikhmin(TONEMAP_ASHIKHMIN, 0.01);
}

TEST(a_firefly_does_not_darken_ashikhmin)
{
    enum { W = 200, H = 160 };
    float *pixels = room_pixels(W, H, 42), *centre = pixels + 3 * (H / 2 * W + W / 2);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = local_options();
    shot clean, firefly;
    o.operation = TONEMAP_ASHIKHMIN;
    clean = shoot(&view, &o);
    centre[0] = centre[1] = centre[2] = 5e9f; /* a million times the largest */
    firefly = shoot(&view, &o);
    EXPECT(worst_outside(clean.u8, firefly.u8, W, H) <= 1);
    shot_free(&clean);
    shot_free(&firefly);
    free(pixels);
}

/* Whatever its size: a pixel's part of the meter, nothing with a fixed exposure but the rounding of the key. */
TEST(a_firefly_moves_the_meter_by_one_pixel)
{
    enum { W = 120, H = 90 };
    static const float sizes[] = {1e4f, 1e8f, 1e30f};
    uint64_t seed;
    int operation, k, fixed;
    for (operation = 0; operation <= TONEMAP_HABLE; operation++)
        for (fixed = 0; fixed < 2; fixed++)
            for (seed = 1; seed < 4; seed++) {
                float *pixels = room_pixels(W, H, 60 + seed), *centre = pixels + 3 * (H / 2 * W + W / 2);
                sat_image view = sat_image_f32(pixels, W, H, 3);
                tonemap_options o = tonemap_defaults();
                shot clean, firefly[3];
                o.operation = (tonemap_operator)operation;
                o.exposure = fixed;
                clean = shoot(&view, &o);
                for (k = 0; k < 3; k++) {
                    centre[0] = centre[1] = centre[2] = sizes[k];
                    firefly[k] = shoot(&view, &o);
                    EXPECT(worst_outside(clean.u8, firefly[k].u8, W, H) <= (fixed ? 1 : 3));
                    EXPECT(worst_outside(firefly[0].u8, firefly[k].u8, W, H) <= 1);
                }
                shot_free(&clean);
                for (k = 0; k < 3; k++) shot_free(&firefly[k]);
                free(pixels);
            }
}

/* ---- key and white */

TEST(key_and_white_are_reinhards_estimate)
{
    enum { W = 200, H = 150, N = W * H };
    float *pixels = hdr_pixels(W, H, 3, 51);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = local_options();
    double *sorted = metrics_alloc(N), low, high, average, bright = 0;
    int i;
    shot s;
    o.key = o.white = 0;
    o.metering = TONEMAP_METERING_LOG_AVERAGE;
    s = shoot(&view, &o);
    reference_luminance(sorted, pixels, N);
    average = log2(reference_log_average(sorted, N));
    qsort(sorted, N, sizeof *sorted, support_compare_doubles);
    low = log2(sorted[N / 100]);
    high = log2(sorted[N - N / 100]);
    EXPECT_NEAR(log2(s.stats.low), low, 1.0 / 16);
    EXPECT_NEAR(log2(s.stats.high), high, 1.0 / 16);
    EXPECT_REL(s.stats.key, 0.18 * pow(4, (2 * average - low - high) / (high - low)), 0.02);
    for (i = N - N / 200; i < N - N / 2000; ++i) bright += log2(sorted[i]) / (N / 200 - N / 2000);
    EXPECT_NEAR(log2(s.stats.white), fmin(log2(1.5) + high - low - 5, bright + log2(s.stats.key) - average), 0.3);
    shot_free(&s);
    free(sorted);
    free(pixels);
}

/* ---- adaptation */

static tonemap *adapting(int width, int height, double seconds)
{
    tonemap_options o = local_options();
    tonemap *map = NULL;
    o.adapt_seconds = seconds;
    o.metering = TONEMAP_METERING_LOG_AVERAGE;
    o.key = o.white = 0;
    EXPECT_EQ(tonemap_create(&map, width, height, &o), SAT_OK);
    return map;
}

static double frame(tonemap *map, float light, double dt)
{
    static float pixels[16 * 16];
    static unsigned char out[16 * 16];
    sat_image view = sat_image_f32(pixels, 16, 16, 1);
    tonemap_stats stats;
    int i;
    for (i = 0; i < 256; ++i) pixels[i] = light * (1 + (float)(i % 9));
    EXPECT_EQ(tonemap_apply_u8(map, out, 16, &view, dt, &stats), SAT_OK);
    return log2(stats.adapted / (double)light);
}

TEST(adaptation_follows_the_clock_not_the_frames)
{
    tonemap *map = adapting(16, 16, 0.5), *twin = adapting(16, 16, 0.5);
    double steady = frame(map, 1, 0), v, step = log2(1e9);
    int i;
    frame(twin, 1, 0);
    EXPECT_NEAR(frame(map, 1e9f, 0), steady - step, 1e-4);                            /* no time, no change */
    EXPECT_NEAR(frame(map, 1e9f, 1e-6), steady - step * exp(-2e-6), 1e-4);
    for (i = 0; i < 10; ++i) v = frame(map, 1e9f, 0.05);                              /* ten small steps ... */
    EXPECT_NEAR(v, steady - step * exp(-1 - 2e-6), 1e-4);
    frame(twin, 1e9f, 1e-6);
    EXPECT_NEAR(frame(twin, 1e9f, 0.5), v, 1e-6);                                     /* ... are one large */
    EXPECT_NEAR(frame(map, 1e9f, 1), steady - step * exp(-3 - 2e-6), 1e-4);
    EXPECT_NEAR(frame(map, 1e9f, 1e6), steady, 1e-5);
    EXPECT_NEAR(frame(map, 1e-9f, (double)INFINITY), steady, 1e-5);
    tonemap_destroy(map);
    tonemap_destroy(twin);
}

TEST(black_frames_leave_the_adaptation_alone)
{
    tonemap *map = adapting(16, 16, 1);
    double steady;
    frame(map, 0, 1);                       /* black first: the next picture is the first to be seen */
    steady = frame(map, 4, 1);
    EXPECT_NEAR(frame(map, 4, 1), steady, 1e-12);
    frame(map, 0, 100);
    EXPECT_NEAR(frame(map, 4, 0), steady, 1e-12);
    tonemap_destroy(map);
}

/* A camera that turns over an unchanging scene: what it sees keeps its bits, there is no trail. */
TEST(a_pan_leaves_no_trail)
{
    enum { W = 96, H = 64, WIDE = 4 * W };
    float *scene = room_pixels(W, H, 61), *wide = (float *)malloc(WIDE * H * 3 * sizeof(float));
    unsigned char *a = (unsigned char *)malloc(W * H * 3), *b = (unsigned char *)malloc(W * H * 3);
    tonemap *map = adapting(W, H, 0.5), *still = adapting(W, H, 0.5);
    int x, y, i, step;
    for (y = 0; y < H; ++y)                 /* periodic: the same pixels in every frame, in another place */
        for (i = 0; i < 4; ++i) memcpy(wide + 3 * (y * WIDE + i * W), scene + 3 * y * W, W * 12);
    for (step = 0; step < 30; ++step) {
        sat_image view = sat_image_f32(wide + 3 * (step * 7), W, H, 3);
        int differ = 0;
        view.stride = WIDE * 12;
        EXPECT_EQ(tonemap_apply_u8(map, a, W * 3, &view, 0.02, NULL), SAT_OK);
        view.pixels = wide;
        EXPECT_EQ(tonemap_apply_u8(still, b, W * 3, &view, 0.02, NULL), SAT_OK);
        for (y = 0; y < H; ++y)             /* away from the borders, whose boxes are clipped */
            for (x = 21; x < W - 21; ++x) {
                int from = x + step * 7 % W;
                if (from < 21 || from >= W - 21) continue;
                differ += memcmp(a + 3 * (y * W + x), b + 3 * (y * W + from), 3) != 0;
            }
        EXPECT_EQ(differ, 0);
    }
    tonemap_destroy(map);
    tonemap_destroy(still);
    free(scene);
    free(wide);
    free(a);
    free(b);
}

TEST(options_change_between_frames)
{
    tonemap *map = adapting(16, 16, 10);
    tonemap_options o = local_options();
    double steady = frame(map, 1, 0);
    o.adapt_seconds = 10;
    o.metering = TONEMAP_METERING_LOG_AVERAGE;
    o.operation = TONEMAP_ASHIKHMIN;
    EXPECT_EQ(tonemap_set_options(map, &o), SAT_OK);
    EXPECT_NEAR(frame(map, 1, 0.1), steady, 1e-4);
    o = local_options(), o.metering = TONEMAP_METERING_LOG_AVERAGE;
    EXPECT_EQ(tonemap_set_options(map, &o), SAT_OK);
    EXPECT_NEAR(frame(map, 100, 0), steady, 1e-4);  /* without adaptation each picture is for itself */
    tonemap_destroy(map);
}

/* ---- soft scales */

static void flicker(double soft, double *rms, double *largest)
{
    enum { W = 160, H = 120, N = W * H };
    float *pixels = room_pixels(W, H, 71), *noisy = (float *)malloc(N * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3), other = sat_image_f32(noisy, W, H, 3);
    tonemap_options o = local_options();
    uint64_t seed = 5;
    double *a = metrics_alloc(N), *b = metrics_alloc(N);
    metrics_codes m;
    shot s, t;
    int i;
    for (i = 0; i < N * 3; ++i) {
        if (i % 3 == 0) noisy[i] = (float)(1 + 0.01 * (support_uniform(&seed) - 0.5));
        else noisy[i] = noisy[i - i % 3] * pixels[i] ;
        if (i % 3 == 2) noisy[i - 2] *= pixels[i - 2];
    }
    o.soft = soft < 0 ? 0 : soft;
    if (soft < 0) o.operation = TONEMAP_GUIDED;
    o.metering = TONEMAP_METERING_LOG_AVERAGE; /* which moves with the noise */
    o.gamut = -1; /* about the scales alone: what is clipped does not flicker */
    s = shoot(&view, &o);
    t = shoot(&other, &o);
    for (i = 0; i < N; ++i) {
        a[i] = code_of(s.f32[3 * i + 1]);
        b[i] = code_of(t.f32[3 * i + 1]);
    }
    m = metrics_compare_codes(a, b, N);
    *rms = m.rms;
    *largest = m.largest;
    shot_free(&s);
    shot_free(&t);
    free(a);
    free(b);
    free(pixels);
    free(noisy);
}

TEST(soft_scales_flicker_less)
{
    double hard[2], soft[2], guided[2];
    flicker(-1, &guided[0], &guided[1]);
    REPORT("guided operator under 0.5 % noise, RMS", guided[0], "codes");
    REPORT("guided operator under 0.5 % noise, largest", guided[1], "codes");
    EXPECT(guided[0] <= 0.3 && guided[1] < 1);
    flicker(0, &hard[0], &hard[1]);
    flicker(1, &soft[0], &soft[1]);
    REPORT("hard scales under 0.5 % noise, RMS", hard[0], "codes");
    REPORT("hard scales under 0.5 % noise, largest", hard[1], "codes");
    REPORT("soft scales under 0.5 % noise, RMS", soft[0], "codes");
    REPORT("soft scales under 0.5 % noise, largest", soft[1], "codes");
    EXPECT(soft[0] < 0.85 * hard[0] && soft[1] < 0.5 * hard[1] && soft[0] <= 0.3 && soft[1] <= 10);
}

/* ---- options: each row of the table */

static void set_field(const sat__field *field, tonemap_options *o, double value) { sat__field_set(field, o, value); }

/* Refused by create and by set_options, and named. */
static void refused_and_named(const tonemap_options *o, const char *name)
{
    char text[200];
    refuses(o);
    EXPECT(tonemap_explain(text, sizeof text, 8, 8, o) == text);
    EXPECT(strncmp(text, name, strlen(name)) == 0);
}

TEST(every_option_is_checked_and_named)
{
    int i, k;
    char text[200];
    tonemap *map = NULL;
    for (i = 0; i < SAT__COUNT(tonemap__fields); ++i) {
        const sat__field *f = &tonemap__fields[i];
        tonemap_options o = local_options();
        const double good[3] = {f->low, f->high, f->initial};
        if (f->type == 't' || f->type == 'a') continue;
        for (k = 0; k < 3; ++k) {
            set_field(f, &o, good[k]);
            EXPECT_EQ(tonemap_create(&map, 8, 8, &o), SAT_OK);
            EXPECT(tonemap_explain(text, sizeof text, 8, 8, &o)[0] == 0);
            tonemap_destroy(map);
        }
        set_field(f, &o, f->high + (f->type == 'i' ? 1 : fabs(f->high) * 1e-6));
        refused_and_named(&o, f->name);
        if (f->also != '-') {
            set_field(f, &o, f->low - (f->type == 'i' ? 1 : fabs(f->low) * 1e-6 + 1e-12));
            refused_and_named(&o, f->name);
        }
        if (f->type != 'd') continue;
        set_field(f, &o, (double)NAN);
        refused_and_named(&o, f->name);
    }
    EXPECT(strncmp(tonemap_explain(text, sizeof text, 0, 8, NULL), "width is 0; 1..", 15) == 0);
    EXPECT(strstr(tonemap_explain(text, sizeof text, 8, -1, NULL), "height is -1") == text);
    EXPECT(tonemap_explain(text, 4, 0, 8, NULL) == text && strcmp(text, "wid") == 0);
    EXPECT(tonemap_explain(NULL, 0, 0, 8, NULL) == NULL);
}

/* ---- colours beyond the display */

/* Degrees of HSV hue. */
static double hue_of(double r, double g, double b)
{
    return atan2(sqrt(3.0) * (g - b), 2 * r - g - b) * 57.29577951308232;
}

TEST(bright_colours_keep_their_hue)
{
    enum { W = 64, H = 48 };
    const double exponent[3] = {0, 0.5, 1};
    float *pixels = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    uint64_t seed = 7;
    int k, i, c, wrong = 0, clipped = 0, wrong_clipped = 0, outside = 0;
    for (i = 0; i < W * H; ++i) {
        double light = exp2(12 * support_uniform(&seed) - 6);
        for (c = 0; c < 3; ++c) pixels[3 * i + c] = (float)(light * (0.02 + support_uniform(&seed)));
    }
    for (k = 0; k < 4; ++k) {
        tonemap_options o = local_options();
        shot s;
        o.operation = TONEMAP_LINEAR;
        o.gamut = k < 3 ? exponent[k] : -1;
        s = shoot(&view, &o);
        for (i = 0; i < W * H; ++i) {
            const float *p = pixels + 3 * i, *q = s.f32 + 3 * i;
            double top = (double)(q[0] > q[1] ? q[0] : q[1]), off, low = (double)(q[0] < q[1] ? q[0] : q[1]);
            top = (double)q[2] > top ? (double)q[2] : top;
            low = (double)q[2] < low ? (double)q[2] : low;
            outside += !(top <= 1 && low >= 0);
            if (top < 0.9999 || top - low < 0.02) continue; /* inside; or white, which has no hue */
            off = fabs(hue_of((double)p[0], (double)p[1], (double)p[2]) -
                       hue_of((double)q[0], (double)q[1], (double)q[2]));
            off = off > 180 ? 360 - off : off;
            if (k < 3) wrong += off > 1;
            else wrong_clipped += off > 15;
            clipped += k < 3;
        }
        shot_free(&s);
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(outside, 0);
    EXPECT(clipped > 1000 && wrong_clipped > 100);
    free(pixels);
}

/* A lamp that is brighter than its surround looks so, whatever its colour. */
TEST(a_brighter_lamp_is_not_darker)
{
    enum { W = 60, H = 50 };
    float *pixels = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    int i, c;
    shot s;
    const unsigned char *lamp, *wall;
    for (i = 0; i < W * H * 3; ++i) pixels[i] = 1;
    for (i = 0; i < W * H; ++i)
        if (abs(i % W - 30) < 6 && abs(i / W - 25) < 6) pixels[3 * i] = pixels[3 * i + 1] = 0, pixels[3 * i + 2] = 1e4f;
    s = shoot(&view, NULL);
    lamp = s.u8 + 3 * (25 * W + 30), wall = s.u8;
    for (c = 0; c < 3; ++c) EXPECT(lamp[c] >= wall[c]);
    EXPECT(lamp[2] == 255 && lamp[0] < 255);
    shot_free(&s);
    free(pixels);
}

/* Ringing of a resampled picture: negative luminances beside a lamp are no black ring. */
TEST(no_black_ring_round_a_lamp)
{
    enum { W = 60, H = 50, AT = 25 * W + 30 };
    float *pixels = (float *)malloc(W * H * 3 * sizeof(float)), *flat = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap *map = NULL;
    int i;
    shot s;
    for (i = 0; i < W * H * 3; ++i) pixels[i] = 0.5f;
    for (i = 0; i < 3; ++i) pixels[3 * AT + i] = 800, pixels[3 * (AT - 1) + i] = pixels[3 * (AT + 1) + i] = -40;
    s = shoot(&view, NULL);
    EXPECT_EQ(s.stats.negative, 2);
    EXPECT(s.u8[3 * (AT - 1)] >= s.u8[0] && s.u8[3 * (AT + 1)] >= s.u8[0] && s.u8[3 * AT] == 255);
    memcpy(flat, pixels, W * H * 3 * sizeof(float)); /* in place: the same */
    view.pixels = flat;
    EXPECT_EQ(tonemap_create(&map, W, H, NULL), SAT_OK);
    EXPECT_EQ(tonemap_apply_f32(map, flat, W * 12, &view, 0, NULL), SAT_OK);
    EXPECT(memcmp(flat, s.f32, W * H * 3 * sizeof(float)) == 0);
    tonemap_destroy(map);
    shot_free(&s);
    free(flat);
    free(pixels);
}

/* ---- curves, displays, colours */

/* Light from 2^-14 to 2^10 in strong colours, exposed by 1. */
static float *curve_pixels(int n, uint64_t seed)
{
    float *p = (float *)malloc((size_t)n * 3 * sizeof(float));
    int i, c;
    for (i = 0; i < n; ++i) {
        double light = exp2(-14 + 24 * support_uniform(&seed));
        for (c = 0; c < 3; ++c) p[3 * i + c] = (float)(light * pow(support_uniform(&seed), 3));
    }
    return p;
}

TEST(curves_are_as_published)
{
    enum { W = 80, H = 50 };
    float *pixels = curve_pixels(W * H, 3);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    int curve, i, c, k;
    for (curve = 0; curve < 4; ++curve) {
        tonemap_options o = tonemap_defaults();
        double worst = 0, largest = 0;
        shot s;
        o.operation = (tonemap_operator)(TONEMAP_NEUTRAL + curve);
        o.exposure = 1;
        s = shoot(&view, &o);
        for (i = 0; i < W * H; ++i) {
            double in[3], out[3];
            for (c = 0; c < 3; ++c) in[c] = (double)pixels[3 * i + c];
            reference_curve(out, in, curve);
            for (c = 0; c < 3; ++c) {
                worst = fmax(worst, fabs(out[c] - (double)s.f32[3 * i + c]));
                largest = fmax(largest, out[c]);
                k = (int)(metrics_code(out[c]) + 0.5);
                EXPECT(abs(k - (int)s.u8[3 * i + c]) <= 1);
            }
        }
        EXPECT(worst < 1e-4 && largest > 0.95);
        shot_free(&s);
    }
    free(pixels);
}

/* Ld = L / (1 + L / peak) in units of paper, white at the peak; bytes have 255 there. */
TEST(a_bright_display_compresses_less)
{
    enum { W = 64, H = 4 };
    float pixels[W * H * 3];
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = tonemap_defaults();
    int i, k;
    for (i = 0; i < W * H * 3; ++i) pixels[i] = (float)exp2(i / 3 % W / 4.0 - 8);
    o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL;
    o.exposure = 1;
    o.peak = 4;
    for (k = 0; k < 2; ++k) {
        shot s;
        o.white = k ? 100 : (double)INFINITY;
        s = shoot(&view, &o);
        for (i = 0; i < W * H * 3; i += 5) {
            double l = (double)pixels[i], ld = fmin(l * (k ? 1 + l * 4 / 1e4 : 1) / (1 + l / 4), 4);
            EXPECT_REL(s.f32[i], ld, 1e-5);
            EXPECT_NEAR(s.u8[i], metrics_code(ld / 4), 1);
        }
        shot_free(&s);
    }
    /* colours keep their hue up to the peak */
    for (i = 0; i < W * H * 3; ++i) pixels[i] = i % 3 ? 0.1f : 1e4f;
    {
        shot s;
        o.operation = TONEMAP_GUIDED;
        s = shoot(&view, &o);
        EXPECT_NEAR(s.f32[0], 4, 1e-5);
        EXPECT(s.f32[1] < 4 && s.f32[1] >= 0);
        shot_free(&s);
    }
}

TEST(pq_and_hlg_are_their_standards)
{
    enum { W = 64, H = 2 };
    float pixels[W * H * 3];
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = tonemap_defaults();
    shot s, linear;
    int i, c;
    double cd, pq_white, hlg_white;
    for (cd = 1e-3; cd <= 1e4; cd *= 1.3) EXPECT_NEAR(tonemap__pq((float)cd), reference_pq(cd), 3e-4);
    for (cd = 1e-5; cd <= 1; cd *= 1.3) EXPECT_NEAR(tonemap__hlg((float)cd), reference_hlg(cd), 1e-5);
    EXPECT_NEAR(tonemap__pq(0), 0, 1e-6);
    EXPECT_NEAR(tonemap__hlg(1), 1, 1e-5);
    for (i = 0; i < W * H; ++i)
        for (c = 0; c < 3; ++c) pixels[3 * i + c] = (float)exp2(i % W / 6.0 - 6) * (c == 1 ? 1 : c ? 0.5f : 0.8f);
    o.operation = TONEMAP_LINEAR;
    o.white = (double)INFINITY;
    o.exposure = 1;
    o.peak = 1000 / 203.0;
    linear = shoot(&view, &o);
    o.encoding = TONEMAP_ENCODING_PQ;
    s = shoot(&view, &o);
    for (i = 0; i < W * H * 3; ++i) EXPECT_NEAR(s.f32[i], reference_pq(203 * (double)linear.f32[i]), 3e-4);
    shot_free(&s);
    o.encoding = TONEMAP_ENCODING_HLG;
    s = shoot(&view, &o);
    for (i = 0; i < W * H; ++i) {
        double y = 0;
        const double luma[3] = {0.2126, 0.7152, 0.0722};
        for (c = 0; c < 3; ++c) y += luma[c] * (double)linear.f32[3 * i + c] * 0.203;
        for (c = 0; c < 3; ++c)
            EXPECT_NEAR(s.f32[3 * i + c],
                        reference_hlg(fmin((double)linear.f32[3 * i + c] * 0.203 * pow(y, 1 / 1.2 - 1), 1)), 1e-3);
    }
    shot_free(&s);
    shot_free(&linear);
    /* ITU-R BT.2408: paper is 58 % of PQ and 75 % of HLG on a display of 1000 cd/m2 */
    for (i = 0; i < W * H * 3; ++i) pixels[i] = 1;
    s = shoot(&view, &o);
    hlg_white = (double)s.f32[0];
    shot_free(&s);
    o.encoding = TONEMAP_ENCODING_PQ;
    s = shoot(&view, &o);
    pq_white = (double)s.f32[0];
    shot_free(&s);
    o.white = 0; /* linear is the exposure alone */
    o.encoding = TONEMAP_ENCODING_LINEAR;
    s = shoot(&view, &o);
    EXPECT_REL(s.f32[0], 1, 1e-6);
    shot_free(&s);
    EXPECT_NEAR(hlg_white, 0.75, 0.005);
    EXPECT_NEAR(pq_white, 0.58, 0.005);
}

TEST(primaries_are_converted_and_fade_into_the_display)
{
    /* ITU-R BT.2087, table 2: Rec. 709 in Rec. 2020 */
    static const double published[9] = {0.6274, 0.3293, 0.0433, 0.0691, 0.9195, 0.0114, 0.0164, 0.0880, 0.8956};
    enum { W = 40, H = 30 };
    float *pixels = room_pixels(W, H, 5), *wide = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3), other = sat_image_f32(wide, W, H, 3);
    tonemap_options o = tonemap_defaults();
    tonemap *map = NULL;
    shot s, t;
    int i, c, worst = 0, p;
    o.display = TONEMAP_PRIMARIES_2020;
    EXPECT_EQ(tonemap_create(&map, W, H, &o), SAT_OK);
    for (i = 0; i < 9; ++i) EXPECT_NEAR(map->colours.mix[i], published[i], 1e-4);
    tonemap_destroy(map);
    /* the same picture given in Rec. 2020 */
    for (i = 0; i < W * H; ++i)
        for (c = 0; c < 3; ++c)
            wide[3 * i + c] =
                (float)(published[3 * c] * (double)pixels[3 * i] + published[3 * c + 1] * (double)pixels[3 * i + 1] +
                        published[3 * c + 2] * (double)pixels[3 * i + 2]);
    o = tonemap_defaults();
    s = shoot(&view, &o);
    o.primaries = TONEMAP_PRIMARIES_2020;
    t = shoot(&other, &o);
    for (i = 0; i < W * H * 3; ++i)
        worst = abs((int)s.u8[i] - (int)t.u8[i]) > worst ? abs((int)s.u8[i] - (int)t.u8[i]) : worst;
    EXPECT(worst <= 2);
    shot_free(&s);
    shot_free(&t);
    /* pure colours of Rec. 2020 on the others: luminance and hue stay, nothing is negative; grey is grey */
    for (p = 0; p < 2; ++p)
        for (c = 0; c < 3; ++c) {
            float colour[4 * 3];
            sat_image little = sat_image_f32(colour, 4, 1, 3);
            for (i = 0; i < 12; ++i) colour[i] = i < 6 ? 0.3f : i % 3 == c ? 0.4f : 0;
            o.operation = TONEMAP_LINEAR;
            o.exposure = 1;
            o.white = (double)INFINITY;
            o.display = (tonemap_primaries)p;
            s = shoot(&little, &o);
            for (i = 0; i < 6; ++i) EXPECT_REL(s.f32[i], 0.3, 1e-5);
            for (i = 9; i < 12; ++i) EXPECT(s.f32[i] >= 0 && (i % 3 == c || s.f32[i] < s.f32[9 + c]));
            EXPECT(s.f32[9 + (c + 1) % 3] < 1e-6f || s.f32[9 + (c + 2) % 3] < 1e-6f);
            shot_free(&s);
        }
    free(pixels);
    free(wide);
}

TEST(white_balance_undoes_a_cast)
{
    enum { W = 70, H = 60 };
    float *pixels = room_pixels(W, H, 6), *cast = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3), other = sat_image_f32(cast, W, H, 3);
    tonemap_options o = tonemap_defaults();
    int i, worst = 0;
    shot s = shoot(&view, &o), t;
    for (i = 0; i < W * H * 3; ++i) cast[i] = pixels[i] * (i % 3 == 0 ? 2.0f : i % 3 == 1 ? 1.0f : 0.25f);
    o.balance_red = 0.5;
    o.balance_blue = 4;
    t = shoot(&other, &o);
    for (i = 0; i < W * H * 3; ++i)
        worst = abs((int)s.u8[i] - (int)t.u8[i]) > worst ? abs((int)s.u8[i] - (int)t.u8[i]) : worst;
    EXPECT(worst <= 1);
    EXPECT_REL(t.stats.adapted, s.stats.adapted, 1e-6);
    shot_free(&s);
    shot_free(&t);
    free(pixels);
    free(cast);
}

/* A gradient of 10 % over 1024 pixels: without dithering a band of 257 pixels; with it the means of 8 x 8 pixels are
   those of the codes before rounding. */
TEST(dithering_leaves_no_bands)
{
    enum { W = 1024, H = 8 };
    float *pixels = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = tonemap_defaults();
    double error[2] = {0, 0};
    int i, k, x, y;
    for (i = 0; i < W * H * 3; ++i) pixels[i] = 0.2f * (1 + 0.1f * (float)(i / 3 % W) / W);
    o.operation = TONEMAP_LINEAR;
    o.exposure = 1;
    o.white = (double)INFINITY;
    for (k = 0; k < 2; ++k) {
        shot s;
        o.dither = k;
        s = shoot(&view, &o);
        for (x = 0; x < W; x += 8) {
            double sum = 0, wanted = 0;
            for (i = x; i < x + 8; ++i)
                for (y = 0; y < H; ++y) {
                    sum += s.u8[3 * (y * W + i) + 1];
                    wanted += metrics_code((double)pixels[3 * (y * W + i) + 1]);
                    EXPECT(fabs((double)s.u8[3 * (y * W + i) + 1] -
                                metrics_code((double)pixels[3 * (y * W + i) + 1])) <= 1.01);
                }
            error[k] += (sum - wanted) / 64 * ((sum - wanted) / 64) / (W / 8);
        }
        shot_free(&s);
    }
    REPORT("banding: error of 8 x 8 means without dithering", sqrt(error[0]), "codes");
    REPORT("banding: error of 8 x 8 means with dithering", sqrt(error[1]), "codes");
    EXPECT(sqrt(error[0]) > 0.2 && sqrt(error[1]) <= 0.02);
    for (i = 0; i < W * H * 3; ++i) pixels[i] = i / 3 < W ? 0.0f : 10.0f; /* black is 0 and white 255 everywhere */
    {
        shot s = shoot(&view, &o);
        for (i = 0; i < W * H * 3; ++i) EXPECT_EQ(s.u8[i], i / 3 < W ? 0 : 255);
        shot_free(&s);
    }
    free(pixels);
}

/* What the mask leaves out is not metered, and what it takes is as if it were all. */
TEST(a_mask_says_what_is_metered)
{
    enum { W = 90, H = 64 };
    float *pixels = room_pixels(W, H, 12), *mask = (float *)malloc(W * H * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3), part = sat_image_f32(pixels, W, H / 2, 3);
    int i, metering;
    for (metering = 0; metering < 2; ++metering) {
        tonemap_options o = tonemap_defaults();
        shot half, masked, all;
        o.metering = (tonemap_metering)metering;
        o.key = 0;
        half = shoot(&part, &o);
        all = shoot(&view, &o);
        o.meter_weights = mask;
        for (i = 0; i < W * H; ++i) mask[i] = i < W * H / 2 ? 1 : i % 3 ? 0 : NAN;
        masked = shoot(&view, &o);
        EXPECT_REL(masked.stats.adapted, half.stats.adapted, 1e-9);
        EXPECT_REL(masked.stats.key, half.stats.key, 1e-9);
        EXPECT_REL(masked.stats.white, half.stats.white, 1e-9);
        EXPECT(fabs(all.stats.adapted - half.stats.adapted) > 0.01 * half.stats.adapted);
        EXPECT(memcmp(masked.u8, half.u8, W * 10 * 3) == 0);
        shot_free(&masked);
        for (i = 0; i < W * H; ++i) mask[i] = 1;
        masked = shoot(&view, &o);
        EXPECT(memcmp(masked.u8, all.u8, W * H * 3) == 0);
        shot_free(&masked);
        for (i = 0; i < W * H; ++i) mask[i] = 0; /* nothing to meter: as a black picture */
        masked = shoot(&view, &o);
        EXPECT(masked.stats.positive > 0 && isfinite(masked.stats.adapted));
        shot_free(&masked);
        shot_free(&half);
        shot_free(&all);
    }
    free(pixels);
    free(mask);
}

/* Nothing that is no part of the scene moves the exposure. */
TEST(metering_ignores_residue_and_bad_texels)
{
    enum { W = 200, H = 120 };
    const float residue[3] = {0, 1e-30f, 1e-8f};
    float *pixels = room_pixels(W, H, 8);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = local_options();
    unsigned char *out = (unsigned char *)malloc(W * H * 3);
    tonemap *map = NULL;
    tonemap_stats stats;
    double adapted = 0;
    int i, k;
    shot clean, s;
    clean = shoot(&view, &o); /* percentiles are the default */
    for (k = 0; k < 3; ++k) {
        for (i = 0; i < 3; ++i) pixels[i] = k == 0 ? 1e30f : k == 1 ? NAN : 0;
        s = shoot(&view, &o);
        EXPECT_NEAR(s.stats.adapted, clean.stats.adapted, 0);
        for (i = 3 * 22 * W; i < 3 * W * H && s.u8[i] == clean.u8[i]; ++i) {}
        EXPECT_EQ(i, 3 * W * H);
        shot_free(&s);
    }
    for (k = 0; k < 3; ++k) {
        for (i = 0; i < W * H * 3; ++i) pixels[i] = i / 3 % W < 60 ? 0.1f + 0.9f * (float)(i / 3 % W) / 60 : residue[k];
        s = shoot(&view, &o);
        if (k == 0) adapted = s.stats.adapted;
        EXPECT_NEAR(log2(s.stats.adapted / adapted), 0, 0.05);
        shot_free(&s);
    }
    o.adapt_seconds = 2; /* half a second of black with one pixel of residue */
    EXPECT_EQ(tonemap_create(&map, W, H, &o), SAT_OK);
    EXPECT_EQ(tonemap_apply_u8(map, out, W * 3, &view, 0, &stats), SAT_OK);
    adapted = stats.adapted;
    for (i = 0; i < W * H * 3; ++i) pixels[i] = i < 3 ? 1e-28f : 0;
    for (k = 0; k < 30; ++k) EXPECT_EQ(tonemap_apply_u8(map, out, W * 3, &view, 1 / 60.0, &stats), SAT_OK);
    EXPECT_NEAR(stats.adapted, adapted, 0);
    tonemap_destroy(map);
    shot_free(&clean);
    free(pixels);
    free(out);
}

/* A tenth of the picture in light, the rest nearly dark: the light is worth more than eq A.1 gives it. */
TEST(highlights_are_not_washed_out)
{
    enum { W = 100, H = 60 };
    float *pixels = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = tonemap_defaults();
    int i, k;
    for (k = 0; k < 2; ++k) {
        shot s;
        double lit;
        for (i = 0; i < W * H * 3; ++i) pixels[i] = i / 3 % W < 70 ? 0.001f : 1;
        if (k == 1) o.metering = TONEMAP_METERING_LOG_AVERAGE;
        s = shoot(&view, &o);
        lit = 0.18 / s.stats.adapted;
        if (k == 0) EXPECT_NEAR(log2(lit), 4.5 + log2(0.18), 1.0 / 16); /* a bin of the histogram */
        else EXPECT(lit > 20);
        shot_free(&s);
    }
    free(pixels);
}

/* A picture of low range reaches white; with infinity it ends at a light grey. */
TEST(low_range_is_not_dull)
{
    enum { W = 100, H = 60 };
    float *pixels = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = tonemap_defaults();
    int i, k;
    for (i = 0; i < W * H * 3; ++i) pixels[i] = (float)exp2(6 * (double)(i / 3 % W) / W);
    for (k = 0; k < 2; ++k) {
        shot s;
        if (k == 1) o.white = (double)INFINITY;
        s = shoot(&view, &o);

        if (k == 0) EXPECT(s.u8[3 * W - 3] >= 250 && s.stats.clamped < W * H / 25);
        else EXPECT(s.u8[3 * W - 3] < 220);
        shot_free(&s);
    }
    free(pixels);
}

/* With nothing said about units the filter does what it was asked for, and a lamp does not switch it off. */
TEST(mesopic_vision_needs_no_units)
{
    enum { W = 60, H = 40 };
    float *pixels = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = tonemap_defaults();
    int i, k, mode;
    for (mode = TONEMAP_MESOPIC_UNIFORM; mode <= TONEMAP_MESOPIC_LOCAL; ++mode)
        for (k = 0; k < 3; ++k) {
            shot s, off;
            for (i = 0; i < W * H * 3; ++i) pixels[i] = i % 3 ? 0.1f : 0.5f;
            if (k) pixels[0] = 1e6f;
            o.mesopic = TONEMAP_MESOPIC_OFF;
            o.cd_per_unit = k == 2 ? 2 : 0;
            off = shoot(&view, &o);
            o.mesopic = (tonemap_mesopic)mode;
            s = shoot(&view, &o);
            EXPECT(s.u8[3 * (30 * W + 40)] + 4 < off.u8[3 * (30 * W + 40)]);
            shot_free(&s);
            shot_free(&off);
        }
    free(pixels);
}

/* A lamp that flickers moves no code by more than 1 outside its window, in frames a sixtieth of a second apart. */
TEST(a_flickering_lamp_stays_in_its_window)
{
    enum { W = 200, H = 120 };
    float *pixels = room_pixels(W, H, 8);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = tonemap_defaults();
    unsigned char *out[2] = {(unsigned char *)malloc(W * H * 3), (unsigned char *)malloc(W * H * 3)};
    tonemap *map = NULL;
    int frames, i, x, y, worst = 0;
    o.adapt_seconds = 0.5;
    EXPECT_EQ(tonemap_create(&map, W, H, &o), SAT_OK);
    for (frames = 0; frames < 40; ++frames) {
        for (y = 90; y < 96; ++y)
            for (x = 100; x < 106; ++x)
                for (i = 0; i < 3; ++i) pixels[3 * (y * W + x) + i] = frames % 2 ? 2000 : 0.1f;
        EXPECT_EQ(tonemap_apply_u8(map, out[frames % 2], W * 3, &view, 1 / 60.0, NULL), SAT_OK);
        if (!frames) continue;
        for (y = 0; y < H; ++y)
            for (x = 0; x < W; ++x)
                for (i = 0; i < 3 && !(x >= 80 && x < 126 && y >= 70 && y < 116); ++i) {
                    int d = abs((int)out[0][3 * (y * W + x) + i] - (int)out[1][3 * (y * W + x) + i]);
                    worst = d > worst ? d : worst;
                }
    }
    REPORT("a flickering lamp, largest change elsewhere", worst, "codes");
    EXPECT(worst <= 1);
    tonemap_destroy(map);
    free(out[0]);
    free(out[1]);
    free(pixels);
}

/* Light that wavers by less than a step moves no code, also where it crosses a step; a real change does. */
TEST(metering_holds_while_light_wavers)
{
    tonemap_options o = local_options();
    tonemap *map = NULL;
    double first, other;
    int i;
    o.adapt_seconds = 0.1;
    EXPECT_EQ(tonemap_create(&map, 16, 16, &o), SAT_OK);
    first = frame(map, 1, 0);
    for (i = 0; i < 64; ++i) {
        float light = (float)exp2((i % 2 ? 1 : -1) * i / (64.0 * 130)); /* up to half a step to both sides */
        other = frame(map, light, 1) + log2((double)light);
        EXPECT_NEAR(other, first, 1e-12); /* of the sum made here */
    }
    EXPECT_NEAR(frame(map, 1.1f, 100) + log2((double)1.1f), first + log2(1.1), 1 / 64.0);
    tonemap_destroy(map);
}

TEST(eyes_are_quicker_in_light)
{
    tonemap_options o = local_options();
    tonemap *map = NULL;
    double steady;
    o.metering = TONEMAP_METERING_LOG_AVERAGE;
    o.adapt_seconds = 0.5;
    o.darker_seconds = 5;
    EXPECT_EQ(tonemap_create(&map, 16, 16, &o), SAT_OK);
    steady = frame(map, 1, 0);
    EXPECT_NEAR(frame(map, 1024, 0.5), steady - 10 * exp(-1), 1e-4);
    EXPECT_NEAR(frame(map, 1024, 1e6), steady, 1e-4);
    EXPECT_NEAR(frame(map, 1, 0.5), steady + 10 * exp(-0.1), 1e-4);
    tonemap_destroy(map);
}

TEST(adaptation_has_limits)
{
    tonemap_options o = local_options();
    tonemap *map = NULL;
    double steady;
    o.adapt_low = 0.5;
    o.adapt_high = 8;
    EXPECT_EQ(tonemap_create(&map, 16, 16, &o), SAT_OK);
    steady = frame(map, 1, 0);
    EXPECT(steady > -1 && steady < 3);
    EXPECT_NEAR(frame(map, 1e-3f, 0), log2(0.5 / (double)1e-3f), 1e-9);
    EXPECT_NEAR(frame(map, 1e3f, 0), log2(8 / 1e3), 1e-9);
    tonemap_destroy(map);
}

/* A camera's exposure: no picture moves it, and it is there at once. */
TEST(a_fixed_exposure_is_not_metered)
{
    enum { W = 40, H = 30 };
    float *pixels = room_pixels(W, H, 3);
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = local_options();
    int i, k;
    o.operation = TONEMAP_LINEAR;
    o.gamut = -1;
    o.exposure = 1 / (1.2 * exp2(3)); /* EV100 of 3 */
    o.adapt_seconds = 100;
    for (k = 0; k < 2; ++k) {
        shot s = shoot(&view, &o);
        for (i = 0; i < W * H * 3; ++i) {
            double v = (double)pixels[i] * o.exposure;
            if (!EXPECT_NEAR(s.f32[i], v < 1 ? v : 1, 1e-6)) break;
        }
        shot_free(&s);
        for (i = 0; i < W * H * 3; ++i) pixels[i] *= 0.01f;
    }
    free(pixels);
}

/* What only the new options need is there at once, not on its way up from 0. */
TEST(other_options_start_from_what_is_measured)
{
    enum { W = 80, H = 60 };
    float *pixels = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    unsigned char *out = (unsigned char *)malloc(W * H * 3);
    tonemap *map = NULL;
    tonemap_options o = local_options(), other;
    tonemap_stats stats;
    int i, k;
    shot fresh;
    for (i = 0; i < W * H * 3; ++i) pixels[i] = (float)(1e-4 * pow(10, 4.0 * (i / 3 % W) / W));
    o.adapt_seconds = 5;
    for (k = 0; k < 2; ++k) {
        other = o;
        if (k == 0) other.operation = TONEMAP_ASHIKHMIN;
        else other.white = 0;
        EXPECT_EQ(tonemap_create(&map, W, H, &o), SAT_OK);
        EXPECT_EQ(tonemap_apply_u8(map, out, W * 3, &view, 0, NULL), SAT_OK);
        EXPECT_EQ(tonemap_set_options(map, &other), SAT_OK);
        EXPECT_EQ(tonemap_apply_u8(map, out, W * 3, &view, 1 / 60.0, &stats), SAT_OK);
        fresh = shoot(&view, &other);
        EXPECT(memcmp(out, fresh.u8, W * H * 3) == 0);
        EXPECT_NEAR(stats.white, fresh.stats.white, 1e-9);
        shot_free(&fresh);
        tonemap_destroy(map);
    }
    free(pixels);
    free(out);
}

/* ---- the measures themselves */

TEST(metrics_know_equal_pictures_and_scale)
{
    enum { W = 40, H = 36, N = W * H };
    double *a = metrics_alloc(3 * N), *b = metrics_alloc(3 * N);
    metrics_codes m;
    int i;
    for (i = 0; i < 3 * N; ++i) a[i] = b[i] = 100 + 60 * sin(i * 0.37) + i % 7;
    m = metrics_compare_codes(a, b, N);
    EXPECT(m.rms == 0 && m.largest == 0 && m.over1 == 0);
    EXPECT_NEAR(metrics_ssim(a, b, W, H), 1, 1e-12);
    EXPECT_NEAR(metrics_flip(a, b, W, H, 67), 0, 1e-12);
    EXPECT_NEAR(metrics_scielab(a, b, W, H, 23), 0, 1e-12);
    for (i = 0; i < 3 * N; ++i) b[i] += i % 2 ? 6 : -6;
    m = metrics_compare_codes(a, b, N);
    EXPECT_NEAR(m.rms, 6, 1e-12);
    EXPECT(m.over1 == 1 && m.over5 == 1);
    EXPECT(metrics_ssim(a, b, W, H) < 0.999);
    for (i = 0; i < 3 * N; ++i) a[i] = 0, b[i] = 255;
    EXPECT_NEAR(metrics_scielab(a, b, W, H, 23), 100, 1);   /* black and white are 100 L apart */
    EXPECT(metrics_flip(a, b, W, H, 67) > 0.9);
    EXPECT_NEAR(metrics_ssim(a, b, W, H), 6.5025 / (65025 + 6.5025), 1e-6);
    free(a);
    free(b);
}

TEST(bright_places_keep_their_colour)
{
    enum { W = 60, H = 50 };
    float *pixels = (float *)malloc(W * H * 3 * sizeof(float));
    sat_image view = sat_image_f32(pixels, W, H, 3);
    tonemap_options o = local_options();
    int kind, i;
    for (i = 0; i < W * H; ++i) { /* a dark room with a blue sky 100000 times brighter */
        float light = i % W < 40 ? 0.1f : 10000.0f;
        pixels[3 * i] = 0.5f * light;
        pixels[3 * i + 1] = 0.8f * light;
        pixels[3 * i + 2] = 1.3f * light;
    }
    for (kind = 0; kind < 5; ++kind) {
        shot s;
        o = local_options();
        o.metering = TONEMAP_METERING_LOG_AVERAGE;
        o.soft = kind == 1 ? 0.5 : 1;
        o.selective = kind == 2 ? 0.1 : 0;
        if (kind == 3) o.operation = TONEMAP_GUIDED;
        if (kind == 4) o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL;
        s = shoot(&view, &o);
        EXPECT_NEAR(s.f32[3 * (20 * W + 58)], 0.5 / 0.7722, 0.01);
        EXPECT(s.u8[3 * (20 * W + 58)] < s.u8[3 * (20 * W + 58) + 2] - 30);
        shot_free(&s);
    }
    free(pixels);
}

/* ---- pictures */

#ifdef HAVE_OPENEXR
/* Luminance codes of the local operator against the exact Gaussian one. */
TEST(boxes_are_close_to_gaussians_on_photographs)
{
    const char *names[2] = {"hdr/memorial.exr", "hdr/Desk.exr"};
    int i;
    size_t k;
    for (i = 0; i < 2; ++i) {
        const char *path = support_data(names[i]);
        image picture;
        sat_image view;
        shot s;
        size_t n;
        tonemap_options o = local_options();
        double *scaled, *la, *a, *b, ssim;
        reference_photographic r = reference_photographic_defaults(1);
        if (!path) SKIP("needs ../shared/data/hdr");
        if (!EXPECT(image_load(&picture, path))) return;
        view = image_view(&picture);
        n = (size_t)picture.width * (size_t)picture.height;
        o.gamut = -1;
        s = shoot(&view, &o);
        scaled = metrics_alloc(n);
        la = metrics_alloc(n);
        a = metrics_alloc(n);
        b = metrics_alloc(n);
        reference_luminance(scaled, picture.pixels, n);
        for (k = 0; k < n; ++k) scaled[k] *= 0.18 / s.stats.adapted;
        reference_local(la, scaled, picture.width, picture.height, &r);
        reference_codes(a, scaled, la, n);
        for (k = 0; k < n; ++k) { /* luminance from green: the factor is the same for the three */
            float green = picture.pixels[3 * k + 1];
            b[k] = s.f32[3 * k + 1] > 0 && s.f32[3 * k + 1] < 1
                       ? metrics_code((double)s.f32[3 * k + 1] / (double)green * scaled[k] * s.stats.adapted / 0.18)
                       : a[k];
        }
        ssim = metrics_ssim(a, b, picture.width, picture.height);
        REPORT(names[i], ssim, "SSIM of boxes against Gaussians");
        EXPECT(ssim >= 0.985);
        shot_free(&s);
        free(scaled);
        free(la);
        free(a);
        free(b);
        image_free(&picture);
    }
}
#endif
