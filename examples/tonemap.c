/* tonemap - maps a high dynamic range picture to one for the screen.  SPDX-License-Identifier: MIT-0 OR Unlicense

       tonemap in.exr out.png                        guided local operator; out.exr: floats
       tonemap in.hdr out.png --operator ashikhmin --mesopic local --stats
       tonemap in.exr sheet.png --compare --cell 400 all operators on one contact sheet, and pfstools' where installed
       tonemap in.exr hdr10.exr --peak 5 --encoding pq --display 2020
       tonemap                                       a scene of its own: 10 decades from a dark room to the sun */

#define _XOPEN_SOURCE 700
#define SAT_IMPLEMENTATION
#define TONEMAP_IMPLEMENTATION
#include "../tonemap.h"
#include "common.h"

/* ---- the scene: a room with a window, a red lamp and a dark corner ---- */

static float noise(int x, int y)
{
    uint32_t h = (uint32_t)x * 0x9e3779b1u ^ (uint32_t)y * 0x85ebca77u;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    return (float)(h >> 8) / 16777216.0f;
}

/* Luminance in cd/m2 and colour of a point, u to the right, v down, both 0..1. */
static void scene_pixel(float *rgb, float u, float v, int x, int y)
{
    float light, r = 1, g = 1, b = 1, grain = 0.92f + 0.16f * noise(x, y);
    float wx = (u - 0.62f) / 0.2f, wy = (v - 0.36f) / 0.24f, lx = (u - 0.2f) / 0.02f, ly = (v - 0.55f) / 0.035f;
    float sun = hypotf((u - 0.7f) * 16 / 9, v - 0.22f), lamp = hypotf((u - 0.2f) * 16 / 9, v - 0.55f);
    int bar = fabsf(wx) < 0.03f || fabsf(wy) < 0.025f;
    if (fabsf(wx) < 1 && fabsf(wy) < 1 && !bar) {            /* outside: sky, hills, the sun */
        float hill = 0.47f + 0.03f * sinf(u * 40) + 0.015f * sinf(u * 97);
        light = 3000 + 9000 * expf(-sun * 6);
        r = 0.55f + 0.4f * expf(-sun * 4), g = 0.75f, b = 1.2f - 0.5f * expf(-sun * 4);
        if (v > hill) light = 250 * grain, r = 0.5f, g = 1.0f, b = 0.3f;
        if (sun < 0.018f) light = 1e7f, r = 1, g = 0.95f, b = 0.85f;
    } else if (lx * lx + ly * ly < 1) {                       /* the lamp */
        light = 60, r = 4, g = 0.15f, b = 0.1f;
    } else {                                                  /* walls: light falls off from the window, and from the
                                                                 lamp */
        float distance = hypotf(u - 0.62f, v - 0.36f), brick = (int)(v * 24) % 2 ? 0.5f : 0.0f;
        float joint = fabsf(fmodf(u * 16 + brick, 1.0f) - 0.5f) > 0.46f || fabsf(fmodf(v * 24, 1.0f) - 0.5f) > 0.44f
                          ? 0.6f
                          : 1.0f;
        light = 30 * expf(-distance * 12) * joint * grain;
        light += v > 0.85f ? 0.3f * expf(-fabsf(u - 0.5f) * 8) * grain : 0;
        if (u < 0.09f && v > 0.75f) light = 1e-3f * (((int)(u * 160) + (int)(v * 90)) % 2 ? 1.0f : 3.0f) * grain;
        r = 1, g = 0.86f, b = 0.72f;
        rgb[0] = 0.6f * expf(-lamp * 9) * joint;
        r += rgb[0] / light;
    }
    rgb[0] = light * r;
    rgb[1] = light * g;
    rgb[2] = light * b;
}

static int make_scene(image *picture, int width, int height)
{
    int x, y;
    if (!image_create(picture, width, height, 3)) return 0;
    for (y = 0; y < height; ++y)
        for (x = 0; x < width; ++x)
            scene_pixel(picture->pixels + ((size_t)y * (size_t)width + (size_t)x) * 3, ((float)x + 0.5f) / (float)width,
                        ((float)y + 0.5f) / (float)height, x, y);
    return 1;
}

/* ---- one picture, or all operators on a sheet ---- */

static void print_stats(const tonemap_stats *s, const image *picture, double seconds)
{
    double pixels = (double)picture->width * picture->height;
    int k, last = 9;
    printf("size           %d x %d, %.1f ms, %.2f ns a pixel\n", picture->width, picture->height, 1e3 * seconds, 1e9 * seconds / pixels);
    printf("log-average    %.5g, mean %.5g, 1 %% quantile %.4g, 99 %% quantile %.4g (%.1f decades)\n", s->log_average, s->mean, s->low,
           s->high, s->low > 0 ? log10(s->high / s->low) : 0.0);
    printf("key, white     %.4g, %.4g\n", s->key, s->white);
    printf("replaced       %zu NaN, %zu infinite, %zu negative; %zu black; %zu clipped to white\n", s->nan, s->infinite, s->negative,
           (size_t)pixels - s->positive - s->nan - s->negative, s->clamped);
    printf("searched       %.1f %%, skipped %.1f %%\n", 100 * (double)s->searched / pixels, 100 * (double)s->skipped / pixels);
    while (last > 0 && !s->scale[last]) --last;
    printf("neighbourhoods");
    for (k = 0; k <= last && s->searched; ++k) printf(" %.1f %%", 100 * (double)s->scale[k] / (double)s->searched);
    printf(" from the smallest to the largest\n");
}

/* Display values of 8 bits (sRGB) or floats (linear): the one of them that is not NULL. */
static int map_picture(const common_settings *common, unsigned char *bytes, float *floats, const image *picture,
                       const tonemap_options *options, tonemap_stats *stats, double *seconds)
{
    sat_image view = image_view(picture);
    tonemap *map;
    char why[200];
    double start;
    sat_result result = tonemap_create(&map, picture->width, picture->height, options);
    if (result == SAT_OK) {
        start = common_clock();
        if (bytes) result = tonemap_apply_u8(map, bytes, (ptrdiff_t)picture->width * 3, &view, 0, stats);
        else
            result = tonemap_apply_f32(map, floats, (ptrdiff_t)picture->width * 3 * (ptrdiff_t)sizeof(float), &view, 0,
                                       stats);
        *seconds = common_clock() - start;
        tonemap_destroy(map);
    }
    return result == SAT_OK || common_say_result(common, "tone mapping", result, tonemap_explain(why, sizeof why, picture->width, picture->height, options));
}

/* ---- what else can be installed: pfstools' operators, which read and write files ---- */

/* A folder of our own for their files; 0 where there is none, and on Windows, where they are not. */
static int make_folder(char *name)
{
#ifdef _WIN32
    (void)name;
    return 0;
#else
    return mkdtemp(name) != NULL;
#endif
}

/* Runs one on the picture; 0 when it is not there. */
static int map_by_peer(unsigned char *bytes, const image *picture, const char *folder, const char *peer)
{
    char command[600], path[300];
    FILE *file;
    int width = 0, height = 0, ok;
    snprintf(path, sizeof path, "%s/out.ppm", folder);
    snprintf(command, sizeof command,
             "{ pfsinexr '%s/in.exr' | %s | pfsgamma -g 2.2 | pfsoutppm '%s'; } >/dev/null 2>&1", folder, peer, path);
    if (system(command) != 0) return 0;
    file = fopen(path, "rb");
    if (!file) return 0;
    ok = fscanf(file, "P6 %d %d 255", &width, &height) == 2 && width == picture->width && height == picture->height &&
         fgetc(file) != EOF && fread(bytes, 3, (size_t)width * (size_t)height, file) == (size_t)width * (size_t)height;
    fclose(file);
    remove(path);
    return ok;
}

/* The picture without what they do not take. */
static int save_for_peers(const image *picture, const char *folder)
{
    char path[300];
    image copy = *picture;
    size_t n = (size_t)picture->width * (size_t)picture->height * (size_t)picture->channels, i;
    int ok;
    copy.pixels = (float *)malloc(n * sizeof(float));
    if (!copy.pixels) return 0;
    for (i = 0; i < n; ++i)
        copy.pixels[i] = picture->pixels[i] > 1e-7f && picture->pixels[i] < 1e30f ? picture->pixels[i] : 1e-7f;
    snprintf(path, sizeof path, "%s/in.exr", folder);
    ok = image_save(&copy, path);
    free(copy.pixels);
    return ok;
}

/* ---- all on a sheet ---- */

typedef struct variant { const char *label; int operation; const char *peer; } variant;

/* Means of the codes of whole pixels, in place. */
static void shrink(common_cell *cell, unsigned char *bytes, int width, int height, int wanted)
{
    int x, y, c, u, v;
    cell->rgb = bytes;
    cell->width = wanted > 0 && wanted < width ? wanted : width;
    cell->height = height * cell->width / width > 0 ? height * cell->width / width : 1;
    for (y = 0; y < cell->height && cell->width < width; ++y)
        for (x = 0; x < cell->width; ++x) {
            int x0 = x * width / cell->width, x1 = (x + 1) * width / cell->width, y0 = y * height / cell->height,
                y1 = (y + 1) * height / cell->height, sum[3] = {0, 0, 0};
            for (v = y0; v < y1; ++v)
                for (u = x0; u < x1; ++u)
                    for (c = 0; c < 3; ++c) sum[c] += bytes[3 * ((size_t)v * (size_t)width + (size_t)u) + (size_t)c];
            for (c = 0; c < 3; ++c)
                bytes[3 * ((size_t)y * (size_t)cell->width + (size_t)x) + (size_t)c] =
                    (unsigned char)(sum[c] / ((x1 - x0) * (y1 - y0)));
        }
}

static int write_sheet(const common_settings *common, const image *picture, const tonemap_options *options, int width)
{
    static const variant variants[] = {
        {"guided (the default)", TONEMAP_GUIDED, NULL},
        {"photographic local", TONEMAP_PHOTOGRAPHIC_LOCAL, NULL},
        {"photographic global", TONEMAP_PHOTOGRAPHIC_GLOBAL, NULL},
        {"Ashikhmin", TONEMAP_ASHIKHMIN, NULL},
        {"Khronos PBR Neutral", TONEMAP_NEUTRAL, NULL},
        {"AgX", TONEMAP_AGX, NULL},
        {"ACES (Hill)", TONEMAP_ACES, NULL},
        {"Hable", TONEMAP_HABLE, NULL},
        {"pfstmo_reinhard02 -s", 0, "pfstmo_reinhard02 -s"},
        {"pfstmo_mantiuk06", 0, "pfstmo_mantiuk06"},
        {"pfstmo_drago03", 0, "pfstmo_drago03"},
        {"pfstmo_reinhard05", 0, "pfstmo_reinhard05"},
        {"linear", TONEMAP_LINEAR, NULL},
    };
    enum { COUNT = sizeof variants / sizeof variants[0] };
    common_cell cells[COUNT];
    common_progress progress = {0, 0};
    size_t bytes = (size_t)picture->width * (size_t)picture->height * 3;
    unsigned char *pixels = (unsigned char *)malloc(COUNT * bytes);
    char folder[] = "/tmp/tonemap_XXXXXX", path[300];
    double seconds;
    int i, count = 0, ok = pixels != NULL || common_say(common, "no memory"), peers = make_folder(folder);
    peers = peers && save_for_peers(picture, folder);
    for (i = 0; i < COUNT && ok; ++i) {
        tonemap_options o = *options;
        unsigned char *at = pixels + (size_t)count * bytes;
        o.operation = (tonemap_operator)variants[i].operation;
        if (variants[i].peer && !(peers && map_by_peer(at, picture, folder, variants[i].peer))) continue;
        if (!variants[i].peer) ok = map_picture(common, at, NULL, picture, &o, NULL, &seconds);
        shrink(&cells[count], at, picture->width, picture->height, width);
        cells[count++].label = variants[i].label;
        common_show_progress(&progress, "operators", i + 1, COUNT);
    }
    snprintf(path, sizeof path, "%s/in.exr", folder);
    remove(path);
    remove(folder);
    ok = ok && common_contact_sheet(common, common->out, cells, count, 5);
    free(pixels);
    return ok;
}

/* Floats go into the picture itself. */
static int write_picture(const common_settings *common, image *picture, const tonemap_options *options)
{
    int as_bytes = image_ends_with(common->out, ".png"), ok;
    unsigned char *pixels =
        as_bytes ? (unsigned char *)malloc((size_t)picture->width * (size_t)picture->height * 3) : NULL;
    tonemap_stats stats;
    double seconds = 0;
    ok = (!as_bytes || pixels || common_say(common, "no memory")) && map_picture(common, pixels, picture->pixels, picture, options, &stats, &seconds);
    ok = ok && (as_bytes ? common_save_u8(common, common->out, pixels, picture->width, picture->height, 3)
                         : common_save(common, common->out, picture));
    if (ok && common->stats) print_stats(&stats, picture, seconds);
    free(pixels);
    return ok;
}

int main(int argc, char **argv)
{
    tonemap_options o = tonemap_defaults();
    int operation = o.operation, mesopic = o.mesopic, metering = o.metering, primaries = o.primaries,
        display = o.display, encoding = o.encoding, compare = 0, cell = 0, size[2] = {1280, 720}, ok;
    const char *in = NULL;
    const common_option options[] = {
        {"in", 'P', (void *)&in, 0, 0, "picture to map; without one a scene is drawn"},
        {"operator", 'w', &operation, 0, 0, "local|global|ashikhmin|ashikhmin-global|linear|guided|neutral|agx|aces|hable"},
        {"key", 'd', &o.key, 0, 10, "display value of the log-average; 0: estimated"},
        {"white", 'd', &o.white, 0, INFINITY, "smallest luminance shown as white; 0: estimated; inf: none"},
        {"phi", 'd', &o.phi, -16, 16, "sharpening of the scale test"},
        {"epsilon", 'd', &o.epsilon, 1e-6, 1e6, "threshold of the scale test"},
        {"edge", 'd', &o.edge, 0.01, 10, "guided: octaves of light that are half an edge"},
        {"scales", 'i', &o.scales, 1, 8, "neighbourhoods tried"},
        {"soft", 'd', &o.soft, 0, 1, "mix neighbourhoods, against flicker"},
        {"gamut", 'd', &o.gamut, -1, 1, "colours beyond the display: 0 fades them, 1 dims them, -1 cuts each channel"},
        {"mesopic", 'w', &mesopic, 0, 0, "off|uniform|local reds fade in dim light"},
        {"cd", 'd', &o.cd_per_unit, 0, 1e9, "cd/m2 of a luminance of 1; 0: the log-average is 10"},
        {"lux", 'd', &o.lux_per_cd, 1e-6, 1e6, "illuminance of a luminance of 1 cd/m2"},
        {"selective", 'd', &o.selective, 0, 1e6, "search only where the gradient exceeds this; 0: everywhere"},
        {"metering", 'w', &metering, 0, 0, "percentiles|log-average"},
        {"exposure", 'd', &o.exposure, 0, 1e30, "factor of the light; 0: metered"},
        {"primaries", 'w', &primaries, 0, 0, "709|p3|2020 of the picture"},
        {"display", 'w', &display, 0, 0, "709|p3|2020 of the output"},
        {"red", 'd', &o.balance_red, 0, 1000, "white balance"},
        {"green", 'd', &o.balance_green, 0, 1000, "white balance"},
        {"blue", 'd', &o.balance_blue, 0, 1000, "white balance"},
        {"peak", 'd', &o.peak, 1, 100, "of the display, in units of white paper"},
        {"encoding", 'w', &encoding, 0, 0, "auto|linear|pq|hlg of floats"},
        {"paper", 'd', &o.white_cd, 1, 10000, "cd/m2 of white paper, for pq and hlg"},
        {"dither", 'b', &o.dither, 0, 0, "no bands in slow gradients"},
        {"compare", 'b', &compare, 0, 0, "all operators on a contact sheet"},
        {"cell", 'i', &cell, 0, 16384, "width of each picture on it; 0: as they are"},
        {"size", 'z', size, 1, 16384, "of the scene drawn when no picture is given"},
    };
    common_settings common;
    image picture;
    common_parse(&common, argc, argv, "tonemap", ".png .exr .hdr .pfm", options,
                 (int)(sizeof options / sizeof options[0]));
    if (compare) common.writes = ".png";
    if (!common_may_write(&common, common.out)) return 2;
    o.operation = (tonemap_operator)operation;
    o.mesopic = (tonemap_mesopic)mesopic;
    o.metering = (tonemap_metering)metering;
    o.primaries = (tonemap_primaries)primaries;
    o.display = (tonemap_primaries)display;
    o.encoding = (tonemap_encoding)encoding;
    o.threads = common.threads;
    if (!(in ? image_load(&picture, in) : make_scene(&picture, size[0], size[1])))
        return common_say(&common, picture.message), 1;
    ok = compare ? write_sheet(&common, &picture, &o, cell) : write_picture(&common, &picture, &o);
    image_free(&picture);
    common_close(&common);
    return !ok;
}
