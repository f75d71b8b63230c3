/* demo_web - the demo in a browser: demo_web.html calls these functions.  SPDX-License-Identifier: MIT-0 OR Unlicense

   `make web` builds it with emscripten into out/web/index.html; without a browser it is a program that draws one frame. */

#define _POSIX_C_SOURCE 200809L
#define LIGHTSCAN_IMPLEMENTATION
#include "pipeline.h"
#ifdef __EMSCRIPTEN__
#include <emscripten.h>
#else
#define EMSCRIPTEN_KEEPALIVE
#endif

static pipeline web;
static pipeline_options wanted;
static image dropped[3]; /* the light of the last picture, that of the next one, and the one being read */
static char message[400];
static unsigned char *rgba;

int web_create(int width, int height, int hour);
int web_set(const char *name, double value);
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
    rgba = (unsigned char *)malloc((size_t)width * (size_t)height * 4);
    if (rgba && pipeline_create(&web, &wanted)) return 1;
    snprintf(message, sizeof message, "%s", rgba ? web.message : "not enough memory");
    return 0;
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

/* Why a call returned 0 or NULL; after web_open what it read. */
EMSCRIPTEN_KEEPALIVE const char *web_message(void) { return message; }

#ifndef __EMSCRIPTEN__
int main(int argc, char **argv)
{
    common_settings common;
    int first = common_parse(&common, argc, argv, "demo_web [--out FILE] [light.hdr]", NULL, 0);
    const char *out = common.out ? common.out : "demo_web.png";
    if ((first < argc && !web_open(argv[first])) || !web_create(640, 360, SCENE_DUSK) || !web_frame(0) || !image_save_u8(out, rgba, 640, 360, 4)) {
        fprintf(stderr, "demo_web: %s\n", message[0] ? message : "the picture cannot be written");
        return 1;
    }
    pipeline_destroy(&web);
    image_free(&dropped[0]), image_free(&dropped[1]), image_free(&dropped[2]);
    free(rgba);
    return 0;
}
#endif
