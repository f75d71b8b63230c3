/* scene.h - a square in the rain: sky, ground, two sculptures, and the rasteriser that draws them.
   SPDX-License-Identifier: MIT-0 OR Unlicense

   What a renderer has before any of the headers is asked: a picture of the light, triangles, and for each pixel the
   point that it shows, its normal, colour and depth. Lengths are metres, y is up, radiance is about cd/m2. */

#ifndef SCENE_H
#define SCENE_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "../raindrop.h"
#include "../sat.h"
#include "image.h"
#include "mesh.h"

enum { SCENE_SKY, SCENE_GROUND, SCENE_FIRST, SCENE_SECOND, SCENE_OBJECTS = 2 };
typedef enum scene_hour { SCENE_DUSK, SCENE_NIGHT, SCENE_NOON } scene_hour;

typedef struct scene_object {
    float *positions, *normals; /* own coordinates: the ball around the origin has radius 1 */
    unsigned *indices;
    size_t vertices, triangles;
    float place[3], scale, colour[3], shine; /* shine: what a glossy coat reflects head on */
} scene_object;

/* What each pixel shows. `layer` 1 is what the wet ground mirrors: points below it stand for those above. */
typedef struct scene_layer {
    unsigned char *what; /* SCENE_SKY ... */
    float *depth;        /* along the viewing axis; infinite where there is sky */
    float *points, *normals, *view_normals;
} scene_layer;

typedef struct scene {
    int width, height; /* of the layers */
    scene_object objects[SCENE_OBJECTS];
    scene_layer layers[2];
    raindrop_camera camera;
} scene;

/* ---- small mathematics ---- */

static inline float scene_dot(const float *a, const float *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static inline void scene_normalise(float *v)
{
    float length = sqrtf(scene_dot(v, v));
    int k;
    for (k = 0; k < 3; ++k) v[k] = length > 0 ? v[k] / length : k == 1;
}

static inline float scene_mix(float a, float b, float t) { return a + (b - a) * t; }

static inline float scene_step(float low, float high, float x)
{
    float t = (x - low) / (high - low);
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    return t * t * (3 - 2 * t);
}

/* 0..1, the same everywhere for the same lattice point */
static inline float scene_hash(int x, int y)
{
    uint32_t h = (uint32_t)x * 0x9e3779b1u ^ (uint32_t)y * 0x85ebca77u;
    h = (h ^ h >> 15) * 0x2c1b3c6du;
    h = (h ^ h >> 12) * 0x297a2d39u;
    return (float)((h ^ h >> 15) >> 8) / 16777216.0f;
}

static inline float scene_noise(float x, float y)
{
    float fx = floorf(x), fy = floorf(y), u = scene_step(0, 1, x - fx), v = scene_step(0, 1, y - fy);
    int i = (int)fx, j = (int)fy;
    return scene_mix(scene_mix(scene_hash(i, j), scene_hash(i + 1, j), u),
                     scene_mix(scene_hash(i, j + 1), scene_hash(i + 1, j + 1), u), v);
}

static inline float scene_fbm(float x, float y, int octaves)
{
    float sum = 0, weight = 0.5f;
    for (; octaves > 0; --octaves, weight *= 0.5f) {
        sum += weight * scene_noise(x, y);
        x = 2.03f * x + 17.1f;
        y = 2.03f * y - 9.7f;
    }
    return sum;
}

/* ---- the sky ---- */

typedef struct scene_sky {
    float zenith[3], horizon[3], glow[3], cloud[3], land[3]; /* glow: around the sun, or the moon */
    float sun_height, sun_turn, sharpness, sun;              /* degrees; of the glow; radiance of the disc */
} scene_sky;

static inline scene_sky scene_sky_of(scene_hour hour)
{
    static const scene_sky skies[] = {
        {{10, 15, 34}, {42, 33, 36}, {13000, 6300, 2100}, {0.7f, 0.48f, 0.52f}, {6, 5, 5}, 24, -68, 70, 60000},
        {{0.012f, 0.022f, 0.06f},
         {0.06f, 0.07f, 0.11f},
         {0.9f, 1.1f, 1.5f},
         {0.5f, 0.55f, 0.7f},
         {0.012f, 0.013f, 0.016f},
         33,
         -38,
         60,
         900},
        {{1100, 1900, 3900},
         {3300, 3700, 4300},
         {50000, 46000, 38000},
         {1.35f, 1.25f, 1.12f},
         {600, 620, 560},
         47,
         -58,
         40,
         3e6f},
    };
    return skies[hour];
}

static inline void scene_sun_direction(float d[3], const scene_sky *sky, float turn)
{
    float h = sky->sun_height * 0.0174533f, a = (sky->sun_turn + turn) * 0.0174533f;
    d[0] = cosf(h) * sinf(a);
    d[1] = sinf(h);
    d[2] = -cosf(h) * cosf(a);
}

/* Warm lamps around the square at night, for mesopic eyes to tell from the moon: azimuth, height and half width in
   degrees, red, green and blue. */
static inline void scene_lamps(float rgb[3], const float d[3])
{
    static const float lamps[][6] = {{-78, 15, 1.1f, 110, 54, 17},      {82, 17, 1.1f, 90, 42, 12},
                                     {164, 20, 1.6f, 90, 54, 21}, /* beside and behind the camera */
                                     {-27, 1.6f, 0.16f, 90, 40, 12},    {-23.5f, 2.1f, 0.2f, 120, 70, 26},
                                     {-21, 1.4f, 0.13f, 100, 36, 9},    {-14.6f, 1.7f, 0.18f, 90, 44, 13},
                                     {-8, 1.2f, 0.13f, 120, 76, 38},    {-5.8f, 1.5f, 0.15f, 90, 37, 10},
                                     {3.4f, 1.3f, 0.16f, 110, 48, 13},  {7.5f, 1.5f, 0.18f, 130, 85, 40},
                                     {13, 1.5f, 0.13f, 110, 20, 9},     {19.6f, 2.2f, 0.2f, 110, 48, 14},
                                     {22.8f, 1.6f, 0.15f, 100, 58, 24}, {28, 1.9f, 0.18f, 110, 45, 12}};
    size_t i;
    int k;
    for (i = 0; i < sizeof lamps / sizeof lamps[0]; ++i) {
        float h = lamps[i][1] * 0.0174533f, a = lamps[i][0] * 0.0174533f, l[3], angle;
        l[0] = cosf(h) * sinf(a), l[1] = sinf(h), l[2] = -cosf(h) * cosf(a);
        angle = acosf(fminf(scene_dot(l, d), 1)) * 57.3f / lamps[i][2];
        for (k = 0; k < 3; ++k) rgb[k] += lamps[i][3 + k] * (expf(-angle * angle) + 0.0012f * expf(-0.4f * angle));
    }
}

/* Radiance from the direction d, a unit vector; `turn` degrees turn the light around the square. */
static inline void scene_sky_radiance(float rgb[3], const scene_sky *sky, scene_hour hour, float turn, const float d[3])
{
    float sun[3], cosine, up = d[1] > 0 ? d[1] : 0, azimuth = atan2f(d[0], -d[2]);
    float hill = 0.015f + 0.06f * scene_fbm(azimuth * 3 + 40, 1.3f, 4) + 0.008f * scene_fbm(azimuth * 50 + 40, 5.5f, 3),
          angle, cloud, land;
    int k;
    scene_sun_direction(sun, sky, turn);
    cosine = fminf(scene_dot(sun, d), 1);
    angle = acosf(cosine) * 57.2958f;
    cloud = scene_fbm(d[0] / (up + 0.12f) * 1.1f + 3, d[2] / (up + 0.12f) * 1.1f, 6);
    cloud = scene_step(0.34f, 0.74f, cloud) * scene_step(0, 0.12f, up);
    for (k = 0; k < 3; ++k) {
        float clear = scene_mix(sky->horizon[k], sky->zenith[k], powf(up, 0.5f));
        float glow = sky->glow[k] * expf(-(1 - cosine) * sky->sharpness) +
                     0.006f * sky->glow[k] * expf((cosine - 1) * 1.5f - up * 5);
        rgb[k] = (clear + glow) * scene_mix(1, sky->cloud[k], cloud);
        rgb[k] += sky->sun * sky->glow[k] / sky->glow[0] * scene_step(0.62f, 0.4f, angle) * (1 - 0.7f * cloud);
        land = scene_mix(sky->land[k], rgb[k], 0.3f);
        rgb[k] = d[1] < 0 ? sky->land[k] : scene_mix(land, rgb[k], scene_step(hill - 0.0012f, hill + 0.0012f, d[1]));
    }
    if (hour == SCENE_NIGHT) scene_lamps(rgb, d);
}

/* The sky as an equirectangular picture of 2 height x height; rows that a worker fills depend on nothing else. */
typedef struct scene_sky_job { image *out; scene_hour hour; float turn; } scene_sky_job;
static inline void scene_sky_rows(int begin, int end, int worker, void *context)
{
    const scene_sky_job *job = (const scene_sky_job *)context;
    scene_sky sky = scene_sky_of(job->hour);
    int x, y, width = job->out->width, height = job->out->height;
    (void)worker;
    for (y = begin; y < end; ++y)
        for (x = 0; x < width; ++x) {
            float a = ((float)x + 0.5f) / (float)width * 6.2831853f - 3.1415927f,
                  b = ((float)y + 0.5f) / (float)height * 3.1415927f, d[3];
            d[0] = sinf(b) * sinf(a), d[1] = cosf(b), d[2] = -sinf(b) * cosf(a);
            scene_sky_radiance(job->out->pixels + ((size_t)y * (size_t)width + (size_t)x) * 3, &sky, job->hour,
                               job->turn, d);
        }
}

static inline void scene_for(const sat_threads *threads, int count, sat_range_fn *body, void *context)
{
    if (threads->parallel_for) threads->parallel_for(count, body, context, threads->user);
    else body(0, count, 0, context);
}

static inline void scene_draw_sky(image *out, scene_hour hour, float turn, const sat_threads *threads)
{
    scene_sky_job job;
    job.out = out, job.hour = hour, job.turn = turn;
    scene_for(threads, out->height, scene_sky_rows, &job);
}

/* ---- objects ---- */

/* Six times the volume: negative when the triangles turn clockwise seen from outside. */
static inline double scene_volume(const scene_object *o)
{
    double sum = 0;
    size_t i;
    for (i = 0; i < o->triangles; ++i) {
        const float *a = o->positions + 3 * (size_t)o->indices[3 * i],
                    *b = o->positions + 3 * (size_t)o->indices[3 * i + 1];
        const float *c = o->positions + 3 * (size_t)o->indices[3 * i + 2];
        sum += (double)(a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                        a[2] * (b[0] * c[1] - b[1] * c[0]));
    }
    return sum;
}

/* Moves and scales the vertices into the unit ball and gives each the mean normal of its triangles. */
static inline void scene_finish_object(scene_object *o)
{
    float low[3], high[3], centre[3], radius = 0;
    size_t i;
    int c, k;
    for (k = 0; k < 3; ++k) {
        low[k] = high[k] = o->positions[k];
        for (i = 1; i < o->vertices; ++i) {
            low[k] = fminf(low[k], o->positions[3 * i + (size_t)k]);
            high[k] = fmaxf(high[k], o->positions[3 * i + (size_t)k]);
        }
        centre[k] = 0.5f * (low[k] + high[k]);
    }
    for (i = 0; i < o->vertices; ++i) {
        for (k = 0; k < 3; ++k) o->positions[3 * i + (size_t)k] -= centre[k];
        radius = fmaxf(radius, scene_dot(o->positions + 3 * i, o->positions + 3 * i));
    }
    radius = radius > 0 ? sqrtf(radius) : 1;
    for (i = 0; i < 3 * o->vertices; ++i) o->positions[i] /= radius, o->normals[i] = 0;
    if (scene_volume(o) < 0) /* inside out */
        for (i = 0; i < o->triangles; ++i) {
            unsigned swap = o->indices[3 * i + 1];
            o->indices[3 * i + 1] = o->indices[3 * i + 2];
            o->indices[3 * i + 2] = swap;
        }
    for (i = 0; i < o->triangles; ++i) {
        const float *p[3];
        float u[3], v[3], n[3];
        for (c = 0; c < 3; ++c) p[c] = o->positions + 3 * (size_t)o->indices[3 * i + (size_t)c];
        for (k = 0; k < 3; ++k) u[k] = p[1][k] - p[0][k], v[k] = p[2][k] - p[0][k];
        n[0] = u[1] * v[2] - u[2] * v[1], n[1] = u[2] * v[0] - u[0] * v[2], n[2] = u[0] * v[1] - u[1] * v[0];
        for (c = 0; c < 3; ++c)
            for (k = 0; k < 3; ++k) o->normals[3 * (size_t)o->indices[3 * i + (size_t)c] + (size_t)k] += n[k];
    }
    for (i = 0; i < o->vertices; ++i) scene_normalise(o->normals + 3 * i);
}

static inline int scene_reserve(scene_object *o, size_t vertices, size_t triangles)
{
    o->positions = (float *)malloc(vertices * 3 * sizeof(float));
    o->normals = (float *)malloc(vertices * 3 * sizeof(float));
    o->indices = (unsigned *)malloc(triangles * 3 * sizeof(unsigned));
    o->vertices = vertices;
    o->triangles = triangles;
    return o->positions && o->normals && o->indices;
}

static inline void scene_quad(scene_object *o, size_t *n, unsigned a, unsigned b, unsigned c, unsigned d)
{
    unsigned *t = o->indices + 3 * *n;
    t[0] = a, t[1] = b, t[2] = c, t[3] = a, t[4] = c, t[5] = d;
    *n += 2;
}

/* A trefoil knot of `along` rings of `around` corners. */
static inline int scene_make_knot(scene_object *o, unsigned along, unsigned around)
{
    unsigned i, j;
    size_t n = 0;
    if (!scene_reserve(o, (size_t)along * around, 2 * (size_t)along * around)) return 0;
    for (i = 0; i < along; ++i) {
        float t = 6.2831853f * (float)i / (float)along, c[3], f[3], s[3], u[3] = {0, 0, 1};
        int k;
        c[0] = sinf(t) + 2 * sinf(2 * t), c[1] = cosf(t) - 2 * cosf(2 * t), c[2] = -1.1f * sinf(3 * t);
        f[0] = cosf(t) + 4 * cosf(2 * t), f[1] = -sinf(t) + 4 * sinf(2 * t), f[2] = -3.3f * cosf(3 * t);
        scene_normalise(f);
        s[0] = f[1] * u[2] - f[2] * u[1], s[1] = f[2] * u[0] - f[0] * u[2], s[2] = f[0] * u[1] - f[1] * u[0];
        scene_normalise(s);
        u[0] = s[1] * f[2] - s[2] * f[1], u[1] = s[2] * f[0] - s[0] * f[2], u[2] = s[0] * f[1] - s[1] * f[0];
        for (j = 0; j < around; ++j) {
            float a = 6.2831853f * (float)j / (float)around;
            for (k = 0; k < 3; ++k)
                o->positions[3 * (i * around + j) + (unsigned)k] = c[k] + 0.82f * (cosf(a) * s[k] + sinf(a) * u[k]);
        }
    }
    for (i = 0; i < along; ++i)
        for (j = 0; j < around; ++j)
            scene_quad(o, &n, i * around + j, i * around + (j + 1) % around,
                       (i + 1) % along * around + (j + 1) % around, (i + 1) % along * around + j);
    scene_finish_object(o);
    return 1;
}

/* A chess pawn: a profile of radii and heights, smoothed, turned about the axis. */
static inline int scene_make_pawn(scene_object *o, unsigned around, unsigned steps)
{
    static const float profile[][2] = {{0, 0},         {0.62f, 0},     {0.66f, 0.06f},  {0.66f, 0.16f}, {0.56f, 0.26f},
                                       {0.5f, 0.3f},   {0.36f, 0.46f}, {0.25f, 0.75f},  {0.22f, 1.05f}, {0.3f, 1.14f},
                                       {0.42f, 1.18f}, {0.42f, 1.24f}, {0.26f, 1.29f},  {0.32f, 1.4f},  {0.41f, 1.56f},
                                       {0.41f, 1.72f}, {0.3f, 1.9f},   {0.16f, 1.985f}, {0, 2}};
    unsigned spans = sizeof profile / sizeof profile[0] - 1, rings = spans * steps - 1, i, j;
    size_t n = 0, top, bottom;
    if (!scene_reserve(o, (size_t)rings * around + 2, 2 * (size_t)rings * around)) return 0;
    for (i = 0; i < rings; ++i) {
        unsigned span = (i + 1) / steps;
        float t = (float)((i + 1) % steps) / (float)steps, p[2];
        int k;
        for (k = 0; k < 2; ++k) { /* Catmull-Rom */
            float a = profile[span > 0 ? span - 1 : 0][k], b = profile[span][k],
                  c = profile[span < spans ? span + 1 : spans][k];
            float d = profile[span + 2 < spans ? span + 2 : spans][k];
            p[k] = b + 0.5f * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a)));
        }
        for (j = 0; j < around; ++j) {
            float a = 6.2831853f * (float)j / (float)around, *v = o->positions + 3 * (i * around + j);
            v[0] = p[0] * cosf(a), v[1] = fmaxf(p[1], 0), v[2] = p[0] * sinf(a);
        }
    }
    bottom = (size_t)rings * around, top = bottom + 1;
    memset(o->positions + 3 * bottom, 0, 6 * sizeof(float));
    o->positions[3 * top + 1] = 2;
    for (i = 0; i + 1 < rings; ++i)
        for (j = 0; j < around; ++j)
            scene_quad(o, &n, i * around + j, (i + 1) * around + j, (i + 1) * around + (j + 1) % around,
                       i * around + (j + 1) % around);
    for (j = 0; j < around; ++j) {
        unsigned *t = o->indices + 3 * n, next = (j + 1) % around;
        t[0] = (unsigned)bottom, t[1] = j, t[2] = next;
        t[3] = (unsigned)top, t[4] = (rings - 1) * around + next, t[5] = (rings - 1) * around + j;
        n += 2;
    }
    scene_finish_object(o);
    return 1;
}

static inline int scene_use_mesh(scene_object *o, const mesh *m)
{
    size_t i;
    if (!scene_reserve(o, (size_t)m->vertex_count, (size_t)m->triangle_count)) return 0;
    memcpy(o->positions, m->positions, 3 * o->vertices * sizeof(float));
    for (i = 0; i < 3 * o->triangles; ++i) o->indices[i] = (unsigned)m->indices[i];
    scene_finish_object(o);
    return 1;
}

/* Puts an object on the ground. */
static inline void scene_place(scene_object *o, float x, float z, float scale, float r, float g, float b, float shine)
{
    float low = 0;
    size_t i;
    for (i = 0; i < o->vertices; ++i) low = fminf(low, o->positions[3 * i + 1]);
    o->place[0] = x, o->place[1] = -low * scale, o->place[2] = z;
    o->scale = scale;
    o->colour[0] = r, o->colour[1] = g, o->colour[2] = b;
    o->shine = shine;
}

/* ---- the ground: paving stones ---- */

/* How deep a point lies in a joint, 0..1, and which stone it is. */
static inline float scene_joint(float x, float z, int stone[2])
{
    float side = 0.16f, v = z / side, u, eu, ev;
    stone[1] = (int)floorf(v);
    u = x / side + 0.5f * (float)(stone[1] & 1);
    stone[0] = (int)floorf(u);
    eu = 0.5f - fabsf(u - floorf(u) - 0.5f) + 0.012f * (scene_noise(u * 9, v * 9) - 0.5f);
    ev = 0.5f - fabsf(v - floorf(v) - 0.5f) + 0.012f * (scene_noise(u * 9 + 31, v * 9) - 0.5f);
    return 1 - scene_step(0.015f, 0.055f, fminf(eu, ev));
}

/* Wetness 0..1: puddles lie where the stones lie low. */
static inline float scene_wetness(float x, float z)
{
    return scene_step(0.40f, 0.56f, scene_fbm(x * 1.7f + 7.3f, z * 1.7f + 2.9f, 4));
}

/* Colour and normal of the ground; `size` is that of a pixel there, beyond which detail is left to the mean. */
static inline void scene_ground(float colour[3], float normal[3], float x, float z, float size)
{
    int stone[2], other[2];
    float fade = 1 - scene_step(0.02f, 0.12f, size), joint = scene_joint(x, z, stone), wet = scene_wetness(x, z),
          e = 0.004f;
    float tint = 0.72f + 0.5f * scene_hash(stone[0], stone[1]), grain = 0.82f + 0.36f * scene_fbm(x * 60, z * 60, 3);
    float shade = scene_mix(0.24f, 0.26f * tint * grain * (1 - 0.6f * joint), fade) * scene_mix(1, 0.55f, wet);
    float bump = fade * (1 - wet) * 0.5f;
    colour[0] = shade * (1 + 0.10f * (scene_hash(stone[1], stone[0]) - 0.4f) * fade), colour[1] = shade * 0.96f,
    colour[2] = shade * 0.9f;
    normal[0] = bump * (scene_joint(x + e, z, other) - joint +
                        0.3f * (scene_fbm(x * 60 + 0.3f, z * 60, 3) - scene_fbm(x * 60, z * 60, 3)));
    normal[2] = bump * (scene_joint(x, z + e, other) - joint +
                        0.3f * (scene_fbm(x * 60, z * 60 + 0.3f, 3) - scene_fbm(x * 60, z * 60, 3)));
    normal[1] = 1;
    scene_normalise(normal);
}

/* ---- rasteriser ---- */

static inline int scene_create(scene *s, int width, int height)
{
    size_t pixels = (size_t)width * (size_t)height;
    int i, ok = 1;
    s->width = width;
    s->height = height;
    for (i = 0; i < 2; ++i) {
        scene_layer *l = &s->layers[i];
        l->what = (unsigned char *)malloc(pixels);
        l->depth = (float *)malloc(pixels * sizeof(float));
        l->points = (float *)malloc(3 * pixels * sizeof(float));
        l->normals = (float *)malloc(3 * pixels * sizeof(float));
        l->view_normals = i == 0 ? (float *)malloc(3 * pixels * sizeof(float)) : NULL;
        ok = ok && l->what && l->depth && l->points && l->normals && (i || l->view_normals);
    }
    return ok;
}

static inline void scene_free(scene *s)
{
    int i;
    for (i = 0; i < 2; ++i) {
        free(s->layers[i].what), free(s->layers[i].depth), free(s->layers[i].points);
        free(s->layers[i].normals), free(s->layers[i].view_normals);
        free(s->objects[i].positions), free(s->objects[i].normals), free(s->objects[i].indices);
    }
    memset(s, 0, sizeof *s);
}

/* The viewing ray of a pixel's centre, scaled to depth 1. */
static inline void scene_ray(const scene *s, int x, int y, float ray[3])
{
    const raindrop_camera *c = &s->camera;
    float t = tanf(0.5f * c->fov_y), u = (2 * ((float)x + 0.5f) - (float)s->width) / (float)s->height * t,
          v = (1 - 2 * ((float)y + 0.5f) / (float)s->height) * t;
    int k;
    for (k = 0; k < 3; ++k) ray[k] = u * c->right[k] + v * c->up[k] - c->back[k];
}

/* Ground and sky of a band of rows. */
static inline void scene_draw_ground(scene *s, int top, int bottom)
{
    int x, y, k;
    for (y = top; y < bottom; ++y)
        for (x = 0; x < s->width; ++x) {
            size_t i = (size_t)y * (size_t)s->width + (size_t)x;
            scene_layer *l = s->layers;
            float ray[3], t, colour[3];
            scene_ray(s, x, y, ray);
            t = ray[1] < 0 ? -s->camera.position[1] / ray[1] : INFINITY;
            if (t > 1e4f) t = INFINITY;
            s->layers[1].what[i] = SCENE_SKY;
            s->layers[1].depth[i] = INFINITY;
            l->depth[i] = t;
            l->what[i] = t < INFINITY ? SCENE_GROUND : SCENE_SKY;
            for (k = 0; k < 3; ++k)
                l->points[3 * i + (size_t)k] = t < INFINITY ? s->camera.position[k] + t * ray[k] : 0;
            if (t < INFINITY) {
                l->points[3 * i + 1] = 0;
                scene_ground(colour, l->normals + 3 * i, l->points[3 * i], l->points[3 * i + 2],
                             t * t / (float)s->height);
            }
        }
}

/* A vertex on the screen: column, row, 1 / depth. */
static inline void scene_project(const scene *s, const float p[3], float out[3])
{
    const raindrop_camera *c = &s->camera;
    float d[3], t = tanf(0.5f * c->fov_y), z;
    int k;
    for (k = 0; k < 3; ++k) d[k] = p[k] - c->position[k];
    z = -scene_dot(d, c->back);
    out[2] = z > 0.01f ? 1 / z : 0;
    out[0] = 0.5f * ((float)s->width + (float)s->height * scene_dot(d, c->right) * out[2] / t);
    out[1] = 0.5f * (float)s->height * (1 - scene_dot(d, c->up) * out[2] / t);
}

/* One triangle into the rows [top, bottom) of a layer; the mirrored one only where the ground is seen. */
static inline void scene_draw_triangle(scene *s, int layer, int object, const unsigned *corner, int top, int bottom)
{
    const scene_object *o = &s->objects[object];
    scene_layer *l = &s->layers[layer];
    float world[3][3], v[3][3], area, flip = layer ? -1.0f : 1.0f;
    int c, k, x, y, x0, x1, y0, y1;
    for (c = 0; c < 3; ++c) {
        for (k = 0; k < 3; ++k) world[c][k] = o->place[k] + o->scale * o->positions[3 * corner[c] + (unsigned)k];
        world[c][1] *= flip;
        scene_project(s, world[c], v[c]);
        if (v[c][2] <= 0) return;
    }
    area = (v[1][0] - v[0][0]) * (v[2][1] - v[0][1]) - (v[2][0] - v[0][0]) * (v[1][1] - v[0][1]);
    if (!(fabsf(area) > 1e-12f)) return;
    x0 = (int)fmaxf(floorf(fminf(v[0][0], fminf(v[1][0], v[2][0]))), 0),
    x1 = (int)fminf(fmaxf(v[0][0], fmaxf(v[1][0], v[2][0])) + 1, (float)s->width);
    y0 = (int)fmaxf(floorf(fminf(v[0][1], fminf(v[1][1], v[2][1]))), (float)top),
    y1 = (int)fminf(fmaxf(v[0][1], fmaxf(v[1][1], v[2][1])) + 1, (float)bottom);
    for (y = y0; y < y1; ++y)
        for (x = x0; x < x1; ++x) {
            size_t i = (size_t)y * (size_t)s->width + (size_t)x;
            float w[3], px = (float)x + 0.5f, py = (float)y + 0.5f, depth;
            for (c = 0; c < 3; ++c) {
                const float *a = v[(c + 1) % 3], *b = v[(c + 2) % 3];
                w[c] = ((b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0])) / area;
            }
            if (w[0] < 0 || w[1] < 0 || w[2] < 0) continue;
            depth = 1 / (w[0] * v[0][2] + w[1] * v[1][2] + w[2] * v[2][2]);
            if (depth >= l->depth[i] || (layer && s->layers[0].what[i] != SCENE_GROUND)) continue;
            l->depth[i] = depth;
            l->what[i] = (unsigned char)(SCENE_FIRST + object);
            for (c = 0; c < 3; ++c) w[c] *= v[c][2] * depth;
            for (k = 0; k < 3; ++k) {
                l->points[3 * i + (size_t)k] = w[0] * world[0][k] + w[1] * world[1][k] + w[2] * world[2][k];
                l->normals[3 * i + (size_t)k] = w[0] * o->normals[3 * corner[0] + (unsigned)k] +
                                                w[1] * o->normals[3 * corner[1] + (unsigned)k] +
                                                w[2] * o->normals[3 * corner[2] + (unsigned)k];
            }
            l->points[3 * i + 1] *= flip; /* the true point above the ground */
        }
}

static inline void scene_rows(int begin, int end, int worker, void *context)
{
    enum { BAND = 16 };
    scene *s = (scene *)context;
    size_t i, t;
    int layer, object, top = begin * BAND, bottom = end * BAND < s->height ? end * BAND : s->height, k;
    (void)worker;
    scene_draw_ground(s, top, bottom);
    for (layer = 0; layer < 2; ++layer)
        for (object = 0; object < SCENE_OBJECTS; ++object)
            for (t = 0; t < s->objects[object].triangles; ++t)
                scene_draw_triangle(s, layer, object, s->objects[object].indices + 3 * t, top, bottom);
    for (i = (size_t)top * (size_t)s->width; i < (size_t)bottom * (size_t)s->width; ++i) {
        const raindrop_camera *c = &s->camera;
        float *n = s->layers[0].normals + 3 * i, *out = s->layers[0].view_normals + 3 * i;
        if (s->layers[0].what[i] == SCENE_SKY) n[0] = n[2] = 0, n[1] = 1;
        scene_normalise(n);
        if (s->layers[1].what[i] != SCENE_SKY) scene_normalise(s->layers[1].normals + 3 * i);
        for (k = 0; k < 3; ++k) out[k] = scene_dot(n, k == 0 ? c->right : k == 1 ? c->up : c->back);
        if (s->layers[0].what[i] == SCENE_GROUND) /* occlusion is of the stones' shape, not of their bumps */
            for (k = 0; k < 3; ++k) out[k] = k == 0 ? c->right[1] : k == 1 ? c->up[1] : c->back[1];
    }
}

/* Fills both layers: what is seen, and what the ground mirrors. Bands of 16 rows share nothing. */
static inline void scene_draw(scene *s, const sat_threads *threads)
{
    scene_for(threads, (s->height + 15) / 16, scene_rows, s);
}

#endif /* SCENE_H */
