/* Fuzzing sat.h: any sizes, strides, options, pixels and boxes. Build: clang -fsanitize=fuzzer,address,undefined. */
#define SAT_IMPLEMENTATION
#include "sat.h"
#include <stdlib.h>
#include <string.h>

typedef struct input {
    const unsigned char *bytes;
    size_t size;
} input;

static uint32_t take(input *in, uint32_t below)
{
    uint32_t v = 0;
    size_t n = in->size < 4 ? in->size : 4;
    memcpy(&v, in->bytes, n);
    in->bytes += n;
    in->size -= n;
    return below ? v % below : v;
}

static float take_float(input *in)
{
    uint32_t bits = take(in, 0);
    float v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

static void query(const sat_table *t, input *in)
{
    int i, box[8];
    double sums[2];
    volatile double sink = 0;
    for (i = 0; i < 8; i++) {
        int x0 = (int)take(in, 0), y0 = (int)take(in, 0), x1 = (int)take(in, 0), y1 = (int)take(in, 0);
        double fx = (double)take_float(in), fy = (double)take_float(in);
        sink += sat_sum(t, i % 5 - 1, x0, y0, x1, y1) + sat_mean(t, 0, x0 % 64, y0 % 64, x1 % 64, y1 % 64);
        sink += sat_sum_fractional(t, 0, fx, fy, (double)take_float(in), (double)take_float(in));
        sink += sat_mean_border(t, 0, fx, fy, (double)take_float(in), fy + 3, (sat_border)take(in, 5),
                                (sat_border)take(in, 5));
        box[0] = x0, box[1] = y0, box[2] = x1, box[3] = y1;
        box[4] = x0 % 64, box[5] = y0 % 64, box[6] = x1 % 64, box[7] = y1 % 64;
        sat_sums(sums, t, i % 5 - 1, box, 2);
        sink += sums[0] + sums[1] + sat_error_bound_box(t, 0, x0 % 64, y0 % 64, x1, y1);
        sink += sat_error_bound(t, 0, x0, y0) + sat_error_rms(t, 0, x1, y1) + (double)sat_restore(t, 0, x0, y0);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    static unsigned char memory[64 * 64 * 4 * 4];
    static float out[64 * 64 * 4], radii[64 * 64];
    input in;
    sat_options o = sat_defaults();
    sat_image image;
    sat_table *t = NULL;
    sat_kind kind;
    in.bytes = bytes;
    in.size = size;
    o.kind = (sat_kind)take(&in, 5);
    o.tile = 8 << take(&in, 6);
    o.subtract_mean = (int)take(&in, 2);
    o.quantum = take(&in, 2) ? (double)take_float(&in) : 0;
    o.max_value = take(&in, 2) ? (double)take_float(&in) : 0;
    o.max_box_area = take(&in, 2) ? (double)take_float(&in) : 0;
    o.non_finite = (sat_non_finite)take(&in, 2);
    image.width = (int)take(&in, 64) + 1;
    image.height = (int)take(&in, 64) + 1;
    image.channels = (int)take(&in, 4) + 1;
    image.format = (sat_format)take(&in, 4);
    image.stride = (ptrdiff_t)((size_t)(image.width * image.channels) * (image.format == SAT_F32  ? 4
                                                                         : image.format == SAT_U8 ? 1
                                                                                                  : 2));
    image.pixels = memory;
    memcpy(memory, in.bytes, in.size < sizeof memory ? in.size : sizeof memory);
    memcpy(radii, memory, sizeof radii);
    if (take(&in, 2)) {
        image.pixels = memory + (ptrdiff_t)(image.height - 1) * image.stride;
        image.stride = -image.stride;
    }
    if (sat_create(&t, image.width, image.height, image.channels, &o) == SAT_OK) {
        sat_build(t, &image);
        query(t, &in);
        sat_update(t, &image, (int)take(&in, 64), (int)take(&in, 64), (int)take(&in, 80), (int)take(&in, 80));
        sat_box_filter(out, (ptrdiff_t)((size_t)(image.width * image.channels) * sizeof(float)), t,
                       (int)(take(&in, 0) & 0x7fffffff));
        sat_box_filter_variable(out, (ptrdiff_t)((size_t)(image.width * image.channels) * sizeof(float)), t, radii,
                                64 * 4);
        query(t, &in);
        sat_destroy(t);
    }
    sat_plan(&kind, &image, (int)take(&in, 0), (int)take(&in, 90), (double)take_float(&in), take(&in, 1 << 20), &o);
    return 0;
}
