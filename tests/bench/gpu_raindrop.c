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
#include "gpu.h"
#include "image.h"
#include "reference_raindrop.h"

static gl_context context;
static sat__gl gpu;
static gpu_clock timer;
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
    ok = ok && succeeded(reference_map(&the.map, 1024, 32, RAINDROP_WATER), "map");
    the.camera = raindrop_camera_defaults();
    the.camera.depth_near = 0.005f;
    sat__gl_begin(&gpu, &state, 1);
    ok = ok && succeeded(sat__gl_texture(&gpu, &the.texture, SAT__GL_RGBA16F, size, size, NULL), gpu.message);
    ok = ok && succeeded(sat__gl_framebuffer(&gpu, &the.framebuffer, &the.texture, 1, 0), gpu.message);
    sat__gl_end(&gpu, &state);
    o.operation = TONEMAP_PHOTOGRAPHIC_GLOBAL;
    return ok &&
           succeeded(tonemap_gl_create(&the.tone, context.get_proc, size, size, &o), tonemap_gl_message(the.tone));
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

static void draw(raindrop_gl *g, const raindrop_render_options *o)
{
    static const float grey[4] = {0.2f, 0.25f, 0.3f, 1};
    gpu.BindFramebuffer(SAT__GL_FRAMEBUFFER, the.framebuffer);
    gpu.ClearBufferfv(SAT__GL_COLOR, 0, grey);
    raindrop_gl_render(g, NULL, size, size, &the.camera, NULL, o);
}

static void frame(raindrop_gl *g, const raindrop_render_options *o, int tone)
{
    raindrop_gl_advance(g, 1 / 60.0);
    draw(g, o);
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
    timer.finish();
    start = support_clock();
    frame(g, &o, tone);
    timer.finish();
    start = support_clock() - start;
    if (!software && start < 0.02) frames = 1 + (int)(0.02 / (start + 1e-6));
    for (i = 0; i < runs; i++) {
        start = support_clock();
        for (k = 0; k < frames; k++) frame(g, &o, tone);
        timer.finish();
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
    bench_plot("Frames per second on the GPU; x=drops; y=map_fps; by=primitive; log=xy; style=linespoints");
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
            if (!succeeded(raindrop_gl_create(&g, context.get_proc, &o), raindrop_gl_message(g)) ||
                !succeeded(raindrop_gl_set_environment(g, the.environment), raindrop_gl_message(g)) ||
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

/* What a picture may ask for beside still, sharp spheres without internal reflections. */
enum { PLAIN, SHUTTER, LENS, FLAT, ORDERS, SWINGING, LAMP, KINDS };
static const char *const kind_names[KINDS] = {"plain", "shutter", "lens", "flattened", "orders", "oscillation", "lamp"};

static raindrop_render_options set_kind(raindrop_gl *g, raindrop_rain *rain, int kind)
{
    static raindrop_lamp lamp;
    raindrop_render_options o = raindrop_render_defaults();
    int n = 0, i;
    const raindrop_drop *drops = raindrop_rain_drops(&n, rain);
    raindrop_drop *flat = (raindrop_drop *)calloc((size_t)n, sizeof *flat);
    for (i = 0; i < n; i++) flat[i] = drops[i], flat[i].axis_ratio = kind == FLAT ? 0.8f : 1;
    raindrop_rain_set_drops(rain, flat, n);
    raindrop_gl_set_rain(g, rain);
    free(flat);
    the.camera.exposure = kind == SHUTTER ? 0.001f : 0;
    the.camera.aperture = kind == LENS ? 0.002f : 0;
    the.camera.focus_distance = 0.5f;
    o.orders = kind == ORDERS;
    o.oscillation = kind == SWINGING ? 0.1f : 0;
    lamp = raindrop_lamp_defaults();
    lamp.position[1] = 3;
    lamp.position[2] = -2;
    o.lamps = &lamp;
    o.lamp_count = kind == LAMP;
    return o;
}

/* Time over that of the plain picture: median of paired measurements. */
static double time_of(raindrop_gl *g, raindrop_rain *rain, int kind, raindrop_look look)
{
    double ratio[9], seconds[2];
    int i, k, m, frames = software ? 2 : 50;
    for (i = -1; i < 9; i++) { /* the first warms up */
        for (m = 0; m < 2; m++) {
            raindrop_render_options o = set_kind(g, rain, m ? kind : PLAIN);
            o.look = look;
            timer.finish();
            seconds[m] = support_clock();
            for (k = 0; k < frames; k++) draw(g, &o);
            timer.finish();
            seconds[m] = support_clock() - seconds[m];
        }
        if (i >= 0) ratio[i] = seconds[1] / seconds[0];
    }
    return support_median(ratio, 9);
}

/* How far the GPU's picture is from the CPU's, drops in the order of the array. */
static double error_of(raindrop_gl *g, raindrop_rain *rain, int kind, raindrop_look look, float *cpu, float *got)
{
    size_t pixels = (size_t)size * (size_t)size, k;
    raindrop_render_options o = set_kind(g, rain, kind);
    sat__gl_state state;
    static const float grey[3] = {0.2f, 0.25f, 0.3f};
    o.look = look;
    o.map = the.map;
    o.sort = 0;
    o.orders_radius = kind == ORDERS ? 8 : 1e9f;
    draw(g, &o);
    sat__gl_begin(&gpu, &state, 1);
    succeeded(sat__gl_read(&gpu, got, the.texture, SAT__GL_RGBA16F, size, size), gpu.message);
    sat__gl_end(&gpu, &state);
    for (k = 0; k < pixels; k++) memmove(got + 3 * k, got + 4 * k, 12);
    for (k = 0; k < pixels; k++) memcpy(cpu + 3 * k, grey, 12);
    /* bottom row first, as the GPU has it */
    raindrop_render(cpu + 3 * (size_t)(size - 1) * (size_t)size, -12 * (ptrdiff_t)size, size, size, NULL, &the.camera,
                    rain, the.environment, &o, NULL);
    return reference_rmse(got, cpu, NULL, pixels, 1);
}

static void kinds_of_pictures(void)
{
    static const char *const looks[4] = {"map", "sprite", "ray", "auto"};
    size_t pixels = (size_t)size * (size_t)size;
    float *cpu = (float *)malloc(pixels * 12), *got = (float *)malloc(pixels * 16);
    raindrop_rain *rain = published(software ? 50000 : 500000);
    raindrop_gl_options o = raindrop_gl_defaults();
    raindrop_gl *g = NULL;
    int look, kind;
    bench_table("The GPU's picture against the CPU's, and what it costs: quads", "look\tpicture\trmse\ttime_ratio");
    bench_note("rmse: from the CPU's, unsorted, tone-mapped luminance; time_ratio: over the plain picture, without animation");
    o.map = the.map;
    o.quads = 1;
    o.lamps = o.oscillation = 1;
    if (!succeeded(raindrop_gl_create(&g, context.get_proc, &o), raindrop_gl_message(g))) exit(1);
    raindrop_gl_set_environment(g, the.environment);
    for (look = 0; look < 4; look++)
        for (kind = 0; kind < (look < RAINDROP_LOOK_RAY ? 1 : KINDS); kind++)
            bench_row("%s\t%s\t%.5f\t%.2f", looks[look], kind_names[kind], error_of(g, rain, kind, (raindrop_look)look, cpu, got),
                      time_of(g, rain, kind, (raindrop_look)look));
    raindrop_gl_destroy(g);
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
    timer = gpu_clock_of(&context);
    software = gpu_is_software(&context);
    size = software || bench_quick() ? 512 : 1024;
    if (!succeeded(sat__gl_open(&gpu, context.get_proc), gpu.message) || !open_scene()) return 1;
    table_2_2();
    kinds_of_pictures();
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
