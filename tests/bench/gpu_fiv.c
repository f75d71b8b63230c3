/* Shadows on the GPU: table 3 of Michael 2010 in its shape (illumination only, 512 x 512 pixels, samples 128 x 65 x
   30), and what a new light costs. LIGHTSCAN_GL=egl for the GPU; OSMesa otherwise, with fewer pixels and samples. */

#define SAT_IMPLEMENTATION
#define FIV_IMPLEMENTATION
#define FIV_GL
#include "fiv.h"
#include "bench.h"
#include "gpu.h"
#include "image.h"
#include "mesh.h"
#include "reference_fiv.h"

enum { KINDS = 2 };

static gl_context context;
static int software, size;
static gpu_clock timer;
static fiv_environment *environment;
static fiv_occluder *occluders[KINDS];
static fiv_occluder_stats stats[KINDS];
static reference_mesh meshes[KINDS];

static int succeeded(sat_result result, const char *message)
{
    if (result != SAT_OK) printf("# %s: %s\n", sat_result_text(result), message);
    return result == SAT_OK;
}

static int open_light(void)
{
    static float grey[2 * 3] = {1, 1, 1, 1, 1, 1};
    const char *path = support_data("env/forest.exr");
    image picture;
    sat_image view = sat_image_f32(grey, 2, 1, 3);
    if (path && image_load(&picture, path)) view = image_view(&picture);
    return succeeded(fiv_environment_create(&environment, &view, NULL, NULL), "environment");
}

static int open_occluder(int kind)
{
    static const char *const names[KINDS] = {"mesh/bunny_small.ply", "mesh/queen.ply"};
    const char *path = support_data(names[kind]);
    fiv_occluder_options o = fiv_occluder_defaults();
    reference_mesh m = reference_knot(2, 3, 60, 8, 0.25);
    mesh file;
    if (!software) o.theta = 64, o.phi = 33, o.rho = 30;
    if (path && mesh_load(&file, path)) {
        size_t i;
        reference_mesh_free(&m);
        m.positions = file.positions;
        m.vertices = (size_t)file.vertex_count, m.triangles = (size_t)file.triangle_count;
        m.indices = (unsigned *)malloc(3 * m.triangles * sizeof *m.indices);
        if (!m.indices) return 0;
        for (i = 0; i < 3 * m.triangles; i++) m.indices[i] = (unsigned)file.indices[i];
        free(file.indices);
    }
    meshes[kind] = m;
    o.threads = support_threads(8);
    if (!succeeded(
            fiv_occluder_create(&occluders[kind], m.positions, m.vertices, m.indices, m.triangles, &o, &stats[kind]),
            "occluder"))
        return 0;
    return succeeded(fiv_occluder_light(occluders[kind], environment, NULL), "light");
}

/* Points of a plane, in the order of its pixels; or the vertices of the first mesh, with `alpha`, and normals away from
   its middle. */
static int open_receivers(sat__gl *gl, unsigned textures[2], int on_mesh, float alpha)
{
    float *points = (float *)malloc((size_t)size * (size_t)size * 4 * sizeof *points),
          *normals = (float *)calloc((size_t)size * (size_t)size * 4, sizeof *normals);
    sat__gl_state state;
    sat_result r;
    int i, k;
    if (!points || !normals) return 0;
    for (i = 0; i < size * size; i++) {
        points[4 * i] = 16 * ((float)(i % size) / (float)size - 0.5f), points[4 * i + 1] = -0.8f;
        points[4 * i + 2] = 16 * ((float)(i / size) / (float)size - 0.5f);
        normals[4 * i + 1] = 1;
        for (k = 0; on_mesh && k < 3; k++)
            normals[4 * i + k] = points[4 * i + k] =
                (meshes[0].positions[3 * ((size_t)i % meshes[0].vertices) + (size_t)k] - stats[0].centre[k]) /
                stats[0].radius;
        points[4 * i + 3] = alpha;
    }
    sat__gl_begin(gl, &state, 1);
    r = sat__gl_texture(gl, &textures[0], SAT__GL_RGBA32F, size, size, points);
    if (!r) r = sat__gl_texture(gl, &textures[1], SAT__GL_RGBA32F, size, size, normals);
    sat__gl_end(gl, &state);
    free(points);
    free(normals);
    return succeeded(r, gl->message);
}

/* Seconds of one pass: median of timer queries, or of glFinish where there are none. */
static double pass_time(fiv_gl *g, const unsigned textures[2])
{
    double t[9];
    int i, rounds = software ? 1 : 9;
    for (i = -1; i < rounds; i++) {
        double seconds;
        gpu_begin(&timer);
        fiv_gl_irradiance(g, NULL, textures[0], textures[1], NULL);
        seconds = gpu_end(&timer);
        if (i >= 0) t[i] = seconds;
    }
    return support_median(t, rounds);
}

/* Receivers on a bunny, taken for the surface of nothing and for its own. */
static void self_row(void)
{
    fiv_instance instance;
    fiv_gl_options o = fiv_gl_defaults();
    fiv_gl *g = NULL;
    double seconds[2] = {0, 0};
    int k, self, ok;
    instance.occluder = occluders[0];
    instance.scale = 1 / stats[0].radius;
    for (k = 0; k < 3; k++) instance.position[k] = -stats[0].centre[k] * instance.scale;
    o.max_instances = o.self = 1;
    ok = succeeded(fiv_gl_create(&g, context.get_proc, size, size, &o), fiv_gl_message(g)) &&
         succeeded(fiv_gl_set_scene(g, environment, &instance, 1), fiv_gl_message(g));
    for (self = 0; ok && self < 2; self++) {
        unsigned textures[2] = {0, 0};
        ok = open_receivers(&g->gl, textures, 1, (float)(1 + self));
        if (ok) seconds[self] = pass_time(g, textures);
        g->gl.DeleteTextures(2, textures);
    }
    if (ok) bench_row("1 bunny\t%.3f\t%.3f\t%.2f", 1e3 * seconds[0], 1e3 * seconds[1], seconds[1] / seconds[0]);
    fiv_gl_destroy(g);
}

static int scene_row(const char *name, int count, int kinds, double fps)
{
    fiv_instance instances[64];
    fiv_gl_options o = fiv_gl_defaults();
    fiv_gl *g = NULL;
    unsigned textures[2] = {0, 0};
    uint64_t seed = 4;
    double seconds, upload, memory = 0;
    size_t total = 0;
    int i, k, ok;
    for (i = 0; i < count; i++) {
        int kind = kinds == 2 ? i % 2 : 0;
        instances[i].occluder = occluders[kind];
        instances[i].scale = 1 / stats[kind].radius;
        for (k = 0; k < 3; k++)
            instances[i].position[k] = -stats[kind].centre[k] * instances[i].scale +
                                       (k == 1 || count == 1 ? 0 : 14 * (float)support_uniform(&seed) - 7);
        total += meshes[kind].vertices;
    }
    for (k = 0; k < kinds; k++) memory += 1e-6 * (double)stats[k].table_bytes;
    o.max_instances = count;
    ok = succeeded(fiv_gl_create(&g, context.get_proc, size, size, &o), fiv_gl_message(g)) &&
         open_receivers(&g->gl, textures, 0, 1);
    if (ok) {
        ok = succeeded(fiv_gl_set_scene(g, environment, instances, (size_t)count), fiv_gl_message(g));
        timer.finish();
        upload = support_clock();
        ok = ok && succeeded(fiv_gl_set_scene(g, environment, instances, (size_t)count), fiv_gl_message(g));
        timer.finish();
        upload = support_clock() - upload;
        seconds = ok ? pass_time(g, textures) : 1;
        if (ok) bench_row("%s\t%d\t%lu\t%.2f\t%.0f\t%.1f\t%.3f\t%.2f", name, count, (unsigned long)total, memory, fps, 1 / seconds, 1e3 * seconds, 1e3 * upload);
        g->gl.DeleteTextures(2, textures);
    }
    fiv_gl_destroy(g);
    return ok;
}

int main(void)
{
    static const struct { const char *name; int count, kinds; double fps;
    } scenes[8] = {{"1 bunny", 1, 1, 112},
                   {"10 bunnies", 10, 1, 68},
                   {"5 x (bunny + queen)", 10, 2, 68},
                   {"10 x (bunny + queen)", 20, 2, 46},
                   {"15 x (bunny + queen)", 30, 2, 35},
                   {"20 x (bunny + queen)", 40, 2, 29},
                   {"30 x (bunny + queen)", 60, 2, 22},
                   {NULL, 0, 0, 0}};
    int i;
    if (!gl_context_open(&context, 3, 3)) {
        printf("# skipped: %s\n", context.message);
        return 0;
    }
    timer = gpu_clock_of(&context);
    software = gpu_is_software(&context);
    size = bench_quick() ? 64 : software ? 96 : 512;
    bench_start("fiv.h, OpenGL");
    printf("# %s\n", gl_context_renderer(&context));
    if (!open_light() || !open_occluder(0) || !open_occluder(1)) return 1;
    bench_table("Table 3: scenes of many occluders (published: GeForce 8800 GTS, 512 x 512; trees where this says queens)",
                "scene\tobjects\tvertices\tmemory_mb\tpublished_fps\tfps\tpass_ms\trelight_upload_ms");
    bench_plot("Frames a second; x=objects; y=fps; log=xy");
    for (i = 0; scenes[i].name && !(bench_quick() && i > 3); i++)
        scene_row(scenes[i].name, scenes[i].count, scenes[i].kinds, scenes[i].fps);
    printf("# note: %d x %d pixels; upload: all vectors again, after a new light\n", size, size);
    bench_table("Self-shadows: receivers on the mesh, as on another object's surface and as on its own (eq 13)", "scene\tother_ms\tself_ms\tself_ratio");
    self_row();
    for (i = 0; i < KINDS; i++) fiv_occluder_destroy(occluders[i]), reference_mesh_free(&meshes[i]);
    fiv_environment_destroy(environment);
    gl_context_close(&context);
    return 0;
}
