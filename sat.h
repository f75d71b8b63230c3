/* sat.h - 0.1.0 - prefix scans and summed-area tables - SPDX-License-Identifier: MIT-0 OR Unlicense

   Box sums and box means of any size in constant time, right for high dynamic range images, on the CPU and in OpenGL.

   USE

       #define SAT_IMPLEMENTATION             // in exactly one C or C++ file
       #include "sat.h"

       sat_image image = sat_image_f32(pixels, width, height, 1);
       sat_table *table;
       if (sat_create(&table, width, height, 1, NULL) != SAT_OK) return 1;
       sat_build(table, &image);              // again for every frame; allocates nothing
       double mean = sat_mean(table, 0, x - 20, y - 20, x + 21, y + 21);
       sat_destroy(table);

   Build with `cc -std=c99 program.c -lm`; nothing else is needed. C99 and C++11.

   WHAT IT DOES

   - Tables that keep their precision where plain float tables lose it: over 14 decades, 3 x 3 boxes come out right to
     2e-6 at the 99th percentile and 4e-5 at worst, where light changes by a decade in 100 pixels or by four in 64
     (2e-7, 6e-7 where it is smooth). The default, SAT_KIND_TILED, sums integers in every 32 x 32 tile, with a quantum
     of the tile's own, and a box of up to 65 pixels a side reads only the tiles that it touches: bright pixels,
     infinities and skies elsewhere change nothing. tile = 64 filters faster and errs more (2e-6, 6e-6 where it is
     smooth; 4e-4, 1 where it is not: bench_sat's "Side of a tile").
   - 8- and 16-bit pictures without any error. Flat tables in integers modulo 2^32, too: no order of additions matters.
   - Means over boxes with real corners, beyond the border (clip, zero, clamp, mirror, wrap), with a radius for each
     pixel; box filters of whole images, also of images that arrive a row at a time; dirty rectangles.
   - Variance and covariance over any box, from moments about the mean of each tile: 1e4 +- 1 comes out right to 1e-3
     and never negative, where sums of x and x * x give noise.
   - An error bound and an expected error for every table, and a plan that picks the cheapest kind for a wanted error.
   - k-ary scans by recursive doubling and by balanced trees, with the work they do counted (Slomp 2012, chapter 4), for
     any type and operation.
   - OpenGL 3.3 / ES 3.0 passes, or compute shaders of GL 4.3, that build the tiles from textures, 1 to 4 channels at
     once, bit for bit the CPU's table with its spikes, giants, 64-bit tiles and strips, without an extension; box
     filters and variances there, and GLSL functions that look boxes up. The passes of Slomp 2012 (trees and recursive
     doubling, any k) over flat tables, too.

   WHAT IT DOES NOT

   - No second-order (tent) tables, no tilted tables, no half-float tables: the first lose too many digits in float and
     are two box filters otherwise, nobody but Haar cascades wants the second, the third overflow at 65504.
   - It starts no thread, opens no window, creates no OpenGL context, keeps no global state.

   OPTIONS (macros)

     SAT_IMPLEMENTATION    off     implementing file   brings the code; LIGHTSCAN_IMPLEMENTATION does so for all six
                           headers
     SAT_STATIC            off     everywhere          all functions are private to each file
     SAT_DEF               extern  everywhere          replaces the linkage, as in __declspec(dllexport)
     SAT_GL                off     everywhere          OpenGL; needs no GL header, loader or library
     SAT_GL_DUMP           off     implementing file   prints the numbered source of a shader that does not compile
     SAT_NO_SIMD           off     implementing file   plain C instead of SSE2, AVX2 or NEON; the same bits
     SAT_NO_STDLIB         off     implementing file   no malloc: every allocator must be given
     SAT_ASSERT(c)         assert  implementing file   for broken promises inside the library, never for arguments

   MEMORY, THREADS, ERRORS

   sat_create makes one allocation, sat_stream_create two; building, updating, looking up and filtering make none. Scans
   allocate their scratch, except sequential ones. Outputs belong to the caller. A table may be read by any number of
   threads; build and update need it alone. Options may carry a parallel_for, which builds and filters then use.
   Everything that can fail returns a sat_result and leaves outputs alone when it is not SAT_OK, but where a comment
   says so; lookups of channels or boxes that are not there return 0.

   ROWS, LIGHT, FAILURES

   Strides are bytes: 0 packed, negative the bottom row first with `pixels` at the top one. Values are summed as they
   are: sums of sRGB codes are sums of codes; decode first where light is meant. A create that fails sets *out to NULL
   and holds nothing (OpenGL: an object for its message, to be destroyed). On OpenGL pixels come in and go out by
   textures: glTexSubImage2D into the input; sat_gl_table attached to a framebuffer, then glReadPixels.

   NUMERICS

   u = 2^-24, v = 2^-53; errors of one box sum, worst case for non-negative pixels; sat_error_bound knows the constants.

     TILED     quantum / 2 of its tile for each pixel + few v x (sum of the box; of its super tiles where the box is
               larger than three tiles); a quantum is the power of two for which the tile's sum just fits in 31 bits, so
               that 8- and 16-bit input is exact
     FLOAT     4 (height + width / 8) u x (sum of the image)
     DOUBLE    4 (height + width / 8) v x (sum of the image)
     FIXED32   quantum / 2 for each pixel of the box

   - Input: any float. NaN counts as 0 and infinity as the largest value the kind can sum; both are counted, and in
     TILED and FIXED tables a bad pixel changes no box without it. TILED keeps at most 64 pixels a tile row beyond 1e20;
     further ones are clamped to the largest other pixel of their tile (65504 where there is none) and counted. FLOAT
     clamps pixels to 1.6e29, so that no sum overflows. SAT_NON_FINITE_REFUSE returns an error instead.
   - The same bits for any number of workers, for SSE2, AVX2, NEON and plain C, with and without contraction into fused
     multiply-adds, also under -ffast-math and -Ofast, which the
     implementation switches off for itself (gcc, clang, MSVC); only subnormals may then count as 0, as the program
     asked for.
   - subtract_mean helps images of low contrast and harms dark boxes of high dynamic range.

   COST

   A build writes each sum once and reads each pixel once (TILED: twice, the second time from the cache). Per pixel and
   channel: 4.9 bytes (TILED; 21 in a column one pixel wide), 4 (FLOAT, FIXED32), 8 (DOUBLE). A lookup reads
   4 sums (TILED: up to 4 a touched tile, at most 9 tiles; beyond, 16 for each super tile of 1024 pixels). Measured
   ratios, one core of a busy machine, SSE2 (bench_sat, QUICK=1):

     build, time over a memcpy of the same traffic     512^2        2048^2
       TILED                                           4.5 to 6.1   1.9 to 2.5 (tile = 64: 1.8 to 2.2; bright pixels
                                                                    to be kept apart in every tile: 3.5 to 4.2)
       FLOAT, DOUBLE                                   2.4 to 3.7   1.0 to 1.5
       FIXED32                                         4.6          1.7 to 2.1
     cv::integral over FLOAT, over DOUBLE              1.9 to 3.1, 1.7  1.7 to 2.3, 1.5
     box filter over cv::blur at radius 1, 5, 20, 100, 1024^2
       TILED                                           1.0 1.0 1.2 1.2, with the build 1.5 1.7 1.9 1.7 (tile = 64: 0.7
                                                       0.8 0.8 0.9, 1.4 1.6 1.6 1.4)
       FLOAT, DOUBLE, FIXED32                          0.7 to 0.8, 0.7 to 0.8, 0.6 to 0.8
     lookups over four bare reads of floats at radius 1, 5, 20, 100: random boxes in a table that the cache holds;
     around each pixel, row by row
       TILED by sat_view_sum                           2.9 3.8 6.5 8; 3.5 5.5 10 17
       TILED by sat_sums                               3.4 4.2 7 9; 4.8 6.7 11 17
       FLOAT by sat_sums                               1.7 to 2.1; 3.1
       doubles, four bare reads                        1.1; 0.9
     A tile's lookup is 40 instructions where bare reads take 15, and a box across tiles reads 6 to 16 cache lines where
     bare reads touch 4: that is what is left. A build reads each pixel twice, for its tile's quantum and for its cells.
*/

/*
   CONTENTS: each section begins with its mark

   >> types                   what all six headers share: results, memory, threads, images
   >> scans                   interface of the k-ary scans
   >> tables                  interface: kinds, options, build, sums and means, filters, bounds, plans, streams
   >> moments                 interface: variance and covariance
   >> on OpenGL               interface: tables from textures, lookups in GLSL
   >> for siblings            options and their tables, sentences, images; private
   >> for siblings, vectors   four floats or integers at a time; private
   >> for siblings, OpenGL    functions, programs; private
   >> for siblings, textures  textures, passes, state, time; private
   >> scanning                the three algorithms
   >> layout                  what a table holds, the options' rows, creation
   >> rows                    running sums of one row, by vectors and plainly
   >> reading pixels          what no sum can hold, rounding to integers
   >> looking up tiles        boxes in SAT_KIND_TILED
   >> building tiles          quanta, spikes, giants, 64-bit cells, strips
   >> building flat tables    and what all builds share
   >> lookups                 sums and means, borders, many boxes
   >> filters                 box filters of whole images
   >> bounds                  of errors, and plans
   >> summing moments         about the mean of each tile
   >> streams                 images a row at a time
   >> shaders                 flat tables in GLSL
   >> shaders of tiles        lookups in tiles
   >> shaders that build tiles  gauges, quanta, giants, integers, 64-bit cells, strips
   >> shaders of work groups  the same by compute shaders; what is drawn from tiles
   >> passes                  the object, programs, builds on the GPU
   >> passes of flat tables   the published algorithms, means, creation
*/

#if defined(LIGHTSCAN_IMPLEMENTATION) && !defined(SAT_IMPLEMENTATION)
#define SAT_IMPLEMENTATION
#endif

/* dist: interface */
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
   >> types: shared by all six headers
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
    X(SAT_ERR_CANCELLED, "the progress callback asked to stop")                                    \
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

/* An image is a view: `channels` interleaved values a pixel, rows `stride` bytes apart (0: packed, here and for every
   stride of the six headers; negative: bottom row first in memory, `pixels` then points at the top row). Integers keep
   their value (255 is 255.0); a caller who wants 0..1 scales the result. */
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

/* Why an image or the arguments of a create are refused: one sentence in the caller's memory, cut at `size` bytes,
   "tile is 99; 8..128, a power of two"; "" where they would be taken. Returns text. */
SAT_DEF const char *sat_explain_image(char *text, size_t size, const sat_image *image);

/* ------------------------------------------------------------------------------------------------
   >> scans: out[i] = in[0] + ... + in[i], for any associative sum (Slomp 2012, sections 4.3 to 4.5)
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
    int k;                        /* 4; 2..64; values summed in one step. 4 moves the fewest (7.67 n) */
    int exclusive;                /* 0; 0..1; 1: out[i] leaves in[i] out and out[0] is the identity */
    sat_allocator allocator;      /* malloc; used by the two parallel algorithms only */
    sat_threads threads;          /* serial; same bits for any worker count */
    sat_scan_counters *counters;  /* NULL: not counted; otherwise overwritten */
} sat_scan_options;
SAT_DEF sat_scan_options sat_scan_defaults(void);
SAT_DEF const char *
sat_explain_scan(char *text, size_t size,
                 const sat_scan_options *options); /* as sat_explain_image; NULL options: the defaults */

/* Sequential f32 scans without counters carry the sum in double. In place when out == in; otherwise the two must not
   overlap. n may be 0. Integers wrap around. */
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
   >> tables: the sum over any box from four corners (Slomp 2012, eq 4.1 to 4.4)
   ------------------------------------------------------------------------------------------------ */

/* How sums are stored. Bytes a pixel and channel; see NUMERICS for errors and COST for times. */
typedef enum sat_kind {
    SAT_KIND_TILED,   /* 4.8; integers that restart in every tile, with a quantum each: for HDR */
    SAT_KIND_FLOAT,   /* 4; only for large boxes, small images or thesis parity */
    SAT_KIND_DOUBLE,  /* 8 */
    SAT_KIND_FIXED32  /* 4; integers modulo 2^32: exact sums of pixels rounded to `quantum` */
} sat_kind;

typedef enum sat_non_finite {
    SAT_NON_FINITE_CLAMP, /* NaN counts as 0, infinity as +- the largest value the kind can sum */
    SAT_NON_FINITE_REFUSE /* build and update return SAT_ERR_NON_FINITE; the table then holds zeros */
} sat_non_finite;

typedef struct sat_options {
    sat_kind kind;             /* SAT_KIND_TILED */
    int tile;                  /* 32; 8..128; a power of two: tile side of SAT_KIND_TILED; 64 errs 7 to 100 times as
                                  much and filters in 0.6 of the time */
    int subtract_mean;         /* 0; 0..1; 1 (FLOAT, DOUBLE): Hensley 2005. Good at low contrast; makes dark boxes of
                                  HDR images about 100 times worse */
    double quantum;            /* 0; 0..1e300; 0: the finest power of two that max_value and max_box_area allow; FIXED32
                                  only */
    double max_value;          /* 0; 0..1e300; 0: as large as the kind can sum (FIXED32: the largest |pixel| of the
                                  first build). > 0: pixels beyond +-max_value are clamped to it and counted */
    double max_box_area;       /* 0; 0..1e300; 0: the whole table; FIXED32: no larger box is ever asked for */
    sat_non_finite non_finite; /* SAT_NON_FINITE_CLAMP */
    sat_allocator allocator;   /* malloc; used by create and destroy only */
    sat_threads threads;       /* serial; build, update and box filters use it; same bits for any worker count */
} sat_options;
SAT_DEF sat_options sat_defaults(void);
/* As sat_explain_image, for the arguments of sat_create. NULL options mean the defaults, here and in every call. */
SAT_DEF const char *sat_explain(char *text, size_t size, int width, int height, int channels,
                                const sat_options *options);

typedef struct sat_table sat_table;

/* What the last build or update met. FIXED32 keeps the quantum that the first build settled. */
typedef struct sat_stats {
    size_t nan, infinite, clamped; /* channel values replaced: NaN, infinite, too large */
    double quantum;                /* FIXED32: the step that pixels are rounded to; else 0 */
    size_t bytes;                  /* memory the table holds */
} sat_stats;
SAT_DEF sat_stats sat_get_stats(const sat_table *table);

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
/* The sums of `count` boxes, x0 y0 x1 y1 each: the same bits. Chooses the kind once. */
SAT_DEF void sat_sums(double *out, const sat_table *table, int channel, const int *boxes, size_t count);

/* For loops of your own: what the lookups of one channel read, to be had once. It follows builds and ends with the
   table. Its members are private: they stand here so that the compiler sees them. */
typedef struct sat_view {
    const sat_table *table;
    double (*other)(const struct sat_view *view, int x0, int y0, int x1, int y1);
    const uint32_t *cells;
    const double *quanta;
    size_t stride;
    int tiles, shift, channel;
} sat_view;
SAT_DEF sat_result sat_get_view(sat_view *out, const sat_table *table, int channel);
/* sat_sum, the same bits, of a box that must hold a pixel and lie inside the table: nothing is clipped. Boxes within
   one tile of SAT_KIND_TILED take no call. */
static inline double sat_view_sum(const sat_view *view, int x0, int y0, int x1, int y1)
{
    if (!view) return 0;
    if (!((unsigned)((x0 ^ (x1 - 1)) | (y0 ^ (y1 - 1))) >> view->shift)) {
        const double quantum = view->quanta[(size_t)(y0 >> view->shift) * (size_t)view->tiles +
                                            (size_t)(x0 >> view->shift)];
#ifdef __clang_analyzer__ /* quanta of flat tables are below 0: where there is one, there are cells */
        if (!view->cells) return 0;
#endif
        if (quantum >= 0) { /* cells are inclusive sums within the tile: nothing is taken off in its first row */
            const unsigned inner = (1u << view->shift) - 1;
            const uint32_t left = 0u - (uint32_t)(((unsigned)x0 & inner) != 0),
                           top = 0u - (uint32_t)(((unsigned)y0 & inner) != 0);
            const uint32_t *high = view->cells + (size_t)(y0 - (int)(top & 1)) * view->stride,
                           *low = view->cells + (size_t)(y1 - 1) * view->stride;
            const int a = x0 - (int)(left & 1), b = x1 - 1;
            return (double)(int32_t)((low[b] - (low[a] & left)) - ((high[b] - (high[a] & left)) & top)) * quantum;
        }
    }
    return view->other(view, x0, y0, x1, y1);
}

/* The sum divided by the clipped area. */
SAT_DEF double sat_mean(const sat_table *table, int channel, int x0, int y0, int x1, int y1);
/* The exact integral of the piecewise constant image (pixel i covers [i, i+1)) over a box with real corners. */
SAT_DEF double sat_sum_fractional(const sat_table *table, int channel, double x0, double y0, double x1, double y1);
/* The pixel itself, to the error of a 1x1 box; 0 outside. */
SAT_DEF float sat_restore(const sat_table *table, int channel, int x, int y);

/* What lies outside the image, for each axis: nothing (the box is clipped), zeros, the border pixel, the
   mirrored image (the border pixel twice) or the periodic image (x of an environment map). */
typedef enum sat_border {
    SAT_BORDER_CLIP,
    SAT_BORDER_ZERO,
    SAT_BORDER_CLAMP,
    SAT_BORDER_MIRROR,
    SAT_BORDER_WRAP
} sat_border;
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
/* Never below the absolute error of the mean of this very box, clipped: in SAT_KIND_TILED its own tiles count, and what
   lies elsewhere does not. Visits every tile of the box. */
SAT_DEF double sat_error_bound_box(const sat_table *table, int channel, int x0, int y0, int x1, int y1);
/* The root-mean-square error to expect over boxes of that size: within a factor of 4 on non-negative images whose
   pixels are not round numbers and, for FIXED32, not mostly below the quantum; an upper estimate on others. */
SAT_DEF double sat_error_rms(const sat_table *table, int channel, int box_width, int box_height);

/* The cheapest kind whose worst error on box means of that size stays below max_relative_error times the mean
   |value| of the image, within max_bytes (0: no limit). SAT_ERR_LIMIT when none does; *kind is then the most accurate
   one that fits. Reads the image once. */
SAT_DEF sat_result sat_plan(sat_kind *kind, const sat_image *image, int box_width, int box_height,
                            double max_relative_error, size_t max_bytes, const sat_options *options);
/* The same as whole options, to be used as they are: FIXED32 may then count on boxes of that size, which sat_plan
   alone, where options leave max_box_area 0, may not. */
SAT_DEF sat_result sat_plan_options(sat_options *out, const sat_image *image, int box_width, int box_height,
                                    double max_relative_error, size_t max_bytes, const sat_options *options);

/* Box filter of an image that arrives a row at a time, of any height, in memory for 2 radius + 2 rows. The rows
   that come out equal sat_box_filter of the whole image bit for bit (FIXED32: of the same quantum, as long as no pixel
   times max_box_area, here 0 for the filter's own box, is beyond 2^31 quanta). SAT_KIND_TILED keeps up to three tile
   rows more, gives rows up to a tile side later, and takes a radius of at most 100000. */
typedef struct sat_stream sat_stream;
SAT_DEF sat_result sat_stream_create(sat_stream **out, int width, int channels, int radius, const sat_options *options);
/* Takes the next row (an image of height 1) and writes at most one filtered row to out_row (width x channels floats);
   *rows_out says whether it did. After the last row call it with row == NULL until *rows_out is 0. */
SAT_DEF sat_result sat_stream_push(sat_stream *stream, float *out_row, int *rows_out, const sat_image *row);
SAT_DEF void sat_stream_destroy(sat_stream *stream); /* NULL is fine */

/* ------------------------------------------------------------------------------------------------
   >> moments: variance and covariance over any box, right where the variance is small beside the mean
   ------------------------------------------------------------------------------------------------ */

typedef struct sat_moments_options {
    int covariance;            /* 0; 0..1; 1: the products of different channels too, for sat_covariance */
    sat_non_finite non_finite; /* SAT_NON_FINITE_CLAMP; NaN and infinity then count as the mean of their 64 x 64 tile */
    sat_allocator allocator;   /* malloc; used by create and destroy only */
    sat_threads threads;       /* serial; same bits for any worker count */
} sat_moments_options;
SAT_DEF sat_moments_options sat_moments_defaults(void);
SAT_DEF const char *sat_explain_moments(char *text, size_t size, int width, int height, int channels,
                                        const sat_moments_options *options);

/* Sums of (x - m) and of (x - m)(y - m') in double, where m is the mean of the pixel's own tile: 8 bytes a pixel for
   each channel and for each product (c squares, or c (c + 1) / 2 with covariance). One allocation, at create. */
typedef struct sat_moments sat_moments;
SAT_DEF sat_result sat_moments_create(sat_moments **out, int width, int height, int channels,
                                      const sat_moments_options *options);
SAT_DEF sat_result sat_moments_build(sat_moments *moments, const sat_image *image);
SAT_DEF void sat_moments_destroy(sat_moments *moments); /* NULL is fine */

/* Over the box [x0,x1) x [y0,y1), clipped; an empty box gives 0. Divided by the number of pixels (not less one). A
   variance is never negative. What tiles hold is joined by Chan's rule, so a lookup takes a few additions a touched
   tile. */
SAT_DEF double sat_moments_mean(const sat_moments *moments, int channel, int x0, int y0, int x1, int y1);
SAT_DEF double sat_variance(const sat_moments *moments, int channel, int x0, int y0, int x1, int y1);
SAT_DEF double sat_covariance(const sat_moments *moments, int channel, int other, int x0, int y0, int x1, int y1);
/* sat_covariance(channel, other) around every pixel, (2 radius + 1)^2 pixels clipped at the borders; one float a pixel,
   rows out_stride bytes apart. channel == other: the variance. mean: NULL, or takes the mean of `channel`. */
SAT_DEF sat_result sat_moments_filter(float *out, float *mean, ptrdiff_t out_stride, const sat_moments *moments,
                                      int channel, int other, int radius);

/* A program that forgets SAT_IMPLEMENTATION fails to link, and this name says why, even where it implements nothing. */
#ifdef SAT_STATIC
static const int sat__define_SAT_IMPLEMENTATION_in_exactly_one_c_file = SAT_VERSION;
#else
extern const int sat__define_SAT_IMPLEMENTATION_in_exactly_one_c_file;
#endif
#if defined(__GNUC__) && !defined(__TINYC__) && !defined(SAT_STATIC)
__attribute__((used)) static int sat__hint(void) { return sat__define_SAT_IMPLEMENTATION_in_exactly_one_c_file; }
#endif

#ifdef __cplusplus
}
#endif
#endif /* SAT_H */

/* ------------------------------------------------------------------------------------------------
   >> on OpenGL: tables on the GPU, for GL 3.3 core and ES 3.0 / WebGL 2 (define SAT_GL)
   ------------------------------------------------------------------------------------------------ */

#if defined(SAT_GL) && !defined(SAT__GL_API)
#define SAT__GL_API

#ifdef __cplusplus
extern "C" {
#endif

/* Where a call draws its picture; all headers take it. Zeroes (or NULL): the object's own texture. The OpenGL state is
   put back. Blending is off and sRGB codes are written as they are, unless a call says otherwise. A framebuffer's first
   draw buffer gets the picture.
   What a call reads is a 2D texture. For one layer of an array (stereo) that is a view of it, glTextureView, with GL
   4.3; elsewhere let both eyes lie side by side in one texture, and say which by from_x. */
typedef enum sat_gl_place {
    SAT_GL_OWN,        /* the texture that X_gl_texture names */
    SAT_GL_TEXTURE,    /* level 0 of a 2D texture */
    SAT_GL_LAYER,      /* level 0 of one layer of a 2D array or 3D texture: one eye of two */
    SAT_GL_FRAMEBUFFER /* a framebuffer of yours; 0 is the window's */
} sat_gl_place;

typedef struct sat_gl_target {
    sat_gl_place place; /* SAT_GL_OWN */
    unsigned name;      /* of the texture or framebuffer */
    int layer;
    int x, y;           /* where the picture's corner (0, 0) lies in it: two views side by side, a part of the window */
    int flip;           /* 0; 1: rows in the reverse order, from top-down to bottom-up and back */
    int from_x, from_y; /* where it lies in the pictures that the call reads: one of two views, a part of an atlas */
    int width, height;  /* 0: as created (where the call names a size: that). Smaller ones cost nothing but what they
                           draw, in any frame: dynamic resolution. All of it is in the corner of the object's own
                           textures */
} sat_gl_target;

static inline sat_gl_target sat_gl_to(sat_gl_place place, unsigned name, int layer, int x, int y, int flip)
{
    sat_gl_target target;
    target.place = place;
    target.name = name;
    target.layer = layer;
    target.x = x;
    target.y = y;
    target.flip = flip;
    target.from_x = target.from_y = target.width = target.height = 0;
    return target;
}
static inline sat_gl_target sat_gl_to_texture(unsigned texture)
{
    return sat_gl_to(SAT_GL_TEXTURE, texture, 0, 0, 0, 0);
}
static inline sat_gl_target sat_gl_to_layer(unsigned texture, int layer)
{
    return sat_gl_to(SAT_GL_LAYER, texture, layer, 0, 0, 0);
}
static inline sat_gl_target sat_gl_to_framebuffer(unsigned framebuffer, int x, int y)
{
    return sat_gl_to(SAT_GL_FRAMEBUFFER, framebuffer, 0, x, y, 0);
}

/* How sums are stored. ES 3.0 and WebGL 2 need EXT_color_buffer_float for the first two. */
typedef enum sat_gl_format {
    SAT_GL_TWO_FLOAT, /* RG32F: the sum of two floats, about 48 bits */
    SAT_GL_FLOAT,     /* R32F: as SAT_KIND_FLOAT, only for large boxes or small images */
    SAT_GL_FIXED32,   /* R32UI: the same integers as SAT_KIND_FIXED32, for any algorithm and k */
    SAT_GL_TILED      /* as SAT_KIND_TILED with its default tile, bit for bit; for HDR */
} sat_gl_format;

typedef struct sat_gl_options {
    sat_gl_format format;         /* SAT_GL_TILED; the others are the published passes */
    sat_scan_algorithm algorithm; /* SAT_SCAN_BALANCED_TREE; or RECURSIVE_DOUBLING: half the passes, log_k n times the
                                     pixels, ahead for small tables only */
    int k;                        /* 4; 2..64; texels read for one written */
    int compute;                  /* 0; 0..1; 1: by compute shaders where there is GL 4.3, else as 0; the same bits.
                                     TILED: a work group a tile, which reads it once; trees: their second half, of which
                                     an invocation writes k texels, so that k = 32 or 64 is best */
    int channel;                  /* 0; 0..3; the (first) channel of the input texture */
    int channels;                 /* 1; 1..4; TILED: so many channels in one build */
    int moments;                  /* 0; 0..1; 1 (TILED, at most two channels): for sat_gl_variance; sat_sum and
                                     sat_gl_box_filter then have no table of the pixels themselves */
    int unsigned_input;           /* 0; 0..1; 1 (FIXED32): the input is an unsigned integer texture and is summed as it
                                     is */
    double quantum;               /* 0; 1e-35..1e35; a power of two. 0: the finest that max_value and max_box_area
                                     allow. FIXED32 */
    double max_value;             /* 1e30; 1e-300..1e300; pixels beyond +-max_value are clamped to it; NaN counts as 0.
                                     Lower it for FIXED32: the quantum is proportional to it */
    double max_box_area;          /* 0; 0..1e300; 0: the whole table; FIXED32: no larger box is ever asked for */
    int width;                    /* 0; 0..16777216; with height: create makes all textures; smaller sizes take
                                     a part of them, and lookups in flat tables are then to be clipped to the size,
                                     which tiles know themselves */
    int height;                   /* 0; 0..16777216 */
    sat_allocator allocator;      /* malloc; used by create and destroy only */
} sat_gl_options;
SAT_DEF sat_gl_options sat_gl_defaults(void);
SAT_DEF const char *sat_explain_gl(char *text, size_t size, const sat_gl_options *options); /* as sat_explain_image */

/* Belongs to the context that is current in create: it must be current in every call. Textures are made by the
   first build of a size, unless options.width and height name it. Every call leaves the OpenGL state as it was (but for
   pending errors, which are lost; where compute shaders run, image units 0 to 3 too). ES has no compute shaders here:
   3.1 writes no images of two integers a texel. A group has 4 KiB of shared memory for each plane, and 5.
   The CPU alone has doubles and 64-bit integers, updates of a part, streams, covariance, borders other than clipping,
   radii of each pixel, bounds and plans (they hold here for the kinds of the same name). Here alone are two-float sums,
   and the mean that stays on the GPU. */
typedef struct sat_gl sat_gl;

/* On an OpenGL error *out only answers sat_gl_message, and is to be destroyed; on the others it is NULL. */
SAT_DEF sat_result sat_gl_create(sat_gl **out, sat_gl_get_proc *get_proc, const sat_gl_options *options);
SAT_DEF void sat_gl_destroy(sat_gl *gl); /* NULL is fine */
/* Other options from the next call on. quantum, max_value and max_box_area are uniforms and free; SAT_ERR_MISMATCH when
   another one differs, which shaders and textures are made for: nothing changes then. The allocator is not looked
   at. */
SAT_DEF sat_result sat_gl_set_options(sat_gl *gl, const sat_gl_options *options);
/* What the last SAT_ERR_GL_... was about; never NULL, and NULL is fine. */
SAT_DEF const char *sat_gl_message(const sat_gl *gl);

/* Inclusive sums of the first width x height texels of a 2D texture, level 0: texel (x, y) of the table is the sum
   over [0,x] x [0,y]. `table` is a texture of the caller in the format above and at least of that size, or 0 for the
   object's own, sat_gl_table(); SAT_GL_TILED: 0, and see sat_gl_get_tiles(). The input is only read. Does not wait for
   the GPU. */
SAT_DEF sat_result sat_gl_build(sat_gl *gl, unsigned table, unsigned texture, int width, int height);
/* The same for each row alone: texel (x, y) is the sum over [0,x] of row y. Not for SAT_GL_TILED. */
SAT_DEF sat_result sat_gl_scan(sat_gl *gl, unsigned table, unsigned texture, int width, int height);
/* The texture that the last build or scan with table 0 wrote; another one when the size changes. 0 before. */
SAT_DEF unsigned sat_gl_table(const sat_gl *gl);
/* FIXED32: the value of 1 in the table, which the lookups ask for; 0 for the other formats. */
SAT_DEF double sat_gl_quantum(const sat_gl *gl);

/* The mean, after NaN and infinities were replaced, by a tree of two-float sums that takes k x k texels a step, k at
   most 8. It stays in the one texel of sat_gl_mean_texture (RG32F: the mean is x + y); with mean != NULL it comes back,
   which waits for the GPU. */
SAT_DEF sat_result sat_gl_mean(sat_gl *gl, float *mean, unsigned texture, int width, int height);
SAT_DEF unsigned sat_gl_mean_texture(const sat_gl *gl);

/* SAT_GL_TILED: the textures of the last build. cells: 32-bit integers, a component a channel; tiles: an array of four
   layers (quanta, spikes); strips: sums of whole tiles, giants and 64-bit tiles, one behind the other. cells has the
   size of the build, so that lookups clip to it. All of it is what sat_build makes of the same max_value, bit for bit,
   but for tiles whose sum is below 2^-95. */
typedef struct sat_gl_tiles {
    unsigned cells, tiles, strips; /* usampler2D, usampler2DArray, usampler2D */
} sat_gl_tiles;
SAT_DEF sat_result sat_gl_get_tiles(sat_gl_tiles *out, const sat_gl *gl);
/* What the last tiled build met; waits for the GPU. */
SAT_DEF sat_result sat_gl_get_stats(sat_gl *gl, sat_stats *stats);
/* Means around every pixel, (2 radius + 1)^2 pixels clipped at the borders, from the last tiled build into a texture
   of the caller that can be drawn to and is at least of that size: channel c in component c. */
SAT_DEF sat_result sat_gl_box_filter(sat_gl *gl, unsigned texture, int radius);
/* With moments: mean and variance of the first channel, mean and variance of the second. */
SAT_DEF sat_result sat_gl_variance(sat_gl *gl, unsigned texture, int radius);
/* GLSL to put behind sat_gl_glsl(), for the three textures above; the same boxes:

       float sat_sum(usampler2D cells, usampler2DArray tiles, usampler2D strips, int channel, ivec2 low, ivec2 high)
       float sat_mean(...)                                                  the same arguments */
SAT_DEF const char *sat_gl_glsl_tiles(int part); /* 0 and 1, one behind the other; NULL for others */

/* GLSL (3.30 or ES 3.00) to put behind the #version line of a shader, once or more. Boxes are half-open and clipped:

       float sat_sum(sampler2D table, ivec2 low, ivec2 high)               4 fetches
       float sat_mean(sampler2D table, ivec2 low, ivec2 high)              by the clipped area; empty: 0
       float sat_sum_fractional(sampler2D table, vec2 low, vec2 high)      16 fetches; texel i covers [i, i+1)

   and the same for SAT_GL_FIXED32 with (usampler2D table, float quantum, ...). Tables are fetched, never filtered:
   a GPU's GL_LINEAR has weights of 8 bits. */
SAT_DEF const char *sat_gl_glsl(void);

#ifdef __cplusplus
}
#endif
#endif /* SAT__GL_API */

/* dist: nothing */
/* ------------------------------------------------------------------------------------------------
   Stop here if you only want to use the library.
   ------------------------------------------------------------------------------------------------ */

/* ------------------------------------------------------------------------------------------------
   >> for siblings

   What the six implementations share stands here once, as static inline functions. A sibling's
   implementation part gets it by defining SAT_SIBLING and including this header again; nothing of
   it is part of the interface, and names may change with any version.
   ------------------------------------------------------------------------------------------------ */

/* dist: shared */
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

/* IEEE arithmetic between SAT__IEEE_BEGIN and SAT__IEEE_END, whatever the program is compiled with: -ffast-math and
   -Ofast would drop NaN and infinity and reorder sums, contraction into fused multiply-adds would change bits. Where
   nothing of this is asked for, gcc is left alone. */
#define SAT__PRAGMA(text) _Pragma(#text)
#if defined(__clang__)
#define SAT__IEEE_BEGIN SAT__PRAGMA(float_control(push)) SAT__PRAGMA(float_control(precise, on)) SAT__PRAGMA(clang fp contract(off))
#define SAT__IEEE_END SAT__PRAGMA(float_control(pop))
#elif defined(__GNUC__) && !defined(__TINYC__) && (defined(__FAST_MATH__) || __FINITE_MATH_ONLY__ || defined(__FP_FAST_FMAF))
#define SAT__IEEE_BEGIN SAT__PRAGMA(GCC push_options) SAT__PRAGMA(GCC optimize("no-fast-math", "no-unsafe-math-optimizations", \
    "no-finite-math-only", "no-associative-math", "no-reciprocal-math", "signed-zeros", "fp-contract=off"))
#define SAT__IEEE_END SAT__PRAGMA(GCC pop_options)
#elif defined(_MSC_VER)
#define SAT__IEEE_BEGIN __pragma(float_control(precise, on, push)) __pragma(fp_contract(off))
#define SAT__IEEE_END __pragma(float_control(pop))
#else
#define SAT__IEEE_BEGIN
#define SAT__IEEE_END
#endif

/* Vector instructions come from the compiler's own macros. */
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

SAT__IEEE_BEGIN

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

/* What was carved so far becomes one block, which the same calls then carve for good. size is the block's, for
   sat__release; 63 bytes of it are for alignment. */
static inline sat_result sat__arena_allocate(sat__arena *arena, void **block, size_t *size,
                                             const sat_allocator *allocator)
{
    if (arena->overflow || arena->used > SIZE_MAX / 2 - 63) return SAT_ERR_SIZE;
    *size = arena->used + 63;
    *block = sat__alloc(allocator, *size);
    if (!*block) return SAT_ERR_MEMORY;
    arena->base = sat__align64(*block);
    arena->used = 0;
    return SAT_OK;
}

/* Stable radix sort of keys by their bits [low, high), `digit` bits a pass, at most 11; scratch holds n. Returns
   whichever of the two arrays is sorted. */
static inline uint64_t *sat__radix_sort(uint64_t *keys, uint64_t *scratch, size_t n, int low, int high, int digit)
{
    const uint64_t mask = ((uint64_t)1 << digit) - 1;
    size_t start[2049], i;
    for (; low < high; low += digit) {
        uint64_t *swap = keys;
        memset(start, 0, sizeof start);
        for (i = 0; i < n; i++) start[((keys[i] >> low) & mask) + 1]++;
        for (i = 0; i < mask; i++) start[i + 1] += start[i];
        for (i = 0; i < n; i++) scratch[start[(keys[i] >> low) & mask]++] = keys[i];
        keys = scratch;
        scratch = swap;
    }
    return keys;
}

static inline int sat__worker_count(const sat_threads *threads)
{
    return threads->parallel_for && threads->workers > 1 ? threads->workers : 1;
}

static inline void sat__parallel_for(const sat_threads *threads, int count, sat_range_fn *body, void *context)
{
    if (count <= 0) return;
    if (threads && sat__worker_count(threads) > 1 && count > 1)
        threads->parallel_for(count, body, context, threads->user);
    else body(0, count, 0, context);
}

/* workers outside 1..1024 with a parallel_for, or workers > 1 without one, are mistakes. */
static inline int sat__threads_are_valid(const sat_threads *threads)
{
    return threads->parallel_for ? threads->workers >= 1 && threads->workers <= 1024
                                 : threads->workers <= 1 && threads->workers >= 0;
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

/* Base-2 logarithm of a positive number that is no subnormal: exponent plus a polynomial that is exact at both ends of
   the octave, 1 + t; error below 2.3e-6. */
#define SAT__LOG2_OF(t) 0.442544943f + t * (-0.275600307f + t * (0.18194886f + t * (-0.0959564262f + t * 0.0258414329f)))
static inline float sat__log2_octave(float t)
{
    float q = SAT__LOG2_OF(t);
    return t + t * (1 - t) * q;
}

static inline float sat__log2(float v)
{
    uint32_t bits = sat__float_bits(v);
    float t = sat__float_from_bits((bits & 0x007fffffu) | 0x3f800000u) - 1;
    return (float)((int32_t)(bits >> 23) - 127) + sat__log2_octave(t);
}

/* Octahedral square (Cigolle et al. 2014), a and b in -1..1: the y axis in the middle, -y at the four corners.
   Directions may have any length and come back as points of the octahedron; 0 is the middle. */
static inline void sat__octahedral_fold(float *a, float *b, const float d[3])
{
    float sum = fabsf(d[0]) + fabsf(d[1]) + fabsf(d[2]), scale = sum > 0 ? 1 / sum : 0, x = d[0] * scale,
          z = d[2] * scale;
    *a = d[1] < 0 ? copysignf(1 - fabsf(z), x) : x;
    *b = d[1] < 0 ? copysignf(1 - fabsf(x), z) : z;
}

static inline void sat__octahedral_unfold(float d[3], float a, float b)
{
    d[1] = 1 - fabsf(a) - fabsf(b);
    d[0] = d[1] < 0 ? copysignf(1 - fabsf(b), a) : a;
    d[2] = d[1] < 0 ? copysignf(1 - fabsf(a), b) : b;
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

/* ---- options: one row a field. The same table gives the defaults, checks what a caller wrote and names what is wrong;
   a test compares it with the comments of the struct. */

typedef struct sat__field {
    const char *name;
    size_t offset;
    char type;       /* i: int or enum; f: float; d: double; t: sat_threads; a: sat_allocator */
    char also;       /* a value outside [low, high] that is allowed: '0' zero, 'I' +infinity, '-' anything negative and
                        finite, '2' (type i) only powers of two inside the range; ' ' none */
    double initial, low, high;
    const char *hint; /* what follows the range in a message: "TONEMAP_NO_SOFT left it out"; NULL: nothing */
} sat__field;

#define SAT__COUNT(array) ((int)(sizeof(array) / sizeof *(array)))
#define SAT__FIELD(type_of, type, name, initial, low, high, also) {#name, offsetof(type_of, name), type, also, initial, low, high, NULL}

/* The value of a field as a double; 0 for threads and allocators. */
static inline double sat__field_value(const sat__field *field, const void *options)
{
    const unsigned char *at = (const unsigned char *)options + field->offset;
    double d = 0;
    float f;
    int i;
    if (field->type == 'd') memcpy(&d, at, sizeof d);
    if (field->type == 'f') {
        memcpy(&f, at, sizeof f);
        d = (double)f;
    }
    if (field->type == 'i') {
        memcpy(&i, at, sizeof i);
        d = i;
    }
    return d;
}

static inline void sat__field_set(const sat__field *field, void *options, double value)
{
    unsigned char *at = (unsigned char *)options + field->offset;
    float f = (float)value;
    int i = field->type == 'i' ? (int)value : 0;
    if (field->type == 'd') memcpy(at, &value, sizeof value);
    else if (field->type == 'f') memcpy(at, &f, sizeof f);
    else if (field->type == 'i') memcpy(at, &i, sizeof i);
}

/* What X_defaults() is made of. */
static inline void sat__fields_default(void *options, size_t size, const sat__field *fields, int count)
{
    int i;
    memset(options, 0, size);
    for (i = 0; i < count; i++) sat__field_set(&fields[i], options, fields[i].initial);
}

static inline int sat__field_is_valid(const sat__field *field, const void *options)
{
    const unsigned char *at = (const unsigned char *)options + field->offset;
    double v = sat__field_value(field, options), low = field->low, high = field->high;
    sat_allocator allocator, resolved;
    sat_threads threads;
    if (field->type == 'f') { /* the float nearest to 1e-6 is in 1e-6.. */
        low = (double)(float)low;
        high = (double)(float)high;
    }
    if (field->type == 't') {
        memcpy(&threads, at, sizeof threads);
        return sat__threads_are_valid(&threads);
    }
    if (field->type == 'a') {
        memcpy(&allocator, at, sizeof allocator);
        return sat__resolve_allocator(&resolved, &allocator);
    }
    if (!sat__is_finite_double(v)) return field->also == 'I' && v > 0;
    if ((field->also == '0' && v == 0) || (field->also == '-' && v < 0)) return 1;
    if (field->also == '2' && ((int)v & ((int)v - 1))) return 0;
    return v >= low && v <= high;
}

/* The first field that is outside its range, or NULL. */
static inline const sat__field *sat__fields_check(const void *options, const sat__field *fields, int count)
{
    int i;
    for (i = 0; i < count; i++)
        if (!sat__field_is_valid(&fields[i], options)) return &fields[i];
    return NULL;
}

/* ---- sentences for X_explain: written into the caller's memory, cut where it ends */

typedef struct sat__text { char *at; size_t size, used; } sat__text;

static inline sat__text sat__text_begin(char *text, size_t size)
{
    sat__text t;
    t.at = text;
    t.size = text ? size : 0;
    t.used = 0;
    if (t.size) text[0] = 0;
    return t;
}

static inline void sat__text_add(sat__text *t, const char *words)
{
    while (*words && t->used + 1 < t->size) t->at[t->used++] = *words++;
    if (t->size) t->at[t->used] = 0;
}

/* value = 0.d[0]d[1]..d[5] * 10^(exponent + 1), rounded; returns the exponent. */
static inline int sat__six_digits(char d[6], double value)
{
    int exponent = 0, i;
    if (value > 0) {
        double decade = floor(log10(value));
        exponent = (int)decade;
        if (exponent < -290) value = value * 1e300 / pow(10, exponent + 300);
        else value /= pow(10, exponent);
        value = floor(value * 1e5 + 0.5);
        if (value >= 1e6) {
            value /= 10;
            exponent++;
        }
    }
    for (i = 5; i >= 0; i--) {
        double digit = fmod(value, 10);
        d[i] = (char)('0' + (int)digit);
        value = floor(value / 10);
    }
    return exponent;
}

/* A whole number that six digits would not hold. */
static inline void sat__text_whole(sat__text *t, double value)
{
    char out[24];
    int n = (int)sizeof out - 1;
    double rest = fabs(value);
    for (out[n] = 0; rest >= 1 && n > 1; rest = floor(rest / 10)) {
        double digit = fmod(rest, 10);
        out[--n] = (char)('0' + (int)digit);
    }
    if (value < 0) out[--n] = '-';
    sat__text_add(t, out + n);
}

/* As %.6g writes it, but with a point in every locale, and whole numbers with all their digits. */
static inline void sat__text_number(sat__text *t, double value)
{
    char d[6], out[32];
    int exponent, scientific, i, n = 0, last = 5, point;
    if (!sat__is_finite_double(value)) {
        sat__text_add(t, value > 0 ? "infinity" : value < 0 ? "-infinity" : "NaN");
        return;
    }
    exponent = sat__six_digits(d, fabs(value));
    if (exponent > 5 && exponent < 15 && floor(value) == value && fmod(fabs(value), pow(10, exponent - 5)) > 0) {
        sat__text_whole(t, value);
        return;
    }
    scientific = exponent < -4 || exponent > 5;
    point = scientific ? 0 : exponent;
    while (last > 0 && d[last] == '0') last--;
    if (value < 0) out[n++] = '-';
    for (i = point < 0 ? point : 0; i <= last || i <= point; i++) {
        out[n++] = i < 0 ? '0' : d[i];
        if (i == point && i < last) out[n++] = '.';
    }
    if (scientific) {
        out[n++] = 'e';
        if (exponent < 0) out[n++] = '-';
        exponent = exponent < 0 ? -exponent : exponent;
        if (exponent >= 100) out[n++] = (char)('0' + exponent / 100);
        if (exponent >= 10) out[n++] = (char)('0' + exponent / 10 % 10);
        out[n++] = (char)('0' + exponent % 10);
    }
    out[n] = 0;
    sat__text_add(t, out);
}

/* "scales is 99; 1..8" */
static inline void sat__text_range(sat__text *t, const char *name, double value, double low, double high, char also)
{
    sat__text_add(t, name);
    sat__text_add(t, " is ");
    sat__text_number(t, value);
    sat__text_add(t, "; ");
    sat__text_number(t, low);
    sat__text_add(t, "..");
    sat__text_number(t, high);
    if (also == '0') sat__text_add(t, " or 0");
    if (also == 'I') sat__text_add(t, " or infinity");
    if (also == '-') sat__text_add(t, " or negative");
    if (also == '2') sat__text_add(t, ", a power of two");
}

/* The sentence of a field that sat__fields_check found. */
static inline void sat__text_field(sat__text *t, const sat__field *field, const void *options)
{
    sat_threads threads;
    if (field->type == 'a') {
        sat__text_add(t, field->name);
        sat__text_add(t, ": alloc and release are needed, both or (with stdlib) none");
    } else if (field->type == 't') {
        memcpy(&threads, (const unsigned char *)options + field->offset, sizeof threads);
        if (threads.parallel_for) sat__text_range(t, "threads.workers", threads.workers, 1, 1024, ' ');
        else sat__text_range(t, "threads.workers without parallel_for", threads.workers, 0, 1, ' ');
    } else sat__text_range(t, field->name, sat__field_value(field, options), field->low, field->high, field->also);
    if (field->hint) {
        sat__text_add(t, ": ");
        sat__text_add(t, field->hint);
    }
}

/* ---- images */

static inline size_t sat__format_size(sat_format format)
{
    return format == SAT_U8 ? 1 : format == SAT_F32 ? 4 : 2;
}

/* Rows of width values of `size` bytes, *stride bytes apart. Resolves a stride of 0, packed; returns 0 where rows
   overlap or `element`, what they are made of, is not aligned. */
static inline int sat__rows_are_valid(const void *pixels, ptrdiff_t *stride, int width, int height, size_t size,
                                      size_t element)
{
    size_t row, step;
    if (!pixels || (uintptr_t)pixels % element || width < 1 || height < 1) return 0;
    if (!sat__multiply_size(&row, (size_t)width, size)) return 0;
    if (*stride == 0) *stride = (ptrdiff_t)row;
    step = *stride < 0 ? (size_t)0 - (size_t)*stride : (size_t)*stride;
    return step % element == 0 && (height == 1 || step >= row);
}

static inline ptrdiff_t sat__image_stride(const sat_image *image)
{
    if (image->stride) return image->stride;
    return (ptrdiff_t)((size_t)image->width * (size_t)image->channels * sat__format_size(image->format));
}

/* A view the other functions may read: 1 to 4 channels, a known format, rows as above. */
static inline int sat__image_is_valid(const sat_image *image)
{
    ptrdiff_t stride;
    size_t element;
    if (!image || image->channels < 1 || image->channels > 4 || (unsigned)image->format > (unsigned)SAT_F16) return 0;
    stride = image->stride;
    element = sat__format_size(image->format);
    return sat__rows_are_valid(image->pixels, &stride, image->width, image->height, (size_t)image->channels * element,
                               element);
}

static inline const void *sat__image_row(const sat_image *image, int y)
{
    return (const unsigned char *)image->pixels + (ptrdiff_t)y * sat__image_stride(image);
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

/* ---- >> for siblings, vectors

   Four floats or integers at a time: SSE2, NEON, or plain lanes in a struct, with the same bits in all three. So a loop
   is written once. SAT__VECTOR says that they are instructions. */

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
static inline sat__f32x4 sat__f32x4_abs(sat__f32x4 a)
{
    return _mm_and_ps(a, _mm_castsi128_ps(_mm_set1_epi32(0x7fffffff)));
}
/* comparisons give all-one or all-zero lanes */
static inline sat__i32x4 sat__f32x4_less(sat__f32x4 a, sat__f32x4 b) { return _mm_castps_si128(_mm_cmplt_ps(a, b)); }
static inline sat__i32x4 sat__f32x4_less_equal(sat__f32x4 a, sat__f32x4 b)
{
    return _mm_castps_si128(_mm_cmple_ps(a, b));
}
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
static inline sat__i32x4 sat__f32x4_round(sat__f32x4 v) { return _mm_cvtps_epi32(v); } /* to nearest even; the same */
static inline sat__i32x4 sat__i32x4_last(sat__i32x4 v) { return _mm_shuffle_epi32(v, 0xff); } /* in all four */
static inline sat__i32x4 sat__i32x4_prefix(sat__i32x4 v)                                      /* running sums */
{
    v = _mm_add_epi32(v, _mm_slli_si128(v, 4));
    return _mm_add_epi32(v, _mm_slli_si128(v, 8));
}
/* past the cache; 16 bytes aligned */
static inline void sat__i32x4_stream(int32_t *p, sat__i32x4 v) { _mm_stream_si128((__m128i *)(void *)p, v); }
static inline sat__i32x4 sat__f32x4_bits(sat__f32x4 v) { return _mm_castps_si128(v); }
static inline sat__f32x4 sat__f32x4_from_bits(sat__i32x4 v) { return _mm_castsi128_ps(v); }
static inline sat__i32x4 sat__i32x4_shift_right(sat__i32x4 v, int bits)
{
    return _mm_srl_epi32(v, _mm_cvtsi32_si128(bits));
} /* zeros come in */
static inline void sat__f32x4_load3(const float *p, sat__f32x4 *r, sat__f32x4 *g,
                                    sat__f32x4 *b) /* four packed RGB pixels */
{
    __m128 u = _mm_loadu_ps(p), v = _mm_loadu_ps(p + 4), w = _mm_loadu_ps(p + 8);       /* rgbr gbrg brgb */
    __m128 s = _mm_shuffle_ps(v, w, _MM_SHUFFLE(2, 1, 3, 2)),
           t = _mm_shuffle_ps(u, v, _MM_SHUFFLE(1, 0, 2, 1)); /* rgrg gbgb */
    *r = _mm_shuffle_ps(u, s, _MM_SHUFFLE(2, 0, 3, 0));
    *g = _mm_shuffle_ps(t, s, _MM_SHUFFLE(3, 1, 2, 0));
    *b = _mm_shuffle_ps(t, w, _MM_SHUFFLE(3, 0, 3, 1));
}
static inline void sat__f32x4_load4(const float *p, sat__f32x4 *r, sat__f32x4 *g, sat__f32x4 *b,
                                    sat__f32x4 *a) /* four RGBA pixels */
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
static inline sat__f32x4 sat__f32x4_min(sat__f32x4 a, sat__f32x4 b)
{
    return vbslq_f32(vcltq_f32(a, b), a, b);
} /* NaN: b, as SSE2 */
static inline sat__f32x4 sat__f32x4_max(sat__f32x4 a, sat__f32x4 b) { return vbslq_f32(vcgtq_f32(a, b), a, b); }
static inline sat__f32x4 sat__f32x4_sqrt(sat__f32x4 a) { return vsqrtq_f32(a); }
static inline sat__f32x4 sat__f32x4_abs(sat__f32x4 a) { return vabsq_f32(a); }
static inline sat__i32x4 sat__f32x4_less(sat__f32x4 a, sat__f32x4 b) { return vreinterpretq_s32_u32(vcltq_f32(a, b)); }
static inline sat__i32x4 sat__f32x4_less_equal(sat__f32x4 a, sat__f32x4 b)
{
    return vreinterpretq_s32_u32(vcleq_f32(a, b));
}
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
static inline sat__i32x4 sat__i32x4_greater(sat__i32x4 a, sat__i32x4 b)
{
    return vreinterpretq_s32_u32(vcgtq_s32(a, b));
}
static inline sat__f32x4 sat__i32x4_to_f32(sat__i32x4 v) { return vcvtq_f32_s32(v); }
static inline sat__i32x4 sat__f32x4_truncate(sat__f32x4 v) { return vcvtq_s32_f32(v); }
static inline sat__i32x4 sat__f32x4_round(sat__f32x4 v) { return vcvtnq_s32_f32(v); }
static inline sat__i32x4 sat__i32x4_last(sat__i32x4 v) { return vdupq_laneq_s32(v, 3); }
static inline sat__i32x4 sat__i32x4_prefix(sat__i32x4 v)
{
    v = vaddq_s32(v, vextq_s32(vdupq_n_s32(0), v, 3));
    return vaddq_s32(v, vextq_s32(vdupq_n_s32(0), v, 2));
}
static inline void sat__i32x4_stream(int32_t *p, sat__i32x4 v) { vst1q_s32(p, v); }
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
#else
/* Plain C: four lanes in a struct, the same bits. Written out, not as a loop: so compilers make vectors of them. */
typedef struct sat__f32x4 { float lane[4]; } sat__f32x4;
typedef struct sat__i32x4 { int32_t lane[4]; } sat__i32x4;
#define SAT__LANES(type, name, arguments, value)                                                                       \
    static inline type name arguments                                                                                  \
    {                                                                                                                  \
        type v;                                                                                                        \
        int i = 0;                                                                                                     \
        v.lane[i] = (value);                                                                                           \
        i++;                                                                                                           \
        v.lane[i] = (value);                                                                                           \
        i++;                                                                                                           \
        v.lane[i] = (value);                                                                                           \
        i++;                                                                                                           \
        v.lane[i] = (value);                                                                                           \
        return v;                                                                                                      \
    }
SAT__LANES(sat__f32x4, sat__f32x4_load, (const float *p), p[i])
SAT__LANES(sat__f32x4, sat__f32x4_set1, (float a), a)
SAT__LANES(sat__f32x4, sat__f32x4_add, (sat__f32x4 a, sat__f32x4 b), a.lane[i] + b.lane[i])
SAT__LANES(sat__f32x4, sat__f32x4_sub, (sat__f32x4 a, sat__f32x4 b), a.lane[i] - b.lane[i])
SAT__LANES(sat__f32x4, sat__f32x4_mul, (sat__f32x4 a, sat__f32x4 b), a.lane[i] * b.lane[i])
SAT__LANES(sat__f32x4, sat__f32x4_div, (sat__f32x4 a, sat__f32x4 b), a.lane[i] / b.lane[i])
SAT__LANES(sat__f32x4, sat__f32x4_min, (sat__f32x4 a, sat__f32x4 b), a.lane[i] < b.lane[i] ? a.lane[i] : b.lane[i])
SAT__LANES(sat__f32x4, sat__f32x4_max, (sat__f32x4 a, sat__f32x4 b), a.lane[i] > b.lane[i] ? a.lane[i] : b.lane[i])
SAT__LANES(sat__f32x4, sat__f32x4_sqrt, (sat__f32x4 a), sqrtf(a.lane[i]))
SAT__LANES(sat__f32x4, sat__f32x4_abs, (sat__f32x4 a), fabsf(a.lane[i]))
SAT__LANES(sat__i32x4, sat__f32x4_less, (sat__f32x4 a, sat__f32x4 b), -(int32_t)(a.lane[i] < b.lane[i]))
SAT__LANES(sat__i32x4, sat__f32x4_less_equal, (sat__f32x4 a, sat__f32x4 b), -(int32_t)(a.lane[i] <= b.lane[i]))
SAT__LANES(sat__f32x4, sat__f32x4_select, (sat__i32x4 mask, sat__f32x4 yes, sat__f32x4 no),
           mask.lane[i] ? yes.lane[i] : no.lane[i])
SAT__LANES(sat__i32x4, sat__i32x4_load, (const int32_t *p), p[i])
SAT__LANES(sat__i32x4, sat__i32x4_set1, (int32_t a), a)
SAT__LANES(sat__i32x4, sat__i32x4_add, (sat__i32x4 a, sat__i32x4 b),
           (int32_t)((uint32_t)a.lane[i] + (uint32_t)b.lane[i]))
SAT__LANES(sat__i32x4, sat__i32x4_sub, (sat__i32x4 a, sat__i32x4 b),
           (int32_t)((uint32_t)a.lane[i] - (uint32_t)b.lane[i]))
SAT__LANES(sat__i32x4, sat__i32x4_and, (sat__i32x4 a, sat__i32x4 b), a.lane[i] & b.lane[i])
SAT__LANES(sat__i32x4, sat__i32x4_or, (sat__i32x4 a, sat__i32x4 b), a.lane[i] | b.lane[i])
SAT__LANES(sat__i32x4, sat__i32x4_greater, (sat__i32x4 a, sat__i32x4 b), -(int32_t)(a.lane[i] > b.lane[i]))
SAT__LANES(sat__f32x4, sat__i32x4_to_f32, (sat__i32x4 a), (float)a.lane[i])
SAT__LANES(sat__i32x4, sat__f32x4_truncate, (sat__f32x4 a),
           fabsf(a.lane[i]) < 2147483648.0f ? (int32_t)a.lane[i] : INT32_MIN)
SAT__LANES(sat__i32x4, sat__i32x4_shift_right, (sat__i32x4 a, int bits), (int32_t)((uint32_t)a.lane[i] >> bits))
static inline int32_t sat__round(float a) /* 1.5 * 2^52 leaves the integer in the low bits of a double */
{
    double shifted = (double)a + 6755399441055744.0;
    uint64_t bits;
    memcpy(&bits, &shifted, sizeof bits);
    return (int32_t)(uint32_t)bits;
}
SAT__LANES(sat__i32x4, sat__f32x4_round, (sat__f32x4 a), sat__round(a.lane[i]))
SAT__LANES(sat__i32x4, sat__i32x4_last, (sat__i32x4 a), a.lane[3 + 0 * i])
static inline sat__i32x4 sat__i32x4_prefix(sat__i32x4 v)
{
    v.lane[1] = (int32_t)((uint32_t)v.lane[1] + (uint32_t)v.lane[0]);
    v.lane[2] = (int32_t)((uint32_t)v.lane[2] + (uint32_t)v.lane[1]);
    v.lane[3] = (int32_t)((uint32_t)v.lane[3] + (uint32_t)v.lane[2]);
    return v;
}
static inline void sat__f32x4_store(float *p, sat__f32x4 v) { memcpy(p, v.lane, sizeof v); }
static inline void sat__i32x4_store(int32_t *p, sat__i32x4 v) { memcpy(p, v.lane, sizeof v); }
static inline void sat__i32x4_stream(int32_t *p, sat__i32x4 v) { sat__i32x4_store(p, v); }
static inline int sat__i32x4_any(sat__i32x4 v) { return (v.lane[0] | v.lane[1] | v.lane[2] | v.lane[3]) != 0; }
static inline int sat__i32x4_all(sat__i32x4 v) { return (v.lane[0] & v.lane[1] & v.lane[2] & v.lane[3]) == -1; }
static inline sat__i32x4 sat__f32x4_bits(sat__f32x4 a)
{
    sat__i32x4 v;
    memcpy(v.lane, a.lane, sizeof v);
    return v;
}
static inline sat__f32x4 sat__f32x4_from_bits(sat__i32x4 a)
{
    sat__f32x4 v;
    memcpy(v.lane, a.lane, sizeof v);
    return v;
}
static inline void sat__f32x4_load3(const float *p, sat__f32x4 *r, sat__f32x4 *g, sat__f32x4 *b)
{
    int i;
    for (i = 0; i < 4; i++, p += 3) {
        r->lane[i] = p[0];
        g->lane[i] = p[1];
        b->lane[i] = p[2];
    }
}
static inline void sat__f32x4_load4(const float *p, sat__f32x4 *r, sat__f32x4 *g, sat__f32x4 *b, sat__f32x4 *a)
{
    int i;
    for (i = 0; i < 4; i++, p += 4) {
        r->lane[i] = p[0];
        g->lane[i] = p[1];
        b->lane[i] = p[2];
        a->lane[i] = p[3];
    }
}
#endif

/* row[x] = above[x] + in[0] + ... + in[x] modulo 2^32. All three are to be longer than width: it reads and writes up to
   three beyond. */
static inline void sat__add_row(uint32_t *row, const uint32_t *above, const int32_t *in, int width)
{
    sat__i32x4 carry = sat__i32x4_set1(0);
    int x;
    for (x = 0; x < width; x += 4) {
        sat__i32x4 sum = sat__i32x4_add(sat__i32x4_prefix(sat__i32x4_load(in + x)), carry);
        carry = sat__i32x4_last(sum);
        sat__i32x4_store((int32_t *)(void *)(row + x),
                         sat__i32x4_add(sum, sat__i32x4_load((const int32_t *)(const void *)(above + x))));
    }
}

/* What a sibling's implementation calls to be sure that sat.h was implemented, and in this version. */
static inline int sat__version_matches(void)
{
    return sat__define_SAT_IMPLEMENTATION_in_exactly_one_c_file == SAT_VERSION;
}

SAT__IEEE_END
#endif /* SAT__SHARED */
/* dist: nothing */

/* ------------------------------------------------------------------------------------------------
   >> for siblings, OpenGL

   Written for GL 3.3 core, and for ES 3.0 as long as the shaders stay within GLSL ES 3.00. A sibling
   defines SAT_SIBLING and SAT_SIBLING_GL before it includes this header in its implementation part, keeps
   a sat__gl in its object, and does

       create    sat__gl_open, sat__gl_build_table, sat__gl_make_target, sat__gl_texture
       a frame   sat__gl_begin, { SAT__GL_START, sat__gl_set_..., sat__gl_draw, or SAT__GL_PASS } ..., sat__gl_end
       destroy   sat__gl_delete_programs, sat__gl_free_target, DeleteTextures, sat__gl_close

   with the context current. Anything not wrapped here is called through the table: gl->DrawBuffers(...).
   A frame's calls ask nothing of the GPU that makes the CPU wait.
   ------------------------------------------------------------------------------------------------ */

/* dist: shared_gl */
#if ((defined(SAT_IMPLEMENTATION) && defined(SAT_GL)) || defined(SAT_SIBLING_GL)) && !defined(SAT__SHARED_GL)
#define SAT__SHARED_GL

#include <stdio.h>

#if defined(_WIN32)
#define SAT__GL_CALL __stdcall
#else
#define SAT__GL_CALL
#endif

/* GLSL as a string: a macro a function, its directives (#if ...) beside it in quotes. Comments and line ends go; what
   is in the macro has as many ( as ) and is not expanded. */
#define SAT__GLSL(...) #__VA_ARGS__ "\n"

/* What a macro stands for, as text: constants and equations that C and GLSL share stand in C alone. */
#define SAT__TEXT_OF(...) #__VA_ARGS__
#define SAT__TEXT(...) SAT__TEXT_OF(__VA_ARGS__)

/* The names and numbers of the OpenGL registry, as far as the six headers use them. */
enum {
    SAT__GL_NO_ERROR = 0,
    SAT__GL_POINTS = 0x0000,
    SAT__GL_TRIANGLES = 0x0004,
    SAT__GL_TRIANGLE_STRIP = 0x0005,
    SAT__GL_ZERO = 0,
    SAT__GL_ONE = 1,
    SAT__GL_SRC_ALPHA = 0x0302,
    SAT__GL_ONE_MINUS_SRC_ALPHA = 0x0303,
    SAT__GL_LEQUAL = 0x0203,
    SAT__GL_FILL = 0x1B02,
    SAT__GL_BLEND_DST_RGB = 0x80C8,
    SAT__GL_BLEND_SRC_RGB = 0x80C9,
    SAT__GL_BLEND_DST_ALPHA = 0x80CA,
    SAT__GL_BLEND_SRC_ALPHA = 0x80CB,
    SAT__GL_BLEND_EQUATION_RGB = 0x8009,
    SAT__GL_BLEND_EQUATION_ALPHA = 0x883D,
    SAT__GL_FRONT_AND_BACK = 0x0408,
    SAT__GL_POLYGON_MODE = 0x0B40,
    SAT__GL_DEPTH_WRITEMASK = 0x0B72,
    SAT__GL_DEPTH_FUNC = 0x0B74,
    SAT__GL_VIEWPORT = 0x0BA2,
    SAT__GL_COLOR_WRITEMASK = 0x0C23,
    SAT__GL_CULL_FACE = 0x0B44,
    SAT__GL_DEPTH_TEST = 0x0B71,
    SAT__GL_STENCIL_TEST = 0x0B90,
    SAT__GL_DITHER = 0x0BD0,
    SAT__GL_BLEND = 0x0BE2,
    SAT__GL_COLOR_LOGIC_OP = 0x0BF2,
    SAT__GL_SCISSOR_TEST = 0x0C11,
    SAT__GL_SAMPLE_ALPHA_TO_COVERAGE = 0x809E,
    SAT__GL_SAMPLE_COVERAGE = 0x80A0,
    SAT__GL_FRAMEBUFFER_SRGB = 0x8DB9,
    SAT__GL_RASTERIZER_DISCARD = 0x8C89,
    SAT__GL_PROGRAM_POINT_SIZE = 0x8642,
    SAT__GL_UNPACK_SWAP_BYTES = 0x0CF0,
    SAT__GL_UNPACK_ROW_LENGTH = 0x0CF2,
    SAT__GL_UNPACK_SKIP_ROWS = 0x0CF3,
    SAT__GL_UNPACK_SKIP_PIXELS = 0x0CF4,
    SAT__GL_UNPACK_ALIGNMENT = 0x0CF5,
    SAT__GL_UNPACK_SKIP_IMAGES = 0x806D,
    SAT__GL_UNPACK_IMAGE_HEIGHT = 0x806E,
    SAT__GL_PACK_SWAP_BYTES = 0x0D00,
    SAT__GL_PACK_ROW_LENGTH = 0x0D02,
    SAT__GL_PACK_SKIP_ROWS = 0x0D03,
    SAT__GL_PACK_SKIP_PIXELS = 0x0D04,
    SAT__GL_PACK_ALIGNMENT = 0x0D05,
    SAT__GL_MAX_TEXTURE_SIZE = 0x0D33,
    SAT__GL_TEXTURE_2D = 0x0DE1,
    SAT__GL_TEXTURE_2D_ARRAY = 0x8C1A,
    SAT__GL_TEXTURE_BINDING_2D = 0x8069,
    SAT__GL_TEXTURE_BINDING_2D_ARRAY = 0x8C1D,
    SAT__GL_SAMPLER_BINDING = 0x8919,
    SAT__GL_TEXTURE0 = 0x84C0,
    SAT__GL_ACTIVE_TEXTURE = 0x84E0,
    SAT__GL_TEXTURE_MAG_FILTER = 0x2800,
    SAT__GL_TEXTURE_MIN_FILTER = 0x2801,
    SAT__GL_TEXTURE_WRAP_S = 0x2802,
    SAT__GL_TEXTURE_WRAP_T = 0x2803,
    SAT__GL_TEXTURE_MAX_LEVEL = 0x813D,
    SAT__GL_NEAREST = 0x2600,
    SAT__GL_LINEAR = 0x2601,
    SAT__GL_CLAMP_TO_EDGE = 0x812F,
    SAT__GL_UNSIGNED_BYTE = 0x1401,
    SAT__GL_UNSIGNED_SHORT = 0x1403,
    SAT__GL_INT = 0x1404,
    SAT__GL_UNSIGNED_INT = 0x1405,
    SAT__GL_FLOAT = 0x1406,
    SAT__GL_DEPTH_COMPONENT = 0x1902,
    SAT__GL_RED = 0x1903,
    SAT__GL_RGB = 0x1907,
    SAT__GL_RGBA = 0x1908,
    SAT__GL_RG = 0x8227,
    SAT__GL_RG_INTEGER = 0x8228,
    SAT__GL_RED_INTEGER = 0x8D94,
    SAT__GL_RGBA_INTEGER = 0x8D99,
    SAT__GL_R8 = 0x8229,
    SAT__GL_RG8 = 0x822B,
    SAT__GL_RGBA8 = 0x8058,
    SAT__GL_SRGB8_ALPHA8 = 0x8C43,
    SAT__GL_R8UI = 0x8232,
    SAT__GL_R16F = 0x822D,
    SAT__GL_RG16F = 0x822F,
    SAT__GL_RGBA16F = 0x881A,
    SAT__GL_R32F = 0x822E,
    SAT__GL_RG32F = 0x8230,
    SAT__GL_RGB32F = 0x8815,
    SAT__GL_RGBA32F = 0x8814,
    SAT__GL_R32I = 0x8235,
    SAT__GL_RGBA32I = 0x8D82,
    SAT__GL_R32UI = 0x8236,
    SAT__GL_RG32UI = 0x823C,
    SAT__GL_RGBA32UI = 0x8D70,
    SAT__GL_R16UI = 0x8234,
    SAT__GL_DEPTH_COMPONENT24 = 0x81A6,
    SAT__GL_DEPTH_COMPONENT32F = 0x8CAC,
    SAT__GL_VERSION = 0x1F02,
    SAT__GL_FRAGMENT_SHADER = 0x8B30,
    SAT__GL_VERTEX_SHADER = 0x8B31,
    SAT__GL_COMPUTE_SHADER = 0x91B9,
    SAT__GL_COMPILE_STATUS = 0x8B81,
    SAT__GL_LINK_STATUS = 0x8B82,
    SAT__GL_CURRENT_PROGRAM = 0x8B8D,
    SAT__GL_INTERLEAVED_ATTRIBS = 0x8C8C,
    SAT__GL_VERTEX_ARRAY_BINDING = 0x85B5,
    SAT__GL_ARRAY_BUFFER = 0x8892,
    SAT__GL_ARRAY_BUFFER_BINDING = 0x8894,
    SAT__GL_DYNAMIC_COPY = 0x88EA,
    SAT__GL_MAP_READ_BIT = 0x0001,
    SAT__GL_PIXEL_PACK_BUFFER = 0x88EB,
    SAT__GL_PIXEL_UNPACK_BUFFER = 0x88EC,
    SAT__GL_PIXEL_PACK_BUFFER_BINDING = 0x88ED,
    SAT__GL_PIXEL_UNPACK_BUFFER_BINDING = 0x88EF,
    SAT__GL_TRANSFORM_FEEDBACK_BUFFER = 0x8C8E,
    SAT__GL_TRANSFORM_FEEDBACK_BUFFER_BINDING = 0x8C8F,
    SAT__GL_TRANSFORM_FEEDBACK_BUFFER_START = 0x8C84,
    SAT__GL_TRANSFORM_FEEDBACK_BUFFER_SIZE = 0x8C85,
    SAT__GL_READ_FRAMEBUFFER = 0x8CA8,
    SAT__GL_DRAW_FRAMEBUFFER = 0x8CA9,
    SAT__GL_FRAMEBUFFER = 0x8D40,
    SAT__GL_DRAW_FRAMEBUFFER_BINDING = 0x8CA6,
    SAT__GL_READ_FRAMEBUFFER_BINDING = 0x8CAA,
    SAT__GL_FRAMEBUFFER_COMPLETE = 0x8CD5,
    SAT__GL_COLOR_ATTACHMENT0 = 0x8CE0,
    SAT__GL_DEPTH_ATTACHMENT = 0x8D00,
    SAT__GL_COLOR = 0x1800,
    SAT__GL_WRITE_ONLY = 0x88B9,
    SAT__GL_READ_WRITE = 0x88BA,
    SAT__GL_IMAGE_BINDING_NAME = 0x8F3A,
    SAT__GL_IMAGE_BINDING_LEVEL = 0x8F3B,
    SAT__GL_IMAGE_BINDING_LAYERED = 0x8F3C,
    SAT__GL_IMAGE_BINDING_LAYER = 0x8F3D,
    SAT__GL_IMAGE_BINDING_ACCESS = 0x8F3E,
    SAT__GL_IMAGE_BINDING_FORMAT = 0x906E,
    SAT__GL_TEXTURE_FETCH_BARRIER_BIT = 0x0008,
    SAT__GL_SHADER_IMAGE_ACCESS_BARRIER_BIT = 0x0020,
    SAT__GL_TEXTURE_UPDATE_BARRIER_BIT = 0x0100,
    SAT__GL_FRAMEBUFFER_BARRIER_BIT = 0x0400
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
    X(unsigned, CheckFramebufferStatus, (unsigned target))                                                             \
    X(void, ClearBufferfv, (unsigned buffer, int index, const float *value))                                           \
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
    X(void, DrawArrays, (unsigned mode, int first, int count))                                                         \
    X(void, DrawArraysInstanced, (unsigned mode, int first, int count, int instances))                                 \
    X(void, DrawBuffers, (int count, const unsigned *buffers))                                                         \
    X(void, Enable, (unsigned capability))                                                                             \
    X(void, EnableVertexAttribArray, (unsigned index))                                                                 \
    X(void, EndTransformFeedback, (void))                                                                              \
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
    X(void, PixelStorei, (unsigned name, int value))                                                                   \
    X(void, ReadBuffer, (unsigned source))                                                                             \
    X(void, ReadPixels, (int x, int y, int width, int height, unsigned format, unsigned type, void *pixels))           \
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
    X(void, Uniform1i, (int location, int x))                                                                          \
    X(void, Uniform2i, (int location, int x, int y))                                                                   \
    X(void, Uniform3i, (int location, int x, int y, int z))                                                            \
    X(void, Uniform4i, (int location, int x, int y, int z, int w))                                                     \
    X(void, Uniform1ui, (int location, unsigned x))                                                                    \
    X(void, Uniform3fv, (int location, int count, const float *values))                                                \
    X(void, Uniform4fv, (int location, int count, const float *values))                                                \
    X(void, UseProgram, (unsigned program))                                                                            \
    X(void, VertexAttribDivisor, (unsigned index, unsigned divisor))                                                   \
    X(void, VertexAttribPointer, (unsigned index, int size, unsigned type, unsigned char normalized, int stride,       \
                                  const void *offset))                                                                 \
    X(void, Viewport, (int x, int y, int width, int height))

/* ... and these may be NULL: the first three in WebGL, the others where has_compute is 0. */
#define SAT__GL_OPTIONAL_FUNCTIONS(X)                                                                                  \
    X(void *, MapBufferRange, (unsigned target, ptrdiff_t offset, ptrdiff_t size, unsigned access))                    \
    X(unsigned char, UnmapBuffer, (unsigned target))                                                                   \
    X(void, PolygonMode, (unsigned face, unsigned mode))                                                               \
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
    int has_compute;            /* GL 4.3 compute shaders */
    int max_size;               /* largest width and height of a texture */
    unsigned vertex_array;      /* without any attribute: what full-screen passes draw with */
    unsigned framebuffer;       /* for sat__gl_read and sat__gl_attach */
    char defines[2048];         /* #define lines for the next sat__gl_build */
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
    const char *missing = NULL, *version;
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
    gl->has_compute =
        !gl->is_es && gl->version >= 43 && gl->BindImageTexture && gl->DispatchCompute && gl->MemoryBarrier;
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
    const char *const *fragment;   /* NULL: draws nothing, for transform feedback. Bind a framebuffer of yours even
                                      so: a context without a window has none, and refuses to draw */
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

static inline void sat__gl_define_text(sat__gl *gl, const char *name, const char *text)
{
    size_t used = strlen(gl->defines);
    SAT_ASSERT(used + strlen(name) + strlen(text) + 12 < sizeof gl->defines);
    snprintf(gl->defines + used, sizeof gl->defines - used, "#define %s %s\n", name, text);
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
static inline unsigned sat__gl_compile(sat__gl *gl, unsigned type, const sat__gl_shaders *shaders,
                                       const char *const *text)
{
    static const char es_precision[] = "precision highp float;\nprecision highp int;\nprecision highp sampler2D;\n"
                                       "precision highp isampler2D;\nprecision highp usampler2D;\n"
                                       "precision highp sampler2DArray;\n";
    const char *stage = type == SAT__GL_VERTEX_SHADER    ? "vertex"
                        : type == SAT__GL_COMPUTE_SHADER ? "compute"
                                                         : "fragment";
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
        snprintf(gl->message, sizeof gl->message, "%s: a %s shader does not compile\n%s", shaders->name, stage, log);
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
        SAT__GLSL(
            void main() {
                gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
            }), NULL};
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

/* ---- the table of programs: a line each, with what it reads and its texts. Nothing else lists them: the object has an
   array of programs with an enum of the same order, and where a pass is run its textures follow in the order of the
   samplers (SAT__GL_PASS). */

#define SAT__GL_COMPUTE (1 << 30) /* in `when`: a compute shader, made only where the context has them */

typedef struct sat__gl_program {
    const char *name;        /* for messages, such as "tonemap: steps" */
    int when;                /* bits of the header's own: it is made where all of them are given; 0: always */
    const char *samplers;    /* "luminance state": those of the units 0, 1, ... */
    const char *defines;     /* #define lines of its own, or NULL */
    const char *const *vertex; /* texts, NULL behind the last; NULL: a triangle over the whole viewport */
    const char *fragment[8];   /* texts, one behind the other */
} sat__gl_program;

/* The samplers of a program read the units 0, 1, ..., for good. */
static inline void sat__gl_name_units(sat__gl *gl, unsigned program, const char *samplers)
{
    char name[32];
    int unit;
    gl->UseProgram(program);
    for (unit = 0; *samplers; unit++) {
        size_t n = strcspn(samplers, " ");
        SAT_ASSERT(n < sizeof name);
        memcpy(name, samplers, n);
        name[n] = 0;
        gl->Uniform1i(gl->GetUniformLocation(program, name), unit);
        samplers += n + (samplers[n] == ' ');
    }
}

/* Makes programs[i] of each line i of the table that is wanted; the others are 0. The pending #define lines and
   `library` go in front of all. Between sat__gl_begin and sat__gl_end; delete them with sat__gl_delete_programs. */
static inline sat_result sat__gl_build_table(sat__gl *gl, unsigned *programs, const sat__gl_program *table, int count,
                                             int given, const char *const *library)
{
    char defines[sizeof gl->defines];
    sat_result result = SAT_OK;
    int i, wanted = given | (gl->has_compute ? SAT__GL_COMPUTE : 0);
    memcpy(defines, gl->defines, sizeof defines);
    for (i = 0; i < count && result == SAT_OK; i++) {
        const char *fragment[9];
        sat__gl_shaders shaders;
        programs[i] = 0;
        if ((table[i].when & wanted) != table[i].when) continue;
        memset(&shaders, 0, sizeof shaders);
        memcpy(fragment, table[i].fragment, sizeof table[i].fragment);
        fragment[8] = NULL;
        shaders.name = table[i].name;
        shaders.library = library;
        shaders.vertex = table[i].vertex;
        if (table[i].when & SAT__GL_COMPUTE) shaders.compute = fragment;
        else shaders.fragment = fragment;
        snprintf(gl->defines, sizeof gl->defines, "%s%s", defines, table[i].defines ? table[i].defines : "");
        result = sat__gl_build(gl, &programs[i], &shaders);
        if (result == SAT_OK) sat__gl_name_units(gl, programs[i], table[i].samplers);
    }
    gl->defines[0] = 0;
    return result;
}

static inline void sat__gl_delete_programs(sat__gl *gl, unsigned *programs, int count)
{
    int i;
    for (i = 0; i < count; i++) {
        gl->DeleteProgram(programs[i]); /* 0 is ignored */
        programs[i] = 0;
    }
}

/* ---- >> for siblings, textures: and framebuffers. These change bindings: call them between sat__gl_begin and
   sat__gl_end. */

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
        {SAT__GL_RGBA32I, SAT__GL_RGBA_INTEGER, SAT__GL_INT, 16},
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
static inline void sat__gl_upload(sat__gl *gl, unsigned texture, unsigned internal, int width, int height,
                                  const void *pixels)
{
    unsigned format = 0, type = 0;
    sat__gl_transfer(internal, &format, &type);
    gl->ActiveTexture(SAT__GL_TEXTURE0);
    gl->BindTexture(SAT__GL_TEXTURE_2D, texture);
    gl->TexSubImage2D(SAT__GL_TEXTURE_2D, 0, 0, 0, width, height, format, type, pixels);
}

/* Binds a framebuffer and gives it `count` colour attachments and, unless 0, a depth texture. */
static inline sat_result sat__gl_attach(sat__gl *gl, unsigned framebuffer, const unsigned *textures, int count,
                                        unsigned depth)
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

/* A texture that passes draw into, and its framebuffer: what a header's objects mostly are made of. */
typedef struct sat__gl_target {
    unsigned texture, framebuffer;
    int width, height;
} sat__gl_target;

static inline void sat__gl_free_target(sat__gl *gl, sat__gl_target *target)
{
    if (target->framebuffer) gl->DeleteFramebuffers(1, &target->framebuffer);
    if (target->texture) gl->DeleteTextures(1, &target->texture);
    memset(target, 0, sizeof *target);
}

static inline sat_result sat__gl_make_target(sat__gl *gl, sat__gl_target *target, unsigned internal, int width,
                                             int height)
{
    sat_result result = sat__gl_texture(gl, &target->texture, internal, width, height, NULL);
    target->framebuffer = 0;
    target->width = width;
    target->height = height;
    if (result == SAT_OK) result = sat__gl_framebuffer(gl, &target->framebuffer, &target->texture, 1, 0);
    if (result != SAT_OK) sat__gl_free_target(gl, target);
    return result;
}

/* Copies a texture into packed rows; waits for the GPU. Some ES drivers read only RGBA back. */
static inline sat_result sat__gl_read(sat__gl *gl, void *pixels, unsigned texture, unsigned internal, int width,
                                      int height)
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

/* What a shader that draws to a sat_gl_target has instead of gl_FragCoord: the pixel of the picture. The uniform is x,
   y, and with flip the height, else 0. */
#define SAT__GL_PIXEL                                                                                                  \
    SAT__GLSL(                                                                                                         \
        uniform ivec3 sat_corner_of;                                                                                   \
        ivec2 sat_pixel() {                                                                                            \
            ivec2 p = ivec2(gl_FragCoord.xy) - sat_corner_of.xy;                                                       \
            return sat_corner_of.z > 0 ? ivec2(p.x, sat_corner_of.z - 1 - p.y) : p;                                    \
        })
static inline const char *sat__gl_pixel(void) { return SAT__GL_PIXEL; }

/* What is added to a pixel of the picture where its inputs are fetched. */
#define SAT__GL_FROM SAT__GLSL(uniform ivec2 sat_from;)
static inline void sat__gl_set_from(sat__gl *gl, unsigned program, const sat_gl_target *to)
{
    gl->Uniform2i(gl->GetUniformLocation(program, "sat_from"), to ? to->from_x : 0, to ? to->from_y : 0);
}

static inline int sat__gl_target_is_valid(const sat_gl_target *target)
{
    if (target && (target->from_x < 0 || target->from_y < 0 || target->width < 0 || target->height < 0 ||
                   (target->width > 0) != (target->height > 0)))
        return 0;
    if (!target || target->place == SAT_GL_OWN) return 1;
    return (unsigned)target->place <= (unsigned)SAT_GL_FRAMEBUFFER && target->layer >= 0 &&
           (target->name != 0 || target->place == SAT_GL_FRAMEBUFFER);
}

/* The size of this call's picture, from the created one: the target's, when it names one. 0 when it is larger. */
static inline int sat__gl_take_size(const sat_gl_target *target, int *width, int *height)
{
    if (!target || !target->width) return 1;
    if (target->width > *width || target->height > *height) return 0;
    *width = target->width;
    *height = target->height;
    return 1;
}

/* Whether the target is this texture, which the pass reads. */
static inline int sat__gl_target_is(const sat_gl_target *target, unsigned texture)
{
    return target && texture && target->name == texture && target->place != SAT_GL_OWN &&
           target->place != SAT_GL_FRAMEBUFFER;
}

/* Binds the framebuffer of a target, `own` for the object's own texture. Afterwards sat__gl_release_target. */
static inline sat_result sat__gl_bind_target(sat__gl *gl, const sat_gl_target *target, unsigned own)
{
    static const unsigned buffer = SAT__GL_COLOR_ATTACHMENT0;
    sat_gl_place place = target ? target->place : SAT_GL_OWN;
    unsigned status;
    char number[24];
    if (place == SAT_GL_OWN || place == SAT_GL_FRAMEBUFFER) own = place == SAT_GL_OWN ? own : target->name;
    else own = gl->framebuffer;
    gl->BindFramebuffer(SAT__GL_FRAMEBUFFER, own);
    if (place == SAT_GL_OWN) return SAT_OK;
    if (place == SAT_GL_TEXTURE)
        gl->FramebufferTexture2D(SAT__GL_FRAMEBUFFER, buffer, SAT__GL_TEXTURE_2D, target->name, 0);
    if (place == SAT_GL_LAYER) gl->FramebufferTextureLayer(SAT__GL_FRAMEBUFFER, buffer, target->name, 0, target->layer);
    if (place != SAT_GL_FRAMEBUFFER) gl->DrawBuffers(1, &buffer);
    status = gl->CheckFramebufferStatus(SAT__GL_FRAMEBUFFER);
    if (status == SAT__GL_FRAMEBUFFER_COMPLETE) return SAT_OK;
    snprintf(number, sizeof number, "status 0x%04x", status);
    return sat__gl_fail(gl, SAT_ERR_GL_STATE, "OpenGL refused to draw into the target", number);
}

static inline void sat__gl_release_target(sat__gl *gl, const sat_gl_target *target)
{
    if (!target || target->place == SAT_GL_OWN || target->place == SAT_GL_FRAMEBUFFER) return;
    gl->FramebufferTexture2D(SAT__GL_FRAMEBUFFER, SAT__GL_COLOR_ATTACHMENT0, SAT__GL_TEXTURE_2D, 0, 0);
}

/* Starts the pass that draws a picture of this size to a target; its shader has sat__gl_pixel(). */
static inline sat_result sat__gl_pass_to(sat__gl *gl, unsigned program, const sat_gl_target *target, unsigned own,
                                         int width, int height)
{
    int x = target ? target->x : 0, y = target ? target->y : 0;
    sat_result result = sat__gl_bind_target(gl, target, own);
    gl->UseProgram(program);
    gl->Uniform3i(gl->GetUniformLocation(program, "sat_corner_of"), x, y, target && target->flip ? height : 0);
    gl->Viewport(x, y, width, height);
    return result;
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

/* Binds a 2D texture to a unit below the number given to sat__gl_begin, without a sampler object, and tells the
   sampler uniform. */
static inline void sat__gl_set_texture(sat__gl *gl, unsigned program, const char *name, int unit, unsigned texture)
{
    gl->ActiveTexture(SAT__GL_TEXTURE0 + (unsigned)unit);
    gl->BindTexture(SAT__GL_TEXTURE_2D, texture);
    gl->BindSampler((unsigned)unit, 0);
    gl->Uniform1i(gl->GetUniformLocation(program, name), unit);
}

/* Textures for the units 0, 1, ... of a program of a table. */
static inline void sat__gl_inputs(sat__gl *gl, const unsigned *textures, int count)
{
    int unit;
    for (unit = 0; unit < count; unit++) {
        gl->ActiveTexture(SAT__GL_TEXTURE0 + (unsigned)unit);
        gl->BindTexture(SAT__GL_TEXTURE_2D, textures[unit]);
        gl->BindSampler((unsigned)unit, 0);
    }
}

/* SAT__GL_INPUTS(gl, textures in the order of the samplers ...); SAT__GL_START(gl, program, &target, textures ...),
   then its uniforms and sat__gl_draw; SAT__GL_PASS(gl, program, &target, textures ...): a pass without uniforms. */
#define SAT__GL_INPUTS(gl, ...)                                                                                        \
    do {                                                                                                               \
        const unsigned sat__textures[] = {__VA_ARGS__};                                                                \
        sat__gl_inputs(gl, sat__textures, SAT__COUNT(sat__textures));                                                  \
    } while (0)
#define SAT__GL_START(gl, program, to, ...)                                                                            \
    do {                                                                                                               \
        sat__gl_pass(gl, program, (to)->framebuffer, (to)->width, (to)->height);                                       \
        SAT__GL_INPUTS(gl, __VA_ARGS__);                                                                               \
    } while (0)
#define SAT__GL_PASS(gl, program, to, ...)                                                                             \
    do {                                                                                                               \
        SAT__GL_START(gl, program, to, __VA_ARGS__);                                                                   \
        sat__gl_draw(gl);                                                                                              \
    } while (0)

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
        SAT__GL_BLEND,           SAT__GL_DEPTH_TEST,     SAT__GL_CULL_FACE,          SAT__GL_SCISSOR_TEST,
        SAT__GL_STENCIL_TEST,    SAT__GL_DITHER,         SAT__GL_RASTERIZER_DISCARD, SAT__GL_SAMPLE_ALPHA_TO_COVERAGE,
        SAT__GL_SAMPLE_COVERAGE, SAT__GL_COLOR_LOGIC_OP, SAT__GL_FRAMEBUFFER_SRGB,   SAT__GL_PROGRAM_POINT_SIZE};
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
    static const unsigned names[6] = {SAT__GL_BLEND_SRC_RGB,      SAT__GL_BLEND_DST_RGB,
                                      SAT__GL_BLEND_SRC_ALPHA,    SAT__GL_BLEND_DST_ALPHA,
                                      SAT__GL_BLEND_EQUATION_RGB, SAT__GL_BLEND_EQUATION_ALPHA};
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
    static const unsigned names[6] = {SAT__GL_IMAGE_BINDING_NAME,    SAT__GL_IMAGE_BINDING_LEVEL,
                                      SAT__GL_IMAGE_BINDING_LAYERED, SAT__GL_IMAGE_BINDING_LAYER,
                                      SAT__GL_IMAGE_BINDING_ACCESS,  SAT__GL_IMAGE_BINDING_FORMAT};
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
    int i, count;
    const unsigned *names = sat__gl_store_names(gl, &count);
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
        gl->BindImageTexture((unsigned)i, (unsigned)v[0], v[1], (unsigned char)v[2], v[3], (unsigned)v[4],
                             (unsigned)v[5]);
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
        gl->BindBufferRange(SAT__GL_TRANSFORM_FEEDBACK_BUFFER, 0, (unsigned)state->feedback,
                            (ptrdiff_t)state->feedback_start, (ptrdiff_t)state->feedback_size);
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

#endif /* SAT__SHARED_GL */
/* dist: nothing */

/* ------------------------------------------------------------------------------------------------
   Implementation
   ------------------------------------------------------------------------------------------------ */

/* dist: core */
#if defined(SAT_IMPLEMENTATION) && !defined(SAT_IMPLEMENTED)
#define SAT_IMPLEMENTED

SAT__IEEE_BEGIN
#ifdef __cplusplus
extern "C" {
#endif

#ifndef SAT_STATIC
const int sat__define_SAT_IMPLEMENTATION_in_exactly_one_c_file = SAT_VERSION;
#endif

/* dist: helpers */
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
/* dist: core */

/* ---- >> scanning */

static const sat__field sat__scan_fields[] = {
    SAT__FIELD(sat_scan_options, 'i', algorithm, 0, 0, SAT_SCAN_BALANCED_TREE, ' '),
    SAT__FIELD(sat_scan_options, 'i', k, 4, 2, 64, ' '),
    SAT__FIELD(sat_scan_options, 'i', exclusive, 0, 0, 1, ' '),
    SAT__FIELD(sat_scan_options, 'a', allocator, 0, 0, 0, ' '),
    SAT__FIELD(sat_scan_options, 't', threads, 0, 0, 0, ' '),
};

SAT_DEF sat_scan_options sat_scan_defaults(void)
{
    sat_scan_options options;
    sat__fields_default(&options, sizeof options, sat__scan_fields, SAT__COUNT(sat__scan_fields));
    return options;
}

SAT_DEF const char *sat_explain_scan(char *text, size_t size, const sat_scan_options *options)
{
    sat__text t = sat__text_begin(text, size);
    const sat__field *wrong =
        options ? sat__fields_check(options, sat__scan_fields, SAT__COUNT(sat__scan_fields)) : NULL;
    if (wrong) sat__text_field(&t, wrong, options);
    return text;
}

/* One pass of a scan over elements of any type: destination and source levels and where they lie. */
typedef struct sat__scan {
    unsigned char *out;
    const unsigned char *in, *uncles;
    size_t n, size, offset; /* offset: recursive doubling's distance between terms */
    unsigned char *temporaries; /* two elements a worker, because combine must not write onto its operands */
    sat_combine_fn *combine;
    void *user;
    sat_scan_counters counters;
    const sat_threads *threads; /* NULL while counting */
    int k;
} sat__scan;

/* Work is cut into blocks of this many elements: an int counts the blocks of any array. */
enum { SAT__SCAN_BLOCK = 1 << 14, SAT__SCAN_ELEMENT = 4096 }; /* bytes of the largest element */

static void sat__scan_run(sat__scan *scan, size_t elements, sat_range_fn *body)
{
    sat__parallel_for(scan->threads, (int)((elements + SAT__SCAN_BLOCK - 1) / SAT__SCAN_BLOCK), body, scan);
    scan->counters.passes++;
}

/* source[0] + source[step] + ... + source[(count - 1) step], left to right, after *first when it is given. */
typedef struct sat__terms {
    const unsigned char *first, *source;
    size_t count, step;
} sat__terms;

static void sat__scan_fold(sat__scan *scan, unsigned char *target, sat__terms of, int worker)
{
    unsigned char *left = scan->temporaries + (size_t)worker * 2 * scan->size, *next = left + scan->size, *swap;
    size_t i = of.first ? 0 : 1;
    memcpy(left, of.first ? of.first : of.source, scan->size);
    if (!scan->threads) {
        scan->counters.reads += of.count + (of.first != NULL);
        scan->counters.adds += of.count - (of.first == NULL);
        scan->counters.writes++;
        scan->counters.nodes++;
    }
    for (; i < of.count; i++) {
        scan->combine(next, left, of.source + i * of.step * scan->size, scan->user);
        swap = left;
        left = next;
        next = swap;
    }
    memcpy(target, left, scan->size);
}

/* Recursive doubling, one pass: out[i] = in[i - (k-1) offset] + ... + in[i - offset] + in[i], where terms before
   the array count nothing (Slomp 2012, section 4.4). Elements below `offset` are final; of them those below
   offset / k are in both halves already. The thesis prints other copy counts, which are right for k = 2 only. */
static void sat__scan_doubling(int begin, int end, int worker, void *context)
{
    sat__scan *scan = (sat__scan *)context;
    size_t i = (size_t)begin * SAT__SCAN_BLOCK, stop = (size_t)end * SAT__SCAN_BLOCK;
    size_t offset = scan->offset, final_in_both = offset / (size_t)scan->k;
    if (stop > scan->n) stop = scan->n;
    if (i < final_in_both) i = final_in_both;
    for (; i < stop; i++) {
        sat__terms of = {NULL, NULL, i / offset + 1, offset};
        if (of.count > (size_t)scan->k) of.count = (size_t)scan->k;
        if (i >= offset) {
            of.source = scan->in + (i - (of.count - 1) * offset) * scan->size;
            sat__scan_fold(scan, scan->out + i * scan->size, of, worker);
            continue;
        }
        memcpy(scan->out + i * scan->size, scan->in + i * scan->size, scan->size);
        if (scan->threads) continue;
        scan->counters.copies++;
        scan->counters.reads++;
        scan->counters.writes++;
    }
}

/* The result lands in `out`: `scratch` (n elements) takes the other half of the ping-pong. */
static void sat__scan_recursive_doubling(sat__scan *scan, unsigned char *out, unsigned char *scratch, const void *in)
{
    unsigned char *from = out, *to = scratch, *swap;
    size_t passes = 0, offset;
    for (offset = 1; offset < scan->n; passes++)
        offset = offset > SIZE_MAX / (size_t)scan->k ? SIZE_MAX : offset * (size_t)scan->k;
    if (passes % 2) {
        from = scratch;
        to = out;
    }
    if (from != in) memcpy(from, in, scan->n * scan->size);
    for (offset = 1; offset < scan->n; offset *= (size_t)scan->k) {
        scan->in = from;
        scan->out = to;
        scan->offset = offset;
        sat__scan_run(scan, scan->n, sat__scan_doubling);
        swap = from;
        from = to;
        to = swap;
        if (offset > SIZE_MAX / (size_t)scan->k) break;
    }
}

/* Balanced tree, one reduction: node g = sum of its k children (section 4.5). */
static void sat__scan_reduce(int begin, int end, int worker, void *context)
{
    sat__scan *scan = (sat__scan *)context;
    size_t k = (size_t)scan->k, g = (size_t)begin * SAT__SCAN_BLOCK, stop = (size_t)end * SAT__SCAN_BLOCK;
    size_t nodes = (scan->n + k - 1) / k;
    if (stop > nodes) stop = nodes;
    for (; g < stop; g++) {
        const sat__terms of = {NULL, scan->in + g * k * scan->size, scan->n - g * k < k ? scan->n - g * k : k, 1};
        sat__scan_fold(scan, scan->out + g * scan->size, of, worker);
    }
}

/* Balanced tree, one direct inclusive expansion: child = uncle (the finished node left of its parent) + its reduced
   siblings to the left + itself. Right to left, so that a level may be expanded in place. */
static void sat__scan_expand(int begin, int end, int worker, void *context)
{
    sat__scan *scan = (sat__scan *)context;
    size_t k = (size_t)scan->k, g = (size_t)begin * SAT__SCAN_BLOCK, stop = (size_t)end * SAT__SCAN_BLOCK;
    size_t groups = (scan->n + k - 1) / k;
    if (stop > groups) stop = groups;
    for (; g < stop; g++) {
        sat__terms of = {g ? scan->uncles + (g - 1) * scan->size : NULL, scan->in + g * k * scan->size, 0, 1};
        for (of.count = scan->n - g * k < k ? scan->n - g * k : k; of.count > 0; of.count--)
            sat__scan_fold(scan, scan->out + (g * k + of.count - 1) * scan->size, of, worker);
    }
}

/* levels: scratch for the reduced levels 1, 2, ... one behind the other; the root is never computed. */
static void sat__scan_balanced_tree(sat__scan *scan, unsigned char *out, unsigned char *levels, const unsigned char *in)
{
    size_t counts[66], begins[66], k = (size_t)scan->k, level = 0;
    counts[0] = scan->n;
    begins[0] = begins[1] = 0;
    for (; counts[level] > k; level++) {
        counts[level + 1] = (counts[level] + k - 1) / k;
        begins[level + 2] = begins[level + 1] + counts[level + 1] * scan->size;
        scan->in = level ? levels + begins[level] : in;
        scan->out = levels + begins[level + 1];
        scan->n = counts[level];
        sat__scan_run(scan, counts[level + 1], sat__scan_reduce);
    }
    scan->uncles = NULL;
    for (level++; level-- > 0;) {
        scan->n = counts[level];
        scan->in = level ? levels + begins[level] : in;
        scan->out = level ? levels + begins[level] : out;
        sat__scan_run(scan, (counts[level] + k - 1) / k, sat__scan_expand);
        scan->uncles = scan->out;
    }
}

static void sat__scan_sequential(sat__scan *scan, unsigned char *out, const unsigned char *in)
{
    union { /* the largest element, aligned for any type */
        unsigned char bytes[SAT__SCAN_ELEMENT];
        long double number;
        void *pointer;
    } sum;
    size_t i;
    memmove(out, in, scan->size);
    for (i = 1; i < scan->n; i++) {
        scan->combine(sum.bytes, out + (i - 1) * scan->size, in + i * scan->size, scan->user);
        memcpy(out + i * scan->size, sum.bytes, scan->size);
    }
    scan->counters.passes = 1;
    scan->counters.adds = scan->n - 1;
    scan->counters.reads = scan->counters.writes = scan->counters.nodes = scan->n;
}

/* Elements of scratch: the other ping-pong half, or all reduced levels of the tree. */
static size_t sat__scan_scratch(const sat_scan_options *options, size_t n)
{
    size_t k = (size_t)options->k, total = 0;
    if (options->algorithm == SAT_SCAN_RECURSIVE_DOUBLING) return n;
    if (options->algorithm == SAT_SCAN_BALANCED_TREE)
        for (; n > k; total += n) n = (n + k - 1) / k;
    return total;
}

static sat_result sat__scan_check(sat_scan_options *resolved, sat_allocator *allocator, const void *out, const void *in,
                                  size_t n, const sat_scan_options *options)
{
    *resolved = options ? *options : sat_scan_defaults();
    if ((n && (!out || !in)) || sat__fields_check(resolved, sat__scan_fields, SAT__COUNT(sat__scan_fields)))
        return SAT_ERR_ARGUMENT;
    sat__resolve_allocator(allocator, &resolved->allocator);
    if (n / SAT__SCAN_BLOCK >= (size_t)0x7fffffff) return SAT_ERR_SIZE;
    if (resolved->counters) memset(resolved->counters, 0, sizeof *resolved->counters);
    return SAT_OK;
}

SAT_DEF sat_result sat_scan_any(void *out, const void *in, size_t n, size_t element_size, sat_combine_fn *combine,
                                const void *identity, void *user, const sat_scan_options *options)
{
    sat_scan_options resolved;
    sat_allocator allocator;
    sat__scan scan;
    size_t elements, bytes = 0;
    unsigned char *scratch = NULL;
    sat_result result = sat__scan_check(&resolved, &allocator, out, in, n, options);
    if (result) return result;
    if (!combine || element_size < 1 || element_size > SAT__SCAN_ELEMENT || (resolved.exclusive && !identity))
        return SAT_ERR_ARGUMENT;
    if (n == 0) return SAT_OK;

    memset(&scan, 0, sizeof scan);
    scan.n = n;
    scan.size = element_size;
    scan.combine = combine;
    scan.user = user;
    scan.k = resolved.k;
    scan.threads = resolved.counters ? NULL : &resolved.threads;
    if (resolved.algorithm != SAT_SCAN_SEQUENTIAL) {
        elements = 2 * (size_t)sat__worker_count(&resolved.threads) + sat__scan_scratch(&resolved, n);
        if (!sat__multiply_size(&bytes, elements, element_size)) return SAT_ERR_SIZE;
        scan.temporaries = (unsigned char *)sat__alloc(&allocator, bytes);
        if (!scan.temporaries) return SAT_ERR_MEMORY;
        scratch = scan.temporaries + 2 * (size_t)sat__worker_count(&resolved.threads) * element_size;
    }

    if (resolved.algorithm == SAT_SCAN_RECURSIVE_DOUBLING)
        sat__scan_recursive_doubling(&scan, (unsigned char *)out, scratch, in);
    else if (resolved.algorithm == SAT_SCAN_BALANCED_TREE)
        sat__scan_balanced_tree(&scan, (unsigned char *)out, scratch, (const unsigned char *)in);
    else sat__scan_sequential(&scan, (unsigned char *)out, (const unsigned char *)in);

    if (resolved.exclusive) {
        memmove((unsigned char *)out + element_size, out, (n - 1) * element_size);
        memcpy(out, identity, element_size);
    }
    if (resolved.counters) *resolved.counters = scan.counters;
    sat__release(&allocator, scan.temporaries, bytes);
    return SAT_OK;
}

/* The typed scans: a plain loop when sequential, else the general one with this sum. */
#define SAT__DEFINE_SCAN(suffix, type, carry)                                                                          \
    static void sat__combine_##suffix(void *out, const void *left, const void *right, void *user)                      \
    {                                                                                                                  \
        type a, b;                                                                                                     \
        (void)user;                                                                                                    \
        memcpy(&a, left, sizeof a);                                                                                    \
        memcpy(&b, right, sizeof b);                                                                                   \
        a = (type)(a + b);                                                                                             \
        memcpy(out, &a, sizeof a);                                                                                     \
    }                                                                                                                  \
    SAT_DEF sat_result sat_scan_##suffix(type *out, const type *in, size_t n, const sat_scan_options *options)         \
    {                                                                                                                  \
        sat_scan_options resolved;                                                                                     \
        sat_allocator allocator;                                                                                       \
        const type zero = 0;                                                                                           \
        carry sum = 0;                                                                                                 \
        type value;                                                                                                    \
        size_t i;                                                                                                      \
        sat_result result = sat__scan_check(&resolved, &allocator, out, in, n, options);                               \
        if (result) return result;                                                                                     \
        if (resolved.algorithm != SAT_SCAN_SEQUENTIAL || resolved.counters)                                            \
            return sat_scan_any(out, in, n, sizeof(type), sat__combine_##suffix, &zero, NULL, options);                \
        for (i = 0; i < n; i++) {                                                                                      \
            value = in[i];                                                                                             \
            if (resolved.exclusive) out[i] = (type)sum;                                                                \
            sum = (carry)(sum + (carry)value);                                                                               \
            if (!resolved.exclusive) out[i] = (type)sum;                                                               \
        }                                                                                                              \
        return SAT_OK;                                                                                                 \
    }

SAT__DEFINE_SCAN(f32, float, double) /* 2e7 times 0.1 is 2e6, where a float carry ends at 2097152 */
SAT__DEFINE_SCAN(f64, double, double)
SAT__DEFINE_SCAN(u32, uint32_t, uint32_t)
SAT__DEFINE_SCAN(u64, uint64_t, uint64_t)

/* Two's complement sums are the unsigned ones. */
SAT_DEF sat_result sat_scan_i32(int32_t *out, const int32_t *in, size_t n, const sat_scan_options *options)
{
    return sat_scan_u32((uint32_t *)out, (const uint32_t *)in, n, options);
}

/* A k-ary counter of partial sums: level l holds up to k - 1 finished sums of k^l values. */
SAT_DEF double sat_reduce_f32(const float *in, size_t n, ptrdiff_t stride, int k)
{
    double level[64] = {0}, total = 0;
    unsigned char held[64] = {0};
    int l, top = 0;
    size_t i;
    if (!in) return 0;
    if (k < 2 || k > 64) k = 4;
    if (stride == 0) stride = sizeof(float);
    for (i = 0; i < n; i++) {
        double value = (double)*(const float *)(const void *)((const unsigned char *)in + (ptrdiff_t)i * stride);
        for (l = 0;; l++) {
            level[l] = held[l] ? level[l] + value : value;
            if (++held[l] < k) break;
            held[l] = 0;
            value = level[l];
        }
        if (l > top) top = l;
    }
    for (l = 0; l <= top; l++)
        if (held[l]) total += level[l];
    return total;
}

/* ---- >> layout: of tables

   Corners are numbered like grid lines: corner (X, Y) holds the sum of [0,X) x [0,Y), so X = 0 and Y = 0 are a stored
   border of zeros and no lookup branches at an edge (eq 4.4 with its cases put in order). Channels are planes.
   SAT_KIND_TILED has a layout of its own, below. */

enum { SAT__LINE = 64, SAT__STRIP = 512, SAT__MAX_STRIP = 4096, SAT__MAX_TILE_SIDE = 128 };

typedef struct sat__spike sat__spike;
typedef struct sat__giant sat__giant;
typedef struct sat__tile sat__tile;

/* What one band of rows, or one strip of columns, met: summed in a fixed order afterwards. */
typedef struct sat__tally {
    size_t nan, infinite, clamped;
    double sum_abs, largest;            /* of |pixel|; sum_abs of tables without negative pixels comes from corners */
    double tile_largest, tile_squares;  /* of the tiles' quanta */
    int giants;                         /* tiled: entries of the tile row's list */
    int negative, overflow;             /* some pixel has its sign bit set; some sum is not finite */
} sat__tally;

struct sat_table {
    sat_options options;
    sat_allocator allocator;
    void *block;
    size_t block_bytes;
    int width, height, channels, shift; /* tile side = 1 << shift */
    int tiles_x, tiles_y, bands;        /* bands: entries of `tallies` a channel */
    int rows;                           /* stored corner rows; less than height + 1 only in a stream */
    size_t element, stride, plane;      /* bytes; elements between corner rows; elements between channels */
    unsigned char *sums;                /* corner (0, 0) of channel 0 */
    double *left, *above, *whole;       /* tiled only, as all down to `ring` */
    sat__tile *tiles;
    double *quanta;                     /* of the tiles again, for lookups; below 0 where these need more than cells */
    sat__spike *spikes;
    sat__giant *giants;
    uint64_t *wide;                     /* the pool of 64-bit tiles */
    uint32_t *tile_integers;
    float *ring_pixels;                 /* a tile row of a stream */
    size_t left_plane;
    size_t wide_stride;                 /* cells of a row of a 64-bit tile */
    int wide_quota, giant_room;         /* slots a super tile row; giants a tile row */
    int has_giants, ring;               /* ring: a stream's, tile rows modulo tiles_y */
    unsigned char *columns;             /* running column sums, a set for each channel */
    size_t columns_stride;
    float *pixels;                      /* one row piece a worker */
    uint32_t *integers;                 /* the same, quantised */
    sat__tally *tallies, total[4];
    sat_view view[4];
    double quantum, limit;              /* pixels are clamped to +-limit */
    int exact;                          /* tiled: pixels are 8- or 16-bit integers, of which quanta are parts */
    float mean[4];
    int refused;                        /* the last build met NaN or infinity and was not to */
};

static int sat__is_fixed(sat_kind kind) { return kind == SAT_KIND_FIXED32; }

static void sat__make_views(sat_table *t);

static size_t sat__kind_size(sat_kind kind) { return kind == SAT_KIND_DOUBLE ? 8 : 4; }

/* Corner (0, y) of a channel, where y counts stored rows. */
static unsigned char *sat__row(const sat_table *t, int channel, int y)
{
    return t->sums + ((size_t)channel * t->plane + (size_t)y * t->stride) * t->element;
}

static const sat__field sat__table_fields[] = {
    SAT__FIELD(sat_options, 'i', kind, 0, 0, SAT_KIND_FIXED32, ' '),
    SAT__FIELD(sat_options, 'i', tile, 32, 8, 128, '2'),
    SAT__FIELD(sat_options, 'i', subtract_mean, 0, 0, 1, ' '),
    SAT__FIELD(sat_options, 'd', quantum, 0, 0, 1e300, ' '),
    SAT__FIELD(sat_options, 'd', max_value, 0, 0, 1e300, ' '),
    SAT__FIELD(sat_options, 'd', max_box_area, 0, 0, 1e300, ' '),
    SAT__FIELD(sat_options, 'i', non_finite, 0, 0, SAT_NON_FINITE_REFUSE, ' '),
    SAT__FIELD(sat_options, 'a', allocator, 0, 0, 0, ' '),
    SAT__FIELD(sat_options, 't', threads, 0, 0, 0, ' '),
};

SAT_DEF sat_options sat_defaults(void)
{
    sat_options options;
    sat__fields_default(&options, sizeof options, sat__table_fields, SAT__COUNT(sat__table_fields));
    return options;
}

/* Sizes that every table needs: the sentence of the first wrong one. */
static int sat__explain_size(sat__text *t, int width, int height, int channels)
{
    if (width < 1 || width == 0x7fffffff) sat__text_range(t, "width", width, 1, 2147483646, ' ');
    else if (height < 1 || height == 0x7fffffff) sat__text_range(t, "height", height, 1, 2147483646, ' ');
    else if (channels < 1 || channels > 4) sat__text_range(t, "channels", channels, 1, 4, ' ');
    else return 1;
    return 0;
}

/* 1 when the options are good; else the sentence. */
static int sat__explain_options(sat__text *t, const sat_options *o)
{
    const sat__field *wrong = sat__fields_check(o, sat__table_fields, SAT__COUNT(sat__table_fields));
    if (wrong) sat__text_field(t, wrong, o);
    else if (o->subtract_mean && o->kind != SAT_KIND_FLOAT && o->kind != SAT_KIND_DOUBLE)
        sat__text_add(t, "subtract_mean is 1; only SAT_KIND_FLOAT and SAT_KIND_DOUBLE take it");
    else return 1;
    return 0;
}

static int sat__options_are_valid(const sat_options *o)
{
    sat__text ignored = sat__text_begin(NULL, 0);
    return sat__explain_options(&ignored, o);
}

SAT_DEF const char *sat_explain(char *text, size_t size, int width, int height, int channels,
                                const sat_options *options)
{
    sat__text t = sat__text_begin(text, size);
    if (sat__explain_size(&t, width, height, channels) && options) sat__explain_options(&t, options);
    return text;
}

SAT_DEF const char *sat_explain_image(char *text, size_t size, const sat_image *image)
{
    sat__text t = sat__text_begin(text, size);
    if (!image) sat__text_add(&t, "image is NULL");
    else if (!image->pixels) sat__text_add(&t, "image.pixels is NULL");
    else if (image->width < 1) sat__text_range(&t, "image.width", image->width, 1, 2147483647, ' ');
    else if (image->height < 1) sat__text_range(&t, "image.height", image->height, 1, 2147483647, ' ');
    else if (image->channels < 1 || image->channels > 4)
        sat__text_range(&t, "image.channels", image->channels, 1, 4, ' ');
    else if ((unsigned)image->format > (unsigned)SAT_F16)
        sat__text_range(&t, "image.format", image->format, 0, SAT_F16, ' ');
    else if ((uintptr_t)image->pixels % sat__format_size(image->format))
        sat__text_add(&t, "image.pixels is not aligned for its format");
    else if (image->stride % (ptrdiff_t)sat__format_size(image->format))
        sat__text_add(&t, "image.stride is not a multiple of its format's bytes");
    else if (!sat__image_is_valid(image)) sat__text_add(&t, "image.stride is shorter than a row");
    return text;
}

/* ---- tables: tiles of integers

   A tile sums its pixels in integers modulo 2^32, rounded to a quantum of its own: the power of two for which the sum
   of the magnitudes just fits, so that any box inside the tile is right to quantum / 2 a pixel, whatever lies elsewhere
   and in whatever order the sums were made. What would coarsen the quantum is kept apart:

     spikes    up to 8 pixels that hold most of the tile's sum, added to the boxes that contain them
     giants    infinity and pixels beyond 1e20, in a list a tile row; one that finds it full is clamped to the largest
               of its tile's other pixels, 65504 where there is none, and counted
     wide      a tile that mixes two ranges for good has 64-bit cells beside it, from a pool of about one a tile column
               for every super tile row

   Cells are inclusive sums within the tile, so nothing is stored for borders. Boxes of at most 3 x 3 tiles are the sum
   of their tiles' own differences. Larger ones use sums of whole tiles that restart in every super tile of 1024 pixels:

     left[y][tile]    the tiles of its tile row up to this one, rows up to y
     above[band][x]   the tile rows up to this one, columns of the tile up to x
     whole[band][tile] both */

enum { SAT__SPIKES = 8, SAT__SUPER = 1024, SAT__PANEL = 1024 };

struct sat__spike {
    uint16_t x, y; /* within the tile */
    float value;
};

struct sat__giant {
    int x, y; /* of the image; within the tile row */
    float value;
};

struct sat__tile {
    double quantum;
    int slot; /* of the pool, from 1; 0: 32-bit cells only */
    uint16_t spikes, wants; /* wants: wide cells would help */
};

/* 31 bits finer, down to what a float can hold. */
static inline double sat__wide_quantum(const sat__tile *tile)
{
    const double least = 1.401298464324817070923729583289917e-45; /* 2^-149 */
    double q = tile->quantum * (1.0 / 2147483648.0);
    return q > least || !(tile->quantum > 0) ? q : least;
}

/* The pool of 64-bit tiles is cut in super tile rows, so that whether a tile gets a slot depends on its own alone. */
static int sat__supers(const sat_table *t)
{
    int super = SAT__SUPER >> t->shift;
    return (t->tiles_y - 1) / super + 1 + t->ring;
}

static size_t sat__lay_out_tiled(sat_table *t, unsigned char *base)
{
    sat__arena arena;
    size_t workers = (size_t)sat__worker_count(&t->options.threads), channels = (size_t)t->channels, tiles, cells, pool;
    size_t area = (size_t)1 << 2 * t->shift, width = (size_t)t->width, bands = (size_t)t->tiles_y * channels;
    arena.base = base;
    arena.used = 0;
    arena.overflow = 0;
    t->stride = width < 64 ? width : (width + 15) / 16 * 16; /* aligned rows are stored past the cache */
    t->left_plane = (size_t)t->rows * (size_t)t->tiles_x;
    t->wide_quota = t->tiles_x + 2;
    t->wide_stride = (size_t)sat__min_int(t->width, t->options.tile);
    t->giant_room = sat__clamp_int(t->width, 8, 64);
    if (!sat__multiply_size(&t->plane, t->stride, (size_t)t->rows) || !sat__multiply_size(&cells, t->plane, channels))
        return 0;
    if (!sat__multiply_size(&tiles, bands, (size_t)t->tiles_x)) return 0;
    pool = (size_t)sat__min_int(t->wide_quota, 0x7fffffff / sat__supers(t) / 4) * (size_t)sat__supers(t) * channels;
    t->sums = (unsigned char *)sat__carve(&arena, cells, sizeof(uint32_t));
    t->left = (double *)sat__carve(&arena, t->left_plane * channels, sizeof(double));
    t->above = (double *)sat__carve(&arena, bands * width, sizeof(double));
    t->whole = (double *)sat__carve(&arena, tiles, sizeof(double));
    t->tiles = (sat__tile *)sat__carve(&arena, tiles, sizeof(sat__tile));
    t->quanta = (double *)sat__carve(&arena, tiles, sizeof(double));
    t->spikes = (sat__spike *)sat__carve(&arena, tiles * SAT__SPIKES, sizeof(sat__spike));
    t->giants = (sat__giant *)sat__carve(&arena, bands * (size_t)t->giant_room, sizeof(sat__giant));
    t->wide = (uint64_t *)sat__carve(&arena, pool, (t->wide_stride << t->shift) * sizeof(uint64_t));
    t->pixels = (float *)sat__carve(&arena, workers * area, sizeof(float));
    t->tile_integers = (uint32_t *)sat__carve(&arena, workers * 2 * SAT__MAX_TILE_SIDE, sizeof(uint32_t));
    t->ring_pixels = t->ring ? (float *)sat__carve(&arena, width * channels << t->shift, sizeof(float)) : NULL;
    t->tallies = (sat__tally *)sat__carve(&arena, bands, sizeof(sat__tally));
    return arena.overflow ? 0 : arena.used;
}

/* All memory of a table, in one block: with base NULL this measures it. */
static size_t sat__lay_out(sat_table *t, unsigned char *base)
{
    sat__arena arena;
    size_t line = SAT__LINE / t->element, workers = (size_t)sat__worker_count(&t->options.threads);
    size_t corners = (size_t)t->width + 1, channels = (size_t)t->channels, planes;
    if (t->options.kind == SAT_KIND_TILED) return sat__lay_out_tiled(t, base);
    arena.base = base;
    arena.used = 0;
    arena.overflow = 0;
    /* corner 1 starts a cache line, so that whole rows can be stored with aligned vectors */
    t->stride = (corners + line - 1 + line - 1) / line * line;
    t->plane = t->stride * (size_t)t->rows;
    if (!sat__multiply_size(&planes, t->plane, channels) || t->plane / t->stride != (size_t)t->rows) return 0;
    t->sums = (unsigned char *)sat__carve(&arena, planes, t->element);
    if (t->sums) t->sums += (line - 1) * t->element;
    t->columns_stride = (corners + line) / line * line * t->element;
    t->columns = (unsigned char *)sat__carve(&arena, channels, t->columns_stride);
    t->pixels = (float *)sat__carve(&arena, workers * SAT__MAX_STRIP, sizeof(float));
    t->integers = sat__is_fixed(t->options.kind)
                      ? (uint32_t *)sat__carve(&arena, workers * SAT__MAX_STRIP, sizeof(uint32_t))
                      : NULL;
    t->tallies = (sat__tally *)sat__carve(&arena, (size_t)t->bands * channels, sizeof(sat__tally));
    return arena.overflow ? 0 : arena.used;
}

/* rows: corner rows to store, and tile_rows: strips above to store; ring: both begin again at their end. */
typedef struct sat__shape { int width, height, channels, rows, tile_rows, ring; } sat__shape;

static sat_result sat__table_create(sat_table **out, sat__shape shape, const sat_options *options)
{
    const int width = shape.width, height = shape.height, channels = shape.channels;
    sat_table t, *table;
    unsigned char *base;
    memset(&t, 0, sizeof t);
    t.options = options ? *options : sat_defaults();
    if (width < 1 || height < 1 || channels < 1 || channels > 4 || !sat__options_are_valid(&t.options))
        return SAT_ERR_ARGUMENT;
    if (!sat__resolve_allocator(&t.allocator, &t.options.allocator)) return SAT_ERR_ARGUMENT;
    if (width == 0x7fffffff || height == 0x7fffffff) return SAT_ERR_SIZE;
    t.width = width;
    t.height = height;
    t.rows = shape.rows;
    t.channels = channels;
    t.element = sat__kind_size(t.options.kind);
    while (1 << t.shift < t.options.tile) t.shift++;
    t.tiles_x = (width - 1) / t.options.tile + 1;
    t.tiles_y = shape.tile_rows;
    t.ring = shape.ring;
    t.bands = t.options.kind == SAT_KIND_TILED ? t.tiles_y : (width - 1) / SAT__STRIP + 1;
    t.block_bytes = sat__lay_out(&t, NULL);
    if (!t.block_bytes || t.block_bytes > SIZE_MAX / 2 - sizeof t - SAT__LINE) return SAT_ERR_SIZE;
    t.block_bytes += sizeof t + SAT__LINE;
    t.block = sat__alloc(&t.allocator, t.block_bytes);
    if (!t.block) return SAT_ERR_MEMORY;
    memset(t.block, 0, t.block_bytes);
    base = (unsigned char *)t.block;
    table = (sat_table *)t.block;
    sat__lay_out(&t, sat__align64(base + sizeof t));
    *table = t;
    sat__make_views(table);
    *out = table;
    return SAT_OK;
}

SAT_DEF sat_result sat_create(sat_table **out, int width, int height, int channels, const sat_options *options)
{
    int tile = options ? options->tile : 32;
    sat__shape shape = {width, height, channels, height, 1, 0};
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (tile < 1 || height < 1) return SAT_ERR_ARGUMENT;
    if (height == 0x7fffffff) return SAT_ERR_ARGUMENT;
    if (options && options->kind != SAT_KIND_TILED) shape.rows++;
    shape.tile_rows = (height - 1) / tile + 1;
    return sat__table_create(out, shape, options);
}

SAT_DEF void sat_destroy(sat_table *table)
{
    if (table) {
        sat_allocator allocator = table->allocator;
        sat__release(&allocator, table->block, table->block_bytes);
    }
}

/* ---- >> rows: one row of running sums

   Each step takes eight pixels: add them to the running column sums, then make prefix sums of these eight by halves
   (pairs, fours, eight), then add the carry of the row so far. Only that last addition waits for the step before.
   The vector code does the same additions in the same order: the same bits with AVX2, SSE2, NEON and plain C.
   *signs collects the sign bits of all pixels (floats only). */

#define SAT__SIGN_f32(v) (int32_t)sat__float_bits(v)
#define SAT__SIGN_f64(v) (int32_t)sat__float_bits(v)
#define SAT__SIGN_u32(v) 0

#define SAT__DEFINE_SUM_ROW(suffix, type, pixel)                                                                       \
    static type sat__sum_row_plain_##suffix(type *out, type *column, const pixel *in, int n, type carry, int32_t *signs) \
    {                                                                                                                  \
        int i, j;                                                                                                      \
        for (i = 0; i < n; i += 8) {                                                                                   \
            type c[8];                                                                                                 \
            int m = n - i < 8 ? n - i : 8;                                                                             \
            for (j = 0; j < 8; j++) c[j] = 0;                                                                          \
            for (j = 0; j < m; j++) {                                                                                  \
                c[j] = column[i + j] = (type)(column[i + j] + (type)in[i + j]);                                        \
                *signs |= SAT__SIGN_##suffix(in[i + j]);                                                               \
            }                                                                                                          \
            c[1] += c[0];                                                                                              \
            c[3] += c[2];                                                                                              \
            c[5] += c[4];                                                                                              \
            c[7] += c[6];                                                                                              \
            c[2] += c[1];                                                                                              \
            c[3] += c[1];                                                                                              \
            c[6] += c[5];                                                                                              \
            c[7] += c[5];                                                                                              \
            for (j = 4; j < 8; j++) c[j] += c[3];                                                                      \
            for (j = 0; j < m; j++) out[i + j] = c[j] + carry;                                                         \
            carry += c[7];                                                                                             \
        }                                                                                                              \
        return carry;                                                                                                  \
    }

SAT__DEFINE_SUM_ROW(f32, float, float)
SAT__DEFINE_SUM_ROW(f64, double, float)
SAT__DEFINE_SUM_ROW(u32, uint32_t, uint32_t)

#if defined(SAT__SSE2)
typedef __m128 sat__vec_f32;
typedef __m128d sat__vec_f64;
typedef __m128i sat__vec_u32;
#define SAT__LOAD_f32(p) _mm_loadu_ps(p)
#define SAT__LOAD_f64(p) _mm_loadu_pd(p)
#define SAT__LOAD_u32(p) _mm_loadu_si128((const __m128i *)(const void *)(p))
#define SAT__PIXELS_f64(p) _mm_cvtps_pd(_mm_castsi128_ps(_mm_loadl_epi64((const __m128i *)(const void *)(p))))
#define SAT__STORE_f32(p, v) _mm_storeu_ps(p, v)
#define SAT__STORE_f64(p, v) _mm_storeu_pd(p, v)
#define SAT__STORE_u32(p, v) _mm_storeu_si128((__m128i *)(void *)(p), v)
#define SAT__STREAM_f32(p, v) _mm_stream_ps(p, v)
#define SAT__STREAM_f64(p, v) _mm_stream_pd(p, v)
#define SAT__STREAM_u32(p, v) _mm_stream_si128((__m128i *)(void *)(p), v)
#define SAT__ADD_f32(a, b) _mm_add_ps(a, b)
#define SAT__ADD_f64(a, b) _mm_add_pd(a, b)
#define SAT__ADD_u32(a, b) _mm_add_epi32(a, b)
#define SAT__SET_f32(s) _mm_set1_ps(s)
#define SAT__SET_f64(s) _mm_set1_pd(s)
#define SAT__SET_u32(s) _mm_set1_epi32((int32_t)(s))
#define SAT__LAST_f32(v) _mm_shuffle_ps(v, v, 255)
#define SAT__LAST_f64(v) _mm_unpackhi_pd(v, v)
#define SAT__LAST_u32(v) _mm_shuffle_epi32(v, 255)
/* within a vector: pairs, then the first pair's sum onto the second pair */
static inline sat__vec_f32 sat__prefix_f32(sat__vec_f32 v)
{
    v = _mm_add_ps(v, _mm_castsi128_ps(_mm_slli_epi64(_mm_castps_si128(v), 32)));
    return _mm_add_ps(v, _mm_shuffle_ps(_mm_setzero_ps(), v, _MM_SHUFFLE(1, 1, 0, 0)));
}
static inline sat__vec_u32 sat__prefix_u32(sat__vec_u32 v)
{
    v = _mm_add_epi32(v, _mm_slli_epi64(v, 32));
    return _mm_add_epi32(v, _mm_slli_si128(_mm_shuffle_epi32(v, 0x55), 8));
}
#define SAT__PREFIX_f64(v) _mm_add_pd(v, _mm_unpacklo_pd(_mm_setzero_pd(), v))
#elif defined(SAT__NEON)
typedef float32x4_t sat__vec_f32;
typedef float64x2_t sat__vec_f64;
typedef uint32x4_t sat__vec_u32;
#define SAT__LOAD_f32(p) vld1q_f32(p)
#define SAT__LOAD_f64(p) vld1q_f64(p)
#define SAT__LOAD_u32(p) vld1q_u32(p)
#define SAT__PIXELS_f64(p) vcvt_f64_f32(vld1_f32(p))
#define SAT__STORE_f32(p, v) vst1q_f32(p, v)
#define SAT__STORE_f64(p, v) vst1q_f64(p, v)
#define SAT__STORE_u32(p, v) vst1q_u32(p, v)
#define SAT__STREAM_f32(p, v) vst1q_f32(p, v)
#define SAT__STREAM_f64(p, v) vst1q_f64(p, v)
#define SAT__STREAM_u32(p, v) vst1q_u32(p, v)
#define SAT__ADD_f32(a, b) vaddq_f32(a, b)
#define SAT__ADD_f64(a, b) vaddq_f64(a, b)
#define SAT__ADD_u32(a, b) vaddq_u32(a, b)
#define SAT__SET_f32(s) vdupq_n_f32(s)
#define SAT__SET_f64(s) vdupq_n_f64(s)
#define SAT__SET_u32(s) vdupq_n_u32(s)
#define SAT__LAST_f32(v) vdupq_laneq_f32(v, 3)
#define SAT__LAST_f64(v) vdupq_laneq_f64(v, 1)
#define SAT__LAST_u32(v) vdupq_laneq_u32(v, 3)
static inline sat__vec_u32 sat__prefix_u32(sat__vec_u32 v)
{
    v = vaddq_u32(v, vreinterpretq_u32_u64(vshlq_n_u64(vreinterpretq_u64_u32(v), 32)));
    return vaddq_u32(v, vcombine_u32(vdup_n_u32(0), vdup_laneq_u32(v, 1)));
}
static inline sat__vec_f32 sat__prefix_f32(sat__vec_f32 v)
{
    v = vaddq_f32(v, vreinterpretq_f32_u64(vshlq_n_u64(vreinterpretq_u64_f32(v), 32)));
    return vaddq_f32(v, vcombine_f32(vdup_n_f32(0), vdup_laneq_f32(v, 1)));
}
#define SAT__PREFIX_f64(v) vaddq_f64(v, vcombine_f64(vdup_n_f64(0), vdup_laneq_f64(v, 0)))
#endif

#ifdef SAT__VECTOR
#define SAT__PIXELS_f32(p) SAT__LOAD_f32(p)
#define SAT__PIXELS_u32(p) SAT__LOAD_u32(p)
#define SAT__PREFIX_f32(v) sat__prefix_f32(v)
#define SAT__PREFIX_u32(v) sat__prefix_u32(v)
#define SAT__SIGNS_f32(p) all = sat__i32x4_or(all, sat__i32x4_or(sat__f32x4_bits(sat__f32x4_load(p)), sat__f32x4_bits(sat__f32x4_load((p) + 4))))
#define SAT__SIGNS_f64(p) SAT__SIGNS_f32(p)
#define SAT__SIGNS_u32(p)

/* Eight pixels are two vectors of four lanes ... */
#define SAT__DEFINE_SUM_ROW_4(suffix, type, pixel)                                                                     \
    static type sat__sum_row_##suffix(type *out, type *column, const pixel *in, int n, type first, int stream, int32_t *signs) \
    {                                                                                                                  \
        sat__vec_##suffix carry = SAT__SET_##suffix(first), a, b, sum_a, sum_b;                                        \
        sat__i32x4 all = sat__i32x4_set1(*signs);                                                                      \
        type last[4];                                                                                                  \
        int i = 0;                                                                                                     \
        for (; i + 8 <= n; i += 8) {                                                                                   \
            a = SAT__ADD_##suffix(SAT__LOAD_##suffix(column + i), SAT__PIXELS_##suffix(in + i));                       \
            b = SAT__ADD_##suffix(SAT__LOAD_##suffix(column + i + 4), SAT__PIXELS_##suffix(in + i + 4));               \
            SAT__SIGNS_##suffix(in + i);                                                                               \
            SAT__STORE_##suffix(column + i, a);                                                                        \
            SAT__STORE_##suffix(column + i + 4, b);                                                                    \
            a = SAT__PREFIX_##suffix(a);                                                                               \
            b = SAT__PREFIX_##suffix(b);                                                                               \
            b = SAT__ADD_##suffix(b, SAT__LAST_##suffix(a));                                                           \
            sum_a = SAT__ADD_##suffix(a, carry);                                                                       \
            sum_b = SAT__ADD_##suffix(b, carry);                                                                       \
            carry = SAT__ADD_##suffix(carry, SAT__LAST_##suffix(b));                                                   \
            if (stream) {                                                                                              \
                SAT__STREAM_##suffix(out + i, sum_a);                                                                  \
                SAT__STREAM_##suffix(out + i + 4, sum_b);                                                              \
            } else {                                                                                                   \
                SAT__STORE_##suffix(out + i, sum_a);                                                                   \
                SAT__STORE_##suffix(out + i + 4, sum_b);                                                               \
            }                                                                                                          \
        }                                                                                                              \
        *signs = sat__i32x4_any(sat__i32x4_greater(sat__i32x4_set1(0), all)) ? -1 : 0;                                 \
        SAT__STORE_##suffix(last, carry);                                                                              \
        return i == n ? last[0] : sat__sum_row_plain_##suffix(out + i, column + i, in + i, n - i, last[0], signs);     \
    }

/* ... or four of two. */
#define SAT__DEFINE_SUM_ROW_2(suffix, type, pixel)                                                                     \
    static type sat__sum_row_##suffix(type *out, type *column, const pixel *in, int n, type first, int stream, int32_t *signs) \
    {                                                                                                                  \
        sat__vec_##suffix carry = SAT__SET_##suffix(first), a, b, c, d, half;                                          \
        sat__i32x4 all = sat__i32x4_set1(*signs);                                                                      \
        type last[2];                                                                                                  \
        int i = 0;                                                                                                     \
        for (; i + 8 <= n; i += 8) {                                                                                   \
            a = SAT__ADD_##suffix(SAT__LOAD_##suffix(column + i), SAT__PIXELS_##suffix(in + i));                       \
            b = SAT__ADD_##suffix(SAT__LOAD_##suffix(column + i + 2), SAT__PIXELS_##suffix(in + i + 2));               \
            c = SAT__ADD_##suffix(SAT__LOAD_##suffix(column + i + 4), SAT__PIXELS_##suffix(in + i + 4));               \
            d = SAT__ADD_##suffix(SAT__LOAD_##suffix(column + i + 6), SAT__PIXELS_##suffix(in + i + 6));               \
            SAT__SIGNS_##suffix(in + i);                                                                               \
            SAT__STORE_##suffix(column + i, a);                                                                        \
            SAT__STORE_##suffix(column + i + 2, b);                                                                    \
            SAT__STORE_##suffix(column + i + 4, c);                                                                    \
            SAT__STORE_##suffix(column + i + 6, d);                                                                    \
            a = SAT__PREFIX_##suffix(a);                                                                               \
            b = SAT__ADD_##suffix(SAT__PREFIX_##suffix(b), SAT__LAST_##suffix(a));                                     \
            c = SAT__PREFIX_##suffix(c);                                                                               \
            d = SAT__ADD_##suffix(SAT__PREFIX_##suffix(d), SAT__LAST_##suffix(c));                                     \
            half = SAT__LAST_##suffix(b);                                                                              \
            c = SAT__ADD_##suffix(c, half);                                                                            \
            d = SAT__ADD_##suffix(d, half);                                                                            \
            half = SAT__LAST_##suffix(d);                                                                              \
            a = SAT__ADD_##suffix(a, carry);                                                                           \
            b = SAT__ADD_##suffix(b, carry);                                                                           \
            c = SAT__ADD_##suffix(c, carry);                                                                           \
            d = SAT__ADD_##suffix(d, carry);                                                                           \
            carry = SAT__ADD_##suffix(carry, half);                                                                    \
            if (stream) {                                                                                              \
                SAT__STREAM_##suffix(out + i, a);                                                                      \
                SAT__STREAM_##suffix(out + i + 2, b);                                                                  \
                SAT__STREAM_##suffix(out + i + 4, c);                                                                  \
                SAT__STREAM_##suffix(out + i + 6, d);                                                                  \
            } else {                                                                                                   \
                SAT__STORE_##suffix(out + i, a);                                                                       \
                SAT__STORE_##suffix(out + i + 2, b);                                                                   \
                SAT__STORE_##suffix(out + i + 4, c);                                                                   \
                SAT__STORE_##suffix(out + i + 6, d);                                                                   \
            }                                                                                                          \
        }                                                                                                              \
        *signs = sat__i32x4_any(sat__i32x4_greater(sat__i32x4_set1(0), all)) ? -1 : 0;                                 \
        SAT__STORE_##suffix(last, carry);                                                                              \
        return i == n ? last[0] : sat__sum_row_plain_##suffix(out + i, column + i, in + i, n - i, last[0], signs);     \
    }

#ifdef SAT__AVX2
/* The one loop where eight lanes pay: halves are prefixed side by side, then the lower half's sum goes to the upper. */
static float sat__sum_row_f32(float *out, float *column, const float *in, int n, float first, int stream,
                              int32_t *signs)
{
    __m256 carry = _mm256_set1_ps(first), zero = _mm256_setzero_ps(),
           all = _mm256_castsi256_ps(_mm256_set1_epi32(*signs)), v, pixels, low;
    int i = 0;
    for (; i + 8 <= n; i += 8) {
        pixels = _mm256_loadu_ps(in + i);
        all = _mm256_or_ps(all, pixels);
        v = _mm256_add_ps(_mm256_loadu_ps(column + i), pixels);
        _mm256_storeu_ps(column + i, v);
        v = _mm256_add_ps(v, _mm256_castsi256_ps(_mm256_slli_epi64(_mm256_castps_si256(v), 32)));
        v = _mm256_add_ps(v, _mm256_shuffle_ps(zero, v, _MM_SHUFFLE(1, 1, 0, 0)));
        low = _mm256_permute2f128_ps(v, v, 0x08);
        v = _mm256_add_ps(v, _mm256_shuffle_ps(low, low, 255));
        low = _mm256_add_ps(v, carry);
        carry = _mm256_add_ps(carry, _mm256_permutevar8x32_ps(v, _mm256_set1_epi32(7)));
        if (stream) _mm256_stream_ps(out + i, low);
        else _mm256_storeu_ps(out + i, low);
    }
    *signs = _mm256_movemask_ps(all) ? -1 : 0;
    first = _mm256_cvtss_f32(carry);
    return i == n ? first : sat__sum_row_plain_f32(out + i, column + i, in + i, n - i, first, signs);
}
#else
SAT__DEFINE_SUM_ROW_4(f32, float, float)
#endif
SAT__DEFINE_SUM_ROW_4(u32, uint32_t, uint32_t)
SAT__DEFINE_SUM_ROW_2(f64, double, float)
#else
#define sat__sum_row_f32(out, column, in, n, carry, stream, signs) ((void)(stream), sat__sum_row_plain_f32(out, column, in, n, carry, signs))
#define sat__sum_row_f64(out, column, in, n, carry, stream, signs) ((void)(stream), sat__sum_row_plain_f64(out, column, in, n, carry, signs))
#define sat__sum_row_u32(out, column, in, n, carry, stream, signs) ((void)(stream), sat__sum_row_plain_u32(out, column, in, n, carry, signs))
#endif

/* ---- >> reading pixels */

/* How much a build looks at its pixels. Sums absorb NaN and infinity, so that a finished row tells whether it met any:
   most images are never looked at, and a band that did meet one is built again with more care. */
enum { SAT__TRUST, SAT__REPLACE_NON_FINITE, SAT__CLAMP_ALL };

/* 1 when no |value| is NaN, infinite or above the limit. Made on the bits, which order like the magnitudes. */
static int sat__is_tame(const float *p, int n, float limit)
{
    uint32_t limit_bits = sat__float_bits(limit), beyond = 0;
    int i = 0;
#ifdef SAT__VECTOR
    sat__i32x4 beyond4 = sat__i32x4_set1(0), limit4 = sat__i32x4_set1((int32_t)limit_bits);
    for (; i + 4 <= n; i += 4)
        beyond4 =
            sat__i32x4_or(beyond4, sat__i32x4_greater(sat__f32x4_bits(sat__f32x4_abs(sat__f32x4_load(p + i))), limit4));
    beyond = (uint32_t)sat__i32x4_any(beyond4);
#endif
    for (; i < n; i++) beyond |= (uint32_t)((sat__float_bits(p[i]) & 0x7fffffffu) > limit_bits);
    return !beyond;
}

/* The rule for values no sum can hold: NaN becomes 0, infinity +-limit; with SAT__CLAMP_ALL so does what lies
   beyond. */
static void sat__replace(float *p, int n, float limit, int care, sat__tally *tally)
{
    int i;
    for (i = 0; i < n; i++) {
        if (sat__is_nan(p[i])) {
            p[i] = 0;
            tally->nan++;
        } else if (!sat__is_finite(p[i])) {
            p[i] = p[i] > 0 ? limit : -limit;
            tally->infinite++;
        } else if (care == SAT__CLAMP_ALL && !(p[i] <= limit && p[i] >= -limit)) {
            p[i] = p[i] > 0 ? limit : -limit;
            tally->clamped++;
        }
    }
}

/* Pixels [x0, x0 + n) of row y of the image: who reads them, how closely, and where it is counted. */
typedef struct sat__strip {
    const sat_image *image;
    int channel, y, x0, n, worker, care;
    sat__tally *tally;
} sat__strip;

static inline sat__strip sat__strip_of(const sat_image *image, int channel, int y, int x0, sat__tally *tally)
{
    sat__strip strip;
    strip.image = image;
    strip.channel = channel;
    strip.y = y;
    strip.x0 = x0;
    strip.n = sat__min_int(image->width - x0, SAT__MAX_STRIP);
    strip.worker = 0;
    strip.care = SAT__CLAMP_ALL;
    strip.tally = tally;
    return strip;
}

/* Its pixels as floats: a pointer into the image where nothing has to change. */
static const float *sat__prepare(const sat_table *t, const sat__strip *strip)
{
    const sat_image *image = strip->image;
    const int y = strip->y, x0 = strip->x0, n = strip->n, channel = strip->channel, care = strip->care;
    float *scratch = t->pixels + (size_t)strip->worker * SAT__MAX_STRIP, mean = t->mean[channel];
    const float *p = scratch;
    int i;
    if (image->format == SAT_F32 && image->channels == 1) p = (const float *)sat__image_row(image, y) + x0;
    else sat__read_row(scratch, image, y, x0, x0 + n, channel);
    if (care != SAT__TRUST && !sat__is_tame(p, n, care == SAT__CLAMP_ALL ? (float)t->limit : 3.4028235e38f)) {
        if (p != scratch) memcpy(scratch, p, (size_t)n * sizeof(float));
        sat__replace(scratch, n, (float)t->limit, care, strip->tally);
        p = scratch;
    }
    if (t->options.subtract_mean) {
        for (i = 0; i < n; i++) scratch[i] = p[i] - mean;
        p = scratch;
    }
    return p;
}

/* Images with negative pixels need the magnitudes for the error bound; those without have them in their corners. */
static void sat__measure(const float *p, int n, sat__tally *tally)
{
    int i;
    for (i = 0; i < n; i++) {
        double magnitude = fabs((double)p[i]);
        tally->sum_abs += magnitude;
        if (magnitude > tally->largest) tally->largest = magnitude;
    }
}

/* Rounds pixels / quantum to integers, modulo 2^32 or 2^64, ties to even: adding 1.5 * 2^52 leaves the integer in the
   low bits of a double. A quantum that is a power of two makes this exact but for that one rounding. */
static void sat__quantise(const sat_table *t, uint32_t *out, const float *in, int n)
{
    const double magic = 6755399441055744.0, inverse = t->quantum > 0 ? 1 / t->quantum : 1;
    uint64_t bits;
    int i = 0, exponent;
    double shifted;
    (void)exponent;
#ifdef SAT__SSE2
    if (frexp(inverse, &exponent) <= 0.5 && exponent > -100 &&
        exponent < 100) { /* the product is exact in float, too */
        __m128 scale = _mm_set1_ps((float)inverse);
        for (; i + 4 <= n; i += 4)
            _mm_storeu_si128((__m128i *)(void *)(out + i), _mm_cvtps_epi32(_mm_mul_ps(_mm_loadu_ps(in + i), scale)));
    }
    for (; i + 4 <= n; i += 4) {
        __m128 v = _mm_loadu_ps(in + i), low;
        __m128d scale = _mm_set1_pd(inverse), shift = _mm_set1_pd(magic);
        __m128d a = _mm_add_pd(_mm_mul_pd(_mm_cvtps_pd(v), scale), shift),
                b = _mm_add_pd(_mm_mul_pd(_mm_cvtps_pd(_mm_movehl_ps(v, v)), scale), shift);
        low = _mm_shuffle_ps(_mm_castpd_ps(a), _mm_castpd_ps(b), _MM_SHUFFLE(2, 0, 2, 0));
        _mm_storeu_si128((__m128i *)(void *)(out + i), _mm_castps_si128(low));
    }
#endif
    for (; i < n; i++) {
        shifted = (double)in[i] * inverse + magic;
        memcpy(&bits, &shifted, sizeof bits);
        out[i] = (uint32_t)bits;
    }
}

/* ---- >> looking up tiles */

typedef struct sat__build {
    sat_table *table;
    const sat_image *image;
    int care;
    int stream;                                        /* stores that bypass the cache: the table is larger than it */
    int first_band, bands, first_super, supers;        /* tiled: tile rows to rebuild */
    int channel, block_rows, diagonal, first_strip;    /* flat: a wavefront of blocks */
} sat__build;

/* The slot of a tile row in a table that may be a ring of them. */
static inline int sat__band_slot(const sat_table *t, int band) { return band < t->tiles_y ? band : band % t->tiles_y; }

static inline size_t sat__tile_index(const sat_table *t, int channel, int band, int tile)
{
    return ((size_t)channel * (size_t)t->tiles_y + (size_t)sat__band_slot(t, band)) * (size_t)t->tiles_x + (size_t)tile;
}

/* Row `y` of a tile row. */
static inline uint32_t *sat__cells(const sat_table *t, int channel, int band, int y)
{
    return (uint32_t *)(void *)t->sums + (size_t)channel * t->plane +
           (((size_t)sat__band_slot(t, band) << t->shift) + (size_t)y) * t->stride;
}

static inline double *sat__left(const sat_table *t, int channel, int band, int y)
{
    return t->left + (size_t)channel * t->left_plane +
           (((size_t)sat__band_slot(t, band) << t->shift) + (size_t)y) * (size_t)t->tiles_x;
}

static inline double *sat__above(const sat_table *t, int channel, int band)
{
    return t->above + ((size_t)channel * (size_t)t->tiles_y + (size_t)sat__band_slot(t, band)) * (size_t)t->width;
}

static inline uint64_t *sat__wide_cells(const sat_table *t, int slot)
{
    return t->wide + ((((size_t)slot - 1) * t->wide_stride) << t->shift);
}

/* A box that is not empty; and the place of a tile. */
typedef struct sat__box {
    int x0, y0, x1, y1;
} sat__box;

typedef struct sat__place {
    int channel, band, tx;
} sat__place;

static inline sat__box sat__box_of(int x0, int y0, int x1, int y1)
{
    sat__box box;
    box.x0 = x0;
    box.y0 = y0;
    box.x1 = x1;
    box.y1 = y1;
    return box;
}

static inline sat__place sat__place_of(int channel, int band, int tx)
{
    sat__place place;
    place.channel = channel;
    place.band = band;
    place.tx = tx;
    return place;
}

static double sat__spike_sum(const sat_table *t, size_t index, sat__box box)
{
    const sat__spike *s = t->spikes + index * SAT__SPIKES;
    double sum = 0;
    int i;
    for (i = 0; i < t->tiles[index].spikes; i++)
        if (s[i].x >= box.x0 && s[i].x < box.x1 && s[i].y >= box.y0 && s[i].y < box.y1) sum += (double)s[i].value;
    return sum;
}

static double sat__wide_part(const sat_table *t, const sat__tile *tile, sat__box box)
{
    const uint64_t *high = sat__wide_cells(t, tile->slot) + (size_t)(box.y1 - 1) * t->wide_stride,
                   *low = box.y0 ? high - (size_t)(box.y1 - box.y0) * t->wide_stride : NULL;
    uint64_t d = high[box.x1 - 1];
    if (box.x0) d -= high[box.x0 - 1];
    if (low) d -= low[box.x1 - 1];
    if (low && box.x0) d += low[box.x0 - 1];
    return (double)(int64_t)d * sat__wide_quantum(tile);
}

/* The part of a box inside one tile, in the tile's own coordinates. */
static double sat__tile_part(const sat_table *t, sat__place at, sat__box box)
{
    size_t index = sat__tile_index(t, at.channel, at.band, at.tx);
    const sat__tile *tile = &t->tiles[index];
    double sum;
    if (tile->slot) sum = sat__wide_part(t, tile, box);
    else {
        const uint32_t *high = sat__cells(t, at.channel, at.band, box.y1 - 1) + ((size_t)at.tx << t->shift);
        uint32_t d = high[box.x1 - 1];
        if (box.x0) d -= high[box.x0 - 1];
        if (box.y0) {
            const uint32_t *low = high - (size_t)(box.y1 - box.y0) * t->stride;
            d -= low[box.x1 - 1];
            if (box.x0) d += low[box.x0 - 1];
        }
        sum = (double)(int32_t)d * tile->quantum;
    }
    return tile->spikes ? sum + sat__spike_sum(t, index, box) : sum;
}

/* An interval of pixels as tiles: those that are looked up in themselves, and a run of whole ones for the strips. */
typedef struct sat__span {
    int count, run0, run1;
    int tile[3], begin[3], end[3];
} sat__span;

static inline void sat__span_of(sat__span *s, int a, int b, int shift)
{
    int first = a >> shift, last = (b - 1) >> shift, side = 1 << shift, i;
    s->run0 = s->run1 = 0;
    s->count = last - first + 1;
    if (s->count > 3) {
        s->count = 2;
        s->run0 = first + 1;
        s->run1 = last;
    }
    for (i = 0; i < s->count; i++) {
        s->tile[i] = i + 1 == s->count ? last : first + i;
        s->begin[i] = 0;
        s->end[i] = side;
    }
    s->begin[0] = a - (first << shift);
    s->end[s->count - 1] = b - (last << shift);
}

static double sat__giant_sum(const sat_table *t, int channel, sat__box box)
{
    double sum = 0;
    int band, i;
    for (band = box.y0 >> t->shift; band <= (box.y1 - 1) >> t->shift; band++) {
        size_t at = (size_t)channel * (size_t)t->tiles_y + (size_t)sat__band_slot(t, band);
        const sat__giant *g = t->giants + at * (size_t)t->giant_room;
        int top = band << t->shift;
        for (i = 0; i < t->tallies[at].giants; i++)
            if (g[i].x >= box.x0 && g[i].x < box.x1 && top + g[i].y >= box.y0 && top + g[i].y < box.y1)
                sum += (double)g[i].value;
    }
    return sum;
}

/* Kept out of the short ways, which would save registers for it. */
#if defined(__GNUC__)
#define SAT__APART __attribute__((noinline))
#elif defined(_MSC_VER)
#define SAT__APART __declspec(noinline)
#else
#define SAT__APART
#endif

/* A box of at most 3 x 3 tiles, tile by tile with all that these hold. */
SAT__APART static double sat__tiles_sum(const sat_table *t, int channel, sat__box box)
{
    sat__span x, y;
    double sum = 0;
    int i, j;
    sat__span_of(&x, box.x0, box.x1, t->shift);
    sat__span_of(&y, box.y0, box.y1, t->shift);
    for (j = 0; j < y.count; j++)
        for (i = 0; i < x.count; i++)
            sum += sat__tile_part(t, sat__place_of(channel, y.tile[j], x.tile[i]),
                                  sat__box_of(x.begin[i], y.begin[j], x.end[i], y.end[j]));
    return t->has_giants ? sum + sat__giant_sum(t, channel, box) : sum;
}

/* What corners of one row read, each beginning at column 0 of the picture; NULL where that adds nothing: strips of the
   tile rows above, of the tiles to the left, and the tile row's cells. */
typedef struct sat__corners {
    const double *whole, *above, *left;
    const uint32_t *cells;
    int super_y, band, in_y;
} sat__corners;

/* Corners in row y of a super tile row whose first tile row is super_y. */
static inline sat__corners sat__corners_of(const sat_view *v, int super_y, int y)
{
    const sat_table *t = v->table;
    sat__corners r;
    r.super_y = super_y;
    r.band = y >> v->shift;
    r.in_y = y & (t->options.tile - 1);
    r.whole = r.band > super_y ? t->whole + sat__tile_index(t, v->channel, r.band - 1, 0) : NULL;
    r.above = r.band > super_y ? sat__above(t, v->channel, r.band - 1) : NULL;
    r.left = r.in_y ? sat__left(t, v->channel, r.band, r.in_y - 1) : NULL;
    r.cells = r.in_y ? sat__cells(t, v->channel, r.band, r.in_y - 1) : NULL;
    return r;
}

/* The sum from the corner of a super tile, whose first tile column is super_x, up to (x, y) in it or on its border. */
static inline double sat__corner_sum(const sat_view *v, const sat__corners *r, int super_x, int x)
{
    const int tx = x >> v->shift, in_x = x & ((1 << v->shift) - 1);
    double sum = 0;
    if (tx > super_x && r->whole) sum = r->whole[tx - 1];
    if (in_x && r->above) sum += r->above[x - 1];
    if (!r->left) return sum;
    if (tx > super_x) sum += r->left[tx - 1];
    if (in_x) {
        const double quantum = v->quanta[(size_t)r->band * (size_t)v->tiles + (size_t)tx];
        if (quantum < 0)
            sum += sat__tile_part(v->table, sat__place_of(v->channel, r->band, tx), sat__box_of(0, 0, in_x, r->in_y));
        else sum += (double)(int32_t)r->cells[x - 1] * quantum;
    }
    return sum;
}

/* Boxes beyond three tiles: four corners in each super tile that they touch. */
SAT__APART static double sat__supers_sum(const sat_view *v, sat__box box)
{
    const int inner = SAT__SUPER - 1, shift = v->shift;
    double sum = 0;
    int x, y, x_end, y_end;
    for (y = box.y0; y < box.y1; y = y_end) {
        int super_y = (y & ~inner) >> shift;
        sat__corners low = sat__corners_of(v, super_y, y), high;
        y_end = sat__min_int(box.y1 - 1, y | inner) + 1;
        high = sat__corners_of(v, super_y, y_end);
        for (x = box.x0; x < box.x1; x = x_end) {
            int super_x = (x & ~inner) >> shift;
            x_end = sat__min_int(box.x1 - 1, x | inner) + 1;
            sum += (sat__corner_sum(v, &high, super_x, x_end) - sat__corner_sum(v, &high, super_x, x)) -
                   (sat__corner_sum(v, &low, super_x, x_end) - sat__corner_sum(v, &low, super_x, x));
        }
    }
    return v->table->has_giants ? sum + sat__giant_sum(v->table, v->channel, box) : sum;
}

/* At most 3 x 3 tiles. Tile columns that the box does not reach are read as its last one and masked away: a loop over
   them would guess its length wrong. */
SAT__APART static double sat__tiles_3_sum(const sat_view *v, sat__box box)
{
    const int shift = v->shift, side = 1 << shift, inner = side - 1, tx = box.x0 >> shift, ty = box.y0 >> shift;
    const int right = ((box.x1 - 1) >> shift) - tx, below = ((box.y1 - 1) >> shift) - ty, second = right > 0;
    const uint32_t left = 0u - (uint32_t)((box.x0 & inner) != 0), top = 0u - (uint32_t)((box.y0 & inner) != 0),
                   has1 = 0u - (uint32_t)(right > 0), has2 = 0u - (uint32_t)(right > 1);
    const int a = box.x0 - (int)(left & 1), b = box.x1 - 1, end0 = right ? box.x0 | inner : b,
              end1 = right > 1 ? end0 + side : b;
    const double *q = v->quanta + (size_t)ty * (size_t)v->tiles + (size_t)tx;
    const uint32_t *high = v->cells + (size_t)(box.y0 - (int)(top & 1)) * v->stride,
                   *last = v->cells + (size_t)(box.y1 - 1) * v->stride,
                   *row = below ? v->cells + (size_t)(box.y0 | inner) * v->stride : last;
    uint32_t high0 = (high[end0] - (high[a] & left)) & top, high1 = high[end1] & top, high2 = high[b] & top;
    double sum = 0;
    int j, hard = 0;
    for (j = 0; j <= below; j++) {
        hard |= (q[0] < 0) | (q[second] < 0) | (q[right] < 0);
        sum += (double)(int32_t)(row[end0] - (row[a] & left) - high0) * q[0] +
               ((double)(int32_t)((row[end1] - high1) & has1) * q[second] +
                (double)(int32_t)((row[b] - high2) & has2) * q[right]);
        high0 = high1 = high2 = 0;
        row = j + 1 < below ? row + ((size_t)side * v->stride) : last;
        q += v->tiles;
    }
    return hard ? sat__tiles_sum(v->table, v->channel, box) : sum;
}

/* At most 2 x 2 tiles, in the same manner. */
static inline double sat__tiles_2_sum(const sat_view *v, sat__box box)
{
    const int inner = (1 << v->shift) - 1, tx = box.x0 >> v->shift, ty = box.y0 >> v->shift;
    const int right = ((box.x1 - 1) >> v->shift) - tx, below = ((box.y1 - 1) >> v->shift) - ty;
    const uint32_t left = 0u - (uint32_t)((box.x0 & inner) != 0), top = 0u - (uint32_t)((box.y0 & inner) != 0),
                   more = 0u - (uint32_t)right, under = 0u - (uint32_t)below;
    const int a = box.x0 - (int)(left & 1), b = box.x1 - 1, m = right ? box.x0 | inner : b;
    const double *q = v->quanta + (size_t)ty * (size_t)v->tiles + (size_t)tx, *lower = below ? q + v->tiles : q;
    const uint32_t *high = v->cells + (size_t)(box.y0 - (int)(top & 1)) * v->stride,
                   *low = v->cells + (size_t)(box.y1 - 1) * v->stride,
                   *middle = below ? v->cells + (size_t)(box.y0 | inner) * v->stride : low;
    const uint32_t first = (middle[m] - (middle[a] & left)) - ((high[m] - (high[a] & left)) & top),
                   second = (middle[b] - (high[b] & top)) & more, third = (low[m] - (low[a] & left)) & under,
                   fourth = low[b] & under & more;
    const double sum = (double)(int32_t)first * q[0] + (double)(int32_t)second * q[right];
    if ((q[0] < 0) | (q[right] < 0) | (lower[0] < 0) | (lower[right] < 0))
        return sat__tiles_sum(v->table, v->channel, box);
    return sum + ((double)(int32_t)third * lower[0] + (double)(int32_t)fourth * lower[right]);
}

/* What sat_view_sum leaves: boxes beyond one tile, and tiles that hold more than cells. */
static double sat__tiled_sum(const sat_view *v, int x0, int y0, int x1, int y1)
{
    const int shift = v->shift, right = ((x1 - 1) >> shift) - (x0 >> shift),
              below = ((y1 - 1) >> shift) - (y0 >> shift);
    if ((right | below) <= 1) return sat__tiles_2_sum(v, sat__box_of(x0, y0, x1, y1));
    return right > 2 || below > 2 ? sat__supers_sum(v, sat__box_of(x0, y0, x1, y1))
                                  : sat__tiles_3_sum(v, sat__box_of(x0, y0, x1, y1));
}

/* ---- >> building tiles */

#if defined(SAT__SSE2)
#define SAT__PREFETCH(p) _mm_prefetch((const char *)(const void *)(p), _MM_HINT_T0)
#elif defined(__GNUC__)
#define SAT__PREFETCH(p) __builtin_prefetch(p)
#else
#define SAT__PREFETCH(p) (void)(p)
#endif


/* Of |pixel| of a tile, in four lanes: pixel i of a row belongs to lane i modulo 4. Rows are summed on their own
   first, so that a GPU can make the same roundings. */
typedef struct sat__gauge {
    float sum[4], largest[4], smallest[4];
} sat__gauge;

typedef struct sat__extent {
    float sum, largest, smallest;
} sat__extent;

static void sat__gauge_clear(sat__gauge *g)
{
    int j;
    for (j = 0; j < 4; j++) {
        g->sum[j] = g->largest[j] = 0;
        g->smallest[j] = 3.4028235e38f;
    }
}

/* n pixels more, a multiple of four. NaN and infinity are sure to show in the sum alone. */
static inline void sat__gauge_row(sat__gauge *g, const float *p, int n)
{
    sat__f32x4 sum = sat__f32x4_set1(0), largest = sat__f32x4_load(g->largest),
               smallest = sat__f32x4_load(g->smallest);
    int i;
    for (i = 0; i < n; i += 4) {
        sat__f32x4 v = sat__f32x4_abs(sat__f32x4_load(p + i));
        sum = sat__f32x4_add(sum, v);
        largest = sat__f32x4_max(largest, v);
        smallest = sat__f32x4_min(smallest, v);
    }
    sat__f32x4_store(g->sum, sat__f32x4_add(sat__f32x4_load(g->sum), sum));
    sat__f32x4_store(g->largest, largest);
    sat__f32x4_store(g->smallest, smallest);
}

static sat__extent sat__gauge_extent(const sat__gauge *g)
{
    sat__extent e;
    int j;
    e.sum = g->sum[0] + g->sum[1] + g->sum[2] + g->sum[3];
    e.largest = g->largest[0];
    e.smallest = g->smallest[0];
    for (j = 1; j < 4; j++) {
        if (g->largest[j] > e.largest) e.largest = g->largest[j];
        if (g->smallest[j] < e.smallest) e.smallest = g->smallest[j];
    }
    return e;
}

static sat__extent sat__extent_of(const float *p, int n, int side)
{
    sat__gauge g;
    int i;
    sat__gauge_clear(&g);
    for (i = 0; i < n; i += side) sat__gauge_row(&g, p + i, side);
    return sat__gauge_extent(&g);
}

/* The extent of a tile's pixels up to `threshold`; of those above, `at` takes the places of the first `most`. Returns
   how many there are, or most + 1 with *rest of no use. */
static int sat__extent_below(sat__extent *rest, const float *p, int n, int side, float threshold, int *at, int most)
{
    const sat__f32x4 limit = sat__f32x4_set1(threshold), zero = sat__f32x4_set1(0),
                     huge = sat__f32x4_set1(3.4028235e38f);
    sat__gauge g;
    sat__f32x4 sum = zero, largest = zero, smallest = huge, row = zero;
    int i, j, count = 0;
    for (i = 0; i < n; i += 4) {
        sat__f32x4 v = sat__f32x4_abs(sat__f32x4_load(p + i));
        sat__i32x4 above = sat__f32x4_less(limit, v);
        if (sat__i32x4_any(above)) {
            for (j = 0; j < 4; j++)
                if (fabsf(p[i + j]) > threshold && count++ < most) at[count - 1] = i + j;
            if (count > most) return count;
            smallest = sat__f32x4_min(smallest, sat__f32x4_select(above, huge, v));
            v = sat__f32x4_select(above, zero, v);
        } else smallest = sat__f32x4_min(smallest, v);
        row = sat__f32x4_add(row, v);
        largest = sat__f32x4_max(largest, v);
        if (!((i + 4) & (side - 1))) { /* as sat__gauge_row does it */
            sum = sat__f32x4_add(sum, row);
            row = zero;
        }
    }
    sat__f32x4_store(g.sum, sum);
    sat__f32x4_store(g.largest, largest);
    sat__f32x4_store(g.smallest, smallest);
    *rest = sat__gauge_extent(&g);
    return count;
}

/* Pixels below `threshold` that are not 0; stops at `most`. */
static int sat__count_below(const float *p, int n, float threshold, int most)
{
    const sat__f32x4 limit = sat__f32x4_set1(threshold);
    int i, j, count = 0;
    for (i = 0; i < n && count < most; i += 4) {
        for (; i + 16 <= n; i += 16) {
            sat__f32x4 a =
                sat__f32x4_min(sat__f32x4_abs(sat__f32x4_load(p + i)), sat__f32x4_abs(sat__f32x4_load(p + i + 4)));
            sat__f32x4 b =
                sat__f32x4_min(sat__f32x4_abs(sat__f32x4_load(p + i + 8)), sat__f32x4_abs(sat__f32x4_load(p + i + 12)));
            if (sat__i32x4_any(sat__f32x4_less(sat__f32x4_min(a, b), limit))) break;
        }
        if (i >= n) break;
        if (!sat__i32x4_any(sat__f32x4_less(sat__f32x4_abs(sat__f32x4_load(p + i)), limit))) continue;
        for (j = 0; j < 4; j++) {
            float v = fabsf(p[i + j]);
            count += v > 0 && v < threshold;
        }
    }
    return count;
}

/* The smallest power of two that leaves `bits` bits for the sum of magnitudes; the margin takes all roundings up. */
static double sat__tile_quantum(double sum, int bits)
{
    int exponent;
    if (!(sum > 0)) return 0;
    frexp(sum * 1.0001, &exponent);
    exponent -= bits;
    return ldexp(1.0, exponent < -149 ? -149 : exponent);
}

/* Takes spikes out of a tile while that lowers its sum to a quarter. */
static sat__extent sat__take_spikes(const sat_table *t, size_t index, float *p, int n, sat__extent e)
{
    sat__spike *s = t->spikes + index * SAT__SPIKES;
    sat__tile *tile = &t->tiles[index];
    int at[SAT__SPIKES], i, found, side = t->options.tile;
    tile->spikes = 0;
    while (e.largest > e.sum / 16 && tile->spikes < SAT__SPIKES) {
        int room = SAT__SPIKES - tile->spikes;
        sat__extent rest;
        found = sat__extent_below(&rest, p, n, side, e.sum / 16, at, room);
        if (found > room || rest.sum > e.sum / 4) break;
        for (i = 0; i < found; i++) {
            sat__spike *spike = &s[tile->spikes + i];
            spike->x = (uint16_t)(at[i] % side);
            spike->y = (uint16_t)(at[i] / side);
            spike->value = p[at[i]];
            p[at[i]] = 0;
        }
        tile->spikes = (uint16_t)(tile->spikes + found);
        e = rest;
    }
    return e;
}

/* One tile row of one channel: what a worker needs to build it. */
typedef struct sat__job {
    const sat_table *table;
    const sat_image *image;
    int channel, band, y0, rows, worker; /* y0: of the image */
    int stream;                          /* stores that bypass the cache */
    float *pixels;                       /* scratch: a tile */
    sat__giant *giants;                  /* of this tile row */
    sat__tally *tally;
} sat__job;

static sat__job sat__job_of(const sat_table *t, const sat_image *image, int channel, int band, int worker)
{
    size_t at = (size_t)channel * (size_t)t->tiles_y + (size_t)sat__band_slot(t, band);
    sat__job job;
    job.table = t;
    job.image = image;
    job.channel = channel;
    job.band = band;
    job.y0 = t->ring ? 0 : band << t->shift; /* a stream's image is one tile row */
    job.rows = sat__min_int(t->options.tile, image->height - job.y0);
    job.worker = worker;
    job.stream = 0;
    job.pixels = t->pixels + ((size_t)worker << 2 * t->shift);
    job.giants = t->giants + at * (size_t)t->giant_room;
    job.tally = &t->tallies[at];
    return job;
}

static int sat__is_direct(const sat_image *image) { return image->format == SAT_F32 && image->channels == 1; }

/* NaN becomes 0, and what lies beyond max_value is clamped to it; giants leave for their list. */
static void sat__take_giants(const sat__job *job, int n, int left, sat__tally *tally)
{
    const sat_table *t = job->table;
    float *p = job->pixels;
    const float giant = 1e20f, limit = (float)t->limit;
    float largest = 0, full;
    int i, side = t->options.tile, ordinary = 0;
    for (i = 0; i < n; i++) {
        if (sat__is_nan(p[i])) {
            tally->nan++;
            p[i] = 0;
        } else if (!sat__is_finite(p[i])) {
            tally->infinite++;
            p[i] = p[i] > 0 ? limit : -limit;
        } else if (fabsf(p[i]) > limit) {
            tally->clamped++;
            p[i] = p[i] > 0 ? limit : -limit;
        }
        if (fabsf(p[i]) <= giant && p[i] != 0) {
            ordinary = 1;
            if (fabsf(p[i]) > largest) largest = fabsf(p[i]);
        }
    }
    full = ordinary ? largest : 65504; /* the largest half float: strips keep the ground's digits beside a sky */
    for (i = 0; i < n; i++) {
        if (!(fabsf(p[i]) > giant)) continue;
        if (tally->giants < t->giant_room) {
            sat__giant *g = &job->giants[tally->giants++];
            g->x = left + i % side;
            g->y = i / side;
            g->value = p[i];
            p[i] = 0;
        } else {
            tally->clamped++;
            p[i] = p[i] > 0 ? full : -full;
        }
    }
}

/* A tile's pixels in scratch memory, zeros beyond the image's right and lower edge. */
static int sat__gather(const sat__job *job, sat__place at)
{
    const sat_table *t = job->table;
    const sat_image *image = job->image;
    int side = t->options.tile, x0 = at.tx << t->shift, w = sat__min_int(side, t->width - x0), y;
    for (y = 0; y < job->rows; y++) {
        float *row = job->pixels + (y << t->shift);
        if (sat__is_direct(image))
            memcpy(row, (const float *)sat__image_row(image, job->y0 + y) + x0, (size_t)w * sizeof(float));
        else sat__read_row(row, image, job->y0 + y, x0, x0 + w, at.channel);
        if (w < side) memset(row + w, 0, (size_t)(side - w) * sizeof(float));
    }
    return job->rows << t->shift;
}

/* out = p / quantum, rounded to nearest even. */
static void sat__tile_integers(uint32_t *out, const float *p, int n, double quantum)
{
    const double magic = 6755399441055744.0;
    double inverse = quantum > 0 ? 1 / quantum : 0;
    int i = 0;
#ifdef SAT__SSE2
    if (inverse < 1e38) {
        __m128 scale = _mm_set1_ps((float)inverse);
        for (; i + 4 <= n; i += 4)
            _mm_storeu_si128((__m128i *)(void *)(out + i), _mm_cvtps_epi32(_mm_mul_ps(_mm_loadu_ps(p + i), scale)));
    }
#endif
    for (; i < n; i++) {
        double shifted = (double)p[i] * inverse + magic;
        uint64_t bits;
        memcpy(&bits, &shifted, sizeof bits);
        out[i] = (uint32_t)bits;
    }
}

/* A tile's pixels: in the image, or taken apart in scratch memory. */
typedef struct sat__source {
    const float *p;
    ptrdiff_t step; /* floats between rows */
} sat__source;

static float sat__giant_limit(const sat_table *t) { return t->limit < 1e20 ? (float)t->limit : 1e20f; }

/* Quantum and wishes, once spikes and giants are out. */
static void sat__choose_quantum(const sat_table *t, sat__tile *tile, const sat__source *from, int rows,
                                sat__extent e)
{
    float threshold = e.sum / ((float)(1 << 2 * t->shift) * 256); /* 2^-14 of such a pixel is lost */
    int y, count = 0, most = sat__max_int(8, (1 << 2 * t->shift) / 128); /* more than even noise has: 2 in 1000 */
    tile->slot = 0;
    tile->quantum = sat__tile_quantum((double)e.sum, 31);
    tile->wants = 0;
    if (!(e.sum > 0) || !(e.smallest < threshold)) return;
    for (y = 0; y < rows && count < most; y++)
        count += sat__count_below(from->p + y * from->step, t->options.tile, threshold, most - count);
    tile->wants = count >= most;
}

/* Takes a tile apart: job->pixels then hold what its cells sum. known: NULL, or the extent of a tile without giants. */
static sat__extent sat__take_apart(const sat__job *job, sat__place at, const sat__extent *known)
{
    const sat_table *t = job->table;
    size_t index = sat__tile_index(t, at.channel, at.band, at.tx);
    sat__tile *tile = &t->tiles[index];
    sat__tally *tally = job->tally;
    int i, first = tally->giants, n = sat__gather(job, at);
    sat__extent e;
    if (known) e = *known;
    else {
        if (!sat__is_tame(job->pixels, n, sat__giant_limit(t)))
            sat__take_giants(job, n, at.tx << t->shift, tally);
        e = sat__extent_of(job->pixels, n, t->options.tile);
    }
    tile->spikes = 0;
    if (e.largest > e.sum / 16) e = sat__take_spikes(t, index, job->pixels, n, e);
    for (i = 0; i < tile->spikes; i++) tally->sum_abs += fabs((double)t->spikes[index * SAT__SPIKES + (size_t)i].value);
    for (i = first; i < tally->giants; i++) tally->sum_abs += fabs((double)job->giants[i].value);
    return e;
}

/* Sixteen columns of a tile, a cache line of cells: their sums stay in registers, those of the rows go from one sixteen
   to the next in `carries`, four equal lanes each. Reads and writes whole sixteens. */
static void sat__sum_lines(uint32_t *cells, int32_t *carries, const float *p, ptrdiff_t step, float scale,
                           const sat__job *job)
{
    const size_t stride = job->table->stride;
    const sat__f32x4 scale4 = sat__f32x4_set1(scale);
    sat__i32x4 c0 = sat__i32x4_set1(0), c1 = c0, c2 = c0, c3 = c0;
    int y, rows = job->rows, stream = job->stream;
    for (y = 0; y < rows; y++, p += step, cells += stride, carries += 4) {
        int32_t *out = (int32_t *)(void *)cells;
        sat__i32x4 s0, s1, s2, s3;
        c0 = sat__i32x4_add(c0, sat__f32x4_round(sat__f32x4_mul(sat__f32x4_load(p), scale4)));
        c1 = sat__i32x4_add(c1, sat__f32x4_round(sat__f32x4_mul(sat__f32x4_load(p + 4), scale4)));
        c2 = sat__i32x4_add(c2, sat__f32x4_round(sat__f32x4_mul(sat__f32x4_load(p + 8), scale4)));
        c3 = sat__i32x4_add(c3, sat__f32x4_round(sat__f32x4_mul(sat__f32x4_load(p + 12), scale4)));
        s0 = sat__i32x4_add(sat__i32x4_prefix(c0), sat__i32x4_load(carries));
        s1 = sat__i32x4_add(sat__i32x4_prefix(c1), sat__i32x4_last(s0));
        s2 = sat__i32x4_add(sat__i32x4_prefix(c2), sat__i32x4_last(s1));
        s3 = sat__i32x4_add(sat__i32x4_prefix(c3), sat__i32x4_last(s2));
        if (stream) {
            sat__i32x4_stream(out, s0);
            sat__i32x4_stream(out + 4, s1);
            sat__i32x4_stream(out + 8, s2);
            sat__i32x4_stream(out + 12, s3);
        } else {
            sat__i32x4_store(out, s0);
            sat__i32x4_store(out + 4, s1);
            sat__i32x4_store(out + 8, s2);
            sat__i32x4_store(out + 12, s3);
        }
        sat__i32x4_store(carries, sat__i32x4_last(s3));
    }
}

/* The cells of a tile, and in `left` what it alone adds. */
static void sat__sum_tile(const sat__job *job, sat__place at, const sat__source *from)
{
    const sat_table *t = job->table;
    uint32_t *integers = t->tile_integers + (size_t)job->worker * 2 * SAT__MAX_TILE_SIDE,
             *columns = integers + SAT__MAX_TILE_SIDE;
    int32_t carries[4 * SAT__MAX_TILE_SIDE];
    size_t index = sat__tile_index(t, at.channel, at.band, at.tx);
    const sat__tile *tile = &t->tiles[index];
    const sat__spike *spikes = t->spikes + index * SAT__SPIKES;
    int y, i, side = t->options.tile, x0 = at.tx << t->shift, w = sat__min_int(side, t->width - x0);
    uint32_t *cells = sat__cells(t, at.channel, at.band, 0) + x0;
    double *left = sat__left(t, at.channel, at.band, 0) + at.tx, quantum = tile->quantum;
    int32_t signs = 0;
    int lines = side >= 16 && t->stride % 16 == 0 && (quantum > 1e-37 || !(quantum > 0)); /* scale is a float */
    if (!lines) memset(columns, 0, (size_t)side * sizeof *columns);
    memset(carries, 0, 4 * (size_t)job->rows * sizeof *carries);
    if (lines)
        for (i = 0; i < w; i += 16)
            sat__sum_lines(cells + i, carries, from->p + i, from->step, quantum > 0 ? (float)(1 / quantum) : 0, job);
    for (y = 0; y < job->rows; y++) {
        double spiky = 0;
        uint32_t sum = (uint32_t)carries[4 * y];
        if (!lines) {
            sat__tile_integers(integers, from->p + y * from->step, (w + 3) & ~3, quantum);
            sum = sat__sum_row_u32(cells + (size_t)y * t->stride, columns, integers, w, 0, job->stream, &signs);
        }
        for (i = 0; i < tile->spikes; i++)
            if (spikes[i].y <= y) spiky += (double)spikes[i].value;
        left[(size_t)y * (size_t)t->tiles_x] = (double)(int32_t)sum * quantum + spiky;
    }
}

/* Row by row, as memory likes it: the gauges of whole tiles [first, last) whose pixels lie in the image as they are. */
static void sat__gauge_panel(sat__gauge *gauge, const sat__job *job, int first, int last)
{
    const sat_table *t = job->table;
    int tx, y, side = t->options.tile;
    for (tx = first; tx < last; tx++) sat__gauge_clear(&gauge[tx - first]);
    for (y = 0; y < job->rows && first < last; y++) {
        const float *row = (const float *)sat__image_row(job->image, job->y0 + y),
                    *ahead = (const float *)sat__image_row(job->image, job->y0 + sat__min_int(y + 2, job->rows - 1));
        for (tx = first; tx < last; tx++) {
            int x = tx << t->shift, end = x + side;
            sat__gauge_row(&gauge[tx - first], row + x, side);
            for (; x < end; x += SAT__LINE / (int)sizeof(float)) SAT__PREFETCH(ahead + x);
        }
    }
}

/* One tile: what it holds apart, its quantum, its cells. gauge: NULL where its pixels have to be gathered first. */
static void sat__settle_tile(const sat__job *job, sat__place at, const sat__gauge *gauge)
{
    const sat_table *t = job->table;
    sat__tile *tile = &t->tiles[sat__tile_index(t, at.channel, at.band, at.tx)];
    sat__extent e;
    sat__source from;
    int known;
    e.sum = e.largest = e.smallest = 0;
    if (gauge) e = sat__gauge_extent(gauge);
    known = gauge && e.sum <= 3.4028235e38f && e.largest <= sat__giant_limit(t);
    if (known && e.largest <= e.sum / 16) {
        from.p = (const float *)sat__image_row(job->image, job->y0) + ((size_t)at.tx << t->shift);
        from.step = sat__image_stride(job->image) / (ptrdiff_t)sizeof(float);
        tile->spikes = 0;
    } else {
        from.p = job->pixels;
        from.step = t->options.tile;
        e = sat__take_apart(job, at, known ? &e : NULL);
    }
    sat__choose_quantum(t, tile, &from, job->rows, e);
    job->tally->sum_abs += (double)e.sum;
    sat__sum_tile(job, at, &from);
}

/* A panel of tiles at a time: their pixels are gauged and are still in the cache when each tile is summed. */
static void sat__settle_band(const sat__job *job)
{
    sat__gauge gauge[SAT__PANEL / 8];
    const sat_table *t = job->table;
    int panel, tx, step = SAT__PANEL >> t->shift;
    memset(job->tally, 0, sizeof *job->tally);
    for (panel = 0; panel < t->tiles_x; panel += step) {
        int stop = sat__min_int(panel + step, t->tiles_x),
            direct = sat__is_direct(job->image) ? sat__min_int(stop, t->width >> t->shift) : 0;
        sat__gauge_panel(gauge, job, panel, direct);
        for (tx = panel; tx < stop; tx++)
            sat__settle_tile(job, sat__place_of(job->channel, job->band, tx), tx < direct ? &gauge[tx - panel] : NULL);
    }
    job->tally->negative = 1;
}

/* Pool slots go to the tiles that want one, in the order of the tile rows: *used counts within a super tile row. */
static void sat__assign_wide(const sat_table *t, int channel, int band, int tx, int *used)
{
    int super = SAT__SUPER >> t->shift, supers = sat__supers(t);
    sat__tile *tile = &t->tiles[sat__tile_index(t, channel, band, tx)];
    tile->slot = 0;
    if (tile->wants && *used < t->wide_quota)
        tile->slot = (channel * supers + band / super % supers) * t->wide_quota + ++*used;
}

/* 64-bit cells of one tile, from pixels that are taken apart once more. */
static void sat__wide_tile(const sat__job *job, sat__place at)
{
    const sat_table *t = job->table;
    float *p = job->pixels;
    size_t index = sat__tile_index(t, at.channel, at.band, at.tx);
    const sat__tile *tile = &t->tiles[index];
    const sat__spike *spikes = t->spikes + index * SAT__SPIKES;
    uint64_t *cells = sat__wide_cells(t, tile->slot);
    double inverse = 1 / sat__wide_quantum(tile);
    int w = sat__min_int(t->options.tile, t->width - (at.tx << t->shift)), n = sat__gather(job, at), x, y, i;
    if (!sat__is_tame(p, n, sat__giant_limit(t))) { /* the giants of this tile stand in the list; others were clamped */
        sat__tally again = *job->tally;
        int first = 0;
        while (first < again.giants && job->giants[first].x >> t->shift != at.tx) first++;
        again.giants = first;
        sat__take_giants(job, n, at.tx << t->shift, &again);
    }
    for (i = 0; i < tile->spikes; i++) p[(spikes[i].y << t->shift) + spikes[i].x] = 0;
    for (y = 0; y < job->rows; y++) {
        uint64_t run = 0, *out = cells + (size_t)y * t->wide_stride;
        for (x = 0; x < (int)t->wide_stride; x++) {
            run += (uint64_t)llrint((double)p[(y << t->shift) + x] * inverse);
            out[x] = y ? out[x - (int)t->wide_stride] + run : run;
        }
        sat__left(t, at.channel, at.band, y)[at.tx] = sat__tile_part(t, at, sat__box_of(0, 0, w, y + 1));
    }
}

/* Wide cells where there are to be any; then `left` becomes sums along the tile row. */
static void sat__finish_band(const sat__job *job)
{
    const sat_table *t = job->table;
    sat__tally *tally = job->tally;
    int tx, y, super = SAT__SUPER >> t->shift;
    size_t index = sat__tile_index(t, job->channel, job->band, 0);
    const sat__tile *tile = t->tiles + index;
    double *quanta = t->quanta + index;
    tally->tile_largest = tally->tile_squares = 0;
    for (tx = 0; tx < t->tiles_x; tx++) {
        double quantum = tile[tx].slot ? sat__wide_quantum(&tile[tx]) : tile[tx].quantum;
        if (tile[tx].slot) sat__wide_tile(job, sat__place_of(job->channel, job->band, tx));
        if (quantum > tally->tile_largest) tally->tile_largest = quantum;
        tally->tile_squares += quantum * quantum;
        quanta[tx] = tile[tx].slot || tile[tx].spikes ? -1 : quantum;
    }
    for (y = 0; y < tally->giants; y++) quanta[job->giants[y].x >> t->shift] = -1;
    for (y = 0; y < job->rows; y++) {
        double *left = sat__left(t, job->channel, job->band, y), run = 0;
        for (tx = 0; tx < t->tiles_x; tx++) {
            run = tx & (super - 1) ? run + left[tx] : left[tx];
            left[tx] = run;
        }
    }
}

/* v[i] = (high[i] - low[i]) quantum for differences modulo 2^32, or v[i] += that; low may be NULL. */
static void sat__add_cells(double *v, const uint32_t *high, const uint32_t *low, int n, double quantum, int add)
{
    int i = 0;
#ifdef SAT__SSE2
    const __m128d q = _mm_set1_pd(quantum);
    for (; i + 4 <= n; i += 4) {
        __m128i d = _mm_loadu_si128((const __m128i *)(const void *)(high + i));
        __m128d a, b;
        if (low) d = _mm_sub_epi32(d, _mm_loadu_si128((const __m128i *)(const void *)(low + i)));
        a = _mm_mul_pd(_mm_cvtepi32_pd(d), q);
        b = _mm_mul_pd(_mm_cvtepi32_pd(_mm_shuffle_epi32(d, 0xee)), q);
        if (add) {
            a = _mm_add_pd(_mm_loadu_pd(v + i), a);
            b = _mm_add_pd(_mm_loadu_pd(v + i + 2), b);
        }
        _mm_storeu_pd(v + i, a);
        _mm_storeu_pd(v + i + 2, b);
    }
#endif
    for (; i < n; i++) {
        double d = (double)(int32_t)(low ? high[i] - low[i] : high[i]) * quantum;
        v[i] = add ? v[i] + d : d;
    }
}

/* v[i] += high[i] - low[i]; low may be NULL. */
static void sat__add_strips(double *v, const double *high, const double *low, int n)
{
    int i = 0;
#ifdef SAT__SSE2
    for (; i + 2 <= n; i += 2) {
        __m128d d = _mm_loadu_pd(high + i);
        if (low) d = _mm_sub_pd(d, _mm_loadu_pd(low + i));
        _mm_storeu_pd(v + i, _mm_add_pd(_mm_loadu_pd(v + i), d));
    }
#endif
    for (; i < n; i++) v[i] += low ? high[i] - low[i] : high[i];
}

/* The strips above: this tile row onto the one before. */
static void sat__build_above(const sat_table *t, int channel, int band, int rows)
{
    int tx, x, super = SAT__SUPER >> t->shift, first = (band & (super - 1)) == 0;
    double *above = sat__above(t, channel, band), *whole = t->whole + sat__tile_index(t, channel, band, 0), run = 0;
    const double *up = first ? NULL : sat__above(t, channel, band - 1),
                 *whole_up = first ? NULL : t->whole + sat__tile_index(t, channel, band - 1, 0);
    SAT_ASSERT(above && whole && (first || (up && whole_up)));
    for (tx = 0; tx < t->tiles_x; tx++) {
        const sat__tile *tile = &t->tiles[sat__tile_index(t, channel, band, tx)];
        int x0 = tx << t->shift, w = sat__min_int(t->options.tile, t->width - x0);
        double last;
        if (tile->slot)
            for (x = 0; x < w; x++)
                above[x0 + x] =
                    sat__tile_part(t, sat__place_of(channel, band, tx), sat__box_of(0, 0, x + 1, rows));
        else {
            const sat__spike *spikes = t->spikes + sat__tile_index(t, channel, band, tx) * SAT__SPIKES;
            int i;
            sat__add_cells(above + x0, sat__cells(t, channel, band, rows - 1) + x0, NULL, w, tile->quantum, 0);
            for (i = 0; i < tile->spikes; i++)
                for (x = spikes[i].x; x < w; x++) above[x0 + x] += (double)spikes[i].value;
        }
        last = above[x0 + w - 1];
        run = tx & (super - 1) ? run + last : last;
        whole[tx] = whole_up ? whole_up[tx] + run : run;
        if (up) sat__add_strips(above + x0, up + x0, NULL, w);
    }
}

static void sat__settle_bands(int begin, int end, int worker, void *context)
{
    const sat__build *b = (const sat__build *)context;
    int i;
    for (i = begin; i < end; i++) {
        sat__job job = sat__job_of(b->table, b->image, i / b->bands, b->first_band + i % b->bands, worker);
        job.stream = b->stream;
        sat__settle_band(&job);
    }
}

static void sat__finish_bands(int begin, int end, int worker, void *context)
{
    const sat__build *b = (const sat__build *)context;
    int i;
    for (i = begin; i < end; i++) {
        sat__job job = sat__job_of(b->table, b->image, i / b->bands, b->first_band + i % b->bands, worker);
        sat__finish_band(&job);
    }
}

static void sat__stack_supers(int begin, int end, int worker, void *context)
{
    const sat__build *b = (const sat__build *)context;
    const sat_table *t = b->table;
    int job, band, super = SAT__SUPER >> t->shift;
    (void)worker;
    for (job = begin; job < end; job++) {
        int first = (b->first_super + job % b->supers) * super, stop = sat__min_int(first + super, t->tiles_y);
        for (band = sat__max_int(first, b->first_band); band < stop; band++)
            sat__build_above(t, job / b->supers, band, sat__min_int(t->options.tile, t->height - (band << t->shift)));
    }
}

/* Pool slots of the super tile rows that hold the rebuilt tile rows; 1 when one outside those changed. */
static int sat__assign_supers(const sat__build *b)
{
    const sat_table *t = b->table;
    int channel, band, tx, used = 0, moved = 0, super = SAT__SUPER >> t->shift, last = b->first_band + b->bands;
    int first = b->first_band & ~(super - 1), stop = sat__min_int(((last - 1) | (super - 1)) + 1, t->tiles_y);
    for (channel = 0; channel < t->channels; channel++)
        for (band = first; band < stop; band++) {
            if ((band & (super - 1)) == 0) used = 0;
            for (tx = 0; tx < t->tiles_x; tx++) {
                const sat__tile *tile = &t->tiles[sat__tile_index(t, channel, band, tx)];
                int before = tile->slot;
                sat__assign_wide(t, channel, band, tx, &used);
                moved |= tile->slot != before && (band < b->first_band || band >= last);
            }
        }
    return moved;
}

/* Tile rows anew, then the strips below them to the end of their super tile row. Where a 64-bit tile elsewhere has to
   move, whole super tile rows are built. */
static void sat__build_tiled(sat__build *b)
{
    const sat_table *t = b->table;
    int super = SAT__SUPER >> t->shift;
    sat__parallel_for(&t->options.threads, b->bands * t->channels, sat__settle_bands, b);
    if (sat__assign_supers(b)) {
        int last = ((b->first_band + b->bands - 1) | (super - 1)) + 1;
        b->first_band &= ~(super - 1);
        b->bands = sat__min_int(last, t->tiles_y) - b->first_band;
        sat__parallel_for(&t->options.threads, b->bands * t->channels, sat__settle_bands, b);
        sat__assign_supers(b);
    }
#ifdef SAT__SSE2
    _mm_sfence();
#endif
    sat__parallel_for(&t->options.threads, b->bands * t->channels, sat__finish_bands, b);
    b->first_super = b->first_band / super;
    b->supers = (b->first_band + b->bands - 1) / super + 1 - b->first_super;
    sat__parallel_for(&t->options.threads, b->supers * t->channels, sat__stack_supers, b);
}

/* ---- >> building flat tables */

/* The sum of a row so far, in the table's type. It travels in a variable: reading it back from the table would wait for
   the stores that went past the cache. */
typedef union sat__carry {
    float f32;
    double f64;
    uint32_t u32;
} sat__carry;

/* Row sums of pixels [x0, x0 + n) into a row of a flat table. */
static void sat__flat_piece(const sat_table *t, unsigned char *row, sat__carry *carry, const sat__strip *strip,
                            int stream)
{
    const int n = strip->n;
    const float *in = sat__prepare(t, strip);
    uint32_t *integers = t->integers ? t->integers + (size_t)strip->worker * SAT__MAX_STRIP : NULL;
    sat__tally *tally = strip->tally;
    void *out = row + ((size_t)strip->x0 + 1) * t->element,
         *column = t->columns + (size_t)strip->channel * t->columns_stride + (size_t)strip->x0 * t->element;
    int32_t signs = 0;
    SAT_ASSERT(integers || t->options.kind != SAT_KIND_FIXED32);
    if (integers) sat__quantise(t, integers, in, n);
    switch (t->options.kind) {
    case SAT_KIND_DOUBLE:
        carry->f64 = sat__sum_row_f64((double *)out, (double *)column, in, n, carry->f64, stream, &signs);
        tally->overflow |= !sat__is_finite_double(carry->f64);
        break;
    case SAT_KIND_FIXED32:
        carry->u32 = sat__sum_row_u32((uint32_t *)out, (uint32_t *)column, integers, n, carry->u32,
                                      stream, &signs);
        break;
    case SAT_KIND_TILED: break;
    case SAT_KIND_FLOAT:
        carry->f32 = sat__sum_row_f32((float *)out, (float *)column, in, n, carry->f32, stream, &signs);
        tally->overflow |= !sat__is_finite(carry->f32);
        break;
    }
    tally->negative |= signs < 0;
}

/* Rows [y0, y1) of strips [strip0, strip1): what lies left of and above the block is finished. */
static void sat__flat_block(const sat__build *b, int strip0, int strip1, int y0, int y1, int worker)
{
    const sat_table *t = b->table;
    int y, strip;
    for (y = y0; y < y1; y++) {
        unsigned char *row = sat__row(t, b->channel, y + 1);
        sat__carry carry;
        memcpy(&carry, row + (size_t)strip0 * SAT__STRIP * t->element, t->element);
        for (strip = strip0; strip < strip1; strip++) {
            sat__strip piece = sat__strip_of(b->image, b->channel, y, strip * SAT__STRIP,
                                             t->tallies + b->channel * t->bands + strip);
            piece.n = sat__min_int(SAT__STRIP, piece.n);
            piece.worker = worker;
            piece.care = b->care;
            sat__flat_piece(t, row, &carry, &piece, b->stream);
        }
    }
}

static void sat__build_diagonal(int begin, int end, int worker, void *context)
{
    const sat__build *b = (const sat__build *)context;
    int i;
    for (i = begin; i < end; i++) {
        int strip = b->first_strip + i, y0 = (b->diagonal - strip) * b->block_rows;
        sat__flat_block(b, strip, strip + 1, y0, sat__min_int(b->block_rows, b->table->height - y0) + y0, worker);
    }
}

/* Flat tables. One worker goes down the rows. Several take the blocks of one anti-diagonal after the other, each of
   which needs only blocks of the diagonal before. Same additions, same bits. */
static void sat__build_flat(sat__build *b)
{
    const sat_table *t = b->table;
    int blocks;
    memset(t->columns, 0, t->columns_stride * (size_t)t->channels);
    memset(t->tallies, 0, sizeof *t->tallies * (size_t)t->bands * (size_t)t->channels);
    b->block_rows = 64;
    blocks = (t->height - 1) / b->block_rows + 1;
    for (b->channel = 0; b->channel < t->channels; b->channel++) {
        if (sat__worker_count(&t->options.threads) == 1) {
            sat__flat_block(b, 0, t->bands, 0, t->height, 0);
            continue;
        }
        for (b->diagonal = 0; b->diagonal < t->bands + blocks - 1; b->diagonal++) {
            b->first_strip = sat__max_int(0, b->diagonal - blocks + 1);
            sat__parallel_for(&t->options.threads, sat__min_int(b->diagonal + 1, t->bands) - b->first_strip,
                              sat__build_diagonal, b);
        }
    }
}

/* Magnitudes of a flat table: its last corner, or the pixels once more where some are negative. */
static void sat__tally_flat(sat_table *t, const sat_image *image)
{
    sat__tally ignored;
    int channel, x, y;
    memset(&ignored, 0, sizeof ignored);
    for (channel = 0; channel < t->channels; channel++) {
        sat__tally *total = &t->total[channel];
        if (!total->negative) {
            const unsigned char *corner = sat__row(t, channel, t->height) + (size_t)t->width * t->element;
            total->sum_abs = t->options.kind == SAT_KIND_FLOAT ? (double)*(const float *)(const void *)corner
                                                               : *(const double *)(const void *)corner;
            total->largest = total->sum_abs; /* as far as anybody asks: no pixel is larger */
            continue;
        }
        for (y = 0; y < t->height; y++)
            for (x = 0; x < t->width; x += SAT__MAX_STRIP) {
                sat__strip strip = sat__strip_of(image, channel, y, x, &ignored);
                sat__measure(sat__prepare(t, &strip), strip.n, total);
            }
    }
}

/* The smallest power of two that is at least v > 0. */
static double sat__power_of_two(double v)
{
    int exponent;
    double fraction = frexp(v, &exponent);
    return ldexp(1.0, fraction > 0.5 ? exponent : exponent - 1);
}

static double sat__largest_pixel(const sat_table *t, const sat_image *image)
{
    sat__tally tally;
    int channel, x, y;
    memset(&tally, 0, sizeof tally);
    for (channel = 0; channel < image->channels; channel++)
        for (y = 0; y < image->height; y++)
            for (x = 0; x < image->width; x += SAT__MAX_STRIP) {
                sat__strip strip = sat__strip_of(image, channel, y, x, &tally);
                sat__measure(sat__prepare(t, &strip), strip.n, &tally);
            }
    return tally.largest;
}

/* A power of two keeps pixels exact that have few digits. Where it does not keep the largest one, a quantum of which
   that pixel is a multiple is as good for the others and keeps constant images; it is never below `least`. */
static double sat__quantum_of_largest(double power, double least, double largest)
{
    double steps = floor(largest / least * (1 + 4e-16));
    if (!(largest > 0) || steps < 1 || floor(largest / power) == largest / power) return power;
    return largest / steps;
}

/* What a fixed-point box sum may reach, in quanta, divided by the pixels of a box. */
static double sat__fixed_range(const sat_table *t)
{
    double most = 2147483647.0;
    double table = (double)t->width * (double)t->height, area = t->options.max_box_area;
    if (!(area > 0) || (area > table && most / area < 1.5)) area = table; /* no box is larger than the table */
    return most / area - 0.5;
}

static int sat__is_whole(const sat_image *image) { return image->format == SAT_U8 || image->format == SAT_U16; }

/* Settles the largest value a pixel may have and the quantum. Limits keep every float sum finite. */
static sat_result sat__resolve(sat_table *t, const sat_image *image)
{
    const double float_max = 3.4028234663852886e38;
    double range, largest;
    t->limit = t->options.kind == SAT_KIND_FLOAT ? float_max / 2147483648.0 : float_max;
    if (t->options.subtract_mean) t->limit /= 2;
    if (t->options.max_value > 0 && t->options.max_value < t->limit) t->limit = t->options.max_value;
    t->exact = sat__is_whole(image) && floor(t->limit) == t->limit;
    if (!sat__is_fixed(t->options.kind)) return SAT_OK;
    range = sat__fixed_range(t);
    if (range > 1125899906842624.0) range = 1125899906842624.0; /* 2^50: what sat__quantise can round */
    if (range < 1) return SAT_ERR_LIMIT;
    if (t->options.quantum > 0) t->quantum = t->options.quantum;
    if (!(t->quantum > 0)) {
        largest = t->limit;
        if (image->format == SAT_U8 || image->format == SAT_U16) largest = image->format == SAT_U8 ? 255 : 65535;
        else if (!(t->options.max_value > 0)) largest = sat__largest_pixel(t, image);
        if (largest > t->limit) largest = t->limit;
        if (!(largest > 0)) return SAT_OK; /* a black image settles nothing */
        t->quantum = sat__power_of_two(largest / range);
        if (!(t->options.max_value > 0) && (image->format == SAT_F32 || image->format == SAT_F16 || t->quantum > 1))
            t->quantum = sat__quantum_of_largest(t->quantum, largest / range, sat__largest_pixel(t, image));
    }
    if (range * t->quantum < t->limit) t->limit = range * t->quantum;
    return SAT_OK;
}

/* Integers cannot show that they overflowed, and a stated largest value is to be kept. */
static int sat__first_care(const sat_table *t)
{
    return sat__is_fixed(t->options.kind) || t->options.max_value > 0 || t->options.subtract_mean ? SAT__CLAMP_ALL
                                                                                                  : SAT__TRUST;
}

/* Hensley 2005: the mean of each channel, as the float that every pixel is lowered by. */
static void sat__measure_means(sat_table *t, const sat_image *image)
{
    sat__tally ignored;
    int channel, x, y, i;
    memset(&ignored, 0, sizeof ignored);
    t->options.subtract_mean = 0;
    for (channel = 0; channel < t->channels; channel++) {
        double total = 0;
        for (y = 0; y < t->height; y++)
            for (x = 0; x < t->width; x += SAT__MAX_STRIP) {
                sat__strip strip = sat__strip_of(image, channel, y, x, &ignored);
                const float *p = sat__prepare(t, &strip);
                for (i = 0; i < strip.n; i++) total += (double)p[i];
            }
        t->mean[channel] = (float)(total / ((double)t->width * (double)t->height));
    }
    t->options.subtract_mean = 1;
}

/* Sums the tallies in a fixed order; 1 when some flat sum is not finite. */
static int sat__total(sat_table *t)
{
    int channel, band, overflow = 0;
    for (channel = 0; channel < t->channels; channel++) {
        sat__tally *total = &t->total[channel];
        memset(total, 0, sizeof *total);
        for (band = 0; band < t->bands; band++) {
            const sat__tally *tally = &t->tallies[channel * t->bands + band];
            total->nan += tally->nan;
            total->infinite += tally->infinite;
            total->clamped += tally->clamped;
            total->sum_abs += tally->sum_abs;
            total->negative |= tally->negative;
            total->giants += tally->giants;
            total->tile_squares += tally->tile_squares;
            overflow |= tally->overflow;
            if (tally->largest > total->largest) total->largest = tally->largest;
            if (tally->tile_largest > total->tile_largest) total->tile_largest = tally->tile_largest;
        }
    }
    return overflow;
}

static void sat__clear(sat_table *t)
{
    if (t->options.kind == SAT_KIND_TILED) {
        size_t bands = (size_t)t->tiles_y * (size_t)t->channels, tiles = bands * (size_t)t->tiles_x;
        memset(t->sums, 0, t->plane * (size_t)t->channels * t->element);
        memset(t->left, 0, t->left_plane * (size_t)t->channels * sizeof(double));
        memset(t->above, 0, bands * (size_t)t->width * sizeof(double));
        memset(t->whole, 0, tiles * sizeof(double));
        memset(t->tiles, 0, tiles * sizeof *t->tiles);
        memset(t->quanta, 0, tiles * sizeof *t->quanta);
        memset(t->tallies, 0, bands * sizeof *t->tallies);
        t->has_giants = 0;
    } else memset(t->sums, 0, (t->plane * (size_t)t->channels - (SAT__LINE / t->element - 1)) * t->element);
    memset(t->mean, 0, sizeof t->mean);
}

/* FLOAT: 1 when pixels above the limit went in, which the largest one or the sum of all shows. Without this they would
   be clamped only where some sum overflows, and a stream cannot know that. */
static int sat__beyond_limit(sat_table *t, const sat_image *image, sat__build *b)
{
    int channel, beyond = 0;
    if (b->care == SAT__CLAMP_ALL || t->options.kind != SAT_KIND_FLOAT) return 0;
    sat__tally_flat(t, image);
    for (channel = 0; channel < t->channels; channel++) beyond |= t->total[channel].largest > t->limit;
    if (beyond) b->care = SAT__CLAMP_ALL - 1;
    return beyond;
}

/* Tile rows [first_band, last_band) anew, then the strips below; flat tables anew altogether. */
static sat_result sat__rebuild(sat_table *t, const sat_image *image, int first_band, int last_band)
{
    sat__build b;
    int channel;
    SAT_ASSERT(t->sums && t->pixels && t->tallies);
    memset(&b, 0, sizeof b);
    b.table = t;
    b.image = image;
    b.care = sat__first_care(t);
    b.first_band = first_band;
    b.bands = last_band - first_band;
    b.stream = t->plane * t->element > (size_t)4 << 20 && t->stride % 4 == 0;
    if (t->options.kind == SAT_KIND_TILED) {
        sat__build_tiled(&b);
        sat__total(t);
        for (t->has_giants = channel = 0; channel < t->channels; channel++)
            t->has_giants |= t->total[channel].giants > 0;
    } else {
        for (; b.care <= SAT__CLAMP_ALL; b.care++) {
            sat__build_flat(&b);
            if (!sat__total(t) && !sat__beyond_limit(t, image, &b)) break;
        }
    }
#ifdef SAT__SSE2
    _mm_sfence();
#endif
    t->refused = 0;
    for (channel = 0; channel < t->channels; channel++)
        if (t->total[channel].nan || t->total[channel].infinite)
            t->refused = t->options.non_finite == SAT_NON_FINITE_REFUSE;
    if (t->refused) sat__clear(t);
    else if (t->options.kind == SAT_KIND_DOUBLE || (t->options.kind == SAT_KIND_FLOAT && b.care == SAT__CLAMP_ALL))
        sat__tally_flat(t, image);
    return t->refused ? SAT_ERR_NON_FINITE : SAT_OK;
}

static int sat__fits(const sat_table *t, const sat_image *image)
{
    return image->width == t->width && image->height == t->height && image->channels == t->channels;
}

SAT_DEF sat_result sat_build(sat_table *table, const sat_image *image)
{
    sat_result result;
    if (!table || !sat__image_is_valid(image)) return SAT_ERR_ARGUMENT;
    if (!sat__fits(table, image)) return SAT_ERR_MISMATCH;
    result = sat__resolve(table, image);
    if (result) return result;
    if (table->options.subtract_mean) sat__measure_means(table, image);
    return sat__rebuild(table, image, 0, table->tiles_y);
}

SAT_DEF sat_result sat_update(sat_table *table, const sat_image *image, int x0, int y0, int x1, int y1)
{
    if (!table || !sat__image_is_valid(image)) return SAT_ERR_ARGUMENT;
    if (!sat__fits(table, image)) return SAT_ERR_MISMATCH;
    if (x0 < 0 || y0 < 0 || x1 > table->width || y1 > table->height || x0 > x1 || y0 > y1) return SAT_ERR_ARGUMENT;
    if (x0 == x1 || y0 == y1) return SAT_OK;
    if (table->options.kind != SAT_KIND_TILED || table->refused) return sat_build(table, image);
    table->exact = table->exact && sat__is_whole(image);
    return sat__rebuild(table, image, y0 >> table->shift, ((y1 - 1) >> table->shift) + 1);
}

SAT_DEF sat_stats sat_get_stats(const sat_table *table)
{
    sat_stats s;
    int channel;
    memset(&s, 0, sizeof s);
    if (!table) return s;
    for (channel = 0; channel < table->channels; channel++) {
        s.nan += table->total[channel].nan;
        s.infinite += table->total[channel].infinite;
        s.clamped += table->total[channel].clamped;
    }
    s.quantum = table->quantum;
    s.bytes = table->block_bytes;
    return s;
}

/* ---- >> lookups */

/* The two corner rows of a box in a flat table. */
typedef struct sat__rows {
    const void *low, *high; /* at y0 and y1 */
} sat__rows;

static sat__rows sat__rows_at(const sat_table *t, int channel, int y0, int y1)
{
    sat__rows r;
    r.low = sat__row(t, channel, y0);
    r.high = sat__row(t, channel, y1);
    return r;
}

/* Integer differences wrap around, and the true sum is the representative near zero. `kind` is the table's: loops pass
   it as a constant. */
static inline double sat__rows_sum(const sat_table *t, sat_kind kind, const sat__rows *r, int channel, int x0, int x1,
                                   int height)
{
    double sum = 0;
    switch (kind) {
    case SAT_KIND_TILED: return 0;
    case SAT_KIND_FLOAT: {
        const float *low = (const float *)r->low, *high = (const float *)r->high;
        sum = ((double)high[x1] - (double)high[x0]) - ((double)low[x1] - (double)low[x0]);
        break;
    }
    case SAT_KIND_DOUBLE: {
        const double *low = (const double *)r->low, *high = (const double *)r->high;
        sum = (high[x1] - high[x0]) - (low[x1] - low[x0]);
        break;
    }
    case SAT_KIND_FIXED32: {
        const uint32_t *low = (const uint32_t *)r->low, *high = (const uint32_t *)r->high;
        return (double)(int32_t)(high[x1] - high[x0] - low[x1] + low[x0]) * t->quantum;
    }
    }
    if (t->options.subtract_mean) sum += (double)t->mean[channel] * ((double)(x1 - x0) * (double)height);
    return sum;
}

static int sat__clip_box(const sat_table *t, int *x0, int *y0, int *x1, int *y1)
{
    if (*x0 < 0) *x0 = 0;
    if (*y0 < 0) *y0 = 0;
    if (*x1 > t->width) *x1 = t->width;
    if (*y1 > t->height) *y1 = t->height;
    return *x0 < *x1 && *y0 < *y1;
}

static double sat__flat_sum(const sat_view *v, int x0, int y0, int x1, int y1)
{
    sat__rows rows = sat__rows_at(v->table, v->channel, y0, y1);
    return sat__rows_sum(v->table, v->table->options.kind, &rows, v->channel, x0, x1, y1 - y0);
}

/* What lookups in loops read. A flat table looks like one tile that needs more than its cells. */
static void sat__make_views(sat_table *t)
{
    static const double hard = -1;
    int i, tiled = t->options.kind == SAT_KIND_TILED;
    for (i = 0; i < t->channels; i++) {
        sat_view *v = &t->view[i];
        v->table = t;
        v->other = tiled ? sat__tiled_sum : sat__flat_sum;
        v->channel = i;
        v->cells = tiled ? (const uint32_t *)(const void *)t->sums + (size_t)i * t->plane : NULL;
        v->quanta = tiled ? t->quanta + (size_t)i * (size_t)t->tiles_y * (size_t)t->tiles_x : &hard;
        v->stride = tiled ? t->stride : 0;
        v->tiles = tiled ? t->tiles_x : 0;
        v->shift = tiled ? t->shift : 31;
    }
}

SAT_DEF double sat_sum(const sat_table *table, int channel, int x0, int y0, int x1, int y1)
{
    if (!table || channel < 0 || channel >= table->channels || !sat__clip_box(table, &x0, &y0, &x1, &y1)) return 0;
    return sat_view_sum(&table->view[channel], x0, y0, x1, y1);
}

/* The kind is chosen once; the compiler makes a loop for each. */
static inline void sat__sums(double *out, const sat_table *t, sat_kind kind, int channel, const int *boxes,
                             size_t count)
{
    const sat_view view = t->view[channel];
    size_t i;
    for (i = 0; i < count; i++) {
        int x0 = boxes[4 * i], y0 = boxes[4 * i + 1], x1 = boxes[4 * i + 2], y1 = boxes[4 * i + 3];
        if (!sat__clip_box(t, &x0, &y0, &x1, &y1)) out[i] = 0;
        else if (kind == SAT_KIND_TILED) out[i] = sat_view_sum(&view, x0, y0, x1, y1);
        else {
            sat__rows rows = sat__rows_at(t, channel, y0, y1);
            out[i] = sat__rows_sum(t, kind, &rows, channel, x0, x1, y1 - y0);
        }
    }
}

SAT_DEF void sat_sums(double *out, const sat_table *table, int channel, const int *boxes, size_t count)
{
    size_t i;
    if (!out || !boxes) return;
    if (!table || channel < 0 || channel >= table->channels) {
        for (i = 0; i < count; i++) out[i] = 0;
        return;
    }
    switch (table->options.kind) {
    case SAT_KIND_TILED: sat__sums(out, table, SAT_KIND_TILED, channel, boxes, count); break;
    case SAT_KIND_FLOAT: sat__sums(out, table, SAT_KIND_FLOAT, channel, boxes, count); break;
    case SAT_KIND_DOUBLE: sat__sums(out, table, SAT_KIND_DOUBLE, channel, boxes, count); break;
    case SAT_KIND_FIXED32: sat__sums(out, table, SAT_KIND_FIXED32, channel, boxes, count); break;
    }
}

SAT_DEF sat_result sat_get_view(sat_view *out, const sat_table *table, int channel)
{
    if (!out || !table || channel < 0 || channel >= table->channels) return SAT_ERR_ARGUMENT;
    *out = table->view[channel];
    return SAT_OK;
}

SAT_DEF double sat_mean(const sat_table *table, int channel, int x0, int y0, int x1, int y1)
{
    if (!table || !sat__clip_box(table, &x0, &y0, &x1, &y1)) return 0;
    return sat_sum(table, channel, x0, y0, x1, y1) / ((double)(x1 - x0) * (double)(y1 - y0));
}

SAT_DEF float sat_restore(const sat_table *table, int channel, int x, int y)
{
    if (!table || x < 0 || y < 0 || x >= table->width || y >= table->height) return 0;
    return (float)sat_sum(table, channel, x, y, x + 1, y + 1);
}

/* ---- tables: real corners and borders

   Along each axis an interval becomes at most 12 pieces of whole pixels with a weight each; a box is the sum over all
   pairs of pieces. Weights are positive, so nothing cancels. */

typedef struct sat__piece {
    int begin, end;
    double weight;
} sat__piece;

typedef struct sat__pieces {
    sat__piece piece[12];
    int count;
} sat__pieces;

static void sat__add_piece(sat__pieces *list, int begin, int end, double weight)
{
    sat__piece *p = &list->piece[list->count];
    if (begin >= end || !(weight > 0) || list->count == 12) return;
    p->begin = begin;
    p->end = end;
    p->weight = weight;
    list->count++;
}

/* [a, b) inside [0, n]: a part of the first pixel, whole ones, a part of the last. */
static void sat__add_interval(sat__pieces *list, double a, double b, int n, double weight)
{
    int first, last;
    if (a < 0) a = 0;
    if (b > n) b = n;
    if (!(a < b)) return;
    first = (int)a;
    last = (int)b;
    if (first == last) {
        sat__add_piece(list, first, first + 1, weight * (b - a));
        return;
    }
    if (a > first) {
        sat__add_piece(list, first, first + 1, weight * ((first + 1) - a));
        first++;
    }
    sat__add_piece(list, first, last, weight);
    if (b > last) sat__add_piece(list, last, last + 1, weight * (b - last));
}

/* The length that the mean is divided by; the pieces that the border rule makes of [a, b). */
static double sat__border_pieces(sat__pieces *list, double a, double b, int n, sat_border border)
{
    double period = border == SAT_BORDER_MIRROR ? 2.0 * n : n, length = b - a, whole;
    int i;
    list->count = 0;
    if (border == SAT_BORDER_CLAMP) {
        if (a < 0) sat__add_piece(list, 0, 1, (b < 0 ? b : 0) - a);
        if (b > n) sat__add_piece(list, n - 1, n, b - (a > n ? a : n));
    }
    if (border != SAT_BORDER_MIRROR && border != SAT_BORDER_WRAP) {
        sat__add_interval(list, a, b, n, 1);
        if (border != SAT_BORDER_CLIP) return length;
        if (a < 0) a = 0;
        if (b > n) b = n;
        return b > a ? b - a : 0;
    }
    whole = floor(length / period);
    a -= floor(a / period) * period;
    b = a + (length - whole * period);
    sat__add_piece(list, 0, n, border == SAT_BORDER_MIRROR ? 2 * whole : whole);
    for (i = 0; i < 4; i++) { /* copy i covers [i n, (i + 1) n); odd ones of a mirror run backwards */
        double begin = a - (double)i * n, end = b - (double)i * n;
        if (begin >= n || end <= 0) continue;
        if (border == SAT_BORDER_MIRROR && i % 2) sat__add_interval(list, n - end, n - begin, n, 1);
        else sat__add_interval(list, begin, end, n, 1);
    }
    return length;
}

static double sat__sum_pieces(const sat_table *t, int channel, const sat__pieces *px, const sat__pieces *py)
{
    double sum = 0;
    int i, j;
    for (j = 0; j < py->count; j++)
        for (i = 0; i < px->count; i++)
            sum += px->piece[i].weight * py->piece[j].weight *
                   sat_sum(t, channel, px->piece[i].begin, py->piece[j].begin, px->piece[i].end, py->piece[j].end);
    return sum;
}

SAT_DEF double sat_sum_fractional(const sat_table *table, int channel, double x0, double y0, double x1, double y1)
{
    sat__pieces px, py;
    if (!table) return 0;
    px.count = py.count = 0;
    sat__add_interval(&px, x0, x1, table->width, 1);
    sat__add_interval(&py, y0, y1, table->height, 1);
    return sat__sum_pieces(table, channel, &px, &py);
}

SAT_DEF double sat_mean_border(const sat_table *table, int channel, double x0, double y0, double x1, double y1,
                               sat_border border_x, sat_border border_y)
{
    sat__pieces px, py;
    double area;
    if (!table || (unsigned)border_x > (unsigned)SAT_BORDER_WRAP || (unsigned)border_y > (unsigned)SAT_BORDER_WRAP)
        return 0;
    if (!(x0 < x1) || !(y0 < y1)) return 0;
    if (!(fabs(x0) < 1e15) || !(fabs(x1) < 1e15) || !(fabs(y0) < 1e15) || !(fabs(y1) < 1e15)) return 0;
    area = sat__border_pieces(&px, x0, x1, table->width, border_x) *
           sat__border_pieces(&py, y0, y1, table->height, border_y);
    return area > 0 ? sat__sum_pieces(table, channel, &px, &py) / area : 0;
}

/* ---- >> filters */

typedef struct sat__filter {
    const sat_table *table;
    unsigned char *out;
    const unsigned char *radii;
    ptrdiff_t out_stride, radii_stride;
    int radius;
} sat__filter;

/* One output row: box means of `height` rows between two corner rows. */
static inline void sat__filter_kind(float *out, const sat_table *t, sat_kind kind, const sat__rows *rows, int channel,
                                    int radius, int height)
{
    int x = 0, step = t->channels, width = t->width, inside = sat__max_int(0, width - radius), x0, x1;
    double inverse = 1 / ((2.0 * radius + 1) * (double)height);
    for (;; x++) {
        if (x == radius) /* boxes that no border cuts */
            for (; x < inside; x++)
                out[(size_t)x * (size_t)step] =
                    (float)(sat__rows_sum(t, kind, rows, channel, x - radius, x + radius + 1, height) * inverse);
        if (x >= width) return;
        x0 = x > radius ? x - radius : 0;
        x1 = width - x > radius ? x + radius + 1 : width;
        out[(size_t)x * (size_t)step] = (float)(sat__rows_sum(t, kind, rows, channel, x0, x1, height) *
                                                (1 / ((double)(x1 - x0) * (double)height)));
    }
}

/* v[i]: the rows of a span, spikes left out, in columns from the left side of a tile up to its column i. */
static void sat__tile_columns(double *v, const sat_table *t, int channel, const sat__span *y, int tx, int n)
{
    int i, j, b = y->run0, super = SAT__SUPER >> t->shift;
    for (j = 0; j < y->count; j++) {
        const sat__tile *tile = &t->tiles[sat__tile_index(t, channel, y->tile[j], tx)];
        if (tile->slot)
            for (i = 0; i < n; i++)
                v[i] = (j ? v[i] : 0) + sat__wide_part(t, tile, sat__box_of(0, y->begin[j], i + 1, y->end[j]));
        else {
            const uint32_t *high = sat__cells(t, channel, y->tile[j], y->end[j] - 1) + ((size_t)tx << t->shift),
                           *low = y->begin[j] ? high - (size_t)(y->end[j] - y->begin[j]) * t->stride : NULL;
            sat__add_cells(v, high, low, n, tile->quantum, j > 0);
        }
    }
    while (b < y->run1) {
        int stop = sat__min_int(y->run1, (b | (super - 1)) + 1);
        const double *high = sat__above(t, channel, stop - 1) + ((size_t)tx << t->shift);
        const double *low = b & (super - 1) ? sat__above(t, channel, b - 1) + ((size_t)tx << t->shift) : NULL;
        sat__add_strips(v, high, low, n);
        b = stop;
    }
}

/* Tiles of the rows that one output row needs, each computed once unless the radius is very large. */
enum { SAT__LINE_COLUMNS = 2048, SAT__LINE_TILES = 256 };

typedef struct sat__filter_line {
    const sat_table *table;
    sat__span y;
    int channel, radius, y0, y1, giants;
    int held[SAT__LINE_TILES];          /* which tile a slot holds, -1: none */
    double columns[SAT__LINE_COLUMNS + 2 * SAT__LINE_TILES]; /* a slot holds two numbers, of which the second is 0, what
                                                                is left of the tile, and the columns of one tile */
    double edges[SAT__LINE_TILES];      /* whole tiles of the rows */
    int edge_of[SAT__LINE_TILES];
} sat__filter_line;

static int sat__tile_width(const sat_table *t, int tx)
{
    return sat__min_int(t->options.tile, t->width - (tx << t->shift));
}

static inline const double *sat__line_columns(sat__filter_line *f, int tx)
{
    const sat_table *t = f->table;
    int slot = tx & ((SAT__LINE_COLUMNS >> t->shift) - 1);
    double *columns = f->columns + ((size_t)slot << t->shift) + 2 * slot + 2;
    if (f->held[slot] != tx) {
        columns[-1] = 0;
        sat__tile_columns(columns, t, f->channel, &f->y, tx, sat__tile_width(t, tx));
        f->held[slot] = tx;
    }
    return columns;
}

static inline double sat__line_edge(sat__filter_line *f, int tx)
{
    int slot = tx & (SAT__LINE_TILES - 1);
    if (f->edge_of[slot] != tx) {
        f->edges[slot] = sat__line_columns(f, tx)[sat__tile_width(f->table, tx) - 1];
        f->edge_of[slot] = tx;
    }
    return f->edges[slot];
}

/* n output pixels from x on, whose boxes all begin in tile column `first` and end in `last`. */
typedef struct sat__run {
    int x, n, first, last;
} sat__run;

/* Spikes of one tile column onto their boxes. */
static void sat__add_spikes(double *sum, const sat__filter_line *f, const sat__run *run, int tx)
{
    const sat_table *t = f->table;
    int i, j, k;
    for (j = 0; j < f->y.count; j++) {
        size_t index = sat__tile_index(t, f->channel, f->y.tile[j], tx);
        const sat__spike *s = t->spikes + index * SAT__SPIKES;
        for (k = 0; k < t->tiles[index].spikes; k++) {
            int at = (tx << t->shift) + s[k].x - run->x;
            if (s[k].y < f->y.begin[j] || s[k].y >= f->y.end[j]) continue;
            for (i = sat__max_int(0, at - f->radius); i < run->n && i <= at + f->radius; i++)
                sum[i] += (double)s[k].value;
        }
    }
}

/* Sums of a run. Where a radius spans more
   tiles than there are slots, the columns of the first tile are put aside. */
static void sat__line_sums(double *sum, sat__filter_line *f, const sat__run *run)
{
    const int x = run->x, n = run->n, first = run->first, last = run->last;
    const sat_table *t = f->table;
    double edge = 0, rest = 0, whole = 0, aside[SAT__MAX_TILE_SIDE];
    const double *low = NULL;
    int i, r = f->radius, tx, one = first == last, begin = first << t->shift;
    int skip = sat__clamp_int(begin + r + 1 - x, 0, n), inside = sat__clamp_int(t->width - r - x, 0, n);
    if (!one) edge = sat__line_edge(f, first);
    for (tx = first + 1; tx < last; tx++) rest += sat__line_edge(f, tx);
    if (inside < n) whole = sat__line_edge(f, last);
    if (skip < n) low = sat__line_columns(f, first) + (x + skip - r - 1 - begin);
    if (low && last - first >= SAT__LINE_COLUMNS >> t->shift) {
        memcpy(aside, low, (size_t)(n - skip) * sizeof *low);
        low = aside;
    }
    if (inside) {
        const double *high = sat__line_columns(f, last) + (x + r - (last << t->shift));
        for (i = 0; i < sat__min_int(skip, inside); i++) sum[i] = one ? high[i] : (edge + rest) + high[i];
        for (i = skip; i < inside; i++)
            sum[i] = one ? high[i] - low[i - skip] : ((edge - low[i - skip]) + rest) + high[i];
    }
    for (i = inside; i < n; i++) {
        double left = low && i >= skip ? low[i - skip] : 0;
        sum[i] = one ? whole - left : ((edge - left) + rest) + whole;
    }
    for (tx = first; tx <= last; tx++) sat__add_spikes(sum, f, run, tx);
    /* spikes of whole tile rows are in the strips already */
    if (f->giants)
        for (i = 0; i < n; i++)
            sum[i] += sat__giant_sum(t, f->channel,
                                     sat__box_of(sat__max_int(x + i - r, 0), f->y0,
                                                 sat__min_int(x + i + r + 1, t->width), f->y1));
}

/* The same where no border cuts a box and no spike or giant is near: straight to the means. */
static void sat__line_means(float *out, size_t step, sat__filter_line *f, const sat__run *run, double inverse)
{
    const int x = run->x, n = run->n, first = run->first, last = run->last;
    const sat_table *t = f->table;
    double edge = 0, rest = 0;
    const double *low, *high;
    int i = 0, tx;
    if (first < last) edge = sat__line_edge(f, first);
    for (tx = first + 1; tx < last; tx++) rest += sat__line_edge(f, tx);
    low = sat__line_columns(f, first) + (x - f->radius - 1 - (first << t->shift));
    high = sat__line_columns(f, last) + (x + f->radius - (last << t->shift));
#ifdef SAT__SSE2
    if (step == 1 && n >= 4) {
        const __m128d e = _mm_set1_pd(edge), r = _mm_set1_pd(rest), v = _mm_set1_pd(inverse);
        for (;; i = sat__min_int(i + 4, n - 4)) { /* the last four overlap those before them */
            __m128d a = _mm_sub_pd(e, _mm_loadu_pd(low + i)), b = _mm_sub_pd(e, _mm_loadu_pd(low + i + 2));
            a = _mm_add_pd(_mm_add_pd(a, r), _mm_loadu_pd(high + i));
            b = _mm_add_pd(_mm_add_pd(b, r), _mm_loadu_pd(high + i + 2));
            _mm_storeu_ps(out + i, _mm_movelh_ps(_mm_cvtpd_ps(_mm_mul_pd(a, v)), _mm_cvtpd_ps(_mm_mul_pd(b, v))));
            if (i + 4 >= n) return;
        }
    }
#endif
    for (; i < n; i++) out[(size_t)i * step] = (float)((((edge - low[i]) + rest) + high[i]) * inverse);
}

static int sat__has_spikes(const sat_table *t, int channel, int band)
{
    const sat__tile *tile = &t->tiles[sat__tile_index(t, channel, band, 0)];
    int tx, spikes = 0;
    for (tx = 0; tx < t->tiles_x; tx++) spikes |= tile[tx].spikes;
    return spikes;
}

/* The same of a tiled table, from its rows [y0, y1): a vertical difference in each tile, then a loop over the pixels
   whose boxes touch the same tiles. */
static void sat__filter_tiled(float *out, const sat_table *t, int channel, int radius, int y0, int y1)
{
    sat__filter_line f;
    sat__run run;
    double sum[SAT__MAX_TILE_SIDE], height = (double)(y1 - y0), inverse;
    int x, i, n, spiky = 0, room = SAT__LINE_COLUMNS >> t->shift;
    int step = t->channels, width = t->width, r = sat__min_int(radius, width);
    f.table = t;
    f.channel = channel;
    f.radius = r;
    f.y0 = y0;
    f.y1 = y1;
    f.giants = 0;
    inverse = 1 / ((2.0 * r + 1) * height);
    for (i = sat__min_int(t->tiles_x, SAT__LINE_TILES) - 1; i >= 0; i--) f.held[i] = f.edge_of[i] = -1;
    sat__span_of(&f.y, y0, y1, t->shift);
    for (i = 0; i < f.y.count; i++) spiky |= sat__has_spikes(t, channel, f.y.tile[i]);
    for (i = y0 >> t->shift; t->has_giants && i <= (y1 - 1) >> t->shift; i++)
        f.giants |= t->tallies[(size_t)channel * (size_t)t->tiles_y + (size_t)sat__band_slot(t, i)].giants > 0;
    for (x = 0; x < width; x += n) {
        int first = sat__max_int(0, x - r) >> t->shift, last = sat__min_int(width - 1, x + r) >> t->shift;
        n = sat__min_int(SAT__MAX_TILE_SIDE, sat__min_int(width - x, ((first + 1) << t->shift) + r - x));
        if (last < t->tiles_x - 1) n = sat__min_int(n, ((last + 1) << t->shift) - r - x);
        if (x < r) n = sat__min_int(n, r - x); /* the picture's borders stand apart */
        else if (x < width - r) n = sat__min_int(n, width - r - x);
        run.x = x;
        run.n = n;
        run.first = first;
        run.last = last;
        if (x >= r && x < width - r && !spiky && !f.giants && last - first < room) {
            sat__line_means(out + (size_t)x * (size_t)step, (size_t)step, &f, &run, inverse);
            continue;
        }
        sat__line_sums(sum, &f, &run);
        for (i = 0; i < n; i++) {
            int x0 = x + i > r ? x + i - r : 0, x1 = width - (x + i) > r ? x + i + r + 1 : width;
            out[(size_t)(x + i) * (size_t)step] = (float)(sum[i] * (1 / ((double)(x1 - x0) * height)));
        }
    }
}

static void sat__filter_row(float *out, const sat_table *t, const sat__rows *rows, int channel, int radius, int height)
{
    switch (t->options.kind) {
    case SAT_KIND_TILED: break;
    case SAT_KIND_FLOAT: sat__filter_kind(out, t, SAT_KIND_FLOAT, rows, channel, radius, height); break;
    case SAT_KIND_DOUBLE: sat__filter_kind(out, t, SAT_KIND_DOUBLE, rows, channel, radius, height); break;
    case SAT_KIND_FIXED32: sat__filter_kind(out, t, SAT_KIND_FIXED32, rows, channel, radius, height); break;
    }
}

static void sat__filter_rows(int begin, int end, int worker, void *context)
{
    const sat__filter *f = (const sat__filter *)context;
    const sat_table *t = f->table;
    int y, channel;
    (void)worker;
    for (y = begin; y < end; y++)
        for (channel = 0; channel < t->channels; channel++) {
            int y0 = y > f->radius ? y - f->radius : 0, y1 = t->height - y > f->radius ? y + f->radius + 1 : t->height;
            float *out = (float *)(void *)(f->out + (ptrdiff_t)y * f->out_stride) + channel;
            if (t->options.kind == SAT_KIND_TILED) sat__filter_tiled(out, t, channel, f->radius, y0, y1);
            else {
                sat__rows rows = sat__rows_at(t, channel, y0, y1);
                sat__filter_row(out, t, &rows, channel, f->radius, y1 - y0);
            }
        }
}

static void sat__filter_variable_rows(int begin, int end, int worker, void *context)
{
    const sat__filter *f = (const sat__filter *)context;
    const sat_table *t = f->table;
    int x, y, channel;
    (void)worker;
    for (y = begin; y < end; y++) {
        float *out = (float *)(void *)(f->out + (ptrdiff_t)y * f->out_stride);
        const float *radii = (const float *)(const void *)(f->radii + (ptrdiff_t)y * f->radii_stride);
        for (x = 0; x < t->width; x++) {
            double reach = radii[x] > 0 ? (double)radii[x] + 0.5 : 0.5, limit = (double)t->width + t->height;
            if (!(reach < limit)) reach = sat__is_nan(radii[x]) ? 0.5 : limit;
            for (channel = 0; channel < t->channels; channel++)
                out[x * t->channels + channel] =
                    (float)sat_mean_border(t, channel, x + 0.5 - reach, y + 0.5 - reach, x + 0.5 + reach,
                                           y + 0.5 + reach, SAT_BORDER_CLIP, SAT_BORDER_CLIP);
        }
    }
}

/* floats of the table's size */
static int sat__plane_is_valid(const float *pixels, ptrdiff_t *stride, const sat_table *t, int channels)
{
    return sat__rows_are_valid(pixels, stride, t->width, t->height, (size_t)channels * sizeof(float), sizeof(float));
}

SAT_DEF sat_result sat_box_filter(float *out, ptrdiff_t out_stride, const sat_table *table, int radius)
{
    sat__filter f;
    if (!table || radius < 0 || !sat__plane_is_valid(out, &out_stride, table, table->channels)) return SAT_ERR_ARGUMENT;
    memset(&f, 0, sizeof f);
    f.table = table;
    f.out = (unsigned char *)out;
    f.out_stride = out_stride;
    f.radius = radius;
    sat__parallel_for(&table->options.threads, table->height, sat__filter_rows, &f);
    return SAT_OK;
}

SAT_DEF sat_result sat_box_filter_variable(float *out, ptrdiff_t out_stride, const sat_table *table,
                                           const float *radius, ptrdiff_t radius_stride)
{
    sat__filter f;
    if (!table || !sat__plane_is_valid(out, &out_stride, table, table->channels)) return SAT_ERR_ARGUMENT;
    if (!sat__plane_is_valid(radius, &radius_stride, table, 1)) return SAT_ERR_ARGUMENT;
    memset(&f, 0, sizeof f);
    f.table = table;
    f.out = (unsigned char *)out;
    f.out_stride = out_stride;
    f.radii = (const unsigned char *)radius;
    f.radii_stride = radius_stride;
    sat__parallel_for(&table->options.threads, table->height, sat__filter_variable_rows, &f);
    return SAT_OK;
}

/* ---- >> bounds */

/* Roundings that one stored sum goes through when `rows` rows of `columns` pixels are added: down the column, three
   within eight pixels, and one carry for every eight. */
static double sat__roundings(double rows, double columns) { return rows + 3 + columns / 8 + 1; }

/* Never below the error of a box sum. Every stored sum of non-negative pixels is off by at most (roundings) u times
   itself, and a box adds up to four of them a tile it touches; signed pixels count with their magnitude. */
static double sat__sum_bound(const sat_table *t, const sat__tally *total, double box_width, double box_height)
{
    const double u = 5.9604644775390625e-8, v = 1.1102230246251565e-16; /* 2^-24, 2^-53 */
    double width = t->width, height = t->height, tile = t->options.tile, area = box_width * box_height;
    double all = total->sum_abs * 1.001, lowered = t->options.subtract_mean ? u * area * total->largest : 0;
    double doubles = 16 * v * (width / tile + height / tile + 4) * all;
    switch (t->options.kind) {
    case SAT_KIND_FLOAT: return 4 * u * 1.01 * sat__roundings(height, width) * all + lowered + doubles;
    case SAT_KIND_DOUBLE: return 4 * v * sat__roundings(height, width) * all + lowered + doubles;
    case SAT_KIND_FIXED32: return area * (0.5 * t->quantum + 4 * v * t->limit);
    case SAT_KIND_TILED: break;
    }
    return (t->exact ? 0 : area * 0.5 * total->tile_largest) + doubles;
}

SAT_DEF double sat_error_bound(const sat_table *table, int channel, int box_width, int box_height)
{
    double w, h;
    if (!table || channel < 0 || channel >= table->channels || box_width < 1 || box_height < 1) return 0;
    w = sat__min_int(box_width, table->width);
    h = sat__min_int(box_height, table->height);
    return sat__sum_bound(table, &table->total[channel], w, h) / (w * h);
}

/* What the doubles of a box may lose: `few` v times the magnitudes of all tiles that they sum, which are those of the
   box or, beyond three tiles a side, of its super tiles; a tile's sum is below 2^31 quanta. */
static double sat__box_doubles(const sat_table *t, int channel, int x0, int y0, int x1, int y1)
{
    const double v = 1.1102230246251565e-16; /* 2^-53 */
    int tx0 = x0 >> t->shift, ty0 = y0 >> t->shift, tx1 = (x1 - 1) >> t->shift, ty1 = (y1 - 1) >> t->shift, tx, ty, i;
    double sum = 0, few = 32;
    if (tx1 - tx0 > 2 || ty1 - ty0 > 2) {
        int super = (SAT__SUPER >> t->shift) - 1;
        tx0 &= ~super;
        ty0 &= ~super;
        tx1 = sat__min_int(tx1 | super, t->tiles_x - 1);
        ty1 = sat__min_int(ty1 | super, t->tiles_y - 1);
        few = 16.0 * (2.0 * super + 2 + (tx1 - tx0) / super + (ty1 - ty0) / super);
    }
    for (ty = ty0; ty <= ty1; ty++)
        for (tx = tx0; tx <= tx1; tx++) {
            size_t index = sat__tile_index(t, channel, ty, tx);
            sum += t->tiles[index].quantum * 2147483648.0;
            for (i = 0; i < t->tiles[index].spikes; i++)
                sum += fabs((double)t->spikes[index * SAT__SPIKES + (size_t)i].value);
        }
    return few * v * (sum + (t->has_giants ? fabs(sat__giant_sum(t, channel, sat__box_of(x0, y0, x1, y1))) : 0));
}

SAT_DEF double sat_error_bound_box(const sat_table *table, int channel, int x0, int y0, int x1, int y1)
{
    const sat_table *t = table;
    double sum = 0, area;
    int tx, ty;
    if (!t || channel < 0 || channel >= t->channels || !sat__clip_box(t, &x0, &y0, &x1, &y1)) return 0;
    if (t->options.kind != SAT_KIND_TILED) return sat_error_bound(t, channel, x1 - x0, y1 - y0);
    area = (double)(x1 - x0) * (double)(y1 - y0);
    for (ty = y0 >> t->shift; ty <= (y1 - 1) >> t->shift; ty++)
        for (tx = x0 >> t->shift; tx <= (x1 - 1) >> t->shift; tx++) {
            const sat__tile *tile = &t->tiles[sat__tile_index(t, channel, ty, tx)];
            int w = sat__min_int(x1, (tx + 1) << t->shift) - sat__max_int(x0, tx << t->shift);
            int h = sat__min_int(y1, (ty + 1) << t->shift) - sat__max_int(y0, ty << t->shift);
            sum += 0.5 * (tile->slot ? sat__wide_quantum(tile) : tile->quantum) * ((double)w * h);
        }
    return ((t->exact ? 0 : sum) + sat__box_doubles(t, channel, x0, y0, x1, y1)) / area;
}

/* The last rounding of each corner is independent of the others, and so are those that the corners of a box do not
   share: squares add. The factors are fitted to measured errors (bench_sat, table "Expected error"). */
SAT_DEF double sat_error_rms(const sat_table *table, int channel, int box_width, int box_height)
{
    const double u = 5.9604644775390625e-8, v = 1.1102230246251565e-16; /* 2^-24, 2^-53 */
    double w, h, width, height, tile, stored, tiles;
    const sat__tally *total;
    if (!table || channel < 0 || channel >= table->channels || box_width < 1 || box_height < 1) return 0;
    total = &table->total[channel];
    width = table->width;
    height = table->height;
    tile = table->options.tile;
    w = sat__min_int(box_width, table->width);
    h = sat__min_int(box_height, table->height);
    if (sat__is_fixed(table->options.kind)) return table->quantum / sqrt(12 * w * h);
    if (table->options.kind == SAT_KIND_TILED) {
        tiles = (double)table->tiles_x * ((height - 1) / tile + 1);
        return sqrt(total->tile_squares / tiles / (12 * w * h));
    }
    stored = total->sum_abs / (table->options.subtract_mean ? sqrt(width * height) : 1);
    return 0.25 * (table->options.kind == SAT_KIND_FLOAT ? u : v) * stored * sqrt(1 + 0.1 * (w + h)) / (w * h);
}

/* ---- choosing a kind */

/* Largest |pixel|, sum and largest tile sum of the whole image, all channels together. */
static void sat__survey(sat_table *t, const sat_image *image, double *tile_sums, double *largest_tile)
{
    sat__tally *total = &t->total[0];
    int x, y, channel, i, tile = t->options.tile;
    for (channel = 0; channel < image->channels; channel++)
        for (y = 0; y < t->height; y++)
            for (x = 0; x < t->width; x += tile) {
                sat__strip strip = sat__strip_of(image, channel, y, x, total);
                const float *p;
                double *sum = &tile_sums[x / tile];
                int n = strip.n = sat__min_int(tile, strip.n);
                p = sat__prepare(t, &strip);
                if (y % tile == 0) *sum = 0;
                sat__measure(p, n, total);
                for (i = 0; i < n; i++) *sum += fabs((double)p[i]);
                if (*sum > *largest_tile) *largest_tile = *sum;
            }
    total->negative = 0; /* the tile sums are of magnitudes already */
}

/* What a plan is asked for; whole: with boxes as large as the image in mind, not those of the request. */
typedef struct sat__request {
    int whole, box_width, box_height;
    double max_relative_error;
    size_t max_bytes; /* 0: any */
} sat__request;

static sat_result sat__plan(sat_kind *kind, const sat_image *image, sat__request request, const sat_options *options)
{
    static const sat_kind cheapest_first[] = {SAT_KIND_FLOAT, SAT_KIND_FIXED32, SAT_KIND_TILED, SAT_KIND_DOUBLE};
    sat_options resolved = options ? *options : sat_defaults();
    sat_table *survey, t;
    double allowed, area, best = -1, *tile_sums, largest_tile = 0;
    sat_result result;
    int i, box_width, box_height;
    sat__shape shape = {0, 0, 0, 2, 1, 0};
    if (!kind || !sat__image_is_valid(image) || request.box_width < 1 || request.box_height < 1 ||
        !(request.max_relative_error >= 0))
        return SAT_ERR_ARGUMENT;
    resolved.kind = SAT_KIND_DOUBLE;
    resolved.subtract_mean = 0;
    /* a one-row table holds all the scratch memory this needs; its row takes the tile sums */
    shape.width = image->width;
    shape.height = image->height;
    shape.channels = image->channels;
    result = sat__table_create(&survey, shape, &resolved);
    if (result) return result;
    tile_sums = (double *)(void *)sat__row(survey, 0, 0);
    sat__resolve(survey, image);
    sat__survey(survey, image, tile_sums, &largest_tile);
    survey->total[0].tile_largest = sat__tile_quantum(largest_tile, 31);
    box_width = sat__min_int(request.box_width, image->width);
    box_height = sat__min_int(request.box_height, image->height);
    area = (double)box_width * box_height;
    allowed = request.max_relative_error * survey->total[0].sum_abs /
              ((double)image->width * image->height * image->channels);
    result = SAT_ERR_LIMIT;
    for (i = 0; i < (int)SAT__COUNT(cheapest_first) && result; i++) {
        double error;
        size_t bytes;
        t = *survey;
        t.options.kind = cheapest_first[i];
        t.options.max_value = survey->total[0].largest;
        if (!(t.options.max_box_area > 0))
            t.options.max_box_area = request.whole ? (double)image->width * image->height : area;
        t.rows = image->height + (t.options.kind != SAT_KIND_TILED);
        t.tiles_y = (image->height - 1) / resolved.tile + 1;
        t.element = sat__kind_size(t.options.kind);
        bytes = sat__lay_out(&t, NULL);
        if (request.max_bytes && (bytes == 0 || bytes > request.max_bytes)) continue;
        t.quantum = resolved.quantum;
        if (sat__resolve(&t, image)) continue;
        error = sat__sum_bound(&t, &survey->total[0], (double)box_width, (double)box_height) / area;
        if (best < 0 || error < best || error <= allowed) {
            best = error;
            *kind = t.options.kind;
        }
        if (error <= allowed) result = SAT_OK;
    }
    sat_destroy(survey);
    return result;
}

SAT_DEF sat_result sat_plan(sat_kind *kind, const sat_image *image, int box_width, int box_height,
                            double max_relative_error, size_t max_bytes, const sat_options *options)
{
    const sat__request request = {1, box_width, box_height, max_relative_error, max_bytes};
    return sat__plan(kind, image, request, options);
}

SAT_DEF sat_result sat_plan_options(sat_options *out, const sat_image *image, int box_width, int box_height,
                                    double max_relative_error, size_t max_bytes, const sat_options *options)
{
    const sat__request request = {0, box_width, box_height, max_relative_error, max_bytes};
    sat_kind kind = SAT_KIND_TILED;
    sat_result result;
    if (!out) return SAT_ERR_ARGUMENT;
    result = sat__plan(&kind, image, request, options);
    if (result != SAT_OK && result != SAT_ERR_LIMIT) return result;
    *out = options ? *options : sat_defaults();
    out->kind = kind;
    out->subtract_mean = 0;
    if (sat__is_fixed(kind) && !(out->max_box_area > 0)) {
        int w = sat__min_int(box_width, image->width), h = sat__min_int(box_height, image->height);
        out->max_box_area = (double)w * h;
    }
    return result;
}


/* ---- >> summing moments

   A tile holds local sums of d = x - m and of products d d', m the tile's mean as a float. A box takes from each tile
   that it touches the count, the means and the co-moment; (n, mean, M) are joined pairwise (Chan, Golub, LeVeque 1983):

     M = M1 + M2 + delta_x delta_y n1 n2 / (n1 + n2) */

enum { SAT__MOMENT_SHIFT = 6, SAT__MOMENT_TILE = 1 << SAT__MOMENT_SHIFT };

struct sat_moments {
    sat_moments_options options;
    sat_allocator allocator;
    void *block;
    size_t block_bytes, stride, plane; /* elements */
    int width, height, channels, tiles_x, tiles_y, planes;
    double *sums;      /* planes: channels, then products (a, b) with a <= b; corner (x + 1, y + 1) at [y][x] */
    float *means;      /* a channel's tiles after the other */
    float *pixels;     /* a tile of every channel, for each worker */
    size_t *bad;       /* tiles rows' counts of NaN and infinity */
};

static const sat__field sat__moments_fields[] = {
    SAT__FIELD(sat_moments_options, 'i', covariance, 0, 0, 1, ' '),
    SAT__FIELD(sat_moments_options, 'i', non_finite, 0, 0, SAT_NON_FINITE_REFUSE, ' '),
    SAT__FIELD(sat_moments_options, 'a', allocator, 0, 0, 0, ' '),
    SAT__FIELD(sat_moments_options, 't', threads, 0, 0, 0, ' '),
};

SAT_DEF sat_moments_options sat_moments_defaults(void)
{
    sat_moments_options options;
    sat__fields_default(&options, sizeof options, sat__moments_fields, SAT__COUNT(sat__moments_fields));
    return options;
}

SAT_DEF const char *sat_explain_moments(char *text, size_t size, int width, int height, int channels,
                                        const sat_moments_options *options)
{
    sat__text t = sat__text_begin(text, size);
    const sat__field *wrong =
        options ? sat__fields_check(options, sat__moments_fields, SAT__COUNT(sat__moments_fields)) : NULL;
    if (sat__explain_size(&t, width, height, channels) && wrong) sat__text_field(&t, wrong, options);
    return text;
}

static size_t sat__moments_lay_out(sat_moments *m, unsigned char *base)
{
    sat__arena arena;
    size_t workers = (size_t)sat__worker_count(&m->options.threads), channels = (size_t)m->channels, count;
    arena.base = base;
    arena.used = 0;
    arena.overflow = 0;
    m->stride = (size_t)m->width;
    if (!sat__multiply_size(&m->plane, m->stride, (size_t)m->height) ||
        !sat__multiply_size(&count, m->plane, (size_t)m->planes))
        return 0;
    m->sums = (double *)sat__carve(&arena, count, sizeof(double));
    m->means = (float *)sat__carve(&arena, (size_t)m->tiles_x * (size_t)m->tiles_y * channels, sizeof(float));
    m->pixels = (float *)sat__carve(&arena, workers * channels * SAT__MOMENT_TILE * SAT__MOMENT_TILE, sizeof(float));
    m->bad = (size_t *)sat__carve(&arena, (size_t)m->tiles_y, sizeof(size_t));
    return arena.overflow ? 0 : arena.used;
}

SAT_DEF sat_result sat_moments_create(sat_moments **out, int width, int height, int channels,
                                      const sat_moments_options *options)
{
    sat_moments m;
    unsigned char *base;
    sat__text ignored = sat__text_begin(NULL, 0);
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    memset(&m, 0, sizeof m);
    m.options = options ? *options : sat_moments_defaults();
    if (!sat__explain_size(&ignored, width, height, channels)) return SAT_ERR_ARGUMENT;
    if (sat__fields_check(&m.options, sat__moments_fields, SAT__COUNT(sat__moments_fields))) return SAT_ERR_ARGUMENT;
    sat__resolve_allocator(&m.allocator, &m.options.allocator);
    m.width = width;
    m.height = height;
    m.channels = channels;
    m.tiles_x = (width - 1) / SAT__MOMENT_TILE + 1;
    m.tiles_y = (height - 1) / SAT__MOMENT_TILE + 1;
    m.planes = channels + (m.options.covariance ? channels * (channels + 1) / 2 : channels);
    m.block_bytes = sat__moments_lay_out(&m, NULL);
    if (!m.block_bytes || m.block_bytes > SIZE_MAX / 2 - sizeof m - SAT__LINE) return SAT_ERR_SIZE;
    m.block_bytes += sizeof m + SAT__LINE;
    m.block = sat__alloc(&m.allocator, m.block_bytes);
    if (!m.block) return SAT_ERR_MEMORY;
    memset(m.block, 0, m.block_bytes);
    base = (unsigned char *)m.block;
    sat__moments_lay_out(&m, sat__align64(base + sizeof m));
    *out = (sat_moments *)m.block;
    **out = m;
    return SAT_OK;
}

SAT_DEF void sat_moments_destroy(sat_moments *moments)
{
    if (moments) {
        sat_allocator allocator = moments->allocator;
        sat__release(&allocator, moments->block, moments->block_bytes);
    }
}

/* The plane of a product; without covariance only squares have one. */
static int sat__moment_plane(const sat_moments *m, int a, int b)
{
    int low = sat__min_int(a, b), high = sat__max_int(a, b);
    return m->options.covariance ? m->channels + high * (high + 1) / 2 + low : m->channels + a;
}

/* The mean of the finite pixels of a tile; the others are set to it and counted. */
static float sat__moment_mean(float *p, int w, int h, size_t *bad)
{
    double sum = 0;
    size_t found = 0;
    int x, y;
    float mean;
    for (y = 0; y < h; y++)
        for (x = 0; x < w; x++)
            if (sat__is_finite(p[y * SAT__MOMENT_TILE + x])) sum += (double)p[y * SAT__MOMENT_TILE + x];
            else found++;
    mean = (size_t)w * (size_t)h > found ? (float)(sum / (double)((size_t)w * (size_t)h - found)) : 0;
    *bad += found;
    for (y = 0; y < h && found; y++)
        for (x = 0; x < w; x++)
            if (!sat__is_finite(p[y * SAT__MOMENT_TILE + x])) p[y * SAT__MOMENT_TILE + x] = mean;
    return mean;
}

/* A channel of a tile, and what is taken off it. */
typedef struct sat__centred {
    const float *pixels;
    double mean;
} sat__centred;

/* Local sums of a's pixels less their mean, or of their products with b's where there is a b. */
static void sat__moment_sums(double *out, size_t stride, const sat__centred *a, const sat__centred *b, int w, int h)
{
    const float *p = a->pixels, *q = b ? b->pixels : NULL;
    const double mean_p = a->mean, mean_q = b ? b->mean : 0;
    int x, y;
    for (y = 0; y < h; y++, out += stride, p += SAT__MOMENT_TILE) {
        double run = 0;
        if (q && y) q += SAT__MOMENT_TILE;
        for (x = 0; x < w; x++) {
            double d = (double)p[x] - mean_p;
            run += q ? d * ((double)q[x] - mean_q) : d;
            out[x] = y ? out[x - (ptrdiff_t)stride] + run : run;
        }
    }
}

typedef struct sat__moments_build {
    sat_moments *moments;
    const sat_image *image;
} sat__moments_build;

static void sat__moments_rows(int begin, int end, int worker, void *context)
{
    const sat__moments_build *b = (const sat__moments_build *)context;
    sat_moments *m = b->moments;
    enum { SIDE = SAT__MOMENT_TILE, AREA = SIDE * SIDE };
    float *tile = m->pixels + (size_t)worker * (size_t)m->channels * AREA;
    int ty, tx, c, other, y;
    for (ty = begin; ty < end; ty++) {
        int y0 = ty * SIDE, h = sat__min_int(SIDE, m->height - y0);
        m->bad[ty] = 0;
        for (tx = 0; tx < m->tiles_x; tx++) {
            int x0 = tx * SIDE, w = sat__min_int(SIDE, m->width - x0);
            size_t at = (size_t)y0 * m->stride + (size_t)x0, tiles = (size_t)m->tiles_x * (size_t)m->tiles_y;
            sat__centred of[4];
            for (c = 0; c < m->channels; c++) {
                double *sums = m->sums + at;
                float mean;
                for (y = 0; y < h; y++) sat__read_row(tile + c * AREA + y * SIDE, b->image, y0 + y, x0, x0 + w, c);
                mean = sat__moment_mean(tile + c * AREA, w, h, &m->bad[ty]);
                m->means[(size_t)c * tiles + (size_t)ty * (size_t)m->tiles_x + (size_t)tx] = mean;
                of[c].pixels = tile + c * AREA;
                of[c].mean = (double)mean;
                sat__moment_sums(sums + (size_t)c * m->plane, m->stride, &of[c], NULL, w, h);
                for (other = m->options.covariance ? 0 : c; other <= c; other++)
                    sat__moment_sums(sums + (size_t)sat__moment_plane(m, other, c) * m->plane, m->stride, &of[c],
                                     &of[other], w, h);
            }
        }
    }
}

SAT_DEF sat_result sat_moments_build(sat_moments *moments, const sat_image *image)
{
    sat__moments_build b;
    size_t bad = 0;
    int i;
    if (!moments || !sat__image_is_valid(image)) return SAT_ERR_ARGUMENT;
    if (image->width != moments->width || image->height != moments->height || image->channels != moments->channels)
        return SAT_ERR_MISMATCH;
    b.moments = moments;
    b.image = image;
    sat__parallel_for(&moments->options.threads, moments->tiles_y, sat__moments_rows, &b);
    for (i = 0; i < moments->tiles_y; i++) bad += moments->bad[i];
    if (!bad || moments->options.non_finite != SAT_NON_FINITE_REFUSE) return SAT_OK;
    memset(moments->sums, 0, moments->plane * (size_t)moments->planes * sizeof(double));
    memset(moments->means, 0,
           (size_t)moments->tiles_x * (size_t)moments->tiles_y * (size_t)moments->channels * sizeof(float));
    return SAT_ERR_NON_FINITE;
}

/* The part of a box inside one tile; left and top: it begins at the tile's own first column and row. */
typedef struct sat__moment_part {
    sat__box box;
    int left, top;
} sat__moment_part;

static inline double sat__moment_corners(const sat_moments *t, int plane, const sat__moment_part *part)
{
    const sat__box *box = &part->box;
    const double *high = t->sums + (size_t)plane * t->plane + (size_t)(box->y1 - 1) * t->stride,
                 *low = high - (size_t)(box->y1 - box->y0) * t->stride;
    double sum = high[box->x1 - 1];
    if (!part->left) sum -= high[box->x0 - 1];
    if (!part->top) sum -= part->left ? low[box->x1 - 1] : low[box->x1 - 1] - low[box->x0 - 1];
    return sum;
}

typedef struct sat__moment {
    double n, a, b, co; /* count, means, co-moment */
} sat__moment;

/* Two channels and the plane of their products; plane < 0: means only. */
typedef struct sat__moment_pair {
    int channel, other, plane;
} sat__moment_pair;

static inline void sat__moment_join(sat__moment *m, const sat_moments *t, sat__moment_pair pair, sat__box box, int tx,
                                    int ty)
{
    size_t tiles = (size_t)t->tiles_x * (size_t)t->tiles_y, tile = (size_t)ty * (size_t)t->tiles_x + (size_t)tx;
    int left = tx * SAT__MOMENT_TILE, top = ty * SAT__MOMENT_TILE, same = pair.other == pair.channel;
    sat__moment_part part;
    double n, both, a, b, co, delta_a, delta_b;
    part.box = sat__box_of(sat__max_int(box.x0, left), sat__max_int(box.y0, top),
                           sat__min_int(box.x1 - left, SAT__MOMENT_TILE) + left,
                           sat__min_int(box.y1 - top, SAT__MOMENT_TILE) + top);
    part.left = part.box.x0 == left;
    part.top = part.box.y0 == top;
    n = (double)(part.box.x1 - part.box.x0) * (double)(part.box.y1 - part.box.y0);
    both = m->n + n;
    a = sat__moment_corners(t, pair.channel, &part);
    b = same ? a : sat__moment_corners(t, pair.other, &part);
    co = pair.plane < 0 ? 0 : sat__moment_corners(t, pair.plane, &part) - a * b / n;
    if (same && !(co > 0)) co = 0;
    delta_a = (double)t->means[(size_t)pair.channel * tiles + tile] + a / n - m->a;
    delta_b = same ? delta_a : (double)t->means[(size_t)pair.other * tiles + tile] + b / n - m->b;
    m->co += co + delta_a * delta_b * (m->n / both * n);
    m->a += delta_a * (n / both);
    m->b += delta_b * (n / both);
    m->n = both;
}

static sat__moment sat__moment_box(const sat_moments *t, sat__moment_pair pair, sat__box box)
{
    sat__moment m;
    int tx, ty;
    m.n = m.a = m.b = m.co = 0;
    box = sat__box_of(sat__max_int(box.x0, 0), sat__max_int(box.y0, 0), sat__min_int(box.x1, t->width),
                      sat__min_int(box.y1, t->height));
    if (box.x0 >= box.x1 || box.y0 >= box.y1) return m;
    for (ty = box.y0 >> SAT__MOMENT_SHIFT; ty <= (box.y1 - 1) >> SAT__MOMENT_SHIFT; ty++)
        for (tx = box.x0 >> SAT__MOMENT_SHIFT; tx <= (box.x1 - 1) >> SAT__MOMENT_SHIFT; tx++)
            sat__moment_join(&m, t, pair, box, tx, ty);
    return m;
}

static sat__moment_pair sat__moment_pair_of(const sat_moments *m, int channel, int other)
{
    sat__moment_pair pair;
    pair.channel = channel;
    pair.other = other;
    pair.plane = sat__moment_plane(m, channel, other);
    return pair;
}

static int sat__moment_pair_is_valid(const sat_moments *m, int channel, int other)
{
    if (!m || channel < 0 || other < 0 || channel >= m->channels || other >= m->channels) return 0;
    return channel == other || m->options.covariance;
}

SAT_DEF double sat_moments_mean(const sat_moments *moments, int channel, int x0, int y0, int x1, int y1)
{
    sat__moment_pair pair;
    if (!sat__moment_pair_is_valid(moments, channel, channel)) return 0;
    pair.channel = pair.other = channel;
    pair.plane = -1;
    return sat__moment_box(moments, pair, sat__box_of(x0, y0, x1, y1)).a;
}

SAT_DEF double sat_covariance(const sat_moments *moments, int channel, int other, int x0, int y0, int x1, int y1)
{
    sat__moment m;
    if (!sat__moment_pair_is_valid(moments, channel, other)) return 0;
    m = sat__moment_box(moments, sat__moment_pair_of(moments, channel, other), sat__box_of(x0, y0, x1, y1));
    return m.n > 0 ? m.co / m.n : 0;
}

SAT_DEF double sat_variance(const sat_moments *moments, int channel, int x0, int y0, int x1, int y1)
{
    return sat_covariance(moments, channel, channel, x0, y0, x1, y1);
}

typedef struct sat__moments_filter {
    const sat_moments *moments;
    unsigned char *out, *mean;
    ptrdiff_t stride;
    int channel, other, radius;
} sat__moments_filter;

static void sat__moments_filter_rows(int begin, int end, int worker, void *context)
{
    const sat__moments_filter *f = (const sat__moments_filter *)context;
    const sat_moments *t = f->moments;
    const sat__moment_pair pair = sat__moment_pair_of(t, f->channel, f->other);
    int x, y, r = f->radius;
    (void)worker;
    for (y = begin; y < end; y++) {
        float *out = (float *)(void *)(f->out + (ptrdiff_t)y * f->stride);
        float *mean = f->mean ? (float *)(void *)(f->mean + (ptrdiff_t)y * f->stride) : NULL;
        for (x = 0; x < t->width; x++) {
            sat__moment m = sat__moment_box(t, pair,
                                            sat__box_of(x > r ? x - r : 0, y > r ? y - r : 0,
                                                        t->width - x > r ? x + r + 1 : t->width,
                                                        t->height - y > r ? y + r + 1 : t->height));
            out[x] = (float)(m.co / m.n);
            if (mean) mean[x] = (float)m.a;
        }
    }
}

SAT_DEF sat_result sat_moments_filter(float *out, float *mean, ptrdiff_t out_stride, const sat_moments *moments,
                                      int channel, int other, int radius)
{
    sat__moments_filter f;
    if (!moments || radius < 0 || !sat__moment_pair_is_valid(moments, channel, other)) return SAT_ERR_ARGUMENT;
    if (!sat__rows_are_valid(out, &out_stride, moments->width, moments->height, sizeof(float), sizeof(float)))
        return SAT_ERR_ARGUMENT;
    if ((uintptr_t)mean % sizeof(float)) return SAT_ERR_ARGUMENT;
    memset(&f, 0, sizeof f);
    f.moments = moments;
    f.out = (unsigned char *)out;
    f.mean = (unsigned char *)mean;
    f.stride = out_stride;
    f.channel = channel;
    f.other = other;
    f.radius = radius;
    sat__parallel_for(&moments->options.threads, moments->height, sat__moments_filter_rows, &f);
    return SAT_OK;
}

/* ---- >> streams

   The table is a ring: the last 2 radius + 2 corner rows, and the strips above the tile rows that these lie in. */

enum { SAT__MAX_STREAM_RADIUS = 100000 };

struct sat_stream {
    sat_table *table;
    int radius;
    int used[4];         /* pool slots of this super tile row, a channel */
    uint64_t built;      /* rows that lookups may ask for */
    uint64_t taken, given;
};

SAT_DEF sat_result sat_stream_create(sat_stream **out, int width, int channels, int radius, const sat_options *options)
{
    sat_options resolved = options ? *options : sat_defaults();
    sat_allocator allocator;
    sat_stream *stream;
    sat_result result;
    sat__shape shape = {0, 0, 0, 0, 1, 0};
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (resolved.kind == SAT_KIND_TILED && radius > SAT__MAX_STREAM_RADIUS) return SAT_ERR_SIZE;
    if (radius < 0 || radius > 0x3fffffff - 2 || resolved.subtract_mean || !sat__options_are_valid(&resolved))
        return SAT_ERR_ARGUMENT;
    if (sat__is_fixed(resolved.kind)) {
        if (!(resolved.quantum > 0) && !(resolved.max_value > 0))
            return SAT_ERR_ARGUMENT; /* the largest pixel is not known yet */
        if (!(resolved.max_box_area > 0)) /* no box is wider than the image */
            resolved.max_box_area = fmin(2.0 * radius + 1, width) * (2.0 * radius + 1);
    }
    memset(&resolved.threads, 0, sizeof resolved.threads);
    if (!sat__resolve_allocator(&allocator, &resolved.allocator)) return SAT_ERR_ARGUMENT;
    stream = (sat_stream *)sat__alloc(&allocator, sizeof *stream);
    if (!stream) return SAT_ERR_MEMORY;
    memset(stream, 0, sizeof *stream);
    stream->radius = radius;
    shape.width = width;
    shape.channels = channels;
    shape.height = shape.rows = 2 * radius + 2;
    if (resolved.kind == SAT_KIND_TILED) {
        shape.tile_rows = (2 * radius + 1) / resolved.tile + 3;
        shape.rows = shape.tile_rows * resolved.tile;
        shape.ring = 1;
    }
    result = sat__table_create(&stream->table, shape, &resolved);
    if (result) sat__release(&allocator, stream, sizeof *stream);
    else *out = stream;
    return result;
}

SAT_DEF void sat_stream_destroy(sat_stream *stream)
{
    if (stream) {
        sat_allocator allocator = stream->table->allocator;
        sat_destroy(stream->table);
        sat__release(&allocator, stream, sizeof *stream);
    }
}

static int sat__ring_row(const sat_stream *s, uint64_t corner_row)
{
    return (int)(corner_row % (uint64_t)s->table->rows);
}

/* Tile rows and pixel rows of a tiled ring are counted modulo this many tile rows, so that an int holds them and all
   that repeats (slots, super tile rows, their pools) stays in step. */
static int sat__ring_period(const sat_table *t) { return t->tiles_y * (SAT__SUPER >> t->shift) * sat__supers(t); }

/* The tile row that the rows taken last fill, or the last rows of the image. */
static void sat__stream_build(sat_stream *s)
{
    sat_table *t = s->table;
    sat_image image = sat_image_f32(t->ring_pixels, t->width, (int)(s->taken - s->built), t->channels);
    int channel, tx, band = (int)((s->built >> t->shift) % (uint64_t)sat__ring_period(t));
    for (channel = 0; channel < t->channels; channel++) {
        sat__job job = sat__job_of(t, &image, channel, band, 0);
        sat__settle_band(&job);
        if ((band & ((SAT__SUPER >> t->shift) - 1)) == 0) s->used[channel] = 0;
        for (tx = 0; tx < t->tiles_x; tx++) sat__assign_wide(t, channel, band, tx, &s->used[channel]);
        sat__finish_band(&job);
        sat__build_above(t, channel, band, image.height);
        t->has_giants |= job.tally->giants > 0;
    }
    s->built = s->taken;
}

/* Adds one image row below those taken so far. */
static void sat__stream_take(sat_stream *s, const sat_image *row)
{
    sat_table *t = s->table;
    uint64_t corner_row = s->taken + 1;
    int channel, x, slot = sat__ring_row(s, corner_row);
    if (t->options.kind == SAT_KIND_TILED) {
        float *rows = t->ring_pixels + (size_t)(s->taken - s->built) * (size_t)t->width * (size_t)t->channels;
        for (channel = 0; channel < t->channels; channel++)
            for (x = 0; x < t->width; x++) {
                float *p = &rows[(size_t)x * (size_t)t->channels + (size_t)channel];
                sat__read_row(p, row, 0, x, x + 1, channel);
                t->total[channel].nan += (size_t)sat__is_nan(*p);
                t->total[channel].infinite += (size_t)(!sat__is_nan(*p) && !sat__is_finite(*p));
            }
        if (++s->taken - s->built == (uint64_t)t->options.tile) sat__stream_build(s);
        return;
    }
    for (channel = 0; channel < t->channels; channel++) {
        unsigned char *sums = sat__row(t, channel, slot);
        sat__carry carry;
        memset(sums, 0, t->element);
        memset(&carry, 0, sizeof carry);
        for (x = 0; x < t->width; x += SAT__STRIP) {
            sat__strip strip = sat__strip_of(row, channel, 0, x, &t->total[channel]); /* no row can be built again */
            strip.n = sat__min_int(SAT__STRIP, strip.n);
            sat__flat_piece(t, sums, &carry, &strip, 0);
        }
    }
    s->taken++;
}

SAT_DEF sat_result sat_stream_push(sat_stream *stream, float *out_row, int *rows_out, const sat_image *row)
{
    sat_table *t;
    uint64_t reach, low, high;
    int channel;
    if (!stream || !out_row || !rows_out) return SAT_ERR_ARGUMENT;
    *rows_out = 0;
    t = stream->table;
    if (row) {
        size_t bad = 0;
        sat_result result;
        if (!sat__image_is_valid(row)) return SAT_ERR_ARGUMENT;
        if (row->width != t->width || row->height != 1 || row->channels != t->channels) return SAT_ERR_MISMATCH;
        if (stream->taken == 0 && (result = sat__resolve(t, row)) != SAT_OK) return result;
        sat__stream_take(stream, row);
        for (channel = 0; channel < t->channels; channel++) bad += t->total[channel].nan + t->total[channel].infinite;
        if (bad && t->options.non_finite == SAT_NON_FINITE_REFUSE) return SAT_ERR_NON_FINITE;
    }
    reach = (uint64_t)stream->radius + 1;
    high = stream->given + reach;
    if (t->options.kind != SAT_KIND_TILED) stream->built = stream->taken;
    else if (!row && stream->built < stream->taken) sat__stream_build(stream);
    if (row ? high > stream->built : stream->given >= stream->taken) return SAT_OK;
    if (high > stream->taken) high = stream->taken;
    low = stream->given >= reach ? stream->given + 1 - reach : 0;
    for (channel = 0; channel < t->channels; channel++) {
        sat__rows rows;
        if (t->options.kind == SAT_KIND_TILED) {
            uint64_t period = (uint64_t)sat__ring_period(t) << t->shift;
            sat__filter_tiled(out_row + channel, t, channel, stream->radius, (int)(low % period),
                              (int)(low % period + (high - low)));
            continue;
        }
        rows = sat__rows_at(t, channel, sat__ring_row(stream, low), sat__ring_row(stream, high));
        sat__filter_row(out_row + channel, t, &rows, channel, stream->radius, (int)(high - low));
    }
    stream->given++;
    *rows_out = 1;
    return SAT_OK;
}


#ifdef __cplusplus
}
#endif
SAT__IEEE_END
#endif /* SAT_IMPLEMENTATION */

/* ------------------------------------------------------------------------------------------------
   Implementation: OpenGL
   ------------------------------------------------------------------------------------------------ */

#if defined(SAT_IMPLEMENTATION) && defined(SAT_GL) && !defined(SAT__GL_IMPLEMENTED)
#define SAT__GL_IMPLEMENTED

SAT__IEEE_BEGIN
#ifdef __cplusplus
extern "C" {
#endif

/* ---- >> shaders */

/* Two-float sums: with the larger term first, the rounding error of a sum is exact (Dekker 1971). A compiler that takes
   sums for associative would lose it, and GLSL 3.30 has no `precise`: so every rounded sum is multiplied by a 1 that
   the compiler cannot see. An R32F table reads as two-floats with a low part of zero. Lookups follow Slomp 2012, eq 4.2
   to 4.4: zero left and above, clamped right and below; they take differences of neighbours first. A fractional box is
   nine boxes: the cells that its border cuts, weighted, and what lies between them. */
static const char sat__glsl_lookups[] =
    "#ifndef SAT_GLSL\n"
    "#define SAT_GLSL\n"
    "#ifdef GL_ES\n"
    SAT__GLSL(
        precision highp float;
        precision highp int;
        precision highp sampler2D;
        precision highp usampler2D;)
    "#endif\n"
    SAT__GLSL(
        vec2 sat_add(vec2 a, vec2 b, float one) {
            bool swap = abs(a.x) < abs(b.x);
            float big = swap ? b.x : a.x, small = swap ? a.x : b.x;
            float sum = (big + small) * one;
            float low = (small - (sum - big)) + (a.y + b.y);
            float high = (sum + low) * one;
            return vec2(high, low - (high - sum));
        })
    SAT__GLSL(
        vec2 sat_corner(sampler2D table, int x, int y) {
            return x < 1 || y < 1 ? vec2(0.0) : texelFetch(table, ivec2(x, y) - 1, 0).xy;
        })
    SAT__GLSL(
        uint sat_corner(usampler2D table, int x, int y) {
            return x < 1 || y < 1 ? 0u : texelFetch(table, ivec2(x, y) - 1, 0).x;
        })
    SAT__GLSL(
        float sat_sum(sampler2D table, ivec2 low, ivec2 high) {
            ivec2 size = textureSize(table, 0), a = clamp(low, ivec2(0), size), b = clamp(high, ivec2(0), size);
            float one = size.x > 0 ? 1.0 : 0.0;
            if (any(lessThanEqual(b, a))) return 0.0;
            vec2 right = sat_add(sat_corner(table, b.x, b.y), -sat_corner(table, b.x, a.y), one);
            vec2 left = sat_add(sat_corner(table, a.x, b.y), -sat_corner(table, a.x, a.y), one);
            right = sat_add(right, -left, one);
            return right.x + right.y;
        })
    SAT__GLSL(
        float sat_sum(usampler2D table, float quantum, ivec2 low, ivec2 high) {
            ivec2 size = textureSize(table, 0), a = clamp(low, ivec2(0), size), b = clamp(high, ivec2(0), size);
            if (any(lessThanEqual(b, a))) return 0.0;
            return quantum * float(int(sat_corner(table, b.x, b.y) - sat_corner(table, b.x, a.y) -
                                       sat_corner(table, a.x, b.y) + sat_corner(table, a.x, a.y)));
        })
    SAT__GLSL(
        float sat_area(ivec2 size, ivec2 low, ivec2 high) {
            ivec2 side = clamp(high, ivec2(0), size) - clamp(low, ivec2(0), size);
            return side.x > 0 && side.y > 0 ? float(side.x) * float(side.y) : 1.0;
        })
    SAT__GLSL(
        float sat_mean(sampler2D table, ivec2 low, ivec2 high) {
            return sat_sum(table, low, high) / sat_area(textureSize(table, 0), low, high);
        })
    SAT__GLSL(
        float sat_mean(usampler2D table, float quantum, ivec2 low, ivec2 high) {
            return sat_sum(table, quantum, low, high) / sat_area(textureSize(table, 0), low, high);
        })
    SAT__GLSL(
        float sat_sum_fractional(sampler2D table, vec2 low, vec2 high) {
            ivec2 size = textureSize(table, 0);
            vec2 a = clamp(low, vec2(0.0), vec2(size)), b = clamp(high, vec2(0.0), vec2(size));
            float one = size.x > 0 ? 1.0 : 0.0, sum = 0.0;
            if (!all(lessThan(a, b))) return 0.0;
            ivec4 x = min(ivec4(int(a.x), int(a.x) + 1, int(b.x), int(b.x) + 1), size.x);
            ivec4 y = min(ivec4(int(a.y), int(a.y) + 1, int(b.y), int(b.y) + 1), size.y);
            vec3 u = vec3(1.0 - fract(a.x), 1.0, fract(b.x)), v = vec3(1.0 - fract(a.y), 1.0, fract(b.y));
            for (int i = 0; i < 3; i++) {
                vec2 left = sat_add(sat_corner(table, x[0], y[i + 1]), -sat_corner(table, x[0], y[i]), one);
                for (int j = 0; j < 3; j++) {
                    vec2 right = sat_add(sat_corner(table, x[j + 1], y[i + 1]), -sat_corner(table, x[j + 1], y[i]),
                        one);
                    vec2 box = sat_add(right, -left, one);
                    sum += v[i] * u[j] * (box.x + box.y);
                    left = right;
                }
            }
            return sum;
        })
    SAT__GLSL(
        float sat_sum_fractional(usampler2D table, float quantum, vec2 low, vec2 high) {
            ivec2 size = textureSize(table, 0);
            vec2 a = clamp(low, vec2(0.0), vec2(size)), b = clamp(high, vec2(0.0), vec2(size));
            float sum = 0.0;
            if (!all(lessThan(a, b))) return 0.0;
            ivec4 x = min(ivec4(int(a.x), int(a.x) + 1, int(b.x), int(b.x) + 1), size.x);
            ivec4 y = min(ivec4(int(a.y), int(a.y) + 1, int(b.y), int(b.y) + 1), size.y);
            vec3 u = vec3(1.0 - fract(a.x), 1.0, fract(b.x)), v = vec3(1.0 - fract(a.y), 1.0, fract(b.y));
            for (int i = 0; i < 3; i++) {
                uint left = sat_corner(table, x[0], y[i + 1]) - sat_corner(table, x[0], y[i]);
                for (int j = 0; j < 3; j++) {
                    uint right = sat_corner(table, x[j + 1], y[i + 1]) - sat_corner(table, x[j + 1], y[i]);
                    sum += v[i] * u[j] * float(int(right - left));
                    left = right;
                }
            }
            return quantum * sum;
        })
    "#endif\n";

SAT_DEF const char *sat_gl_glsl(void) { return sat__glsl_lookups; }

/* What the passes share. INPUT: 0 reads sums, 1 the caller's float texture, 2 the caller's unsigned one. The bits are
   asked for NaN, because compilers may assume that there is none. Rounding to nearest, ties to even, as the CPU
   does. */
static const char sat__glsl_values[] =
    "#if FORMAT == 0\n"
    "#define VALUE vec2\n"
    "#define ADD(a, b) sat_add(a, b, one)\n"
    "#define FETCH(t, p) texelFetch(t, p, 0).xy\n"
    "#define STORED(v) vec4(v, 0.0, 0.0)\n"
    "#else\n"
    "#define ADD(a, b) ((a) + (b))\n"
    "#define FETCH(t, p) texelFetch(t, p, 0).x\n"
    "#if FORMAT == 1\n"
    "#define VALUE float\n"
    "#define STORED(v) vec4(v, 0.0, 0.0, 0.0)\n"
    "#else\n"
    "#define VALUE uint\n"
    "#define STORED(v) uvec4(v, 0u, 0u, 0u)\n"
    "#endif\n"
    "#endif\n"
    "#if FORMAT == 2\n"
    "#define SUMS usampler2D\n"
    "#else\n"
    "#define SUMS sampler2D\n"
    "#endif\n"
    "#if INPUT == 1\n"
    SAT__GLSL(uniform sampler2D source;)
    "#elif INPUT == 2\n"
    SAT__GLSL(uniform usampler2D source;)
    "#else\n"
    SAT__GLSL(uniform SUMS source;)
    "#endif\n"
    SAT__GLSL(
        uniform float limit, scale;
        uniform ivec2 axis;
        uniform int size;
        float one;)
    "#if INPUT == 1\n"
    SAT__GLSL(
        VALUE load(ivec2 p) {
            float v = texelFetch(source, p, 0)[CHANNEL];
            v = (floatBitsToUint(v) & 0x7fffffffu) > 0x7f800000u ? 0.0 : clamp(v, -limit, limit);)
    "#if FORMAT == 0\n"
    SAT__GLSL(return vec2(v, 0.0);)
    "#elif FORMAT == 1\n"
    SAT__GLSL(return v;)
    "#else\n"
    SAT__GLSL(
            uint n = uint(roundEven(abs(v) * scale));
            return v < 0.0 ? 0u - n : n;)
    "#endif\n"
    SAT__GLSL(})
    "#elif INPUT == 2\n"
    SAT__GLSL(uint load(ivec2 p) { return texelFetch(source, p, 0)[CHANNEL]; })
    "#else\n"
    SAT__GLSL(VALUE load(ivec2 p) { return FETCH(source, p); })
    "#endif\n"
    SAT__GLSL(void start() { one = textureSize(source, 0).x > 0 ? 1.0 : 0.0; });

static const char sat__glsl_output[] =
    "#if FORMAT == 2\n"
    SAT__GLSL(layout(location = 0) out uvec4 result;)
    "#else\n"
    SAT__GLSL(layout(location = 0) out vec4 result;)
    "#endif\n";

/* Slomp 2012, section 4.4: `size` is the distance k^(i-1) of the neighbours; those left of the border are zero. */
static const char sat__glsl_double[] =
    SAT__GLSL(
        void main() {
            start();
            ivec2 p = ivec2(gl_FragCoord.xy);
            int x = p.x * axis.x + p.y * axis.y;
            VALUE sum = load(p);
            for (int j = 1; j < K; j++)
                if (x >= j * size) sum = ADD(sum, load(p - j * size * axis));
            result = STORED(sum);
        });

/* Slomp 2012, section 4.5, towards the root: the sum of k neighbours; `size` is the length that is read. */
static const char sat__glsl_reduce[] =
    SAT__GLSL(
        void main() {
            start();
            ivec2 p = ivec2(gl_FragCoord.xy) * (1 + (K - 1) * axis);
            int x = p.x * axis.x + p.y * axis.y;
            VALUE sum = load(p);
            for (int j = 1; j < K; j++)
                if (x + j < size) sum = ADD(sum, load(p + j * axis));
            result = STORED(sum);
        });

/* The same section, towards the leaves, inclusive: the uncle to the left, which holds the sum of all before this group,
   plus the node itself and its siblings to the left. The root's children have no uncle. */
static const char sat__glsl_expand[] =
    SAT__GLSL(
        uniform SUMS uncles;
        void main() {
            start();
            ivec2 p = ivec2(gl_FragCoord.xy);
            int x = p.x * axis.x + p.y * axis.y, group = x / K;
            VALUE sum = load(p - (x - group * K) * axis);
            for (int j = 1; j < K; j++)
                if (group * K + j <= x) sum = ADD(sum, load(p + (group * K + j - x) * axis));
            if (group > 0) sum = ADD(FETCH(uncles, p + (group - 1 - x) * axis), sum);
            result = STORED(sum);
        });

/* The same by compute shader: an invocation writes a whole group and adds k times instead of k (k + 1) / 2. */
static const char sat__glsl_expand_groups[] =
    SAT__GLSL(layout(local_size_x = 64) in;)
    "#if FORMAT == 0\n"
    SAT__GLSL(layout(binding = 0, rg32f) writeonly uniform image2D target;)
    "#elif FORMAT == 1\n"
    SAT__GLSL(layout(binding = 0, r32f) writeonly uniform image2D target;)
    "#else\n"
    SAT__GLSL(layout(binding = 0, r32ui) writeonly uniform uimage2D target;)
    "#endif\n"
    SAT__GLSL(
        uniform SUMS uncles;
        uniform int across;
        void main() {
            start();
            int group = int(gl_GlobalInvocationID.y);
            ivec2 line = int(gl_GlobalInvocationID.x) * (1 - axis);
            if (int(gl_GlobalInvocationID.x) >= across) return;
            VALUE sum = VALUE(0);
            if (group > 0) sum = FETCH(uncles, line + (group - 1) * axis);
            for (int x = group * K; x < min(group * K + K, size); x++) {
                sum = ADD(sum, load(line + x * axis));
                imageStore(target, line + x * axis, STORED(sum));
            }
        });

/* The mean: k x k texels a step, always two-float. `bounds` is the size that is read. */
static const char sat__glsl_mean[] =
    SAT__GLSL(
        uniform ivec2 bounds;
        uniform float factor;
        void main() {
            start();
            ivec2 first = ivec2(gl_FragCoord.xy) * K, last = min(first + K, bounds);
            vec2 sum = vec2(0.0);
            for (int y = first.y; y < last.y; y++)
                for (int x = first.x; x < last.x; x++) sum = sat_add(sum, load(ivec2(x, y)), one);
            result = STORED(sum * factor);
        });

/* ---- >> shaders of tiles

   The table of SAT_KIND_TILED in passes that stay inside a tile: a row of a tile is gauged (the four lanes of the CPU,
   row by row, so that the sums round alike), a tile settles its quantum and its spikes, integers are summed along the
   rows and down the columns by eights (32 = 8 x 4), and whole tiles make the strips. All targets are unsigned
   integers, which ES 3.0 can draw to without an extension; floats travel as their bits. A plane is a channel, or with
   moments x - m or its square.

   Lookups: the sum of the parts in at most 3 x 3 tiles, or four corners in each super tile of 32 x 32 tiles. `strips`
   is a row-major array in a texture, whose parts sat_at finds: left, above and whole of the CPU table, as the bits
   of doubles; the slot of each tile in the pool; the giants of each tile row, behind their number; their number in a
   super tile row; the pool of 64-bit tiles. */

static const char sat__glsl_tile_numbers[] =
    "#ifndef SAT_GLSL_NUMBERS\n"
    "#define SAT_GLSL_NUMBERS\n"
    "#ifdef GL_ES\n"
    SAT__GLSL(precision highp usampler2DArray;)
    "#endif\n"
    SAT__GLSL(
        /* width, height and planes of the table, which may be less than its textures have room for */
        ivec3 sat_shape(usampler2DArray tiles) {
            return ivec3(texelFetch(tiles, ivec3(textureSize(tiles, 0).x - 1, 0, 0), 0).xyz);
        })
    SAT__GLSL(
        uvec2 sat_left64(uvec2 v, int n) {
            return n == 0 ? v : n > 31 ? uvec2(0u, v.x << (n - 32)) : uvec2(v.x << n, v.y << n | v.x >> (32 - n));
        }
        uvec2 sat_right64(uvec2 v, int n) {
            uvec2 r = n == 0 ? v : n > 63 ? uvec2(0u) : n > 31 ? uvec2(v.y >> (n - 32), 0u)
                      : uvec2(v.x >> n | v.y << (32 - n), v.y >> n);
            if (n > 63 ? v != uvec2(0u) : sat_left64(r, n) != v) r.x |= 1u;
            return r;
        }
        uvec2 sat_add64(uvec2 a, uvec2 b) {
            uint low = a.x + b.x;
            return uvec2(low, a.y + b.y + (low < a.x ? 1u : 0u));
        }
        uvec2 sat_negate64(uvec2 v) { return sat_add64(~v, uvec2(1u, 0u)); })
    SAT__GLSL(
        uvec2 sat_to_double(uint negative, int exponent, uvec2 m) {
            if (m == uvec2(0u)) return m;
            int top = m.y > 0u ? 63 : 31;
            uint word = m.y > 0u ? m.y : m.x;
            if (word < 65536u) word <<= 16, top -= 16;
            if (word < 16777216u) word <<= 8, top -= 8;
            while (word < 2147483648u) word <<= 1, top--;
            m = top > 55 ? sat_right64(m, top - 55) : sat_left64(m, 55 - top);
            exponent += top - 52;
            uint rest = m.x & 7u;
            m = uvec2(m.x >> 3 | m.y << 29, m.y >> 3);
            if (rest > 4u || (rest == 4u && (m.x & 1u) > 0u)) m = sat_add64(m, uvec2(1u, 0u));
            return uvec2(m.x, (m.y + (uint(exponent + 1074) << 20)) | negative << 31);
        })
    SAT__GLSL(
        float sat_power(int k) { return k < -126 ? 0.0 : uintBitsToFloat(uint(min(k, 127) + 127) << 23); }
        vec2 sat_floats(uvec2 d) {
            int k = int(d.y >> 20 & 2047u) - 1046;
            uint high = ((d.y & 1048575u) | 1048576u) << 3 | d.x >> 29;
            vec2 v = vec2(float(high) * sat_power(k), float(d.x & 536870911u) * sat_power(k - 29));
            return k == -1046 ? vec2(0.0) : d.y > 2147483647u ? -v : v;
        })
    SAT__GLSL(
        int sat_at(int which, ivec2 size, int planes) {
            ivec2 n = (size + 31) / 32;
            int supers = (n.y + 31) / 32 * planes, bands = n.y * planes, at = 0;
            if (which > 0) at += n.x * planes * size.y;
            if (which > 1) at += size.x * bands;
            if (which > 2) at += n.x * bands;
            if (which > 3) at += n.x * bands;
            if (which > 4) at += (1 + clamp(size.x, 8, 64)) * bands;
            if (which > 5) at += supers;
            if (which > 6) at += (n.x + 2) * supers * min(size.x, 32) * 32;
            return at;
        }
        uvec2 sat_cell(usampler2D strips, int index) {
            int pitch = textureSize(strips, 0).x;
            return texelFetch(strips, ivec2(index % pitch, index / pitch), 0).xy;
        }
        int sat_wide_exponent(uint quantum) { return max(int(quantum >> 23) - 158, -149); })
    SAT__GLSL(
        vec2 sat_wide_part(usampler2D strips, int width, int base, uint quantum, ivec2 a, ivec2 b) {
            int stride = min(width, 32), low = base + (b.y - 1) * stride - 1, top = low - (b.y - a.y) * stride;
            uvec2 d = sat_cell(strips, low + b.x), less = uvec2(0u);
            if (a.x > 0) less = sat_cell(strips, low + a.x);
            if (a.y > 0) less = sat_add64(less, sat_cell(strips, top + b.x));
            if (a.x > 0 && a.y > 0) d = sat_add64(d, sat_cell(strips, top + a.x));
            d = sat_add64(d, sat_negate64(less));
            uint negative = d.y >> 31;
            if (negative > 0u) d = sat_negate64(d);
            return sat_floats(sat_to_double(negative, sat_wide_exponent(quantum), d));
        })
    SAT__GLSL(
        vec2 sat_giants(usampler2D strips, ivec2 size, int planes, int plane, ivec2 a, ivec2 b, float one) {
            int room = clamp(size.x, 8, 64), supers = sat_at(5, size, planes), list = sat_at(4, size, planes);
            vec2 sum = vec2(0.0);
            for (int band = a.y >> 5; band <= (b.y - 1) >> 5; band++) {
                if (sat_cell(strips, supers + (band >> 5) * planes + plane).x == 0u) {
                    band |= 31;
                    continue;
                }
                int at = list + (band * planes + plane) * (1 + room), count = int(sat_cell(strips, at).x);
                for (int i = 1; i <= count; i++) {
                    uvec2 g = sat_cell(strips, at + i);
                    ivec2 p = ivec2(int(g.x & 67108863u), band * 32 + int(g.x >> 26));
                    if (all(greaterThanEqual(p, a)) && all(lessThan(p, b)))
                        sum = sat_add(sum, vec2(uintBitsToFloat(g.y), 0.0), one);
                }
            }
            return sum;
        })
    "#endif\n";

static const char sat__glsl_tile_lookups[] =
    "#ifndef SAT_GLSL_TILES\n"
    "#define SAT_GLSL_TILES\n"
    SAT__GLSL(
        vec2 sat_tile_part(usampler2D cells, usampler2DArray tiles, usampler2D strips, ivec3 shape, int plane,
                           ivec2 tile, ivec2 a, ivec2 b, float one) {
            ivec2 first = tile * 32, size = shape.xy;
            int across = (size.x + 31) / 32, planes = shape.z;
            ivec2 at = ivec2(tile.x + plane * across, tile.y);
            uvec4 record = texelFetch(tiles, ivec3(at, 0), 0);
            float quantum = uintBitsToFloat(record.x);
            int count = int(record.z & 15u), slot = 0;
            vec2 sum;
            if (record.z >> 30 > 0u)
                slot = int(sat_cell(strips, sat_at(3, size, planes) + (tile.y * planes + plane) * across
                                                  + tile.x).x);
            if (slot > 0)
                sum = sat_wide_part(strips, size.x, sat_at(6, size, planes) + (slot - 1) * min(size.x, 32) * 32,
                                    record.x, a - first, b - first);
            else {
                uint d = texelFetch(cells, b - 1, 0)[plane];
                if (a.x > first.x) d -= texelFetch(cells, ivec2(a.x, b.y) - 1, 0)[plane];
                if (a.y > first.y) d -= texelFetch(cells, ivec2(b.x, a.y) - 1, 0)[plane];
                if (a.x > first.x && a.y > first.y) d += texelFetch(cells, a - 1, 0)[plane];
                int n = int(d), low = n & 4095;
                sum = sat_add(vec2(float(n - low) * quantum, 0.0), vec2(float(low) * quantum, 0.0), one);
            }
            for (int i = 0; i < count; i++) {
                uint word = texelFetch(tiles, ivec3(at, 1), 0)[i / 2] >> (14 * (i & 1));
                ivec2 p = first + ivec2(int(word & 127u), int(word >> 7 & 127u));
                if (all(greaterThanEqual(p, a)) && all(lessThan(p, b)))
                    sum = sat_add(sum, vec2(uintBitsToFloat(texelFetch(tiles, ivec3(at, 2 + i / 4), 0)[i & 3]), 0.0),
                                  one);
            }
            return sum;
        })
    SAT__GLSL(
        vec2 sat_corner(usampler2D cells, usampler2DArray tiles, usampler2D strips, ivec3 shape, int plane,
                        ivec2 first, ivec2 p, float one) {
            ivec2 size = shape.xy, t = p >> 5, inside = p & 31;
            int across = (size.x + 31) / 32, planes = shape.z;
            int row = (t.y - 1) * planes + plane;
            int above = sat_at(1, size, planes), whole = sat_at(2, size, planes);
            bool x = t.x > first.x, y = t.y > first.y;
            vec2 sum = vec2(0.0);
            if (x && y) sum = sat_floats(sat_cell(strips, whole + row * across + t.x - 1));
            if (y && inside.x > 0)
                sum = sat_add(sum, sat_floats(sat_cell(strips, above + row * size.x + p.x - 1)), one);
            if (x && inside.y > 0)
                sum = sat_add(sum, sat_floats(sat_cell(strips, ((p.y - 1) * planes + plane) * across
                                                                         + t.x - 1)), one);
            if (inside.x > 0 && inside.y > 0)
                sum = sat_add(sum, sat_tile_part(cells, tiles, strips, shape, plane, t, t * 32, p, one), one);
            return sum;
        })
    SAT__GLSL(
        float sat_sum(usampler2D cells, usampler2DArray tiles, usampler2D strips, int channel, ivec2 low, ivec2 high) {
            ivec3 shape = sat_shape(tiles);
            ivec2 size = shape.xy, a = clamp(low, ivec2(0), size), b = clamp(high, ivec2(0), size), p, q;
            float one = size.x > 0 ? 1.0 : 0.0;
            if (any(lessThanEqual(b, a))) return 0.0;
            ivec2 s = a >> 5, e = (b - 1) >> 5;
            vec2 sum = vec2(0.0);
            vec2 giants = sat_giants(strips, size, shape.z, channel, a, b, one);
            if (all(lessThan(e - s, ivec2(3)))) {
                for (int y = s.y; y <= e.y; y++)
                    for (int x = s.x; x <= e.x; x++)
                        sum = sat_add(sum, sat_tile_part(cells, tiles, strips, shape, channel, ivec2(x, y),
                                                         max(a, ivec2(x, y) * 32), min(b, ivec2(x + 1, y + 1) * 32),
                                                         one), one);
                sum = sat_add(sum, giants, one);
                return sum.x + sum.y;
            }
            for (p.y = a.y; p.y < b.y; p.y = q.y) {
                q.y = min(b.y, (p.y | 1023) + 1);
                for (p.x = a.x; p.x < b.x; p.x = q.x) {
                    q.x = min(b.x, (p.x | 1023) + 1);
                    ivec2 f = (p >> 10) << 5;
                    vec2 v = sat_corner(cells, tiles, strips, shape, channel, f, q, one);
                    v = sat_add(v, -sat_corner(cells, tiles, strips, shape, channel, f, ivec2(p.x, q.y), one), one);
                    vec2 u = sat_corner(cells, tiles, strips, shape, channel, f, ivec2(q.x, p.y), one);
                    u = sat_add(u, -sat_corner(cells, tiles, strips, shape, channel, f, p, one), one);
                    sum = sat_add(sum, sat_add(v, -u, one), one);
                }
            }
            sum = sat_add(sum, giants, one);
            return sum.x + sum.y;
        })
    SAT__GLSL(
        float sat_mean(usampler2D cells, usampler2DArray tiles, usampler2D strips, int channel, ivec2 low, ivec2 high) {
            return sat_sum(cells, tiles, strips, channel, low, high) / sat_area(sat_shape(tiles).xy, low, high);
        })
    "#endif\n";

/* ---- >> shaders that build tiles */

static const char sat__glsl_tile_values[] =
    SAT__GLSL(
        uniform sampler2D source;
        uniform usampler2D cells, gauges, facts, means;
        uniform usampler2DArray tiles;
        uniform ivec2 size;
        uniform int pitch;
        uniform float limit;
        int across() { return (size.x + 31) / 32; }
        int room() { return MOMENTS > 0 ? 0 : clamp(size.x, 8, 64); })
    SAT__GLSL(
        float pixel(ivec2 p, int plane, out int kind) {
            float v = texelFetch(source, p, 0)[CHANNEL + plane % CHANNELS];
            uint bits = floatBitsToUint(v) & 0x7fffffffu;
            kind = bits > 0x7f800000u ? 1 : bits == 0x7f800000u ? 2 : bits > floatBitsToUint(limit) ? 3 : 0;
            v = kind == 1 ? 0.0 : clamp(v, -limit, limit);
            return v;
        })
    "#if MOMENTS\n"
    SAT__GLSL(
        float about(float v, float mean, int plane, int kind) {)
    "#if __VERSION__ >= 400\n"
    SAT__GLSL(precise float square;)
    "#else\n"
    SAT__GLSL(float square;)
    "#endif\n"
    SAT__GLSL(
            v -= mean;
            if (kind == 1 || kind == 2 || abs(v) > 1e18) v = 0.0;
            square = v * v;
            return plane < CHANNELS ? v : square;
        }
        float value(ivec2 p, int plane, out int kind) {
            float v = pixel(p, plane, kind);
            ivec2 tile = ivec2(p.x / 32 + across() * (plane % CHANNELS), p.y / 32);
            return about(v, uintBitsToFloat(texelFetch(means, tile, 0).x), plane, kind);
        })
    "#else\n"
    "#define value pixel\n"
    "#endif\n";

static const char sat__glsl_tile_means[] =
    SAT__GLSL(
        layout(location = 0) out uvec4 result;
        void main() {
            ivec2 at = ivec2(gl_FragCoord.xy), first = ivec2(at.x % across(), at.y) * 32, last = min(first + 32, size);
            int kind;
            float sum = 0.0, count = 0.0;
            for (int y = first.y; y < last.y; y++) {
                float row = 0.0;
                for (int x = first.x; x < last.x; x++) {
                    float v = pixel(ivec2(x, y), at.x / across(), kind);
                    if (kind == 1 || kind == 2) continue;
                    row += v;
                    count += 1.0;
                }
                sum += row;
            }
            result = uvec4(floatBitsToUint(count > 0.0 ? sum / count : 0.0), 0u, 0u, 0u);
        });

/* A row of a tile: sums of |value|, the largest and the smallest that is not 0, pixels beyond 1e20, and how many were
   replaced. */
static const char sat__glsl_gauge[] =
    SAT__GLSL(
        layout(location = 0) out uvec4 sums;
        layout(location = 1) out uvec4 fact;
        void main() {
            ivec2 at = ivec2(gl_FragCoord.xy);
            int plane = at.x / across(), first = at.x % across() * 32, kind, giants = 0;
            ivec3 counts = ivec3(0);
            float largest = 0.0, smallest = 3e38;
            vec4 lanes = vec4(0.0);
            for (int i = 0; i < 32; i += 4)
                for (int j = 0; j < 4; j++) {
                    if (first + i + j >= size.x) continue;
                    float v = abs(value(ivec2(first + i + j, at.y), plane, kind));
                    if (kind > 0) counts[kind - 1]++;
                    if (v > 1e20) {
                        giants++;
                        continue;
                    }
                    lanes[j] += v;
                    largest = max(largest, v);
                    if (v > 0.0) smallest = min(smallest, v);
                }
            sums = floatBitsToUint(lanes);
            fact = uvec4(floatBitsToUint(largest), uint(giants), uint(counts.x | counts.y << 8 | counts.z << 16),
                         floatBitsToUint(smallest));
        });

/* sat__take_giants, sat__take_spikes and sat__tile_quantum of the CPU; 8386931 is where sum * 1.0001 reaches the next
   power of two. A record: the quantum; what giants beyond the list become; spikes, NaN, infinities and whether 64-bit
   cells would help; clamped pixels, giants in the list, and the pixel from which on they are clamped. */
static const char sat__glsl_settle[] =
    SAT__GLSL(
        layout(location = 0) out uvec4 record;
        layout(location = 1) out uvec4 places;
        layout(location = 2) out uvec4 low_values;
        layout(location = 3) out uvec4 high_values;
        int count, rows, plane, cut;
        ivec2 at, first;
        float full;
        ivec2 place[8];
        float held[8];
        uvec4 fact(int y) { return texelFetch(facts, ivec2(at.x, first.y + y), 0); }
        bool is_spike(ivec2 p) {
            for (int i = 0; i < count; i++)
                if (place[i] == p) return true;
            return false;
        })
    SAT__GLSL(
        float rest(ivec2 p) {
            int kind;
            if (p.x >= size.x || is_spike(p)) return 0.0;
            float v = value(p, plane, kind);
            if (abs(v) > 1e20) return (p.y - first.y) * 32 + p.x - first.x < cut ? 0.0 : v > 0.0 ? full : -full;
            return v;
        }
        bool clamps(int y) { return (y + 1) * 32 > cut && fact(y).y > 0u; })
    SAT__GLSL(
        vec2 extent() {
            vec4 lanes = vec4(0.0);
            float largest = 0.0;
            for (int y = 0; y < rows; y++) {
                bool fresh = clamps(y);
                for (int i = 0; i < count; i++) fresh = fresh || place[i].y == first.y + y;
                if (!fresh) {
                    lanes += uintBitsToFloat(texelFetch(gauges, ivec2(at.x, first.y + y), 0));
                    largest = max(largest, uintBitsToFloat(fact(y).x));
                    continue;
                }
                vec4 row = vec4(0.0);
                for (int i = 0; i < 32; i += 4)
                    for (int j = 0; j < 4; j++) {
                        float v = abs(rest(first + ivec2(i + j, y)));
                        row[j] += v;
                        largest = max(largest, v);
                    }
                lanes += row;
            }
            return vec2(((lanes.x + lanes.y) + lanes.z) + lanes.w, largest);
        })
    SAT__GLSL(
        int list_giants(int giants) {
            int before = 0, listed, y, x, kind;
            for (x = plane * across(); x < at.x && before < room(); x++)
                for (y = 0; y < rows; y++) before += int(texelFetch(facts, ivec2(x, first.y + y), 0).y);
            listed = clamp(room() - before, 0, giants);
            if (listed == giants) return listed;
            cut = 0;
            before = listed;
            for (y = 0; y < rows; y++) {
                int n = int(fact(y).y);
                if (n <= before) {
                    before -= n;
                    cut = 32 * y + 32;
                    continue;
                }
                for (x = 0; before > 0; x++)
                    if (abs(value(first + ivec2(x, y), plane, kind)) > 1e20) {
                        before--;
                        cut = 32 * y + x + 1;
                    }
                break;
            }
            return listed;
        })
    SAT__GLSL(
        void take_spikes(inout vec2 e) {
            while (e.y > e.x * 0.0625 && count < 8) {
                int found = 0, left = 8 - count;
                ivec2 p;
                for (p.y = first.y; p.y < first.y + rows && found <= left; p.y++) {
                    int y = p.y - first.y;
                    if (!(max(uintBitsToFloat(fact(y).x), clamps(y) ? full : 0.0) > e.x * 0.0625)) continue;
                    for (p.x = first.x; p.x < min(first.x + 32, size.x) && found <= left; p.x++) {
                        float v = rest(p);
                        if (!(abs(v) > e.x * 0.0625)) continue;
                        if (found < left) {
                            place[count + found] = p;
                            held[count + found] = v;
                        }
                        found++;
                    }
                }
                if (found > left) break;
                count += found;
                vec2 less = extent();
                if (less.x > e.x * 0.25) {
                    count -= found;
                    break;
                }
                e = less;
            }
        })
    SAT__GLSL(
        uint wants_wide(float threshold) {
            int found = 0;
            for (int y = 0; y < rows && found < 8; y++) {
                if (!(uintBitsToFloat(fact(y).w) < threshold)) continue;
                for (int x = 0; x < 32; x++) {
                    float v = abs(rest(first + ivec2(x, y)));
                    if (v > 0.0 && v < threshold) found++;
                }
            }
            return found < 8 ? 0u : 1u;
        })
    SAT__GLSL(
        void main() {
            at = ivec2(gl_FragCoord.xy);
            plane = at.x / across();
            first = ivec2(at.x % across(), at.y) * 32;
            rows = min(32, size.y - first.y);
            count = 0;
            cut = 1024;
            full = 0.0;
            int giants = 0, listed = 0;
            ivec3 counts = ivec3(0);
            for (int y = 0; y < rows; y++) {
                uvec4 f = fact(y);
                full = max(full, uintBitsToFloat(f.x));
                giants += int(f.y);
                counts += ivec3(int(f.z & 255u), int(f.z >> 8 & 255u), int(f.z >> 16));
            }
            if (!(full > 0.0)) full = 65504.0;
            if (giants > 0) listed = list_giants(giants);
            vec2 e = extent();
            take_spikes(e);
            uint bits = floatBitsToUint(e.x), exponent = (bits >> 23) + ((bits & 0x7fffffu) >= 8386931u ? 1u : 0u);
            record = uvec4(e.x > 0.0 ? max(exponent, 31u) - 30u << 23 : 0u, floatBitsToUint(full),
                           uint(count | counts.x << 4 | counts.y << 17) | wants_wide(e.x / 262144.0) << 30,
                           uint(counts.z + giants - listed | listed << 12) | uint(cut) << 20);
            uvec4 words = uvec4(0u), low = uvec4(0u), high = uvec4(0u);
            for (int i = 0; i < count; i++) {
                ivec2 p = place[i] - first;
                words[i / 2] |= uint(p.x | p.y << 7) << (14 * (i & 1));
                if (i < 4) low[i] = floatBitsToUint(held[i]);
                else high[i - 4] = floatBitsToUint(held[i]);
            }
            places = words;
            low_values = low;
            high_values = high;
        });

/* What the cells of a tile sum: no spikes, no giants. */
static const char sat__glsl_tile_output[] = SAT__GLSL(layout(location = 0) out uvec4 result;);
static const char sat__glsl_tile_kept[] =
    SAT__GLSL(
        float kept(ivec2 p, int plane, out uint quantum) {
            ivec3 at = ivec3(p.x / 32 + plane * across(), p.y / 32, 0);
            uvec4 record = texelFetch(tiles, at, 0);
            int kind, count = int(record.z & 15u);
            float v = value(p, plane, kind), full = uintBitsToFloat(record.y);
            quantum = record.x;
            if (quantum == 0u) return 0.0;
            if (abs(v) > 1e20) v = p.y % 32 * 32 + p.x % 32 < int(record.w >> 20) ? 0.0 : v > 0.0 ? full : -full;
            for (int i = 0; i < count; i++) {
                uint word = texelFetch(tiles, at + ivec3(0, 0, 1), 0)[i / 2] >> (14 * (i & 1));
                if (ivec2(int(word & 127u), int(word >> 7 & 127u)) == p % 32) return 0.0;
            }
            return v;
        });

static const char sat__glsl_tile_scan[] =
    SAT__GLSL(uniform ivec2 axis;)
    "#if INPUT\n"
    SAT__GLSL(
        uvec4 load(ivec2 p) {
            uvec4 v = uvec4(0u);
            for (int plane = 0; plane < PLANES; plane++) {
                uint quantum;
                float k = kept(p, plane, quantum);
                if (quantum > 0u) v[plane] = uint(int(roundEven(k * uintBitsToFloat((254u << 23) - quantum))));
            }
            return v;
        })
    "#else\n"
    SAT__GLSL(uvec4 load(ivec2 p) { return texelFetch(cells, p, 0); })
    "#endif\n"
    SAT__GLSL(
        void main() {
            ivec2 p = ivec2(gl_FragCoord.xy);
            int step = axis.x + axis.y, from = ((axis.x > 0 ? p.x : p.y) & 31);
            uvec4 sum = uvec4(0u);
            for (int d = 0; d < 8 * step && d <= from; d += step)
                sum += load(p - (axis.x > 0 ? ivec2(d, 0) : ivec2(0, d)));
            result = sum;
        });

/* Slots go to the tiles that want one, in the order of the tile rows of a super tile row. */
static const char sat__glsl_slots[] =
    SAT__GLSL(
        bool wants(int x, int y) { return texelFetch(tiles, ivec3(x, y, 0), 0).z >> 30 > 0u; }
        void main() {
            ivec2 at = ivec2(gl_FragCoord.xy);
            int n = across(), plane = at.x / n, before = 0, supers = ((size.y + 31) / 32 + 31) / 32;
            result = uvec4(0u);
            if (!wants(at.x, at.y)) return;
            for (int y = at.y & ~31; y <= at.y && before < n + 2; y++)
                for (int x = plane * n; x < (y < at.y ? plane * n + n : at.x); x++) before += wants(x, y) ? 1 : 0;
            if (before < n + 2) result.x = uint((plane * supers + at.y / 32) * (n + 2) + before + 1);
        });

/* The tile of each slot, from 1: its place in a row of tiles, and the row. */
static const char sat__glsl_owners[] =
    SAT__GLSL(
        void main() {
            ivec2 at = ivec2(gl_FragCoord.xy);
            int n = across(), down = (size.y + 31) / 32, supers = (down + 31) / 32, plane = at.y / supers;
            uint slot = uint(at.y * (n + 2) + at.x + 1);
            result = uvec4(0u);
            for (int y = at.y % supers * 32; y < min(down, at.y % supers * 32 + 32); y++)
                for (int x = plane * n; x < plane * n + n; x++)
                    if (texelFetch(cells, ivec2(x, y), 0).x == slot) result = uvec4(x + 1, y, 0, 0);
        });

static const char sat__glsl_wide_integer[] =
    SAT__GLSL(
        uvec2 integer(float v, int exponent) {
            uint bits = floatBitsToUint(v), m = bits & 0x7fffffu, e = bits >> 23 & 255u;
            if (e > 0u) m |= 0x800000u;
            int shift = int(max(e, 1u)) - 150 - exponent;
            uvec2 n = uvec2(m, 0u);
            if (shift < -24) n.x = 0u;
            else if (shift < 0) {
                uint half_of = 1u << (-shift - 1), rest = m & (2u * half_of - 1u);
                n.x = m >> -shift;
                if (rest > half_of || (rest == half_of && (n.x & 1u) > 0u)) n.x++;
            } else n = sat_left64(n, shift);
            return bits > 0x7fffffffu ? sat_negate64(n) : n;
        });

/* A 64-bit cell: the sum of its tile up to it. */
static const char sat__glsl_wide[] =
    SAT__GLSL(
        void main() {
            int stride = min(size.x, 32), i = int(gl_FragCoord.y) * pitch + int(gl_FragCoord.x);
            int slot = i / (stride * 32), n = across() + 2;
            uvec2 sum = uvec2(0u), owner = texelFetch(cells, ivec2(slot % n, slot / n), 0).xy;
            result = uvec4(0u);
            if (slot / n >= (size.y + 1023) / 1024 * PLANES || owner.x == 0u) return;
            int plane = (int(owner.x) - 1) / across(), x, y;
            ivec2 first = ivec2((int(owner.x) - 1) % across(), owner.y) * 32;
            ivec2 last = ivec2(i % stride, i / stride % 32);
            for (y = 0; y <= last.y; y++)
                for (x = 0; x <= last.x; x++) {
                    uint quantum;
                    ivec2 p = first + ivec2(x, y);
                    if (any(greaterThanEqual(p, size))) continue;
                    float v = kept(p, plane, quantum);
                    if (quantum > 0u) sum = sat_add64(sum, integer(v, sat_wide_exponent(quantum)));
                }
            result = uvec4(sum, 0u, 0u);
        });

/* The sums of doubles are those of the CPU, in its order: `gauges` are the slots, `facts` the 64-bit cells. */
static const char sat__glsl_strip_sums[] =
    SAT__GLSL(
        uvec2 add(uvec2 a, uvec2 b) {
            if ((a.y << 1 | a.x) == 0u) return b;
            if ((b.y << 1 | b.x) == 0u) return a;
            uint high = a.y & 0x7fffffffu, other = b.y & 0x7fffffffu;
            if (high < other || (high == other && a.x < b.x)) {
                uvec2 c = a;
                a = b;
                b = c;
            }
            int e = int(a.y >> 20 & 2047u), d = e - int(b.y >> 20 & 2047u);
            uvec2 m = sat_left64(uvec2(a.x, (a.y & 0xfffffu) | 0x100000u), 3);
            uvec2 n = sat_right64(sat_left64(uvec2(b.x, (b.y & 0xfffffu) | 0x100000u), 3), d);
            m = sat_add64(m, (a.y ^ b.y) > 0x7fffffffu ? sat_negate64(n) : n);
            return sat_to_double(a.y >> 31, e - 1078, m);
        })
    SAT__GLSL(
        uvec2 of_float(uint bits) {
            uint e = bits >> 23 & 255u;
            return sat_to_double(bits >> 31, int(max(e, 1u)) - 150,
                                 uvec2((bits & 0x7fffffu) | (e > 0u ? 0x800000u : 0u), 0u));
        }
        uvec2 cell(uvec4 record, int plane, ivec2 t, ivec2 p) {
            int stride = min(size.x, 32), exponent = int(record.x >> 23) - 127;
            uint slot = texelFetch(gauges, ivec2(t.x + plane * across(), t.y), 0).x, negative;
            uvec2 d = uvec2(0u);
            if (slot > 0u) {
                int i = ((int(slot) - 1) * 32 + p.y % 32) * stride + p.x % 32;
                d = texelFetch(facts, ivec2(i % pitch, i / pitch), 0).xy;
                negative = d.y >> 31;
                if (negative > 0u) d = sat_negate64(d);
                exponent = sat_wide_exponent(record.x);
            } else {
                d.x = texelFetch(cells, p, 0)[plane];
                negative = d.x >> 31;
                if (negative > 0u) d.x = 0u - d.x;
            }
            return sat_to_double(negative, exponent, d);
        })
    SAT__GLSL(
        uvec2 part(int plane, ivec2 t, ivec2 p, bool one_by_one) {
            ivec2 at = ivec2(t.x + plane * across(), t.y);
            uvec4 record = texelFetch(tiles, ivec3(at, 0), 0), words = texelFetch(tiles, ivec3(at, 1), 0);
            uvec2 sum = cell(record, plane, t, p), spikes = uvec2(0u);
            one_by_one = one_by_one && texelFetch(gauges, at, 0).x == 0u;
            for (int i = 0; i < int(record.z & 15u); i++) {
                uint word = words[i / 2] >> (14 * (i & 1));
                if (int(word & 127u) > p.x % 32 || int(word >> 7 & 127u) > p.y % 32) continue;
                uvec2 v = of_float(texelFetch(tiles, ivec3(at, 2 + i / 4), 0)[i & 3]);
                if (one_by_one) sum = add(sum, v);
                else spikes = add(spikes, v);
            }
            return add(sum, spikes);
        });

static const char sat__glsl_strips[] =
    SAT__GLSL(
        uvec2 left(int plane, int x, int y) {
            uvec2 run = uvec2(0u);
            for (int t = x & ~31; t <= x; t++)
                run = add(run, part(plane, ivec2(t, y / 32), ivec2(min(t * 32 + 31, size.x - 1), y), false));
            return run;
        }
        uvec2 above(int plane, int x, int band) {
            uvec2 sum = uvec2(0u);
            for (int b = band & ~31; b <= band; b++)
                sum = add(part(plane, ivec2(x / 32, b), ivec2(x, min(b * 32 + 31, size.y - 1)), true), sum);
            return sum;
        }
        uvec2 whole(int plane, int x, int band) {
            uvec2 sum = uvec2(0u);
            for (int b = band & ~31; b <= band; b++) {
                uvec2 run = uvec2(0u);
                for (int t = x & ~31; t <= x; t++)
                    run = add(run, part(plane, ivec2(t, b), min(ivec2(t, b) * 32 + 31, size - 1), true));
                sum = add(sum, run);
            }
            return sum;
        })
    SAT__GLSL(
        int listed(int x, int band) { return int(texelFetch(tiles, ivec3(x, band, 0), 0).w >> 12 & 255u); }
        uvec2 giant(int plane, int band, int which) {
            int n = across(), t, kind, before = 0;
            for (t = 0; t < n && (which == 0 || before + listed(plane * n + t, band) < which); t++)
                before += listed(plane * n + t, band);
            if (which == 0) return uvec2(before, 0);
            if (t == n) return uvec2(0u);
            for (int y = band * 32; y < min(band * 32 + 32, size.y); y++)
                for (int x = t * 32; x < min(t * 32 + 32, size.x); x++) {
                    float v = value(ivec2(x, y), plane, kind);
                    if (abs(v) > 1e20 && ++before == which)
                        return uvec2(uint(x) | uint(y % 32) << 26, floatBitsToUint(v));
                }
            return uvec2(0u);
        })
    SAT__GLSL(
        void main() {
            int i = int(gl_FragCoord.y) * pitch + int(gl_FragCoord.x), n = across(), section = 0;
            int counts[7] = int[7](n, size.x, n, n, 1 + clamp(size.x, 8, 64), 1, 1), row, plane, x, y;
            while (section < 7 && i >= sat_at(section + 1, size, PLANES)) section++;
            i -= sat_at(section, size, PLANES);
            result = uvec4(0u);
            if (section > 6) return;
            row = i / counts[section];
            x = i % counts[section];
            y = row / PLANES;
            plane = row % PLANES;
            if (RUNS == 0 && section == 0) result.xy = left(plane, x, y);
            if (RUNS == 0 && section == 1) result.xy = above(plane, x, y);
            if (RUNS == 0 && section == 2) result.xy = whole(plane, x, y);
            if (section == 3) result.x = texelFetch(gauges, ivec2(x + plane * n, y), 0).x;
            if (section == 4) result.xy = giant(plane, y, x);
            if (section == 5)
                for (int b = y * 32; b < min(y * 32 + 32, (size.y + 31) / 32); b++)
                    result.x += giant(plane, b, 0).x;
            if (section == 6) result = texelFetch(facts, ivec2(i % pitch, i / pitch), 0);
        });

/* ---- >> shaders of work groups: tiles and strips by compute shaders */

/* A work group a tile: means, gauges, quantum, spikes and integers of a plane after the other in shared memory. A lane
   is a fourth of a row, as on the CPU. Only a tile with giants reads more than itself: it counts those before it. */
static const char sat__glsl_group[] =
    SAT__GLSL(
        layout(local_size_x = 128) in;
        layout(binding = 0, rgba32ui) writeonly uniform uimage2DArray tiles_out;
        layout(binding = 1, CELL) writeonly uniform uimage2D cells_out;)
    "#if MOMENTS\n"
    SAT__GLSL(layout(binding = 2, r32ui) writeonly uniform uimage2D means_out;)
    "#else\n"
    SAT__GLSL(float about(float v, float mean, int plane, int kind) { return v; })
    "#endif\n"
    SAT__GLSL(
        shared float held[1024], lanes[128], lane_sums[4], mean_of[CHANNELS], taken[8];
        shared uint summed[PLANES * 1024], counted, largest;
        shared int place[8], first_clamped;
        int lane, cut, count;
        ivec2 tile, first;
        ivec2 at(int i) { return first + ivec2(i % 32, i / 32); }
        bool is_inside(int i) { return all(lessThan(at(i), size)); })
    SAT__GLSL(
        uint sum_of(uint mine) {
            barrier();
            if (lane == 0) counted = 0u;
            barrier();
            if (mine > 0u) atomicAdd(counted, mine);
            barrier();
            return counted;
        }
        float largest_of(float mine) {
            barrier();
            if (lane == 0) largest = 0u;
            barrier();
            atomicMax(largest, floatBitsToUint(mine));
            barrier();
            return uintBitsToFloat(largest);
        })
    "#if MOMENTS\n"
    SAT__GLSL(
        void find_mean(int channel) {
            uint usable = 0u;
            int kind;
            barrier();
            for (int i = lane; i < 1024; i += 128) {
                held[i] = is_inside(i) ? pixel(at(i), channel, kind) : 0.0;
                if (!is_inside(i)) continue;
                if (kind == 1 || kind == 2) held[i] = 0.0;
                else usable++;
            }
            usable = sum_of(usable);
            if (lane < 32) {
                float row = 0.0;
                for (int x = 0; x < 32; x++) row += held[32 * lane + x];
                lanes[lane] = row;
            }
            barrier();
            if (lane == 0) {
                float sum = 0.0;
                for (int y = 0; y < 32; y++) sum += lanes[y];
                mean_of[channel] = usable > 0u ? sum / float(usable) : 0.0;
                imageStore(means_out, ivec2(tile.x + across() * channel, tile.y),
                           uvec4(floatBitsToUint(mean_of[channel]), 0u, 0u, 0u));
            }
            barrier();
        })
    "#endif\n"
    SAT__GLSL(
        /* NaN and infinities; clamped pixels and giants: two numbers of 16 bits each */
        uvec2 load(int plane, out float full) {
            uvec2 bad = uvec2(0u);
            float most = 0.0;
            barrier();
            for (int i = lane; i < 1024; i += 128) {
                int kind;
                float v = 0.0;
                if (is_inside(i)) {
                    v = pixel(at(i), plane, kind);
                    v = about(v, mean_of[plane % CHANNELS], plane, kind);
                    if (kind == 1) bad.x++;
                    if (kind == 2) bad.x += 65536u;
                    if (kind == 3) bad.y++;
                    if (abs(v) > 1e20) bad.y += 65536u;
                    else most = max(most, abs(v));
                }
                held[i] = v;
            }
            full = largest_of(most);
            if (!(full > 0.0)) full = 65504.0;
            return uvec2(sum_of(bad.x), sum_of(bad.y));
        });

static const char sat__glsl_group_spikes[] =
    SAT__GLSL(
        int list_giants(int plane, int giants, float full) {
            int before = 0, listed, kind;
            for (int x = 0; x < tile.x && before < room(); x++) {
                uint mine = 0u;
                for (int i = lane; i < 1024; i += 128) {
                    ivec2 p = ivec2(x, tile.y) * 32 + ivec2(i % 32, i / 32);
                    if (p.y < size.y && abs(pixel(p, plane, kind)) > 1e20) mine++;
                }
                before += int(sum_of(mine));
            }
            listed = clamp(room() - before, 0, giants);
            if (lane == 0 && listed < giants) {
                int n = 0, i = 0;
                for (; abs(held[i]) <= 1e20 || n++ < listed; i++) {}
                first_clamped = i;
            }
            barrier();
            if (listed < giants) cut = first_clamped;
            for (int i = lane; i < 1024; i += 128)
                if (abs(held[i]) > 1e20) held[i] = i < cut ? 0.0 : held[i] > 0.0 ? full : -full;
            return listed;
        })
    SAT__GLSL(
        vec2 extent() {
            float sum = 0.0, most = 0.0;
            barrier();
            for (int i = lane / 4 * 32 + lane % 4, end = i + 32; i < end; i += 4) {
                sum += abs(held[i]);
                most = max(most, abs(held[i]));
            }
            lanes[lane] = sum;
            most = largest_of(most);
            if (lane < 4) {
                sum = 0.0;
                for (int y = 0; y < 32; y++) sum += lanes[4 * y + lane];
                lane_sums[lane] = sum;
            }
            barrier();
            return vec2(((lane_sums[0] + lane_sums[1]) + lane_sums[2]) + lane_sums[3], most);
        })
    SAT__GLSL(
        /* which pixels lie above: into place[count] and on, in the order of rows; too many: no matter which */
        int find_spikes(float above) {
            barrier();
            if (lane == 0) counted = 0u;
            barrier();
            for (int i = lane; i < 1024; i += 128)
                if (abs(held[i]) > above) {
                    int k = count + int(atomicAdd(counted, 1u));
                    if (k < 8) place[k] = i;
                }
            barrier();
            int found = int(counted);
            if (lane == 0 && count + found <= 8)
                for (int i = count + 1; i < count + found; i++)
                    for (int j = i; j > count && place[j - 1] > place[j]; j--) {
                        int other = place[j];
                        place[j] = place[j - 1];
                        place[j - 1] = other;
                    }
            barrier();
            return found;
        })
    SAT__GLSL(
        void take_spikes(inout vec2 e) {
            while (e.y > e.x * 0.0625 && count < 8) {
                int found = find_spikes(e.x * 0.0625);
                if (found > 8 - count) break;
                if (lane < found) {
                    taken[count + lane] = held[place[count + lane]];
                    held[place[count + lane]] = 0.0;
                }
                vec2 less = extent();
                if (less.x > e.x * 0.25) {
                    if (lane < found) held[place[count + lane]] = taken[count + lane];
                    break;
                }
                count += found;
                e = less;
            }
            barrier();
        });

static const char sat__glsl_group_sums[] =
    SAT__GLSL(
        uint quantum_of(float sum) {
            uint bits = floatBitsToUint(sum), exponent = (bits >> 23) + ((bits & 0x7fffffu) >= 8386931u ? 1u : 0u);
            return sum > 0.0 ? max(exponent, 31u) - 30u << 23 : 0u;
        }
        void write_tile(int plane, uvec4 record) {
            uvec4 words = uvec4(0u), low = uvec4(0u), high = uvec4(0u);
            ivec3 to = ivec3(tile.x + plane * across(), tile.y, 0);
            for (int i = 0; i < count; i++) {
                words[i / 2] |= uint(place[i] % 32 | place[i] / 32 << 7) << (14 * (i & 1));
                if (i < 4) low[i] = floatBitsToUint(taken[i]);
                else high[i - 4] = floatBitsToUint(taken[i]);
            }
            imageStore(tiles_out, to, record);
            imageStore(tiles_out, to + ivec3(0, 0, 1), words);
            imageStore(tiles_out, to + ivec3(0, 0, 2), low);
            imageStore(tiles_out, to + ivec3(0, 0, 3), high);
        })
    SAT__GLSL(
        /* 8 integers a lane, which lie `step` apart, then those of the lanes before in the same row or column */
        void sum_line(int base, int step, int lanes_before, int lane_step) {
            uint run = 0u;
            for (int d = 0; d < 8; d++) {
                run += summed[base + d * step];
                summed[base + d * step] = run;
            }
            barrier();
            run = 0u;
            for (int k = 1; k <= lanes_before; k++) run += summed[base - k * lane_step + 7 * step];
            barrier();
            for (int d = 0; d < 8; d++) summed[base + d * step] += run;
            barrier();
        }
        void sum_plane(int plane, uint quantum) {
            float inverse = uintBitsToFloat((254u << 23) - quantum);
            for (int i = lane; i < 1024; i += 128)
                summed[plane * 1024 + i] = quantum > 0u ? uint(int(roundEven(held[i] * inverse))) : 0u;
            barrier();
            sum_line(plane * 1024 + 8 * lane, 1, lane % 4, 8);
            sum_line(plane * 1024 + lane / 32 * 256 + lane % 32, 32, lane / 32, 256);
        })
    SAT__GLSL(
        void main() {
            lane = int(gl_LocalInvocationIndex);
            tile = ivec2(gl_WorkGroupID.xy);
            first = tile * 32;
            for (int plane = 0; plane < PLANES; plane++) {
                float full;)
    "#if MOMENTS\n"
    SAT__GLSL(if (plane < CHANNELS) find_mean(plane);)
    "#endif\n"
    SAT__GLSL(
                uvec2 bad = load(plane, full);
                int giants = int(bad.y >> 16), listed = 0;
                uint small = 0u;
                cut = 1024;
                count = 0;
                if (giants > 0) listed = list_giants(plane, giants, full);
                vec2 e = extent();
                take_spikes(e);
                for (int i = lane; i < 1024; i += 128)
                    if (abs(held[i]) > 0.0 && abs(held[i]) < e.x / 262144.0) small++;
                small = sum_of(small) < 8u ? 0u : 1u;
                uvec4 record = uvec4(quantum_of(e.x), floatBitsToUint(full), 0u, 0u);
                record.z = uint(count) | (bad.x & 65535u) << 4 | bad.x >> 16 << 17 | small << 30;
                record.w = (bad.y & 65535u) + uint(giants - listed | listed << 12) | uint(cut) << 20;
                if (lane == 0) write_tile(plane, record);
                sum_plane(plane, record.x);
            }
            for (int i = lane; i < 1024; i += 128) {
                uvec4 v = uvec4(0u);
                for (int plane = 0; plane < PLANES; plane++) v[plane] = summed[plane * 1024 + i];
                if (is_inside(i)) imageStore(cells_out, at(i), v);
            }
        });

/* A work group a slot: rows, then columns. */
static const char sat__glsl_wide_group[] =
    SAT__GLSL(
        layout(local_size_x = 32) in;
        layout(binding = 0, rg32ui) writeonly uniform uimage2D wide_out;
        shared uvec2 summed[1024];
        void main() {
            int lane = int(gl_LocalInvocationIndex), stride = min(size.x, 32), k;
            ivec2 slot = ivec2(gl_WorkGroupID.xy);
            uvec2 sum = uvec2(0u), owner = texelFetch(cells, slot, 0).xy;
            if (owner.x == 0u) return;
            int plane = (int(owner.x) - 1) / across(), base = (slot.y * (across() + 2) + slot.x) * 32;
            ivec2 first = ivec2((int(owner.x) - 1) % across(), owner.y) * 32;
            for (k = 0; k < 32; k++) {
                uint quantum = 0u;
                ivec2 p = first + ivec2(k, lane);
                float v = all(lessThan(p, size)) ? kept(p, plane, quantum) : 0.0;
                if (quantum > 0u) sum = sat_add64(sum, integer(v, sat_wide_exponent(quantum)));
                summed[32 * lane + k] = sum;
            }
            barrier();
            sum = uvec2(0u);
            for (k = 0; k < 32 && lane < stride; k++) {
                int i = (base + k) * stride + lane;
                sum = sat_add64(sum, summed[32 * k + lane]);
                imageStore(wide_out, ivec2(i % pitch, i / pitch), uvec4(sum, 0u, 0u));
            }
        });

/* The strips' running sums, one after the other: rows of tiles (y 0), columns (1), and super tiles (2), of plane z. */
static const char sat__glsl_runs[] =
    SAT__GLSL(
        layout(local_size_x = 32) in;
        layout(binding = 0, rg32ui) writeonly uniform uimage2D strips_out;
        shared uvec2 runs[1024];
        void write(int section, int i, uvec2 v) {
            i += sat_at(section, size, PLANES);
            imageStore(strips_out, ivec2(i % pitch, i / pitch), uvec4(v, 0u, 0u));
        }
        void left(int plane, int i) {
            int n = across(), y = i % size.y, x = i / size.y * 32, end = min(x + 32, n);
            uvec2 run = uvec2(0u);
            for (; x < end; x++) {
                run = add(run, part(plane, ivec2(x, y / 32), ivec2(min(x * 32 + 31, size.x - 1), y), false));
                write(0, (y * PLANES + plane) * n + x, run);
            }
        }
        void above(int plane, int i) {
            int x = i % size.x, band = i / size.x * 32, end = min(band + 32, (size.y + 31) / 32);
            uvec2 sum = uvec2(0u);
            for (; band < end; band++) {
                sum = add(part(plane, ivec2(x / 32, band), ivec2(x, min(band * 32 + 31, size.y - 1)), true), sum);
                write(1, (band * PLANES + plane) * size.x + x, sum);
            }
        })
    SAT__GLSL(
        void whole(int plane, int super, int lane) {
            int n = across(), supers = (n + 31) / 32, k;
            ivec2 first = ivec2(super % supers, super / supers) * 32, t;
            ivec2 end = min(first + 32, ivec2(n, (size.y + 31) / 32));
            uvec2 sum = uvec2(0u);
            t.y = first.y + lane;
            for (t.x = first.x; t.x < end.x && t.y < end.y; t.x++) {
                sum = add(sum, part(plane, t, min(t * 32 + 31, size - 1), true));
                runs[32 * lane + t.x - first.x] = sum;
            }
            barrier();
            sum = uvec2(0u);
            t.x = first.x + lane;
            for (t.y = first.y; t.y < end.y && t.x < end.x; t.y++) {
                sum = add(sum, runs[32 * (t.y - first.y) + lane]);
                write(2, (t.y * PLANES + plane) * n + t.x, sum);
            }
        })
    SAT__GLSL(
        void main() {
            int group = int(gl_WorkGroupID.x), plane = int(gl_WorkGroupID.z), lane = int(gl_LocalInvocationIndex);
            int i = 32 * group + lane;
            ivec2 supers = (size + 1023) / 1024;
            if (gl_WorkGroupID.y == 0u && i < size.y * supers.x) left(plane, i);
            if (gl_WorkGroupID.y == 1u && i < size.x * supers.y) above(plane, i);
            if (gl_WorkGroupID.y == 2u && group < supers.x * supers.y) whole(plane, group, lane);
        });

/* ---- what is drawn from tiles */

static const char sat__glsl_tile_filter[] =
    SAT__GLSL(
        layout(location = 0) out vec4 result;
        uniform usampler2D strips;
        uniform int radius;
        void main() {
            ivec2 p = ivec2(gl_FragCoord.xy);
            vec4 means = vec4(0.0, 0.0, 0.0, 1.0);
            for (int c = 0; c < CHANNELS; c++) means[c] = sat_mean(cells, tiles, strips, c, p - radius, p + radius + 1);
            result = means;
        });

/* Chan, Golub, LeVeque 1983, as sat__moment_join. */
static const char sat__glsl_tile_variance[] =
    SAT__GLSL(
        layout(location = 0) out vec4 result;
        uniform usampler2D strips;
        uniform int radius;
        vec2 moments(int c, ivec2 a, ivec2 b, float one) {
            float n = 0.0, mean = 0.0, squares = 0.0;
            ivec2 s = a >> 5, e = (b - 1) >> 5, t;
            for (t.y = s.y; t.y <= e.y; t.y++)
                for (t.x = s.x; t.x <= e.x; t.x++) {
                    ivec2 low = max(a, t * 32), high = min(b, (t + 1) * 32);
                    float m = uintBitsToFloat(texelFetch(means, ivec2(t.x + across() * c, t.y), 0).x);
                    vec2 d = sat_tile_part(cells, tiles, strips, ivec3(size, PLANES), c, t, low, high, one),
                         q = sat_tile_part(cells, tiles, strips, ivec3(size, PLANES), CHANNELS + c, t, low, high, one);
                    float k = float((high.x - low.x) * (high.y - low.y)), both = n + k, sum = d.x + d.y;
                    float here = max(0.0, (q.x + q.y) - sum * sum / k), delta = m + sum / k - mean;
                    squares += here + delta * delta * (n / both * k);
                    mean += delta * (k / both);
                    n = both;
                }
            return vec2(mean, squares / n);
        })
    SAT__GLSL(
        void main() {
            ivec2 p = ivec2(gl_FragCoord.xy), a = max(p - radius, 0), b = min(p + radius + 1, size);
            float one = size.x > 0 ? 1.0 : 0.0;
            result = vec4(moments(0, a, b, one), 0.0, 0.0);
            if (CHANNELS > 1) result.zw = moments(CHANNELS - 1, a, b, one);
        });

SAT_DEF const char *sat_gl_glsl_tiles(int part)
{
    return part == 0 ? sat__glsl_tile_numbers : part == 1 ? sat__glsl_tile_lookups : NULL;
}

/* ---- >> passes: the object */

enum { SAT__GL_LEVELS = 32, SAT__GL_TILE = 32 }; /* the tile stands in the shaders, too */

/* The programs, in the order of the table. Where two follow each other, the second reads the caller's texture. */
enum {
    SAT__GL_DOUBLE, SAT__GL_DOUBLE_INPUT, SAT__GL_REDUCE, SAT__GL_REDUCE_INPUT, SAT__GL_EXPAND, SAT__GL_EXPAND_INPUT,
    SAT__GL_EXPAND_GROUPS, SAT__GL_EXPAND_GROUPS_INPUT, SAT__GL_MEAN, SAT__GL_MEAN_INPUT,
    SAT__GL_GROUP, SAT__GL_MEANS, SAT__GL_GAUGE, SAT__GL_SETTLE, SAT__GL_SCAN, SAT__GL_ADD, SAT__GL_SLOTS,
    SAT__GL_OWNERS, SAT__GL_WIDE, SAT__GL_WIDE_GROUP, SAT__GL_STRIPS, SAT__GL_RUNS, SAT__GL_FILTER, SAT__GL_VARIANCE,
    SAT__GL_PROGRAMS
};

/* One level of the tree along an axis: sums of groups, then their scan. The size is the part in use. */
typedef struct sat__gl_level {
    sat__gl_target sums, scan;
} sat__gl_level;

/* SAT_GL_TILED: what the passes draw into. */
typedef struct sat__gl_tiled {
    sat__gl_target cells, partial, strips, means, pool, owners, wide;
    unsigned gauge[2], gauge_framebuffer, tiles, tiles_framebuffer;
    int tiles_width, planes;
    int width, height; /* of the last build; 0: there was none */
} sat__gl_tiled;

struct sat_gl {
    sat__gl gl;
    sat_gl_options options;
    unsigned program[SAT__GL_PROGRAMS];
    int ready;   /* all programs are there */
    int compute, mean_k;
    int width, height; /* of the textures below; 0: there are none */
    int mean_width, mean_height, mean_levels;
    float limit;
    double quantum;
    sat__gl_target table, partial;                  /* partial: the rows' scans, and recursive doubling's other half */
    sat__gl_level levels[2][SAT__GL_LEVELS];
    int depth[2];                                   /* levels of the rows' tree and of the columns' */
    sat__gl_level means[SAT__GL_LEVELS];
    unsigned borrowed;                              /* framebuffer for a table of the caller */
    sat__gl_tiled tiled;
};

static const sat__field sat__gl_fields[] = {
    SAT__FIELD(sat_gl_options, 'i', format, SAT_GL_TILED, 0, SAT_GL_TILED, ' '),
    SAT__FIELD(sat_gl_options, 'i', algorithm, SAT_SCAN_BALANCED_TREE, SAT_SCAN_RECURSIVE_DOUBLING,
               SAT_SCAN_BALANCED_TREE, ' '),
    SAT__FIELD(sat_gl_options, 'i', k, 4, 2, 64, ' '),
    SAT__FIELD(sat_gl_options, 'i', compute, 0, 0, 1, ' '),
    SAT__FIELD(sat_gl_options, 'i', channel, 0, 0, 3, ' '),
    SAT__FIELD(sat_gl_options, 'i', channels, 1, 1, 4, ' '),
    SAT__FIELD(sat_gl_options, 'i', moments, 0, 0, 1, ' '),
    SAT__FIELD(sat_gl_options, 'i', unsigned_input, 0, 0, 1, ' '),
    SAT__FIELD(sat_gl_options, 'd', quantum, 0, 1e-35, 1e35, '0'),
    SAT__FIELD(sat_gl_options, 'd', max_value, 1e30, 1e-300, 1e300, ' '),
    SAT__FIELD(sat_gl_options, 'd', max_box_area, 0, 0, 1e300, ' '),
    SAT__FIELD(sat_gl_options, 'i', width, 0, 0, 16777216, ' '),
    SAT__FIELD(sat_gl_options, 'i', height, 0, 0, 16777216, ' '),
    SAT__FIELD(sat_gl_options, 'a', allocator, 0, 0, 0, ' '),
};

SAT_DEF sat_gl_options sat_gl_defaults(void)
{
    sat_gl_options options;
    sat__fields_default(&options, sizeof options, sat__gl_fields, SAT__COUNT(sat__gl_fields));
    return options;
}

static int sat__explain_gl_options(sat__text *t, const sat_gl_options *o)
{
    int exponent;
    const sat__field *wrong = sat__fields_check(o, sat__gl_fields, SAT__COUNT(sat__gl_fields));
    if (wrong) sat__text_field(t, wrong, o);
    else if (o->unsigned_input && o->format != SAT_GL_FIXED32)
        sat__text_add(t, "unsigned_input is 1; only SAT_GL_FIXED32 takes it");
    else if (o->quantum > 0 && frexp(o->quantum, &exponent) > 0.5) sat__text_add(t, "quantum is not a power of two");
    else if (o->format != SAT_GL_TILED && (o->channels > 1 || o->moments))
        sat__text_add(t, o->moments ? "moments is 1; only SAT_GL_TILED takes it"
                                    : "channels is above 1; only SAT_GL_TILED takes it");
    else if (o->channel + o->channels > 4)
        sat__text_range(t, "channel + channels", o->channel + o->channels, 1, 4, ' ');
    else if (o->moments && o->channels > 2)
        sat__text_range(t, "channels with moments", o->channels, 1, 2, ' ');
    else if ((o->width > 0) != (o->height > 0)) sat__text_add(t, "only one of width and height is 0");
    else return 1;
    return 0;
}

SAT_DEF const char *sat_explain_gl(char *text, size_t size, const sat_gl_options *options)
{
    sat__text t = sat__text_begin(text, size);
    if (options) sat__explain_gl_options(&t, options);
    return text;
}

static int sat__gl_options_are_valid(const sat_gl_options *o)
{
    sat__text ignored = sat__text_begin(NULL, 0);
    return sat__explain_gl_options(&ignored, o);
}

static unsigned sat__gl_internal(sat_gl_format format)
{
    return format == SAT_GL_TWO_FLOAT ? SAT__GL_RG32F : format == SAT_GL_FLOAT ? SAT__GL_R32F : SAT__GL_R32UI;
}

/* ---- programs */

/* What is made for some options only. */
enum {
    SAT__GL_IF_TREE = 1, SAT__GL_IF_DOUBLING = 2, SAT__GL_IF_FLOATS = 4, SAT__GL_IF_TILED = 8, SAT__GL_IF_PIXELS = 16,
    SAT__GL_IF_MOMENTS = 32, SAT__GL_IF_PASSES = 64, SAT__GL_IF_GROUPS = SAT__GL_COMPUTE
};

#define SAT__GL_SUMS "#define FORMAT TABLE_FORMAT\n#define K TABLE_K\n#define INPUT 0\n"
#define SAT__GL_FIRST "#define FORMAT TABLE_FORMAT\n#define K TABLE_K\n#define INPUT TABLE_INPUT\n"
#define SAT__GL_OF_MEANS "#define FORMAT 0\n#define K MEAN_K\n"
#define SAT__GL_FLAT(name, when, defines, body)                                                                        \
    {name, when, "source uncles", defines, NULL, {sat__glsl_values, sat__glsl_output, body}}
#define SAT__GL_TILES(name, when, units, defines, ...)                                                                 \
    {name, SAT__GL_IF_TILED | (when), "source cells tiles " units " facts means", defines, NULL,                       \
     {sat__glsl_tile_numbers, sat__glsl_tile_lookups, sat__glsl_tile_values, __VA_ARGS__}}
#define SAT__GL_BUILDS(name, when, defines, ...) SAT__GL_TILES(name, when, "gauges", defines, __VA_ARGS__)
#define SAT__GL_KEPT sat__glsl_tile_output, sat__glsl_tile_kept

static const sat__gl_program sat__gl_programs[SAT__GL_PROGRAMS] = {
    SAT__GL_FLAT("sat: recursive doubling", SAT__GL_IF_DOUBLING, SAT__GL_SUMS, sat__glsl_double),
    SAT__GL_FLAT("sat: recursive doubling", SAT__GL_IF_DOUBLING, SAT__GL_FIRST, sat__glsl_double),
    SAT__GL_FLAT("sat: reduction", SAT__GL_IF_TREE, SAT__GL_SUMS, sat__glsl_reduce),
    SAT__GL_FLAT("sat: reduction", SAT__GL_IF_TREE, SAT__GL_FIRST, sat__glsl_reduce),
    SAT__GL_FLAT("sat: expansion", SAT__GL_IF_TREE | SAT__GL_IF_PASSES, SAT__GL_SUMS, sat__glsl_expand),
    SAT__GL_FLAT("sat: expansion", SAT__GL_IF_TREE | SAT__GL_IF_PASSES, SAT__GL_FIRST, sat__glsl_expand),
    {"sat: expansion", SAT__GL_IF_TREE | SAT__GL_IF_GROUPS, "source uncles", SAT__GL_SUMS, NULL,
     {sat__glsl_values, sat__glsl_expand_groups}},
    {"sat: expansion", SAT__GL_IF_TREE | SAT__GL_IF_GROUPS, "source uncles", SAT__GL_FIRST, NULL,
     {sat__glsl_values, sat__glsl_expand_groups}},
    SAT__GL_FLAT("sat: mean", SAT__GL_IF_FLOATS, SAT__GL_OF_MEANS "#define INPUT 0\n", sat__glsl_mean),
    SAT__GL_FLAT("sat: mean", SAT__GL_IF_FLOATS, SAT__GL_OF_MEANS "#define INPUT 1\n", sat__glsl_mean),
    SAT__GL_BUILDS("sat: tiles", SAT__GL_IF_GROUPS, NULL, sat__glsl_group, sat__glsl_group_spikes,
                   sat__glsl_group_sums),
    SAT__GL_BUILDS("sat: means of tiles", SAT__GL_IF_MOMENTS | SAT__GL_IF_PASSES, NULL, sat__glsl_tile_means),
    SAT__GL_BUILDS("sat: gauge", SAT__GL_IF_PASSES, NULL, sat__glsl_gauge),
    SAT__GL_BUILDS("sat: quanta and spikes", SAT__GL_IF_PASSES, NULL, sat__glsl_settle),
    SAT__GL_BUILDS("sat: integers", SAT__GL_IF_PASSES, "#define INPUT 1\n", SAT__GL_KEPT, sat__glsl_tile_scan),
    SAT__GL_BUILDS("sat: sums in tiles", SAT__GL_IF_PASSES, "#define INPUT 0\n", SAT__GL_KEPT, sat__glsl_tile_scan),
    SAT__GL_BUILDS("sat: slots", 0, NULL, SAT__GL_KEPT, sat__glsl_slots),
    SAT__GL_BUILDS("sat: owners of slots", 0, NULL, SAT__GL_KEPT, sat__glsl_owners),
    SAT__GL_BUILDS("sat: 64-bit tiles", SAT__GL_IF_PASSES, NULL, SAT__GL_KEPT, sat__glsl_wide_integer, sat__glsl_wide),
    SAT__GL_BUILDS("sat: 64-bit tiles", SAT__GL_IF_GROUPS, NULL, sat__glsl_tile_kept, sat__glsl_wide_integer,
                   sat__glsl_wide_group),
    SAT__GL_BUILDS("sat: strips", 0, NULL, SAT__GL_KEPT, sat__glsl_strip_sums, sat__glsl_strips),
    SAT__GL_BUILDS("sat: running sums", SAT__GL_IF_GROUPS, NULL, sat__glsl_tile_kept, sat__glsl_strip_sums,
                   sat__glsl_runs),
    SAT__GL_TILES("sat: box filter", SAT__GL_IF_PIXELS, "strips", NULL, sat__glsl_tile_filter),
    SAT__GL_TILES("sat: variance", SAT__GL_IF_MOMENTS, "strips", NULL, sat__glsl_tile_variance)};

static sat_result sat__gl_make_programs(sat_gl *g)
{
    const sat_gl_options *o = &g->options;
    const char *const library[2] = {sat_gl_glsl(), NULL};
    int planes = o->channels << o->moments, tiled = o->format == SAT_GL_TILED, i;
    int given = tiled ? SAT__GL_IF_TILED | (o->moments ? SAT__GL_IF_MOMENTS : SAT__GL_IF_PIXELS)
                : o->algorithm == SAT_SCAN_BALANCED_TREE ? SAT__GL_IF_TREE : SAT__GL_IF_DOUBLING;
    sat__gl *gl = &g->gl;
    static const char *const names[] = {"CHANNEL", "CHANNELS", "PLANES", "MOMENTS", "TABLE_FORMAT", "TABLE_K", "MEAN_K",
                                        "TABLE_INPUT", "RUNS"};
    const int values[] = {o->channel, o->channels, planes, o->moments, (int)o->format, o->k, g->mean_k,
                          o->unsigned_input ? 2 : 1, g->compute};
    for (i = 0; i < SAT__COUNT(values); i++) sat__gl_define(gl, names[i], values[i]);
    sat__gl_define_text(gl, "CELL", planes == 1 ? "r32ui" : planes == 2 ? "rg32ui" : "rgba32ui");
    if (!g->compute) given |= SAT__GL_IF_PASSES;
    if (!o->unsigned_input) given |= SAT__GL_IF_FLOATS;
    return sat__gl_build_table(gl, g->program, sat__gl_programs, SAT__GL_PROGRAMS, given, library);
}

/* ---- tiles: textures and passes */

static void sat__gl_free_tiles(sat_gl *g)
{
    sat__gl_tiled *t = &g->tiled;
    sat__gl *gl = &g->gl;
    sat__gl_free_target(gl, &t->cells);
    sat__gl_free_target(gl, &t->partial);
    sat__gl_free_target(gl, &t->strips);
    sat__gl_free_target(gl, &t->means);
    sat__gl_free_target(gl, &t->pool);
    sat__gl_free_target(gl, &t->owners);
    sat__gl_free_target(gl, &t->wide);
    if (t->gauge_framebuffer) gl->DeleteFramebuffers(1, &t->gauge_framebuffer);
    if (t->tiles_framebuffer) gl->DeleteFramebuffers(1, &t->tiles_framebuffer);
    if (t->gauge[0]) gl->DeleteTextures(1, &t->gauge[0]);
    if (t->gauge[1]) gl->DeleteTextures(1, &t->gauge[1]);
    if (t->tiles) gl->DeleteTextures(1, &t->tiles);
    t->gauge_framebuffer = t->tiles_framebuffer = t->gauge[0] = t->gauge[1] = t->tiles = 0;
    t->width = t->height = 0;
}

/* An array of four layers that one pass draws to at once. */
static sat_result sat__gl_make_layers(sat__gl *gl, unsigned *texture, unsigned *framebuffer, int width, int height)
{
    unsigned buffers[4];
    int i;
    gl->GenTextures(1, texture);
    gl->ActiveTexture(SAT__GL_TEXTURE0);
    gl->BindTexture(SAT__GL_TEXTURE_2D_ARRAY, *texture);
    gl->TexImage3D(SAT__GL_TEXTURE_2D_ARRAY, 0, SAT__GL_RGBA32UI, width, height, 4, 0, SAT__GL_RGBA_INTEGER,
                   SAT__GL_UNSIGNED_INT, NULL);
    gl->TexParameteri(SAT__GL_TEXTURE_2D_ARRAY, SAT__GL_TEXTURE_MAX_LEVEL, 0);
    gl->TexParameteri(SAT__GL_TEXTURE_2D_ARRAY, SAT__GL_TEXTURE_MIN_FILTER, SAT__GL_NEAREST);
    gl->TexParameteri(SAT__GL_TEXTURE_2D_ARRAY, SAT__GL_TEXTURE_MAG_FILTER, SAT__GL_NEAREST);
    gl->GenFramebuffers(1, framebuffer);
    gl->BindFramebuffer(SAT__GL_FRAMEBUFFER, *framebuffer);
    for (i = 0; i < 4; i++) {
        buffers[i] = SAT__GL_COLOR_ATTACHMENT0 + (unsigned)i;
        gl->FramebufferTextureLayer(SAT__GL_FRAMEBUFFER, buffers[i], *texture, 0, i);
    }
    gl->DrawBuffers(4, buffers);
    if (gl->CheckFramebufferStatus(SAT__GL_FRAMEBUFFER) != SAT__GL_FRAMEBUFFER_COMPLETE)
        return sat__gl_fail(gl, SAT_ERR_GL_STATE, "OpenGL refused the layers of the tiles", NULL);
    return sat__gl_check(gl, "OpenGL refused a texture array");
}

/* Texels of the strips, as sat_at of the shaders counts them; those of the pool alone. */
static double sat__gl_strip_texels(int width, int height, int planes, double *pool)
{
    double n = (width - 1) / SAT__GL_TILE + 1, down = (height - 1) / SAT__GL_TILE + 1,
           supers = (height - 1) / SAT__SUPER + 1;
    *pool = (n + 2) * supers * planes * (double)(sat__min_int(width, SAT__GL_TILE) * SAT__GL_TILE);
    return planes * (n * height + (width + 2 * n + 1 + sat__clamp_int(width, 8, 64)) * down + supers) + *pool;
}

static sat_result sat__gl_make_tiles(sat_gl *g, int width, int height)
{
    sat__gl_tiled *t = &g->tiled;
    sat__gl *gl = &g->gl;
    int planes = g->options.channels << g->options.moments, passes = !g->compute, i;
    int pitch = sat__max_int(width, 256); /* tall narrow pictures have long strips */
    int tiles_x = (width - 1) / SAT__GL_TILE + 1, tiles_y = (height - 1) / SAT__GL_TILE + 1;
    unsigned cells = planes == 1 ? SAT__GL_R32UI : planes == 2 ? SAT__GL_RG32UI : SAT__GL_RGBA32UI;
    double room, strips = sat__gl_strip_texels(width, height, planes, &room);
    const struct {
        int when;
        sat__gl_target *target;
        unsigned internal;
        int width, height;
    } list[] = {{1, &t->cells, cells, width, height},
                {passes, &t->partial, cells, width, height},
                {1, &t->strips, SAT__GL_RG32UI, pitch, (int)((strips - 1) / pitch) + 1},
                {1, &t->pool, SAT__GL_R32UI, tiles_x * planes, tiles_y},
                {1, &t->owners, SAT__GL_RG32UI, tiles_x + 2, ((height - 1) / SAT__SUPER + 1) * planes},
                {1, &t->wide, SAT__GL_RG32UI, pitch, (int)((room - 1) / pitch) + 1},
                {g->options.moments, &t->means, SAT__GL_R32UI, tiles_x * g->options.channels, tiles_y}};
    sat_result result = SAT_OK;
    if (strips > 2e9) return sat__gl_fail(gl, SAT_ERR_SIZE, "an index into the strips does not fit into int", NULL);
    for (i = 0; i < SAT__COUNT(list) && result == SAT_OK; i++)
        if (list[i].when)
            result = sat__gl_make_target(gl, list[i].target, list[i].internal, list[i].width, list[i].height);
    for (i = 0; i < 2 && passes && result == SAT_OK; i++)
        result = sat__gl_texture(gl, &t->gauge[i], SAT__GL_RGBA32UI, tiles_x * planes, height, NULL);
    if (passes && result == SAT_OK) result = sat__gl_framebuffer(gl, &t->gauge_framebuffer, t->gauge, 2, 0);
    if (result == SAT_OK)
        result = sat__gl_make_layers(gl, &t->tiles, &t->tiles_framebuffer, tiles_x * planes + 1, tiles_y);
    t->tiles_width = tiles_x * planes + 1;
    t->planes = planes;
    return result;
}

/* Textures for this size, or, where create has made them, the part of them that it takes. Their last column holds the
   size for lookups. */
static sat_result sat__gl_fit_tiles(sat_gl *g, int width, int height)
{
    sat__gl_tiled *t = &g->tiled;
    sat__gl *gl = &g->gl;
    unsigned shape[4];
    sat_result result = SAT_OK;
    if (t->width == width && t->height == height) return SAT_OK;
    if (!g->options.width) sat__gl_free_tiles(g);
    if (!t->tiles) result = sat__gl_make_tiles(g, width, height);
    if (result != SAT_OK) {
        sat__gl_free_tiles(g);
        return result;
    }
    t->width = width;
    t->height = height;
    shape[0] = (unsigned)width;
    shape[1] = (unsigned)height;
    shape[2] = (unsigned)t->planes;
    shape[3] = 0;
    gl->ActiveTexture(SAT__GL_TEXTURE0);
    gl->BindTexture(SAT__GL_TEXTURE_2D_ARRAY, t->tiles);
    gl->TexSubImage3D(SAT__GL_TEXTURE_2D_ARRAY, 0, t->tiles_width - 1, 0, 0, 1, 1, 1, SAT__GL_RGBA_INTEGER,
                      SAT__GL_UNSIGNED_INT, shape);
    return SAT_OK;
}

/* Program, uniforms and what it reads: `source`, and what `cells`, `gauges` and `facts` name, in this order. */
static unsigned sat__gl_tile_inputs(sat_gl *g, int pass, const unsigned in[4])
{
    const sat__gl_tiled *t = &g->tiled;
    sat__gl *gl = &g->gl;
    unsigned program = g->program[pass];
    gl->UseProgram(program);
    SAT__GL_INPUTS(gl, in[0], in[1], 0, in[2], in[3], pass <= SAT__GL_MEANS ? 0 : t->means.texture);
    gl->ActiveTexture(SAT__GL_TEXTURE0 + 2u);
    gl->BindTexture(SAT__GL_TEXTURE_2D_ARRAY, pass <= SAT__GL_SETTLE ? 0 : t->tiles);
    sat__gl_set_int2(gl, program, "size", t->width, t->height);
    sat__gl_set_int(gl, program, "pitch", t->strips.width);
    sat__gl_set_float(gl, program, "limit",
                      g->options.max_value < 3.4028234663852886e38 ? (float)g->options.max_value : 3.4028235e38f);
    return program;
}

static void sat__gl_tile_pass(sat_gl *g, int pass, const sat__gl_target *to, const unsigned in[4])
{
    g->gl.BindFramebuffer(SAT__GL_FRAMEBUFFER, to->framebuffer);
    g->gl.Viewport(0, 0, to->width, to->height);
    sat__gl_tile_inputs(g, pass, in);
    sat__gl_draw(&g->gl);
}

static sat__gl_target sat__gl_part(unsigned framebuffer, int width, int height)
{
    sat__gl_target part = {0, 0, 0, 0};
    part.framebuffer = framebuffer;
    part.width = width;
    part.height = height;
    return part;
}

/* Gauges, quanta and spikes, then the sums of a row and of a column by eights, twice each, from one texture to the
   other and back. */
static void sat__gl_tiles_by_passes(sat_gl *g, unsigned texture, int tiles_x, int tiles_y)
{
    sat__gl_tiled *t = &g->tiled;
    sat__gl_target gauge = sat__gl_part(t->gauge_framebuffer, tiles_x * t->planes, t->height);
    sat__gl_target settle = sat__gl_part(t->tiles_framebuffer, tiles_x * t->planes, tiles_y);
    sat__gl_target means = sat__gl_part(t->means.framebuffer, tiles_x * g->options.channels, tiles_y);
    unsigned in[4] = {0, 0, 0, 0};
    int i;
    in[0] = texture;
    if (g->options.moments) sat__gl_tile_pass(g, SAT__GL_MEANS, &means, in);
    sat__gl_tile_pass(g, SAT__GL_GAUGE, &gauge, in);
    in[2] = t->gauge[0];
    in[3] = t->gauge[1];
    sat__gl_tile_pass(g, SAT__GL_SETTLE, &settle, in);
    in[2] = in[3] = 0;
    for (i = 0; i < 4; i++) {
        const sat__gl_target *from = i & 1 ? &t->partial : &t->cells, *to = i & 1 ? &t->cells : &t->partial;
        int step = i & 1 ? 8 : 1;
        unsigned program;
        in[1] = i ? from->texture : 0;
        program = sat__gl_tile_inputs(g, i ? SAT__GL_ADD : SAT__GL_SCAN, in);
        sat__gl_set_int2(&g->gl, program, "axis", i < 2 ? step : 0, i < 2 ? 0 : step);
        g->gl.BindFramebuffer(SAT__GL_FRAMEBUFFER, to->framebuffer);
        g->gl.Viewport(0, 0, t->width, t->height);
        sat__gl_draw(&g->gl);
    }
}

/* Nobody still reads what is written, and what comes next sees it. */
static void sat__gl_dispatch(sat_gl *g, int x, int y, int z)
{
    g->gl.MemoryBarrier(SAT__GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
    g->gl.DispatchCompute((unsigned)x, (unsigned)y, (unsigned)z);
    g->gl.MemoryBarrier(SAT__GL_TEXTURE_FETCH_BARRIER_BIT | SAT__GL_SHADER_IMAGE_ACCESS_BARRIER_BIT |
                        SAT__GL_TEXTURE_UPDATE_BARRIER_BIT | SAT__GL_FRAMEBUFFER_BARRIER_BIT);
}

static void sat__gl_tiles_by_groups(sat_gl *g, unsigned texture, int tiles_x, int tiles_y)
{
    sat__gl_tiled *t = &g->tiled;
    sat__gl *gl = &g->gl;
    unsigned cells = t->planes == 1 ? SAT__GL_R32UI : t->planes == 2 ? SAT__GL_RG32UI : SAT__GL_RGBA32UI;
    unsigned in[4] = {0, 0, 0, 0};
    in[0] = texture;
    sat__gl_tile_inputs(g, SAT__GL_GROUP, in);
    gl->BindImageTexture(0, t->tiles, 0, 1, 0, SAT__GL_WRITE_ONLY, SAT__GL_RGBA32UI);
    gl->BindImageTexture(1, t->cells.texture, 0, 0, 0, SAT__GL_WRITE_ONLY, cells);
    if (g->options.moments) gl->BindImageTexture(2, t->means.texture, 0, 0, 0, SAT__GL_WRITE_ONLY, SAT__GL_R32UI);
    sat__gl_dispatch(g, tiles_x, tiles_y, 1);
}

/* Slots of 64-bit tiles, their cells, and the strips. */
static void sat__gl_sum_tiles(sat_gl *g, unsigned texture, int tiles_x, int tiles_y)
{
    sat__gl_tiled *t = &g->tiled;
    sat__gl *gl = &g->gl;
    int pitch = t->strips.width, supers_x = (t->width - 1) / SAT__SUPER + 1, supers = (t->height - 1) / SAT__SUPER + 1;
    double room, texels = sat__gl_strip_texels(t->width, t->height, t->planes, &room);
    sat__gl_target pool = sat__gl_part(t->pool.framebuffer, tiles_x * t->planes, tiles_y);
    sat__gl_target owners = sat__gl_part(t->owners.framebuffer, tiles_x + 2, supers * t->planes);
    sat__gl_target wide = sat__gl_part(t->wide.framebuffer, pitch, (int)((room - 1) / pitch) + 1);
    sat__gl_target strips = sat__gl_part(t->strips.framebuffer, pitch, (int)((texels - 1) / pitch) + 1);
    unsigned in[4] = {0, 0, 0, 0};
    sat__gl_tile_pass(g, SAT__GL_SLOTS, &pool, in);
    in[1] = t->pool.texture;
    sat__gl_tile_pass(g, SAT__GL_OWNERS, &owners, in);
    in[0] = texture;
    in[1] = t->owners.texture;
    if (g->compute) {
        sat__gl_tile_inputs(g, SAT__GL_WIDE_GROUP, in);
        gl->BindImageTexture(0, t->wide.texture, 0, 0, 0, SAT__GL_WRITE_ONLY, SAT__GL_RG32UI);
        sat__gl_dispatch(g, owners.width, owners.height, 1);
    } else {
        sat__gl_tile_pass(g, SAT__GL_WIDE, &wide, in);
    }
    in[1] = t->cells.texture;
    in[2] = t->pool.texture;
    in[3] = t->wide.texture;
    sat__gl_tile_pass(g, SAT__GL_STRIPS, &strips, in);
    if (g->compute) {
        int rows = (t->height * supers_x + 31) / 32, columns = (t->width * supers + 31) / 32;
        sat__gl_tile_inputs(g, SAT__GL_RUNS, in);
        gl->BindImageTexture(0, t->strips.texture, 0, 0, 0, SAT__GL_WRITE_ONLY, SAT__GL_RG32UI);
        sat__gl_dispatch(g, sat__max_int(sat__max_int(rows, columns), supers_x * supers), 3, t->planes);
    }
}

static sat_result sat__gl_build_tiles(sat_gl *g, unsigned texture, int width, int height)
{
    int tiles_x = (width - 1) / SAT__GL_TILE + 1, tiles_y = (height - 1) / SAT__GL_TILE + 1;
    sat__gl_state state;
    sat_result result;
    sat__gl_begin(&g->gl, &state, 6);
    result = sat__gl_fit_tiles(g, width, height);
    if (result == SAT_OK) {
        if (g->compute) sat__gl_tiles_by_groups(g, texture, tiles_x, tiles_y);
        else sat__gl_tiles_by_passes(g, texture, tiles_x, tiles_y);
        sat__gl_sum_tiles(g, texture, tiles_x, tiles_y);
    }
    sat__gl_end(&g->gl, &state);
    return result;
}

SAT_DEF sat_result sat_gl_get_tiles(sat_gl_tiles *out, const sat_gl *gl)
{
    if (!out || !gl || !gl->tiled.width) return SAT_ERR_ARGUMENT;
    out->cells = gl->tiled.cells.texture;
    out->tiles = gl->tiled.tiles;
    out->strips = gl->tiled.strips.texture;
    return SAT_OK;
}

/* The counts stand in the first layer of the tiles. */
SAT_DEF sat_result sat_gl_get_stats(sat_gl *gl, sat_stats *stats)
{
    sat__gl_state state;
    uint32_t *records;
    size_t count, i;
    if (!stats || !gl || !gl->tiled.width) return SAT_ERR_ARGUMENT;
    count = ((size_t)gl->tiled.width + SAT__GL_TILE - 1) / SAT__GL_TILE * (size_t)gl->options.channels;
    count *= ((size_t)gl->tiled.height + SAT__GL_TILE - 1) / SAT__GL_TILE;
    records = (uint32_t *)sat__alloc(&gl->options.allocator, count * 16);
    if (!records) return SAT_ERR_MEMORY;
    memset(stats, 0, sizeof *stats);
    sat__gl_begin(&gl->gl, &state, 1);
    gl->gl.BindFramebuffer(SAT__GL_FRAMEBUFFER, gl->tiled.tiles_framebuffer);
    gl->gl.ReadBuffer(SAT__GL_COLOR_ATTACHMENT0);
    gl->gl.ReadPixels(0, 0, (gl->tiled.width - 1) / SAT__GL_TILE * gl->options.channels + gl->options.channels,
                     (gl->tiled.height - 1) / SAT__GL_TILE + 1,
                      SAT__GL_RGBA_INTEGER, SAT__GL_UNSIGNED_INT, records);
    sat__gl_end(&gl->gl, &state);
    for (i = 0; i < count; i++) {
        stats->nan += records[4 * i + 2] >> 4 & 8191;
        stats->infinite += records[4 * i + 2] >> 17 & 8191;
        stats->clamped += records[4 * i + 3] & 4095;
    }
    sat__release(&gl->options.allocator, records, count * 16);
    return SAT_OK;
}

static sat_result sat__gl_filter_tiles(sat_gl *g, int pass, unsigned texture, int radius)
{
    sat__gl_state state;
    sat_result result;
    if (!g || !g->ready || !g->tiled.width || !texture || radius < 0 || radius > 0x3fffffff || !g->program[pass])
        return SAT_ERR_ARGUMENT;
    sat__gl_begin(&g->gl, &state, 6);
    result = sat__gl_attach(&g->gl, g->borrowed, &texture, 1, 0);
    if (result == SAT_OK) {
        unsigned in[4] = {0, 0, 0, 0}, program;
        in[1] = g->tiled.cells.texture;
        in[2] = g->tiled.strips.texture;
        program = sat__gl_tile_inputs(g, pass, in);
        sat__gl_set_int(&g->gl, program, "radius", radius);
        g->gl.Viewport(0, 0, g->tiled.width, g->tiled.height);
        sat__gl_draw(&g->gl);
    }
    sat__gl_end(&g->gl, &state);
    return result;
}

SAT_DEF sat_result sat_gl_box_filter(sat_gl *gl, unsigned texture, int radius)
{
    return sat__gl_filter_tiles(gl, SAT__GL_FILTER, texture, radius);
}

SAT_DEF sat_result sat_gl_variance(sat_gl *gl, unsigned texture, int radius)
{
    return sat__gl_filter_tiles(gl, SAT__GL_VARIANCE, texture, radius);
}

/* ---- >> passes of flat tables */

/* ---- textures of one size */

static void sat__gl_free_levels(sat__gl *gl, sat__gl_level *levels)
{
    int i;
    for (i = 0; i < SAT__GL_LEVELS; i++) {
        sat__gl_free_target(gl, &levels[i].sums);
        sat__gl_free_target(gl, &levels[i].scan);
    }
}

static void sat__gl_free_textures(sat_gl *g)
{
    sat__gl_free_tiles(g);
    sat__gl_free_target(&g->gl, &g->table);
    sat__gl_free_target(&g->gl, &g->partial);
    sat__gl_free_levels(&g->gl, g->levels[0]);
    sat__gl_free_levels(&g->gl, g->levels[1]);
    g->width = g->height = 0;
}

static void sat__gl_free_means(sat_gl *g)
{
    sat__gl_free_levels(&g->gl, g->means);
    g->mean_width = g->mean_height = g->mean_levels = 0;
}

/* A texture that is there already is larger, and this size a part of it. */
static sat_result sat__gl_have_target(sat_gl *g, sat__gl_target *target, unsigned internal, int width, int height)
{
    if (!target->texture) return sat__gl_make_target(&g->gl, target, internal, width, height);
    target->width = width;
    target->height = height;
    return SAT_OK;
}

/* The tree along one axis ends above the level that one group can hold: its root is never asked for. */
static sat_result sat__gl_make_tree(sat_gl *g, int axis)
{
    unsigned internal = sat__gl_internal(g->options.format);
    int k = g->options.k, width = g->width, height = g->height;
    sat_result result = SAT_OK;
    g->depth[axis] = 0;
    while (result == SAT_OK && (axis ? height : width) > k) {
        sat__gl_level *level = &g->levels[axis][g->depth[axis]++];
        if (axis) height = (height + k - 1) / k;
        else width = (width + k - 1) / k;
        result = sat__gl_have_target(g, &level->sums, internal, width, height);
        if (result == SAT_OK) result = sat__gl_have_target(g, &level->scan, internal, width, height);
    }
    return result;
}

/* The largest pixel that leaves every float sum finite. */
static double sat__gl_largest(const sat_gl *g)
{
    double largest = 3.4028234663852886e38 / 2147483648.0;
    return g->options.max_value < largest ? g->options.max_value : largest;
}

/* The largest pixel and the quantum for this size, as SAT_KIND_FLOAT and SAT_KIND_FIXED32 choose them: every
   box that may be asked for must fit into 31 bits. */
static void sat__gl_settle(sat_gl *g, int width, int height)
{
    const sat_gl_options *o = &g->options;
    double table = (double)width * (double)height, area = o->max_box_area, largest = sat__gl_largest(g), range;
    g->quantum = 0;
    if (o->format == SAT_GL_FIXED32) {
        largest = o->max_value < 3.4028234663852886e38 ? o->max_value : 3.4028234663852886e38;
        if (!(area > 0) || (area > table && 2147483647.0 / area < 1.5)) area = table;
        range = 2147483647.0 / area - 0.5;
        g->quantum = o->unsigned_input && !(o->quantum > 0) ? 1 : o->quantum;
        if (!(g->quantum > 0)) {
            int exponent;
            double fraction = frexp(largest / range, &exponent);
            g->quantum = ldexp(1.0, fraction > 0.5 ? exponent : exponent - 1);
            if (g->quantum < 1e-36) g->quantum = ldexp(1.0, -119); /* the shader's 1 / quantum must be finite */
        }
        if (range * g->quantum < largest) largest = range * g->quantum;
    }
    g->limit = (float)largest;
}

/* Makes what is missing for a build of this size: nothing when the last one had it. */
static sat_result sat__gl_fit(sat_gl *g, int width, int height, int own_table)
{
    unsigned internal = sat__gl_internal(g->options.format);
    sat_result result = SAT_OK;
    if (g->width == width && g->height == height) {
        if (own_table && !g->table.texture) result = sat__gl_make_target(&g->gl, &g->table, internal, width, height);
        return result;
    }
    if (!g->options.width) sat__gl_free_textures(g);
    sat__gl_settle(g, width, height);
    g->width = width;
    g->height = height;
    if (own_table) result = sat__gl_have_target(g, &g->table, internal, width, height);
    if (result == SAT_OK) result = sat__gl_have_target(g, &g->partial, internal, width, height);
    if (result == SAT_OK && g->options.algorithm == SAT_SCAN_BALANCED_TREE) {
        result = sat__gl_make_tree(g, 0);
        if (result == SAT_OK) result = sat__gl_make_tree(g, 1);
    }
    if (result != SAT_OK) sat__gl_free_textures(g);
    return result;
}

/* ---- passes */

/* Everything of a pass but where it draws. */
static unsigned sat__gl_start(sat_gl *g, int pass, int axis, int size, unsigned source, unsigned uncles)
{
    sat__gl *gl = &g->gl;
    unsigned program = g->program[pass];
    gl->UseProgram(program);
    sat__gl_set_int2(gl, program, "axis", axis == 0, axis == 1);
    sat__gl_set_int(gl, program, "size", size);
    sat__gl_set_float(gl, program, "limit", g->limit);
    sat__gl_set_float(gl, program, "scale", g->quantum > 0 ? (float)(1 / g->quantum) : 1);
    SAT__GL_INPUTS(gl, source, uncles);
    return program;
}

static void sat__gl_draw_to(sat_gl *g, const sat__gl_target *to)
{
    g->gl.BindFramebuffer(SAT__GL_FRAMEBUFFER, to->framebuffer);
    g->gl.Viewport(0, 0, to->width, to->height);
    sat__gl_draw(&g->gl);
}

static void sat__gl_expand(sat_gl *g, int axis, const sat__gl_target *to, unsigned source, int is_input,
                           unsigned uncles)
{
    sat__gl *gl = &g->gl;
    int size = axis ? to->height : to->width, across = axis ? to->width : to->height, k = g->options.k;
    unsigned program = sat__gl_start(g, (g->compute ? SAT__GL_EXPAND_GROUPS : SAT__GL_EXPAND) + is_input, axis, size,
                                     source, uncles);
    if (g->compute) {
        sat__gl_set_int(gl, program, "across", across);
        gl->BindImageTexture(0, to->texture, 0, 0, 0, SAT__GL_WRITE_ONLY, sat__gl_internal(g->options.format));
        sat__gl_dispatch(g, (across + 63) / 64, (size + k - 1) / k, 1);
    } else {
        sat__gl_draw_to(g, to);
    }
}

/* Up the tree and down again, along one axis. */
static void sat__gl_tree(sat_gl *g, int axis, const sat__gl_target *to, unsigned source, int is_input)
{
    sat__gl_level *levels = g->levels[axis];
    int i, depth = g->depth[axis], length = axis ? g->height : g->width;
    for (i = 0; i < depth; i++) {
        sat__gl_start(g, SAT__GL_REDUCE + (is_input && i == 0), axis, length, i ? levels[i - 1].sums.texture : source,
                      0);
        sat__gl_draw_to(g, &levels[i].sums);
        length = axis ? levels[i].sums.height : levels[i].sums.width;
    }
    for (i = depth - 1; i >= 0; i--)
        sat__gl_expand(g, axis, &levels[i].scan, levels[i].sums.texture, 0,
                       i + 1 < depth ? levels[i + 1].scan.texture : 0);
    sat__gl_expand(g, axis, to, source, is_input, depth ? levels[0].scan.texture : 0);
}

static int sat__gl_doubling_passes(int n, int k)
{
    int passes = 0, reach = 1;
    for (; reach < n; passes++) reach *= k;
    return passes;
}

/* All passes of both axes alternate between two textures so that the last one writes the target. From the third pass
   along an axis on, the first k^(i-2) elements are left alone: they were complete two passes ago, in the same
   texture. */
static void sat__gl_double(sat_gl *g, int axes, const sat__gl_target *target, unsigned source)
{
    sat__gl *gl = &g->gl;
    sat__gl_target halves[2];
    int axis, i, done = 0, passes[2], total;
    passes[0] = sat__max_int(1, sat__gl_doubling_passes(g->width, g->options.k)); /* at least one reads the input */
    passes[1] = axes == 2 ? sat__gl_doubling_passes(g->height, g->options.k) : 0;
    total = passes[0] + passes[1];
    halves[0] = g->partial;
    halves[1] = *target;
    for (axis = 0; axis < axes; axis++) {
        int distance = 1, skip = 0;
        for (i = 0; i < passes[axis]; i++, done++) {
            const sat__gl_target *to = &halves[(total - done) & 1], *from = &halves[(total - done + 1) & 1];
            sat__gl_start(g, SAT__GL_DOUBLE + (done == 0), axis, distance, done ? from->texture : source, 0);
            gl->BindFramebuffer(SAT__GL_FRAMEBUFFER, to->framebuffer);
            if (axis) gl->Viewport(0, skip, g->width, g->height - skip);
            else gl->Viewport(skip, 0, g->width - skip, g->height);
            sat__gl_draw(gl);
            if (i > 0) skip = distance;
            distance *= g->options.k;
        }
    }
}

static void sat__gl_scan_axes(sat_gl *g, int axes, const sat__gl_target *target, unsigned source)
{
    if (g->options.algorithm == SAT_SCAN_RECURSIVE_DOUBLING) {
        sat__gl_double(g, axes, target, source);
    } else if (axes == 1 || g->height == 1) {
        sat__gl_tree(g, 0, target, source, 1);
    } else {
        sat__gl_tree(g, 0, &g->partial, source, 1);
        sat__gl_tree(g, 1, target, g->partial.texture, 0);
    }
}

/* Whether create left this size open, or has room for it. */
static int sat__gl_size_fits(const sat_gl *g, int width, int height)
{
    return g->options.width == 0 || (width <= g->options.width && height <= g->options.height);
}

static sat_result sat__gl_run(sat_gl *g, int axes, unsigned table, unsigned texture, int width, int height)
{
    sat__gl_state state;
    sat__gl_target target;
    sat_result result;
    if (!g || !g->ready || !texture || texture == table || width < 1 || height < 1) return SAT_ERR_ARGUMENT;
    if (!sat__gl_size_fits(g, width, height)) return SAT_ERR_SIZE;
    if (g->options.format == SAT_GL_TILED)
        return table || axes == 1 ? SAT_ERR_ARGUMENT : sat__gl_build_tiles(g, texture, width, height);
    sat__gl_begin(&g->gl, &state, 2);
    result = sat__gl_fit(g, width, height, !table);
    target = g->table;
    if (result == SAT_OK && table) {
        target = g->partial; /* its size */
        target.texture = table;
        target.framebuffer = g->borrowed;
        result = sat__gl_attach(&g->gl, g->borrowed, &table, 1, 0);
    }
    if (result == SAT_OK) sat__gl_scan_axes(g, axes, &target, texture);
    sat__gl_end(&g->gl, &state);
    return result;
}

SAT_DEF sat_result sat_gl_build(sat_gl *gl, unsigned table, unsigned texture, int width, int height)
{
    return sat__gl_run(gl, 2, table, texture, width, height);
}

SAT_DEF sat_result sat_gl_scan(sat_gl *gl, unsigned table, unsigned texture, int width, int height)
{
    return sat__gl_run(gl, 1, table, texture, width, height);
}

SAT_DEF unsigned sat_gl_table(const sat_gl *gl) { return gl ? gl->table.texture : 0; }
SAT_DEF double sat_gl_quantum(const sat_gl *gl) { return gl ? gl->quantum : 0; }

/* ---- mean */

static sat_result sat__gl_fit_means(sat_gl *g, int width, int height)
{
    sat_result result = SAT_OK;
    int k = g->mean_k, i = 0;
    if (g->mean_width == width && g->mean_height == height) return SAT_OK;
    if (!g->options.width) sat__gl_free_means(g);
    g->mean_width = width;
    g->mean_height = height;
    do { /* the last level is always the same texture */
        width = (width + k - 1) / k;
        height = (height + k - 1) / k;
        result = sat__gl_have_target(g, &g->means[i++].sums, SAT__GL_RG32F, width, height);
        g->mean_levels = sat__max_int(g->mean_levels, i);
    } while (result == SAT_OK && (width > 1 || height > 1 || i < g->mean_levels));
    if (result != SAT_OK) sat__gl_free_means(g);
    return result;
}

static void sat__gl_reduce_mean(sat_gl *g, unsigned source, int width, int height)
{
    sat__gl *gl = &g->gl;
    double area = (double)width * (double)height, largest = sat__gl_largest(g);
    int i;
    for (i = 0; i < g->mean_levels; i++) {
        const sat__gl_target *to = &g->means[i].sums;
        unsigned program = sat__gl_start(g, SAT__GL_MEAN + (i == 0), 0, 0, source, 0);
        sat__gl_set_int2(gl, program, "bounds", width, height);
        sat__gl_set_float(gl, program, "limit", (float)largest);
        sat__gl_set_float(gl, program, "factor", i + 1 < g->mean_levels ? 1.0f : (float)(1 / area));
        sat__gl_draw_to(g, to);
        source = to->texture;
        width = to->width;
        height = to->height;
    }
}

SAT_DEF sat_result sat_gl_mean(sat_gl *gl, float *mean, unsigned texture, int width, int height)
{
    sat__gl_state state;
    sat_result result;
    float texel[2] = {0, 0};
    if (!gl || !gl->ready || !texture || width < 1 || height < 1 || gl->options.unsigned_input) return SAT_ERR_ARGUMENT;
    if (!sat__gl_size_fits(gl, width, height)) return SAT_ERR_SIZE;
    sat__gl_begin(&gl->gl, &state, 2);
    result = sat__gl_fit_means(gl, width, height);
    if (result == SAT_OK) {
        sat__gl_reduce_mean(gl, texture, width, height);
        if (mean) {
            result = sat__gl_read(&gl->gl, texel, sat_gl_mean_texture(gl), SAT__GL_RG32F, 1, 1);
            if (result == SAT_OK) *mean = texel[0] + texel[1];
        }
    }
    sat__gl_end(&gl->gl, &state);
    return result;
}

SAT_DEF unsigned sat_gl_mean_texture(const sat_gl *gl)
{
    return gl && gl->mean_width ? gl->means[gl->mean_levels - 1].sums.texture : 0;
}

/* ---- creation */

SAT_DEF sat_result sat_gl_create(sat_gl **out, sat_gl_get_proc *get_proc, const sat_gl_options *options)
{
    sat_gl_options chosen = options ? *options : sat_gl_defaults();
    sat__gl_state state;
    sat_allocator allocator;
    sat_result result;
    sat_gl *g;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!get_proc || !sat__gl_options_are_valid(&chosen)) return SAT_ERR_ARGUMENT;
    if (!sat__resolve_allocator(&allocator, &chosen.allocator)) return SAT_ERR_ARGUMENT;
    g = (sat_gl *)sat__alloc(&allocator, sizeof *g);
    if (!g) return SAT_ERR_MEMORY;
    memset(g, 0, sizeof *g);
    g->options = chosen;
    g->options.allocator = allocator;
    *out = g;
    result = sat__gl_open(&g->gl, get_proc);
    if (result != SAT_OK) return result;
    g->gl.has_compute = g->compute = chosen.compute && g->gl.has_compute; /* image units are touched by nothing else */
    g->mean_k = sat__min_int(chosen.k, 8); /* squared */
    sat__gl_begin(&g->gl, &state, 2);
    g->gl.GenFramebuffers(1, &g->borrowed);
    result = sat__gl_make_programs(g);
    if (result == SAT_OK && chosen.width) {
        if (chosen.format == SAT_GL_TILED) result = sat__gl_fit_tiles(g, chosen.width, chosen.height);
        else result = sat__gl_fit(g, chosen.width, chosen.height, 1);
        if (result == SAT_OK && !chosen.unsigned_input) result = sat__gl_fit_means(g, chosen.width, chosen.height);
    }
    g->ready = result == SAT_OK;
    sat__gl_end(&g->gl, &state);
    return result;
}

SAT_DEF sat_result sat_gl_set_options(sat_gl *gl, const sat_gl_options *options)
{
    sat_gl_options o = options ? *options : sat_gl_defaults(), old;
    if (!gl || !gl->ready || !sat__gl_options_are_valid(&o)) return SAT_ERR_ARGUMENT;
    old = gl->options;
    if (o.format != old.format || o.algorithm != old.algorithm || o.k != old.k || o.compute != old.compute ||
        o.channel != old.channel || o.channels != old.channels || o.moments != old.moments ||
        o.unsigned_input != old.unsigned_input || o.width != old.width || o.height != old.height)
        return SAT_ERR_MISMATCH;
    o.allocator = old.allocator;
    gl->options = o;
    if (gl->width) sat__gl_settle(gl, gl->width, gl->height);
    return SAT_OK;
}

SAT_DEF void sat_gl_destroy(sat_gl *gl)
{
    sat_allocator allocator;
    if (!gl) return;
    if (gl->gl.vertex_array) {
        sat__gl_free_textures(gl);
        sat__gl_free_means(gl);
        sat__gl_delete_programs(&gl->gl, gl->program, SAT__GL_PROGRAMS);
        gl->gl.DeleteFramebuffers(1, &gl->borrowed);
        sat__gl_close(&gl->gl);
    }
    allocator = gl->options.allocator;
    sat__release(&allocator, gl, sizeof *gl);
}

SAT_DEF const char *sat_gl_message(const sat_gl *gl) { return gl ? gl->gl.message : ""; }

#ifdef __cplusplus
}
#endif
SAT__IEEE_END
#endif /* SAT__GL_IMPLEMENTED */

/* ------------------------------------------------------------------------------------------------
   Available under either of two licences: MIT No Attribution (MIT-0), or the Unlicense (public domain); the full texts
   are in the file LICENSE.

   MIT No Attribution. Copyright 2026 the lightscan authors. Permission is hereby granted, free of charge, to any person
   obtaining a copy of this software and associated documentation files (the "Software"), to deal in the Software
   without restriction, including without limitation the rights to use, copy, modify, merge, publish, distribute,
   sublicense, and/or sell copies of the Software, and to permit persons to whom the Software is furnished to do so.

   THE SOFTWARE IS PROVIDED "AS IS", WITHOUT WARRANTY OF ANY KIND, EXPRESS OR IMPLIED, INCLUDING BUT NOT LIMITED TO THE
   WARRANTIES OF MERCHANTABILITY, FITNESS FOR A PARTICULAR PURPOSE AND NONINFRINGEMENT. IN NO EVENT SHALL THE AUTHORS OR
   COPYRIGHT HOLDERS BE LIABLE FOR ANY CLAIM, DAMAGES OR OTHER LIABILITY, WHETHER IN AN ACTION OF CONTRACT, TORT OR
   OTHERWISE, ARISING FROM, OUT OF OR IN CONNECTION WITH THE SOFTWARE OR THE USE OR OTHER DEALINGS IN THE SOFTWARE.
   ------------------------------------------------------------------------------------------------ */
