/* reference.h - what the demo's stages stand in for, computed the slow way at a few places.
   SPDX-License-Identifier: MIT-0 OR Unlicense */

#ifndef REFERENCE_H
#define REFERENCE_H

#include "pipeline.h"

/* 1 when the ray from p along d (unit) meets a triangle of the object. */
static inline int reference_hits(const scene_object *o, const float p[3], const float d[3])
{
    float q[3], along, off;
    size_t t;
    int k;
    for (k = 0; k < 3; ++k) q[k] = (p[k] - o->place[k]) / o->scale;
    along = -scene_dot(q, d);
    off = scene_dot(q, q) - along * along;
    if (off > 1 || (along < 0 && scene_dot(q, q) > 1)) return 0; /* past the ball of radius 1 */
    for (t = 0; t < o->triangles; ++t) {
        const float *a = o->positions + 3 * (size_t)o->indices[3 * t],
                    *b = o->positions + 3 * (size_t)o->indices[3 * t + 1];
        const float *c = o->positions + 3 * (size_t)o->indices[3 * t + 2];
        float e[3], f[3], s[3], h[3], g[3], det, u, v;
        for (k = 0; k < 3; ++k) e[k] = b[k] - a[k], f[k] = c[k] - a[k], s[k] = q[k] - a[k];
        h[0] = d[1] * f[2] - d[2] * f[1], h[1] = d[2] * f[0] - d[0] * f[2], h[2] = d[0] * f[1] - d[1] * f[0];
        det = scene_dot(e, h);
        if (det == 0) continue;
        u = scene_dot(s, h) / det;
        g[0] = s[1] * e[2] - s[2] * e[1], g[1] = s[2] * e[0] - s[0] * e[2], g[2] = s[0] * e[1] - s[1] * e[0];
        v = scene_dot(d, g) / det;
        if (u >= 0 && v >= 0 && u + v <= 1 && scene_dot(f, g) / det > 1e-4f) return 1;
    }
    return 0;
}

/* Shadows against rays to every light, at `count` places of the ground around the objects: root mean square of the
   difference, as a part of the unshadowed irradiance. Negative when there is no memory. */
static inline double reference_shadow_error(const pipeline *p, int count)
{
    size_t capacity = 6 * 64 * 64 + FIV_MAX_LIGHTS, lights, i;
    float *directions = (float *)malloc(3 * capacity * sizeof(float)),
          *powers = (float *)malloc(3 * capacity * sizeof(float));
    size_t pixels = (size_t)p->scene.width * (size_t)p->scene.height, at = 0;
    double sum = -1;
    int n = 0, o;
    if (directions && powers) {
        lights = fiv_environment_lights(directions, powers, capacity, p->light);
        for (sum = 0; n < count && at < 40000; ++at) {
            size_t pixel = (size_t)(scene_hash((int)at, 77) * (float)pixels) % pixels;
            const float *point = p->scene.layers[0].points + 3 * pixel,
                        *normal = p->scene.layers[0].normals + 3 * pixel;
            double exact = 0, open = 0, found = (double)p->irradiance[0][3 * pixel + 1];
            if (p->scene.layers[0].what[pixel] != SCENE_GROUND || p->scene.layers[0].depth[pixel] > 2) continue;
            for (i = 0; i < lights; ++i) {
                float cosine = scene_dot(normal, directions + 3 * i);
                int free_ray = 1;
                if (cosine <= 0) continue;
                for (o = 0; o < SCENE_OBJECTS && free_ray; ++o)
                    free_ray = !reference_hits(&p->scene.objects[o], point, directions + 3 * i);
                open += (double)(cosine * powers[3 * i + 1]);
                if (free_ray) exact += (double)(cosine * powers[3 * i + 1]);
            }
            sum += (found - exact) * (found - exact) / (open * open);
            ++n;
        }
    }
    free(directions);
    free(powers);
    return sum < 0 || n == 0 ? -1 : sqrt(sum / n);
}

/* Occlusion from every second pixel against that from all pixels: root mean square of the difference. */
static inline double reference_occlusion_error(const pipeline *p)
{
    size_t pixels = (size_t)p->scene.width * (size_t)p->scene.height, i;
    ssao_sat_options so = ssao_sat_defaults();
    ssao_sat_input input =
        ssao_sat_input_linear(p->scene.layers[0].depth, p->scene.width, p->scene.height, (double)p->scene.camera.fov_y);
    float *open = (float *)malloc(pixels * sizeof(float));
    double sum = -1;
    ssao_sat *ao = NULL;
    so.radius = (double)p->options.ao_radius;
    so.half_resolution = 0;
    so.threads = p->options.threads;
    input.normals = p->scene.layers[0].view_normals;
    input.sky = PIPELINE_SKY_DISTANCE;
    if (open && ssao_sat_create(&ao, p->scene.width, p->scene.height, &so) == SAT_OK &&
        ssao_sat_apply(ao, open, 0, &input, NULL) == SAT_OK)
        for (i = 0, sum = 0; i < pixels; ++i) sum += (double)((open[i] - p->open[i]) * (open[i] - p->open[i]));
    ssao_sat_destroy(ao);
    free(open);
    return sum < 0 ? -1 : sqrt(sum / (double)pixels);
}

/* Far drops as one lookup each against a ray for every pixel of every drop, over black: root mean square of the
   difference, as a part of the mean of the picture. */
static inline double reference_rain_error(const pipeline *p)
{
    size_t values = 3 * (size_t)p->hdr.width * (size_t)p->hdr.height, i;
    float *fast = (float *)calloc(values, sizeof(float)), *slow = (float *)calloc(values, sizeof(float));
    raindrop_camera camera = pipeline_rain_camera(p);
    raindrop_render_options ro = raindrop_render_defaults();
    ptrdiff_t stride = (ptrdiff_t)p->hdr.width * 3 * (ptrdiff_t)sizeof(float);
    double sum = 0, mean = 0;
    int ok = fast && slow &&
             raindrop_render(fast, stride, p->hdr.width, p->hdr.height, p->depth, &camera, p->rain, p->mirror, &ro,
                             NULL) == SAT_OK;
    ro.look = RAINDROP_LOOK_RAY;
    ro.coverage_threshold = 0;
    ok = ok && raindrop_render(slow, stride, p->hdr.width, p->hdr.height, p->depth, &camera, p->rain, p->mirror, &ro,
                               NULL) == SAT_OK;
    for (i = 0; ok && i < values; ++i)
        sum += (double)((fast[i] - slow[i]) * (fast[i] - slow[i])), mean += (double)p->hdr.pixels[i] / (double)values;
    free(fast);
    free(slow);
    return ok && mean > 0 ? sqrt(sum / (double)values) / mean : -1;
}

#endif /* REFERENCE_H */
