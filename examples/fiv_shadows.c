/* fiv_shadows - meshes above a plane under an environment map, with soft shadows on the plane, on each other and on
   themselves.                                                         SPDX-License-Identifier: MIT-0 OR Unlicense

       fiv_shadows                                                the light turns, then the meshes: out/fiv_shadows.png
       fiv_shadows sky.exr bunny.ply dragon.ply --out out.png
       fiv_shadows --night --compare --size 160x120               beside rays through every light, and the difference

   Without files: a sky with a low sun, and two knots. What comes before the light is in shadow_view.h. */

#define _POSIX_C_SOURCE 200809L
#define LIGHTSCAN_IMPLEMENTATION
#include "../fiv.h"
#include "../tonemap.h"
#include "common.h"
#include "mesh.h"
#include "../tests/reference_fiv.h" /* rays and knots */
#include "shadow_view.h"

enum { OBJECTS = 2 };

/* ---- skies without a file: a low sun; or a dim night with a moon and street lamps ---- */

static void make_sky(image *out, int night)
{
    static const int lamps[6][2] = {{40, 104}, {120, 100}, {200, 106}, {290, 101}, {370, 105}, {460, 99}};
    static const float zenith[3] = {0.25f, 0.30f, 1.0f}, horizon[3] = {0.9f, 0.8f, 0.75f};
    static const float ground[3] = {0.15f, 0.13f, 0.1f}, moon[3] = {11, 12, 14}, lamp[3] = {22, 12, 4.5f};
    int x, y, c, i;
    if (!image_create(out, 512, 256, 3)) fail("no memory");
    for (y = 0; y < 256; ++y)
        for (x = 0; x < 512; ++x) {
            float up = cosf(3.14159265f * ((float)y + 0.5f) / 256), turn = 6.2831853f * ((float)x + 0.5f) / 512;
            float *p = out->pixels + 3 * (y * 512 + x), glow = expf(-4 * (1 - cosf(turn - 4)) - 8 * fabsf(up - 0.35f));
            int disc = abs(x - 326) < 3 && abs(y - 72) < 3;
            for (c = 0; c < 3; ++c) {
                p[c] = up > 0 ? horizon[c] + (zenith[c] - horizon[c]) * sqrtf(up) + glow * (5 - (float)c) : ground[c];
                if (disc) p[c] = 1200 - 200 * (float)c;
                if (night) p[c] = disc ? moon[c] : 0.01f * (up > 0 ? zenith[c] : ground[c]);
            }
        }
    for (i = 0; i < 6 && night; ++i)
        for (y = -2; y < 3; ++y)
            for (x = -1; x < 2; ++x)
                memcpy(out->pixels + 3 * ((lamps[i][1] + y) * 512 + lamps[i][0] + x), lamp, sizeof lamp);
}

/* ---- light ---- */

/* Irradiance of all pixels that show `what`: gathered into a row, lit, and put back. */
static void light_pixels(view *v, const object *objects, int what, const fiv_environment *e,
                         const fiv_irradiance_options *options)
{
    size_t i, n = 0, pixels = (size_t)v->width * (size_t)v->height;
    float *row = (float *)malloc(9 * pixels * sizeof *row), *normals = row + 3 * pixels, *rgb = row + 6 * pixels;
    fiv_instance casters[OBJECTS];
    fiv_irradiance_stats stats;
    int k, others = 0;
    if (!row) fail("no memory");
    for (i = 0; i < pixels; ++i)
        if (v->what[i] == what) {
            for (k = 0; k < 3; ++k)
                row[3 * n + (size_t)k] = v->points[3 * i + (size_t)k] + 0.002f * v->normals[3 * i + (size_t)k];
            memcpy(normals + 3 * n++, v->normals + 3 * i, 3 * sizeof *normals);
        }
    for (k = 0; k < OBJECTS; ++k)
        if (k + 2 != what) casters[others++] = objects[k].instance;
    if (what >= 2)
        check(fiv_self_irradiance(rgb, row, normals, n, e, &objects[what - 2].instance, casters, (size_t)others,
                                  options, &stats),
              "self");
    else check(fiv_irradiance(rgb, row, normals, n, e, casters, (size_t)others, options, &stats), "irradiance");
    for (i = n = 0; i < pixels; ++i)
        if (v->what[i] == what) memcpy(v->light + 3 * i, rgb + 3 * n++, 3 * sizeof *rgb);
    free(row);
}

typedef struct truth { view *v; reference_scene *scene; float *directions, *powers; size_t lights; } truth;

static void trace_rows(int begin, int end, int worker, void *context)
{
    const truth *t = (const truth *)context;
    int y, x, k;
    (void)worker;
    for (y = begin; y < end; ++y)
        for (x = 0; x < t->v->width; ++x) {
            size_t i = (size_t)(y * t->v->width + x);
            float p[3], n[3], length = 0;
            double rgb[3];
            if (t->v->what[i] == 0) continue;
            for (k = 0; k < 3; ++k) length += t->v->normals[3 * i + (size_t)k] * t->v->normals[3 * i + (size_t)k];
            for (k = 0; k < 3; ++k) {
                n[k] = t->v->normals[3 * i + (size_t)k] / sqrtf(length);
                p[k] = t->v->points[3 * i + (size_t)k] + 0.002f * n[k];
            }
            reference_irradiance(rgb, t->scene, t->directions, t->powers, t->lights, p, n);
            for (k = 0; k < 3; ++k) t->v->light[3 * i + (size_t)k] = (float)rgb[k];
        }
}

static void light_by_rays(view *v, const object *objects, const fiv_environment *e, const sat_threads *threads)
{
    reference_scene scene;
    truth t;
    int i;
    memset(&scene, 0, sizeof scene);
    for (i = 0; i < OBJECTS; ++i)
        reference_add(&scene, objects[i].positions, objects[i].indices, objects[i].triangles, objects[i].rotation,
                      objects[i].instance.position, objects[i].instance.scale);
    reference_build(&scene);
    t.v = v, t.scene = &scene;
    t.lights = fiv_environment_lights(NULL, NULL, 0, e);
    t.directions = (float *)malloc(3 * t.lights * sizeof(float));
    t.powers = (float *)malloc(3 * t.lights * sizeof(float));
    if (!t.directions || !t.powers) fail("no memory");
    fiv_environment_lights(t.directions, t.powers, t.lights, e);
    if (threads->parallel_for) threads->parallel_for(v->height, trace_rows, &t, threads->user);
    else trace_rows(0, v->height, 0, &t);
    free(t.directions);
    free(t.powers);
    reference_free(&scene);
}

/* Irradiance times colour over pi; the environment behind. */
static void shade(view *v, const object *objects, const image *sky, const float turn[9])
{
    static const float ground[3] = {0.55f, 0.53f, 0.5f};
    int x, y, k;
    for (y = 0; y < v->height; ++y)
        for (x = 0; x < v->width; ++x) {
            size_t i = (size_t)(y * v->width + x);
            const float *colour = v->what[i] >= 2 ? objects[v->what[i] - 2].colour : ground;
            if (v->what[i]) {
                for (k = 0; k < 3; ++k)
                    v->radiance[3 * i + (size_t)k] = v->light[3 * i + (size_t)k] * colour[k] * 0.318309886f;
            } else {
                float d[3], w[3], u;
                int px, py;
                pixel_ray(d, v, x, y);
                for (k = 0; k < 3; ++k) w[k] = turn[k] * d[0] + turn[3 + k] * d[1] + turn[6 + k] * d[2];
                u = atan2f(w[0], -w[2]) / 6.2831853f + 0.5f;
                px = sat__clamp_int((int)(u * (float)sky->width), 0, sky->width - 1);
                py = sat__clamp_int((int)(acosf(w[1] / sqrtf(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])) / 3.14159265f *
                                          (float)sky->height),
                                    0, sky->height - 1);
                memcpy(v->radiance + 3 * i, sky->pixels + 3 * ((size_t)py * (size_t)sky->width + (size_t)px),
                       3 * sizeof(float));
            }
        }
}

/* ---- the pictures ---- */

typedef struct program {
    object objects[OBJECTS];
    image sky;
    fiv_environment *light;
    fiv_irradiance_options options;
    view v;
    common_settings common;
} program;

/* One picture: light and meshes turned by so many degrees, lit by vectors or by rays. */
static unsigned char *picture(program *p, float light_turn, float mesh_turn, int rays)
{
    size_t pixels = (size_t)p->v.width * (size_t)p->v.height;
    unsigned char *rgb = (unsigned char *)malloc(3 * pixels);
    tonemap_options tone = tonemap_defaults();
    float turn[9];
    double start = common_clock();
    int i;
    if (!rgb) fail("no memory");
    turn_about(turn, 1, light_turn);
    check(fiv_environment_update(p->light, NULL, turn), "environment");
    draw_ground(&p->v);
    for (i = 0; i < OBJECTS; ++i) {
        object *o = &p->objects[i];
        turn_about(o->rotation, i ? 0 : 1, i ? 0.7f * mesh_turn : mesh_turn);
        check(fiv_occluder_light(o->occluder, p->light, o->rotation), "light");
        place(o, i ? 0.95f : -0.95f, i ? -0.35f : 0.25f);
        draw_object(&p->v, o, (unsigned char)(2 + i));
    }
    if (p->common.stats) printf("light and meshes turned: %.1f ms; ", 1e3 * (common_clock() - start));
    start = common_clock();
    if (rays) light_by_rays(&p->v, p->objects, p->light, &p->common.threads);
    else
        for (i = 1; i < 2 + OBJECTS; ++i) light_pixels(&p->v, p->objects, i, p->light, &p->options);
    if (p->common.stats) printf("%s: %.1f ms\n", rays ? "rays" : "shadows", 1e3 * (common_clock() - start));
    shade(&p->v, p->objects, &p->sky, turn);
    check(tonemap_once_u8(rgb, p->v.radiance, p->v.width, p->v.height, 3, &tone), "tone mapping");
    return rgb;
}

static void open_program(program *p, const char *environment, int night, const char *meshes[OBJECTS], const int size[2],
                         int theta)
{
    static const float colours[OBJECTS][3] = {{0.75f, 0.72f, 0.68f}, {0.8f, 0.30f, 0.3f}};
    size_t pixels = (size_t)size[0] * (size_t)size[1];
    fiv_occluder_options options = fiv_occluder_defaults();
    sat_image sky;
    float *memory;
    int i;
    if (environment && !image_load(&p->sky, environment)) fail(p->sky.message);
    if (!environment) make_sky(&p->sky, night);
    sky = image_view(&p->sky);
    check(fiv_environment_create(&p->light, &sky, NULL, NULL), "environment");
    options.theta = theta, options.phi = theta / 2 + 1, options.rho = theta >= 64 ? 30 : 15;
    options.threads = p->common.threads;
    for (i = 0; i < OBJECTS; ++i) {
        object *o = &p->objects[i];
        double start = common_clock();
        open_object(o, meshes[i], i);
        check(
            fiv_occluder_create(&o->occluder, o->positions, o->vertices, o->indices, o->triangles, &options, &o->stats),
            "occluder");
        if (p->common.stats)
            printf("%lu triangles: %lu masks in %.2f s, vectors %.2f MB, masks %.2f MB\n", (unsigned long)o->triangles,
                   (unsigned long)o->stats.rasterised, common_clock() - start, 1e-6 * (double)o->stats.table_bytes,
                   1e-6 * (double)o->stats.mask_bytes);
        memcpy(o->colour, colours[i], sizeof o->colour);
    }
    p->v.width = size[0], p->v.height = size[1];
    memory = (float *)calloc(13 * pixels, sizeof *memory);
    p->v.what = (unsigned char *)malloc(pixels);
    if (!memory || !p->v.what) fail("no memory");
    p->v.depth = memory, p->v.points = memory + pixels, p->v.normals = memory + 4 * pixels;
    p->v.radiance = memory + 7 * pixels, p->v.light = memory + 10 * pixels;
    look(&p->v);
}

static void close_program(program *p)
{
    int i;
    for (i = 0; i < OBJECTS; ++i) {
        fiv_occluder_destroy(p->objects[i].occluder);
        free(p->objects[i].positions);
        free(p->objects[i].normals);
        free(p->objects[i].indices);
    }
    fiv_environment_destroy(p->light);
    image_free(&p->sky);
    free(p->v.depth);
    free(p->v.what);
    common_close(&p->common);
}

int main(int argc, char **argv)
{
    program p;
    const char *environment = NULL, *meshes[OBJECTS] = {NULL, NULL};
    static const char *const labels[6] = {"light 0", "light 70", "light 140", "meshes 0", "meshes 70", "meshes 140"};
    common_cell cells[6];
    int size[2] = {400, 300}, theta = 32, masks = 0, compare = 0, night = 0, i, count, ok;
    unsigned char *difference;
    const common_option options[] = {
        {"env", 'P', (void *)&environment, 0, 0, "environment map; without one a sky of its own"},
        {"mesh", 'M', (void *)&meshes[0], 0, 0, "instead of a knot"},
        {"mesh2", 'M', (void *)&meshes[1], 0, 0, "instead of a ring"},
        {"night", 'b', &night, 0, 0, "a sky of its own with a moon and six street lamps"},
        {"size", 'z', size, 1, 4096, "of one picture"},
        {"theta", 'i', &theta, 4, 4096, "azimuths of the samples, even"},
        {"masks", 'b', &masks, 0, 0, "stored masks where the horizon or two occluders cut"},
        {"compare", 'b', &compare, 0, 0, "beside rays through every light (minutes when large)"},
    };
    memset(&p, 0, sizeof p);
    common_parse(&p.common, argc, argv, "fiv_shadows", ".png", options, (int)(sizeof options / sizeof options[0]));
    if (theta % 2) common_leave(&p.common, 2, "--theta", "must be even");
    open_program(&p, environment, night, meshes, size, theta);
    p.options = fiv_irradiance_defaults();
    p.options.threads = p.common.threads;
    if (masks) p.options.accuracy = FIV_MASK;
    count = compare ? 3 : 6;
    for (i = 0; i < count; ++i) {
        cells[i].width = size[0], cells[i].height = size[1];
        cells[i].label = compare ? (i == 0 ? "vectors" : i == 1 ? "rays" : "difference x 4") : labels[i];
        if (compare && i == 2) break;
        cells[i].rgb = picture(&p, !compare && i < 3 ? 70.0f * (float)i : 0.0f, i >= 3 ? 70.0f * (float)(i - 3) : 0.0f,
                               compare && i == 1);
    }
    if (compare) {
        difference = (unsigned char *)malloc(3 * (size_t)size[0] * (size_t)size[1]);
        if (!difference) fail("no memory");
        for (i = 0; i < 3 * size[0] * size[1]; ++i)
            difference[i] = (unsigned char)sat__clamp_int(128 + 4 * (cells[0].rgb[i] - cells[1].rgb[i]), 0, 255);
        cells[2].rgb = difference;
    }
    ok = common_contact_sheet(&p.common, p.common.out, cells, count, 3);
    for (i = 0; i < count; ++i) free((void *)(uintptr_t)cells[i].rgb);
    close_program(&p);
    return !ok;
}
