/* bench_fiv.c - error against run time of fiv.h, and the tables of Michael 2010, chapter 5.2, re-made.
   Rays are Embree's where it is installed (libembree-dev), else those of reference_fiv.h.
   FULL=1 adds the thesis' densest set of samples (minutes). */

#define LIGHTSCAN_IMPLEMENTATION
#include "fiv.h"
#include "tonemap.h"
#include "bench.h"
#include "reference_fiv.h"
#include "../../examples/common.h"
#include "../../examples/mesh.h"

enum { MAX_SIDE = 128, ENVIRONMENTS = 6 };

typedef struct bench {
    reference_mesh mesh;
    const char *mesh_name;
    fiv_occluder_stats stats;
    reference_scene scene;            /* the mesh, centred, radius 1 */
    float low;                        /* its lowest point there */
    int side;
    float *points, *normals, *truth, *rgb;
    unsigned char *covered;           /* a texel of the cube for each point */
    float *directions, *powers;
    size_t lights;
    double brute_seconds;             /* of one environment */
    fiv_environment *environment;
} bench;

/* Processor time: one thread, on machines that others share. */
static double seconds_used(void) { return bench_clock(); }

static double median_time(bench_fn *work, void *user, int rounds)
{
    double t[16];
    int i;
    t[0] = -seconds_used();
    work(user);
    t[0] += seconds_used();
    if (bench_quick() && t[0] > BENCH_LONG) rounds = 1;
    for (i = 0; i < rounds && i < 16; i++) {
        t[i] = -seconds_used();
        work(user);
        t[i] += seconds_used();
    }
    return support_median(t, i);
}

static void *need(void *memory)
{
    if (!memory) exit(1);
    return memory;
}

static void check(sat_result result, const char *what)
{
    if (!result) return;
    fprintf(stderr, "bench_fiv: %s: %s\n", what, sat_result_text(result));
    exit(1);
}

static reference_mesh load(const char *name, const char **label)
{
    const char *path = bench_smoke() ? NULL : support_data(name);
    mesh m;
    reference_mesh out;
    if (path && mesh_load(&m, path)) {
        out.positions = m.positions;
        out.indices = (unsigned *)need(malloc(3 * (size_t)m.triangle_count * sizeof *out.indices));
        memcpy(out.indices, m.indices, 3 * (size_t)m.triangle_count * sizeof *out.indices);
        free(m.indices);
        out.vertices = (size_t)m.vertex_count, out.triangles = (size_t)m.triangle_count;
        *label = strrchr(name, '/') + 1;
        return out;
    }
    *label = "knot";
    return bench_smoke() ? reference_knot(2, 3, 30, 6, 0.25) : reference_knot(2, 3, 180, 10, 0.25);
}

/* ---- environments: four maps and the thesis' two made ones ---- */

static const char *const environment_names[ENVIRONMENTS] = {"forest", "city",          "interior",
                                                            "night",  "1 point light", "2 area lights"};

static void make_lights(image *out, int kind)
{
    int x, y, c;
    if (!image_create(out, 512, 256, 3)) exit(1);
    memset(out->pixels, 0, 3 * 512 * 256 * sizeof(float));
    for (y = 0; y < 256; ++y)
        for (x = 0; x < 512; ++x)
            for (c = 0; c < 3; ++c) {
                float *p = out->pixels + 3 * (y * 512 + x) + c;
                if (kind == 4) *p = x == 200 && y == 50 ? 1000.0f : 0.0f;
                else if (kind == 5) *p = (abs(x - 190) < 16 && abs(y - 60) < 14 ? (c == 0 ? 10.0f : 4.0f) : 0.0f) +
                                         (abs(x - 420) < 16 && abs(y - 70) < 14 ? (c == 1 ? 10.0f : 2.0f) : 0.0f);
                else *p = y < 128 ? 1 + 3 * expf(-0.002f * (float)((x - 100) * (x - 100) + (y - 50) * (y - 50))) : 0.2f;
            }
}

static int open_environment(bench *b, int kind)
{
    char name[64];
    const char *path;
    image picture;
    sat_image view;
    snprintf(name, sizeof name, "env/%s.exr", environment_names[kind]);
    path = kind < 4 ? support_data(name) : NULL;
    if (kind < 4 && (!path || !image_load(&picture, path))) {
        if (kind > 0) return 0;
        make_lights(&picture, kind);
    } else if (kind >= 4) make_lights(&picture, kind);
    view = image_view(&picture);
    fiv_environment_destroy(b->environment);
    check(fiv_environment_create(&b->environment, &view, NULL, NULL), "environment");
    image_free(&picture);
    b->lights = fiv_environment_lights(NULL, NULL, 0, b->environment);
    free(b->directions);
    free(b->powers);
    b->directions = (float *)need(malloc(3 * b->lights * sizeof(float)));
    b->powers = (float *)need(malloc(3 * b->lights * sizeof(float)));
    fiv_environment_lights(b->directions, b->powers, b->lights, b->environment);
    return 1;
}

/* ---- brute force: rays to all lights above the horizon, the ball of the occluder as their only bound ---- */

/* one point's rays: Embree's where it is, else our own in double */
static void trace_rays(const bench *b, unsigned char *covered, const float *directions, size_t count,
                       const float *point, const unsigned char *wanted)
{
#ifdef HAVE_EMBREE
    reference_trace(covered, &b->scene, directions, count, point, wanted);
#else
    size_t i;
    for (i = 0; i < count; i++) {
        double o[3] = {(double)point[0], (double)point[1], (double)point[2]};
        double d[3] = {(double)directions[3 * i], (double)directions[3 * i + 1], (double)directions[3 * i + 2]};
        covered[i] = (unsigned char)(wanted[i] && reference_occluded(&b->scene, o, d));
    }
#endif
}

static void trace_point(unsigned char *covered, const bench *b, const float *directions, size_t count,
                        const float *point)
{
    float axis[3], square = fiv__dot(point, point), limit = square > 1 ? sqrtf(square - 1) / sqrtf(square) : -2;
    static unsigned char wanted[FIV_MAX_LIGHTS + 6 * 64 * 64];
    size_t i;
    int k;
    for (k = 0; k < 3; k++) axis[k] = -point[k];
    fiv__normalise(axis, axis);
    for (i = 0; i < count; i++) wanted[i] = directions[3 * i + 1] > 0 && fiv__dot(directions + 3 * i, axis) >= limit;
    trace_rays(b, covered, directions, count, point, wanted);
}

static void plane_truth(bench *b, int trace)
{
    size_t split = (size_t)fiv_environment_get_stats(b->environment).lights, texels = b->lights - split, i, n;
    double start = seconds_used();
    for (n = 0; n < (size_t)(b->side * b->side); n++) {
        double sum[3] = {0, 0, 0};
        unsigned char *covered = b->covered + n * texels, lights[FIV_MAX_LIGHTS + 8];
        int k;
        if (trace) trace_point(covered, b, b->directions + 3 * split, texels, b->points + 3 * n);
        if (split) trace_point(lights, b, b->directions, split, b->points + 3 * n);
        for (i = 0; i < b->lights; i++)
            if (b->directions[3 * i + 1] > 0 && !(i < split ? lights[i] : covered[i - split]))
                for (k = 0; k < 3; k++)
                    sum[k] += (double)b->powers[3 * i + (size_t)k] * (double)b->directions[3 * i + 1];
        for (k = 0; k < 3; k++) b->truth[3 * n + (size_t)k] = (float)sum[k];
    }
    if (trace) b->brute_seconds = seconds_used() - start;
}

static void open_plane(bench *b, int side)
{
    size_t count = (size_t)(side * side), i;
    float zero[3];
    int k;
    fiv_occluder_options o = fiv_occluder_defaults();
    fiv_occluder *probe;
    o.keep_masks = 0, o.lazy = 1;
    check(fiv_occluder_create(&probe, b->mesh.positions, b->mesh.vertices, b->mesh.indices, b->mesh.triangles, &o,
                              &b->stats),
          "probe");
    fiv_occluder_destroy(probe);
    for (k = 0; k < 3; k++) zero[k] = -b->stats.centre[k] / b->stats.radius;
    memset(&b->scene, 0, sizeof b->scene);
    reference_add(&b->scene, b->mesh.positions, b->mesh.indices, b->mesh.triangles, NULL, zero, 1 / b->stats.radius);
    reference_build(&b->scene);
#ifdef HAVE_EMBREE
    reference_build_embree(&b->scene);
#endif
    b->low = 1;
    for (i = 0; i < b->mesh.vertices; i++) {
        float y = (b->mesh.positions[3 * i + 1] - b->stats.centre[1]) / b->stats.radius;
        b->low = y < b->low ? y : b->low;
    }
    b->side = side;
    b->points = (float *)need(malloc(12 * count * sizeof(float)));
    b->normals = b->points + 3 * count, b->truth = b->points + 6 * count, b->rgb = b->points + 9 * count;
    b->covered = (unsigned char *)need(malloc(count * 6144 + 16));
    for (i = 0; i < count; i++) {
        b->points[3 * i] = 6 * (((float)(i % (size_t)side) + 0.5f) / (float)side - 0.5f);
        b->points[3 * i + 1] = b->low - 0.02f;
        b->points[3 * i + 2] = 6 * (((float)(i / (size_t)side) + 0.5f) / (float)side - 0.5f);
        b->normals[3 * i] = b->normals[3 * i + 2] = 0, b->normals[3 * i + 1] = 1;
    }
}

static fiv_instance instance_of(const bench *b, const fiv_occluder *o)
{
    fiv_instance i;
    int k;
    i.occluder = o;
    i.scale = 1 / b->stats.radius;
    for (k = 0; k < 3; k++) i.position[k] = -b->stats.centre[k] / b->stats.radius;
    return i;
}

static fiv_occluder *make(const bench *b, int theta, int phi, int rho, fiv_storage storage, double *seconds,
                          fiv_occluder_stats *stats)
{
    fiv_occluder_options o = fiv_occluder_defaults();
    fiv_occluder *out;
    double start = seconds_used();
    o.theta = theta, o.phi = phi, o.rho = rho;
    o.storage = storage;
    check(fiv_occluder_create(&out, b->mesh.positions, b->mesh.vertices, b->mesh.indices, b->mesh.triangles, &o, stats),
          "occluder");
    *seconds = seconds_used() - start;
    return out;
}

/* ---- the ladder ---- */

typedef struct run { bench *b; const fiv_instance *instances; size_t count; fiv_irradiance_options options; } run;

static void run_once(void *user)
{
    run *r = (run *)user;
    check(fiv_irradiance(r->b->rgb, r->b->points, r->b->normals, (size_t)(r->b->side * r->b->side), r->b->environment,
                         r->instances, r->count, &r->options, NULL),
          "irradiance");
}

static const struct { const char *name; fiv_accuracy accuracy; int partial, overlap; } steps[5] = {
    {"nearest", FIV_NEAREST, 1, 1}, {"published", FIV_TRILINEAR, 1, 1}, {"published, no factor", FIV_TRILINEAR, 0, 1},
    {"scaled", FIV_SCALED, 1, 1}, {"masks", FIV_MASK, 1, 1}};

static double error_of(run *r, int step, double *seconds)
{
    r->options = fiv_irradiance_defaults();
    r->options.accuracy = steps[step].accuracy;
    r->options.partial = steps[step].partial;
    r->options.overlap = steps[step].overlap;
    r->options.own_masks = r->options.rays = r->options.contact = 0; /* what interpolation can do */
    r->options.penumbra = 0;
    if (seconds) *seconds = median_time(run_once, r, bench_rounds(7));
    else run_once(r);
    return reference_nrmse(r->b->truth, r->b->rgb, (size_t)(r->b->side * r->b->side));
}

static void ladder(bench *b)
{
    static const int sets[4][3] = {{32, 17, 15}, {48, 25, 20}, {64, 33, 30}, {256, 129, 30}};
    int count = getenv("FULL") ? 4 : bench_quick() ? 1 : 3, s, e, a;
    fiv_occluder *o[4];
    fiv_occluder_stats stats[4];
    double precompute[4];
    double pixels = b->side * b->side;
    for (s = 0; s < count; s++)
        o[s] = make(b, sets[s][0], sets[s][1], sets[s][2], FIV_STORAGE_FLOAT, &precompute[s], &stats[s]);
    bench_table("A plane below the mesh: accuracy, samples and environments (figures 18 and 19; published 0.023, 0.008, 0.007; point 0.1)",
                "mesh\tenvironment\tsamples\taccuracy\tnrmse\tpoint_us\tbrute_ratio\tprecompute_s\tvectors_mb\tmasks_mb\tdefault");
    bench_plot("Forest: error against time; x=point_us; y=nrmse; by=accuracy; where=environment:forest; log=xy; picture=plot_fiv");
    bench_plot("All surroundings; x=point_us; y=nrmse; by=environment; log=xy");
    bench_plot("Error against memory; x=vectors_mb; y=nrmse; by=environment; log=xy");
    bench_note("nrmse: eq 17 against rays to every texel of the light. brute_ratio: time of those rays over the time of the vectors, in this run.");
    for (e = 0; e < ENVIRONMENTS; e++) {
        if (!open_environment(b, e)) continue;
        plane_truth(b, e == 0);
        for (s = 0; s < count; s++) {
            fiv_instance instance = instance_of(b, o[s]);
            run r;
            r.b = b, r.instances = &instance, r.count = 1;
            check(fiv_occluder_light(o[s], b->environment, NULL), "light");
            for (a = 0; a < 5; a++) {
                double seconds, error = error_of(&r, a, &seconds);
                bench_row("%s\t%s\t%dx%dx%d\t%s\t%.4f\t%.3f\t%.0f\t%.2f\t%.2f\t%.2f\t%d", b->mesh_name,
                          environment_names[e], sets[s][0], sets[s][1], sets[s][2], steps[a].name, error,
                          1e6 * seconds / pixels, b->brute_seconds / seconds, precompute[s],
                          1e-6 * (double)stats[s].table_bytes, 1e-6 * (double)stats[s].mask_bytes, s == 0 && a == 3);
            }
        }
    }
    for (s = 0; s < count; s++) fiv_occluder_destroy(o[s]);
}

/* ---- table 2: what the precompute costs ---- */

static void table_2(bench *b)
{
    static const struct {
        int set[3];
        double minutes, mb;
    } rows[5] = {{{256, 129, 30}, 397, 34.0},
                 {{128, 65, 30}, 99, 8.56},
                 {{64, 33, 30}, 24, 2.17},
                 {{64, 33, 15}, 12, 1.08},
                 {{32, 17, 15}, 3, 0.28}};
    int i, first = getenv("FULL") ? 0 : bench_quick() ? 4 : 2;
    bench_table("Table 2: precompute and memory of one occluder (published: bunny of 36k vertices on a Core 2 Duo)",
                "mesh\tsamples\tpublished_min\tprecompute_s\tus_a_mask\tpublished_mb\tvectors_mb\tmasks_mb\trelight_ms\trelight_ratio\thalf_octahedral_mb");
    bench_note("relight: another light or another orientation from the stored masks; relight_ratio: precompute over relight.");
    for (i = first; i < 5; i++) {
        fiv_occluder_stats stats;
        double seconds, start, relight[5];
        const int *s = rows[i].set;
        fiv_occluder *o = make(b, s[0], s[1], s[2], FIV_STORAGE_FLOAT, &seconds, &stats);
        float turn[9] = {0.6f, 0, 0.8f, 0, 1, 0, -0.8f, 0, 0.6f};
        int k, side = s[0] / 2 + 1;
        for (k = 0; k < 5; k++) {
            start = seconds_used();
            check(fiv_occluder_light(o, b->environment, turn), "light");
            relight[k] = seconds_used() - start;
        }
        start = support_median(relight, 5);
        bench_row("%s\t%dx%dx%d\t%.0f\t%.2f\t%.0f\t%.2f\t%.2f\t%.2f\t%.1f\t%.0f\t%.3f", b->mesh_name, s[0], s[1], s[2],
                  rows[i].minutes, seconds, 1e6 * seconds / (double)stats.rasterised, rows[i].mb,
                  36e-6 * (double)stats.samples, 1e-6 * (double)stats.mask_bytes, 1e3 * start, seconds / start,
                  20e-6 * side * side * s[2]);
        fiv_occluder_destroy(o);
    }
}

/* ---- masks against Embree ---- */

static void masks(void)
{
    static const char *const names[3] = {"mesh/bunny_small.ply", "mesh/dragon_res4.ply", "mesh/dragon_res3.ply"};
#ifdef HAVE_EMBREE
    const int embree = 1;
#else
    const int embree = 0;
#endif
    int i;
    bench_table("Masks: rows of intervals against Embree's rays, eight at a time", "mesh\ttriangles\tclosed\tmask_us\tembree_us\ttime_ratio\tset_texels\tmismatch_percent");
#ifndef HAVE_EMBREE
    bench_missing("Embree", "libembree-dev");
#endif
    for (i = 0; i < (bench_quick() ? 1 : 3); i++) {
        bench b;
        fiv_occluder_options o = fiv_occluder_defaults();
        fiv_occluder *lazy;
        double mine = 0, theirs = 0;
        long set = 0, wrong = 0;
        size_t s, k, n = 0;
        memset(&b, 0, sizeof b);
        b.mesh = load(names[i], &b.mesh_name);
        open_plane(&b, 1);
        o.keep_masks = 0, o.lazy = 1;
        check(fiv_occluder_create(&lazy, b.mesh.positions, b.mesh.vertices, b.mesh.indices, b.mesh.triangles, &o,
                                  &b.stats),
              "occluder");
        open_environment(&b, 4);
        for (s = 7; s < lazy->stats.samples && n < 400; s += lazy->stats.samples / 400) {
            uint64_t rows[FIV__MAX_ROWS];
            float offset[3], axis[3], point[3];
            static unsigned char wanted[6144], covered[6144];
            double t0, t1, t2, limit;
            const float *d = b.directions + 3 * (b.lights - 6144);
            fiv__sample_offset(offset, &lazy->grid, s);
            t0 = seconds_used();
            fiv__raster_mesh(rows, &lazy->mesh, offset, 32, NULL);
            t1 = seconds_used();
            limit = (double)fiv__dot(offset, offset);
            limit = limit > 1 ? sqrt(limit - 1) / sqrt(limit) : -2;
            fiv__normalise(axis, offset);
            for (k = 0; k < 3; k++) point[k] = -offset[k];
            for (k = 0; k < 6144; k++) wanted[k] = (double)fiv__dot(d + 3 * k, axis) >= limit;
            trace_rays(&b, covered, d, 6144, point, wanted);
            t2 = seconds_used();
            mine += t1 - t0, theirs += t2 - t1;
            n++;
            for (k = 0; k < 6144; k++) {
                int bit = (int)(rows[k / 32] >> (k % 32) & 1);
                set += covered[k];
                wrong += bit != covered[k];
            }
        }
        bench_row("%s\t%lu\t%d\t%.0f\t%s\t%s\t%ld\t%.5f", b.mesh_name, (unsigned long)b.stats.triangles, b.stats.closed,
                  1e6 * mine / (double)n, bench_cell(1e6 * theirs / (double)n, 3, embree),
                  bench_cell(mine / theirs, 3, embree), set, 100.0 * (double)wrong / (double)set);
        fiv_occluder_destroy(lazy);
        fiv_environment_destroy(b.environment);
        reference_free(&b.scene);
        reference_mesh_free(&b.mesh);
    }
}

/* ---- figures 20 to 22: two occluders ---- */

static void two_occluders(bench *b)
{
    static const float second[3] = {0.9f, 0.25f, 0.5f};
    static const int sets[2][3] = {{32, 17, 15}, {64, 33, 30}};
    bench two = *b;
    float position[3];
    int s, a, e, k;
    bench_table("Two occluders above the plane (figure 21: 0.027 without, 0.019 with correction)", "mesh\tenvironment\tsamples\taccuracy\tnrmse\tpoint_us\tover_published");
    two.environment = NULL, two.directions = two.powers = NULL;
    memset(&two.scene, 0, sizeof two.scene);
    for (k = 0; k < 3; k++) position[k] = -b->stats.centre[k] / b->stats.radius;
    reference_add(&two.scene, b->mesh.positions, b->mesh.indices, b->mesh.triangles, NULL, position,
                  1 / b->stats.radius);
    for (k = 0; k < 3; k++) position[k] += second[k];
    reference_add(&two.scene, b->mesh.positions, b->mesh.indices, b->mesh.triangles, NULL, position,
                  1 / b->stats.radius);
    reference_build(&two.scene);
#ifdef HAVE_EMBREE
    reference_build_embree(&two.scene);
#endif
    two.covered = (unsigned char *)need(malloc((size_t)(two.side * two.side) * 6144 + 16));
    two.truth = (float *)need(malloc(3 * (size_t)(two.side * two.side) * sizeof(float)));
    for (e = 0; e < ENVIRONMENTS; e += 5) {
        size_t n, i, split;
        open_environment(&two, e);
        split = two.lights - 6144;
        for (n = 0; n < (size_t)(two.side * two.side); n++) { /* the balls of both: all texels above the horizon */
            double sum[3] = {0, 0, 0};
            const float *p = two.points + 3 * n;
            for (i = 0; i < two.lights; i++) {
                double o[3] = {(double)p[0], (double)p[1], (double)p[2]}, d[3];
                if (!(two.directions[3 * i + 1] > 0)) continue;
                for (k = 0; k < 3; k++) d[k] = (double)two.directions[3 * i + (size_t)k];
                if (i < split || e == 0) {
                    int hit = reference_occluded(&two.scene, o, d);
                    if (i >= split) two.covered[n * 6144 + i - split] = (unsigned char)hit;
                    if (hit) continue;
                } else if (two.covered[n * 6144 + i - split]) continue;
                for (k = 0; k < 3; k++)
                    sum[k] += (double)two.powers[3 * i + (size_t)k] * (double)two.directions[3 * i + 1];
            }
            for (k = 0; k < 3; k++) two.truth[3 * n + (size_t)k] = (float)sum[k];
        }
        for (s = 0; s < (bench_quick() ? 1 : 2); s++) {
            double seconds, published = 0;
            fiv_occluder *o = make(b, sets[s][0], sets[s][1], sets[s][2], FIV_STORAGE_FLOAT, &seconds, NULL);
            fiv_instance instances[2];
            run r;
            check(fiv_occluder_light(o, two.environment, NULL), "light");
            instances[0] = instances[1] = instance_of(b, o);
            for (k = 0; k < 3; k++) instances[1].position[k] += second[k];
            r.b = &two, r.instances = instances, r.count = 2;
            for (a = 0; a < 5; a++) {
                double error = error_of(&r, a, &seconds);
                if (a == 1) published = error;
                bench_row("%s\t%s\t%dx%dx%d\t%s\t%.4f\t%.3f\t%.2f", b->mesh_name, environment_names[e], sets[s][0], sets[s][1], sets[s][2],
                          a == 1 ? "eq 14-15" : a == 2 ? "eq 14-15, no factor" : steps[a].name, error, 1e6 * seconds / (two.side * two.side), a ? error / published : 0.0);
            }
            r.options.accuracy = FIV_TRILINEAR, r.options.overlap = 0, r.options.partial = 0;
            run_once(&r);
            bench_row("%s\t%s\t%dx%dx%d\tno correction\t%.4f\t%.3f\t%.2f", b->mesh_name, environment_names[e], sets[s][0], sets[s][1], sets[s][2],
                      reference_nrmse(two.truth, two.rgb, (size_t)(two.side * two.side)), 0.0,
                      reference_nrmse(two.truth, two.rgb, (size_t)(two.side * two.side)) / published);
            fiv_occluder_destroy(o);
        }
    }
    fiv_environment_destroy(two.environment);
    reference_free(&two.scene);
    free(two.covered);
    free(two.truth);
    free(two.directions);
    free(two.powers);
}

/* ---- figure 23: occluders that the horizon cuts, at random receivers ---- */

static void partial_occluders(bench *b)
{
    static const float heights[4] = {0.6f, 0.3f, 0, -0.4f};
    static const int sets[2][3] = {{32, 17, 15}, {64, 33, 30}};
    int s, h, i, k, a;
    bench_table("Occluders cut by the horizon: error of the part of I_tot they take (figure 23: 0.026 without, 0.019 with the factor)",
                "mesh\tsamples\theight_radii\tno_correction\tfactor\tcap\tmasks\tcap_over_factor");
    bench_plot("Cut occluders; x=height_radii; y=cap_over_factor; by=samples; style=linespoints");
    open_environment(b, 0);
    for (s = 0; s < (bench_quick() ? 1 : 2); s++) {
        double seconds;
        fiv_occluder *o = make(b, sets[s][0], sets[s][1], sets[s][2], FIV_STORAGE_FLOAT, &seconds, NULL);
        fiv_instance instance = instance_of(b, o);
        check(fiv_occluder_light(o, b->environment, NULL), "light");
        for (h = 0; h < 4; h++) {
            double square[4] = {0, 0, 0, 0};
            uint64_t seed = 5;
            for (i = 0; i < 200; i++) {
                float n[3], t[3], p[3], rgb[3], open[3], cosine, r = 1.3f + 1.5f * (float)support_uniform(&seed);
                double truth[3];
                for (k = 0; k < 3; k++) n[k] = (float)support_gaussian(&seed), t[k] = (float)support_gaussian(&seed);
                fiv__normalise(n, n);
                cosine = fiv__dot(n, t);
                for (k = 0; k < 3; k++) t[k] -= cosine * n[k];
                fiv__normalise(t, t);
                for (k = 0; k < 3; k++) p[k] = -r * t[k] - heights[h] * n[k];
                reference_irradiance(truth, &b->scene, b->directions, b->powers, b->lights, p, n);
                fiv_environment_irradiance(open, b->environment, n);
                for (a = 0; a < 4; a++) {
                    fiv_irradiance_options io = fiv_irradiance_defaults();
                    io.accuracy = a == 0 ? FIV_TRILINEAR : (fiv_accuracy)a;
                    io.partial = a > 0;
                    io.cutoff = 0;
                    io.own_masks = io.contact = 0;
                    check(fiv_irradiance(rgb, p, n, 1, b->environment, &instance, 1, &io, NULL), "irradiance");
                    for (k = 0; k < 3; k++) square[a] += pow(((double)rgb[k] - truth[k]) / (double)open[k], 2) / 600;
                }
            }
            bench_row("%s\t%dx%dx%d\t%.1f\t%.4f\t%.4f\t%.4f\t%.4f\t%.2f", b->mesh_name, sets[s][0], sets[s][1], sets[s][2], (double)heights[h],
                      sqrt(square[0]), sqrt(square[1]), sqrt(square[2]), sqrt(square[3]), sqrt(square[2] / square[1]));
        }
        fiv_occluder_destroy(o);
    }
}

/* ---- storage ---- */

static void storage(bench *b)
{
    static const int sets[2][3] = {{32, 17, 15}, {64, 33, 30}};
    int s, kind;
    bench_table("Storage: published floats, and half floats on an octahedral grid", "mesh\tsamples\tstorage\tnrmse\tpoint_us\tvectors_mb\tover_published_memory\tover_float_nrmse");
    open_environment(b, 0);
    plane_truth(b, 0);
    for (s = 0; s < (bench_quick() ? 1 : 2); s++) {
        double first = 0;
        for (kind = 0; kind < 2; kind++) {
            double seconds, error;
            fiv_occluder_stats stats;
            fiv_occluder *o = make(b, sets[s][0], sets[s][1], sets[s][2], (fiv_storage)kind, &seconds, &stats);
            fiv_instance instance = instance_of(b, o);
            double published = 36.0 * sets[s][0] * sets[s][1] * sets[s][2];
            size_t bytes = stats.table_bytes;
            run r;
            r.b = b, r.instances = &instance, r.count = 1;
            check(fiv_occluder_light(o, b->environment, NULL), "light");
            error = error_of(&r, 3, &seconds);
            if (!kind) first = error;
            bench_row("%s\t%dx%dx%d\t%s\t%.4f\t%.3f\t%.3f\t%.3f\t%.2f", b->mesh_name, sets[s][0], sets[s][1],
                      sets[s][2], kind ? "half octahedral" : "float", error, 1e6 * seconds / (b->side * b->side),
                      1e-6 * (double)bytes, (double)bytes / published, error / first);
            fiv_occluder_destroy(o);
        }
    }
}

/* ---- tables 17 and 18: what tone mapping leaves of the error. The share of pixels more than 2 of 255 apart stands in
   for the thesis' VDP; before: at the exposure that shows the brightest pixel as white. ---- */

static double different(const unsigned char *a, const unsigned char *b, size_t n)
{
    size_t i, count = 0;
    for (i = 0; i < n; i++)
        count += abs(a[3 * i] - b[3 * i]) > 2 || abs(a[3 * i + 1] - b[3 * i + 1]) > 2 ||
                 abs(a[3 * i + 2] - b[3 * i + 2]) > 2;
    return 100.0 * (double)count / (double)n;
}

static void expose(unsigned char *out, const float *rgb, size_t n, float white)
{
    size_t i;
    for (i = 0; i < 3 * n; i++) out[i] = (unsigned char)(255 * sat__srgb_encode(rgb[i] / white) + 0.5f);
}

static void compare_row(bench *b, const char *what, const char *set, double published_before, double published_after)
{
    size_t n = (size_t)(b->side * b->side), i;
    unsigned char *x = (unsigned char *)need(malloc(6 * n)), *y = x + 3 * n;
    float white = 0;
    double before;
    for (i = 0; i < 3 * n; i++) white = b->truth[i] > white ? b->truth[i] : white;
    expose(x, b->truth, n, white);
    expose(y, b->rgb, n, white);
    before = different(x, y, n);
    check(tonemap_once_u8(x, b->truth, b->side, b->side, 3, NULL), "tone mapping");
    check(tonemap_once_u8(y, b->rgb, b->side, b->side, 3, NULL), "tone mapping");
    bench_row("%s\t%s\t%.2f\t%.2f\t%.2f\t%.2f", what, set, published_before, published_after, before, different(x, y, n));
    free(x);
}

static void tables_17_18(bench *b)
{
    static const struct {
        int set[3];
        double before, after;
    } rows[3] = {{{32, 17, 15}, 5.94, 2.59}, {{64, 33, 30}, 0.20, 0.32}, {{256, 129, 30}, 0.13, 0.20}};
    static const double published[ENVIRONMENTS][2] = {{11.42, 8.31}, {0, 0}, {0, 0}, {0, 0}, {1.70, 1.70}, {0, 0}};
    int i, e, last = getenv("FULL") ? 2 : bench_quick() ? 0 : 1;
    char set[32];
    bench_table("Tables 17 and 18: percent of pixels that differ before and after tone mapping", "environment\tsamples\tpublished_before\tpublished_after\tbefore\tafter");
    bench_note("published: VDP, and Eucalyptus grove where this says forest. Here: more than 2 of 255 apart.");
    open_environment(b, 0);
    plane_truth(b, 0);
    for (i = 0; i <= last; i++) {
        double seconds;
        fiv_occluder *o = make(b, rows[i].set[0], rows[i].set[1], rows[i].set[2], FIV_STORAGE_FLOAT, &seconds, NULL);
        fiv_instance instance = instance_of(b, o);
        run r;
        r.b = b, r.instances = &instance, r.count = 1;
        snprintf(set, sizeof set, "%dx%dx%d", rows[i].set[0], rows[i].set[1], rows[i].set[2]);
        for (e = 0; e < ENVIRONMENTS; e += e == 0 ? 4 : 1) {
            if (e && i < last) break;
            if (e) open_environment(b, e), plane_truth(b, 0);
            check(fiv_occluder_light(o, b->environment, NULL), "light");
            error_of(&r, 3, NULL);
            compare_row(b, environment_names[e], set, e ? published[e][0] : rows[i].before,
                        e ? published[e][1] : rows[i].after);
        }
        fiv_occluder_destroy(o);
    }
}

/* ---- table 3 on the CPU: many occluders ---- */

static void many_occluders(bench *b)
{
    static const int counts[5] = {1, 10, 20, 40, 60};
    static const double fps[5] = {112, 68, 46, 29, 22};
    fiv_instance instances[64];
    double seconds;
    fiv_occluder *o;
    uint64_t seed = 3;
    int i, k;
    run r;
    open_environment(b, 0);
    o = make(b, 32, 17, 15, FIV_STORAGE_FLOAT, &seconds, NULL);
    check(fiv_occluder_light(o, b->environment, NULL), "light");
    bench_table("Many occluders (table 3, on one core)", "occluders\tpublished_fps\tpoint_us\tpoint_us_all_kept\tleft_out_percent");
    bench_plot("Cost of occluders; x=occluders; y=point_us; style=linespoints");
    for (i = 0; i < 64; i++) {
        instances[i] = instance_of(b, o);
        for (k = 0; k < 3; k += 2) instances[i].position[k] += 60 * (float)support_uniform(&seed) - 30;
    }
    r.b = b, r.instances = instances;
    for (i = 0; i < 5; i++) {
        fiv_irradiance_stats stats;
        double all, some;
        r.count = (size_t)counts[i];
        r.options = fiv_irradiance_defaults();
        some = median_time(run_once, &r, bench_rounds(5));
        check(fiv_irradiance(b->rgb, b->points, b->normals, (size_t)(b->side * b->side), b->environment, instances,
                             r.count, &r.options, &stats),
              "irradiance");
        r.options.cutoff = 0;
        all = median_time(run_once, &r, bench_rounds(5));
        bench_row("%d\t%.0f\t%.3f\t%.3f\t%.1f", counts[i], fps[i], 1e6 * some / (b->side * b->side), 1e6 * all / (b->side * b->side),
                  100.0 * (double)(stats.below_cutoff + stats.below_horizon) / ((double)counts[i] * b->side * b->side));
    }
    fiv_occluder_destroy(o);
}

/* ---- what rests on a floor ---- */

static void light_points(run *r, fiv_irradiance_stats *stats)
{
    bench *b = r->b;
    check(fiv_irradiance(b->rgb, b->points, b->normals, (size_t)(b->side * b->side), b->environment, r->instances,
                         r->count, &r->options, stats),
          "irradiance");
}

static const int resting_sets[2][3] = {{32, 17, 15}, {64, 33, 30}};

static void resting_row(bench *b, fiv_occluder *occluder, const char *light, int big, double gap)
{
    fiv_irradiance_stats stats;
    fiv_instance instance;
    double error[4], seconds[3], points = b->side * b->side;
    run r;
    check(fiv_occluder_light(occluder, b->environment, NULL), "light");
    instance = instance_of(b, occluder);
    r.b = b, r.instances = &instance, r.count = 1;
    error[3] = error_of(&r, 1, NULL);
    error[0] = error_of(&r, 3, &seconds[0]);
    r.options = fiv_irradiance_defaults();
    r.options.penumbra = 0;
    r.options.own_triangles = 20000;
    seconds[1] = median_time(run_once, &r, bench_rounds(3));
    light_points(&r, &stats);
    error[1] = reference_nrmse(b->truth, b->rgb, (size_t)points);
    r.options.own_masks = 0;
    seconds[2] = median_time(run_once, &r, bench_rounds(5));
    error[2] = reference_nrmse(b->truth, b->rgb, (size_t)points);
    bench_row("%s\t%s\t%.3f\t%dx%dx%d\t%.4f\t%.4f\t%.4f\t%.4f\t%.3f\t%.3f\t%.2f\t%.1f\t%.1f", b->mesh_name, light, gap,
              resting_sets[big][0], resting_sets[big][1], resting_sets[big][2], error[3], error[0], error[2], error[1],
              1e6 * seconds[0] / points, 1e6 * seconds[2] / points, 1e6 * seconds[1] / points,
              100 * (double)stats.own_receivers / points, 100 * (double)stats.rays / points);
}

static void resting(int side)
{
    static const char *const names[5] = {"box", "mesh/queen.ply", "mesh/fandisk.ply", "mesh/bunny_small.ply",
                                         "mesh/dragon_res4.ply"};
    static const double gaps[2] = {0, 0.002};
    static const int lights[2] = {0, 4};
    int i, g, l, big, last = bench_smoke() ? 1 : 5;
    bench_table("What rests on a floor 3 R wide: views, or own masks, near contact; rays where the depth map of a sun is not sure",
                "mesh\tenvironment\tgap_R\tsamples\tnrmse_published\tnrmse_interpolated\tnrmse_views\tnrmse\tpoint_us_interpolated\tpoint_us_views\tpoint_us\town_masks_percent\trays_percent");
    bench_note("nrmse: eq 17 against rays to every texel of the light and to each split-off light; published: FIV_TRILINEAR; the last by own masks for all meshes (own_triangles 20000). Up to 500 triangles that is the default, else the views are.");
    for (i = 0; i < last; i += bench_quick() ? 3 : 1) { /* the box and the bunny in a short run */
        bench b;
        fiv_occluder *o[2];
        double made;
        int sets = bench_quick() ? 1 : 2;
        memset(&b, 0, sizeof b);
        if (i == 0) b.mesh = reference_box(0.5f, 0.3f, 0.4f), b.mesh_name = "box";
        else b.mesh = load(names[i], &b.mesh_name);
        open_plane(&b, side);
        for (big = 0; big < sets; big++)
            o[big] = make(&b, resting_sets[big][0], resting_sets[big][1], resting_sets[big][2], FIV_STORAGE_FLOAT,
                          &made, NULL);
        for (l = 0; l < 2; l++)
            for (g = 0; g < 2; g++) {
                size_t n;
                for (n = 0; n < (size_t)(side * side); n++) {
                    b.points[3 * n] = 3 * (((float)(n % (size_t)side) + 0.5f) / (float)side - 0.5f);
                    b.points[3 * n + 1] = b.low - (float)gaps[g];
                    b.points[3 * n + 2] = 3 * (((float)(n / (size_t)side) + 0.5f) / (float)side - 0.5f);
                }
                if (!open_environment(&b, lights[l])) continue;
                plane_truth(&b, 1);
                for (big = 0; big < sets; big++)
                    resting_row(&b, o[big], environment_names[lights[l]], big, gaps[g]);
            }
        for (big = 0; big < sets; big++) fiv_occluder_destroy(o[big]);
        reference_free(&b.scene);
        reference_mesh_free(&b.mesh);
        fiv_environment_destroy(b.environment);
        free(b.points), free(b.covered), free(b.directions), free(b.powers);
    }
}

/* ---- self-shadows: receivers a hair above the middles of triangles ---- */

static void self_receivers(bench *b, const fiv_occluder *o)
{
    size_t p, n = (size_t)(b->side * b->side);
    int j, k;
    for (p = 0; p < n; p++) {
        const unsigned *index = b->mesh.indices + 3 * (p * b->mesh.triangles / n);
        float corner[3][3], e[2][3], *normal = b->normals + 3 * p;
        for (j = 0; j < 3; j++)
            for (k = 0; k < 3; k++)
                corner[j][k] = (b->mesh.positions[3 * index[j] + (unsigned)k] - b->stats.centre[k]) / b->stats.radius;
        for (k = 0; k < 3; k++) e[0][k] = corner[1][k] - corner[0][k], e[1][k] = corner[2][k] - corner[0][k];
        for (k = 0; k < 3; k++)
            normal[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
        fiv__normalise(normal, normal);
        for (k = 0; k < 3; k++) {
            normal[k] *= o->mesh.turn;
            b->points[3 * p + (size_t)k] = (corner[0][k] + corner[1][k] + corner[2][k]) / 3 + 1e-4f * normal[k];
        }
    }
}

static void self_shadows(int side)
{
    static const char *const names[3] = {"mesh/bunny_small.ply", "mesh/queen.ply", "mesh/dragon_res4.ply"};
    static const int lights[2] = {0, 3};
    int i, l, contact;
    bench_table("Self-shadows: on the mesh itself, interpolated (eq 13, cut at the horizon) and by views",
                "mesh\tenvironment\tnrmse_interpolated\tnrmse\tpoint_us_interpolated\tpoint_us");
    for (i = 0; i < (bench_smoke() ? 1 : 3); i++) {
        bench b;
        double made;
        fiv_occluder *o;
        fiv_instance instance;
        memset(&b, 0, sizeof b);
        b.mesh = load(names[i], &b.mesh_name);
        open_plane(&b, side);
        o = make(&b, 32, 17, 15, FIV_STORAGE_FLOAT, &made, NULL);
        instance = instance_of(&b, o);
        self_receivers(&b, o);
        for (l = 0; l < 2; l++) {
            double error[2], seconds[2];
            size_t p, n = (size_t)(side * side);
            if (!open_environment(&b, lights[l])) continue;
            check(fiv_occluder_light(o, b.environment, NULL), "light");
            for (p = 0; p < n; p++) {
                double sum[3];
                int k;
                reference_irradiance(sum, &b.scene, b.directions, b.powers, b.lights, b.points + 3 * p,
                                     b.normals + 3 * p);
                for (k = 0; k < 3; k++) b.truth[3 * p + (size_t)k] = (float)sum[k];
            }
            for (contact = 0; contact < 2; contact++) {
                fiv_irradiance_options io = fiv_irradiance_defaults();
                io.contact = contact;
                io.penumbra = 0;
                seconds[contact] = -seconds_used();
                check(fiv_self_irradiance(b.rgb, b.points, b.normals, n, b.environment, &instance, NULL, 0, &io, NULL),
                      "self");
                seconds[contact] += seconds_used();
                error[contact] = reference_nrmse(b.truth, b.rgb, n);
            }
            bench_row("%s\t%s\t%.4f\t%.4f\t%.2f\t%.2f", b.mesh_name, environment_names[lights[l]], error[0], error[1],
                      1e6 * seconds[0] / (double)n, 1e6 * seconds[1] / (double)n);
        }
        fiv_occluder_destroy(o);
        reference_free(&b.scene);
        reference_mesh_free(&b.mesh);
        fiv_environment_destroy(b.environment);
        free(b.points), free(b.covered), free(b.directions), free(b.powers);
    }
}

/* ---- suns: depth maps, rays and own masks beside as many rays as take about as long. The truth is that of a cube of
   64 texels that keeps up to 32 lights. ---- */

static void make_sun(image *out)
{
    int k;
    if (!image_create(out, 1024, 512, 3)) exit(1);
    memset(out->pixels, 0, 3 * 1024 * 512 * sizeof(float));
    for (k = 0; k < 3; k++) out->pixels[3 * (140 * 1024 + 400) + k] = 1e5f;
}

static int open_sun(bench *b, fiv_environment **truth, const char *name)
{
    fiv_environment_options o = fiv_environment_defaults();
    char file[64];
    const char *path;
    image picture;
    sat_image view;
    snprintf(file, sizeof file, "env/%s.exr", name);
    path = support_data(file);
    if (strcmp(name, "bare sun") == 0) make_sun(&picture);
    else if (!path || !image_load(&picture, path)) return 0;
    view = image_view(&picture);
    fiv_environment_destroy(b->environment);
    check(fiv_environment_create(&b->environment, &view, NULL, NULL), "environment");
    o.resolution = 64;
    o.delta_ratio = 25;
    check(fiv_environment_create(truth, &view, &o, NULL), "environment");
    image_free(&picture);
    b->lights = fiv_environment_lights(NULL, NULL, 0, *truth);
    free(b->directions);
    free(b->powers);
    b->directions = (float *)need(malloc(3 * b->lights * sizeof(float)));
    b->powers = (float *)need(malloc(3 * b->lights * sizeof(float)));
    fiv_environment_lights(b->directions, b->powers, b->lights, *truth);
    return 1;
}

/* Rays to lights drawn by power times cosine, one from each of `count` strata; 0: to all lights. */
typedef struct sampled { bench *b; int count; double *sums; } sampled;

static void sample_rays(void *user)
{
    enum { MOST = 6 * 64 * 64 + FIV_MAX_LIGHTS };
    static unsigned char wanted[MOST], covered[MOST];
    static float directions[3 * MOST];
    static size_t chosen[MOST];
    sampled *s = (sampled *)user;
    bench *b = s->b;
    uint64_t seed = 1;
    size_t p, i, n = s->count ? (size_t)s->count : b->lights;
    double total = s->sums[b->lights];
    int k;
    memset(wanted, 1, n);
    for (p = 0; p < (size_t)(b->side * b->side); p++) {
        double sum[3] = {0, 0, 0};
        for (i = 0; i < n; i++) {
            size_t low = 0, high = b->lights;
            double at = total * ((double)i + support_uniform(&seed)) / (double)n;
            while (s->count && high - low > 1) {
                size_t middle = (low + high) / 2;
                if (s->sums[middle] <= at) low = middle;
                else high = middle;
            }
            chosen[i] = s->count ? low : i;
            memcpy(directions + 3 * i, b->directions + 3 * chosen[i], 3 * sizeof(float));
            if (!s->count) wanted[i] = directions[3 * i + 1] > 0;
        }
        trace_rays(b, covered, directions, n, b->points + 3 * p, wanted);
        for (i = 0; i < n; i++) {
            size_t j = chosen[i];
            double part = s->count ? total / ((s->sums[j + 1] - s->sums[j]) * (double)n) : 1;
            if (wanted[i] && !covered[i])
                for (k = 0; k < 3; k++)
                    sum[k] += part * (double)b->powers[3 * j + (size_t)k] * (double)b->directions[3 * j + 1];
        }
        for (k = 0; k < 3; k++) b->rgb[3 * p + (size_t)k] = (float)sum[k];
    }
}

/* Where the errors are: the green of the floor, brightest 1; what is left of the reference's when it is taken away. */
static void error_picture(const bench *b, const char *name, const char *caption, int take_away)
{
    size_t n = (size_t)(b->side * b->side), i;
    float *v = (float *)need(malloc(n * sizeof(float))), white = 1e-30f;
    for (i = 0; i < n; i++) white = fmaxf(white, b->truth[3 * i + 1]);
    for (i = 0; i < n; i++) v[i] = (take_away ? b->rgb[3 * i + 1] - b->truth[3 * i + 1] : b->truth[3 * i + 1]) / white;
    if (take_away) bench_picture(name, caption, v, b->side, b->side, BENCH_SIGNED, -0.1, 0.1);
    else bench_picture(name, caption, v, b->side, b->side, BENCH_GREY, 0, 1);
    free(v);
}

static void suns_row(bench *b, const fiv_occluder *o, const char *light, double gap)
{
    const int shown = strcmp(light, "forest") == 0 && gap < 0.1;
    sampled s;
    run r;
    fiv_instance instance = instance_of(b, o);
    fiv_irradiance_stats stats;
    double points = b->side * b->side, error[5], seconds[4];
    size_t i;
    s.b = b;
    s.sums = (double *)need(malloc((b->lights + 1) * sizeof(double)));
    for (i = 0, s.sums[0] = 0; i < b->lights; i++) {
        const float *p = b->powers + 3 * i;
        double up = (double)b->directions[3 * i + 1];
        s.sums[i + 1] = s.sums[i] + (up > 0 ? ((double)p[0] + (double)p[1] + (double)p[2]) * up : 0);
    }
    s.count = 0;
    sample_rays(&s);
    memcpy(b->truth, b->rgb, (size_t)points * 3 * sizeof(float));
    if (shown) error_picture(b, "fiv_truth", "reference: rays to all of the light", 0);
    s.count = 128;
    seconds[0] = median_time(sample_rays, &s, bench_rounds(3));
    if (shown) error_picture(b, "fiv_peer", "128 rays a point", 1);
    error[0] = reference_nrmse(b->truth, b->rgb, (size_t)points);
    r.b = b, r.instances = &instance, r.count = 1;
    r.options = fiv_irradiance_defaults();
    r.options.own_masks = r.options.rays = r.options.contact = 0;
    seconds[1] = median_time(run_once, &r, bench_rounds(5));
    error[1] = reference_nrmse(b->truth, b->rgb, (size_t)points);
    if (shown) error_picture(b, "fiv_vectors", "interpolated vectors alone", 1);
    r.options = fiv_irradiance_defaults();
    r.options.own_triangles = 20000;
    seconds[2] = median_time(run_once, &r, bench_rounds(3));
    light_points(&r, &stats);
    error[2] = reference_nrmse(b->truth, b->rgb, (size_t)points);
    r.options.penumbra = 0;
    light_points(&r, &stats);
    error[3] = reference_nrmse(b->truth, b->rgb, (size_t)points);
    if (shown) error_picture(b, "fiv_masks", "own masks, as for meshes of few triangles", 1);
    r.options.own_masks = 0;
    seconds[3] = median_time(run_once, &r, bench_rounds(5));
    error[4] = reference_nrmse(b->truth, b->rgb, (size_t)points);
    if (shown) error_picture(b, "fiv_default", "views, the default here (penumbra 0, as the reference)", 1);
    free(s.sums);
    bench_row("%s\t%.3f\t%d\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f\t%.2f\t%.4f\t%.4f\t%.4f\t%.1f\t%.1f", light, gap,
              fiv_environment_get_stats(b->environment).lights, error[0], error[1], error[4], error[2], error[3],
              1e6 * seconds[0] / points, seconds[1] / seconds[0], seconds[3] / seconds[0], seconds[2] / seconds[0],
              100 * (double)stats.own_receivers / points, 100 * (double)stats.rays / points);
}

static void suns(int side)
{
    static const char *const names[4] = {"bare sun", "forest", "city", "night"};
    static const double gaps[2] = {0.002, 0.5};
    fiv_environment *truth;
    fiv_occluder *o;
    double seconds;
    bench b;
    int e, g;
    size_t n;
    memset(&b, 0, sizeof b);
    bench_table("Suns: a floor 4 R wide below the bunny, beside 128 rays a receiver to lights drawn by what they give",
                "environment\tgap_R\tlights\tnrmse_128_rays\tnrmse_maps\tnrmse_views\tnrmse\tnrmse_points\trays_us\tmaps_over_rays\tviews_over_rays\ttime_over_rays\town_percent\tray_percent");
    bench_note("maps: depth maps of the lights alone, neither views, own masks nor rays; views: near contact 384 depth maps in place of own masks, and penumbra 0; points: penumbra 0, as the truth has it.");
#ifndef HAVE_EMBREE
    bench_missing("Embree", "libembree-dev");
#endif
    b.mesh = load("mesh/bunny_small.ply", &b.mesh_name);
    open_plane(&b, side);
    o = make(&b, 32, 17, 15, FIV_STORAGE_FLOAT, &seconds, NULL);
    for (e = 0; e < (bench_quick() ? 2 : 4); e++) {
        if (!open_sun(&b, &truth, names[e])) continue;
        check(fiv_occluder_light(o, b.environment, NULL), "light");
        for (g = 0; g < 2; g++) {
            for (n = 0; n < (size_t)(side * side); n++) {
                b.points[3 * n] = 4 * (((float)(n % (size_t)side) + 0.5f) / (float)side - 0.5f);
                b.points[3 * n + 1] = b.low - (float)gaps[g];
                b.points[3 * n + 2] = 4 * (((float)(n / (size_t)side) + 0.5f) / (float)side - 0.5f);
            }
            suns_row(&b, o, names[e], gaps[g]);
        }
        fiv_environment_destroy(truth);
    }
    fiv_occluder_destroy(o);
    reference_free(&b.scene);
    reference_mesh_free(&b.mesh);
    fiv_environment_destroy(b.environment);
    free(b.points), free(b.covered), free(b.directions), free(b.powers);
}

/* ---- pixels: receivers R / 300 apart at the bunny's foot ---- */

static void pixels(bench *b, int side)
{
    static const float tolerances[6] = {0, 0.003f, 0.01f, 0.02f, 0.03f, 0.1f};
    fiv_occluder *o;
    fiv_instance instance;
    fiv_irradiance_stats stats;
    run r;
    double seconds, first = 0;
    float *each = (float *)need(malloc((size_t)(side * side) * 3 * sizeof(float)));
    int i, t, last = side;
    bench_table("Pixels R / 300 apart at the bunny's foot: masks shared along a row", "own_tolerance\tmasks_a_receiver\tpoint_us\ttime_over_own\trms_difference\tdefault");
    bench_plot("Shared masks; x=time_over_own; y=rms_difference; style=linespoints");
    open_environment(b, 0);
    o = make(b, 32, 17, 15, FIV_STORAGE_FLOAT, &seconds, NULL);
    check(fiv_occluder_light(o, b->environment, NULL), "light");
    instance = instance_of(b, o);
    b->side = side;
    for (i = 0; i < side * side; i++) {
        b->points[3 * i] = (float)(i % side - side / 2) / 300;
        b->points[3 * i + 1] = b->low - 0.002f;
        b->points[3 * i + 2] = 0.45f + (float)(i / side - side / 2) / 300;
    }
    r.b = b, r.instances = &instance, r.count = 1;
    for (t = 0; t < 6; t++) {
        double square = 0, largest = 0;
        r.options = fiv_irradiance_defaults();
        r.options.own_tolerance = tolerances[t];
        r.options.own_triangles = 20000;
        seconds = median_time(run_once, &r, bench_rounds(3));
        light_points(&r, &stats);
        if (!t) memcpy(each, b->rgb, (size_t)(side * side) * 3 * sizeof(float)), first = seconds;
        for (i = 0; i < 3 * side * side; i++) {
            square += pow((double)b->rgb[i] - (double)each[i], 2);
            largest = (double)each[i] > largest ? (double)each[i] : largest;
        }
        bench_row("%.3f\t%.3f\t%.1f\t%.3f\t%.5f\t%d", (double)tolerances[t],
                  (double)stats.own_masks / ((double)stats.own_receivers + 1e-9),
                  1e6 * seconds / (side * side), seconds / first, sqrt(square / (3 * side * side)) / largest,
                  t == 2);
    }
    b->side = last;
    free(each);
    fiv_occluder_destroy(o);
}

/* ---- the ground of a view: two meshes stand on it, seen as fiv_shadows sees them ---- */

static void ground_of_a_view(bench *b, int width)
{
    static const char *const names[3] = {"interpolated", "default", "own masks (own_triangles 20000)"};
    static const double eye[3] = {0.6, 2.6, 5.4}, right[3] = {0.9939, 0, -0.1104}, up[3] = {-0.0381, 0.9384, -0.3433},
                        forward[3] = {-0.1036, -0.3454, -0.9327};
    int height = 3 * width / 4, x, y, i, k, n = 0, side = b->side;
    double made, seconds;
    float *p = (float *)need(malloc(9 * (size_t)(width * height) * sizeof *p));
    float *points = b->points, *normals = b->normals, *rgb = b->rgb;
    fiv_occluder *o = make(b, 32, 17, 15, FIV_STORAGE_FLOAT, &made, NULL);
    fiv_instance instances[2];
    run r;
    bench_table("The ground of a view: two bunnies stand on it, 0.95 R left and right", "near_contact\treceivers\tcontacts_percent\tpoint_us\tdefault");
    open_environment(b, 0);
    check(fiv_occluder_light(o, b->environment, NULL), "light");
    for (i = 0; i < 2; i++) {
        instances[i] = instance_of(b, o);
        instances[i].position[0] += i ? 0.95f : -0.95f;
        instances[i].position[1] -= b->low;
    }
    b->points = p, b->normals = p + 3 * width * height, b->rgb = p + 6 * width * height;
    for (y = 0; y < height; y++)
        for (x = 0; x < width; x++) {
            double s = 0.6 / height, u = (x + 0.5 - 0.5 * width) * s, v = (0.5 * height - y - 0.5) * s, d[3], t;
            for (k = 0; k < 3; k++) d[k] = forward[k] + u * right[k] + v * up[k];
            t = -eye[1] / d[1];
            if (!(d[1] < 0 && t < 25)) continue;
            for (k = 0; k < 3; k++) {
                b->points[3 * n + k] = k == 1 ? 0.002f : (float)(eye[k] + t * d[k]);
                b->normals[3 * n + k] = k == 1;
            }
            n++;
        }
    b->side = (int)sqrt((double)n); /* whole rows: a few pixels less */
    r.b = b, r.instances = instances, r.count = 2;
    for (i = 0; i < 3; i++) {
        fiv_irradiance_stats stats;
        r.options = fiv_irradiance_defaults();
        if (i == 0) r.options.contact = r.options.own_masks = 0;
        if (i == 2) r.options.own_triangles = 20000;
        seconds = median_time(run_once, &r, bench_rounds(5));
        light_points(&r, &stats);
        bench_row("%s\t%d\t%.1f\t%.3f\t%d", names[i], b->side * b->side,
                  100 * (double)(stats.contacts + stats.own_receivers) / (b->side * b->side),
                  1e6 * seconds / (b->side * b->side), i == 1);
    }
    b->points = points, b->normals = normals, b->rgb = rgb, b->side = side;
    free(p);
    fiv_occluder_destroy(o);
}

/* ---- table 4, our column ---- */

static void table_4(void)
{
    bench_table("Table 4: our column", "property\tpublished_fiv\there");
    bench_row("environment frequencies\tall\tall; suns split off as directional lights");
    bench_row("dynamic scenes\tdeformable receivers, rigid occluders\tdeformable receivers; occluders move, scale, turn (relight) and deform (lazy)");
    bench_row("light\tstatic\tany change: relight from span masks");
    bench_row("geometry approximation\tno\tno");
}

int main(void)
{
    bench b;
    memset(&b, 0, sizeof b);
    bench_start("fiv.h");
    b.mesh = load("mesh/bunny_small.ply", &b.mesh_name);
    open_plane(&b, bench_smoke() ? 12 : bench_quick() ? 40 : MAX_SIDE);
    ladder(&b);
    if (!open_environment(&b, 0)) return 1;
    table_2(&b);
    masks();
    partial_occluders(&b);
    storage(&b);
    tables_17_18(&b);
    many_occluders(&b);
    table_4();
    resting(bench_smoke() ? 12 : bench_quick() ? 28 : 96);
    suns(bench_smoke() ? 12 : bench_quick() ? 28 : 80);
    self_shadows(bench_smoke() ? 6 : bench_quick() ? 12 : 24);
    ground_of_a_view(&b, bench_smoke() ? 16 : 320);
    pixels(&b, bench_smoke() ? 12 : bench_quick() ? 28 : MAX_SIDE);
    b.side = bench_smoke() ? 8 : bench_quick() ? 20 : 40; /* the first rows of the plane would be a strip: start anew */
    reference_free(&b.scene);
    open_plane(&b, b.side);
    two_occluders(&b);
    fiv_environment_destroy(b.environment);
    return 0;
}
