/* Tables on the GPU: the times of Slomp 2012, table 4.1, in its shape, with errors; formats, compute shaders, lookups.
   LIGHTSCAN_GL=egl for the GPU, OSMesa otherwise (then with the smaller sizes only). */

#define SAT_IMPLEMENTATION
#define SAT_GL
#include "sat.h"
#include "bench.h"
#include "gpu.h"

static gl_context context;
static sat__gl gpu;
static gpu_clock timer;
static int software;

/* ---- pictures and exact sums ---- */

typedef struct picture {
    int width, height;
    float *pixels;
    double *sums;       /* (width + 1) x (height + 1); pixels are multiples of 2^-20 or so: good to 1e-12 */
    unsigned texture;
} picture;

static picture make_picture(int width, int height, int hdr)
{
    picture p;
    uint64_t seed = 1;
    size_t n = (size_t)width * (size_t)height, i;
    size_t w = (size_t)width + 1;
    int x, y;
    sat__gl_state state;
    p.width = width;
    p.height = height;
    p.pixels = (float *)malloc(n * sizeof *p.pixels);
    p.sums = (double *)calloc(w * ((size_t)height + 1), sizeof *p.sums);
    if (!p.pixels || !p.sums) exit(1);
    if (hdr) support_hdr_image(p.pixels, width, height, 1, 1);
    else
        for (i = 0; i < n; i++) p.pixels[i] = (float)support_uniform(&seed);
    for (y = 0; y < height; y++) {
        double run = 0;
        for (x = 0; x < width; x++) {
            run += (double)p.pixels[(size_t)y * (size_t)width + (size_t)x];
            p.sums[((size_t)y + 1) * w + (size_t)x + 1] = p.sums[(size_t)y * w + (size_t)x + 1] + run;
        }
    }
    sat__gl_begin(&gpu, &state, 1);
    if (sat__gl_texture(&gpu, &p.texture, SAT__GL_R32F, width, height, p.pixels) != SAT_OK) puts(gpu.message);
    sat__gl_end(&gpu, &state);
    return p;
}

static void free_picture(picture *p)
{
    gpu.DeleteTextures(1, &p->texture);
    free(p->pixels);
    free(p->sums);
}

/* ---- time ---- */

typedef struct work {
    sat_gl *gl;
    unsigned texture;
    int width, height, mean;
} work;

static void run_work(const work *w)
{
    sat_result result = w->mean ? sat_gl_mean(w->gl, NULL, w->texture, w->width, w->height)
                                : sat_gl_build(w->gl, 0, w->texture, w->width, w->height);
    if (result != SAT_OK) {
        printf("# %s: %s\n", sat_result_text(result), sat_gl_message(w->gl));
        exit(1);
    }
}

/* Milliseconds of one call: median of several measurements of several calls each. */
static double milliseconds(const work *w)
{
    double t[9];
    int i, j, rounds = software ? 3 : 9, repeat = software ? 1 : 10;
    run_work(w);
    run_work(w);
    for (i = 0; i < rounds; i++) {
        gpu_begin(&timer);
        for (j = 0; j < repeat; j++) run_work(w);
        t[i] = 1e3 * gpu_end(&timer) / repeat;
    }
    return support_median(t, rounds);
}

/* ---- errors ---- */

static double table_entry(const float *table, sat_gl_format format, double quantum, const picture *p, int x, int y)
{
    size_t i = (size_t)(y - 1) * (size_t)p->width + (size_t)(x - 1);
    (void)quantum;
    if (x < 1 || y < 1) return 0;
    return format == SAT_GL_TWO_FLOAT ? (double)table[2 * i] + (double)table[2 * i + 1] : (double)table[i];
}

static double box_sum(const float *table, sat_gl_format format, double quantum, const picture *p, const int *b)
{
    if (format == SAT_GL_FIXED32) {
        uint32_t sum = 0, v;
        int corner;
        for (corner = 0; corner < 4; corner++) {
            int x = corner & 1 ? b[2] : b[0], y = corner & 2 ? b[3] : b[1];
            if (x < 1 || y < 1) continue;
            memcpy(&v, table + (size_t)(y - 1) * (size_t)p->width + (size_t)(x - 1), sizeof v);
            sum += corner == 0 || corner == 3 ? v : 0u - v;
        }
        return (double)(int32_t)sum * quantum;
    }
    return table_entry(table, format, quantum, p, b[2], b[3]) - table_entry(table, format, quantum, p, b[2], b[1]) -
           table_entry(table, format, quantum, p, b[0], b[3]) + table_entry(table, format, quantum, p, b[0], b[1]);
}

/* Median relative error of the sums of boxes of side x side pixels. */
static double median_error(sat_gl *gl, sat_gl_format format, const picture *p, int side)
{
    static double errors[4000];
    size_t n = (size_t)p->width * (size_t)p->height, w = (size_t)p->width + 1;
    float *table = (float *)malloc(n * 2 * sizeof *table);
    uint64_t seed = 5;
    sat__gl_state state;
    int i;
    sat__gl_begin(&gpu, &state, 1);
    if (!table || sat__gl_read(&gpu, table, sat_gl_table(gl), sat__gl_internal(format), p->width, p->height) != SAT_OK)
        exit(1);
    sat__gl_end(&gpu, &state);
    for (i = 0; i < 4000; i++) {
        int b[4];
        double exact, sum;
        b[0] = support_below(&seed, p->width - side + 1);
        b[1] = support_below(&seed, p->height - side + 1);
        b[2] = b[0] + side;
        b[3] = b[1] + side;
        exact = p->sums[(size_t)b[3] * w + (size_t)b[2]] - p->sums[(size_t)b[1] * w + (size_t)b[2]] -
                p->sums[(size_t)b[3] * w + (size_t)b[0]] + p->sums[(size_t)b[1] * w + (size_t)b[0]];
        sum = box_sum(table, format, sat_gl_quantum(gl), p, b);
        errors[i] = fabs(sum - exact) / exact;
    }
    free(table);
    return support_median(errors, 4000);
}

/* The same by the box filter of a tiled table: float means. */
static double median_error_tiled(sat_gl *gl, const picture *p, int side)
{
    static double errors[4000];
    size_t n = (size_t)p->width * (size_t)p->height, w = (size_t)p->width + 1;
    float *means = (float *)malloc(n * sizeof *means);
    unsigned target = 0;
    uint64_t seed = 5;
    sat__gl_state state;
    int i;
    sat__gl_begin(&gpu, &state, 1);
    if (!means || sat__gl_texture(&gpu, &target, SAT__GL_R32F, p->width, p->height, NULL) != SAT_OK) exit(1);
    sat__gl_end(&gpu, &state);
    if (sat_gl_box_filter(gl, target, side / 2) != SAT_OK) exit(1);
    sat__gl_begin(&gpu, &state, 1);
    if (sat__gl_read(&gpu, means, target, SAT__GL_R32F, p->width, p->height) != SAT_OK) exit(1);
    sat__gl_end(&gpu, &state);
    for (i = 0; i < 4000; i++) {
        int x = support_below(&seed, p->width - side + 1), y = support_below(&seed, p->height - side + 1);
        size_t low = (size_t)y * w + (size_t)x, high = low + (size_t)side * w;
        double exact = p->sums[high + (size_t)side] - p->sums[low + (size_t)side] - p->sums[high] + p->sums[low];
        double sum = (double)means[(size_t)(y + side / 2) * (size_t)p->width + (size_t)(x + side / 2)] * side * side;
        errors[i] = fabs(sum - exact) / exact;
    }
    gpu.DeleteTextures(1, &target);
    free(means);
    return support_median(errors, 4000);
}

static double error_of(sat_gl *gl, const picture *p, int side)
{
    return gl->options.format == SAT_GL_TILED ? median_error_tiled(gl, p, side)
                                              : median_error(gl, gl->options.format, p, side);
}

/* ---- tables ---- */

static sat_gl *make(sat_gl_format format, sat_scan_algorithm algorithm, int k, int compute)
{
    sat_gl_options options = sat_gl_defaults();
    sat_gl *gl = NULL;
    options.format = format;
    options.algorithm = algorithm;
    options.k = k;
    options.compute = compute;
    if (format == SAT_GL_FIXED32) {
        options.max_value = 1;
        options.max_box_area = 201 * 201;
    }
    if (sat_gl_create(&gl, context.get_proc, &options) != SAT_OK) {
        printf("# %s\n", sat_gl_message(gl));
        exit(1);
    }
    return gl;
}

/* Time of a build, and the error when asked for. */
static double measure(sat_gl *gl, const picture *p, double *error, int side)
{
    work w;
    double ms;
    memset(&w, 0, sizeof w);
    w.gl = gl;
    w.texture = p->texture;
    w.width = p->width;
    w.height = p->height;
    ms = milliseconds(&w);
    if (error) *error = error_of(gl, p, side);
    return ms;
}

/* The same with an object of its own; 0 where compute shaders are asked for and missing. */
static double measure_new(sat_gl_format format, int k, int compute, const picture *p)
{
    sat_gl *gl;
    double ms;
    if (compute && !gpu.has_compute) return 0;
    gl = make(format, SAT_SCAN_BALANCED_TREE, k, compute);
    ms = measure(gl, p, NULL, 0);
    sat_gl_destroy(gl);
    return ms;
}

static void published_table(int sizes)
{
    static const int size[15][2] = {{256, 256},   {512, 512},   {720, 480},   {800, 600},   {1024, 768},
                                    {1280, 720},  {1024, 1024}, {1280, 1024}, {1680, 1050}, {1920, 1080},
                                    {1920, 1200}, {2048, 1280}, {2048, 1536}, {2560, 1440}, {2048, 2048}};
    static const int ks[4] = {2, 4, 6, 8};
    sat_gl *objects[4][3];
    int i, j;
    bench_table("Generation of a table on the GPU, R32F (Slomp 2012, table 4.1)",
                "number\twidth\theight\tk\tRD_ms\tBT_ms\tRD_BT_ratio\tcompute_ms\tRD_error\tBT_error");
    bench_plot("Recursive doubling and balanced tree; x=number; y=RD_BT_ratio; by=k; style=linespoints");
    bench_note("RD recursive doubling, BT balanced tree, compute: the tree with a compute shader for the way down;"
               " errors: median relative error of 11 x 11 box sums, pixels uniform in [0, 1]");
    for (j = 0; j < 4; j++) {
        objects[j][0] = make(SAT_GL_FLOAT, SAT_SCAN_RECURSIVE_DOUBLING, ks[j], 0);
        objects[j][1] = make(SAT_GL_FLOAT, SAT_SCAN_BALANCED_TREE, ks[j], 0);
        objects[j][2] = make(SAT_GL_FLOAT, SAT_SCAN_BALANCED_TREE, ks[j], 1);
    }
    for (i = 0; i < sizes; i++) {
        picture p = make_picture(size[i][0], size[i][1], 0);
        for (j = 0; j < 4; j++) {
            double error[2], rd = measure(objects[j][0], &p, &error[0], 11),
                             bt = measure(objects[j][1], &p, &error[1], 11);
            double compute = gpu.has_compute ? measure(objects[j][2], &p, NULL, 0) : 0;
            bench_row("%d\t%d\t%d\t%d\t%.3f\t%.3f\t%.2f\t%.3f\t%.2g\t%.2g", i + 1, p.width, p.height, ks[j], rd, bt, rd / bt, compute, error[0], error[1]);
        }
        free_picture(&p);
    }
    for (j = 0; j < 12; j++) sat_gl_destroy(objects[j / 3][j % 3]);
}

static void compute_table(int side)
{
    static const int ks[] = {2, 4, 8, 16, 32, 64};
    picture p = make_picture(side, side, 0);
    double best = measure_new(SAT_GL_FLOAT, 4, 0, &p);
    int i;
    bench_table("Fragment passes against compute shaders, balanced tree, R32F", "side\tk\tfragment_ms\tcompute_ms\tfragment4_compute_ratio");
    bench_note("the ratio is to fragment passes with k = 4");
    for (i = 0; i < 6; i++) {
        double fragment = measure_new(SAT_GL_FLOAT, ks[i], 0, &p), compute = measure_new(SAT_GL_FLOAT, ks[i], 1, &p);
        bench_row("%d\t%d\t%.3f\t%.3f\t%.2f", side, ks[i], fragment, compute, compute > 0 ? best / compute : 0);
    }
    free_picture(&p);
}

static void format_table(int side)
{
    static const char *const names[] = {"two-float", "float", "fixed32", "tiled"};
    static const double bytes[] = {8, 4, 4, 4.3};
    picture uniform = make_picture(side, side, 0), hdr = make_picture(side, side, 1);
    int format;
    bench_table("Formats: error against time, balanced tree, k = 4 (tiled: its own passes); compute shaders, k = 64 (tiled: a group a tile)",
                "format\tside\tbytes_per_pixel\tms\tcompute_ms\tuniform_3\tuniform_41\thdr_3\thdr_41\tdefault");
    bench_plot("Error against time; x=ms; y=uniform_3; by=format; log=xy");
    bench_note("median relative errors of 3 x 3 and 41 x 41 box sums; hdr spans 14 decades, which fixed32 (made for [0, 1]) clamps");
    for (format = 0; format < 4; format++) {
        sat_gl *gl = make((sat_gl_format)format, SAT_SCAN_BALANCED_TREE, 4, 0);
        double e[4], ms = measure(gl, &uniform, &e[0], 3),
                     compute = measure_new((sat_gl_format)format, 64, 1, &uniform);
        e[1] = error_of(gl, &uniform, 41);
        measure(gl, &hdr, &e[2], 3);
        e[3] = error_of(gl, &hdr, 41);
        sat_gl_destroy(gl);
        bench_row("%s\t%d\t%.1f\t%.3f\t%s\t%.2g\t%.2g\t%.2g\t%.2g\t%d", names[format], side, bytes[format], ms,
                  bench_cell(compute, 4, compute > 0), e[0], e[1], e[2], e[3], format == SAT_GL_TILED);
    }
    free_picture(&uniform);
    free_picture(&hdr);
}

static void mean_table(int side)
{
    static const int ks[] = {2, 4, 8};
    picture p = make_picture(side, side, 0);
    int i;
    bench_table("Mean by reduction", "side\tk\tms\trelative_error");
    for (i = 0; i < 3; i++) {
        double exact = p.sums[((size_t)side + 1) * ((size_t)side + 1) - 1] / ((double)side * side), ms;
        float mean = 0;
        work w;
        memset(&w, 0, sizeof w);
        w.gl = make(SAT_GL_FLOAT, SAT_SCAN_BALANCED_TREE, ks[i], 0);
        w.texture = p.texture;
        w.width = w.height = side;
        w.mean = 1;
        ms = milliseconds(&w);
        if (sat_gl_mean(w.gl, &mean, p.texture, side, side) != SAT_OK) exit(1);
        bench_row("%d\t%d\t%.3f\t%.2g", side, ks[i], ms, fabs((double)mean - exact) / exact);
        sat_gl_destroy(w.gl);
    }
    free_picture(&p);
}

int main(void)
{
    if (!gl_context_open(&context, 4, 3) && !gl_context_open(&context, 3, 3)) {
        printf("skip: %s\n", context.message);
        return 0;
    }
    if (sat__gl_open(&gpu, context.get_proc) != SAT_OK) {
        printf("skip: %s\n", gpu.message);
        return 0;
    }
    timer = gpu_clock_of(&context);
    software = gpu_is_software(&context);
    bench_start("sat.h on the GPU");
    printf("# renderer: %s\n# time: %s\n", gl_context_renderer(&context),
           timer.has_queries ? "timer queries" : "clock between two glFinish");
    published_table(bench_quick() ? 2 : software ? 4 : 15);
    compute_table(software || bench_quick() ? 512 : 2048);
    format_table(software || bench_quick() ? 512 : 2048);
    mean_table(software || bench_quick() ? 512 : 2048);
    if (!software && !bench_quick()) {
        compute_table(4096);
        format_table(4096);
    }
    sat__gl_close(&gpu);
    gl_context_close(&context);
    return 0;
}
