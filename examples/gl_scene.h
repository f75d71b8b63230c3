/* gl_scene.h - a small renderer for gl_frame.c: the sculptures of scene.h on a plane, by OpenGL 3.3 into textures.
   SPDX-License-Identifier: MIT-0 OR Unlicense */

#ifndef GL_SCENE_H
#define GL_SCENE_H

#include "../sat.h"
#include "gl_tools.h"
#include "scene.h"

typedef struct gl_scene {
    gl_tools t;
    int width, height, vertices;
    unsigned colour, normal, depth, hdr, sky; /* textures: RGBA16F but for depth (32F) and the sky's picture */
    unsigned buffers, lit;                    /* framebuffers: colour, normal, depth; hdr, depth */
    unsigned draw, light;                     /* programs */
    unsigned vertex_buffer, vertex_array;
    float projection[16], matrix[16];         /* column-major; OpenGL's usual perspective, and it behind the camera */
    float axes[9], lens[4];                   /* right, up, back; half the picture at distance 1, 2 / its size */
    scene things;                             /* sculptures, camera */
} gl_scene;

static const char gl_scene_draw_vertex[] =
    "#version 330 core\n"
    "layout(location = 0) in vec3 place; layout(location = 1) in vec3 up; layout(location = 2) in vec4 paint;\n"
    "uniform vec4 matrix[4]; out vec3 normal; flat out vec4 colour;\n"
    "void main() { normal = up; colour = paint;\n"
    "    gl_Position = matrix[0] * place.x + matrix[1] * place.y + matrix[2] * place.z + matrix[3]; }\n";
static const char gl_scene_draw_fragment[] =
    "#version 330 core\n"
    "in vec3 normal; flat in vec4 colour; uniform vec3 axes[3];\n"
    "layout(location = 0) out vec4 albedo; layout(location = 1) out vec4 view_normal;\n"
    "void main() { vec3 n = normalize(normal); albedo = vec4(colour.rgb, 1.0);\n"
    "    view_normal = vec4(dot(n, axes[0]), dot(n, axes[1]), dot(n, axes[2]), colour.a); }\n";
static const char gl_scene_light_fragment[] =
    "#version 330 core\n"
    "uniform sampler2D colour, irradiance, open, sky; uniform vec3 axes[3]; uniform vec4 lens; out vec4 radiance;\n"
    "void main() { ivec2 p = ivec2(gl_FragCoord.xy); vec4 c = texelFetch(colour, p, 0);\n"
    "    vec2 at = (gl_FragCoord.xy * lens.zw - 1.0) * lens.xy;\n"
    "    vec3 d = normalize(axes[0] * at.x + axes[1] * at.y - axes[2]);\n"
    "    vec3 above = textureLod(sky, vec2(0.5 + atan(d.x, -d.z) / 6.28318531, acos(d.y) / 3.14159265), 0.0).rgb;\n"
    "    vec3 lit = c.rgb / 3.14159265 * texelFetch(irradiance, p, 0).rgb * texelFetch(open, p, 0).r;\n"
    "    radiance = vec4(c.a > 0.0 ? lit : above, 1.0); }\n";

/* The camera's matrices. */
static inline void gl_scene_look(gl_scene *f)
{
    const raindrop_camera *c = &f->things.camera;
    const float *axes[3] = {c->right, c->up, c->back};
    float near_plane = 0.05f, far_plane = 50, tangent = tanf(0.5f * c->fov_y), *p = f->projection;
    float aspect = (float)f->width / (float)f->height, a = -(far_plane + near_plane) / (far_plane - near_plane);
    float b = -2 * far_plane * near_plane / (far_plane - near_plane);
    int i, k;
    p[0] = 1 / (tangent * aspect), p[5] = 1 / tangent, p[10] = a, p[14] = b, p[11] = -1;
    f->lens[0] = tangent * aspect, f->lens[1] = tangent;
    f->lens[2] = 2 / (float)f->width, f->lens[3] = 2 / (float)f->height;
    for (i = 0; i < 3; ++i) {
        memcpy(f->axes + 3 * i, axes[i], 3 * sizeof(float));
        for (k = 0; k < 3; ++k) f->matrix[4 * k + i] = p[5 * i] * axes[i][k]; /* projection * (turn and shift) */
        f->matrix[12 + i] = -p[5 * i] * scene_dot(axes[i], c->position);
        f->matrix[4 * i + 3] = -c->back[i];
    }
    f->matrix[14] += b, f->matrix[15] = scene_dot(c->back, c->position);
}

/* Places, normals, colours; alpha says what fiv.h has under a pixel: 2 + i object i, 1 the ground. */
static inline int gl_scene_vertices(gl_scene *f)
{
    static const float ground[6][2] = {{-9, 9}, {9, 9}, {9, -9}, {-9, 9}, {9, -9}, {-9, -9}};
    size_t n = 0, j, k, count = 6;
    float *v;
    int i;
    for (i = 0; i < SCENE_OBJECTS; ++i) count += 3 * f->things.objects[i].triangles;
    v = (float *)calloc(count, 10 * sizeof *v);
    if (!v) return 0;
    for (i = 0; i < SCENE_OBJECTS; ++i)
        for (j = 0; j < 3 * f->things.objects[i].triangles; ++j, n += 10) {
            const scene_object *o = &f->things.objects[i];
            for (k = 0; k < 3; ++k) {
                v[n + k] = o->place[k] + o->scale * o->positions[3 * o->indices[j] + k];
                v[n + 3 + k] = o->normals[3 * o->indices[j] + k], v[n + 6 + k] = o->colour[k];
            }
            v[n + 9] = (float)(2 + i);
        }
    for (j = 0; j < 6; ++j, n += 10)
        v[n] = ground[j][0], v[n + 2] = ground[j][1], v[n + 4] = v[n + 9] = 1, v[n + 6] = v[n + 7] = v[n + 8] = 0.3f;
    f->vertices = (int)count;
    f->t.GenVertexArrays(1, &f->vertex_array), f->t.BindVertexArray(f->vertex_array);
    f->t.GenBuffers(1, &f->vertex_buffer), f->t.BindBuffer(GL_TOOLS_ARRAY_BUFFER, f->vertex_buffer);
    f->t.BufferData(GL_TOOLS_ARRAY_BUFFER, (ptrdiff_t)(count * 10 * sizeof *v), v, 0x88E4); /* GL_STATIC_DRAW */
    for (i = 0; i < 3; ++i) {
        f->t.VertexAttribPointer((unsigned)i, i == 2 ? 4 : 3, GL_TOOLS_FLOAT, 0, 40, (const char *)NULL + 12 * i);
        f->t.EnableVertexAttribArray((unsigned)i);
    }
    free(v);
    return 1;
}

/* 1, or 0 with the reason in *why. */
static inline int gl_scene_create(gl_scene *f, sat_gl_get_proc *get_proc, int width, int height, const image *sky,
                                  const char **why)
{
    static const float eye[3] = {0.1f, 0.5f, 1.4f}, target[3] = {0.05f, 0.235f, 0}, up[3] = {0, 1, 0};
    memset(f, 0, sizeof *f);
    f->width = width, f->height = height;
    if ((*why = gl_tools_load(&f->t, get_proc)) != NULL) return 0;
    *why = "not enough memory for the scene";
    if (!scene_make_knot(&f->things.objects[0], 120, 20) || !scene_make_pawn(&f->things.objects[1], 40, 3)) return 0;
    scene_place(&f->things.objects[0], -0.17f, -0.05f, 0.24f, 0.62f, 0.3f, 0.16f, 0.04f);
    scene_place(&f->things.objects[1], 0.3f, 0.06f, 0.23f, 0.66f, 0.64f, 0.58f, 0.04f);
    f->things.camera = raindrop_camera_look(eye, target, up, 0.62f);
    gl_scene_look(f);
    if (!gl_scene_vertices(f)) return 0;
    f->colour = gl_tools_texture(&f->t, GL_TOOLS_RGBA16F, width, height, 0, NULL);
    f->normal = gl_tools_texture(&f->t, GL_TOOLS_RGBA16F, width, height, 0, NULL);
    f->depth = gl_tools_texture(&f->t, GL_TOOLS_DEPTH32F, width, height, 0, NULL);
    f->hdr = gl_tools_texture(&f->t, GL_TOOLS_RGBA16F, width, height, 0, NULL);
    f->sky = gl_tools_texture(&f->t, GL_TOOLS_RGB32F, sky->width, sky->height, 1, sky->pixels);
    f->buffers = gl_tools_framebuffer(&f->t, f->colour, f->normal, f->depth);
    f->lit = gl_tools_framebuffer(&f->t, f->hdr, 0, f->depth);
    f->draw = gl_tools_program(&f->t, gl_scene_draw_vertex, gl_scene_draw_fragment);
    f->light = gl_tools_program(&f->t, NULL, gl_scene_light_fragment);
    *why = "the renderer's shaders do not compile";
    return f->draw && f->light;
}

/* Colour, normals and depth of the sculptures and the plane; alpha 0 is sky. */
static inline void gl_scene_draw(const gl_scene *f)
{
    static const float nothing[4] = {0, 0, 0, 0}, far_away = 1;
    const gl_tools *t = &f->t;
    t->BindFramebuffer(GL_TOOLS_FRAMEBUFFER, f->buffers);
    t->Viewport(0, 0, f->width, f->height);
    t->ClearBufferfv(GL_TOOLS_COLOR, 0, nothing), t->ClearBufferfv(GL_TOOLS_COLOR, 1, nothing);
    t->ClearBufferfv(GL_TOOLS_DEPTH, 0, &far_away);
    t->Enable(GL_TOOLS_DEPTH_TEST);
    t->UseProgram(f->draw);
    t->Uniform4fv(t->GetUniformLocation(f->draw, "matrix"), 4, f->matrix);
    t->Uniform3fv(t->GetUniformLocation(f->draw, "axes"), 3, f->axes);
    t->BindVertexArray(f->vertex_array);
    t->DrawArrays(GL_TOOLS_TRIANGLES, 0, f->vertices);
    t->Disable(GL_TOOLS_DEPTH_TEST);
}

/* Radiance of every pixel from the textures of irradiance and accessibility. */
static inline void gl_scene_light(const gl_scene *f, unsigned irradiance, unsigned open)
{
    const gl_tools *t = &f->t;
    t->BindFramebuffer(GL_TOOLS_FRAMEBUFFER, f->lit);
    t->UseProgram(f->light);
    t->Uniform3fv(t->GetUniformLocation(f->light, "axes"), 3, f->axes);
    t->Uniform4fv(t->GetUniformLocation(f->light, "lens"), 1, f->lens);
    gl_tools_bind(t, f->light, 0, "colour", f->colour);
    gl_tools_bind(t, f->light, 1, "irradiance", irradiance);
    gl_tools_bind(t, f->light, 2, "open", open);
    gl_tools_bind(t, f->light, 3, "sky", f->sky);
    t->DrawArrays(GL_TOOLS_TRIANGLES, 0, 3);
}

static inline void gl_scene_destroy(gl_scene *f)
{
    const unsigned textures[5] = {f->colour, f->normal, f->depth, f->hdr, f->sky};
    const unsigned framebuffers[2] = {f->buffers, f->lit};
    if (f->vertex_buffer) {
        f->t.DeleteFramebuffers(2, framebuffers), f->t.DeleteTextures(5, textures);
        f->t.DeleteBuffers(1, &f->vertex_buffer), f->t.DeleteVertexArrays(1, &f->vertex_array);
        f->t.DeleteProgram(f->draw), f->t.DeleteProgram(f->light);
    }
    scene_free(&f->things);
}

#endif /* GL_SCENE_H */
