/* Error against run time of raindrop.h. The environment is forest.exr where the data is there, else a made-up sky. */

#define SAT_IMPLEMENTATION
#define RAINDROP_IMPLEMENTATION
#include "raindrop.h"
#include "bench.h"
#include "image.h"
#include "reference_raindrop.h"

enum { SIZE = 512, FRAGMENTS = 4096 };

typedef struct scene {
    sat_image view;
    raindrop_environment *environment;
    raindrop_map *map;
    raindrop_camera camera;
    float *background, *picture, *truth;
    unsigned char *mask;
    double key;
} scene;

static scene the;

static float *pixels_of(void) { return (float *)malloc(sizeof(float) * 3 * SIZE * SIZE); }

static void open_scene(void)
{
    static image picture;
    const char *path = support_data("env/forest.exr");
    if (path && image_load(&picture, path)) the.view = image_view(&picture);
    else {
        float *sky = (float *)malloc(sizeof(float) * 3 * 1024 * 512);
        reference_sky(sky, 1024, 512);
        the.view = sat_image_f32(sky, 1024, 512, 3);
        bench_note("env/forest.exr is not there: a made-up sky instead");
    }
    the.camera = raindrop_camera_defaults();
    the.camera.depth_near = 0;
    the.background = pixels_of();
    the.picture = pixels_of();
    the.truth = pixels_of();
    the.mask = (unsigned char *)malloc(SIZE * SIZE);
    raindrop_environment_create(&the.environment, &the.view, NULL, NULL);
    reference_map(&the.map, SIZE, 32, RAINDROP_WATER);
    raindrop_environment_render(the.background, SIZE * 12, SIZE, SIZE, &the.camera, the.environment, NULL);
    the.key = reference_key(the.background, SIZE * SIZE);
}

/* ---- the vectors alone */

typedef struct vectors {
    raindrop_map *map;
    float s[FRAGMENTS], t[FRAGMENTS], distance;
    float direction[3][FRAGMENTS], offset[3][FRAGMENTS], one_minus_b2[FRAGMENTS], out[10][FRAGMENTS];
    raindrop_ray_inputs in;
    raindrop_ray_outputs to;
    double sum;
} vectors;

static void time_map(void *user)
{
    vectors *v = (vectors *)user;
    int i;
    for (i = 0; i < FRAGMENTS; i++) {
        float q[8];
        raindrop_map_sample(q, v->map, v->s[i], v->t[i], v->distance);
        v->out[0][i] = q[0]; v->out[1][i] = q[1]; v->out[2][i] = q[2]; v->out[6][i] = q[3];
        v->out[3][i] = q[4]; v->out[4][i] = q[5]; v->out[5][i] = q[6]; v->out[7][i] = q[7];
    }
}

static void time_single(void *user)
{
    vectors *v = (vectors *)user;
    int i;
    for (i = 0; i < FRAGMENTS; i++) {
        float d[3], p[3];
        raindrop_ray ray;
        d[0] = v->direction[0][i]; d[1] = v->direction[1][i]; d[2] = v->direction[2][i];
        p[0] = v->offset[0][i]; p[1] = v->offset[1][i]; p[2] = v->offset[2][i];
        raindrop_trace(&ray, d, p, v->one_minus_b2[i], RAINDROP_WATER);
        v->out[0][i] = ray.reflected[0];
        v->out[1][i] = ray.reflected[1];
        v->out[2][i] = ray.reflected[2];
        v->out[6][i] = ray.fresnel;
        v->out[3][i] = ray.refracted[0];
        v->out[4][i] = ray.refracted[1];
        v->out[5][i] = ray.refracted[2];
        v->out[7][i] = ray.transmit;
    }
}

static void time_arrays(void *user)
{
    vectors *v = (vectors *)user;
    raindrop_trace_n(&v->to, &v->in, FRAGMENTS, RAINDROP_WATER);
}

static void time_spheroid(void *user)
{
    vectors *v = (vectors *)user;
    int i;
    for (i = 0; i < FRAGMENTS; i++) {
        float d[3], p[3];
        raindrop_ray ray;
        d[0] = v->direction[0][i]; d[1] = v->direction[1][i]; d[2] = v->direction[2][i];
        p[0] = v->offset[0][i]; p[1] = v->offset[1][i]; p[2] = v->offset[2][i];
        raindrop_trace_spheroid(&ray, d, p, 0.8f, RAINDROP_WATER);
        v->out[0][i] = ray.reflected[0] + ray.refracted[0] + ray.fresnel;
    }
}

static void bench_vectors(void)
{
    static vectors v;
    uint64_t seed = 1;
    int i, c, base;
    for (i = 0; i < FRAGMENTS; i++) {
        double r = sqrt(support_uniform(&seed)) * 0.999, a = 6.2831853 * support_uniform(&seed);
        float d[3], p[3];
        v.s[i] = (float)(r * cos(a));
        v.t[i] = (float)(r * sin(a));
        raindrop_sprite_ray(d, p, &v.one_minus_b2[i], v.s[i], v.t[i], 6);
        for (c = 0; c < 3; c++) { v.direction[c][i] = d[c]; v.offset[c][i] = p[c]; }
    }
    for (c = 0; c < 3; c++) {
        v.in.direction[c] = v.direction[c];
        v.in.centre_offset[c] = v.offset[c];
        v.to.reflected[c] = v.out[c];
        v.to.refracted[c] = v.out[3 + c];
    }
    v.in.one_minus_b2 = v.one_minus_b2;
    v.to.fresnel = v.out[6];
    v.to.transmit = v.out[7];
    v.to.footprint_reflected = v.out[8];
    v.to.footprint_refracted = v.out[9];
    bench_table("Reflection, refraction and Fresnel factor of a fragment", "method\tbytes\tns\tmap_over_this_ratio\tsphere_over_this_ratio");
    bench_note("ratios against the trilinear map of the same row's run (base 512 for the closed forms, at distance 6 radii)");
    for (base = 16; base <= (bench_quick() ? 256 : 1024); base *= 4) {
        double bytes = 0;
        bench_times t;
        reference_map(&v.map, base, 32, RAINDROP_WATER);
        v.distance = 6;
        for (c = base; c; c /= 2) bytes += 32.0 * c * c;
        t = bench_ratio(time_map, &v, time_single, &v, bench_rounds(15));
        bench_row("map %d\t%.0f\t%.1f\t1\t%.2f", base, bytes, t.work / FRAGMENTS * 1e9, 1 / t.ratio);
        raindrop_map_destroy(v.map);
    }
    reference_map(&v.map, 512, 32, RAINDROP_WATER);
    {
        bench_times t = bench_ratio(time_single, &v, time_map, &v, bench_rounds(31));
        bench_row("closed form, one ray\t0\t%.2f\t%.2f\t1", t.work / FRAGMENTS * 1e9, 1 / t.ratio);
        t = bench_ratio(time_arrays, &v, time_map, &v, bench_rounds(31));
        bench_row("closed form, arrays (%d lanes)\t0\t%.2f\t%.2f\t", (int)RAINDROP__LANES, t.work / FRAGMENTS * 1e9, 1 / t.ratio);
        t = bench_ratio(time_spheroid, &v, time_single, &v, bench_rounds(31));
        bench_row("flattened drop, one ray\t0\t%.2f\t\t%.2f", t.work / FRAGMENTS * 1e9, 1 / t.ratio);
    }
    raindrop_map_destroy(v.map);
}

/* ---- one drop */

static raindrop_drop drop_of(double size, double slope_x, double slope_y)
{
    double focal = 0.5 * SIZE, r = size / 2, distance = sqrt(1 + focal * focal / (r * r)),
           scale = distance / sqrt(1 + slope_x * slope_x + slope_y * slope_y);
    raindrop_drop d;
    memset(&d, 0, sizeof d);
    d.position[0] = (float)(slope_x * scale);
    d.position[1] = (float)(slope_y * scale);
    d.position[2] = (float)-scale;
    d.radius = d.axis_ratio = 1;
    return d;
}

typedef struct frame {
    raindrop_rain *rain;
    raindrop_render_options options;
    raindrop_render_stats stats;
    raindrop_camera camera;
} frame;

static void draw(void *user)
{
    frame *f = (frame *)user;
    memcpy(the.picture, the.background, sizeof(float) * 3 * SIZE * SIZE);
    raindrop_render(the.picture, SIZE * 12, SIZE, SIZE, NULL, &f->camera, f->rain, the.environment, &f->options,
                    &f->stats);
}

static double error_of(const unsigned char *mask)
{
    return reference_rmse(the.picture, the.truth, mask, SIZE * SIZE, the.key);
}

/* Where the errors are: tone-mapped luminance, the reference's or what differs from it. */
static void error_picture(const char *name, const char *caption, int take_away)
{
    static float v[SIZE * SIZE];
    int i;
    for (i = 0; i < SIZE * SIZE; i++) {
        double truth = reference_tone(the.truth + 3 * i, the.key);
        v[i] = (float)(take_away ? reference_tone(the.picture + 3 * i, the.key) - truth : truth);
    }
    if (take_away) bench_picture(name, caption, v, SIZE, SIZE, BENCH_SIGNED, -0.1, 0.1);
    else bench_picture(name, caption, v, SIZE, SIZE, BENCH_GREY, 0, 1);
}

static raindrop_rain *own_rain(const raindrop_drop *drops, int count)
{
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    o.drops = drops;
    o.count = count;
    raindrop_rain_create(&rain, &o);
    return rain;
}

/* the reference's rays a pixel, squared */
static int rays(void) { return bench_smoke() ? 1 : 8; }

static void bench_closeup(void)
{
    static const double sizes[6] = {256, 128, 64, 32, 16, 8};
    int off, i, base, look, quick = bench_quick();
    bench_table("One drop against 8 x 8 rays a pixel, over its own pixels",
                "place\tpixels\tmethod\trmse\tssim\tdefault");
    bench_plot("One drop in the middle, by its size; x=pixels; y=rmse; by=method; where=place:centre; log=xy; style=linespoints");
    bench_plot("33 degrees off axis; x=pixels; y=rmse; by=method; where=place:33 degrees; log=xy; style=linespoints");
    bench_note("eq 2.5, tone-mapped luminance; 33 degrees off axis a sprite cannot be right");
    for (off = 0; off < 2; off++) {
        for (i = 0; i < 6; i++) {
            raindrop_drop drop = drop_of(sizes[i], off ? 0.55 : 0.03, off ? 0.35 : 0.02);
            frame f;
            if (quick && i != 4 && (i != 2 || bench_smoke())) continue;
            f.rain = own_rain(&drop, 1);
            f.camera = the.camera;
            f.options = raindrop_render_defaults();
            f.options.orders = 0;
            reference_render(the.truth, the.mask, SIZE, SIZE, rays(), &the.camera, &drop, 1, the.environment, -1);
            for (base = 16; base <= 1024; base *= 2) {
                raindrop_map *map;
                if (quick && base != 16 && base != 256) continue;
                reference_map(&map, base, 32, RAINDROP_WATER);
                f.options.look = RAINDROP_LOOK_MAP;
                f.options.map = map;
                draw(&f);
                bench_row("%s\t%.0f\tmap %d\t%.4f\t%.3f\t0", off ? "33 degrees" : "centre", sizes[i], base, error_of(the.mask), reference_ssim(the.picture, the.truth, the.mask, SIZE, SIZE, the.key));
                raindrop_map_destroy(map);
            }
            for (look = RAINDROP_LOOK_SPRITE; look <= RAINDROP_LOOK_RAY; look++) {
                f.options.look = (raindrop_look)look;
                draw(&f);
                bench_row("%s\t%.0f\t%s\t%.4f\t%.3f\t%d", off ? "33 degrees" : "centre", sizes[i],
                          look == RAINDROP_LOOK_RAY ? "ray" : "closed form, sprite", error_of(the.mask),
                          reference_ssim(the.picture, the.truth, the.mask, SIZE, SIZE, the.key),
                          look == RAINDROP_LOOK_RAY);
            }
            raindrop_rain_destroy(f.rain);
        }
    }
    bench_table("All orders against 8 x 8 rays a pixel with orders 0..3",
                "pixels\torders\texit_fresnel\trmse\ttime_ratio\tdefault");
    for (i = 0; i < 4; i++) {
        raindrop_drop drop = drop_of(sizes[i], 0.03, 0.02);
        frame f, plain;
        bench_times t;
        int order;
        if (quick && i != 1) continue;
        f.rain = own_rain(&drop, 1);
        f.camera = the.camera;
        f.options = raindrop_render_defaults();
        plain = f;
        plain.options.orders = 0;
        reference_render(the.truth, the.mask, SIZE, SIZE, rays(), &the.camera, &drop, 1, the.environment, 3);
        for (order = 0; order <= 3; order++) {
            f.options.orders = order;
            f.options.exit_fresnel = order == 3;
            t = bench_ratio(draw, &f, draw, &plain, bench_rounds(7));
            draw(&f);
            bench_row("%.0f\t%d\t%d\t%.4f\t%.2f\t%d", sizes[i], order, f.options.exit_fresnel, error_of(the.mask), t.ratio, order == 1);
        }
        raindrop_rain_destroy(f.rain);
    }
}

/* ---- the published box */

static raindrop_rain *published(int count)
{
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    o.count = count;
    o.diameter_mm = 2;
    o.box_size[0] = o.box_size[1] = o.box_size[2] = 2.05f;
    raindrop_rain_create(&rain, &o);
    return rain;
}

static void bench_box(int count)
{
    static const struct { const char *name; raindrop_look look; float far_radius; int sort;
    } rows[9] = {{"map", RAINDROP_LOOK_MAP, 0, 1},
                 {"map, unsorted (as published)", RAINDROP_LOOK_MAP, 0, 0},
                 {"closed form, sprite", RAINDROP_LOOK_SPRITE, 0, 1},
                 {"ray", RAINDROP_LOOK_RAY, 0, 1},
                 {"auto, far below 1.5 px", RAINDROP_LOOK_AUTO, 1.5f, 1},
                 {"auto, far below 2 px", RAINDROP_LOOK_AUTO, 2, 1},
                 {"auto, far below 3 px", RAINDROP_LOOK_AUTO, 3, 1},
                 {"auto, far below 6 px", RAINDROP_LOOK_AUTO, 6, 1},
                 {"auto, far below 1.5 px, unsorted", RAINDROP_LOOK_AUTO, 1.5f, 0}};
    char title[128];
    frame f, map;
    int i;
    raindrop_camera camera = the.camera;
    double start;
    camera.depth_near = 0.005f;
    f.rain = published(count);
    f.camera = camera;
    f.options = raindrop_render_defaults();
    f.options.map = the.map;
    map = f;
    map.options.look = RAINDROP_LOOK_MAP;
    snprintf(title, sizeof title, "Rain: %d drops of 2 mm in the published box, 512 x 512, against 8 x 8 rays a pixel", count);
    bench_table(title, "method\tms\ttime_ratio\treference_over_this_ratio\trmse\tssim\tfragments\tdefault");
    bench_plot(count == 100000 ? "Rain: error against time; x=time_ratio; y=rmse; by=method; log=xy; picture=plot_raindrop" : "Rain: error against time; x=time_ratio; y=rmse; by=method; log=xy");
    start = bench_clock();
    reference_render(the.truth, NULL, SIZE, SIZE, rays(), &camera, raindrop_rain_drops(NULL, f.rain), count,
                     the.environment, 3);
    start = bench_clock() - start;
    if (count == 100000) error_picture("raindrop_truth", "reference: rays through every drop", 0);
    memcpy(the.picture, the.background, sizeof(float) * 3 * SIZE * SIZE);
    bench_row("no rain\t0\t0\t\t%.4f\t%.3f\t0\t0", error_of(NULL), reference_ssim(the.picture, the.truth, NULL, SIZE, SIZE, the.key));
    for (i = 0; i < 9; i++) {
        bench_times t;
        f.options.look = rows[i].look;
        f.options.far_radius = rows[i].far_radius;
        f.options.sort = rows[i].sort;
        t = bench_ratio(draw, &f, draw, &map, bench_rounds(count > 500000 ? 5 : 9));
        draw(&f);
        bench_row("%s\t%.1f\t%.2f\t%.0f\t%.4f\t%.3f\t%zu\t%d", rows[i].name, t.work * 1e3, t.ratio, start / t.work, error_of(NULL),
                  reference_ssim(the.picture, the.truth, NULL, SIZE, SIZE, the.key), f.stats.fragments, i == 4);
        if (count == 100000 && (i == 1 || i == 4))
            error_picture(i == 1 ? "raindrop_published" : "raindrop_default", i == 1 ? "sprites from maps, as published" : "the default", 1);
    }
    raindrop_rain_destroy(f.rain);
}

static void advance(void *user) { raindrop_rain_advance((raindrop_rain *)user, 1 / 60.0); }

static void bench_counts(void)
{
    static const int counts[6] = {125000, 250000, 500000, 1000000, 2000000, 4000000};
    int i;
    bench_table("Frames per second by number of drops (table 2.2), one core, 512 x 512, animation included",
                "drops\tmap_fps\tauto_fps\tauto_over_map_time_ratio\tadvance_ms\tgusty_advance_ms\tpublished_gtx280_fps");
    bench_plot("Frames per second; x=drops; y=auto_fps; log=xy; style=linespoints");
    for (i = 0; i < (bench_smoke() ? 1 : bench_quick() ? 4 : 6); i++) {
        static const int thesis[6] = {794, 540, 295, 157, 83, 46};
        frame f, map;
        bench_times t;
        double step, gust;
        float wind[3] = {4, 0, 0}, calm[3] = {0, 0, 0};
        f.rain = published(counts[i]);
        f.camera = the.camera;
        f.camera.depth_near = 0.005f;
        f.options = raindrop_render_defaults();
        f.options.map = the.map;
        map = f;
        map.options.look = RAINDROP_LOOK_MAP;
        map.options.sort = 0;
        t = bench_ratio(draw, &f, draw, &map, bench_rounds(5));
        step = bench_time(advance, f.rain, 3);
        raindrop_rain_set_wind(f.rain, wind);
        gust = bench_time(advance, f.rain, 1);
        raindrop_rain_set_wind(f.rain, calm);
        bench_row("%d\t%.1f\t%.1f\t%.2f\t%.2f\t%.1f\t%d", counts[i], 1 / (t.peer + step), 1 / (t.work + step), t.ratio, step * 1e3, gust * 1e3, thesis[i]);
        raindrop_rain_destroy(f.rain);
    }
}

/* ---- motion */

typedef struct moments {
    frame still;
    const raindrop_drop *drops;
    raindrop_drop *moved;
    int count, steps;
    double exposure;
    float *sum;
} moments;

static void draw_moments(void *user)
{
    moments *m = (moments *)user;
    int step, i, c;
    size_t k;
    memset(m->sum, 0, sizeof(float) * 3 * SIZE * SIZE);
    for (step = 0; step < m->steps; step++) {
        double t = ((step + 0.5) / m->steps - 0.5) * m->exposure;
        memcpy(m->moved, m->drops, sizeof *m->moved * (size_t)m->count);
        for (i = 0; i < m->count; i++)
            for (c = 0; c < 3; c++) m->moved[i].position[c] += (float)(t * (double)m->drops[i].velocity[c]);
        raindrop_rain_set_drops(m->still.rain, m->moved, m->count);
        draw(&m->still);
        for (k = 0; k < 3 * SIZE * SIZE; k++) m->sum[k] += the.picture[k] / (float)m->steps;
    }
}

static void bench_streaks(void)
{
    static const double exposures[4] = {1 / 30.0, 1 / 125.0, 1 / 500.0, 1 / 2000.0};
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    moments m;
    frame f;
    int i;
    o.count = 60000;
    o.box_size[0] = o.box_size[1] = o.box_size[2] = 4;
    o.diameter_min_mm = 0.5;
    raindrop_rain_create(&rain, &o);
    memset(&m, 0, sizeof m);
    m.count = o.count;
    m.drops = raindrop_rain_drops(NULL, rain);
    m.moved = (raindrop_drop *)malloc(sizeof *m.moved * (size_t)m.count);
    m.sum = pixels_of();
    m.still.rain = own_rain(m.drops, m.count);
    m.still.camera = the.camera;
    m.still.camera.depth_near = 0.05f;
    m.still.options = raindrop_render_defaults();
    f = m.still;
    f.rain = rain;
    bench_table("Streaks against many still moments: 60000 Marshall-Palmer drops", "exposure_s\tmoments\trmse\tmoments_over_streak_time_ratio\tdefault");
    bench_note("the reference row is the mean of 64 moments; fewer moments against it show what they would cost");
    for (i = 0; i < 4; i++) {
        bench_times t;
        f.camera.exposure = (float)exposures[i];
        m.exposure = exposures[i];
        m.steps = bench_smoke() ? 8 : 64;
        t = bench_ratio(draw_moments, &m, draw, &f, bench_quick() ? 1 : 3);
        draw_moments(&m);
        memcpy(the.truth, m.sum, sizeof(float) * 3 * SIZE * SIZE);
        draw(&f);
        bench_row("%.5f\tstreak\t%.4f\t%.1f\t1", exposures[i], error_of(NULL), t.ratio);
        m.steps = 8;
        draw_moments(&m);
        memcpy(the.picture, m.sum, sizeof(float) * 3 * SIZE * SIZE);
        bench_row("%.5f\t8\t%.4f\t%.1f\t0", exposures[i], error_of(NULL), t.ratio / 8);
    }
    raindrop_rain_destroy(rain);
    raindrop_rain_destroy(m.still.rain);
    free(m.moved);
    free(m.sum);
}

/* Light of one drop under a white sky over its area, for many places among the pixels and directions of its streak. */
static void bench_energy(void)
{
    enum { SIDE = 64, PLACES = 64 };
    static const float radii[] = {0.05f, 0.2f, 0.5f, 1, 1.5f, 2, 8}, streaks[] = {0, 1, 4, 16};
    static float white[3 * 16 * 8], picture[3 * SIDE * SIDE];
    sat_image view = sat_image_f32(white, 16, 8, 3);
    raindrop_environment *sky = NULL;
    raindrop_camera camera = raindrop_camera_defaults();
    raindrop_render_options o = raindrop_render_defaults();
    size_t i, j;
    int k, place;
    for (i = 0; i < 3 * 16 * 8; i++) white[i] = 1;
    raindrop_environment_create(&sky, &view, NULL, NULL);
    o.coverage_threshold = 0;
    bench_table("Light of a drop over its area, by its place among the pixels", "radius_px\tstreak_px\tsmallest\tmean\tlargest\tdefault");
    for (i = 0; i < sizeof radii / sizeof *radii; i++)
        for (j = 0; j < sizeof streaks / sizeof *streaks; j++) {
            double least = 9, most = 0, mean = 0;
            for (place = 0; place < PLACES; place++) {
                float pixel = 2.0f / SIDE, angle = 0.39f * (float)place, r = radii[i] * pixel;
                raindrop_drop drop = {{0, 0, -1}, 0, {0, 0, 0}, 1};
                raindrop_rain *rain;
                double sum = 0;
                drop.position[0] = pixel * (float)(place % 8) / 8;
                drop.position[1] = pixel * (float)(place / 8) / 8;
                drop.radius = r;
                drop.velocity[0] = cosf(angle);
                drop.velocity[1] = sinf(angle);
                rain = own_rain(&drop, 1);
                camera.exposure = streaks[j] * pixel;
                memset(picture, 0, sizeof picture);
                raindrop_render(picture, SIDE * 12, SIDE, SIDE, NULL, &camera, rain, sky, &o, NULL);
                raindrop_rain_destroy(rain);
                for (k = 0; k < SIDE * SIDE; k++) sum += (double)picture[3 * k];
                sum *= (double)(1 - r * r) / (acos(-1.0) * (double)radii[i] * (double)radii[i]);
                least = sum < least ? sum : least;
                most = sum > most ? sum : most;
                mean += sum / PLACES;
            }
            bench_row("%g\t%g\t%.4f\t%.4f\t%.4f\t1", (double)radii[i], (double)streaks[j], least, mean, most);
        }
    raindrop_environment_destroy(sky);
}

/* ---- the environment's filters */

typedef struct lookups {
    raindrop_environment *environment;
    float direction[FRAGMENTS][3], footprint;
    float sum;
} lookups;

static void look_up(void *user)
{
    lookups *l = (lookups *)user;
    int i;
    for (i = 0; i < FRAGMENTS; i++) {
        float rgb[3];
        raindrop_environment_sample(rgb, l->environment, l->direction[i], l->footprint);
        l->sum += rgb[0];
    }
}

static void bench_filters(void)
{
    static const struct { const char *name; raindrop_filter filter; int resolution;
    } rows[5] = {{"mips 256", RAINDROP_FILTER_MIPS, 256},
                 {"mips 512", RAINDROP_FILTER_MIPS, 512},
                 {"mips 1024", RAINDROP_FILTER_MIPS, 1024},
                 {"mips 2048", RAINDROP_FILTER_MIPS, 2048},
                 {"boxes of a table", RAINDROP_FILTER_SAT, 1024}};
    static const double sizes[3] = {256, 48, 12};
    static lookups l[5];
    uint64_t seed = 2;
    int i, k, c;
    raindrop_environment *old = the.environment, *sharp = NULL;
    raindrop_environment_options o = raindrop_environment_defaults();
    bench_table("Filters of the environment: lookup time, and one drop 20 degrees off axis by rays", "filter\tpixels\tmegabytes\tns\ttime_ratio\trmse\tdefault");
    bench_plot("Filter: error against time; x=time_ratio; y=rmse; by=filter; log=xy");
    o.resolution = 2048;
    o.far_samples = 16;
    raindrop_environment_create(&sharp, &the.view, &o, NULL);
    for (k = 0; k < 5; k++) {
        raindrop_environment_stats stats;
        o.filter = rows[k].filter;
        o.resolution = rows[k].resolution;
        raindrop_environment_create(&l[k].environment, &the.view, &o, &stats);
        for (i = 0; i < FRAGMENTS; i++)
            for (c = 0; c < 3; c++) l[k].direction[i][c] = (float)support_gaussian(&seed);
        for (i = 0; i < 3; i++) {
            raindrop_drop drop = drop_of(sizes[i], 0.3, 0.2);
            bench_times t;
            frame f;
            if (bench_quick() && i != 1) continue;
            the.environment = sharp;
            reference_render(the.truth, the.mask, SIZE, SIZE, bench_quick() && rays() > 4 ? 4 : rays(), &the.camera,
                             &drop, 1, sharp, -1);
            the.environment = l[k].environment;
            f.rain = own_rain(&drop, 1);
            f.camera = the.camera;
            f.options = raindrop_render_defaults();
            f.options.orders = 0;
            draw(&f);
            l[k].footprint = (float)(2 / (sizes[i] / 2));
            l[2].footprint = l[k].footprint;
            if (k < 2) l[2].environment = l[k].environment; /* not made yet: its own time */
            t = bench_ratio(look_up, &l[k], look_up, k < 2 ? &l[k] : &l[2], bench_rounds(9));
            bench_row("%s\t%.0f\t%.1f\t%.1f\t%.2f\t%.4f\t%d", rows[k].name, sizes[i], (double)stats.bytes / 1e6, t.work / FRAGMENTS * 1e9, t.ratio, error_of(the.mask), k == 2);
            raindrop_rain_destroy(f.rain);
        }
        if (k < 2) l[2].environment = NULL;
    }
    for (k = 0; k < 5; k++) raindrop_environment_destroy(l[k].environment);
    raindrop_environment_destroy(sharp);
    the.environment = old;
}

/* ---- the order of drops: none, slices of depth, weighted blending (McGuire and Bavoil 2013), against sorted ones */

/* Every drop by itself over black and white, so that its opacity and colour are known. */
typedef struct single { raindrop__frame frame; raindrop__batch batch; float *over[2]; } single;

static void draw_single(single *s, const raindrop__visible *v, int white)
{
    s->frame.rgb = (unsigned char *)s->over[white];
    raindrop__draw(&s->batch, v);
}

static raindrop__box box_of(const single *s, const raindrop__visible *v)
{
    raindrop__placed placed = {0, 0, 0, 0, 0, 0, 0};
    if (!(v->drop & RAINDROP__FAR_BIT)) raindrop__place_drop(&placed, &s->frame, v->drop);
    return raindrop__bounds(&s->frame, v, &placed);
}

/* weight: 0 equation 9 with its 200 at the farthest drop, 1 the fourth power of nearness. */
static void blend_weighted(single *s, const uint64_t *order, int n, double farthest, int weight)
{
    double *sum = (double *)calloc(SIZE * SIZE * 5, sizeof *sum), *at;
    size_t k;
    int i, x, y, c;
    for (k = 0; k < SIZE * SIZE; k++) sum[5 * k + 4] = 1;
    for (k = 0; k < 3 * SIZE * SIZE; k++) { s->over[0][k] = 0; s->over[1][k] = 1; }
    for (i = 0; i < n; i++) {
        const raindrop__visible *v = &s->frame.rain->visible[(uint32_t)order[i]];
        raindrop__box box = box_of(s, v);
        double z = (double)v->depth, w = weight ? pow(farthest / z, 4) : 0.03 / (1e-5 + pow(z / farthest, 4));
        w = w < 0.01 ? 0.01 : w > 3000 && !weight ? 3000 : w;
        draw_single(s, v, 0);
        draw_single(s, v, 1);
        for (y = box.y0; y < box.y1; y++)
            for (x = box.x0; x < box.x1; x++) {
                float *black = s->over[0] + 3 * (y * SIZE + x), *white = s->over[1] + 3 * (y * SIZE + x);
                double alpha = 1 - ((double)white[1] - (double)black[1]);
                at = sum + 5 * (size_t)(y * SIZE + x);
                for (c = 0; c < 3; c++) {
                    at[c] += w * (double)black[c];
                    black[c] = 0;
                    white[c] = 1;
                }
                at[3] += w * alpha;
                at[4] *= 1 - alpha;
            }
    }
    for (k = 0; k < SIZE * SIZE; k++)
        for (c = 0; c < 3; c++)
            the.picture[3 * k + (size_t)c] =
                (float)(sum[5 * k + 4] * (double)the.background[3 * k + (size_t)c] +
                        (1 - sum[5 * k + 4]) * sum[5 * k + (size_t)c] / (sum[5 * k + 3] + 1e-30));
    free(sum);
}

/* Slices as raindrop_gl_render has them: thinner the nearer. */
static void blend_slices(single *s, const uint64_t *order, int n, double farthest, int slices)
{
    int i, k;
    memcpy(the.picture, the.background, sizeof(float) * 3 * SIZE * SIZE);
    s->frame.rgb = (unsigned char *)the.picture;
    for (k = slices - 1; k >= 0; k--)
        for (i = 0; i < n; i++) {
            const raindrop__visible *v = &s->frame.rain->visible[(uint32_t)order[i]];
            int at = (int)(sqrt((double)v->depth / farthest) * slices);
            if ((at < slices ? at : slices - 1) == k) raindrop__draw(&s->batch, v);
        }
}

static void bench_order(void)
{
    static const struct { const char *name; int count; double diameter, box, rate;
    } rains[4] = {{"50 mm/h in 8 m", 0, 0, 8, 50}, {"1e5 of 2 mm in 2.05 m", 100000, 2, 2.05, 10},
                  {"1e6 of 2 mm in 2.05 m", 1000000, 2, 2.05, 10}, {"6e4 of 3 mm in 1 m", 60000, 3, 1, 10}};
    static const int slices[4] = {1, 4, 16, 64};
    static raindrop__tally tally;
    static single s;
    int i, k, n;
    bench_table("The order of drops against sorted ones", "rain\tmethod\trmse\tdefault");
    bench_note("slices: 1 is the array's order, as published; weighted: McGuire and Bavoil 2013");
    for (k = 0; k < 4; k++) {
        raindrop_rain_options o = raindrop_rain_defaults();
        frame f;
        double farthest = 0;
        const uint64_t *order;
        char name[64];
        if (bench_quick() && k != 1) continue;
        o.count = rains[k].count;
        o.diameter_mm = rains[k].diameter;
        o.rate_mm_h = rains[k].rate;
        o.box_size[0] = o.box_size[1] = o.box_size[2] = (float)rains[k].box;
        raindrop_rain_create(&f.rain, &o);
        f.camera = the.camera;
        f.camera.depth_near = 0.005f;
        f.options = raindrop_render_defaults();
        draw(&f);
        memcpy(the.truth, the.picture, sizeof(float) * 3 * SIZE * SIZE);
        memset(&s, 0, sizeof s);
        s.frame.camera = f.camera;
        s.frame.options = f.options;
        s.frame.rain = f.rain;
        s.frame.environment = the.environment;
        s.frame.stride = SIZE * 12;
        s.frame.width = s.frame.height = SIZE;
        raindrop__set_frame(&s.frame);
        raindrop__begin_batch(&s.batch, &s.frame, &tally);
        s.batch.y1 = SIZE;
        s.over[0] = pixels_of();
        s.over[1] = pixels_of();
        n = raindrop__gather_pairs(f.rain);
        order = f.rain->pairs[0];
        for (i = 0; i < n; i++) {
            double z = (double)f.rain->visible[(uint32_t)order[i]].depth;
            farthest = z > farthest ? z : farthest;
        }
        for (i = 0; i < 4; i++) {
            blend_slices(&s, order, n, farthest, slices[i]);
            snprintf(name, sizeof name, "%d slices", slices[i]);
            bench_row("%s\t%s\t%.6f\t%d", rains[k].name, name, error_of(NULL), i == 0);
        }
        for (i = 0; i < 2; i++) {
            blend_weighted(&s, order, n, farthest, i);
            bench_row("%s\t%s\t%.6f\t0", rains[k].name, i ? "weighted, z^-4" : "weighted, eq 9", error_of(NULL));
        }
        free(s.over[0]);
        free(s.over[1]);
        raindrop_rain_destroy(f.rain);
    }
}

/* ---- lamps and drops that swing */

static void bench_lamps(void)
{
    static const int lamps[4] = {0, 1, 4, 16};
    raindrop_lamp all[16];
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_environment_options e = raindrop_environment_defaults();
    raindrop_environment *old = the.environment;
    frame f, none;
    int i, swings;
    o.rate_mm_h = 25;
    o.box_size[0] = o.box_size[1] = o.box_size[2] = 5;
    e.far_swing = 1;
    memset(&f, 0, sizeof f);
    raindrop_environment_create(&the.environment, &the.view, &e, NULL);
    raindrop_rain_create(&f.rain, &o);
    f.camera = the.camera;
    f.camera.depth_near = 0.05f;
    f.camera.exposure = 1 / 125.0f;
    f.options = raindrop_render_defaults();
    f.options.lamps = all;
    none = f;
    for (i = 0; i < 16; i++) {
        all[i] = raindrop_lamp_defaults();
        all[i].position[0] = i % 2 ? 3.5f : -3.5f;
        all[i].position[1] = 3;
        all[i].position[2] = (float)(-4 - 4 * (i / 2));
    }
    bench_table("Lamps and oscillation: 25 mm/h in a box of 5 m, streaks of 1/125 s", "lamps\toscillation\ttime_ratio\tdefault");
    for (swings = 0; swings < 2; swings++)
        for (i = 0; i < 4; i++) {
            bench_times t;
            if (bench_quick() && i == 3) continue;
            f.options.oscillation = swings ? 0.1f : 0;
            f.options.lamp_count = lamps[i];
            t = bench_ratio(draw, &f, draw, &none, bench_rounds(7));
            bench_row("%d\t%g\t%.2f\t%d", lamps[i], swings ? 0.1 : 0.0, t.ratio, !swings && !i);
        }
    raindrop_rain_destroy(f.rain);
    raindrop_environment_destroy(the.environment);
    the.environment = old;
}

/* ---- what is left out, and the stiff step */

static void bench_left_out(void)
{
    static const float thresholds[4] = {0, 0.0001f, 0.001f, 0.01f};
    raindrop_rain_options o = raindrop_rain_defaults();
    frame f, all;
    int i;
    o.rate_mm_h = 25;
    o.box_size[0] = o.box_size[1] = o.box_size[2] = 5;
    memset(&f, 0, sizeof f);
    raindrop_rain_create(&f.rain, &o);
    f.camera = the.camera;
    f.camera.depth_near = 0.05f;
    f.options = raindrop_render_defaults();
    all = f;
    all.options.coverage_threshold = 0;
    draw(&all);
    memcpy(the.truth, the.picture, sizeof(float) * 3 * SIZE * SIZE);
    bench_table("Leaving out drops by coverage: 25 mm/h in a box of 5 m", "threshold_px\tdrops\tdrawn\tbelow\tbehind\toutside\tcoverage_left_out_px\ttime_ratio\trmse\tdefault");
    for (i = 0; i < 4; i++) {
        bench_times t;
        f.options.coverage_threshold = thresholds[i];
        t = bench_ratio(draw, &f, draw, &all, bench_rounds(7));
        draw(&f);
        bench_row("%g\t%zu\t%zu\t%zu\t%zu\t%zu\t%.2f\t%.2f\t%.5f\t%d", (double)thresholds[i], f.stats.drops, f.stats.drawn_far + f.stats.drawn_near, f.stats.below_threshold,
                  f.stats.behind, f.stats.outside, f.stats.coverage_left_out, t.ratio, error_of(NULL), i == 1);
    }
    raindrop_rain_destroy(f.rain);
}

/* dv/dt = g - k v - q v^2 from 10 m/s over 1/60 s by many Runge-Kutta steps. */
static double drag_reference(double g, double k, double q)
{
    long double v = 10, h, a, b, c, d;
    int n = 1000 + (int)(k + q * 20), i;
    h = 1 / (60.0L * n);
    for (i = 0; i < n; i++) {
        a = g - (k + q * v) * v;
        b = v + h / 2 * a, b = g - (k + q * b) * b;
        c = v + h / 2 * b, c = g - (k + q * c) * c;
        d = v + h * c, d = g - (k + q * d) * d;
        v += h / 6 * (a + 2 * b + 2 * c + d);
    }
    return (double)v;
}

static void bench_drag(void)
{
    static const double sizes[6] = {0.001, 0.01, 0.1, 0.5, 1, 6};
    int i;
    bench_table("Drag: thrown at 10 m/s, one step of 1/60 s", "diameter_mm\tterminal_m_s\tsteps_per_time_constant_ratio\tstep\tvelocity_m_s\terror_relative\tdefault");
    bench_plot("One step of dt = 1/60 s: error against stiffness; x=steps_per_time_constant_ratio; y=error_relative; by=step; log=xy; style=linespoints");
    for (i = 0; i < 6; i++) {
        float calm[3] = {0, 0, 0};
        raindrop_drop a = drop_of(100, 0, 0), b;
        double d = sizes[i] * 1e-3, vt = raindrop_terminal_velocity(sizes[i]), g = 9.80665 * (1 - 1.204 / 998.2),
               k = 18 * 1.81e-5 / (998.2 * d * d), q = (g - k * vt) / (vt * vt);
        double truth = drag_reference(g, k, q), velocity[3];
        int step;
        a.radius = (float)(d / 2);
        a.velocity[1] = -10;
        b = a;
        raindrop_fall(&a, calm, 1 / 60.0);
        raindrop_fall(&b, calm, 1 / 120.0);
        raindrop_fall(&b, calm, 1 / 120.0);
        velocity[0] = -(double)a.velocity[1], velocity[1] = -(double)b.velocity[1],
        velocity[2] = 10 + (g - k * 10 - q * 100) / 60;
        for (step = 0; step < 3; step++)
            bench_row("%g\t%.5g\t%.3g\t%s\t%.6g\t%.2g\t%d", sizes[i], vt, (k + 2 * q * vt) / 60,
                      step == 0   ? "exact"
                      : step == 1 ? "exact, two halves"
                                  : "Euler",
                      velocity[step], fabs(velocity[step] / truth - 1), step == 0);
    }
}

int main(void)
{
    bench_start("raindrop.h");
    open_scene();
    bench_vectors();
    bench_closeup();
    bench_box(100000);
    if (!bench_quick()) bench_box(1000000);
    bench_counts();
    bench_streaks();
    bench_energy();
    bench_order();
    bench_lamps();
    bench_filters();
    bench_left_out();
    bench_drag();
    return 0;
}
