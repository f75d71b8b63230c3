/* ssao_sat.h on the GPU: equal to the C code, state left alone, errors. Needs OSMesa (or a GPU, see gl_context.h);
   skips without. */

#include "gl_es.h"
#include "gl_share.h"

enum { GL_WIDTH = 67, GL_HEIGHT = 49 };

static gl_context test_gl;
static sat__gl test_f;

static int open_gl(void)
{
    static int state;
    if (state == 0) {
        state = gl_context_open(&test_gl, 3, 3) ? 1 : -1;
        if (state > 0) test_gl.get_proc = gl_share(test_gl.get_proc);
        if (state > 0 && sat__gl_open(&test_f, test_gl.get_proc) != SAT_OK) state = -1;
    }
    return state > 0;
}

static unsigned upload(unsigned internal, int w, int h, const void *pixels)
{
    sat__gl_state state;
    unsigned texture = 0;
    sat__gl_begin(&test_f, &state, 1);
    EXPECT_EQ(sat__gl_texture(&test_f, &texture, internal, w, h, pixels), SAT_OK);
    sat__gl_end(&test_f, &state);
    return texture;
}

static void download(float *out, unsigned texture, int w, int h)
{
    sat__gl_state state;
    sat__gl_begin(&test_f, &state, 1);
    EXPECT_EQ(sat__gl_read(&test_f, out, texture, SAT__GL_R32F, w, h), SAT_OK);
    sat__gl_end(&test_f, &state);
}

static ref_picture small_picture(int scene, int orthographic)
{
    ref_scene s;
    ref_picture p;
    ref_open(&s, scene);
    p = ref_draw(&s, GL_WIDTH, GL_HEIGHT, orthographic, 0, ref_make(0, 0, 0), 1);
    ref_close(&s);
    return p;
}

static sat_result run_c(float *out, const ssao_sat_input *in, const ssao_sat_options *o)
{
    ssao_sat *ao;
    sat_result r = ssao_sat_create(&ao, in->width, in->height, o);
    if (r != SAT_OK) return r;
    r = ssao_sat_apply(ao, out, 0, in, NULL);
    ssao_sat_destroy(ao);
    return r;
}

/* `kept`: an object that takes the options in the frame, or NULL: one is made. */
static void compare_by(ssao_sat_gl *kept, const ref_picture *p, ssao_sat_options o, ref_convention convention,
                       int with_normals, double tolerance)
{
    static float depth[GL_WIDTH * GL_HEIGHT], a[GL_WIDTH * GL_HEIGHT], b[GL_WIDTH * GL_HEIGHT];
    ssao_sat_input in = ref_input(p, convention, depth);
    ssao_sat_gl *gl = kept;
    unsigned textures[2] = {0, 0};
    double off;
    if (!with_normals) in.normals = NULL;
    else in.normals = p->normals;
    o.tolerance = 0; /* here every pixel is estimated */
    EXPECT_EQ(run_c(a, &in, &o), SAT_OK);
    textures[0] = upload(SAT__GL_R32F, GL_WIDTH, GL_HEIGHT, in.depth);
    if (with_normals) textures[1] = upload(SAT__GL_RGB32F, GL_WIDTH, GL_HEIGHT, p->normals);
    if (EXPECT_EQ(kept ? ssao_sat_gl_set_options(kept, &o)
                       : ssao_sat_gl_create(&gl, test_gl.get_proc, GL_WIDTH, GL_HEIGHT, &o),
                  SAT_OK)) {
        EXPECT_EQ(ssao_sat_gl_apply(gl, 0, textures[0], textures[1], &in), SAT_OK);
        download(b, ssao_sat_gl_texture(gl), GL_WIDTH, GL_HEIGHT);
        off = ref_rmse(p, a, b);
        if (!EXPECT_NEAR(off, 0, tolerance))
            printf("    method %d, convention %d, orthographic %d, half %d\n", (int)o.method, (int)convention, p->orthographic, o.half_resolution);
    } else printf("%s\n", ssao_sat_gl_message(gl));
    if (!kept) ssao_sat_gl_destroy(gl);
    test_f.DeleteTextures(2, textures);
}

static void compare(const ref_picture *p, ssao_sat_options o, ref_convention convention, int with_normals,
                    double tolerance)
{
    compare_by(NULL, p, o, convention, with_normals, tolerance);
}

/* Bent normals and signed output of both, an object of all outputs: largest mean difference of either. */
static void compare_outputs(const ref_picture *p, ssao_sat_options o, ref_convention convention, int with_normals)
{
    static float depth[GL_WIDTH * GL_HEIGHT], a[GL_WIDTH * GL_HEIGHT], b[4 * GL_WIDTH * GL_HEIGHT],
        bent[3 * GL_WIDTH * GL_HEIGHT];
    ssao_sat_input in = ref_input(p, convention, depth);
    ssao_sat *ao = NULL;
    ssao_sat_gl *gl = NULL;
    unsigned textures[2] = {0, 0};
    sat__gl_state state;
    double off = 0, open = 0;
    int i, k, n = 0;
    in.normals = with_normals ? p->normals : NULL;
    o.gl_bent = o.gl_signed = 1;
    textures[0] = upload(SAT__GL_R32F, GL_WIDTH, GL_HEIGHT, in.depth);
    if (with_normals) textures[1] = upload(SAT__GL_RGB32F, GL_WIDTH, GL_HEIGHT, p->normals);
    EXPECT_EQ(ssao_sat_create(&ao, GL_WIDTH, GL_HEIGHT, &o), SAT_OK);
    if (!EXPECT_EQ(ssao_sat_gl_create(&gl, test_gl.get_proc, GL_WIDTH, GL_HEIGHT, &o), SAT_OK))
        puts(ssao_sat_gl_message(gl));
#ifndef SSAO_SAT_NO_BENT
    if (o.method == SSAO_SAT_SLABS) {
        EXPECT_EQ(ssao_sat_apply_bent(ao, a, 0, bent, 0, &in, NULL), SAT_OK);
        EXPECT_EQ(ssao_sat_gl_apply_bent(gl, 0, textures[0], textures[1], &in), SAT_OK);
        sat__gl_begin(&test_f, &state, 1);
        EXPECT_EQ(sat__gl_read(&test_f, b, ssao_sat_gl_bent_texture(gl), SAT__GL_RGBA16F, GL_WIDTH, GL_HEIGHT), SAT_OK);
        sat__gl_end(&test_f, &state);
        for (i = 0; i < GL_WIDTH * GL_HEIGHT; i++) {
            double dot = 0, length = 0;
            open += fabs((double)a[i] - (double)b[4 * i + 3]) / (GL_WIDTH * GL_HEIGHT);
            for (k = 0; k < 3; k++) {
                dot += (double)bent[3 * i + k] * (double)b[4 * i + k];
                length += (double)b[4 * i + k] * (double)b[4 * i + k];
            }
            n += !(fabs(length - 1) < 4e-3);
            off += acos(fmin(dot / sqrt(length), 1)) / (GL_WIDTH * GL_HEIGHT);
        }
        EXPECT_EQ(n, 0);
        EXPECT_NEAR(open, 0, 2e-3);
        if (!EXPECT_NEAR(off * 57.29578, 0, 0.2)) /* degrees, of half floats */
            printf("    convention %d, half %d\n", (int)convention, o.half_resolution);
    } else EXPECT_EQ(ssao_sat_gl_apply_bent(gl, 0, textures[0], textures[1], &in), SAT_ERR_ARGUMENT);
#endif
    EXPECT_EQ(ssao_sat_apply_signed(ao, a, 0, &in, NULL), SAT_OK);
    EXPECT_EQ(ssao_sat_gl_apply_signed(gl, 0, textures[0], textures[1], &in), SAT_OK);
    download(b, ssao_sat_gl_texture(gl), GL_WIDTH, GL_HEIGHT);
    for (i = 0, off = 0; i < GL_WIDTH * GL_HEIGHT; i++) off += fabs((double)a[i] - (double)b[i]);
    if (!EXPECT_NEAR(off / (GL_WIDTH * GL_HEIGHT), 0, 2e-3))
        printf("    signed: method %d, convention %d, half %d\n", (int)o.method, (int)convention, o.half_resolution);
    EXPECT_EQ(ssao_sat_apply(ao, a, 0, &in, NULL), SAT_OK); /* and nothing is left of it in the next frame */
    EXPECT_EQ(ssao_sat_gl_apply(gl, 0, textures[0], textures[1], &in), SAT_OK);
    download(b, ssao_sat_gl_texture(gl), GL_WIDTH, GL_HEIGHT);
    EXPECT_NEAR(ref_rmse(p, a, b), 0, o.method == SSAO_SAT_REFINED || convention != REF_LINEAR ? 0.01 : 2e-3);
    ssao_sat_destroy(ao);
    ssao_sat_gl_destroy(gl);
    test_f.DeleteTextures(2, textures);
}

TEST(gpu_bent_and_signed_equal_c)
{
    int m;
    if (!open_gl()) SKIP(test_gl.message);
    for (m = 0; m < 5; m++) {
        ref_picture p = small_picture(m % 2 ? 1 : 2, m % 2); /* the field has sky */
        ssao_sat_options o = ssao_sat_defaults();
        o.method = (ssao_sat_method)(m < 3 ? SSAO_SAT_SLABS : m == 3 ? SSAO_SAT_PLANE : SSAO_SAT_MINIMALIST);
        o.radius = m == 2 ? 0 : 0.3;
        o.inverted_depth = m == 4;
        o.half_resolution = m != 1;
        o.tolerance = 0;
        compare_outputs(&p, o, m ? REF_LINEAR : REF_REVERSED, m != 2);
        ref_free(&p);
    }
}

/* A wire between two columns of the tables, before the sky: it has no neighbour to take from. */
TEST(gpu_wires_before_the_sky)
{
    static float z[GL_WIDTH * GL_HEIGHT], a[GL_WIDTH * GL_HEIGHT], b[GL_WIDTH * GL_HEIGHT];
    ssao_sat_options o = ssao_sat_defaults();
    ssao_sat_input in = ssao_sat_input_linear(z, GL_WIDTH, GL_HEIGHT, 1);
    ssao_sat *ao = NULL;
    ssao_sat_gl *gl = NULL;
    unsigned depth;
    int i;
    if (!open_gl()) SKIP(test_gl.message);
    o.gl_signed = 1;
    for (i = 0; i < GL_WIDTH * GL_HEIGHT; i++)
        z[i] = i % GL_WIDTH == 33 ? 3 : i / GL_WIDTH > 40 ? 5 : sat__float_from_bits(0x7f800000u);
    depth = upload(SAT__GL_R32F, GL_WIDTH, GL_HEIGHT, z);
    EXPECT_EQ(ssao_sat_create(&ao, GL_WIDTH, GL_HEIGHT, &o), SAT_OK);
    EXPECT_EQ(ssao_sat_gl_create(&gl, test_gl.get_proc, GL_WIDTH, GL_HEIGHT, &o), SAT_OK);
    EXPECT_EQ(ssao_sat_apply_signed(ao, a, 0, &in, NULL), SAT_OK);
    EXPECT_EQ(ssao_sat_gl_apply_signed(gl, 0, depth, 0, &in), SAT_OK);
    download(b, ssao_sat_gl_texture(gl), GL_WIDTH, GL_HEIGHT);
    EXPECT_NEAR(a[10 * GL_WIDTH + 33], 0, 0);
    EXPECT_NEAR(b[10 * GL_WIDTH + 33], 0, 0);
    EXPECT_EQ(ssao_sat_apply(ao, a, 0, &in, NULL), SAT_OK);
    EXPECT_EQ(ssao_sat_gl_apply(gl, 0, depth, 0, &in), SAT_OK);
    download(b, ssao_sat_gl_texture(gl), GL_WIDTH, GL_HEIGHT);
    EXPECT_NEAR(a[10 * GL_WIDTH + 33], 1, 0);
    EXPECT_NEAR(b[10 * GL_WIDTH + 33], 1, 0);
    ssao_sat_destroy(ao);
    ssao_sat_gl_destroy(gl);
    test_f.DeleteTextures(1, &depth);
}

TEST(gpu_equals_c)
{
    int m, orthographic;
    if (!open_gl()) SKIP(test_gl.message);
    for (orthographic = 0; orthographic < 2; orthographic++) {
        ref_picture p = small_picture(orthographic, orthographic);
        for (m = 0; m < 5; m++) {
            ssao_sat_options o = ssao_sat_defaults();
            o.method = (ssao_sat_method)m;
            o.radius = 0.3;
            o.half_resolution = (m + orthographic) % 2 == 0;
            compare(&p, o, REF_LINEAR, 1,
                    m == SSAO_SAT_REFINED ? 0.01
                                          : 2e-3); /* refined: a child on its parent's edge falls to either side */
        }
        ref_free(&p);
    }
}

/* The same in GLSL ES 3.00, on the same driver. */
TEST(shaders_are_es)
{
    ref_picture p;
    int m;
    if (!open_gl()) SKIP(test_gl.message);
    p = small_picture(0, 0);
    test_gl.get_proc = gl_es_pretend(test_gl.get_proc);
    for (m = 0; m < 5; m++) {
        ssao_sat_options o = ssao_sat_defaults();
        o.method = (ssao_sat_method)m;
        o.radius = 0.3;
        o.half_resolution = m % 2;
        compare(&p, o, REF_LINEAR, 1, m == SSAO_SAT_REFINED ? 0.01 : 2e-3);
    }
    test_gl.get_proc = gl_es_real;
    ref_free(&p);
}

TEST(gpu_options_and_conventions)
{
    ref_picture p;
    int c;
    if (!open_gl()) SKIP(test_gl.message);
    p = small_picture(1, 0);
    for (c = 0; c < REF_CONVENTIONS; c++) {
        ssao_sat_options o = ssao_sat_defaults();
        o.radius = 0.3;
        compare(&p, o, (ref_convention)c, c % 2, 0.01); /* 24 bits of depth in the GPU's floats */
        if (c % 3) continue;
        o.slabs = 5;
        o.scales = 2;
        o.gain = 2;
        o.power = 1.5;
        o.max_pixels = 20;
        o.half_resolution = 0;
        compare(&p, o, REF_LINEAR, 1, 2e-3);
        o.method = c % 2 ? SSAO_SAT_REFINED : SSAO_SAT_MINIMALIST;
        o.as_printed = 1;
        o.inverted_depth = c > 2;
        o.depth_gain = 1;
        o.region_pixels = 7;
        compare(&p, o, REF_LINEAR, 1, 0.02);
    }
    ref_free(&p);
}

TEST(gpu_gets_its_radius_0)
{
    ref_picture p;
    ssao_sat_options o = ssao_sat_defaults();
    if (!open_gl()) SKIP(test_gl.message);
    p = small_picture(0, 0);
    o.radius = 0;
    compare(&p, o, REF_LINEAR, 1, 0);
    ref_free(&p);
}

TEST(gpu_state_is_restored)
{
    static float z[GL_WIDTH * GL_HEIGHT], out[GL_WIDTH * GL_HEIGHT];
    static const unsigned names[] = {SAT__GL_CURRENT_PROGRAM,          SAT__GL_VERTEX_ARRAY_BINDING,
                                     SAT__GL_DRAW_FRAMEBUFFER_BINDING, SAT__GL_READ_FRAMEBUFFER_BINDING,
                                     SAT__GL_ACTIVE_TEXTURE,           SAT__GL_TEXTURE_BINDING_2D,
                                     SAT__GL_UNPACK_ALIGNMENT,         SAT__GL_DEPTH_FUNC};
    int before[16], after[16], viewport[2][4], i, k;
    ssao_sat_input in = ssao_sat_input_linear(z, GL_WIDTH, GL_HEIGHT, 1);
    ssao_sat_gl *gl = NULL;
    unsigned textures[2];
    if (!open_gl()) SKIP(test_gl.message);
    support_fill(z, GL_WIDTH * GL_HEIGHT, 1, 2, 1);
    textures[0] = upload(SAT__GL_R32F, GL_WIDTH, GL_HEIGHT, z);
    textures[1] = upload(SAT__GL_R32F, GL_WIDTH, GL_HEIGHT, NULL);
    test_f.Enable(SAT__GL_BLEND);
    test_f.Enable(SAT__GL_SCISSOR_TEST);
    test_f.PixelStorei(SAT__GL_UNPACK_ALIGNMENT, 2);
    test_f.Viewport(3, 4, 5, 6);
    test_f.ActiveTexture(SAT__GL_TEXTURE0 + 2);
    test_f.BindTexture(SAT__GL_TEXTURE_2D, textures[0]);
    for (i = 0; i < 8; i++) test_f.GetIntegerv(names[i], &before[i]);
    test_f.GetIntegerv(SAT__GL_VIEWPORT, viewport[0]);
    EXPECT_EQ(ssao_sat_gl_create(&gl, test_gl.get_proc, GL_WIDTH, GL_HEIGHT, NULL), SAT_OK);
    for (k = 0; k < 2; k++) {
        sat_gl_target to = sat_gl_to_texture(textures[1]);
        EXPECT_EQ(ssao_sat_gl_apply(gl, k ? &to : NULL, textures[0], 0, &in), SAT_OK);
        for (i = 0; i < 8; i++) {
            test_f.GetIntegerv(names[i], &after[i]);
            EXPECT_EQ(before[i], after[i]);
        }
        test_f.GetIntegerv(SAT__GL_VIEWPORT, viewport[1]);
        EXPECT(memcmp(viewport[0], viewport[1], sizeof viewport[0]) == 0);
        EXPECT(test_f.IsEnabled(SAT__GL_BLEND) && test_f.IsEnabled(SAT__GL_SCISSOR_TEST));
        EXPECT_EQ(test_f.GetError(), 0);
    }
    test_f.Disable(SAT__GL_BLEND);
    test_f.Disable(SAT__GL_SCISSOR_TEST);
    download(out, textures[1], GL_WIDTH, GL_HEIGHT);
    for (i = 0, k = 0; i < GL_WIDTH * GL_HEIGHT; i++) k += out[i] >= 0 && out[i] <= 1;
    EXPECT_EQ(k, GL_WIDTH * GL_HEIGHT);
    ssao_sat_gl_destroy(gl);
    test_f.DeleteTextures(2, textures);
}

static const char *hidden;
static sat_gl_proc hiding_get_proc(const char *name)
{
    return hidden && strcmp(name, hidden) == 0 ? NULL : test_gl.get_proc(name);
}

TEST(gpu_errors_have_names)
{
    static float z[64];
    ssao_sat_input in = ssao_sat_input_linear(z, 8, 8, 1), bad;
    ssao_sat_options o = ssao_sat_defaults();
    ssao_sat_gl *gl = NULL;
    float view[12];
    unsigned texture;
    sat_gl_target to;
    if (!open_gl()) SKIP(test_gl.message);
    support_fill(z, 64, 1, 2, 1);
    texture = upload(SAT__GL_R32F, 8, 8, z);
    hidden = "glDrawArrays";
    EXPECT_EQ(ssao_sat_gl_create(&gl, hiding_get_proc, 8, 8, NULL), SAT_ERR_GL_FUNCTION);
    EXPECT(strstr(ssao_sat_gl_message(gl), "glDrawArrays") != NULL);
    EXPECT_EQ(ssao_sat_gl_apply(gl, 0, texture, 0, &in), SAT_ERR_ARGUMENT);
    ssao_sat_gl_destroy(gl);
    hidden = NULL;
    EXPECT_EQ(ssao_sat_gl_create(NULL, test_gl.get_proc, 8, 8, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(ssao_sat_gl_create(&gl, test_gl.get_proc, 0, 8, NULL), SAT_ERR_ARGUMENT);
    o.slabs = 99;
    EXPECT_EQ(ssao_sat_gl_create(&gl, test_gl.get_proc, 8, 8, &o), SAT_ERR_ARGUMENT);
    EXPECT(gl == NULL);
    if (!EXPECT_EQ(ssao_sat_gl_create(&gl, test_gl.get_proc, 8, 8, NULL), SAT_OK)) return;
    EXPECT_EQ(ssao_sat_gl_apply(gl, 0, 0, 0, &in), SAT_ERR_ARGUMENT);
    EXPECT_EQ(ssao_sat_gl_apply_signed(gl, 0, texture, 0, &in), SAT_ERR_ARGUMENT); /* not asked for in create */
#ifndef SSAO_SAT_NO_BENT
    EXPECT_EQ(ssao_sat_gl_apply_bent(gl, 0, texture, 0, &in), SAT_ERR_ARGUMENT);
    EXPECT_EQ(ssao_sat_gl_bent_texture(gl), 0);
#endif
    to = sat_gl_to_texture(texture);
    EXPECT_EQ(ssao_sat_gl_apply(gl, &to, texture, 0, &in), SAT_ERR_ARGUMENT);
    bad = in;
    bad.width = 9;
    EXPECT_EQ(ssao_sat_gl_apply(gl, 0, texture, 0, &bad), SAT_ERR_SIZE);
    to = sat_gl_to_texture(0);
    to.place = SAT_GL_OWN;
    to.width = to.height = 7;
    EXPECT_EQ(ssao_sat_gl_apply(gl, &to, texture, 0, &in), SAT_ERR_MISMATCH);
    to.height = -1;
    EXPECT_EQ(ssao_sat_gl_apply(gl, &to, texture, 0, &in), SAT_ERR_ARGUMENT);
    bad = in;
    bad.projection[11] = 1;
    EXPECT_EQ(ssao_sat_gl_apply(gl, 0, texture, 0, &bad), SAT_ERR_ARGUMENT);
    EXPECT_EQ(ssao_sat_gl_view(view, &bad, 0), SAT_ERR_ARGUMENT);
    EXPECT_EQ(ssao_sat_gl_view(view, &in, 0), SAT_OK);
    ssao_sat_gl_destroy(gl);
    ssao_sat_gl_destroy(NULL);
    test_f.DeleteTextures(1, &texture);
}

/* The functions handed out compile in a shader of the caller. */
TEST(gpu_functions_for_other_shaders)
{
    static const char *const text[] = {
        "uniform vec4 view[3]; uniform sampler2D depth; out vec4 color;\n"
        "void main() {\n"
        "    ivec2 p = ivec2(gl_FragCoord.xy);\n"
        "    float z = ssao_sat_distance(view, texelFetch(depth, p, 0).r);\n"
        "    vec3 at = ssao_sat_position(view, p, z), n = ssao_sat_depth_normal(view, depth, p, z);\n"
        "    color = vec4(at + n, ssao_sat_edge(at, n, at, n));\n"
        "}\n", NULL};
    const char *library[2];
    sat__gl_shaders shaders;
    unsigned program = 0;
    if (!open_gl()) SKIP(test_gl.message);
    library[0] = ssao_sat_gl_glsl();
    library[1] = NULL;
    memset(&shaders, 0, sizeof shaders);
    shaders.name = "caller";
    shaders.library = library;
    shaders.fragment = text;
    if (!EXPECT_EQ(sat__gl_build(&test_f, &program, &shaders), SAT_OK)) puts(test_f.message);
    test_f.DeleteProgram(program);
}

/* What only the C code takes, or what turns the picture. */
static int means_nothing(const char *name)
{
    return strcmp(name, "float_table") == 0 || strcmp(name, "bottom_up") == 0 || strcmp(name, "tolerance") == 0;
}

/* What needs other shaders, by name: what ssao_sat_gl_set_options refuses to change. */
static int is_compiled(const char *name)
{
    static const char *const names[] = {"method",        "half_resolution", "slabs",          "scales",  "plane_boxes",
                                        "refine_levels", "as_printed",      "inverted_depth", "gl_bent", "gl_signed"};
    size_t i;
    for (i = 0; i < sizeof names / sizeof names[0]; i++)
        if (strcmp(names[i], name) == 0) return 1;
    return 0;
}

TEST(gpu_corners_of_the_options)
{
    ssao_sat_options defaults = ssao_sat_defaults();
    ssao_sat_gl *kept = NULL;
    ref_picture p;
    int i, a;
    if (!open_gl()) SKIP(test_gl.message);
    p = small_picture(1, 0);
    EXPECT_EQ(ssao_sat_gl_create(&kept, test_gl.get_proc, GL_WIDTH, GL_HEIGHT, &defaults), SAT_OK);
    for (i = 0; i < SSAO_SAT__FIELDS; i++)
        for (a = 0; a < 2; a++) {
            const sat__field *f = &ssao_sat__fields[i];
            ssao_sat_options o = ssao_sat_defaults();
            if (f->type == 'a' || f->type == 't') continue;
            o.radius = 0.3;
            sat__field_set(f, &o, a ? f->high : f->low);
            if (strcmp(f->name, "min_pixels") == 0) o.max_pixels = 512;
            if (means_nothing(f->name)) continue;
            if (strcmp(f->name, "max_pixels") == 0 && !a) o.min_pixels = 1;
            compare_by(is_compiled(f->name) ? NULL : kept, &p, o, REF_LINEAR, 1, 0.01);
        }
    ssao_sat_gl_destroy(kept);
    ref_free(&p);
}

enum { CORNER = 16 };

/* Both on a picture of 16 x 16; -1 when both refuse the options, else the largest difference. */
static double corner_difference(ssao_sat_gl *gl, const ssao_sat_options *o, const ssao_sat_input *in, unsigned depth)
{
    static float a[CORNER * CORNER], b[CORNER * CORNER];
    double worst = 0;
    int i;
    sat_result c = run_c(b, in, o), g = ssao_sat_gl_set_options(gl, o);
    if (c != SAT_OK || g != SAT_OK) return c == g ? -1 : 9;
    if (ssao_sat_gl_apply(gl, 0, depth, 0, in) != SAT_OK) return 9;
    download(a, ssao_sat_gl_texture(gl), CORNER, CORNER);
    for (i = 0; i < CORNER * CORNER; i++) worst = support_larger(worst, fabs((double)a[i] - (double)b[i]));
    return worst;
}

/* One object; lowest and highest values of what it can change, or all pairs of them. */
static void corners_of_object(ssao_sat_options base, const ssao_sat_input *in, unsigned depth, int pairs)
{
    ssao_sat_gl *gl = NULL;
    int i, j, k;
    EXPECT_EQ(ssao_sat_gl_create(&gl, test_gl.get_proc, CORNER, CORNER, &base), SAT_OK);
    for (i = 0; i < SSAO_SAT__FIELDS && gl; i++)
        for (j = pairs ? 0 : i; j <= i; j++)
            for (k = 0; k < 4; k++) {
                const sat__field *f = &ssao_sat__fields[i], *g = &ssao_sat__fields[j];
                ssao_sat_options o = base;
                double d;
                if (f->type == 'a' || f->type == 't' || g->type == 'a' || g->type == 't') continue;
                if (is_compiled(f->name) || is_compiled(g->name)) continue;
                if (means_nothing(f->name) || means_nothing(g->name)) continue;
                if ((i == j) != ((k & 1) == k >> 1)) continue; /* a pair: one low, one high */
                sat__field_set(f, &o, k & 1 ? f->high : f->low);
                sat__field_set(g, &o, k & 2 ? g->high : g->low);
                d = corner_difference(gl, &o, in, depth);
                if (!EXPECT(d < 0.02)) printf("    method %d: %s and %s, %d: %g\n", (int)o.method, f->name, g->name, k, d);
            }
    ssao_sat_gl_destroy(gl);
}

/* Pairs of corners of what is free in the frame; and its corners with those of what shaders are made for. (Shaders
   take long to compile: not all pairs of these.) */
TEST(gpu_pairs_of_the_options)
{
    static float z[CORNER * CORNER];
    ssao_sat_input in = ssao_sat_input_linear(z, CORNER, CORNER, 1);
    unsigned depth;
    int i, k, m;
    if (!open_gl()) SKIP(test_gl.message);
    for (i = 0; i < CORNER * CORNER; i++) z[i] = i == 40 ? 0 : 2 + 0.5f * (float)((i % CORNER > 7) + (i / CORNER > 9));
    depth = upload(SAT__GL_R32F, CORNER, CORNER, z);
    corners_of_object(ssao_sat_defaults(), &in, depth, 1);
    for (m = 0; m < 2; m++)
        for (k = 0; k < 4; k++) {
            ssao_sat_options o = ssao_sat_defaults();
            o.method = (ssao_sat_method)(m ? (int)SSAO_SAT__LAST_METHOD : (int)SSAO_SAT__FIRST_METHOD);
            for (i = 0; i < SSAO_SAT__FIELDS; i++) {
                const sat__field *f = &ssao_sat__fields[i];
                if (!is_compiled(f->name) || strcmp(f->name, "method") == 0) continue;
                if (strcmp(f->name, "half_resolution") == 0) sat__field_set(f, &o, k & 1);
                else sat__field_set(f, &o, k & 2 ? f->high : f->low);
            }
            corners_of_object(o, &in, depth, 0);
        }
    test_f.DeleteTextures(1, &depth);
}

static int programs_made;
static unsigned SAT__GL_CALL count_program(void) { programs_made++; return 0; }

TEST(nothing_is_compiled_in_a_frame)
{
    static float z[GL_WIDTH * GL_HEIGHT];
    ssao_sat_options o = ssao_sat_defaults();
    ssao_sat_input in;
    ssao_sat_gl *gl = NULL;
    ref_picture p;
    unsigned depth, normals;
    int k;
    if (!open_gl()) SKIP(test_gl.message);
    p = small_picture(0, 0);
    in = ref_input(&p, REF_LINEAR, z);
    depth = upload(SAT__GL_R32F, GL_WIDTH, GL_HEIGHT, p.z);
    normals = upload(SAT__GL_RGB32F, GL_WIDTH, GL_HEIGHT, p.normals);
    o.gl_bent = o.gl_signed = 1;
    if (!EXPECT_EQ(ssao_sat_gl_create(&gl, test_gl.get_proc, GL_WIDTH, GL_HEIGHT, &o), SAT_OK)) return;
    gl->gl.CreateProgram = count_program;
    for (k = 0; k < 4; k++) {
        EXPECT_EQ(ssao_sat_gl_apply(gl, 0, depth, k % 2 ? normals : 0, &in), SAT_OK);
        EXPECT_EQ(ssao_sat_gl_apply_signed(gl, 0, depth, k % 2 ? normals : 0, &in), SAT_OK);
#ifndef SSAO_SAT_NO_BENT
        EXPECT_EQ(ssao_sat_gl_apply_bent(gl, 0, depth, k % 2 ? normals : 0, &in), SAT_OK);
#endif
    }
    EXPECT_EQ(programs_made, 0);
    ssao_sat_gl_destroy(gl);
    test_f.DeleteTextures(1, &depth);
    test_f.DeleteTextures(1, &normals);
    ref_free(&p);
}

TEST(gpu_options_change_in_the_frame)
{
    static float z[GL_WIDTH * GL_HEIGHT], a[GL_WIDTH * GL_HEIGHT], b[GL_WIDTH * GL_HEIGHT];
    ssao_sat_options o = ssao_sat_defaults(), other;
    ssao_sat_input in;
    ssao_sat_gl *gl = NULL;
    ref_picture p;
    unsigned depth;
    if (!open_gl()) SKIP(test_gl.message);
    p = small_picture(0, 0);
    in = ref_input(&p, REF_LINEAR, z);
    in.normals = NULL;
    depth = upload(SAT__GL_R32F, GL_WIDTH, GL_HEIGHT, p.z);
    if (!EXPECT_EQ(ssao_sat_gl_create(&gl, test_gl.get_proc, GL_WIDTH, GL_HEIGHT, &o), SAT_OK)) return;
    other = o;
    other.radius = 0.2;
    other.gain = 1.5;
    other.max_pixels = 30;
    other.tolerance = 0;
    EXPECT_EQ(ssao_sat_gl_set_options(gl, &other), SAT_OK);
    EXPECT_EQ(ssao_sat_gl_apply(gl, 0, depth, 0, &in), SAT_OK);
    download(a, ssao_sat_gl_texture(gl), GL_WIDTH, GL_HEIGHT);
    EXPECT_EQ(run_c(b, &in, &other), SAT_OK);
    EXPECT_NEAR(ref_rmse(&p, a, b), 0, 2e-3);
    other.slabs = 4;
    EXPECT_EQ(ssao_sat_gl_set_options(gl, &other), SAT_ERR_MISMATCH);
    other.slabs = 99;
    EXPECT_EQ(ssao_sat_gl_set_options(gl, &other), SAT_ERR_ARGUMENT);
    EXPECT_EQ(ssao_sat_gl_set_options(NULL, &o), SAT_ERR_ARGUMENT);
    ssao_sat_gl_destroy(gl);
    test_f.DeleteTextures(1, &depth);
    ref_free(&p);
}

/* All outputs of an object, one behind the other; `to` draws into a texture of GL_WIDTH x GL_HEIGHT. */
static void all_outputs(float *out, ssao_sat_gl *gl, const ssao_sat_input *in, const unsigned *textures, int from)
{
    const size_t picture = (size_t)GL_WIDTH * GL_HEIGHT;
    sat_gl_target to = sat_gl_to_texture(textures[2]);
    sat__gl_state state;
    to.from_x = to.from_y = from;
    EXPECT_EQ(ssao_sat_gl_apply(gl, &to, textures[0], textures[1], in), SAT_OK);
    download(out, textures[2], GL_WIDTH, GL_HEIGHT);
    EXPECT_EQ(ssao_sat_gl_apply(gl, &to, textures[0], 0, in), SAT_OK);
    download(out + picture, textures[2], GL_WIDTH, GL_HEIGHT);
    EXPECT_EQ(ssao_sat_gl_apply_signed(gl, &to, textures[0], textures[1], in), SAT_OK);
    download(out + 2 * picture, textures[2], GL_WIDTH, GL_HEIGHT);
#ifndef SSAO_SAT_NO_BENT
    if (gl->options.method != SSAO_SAT_SLABS) return;
    to.name = textures[3];
    EXPECT_EQ(ssao_sat_gl_apply_bent(gl, &to, textures[0], textures[1], in), SAT_OK);
    sat__gl_begin(&test_f, &state, 1);
    EXPECT_EQ(sat__gl_read(&test_f, out + 3 * picture, textures[3], SAT__GL_RGBA16F, GL_WIDTH, GL_HEIGHT), SAT_OK);
    sat__gl_end(&test_f, &state);
#else
    (void)state;
#endif
}

static void another_size(ssao_sat_method method, int half_resolution, const unsigned *textures, int from)
{
    enum { SMALL_WIDTH = 41, SMALL_HEIGHT = 29 };
    static float out[2][7 * GL_WIDTH * GL_HEIGHT], noise[GL_WIDTH * GL_HEIGHT];
    ssao_sat_input in = ssao_sat_input_linear(noise, GL_WIDTH, GL_HEIGHT, 1);
    ssao_sat_options o = ssao_sat_defaults();
    ssao_sat_gl *large = NULL, *small_one = NULL;
    unsigned rough;
    int i;
    o.method = method;
    o.half_resolution = half_resolution;
    o.geometric = o.gl_bent = o.gl_signed = 1;
    support_fill(noise, GL_WIDTH * GL_HEIGHT, 1, 9, 7);
    rough = upload(SAT__GL_R32F, GL_WIDTH, GL_HEIGHT, noise);
    EXPECT_EQ(ssao_sat_gl_create(&large, test_gl.get_proc, GL_WIDTH, GL_HEIGHT, &o), SAT_OK);
    EXPECT_EQ(ssao_sat_gl_create(&small_one, test_gl.get_proc, SMALL_WIDTH, SMALL_HEIGHT, &o), SAT_OK);
    EXPECT_EQ(ssao_sat_gl_apply(large, NULL, rough, 0, &in), SAT_OK);
    in = ssao_sat_input_linear(noise, SMALL_WIDTH, SMALL_HEIGHT, 1);
    memset(out, 0, sizeof out);
    all_outputs(out[1], small_one, &in, textures, from);
    all_outputs(out[0], large, &in, textures, from);
    if (!EXPECT(memcmp(out[0], out[1], sizeof out[0]) == 0))
        printf("    method %d, half %d, from %d\n", (int)method, half_resolution, from);
    for (i = 0; i < 3 * GL_WIDTH * GL_HEIGHT; i++) {
        int x = i % GL_WIDTH, y = i / GL_WIDTH % GL_HEIGHT;
        if (x < SMALL_WIDTH && y < SMALL_HEIGHT) continue;
        if (!EXPECT_NEAR(out[0][i], -7, 0)) break; /* what the texture was filled with */
    }
    EXPECT_EQ(ssao_sat_gl_apply(large, NULL, textures[0], 0, &in), SAT_OK); /* the own texture's corner */
    download(out[0], ssao_sat_gl_texture(large), GL_WIDTH, GL_HEIGHT);
    EXPECT_EQ(ssao_sat_gl_apply(small_one, NULL, textures[0], 0, &in), SAT_OK);
    download(out[1], ssao_sat_gl_texture(small_one), SMALL_WIDTH, SMALL_HEIGHT);
    for (i = 0; i < SMALL_HEIGHT; i++)
        EXPECT(memcmp(out[0] + i * GL_WIDTH, out[1] + i * SMALL_WIDTH, SMALL_WIDTH * sizeof(float)) == 0);
    in.width = GL_WIDTH + 1;
    EXPECT_EQ(ssao_sat_gl_apply(large, NULL, textures[0], 0, &in), SAT_ERR_SIZE);
    in.width = 0;
    EXPECT_EQ(ssao_sat_gl_apply(large, NULL, textures[0], 0, &in), SAT_ERR_ARGUMENT);
    ssao_sat_gl_destroy(large);
    ssao_sat_gl_destroy(small_one);
    test_f.DeleteTextures(1, &rough);
}

/* What was created for a size takes any smaller one in a frame: the bits of an object of that size, whatever a larger
   frame left in the textures, and nothing beyond the picture is written. The picture lies anywhere in its inputs. */
TEST(gpu_takes_another_size_a_frame)
{
    static float filler[4 * GL_WIDTH * GL_HEIGHT];
    unsigned textures[4];
    ref_picture p;
    int i;
    if (!open_gl()) SKIP(test_gl.message);
    p = small_picture(1, 0);
    for (i = 0; i < 4 * GL_WIDTH * GL_HEIGHT; i++) filler[i] = -7;
    textures[0] = upload(SAT__GL_R32F, GL_WIDTH, GL_HEIGHT, p.z);
    textures[1] = upload(SAT__GL_RGB32F, GL_WIDTH, GL_HEIGHT, p.normals);
    textures[2] = upload(SAT__GL_R32F, GL_WIDTH, GL_HEIGHT, filler);
    textures[3] = upload(SAT__GL_RGBA16F, GL_WIDTH, GL_HEIGHT, NULL);
    another_size(SSAO_SAT_SLABS, 1, textures, 0);
    another_size(SSAO_SAT_SLABS, 1, textures, 11);
    another_size(SSAO_SAT_SLABS, 0, textures, 7);
    another_size(SSAO_SAT_PLANE, 1, textures, 3);
    another_size((ssao_sat_method)SSAO_SAT__LAST_METHOD, 0, textures, 0);
    test_f.DeleteTextures(4, textures);
    ref_free(&p);
}

/* Down to one pixel and up again: what the CPU says of each. */
TEST(gpu_sizes_of_all_kinds)
{
    static const int sizes[][2] = {{GL_WIDTH, GL_HEIGHT}, {1, 1}, {GL_WIDTH, 1}, {2, GL_HEIGHT}, {3, 2}, {64, 32},
                                   {GL_WIDTH, GL_HEIGHT}};
    static float a[GL_WIDTH * GL_HEIGHT], b[GL_WIDTH * GL_HEIGHT];
    ssao_sat_options o = ssao_sat_defaults();
    ssao_sat_gl *gl = NULL;
    unsigned depth;
    ref_picture p;
    int k, x, y;
    if (!open_gl()) SKIP(test_gl.message);
    p = small_picture(1, 0);
    depth = upload(SAT__GL_R32F, GL_WIDTH, GL_HEIGHT, p.z);
    o.tolerance = 0;
    EXPECT_EQ(ssao_sat_gl_create(&gl, test_gl.get_proc, GL_WIDTH, GL_HEIGHT, &o), SAT_OK);
    for (k = 0; k < (int)(sizeof sizes / sizeof sizes[0]); k++) {
        ssao_sat_input in = ssao_sat_input_linear(p.z, sizes[k][0], sizes[k][1], 1);
        double off = 0;
        in.depth_stride = GL_WIDTH * (ptrdiff_t)sizeof(float);
        EXPECT_EQ(run_c(a, &in, &o), SAT_OK);
        EXPECT_EQ(ssao_sat_gl_apply(gl, NULL, depth, 0, &in), SAT_OK);
        download(b, ssao_sat_gl_texture(gl), GL_WIDTH, GL_HEIGHT);
        for (y = 0; y < in.height; y++)
            for (x = 0; x < in.width; x++) off += fabs((double)a[y * in.width + x] - (double)b[y * GL_WIDTH + x]);
        if (!EXPECT_NEAR(off / (in.width * in.height), 0, 2e-3)) printf("    %d x %d\n", in.width, in.height);
    }
    ssao_sat_gl_destroy(gl);
    test_f.DeleteTextures(1, &depth);
    ref_free(&p);
}

/* With normals smoother than the mesh: the surface itself, from the depths where the picture lies in its texture. */
TEST(gpu_geometric_normals_anywhere)
{
    static float z[GL_WIDTH * GL_HEIGHT], a[GL_WIDTH * GL_HEIGHT], b[GL_WIDTH * GL_HEIGHT];
    enum { FROM = 13 };
    ssao_sat_input in = ssao_sat_input_linear(z, GL_WIDTH - FROM, GL_HEIGHT - FROM, 1);
    ssao_sat_options o = ssao_sat_defaults();
    ssao_sat_gl *gl = NULL;
    sat_gl_target to;
    unsigned textures[3];
    ref_picture p;
    double off = 0;
    int i, x, y;
    if (!open_gl()) SKIP(test_gl.message);
    p = small_picture(1, 0);
    for (i = 0; i < GL_WIDTH * GL_HEIGHT; i++) p.normals[3 * i] = p.normals[3 * i + 1] = 0, p.normals[3 * i + 2] = 1;
    o.geometric = 1;
    o.tolerance = 0;
    o.half_resolution = 0;
    textures[0] = upload(SAT__GL_R32F, GL_WIDTH, GL_HEIGHT, p.z);
    textures[1] = upload(SAT__GL_RGB32F, GL_WIDTH, GL_HEIGHT, p.normals);
    textures[2] = upload(SAT__GL_R32F, GL_WIDTH, GL_HEIGHT, NULL);
    to = sat_gl_to_texture(textures[2]);
    to.from_x = to.from_y = FROM;
    EXPECT_EQ(ssao_sat_gl_create(&gl, test_gl.get_proc, in.width, in.height, &o), SAT_OK);
    EXPECT_EQ(ssao_sat_gl_apply(gl, &to, textures[0], textures[1], &in), SAT_OK);
    download(b, textures[2], GL_WIDTH, GL_HEIGHT);
    in.depth = p.z + FROM * GL_WIDTH + FROM;
    in.depth_stride = in.normal_stride = GL_WIDTH * (ptrdiff_t)sizeof(float);
    in.normals = p.normals;
    in.normal_stride *= 3;
    EXPECT_EQ(run_c(a, &in, &o), SAT_OK);
    for (y = 0; y < in.height; y++)
        for (x = 0; x < in.width; x++) off += fabs((double)a[y * in.width + x] - (double)b[y * GL_WIDTH + x]);
    EXPECT_NEAR(off / (in.width * in.height), 0, 2e-3);
    ssao_sat_gl_destroy(gl);
    test_f.DeleteTextures(3, textures);
    ref_free(&p);
}
