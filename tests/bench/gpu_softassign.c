/* The matrix methods on the GPU: Slomp 2012, table 3.2, in its shape, and the entropic sweep beside them.
   LIGHTSCAN_GL=egl for the GPU, OSMesa otherwise (then with the smaller sizes only). */

#define SAT_IMPLEMENTATION
#define SOFTASSIGN_IMPLEMENTATION
#define SOFTASSIGN_GL
#include "softassign.h"
#include "bench.h"
#include "gpu.h"

enum { FEATURES = 48 };

static gl_context context;
static sat__gl gpu;
static gpu_clock timer;
static int software;

/* Patches of few levels, tiles of all: the kind of photographs, and the same everywhere. */
static float *make_features(int count, int levels, uint64_t seed)
{
    float *out = (float *)malloc((size_t)count * FEATURES * sizeof *out);
    int i, k;
    if (!out) exit(1);
    for (i = 0; i < count; i++) {
        double r = support_uniform(&seed), level = levels ? 255 * floor(r * levels) / levels : 255 * r,
               slope = support_gaussian(&seed);
        for (k = 0; k < FEATURES; k++)
            out[i * FEATURES + k] = (float)(level + 8 * slope * (k / 3 % 4) + 6 * support_gaussian(&seed));
    }
    return out;
}

typedef struct run {
    softassign_gl *gl;
    float *price;
    int sweeps;
} run;

static void check(const run *r, sat_result result)
{
    if (result == SAT_OK) return;
    printf("# %s: %s\n", sat_result_text(result), softassign_gl_message(r->gl));
    exit(1);
}

static void one_cooling(const run *r) { check(r, softassign_gl_published(r->gl, NULL, 0, NULL)); }
static void sweeps(const run *r) { check(r, softassign_gl_sweep(r->gl, r->price, NULL, 10, r->sweeps)); }

/* Seconds of work that ends with a transfer and so waits for the GPU: median, after one warm-up. */
static double seconds_of(void (*work)(const run *r), const run *r, int rounds)
{
    double t[9], start;
    int i;
    work(r);
    for (i = 0; i < rounds; i++) {
        timer.finish();
        start = support_clock();
        work(r);
        timer.finish();
        t[i] = support_clock() - start;
    }
    return support_median(t, rounds);
}

int main(void)
{
    static const int sizes[][2] = {{100, 100},   {100, 500},   {400, 1500},  {512, 2048},  {900, 3000},
                                   {1024, 4096}, {1200, 5000}, {1600, 6000}, {1800, 7000}, {2048, 8192}};
    static const double thesis[][3] = {
        {.024, .022, .022},   {.114, .062, .023},   {1.506, .780, .035},  {2.572, 1.479, .052}, {6.485, 3.912, .114},
        {10.01, 5.963, .171}, {14.29, 8.532, .239}, {22.73, 13.85, .374}, {29.82, 17.78, .487}, {39.77, 23.62, .643}};
    static const int gathers[] = {4, 8, 16, 32};
    float *patches = make_features(2048, 12, 1), *tiles = make_features(8192, 0, 2);
    size_t k, g;
    if (!gl_context_open(&context, 3, 3)) {
        puts(context.message);
        return 0;
    }
    if (sat__gl_open(&gpu, context.get_proc) != SAT_OK) return 1;
    timer = gpu_clock_of(&context);
    software = gpu_is_software(&context) ||
               bench_quick();
    bench_start("softassign.h on the GPU");
    printf("# renderer: %s\n", gl_context_renderer(&context));
    bench_table("Slomp 2012, table 3.2: seconds for one temperature of 10 stabilisations of 10 Sinkhorn iterations",
                "rows\tcolumns\tgather\tpublished_s\tthesis_gpu_s\tthesis_cpu_x1_s\tdistances_and_start_s\tentropic_sweep_ms\tdefault");
    bench_note("published_s holds the upload of the random start; entropic_sweep_ms is one fused sweep of min, exp, sums and prices");
    for (k = 0; k < sizeof sizes / sizeof *sizes; k++)
        for (g = 0; g < 4; g++) {
            softassign_options o = softassign_method_defaults(SOFTASSIGN_PUBLISHED);
            softassign_problem p;
            run r;
            double full, start, few, many;
            if (software && (k > 1 || (g != 0 && g != 2))) continue;
            memset(&p, 0, sizeof p);
            p.rows = sizes[k][0];
            p.columns = sizes[k][1];
            p.row_features = patches;
            p.column_features = tiles;
            p.feature_count = FEATURES;
            o.iterations[0] = 1;
            o.gather = gathers[g];
            r.price = (float *)calloc((size_t)p.columns, sizeof(float));
            check(&r, softassign_gl_create(&r.gl, context.get_proc, &o));
            start = support_clock();
            check(&r, softassign_gl_set_costs(r.gl, &p));
            timer.finish();
            start = support_clock() - start;
            full = seconds_of(one_cooling, &r, software ? 1 : 5);
            r.sweeps = 1;
            few = seconds_of(sweeps, &r, software ? 1 : 5);
            r.sweeps = 11;
            many = seconds_of(sweeps, &r, software ? 1 : 5);
            bench_row("%d\t%d\t%d\t%.4g\t%g\t%g\t%.4g\t%.4g\t%d", p.rows, p.columns, gathers[g], full, thesis[k][2], thesis[k][0], start,
                      (many - few) * 100, gathers[g] == 4);
            softassign_gl_destroy(r.gl);
            free(r.price);
        }
    free(patches);
    free(tiles);
    sat__gl_close(&gpu);
    gl_context_close(&context);
    return 0;
}
