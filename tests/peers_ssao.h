/* peers_ssao.h - what ssao_sat.h's slabs are timed against at the same vector width: XeGTAO (Jimenez 2016; Intel's
   open code: depth pyramid, Hilbert and R2 noise, denoiser), visibility bitmasks (Therrien 2023) and HBAO (Bavoil
   2008), four pixels a vector, written from their descriptions.
   SPDX-License-Identifier: MIT-0 OR Unlicense

   At half resolution they run inside ssao_sat.h's own frame: its reading of depth and normals and its upsample, so that
   the kernels alone differ. Needs GCC or Clang vectors. Include after reference_ssao.h. */

#ifndef PEERS_SSAO_H
#define PEERS_SSAO_H

typedef float peer_f __attribute__((vector_size(16)));
typedef int32_t peer_i __attribute__((vector_size(16)));

static inline peer_f peer_set(float v) { peer_f r = {v, v, v, v}; return r; }
static inline peer_f peer_load(const float *p) { peer_f r; memcpy(&r, p, sizeof r); return r; }
static inline void peer_store(float *p, peer_f v) { memcpy(p, &v, sizeof v); }
static inline peer_f peer_if(peer_i m, peer_f a, peer_f b) { return (peer_f)(((peer_i)a & m) | ((peer_i)b & ~m)); }
static inline peer_f peer_max(peer_f a, peer_f b) { return peer_if(a > b, a, b); }
static inline peer_f peer_min(peer_f a, peer_f b) { return peer_if(a < b, a, b); }
static inline peer_f peer_clamp(peer_f a, float low, float high)
{
    return peer_min(peer_max(a, peer_set(low)), peer_set(high));
}
static inline peer_f peer_abs(peer_f a) { return (peer_f)((peer_i)a & 0x7fffffff); }
static inline peer_i peer_int(peer_f a) { return __builtin_convertvector(a, peer_i); }
static inline peer_f peer_float(peer_i a) { return __builtin_convertvector(a, peer_f); }
#if defined(__SSE2__)
static inline peer_f peer_sqrt(peer_f a) { return (peer_f)_mm_sqrt_ps((__m128)a); }
static inline peer_f peer_inverse_sqrt(peer_f a) /* one step of Newton: 22 bits */
{
    peer_f r = (peer_f)_mm_rsqrt_ps((__m128)a);
    return r * (1.5f - 0.5f * a * r * r);
}
#else
static inline peer_f peer_sqrt(peer_f a)
{
    peer_f r = {sqrtf(a[0]), sqrtf(a[1]), sqrtf(a[2]), sqrtf(a[3])};
    return r;
}
static inline peer_f peer_inverse_sqrt(peer_f a) { return 1 / peer_sqrt(a); }
#endif
static inline peer_f peer_round(peer_f a) /* to nearest, for |a| < 2^22 */
{
    const peer_f magic = peer_set(12582912.0f);
    return (a + magic) - magic;
}
static inline peer_f peer_acos(peer_f x) /* as ref_acos */
{
    peer_f a = peer_min(peer_abs(x), peer_set(1)),
           r = ((-0.0187293f * a + 0.0742610f) * a - 0.2121144f) * a + 1.5707288f;
    r = r * peer_sqrt(1 - a);
    return peer_if(x < 0, 3.14159265f - r, r);
}
static inline peer_f peer_cos(peer_f x)
{
    peer_f t = x * 0.15915494f, q;
    t = (t - peer_round(t)) * 6.2831853f;
    q = t * t;
    return 1 + q * (-0.5f + q * (0.0416666642f + q * (-0.0013888397f + q * (2.47609e-5f - q * 2.6051e-7f))));
}

/* ---- the picture as the kernels read it ---- */

enum { PEER_MIPS = 5, PEER_NOISE = 64, PEER_PAD = 8 };

typedef struct peer_picture {
    int width, height;
    size_t stride;              /* floats a row, PEER_PAD of them left of the first pixel; a row above and below */
    float f, cx, cy;            /* focal length and centre in pixels; y down, z forward */
    float *n[3], *mip[PEER_MIPS], *edge[4], *open, *other; /* `open` points at pixel 0, 0 */
    int mip_width[PEER_MIPS], mip_height[PEER_MIPS];
    float noise[2][PEER_NOISE * PEER_NOISE];
    float *block;
} peer_picture;

static inline unsigned peer_hilbert(unsigned x, unsigned y)
{
    unsigned index = 0, level, t;
    for (level = PEER_NOISE / 2; level > 0; level /= 2) {
        unsigned rx = (x & level) > 0, ry = (y & level) > 0;
        index += level * level * ((3 * rx) ^ ry);
        if (ry) continue;
        if (rx) { x = PEER_NOISE - 1 - x; y = PEER_NOISE - 1 - y; }
        t = x; x = y; y = t;
    }
    return index;
}

static inline void peer_open(peer_picture *g, int width, int height)
{
    size_t plane, i;
    float *at;
    int k;
    memset(g, 0, sizeof *g);
    g->width = width;
    g->height = height;
    g->stride = ((size_t)width + 3) / 4 * 4 + 2 * PEER_PAD;
    plane = g->stride * ((size_t)height + 2);
    g->block = (float *)calloc(plane * (10 + PEER_MIPS), sizeof(float));
    if (!g->block) exit(1);
    at = g->block + g->stride + PEER_PAD;
    for (k = 0; k < 3; k++, at += plane) g->n[k] = at;
    for (k = 0; k < 4; k++, at += plane) g->edge[k] = at;
    for (k = 0; k < PEER_MIPS; k++, at += plane) {
        g->mip[k] = at;
        g->mip_width[k] = (width + (1 << k) - 1) >> k;
        g->mip_height[k] = (height + (1 << k) - 1) >> k;
    }
    g->open = at;
    g->other = at + plane;
    for (i = 0; i < PEER_NOISE * PEER_NOISE; i++) { /* Hilbert curve, then the R2 sequence along it */
        double h = (double)peer_hilbert((unsigned)(i % PEER_NOISE), (unsigned)(i / PEER_NOISE)),
               u = 0.5 + h * 0.75487766624669276005, v = 0.5 + h * 0.5698402909980532659114;
        g->noise[0][i] = (float)(u - floor(u));
        g->noise[1][i] = (float)(v - floor(v));
    }
}

static inline void peer_close(peer_picture *g) { free(g->block); g->block = NULL; }

/* A full-resolution picture; the normals' axes turned once, as an engine would have them. */
static inline void peer_take(peer_picture *g, const ref_picture *p)
{
    int x, y;
    g->f = (float)(0.5 * p->height / tan(0.5 * p->fov));
    g->cx = 0.5f * (float)p->width;
    g->cy = 0.5f * (float)p->height;
    for (y = 0; y < p->height; y++)
        for (x = 0; x < p->width; x++) {
            size_t from = (size_t)y * (size_t)p->width + (size_t)x, at = (size_t)y * g->stride + (size_t)x;
            g->mip[0][at] = p->z[from] < 1e18f ? p->z[from] : 1e18f;
            g->n[0][at] = p->normals[3 * from];
            g->n[1][at] = -p->normals[3 * from + 1];
            g->n[2][at] = -p->normals[3 * from + 2];
        }
}

/* ---- parameters ---- */

typedef enum peer_kind { PEER_GTAO, PEER_BITMASK, PEER_HBAO } peer_kind;

typedef struct peer_method {
    const char *name;
    peer_kind kind;
    int slices, steps, denoise, half; /* slices x (steps + steps) samples; HBAO: directions x steps */
    float reach, second;              /* radius multiplier; falloff share (GTAO), thickness in radii (bitmask), bias */
    float gain, power;                /* accessibility = (1 - gain (1 - visibility))^power */
} peer_method;

/* ---- XeGTAO's depth pyramid and edges ---- */

/* Each pixel of a level is the mean of four, those far behind the nearest... farthest counting less: as XeGTAO. */
static inline void peer_pyramid(peer_picture *g, float radius, float falloff)
{
    float reach = 0.75f * radius, range = falloff * reach, slope = -1 / range, offset = (reach - range) / range + 1;
    int level, x, y, k;
    for (level = 1; level < PEER_MIPS; level++)
        for (y = 0; y < g->mip_height[level]; y++)
            for (x = 0; x < g->mip_width[level]; x++) {
                int x1 = 2 * x + 1 < g->mip_width[level - 1] ? 2 * x + 1 : 2 * x,
                    y1 = 2 * y + 1 < g->mip_height[level - 1] ? 2 * y + 1 : 2 * y;
                const float *a = g->mip[level - 1] + (size_t)(2 * y) * g->stride,
                            *b = g->mip[level - 1] + (size_t)y1 * g->stride;
                float d[4], most = 0, weight, sum = 0, total = 0;
                d[0] = a[2 * x]; d[1] = a[x1]; d[2] = b[2 * x]; d[3] = b[x1];
                for (k = 0; k < 4; k++) most = d[k] > most ? d[k] : most;
                for (k = 0; k < 4; k++) {
                    weight = ref_clamp((most - d[k]) * slope + offset, 0, 1);
                    total += weight;
                    sum += weight * d[k];
                }
                g->mip[level][(size_t)y * g->stride + (size_t)x] = sum / total;
            }
}

/* Left, right, top, bottom: 1 where the depth goes on, by slope-adjusted differences. */
static inline void peer_edges(peer_picture *g)
{
    int x, y, k;
    for (k = 0; k < 4; k++) { /* outside there is nothing to blur with */
        memset(g->edge[k] - g->stride - PEER_PAD, 0, g->stride * 4);
        memset(g->edge[k] + (size_t)g->height * g->stride - PEER_PAD, 0, g->stride * 4);
    }
    for (y = 0; y < g->height; y++) {
        const float *row = g->mip[0] + (size_t)y * g->stride, *up = y > 0 ? row - g->stride : row,
                    *down = y < g->height - 1 ? row + g->stride : row;
        for (x = 0; x < g->width; x += 4) {
            size_t at = (size_t)y * g->stride + (size_t)x;
            peer_f c = peer_load(row + x), d[4], slope, e;
            d[0] = peer_load(row + x - 1) - c;
            d[1] = peer_load(row + x + 1) - c;
            d[2] = peer_load(up + x) - c;
            d[3] = peer_load(down + x) - c;
            for (k = 0; k < 4; k++) {
                slope = 0.5f * (d[k ^ 1] - d[k]);
                e = peer_min(peer_abs(d[k]), peer_abs(d[k] + slope));
                peer_store(g->edge[k] + at, peer_clamp(1.25f - e / (c * 0.011f), 0, 1));
            }
        }
        g->edge[0][(size_t)y * g->stride] = 0;
        g->edge[1][(size_t)y * g->stride + (size_t)g->width - 1] = 0;
    }
}

static inline void peer_denoise(const peer_picture *g, const float *in, float *out, float own)
{
    const ptrdiff_t s = (ptrdiff_t)g->stride;
    int x, y, k;
    for (y = 0; y < g->height; y++)
        for (x = 0; x < g->width; x += 4) {
            const ptrdiff_t at = (ptrdiff_t)y * s + x, near_by[4] = {at - 1, at + 1, at - s, at + s},
                            corner[4] = {at - s - 1, at - s + 1, at + s - 1, at + s + 1};
            static const int first[4] = {0, 1, 0, 1}, second[4] = {2, 2, 3, 3}; /* sides beside each corner */
            peer_f e[4], leak, sum = own * peer_load(in + at), total = peer_set(own), four = peer_set(0);
            for (k = 0; k < 4; k++) {
                e[k] = peer_load(g->edge[k] + at) * peer_load(g->edge[k ^ 1] + near_by[k]);
                four = four + e[k];
            }
            leak = peer_clamp(1.5f - four, 0, 1) * (0.5f / 1.5f);
            for (k = 0; k < 4; k++) {
                e[k] = peer_clamp(e[k] + leak, 0, 1);
                sum = sum + e[k] * peer_load(in + near_by[k]);
                total = total + e[k];
            }
            for (k = 0; k < 4; k++) {
                int a = first[k], b = second[k];
                peer_f w = 0.425f * (e[a] * peer_load(g->edge[b] + near_by[a]) +
                                     e[b] * peer_load(g->edge[a] + near_by[b]));
                sum = sum + w * peer_load(in + corner[k]);
                total = total + w;
            }
            peer_store(out + at, sum / total);
        }
}

/* ---- the kernels ---- */

typedef struct peer_point {
    peer_f x, z, px, py, vx, vy, vz, nx, ny, nz, noise[2], pixels; /* pixels: the radius on the screen */
    float y;
} peer_point;

/* Depths of four samples, from the level for their distance; beyond the picture none. */
static inline peer_f peer_gather(const peer_picture *g, peer_f sx, peer_f sy, peer_f away, int pyramid)
{
    peer_f z = peer_set(1e18f);
    int k;
    for (k = 0; k < 4; k++) {
        int x, y, level = 0;
        if (!(sx[k] >= 0) || !(sy[k] >= 0) || sx[k] >= (float)g->width || sy[k] >= (float)g->height) continue;
        x = (int)sx[k];
        y = (int)sy[k];
        if (pyramid) {
            float length = away[k];
            int32_t bits;
            memcpy(&bits, &length, sizeof bits);
            level = sat__clamp_int((bits >> 23) - 127 - 3, 0, PEER_MIPS - 1);
        }
        z[k] = g->mip[level][(size_t)(y >> level) * g->stride + (size_t)(x >> level)];
    }
    return z;
}

static inline peer_point peer_make_point(const peer_picture *g, int x, int y, float reach)
{
    peer_point p;
    size_t at = (size_t)y * g->stride + (size_t)x;
    peer_f rx, inverse;
    float ry = ((float)y + 0.5f - g->cy) / g->f;
    int k;
    p.x = peer_set((float)x) + (peer_f){0.5f, 1.5f, 2.5f, 3.5f};
    p.y = (float)y + 0.5f;
    p.z = peer_load(g->mip[0] + at);
    p.z = peer_if(p.z > 1e17f, peer_set(1), p.z) * 0.99999f;
    rx = (p.x - g->cx) / g->f;
    p.px = rx * p.z;
    p.py = ry * p.z;
    inverse = -peer_inverse_sqrt(rx * rx + (ry * ry + 1));
    p.vx = rx * inverse;
    p.vy = ry * inverse;
    p.vz = inverse;
    p.nx = peer_load(g->n[0] + at);
    p.ny = peer_load(g->n[1] + at);
    p.nz = peer_load(g->n[2] + at);
    p.pixels = reach * g->f / p.z;
    for (k = 0; k < 4; k++) {
        int t = (y % PEER_NOISE) * PEER_NOISE + (x + k) % PEER_NOISE;
        p.noise[0][k] = g->noise[0][t];
        p.noise[1][k] = g->noise[1][t];
    }
    return p;
}

/* Sectors between two angles off the normal, front and back of a thick sample, marked in the mask of each lane; the
   sine of the angle makes sectors of equal cosine weight. */
static inline void peer_mark(peer_i *mask, peer_i valid, peer_f front, peer_f back)
{
    peer_f a = peer_clamp(front, -1.5707963f, 1.5707963f), b = peer_clamp(back, -1.5707963f, 1.5707963f);
    peer_f low = peer_cos(peer_min(a, b) - 1.5707963f) * 16 + 16.5f,
           high = peer_cos(peer_max(a, b) - 1.5707963f) * 16 + 16.5f;
    peer_i first = peer_int(low), last = peer_int(high);
    int k;
    for (k = 0; k < 4; k++)
        if (valid[k] && last[k] > first[k])
            (*mask)[k] |= (int32_t)(uint32_t)((((uint64_t)1 << (last[k] - first[k])) - 1) << first[k]);
}

/* Four pixels: visibility of slices through the view direction (Jimenez 2016, eq 7; Therrien 2023). */
static inline peer_f peer_slices(const peer_picture *g, const peer_method *m, const peer_point *p, float radius)
{
    const float reach = radius * m->reach, range = m->second * reach;
    const peer_f slope = peer_set(-1 / range), offset = peer_set((reach - range) / range + 1);
    peer_f visible = peer_set(0), weights = peer_set(0), least = 1.3f / p->pixels;
    int slice, step, side, k;
    for (slice = 0; slice < m->slices; slice++) {
        peer_f phi = ((float)slice + p->noise[0]) * (3.14159265f / (float)m->slices), c = peer_cos(phi),
               s = peer_cos(phi - 1.57079633f), dv = c * p->vx + s * p->vy, ox = c - dv * p->vx, oy = s - dv * p->vy,
               oz = -dv * p->vz, ax = oy * p->vz - oz * p->vy, ay = oz * p->vx - ox * p->vz,
               az = ox * p->vy - oy * p->vx, along, qx, qy, qz, length, cosine, angle, sine, horizon[2], low[2];
        peer_i mask = {0, 0, 0, 0};
        along = peer_inverse_sqrt(ax * ax + ay * ay + az * az);
        ax = ax * along; ay = ay * along; az = az * along;
        along = p->nx * ax + p->ny * ay + p->nz * az;
        qx = p->nx - ax * along; qy = p->ny - ay * along; qz = p->nz - az * along;
        length = peer_sqrt(qx * qx + qy * qy + qz * qz) + 1e-9f;
        cosine = peer_clamp((qx * p->vx + qy * p->vy + qz * p->vz) / length, 0, 1);
        angle = peer_if(ox * qx + oy * qy + oz * qz < 0, peer_set(-1), peer_set(1));
        sine = angle * peer_sqrt(1 - cosine * cosine);
        angle = angle * peer_acos(cosine);
        horizon[0] = low[0] = -sine;
        horizon[1] = low[1] = sine;
        for (step = 0; step < m->steps; step++) {
            float golden = (float)(slice + step * m->steps) * 0.61803399f;
            peer_f t = p->noise[1] + (golden - floorf(golden)), away, dx, dy;
            t = ((float)step + peer_if(t >= 1, t - 1, t)) / (float)m->steps;
            away = (t * t + least) * p->pixels;
            dx = peer_round(c * away);
            dy = peer_round(s * away);
            for (side = 0; side < 2; side++) {
                const float sign = side ? -1.0f : 1.0f;
                peer_f sx = p->x + sign * dx, sy = p->y + sign * dy, z = peer_gather(g, sx, sy, away, 1);
                peer_f ex = (sx - g->cx) / g->f * z - p->px, ey = (sy - g->cy) / g->f * z - p->py, ez = z - p->z,
                       square = ex * ex + ey * ey + ez * ez, inverse = peer_inverse_sqrt(square + 1e-30f),
                       distance = square * inverse, to = (ex * p->vx + ey * p->vy + ez * p->vz) * inverse;
                peer_i valid = z < 1e17f;
                if (m->kind == PEER_GTAO) {
                    peer_f h = low[side] + (to - low[side]) * peer_clamp(distance * slope + offset, 0, 1);
                    horizon[side] = peer_if(valid & (h > horizon[side]), h, horizon[side]);
                } else {
                    float thick = m->second * radius;
                    peer_f bx = ex - p->vx * thick, by = ey - p->vy * thick, bz = ez - p->vz * thick,
                           back = (bx * p->vx + by * p->vy + bz * p->vz) *
                                  peer_inverse_sqrt(bx * bx + by * by + bz * bz + 1e-30f);
                    peer_mark(&mask, valid & (distance < reach), sign * peer_acos(peer_clamp(to, -1, 1)) - angle,
                              sign * peer_acos(peer_clamp(back, -1, 1)) - angle);
                }
            }
        }
        if (m->kind == PEER_GTAO) {
            peer_f h0 = -peer_acos(peer_clamp(horizon[1], -1, 1)), h1 = peer_acos(peer_clamp(horizon[0], -1, 1));
            length = length + (1 - length) * 0.05f;
            visible = visible + length * 0.25f *
                                    (2 * cosine + 2 * (h0 + h1) * sine - peer_cos(2 * h0 - angle) -
                                     peer_cos(2 * h1 - angle));
            weights = weights + 1;
        } else {
            peer_f open;
            for (k = 0; k < 4; k++) open[k] = 1 - (float)__builtin_popcount((unsigned)mask[k]) / 32;
            visible = visible + open * length;
            weights = weights + length;
        }
    }
    return visible / weights;
}

/* Four pixels: horizons with attenuation by sample, as ref_hbao. */
static inline peer_f peer_horizons(const peer_picture *g, const peer_method *m, const peer_point *p, float radius)
{
    const float reach = radius * m->reach;
    peer_f sum = peer_set(0), stride = peer_clamp(p->pixels, 1.5f, 400) / (float)m->steps;
    int k, step;
    stride = peer_max(stride, peer_set(1));
    for (k = 0; k < m->slices; k++) {
        peer_f a = ((float)k + p->noise[0]) * (6.2831853f / (float)m->slices), c = peer_cos(a),
               s = peer_cos(a - 1.57079633f), top = peer_set(m->second);
        for (step = 0; step < m->steps; step++) {
            peer_f away = ((float)step + 0.2f + 0.8f * p->noise[1]) * stride + 0.7f;
            peer_f sx = p->x + peer_round(c * away), sy = p->y + peer_round(s * away),
                   z = peer_gather(g, sx, sy, away, 0);
            peer_f ex = (sx - g->cx) / g->f * z - p->px, ey = (sy - g->cy) / g->f * z - p->py, ez = z - p->z,
                   square = ex * ex + ey * ey + ez * ez, share = 1 - square / (reach * reach),
                   sine = (ex * p->nx + ey * p->ny + ez * p->nz) * peer_inverse_sqrt(square + 1e-12f);
            peer_i higher = (share > 0) & (sine > top);
            sum = sum + peer_if(higher, share * (sine - top), peer_set(0));
            top = peer_if(higher, sine, top);
        }
    }
    return 1 - sum / (float)m->slices;
}

/* Visibility before gain and power, in g->open; mip[0] and n are there. */
static inline void peer_run(peer_picture *g, const peer_method *m, float radius)
{
    float reach = radius * m->reach, *t;
    int x, y, k;
    if (m->kind != PEER_HBAO) peer_pyramid(g, reach, m->kind == PEER_GTAO ? m->second : 0.615f);
    for (y = 0; y < g->height; y++)
        for (x = 0; x < g->width; x += 4) {
            size_t at = (size_t)y * g->stride + (size_t)x;
            peer_i sky = peer_load(g->mip[0] + at) > 1e17f;
            peer_f v = peer_set(1);
            if (!(sky[0] & sky[1] & sky[2] & sky[3])) {
                peer_point p = peer_make_point(g, x, y, reach);
                v = m->kind == PEER_HBAO ? peer_horizons(g, m, &p, radius) : peer_slices(g, m, &p, radius);
            }
            peer_store(g->open + at, peer_if(sky, peer_set(1), v));
        }
    if (m->denoise) peer_edges(g);
    for (k = 0; k < m->denoise; k++) {
        peer_denoise(g, g->open, g->other, k == m->denoise - 1 ? 1.2f : 1.2f / 5);
        t = g->open; g->open = g->other; g->other = t;
    }
}

/* ---- the whole method ---- */

/* accessibility = (1 - gain (1 - v))^power */
static inline float peer_tone(const peer_method *m, float v)
{
    float open = ref_clamp(1 - m->gain * (1 - v), 0, 1);
    return m->power == 1 ? open : m->power == 2 ? open * open : powf(open, m->power);
}

/* In the frame of `s`, an object of PLANE at half resolution for this picture; else over the whole picture. Seconds of
   processor time by `clock`. */
static inline double peer_apply(peer_picture *g, ssao_sat *s, const peer_method *m, const ref_picture *p, float radius,
                                float *out, double (*clock)(void))
{
    ssao_sat_input in = ssao_sat_input_linear(p->z, p->width, p->height, p->fov);
    double start;
    int x, y;
    in.normals = p->normals;
    if (!m->half) {
        peer_take(g, p);
        start = clock();
        peer_run(g, m, radius);
        for (y = 0; y < p->height; y++)
            for (x = 0; x < p->width; x++)
                out[(size_t)y * (size_t)p->width + (size_t)x] =
                    peer_tone(m, g->open[(size_t)y * g->stride + (size_t)x]);
        return clock() - start;
    }
    start = clock();
    if (ssao_sat__check_input(s, &in) != SAT_OK) exit(1);
    s->to = ssao_sat__output_of(out, (ptrdiff_t)p->width * 4, 4);
    s->first = s->begin = 0;
    s->end = s->held = s->rows;
    memset(s->workers, 0, sizeof *s->workers);
    ssao_sat__hold_rows(0, s->rows, 0, s);
    g->f = 1 / s->camera.ax;
    g->cx = 0.5f - s->camera.bx * g->f;
    g->cy = 0.5f - s->camera.by / s->camera.ay;
    for (y = 0; y < s->rows; y++)
        for (x = 0; x < s->columns; x++) {
            size_t from = ssao_sat__at(s, y) + (size_t)x, at = (size_t)y * g->stride + (size_t)x;
            g->mip[0][at] = s->work.z[from] > 0 ? s->work.z[from] : 1e18f;
            g->n[0][at] = s->work.nx[from];
            g->n[1][at] = -s->work.ny[from];
            g->n[2][at] = s->work.nz[from];
        }
    peer_run(g, m, radius);
    for (y = 0; y < s->rows; y++)
        for (x = 0; x < s->columns; x++)
            s->work.open[ssao_sat__at(s, y) + (size_t)x] = peer_tone(m, g->open[(size_t)y * g->stride + (size_t)x]);
    ssao_sat__write_rows(0, p->height, 0, s);
    return clock() - start;
}

#endif
