/* Prints a hash of everything the lanes of a header compute from inputs of all kinds. Compiled with
   and without SAT_NO_SIMD it prints the same: vectors and plain C give the same bits. tests/check_house.sh compares. */
#define LIGHTSCAN_IMPLEMENTATION
#ifdef SAME_BITS_TONEMAP
#include "tonemap.h"
#elif defined(SAME_BITS_RAINDROP)
#include "raindrop.h"
#elif defined(SAME_BITS_FIV)
#include "fiv.h"
#elif defined(SAME_BITS_SOFTASSIGN)
#include "softassign.h"
#elif defined(SAME_BITS_SSAO_SAT)
#include "ssao_sat.h"
#else
#define SAT_SIBLING
#include "sat.h"
#endif
#include <stdio.h>

static uint32_t seed = 1;
static uint64_t hash = 1469598103934665603u;

static uint32_t draw(void) { return seed = seed * 1664525u + 1013904223u; }

static void add(const void *p, size_t size)
{
    const unsigned char *c = (const unsigned char *)p;
    for (; size > 0; size--) hash = (hash ^ *c++) * 1099511628211u;
}

#if !defined(SAME_BITS_TONEMAP) && !defined(SAME_BITS_FIV) && !defined(SAME_BITS_RAINDROP) && \
    !defined(SAME_BITS_SOFTASSIGN) && !defined(SAME_BITS_SSAO_SAT)
/* NaN counts as NaN: its bits are the processor's. */
static void add_floats(sat__f32x4 v)
{
    float f[4];
    int i;
    sat__f32x4_store(f, v);
    for (i = 0; i < 4; i++)
        if (sat__is_nan(f[i])) f[i] = -1.5f;
    add(f, sizeof f);
}

static void add_ints(sat__i32x4 v)
{
    int32_t n[4];
    sat__i32x4_store(n, v);
    add(n, sizeof n);
}

/* Any bits, often those of special values. */
static float draw_any(void)
{
    static const uint32_t special[8] = {0,           0x80000000u, 0x7f800000u, 0xff800000u,
                                        0x7fc00000u, 1,           0x3f800000u, 0x4effffffu};
    return sat__float_from_bits(draw() >> 28 ? draw() : special[draw() >> 29]);
}

static void all_lanes(void)
{
    float f[16];
    sat__f32x4 a, b, c, d;
    sat__i32x4 m, n;
    int i;
    for (i = 0; i < 16; i++) f[i] = draw_any();
    a = sat__f32x4_load(f), b = sat__f32x4_load(f + 4);
    m = sat__f32x4_bits(a), n = sat__f32x4_bits(b);
    add_floats(sat__f32x4_add(a, b)), add_floats(sat__f32x4_sub(a, b)), add_floats(sat__f32x4_mul(a, b));
    add_floats(sat__f32x4_div(a, b)), add_floats(sat__f32x4_min(a, b)), add_floats(sat__f32x4_max(a, b));
    add_floats(sat__f32x4_sqrt(a)), add_floats(sat__f32x4_abs(a)), add_floats(sat__f32x4_set1(f[0]));
    add_ints(sat__f32x4_less(a, b)), add_ints(sat__f32x4_less_equal(a, b));
    add_floats(sat__f32x4_select(sat__f32x4_less(a, b), a, b));
    add_ints(sat__i32x4_add(m, n)), add_ints(sat__i32x4_sub(m, n)), add_ints(sat__i32x4_and(m, n));
    add_ints(sat__i32x4_or(m, n)), add_ints(sat__i32x4_greater(m, n)), add_ints(sat__i32x4_set1((int32_t)draw()));
    add_floats(sat__i32x4_to_f32(m)), add_floats(sat__f32x4_from_bits(m)), add_ints(sat__i32x4_shift_right(m, 23));
    c = sat__f32x4_set1(2147483520.0f); /* the largest that truncates; min and max give the second for NaN */
    add_ints(sat__f32x4_truncate(sat__f32x4_max(sat__f32x4_min(a, c), sat__f32x4_set1(-2147483520.0f))));
    add_ints(sat__f32x4_round(sat__f32x4_max(sat__f32x4_min(a, c), sat__f32x4_set1(-2147483520.0f))));
    add_ints(sat__f32x4_round(sat__f32x4_set1((float)(int32_t)draw() * (1 / 1024.0f)))); /* halves, too */
    add_ints(sat__i32x4_prefix(m)), add_ints(sat__i32x4_last(n));
    i = sat__i32x4_any(sat__f32x4_less(a, b)) + 2 * sat__i32x4_all(sat__f32x4_less(a, b));
    add(&i, sizeof i);
    sat__f32x4_load3(f, &a, &b, &c), add_floats(a), add_floats(b), add_floats(c);
    sat__f32x4_load4(f, &a, &b, &c, &d), add_floats(a), add_floats(b), add_floats(c), add_floats(d);
}

/* Tiles and filters of a picture with spikes, giants, NaN and subnormals. */
static void a_table(int width, int height, int tile)
{
    static float p[200 * 150], out[200 * 150];
    sat_image image = sat_image_f32(p, width, height, 1);
    sat_options o = sat_defaults();
    sat_table *t;
    int i, radius;
    for (i = 0; i < width * height; i++) p[i] = draw() >> 24 ? (float)(draw() >> 8) / 16777216.0f : draw_any();
    o.tile = tile;
    if (sat_create(&t, width, height, 1, &o) != SAT_OK) return;
    sat_build(t, &image);
    for (radius = 0; radius < 120; radius = radius * 3 + 1) {
        sat_box_filter(out, 0, t, radius);
        add(out, (size_t)(width * height) * sizeof *out);
    }
    for (i = 0; i < 300; i++) {
        int x = (int)(draw() % (unsigned)width), y = (int)(draw() % (unsigned)height);
        int x1 = x + (int)(draw() >> 25), y1 = y + (int)(draw() >> 25);
        double sum = sat_sum(t, 0, x, y, x1, y1);
        add(&sum, sizeof sum);
    }
    sat_destroy(t);
}

int main(void)
{
    int i;
    for (i = 0; i < 40; i++) a_table(1 + i * 37 % 200, 1 + i * 53 % 150, 8 << i % 5);
    for (i = 0; i < 100000; i++) all_lanes();
    printf("lanes %016llx\n", (unsigned long long)hash);
    return 0;
}

#elif defined(SAME_BITS_SOFTASSIGN)
enum { ROWS = 150, COLUMNS = 290, FEATURES = 20 };

static float draw_unit(void) { return (float)(draw() >> 8) / 16777216.0f; }

/* Ties, forbidden pairs, wide ranges, products. */
static float draw_cost(int kind, int i, int j)
{
    if (kind == 1) return (float)(draw() >> 30);
    if (kind == 2) return draw() >> 28 ? draw_unit() : sat__float_from_bits(0x7f800000u);
    if (kind == 3) return draw_unit() * (draw() >> 29 ? 1.0f : 1e12f) - 0.5f;
    return kind == 4 ? (float)((i + 1) * (j * 7 % 290 + 1)) : draw_unit();
}

static void add_answer(const softassign_problem *p, softassign_method method)
{
    static double u[ROWS], v[COLUMNS];
    int x[ROWS];
    softassign_options o = softassign_method_defaults(method);
    softassign_stats stats;
    o.iterations[0] = o.iterations[0] < 6 ? o.iterations[0] : 6;
    if (method == SOFTASSIGN_AUTO) o.row_price = u, o.column_price = v;
    if (softassign_solve(x, p, &o, &stats) != SAT_OK) memset(x, 0, sizeof x);
    add(x, (size_t)p->rows * sizeof *x);
    add(&stats.cost, sizeof stats.cost), add(&stats.lower_bound, sizeof stats.lower_bound);
    if (!o.row_price) return;
    add(u, (size_t)p->rows * sizeof *u), add(v, (size_t)p->columns * sizeof *v);
}

static void all_costs(const softassign_problem *p, const float *cost, int kind)
{
    static double wide[ROWS * COLUMNS];
    static int whole[ROWS * COLUMNS];
    int i;
    softassign_problem q = *p;
    for (i = 0; i < ROWS * COLUMNS; i++) {
        wide[i] = (double)cost[i] * 1.1;
        whole[i] = cost[i] < 1e6f ? (int)(cost[i] * 1000) : 2147483647;
    }
    q.cost = cost;
    add_answer(&q, SOFTASSIGN_AUTO);
    if (kind < 2) add_answer(&q, SOFTASSIGN_EXACT), add_answer(&q, SOFTASSIGN_FAST);
    if (kind < 2) add_answer(&q, SOFTASSIGN_ENTROPIC);
    q.unassigned_cost = kind == 1 ? 1 : 0.25f;
    add_answer(&q, SOFTASSIGN_AUTO);
    q.unassigned_cost = 0, q.cost = NULL, q.cost_double = wide;
    add_answer(&q, SOFTASSIGN_AUTO);
    q.cost_double = NULL, q.cost_int = whole;
    add_answer(&q, SOFTASSIGN_AUTO);
}

int main(void)
{
    static const int sizes[8][2] = {{3, 3}, {31, 31}, {33, 70}, {64, 64}, {99, 99}, {150, 150}, {60, 290}, {150, 290}};
    static float cost[ROWS * COLUMNS], features[(ROWS + COLUMNS) * FEATURES];
    int size, kind, i;
    for (size = 0; size < 8; size++)
        for (kind = 0; kind < 5; kind++) {
            softassign_problem p = {0};
            p.rows = sizes[size][0], p.columns = sizes[size][1];
            for (i = 0; i < ROWS * COLUMNS; i++) cost[i] = draw_cost(kind, i / p.columns, i % p.columns);
            all_costs(&p, cost, kind);
            if (kind > 1) continue;
            for (i = 0; i < (ROWS + COLUMNS) * FEATURES; i++) features[i] = draw_cost(kind, 0, 0);
            p.row_features = features, p.column_features = features + ROWS * FEATURES, p.feature_count = FEATURES;
            add_answer(&p, SOFTASSIGN_EXACT), add_answer(&p, SOFTASSIGN_GREEDY_2OPT), add_answer(&p, SOFTASSIGN_ANTS);
        }
    printf("softassign %016llx\n", (unsigned long long)hash);
    return 0;
}

#elif defined(SAME_BITS_RAINDROP)
enum { WIDE = 97, HIGH = 61 };

static float draw_unit(void) { return (float)(draw() >> 8) / 16777216.0f; }

int main(void)
{
    static float sky[3 * 64 * 32], rgb[3 * WIDE * HIGH];
    sat_image image = sat_image_f32(sky, 64, 32, 3);
    raindrop_environment_options eo = raindrop_environment_defaults();
    raindrop_environment *e = NULL;
    raindrop_lamp lamp = raindrop_lamp_defaults();
    int i, variant;
    for (i = 0; i < 3 * 64 * 32; i++)
        sky[i] = draw() % 499 ? draw_unit() * (draw() % 97 ? 1.0f : 300.0f) : sat__float_from_bits(draw());
    lamp.position[1] = 2;
    eo.far_samples = 64, eo.far_swing = 1, eo.max_radiance = 1000;
    if (raindrop_environment_create(&e, &image, &eo, NULL) != SAT_OK) return 1;
    for (variant = 0; variant < 32; variant++) {
        raindrop_rain_options o = raindrop_rain_defaults();
        raindrop_render_options r = raindrop_render_defaults();
        raindrop_camera camera = raindrop_camera_defaults();
        raindrop_rain *rain = NULL;
        o.count = 1500, o.oblate = variant & 1;
        o.box_size[0] = o.box_size[1] = o.box_size[2] = 0.6f;
        camera.exposure = variant & 2 ? 0.003f : 0, camera.aperture = variant & 4 ? 0.01f : 0;
        r.look = variant & 8 ? RAINDROP_LOOK_SPRITE : RAINDROP_LOOK_AUTO;
        r.oscillation = variant & 16 ? 0.1f : 0, r.lamps = &lamp, r.lamp_count = variant >> 4;
        if (raindrop_rain_create(&rain, &o) != SAT_OK) return 1;
        raindrop_rain_advance(rain, 0.1);
        raindrop_environment_render(rgb, 0, WIDE, HIGH, &camera, e, NULL);
        raindrop_veil(rgb, 0, WIDE, HIGH, NULL, &camera, e, NULL);
        raindrop_render(rgb, 0, WIDE, HIGH, NULL, &camera, rain, e, &r, NULL);
        add(rgb, sizeof rgb);
        raindrop_rain_destroy(rain);
    }
    raindrop_environment_destroy(e);
    printf("raindrop %016llx\n", (unsigned long long)hash);
    return 0;
}

#elif defined(SAME_BITS_SSAO_SAT)
enum { WIDE = 131, HIGH = 131 };

static float draw_unit(void) { return (float)(draw() >> 8) / 16777216.0f; }

/* Boxes before a slanted wall, sky, a few pixels of any bits; of normals too. */
static void fill(float *depth, float *normals, int width, int height, float scale)
{
    int i;
    for (i = 0; i < width * height; i++) {
        int x = i % width, y = i / width;
        depth[i] = scale * (3 + 0.01f * (float)x - 0.4f * (float)(x / 9 % 3 == 1 && y / 7 % 2) + 1e-4f * draw_unit());
        if (draw() % 211 == 0 || y < height / 9) depth[i] = sat__float_from_bits(draw() % 3 ? 0x7f800000u : draw());
        normals[3 * i] = 0.4f * draw_unit() - 0.2f;
        normals[3 * i + 1] = 0.4f * draw_unit() - 0.2f;
        normals[3 * i + 2] = draw() % 301 ? 1 : sat__float_from_bits(draw());
    }
}

static void picture(int width, int height, int variant)
{
    static float depth[WIDE * HIGH], normals[3 * WIDE * HIGH], out[WIDE * HIGH], bent[3 * WIDE * HIGH];
    static uint8_t codes[WIDE * HIGH];
    ssao_sat_input in = ssao_sat_input_linear(depth, width, height, 1);
    ssao_sat_options o = ssao_sat_defaults();
    ssao_sat *ao;
    size_t n = (size_t)width * (size_t)height;
    fill(depth, normals, width, height, variant & 16 ? 1e4f : 1);
    if (variant & 1) in.normals = normals;
    if (variant & 2) {
        in.projection[0] = in.projection[5] = 0.1f, in.projection[11] = 0, in.projection[15] = 1;
    }
    o.radius = variant & 16 ? 3e3 : 0.4;
    o.half_resolution = !(variant & 4);
    o.method = (ssao_sat_method)(variant & 8 ? variant % 5 : 0);
    o.scales = 1 + variant % 4;
    o.slabs = variant % 3 ? 8 : 3;
    o.tolerance = variant % 5 ? 0.04 : 0;
    o.band_rows = variant % 7 ? 0 : 16;
    o.geometric = variant & 1 && variant & 4;
    o.plane_boxes = 1 + variant / 5 % 2;
    if (ssao_sat_create(&ao, width, height, &o) != SAT_OK) return;
    ssao_sat_apply(ao, out, 0, &in, NULL);
    add(out, n * sizeof *out);
    ssao_sat_apply_u8(ao, codes, 0, &in, NULL);
    add(codes, n);
    ssao_sat_apply_signed(ao, out, 0, &in, NULL);
    add(out, n * sizeof *out);
    if (o.method == SSAO_SAT_SLABS) {
        ssao_sat_apply_bent(ao, out, 0, bent, 0, &in, NULL);
        add(out, n * sizeof *out);
        add(bent, 3 * n * sizeof *bent);
    }
    ssao_sat_destroy(ao);
}

int main(void)
{
    static const int sides[][2] = {{1, 1}, {1, 40}, {40, 1}, {2, 3}, {7, 5}, {33, 18}, {64, 47}, {131, 131}};
    int variant, i;
    for (variant = 0; variant < 64; variant++)
        for (i = 0; i < 8; i++) picture(sides[i][0], sides[i][1], variant);
    printf("ssao_sat %016llx\n", (unsigned long long)hash);
    return 0;
}

#elif defined(SAME_BITS_FIV)
enum { RING = 24, TUBE = 9, RECEIVERS = 512 };

static float draw_unit(void) { return (float)(draw() >> 8) / 16777216.0f; }

/* A torus; open where some triangles are left out. */
static fiv_occluder *ring(int left_out, const fiv_occluder_options *o)
{
    static float positions[3 * RING * TUBE];
    static unsigned indices[6 * RING * TUBE];
    fiv_occluder *made = NULL;
    int i, j, n = 0;
    for (i = 0; i < RING; i++)
        for (j = 0; j < TUBE; j++) {
            float *p = positions + 3 * (i * TUBE + j);
            float a = 6.2831853f * (float)i / RING, b = 6.2831853f * (float)j / TUBE;
            unsigned at[4];
            int k;
            p[0] = (1 + 0.4f * cosf(b)) * cosf(a), p[1] = 0.4f * sinf(b), p[2] = (1 + 0.4f * cosf(b)) * sinf(a);
            for (k = 0; k < 4; k++) at[k] = (unsigned)((i + (k >> 1)) % RING * TUBE + (j + (k & 1)) % TUBE);
            indices[n++] = at[0], indices[n++] = at[1], indices[n++] = at[2];
            indices[n++] = at[2], indices[n++] = at[1], indices[n++] = at[3];
        }
    fiv_occluder_create(&made, positions, RING * TUBE, indices, (size_t)(n / 3 - left_out), o, NULL);
    return made;
}

int main(void)
{
    static float sky[32 * 16 * 3], points[3 * RECEIVERS], normals[3 * RECEIVERS], rgb[3 * RECEIVERS];
    sat_image image = sat_image_f32(sky, 32, 16, 3);
    fiv_environment *e = NULL;
    int i, variant;
    for (i = 0; i < 32 * 16 * 3; i++) sky[i] = draw_unit() * (draw() % 211 ? 1.0f : 3000.0f);
    for (i = 0; i < 3 * RECEIVERS; i++) {
        points[i] = (draw_unit() - 0.5f) * (i % 2 ? 3.0f : 8.0f);
        normals[i] = draw() % 97 ? draw_unit() - 0.5f : sat__float_from_bits(draw());
    }
    if (fiv_environment_create(&e, &image, NULL, NULL) != SAT_OK) return 1;
    for (variant = 0; variant < 4; variant++) {
        fiv_occluder_options o = fiv_occluder_defaults();
        fiv_irradiance_options io = fiv_irradiance_defaults();
        fiv_instance two[2];
        memset(two, 0, sizeof two);
        o.theta = 12, o.phi = 7, o.rho = 6;
        o.storage = variant & 1 ? FIV_STORAGE_HALF_OCTAHEDRAL : FIV_STORAGE_FLOAT;
        io.own_masks = variant & 2 ? 64 : 0;
        io.accuracy = variant == 3 ? FIV_MASK : FIV_SCALED;
        two[0].occluder = two[1].occluder = ring(variant & 2 ? 7 : 0, &o);
        two[0].scale = 1, two[1].scale = 0.5f, two[1].position[0] = 1.5f;
        if (!two[0].occluder) return 1;
        if (fiv_occluder_light((fiv_occluder *)(uintptr_t)two[0].occluder, e, NULL) != SAT_OK) return 1;
        if (fiv_irradiance(rgb, points, normals, RECEIVERS, e, two, 2, &io, NULL) != SAT_OK) return 1;
        add(rgb, sizeof rgb);
        if (fiv_self_irradiance(rgb, points, normals, RECEIVERS, e, two, two + 1, 1, &io, NULL) != SAT_OK) return 1;
        add(rgb, sizeof rgb);
        fiv_occluder_destroy((fiv_occluder *)(uintptr_t)two[0].occluder);
    }
    fiv_environment_destroy(e);
    printf("fiv %016llx\n", (unsigned long long)hash);
    return 0;
}

#else
enum { MOST = 140 * 31 };

static float draw_unit(void) { return (float)(draw() >> 8) / 16777216.0f; }

static void change(tonemap_options *o, int variant, const float *mask)
{
    if (variant == 1) o->mesopic = TONEMAP_MESOPIC_LOCAL;
    if (variant == 2) o->mesopic = TONEMAP_MESOPIC_UNIFORM, o->gamut = -1;
    if (variant == 3) o->soft = 0, o->dither = 1, o->selective = 0.05;
    if (variant == 4) o->peak = 4, o->encoding = TONEMAP_ENCODING_PQ, o->primaries = TONEMAP_PRIMARIES_2020;
    if (variant == 5) o->meter_weights = mask, o->metering = TONEMAP_METERING_LOG_AVERAGE;
    if (variant == 6) o->white = 2, o->key = 0, o->encoding = TONEMAP_ENCODING_HLG;
    if (variant == 7) o->scales = 3, o->selective = 0.2, o->soft = 0.3, o->white = (double)INFINITY, o->gamut = 0;
}

static void picture(int operation, int width, int channels, int variant)
{
    static float pixels[4 * MOST], mask[MOST], as_float[4 * MOST];
    static unsigned char codes[4 * MOST];
    int height = width % 3 == 0 ? 1 : 31, i, n = width * height * channels;
    tonemap_options o = tonemap_defaults();
    sat_image view = sat_image_f32(pixels, width, height, channels);
    tonemap_stats stats;
    tonemap *map;
    memset(&stats, 0, sizeof stats);
    o.operation = (tonemap_operator)operation;
    change(&o, variant, mask);
    for (i = 0; i < width * height; i++) mask[i] = draw_unit() * 1.2f - 0.1f;
    for (i = 0; i < n; i++) {
        pixels[i] = draw_unit() * (i / channels % width > width / 2 ? 40.0f : 0.3f);
        if (draw() % 997 == 0) pixels[i] = sat__float_from_bits(draw());
        if (draw() % 499 == 0) pixels[i] = -1e10f * draw_unit();
        if (variant == 3 && width % 2) pixels[i] = 1;
    }
    if (tonemap_create(&map, width, height, &o) != SAT_OK) return;
    tonemap_apply_u8(map, codes, 0, &view, 0, &stats);
    add(codes, (size_t)n);
    add(stats.scale, sizeof stats.scale);
    add(&stats.clamped, sizeof stats.clamped);
    add(&stats.skipped, sizeof stats.skipped);
    tonemap_apply_f32(map, as_float, 0, &view, 0, NULL);
    tonemap_apply_f32(map, pixels, 0, &view, 0.1, NULL);
    add(as_float, (size_t)n * sizeof(float));
    add(pixels, (size_t)n * sizeof(float));
    tonemap_destroy(map);
}

int main(void)
{
    static const int widths[] = {1, 2, 3, 5, 16, 33, 47, 65, 140}, channels[] = {1, 3, 4};
    int operation, variant, i, c;
    for (operation = 0; operation < 10; operation++)
        for (variant = 0; variant < 8; variant++)
            for (i = 0; i < 9; i++)
                for (c = 0; c < 3; c++) picture(operation, widths[i], channels[c], variant);
    printf("tonemap %016llx\n", (unsigned long long)hash);
    return 0;
}
#endif
