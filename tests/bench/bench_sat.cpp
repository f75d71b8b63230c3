/* Benchmarks of sat.h: build time against memcpy and cv::integral, precision against exact sums, lookups, updates,
   bounds, k-ary scans. References are long double sums over the pixels of each box. */
#define SAT_IMPLEMENTATION
#include "sat.h"
#include "bench.h"
#ifdef HAVE_OPENCV
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#endif

static const char *const kind_names[] = {"tiled", "float", "double", "fixed32"};

/* ---- pictures: constant, uniform, 14 decades in patches of 128 pixels, uniform with one pixel of 1e8 */

enum { CONSTANT, UNIFORM, HDR14, SPIKE, PICTURES };
static const char *const picture_names[] = {"constant", "uniform", "14 decades", "spike 1e8"};

static void make_picture(float *p, int n, int which)
{
    uint64_t state = 88172645463325252u;
    int cells = n / 128 + 2, x, y;
    float *grid = (float *)malloc((size_t)cells * (size_t)cells * sizeof(float));
    for (x = 0; x < cells * cells; x++) grid[x] = (float)(1 + 2.4 * support_gaussian(&state));
    for (y = 0; y < n; y++)
        for (x = 0; x < n; x++) {
            float *out = p + (size_t)y * (size_t)n + (size_t)x;
            const float *g = grid + (size_t)(y / 128) * (size_t)cells + (size_t)(x / 128);
            double fx = x % 128 / 128.0, fy = y % 128 / 128.0;
            if (which == HDR14) {
                double level = (1 - fy) * ((1 - fx) * (double)g[0] + fx * (double)g[1]) +
                               fy * ((1 - fx) * (double)g[cells] + fx * (double)g[cells + 1]);
                double light = pow(10, level * 1.3 + 0.15 * support_gaussian(&state));
                *out = (float)(light < 1e-6 ? 1e-6 : light > 1e8 ? 1e8 : light);
            } else *out = which == CONSTANT ? 1.0f : (float)support_uniform(&state);
        }
    if (which == SPIKE) p[(size_t)(n / 3) * ((size_t)n + 1)] = 1e8f;
    free(grid);
}

#ifndef BENCH_BUILD_ONLY
static double exact_sum(const float *p, int n, int x0, int y0, int x1, int y1)
{
    long double sum = 0;
    for (int y = y0; y < y1; y++)
        for (int x = x0; x < x1; x++) sum += (long double)p[(size_t)y * (size_t)n + (size_t)x];
    return (double)sum;
}
#endif

/* ---- building */

struct copy_work {
    char *to;
    const char *from;
    size_t bytes;
};

static void copy(void *user)
{
    copy_work *w = (copy_work *)user;
    memcpy(w->to, w->from, w->bytes);
}

struct build_work {
    sat_table *table;
    sat_image image;
    int x0, y0, x1, y1;
    void *out;
};

static void build(void *user) { sat_build(((build_work *)user)->table, &((build_work *)user)->image); }

#ifdef HAVE_OPENCV
static void integrate(void *user, int depth)
{
    build_work *w = (build_work *)user;
    cv::Mat in(w->image.height, w->image.width, CV_32F, const_cast<void *>(w->image.pixels));
    cv::Mat out(w->image.height + 1, w->image.width + 1, depth, w->out);
    cv::integral(in, out, depth);
}
static void integrate_f32(void *user) { integrate(user, CV_32F); }
static void integrate_f64(void *user) { integrate(user, CV_64F); }
#endif

static void bench_build(void)
{
    static const int sizes[] = {512, 2048, 4096, 8192};
    bench_table("Build: time against memcpy of the same traffic and against OpenCV", "kind\tside\ttime_memcpy_ratio\topencv_speedup\tbytes_a_pixel\tdefault");
    bench_plot("Build time; x=side; y=time_memcpy_ratio; by=kind; log=x; style=linespoints");
    bench_note("opencv_speedup: time of cv::integral (float or double output) over ours");
#ifndef HAVE_OPENCV
    bench_missing("OpenCV", "libopencv-dev");
#endif
    for (int s = 0; s < (bench_quick() ? 2 : 4); s++) {
        int n = sizes[s];
        size_t pixels = (size_t)n * (size_t)n;
        float *p = (float *)malloc(pixels * 4);
        char *to = (char *)malloc(pixels * 8), *from = (char *)malloc(pixels * 8),
             *out = (char *)malloc(((size_t)n + 1) * ((size_t)n + 1) * 8);
        make_picture(p, n, UNIFORM);
        memset(to, 1, pixels * 8);
        memset(from, 1, pixels * 8);
        for (int k = 0; k < 4; k++) {
            sat_options o = sat_defaults();
            build_work w;
            copy_work c;
            o.kind = (sat_kind)k;
            if (k >= SAT_KIND_FIXED32) o.max_value = 1;
            o.max_box_area = 201 * 201;
            w.image = sat_image_f32(p, n, n, 1);
            w.out = out;
            if (sat_create(&w.table, n, n, 1, &o) != SAT_OK) continue;
            c.to = to;
            c.from = from;
            /* a copy of b bytes moves 2 b: read 4 bytes a pixel, write 4 (4.5, 8) */
            c.bytes = (size_t)((double)pixels *
                               (4 + (k == SAT_KIND_DOUBLE ? 8
                                     : k == SAT_KIND_TILED                         ? 4.5
                                                                                   : 4)) /
                               2);
            double ratio = bench_ratio(build, &w, copy, &c, bench_rounds(n > 5000 ? 7 : 21)).ratio, peer = 0;
#ifdef HAVE_OPENCV
            cv::setNumThreads(1);
            peer = 1 / bench_ratio(build, &w,
                                   k == SAT_KIND_DOUBLE ? integrate_f64 : integrate_f32, &w,
                                   bench_rounds(n > 5000 ? 7 : 21))
                           .ratio;
#endif
            bench_row("%s\t%d\t%.2f\t%s\t%.3f\t%d", kind_names[k], n, ratio, bench_cell(peer, 3, peer > 0), (double)sat_get_stats(w.table).bytes / (double)pixels, k == 0);
            sat_destroy(w.table);
        }
        free(p);
        free(to);
        free(from);
        free(out);
    }
}

#ifndef BENCH_BUILD_ONLY

/* ---- precision */

struct representation {
    const char *name;
    sat_kind kind;
    int tile, subtract_mean;
};

static const representation representations[] = {
    {"float", SAT_KIND_FLOAT, 32, 0},      {"float less mean", SAT_KIND_FLOAT, 32, 1},
    {"tiled 8", SAT_KIND_TILED, 8, 0},     {"tiled 16", SAT_KIND_TILED, 16, 0},
    {"tiled 32", SAT_KIND_TILED, 32, 0},   {"tiled 64", SAT_KIND_TILED, 64, 0},
    {"tiled 128", SAT_KIND_TILED, 128, 0}, {"double", SAT_KIND_DOUBLE, 32, 0},
    {"fixed32", SAT_KIND_FIXED32, 32, 0},
};

enum { BOXES = 5, MOST = 20000 };
static const int box_sides[BOXES] = {1, 3, 11, 41, 201};

static void precision_rows(const float *p, int n, const char *picture, const representation *r)
{
    static double relative[MOST];
    double mean = 0;
    sat_image image = sat_image_f32(p, n, n, 1);
    sat_options o = sat_defaults();
    sat_table *t;
    for (size_t i = 0; i < (size_t)n * (size_t)n; i++) mean += (double)p[i];
    mean /= (double)n * n;
    o.kind = r->kind;
    o.tile = r->tile;
    o.subtract_mean = r->subtract_mean;
    o.max_box_area = 201 * 201;
    if (sat_create(&t, n, n, 1, &o) != SAT_OK) return;
    build_work w;
    copy_work c;
    w.table = t;
    w.image = image;
    c.bytes = (size_t)n * (size_t)n * 4;
    c.from = (const char *)p;
    c.to = (char *)malloc(c.bytes);
    double time = bench_ratio(build, &w, copy, &c, 3).ratio;
    free(c.to);
    for (int b = 0; b < BOXES; b++) {
        uint64_t state = 123456789;
        int side = box_sides[b], count = side > 100 ? 300 : side > 20 ? 4000 : MOST, negative = 0;
        double squares = 0, worst = 0, area = (double)side * side;
        for (int i = 0; i < count; i++) {
            int x = support_below(&state, n - side), y = support_below(&state, n - side);
            double exact = exact_sum(p, n, x, y, x + side, y + side), got = sat_sum(t, 0, x, y, x + side, y + side);
            double error = fabs(got - exact) / area;
            squares += error * error;
            if (error > worst) worst = error;
            relative[i] = error * area / exact;
            negative += got < 0;
        }
        double rms = sqrt(squares / count);
        qsort(relative, (size_t)count, sizeof *relative, support_compare_doubles);
        bench_row("%s\t%s\t%d\t%d\t%.2g\t%.2g\t%.2g\t%.2g\t%.2g\t%.3f\t%.2f\t%d", picture, r->name, n, side, rms / mean,
                  worst / mean, relative[count / 2] + 1e-17, relative[count * 99 / 100] + 1e-17, relative[count - 1],
                  (double)negative / count, time, r->kind == SAT_KIND_TILED && r->tile == sat_defaults().tile);
    }
    sat_destroy(t);
}

/* Where the errors are: boxes of 3 x 3 in the middle of the picture, as powers of ten. */
static void error_pictures(const float *p, int n)
{
    enum { SIDE = 192, BOX = 3 };
    static const struct { const char *name, *caption; int representation; } shown[] = {
        {"sat_float", "a table of floats", 0},
        {"sat_default", "tiles of integers, the default", 5},
        {"sat_double", "a table of doubles", 7}};
    static float values[SIDE * SIDE];
    int first = n / 2 - SIDE / 2;
    for (int i = 0; i < SIDE * SIDE; i++)
        values[i] = log10f(p[(size_t)(first + i / SIDE) * (size_t)n + (size_t)(first + i % SIDE)]);
    bench_picture("sat_truth", "the picture, powers of ten", values, SIDE, SIDE, BENCH_GREY, -3, 5);
    for (int s = 0; s < 3; s++) {
        const representation *r = &representations[shown[s].representation];
        sat_image image = sat_image_f32(p, n, n, 1);
        sat_options o = sat_defaults();
        sat_table *t;
        o.kind = r->kind;
        o.tile = r->tile;
        if (sat_create(&t, n, n, 1, &o) != SAT_OK) continue;
        sat_build(t, &image);
        for (int i = 0; i < SIDE * SIDE; i++) {
            int x = first + i % SIDE, y = first + i / SIDE;
            double exact = exact_sum(p, n, x, y, x + BOX, y + BOX);
            values[i] = (float)log10(fabs(sat_sum(t, 0, x, y, x + BOX, y + BOX) - exact) / exact + 1e-9);
        }
        bench_picture(shown[s].name, shown[s].caption, values, SIDE, SIDE, BENCH_HEAT, -8, 0);
        sat_destroy(t);
    }
}

static void bench_precision(void)
{
    bench_table("Precision: box means against exact sums",
                "picture\trepresentation\tside\tbox\trms_of_mean\tmax_of_mean\tmedian_relative\tp99_relative\tmax_relative\tnegative_share\ttime_memcpy_ratio\tdefault");
    bench_plot("Boxes of 3 x 3 in 14 decades, 2048 x 2048: error against build time; x=time_memcpy_ratio; y=median_relative; by=representation; where=picture:14 decades,box:3,side:2048; log=xy; picture=plot_sat");
    bench_plot("The same against the size of the table; x=side; y=median_relative; by=representation; where=picture:14 decades,box:3; log=xy; style=linespoints");
    bench_plot("Boxes of all sizes in uniform noise; x=time_memcpy_ratio; y=median_relative; by=representation; where=picture:uniform,side:2048; log=xy");
    bench_note("rms and max are of the image's mean; relative errors are of each box's own mean; fixed kinds are given boxes up to 201 x 201");
    for (int n = 512; n <= (bench_smoke() ? 512 : bench_quick() ? 2048 : 8192); n *= n == 512 ? 4 : 2) {
        float *p = (float *)malloc((size_t)n * (size_t)n * 4);
        for (int which = 0; which < PICTURES; which++) {
            make_picture(p, n, which);
            for (size_t r = 0; r < sizeof representations / sizeof *representations; r++)
                precision_rows(p, n, picture_names[which], &representations[r]);
            if (which == HDR14 && n == (bench_smoke() ? 512 : 2048)) error_pictures(p, n);
        }
        free(p);
    }
}

/* The picture of 14 decades squeezed into fewer. */
static void bench_luminance_range(void)
{
    enum { N = 1024, SIDE = 3 };
    static double relative[MOST];
    float *wide = (float *)malloc(sizeof(float) * N * N), *p = (float *)malloc(sizeof(float) * N * N);
    bench_table("Luminance range: 3 x 3 boxes of 1024 x 1024 pixels, relative to each box's own mean", "decades\trepresentation\tmedian_relative\tp99_relative\tdefault");
    bench_plot("Error against the range of luminance; x=decades; y=p99_relative; by=representation; log=y; style=linespoints");
    make_picture(wide, N, HDR14);
    for (int decades = 0; decades <= 14; decades += 2) {
        sat_image image = sat_image_f32(p, N, N, 1);
        for (size_t i = 0; i < (size_t)N * N; i++) p[i] = powf(wide[i], (float)decades / 14);
        for (size_t r = 0; r < sizeof representations / sizeof *representations; r++) {
            sat_options o = sat_defaults();
            sat_table *t;
            uint64_t state = 1;
            o.kind = representations[r].kind;
            o.tile = representations[r].tile;
            o.subtract_mean = representations[r].subtract_mean;
            o.max_box_area = SIDE * SIDE;
            if (sat_create(&t, N, N, 1, &o) != SAT_OK) continue;
            sat_build(t, &image);
            for (int i = 0; i < MOST; i++) {
                int x = support_below(&state, N - SIDE), y = support_below(&state, N - SIDE);
                double exact = exact_sum(p, N, x, y, x + SIDE, y + SIDE);
                relative[i] = fabs(sat_sum(t, 0, x, y, x + SIDE, y + SIDE) - exact) / exact;
            }
            qsort(relative, MOST, sizeof *relative, support_compare_doubles);
            bench_row("%d\t%s\t%.2g\t%.2g\t%d", decades, representations[r].name, relative[MOST / 2] + 1e-17, relative[MOST * 99 / 100] + 1e-17,
                      representations[r].kind == SAT_KIND_TILED && representations[r].tile == sat_defaults().tile);
            sat_destroy(t);
        }
    }
    free(wide);
    free(p);
}

/* ---- lookups */

enum { LOOKUPS = 1 << 18 };

struct lookup_work {
    const sat_table *table;
    const int *x, *y;
    int radius;
    double sink;
    int *boxes;
    double *out;
};

/* What a program would write by hand over a table as cv::integral makes it, of floats or of doubles. */
template <typename number> static void look_up_by_hand(void *user)
{
    lookup_work *w = (lookup_work *)user;
    const number *table = (const number *)(const void *)sat__row(w->table, 0, 0);
    const size_t stride = w->table->stride;
    double sum = 0;
    for (int i = 0; i < LOOKUPS; i++) {
        int side = 2 * w->radius + 1, x0 = w->x[i] - w->radius, y0 = w->y[i] - w->radius;
        int x1 = x0 + side, y1 = y0 + side;
        const number *low = table + (size_t)y0 * stride, *high = table + (size_t)y1 * stride;
        sum += (double)((high[x1] - high[x0]) - (low[x1] - low[x0]));
    }
    w->sink += sum;
}

static void look_up_view(void *user)
{
    lookup_work *w = (lookup_work *)user;
    sat_view view;
    double sum = 0;
    if (sat_get_view(&view, w->table, 0) != SAT_OK) return;
    for (int i = 0; i < LOOKUPS; i++) {
        int x = w->x[i], y = w->y[i], r = w->radius;
        sum += sat_view_sum(&view, x - r, y - r, x + r + 1, y + r + 1);
    }
    w->sink += sum;
}

/* The boxes are written down, too. */
static void look_up_many(void *user)
{
    lookup_work *w = (lookup_work *)user;
    enum { BLOCK = 4096 };
    double sum = 0;
    for (int first = 0; first < LOOKUPS; first += BLOCK) {
        for (int i = 0; i < BLOCK; i++) {
            w->boxes[4 * i] = w->x[first + i] - w->radius;
            w->boxes[4 * i + 1] = w->y[first + i] - w->radius;
            w->boxes[4 * i + 2] = w->x[first + i] + w->radius + 1;
            w->boxes[4 * i + 3] = w->y[first + i] + w->radius + 1;
        }
        sat_sums(w->out, w->table, 0, w->boxes, BLOCK);
        for (int i = 0; i < BLOCK; i++) sum += w->out[i];
    }
    w->sink += sum;
}

static void look_up(void *user)
{
    lookup_work *w = (lookup_work *)user;
    double sum = 0;
    for (int i = 0; i < LOOKUPS; i++) {
        int x = w->x[i], y = w->y[i], r = w->radius;
        sum += sat_sum(w->table, 0, x - r, y - r, x + r + 1, y + r + 1);
    }
    w->sink += sum;
}

static void bench_lookups(void)
{
    static const int radii[] = {1, 5, 20, 100};
    int n = bench_smoke() ? 256 : bench_quick() ? 2048 : 4096;
    float *p = (float *)malloc((size_t)n * (size_t)n * 4);
    int *x = (int *)malloc(LOOKUPS * sizeof(int)), *y = (int *)malloc(LOOKUPS * sizeof(int));
    sat_table *tables[4];
    make_picture(p, n, UNIFORM);
    sat_image image = sat_image_f32(p, n, n, 1);
    for (int k = 0; k < 4; k++) {
        sat_options o = sat_defaults();
        o.kind = (sat_kind)k;
        if (sat_create(&tables[k], n, n, 1, &o) == SAT_OK) sat_build(tables[k], &image);
    }
    bench_table("Lookup: time against four corners of a float table read by hand",
                "kind\torder\tradius\ttime_ratio\tmany_time_ratio\tview_time_ratio\tby_hand_double\tdefault");
    bench_plot("Lookup time of sat_view_sum; x=radius; y=view_time_ratio; by=kind; log=x; where=order:random; style=linespoints");
    bench_note("order: random boxes, or around each pixel, row by row; by_hand_double: four corners of a double table, what cv::integral gives");
    bench_note("time_ratio: a loop of sat_sum; many_time_ratio: sat_sums; view_time_ratio: sat_view_sum");
    int *boxes = (int *)malloc(4 * 4096 * sizeof(int));
    double *sums = (double *)malloc(4096 * sizeof(double));
    for (int order = 0; order < 2; order++)
        for (int r = 0; r < 4; r++) {
            uint64_t state = 9;
            int inside = n - 2 * radii[r];
            for (int i = 0; i < LOOKUPS; i++) {
                x[i] = radii[r] + (order ? i % inside : support_below(&state, inside));
                y[i] = radii[r] + (order ? i / inside % inside : support_below(&state, inside));
            }
            lookup_work peer = {tables[SAT_KIND_FLOAT], x, y, radii[r], 0, NULL, NULL},
                        by_hand = {tables[SAT_KIND_DOUBLE], x, y, radii[r], 0, NULL, NULL};
            double hand =
                bench_ratio(look_up_by_hand<double>, &by_hand, look_up_by_hand<float>, &peer, bench_rounds(11)).ratio;
            for (int k = 0; k < 4; k++) {
                lookup_work work = {tables[k], x, y, radii[r], 0, boxes, sums};
                double ratio[3];
                bench_fn *ways[3] = {look_up, look_up_many, look_up_view};
                for (int i = 0; i < 3; i++)
                    ratio[i] = bench_ratio(ways[i], &work, look_up_by_hand<float>, &peer, bench_rounds(11)).ratio;
                bench_row("%s\t%s\t%d\t%.2f\t%.2f\t%.2f\t%.2f\t%d", kind_names[k], order ? "raster" : "random", radii[r],
                          ratio[0], ratio[1], ratio[2], hand, k == 0);
            }
        }
    for (int k = 0; k < 4; k++) sat_destroy(tables[k]);
    free(p);
    free(x);
    free(y);
    free(boxes);
    free(sums);
}

/* ---- filters and updates */

struct filter_work {
    const sat_table *table;
    float *out;
    int radius, n;
    sat_table *build;
    sat_image image;
};

static void filter(void *user)
{
    filter_work *w = (filter_work *)user;
    sat_box_filter(w->out, (ptrdiff_t)w->n * 4, w->table, w->radius);
}

#ifdef HAVE_OPENCV
static void blur(void *user)
{
    filter_work *w = (filter_work *)user;
    cv::Mat in(w->n, w->n, CV_32F, const_cast<void *>(w->image.pixels)), out(w->n, w->n, CV_32F, w->out);
    cv::blur(in, out, cv::Size(2 * w->radius + 1, 2 * w->radius + 1));
}

static void build_and_filter(void *user)
{
    filter_work *w = (filter_work *)user;
    sat_build(w->build, &w->image);
    sat_box_filter(w->out, 0, w->table, w->radius);
}

static void bench_blur(void)
{
    static const int radii[] = {1, 5, 20, 100};
    int n = bench_quick() ? 1024 : 2048;
    float *p = (float *)malloc((size_t)n * (size_t)n * 4), *out = (float *)malloc((size_t)n * (size_t)n * 4);
    make_picture(p, n, UNIFORM);
    cv::setNumThreads(1);
    bench_table("Box filter of a whole image: time against cv::blur",
                "kind\tradius\tside\ttime_blur_ratio\ttime_with_build_blur_ratio\tdefault");
    for (int k = 0; k < 4; k++) {
        sat_options o = sat_defaults();
        sat_table *t;
        o.kind = (sat_kind)k;
        if (k >= SAT_KIND_FIXED32) o.max_value = 1;
        o.max_box_area = 201 * 201;
        if (sat_create(&t, n, n, 1, &o) != SAT_OK) continue;
        filter_work w = {t, out, 0, n, t, sat_image_f32(p, n, n, 1)};
        sat_build(t, &w.image);
        for (int r = 0; r < 4; r++) {
            w.radius = radii[r];
            double alone = bench_ratio(filter, &w, blur, &w, bench_rounds(7)).ratio;
            bench_row("%s\t%d\t%d\t%.2f\t%.2f\t%d", kind_names[k], radii[r], n, alone,
                      bench_ratio(build_and_filter, &w, blur, &w, bench_rounds(7)).ratio, k == 0);
        }
        sat_destroy(t);
    }
    free(p);
    free(out);
}
#else
static void bench_blur(void)
{
    bench_table("Box filter of a whole image: time against cv::blur",
                "kind\tradius\tside\ttime_blur_ratio\ttime_with_build_blur_ratio\tdefault");
    bench_missing("OpenCV", "libopencv-dev");
}
#endif

/* ---- the side of a tile */

/* 14 decades as smooth as a sky: about one for 100 pixels. */
static void make_smooth_picture(float *p, int n)
{
    uint64_t state = 3;
    for (int y = 0; y < n; y++)
        for (int x = 0; x < n; x++) {
            double e = 7 * sin(x * 0.0031 + 1.3 * sin(y * 0.0017)) * cos(y * 0.0023 + 0.7) + 1 +
                       0.6 * (support_uniform(&state) - 0.5);
            p[(size_t)y * (size_t)n + (size_t)x] = (float)fmin(fmax(pow(10, e), 1e-6), 1e8);
        }
}

/* p99 and maximum of the relative errors of 3 x 3 boxes. */
static void tile_errors(const float *p, int n, int tile, double *p99, double *most)
{
    static double relative[MOST];
    sat_image image = sat_image_f32(p, n, n, 1);
    sat_options o = sat_defaults();
    sat_table *t;
    uint64_t state = 7;
    *p99 = *most = 0;
    o.tile = tile;
    if (sat_create(&t, n, n, 1, &o) != SAT_OK) return;
    sat_build(t, &image);
    for (int i = 0; i < MOST; i++) {
        int x = support_below(&state, n - 3), y = support_below(&state, n - 3);
        double exact = exact_sum(p, n, x, y, x + 3, y + 3);
        relative[i] = fabs(sat_sum(t, 0, x, y, x + 3, y + 3) - exact) / exact;
    }
    sat_destroy(t);
    qsort(relative, MOST, sizeof *relative, support_compare_doubles);
    *p99 = relative[MOST * 99 / 100];
    *most = relative[MOST - 1];
}

static void bench_tiles(void)
{
    static const int radii[] = {1, 5, 20, 100};
    int n = bench_smoke() ? 256 : 2048;
    size_t pixels = (size_t)n * (size_t)n;
    float *p = (float *)malloc(pixels * 4), *rough = (float *)malloc(pixels * 4), *smooth = (float *)malloc(pixels * 4),
          *out = (float *)malloc(pixels * 4);
    char *to = (char *)malloc(pixels * 4), *from = (char *)malloc(pixels * 4);
    int *x = (int *)malloc(LOOKUPS * sizeof(int)), *y = (int *)malloc(LOOKUPS * sizeof(int));
    int *boxes = (int *)malloc(4 * 4096 * sizeof(int));
    double *sums = (double *)malloc(4096 * sizeof(double));
    sat_options o = sat_defaults();
    sat_table *flat;
    memset(to, 1, pixels * 4);
    memset(from, 1, pixels * 4);
    make_picture(p, n, UNIFORM);
    make_picture(rough, n, HDR14);
    make_smooth_picture(smooth, n);
    sat_image image = sat_image_f32(p, n, n, 1);
    o.kind = SAT_KIND_FLOAT;
    if (sat_create(&flat, n, n, 1, &o) != SAT_OK) return;
    sat_build(flat, &image);
    bench_table("Side of a tile: what the default weighs",
                "tile\tbytes_a_pixel\tsmooth_p99\tsmooth_max\trough_p99\trough_max\tbuild_memcpy_ratio\t"
                "lookup_1\tlookup_5\tlookup_20\tlookup_100\tfilter_5\tfilter_100\tdefault");
    bench_note("relative errors of 3 x 3 boxes in 14 decades, smooth (one decade in 100 pixels) and rough (patches of 128)");
    bench_note("lookup_r: sat_sums over a bare float lookup; filter_r: over sat_box_filter of SAT_KIND_FLOAT");
    for (int tile = 8; tile <= 128; tile *= 2) {
        double e[4], look[4], box[2];
        build_work w;
        copy_work c = {to, from, (size_t)((double)pixels * 4.25)};
        c.bytes = c.bytes < pixels * 4 ? c.bytes : pixels * 4;
        o = sat_defaults();
        o.tile = tile;
        w.image = image;
        if (sat_create(&w.table, n, n, 1, &o) != SAT_OK) return;
        tile_errors(smooth, n, tile, &e[0], &e[1]);
        tile_errors(rough, n, tile, &e[2], &e[3]);
        double time = bench_ratio(build, &w, copy, &c, bench_rounds(15)).ratio;
        for (int r = 0; r < 4; r++) {
            uint64_t state = 9;
            for (int i = 0; i < LOOKUPS; i++) {
                x[i] = radii[r] + support_below(&state, n - 2 * radii[r]);
                y[i] = radii[r] + support_below(&state, n - 2 * radii[r]);
            }
            lookup_work work = {w.table, x, y, radii[r], 0, boxes, sums}, peer = {flat, x, y, radii[r], 0, NULL, NULL};
            look[r] = bench_ratio(look_up_many, &work, look_up_by_hand<float>, &peer, bench_rounds(9)).ratio;
        }
        for (int r = 0; r < 2; r++) {
            filter_work f = {w.table, out, r ? 100 : 5, n, w.table, image};
            filter_work g = {flat, out, r ? 100 : 5, n, flat, image};
            box[r] = bench_ratio(filter, &f, filter, &g, bench_rounds(5)).ratio;
        }
        bench_row("%d\t%.3f\t%.2g\t%.2g\t%.2g\t%.2g\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%.2f\t%d", tile,
                  (double)sat_get_stats(w.table).bytes / (double)pixels, e[0], e[1], e[2], e[3], time, look[0], look[1],
                  look[2], look[3], box[0], box[1], tile == sat_defaults().tile);
        sat_destroy(w.table);
    }
    sat_destroy(flat);
    free(p);
    free(rough);
    free(smooth);
    free(out);
    free(to);
    free(from);
    free(x);
    free(y);
    free(boxes);
    free(sums);
}

static void update(void *user)
{
    build_work *w = (build_work *)user;
    sat_update(w->table, &w->image, w->x0, w->y0, w->x1, w->y1);
}

static void bench_whole_images(void)
{
    int n = bench_quick() ? 1024 : 4096;
    float *p = (float *)malloc((size_t)n * (size_t)n * 4), *out = (float *)malloc((size_t)n * (size_t)n * 4);
    make_picture(p, n, UNIFORM);
    sat_image image = sat_image_f32(p, n, n, 1);
    bench_table("Whole images: time against a build of the same table",
                "kind\twork\tside\ttime_build_ratio\tspeedup\tdefault");
    bench_note("update: 64 x 64 pixels changed in the middle (and in the last corner); box: sat_box_filter with this radius");
    for (int k = 0; k < 4; k++) {
        sat_options o = sat_defaults();
        build_work w;
        o.kind = (sat_kind)k;
        if (sat_create(&w.table, n, n, 1, &o) != SAT_OK) continue;
        w.image = image;
        for (int place = 0; place < (k == SAT_KIND_TILED ? 3 : 0); place++) {
            w.x0 = w.y0 = place == 0 ? n / 2 + 5 : place == 1 ? n - 64 : 5;
            w.x1 = w.y1 = w.x0 + 64;
            double ratio = bench_ratio(update, &w, build, &w, bench_rounds(15)).ratio;
            bench_row("%s\tupdate %s\t%d\t%.4f\t%.1f\t%d", kind_names[k],
                      place == 0   ? "middle"
                      : place == 1 ? "last corner"
                                   : "first corner",
                      n, ratio, 1 / ratio, 1);
        }
        for (int radius = 1; radius <= 100; radius *= 10) {
            filter_work f = {w.table, out, radius, n, w.table, image};
            bench_row("%s\tbox %d\t%d\t%.2f\t%.2f\t%d", kind_names[k], radius, n, bench_ratio(filter, &f, build, &w, bench_rounds(5)).ratio, 1.0, k == 0);
        }
        sat_destroy(w.table);
    }
    free(p);
    free(out);
}

/* ---- one scan for all: should tonemap.h and ssao_sat.h take their rows of sums modulo 2^32 from here? */

enum { RING_ROWS = 64 };

struct ring_work {
    uint32_t *ring, *column;
    const uint32_t *in;
    int width;
};

static void ring_loop(void *user) /* what a plain loop does */
{
    ring_work *w = (ring_work *)user;
    for (int y = 1; y < RING_ROWS; y++) {
        uint32_t *row = w->ring + (size_t)y * (size_t)w->width, sum = 0;
        const uint32_t *above = row - w->width, *in = w->in + (size_t)(y % 8) * (size_t)w->width;
        for (int x = 0; x < w->width; x++) {
            sum += in[x];
            row[x] = above[x] + sum;
        }
    }
}

static void ring_shared(void *user)
{
    ring_work *w = (ring_work *)user;
    for (int y = 1; y < RING_ROWS; y++)
        sat__add_row(w->ring + (size_t)y * (size_t)w->width, w->ring + (size_t)(y - 1) * (size_t)w->width,
                     (const int32_t *)(const void *)(w->in + (size_t)(y % 8) * (size_t)w->width), w->width);
}

static void ring_table(void *user) /* a table of its own in memory, for the same rows of floats */
{
    build_work *w = (build_work *)user;
    sat_build(w->table, &w->image);
}

static void bench_siblings(void)
{
    static const int widths[] = {512, 1024, 2048};
    bench_table("One scan for siblings: a ring of 64 rows of sums modulo 2^32, time against a plain loop",
                "width\tshared_row_ratio\tfixed32_build_ratio\tdefault");
    bench_note("shared_row_ratio: sat__add_row, which tonemap.h takes; fixed32_build_ratio: sat_build, which rounds floats as well");
    for (int k = 0; k < 3; k++) {
        int n = widths[k];
        ring_work w;
        build_work b;
        sat_options o = sat_defaults();
        float *p = (float *)malloc((size_t)n * RING_ROWS * 4);
        support_fill(p, (size_t)n * RING_ROWS, 0, 1, 3);
        w.width = n;
        w.ring = (uint32_t *)calloc((size_t)n * RING_ROWS, 4);
        w.column = (uint32_t *)calloc((size_t)n + 16, 4);
        w.in = (const uint32_t *)(const void *)p;
        o.kind = SAT_KIND_FIXED32;
        o.max_value = 1;
        if (sat_create(&b.table, n, RING_ROWS, 1, &o) != SAT_OK) return;
        b.image = sat_image_f32(p, n, RING_ROWS, 1);
        double shared = bench_ratio(ring_shared, &w, ring_loop, &w, bench_rounds(11)).ratio;
        bench_row("%d\t%.2f\t%.2f\t%d", n, shared, bench_ratio(ring_table, &b, ring_loop, &w, bench_rounds(11)).ratio, 1);
        sat_destroy(b.table);
        free(p);
        free(w.ring);
        free(w.column);
    }
}

/* ---- error bounds */

static void bench_bounds(void)
{
    int n = 1024;
    float *p = (float *)malloc((size_t)n * (size_t)n * 4);
    sat_image image = sat_image_f32(p, n, n, 1);
    bench_table("Expected error: bound and expected root mean square against the measured", "picture\tkind\tbox\tbound_over_max\texpected_over_rms");
    bench_note("0: the measured error is 0");
    for (int which = 0; which < PICTURES; which++) {
        make_picture(p, n, which);
        for (int k = 0; k < 4; k++) {
            sat_options o = sat_defaults();
            sat_table *t;
            o.kind = (sat_kind)k;
            o.max_box_area = 201 * 201;
            if (sat_create(&t, n, n, 1, &o) != SAT_OK) continue;
            sat_build(t, &image);
            for (int b = 0; b < BOXES; b++) {
                uint64_t state = 4;
                int side = box_sides[b], count = side > 100 ? 200 : 2000;
                double squares = 0, worst = 0, area = (double)side * side;
                for (int i = 0; i < count; i++) {
                    int x = support_below(&state, n - side), y = support_below(&state, n - side);
                    double e =
                        fabs(sat_sum(t, 0, x, y, x + side, y + side) - exact_sum(p, n, x, y, x + side, y + side)) /
                        area;
                    squares += e * e;
                    if (e > worst) worst = e;
                }
                bench_row("%s\t%s\t%d\t%.3g\t%.3g", picture_names[which], kind_names[k], side, worst > 0 ? sat_error_bound(t, 0, side, side) / worst : 0,
                          squares > 0 ? sat_error_rms(t, 0, side, side) / sqrt(squares / count) : 0);
            }
            sat_destroy(t);
        }
    }
    free(p);
}

/* ---- scans */

struct scan_work {
    float *in, *out;
    size_t n;
    sat_scan_options options;
};

static void scan(void *user)
{
    scan_work *w = (scan_work *)user;
    sat_scan_f32(w->out, w->in, w->n, &w->options);
}

static void bench_scans(void)
{
    static const int ks[] = {2, 3, 4, 6, 8, 12, 16};
    const int N = bench_smoke() ? 1 << 14 : 1 << 20;
    float *in = (float *)malloc((size_t)N * 4), *out = (float *)malloc((size_t)N * 4);
    support_fill(in, (size_t)N, 0, 1, 3);
    bench_table("k-ary scans of 2^20 floats: work and time against the sequential scan", "algorithm\tk\tpasses\tadds_a_value\taccesses_a_value\tnodes_a_value\ttime_ratio\terror_ulp\tdefault");
    bench_plot("Accesses a value; x=k; y=accesses_a_value; by=algorithm; style=linespoints");
    bench_note("these are the algorithms of the GPU; on a CPU the sequential scan is the fast one");
    for (int a = 1; a < 3; a++)
        for (int i = 0; i < 7; i += bench_quick() ? 2 : 1) {
            sat_scan_counters c;
            scan_work work = {in, out, (size_t)N, sat_scan_defaults()}, peer = work;
            double worst = 0;
            long double exact = 0;
            work.options.algorithm = (sat_scan_algorithm)a;
            work.options.k = ks[i];
            double ratio = bench_ratio(scan, &work, scan, &peer, bench_quick() ? 2 : 5).ratio;
            work.options.counters = &c;
            scan(&work);
            for (int j = 0; j < N; j++) {
                exact += (long double)in[j];
                double e = fabs((double)(((long double)out[j] - exact) / exact)) / 5.96e-8;
                if (e > worst) worst = e;
            }
            bench_row("%s\t%d\t%d\t%.2f\t%.2f\t%.3f\t%.1f\t%.2f\t%d", a == 1 ? "recursive doubling" : "balanced tree",
                      ks[i], (int)c.passes, (double)c.adds / N, (double)(c.reads + c.writes) / N, (double)c.nodes / N,
                      ratio, worst, a == 2 && ks[i] == 4);
        }
    free(in);
    free(out);
}
#endif

int main(void)
{
    bench_start("sat.h");
    bench_build();
#ifndef BENCH_BUILD_ONLY
    bench_lookups();
    bench_tiles();
    bench_whole_images();
    bench_blur();
    bench_siblings();
    bench_bounds();
    bench_scans();
    bench_precision();
    bench_luminance_range();
#endif
    return 0;
}
