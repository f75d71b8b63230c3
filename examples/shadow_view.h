/* shadow_view.h - what fiv_shadows has before fiv.h is asked: meshes that stand on the ground, and for each pixel the
   point that it shows.                                                SPDX-License-Identifier: MIT-0 OR Unlicense */

#ifndef SHADOW_VIEW_H
#define SHADOW_VIEW_H

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

static inline int fail(const char *text)
{
    fprintf(stderr, "fiv_shadows: %s\n", text);
    exit(1);
}

static inline void check(sat_result result, const char *what)
{
    if (result) fprintf(stderr, "%s: ", what), fail(sat_result_text(result));
}

/* ---- meshes ---- */

/* Vertex normals: the mean of the triangles, weighted by area. */
static inline void make_normals(object *o)
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
static inline void turn_outwards(object *o)
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

static inline void open_object(object *o, const char *path, int second)
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

static inline void turn_about(float m[9], int axis, float degrees)
{
    float a = degrees * 3.14159265f / 180, c = cosf(a), s = sinf(a);
    int i = (axis + 1) % 3, j = (axis + 2) % 3;
    memset(m, 0, 9 * sizeof *m);
    m[4 * axis] = 1, m[4 * i] = m[4 * j] = c;
    m[3 * i + j] = -s, m[3 * j + i] = s;
}

/* Stands the object, of radius 1, on the ground at x, z. */
static inline void place(object *o, float x, float z)
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

static inline void look(view *v)
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

static inline void pixel_ray(float d[3], const view *v, int x, int y)
{
    float s = 2 * 0.30f / (float)v->height, a = ((float)x + 0.5f - 0.5f * (float)v->width) * s,
          b = (0.5f * (float)v->height - (float)y - 0.5f) * s;
    int k;
    for (k = 0; k < 3; ++k) d[k] = v->axes[2][k] + a * v->axes[0][k] + b * v->axes[1][k];
}

static inline void draw_ground(view *v)
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

static inline void draw_triangle(view *v, float p[3][3], float n[3][3], unsigned char what)
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

static inline void draw_object(view *v, const object *o, unsigned char what)
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

#endif
