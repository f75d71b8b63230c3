/* raindrops.c - rain before an environment map: stills, paused, slow and real-time sequences, and one drop in close-up.
   SPDX-License-Identifier: MIT-0 OR Unlicense

       raindrops forest.exr rain.png --rate 25mm --exposure 0.01            rain at a rate, streaks of 1/100 s
       raindrops city.exr drops.png --count 300000 --diameter 2             as published: one size, frozen
       raindrops --frames 24 --dt 0.0005 --out slow.png                     slow_000.png, slow_001.png, ...
       raindrops night.exr sheet.png --sheet                                paused, slow motion and real time
       raindrops forest.exr drop.png --closeup                              one drop beside ray tracing

   Without a picture the sky is made up. A .png is tone-mapped; .exr, .hdr and .pfm are written as they are. */

#define _POSIX_C_SOURCE 200809L
#define LIGHTSCAN_IMPLEMENTATION
#include "../raindrop.h"
#include "../tonemap.h"
#include "common.h"

typedef struct settings {
    const char *env;
    int size[2], look, count, frames, seed, oblate, sheet, closeup;
    float rate, diameter, box, exposure, aperture, focus, dt, fov, turn, key, depth_near, wind, bow;
    common_settings common;
} settings;

typedef struct scene {
    settings *set;
    raindrop_environment *environment;
    raindrop_map *map;
    raindrop_rain *rain;
    raindrop_camera camera;
    raindrop_render_options render;
    image picture, background;
    tonemap *tone;
} scene;

static int check(const char *what, sat_result result)
{
    if (result != SAT_OK) fprintf(stderr, "raindrops: %s: %s\n", what, sat_result_text(result));
    return result == SAT_OK;
}

/* ---- what is around: a file, or dusk over hills ---- */

static int made_up_sky(image *sky)
{
    int x, y, c;
    if (!image_create(sky, 1024, 512, 3)) return 0;
    for (y = 0; y < sky->height; y++) {
        for (x = 0; x < sky->width; x++) {
            double a = 6.283185 * (x + 0.5) / sky->width, up = cos(3.141593 * (y + 0.5) / sky->height),
                   hills = 0.1 + 0.04 * sin(5 * a) + 0.02 * sin(13 * a + 1);
            double glow = exp(-6 * fabs(up - hills)) * (0.6 - 0.4 * cos(a)),
                   lamp = pow(fmax(0, cos(40 * a) * cos(31 * up)), 60);
            double sky_rgb[3] = {0.12 + 2.2 * glow, 0.2 + 0.9 * glow, 0.5 + 0.35 * glow}, land[3] = {0.03, 0.035, 0.02};
            float *p = sky->pixels + 3 * ((size_t)y * (size_t)sky->width + (size_t)x);
            for (c = 0; c < 3; c++)
                p[c] = (float)(up > hills ? sky_rgb[c] : land[c] + (up > -0.3 ? lamp * (c == 2 ? 8 : 20) : 0));
        }
    }
    return 1;
}

static int open_environment(scene *s)
{
    raindrop_environment_options o = raindrop_environment_defaults();
    raindrop_environment_stats stats;
    sat_image view;
    image sky;
    int ok;
    if (s->set->env ? !image_load(&sky, s->set->env) : !made_up_sky(&sky))
        return common_say(&s->set->common, sky.message);
    view = image_view(&sky);
    o.threads = s->set->common.threads;
    o.bow_optical_depth = s->set->bow;
    o.sun_direction[0] = -0.5f; /* behind the left shoulder */
    o.sun_direction[1] = 0.5f;
    o.sun_direction[2] = 0.70710678f;
    o.sun_irradiance[0] = o.sun_irradiance[1] = o.sun_irradiance[2] = 10;
    ok = check("environment", raindrop_environment_create(&s->environment, &view, &o, &stats));
    if (ok && s->set->common.stats)
        printf("environment: %d x %d, largest %.4g, %.1f MB; repaired %zu NaN, %zu infinite, %zu negative values\n", sky.width, sky.height, (double)stats.largest,
               (double)stats.bytes / 1e6, stats.nan, stats.infinite, stats.negative);
    image_free(&sky);
    return ok;
}

/* ---- rain ---- */

static int open_rain(scene *s)
{
    raindrop_rain_options o = raindrop_rain_defaults();
    const settings *set = s->set;
    int i;
    o.rate_mm_h = (double)set->rate;
    o.count = set->count;
    o.diameter_mm = (double)set->diameter;
    for (i = 0; i < 3; i++) o.box_size[i] = set->box;
    o.wind[0] = set->wind;
    o.oblate = set->oblate;
    o.seed = (uint32_t)set->seed;
    o.threads = set->common.threads;
    return check("rain", raindrop_rain_create(&s->rain, &o));
}

static void print_stats(const raindrop_render_stats *r, double seconds)
{
    printf(
        "drops: %zu; drawn by rays %zu, by one lookup %zu; left out: behind %zu, outside %zu, near plane %zu, inside %zu, hidden %zu, too small %zu, invalid %zu\n",
        r->drops, r->drawn_near, r->drawn_far, r->behind, r->outside, r->near_plane, r->inside, r->hidden,
        r->below_threshold, r->invalid);
    printf("fragments: %zu, with internal reflections %zu; %.1f ms\n", r->fragments, r->order_fragments, 1e3 * seconds);
}

/* The background and the drops into s->picture. */
static int draw(scene *s)
{
    const ptrdiff_t stride = (ptrdiff_t)s->picture.width * 3 * (ptrdiff_t)sizeof(float);
    raindrop_render_stats stats;
    double start = common_clock();
    memcpy(s->picture.pixels, s->background.pixels, (size_t)stride * (size_t)s->picture.height);
    if (!check("render", raindrop_render(s->picture.pixels, stride, s->picture.width, s->picture.height, NULL, &s->camera, s->rain, s->environment, &s->render, &stats))) return 0;
    if (s->set->common.stats) print_stats(&stats, common_clock() - start);
    return 1;
}

static int tone(unsigned char *rgb, scene *s)
{
    sat_image view = image_view(&s->picture);
    return check("tone mapping", tonemap_apply_u8(s->tone, rgb, (ptrdiff_t)s->picture.width * 3, &view, 0, NULL));
}

static int save(scene *s, const char *path)
{
    size_t bytes = (size_t)s->picture.width * (size_t)s->picture.height * 3;
    unsigned char *rgb;
    int ok;
    if (!image_ends_with(path, ".png")) return common_save(&s->set->common, path, &s->picture);
    rgb = (unsigned char *)malloc(bytes);
    ok = (rgb || common_say(&s->set->common, "no memory")) && tone(rgb, s) &&
         common_save_u8(&s->set->common, path, rgb, s->picture.width, s->picture.height, 3);
    free(rgb);
    return ok;
}

/* ---- sequences ---- */

static int save_frames(scene *s, const char *path)
{
    common_progress progress = {0, 0};
    char name[FILE_PATH], number[16];
    int i;
    for (i = 0; i < s->set->frames; i++) {
        snprintf(number, sizeof number, "_%03d", i);
        if (!common_path(&s->set->common, name, path, number) || !draw(s) || !save(s, name) || !check("advance", raindrop_rain_advance(s->rain, (double)s->set->dt))) return 0;
        common_show_progress(&progress, "frames", i + 1, s->set->frames);
    }
    return 1;
}

/* Four moments each of a paused scene around which the camera turns, of slow motion (1/100) and of real time. */
static int save_sheet(scene *s, const char *path)
{
    static const struct { const char *label; double dt, exposure, turn;
    } rows[3] = {{"paused, the camera turns", 0, 0, 0.12},
                 {"slow motion 1/100", 1 / 6000.0, 1 / 12000.0, 0},
                 {"real time, 1/120 s exposure", 1 / 60.0, 1 / 120.0, 0}};
    const ptrdiff_t stride = (ptrdiff_t)s->picture.width * 3 * (ptrdiff_t)sizeof(float);
    size_t bytes = (size_t)s->picture.width * (size_t)s->picture.height * 3;
    unsigned char *rgb = (unsigned char *)malloc(12 * bytes);
    common_cell cells[12];
    int row, i, ok = rgb != NULL;
    for (row = 0; row < 3 && ok; row++) {
        for (i = 0; i < 4 && ok; i++) {
            float eye[3] = {0, 0, 0}, up[3] = {0, 1, 0}, target[3], angle = s->set->turn + (float)(rows[row].turn * i);
            target[0] = sinf(angle);
            target[1] = 0.05f;
            target[2] = -cosf(angle);
            eye[0] = (float)(-0.02 * rows[row].turn * i);
            s->camera = raindrop_camera_look(eye, target, up, s->set->fov * 0.01745329f);
            s->camera.depth_near = s->set->depth_near;
            s->camera.exposure = (float)rows[row].exposure;
            ok = check("background", raindrop_environment_render(s->background.pixels, stride, s->picture.width, s->picture.height, &s->camera, s->environment, &s->set->common.threads));
            cells[4 * row + i].rgb = rgb + (size_t)(4 * row + i) * bytes;
            cells[4 * row + i].width = s->picture.width;
            cells[4 * row + i].height = s->picture.height;
            cells[4 * row + i].label = rows[row].label;
            ok = ok && draw(s) && tone(rgb + (size_t)(4 * row + i) * bytes, s) &&
                 check("advance", raindrop_rain_advance(s->rain, rows[row].dt));
        }
    }
    ok = ok && common_contact_sheet(&s->set->common, path, cells, 12, 4);
    free(rgb);
    return ok;
}

/* ---- one drop beside ray tracing (Slomp 2012, figure 2.1) ---- */

/* out = refracted d, normal against d, relative index n; double, straight from Snell's law. */
static void bend(double out[3], const double d[3], const double normal[3], double n)
{
    double c = -(d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2]), k = sqrt(fmax(0, 1 - (1 - c * c) / (n * n)));
    int i;
    for (i = 0; i < 3; i++) out[i] = d[i] / n + normal[i] * (c / n - k);
}

/* Light along d through a sphere of radius 1 around `centre`: hit, bend, hit, bend, and the mirrored ray; 0: no hit. */
static int trace(float rgb[3], const scene *s, const double d[3], const double centre[3])
{
    double along = 0, b2 = 0, t, n = (double)RAINDROP_WATER, p[3], q[3], inner[3], leave[3], ci, cr, fs, fp, fresnel;
    float direction[3], mirrored[3], through[3];
    int i;
    for (i = 0; i < 3; i++) along += d[i] * centre[i];
    for (i = 0; i < 3; i++) b2 += (d[i] * along - centre[i]) * (d[i] * along - centre[i]);
    if (b2 >= 1) return 0;
    t = along - sqrt(1 - b2);
    for (i = 0; i < 3; i++) p[i] = d[i] * t - centre[i]; /* the normal, too */
    ci = sqrt(1 - b2);
    bend(inner, d, p, n);
    cr = -(inner[0] * p[0] + inner[1] * p[1] + inner[2] * p[2]);
    for (i = 0; i < 3; i++) q[i] = p[i] + 2 * cr * inner[i];
    for (i = 0; i < 3; i++) leave[i] = -q[i];
    bend(leave, inner, leave, 1 / n);
    fs = (ci - n * cr) / (ci + n * cr);
    fp = (n * ci - cr) / (n * ci + cr);
    fresnel = 0.5 * (fs * fs + fp * fp);
    for (i = 0; i < 3; i++) direction[i] = (float)(d[i] + 2 * ci * p[i]);
    raindrop_environment_sample(mirrored, s->environment, direction, 0);
    for (i = 0; i < 3; i++) direction[i] = (float)leave[i];
    raindrop_environment_sample(through, s->environment, direction, 0);
    for (i = 0; i < 3; i++) rgb[i] = (float)(fresnel * (double)mirrored[i] + (1 - fresnel) * (double)through[i]);
    return 1;
}

static void trace_picture(scene *s, const double centre[3])
{
    const raindrop_camera *camera = &s->camera;
    int w = s->picture.width, h = s->picture.height, x, y, k, i, c;
    double focal = 0.5 * h / tan(0.5 * (double)camera->fov_y);
    for (y = 0; y < h; y++) {
        for (x = 0; x < w; x++) {
            float *out = s->picture.pixels + 3 * ((size_t)y * (size_t)w + (size_t)x), rgb[3], f[3];
            double sum[3] = {0, 0, 0};
            for (k = 0; k < 64; k++) { /* 8 x 8 rays */
                double px = (x + (k % 8 + 0.5) / 8 - 0.5 * w) / focal, py = (0.5 * h - y - (k / 8 + 0.5) / 8) / focal,
                       d[3], length = sqrt(px * px + py * py + 1);
                for (i = 0; i < 3; i++)
                    d[i] =
                        (px * (double)camera->right[i] + py * (double)camera->up[i] - (double)camera->back[i]) / length;
                for (i = 0; i < 3; i++) f[i] = (float)d[i];
                if (!trace(rgb, s, d, centre)) raindrop_environment_sample(rgb, s->environment, f, 0);
                for (c = 0; c < 3; c++) sum[c] += (double)rgb[c] / 64;
            }
            for (c = 0; c < 3; c++) out[c] = (float)sum[c];
        }
    }
}

static int save_closeup(scene *s, const char *path)
{
    static const char *const labels[4] = {"ray traced, 8 x 8 rays", "ray (closed form)", "closed form on a sprite",
                                          "published map"};
    static const raindrop_look looks[4] = {RAINDROP_LOOK_RAY, RAINDROP_LOOK_RAY, RAINDROP_LOOK_SPRITE,
                                           RAINDROP_LOOK_MAP};
    size_t bytes = (size_t)s->picture.width * (size_t)s->picture.height * 3;
    unsigned char *rgb = (unsigned char *)malloc(8 * bytes);
    common_cell cells[8];
    int place, i, k, ok = rgb != NULL;
    s->render.orders = 0; /* eq 2.5 in all of them */
    for (place = 0; place < 2 && ok; place++) { /* in the middle, and to the side, where a sprite cannot be right */
        raindrop_drop drop;
        double centre[3];
        memset(&drop, 0, sizeof drop);
        drop.radius = drop.axis_ratio = 1;
        for (k = 0; k < 3; k++) {
            drop.position[k] =
                (place ? 1.15f * s->camera.right[k] + 0.7f * s->camera.up[k] : 0) - 2.3f * s->camera.back[k];
            centre[k] = (double)drop.position[k];
        }
        ok = check("drop", raindrop_rain_set_drops(s->rain, &drop, 1));
        for (i = 0; i < 4 && ok; i++) {
            s->render.look = looks[i];
            if (i == 0) trace_picture(s, centre);
            else ok = draw(s);
            cells[4 * place + i].rgb = rgb + (size_t)(4 * place + i) * bytes;
            cells[4 * place + i].width = s->picture.width;
            cells[4 * place + i].height = s->picture.height;
            cells[4 * place + i].label = labels[i];
            ok = ok && tone(rgb + (size_t)(4 * place + i) * bytes, s);
        }
    }
    ok = ok && common_contact_sheet(&s->set->common, path, cells, 8, 4);
    free(rgb);
    return ok;
}

/* ---- the program ---- */

static int set_look(scene *s)
{
    raindrop_map_options o = raindrop_map_defaults();
    o.resolution = 512;
    s->render = raindrop_render_defaults();
    s->render.look = (raindrop_look)s->set->look;
    if (s->set->look > 0 && !s->set->closeup) return 1;
    if (!check("map", raindrop_map_create(&s->map, &o))) return 0;
    s->render.map = s->map;
    return 1;
}

static int set_camera(scene *s)
{
    const settings *set = s->set;
    float eye[3] = {0, 0, 0}, up[3] = {0, 1, 0}, target[3];
    target[0] = sinf(set->turn);
    target[1] = 0.05f;
    target[2] = -cosf(set->turn);
    s->camera = raindrop_camera_look(eye, target, up, set->fov * 0.01745329f);
    s->camera.depth_near = set->depth_near;
    s->camera.exposure = set->exposure;
    s->camera.aperture = set->aperture;
    s->camera.focus_distance = set->focus;
    if (!image_create(&s->picture, set->size[0], set->size[1], 3) ||
        !image_create(&s->background, set->size[0], set->size[1], 3))
        return common_say(&set->common, s->picture.pixels ? s->background.message : s->picture.message);
    return check("background", raindrop_environment_render(s->background.pixels, (ptrdiff_t)set->size[0] * 3 * (ptrdiff_t)sizeof(float), set->size[0], set->size[1],
                                                           &s->camera, s->environment, &set->common.threads));
}

static int set_tone(scene *s)
{
    tonemap_options o = tonemap_defaults();
    o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL;
    o.key = (double)s->set->key;
    o.threads = s->set->common.threads;
    return check("tone mapping", tonemap_create(&s->tone, s->set->size[0], s->set->size[1], &o));
}

int main(int argc, char **argv)
{
    settings set;
    scene s;
    int ok;
    const common_option options[] = {
        {"env", 'P', (void *)&set.env, 0, 0, "equirectangular environment; without one it is made up"},
        {"rate", 'm', &set.rate, 0.01, 500, "rain rate in mm/h"},
        {"count", 'i', &set.count, 0, 33554432, "number of drops instead of the rate's"},
        {"diameter", 'f', &set.diameter, 0, 6, "mm, of all drops; 0: Marshall-Palmer"},
        {"box", 'f', &set.box, 0.1, 1000, "edge of the rain box in metres"},
        {"wind", 'f', &set.wind, -100, 100, "m/s to the right"},
        {"oblate", 'b', &set.oblate, 0, 0, "flattened drops"},
        {"bow", 'f', &set.bow, 0, 10, "optical depth of the rain that shows bows"},
        {"exposure", 'f', &set.exposure, 0, 10, "seconds; 0: frozen drops"},
        {"aperture", 'f', &set.aperture, 0, 1, "diameter of the lens in metres; 0: all in focus"},
        {"focus", 'f', &set.focus, 0.001, 1000, "metres"},
        {"look", 'w', &set.look, 0, 0, "map|sprite|ray|auto"},
        {"size", 'z', set.size, 1, 16384, "of the picture"},
        {"fov", 'f', &set.fov, 0.1, 170, "vertical, degrees"},
        {"turn", 'f', &set.turn, -1000, 1000, "radians to the right"},
        {"near", 'f', &set.depth_near, 0.001, 1000, "metres; nearer drops are left out"},
        {"key", 'f', &set.key, 0, 10, "middle grey of the tone mapping; 0: estimated"},
        {"seed", 'i', &set.seed, 0, 2147483647, "of the drops"},
        {"frames", 'i', &set.frames, 0, 999, "write so many pictures, rain_000.png and so on"},
        {"dt", 'f', &set.dt, 0, 1000, "seconds between them; 0: paused"},
        {"sheet", 'b', &set.sheet, 0, 0, "contact sheet: paused, slow motion, real time"},
        {"closeup", 'b', &set.closeup, 0, 0, "contact sheet: one drop beside ray tracing"},
    };
    memset(&s, 0, sizeof s);
    memset(&set, 0, sizeof set);
    set.rate = 10;
    set.look = RAINDROP_LOOK_AUTO;
    set.size[0] = 1280;
    set.size[1] = 720;
    set.seed = 1;
    set.box = 6;
    set.dt = 1 / 60.0f;
    set.focus = 1;
    set.fov = 60;
    set.key = 0.18f;
    set.depth_near = 0.05f;
    common_parse(&set.common, argc, argv, "raindrops", ".png .exr .hdr .pfm", options,
                 (int)(sizeof options / sizeof *options));
    if (set.sheet || set.closeup) set.common.writes = ".png";
    if (!common_may_write(&set.common, set.common.out)) return 2;
    s.set = &set;
    ok = open_environment(&s) && open_rain(&s) && set_look(&s) && set_camera(&s) && set_tone(&s);
    if (ok && set.closeup) ok = save_closeup(&s, set.common.out);
    else if (ok && set.sheet) ok = save_sheet(&s, set.common.out);
    else if (ok && set.frames > 0) ok = save_frames(&s, set.common.out);
    else if (ok) ok = draw(&s) && save(&s, set.common.out);
    tonemap_destroy(s.tone);
    raindrop_rain_destroy(s.rain);
    raindrop_map_destroy(s.map);
    raindrop_environment_destroy(s.environment);
    image_free(&s.picture);
    image_free(&s.background);
    common_close(&set.common);
    return ok ? 0 : 1;
}
