/* Any options, sizes, formats and pixel bits: no crash, no undefined behaviour, output in [0, 1]. */
#define SAT_IMPLEMENTATION
#define TONEMAP_IMPLEMENTATION
#include "tonemap.h"
#include <stdlib.h>

typedef struct fuzz_input { const uint8_t *data; size_t size; } fuzz_input;

static void take(fuzz_input *in, void *out, size_t size)
{
    size_t n = size < in->size ? size : in->size;
    memset(out, 0, size);
    memcpy(out, in->data, n);
    in->data += n;
    in->size -= n;
}

static uint8_t take_byte(fuzz_input *in)
{
    uint8_t b;
    take(in, &b, 1);
    return b;
}

/* Half of the time a sensible value, else any bits. */
static double take_number(fuzz_input *in, double low, double high)
{
    uint8_t kind = take_byte(in);
    double v;
    if (kind & 1) return low + (high - low) * take_byte(in) / 255;
    take(in, &v, sizeof v);
    return v;
}

static tonemap_options take_options(fuzz_input *in)
{
    tonemap_options o = tonemap_defaults();
    o.operation = (tonemap_operator)(take_byte(in) % 11);
    o.mesopic = (tonemap_mesopic)(take_byte(in) % 4);
    if (take_byte(in) & 1) o.key = take_number(in, -1, 2);
    if (take_byte(in) & 1) o.white = take_number(in, 0, 10);
    if (take_byte(in) & 1) o.phi = take_number(in, -16, 16);
    if (take_byte(in) & 1) o.epsilon = take_number(in, 0, 1);
    if (take_byte(in) & 1) o.scales = take_byte(in) % 11;
    if (take_byte(in) & 1) o.soft = take_number(in, 0, 1);
    if (take_byte(in) & 1) o.cd_per_unit = take_number(in, 0, 100);
    if (take_byte(in) & 1) o.lux_per_cd = take_number(in, 0, 10);
    if (take_byte(in) & 1) o.selective = take_number(in, 0, 2);
    o.primaries = (tonemap_primaries)(take_byte(in) % 4);
    o.display = (tonemap_primaries)(take_byte(in) % 4);
    o.encoding = (tonemap_encoding)(take_byte(in) % 5);
    o.dither = take_byte(in) % 3;
    if (take_byte(in) & 1) o.peak = take_number(in, 1, 100);
    if (take_byte(in) & 1) o.edge = take_number(in, 0, 10);
    if (take_byte(in) & 1) o.balance_red = take_number(in, 0, 10);
    if (take_byte(in) & 1) o.balance_blue = take_number(in, 0, 10);
    if (take_byte(in) & 1) o.gamut = take_number(in, -1, 1);
    if (take_byte(in) & 1) o.metering = TONEMAP_METERING_LOG_AVERAGE;
    if (take_byte(in) & 1) o.exposure = take_number(in, 0, 10);
    if (take_byte(in) & 1) o.adapt_seconds = take_number(in, 0, 2);
    return o;
}

static void map_frame(tonemap *map, fuzz_input *in, int width, int height)
{
    static const int channels[4] = {1, 2, 3, 4};
    float pixels[48 * 48 * 4], out[48 * 48 * 4];
    unsigned char codes[48 * 48 * 4];
    sat_image view;
    tonemap_stats stats;
    int i, n;
    double dt = take_number(in, 0, 1);
    view = sat_image_f32(pixels, width, height, channels[take_byte(in) % 4]);
    view.format = (sat_format)(take_byte(in) % 4);
    if (view.format == SAT_F16 || view.format == SAT_U16) view.stride /= 2;
    if (view.format == SAT_U8) view.stride /= 4;
    take(in, pixels, sizeof pixels);
    n = width * height * view.channels;
    if (tonemap_apply_f32(map, out, (ptrdiff_t)width * view.channels * 4, &view, dt, &stats) == SAT_OK)
        for (i = 0; i < n; i++)
            if (!(out[i] >= 0 && out[i] <= 100)) abort();
    tonemap_apply_u8(map, codes, (ptrdiff_t)width * view.channels, &view, dt, NULL);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_input in;
    tonemap *map;
    tonemap_options o;
    int width, height;
    in.data = data;
    in.size = size;
    width = take_byte(&in) % 49;
    height = take_byte(&in) % 49;
    o = take_options(&in);
    if (tonemap_create(&map, width, height, &o) != SAT_OK) return 0;
    map_frame(map, &in, width, height);
    o = take_options(&in);
    tonemap_set_options(map, &o);
    map_frame(map, &in, width, height);
    tonemap_destroy(map);
    return 0;
}
