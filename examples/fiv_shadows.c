/* fiv_shadows - meshes above a plane under an environment map, with soft shadows on the plane, on each other and on
   themselves.                                                         SPDX-License-Identifier: MIT-0 OR Unlicense

       fiv_shadows                                                the light turns, then the meshes: out/fiv_shadows.png
       fiv_shadows sky.exr bunny.ply dragon.ply --out out.png
       fiv_shadows --compare --size 160x120 --out out.png         beside rays through every light, and the difference

   Without files: a sky with a low sun, and two knots. */

#define _POSIX_C_SOURCE 200809L
#define LIGHTSCAN_IMPLEMENTATION
#include "../fiv.h"
#include "../tonemap.h"
#include "common.h"
#include "mesh.h"
#include "../tests/reference_fiv.h" /* rays and knots */

enum { OBJECTS = 2 };

typedef struct object {
    float *positions, *normals;
    unsigned *indices;
    size_t vertices, triangles;
    fiv_occluder *occluder;
    fiv_occluder_stats stats;
    fiv_instance instance;
    float rotation[9];
    float colour[3];
} object;

/* What the pixels show: 0 sky, 1 ground, 2 + i object i. */
typedef struct view {
    int width, height;
    unsigned char *what;
    float *depth, *points, *normals, *radiance, *light;
    float eye[3], axes[3][3]; /* right, up, forward */
} view;

static int fail(const char *text)
{
    fprintf(stderr, "fiv_shadows: %s\n", text);
    exit(1);
}

static void check(sat_result result, const char *what)
{
    if (result) fprintf(stderr, "%s: ", what), fail(sat_result_text(result));
}

/* ---- inputs ---- */

static void make_sky(image *out)
{
    int x, y, c;
    if (!image_create(out, 512, 256, 3)) fail("no memory");
    for (y = 0; y < 256; ++y)
        for (x = 0; x < 512; ++x) {
            float up = cosf(3.14159265f * ((float)y + 0.5f) / 256), turn = 6.2831853f * ((float)x + 0.5f) / 512;
            float *p = out->pixels + 3 * (y * 512 + x), glow = expf(-4 * (1 - cosf(turn - 4)) - 8 * fabsf(up - 0.35f));
            static const float zenith[3] = {0.25f, 0.30f, 1.0f}, horizon[3] = {0.9f, 0.8f, 0.75f},
                               ground[3] = {0.15f, 0.13f, 0.1f};
            for (c = 0; c < 3; ++c) {
                p[c] = up > 0 ? horizon[c] + (zenith[c] - horizon[c]) * sqrtf(up) + glow * (5 - (float)c) : ground[c];
                if (abs(x - 326) < 3 && abs(y - 72) < 3) p[c] = 1200 - 200 * (float)c;
            }
        }
}

/* Vertex normals: the mean of the triangles, weighted by area. */
static void make_normals(object *o)
{
    size_t t, v;
    int j, k;
    o->normals = (float *)calloc(3 * o->vertices, sizeof *o->normals);
    if (!o->normals) fail("no memory");
    for (t = 0; t < o->triangles; ++t) {
        const unsigned *i = o->indices + 3 * t;
        float a[3], b[3];
        for (k = 0; k < 3; ++k) {
            a[k] = o->positions[3 * i[1] + (unsigned)k] - o->positions[3 * i[0] + (unsigned)k];
            b[k] = o->positions[3 * i[2] + (unsigned)k] - o->positions[3 * i[0] + (unsigned)k];
        }
        for (j = 0; j < 3; ++j)
            for (k = 0; k < 3; ++k)
                o->normals[3 * i[j] + (unsigned)k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    }
    for (v = 0; v < o->vertices; ++v) {
        float *n = o->normals + 3 * v, length = sqrtf(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
        for (k = 0; k < 3 && length > 0; ++k) n[k] /= length;
    }
}

/* Counter-clockwise seen from outside: the volume is positive. */
static void turn_outwards(object *o)
{
    double volume = 0;
    size_t t;
    int k;
    for (t = 0; t < o->triangles; ++t) {
        const float *a = o->positions + 3 * o->indices[3 * t], *b = o->positions + 3 * o->indices[3 * t + 1],
                    *c = o->positions + 3 * o->indices[3 * t + 2];
        for (k = 0; k < 3; ++k)
            volume += (double)a[k] * ((double)b[(k + 1) % 3] * (double)c[(k + 2) % 3] -
                                      (double)b[(k + 2) % 3] * (double)c[(k + 1) % 3]);
    }
    for (t = 0; t < o->triangles && volume < 0; ++t) {
        unsigned swap = o->indices[3 * t + 1];
        o->indices[3 * t + 1] = o->indices[3 * t + 2];
        o->indices[3 * t + 2] = swap;
    }
}

static void open_object(object *o, const char *path, int second)
{
    if (path) {
        mesh m;
        int i;
        if (!mesh_load(&m, path)) fail(m.message);
        o->positions = m.positions;
        o->vertices = (size_t)m.vertex_count;
        o->triangles = (size_t)m.triangle_count;
        o->indices = (unsigned *)malloc(3 * o->triangles * sizeof *o->indices);
        if (!o->indices) fail("no memory");
        for (i = 0; i < 3 * m.triangle_count; ++i) o->indices[i] = (unsigned)m.indices[i];
        free(m.indices);
    } else {
        reference_mesh m = second ? reference_knot(1, 0, 64, 24, 0.35) : reference_knot(2, 3, 160, 16, 0.22);
        o->positions = m.positions, o->indices = m.indices;
        o->vertices = m.vertices, o->triangles = m.triangles;
    }
    turn_outwards(o);
    make_normals(o);
}

static void turn_about(float m[9], int axis, float degrees)
{
    float a = degrees * 3.14159265f / 180, c = cosf(a), s = sinf(a);
    int i = (axis + 1) % 3, j = (axis + 2) % 3;
    memset(m, 0, 9 * sizeof *m);
    m[4 * axis] = 1, m[4 * i] = m[4 * j] = c;
    m[3 * i + j] = -s, m[3 * j + i] = s;
}

/* Stands the object, of radius 1, on the ground at x, z. */
static void place(object *o, float x, float z)
{
    float low = 1e30f;
    size_t v;
    int k;
    for (v = 0; v < o->vertices; ++v) {
        float y = 0;
        for (k = 0; k < 3; ++k) y += o->rotation[3 + k] * o->positions[3 * v + (size_t)k];
        low = y < low ? y : low;
    }
    o->instance.occluder = o->occluder;
    o->instance.scale = 1 / o->stats.radius;
    for (k = 0; k < 3; ++k) {
        float centre = 0;
        int j;
        for (j = 0; j < 3; ++j) centre += o->rotation[3 * k + j] * o->stats.centre[j];
        o->instance.position[k] = -centre * o->instance.scale;
    }
    o->instance.position[0] += x;
    o->instance.position[1] = -low * o->instance.scale;
    o->instance.position[2] += z;
}

/* ---- what each pixel shows ---- */

static void look(view *v)
{
    static const float eye[3] = {0.6f, 2.6f, 5.4f}, target[3] = {0, 0.6f, 0};
    float length = 0;
    int k;
    memcpy(v->eye, eye, sizeof eye);
    for (k = 0; k < 3; ++k) v->axes[2][k] = target[k] - eye[k], length += v->axes[2][k] * v->axes[2][k];
    for (k = 0; k < 3; ++k) v->axes[2][k] /= sqrtf(length);
    v->axes[0][0] = -v->axes[2][2], v->axes[0][1] = 0, v->axes[0][2] = v->axes[2][0];
    length = sqrtf(v->axes[0][0] * v->axes[0][0] + v->axes[0][2] * v->axes[0][2]);
    for (k = 0; k < 3; ++k) v->axes[0][k] /= length;
    for (k = 0; k < 3; ++k)
        v->axes[1][k] =
            v->axes[0][(k + 1) % 3] * v->axes[2][(k + 2) % 3] - v->axes[0][(k + 2) % 3] * v->axes[2][(k + 1) % 3];
}

static void pixel_ray(float d[3], const view *v, int x, int y)
{
    float s = 2 * 0.30f / (float)v->height, a = ((float)x + 0.5f - 0.5f * (float)v->width) * s,
          b = (0.5f * (float)v->height - (float)y - 0.5f) * s;
    int k;
    for (k = 0; k < 3; ++k) d[k] = v->axes[2][k] + a * v->axes[0][k] + b * v->axes[1][k];
}

static void draw_ground(view *v)
{
    int x, y, k;
    for (y = 0; y < v->height; ++y)
        for (x = 0; x < v->width; ++x) {
            size_t i = (size_t)(y * v->width + x);
            float d[3], t;
            pixel_ray(d, v, x, y);
            t = -v->eye[1] / d[1];
            v->what[i] = d[1] < 0 && t < 25;
            v->depth[i] = v->what[i] ? t : 1e30f;
            for (k = 0; k < 3; ++k) {
                v->points[3 * i + (size_t)k] = k == 1 ? 0 : v->eye[k] + t * d[k];
                v->normals[3 * i + (size_t)k] = k == 1;
            }
        }
}

static void draw_triangle(view *v, float p[3][3], float n[3][3], unsigned char what)
{
    float q[3][3], area, low[2] = {1e30f, 1e30f}, high[2] = {-1e30f, -1e30f};
    int j, k, x, y;
    for (j = 0; j < 3; ++j) {
        float d[3], c[3], s = (float)v->height / (2 * 0.30f);
        for (k = 0; k < 3; ++k) d[k] = p[j][k] - v->eye[k];
        for (k = 0; k < 3; ++k) c[k] = d[0] * v->axes[k][0] + d[1] * v->axes[k][1] + d[2] * v->axes[k][2];
        if (c[2] < 0.1f) return;
        q[j][0] = c[0] / c[2] * s + 0.5f * (float)v->width, q[j][1] = 0.5f * (float)v->height - c[1] / c[2] * s,
        q[j][2] = 1 / c[2];
        for (k = 0; k < 2; ++k)
            low[k] = q[j][k] < low[k] ? q[j][k] : low[k], high[k] = q[j][k] > high[k] ? q[j][k] : high[k];
    }
    area = (q[1][0] - q[0][0]) * (q[2][1] - q[0][1]) - (q[2][0] - q[0][0]) * (q[1][1] - q[0][1]);
    if (area == 0) return;
    for (y = (int)(low[1] < 0 ? 0 : low[1]); y < v->height && (float)y <= high[1]; ++y)
        for (x = (int)(low[0] < 0 ? 0 : low[0]); x < v->width && (float)x <= high[0]; ++x) {
            float w[3], px = (float)x + 0.5f, py = (float)y + 0.5f, depth;
            size_t i = (size_t)(y * v->width + x);
            w[1] = ((px - q[0][0]) * (q[2][1] - q[0][1]) - (q[2][0] - q[0][0]) * (py - q[0][1])) / area;
            w[2] = ((q[1][0] - q[0][0]) * (py - q[0][1]) - (px - q[0][0]) * (q[1][1] - q[0][1])) / area;
            w[0] = 1 - w[1] - w[2];
            if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
            depth = 1 / (w[0] * q[0][2] + w[1] * q[1][2] + w[2] * q[2][2]);
            if (depth >= v->depth[i]) continue;
            v->depth[i] = depth;
            v->what[i] = what;
            for (k = 0; k < 3; ++k) {
                v->points[3 * i + (size_t)k] = v->normals[3 * i + (size_t)k] = 0;
                for (j = 0; j < 3; ++j) {
                    v->points[3 * i + (size_t)k] += w[j] * q[j][2] * depth * p[j][k];
                    v->normals[3 * i + (size_t)k] += w[j] * q[j][2] * depth * n[j][k];
                }
            }
        }
}

static void draw_object(view *v, const object *o, unsigned char what)
{
    size_t t;
    int j, k, m;
    for (t = 0; t < o->triangles; ++t) {
        float p[3][3], n[3][3];
        for (j = 0; j < 3; ++j)
            for (k = 0; k < 3; ++k) {
                size_t vertex = 3 * (size_t)o->indices[3 * t + (size_t)j];
                p[j][k] = o->instance.position[k], n[j][k] = 0;
                for (m = 0; m < 3; ++m) {
                    p[j][k] += o->instance.scale * o->rotation[3 * k + m] * o->positions[vertex + (size_t)m];
                    n[j][k] += o->rotation[3 * k + m] * o->normals[vertex + (size_t)m];
                }
            }
        draw_triangle(v, p, n, what);
    }
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

static void open_program(program *p, const char *environment, const char *meshes[OBJECTS], const int size[2], int theta)
{
    static const float colours[OBJECTS][3] = {{0.75f, 0.72f, 0.68f}, {0.8f, 0.30f, 0.3f}};
    size_t pixels = (size_t)size[0] * (size_t)size[1];
    fiv_occluder_options options = fiv_occluder_defaults();
    sat_image sky;
    float *memory;
    int i;
    if (environment && !image_load(&p->sky, environment)) fail(p->sky.message);
    if (!environment) make_sky(&p->sky);
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
    int size[2] = {400, 300}, theta = 32, masks = 0, compare = 0, i, count, ok;
    unsigned char *difference;
    const common_option options[] = {
        {"env", 'P', (void *)&environment, 0, 0, "environment map; without one a sky of its own"},
        {"mesh", 'M', (void *)&meshes[0], 0, 0, "instead of a knot"},
        {"mesh2", 'M', (void *)&meshes[1], 0, 0, "instead of a ring"},
        {"size", 'z', size, 1, 4096, "of one picture"},
        {"theta", 'i', &theta, 4, 4096, "azimuths of the samples, even"},
        {"masks", 'b', &masks, 0, 0, "stored masks where the horizon or two occluders cut"},
        {"compare", 'b', &compare, 0, 0, "beside rays through every light (minutes when large)"},
    };
    memset(&p, 0, sizeof p);
    common_parse(&p.common, argc, argv, "fiv_shadows", ".png", options, (int)(sizeof options / sizeof options[0]));
    if (theta % 2) common_leave(&p.common, 2, "--theta", "must be even");
    open_program(&p, environment, meshes, size, theta);
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
