/* Error against run time of tonemap.h, and the tables of the two theses on this machine.
   Peers, when there: pfstools (pfstmo_reinhard02) and OpenCV (Drago). C++ because OpenCV is. */

#define SAT_IMPLEMENTATION
#define TONEMAP_IMPLEMENTATION
#include "tonemap.h"
#include "bench.h"
#include "reference_tonemap.h"
#include "image.h"
#include <sys/resource.h>
#include <unistd.h>
#ifdef HAVE_OPENCV
#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wdouble-promotion"
#pragma GCC diagnostic ignored "-Wshadow"
#endif
#include <opencv2/core.hpp>
#include <opencv2/photo.hpp>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif
#endif

/* Relative luminance of linear Rec. 709 colour under D65. */
static inline float luminance_of(float red, float green, float blue)
{
    return 0.2126729f * red + 0.7151522f * green + 0.0721750f * blue;
}

/* ---- pictures */

struct scene { const char *name; image picture; sat_image view; size_t n; };

static float bench_noise(uint64_t *seed) { return (float)support_uniform(seed); }

/* A room with a window and a dark corner, for machines without photographs. */
static void draw_room(image *out, int width, int height)
{
    uint64_t seed = 9;
    image_create(out, width, height, 3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            double u = (double)x / width, v = (double)y / height, light = 0.05 + 0.4 * u;
            if (u > 0.6 && v < 0.5) light = 40 + 30 * sin(12 * v);
            if (u < 0.3 && v > 0.6) light = 0.01 * (1 + (x / 3 + y / 3) % 2 * 2);
            light *= 1 + 0.04 * ((double)bench_noise(&seed) - 0.5);
            for (int c = 0; c < 3; ++c)
                out->pixels[3 * ((size_t)y * (size_t)width + (size_t)x) + (size_t)c] =
                    (float)(light * (1 + 0.4 * sin(5 * u + 2 * c + 3 * v)));
        }
}

static void settle(scene *s, const char *name)
{
    s->name = name;
    s->view = image_view(&s->picture);
    s->n = (size_t)s->picture.width * (size_t)s->picture.height;
}

static int load(scene *s, const char *name, const char *file)
{
    const char *path = support_data(file);
    if (!path || !image_load(&s->picture, path)) return 0;
    settle(s, name);
    return 1;
}

/* Mirrored to a size. */
static void enlarge(scene *out, const scene *s, int width, int height)
{
    image_create(&out->picture, width, height, 3);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            int px = x % (2 * s->picture.width), py = y % (2 * s->picture.height);
            if (px >= s->picture.width) px = 2 * s->picture.width - 1 - px;
            if (py >= s->picture.height) py = 2 * s->picture.height - 1 - py;
            memcpy(out->picture.pixels + 3 * ((size_t)y * (size_t)width + (size_t)x),
                   s->picture.pixels + 3 * ((size_t)py * (size_t)s->picture.width + (size_t)px), 3 * sizeof(float));
        }
    settle(out, s->name);
}

/* Every eighth pixel each way: enough to show that a bench works. */
static void shrink(scene *s)
{
    image small_one;
    image_create(&small_one, s->picture.width / 8, s->picture.height / 8, 3);
    for (int y = 0; y < small_one.height; ++y)
        for (int x = 0; x < small_one.width; ++x)
            memcpy(small_one.pixels + 3 * ((size_t)y * (size_t)small_one.width + (size_t)x),
                   s->picture.pixels + 3 * ((size_t)(8 * y) * (size_t)s->picture.width + (size_t)(8 * x)),
                   3 * sizeof(float));
    image_free(&s->picture);
    s->picture = small_one;
    settle(s, s->name);
}

/* The photographic local operator without burn-out, metered by eq A.1. */
static tonemap_options local_options()
{
    tonemap_options o = tonemap_defaults();
    o.operation = TONEMAP_PHOTOGRAPHIC_LOCAL;
    o.white = (double)INFINITY;
    o.metering = TONEMAP_METERING_LOG_AVERAGE;
    return o;
}

/* What version 0.1 did unless told. */
static tonemap_options thesis_options()
{
    tonemap_options o = local_options();
    o.soft = 0;
    o.gamut = -1;
    return o;
}

/* ---- one configuration as a piece of work */

struct work { tonemap *map; const scene *s; unsigned char *out; tonemap_stats stats; tonemap_options options; };

static work make_work(const scene *s, const tonemap_options *options)
{
    work w;
    w.s = s;
    w.options = *options;
    w.out = (unsigned char *)malloc(s->n * 3);
    memset(&w.stats, 0, sizeof w.stats);
    if (tonemap_create(&w.map, s->picture.width, s->picture.height, options) != SAT_OK) {
        puts("tonemap_create failed");
        exit(1);
    }
    tonemap_apply_u8(w.map, w.out, (ptrdiff_t)s->picture.width * 3, &s->view, 0, &w.stats);
    return w;
}

static void free_work(work *w)
{
    tonemap_destroy(w->map);
    free(w->out);
}

static void run_work(void *user)
{
    work *w = (work *)user;
    tonemap_apply_u8(w->map, w->out, (ptrdiff_t)w->s->picture.width * 3, &w->s->view, 0, NULL);
}

/* Codes before rounding, from linear output. */
static double *codes_of(const scene *s, const tonemap_options *options, tonemap_stats *stats)
{
    float *linear = (float *)malloc(s->n * 3 * sizeof(float));
    double *codes = metrics_alloc(s->n * 3);
    tonemap *map;
    tonemap_create(&map, s->picture.width, s->picture.height, options);
    tonemap_apply_f32(map, linear, (ptrdiff_t)s->picture.width * 12, &s->view, 0, stats);
    for (size_t i = 0; i < s->n * 3; ++i) codes[i] = metrics_code((double)linear[i]);
    tonemap_destroy(map);
    free(linear);
    return codes;
}

/* Luminance codes Ld, unclipped components: the factor of each pixel times its luminance. */
static double *luminance_codes(const scene *s, const tonemap_options *options, tonemap_stats *stats)
{
    scene grey = *s;
    float *plane = (float *)malloc(s->n * sizeof(float)), *linear = (float *)malloc(s->n * sizeof(float));
    double *codes = metrics_alloc(s->n);
    tonemap *map;
    for (size_t i = 0; i < s->n; ++i)
        plane[i] = luminance_of(s->picture.pixels[3 * i], s->picture.pixels[3 * i + 1], s->picture.pixels[3 * i + 2]);
    grey.view = sat_image_f32(plane, s->picture.width, s->picture.height, 1);
    tonemap_create(&map, s->picture.width, s->picture.height, options);
    tonemap_apply_f32(map, linear, (ptrdiff_t)s->picture.width * 4, &grey.view, 0, stats);
    for (size_t i = 0; i < s->n; ++i) codes[i] = metrics_code((double)linear[i]);
    tonemap_destroy(map);
    free(plane);
    free(linear);
    return codes;
}

/* ---- peers */

static double child_seconds(void)
{
    struct rusage u;
    getrusage(RUSAGE_CHILDREN, &u);
    return (double)u.ru_utime.tv_sec + (double)u.ru_stime.tv_sec +
           1e-6 * (double)(u.ru_utime.tv_usec + u.ru_stime.tv_usec);
}

static double own_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int shell(const char *command) { return system(command) == 0; }

static int have_pfs(void) { return shell("command -v pfstmo_reinhard02 >/dev/null 2>&1 && command -v pfsinexr >/dev/null 2>&1"); }

static char bench_folder[64];

static const char *temporary(const char *name)
{
    static char path[4][256];
    static int turn;
    turn = (turn + 1) % 4;
    snprintf(path[turn], sizeof path[turn], "%s/%s", bench_folder, name);
    return path[turn];
}

/* Writes the picture, positive, as a stream of pfstools. */
static int write_pfs(scene *s)
{
    char command[1024];
    image copy = s->picture;
    copy.pixels = (float *)malloc(s->n * 12);
    for (size_t i = 0; i < s->n * 3; ++i) copy.pixels[i] = s->picture.pixels[i] > 1e-7f ? s->picture.pixels[i] : 1e-7f;
    int ok = image_save(&copy, temporary("in.exr"));
    free(copy.pixels);
    snprintf(command, sizeof command, "pfsinexr %s >%s 2>/dev/null", temporary("in.exr"), temporary("in.pfs"));
    return ok && shell(command);
}

/* CPU seconds of one run. */
static double time_pfs(const char *program)
{
    char command[1024];
    double start = child_seconds();
    snprintf(command, sizeof command, "%s <%s >/dev/null 2>&1", program, temporary("in.pfs"));
    return shell(command) ? child_seconds() - start : 0;
}

#ifdef HAVE_OPENCV
struct opencv_peer { cv::Mat in, out; cv::Ptr<cv::TonemapDrago> drago; };

static void run_drago(void *user)
{
    opencv_peer *p = (opencv_peer *)user;
    cv::Mat bytes;
    p->drago->process(p->in, p->out);
    p->out.convertTo(bytes, CV_8UC3, 255);
}
#endif

static void name_missing_pfs(void) { if (!have_pfs()) bench_missing("pfstools", "pfstools, pfstmo"); }

/* ---- tables */

static void times(scene *still)
{
    struct row { const char *name; tonemap_options o; } rows[24];
    int count = 0;
    tonemap_options o = tonemap_defaults(), thesis = thesis_options();
    auto add = [&](const char *name) { rows[count].name = name; rows[count++].o = o; o = tonemap_defaults(); };
    scene big;
    const int width = bench_smoke() ? 320 : 1920, height = bench_smoke() ? 180 : 1080;
    enlarge(&big, still, width, height);
    add("guided (default)");
    o = thesis, add("local of version 0.1: hard scales, log-average, clipped channels");
    o = thesis, o.operation = TONEMAP_GUIDED, add("the same, guided");
    o = thesis, o.soft = 1, add("the same, soft scales");
    o = thesis, o.gamut = 0.5, add("the same, gamut 0.5");
    o = thesis, o.metering = TONEMAP_METERING_PERCENTILES, add("the same, metered by percentiles");
    o = thesis, o.white = 0, add("the same, estimated white");
    o.operation = TONEMAP_PHOTOGRAPHIC_LOCAL, add("local");
    o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL, add("global");
    o.mesopic = TONEMAP_MESOPIC_LOCAL, add("guided + local mesopic");
    o.mesopic = TONEMAP_MESOPIC_UNIFORM, add("guided + uniform mesopic");
    o.operation = TONEMAP_PHOTOGRAPHIC_LOCAL, o.selective = 0.1, add("local, selective 0.1");
    o.operation = TONEMAP_ASHIKHMIN, add("Ashikhmin");
    o.operation = TONEMAP_ASHIKHMIN_GLOBAL, add("Ashikhmin global");
    o.operation = TONEMAP_NEUTRAL, add("Khronos PBR Neutral");
    o.operation = TONEMAP_AGX, add("AgX");
    o.operation = TONEMAP_ACES, add("ACES (Hill)");
    o.operation = TONEMAP_HABLE, add("Hable");
    o.dither = 1, add("guided, dithered");
    o.primaries = TONEMAP_PRIMARIES_2020, o.balance_red = 1.1, add("guided, from Rec. 2020, white balance");
    bench_table("Time of one picture: StillLife mirrored to 1920 x 1080, float RGB in, 8-bit sRGB out, one core",
                "configuration\ttime_ratio\tns_per_pixel\tdefault");
    bench_note("time_ratio: to the default, in pairs; pfstools: CPU time with its stream, 1 run in 3 of each; below 1 it would be faster than we are");
#ifndef HAVE_OPENCV
    bench_missing("OpenCV", "libopencv-dev");
#endif
    name_missing_pfs();
    work base = make_work(&big, &rows[0].o);
    for (int i = 0; i < count; ++i) {
        work w = make_work(&big, &rows[i].o);
        bench_times t = bench_ratio(run_work, &w, run_work, &base, bench_rounds(15));
        bench_row("%s\t%.3f\t%.2f\t%d", rows[i].name, t.ratio, 1e9 * t.work / (double)big.n, i == 0);
        free_work(&w);
    }
#ifdef HAVE_OPENCV
    {
        opencv_peer p;
        cv::setNumThreads(1);
        p.in = cv::Mat(height, width, CV_32FC3, big.picture.pixels);
        p.drago = cv::createTonemapDrago(2.2f);
        bench_times t = bench_ratio(run_drago, &p, run_work, &base, bench_rounds(15));
        bench_row("peer: OpenCV Drago (global)\t%.3f\t%.2f\t0", t.ratio, 1e9 * t.work / (double)big.n);
    }
#endif
    if (have_pfs() && write_pfs(&big)) {
        const char *programs[] = {"pfstmo_reinhard02 -s", "pfstmo_reinhard02", "pfstmo_drago03"};
        for (int i = 0; i < 3; ++i) {
            double ratio[3], seconds = 0;
            const int rounds = bench_quick() ? 1 : 3;
            for (int k = 0; k < rounds; ++k) {
                double peer = time_pfs(programs[i]), start = own_seconds();
                run_work(&base);
                run_work(&base);
                ratio[k] = peer / (0.5 * (own_seconds() - start));
                seconds = peer;
            }
            bench_row("peer: %s\t%.3f\t%.2f\t0", programs[i], support_median(ratio, rounds), 1e9 * seconds / (double)big.n);
        }
    }
    free_work(&base);
    image_free(&big.picture);
}

/* The same file compiled with and without vector code: CPU time of each, in turns. */
static void portable(void)
{
    const char *source = temporary("once.c");
    char command[2][1024];
    double ratio[9], out[2] = {0, 0};
    int rounds = bench_rounds(9);
    FILE *file = fopen(source, "w");
    bench_table("Portable C against vector code", "code\ttime_ratio\tns_per_pixel\tdefault");
    if (!file) return;
    fputs("#define SAT_IMPLEMENTATION\n#define TONEMAP_IMPLEMENTATION\n#include \"tonemap.h\"\n#include \"support.h\"\n"
          "int main(void){int w=1500,h=1000,i;float*p=malloc(sizeof(float)*3*w*h);unsigned char*o=malloc(3*w*h);tonemap*t;clock_t c;double best=1e9;\n"
          "support_hdr_image(p,w,h,3,1);sat_image v=sat_image_f32(p,w,h,3);tonemap_create(&t,w,h,NULL);\n"
          "for(i=0;i<8;i++){c=clock();tonemap_apply_u8(t,o,3*w,&v,0,NULL);c=clock()-c;if((double)c<best)best=(double)c;}\n"
          "printf(\"%g\\n\",best/CLOCKS_PER_SEC);return 0;}\n", file);
    fclose(file);
    for (int i = 0; i < 2; ++i) {
        char build[4096];
        snprintf(command[i], sizeof command[i], "%s/once%d", bench_folder, i);
        snprintf(build, sizeof build, "cc -std=c99 -O2 -D_POSIX_C_SOURCE=200809L %s -I. -Itests %s -o %s -lm -lpthread 2>/dev/null", i ? "-DSAT_NO_SIMD" : "", source, command[i]);
        if (!shell(build)) {
            bench_missing("a C compiler called cc", "gcc");
            return;
        }
    }
    for (int k = 0; k < rounds; ++k) {
        for (int i = 0; i < 2; ++i) {
            FILE *pipe = popen(command[i], "r");
            if (!pipe || fscanf(pipe, "%lf", &out[i]) != 1) out[i] = 0;
            if (pipe) pclose(pipe);
        }
        ratio[k] = out[1] / out[0];
    }
    bench_row("SSE2\t1\t%.2f\t1", 1e9 * out[0] / 1.5e6);
    bench_row("SAT_NO_SIMD\t%.3f\t%.2f\t0", support_median(ratio, rounds), 1e9 * out[1] / 1.5e6);
}

static double *gaussian_codes(const scene *s, double average, int gaussian)
{
    double *scaled = metrics_alloc(s->n), *la = metrics_alloc(s->n), *codes = metrics_alloc(s->n);
    reference_photographic r = reference_photographic_defaults(gaussian);
    reference_luminance(scaled, s->picture.pixels, s->n);
    for (size_t i = 0; i < s->n; ++i) scaled[i] *= 0.18 / average;
    reference_local(la, scaled, s->picture.width, s->picture.height, &r);
    reference_codes(codes, scaled, la, s->n);
    free(scaled);
    free(la);
    return codes;
}

/* pfstmo's display luminance as codes, NULL without it. */
static double *pfs_codes(scene *s)
{
    char command[1024];
    image out;
    double *codes;
    if (!have_pfs() || !write_pfs(s)) return NULL;
    snprintf(command, sizeof command, "pfstmo_reinhard02 -s --phi 8 <%s 2>/dev/null | pfsoutexr %s >/dev/null 2>&1", temporary("in.pfs"), temporary("out.exr"));
    if (!shell(command) || !image_load(&out, temporary("out.exr"))) return NULL;
    codes = metrics_alloc(s->n);
    for (size_t i = 0; i < s->n; ++i)
        codes[i] =
            metrics_code((double)luminance_of(out.pixels[3 * i], out.pixels[3 * i + 1], out.pixels[3 * i + 2]));
    image_free(&out);
    return codes;
}

static void accuracy(scene *scenes, int count)
{
    bench_table("Local operators against the exact Gaussian operator (Reinhard 2002), 8-bit codes of the display luminance",
                "picture\toperator\tssim\trms_codes\tover_5_codes\ttime_ratio\tdefault");
    bench_plot("Error against the exact operator, and time; x=time_ratio; y=rms_codes; by=operator; log=xy; picture=plot_tonemap");
    bench_note("time_ratio: to the local operator, soft scales; exact boxes are the reference in double precision with sums of its own; pfstools: the program with its stream");
    for (int i = 0; i < count; ++i) {
        scene *s = &scenes[i];
        tonemap_options o = local_options();
        tonemap_stats stats;
        double *codes[6], *reference, times[6], start;
        work base = make_work(s, &o);
        auto timed = [&]() {
            work w = make_work(s, &o);
            double ratio = bench_ratio(run_work, &w, run_work, &base, bench_rounds(7)).ratio;
            free_work(&w);
            return ratio;
        };
        double base_time = bench_time(run_work, &base, bench_rounds(7));
        const char *names[6] = {"tonemap.h guided", "tonemap.h local, soft scales", "tonemap.h global", "exact boxes",
                                "pfstmo_reinhard02 -s --phi 8", "tonemap.h local, hard scales"};
        o.soft = 0;
        codes[5] = luminance_codes(s, &o, &stats);
        times[5] = timed();
        o = local_options();
        codes[1] = luminance_codes(s, &o, NULL);
        times[1] = 1;
        o.operation = TONEMAP_GUIDED;
        codes[0] = luminance_codes(s, &o, NULL);
        times[0] = timed();
        o = local_options();
        o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL;
        codes[2] = luminance_codes(s, &o, NULL);
        times[2] = timed();
        reference = gaussian_codes(s, stats.adapted, 1);
        start = bench_clock();
        codes[3] = gaussian_codes(s, stats.adapted, 0);
        times[3] = (bench_clock() - start) / base_time;
        start = support_clock();
        codes[4] = bench_quick() && i ? NULL : pfs_codes(s);
        times[4] = (support_clock() - start) / base_time;
        free_work(&base);
        if (i == 0) {
            float *error = (float *)malloc(s->n * sizeof(float));
            const char *files[6] = {"tonemap_default", "tonemap_local", "tonemap_global", NULL, "tonemap_peer", NULL};
            for (size_t p = 0; p < s->n; ++p) error[p] = (float)reference[p];
            bench_picture("tonemap_truth", "reference: Gaussians, 8-bit codes", error, s->picture.width, s->picture.height, BENCH_GREY, 0, 255);
            for (int k = 0; k < 6; ++k) {
                if (!codes[k] || !files[k]) continue;
                for (size_t p = 0; p < s->n; ++p) error[p] = (float)(codes[k][p] - reference[p]);
                bench_picture(files[k], names[k], error, s->picture.width, s->picture.height, BENCH_SIGNED, -4, 4);
            }
            free(error);
        }
        for (int k = 0; k < 6; ++k) {
            if (!codes[k]) continue;
            metrics_codes m = metrics_compare_codes(codes[k], reference, s->n);
            bench_row("%s\t%s\t%.4f\t%.3f\t%.4f\t%.3g\t%d", s->name, names[k], metrics_ssim(codes[k], reference, s->picture.width, s->picture.height), m.rms,
                      m.over5, times[k], k == 0);
            free(codes[k]);
        }
        free(reference);
    }
}

/* One picture with its luminance squeezed or stretched to so many decades: the box sums against exact ones. */
static void luminance_range(const scene *s)
{
    bench_table("Luminance range: our sums against exact boxes, 8-bit codes",
                "decades\trms_codes\tlargest_codes\tover_5_codes");
    bench_plot("Error against the range of luminance; x=decades; y=rms_codes; style=linespoints");
    bench_note(s->name);
    tonemap_options o = local_options();
    work w = make_work(s, &o);
    double own = log10(w.stats.high / w.stats.low);
    free_work(&w);
    for (int decades = 1; decades <= 14; decades += bench_quick() ? 4 : 1) {
        scene f;
        tonemap_stats stats;
        image_create(&f.picture, s->picture.width, s->picture.height, 3);
        for (size_t i = 0; i < s->n * 3; ++i)
            f.picture.pixels[i] = powf(fmaxf(s->picture.pixels[i], 0), (float)(decades / own));
        settle(&f, s->name);
        double *codes = luminance_codes(&f, &o, &stats), *exact = gaussian_codes(&f, stats.adapted, 0);
        metrics_codes m = metrics_compare_codes(codes, exact, f.n);
        bench_row("%d\t%.4f\t%.2f\t%.5f", decades, m.rms, m.largest, m.over5);
        free(codes);
        free(exact);
        image_free(&f.picture);
    }
}

static void pareto(const scene *s)
{
    struct row { const char *kind; double value; tonemap_options o; } rows[32];
    int count = 0;
    tonemap_options o = local_options();
    work base = make_work(s, &o);
    double *full = codes_of(s, &o, NULL);
    auto add = [&](const char *kind, double value) {
        rows[count].kind = kind;
        rows[count].value = value;
        rows[count++].o = o;
        o = local_options();
    };
    for (int k = 1; k <= 8; k += bench_quick() ? k : 1) o.scales = k, add("scales", k);
    for (double t = 0.05; t < 2; t *= bench_quick() ? 4 : 2) o.selective = t, add("selective", t);
    o.soft = 0.5, add("soft", 0.5);
    o.soft = 1, add("soft", 1);
    bench_table("What can be left out: error against the full local operator, and time", "option\tvalue\ttime_ratio\trms_codes\tlargest_codes\tssim\tskipped\tdefault");
    bench_plot("Error against time; x=time_ratio; y=rms_codes; by=option");
    bench_note(s->name);
    for (int i = 0; i < count; ++i) {
        tonemap_stats stats;
        double *codes = codes_of(s, &rows[i].o, &stats);
        metrics_codes m = metrics_compare_codes(codes, full, s->n * 3);
        double *a = metrics_alloc(s->n), *b = metrics_alloc(s->n);
        work w = make_work(s, &rows[i].o);
        bench_times t = bench_ratio(run_work, &w, run_work, &base, bench_rounds(7));
        for (size_t k = 0; k < s->n; ++k) a[k] = codes[3 * k + 1], b[k] = full[3 * k + 1];
        bench_row("%s\t%g\t%.3f\t%.4f\t%.2f\t%.5f\t%.3f\t%d", rows[i].kind, rows[i].value, t.ratio, m.rms, m.largest,
                  metrics_ssim(a, b, s->picture.width, s->picture.height), (double)stats.skipped / (double)s->n,
                  strcmp(rows[i].kind, "scales") == 0 && rows[i].value == 8);
        free_work(&w);
        free(codes);
        free(a);
        free(b);
    }
    free_work(&base);
    free(full);
}

static void mesopic(scene *scenes, int count)
{
    bench_table("Mesopic filter against the conversions to Lab and back with the pixel's own white", "picture\ttime_ratio\trms_codes\tover_1_code\tlargest_codes");
    bench_note("time_ratio: to the local operator without it; the log-average counts as 1 cd/m2; error: of the global operator with the thesis' options; pixels without a usable luminance show their neighbours");
    for (int i = 0; i < count; ++i) {
        const scene *s = &scenes[i];
        tonemap_options o = local_options();
        tonemap_stats stats;
        work base = make_work(s, &o);
        o.mesopic = TONEMAP_MESOPIC_LOCAL;
        tonemap_options printed = o; // as the reference: log-average, no white, channels that are cut
        printed.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL;
        printed.metering = TONEMAP_METERING_LOG_AVERAGE;
        printed.white = INFINITY;
        printed.gamut = -1;
        double *codes = codes_of(s, &printed, &stats), *lab = metrics_alloc(s->n * 3), *luminance = metrics_alloc(s->n);
        reference_luminance(luminance, s->picture.pixels, s->n);
        for (size_t k = 0; k < s->n; ++k) {
            double rgb[3], lr = 0.18 * luminance[k] / stats.adapted;
            reference_colour(rgb, s->picture.pixels + 3 * k, lr / (1 + lr),
                             reference_rho(luminance[k] / stats.adapted), 0);
            for (size_t c = 0; c < 3; ++c) lab[3 * k + c] = metrics_code(rgb[c]);
        }
        metrics_codes m = metrics_compare_codes(codes, lab, s->n * 3);
        work w = make_work(s, &o);
        bench_times t = bench_ratio(run_work, &w, run_work, &base, bench_rounds(15));
        bench_row("%s\t%.3f\t%.4f\t%.6f\t%.2f", s->name, t.ratio, m.rms, m.over1, m.largest);
        free(codes);
        free(lab);
        free(luminance);
        free_work(&base);
        free_work(&w);
    }
}

static void ashikhmin(scene *scenes, int count)
{
    bench_table("Ashikhmin's operator: boxes against Gaussians, and one firefly of 1e6 times the largest luminance", "picture\tssim\trms_codes\tfirefly_largest_codes\tfirefly_rms");
    for (int i = 0; i < count; ++i) {
        const scene *s = &scenes[i];
        tonemap_options o = local_options();
        tonemap_stats stats;
        o.operation = TONEMAP_ASHIKHMIN;
        double *codes = luminance_codes(s, &o, &stats), *la = metrics_alloc(s->n), *l = metrics_alloc(s->n),
               *g = metrics_alloc(s->n), low, high, unit;
        work w = make_work(s, &o);
        low = exp2(w.map->state[TONEMAP__LOW]);
        high = exp2(w.map->state[TONEMAP__HIGH]);
        unit = 10 / stats.adapted;
        reference_luminance(l, s->picture.pixels, s->n);
        reference_ashikhmin(la, l, s->picture.width, s->picture.height, 1);
        for (size_t k = 0; k < s->n; ++k) {
            double c0 = reference_capacity(low * unit, 1), c1 = reference_capacity(high * unit, 1);
            g[k] = la[k] > 0 ? metrics_code((reference_capacity(la[k] * unit, 1) - c0) / (c1 - c0) * l[k] / la[k]) : 0;
        }
        metrics_codes m = metrics_compare_codes(codes, g, s->n), f;
        {
            scene lit = *s;
            size_t bytes = s->n * 12, x, y, centre = s->n / 2 + (size_t)s->picture.width / 2;
            float largest = 0;
            lit.picture.pixels = (float *)malloc(bytes);
            memcpy(lit.picture.pixels, s->picture.pixels, bytes);
            for (size_t k = 0; k < s->n * 3; ++k)
                if (lit.picture.pixels[k] > largest) largest = lit.picture.pixels[k];
            for (size_t c = 0; c < 3; ++c) lit.picture.pixels[3 * centre + c] = 1e6f * largest;
            settle(&lit, "firefly");
            double *with = luminance_codes(&lit, &o, NULL);
            for (y = 0; y < (size_t)s->picture.height; ++y)
                for (x = 0; x < (size_t)s->picture.width; ++x) {
                    size_t width = (size_t)s->picture.width, cx = centre % width, cy = centre / width;
                    if ((x > cx ? x - cx : cx - x) <= 17 && (y > cy ? y - cy : cy - y) <= 17)
                        with[y * width + x] = codes[y * width + x];
                }
            f = metrics_compare_codes(with, codes, s->n);
            free(with);
            free(lit.picture.pixels);
        }
        bench_row("%s\t%.4f\t%.3f\t%.3f\t%.4f", s->name, metrics_ssim(codes, g, s->picture.width, s->picture.height), m.rms, f.largest, f.rms);
        free(codes);
        free(la);
        free(l);
        free(g);
        free_work(&w);
    }
}

static void flicker(scene *scenes, int count)
{
    bench_table("Flicker: codes that change when every pixel gets 0.5 % of noise", "picture\toperator\trms_codes\tlargest_codes\tdefault");
    for (int i = 0; i < count; ++i) {
        scene noisy = scenes[i];
        uint64_t seed = 1;
        noisy.picture.pixels = (float *)malloc(scenes[i].n * 12);
        for (size_t k = 0; k < scenes[i].n; ++k) {
            float factor = 1 + 0.01f * (bench_noise(&seed) - 0.5f);
            for (size_t c = 0; c < 3; ++c)
                noisy.picture.pixels[3 * k + c] = scenes[i].picture.pixels[3 * k + c] * factor;
        }
        settle(&noisy, scenes[i].name);
        for (int k = 0; k < 5; ++k) {
            const char *names[5] = {"local, hard scales", "local, soft 0.5", "local, soft 1", "global", "guided"};
            tonemap_options o = local_options();
            o.soft = k == 1 ? 0.5 : k == 2 ? 1 : 0;
            if (k == 3) o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL;
            if (k == 4) o.operation = TONEMAP_GUIDED;
            double *a = luminance_codes(&scenes[i], &o, NULL), *b = luminance_codes(&noisy, &o, NULL);
            metrics_codes m = metrics_compare_codes(a, b, scenes[i].n);
            bench_row("%s\t%s\t%.3f\t%.2f\t%d", scenes[i].name, names[k], m.rms, m.largest, k == 4);
            free(a);
            free(b);
        }
        free(noisy.picture.pixels);
    }
}

/* A step from dark to bright in the middle of 200 columns: how far the codes leave their plateaus, and over how many
   pixels. */
static void halos(void)
{
    enum { W = 200, H = 90 };
    bench_table("Halos at a step edge", "contrast\toperator\tdark_side_codes\tbright_side_codes\twidth_pixels\tdefault");
    bench_plot("Halo on the dark side against contrast; x=contrast; y=dark_side_codes; by=operator; log=x; style=linespoints");
    bench_note("largest distance from the code far from the edge; width: pixels that are more than 2 codes off");
    for (double contrast = 10; contrast <= 1.1e6; contrast *= 10)
        for (int k = 0; k < 6; ++k) {
            const char *names[6] = {"local, hard scales", "local, soft scales", "local, epsilon 0.025",
                                    "local, epsilon 0.0025", "exact Gaussian", "guided"};
            scene s;
            tonemap_options o = local_options();
            tonemap_stats stats;
            double dark = 0, bright = 0;
            int wide = 0;
            image_create(&s.picture, W, H, 3);
            for (size_t i = 0; i < W * H * 3; ++i) s.picture.pixels[i] = i / 3 % W < W / 2 ? 1.0f : (float)contrast;
            settle(&s, "step");
            o.soft = k == 1;
            o.epsilon = k == 2 ? 0.025 : k == 3 ? 0.0025 : 0.05;
            if (k == 5) o.operation = TONEMAP_GUIDED;
            double *codes = luminance_codes(&s, &o, &stats);
            if (k == 4) {
                free(codes);
                codes = gaussian_codes(&s, stats.adapted, 1);
            }
            const double *row = codes + H / 2 * W;
            for (int x = 21; x < W - 21; ++x) {
                double off = fabs(row[x] - row[x < W / 2 ? 22 : W - 23]);
                if (x < W / 2 && off > dark) dark = off;
                if (x >= W / 2 && off > bright) bright = off;
                wide += off > 2;
            }
            bench_row("%g\t%s\t%.2f\t%.2f\t%d\t%d", contrast, names[k], dark, bright, wide, k == 5);
            free(codes);
            image_free(&s.picture);
        }
}

/* ---- the tables of the theses */

static double frames_per_second(const scene *s, const tonemap_options *o)
{
    work w = make_work(s, o);
    double t = bench_time(run_work, &w, bench_rounds(7));
    free_work(&w);
    return 1 / t;
}

static void michael_sizes(const scene *s)
{
    static const int sizes[][2] = {{320, 240}, {640, 480},   {800, 600},  {1024, 768},
                                   {512, 512}, {1024, 1024}, {2048, 2048}};
    static const int published8[4][4] = {{141, 145, 145, 145}, {78, 79, 82, 82}, {55, 58, 59, 59}, {37, 38, 40, 40}};
    static const int published9[7][3] = {{226, 83, 141},   {111, 28, 78},   {80, 19, 55}, {55, 12, 37},
                                         {1719, 360, 503}, {584, 115, 190}, {195, 33, 64}};
    static const double ratio9[7] = {1.68, 2.79, 2.89, 3.08, 1.40, 1.65, 2.00};
    tonemap_options global = local_options(), local = global, selective;
    int count = bench_quick() ? 3 : 7;
    global.operation = TONEMAP_ASHIKHMIN_GLOBAL;
    local.operation = TONEMAP_ASHIKHMIN;
    bench_table("Michael 2010, table 8: frames a second of selective Ashikhmin for thresholds of the Sobel gradient",
                "frame\t0.1\t0.2\t0.5\t1.0\tpublished_0.1\tpublished_0.2\tpublished_0.5\tpublished_1.0");
    bench_note("published: GeForce 6600");
    for (int i = 0; i < 4 && i < count; ++i) {
        scene f;
        double fps[4], t[4] = {0.1, 0.2, 0.5, 1.0};
        enlarge(&f, s, sizes[i][0], sizes[i][1]);
        for (int k = 0; k < 4; ++k) {
            selective = local;
            selective.selective = t[k];
            fps[k] = frames_per_second(&f, &selective);
        }
        bench_row("%d x %d\t%.1f\t%.1f\t%.1f\t%.1f\t%d\t%d\t%d\t%d", sizes[i][0], sizes[i][1], fps[0], fps[1], fps[2], fps[3], published8[i][0],
                  published8[i][1], published8[i][2], published8[i][3]);
        image_free(&f.picture);
    }
    bench_table("Michael 2010, tables 9 and 10: frames a second of global (GTM), local (LTM) and selective (STM) Ashikhmin",
                "frame\tGTM\tLTM\tSTM\tSTM/LTM\tpublished_GTM\tpublished_LTM\tpublished_STM\tpublished_STM/LTM");
    bench_note("published: GeForce 6600, and from 512 x 512 on 8800 GTX; selective mapping pays for Ashikhmin's 19 box means a pixel; for the photographic operator, whose search takes half of the time, the gradient costs what it saves");
    for (int i = 0; i < count; ++i) {
        scene f;
        enlarge(&f, s, sizes[i][0], sizes[i][1]);
        selective = local;
        selective.selective = 0.1;
        double g = frames_per_second(&f, &global), l = frames_per_second(&f, &local),
               st = frames_per_second(&f, &selective);
        bench_row("%d x %d\t%.1f\t%.1f\t%.1f\t%.2f\t%d\t%d\t%d\t%.2f", sizes[i][0], sizes[i][1], g, l, st, st / l, published9[i][0], published9[i][1],
                  published9[i][2], ratio9[i]);
        image_free(&f.picture);
    }
}

static void michael_pictures(scene *scenes, int count)
{
    bench_table("Michael 2010, tables 11 to 16: selective mapping (Sobel > 0.1) against the full local operator, picture by picture",
                "picture\tsize\tdecades\toperator\tGTM_fps\tLTM_fps\tSTM_fps\tSTM/LTM\tsearched\tssim\tflip\tscielab\tgain_GTM\tgain_STM\tpublished_STM/LTM\tpublished_ssim");
    bench_note("flip and scielab: of STM against LTM, in place of VDP; gain = frames a second / (100 flip), eq 20 and 21; decades: 99 % over 1 % quantile; published: Ashikhmin's operator, 8800 GTX");
    for (int i = 0; i < count; ++i)
        for (int kind = 0; kind < 2; ++kind) {
            static const char *const published[3][3] = {
                {"memorial", "2.48", "0.9876"}, {"Desk", "1.63", "0.9925"}, {"belgium", "2.14", "0.9853"}};
            int known = -1;
            for (int k = 0; k < 3 && kind == 0; ++k)
                if (strcmp(published[k][0], scenes[i].name) == 0) known = k;
            const scene *s = &scenes[i];
            int width = s->picture.width, height = s->picture.height;
            tonemap_options local = local_options(), global, selective;
            tonemap_stats stats;
            local.operation = kind ? TONEMAP_PHOTOGRAPHIC_LOCAL : TONEMAP_ASHIKHMIN;
            global = selective = local;
            global.operation = kind ? TONEMAP_PHOTOGRAPHIC_GLOBAL : TONEMAP_ASHIKHMIN_GLOBAL;
            selective.selective = 0.1;
            work l = make_work(s, &local), g = make_work(s, &global), t = make_work(s, &selective);
            bench_times tg = bench_ratio(run_work, &g, run_work, &l, bench_rounds(7)),
                        ts = bench_ratio(run_work, &t, run_work, &l, bench_rounds(7));
            double *cl = codes_of(s, &local, NULL), *cg = codes_of(s, &global, NULL),
                   *cs = codes_of(s, &selective, &stats);
            double *a = metrics_alloc(s->n), *b = metrics_alloc(s->n), flip, flip_global;
            for (size_t k = 0; k < s->n; ++k) a[k] = cs[3 * k + 1], b[k] = cl[3 * k + 1];
            flip = metrics_flip(cs, cl, width, height, 67);
            flip_global = metrics_flip(cg, cl, width, height, 67);
            bench_row("%s\t%d x %d\t%.1f\t%s\t%.1f\t%.1f\t%.1f\t%.2f\t%.3f\t%.4f\t%.4f\t%.3f\t%.1f\t%.1f\t%s\t%s",
                      s->name, width, height, log10(l.stats.high / l.stats.low), kind ? "photographic" : "Ashikhmin",
                      1 / tg.work, 1 / ts.peer, 1 / ts.work, 1 / ts.ratio, (double)stats.searched / (double)s->n,
                      metrics_ssim(a, b, width, height), flip, metrics_scielab(cs, cl, width, height, 23),
                      0.01 / (tg.work * flip_global), 0.01 / (ts.work * flip), known < 0 ? "" : published[known][1],
                      known < 0 ? "" : published[known][2]);
            free_work(&l);
            free_work(&g);
            free_work(&t);
            free(cl);
            free(cg);
            free(cs);
            free(a);
            free(b);
        }
}

struct measuring { work *w; tonemap__job job; };

static void run_measure(void *user)
{
    measuring *m = (measuring *)user;
    tonemap__measure_bands(0, (m->w->map->height + TONEMAP__BAND - 1) / TONEMAP__BAND, 0, &m->job);
}

static void slomp(const scene *s)
{
    static const int sizes[][2] = {{256, 256},   {512, 512},   {720, 480},   {800, 600},   {1024, 768},
                                   {1280, 720},  {1024, 1024}, {1280, 1024}, {1680, 1050}, {1920, 1080},
                                   {1920, 1200}, {2048, 1280}, {2048, 1536}, {2560, 1440}, {2048, 2048}};
    static const double published[15][5] = {
        /* RL, TM.N, TM.MU, TM.MV, FT */
        {0.345, 0.141, 0.152, 0.153, 1.565}, {0.414, 0.337, 0.380, 0.382, 1.715}, {0.452, 0.420, 0.477, 0.481, 1.695},
        {0.482, 0.499, 0.482, 0.493, 1.833}, {0.555, 0.873, 0.972, 0.985, 2.436}, {0.633, 0.963, 1.110, 1.125, 2.725},
        {0.684, 1.120, 1.279, 1.318, 2.912}, {0.715, 1.335, 1.543, 1.565, 3.444}, {0.911, 1.738, 2.061, 2.090, 4.395},
        {0.957, 2.075, 2.409, 2.439, 4.957}, {0.987, 2.258, 2.625, 2.655, 5.377}, {1.041, 2.560, 2.966, 3.028, 5.921},
        {1.108, 3.061, 3.543, 3.585, 6.886}, {1.329, 3.595, 4.131, 4.169, 8.035}, {1.366, 4.088, 4.704, 4.759, 8.830}};
    int count = bench_quick() ? 4 : 15;
    bench_table("Slomp 2012, table A.1, on one core: milliseconds", "width\theight\tRL\tTM.N\tTM.MU\tTM.MV\tFT\tMV_overhead\tpublished_RL\tpublished_TM.N\tpublished_TM.MU\tpublished_TM.MV\tpublished_FT");
    bench_note("RL: relative luminance with its log-average; TM: sums, search, colour and sRGB, without (N), with uniform (MU) and local (MV) mesopic filter; FT: the whole frame with MV; the SAT is part of TM here. Overhead of MV: of the whole frame; published: GTX 280");
    for (int i = 0; i < count; ++i) {
        scene f;
        tonemap_options o = local_options();
        double t[4];
        enlarge(&f, s, sizes[i][0], sizes[i][1]);
        work n = make_work(&f, &o), u, v;
        o.mesopic = TONEMAP_MESOPIC_UNIFORM;
        o.cd_per_unit = 1;
        u = make_work(&f, &o);
        o.mesopic = TONEMAP_MESOPIC_LOCAL;
        v = make_work(&f, &o);
        measuring m;
        m.w = &n;
        m.job.map = n.map;
        m.job.hdr = &f.view;
        t[0] = bench_time(run_measure, &m, bench_rounds(7));
        bench_times tu = bench_ratio(run_work, &u, run_work, &n, bench_rounds(7)),
                    tv = bench_ratio(run_work, &v, run_work, &n, bench_rounds(7));
        bench_row("%d\t%d\t%.3f\t%.3f\t%.3f\t%.3f\t%.3f\t%.3f\t%.3f\t%.3f\t%.3f\t%.3f\t%.3f", sizes[i][0], sizes[i][1],
                  1e3 * t[0], 1e3 * (tu.peer - t[0]), 1e3 * (tu.peer * tu.ratio - t[0]),
                  1e3 * (tv.peer * tv.ratio - t[0]), 1e3 * tv.peer * tv.ratio, tv.ratio - 1, published[i][0],
                  published[i][1], published[i][2], published[i][3], published[i][4]);
        free_work(&n);
        free_work(&u);
        free_work(&v);
        image_free(&f.picture);
    }
}

/* make bench LIB=tonemap ARGS='times accuracy' runs only those tables. */
static int wanted_table(int argc, char **argv, const char *name)
{
    int i;
    for (i = 1; i < argc; ++i)
        if (strcmp(argv[i], name) == 0) return 1;
    return argc < 2;
}

int main(int argc, char **argv)
{
    static const char *const files[7][2] = {{"StillLife", "hdr/StillLife.exr"},  {"Desk", "hdr/Desk.exr"},
                                            {"memorial", "hdr/memorial.exr"},    {"belgium", "hdr/belgium.exr"},
                                            {"night", "env/night.exr"},          {"interior", "env/interior.exr"},
                                            {"GoldenGate", "hdr/GoldenGate.exr"}};
    scene scenes[7];
    int count = 0, wanted = bench_quick() ? 2 : 6;
    bench_start("tonemap.h");
    snprintf(bench_folder, sizeof bench_folder, "/tmp/tonemap_bench_XXXXXX");
    if (!mkdtemp(bench_folder)) return 1;
    for (int i = 0; i < wanted; ++i) count += load(&scenes[count], files[i][0], files[i][1]);
    if (!count) {
        draw_room(&scenes[0].picture, 1240, 846);
        settle(&scenes[0], "room");
        count = 1;
    }
    for (int i = 0; bench_smoke() && i < count; ++i) shrink(&scenes[i]);
    if (wanted_table(argc, argv, "times")) times(&scenes[0]);
    if (wanted_table(argc, argv, "portable")) portable();
    if (wanted_table(argc, argv, "accuracy")) accuracy(scenes, count);
    if (wanted_table(argc, argv, "range")) luminance_range(&scenes[0]);
    if (wanted_table(argc, argv, "pareto")) pareto(&scenes[0]);
    if (wanted_table(argc, argv, "mesopic")) mesopic(scenes, count);
    if (wanted_table(argc, argv, "ashikhmin")) ashikhmin(scenes, count);
    if (wanted_table(argc, argv, "flicker")) flicker(scenes, count);
    if (wanted_table(argc, argv, "halos")) halos();
    if (wanted_table(argc, argv, "michael")) {
        michael_sizes(&scenes[0]);
        michael_pictures(bench_quick() ? &scenes[count - 1] : scenes, bench_quick() ? 1 : count > 4 ? 4 : count);
    }
    if (wanted_table(argc, argv, "slomp")) slomp(&scenes[0]);
    for (int i = 0; i < count; ++i) image_free(&scenes[i].picture);
    char command[128];
    snprintf(command, sizeof command, "rm -rf %s", bench_folder);
    return shell(command) ? 0 : 1;
}
