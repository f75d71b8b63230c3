/* Argument structs from arbitrary bytes: nothing may crash, loop or write outside; finite light stays finite. */

#define SAT_IMPLEMENTATION
#define RAINDROP_IMPLEMENTATION
#include "raindrop.h"

enum { FUZZ_W = 24, FUZZ_H = 16 };

typedef struct fuzz_bytes { const unsigned char *at; size_t left; } fuzz_bytes;

static void fuzz_take(void *out, size_t size, fuzz_bytes *in)
{
    memset(out, 0, size);
    if (size > in->left) size = in->left;
    memcpy(out, in->at, size);
    in->at += size;
    in->left -= size;
}

static float fuzz_float(fuzz_bytes *in)
{
    float v;
    unsigned char kind;
    fuzz_take(&kind, 1, in);
    if (kind < 128) return (float)kind / 64 - 1; /* often something sensible */
    fuzz_take(&v, sizeof v, in);
    return v;
}

static int fuzz_int(fuzz_bytes *in, int low, int high)
{
    unsigned char v;
    fuzz_take(&v, 1, in);
    return low + v % (high - low + 1);
}

static void fuzz_drops(raindrop_drop *drops, int count, fuzz_bytes *in)
{
    int i, c;
    for (i = 0; i < count; i++) {
        for (c = 0; c < 3; c++) {
            drops[i].position[c] = fuzz_float(in);
            drops[i].velocity[c] = 5 * fuzz_float(in);
        }
        drops[i].radius = 0.2f * fuzz_float(in);
        drops[i].axis_ratio = fuzz_int(in, 0, 1) ? 1 : fuzz_float(in);
    }
}

static void fuzz_render(const raindrop_environment *environment, raindrop_rain *rain, fuzz_bytes *in)
{
    static float rgb[3 * FUZZ_W * FUZZ_H], depth[FUZZ_W * FUZZ_H];
    raindrop_camera camera = raindrop_camera_defaults();
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_render_stats stats;
    float eye[3], target[3], up[3];
    int i;
    for (i = 0; i < 3; i++) {
        eye[i] = fuzz_float(in);
        target[i] = fuzz_float(in);
        up[i] = fuzz_float(in);
    }
    camera = raindrop_camera_look(eye, target, up, 1.2f);
    camera.depth_near = fuzz_float(in);
    camera.exposure = fuzz_float(in);
    camera.aperture = fuzz_float(in);
    camera.focus_distance = fuzz_float(in);
    for (i = 0; i < FUZZ_W * FUZZ_H; i++) depth[i] = 1 + fuzz_float(in);
    o.look = (raindrop_look)fuzz_int(in, 1, 4);
    o.far_radius = 10 * fuzz_float(in);
    o.orders = fuzz_int(in, 0, 4);
    o.exit_fresnel = fuzz_int(in, 0, 1);
    o.orders_radius = 8 * fuzz_float(in);
    for (i = 0; i < 3 * FUZZ_W * FUZZ_H; i++) rgb[i] = 1;
    if (raindrop_render(rgb, FUZZ_W * 12, FUZZ_W, FUZZ_H, fuzz_int(in, 0, 1) ? depth : NULL, &camera, rain, environment,
                        &o, &stats) != SAT_OK)
        return;
    for (i = 0; i < 3 * FUZZ_W * FUZZ_H; i++) SAT_ASSERT(sat__is_finite(rgb[i]));
    SAT_ASSERT(stats.drawn_near + stats.drawn_far + stats.invalid + stats.inside + stats.behind + stats.near_plane +
                   stats.outside + stats.hidden + stats.below_threshold ==
               stats.drops);
}

int LLVMFuzzerTestOneInput(const unsigned char *bytes, size_t size);

int LLVMFuzzerTestOneInput(const unsigned char *bytes, size_t size)
{
    static float sky[3 * 16 * 8];
    fuzz_bytes in;
    raindrop_environment_options e = raindrop_environment_defaults();
    raindrop_rain_options r = raindrop_rain_defaults();
    raindrop_environment *environment = NULL;
    raindrop_rain *rain = NULL;
    raindrop_drop drops[8];
    sat_image image = sat_image_f32(sky, 16, 8, 3);
    float wind[3];
    int i;
    in.at = bytes;
    in.left = size;
    for (i = 0; i < 3 * 16 * 8; i++) sky[i] = 1 + fuzz_float(&in);
    e.resolution = 16;
    e.far_resolution = 8;
    e.far_samples = 16;
    e.max_radiance = 1000;
    e.far_orders = fuzz_int(&in, 0, 4);
    e.n = 1.3f + 0.5f * fuzz_float(&in);
    e.scale = 1 + 0.5f * fuzz_float(&in);
    if (raindrop_environment_create(&environment, &image, &e, NULL) != SAT_OK) return 0;
    fuzz_drops(drops, 8, &in);
    r.count = 8;
    if (fuzz_int(&in, 0, 3)) r.drops = drops;
    else {
        r.rate_mm_h = 10 + 10 * (double)fuzz_float(&in);
        r.diameter_mm = 2 * (double)fuzz_float(&in);
        for (i = 0; i < 3; i++) r.box_size[i] = 1 + fuzz_float(&in);
    }
    if (raindrop_rain_create(&rain, &r) == SAT_OK) {
        for (i = 0; i < 3; i++) wind[i] = fuzz_float(&in);
        raindrop_rain_advance(rain, (double)fuzz_float(&in));
        raindrop_rain_set_wind(rain, wind);
        raindrop_rain_advance(rain, (double)fuzz_float(&in));
        fuzz_render(environment, rain, &in);
    }
    raindrop_rain_destroy(rain);
    raindrop_environment_destroy(environment);
    return 0;
}
