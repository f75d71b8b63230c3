/* tonemap.h on OpenGL against the CPU. */

#include "support.h"
#include "metrics.h"
#include "gl_context.h"
#include "gl_es.h"
#include "gl_share.h"

typedef struct screen { gl_context context; sat__gl gl; } screen;

/* One context for all tests: they share what is compiled. */
static int screen_open(screen *s)
{
    static gl_context context;
    static int opened;
    if (!opened) {
        opened = gl_context_open(&context, 3, 3) ? 1 : -1;
        if (opened > 0) context.get_proc = gl_share(context.get_proc);
    }
    s->context = context;
    if (opened > 0) return EXPECT_EQ(sat__gl_open(&s->gl, s->context.get_proc), SAT_OK);
    expect_skip(s->context.message);
    return 0;
}

static void screen_close(screen *s)
{
    sat__gl_close(&s->gl);
}

static unsigned screen_texture(screen *s, unsigned internal, int width, int height, const void *pixels)
{
    sat__gl_state state;
    unsigned texture = 0;
    sat__gl_begin(&s->gl, &state, 1);
    EXPECT_EQ(sat__gl_texture(&s->gl, &texture, internal, width, height, pixels), SAT_OK);
    sat__gl_end(&s->gl, &state);
    return texture;
}

static void screen_read(screen *s, unsigned char *rgba, unsigned texture, int width, int height)
{
    sat__gl_state state;
    sat__gl_begin(&s->gl, &state, 1);
    EXPECT_EQ(sat__gl_read(&s->gl, rgba, texture, SAT__GL_RGBA8, width, height), SAT_OK);
    sat__gl_end(&s->gl, &state);
}

/* The photographic local operator without burn-out, as in the thesis; its other options are the defaults. */
static tonemap_options local_options(void)
{
    tonemap_options o = tonemap_defaults();
    o.operation = TONEMAP_PHOTOGRAPHIC_LOCAL;
    o.white = (double)INFINITY;
    return o;
}

/* Light and shadow, even and busy places, bad pixels: RGBA. */
static float *lit_pixels(int width, int height, int bad)
{
    float *p = (float *)malloc((size_t)width * (size_t)height * 4 * sizeof(float));
    uint64_t seed = 3;
    int x, y, c;
    for (y = 0; y < height; ++y)
        for (x = 0; x < width; ++x) {
            float *q = p + 4 * ((size_t)y * (size_t)width + (size_t)x);
            double u = (double)x / width, v = (double)y / height, light = 0.05 + 0.4 * u;
            if (u > 0.6 && v < 0.5) light = 40 + 30 * sin(12 * v);
            if (u < 0.3 && v > 0.6) light = 0.01 * (1 + (x / 3 + y / 3) % 2 * 2);
            light *= 1 + 0.1 * (support_uniform(&seed) - 0.5);
            for (c = 0; c < 3; ++c) q[c] = (float)(light * (1 + 0.6 * sin(5 * u + 2 * c + 3 * v)));
            q[3] = 0.5f;
        }
    if (bad) {
        p[4 * (5 * width + 7)] = NAN;
        p[4 * (15 * width + 17)] = p[4 * (15 * width + 17) + 1] = p[4 * (15 * width + 17) + 2] = INFINITY;
        p[4 * (25 * width + 37) + 1] = -4;
        p[4 * (26 * width + 37)] = 1e9f;
    }
    return p;
}

/* Shares of codes that differ by more than one, and the largest difference. */
static void compare(screen *s, const tonemap_options *options, int width, int height, int bad, double most,
                    const char *name)
{
    float *pixels = lit_pixels(width, height, bad);
    sat_image view = sat_image_f32(pixels, width, height, 4);
    size_t n = (size_t)width * (size_t)height * 4, i;
    unsigned char *cpu = (unsigned char *)malloc(n), *gpu = (unsigned char *)malloc(n);
    unsigned hdr = screen_texture(s, SAT__GL_RGBA32F, width, height, pixels),
             ldr = screen_texture(s, SAT__GL_RGBA8, width, height, NULL);
    sat_gl_target to;
    tonemap *map = NULL;
    tonemap_gl *gl = NULL;
    size_t over = 0, alpha = 0, any = 0;
    int largest = 0;
    EXPECT_EQ(tonemap_create(&map, width, height, options), SAT_OK);
    EXPECT_EQ(tonemap_apply_u8(map, cpu, (ptrdiff_t)width * 4, &view, 0, NULL), SAT_OK);
    if (options && options->encoding != TONEMAP_ENCODING_AUTO) { /* bytes are sRGB on the CPU */
        float *codes = (float *)malloc(n * sizeof(float));
        EXPECT_EQ(tonemap_apply_f32(map, codes, (ptrdiff_t)width * 16, &view, 0, NULL), SAT_OK);
        for (i = 0; i < n; ++i) cpu[i] = (unsigned char)(codes[i] < 1 ? codes[i] * 255 + 0.5f : 255);
        free(codes);
    }
    if (!EXPECT_EQ(tonemap_gl_create(&gl, s->context.get_proc, width, height, options), SAT_OK))
        puts(tonemap_gl_message(gl));
    to = sat_gl_to_texture(ldr);
    EXPECT_EQ(tonemap_gl_apply(gl, &to, hdr, 0), SAT_OK);
    screen_read(s, gpu, ldr, width, height);
    for (i = 0; i < n; ++i) {
        int d = abs((int)cpu[i] - (int)gpu[i]);
        if (i % 4 == 3) {
            alpha += gpu[i] != 255;
            continue;
        }
        over += d > 1;
        any += d > 0;
        if (d > largest) largest = d;
    }
    if (name) {
        printf("report GL against CPU, %-32s %.3f %% of codes differ, %.4f %% by more than 1, largest %d\n", name,
               100 * (double)any / (double)(n / 4 * 3), 100 * (double)over / (double)(n / 4 * 3), largest);
    }
    EXPECT((double)over <= most * (double)n);
    EXPECT_EQ(alpha, 0);
    EXPECT_EQ(tonemap_gl_apply(gl, 0, hdr, 0), SAT_OK); /* into its own texture: the same */
    screen_read(s, cpu, tonemap_gl_texture(gl), width, height);
    EXPECT(memcmp(cpu, gpu, n) == 0);
    s->gl.DeleteTextures(1, &hdr);
    s->gl.DeleteTextures(1, &ldr);
    tonemap_destroy(map);
    tonemap_gl_destroy(gl);
    free(pixels);
    free(cpu);
    free(gpu);
}

TEST(gl_gives_the_cpus_picture)
{
    screen s;
    tonemap_options o = local_options();
    if (!screen_open(&s)) return;
    compare(&s, NULL, 200, 150, 0, 0.0005, "default");
    compare(&s, NULL, 123, 77, 1, 0.0005, "default, bad pixels");
    compare(&s, &o, 200, 150, 0, 0.0005, "local");
    compare(&s, &o, 123, 77, 1, 0.001, "local, bad pixels");
    o.scales = 5;
    compare(&s, &o, 100, 90, 0, 0.001, NULL);
    o = local_options(), o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL, o.white = 4;
    compare(&s, &o, 100, 90, 0, 0, "global with burn-out");
    o = local_options(), o.key = o.white = 0;
    compare(&s, &o, 100, 90, 0, 0.001, "estimated key and white");
    o = local_options(), o.soft = 0.8;
    compare(&s, &o, 100, 90, 0, 0, "soft scales");
    o = local_options(), o.metering = TONEMAP_METERING_LOG_AVERAGE;
    compare(&s, &o, 100, 90, 1, 0.001, "metering by the log-average");
    o = local_options(), o.exposure = 0.3;
    compare(&s, &o, 100, 90, 0, 0.001, "fixed exposure");
    o = local_options(), o.adapt_high = 0.01;
    compare(&s, &o, 100, 90, 0, 0.001, "limits of adaptation");
    o = local_options(), o.selective = 0.1;
    compare(&s, &o, 100, 90, 0, 0.001, "selective");
    o = local_options(), o.mesopic = TONEMAP_MESOPIC_LOCAL, o.cd_per_unit = 2;
    compare(&s, &o, 100, 90, 1, 0.001, "mesopic, local");
    o.mesopic = TONEMAP_MESOPIC_UNIFORM, o.cd_per_unit = 0;
    compare(&s, &o, 100, 90, 0, 0.001, "mesopic, uniform");
    o = local_options(), o.operation = TONEMAP_ASHIKHMIN;
    compare(&s, &o, 160, 120, 0, 0.005, "Ashikhmin");
    o.operation = TONEMAP_ASHIKHMIN_GLOBAL;
    compare(&s, &o, 100, 90, 0, 0.001, "Ashikhmin global");
    o = local_options(), o.operation = TONEMAP_LINEAR, o.white = 2;
    compare(&s, &o, 100, 90, 0, 0, "linear");
    o.white = 0;
    compare(&s, &o, 100, 90, 0, 0, "linear, no white");
    screen_close(&s);
}

TEST(gl_has_the_cpus_curves_and_colours)
{
    const char *names[4] = {"Neutral", "AgX", "ACES", "Hable"};
    screen s;
    tonemap_options o = tonemap_defaults();
    float mask[100 * 90];
    int i;
    if (!screen_open(&s)) return;
    for (i = 0; i < 4; ++i) {
        o.operation = (tonemap_operator)(TONEMAP_NEUTRAL + i);
        compare(&s, &o, 100, 90, 1, 0.001, names[i]);
    }
    o = tonemap_defaults(), o.peak = 4;
    compare(&s, &o, 100, 90, 1, 0.001, "a peak of 4");
    o.white = 30, o.encoding = TONEMAP_ENCODING_PQ;
    compare(&s, &o, 100, 90, 1, 0.001, "PQ");
    o.encoding = TONEMAP_ENCODING_HLG, o.white_cd = 300;
    compare(&s, &o, 100, 90, 1, 0.001, "HLG");
    o = tonemap_defaults(), o.primaries = TONEMAP_PRIMARIES_2020, o.mesopic = TONEMAP_MESOPIC_LOCAL;
    compare(&s, &o, 100, 90, 1, 0.001, "Rec. 2020 to Rec. 709");
    o.primaries = TONEMAP_PRIMARIES_709, o.display = TONEMAP_PRIMARIES_P3, o.balance_blue = 1.5;
    compare(&s, &o, 100, 90, 1, 0.001, "to P3, warmer");
    o = tonemap_defaults(), o.dither = 1;
    compare(&s, &o, 100, 90, 1, 0.001, "dithered");
    for (i = 0; i < 9000; ++i) mask[i] = (float)(i % 100) / 99;
    o = tonemap_defaults(), o.meter_weights = mask;
    compare(&s, &o, 100, 90, 1, 0.001, "a mask");
    o.metering = TONEMAP_METERING_LOG_AVERAGE, o.white = 3;
    compare(&s, &o, 100, 90, 1, 0.001, "a mask and the log-average");
    screen_close(&s);
}

/* As on the CPU, with other primaries and mesopic vision, and by a curve. */
TEST(gl_infinity_is_white)
{
    enum { W = 24, H = 16 };
    unsigned char out[W * H * 4];
    int k;
    screen s;
    if (!screen_open(&s)) return;
    for (k = 0; k < 3; k++) {
        tonemap_options o = k == 2 ? local_options() : tonemap_defaults();
        float *pixels = lit_pixels(W, H, 0), *red = pixels + 4 * (5 * W + 5), *far_red = red + 4 * 8;
        tonemap_gl *gl = NULL;
        unsigned hdr;
        if (k == 1) o.operation = TONEMAP_ACES;
        o.primaries = k == 2 ? TONEMAP_PRIMARIES_709 : TONEMAP_PRIMARIES_2020;
        o.mesopic = k == 0 ? TONEMAP_MESOPIC_LOCAL : TONEMAP_MESOPIC_OFF;
        red[0] = INFINITY, red[1] = 0, red[2] = -1;
        far_red[0] = 3e38f, far_red[1] = far_red[2] = 0;
        hdr = screen_texture(&s, SAT__GL_RGBA32F, W, H, pixels);
        EXPECT_EQ(tonemap_gl_create(&gl, s.context.get_proc, W, H, &o), SAT_OK);
        EXPECT_EQ(tonemap_gl_apply(gl, NULL, hdr, 0), SAT_OK);
        screen_read(&s, out, tonemap_gl_texture(gl), W, H);
        EXPECT(out[4 * (5 * W + 5)] >= 254 && out[4 * (5 * W + 5) + 1] >= 254 && out[4 * (5 * W + 5) + 2] >= 254);
        EXPECT(out[4 * (5 * W + 13)] > 250);
        tonemap_gl_destroy(gl);
        s.gl.DeleteTextures(1, &hdr);
        free(pixels);
    }
    screen_close(&s);
}

/* The ends of every option, in pairs: OpenGL takes what the CPU takes, and shows the same. Each costs a dozen programs:
   one of 19 of them, others in each build of the table, and all pairs of enumerations and switches. */
TEST(gl_takes_every_corner_of_the_options)
{
    screen s;
    int n = SAT__COUNT(tonemap__fields), i, j, a, b, turn = 0, before;
    if (!screen_open(&s)) return;
    for (i = 0; i < n; ++i)
        for (j = 0; j < i; ++j)
            for (a = 0; a < 2; ++a)
                for (b = 0; b < 2; ++b) {
                    const sat__field *f = &tonemap__fields[i], *g = &tonemap__fields[j];
                    tonemap_options o = tonemap_defaults();
                    if (strchr("at", f->type) || strchr("at", g->type)) continue;
                    sat__field_set(f, &o, a ? f->high : f->low);
                    sat__field_set(g, &o, b ? g->high : g->low);
                    if (turn++ % 19 && !(a && b && f->type == 'i' && g->type == 'i')) continue;
                    before = expect_state.failures;
                    compare(&s, &o, 40, 28, 1, 0.01, NULL);
                    if (expect_state.failures > before) printf("with %s %g and %s %g\n", f->name, a ? f->high : f->low, g->name, b ? g->high : g->low);
                }
    {
        tonemap_options o = local_options();
        o.scales = 1;
        compare(&s, &o, 40, 30, 1, 0.001, "one scale");
        o.selective = 0.1;
        compare(&s, &o, 16, 16, 0, 0.001, NULL);
        o = local_options(), o.gamut = 0;
        compare(&s, &o, 100, 90, 1, 0.001, "gamut by fading");
        o.gamut = 1;
        compare(&s, &o, 100, 90, 1, 0.001, "gamut by dimming");
        o.gamut = -1, o.soft = 0;
        compare(&s, &o, 100, 90, 1, 0.001, "hard scales, clipped channels");
    }
    screen_close(&s);
}

/* The same in GLSL ES 3.00, on the same driver. */
TEST(gl_shaders_are_es)
{
    screen s;
    tonemap_options o = local_options();
    if (!screen_open(&s)) return;
    s.context.get_proc = gl_es_pretend(s.context.get_proc);
    o.key = o.white = 0, o.mesopic = TONEMAP_MESOPIC_LOCAL, o.soft = 0.8;
    compare(&s, &o, 100, 90, 1, 0.002, NULL);
    o = local_options(), o.operation = TONEMAP_ASHIKHMIN, o.mesopic = TONEMAP_MESOPIC_UNIFORM, o.cd_per_unit = 0;
    compare(&s, &o, 160, 120, 0, 0.005, NULL);
    o = local_options(), o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL, o.white = 4;
    compare(&s, &o, 100, 90, 0, 0, NULL);
    o = local_options(), o.selective = 0.1;
    compare(&s, &o, 100, 90, 0, 0.001, NULL);
    s.context.get_proc = gl_es_real;
    screen_close(&s);
}

/* A driver of OpenGL ES that does not blend into floats: it refuses to draw the histogram's points. */
static int blend_refused;

static void SAT__GL_CALL blend_draw(unsigned mode, int first, int count)
{
    void(SAT__GL_CALL * draw)(unsigned mode, int first, int count);
    sat_gl_proc proc = gl_es_real("glDrawArrays");
    memcpy(&draw, &proc, sizeof proc);
    if (mode == SAT__GL_POINTS) blend_refused = 1;
    else draw(mode, first, count);
}

static unsigned SAT__GL_CALL blend_error(void)
{
    unsigned(SAT__GL_CALL * get_error)(void);
    sat_gl_proc proc = gl_es_real("glGetError");
    memcpy(&get_error, &proc, sizeof proc);
    if (!blend_refused) return get_error();
    blend_refused = 0;
    return 0x0502; /* GL_INVALID_OPERATION */
}

static sat_gl_proc blend_proc(const char *name)
{
    if (strcmp(name, "glDrawArrays") == 0) return (sat_gl_proc)blend_draw;
    if (strcmp(name, "glGetError") == 0) return (sat_gl_proc)blend_error;
    return gl_es_proc(name);
}

TEST(gl_says_that_blending_of_floats_is_missing)
{
    screen s;
    tonemap_options o = tonemap_defaults();
    tonemap_gl *gl = NULL;
    if (!screen_open(&s)) return;
    gl_es_pretend(s.context.get_proc);
    EXPECT(tonemap_gl_create(&gl, blend_proc, 20, 20, &o) != SAT_OK);
    EXPECT(strstr(tonemap_gl_message(gl), "EXT_float_blend") && strstr(tonemap_gl_message(gl), "LOG_AVERAGE"));
    tonemap_gl_destroy(gl);
    o.metering = TONEMAP_METERING_LOG_AVERAGE, o.white = 3;
    EXPECT_EQ(tonemap_gl_create(&gl, blend_proc, 20, 20, &o), SAT_OK);
    tonemap_gl_destroy(gl);
    screen_close(&s);
}

TEST(gl_takes_thin_pictures)
{
    int sizes[][2] = {{64, 40}, {40, 27}, {38, 130}, {257, 31}}, i;
    screen s;
    if (!screen_open(&s)) return;
    for (i = 0; i < 4; ++i) compare(&s, NULL, sizes[i][0], sizes[i][1], 0, 0.001, NULL);
    screen_close(&s);
}

static sat_gl_get_proc *screen_proc;

/* The context without compute shaders. */
static sat_gl_proc screen_plain(const char *name)
{
    return strcmp(name, "glDispatchCompute") == 0 ? NULL : screen_proc(name);
}

/* A histogram of counts in shared memory is that of blended points; the state that comes from it has the same bits. */
TEST(gl_counts_by_compute_as_by_blending)
{
    static const int sizes[][2] = {{1, 1}, {64, 64}, {131, 67}, {1, 200}, {65, 3}};
    float state[2][8];
    int i, k, masked;
    screen s;
    if (!screen_open(&s)) return;
    if (!s.gl.has_compute) {
        expect_skip("the context has no compute shaders");
        screen_close(&s);
        return;
    }
    screen_proc = s.context.get_proc;
    for (i = 0; i < 5; i++)
        for (masked = 0; masked < 2; masked++) {
            int width = sizes[i][0], height = sizes[i][1], n = width * height, j;
            float *pixels = lit_pixels(width, height, 0), *weights = (float *)malloc((size_t)n * sizeof(float));
            uint32_t *counts = (uint32_t *)malloc(64 * TONEMAP__BIN_ROWS * 4);
            float *blended = (float *)malloc(64 * TONEMAP__BIN_ROWS * 4);
            tonemap_options o = tonemap_defaults();
            unsigned hdr;
            int differ = 0;
            o.white = 0, o.key = 0;
            for (j = 0; j < n; j++) weights[j] = (float)(j % 16) / 15;
            if (n > 6) pixels[9] = -1, pixels[14] = 1e30f;
            if (masked) o.meter_weights = weights;
            hdr = screen_texture(&s, SAT__GL_RGBA32F, width, height, pixels);
            for (k = 0; k < 2; k++) {
                tonemap_gl *gl = NULL;
                sat__gl_state saved;
                EXPECT_EQ(tonemap_gl_create(&gl, k ? screen_plain : screen_proc, width, height, &o), SAT_OK);
                EXPECT_EQ(tonemap_gl_apply(gl, NULL, hdr, 0), SAT_OK);
                EXPECT_EQ(tonemap_gl_apply(gl, NULL, hdr, 0), SAT_OK); /* counts begin anew */
                sat__gl_begin(&s.gl, &saved, 1);
                EXPECT_EQ(sat__gl_read(&s.gl, state[k], gl->target[TONEMAP__T_STATE].texture, SAT__GL_RGBA32F, 2, 1),
                          SAT_OK);
                EXPECT_EQ(sat__gl_read(&s.gl, k ? (void *)blended : (void *)counts,
                                       gl->target[k ? TONEMAP__T_BINS : TONEMAP__T_COUNTS].texture,
                                       k ? SAT__GL_R32F : SAT__GL_R32UI, 64, TONEMAP__BIN_ROWS),
                          SAT_OK);
                sat__gl_end(&s.gl, &saved);
                tonemap_gl_destroy(gl);
            }
            for (j = 0; j < 64 * TONEMAP__BIN_ROWS; j++) differ += (float)counts[j] != blended[j];
            EXPECT_EQ(differ, 0);
            EXPECT(memcmp(state[0], state[1], sizeof state[0]) == 0);
            s.gl.DeleteTextures(1, &hdr);
            free(pixels);
            free(weights);
            free(counts);
            free(blended);
        }
    screen_close(&s);
}

/* ---- dynamic resolution */

/* A picture of 41 x 29 in the corner of one of 70 x 50, by an object that has drawn all of it before. */
static void smaller(screen *s, const tonemap_options *o, sat_gl_get_proc *get_proc)
{
    enum { W = 70, H = 50, W1 = 41, H1 = 29 };
    static unsigned char first[4 * W * H], second[4 * W * H], nothing[4 * W * H];
    float *pixels = lit_pixels(W, H, 1);
    unsigned hdr = screen_texture(s, SAT__GL_RGBA32F, W, H, pixels), ldr;
    sat_gl_target to;
    tonemap_gl *gl = NULL;
    int i, wrong = 0;
    memset(nothing, 77, sizeof nothing);
    ldr = screen_texture(s, SAT__GL_RGBA8, W, H, nothing);
    to = sat_gl_to_texture(ldr);
    to.width = W1, to.height = H1;
    EXPECT_EQ(tonemap_gl_create(&gl, get_proc, W, H, o), SAT_OK);
    EXPECT_EQ(tonemap_gl_apply(gl, NULL, hdr, 0), SAT_OK);
    EXPECT_EQ(tonemap_gl_apply(gl, &to, hdr, 0), SAT_OK);
    screen_read(s, first, ldr, W, H);
    to.width = W + 1;
    EXPECT_EQ(tonemap_gl_apply(gl, &to, hdr, 0), SAT_ERR_SIZE);
    to.width = 0;
    EXPECT_EQ(tonemap_gl_apply(gl, &to, hdr, 0), SAT_ERR_ARGUMENT);
    to.height = 0;
    EXPECT_EQ(tonemap_gl_apply(gl, &to, hdr, 0), SAT_OK); /* all of it again */
    screen_read(s, second, ldr, W, H);
    EXPECT_EQ(tonemap_gl_apply(gl, NULL, hdr, 0), SAT_OK);
    screen_read(s, nothing, tonemap_gl_texture(gl), W, H);
    EXPECT(memcmp(second, nothing, sizeof second) == 0);
    tonemap_gl_destroy(gl);
    EXPECT_EQ(tonemap_gl_create(&gl, get_proc, W1, H1, o), SAT_OK);
    EXPECT_EQ(tonemap_gl_apply(gl, NULL, hdr, 0), SAT_OK);
    screen_read(s, second, tonemap_gl_texture(gl), W1, H1);
    for (i = 0; i < W * H; ++i) {
        static const unsigned char untouched[4] = {77, 77, 77, 77};
        int inside = i % W < W1 && i / W < H1;
        wrong += memcmp(first + 4 * i, inside ? second + 4 * (i / W * W1 + i % W) : untouched, 4) != 0;
    }
    EXPECT_EQ(wrong, 0);
    tonemap_gl_destroy(gl);
    s->gl.DeleteTextures(1, &hdr);
    s->gl.DeleteTextures(1, &ldr);
    free(pixels);
}

TEST(gl_takes_smaller_pictures)
{
    screen s;
    tonemap_options o = local_options();
    if (!screen_open(&s)) return;
    screen_proc = s.context.get_proc;
    smaller(&s, NULL, screen_proc);
    smaller(&s, NULL, screen_plain);
    smaller(&s, &o, screen_proc);
    o.soft = 0, o.selective = 0.1, o.key = 0;
    smaller(&s, &o, screen_proc);
    o.operation = TONEMAP_ASHIKHMIN;
    smaller(&s, &o, screen_proc);
    screen_close(&s);
}

/* ---- one picture after the other, on both */

typedef struct pair {
    screen s;
    int width, height;
    float *pixels;
    unsigned char *codes[2];
    unsigned hdr;
    tonemap *map;
    tonemap_gl *gl;
} pair;

/* 0 without OpenGL. */
static int pair_open(pair *p, int width, int height, const tonemap_options *o)
{
    memset(p, 0, sizeof *p);
    if (!screen_open(&p->s)) return 0;
    p->width = width;
    p->height = height;
    p->pixels = lit_pixels(width, height, 0);
    p->codes[0] = (unsigned char *)malloc((size_t)(width * height) * 8);
    p->codes[1] = p->codes[0] + width * height * 4;
    p->hdr = screen_texture(&p->s, SAT__GL_RGBA32F, width, height, p->pixels);
    EXPECT_EQ(tonemap_create(&p->map, width, height, o), SAT_OK);
    EXPECT_EQ(tonemap_gl_create(&p->gl, p->s.context.get_proc, width, height, o), SAT_OK);
    return 1;
}

static void pair_close(pair *p)
{
    tonemap_destroy(p->map);
    tonemap_gl_destroy(p->gl);
    p->s.gl.DeleteTextures(1, &p->hdr);
    screen_close(&p->s);
    free(p->pixels);
    free(p->codes[0]);
}

/* The largest difference of two codes of the next picture, the same one times `light`. */
static int pair_step(pair *p, double light, double dt)
{
    int n = p->width * p->height * 4, i, worst = 0;
    float *scaled = (float *)malloc((size_t)n * sizeof(float));
    sat_image view = sat_image_f32(scaled, p->width, p->height, 4);
    sat__gl_state state;
    for (i = 0; i < n; ++i) scaled[i] = (float)((double)p->pixels[i] * light);
    sat__gl_begin(&p->s.gl, &state, 1);
    sat__gl_upload(&p->s.gl, p->hdr, SAT__GL_RGBA32F, p->width, p->height, scaled);
    sat__gl_end(&p->s.gl, &state);
    EXPECT_EQ(tonemap_apply_u8(p->map, p->codes[0], 0, &view, dt, NULL), SAT_OK);
    EXPECT_EQ(tonemap_gl_apply(p->gl, 0, p->hdr, dt), SAT_OK);
    screen_read(&p->s, p->codes[1], tonemap_gl_texture(p->gl), p->width, p->height);
    for (i = 0; i < n; ++i)
        if (i % 4 != 3 && abs((int)p->codes[0][i] - (int)p->codes[1][i]) > worst)
            worst = abs((int)p->codes[0][i] - (int)p->codes[1][i]);
    free(scaled);
    return worst;
}

/* The rounded luminances and their sums are the CPU's integers. */
TEST(gl_sums_are_the_cpus_integers)
{
    enum { W = 90, H = 70 };
    static uint32_t quanta[W * H];
    int32_t row[W + 3], sums[4]; /* quantise writes by fours */
    tonemap_options o = local_options();
    pair p;
    const sat__gl_target *level;
    sat__gl_state state;
    int x, y, off = 0;
    int64_t log_sum;
    if (!pair_open(&p, W, H, &o)) return;
    EXPECT(pair_step(&p, 1, 0) <= 1);
    sat__gl_begin(&p.s.gl, &state, 1);
    EXPECT_EQ(sat__gl_read(&p.s.gl, quanta, p.gl->target[TONEMAP__T_QUANTA].texture, SAT__GL_R32UI, W, H), SAT_OK);
    level = &p.gl->target[TONEMAP__T_LEVEL + p.gl->levels - 1];
    EXPECT_EQ(sat__gl_read(&p.s.gl, sums, level->texture, SAT__GL_RGBA32I, 1, 1), SAT_OK);
    sat__gl_end(&p.s.gl, &state);
    log_sum = (int64_t)sums[0] * 65536 + sums[1];
    EXPECT_NEAR((double)(log_sum - p.map->worker[0].log_sum) / 65536 / (W * H), 0, 1e-6);
    EXPECT_EQ(sums[2], W * H);
    for (y = 0; y < H; ++y) {
        tonemap__quantise(row, p.map->luminance + y * p.map->row, W, &p.map->frame);
        for (x = 0; x < W; ++x) off += abs(row[x] - (int32_t)quanta[y * W + x]) > (row[x] >> 20) + 1;
    }
    EXPECT_EQ(off, 0);
    pair_close(&p);
}

TEST(gl_state_comes_back)
{
    enum { W = 33, H = 20 };
    sat_gl_target to;
    screen s;
    float *pixels = lit_pixels(W, H, 0);
    tonemap_options o = local_options();
    sat__gl_state before, after;
    tonemap_gl *gl = NULL;
    unsigned hdr, other;
    if (!screen_open(&s)) { free(pixels); return; }
    o.key = 0;
    hdr = screen_texture(&s, SAT__GL_RGBA32F, W, H, pixels);
    other = screen_texture(&s, SAT__GL_RGBA8, W, H, NULL);
    s.gl.ActiveTexture(SAT__GL_TEXTURE0 + 2);
    s.gl.BindTexture(SAT__GL_TEXTURE_2D, other);
    s.gl.ActiveTexture(SAT__GL_TEXTURE0 + 1);
    s.gl.BindTexture(SAT__GL_TEXTURE_2D, hdr);
    s.gl.Enable(SAT__GL_BLEND);
    s.gl.Enable(SAT__GL_SCISSOR_TEST);
    s.gl.Enable(SAT__GL_CULL_FACE);
    s.gl.BlendFuncSeparate(SAT__GL_SRC_ALPHA, SAT__GL_ONE_MINUS_SRC_ALPHA, SAT__GL_ONE, SAT__GL_ZERO);
    s.gl.Viewport(1, 2, 3, 4);
    s.gl.ColorMask(1, 0, 1, 0);
    s.gl.PixelStorei(SAT__GL_UNPACK_ALIGNMENT, 8);
    s.gl.BindFramebuffer(SAT__GL_FRAMEBUFFER, s.gl.framebuffer);
    sat__gl_begin(&s.gl, &before, 8);
    sat__gl_end(&s.gl, &before);
    EXPECT_EQ(tonemap_gl_create(&gl, s.context.get_proc, W, H, &o), SAT_OK);
    EXPECT_EQ(tonemap_gl_apply(gl, 0, hdr, 0), SAT_OK);
    to = sat_gl_to_texture(other);
    EXPECT_EQ(tonemap_gl_apply(gl, &to, hdr, 1), SAT_OK);
    EXPECT_EQ(s.gl.GetError(), SAT__GL_NO_ERROR);
    sat__gl_begin(&s.gl, &after, 8);
    sat__gl_end(&s.gl, &after);
    EXPECT(memcmp(&before, &after, sizeof before) == 0);
    EXPECT_EQ(after.viewport[2], 3);
    tonemap_gl_destroy(gl);
    s.gl.DeleteTextures(1, &hdr);
    s.gl.DeleteTextures(1, &other);
    screen_close(&s);
    free(pixels);
}

/* Light that changes by a factor, over time. */
TEST(gl_adapts_as_the_cpu_does)
{
    const double dt[6] = {0, 0.1, 0.3, 0, 2, 1}, light[6] = {1, 100, 100, 0, 0.1, 0.1005};
    tonemap_options o = local_options();
    pair p;
    int k;
    o.adapt_seconds = 0.5;
    o.darker_seconds = 1.5;
    if (!pair_open(&p, 24, 18, &o)) return;
    for (k = 0; k < 6; ++k) EXPECT(pair_step(&p, light[k], dt[k]) <= 1);
    pair_close(&p);
}

/* What is a uniform changes between two pictures, as on the CPU; what is compiled is refused and changes nothing. */
TEST(gl_options_change_between_pictures)
{
    tonemap_options o = local_options(), other;
    pair p;
    int k;
    EXPECT_EQ(tonemap_gl_set_options(NULL, &o), SAT_ERR_ARGUMENT);
    o.white = 5;
    o.adapt_seconds = 1;
    if (!pair_open(&p, 40, 30, &o)) return;
    EXPECT_EQ(tonemap_gl_set_options(p.gl, NULL), SAT_ERR_ARGUMENT); /* the default's white is infinite */
    for (k = 0; k < 9; ++k) {
        other = o;
        if (k == 0) other.operation = TONEMAP_LINEAR;
        if (k == 1) other.scales = 3;
        if (k == 2) other.phi = 2;
        if (k == 3) other.epsilon = 1;
        if (k == 4) other.soft = 0.5;
        if (k == 5) other.gamut = 1;
        if (k == 6) other.metering = TONEMAP_METERING_LOG_AVERAGE;
        if (k == 7) other.key = 0;
        if (k == 8) other.adapt_seconds = -1;
        EXPECT_EQ(tonemap_gl_set_options(p.gl, &other), SAT_ERR_ARGUMENT);
    }
    for (k = 0; k < 6; ++k) {
        if (k == 1) o.key = 0.4;
        if (k == 2) o.white = 2;
        if (k == 3) o.exposure = 0.1;
        if (k == 4) o.exposure = 0, o.adapt_high = 0.02;
        if (k == 5) o.darker_seconds = 0.3;
        EXPECT_EQ(tonemap_set_options(p.map, &o), SAT_OK);
        EXPECT_EQ(tonemap_gl_set_options(p.gl, &o), SAT_OK);
        EXPECT(pair_step(&p, 1, 0.2) <= 1);
    }
    pair_close(&p);
}

static sat_gl_proc no_proc(const char *name)
{
    (void)name;
    return NULL;
}

TEST(gl_failures_have_a_message)
{
    tonemap_gl *gl = NULL;
    support_memory memory;
    tonemap_options o = local_options();
    screen s;
    EXPECT_EQ(tonemap_gl_create(&gl, NULL, 8, 8, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(tonemap_gl_create(&gl, no_proc, 0, 8, NULL), SAT_ERR_ARGUMENT);
    EXPECT(gl == NULL);
    EXPECT_EQ(tonemap_gl_create(&gl, no_proc, 8, 8, NULL), SAT_ERR_GL_FUNCTION);
    EXPECT(strstr(tonemap_gl_message(gl), "gl") != NULL);
    EXPECT_EQ(tonemap_gl_apply(gl, 0, 1, 0), SAT_ERR_ARGUMENT);
    tonemap_gl_destroy(gl);
    tonemap_gl_destroy(NULL);
    EXPECT(tonemap_gl_message(NULL)[0] != 0);
    if (!screen_open(&s)) return;
    o.allocator = support_allocator(&memory);
    EXPECT_EQ(tonemap_gl_create(&gl, s.context.get_proc, 8, 8, &o), SAT_OK);
    EXPECT_EQ(tonemap_gl_apply(gl, 0, 0, 0), SAT_ERR_ARGUMENT);
    EXPECT_EQ(tonemap_gl_apply(gl, 0, 1, -1), SAT_ERR_ARGUMENT);
    tonemap_gl_destroy(gl);
    EXPECT(support_memory_clean(&memory));
    EXPECT_EQ(tonemap_gl_create(&gl, s.context.get_proc, 1 << 22, 8, &o), SAT_ERR_SIZE);
    tonemap_gl_destroy(gl);
    EXPECT(support_memory_clean(&memory));
    memory.fail_at = memory.calls + 1;
    EXPECT_EQ(tonemap_gl_create(&gl, s.context.get_proc, 8, 8, &o), SAT_ERR_MEMORY);
    EXPECT(gl == NULL);
    memory.fail_at = memory.calls + 2;
    EXPECT_EQ(tonemap_gl_create(&gl, s.context.get_proc, 8, 8, &o), SAT_ERR_MEMORY);
    tonemap_gl_destroy(gl);
    EXPECT(support_memory_clean(&memory));
    screen_close(&s);
}

/* The functions for shaders of the caller's own, a texel each, against what they say they do. */
TEST(gl_glsl_is_what_it_says)
{
    static const char fragment[] =
        "layout(location = 0) out vec4 colour;\n"
        "void main() {\n"
        "    float v = floor(gl_FragCoord.x) / 32.0;\n"
        "    vec3 rgb = vec3(v, 0.5 * v, 2.0 * v - 0.1);\n"
        "    colour = vec4(tonemap_srgb(rgb).xz, tonemap_luminance(rgb), tonemap_rho(v * 10.0));\n"
        "}\n";
    static float out[64][4];
    const char *library[2], *text[2];
    sat__gl_shaders shaders;
    sat__gl_state state;
    unsigned program = 0, target = 0, framebuffer = 0;
    screen s;
    int i;
    if (!screen_open(&s)) return;
    memset(&shaders, 0, sizeof shaders);
    library[0] = tonemap_gl_glsl();
    text[0] = fragment;
    library[1] = text[1] = NULL;
    shaders.name = "functions";
    shaders.library = library;
    shaders.fragment = text;
    sat__gl_begin(&s.gl, &state, 1);
    if (!EXPECT_EQ(sat__gl_build(&s.gl, &program, &shaders), SAT_OK)) puts(s.gl.message);
    EXPECT_EQ(sat__gl_texture(&s.gl, &target, SAT__GL_RGBA32F, 64, 1, NULL), SAT_OK);
    EXPECT_EQ(sat__gl_framebuffer(&s.gl, &framebuffer, &target, 1, 0), SAT_OK);
    sat__gl_pass(&s.gl, program, framebuffer, 64, 1);
    sat__gl_draw(&s.gl);
    EXPECT_EQ(sat__gl_read(&s.gl, out, target, SAT__GL_RGBA32F, 64, 1), SAT_OK);
    for (i = 0; i < 64; i++) {
        double v = i / 32.0, blue = fmin(fmax(2 * v - 0.1, 0), 1), red = fmin(v, 1);
        double y = 0.2126 * v + 0.7152 * 0.5 * v + 0.0722 * (2 * v - 0.1);
        EXPECT_NEAR(out[i][0], red <= 0.0031308 ? 12.92 * red : 1.055 * pow(red, 1 / 2.4) - 0.055, 1e-5);
        EXPECT_NEAR(out[i][1], blue <= 0.0031308 ? 12.92 * blue : 1.055 * pow(blue, 1 / 2.4) - 0.055, 1e-5);
        EXPECT_NEAR(out[i][2], y > 0 ? y : 0, 1e-4);
        EXPECT_NEAR(out[i][3], tonemap__rho((float)(v * 10)), 1e-3);
    }
    s.gl.DeleteProgram(program);
    s.gl.DeleteFramebuffers(1, &framebuffer);
    s.gl.DeleteTextures(1, &target);
    sat__gl_end(&s.gl, &state);
    screen_close(&s);
}
