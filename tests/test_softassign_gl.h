/* softassign.h on the GPU against the same methods on the CPU. Needs OSMesa (or a GPU, see gl_context.h); skips
   without. */

#include "gl_context.h"
#include "gl_es.h"
#include "support.h"

static gl_context test_context;
static sat__gl test_gl; /* the test's own table */

static int open_gl(void)
{
    memset(&test_gl, 0, sizeof test_gl);
    if (!gl_context_open(&test_context, 3, 3)) {
        expect_skip(test_context.message);
        return 0;
    }
    return EXPECT_EQ(sat__gl_open(&test_gl, test_context.get_proc), SAT_OK);
}

static void close_gl(void)
{
    EXPECT_EQ(test_gl.GetError(), 0);
    sat__gl_close(&test_gl);
    gl_context_close(&test_context);
}

static float *make_costs(int rows, int columns, uint64_t seed)
{
    float *cost = (float *)malloc((size_t)rows * (size_t)columns * sizeof *cost);
    support_fill(cost, (size_t)rows * (size_t)columns, 0, 10, seed);
    return cost;
}

static softassign_problem problem_of(const float *cost, int rows, int columns)
{
    softassign_problem p;
    memset(&p, 0, sizeof p);
    p.rows = rows;
    p.columns = columns;
    p.cost = cost;
    p.stride = columns;
    return p;
}

static double largest_difference(const float *a, const float *b, size_t n)
{
    double worst = 0;
    size_t i;
    for (i = 0; i < n; i++) {
        double d = fabs((double)a[i] - (double)b[i]);
        if (expect_is_nan(d)) return d;
        if (d > worst) worst = d;
    }
    return worst;
}

/* ---- the published method ---- */

TEST(softassign_gl_published_equals_the_cpu)
{
    static const int sizes[][3] = {{30, 70, 4}, {1, 9, 4}, {64, 64, 2}, {17, 130, 7}, {90, 33 * 3, 16}};
    size_t k;
    int evolves, i, decided = 0;
    if (!open_gl()) return;
    for (k = 0; k < 5; k++)
        for (evolves = 0; evolves < 2; evolves++) {
            int rows = sizes[k][0], columns = sizes[k][1], *x = (int *)malloc((size_t)rows * sizeof *x);
            size_t n = (size_t)rows * (size_t)columns;
            float *cost = make_costs(rows, columns, k + 1), *cpu = (float *)malloc(n * sizeof *cpu),
                  *gpu = (float *)malloc(n * sizeof *gpu);
            softassign_problem p = problem_of(cost, rows, columns);
            softassign_options o = softassign_method_defaults(SOFTASSIGN_PUBLISHED);
            softassign_stats r;
            softassign_gl *gl;
            double soft_cost = 0, sharpest = 0, worst;
            if (n > 100) cost[n / 2] = INFINITY;
            o.iterations[0] = 10;
            o.iterations[1] = 3;
            o.iterations[2] = 4;
            o.temperature = 0.02;
            o.cooling = 0.7;
            o.outlier = evolves ? 0.5 : 100;
            o.outlier_evolves = evolves;
            o.gather = sizes[k][2];
            o.certify = 0;
            o.soft = cpu;
            o.soft_stride = columns;
            EXPECT_EQ(softassign_solve(x, &p, &o, &r), SAT_OK);
            if (!EXPECT_EQ(softassign_gl_create(&gl, test_context.get_proc, &o), SAT_OK))
                puts(softassign_gl_message(gl));
            EXPECT_EQ(softassign_gl_set_costs(gl, &p), SAT_OK);
            EXPECT_EQ(softassign_gl_published(gl, gpu, columns, &soft_cost), SAT_OK);
            worst = largest_difference(cpu, gpu, n);
            EXPECT(worst < 1e-3);
            EXPECT_REL(soft_cost, r.soft_cost, 1e-4);
            for (i = 0; i < (int)n; i++)
                if ((double)cpu[i] > sharpest) sharpest = (double)cpu[i];
            decided += sharpest > 0.3 && rows > 1;
            if (k == 0) REPORT("GPU softassign (3.7) against the CPU", worst, "largest difference of S");
            softassign_gl_destroy(gl);
            free(x);
            free(cost);
            free(cpu);
            free(gpu);
        }
    EXPECT(decided >= 5); /* not blurred: the comparison means something */
    close_gl();
}

TEST(softassign_gl_distances_equal_the_cpu)
{
    int rows = 20, columns = 50, n = 11, x[20];
    float *a = make_costs(rows, n, 3), *b = make_costs(columns, n, 4), cpu[1000], gpu[1000];
    softassign_problem p;
    softassign_options o = softassign_method_defaults(SOFTASSIGN_PUBLISHED);
    softassign_gl *gl;
    sat__gl_state state;
    if (!open_gl()) return;
    memset(&p, 0, sizeof p);
    p.rows = rows;
    p.columns = columns;
    p.row_features = a;
    p.column_features = b;
    p.feature_count = n;
    o.iterations[0] = 2;
    o.soft = cpu;
    o.soft_stride = columns;
    EXPECT_EQ(softassign_solve(x, &p, &o, NULL), SAT_OK);
    EXPECT_EQ(softassign_gl_create(&gl, test_context.get_proc, &o), SAT_OK);
    EXPECT_EQ(softassign_gl_set_costs(gl, &p), SAT_OK);
    sat__gl_begin(&test_gl, &state, 1);
    EXPECT_EQ(sat__gl_read(&test_gl, gpu, gl->texture[SOFTASSIGN__D], SAT__GL_R32F, columns, rows), SAT_OK);
    sat__gl_end(&test_gl, &state);
    {
        int i, j;
        for (i = 0; i < rows; i++)
            for (j = 0; j < columns; j++)
                EXPECT_REL(gpu[i * columns + j], softassign__distance(a + i * n, b + j * n, n), 2e-6);
    }
    EXPECT_EQ(softassign_gl_published(gl, gpu, columns, NULL), SAT_OK);
    EXPECT(largest_difference(cpu, gpu, 1000) < 1e-4);
    softassign_gl_destroy(gl);
    free(a);
    free(b);
    close_gl();
}

/* ---- entropic sweeps ---- */

TEST(softassign_gl_sweep_equals_the_cpu)
{
    static const int sizes[][3] = {{40, 90, 4}, {1, 5, 4}, {65, 65, 16}};
    static const double temperatures[] = {3, 0.1, 1e-3};
    size_t k, t;
    if (!open_gl()) return;
    for (k = 0; k < 3; k++)
        for (t = 0; t < 3; t++) {
            int rows = sizes[k][0], columns = sizes[k][1], i, j, turn, sweeps = 5;
            float *cost = make_costs(rows, columns, k + 5), *price = (float *)calloc((size_t)columns, sizeof *price);
            double *v = (double *)calloc((size_t)columns, sizeof *v),
                   *sum = (double *)malloc((size_t)columns * sizeof *sum);
            double bound = 0, gpu_bound = 0, eps = temperatures[t], worst = 0;
            softassign_problem p = problem_of(cost, rows, columns);
            softassign_options o = softassign_defaults();
            softassign_gl *gl;
            int *x = (int *)malloc((size_t)rows * sizeof *x);
            softassign_stats r;
            o.gather = sizes[k][2];
            for (turn = 0; turn < sweeps; turn++) { /* the plain double sweep */
                for (bound = 0, j = 0; j < columns; j++) {
                    sum[j] = 0;
                    bound += v[j];
                }
                for (i = 0; i < rows; i++) {
                    const float *c = cost + i * columns;
                    double least = HUGE_VAL, all = 0;
                    for (j = 0; j < columns; j++) least = fmin(least, (double)c[j] - v[j]);
                    for (j = 0; j < columns; j++) all += exp((least - ((double)c[j] - v[j])) / eps);
                    for (j = 0; j < columns; j++) sum[j] += exp((least - ((double)c[j] - v[j])) / eps) / all;
                    bound += least;
                }
                for (j = 0; j < columns; j++)
                    v[j] = fmin(0, sum[j] < 1e-36 ? v[j] + 82 * eps : v[j] - eps * log(sum[j]));
            }
            EXPECT_EQ(softassign_gl_create(&gl, test_context.get_proc, &o), SAT_OK);
            EXPECT_EQ(softassign_gl_set_costs(gl, &p), SAT_OK);
            EXPECT_EQ(softassign_gl_sweep(gl, price, &gpu_bound, eps, sweeps), SAT_OK);
            for (j = 0; j < columns; j++) worst = support_larger(worst, fabs((double)price[j] - v[j]));
            EXPECT(worst < 2e-3 * eps + 2e-5);
            EXPECT(gpu_bound <= bound + 1e-9 && gpu_bound > bound - 1e-4 * fabs(bound) - 1e-4);
            EXPECT_EQ(softassign_solve(x, &p, NULL, &r), SAT_OK);
            EXPECT(gpu_bound <= r.cost);
            softassign_gl_destroy(gl);
            free(cost);
            free(price);
            free(v);
            free(sum);
            free(x);
        }
    close_gl();
}

/* ---- state, refusals, other contexts ---- */

typedef struct gl_state { int values[64]; int count; } gl_state;

static void snapshot(gl_state *s)
{
    static const unsigned names[] = {SAT__GL_CURRENT_PROGRAM,
                                     SAT__GL_VERTEX_ARRAY_BINDING,
                                     SAT__GL_DRAW_FRAMEBUFFER_BINDING,
                                     SAT__GL_READ_FRAMEBUFFER_BINDING,
                                     SAT__GL_ACTIVE_TEXTURE,
                                     SAT__GL_TEXTURE_BINDING_2D,
                                     SAT__GL_SAMPLER_BINDING,
                                     SAT__GL_UNPACK_ALIGNMENT,
                                     SAT__GL_PACK_ALIGNMENT,
                                     SAT__GL_UNPACK_ROW_LENGTH,
                                     SAT__GL_DEPTH_FUNC,
                                     SAT__GL_BLEND_SRC_RGB,
                                     SAT__GL_PIXEL_PACK_BUFFER_BINDING,
                                     SAT__GL_PIXEL_UNPACK_BUFFER_BINDING};
    static const unsigned capabilities[] = {SAT__GL_BLEND, SAT__GL_DEPTH_TEST, SAT__GL_SCISSOR_TEST, SAT__GL_CULL_FACE,
                                            SAT__GL_STENCIL_TEST};
    size_t i;
    memset(s, 0, sizeof *s);
    for (i = 0; i < sizeof names / sizeof *names; i++) test_gl.GetIntegerv(names[i], &s->values[s->count++]);
    test_gl.GetIntegerv(SAT__GL_VIEWPORT, &s->values[s->count]);
    s->count += 4;
    for (i = 0; i < sizeof capabilities / sizeof *capabilities; i++)
        s->values[s->count++] = test_gl.IsEnabled(capabilities[i]);
    for (i = 0; i < 4; i++) {
        int active;
        test_gl.GetIntegerv(SAT__GL_ACTIVE_TEXTURE, &active);
        test_gl.ActiveTexture(SAT__GL_TEXTURE0 + (unsigned)i);
        test_gl.GetIntegerv(SAT__GL_TEXTURE_BINDING_2D, &s->values[s->count++]);
        test_gl.ActiveTexture((unsigned)active);
    }
}

TEST(softassign_gl_state_is_restored)
{
    gl_state before, after;
    void(SAT__GL_CALL * scissor)(int x, int y, int width, int height);
    sat_gl_proc proc;
    unsigned texture = 0;
    float *cost = make_costs(20, 40, 9), soft[800], price[40] = {0};
    softassign_problem p = problem_of(cost, 20, 40);
    softassign_options o = softassign_method_defaults(SOFTASSIGN_PUBLISHED);
    softassign_gl *gl;
    if (!open_gl()) return;
    o.iterations[0] = 2;
    test_gl.GenTextures(1, &texture);
    test_gl.ActiveTexture(SAT__GL_TEXTURE0 + 1);
    test_gl.BindTexture(SAT__GL_TEXTURE_2D, texture);
    test_gl.Enable(SAT__GL_BLEND);
    test_gl.Enable(SAT__GL_SCISSOR_TEST);
    proc = test_context.get_proc("glScissor");
    memcpy(&scissor, &proc, sizeof proc);
    scissor(0, 0, 1, 1);
    test_gl.Enable(SAT__GL_DEPTH_TEST);
    test_gl.Viewport(1, 2, 3, 4);
    test_gl.PixelStorei(SAT__GL_UNPACK_ALIGNMENT, 8);
    test_gl.PixelStorei(SAT__GL_PACK_ALIGNMENT, 2);
    snapshot(&before);
    EXPECT_EQ(softassign_gl_create(&gl, test_context.get_proc, &o), SAT_OK);
    EXPECT_EQ(softassign_gl_set_costs(gl, &p), SAT_OK);
    EXPECT_EQ(softassign_gl_published(gl, soft, 40, NULL), SAT_OK);
    EXPECT_EQ(softassign_gl_sweep(gl, price, NULL, 1, 3), SAT_OK);
    softassign_gl_destroy(gl);
    snapshot(&after);
    EXPECT(memcmp(&before, &after, sizeof before) == 0);
    test_gl.DeleteTextures(1, &texture);
    free(cost);
    close_gl();
}

static sat_gl_proc without_draw(const char *name)
{
    return strcmp(name, "glDrawArrays") == 0 ? NULL : test_context.get_proc(name);
}

TEST(softassign_gl_refuses_and_names)
{
    float *cost = make_costs(4, 6, 2), price[6] = {0}, soft[24];
    softassign_problem p = problem_of(cost, 4, 6);
    softassign_options o = softassign_defaults();
    softassign_gl *gl = NULL;
    support_memory memory;
    int lists[6] = {1, 1, 1, 1, 1, 1};
    EXPECT_EQ(softassign_gl_create(NULL, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(softassign_gl_create(&gl, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT(gl == NULL && softassign_gl_message(NULL) != NULL);
    softassign_gl_destroy(NULL);
    if (!open_gl()) return;
    EXPECT_EQ(softassign_gl_create(&gl, without_draw, NULL), SAT_ERR_GL_FUNCTION);
    EXPECT(strstr(softassign_gl_message(gl), "glDrawArrays") != NULL);
    softassign_gl_destroy(gl);
    o.allocator = support_allocator(&memory);
    memory.fail_at = 1;
    EXPECT_EQ(softassign_gl_create(&gl, test_context.get_proc, &o), SAT_ERR_MEMORY);
    memory.fail_at = 0;
    EXPECT_EQ(softassign_gl_create(&gl, test_context.get_proc, &o), SAT_OK);
    EXPECT_EQ(softassign_gl_sweep(gl, price, NULL, 1, 1), SAT_ERR_ARGUMENT); /* no costs yet */
    EXPECT_EQ(softassign_gl_published(gl, soft, 6, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(softassign_gl_set_costs(gl, NULL), SAT_ERR_ARGUMENT);
#define REFUSED(member, value)                                                                          \
    (p = problem_of(cost, 4, 6), p.member = value, EXPECT_EQ(softassign_gl_set_costs(gl, &p), SAT_ERR_ARGUMENT), \
     EXPECT(strncmp(softassign_gl_message(gl), #member, strlen(#member)) == 0))
    REFUSED(capacity, lists);
    REFUSED(minimum_use, lists);
    REFUSED(previous, lists);
    REFUSED(maximise, 1);
    REFUSED(unassigned_cost, 2);
    REFUSED(row_start, lists);
    REFUSED(rows, 0);
#undef REFUSED
    p = problem_of(cost, 4, 6);
    cost[5] = NAN;
    EXPECT_EQ(softassign_gl_set_costs(gl, &p), SAT_ERR_NON_FINITE);
    cost[5] = 1;
    EXPECT_EQ(softassign_gl_set_costs(gl, &p), SAT_OK);
    EXPECT_EQ(softassign_gl_sweep(gl, price, NULL, 0, 1), SAT_ERR_ARGUMENT);
    price[3] = 1;
    EXPECT_EQ(softassign_gl_sweep(gl, price, NULL, 1, 1), SAT_ERR_ARGUMENT);
    EXPECT_EQ(softassign_gl_published(gl, soft, 5, NULL), SAT_ERR_ARGUMENT);
    softassign_gl_destroy(gl);
    EXPECT(support_memory_clean(&memory));
    free(cost);
    close_gl();
}

/* The same turns in C, on the matrix that was read. */
static void seats_in_turns(const float *soft, const float *cost, int rows, int columns, int *seat)
{
    int *owner = (int *)malloc((size_t)columns * sizeof *owner), *want = (int *)malloc((size_t)rows * sizeof *want);
    int turn, i, j;
    for (j = 0; j < columns; j++) owner[j] = -1;
    for (i = 0; i < rows; i++) seat[i] = -1;
    for (turn = 0; turn <= rows; turn++) {
        for (i = 0; i < rows; i++) {
            const float *row = (turn ? cost : soft) + (size_t)i * (size_t)columns;
            want[i] = -1;
            for (j = 0; j < columns && seat[i] < 0; j++) {
                if (owner[j] >= 0 || !(turn ? row[j] < 1e37f : row[j] > 0)) continue;
                if (want[i] < 0 || (turn ? row[j] < row[want[i]] : row[j] > row[want[i]])) want[i] = j;
            }
        }
        for (i = 0; i < rows; i++)
            if (want[i] >= 0 && owner[want[i]] < 0) {
                owner[want[i]] = i;
                seat[i] = want[i];
            }
    }
    free(owner);
    free(want);
}

/* Who gets what stands in a texture, every column once; as the rule says, and within 30 % of what the CPU makes of its
   matrix, row after row (22 % over it at 90 x 99, the tightest). */
TEST(softassign_gl_assigns_into_a_texture)
{
    static const int sizes[][3] = {{30, 70, 4}, {1, 9, 4}, {64, 64, 2}, {17, 130, 7}, {90, 99, 16}, {1, 1, 4}};
    size_t k;
    if (!open_gl()) return;
    for (k = 0; k < 6; k++) {
        int rows = sizes[k][0], columns = sizes[k][1], i, x[90], y[90], seat[90], used[130] = {0};
        float *cost = make_costs(rows, columns, k + 1), texels[90];
        float *soft = (float *)malloc((size_t)rows * (size_t)columns * sizeof *soft);
        softassign_problem p = problem_of(cost, rows, columns);
        softassign_options o = softassign_method_defaults(SOFTASSIGN_PUBLISHED);
        softassign_stats r;
        softassign_gl *gl;
        sat__gl_state state;
        double sum = 0;
        o.iterations[0] = 10;
        o.iterations[1] = o.iterations[2] = 3;
        o.gather = sizes[k][2];
        o.certify = 0;
        EXPECT_EQ(softassign_solve(x, &p, &o, &r), SAT_OK);
        EXPECT_EQ(softassign_gl_create(&gl, test_context.get_proc, &o), SAT_OK);
        EXPECT_EQ(softassign_gl_columns(gl), 0);
        EXPECT_EQ(softassign_gl_assign(gl, y), SAT_ERR_ARGUMENT);
        EXPECT_EQ(softassign_gl_set_costs(gl, &p), SAT_OK);
        EXPECT_EQ(softassign_gl_assign(gl, y), SAT_ERR_ARGUMENT); /* no soft matrix yet */
        EXPECT_EQ(softassign_gl_published(gl, soft, columns, NULL), SAT_OK);
        EXPECT_EQ(softassign_gl_assign(gl, y), SAT_OK);
        EXPECT_EQ(softassign_gl_assign(gl, NULL), SAT_OK); /* nothing is read: the texture has it all the same */
        sat__gl_begin(&test_gl, &state, 1);
        EXPECT_EQ(sat__gl_read(&test_gl, texels, softassign_gl_columns(gl), SAT__GL_R32F, 1, rows), SAT_OK);
        sat__gl_end(&test_gl, &state);
        seats_in_turns(soft, cost, rows, columns, seat);
        for (i = 0; i < rows; i++) {
            EXPECT(y[i] == seat[i] && (int)texels[i] == y[i] && y[i] >= 0 && y[i] < columns && !used[y[i]]++);
            sum += (double)cost[i * columns + y[i]];
        }
        if (!EXPECT(sum <= 1.3 * r.cost + 1e-6)) printf("%d x %d: %g, on the CPU %g\n", rows, columns, sum, r.cost);
        softassign_gl_destroy(gl);
        free(cost);
        free(soft);
    }
    close_gl();
}

/* A row that nobody may serve, and more rows than columns, end in SAT_ERR_LIMIT; the others sit. */
TEST(softassign_gl_assign_names_what_is_left)
{
    float cost[12] = {1, 2, 3, 4, 1, 1, 1, 1, 2, 2, 2, 2};
    int j, x[4];
    softassign_problem p = problem_of(cost, 3, 4);
    softassign_gl *gl;
    if (!open_gl()) return;
    for (j = 0; j < 4; j++) cost[4 + j] = INFINITY;
    EXPECT_EQ(softassign_gl_assign(NULL, x), SAT_ERR_ARGUMENT);
    EXPECT_EQ(softassign_gl_columns(NULL), 0);
    EXPECT_EQ(softassign_gl_create(&gl, test_context.get_proc, NULL), SAT_OK);
    EXPECT_EQ(softassign_gl_set_costs(gl, &p), SAT_OK);
    EXPECT_EQ(softassign_gl_published(gl, NULL, 0, NULL), SAT_OK);
    EXPECT_EQ(softassign_gl_assign(gl, x), SAT_ERR_LIMIT);
    EXPECT(x[0] >= 0 && x[1] == -1 && x[2] >= 0 && x[0] != x[2]);
    for (j = 0; j < 12; j++) cost[j] = (float)(j % 5);
    p = problem_of(cost, 4, 3);
    EXPECT_EQ(softassign_gl_set_costs(gl, &p), SAT_OK);
    EXPECT_EQ(softassign_gl_published(gl, NULL, 0, NULL), SAT_OK);
    EXPECT_EQ(softassign_gl_assign(gl, x), SAT_ERR_LIMIT);
    EXPECT_EQ((x[0] < 0) + (x[1] < 0) + (x[2] < 0) + (x[3] < 0), 1);
    softassign_gl_destroy(gl);
    close_gl();
}

/* Every shader also as GLSL ES 3.00: the function table believes to be in an ES context. */
TEST(softassign_gl_shaders_are_valid_in_es)
{
    softassign_gl *gl = NULL;
    sat_result result;
    if (!open_gl()) return;
    result = softassign_gl_create(&gl, gl_es_pretend(test_context.get_proc), NULL);
    if (!EXPECT_EQ(result, SAT_OK)) puts(softassign_gl_message(gl));
    softassign_gl_destroy(gl);
    EXPECT(strstr(softassign_gl_glsl(), "softassign_join") != NULL && strlen(softassign_gl_glsl()) < 4096);
    close_gl();
}

/* The same options are refused as on the CPU. */
TEST(softassign_gl_refuses_the_options_that_the_cpu_refuses)
{
    int i, k;
    if (!open_gl()) return;
    for (i = 0; i < SAT__COUNT(softassign__fields); i++) {
        const sat__field *f = &softassign__fields[i];
        const double value[2] = {f->low - 1 - fabs(f->low), f->high + fabs(f->high)};
        for (k = 0; k < 2 && f->type != 'a' && f->type != 't'; k++) {
            softassign_options o = softassign_defaults();
            softassign_gl *gl = NULL;
            char text[200];
            if (f->type == 'i' && !(value[k] < 2147483647)) continue;
            sat__field_set(f, &o, value[k]);
            if (f->also == 'I' && k) continue;
            EXPECT(softassign_explain(text, sizeof text, &o)[0] != 0);
            EXPECT_EQ(softassign_gl_create(&gl, test_context.get_proc, &o), SAT_ERR_ARGUMENT);
            EXPECT(gl == NULL);
        }
    }
    close_gl();
}

/* NULL means softassign_defaults(), and the corners of the options that are read, in pairs, give the CPU's matrix, a
   temperature of 0 too. */
TEST(softassign_gl_corners_of_options_in_pairs)
{
    enum { ROWS = 5, COLUMNS = 7, CELLS = ROWS * COLUMNS };
    static const char *const names[] = {"temperature",   "cooling",       "iterations[0]",   "iterations[1]",
                                        "iterations[2]", "alpha",         "outlier",         "outlier_evolves"};
    const sat__field *fields[8];
    float *cost = make_costs(ROWS, COLUMNS, 5), cpu[CELLS], gpu[CELLS];
    softassign_problem p = problem_of(cost, ROWS, COLUMNS);
    softassign_gl *gl;
    int a, b, i, k, found = 0, x[ROWS], compared = 0, wrong = 0;
    if (!open_gl()) return;
    for (a = 0; a < 8; a++)
        for (i = 0; i < SAT__COUNT(softassign__fields); i++)
            if (strcmp(softassign__fields[i].name, names[a]) == 0) fields[a] = &softassign__fields[i], found++;
    EXPECT_EQ(found, 8);
    EXPECT_EQ(softassign_gl_create(&gl, test_context.get_proc, NULL), SAT_OK);
    EXPECT_EQ(softassign_gl_set_costs(gl, &p), SAT_OK);
    for (a = 0; a < 8; a++)
        for (b = a; b < 8; b++)
            for (k = 0; k < 9; k++) {
                /* a pair of which one is at its default is that one alone: met once, beside itself */
                const int met = a == b ? k / 3 > 0 : k / 3 == 0 || k % 3 == 0;
                const sat__field *f = fields[a], *g = fields[b];
                const double first[3] = {f->initial, f->low, f->high < 2e9 || f->type == 'd' ? f->high : 3};
                const double second[3] = {g->initial, g->low, g->high < 2e9 || g->type == 'd' ? g->high : 3};
                softassign_options o = softassign_defaults();
                softassign_stats r;
                double soft_cost;
                if (met) continue;
                for (i = 0; a + b + k && i < 3; i++) o.iterations[i] = 2;
                if (k / 3) sat__field_set(f, &o, first[k / 3]);
                if (k % 3) sat__field_set(g, &o, second[k % 3]);
                if (a + b + k) gl->options = o; /* all but gather, which is compiled in; the first are those of NULL */
                o.method = SOFTASSIGN_PUBLISHED;
                o.certify = 0;
                o.soft = cpu;
                memset(cpu, 0, sizeof cpu);
                memset(gpu, 0, sizeof gpu);
                EXPECT_EQ(softassign_solve(x, &p, &o, &r), SAT_OK);
                EXPECT_EQ(softassign_gl_published(gl, gpu, 0, &soft_cost), SAT_OK);
                for (i = 0; i < CELLS; i++) {
                    compared++;
                    if (cpu[i] > 1e30f && gpu[i] > 1e30f) continue;
                    wrong += !(fabsf(cpu[i] - gpu[i]) <= 1e-3f + 1e-3f * fabsf(cpu[i]));
                }
            }
    EXPECT_EQ(wrong, 0);
    EXPECT(compared == (8 * 3 + 28 * 4) * CELLS);
    softassign_gl_destroy(gl);
    free(cost);
    close_gl();
}

/* Distances of many features round more in a pass: the bound is still below the optimum. */
TEST(softassign_gl_bound_holds_for_many_features)
{
    static const int counts[] = {3, 48, 4000};
    size_t k;
    if (!open_gl()) return;
    for (k = 0; k < 3; k++) {
        int n = counts[k], i, j, x[12];
        float *f = (float *)malloc(24 * (size_t)n * sizeof *f), price[12] = {0};
        double bound, cost[12][12], least = 0;
        uint64_t seed = k + 9;
        softassign_problem p;
        softassign_gl *gl;
        softassign_stats r;
        memset(&p, 0, sizeof p);
        for (i = 0; i < 24 * n; i++) f[i] = (float)(1e4 + 100 * support_uniform(&seed));
        p.rows = p.columns = 12;
        p.row_features = f;
        p.column_features = f + 12 * n;
        p.feature_count = n;
        EXPECT_EQ(softassign_gl_create(&gl, test_context.get_proc, NULL), SAT_OK);
        EXPECT_EQ(softassign_gl_set_costs(gl, &p), SAT_OK);
        EXPECT_EQ(softassign_gl_sweep(gl, price, &bound, 1, 1), SAT_OK);
        for (i = 0; i < 12; i++) { /* at the prices 0 the exact bound is the sum of the least distances */
            double row = HUGE_VAL;
            for (j = 0; j < 12; j++) {
                int c;
                for (cost[i][j] = 0, c = 0; c < n; c++)
                    cost[i][j] += pow((double)f[i * n + c] - (double)f[(12 + j) * n + c], 2);
                row = fmin(row, sqrt(cost[i][j]));
            }
            least += row;
        }
        EXPECT(bound <= least && bound > least * (1 - 2 * (1e-6 + 6e-8 * n)));
        EXPECT_EQ(softassign_solve(x, &p, NULL, &r), SAT_OK);
        EXPECT(bound <= r.cost);
        softassign_gl_destroy(gl);
        free(f);
    }
    close_gl();
}
