/* gl_tools.h - what a program of its own needs of OpenGL 3.3 beside the headers: functions, textures, framebuffers,
   programs, times.                                                     SPDX-License-Identifier: MIT-0 OR Unlicense */

#ifndef GL_TOOLS_H
#define GL_TOOLS_H

#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#if defined(_WIN32)
#define GL_TOOLS_CALL __stdcall
#else
#define GL_TOOLS_CALL
#endif

/* X(result, name without gl, arguments) */
#define GL_TOOLS_FUNCTIONS(X)                                                                                          \
    X(void, ActiveTexture, (unsigned))                                                                                 \
    X(void, AttachShader, (unsigned, unsigned))                                                                        \
    X(void, BindBuffer, (unsigned, unsigned))                                                                          \
    X(void, BindFramebuffer, (unsigned, unsigned))                                                                     \
    X(void, BindTexture, (unsigned, unsigned))                                                                         \
    X(void, BindVertexArray, (unsigned))                                                                               \
    X(void, BlitFramebuffer, (int, int, int, int, int, int, int, int, unsigned, unsigned))                             \
    X(void, BufferData, (unsigned, ptrdiff_t, const void *, unsigned))                                                 \
    X(void, ClearBufferfv, (unsigned, int, const float *))                                                             \
    X(void, CompileShader, (unsigned))                                                                                 \
    X(unsigned, CreateProgram, (void))                                                                                 \
    X(unsigned, CreateShader, (unsigned))                                                                              \
    X(void, DeleteBuffers, (int, const unsigned *))                                                                    \
    X(void, DeleteFramebuffers, (int, const unsigned *))                                                               \
    X(void, DeleteProgram, (unsigned))                                                                                 \
    X(void, DeleteShader, (unsigned))                                                                                  \
    X(void, DeleteTextures, (int, const unsigned *))                                                                   \
    X(void, DeleteVertexArrays, (int, const unsigned *))                                                               \
    X(void, Disable, (unsigned))                                                                                       \
    X(void, DrawArrays, (unsigned, int, int))                                                                          \
    X(void, DrawBuffers, (int, const unsigned *))                                                                      \
    X(void, Enable, (unsigned))                                                                                        \
    X(void, EnableVertexAttribArray, (unsigned))                                                                       \
    X(void, FramebufferTexture2D, (unsigned, unsigned, unsigned, unsigned, int))                                       \
    X(void, GenBuffers, (int, unsigned *))                                                                             \
    X(void, GenFramebuffers, (int, unsigned *))                                                                        \
    X(void, GenTextures, (int, unsigned *))                                                                            \
    X(void, GenVertexArrays, (int, unsigned *))                                                                        \
    X(unsigned, GetError, (void))                                                                                      \
    X(void, GetProgramiv, (unsigned, unsigned, int *))                                                                 \
    X(int, GetUniformLocation, (unsigned, const char *))                                                               \
    X(void, LinkProgram, (unsigned))                                                                                   \
    X(void, PixelStorei, (unsigned, int))                                                                              \
    X(void, ReadPixels, (int, int, int, int, unsigned, unsigned, void *))                                              \
    X(void, ShaderSource, (unsigned, int, const char *const *, const int *))                                           \
    X(void, TexImage2D, (unsigned, int, int, int, int, int, unsigned, unsigned, const void *))                         \
    X(void, TexParameteri, (unsigned, unsigned, int))                                                                  \
    X(void, TexSubImage2D, (unsigned, int, int, int, int, int, unsigned, unsigned, const void *))                      \
    X(void, Uniform1i, (int, int))                                                                                     \
    X(void, Uniform3fv, (int, int, const float *))                                                                     \
    X(void, Uniform4fv, (int, int, const float *))                                                                     \
    X(void, UseProgram, (unsigned))                                                                                    \
    X(void, VertexAttribPointer, (unsigned, int, unsigned, unsigned char, int, const void *))                          \
    X(void, Viewport, (int, int, int, int))

/* These may be missing, as in WebGL: then there are no times. */
#define GL_TOOLS_QUERIES(X)                                                                                            \
    X(void, BeginQuery, (unsigned, unsigned))                                                                          \
    X(void, EndQuery, (unsigned))                                                                                      \
    X(void, GenQueries, (int, unsigned *))                                                                             \
    X(void, GetQueryObjectui64v, (unsigned, unsigned, uint64_t *))

#define GL_TOOLS_MEMBER(result, name, arguments) result(GL_TOOLS_CALL *name) arguments;
typedef struct gl_tools {
    GL_TOOLS_FUNCTIONS(GL_TOOLS_MEMBER)
    GL_TOOLS_QUERIES(GL_TOOLS_MEMBER)
    int has_queries;
} gl_tools;

enum {
    GL_TOOLS_TRIANGLES = 0x0004,
    GL_TOOLS_DEPTH_TEST = 0x0B71,
    GL_TOOLS_TEXTURE_2D = 0x0DE1,
    GL_TOOLS_FLOAT = 0x1406,
    GL_TOOLS_COLOR = 0x1800,
    GL_TOOLS_DEPTH = 0x1801,
    GL_TOOLS_LINEAR = 0x2601,
    GL_TOOLS_COLOR_BUFFER_BIT = 0x4000,
    GL_TOOLS_RGBA8 = 0x8058,
    GL_TOOLS_RGBA32F = 0x8814,
    GL_TOOLS_RGB32F = 0x8815,
    GL_TOOLS_RGBA16F = 0x881A,
    GL_TOOLS_R32F = 0x822E,
    GL_TOOLS_TEXTURE0 = 0x84C0,
    GL_TOOLS_ARRAY_BUFFER = 0x8892,
    GL_TOOLS_TIME_ELAPSED = 0x88BF,
    GL_TOOLS_READ_FRAMEBUFFER = 0x8CA8,
    GL_TOOLS_DRAW_FRAMEBUFFER = 0x8CA9,
    GL_TOOLS_DEPTH32F = 0x8CAC,
    GL_TOOLS_FRAMEBUFFER = 0x8D40
};

#define GL_TOOLS_LOAD_QUERY(result, name, arguments)                                                                   \
    proc = get_proc("gl" #name);                                                                                       \
    memcpy(&t->name, &proc, sizeof proc);                                                                              \
    if (!proc) t->has_queries = 0;
#define GL_TOOLS_LOAD(result, name, arguments)                                                                         \
    proc = get_proc("gl" #name);                                                                                       \
    memcpy(&t->name, &proc, sizeof proc);                                                                              \
    if (!proc) return "gl" #name;

/* NULL, or the first function that the context lacks. Rows in memory are packed from now on. */
static inline const char *gl_tools_load(gl_tools *t, void (*(*get_proc)(const char *name))(void))
{
    void (*proc)(void);
    GL_TOOLS_FUNCTIONS(GL_TOOLS_LOAD)
    t->has_queries = 1;
    GL_TOOLS_QUERIES(GL_TOOLS_LOAD_QUERY)
    t->PixelStorei(0x0CF5, 1); /* GL_UNPACK_ALIGNMENT, GL_PACK_ALIGNMENT */
    t->PixelStorei(0x0D05, 1);
    return NULL;
}

/* Format and type of a picture in memory for these internal formats: floats, but bytes for RGBA8. */
static inline unsigned gl_tools_format(unsigned internal, unsigned *type)
{
    *type = internal == GL_TOOLS_RGBA8 ? 0x1401 : GL_TOOLS_FLOAT;
    return internal == GL_TOOLS_R32F      ? 0x1903
           : internal == GL_TOOLS_DEPTH32F ? 0x1902
           : internal == GL_TOOLS_RGB32F   ? 0x1907
                                           : 0x1908;
}

/* Without mipmaps, clamped above and below; pixels may be NULL. */
static inline unsigned gl_tools_texture(const gl_tools *t, unsigned internal, int width, int height, int linear,
                                        const void *pixels)
{
    unsigned texture = 0, type, format = gl_tools_format(internal, &type);
    t->GenTextures(1, &texture);
    t->BindTexture(GL_TOOLS_TEXTURE_2D, texture);
    t->TexImage2D(GL_TOOLS_TEXTURE_2D, 0, (int)internal, width, height, 0, format, type, pixels);
    t->TexParameteri(GL_TOOLS_TEXTURE_2D, 0x2801, linear ? 0x2601 : 0x2600); /* GL_TEXTURE_MIN_FILTER, MAG_FILTER */
    t->TexParameteri(GL_TOOLS_TEXTURE_2D, 0x2800, linear ? 0x2601 : 0x2600);
    t->TexParameteri(GL_TOOLS_TEXTURE_2D, 0x2803, 0x812F); /* GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE */
    return texture;
}

static inline void gl_tools_upload(const gl_tools *t, unsigned texture, unsigned internal, int width, int height,
                                   const void *pixels)
{
    unsigned type, format = gl_tools_format(internal, &type);
    t->BindTexture(GL_TOOLS_TEXTURE_2D, texture);
    t->TexSubImage2D(GL_TOOLS_TEXTURE_2D, 0, 0, 0, width, height, format, type, pixels);
}

/* One or two colour textures, and depth unless 0. */
static inline unsigned gl_tools_framebuffer(const gl_tools *t, unsigned colour, unsigned second, unsigned depth)
{
    static const unsigned buffers[2] = {0x8CE0, 0x8CE1}; /* GL_COLOR_ATTACHMENT0, 1 */
    unsigned framebuffer = 0;
    t->GenFramebuffers(1, &framebuffer);
    t->BindFramebuffer(GL_TOOLS_FRAMEBUFFER, framebuffer);
    t->FramebufferTexture2D(GL_TOOLS_FRAMEBUFFER, buffers[0], GL_TOOLS_TEXTURE_2D, colour, 0);
    if (second) t->FramebufferTexture2D(GL_TOOLS_FRAMEBUFFER, buffers[1], GL_TOOLS_TEXTURE_2D, second, 0);
    if (depth) t->FramebufferTexture2D(GL_TOOLS_FRAMEBUFFER, 0x8D00, GL_TOOLS_TEXTURE_2D, depth, 0);
    t->DrawBuffers(second ? 2 : 1, buffers);
    return framebuffer;
}

/* What a framebuffer's first colour holds, the bottom row first; waits for the GPU. */
static inline void gl_tools_read(const gl_tools *t, void *pixels, unsigned framebuffer, unsigned internal, int width,
                                 int height)
{
    unsigned type, format = gl_tools_format(internal, &type);
    t->BindFramebuffer(GL_TOOLS_FRAMEBUFFER, framebuffer);
    t->ReadPixels(0, 0, width, height, format, type, pixels);
}

/* The same of a texture. */
static inline void gl_tools_read_texture(const gl_tools *t, void *pixels, unsigned texture, unsigned internal,
                                         int width, int height)
{
    unsigned framebuffer = gl_tools_framebuffer(t, texture, 0, 0);
    gl_tools_read(t, pixels, framebuffer, internal, width, height);
    t->DeleteFramebuffers(1, &framebuffer);
}

/* 0 when it does not compile or link. Without a vertex shader: a triangle over the whole viewport. */
static inline unsigned gl_tools_program(const gl_tools *t, const char *vertex, const char *fragment)
{
    static const char whole[] = "#version 330 core\nvoid main() {\n"
                                "    gl_Position = vec4(vec2(gl_VertexID == 1, gl_VertexID == 2) * 4.0 - 1.0, 0.0, 1.0);\n}\n";
    unsigned program = t->CreateProgram(), shader;
    int i, linked = 0;
    if (!vertex) vertex = whole;
    for (i = 0; i < 2; ++i) {
        shader = t->CreateShader(i ? 0x8B30 : 0x8B31); /* GL_FRAGMENT_SHADER, GL_VERTEX_SHADER */
        t->ShaderSource(shader, 1, i ? &fragment : &vertex, NULL);
        t->CompileShader(shader);
        t->AttachShader(program, shader);
        t->DeleteShader(shader);
    }
    t->LinkProgram(program);
    t->GetProgramiv(program, 0x8B82, &linked); /* GL_LINK_STATUS */
    if (linked) return program;
    t->DeleteProgram(program);
    return 0;
}

static inline void gl_tools_bind(const gl_tools *t, unsigned program, int unit, const char *name, unsigned texture)
{
    t->ActiveTexture(GL_TOOLS_TEXTURE0 + (unsigned)unit);
    t->BindTexture(GL_TOOLS_TEXTURE_2D, texture);
    t->Uniform1i(t->GetUniformLocation(program, name), unit);
}

/* ---- times of stages, without waiting: those of the frame before the last */

enum { GL_TOOLS_STAGES = 8 };
typedef struct gl_tools_timer {
    unsigned query[2][GL_TOOLS_STAGES];
    int stages, frame;
    double seconds[GL_TOOLS_STAGES];
} gl_tools_timer;

static inline void gl_tools_timer_create(const gl_tools *t, gl_tools_timer *timer, int stages)
{
    memset(timer, 0, sizeof *timer);
    timer->stages = stages;
    if (!t->has_queries) return;
    t->GenQueries(stages, timer->query[0]);
    t->GenQueries(stages, timer->query[1]);
}

/* Ends the stage before, if there is one, and begins this one; stage == stages ends the frame. */
static inline void gl_tools_timer_stage(const gl_tools *t, gl_tools_timer *timer, int stage)
{
    unsigned *now = timer->query[timer->frame & 1];
    uint64_t nanoseconds = 0;
    if (!t->has_queries) return;
    if (stage > 0) t->EndQuery(GL_TOOLS_TIME_ELAPSED);
    if (stage == timer->stages) ++timer->frame;
    else {
        if (timer->frame > 1) { /* two frames old: there by now */
            t->GetQueryObjectui64v(now[stage], 0x8866, &nanoseconds);
            timer->seconds[stage] = 1e-9 * (double)nanoseconds;
        }
        t->BeginQuery(GL_TOOLS_TIME_ELAPSED, now[stage]);
    }
}

#endif /* GL_TOOLS_H */
