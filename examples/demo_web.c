/* demo_web - the demo in a browser: demo_web.html calls these functions.  SPDX-License-Identifier: MIT-0 OR Unlicense

   `make web` builds it with emscripten into out/web/index.html; without a browser it is a program that draws one
   frame. */

#define _POSIX_C_SOURCE 200809L
#define LIGHTSCAN_IMPLEMENTATION
#ifdef __EMSCRIPTEN__
#define PIPELINE_GL
#define FIV_GL
#define RAINDROP_GL
#define SSAO_SAT_GL
#define TONEMAP_GL
#include <emscripten.h>
#include <emscripten/html5_webgl.h>
#else
#define EMSCRIPTEN_KEEPALIVE
#endif
#include "pipeline.h"

static pipeline web;
static pipeline_options wanted;
static image dropped[3]; /* the light of the last picture, that of the next one, and the one being read */
static char message[400];
static unsigned char *rgba;

int web_create(int width, int height, int hour);
int web_prepare(void);
int web_photo_open(const char *path);
int web_photo_size(int side);
int web_photo_set(const char *name, double value);
const unsigned char *web_photo(void);
int web_set(const char *name, double value);
int web_use_gl(int on);
int web_open(const char *path);
const char *web_formats(void);
const unsigned char *web_frame(double dt);
const char *web_message(void);

EMSCRIPTEN_KEEPALIVE int web_create(int width, int height, int hour)
{
    const image *light = wanted.environment;
    wanted = pipeline_defaults();
    wanted.environment = light;
    wanted.width = width, wanted.height = height, wanted.samples = 1;
    wanted.hour = (scene_hour)(hour % 3);
    wanted.shadows = 0; /* until web_prepare */
    rgba = (unsigned char *)malloc((size_t)width * (size_t)height * 4);
    if (rgba && pipeline_create(&web, &wanted)) return 1;
    snprintf(message, sizeof message, "%s", rgba ? web.message : "not enough memory");
    return 0;
}

/* The masks of one more sculpture: how many are left, -1 when something failed. With the last one shadows begin. */
EMSCRIPTEN_KEEPALIVE int web_prepare(void)
{
    int i, left = 0;
    if (!pipeline_next_mask(&web)) {
        snprintf(message, sizeof message, "%s", web.message);
        return -1;
    }
    for (i = 0; i < SCENE_OBJECTS; ++i) left += !web.occluders[i];
    if (left == 0) wanted.shadows = 1;
    return left;
}

/* 0: there is no such option. */
EMSCRIPTEN_KEEPALIVE int web_set(const char *name, double value)
{
    if (strcmp(name, "hour") == 0) wanted.hour = (scene_hour)((int)value % 3), wanted.environment = NULL;
    else if (strcmp(name, "turn") == 0) wanted.turn = (float)value;
    else if (strcmp(name, "rate") == 0) wanted.rate = (float)value;
    else if (strcmp(name, "reach") == 0) wanted.ao_radius = (float)value;
    else if (strcmp(name, "operator") == 0) wanted.operation = (tonemap_operator)(int)value;
    else if (strcmp(name, "mesopic") == 0) wanted.mesopic = (tonemap_mesopic)(int)value;
    else if (strcmp(name, "key") == 0) wanted.key = (float)value;
    else if (strcmp(name, "exposure") == 0) wanted.exposure = (float)value;
    else if (strcmp(name, "shadows") == 0) wanted.shadows = value != 0;
    else if (strcmp(name, "occlusion") == 0) wanted.occlusion = value != 0;
    else if (strcmp(name, "rain") == 0) wanted.rain = value != 0;
    else if (strcmp(name, "tone") == 0) wanted.tone = value != 0;
    else return 0;
    return 1;
}

#ifdef __EMSCRIPTEN__
typedef void web_function(void);
static web_function *web_get_proc(const char *name)
{
    void *function = emscripten_webgl2_get_proc_address(name); /* what WebGL 1 has too is not among them */
    return (web_function *)(function ? function : emscripten_webgl1_get_proc_address(name));
}

/* From the next picture on every stage by WebGL 2, on the canvas #stages; 0 when the browser has not what that
   needs. */
EMSCRIPTEN_KEEPALIVE int web_use_gl(int on)
{
    static EMSCRIPTEN_WEBGL_CONTEXT_HANDLE context;
    EmscriptenWebGLContextAttributes attributes;
    emscripten_webgl_init_context_attributes(&attributes);
    attributes.majorVersion = 2;
    if (on && context <= 0) context = emscripten_webgl_create_context("#stages", &attributes);
    if (on && (context <= 0 || emscripten_webgl_make_context_current(context) != EMSCRIPTEN_RESULT_SUCCESS ||
               !emscripten_webgl_enable_extension(context, "EXT_color_buffer_float") ||
               !emscripten_webgl_enable_extension(context, "EXT_float_blend"))) {
        snprintf(message, sizeof message, "this browser has no WebGL 2 with EXT_color_buffer_float and EXT_float_blend");
        return 0;
    }
    wanted.get_proc = on ? web_get_proc : NULL;
    return 1;
}
#endif

/* What web_open reads. */
EMSCRIPTEN_KEEPALIVE const char *web_formats(void)
{
    return
#ifdef HAVE_OPENEXR
        ".exr "
#endif
#ifdef HAVE_STB
        ".hdr .png .jpg "
#endif
        ".pfm";
}

/* A picture of the light, all directions by longitude and latitude, from the file system. */
EMSCRIPTEN_KEEPALIVE int web_open(const char *path)
{
    image *next = dropped;
    while (next == wanted.environment || next == web.options.environment) ++next;
    image_free(next);
    if (!image_load(next, path)) {
        snprintf(message, sizeof message, "%s", next->message);
        return 0;
    }
    snprintf(message, sizeof message, "light: %.180s, %d x %d", path, next->width, next->height);
    wanted.environment = next;
    return 1;
}

/* The next picture, RGBA; NULL when something failed. */
EMSCRIPTEN_KEEPALIVE const unsigned char *web_frame(double dt)
{
    size_t i, pixels = (size_t)wanted.width * (size_t)wanted.height;
    if (!pipeline_change(&web, &wanted) || !pipeline_frame(&web, dt)) {
        snprintf(message, sizeof message, "%s", web.message);
        return NULL;
    }
    for (i = 0; i < pixels; ++i) {
        memcpy(rgba + 4 * i, web.pixels + 3 * i, 3);
        rgba[4 * i + 3] = 255;
    }
    return rgba;
}

/* ---- a photograph, tone-mapped ---- */

static image photo;
static tonemap_options photo_options;
static unsigned char *photo_rgba;

/* Any picture that web_formats names. */
EMSCRIPTEN_KEEPALIVE int web_photo_open(const char *path)
{
    image next;
    if (!image_load(&next, path)) {
        snprintf(message, sizeof message, "%s", next.message);
        return 0;
    }
    if (!photo.pixels) photo_options = tonemap_defaults();
    image_free(&photo);
    free(photo_rgba);
    photo = next;
    photo_rgba = (unsigned char *)malloc((size_t)photo.width * (size_t)photo.height * 4);
    snprintf(message, sizeof message, "%.180s, %d x %d", path, photo.width, photo.height);
    return photo_rgba != NULL;
}

/* 0: width; 1: height. */
EMSCRIPTEN_KEEPALIVE int web_photo_size(int side) { return side ? photo.height : photo.width; }

/* 0: there is no such option. */
EMSCRIPTEN_KEEPALIVE int web_photo_set(const char *name, double value)
{
    if (strcmp(name, "operator") == 0) photo_options.operation = (tonemap_operator)(int)value;
    else if (strcmp(name, "mesopic") == 0) photo_options.mesopic = (tonemap_mesopic)(int)value;
    else if (strcmp(name, "key") == 0) photo_options.key = value;
    else if (strcmp(name, "burn") == 0) photo_options.white = value > 0 ? value : (double)INFINITY;
    else if (strcmp(name, "gamut") == 0) photo_options.gamut = value;
    else if (strcmp(name, "scales") == 0) photo_options.scales = (int)value;
    else return 0;
    return 1;
}

/* The photograph for the screen, RGBA; NULL when something failed. */
EMSCRIPTEN_KEEPALIVE const unsigned char *web_photo(void)
{
    size_t i, pixels = (size_t)photo.width * (size_t)photo.height;
    if (!photo.pixels ||
        tonemap_once_u8(photo_rgba, photo.pixels, photo.width, photo.height, 3, &photo_options) != SAT_OK) {
        if (photo.pixels) tonemap_explain(message, sizeof message, photo.width, photo.height, &photo_options);
        return NULL;
    }
    for (i = pixels; i-- > 0;) { /* three bytes become four, from behind */
        photo_rgba[4 * i + 3] = 255;
        photo_rgba[4 * i + 2] = photo_rgba[3 * i + 2];
        photo_rgba[4 * i + 1] = photo_rgba[3 * i + 1];
        photo_rgba[4 * i] = photo_rgba[3 * i];
    }
    return photo_rgba;
}

/* Why a call returned 0 or NULL; after web_open what it read. */
EMSCRIPTEN_KEEPALIVE const char *web_message(void) { return message; }

#ifndef __EMSCRIPTEN__
int main(int argc, char **argv)
{
    const char *light = NULL;
    int ok;
    const common_option options[] = {{"env", 'P', (void *)&light, 0, 0, "equirectangular picture of the light; without it a sky of our own"}};
    common_settings common;
    common_parse(&common, argc, argv, "demo_web", ".png", options, 1);
    ok = ((!light || web_open(light)) && web_create(640, 360, SCENE_DUSK) && web_prepare() == 1 && web_prepare() == 0 &&
          web_frame(0)) ||
         common_say(&common, message);
    ok = ok && common_save_u8(&common, common.out, rgba, 640, 360, 4);
    pipeline_destroy(&web);
    image_free(&dropped[0]), image_free(&dropped[1]), image_free(&dropped[2]);
    free(rgba), free(photo_rgba);
    image_free(&photo);
    common_close(&common);
    return !ok;
}
#endif
