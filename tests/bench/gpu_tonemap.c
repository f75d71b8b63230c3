/* Slomp 2012, table A.1, on a GPU: the passes of tonemap.h by size, and its frame rates (Michael 2010, tables 9 to
   13). */

#define SAT_IMPLEMENTATION
#define TONEMAP_IMPLEMENTATION
#define TONEMAP_GL
#include "tonemap.h"
#include "bench.h"
#include "gpu.h"

static gpu_clock timer;

typedef struct frame { tonemap_gl *map; unsigned hdr; } frame;

static void fill(float *pixels, int width, int height)
{
    uint64_t seed = 3;
    int x, y, c;
    for (y = 0; y < height; ++y)
        for (x = 0; x < width; ++x) {
            float *q = pixels + 4 * ((size_t)y * (size_t)width + (size_t)x);
            double u = (double)x / width, v = (double)y / height, light = 0.05 + 0.4 * u;
            if (u > 0.6 && v < 0.5) light = 40 + 30 * sin(12 * v);
            if (u < 0.3 && v > 0.6) light = 0.01 * (1 + (x / 3 + y / 3) % 2 * 2);
            light *= 1 + 0.04 * (support_uniform(&seed) - 0.5);
            for (c = 0; c < 3; ++c) q[c] = (float)(light * (1 + 0.6 * sin(5 * u + 2 * c + 3 * v)));
            q[3] = 1;
        }
}

/* Seconds of one call, by waiting for the GPU around a number of them. */
static double seconds(const frame *f, int calls, int rounds)
{
    double t[9], start;
    int i, k;
    for (i = 0; i < calls; ++i) tonemap_gl_apply(f->map, 0, f->hdr, 0);
    timer.finish();
    for (k = 0; k < rounds; ++k) {
        start = support_clock();
        for (i = 0; i < calls; ++i) tonemap_gl_apply(f->map, 0, f->hdr, 0);
        timer.finish();
        t[k] = (support_clock() - start) / calls;
    }
    return support_median(t, rounds);
}

/* Only the luminance plane and its log-average. */
static double seconds_luminance(sat__gl *gl, const frame *f, int calls, int rounds)
{
    sat__gl_state state;
    double t[9], start;
    int i, k;
    sat__gl_begin(gl, &state, TONEMAP__GL_UNITS);
    for (k = 0; k < rounds; ++k) {
        start = support_clock();
        for (i = 0; i < calls; ++i) {
            tonemap__gl_measure(f->map, NULL, f->hdr);
            tonemap__gl_adapt(f->map, 0);
        }
        timer.finish();
        t[k] = (support_clock() - start) / calls;
    }
    sat__gl_end(gl, &state);
    return support_median(t, rounds);
}

static frame make(gl_context *context, unsigned hdr, int width, int height, const tonemap_options *o)
{
    frame f;
    f.hdr = hdr;
    if (tonemap_gl_create(&f.map, context->get_proc, width, height, o) != SAT_OK) {
        puts(tonemap_gl_message(f.map));
        exit(1);
    }
    return f;
}

static unsigned upload(sat__gl *gl, int width, int height)
{
    float *pixels = (float *)malloc((size_t)width * (size_t)height * 16);
    sat__gl_state state;
    unsigned texture = 0;
    fill(pixels, width, height);
    sat__gl_begin(gl, &state, 1);
    sat__gl_texture(gl, &texture, SAT__GL_RGBA32F, width, height, pixels);
    sat__gl_end(gl, &state);
    free(pixels);
    return texture;
}

int main(void)
{
    static const int sizes[][2] = {{256, 256},   {512, 512},   {720, 480},   {800, 600},   {1024, 768},
                                   {1280, 720},  {1024, 1024}, {1280, 1024}, {1680, 1050}, {1920, 1080},
                                   {1920, 1200}, {2048, 1280}, {2048, 1536}, {2560, 1440}, {2048, 2048}};
    gl_context context;
    sat__gl gl;
    int i, k, slow, count, calls, rounds;
    if (!gl_context_open(&context, 3, 3)) {
        printf("# note: %s\n", context.message);
        return 0;
    }
    if (sat__gl_open(&gl, context.get_proc) != SAT_OK) return 1;
    timer = gpu_clock_of(&context);
    bench_start("tonemap.h on OpenGL");
    printf("# renderer: %s\n", gl_context_renderer(&context));
    slow = bench_quick() || gpu_is_software(&context);
    count = slow ? 3 : 15;
    rounds = slow ? 3 : 9;
    calls = slow ? 1 : 20;
    bench_table("Slomp 2012, table A.1: milliseconds on the GPU",
                "width\theight\tRL\tTM.N\tTM.MU\tTM.MV\tFT\tMV_overhead");
    bench_note("RL: relative luminance, log-average and adaptation; TM: rounding, SAT, search, colour and sRGB without (N), with uniform (MU) and local (MV) mesopic filter; FT: the whole frame with MV; MV_overhead: of TM");
    for (i = 0; i < count; ++i) {
        unsigned hdr = upload(&gl, sizes[i][0], sizes[i][1]);
        double t[3], luminance = 0;
        for (k = 0; k < 3; ++k) {
            tonemap_options o = tonemap_defaults();
            frame f;
            o.mesopic = (tonemap_mesopic)k;
            o.cd_per_unit = 1;
            f = make(&context, hdr, sizes[i][0], sizes[i][1], &o);
            t[k] = seconds(&f, calls, rounds);
            if (k == 0) luminance = seconds_luminance(&gl, &f, calls, rounds);
            tonemap_gl_destroy(f.map);
        }
        bench_row("%d\t%d\t%.3f\t%.3f\t%.3f\t%.3f\t%.3f\t%.3f", sizes[i][0], sizes[i][1], 1e3 * luminance, 1e3 * (t[0] - luminance),
                  1e3 * (t[1] - luminance), 1e3 * (t[2] - luminance), 1e3 * t[2], (t[2] - t[0]) / (t[0] - luminance));
        gl.DeleteTextures(1, &hdr);
    }
    bench_table("Michael 2010, tables 9, 10, 12, 13: frames a second on the GPU, Ashikhmin and photographic, global (GTM), local (LTM), selective (STM)",
                "width\theight\toperator\tGTM\tLTM\tSTM\tSTM/LTM");
    for (i = 1; i < count; i += slow ? 1 : 4)
        for (k = 0; k < 2; ++k) {
            unsigned hdr = upload(&gl, sizes[i][0], sizes[i][1]);
            double fps[3];
            int m;
            for (m = 0; m < 3; ++m) {
                tonemap_options o = tonemap_defaults();
                frame f;
                if (m == 0) o.operation = k ? TONEMAP_PHOTOGRAPHIC_GLOBAL : TONEMAP_ASHIKHMIN_GLOBAL;
                else o.operation = k ? TONEMAP_PHOTOGRAPHIC_LOCAL : TONEMAP_ASHIKHMIN;
                if (m == 2) o.selective = 0.1;
                f = make(&context, hdr, sizes[i][0], sizes[i][1], &o);
                fps[m] = 1 / seconds(&f, calls, rounds);
                tonemap_gl_destroy(f.map);
            }
            bench_row("%d\t%d\t%s\t%.1f\t%.1f\t%.1f\t%.2f", sizes[i][0], sizes[i][1], k ? "photographic" : "Ashikhmin",
                      fps[0], fps[1], fps[2], fps[2] / fps[1]);
            gl.DeleteTextures(1, &hdr);
        }
    sat__gl_close(&gl);
    gl_context_close(&context);
    return 0;
}
