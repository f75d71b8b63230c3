/* Error against run time of ssao_sat.h, and of what others use, against a ray tracer.

   FIT=1 in the environment fits the parameters of the comparators first (minutes) and prints them as a table; FIT=only
   does no more. The ray-traced pictures are kept in build/, so that only the first run draws them. */
#define SAT_IMPLEMENTATION
#define SSAO_SAT_IMPLEMENTATION
#include "ssao_sat.h"
#include "bench.h"
#include "mesh.h"
#include "reference_ssao.h"
#include "peers_ssao.h"

/* Peers at the vector width of the slabs, as fitted by FIT=1: radius, second parameter, gain, power. */
static const peer_method peers[] = {
    {"XeGTAO low 1x(2+2), half", PEER_GTAO, 1, 2, 1, 1, 1.7f, 0.4f, 0.818f, 2},
    {"XeGTAO medium 2x(2+2), half", PEER_GTAO, 2, 2, 1, 1, 1.7f, 0.4f, 0.268f, 8},
    {"XeGTAO high 3x(3+3), half", PEER_GTAO, 3, 3, 1, 1, 1.7f, 0.4f, 0.407f, 4},
    {"XeGTAO ultra 9x(3+3), half", PEER_GTAO, 9, 3, 1, 1, 1.7f, 0.4f, 0.407f, 4},
    {"XeGTAO high, 3 denoiser passes, half", PEER_GTAO, 3, 3, 3, 1, 1.7f, 0.4f, 0.268f, 6},
    {"XeGTAO high 3x(3+3), full", PEER_GTAO, 3, 3, 3, 0, 1.7f, 0.4f, 0.407f, 4},
    {"XeGTAO ultra 9x(3+3), full", PEER_GTAO, 9, 3, 1, 0, 1.7f, 0.4f, 0.407f, 4},
    {"bitmask 3x(3+3), half", PEER_BITMASK, 3, 3, 1, 1, 1.4f, 0.7f, 0.538f, 4},
    {"bitmask 4x(8+8), half", PEER_BITMASK, 4, 8, 1, 1, 1.4f, 0.7f, 0.712f, 2},
    {"bitmask 4x(8+8), full", PEER_BITMASK, 4, 8, 1, 0, 1.4f, 0.7f, 0.712f, 2},
    {"HBAO 16x8, half", PEER_HBAO, 16, 8, 1, 1, 1.4f, 0.1f, 1.646f, 1},
    {"HBAO 16x8, full", PEER_HBAO, 16, 8, 1, 0, 1.4f, 0.1f, 1.646f, 1}};

enum {
    FITTED = 3,
    IMAGES = FITTED * REF_RADII,
    OURS = 9,
    PEERS = sizeof peers / sizeof peers[0],
    FIRST_PEER = OURS + REF_METHODS,
    XEGTAO_HALF = FIRST_PEER + 2,
    BITMASK_HALF = FIRST_PEER + 7,
    HBAO_HALF = FIRST_PEER + 10,
    ALL = FIRST_PEER + PEERS
};

static ref_picture pictures[REF_SCENES];
static int side;
static size_t pixels;
static float *out, *other;

/* ---- pictures ---- */

static void draw_pictures(int rays)
{
    int i;
    for (i = 0; i < REF_SCENES; i++) pictures[i] = ref_draw_kept(i, side, rays);
}

/* ---- methods ---- */

typedef struct method {
    const char *name;
    int theirs;                /* ref_method, REF_METHODS: a peer, or -1 */
    peer_method peer;
    ssao_sat_options options;
    ref_fit fit;
    int is_default;
} method;

static method methods[ALL];

static method *add(int *count, const char *name, ssao_sat_method m, int half)
{
    method *e = &methods[(*count)++];
    memset(e, 0, sizeof *e);
    e->name = name;
    e->theirs = -1;
    e->options = ssao_sat_defaults();
    e->options.method = m;
    e->options.half_resolution = half;
    return e;
}

static void list_methods(void)
{
    int n = 0, i;
    add(&n, "minimalist", SSAO_SAT_MINIMALIST, 0);
    add(&n, "normal-guided", SSAO_SAT_NORMAL_GUIDED, 0);
    add(&n, "refined, as printed", SSAO_SAT_REFINED, 0)->options.as_printed = 1;
    add(&n, "refined", SSAO_SAT_REFINED, 0);
    add(&n, "plane, one box", SSAO_SAT_PLANE, 0)->options.plane_boxes = 1;
    add(&n, "plane 2x2", SSAO_SAT_PLANE, 0);
    add(&n, "slabs, full resolution", SSAO_SAT_SLABS, 0);
    add(&n, "slabs, 4 of them", SSAO_SAT_SLABS, 1)->options.slabs = 4;
    add(&n, "slabs", SSAO_SAT_SLABS, 1)->is_default = 1;
    for (i = 0; i < REF_METHODS; i++) {
        method *e = &methods[n++];
        memset(e, 0, sizeof *e);
        e->name = ref_method_names[i];
        e->theirs = i;
        e->fit = ref_fits[i];
    }
    for (i = 0; i < (int)PEERS; i++) {
        method *e = &methods[n++];
        memset(e, 0, sizeof *e);
        e->name = peers[i].name;
        e->theirs = REF_METHODS;
        e->peer = peers[i];
        e->fit.parameters[0] = peers[i].reach;
        e->fit.parameters[1] = peers[i].second;
        e->fit.gain = peers[i].gain;
        e->fit.power = peers[i].power;
    }
}

/* Seconds of processor time: all of this is one thread, and the machine may be busy. */
static double processor_clock(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Occlusion by a peer, before gain and power. */
static double apply_peer(const method *m, const ref_picture *p, double radius)
{
    static peer_picture pictures_by_half[2];
    static ssao_sat *frame;
    peer_picture *g = &pictures_by_half[m->peer.half];
    peer_method use = m->peer;
    int step = use.half ? 2 : 1, columns = (p->width + step - 1) / step, rows = (p->height + step - 1) / step;
    double seconds;
    size_t i;
    if (g->width != columns || g->height != rows) {
        ssao_sat_options o = ssao_sat_defaults();
        peer_close(g);
        peer_open(g, columns, rows);
        o.method = SSAO_SAT_PLANE;
        if (use.half) ssao_sat_destroy(frame);
        if (use.half && ssao_sat_create(&frame, p->width, p->height, &o) != SAT_OK) exit(1);
    }
    use.reach = m->fit.parameters[0];
    use.second = m->fit.parameters[1];
    use.gain = use.power = 1;
    seconds = peer_apply(g, frame, &use, p, (float)radius, out, processor_clock);
    for (i = 0; i < (size_t)p->width * (size_t)p->height; i++) out[i] = 1 - out[i];
    return seconds;
}

/* Seconds of one image (create left out). Accessibility in `out`, or the comparators' occlusion. */
static double apply(const method *m, const ref_picture *p, double radius)
{
    ssao_sat_input in = ssao_sat_input_linear(p->z, p->width, p->height, p->fov);
    ssao_sat_options o = m->options;
    ssao_sat *ao = NULL;
    double start = processor_clock();
    if (m->theirs == REF_METHODS) return apply_peer(m, p, radius);
    if (m->theirs >= 0) {
        ref_run((ref_method)m->theirs, &m->fit, p, (float)radius, out, other);
        return processor_clock() - start;
    }
    in.normals = p->normals;
    o.radius = radius;
    if (ssao_sat_create(&ao, p->width, p->height, &o) != SAT_OK) exit(1);
    ssao_sat_apply(ao, out, 0, &in, NULL); /* pages and caches warm */
    start = processor_clock();
    if (ssao_sat_apply(ao, out, 0, &in, NULL) != SAT_OK) exit(1);
    start = processor_clock() - start;
    ssao_sat_destroy(ao);
    return start;
}

/* ---- fits: gain and power for given occlusion, over the pictures of some scenes ---- */

enum { GAINS = 40, POWERS = 8 };
static const float powers[POWERS] = {0.5f, 1, 1.5f, 2, 3, 4, 6, 8};
static float gain_of(int g) { return 0.05f * powf(1.15f, (float)g); }

typedef struct error_table { double rmse[GAINS][POWERS]; } error_table;
static float *occlusions[REF_SCENES * REF_RADII];

/* Occlusion before the tone curve of the method, all radii. */
static void occlude(const method *m, int scenes)
{
    const ssao_sat__fit *fit =
        &ssao_sat__fits[m->options.method == SSAO_SAT_PLANE && m->options.plane_boxes == 1 ? 5
                                                                                           : (int)m->options.method];
    int scene, r;
    size_t i;
    for (scene = 0; scene < scenes; scene++)
        for (r = 0; r < REF_RADII; r++) {
            float *o = occlusions[scene * REF_RADII + r];
            apply(m, &pictures[scene], (double)pictures[scene].radius[r]);
            for (i = 0; i < pixels; i++)
                o[i] = m->theirs >= 0 ? out[i] : (1 - powf(out[i], 1 / fit->power)) / fit->gain;
        }
}

static void tabulate(error_table *t, int image)
{
    const ref_picture *p = &pictures[image / REF_RADII];
    const float *truth = p->ao[image % REF_RADII], *o = occlusions[image];
    int g, k;
    for (g = 0; g < GAINS; g++)
        for (k = 0; k < POWERS; k++) {
            double sum = 0;
            size_t i, n = 0;
            for (i = 0; i < pixels; i += 61) {
                float v = ref_clamp(1 - gain_of(g) * o[i], 0, 1), e;
                if (!(p->z[i] < 1e18f)) continue;
                v = k == 0 ? sqrtf(v) : k == 1 ? v : k == 2 ? v * sqrtf(v) : k == 3 ? v * v : powf(v, powers[k]);
                e = v - truth[i];
                sum += (double)(e * e);
                n++;
            }
            t->rmse[g][k] = sqrt(sum / (double)n);
        }
}

/* The best joint gain and power on all fitted scenes but one (-1: on all); their mean RMSE. */
static double best_tone(const error_table *t, int left_out, int *gain, int *power)
{
    double best = 1e9;
    int g, k, i;
    for (g = 0; g < GAINS; g++)
        for (k = 0; k < POWERS; k++) {
            double sum = 0;
            for (i = 0; i < IMAGES; i++) sum += i / REF_RADII == left_out ? 0 : t[i].rmse[g][k];
            sum /= left_out < 0 ? IMAGES : IMAGES - REF_RADII;
            if (sum < best) { best = sum; *gain = g; *power = k; }
        }
    return best;
}

/* Grids wide enough to have the optimum inside (the last column says so; a bias or
   falloff of 0 is an end by itself): radius, and what the second parameter is. */
enum { RADII = 7, SECONDS = 6 };
static const float first_grid[RADII] = {0.7f, 1, 1.4f, 1.7f, 2, 2.5f, 3.2f},
                   second_grid[4][SECONDS] = {{0, 0.01f, 0.03f, 0.06f, 0.1f, 0.2f},     /* SSAO: bias */
                                              {0, 0.04f, 0.1f, 0.2f, 0.3f, 0.45f},      /* HBAO: tangent bias */
                                              {0, 0.15f, 0.3f, 0.45f, 0.6f, 0.8f},      /* GTAO: falloff start, share */
                                              {0.1f, 0.2f, 0.4f, 0.7f, 1.2f, 2}};       /* bitmask: thickness */

static const float *second_of(const method *m)
{
    if (m->theirs < REF_METHODS) return second_grid[m->theirs % 3];
    return second_grid[m->peer.kind == PEER_GTAO ? 2 : m->peer.kind == PEER_HBAO ? 1 : 3];
}

static double try_fit(method *m, float reach, float second, int *g, int *p)
{
    static error_table t[IMAGES];
    int k;
    m->fit.parameters[0] = reach;
    m->fit.parameters[1] = m->theirs == REF_METHODS && m->peer.kind == PEER_GTAO ? 1 - second : second;
    occlude(m, FITTED);
    for (k = 0; k < IMAGES; k++) tabulate(&t[k], k);
    return best_tone(t, -1, g, p);
}

/* The second parameter on its grid for the radius in the middle, then the radius, then the second again. */
static void fit_one(method *m)
{
    const float *second = second_of(m);
    double least = 1e9;
    int a = 3, b = 2, g = 0, p = 0, best_a = a, best_b = b, best_g = 0, best_p = 0, turn, i;
    for (turn = 0; turn < 3; turn++) {
        for (i = 0; i < (turn == 1 ? RADII : SECONDS); i++) {
            int u = turn == 1 ? i : best_a, v = turn == 1 ? best_b : i;
            double e = try_fit(m, first_grid[u], second[v], &g, &p);
            if (e >= least) continue;
            least = e;
            a = u; b = v; best_g = g; best_p = p;
        }
        best_a = a;
        best_b = b;
    }
    try_fit(m, first_grid[best_a], second[best_b], &g, &p);
    m->fit.gain = gain_of(best_g);
    m->fit.power = powers[best_p];
    bench_row("%s\t%g\t%g\t%.3f\t%g\t%.4f\t%d", m->name, (double)m->fit.parameters[0],
              (double)m->fit.parameters[1], (double)m->fit.gain, (double)m->fit.power, least,
              best_a > 0 && best_a < RADII - 1 && (best_b > 0 || second[0] == 0) && best_b < SECONDS - 1);
}

/* Each kernel's parameters at half resolution; gain and power for every variant. */
static void fit_comparators(void)
{
    int i, k, g, p;
    bench_table("Fit of the comparators", "method\tradius\tsecond\tgain\tpower\trmse\tinside_grid");
    for (i = 0; i < 3; i++) fit_one(&methods[OURS + REF_SSAO_HALF + i]);
    fit_one(&methods[XEGTAO_HALF]);
    fit_one(&methods[BITMASK_HALF]);
    fit_one(&methods[HBAO_HALF]);
    for (i = FIRST_PEER; i < ALL; i++)
        for (k = XEGTAO_HALF; k < ALL; k++) {
            float second;
            double e;
            if (k == i || (k != XEGTAO_HALF && k != BITMASK_HALF && k != HBAO_HALF)) continue;
            if (methods[k].peer.kind != methods[i].peer.kind) continue;
            second = methods[k].fit.parameters[1];
            e = try_fit(&methods[i], methods[k].fit.parameters[0],
                        methods[i].peer.kind == PEER_GTAO ? 1 - second : second, &g, &p);
            methods[i].fit.gain = gain_of(g);
            methods[i].fit.power = powers[p];
            bench_row("%s\t%g\t%g\t%.3f\t%g\t%.4f\t%d", methods[i].name, (double)methods[i].fit.parameters[0],
                      (double)methods[i].fit.parameters[1], (double)methods[i].fit.gain,
                      (double)methods[i].fit.power, e, 1);
        }
}

/* ---- tables ---- */

typedef struct score { double rmse, ssim, held_out, other[REF_SCENES - FITTED], seconds[16]; } score;

/* The same three radii of the scenes that no method was fitted to, and each fitted scene with gain and power from the
   other two. */
static void measure_errors(const method *m, score *s)
{
    static error_table t[IMAGES];
    int i, scene, g, p;
    size_t k;
    memset(s, 0, sizeof *s);
    occlude(m, FITTED);
    for (i = 0; i < IMAGES; i++) tabulate(&t[i], i);
    for (scene = 0; scene < FITTED; scene++) {
        best_tone(t, scene, &g, &p);
        for (i = 0; i < REF_RADII; i++) s->held_out += t[scene * REF_RADII + i].rmse[g][p] / IMAGES;
    }
    for (i = 0; i < REF_SCENES * REF_RADII; i++) {
        const ref_picture *q = &pictures[i / REF_RADII];
        apply(m, q, (double)q->radius[i % REF_RADII]);
        if (m->theirs >= 0) ref_tone(out, pixels, m->fit.gain, m->fit.power);
        for (k = 0; k < pixels; k++)
            if (!(q->z[k] < 1e18f)) out[k] = 1;
        if (i >= IMAGES) s->other[i / REF_RADII - FITTED] += ref_rmse(q, out, q->ao[i % REF_RADII]) / REF_RADII;
        else {
            s->rmse += ref_rmse(q, out, q->ao[i % REF_RADII]) / IMAGES;
            s->ssim += ref_ssim(q, out, q->ao[i % REF_RADII]) / IMAGES;
        }
    }
}

/* Time of the nine pictures, all methods in turn, so that each ratio is of one run; the median over the rounds. */
static void measure_times(score *scores, int rounds)
{
    int r, m, i;
    for (r = 0; r < rounds; r++)
        for (m = 0; m < ALL; m++)
            for (scores[m].seconds[r] = 0, i = 0; i < IMAGES; i++)
                scores[m].seconds[r] +=
                    apply(&methods[m], &pictures[i / REF_RADII], (double)pictures[0].radius[i % REF_RADII]);
}

static double ratio(const score *a, const score *b, int rounds)
{
    double v[16];
    int r;
    for (r = 0; r < rounds; r++) v[r] = a->seconds[r] / b->seconds[r];
    return support_median(v, rounds);
}

static void error_against_time(void)
{
    static score scores[ALL];
    int m, rounds = bench_quick() ? 1 : 3;
    for (m = 0; m < ALL; m++) measure_errors(&methods[m], &scores[m]);
    measure_times(scores, rounds);
    bench_table("Error against time: 3 scenes x radii 0.1, 0.25, 0.6, one thread",
                "method\ttime_ratio\trmse\tssim\trmse_held_out\trmse_other_scene\trmse_grass\trmse_hall\tms\tto_xegtao_half_ratio\tto_scalar_gtao_half_ratio\tto_hbao_half_ratio\tdefault");
    bench_plot("RMSE against time (1 = minimalist); x=time_ratio; y=rmse; by=method; log=xy; picture=plot_ssao_sat");
    bench_plot("RMSE on a scene held out; x=time_ratio; y=rmse_other_scene; by=method; log=xy");
    bench_note("rmse: one parameter set a method for all nine pictures. rmse_held_out: gain and power from the other two scenes. rmse_other_scene: "
               "the same parameters on a scene with other objects that nothing was fitted to; rmse_grass: grass and poles; rmse_hall: a hall of 40 m. "
               "XeGTAO, bitmasks and HBAO 16x8 are four lanes wide as the slabs are, at half resolution in the slabs' own frame "
               "(reading, upsample); names with + and a blur are plain scalar C.");
    for (m = 0; m < ALL; m++)
        bench_row("%s\t%.2f\t%.4f\t%.3f\t%.4f\t%.4f\t%.4f\t%.4f\t%.1f\t%.3f\t%.3f\t%.3f\t%d", methods[m].name,
                  ratio(&scores[m], &scores[0], rounds), scores[m].rmse, scores[m].ssim, scores[m].held_out,
                  scores[m].other[0], scores[m].other[1], scores[m].other[2], scores[m].seconds[0] / IMAGES * 1e3,
                  ratio(&scores[m], &scores[XEGTAO_HALF], rounds),
                  ratio(&scores[m], &scores[OURS + REF_GTAO_HALF], rounds),
                  ratio(&scores[m], &scores[HBAO_HALF], rounds), methods[m].is_default);
}

static void radius_table(void)
{
    static const int which[] = {0, 5, 8, OURS + REF_SSAO, XEGTAO_HALF};
    int i, r, k, rounds = bench_rounds(5);
    bench_table("Time against radius (three scenes together)", "method\tradius\tms\tto_smallest_ratio");
    bench_plot("Time against radius; x=radius; y=ms; by=method; style=linespoints");
    for (i = 0; i < 5; i++) {
        double base = 0;
        for (r = 0; r < REF_RADII; r++) {
            double t[16];
            for (k = 0; k < rounds; k++) t[k] = apply(&methods[which[i]], &pictures[0], (double)pictures[0].radius[r]) +
                                               apply(&methods[which[i]], &pictures[1], (double)pictures[0].radius[r]) +
                                               apply(&methods[which[i]], &pictures[2], (double)pictures[0].radius[r]);
            t[0] = support_median(t, rounds);
            if (r == 0) base = t[0];
            bench_row("%s\t%g\t%.2f\t%.2f", methods[which[i]].name, (double)pictures[0].radius[r], t[0] * 1e3, t[0] / base);
        }
    }
}

/* Slomp 2012, figure 5.16 and table 5.1: every method at sizes up to 2048; half-resolution variants as in the
   thesis. */
static void resolution_table(void)
{
    static const char *const names[4] = {"traditional", "horizon-based", "refined (5.3.5)", "slabs"},
                             *const published[4] = {"1.71", "2.44", "1", ""};
    int size, top = bench_quick() ? 256 : 2048, first = bench_quick() ? 128 : 256, m, half_size = 0;
    double half[4] = {0, 0, 0, 0};
    bench_table("Figure 5.16 re-made: time against resolution, scene 0, R = 0.25", "method\tsize\tms\tto_minimalist_ratio");
    bench_plot("Time against resolution; x=size; y=ms; by=method; log=xy; style=linespoints");
    if (bench_smoke()) top = first;
    for (size = first; size <= top; size *= 2) {
        ref_scene s;
        ref_picture p;
        double base = 0;
        free(out);
        free(other);
        out = (float *)malloc((size_t)size * (size_t)size * 4);
        other = (float *)malloc((size_t)size * (size_t)size * 4);
        ref_open(&s, 0);
        p = ref_draw(&s, size, size, 0, 0, ref_make(0, 0, 0), 2);
        ref_close(&s);
        for (m = 0; m < ALL; m++) {
            double t = apply(&methods[m], &p, 0.25), again = size < 2048 ? apply(&methods[m], &p, 0.25) : t;
            if (again < t) t = again;
            if (m == 0) base = t;
            bench_row("%s\t%d\t%.2f\t%.2f", methods[m].name, size, t * 1e3, t / base);
        }
        if (size == 1024 || bench_quick()) {
            method refined = methods[3];
            refined.options.half_resolution = 1;
            half_size = size;
            half[0] = apply(&methods[OURS + REF_SSAO_HALF], &p, 0.25);
            half[1] = apply(&methods[OURS + REF_HBAO_HALF], &p, 0.25);
            half[2] = apply(&refined, &p, 0.25);
            half[3] = apply(&methods[8], &p, 0.25);
        }
        ref_free(&p);
    }
    bench_table("Table 5.1 re-made: all at half resolution", "method\tsize\tms\tto_refined_ratio\tpublished_ratio");
    bench_note("published: whole frames at 1024 x 1024 on a GTX 280");
    for (m = 0; m < 4; m++) bench_row("%s\t%d\t%.2f\t%.2f\t%s", names[m], half_size, half[m] * 1e3, half[m] / half[2], published[m]);
}

typedef struct job { ssao_sat *ao; ssao_sat_input in; float *bent; } job;
static void run_job(void *user)
{
    job *j = (job *)user;
#ifndef SSAO_SAT_NO_BENT
    if (j->bent) { ssao_sat_apply_bent(j->ao, out, 0, j->bent, 0, &j->in, NULL); return; }
#endif
    ssao_sat_apply(j->ao, out, 0, &j->in, NULL);
}

static void leave_out_table(void)
{
    int scene, r;
    bench_table("Leaving out regions that are one plane", "scene\tradius\tflat_percent\twithout_to_with_ratio\tlargest_difference\tslabs_skipped_percent");
    for (scene = 0; scene < REF_SCENES; scene++)
        for (r = 0; r < REF_RADII; r++) {
            const ref_picture *p = &pictures[scene];
            ssao_sat_options o = ssao_sat_defaults();
            ssao_sat_stats stats;
            job a, b;
            bench_times t;
            double worst = 0;
            size_t i;
            a.in = ssao_sat_input_linear(p->z, side, side, p->fov);
            a.in.normals = p->normals;
            a.bent = NULL;
            b = a;
            o.radius = (double)p->radius[r];
            ssao_sat_create(&a.ao, side, side, &o);
            o.skip_flat = 0;
            ssao_sat_create(&b.ao, side, side, &o);
            t = bench_ratio(run_job, &b, run_job, &a, bench_rounds(7));
            ssao_sat_apply(a.ao, other, 0, &a.in, &stats);
            ssao_sat_apply(b.ao, out, 0, &b.in, NULL);
            for (i = 0; i < pixels; i++) worst = fmax(worst, fabs((double)(out[i] - other[i])));
            bench_row("%d\t%g\t%.1f\t%.2f\t%.1e\t%.1f", scene, o.radius,
                      100.0 * (double)stats.flat / (double)stats.pixels, t.ratio, worst,
                      100.0 * (double)stats.slabs_skipped /
                          (double)(stats.slabs_skipped + stats.slabs_visited + !stats.slabs_visited));
            ssao_sat_destroy(a.ao);
            ssao_sat_destroy(b.ao);
        }
}

#ifndef SSAO_SAT_NO_BENT
static void bent_table(void)
{
    float *bent = (float *)malloc(pixels * 12);
    int scene, r, k;
    bench_table("Bent normals", "scene\tradius\ttime_ratio\tangle_degrees\tplain_normal_degrees");
    for (scene = 0; scene < REF_SCENES; scene++)
        for (r = 0; r < REF_RADII; r++) {
            const ref_picture *p = &pictures[scene];
            ssao_sat_options o = ssao_sat_defaults();
            job a, b;
            bench_times t;
            double sum = 0, plain = 0;
            size_t i, n = 0;
            a.in = ssao_sat_input_linear(p->z, side, side, p->fov);
            a.in.normals = p->normals;
            a.bent = NULL;
            o.radius = (double)p->radius[r];
            ssao_sat_create(&a.ao, side, side, &o);
            b = a;
            b.bent = bent;
            t = bench_ratio(run_job, &b, run_job, &a, bench_rounds(7));
            for (i = 0; i < pixels; i++) {
                double c = 0, d = 0;
                if (!(p->z[i] < 1e18f)) continue;
                for (k = 0; k < 3; k++) {
                    c += (double)(bent[3 * i + (size_t)k] * p->bent[r][3 * i + (size_t)k]);
                    d += (double)(p->normals[3 * i + (size_t)k] * p->bent[r][3 * i + (size_t)k]);
                }
                sum += acos(fmin(fmax(c, -1), 1)) * 57.29578;
                plain += acos(fmin(fmax(d, -1), 1)) * 57.29578;
                n++;
            }
            bench_row("%d\t%g\t%.3f\t%.2f\t%.2f", scene, o.radius, t.ratio, sum / (double)n, plain / (double)n);
            ssao_sat_destroy(a.ao);
        }
    free(bent);
}
#endif

/* How much the picture changes while the camera glides: mean |difference| of successive frames where depth hardly
   changes. */
enum { GLIDING = 6 };
static const int gliding[GLIDING] = {5, 8, XEGTAO_HALF, FIRST_PEER + 5, BITMASK_HALF, HBAO_HALF};

static void tone(const method *m)
{
    if (m->theirs >= 0) ref_tone(out, pixels, m->fit.gain, m->fit.power);
}

/* Where the errors are: the room at the middle radius. The sky is left as it is. */
static void error_pictures(void)
{
    static const struct { int method; const char *name, *caption;
    } shown[3] = {{8, "ssao_sat_default", "slabs, the default"},
                  {2, "ssao_sat_published", "refined, as published"},
                  {XEGTAO_HALF, "ssao_sat_peer", "XeGTAO high, half resolution"}};
    const ref_picture *p = &pictures[1];
    const float *truth = p->ao[1];
    int m;
    size_t i;
    bench_picture("ssao_sat_truth", "reference: rays. Black: blocked, white: open", truth, side, side, BENCH_GREY, 0, 1);
    for (m = 0; m < 3; m++) {
        apply(&methods[shown[m].method], p, (double)p->radius[1]);
        tone(&methods[shown[m].method]);
        for (i = 0; i < pixels; i++) out[i] = p->z[i] < 1e18f ? out[i] - truth[i] : 0;
        bench_picture(shown[m].name, shown[m].caption, out, side, side, BENCH_SIGNED, -0.3, 0.3);
    }
}

static void motion_of_scene(int scene, double *change)
{
    enum { FRAMES = 5 };
    float *last = (float *)malloc(GLIDING * pixels * 4), *last_z = (float *)malloc(pixels * 4);
    long count = 0;
    int f, i;
    size_t k;
    ref_scene s;
    for (i = 0; i < GLIDING; i++) change[i] = 0;
    ref_open(&s, scene);
    for (f = 0; f < FRAMES; f++) {
        ref_picture p = ref_draw(&s, side, side, 0, 0, ref_make(0.0015f * (float)f, 0.0007f * (float)f, 0), 2);
        for (i = 0; i < GLIDING; i++) {
            float *before = last + (size_t)i * pixels;
            apply(&methods[gliding[i]], &p, 0.25);
            tone(&methods[gliding[i]]);
            for (k = 0; k < pixels && f > 0; k++) {
                if (!(p.z[k] < 1e18f) || !(fabsf(p.z[k] - last_z[k]) < 0.005f * p.z[k])) continue;
                change[i] += fabs((double)(out[k] - before[k]));
                count += i == 0;
            }
            memcpy(before, out, pixels * 4);
        }
        memcpy(last_z, p.z, pixels * 4);
        ref_free(&p);
    }
    ref_close(&s);
    for (i = 0; i < GLIDING; i++) change[i] /= (double)(count ? count : 1);
    free(last);
    free(last_z);
}

static void motion_table(void)
{
    static const int scenes[4] = {0, 1, 4, 5};
    double change[4][GLIDING];
    int i, k;
    for (k = 0; k < 4; k++) motion_of_scene(scenes[k], change[k]);
    bench_table("Camera in motion, a quarter of a pixel a frame: mean change", "method\tcorner\troom\tgrass\thall\troom_to_slabs_ratio");
    for (i = 0; i < GLIDING; i++)
        bench_row("%s\t%.5f\t%.5f\t%.5f\t%.5f\t%.2f", methods[gliding[i]].name, change[0][i], change[1][i], change[2][i],
                  change[3][i], change[1][i] / change[1][1]);
}

/* Scene 2 with and without a bird in its sky, so near that it is the nearest of all: what changes elsewhere. */
static void bird_table(void)
{
    const ref_picture *p = &pictures[2];
    float *z = (float *)malloc(pixels * 4), *before = (float *)malloc(pixels * 4);
    int i, x, y, wing = side / 64 + 1, far_off = side / 4;
    bench_table("A bird in the sky of the field: largest and mean change more than a quarter of the picture away", "method\tlargest\tmean");
    for (i = 0; i < GLIDING; i++) {
        ref_picture with = *p;
        double largest = 0, sum = 0;
        long count = 0;
        memcpy(z, p->z, pixels * 4);
        for (y = side / 16; y < side / 16 + wing; y++)
            for (x = side / 2; x < side / 2 + 2 * wing; x++) z[(size_t)y * (size_t)side + (size_t)x] = 0.3f;
        with.z = z;
        apply(&methods[gliding[i]], p, 0.25);
        tone(&methods[gliding[i]]);
        memcpy(before, out, pixels * 4);
        apply(&methods[gliding[i]], &with, 0.25);
        tone(&methods[gliding[i]]);
        for (y = side / 16 + far_off; y < side; y++)
            for (x = 0; x < side; x++) {
                size_t at = (size_t)y * (size_t)side + (size_t)x;
                double d = fabs((double)(out[at] - before[at]));
                largest = fmax(largest, d);
                sum += d;
                count++;
            }
        bench_row("%s\t%.5f\t%.6f", methods[gliding[i]].name, largest, sum / (double)count);
    }
    free(z);
    free(before);
}

/* Largest error of means of 1/z over 17 x 17 pixels, in depth steps R / z^2, by table format, where R covers a
   pixel. */
static double format_error(const float *z, int size, int kind)
{
    float *result = (float *)malloc((size_t)size * (size_t)size * 4);
    ssao_sat_options o = ssao_sat_defaults();
    ssao_sat_input in = ssao_sat_input_linear(z, size, size, 0.8);
    ssao_sat *ao;
    uint64_t state = 1;
    double worst = 0;
    int k;
    o.method = SSAO_SAT_PLANE;
    o.half_resolution = 0;
    o.float_table = kind;
    o.max_pixels = 8;
    if (ssao_sat_create(&ao, size, size, &o) != SAT_OK || ssao_sat_apply(ao, result, 0, &in, NULL) != SAT_OK) exit(1);
    for (k = 0; k < 4000; k++) {
        int x = support_below(&state, size - 17), y = support_below(&state, size - 17), u, v;
        ssao_sat__region r;
        double sum = 0, centre = (double)z[(size_t)(y + 8) * (size_t)size + (size_t)(x + 8)];
        ssao_sat_stats stats;
        if (!(0.25 * 0.5 * size / tan(0.4) > centre)) continue;
        memset(&stats, 0, sizeof stats);
        r.stats = &stats;
        ssao_sat__set_region(&r, ao, (float)x + 8.5f, (float)y + 8.5f, 8.5f);
        ssao_sat__look_up(&r, ao, 4, 0);
        for (v = r.y[0]; v < r.y[4]; v++)
            for (u = r.x[0]; u < r.x[4]; u++) sum += 1 / (double)z[(size_t)v * (size_t)size + (size_t)u];
        sum /= (r.x[4] - r.x[0]) * (r.y[4] - r.y[0]);
        worst = fmax(worst, fabs((double)ssao_sat__mean(&r, ao, 0, 0, 4) - sum) * centre * centre / 0.25);
    }
    ssao_sat_destroy(ao);
    free(result);
    return worst;
}

/* The formats of 5.5 and 4.6 against integers modulo 2^32: larger tables, and deeper scenes. */
static void format_table(void)
{
    static const char *const names[] = {"uint32 modulo 2^32", "float", "float less mean"};
    int size, kind, decades;
    bench_table("Largest error of a box mean of 1/z, in units of one depth step R / z^2, R = 0.25 (1/10 shows)", "table\tsize\tlargest_error");
    bench_plot("Table formats; x=size; y=largest_error; by=table; log=xy; style=linespoints");
    for (size = 128; size <= (bench_smoke() ? 128 : bench_quick() ? 512 : 4096); size *= 2)
        for (kind = 0; kind < 3; kind++) {
            size_t n = (size_t)size * (size_t)size, i;
            float *z = (float *)malloc(n * 4);
            for (i = 0; i < n; i++)
                z[i] =
                    pictures[0].z[(i / (size_t)size) % (size_t)side * (size_t)side + (i % (size_t)size) % (size_t)side];
            bench_row("%s\t%d\t%.2e", names[kind], size, format_error(z, size, kind));
            free(z);
        }
    bench_table("The same against the range of depth: 512 x 512 pixels, the farthest so many decades behind the nearest", "table\tdecades\tlargest_error");
    bench_plot("Table formats; x=decades; y=largest_error; by=table; log=y; style=linespoints");
    for (decades = 1; decades <= 6; decades++)
        for (kind = 0; kind < 3; kind++) {
            float *z = (float *)malloc(512 * 512 * 4);
            uint64_t state = 7;
            int i;
            for (i = 0; i < 512 * 512; i++)
                z[i] =
                    powf(10, (float)decades * ((float)(i / 512) / 511 * 0.9f + 0.1f * (float)support_uniform(&state)));
            bench_row("%s\t%d\t%.2e", names[kind], decades, format_error(z, 512, kind));
            free(z);
        }
}

int main(void)
{
    const char *fit = getenv("FIT");
    int i;
    side = bench_smoke() ? 64 : bench_quick() ? 128 : 512;
    pixels = (size_t)side * (size_t)side;
    out = (float *)malloc(pixels * 4);
    other = (float *)malloc(pixels * 4);
    for (i = 0; i < REF_SCENES * REF_RADII; i++) occlusions[i] = (float *)malloc(pixels * 4);
    bench_start("ssao_sat.h");
    draw_pictures(bench_smoke() ? 16 : bench_quick() ? 64 : 256);
    list_methods();
    if (fit && *fit) fit_comparators();
    if (fit && strcmp(fit, "only") == 0) return 0;
    error_against_time();
    error_pictures();
    radius_table();
    leave_out_table();
#ifndef SSAO_SAT_NO_BENT
    bent_table();
#endif
    motion_table();
    bird_table();
    format_table();
    resolution_table(); /* last: it replaces the buffers */
    for (i = 0; i < REF_SCENES * REF_RADII; i++) free(occlusions[i]);
    for (i = 0; i < REF_SCENES; i++) ref_free(&pictures[i]);
    free(out);
    free(other);
    return 0;
}
