/* softassign.h: certified gap against time, the tables of Slomp 2012 chapter 3 beside the optimum, memory, video.
   Real photographs and tiles where they are (../shared/data, libstb-dev), else patches and tiles of the same kind made
   here. The peers run in the same program: a plain dense solver (Jonker and Volgenant), and scipy's
   linear_sum_assignment when python3 has it; both get the matrix for free. */

#define SAT_IMPLEMENTATION
#define SOFTASSIGN_IMPLEMENTATION
#include <unistd.h>
static int matrix_always; /* what AUTO does not choose is timed too */
#define SOFTASSIGN__MATRIX_ALWAYS matrix_always
#include "softassign.h"
#include "bench.h"
#include "image.h"
#include "reference_softassign.h"

enum { FEATURES = 48 };

/* ---- instances ---- */

static float *all_tiles;     /* 8192 x 48 */
static int real_data;

#ifdef HAVE_STB
static float *load_cells(const char *path, int grid_width, int grid_height)
{
    image picture;
    float *out;
    size_t i, n;
    sat_image view;
    if (!path || !image_load(&picture, path)) return NULL;
    n = (size_t)picture.width * (size_t)picture.height * 3;
    for (i = 0; i < n; i++) picture.pixels[i] = 255 * sat__srgb_encode(picture.pixels[i]);
    out = (float *)malloc((size_t)(grid_width * grid_height) * FEATURES * sizeof *out);
    view = image_view(&picture);
    if (softassign_features(out, &view, grid_width, grid_height, 4, 4, NULL) != SAT_OK) exit(1);
    image_free(&picture);
    return out;
}
#else
static float *load_cells(const char *path, int grid_width, int grid_height)
{
    (void)path;
    (void)grid_width;
    (void)grid_height;
    return NULL;
}
#endif

/* A stand-in for photographs: slopes and texture around a level; few levels for patches, all for tiles. */
static float *make_cells(int count, int levels, uint64_t seed)
{
    float *out = (float *)malloc((size_t)count * FEATURES * sizeof *out);
    int i, k;
    for (i = 0; i < count; i++) {
        double r = support_uniform(&seed), level = levels ? 255 * floor(r * levels) / levels : 255 * r,
               x = support_gaussian(&seed), y = support_gaussian(&seed);
        for (k = 0; k < FEATURES; k++)
            out[i * FEATURES + k] = (float)(level + 8 * x * (k / 3 % 4) + 8 * y * (k / 12) + 6 * (k % 3) +
                                            (levels ? 3 : 12) * support_gaussian(&seed));
    }
    return out;
}

static float *patches_of(const char *photo, int grid_width, int grid_height)
{
    char path[128];
    float *out;
    snprintf(path, sizeof path, "photos/%s.jpg", photo);
    out = real_data ? load_cells(support_data(path), grid_width, grid_height) : NULL;
    return out ? out : make_cells(grid_width * grid_height, 12, (uint64_t)photo[0]);
}

static void load_tiles(void)
{
    float *a = load_cells(support_data("tiles/tiles_0.png"), 64, 64),
          *b = load_cells(support_data("tiles/tiles_1.png"), 64, 64);
    real_data = a && b;
    all_tiles = real_data ? (float *)malloc(8192u * FEATURES * sizeof *a) : make_cells(8192, 0, 7);
    if (real_data) {
        memcpy(all_tiles, a, 4096u * FEATURES * sizeof *a);
        memcpy(all_tiles + 4096 * FEATURES, b, 4096u * FEATURES * sizeof *b);
    }
    free(a);
    free(b);
}

typedef struct instance {
    softassign_problem p;
    float *patches, *cost;
    double optimum;
    int *x, *y, *pred, *list, *unassigned;
    double *v, *d;
    softassign_options options;
    softassign_stats report;
} instance;

static void open_instance(instance *q, const char *photo, int grid_width, int grid_height, int columns, int dense)
{
    int i, j, rows = grid_width * grid_height;
    memset(q, 0, sizeof *q);
    q->patches = patches_of(photo, grid_width, grid_height);
    q->p.rows = rows;
    q->p.columns = columns;
    q->p.row_features = q->patches;
    q->p.column_features = all_tiles;
    q->p.feature_count = FEATURES;
    q->x = (int *)malloc((size_t)rows * sizeof(int));
    if (!dense) return;
    q->cost = (float *)malloc((size_t)rows * (size_t)columns * sizeof(float));
    for (i = 0; i < rows; i++)
        for (j = 0; j < columns; j++)
            q->cost[(size_t)i * (size_t)columns + (size_t)j] =
                softassign__distance(q->patches + i * FEATURES, all_tiles + j * FEATURES, FEATURES);
    q->y = (int *)malloc((size_t)columns * sizeof(int));
    q->pred = (int *)malloc((size_t)columns * sizeof(int));
    q->list = (int *)malloc((size_t)columns * sizeof(int));
    q->unassigned = (int *)malloc((size_t)rows * sizeof(int));
    q->v = (double *)malloc((size_t)columns * sizeof(double));
    q->d = (double *)malloc((size_t)columns * sizeof(double));
}

static void close_instance(instance *q)
{
    free(q->patches);
    free(q->cost);
    free(q->x);
    free(q->y);
    free(q->pred);
    free(q->list);
    free(q->unassigned);
    free(q->v);
    free(q->d);
}

static void run_lapjv(void *user)
{
    instance *q = (instance *)user;
    long double sum = 0;
    int i;
    reference_lapjv(q->cost, q->p.rows, q->p.columns, q->x, q->y, q->v, q->d, q->pred, q->list, q->unassigned);
    for (i = 0; i < q->p.rows; i++) sum += q->cost[(size_t)i * (size_t)q->p.columns + (size_t)q->x[i]];
    q->optimum = (double)sum;
}

static void run_solver(void *user)
{
    instance *q = (instance *)user;
    if (softassign_solve(q->x, &q->p, &q->options, &q->report) != SAT_OK) {
        puts("# the solver failed");
        exit(1);
    }
}

static void set_method(instance *q, softassign_method method)
{
    q->options = softassign_method_defaults(method);
    q->options.certify = 0;
}

static double excess(const instance *q) { return (q->report.cost - q->optimum) / q->optimum; }

/* The number that a command prints, or -1; the file that it read is removed. */
static double printed_seconds(const char *command, const char *name)
{
    FILE *file = popen(command, "r");
    double seconds = -1;
    if (file) {
        if (fscanf(file, "%lf", &seconds) != 1) seconds = -1;
        pclose(file);
    }
    remove(name);
    return seconds;
}

/* Seconds of scipy's solver alone (best of `rounds`), or -1 where there is none. */
static double scipy_seconds(const instance *q, int rounds)
{
    char command[512];
    char name[64];
    FILE *file;
    size_t n = (size_t)q->p.rows * (size_t)q->p.columns;
    snprintf(name, sizeof name, "/tmp/bench_softassign_%ld.bin", (long)getpid());
    file = fopen(name, "wb");
    if (!file) return -1;
    if (fwrite(q->cost, sizeof(float), n, file) != n) {
        fclose(file);
        return -1;
    }
    fclose(file);
    snprintf(command, sizeof command,
             "/usr/bin/python3 -c \"import numpy,time\nfrom scipy.optimize import linear_sum_assignment as f\n"
             "c=numpy.fromfile('%s',dtype=numpy.float32).reshape(%d,%d).astype(numpy.float64)\nb=[]\n"
             "for i in range(%d):\n t=time.thread_time();f(c);b.append(time.thread_time()-t)\nprint(sorted(b)[len(b)//2])\" 2>/dev/null",
             name, q->p.rows, q->p.columns, rounds);
    return printed_seconds(command, name);
}

static const char *const method_names[] = {"auto",   "exact",          "fast",      "entropic", "published",
                                           "greedy", "greedy + 2-opt", "annealing", "ants"};

/* ---- the figures: exact and fast against the peers ---- */

static void table_peers(void)
{
    static const struct { const char *photo; int w, h;
    } runs[] = {{"fig_bowl", 30, 30}, {"brushes", 30, 30},   {"dandelion", 30, 30},
                {"dogs", 30, 30},     {"bird_lamp", 30, 30}, {"stream", 30, 30},
                {"dogs", 64, 32},     {"fig_bowl", 64, 32},  {"stream", 64, 32}};
    size_t k;
    int m, have_scipy = system("/usr/bin/python3 -c 'import scipy.optimize' >/dev/null 2>&1") == 0;
    bench_table("Features to proven result, one thread, against a plain LAPJV and scipy (both without the time of the matrix)",
                "photo\trows\tcolumns\tmethod\ttime_ms\tratio_lapjv\tratio_scipy\tcertified_gap\texcess\tmemory_mb\tmatrix_ratio\tdistances\tdefault");
    bench_note("memory_mb without the features; distances as a share of all pairs, lists made anew included");
    if (!have_scipy) bench_missing("scipy", "python3-scipy");
    for (k = 0; k < sizeof runs / sizeof *runs; k++) {
        instance q;
        double scipy;
        if (bench_quick() && k != 0) continue;
        if (bench_smoke()) open_instance(&q, runs[k].photo, 10, 10, 500, 1);
        else open_instance(&q, runs[k].photo, runs[k].w, runs[k].h, 8192, 1);
        scipy = have_scipy && !bench_quick() ? scipy_seconds(&q, 1) : -1;
        for (m = SOFTASSIGN_EXACT; m <= SOFTASSIGN_FAST; m++) {
            bench_times t;
            set_method(&q, (softassign_method)m);
            t = bench_ratio(run_solver, &q, run_lapjv, &q, q.p.rows > 1000 || bench_quick() ? 1 : 5);
            run_solver(&q);
            bench_row("%s\t%d\t%d\t%s\t%.4g\t%.3g\t%s\t%.3g\t%.3g\t%.3g\t%.3g\t%.3g\t%d", runs[k].photo, q.p.rows,
                      q.p.columns, method_names[m], t.work * 1e3, t.ratio, bench_cell(t.work / scipy, 3, scipy > 0),
                      q.report.gap, excess(&q), (double)q.report.bytes / 1e6,
                      (double)q.report.bytes / (4.0 * q.p.rows * q.p.columns),
                      (double)q.report.distances_computed / ((double)q.p.rows * q.p.columns), m == SOFTASSIGN_EXACT);
        }
        close_instance(&q);
    }
}

/* ---- small dense problems, as in games ---- */

static void run_dense(void *user)
{
    instance *q = (instance *)user;
    softassign_problem p = q->p;
    p.cost = q->cost;
    p.stride = p.columns;
    if (softassign_solve(q->x, &p, &q->options, &q->report) != SAT_OK) exit(1);
}

static void table_dense(void)
{
    static const int sizes[][3] = {{4, 4, 16}, {8, 8, 64}, {10, 10, 100}, {16, 16, 256}, {10, 10, 500}, {10, 10, 1000}};
    size_t k;
    bench_table("Small matrices, AUTO against a plain LAPJV without checks or certificate", "rows\tcolumns\ttime_us\tratio_lapjv\tcertified_gap\tdefault");
    for (k = 0; k < 6; k++) {
        instance q;
        bench_times t;
        open_instance(&q, "fig_bowl", sizes[k][0], sizes[k][1], sizes[k][2], 1);
        q.options = softassign_defaults();
        t = bench_ratio(run_dense, &q, run_lapjv, &q, bench_rounds(15));
        run_dense(&q);
        bench_row("%d\t%d\t%.4g\t%.3g\t%.3g\t%d", q.p.rows, q.p.columns, t.work * 1e6, t.ratio, q.report.gap, 1);
        close_instance(&q);
    }
}

/* ---- given matrices of every kind ---- */

enum { UNIFORM, INTEGERS, ZEROS_ONES, GEOMETRIC, LOW_RANK, PRODUCTS, SPARSE, KINDS };

/* Machol and Wien 1977: i * j, here with shuffled columns. */
static void fill_matrix(float *cost, int rows, int columns, int kind)
{
    enum { RANK = 4 };
    uint64_t seed = (uint64_t)(kind + 1);
    float *a = (float *)malloc((size_t)rows * RANK * sizeof *a),
          *b = (float *)malloc((size_t)columns * RANK * sizeof *b);
    int *order = (int *)malloc((size_t)columns * sizeof *order), i, j, k;
    for (i = 0; i < rows * RANK; i++) a[i] = (float)support_uniform(&seed);
    for (i = 0; i < columns * RANK; i++) b[i] = (float)support_uniform(&seed);
    for (j = 0; j < columns; j++) {
        k = (int)support_below(&seed, (uint64_t)j + 1);
        order[j] = order[k];
        order[k] = j;
    }
    for (i = 0; i < rows; i++)
        for (j = 0; j < columns; j++) {
            const float *u = a + i * RANK, *v = b + j * RANK;
            float *c = cost + (size_t)i * (size_t)columns + (size_t)j;
            if (kind == UNIFORM) *c = (float)support_uniform(&seed);
            if (kind == INTEGERS) *c = (float)support_below(&seed, (uint64_t)columns);
            if (kind == ZEROS_ONES) *c = (float)support_below(&seed, 2);
            if (kind == GEOMETRIC) *c = hypotf(u[0] - v[0], u[1] - v[1]);
            if (kind == LOW_RANK) *c = u[0] * v[0] + u[1] * v[1] + u[2] * v[2] + u[3] * v[3];
            if (kind == PRODUCTS) *c = (float)(i + 1) * (float)(order[j] + 1);
            if (kind == SPARSE) *c = support_uniform(&seed) < 0.05 ? (float)support_uniform(&seed) : 1e6f;
        }
    free(a);
    free(b);
    free(order);
}

static const char *const kind_names[KINDS] = {"uniform",  "integers to n", "zeros and ones", "points in a plane",
                                              "low rank", "i * j",         "5 % cheap pairs"};

static void table_matrices(void)
{
    static const int sizes[][2] = {{64, 64},     {64, 256},   {128, 128},   {256, 256},   {256, 1024}, {512, 512},
                                   {1024, 1024}, {512, 2048}, {1024, 4096}, {2048, 2048}, {4096, 4096}};
    size_t k, count = sizeof sizes / sizeof *sizes;
    int kind, have_scipy = system("/usr/bin/python3 -c 'import scipy.optimize' >/dev/null 2>&1") == 0;
    bench_table("Given matrices, AUTO against a plain LAPJV and scipy, one thread, in the order of their size",
                "kind\trows\tcolumns\ttime_ms\tratio_lapjv\tratio_scipy\tratio_best\tcertified_gap\tlists\tdefault");
    bench_plot("Time over that of the better peer; x=time_ms; y=ratio_best; by=kind; log=x; style=linespoints");
    bench_note("ratio_best: over the faster of the two; lists: 1 where AUTO left the matrix for lists");
    if (!have_scipy) bench_missing("scipy", "python3-scipy");
    for (k = 0; k < count; k++)
        for (kind = 0; kind < KINDS; kind++) {
            instance q;
            bench_times t;
            double scipy, best;
            if (bench_quick() && (sizes[k][1] > (bench_smoke() ? 64 : 512) || (bench_smoke() && kind > 1))) continue;
            open_instance(&q, "fig_bowl", sizes[k][0], 1, sizes[k][1], 1);
            fill_matrix(q.cost, q.p.rows, q.p.columns, kind);
            q.options = softassign_defaults();
            t = bench_ratio(run_dense, &q, run_lapjv, &q,
                            bench_rounds(sizes[k][0] > 1000  ? 1
                                         : sizes[k][0] > 300 ? 5
                                                             : 15));
            run_dense(&q);
            scipy = have_scipy && !bench_quick() ? scipy_seconds(&q, sizes[k][0] > 1000 ? 1 : 9) : -1;
            best = scipy > 0 && scipy < t.work / t.ratio ? t.work / scipy : t.ratio;
            bench_row("%s\t%d\t%d\t%.4g\t%.3g\t%s\t%.3g\t%.3g\t%d\t%d", kind_names[kind], q.p.rows, q.p.columns,
                      t.work * 1e3, t.ratio, bench_cell(t.work / scipy, 3, scipy > 0), best, q.report.gap,
                      q.report.method == SOFTASSIGN_EXACT, kind == UNIFORM);
            close_instance(&q);
        }
}

/* ---- what AUTO chooses from ---- */

/* Seconds of one way, best of some rounds: 0 AUTO, 1 on the matrix to the end, 2 on lists. */
static double time_way(instance *q, int way, int rounds)
{
    double best = HUGE_VAL, start;
    set_method(q, way == 2 ? SOFTASSIGN_EXACT : SOFTASSIGN_AUTO);
    matrix_always = way == 1;
    for (; rounds > 0; rounds--) {
        start = bench_clock();
        if (q->p.cost) run_dense(q);
        else run_solver(q);
        start = bench_clock() - start;
        best = start < best ? start : best;
    }
    matrix_always = 0;
    return best;
}

static void row_of_ways(instance *q, const char *name)
{
    double once = time_way(q, 0, 1), ways[3];
    int way, rounds = bench_rounds(once > 0.3 ? 1 : once > 0.03 ? 3 : once > 0.003 ? 9 : 25), lists = 0;
    for (way = 0; way < 3; way++) {
        ways[way] = time_way(q, way, rounds);
        if (way == 0) lists = q->report.method == SOFTASSIGN_EXACT;
    }
    bench_row("%s\t%d\t%d\t%s%.4g%s\t%s%.4g%s\t%.4g\t%.3g\t%d", name, q->p.rows, q->p.columns, lists ? "" : "(",
              ways[1] * 1e3, lists ? "" : ")", lists ? "(" : "", ways[2] * 1e3, lists ? ")" : "", ways[0] * 1e3,
              ways[0] / (ways[1] < ways[2] ? ways[1] : ways[2]), strcmp(name, "uniform") == 0);
}

static void table_ways(void)
{
    static const int sizes[][2] = {{64, 64},    {64, 128},   {64, 512},    {64, 4096},  {256, 256},
                                   {256, 320},  {256, 512},  {256, 768},   {256, 1024}, {256, 4096},
                                   {512, 1024}, {512, 2048}, {1024, 1280}};
    static const int cells[][3] = {{10, 10, 100},  {10, 10, 500},  {10, 10, 1000}, {10, 10, 2000},
                                   {20, 20, 1500}, {20, 20, 4096}, {30, 30, 2000}, {30, 30, 8192}};
    static const char *const photos[] = {"fig_bowl", "dogs", "stream"};
    size_t k, f;
    int kind;
    bench_table("What AUTO chooses from: milliseconds on the matrix to the end, and on lists; its choice in brackets",
                "kind\trows\tcolumns\tmatrix_ms\tlists_ms\tauto_ms\tauto_over_better\tdefault");
    bench_note("best of some rounds, one thread; features: on the matrix with the time it takes to make it");
    for (kind = 0; kind < KINDS; kind++)
        for (k = 0; k < sizeof sizes / sizeof *sizes; k++) {
            instance q;
            if (bench_quick() && (sizes[k][1] > (bench_smoke() ? 64 : 512) || kind > 1)) continue;
            open_instance(&q, "fig_bowl", sizes[k][0], 1, sizes[k][1], 1);
            fill_matrix(q.cost, q.p.rows, q.p.columns, kind);
            q.p.cost = q.cost;
            row_of_ways(&q, kind_names[kind]);
            close_instance(&q);
        }
    for (f = 0; f < 3; f++)
        for (k = 0; k < sizeof cells / sizeof *cells; k++) {
            instance q;
            if (bench_quick() && (f || k > (bench_smoke() ? 0u : 3u))) continue;
            open_instance(&q, photos[f], cells[k][0], cells[k][1], cells[k][2], 0);
            row_of_ways(&q, photos[f]);
            close_instance(&q);
        }
}

/* ---- other forms of the same costs ---- */

enum { FLOATS, DOUBLES, INTS, GATED, MARGINS, CSR, FORMS };

typedef struct forms {
    double *wide;
    int *whole, *start, *index;
    float *values;
    double *margin;
    int allowed;
} forms;

static forms open_forms(const instance *q)
{
    size_t n = (size_t)q->p.rows * (size_t)q->p.columns, k;
    uint64_t seed = 9;
    forms f;
    f.wide = (double *)malloc(n * sizeof *f.wide);
    f.whole = (int *)malloc(n * sizeof *f.whole);
    f.index = (int *)malloc(n * sizeof *f.index);
    f.values = (float *)malloc(n * sizeof *f.values);
    f.start = (int *)malloc((size_t)(q->p.rows + 1) * sizeof *f.start);
    f.margin = (double *)malloc((size_t)q->p.rows * sizeof *f.margin);
    f.allowed = 0;
    for (k = 0; k < n; k++) {
        int row = (int)(k / (size_t)q->p.columns), column = (int)(k % (size_t)q->p.columns);
        f.wide[k] = (double)q->cost[k];
        f.whole[k] = (int)((double)q->cost[k] * 1e6);
        if (column == 0) f.start[row] = f.allowed;
        if (support_uniform(&seed) >= 0.05 && column != row) continue; /* one that is allowed to all rows */
        f.index[f.allowed] = column;
        f.values[f.allowed++] = q->cost[k];
    }
    f.start[q->p.rows] = f.allowed;
    return f;
}

static void close_forms(forms *f)
{
    free(f->wide), free(f->whole), free(f->index), free(f->values), free(f->start), free(f->margin);
}

/* Seconds of scipy's sparse solver, or -1. */
static double scipy_sparse_seconds(const instance *q, const forms *f, int rounds)
{
    char command[768], name[64];
    FILE *file;
    size_t n = (size_t)f->allowed, rows = (size_t)q->p.rows + 1;
    snprintf(name, sizeof name, "/tmp/bench_softassign_%ld.bin", (long)getpid());
    file = fopen(name, "wb");
    if (!file) return -1;
    rows = fwrite(f->start, sizeof(int), rows, file) + fwrite(f->index, sizeof(int), n, file) +
           fwrite(f->values, sizeof(float), n, file);
    fclose(file);
    snprintf(command, sizeof command,
             "/usr/bin/python3 -c \"import numpy,time\nfrom scipy.sparse import csr_matrix\n"
             "from scipy.sparse.csgraph import min_weight_full_bipartite_matching as f\n"
             "a=numpy.fromfile('%s',dtype=numpy.int32)\nr=%d\nn=%d\n"
             "m=csr_matrix((a[r+1+n:].view(numpy.float32).astype(numpy.float64)+1e-9,a[r+1:r+1+n],a[:r+1]),shape=(r,%d))\nb=[]\n"
             "for i in range(%d):\n t=time.thread_time();f(m);b.append(time.thread_time()-t)\nprint(sorted(b)[len(b)//2])\" 2>/dev/null",
             name, q->p.rows, f->allowed, q->p.columns, rounds);
    return printed_seconds(command, name);
}

static void table_forms(void)
{
    static const char *const names[FORMS] = {"floats", "doubles", "integers", "floats, rows left out at a price",
                                             "floats, margins", "CSR, 5 % of the pairs"};
    static const int sizes[][2] = {{100, 100}, {512, 512}, {512, 2048}};
    size_t k;
    int form, have_scipy = system("/usr/bin/python3 -c 'import scipy.sparse.csgraph' >/dev/null 2>&1") == 0;
    bench_table("Other forms of uniform costs, AUTO, over the floats, and over scipy's dense solver (CSR: its sparse one)",
                "costs\trows\tcolumns\ttime_ms\tratio_floats\tratio_scipy\tcertified_gap\tdefault");
    bench_note("rows left out: the price is the dearest pair that the optimum uses, so that few are; margins: one more path a row");
    if (!have_scipy) bench_missing("scipy", "python3-scipy");
    for (k = 0; k < 3; k++) {
        instance q;
        forms f;
        double floats = 0, dense, sparse, dearest = 0;
        int i;
        if (bench_quick() && k > (bench_smoke() ? 0u : 1u)) break;
        open_instance(&q, "fig_bowl", sizes[k][0], 1, sizes[k][1], 1);
        fill_matrix(q.cost, q.p.rows, q.p.columns, UNIFORM);
        f = open_forms(&q);
        dense = have_scipy && !bench_quick() ? scipy_seconds(&q, 9) : -1;
        sparse = have_scipy && !bench_quick() ? scipy_sparse_seconds(&q, &f, 9) : -1;
        for (form = 0; form < FORMS; form++) {
            instance r = q;
            double best = HUGE_VAL, start, peer = form == CSR ? sparse : dense;
            int round;
            r.options = softassign_defaults();
            if (form <= FLOATS || form == GATED || form == MARGINS) r.p.cost = q.cost;
            if (form == DOUBLES) r.p.cost_double = f.wide;
            if (form == INTS) r.p.cost_int = f.whole;
            if (form == GATED) r.p.unassigned_cost = (float)dearest;
            if (form == MARGINS) r.options.row_margin = f.margin;
            if (form == CSR) r.p.cost = f.values, r.p.row_start = f.start, r.p.column_index = f.index;
            for (round = bench_rounds(15); round > 0; round--) {
                start = bench_clock();
                run_solver(&r);
                start = bench_clock() - start;
                best = start < best ? start : best;
            }
            if (form == FLOATS) floats = best;
            for (i = 0; form == FLOATS && i < q.p.rows; i++) {
                double c = (double)q.cost[(size_t)i * (size_t)q.p.columns + (size_t)q.x[i]];
                dearest = c > dearest ? c : dearest;
            }
            bench_row("%s\t%d\t%d\t%.4g\t%.3g\t%s\t%.3g\t%d", names[form], q.p.rows, q.p.columns, best * 1e3,
                      best / floats, bench_cell(best / peer, 3, peer > 0), r.report.gap, form == FLOATS);
        }
        close_forms(&f);
        close_instance(&q);
    }
}

/* ---- error against time, all methods ---- */

static void table_error_time(void)
{
    static const int sizes[][3] = {{10, 10, 100}, {10, 10, 500}, {20, 20, 1500}, {30, 30, 8192}, {64, 32, 8192}};
    static const double gaps[] = {1e-2, 1e-3, 1e-4};
    size_t k, g;
    int m;
    bench_table("Error against time, fig_bowl", "size\tmethod\tsetting\ttime_ms\tratio_lapjv\texcess\tcertified_gap\tdefault");
    bench_plot("Excess over the optimum against time; x=time_ms; y=excess; by=method; log=xy; picture=plot_softassign");
    bench_plot("Certified gap against time; x=time_ms; y=certified_gap; by=method; log=xy");
    bench_note("excess below 1e-7 is shown as 1e-7; the annealing, ants and published runs at 900x8192 and above are shortened as their setting says");
    for (k = 0; k < 5; k++) {
        instance q;
        double lapjv;
        char size[32];
        if (bench_quick() && k > (bench_smoke() ? 0u : 1u)) break;
        open_instance(&q, "fig_bowl", sizes[k][0], sizes[k][1], sizes[k][2], 1);
        snprintf(size, sizeof size, "%dx%d", q.p.rows, q.p.columns);
        lapjv = bench_time(run_lapjv, &q, k > 2 ? 1 : 5);
        bench_row("%s\tLAPJV\tdense\t%.4g\t1\t1e-7\t1\t0", size, lapjv * 1e3);
        for (m = 0; m < 9; m++)
            for (g = 0; g < (m == SOFTASSIGN_FAST ? 3u : 1u); g++) {
                double start, seconds;
                char setting[64] = "";
                set_method(&q, (softassign_method)m);
                q.options.gap = gaps[g];
                if (m == SOFTASSIGN_FAST) snprintf(setting, sizeof setting, "gap %g", gaps[g]);
                if (m == SOFTASSIGN_PUBLISHED && k > 2) q.options.iterations[0] = 2;
                if (m == SOFTASSIGN_PUBLISHED)
                    snprintf(setting, sizeof setting, "%d x 10 x 10", q.options.iterations[0]);
                if (m == SOFTASSIGN_ANTS && k > 2) q.options.iterations[0] = 20;
                if (m == SOFTASSIGN_ANTS) snprintf(setting, sizeof setting, "%d iterations", q.options.iterations[0]);
                if (m == SOFTASSIGN_ANNEALING && k > 2) q.options.iterations[1] = 100;
                if (m == SOFTASSIGN_ANNEALING)
                    snprintf(setting, sizeof setting, "120 x %d moves a row", q.options.iterations[1]);
                start = bench_clock();
                run_solver(&q);
                seconds = bench_clock() - start;
                if (seconds < 0.2) seconds = bench_time(run_solver, &q, 5);
                bench_row("%s\t%s\t%s\t%.4g\t%.3g\t%.3g\t%.3g\t%d", size, method_names[m], setting, seconds * 1e3,
                          seconds / lapjv, excess(&q) > 1e-7 ? excess(&q) : 1e-7,
                          q.report.gap > 1e-16 ? q.report.gap : 1e-16, m == SOFTASSIGN_AUTO);
            }
        close_instance(&q);
    }
}

/* ---- table 3.1 ---- */

static void table_3_1(void)
{
    static const int sizes[][3] = {{10, 10, 100}, {10, 10, 500}, {20, 20, 1500}};
    static const double published[][3] = {{44172, 43370, 42713}, {31997, 31282, 31656}, {128817, 123350, 127560}};
    static const int methods[] = {SOFTASSIGN_GREEDY, SOFTASSIGN_ANNEALING, SOFTASSIGN_PUBLISHED};
    static const char *const photos[] = {"fig_bowl", "brushes", "dandelion", "dogs", "bird_lamp", "stream"};
    size_t k, f;
    int m;
    bench_table("Table 3.1 re-made: cost of greedy, annealing and softassign, and what the thesis could not know, the optimum",
                "photo\trows\tcolumns\tbest_match_repeats\tgreedy\tannealing\tsoftassign\toptimum\tgreedy_rel\tannealing_rel\tsoftassign_rel\tthesis_greedy_rel\tthesis_annealing_rel\tthesis_softassign_rel");
    bench_note("_rel is relative to the optimum here, and in the columns of the thesis to the best of its three methods");
    for (f = 0; f < 6; f++)
        for (k = 0; k < 3; k++) {
            instance q;
            double cost[3], repeats, best = published[k][0];
            if (bench_quick() && (f > 0 || k > 0)) break;
            open_instance(&q, photos[f], sizes[k][0], sizes[k][1], sizes[k][2], 1);
            run_lapjv(&q);
            set_method(&q, SOFTASSIGN_EXACT);
            q.options.capacity_default = q.p.rows;
            run_solver(&q);
            repeats = q.report.cost;
            for (m = 0; m < 3; m++) {
                set_method(&q, (softassign_method)methods[m]);
                run_solver(&q);
                cost[m] = q.report.cost;
                if (published[k][m] < best) best = published[k][m];
            }
            bench_row("%s\t%d\t%d\t%.0f\t%.0f\t%.0f\t%.0f\t%.0f\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f", photos[f],
                      q.p.rows, q.p.columns, repeats, cost[0], cost[1], cost[2], q.optimum, cost[0] / q.optimum,
                      cost[1] / q.optimum, cost[2] / q.optimum, published[k][0] / best, published[k][1] / best,
                      published[k][2] / best);
            close_instance(&q);
        }
}

/* ---- table 3.2 ---- */

static void table_3_2(void)
{
    static const int sizes[][2] = {{100, 100},   {100, 500},   {400, 1500},  {512, 2048},  {900, 3000},
                                   {1024, 4096}, {1200, 5000}, {1600, 6000}, {1800, 7000}, {2048, 8192}};
    static const double thesis[][3] = {
        {.024, .022, .022},   {.114, .062, .023},   {1.506, .780, .035},  {2.572, 1.479, .052}, {6.485, 3.912, .114},
        {10.01, 5.963, .171}, {14.29, 8.532, .239}, {22.73, 13.85, .374}, {29.82, 17.78, .487}, {39.77, 23.62, .643}};
    size_t k;
    int w;
    bench_table("Table 3.2 re-made: seconds for one cooling iteration of 10 x 10 (SOFTASSIGN_PUBLISHED, float)",
                "rows\tcolumns\tcpu_x1_s\tcpu_x2_s\tthesis_x1_s\tthesis_x4_s\tthesis_gpu_s\tlapjv_s\titeration_ratio_lapjv");
    bench_note("the thesis: Core2 Quad 2.55 GHz and GeForce GTX 280; the GPU passes of today's machine are in gpu_softassign.c");
    for (k = 0; k < 10; k++) {
        instance q;
        double seconds[2], lapjv, start;
        if (bench_quick() && k > (bench_smoke() ? 0u : 2u)) break;
        open_instance(&q, "fig_bowl", sizes[k][0], 1, sizes[k][1], 1);
        start = bench_clock();
        run_lapjv(&q);
        lapjv = bench_clock() - start;
        for (w = 0; w < 2; w++) {
            softassign_problem p = q.p;
            double (*tick)(void) = w ? support_clock : bench_clock, zero;
            p.cost = q.cost;
            p.stride = p.columns;
            set_method(&q, SOFTASSIGN_PUBLISHED);
            if (w) q.options.threads = support_threads(2);
            q.options.iterations[0] = 0; /* everything but the iteration */
            start = tick();
            if (softassign_solve(q.x, &p, &q.options, &q.report) != SAT_OK) exit(1);
            zero = tick() - start;
            q.options.iterations[0] = 1;
            start = tick();
            if (softassign_solve(q.x, &p, &q.options, &q.report) != SAT_OK) exit(1);
            seconds[w] = tick() - start - zero;
        }
        bench_row("%d\t%d\t%.4g\t%.4g\t%g\t%g\t%g\t%.4g\t%.3g", q.p.rows, q.p.columns, seconds[0], seconds[1], thesis[k][0], thesis[k][1], thesis[k][2],
                  lapjv, seconds[0] / lapjv);
        close_instance(&q);
    }
}

/* ---- lists: length, and how often they are made anew ---- */

static void table_lists(void)
{
    static const int lengths[] = {8, 16, 32, 48, 64, 96, 128, 256};
    static const int sizes[][3] = {{30, 30, 8192}, {64, 32, 8192}};
    size_t k, l;
    int m;
    bench_table("Length of the lists", "rows\tmethod\tneighbours\ttime_ms\tlists_made\trows_expanded\tdistances\tmemory_mb\tdefault");
    bench_plot("Time against the length of the lists; x=neighbours; y=time_ms; by=method; log=xy; style=linespoints");
    for (k = 0; k < 2; k++) {
        instance q;
        if (bench_quick() && k) break;
        open_instance(&q, "fig_bowl", sizes[k][0], sizes[k][1], sizes[k][2], 0);
        for (m = SOFTASSIGN_EXACT; m <= SOFTASSIGN_FAST; m++)
            for (l = 0; l < 8; l += bench_smoke() ? 7 : bench_quick() ? 2 : 1) {
                double seconds;
                set_method(&q, (softassign_method)m);
                q.options.neighbours = lengths[l];
                seconds = bench_time(run_solver, &q, k || bench_quick() ? 1 : 3);
                bench_row("%d\t%s\t%d\t%.4g\t%.0f\t%.0f\t%.3g\t%.3g\t%d", q.p.rows, method_names[m], lengths[l],
                          seconds * 1e3, (double)q.report.lists_built, (double)q.report.rows_expanded,
                          (double)q.report.distances_computed / ((double)q.p.rows * q.p.columns),
                          (double)q.report.bytes / 1e6, lengths[l] == softassign_defaults().neighbours);
            }
        close_instance(&q);
    }
}

/* ---- 8192 x 65536 ---- */

/* The eight flips and turns of every tile: 65536 different columns. */
static float *turned_tiles(void)
{
    float *out = (float *)malloc(65536u * FEATURES * sizeof *out);
    int t, turn, x, y, c;
    for (t = 0; t < 8192; t++)
        for (turn = 0; turn < 8; turn++)
            for (y = 0; y < 4; y++)
                for (x = 0; x < 4; x++) {
                    int a = turn & 1 ? 3 - x : x, b = turn & 2 ? 3 - y : y;
                    for (c = 0; c < 3; c++)
                        out[((size_t)(t * 8 + turn) * 16 + (size_t)(y * 4 + x)) * 3 + (size_t)c] =
                            all_tiles[(t * 16 + (turn & 4 ? a * 4 + b : b * 4 + a)) * 3 + c];
                }
    return out;
}

static void table_large(void)
{
    instance q;
    int m;
    double start, seconds;
    float *columns;
    if (bench_quick()) return;
    columns = turned_tiles();
    open_instance(&q, "dogs", 64, 128, 8192, 0);
    q.p.columns = 65536;
    q.p.column_features = columns;
    bench_table("8192 x 65536: the matrix would be 2147 MB", "method\tgap_asked\ttime_s\tcertified_gap\tmemory_mb\tmatrix_ratio\tdistances\tlists_made\tpaths\tdefault");
    for (m = SOFTASSIGN_EXACT; m <= SOFTASSIGN_FAST; m++) {
        set_method(&q, (softassign_method)m);
        q.options.threads = support_threads(2);
        start = support_clock();
        run_solver(&q);
        seconds = support_clock() - start;
        bench_row("%s\t%g\t%.4g\t%.3g\t%.3g\t%.3g\t%.3g\t%.0f\t%.0f\t%d", method_names[m], q.options.gap, seconds, q.report.gap, (double)q.report.bytes / 1e6,
                  (double)q.report.bytes / (4.0 * 8192 * 65536), (double)q.report.distances_computed / (8192.0 * 65536),
                  (double)q.report.lists_built, (double)q.report.paths, m == SOFTASSIGN_EXACT);
    }
    close_instance(&q);
    free(columns);
}

/* ---- video ---- */

/* Cells of a window of 3/4 of the photo that moves by `step` of a cell a frame; made-up data shifts features
   instead. */
static void pan(float *out, const image *picture, const float *made, double step, int frame)
{
    int i;
    if (picture) {
        sat_image window = image_view(picture);
        window.width = window.height = picture->width * 3 / 4;
        window.pixels = picture->pixels + (size_t)(frame * step * window.width / 30) * 3;
        if (softassign_features(out, &window, 30, 30, 4, 4, NULL) != SAT_OK) exit(1);
        return;
    }
    for (i = 0; i < 900 * FEATURES; i++) out[i] = made[i] + (float)(20 * step * frame * sin(0.1 * i));
}

static void table_video(void)
{
    static const double bonuses[] = {0, 0.02, 0.05, 0.1};
    static const double steps[] = {0.125, 0.333};
    int frames = bench_smoke() ? 2 : bench_quick() ? 3 : 12, frame, i;
    size_t b, m;
    image photo, *picture = NULL;
#ifdef HAVE_STB
    const char *path = support_data("photos/dogs.jpg");
    if (path && image_load(&photo, path)) {
        size_t k, n = (size_t)photo.width * (size_t)photo.height * 3;
        for (k = 0; k < n; k++) photo.pixels[k] = 255 * sat__srgb_encode(photo.pixels[k]);
        picture = &photo;
    }
#else
    memset(&photo, 0, sizeof photo);
#endif
    bench_table("Video: 30 x 30 of 8192, a window of three quarters pans over the picture",
                "cells_a_frame\tswitching\twarm_ratio_cold\twarm_ratio_lapjv\tchanged\tfree_optimum_changes\texcess\tcertified_gap\tcolumns_finished\tdefault");
    bench_note("warm_ratio_cold: against the same call without prices; changed: share of the 900 tiles that differ from the frame before");
    for (m = 0; m < (bench_quick() ? 1u : 2u); m++)
    for (b = 0; b < 4; b += bench_quick() ? 4u : 1u) {
        instance q;
        float *made;
        softassign *warm = NULL;
        double ratios[16], lapjv[16], changed = 0, unforced = 0, worse = 0, gap = 0, finished = 0;
        int *previous = (int *)malloc(900 * sizeof(int)), *optimum = (int *)malloc(900 * sizeof(int)), n = 0;
        open_instance(&q, "dogs", 30, 30, 8192, 1);
        made = make_cells(900, 12, 3);
        q.options = softassign_method_defaults(SOFTASSIGN_EXACT);
        q.options.switching = bonuses[b];
        if (softassign_create(&warm, 900, 8192, &q.options) != SAT_OK) exit(1);
        for (frame = 0; frame < frames; frame++) {
            double start, t_warm, t_cold, t_lapjv, best;
            int j, differ = 0;
            pan(q.patches, picture, made, steps[m], frame);
            for (i = 0; i < 900; i++)
                for (j = 0; j < 8192; j++)
                    q.cost[(size_t)i * 8192 + (size_t)j] =
                        softassign__distance(q.patches + i * FEATURES, all_tiles + j * FEATURES, FEATURES);
            q.p.previous = frame ? previous : NULL;
            start = bench_clock();
            softassign_next_frame(warm);
            if (softassign_step(warm, q.x, &q.p, (size_t)-1 / 4, &q.report) != SAT_OK) exit(1);
            t_warm = bench_clock() - start;
            if (frame) {
                changed += q.report.switched / 900.0;
                gap += q.report.gap;
                finished += (double)q.report.columns_finished;
            }
            memcpy(previous, q.x, 900 * sizeof(int));
            best = q.report.cost;
            q.p.previous = NULL;
            start = bench_clock();
            run_solver(&q);
            t_cold = bench_clock() - start;
            for (i = 0; i < 900; i++) differ += q.x[i] != optimum[i];
            if (frame) unforced += differ / 900.0;
            memcpy(optimum, q.x, 900 * sizeof(int));
            start = bench_clock();
            run_lapjv(&q);
            t_lapjv = bench_clock() - start;
            if (!frame) continue;
            worse += (best - q.optimum) / q.optimum;
            ratios[n] = t_warm / t_cold;
            lapjv[n++] = t_warm / t_lapjv;
        }
        bench_row("%g\t%g\t%.3g\t%.3g\t%.3g\t%.3g\t%.3g\t%.3g\t%.3g\t%d", steps[m], bonuses[b], support_median(ratios, n), support_median(lapjv, n), changed / n, unforced / n,
                  worse / n, gap / n, finished / n, b == 0);
        softassign_destroy(warm);
        close_instance(&q);
        free(made);
        free(previous);
        free(optimum);
    }
    if (picture) image_free(picture);
}

/* ---- stability: temperatures down to 1e-12 ---- */

static void table_temperatures(void)
{
    static const double temperatures[] = {1, 1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-9, 1e-12};
    instance q;
    size_t k;
    bench_table("Cold softassign: the bound of ENTROPIC at one temperature, 60 sweeps (times the mean row minimum)",
                "temperature\tbound_below_optimum\texcess\tcolumn_sum_max\tdefault");
    bench_plot("Bound below the optimum against temperature; x=temperature; y=bound_below_optimum; log=xy; style=linespoints");
    open_instance(&q, "fig_bowl", 20, 20, 1500, 1);
    run_lapjv(&q);
    for (k = 0; k < 8; k++) {
        double optimum = q.optimum;
        set_method(&q, SOFTASSIGN_ENTROPIC);
        q.options.temperature = temperatures[k];
        q.options.iterations[0] = 1;
        q.options.iterations[1] = 60;
        run_solver(&q);
        bench_row("%g\t%.3g\t%.3g\t%.3g\t%d", temperatures[k], (optimum - q.report.lower_bound) / optimum, excess(&q), q.report.column_sum_max, 0);
    }
    close_instance(&q);
}

/* ---- the published schedule ---- */

static void table_published(void)
{
    static const double outliers[] = {1e-3, 1, 1e3, 1e6, 1e9};
    static const double alphas[] = {0.3, 1, 1.5};
    instance q;
    size_t o, a;
    int evolves, wide, gold;
    bench_table("The published method's parameters, 100 x 500", "alpha\toutlier\tevolves\tdouble\tgold\texcess\tduplicate_rows\tcolumn_sum_max\tdefault");
    open_instance(&q, "fig_bowl", 10, 10, bench_smoke() ? 100 : 500, 1);
    run_lapjv(&q);
    for (a = 0; a < 3; a++)
        for (o = 0; o < 5; o++)
            for (evolves = 0; evolves < 2; evolves++)
                for (wide = 0; wide < 3; wide++) { /* float, double, and Gold's update in float */
                    if (bench_quick() && ((bench_smoke() && o < 3) || wide || evolves || a != 1 || o % 2 == 0))
                        continue;
                    gold = wide == 2;
                    set_method(&q, SOFTASSIGN_PUBLISHED);
                    q.options.alpha = alphas[a];
                    q.options.outlier = outliers[o];
                    q.options.outlier_evolves = evolves;
                    q.options.double_precision = wide == 1;
                    q.options.gold = gold;
                    run_solver(&q);
                    bench_row("%g\t%g\t%d\t%d\t%d\t%.4f\t%d\t%.3g\t%d", alphas[a], outliers[o], evolves, wide == 1, gold, excess(&q), q.report.duplicate_rows,
                              q.report.column_sum_max, alphas[a] == 1 && outliers[o] == 1e6 && !evolves && !wide);
                }
    close_instance(&q);
}

int main(int argc, char **argv)
{
    static void (*const tables[])(void) = {table_peers,        table_dense, table_matrices, table_ways,  table_forms,
                                           table_error_time,   table_3_1,   table_3_2,      table_lists, table_large,
                                           table_video,        table_temperatures,          table_published};
    static const char *const names[] = {"peers", "dense", "matrices", "ways",         "forms",    "error", "3_1",
                                        "3_2",   "lists", "large",    "video", "temperatures", "published"};
    size_t k;
    bench_start("softassign.h");
    load_tiles();
    printf("# input: %s\n",
           real_data ? "photographs and tiles" : "made here, for want of ../shared/data or libstb-dev");
    for (k = 0; k < sizeof tables / sizeof *tables; k++)
        if (argc < 2 || strcmp(argv[1], names[k]) == 0) tables[k]();
    free(all_tiles);
    return 0;
}
