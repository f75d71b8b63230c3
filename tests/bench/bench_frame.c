/* What each default costs in a frame: a megapixel over a memcpy of its float RGB. The table of docs/engine.md.
   SPDX-License-Identifier: MIT-0 OR Unlicense */

#define LIGHTSCAN_IMPLEMENTATION
#include "bench.h"
#include "fiv.h"
#include "raindrop.h"
#include "softassign.h"
#include "ssao_sat.h"
#include "tonemap.h"

enum { WIDTH = 1280, HEIGHT = 720, PIXELS = WIDTH * HEIGHT, RECEIVERS = 20000, RINGS = 24, SEGMENTS = 48 };

typedef struct frame {
    float *picture, *copy, *depth, *open, *points, *normals, *irradiance;
    unsigned char *screen;
    sat_table *table;
    tonemap *map, *global;
    ssao_sat *ao;
    fiv_environment *light;
    fiv_occluder *ball;
    raindrop_environment *around;
    raindrop_rain *rain;
    raindrop_camera camera;
    float height; /* of the ball's centre, whose radius is 1 */
} frame;

static void run_copy(void *user)
{
    frame *f = (frame *)user;
    memcpy(f->copy, f->picture, sizeof(float) * 3 * PIXELS);
}

static void run_build(void *user)
{
    frame *f = (frame *)user;
    sat_image image = sat_image_f32(f->picture, WIDTH, HEIGHT, 3);
    if (sat_build(f->table, &image) != SAT_OK) abort();
}

static void run_filter(void *user)
{
    frame *f = (frame *)user;
    if (sat_box_filter(f->copy, 0, f->table, 10) != SAT_OK) abort();
}

static void run_tone(void *user)
{
    frame *f = (frame *)user;
    sat_image image = sat_image_f32(f->picture, WIDTH, HEIGHT, 3);
    if (tonemap_apply_u8(f->map, f->screen, 0, &image, 0, NULL) != SAT_OK) abort();
}

static void run_global(void *user)
{
    frame *f = (frame *)user;
    sat_image image = sat_image_f32(f->picture, WIDTH, HEIGHT, 3);
    if (tonemap_apply_u8(f->global, f->screen, 0, &image, 0, NULL) != SAT_OK) abort();
}

static void run_occlusion(void *user)
{
    frame *f = (frame *)user;
    ssao_sat_input input = ssao_sat_input_linear(f->depth, WIDTH, HEIGHT, 1.0);
    if (ssao_sat_apply(f->ao, f->open, 0, &input, NULL) != SAT_OK) abort();
}

static void run_shadows(void *user)
{
    frame *f = (frame *)user;
    fiv_instance ball = {NULL, {0, 1, 0}, 1};
    ball.occluder = f->ball;
    ball.position[1] = f->height;
    if (fiv_irradiance(f->irradiance, f->points, f->normals, RECEIVERS, f->light, &ball, 1, NULL, NULL) != SAT_OK)
        abort();
}

static void run_rain(void *user)
{
    frame *f = (frame *)user;
    if (raindrop_rain_advance(f->rain, 1 / 60.0) != SAT_OK) abort();
    if (raindrop_render(f->picture, 0, WIDTH, HEIGHT, f->depth, &f->camera, f->rain, f->around, NULL, NULL) != SAT_OK)
        abort();
}

/* A ball of triangles. */
static sat_result make_ball(fiv_occluder **out)
{
    static float positions[3 * (RINGS + 1) * SEGMENTS];
    static unsigned indices[6 * RINGS * SEGMENTS];
    int i, j, k = 0;
    for (i = 0; i <= RINGS; i++)
        for (j = 0; j < SEGMENTS; j++) {
            double theta = 3.14159265 * i / RINGS, phi = 6.28318531 * j / SEGMENTS;
            float *p = positions + 3 * (i * SEGMENTS + j);
            p[0] = (float)(sin(theta) * cos(phi));
            p[1] = (float)cos(theta);
            p[2] = (float)(sin(theta) * sin(phi));
        }
    for (i = 0; i < RINGS; i++)
        for (j = 0; j < SEGMENTS; j++) {
            unsigned a = (unsigned)(i * SEGMENTS + j), b = (unsigned)(i * SEGMENTS + (j + 1) % SEGMENTS);
            indices[k++] = a, indices[k++] = b, indices[k++] = a + SEGMENTS;
            indices[k++] = b, indices[k++] = b + SEGMENTS, indices[k++] = a + SEGMENTS;
        }
    return fiv_occluder_create(out, positions, (RINGS + 1) * SEGMENTS, indices, 2 * RINGS * SEGMENTS, NULL, NULL);
}

static void make(frame *f)
{
    sat_image sky;
    tonemap_options global = tonemap_defaults();
    int i;
    memset(f, 0, sizeof *f);
    f->picture = (float *)malloc(sizeof(float) * 3 * PIXELS);
    f->copy = (float *)malloc(sizeof(float) * 3 * PIXELS);
    f->depth = (float *)malloc(sizeof(float) * PIXELS);
    f->open = (float *)malloc(sizeof(float) * PIXELS);
    f->screen = (unsigned char *)malloc(3 * PIXELS);
    f->points = (float *)malloc(sizeof(float) * 3 * RECEIVERS);
    f->normals = (float *)calloc(3 * RECEIVERS, sizeof(float));
    f->irradiance = (float *)malloc(sizeof(float) * 3 * RECEIVERS);
    if (!f->picture || !f->copy || !f->depth || !f->open || !f->screen || !f->points || !f->normals || !f->irradiance)
        abort();
    support_hdr_image(f->picture, WIDTH, HEIGHT, 3, 5);
    for (i = 0; i < PIXELS; i++) { /* a floor below the horizon, with pillars on it */
        int x = i % WIDTH, y = i / WIDTH;
        double floor_z = y > HEIGHT / 2 ? 1.5 * 659 / (y - HEIGHT / 2) : 1e4;
        double pillar = x % 200 < 40 && y > 200 && y < 600 ? 6 + x / 200 : 1e4;
        f->depth[i] = (float)(floor_z < pillar ? floor_z : pillar);
    }
    for (i = 0; i < RECEIVERS; i++) {
        f->points[3 * i] = (float)(i % 200) * 0.04f - 4;
        f->points[3 * i + 1] = 0;
        f->points[3 * i + 2] = (float)(i / 200) * 0.08f - 4;
        f->normals[3 * i + 1] = 1;
    }
    sky = sat_image_f32(f->picture, 512, 256, 3);
    global.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL;
    f->camera = raindrop_camera_defaults();
    f->camera.fov_y = 1;
    if (sat_create(&f->table, WIDTH, HEIGHT, 3, NULL) != SAT_OK ||
        tonemap_create(&f->map, WIDTH, HEIGHT, NULL) != SAT_OK ||
        tonemap_create(&f->global, WIDTH, HEIGHT, &global) != SAT_OK ||
        ssao_sat_create(&f->ao, WIDTH, HEIGHT, NULL) != SAT_OK ||
        fiv_environment_create(&f->light, &sky, NULL, NULL) != SAT_OK || make_ball(&f->ball) != SAT_OK ||
        fiv_occluder_light(f->ball, f->light, NULL) != SAT_OK ||
        raindrop_environment_create(&f->around, &sky, NULL, NULL) != SAT_OK ||
        raindrop_rain_create(&f->rain, NULL) != SAT_OK)
        abort();
}

static void row(frame *f, const char *stage, const char *call, bench_fn *work, double megapixels)
{
    bench_times t = bench_ratio(work, f, run_copy, f, bench_rounds(9));
    double unit = t.peer / (PIXELS * 1e-6);
    bench_row("%s\t%s\t%.*f\t%.*f", stage, call, t.work / megapixels < 100 * unit ? 1 : 0, t.work / megapixels / unit,
              t.work / megapixels < 0.1 ? 1 : 0, 1e3 * t.work / megapixels);
}

int main(void)
{
    frame f;
    const double whole = PIXELS * 1e-6;
    make(&f);
    bench_start("all headers");
    bench_table("A frame by the defaults", "stage\tcall\tratio_to_memcpy\tms_per_megapixel");
    bench_note("One thread, 1280 x 720; memcpy is that of a megapixel of float RGB. fiv.h: a megapixel of receivers on a "
               "floor four times as wide as the one occluder, few of a picture's pixels. Rain: 10 mm/h, one step and one picture.");
    row(&f, "table of RGB", "sat_build", run_build, whole);
    row(&f, "box means, 21 x 21, RGB", "sat_box_filter", run_filter, whole);
    f.height = 2;
    row(&f, "soft shadows of what floats", "fiv_irradiance", run_shadows, RECEIVERS * 1e-6);
    f.height = 1;
    row(&f, "soft shadows of what stands there", "fiv_irradiance", run_shadows, RECEIVERS * 1e-6);
    row(&f, "ambient occlusion", "ssao_sat_apply", run_occlusion, whole);
    row(&f, "rain", "raindrop_render", run_rain, whole);
    row(&f, "tone mapping, guided", "tonemap_apply_u8", run_tone, whole);
    row(&f, "tone mapping, global", "tonemap_apply_u8", run_global, whole);
    sat_destroy(f.table);
    tonemap_destroy(f.map);
    tonemap_destroy(f.global);
    ssao_sat_destroy(f.ao);
    fiv_occluder_destroy(f.ball);
    fiv_environment_destroy(f.light);
    raindrop_rain_destroy(f.rain);
    raindrop_environment_destroy(f.around);
    free(f.picture), free(f.copy), free(f.depth), free(f.open), free(f.screen);
    free(f.points), free(f.normals), free(f.irradiance);
    return 0;
}
