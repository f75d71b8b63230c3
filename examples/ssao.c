/* ssao - ambient occlusion of a scene from its depth buffer.         SPDX-License-Identifier: MIT-0 OR Unlicense

       ssao out.png                          a scene, shaded with its accessibility
       ssao bunny.ply out.png --radius 0.4   a mesh (PLY or OBJ) standing in a corner
       ssao sheet.png --compare              all methods and a ray tracer on one contact sheet, with errors and times

   The pictures are drawn by a ray tracer; ssao_sat.h sees nothing of them but depths and normals. */

#define _POSIX_C_SOURCE 200809L
#define SAT_IMPLEMENTATION
#define SSAO_SAT_IMPLEMENTATION
#include "../ssao_sat.h"
#include "common.h"
#include "mesh.h"
#include "../tests/support.h"
#include "../tests/reference_ssao.h"

static size_t count;

static unsigned char to_byte(float v) { return (unsigned char)(255 * sat__clamp_int((int)(v * 1000), 0, 1000) / 1000); }

static unsigned char *grey(const float *v)
{
    unsigned char *rgb = (unsigned char *)malloc(count * 3);
    size_t i;
    for (i = 0; rgb && i < count * 3; i++) rgb[i] = to_byte(v[i / 3]);
    return rgb;
}

/* A lamp and the sky's light: S = rho (L_lamp + L_sky A) (Slomp 2012, eq 5.3, where A belongs to the ambient light). */
static unsigned char *shade(const ref_picture *p, const float *open)
{
    unsigned char *rgb = (unsigned char *)malloc(count * 3);
    static const float sky[3] = {0.55f, 0.68f, 0.85f}, surface[3] = {0.78f, 0.74f, 0.68f}, lamp[3] = {0.45f, 0.75f, 0.48f};
    size_t i;
    int c;
    for (i = 0; rgb && i < count; i++) {
        const float *n = p->normals + 3 * i;
        float facing = n[0] * lamp[0] + n[1] * lamp[1] + n[2] * lamp[2];
        for (c = 0; c < 3; c++) {
            float light = 0.45f * (facing > 0 ? facing : 0) * (0.35f + 0.65f * open[i]) + 0.75f * open[i];
            rgb[3 * i + (size_t)c] = to_byte(sat__srgb_encode(p->z[i] < 1e18f ? surface[c] * light : sky[c]));
        }
    }
    return rgb;
}

static double accessibility(float *out, const ref_picture *p, ssao_sat_options options, const sat_threads *threads)
{
    ssao_sat_input input = ssao_sat_input_linear(p->z, p->width, p->height, p->fov);
    ssao_sat *ao;
    double start;
    sat_result result;
    input.normals = p->normals;
    options.threads = *threads;
    result = ssao_sat_create(&ao, p->width, p->height, &options);
    if (result == SAT_OK) result = ssao_sat_apply(ao, out, 0, &input, NULL); /* touches the memory */
    start = common_clock();
    if (result == SAT_OK) result = ssao_sat_apply(ao, out, 0, &input, NULL);
    start = common_clock() - start;
    if (result != SAT_OK) {
        fprintf(stderr, "ssao: %s\n", sat_result_text(result));
        exit(1);
    }
    ssao_sat_destroy(ao);
    return start;
}

static int compare(const char *path, ref_picture *p, ssao_sat_options options, const sat_threads *threads)
{
    static const char *const names[] = {"minimalist", "normal-guided", "refined", "plane", "slabs"};
    static const ssao_sat_method order[] = {SSAO_SAT_MINIMALIST, SSAO_SAT_NORMAL_GUIDED, SSAO_SAT_REFINED, SSAO_SAT_PLANE, SSAO_SAT_SLABS};
    common_cell cells[8];
    char labels[8][80];
    float *out = (float *)malloc(count * sizeof(float));
    int i, ok;
    memset(cells, 0, sizeof cells);
    for (i = 0; i < 8; i++) {
        cells[i].width = p->width;
        cells[i].height = p->height;
        cells[i].label = labels[i];
    }
    for (i = 0; i < 5 && out; i++) {
        double seconds;
        options.method = order[i];
        seconds = accessibility(out, p, options, threads);
        snprintf(labels[i], sizeof labels[i], "%s: RMSE %.3f, %.1f ms", names[i], ref_rmse(p, out, p->ao[1]), 1e3 * seconds);
        puts(labels[i]);
        cells[i].rgb = grey(out);
    }
    snprintf(labels[5], sizeof labels[5], "ray traced, radius %.2f", (double)p->radius[1]);
    cells[5].rgb = grey(p->ao[1]);
    snprintf(labels[6], sizeof labels[6], "shaded with the slabs");
    cells[6].rgb = shade(p, out);
    snprintf(labels[7], sizeof labels[7], "shaded with the ray tracer");
    cells[7].rgb = shade(p, p->ao[1]);
    ok = out && common_contact_sheet(path, cells, 8, 3);
    for (i = 0; i < 8; i++) free((void *)(uintptr_t)cells[i].rgb);
    free(out);
    return ok;
}

/* The caller's mesh in a corner of two walls, 0.9 high. */
static int open_mesh(ref_scene *s, const char *path)
{
    mesh m;
    float low = 1e30f, high = -1e30f;
    int i;
    memset(s, 0, sizeof *s);
    if (!mesh_load(&m, path)) {
        fprintf(stderr, "%s\n", m.message);
        return 0;
    }
    for (i = 0; i < m.vertex_count; i++) {
        float y = m.positions[3 * (size_t)i + 1];
        if (y < low) low = y;
        if (y > high) high = y;
    }
    ref_add_mesh(s, &m, 0.9f / (high > low ? high - low : 1), ref_make(0, 0, 0.1f), 0.4f);
    mesh_free(&m);
    s->smooth = s->m.triangle_count;
    ref_quad(s, ref_make(-3, 0, -1), ref_make(3, 0, -1), ref_make(3, 0, 4), ref_make(-3, 0, 4));
    ref_quad(s, ref_make(-3, 0, -0.7f), ref_make(3, 0, -0.7f), ref_make(3, 4, -0.7f), ref_make(-3, 4, -0.7f));
    ref_quad(s, ref_make(-1, 0, -3), ref_make(-1, 4, -3), ref_make(-1, 4, 4), ref_make(-1, 0, 4));
    s->eye = ref_make(0.6f, 1.3f, 2.4f);
    s->at = ref_make(0, 0.4f, 0);
    ref_finish(s);
    return 1;
}

int main(int argc, char **argv)
{
    float radius = 0.25f, gain = 1;
    int size = 512, scene = 0, sheet = 0, rays = 100, occlusion = 0, first, ok;
    common_settings common;
    const char *path;
    ref_scene s;
    ref_picture p;
    common_option options[] = {
        {"radius", 'f', &radius, "world units, 0.25; the scenes are about 1 high"},
        {"gain", 'f', &gain, "times the fitted strength, 1"},
        {"size", 'i', &size, "side of the picture in pixels, 512"},
        {"scene", 'i', &scene, "0 corner, 1 room, 2 field, 3 table"},
        {"rays", 'i', &rays, "of the ray tracer, with --compare, 100"},
        {"occlusion", 'b', &occlusion, "write the accessibility alone"},
        {"compare", 'b', &sheet, "contact sheet of all methods"},
    };
    ssao_sat_options o = ssao_sat_defaults();
    first = common_parse(&common, argc, argv, "ssao [options] [mesh.ply] out.png", options, 7);
    if (argc - first < 1 || argc - first > 2 || scene < 0 || scene >= REF_SCENES || size < 8 || size > 4096) {
        fprintf(stderr, "usage: ssao [options] [mesh.ply] out.png (--help lists the options)\n");
        return 2;
    }
    path = common.out ? common.out : argv[argc - 1];
    if (argc - first == 2) {
        if (!open_mesh(&s, argv[first])) return 1;
    } else ref_open(&s, scene);
    p = ref_draw(&s, size, size, 0, 0, ref_make(0, 0, 0), common.workers);
    if (sheet) { /* the radius of the reference is the middle one of three */
        ref_free(&p);
        p = ref_draw_radii(&s, size, size, 0, rays, ref_make(0, 0, 0), common.workers, radius);
    }
    count = (size_t)size * (size_t)size;
    o.radius = (double)radius;
    o.gain = (double)gain;
    if (sheet) ok = compare(path, &p, o, &common.threads);
    else {
        float *out = (float *)malloc(count * sizeof(float));
        unsigned char *rgb;
        double seconds = accessibility(out, &p, o, &common.threads);
        if (common.stats) printf("%d x %d: %.1f ms\n", size, size, 1e3 * seconds);
        rgb = occlusion ? grey(out) : shade(&p, out);
        ok = image_save_u8(path, rgb, size, size, 3);
        free(rgb);
        free(out);
    }
    if (!ok) fprintf(stderr, "%s could not be written\n", path);
    ref_free(&p);
    ref_close(&s);
    return !ok;
}
