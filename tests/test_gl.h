/* Targets, depth buffers, and calls of a frame, for all headers alike. Needs OSMesa (or a GPU, see gl_context.h) but
   for what the fake driver answers. */

#include "gl_context.h"
#include "gl_fake.h"
#include "reference_fiv.h"
#include "support.h"

enum { GL_W = 37, GL_H = 22, GL_N = GL_W * GL_H, GL_BIG_W = 90, GL_BIG_H = 60 };

static gl_context gl_screen;
static sat__gl gl_f;

/* The context is made by the first test, for all of them. */
static int gl_open(void)
{
    if (gl_screen.context) return 1;
    if (!gl_context_open(&gl_screen, 3, 3)) {
        expect_skip(gl_screen.message);
        return 0;
    }
    return EXPECT_EQ(sat__gl_open(&gl_f, gl_screen.get_proc), SAT_OK);
}

static void gl_close(void) { EXPECT_EQ(gl_f.GetError(), 0); }

static unsigned gl_texture(unsigned internal, int width, int height, const void *pixels)
{
    sat__gl_state state;
    unsigned texture = 0;
    sat__gl_begin(&gl_f, &state, 1);
    EXPECT_EQ(sat__gl_texture(&gl_f, &texture, internal, width, height, pixels), SAT_OK);
    sat__gl_end(&gl_f, &state);
    return texture;
}

/* A 2D array texture of 3 layers. */
static unsigned gl_array(unsigned internal, int width, int height)
{
    void(SAT__GL_CALL * image)(unsigned target, int level, int internal, int width, int height, int depth, int border,
                               unsigned format, unsigned type, const void *pixels);
    sat_gl_proc proc = gl_screen.get_proc("glTexImage3D");
    unsigned texture = 0, format = 0, type = 0;
    memcpy(&image, &proc, sizeof proc);
    sat__gl_transfer(internal, &format, &type);
    gl_f.GenTextures(1, &texture);
    gl_f.BindTexture(0x8C1A, texture);
    image(0x8C1A, 0, (int)internal, width, height, 3, 0, format, type, NULL);
    gl_f.TexParameteri(0x8C1A, SAT__GL_TEXTURE_MAX_LEVEL, 0);
    gl_f.BindTexture(0x8C1A, 0);
    return texture;
}

/* The lower left part of what a framebuffer's first attachment holds, 4 floats or bytes a pixel. */
static void gl_read(void *pixels, unsigned framebuffer, unsigned internal, int width, int height)
{
    sat__gl_state state;
    unsigned format = 0, type = 0;
    sat__gl_begin(&gl_f, &state, 1);
    gl_f.BindFramebuffer(SAT__GL_FRAMEBUFFER, framebuffer);
    sat__gl_transfer(internal, &format, &type);
    gl_f.ReadPixels(0, 0, width, height, format, type, pixels);
    sat__gl_end(&gl_f, &state);
}

/* ---- one call of each header that makes a picture */

typedef struct gl_scene {
    unsigned hdr, depth, normals, points; /* the inputs */
    float linear[GL_N];
    tonemap_gl *tone;
    ssao_sat_gl *ao;
    ssao_sat_input input;
    fiv_gl *shadows;
    reference_mesh mesh;
    fiv_environment *light;
    fiv_occluder *occluder;
    fiv_instance instance;
    raindrop_environment *mirror;
    raindrop_rain *drops;
    raindrop_gl *rain;
} gl_scene;

enum { GL_TONE, GL_AO, GL_SHADOWS, GL_RAIN, GL_CALLS };

static unsigned gl_format(int call)
{
    return call == GL_TONE ? SAT__GL_RGBA8 : call == GL_AO ? SAT__GL_R32F : SAT__GL_RGBA32F;
}

static sat_result gl_call(gl_scene *s, int call, const sat_gl_target *to)
{
    if (call == GL_TONE) return tonemap_gl_apply(s->tone, to, s->hdr, 0);
    if (call == GL_AO) return ssao_sat_gl_apply(s->ao, to, s->depth, s->normals, &s->input);
    if (call == GL_SHADOWS) return fiv_gl_irradiance(s->shadows, to, s->points, s->normals, NULL);
    return raindrop_gl_render(s->rain, to, GL_W, GL_H, NULL, NULL, NULL);
}

static unsigned gl_own(gl_scene *s, int call)
{
    return call == GL_TONE     ? tonemap_gl_texture(s->tone)
           : call == GL_AO      ? ssao_sat_gl_texture(s->ao)
           : call == GL_SHADOWS ? fiv_gl_texture(s->shadows)
                                : 0;
}

static unsigned gl_input(gl_scene *s, int call)
{
    return call == GL_TONE ? s->hdr : call == GL_AO ? s->depth : s->points;
}

/* What all scenes read: the occluder, its light and the drops are the CPU's. */
static void gl_create_cpu(gl_scene *s)
{
    static float sky[16 * 8 * 3];
    sat_image image = sat_image_f32(sky, 16, 8, 3);
    fiv_occluder_options fo = fiv_occluder_defaults();
    raindrop_rain_options ro = raindrop_rain_defaults();
    support_fill(sky, 16 * 8 * 3, 0.1, 2, 3);
    fo.theta = 8, fo.phi = 5, fo.rho = 4;
    s->mesh = reference_knot(2, 3, 20, 6, 0.25);
    EXPECT_EQ(fiv_environment_create(&s->light, &image, NULL, NULL), SAT_OK);
    EXPECT_EQ(fiv_occluder_create(&s->occluder, s->mesh.positions, s->mesh.vertices, s->mesh.indices,
                                  s->mesh.triangles, &fo, NULL),
              SAT_OK);
    EXPECT_EQ(fiv_occluder_light(s->occluder, s->light, NULL), SAT_OK);
    memset(&s->instance, 0, sizeof s->instance);
    s->instance.occluder = s->occluder;
    s->instance.scale = 1;
    ro.rate_mm_h = 300;
    ro.box_size[0] = ro.box_size[1] = ro.box_size[2] = 2;
    EXPECT_EQ(raindrop_environment_create(&s->mirror, &image, NULL, NULL), SAT_OK);
    EXPECT_EQ(raindrop_rain_create(&s->drops, &ro), SAT_OK);
}

/* Objects for pictures of this size. */
static void gl_create_sized(gl_scene *s, sat_gl_get_proc *get_proc, int width, int height)
{
    static gl_scene cpu;
    raindrop_gl_options rg = raindrop_gl_defaults();
    if (!cpu.drops) gl_create_cpu(&cpu);
    *s = cpu;
    EXPECT_EQ(tonemap_gl_create(&s->tone, get_proc, width, height, NULL), SAT_OK);
    EXPECT_EQ(ssao_sat_gl_create(&s->ao, get_proc, width, height, NULL), SAT_OK);
    EXPECT_EQ(fiv_gl_create(&s->shadows, get_proc, width, height, NULL), SAT_OK);
    EXPECT_EQ(fiv_gl_set_scene(s->shadows, s->light, &s->instance, 1), SAT_OK);
    rg.lamps = rg.oscillation = 1;
    EXPECT_EQ(raindrop_gl_create(&s->rain, get_proc, &rg), SAT_OK);
    EXPECT_EQ(raindrop_gl_set_environment(s->rain, s->mirror), SAT_OK);
    EXPECT_EQ(raindrop_gl_set_rain(s->rain, s->drops), SAT_OK);
    s->input = ssao_sat_input_linear(NULL, width, height, 1);
}

static void gl_create(gl_scene *s, sat_gl_get_proc *get_proc) { gl_create_sized(s, get_proc, GL_W, GL_H); }

static void gl_fill(gl_scene *s)
{
    static float rgba[4 * GL_N];
    int i;
    support_fill(rgba, 4 * GL_N, 0.01, 4, 1);
    s->hdr = gl_texture(SAT__GL_RGBA32F, GL_W, GL_H, rgba);
    for (i = 0; i < GL_N; i++) s->linear[i] = 1 + 0.3f * sinf(0.4f * (float)(i % GL_W)) + (i / GL_W > 12 ? 0.5f : 0);
    s->depth = gl_texture(SAT__GL_R32F, GL_W, GL_H, s->linear);
    for (i = 0; i < GL_N; i++) {
        rgba[4 * i] = 3 * ((float)(i % GL_W) / GL_W - 0.5f), rgba[4 * i + 1] = -0.8f, rgba[4 * i + 3] = 1;
        rgba[4 * i + 2] = 3 * ((float)i / GL_N - 0.5f);
    }
    s->points = gl_texture(SAT__GL_RGBA32F, GL_W, GL_H, rgba);
    for (i = 0; i < GL_N; i++) rgba[4 * i] = 0.1f, rgba[4 * i + 1] = 0.3f, rgba[4 * i + 2] = 0.9f;
    s->normals = gl_texture(SAT__GL_RGBA32F, GL_W, GL_H, rgba);
}

static void gl_destroy(gl_scene *s)
{
    tonemap_gl_destroy(s->tone);
    ssao_sat_gl_destroy(s->ao);
    fiv_gl_destroy(s->shadows);
    raindrop_gl_destroy(s->rain);
}

/* A scene with its inputs, made by the first test that draws, for all of them; who changes it changes it back. */
static gl_scene *gl_open_scene(void)
{
    static gl_scene shared;
    if (shared.tone) return &shared;
    if (!gl_open()) return NULL;
    gl_create(&shared, gl_screen.get_proc);
    gl_fill(&shared);
    return &shared;
}

/* The picture `small` at (x, y) of `big`, rows reversed or not, and nothing elsewhere; the number of wrong pixels. */
static int gl_compare(const unsigned char *big, const unsigned char *small, int bytes, int x, int y, int flip)
{
    static const unsigned char nothing[16] = {0};
    int i, j, wrong = 0;
    for (j = 0; j < GL_BIG_H; j++)
        for (i = 0; i < GL_BIG_W; i++) {
            int inside = i >= x && j >= y && i < x + GL_W && j < y + GL_H, row = flip ? GL_H - 1 - (j - y) : j - y;
            const unsigned char *want = inside ? small + bytes * (row * GL_W + (i - x)) : nothing;
            wrong += memcmp(big + bytes * (j * GL_BIG_W + i), want, (size_t)bytes) != 0;
        }
    return wrong;
}

/* Own texture, texture, layer, framebuffer; with offsets, beyond the border, upside down: the same bits. */
TEST(pictures_go_where_the_target_says)
{
    static unsigned char own[16 * GL_N], big[16 * GL_BIG_W * GL_BIG_H];
    static const int corners[][3] = {{0, 0, 0}, {41, 20, 0}, {11, 3, 1}, {70, -9, 0}, {-5, 50, 1}};
    static const float nothing[4] = {0, 0, 0, 0};
    gl_scene *s;
    int call, k, place;
    s = gl_open_scene();
    if (!s) return;
    for (call = 0; call < GL_CALLS; call++) {
        unsigned internal = gl_format(call), framebuffer = 0, format, type;
        unsigned texture = gl_texture(internal, GL_BIG_W, GL_BIG_H, NULL);
        unsigned array = gl_array(internal, GL_BIG_W, GL_BIG_H);
        int bytes = sat__gl_transfer(internal, &format, &type);
        unsigned small = gl_texture(internal, GL_W, GL_H, NULL); /* drops have no texture of their own */
        sat_gl_target alone = sat_gl_to_texture(small);
        sat__gl_state state;
        sat__gl_begin(&gl_f, &state, 1);
        EXPECT_EQ(sat__gl_attach(&gl_f, gl_f.framebuffer, &small, 1, 0), SAT_OK);
        gl_f.ClearBufferfv(SAT__GL_COLOR, 0, nothing);
        sat__gl_end(&gl_f, &state);
        EXPECT_EQ(gl_call(s, call, call == GL_RAIN ? &alone : NULL), SAT_OK);
        sat__gl_begin(&gl_f, &state, 1);
        EXPECT_EQ(sat__gl_read(&gl_f, own, call == GL_RAIN ? small : gl_own(s, call), internal, GL_W, GL_H), SAT_OK);
        EXPECT_EQ(sat__gl_framebuffer(&gl_f, &framebuffer, &texture, 1, 0), SAT_OK);
        sat__gl_end(&gl_f, &state);
        for (place = SAT_GL_TEXTURE; place <= SAT_GL_FRAMEBUFFER; place++)
            for (k = 0; k < 5; k++) {
                sat_gl_target to = place == SAT_GL_TEXTURE ? sat_gl_to_texture(texture)
                                   : place == SAT_GL_LAYER ? sat_gl_to_layer(array, 1 + k % 2)
                                                           : sat_gl_to_framebuffer(framebuffer, 0, 0);
                to.x = corners[k][0];
                to.y = corners[k][1];
                to.flip = corners[k][2];
                sat__gl_begin(&gl_f, &state, 1);
                gl_f.BindFramebuffer(SAT__GL_FRAMEBUFFER, framebuffer);
                if (place == SAT_GL_LAYER)
                    gl_f.FramebufferTextureLayer(SAT__GL_FRAMEBUFFER, SAT__GL_COLOR_ATTACHMENT0, array, 0, 1 + k % 2);
                gl_f.ClearBufferfv(SAT__GL_COLOR, 0, nothing);
                sat__gl_end(&gl_f, &state);
                EXPECT_EQ(gl_call(s, call, &to), SAT_OK);
                gl_read(big, framebuffer, internal, GL_BIG_W, GL_BIG_H);
                EXPECT_EQ(gl_compare(big, own, bytes, corners[k][0], corners[k][1], corners[k][2]), 0);
                sat__gl_begin(&gl_f, &state, 1);
                gl_f.BindFramebuffer(SAT__GL_FRAMEBUFFER, framebuffer);
                gl_f.FramebufferTexture2D(SAT__GL_FRAMEBUFFER, SAT__GL_COLOR_ATTACHMENT0, SAT__GL_TEXTURE_2D, texture,
                                          0);
                sat__gl_end(&gl_f, &state);
            }
        gl_f.DeleteFramebuffers(1, &framebuffer);
        gl_f.DeleteTextures(1, &texture);
        gl_f.DeleteTextures(1, &array);
        gl_f.DeleteTextures(1, &small);
    }
    gl_close();
}

/* A picture in the middle of larger textures gives the bits it gives alone, whatever lies around it. */
TEST(inputs_may_lie_anywhere_in_their_textures)
{
    static float big[4 * GL_BIG_W * GL_BIG_H], small[4 * GL_N];
    static unsigned char own[16 * GL_N], there[16 * GL_N];
    static const int corners[][2] = {{0, 0}, {41, 20}, {3, 17}};
    gl_scene *s;
    sat_gl_target to = sat_gl_to(SAT_GL_OWN, 0, 0, 0, 0, 0);
    sat__gl_state state;
    int call, k, i, normals;
    s = gl_open_scene();
    if (!s) return;
    for (call = 0; call < GL_RAIN; call++)
        for (k = 0; k < 3; k++)
            for (normals = call != GL_AO; normals < 2; normals++) {
                unsigned *inputs[3], kept[3], internal = gl_format(call), framebuffer = 0;
                int count = 0, j;
                if (call == GL_TONE) inputs[count++] = &s->hdr;
                if (call == GL_AO) inputs[count++] = &s->depth;
                if (call == GL_SHADOWS) inputs[count++] = &s->points;
                if (call != GL_TONE) inputs[count++] = &s->normals;
                kept[2] = s->normals;
                if (!normals) s->normals = 0, count = 1; /* from depth */
                EXPECT_EQ(gl_call(s, call, NULL), SAT_OK);
                sat__gl_begin(&gl_f, &state, 1);
                EXPECT_EQ(sat__gl_read(&gl_f, own, gl_own(s, call), internal, GL_W, GL_H), SAT_OK);
                for (j = 0; j < count; j++) {
                    kept[j] = *inputs[j];
                    EXPECT_EQ(sat__gl_framebuffer(&gl_f, &framebuffer, &kept[j], 1, 0), SAT_OK);
                    gl_f.ReadPixels(0, 0, GL_W, GL_H, SAT__GL_RGBA, SAT__GL_FLOAT, small);
                    gl_f.DeleteFramebuffers(1, &framebuffer);
                    support_fill(big, 4 * GL_BIG_W * GL_BIG_H, 0.1, 900, 5);
                    for (i = 0; i < GL_N; i++)
                        memcpy(big + 4 * ((corners[k][1] + i / GL_W) * GL_BIG_W + corners[k][0] + i % GL_W),
                               small + 4 * i, 16);
                    sat__gl_end(&gl_f, &state);
                    *inputs[j] = gl_texture(SAT__GL_RGBA32F, GL_BIG_W, GL_BIG_H, big);
                    sat__gl_begin(&gl_f, &state, 1);
                }
                sat__gl_end(&gl_f, &state);
                to.from_x = corners[k][0];
                to.from_y = corners[k][1];
                EXPECT_EQ(gl_call(s, call, &to), SAT_OK);
                sat__gl_begin(&gl_f, &state, 1);
                EXPECT_EQ(sat__gl_read(&gl_f, there, gl_own(s, call), internal, GL_W, GL_H), SAT_OK);
                EXPECT(memcmp(own, there, sizeof(float) * GL_N * (internal == SAT__GL_RGBA32F ? 4 : 1)) == 0);
                for (j = 0; j < count; j++) {
                    gl_f.DeleteTextures(1, inputs[j]);
                    *inputs[j] = kept[j];
                }
                sat__gl_end(&gl_f, &state);
                s->normals = kept[2];
            }
    to.from_y = -1;
    for (call = 0; call < GL_RAIN; call++) EXPECT_EQ(gl_call(s, call, &to), SAT_ERR_ARGUMENT);
    gl_close();
}

/* ---- dynamic resolution: a frame may be smaller than the object was created for */

static const int GL_SMALL_W = 29, GL_SMALL_H = 13;

/* Tables and means of the small picture, by an object that has made a larger one before, and by a new one. */
static void gl_compare_tables(unsigned source, sat_gl_options go, int tiled)
{
    static float a[4 * GL_N], b[4 * GL_N];
    sat_gl *tables[2];
    sat__gl_state state;
    int k, tries;
    unsigned target = gl_texture(SAT__GL_RGBA32F, GL_W, GL_H, NULL);
    for (k = 0; k < 2; k++) {
        unsigned mean_texture, own;
        float mean[2];
        go.width = k ? 0 : GL_W, go.height = k ? 0 : GL_H;
        EXPECT_EQ(sat_gl_create(&tables[k], gl_screen.get_proc, &go), SAT_OK);
        if (!k) EXPECT_EQ(sat_gl_build(tables[k], 0, source, GL_W, GL_H), SAT_OK);
        if (!k) EXPECT_EQ(sat_gl_mean(tables[k], NULL, source, GL_W, GL_H), SAT_OK);
        mean_texture = sat_gl_mean_texture(tables[k]), own = sat_gl_table(tables[k]);
        for (tries = 0; tries < 2; tries++) /* and again, with nothing to set up */
            EXPECT_EQ(sat_gl_build(tables[k], 0, source, GL_SMALL_W, GL_SMALL_H), SAT_OK);
        EXPECT_EQ(sat_gl_mean(tables[k], &mean[k], source, GL_SMALL_W, GL_SMALL_H), SAT_OK);
        EXPECT(k || (sat_gl_mean_texture(tables[k]) == mean_texture && sat_gl_table(tables[k]) == own));
        EXPECT(!k || (mean[0] <= mean[1] && mean[1] <= mean[0]));
        if (tiled) EXPECT_EQ(sat_gl_box_filter(tables[k], target, 3), SAT_OK);
        sat__gl_begin(&gl_f, &state, 1);
        sat__gl_read(&gl_f, k ? b : a, tiled ? target : sat_gl_table(tables[k]),
                     tiled ? SAT__GL_RGBA32F : SAT__GL_RG32F, GL_SMALL_W, GL_SMALL_H);
        sat__gl_end(&gl_f, &state);
    }
    EXPECT(memcmp(a, b, (tiled ? 16 : 8) * GL_SMALL_W * GL_SMALL_H) == 0);
    for (k = 0; k < 2; k++) sat_gl_destroy(tables[k]);
    gl_f.DeleteTextures(1, &target);
}

TEST(tables_take_smaller_pictures)
{
    static float picture[4 * GL_N];
    sat_gl_options go = sat_gl_defaults();
    unsigned source;
    int k;
    if (!gl_open()) return;
    support_fill(picture, 4 * GL_N, 0, 3, 9);
    source = gl_texture(SAT__GL_RGBA32F, GL_W, GL_H, picture);
    for (k = 0; k < 5; k++) {
        go.compute = k & 1;
        go.format = k < 2 ? SAT_GL_TILED : SAT_GL_TWO_FLOAT;
        go.algorithm = k == 4 ? SAT_SCAN_RECURSIVE_DOUBLING : SAT_SCAN_BALANCED_TREE;
        gl_compare_tables(source, go, k < 2);
    }
    gl_f.DeleteTextures(1, &source);
    gl_close();
}

/* A small picture, by an object that has drawn a large one before, and by one that was made for it. */
TEST(objects_take_smaller_pictures)
{
    static unsigned char own[16 * GL_N], there[16 * GL_N];
    static const int calls[] = {GL_TONE, GL_AO, GL_SHADOWS};
    static gl_scene small;
    gl_scene *s;
    sat_gl_target to = sat_gl_to(SAT_GL_OWN, 0, 0, 0, 0, 0);
    sat__gl_state state;
    size_t k;
    s = gl_open_scene();
    if (!s) return;
    gl_create_sized(&small, gl_screen.get_proc, GL_SMALL_W, GL_SMALL_H);
    small.hdr = s->hdr, small.depth = s->depth, small.normals = s->normals, small.points = s->points;
    for (k = 0; k < sizeof calls / sizeof *calls; k++) {
        int call = calls[k], bytes = gl_format(call) == SAT__GL_RGBA32F ? 16 : 4;
        EXPECT_EQ(gl_call(s, call, NULL), SAT_OK);
        EXPECT_EQ(gl_call(&small, call, NULL), SAT_OK);
        to.width = GL_SMALL_W, to.height = GL_SMALL_H;
        s->input = small.input; /* another size is another projection */
        EXPECT_EQ(gl_call(s, call, &to), SAT_OK);
        sat__gl_begin(&gl_f, &state, 1);
        EXPECT_EQ(sat__gl_read(&gl_f, own, gl_own(s, call), gl_format(call), GL_SMALL_W, GL_SMALL_H), SAT_OK);
        EXPECT_EQ(sat__gl_read(&gl_f, there, gl_own(&small, call), gl_format(call), GL_SMALL_W, GL_SMALL_H), SAT_OK);
        sat__gl_end(&gl_f, &state);
        EXPECT(memcmp(own, there, (size_t)(bytes * GL_SMALL_W * GL_SMALL_H)) == 0);
        to.width = s->input.width = GL_W + 1;
        EXPECT_EQ(gl_call(s, call, &to), SAT_ERR_SIZE);
        s->input = ssao_sat_input_linear(NULL, GL_W, GL_H, 1);
    }
    gl_destroy(&small);
    gl_close();
}

/* One layer of an array, by glTextureView: the picture of a texture of its own. */
TEST(a_layer_is_an_input_by_a_view_of_it)
{
    void(SAT__GL_CALL * storage)(unsigned target, int levels, unsigned internal, int width, int height, int depth);
    void(SAT__GL_CALL * view)(unsigned texture, unsigned target, unsigned of, unsigned internal, unsigned level,
                              unsigned levels, unsigned layer, unsigned layers);
    static unsigned char own[16 * GL_N], there[16 * GL_N], texels[16 * GL_N];
    gl_scene *s;
    sat_gl_proc procs[2];
    int call;
    s = gl_open_scene();
    if (!s) return;
    procs[0] = gl_screen.get_proc("glTexStorage3D");
    procs[1] = gl_screen.get_proc("glTextureView");
    if (!gl_f.has_compute || !procs[0] || !procs[1]) {
        expect_skip("needs OpenGL 4.3");
        gl_close();
        return;
    }
    memcpy(&storage, &procs[0], sizeof storage);
    memcpy(&view, &procs[1], sizeof view);
    for (call = 0; call < GL_RAIN; call++) {
        unsigned *input = call == GL_TONE ? &s->hdr : call == GL_AO ? &s->depth : &s->points;
        unsigned kept = *input, array, layer;
        unsigned internal = call == GL_AO ? SAT__GL_R32F : SAT__GL_RGBA32F, format, type;
        sat__gl_state state;
        sat__gl_transfer(internal, &format, &type);
        EXPECT_EQ(gl_call(s, call, NULL), SAT_OK);
        sat__gl_begin(&gl_f, &state, 1);
        EXPECT_EQ(sat__gl_read(&gl_f, own, gl_own(s, call), gl_format(call), GL_W, GL_H), SAT_OK);
        EXPECT_EQ(sat__gl_read(&gl_f, texels, kept, internal, GL_W, GL_H), SAT_OK);
        gl_f.GenTextures(1, &array);
        gl_f.BindTexture(SAT__GL_TEXTURE_2D_ARRAY, array);
        storage(SAT__GL_TEXTURE_2D_ARRAY, 1, internal, GL_W, GL_H, 2);
        gl_f.TexSubImage3D(SAT__GL_TEXTURE_2D_ARRAY, 0, 0, 0, 1, GL_W, GL_H, 1, format, type, texels);
        gl_f.GenTextures(1, &layer);
        view(layer, SAT__GL_TEXTURE_2D, array, internal, 0, 1, 1, 1);
        sat__gl_end(&gl_f, &state);
        *input = layer;
        EXPECT_EQ(gl_call(s, call, NULL), SAT_OK);
        *input = kept;
        sat__gl_begin(&gl_f, &state, 1);
        EXPECT_EQ(sat__gl_read(&gl_f, there, gl_own(s, call), gl_format(call), GL_W, GL_H), SAT_OK);
        sat__gl_end(&gl_f, &state);
        EXPECT(memcmp(own, there, (gl_format(call) == SAT__GL_RGBA32F ? 16 : 4) * GL_N) == 0);
        gl_f.DeleteTextures(1, &layer);
        gl_f.DeleteTextures(1, &array);
    }
    gl_close();
}

TEST(targets_that_cannot_be_are_refused)
{
    gl_scene *s;
    unsigned integers, framebuffer = 0, after = 0;
    int call, k;
    s = gl_open_scene();
    if (!s) return;
    integers = gl_texture(SAT__GL_DEPTH_COMPONENT24, GL_W, GL_H, NULL);
    gl_f.GenFramebuffers(1, &framebuffer); /* without an attachment */
    for (call = 0; call < GL_CALLS; call++) {
        sat_gl_target to = sat_gl_to_texture(0);
        EXPECT_EQ(gl_call(s, call, &to), SAT_ERR_ARGUMENT);
        to = sat_gl_to_texture(gl_input(s, call));
        if (call != GL_RAIN) EXPECT_EQ(gl_call(s, call, &to), SAT_ERR_ARGUMENT);
        to = sat_gl_to_layer(gl_input(s, call), -1);
        EXPECT_EQ(gl_call(s, call, &to), SAT_ERR_ARGUMENT);
        k = 9;
        memcpy(&to.place, &k, sizeof to.place);
        EXPECT_EQ(gl_call(s, call, &to), SAT_ERR_ARGUMENT);
        to = sat_gl_to_framebuffer(framebuffer, 0, 0);
        EXPECT_EQ(gl_call(s, call, &to), SAT_ERR_GL_STATE);
        to = sat_gl_to_texture(integers); /* depth is no colour */
        EXPECT_EQ(gl_call(s, call, &to), SAT_ERR_GL_STATE);
        sat__gl_clear_errors(&gl_f);
        EXPECT_EQ(gl_call(s, call, NULL), SAT_OK); /* and nothing is left behind */
        gl_f.GetIntegerv(SAT__GL_DRAW_FRAMEBUFFER_BINDING, (int *)&after);
        EXPECT_EQ(after, 0);
    }
    gl_f.DeleteFramebuffers(1, &framebuffer);
    gl_f.DeleteTextures(1, &integers);
    gl_close();
}

/* ---- depth as hardware has it: the same irradiance as from points */

/* Column-major; depth kinds: 0 [-1,1], 1 [0,1], 2 reversed [0,1] with an infinite far plane. */
static void gl_projection(double p[16], double inverse[16], int kind)
{
    double f = 1 / tan(0.4), a = GL_W / (double)GL_H, n = 0.1, far_plane = 20, c = 0, d = 0;
    memset(p, 0, 16 * sizeof *p);
    memset(inverse, 0, 16 * sizeof *p);
    if (kind == 0) c = -(far_plane + n) / (far_plane - n), d = -2 * far_plane * n / (far_plane - n);
    if (kind == 1) c = -far_plane / (far_plane - n), d = -far_plane * n / (far_plane - n);
    if (kind == 2) c = 0, d = n;
    p[0] = f / a, p[5] = f, p[10] = c, p[14] = d, p[11] = -1;
    inverse[0] = a / f, inverse[5] = 1 / f, inverse[14] = -1, inverse[11] = 1 / d, inverse[15] = c / d;
}

/* x times the turn about y and the shift (0.2, 0.1, 3) that the camera has: world = turn * view + shift. */
static void gl_world(double out[3], const double v[3], int is_point)
{
    out[0] = 0.8 * v[0] + 0.6 * v[2] + 0.2 * is_point;
    out[1] = v[1] + 0.1 * is_point;
    out[2] = -0.6 * v[0] + 0.8 * v[2] + 3 * is_point;
}

TEST(shadows_from_a_depth_buffer_are_those_from_points)
{
    static float points[4 * GL_N], normals[4 * GL_N], depth[GL_N], world_normals[4 * GL_N], a[4 * GL_N], b[4 * GL_N];
    gl_scene *s;
    int kind, i, k;
    s = gl_open_scene();
    if (!s) return;
    for (kind = 0; kind < 3; kind++) {
        double p[16], inverse[16], worst = 0, largest = 0;
        unsigned textures[4];
        fiv_gl_view view;
        sat__gl_state state;
        gl_projection(p, inverse, kind);
        memset(&view, 0, sizeof view);
        view.clip_zero_to_one = kind > 0;
        for (i = 0; i < 4; i++) { /* columns of world_from_view * inverse, the axes' and the shift's */
            double column[3], turned[3];
            for (k = 0; k < 3; k++) column[k] = inverse[4 * i + k];
            gl_world(turned, column, 0);
            view.world_from_clip[4 * i] = (float)(turned[0] + 0.2 * inverse[4 * i + 3]);
            view.world_from_clip[4 * i + 1] = (float)(turned[1] + 0.1 * inverse[4 * i + 3]);
            view.world_from_clip[4 * i + 2] = (float)(turned[2] + 3 * inverse[4 * i + 3]);
            view.world_from_clip[4 * i + 3] = (float)inverse[4 * i + 3];
        }
        for (i = 0; i < 3; i++) {
            double axis[3] = {0, 0, 0}, turned[3];
            axis[i] = 1;
            gl_world(turned, axis, 0);
            for (k = 0; k < 3; k++) view.world_from_normal[3 * i + k] = (float)turned[k];
        }
        for (i = 0; i < GL_N; i++) {
            double z = 1.5 + 2 * (i % 7) / 7.0, w[3], v[3], n[3] = {0.2, 0.9, 0.3}, wn[3];
            v[0] = ((i % GL_W + 0.5) * 2 / GL_W - 1) * inverse[0] * z;
            v[1] = ((i / GL_W + 0.5) * 2 / GL_H - 1) * inverse[5] * z;
            v[2] = -z;
            gl_world(w, v, 1);
            gl_world(wn, n, 0);
            for (k = 0; k < 3; k++) {
                points[4 * i + k] = (float)w[k];
                normals[4 * i + k] = i % 11 ? (float)n[k] : 0; /* sky */
                world_normals[4 * i + k] = i % 11 ? (float)wn[k] : 0;
            }
            points[4 * i + 3] = normals[4 * i + 3] = world_normals[4 * i + 3] = 1;
            depth[i] = (float)((p[10] * -z + p[14]) / z);
            if (kind == 0) depth[i] = 0.5f * depth[i] + 0.5f;
        }
        textures[0] = gl_texture(SAT__GL_RGBA32F, GL_W, GL_H, points);
        textures[1] = gl_texture(SAT__GL_RGBA32F, GL_W, GL_H, world_normals);
        textures[2] = gl_texture(SAT__GL_DEPTH_COMPONENT32F, GL_W, GL_H, depth);
        textures[3] = gl_texture(SAT__GL_RGBA32F, GL_W, GL_H, normals);
        for (k = 0; k < 2; k++) {
            EXPECT_EQ(fiv_gl_irradiance(s->shadows, NULL, textures[2 * k], textures[2 * k + 1], k ? &view : NULL),
                      SAT_OK);
            sat__gl_begin(&gl_f, &state, 1);
            sat__gl_read(&gl_f, k ? b : a, fiv_gl_texture(s->shadows), SAT__GL_RGBA32F, GL_W, GL_H);
            sat__gl_end(&gl_f, &state);
        }
        for (i = 0; i < 4 * GL_N; i++) {
            worst = support_larger(worst, fabs((double)a[i] - (double)b[i]));
            largest = support_larger(largest, fabs((double)a[i]));
        }
        REPORT("irradiance from depth against from points", worst / largest, "of the largest");
        EXPECT(worst < 1e-4 * largest && largest > 0);
        gl_f.DeleteTextures(4, textures);
    }
    gl_close();
}

/* ---- drops behind and before a plane, against every kind of depth buffer */

TEST(drops_are_tested_against_any_depth_buffer)
{
    static float pictures[5][4 * GL_N];
    static const float nothing[4] = {0, 0, 0, 0};
    gl_scene *s;
    raindrop_camera camera = raindrop_camera_defaults();
    float n = 0.1f, f = 20, t = tanf(0.5f * camera.fov_y), distance = 0.7f, a[3], b[3];
    unsigned colour, depth, framebuffer = 0;
    sat_gl_target to;
    int kind, i, k, drawn = 0, all = 0;
    s = gl_open_scene();
    if (!s) return;
    colour = gl_texture(SAT__GL_RGBA32F, GL_W, GL_H, NULL);
    depth = gl_texture(SAT__GL_DEPTH_COMPONENT32F, GL_W, GL_H, NULL);
    camera.depth_near = n;
    a[0] = (f + n) / (f - n), b[0] = -2 * f * n / (f - n); /* usual; reversed; reversed with an infinite far plane */
    a[1] = -a[0], b[1] = -b[0];
    a[2] = 0, b[2] = n;
    for (kind = 0; kind < 5; kind++) { /* 3: camera.depth_far instead of the matrix; 4: no test */
        float p[16] = {0}, clear = 0.5f + 0.5f * (a[kind % 3] + b[kind % 3] / distance);
        sat__gl_state state;
        p[0] = 1 / t, p[5] = 1 / t, p[10] = -a[kind % 3], p[14] = b[kind % 3], p[11] = -1;
        if (kind == 1) p[10] = a[1], p[11] = 1; /* a camera that looks along +z */
        camera.depth_far = kind == 3 ? f : 0;
        sat__gl_begin(&gl_f, &state, 1);
        if (!framebuffer) EXPECT_EQ(sat__gl_framebuffer(&gl_f, &framebuffer, &colour, 1, depth), SAT_OK);
        gl_f.BindFramebuffer(SAT__GL_FRAMEBUFFER, framebuffer);
        gl_f.ClearBufferfv(SAT__GL_COLOR, 0, nothing);
        if (kind == 3) clear = 0.5f + 0.5f * (a[0] + b[0] / distance);
        gl_f.ClearBufferfv(0x1801, 0, &clear); /* GL_DEPTH */
        sat__gl_end(&gl_f, &state);
        to = sat_gl_to_framebuffer(framebuffer, 0, 0);
        EXPECT_EQ(raindrop_gl_render(s->rain, &to, GL_W, GL_H, &camera, kind < 3 ? p : NULL, NULL), SAT_OK);
        gl_read(pictures[kind], framebuffer, SAT__GL_RGBA32F, GL_W, GL_H);
    }
    for (i = 0; i < 4 * GL_N; i++) {
        drawn += pictures[0][i] > 0;
        all += pictures[4][i] > pictures[0][i];
    }
    EXPECT(drawn > 10 && all > 100);
    for (k = 1; k < 4; k++) EXPECT(memcmp(pictures[0], pictures[k], sizeof pictures[0]) == 0);
    {
        float ortho[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -0.1f, 0, 0, 0, 0, 1};
        EXPECT_EQ(raindrop_gl_render(s->rain, &to, GL_W, GL_H, &camera, ortho, NULL), SAT_ERR_ARGUMENT);
    }
    gl_f.DeleteFramebuffers(1, &framebuffer);
    gl_f.DeleteTextures(1, &colour);
    gl_f.DeleteTextures(1, &depth);
    gl_close();
}

/* ---- after create nothing is made: by the fake driver, which counts names, images, buffers and shaders */

/* Every call that a frame may have, of every object. */
static void gl_frame_calls(gl_scene *s, sat_gl *tables, sat_gl *tiles, softassign_gl *match, int round)
{
    float price[6] = {0}, move[3] = {0.1f * (float)round, 0, 0};
    double bound;
    raindrop_camera camera = raindrop_camera_defaults();
    raindrop_render_options ro = raindrop_render_defaults();
    tonemap_options to = tonemap_defaults();
    ssao_sat_options so = ssao_sat_defaults();
    sat_gl_target target = sat_gl_to_texture(99);
    sat_gl_options go;
    softassign_options mo = softassign_defaults();
    int call, look;
    for (call = 0; call < GL_CALLS; call++) EXPECT_EQ(gl_call(s, call, round & 1 ? &target : NULL), SAT_OK);
    to.exposure = 0.5 + round;
    EXPECT_EQ(tonemap_gl_set_options(s->tone, &to), SAT_OK);
    so.radius = 0.1 + 0.1 * round;
    EXPECT_EQ(ssao_sat_gl_set_options(s->ao, &so), SAT_OK);
    memcpy(s->instance.position, move, sizeof move);
    EXPECT_EQ(fiv_gl_move(s->shadows, &s->instance, 1), SAT_OK);
    EXPECT_EQ(raindrop_gl_advance(s->rain, 0.01), SAT_OK);
    for (look = 1; look < 4; look++) {
        ro.look = (raindrop_look)look;
        ro.orders = round & 1;
        camera.exposure = round & 2 ? 0.01f : 0;
        EXPECT_EQ(raindrop_gl_render(s->rain, &target, GL_W, GL_H, &camera, NULL, &ro), SAT_OK);
        EXPECT_EQ(raindrop_gl_veil(s->rain, &target, GL_W, GL_H, 0, NULL, NULL, NULL), SAT_OK);
    }
    EXPECT_EQ(sat_gl_build(tables, round & 1 ? 99u : 0, 5, GL_W, GL_H), SAT_OK);
    EXPECT_EQ(sat_gl_scan(tables, 0, 5, GL_W, GL_H), SAT_OK);
    EXPECT_EQ(sat_gl_mean(tables, NULL, 5, GL_W, GL_H), SAT_OK);
    EXPECT_EQ(sat_gl_build(tables, 0, 5, GL_W + 1, GL_H), SAT_ERR_SIZE);
    EXPECT_EQ(sat_gl_build(tables, 0, 5, GL_W - round, GL_H - 1), SAT_OK);
    EXPECT_EQ(sat_gl_build(tiles, 0, 5, GL_W - 1, GL_H - round), SAT_OK);
    EXPECT_EQ(sat_gl_mean(tiles, NULL, 5, 1 + round, GL_H - round), SAT_OK);
    EXPECT_EQ(sat_gl_build(tiles, 0, 5, GL_W, GL_H), SAT_OK);
    EXPECT_EQ(sat_gl_mean(tiles, NULL, 5, GL_W, GL_H), SAT_OK);
    go = sat_gl_defaults();
    go.format = SAT_GL_TWO_FLOAT;
    go.width = GL_W, go.height = GL_H, go.max_value = 1 + round;
    EXPECT_EQ(sat_gl_set_options(tables, &go), SAT_OK);
    mo.alpha = 0.6 + 0.01 * round;
    mo.iterations[0] = 2;
    EXPECT_EQ(softassign_gl_set_options(match, &mo), SAT_OK);
    EXPECT_EQ(softassign_gl_published(match, NULL, 0, NULL), SAT_OK);
    EXPECT_EQ(softassign_gl_sweep(match, price, &bound, 1, 2), SAT_OK);
}

TEST(after_create_nothing_is_made)
{
    static gl_scene s;
    static float cost[24];
    support_memory memory[2];
    sat_gl *tables, *tiles;
    softassign_gl *match;
    softassign_problem p;
    softassign_options mo = softassign_defaults();
    sat_gl_options go = sat_gl_defaults();
    long made, compiled, calls[2];
    int round;
    memset(&gl_fake, 0, sizeof gl_fake);
    memset(&s, 0, sizeof s);
    gl_create(&s, gl_fake_proc);
    s.hdr = 1, s.depth = 2, s.normals = 3, s.points = 4;
    go.allocator = support_allocator(&memory[0]);
    mo.allocator = support_allocator(&memory[1]);
    go.width = GL_W, go.height = GL_H;
    EXPECT_EQ(sat_gl_create(&tiles, gl_fake_proc, &go), SAT_OK);
    go.format = SAT_GL_TWO_FLOAT;
    EXPECT_EQ(sat_gl_create(&tables, gl_fake_proc, &go), SAT_OK);
    EXPECT_EQ(softassign_gl_create(&match, gl_fake_proc, &mo), SAT_OK);
    memset(&p, 0, sizeof p);
    p.rows = 4, p.columns = 6, p.cost = cost;
    support_fill(cost, 24, 0, 1, 5);
    EXPECT_EQ(softassign_gl_set_costs(match, &p), SAT_OK);
    made = gl_fake.made, compiled = gl_fake.compiled;
    calls[0] = memory[0].calls, calls[1] = memory[1].calls;
    EXPECT(made > 20 && compiled > 20);
    for (round = 0; round < 4; round++) gl_frame_calls(&s, tables, tiles, match, round);
    EXPECT_EQ(gl_fake.made, made);
    EXPECT_EQ(gl_fake.compiled, compiled);
    EXPECT_EQ(memory[0].calls, calls[0]);
    EXPECT_EQ(memory[1].calls, calls[1]);
    EXPECT(gl_fake.draws > 50);
    sat_gl_destroy(tables);
    sat_gl_destroy(tiles);
    softassign_gl_destroy(match);
    gl_destroy(&s);
    EXPECT(support_memory_clean(&memory[0]) && support_memory_clean(&memory[1]));
}

/* ---- a context that is lost, before or after create: an error or nothing, but an end */

static int gl_is_lost;
static unsigned SAT__GL_CALL gl_lost_error(void) { return gl_is_lost ? 0x0507u : 0u; }
static sat_gl_proc gl_lost_proc(const char *name)
{
    return strcmp(name, "glGetError") == 0 ? (sat_gl_proc)gl_lost_error : gl_fake_proc(name);
}

TEST(a_lost_context_ends_in_an_error)
{
    static gl_scene s;
    sat_gl *tables = NULL;
    tonemap_gl *tone = NULL;
    int k;
    memset(&gl_fake, 0, sizeof gl_fake);
    memset(&s, 0, sizeof s);
    for (k = 0; k < 2; k++) {
        sat_gl_options go = sat_gl_defaults();
        go.format = k ? SAT_GL_TWO_FLOAT : SAT_GL_TILED;
        go.width = go.height = 40;
        gl_is_lost = 1;
        EXPECT_EQ(sat_gl_create(&tables, gl_lost_proc, &go), SAT_ERR_GL_STATE);
        EXPECT(strstr(sat_gl_message(tables), "0x0507") != NULL);
        sat_gl_destroy(tables);
        gl_is_lost = 0;
        go.width = go.height = 0;
        EXPECT_EQ(sat_gl_create(&tables, gl_lost_proc, &go), SAT_OK);
        EXPECT_EQ(sat_gl_build(tables, 0, 5, 40, 30), SAT_OK);
        gl_is_lost = 1;
        EXPECT_EQ(sat_gl_build(tables, 0, 5, 40, 30), SAT_OK); /* nothing is asked in a frame */
        EXPECT_EQ(sat_gl_build(tables, 0, 5, 41, 30), SAT_ERR_GL_STATE);
        sat_gl_destroy(tables);
    }
    EXPECT_EQ(tonemap_gl_create(&tone, gl_lost_proc, 40, 30, NULL), SAT_ERR_GL_STATE);
    EXPECT(tonemap_gl_message(tone)[0] != 0);
    tonemap_gl_destroy(tone);
    gl_is_lost = 0;
    gl_create(&s, gl_lost_proc);
    s.hdr = 1, s.depth = 2, s.normals = 3, s.points = 4;
    gl_is_lost = 1;
    for (k = 0; k < GL_RAIN; k++) gl_call(&s, k, NULL);
    gl_destroy(&s);
    gl_is_lost = 0;
}

/* Half floats, bytes, integers and depth where floats are asked for: no crash, no state, and the next call is right. */
TEST(textures_of_other_formats_do_no_harm)
{
    static const unsigned formats[] = {SAT__GL_RGBA16F, SAT__GL_RGBA8, SAT__GL_R32UI, SAT__GL_DEPTH_COMPONENT24,
                                       SAT__GL_RG32F, SAT__GL_RGB32F};
    static unsigned char first[4 * GL_N], after[4 * GL_N];
    gl_scene *s;
    sat__gl_state state;
    size_t k;
    s = gl_open_scene();
    if (!s) return;
    EXPECT_EQ(gl_call(s, GL_TONE, NULL), SAT_OK);
    sat__gl_begin(&gl_f, &state, 1);
    EXPECT_EQ(sat__gl_read(&gl_f, first, gl_own(s, GL_TONE), SAT__GL_RGBA8, GL_W, GL_H), SAT_OK);
    sat__gl_end(&gl_f, &state);
    for (k = 0; k < sizeof formats / sizeof *formats; k++) {
        unsigned texture = gl_texture(formats[k], GL_W, GL_H, NULL), kept = s->hdr;
        int framebuffer = -1;
        s->hdr = texture;
        gl_call(s, GL_TONE, NULL);
        s->hdr = kept;
        sat__gl_clear_errors(&gl_f);
        gl_f.GetIntegerv(SAT__GL_DRAW_FRAMEBUFFER_BINDING, &framebuffer);
        EXPECT_EQ(framebuffer, 0);
        EXPECT_EQ(gl_call(s, GL_TONE, NULL), SAT_OK);
        sat__gl_begin(&gl_f, &state, 1);
        EXPECT_EQ(sat__gl_read(&gl_f, after, gl_own(s, GL_TONE), SAT__GL_RGBA8, GL_W, GL_H), SAT_OK);
        sat__gl_end(&gl_f, &state);
        EXPECT(memcmp(first, after, sizeof first) == 0);
        gl_f.DeleteTextures(1, &texture);
    }
    gl_close();
}

/* ---- options that change: what the new ones give is what an object made with them gives */

TEST(options_that_shaders_are_made_for_are_refused)
{
    sat_gl *tables;
    softassign_gl *match;
    sat_gl_options go = sat_gl_defaults(), g;
    softassign_options mo = softassign_defaults();
    int k;
    memset(&gl_fake, 0, sizeof gl_fake);
    go.format = SAT_GL_FIXED32;
    EXPECT_EQ(sat_gl_create(&tables, gl_fake_proc, &go), SAT_OK);
    for (k = 0; k < 8; k++) {
        g = go;
        if (k == 0) g.format = SAT_GL_FLOAT;
        if (k == 1) g.algorithm = SAT_SCAN_RECURSIVE_DOUBLING;
        if (k == 2) g.k = 8;
        if (k == 3) g.compute = 1;
        if (k == 4) g.channel = 2;
        if (k == 5) g.unsigned_input = 1;
        if (k == 6) g.width = g.height = 8;
        if (k == 7) g.k = 1;
        EXPECT_EQ(sat_gl_set_options(tables, &g), k == 7 ? SAT_ERR_ARGUMENT : SAT_ERR_MISMATCH);
    }
    EXPECT_EQ(sat_gl_set_options(tables, &go), SAT_OK);
    EXPECT_EQ(sat_gl_set_options(NULL, &go), SAT_ERR_ARGUMENT);
    sat_gl_destroy(tables);
    EXPECT_EQ(softassign_gl_create(&match, gl_fake_proc, &mo), SAT_OK);
    mo.gather *= 2;
    EXPECT_EQ(softassign_gl_set_options(match, &mo), SAT_ERR_MISMATCH);
    mo.gather = 1;
    EXPECT_EQ(softassign_gl_set_options(match, &mo), SAT_ERR_ARGUMENT);
    EXPECT_EQ(softassign_gl_set_options(NULL, NULL), SAT_ERR_ARGUMENT);
    softassign_gl_destroy(match);
}

TEST(options_that_change_are_those_of_a_new_object)
{ /* the last test: the objects change, and go */
    static float picture[4 * GL_N], a[GL_N], b[GL_N];
    gl_scene *s;
    sat_gl *tables[2];
    sat_gl_options go = sat_gl_defaults(), other;
    fiv_gl_options fo = fiv_gl_defaults();
    sat__gl_state state;
    unsigned source;
    int k;
    s = gl_open_scene();
    if (!s) return;
    support_fill(picture, 4 * GL_N, 0, 3, 9);
    source = gl_texture(SAT__GL_RGBA32F, GL_W, GL_H, picture);
    go.format = SAT_GL_FIXED32;
    go.max_value = 1;
    other = go;
    other.max_value = 2;
    other.max_box_area = 9;
    EXPECT_EQ(sat_gl_create(&tables[0], gl_screen.get_proc, &go), SAT_OK);
    EXPECT_EQ(sat_gl_create(&tables[1], gl_screen.get_proc, &other), SAT_OK);
    EXPECT_EQ(sat_gl_build(tables[0], 0, source, GL_W, GL_H), SAT_OK);
    EXPECT_EQ(sat_gl_set_options(tables[0], &other), SAT_OK);
    sat__gl_begin(&gl_f, &state, 1);
    sat__gl_end(&gl_f, &state);
    for (k = 0; k < 2; k++) {
        EXPECT_EQ(sat_gl_build(tables[k], 0, source, GL_W, GL_H), SAT_OK);
        sat__gl_begin(&gl_f, &state, 1);
        sat__gl_read(&gl_f, k ? b : a, sat_gl_table(tables[k]), SAT__GL_R32UI, GL_W, GL_H);
        sat__gl_end(&gl_f, &state);
    }
    EXPECT(memcmp(a, b, sizeof a) == 0);
    EXPECT_NEAR(sat_gl_quantum(tables[0]), sat_gl_quantum(tables[1]), 0);
    for (k = 0; k < 2; k++) sat_gl_destroy(tables[k]);
    fo.penumbra = 2;
    EXPECT_EQ(fiv_gl_set_options(s->shadows, &fo), SAT_OK);
    fo.self = 1;
    EXPECT_EQ(fiv_gl_set_options(s->shadows, &fo), SAT_ERR_MISMATCH);
    fo.self = 0;
    fo.max_instances = 3;
    EXPECT_EQ(fiv_gl_set_options(s->shadows, &fo), SAT_ERR_MISMATCH);
    fo.max_instances = 65;
    EXPECT_EQ(fiv_gl_set_options(s->shadows, &fo), SAT_ERR_ARGUMENT);
    EXPECT_EQ(fiv_gl_set_options(NULL, NULL), SAT_ERR_ARGUMENT);
    gl_f.DeleteTextures(1, &source);
    gl_destroy(s);
    gl_close();
    sat__gl_close(&gl_f);
    gl_context_close(&gl_screen);
}
