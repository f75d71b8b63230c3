/* Ambient occlusion on the GPU: Slomp 2012, table 5.1 and figure 5.16, in their shape. LIGHTSCAN_GL=egl for the GPU,
   OSMesa otherwise (then with the smaller sizes only). Occlusion passes alone: the thesis timed whole frames. */

#define SAT_IMPLEMENTATION
#define SSAO_SAT_IMPLEMENTATION
#define SSAO_SAT_GL
#include "ssao_sat.h"
#include "bench.h"
#include "mesh.h"
#include "gpu.h"
#include "reference_ssao.h"

static gl_context context;
static sat__gl gpu;
static gpu_clock timer;
static int software;

/* ---- the usual methods as fragment passes: linear depth, half resolution, then a separable blur that keeps edges
   ---- */

static const char common_text[] =
    "uniform sampler2D depth, normals, occlusion;\n"
    "uniform vec4 view;\n" /* focal length in table pixels, centre x, y, radius */
    "uniform ivec2 size, along;\n"
    "out vec4 result;\n"
    "float z_at(ivec2 p) { return texelFetch(depth, 2 * p, 0).r; }\n"
    "vec3 place(ivec2 p, float z) { return vec3((vec2(p) + 0.5 - view.yz) / view.x * z, z); }\n"
    "vec3 normal(ivec2 p) { return texelFetch(normals, 2 * p, 0).xyz * vec3(1.0, -1.0, -1.0); }\n"
    "float noise(ivec2 p, int shift) { return float((((p.y & 3) * 4 + (p.x & 3) + shift) * 7) % 16) / 16.0; }\n";

static const char traditional_text[] =
    "void main() {\n"
    "    ivec2 p = ivec2(gl_FragCoord.xy);\n"
    "    float z = z_at(p), turn = 6.2831853 * noise(p, 0), sum = 0.0;\n"
    "    result = vec4(0.0);\n"
    "    if (isinf(z)) return;\n"
    "    vec3 n = normal(p), at = place(p, z);\n"
    "    for (int k = 0; k < 16; k++) {\n"
    "        float t = float(k + 1) / 16.0, up = 1.0 - 2.0 * fract(float(k) * 0.618034), a = turn + 2.3999632 * float(k);\n"
    "        vec3 d = vec3(sqrt(1.0 - up * up) * vec2(cos(a), sin(a)), up) * (0.1 + 0.9 * t * t);\n"
    "        if (dot(d, n) < 0.0) d = -d;\n"
    "        vec3 q = at + d * view.w;\n"
    "        ivec2 i = ivec2(view.x * q.xy / q.z + view.yz);\n"
    "        if (q.z <= 1e-3 || any(lessThan(i, ivec2(0))) || any(greaterThanEqual(i, size))) continue;\n"
    "        float zi = z_at(i), off = abs(z - zi) / view.w;\n"
    "        if (q.z - zi > 0.01 * view.w) sum += off < 1.0 ? 1.0 : 1.0 / (off * off);\n"
    "    }\n"
    "    result = vec4(sum / 16.0);\n"
    "}\n";

static const char horizon_text[] =
    "void main() {\n"
    "    ivec2 p = ivec2(gl_FragCoord.xy);\n"
    "    float z = z_at(p), turn = noise(p, 0), jitter = noise(p, 5), sum = 0.0;\n"
    "    result = vec4(0.0);\n"
    "    if (isinf(z)) return;\n"
    "    vec3 n = normal(p), at = place(p, z);\n"
    "    float stride = max(clamp(view.w * view.x / z, 1.5, 400.0) / 8.0, 1.0);\n"
    "    for (int k = 0; k < 16; k++) {\n"
    "        float a = (float(k) + turn) * 0.39269908, top = 0.15;\n"
    "        vec2 d = vec2(cos(a), sin(a));\n"
    "        for (int m = 0; m < 8; m++) {\n"
    "            ivec2 i = ivec2(vec2(p) + 0.5 + d * ((float(m) + 0.2 + 0.8 * jitter) * stride + 0.7));\n"
    "            if (any(lessThan(i, ivec2(0))) || any(greaterThanEqual(i, size))) break;\n"
    "            float zi = z_at(i);\n"
    "            if (isinf(zi)) continue;\n"
    "            vec3 q = place(i, zi) - at;\n"
    "            float square = dot(q, q), sine = dot(q, n) * inversesqrt(square + 1e-12);\n"
    "            if (square > view.w * view.w || sine <= top) continue;\n"
    "            sum += (1.0 - square / (view.w * view.w)) * (sine - top);\n"
    "            top = sine;\n"
    "        }\n"
    "    }\n"
    "    result = vec4(sum / 16.0);\n"
    "}\n";

static const char blur_text[] =
    "void main() {\n"
    "    ivec2 p = ivec2(gl_FragCoord.xy);\n"
    "    float z = z_at(p), sum = 0.0, total = 0.0;\n"
    "    result = vec4(0.0);\n"
    "    if (isinf(z)) return;\n"
    "    for (int k = -7; k <= 7; k++) {\n"
    "        ivec2 i = clamp(p + k * along, ivec2(0), size - 1);\n"
    "        float w = 1.0 - abs(z_at(i) - z) / (z * 0.04);\n"
    "        if (!(w > 0.0)) continue;\n"
    "        sum += w * texelFetch(occlusion, i, 0).r;\n"
    "        total += w;\n"
    "    }\n"
    "    result = vec4(sum / total);\n"
    "}\n";

enum { TRADITIONAL, HORIZON, BLUR, PROGRAMS };
enum { METHODS = 7 };
static const char *const names[METHODS] = {"traditional 16 + 15x15 blur",
                                           "horizon-based 16x8 + 15x15 blur",
                                           "SAT minimalist",
                                           "SAT normal-guided",
                                           "SAT normal-guided, refined",
                                           "SAT plane 2x2",
                                           "SAT slabs"};
static const ssao_sat_method ours[METHODS] = {SSAO_SAT_SLABS,         SSAO_SAT_SLABS,   SSAO_SAT_MINIMALIST,
                                              SSAO_SAT_NORMAL_GUIDED, SSAO_SAT_REFINED, SSAO_SAT_PLANE,
                                              SSAO_SAT_SLABS};

typedef struct work {
    int method, size;
    unsigned depth, normals, programs[PROGRAMS], textures[2], framebuffers[2];
    ssao_sat_input in;
    ssao_sat_gl *gl;
} work;

static void stop(const char *why)
{
    printf("# %s\n", why);
    exit(1);
}

static void pass(work *w, int program, int to, int dx, int dy)
{
    unsigned p = w->programs[program];
    float view[4];
    view[0] = (float)(0.25 * w->size / tan(0.5 * 0.78539816));
    view[1] = view[2] = 0.25f * (float)w->size;
    view[3] = 0.25f * 1.4f;
    sat__gl_pass(&gpu, p, w->framebuffers[to], w->size / 2, w->size / 2);
    sat__gl_set_float4(&gpu, p, "view", view);
    sat__gl_set_int2(&gpu, p, "size", w->size / 2, w->size / 2);
    sat__gl_set_int2(&gpu, p, "along", dx, dy);
    sat__gl_set_texture(&gpu, p, "depth", 0, w->depth);
    sat__gl_set_texture(&gpu, p, "normals", 1, w->normals);
    if (program == BLUR) sat__gl_set_texture(&gpu, p, "occlusion", 2, w->textures[!to]);
    sat__gl_draw(&gpu);
}

static void run(work *w)
{
    sat__gl_state state;
    if (w->method >= 2) {
        if (ssao_sat_gl_apply(w->gl, 0, w->depth, w->normals, &w->in) != SAT_OK) stop(ssao_sat_gl_message(w->gl));
        return;
    }
    sat__gl_begin(&gpu, &state, 3);
    pass(w, w->method, 0, 0, 0);
    pass(w, BLUR, 1, 1, 0);
    pass(w, BLUR, 0, 0, 1);
    sat__gl_end(&gpu, &state);
}

/* Milliseconds of one call: median of several measurements of several calls each. */
static double milliseconds(work *w)
{
    double t[9];
    int i, j, rounds = software ? 1 : 9, repeat = software ? 1 : 10;
    run(w);
    if (!software) run(w);
    for (i = 0; i < rounds; i++) {
        gpu_begin(&timer);
        for (j = 0; j < repeat; j++) run(w);
        t[i] = 1e3 * gpu_end(&timer) / repeat;
    }
    return support_median(t, rounds);
}

static void build(work *w)
{
    const char *const texts[PROGRAMS] = {traditional_text, horizon_text, blur_text};
    int i;
    for (i = 0; i < PROGRAMS; i++) {
        const char *fragment[3];
        sat__gl_shaders shaders;
        fragment[0] = common_text;
        fragment[1] = texts[i];
        fragment[2] = NULL;
        memset(&shaders, 0, sizeof shaders);
        shaders.name = "comparator";
        shaders.fragment = fragment;
        if (sat__gl_build(&gpu, &w->programs[i], &shaders) != SAT_OK) stop(gpu.message);
    }
}

/* Times of all methods at one size. */
static void measure(double *t, int size)
{
    ref_scene scene;
    ref_picture p;
    work w;
    sat__gl_state state;
    int i;
    memset(&w, 0, sizeof w);
    w.size = size;
    ref_open(&scene, 0);
    p = ref_draw(&scene, size, size, 0, 0, ref_make(0, 0, 0), 4);
    ref_close(&scene);
    sat__gl_begin(&gpu, &state, 3);
    if (sat__gl_texture(&gpu, &w.depth, SAT__GL_R32F, size, size, p.z) != SAT_OK ||
        sat__gl_texture(&gpu, &w.normals, SAT__GL_RGB32F, size, size, p.normals) != SAT_OK) stop(gpu.message);
    for (i = 0; i < 2; i++)
        if (sat__gl_texture(&gpu, &w.textures[i], SAT__GL_R16F, size / 2, size / 2, NULL) != SAT_OK ||
            sat__gl_framebuffer(&gpu, &w.framebuffers[i], &w.textures[i], 1, 0) != SAT_OK) stop(gpu.message);
    build(&w);
    sat__gl_end(&gpu, &state);
    w.in = ssao_sat_input_linear(p.z, size, size, p.fov);
    for (i = 0; i < METHODS; i++) {
        ssao_sat_options o = ssao_sat_defaults();
        w.method = i;
        w.gl = NULL;
        o.method = ours[i];
        o.radius = 0.25;
        if (i >= 2 && ssao_sat_gl_create(&w.gl, context.get_proc, size, size, &o) != SAT_OK)
            stop(ssao_sat_gl_message(w.gl));
        t[i] = milliseconds(&w);
        ssao_sat_gl_destroy(w.gl);
    }
    for (i = 0; i < PROGRAMS; i++) gpu.DeleteProgram(w.programs[i]);
    gpu.DeleteFramebuffers(2, w.framebuffers);
    gpu.DeleteTextures(2, w.textures);
    gpu.DeleteTextures(1, &w.depth);
    gpu.DeleteTextures(1, &w.normals);
    ref_free(&p);
}

int main(void)
{
    double t[5][METHODS];
    int sizes[5], count = 0, i, k, small, table = 0;
    bench_start("ssao_sat.h on the GPU");
    if (!gl_context_open(&context, 3, 3) || sat__gl_open(&gpu, context.get_proc) != SAT_OK) {
        printf("# skipped: %s\n", context.message);
        return 0;
    }
    printf("# renderer: %s\n", gl_context_renderer(&context));
    timer = gpu_clock_of(&context);
    software = gpu_is_software(&context);
    small = software || bench_quick();
    for (i = 256; i <= (small ? 256 : 2048); i *= 2) sizes[count++] = i;
    if (!small) sizes[count++] = 4096;
    for (i = 0; i < count; i++) measure(t[i], sizes[i]);
    for (i = 0; i < count; i++) table = sizes[i] == 1024 ? i : table;
    bench_table(small ? "Table 5.1, at 256 x 256" : "Table 5.1: 1024 x 1024, tables of 512 x 512", "row\ttraditional\thorizon_based\tSAT_refined\tSAT_slabs\tSAT_plane");
    bench_note("The thesis gives whole frames on a GTX 280: 7.7, 11 and 4.5 ms. Here: the occlusion alone, theirs without an upsample to the full size.");
    bench_row("ms\t%.4f\t%.4f\t%.4f\t%.4f\t%.4f", t[table][0], t[table][1], t[table][4], t[table][6], t[table][5]);
    bench_row("ratio to SAT refined\t%.2f\t%.2f\t1\t%.2f\t%.2f", t[table][0] / t[table][4], t[table][1] / t[table][4], t[table][6] / t[table][4], t[table][5] / t[table][4]);
    bench_row("ratio in the thesis\t1.71\t2.44\t1\t\t");
    bench_table("Figure 5.16 on the GPU: time against resolution, scene 0, R = 0.25", "method\tsize\tms\tto_traditional_ratio");
    bench_plot("Time against resolution; x=size; y=ms; by=method; log=xy; style=linespoints");
    for (k = 0; k < METHODS; k++)
        for (i = 0; i < count; i++) bench_row("%s\t%d\t%.4f\t%.2f", names[k], sizes[i], t[i][k], t[i][k] / t[i][0]);
    sat__gl_close(&gpu);
    gl_context_close(&context);
    return 0;
}
