/* tonemap - maps a high dynamic range picture to one for the screen.  SPDX-License-Identifier: MIT-0 OR Unlicense

       tonemap in.exr out.png                        local photographic operator
       tonemap in.hdr out.png --operator ashikhmin --mesopic local --stats
       tonemap in.exr sheet.png --compare            all operators on one contact sheet
       tonemap out.png                               a scene of its own: 10 decades from a dark room to the sun */

#define _POSIX_C_SOURCE 200809L
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
    } else {                                                  /* walls: light falls off from the window, and from the lamp */
        float distance = hypotf(u - 0.62f, v - 0.36f), brick = (int)(v * 24) % 2 ? 0.5f : 0.0f;
        float joint = fabsf(fmodf(u * 16 + brick, 1.0f) - 0.5f) > 0.46f || fabsf(fmodf(v * 24, 1.0f) - 0.5f) > 0.44f ? 0.6f : 1.0f;
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

/* ---- words of the command line ---- */

static const char *const operators[] = {"local", "global", "ashikhmin", "ashikhmin-global", "linear", NULL};
static const char *const mesopics[] = {"off", "uniform", "local", NULL};

static int choose(const char *option, const char *const *words, const char *word)
{
    int i;
    for (i = 0; words[i]; ++i)
        if (strcmp(words[i], word) == 0) return i;
    fprintf(stderr, "--%s %s: must be one of", option, word);
    for (i = 0; words[i]; ++i) fprintf(stderr, " %s", words[i]);
    fputc('\n', stderr);
    exit(2);
}

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
    printf("searched       %.1f %%, skipped %.1f %%", 100 * (double)s->searched / pixels, 100 * (double)s->skipped / pixels);
    printf(s->worst_codes > 0 ? " with an error below %.2f codes\n" : "\n", s->worst_codes);
    while (last > 0 && !s->scale[last]) --last;
    printf("neighbourhoods");
    for (k = 0; k <= last && s->searched; ++k) printf(" %.1f %%", 100 * (double)s->scale[k] / (double)s->searched);
    printf(" from the smallest to the largest\n");
}

/* ---- one picture, or all operators on a sheet ---- */

static int map_picture(unsigned char *out, const image *picture, const tonemap_options *options, tonemap_stats *stats, double *seconds)
{
    sat_image view = image_view(picture);
    tonemap *map;
    double start;
    sat_result result = tonemap_create(&map, picture->width, picture->height, options);
    if (result == SAT_OK) {
        start = common_clock();
        result = tonemap_apply_u8(map, out, (ptrdiff_t)picture->width * 3, &view, 0, stats);
        *seconds = common_clock() - start;
        tonemap_destroy(map);
    }
    if (result != SAT_OK) fprintf(stderr, "tonemap: %s\n", sat_result_text(result));
    return result == SAT_OK;
}

typedef struct variant { const char *label; tonemap_operator operation; tonemap_mesopic mesopic; int automatic; double soft; } variant;

static int write_sheet(const char *path, const image *picture, const tonemap_options *options)
{
    static const variant variants[] = {
        {"photographic local", TONEMAP_PHOTOGRAPHIC_LOCAL, TONEMAP_MESOPIC_OFF, 0, 0},
        {"photographic local, automatic key and white", TONEMAP_PHOTOGRAPHIC_LOCAL, TONEMAP_MESOPIC_OFF, 1, 0},
        {"photographic global", TONEMAP_PHOTOGRAPHIC_GLOBAL, TONEMAP_MESOPIC_OFF, 0, 0},
        {"local, mesopic uniform", TONEMAP_PHOTOGRAPHIC_LOCAL, TONEMAP_MESOPIC_UNIFORM, 0, 0},
        {"local, mesopic local", TONEMAP_PHOTOGRAPHIC_LOCAL, TONEMAP_MESOPIC_LOCAL, 0, 0},
        {"local, soft scales", TONEMAP_PHOTOGRAPHIC_LOCAL, TONEMAP_MESOPIC_OFF, 0, 1},
        {"Ashikhmin", TONEMAP_ASHIKHMIN, TONEMAP_MESOPIC_OFF, 0, 0},
        {"Ashikhmin global", TONEMAP_ASHIKHMIN_GLOBAL, TONEMAP_MESOPIC_OFF, 0, 0},
        {"linear", TONEMAP_LINEAR, TONEMAP_MESOPIC_OFF, 0, 0},
    };
    enum { COUNT = sizeof variants / sizeof variants[0] };
    common_cell cells[COUNT];
    common_progress progress = {0, 0};
    size_t bytes = (size_t)picture->width * (size_t)picture->height * 3;
    unsigned char *pixels = (unsigned char *)malloc(COUNT * bytes);
    double seconds;
    int i, ok = pixels != NULL;
    for (i = 0; i < COUNT && ok; ++i) {
        tonemap_options o = *options;
        o.operation = variants[i].operation;
        o.mesopic = variants[i].mesopic;
        o.soft = variants[i].soft;
        if (variants[i].automatic) o.key = o.white = 0;
        ok = map_picture(pixels + (size_t)i * bytes, picture, &o, NULL, &seconds);
        cells[i].rgb = pixels + (size_t)i * bytes;
        cells[i].width = picture->width;
        cells[i].height = picture->height;
        cells[i].label = variants[i].label;
        common_show_progress(&progress, "operators", i + 1, COUNT);
    }
    if (ok && !common_contact_sheet(path, cells, COUNT, 3)) {
        fprintf(stderr, "%s: cannot be written\n", path);
        ok = 0;
    }
    free(pixels);
    return ok;
}

static int write_picture(const char *path, const image *picture, const tonemap_options *options, int print)
{
    unsigned char *pixels = (unsigned char *)malloc((size_t)picture->width * (size_t)picture->height * 3);
    tonemap_stats stats;
    double seconds = 0;
    int ok = pixels && map_picture(pixels, picture, options, &stats, &seconds);
    if (ok && !image_save_u8(path, pixels, picture->width, picture->height, 3)) {
        fprintf(stderr, "%s: cannot be written\n", path);
        ok = 0;
    }
    if (ok && print) print_stats(&stats, picture, seconds);
    free(pixels);
    return ok;
}

int main(int argc, char **argv)
{
    float key = 0.18f, white = -1, phi = 8, epsilon = 0.05f, soft = 0, cd = 0, lux = 1, tolerance = 0, selective = 0;
    int scales = 8, compare = 0, size[2] = {1280, 720}, first, ok;
    const char *operation = "local", *mesopic = "off";
    const common_option options[] = {
        {"operator", 's', &operation, "local, global, ashikhmin, ashikhmin-global or linear"},
        {"key", 'f', &key, "display value of the log-average, 0.18; 0: estimated"},
        {"white", 'f', &white, "smallest luminance shown as white; 0: estimated; -1: none, the default"},
        {"phi", 'f', &phi, "sharpening of the scale test, 8"},
        {"epsilon", 'f', &epsilon, "threshold of the scale test, 0.05"},
        {"scales", 'i', &scales, "neighbourhoods tried, 1 to 8"},
        {"soft", 'f', &soft, "0 to 1: mix neighbourhoods, against flicker"},
        {"mesopic", 's', &mesopic, "off, uniform or local: reds fade in dim light"},
        {"cd", 'f', &cd, "cd/m2 of a luminance of 1; 0: the log-average is 10"},
        {"lux", 'f', &lux, "illuminance of a luminance of 1 cd/m2, 1"},
        {"tolerance", 'f', &tolerance, "8-bit codes by which a skipped search may be wrong, 0"},
        {"selective", 'f', &selective, "search only where the gradient exceeds this, 0: everywhere"},
        {"compare", 'b', &compare, "all operators on a contact sheet"},
        {"size", 'z', size, "of the scene drawn when no picture is given, 1280x720"},
    };
    common_settings common;
    tonemap_options o = tonemap_defaults();
    image picture;
    const char *out;
    first = common_parse(&common, argc, argv, "tonemap [options] [in.exr|in.hdr|in.png] out.png", options,
                         (int)(sizeof options / sizeof options[0]));
    if (!common.out && first < argc) common.out = argv[--argc];
    out = common.out ? common.out : "tonemap.png";
    o.operation = (tonemap_operator)choose("operator", operators, operation);
    o.mesopic = (tonemap_mesopic)choose("mesopic", mesopics, mesopic);
    o.key = (double)key;
    if (white >= 0) o.white = (double)white;
    o.phi = (double)phi;
    o.epsilon = (double)epsilon;
    o.scales = scales;
    o.soft = (double)soft;
    o.cd_per_unit = (double)cd;
    o.lux_per_cd = (double)lux;
    o.tolerance_codes = (double)tolerance;
    o.selective = (double)selective;
    o.threads = common.threads;
    if (!(first < argc ? image_load(&picture, argv[first]) : make_scene(&picture, size[0], size[1]))) {
        fprintf(stderr, "tonemap: %s\n", picture.message);
        return 1;
    }
    ok = compare ? write_sheet(out, &picture, &o) : write_picture(out, &picture, &o, common.stats);
    image_free(&picture);
    return !ok;
}
