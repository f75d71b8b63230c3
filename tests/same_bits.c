/* Prints a hash of everything the lanes of sat.h, or tonemap.h, compute from inputs of all kinds. Compiled with and
   without SAT_NO_SIMD it prints the same: vectors and plain C give the same bits. tests/check_house.sh compares. */
#define LIGHTSCAN_IMPLEMENTATION
#ifdef SAME_BITS_TONEMAP
#include "tonemap.h"
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

#ifndef SAME_BITS_TONEMAP
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
    i = sat__i32x4_any(sat__f32x4_less(a, b)) + 2 * sat__i32x4_all(sat__f32x4_less(a, b));
    add(&i, sizeof i);
    sat__f32x4_load3(f, &a, &b, &c), add_floats(a), add_floats(b), add_floats(c);
    sat__f32x4_load4(f, &a, &b, &c, &d), add_floats(a), add_floats(b), add_floats(c), add_floats(d);
}

int main(void)
{
    int i;
    for (i = 0; i < 100000; i++) all_lanes();
    printf("lanes %016llx\n", (unsigned long long)hash);
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
