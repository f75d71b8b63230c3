/* bench.h - benchmark tables: error against run time, as tab-separated values.
   SPDX-License-Identifier: MIT-0 OR Unlicense

   A benchmark prints one or more tables on stdout; `make bench` keeps them in out/bench/<lib>.tsv, `make report`
   turns each into a table and its plots. The form:

       # table: Box sums against the exact ones           a title starts a table
       # plot: Error against time; x=time_ratio; y=error; by=kind; log=xy     any number of plots of this table
       # note: one sentence under the table
       kind    size    time_ratio    error    default   the names of the columns, units in the name (_ms, _mb, _ratio)
       tiled   64      1.02          3e-7     1            one row a configuration; default = 1 marks the default
       (an empty line, or the next title, ends the table)

   plot keys: x, y (columns); by (one colour per value of this column); where (only these rows, as in
   where=picture:14 decades,radius:1); log (x, y or xy); style (points, lines or linespoints; points unless told);
   picture (the name under which `make docs` keeps the plot for README.md).
   Times are ratios to a reference in the same run wherever the machine matters: bench_ratio runs A B A B ...

       bench_start("sat.h");
       bench_table("Box sums", "kind\ttime_ratio\terror\tdefault");
       bench_plot("Error against time; x=time_ratio; y=error; log=xy");
       bench_row("%s\t%.3g\t%.3g\t%d", "tiled", ratio, error, 1);

   QUICK=1 in the environment asks for a short run: bench_quick(); what takes longer than BENCH_LONG is then run twice,
   and the second time counts. SMOKE=1 asks for the shortest that shows every table once: bench_smoke(), and
   bench_quick() too; every call is made once, and the figures say nothing.

   A picture of a table, the reference or where a method errs, is bench_picture after bench_table: report.sh puts it
   into the page. The form: "# picture: FILE; caption; scale; low; high", FILE beside the tables in pictures/.

   A peer that is not installed loses only its own cells: bench_missing("OpenCV", "libopencv-dev") after bench_table says
   so, bench_cell(value, have_it) makes "-" of them, and the report leaves out a column that has nothing else. */

#ifndef BENCH_H
#define BENCH_H

#include <stdarg.h>
#include "support.h"
#include "png.h"

static inline int bench_set(const char *name)
{
    const char *value = getenv(name);
    return value && *value && strcmp(value, "0") != 0;
}

static inline int bench_smoke(void) { return bench_set("SMOKE"); }
static inline int bench_quick(void) { return bench_set("QUICK") || bench_smoke(); }

/* Full rounds, or what a short run affords. BENCH_LONG: seconds of a call that a short run repeats no more. */
#define BENCH_LONG 0.02
static inline int bench_rounds(int full) { return bench_smoke() ? 1 : bench_quick() && full > 3 ? 3 : full; }

/* Name of the processor, compiler and instruction set as a comment line. */
static inline void bench_start(const char *header)
{
    char line[256] = "", *colon = NULL;
    FILE *info = fopen("/proc/cpuinfo", "r");
    while (info && fgets(line, sizeof line, info))
        if (strncmp(line, "model name", 10) == 0 && (colon = strchr(line, ':')) != NULL) break;
    if (info) fclose(info);
    if (colon) colon[strcspn(colon, "\n")] = 0;
    printf("# bench: %s\n# machine: %s; "
#if defined(__clang__)
           "clang " __clang_version__
#elif defined(__GNUC__)
           "gcc " __VERSION__
#else
           "unknown compiler"
#endif
#if defined(__AVX2__)
           ", AVX2"
#elif defined(__SSE2__)
           ", SSE2"
#elif defined(__ARM_NEON)
           ", NEON"
#endif
           "\n", header, colon ? colon + 2 : "unknown processor");
}

/* Starts a table: title, and the names of the columns separated by tabs. Plots and notes may follow before the rows. */
static const char *bench_columns;

static inline void bench_table(const char *title, const char *columns)
{
    printf("\n# table: %s\n", title);
    bench_columns = columns;
}

static inline void bench_plot(const char *plot) { printf("# plot: %s\n", plot); }
static inline void bench_note(const char *note) { printf("# note: %s\n", note); }

/* A peer that is not here, by name and package: rows or columns of this table are left out. */
static inline void bench_missing(const char *peer, const char *package)
{
    printf("# missing: %s is not installed (%s): its rows or columns are left out\n", peer, package);
}

/* A number for a cell, or "-" where there is none. The text stays for the next seven calls. */
static inline const char *bench_cell(double value, int digits, int there)
{
    static char text[8][32];
    static int turn;
    turn = (turn + 1) % 8;
    snprintf(text[turn], sizeof text[0], there ? "%.*g" : "-", digits, value);
    return text[turn];
}

#if defined(__GNUC__)
__attribute__((format(printf, 1, 2)))
#endif
static inline void bench_row(const char *format, ...)
{
    va_list arguments;
    if (bench_columns) printf("%s\n", bench_columns);
    bench_columns = NULL;
    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
    putchar('\n');
    fflush(stdout);
}

/* The colour of v in 0..1. BENCH_GREY: black to white; BENCH_HEAT: white, yellow, red, black; BENCH_SIGNED: blue, white
   at one half, red. */
typedef enum bench_scale { BENCH_GREY, BENCH_HEAT, BENCH_SIGNED } bench_scale;

static inline void bench_colour(unsigned char *rgb, double v, bench_scale scale)
{
    static const double stops[3][5][3] = {
        {{0, 0, 0}, {64, 64, 64}, {128, 128, 128}, {191, 191, 191}, {255, 255, 255}},
        {{255, 255, 255}, {255, 230, 120}, {240, 120, 30}, {180, 20, 30}, {30, 0, 20}},
        {{20, 40, 150}, {110, 160, 230}, {255, 255, 255}, {240, 140, 100}, {150, 10, 30}}};
    const double(*s)[3] = stops[scale];
    double at = v > 0 ? (v < 1 ? 4 * v : 4) : 0;
    int i = at < 3 ? (int)at : 3, k;
    for (k = 0; k < 3; ++k)
        rgb[k] = (unsigned char)(s[i][k] + (at - i) * (s[i + 1][k] - s[i][k]) + 0.5);
}

/* A picture of one value a pixel, low to high along the scale, for the report: into BENCH_PICTURES, nothing without it.
   Large ones are reduced to means of k x k pixels; the caption says so. */
static inline void bench_picture(const char *name, const char *caption, const float *values, int width, int height,
                                 bench_scale scale, double low, double high)
{
    enum { MOST = 240 };
    static const char *const scales[3] = {"grey", "heat", "signed"};
    const char *folder = getenv("BENCH_PICTURES");
    int k = ((width > height ? width : height) + MOST - 1) / MOST, w = width / k, h = height / k, x, y, i, j;
    unsigned char *rgb = folder && *folder ? (unsigned char *)malloc((size_t)w * (size_t)h * 3) : NULL;
    char path[1024], means[48] = "";
    if (!rgb) return;
    for (y = 0; y < h; ++y)
        for (x = 0; x < w; ++x) {
            double sum = 0;
            for (i = 0; i < k; ++i)
                for (j = 0; j < k; ++j) sum += (double)values[(y * k + i) * width + x * k + j];
            bench_colour(rgb + 3 * ((size_t)y * (size_t)w + (size_t)x), (sum / (k * k) - low) / (high - low), scale);
        }
    snprintf(path, sizeof path, "%s/%s.png", folder, name);
    if (k > 1) snprintf(means, sizeof means, " (means of %d x %d pixels)", k, k);
    if (png_save(path, rgb, w, h, 3))
        printf("# picture: %s.png; %s%s; %s; %g; %g\n", name, caption, means, scales[scale], low, high);
    free(rgb);
}

/* Seconds that this thread has computed: other programs on the machine count less than by the wall clock. Work that
   starts threads must be timed by support_clock instead. */
static inline double bench_clock(void)
{
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* A piece of work to be timed. */
typedef void bench_fn(void *user);

typedef struct bench_times {
    double ratio;          /* median of time(work) / time(peer), run by run */
    double work, peer;     /* median seconds of one call */
} bench_times;

/* Runs A B A B ... (`rounds` pairs, at most 64, after one warm-up each, two in a full run). A call shorter than a
   millisecond is repeated inside the pair until it is not. */
static inline bench_times bench_ratio(bench_fn *work, void *work_user, bench_fn *peer, void *peer_user, int rounds)
{
    double ratios[64], a[64], b[64], t0, t1, t2;
    bench_times result;
    int i, k, repeat[2] = {1, 1};
    if (rounds < 1) rounds = 1;
    if (rounds > 64) rounds = 64;
    if (!bench_quick()) {
        work(work_user);
        peer(peer_user);
    }
    t0 = bench_clock();
    work(work_user);
    t1 = bench_clock();
    peer(peer_user);
    t2 = bench_clock();
    a[0] = t1 - t0;
    b[0] = t2 - t1;
    ratios[0] = a[0] / b[0];
    if (bench_quick() && a[0] + b[0] > 2 * BENCH_LONG) rounds = 1;
    if (a[0] < 1e-3) repeat[0] = 1 + (int)(1e-3 / (a[0] + 1e-8));
    if (b[0] < 1e-3) repeat[1] = 1 + (int)(1e-3 / (b[0] + 1e-8));
    for (i = 0; i < rounds && !bench_smoke(); ++i) {
        t0 = bench_clock();
        for (k = 0; k < repeat[0]; ++k) work(work_user);
        t1 = bench_clock();
        for (k = 0; k < repeat[1]; ++k) peer(peer_user);
        t2 = bench_clock();
        a[i] = (t1 - t0) / repeat[0];
        b[i] = (t2 - t1) / repeat[1];
        ratios[i] = a[i] / b[i];
    }
    if (bench_smoke()) rounds = 1;
    result.ratio = support_median(ratios, rounds);
    result.work = support_median(a, rounds);
    result.peer = support_median(b, rounds);
    return result;
}

/* Median seconds of one call. */
static inline double bench_time(bench_fn *work, void *user, int rounds)
{
    double t[64], start = bench_clock();
    int i;
    if (rounds < 1) rounds = 1;
    if (rounds > 64) rounds = 64;
    work(user);
    t[0] = bench_clock() - start;
    if (bench_quick() && t[0] > BENCH_LONG) rounds = 1;
    for (i = 0; i < rounds && !bench_smoke(); ++i) {
        start = bench_clock();
        work(user);
        t[i] = bench_clock() - start;
    }
    return support_median(t, bench_smoke() ? 1 : rounds);
}

#endif /* BENCH_H */
