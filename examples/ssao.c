/* ssao - ambient occlusion of a scene from its depth buffer.         SPDX-License-Identifier: MIT-0 OR Unlicense

       ssao                                  a scene, shaded with its accessibility: out/ssao.png
       ssao bunny.ply out.png --radius 0.4   a mesh (PLY or OBJ) standing in a corner
       ssao --occlusion --out open.pfm       the accessibility alone, as floats
       ssao --compare --out sheet.png        all methods and a ray tracer on one contact sheet, with errors and times

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
static int light(image *out, const ref_picture *p, const float *open)
{
    static const float sky[3] = {0.265f, 0.42f, 0.69f}, surface[3] = {0.78f, 0.74f, 0.68f},
                       lamp[3] = {0.45f, 0.75f, 0.48f};
    size_t i;
    int c;
    if (!image_create(out, p->width, p->height, 3)) return 0;
    for (i = 0; i < count; i++) {
        const float *n = p->normals + 3 * i;
        float facing = n[0] * lamp[0] + n[1] * lamp[1] + n[2] * lamp[2];
        for (c = 0; c < 3; c++) {
            float falls = 0.45f * (facing > 0 ? facing : 0) * (0.35f + 0.65f * open[i]) + 0.75f * open[i];
            out->pixels[3 * i + (size_t)c] = p->z[i] < 1e18f ? surface[c] * falls : sky[c];
        }
    }
    return 1;
}

static unsigned char *shade(const ref_picture *p, const float *open)
{
    image lit;
    unsigned char *rgb = light(&lit, p, open) ? (unsigned char *)malloc(count * 3) : NULL;
    size_t i;
    for (i = 0; rgb && i < count * 3; i++) rgb[i] = to_byte(sat__srgb_encode(lit.pixels[i]));
    image_free(&lit);
    return rgb;
}

static double accessibility(const common_settings *common, float *out, const ref_picture *p, ssao_sat_options options)
{
    char why[200];
    ssao_sat_input input = ssao_sat_input_linear(p->z, p->width, p->height, p->fov);
    ssao_sat *ao;
    double start;
    sat_result result;
    input.normals = p->normals;
    options.threads = common->threads;
    result = ssao_sat_create(&ao, p->width, p->height, &options);
    if (result == SAT_OK) result = ssao_sat_apply(ao, out, 0, &input, NULL); /* touches the memory */
    start = common_clock();
    if (result == SAT_OK) result = ssao_sat_apply(ao, out, 0, &input, NULL);
    start = common_clock() - start;
    if (result != SAT_OK) {
        common_say_result(common, "occlusion", result, ssao_sat_explain(why, sizeof why, p->width, p->height, &options));
        exit(1);
    }
    ssao_sat_destroy(ao);
    return start;
}

static int compare(const common_settings *common, ref_picture *p, ssao_sat_options options)
{
    static const char *const names[] = {"minimalist", "normal-guided", "refined", "plane", "slabs"};
    static const ssao_sat_method order[] = {SSAO_SAT_MINIMALIST, SSAO_SAT_NORMAL_GUIDED, SSAO_SAT_REFINED,
                                            SSAO_SAT_PLANE, SSAO_SAT_SLABS};
    common_cell cells[8];
    char labels[8][80];
    float *out = (float *)malloc(count * sizeof(float));
    int i, ok = out != NULL;
    memset(cells, 0, sizeof cells);
    for (i = 0; i < 8; i++) {
        cells[i].width = p->width;
        cells[i].height = p->height;
        cells[i].label = labels[i];
    }
    for (i = 0; i < 5 && out; i++) {
        double seconds;
        options.method = order[i];
        seconds = accessibility(common, out, p, options);
        snprintf(labels[i], sizeof labels[i], "%s: RMSE %.3f, %.1f ms", names[i], ref_rmse(p, out, p->ao[1]),
                 1e3 * seconds);
        puts(labels[i]);
        cells[i].rgb = grey(out);
    }
    snprintf(labels[5], sizeof labels[5], "ray traced, radius %.2f", (double)p->radius[1]);
    cells[5].rgb = grey(p->ao[1]);
    snprintf(labels[6], sizeof labels[6], "shaded with the slabs");
    cells[6].rgb = shade(p, out);
    snprintf(labels[7], sizeof labels[7], "shaded with the ray tracer");
    cells[7].rgb = shade(p, p->ao[1]);
    for (i = 0; i < 8; i++) ok &= cells[i].rgb != NULL;
    ok = ok ? common_contact_sheet(common, common->out, cells, 8, 3) : common_say(common, "no memory");
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
        fprintf(stderr, "ssao: %s\n", m.message);
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

/* The accessibility, or the picture it shades, as the ending says. */
static int write_picture(const common_settings *common, const ref_picture *p, const float *open, int occlusion)
{
    unsigned char *rgb;
    image floats;
    int ok;
    if (image_ends_with(common->out, ".png")) {
        rgb = occlusion ? grey(open) : shade(p, open);
        ok = rgb ? common_save_u8(common, common->out, rgb, p->width, p->height, 3) : common_say(common, "no memory");
        free(rgb);
        return ok;
    }
    ok = occlusion ? image_create(&floats, p->width, p->height, 1) : light(&floats, p, open);
    if (ok && occlusion) memcpy(floats.pixels, open, count * sizeof(float));
    ok = ok ? common_save(common, common->out, &floats) : common_say(common, floats.message);
    image_free(&floats);
    return ok;
}

int main(int argc, char **argv)
{
    ssao_sat_options o = ssao_sat_defaults();
    int size = 512, scene = 0, sheet = 0, rays = 100, occlusion = 0, ok;
    const char *shape = NULL;
    common_settings common;
    ref_scene s;
    ref_picture p;
    const common_option options[] = {
        {"mesh", 'M', (void *)&shape, 0, 0, "in a corner of two walls, instead of a scene"},
        {"radius", 'd', &o.radius, 0, 100, "world units; the scenes are about 1 high"},
        {"gain", 'd', &o.gain, 0, 100, "times the fitted strength"},
        {"size", 'i', &size, 8, 4096, "side of the picture in pixels"},
        {"scene", 'i', &scene, 0, 3, "0 corner, 1 room, 2 field, 3 table"},
        {"rays", 'i', &rays, 1, 10000, "of the ray tracer, with --compare"},
        {"occlusion", 'b', &occlusion, 0, 0, "write the accessibility alone"},
        {"compare", 'b', &sheet, 0, 0, "contact sheet of all methods"},
    };
    o.radius = 0.25;
    common_parse(&common, argc, argv, "ssao", ".png .exr .hdr .pfm", options,
                 (int)(sizeof options / sizeof options[0]));
    if (sheet) common.writes = ".png";
    if (!common_may_write(&common, common.out)) return 2;
    if (shape ? !open_mesh(&s, shape) : (ref_open(&s, scene), 0)) return 1;
    count = (size_t)size * (size_t)size;
    if (sheet) { /* the radius of the reference is the middle one of three */
        p = ref_draw_radii(&s, size, size, 0, rays, ref_make(0, 0, 0), common.workers, (float)o.radius);
        ok = compare(&common, &p, o);
    } else {
        float *out = (float *)malloc(count * sizeof(float));
        p = ref_draw(&s, size, size, 0, 0, ref_make(0, 0, 0), common.workers);
        if (out) {
            double seconds = accessibility(&common, out, &p, o);
            if (common.stats) printf("%d x %d: %.1f ms\n", size, size, 1e3 * seconds);
        }
        ok = out ? write_picture(&common, &p, out, occlusion) : common_say(&common, "no memory");
        free(out);
    }
    ref_free(&p);
    ref_close(&s);
    common_close(&common);
    return !ok;
}
