/* mesh.h - triangle meshes for the examples: PLY (ASCII, binary little endian) and OBJ.
   SPDX-License-Identifier: MIT-0 OR Unlicense

       mesh bunny;
       if (!mesh_load(&bunny, "bunny.ply")) { fprintf(stderr, "%s\n", bunny.message); return 1; }
       ... bunny.positions[3 * bunny.indices[3 * triangle + corner] + axis] ...
       mesh_free(&bunny);

   Faces of more than three corners become fans. Everything but positions and faces is passed over. */

#ifndef MESH_H
#define MESH_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct mesh {
    float *positions;              /* x y z of each vertex */
    int *indices;                  /* three of each triangle */
    int vertex_count, triangle_count;
    char message[320];             /* why mesh_load returned 0 */
    int vertex_room, triangle_room;
} mesh;

static inline void mesh_free(mesh *m)
{
    free(m->positions);
    free(m->indices);
    m->positions = NULL;
    m->indices = NULL;
    m->vertex_count = m->triangle_count = m->vertex_room = m->triangle_room = 0;
}

static inline int mesh_fail(mesh *m, const char *path, const char *why)
{
    snprintf(m->message, sizeof m->message, "%.180s: %.120s", path, why);
    mesh_free(m);
    return 0;
}

static inline int mesh_add_vertex(mesh *m, const double *xyz)
{
    int i;
    if (m->vertex_count == m->vertex_room) {
        int room = m->vertex_room ? 2 * m->vertex_room : 1024;
        float *p = room < (1 << 28) ? (float *)realloc(m->positions, (size_t)room * 3 * sizeof *p) : NULL;
        if (!p) return 0;
        m->positions = p;
        m->vertex_room = room;
    }
    for (i = 0; i < 3; ++i) m->positions[3 * (size_t)m->vertex_count + (size_t)i] = (float)xyz[i];
    ++m->vertex_count;
    return 1;
}

static inline int mesh_add_triangle(mesh *m, int a, int b, int c)
{
    int *p;
    if (m->triangle_count == m->triangle_room) {
        int room = m->triangle_room ? 2 * m->triangle_room : 1024;
        p = room < (1 << 28) ? (int *)realloc(m->indices, (size_t)room * 3 * sizeof *p) : NULL;
        if (!p) return 0;
        m->indices = p;
        m->triangle_room = room;
    }
    p = m->indices + 3 * (size_t)m->triangle_count++;
    p[0] = a;
    p[1] = b;
    p[2] = c;
    return 1;
}

/* ---- PLY ---- */

enum { MESH_MAX_PROPERTIES = 32 };

typedef struct mesh_property {
    char name[32];
    char type;
    char count_type;
} mesh_property; /* types as in mesh_type; count_type 0: no list */

typedef struct mesh_ply {
    FILE *file;
    int binary;
} mesh_ply;

/* One letter for a type: c C s S i I f d, capitals unsigned; 0 unknown. */
static inline char mesh_type(const char *name)
{
    static const char *const names[] = {"char", "int8", "uchar", "uint8", "short", "int16", "ushort", "uint16",
                                        "int", "int32", "uint", "uint32", "float", "float32", "double", "float64"};
    int i;
    for (i = 0; i < 16; ++i)
        if (strcmp(name, names[i]) == 0) return "cCsSiIfd"[i / 2];
    return 0;
}

static inline int mesh_ply_value(mesh_ply *ply, char type, double *value)
{
    unsigned char b[8] = {0};
    size_t size = type == 'd' ? 8 : type == 's' || type == 'S' ? 2 : type == 'c' || type == 'C' ? 1 : 4, i;
    uint64_t bits = 0;
    if (!ply->binary) return fscanf(ply->file, "%lf", value) == 1;
    if (fread(b, 1, size, ply->file) != size) return 0;
    for (i = 0; i < size; ++i) bits |= (uint64_t)b[i] << (8 * i);
    if (type == 'f') {
        uint32_t word = (uint32_t)bits;
        float f;
        memcpy(&f, &word, 4);
        *value = (double)f;
    }
    else if (type == 'd') memcpy(value, &bits, 8);
    else if (type == 'c') *value = (double)(int8_t)(uint8_t)bits;
    else if (type == 's') *value = (double)(int16_t)(uint16_t)bits;
    else if (type == 'i') *value = (double)(int32_t)(uint32_t)bits;
    else *value = (double)bits;
    return 1;
}

/* A list of corners as a fan of triangles; other lists are read and dropped. */
static inline int mesh_ply_list(mesh *m, mesh_ply *ply, const mesh_property *property, int corners)
{
    double n, v;
    int k, first = 0, last = 0;
    if (!mesh_ply_value(ply, property->count_type, &n) || !(n >= 0 && n < 1e6)) return 0;
    for (k = 0; k < (int)n; ++k) {
        if (!mesh_ply_value(ply, property->type, &v)) return 0;
        if (!corners) continue;
        if (!(v >= 0 && v < 2147483647.0)) return 0;
        if (k == 0) first = (int)v;
        if (k >= 2 && !mesh_add_triangle(m, first, last, (int)v)) return 0;
        last = (int)v;
    }
    return 1;
}

static inline int mesh_ply_element(mesh *m, mesh_ply *ply, const char *element, long count,
                                   const mesh_property *properties, int n)
{
    long i;
    int k;
    for (i = 0; i < count; ++i) {
        double xyz[3] = {0, 0, 0}, v;
        for (k = 0; k < n; ++k) {
            const mesh_property *p = &properties[k];
            if (p->count_type) {
                int corners = strcmp(element, "face") == 0 && strncmp(p->name, "vertex_ind", 10) == 0;
                if (!mesh_ply_list(m, ply, p, corners)) return 0;
                continue;
            }
            if (!mesh_ply_value(ply, p->type, &v)) return 0;
            if (p->name[0] >= 'x' && p->name[0] <= 'z' && p->name[1] == 0) xyz[p->name[0] - 'x'] = v;
        }
        if (strcmp(element, "vertex") == 0 && !mesh_add_vertex(m, xyz)) return 0;
    }
    return 1;
}

enum { MESH_MAX_ELEMENTS = 8 };

typedef struct mesh_ply_header {
    int elements;
    struct {
        char name[32];
        long count;
        int n;
        mesh_property properties[MESH_MAX_PROPERTIES];
    } element[MESH_MAX_ELEMENTS];
} mesh_ply_header;

static inline const char *mesh_ply_read_header(mesh_ply *ply, mesh_ply_header *h)
{
    char line[256], a[32], b[32], c[32], d[32];
    memset(h, 0, sizeof *h);
    if (!fgets(line, sizeof line, ply->file) || strncmp(line, "ply", 3) != 0) return "is not a PLY file";
    while (fgets(line, sizeof line, ply->file)) {
        int n = sscanf(line, "%31s %31s %31s %31s", a, b, c, d), e = h->elements - 1;
        if (n < 1 || strcmp(a, "comment") == 0 || strcmp(a, "obj_info") == 0) continue;
        if (strcmp(a, "end_header") == 0) return NULL;
        if (strcmp(a, "format") == 0 && n >= 2) {
            if (strcmp(b, "binary_big_endian") == 0) return "is big endian, which is not supported";
            ply->binary = strcmp(b, "ascii") != 0;
        } else if (strcmp(a, "element") == 0 && n == 3 && e + 1 < MESH_MAX_ELEMENTS) {
            memcpy(h->element[e + 1].name, b, 32);
            h->element[e + 1].count = strtol(c, NULL, 10);
            ++h->elements;
        } else if (strcmp(a, "property") == 0 && n >= 3 && e >= 0 && h->element[e].n < MESH_MAX_PROPERTIES) {
            mesh_property *p = &h->element[e].properties[h->element[e].n++];
            int list = strcmp(b, "list") == 0;
            char name[32];
            if (list && sscanf(line, "%*s %*s %*s %*s %31s", name) != 1) return "has a bad list property";
            memcpy(p->name, list ? name : c, 32);
            p->count_type = list ? mesh_type(c) : 0;
            p->type = mesh_type(list ? d : b);
            if (!p->type || (list && !p->count_type)) return "has a property of an unknown type";
        } else return "has a header that is not understood";
    }
    return "has a header without end";
}

static inline const char *mesh_load_ply(mesh *m, FILE *file)
{
    mesh_ply ply;
    mesh_ply_header h;
    const char *why;
    int i;
    ply.file = file;
    ply.binary = 0;
    why = mesh_ply_read_header(&ply, &h);
    for (i = 0; !why && i < h.elements; ++i)
        if (!mesh_ply_element(m, &ply, h.element[i].name, h.element[i].count, h.element[i].properties, h.element[i].n))
            why = "ends too early, is damaged, or is too large for the memory";
    return why;
}

/* ---- OBJ: v and f lines ---- */

static inline const char *mesh_load_obj(mesh *m, FILE *file)
{
    char line[4096];
    while (fgets(line, sizeof line, file)) {
        if (line[0] == 'v' && (line[1] == ' ' || line[1] == '\t')) {
            double xyz[3];
            if (sscanf(line + 1, "%lf %lf %lf", &xyz[0], &xyz[1], &xyz[2]) != 3)
                return "has a vertex without three numbers";
            if (!mesh_add_vertex(m, xyz)) return "is too large for the memory";
        } else if (line[0] == 'f' && (line[1] == ' ' || line[1] == '\t')) {
            char *at = line + 1, *end;
            int k, first = 0, last = 0;
            for (k = 0;; ++k) {     /* a, a/b, a//c or a/b/c; negative numbers count from the end */
                long v = strtol(at, &end, 10);
                int index;
                if (end == at) break;
                index = (int)(v < 0 ? m->vertex_count + v : v - 1);
                at = end + strcspn(end, " \t\r\n");
                if (k == 0) first = index;
                if (k >= 2 && !mesh_add_triangle(m, first, last, index)) return "is too large for the memory";
                last = index;
            }
            if (k < 3) return "has a face of fewer than three corners";
        }
    }
    return NULL;
}

/* 1, or 0 with a message. Every index is checked. */
static inline int mesh_load(mesh *out, const char *path)
{
    FILE *file = fopen(path, "rb");
    const char *why, *dot = strrchr(path, '.');
    int i;
    memset(out, 0, sizeof *out);
    if (!file) return mesh_fail(out, path, "cannot be opened");
    if (dot && (strcmp(dot, ".ply") == 0 || strcmp(dot, ".PLY") == 0)) why = mesh_load_ply(out, file);
    else if (dot && (strcmp(dot, ".obj") == 0 || strcmp(dot, ".OBJ") == 0)) why = mesh_load_obj(out, file);
    else why = "is neither .ply nor .obj";
    fclose(file);
    for (i = 0; !why && i < 3 * out->triangle_count; ++i)
        if (out->indices[i] < 0 || out->indices[i] >= out->vertex_count)
            why = "has a face with a vertex that does not exist";
    if (!why && out->triangle_count == 0) why = "has no triangles";
    return why ? mesh_fail(out, path, why) : 1;
}

/* Corners of the box around all vertices. */
static inline void mesh_bounds(const mesh *m, float low[3], float high[3])
{
    int i, k;
    for (k = 0; k < 3; ++k) low[k] = high[k] = m->vertex_count ? m->positions[k] : 0.0f;
    for (i = 1; i < m->vertex_count; ++i)
        for (k = 0; k < 3; ++k) {
            float v = m->positions[3 * (size_t)i + (size_t)k];
            if (v < low[k]) low[k] = v;
            if (v > high[k]) high[k] = v;
        }
}

#endif /* MESH_H */
