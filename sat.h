/* sat.h - 0.1.0 - prefix scans and summed-area tables - SPDX-License-Identifier: MIT-0 OR Unlicense

   Box sums and box means of any size in constant time, right for high dynamic range images.
@DOC@
*/

#if defined(LIGHTSCAN_IMPLEMENTATION) && !defined(SAT_IMPLEMENTATION)
#define SAT_IMPLEMENTATION
#endif

#ifndef SAT_H
#define SAT_H

#define SAT_VERSION_MAJOR 0
#define SAT_VERSION_MINOR 1
#define SAT_VERSION_PATCH 0
#define SAT_VERSION (SAT_VERSION_MAJOR * 10000 + SAT_VERSION_MINOR * 100 + SAT_VERSION_PATCH)

#if defined(SAT_IMPLEMENT) || defined(SAT_IMPL)
#error "sat.h: the macro is called SAT_IMPLEMENTATION"
#endif

#include <stddef.h>
#include <stdint.h>

/* SAT_STATIC makes every function private to the file; SAT_DEF replaces the linkage altogether. */
#ifndef SAT_DEF
#ifdef SAT_STATIC
#define SAT_DEF static
#else
#define SAT_DEF extern
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------------------------------------
   Types shared by all six headers
   ------------------------------------------------------------------------------------------------ */

/* What every fallible call of the six headers returns; sat_result_text() gives the sentence. */
#define SAT_RESULTS(X)                                                                             \
    X(SAT_OK, "no error")                                                                          \
    X(SAT_ERR_ARGUMENT, "an argument is outside the range its comment states")                     \
    X(SAT_ERR_SIZE, "the size in bytes does not fit into size_t, or an index into int")            \
    X(SAT_ERR_MEMORY, "the allocator returned NULL")                                               \
    X(SAT_ERR_MISMATCH, "the image's size, channels or format differ from what create was given")  \
    X(SAT_ERR_NON_FINITE, "the input holds NaN or infinity and the options refuse them")           \
    X(SAT_ERR_LIMIT, "no choice within the stated limits meets the request")                       \
    X(SAT_ERR_DATA, "the saved data is truncated, corrupted or of another version")                \
    X(SAT_ERR_VERSION, "the program was linked with another version of the header")                \
    X(SAT_ERR_GL_FUNCTION, "the OpenGL context lacks a function; the message names it")            \
    X(SAT_ERR_GL_SHADER, "a shader failed to compile or link; the message holds the log")          \
    X(SAT_ERR_GL_STATE, "OpenGL refused a texture, framebuffer or buffer; the message names it")

#define SAT_RESULT_NAME(name, text) name,
typedef enum sat_result { SAT_RESULTS(SAT_RESULT_NAME) SAT_RESULT_COUNT } sat_result;

/* Memory. `alloc` returns at least `size` bytes aligned for any type, or NULL; `release` gets the
   size that was asked for. An all-zero allocator means malloc and free. */
typedef struct sat_allocator {
    void *(*alloc)(size_t size, void *user);
    void (*release)(void *memory, size_t size, void *user);
    void *user;
} sat_allocator;

/* Threads. `parallel_for` calls body(begin, end, worker, context) on half-open pieces that cover
   [0, count) exactly once, with 0 <= worker < workers, no two running pieces sharing a worker, and
   returns when all are done. An all-zero sat_threads means one worker, the caller. */
typedef void sat_range_fn(int begin, int end, int worker, void *context);
typedef struct sat_threads {
    void (*parallel_for)(int count, sat_range_fn *body, void *context, void *user);
    int workers; /* 1 .. 1024; sizes the scratch memory */
    void *user;
} sat_threads;

/* An image is a view: `channels` interleaved values a pixel, rows `stride` bytes apart (negative:
   bottom row first in memory, `pixels` then points at the top row). Integers keep their value
   (255 is 255.0); a caller who wants 0..1 scales the result. */
typedef enum sat_format { SAT_F32, SAT_U8, SAT_U16, SAT_F16 } sat_format;
typedef struct sat_image {
    const void *pixels;
    int width, height, channels;
    ptrdiff_t stride;
    sat_format format;
} sat_image;

/* OpenGL functions by name: glfwGetProcAddress and OSMesaGetProcAddress fit without a cast. */
typedef void (*sat_gl_proc)(void);
typedef sat_gl_proc sat_gl_get_proc(const char *name);

/* The version the implementation was compiled with: compare with SAT_VERSION. */
SAT_DEF int sat_version(void);
/* One English sentence without full stop; never NULL. */
SAT_DEF const char *sat_result_text(sat_result result);
/* A packed float image. */
SAT_DEF sat_image sat_image_f32(const float *pixels, int width, int height, int channels);
@API@
/* A program that forgets SAT_IMPLEMENTATION fails to link, and this name says why. */
#ifndef SAT_STATIC
extern const int sat__define_SAT_IMPLEMENTATION_in_exactly_one_c_file;
#endif

#ifdef __cplusplus
}
#endif
#endif /* SAT_H */
@GLAPI@
/* ------------------------------------------------------------------------------------------------
   Stop here if you only want to use the library.
   ------------------------------------------------------------------------------------------------ */

