/* sat.h - 0.1.0 - prefix scans and summed-area tables - SPDX-License-Identifier: MIT-0 OR Unlicense

   Box sums and box means of any size in constant time, right for high dynamic range images.
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
#define SAT_DEF static inline
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

/* ------------------------------------------------------------------------------------------------
   Scans: out[i] = in[0] + ... + in[i], for any associative sum (Slomp 2012, sections 4.3 to 4.5)
   ------------------------------------------------------------------------------------------------ */

typedef enum sat_scan_algorithm {
    SAT_SCAN_SEQUENTIAL,         /* n - 1 sums; the fast one on a CPU */
    SAT_SCAN_RECURSIVE_DOUBLING, /* ceil(log_k n) passes over everything; scratch n */
    SAT_SCAN_BALANCED_TREE       /* about twice the passes on k-th parts; scratch about 2n / (k-1) */
} sat_scan_algorithm;

/* What a scan did; the last two algorithms are the GPU's, and these numbers are what they cost there. */
typedef struct sat_scan_counters {
    size_t passes; /* full-screen passes a GPU would draw */
    size_t adds;   /* calls of the sum */
    size_t copies; /* values only moved, to keep both ping-pong halves equal */
    size_t reads, writes;
    size_t nodes; /* values generated, eq 4.33 */
} sat_scan_counters;

typedef struct sat_scan_options {
    sat_scan_algorithm algorithm; /* SAT_SCAN_SEQUENTIAL */
    int k;                        /* 4; 2..64: values summed in one step. 4 moves the fewest (7.67 n) */
    int exclusive;                /* 0; 1: out[i] leaves in[i] out and out[0] is the identity */
    sat_allocator allocator;      /* malloc; used by the two parallel algorithms only */
    sat_threads threads;          /* serial; same bits for any worker count */
    sat_scan_counters *counters;  /* NULL: not counted; otherwise overwritten */
} sat_scan_options;
SAT_DEF sat_scan_options sat_scan_defaults(void);

/* In place when out == in; otherwise the two must not overlap. n may be 0. Integers wrap around. */
SAT_DEF sat_result sat_scan_f32(float *out, const float *in, size_t n, const sat_scan_options *options);
SAT_DEF sat_result sat_scan_f64(double *out, const double *in, size_t n, const sat_scan_options *options);
SAT_DEF sat_result sat_scan_i32(int32_t *out, const int32_t *in, size_t n, const sat_scan_options *options);
SAT_DEF sat_result sat_scan_u32(uint32_t *out, const uint32_t *in, size_t n, const sat_scan_options *options);
SAT_DEF sat_result sat_scan_u64(uint64_t *out, const uint64_t *in, size_t n, const sat_scan_options *options);

/* The same for any type and any associative operation: *out = *left + *right, with out different
   from both. `identity` is the neutral element. element_size 1..4096 bytes. */
typedef void sat_combine_fn(void *out, const void *left, const void *right, void *user);
SAT_DEF sat_result sat_scan_any(void *out, const void *in, size_t n, size_t element_size, sat_combine_fn *combine,
                                const void *identity, void *user, const sat_scan_options *options);

/* The sum of n floats `stride` bytes apart by a k-ary tree of doubles, k = 2..64 (others count as 4):
   a fixed order, so the same bits everywhere; error below (log_k n + 1)(k - 1) 2^-53 sum |in|. */
SAT_DEF double sat_reduce_f32(const float *in, size_t n, ptrdiff_t stride, int k);

/* ------------------------------------------------------------------------------------------------
   Tables: the sum over any box from four corners (Slomp 2012, eq 4.1 to 4.4)
   ------------------------------------------------------------------------------------------------ */

/* How sums are stored. Bytes a pixel and channel; see NUMERICS for errors and COST for times. */
typedef enum sat_kind {
    SAT_KIND_TILED,   /* 4.5; floats that restart in every tile, doubles between tiles: for HDR */
    SAT_KIND_FLOAT,   /* 4; only for large boxes, small images or thesis parity */
    SAT_KIND_DOUBLE,  /* 8 */
    SAT_KIND_FIXED32, /* 4; integers modulo 2^32: exact sums of pixels rounded to `quantum` */
    SAT_KIND_FIXED64  /* 8; integers modulo 2^64: the same, for 8- and 16-bit input without any error */
} sat_kind;

typedef enum sat_non_finite {
    SAT_NON_FINITE_CLAMP, /* NaN counts as 0, infinity as +-max_value */
    SAT_NON_FINITE_REFUSE /* build and update return SAT_ERR_NON_FINITE; the table then holds zeros */
} sat_non_finite;

typedef struct sat_options {
    sat_kind kind;             /* SAT_KIND_TILED */
    int tile;                  /* 32; 8, 16, 32, 64 or 128: tile side of SAT_KIND_TILED; 64 needs 4.25 bytes, errs 4x */
    int subtract_mean;         /* 0; 1 (FLOAT, DOUBLE): Hensley 2005. Good at low contrast; makes dark boxes of
                                  HDR images about 100 times worse */
    double quantum;            /* 0: the finest power of two that max_value and max_box_area allow; FIXED kinds only */
    double max_value;          /* 1e30; > 0: pixels beyond +-max_value are clamped to it and counted. Lower it for
                                  FIXED kinds: the quantum is proportional to it. 0: largest |pixel| of the first build */
    double max_box_area;       /* 0: the whole table; FIXED kinds: no larger box is ever asked for */
    sat_non_finite non_finite; /* SAT_NON_FINITE_CLAMP */
    sat_allocator allocator;   /* malloc; used by create and destroy only */
    sat_threads threads;       /* serial; build, update and box filters use it; same bits for any worker count */
} sat_options;
SAT_DEF sat_options sat_defaults(void);

typedef struct sat_table sat_table;

/* What the last build or update met. */
typedef struct sat_statistics {
    size_t nan, infinite, clamped; /* channel values replaced: NaN, infinite, beyond max_value */
    double largest, mean_abs;      /* over |value| of all channels, after replacement */
    double quantum;                /* FIXED kinds: the step that pixels are rounded to; else 0 */
    size_t bytes;                  /* memory the table holds */
} sat_statistics;
SAT_DEF sat_statistics sat_get_statistics(const sat_table *table);

/* A table of zeros; exactly one allocation. 1 <= channels <= 4. */
SAT_DEF sat_result sat_create(sat_table **out, int width, int height, int channels, const sat_options *options);
/* Fills the table from an image of the created size; no allocation: call it every frame. */
SAT_DEF sat_result sat_build(sat_table *table, const sat_image *image);
/* The same table as a fresh build, bit for bit, when pixels differ only inside [x0,x1) x [y0,y1). Cheap for
   SAT_KIND_TILED; the others rebuild what lies right and below (and FLOAT and DOUBLE read all rows for it). */
SAT_DEF sat_result sat_update(sat_table *table, const sat_image *image, int x0, int y0, int x1, int y1);
SAT_DEF void sat_destroy(sat_table *table); /* NULL is fine */

/* Box [x0,x1) x [y0,y1), clipped to the table; an empty box gives 0. Constant time, any number of threads. */
SAT_DEF double sat_sum(const sat_table *table, int channel, int x0, int y0, int x1, int y1);
/* The sum divided by the clipped area. */
SAT_DEF double sat_mean(const sat_table *table, int channel, int x0, int y0, int x1, int y1);
/* The exact integral of the piecewise constant image (pixel i covers [i, i+1)) over a box with real corners. */
SAT_DEF double sat_sum_fractional(const sat_table *table, int channel, double x0, double y0, double x1, double y1);
/* The pixel itself, to the error of a 1x1 box; 0 outside. */
SAT_DEF float sat_restore(const sat_table *table, int channel, int x, int y);

/* What lies outside the image, for each axis: nothing (the box is clipped), zeros, the border pixel, the
   mirrored image (the border pixel twice) or the periodic image (x of an environment map). */
typedef enum sat_border { SAT_BORDER_CLIP, SAT_BORDER_ZERO, SAT_BORDER_CLAMP, SAT_BORDER_MIRROR, SAT_BORDER_WRAP } sat_border;
/* Mean over a box with real corners, of any size and anywhere; at most 16 box sums of 9 lookups. Empty: 0. */
SAT_DEF double sat_mean_border(const sat_table *table, int channel, double x0, double y0, double x1, double y1,
                               sat_border border_x, sat_border border_y);

/* Box means around every pixel: (2 radius + 1)^2 pixels, clipped at the borders, divided by the clipped area.
   out: float, the table's channels interleaved, rows out_stride bytes apart. radius >= 0. */
SAT_DEF sat_result sat_box_filter(float *out, ptrdiff_t out_stride, const sat_table *table, int radius);
/* The same with a radius for every pixel (one float a pixel, rows radius_stride bytes apart): the box reaches
   radius + 1/2 to each side of the pixel's centre; negative and NaN count as 0. */
SAT_DEF sat_result sat_box_filter_variable(float *out, ptrdiff_t out_stride, const sat_table *table,
                                           const float *radius, ptrdiff_t radius_stride);

/* Never below the absolute error of a box mean of that size anywhere in the table, against exact sums of the
   replaced pixels. Worst case, not typical: see sat_error_rms. */
SAT_DEF double sat_error_bound(const sat_table *table, int channel, int box_width, int box_height);
/* The root-mean-square error to expect over boxes of that size, within a factor of 3 on images that are not constant. */
SAT_DEF double sat_error_rms(const sat_table *table, int channel, int box_width, int box_height);

/* The cheapest kind whose worst error on box means of that size stays below max_relative_error times the mean
   |value| of the image, within max_bytes (0: no limit). SAT_ERR_LIMIT when none does; *kind is then the most accurate
   one that fits. Reads the image once. */
SAT_DEF sat_result sat_plan(sat_kind *kind, const sat_image *image, int box_width, int box_height,
                            double max_relative_error, size_t max_bytes, const sat_options *options);

/* Box filter of an image that arrives a row at a time, of any height, in memory for 2 radius + 2 rows. The rows
   that come out equal sat_box_filter of the whole image bit for bit. */
typedef struct sat_stream sat_stream;
SAT_DEF sat_result sat_stream_create(sat_stream **out, int width, int channels, int radius, const sat_options *options);
/* Takes the next row (an image of height 1) and writes at most one filtered row to out_row (width x channels floats);
   *rows_out says whether it did. After the last row call it with row == NULL until *rows_out is 0. */
SAT_DEF sat_result sat_stream_push(sat_stream *stream, float *out_row, int *rows_out, const sat_image *row);
SAT_DEF void sat_stream_destroy(sat_stream *stream);

/* A program that forgets SAT_IMPLEMENTATION fails to link, and this name says why. */
#ifdef SAT_STATIC
static const int sat__define_SAT_IMPLEMENTATION_in_exactly_one_c_file = SAT_VERSION;
#else
extern const int sat__define_SAT_IMPLEMENTATION_in_exactly_one_c_file;
#endif

#ifdef __cplusplus
}
#endif
#endif /* SAT_H */
/* @GL API@ */
/* ------------------------------------------------------------------------------------------------
   Stop here if you only want to use the library.
   ------------------------------------------------------------------------------------------------ */

/* ------------------------------------------------------------------------------------------------
   For the sibling headers

   What the six implementations share stands here once, as static inline functions. A sibling's
   implementation part gets it by defining SAT_SIBLING and including this header again; nothing of
   it is part of the interface, and names may change with any version.
   ------------------------------------------------------------------------------------------------ */

#if (defined(SAT_IMPLEMENTATION) || defined(SAT_SIBLING)) && !defined(SAT__SHARED)
#define SAT__SHARED

#include <math.h>
#include <string.h>
#ifndef SAT_NO_STDLIB
#include <stdlib.h>
#endif

#ifndef SAT_ASSERT
#include <assert.h>
#define SAT_ASSERT(condition) assert(condition)
#endif

/* Vector instructions come from the compiler's own macros; every vector loop has a plain twin. */
#ifndef SAT_NO_SIMD
#if defined(__SSE2__) || defined(_M_X64) || (defined(_M_IX86_FP) && _M_IX86_FP >= 2)
#define SAT__SSE2
#include <emmintrin.h>
#if defined(__AVX2__)
#define SAT__AVX2
#include <immintrin.h>
#endif
#elif defined(__aarch64__) && defined(__ARM_NEON)
#define SAT__NEON
#include <arm_neon.h>
#endif
#endif

/* ---- memory, sizes, threads */

#ifndef SAT_NO_STDLIB
static inline void *sat__stdlib_alloc(size_t size, void *user)
{
    (void)user;
    return malloc(size);
}

static inline void sat__stdlib_release(void *memory, size_t size, void *user)
{
    (void)size;
    (void)user;
    free(memory);
}
#endif

/* Fills in malloc and free; 0 when only one of the two functions is given, or none and there is
   no stdlib to fall back on. */
static inline int sat__resolve_allocator(sat_allocator *out, const sat_allocator *wanted)
{
    *out = *wanted;
#ifndef SAT_NO_STDLIB
    if (!out->alloc && !out->release) {
        out->alloc = sat__stdlib_alloc;
        out->release = sat__stdlib_release;
    }
#endif
    return out->alloc && out->release;
}

static inline void *sat__alloc(const sat_allocator *allocator, size_t size)
{
    return allocator->alloc(size ? size : 1, allocator->user);
}

static inline void sat__release(const sat_allocator *allocator, void *memory, size_t size)
{
    if (memory) allocator->release(memory, size ? size : 1, allocator->user);
}

/* *size = a * b; 0 when the product does not fit (half of size_t is kept free for sums). */
static inline int sat__multiply_size(size_t *size, size_t a, size_t b)
{
    if (b && a > (SIZE_MAX / 2) / b) return 0;
    *size = a * b;
    return 1;
}

/* Carves aligned arrays out of one block: with base NULL the same calls measure the size. */
typedef struct sat__arena {
    unsigned char *base;
    size_t used;
    int overflow;
} sat__arena;

static inline void *sat__carve(sat__arena *arena, size_t count, size_t element_size)
{
    size_t bytes, begin = (arena->used + 63) & ~(size_t)63;
    if (!sat__multiply_size(&bytes, count, element_size) || bytes > SIZE_MAX / 2 - begin) {
        arena->overflow = 1;
        return NULL;
    }
    arena->used = begin + bytes;
    return arena->base ? arena->base + begin : NULL;
}

/* The first 64-byte boundary inside a block that was allocated 63 bytes larger than needed. */
static inline unsigned char *sat__align64(void *block)
{
    return (unsigned char *)block + (63 & (0 - (uintptr_t)block));
}

static inline int sat__worker_count(const sat_threads *threads)
{
    return threads->parallel_for && threads->workers > 1 ? threads->workers : 1;
}

static inline void sat__parallel_for(const sat_threads *threads, int count, sat_range_fn *body, void *context)
{
    if (count <= 0) return;
    if (threads && sat__worker_count(threads) > 1 && count > 1) threads->parallel_for(count, body, context, threads->user);
    else body(0, count, 0, context);
}

/* workers outside 1..1024 with a parallel_for, or workers > 1 without one, are mistakes. */
static inline int sat__threads_are_valid(const sat_threads *threads)
{
    return threads->parallel_for ? threads->workers >= 1 && threads->workers <= 1024 : threads->workers <= 1 && threads->workers >= 0;
}

/* ---- numbers */

static inline int sat__min_int(int a, int b) { return a < b ? a : b; }
static inline int sat__max_int(int a, int b) { return a > b ? a : b; }
static inline int sat__clamp_int(int v, int low, int high) { return v < low ? low : v > high ? high : v; }

static inline uint32_t sat__float_bits(float v)
{
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    return bits;
}

static inline float sat__float_from_bits(uint32_t bits)
{
    float v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

/* These look at the bits, so that -ffast-math cannot delete them. */
static inline int sat__is_finite(float v) { return (sat__float_bits(v) & 0x7f800000u) != 0x7f800000u; }
static inline int sat__is_nan(float v) { return (sat__float_bits(v) & 0x7fffffffu) > 0x7f800000u; }
static inline int sat__is_finite_double(double v)
{
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    return (bits & 0x7ff0000000000000u) != 0x7ff0000000000000u;
}

/* IEEE 754 binary16: exact in this direction, subnormals, infinities and NaN included. */
static inline float sat__half_to_float(uint16_t half)
{
    uint32_t sign = (uint32_t)(half & 0x8000u) << 16, exponent = (half >> 10) & 31u, mantissa = half & 0x3ffu;
    if (exponent == 31) return sat__float_from_bits(sign | 0x7f800000u | mantissa << 13);
    if (exponent == 0) {
        float magnitude = (float)mantissa * 5.9604644775390625e-8f; /* 2^-24 */
        return sign ? -magnitude : magnitude;
    }
    return sat__float_from_bits(sign | (exponent + 112) << 23 | mantissa << 13);
}

/* To nearest, ties to even; overflow becomes infinity, NaN stays NaN. */
static inline uint16_t sat__half_from_float(float value)
{
    uint32_t bits = sat__float_bits(value), sign = (bits >> 16) & 0x8000u, magnitude = bits & 0x7fffffffu;
    if (magnitude > 0x7f800000u) return (uint16_t)(sign | 0x7e00u);
    if (magnitude >= 0x477ff000u) return (uint16_t)(sign | 0x7c00u);
    if (magnitude < 0x38800000u) { /* subnormal: let the float adder round at 2^-24 */
        float shifted = sat__float_from_bits(magnitude) + 0.5f;
        return (uint16_t)(sign | (sat__float_bits(shifted) - 0x3f000000u));
    }
    magnitude += 0xfffu + ((magnitude >> 13) & 1u);
    return (uint16_t)(sign | ((magnitude - 0x38000000u) >> 13));
}

/* IEC 61966-2-1, both directions on 0..1. */
static inline float sat__srgb_encode(float linear)
{
    if (!(linear > 0)) return 0;
    if (linear >= 1) return 1;
    return linear <= 0.0031308f ? 12.92f * linear : 1.055f * powf(linear, 1 / 2.4f) - 0.055f;
}

static inline float sat__srgb_decode(float encoded)
{
    if (!(encoded > 0)) return 0;
    if (encoded >= 1) return 1;
    return encoded <= 0.04045f ? encoded / 12.92f : powf((encoded + 0.055f) / 1.055f, 2.4f);
}

/* Relative luminance of linear Rec. 709 colour under D65. */
static inline float sat__luminance(float red, float green, float blue)
{
    return 0.2126729f * red + 0.7151522f * green + 0.0721750f * blue;
}

/* ---- images */

static inline size_t sat__format_size(sat_format format)
{
    return format == SAT_U8 ? 1 : format == SAT_F32 ? 4 : 2;
}

/* A view the other functions may read: 1 to 4 channels, a known format, rows that do not overlap
   and are aligned for their element. */
static inline int sat__image_is_valid(const sat_image *image)
{
    size_t row, element, step;
    if (!image || !image->pixels || image->width < 1 || image->height < 1) return 0;
    if (image->channels < 1 || image->channels > 4) return 0;
    if ((unsigned)image->format > (unsigned)SAT_F16) return 0;
    element = sat__format_size(image->format);
    if (!sat__multiply_size(&row, (size_t)image->width * (size_t)image->channels, element)) return 0;
    step = image->stride < 0 ? (size_t)0 - (size_t)image->stride : (size_t)image->stride;
    if ((image->height > 1 && step < row) || step % element || (uintptr_t)image->pixels % element) return 0;
    return 1;
}

static inline const void *sat__image_row(const sat_image *image, int y)
{
    return (const unsigned char *)image->pixels + (ptrdiff_t)y * image->stride;
}

/* out[i] = channel `channel` of pixel x0 + i of row y, as float. */
static inline void sat__read_row(float *out, const sat_image *image, int y, int x0, int x1, int channel)
{
    const void *row = sat__image_row(image, y);
    size_t step = (size_t)image->channels, at = (size_t)x0 * step + (size_t)channel;
    int i, n = x1 - x0;
    switch (image->format) {
    case SAT_F32: {
        const float *p = (const float *)row + at;
        for (i = 0; i < n; i++) out[i] = p[(size_t)i * step];
        break;
    }
    case SAT_U8: {
        const uint8_t *p = (const uint8_t *)row + at;
        for (i = 0; i < n; i++) out[i] = (float)p[(size_t)i * step];
        break;
    }
    case SAT_U16: {
        const uint16_t *p = (const uint16_t *)row + at;
        for (i = 0; i < n; i++) out[i] = (float)p[(size_t)i * step];
        break;
    }
    case SAT_F16: {
        const uint16_t *p = (const uint16_t *)row + at;
        for (i = 0; i < n; i++) out[i] = sat__half_to_float(p[(size_t)i * step]);
        break;
    }
    }
}

/* ---- four floats at a time: SSE2 or NEON, the same rounding in both. SAT__VECTOR says that they are there. */

#if defined(SAT__SSE2)
#define SAT__VECTOR
typedef __m128 sat__f32x4;
typedef __m128i sat__i32x4;
static inline sat__f32x4 sat__f32x4_load(const float *p) { return _mm_loadu_ps(p); }
static inline void sat__f32x4_store(float *p, sat__f32x4 v) { _mm_storeu_ps(p, v); }
static inline sat__f32x4 sat__f32x4_set1(float v) { return _mm_set1_ps(v); }
static inline sat__f32x4 sat__f32x4_add(sat__f32x4 a, sat__f32x4 b) { return _mm_add_ps(a, b); }
static inline sat__f32x4 sat__f32x4_sub(sat__f32x4 a, sat__f32x4 b) { return _mm_sub_ps(a, b); }
static inline sat__f32x4 sat__f32x4_mul(sat__f32x4 a, sat__f32x4 b) { return _mm_mul_ps(a, b); }
static inline sat__f32x4 sat__f32x4_div(sat__f32x4 a, sat__f32x4 b) { return _mm_div_ps(a, b); }
static inline sat__f32x4 sat__f32x4_min(sat__f32x4 a, sat__f32x4 b) { return _mm_min_ps(a, b); }
static inline sat__f32x4 sat__f32x4_max(sat__f32x4 a, sat__f32x4 b) { return _mm_max_ps(a, b); }
static inline sat__f32x4 sat__f32x4_sqrt(sat__f32x4 a) { return _mm_sqrt_ps(a); }
static inline sat__f32x4 sat__f32x4_abs(sat__f32x4 a) { return _mm_and_ps(a, _mm_castsi128_ps(_mm_set1_epi32(0x7fffffff))); }
/* comparisons give all-one or all-zero lanes */
static inline sat__i32x4 sat__f32x4_less(sat__f32x4 a, sat__f32x4 b) { return _mm_castps_si128(_mm_cmplt_ps(a, b)); }
static inline sat__i32x4 sat__f32x4_less_equal(sat__f32x4 a, sat__f32x4 b) { return _mm_castps_si128(_mm_cmple_ps(a, b)); }
static inline sat__f32x4 sat__f32x4_select(sat__i32x4 mask, sat__f32x4 yes, sat__f32x4 no)
{
    __m128 m = _mm_castsi128_ps(mask);
    return _mm_or_ps(_mm_and_ps(m, yes), _mm_andnot_ps(m, no));
}
static inline int sat__i32x4_any(sat__i32x4 mask) { return _mm_movemask_epi8(mask) != 0; }
static inline int sat__i32x4_all(sat__i32x4 mask) { return _mm_movemask_epi8(mask) == 0xffff; }
static inline sat__i32x4 sat__i32x4_load(const int32_t *p) { return _mm_loadu_si128((const __m128i *)(const void *)p); }
static inline void sat__i32x4_store(int32_t *p, sat__i32x4 v) { _mm_storeu_si128((__m128i *)(void *)p, v); }
static inline sat__i32x4 sat__i32x4_set1(int32_t v) { return _mm_set1_epi32(v); }
static inline sat__i32x4 sat__i32x4_add(sat__i32x4 a, sat__i32x4 b) { return _mm_add_epi32(a, b); }
static inline sat__i32x4 sat__i32x4_sub(sat__i32x4 a, sat__i32x4 b) { return _mm_sub_epi32(a, b); }
static inline sat__i32x4 sat__i32x4_and(sat__i32x4 a, sat__i32x4 b) { return _mm_and_si128(a, b); }
static inline sat__i32x4 sat__i32x4_or(sat__i32x4 a, sat__i32x4 b) { return _mm_or_si128(a, b); }
static inline sat__i32x4 sat__i32x4_greater(sat__i32x4 a, sat__i32x4 b) { return _mm_cmpgt_epi32(a, b); }
static inline sat__f32x4 sat__i32x4_to_f32(sat__i32x4 v) { return _mm_cvtepi32_ps(v); }
static inline sat__i32x4 sat__f32x4_truncate(sat__f32x4 v) { return _mm_cvttps_epi32(v); } /* |v| < 2^31 */
static inline sat__i32x4 sat__f32x4_bits(sat__f32x4 v) { return _mm_castps_si128(v); }
static inline sat__f32x4 sat__f32x4_from_bits(sat__i32x4 v) { return _mm_castsi128_ps(v); }
static inline sat__i32x4 sat__i32x4_shift_right(sat__i32x4 v, int bits) { return _mm_srl_epi32(v, _mm_cvtsi32_si128(bits)); } /* zeros come in */
static inline void sat__f32x4_load3(const float *p, sat__f32x4 *r, sat__f32x4 *g, sat__f32x4 *b) /* four packed RGB pixels */
{
    __m128 u = _mm_loadu_ps(p), v = _mm_loadu_ps(p + 4), w = _mm_loadu_ps(p + 8);       /* rgbr gbrg brgb */
    __m128 s = _mm_shuffle_ps(v, w, _MM_SHUFFLE(2, 1, 3, 2)), t = _mm_shuffle_ps(u, v, _MM_SHUFFLE(1, 0, 2, 1)); /* rgrg gbgb */
    *r = _mm_shuffle_ps(u, s, _MM_SHUFFLE(2, 0, 3, 0));
    *g = _mm_shuffle_ps(t, s, _MM_SHUFFLE(3, 1, 2, 0));
    *b = _mm_shuffle_ps(t, w, _MM_SHUFFLE(3, 0, 3, 1));
}
static inline void sat__f32x4_load4(const float *p, sat__f32x4 *r, sat__f32x4 *g, sat__f32x4 *b, sat__f32x4 *a) /* four RGBA pixels */
{
    *r = _mm_loadu_ps(p);
    *g = _mm_loadu_ps(p + 4);
    *b = _mm_loadu_ps(p + 8);
    *a = _mm_loadu_ps(p + 12);
    _MM_TRANSPOSE4_PS(*r, *g, *b, *a);
}
#elif defined(SAT__NEON)
#define SAT__VECTOR
typedef float32x4_t sat__f32x4;
typedef int32x4_t sat__i32x4;
static inline sat__f32x4 sat__f32x4_load(const float *p) { return vld1q_f32(p); }
static inline void sat__f32x4_store(float *p, sat__f32x4 v) { vst1q_f32(p, v); }
static inline sat__f32x4 sat__f32x4_set1(float v) { return vdupq_n_f32(v); }
static inline sat__f32x4 sat__f32x4_add(sat__f32x4 a, sat__f32x4 b) { return vaddq_f32(a, b); }
static inline sat__f32x4 sat__f32x4_sub(sat__f32x4 a, sat__f32x4 b) { return vsubq_f32(a, b); }
static inline sat__f32x4 sat__f32x4_mul(sat__f32x4 a, sat__f32x4 b) { return vmulq_f32(a, b); }
static inline sat__f32x4 sat__f32x4_div(sat__f32x4 a, sat__f32x4 b) { return vdivq_f32(a, b); }
static inline sat__f32x4 sat__f32x4_min(sat__f32x4 a, sat__f32x4 b) { return vbslq_f32(vcltq_f32(a, b), a, b); } /* NaN: b, as SSE2 */
static inline sat__f32x4 sat__f32x4_max(sat__f32x4 a, sat__f32x4 b) { return vbslq_f32(vcgtq_f32(a, b), a, b); }
static inline sat__f32x4 sat__f32x4_sqrt(sat__f32x4 a) { return vsqrtq_f32(a); }
static inline sat__f32x4 sat__f32x4_abs(sat__f32x4 a) { return vabsq_f32(a); }
static inline sat__i32x4 sat__f32x4_less(sat__f32x4 a, sat__f32x4 b) { return vreinterpretq_s32_u32(vcltq_f32(a, b)); }
static inline sat__i32x4 sat__f32x4_less_equal(sat__f32x4 a, sat__f32x4 b) { return vreinterpretq_s32_u32(vcleq_f32(a, b)); }
static inline sat__f32x4 sat__f32x4_select(sat__i32x4 mask, sat__f32x4 yes, sat__f32x4 no)
{
    return vbslq_f32(vreinterpretq_u32_s32(mask), yes, no);
}
static inline int sat__i32x4_any(sat__i32x4 mask) { return vmaxvq_u32(vreinterpretq_u32_s32(mask)) != 0; }
static inline int sat__i32x4_all(sat__i32x4 mask) { return vminvq_u32(vreinterpretq_u32_s32(mask)) == 0xffffffffu; }
static inline sat__i32x4 sat__i32x4_load(const int32_t *p) { return vld1q_s32(p); }
static inline void sat__i32x4_store(int32_t *p, sat__i32x4 v) { vst1q_s32(p, v); }
static inline sat__i32x4 sat__i32x4_set1(int32_t v) { return vdupq_n_s32(v); }
static inline sat__i32x4 sat__i32x4_add(sat__i32x4 a, sat__i32x4 b) { return vaddq_s32(a, b); }
static inline sat__i32x4 sat__i32x4_sub(sat__i32x4 a, sat__i32x4 b) { return vsubq_s32(a, b); }
static inline sat__i32x4 sat__i32x4_and(sat__i32x4 a, sat__i32x4 b) { return vandq_s32(a, b); }
static inline sat__i32x4 sat__i32x4_or(sat__i32x4 a, sat__i32x4 b) { return vorrq_s32(a, b); }
static inline sat__i32x4 sat__i32x4_greater(sat__i32x4 a, sat__i32x4 b) { return vreinterpretq_s32_u32(vcgtq_s32(a, b)); }
static inline sat__f32x4 sat__i32x4_to_f32(sat__i32x4 v) { return vcvtq_f32_s32(v); }
static inline sat__i32x4 sat__f32x4_truncate(sat__f32x4 v) { return vcvtq_s32_f32(v); }
static inline sat__i32x4 sat__f32x4_bits(sat__f32x4 v) { return vreinterpretq_s32_f32(v); }
static inline sat__f32x4 sat__f32x4_from_bits(sat__i32x4 v) { return vreinterpretq_f32_s32(v); }
static inline sat__i32x4 sat__i32x4_shift_right(sat__i32x4 v, int bits)
{
    return vreinterpretq_s32_u32(vshlq_u32(vreinterpretq_u32_s32(v), vdupq_n_s32(-bits)));
}
static inline void sat__f32x4_load3(const float *p, sat__f32x4 *r, sat__f32x4 *g, sat__f32x4 *b)
{
    float32x4x3_t v = vld3q_f32(p);
    *r = v.val[0];
    *g = v.val[1];
    *b = v.val[2];
}
static inline void sat__f32x4_load4(const float *p, sat__f32x4 *r, sat__f32x4 *g, sat__f32x4 *b, sat__f32x4 *a)
{
    float32x4x4_t v = vld4q_f32(p);
    *r = v.val[0];
    *g = v.val[1];
    *b = v.val[2];
    *a = v.val[3];
}
#endif

/* What a sibling's implementation calls to be sure that sat.h was implemented, and in this version. */
static inline int sat__version_matches(void) { return sat__define_SAT_IMPLEMENTATION_in_exactly_one_c_file == SAT_VERSION; }

#endif /* SAT__SHARED */
/* ------------------------------------------------------------------------------------------------
   For the sibling headers: OpenGL

   Written for GL 3.3 core, and for ES 3.0 as long as the shaders stay within GLSL ES 3.00. A sibling
   defines SAT_SIBLING and SAT_SIBLING_GL before it includes this header in its implementation part, keeps
   a sat__gl in its object, and does

       create    sat__gl_open, sat__gl_build, sat__gl_texture, sat__gl_framebuffer
       a frame   sat__gl_begin, { sat__gl_pass, sat__gl_set_..., sat__gl_draw } ..., sat__gl_end
       destroy   DeleteProgram, DeleteTextures, DeleteFramebuffers, sat__gl_close

   with the context current. Anything not wrapped here is called through the table: gl->DrawBuffers(...).
   A frame's calls ask nothing of the GPU that makes the CPU wait.
   ------------------------------------------------------------------------------------------------ */

#if ((defined(SAT_IMPLEMENTATION) && defined(SAT_GL)) || defined(SAT_SIBLING_GL)) && !defined(SAT__SHARED_GL)
#define SAT__SHARED_GL

#include <stdio.h>

#if defined(_WIN32)
#define SAT__GL_CALL __stdcall
#else
#define SAT__GL_CALL
#endif

/* The names and numbers of the OpenGL registry, as far as the six headers use them. */
enum {
    SAT__GL_NO_ERROR = 0, SAT__GL_POINTS = 0x0000, SAT__GL_LINES = 0x0001, SAT__GL_TRIANGLES = 0x0004,
    SAT__GL_TRIANGLE_STRIP = 0x0005,
    SAT__GL_ZERO = 0, SAT__GL_ONE = 1, SAT__GL_SRC_ALPHA = 0x0302, SAT__GL_ONE_MINUS_SRC_ALPHA = 0x0303,
    SAT__GL_LESS = 0x0201, SAT__GL_LEQUAL = 0x0203, SAT__GL_ALWAYS = 0x0207, SAT__GL_FILL = 0x1B02,
    SAT__GL_BLEND_DST_RGB = 0x80C8, SAT__GL_BLEND_SRC_RGB = 0x80C9, SAT__GL_BLEND_DST_ALPHA = 0x80CA,
    SAT__GL_BLEND_SRC_ALPHA = 0x80CB, SAT__GL_BLEND_EQUATION_RGB = 0x8009, SAT__GL_BLEND_EQUATION_ALPHA = 0x883D,
    SAT__GL_FRONT_AND_BACK = 0x0408, SAT__GL_POLYGON_MODE = 0x0B40, SAT__GL_DEPTH_WRITEMASK = 0x0B72,
    SAT__GL_DEPTH_FUNC = 0x0B74, SAT__GL_VIEWPORT = 0x0BA2, SAT__GL_COLOR_WRITEMASK = 0x0C23,
    SAT__GL_CULL_FACE = 0x0B44, SAT__GL_DEPTH_TEST = 0x0B71, SAT__GL_STENCIL_TEST = 0x0B90, SAT__GL_DITHER = 0x0BD0,
    SAT__GL_BLEND = 0x0BE2, SAT__GL_COLOR_LOGIC_OP = 0x0BF2, SAT__GL_SCISSOR_TEST = 0x0C11,
    SAT__GL_SAMPLE_ALPHA_TO_COVERAGE = 0x809E, SAT__GL_SAMPLE_COVERAGE = 0x80A0, SAT__GL_FRAMEBUFFER_SRGB = 0x8DB9,
    SAT__GL_RASTERIZER_DISCARD = 0x8C89, SAT__GL_PROGRAM_POINT_SIZE = 0x8642,
    SAT__GL_UNPACK_SWAP_BYTES = 0x0CF0, SAT__GL_UNPACK_ROW_LENGTH = 0x0CF2, SAT__GL_UNPACK_SKIP_ROWS = 0x0CF3,
    SAT__GL_UNPACK_SKIP_PIXELS = 0x0CF4, SAT__GL_UNPACK_ALIGNMENT = 0x0CF5, SAT__GL_UNPACK_SKIP_IMAGES = 0x806D,
    SAT__GL_UNPACK_IMAGE_HEIGHT = 0x806E, SAT__GL_PACK_SWAP_BYTES = 0x0D00, SAT__GL_PACK_ROW_LENGTH = 0x0D02,
    SAT__GL_PACK_SKIP_ROWS = 0x0D03, SAT__GL_PACK_SKIP_PIXELS = 0x0D04, SAT__GL_PACK_ALIGNMENT = 0x0D05,
    SAT__GL_MAX_TEXTURE_SIZE = 0x0D33, SAT__GL_TEXTURE_2D = 0x0DE1, SAT__GL_TEXTURE_2D_ARRAY = 0x8C1A,
    SAT__GL_TEXTURE_BINDING_2D = 0x8069, SAT__GL_TEXTURE_BINDING_2D_ARRAY = 0x8C1D, SAT__GL_SAMPLER_BINDING = 0x8919,
    SAT__GL_TEXTURE0 = 0x84C0, SAT__GL_ACTIVE_TEXTURE = 0x84E0, SAT__GL_TEXTURE_MAG_FILTER = 0x2800,
    SAT__GL_TEXTURE_MIN_FILTER = 0x2801, SAT__GL_TEXTURE_WRAP_S = 0x2802, SAT__GL_TEXTURE_WRAP_T = 0x2803,
    SAT__GL_TEXTURE_MAX_LEVEL = 0x813D, SAT__GL_NEAREST = 0x2600, SAT__GL_LINEAR = 0x2601, SAT__GL_REPEAT = 0x2901,
    SAT__GL_CLAMP_TO_EDGE = 0x812F,
    SAT__GL_UNSIGNED_BYTE = 0x1401, SAT__GL_UNSIGNED_SHORT = 0x1403, SAT__GL_INT = 0x1404,
    SAT__GL_UNSIGNED_INT = 0x1405, SAT__GL_FLOAT = 0x1406, SAT__GL_HALF_FLOAT = 0x140B,
    SAT__GL_DEPTH_COMPONENT = 0x1902, SAT__GL_RED = 0x1903, SAT__GL_RGB = 0x1907, SAT__GL_RGBA = 0x1908,
    SAT__GL_RG = 0x8227, SAT__GL_RG_INTEGER = 0x8228, SAT__GL_RED_INTEGER = 0x8D94, SAT__GL_RGBA_INTEGER = 0x8D99,
    SAT__GL_R8 = 0x8229, SAT__GL_RG8 = 0x822B, SAT__GL_RGBA8 = 0x8058, SAT__GL_SRGB8_ALPHA8 = 0x8C43,
    SAT__GL_R8UI = 0x8232, SAT__GL_R16F = 0x822D, SAT__GL_RG16F = 0x822F, SAT__GL_RGBA16F = 0x881A,
    SAT__GL_R32F = 0x822E, SAT__GL_RG32F = 0x8230, SAT__GL_RGB32F = 0x8815, SAT__GL_RGBA32F = 0x8814,
    SAT__GL_R32I = 0x8235, SAT__GL_R32UI = 0x8236, SAT__GL_RG32UI = 0x823C, SAT__GL_RGBA32UI = 0x8D70,
    SAT__GL_R16UI = 0x8234, SAT__GL_DEPTH_COMPONENT24 = 0x81A6, SAT__GL_DEPTH_COMPONENT32F = 0x8CAC,
    SAT__GL_RENDERER = 0x1F01, SAT__GL_VERSION = 0x1F02, SAT__GL_FRAGMENT_SHADER = 0x8B30, SAT__GL_VERTEX_SHADER = 0x8B31,
    SAT__GL_COMPUTE_SHADER = 0x91B9, SAT__GL_COMPILE_STATUS = 0x8B81, SAT__GL_LINK_STATUS = 0x8B82,
    SAT__GL_CURRENT_PROGRAM = 0x8B8D, SAT__GL_INTERLEAVED_ATTRIBS = 0x8C8C, SAT__GL_VERTEX_ARRAY_BINDING = 0x85B5,
    SAT__GL_ARRAY_BUFFER = 0x8892, SAT__GL_ARRAY_BUFFER_BINDING = 0x8894, SAT__GL_STREAM_DRAW = 0x88E0,
    SAT__GL_STATIC_DRAW = 0x88E4, SAT__GL_DYNAMIC_COPY = 0x88EA, SAT__GL_MAP_READ_BIT = 0x0001,
    SAT__GL_PIXEL_PACK_BUFFER = 0x88EB, SAT__GL_PIXEL_UNPACK_BUFFER = 0x88EC,
    SAT__GL_PIXEL_PACK_BUFFER_BINDING = 0x88ED, SAT__GL_PIXEL_UNPACK_BUFFER_BINDING = 0x88EF,
    SAT__GL_TRANSFORM_FEEDBACK_BUFFER = 0x8C8E, SAT__GL_TRANSFORM_FEEDBACK_BUFFER_BINDING = 0x8C8F,
    SAT__GL_TRANSFORM_FEEDBACK_BUFFER_START = 0x8C84, SAT__GL_TRANSFORM_FEEDBACK_BUFFER_SIZE = 0x8C85,
    SAT__GL_READ_FRAMEBUFFER = 0x8CA8, SAT__GL_DRAW_FRAMEBUFFER = 0x8CA9, SAT__GL_FRAMEBUFFER = 0x8D40,
    SAT__GL_DRAW_FRAMEBUFFER_BINDING = 0x8CA6, SAT__GL_READ_FRAMEBUFFER_BINDING = 0x8CAA,
    SAT__GL_FRAMEBUFFER_COMPLETE = 0x8CD5, SAT__GL_COLOR_ATTACHMENT0 = 0x8CE0, SAT__GL_DEPTH_ATTACHMENT = 0x8D00,
    SAT__GL_COLOR = 0x1800, SAT__GL_DEPTH = 0x1801,
    SAT__GL_TIME_ELAPSED = 0x88BF, SAT__GL_QUERY_RESULT = 0x8866, SAT__GL_QUERY_RESULT_AVAILABLE = 0x8867,
    SAT__GL_READ_ONLY = 0x88B8, SAT__GL_WRITE_ONLY = 0x88B9, SAT__GL_READ_WRITE = 0x88BA,
    SAT__GL_IMAGE_BINDING_NAME = 0x8F3A, SAT__GL_IMAGE_BINDING_LEVEL = 0x8F3B, SAT__GL_IMAGE_BINDING_LAYERED = 0x8F3C,
    SAT__GL_IMAGE_BINDING_LAYER = 0x8F3D, SAT__GL_IMAGE_BINDING_ACCESS = 0x8F3E, SAT__GL_IMAGE_BINDING_FORMAT = 0x906E,
    SAT__GL_TEXTURE_FETCH_BARRIER_BIT = 0x0008, SAT__GL_SHADER_IMAGE_ACCESS_BARRIER_BIT = 0x0020,
    SAT__GL_TEXTURE_UPDATE_BARRIER_BIT = 0x0100, SAT__GL_FRAMEBUFFER_BARRIER_BIT = 0x0400
};

/* Every function of the table, once: X(result, name without gl, arguments). These are required ... */
#define SAT__GL_FUNCTIONS(X)                                                                                           \
    X(void, ActiveTexture, (unsigned texture))                                                                         \
    X(void, AttachShader, (unsigned program, unsigned shader))                                                         \
    X(void, BeginTransformFeedback, (unsigned mode))                                                                   \
    X(void, BindBuffer, (unsigned target, unsigned buffer))                                                            \
    X(void, BindBufferBase, (unsigned target, unsigned index, unsigned buffer))                                        \
    X(void, BindBufferRange, (unsigned target, unsigned index, unsigned buffer, ptrdiff_t offset, ptrdiff_t size))     \
    X(void, BindFramebuffer, (unsigned target, unsigned framebuffer))                                                  \
    X(void, BindSampler, (unsigned unit, unsigned sampler))                                                            \
    X(void, BindTexture, (unsigned target, unsigned texture))                                                          \
    X(void, BindVertexArray, (unsigned array))                                                                         \
    X(void, BlendEquationSeparate, (unsigned rgb, unsigned alpha))                                                     \
    X(void, BlendFuncSeparate, (unsigned src_rgb, unsigned dst_rgb, unsigned src_alpha, unsigned dst_alpha))           \
    X(void, BufferData, (unsigned target, ptrdiff_t size, const void *data, unsigned usage))                           \
    X(void, BufferSubData, (unsigned target, ptrdiff_t offset, ptrdiff_t size, const void *data))                      \
    X(unsigned, CheckFramebufferStatus, (unsigned target))                                                             \
    X(void, ClearBufferfv, (unsigned buffer, int index, const float *value))                                           \
    X(void, ClearBufferuiv, (unsigned buffer, int index, const unsigned *value))                                       \
    X(void, ColorMask, (unsigned char r, unsigned char g, unsigned char b, unsigned char a))                           \
    X(void, CompileShader, (unsigned shader))                                                                          \
    X(unsigned, CreateProgram, (void))                                                                                 \
    X(unsigned, CreateShader, (unsigned type))                                                                         \
    X(void, DeleteBuffers, (int count, const unsigned *buffers))                                                       \
    X(void, DeleteFramebuffers, (int count, const unsigned *framebuffers))                                             \
    X(void, DeleteProgram, (unsigned program))                                                                         \
    X(void, DeleteShader, (unsigned shader))                                                                           \
    X(void, DeleteTextures, (int count, const unsigned *textures))                                                     \
    X(void, DeleteVertexArrays, (int count, const unsigned *arrays))                                                   \
    X(void, DepthFunc, (unsigned function))                                                                            \
    X(void, DepthMask, (unsigned char on))                                                                             \
    X(void, Disable, (unsigned capability))                                                                            \
    X(void, DisableVertexAttribArray, (unsigned index))                                                                \
    X(void, DrawArrays, (unsigned mode, int first, int count))                                                         \
    X(void, DrawArraysInstanced, (unsigned mode, int first, int count, int instances))                                 \
    X(void, DrawBuffers, (int count, const unsigned *buffers))                                                         \
    X(void, Enable, (unsigned capability))                                                                             \
    X(void, EnableVertexAttribArray, (unsigned index))                                                                 \
    X(void, EndTransformFeedback, (void))                                                                              \
    X(void, Finish, (void))                                                                                            \
    X(void, FramebufferTexture2D, (unsigned target, unsigned attachment, unsigned kind, unsigned texture, int level))  \
    X(void, FramebufferTextureLayer, (unsigned target, unsigned attachment, unsigned texture, int level, int layer))   \
    X(void, GenBuffers, (int count, unsigned *buffers))                                                                \
    X(void, GenFramebuffers, (int count, unsigned *framebuffers))                                                      \
    X(void, GenTextures, (int count, unsigned *textures))                                                              \
    X(void, GenVertexArrays, (int count, unsigned *arrays))                                                            \
    X(void, GetBooleanv, (unsigned name, unsigned char *value))                                                        \
    X(unsigned, GetError, (void))                                                                                      \
    X(void, GetInteger64i_v, (unsigned name, unsigned index, int64_t *value))                                          \
    X(void, GetIntegeri_v, (unsigned name, unsigned index, int *value))                                                \
    X(void, GetIntegerv, (unsigned name, int *value))                                                                  \
    X(void, GetProgramInfoLog, (unsigned program, int size, int *length, char *log))                                   \
    X(void, GetProgramiv, (unsigned program, unsigned name, int *value))                                               \
    X(void, GetShaderInfoLog, (unsigned shader, int size, int *length, char *log))                                     \
    X(void, GetShaderiv, (unsigned shader, unsigned name, int *value))                                                 \
    X(const unsigned char *, GetString, (unsigned name))                                                               \
    X(int, GetUniformLocation, (unsigned program, const char *name))                                                   \
    X(unsigned char, IsEnabled, (unsigned capability))                                                                 \
    X(void, LinkProgram, (unsigned program))                                                                           \
    X(void *, MapBufferRange, (unsigned target, ptrdiff_t offset, ptrdiff_t size, unsigned access))                    \
    X(void, PixelStorei, (unsigned name, int value))                                                                   \
    X(void, ReadBuffer, (unsigned source))                                                                             \
    X(void, ReadPixels, (int x, int y, int width, int height, unsigned format, unsigned type, void *pixels))           \
    X(void, Scissor, (int x, int y, int width, int height))                                                            \
    X(void, ShaderSource, (unsigned shader, int count, const char *const *parts, const int *lengths))                  \
    X(void, TexImage2D, (unsigned target, int level, int internal, int width, int height, int border, unsigned format, \
                         unsigned type, const void *pixels))                                                           \
    X(void, TexImage3D, (unsigned target, int level, int internal, int width, int height, int depth, int border,       \
                         unsigned format, unsigned type, const void *pixels))                                          \
    X(void, TexParameteri, (unsigned target, unsigned name, int value))                                                \
    X(void, TexSubImage2D, (unsigned target, int level, int x, int y, int width, int height, unsigned format,          \
                            unsigned type, const void *pixels))                                                        \
    X(void, TexSubImage3D, (unsigned target, int level, int x, int y, int z, int width, int height, int depth,         \
                            unsigned format, unsigned type, const void *pixels))                                       \
    X(void, TransformFeedbackVaryings, (unsigned program, int count, const char *const *names, unsigned mode))         \
    X(void, Uniform1f, (int location, float x))                                                                        \
    X(void, Uniform2f, (int location, float x, float y))                                                               \
    X(void, Uniform3f, (int location, float x, float y, float z))                                                      \
    X(void, Uniform4f, (int location, float x, float y, float z, float w))                                             \
    X(void, Uniform1i, (int location, int x))                                                                          \
    X(void, Uniform2i, (int location, int x, int y))                                                                   \
    X(void, Uniform4i, (int location, int x, int y, int z, int w))                                                     \
    X(void, Uniform1ui, (int location, unsigned x))                                                                    \
    X(void, Uniform1fv, (int location, int count, const float *values))                                                \
    X(void, Uniform3fv, (int location, int count, const float *values))                                                \
    X(void, Uniform4fv, (int location, int count, const float *values))                                                \
    X(void, UniformMatrix3fv, (int location, int count, unsigned char transpose, const float *values))                 \
    X(void, UniformMatrix4fv, (int location, int count, unsigned char transpose, const float *values))                 \
    X(unsigned char, UnmapBuffer, (unsigned target))                                                                   \
    X(void, UseProgram, (unsigned program))                                                                            \
    X(void, VertexAttribDivisor, (unsigned index, unsigned divisor))                                                   \
    X(void, VertexAttribPointer, (unsigned index, int size, unsigned type, unsigned char normalized, int stride,       \
                                  const void *offset))                                                                 \
    X(void, Viewport, (int x, int y, int width, int height))

/* ... and these may be NULL: has_timer and has_compute say whether the last two groups may be called. */
#define SAT__GL_OPTIONAL_FUNCTIONS(X)                                                                                  \
    X(void, PolygonMode, (unsigned face, unsigned mode))                                                               \
    X(void, GenQueries, (int count, unsigned *queries))                                                                \
    X(void, DeleteQueries, (int count, const unsigned *queries))                                                       \
    X(void, BeginQuery, (unsigned target, unsigned query))                                                             \
    X(void, EndQuery, (unsigned target))                                                                               \
    X(void, GetQueryObjectui64v, (unsigned query, unsigned name, uint64_t *value))                                     \
    X(void, BindImageTexture, (unsigned unit, unsigned texture, int level, unsigned char layered, int layer,           \
                               unsigned access, unsigned format))                                                      \
    X(void, DispatchCompute, (unsigned x, unsigned y, unsigned z))                                                     \
    X(void, MemoryBarrier, (unsigned barriers))

enum {
    SAT__GL_UNITS = 16,  /* texture units that sat__gl_begin can save; more than any of the six needs */
    SAT__GL_IMAGES = 4,  /* image units of compute shaders, the same */
    SAT__GL_TARGETS = 4  /* colour attachments of one framebuffer */
};

/* The function table and what else belongs to one context. */
#define SAT__GL_MEMBER(result, name, arguments) result(SAT__GL_CALL *name) arguments;
typedef struct sat__gl {
    SAT__GL_FUNCTIONS(SAT__GL_MEMBER)
    SAT__GL_OPTIONAL_FUNCTIONS(SAT__GL_MEMBER)
    int is_es, version;         /* OpenGL ES; 10 major + minor, as 33, 43, 30 */
    int has_timer, has_compute; /* GL 3.3 timer queries; GL 4.3 compute shaders */
    int max_size;               /* largest width and height of a texture */
    unsigned vertex_array;      /* without any attribute: what full-screen passes draw with */
    unsigned framebuffer;       /* for sat__gl_read and sat__gl_attach */
    char defines[1024];         /* #define lines for the next sat__gl_build */
    char message[8192];         /* one sentence; for shaders the log and the numbered source follow. Never NULL */
} sat__gl;

/* ---- messages and the function table */

/* Keeps the sentence "what (name)" for X_gl_message and hands the result through. */
static inline sat_result sat__gl_fail(sat__gl *gl, sat_result result, const char *what, const char *name)
{
    snprintf(gl->message, sizeof gl->message, name && *name ? "%s (%s)" : "%s", what, name);
    return result;
}

/* Forgets errors of earlier calls, so that sat__gl_check blames nobody for them. */
static inline void sat__gl_clear_errors(sat__gl *gl)
{
    int i;
    for (i = 0; i < 16 && gl->GetError() != SAT__GL_NO_ERROR; i++) {}
}

/* SAT_ERR_GL_STATE when OpenGL reports an error. Waits for nothing, but call it when creating, not in every frame. */
static inline sat_result sat__gl_check(sat__gl *gl, const char *what)
{
    unsigned error = gl->GetError();
    char number[24];
    if (error == SAT__GL_NO_ERROR) return SAT_OK;
    snprintf(number, sizeof number, "error 0x%04x", error);
    return sat__gl_fail(gl, SAT_ERR_GL_STATE, what, number);
}

/* "4.5 (Core Profile) ..." or "OpenGL ES 3.2 ...". */
static inline int sat__gl_parse_version(const char *text, int *is_es)
{
    *is_es = strncmp(text, "OpenGL ES", 9) == 0;
    while (*text && (*text < '0' || *text > '9')) text++;
    return text[0] && text[1] == '.' && text[2] >= '0' && text[2] <= '9' ? 10 * (text[0] - '0') + (text[2] - '0') : 0;
}

#define SAT__GL_LOAD(result, name, arguments)                                                                          \
    gl->name = (result(SAT__GL_CALL *) arguments)get_proc("gl" #name);                                                 \
    if (!gl->name && !missing) missing = "gl" #name;
#define SAT__GL_LOAD_OPTIONAL(result, name, arguments) gl->name = (result(SAT__GL_CALL *) arguments)get_proc("gl" #name);

/* Fills the table for the current context. On an error nothing is left behind but the message. */
static inline sat_result sat__gl_open(sat__gl *gl, sat_gl_get_proc *get_proc)
{
    const char *missing = NULL, *version, *renderer;
    memset(gl, 0, sizeof *gl);
    if (!get_proc) return sat__gl_fail(gl, SAT_ERR_ARGUMENT, "get_proc is NULL", NULL);
    SAT__GL_FUNCTIONS(SAT__GL_LOAD)
    if (missing) return sat__gl_fail(gl, SAT_ERR_GL_FUNCTION, "the context lacks a function", missing);
    SAT__GL_OPTIONAL_FUNCTIONS(SAT__GL_LOAD_OPTIONAL)
    version = (const char *)gl->GetString(SAT__GL_VERSION);
    if (!version) return sat__gl_fail(gl, SAT_ERR_GL_STATE, "no OpenGL context is current", NULL);
    gl->version = sat__gl_parse_version(version, &gl->is_es);
    if (gl->version < (gl->is_es ? 30 : 33))
        return sat__gl_fail(gl, SAT_ERR_GL_STATE, "OpenGL 3.3 or OpenGL ES 3.0 is needed", version);
    renderer = (const char *)gl->GetString(SAT__GL_RENDERER); /* llvmpipe's timer is wrong at times */
    gl->has_timer = !gl->is_es && !(renderer && strstr(renderer, "llvmpipe")) && gl->GenQueries && gl->DeleteQueries &&
                    gl->BeginQuery && gl->EndQuery && gl->GetQueryObjectui64v;
    gl->has_compute = !gl->is_es && gl->version >= 43 && gl->BindImageTexture && gl->DispatchCompute && gl->MemoryBarrier;
    gl->GetIntegerv(SAT__GL_MAX_TEXTURE_SIZE, &gl->max_size);
    sat__gl_clear_errors(gl);
    gl->GenVertexArrays(1, &gl->vertex_array);
    gl->GenFramebuffers(1, &gl->framebuffer);
    return SAT_OK;
}

/* Harmless after a failed or missing sat__gl_open of a zeroed sat__gl, and when called twice. */
static inline void sat__gl_close(sat__gl *gl)
{
    if (gl->vertex_array) gl->DeleteVertexArrays(1, &gl->vertex_array);
    if (gl->framebuffer) gl->DeleteFramebuffers(1, &gl->framebuffer);
    gl->vertex_array = gl->framebuffer = 0;
}

/* ---- programs */

/* Shader text: lists of strings (each below 4096 bytes) that end with NULL; a NULL list is an empty one. The
   #version line, the precision of ES and the pending #define lines go in front, then `library`, in every stage. */
typedef struct sat__gl_shaders {
    const char *name;              /* for messages, such as "ssao_sat: accessibility" */
    const char *const *library;    /* what sat_gl_glsl() and its like give */
    const char *const *vertex;     /* NULL: a triangle over the whole viewport; use gl_FragCoord */
    const char *const *fragment;   /* NULL: draws nothing, for transform feedback */
    const char *const *compute;    /* not NULL: a compute program, and the others are not looked at */
    const char *const *varyings;   /* not NULL: captured by transform feedback, interleaved */
} sat__gl_shaders;

/* "#define name value" for the next sat__gl_build, which consumes all of them. */
static inline void sat__gl_define(sat__gl *gl, const char *name, int value)
{
    size_t used = strlen(gl->defines);
    SAT_ASSERT(used + strlen(name) + 24 < sizeof gl->defines);
    snprintf(gl->defines + used, sizeof gl->defines - used, "#define %s %d\n", name, value);
}

/* The same for a float, bit by bit: locales write decimal points as they like. */
static inline void sat__gl_define_float(sat__gl *gl, const char *name, float value)
{
    size_t used = strlen(gl->defines);
    SAT_ASSERT(used + strlen(name) + 40 < sizeof gl->defines);
    snprintf(gl->defines + used, sizeof gl->defines - used, "#define %s uintBitsToFloat(0x%08xu)\n", name,
             (unsigned)sat__float_bits(value));
}

static inline int sat__gl_add_parts(const char **parts, int count, const char *const *list)
{
    for (; list && *list && count < 64; list++) parts[count++] = *list;
    return count;
}

/* Appends the numbered source to the message, as far as it fits. */
static inline void sat__gl_explain(sat__gl *gl, const char *const *parts, int count)
{
    size_t used = strlen(gl->message), room = sizeof gl->message - 1;
    int i, line = 0, fresh = 1;
    for (i = 0; i < count; i++) {
        const char *p;
        for (p = parts[i]; *p && used + 8 < room; p++) {
            if (fresh) used += (size_t)snprintf(gl->message + used, room - used, "\n%3d ", ++line);
            fresh = *p == '\n';
            if (!fresh) gl->message[used++] = *p;
        }
    }
    gl->message[used] = 0;
#ifdef SAT_GL_DUMP
    fprintf(stderr, "%s\n", gl->message);
#endif
}

/* One shader, or 0 with the log and the source in the message. */
static inline unsigned sat__gl_compile(sat__gl *gl, unsigned type, const sat__gl_shaders *shaders, const char *const *text)
{
    static const char es_precision[] = "precision highp float;\nprecision highp int;\nprecision highp sampler2D;\n"
                                       "precision highp isampler2D;\nprecision highp usampler2D;\nprecision highp sampler2DArray;\n";
    const char *parts[64];
    int count = 0, ok = 0;
    unsigned shader = gl->CreateShader(type);
    if (gl->is_es) {
        parts[count++] = "#version 300 es\n";
        parts[count++] = es_precision;
    } else {
        parts[count++] = type == SAT__GL_COMPUTE_SHADER ? "#version 430 core\n" : "#version 330 core\n";
    }
    parts[count++] = gl->defines;
    count = sat__gl_add_parts(parts, count, shaders->library);
    count = sat__gl_add_parts(parts, count, text);
    gl->ShaderSource(shader, count, parts, NULL);
    gl->CompileShader(shader);
    gl->GetShaderiv(shader, SAT__GL_COMPILE_STATUS, &ok);
    if (!ok) {
        char log[2048] = "";
        gl->GetShaderInfoLog(shader, (int)sizeof log, NULL, log);
        snprintf(gl->message, sizeof gl->message, "%s: a %s shader does not compile\n%s", shaders->name,
                 type == SAT__GL_VERTEX_SHADER ? "vertex" : type == SAT__GL_COMPUTE_SHADER ? "compute" : "fragment", log);
        sat__gl_explain(gl, parts, count);
        gl->DeleteShader(shader);
        return 0;
    }
    return shader;
}

static inline sat_result sat__gl_link(sat__gl *gl, unsigned program, const sat__gl_shaders *shaders)
{
    int ok = 0;
    gl->LinkProgram(program);
    gl->GetProgramiv(program, SAT__GL_LINK_STATUS, &ok);
    if (!ok) {
        char log[2048] = "";
        gl->GetProgramInfoLog(program, (int)sizeof log, NULL, log);
        snprintf(gl->message, sizeof gl->message, "%s: the program does not link\n%s", shaders->name, log);
#ifdef SAT_GL_DUMP
        fprintf(stderr, "%s\n", gl->message);
#endif
        return SAT_ERR_GL_SHADER;
    }
    return SAT_OK;
}

/* *program is 0 on an error. Delete it with gl->DeleteProgram. */
static inline sat_result sat__gl_build(sat__gl *gl, unsigned *program, const sat__gl_shaders *shaders)
{
    static const char *const triangle[] = {
        "void main() {\n"
        "    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);\n"
        "}\n", NULL};
    static const char *const nothing[] = {"void main() {}\n", NULL};
    sat__gl_shaders plain = *shaders;
    unsigned stage[2] = {0, 0};
    sat_result result = SAT_ERR_GL_SHADER;
    int i, stages = shaders->compute ? 1 : 2, count = 0;
    plain.library = NULL;
    *program = 0;
    if (shaders->compute) stage[0] = sat__gl_compile(gl, SAT__GL_COMPUTE_SHADER, shaders, shaders->compute);
    else if (shaders->vertex) stage[0] = sat__gl_compile(gl, SAT__GL_VERTEX_SHADER, shaders, shaders->vertex);
    else stage[0] = sat__gl_compile(gl, SAT__GL_VERTEX_SHADER, &plain, triangle);
    if (stage[0] && stages == 2)
        stage[1] = shaders->fragment ? sat__gl_compile(gl, SAT__GL_FRAGMENT_SHADER, shaders, shaders->fragment)
                                     : sat__gl_compile(gl, SAT__GL_FRAGMENT_SHADER, &plain, nothing);
    if (stage[stages - 1]) {
        *program = gl->CreateProgram();
        for (i = 0; i < stages; i++) gl->AttachShader(*program, stage[i]);
        while (shaders->varyings && shaders->varyings[count]) count++;
        if (count) gl->TransformFeedbackVaryings(*program, count, shaders->varyings, SAT__GL_INTERLEAVED_ATTRIBS);
        result = sat__gl_link(gl, *program, shaders);
    }
    for (i = 0; i < stages; i++)
        if (stage[i]) gl->DeleteShader(stage[i]); /* lives on in the program */
    if (result != SAT_OK && *program) {
        gl->DeleteProgram(*program);
        *program = 0;
    }
    gl->defines[0] = 0;
    return result;
}

/* ---- textures, framebuffers. These change bindings: call them between sat__gl_begin and sat__gl_end. */

/* The client format and type that belong to a sized internal format: floats for the float formats (half floats
   too), 32-bit integers for the 32-bit integer ones, bytes for the 8-bit ones. Returns the bytes of a pixel. */
static inline int sat__gl_transfer(unsigned internal, unsigned *format, unsigned *type)
{
    static const struct { unsigned internal, format, type; int bytes; } table[] = {
        {SAT__GL_R8, SAT__GL_RED, SAT__GL_UNSIGNED_BYTE, 1},
        {SAT__GL_RG8, SAT__GL_RG, SAT__GL_UNSIGNED_BYTE, 2},
        {SAT__GL_RGBA8, SAT__GL_RGBA, SAT__GL_UNSIGNED_BYTE, 4},
        {SAT__GL_SRGB8_ALPHA8, SAT__GL_RGBA, SAT__GL_UNSIGNED_BYTE, 4},
        {SAT__GL_R8UI, SAT__GL_RED_INTEGER, SAT__GL_UNSIGNED_BYTE, 1},
        {SAT__GL_R16UI, SAT__GL_RED_INTEGER, SAT__GL_UNSIGNED_SHORT, 2},
        {SAT__GL_R16F, SAT__GL_RED, SAT__GL_FLOAT, 4},
        {SAT__GL_RG16F, SAT__GL_RG, SAT__GL_FLOAT, 8},
        {SAT__GL_RGBA16F, SAT__GL_RGBA, SAT__GL_FLOAT, 16},
        {SAT__GL_R32F, SAT__GL_RED, SAT__GL_FLOAT, 4},
        {SAT__GL_RG32F, SAT__GL_RG, SAT__GL_FLOAT, 8},
        {SAT__GL_RGB32F, SAT__GL_RGB, SAT__GL_FLOAT, 12}, /* not a render target everywhere */
        {SAT__GL_RGBA32F, SAT__GL_RGBA, SAT__GL_FLOAT, 16},
        {SAT__GL_R32I, SAT__GL_RED_INTEGER, SAT__GL_INT, 4},
        {SAT__GL_R32UI, SAT__GL_RED_INTEGER, SAT__GL_UNSIGNED_INT, 4},
        {SAT__GL_RG32UI, SAT__GL_RG_INTEGER, SAT__GL_UNSIGNED_INT, 8},
        {SAT__GL_RGBA32UI, SAT__GL_RGBA_INTEGER, SAT__GL_UNSIGNED_INT, 16},
        {SAT__GL_DEPTH_COMPONENT24, SAT__GL_DEPTH_COMPONENT, SAT__GL_UNSIGNED_INT, 4},
        {SAT__GL_DEPTH_COMPONENT32F, SAT__GL_DEPTH_COMPONENT, SAT__GL_FLOAT, 4}};
    size_t i;
    for (i = 0; i < sizeof table / sizeof *table; i++)
        if (table[i].internal == internal) {
            *format = table[i].format;
            *type = table[i].type;
            return table[i].bytes;
        }
    SAT_ASSERT(0 && "internal format not in the table");
    return 0;
}

/* A 2D texture without mipmaps, nearest filter, clamped to the edge; pixels (packed rows, the first row at
   v = 0) may be NULL. *texture is 0 on an error. Delete it with gl->DeleteTextures. */
static inline sat_result sat__gl_texture(sat__gl *gl, unsigned *texture, unsigned internal, int width, int height,
                                         const void *pixels)
{
    unsigned format = 0, type = 0;
    sat_result result;
    *texture = 0;
    if (width < 1 || height < 1 || width > gl->max_size || height > gl->max_size)
        return sat__gl_fail(gl, SAT_ERR_SIZE, "the context's largest texture is smaller than that", NULL);
    sat__gl_transfer(internal, &format, &type);
    gl->GenTextures(1, texture);
    gl->ActiveTexture(SAT__GL_TEXTURE0);
    gl->BindTexture(SAT__GL_TEXTURE_2D, *texture);
    gl->TexImage2D(SAT__GL_TEXTURE_2D, 0, (int)internal, width, height, 0, format, type, pixels);
    gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_MAX_LEVEL, 0);
    gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_MIN_FILTER, SAT__GL_NEAREST);
    gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_MAG_FILTER, SAT__GL_NEAREST);
    gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_WRAP_S, SAT__GL_CLAMP_TO_EDGE);
    gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_WRAP_T, SAT__GL_CLAMP_TO_EDGE);
    result = sat__gl_check(gl, "OpenGL refused a texture");
    if (result != SAT_OK) {
        gl->DeleteTextures(1, texture);
        *texture = 0;
    }
    return result;
}

/* Replaces all pixels. */
static inline void sat__gl_upload(sat__gl *gl, unsigned texture, unsigned internal, int width, int height, const void *pixels)
{
    unsigned format = 0, type = 0;
    sat__gl_transfer(internal, &format, &type);
    gl->ActiveTexture(SAT__GL_TEXTURE0);
    gl->BindTexture(SAT__GL_TEXTURE_2D, texture);
    gl->TexSubImage2D(SAT__GL_TEXTURE_2D, 0, 0, 0, width, height, format, type, pixels);
}

/* Binds a framebuffer and gives it `count` colour attachments and, unless 0, a depth texture. */
static inline sat_result sat__gl_attach(sat__gl *gl, unsigned framebuffer, const unsigned *textures, int count, unsigned depth)
{
    unsigned buffers[SAT__GL_TARGETS], status;
    char number[24];
    int i;
    SAT_ASSERT(count >= 0 && count <= SAT__GL_TARGETS);
    gl->BindFramebuffer(SAT__GL_FRAMEBUFFER, framebuffer);
    for (i = 0; i < count; i++) {
        buffers[i] = SAT__GL_COLOR_ATTACHMENT0 + (unsigned)i;
        gl->FramebufferTexture2D(SAT__GL_FRAMEBUFFER, buffers[i], SAT__GL_TEXTURE_2D, textures[i], 0);
    }
    gl->FramebufferTexture2D(SAT__GL_FRAMEBUFFER, SAT__GL_DEPTH_ATTACHMENT, SAT__GL_TEXTURE_2D, depth, 0);
    gl->DrawBuffers(count, buffers);
    gl->ReadBuffer(count ? buffers[0] : 0u);
    status = gl->CheckFramebufferStatus(SAT__GL_FRAMEBUFFER);
    if (status == SAT__GL_FRAMEBUFFER_COMPLETE) return SAT_OK;
    snprintf(number, sizeof number, "status 0x%04x", status);
    return sat__gl_fail(gl, SAT_ERR_GL_STATE, "OpenGL refused a framebuffer", number);
}

/* A framebuffer of 1 to 4 textures of one size, and a depth texture unless 0. *framebuffer is 0 on an error.
   Delete it with gl->DeleteFramebuffers, before its textures. */
static inline sat_result sat__gl_framebuffer(sat__gl *gl, unsigned *framebuffer, const unsigned *textures, int count,
                                             unsigned depth)
{
    sat_result result;
    gl->GenFramebuffers(1, framebuffer);
    result = sat__gl_attach(gl, *framebuffer, textures, count, depth);
    if (result != SAT_OK) {
        gl->DeleteFramebuffers(1, framebuffer);
        *framebuffer = 0;
    }
    return result;
}

/* Copies a texture into packed rows; waits for the GPU. Some ES drivers read only RGBA back. */
static inline sat_result sat__gl_read(sat__gl *gl, void *pixels, unsigned texture, unsigned internal, int width, int height)
{
    unsigned format = 0, type = 0;
    sat_result result = sat__gl_attach(gl, gl->framebuffer, &texture, 1, 0);
    if (result != SAT_OK) return result;
    sat__gl_transfer(internal, &format, &type);
    gl->ReadPixels(0, 0, width, height, format, type, pixels);
    texture = 0;
    gl->FramebufferTexture2D(SAT__GL_FRAMEBUFFER, SAT__GL_COLOR_ATTACHMENT0, SAT__GL_TEXTURE_2D, texture, 0);
    return sat__gl_check(gl, "OpenGL refused to read a texture back");
}

/* ---- passes */

/* Starts a pass: program, framebuffer (0: the default one) and the part of it to draw into. */
static inline void sat__gl_pass(sat__gl *gl, unsigned program, unsigned framebuffer, int width, int height)
{
    gl->UseProgram(program);
    gl->BindFramebuffer(SAT__GL_FRAMEBUFFER, framebuffer);
    gl->Viewport(0, 0, width, height);
}

/* Every pixel of the viewport once. */
static inline void sat__gl_draw(sat__gl *gl)
{
    gl->BindVertexArray(gl->vertex_array);
    gl->DrawArrays(SAT__GL_TRIANGLES, 0, 3);
}

/* Uniforms of the program of the pass, by name; names the compiler dropped are ignored. In a loop over many passes
   ask GetUniformLocation once and call gl->Uniform... instead. */
static inline void sat__gl_set_int(sat__gl *gl, unsigned program, const char *name, int x)
{
    gl->Uniform1i(gl->GetUniformLocation(program, name), x);
}

static inline void sat__gl_set_int2(sat__gl *gl, unsigned program, const char *name, int x, int y)
{
    gl->Uniform2i(gl->GetUniformLocation(program, name), x, y);
}

static inline void sat__gl_set_uint(sat__gl *gl, unsigned program, const char *name, unsigned x)
{
    gl->Uniform1ui(gl->GetUniformLocation(program, name), x);
}

static inline void sat__gl_set_float(sat__gl *gl, unsigned program, const char *name, float x)
{
    gl->Uniform1f(gl->GetUniformLocation(program, name), x);
}

static inline void sat__gl_set_float2(sat__gl *gl, unsigned program, const char *name, float x, float y)
{
    gl->Uniform2f(gl->GetUniformLocation(program, name), x, y);
}

static inline void sat__gl_set_float3(sat__gl *gl, unsigned program, const char *name, const float *v)
{
    gl->Uniform3fv(gl->GetUniformLocation(program, name), 1, v);
}

static inline void sat__gl_set_float4(sat__gl *gl, unsigned program, const char *name, const float *v)
{
    gl->Uniform4fv(gl->GetUniformLocation(program, name), 1, v);
}

/* 16 floats, column after column */
static inline void sat__gl_set_matrix4(sat__gl *gl, unsigned program, const char *name, const float *m)
{
    gl->UniformMatrix4fv(gl->GetUniformLocation(program, name), 1, 0, m);
}

/* Binds a 2D texture to a unit below the number given to sat__gl_begin, without a sampler object, and tells the
   sampler uniform. */
static inline void sat__gl_set_texture(sat__gl *gl, unsigned program, const char *name, int unit, unsigned texture)
{
    gl->ActiveTexture(SAT__GL_TEXTURE0 + (unsigned)unit);
    gl->BindTexture(SAT__GL_TEXTURE_2D, texture);
    gl->BindSampler((unsigned)unit, 0);
    gl->Uniform1i(gl->GetUniformLocation(program, name), unit);
}

/* ---- state: what the passes may touch, saved before and put back after

   program; vertex array; draw and read framebuffer; viewport; for the first `units` texture units the 2D and the
   2D array texture and the sampler; active texture; the capabilities and pixel store values listed below; blend
   function and equation; depth function and mask; colour mask; polygon mode; array, pixel pack and unpack buffer;
   transform feedback buffer 0 and the general one; with compute shaders the first SAT__GL_IMAGES image units.
   Not saved, so leave them alone: clear values (use gl->ClearBufferfv), scissor box (disabled), stencil, everything
   else. Blending and colour masks set per attachment come back as those of attachment 0. Call outside conditional
   rendering and of active transform feedback. */

enum { SAT__GL_CAPABILITIES = 12, SAT__GL_STORES = 12 };

typedef struct sat__gl_state {
    int units, program, vertex_array, draw_framebuffer, read_framebuffer, active_texture;
    int viewport[4], blend[6], depth_function, polygon_mode[2];
    int textures[SAT__GL_UNITS][3]; /* 2D, 2D array, sampler */
    int stores[SAT__GL_STORES], buffers[4]; /* array, pixel pack, pixel unpack, transform feedback */
    int feedback;
    int64_t feedback_start, feedback_size;
    int images[SAT__GL_IMAGES][6];
    unsigned char capabilities[SAT__GL_CAPABILITIES], color_mask[4], depth_mask;
} sat__gl_state;

/* The ones that ES does not have come last. */
static inline const unsigned *sat__gl_capability_names(const sat__gl *gl, int *count)
{
    static const unsigned names[SAT__GL_CAPABILITIES] = {
        SAT__GL_BLEND, SAT__GL_DEPTH_TEST, SAT__GL_CULL_FACE, SAT__GL_SCISSOR_TEST, SAT__GL_STENCIL_TEST, SAT__GL_DITHER,
        SAT__GL_RASTERIZER_DISCARD, SAT__GL_SAMPLE_ALPHA_TO_COVERAGE, SAT__GL_SAMPLE_COVERAGE,
        SAT__GL_COLOR_LOGIC_OP, SAT__GL_FRAMEBUFFER_SRGB, SAT__GL_PROGRAM_POINT_SIZE};
    *count = gl->is_es ? SAT__GL_CAPABILITIES - 3 : SAT__GL_CAPABILITIES;
    return names;
}

static inline const unsigned *sat__gl_store_names(const sat__gl *gl, int *count)
{
    static const unsigned names[SAT__GL_STORES] = {
        SAT__GL_UNPACK_ALIGNMENT, SAT__GL_PACK_ALIGNMENT, /* set to 1 by sat__gl_begin, all others to 0 */
        SAT__GL_UNPACK_ROW_LENGTH, SAT__GL_UNPACK_SKIP_ROWS, SAT__GL_UNPACK_SKIP_PIXELS, SAT__GL_UNPACK_SKIP_IMAGES,
        SAT__GL_UNPACK_IMAGE_HEIGHT, SAT__GL_PACK_ROW_LENGTH, SAT__GL_PACK_SKIP_ROWS, SAT__GL_PACK_SKIP_PIXELS,
        SAT__GL_UNPACK_SWAP_BYTES, SAT__GL_PACK_SWAP_BYTES};
    *count = gl->is_es ? SAT__GL_STORES - 2 : SAT__GL_STORES;
    return names;
}

static inline const unsigned *sat__gl_blend_names(void)
{
    static const unsigned names[6] = {SAT__GL_BLEND_SRC_RGB, SAT__GL_BLEND_DST_RGB, SAT__GL_BLEND_SRC_ALPHA,
                                      SAT__GL_BLEND_DST_ALPHA, SAT__GL_BLEND_EQUATION_RGB, SAT__GL_BLEND_EQUATION_ALPHA};
    return names;
}

/* The target of a buffer and the name of its binding, in pairs, as in sat__gl_state.buffers. */
static inline const unsigned *sat__gl_buffer_names(void)
{
    static const unsigned names[8] = {SAT__GL_ARRAY_BUFFER, SAT__GL_ARRAY_BUFFER_BINDING,
                                      SAT__GL_PIXEL_PACK_BUFFER, SAT__GL_PIXEL_PACK_BUFFER_BINDING,
                                      SAT__GL_PIXEL_UNPACK_BUFFER, SAT__GL_PIXEL_UNPACK_BUFFER_BINDING,
                                      SAT__GL_TRANSFORM_FEEDBACK_BUFFER, SAT__GL_TRANSFORM_FEEDBACK_BUFFER_BINDING};
    return names;
}

static inline const unsigned *sat__gl_image_names(void)
{
    static const unsigned names[6] = {SAT__GL_IMAGE_BINDING_NAME, SAT__GL_IMAGE_BINDING_LEVEL, SAT__GL_IMAGE_BINDING_LAYERED,
                                      SAT__GL_IMAGE_BINDING_LAYER, SAT__GL_IMAGE_BINDING_ACCESS, SAT__GL_IMAGE_BINDING_FORMAT};
    return names;
}

static inline void sat__gl_save_textures(sat__gl *gl, sat__gl_state *state)
{
    int i, j;
    gl->GetIntegerv(SAT__GL_ACTIVE_TEXTURE, &state->active_texture);
    for (i = 0; i < state->units; i++) {
        gl->ActiveTexture(SAT__GL_TEXTURE0 + (unsigned)i);
        gl->GetIntegerv(SAT__GL_TEXTURE_BINDING_2D, &state->textures[i][0]);
        gl->GetIntegerv(SAT__GL_TEXTURE_BINDING_2D_ARRAY, &state->textures[i][1]);
        gl->GetIntegerv(SAT__GL_SAMPLER_BINDING, &state->textures[i][2]);
    }
    for (i = 0; gl->has_compute && i < SAT__GL_IMAGES; i++)
        for (j = 0; j < 6; j++) gl->GetIntegeri_v(sat__gl_image_names()[j], (unsigned)i, &state->images[i][j]);
}

static inline void sat__gl_save_pipeline(sat__gl *gl, sat__gl_state *state)
{
    const unsigned *names;
    int i, count;
    gl->GetIntegerv(SAT__GL_CURRENT_PROGRAM, &state->program);
    gl->GetIntegerv(SAT__GL_VERTEX_ARRAY_BINDING, &state->vertex_array);
    gl->GetIntegerv(SAT__GL_DRAW_FRAMEBUFFER_BINDING, &state->draw_framebuffer);
    gl->GetIntegerv(SAT__GL_READ_FRAMEBUFFER_BINDING, &state->read_framebuffer);
    gl->GetIntegerv(SAT__GL_VIEWPORT, state->viewport);
    gl->GetIntegerv(SAT__GL_DEPTH_FUNC, &state->depth_function);
    gl->GetBooleanv(SAT__GL_DEPTH_WRITEMASK, &state->depth_mask);
    gl->GetBooleanv(SAT__GL_COLOR_WRITEMASK, state->color_mask);
    if (!gl->is_es) gl->GetIntegerv(SAT__GL_POLYGON_MODE, state->polygon_mode);
    for (i = 0; i < 6; i++) gl->GetIntegerv(sat__gl_blend_names()[i], &state->blend[i]);
    names = sat__gl_capability_names(gl, &count);
    for (i = 0; i < count; i++) state->capabilities[i] = gl->IsEnabled(names[i]);
}

static inline void sat__gl_save_buffers(sat__gl *gl, sat__gl_state *state)
{
    const unsigned *names = sat__gl_store_names(gl, &state->feedback);
    int i, count = state->feedback;
    for (i = 0; i < count; i++) gl->GetIntegerv(names[i], &state->stores[i]);
    for (i = 0; i < 4; i++) gl->GetIntegerv(sat__gl_buffer_names()[2 * i + 1], &state->buffers[i]);
    gl->GetIntegeri_v(SAT__GL_TRANSFORM_FEEDBACK_BUFFER_BINDING, 0, &state->feedback);
    gl->GetInteger64i_v(SAT__GL_TRANSFORM_FEEDBACK_BUFFER_START, 0, &state->feedback_start);
    gl->GetInteger64i_v(SAT__GL_TRANSFORM_FEEDBACK_BUFFER_SIZE, 0, &state->feedback_size);
}

/* Saves the state and sets what full-screen passes and transfers expect: everything off, full masks, packed rows. */
static inline void sat__gl_begin(sat__gl *gl, sat__gl_state *state, int units)
{
    const unsigned *names;
    int i, count;
    SAT_ASSERT(units >= 1 && units <= SAT__GL_UNITS);
    memset(state, 0, sizeof *state);
    state->units = units;
    sat__gl_clear_errors(gl);
    sat__gl_save_textures(gl, state);
    sat__gl_save_pipeline(gl, state);
    sat__gl_save_buffers(gl, state);
    names = sat__gl_capability_names(gl, &count);
    for (i = 0; i < count; i++)
        if (state->capabilities[i]) gl->Disable(names[i]);
    names = sat__gl_store_names(gl, &count);
    for (i = 0; i < count; i++) gl->PixelStorei(names[i], i < 2);
    for (i = 1; i < 3; i++) gl->BindBuffer(sat__gl_buffer_names()[2 * i], 0);
    if (!gl->is_es && gl->PolygonMode) gl->PolygonMode(SAT__GL_FRONT_AND_BACK, SAT__GL_FILL);
    gl->ColorMask(1, 1, 1, 1);
    gl->DepthMask(1);
    gl->BindVertexArray(gl->vertex_array);
}

static inline void sat__gl_restore_textures(sat__gl *gl, const sat__gl_state *state)
{
    int i;
    for (i = 0; i < state->units; i++) {
        gl->ActiveTexture(SAT__GL_TEXTURE0 + (unsigned)i);
        gl->BindTexture(SAT__GL_TEXTURE_2D, (unsigned)state->textures[i][0]);
        gl->BindTexture(SAT__GL_TEXTURE_2D_ARRAY, (unsigned)state->textures[i][1]);
        gl->BindSampler((unsigned)i, (unsigned)state->textures[i][2]);
    }
    gl->ActiveTexture((unsigned)state->active_texture);
    for (i = 0; gl->has_compute && i < SAT__GL_IMAGES; i++) {
        const int *v = state->images[i];
        gl->BindImageTexture((unsigned)i, (unsigned)v[0], v[1], (unsigned char)v[2], v[3], (unsigned)v[4], (unsigned)v[5]);
    }
}

static inline void sat__gl_restore_pipeline(sat__gl *gl, const sat__gl_state *state)
{
    const unsigned *names;
    const int *b = state->blend;
    int i, count;
    gl->UseProgram((unsigned)state->program);
    gl->BindVertexArray((unsigned)state->vertex_array);
    gl->BindFramebuffer(SAT__GL_DRAW_FRAMEBUFFER, (unsigned)state->draw_framebuffer);
    gl->BindFramebuffer(SAT__GL_READ_FRAMEBUFFER, (unsigned)state->read_framebuffer);
    gl->Viewport(state->viewport[0], state->viewport[1], state->viewport[2], state->viewport[3]);
    gl->DepthFunc((unsigned)state->depth_function);
    gl->DepthMask(state->depth_mask);
    gl->ColorMask(state->color_mask[0], state->color_mask[1], state->color_mask[2], state->color_mask[3]);
    if (!gl->is_es && gl->PolygonMode) gl->PolygonMode(SAT__GL_FRONT_AND_BACK, (unsigned)state->polygon_mode[0]);
    gl->BlendFuncSeparate((unsigned)b[0], (unsigned)b[1], (unsigned)b[2], (unsigned)b[3]);
    gl->BlendEquationSeparate((unsigned)b[4], (unsigned)b[5]);
    names = sat__gl_capability_names(gl, &count);
    for (i = 0; i < count; i++) {
        if (state->capabilities[i]) gl->Enable(names[i]);
        else gl->Disable(names[i]);
    }
}

static inline void sat__gl_restore_buffers(sat__gl *gl, const sat__gl_state *state)
{
    const unsigned *names;
    int i, count;
    names = sat__gl_store_names(gl, &count);
    for (i = 0; i < count; i++) gl->PixelStorei(names[i], state->stores[i]);
    if (state->feedback && state->feedback_size > 0)
        gl->BindBufferRange(SAT__GL_TRANSFORM_FEEDBACK_BUFFER, 0, (unsigned)state->feedback, (ptrdiff_t)state->feedback_start,
                            (ptrdiff_t)state->feedback_size);
    else gl->BindBufferBase(SAT__GL_TRANSFORM_FEEDBACK_BUFFER, 0, (unsigned)state->feedback);
    for (i = 0; i < 4; i++) gl->BindBuffer(sat__gl_buffer_names()[2 * i], (unsigned)state->buffers[i]);
}

/* Puts everything back. */
static inline void sat__gl_end(sat__gl *gl, const sat__gl_state *state)
{
    sat__gl_restore_textures(gl, state);
    sat__gl_restore_buffers(gl, state);
    sat__gl_restore_pipeline(gl, state);
}

/* ---- time on the GPU between begin and end. Only one timer may run at a time. */

typedef struct sat__gl_timer { unsigned query; } sat__gl_timer;

static inline void sat__gl_timer_begin(sat__gl *gl, sat__gl_timer *timer)
{
    timer->query = 0;
    if (!gl->has_timer) return;
    gl->GenQueries(1, &timer->query);
    gl->BeginQuery(SAT__GL_TIME_ELAPSED, timer->query);
}

/* Waits for the GPU. Seconds; below 0 where there is no timer: then time it between two calls of gl->Finish. */
static inline double sat__gl_timer_end(sat__gl *gl, sat__gl_timer *timer)
{
    uint64_t nanoseconds = 0;
    if (!timer->query) return -1;
    gl->EndQuery(SAT__GL_TIME_ELAPSED);
    gl->GetQueryObjectui64v(timer->query, SAT__GL_QUERY_RESULT, &nanoseconds);
    gl->DeleteQueries(1, &timer->query);
    timer->query = 0;
    return 1e-9 * (double)nanoseconds;
}

#endif /* SAT__SHARED_GL */

/* ------------------------------------------------------------------------------------------------
   Implementation
   ------------------------------------------------------------------------------------------------ */

#if defined(SAT_IMPLEMENTATION) && !defined(SAT_IMPLEMENTED)
#define SAT_IMPLEMENTED

#ifdef __cplusplus
extern "C" {
#endif

#ifndef SAT_STATIC
const int sat__define_SAT_IMPLEMENTATION_in_exactly_one_c_file = SAT_VERSION;
#endif

SAT_DEF int sat_version(void) { return SAT_VERSION; }

#define SAT__RESULT_TEXT(name, text) text,
SAT_DEF const char *sat_result_text(sat_result result)
{
    static const char *const texts[] = {SAT_RESULTS(SAT__RESULT_TEXT) ""};
    return (unsigned)result < (unsigned)SAT_RESULT_COUNT ? texts[result] : "unknown result";
}

SAT_DEF sat_image sat_image_f32(const float *pixels, int width, int height, int channels)
{
    sat_image image;
    image.pixels = pixels;
    image.width = width;
    image.height = height;
    image.channels = channels;
    image.stride = (ptrdiff_t)width * channels * (ptrdiff_t)sizeof(float);
    image.format = SAT_F32;
    return image;
}

/* @CORE@ */

#ifdef __cplusplus
}
#endif
#endif /* SAT_IMPLEMENTATION */

/* @GL IMPLEMENTATION@ */
