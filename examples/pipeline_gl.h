/* pipeline_gl.h - stages of pipeline.h on OpenGL, by public calls only.  SPDX-License-Identifier: MIT-0 OR Unlicense

   The scene comes from a rasteriser on the CPU, so its layers are uploaded, and what fiv.h and ssao_sat.h make of them
   is read back for the CPU's colours: once while the scene stands still. The picture is uploaded when it changes; from
   there on a frame stays on the GPU: rain falls into a copy, tonemap.h reads that by name, and 8-bit codes come back.
   gl_frame.c does without any copy. Unlike the headers these functions leave textures and framebuffers bound. */

#ifndef PIPELINE_GL_H
#define PIPELINE_GL_H

#include "../fiv.h"
#include "../raindrop.h"
#include "../ssao_sat.h"
#include "../tonemap.h"
#include "gl_tools.h"

typedef struct pipeline_gl {
    gl_tools t;
    sat_gl_get_proc *get_proc;
    int width, height;                  /* of the picture */
    unsigned dry, hdr, depth, screen;   /* textures of the picture's size, but for the codes the bottom row first */
    unsigned dry_buffer, hdr_buffer;    /* framebuffers of dry; of hdr and depth */
    unsigned scene_depth, scene_normals, scene_points; /* textures of the scene's size, 0 until they are needed */
    tonemap_gl *tone;
    raindrop_gl *rain;
    const raindrop_environment *environment; /* what `rain` was given */
    const raindrop_rain *drops;
    fiv_gl *shadows;
    ssao_sat_gl *ao;
    float *rows;                        /* the picture as RGBA */
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
    const char *missing;
    *out = g;
    if (!g) return 0;
    g->get_proc = get_proc, g->width = width, g->height = height;
    g->rows = (float *)malloc((size_t)width * (size_t)height * 4 * sizeof(float));
    if (!g->rows) return pipeline_gl_check(g, SAT_ERR_MEMORY, "");
    if ((missing = gl_tools_load(&g->t, get_proc)) != NULL) return pipeline_gl_check(g, SAT_ERR_GL_FUNCTION, missing);
    g->dry = gl_tools_texture(&g->t, GL_TOOLS_RGBA32F, width, height, 0, NULL);
    g->hdr = gl_tools_texture(&g->t, GL_TOOLS_RGBA32F, width, height, 0, NULL);
    g->depth = gl_tools_texture(&g->t, GL_TOOLS_DEPTH32F, width, height, 0, NULL);
    g->screen = gl_tools_texture(&g->t, GL_TOOLS_RGBA8, width, height, 0, NULL);
    g->dry_buffer = gl_tools_framebuffer(&g->t, g->dry, 0, 0);
    g->hdr_buffer = gl_tools_framebuffer(&g->t, g->hdr, 0, g->depth);
    return pipeline_gl_check(g, g->t.GetError() ? SAT_ERR_GL_STATE : SAT_OK, "textures of the picture's size");
}

static inline void pipeline_gl_destroy(pipeline_gl *g)
{
    if (!g) return;
    tonemap_gl_destroy(g->tone);
    raindrop_gl_destroy(g->rain);
    ssao_sat_gl_destroy(g->ao);
    fiv_gl_destroy(g->shadows);
    if (g->hdr_buffer) {
        const unsigned textures[7] = {g->dry,         g->hdr,           g->depth,       g->screen,
                                      g->scene_depth, g->scene_normals, g->scene_points};
        const unsigned framebuffers[2] = {g->dry_buffer, g->hdr_buffer};
        g->t.DeleteFramebuffers(2, framebuffers);
        g->t.DeleteTextures(7, textures);
    }
    free(g->rows);
    free(g);
}

static inline void pipeline_gl_send(pipeline_gl *g, unsigned *texture, unsigned internal, int width, int height,
                                    const float *pixels)
{
    if (!*texture) *texture = gl_tools_texture(&g->t, internal, width, height, 0, NULL);
    gl_tools_upload(&g->t, *texture, internal, width, height, pixels);
}

/* ---- shadows, of the scene's size */

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
    pipeline_gl_send(g, &g->scene_points, GL_TOOLS_RGBA32F, width, height, rgba);
    pipeline_gl_send(g, &g->scene_normals, GL_TOOLS_RGB32F, width, height, normals);
    if (result == SAT_OK) result = fiv_gl_irradiance(g->shadows, NULL, g->scene_points, g->scene_normals, NULL);
    if (!pipeline_gl_check(g, result, fiv_gl_message(g->shadows))) return 0;
    gl_tools_read_texture(&g->t, rgba, fiv_gl_texture(g->shadows), GL_TOOLS_RGBA32F, width, height);
    return 1;
}

/* ---- ambient occlusion, of the scene's size */

static inline int pipeline_gl_occlusion(pipeline_gl *g, float *open, const ssao_sat_input *input,
                                        const ssao_sat_options *options)
{
    sat_result result;
    if (g->ao) result = ssao_sat_gl_set_options(g->ao, options);
    else result = ssao_sat_gl_create(&g->ao, g->get_proc, input->width, input->height, options);
    pipeline_gl_send(g, &g->scene_depth, GL_TOOLS_R32F, input->width, input->height, input->depth);
    pipeline_gl_send(g, &g->scene_normals, GL_TOOLS_RGB32F, input->width, input->height, input->normals);
    if (result == SAT_OK) result = ssao_sat_gl_apply(g->ao, NULL, g->scene_depth, g->scene_normals, input);
    if (!pipeline_gl_check(g, result, ssao_sat_gl_message(g->ao))) return 0;
    gl_tools_read_texture(&g->t, open, ssao_sat_gl_texture(g->ao), GL_TOOLS_R32F, input->width, input->height);
    return 1;
}

/* ---- the picture: uploaded when it is a new one, and a copy of it for the rain */

/* OpenGL's usual perspective; of the picture only the depth counts. */
static inline void pipeline_gl_projection(float p[16])
{
    const float near_plane = 0.08f, far_plane = 1000;
    memset(p, 0, 16 * sizeof *p);
    p[10] = -(far_plane + near_plane) / (far_plane - near_plane), p[11] = -1;
    p[14] = -2 * far_plane * near_plane / (far_plane - near_plane);
}

static inline void pipeline_gl_picture(pipeline_gl *g, const float *rgb, const float *depth, int is_new)
{
    float p[16];
    size_t w = (size_t)g->width, h = (size_t)g->height, x, y;
    pipeline_gl_projection(p);
    for (y = 0; is_new && y < h; ++y)
        for (x = 0; x < w; ++x) {
            memcpy(g->rows + 4 * (y * w + x), rgb + 3 * ((h - 1 - y) * w + x), 3 * sizeof(float));
            g->rows[4 * (y * w + x) + 3] = 1;
        }
    if (is_new) gl_tools_upload(&g->t, g->dry, GL_TOOLS_RGBA32F, g->width, g->height, g->rows);
    for (y = 0; is_new && y < h; ++y)
        for (x = 0; x < w; ++x) {
            float z = depth[(h - 1 - y) * w + x], d = z > 0.08f && z < 1000 ? 0.5f + 0.5f * (p[14] / z - p[10]) : 1;
            g->rows[y * w + x] = d;
        }
    if (is_new) gl_tools_upload(&g->t, g->depth, GL_TOOLS_DEPTH32F, g->width, g->height, g->rows);
    g->t.BindFramebuffer(GL_TOOLS_READ_FRAMEBUFFER, g->dry_buffer);
    g->t.BindFramebuffer(GL_TOOLS_DRAW_FRAMEBUFFER, g->hdr_buffer);
    g->t.BlitFramebuffer(0, 0, g->width, g->height, 0, 0, g->width, g->height, GL_TOOLS_COLOR_BUFFER_BIT, 0x2600);
}

/* What tonemap.h reads, the top row first. */
static inline void pipeline_gl_read(pipeline_gl *g, float *rgb)
{
    size_t w = (size_t)g->width, h = (size_t)g->height, x, y;
    gl_tools_read(&g->t, g->rows, g->hdr_buffer, GL_TOOLS_RGBA32F, g->width, g->height);
    for (y = 0; y < h; ++y)
        for (x = 0; x < w; ++x) memcpy(rgb + 3 * (y * w + x), g->rows + 4 * ((h - 1 - y) * w + x), 3 * sizeof(float));
}

/* ---- rain: falls and is drawn on the GPU, but for the order as on the CPU */

static inline int pipeline_gl_rain(pipeline_gl *g, const raindrop_camera *camera,
                                   const raindrop_environment *environment, const raindrop_rain *rain, double dt)
{
    sat_gl_target to = sat_gl_to_framebuffer(g->hdr_buffer, 0, 0);
    sat_result result = SAT_OK;
    float projection[16];
    pipeline_gl_projection(projection);
    if (!g->rain) result = raindrop_gl_create(&g->rain, g->get_proc, NULL);
    if (result == SAT_OK && g->environment != environment)
        result = raindrop_gl_set_environment(g->rain, g->environment = environment);
    if (result == SAT_OK && g->drops != rain) result = raindrop_gl_set_rain(g->rain, g->drops = rain);
    if (result == SAT_OK) result = raindrop_gl_advance(g->rain, dt);
    if (result == SAT_OK) result = raindrop_gl_render(g->rain, &to, g->width, g->height, camera, projection, NULL);
    return pipeline_gl_check(g, result, raindrop_gl_message(g->rain));
}

/* ---- tone */

static inline int pipeline_gl_tone(pipeline_gl *g, unsigned char *out, const tonemap_options *options, double dt)
{
    sat_gl_target to = sat_gl_to_texture(g->screen);
    unsigned char *bytes = (unsigned char *)g->rows;
    size_t i, pixels = (size_t)g->width * (size_t)g->height;
    sat_result result = SAT_OK;
    to.flip = 1;
    if (g->tone && tonemap_gl_set_options(g->tone, options) != SAT_OK) tonemap_gl_destroy(g->tone), g->tone = NULL;
    if (!g->tone) result = tonemap_gl_create(&g->tone, g->get_proc, g->width, g->height, options);
    if (result == SAT_OK) result = tonemap_gl_apply(g->tone, &to, g->hdr, dt);
    if (!pipeline_gl_check(g, result, tonemap_gl_message(g->tone))) return 0;
    gl_tools_read_texture(&g->t, bytes, g->screen, GL_TOOLS_RGBA8, g->width, g->height);
    for (i = 0; i < pixels; ++i) memcpy(out + 3 * i, bytes + 4 * i, 3);
    return 1;
}

#endif /* PIPELINE_GL_H */
