/* reference_fiv.h - ground truth for fiv.h: rays through every light of the environment against every triangle.
   SPDX-License-Identifier: MIT-0 OR Unlicense

   A scene is a soup of triangles in world coordinates. Visibility is point-sampled in doubles (Moeller and Trumbore
   1997), through a tree of boxes that only saves time; with HAVE_EMBREE the benchmark traces the same rays eight at a
   time. */

#ifndef REFERENCE_FIV_H
#define REFERENCE_FIV_H

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fiv.h"
#ifdef HAVE_EMBREE
#include <embree3/rtcore.h>
#endif

typedef struct reference_node { double low[3], high[3]; int first, count, right; } reference_node;

typedef struct reference_scene {
    double (*corner)[3][3];      /* triangles */
    int count, capacity;
    reference_node *nodes;
    int node_count;
#ifdef HAVE_EMBREE
    RTCDevice device;
    RTCScene embree;
#endif
} reference_scene;

/* Adds a mesh: world = position + scale * rotation * vertex. */
static inline void reference_add(reference_scene *s, const float *positions, const unsigned *indices, size_t triangles,
                                 const float rotation[9], const float position[3], float scale)
{
    static const float none[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    size_t t;
    int j, k;
    if (!rotation) rotation = none;
    if (s->count + (int)triangles > s->capacity) {
        s->capacity = 2 * s->capacity + (int)triangles;
        s->corner = (double (*)[3][3])realloc(s->corner, (size_t)s->capacity * sizeof *s->corner);
    }
    for (t = 0; t < triangles; t++, s->count++)
        for (j = 0; j < 3; j++) {
            const float *v = positions + 3 * (size_t)indices[3 * t + (size_t)j];
            for (k = 0; k < 3; k++)
                s->corner[s->count][j][k] =
                    (double)position[k] + (double)scale * ((double)rotation[3 * k] * (double)v[0] +
                                                           (double)rotation[3 * k + 1] * (double)v[1] +
                                                           (double)rotation[3 * k + 2] * (double)v[2]);
        }
}

static inline void reference_split(reference_scene *s, int node, int first, int count)
{
    reference_node *n = &s->nodes[node];
    int i, j, k, axis = 0, middle = first;
    double cut;
    for (k = 0; k < 3; k++) n->low[k] = 1e300, n->high[k] = -1e300;
    for (i = first; i < first + count; i++)
        for (j = 0; j < 3; j++)
            for (k = 0; k < 3; k++) {
                double v = s->corner[i][j][k];
                if (v < n->low[k]) n->low[k] = v;
                if (v > n->high[k]) n->high[k] = v;
            }
    for (k = 1; k < 3; k++)
        if (n->high[k] - n->low[k] > n->high[axis] - n->low[axis]) axis = k;
    n->first = first;
    n->count = count;
    if (count <= 4) return;
    cut = 0.5 * (n->low[axis] + n->high[axis]);
    for (i = first; i < first + count; i++) {
        double mean = (s->corner[i][0][axis] + s->corner[i][1][axis] + s->corner[i][2][axis]) / 3, swap[3][3];
        if (mean > cut) continue;
        memcpy(swap, s->corner[i], sizeof swap);
        memcpy(s->corner[i], s->corner[middle], sizeof swap);
        memcpy(s->corner[middle++], swap, sizeof swap);
    }
    if (middle == first || middle == first + count) middle = first + count / 2;
    n->count = 0;
    i = s->node_count++;
    reference_split(s, i, first, middle - first);
    n->right = s->node_count++;
    reference_split(s, n->right, middle, first + count - middle);
}

static inline void reference_build(reference_scene *s)
{
    free(s->nodes);
    s->nodes = (reference_node *)calloc((size_t)(2 * s->count + 1), sizeof *s->nodes);
    s->node_count = 1;
    reference_split(s, 0, 0, s->count);
}

static inline void reference_free(reference_scene *s)
{
    free(s->corner);
    free(s->nodes);
    memset(s, 0, sizeof *s);
}

static inline void reference_cross(double out[3], const double a[3], const double b[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1], out[1] = a[2] * b[0] - a[0] * b[2], out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline double reference_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void reference_minus(double out[3], const double a[3], const double b[3])
{
    out[0] = a[0] - b[0], out[1] = a[1] - b[1], out[2] = a[2] - b[2];
}

static inline int reference_hits(double p[3][3], const double origin[3], const double d[3])
{
    double a[3], b[3], o[3], q[3], r[3], det, u, v;
    reference_minus(a, p[1], p[0]), reference_minus(b, p[2], p[0]), reference_minus(o, origin, p[0]);
    reference_cross(q, d, b);
    det = reference_dot(a, q);
    if (det == 0) return 0;
    u = reference_dot(o, q) / det;
    if (!(u >= 0 && u <= 1)) return 0;
    reference_cross(r, o, a);
    v = reference_dot(d, r) / det;
    if (!(v >= 0 && u + v <= 1)) return 0;
    return reference_dot(b, r) / det > 0;
}

/* Cuts the span of a ray by one axis of a box: `low` and `high` from the origin, `inverse` 1 / d, 0 for a d of 0. */
static inline void reference_slab(double span[2], double low, double high, double inverse)
{
    double a = low * inverse, b = high * inverse, first = a < b ? a : b, end = a < b ? b : a;
    if (inverse == 0) {
        if (low > 0 || high < 0) span[0] = 1e301;
        return;
    }
    span[0] = first > span[0] ? first : span[0];
    span[1] = end < span[1] ? end : span[1];
}

static inline int reference_enters(const reference_node *n, const double o[3], const double inverse[3])
{
    double span[2] = {0, 1e300};
    reference_slab(span, n->low[0] - o[0], n->high[0] - o[0], inverse[0]);
    reference_slab(span, n->low[1] - o[1], n->high[1] - o[1], inverse[1]);
    reference_slab(span, n->low[2] - o[2], n->high[2] - o[2], inverse[2]);
    return span[0] <= span[1] * (1 + 1e-12) + 1e-12;
}

/* 1 when the ray meets a triangle in front of its origin. *last (may be NULL) is the triangle that the ray before met,
   or -1: its neighbour most often meets the same. */
static inline int reference_occluded_near(const reference_scene *s, int *last, const double origin[3],
                                          const double d[3])
{
    double inverse[3];
    int stack[64], depth = 0, k, i;
    if (s->count == 0) return 0;
    if (last && *last >= 0 && reference_hits(s->corner[*last], origin, d)) return 1;
    for (k = 0; k < 3; k++) inverse[k] = d[k] == 0 ? 0 : 1 / d[k];
    stack[depth++] = 0;
    while (depth) {
        const reference_node *n = &s->nodes[stack[--depth]];
        if (!reference_enters(n, origin, inverse)) continue;
        if (n->count == 0) {
            stack[depth++] = n->right;
            stack[depth++] = (int)(n - s->nodes) + 1;
            continue;
        }
        for (i = n->first; i < n->first + n->count; i++)
            if (reference_hits(s->corner[i], origin, d)) {
                if (last) *last = i;
                return 1;
            }
    }
    return 0;
}

static inline int reference_occluded(const reference_scene *s, const double origin[3], const double d[3])
{
    return reference_occluded_near(s, NULL, origin, d);
}

/* Eq 6 over the M lights of an environment that the point sees. */
static inline void reference_irradiance(double rgb[3], const reference_scene *s, const float *directions,
                                        const float *powers, size_t lights, const float point[3], const float normal[3])
{
    double o[3] = {(double)point[0], (double)point[1], (double)point[2]};
    int last = -1;
    size_t i;
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (i = 0; i < lights; i++) {
        const float *w = directions + 3 * i, *p = powers + 3 * i;
        double d[3] = {(double)w[0], (double)w[1], (double)w[2]};
        double cosine = d[0] * (double)normal[0] + d[1] * (double)normal[1] + d[2] * (double)normal[2];
        if (!(cosine > 0) || (p[0] == 0 && p[1] == 0 && p[2] == 0)) continue;
        if (s && reference_occluded_near(s, &last, o, d)) continue;
        rgb[0] += (double)p[0] * cosine, rgb[1] += (double)p[1] * cosine, rgb[2] += (double)p[2] * cosine;
    }
}

/* NRMSE (Michael 2010, eq 17): mean over the channels of rms difference over the range of both pictures. */
static inline double reference_nrmse(const float *a, const float *b, size_t pixels)
{
    double sum = 0;
    size_t i;
    int c;
    for (c = 0; c < 3; c++) {
        double square = 0, low = 1e300, high = -1e300;
        for (i = 0; i < pixels; i++) {
            double x = (double)a[3 * i + (size_t)c], y = (double)b[3 * i + (size_t)c];
            square += (x - y) * (x - y);
            low = x < low ? x : low, low = y < low ? y : low;
            high = x > high ? x : high, high = y > high ? y : high;
        }
        sum += high > low ? sqrt(square / (double)pixels) / (high - low) : square > 0 ? 1.0 : 0.0;
    }
    return sum / 3;
}

#ifdef HAVE_EMBREE

static inline void reference_build_embree(reference_scene *s)
{
    RTCGeometry g;
    float *vertex;
    unsigned *index;
    int i, j, k;
    s->device = rtcNewDevice("threads=1");
    s->embree = rtcNewScene(s->device);
    rtcSetSceneFlags(s->embree, RTC_SCENE_FLAG_ROBUST);
    g = rtcNewGeometry(s->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    vertex =
        (float *)rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, (size_t)s->count * 3);
    index = (unsigned *)rtcSetNewGeometryBuffer(g, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, (size_t)s->count);
    for (i = 0; i < s->count; i++)
        for (j = 0; j < 3; j++) {
            for (k = 0; k < 3; k++) vertex[9 * i + 3 * j + k] = (float)s->corner[i][j][k];
            index[3 * i + j] = (unsigned)(3 * i + j);
        }
    rtcCommitGeometry(g);
    rtcAttachGeometry(s->embree, g);
    rtcReleaseGeometry(g);
    rtcCommitScene(s->embree);
}

/* covered[i] = 1 where ray i meets the scene; only rays with wanted[i] are traced. Lights come in order, eight at a
   time. */
static inline void reference_trace(unsigned char *covered, const reference_scene *s, const float *directions,
                                   size_t lights, const float point[3], const unsigned char *wanted)
{
    struct RTCIntersectContext context;
    size_t i;
    int j;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (i = 0; i < lights; i += 8) {
        struct RTCRay8 ray;
        int __attribute__((aligned(32))) valid[8];
        int any = 0;
        for (j = 0; j < 8; j++) {
            size_t n = i + (size_t)j < lights ? i + (size_t)j : lights - 1;
            valid[j] = i + (size_t)j < lights && wanted[n] ? -1 : 0;
            any |= valid[j];
            covered[n] = 0;
            ray.org_x[j] = point[0], ray.org_y[j] = point[1], ray.org_z[j] = point[2];
            ray.dir_x[j] = directions[3 * n], ray.dir_y[j] = directions[3 * n + 1],
            ray.dir_z[j] = directions[3 * n + 2];
            ray.tnear[j] = 0, ray.tfar[j] = 1e30f, ray.time[j] = 0;
            ray.mask[j] = 0xffffffffu, ray.flags[j] = 0, ray.id[j] = 0;
        }
        if (!any) continue;
        rtcOccluded8(valid, s->embree, &context, &ray);
        for (j = 0; j < 8 && i + (size_t)j < lights; j++) covered[i + (size_t)j] = valid[j] && ray.tfar[j] < 0;
    }
}

#endif /* HAVE_EMBREE */

/* ---- meshes without files */

typedef struct reference_mesh { float *positions; unsigned *indices; size_t vertices, triangles; } reference_mesh;

static inline void reference_mesh_free(reference_mesh *m)
{
    free(m->positions);
    free(m->indices);
    memset(m, 0, sizeof *m);
}

/* A closed torus knot or torus: tube of radius r around a curve that winds p times around and q times through. */
static inline reference_mesh reference_knot(int p, int q, int along, int around, double r)
{
    reference_mesh m;
    int i, j, k;
    m.vertices = (size_t)(along * around);
    m.triangles = 2 * m.vertices;
    m.positions = (float *)malloc(3 * m.vertices * sizeof *m.positions);
    m.indices = (unsigned *)malloc(3 * m.triangles * sizeof *m.indices);
    for (i = 0; i < along; i++) {
        double t = 6.283185307179586 * i / along, centre[3], next[3], side[3], up[3], tangent[3], length = 0;
        for (k = 0; k < 2; k++) {
            double s = t + k * 1e-4, ring = 1 + (q ? 0.4 * cos(q * s) : 0), *c = k ? next : centre;
            c[0] = ring * cos(p * s), c[1] = q ? 0.4 * sin(q * s) : 0, c[2] = ring * sin(p * s);
        }
        for (k = 0; k < 3; k++) tangent[k] = next[k] - centre[k], length += tangent[k] * tangent[k];
        for (k = 0; k < 3; k++) tangent[k] /= sqrt(length);
        side[0] = -tangent[2], side[1] = 0, side[2] = tangent[0];
        length = sqrt(side[0] * side[0] + side[2] * side[2]);
        side[0] /= length, side[2] /= length;
        for (k = 0; k < 3; k++)
            up[k] = tangent[(k + 1) % 3] * side[(k + 2) % 3] - tangent[(k + 2) % 3] * side[(k + 1) % 3];
        for (j = 0; j < around; j++) {
            double a = 6.283185307179586 * j / around;
            for (k = 0; k < 3; k++)
                m.positions[3 * (i * around + j) + k] = (float)(centre[k] + r * (cos(a) * side[k] + sin(a) * up[k]));
        }
    }
    for (i = 0; i < along; i++)
        for (j = 0; j < around; j++) {
            unsigned a = (unsigned)(i * around + j), b = (unsigned)(i * around + (j + 1) % around);
            unsigned c = (unsigned)((i + 1) % along * around + j),
                     d = (unsigned)((i + 1) % along * around + (j + 1) % around);
            unsigned *t = m.indices + 6 * a;
            t[0] = a, t[1] = b, t[2] = c, t[3] = b, t[4] = d, t[5] = c;
        }
    return m;
}

/* A box from -x,-y,-z to x,y,z: 12 triangles, counter-clockwise from outside. */
static inline reference_mesh reference_box(float x, float y, float z)
{
    static const unsigned index[36] = {0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5, 0, 1, 5, 0, 5, 4,
                                       2, 6, 7, 2, 7, 3, 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};
    reference_mesh m;
    int i;
    m.vertices = 8;
    m.triangles = 12;
    m.positions = (float *)malloc(24 * sizeof(float));
    m.indices = (unsigned *)malloc(sizeof index);
    memcpy(m.indices, index, sizeof index);
    for (i = 0; i < 8; i++) {
        m.positions[3 * i] = i & 1 ? x : -x;
        m.positions[3 * i + 1] = i & 2 ? y : -y;
        m.positions[3 * i + 2] = i & 4 ? z : -z;
    }
    return m;
}

#endif /* REFERENCE_FIV_H */
