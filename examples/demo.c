/* demo - a square in the rain, through all six headers.             SPDX-License-Identifier: MIT-0 OR Unlicense

       demo                                           dusk, out/demo.png
       demo --hour night --rate 20mm --out night.png
       demo forest.exr bunny.ply                      other light, another sculpture
       demo --no-shadows --no-occlusion               each stage can be left out
       demo --mosaic                                  the picture again, from tiles cut out of it, each used once:
                                                      out/demo_mosaic.png
       demo --frames 60 --out rain.png                rain_0000.png and so on, 30 a second

   A .png is tone-mapped; .exr, .hdr and .pfm hold what comes before that. */

#define _POSIX_C_SOURCE 200809L
#define LIGHTSCAN_IMPLEMENTATION
#define PIPELINE_GL
#define FIV_GL
#define RAINDROP_GL
#define SSAO_SAT_GL
#define TONEMAP_GL
#include "gl_context.h"
#include "pipeline.h"
#include "reference.h"

/* ---- the table ---- */

static const char *percent(char *text, size_t size, double value, const char *what)
{
    if (value < 0) snprintf(text, size, "-");
    else snprintf(text, size, "%.2f %% %s", 100 * value, what);
    return text;
}

static void print_row(const char *stage, double seconds, const char *error, const char *rest)
{
    printf("%-10s %9.1f  %-28s %s\n", stage, 1e3 * seconds, error, rest);
}

/* Times, errors against the slow way, and what was left out. */
static void print_table(const pipeline *p, const gl_context *context)
{
    const fiv_irradiance_stats *f = &p->shadow_stats;
    const ssao_sat_stats *a = &p->ao_stats;
    const raindrop_render_stats *r = &p->rain_stats;
    const tonemap_stats *t = &p->tone_stats;
    double pairs = (double)(f->below_horizon + f->below_cutoff + f->whole + f->clipped), drops = (double)r->drops;
    const char *gpu = gl_context_renderer(context);
    char error[80], rest[240];
    printf("%-10s %9s  %-28s %s\n", "stage", "ms", "error (reference)", "what was left out");
    snprintf(rest, sizeof rest, "%d lights split off with %.0f %% of the light", p->light_stats.lights, 100 * (double)p->light_stats.light_share);
    print_row("light", p->seconds[PIPELINE_LIGHT], "-", rest);
    snprintf(rest, sizeof rest, "%zu + %zu masks in %.1f MB, once for a shape", p->mask_stats[0].rasterised,
             p->mask_stats[1].rasterised, 1e-6 * (double)(p->mask_stats[0].bytes + p->mask_stats[1].bytes));
    print_row("masks", p->seconds[PIPELINE_MASKS], "-", rest);
    print_row("scene", p->seconds[PIPELINE_SCENE], "-", "");
    if (p->options.shadows && p->gl)
        print_row("shadows", p->seconds[PIPELINE_SHADOWS], percent(error, sizeof error, reference_shadow_error(p, 24), "rms (ray casting)"), gpu);
    else if (p->options.shadows) {
        snprintf(rest, sizeof rest, "occluders below the horizon %.0f %%, too small %.0f %% of %.3g pairs",
                 100 * (double)f->below_horizon / pairs, 100 * (double)f->below_cutoff / pairs, pairs);
        print_row("shadows", p->seconds[PIPELINE_SHADOWS], percent(error, sizeof error, reference_shadow_error(p, 24), "rms (ray casting)"), rest);
    }
    if (p->options.occlusion && p->gl)
        print_row("occlusion", p->seconds[PIPELINE_OCCLUSION], percent(error, sizeof error, reference_occlusion_error(p), "rms (CPU, all pixels)"), gpu);
    else if (p->options.occlusion) {
        snprintf(rest, sizeof rest, "sky %.0f %%, flat %.0f %%, too small %.0f %% of %zu pixels",
                 100 * (double)a->sky / (double)a->pixels, 100 * (double)a->flat / (double)a->pixels,
                 100 * (double)a->tiny / (double)a->pixels, a->pixels);
        print_row("occlusion", p->seconds[PIPELINE_OCCLUSION], percent(error, sizeof error, reference_occlusion_error(p), "rms (all pixels)"), rest);
    }
    print_row("shade", p->seconds[PIPELINE_SHADE], "-", "");
    if (p->options.rain && p->gl) print_row("rain", p->seconds[PIPELINE_RAIN], "-", gpu);
    else if (p->options.rain) {
        snprintf(rest, sizeof rest, "outside %.0f %%, hidden %.0f %%, too small %.0f %% of %.0f drops; %zu as one lookup, %zu as rays",
                 100 * (double)(r->outside + r->behind + r->near_plane) / drops, 100 * (double)r->hidden / drops,
                 100 * (double)r->below_threshold / drops, drops, r->drawn_far, r->drawn_near);
        print_row("rain", p->seconds[PIPELINE_RAIN], percent(error, sizeof error, reference_rain_error(p), "rms (all rays)"), rest);
    }
    if (p->gl) {
        print_row("tone", p->seconds[PIPELINE_TONE], "-", gpu);
        return;
    }
    snprintf(rest, sizeof rest, "%.1f decades; key %.3g; %.1f %% clipped; neighbourhoods searched %zu, skipped %zu",
             t->low > 0 ? log10(t->high / t->low) : 0.0, t->key,
             100 * (double)t->clamped / (double)(p->hdr.width * p->hdr.height), t->searched, t->skipped);
    print_row("tone", p->seconds[PIPELINE_TONE], "0 (exact search)", rest);
}

static int save_mosaic(pipeline *p, const common_settings *common, const char *path)
{
    const softassign_stats *r = &p->mosaic_report;
    char error[80], rest[200];
    if (!pipeline_mosaic(p)) return common_say(common, p->message);
    snprintf(rest, sizeof rest, "%d tiles of %d, none twice; of the distances %.0f %% never computed", p->mosaic_patches, p->mosaic_tiles,
             fmax(0, 100 - 100 * (double)r->distances_computed / ((double)p->mosaic_patches * p->mosaic_tiles)));
    print_row("mosaic", p->mosaic_seconds, percent(error, sizeof error, r->gap, "of the cost, at most"), rest);
    return common_save_u8(common, path, p->mosaic, p->mosaic_width, p->mosaic_height, 3);
}

/* ---- command line ---- */

static int save(pipeline *p, const common_settings *common, const char *path)
{
    if (image_ends_with(path, ".png")) return common_save_u8(common, path, p->pixels, p->options.width, p->options.height, 3);
    return common_save(common, path, pipeline_hdr(p));
}

static int run(pipeline *p, const gl_context *context, int frames, const common_settings *common, int mosaic)
{
    double sum[PIPELINE_STAGES] = {0};
    common_progress progress = {0, 0};
    char path[FILE_PATH], number[16];
    int i, k;
    for (i = 0; i < frames; ++i) {
        if (!pipeline_frame(p, i ? 1 / 30.0 : 0)) return common_say(common, p->message);
        for (k = PIPELINE_SCENE; k < PIPELINE_STAGES; ++k) sum[k] += p->seconds[k];
        snprintf(number, sizeof number, "_%04d", i);
        if (!common_path(common, path, common->out, frames > 1 ? number : "") || !save(p, common, path)) return 0;
        common_show_progress(&progress, "frames", i + 1, frames);
    }
    for (k = PIPELINE_SCENE; k < PIPELINE_STAGES; ++k) p->seconds[k] = sum[k] / frames;
    if (common->stats) print_table(p, context);
    if (!mosaic || !common_path(common, path, common->out, "_mosaic")) return !mosaic;
    if (!image_ends_with(path, ".png")) strcpy(strrchr(path, '.'), ".png"); /* all endings have four characters */
    return save_mosaic(p, common, path);
}

int main(int argc, char **argv)
{
    const char *env = NULL, *shape = NULL;
    int hour = 0, operation = TONEMAP_GUIDED, mesopic, size[2] = {1280, 720}, frames = 1, gl = 0, mosaic = 0,
        no_shadows = 0, no_occlusion = 0, no_rain = 0, no_tone = 0, ok;
    pipeline_options o = pipeline_defaults();
    const common_option options[] = {
        {"env", 'P', (void *)&env, 0, 0, "equirectangular picture of the light; without it a sky of our own"},
        {"mesh", 'M', (void *)&shape, 0, 0, "instead of the knot"},
        {"size", 'z', size, 16, 8192, "of the picture"},
        {"rate", 'm', &o.rate, 0, 500, "rain in mm an hour"},
        {"hour", 'w', &hour, 0, 0, "dusk|night|noon"},
        {"turn", 'f', &o.turn, -36000, 36000, "degrees by which the light is turned"},
        {"ao-radius", 'f', &o.ao_radius, 0, 100, "reach of ambient occlusion in metres"},
        {"shutter", 'f', &o.shutter, 0, 10, "seconds for which the drops move"},
        {"operator", 'w', &operation, 0, 0, "local|global|ashikhmin|ashikhmin-global|linear|guided"},
        {"key", 'f', &o.key, 0, 10, "display value of the log-average; 0: one for the hour"},
        {"exposure", 'f', &o.exposure, -100, 100, "stops more light"},
        {"mesopic", 'w', &mesopic, 0, 0, "off|uniform|local reds fade in dim light"},
        {"samples", 'i', &o.samples, 1, 4, "points a pixel each way"},
        {"frames", 'i', &frames, 1, 9999, "pictures, 1/30 s apart"},
        {"gl", 'b', &gl, 0, 0, "on OpenGL (OSMesa; LIGHTSCAN_GL=egl: the GPU)"},
        {"mosaic", 'b', &mosaic, 0, 0, "the picture again, from tiles"},
        {"no-shadows", 'b', &no_shadows, 0, 0, "leave fiv.h out"},
        {"no-occlusion", 'b', &no_occlusion, 0, 0, "leave ssao_sat.h out"},
        {"no-rain", 'b', &no_rain, 0, 0, "leave raindrop.h out"},
        {"no-tone", 'b', &no_tone, 0, 0, "leave tonemap.h out but for the exposure"},
    };
    common_settings common;
    image light;
    mesh sculpture;
    gl_context context;
    pipeline p;
    mesopic = o.mesopic;
    common_parse(&common, argc, argv, "demo", ".png .exr .hdr .pfm", options,
                 (int)(sizeof options / sizeof options[0]));
    o.hour = (scene_hour)hour;
    o.operation = (tonemap_operator)operation;
    o.mesopic = (tonemap_mesopic)mesopic;
    o.width = size[0], o.height = size[1];
    o.shadows = !no_shadows, o.occlusion = !no_occlusion, o.rain = !no_rain && o.rate > 0, o.tone = !no_tone;
    o.threads = common.threads;
    memset(&light, 0, sizeof light);
    memset(&sculpture, 0, sizeof sculpture);
    if (env && !image_load(&light, env)) return common_say(&common, light.message), 1;
    if (shape && !mesh_load(&sculpture, shape)) return common_say(&common, sculpture.message), 1;
    o.environment = env ? &light : NULL;
    o.shape = shape ? &sculpture : NULL;
    if (gl && !gl_context_open(&context, 3, 3)) {
        fprintf(stderr, "demo: --gl: %s\n", context.message);
        return 1;
    }
    if (gl) o.get_proc = context.get_proc;
    ok = pipeline_create(&p, &o) || common_say(&common, p.message);
    ok = ok && run(&p, &context, frames, &common, mosaic);
    pipeline_destroy(&p);
    if (gl) gl_context_close(&context);
    image_free(&light);
    mesh_free(&sculpture);
    common_close(&common);
    return !ok;
}
