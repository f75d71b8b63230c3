/* Writes every shader of the six headers, in every combination of the options that reach a shader, once, to files in a
   folder: NUMBER.vert, .frag, .comp; for OpenGL 3.3 and for ES 3.0. usage: glsl_dump FOLDER. Prints their number.
   The header is the one whose X_GL macro is defined, sat.h without any. */

#define LIGHTSCAN_IMPLEMENTATION
#define SAT_GL
#include "sat.h"
#ifdef TONEMAP_GL
#include "tonemap.h"
#endif
#ifdef SSAO_SAT_GL
#include "ssao_sat.h"
#endif
#ifdef FIV_GL
#include "fiv.h"
#endif
#ifdef RAINDROP_GL
#include "raindrop.h"
#endif
#ifdef SOFTASSIGN_GL
#include "softassign.h"
#endif
#include "gl_fake.h"
#include "support.h"

static const char *folder;
static uint64_t seen[1 << 16];
static int seen_count;

/* Leaves out the #define lines of names that nothing mentions: what differs in them alone is one shader. */
static char *trim(const char *text)
{
    char *out = (char *)malloc(strlen(text) + 1), *to = out, name[64];
    while (*text) {
        size_t line = strcspn(text, "\n") + 1;
        const char *rest = text + line;
        if (sscanf(text, "#define %63[A-Z_0-9]", name) == 1 && !strstr(rest, name)) {
            text = rest;
            continue;
        }
        memcpy(to, text, line);
        to += line;
        text = rest;
    }
    *to = 0;
    return out;
}

static void save(const char *ending, const char *whole)
{
    char *text = trim(whole);
    uint64_t hash = support_hash(text, strlen(text));
    char path[512];
    FILE *file;
    int i;
    for (i = 0; i < seen_count; i++)
        if (seen[i] == hash) {
            free(text);
            return;
        }
    seen[seen_count++] = hash;
    snprintf(path, sizeof path, "%s/%d.%s", folder, seen_count, ending);
    file = fopen(path, "w");
    if (!file || fputs(text, file) < 0 || fclose(file)) exit(2);
    free(text);
}

static void take(unsigned type, const char *text)
{
    save(type == SAT__GL_VERTEX_SHADER ? "vert" : type == SAT__GL_COMPUTE_SHADER ? "comp" : "frag", text);
}

/* The next combination of `count` numbers below `most`; 0 after the last. */
static int next(int *digit, const int *most, int count)
{
    int i;
    for (i = 0; i < count && ++digit[i] == most[i]; i++) digit[i] = 0;
    return i < count;
}

/* A user's shader around the text that a header hands out. */
static void library(const char *const *parts, const char *defines, const char *calls)
{
    static char text[1 << 17];
    size_t used = (size_t)snprintf(text, sizeof text, "%s", gl_fake.es ? "#version 300 es\nprecision highp float;\nprecision highp int;\nprecision highp usampler2D;\n" : "#version 330 core\n");
    used += (size_t)snprintf(text + used, sizeof text - used, "%s", defines);
    for (; *parts; parts++) used += (size_t)snprintf(text + used, sizeof text - used, "%s", *parts);
    snprintf(text + used, sizeof text - used, "out vec4 result;\nvoid main() {\n%s}\n", calls);
    save("frag", text);
}

/* The message is asked for after the call. */
#define expect_ok(call, message)                                                                                       \
    do {                                                                                                               \
        sat_result result = call;                                                                                      \
        if (result != SAT_OK) {                                                                                        \
            fprintf(stderr, "%s: %s\n", sat_result_text(result), message);                                             \
            exit(2);                                                                                                   \
        }                                                                                                              \
    } while (0)

#if !defined(TONEMAP_GL) && !defined(SSAO_SAT_GL) && !defined(FIV_GL) && !defined(RAINDROP_GL) && !defined(SOFTASSIGN_GL)
static void dump_sat(void)
{
    static const int most[] = {4, 2, 3, 2, 4, 2}, ks[] = {2, 4, 64};
    const char *parts[3];
    int d[6] = {0};
    do {
        sat_gl_options o = sat_gl_defaults();
        sat_gl *gl;
        o.format = (sat_gl_format)d[0];
        o.algorithm = d[1] ? SAT_SCAN_RECURSIVE_DOUBLING : SAT_SCAN_BALANCED_TREE;
        o.k = ks[d[2]];
        o.compute = d[3];
        o.channel = d[4];
        o.unsigned_input = d[5];
        if (o.format == SAT_GL_TILED) { /* it looks at neither algorithm nor k */
            if (d[2] || d[5]) continue;
            o.k = 4, o.compute = d[1], o.channel = 0;
            o.channels = 1 + d[4];
            o.moments = d[3];
        }
        if (!sat__gl_options_are_valid(&o)) continue;
        expect_ok(sat_gl_create(&gl, gl_fake_proc, &o), sat_gl_message(gl));
        sat_gl_destroy(gl);
    } while (next(d, most, 6));
    parts[0] = parts[1] = sat_gl_glsl();
    parts[2] = NULL;
    library(parts, "uniform sampler2D t;\nuniform highp usampler2D u;\nuniform ivec4 b;\n",
            "    result = vec4(sat_sum(t, b.xy, b.zw), sat_mean(t, b.xy, b.zw), sat_sum_fractional(t, vec2(b.xy), vec2(b.zw)), 1.0);\n"
            "    result += vec4(sat_sum(u, 0.5, b.xy, b.zw), sat_mean(u, 0.5, b.xy, b.zw), sat_sum_fractional(u, 0.5, vec2(b.xy), vec2(b.zw)), 1.0);\n");
}
#endif

#ifdef TONEMAP_GL
/* Without compute shaders. */
static sat_gl_proc plain_proc(const char *name)
{
    return strcmp(name, "glDispatchCompute") == 0 ? NULL : gl_fake_proc(name);
}

static void dump_tonemap(void)
{
    /* operator, mesopic, metering, scales, soft, key, white; the others are numbers in an expression */
    static const int most[] = {6, 3, 2, 2, 2, 2, 3};
    const char *parts[3];
    int d[7] = {0};
    do {
        tonemap_options o = tonemap_defaults();
        tonemap *same = NULL;
        tonemap_gl *gl;
        o.operation = (tonemap_operator)d[0];
        o.mesopic = (tonemap_mesopic)d[1];
        o.metering = (tonemap_metering)d[2];
        if (d[3]) o.scales = 1;
        o.soft = d[4] ? 0.1 : 0;
        o.key = d[5] ? 0.18 : 0;
        o.white = d[6] == 2 ? (double)INFINITY : d[6] ? 2 : 0;
        if (tonemap_create(&same, 2, 2, &o) != SAT_OK) continue; /* not a combination */
        tonemap_destroy(same);
        expect_ok(tonemap_gl_create(&gl, gl_fake_proc, 64, 32, &o), tonemap_gl_message(gl));
        tonemap_gl_destroy(gl);
        expect_ok(tonemap_gl_create(&gl, plain_proc, 64, 32, &o), tonemap_gl_message(gl));
        tonemap_gl_destroy(gl);
    } while (next(d, most, 7));
    parts[0] = sat_gl_glsl();
    parts[1] = tonemap_gl_glsl();
    parts[2] = NULL;
    library(parts, "uniform highp usampler2D u;\n",
            "    vec3 v = tonemap_srgb(tonemap_mesopic(gl_FragCoord.xyz, tonemap_luminance(gl_FragCoord.xyz), tonemap_rho(2.0)));\n"
            "    result = vec4(v, tonemap_local(u, 0.5, ivec2(gl_FragCoord.xy), v.x, 0.18));\n");
    library(parts + 1, "", "    result = vec4(tonemap_srgb(tonemap_mesopic(vec3(1.0), 1.0, tonemap_rho(2.0))), 1.0);\n");
}
#endif

#ifdef SSAO_SAT_GL
static void dump_ssao_sat(void)
{
    /* method, half resolution, slabs, scales, boxes, levels, printed, inverted */
    static const int most[] = {5, 2, 3, 4, 2, 3, 2, 2}, slabs[] = {1, 4, 8};
    const char *parts[2];
    int d[8] = {0};
    do {
        ssao_sat_options o = ssao_sat_defaults();
        ssao_sat_gl *gl;
        o.method = (ssao_sat_method)d[0];
        o.half_resolution = d[1];
        o.slabs = slabs[d[2]];
        o.scales = 1 + d[3];
        o.plane_boxes = 1 + d[4];
        o.refine_levels = d[5];
        o.as_printed = d[6];
        o.inverted_depth = d[7];
        o.gl_bent = o.gl_signed = 1;
        if ((o.method == SSAO_SAT_SLABS) ? d[4] || d[5] || d[6] || d[7] : d[2] || d[3]) continue; /* not looked at */
        expect_ok(ssao_sat_gl_create(&gl, gl_fake_proc, 64, 32, &o), ssao_sat_gl_message(gl));
        ssao_sat_gl_destroy(gl);
    } while (next(d, most, 8));
    parts[0] = ssao_sat_gl_glsl();
    parts[1] = NULL;
    library(parts, "uniform sampler2D t;\nuniform vec4 view[3];\n",
            "    ivec2 p = ivec2(gl_FragCoord.xy);\n"
            "    float z = ssao_sat_distance(view, p, 0.5) + ssao_sat_distance(view, 0.5);\n"
            "    result = vec4(ssao_sat_position(view, p, z) + ssao_sat_depth_normal(view, t, p, z), z);\n");
}
#endif

#ifdef FIV_GL
static void dump_fiv(void)
{
    static const int instances[] = {1, 8, 64};
    int i, self;
    for (i = 0; i < 3; i++)
        for (self = 0; self < 2; self++) {
            fiv_gl_options o = fiv_gl_defaults();
            fiv_gl *gl;
            o.max_instances = instances[i];
            o.self = self;
            expect_ok(fiv_gl_create(&gl, gl_fake_proc, 64, 32, &o), fiv_gl_message(gl));
            fiv_gl_destroy(gl);
        }
    library(fiv_gl_glsl(), "#define FIV_INSTANCES 8\n",
            "    result = vec4(fiv_irradiance(gl_FragCoord.xyz, vec3(1.0)) + fiv_self_irradiance(1, gl_FragCoord.xyz, vec3(1.0)), 1.0);\n");
}
#endif

#ifdef RAINDROP_GL
static void dump_raindrop(void)
{
    /* map, quads, look, shutter, oblate, orders, lamps and oscillation */
    static const int most[] = {2, 2, 4, 2, 2, 2, 2};
    static float white[3 * 8 * 4];
    raindrop_environment *light;
    raindrop_map_options mo = raindrop_map_defaults();
    raindrop_map *map;
    sat_image image = sat_image_f32(white, 8, 4, 3);
    const char *parts[2];
    int d[7] = {0};
    mo.resolution = 16;
    expect_ok(raindrop_map_create(&map, &mo), "map");
    expect_ok(raindrop_environment_create(&light, &image, NULL, NULL), "environment");
    do {
        raindrop_gl_options o = raindrop_gl_defaults();
        raindrop_rain_options ro = raindrop_rain_defaults();
        raindrop_render_options ao = raindrop_render_defaults();
        raindrop_camera camera = raindrop_camera_defaults();
        raindrop_rain *rain;
        raindrop_gl *gl;
        if (d[2] == 0 && !d[0]) continue; /* the look needs the map */
        o.map = d[0] ? map : NULL;
        o.quads = d[1];
        ao.look = (raindrop_look)d[2];
        camera.exposure = d[3] ? 0.01f : 0;
        ro.oblate = d[4];
        ro.box_size[0] = ro.box_size[1] = ro.box_size[2] = 0.5f;
        ao.orders = o.orders = d[5];
        o.motion = d[3];
        o.oblate = d[4];
        o.lamps = o.oscillation = d[6];
        ao.oscillation = d[6] ? 0.1f : 0;
        ao.map = map;
        expect_ok(raindrop_rain_create(&rain, &ro), "rain");
        expect_ok(raindrop_gl_create(&gl, gl_fake_proc, &o), raindrop_gl_message(gl));
        expect_ok(raindrop_gl_set_environment(gl, light), raindrop_gl_message(gl));
        expect_ok(raindrop_gl_set_rain(gl, rain), raindrop_gl_message(gl));
        expect_ok(raindrop_gl_render(gl, NULL, 64, 32, &camera, NULL, &ao), raindrop_gl_message(gl));
        raindrop_gl_destroy(gl);
        raindrop_rain_destroy(rain);
    } while (next(d, most, 7));
    raindrop_environment_destroy(light);
    raindrop_map_destroy(map);
    parts[0] = raindrop_gl_glsl();
    parts[1] = NULL;
    library(parts, "", "    raindrop_ray ray = raindrop_trace(vec3(0.0, 0.0, -1.0), vec3(0.5, 0.0, 0.0), 0.75, 1.33);\n"
                       "    result = vec4(ray.reflected + ray.refracted, ray.fresnel);\n");
}
#endif

#ifdef SOFTASSIGN_GL
static void dump_softassign(void)
{
    static const int gathers[] = {2, 4, 32};
    const char *parts[2];
    int i;
    for (i = 0; i < 3; i++) {
        softassign_options o = softassign_defaults();
        softassign_gl *gl;
        o.gather = gathers[i];
        expect_ok(softassign_gl_create(&gl, gl_fake_proc, &o), softassign_gl_message(gl));
        softassign_gl_destroy(gl);
    }
    parts[0] = softassign_gl_glsl();
    parts[1] = NULL;
    library(parts, "", "    result = vec4(softassign_join(vec2(1.0, 2.0), gl_FragCoord.xy, 0.5), 0.0, 1.0);\n");
}
#endif

int main(int argc, char **argv)
{
    if (argc != 2) return 1;
    folder = argv[1];
    gl_fake.shader = take;
    for (gl_fake.es = 0; gl_fake.es < 2; gl_fake.es++) {
#if defined(TONEMAP_GL)
        dump_tonemap();
#elif defined(SSAO_SAT_GL)
        dump_ssao_sat();
#elif defined(FIV_GL)
        dump_fiv();
#elif defined(RAINDROP_GL)
        dump_raindrop();
#elif defined(SOFTASSIGN_GL)
        dump_softassign();
#else
        dump_sat();
#endif
    }
    printf("%d\n", seen_count);
    return seen_count == 0;
}
