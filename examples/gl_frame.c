/* gl_frame - a frame that stays on the GPU, by public calls only.     SPDX-License-Identifier: MIT-0 OR Unlicense

       gl_frame                                       a window; its title names the milliseconds of each stage (by time
                                                      queries, which OpenGL ES lacks)
       gl_frame --frames 9 --out frame.png            without a window (OSMesa; LIGHTSCAN_GL=egl: the GPU)

   gl_scene.h draws colour, normals and depth. ssao_sat.h and fiv.h read its textures by name, a pass of the renderer
   puts their results together, rain falls into that, and tonemap.h writes the window. Nothing in frame_draw is
   uploaded, read back, allocated or compiled. */

#define _POSIX_C_SOURCE 200809L
#define LIGHTSCAN_IMPLEMENTATION
#define FIV_GL
#define RAINDROP_GL
#define SSAO_SAT_GL
#define TONEMAP_GL
#include "../fiv.h"
#include "../raindrop.h"
#include "../ssao_sat.h"
#include "../tonemap.h"
#include "common.h"
#include "gl_context.h"
#include "gl_scene.h"
#ifdef HAVE_GLFW
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#endif

enum { FRAME_SCENE, FRAME_OCCLUSION, FRAME_SHADOWS, FRAME_LIGHT, FRAME_RAIN, FRAME_TONE, FRAME_STAGES };

typedef struct frame {
    gl_scene scene;
    gl_tools_timer timer;
    fiv_environment *light;
    fiv_occluder *occluder[SCENE_OBJECTS];
    raindrop_environment *mirror;
    raindrop_rain *drops;
    ssao_sat_gl *ao;
    ssao_sat_input input;
    fiv_gl *shadows;
    fiv_gl_view view;
    raindrop_gl *rain;
    raindrop_camera camera;
    tonemap_gl *tone;
    char message[400];
} frame;

static int frame_check(frame *f, sat_result result, const char *what)
{
    if (result != SAT_OK) snprintf(f->message, sizeof f->message, "%s: %.300s", sat_result_text(result), what);
    return result == SAT_OK;
}

/* What ssao_sat.h and fiv.h ask about the camera: its matrix, and the way back from the depth buffer. */
static void frame_look(frame *f)
{
    const raindrop_camera *c = &f->scene.things.camera;
    const float *p = f->scene.projection;
    float *world = f->view.world_from_clip;
    int k;
    f->input.width = f->scene.width, f->input.height = f->scene.height;
    f->input.depth_kind = SSAO_SAT_DEPTH_HARDWARE;
    memcpy(f->input.projection, p, sizeof f->input.projection);
    memcpy(f->view.world_from_normal, f->scene.axes, sizeof f->view.world_from_normal);
    for (k = 0; k < 3; ++k) {
        world[k] = c->right[k] / p[0], world[4 + k] = c->up[k] / p[5];
        world[8 + k] = c->position[k] / p[14], world[12 + k] = c->position[k] * p[10] / p[14] - c->back[k];
    }
    world[11] = 1 / p[14], world[15] = p[10] / p[14];
    f->camera = *c;
    f->camera.exposure = 0.0002f, f->camera.depth_near = 0.08f;
}

/* What is made once on the CPU: light, masks, drops. */
static int frame_prepare(frame *f, fiv_instance *instances, const image *sky, const sat_threads *threads)
{
    fiv_occluder_options fo = fiv_occluder_defaults();
    raindrop_rain_options ro = raindrop_rain_defaults();
    sat_image picture = image_view(sky);
    int i, ok;
    fo.threads = ro.threads = *threads;
    fo.theta = 16, fo.phi = 9, fo.first_shell = 0.15f;
    ok = frame_check(f, fiv_environment_create(&f->light, &picture, NULL, NULL), "light") &&
         frame_check(f, raindrop_environment_create(&f->mirror, &picture, NULL, NULL), "light in drops");
    for (i = 0; ok && i < SCENE_OBJECTS; ++i) {
        const scene_object *o = &f->scene.things.objects[i];
        ok = frame_check(f, fiv_occluder_create(&f->occluder[i], o->positions, o->vertices, o->indices, o->triangles,
                                                &fo, NULL), "masks") &&
             frame_check(f, fiv_occluder_light(f->occluder[i], f->light, NULL), "shadows");
        instances[i].occluder = f->occluder[i], instances[i].scale = o->scale;
        memcpy(instances[i].position, o->place, sizeof o->place);
    }
    ro.rate_mm_h = 150, ro.box_size[0] = ro.box_size[2] = 6, ro.box_size[1] = 4, ro.wind[0] = 1.2f;
    memcpy(ro.centre, f->camera.position, sizeof ro.centre);
    ro.centre[2] -= 2.8f;
    return ok && frame_check(f, raindrop_rain_create(&f->drops, &ro), "rain");
}

/* All that lasts longer than a frame: 1, or 0 with a message. */
static int frame_create(frame *f, sat_gl_get_proc *get_proc, int width, int height, const sat_threads *threads)
{
    fiv_gl_options fo = fiv_gl_defaults();
    raindrop_gl_options ro = raindrop_gl_defaults();
    ssao_sat_options so = ssao_sat_defaults();
    tonemap_options to = tonemap_defaults();
    fiv_instance instances[SCENE_OBJECTS];
    const char *why;
    image sky;
    int ok;
    memset(f, 0, sizeof *f);
    if (!image_create(&sky, 512, 256, 3)) return frame_check(f, SAT_ERR_MEMORY, "sky");
    scene_draw_sky(&sky, SCENE_DUSK, 0, threads);
    ok = gl_scene_create(&f->scene, get_proc, width, height, &sky, &why) || frame_check(f, SAT_ERR_GL_STATE, why);
    if (ok) frame_look(f);
    ok = ok && frame_prepare(f, instances, &sky, threads);
    image_free(&sky);
    if (!ok) return 0;
    gl_tools_timer_create(&f->scene.t, &f->timer, FRAME_STAGES);
    so.radius = 0.12, so.bottom_up = 1;
    fo.self = 1;
    to.key = 0.22, to.cd_per_unit = 1, to.mesopic = TONEMAP_MESOPIC_LOCAL;
    return frame_check(f, ssao_sat_gl_create(&f->ao, get_proc, width, height, &so), ssao_sat_gl_message(f->ao)) &&
           frame_check(f, fiv_gl_create(&f->shadows, get_proc, width, height, &fo), fiv_gl_message(f->shadows)) &&
           frame_check(f, fiv_gl_set_scene(f->shadows, f->light, instances, SCENE_OBJECTS), "shadows") &&
           frame_check(f, raindrop_gl_create(&f->rain, get_proc, &ro), raindrop_gl_message(f->rain)) &&
           frame_check(f, raindrop_gl_set_environment(f->rain, f->mirror), raindrop_gl_message(f->rain)) &&
           frame_check(f, raindrop_gl_set_rain(f->rain, f->drops), raindrop_gl_message(f->rain)) &&
           frame_check(f, tonemap_gl_create(&f->tone, get_proc, width, height, &to), tonemap_gl_message(f->tone));
}

/* Every stage; the last one draws into the target. */
static int frame_draw(frame *f, const sat_gl_target *target, double dt)
{
    gl_scene *s = &f->scene;
    sat_gl_target lit = sat_gl_to_framebuffer(s->lit, 0, 0);
    sat_result result;
    gl_tools_timer_stage(&s->t, &f->timer, FRAME_SCENE);
    gl_scene_draw(s);
    gl_tools_timer_stage(&s->t, &f->timer, FRAME_OCCLUSION);
    result = ssao_sat_gl_apply(f->ao, NULL, s->depth, s->normal, &f->input);
    if (!frame_check(f, result, ssao_sat_gl_message(f->ao))) return 0;
    gl_tools_timer_stage(&s->t, &f->timer, FRAME_SHADOWS);
    result = fiv_gl_irradiance(f->shadows, NULL, s->depth, s->normal, &f->view);
    if (!frame_check(f, result, fiv_gl_message(f->shadows))) return 0;
    gl_tools_timer_stage(&s->t, &f->timer, FRAME_LIGHT);
    gl_scene_light(s, fiv_gl_texture(f->shadows), ssao_sat_gl_texture(f->ao));
    gl_tools_timer_stage(&s->t, &f->timer, FRAME_RAIN);
    result = raindrop_gl_advance(f->rain, dt);
    if (result == SAT_OK)
        result = raindrop_gl_render(f->rain, &lit, s->width, s->height, &f->camera, s->projection, NULL);
    if (!frame_check(f, result, raindrop_gl_message(f->rain))) return 0;
    gl_tools_timer_stage(&s->t, &f->timer, FRAME_TONE);
    result = tonemap_gl_apply(f->tone, target, s->hdr, dt);
    if (!frame_check(f, result, tonemap_gl_message(f->tone))) return 0;
    gl_tools_timer_stage(&s->t, &f->timer, FRAME_STAGES);
    return 1;
}

static void frame_destroy(frame *f)
{
    int i;
    ssao_sat_gl_destroy(f->ao), fiv_gl_destroy(f->shadows), raindrop_gl_destroy(f->rain), tonemap_gl_destroy(f->tone);
    for (i = 0; i < SCENE_OBJECTS; ++i) fiv_occluder_destroy(f->occluder[i]);
    fiv_environment_destroy(f->light), raindrop_environment_destroy(f->mirror), raindrop_rain_destroy(f->drops);
    gl_scene_destroy(&f->scene);
}

#ifndef FRAME_NO_MAIN /* tests */
static const char *frame_times(const frame *f, char *text, size_t size)
{
    static const char *const names[FRAME_STAGES] = {"scene", "occlusion", "shadows", "light", "rain", "tone"};
    int i, n = snprintf(text, size, "ms:");
    for (i = 0; i < FRAME_STAGES; ++i)
        n += snprintf(text + n, size - (size_t)n, " %s %.2f", names[i], 1e3 * f->timer.seconds[i]);
    return text;
}

/* Frames into a texture of our own, and the last one as a PNG, whose first row is the top one. */
static int frame_save(frame *f, int frames, const common_settings *common)
{
    const gl_tools *t = &f->scene.t;
    size_t i, pixels = (size_t)f->scene.width * (size_t)f->scene.height;
    unsigned char *rgba = (unsigned char *)malloc(4 * pixels);
    unsigned screen = gl_tools_texture(t, GL_TOOLS_RGBA8, f->scene.width, f->scene.height, 0, NULL);
    unsigned framebuffer = gl_tools_framebuffer(t, screen, 0, 0);
    sat_gl_target target = sat_gl_to_framebuffer(framebuffer, 0, 0);
    int k, ok = rgba != NULL;
    target.flip = 1;
    for (k = 0; ok && k < frames; ++k) ok = frame_draw(f, &target, k ? 1 / 30.0 : 0);
    if (ok) gl_tools_read(t, rgba, framebuffer, GL_TOOLS_RGBA8, f->scene.width, f->scene.height);
    for (i = 0; ok && i < pixels; ++i) memmove(rgba + 3 * i, rgba + 4 * i, 3);
    ok = ok && common_save_u8(common, common->out, rgba, f->scene.width, f->scene.height, 3);
    free(rgba);
    return ok;
}

#ifdef HAVE_GLFW
static int frame_window(frame *f, int width, int height, const common_settings *common)
{
    const sat_gl_target target = sat_gl_to_framebuffer(0, 0, 0);
    GLFWwindow *window;
    char text[200];
    int i = 0, ok;
    if (!glfwInit()) return common_say(common, "there is no display to open a window on; --out FILE does without");
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    window = glfwCreateWindow(width, height, "lightscan", NULL, NULL);
    if (!window) return glfwTerminate(), common_say(common, "no window with OpenGL 3.3");
    glfwMakeContextCurrent(window);
    glfwGetFramebufferSize(window, &width, &height); /* pixels, where a window is measured in other units */
    ok = frame_create(f, glfwGetProcAddress, width, height, &common->threads);
    for (; ok && !glfwWindowShouldClose(window); glfwSwapBuffers(window), glfwPollEvents()) {
        ok = frame_draw(f, &target, i ? 1 / 60.0 : 0);
        if (i++ % 30 == 2) glfwSetWindowTitle(window, frame_times(f, text, sizeof text));
    }
    frame_destroy(f);
    return glfwTerminate(), ok;
}
#endif

int main(int argc, char **argv)
{
    int size[2] = {960, 540}, frames = 3, ok = 0;
    const common_option options[] = {{"size", 'z', size, 16, 8192, "of the picture"},
                                     {"frames", 'i', &frames, 1, 100000, "with --out: so many, 1/30 s apart"}};
    common_settings common;
    gl_context context;
    static frame f;
    char text[200];
    common_parse(&common, argc, argv, "gl_frame", "?.png", options, 2);
    if (common.out) {
        if (!gl_context_open(&context, 3, 3)) return common_say(&common, context.message), 1;
        ok = frame_create(&f, context.get_proc, size[0], size[1], &common.threads) && frame_save(&f, frames, &common);
        if (ok && common.stats) printf("%s\n%s\n", gl_context_renderer(&context), frame_times(&f, text, sizeof text));
        frame_destroy(&f);
        gl_context_close(&context);
    } else {
#ifdef HAVE_GLFW
        ok = frame_window(&f, size[0], size[1], &common);
#else
        common_say(&common, "compiled without GLFW: no window, but --out FILE works");
#endif
    }
    if (f.message[0]) common_say(&common, f.message);
    common_close(&common);
    return !ok;
}
#endif
