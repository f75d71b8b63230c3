/* reference_ssao.h - what ssao_sat.h is measured against: G-buffers of triangle scenes with ray-traced ambient
   occlusion, and the usual screen-space methods (16 samples, HBAO, GTAO).
   SPDX-License-Identifier: MIT-0 OR Unlicense

   The pictures are linear depths (infinity: sky), view-space normals (OpenGL's axes) and, for each radius, the share of
   cosine- weighted rays that meet nothing within it, and the mean free direction. Include support.h and mesh.h
   first. */

#ifndef REFERENCE_SSAO_H
#define REFERENCE_SSAO_H

typedef struct ref_vec { float x, y, z; } ref_vec;
static inline ref_vec ref_make(float x, float y, float z) { ref_vec r; r.x = x; r.y = y; r.z = z; return r; }
static inline ref_vec ref_add(ref_vec a, ref_vec b) { return ref_make(a.x + b.x, a.y + b.y, a.z + b.z); }
static inline ref_vec ref_sub(ref_vec a, ref_vec b) { return ref_make(a.x - b.x, a.y - b.y, a.z - b.z); }
static inline ref_vec ref_scale(ref_vec a, float s) { return ref_make(a.x * s, a.y * s, a.z * s); }
static inline float ref_dot(ref_vec a, ref_vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline ref_vec ref_cross(ref_vec a, ref_vec b)
{
    return ref_make(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
}
static inline ref_vec ref_unit(ref_vec a) { return ref_scale(a, 1 / sqrtf(ref_dot(a, a) + 1e-30f)); }
static inline float ref_clamp(float v, float low, float high) { return v < low ? low : v > high ? high : v; }

/* ---- scenes ---- */

typedef struct ref_node { float low[3], high[3]; int first, count; } ref_node; /* count 0: children first, first + 1 */

typedef struct ref_scene {
    mesh m;
    int smooth;          /* triangles below this index have interpolated normals */
    ref_vec *normals;    /* of vertices */
    ref_node *nodes;
    int *order, node_count;
    ref_vec eye, at;
} ref_scene;

static inline ref_vec ref_vertex(const ref_scene *s, int i)
{
    const float *p = s->m.positions + 3 * (size_t)i;
    return ref_make(p[0], p[1], p[2]);
}

static inline int ref_add_vertex(ref_scene *s, ref_vec p)
{
    double xyz[3];
    xyz[0] = (double)p.x; xyz[1] = (double)p.y; xyz[2] = (double)p.z;
    mesh_add_vertex(&s->m, xyz);
    return s->m.vertex_count - 1;
}

static inline void ref_quad(ref_scene *s, ref_vec a, ref_vec b, ref_vec c, ref_vec d)
{
    int i = ref_add_vertex(s, a), j = ref_add_vertex(s, b), k = ref_add_vertex(s, c), l = ref_add_vertex(s, d);
    mesh_add_triangle(&s->m, i, j, k);
    mesh_add_triangle(&s->m, i, k, l);
}

static inline void ref_box(ref_scene *s, float x0, float y0, float z0, float x1, float y1, float z1)
{
    static const int face[6][4] = {{0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    ref_vec c[8];
    int i;
    for (i = 0; i < 8; i++) c[i] = ref_make(i & 1 ? x1 : x0, i & 2 ? y1 : y0, i & 4 ? z1 : z0);
    for (i = 0; i < 6; i++) ref_quad(s, c[face[i][0]], c[face[i][1]], c[face[i][2]], c[face[i][3]]);
}

/* A tube along a (2, 3) torus knot of height about 0.7: what stands for a mesh where there is none. */
static inline void ref_knot(ref_scene *s, float scale, ref_vec at, float turn)
{
    enum { ALONG = 160, AROUND = 16 };
    int base = s->m.vertex_count, i, j;
    for (i = 0; i < ALONG; i++) {
        ref_vec p[2], t, u, v;
        for (j = 0; j < 2; j++) {
            float a = 6.2831853f * (float)(2 * i + j) / (2 * ALONG), r = 2 + cosf(3 * a);
            p[j] = ref_make(r * cosf(2 * a + turn), r * sinf(2 * a + turn), -sinf(3 * a));
        }
        t = ref_unit(ref_sub(p[1], p[0]));
        u = ref_unit(ref_cross(t, ref_make(0, 0, 1)));
        v = ref_cross(t, u);
        for (j = 0; j < AROUND; j++) {
            float a = 6.2831853f * (float)j / AROUND;
            ref_vec q = ref_add(p[0], ref_add(ref_scale(u, 0.45f * cosf(a)), ref_scale(v, 0.45f * sinf(a))));
            ref_add_vertex(s, ref_add(at, ref_scale(ref_add(q, ref_make(0, 3.2f, 0)), 0.11f * scale)));
        }
    }
    for (i = 0; i < ALONG; i++)
        for (j = 0; j < AROUND; j++) {
            int a = base + i * AROUND + j, b = base + i * AROUND + (j + 1) % AROUND;
            int c = base + (i + 1) % ALONG * AROUND + j, d = base + (i + 1) % ALONG * AROUND + (j + 1) % AROUND;
            mesh_add_triangle(&s->m, a, c, b);
            mesh_add_triangle(&s->m, b, c, d);
        }
}

/* A mesh, scaled and turned, standing on the y of its place. */
static inline void ref_add_mesh(ref_scene *s, const mesh *m, float scale, ref_vec at, float turn)
{
    ref_vec centre = ref_make(0, 0, 0);
    float lowest = 1e30f;
    int i, base = s->m.vertex_count;
    for (i = 0; i < m->vertex_count; i++) {
        const float *p = m->positions + 3 * (size_t)i;
        centre = ref_add(centre, ref_scale(ref_make(p[0], p[1], p[2]), 1 / (float)m->vertex_count));
        if (p[1] < lowest) lowest = p[1];
    }
    for (i = 0; i < m->vertex_count; i++) {
        const float *p = m->positions + 3 * (size_t)i;
        float x = (p[0] - centre.x) * scale, y = (p[1] - lowest) * scale, z = (p[2] - centre.z) * scale;
        ref_add_vertex(s, ref_add(at, ref_make(cosf(turn) * x + sinf(turn) * z, y, -sinf(turn) * x + cosf(turn) * z)));
    }
    for (i = 0; i < m->triangle_count; i++)
        mesh_add_triangle(&s->m, base + m->indices[3 * i], base + m->indices[3 * i + 1], base + m->indices[3 * i + 2]);
}

/* The mesh of a data file, or a knot when it is not there. */
static inline void ref_object(ref_scene *s, const char *file, float scale, ref_vec at, float turn)
{
    mesh m;
    const char *path = support_data(file);
    memset(&m, 0, sizeof m);
    if (!path || !mesh_load(&m, path)) {
        ref_knot(s, scale > 1 ? scale / 5 : 1, at, turn);
        return;
    }
    ref_add_mesh(s, &m, scale, at, turn);
    mesh_free(&m);
}

/* 0: a figure in a corner of walls with a box. */
static inline void ref_corner(ref_scene *s)
{
    ref_object(s, "mesh/dragon_res4.ply", 5, ref_make(0, 0, 0), 0.4f);
    s->smooth = s->m.triangle_count;
    ref_quad(s, ref_make(-3, 0, -1), ref_make(3, 0, -1), ref_make(3, 0, 4), ref_make(-3, 0, 4));
    ref_quad(s, ref_make(-3, 0, -0.7f), ref_make(3, 0, -0.7f), ref_make(3, 4, -0.7f), ref_make(-3, 4, -0.7f));
    ref_quad(s, ref_make(-1, 0, -3), ref_make(-1, 4, -3), ref_make(-1, 4, 4), ref_make(-1, 0, 4));
    ref_box(s, 0.6f, 0, -0.5f, 1, 0.5f, -0.1f);
    s->eye = ref_make(0.6f, 1.3f, 2.4f);
    s->at = ref_make(0, 0.35f, 0);
}

/* 1: a room with boxes, stairs, nine thin poles under a rail, a tall pole, open sky on the right. */
static inline void ref_room(ref_scene *s)
{
    int i;
    ref_quad(s, ref_make(-3, 0, -3), ref_make(6, 0, -3), ref_make(6, 0, 5), ref_make(-3, 0, 5));
    ref_quad(s, ref_make(-3, 0, -1.5f), ref_make(0.7f, 0, -1.5f), ref_make(0.7f, 2, -1.5f), ref_make(-3, 2, -1.5f));
    ref_quad(s, ref_make(-1.5f, 0, -3), ref_make(-1.5f, 4, -3), ref_make(-1.5f, 4, 5), ref_make(-1.5f, 0, 5));
    ref_box(s, -1, 0, -1, -0.3f, 0.7f, -0.3f);
    ref_box(s, -0.2f, 0, 0.2f, 0.3f, 0.3f, 0.7f);
    ref_box(s, 0.5f, 0, -0.8f, 1, 1.2f, -0.3f);
    ref_box(s, 0.45f, 1.2f, -0.9f, 1.1f, 1.3f, -0.2f);
    for (i = 0; i < 9; i++) {
        float x = -1.2f + 0.28f * (float)i;
        ref_box(s, x, 0, 0.9f, x + 0.02f, 0.6f, 0.92f);
    }
    ref_box(s, -1.25f, 0.6f, 0.88f, 1.2f, 0.63f, 0.94f);
    ref_box(s, 1.4f, 0, 0.2f, 1.44f, 2.6f, 0.24f);
    for (i = 0; i < 6; i++)
        ref_box(s, -0.3f, 0.08f * (float)i, -1.4f, 0.4f, 0.08f * (float)(i + 1), -0.9f - 0.08f * (float)i);
    s->eye = ref_make(0.4f, 1.6f, 3.6f);
    s->at = ref_make(0, 0.5f, 0);
}

/* 2: three figures on a long ground under the sky. */
static inline void ref_field(ref_scene *s)
{
    ref_object(s, "mesh/dragon_res4.ply", 5, ref_make(0, 0, 0), -0.9f);
    ref_object(s, "mesh/dragon_res4.ply", 3.5f, ref_make(-1, 0, -1.4f), 1.6f);
    ref_object(s, "mesh/dragon_res4.ply", 5, ref_make(1.1f, 0, -2.6f), 2.4f);
    s->smooth = s->m.triangle_count;
    ref_quad(s, ref_make(-20, 0, -30), ref_make(20, 0, -30), ref_make(20, 0, 4), ref_make(-20, 0, 4));
    s->eye = ref_make(0.2f, 0.7f, 1.9f);
    s->at = ref_make(0, 0.35f, 0);
}

/* 3: other objects than those of 0 to 2, for parameters that were not fitted to them: two bunnies and a knot on a table
   before a wall. */
static inline void ref_table(ref_scene *s)
{
    ref_object(s, "mesh/bunny_small.ply", 0.09f, ref_make(-0.45f, 0.05f, 0), 0.3f);
    ref_object(s, "mesh/bunny_small.ply", 0.06f, ref_make(0.75f, 0.05f, 0.35f), 2.2f);
    ref_knot(s, 1, ref_make(0.5f, 0.05f, -0.45f), 0.5f);
    s->smooth = s->m.triangle_count;
    ref_box(s, -1.3f, -0.05f, -0.9f, 1.3f, 0.05f, 0.9f);
    ref_box(s, -1.25f, -1, 0.8f, -1.15f, -0.05f, 0.9f);
    ref_box(s, 1.15f, -1, 0.8f, 1.25f, -0.05f, 0.9f);
    ref_quad(s, ref_make(-4, -1, -1.4f), ref_make(4, -1, -1.4f), ref_make(4, -1, 4), ref_make(-4, -1, 4));
    ref_quad(s, ref_make(-4, -1, -1.2f), ref_make(1, -1, -1.2f), ref_make(1, 1.2f, -1.2f), ref_make(-4, 1.2f, -1.2f));
    s->eye = ref_make(0.9f, 1.1f, 2.6f);
    s->at = ref_make(0, 0.1f, 0);
}

/* The same numbers every time, 0..1. */
static inline float ref_random(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (float)(*state >> 8) / 16777216;
}

/* 4: 1500 blades of grass, poles 1.2 cm thick under a rail, a box: what is thinner than a pixel or a cell. */
static inline void ref_grass(ref_scene *s)
{
    uint32_t state = 777;
    int i;
    ref_quad(s, ref_make(-12, 0, -20), ref_make(12, 0, -20), ref_make(12, 0, 5), ref_make(-12, 0, 5));
    for (i = 0; i < 1500; i++) {
        float x = -2.2f + 4.4f * ref_random(&state), z = -4.5f + 5.4f * ref_random(&state),
              tall = 0.12f + 0.28f * ref_random(&state);
        float w = 0.006f + 0.008f * ref_random(&state), turn = 6.28f * ref_random(&state),
              lean = 0.12f * (ref_random(&state) - 0.5f);
        int a = ref_add_vertex(s, ref_make(x - w * cosf(turn), 0, z - w * sinf(turn)));
        int b = ref_add_vertex(s, ref_make(x + w * cosf(turn), 0, z + w * sinf(turn)));
        mesh_add_triangle(&s->m, a, b, ref_add_vertex(s, ref_make(x + lean, tall, z - 0.7f * lean)));
    }
    for (i = 0; i < 14; i++) {
        float x = -2 + 4 * ref_random(&state), z = -4 + 4.3f * ref_random(&state);
        ref_box(s, x, 0, z, x + 0.012f, 0.9f + 0.6f * ref_random(&state), z + 0.012f);
    }
    ref_box(s, -3, 0.55f, -2, 3, 0.57f, -1.98f);
    ref_box(s, -0.6f, 0, -1.4f, 0.1f, 0.45f, -0.9f);
    s->eye = ref_make(0.1f, 0.75f, 2.2f);
    s->at = ref_make(0, 0.25f, -0.6f);
}

/* 5: a hall of 40 m with columns, beams, chairs, and a rail close to the eye: far and near at once. */
static inline void ref_hall(ref_scene *s)
{
    int i, j;
    ref_box(s, -3.1f, -0.1f, -40, 3.1f, 0, 4);
    ref_box(s, -3.1f, 5, -40, 3.1f, 5.1f, 4);
    ref_box(s, -3.1f, 0, -40, -3, 5, 4);
    ref_box(s, 3, 0, -40, 3.1f, 5, 4);
    ref_box(s, -3.1f, 0, -40.1f, 3.1f, 5, -40);
    for (i = 0; i < 14; i++) {
        float z = 0.2f - 2.8f * (float)i;
        for (j = 0; j < 2; j++) {
            float x = j ? 1.9f : -2.2f;
            ref_box(s, x, 0, z, x + 0.3f, 4.4f, z + 0.3f);
            ref_box(s, x - 0.1f, 0, z - 0.1f, x + 0.4f, 0.2f, z + 0.4f);
            ref_box(s, x - 0.12f, 4.2f, z - 0.12f, x + 0.42f, 4.5f, z + 0.42f);
        }
        ref_box(s, -3, 4.5f, z - 0.05f, 3, 5, z + 0.35f);
    }
    for (i = 0; i < 8; i++) {
        float z = 0.1f - 0.9f * (float)i;
        ref_box(s, -1.4f, 0.42f, z, -0.4f, 0.46f, z + 0.35f);
        ref_box(s, -1.35f, 0, z + 0.05f, -1.3f, 0.42f, z + 0.3f);
        ref_box(s, -0.5f, 0, z + 0.05f, -0.45f, 0.42f, z + 0.3f);
        ref_box(s, -1.4f, 0.46f, z, -0.4f, 0.9f, z + 0.04f);
    }
    ref_box(s, -1.5f, 1.02f, 2.55f, 3, 1.06f, 2.6f);
    for (i = 0; i < 9; i++) ref_box(s, -1 + 0.4f * (float)i, 0, 2.56f, -0.985f + 0.4f * (float)i, 1.02f, 2.575f);
    s->eye = ref_make(0.2f, 1.5f, 3.6f);
    s->at = ref_make(0, 1.25f, -6);
}

/* 6: for fits alone, so that 3 to 5 stay what nothing was fitted to: posts, a fence and wires of 1 to 6 cm before a
   wall and on open ground, leaves in the air, steps, a knot. */
static inline void ref_yard(ref_scene *s)
{
    uint32_t state = 4242;
    int i;
    ref_knot(s, 1.2f, ref_make(-0.9f, 0, 0.5f), 1.1f);
    s->smooth = s->m.triangle_count;
    ref_quad(s, ref_make(-9, 0, -14), ref_make(9, 0, -14), ref_make(9, 0, 5), ref_make(-9, 0, 5));
    ref_box(s, -3, 0, -1.7f, 0.4f, 1.4f, -1.5f);
    ref_box(s, -3, 0, -1.5f, -2.8f, 1.4f, 2);
    for (i = 0; i < 24; i++) {
        float x = -2.6f + 5.2f * ref_random(&state), z = -3.5f + 4.2f * ref_random(&state),
              w = 0.01f + 0.05f * ref_random(&state) * ref_random(&state);
        ref_box(s, x, 0, z, x + w, 0.3f + 1.2f * ref_random(&state), z + w);
    }
    for (i = 0; i < 12; i++) ref_box(s, 0.5f + 0.16f * (float)i, 0, -0.9f, 0.53f + 0.16f * (float)i, 0.55f, -0.88f);
    ref_box(s, 0.45f, 0.4f, -0.88f, 2.4f, 0.44f, -0.86f);
    ref_box(s, -2.8f, 1, -1.2f, 3, 1.012f, -1.188f);
    for (i = 0; i < 260; i++) {
        ref_vec at = ref_make(-0.2f + 1.6f * ref_random(&state), 0.25f + 0.8f * ref_random(&state),
                              -0.6f + 0.9f * ref_random(&state)),
                a = ref_make(ref_random(&state) - 0.5f, ref_random(&state) - 0.5f, ref_random(&state) - 0.5f),
                b = ref_make(ref_random(&state) - 0.5f, ref_random(&state) - 0.5f, ref_random(&state) - 0.5f);
        int u = ref_add_vertex(s, at), v = ref_add_vertex(s, ref_add(at, ref_scale(a, 0.12f)));
        mesh_add_triangle(&s->m, u, v, ref_add_vertex(s, ref_add(at, ref_scale(b, 0.12f))));
    }
    for (i = 0; i < 4; i++)
        ref_box(s, -0.6f, 0.09f * (float)i, -1.5f, 0.2f, 0.09f * (float)(i + 1), -1.1f - 0.1f * (float)i);
    s->eye = ref_make(0.5f, 1.1f, 2.8f);
    s->at = ref_make(-0.1f, 0.35f, -0.4f);
}

enum { REF_SCENES = 6, REF_YARD = 6, REF_ALL_SCENES }; /* those of the bench; and for the fit alone */

/* ---- rays: a hierarchy of boxes, split at the middle of the longest side ---- */

static inline void ref_bound(const ref_scene *s, ref_node *n, int first, int end)
{
    int i, j, k;
    for (k = 0; k < 3; k++) { n->low[k] = 1e30f; n->high[k] = -1e30f; }
    for (i = first; i < end; i++)
        for (j = 0; j < 3; j++)
            for (k = 0; k < 3; k++) {
                float v = s->m.positions[3 * (size_t)s->m.indices[3 * s->order[i] + j] + (size_t)k];
                if (v < n->low[k]) n->low[k] = v;
                if (v > n->high[k]) n->high[k] = v;
            }
}

static inline float ref_middle(const ref_scene *s, int triangle, int axis)
{
    const int *v = s->m.indices + 3 * (size_t)triangle;
    const float *p = s->m.positions + axis;
    return (p[3 * (size_t)v[0]] + p[3 * (size_t)v[1]] + p[3 * (size_t)v[2]]) / 3;
}

static inline void ref_split(ref_scene *s, int node, int first, int end, int depth)
{
    ref_node *n = &s->nodes[node];
    int axis = 0, i = first, j = end - 1, child, k;
    float cut;
    ref_bound(s, n, first, end);
    n->first = first;
    n->count = end - first;
    if (end - first <= 4 || depth > 48) return;
    for (k = 1; k < 3; k++)
        if (n->high[k] - n->low[k] > n->high[axis] - n->low[axis]) axis = k;
    cut = 0.5f * (n->low[axis] + n->high[axis]);
    while (i <= j) {
        int t = s->order[i];
        if (ref_middle(s, t, axis) < cut) i++;
        else { s->order[i] = s->order[j]; s->order[j--] = t; }
    }
    if (i == first || i == end) i = (first + end) / 2;
    child = s->node_count;
    s->node_count += 2;
    n->first = child;
    n->count = 0;
    ref_split(s, child, first, i, depth + 1);
    ref_split(s, child + 1, i, end, depth + 1);
}

/* Vertex normals and boxes, when all triangles are there. */
static inline void ref_finish(ref_scene *s)
{
    int i, k, n = s->m.triangle_count;
    s->normals = (ref_vec *)calloc((size_t)s->m.vertex_count, sizeof *s->normals);
    for (i = 0; i < s->smooth; i++) {
        const int *v = s->m.indices + 3 * (size_t)i;
        ref_vec a = ref_vertex(s, v[0]),
                g = ref_cross(ref_sub(ref_vertex(s, v[1]), a), ref_sub(ref_vertex(s, v[2]), a));
        for (k = 0; k < 3; k++) s->normals[v[k]] = ref_add(s->normals[v[k]], g);
    }
    s->order = (int *)malloc((size_t)n * sizeof *s->order);
    s->nodes = (ref_node *)malloc(2 * (size_t)n * sizeof *s->nodes);
    for (i = 0; i < n; i++) s->order[i] = i;
    s->node_count = 1;
    ref_split(s, 0, 0, n, 0);
}

static inline void ref_open(ref_scene *s, int which)
{
    void (*const make[REF_ALL_SCENES])(ref_scene *) = {ref_corner, ref_room, ref_field, ref_table,
                                                       ref_grass,  ref_hall, ref_yard};
    memset(s, 0, sizeof *s);
    make[which](s);
    ref_finish(s);
}

static inline void ref_close(ref_scene *s)
{
    mesh_free(&s->m);
    free(s->normals);
    free(s->order);
    free(s->nodes);
}

static inline int ref_meets_box(const ref_node *n, const float *o, const float *inverse, float limit)
{
    float t0 = 0, t1 = limit;
    int k;
    for (k = 0; k < 3; k++) {
        float a = (n->low[k] - o[k]) * inverse[k], b = (n->high[k] - o[k]) * inverse[k];
        if (a > b) { float c = a; a = b; b = c; }
        if (a > t0) t0 = a;
        if (b < t1) t1 = b;
    }
    return t0 <= t1 * 1.00001f + 1e-6f;
}

/* Nearest triangle within *distance, or -1; u and v are its barycentric coordinates (Moeller and Trumbore 1997). */
static inline int ref_trace(const ref_scene *s, ref_vec o, ref_vec d, float *distance, float *u, float *v)
{
    float origin[3], inverse[3];
    int stack[128], top = 0, hit = -1, i;
    origin[0] = o.x; origin[1] = o.y; origin[2] = o.z;
    inverse[0] = 1 / (d.x == 0 ? 1e-20f : d.x);
    inverse[1] = 1 / (d.y == 0 ? 1e-20f : d.y);
    inverse[2] = 1 / (d.z == 0 ? 1e-20f : d.z);
    stack[top++] = 0;
    while (top) {
        const ref_node *n = &s->nodes[stack[--top]];
        if (!ref_meets_box(n, origin, inverse, *distance)) continue;
        if (n->count == 0) {
            stack[top++] = n->first;
            stack[top++] = n->first + 1;
            continue;
        }
        for (i = n->first; i < n->first + n->count; i++) {
            const int *k = s->m.indices + 3 * (size_t)s->order[i];
            ref_vec a = ref_vertex(s, k[0]), e1 = ref_sub(ref_vertex(s, k[1]), a), e2 = ref_sub(ref_vertex(s, k[2]), a);
            ref_vec p = ref_cross(d, e2), t = ref_sub(o, a), q = ref_cross(t, e1);
            float det = ref_dot(e1, p), b, c, length;
            if (fabsf(det) < 1e-14f) continue;
            b = ref_dot(t, p) / det;
            c = ref_dot(d, q) / det;
            length = ref_dot(e2, q) / det;
            if (b < 0 || c < 0 || b + c > 1 || length < 1e-6f || length >= *distance) continue;
            *distance = length;
            *u = b;
            *v = c;
            hit = s->order[i];
        }
    }
    return hit;
}

/* ---- pictures ---- */

enum { REF_RADII = 3 };

typedef struct ref_picture {
    int width, height, orthographic;
    double fov;                   /* vertical, of the perspective */
    double half_height;           /* of the orthographic view, world units */
    float radius[REF_RADII];
    float *z, *normals, *ao[REF_RADII], *bent[REF_RADII];
} ref_picture;

typedef struct ref_render {
    const ref_scene *scene;
    ref_picture *p;
    ref_vec eye, right, up, forward;
    int rays, every;
} ref_render;

/* Which pixels get rays when it is one of so many pixels of half-size tables, the same for every picture. */
static inline int ref_is_sampled(int x, int y, int every)
{
    uint32_t mixed = (uint32_t)x * 2654435761u ^ (uint32_t)y * 2246822519u;
    return every <= 1 || (x % 2 == 0 && y % 2 == 0 && (mixed ^ mixed >> 15) % 4093u * (uint32_t)every < 4093u);
}

static inline void ref_free(ref_picture *p)
{
    int r;
    free(p->z);
    free(p->normals);
    for (r = 0; r < REF_RADII; r++) { free(p->ao[r]); free(p->bent[r]); }
    memset(p, 0, sizeof *p);
}

/* Stratified cosine-weighted rays; the random numbers depend on the pixel alone. */
static inline void ref_shade(const ref_render *c, size_t at, ref_vec p, ref_vec n)
{
    ref_vec a = ref_unit(ref_cross(fabsf(n.x) > 0.5f ? ref_make(0, 1, 0) : ref_make(1, 0, 0), n)), b = ref_cross(n, a);
    ref_vec open[REF_RADII];
    int side = (int)(sqrtf((float)c->rays) + 0.5f), hits[REF_RADII] = {0}, i, r;
    uint64_t state = (uint64_t)at * 1000003u + 7u;
    memset(open, 0, sizeof open);
    for (i = 0; i < side * side; i++) {
        float u = ((float)(i % side) + (float)support_uniform(&state)) / (float)side;
        float phi = 6.2831853f * ((float)(i / side) + (float)support_uniform(&state)) / (float)side, w = sqrtf(u);
        ref_vec d =
            ref_add(ref_add(ref_scale(a, w * cosf(phi)), ref_scale(b, w * sinf(phi))), ref_scale(n, sqrtf(1 - u)));
        float t = c->p->radius[REF_RADII - 1], x, y;
        int hit = ref_trace(c->scene, p, d, &t, &x, &y) >= 0;
        for (r = 0; r < REF_RADII; r++) {
            if (hit && t < c->p->radius[r]) hits[r]++;
            else open[r] = ref_add(open[r], d);
        }
    }
    for (r = 0; r < REF_RADII; r++) {
        ref_vec m = ref_dot(open[r], open[r]) > 1e-6f ? ref_unit(open[r]) : n;
        c->p->ao[r][at] = 1 - (float)hits[r] / (float)(side * side);
        c->p->bent[r][3 * at] = ref_dot(m, c->right);
        c->p->bent[r][3 * at + 1] = ref_dot(m, c->up);
        c->p->bent[r][3 * at + 2] = -ref_dot(m, c->forward);
    }
}

static inline ref_vec ref_surface_normal(const ref_scene *s, int triangle, float u, float v, ref_vec d, ref_vec *flat)
{
    const int *k = s->m.indices + 3 * (size_t)triangle;
    ref_vec a = ref_vertex(s, k[0]), n;
    *flat = ref_unit(ref_cross(ref_sub(ref_vertex(s, k[1]), a), ref_sub(ref_vertex(s, k[2]), a)));
    if (ref_dot(*flat, d) > 0) *flat = ref_scale(*flat, -1);
    if (triangle >= s->smooth) return *flat;
    n = ref_unit(ref_add(ref_scale(s->normals[k[0]], 1 - u - v),
                         ref_add(ref_scale(s->normals[k[1]], u), ref_scale(s->normals[k[2]], v))));
    if (ref_dot(n, d) > 0) n = ref_scale(n, -1);
    return ref_dot(n, *flat) < 0.2f ? *flat : n;
}

static inline void ref_render_rows(int begin, int end, int worker, void *context)
{
    const ref_render *c = (const ref_render *)context;
    ref_picture *p = c->p;
    int x, y, r;
    (void)worker;
    for (y = begin; y < end; y++)
        for (x = 0; x < p->width; x++) {
            size_t at = (size_t)y * (size_t)p->width + (size_t)x;
            float k = (float)(p->orthographic ? p->half_height : tan(0.5 * p->fov)), t = 1e6f, u = 0, v = 0;
            float sx = (2 * ((float)x + 0.5f) - (float)p->width) / (float)p->height * k,
                  sy = (1 - 2 * ((float)y + 0.5f) / (float)p->height) * k;
            ref_vec offset = ref_add(ref_scale(c->right, sx), ref_scale(c->up, sy)), n, flat;
            ref_vec o = p->orthographic ? ref_add(c->eye, offset) : c->eye,
                    d = p->orthographic ? c->forward : ref_add(c->forward, offset);
            int hit = ref_trace(c->scene, o, d, &t, &u, &v);
            p->z[at] = INFINITY;
            for (r = 0; r < REF_RADII; r++) p->ao[r][at] = 1;
            p->normals[3 * at + 2] = 1;
            if (hit < 0) continue;
            p->z[at] = t; /* d.forward = 1 */
            n = ref_surface_normal(c->scene, hit, u, v, d, &flat);
            p->normals[3 * at] = ref_dot(n, c->right);
            p->normals[3 * at + 1] = ref_dot(n, c->up);
            p->normals[3 * at + 2] = -ref_dot(n, c->forward);
            if (c->rays && ref_is_sampled(x, y, c->every))
                ref_shade(c, at, ref_add(ref_add(o, ref_scale(d, t)), ref_scale(flat, 2e-4f * t)), n);
        }
}

/* rays = 0: depth and normals only; `every`: see ref_is_sampled. `moved` shifts eye and target, for a camera in motion.
   The radii are 0.4, 1 and 2.4 `radius`. */
static inline ref_picture ref_draw_some(const ref_scene *scene, int width, int height, int orthographic, int rays,
                                        ref_vec moved, int workers, float radius, int every)
{
    ref_picture p;
    ref_render c;
    sat_threads threads = support_threads(workers);
    size_t n = (size_t)width * (size_t)height;
    int r;
    memset(&p, 0, sizeof p);
    p.width = width;
    p.height = height;
    p.orthographic = orthographic;
    p.fov = 0.78539816;
    p.z = (float *)malloc(n * 4);
    p.normals = (float *)calloc(n, 12);
    for (r = 0; r < REF_RADII; r++) {
        p.radius[r] = radius * (r == 0 ? 0.4f : r == 1 ? 1 : 2.4f);
        p.ao[r] = (float *)malloc(n * 4);
        p.bent[r] = (float *)calloc(n, 12);
    }
    c.scene = scene;
    c.p = &p;
    c.rays = rays;
    c.every = every;
    c.eye = ref_add(scene->eye, moved);
    c.forward = ref_unit(ref_sub(scene->at, scene->eye));
    c.right = ref_unit(ref_cross(c.forward, ref_make(0, 1, 0)));
    c.up = ref_cross(c.right, c.forward);
    p.half_height =
        tan(0.5 * p.fov) * sqrt((double)ref_dot(ref_sub(scene->at, scene->eye), ref_sub(scene->at, scene->eye)));
    threads.parallel_for(height, ref_render_rows, &c, threads.user);
    return p;
}

static inline ref_picture ref_draw_radii(const ref_scene *scene, int width, int height, int orthographic, int rays,
                                         ref_vec moved, int workers, float radius)
{
    return ref_draw_some(scene, width, height, orthographic, rays, moved, workers, radius, 1);
}

/* Radii 0.1, 0.25 and 0.6 for objects about 0.7 high. */
static inline ref_picture ref_draw(const ref_scene *scene, int width, int height, int orthographic, int rays,
                                   ref_vec moved, int workers)
{
    return ref_draw_radii(scene, width, height, orthographic, rays, moved, workers, 0.25f);
}

/* A picture of a scene that a file in build/ keeps from one run to the next: `reading` or writing it; 0 when that
   fails. */
static inline int ref_keep(ref_picture *p, const char *path, int reading)
{
    FILE *f = fopen(path, reading ? "rb" : "wb");
    size_t n = (size_t)p->width * (size_t)p->height, done = 0;
    int r;
    if (!f) return 0;
    if (reading) {
        done += fread(p->z, 4, n, f) + fread(p->normals, 4, 3 * n, f);
        for (r = 0; r < REF_RADII; r++) done += fread(p->ao[r], 4, n, f) + fread(p->bent[r], 4, 3 * n, f);
    } else {
        done += fwrite(p->z, 4, n, f) + fwrite(p->normals, 4, 3 * n, f);
        for (r = 0; r < REF_RADII; r++) done += fwrite(p->ao[r], 4, n, f) + fwrite(p->bent[r], 4, 3 * n, f);
    }
    r = fclose(f) == 0 && done == n * 4 * (1 + REF_RADII);
    if (!r && !reading) remove(path);
    return r;
}

static inline ref_picture ref_draw_kept(int scene, int side, int rays)
{
    ref_scene s;
    ref_picture p;
    char path[64];
    snprintf(path, sizeof path, "build/ssao_%d_%d_%d.ref", scene, side, rays);
    ref_open(&s, scene);
    p = ref_draw(&s, side, side, 0, 0, ref_make(0, 0, 0), 2);
    if (!ref_keep(&p, path, 1)) {
        ref_free(&p);
        p = ref_draw(&s, side, side, 0, rays, ref_make(0, 0, 0), 2);
        ref_keep(&p, path, 0);
    }
    ref_close(&s);
    return p;
}

/* ---- measures, over what is not sky ---- */

static inline double ref_rmse(const ref_picture *p, const float *a, const float *b)
{
    double sum = 0;
    size_t i, n = (size_t)p->width * (size_t)p->height, count = 0;
    for (i = 0; i < n; i++) {
        if (!(p->z[i] < 1e18f)) continue;
        sum += ((double)a[i] - (double)b[i]) * ((double)a[i] - (double)b[i]);
        count++;
    }
    return sqrt(sum / (double)(count ? count : 1));
}

/* Mean structural similarity of 8 x 8 windows (Wang 2004) that are at least half covered. */
static inline double ref_ssim(const ref_picture *p, const float *a, const float *b)
{
    double total = 0;
    long windows = 0;
    int x, y, i, j;
    for (y = 0; y + 8 <= p->height; y += 4)
        for (x = 0; x + 8 <= p->width; x += 4) {
            double sa = 0, sb = 0, aa = 0, bb = 0, ab = 0, va, vb, c;
            int sky = 0;
            for (j = 0; j < 8; j++)
                for (i = 0; i < 8; i++) {
                    size_t at = (size_t)(y + j) * (size_t)p->width + (size_t)(x + i);
                    double u = (double)a[at], v = (double)b[at];
                    sky += !(p->z[at] < 1e18f);
                    sa += u; sb += v; aa += u * u; bb += v * v; ab += u * v;
                }
            if (sky > 32) continue;
            sa /= 64; sb /= 64;
            va = aa / 64 - sa * sa; vb = bb / 64 - sb * sb; c = ab / 64 - sa * sb;
            total += ((2 * sa * sb + 1e-4) * (2 * c + 9e-4)) / ((sa * sa + sb * sb + 1e-4) * (va + vb + 9e-4));
            windows++;
        }
    return windows ? total / (double)windows : 1;
}

/* ---- the usual methods: plain C, one thread, linear depth, occlusion before gain and power ---- */

typedef struct ref_view { const ref_picture *p; float radius, f, cx, cy; int step; float *out, *other; } ref_view;
typedef struct ref_sample { int x, y; size_t at; float z; ref_vec p, n; } ref_sample; /* y down, z forward */

static inline int ref_load(const ref_view *v, int x, int y, ref_sample *s)
{
    s->x = x;
    s->y = y;
    s->at = (size_t)y * (size_t)v->p->width + (size_t)x;
    s->z = v->p->z[s->at];
    if (!(s->z < 1e18f)) return 0;
    s->p = ref_make(((float)x + 0.5f - v->cx) / v->f * s->z, ((float)y + 0.5f - v->cy) / v->f * s->z, s->z);
    s->n = ref_make(v->p->normals[3 * s->at], -v->p->normals[3 * s->at + 1], -v->p->normals[3 * s->at + 2]);
    return 1;
}

static inline ref_view ref_make_view(const ref_picture *p, float radius, int half, float *out, float *other)
{
    ref_view v;
    v.p = p;
    v.radius = radius;
    v.f = (float)(0.5 * p->height / tan(0.5 * p->fov));
    v.cx = 0.5f * (float)p->width;
    v.cy = 0.5f * (float)p->height;
    v.step = half ? 2 : 1;
    v.out = out;
    v.other = other;
    return v;
}

/* 4 x 4 tile of rotations. */
static inline float ref_noise(int x, int y, int shift)
{
    return (float)((((y & 3) * 4 + (x & 3) + shift) * 7) % 16) / 16;
}

/* Separable blur whose weights fall to 0 at a relative depth difference of `sharp`. */
static inline void ref_blur(const ref_view *v, int radius, float sharp)
{
    int pass, x, y, k, w = v->p->width, h = v->p->height;
    for (pass = 0; pass < 2; pass++) {
        const float *in = pass ? v->other : v->out;
        float *out = pass ? v->out : v->other;
        for (y = 0; y < h; y++)
            for (x = 0; x < w; x++) {
                size_t at = (size_t)y * (size_t)w + (size_t)x;
                float z = v->p->z[at], sum = 0, total = 0;
                out[at] = 0;
                if (!(z < 1e18f)) continue;
                for (k = -radius; k <= radius; k++) {
                    int i = pass ? x : x + k, j = pass ? y + k : y;
                    float d;
                    if (i < 0 || j < 0 || i >= w || j >= h) continue;
                    d = 1 - fabsf(v->p->z[(size_t)j * (size_t)w + (size_t)i] - z) / (z * sharp);
                    if (!(d > 0)) continue;
                    sum += d * in[(size_t)j * (size_t)w + (size_t)i];
                    total += d;
                }
                out[at] = sum / total;
            }
    }
}

/* From every second pixel of every second row: weights by distance to the tangent plane, normals, sky left out. */
static inline void ref_upsample(const ref_view *v, int radius)
{
    int w = v->p->width, h = v->p->height, x, y, i, j;
    memcpy(v->other, v->out, (size_t)w * (size_t)h * sizeof(float));
    for (y = 0; y < h; y++)
        for (x = 0; x < w; x++) {
            ref_sample s, t;
            float sum = 0, total = 1e-6f;
            if (!ref_load(v, x, y, &s)) { v->out[s.at] = 0; continue; }
            for (j = -radius; j <= radius; j++)
                for (i = -radius; i <= radius; i++) {
                    int p = (x & ~1) + 2 * i, q = (y & ~1) + 2 * j;
                    float off, alike, weight;
                    if (p < 0 || q < 0 || p >= w || q >= h || !ref_load(v, p, q, &t)) continue;
                    off = 1 - fabsf(ref_dot(s.n, ref_sub(t.p, s.p))) * 50 / s.z;
                    alike = ref_dot(s.n, t.n);
                    alike = alike > 0 ? alike * alike : 0;
                    weight = (off > 0 ? off : 0) * alike * alike + 1e-4f;
                    if (radius == 1) weight /= 1 + (float)((p - x) * (p - x) + (q - y) * (q - y));
                    sum += weight * v->other[t.at];
                    total += weight;
                }
            v->out[s.at] = sum / total;
        }
}

/* Traditional: 16 points in a hemisphere, range check (Mittring 2007, Filion 2008). parameters: radius, bias */
static inline void ref_ssao(const ref_view *v, const float *parameters)
{
    ref_vec kernel[16];
    uint64_t state = 3;
    int x, y, k;
    for (k = 0; k < 16; k++) {
        float t = (float)(k + 1) / 16;
        kernel[k] = ref_unit(ref_make((float)support_gaussian(&state), (float)support_gaussian(&state),
                                      (float)support_gaussian(&state)));
        kernel[k] = ref_scale(kernel[k], 0.1f + 0.9f * t * t);
    }
    for (y = 0; y < v->p->height; y += v->step)
        for (x = 0; x < v->p->width; x += v->step) {
            ref_sample s;
            float r = v->radius * parameters[0], a, c, d, sum = 0;
            if (!ref_load(v, x, y, &s)) { v->out[s.at] = 0; continue; }
            a = 6.2831853f * ref_noise(x / v->step, y / v->step, 0);
            c = cosf(a);
            d = sinf(a);
            for (k = 0; k < 16; k++) {
                ref_vec o = ref_make(kernel[k].x * c - kernel[k].y * d, kernel[k].x * d + kernel[k].y * c, kernel[k].z),
                        q;
                float z, depth;
                int i, j;
                if (ref_dot(o, s.n) < 0) o = ref_scale(o, -1);
                q = ref_add(s.p, ref_scale(o, r));
                if (q.z <= 1e-3f) continue;
                i = (int)(v->f * q.x / q.z + v->cx);
                j = (int)(v->f * q.y / q.z + v->cy);
                if (i < 0 || j < 0 || i >= v->p->width || j >= v->p->height) continue;
                z = v->p->z[(size_t)j * (size_t)v->p->width + (size_t)i];
                if (!(q.z - z > parameters[1] * r)) continue;
                depth = fabsf(s.z - z) / r;
                sum += depth < 1 ? 1 : 1 / (depth * depth);
            }
            v->out[s.at] = sum / 16;
        }
}

/* Horizon based, 16 directions x 8 steps, attenuation per sample (Bavoil 2008). parameters: radius, tangent bias */
static inline void ref_hbao(const ref_view *v, const float *parameters)
{
    int x, y, k, m;
    for (y = 0; y < v->p->height; y += v->step)
        for (x = 0; x < v->p->width; x += v->step) {
            ref_sample s, t;
            float r = v->radius * parameters[0], turn, jitter, stride, sum = 0;
            if (!ref_load(v, x, y, &s)) { v->out[s.at] = 0; continue; }
            turn = ref_noise(x / v->step, y / v->step, 0);
            jitter = ref_noise(x / v->step, y / v->step, 5);
            stride = ref_clamp(r * v->f / s.z, 1.5f, 400) / 8;
            if (stride < 1) stride = 1;
            for (k = 0; k < 16; k++) {
                float a = ((float)k + turn) * (6.2831853f / 16), dx = cosf(a), dy = sinf(a), top = parameters[1];
                for (m = 0; m < 8; m++) {
                    float at = ((float)m + 0.2f + 0.8f * jitter) * stride + 0.7f, fx = (float)x + 0.5f + dx * at,
                          fy = (float)y + 0.5f + dy * at, square, sine;
                    ref_vec d;
                    if (fx < 0 || fy < 0 || fx >= (float)v->p->width || fy >= (float)v->p->height) break;
                    if (!ref_load(v, (int)fx, (int)fy, &t)) continue;
                    d = ref_sub(t.p, s.p);
                    square = ref_dot(d, d);
                    if (square > r * r) continue;
                    sine = ref_dot(d, s.n) / sqrtf(square + 1e-12f);
                    if (sine <= top) continue;
                    sum += (1 - square / (r * r)) * (sine - top);
                    top = sine;
                }
            }
            v->out[s.at] = sum / 16;
        }
}

typedef struct ref_slice { float angle, cosine, sine, length, low[2]; } ref_slice;

/* acos to 7e-5 (Abramowitz and Stegun 4.4.45) */
static inline float ref_acos(float x)
{
    float a = fabsf(x) > 1 ? 1 : fabsf(x), r = ((-0.0187293f * a + 0.0742610f) * a - 0.2121144f) * a + 1.5707288f;
    r *= sqrtf(1 - a);
    return x < 0 ? 3.14159265f - r : r;
}

static inline ref_slice ref_make_slice(ref_vec view, ref_vec n, float dx, float dy)
{
    ref_slice s;
    ref_vec d = ref_make(dx, dy, 0), o = ref_sub(d, ref_scale(view, ref_dot(d, view))),
            axis = ref_unit(ref_cross(o, view));
    ref_vec projected = ref_sub(n, ref_scale(axis, ref_dot(n, axis)));
    s.length = sqrtf(ref_dot(projected, projected)) + 1e-9f;
    s.cosine = ref_clamp(ref_dot(projected, view) / s.length, -1, 1);
    s.angle = (ref_dot(o, projected) < 0 ? -1.0f : 1.0f) * ref_acos(s.cosine);
    s.sine = sqrtf(1 - s.cosine * s.cosine) * (s.angle < 0 ? -1.0f : 1.0f);
    s.low[0] = -s.sine; /* cos(angle + pi/2) */
    s.low[1] = s.sine;
    return s;
}

/* Jimenez 2016, eq 7 */
static inline float ref_slice_visibility(const ref_slice *s, const float *horizon)
{
    float h0 = -ref_acos(ref_clamp(horizon[1], -1, 1)), h1 = ref_acos(ref_clamp(horizon[0], -1, 1));
    return s->length * 0.25f *
           (2 * s->cosine + 2 * (h0 + h1) * s->sine - cosf(2 * h0 - s->angle) - cosf(2 * h1 - s->angle));
}

/* Ground-truth AO, 3 slices x (3 + 3) samples, squared spacing. parameters: radius, falloff start */
static inline void ref_gtao(const ref_view *v, const float *parameters)
{
    int x, y, k, side, m;
    for (y = 0; y < v->p->height; y += v->step)
        for (x = 0; x < v->p->width; x += v->step) {
            ref_sample s, t;
            ref_vec view;
            float reach = v->radius * parameters[0], r, turn, jitter, visible = 0;
            if (!ref_load(v, x, y, &s)) { v->out[s.at] = 0; continue; }
            view = ref_scale(ref_unit(s.p), -1);
            turn = ref_noise(x / v->step, y / v->step, 0);
            jitter = ref_noise(x / v->step, y / v->step, 5);
            r = ref_clamp(reach * v->f / s.z, 1.5f, 400);
            for (k = 0; k < 3; k++) {
                float a = ((float)k + turn) * (3.14159265f / 3), dx = cosf(a), dy = sinf(a), horizon[2];
                ref_slice slice = ref_make_slice(view, s.n, dx, dy);
                for (side = 0; side < 2; side++) {
                    float sign = side ? -1.0f : 1.0f;
                    horizon[side] = slice.low[side];
                    for (m = 0; m < 3; m++) {
                        float at = ((float)m + jitter) / 3, fx, fy, length, weight, cosine;
                        ref_vec d;
                        at = at * at * r + 1.3f;
                        fx = (float)x + 0.5f + sign * dx * at;
                        fy = (float)y + 0.5f + sign * dy * at;
                        if (fx < 0 || fy < 0 || fx >= (float)v->p->width || fy >= (float)v->p->height) break;
                        if (!ref_load(v, (int)fx, (int)fy, &t)) continue;
                        d = ref_sub(t.p, s.p);
                        length = sqrtf(ref_dot(d, d) + 1e-12f);
                        weight = ref_clamp((1 - length / reach) / (1.001f - parameters[1]), 0, 1);
                        cosine = slice.low[side] + (ref_dot(d, view) / length - slice.low[side]) * weight;
                        if (cosine > horizon[side]) horizon[side] = cosine;
                    }
                }
                visible += ref_slice_visibility(&slice, horizon);
            }
            v->out[s.at] = 1 - ref_clamp(visible / 3, 0, 1);
        }
}

typedef enum ref_method {
    REF_SSAO,
    REF_HBAO,
    REF_GTAO,
    REF_SSAO_HALF,
    REF_HBAO_HALF,
    REF_GTAO_HALF,
    REF_METHODS
} ref_method;
static const char *const ref_method_names[REF_METHODS] = {
    "SSAO 16 + 15x15 blur", "HBAO 16x8 + 15x15 blur", "GTAO 3x(3+3) + 5x5 blur",
    "SSAO 16 half res + 7x7", "HBAO 16x8 half res + 7x7", "GTAO 3x(3+3) half res + 5x5"};

/* Fitted for each method by bench_ssao_sat: radius, second parameter, gain, power, and the sharpness of the blur. */
typedef struct ref_fit { float parameters[2], sharp, gain, power; } ref_fit;
static const ref_fit ref_fits[REF_METHODS] = {
    {{1.4f, 0.0f}, 0.04f, 0.538f, 3.0f}, {{1.4f, 0.3f}, 0.04f, 1.893f, 1.5f}, {{1.7f, 0.45f}, 0.02f, 0.233f, 8.0f},
    {{1.4f, 0.0f}, 0.04f, 0.538f, 3.0f}, {{1.4f, 0.3f}, 0.04f, 1.893f, 1.5f}, {{1.7f, 0.45f}, 0.02f, 0.233f, 8.0f}};

/* The whole method: occlusion in out, `other` is scratch of the same size. */
static inline void ref_run(ref_method method, const ref_fit *fit, const ref_picture *p, float radius, float *out,
                           float *other)
{
    int half = method >= REF_SSAO_HALF, kind = (int)method % 3;
    ref_view v = ref_make_view(p, radius, half, out, other);
    if (kind == REF_SSAO) ref_ssao(&v, fit->parameters);
    else if (kind == REF_HBAO) ref_hbao(&v, fit->parameters);
    else ref_gtao(&v, fit->parameters);
    if (half) ref_upsample(&v, kind == REF_GTAO ? 2 : 3);
    else ref_blur(&v, kind == REF_GTAO ? 2 : 7, fit->sharp);
}

/* accessibility = (1 - gain occlusion)^power, in place */
static inline void ref_tone(float *v, size_t n, float gain, float power)
{
    size_t i;
    for (i = 0; i < n; i++) {
        float open = ref_clamp(1 - gain * v[i], 0, 1);
        v[i] = power == 1 ? open : powf(open, power);
    }
}

/* ---- projections ---- */

typedef enum ref_convention {
    REF_LINEAR, REF_STANDARD, REF_STANDARD_01, REF_REVERSED, REF_REVERSED_INFINITE, REF_INFINITE, REF_CONVENTIONS
} ref_convention;

/* The matrix and the depth buffer that a renderer of this convention would have made of the picture. */
static inline ssao_sat_input ref_input(const ref_picture *p, ref_convention convention, float *depth)
{
    const double near = 0.05, far = 100;
    const int reversed = convention == REF_REVERSED || convention == REF_REVERSED_INFINITE;
    double first = reversed, last = 1 - reversed, low = 0, a, b,
           unit = p->orthographic ? 1 / p->half_height : 1 / tan(0.5 * p->fov);
    ssao_sat_input in = ssao_sat_input_linear(p->z, p->width, p->height, p->fov);
    size_t i, n = (size_t)p->width * (size_t)p->height;
    in.normals = p->normals;
    in.clip_zero_to_one =
        convention == REF_STANDARD_01 || convention == REF_REVERSED || convention == REF_REVERSED_INFINITE;
    if (!in.clip_zero_to_one) low = -1;
    first = first * (1 - low) + low; /* clip z at near and far */
    last = last * (1 - low) + low;
    memset(in.projection, 0, sizeof in.projection);
    in.projection[0] = (float)(unit * p->height / p->width);
    in.projection[5] = (float)unit;
    if (p->orthographic) { /* z_clip = a z + b, z = -distance */
        a = -(last - first) / (far - near);
        b = first + a * near;
        in.projection[15] = 1;
    } else if (convention == REF_REVERSED_INFINITE || convention == REF_INFINITE) {
        a = -last;
        b = (first - last) * near;
        in.projection[11] = -1;
    } else {
        b = near * far * (first - last) / (far - near);
        a = b / far - last;
        in.projection[11] = -1;
    }
    in.projection[10] = (float)a;
    in.projection[14] = (float)b;
    if (convention == REF_LINEAR) return in;
    in.depth = depth;
    in.depth_kind = reversed ? SSAO_SAT_DEPTH_REVERSED : SSAO_SAT_DEPTH_HARDWARE;
    for (i = 0; i < n; i++) {
        double z = (double)p->z[i], clip = p->orthographic ? -(double)in.projection[10] * z + (double)in.projection[14]
                                                           : -(double)in.projection[10] + (double)in.projection[14] / z;
        depth[i] = p->z[i] < 1e18f ? (float)((clip - low) / (1 - low)) : reversed ? 0.0f : 1.0f;
    }
    return in;
}

#endif
