/* sat.h on the GPU: tables, lookups, state, errors. Needs OSMesa (or a GPU, see gl_context.h); skips without. */

#include "support.h"
#include "gl_context.h"

/* ---- a context whose functions can be watched, hidden or replaced ---- */

static gl_context test_gl;
static const char *test_hidden;                  /* this function does not exist */
static int test_as_es;                           /* the context calls itself OpenGL ES 3.0 */
static const char *test_garbage;                 /* goes in front of the text of every shader after this many */
static int test_good_shaders;
static FILE *test_shader_file;                   /* every shader text is appended to it */
static int test_objects, test_generated;         /* alive; ever made */
static int test_bad_textures;                    /* texture names are made, but no more texture images */

typedef struct test_functions { sat__gl real; } test_functions;
static test_functions test_f;

#define TEST_GENERATOR(name)                                                                                           \
    static void SAT__GL_CALL test_Gen##name(int n, unsigned *out)                                                      \
    {                                                                                                                  \
        test_objects += n;                                                                                             \
        test_generated += n;                                                                                           \
        test_f.real.Gen##name(n, out);                                                                                 \
    }                                                                                                                  \
    static void SAT__GL_CALL test_Delete##name(int n, const unsigned *names)                                           \
    {                                                                                                                  \
        int i;                                                                                                         \
        for (i = 0; i < n; i++) test_objects -= names[i] != 0;                                                         \
        test_f.real.Delete##name(n, names);                                                                            \
    }
TEST_GENERATOR(Textures)
TEST_GENERATOR(Framebuffers)
TEST_GENERATOR(VertexArrays)
TEST_GENERATOR(Buffers)

static unsigned SAT__GL_CALL test_CreateShader(unsigned type)
{
    test_objects++;
    return test_f.real.CreateShader(type);
}
static void SAT__GL_CALL test_DeleteShader(unsigned shader)
{
    test_objects -= shader != 0;
    test_f.real.DeleteShader(shader);
}
static unsigned SAT__GL_CALL test_CreateProgram(void)
{
    test_objects++;
    return test_f.real.CreateProgram();
}
static void SAT__GL_CALL test_DeleteProgram(unsigned program)
{
    test_objects -= program != 0;
    test_f.real.DeleteProgram(program);
}
static const unsigned char *SAT__GL_CALL test_GetString(unsigned name)
{
    return test_as_es && name == SAT__GL_VERSION ? (const unsigned char *)"OpenGL ES 3.0 (pretended)"
                                                 : test_f.real.GetString(name);
}
static void SAT__GL_CALL test_ShaderSource(unsigned shader, int count, const char *const *parts, const int *lengths)
{
    const char *text[80];
    int i, n = 0;
    for (i = 0; i < count; i++) {
        text[n++] = parts[i];
        if (i == 0 && test_garbage && test_good_shaders-- <= 0) text[n++] = test_garbage;
    }
    for (i = 0; i < n && test_shader_file; i++) fputs(text[i], test_shader_file);
    if (test_shader_file) fputs("\n@\n", test_shader_file);
    test_f.real.ShaderSource(shader, n, text, lengths);
}
static void SAT__GL_CALL test_TexImage2D(unsigned target, int level, int internal, int width, int height, int border,
                                         unsigned format, unsigned type, const void *pixels)
{
    if (test_bad_textures) internal = 1;
    test_f.real.TexImage2D(target, level, internal, width, height, border, format, type, pixels);
}

#define TEST_REPLACE(name) if (strcmp(text, "gl" #name) == 0) return (sat_gl_proc)test_##name;
static sat_gl_proc test_get_proc(const char *text)
{
    if (test_hidden && strcmp(text, test_hidden) == 0) return NULL;
    TEST_REPLACE(GenTextures) TEST_REPLACE(DeleteTextures)
    TEST_REPLACE(GenFramebuffers) TEST_REPLACE(DeleteFramebuffers)
    TEST_REPLACE(GenVertexArrays) TEST_REPLACE(DeleteVertexArrays)
    TEST_REPLACE(GenBuffers) TEST_REPLACE(DeleteBuffers)
    TEST_REPLACE(CreateShader) TEST_REPLACE(DeleteShader)
    TEST_REPLACE(CreateProgram) TEST_REPLACE(DeleteProgram)
    TEST_REPLACE(GetString) TEST_REPLACE(ShaderSource) TEST_REPLACE(TexImage2D)
    return test_gl.get_proc(text);
}

/* Opens the context and the test's own function table; 0 when there is no OpenGL (after SKIP's line). */
static int test_open(void)
{
    test_hidden = test_garbage = NULL;
    test_as_es = test_good_shaders = test_objects = test_generated = test_bad_textures = 0;
    test_shader_file = NULL;
    if (!gl_context_open(&test_gl, 3, 3)) {
        expect_skip(test_gl.message);
        return 0;
    }
    return EXPECT_EQ(sat__gl_open(&test_f.real, test_gl.get_proc), SAT_OK);
}

static void test_close(void)
{
    EXPECT_EQ(test_f.real.GetError(), 0);
    sat__gl_close(&test_f.real);
    gl_context_close(&test_gl);
}

static unsigned test_texture(unsigned internal, int width, int height, const void *pixels)
{
    unsigned texture = 0;
    sat__gl_state state;
    sat__gl_begin(&test_f.real, &state, 1);
    EXPECT_EQ(sat__gl_texture(&test_f.real, &texture, internal, width, height, pixels), SAT_OK);
    sat__gl_end(&test_f.real, &state);
    return texture;
}

static void test_read(void *out, unsigned texture, unsigned internal, int width, int height)
{
    sat__gl_state state;
    sat__gl_begin(&test_f.real, &state, 1);
    EXPECT_EQ(sat__gl_read(&test_f.real, out, texture, internal, width, height), SAT_OK);
    sat__gl_end(&test_f.real, &state);
}

static void test_delete(unsigned texture) { test_f.real.DeleteTextures(1, &texture); }

/* The options of the published passes. */
static sat_gl_options test_flat(void)
{
    sat_gl_options options = sat_gl_defaults();
    options.format = SAT_GL_TWO_FLOAT;
    return options;
}

/* ---- references ---- */

/* The value that a table counts a float as. */
static double test_clean(float v, double limit)
{
    if (sat__is_nan(v)) return 0;
    return (double)v > limit ? limit : (double)v < -limit ? -limit : (double)v;
}

static uint32_t test_quantise(float v, double quantum, double limit)
{
    return (uint32_t)(int64_t)nearbyint(test_clean(v, limit) / quantum);
}

typedef struct test_case {
    int width, height, rows_only;
    float *pixels;
    long double *sums, *sizes; /* of the values, of their absolute values */
} test_case;

static void test_case_make(test_case *t, int width, int height, uint64_t seed)
{
    size_t n = (size_t)width * (size_t)height, i;
    memset(t, 0, sizeof *t);
    t->width = width;
    t->height = height;
    t->pixels = (float *)malloc(n * sizeof *t->pixels);
    t->sums = (long double *)malloc(2 * n * sizeof *t->sums);
    t->sizes = t->sums + n;
    for (i = 0; i < n; i++) {
        double u = support_uniform(&seed);
        t->pixels[i] = (float)(exp(6.0 * support_gaussian(&seed)) * (u < 0.2 ? -1.0 : 1.0));
    }
    if (n > 8) {
        t->pixels[n / 3] = sat__float_from_bits(0x7fc00001u);
        t->pixels[n / 2] = sat__float_from_bits(0x7f800000u);
        t->pixels[n / 2 + 1] = sat__float_from_bits(0xff800000u);
        t->pixels[n - 1] = 3e38f;
    }
}

static void test_case_free(test_case *t)
{
    free(t->pixels);
    free(t->sums);
}

static void test_case_sum(test_case *t, double limit)
{
    int x, y;
    for (y = 0; y < t->height; y++) {
        long double sum = 0, size = 0;
        for (x = 0; x < t->width; x++) {
            size_t i = (size_t)y * (size_t)t->width + (size_t)x;
            long double v = test_clean(t->pixels[i], limit);
            sum += v;
            size += v < 0 ? -v : v;
            t->sums[i] = sum + (y && !t->rows_only ? t->sums[i - (size_t)t->width] : 0);
            t->sizes[i] = size + (y && !t->rows_only ? t->sizes[i - (size_t)t->width] : 0);
        }
    }
}

/* The largest error against the reference, relative to the sum of absolute values. */
static double test_float_error(const test_case *t, const float *table, int parts)
{
    size_t i, n = (size_t)t->width * (size_t)t->height;
    double worst = 0;
    for (i = 0; i < n; i++) {
        long double v = parts == 2 ? (long double)table[2 * i] + (long double)table[2 * i + 1] : (long double)table[i];
        double error = (double)((v - t->sums[i]) / (t->sizes[i] + 1e-30L));
        if (sat__is_nan((float)v)) return 1e30;
        if (error < 0) error = -error;
        if (error > worst) worst = error;
    }
    return worst;
}

static long test_fixed_mismatches(const test_case *t, const uint32_t *table, double quantum, double limit)
{
    uint32_t *column = (uint32_t *)calloc((size_t)t->width, sizeof *column);
    long wrong = 0;
    int x, y;
    for (y = 0; y < t->height; y++) {
        uint32_t run = 0;
        for (x = 0; x < t->width; x++) {
            size_t i = (size_t)y * (size_t)t->width + (size_t)x;
            run += test_quantise(t->pixels[i], quantum, limit);
            column[x] = t->rows_only ? run : column[x] + test_quantise(t->pixels[i], quantum, limit);
            if (t->rows_only) wrong += table[i] != run;
        }
        for (x = 0, run = 0; x < t->width && !t->rows_only; x++) {
            run += column[x];
            wrong += table[(size_t)y * (size_t)t->width + (size_t)x] != run;
        }
    }
    free(column);
    return wrong;
}

/* Builds with one object and compares. max_value 1e6, so that the fixed tables have a range to work with. */
static void test_one(sat_gl *g, sat_gl_format format, test_case *t)
{
    size_t n = (size_t)t->width * (size_t)t->height;
    float *table = (float *)malloc(n * 2 * sizeof *table);
    unsigned texture = test_texture(SAT__GL_R32F, t->width, t->height, t->pixels);
    EXPECT_EQ(t->rows_only ? sat_gl_scan(g, 0, texture, t->width, t->height)
                           : sat_gl_build(g, 0, texture, t->width, t->height),
              SAT_OK);
    test_read(table, sat_gl_table(g), sat__gl_internal(format), t->width, t->height);
    if (format == SAT_GL_FIXED32) {
        uint32_t *bits = (uint32_t *)malloc(n * sizeof *bits);
        memcpy(bits, table, n * sizeof *bits);
        EXPECT_EQ(test_fixed_mismatches(t, bits, sat_gl_quantum(g), (double)g->limit), 0);
        free(bits);
    } else {
        double error;
        test_case_sum(t, 1e6);
        error = test_float_error(t, table, format == SAT_GL_TWO_FLOAT ? 2 : 1);
        EXPECT_NEAR(error, 0, format == SAT_GL_TWO_FLOAT ? 1e-12 : 4e-6);
    }
    test_delete(texture);
    free(table);
}

static const int test_sizes[][2] = {{1, 1}, {1, 37}, {53, 1}, {2, 3}, {64, 16}, {65, 3}, {97, 101}, {1031, 67}};
enum { TEST_SIZES = 7 }; /* the last one for some */

static sat_gl *test_create(sat_gl_format format, sat_scan_algorithm algorithm, int k, int compute)
{
    sat_gl_options options = test_flat();
    sat_gl *g = NULL;
    options.format = format;
    options.algorithm = algorithm;
    options.k = k;
    options.compute = compute;
    options.max_value = 1e6;
    if (!EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_OK)) puts(sat_gl_message(g));
    EXPECT_EQ(g->compute, compute && !test_as_es);
    return g;
}

/* Every size through one object, some twice, so that textures are made, reused and replaced. */
static void test_combination(sat_gl_format format, sat_scan_algorithm algorithm, int k, int compute)
{
    sat_gl *g = test_create(format, algorithm, k, compute);
    test_case t;
    int i;
    for (i = 0; i < TEST_SIZES + (k == 4 || (compute && k == 64)); i++) {
        test_case_make(&t, test_sizes[i][0], test_sizes[i][1], (uint64_t)(i + 7 * k));
        test_one(g, format, &t);
        t.rows_only = 1;
        if (i & 1) test_one(g, format, &t);
        test_case_free(&t);
    }
    sat_gl_destroy(g);
    EXPECT_EQ(test_objects, 0);
}

static void test_format(sat_gl_format format)
{
#ifdef __cplusplus
    static const int ks[] = {4}; /* the same shaders: the C twin has tried them all */
#else
    static const int ks[] = {4, 2, 3, 6, 8};
#endif
    int i;
    if (!test_open()) return;
    for (i = 0; i < (int)(sizeof ks / sizeof *ks); i++) {
        test_combination(format, SAT_SCAN_BALANCED_TREE, ks[i], 0);
        test_combination(format, SAT_SCAN_RECURSIVE_DOUBLING, ks[i], 0);
    }
    test_combination(format, SAT_SCAN_BALANCED_TREE, 64, 0);
    test_combination(format, SAT_SCAN_RECURSIVE_DOUBLING, 64, 0);
    if (test_f.real.has_compute) {
        test_combination(format, SAT_SCAN_BALANCED_TREE, 3, 1);
        test_combination(format, SAT_SCAN_BALANCED_TREE, 8, 1);
        test_combination(format, SAT_SCAN_BALANCED_TREE, 64, 1);
    }
    test_close();
}

TEST(two_float_tables) { test_format(SAT_GL_TWO_FLOAT); }
TEST(float_tables) { test_format(SAT_GL_FLOAT); }
TEST(fixed_tables_are_exact) { test_format(SAT_GL_FIXED32); }

/* GLSL ES 3.00 shaders, run by a desktop driver (ARB_ES3_compatibility). */
TEST(es_shaders)
{
    if (!test_open()) return;
    test_as_es = 1;
    test_combination(SAT_GL_TWO_FLOAT, SAT_SCAN_BALANCED_TREE, 4, 0);
    test_combination(SAT_GL_FLOAT, SAT_SCAN_RECURSIVE_DOUBLING, 4, 0);
    test_combination(SAT_GL_FIXED32, SAT_SCAN_BALANCED_TREE, 4, 1);
    test_close();
}

/* ---- the same integers as the CPU's table ---- */

TEST(fixed_equals_the_cpu_table)
{
    sat_options cpu_options = sat_defaults();
    sat_gl_options options = test_flat();
    sat_table *cpu = NULL;
    sat_gl *g = NULL;
    test_case t;
    sat_image image;
    uint32_t *table;
    unsigned texture;
    long wrong = 0;
    int x, y;
    if (!test_open()) return;
    test_case_make(&t, 131, 89, 11);
    cpu_options.kind = SAT_KIND_FIXED32;
    cpu_options.max_value = options.max_value = 5000;
    cpu_options.max_box_area = options.max_box_area = 41 * 41;
    options.format = SAT_GL_FIXED32;
    image = sat_image_f32(t.pixels, t.width, t.height, 1);
    EXPECT_EQ(sat_create(&cpu, t.width, t.height, 1, &cpu_options), SAT_OK);
    EXPECT_EQ(sat_build(cpu, &image), SAT_OK);
    EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_OK);
    texture = test_texture(SAT__GL_R32F, t.width, t.height, t.pixels);
    EXPECT_EQ(sat_gl_build(g, 0, texture, t.width, t.height), SAT_OK);
    EXPECT_NEAR(sat_gl_quantum(g), sat_get_stats(cpu).quantum, 0);
    table = (uint32_t *)malloc((size_t)t.width * (size_t)t.height * sizeof *table);
    test_read(table, sat_gl_table(g), SAT__GL_R32UI, t.width, t.height);
    for (y = 1; y <= t.height; y++)
        for (x = 1; x <= t.width; x++) { /* modulo 2^32, as a box sum */
            double sum =
                (double)(int32_t)table[(size_t)(y - 1) * (size_t)t.width + (size_t)(x - 1)] * sat_gl_quantum(g);
            wrong += sum < sat_sum(cpu, 0, 0, 0, x, y) || sum > sat_sum(cpu, 0, 0, 0, x, y);
        }
    EXPECT_EQ(wrong, 0);
    free(table);
    test_delete(texture);
    sat_gl_destroy(g);
    sat_destroy(cpu);
    test_case_free(&t);
    test_close();
}

/* ---- inputs ---- */

TEST(channels_and_unsigned_input)
{
    float rgba[5 * 4 * 4], table[20];
    uint32_t values[6] = {0xffffffffu, 3, 0x80000000u, 7, 0x80000000u, 1}, sums[6];
    const uint32_t want[6] = {0xffffffffu, 2, 0x80000002u, 6, 0x80000009u, 10};
    sat_gl_options options = test_flat();
    sat_gl *g = NULL;
    unsigned texture;
    int c, i;
    if (!test_open()) return;
    for (i = 0; i < 80; i++) rgba[i] = (float)(1 + i % 4 * 10);
    texture = test_texture(SAT__GL_RGBA32F, 5, 4, rgba);
    for (c = 0; c < 4; c++) {
        options.format = SAT_GL_FLOAT;
        options.channel = c;
        EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_OK);
        EXPECT_EQ(sat_gl_build(g, 0, texture, 5, 4), SAT_OK);
        test_read(table, sat_gl_table(g), SAT__GL_R32F, 5, 4);
        EXPECT_NEAR(table[19], 20 * (1 + 10 * c), 0);
        sat_gl_destroy(g);
    }
    test_delete(texture);
    options.format = SAT_GL_FIXED32;
    options.channel = 0;
    options.unsigned_input = 1;
    texture = test_texture(SAT__GL_R32UI, 3, 2, values);
    EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_OK);
    EXPECT_EQ(sat_gl_build(g, 0, texture, 3, 2), SAT_OK);
    EXPECT_NEAR(sat_gl_quantum(g), 1, 0);
    test_read(sums, sat_gl_table(g), SAT__GL_R32UI, 3, 2);
    for (i = 0; i < 6; i++) EXPECT_EQ(sums[i], want[i]);
    EXPECT_EQ(sat_gl_mean(g, NULL, texture, 3, 2), SAT_ERR_ARGUMENT);
    sat_gl_destroy(g);
    test_delete(texture);
    test_close();
}

/* Into the caller's texture, from a part of a texture that stays as it is; both orders of the two halves. */
TEST(borrowed_table_and_untouched_input)
{
    test_case t;
    sat_gl *g;
    float *back = (float *)malloc(61 * 47 * 2 * sizeof *back);
    unsigned texture, table;
    int kind, part;
    if (!test_open()) {
        free(back);
        return;
    }
    for (kind = 0; kind < 4; kind++) {
        g = test_create(SAT_GL_TWO_FLOAT, kind & 1 ? SAT_SCAN_RECURSIVE_DOUBLING : SAT_SCAN_BALANCED_TREE,
                        kind & 2 ? 8 : 2, 0);
        for (part = 0; part < 2; part++) {
            int w = part ? 23 : 61, h = part ? 9 : 47, x, y;
            test_case_make(&t, 61, 47, 5);
            texture = test_texture(SAT__GL_R32F, 61, 47, t.pixels);
            table = test_texture(SAT__GL_RG32F, 61, 47, NULL);
            EXPECT_EQ(sat_gl_build(g, table, texture, w, h), SAT_OK);
            EXPECT_EQ(sat_gl_table(g), 0); /* none of its own is made */
            EXPECT_EQ(sat_gl_build(g, texture, texture, w, h), SAT_ERR_ARGUMENT);
            test_read(back, texture, SAT__GL_R32F, 61, 47);
            EXPECT_EQ(memcmp(back, t.pixels, 61 * 47 * sizeof *back), 0);
            test_read(back, table, SAT__GL_RG32F, 61, 47);
            for (y = 0; y < h; y++)
                for (x = 0; x < w; x++) {
                    t.pixels[y * w + x] = t.pixels[y * 61 + x]; /* the part alone, packed */
                    back[2 * (y * w + x)] = back[2 * (y * 61 + x)];
                    back[2 * (y * w + x) + 1] = back[2 * (y * 61 + x) + 1];
                }
            t.width = w;
            t.height = h;
            test_case_sum(&t, 1e6);
            EXPECT_NEAR(test_float_error(&t, back, 2), 0, 1e-12);
            test_delete(texture);
            test_delete(table);
            test_case_free(&t);
        }
        texture = test_texture(SAT__GL_R32F, 23, 9, NULL);
        EXPECT_EQ(sat_gl_build(g, 0, texture, 23, 9), SAT_OK); /* until it is asked for */
        EXPECT(sat_gl_table(g) != 0);
        test_delete(texture);
        sat_gl_destroy(g);
        EXPECT_EQ(test_objects, 0);
    }
    free(back);
    test_close();
}

TEST(means)
{
    static const int ks[] = {2, 4, 64};
    test_case t;
    sat_gl *g;
    unsigned texture;
    float mean, texel[2];
    int i, s;
    if (!test_open()) return;
    for (i = 0; i < 3; i++) {
        g = test_create(SAT_GL_FIXED32, SAT_SCAN_BALANCED_TREE, ks[i], 0);
        EXPECT_EQ(sat_gl_mean_texture(g), 0);
        for (s = 0; s < TEST_SIZES; s++) {
            int w = test_sizes[s][0], h = test_sizes[s][1];
            double want, scale;
            test_case_make(&t, w, h, (uint64_t)s);
            test_case_sum(&t, 1e6);
            want = (double)(t.sums[w * h - 1] / (w * h));
            scale = (double)(t.sizes[w * h - 1] / (w * h));
            texture = test_texture(SAT__GL_R32F, w, h, t.pixels);
            mean = -1;
            EXPECT_EQ(sat_gl_mean(g, &mean, texture, w, h), SAT_OK);
            EXPECT_NEAR(mean, want, 2e-7 * fabs(want) + 1e-13 * scale);
            EXPECT_EQ(sat_gl_mean(g, NULL, texture, w, h), SAT_OK);
            test_read(texel, sat_gl_mean_texture(g), SAT__GL_RG32F, 1, 1);
            EXPECT_NEAR(texel[0] + texel[1], mean, 0);
            test_delete(texture);
            test_case_free(&t);
        }
        sat_gl_destroy(g);
    }
    EXPECT_EQ(test_objects, 0);
    test_close();
}

/* ---- lookups ---- */

/* Box number (x, y) of a 32 x 32 grid: corners in units of 1/16 texel, some of them outside, some empty. */
static void test_box(int x, int y, int width, int height, int box[4])
{
    uint64_t seed = (uint64_t)(x + 32 * y);
    box[0] = support_below(&seed, 20 * width) - 2 * width;
    box[1] = support_below(&seed, 20 * height) - 2 * height;
    box[2] = box[0] + support_below(&seed, x & 1 ? 100 : 12 * width) - 8;
    box[3] = box[1] + support_below(&seed, x & 1 ? 100 : 12 * height) - 8;
}

/* The exact integral over the box, of values rounded to `quantum` (0: not rounded), and the integral of |value|. */
static long double test_integral(const test_case *t, const double box[4], double limit, double quantum,
                                 long double *size)
{
    long double sum = 0;
    int x, y;
    *size = 0;
    for (y = (int)fmax(box[1], 0); y < t->height && y < box[3]; y++)
        for (x = (int)fmax(box[0], 0); x < t->width && x < box[2]; x++) {
            double w = fmin(box[2], x + 1) - fmax(box[0], x), h = fmin(box[3], y + 1) - fmax(box[1], y);
            double v = test_clean(t->pixels[y * t->width + x], limit);
            if (w <= 0 || h <= 0) continue;
            if (quantum > 0) v = quantum * nearbyint(v / quantum);
            sum += (long double)v * w * h;
            *size += (long double)fabs(v) * w * h;
        }
    return sum;
}

static const char *const test_lookup_shader[] = {
    "#if FIXED\nuniform usampler2D sums;\nuniform float quantum;\n#define TABLE sums, quantum\n"
    "#else\nuniform sampler2D sums;\n#define TABLE sums\n#endif\n"
    "uniform isampler2D boxes;\n"
    "out vec4 result;\n"
    "void main() {\n"
    "    ivec4 box = texelFetch(boxes, ivec2(gl_FragCoord.xy), 0);\n"
    "    ivec2 low = box.xy >> 4, high = box.zw >> 4;\n"
    "    result.x = sat_sum(TABLE, low, high);\n"
    "    result.y = sat_mean(TABLE, low, high);\n"
    "    result.z = sat_sum_fractional(TABLE, vec2(box.xy) / 16.0, vec2(box.zw) / 16.0);\n"
    "    result.w = 1.0;\n"
    "}\n", NULL};

static void test_lookups_of(sat_gl_format format, const test_case *t)
{
    sat__gl *gl = &test_f.real;
    sat_gl *g = test_create(format, SAT_SCAN_BALANCED_TREE, 4, 0);
    const char *library[2];
    static int boxes[32 * 32][4];
    static float out[32 * 32][4];
    unsigned input = test_texture(SAT__GL_R32F, t->width, t->height, t->pixels), target = 0, program = 0, fetch = 0,
             framebuffer = 0;
    sat__gl_shaders shaders;
    sat__gl_state state;
    double epsilon = format == SAT_GL_FLOAT ? 0 : 3e-7, limit, quantum;
    int i;
    memset(&shaders, 0, sizeof shaders);
    library[0] = sat_gl_glsl();
    library[1] = NULL;
    shaders.name = "lookups";
    shaders.library = library;
    shaders.fragment = test_lookup_shader;
    EXPECT_EQ(sat_gl_build(g, 0, input, t->width, t->height), SAT_OK);
    limit = (double)g->limit;
    quantum = sat_gl_quantum(g);
    for (i = 0; i < 32 * 32; i++) test_box(i % 32, i / 32, t->width, t->height, boxes[i]);
    sat__gl_begin(gl, &state, 2);
    sat__gl_define(gl, "FIXED", format == SAT_GL_FIXED32);
    if (!EXPECT_EQ(sat__gl_build(gl, &program, &shaders), SAT_OK)) puts(gl->message);
    EXPECT_EQ(sat__gl_texture(gl, &target, SAT__GL_RGBA32F, 32, 32, NULL), SAT_OK);
    EXPECT_EQ(sat__gl_framebuffer(gl, &framebuffer, &target, 1, 0), SAT_OK);
    EXPECT_EQ(sat__gl_texture(gl, &fetch, SAT__GL_RGBA32I, 32, 32, boxes), SAT_OK);
    sat__gl_pass(gl, program, framebuffer, 32, 32);
    sat__gl_set_texture(gl, program, "boxes", 0, fetch);
    sat__gl_set_texture(gl, program, "sums", 1, sat_gl_table(g));
    sat__gl_set_float(gl, program, "quantum", (float)quantum);
    sat__gl_draw(gl);
    EXPECT_EQ(sat__gl_read(gl, out, target, SAT__GL_RGBA32F, 32, 32), SAT_OK);
    gl->DeleteProgram(program);
    gl->DeleteFramebuffers(1, &framebuffer);
    sat__gl_end(gl, &state);
    for (i = 0; i < 32 * 32; i++) {
        const int *b = boxes[i];
        double whole[4], real[4], area;
        long double size, sum, all = t->sizes[t->width * t->height - 1];
        int j;
        for (j = 0; j < 4; j++) {
            real[j] = b[j] / 16.0;
            whole[j] = floor(real[j]);
        }
        area = (fmin(whole[2], t->width) - fmax(whole[0], 0)) * (fmin(whole[3], t->height) - fmax(whole[1], 0));
        if (whole[2] <= fmax(whole[0], 0) || whole[3] <= fmax(whole[1], 0) || area <= 0) area = 1;
        sum = test_integral(t, whole, limit, quantum, &size);
        if (format == SAT_GL_FLOAT) size += 20 * all; /* errors are those of the whole table */
        EXPECT_NEAR(out[i][0], (double)sum, (epsilon + 2e-7) * (double)size + 1e-12 * (double)all);
        EXPECT_NEAR(out[i][1], (double)(sum / area), (epsilon + 3e-7) * (double)size / area + 1e-12 * (double)all);
        sum = test_integral(t, real, limit, quantum, &size);
        for (j = 0; j < 2; j++) { /* the cells that the border cuts are weighted with errors of their own size */
            whole[j] = floor(real[j]);
            whole[j + 2] = ceil(real[j + 2]);
        }
        test_integral(t, whole, limit, quantum, &size);
        if (format == SAT_GL_FLOAT) size += 20 * all;
        EXPECT_NEAR(out[i][2], (double)sum, (epsilon + 2e-6) * (double)size + 1e-12 * (double)all);
        EXPECT_NEAR(out[i][3], 1, 0);
    }
    test_delete(input);
    test_delete(target);
    test_delete(fetch);
    sat_gl_destroy(g);
}

TEST(lookups_in_a_shader)
{
    test_case t;
    int format, es;
    if (!test_open()) return;
    test_case_make(&t, 83, 61, 17);
    test_case_sum(&t, 1e6);
    for (es = 0; es < 2; es++)
        for (format = 0; format < 3; format++) {
            test_f.real.is_es = es; /* GLSL ES 3.00, on the same driver */
            test_lookups_of((sat_gl_format)format, &t);
            test_f.real.is_es = 0;
        }
    test_case_free(&t);
    test_close();
}

/* ---- tiles ---- */

/* The image of a case: 0 smooth decades, 1 spikes in every tile, 2 signed, 3 NaN, infinity and beyond 1e20,
   4 a constant, 5 eight bits, 6 ground under a sky at infinity, 7 under one at 1e10, 8 patches of 14 decades. */
static void test_tile_image(float *p, int width, int height, int channels, int which)
{
    uint64_t state = 77;
    int i, n = width * height * channels;
    for (i = 0; i < n; i++) {
        double u = support_uniform(&state), x = i / channels % width / 40.0, y = i / channels / width / 31.0;
        p[i] = which == 0   ? (float)pow(10, 4 * sin(x) * cos(y) + u)
               : which == 1 ? (float)(u < 0.0009 ? 1e5 * (1 + u) : u < 0.002 ? -3e3 : u)
               : which == 2 ? (float)support_gaussian(&state)
               : which == 4 ? 0.1f
               : which == 5 ? (float)(int)(256 * u)
               : which == 6 && y < 1 + 0.3 * sin(x) ? (float)HUGE_VAL
               : which == 7 && y < 1 + 0.3 * sin(x) ? 1e10f
               : which == 8 ? (float)pow(10, 7 * sin(5 * x) * cos(4 * y) + u)
                            : (float)(1 + u);
        if (which == 3 && i % 997 == 5) p[i] = sat__float_from_bits(0x7fc00000u);
        if (which == 3 && i % 1511 == 9) p[i] = i & 1 ? (float)HUGE_VAL : -(float)HUGE_VAL;
        if (which == 3 && i % 2003 == 11) p[i] = 1e25f;
    }
}

static unsigned test_tile_input(const float *p, int width, int height, int channels)
{
    float *four = (float *)calloc((size_t)(width * height), 4 * sizeof *four);
    unsigned texture;
    int i, c;
    for (i = 0; i < width * height && four; i++)
        for (c = 0; c < channels; c++) four[4 * i + c] = p[i * channels + c];
    texture = test_texture(SAT__GL_RGBA32F, width, height, four);
    free(four);
    return texture;
}

/* Cells, quanta and spikes of the two tables. */
static void test_tiles_equal(const sat_gl *g, const sat_table *t, int channels)
{
    const int width = t->width, height = t->height, n = channels == 1 ? 1 : channels == 2 ? 2 : 4;
    unsigned internal = n == 1 ? SAT__GL_R32UI : n == 2 ? SAT__GL_RG32UI : SAT__GL_RGBA32UI;
    uint32_t *cells = (uint32_t *)malloc((size_t)(width * height * n) * 4),
             *records[4];
    int x, y, c, i, wrong = 0, quanta = 0, spikes = 0;
    sat__gl *gl = &test_f.real;
    sat__gl_state state;
    test_read(cells, g->tiled.cells.texture, internal, width, height);
    sat__gl_begin(gl, &state, 1);
    gl->BindFramebuffer(SAT__GL_FRAMEBUFFER, g->tiled.tiles_framebuffer);
    for (i = 0; i < 4; i++) {
        records[i] = (uint32_t *)malloc((size_t)(t->tiles_x * channels * t->tiles_y) * 16);
        gl->ReadBuffer(SAT__GL_COLOR_ATTACHMENT0 + (unsigned)i);
        gl->ReadPixels(0, 0, t->tiles_x * channels, t->tiles_y, SAT__GL_RGBA_INTEGER, SAT__GL_UNSIGNED_INT,
                       records[i]);
    }
    sat__gl_end(gl, &state);
    for (c = 0; c < channels; c++) {
        for (y = 0; y < height; y++)
            for (x = 0; x < width; x++)
                wrong += sat__cells(t, c, y / 32, y % 32)[x] != cells[(y * width + x) * n + c];
        for (y = 0; y < t->tiles_y; y++)
            for (x = 0; x < t->tiles_x; x++) {
                size_t at = (size_t)(y * t->tiles_x * channels + c * t->tiles_x + x) * 4;
                size_t index = sat__tile_index(t, c, y, x);
                const sat__tile *tile = &t->tiles[index];
                int count = (int)(records[0][at + 2] & 15);
                quanta += sat__float_bits((float)tile->quantum) != records[0][at];
                spikes += tile->spikes != count;
                for (i = 0; i < count; i++) {
                    const sat__spike *s = &t->spikes[index * SAT__SPIKES + (size_t)i];
                    uint32_t place = records[1][at + (size_t)i / 2] >> (14 * (i & 1));
                    spikes += s->x != (place & 127) || s->y != (place >> 7 & 127) ||
                              sat__float_bits(s->value) != records[2 + i / 4][at + (size_t)(i & 3)];
                }
            }
    }
    EXPECT_EQ(wrong, 0);
    EXPECT_EQ(quanta, 0);
    EXPECT_EQ(spikes, 0);
    for (i = 0; i < 4; i++) free(records[i]);
    free(cells);
}

/* A part of the strips, from `at` on: doubles by their bits. */
static int test_strips_differ(const uint32_t *strips, int at, const double *values, int n)
{
    int i, wrong = 0;
    for (i = 0; i < n; i++) {
        uint64_t bits;
        memcpy(&bits, &values[i], sizeof bits);
        wrong += strips[2 * (at + i)] != (uint32_t)bits || strips[2 * (at + i) + 1] != (uint32_t)(bits >> 32);
    }
    return wrong;
}

/* Strips, slots, giants and 64-bit cells of the two tables; what kinds of them were met. */
static void test_strips_equal(const sat_gl *g, const sat_table *t, int n, int met[2])
{
    const int w = t->width, bands = t->tiles_y, room = t->giant_room, supers = sat__supers(t);
    const sat__gl_target *target = &g->tiled.strips;
    uint32_t *strips = (uint32_t *)malloc((size_t)(target->width * target->height) * 8);
    int above = t->tiles_x * n * t->height, whole = above + w * n * bands, slots = whole + t->tiles_x * n * bands;
    int giants = slots + t->tiles_x * n * bands, pool = giants + (1 + room) * n * bands + n * supers;
    int c, i, k, y, wrong[6] = {0, 0, 0, 0, 0, 0}, cells = (int)t->wide_stride << t->shift;
    test_read(strips, target->texture, SAT__GL_RG32UI, target->width, target->height);
    for (c = 0; c < n; c++) {
        for (y = 0; y < t->height; y++)
            wrong[0] += test_strips_differ(strips, (y * n + c) * t->tiles_x,
                                           sat__left(t, c, y >> t->shift, y & (t->options.tile - 1)), t->tiles_x);
        for (y = 0; y < bands; y++) {
            size_t at = (size_t)(c * bands + y), index = sat__tile_index(t, c, y, 0);
            const uint32_t *list = strips + 2 * (giants + (y * n + c) * (1 + room));
            wrong[1] += test_strips_differ(strips, above + (y * n + c) * w, sat__above(t, c, y), w);
            wrong[2] += test_strips_differ(strips, whole + (y * n + c) * t->tiles_x, t->whole + index, t->tiles_x);
            for (i = 0; i < t->tiles_x; i++) {
                int slot = t->tiles[index + (size_t)i].slot;
                wrong[3] += (int)strips[2 * (slots + (y * n + c) * t->tiles_x + i)] != slot;
                if (!slot) continue;
                met[0]++;
                for (k = 0; k < cells; k++) {
                    uint64_t v = sat__wide_cells(t, slot)[k];
                    const uint32_t *drawn = strips + 2 * (pool + (slot - 1) * cells + k);
                    if (y * 32 + k / (int)t->wide_stride >= t->height) continue;
                    wrong[4] += drawn[0] != (uint32_t)v || drawn[1] != (uint32_t)(v >> 32);
                }
            }
            wrong[5] += (int)list[0] != t->tallies[at].giants;
            met[1] += t->tallies[at].giants;
            for (i = 0; i < t->tallies[at].giants; i++) {
                const sat__giant *giant = &t->giants[at * (size_t)room + (size_t)i];
                wrong[5] += list[2 * i + 2] != (uint32_t)giant->x + ((uint32_t)giant->y << 26) ||
                            list[2 * i + 3] != sat__float_bits(giant->value);
            }
        }
    }
    for (i = 0; i < 6; i++)
        if (!EXPECT_EQ(wrong[i], 0)) printf("%s\n", &"left\0 above\0whole\0slots\0wide\0 giants"[6 * i]);
    free(strips);
}

/* Means by the filter pass against the CPU's: large boxes come from strips, read as two floats. */
static void test_tile_filter(sat_gl *g, const sat_table *t, int channels, int radius)
{
    size_t n = (size_t)t->width * (size_t)t->height, i;
    float *means = (float *)malloc(n * (size_t)channels * 4), *drawn = (float *)malloc(n * 16);
    unsigned target = test_texture(SAT__GL_RGBA32F, t->width, t->height, NULL);
    double worst = 0, lost = t->total[0].sum_abs * ldexp(1, radius > 1 ? -46 : -53) / ((radius + 1) * (radius + 1));
    int c;
    EXPECT_EQ(sat_box_filter(means, 0, t, radius), SAT_OK);
    EXPECT_EQ(sat_gl_box_filter(g, target, radius), SAT_OK);
    test_read(drawn, target, SAT__GL_RGBA32F, t->width, t->height);
    for (i = 0; i < n; i++)
        for (c = 0; c < channels; c++) {
            double a = (double)drawn[4 * i + (size_t)c], b = (double)means[i * (size_t)channels + (size_t)c];
            double e = (fabs(a - b) - lost) / (fabs(b) + 1e-2);
            if (!(e <= worst)) worst = e;
        }
    if (!EXPECT(worst <= 4e-7)) printf("%d x %d, radius %d: %g\n", t->width, t->height, radius, worst);
    test_delete(target);
    free(means);
    free(drawn);
}

/* One build of both: all of the table, and means by the filter. */
static void test_tile_case(sat_gl *g, int w, int h, int c, int which, int met[2])
{
    float *p = (float *)malloc((size_t)(w * h * c) * 4);
    sat_image view = sat_image_f32(p, w, h, c);
    sat_options same = sat_defaults();
    sat_table *t = NULL;
    unsigned input;
    sat_stats stats, expected;
    test_tile_image(p, w, h, c, which);
    input = test_tile_input(p, w, h, c);
    same.max_value = g->options.max_value;
    EXPECT_EQ(sat_create(&t, w, h, c, &same), SAT_OK);
    EXPECT_EQ(sat_build(t, &view), SAT_OK);
    if (!EXPECT_EQ(sat_gl_build(g, 0, input, w, h), SAT_OK)) puts(sat_gl_message(g));
    EXPECT_EQ(sat_gl_get_stats(g, &stats), SAT_OK);
    expected = sat_get_stats(t);
    EXPECT_EQ(stats.nan, expected.nan);
    EXPECT_EQ(stats.infinite, expected.infinite);
    EXPECT_EQ(stats.clamped, expected.clamped);
    test_tiles_equal(g, t, c);
    test_strips_equal(g, t, c, met);
    if (w * h > 9000 && w < 1000 && h < 1000 && !g->compute && /* whose filter is the same program */
        (c == 1 || which == 3 || which > 5)) {
        test_tile_filter(g, t, c, 1);
        if (w == 140 || which > 5) test_tile_filter(g, t, c, 40);
        if (w == 140) test_tile_filter(g, t, c, 100);
    }
    test_delete(input);
    sat_destroy(t);
    free(p);
}

/* A bad pixel changes no box without it; boxes of more than three tiles; two super tiles. */
static void test_bad_pixels(sat_gl *g)
{
    enum { W = 1100, H = 110 };
    float *p = (float *)malloc(sizeof(float) * W * H), *drawn = (float *)malloc(sizeof(float) * W * H * 4);
    unsigned input, target;
    sat_gl_tiles tiles = {0, 0, 0};
    double worst = 0;
    int x, y, i;
    EXPECT_EQ(sat_gl_get_tiles(&tiles, NULL), SAT_ERR_ARGUMENT);
    for (i = 0; i < W * H; i++) p[i] = 1;
    p[70 * W + 500] = (float)HUGE_VAL;
    p[20 * W + 1050] = sat__float_from_bits(0x7fc00000u);
    p[90 * W + 90] = 1e30f;
    p[60 * W + 700] = 1e8f;
    input = test_texture(SAT__GL_R32F, W, H, p);
    target = test_texture(SAT__GL_RGBA32F, W, H, NULL);
    EXPECT_EQ(sat_gl_build(g, 0, input, W, H), SAT_OK);
    EXPECT_EQ(sat_gl_get_tiles(&tiles, g), SAT_OK);
    EXPECT(tiles.cells && tiles.tiles && tiles.strips);
    for (i = g->compute ? 50 : 4; i < 90; i += 46) { /* compute: the filter is the same program */
        EXPECT_EQ(sat_gl_box_filter(g, target, i), SAT_OK);
        test_read(drawn, target, SAT__GL_RGBA32F, W, H);
        worst = 0;
        for (y = 0; y < H; y++)
            for (x = 0; x < W; x++) {
                double e = fabs((double)drawn[4 * (y * W + x)] - 1);
                if (abs(x - 700) <= i && abs(y - 60) <= i) continue;
                if (abs(x - 1050) <= i && abs(y - 20) <= i) continue;
                if (abs(x - 500) <= i && abs(y - 70) <= i) continue;
                if (abs(x - 90) <= i && abs(y - 90) <= i) continue;
                if (!(e <= worst)) worst = e;
            }
        EXPECT(worst < 2e-6);
    }
    test_delete(input);
    test_delete(target);
    free(p);
    free(drawn);
}

static const char *const test_tile_shader[] = {
    "uniform usampler2D cells, strips;\n"
    "uniform usampler2DArray tiles;\n"
    "layout(location = 0) out vec4 result;\n"
    "void main() {\n"
    "    ivec2 p = ivec2(gl_FragCoord.xy), low = p * 3 - 5, high = low + p + 1;\n"
    "    result = vec4(sat_sum(cells, tiles, strips, 1, low, high), sat_mean(cells, tiles, strips, 0, low, high), 0, 1);\n"
    "}\n", NULL};

/* A shader of the caller. */
static void test_lookups_in_tiles(sat_gl *g)
{
    enum { W = 200, H = 180, N = 60 };
    static float out[N * N][4];
    float *p = (float *)malloc(sizeof(float) * W * H * 2);
    sat_image view = sat_image_f32(p, W, H, 2);
    const char *library[4];
    sat__gl *gl = &test_f.real;
    sat__gl_shaders shaders;
    sat__gl_state state;
    sat_gl_tiles tiles = {0, 0, 0};
    sat_table *t = NULL;
    unsigned input, target = 0, framebuffer = 0, program = 0;
    int x, y;
    test_tile_image(p, W, H, 2, 5);
    EXPECT_EQ(sat_create(&t, W, H, 2, NULL), SAT_OK);
    EXPECT_EQ(sat_build(t, &view), SAT_OK);
    input = test_tile_input(p, W, H, 2);
    EXPECT_EQ(sat_gl_build(g, 0, input, W, H), SAT_OK);
    EXPECT_EQ(sat_gl_get_tiles(&tiles, g), SAT_OK);
    memset(&shaders, 0, sizeof shaders);
    library[0] = sat_gl_glsl();
    library[1] = sat_gl_glsl_tiles(0);
    library[2] = sat_gl_glsl_tiles(1);
    library[3] = NULL;
    shaders.name = "lookups in tiles";
    shaders.library = library;
    shaders.fragment = test_tile_shader;
    sat__gl_begin(gl, &state, 3);
    if (!EXPECT_EQ(sat__gl_build(gl, &program, &shaders), SAT_OK)) puts(gl->message);
    EXPECT_EQ(sat__gl_texture(gl, &target, SAT__GL_RGBA32F, N, N, NULL), SAT_OK);
    EXPECT_EQ(sat__gl_framebuffer(gl, &framebuffer, &target, 1, 0), SAT_OK);
    sat__gl_pass(gl, program, framebuffer, N, N);
    sat__gl_set_texture(gl, program, "cells", 0, tiles.cells);
    sat__gl_set_texture(gl, program, "strips", 1, tiles.strips);
    sat__gl_set_int(gl, program, "tiles", 2);
    gl->ActiveTexture(SAT__GL_TEXTURE0 + 2);
    gl->BindTexture(SAT__GL_TEXTURE_2D_ARRAY, tiles.tiles);
    gl->BindSampler(2, 0);
    sat__gl_draw(gl);
    EXPECT_EQ(sat__gl_read(gl, out, target, SAT__GL_RGBA32F, N, N), SAT_OK);
    gl->DeleteProgram(program);
    gl->DeleteFramebuffers(1, &framebuffer);
    sat__gl_end(gl, &state);
    for (y = 0; y < N; y++)
        for (x = 0; x < N; x++) {
            int x0 = 3 * x - 5, y0 = 3 * y - 5;
            double sum = sat_sum(t, 1, x0, y0, x0 + x + 1, y0 + y + 1);
            EXPECT_NEAR(out[y * N + x][0], sum, 3e-7 * sum);
            sum = sat_mean(t, 0, x0, y0, x0 + x + 1, y0 + y + 1);
            EXPECT_NEAR(out[y * N + x][1], sum, 4e-7 * sum);
        }
    test_delete(target);
    test_delete(input);
    sat_destroy(t);
    free(p);
}

/* The objects live as long as their channels: what takes time is llvmpipe's compiler. */
static void test_tiles_of(int compute, int es_too)
{
    static const int sizes[][3] = {{1, 1, 1},     {130, 1, 1},   {1, 130, 1}, {64, 64, 1},
                                   {140, 110, 1}, {101, 91, 3}, {70, 131, 4}};
    static const int large[][2] = {{1060, 40}, {40, 1057}, {4097, 3}, {1, 9000}}; /* two super tiles, long strips */
    int size, which, met[2] = {0, 0};
    sat_gl *g = NULL;
    for (size = 0; size < 7; size++) { /* by passes 1, 3 and 2 channels; the variance has 4 planes, by compute 2 */
        int w = sizes[size][0], h = sizes[size][1], c = size == 6 && !compute ? 2 : sizes[size][2], made = 0;
        sat_gl_options options = sat_gl_defaults();
        options.channels = c;
        options.compute = compute;
        if (compute && c == 3) continue;
        test_as_es = es_too && c == 3;
        if (!g) {
            sat_gl_tiles none;
            if (!EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_OK)) puts(sat_gl_message(g));
            EXPECT_EQ(sat_gl_get_tiles(&none, g), SAT_ERR_ARGUMENT);
        }
        EXPECT_EQ(g->compute, compute);
        for (which = 0; which < 9; which++) {
            test_tile_case(g, w, h, c, which, met);
            EXPECT(!which || test_generated == made);
            made = test_generated;
        }
        EXPECT_EQ(sat_gl_variance(g, 1, 3), SAT_ERR_ARGUMENT);
        EXPECT_EQ(sat_gl_box_filter(g, 0, 3), SAT_ERR_ARGUMENT);
        EXPECT_EQ(sat_gl_box_filter(g, 1, -1), SAT_ERR_ARGUMENT);
        EXPECT_EQ(sat_gl_build(g, 1, 2, w, h), SAT_ERR_ARGUMENT);
        EXPECT_EQ(sat_gl_scan(g, 0, 2, w, h), SAT_ERR_ARGUMENT);
        for (which = 0; c == 1 && size > 3 && which < 8; which++)
            test_tile_case(g, large[which / 2][0], large[which / 2][1], 1, which & 1 ? 7 : 3, met);
        if (c == 1 && size > 3) test_bad_pixels(g);
        if (c == 3) test_lookups_in_tiles(g);
        if (size > 3) {
            sat_gl_destroy(g);
            g = NULL;
        }
        test_as_es = 0;
    }
    EXPECT(met[0] > 20 && met[1] > 200);
}

TEST(tiles_equal_the_cpu_table_bit_for_bit)
{
    if (!test_open()) return;
    test_tiles_of(0, 1);
    test_close();
}

TEST(tiles_by_compute_equal_the_cpu_table_bit_for_bit)
{
    if (!test_open()) return;
    if (!test_f.real.has_compute) expect_skip("needs OpenGL 4.3");
    else test_tiles_of(1, 0);
    test_close();
}

static void test_variance(int compute, int channels)
{
    enum { W = 150, H = 100 };
    float *p = (float *)malloc(sizeof(float) * W * H * 2), *drawn = (float *)malloc(sizeof(float) * W * H * 4);
    sat_image view = sat_image_f32(p, W, H, 2);
    sat_gl_options options = sat_gl_defaults();
    sat_gl *g = NULL;
    sat_moments *m = NULL;
    unsigned input, target;
    uint64_t state = 3;
    int x, y, i, r;
    for (i = 0; i < W * H; i++) {
        p[2 * i] = (float)(1e4 + support_gaussian(&state));
        p[2 * i + 1] = (float)(i % W / 64 + 3 * support_uniform(&state));
    }
    p[40 * W] = sat__float_from_bits(0x7fc00000u);
    options.channels = channels;
    options.moments = 1;
    options.compute = compute;
    if (!EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_OK)) puts(sat_gl_message(g));
    EXPECT_EQ(sat_moments_create(&m, W, H, 2, NULL), SAT_OK);
    EXPECT_EQ(sat_moments_build(m, &view), SAT_OK);
    input = test_tile_input(p, W, H, 2);
    target = test_texture(SAT__GL_RGBA32F, W, H, NULL);
    EXPECT_EQ(sat_gl_build(g, 0, input, W, H), SAT_OK);
    EXPECT_EQ(sat_gl_box_filter(g, target, 2), SAT_ERR_ARGUMENT);
    for (r = 2; r < 60; r += 27) {
        double worst = 0, means = 0;
        EXPECT_EQ(sat_gl_variance(g, target, r), SAT_OK);
        test_read(drawn, target, SAT__GL_RGBA32F, W, H);
        for (y = 0; y < H; y++)
            for (x = 0; x < W; x++)
                for (i = 0; i < channels; i++) {
                    double v = sat_variance(m, i, x - r, y - r, x + r + 1, y + r + 1),
                           mean = sat_moments_mean(m, i, x - r, y - r, x + r + 1, y + r + 1),
                           e = fabs((double)drawn[4 * (y * W + x) + 2 * i + 1] / v - 1),
                           d = fabs((double)drawn[4 * (y * W + x) + 2 * i] / mean - 1);
                    if (!(e <= worst)) worst = e;
                    if (!(d <= means)) means = d;
                }
        REPORT("variance of N(1e4, 1), relative to the CPU's", worst, "");
        EXPECT(worst < 1e-3);
        EXPECT(means < 1e-5);
    }
    test_delete(input);
    test_delete(target);
    sat_moments_destroy(m);
    sat_gl_destroy(g);
    free(p);
    free(drawn);
}

TEST(variance_of_tiles)
{
    if (!test_open()) return;
    test_variance(0, 2);
    if (test_f.real.has_compute) test_variance(1, 1);
    test_close();
}

/* ---- state ---- */

typedef struct test_state {
    int values[256];
    int count;
} test_state;

static void test_get(test_state *s, unsigned name, int values)
{
    int v[4] = {0, 0, 0, 0}, i;
    test_f.real.GetIntegerv(name, v);
    for (i = 0; i < values; i++) s->values[s->count++] = v[i];
}

/* More than sat__gl_begin promises: everything of OpenGL 3.3 that a pass could have changed. */
static void test_snapshot(test_state *s)
{
    static const unsigned one[] = {0x0B44, 0x0B45, 0x0B46, 0x0B71, 0x0B72, 0x0B74, 0x0B73, 0x0B90, 0x0B98, 0x0BD0,
                                   0x0BE2, 0x0BF2, 0x0BF0, 0x0C11, 0x809E, 0x80A0, 0x8DB9, 0x8C89, 0x8642, 0x8009,
                                   0x883D, 0x80C8, 0x80C9, 0x80CA, 0x80CB, 0x0CF0, 0x0CF1, 0x0CF2, 0x0CF3, 0x0CF4,
                                   0x0CF5, 0x806D, 0x806E, 0x0D00, 0x0D01, 0x0D02, 0x0D03, 0x0D04, 0x0D05, 0x84E0,
                                   0x8B8D, 0x85B5, 0x8894, 0x88ED, 0x88EF, 0x8C8F, 0x8A28, 0x8CA6, 0x8CAA, 0x0B20,
                                   0x0B11, 0x2A01, 0x2A02, 0x8037, 0x8F9D, 0x8F9E, 0x8CA7, 0x90D3, 0x90EF, 0x8C2A};
    sat__gl *gl = &test_f.real;
    int i, active = 0;
    s->count = 0;
    for (i = 0; i < (int)(sizeof one / sizeof *one); i++) test_get(s, one[i], 1);
    test_get(s, 0x0B40, 1); /* polygon mode; the second value is of older versions */
    test_get(s, 0x0BA2, 4); /* viewport, scissor box, clear colour, colour mask */
    test_get(s, 0x0C10, 4);
    test_get(s, 0x0C22, 4);
    test_get(s, 0x0C23, 4);
    gl->GetIntegerv(SAT__GL_ACTIVE_TEXTURE, &active);
    for (i = 0; i < 6; i++) {
        gl->ActiveTexture(SAT__GL_TEXTURE0 + (unsigned)i);
        test_get(s, SAT__GL_TEXTURE_BINDING_2D, 1);
        test_get(s, SAT__GL_TEXTURE_BINDING_2D_ARRAY, 1);
        test_get(s, SAT__GL_SAMPLER_BINDING, 1);
    }
    gl->ActiveTexture((unsigned)active);
    gl->GetIntegeri_v(SAT__GL_TRANSFORM_FEEDBACK_BUFFER_BINDING, 0, &s->values[s->count++]);
    for (i = 0; gl->has_compute && i < SAT__GL_IMAGES; i++) {
        int j;
        for (j = 0; j < 6; j++) gl->GetIntegeri_v(sat__gl_image_names()[j], (unsigned)i, &s->values[s->count++]);
    }
    sat__gl_clear_errors(gl); /* for names that this version does not know */
}

typedef void(SAT__GL_CALL *test_gen_samplers)(int count, unsigned *samplers);

/* Everything away from its default. */
static void test_disturb(unsigned texture, unsigned framebuffer, unsigned program)
{
    sat__gl *gl = &test_f.real;
    const unsigned *names;
    unsigned arrays[2], buffers[4], samplers[2];
    test_gen_samplers generate = (test_gen_samplers)test_gl.get_proc("glGenSamplers");
    int i, count;
    gl->GenVertexArrays(2, arrays);
    gl->BindVertexArray(arrays[1]);
    gl->GenBuffers(4, buffers);
    for (i = 0; i < 4; i++) {
        gl->BindBuffer(SAT__GL_ARRAY_BUFFER, buffers[i]);
        gl->BufferData(SAT__GL_ARRAY_BUFFER, 4096, NULL, 0x88E4);
    }
    gl->BindBuffer(SAT__GL_PIXEL_PACK_BUFFER, buffers[1]);
    gl->BindBuffer(SAT__GL_PIXEL_UNPACK_BUFFER, buffers[2]);
    gl->BindBufferRange(SAT__GL_TRANSFORM_FEEDBACK_BUFFER, 0, buffers[3], 64, 128);
    gl->BindBuffer(SAT__GL_TRANSFORM_FEEDBACK_BUFFER, buffers[0]);
    generate(2, samplers);
    for (i = 0; i < 6; i++) {
        gl->ActiveTexture(SAT__GL_TEXTURE0 + (unsigned)i);
        gl->BindTexture(SAT__GL_TEXTURE_2D, texture);
        gl->BindSampler((unsigned)i, samplers[i & 1]);
    }
    gl->ActiveTexture(SAT__GL_TEXTURE0 + 3);
    names = sat__gl_capability_names(gl, &count);
    for (i = 0; i < count; i++) gl->Enable(names[i]);
    for (i = 0; i < 2; i++) gl->PixelStorei(i ? SAT__GL_PACK_ALIGNMENT : SAT__GL_UNPACK_ALIGNMENT, i ? 8 : 2);
    names = sat__gl_store_names(gl, &count);
    for (i = 2; i < count; i++) gl->PixelStorei(names[i], i >= 10 ? 1 : 2 + i);
    gl->PolygonMode(SAT__GL_FRONT_AND_BACK, 0x1B01);
    gl->ColorMask(0, 1, 0, 1);
    gl->DepthMask(0);
    gl->DepthFunc(0x0207);
    gl->BlendFuncSeparate(0x0300, 0x0301, 0x0306, 0x0307);
    gl->BlendEquationSeparate(0x800A, 0x800B);
    gl->Viewport(3, 4, 5, 6);
    gl->UseProgram(program);
    gl->BindFramebuffer(SAT__GL_DRAW_FRAMEBUFFER, framebuffer);
    if (gl->has_compute) {
        for (i = 0; i < SAT__GL_IMAGES; i++)
            gl->BindImageTexture((unsigned)i, texture, 0, 0, 0, 0x88BA, SAT__GL_R32F);
        gl->BindBuffer(0x90D2, buffers[1]); /* shader storage */
        gl->BindBuffer(0x90EE, buffers[2]); /* sizes of dispatches */
    }
    sat__gl_clear_errors(gl);
}

/* Everything that sat__gl_end promises to put back, changed once more. */
static void test_change(unsigned texture)
{
    sat__gl *gl = &test_f.real;
    const unsigned *names;
    int i, count;
    gl->UseProgram(0);
    gl->BindVertexArray(0);
    gl->BindFramebuffer(SAT__GL_FRAMEBUFFER, 0);
    gl->Viewport(0, 0, 1, 1);
    for (i = 0; i < 6; i++) {
        gl->ActiveTexture(SAT__GL_TEXTURE0 + (unsigned)i);
        gl->BindTexture(SAT__GL_TEXTURE_2D, 0);
        gl->BindSampler((unsigned)i, 0);
    }
    names = sat__gl_capability_names(gl, &count);
    for (i = 0; i < count; i++) (gl->IsEnabled(names[i]) ? gl->Disable : gl->Enable)(names[i]);
    names = sat__gl_store_names(gl, &count);
    for (i = 0; i < count; i++) gl->PixelStorei(names[i], i < 2 ? 4 : 0);
    for (i = 0; i < 4; i++) gl->BindBuffer(sat__gl_buffer_names()[2 * i], 0);
    gl->BindBufferBase(SAT__GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
    gl->PolygonMode(SAT__GL_FRONT_AND_BACK, SAT__GL_FILL);
    gl->ColorMask(1, 0, 1, 0);
    gl->DepthMask(1);
    gl->DepthFunc(0x0201);
    gl->BlendFuncSeparate(SAT__GL_ONE, SAT__GL_ZERO, SAT__GL_ONE, SAT__GL_ZERO);
    gl->BlendEquationSeparate(0x8006, 0x8006);
    if (gl->has_compute) gl->BindImageTexture(0, texture, 0, 0, 0, SAT__GL_WRITE_ONLY, SAT__GL_R32F);
}

static unsigned test_plain_program(void)
{
    static const char *const fragment[] = {"out vec4 colour;\nvoid main() { colour = vec4(1.0); }\n", NULL};
    sat__gl_shaders shaders;
    unsigned program = 0;
    memset(&shaders, 0, sizeof shaders);
    shaders.name = "plain";
    shaders.fragment = fragment;
    EXPECT_EQ(sat__gl_build(&test_f.real, &program, &shaders), SAT_OK);
    return program;
}

/* Tiles, by passes and by compute shaders. */
static sat_gl *test_wild_tiles(const test_case *t, unsigned texture, int compute)
{
    sat_image view = sat_image_f32(t->pixels, t->width, t->height, 1);
    sat_gl_options options = sat_gl_defaults();
    unsigned target = 0;
    sat__gl_state state;
    sat_table *table = NULL;
    sat_gl *g = NULL;
    options.compute = compute;
    EXPECT_EQ(sat_create(&table, t->width, t->height, 1, NULL), SAT_OK);
    EXPECT_EQ(sat_build(table, &view), SAT_OK);
    sat__gl_begin(&test_f.real, &state, 1);
    EXPECT_EQ(sat__gl_texture(&test_f.real, &target, SAT__GL_RGBA32F, t->width, t->height, NULL), SAT_OK);
    sat__gl_end(&test_f.real, &state);
    EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_OK);
    EXPECT_EQ(sat_gl_build(g, 0, texture, t->width, t->height), SAT_OK);
    EXPECT_EQ(sat_gl_box_filter(g, target, 3), SAT_OK);
    test_tiles_equal(g, table, 1);
    test_delete(target);
    sat_destroy(table);
    return g;
}

TEST(state_is_restored)
{
    sat__gl *gl = &test_f.real;
    test_case t;
    test_state before, after;
    unsigned texture, target, framebuffer = 0, program;
    float mean = 0;
    int kind, i;
    sat_gl *g;
    if (!test_open()) return;
    test_case_make(&t, 97, 101, 2);
    texture = test_texture(SAT__GL_R32F, 97, 101, t.pixels);
    target = test_texture(SAT__GL_R32F, 97, 101, NULL);
    program = test_plain_program();
    EXPECT_EQ(sat__gl_framebuffer(gl, &framebuffer, &target, 1, 0), SAT_OK);
    gl->BindFramebuffer(SAT__GL_FRAMEBUFFER, 0);
    for (kind = 0; kind < 5; kind++) {
        float table[2 * 97 * 101];
        if (kind == 4 && !gl->has_compute) continue;
        sat__gl_state state;
        test_snapshot(&before);
        test_disturb(texture, framebuffer, program);
        test_snapshot(&after);
        for (i = 0; i < before.count && after.values[i] == before.values[i]; i++) {}
        EXPECT(kind > 0 || i < before.count); /* the disturbance shows */
        before = after;
        if (kind > 2) g = test_wild_tiles(&t, texture, kind == 4);
        else
            g = test_create(SAT_GL_TWO_FLOAT, kind == 1 ? SAT_SCAN_RECURSIVE_DOUBLING : SAT_SCAN_BALANCED_TREE, 4,
                            kind == 2 && gl->has_compute);
        if (kind < 3) EXPECT_EQ(sat_gl_build(g, 0, texture, 97, 101), SAT_OK);
        EXPECT_EQ(sat_gl_mean(g, &mean, texture, 97, 101), SAT_OK);
        test_snapshot(&after);
        for (i = 0; i < before.count; i++)
            if (!EXPECT_EQ(after.values[i], before.values[i])) printf("value %d\n", i);
        sat__gl_begin(gl, &state, 6);
        test_change(target);
        sat__gl_end(gl, &state);
        test_snapshot(&after);
        for (i = 0; i < before.count; i++)
            if (!EXPECT_EQ(after.values[i], before.values[i])) printf("value %d\n", i);
        /* and the result is right in spite of the wild state */
        test_case_sum(&t, kind > 2 ? sat__gl_largest(g) : 1e6);
        if (kind < 3) {
            sat__gl_begin(gl, &state, 1);
            EXPECT_EQ(sat__gl_read(gl, table, sat_gl_table(g), SAT__GL_RG32F, 97, 101), SAT_OK);
            sat__gl_end(gl, &state);
            EXPECT_NEAR(test_float_error(&t, table, 2), 0, 1e-12);
        }
        EXPECT_REL(mean, (double)(t.sums[97 * 101 - 1] / (97 * 101)), 1e-6);
        sat_gl_destroy(g);
    }
    test_case_free(&t);
    test_close();
}

/* ---- objects, memory, errors ---- */

TEST(repeated_builds_make_nothing)
{
    support_memory memory;
    sat_gl_options options = test_flat();
    sat_gl *g = NULL;
    unsigned texture;
    int i, made;
    if (!test_open()) return;
    options.allocator = support_allocator(&memory);
    texture = test_texture(SAT__GL_R32F, 40, 30, NULL);
    EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_OK);
    EXPECT_EQ(memory.calls, 1);
    EXPECT_EQ(sat_gl_table(g), 0);
    EXPECT_EQ(sat_gl_build(g, 0, texture, 40, 30), SAT_OK);
    EXPECT_EQ(sat_gl_mean(g, NULL, texture, 40, 30), SAT_OK);
    EXPECT(sat_gl_table(g) != 0);
    made = test_generated;
    for (i = 0; i < 5; i++) {
        EXPECT_EQ(sat_gl_build(g, 0, texture, 40, 30), SAT_OK);
        EXPECT_EQ(sat_gl_scan(g, 0, texture, 40, 30), SAT_OK);
        EXPECT_EQ(sat_gl_mean(g, NULL, texture, 40, 30), SAT_OK);
    }
    EXPECT_EQ(test_generated, made);
    EXPECT_EQ(memory.calls, 1);
    sat_gl_destroy(g);
    sat_gl_destroy(NULL);
    EXPECT_EQ(test_objects, 0);
    EXPECT(support_memory_clean(&memory));
    test_delete(texture);
    test_close();
}

static int test_gl_refused(const sat_gl_options *options)
{
    sat_gl *g = NULL;
    sat_result r = sat_gl_create(&g, test_get_proc, options);
    sat_gl_destroy(g);
    return r == SAT_ERR_ARGUMENT;
}

TEST(every_refusal_names_its_field)
{
    char text[200];
    size_t i, j;
    if (!test_open()) return;
    for (i = 0; i < SAT__COUNT(sat__gl_fields); i++) {
        const sat__field *f = &sat__gl_fields[i];
        double bad[3];
        if (f->type == 'a') continue;
        bad[0] = f->type == 'i' ? f->low - 1 : f->low - 1 - fabs(f->low);
        bad[1] = f->type == 'i' ? f->high + 1 : f->high * 2;
        bad[2] = f->type == 'i' ? f->high + 100 : (double)sat__float_from_bits(0x7fc00000u);
        for (j = 0; j < 3; j++) {
            sat_gl_options options = sat_gl_defaults();
            sat__field_set(f, &options, bad[j]);
            EXPECT(test_gl_refused(&options));
            if (!EXPECT(strncmp(sat_explain_gl(text, sizeof text, &options), f->name, strlen(f->name)) == 0))
                printf("%s: \"%s\"\n", f->name, text);
        }
    }
    EXPECT(strcmp(sat_explain_gl(text, sizeof text, NULL), "") == 0);
    EXPECT(sat_explain_gl(NULL, 0, NULL) == NULL);
    test_close();
}

TEST(bad_arguments)
{
    sat_gl_options options;
    sat_gl *g = NULL;
    int i;
    if (!test_open()) return;
    EXPECT_EQ(sat_gl_create(NULL, test_get_proc, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_gl_create(&g, NULL, NULL), SAT_ERR_ARGUMENT);
    for (i = 0; i < 17; i++) {
        options = sat_gl_defaults();
        if (i == 0) options.k = 1;
        if (i == 1) options.k = 65;
        if (i == 2) options.format = (sat_gl_format)(i + 2);
        if (i == 3) options.algorithm = SAT_SCAN_SEQUENTIAL;
        if (i == 4) options.channel = 4;
        if (i == 5) options.channel = -1;
        if (i == 6) options.unsigned_input = 1;
        if (i == 7) options.quantum = 0.3;
        if (i == 8) options.quantum = -1;
        if (i == 9) options.quantum = ldexp(1.0, -130);
        if (i == 10) options.max_value = 0;
        if (i == 11) options.max_value = -1;
        if (i == 12) options.max_value = HUGE_VAL;
        if (i == 13) options.max_value = (double)sat__float_from_bits(0x7fc00000u);
        if (i == 14) options.max_box_area = -1;
        if (i == 15) options.max_box_area = HUGE_VAL;
        if (i == 16) options.allocator.alloc = sat__stdlib_alloc;
        g = (sat_gl *)&options;
        EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_ERR_ARGUMENT);
        EXPECT(g == NULL);
    }
    EXPECT_EQ(sat_gl_message(NULL)[0], 0);
    EXPECT_EQ(sat_gl_create(&g, test_get_proc, NULL), SAT_OK);
    EXPECT_EQ(sat_gl_message(g)[0], 0);
    EXPECT_EQ(sat_gl_build(NULL, 0, 1, 4, 4), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_gl_build(g, 0, 0, 4, 4), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_gl_build(g, 0, 1, 0, 4), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_gl_scan(g, 0, 1, 4, -1), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_gl_mean(g, NULL, 1, -4, 4), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_gl_build(g, 0, 1, g->gl.max_size + 1, 4), SAT_ERR_SIZE);
    EXPECT(sat_gl_message(g)[0] != 0);
    EXPECT_EQ(sat_gl_table(g), 0);
    sat_gl_destroy(g);
    EXPECT_EQ(test_objects, 0);
    test_close();
}

TEST(no_memory)
{
    support_memory memory;
    sat_gl_options options = test_flat();
    sat_gl *g = (sat_gl *)&memory;
    if (!test_open()) return;
    options.allocator = support_allocator(&memory);
    memory.fail_at = 1;
    EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_ERR_MEMORY);
    EXPECT(g == NULL);
    EXPECT(support_memory_clean(&memory));
    test_close();
}

/* Each required function in turn. */
TEST(missing_function_is_named)
{
#define TEST_NAME(result, name, arguments) "gl" #name,
    static const char *const names[] = {SAT__GL_FUNCTIONS(TEST_NAME) NULL};
    sat_gl *g;
    int i;
    if (!test_open()) return;
    for (i = 0; names[i]; i++) {
        test_hidden = names[i];
        EXPECT_EQ(sat_gl_create(&g, test_get_proc, NULL), SAT_ERR_GL_FUNCTION);
        EXPECT(strstr(sat_gl_message(g), names[i]) != NULL);
        EXPECT_EQ(sat_gl_build(g, 0, 1, 4, 4), SAT_ERR_ARGUMENT);
        EXPECT_EQ(sat_gl_mean(g, NULL, 1, 4, 4), SAT_ERR_ARGUMENT);
        sat_gl_destroy(g);
    }
    EXPECT_EQ(test_objects, 0);
    test_close();
}

TEST(missing_compute_falls_back)
{
    sat_gl_options options = test_flat();
    sat_gl *g;
    if (!test_open()) return;
    options.compute = 1;
    test_hidden = "glDispatchCompute";
    EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_OK);
    EXPECT_EQ(g->compute, 0);
    sat_gl_destroy(g);
    test_close();
}

/* Each of the shaders in turn. */
TEST(broken_shader_is_explained)
{
    sat_gl *g;
    int good, failed = 0;
    if (!test_open()) return;
    for (good = 0; good < 22; good++) {
        test_garbage = "this is no GLSL;\n";
        test_good_shaders = good;
        EXPECT_EQ(sat_gl_create(&g, test_get_proc, NULL), SAT_ERR_GL_SHADER);
        if (strstr(sat_gl_message(g), "sat: ") && strstr(sat_gl_message(g), "compile") &&
            strstr(sat_gl_message(g), "  1 #version"))
            failed++;
        EXPECT_EQ(sat_gl_build(g, 0, 1, 4, 4), SAT_ERR_ARGUMENT);
        sat_gl_destroy(g);
        EXPECT_EQ(test_objects, 0);
    }
    EXPECT_EQ(failed, 22); /* 10 programs and the mean's, of 2 shaders */
    test_good_shaders = 22;
    EXPECT_EQ(sat_gl_create(&g, test_get_proc, NULL), SAT_OK);
    sat_gl_destroy(g);
    test_close();
}

TEST(refused_textures)
{
    sat_gl_options options = test_flat();
    sat_gl *g;
    unsigned texture;
    if (!test_open()) return;
    texture = test_texture(SAT__GL_R32F, 40, 30, NULL);
    EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_OK);
    test_bad_textures = 1;
    EXPECT_EQ(sat_gl_build(g, 0, texture, 40, 30), SAT_ERR_GL_STATE);
    EXPECT(sat_gl_message(g)[0] != 0);
    EXPECT_EQ(sat_gl_mean(g, NULL, texture, 40, 30), SAT_ERR_GL_STATE);
    EXPECT_EQ(sat_gl_table(g), 0);
    test_bad_textures = 0;
    EXPECT_EQ(sat_gl_build(g, 0, texture, 40, 30), SAT_OK);
    EXPECT_EQ(sat_gl_build(g, 0xffffffu, texture, 40, 30), SAT_ERR_GL_STATE); /* no such texture */
    sat_gl_destroy(g);
    EXPECT_EQ(test_objects, 0);
    sat__gl_clear_errors(&test_f.real);
    test_delete(texture);
    test_close();
}

TEST(range_of_fixed_tables)
{
    sat_gl_options options = test_flat();
    sat_gl *g;
    unsigned texture;
    if (!test_open()) return;
    texture = test_texture(SAT__GL_R32F, 40, 30, NULL);
    options.format = SAT_GL_FIXED32;
    options.max_box_area = 3e9;
    EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_OK);
    EXPECT_EQ(sat_gl_build(g, 0, texture, 40, 30), SAT_OK); /* no box is larger than the table */
    sat_gl_destroy(g);
    options.max_box_area = 100;
    options.max_value = 255;
    EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_OK);
    EXPECT_EQ(sat_gl_build(g, 0, texture, 40, 30), SAT_OK);
    EXPECT(sat_gl_quantum(g) * 2147483647.0 >= 100 * 255.0 && sat_gl_quantum(g) * 2147483647.0 <= 2 * 100 * 256.0);
    sat_gl_destroy(g);
    test_delete(texture);
    test_close();
}

/* ---- every shader text against the reference compiler of GLSL ES 3.00 ---- */

static int test_validate(const char *path, const char *text, const char *stage)
{
    char command[256];
    FILE *file = fopen(path, "w");
    if (!file) return 0;
    fputs(text, file);
    fclose(file);
    snprintf(command, sizeof command, "glslangValidator -S %s %s >%s.log 2>&1", stage, path, path);
    return system(command) == 0;
}

TEST(shaders_are_valid_es)
{
    static char text[1 << 20];
    char path[64], *part, *end;
    size_t size;
    int format, kind, valid = 0, shaders = 0;
    if (system("glslangValidator --version >/dev/null 2>&1") != 0) SKIP("needs glslangValidator (glslang-tools)");
    if (!test_open()) return;
    test_shader_file = tmpfile();
    test_as_es = 1;
    for (format = 0; format < 3; format++)
        for (kind = 0; kind < 2; kind++)
            sat_gl_destroy(
                test_create((sat_gl_format)format, kind ? SAT_SCAN_RECURSIVE_DOUBLING : SAT_SCAN_BALANCED_TREE, 4, 0));
    for (kind = 0; kind < 2; kind++) {
        sat_gl_options options = sat_gl_defaults();
        sat_gl *g = NULL;
        options.channels = 2;
        options.moments = kind;
        EXPECT_EQ(sat_gl_create(&g, test_get_proc, &options), SAT_OK);
        sat_gl_destroy(g);
    }
    rewind(test_shader_file);
    size = fread(text, 1, sizeof text - 1, test_shader_file);
    text[size] = 0;
    fclose(test_shader_file);
    test_shader_file = NULL;
    snprintf(path, sizeof path, "/tmp/test_sat_gl_%p", (void *)&size);
    for (part = text; (end = strstr(part, "\n@\n")) != NULL; part = end + 3) {
        *end = 0;
        shaders++;
        valid += test_validate(path, part, strstr(part, "gl_Position") ? "vert" : "frag");
        EXPECT(strstr(part, "#version 300 es") == part);
    }
    EXPECT_EQ(valid, shaders);
    EXPECT_EQ(shaders, 3 * 2 * (6 + 4) + 22 + 24);
    EXPECT(!test_validate(path, "#version 300 es\nvoid main() { int x = 1u; }\n", "frag")); /* it does look */
    remove(path);
    strcat(path, ".log");
    remove(path);
    test_close();
}

/* ---- what the sibling headers use ---- */

TEST(texture_formats)
{
    static const unsigned formats[] = {SAT__GL_R8,      SAT__GL_RG8,   SAT__GL_RGBA8,   SAT__GL_R8UI,
                                       SAT__GL_R16UI,   SAT__GL_R16F,  SAT__GL_RG16F,   SAT__GL_RGBA16F,
                                       SAT__GL_R32F,    SAT__GL_RG32F, SAT__GL_RGBA32F, SAT__GL_R32I,
                                       SAT__GL_RGBA32I, SAT__GL_R32UI, SAT__GL_RG32UI,  SAT__GL_RGBA32UI};
    sat__gl *gl = &test_f.real;
    unsigned char in[3 * 5 * 16], out[3 * 5 * 16];
    sat__gl_state state;
    unsigned texture = 0, format = 0, type = 0;
    size_t i, j;
    if (!test_open()) return;
    sat__gl_begin(gl, &state, 1);
    for (i = 0; i < sizeof formats / sizeof *formats; i++) {
        size_t bytes = (size_t)sat__gl_transfer(formats[i], &format, &type);
        for (j = 0; j < sizeof in; j++) in[j] = (unsigned char)(j * 7);
        if (type == SAT__GL_FLOAT)
            for (j = 0; j < sizeof in / 4; j++) { /* half floats too */
                float v = (float)j * 0.25f - 3;
                memcpy(in + 4 * j, &v, 4);
            }
        memset(out, 0, sizeof out);
        EXPECT_EQ(sat__gl_texture(gl, &texture, formats[i], 3, 5, NULL), SAT_OK);
        sat__gl_upload(gl, texture, formats[i], 3, 5, in);
        EXPECT_EQ(sat__gl_read(gl, out, texture, formats[i], 3, 5), SAT_OK);
        EXPECT_EQ(memcmp(in, out, 15 * bytes), 0);
        gl->DeleteTextures(1, &texture);
    }
    EXPECT_EQ(sat__gl_texture(gl, &texture, SAT__GL_R8, 0, 5, NULL), SAT_ERR_SIZE);
    EXPECT_EQ(texture, 0);
    sat__gl_end(gl, &state);
    test_close();
}

/* A vertex shader that squares its input into a buffer, and point sprites into two targets with a depth texture. */
TEST(transform_feedback_and_points)
{
    static const char *const square[] = {"in float x;\nout float y, z;\nvoid main() { y = x * x; z = OFFSET; gl_Position = vec4(0.0); }\n", NULL};
    static const char *const place[] = {"in float x;\nvoid main() { gl_Position = vec4(x, 0.0, 0.0, 1.0); gl_PointSize = 2.0; }\n", NULL};
    static const char *const paint[] = {"layout(location = 0) out vec4 a;\nlayout(location = 1) out vec4 b;\n"
                                        "void main() { a = vec4(gl_PointCoord, 0.0, 1.0); b = vec4(2.0); }\n", NULL};
    static const char *const varyings[] = {"y", "z", NULL};
    const float in[4] = {-0.5f, 0.5f, 3, 4}, zero[4] = {0, 0, 0, 0};
    sat__gl *gl = &test_f.real;
    sat__gl_shaders shaders;
    sat__gl_state state;
    unsigned buffers[2], program = 0, targets[2] = {0, 0}, depth = 0, framebuffer = 0, array = 0;
    float *mapped, pixels[8 * 8 * 4];
    int i, covered = 0;
    if (!test_open()) return;
    sat__gl_begin(gl, &state, 1);
    memset(&shaders, 0, sizeof shaders);
    shaders.name = "square";
    shaders.vertex = square;
    shaders.varyings = varyings;
    sat__gl_define_float(gl, "OFFSET", 0.1f);
    if (!EXPECT_EQ(sat__gl_build(gl, &program, &shaders), SAT_OK)) puts(gl->message);
    EXPECT_EQ(gl->defines[0], 0);
    EXPECT_EQ(sat__gl_texture(gl, &targets[0], SAT__GL_RGBA32F, 8, 8, NULL), SAT_OK);
    EXPECT_EQ(sat__gl_texture(gl, &targets[1], SAT__GL_RGBA16F, 8, 8, NULL), SAT_OK);
    EXPECT_EQ(sat__gl_texture(gl, &depth, SAT__GL_DEPTH_COMPONENT24, 8, 8, NULL), SAT_OK);
    EXPECT_EQ(sat__gl_framebuffer(gl, &framebuffer, targets, 2, depth), SAT_OK);
    gl->GenVertexArrays(1, &array);
    gl->BindVertexArray(array);
    gl->GenBuffers(2, buffers);
    gl->BindBuffer(SAT__GL_ARRAY_BUFFER, buffers[1]);
    gl->BufferData(SAT__GL_ARRAY_BUFFER, 8 * sizeof(float), NULL, SAT__GL_DYNAMIC_COPY);
    gl->BindBuffer(SAT__GL_ARRAY_BUFFER, buffers[0]);
    gl->BufferData(SAT__GL_ARRAY_BUFFER, sizeof in, in, 0x88E0);
    gl->EnableVertexAttribArray(0);
    gl->VertexAttribPointer(0, 1, SAT__GL_FLOAT, 0, 0, NULL);
    gl->BindBufferBase(SAT__GL_TRANSFORM_FEEDBACK_BUFFER, 0, buffers[1]);
    gl->Enable(SAT__GL_RASTERIZER_DISCARD);
    gl->UseProgram(program);
    gl->BeginTransformFeedback(SAT__GL_POINTS);
    gl->DrawArrays(SAT__GL_POINTS, 0, 4);
    gl->EndTransformFeedback();
    gl->Disable(SAT__GL_RASTERIZER_DISCARD);
    mapped = (float *)gl->MapBufferRange(SAT__GL_TRANSFORM_FEEDBACK_BUFFER, 0, 8 * sizeof(float), SAT__GL_MAP_READ_BIT);
    for (i = 0; mapped && i < 4; i++) {
        EXPECT_NEAR(mapped[2 * i], in[i] * in[i], 0);
        EXPECT_NEAR(mapped[2 * i + 1], 0.1f, 0);
    }
    EXPECT(mapped != NULL && gl->UnmapBuffer(SAT__GL_TRANSFORM_FEEDBACK_BUFFER));
    gl->DeleteProgram(program);

    memset(&shaders, 0, sizeof shaders);
    shaders.name = "points";
    shaders.vertex = place;
    shaders.fragment = paint;
    if (!EXPECT_EQ(sat__gl_build(gl, &program, &shaders), SAT_OK)) puts(gl->message);
    sat__gl_pass(gl, program, framebuffer, 8, 8);
    gl->Enable(SAT__GL_PROGRAM_POINT_SIZE);
    gl->ClearBufferfv(SAT__GL_COLOR, 0, zero);
    gl->ClearBufferfv(SAT__GL_COLOR, 1, zero);
    gl->DrawArrays(SAT__GL_POINTS, 0, 2);
    EXPECT_EQ(sat__gl_read(gl, pixels, targets[1], SAT__GL_RGBA16F, 8, 8), SAT_OK);
    for (i = 0; i < 64; i++) covered += pixels[4 * i] > 1.5f;
    EXPECT_EQ(covered, 8); /* two points of 2 x 2 pixels */
    EXPECT_NEAR(pixels[4 * (8 * 3 + 1)], 2, 0);
    sat__gl_end(gl, &state);
    gl->DeleteProgram(program);
    gl->DeleteBuffers(2, buffers);
    gl->DeleteVertexArrays(1, &array);
    gl->DeleteFramebuffers(1, &framebuffer);
    gl->DeleteTextures(2, targets);
    gl->DeleteTextures(1, &depth);
    test_close();
}

TEST(program_errors)
{
    static const char *const wrong[] = {"out vec4 c;\nvoid main() {\n    c = absent;\n}\n", NULL};
    static const char *const good[] = {"out vec4 c;\nvoid main() { c = vec4(1.0); }\n", NULL};
    static const char *const no_such[] = {"absent", NULL};
    sat__gl *gl = &test_f.real;
    sat__gl_shaders shaders;
    unsigned program = 7;
    int es, version;
    if (!test_open()) return;
    memset(&shaders, 0, sizeof shaders);
    shaders.name = "wrong";
    shaders.fragment = wrong;
    sat__gl_define(gl, "UNUSED", 3);
    EXPECT_EQ(sat__gl_build(gl, &program, &shaders), SAT_ERR_GL_SHADER);
    EXPECT_EQ(program, 0);
    EXPECT(strstr(gl->message, "wrong: a fragment shader does not compile") == gl->message);
    EXPECT(strstr(gl->message, "absent") != NULL && strstr(gl->message, "  2 #define UNUSED 3") != NULL);
    EXPECT(strstr(gl->message, "  5     c = absent;") != NULL);
    EXPECT_EQ(gl->defines[0], 0);
    shaders.fragment = good;
    shaders.varyings = no_such;
    EXPECT_EQ(sat__gl_build(gl, &program, &shaders), SAT_ERR_GL_SHADER);
    EXPECT(strstr(gl->message, "does not link") != NULL);
    EXPECT_EQ(sat__gl_parse_version("4.5 (Core Profile) Mesa", &es), 45);
    EXPECT_EQ(es, 0);
    EXPECT_EQ(sat__gl_parse_version("OpenGL ES 3.2 NVIDIA", &es), 32);
    EXPECT_EQ(es, 1);
    version = sat__gl_parse_version("OpenGL ES-CM 1.1", &es);
    EXPECT(version < 30);
    EXPECT_EQ(sat__gl_parse_version("nonsense", &es), 0);
    test_close();
}
