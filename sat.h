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
#endif

/* What a sibling's implementation calls to be sure that sat.h was implemented, and in this version. */
static inline int sat__version_matches(void) { return sat__define_SAT_IMPLEMENTATION_in_exactly_one_c_file == SAT_VERSION; }

#endif /* SAT__SHARED */
/* @SHARED GL@ */

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
