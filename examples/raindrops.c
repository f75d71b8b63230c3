/* raindrops.c - rain before an environment map: stills, paused, slow and real-time sequences, and one drop in close-up.
   SPDX-License-Identifier: MIT-0 OR Unlicense

       raindrops forest.exr rain.png --rate 25mm --exposure 0.01            rain at a rate, streaks of 1/100 s
       raindrops city.exr drops.png --count 300000 --diameter 2             as published: one size, frozen
       raindrops --frames 24 --dt 0.0005 --out slow.png                     slow_000.png, slow_001.png, ...
       raindrops night.exr lamps.png --lamps 8 --oscillation 0.1 --exposure 0.008    speckled streaks under lamps
       raindrops forest.exr storm.png --rate 100mm --veil 200 --exposure 0.01    the rain beyond the drops, too
       raindrops night.exr sheet.png --sheet                                paused, slow motion and real time
       raindrops forest.exr drop.png --closeup                              one drop beside ray tracing

   Without a picture the sky is made up. A .png is tone-mapped; .exr, .hdr and .pfm are written as they are. What
   drawing rain does not need is in raindrops_views.h: that sky, and both sheets. */

#define _POSIX_C_SOURCE 200809L
#define LIGHTSCAN_IMPLEMENTATION
#include "../raindrop.h"
#include "../tonemap.h"
#include "common.h"

typedef struct settings {
    const char *env;
    int size[2], look, count, frames, seed, oblate, lamps, sheet, closeup;
    float rate, diameter, box, exposure, aperture, focus, dt, fov, turn, key, depth_near, wind, bow, veil, oscillation;
    common_settings common;
} settings;

enum { LAMPS = 16 };

typedef struct scene {
    settings *set;
    raindrop_environment *environment;
    raindrop_map *map;
    raindrop_rain *rain;
    raindrop_camera camera;
    raindrop_render_options render;
    raindrop_lamp lamps[LAMPS];
    image picture, background;
    tonemap *tone;
} scene;

static int check(const char *what, sat_result result)
{
    if (result != SAT_OK) fprintf(stderr, "raindrops: %s: %s\n", what, sat_result_text(result));
    return result == SAT_OK;
}

static int made_up_sky(image *sky);

/* ---- what is around: a file, or dusk over hills ---- */

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
    o.bow_optical_depth = s->set->veil > 0 ? 0 : s->set->bow; /* the veil brings its own, by how much rain there is */
    o.bow_by_depth = s->set->veil > 0 && s->set->bow > 0;
    if (s->set->veil > 0) { /* which shows the prefilter in the large */
        o.far_resolution = 32;
        o.far_samples = 2048;
    }
    o.far_swing = s->set->oscillation > 0;
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

/* ---- street lamps: two rows along the view, shining down, drawn as the discs that they are ---- */

static void place_lamps(scene *s)
{
    int i;
    for (i = 0; i < s->set->lamps; i++) {
        raindrop_lamp *lamp = &s->lamps[i];
        *lamp = raindrop_lamp_defaults();
        lamp->position[0] = i % 2 ? 3.5f : -3.5f;
        lamp->position[1] = 3;
        lamp->position[2] = (float)(-5 - 9 * (i / 2));
        lamp->intensity[0] = 25;
        lamp->intensity[1] = 17;
        lamp->intensity[2] = 8;
        lamp->radius = 0.12f;
        lamp->inner = 1.1f;
        lamp->outer = 1.5f;
    }
    s->render.lamps = s->lamps;
    s->render.lamp_count = s->set->lamps;
}

static void draw_lamp(scene *s, const raindrop_lamp *lamp)
{
    const raindrop_camera *c = &s->camera;
    float at[3], focal = 0.5f * (float)s->picture.height / tanf(0.5f * c->fov_y), radius, area;
    int x, y, k;
    for (k = 0; k < 3; k++) at[k] = lamp->position[k] - c->position[k];
    {
        float right = at[0] * c->right[0] + at[1] * c->right[1] + at[2] * c->right[2],
              up = at[0] * c->up[0] + at[1] * c->up[1] + at[2] * c->up[2],
              z = -(at[0] * c->back[0] + at[1] * c->back[1] + at[2] * c->back[2]);
        if (!(z > 0.1f)) return;
        at[0] = 0.5f * (float)s->picture.width + focal * right / z;
        at[1] = 0.5f * (float)s->picture.height - focal * up / z;
        radius = fmaxf(focal * lamp->radius / z, 0.6f);
        area = focal * focal / (z * z * radius * radius * 3.14159265f); /* of the intensity on its pixels */
    }
    for (y = (int)(at[1] - radius - 1); y <= (int)(at[1] + radius + 1); y++)
        for (x = (int)(at[0] - radius - 1); x <= (int)(at[0] + radius + 1); x++) {
            float cover = radius + 0.5f - hypotf((float)x + 0.5f - at[0], (float)y + 0.5f - at[1]);
            if (x < 0 || y < 0 || x >= s->picture.width || y >= s->picture.height || !(cover > 0)) continue;
            for (k = 0; k < 3; k++)
                s->background.pixels[3 * ((size_t)y * (size_t)s->picture.width + (size_t)x) + (size_t)k] +=
                    fminf(cover, 1) * lamp->intensity[k] * area;
        }
}

/* ---- a picture: what lies behind the rain, and the drops ---- */

static void print_stats(const raindrop_render_stats *r, double seconds)
{
    printf(
        "drops: %zu; drawn by rays %zu, by one lookup %zu; left out: behind %zu, outside %zu, near plane %zu, inside %zu, hidden %zu, too small %zu, invalid %zu\n",
        r->drops, r->drawn_near, r->drawn_far, r->behind, r->outside, r->near_plane, r->inside, r->hidden,
        r->below_threshold, r->invalid);
    printf("fragments: %zu, with internal reflections %zu; %.1f ms\n", r->fragments, r->order_fragments, 1e3 * seconds);
}

/* The surroundings, the lamps, and the veil of the rain beyond the drops. */
static int draw_background(scene *s)
{
    const ptrdiff_t stride = (ptrdiff_t)s->picture.width * 3 * (ptrdiff_t)sizeof(float);
    raindrop_veil_options o = raindrop_veil_defaults();
    int i;
    if (!check("background", raindrop_environment_render(s->background.pixels, stride, s->picture.width, s->picture.height, &s->camera, s->environment, &s->set->common.threads))) return 0;
    for (i = 0; i < s->set->lamps; i++) draw_lamp(s, &s->lamps[i]);
    if (!(s->set->veil > 0)) return 1;
    o.extinction = (float)raindrop_extinction((double)s->set->rate);
    o.from = 0.5f * s->set->box;
    o.reach = s->set->veil;
    o.threads = s->set->common.threads;
    return check("veil", raindrop_veil(s->background.pixels, stride, s->picture.width, s->picture.height, NULL, &s->camera, s->environment, &o));
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

#include "raindrops_views.h"

/* ---- the program ---- */

static int set_look(scene *s)
{
    raindrop_map_options o = raindrop_map_defaults();
    o.resolution = 512;
    s->render = raindrop_render_defaults();
    s->render.look = (raindrop_look)s->set->look;
    s->render.oscillation = s->set->oscillation;
    place_lamps(s);
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
    return draw_background(s);
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
        {"bow", 'f', &set.bow, 0, 10, "optical depth of the rain that shows bows; with --veil any but 0: its own"},
        {"veil", 'f', &set.veil, 0, 1e6, "metres to which it rains, beyond the box as a veil; 0: no veil"},
        {"lamps", 'i', &set.lamps, 0, LAMPS, "street lamps that light the drops"},
        {"oscillation", 'f', &set.oscillation, 0, 0.25, "share by which the drops' axes swing; 0.1 is much"},
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
