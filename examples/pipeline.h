/* pipeline.h - the six headers one after the other: light, shadows, occlusion, rain, tone.
   SPDX-License-Identifier: MIT-0 OR Unlicense

       pipeline_options options = pipeline_defaults();
       pipeline p;
       if (!pipeline_create(&p, &options)) { puts(p.message); return 1; }
       pipeline_frame(&p, 1 / 30.0);              every stage; p.pixels is the picture, p.stages what each one cost
       pipeline_destroy(&p);

   The program defines the IMPLEMENTATION macros, and for OpenGL PIPELINE_GL and the GL macros; pipeline_change takes
   other options between frames. */

#ifndef PIPELINE_H
#define PIPELINE_H

#include "../fiv.h"
#include "../raindrop.h"
#include "../softassign.h"
#include "../ssao_sat.h"
#include "../tonemap.h"
#include "common.h"
#include "scene.h"
#ifdef PIPELINE_GL
#include "pipeline_gl.h"
#else
typedef struct pipeline_gl pipeline_gl;
#endif

typedef enum pipeline_stage {
    PIPELINE_LIGHT,    /* sky or environment, made ready for shadows and drops; once */
    PIPELINE_MASKS,    /* what each sculpture hides from where; once, when shadows are first asked for */
    PIPELINE_SCENE,    /* rasteriser */
    PIPELINE_SHADOWS,  /* fiv.h */
    PIPELINE_OCCLUSION, /* ssao_sat.h */
    PIPELINE_SHADE,    /* colours, wet ground, background */
    PIPELINE_RAIN,     /* raindrop.h */
    PIPELINE_TONE,     /* tonemap.h */
    PIPELINE_STAGES
} pipeline_stage;

enum { PIPELINE_SKY_DISTANCE = 50 }; /* metres: what is farther is not asked for occlusion */

typedef struct pipeline_options {
    int width, height;           /* 1280, 720 */
    int samples;                 /* 2; 1..4: the scene is drawn so many times wider and higher, and averaged */
    scene_hour hour;             /* SCENE_DUSK */
    float turn;                  /* 0; degrees: turns the light */
    const image *environment;    /* NULL: a sky of our own */
    const mesh *shape;           /* NULL: a trefoil knot */
    int shadows, occlusion, rain, tone; /* 1; 0 leaves the stage out */
    float rate;                  /* 150 mm/h: a cloudburst */
    float ao_radius;             /* 0.12 m */
    float shutter;               /* 0.0002 s: open so long */
    tonemap_operator operation;  /* TONEMAP_GUIDED */
    tonemap_mesopic mesopic;     /* TONEMAP_MESOPIC_LOCAL */
    float key;                   /* 0: one that suits the hour */
    float exposure;              /* 0; stops: the key is doubled so many times */
    sat_threads threads;         /* serial */
    sat_gl_get_proc *get_proc;   /* NULL: on the CPU; otherwise OpenGL, with PIPELINE_GL defined */
} pipeline_options;

typedef struct pipeline {
    pipeline_options options;
    scene scene;
    image sky, dry, hdr;         /* the light; the picture without rain; before tone mapping */
    int settled;                 /* 1: `dry` is what the options ask for */
    float *depth;                /* of the picture */
    float *irradiance[2], *open; /* of the scene's layers; accessibility */
    float *points, *normals, *found; /* receivers in a row, for fiv_irradiance */
    unsigned *where;
    unsigned char *pixels;       /* sRGB, 3 bytes a pixel */
    fiv_environment *light;
    fiv_occluder *occluders[SCENE_OBJECTS];
    ssao_sat *ao;
    raindrop_environment *mirror;
    raindrop_rain *rain;
    tonemap *map;
    pipeline_gl *gl;             /* NULL: on the CPU */
    fiv_environment_stats light_stats;
    fiv_occluder_stats mask_stats[SCENE_OBJECTS];
    fiv_irradiance_stats shadow_stats;
    ssao_sat_stats ao_stats;
    raindrop_render_stats rain_stats;
    tonemap_stats tone_stats;
    double seconds[PIPELINE_STAGES];
    unsigned char *mosaic;       /* made by pipeline_mosaic */
    int mosaic_width, mosaic_height, mosaic_patches, mosaic_tiles;
    softassign_stats mosaic_report;
    double mosaic_seconds;
    char message[400];
} pipeline;

static inline pipeline_options pipeline_defaults(void)
{
    pipeline_options o;
    memset(&o, 0, sizeof o);
    o.width = 1280, o.height = 720, o.samples = 2;
    o.shadows = o.occlusion = o.rain = o.tone = 1;
    o.rate = 150;
    o.ao_radius = 0.12f;
    o.shutter = 0.0002f;
    o.operation = TONEMAP_GUIDED;
    o.mesopic = TONEMAP_MESOPIC_LOCAL;
    return o;
}

static inline int pipeline_check(pipeline *p, const char *what, sat_result result)
{
    if (result != SAT_OK) snprintf(p->message, sizeof p->message, "%s: %s", what, sat_result_text(result));
    return result == SAT_OK;
}

/* The rest of a stage is for the CPU: where there is OpenGL this call does it. */
#ifdef PIPELINE_GL
static inline int pipeline_gl_done(pipeline *p, int ok)
{
    if (!ok) snprintf(p->message, sizeof p->message, "OpenGL: %s", p->gl ? p->gl->message : "not enough memory");
    return ok;
}
static inline int pipeline_gl_ready(pipeline *p)
{
    if (!p->options.get_proc || p->gl) return 1;
    if (pipeline_gl_done(p, pipeline_gl_create(&p->gl, p->options.get_proc, p->options.width, p->options.height)))
        return 1;
    pipeline_gl_destroy(p->gl);
    p->gl = NULL, p->options.get_proc = NULL;
    return 0;
}
#define PIPELINE_ON_GL(p, call) if ((p)->options.get_proc) return pipeline_gl_done(p, call)
#define PIPELINE_GL_FORGET(p) if ((p)->gl) (p)->gl->environment = NULL, (p)->gl->drops = NULL
#else
#define pipeline_gl_ready(p) 1
#define PIPELINE_GL_FORGET(p) ((void)0)
#define PIPELINE_ON_GL(p, call) ((void)0)
#endif

/* ---- light: the same picture lights the ground and shines through the drops ---- */

static inline int pipeline_light(pipeline *p)
{
    fiv_environment_options fo = fiv_environment_defaults();
    raindrop_environment_options ro = raindrop_environment_defaults();
    double start = common_clock();
    sat_image view;
    int i;
    if (!p->options.environment) scene_draw_sky(&p->sky, p->options.hour, p->options.turn, &p->options.threads);
    view = image_view(p->options.environment ? p->options.environment : &p->sky);
    fiv_environment_destroy(p->light);
    raindrop_environment_destroy(p->mirror);
    p->light = NULL, p->mirror = NULL;
    PIPELINE_GL_FORGET(p);
    fo.threads = ro.threads = p->options.threads;
    if (!pipeline_check(p, "fiv_environment_create", fiv_environment_create(&p->light, &view, &fo, &p->light_stats))) return 0;
    if (!pipeline_check(p, "raindrop_environment_create", raindrop_environment_create(&p->mirror, &view, &ro, NULL))) return 0;
    for (i = 0; i < SCENE_OBJECTS; ++i)
        if (p->occluders[i] && !pipeline_check(p, "fiv_occluder_light", fiv_occluder_light(p->occluders[i], p->light, NULL))) return 0;
    p->seconds[PIPELINE_LIGHT] = common_clock() - start;
    return 1;
}

static inline int pipeline_tell(float done, void *user)
{
    common_show_progress((common_progress *)user, "masks", (double)done, 1);
    return 0;
}

/* Of the next sculpture without any: 1, or 0 with a message. */
static inline int pipeline_next_mask(pipeline *p)
{
    double start = common_clock();
    common_progress progress = {0, 0};
    fiv_occluder_options fo = fiv_occluder_defaults();
    const scene_object *o;
    int i = 0;
    while (i < SCENE_OBJECTS - 1 && p->occluders[i]) ++i;
    if (p->occluders[i]) return 1;
    o = &p->scene.objects[i];
    fo.first_shell = 0.15f;
    fo.rho = 17;
    fo.progress = pipeline_tell;
    fo.progress_user = &progress;
    fo.threads = p->options.threads;
    if (!pipeline_check(p, "fiv_occluder_create", fiv_occluder_create(&p->occluders[i], o->positions, o->vertices, o->indices, o->triangles,
                                                                     &fo, &p->mask_stats[i]))) return 0;
    if (p->light && !pipeline_check(p, "fiv_occluder_light", fiv_occluder_light(p->occluders[i], p->light, NULL))) return 0;
    p->seconds[PIPELINE_MASKS] += common_clock() - start;
    return 1;
}

static inline int pipeline_masks(pipeline *p)
{
    while (p->options.shadows && !p->occluders[SCENE_OBJECTS - 1])
        if (!pipeline_next_mask(p)) return 0;
    return 1;
}

/* ---- shadows ---- */

static inline fiv_instance pipeline_caster(const pipeline *p, int object)
{
    fiv_instance caster;
    caster.occluder = p->occluders[object];
    memcpy(caster.position, p->scene.objects[object].place, sizeof caster.position);
    caster.scale = p->scene.objects[object].scale;
    return caster;
}

/* The receivers of one kind in both layers, gathered, lit and put back. */
static inline int pipeline_shadows_on(pipeline *p, int what, const fiv_irradiance_options *fo)
{
    size_t pixels = (size_t)p->scene.width * (size_t)p->scene.height, i, n;
    fiv_instance casters[SCENE_OBJECTS];
    fiv_irradiance_stats stats;
    int layer, k, count = p->options.shadows ? SCENE_OBJECTS : 0;
    for (k = 0; k < SCENE_OBJECTS; ++k) /* the receiver's own object comes last */
        casters[k] = pipeline_caster(p, what == SCENE_FIRST ? SCENE_OBJECTS - 1 - k : k);
    for (layer = 0; layer < 2; ++layer) {
        const scene_layer *l = &p->scene.layers[layer];
        sat_result result;
        for (i = n = 0; i < pixels; ++i)
            if (l->what[i] == what) {
                memcpy(p->points + 3 * n, l->points + 3 * i, 3 * sizeof(float));
                memcpy(p->normals + 3 * n, l->normals + 3 * i, 3 * sizeof(float));
                p->where[n++] = (unsigned)i;
            }
        if (n == 0) continue;
        result = what == SCENE_GROUND || count == 0
                     ? fiv_irradiance(p->found, p->points, p->normals, n, p->light, casters, (size_t)count, fo, &stats)
                     : fiv_self_irradiance(p->found, p->points, p->normals, n, p->light, casters + 1, casters, 1, fo,
                                           &stats);
        if (!pipeline_check(p, "fiv_irradiance", result)) return 0;
        for (i = 0; i < n; ++i)
            memcpy(p->irradiance[layer] + 3 * (size_t)p->where[i], p->found + 3 * i, 3 * sizeof(float));
        p->shadow_stats.below_horizon += stats.below_horizon, p->shadow_stats.below_cutoff += stats.below_cutoff;
        p->shadow_stats.whole += stats.whole, p->shadow_stats.clipped += stats.clipped,
            p->shadow_stats.overlaps += stats.overlaps;
    }
    return 1;
}

#ifdef PIPELINE_GL
/* All receivers of a layer at once; alpha says what they lie on. */
static inline int pipeline_shadows_gl(pipeline *p)
{
    size_t pixels = (size_t)p->scene.width * (size_t)p->scene.height, i, k;
    fiv_instance casters[SCENE_OBJECTS];
    float *rgba = (float *)malloc(pixels * 4 * sizeof(float));
    int layer, ok = pipeline_gl_check(p->gl, rgba ? SAT_OK : SAT_ERR_MEMORY, "shadows");
    for (k = 0; k < SCENE_OBJECTS; ++k) casters[k] = pipeline_caster(p, (int)k);
    for (layer = 0; ok && layer < 2; ++layer) {
        const scene_layer *l = &p->scene.layers[layer];
        for (i = 0; i < pixels; ++i) {
            for (k = 0; k < 3; ++k) {
                rgba[4 * i + k] = l->what[i] == SCENE_SKY ? 0 : l->points[3 * i + k];
                p->normals[3 * i + k] = l->what[i] == SCENE_SKY ? 0 : l->normals[3 * i + k];
            }
            rgba[4 * i + 3] = (float)(l->what[i] < SCENE_FIRST ? 1 : 2 + l->what[i] - SCENE_FIRST);
        }
        ok = pipeline_gl_shadows(p->gl, rgba, p->normals, p->scene.width, p->scene.height, p->light, casters,
                                 p->options.shadows ? SCENE_OBJECTS : 0);
        for (i = 0; ok && i < pixels; ++i) memcpy(p->irradiance[layer] + 3 * i, rgba + 4 * i, 3 * sizeof(float));
    }
    free(rgba);
    return ok;
}
#endif

static inline int pipeline_shadows(pipeline *p)
{
    fiv_irradiance_options fo = fiv_irradiance_defaults();
    PIPELINE_ON_GL(p, pipeline_shadows_gl(p));
    fo.threads = p->options.threads;
    memset(&p->shadow_stats, 0, sizeof p->shadow_stats);
    return pipeline_shadows_on(p, SCENE_GROUND, &fo) && pipeline_shadows_on(p, SCENE_FIRST, &fo) &&
           pipeline_shadows_on(p, SCENE_SECOND, &fo);
}

/* ---- ambient occlusion ---- */

static inline int pipeline_occlusion(pipeline *p)
{
    ssao_sat_input input =
        ssao_sat_input_linear(p->scene.layers[0].depth, p->scene.width, p->scene.height, (double)p->scene.camera.fov_y);
    ssao_sat_options so = ssao_sat_defaults();
    size_t i, pixels = (size_t)p->scene.width * (size_t)p->scene.height;
    if (!p->options.occlusion) {
        for (i = 0; i < pixels; ++i) p->open[i] = 1;
        return 1;
    }
    so.radius = (double)p->options.ao_radius;
    so.threads = p->options.threads;
    input.normals = p->scene.layers[0].view_normals;
    input.sky = PIPELINE_SKY_DISTANCE;
    PIPELINE_ON_GL(p, pipeline_gl_occlusion(p->gl, p->open, &input, &so));
    if (!p->ao && !pipeline_check(p, "ssao_sat_create", ssao_sat_create(&p->ao, p->scene.width, p->scene.height, &so))) return 0;
    return pipeline_check(p, "ssao_sat_apply", ssao_sat_apply(p->ao, p->open, 0, &input, &p->ao_stats));
}

/* ---- colours: matt light from irradiance, glossy light from the environment ---- */

static inline void pipeline_reflect(float out[3], const float d[3], const float n[3])
{
    float c = 2 * scene_dot(d, n);
    int k;
    for (k = 0; k < 3; ++k) out[k] = d[k] - c * n[k];
}

/* Schlick's approximation; `grazing` is what a rough surface keeps of the rise. */
static inline float pipeline_fresnel(float head_on, float cosine, float grazing)
{
    return head_on + (1 - head_on) * grazing * powf(1 - fminf(fmaxf(cosine, 0), 1), 5);
}

static inline void pipeline_object(float rgb[3], const pipeline *p, int object, const float irradiance[3],
                                   const float n[3], const float view[3], float open)
{
    const scene_object *o = &p->scene.objects[object];
    float r[3], coat[3], f;
    int k;
    pipeline_reflect(r, view, n);
    f = pipeline_fresnel(o->shine, -scene_dot(view, n), 0.25f);
    raindrop_environment_sample(coat, p->mirror, r, 0.25f);
    for (k = 0; k < 3; ++k)
        rgb[k] = (1 - f) * o->colour[k] / 3.14159265f * irradiance[k] * open +
                 f * coat[k] * open * scene_step(-0.25f, 0.1f, r[1]);
}

static inline void pipeline_pixel(float rgb[3], const pipeline *p, size_t i, const float ray[3])
{
    const scene_layer *l = p->scene.layers;
    float view[3], colour[3], n[3], r[3], wet, f, haze, mirrored[3];
    const float *point = l->points + 3 * i;
    int k;
    memcpy(view, ray, sizeof view);
    scene_normalise(view);
    if (l->what[i] != SCENE_GROUND) {
        pipeline_object(rgb, p, l->what[i] - SCENE_FIRST, p->irradiance[0] + 3 * i, l->normals + 3 * i, view,
                        p->open[i]);
        return;
    }
    scene_ground(colour, n, point[0], point[2], l->depth[i] * l->depth[i] / (float)p->scene.height);
    wet = scene_wetness(point[0], point[2]);
    for (k = 0; k < 3; ++k) n[k] = k == 1 ? 1 : 0.15f * n[k];
    scene_normalise(n);
    pipeline_reflect(r, view, n);
    r[1] = fabsf(r[1]);
    if (l[1].what[i] != SCENE_SKY) {
        float bounce[3];
        memcpy(bounce, r, sizeof bounce);
        pipeline_object(mirrored, p, l[1].what[i] - SCENE_FIRST, p->irradiance[1] + 3 * i, l[1].normals + 3 * i, bounce,
                        1);
    } else raindrop_environment_sample(mirrored, p->mirror, r, scene_mix(0.5f, 0.02f, wet));
    f = pipeline_fresnel(0.02f, -scene_dot(view, n), scene_mix(0.35f, 1, wet));
    for (k = 0; k < 3; ++k)
        rgb[k] = (1 - f) * colour[k] / 3.14159265f * p->irradiance[0][3 * i + (size_t)k] * p->open[i] +
                 f * mirrored[k] * scene_mix(p->open[i], 1, wet);
    view[1] = 0.035f; /* the distance fades into the horizon */
    raindrop_environment_sample(mirrored, p->mirror, view, 0.04f);
    haze = 1 - expf(-l->depth[i] / 30);
    for (k = 0; k < 3; ++k) rgb[k] = scene_mix(rgb[k], mirrored[k], haze);
}

static inline void pipeline_shade_rows(int begin, int end, int worker, void *context)
{
    pipeline *p = (pipeline *)context;
    int x, y, sx, sy, k, s = p->options.samples;
    (void)worker;
    for (y = begin; y < end; ++y)
        for (x = 0; x < p->options.width; ++x) {
            size_t pixel = (size_t)y * (size_t)p->options.width + (size_t)x;
            float *out = p->dry.pixels + 3 * pixel, sum[3] = {0, 0, 0}, near = INFINITY;
            int covered = 0;
            for (sy = 0; sy < s; ++sy)
                for (sx = 0; sx < s; ++sx) {
                    size_t i = (size_t)(y * s + sy) * (size_t)p->scene.width + (size_t)(x * s + sx);
                    float ray[3], rgb[3];
                    if (p->scene.layers[0].what[i] == SCENE_SKY) continue;
                    near = fminf(near, p->scene.layers[0].depth[i]);
                    scene_ray(&p->scene, x * s + sx, y * s + sy, ray);
                    pipeline_pixel(rgb, p, i, ray);
                    for (k = 0; k < 3; ++k) sum[k] += rgb[k];
                    ++covered;
                }
            for (k = 0; k < 3; ++k) out[k] = (sum[k] + (float)(s * s - covered) * out[k]) / (float)(s * s);
            p->depth[pixel] = near;
        }
}

/* Our own sky is drawn sharper than its picture is. */
static inline void pipeline_sky_rows(int begin, int end, int worker, void *context)
{
    pipeline *p = (pipeline *)context;
    scene_sky sky = scene_sky_of(p->options.hour);
    int x, y, k;
    (void)worker;
    for (y = begin; y < end; ++y)
        for (x = 0; x < p->options.width; ++x) {
            float ray[3], t = tanf(0.5f * p->scene.camera.fov_y), h = (float)p->options.height;
            float u = (2 * (float)x + 1 - (float)p->options.width) / h * t, v = (1 - (2 * (float)y + 1) / h) * t;
            for (k = 0; k < 3; ++k)
                ray[k] = u * p->scene.camera.right[k] + v * p->scene.camera.up[k] - p->scene.camera.back[k];
            scene_normalise(ray);
            if (ray[1] < -0.01f) continue; /* ground */
            ray[1] = fmaxf(ray[1], 0);
            scene_sky_radiance(p->dry.pixels + 3 * ((size_t)y * (size_t)p->options.width + (size_t)x), &sky,
                               p->options.hour, p->options.turn, ray);
        }
}

static inline int pipeline_shade(pipeline *p)
{
    if (!p->options.environment) scene_for(&p->options.threads, p->options.height, pipeline_sky_rows, p);
    else if (!pipeline_check(p, "raindrop_environment_render", raindrop_environment_render(p->dry.pixels, (ptrdiff_t)p->hdr.width * 3 * (ptrdiff_t)sizeof(float),
            p->hdr.width, p->hdr.height, &p->scene.camera, p->mirror, &p->options.threads))) return 0;
    scene_for(&p->options.threads, p->options.height, pipeline_shade_rows, p);
    return 1;
}

/* ---- rain ---- */

/* A photographer's: open for a moment, focused on the drops before the sculptures. */
static inline raindrop_camera pipeline_rain_camera(const pipeline *p)
{
    raindrop_camera camera = p->scene.camera;
    camera.exposure = p->options.shutter;
    camera.aperture = 0.002f;
    camera.focus_distance = 0.4f;
    camera.depth_near = 0.08f;
    return camera;
}

static inline int pipeline_rain(pipeline *p, double dt)
{
    raindrop_camera camera = pipeline_rain_camera(p);
#ifdef PIPELINE_GL
    if (p->options.get_proc) pipeline_gl_picture(p->gl, p->dry.pixels, p->depth, !p->settled);
#endif
    memcpy(p->hdr.pixels, p->dry.pixels, (size_t)p->hdr.width * (size_t)p->hdr.height * 3 * sizeof(float));
    if (!p->options.rain) return 1;
    if (!p->rain) {
        raindrop_rain_options ro = raindrop_rain_defaults();
        ro.rate_mm_h = (double)p->options.rate;
        ro.box_size[0] = ro.box_size[2] = 6, ro.box_size[1] = 4;
        memcpy(ro.centre, camera.position, sizeof ro.centre);
        ro.centre[2] -= 2.8f;
        ro.wind[0] = 1.2f;
        ro.oblate = 1;
        ro.threads = p->options.threads;
        if (!pipeline_check(p, "raindrop_rain_create", raindrop_rain_create(&p->rain, &ro))) return 0;
    }
    PIPELINE_ON_GL(p, pipeline_gl_rain(p->gl, &camera, p->mirror, p->rain, dt));
    return pipeline_check(p, "raindrop_rain_advance", raindrop_rain_advance(p->rain, dt)) &&
           pipeline_check(p, "raindrop_render",
                          raindrop_render(p->hdr.pixels, (ptrdiff_t)p->hdr.width * 3 * (ptrdiff_t)sizeof(float),
                                          p->hdr.width, p->hdr.height, p->depth, &camera, p->rain, p->mirror, NULL,
                                          &p->rain_stats));
}

/* ---- tone ---- */

static inline int pipeline_tone(pipeline *p, double dt)
{
    static const float keys[] = {0.22f, 0.08f, 0.2f};
    tonemap_options to = tonemap_defaults();
    sat_image hdr = image_view(&p->hdr);
    to.operation = p->options.tone ? p->options.operation : TONEMAP_LINEAR;
    to.key = (double)((p->options.key > 0       ? p->options.key
                       : p->options.environment ? 0.18f
                                                : keys[p->options.hour]) *
                      exp2f(p->options.exposure));
    to.mesopic = p->options.tone ? p->options.mesopic : TONEMAP_MESOPIC_OFF;
    to.cd_per_unit = 1;
    to.white = 0;
    to.threads = p->options.threads;
    PIPELINE_ON_GL(p, pipeline_gl_tone(p->gl, p->pixels, &to, dt));
    if (!p->map ? !pipeline_check(p, "tonemap_create", tonemap_create(&p->map, p->hdr.width, p->hdr.height, &to))
                : !pipeline_check(p, "tonemap_set_options", tonemap_set_options(p->map, &to))) return 0;
    return pipeline_check(p, "tonemap_apply_u8", tonemap_apply_u8(p->map, p->pixels, (ptrdiff_t)p->hdr.width * 3, &hdr, dt, &p->tone_stats));
}

/* ---- mosaic: tiles cut out of the picture at random, shrunk, and each used at most once ---- */

enum { PIPELINE_TILE = 16, PIPELINE_TILE_COLUMNS = 96, PIPELINE_FEATURES = 48 };

static inline sat_image pipeline_view_u8(const unsigned char *pixels, int width, int height, int row)
{
    sat_image view = sat_image_f32(NULL, width, height, 3);
    view.pixels = pixels;
    view.stride = (ptrdiff_t)row * 3;
    view.format = SAT_U8;
    return view;
}

/* Tile i shows a square of 2 to 6 tiles' side; odd ones are mirrored. */
static inline void pipeline_cut_tile(unsigned char *sheet, int i, const pipeline *p)
{
    int width = p->options.width, height = p->options.height, most = (width < height ? width : height) / PIPELINE_TILE;
    int n = 2 + (int)(4.999f * scene_hash(i, 1)), x, y, k, u, v, left, top;
    if (n > most) n = most;
    left = (int)(scene_hash(i, 2) * (float)(width - n * PIPELINE_TILE));
    top = (int)(scene_hash(i, 3) * (float)(height - n * PIPELINE_TILE));
    for (y = 0; y < PIPELINE_TILE; ++y)
        for (x = 0; x < PIPELINE_TILE; ++x) {
            size_t row = (size_t)(i / PIPELINE_TILE_COLUMNS * PIPELINE_TILE + y),
                   column = (size_t)(i % PIPELINE_TILE_COLUMNS * PIPELINE_TILE + x);
            int sum[3] = {0, 0, 0}, from = i & 1 ? PIPELINE_TILE - 1 - x : x;
            for (v = 0; v < n; ++v)
                for (u = 0; u < n; ++u)
                    for (k = 0; k < 3; ++k)
                        sum[k] +=
                            p->pixels[3 * ((size_t)(top + y * n + v) * (size_t)width + (size_t)(left + from * n + u)) +
                                      (size_t)k];
            for (k = 0; k < 3; ++k)
                sheet[3 * (row * PIPELINE_TILE * PIPELINE_TILE_COLUMNS + column) + (size_t)k] =
                    (unsigned char)(sum[k] / (n * n));
        }
}

/* The last frame again, into p->mosaic. */
static inline int pipeline_mosaic(pipeline *p)
{
    int columns = p->options.width / PIPELINE_TILE, rows = p->options.height / PIPELINE_TILE, patches = columns * rows,
        i, ok;
    int tile_rows = patches * 3 / 2 / PIPELINE_TILE_COLUMNS + 1, tiles = tile_rows * PIPELINE_TILE_COLUMNS,
        row = columns * PIPELINE_TILE;
    size_t tile_bytes = 3 * PIPELINE_TILE * PIPELINE_TILE;
    unsigned char *sheet = (unsigned char *)malloc((size_t)tiles * tile_bytes);
    float *wanted = (float *)malloc((size_t)patches * PIPELINE_FEATURES * sizeof(float)),
          *offered = (float *)malloc((size_t)tiles * PIPELINE_FEATURES * sizeof(float));
    int *tile_of = (int *)malloc((size_t)patches * sizeof(int));
    sat_image picture = pipeline_view_u8(p->pixels, row, rows * PIPELINE_TILE, p->options.width);
    sat_image tile_view = pipeline_view_u8(sheet, PIPELINE_TILE * PIPELINE_TILE_COLUMNS, PIPELINE_TILE * tile_rows,
                                           PIPELINE_TILE * PIPELINE_TILE_COLUMNS);
    softassign_options so = softassign_defaults();
    softassign_problem problem;
    double start = common_clock();
    memset(&problem, 0, sizeof problem);
    so.threads = p->options.threads;
    problem.rows = patches, problem.columns = tiles, problem.feature_count = PIPELINE_FEATURES;
    problem.row_features = wanted, problem.column_features = offered;
    free(p->mosaic);
    p->mosaic = (unsigned char *)malloc((size_t)patches * tile_bytes);
    ok = sheet && wanted && offered && tile_of && p->mosaic;
    if (!ok) snprintf(p->message, sizeof p->message, "not enough memory for %d tiles", tiles);
    for (i = 0; ok && i < tiles; ++i) pipeline_cut_tile(sheet, i, p);
    ok = ok && pipeline_check(p, "softassign_features", softassign_features(wanted, &picture, columns, rows, 4, 4, &so)) &&
         pipeline_check(p, "softassign_features", softassign_features(offered, &tile_view, PIPELINE_TILE_COLUMNS, tile_rows, 4, 4, &so)) &&
         pipeline_check(p, "softassign_solve", softassign_solve(tile_of, &problem, &so, &p->mosaic_report)) &&
         pipeline_check(p, "softassign_mosaic", softassign_mosaic(p->mosaic, (ptrdiff_t)row * 3, &tile_view, PIPELINE_TILE, PIPELINE_TILE, tile_of,
                                                                  columns, rows, &picture, 0.25f));
    p->mosaic_patches = patches, p->mosaic_tiles = tiles;
    p->mosaic_width = row, p->mosaic_height = rows * PIPELINE_TILE;
    p->mosaic_seconds = common_clock() - start;
    free(sheet), free(wanted), free(offered), free(tile_of);
    return ok;
}

/* ---- all of it ---- */

static inline int pipeline_create(pipeline *p, const pipeline_options *options)
{
    static const float eye[3] = {0.1f, 0.5f, 1.4f}, target[3] = {0.05f, 0.235f, 0}, up[3] = {0, 1, 0};
    int w = options->width * options->samples, h = options->height * options->samples, i, ok;
    size_t pixels;
    memset(p, 0, sizeof *p);
    p->options = *options;
    if (options->width < 16 || options->height < 16 || options->samples < 1 || options->samples > 4 ||
        options->width > 8192 || options->height > 8192) {
        snprintf(p->message, sizeof p->message, "%d x %d pixels: from 16 x 16 to 8192 x 8192 are drawn", options->width,
                 options->height);
        return 0;
    }
    pixels = (size_t)w * (size_t)h;
    ok = scene_create(&p->scene, w, h) && image_create(&p->hdr, options->width, options->height, 3) &&
         image_create(&p->dry, options->width, options->height, 3);
    ok = ok && image_create(&p->sky, 1024, 512, 3);
    p->depth = (float *)malloc((size_t)options->width * (size_t)options->height * sizeof(float));
    p->pixels = (unsigned char *)malloc((size_t)options->width * (size_t)options->height * 3);
    for (i = 0; i < 2; ++i) p->irradiance[i] = (float *)malloc(3 * pixels * sizeof(float));
    p->open = (float *)malloc(pixels * sizeof(float));
    p->points = (float *)malloc(3 * pixels * sizeof(float));
    p->normals = (float *)malloc(3 * pixels * sizeof(float));
    p->found = (float *)malloc(3 * pixels * sizeof(float));
    p->where = (unsigned *)malloc(pixels * sizeof(unsigned));
    ok = ok && p->depth && p->pixels && p->irradiance[0] && p->irradiance[1] && p->open && p->points && p->normals &&
         p->found && p->where;
    ok = ok && (options->shape ? scene_use_mesh(&p->scene.objects[0], options->shape)
                               : scene_make_knot(&p->scene.objects[0], 120, 20));
    ok = ok && scene_make_pawn(&p->scene.objects[1], 40, 3);
    if (!ok) {
        snprintf(p->message, sizeof p->message, "not enough memory for %d x %d pixels", w, h);
        return 0;
    }
    scene_place(&p->scene.objects[0], -0.17f, -0.05f, 0.24f, 0.62f, 0.3f, 0.16f, 0.04f);
    scene_place(&p->scene.objects[1], 0.3f, 0.06f, 0.23f, 0.66f, 0.64f, 0.58f, 0.04f);
    p->scene.camera = raindrop_camera_look(eye, target, up, 0.62f);
    return pipeline_gl_ready(p) && pipeline_masks(p) && pipeline_light(p);
}

/* Other options from the next frame on, all but size, samples, shape and threads: makes anew what they concern. */
static inline int pipeline_change(pipeline *p, const pipeline_options *options)
{
    pipeline_options old = p->options;
    p->options = *options;
    if (!pipeline_gl_ready(p) || !pipeline_masks(p)) return 0;
    if (old.get_proc != options->get_proc) p->settled = 0;
    if (old.get_proc != options->get_proc || old.rate != options->rate) PIPELINE_GL_FORGET(p);
    if (old.rate != options->rate) raindrop_rain_destroy(p->rain), p->rain = NULL;
    if (old.ao_radius != options->ao_radius) ssao_sat_destroy(p->ao), p->ao = NULL;
    if (old.ao_radius != options->ao_radius || old.shadows != options->shadows || old.occlusion != options->occlusion)
        p->settled = 0;
    if (options->environment == old.environment &&
        (options->environment || (old.hour == options->hour && old.turn == options->turn)))
        return 1;
    p->settled = 0;
    return pipeline_light(p);
}

/* Every stage in order. While light and options stay, what they made stays too: then only rain and tone are new. */
static inline int pipeline_frame(pipeline *p, double dt)
{
    double t = common_clock(), now;
    int stage, ok = 1;
    for (stage = PIPELINE_SCENE; ok && stage < PIPELINE_STAGES; ++stage, t = now) {
        switch (stage) {
        case PIPELINE_RAIN: ok = pipeline_rain(p, dt); break;
        case PIPELINE_TONE: ok = pipeline_tone(p, dt); break;
        default:
            if (p->settled) break;
            if (stage == PIPELINE_SCENE) scene_draw(&p->scene, &p->options.threads);
            else if (stage == PIPELINE_SHADOWS) ok = pipeline_shadows(p);
            else if (stage == PIPELINE_OCCLUSION) ok = pipeline_occlusion(p);
            else ok = pipeline_shade(p);
        }
        now = common_clock();
        p->seconds[stage] = now - t;
    }
    p->settled = ok;
    return ok;
}

/* What the last frame had before tone mapping: p->hdr, which OpenGL keeps to itself. */
static inline image *pipeline_hdr(pipeline *p)
{
#ifdef PIPELINE_GL
    if (p->options.get_proc) pipeline_gl_read(p->gl, p->hdr.pixels);
#endif
    return &p->hdr;
}

static inline void pipeline_destroy(pipeline *p)
{
    int i;
#ifdef PIPELINE_GL
    pipeline_gl_destroy(p->gl);
#endif
    for (i = 0; i < SCENE_OBJECTS; ++i) fiv_occluder_destroy(p->occluders[i]);
    fiv_environment_destroy(p->light);
    raindrop_environment_destroy(p->mirror);
    raindrop_rain_destroy(p->rain);
    ssao_sat_destroy(p->ao);
    tonemap_destroy(p->map);
    scene_free(&p->scene);
    image_free(&p->sky), image_free(&p->dry), image_free(&p->hdr);
    free(p->depth), free(p->pixels), free(p->mosaic), free(p->irradiance[0]), free(p->irradiance[1]), free(p->open);
    free(p->points), free(p->normals), free(p->found), free(p->where);
    memset(p, 0, sizeof *p);
}

#endif /* PIPELINE_H */
