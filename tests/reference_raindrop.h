/* reference_raindrop.h - what raindrop.h is measured against: a drop traced step by step in long double, pictures with
   8 x 8 rays a pixel, and the environment read straight from its equirectangular picture.
   SPDX-License-Identifier: MIT-0 OR Unlicense */

#ifndef REFERENCE_RAINDROP_H
#define REFERENCE_RAINDROP_H

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "raindrop.h"

typedef long double reference_real;

typedef struct reference_drop {
    int hit;
    reference_real reflected[3], refracted[3], fresnel, transmit;
    reference_real order[4][3]; /* direction after k internal reflections */
    reference_real share[4];    /* power of order k */
    reference_real b;           /* impact parameter */
} reference_drop;

static inline reference_real reference_dot(const reference_real *a, const reference_real *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Snell's law in vector form; normal against d. 0: total reflection. */
static inline int reference_snell(reference_real *out, const reference_real *d, const reference_real *normal,
                                  reference_real n)
{
    reference_real c = -reference_dot(d, normal), k = 1 - (1 - c * c) / (n * n);
    int i;
    if (k < 0) return 0;
    k = sqrtl(k);
    for (i = 0; i < 3; i++) out[i] = d[i] / n + normal[i] * (c / n - k);
    return 1;
}

/* Eye at `origin`, unit direction d, ellipsoid of half axes 1, ratio, 1 at the origin of coordinates. */
static inline reference_drop reference_trace(const reference_real *origin, const reference_real *d,
                                             reference_real ratio, reference_real n)
{
    reference_drop out;
    reference_real q[3], u[3], a, b, c, t, hit[3], normal[3], inner[3], length, ci, cr, fs, fp, ps = 1, pp = 1;
    int i, k;
    memset(&out, 0, sizeof out);
    for (i = 0; i < 3; i++) {
        q[i] = origin[i] / (i == 1 ? ratio : 1);
        u[i] = d[i] / (i == 1 ? ratio : 1);
    }
    a = reference_dot(u, u);
    b = reference_dot(q, u);
    t = b / a;
    for (i = 0; i < 3; i++) hit[i] = q[i] - t * u[i]; /* the nearest point: its length is the impact parameter */
    out.b = sqrtl(reference_dot(hit, hit));
    if (out.b >= 1) return out;
    c = sqrtl((1 - out.b) * (1 + out.b) / a);
    out.hit = 1;
    for (i = 0; i < 3; i++) hit[i] -= c * u[i];
    for (i = 0; i < 3; i++) normal[i] = hit[i] / (i == 1 ? ratio : 1);
    length = sqrtl(reference_dot(normal, normal));
    for (i = 0; i < 3; i++) normal[i] /= length;
    ci = -reference_dot(d, normal);
    for (i = 0; i < 3; i++) out.reflected[i] = d[i] + 2 * ci * normal[i];
    if (!reference_snell(inner, d, normal, n)) {
        out.fresnel = 1;
        memcpy(out.refracted, out.reflected, sizeof out.refracted);
        return out;
    }
    cr = -reference_dot(inner, normal);
    fs = (ci - n * cr) / (ci + n * cr);
    fp = (n * ci - cr) / (n * ci + cr);
    fs *= fs;
    fp *= fp;
    out.fresnel = (fs + fp) / 2;
    out.transmit = ((1 - fs) * (1 - fs) + (1 - fp) * (1 - fp)) / 2;
    for (k = 0; k < 4; k++) {
        /* to the far side in the stretched space, then out, then mirrored inside */
        for (i = 0; i < 3; i++) u[i] = inner[i] / (i == 1 ? ratio : 1);
        t = -2 * reference_dot(hit, u) / reference_dot(u, u);
        for (i = 0; i < 3; i++) hit[i] += t * u[i];
        for (i = 0; i < 3; i++) normal[i] = -hit[i] / (i == 1 ? ratio : 1);
        length = sqrtl(reference_dot(normal, normal));
        for (i = 0; i < 3; i++) normal[i] /= length;
        if (!reference_snell(out.order[k], inner, normal, 1 / n)) memcpy(out.order[k], inner, sizeof inner);
        out.share[k] = ((1 - fs) * (1 - fs) * ps + (1 - fp) * (1 - fp) * pp) / 2;
        ps *= fs;
        pp *= fp;
        a = reference_dot(inner, normal);
        for (i = 0; i < 3; i++) inner[i] -= 2 * a * normal[i];
    }
    memcpy(out.refracted, out.order[0], sizeof out.refracted);
    return out;
}

/* ---- environment: bilinear in the equirectangular picture, in double */

static inline void reference_environment(double *rgb, const sat_image *picture, const double *d)
{
    double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), pi = acos(-1.0);
    double x = (atan2(d[0], -d[2]) / (2 * pi) + 0.5) * picture->width - 0.5,
           y = acos(d[1] / length) / pi * picture->height - 0.5;
    double fx = x - floor(x), fy = y - floor(y);
    int i, j, c, w = picture->width, h = picture->height;
    for (c = 0; c < 3; c++) rgb[c] = 0;
    for (j = 0; j < 2; j++) {
        for (i = 0; i < 2; i++) {
            int xi = ((int)floor(x) + i + w) % w, yi = (int)floor(y) + j;
            double weight = (i ? fx : 1 - fx) * (j ? fy : 1 - fy);
            const float *p;
            yi = yi < 0 ? 0 : yi >= h ? h - 1 : yi;
            p = (const float *)(const void *)((const char *)picture->pixels + (ptrdiff_t)yi * picture->stride) +
                (size_t)xi * (size_t)picture->channels;
            for (c = 0; c < 3; c++) rgb[c] += weight * (double)p[c];
        }
    }
}

/* ---- pictures: every drop, side x side rays a pixel, far to near, lookups without any filter.
   orders: -1 eq 2.5, F E(L) + (1 - F) E(R); 0..3 with exit Fresnel factors and that many internal reflections.
   The environment is the library's at its finest level, so that only the drops are compared. */

typedef struct reference_order { double depth; int at; } reference_order;

static inline int reference_far_first(const void *a, const void *b)
{
    double x = ((const reference_order *)a)->depth, y = ((const reference_order *)b)->depth;
    return x < y ? 1 : x > y ? -1 : ((const reference_order *)a)->at - ((const reference_order *)b)->at;
}

static inline void reference_colour(float *rgb, const raindrop_environment *environment, const reference_drop *drop,
                                    int orders)
{
    float d[3], v[3];
    int i, c, k;
    for (i = 0; i < 3; i++) d[i] = (float)drop->reflected[i];
    raindrop_environment_sample(v, environment, d, 0);
    for (c = 0; c < 3; c++) rgb[c] = (float)drop->fresnel * v[c];
    for (k = 0; k <= (orders < 0 ? 0 : orders); k++) {
        float share = (float)(orders < 0 ? 1 - drop->fresnel : drop->share[k]);
        for (i = 0; i < 3; i++) d[i] = (float)drop->order[k][i];
        raindrop_environment_sample(v, environment, d, 0);
        for (c = 0; c < 3; c++) rgb[c] += share * v[c];
    }
}

static inline void reference_ray(double *d, const raindrop_camera *camera, double x, double y)
{
    double length = sqrt(x * x + y * y + 1);
    int i;
    for (i = 0; i < 3; i++)
        d[i] = (x * (double)camera->right[i] + y * (double)camera->up[i] - (double)camera->back[i]) / length;
}

/* One drop over the fine picture (width * side wide); `mask` (may be NULL) gets 1 where a pixel is touched. */
static inline void reference_draw(float *fine, unsigned char *mask, int width, int height, int side,
                                  const raindrop_camera *camera, const raindrop_drop *drop,
                                  const raindrop_environment *environment, int orders)
{
    double focal = 0.5 * height * side / tan(0.5 * (double)camera->fov_y), ratio = (double)drop->axis_ratio;
    double radius = (double)drop->radius / cbrt(ratio), ball = ratio > 1 ? radius * ratio : radius;
    double rel[3], z = 0, x = 0, y = 0, reach, zz, rr;
    int i, px, py, x0, x1, y0, y1, w = width * side, h = height * side;
    for (i = 0; i < 3; i++) {
        rel[i] = (double)drop->position[i] - (double)camera->position[i];
        x += rel[i] * (double)camera->right[i];
        y += rel[i] * (double)camera->up[i];
        z -= rel[i] * (double)camera->back[i];
    }
    if (z - ball < (double)camera->depth_near) return;
    /* bounds of the projected ball, generous */
    zz = z - ball;
    rr = sqrt(x * x + y * y + z * z);
    reach = focal * ball / zz * (rr / zz) * 1.1 + 2;
    x0 = (int)fmax(0, floor(w * 0.5 + focal * x / z - reach));
    x1 = (int)fmin(w, ceil(w * 0.5 + focal * x / z + reach));
    y0 = (int)fmax(0, floor(h * 0.5 - focal * y / z - reach));
    y1 = (int)fmin(h, ceil(h * 0.5 - focal * y / z + reach));
    for (py = y0; py < y1; py++) {
        for (px = x0; px < x1; px++) {
            double d[3], along = 0, b2 = 0;
            reference_real origin[3], direction[3];
            reference_drop traced;
            reference_ray(d, camera, (px + 0.5 - w * 0.5) / focal, (h * 0.5 - py - 0.5) / focal);
            for (i = 0; i < 3; i++) along += d[i] * rel[i];
            for (i = 0; i < 3; i++) b2 += (rel[i] - along * d[i]) * (rel[i] - along * d[i]);
            if (b2 >= ball * ball) continue;
            for (i = 0; i < 3; i++) {
                origin[i] = (reference_real)(-rel[i] / radius);
                direction[i] = (reference_real)d[i];
            }
            traced = reference_trace(origin, direction, (reference_real)ratio, (reference_real)1.33L);
            if (!traced.hit) continue;
            reference_colour(fine + 3 * ((size_t)py * (size_t)w + (size_t)px), environment, &traced, orders);
            if (mask) mask[(size_t)(py / side) * (size_t)width + (size_t)(px / side)] = 1;
        }
    }
}

/* Whether a drop touches a pixel of the same window of reference_ssim. */
static inline int reference_near(const unsigned char *mask, int width, int height, int x, int y)
{
    int x0 = x > 7 ? x - 7 : 0, x1 = x + 8 < width ? x + 8 : width, row;
    for (row = y > 7 ? y - 7 : 0; row < height && row < y + 8; row++)
        if (memchr(mask + (size_t)row * (size_t)width + x0, 1, (size_t)(x1 - x0))) return 1;
    return 0;
}

/* The whole picture, background included; with a mask only what the measures below look at, the rest black. Returns 0
   when memory is short. */
static inline int reference_render(float *rgb, unsigned char *mask, int width, int height, int side,
                                   const raindrop_camera *camera, const raindrop_drop *drops, int count,
                                   const raindrop_environment *environment, int orders)
{
    size_t w = (size_t)(width * side), h = (size_t)(height * side), k;
    double focal = 0.5 * (double)h / tan(0.5 * (double)camera->fov_y);
    float *fine = (float *)malloc(w * h * 3 * sizeof *fine);
    reference_order *order = (reference_order *)malloc((size_t)(count + 1) * sizeof *order);
    int i, j, x, y, c, seen;
    if (!fine || !order) { free(fine); free(order); return 0; }
    for (k = 0; k < w * h; k++) fine[3 * k] = -1; /* no light yet */
    for (i = 0; i < count; i++) {
        order[i].at = i;
        order[i].depth = 0;
        for (c = 0; c < 3; c++)
            order[i].depth -= ((double)drops[i].position[c] - (double)camera->position[c]) * (double)camera->back[c];
    }
    qsort(order, (size_t)count, sizeof *order, reference_far_first);
    if (mask) memset(mask, 0, (size_t)width * (size_t)height);
    for (i = 0; i < count; i++)
        reference_draw(fine, mask, width, height, side, camera, &drops[order[i].at], environment, orders);
    for (y = 0; y < height; y++) {
        for (x = 0; x < width; x++) {
            double sum[3] = {0, 0, 0};
            k = (size_t)y * (size_t)width + (size_t)x;
            seen = !mask || reference_near(mask, width, height, x, y);
            for (j = y * side; seen && j < (y + 1) * side; j++)
                for (i = x * side; i < (x + 1) * side; i++) {
                    float *light = fine + 3 * ((size_t)j * w + (size_t)i), f[3];
                    double d[3];
                    reference_ray(d, camera, (i + 0.5 - (double)w / 2) / focal, ((double)h / 2 - j - 0.5) / focal);
                    for (c = 0; c < 3; c++) f[c] = (float)d[c];
                    if (light[0] < 0) raindrop_environment_sample(light, environment, f, 0);
                    for (c = 0; c < 3; c++) sum[c] += (double)light[c];
                }
            for (c = 0; c < 3; c++) rgb[3 * k + (size_t)c] = (float)(sum[c] / (side * side));
        }
    }
    free(fine);
    free(order);
    return 1;
}

/* ---- one lamp in one round drop before black, by rays fine enough to hit it: its light in pixels, and where its
   middle is;
   the orders up to 1 as raindrop_render has them by default, the later ones' light with the last */

static inline void reference_lamp(double *out, int width, int height, const raindrop_camera *camera,
                                  const raindrop_drop *drop, const raindrop_lamp *lamp)
{
    const double focal = 0.5 * height / tan(0.5 * (double)camera->fov_y), pi = acos(-1.0);
    double to[3], rel[3], distance = 0, length, wide, radiance, z = 0, x = 0, y = 0, reach, step;
    int i, j, k, c, n;
    for (c = 0; c < 3; c++) {
        rel[c] = (double)drop->position[c] - (double)camera->position[c];
        to[c] = (double)lamp->position[c] - (double)drop->position[c];
        distance += to[c] * to[c];
        x += rel[c] * (double)camera->right[c];
        y += rel[c] * (double)camera->up[c];
        z -= rel[c] * (double)camera->back[c];
    }
    distance = sqrt(distance);
    for (c = 0; c < 3; c++) to[c] /= distance;
    wide = (double)lamp->radius / distance;
    radiance = (double)lamp->intensity[0] / (pi * (double)lamp->radius * (double)lamp->radius);
    reach = 1.3 * focal * (double)drop->radius / z;
    n = 600;
    step = 2 * reach / n;
    out[0] = out[1] = out[2] = 0;
    for (j = 0; j < n; j++)
        for (i = 0; i < n; i++) {
            double px = 0.5 * width + focal * x / z - reach + (i + 0.5) * step,
                   py = 0.5 * height - focal * y / z - reach + (j + 0.5) * step, d[3], normal[3], light = 0;
            reference_real origin[3], direction[3];
            reference_drop traced;
            reference_ray(d, camera, (px - 0.5 * width) / focal, (0.5 * height - py) / focal);
            /* what enters a sphere leaves in the plane of the ray and the centre: is the lamp there at all? */
            for (c = 0; c < 3; c++) normal[c] = d[(c + 1) % 3] * rel[(c + 2) % 3] - d[(c + 2) % 3] * rel[(c + 1) % 3];
            length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
            if (fabs(normal[0] * to[0] + normal[1] * to[1] + normal[2] * to[2]) > length * sin(wide)) continue;
            for (c = 0; c < 3; c++) {
                origin[c] = (reference_real)(-rel[c] / (double)drop->radius);
                direction[c] = (reference_real)d[c];
            }
            traced = reference_trace(origin, direction, 1, (reference_real)1.33L);
            if (!traced.hit) continue;
            for (k = -1; k < 2; k++) {
                const reference_real *leaves = k < 0 ? traced.reflected : traced.order[k];
                double cosine = 0;
                for (c = 0; c < 3; c++) cosine += (double)leaves[c] * to[c];
                if (cosine < cos(wide)) continue;
                light += (double)(k < 0   ? traced.fresnel
                                  : k < 1 ? traced.share[0]
                                          : 1 - traced.fresnel - traced.share[0]);
            }
            light *= radiance * step * step;
            out[0] += light;
            out[1] += light * px;
            out[2] += light * py;
        }
    out[1] /= out[0];
    out[2] /= out[0];
}

/* ---- measures: pictures are compared after the global photographic operator, as they will be seen */

static inline double reference_key(const float *rgb, size_t pixels)
{
    double sum = 0;
    size_t i;
    for (i = 0; i < pixels; i++)
        sum +=
            log(1e-4 + 0.2126 * (double)rgb[3 * i] + 0.7152 * (double)rgb[3 * i + 1] + 0.0722 * (double)rgb[3 * i + 2]);
    return 0.18 / exp(sum / (double)pixels);
}

static inline double reference_tone(const float *rgb, double key)
{
    double l = key * (0.2126 * (double)rgb[0] + 0.7152 * (double)rgb[1] + 0.0722 * (double)rgb[2]);
    return pow(l / (1 + l), 1 / 2.2);
}

/* Root-mean-square difference of the tone-mapped luminance, over the masked pixels if there is a mask. */
static inline double reference_rmse(const float *a, const float *b, const unsigned char *mask, size_t pixels,
                                    double key)
{
    double sum = 0, n = 0;
    size_t i;
    for (i = 0; i < pixels; i++) {
        double d;
        if (mask && !mask[i]) continue;
        d = reference_tone(a + 3 * i, key) - reference_tone(b + 3 * i, key);
        sum += d * d;
        n += 1;
    }
    return n > 0 ? sqrt(sum / n) : 0;
}

/* Structural similarity on 8 x 8 windows four pixels apart, tone-mapped luminance (Wang et al. 2004, flat windows). */
static inline double reference_ssim(const float *a, const float *b, const unsigned char *mask, int width, int height,
                                    double key)
{
    double total = 0, n = 0;
    int x, y, i, j;
    for (y = 0; y + 8 <= height; y += 4) {
        for (x = 0; x + 8 <= width; x += 4) {
            double sa = 0, sb = 0, aa = 0, bb = 0, ab = 0;
            int any = !mask;
            for (j = 0; j < 8; j++)
                for (i = 0; i < 8; i++) {
                    size_t at = (size_t)(y + j) * (size_t)width + (size_t)(x + i);
                    double u = reference_tone(a + 3 * at, key), v = reference_tone(b + 3 * at, key);
                    any |= mask && mask[at];
                    sa += u; sb += v; aa += u * u; bb += v * v; ab += u * v;
                }
            if (!any) continue;
            sa /= 64; sb /= 64;
            aa = aa / 64 - sa * sa; bb = bb / 64 - sb * sb; ab = ab / 64 - sa * sb;
            total += (2 * sa * sb + 1e-4) * (2 * ab + 9e-4) / ((sa * sa + sb * sb + 1e-4) * (aa + bb + 9e-4));
            n += 1;
        }
    }
    return n > 0 ? total / n : 1;
}

/* ---- inputs that need no file: a sky, a horizon with dark trees, windows, and a sun 300 times as bright */

static inline void reference_sky(float *rgb, int width, int height)
{
    const double pi = acos(-1.0);
    int x, y, c;
    for (y = 0; y < height; y++) {
        for (x = 0; x < width; x++) {
            double v = pi * (y + 0.5) / height, u = 2 * pi * ((x + 0.5) / width - 0.5), up = cos(v);
            double d[3] = {sin(v) * sin(u), up, -sin(v) * cos(u)}, sun = d[0] * 0.3 + d[1] * 0.6 + d[2] * -0.7416;
            double ground = 0.15 + 0.05 * sin(20 * u) * sin(31 * v),
                   tree = up < 0.12 + 0.08 * sin(7 * u) + 0.04 * sin(23 * u + 1) ? 1 : 0;
            double blue[3] = {0.4, 0.7, 1.3}, green[3] = {0.12, 0.2, 0.05};
            for (c = 0; c < 3; c++) {
                double value = up < 0     ? ground * (c == 2 ? 0.6 : 1)
                               : tree > 0 ? green[c] * (1 + 0.8 * sin(41 * u) * sin(53 * v))
                                          : blue[c] * (1 + up);
                if (sun > 0.9995) value += 300;
                else if (sun > 0) value += 2 * pow(sun, 200);
                rgb[3 * ((size_t)y * (size_t)width + (size_t)x) + (size_t)c] = (float)value;
            }
        }
    }
}

/* a map of this side and so many samples of alpha */
static inline sat_result reference_map(raindrop_map **out, int resolution, int samples, float n)
{
    raindrop_map_options o = raindrop_map_defaults();
    o.resolution = resolution;
    o.alpha_samples = samples;
    o.n = n;
    return raindrop_map_create(out, &o);
}

#endif /* REFERENCE_RAINDROP_H */
