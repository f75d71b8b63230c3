/* demo_view - the demo in a window, with keys for its options.      SPDX-License-Identifier: MIT-0 OR Unlicense

       demo_view                                      640x360; F1 shows the keys
       demo_view --size 960x540 --hour night --gl
       demo_view --frames 3 --out shot.png            a picture of the window after three frames

   Needs GLFW 3 and OpenGL 3.3. */

#define _POSIX_C_SOURCE 200809L
#define LIGHTSCAN_IMPLEMENTATION
#define PIPELINE_GL
#define FIV_GL
#define RAINDROP_GL
#define SSAO_SAT_GL
#define TONEMAP_GL
#include "pipeline.h"
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

/* ---- a picture into the window: a texture, copied by glBlitFramebuffer ---- */

#if defined(_WIN32)
#define VIEW_CALL __stdcall
#else
#define VIEW_CALL
#endif
#define VIEW_FUNCTIONS(X)                                                                          \
    X(void, GenTextures, (int, unsigned *))                                                        \
    X(void, BindTexture, (unsigned, unsigned))                                                     \
    X(void, PixelStorei, (unsigned, int))                                                          \
    X(void, TexImage2D, (unsigned, int, int, int, int, int, unsigned, unsigned, const void *))     \
    X(void, GenFramebuffers, (int, unsigned *))                                                    \
    X(void, BindFramebuffer, (unsigned, unsigned))                                                 \
    X(void, FramebufferTexture2D, (unsigned, unsigned, unsigned, unsigned, int))                   \
    X(void, BlitFramebuffer, (int, int, int, int, int, int, int, int, unsigned, unsigned))         \
    X(void, ReadPixels, (int, int, int, int, unsigned, unsigned, void *))
#define VIEW_MEMBER(result, name, arguments) result(VIEW_CALL *name) arguments;
#define VIEW_LOAD(result, name, arguments)                                                         \
    proc = glfwGetProcAddress("gl" #name);                                                         \
    memcpy(&v->name, &proc, sizeof proc);                                                          \
    if (!proc) return 0;
enum {
    VIEW_TEXTURE_2D = 0x0DE1,
    VIEW_RGB = 0x1907,
    VIEW_UNSIGNED_BYTE = 0x1401,
    VIEW_UNPACK_ALIGNMENT = 0x0CF5,
    VIEW_PACK_ALIGNMENT = 0x0D05,
    VIEW_READ_FRAMEBUFFER = 0x8CA8,
    VIEW_FRAMEBUFFER = 0x8D40,
    VIEW_COLOR_ATTACHMENT0 = 0x8CE0,
    VIEW_COLOR_BUFFER_BIT = 0x4000,
    VIEW_LINEAR = 0x2601
};

typedef struct view {
    VIEW_FUNCTIONS(VIEW_MEMBER)
    GLFWwindow *window;
    unsigned texture, framebuffer;
    pipeline p;
    pipeline_options wanted;
    int help, paused, quit, split; /* split: 0, or the stage that the left of the mouse is without */
    unsigned char *before;
    const common_settings *common;
} view;

static int view_load(view *v)
{
    GLFWglproc proc;
    VIEW_FUNCTIONS(VIEW_LOAD)
    v->GenTextures(1, &v->texture);
    v->GenFramebuffers(1, &v->framebuffer);
    v->PixelStorei(VIEW_UNPACK_ALIGNMENT, 1);
    v->PixelStorei(VIEW_PACK_ALIGNMENT, 1);
    return 1;
}

static void view_show(view *v)
{
    int width, height, w = v->p.options.width, h = v->p.options.height;
    glfwGetFramebufferSize(v->window, &width, &height);
    v->BindFramebuffer(VIEW_FRAMEBUFFER, 0);
    v->BindTexture(VIEW_TEXTURE_2D, v->texture);
    v->TexImage2D(VIEW_TEXTURE_2D, 0, VIEW_RGB, w, h, 0, VIEW_RGB, VIEW_UNSIGNED_BYTE, v->p.pixels);
    v->BindFramebuffer(VIEW_READ_FRAMEBUFFER, v->framebuffer);
    v->FramebufferTexture2D(VIEW_READ_FRAMEBUFFER, VIEW_COLOR_ATTACHMENT0, VIEW_TEXTURE_2D, v->texture, 0);
    v->BlitFramebuffer(0, 0, w, h, 0, height, width, 0, VIEW_COLOR_BUFFER_BIT, VIEW_LINEAR); /* row 0 is on top */
    v->BindFramebuffer(VIEW_READ_FRAMEBUFFER, 0);
}

/* What the window shows, as a PNG. */
static int view_shot(view *v, const char *path)
{
    int width, height, y, ok;
    unsigned char *pixels, *flipped;
    size_t row;
    glfwGetFramebufferSize(v->window, &width, &height);
    row = (size_t)width * 3;
    pixels = (unsigned char *)malloc(2 * row * (size_t)height);
    if (!pixels) return common_say(v->common, "no memory");
    flipped = pixels + row * (size_t)height;
    v->ReadPixels(0, 0, width, height, VIEW_RGB, VIEW_UNSIGNED_BYTE, pixels);
    for (y = 0; y < height; ++y) memcpy(flipped + row * (size_t)y, pixels + row * (size_t)(height - 1 - y), row);
    ok = common_save_u8(v->common, path, flipped, width, height, 3);
    free(pixels);
    return ok;
}

/* ---- before and after: left of the mouse the picture lacks a stage ---- */

enum { VIEW_SPLITS = 5 };
static const char *const view_splits[VIEW_SPLITS] = {"", "shadows", "occlusion", "rain", "tone"};

static int *view_stage(pipeline_options *o, int split)
{
    return split == 1 ? &o->shadows : split == 2 ? &o->occlusion : split == 3 ? &o->rain : &o->tone;
}

/* The picture without the stage; time stands still for it. */
static int view_without(view *v)
{
    pipeline_options less = v->wanted;
    size_t bytes = (size_t)less.width * (size_t)less.height * 3;
    if (!v->split) return 1;
    if (!v->before) v->before = (unsigned char *)malloc(bytes);
    if (!v->before) return 1;
    *view_stage(&less, v->split) = 0;
    if (!pipeline_change(&v->p, &less) || !pipeline_frame(&v->p, 0)) return 0;
    memcpy(v->before, v->p.pixels, bytes);
    return 1;
}

static void view_part(view *v)
{
    int width, height, y, at, w = v->p.options.width;
    double mouse, mouse_y;
    if (!v->split || !v->before) return;
    glfwGetCursorPos(v->window, &mouse, &mouse_y);
    glfwGetWindowSize(v->window, &width, &height);
    at = mouse > 0 && mouse < width ? (int)(mouse * w / width) : w / 2;
    for (y = 0; y < v->p.options.height; ++y) {
        size_t row = (size_t)y * (size_t)w * 3;
        memcpy(v->p.pixels + row, v->before + row, (size_t)at * 3);
        memset(v->p.pixels + row + 3 * at, 255, 3);
    }
}

/* ---- keys ---- */

static void view_key(GLFWwindow *window, int key, int scan, int action, int modifiers)
{
    view *v = (view *)glfwGetWindowUserPointer(window);
    pipeline_options *o = &v->wanted;
    (void)scan;
    (void)modifiers;
    if (action == GLFW_RELEASE) return;
    switch (key) {
    case GLFW_KEY_ESCAPE: v->quit = 1; break;
    case GLFW_KEY_F1: v->help = !v->help; break;
    case GLFW_KEY_SPACE: v->paused = !v->paused; break;
    case GLFW_KEY_G: o->get_proc = o->get_proc ? NULL : glfwGetProcAddress; break;
    case GLFW_KEY_S: o->shadows = !o->shadows; break;
    case GLFW_KEY_O: o->occlusion = !o->occlusion; break;
    case GLFW_KEY_R: o->rain = !o->rain; break;
    case GLFW_KEY_T: o->tone = !o->tone; break;
    case GLFW_KEY_B: v->split = (v->split + 1) % VIEW_SPLITS; break;
    case GLFW_KEY_H: o->hour = (scene_hour)((o->hour + 1) % 3); break;
    case GLFW_KEY_M: o->mesopic = (tonemap_mesopic)((o->mesopic + 1) % 3); break;
    case GLFW_KEY_P: o->operation = (tonemap_operator)((o->operation + 1) % 6); break;
    case GLFW_KEY_LEFT: o->turn -= 10; break;
    case GLFW_KEY_RIGHT: o->turn += 10; break;
    case GLFW_KEY_UP: o->exposure += 0.25f; break;
    case GLFW_KEY_DOWN: o->exposure -= 0.25f; break;
    case GLFW_KEY_PAGE_UP: o->rate = fminf(o->rate * 1.5f, 500); break;
    case GLFW_KEY_PAGE_DOWN: o->rate = fmaxf(o->rate / 1.5f, 1); break;
    case GLFW_KEY_HOME: o->ao_radius = fminf(o->ao_radius * 1.25f, 1); break;
    case GLFW_KEY_END: o->ao_radius = fmaxf(o->ao_radius / 1.25f, 0.01f); break;
    default: break;
    }
}

static void view_overlay(view *v, double seconds)
{
    static const char *const names[] = {"", "", "scene", "shadows", "occlusion", "shade", "rain", "tone"};
    static const char *const keys[] = {"S O R T     shadows, occlusion, rain, tone mapping",
                                       "G H M P     OpenGL, hour, mesopic vision, operator",
                                       "B           before and after: left of the mouse without a stage",
                                       "left right  turn the light",
                                       "up down     exposure",
                                       "page keys   rain",
                                       "home end    reach of occlusion",
                                       "space Esc   pause, quit"};
    common_canvas canvas;
    char text[160];
    size_t i;
    int k, n;
    canvas.rgb = v->p.pixels, canvas.width = v->p.options.width, canvas.height = v->p.options.height;
    for (i = 0; i < (size_t)(v->help ? 120 : 28) * (size_t)canvas.width * 3 &&
                i < (size_t)canvas.height * (size_t)canvas.width * 3;
         ++i)
        canvas.rgb[i] /= 3;
    n = snprintf(text, sizeof text, "%s %.0f ms ", v->p.options.get_proc ? "OpenGL" : "CPU", 1e3 * seconds);
    for (k = PIPELINE_SCENE; k < PIPELINE_STAGES; ++k)
        n += snprintf(text + n, sizeof text - (size_t)n, " %s %.0f", names[k], 1e3 * v->p.seconds[k]);
    common_text(&canvas, 6, 6, text, 1);
    snprintf(text, sizeof text, "%.0f mm/h  reach %.2f m  light %+.0f deg  exposure %+.2f  F1 keys%s%s",
             (double)v->wanted.rate, (double)v->wanted.ao_radius, (double)v->wanted.turn, (double)v->wanted.exposure,
             v->split ? "  left without " : "", view_splits[v->split]);
    common_text(&canvas, 6, 16, text, 1);
    for (i = 0; v->help && i < sizeof keys / sizeof keys[0]; ++i) common_text(&canvas, 6, 32 + 10 * (int)i, keys[i], 1);
}

static int view_loop(view *v, int frames, const char *out)
{
    double last = common_clock(), now, seconds = 0;
    int i, ok = 1;
    for (i = 0; ok && !v->quit && !glfwWindowShouldClose(v->window) && (frames == 0 || i < frames); ++i) {
        ok = view_without(v) && pipeline_change(&v->p, &v->wanted) &&
             pipeline_frame(&v->p, i == 0 || v->paused ? 0 : 1 / 30.0);
        if (!ok) break;
        view_part(v);
        view_overlay(v, seconds);
        view_show(v);
        if (out && i + 1 == frames) ok = view_shot(v, out);
        glfwSwapBuffers(v->window);
        glfwPollEvents();
        now = common_clock();
        seconds = now - last, last = now;
    }
    if (v->p.message[0]) common_say(v->common, v->p.message);
    return ok;
}

static int view_open(view *v)
{
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    v->window = glfwCreateWindow(v->wanted.width, v->wanted.height, "lightscan", NULL, NULL);
    if (!v->window) return 0;
    glfwSetWindowUserPointer(v->window, v);
    glfwSetKeyCallback(v->window, view_key);
    glfwMakeContextCurrent(v->window);
    return view_load(v);
}

int main(int argc, char **argv)
{
    int size[2] = {640, 360}, frames = 0, gl = 0, hour = 0, ok = 0;
    const char *env = NULL, *shape = NULL;
    static view v;
    const common_option options[] = {
        {"env", 'P', (void *)&env, 0, 0, "equirectangular picture of the light; without it a sky of our own"},
        {"mesh", 'M', (void *)&shape, 0, 0, "instead of the knot"},
        {"size", 'z', size, 16, 8192, "of the picture"},
        {"hour", 'w', &hour, 0, 0, "dusk|night|noon"},
        {"gl", 'b', &gl, 0, 0, "on OpenGL; key G"},
        {"split", 'w', &v.split, 0, 0, "off|shadows|occlusion|rain|tone: left of the mouse without it; key B"},
        {"frames", 'i', &frames, 0, 1000000000, "end after so many; 0: go on"},
    };
    common_settings common;
    image light;
    mesh sculpture;
    v.wanted = pipeline_defaults();
    common_parse(&common, argc, argv, "demo_view", "?.png", options, (int)(sizeof options / sizeof options[0]));
    v.common = &common;
    memset(&light, 0, sizeof light);
    memset(&sculpture, 0, sizeof sculpture);
    if (env && !image_load(&light, env)) return common_say(&common, light.message), 1;
    if (shape && !mesh_load(&sculpture, shape)) return common_say(&common, sculpture.message), 1;
    v.wanted.environment = env ? &light : NULL;
    v.wanted.shape = shape ? &sculpture : NULL;
    v.wanted.hour = (scene_hour)hour;
    v.wanted.width = size[0], v.wanted.height = size[1], v.wanted.samples = 1;
    v.wanted.threads = common.threads;
    if (!glfwInit()) return common_say(&common, "there is no display to open a window on"), 1;
    if (!pipeline_create(&v.p, &v.wanted)) common_say(&common, v.p.message);
    else if (!view_open(&v)) common_say(&common, "no window with OpenGL 3.3");
    else {
        if (gl) v.wanted.get_proc = glfwGetProcAddress;
        ok = view_loop(&v, frames, common.out);
    }
    pipeline_destroy(&v.p);
    glfwTerminate();
    free(v.before);
    image_free(&light);
    mesh_free(&sculpture);
    common_close(&common);
    return !ok;
}
