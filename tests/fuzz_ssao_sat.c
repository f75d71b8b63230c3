/* Fuzzing ssao_sat.h: any options, matrices, sizes, strides and depths. Build: clang
   -fsanitize=fuzzer,address,undefined. */
#define SAT_IMPLEMENTATION
#define SSAO_SAT_IMPLEMENTATION
#include "ssao_sat.h"
#include <stdlib.h>
#include <string.h>

typedef struct input {
    const unsigned char *bytes;
    size_t size;
} input;

static void take_bytes(input *in, void *out, size_t n)
{
    size_t have = in->size < n ? in->size : n;
    memset(out, 0, n);
    memcpy(out, in->bytes, have);
    in->bytes += have;
    in->size -= have;
}

static int take(input *in, int below)
{
    unsigned char b;
    take_bytes(in, &b, 1);
    return b % below;
}

static float take_float(input *in)
{
    float v;
    take_bytes(in, &v, sizeof v);
    return v;
}

/* Mostly sensible options: wholly random ones are refused at once. */
static ssao_sat_options take_options(input *in)
{
    ssao_sat_options o = ssao_sat_defaults();
    o.method = (ssao_sat_method)take(in, 6);
    o.slabs = take(in, 18);
    o.scales = take(in, 6);
    o.half_resolution = take(in, 2);
    o.plane_boxes = take(in, 4);
    o.refine_levels = take(in, 4);
    o.as_printed = take(in, 2);
    o.inverted_depth = take(in, 2);
    o.float_table = take(in, 3);
    o.band_rows = take(in, 3) ? 0 : take(in, 40);
    o.bottom_up = take(in, 2);
    o.skip_flat = take(in, 2);
    o.geometric = take(in, 2);
    if (take(in, 2)) o.tolerance = 0;
    if (take(in, 2)) o.radius = (double)take_float(in);
    if (take(in, 4) == 0) o.gain = (double)take_float(in);
    if (take(in, 4) == 0) o.power = (double)take_float(in);
    if (take(in, 4) == 0) o.region_pixels = (double)take_float(in);
    if (take(in, 4) == 0) o.max_pixels = (double)take_float(in);
    if (take(in, 4) == 0) o.min_pixels = (double)take_float(in);
    return o;
}

static void check(const float *out, int count, float low)
{
    int i;
    for (i = 0; i < count; i++)
        if (!(out[i] >= low && out[i] <= 1)) abort();
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    static float depth[40 * 40], normals[40 * 40 * 3], out[40 * 40], bent[40 * 40 * 3];
    input in;
    ssao_sat_options o;
    ssao_sat_input picture;
    ssao_sat_stats stats;
    ssao_sat *ao;
    int w, h, i;
    in.bytes = bytes;
    in.size = size;
    w = 1 + take(&in, 40);
    h = 1 + take(&in, 40);
    o = take_options(&in);
    picture = ssao_sat_input_linear(depth, w, h, 1.0);
    picture.depth_kind = (ssao_sat_depth)take(&in, 4);
    picture.clip_zero_to_one = take(&in, 2);
    if (take(&in, 2)) picture.normals = normals;
    if (take(&in, 4) == 0) picture.depth_stride = (ptrdiff_t)(4 * take(&in, 41));
    if (take(&in, 2)) picture.projection[take(&in, 16)] = take_float(&in);
    if (take(&in, 4) == 0) picture.projection[take(&in, 16)] = take_float(&in);
    if (picture.depth_stride > 40 * 4) picture.depth_stride = 0;
    take_bytes(&in, depth, 4 * 24);
    for (i = 24; i < 40 * 40; i++) depth[i] = depth[i % 24];
    for (i = 0; i < 40 * 40 * 3; i++) normals[i] = depth[(i + 5) % 24];
    if (ssao_sat_create(&ao, w, h, &o) != SAT_OK) return 0;
    if (ssao_sat_apply(ao, out, 0, &picture, &stats) == SAT_OK) {
        check(out, w * h, 0);
        if (stats.sky + stats.tiny + stats.flat + stats.interpolated + stats.estimated != stats.pixels &&
            stats.farthest > 0 && stats.estimated)
            abort();
        ssao_sat_apply_bent(ao, out, 0, bent, 0, &picture, NULL);
        if (ssao_sat_apply_signed(ao, out, 0, &picture, NULL) == SAT_OK) check(out, w * h, -1);
    }
    ssao_sat_destroy(ao);
    return 0;
}
