/* pipeline_gl.h - stages of pipeline.h on OpenGL: upload, the header's passes, read back.
   SPDX-License-Identifier: MIT-0 OR Unlicense

   A renderer that keeps its pictures on the GPU does without both copies. Row 0 is the top of the picture, but for the
   texture that the rain is drawn into, which is as OpenGL has it. Unlike the headers these functions leave a
   framebuffer of their own bound. */

#ifndef PIPELINE_GL_H
#define PIPELINE_GL_H

#ifndef SAT_SIBLING
#define SAT_SIBLING
#endif
#ifndef SAT_SIBLING_GL
#define SAT_SIBLING_GL /* sat.h then lends its function table, textures and framebuffers */
#endif
#include "../fiv.h"
#include "../raindrop.h"
#include "../sat.h"
#include "../ssao_sat.h"
#include "../tonemap.h"

typedef struct pipeline_gl {
    sat__gl gl;
    sat_gl_get_proc *get_proc;
    int width, height;
    unsigned hdr, rainy, depth, framebuffer; /* textures of the picture's size; the last three for the rain */
    tonemap_gl *tone;
    tonemap_options tone_options;            /* what `tone` was made with */
    raindrop_gl *rain;
    const raindrop_environment *environment; /* what `rain` was given */
    const raindrop_rain *drops;
    fiv_gl *shadows;
    ssao_sat_gl *ao;
    double ao_radius;                        /* what `ao` was made with */
    unsigned scene_depth, scene_normals, scene_points; /* textures of the scene's size */
    float *rows;                             /* the picture as RGBA */
    char message[320];
} pipeline_gl;

static inline int pipeline_gl_check(pipeline_gl *g, sat_result result, const char *message)
{
    if (result != SAT_OK) snprintf(g->message, sizeof g->message, "%s: %.200s", sat_result_text(result), message);
    return result == SAT_OK;
}

/* 1, or 0 with *out->message (or *out NULL when there is no memory at all). */
static inline int pipeline_gl_create(pipeline_gl **out, sat_gl_get_proc *get_proc, int width, int height)
{
    pipeline_gl *g = (pipeline_gl *)calloc(1, sizeof *g);
    sat_result result;
    *out = g;
    if (!g) return 0;
    g->get_proc = get_proc, g->width = width, g->height = height;
    g->rows = (float *)malloc((size_t)width * (size_t)height * 4 * sizeof(float));
    result = g->rows ? sat__gl_open(&g->gl, get_proc) : SAT_ERR_MEMORY;
    if (result == SAT_OK) result = sat__gl_texture(&g->gl, &g->hdr, SAT__GL_RGBA32F, width, height, NULL);
    if (result == SAT_OK) result = sat__gl_texture(&g->gl, &g->rainy, SAT__GL_RGBA32F, width, height, NULL);
    if (result == SAT_OK) result = sat__gl_texture(&g->gl, &g->depth, SAT__GL_DEPTH_COMPONENT32F, width, height, NULL);
    if (result == SAT_OK) result = sat__gl_framebuffer(&g->gl, &g->framebuffer, &g->rainy, 1, g->depth);
    return pipeline_gl_check(g, result, g->gl.message);
}

static inline void pipeline_gl_destroy(pipeline_gl *g)
{
    if (!g) return;
    tonemap_gl_destroy(g->tone);
    raindrop_gl_destroy(g->rain);
    ssao_sat_gl_destroy(g->ao);
    fiv_gl_destroy(g->shadows);
    if (g->framebuffer) g->gl.DeleteFramebuffers(1, &g->framebuffer);
    if (g->hdr) g->gl.DeleteTextures(1, &g->hdr);
    if (g->rainy) g->gl.DeleteTextures(1, &g->rainy);
    if (g->depth) g->gl.DeleteTextures(1, &g->depth);
    if (g->scene_depth) g->gl.DeleteTextures(1, &g->scene_depth);
    if (g->scene_normals) g->gl.DeleteTextures(1, &g->scene_normals);
    if (g->scene_points) g->gl.DeleteTextures(1, &g->scene_points);
    sat__gl_close(&g->gl);
    free(g->rows);
    free(g);
}

/* RGB rows from or to the RGBA rows, which may be upside down. */
static inline void pipeline_gl_copy(pipeline_gl *g, float *rgb, int to_rgba, int flip)
{
    int x, y, k;
    for (y = 0; y < g->height; ++y)
        for (x = 0; x < g->width; ++x) {
            float *a = rgb + 3 * ((size_t)y * (size_t)g->width + (size_t)x);
            float *b = g->rows + 4 * ((size_t)(flip ? g->height - 1 - y : y) * (size_t)g->width + (size_t)x);
            for (k = 0; k < 3; ++k)
                if (to_rgba) b[k] = a[k];
                else a[k] = b[k];
            if (to_rgba) b[3] = 1;
        }
}

/* ---- shadows, of the scene's size ---- */

/* rgba: points whose alpha says what they lie on, as fiv_gl_irradiance has it; then the result. Pixels whose normal is
   0 are black. */
static inline int pipeline_gl_shadows(pipeline_gl *g, float *rgba, const float *normals, int width, int height,
                                      const fiv_environment *light, const fiv_instance *casters, size_t count)
{
    fiv_gl_options options = fiv_gl_defaults();
    sat_result result = SAT_OK;
    options.self = 1;
    if (!g->shadows) result = fiv_gl_create(&g->shadows, g->get_proc, width, height, &options);
    if (result == SAT_OK) result = fiv_gl_set_scene(g->shadows, light, casters, count);
    if (!pipeline_gl_check(g, result, g->shadows ? fiv_gl_message(g->shadows) : "")) return 0;
    if (!g->scene_points) result = sat__gl_texture(&g->gl, &g->scene_points, SAT__GL_RGBA32F, width, height, NULL);
    if (result == SAT_OK && !g->scene_normals)
        result = sat__gl_texture(&g->gl, &g->scene_normals, SAT__GL_RGB32F, width, height, NULL);
    if (!pipeline_gl_check(g, result, g->gl.message)) return 0;
    sat__gl_upload(&g->gl, g->scene_points, SAT__GL_RGBA32F, width, height, rgba);
    sat__gl_upload(&g->gl, g->scene_normals, SAT__GL_RGB32F, width, height, normals);
    if (!pipeline_gl_check(g, fiv_gl_irradiance(g->shadows, g->scene_points, g->scene_normals),
                           fiv_gl_message(g->shadows)))
        return 0;
    return pipeline_gl_check(g, sat__gl_read(&g->gl, rgba, fiv_gl_texture(g->shadows), SAT__GL_RGBA32F, width, height),
                             g->gl.message);
}

/* ---- ambient occlusion, of the scene's size ---- */

static inline int pipeline_gl_occlusion(pipeline_gl *g, float *open, const ssao_sat_input *input,
                                        const ssao_sat_options *options)
{
    sat_result result = SAT_OK;
    if (g->ao && g->ao_radius != options->radius) ssao_sat_gl_destroy(g->ao), g->ao = NULL;
    if (!g->ao) result = ssao_sat_gl_create(&g->ao, g->get_proc, input->width, input->height, options);
    g->ao_radius = options->radius;
    if (!pipeline_gl_check(g, result, g->ao ? ssao_sat_gl_message(g->ao) : "")) return 0;
    if (!g->scene_depth)
        result = sat__gl_texture(&g->gl, &g->scene_depth, SAT__GL_R32F, input->width, input->height, NULL);
    if (result == SAT_OK && !g->scene_normals)
        result = sat__gl_texture(&g->gl, &g->scene_normals, SAT__GL_RGB32F, input->width, input->height, NULL);
    if (!pipeline_gl_check(g, result, g->gl.message)) return 0;
    sat__gl_upload(&g->gl, g->scene_depth, SAT__GL_R32F, input->width, input->height, input->depth);
    sat__gl_upload(&g->gl, g->scene_normals, SAT__GL_RGB32F, input->width, input->height, input->normals);
    result = ssao_sat_gl_apply(g->ao, 0, g->scene_depth, g->scene_normals, input);
    if (!pipeline_gl_check(g, result, ssao_sat_gl_message(g->ao))) return 0;
    return pipeline_gl_check(
        g, sat__gl_read(&g->gl, open, ssao_sat_gl_texture(g->ao), SAT__GL_R32F, input->width, input->height),
        g->gl.message);
}

/* ---- rain: falls and is drawn on the GPU, but for the order as on the CPU ---- */

/* Window depth of the usual perspective, upside down, into the depth texture. */
static inline void pipeline_gl_depth(pipeline_gl *g, const float *depth, float near, float far)
{
    int x, y;
    for (y = 0; y < g->height; ++y)
        for (x = 0; x < g->width; ++x) {
            float z = depth[(size_t)(g->height - 1 - y) * (size_t)g->width + (size_t)x];
            g->rows[(size_t)y * (size_t)g->width + (size_t)x] =
                z > near && z < far ? (1 / near - 1 / z) / (1 / near - 1 / far) : 1;
        }
    sat__gl_upload(&g->gl, g->depth, SAT__GL_DEPTH_COMPONENT32F, g->width, g->height, g->rows);
}

static inline int pipeline_gl_rain(pipeline_gl *g, float *rgb, const float *depth, const raindrop_camera *camera,
                                   const raindrop_environment *environment, const raindrop_rain *rain, double dt)
{
    raindrop_gl_options options = raindrop_gl_defaults();
    sat_result result = SAT_OK;
    raindrop_camera eye = *camera;
    eye.depth_far = 1000;
    options.quads = 1;
    if (!g->rain) result = raindrop_gl_create(&g->rain, g->get_proc, &options);
    if (result == SAT_OK && g->environment != environment)
        result = raindrop_gl_set_environment(g->rain, g->environment = environment);
    if (result == SAT_OK && g->drops != rain) result = raindrop_gl_set_rain(g->rain, g->drops = rain);
    if (result == SAT_OK) result = raindrop_gl_advance(g->rain, dt);
    pipeline_gl_depth(g, depth, eye.depth_near, eye.depth_far);
    pipeline_gl_copy(g, rgb, 1, 1);
    sat__gl_upload(&g->gl, g->rainy, SAT__GL_RGBA32F, g->width, g->height, g->rows);
    g->gl.BindFramebuffer(SAT__GL_FRAMEBUFFER, g->framebuffer);
    g->gl.Viewport(0, 0, g->width, g->height);
    if (result == SAT_OK) result = raindrop_gl_render(g->rain, g->width, g->height, &eye, NULL);
    if (!pipeline_gl_check(g, result, g->rain ? raindrop_gl_message(g->rain) : "")) return 0;
    result = sat__gl_read(&g->gl, g->rows, g->rainy, SAT__GL_RGBA32F, g->width, g->height);
    pipeline_gl_copy(g, rgb, 0, 1);
    return pipeline_gl_check(g, result, g->gl.message);
}

/* ---- tone ---- */

static inline int pipeline_gl_tone(pipeline_gl *g, unsigned char *out, float *rgb, const tonemap_options *options,
                                   double dt)
{
    unsigned char *bytes = (unsigned char *)g->rows;
    size_t i, pixels = (size_t)g->width * (size_t)g->height;
    sat_result result = SAT_OK;
    if (g->tone && memcmp(&g->tone_options, options, sizeof *options) != 0) tonemap_gl_destroy(g->tone), g->tone = NULL;
    if (!g->tone) result = tonemap_gl_create(&g->tone, g->get_proc, g->width, g->height, options);
    memcpy(&g->tone_options, options, sizeof *options);
    pipeline_gl_copy(g, rgb, 1, 0);
    sat__gl_upload(&g->gl, g->hdr, SAT__GL_RGBA32F, g->width, g->height, g->rows);
    if (result == SAT_OK) result = tonemap_gl_apply(g->tone, 0, g->hdr, dt);
    if (!pipeline_gl_check(g, result, g->tone ? tonemap_gl_message(g->tone) : "")) return 0;
    result = sat__gl_read(&g->gl, bytes, tonemap_gl_texture(g->tone), SAT__GL_RGBA8, g->width, g->height);
    for (i = 0; i < pixels; ++i) memcpy(out + 3 * i, bytes + 4 * i, 3);
    return pipeline_gl_check(g, result, g->gl.message);
}

#endif /* PIPELINE_GL_H */
