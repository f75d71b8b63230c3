/* Rain on the GPU: the frame rates of Slomp 2012, table 2.2, in its shape, animation included, with and without tone
   mapping; and the error of each look. LIGHTSCAN_GL=egl for the GPU, OSMesa otherwise (then smaller). */

#define SAT_IMPLEMENTATION
#define RAINDROP_IMPLEMENTATION
#define RAINDROP_GL
#define TONEMAP_IMPLEMENTATION
#define TONEMAP_GL
#include "raindrop.h"
#include "tonemap.h"
#include "bench.h"
#include "gl_context.h"
#include "image.h"
#include "reference_raindrop.h"

static gl_context context;
static sat__gl gpu;
static int software, size;

static struct {
    unsigned texture, framebuffer;
    raindrop_environment *environment;
    raindrop_map *map;
    raindrop_camera camera;
    tonemap_gl *tone;
} the;

static int succeeded(sat_result result, const char *message)
{
    if (result != SAT_OK) printf("# %s: %s\n", sat_result_text(result), message);
    return result == SAT_OK;
}

static int open_scene(void)
{
    static image picture;
    const char *path = support_data("env/forest.exr");
    tonemap_options o = tonemap_defaults();
    sat__gl_state state;
    sat_image view;
    float *sky = NULL;
    int ok;
    if (path && image_load(&picture, path)) view = image_view(&picture);
    else {
        sky = (float *)malloc(sizeof(float) * 3 * 1024 * 512);
        reference_sky(sky, 1024, 512);
        view = sat_image_f32(sky, 1024, 512, 3);
    }
    ok = succeeded(raindrop_environment_create(&the.environment, &view, NULL, NULL), "environment");
    free(sky);
    ok = ok && succeeded(raindrop_map_create(&the.map, 1024, 32, RAINDROP_WATER, NULL), "map");
    the.camera = raindrop_camera_defaults();
    the.camera.near_distance = 0.005f;
    sat__gl_begin(&gpu, &state, 1);
    ok = ok && succeeded(sat__gl_texture(&gpu, &the.texture, SAT__GL_RGBA16F, size, size, NULL), gpu.message);
    ok = ok && succeeded(sat__gl_framebuffer(&gpu, &the.framebuffer, &the.texture, 1, 0), gpu.message);
    sat__gl_end(&gpu, &state);
    o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL;
    return ok && succeeded(tonemap_gl_create(&the.tone, context.get_proc, size, size, &o), tonemap_gl_message(the.tone));
}

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

static void frame(raindrop_gl *g, const raindrop_render_options *o, int tone)
{
    static const float grey[4] = {0.2f, 0.25f, 0.3f, 1};
    raindrop_gl_advance(g, 1 / 60.0);
    gpu.BindFramebuffer(SAT__GL_FRAMEBUFFER, the.framebuffer);
    gpu.ClearBufferfv(SAT__GL_COLOR, 0, grey);
    raindrop_gl_render(g, size, size, &the.camera, o, 0, 0);
    if (tone) tonemap_gl_apply(the.tone, 0, the.texture, 1 / 60.0);
}

/* Frames a second: median of several measurements of a run of frames each. */
static double frames_per_second(raindrop_gl *g, raindrop_look look, int tone)
{
    raindrop_render_options o = raindrop_render_defaults();
    double t[7], start;
    int i, k, frames = 1, runs = software ? 2 : 7;
    o.look = look;
    o.map = the.map;
    frame(g, &o, tone);
    gpu.Finish();
    start = support_clock();
    frame(g, &o, tone);
    gpu.Finish();
    start = support_clock() - start;
    if (!software && start < 0.02) frames = 1 + (int)(0.02 / (start + 1e-6));
    for (i = 0; i < runs; i++) {
        start = support_clock();
        for (k = 0; k < frames; k++) frame(g, &o, tone);
        gpu.Finish();
        t[i] = (support_clock() - start) / frames;
    }
    return 1 / support_median(t, runs);
}

static void table_2_2(void)
{
    static const int counts[6] = {125000, 250000, 500000, 1000000, 2000000, 4000000};
    static const int thesis[6][2] = {{595, 794}, {430, 540}, {250, 295}, {140, 157}, {74, 83}, {43, 46}};
    int i, quads, last = software || bench_quick() ? 2 : 6;
    bench_table("Rain on the GPU, frames per second by number of drops (Slomp 2012, table 2.2), animation included",
                "drops\tprimitive\tmap_fps_t\tmap_fps\tsprite_fps_t\tsprite_fps\tray_fps_t\tray_fps\tauto_fps_t\tauto_fps\tgtx280_fps_t\tgtx280_fps");
    bench_plot("Frames per second on the GPU; x=drops; y=map_fps; by=primitive; log=xy; style=lines");
    bench_note("-t: with the global photographic operator; the map's rows are the published method, on half floats");
    for (quads = 0; quads < 2; quads++) {
        for (i = 0; i < last; i++) {
            raindrop_gl_options o = raindrop_gl_defaults();
            raindrop_rain *rain = published(counts[i]);
            raindrop_gl *g = NULL;
            double fps[4][2];
            int look, tone;
            o.map = the.map;
            o.quads = quads;
            if (!succeeded(raindrop_gl_create(&g, context.get_proc, &o), raindrop_gl_message(g)) || !succeeded(raindrop_gl_set_environment(g, the.environment), raindrop_gl_message(g)) ||
                !succeeded(raindrop_gl_set_rain(g, rain), raindrop_gl_message(g)))
                exit(1);
            for (look = 0; look < 4; look++)
                for (tone = 0; tone < 2; tone++) fps[look][tone] = frames_per_second(g, (raindrop_look)look, tone);
            bench_row("%d\t%s\t%.1f\t%.1f\t%.1f\t%.1f\t%.1f\t%.1f\t%.1f\t%.1f\t%d\t%d", counts[i], quads ? "quads" : "points", fps[0][1], fps[0][0], fps[1][1], fps[1][0],
                      fps[2][1], fps[2][0], fps[3][1], fps[3][0], thesis[i][0], thesis[i][1]);
            raindrop_gl_destroy(g);
            raindrop_rain_destroy(rain);
        }
    }
}

/* The same pictures on both sides: how far the GPU's is from the CPU's. */
static void gpu_against_cpu(void)
{
    static const char *const names[4] = {"map", "sprite", "ray", "auto"};
    size_t pixels = (size_t)size * (size_t)size, k;
    float *cpu = (float *)malloc(pixels * 12), *got = (float *)malloc(pixels * 16);
    raindrop_rain *rain = published(software ? 50000 : 500000);
    int look, y, c;
    bench_table("The GPU's picture against the CPU's, unsorted, tone-mapped luminance", "look\tprimitive\trmse");
    for (look = 0; look < 4; look++) {
        raindrop_gl_options go = raindrop_gl_defaults();
        raindrop_render_options o = raindrop_render_defaults();
        raindrop_gl *g = NULL;
        sat__gl_state state;
        static const float grey[4] = {0.2f, 0.25f, 0.3f, 1};
        go.map = the.map;
        o.look = (raindrop_look)look;
        o.map = the.map;
        o.sort = 0;
        o.orders_radius = 1e9f;
        go.quads = 1;
        if (!succeeded(raindrop_gl_create(&g, context.get_proc, &go), raindrop_gl_message(g))) exit(1);
        raindrop_gl_set_environment(g, the.environment);
        raindrop_gl_set_rain(g, rain);
        gpu.BindFramebuffer(SAT__GL_FRAMEBUFFER, the.framebuffer);
        gpu.ClearBufferfv(SAT__GL_COLOR, 0, grey);
        raindrop_gl_render(g, size, size, &the.camera, &o, 0, 0);
        sat__gl_begin(&gpu, &state, 1);
        succeeded(sat__gl_read(&gpu, got, the.texture, SAT__GL_RGBA16F, size, size), gpu.message);
        sat__gl_end(&gpu, &state);
        for (k = 0; k < pixels; k++) memmove(got + 3 * k, got + 4 * k, 12);
        for (k = 0; k < pixels; k++)
            for (c = 0; c < 3; c++) cpu[3 * k + (size_t)c] = grey[c];
        y = size - 1; /* bottom row first, as the GPU has it */
        raindrop_render(cpu + 3 * (size_t)y * (size_t)size, -12 * (ptrdiff_t)size, size, size, NULL, &the.camera, rain, the.environment, &o, NULL);
        bench_row("%s\tquads\t%.5f", names[look], reference_rmse(got, cpu, NULL, pixels, 1));
        raindrop_gl_destroy(g);
    }
    raindrop_rain_destroy(rain);
    free(cpu);
    free(got);
}

int main(void)
{
    bench_start("raindrop.h on the GPU");
    if (!gl_context_open(&context, 3, 3)) {
        printf("# note: left out: %s\n", context.message);
        return 0;
    }
    printf("# machine: %s\n", gl_context_renderer(&context));
    software = strstr(gl_context_renderer(&context), "llvmpipe") || strstr(gl_context_renderer(&context), "softpipe");
    size = software || bench_quick() ? 512 : 1024;
    if (!succeeded(sat__gl_open(&gpu, context.get_proc), gpu.message) || !open_scene()) return 1;
    table_2_2();
    gpu_against_cpu();
    tonemap_gl_destroy(the.tone);
    raindrop_map_destroy(the.map);
    raindrop_environment_destroy(the.environment);
    gpu.BindFramebuffer(SAT__GL_FRAMEBUFFER, 0);
    gpu.DeleteFramebuffers(1, &the.framebuffer);
    gpu.DeleteTextures(1, &the.texture);
    sat__gl_close(&gpu);
    gl_context_close(&context);
    return 0;
}
