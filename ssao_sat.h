/* ssao_sat.h - 0.1.0 - screen-space ambient occlusion from summed-area tables - SPDX-License-Identifier: MIT-0 OR
   Unlicense

   Accessibility of ambient light from a depth buffer: no random numbers, no blur pass, right in every depth convention.

   USE

       #define SAT_IMPLEMENTATION             // in exactly one C or C++ file
       #define SSAO_SAT_IMPLEMENTATION
       #include "ssao_sat.h"

       ssao_sat_input in = ssao_sat_input_linear(depth, width, height, 0.8);  // or fill in your projection matrix
       ssao_sat_options o = ssao_sat_defaults();
       ssao_sat *ao;
       o.radius = 0.5;                        // world units
       if (ssao_sat_create(&ao, width, height, &o) != SAT_OK) return 1;
       ssao_sat_apply(ao, open, 0, &in, NULL);// again for every frame; allocates nothing
       ssao_sat_destroy(ao);

   Build with `cc -std=c99 program.c -lm`; sat.h must lie beside this file. C99 and C++11. S = rho (L_direct + L_ambient
   open).

   WHAT IT DOES

   - SSAO_SAT_SLABS: the depth range is cut into slabs; tables of count, depth and position give the exact centroid of
     what each slab holds in 24 cells around a pixel, and the sines of these over the tangent plane are summed with
     their distance. COST puts its error beside that of others.
   - SSAO_SAT_PLANE: the table of 5.4.1 with two changes: it holds what is affine on planes (1/z in perspective, z in
     orthographic views), and the tangent plane is subtracted. A flat wall at any slant then gives exactly nothing.
   - The three methods of Slomp 2012, chapter 5, with what the text leaves open settled by measurement; `as_printed`
     keeps its letter.
   - One matrix decides the convention: linear, hardware or reversed depth, [-1,1] or [0,1], infinite far planes,
     off-centre, flipped, left-handed, orthographic, jittered, an oblique near plane (mirrors, water). What must be 0
     may be the rounding of a matrix product. A depth kind that contradicts the matrix is refused.
   - No pixel moves the frame, nor does a small object nearer or farther than all else (a bird): depth ranges leave out
     the nearest and farthest 4 of 256 blocks of a sample, and what lies beyond is in the end slabs.
   - Half-resolution tables (SLABS: of all pixels, so a wire counts at every column) with an upsample that knows planes
     and never reads sky; bent normals; signed depth unsharp masking; bands of rows for stills of any size; statistics
     of what was left out and of normals in the wrong space; 8 bits, half floats or floats; other sizes and options
     without a new object; OpenGL 3.3 / ES 3.0 with all of it, nothing compiled in a frame.
   - Pixels between estimates that agree are not estimated (options.tolerance): two thirds of what is in reach.

   WHAT IT DOES NOT

   - It sees what the depth buffer holds: occluders off the screen or behind others do not count. Nothing is assumed
     about thickness, so thin poles darken a little what lies behind them.
   - No temporal accumulation: there is no noise to accumulate away. No shading: the accessibility is yours to multiply.
   - Logarithmic depth is not decoded: give distances.
   - GTAO at half resolution has about the same error in less time (COST), at small radii a smaller one: cells average
     what samples resolve.
   - Smooth normals on a coarse mesh are believed: its facets then darken at their edges, unless options.geometric is
     set or normals are NULL: those from depth are the facets' own.

   DEVIATIONS from chapter 5, with their reasons

   - 5.4.3 keeps children whose mean is "higher" where 5.4.1 calls higher values farther: nearer ones are kept here,
     whatever the table holds. No child passes: eq 5.4 is 0/0 there; the parent counts.
   - 5.4.1 makes the region proportional to the depth and smaller with it: half side = radius focal length / depth.
   - 5.4.1 gives sky its own mean only where no object is near; here sky is skipped, and counts as far away for others.
   - 5.4.2 shifts along n.xy; a normal projects to n.xy - n.z (x, y) / z in perspective.
   - "1 - difference" has a unit: differences are divided by the radius. What 5.7 regrets, that near and far planes
     change the result, disappears with it.
   - 5.5 stores tables as half floats, which overflow at 512 x 512. Half floats are accepted as depths; tables are
     integers modulo 2^32.
   - Raw depth differences confuse slope with occlusion: fitted to ray tracing, MINIMALIST and its kin want nearly no
     gain at all. The defaults keep a faint effect; set gain to 3 to 10 for the look of the thesis.

   OPTIONS (macros)

     SSAO_SAT_IMPLEMENTATION  off     implementing file   brings the code; LIGHTSCAN_IMPLEMENTATION does so for all six
                              headers
     SSAO_SAT_STATIC          off     everywhere          all functions are private to each file
     SSAO_SAT_DEF             extern  everywhere          replaces the linkage
     SSAO_SAT_GL              off     everywhere          OpenGL; needs no GL header, loader or library
     SSAO_SAT_NO_SLABS        off     everywhere          without SSAO_SAT_SLABS; the default is then SSAO_SAT_PLANE;
                              implies NO_BENT
     SSAO_SAT_NO_REFINED      off     implementing file   without SSAO_SAT_REFINED
     SSAO_SAT_NO_BENT         off     everywhere          without ssao_sat_apply_bent
     SAT_NO_SIMD, SAT_NO_STDLIB, SAT_ASSERT               as in sat.h

   MEMORY, THREADS, ERRORS

   ssao_sat_create makes one allocation; frames make none. Bytes a pixel of the tables: 16 a slab and about 60; so 8
   slabs at half resolution take 47 a pixel of the picture. Stack: at most 5 KB. With band_rows the memory is that of
   band_rows + 2 max_pixels + 8 table rows.
   An object serves one call at a time. The input is only read. Every argument is checked in every build, and on an
   error nothing is written; ssao_sat_explain and ssao_sat_explain_input say in a sentence what was wrong. NULL options
   are the defaults. Options may carry a parallel_for: rows, slabs and estimates are shared out by it.

   ROWS, LIGHT, FAILURES

   Accessibilities are linear: multiply ambient light by them before tone mapping and sRGB. Strides are bytes: 0 packed,
   negative the bottom row first with the pointer at the top one; options.bottom_up where the picture itself is upside
   down, as OpenGL's. A create that fails sets *out to NULL and holds nothing (OpenGL: an object for its message, to be
   destroyed). On OpenGL pixels come in and go out by textures: the depth texture you drew to; out or
   ssao_sat_gl_texture sampled, or attached to a framebuffer for glReadPixels. Another radius each frame:
   ssao_sat_resize, on OpenGL ssao_sat_gl_set_options; both cost nothing. Another size: ssao_sat_resize, a hundredth of
   a frame; on OpenGL smaller width and height in the input, nothing.

   NUMERICS

   - Tables are integers modulo 2^32: sums over boxes are exact at every size (the picture may be 32768 wide), so a box
     mean is wrong by at most half a quantum: 2^-21 of its range (from a quarter of the nearest distance on) or less for
     regions up to 22 pixels, 2^-15 at 128. The same bits for any number of workers and any bands; with and without SIMD
     to the last bits of the compiler's float contraction.
   - Depths that are NaN, infinite, <= 0, cleared, or beyond 1e18 are sky: accessibility 1, part of no slab, never an
     occluder. Normals that are NaN, infinite or zero are taken from depth; any length will do.
   - The bias (a sine of 0.06) hides the rounding of depths. Conventions agree to 1e-3 as long as their depths resolve
     the radius.
   - Edges of slabs follow both the depth range and where pixels are: nine decades of depth keep their slabs useful.
   - Regions are cut at the border of the picture and divided by what is left. SLABS: what a cell loses goes to the
     cells beside the pixel, so that a crease keeps its value up to the border (within 0.03) without seams. Radii beyond
     max_pixels are cut and counted.

   COST

   Work a table pixel that is estimated: 16 lookups a ring and slab in reach; flat regions cost 4, what lies between
   estimates nothing. Fitted and measured at 512 x 512 with 256 rays a pixel, radii 0.1, 0.25, 0.6, gcc -O2 (SSE2), by
   fit_ssao_sat and bench_ssao_sat. The peers are four lanes wide as the slabs are, and at half resolution run in the
   slabs' own frame. RMSE of three scenes, to which the slabs' kernel and the peers' parameters were fitted:

     slabs (default) 0.058      4 slabs 0.060                   full resolution 0.058
     XeGTAO, half resolution:   low 0.087, medium 0.064, high 0.057, ultra 0.056
     XeGTAO, full resolution:   high 0.058, ultra 0.055
     visibility bitmasks:       half 3 x (3 + 3) 0.057 and 4 x (8 + 8) 0.058, full 4 x (8 + 8) 0.054
     HBAO 16 x 8:               half resolution 0.066, full resolution 0.064
     SSAO 16 + 15 x 15 blur:    0.073

   Scenes that nothing was fitted to, RMSE on other objects, on grass and poles, in a hall of 40 m:

     slabs (default)               0.038   0.104   0.065
     4 slabs                       0.040   0.113   0.067
     XeGTAO high, half and full    0.048   0.131   0.060    0.048   0.116   0.060
     XeGTAO ultra, half and full   0.047   0.125   0.059    0.046   0.115   0.055
     bitmask 4 x (8 + 8), the same 0.046   0.168   0.059    0.043   0.155   0.054
     HBAO 16 x 8, half and full    0.050   0.088   0.057    0.050   0.082   0.051

   Time, 1 = XeGTAO high at half resolution: slabs 1.0, 4 slabs 0.9; XeGTAO low 0.6, ultra 2.2; bitmask 1.5 and 4.1;
   HBAO 2.7; at full resolution slabs 2.3, XeGTAO 3.0 and 8.1, bitmask 14, HBAO 10; GTAO in scalar C at half resolution
   3.6; plane 0.8 with one box, 1.3 with 2 x 2; minimalist 0.7. So XeGTAO takes the same time for about the same error
   on scenes it was fitted to; the slabs carry over better to other objects, have the highest SSIM (0.92; XeGTAO 0.89)
   and no noise to denoise. A gliding camera changes the result by 0.0013 a frame in the corner, 0.0015 in the room,
   0.011 in grass, 0.0012 in the hall; XeGTAO high at half resolution by 0.0015, 0.0023, 0.030, 0.0010; HBAO by
   0.0011, 0.0015, 0.013, 0.0007. Time grows with the radius, because more slabs come into reach and less is flat:
   radii 0.1 : 0.25 : 0.6 cost 1 : 1.4 : 1.65, XeGTAO 1 : 1.2 : 1.3. Leaving out flat regions and rings changes
   nothing in the output; what lies between estimates is 0.002 RMS off an estimate and no farther from the ray
   tracer. Bent normals cost a fifth to a half and are 1 to 9 degrees off the ray-traced ones. RMSE of the others,
   fitted scenes and other objects: plane 0.118 and 0.103, 2 x 2 0.103 and 0.092; minimalist 0.184 and 0.139,
   normal-guided 0.174 and 0.222, refined 0.173 and 0.148.
   Box means of 1/z at 4096 x 4096: 5e-6 of a depth step off, where float tables are 0.6 off.
*/

/*
   CONTENTS: each section begins with its mark

   >> types                   interface: methods, input, options, statistics
   >> calls                   interface: create, apply, helpers for shading
   >> on OpenGL               interface: textures in and out
   >> vectors                 of four lanes
   >> object                  what it holds, the fitted kernel, the options' rows
   >> camera                  what one matrix decides
   >> reading pixels          distances and normals
   >> slabs                   depth range and edges
   >> regions                 sizes in pixels
   >> tables                  the rows of a band and their sums
   >> estimate by slabs       the default method
   >> estimate by one table   PLANE and the published methods
   >> output                  copied or upsampled
   >> frame                   bands, statistics
   >> entry points            checks, layout, create and apply
   >> shaders                 the same in GLSL
   >> passes                  programs, textures, frames
*/

#if defined(LIGHTSCAN_IMPLEMENTATION) && !defined(SSAO_SAT_IMPLEMENTATION)
#define SSAO_SAT_IMPLEMENTATION
#endif

#ifndef SSAO_SAT_H
#define SSAO_SAT_H

#define SSAO_SAT_VERSION_MAJOR 0
#define SSAO_SAT_VERSION_MINOR 1
#define SSAO_SAT_VERSION_PATCH 0
#define SSAO_SAT_VERSION (SSAO_SAT_VERSION_MAJOR * 10000 + SSAO_SAT_VERSION_MINOR * 100 + SSAO_SAT_VERSION_PATCH)

#if defined(SSAO_SAT_IMPLEMENT) || defined(SSAO_SAT_IMPL)
#error "ssao_sat.h: the macro is called SSAO_SAT_IMPLEMENTATION"
#endif

#if defined(SSAO_SAT_GL) && !defined(SAT_GL)
#define SAT_GL
#endif
#include "sat.h"
#if SAT_VERSION < 100
#error "ssao_sat.h needs sat.h 0.1.0 or newer"
#endif
#if defined(SSAO_SAT_NO_SLABS) && !defined(SSAO_SAT_NO_BENT)
#define SSAO_SAT_NO_BENT /* bent normals come from the slabs */
#endif

/* SSAO_SAT_STATIC makes every function private to the file; SSAO_SAT_DEF replaces the linkage altogether. */
#ifndef SSAO_SAT_DEF
#ifdef SSAO_SAT_STATIC
#define SSAO_SAT_DEF static inline
#else
#define SSAO_SAT_DEF extern
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------------------------------------
   >> types
   ------------------------------------------------------------------------------------------------ */

typedef enum ssao_sat_method {
    SSAO_SAT_SLABS,         /* centroids of depth slabs in cells at several scales */
    SSAO_SAT_PLANE,         /* mean of what is affine on planes, less the tangent plane, in 2x2 boxes */
    SSAO_SAT_MINIMALIST,    /* Slomp 2012, 5.4.1 */
    SSAO_SAT_NORMAL_GUIDED, /* Slomp 2012, 5.4.2 */
    SSAO_SAT_REFINED        /* Slomp 2012, 5.4.3, on 5.4.2 */
} ssao_sat_method;

/* What the depth buffer holds. The matrix that drew it says the rest. */
typedef enum ssao_sat_depth {
    SSAO_SAT_DEPTH_LINEAR,   /* distance along the view axis, > 0; sky: infinity, NaN, <= 0 or >= input.sky */
    SSAO_SAT_DEPTH_HARDWARE, /* 0..1, grows with distance; cleared to 1 */
    SSAO_SAT_DEPTH_REVERSED  /* 0..1, falls with distance; cleared to 0 */
} ssao_sat_depth;

/* One frame. View space is OpenGL's: +x right, +y up, the camera looks along -z. Row 0 is the top of the picture.
   Strides are bytes between rows, 0: packed, may be negative. */
typedef struct ssao_sat_input {
    const float *depth;
    ptrdiff_t depth_stride;
    int width, height;         /* those of ssao_sat_create */
    const float *normals;      /* view space xyz; NULL: derived from depth */
    ptrdiff_t normal_stride;
    ssao_sat_depth depth_kind; /* SSAO_SAT_DEPTH_LINEAR */
    float projection[16];      /* column-major, as OpenGL takes it; perspective or orthographic, off-centre, flipped,
                                  infinite far: all read from it */
    int clip_zero_to_one;      /* 0: the matrix maps depth to [-1,1] (OpenGL); 1: to [0,1] (Vulkan, Direct3D,
                                  glClipControl) */
    const uint16_t *half_depth;/* binary16 depths instead of `depth`, which is then NULL */
    float sky;                 /* LINEAR: distances >= sky are sky; 0: only infinity is */
    int left_handed;           /* 0; 1: the camera looks along +z (Direct3D): of the matrix, the normals and the bent
                                  normals */
} ssao_sat_input;

/* default; range */
typedef struct ssao_sat_options {
    ssao_sat_method method;  /* SSAO_SAT_SLABS; 0..4 */
    double radius;           /* 0.5; 0..1e15; world units: occluders farther away than this do not count; 0: all is
                                open */
    double gain;             /* 1; 0..1e6; times the strength fitted for the method; 0: all is open */
    double power;            /* 1; 0.001..1000; exponent on the accessibility, on top of the fitted one */
    int half_resolution;     /* 1; 0..1; tables and estimates for every second pixel of every second row, then a
                                plane-aware upsample (5.5); SLABS: the tables hold all pixels, the others every
                                fourth */
    int slabs;               /* 8; 1..16; 4 halve the memory */
    int scales;              /* 3; 1..4; rings of cells, each a third of the one before */
    int plane_boxes;         /* 2; 1..2; PLANE uses n x n boxes */
    double normal_offset;    /* 1.5; 0..1000; NORMAL_GUIDED, REFINED: shift of the region, in its half sizes */
    int refine_levels;       /* 2; 0..2 */
    double refine_threshold; /* 0.15; 0..1e6; regions are split while |mean - depth| < this part of the depth */
    int as_printed;          /* 0; 0..1; the text of 5.4.2 and 5.4.3 to the letter: shift along n.xy, keep the children
                                of higher value */
    double region_pixels;    /* 0; 0..512; 0: the region follows the projected radius; else half its side in pixels, for
                                all pixels */
    double depth_gain;       /* 0; -1..1e6; gain grows by this factor from the nearest to the farthest pixel (published
                                methods) */
    int inverted_depth;      /* 0; 0..1; published methods average 1 / depth (5.5) */
    int float_table;         /* 0; 0..2; integers modulo 2^32; 1: floats, 2: floats less the mean (4.6): for comparison
                                only */
    double min_pixels;       /* 1.5; 1..512; regions with a smaller half side fade out, measured in pixels of the
                                tables */
    double max_pixels;       /* 256; 1..512; at least min_pixels: regions are cut to this half side */
    int band_rows;           /* 0; 16..32768 or 0; tables of this many rows and a radius above and below; 0: of the
                                whole picture */
    int bottom_up;           /* 0; 0..1; row 0 is the bottom of the picture, in all buffers */
    int skip_flat;           /* 1; 0..1; regions that are one plane are not looked at */
    double tolerance;        /* 0.04; 0..1; SLABS: where neighbours on one surface agree to this, what lies between
                                takes their mean; 0: every table pixel is estimated */
    int geometric;           /* 0; 0..1; SLABS, normals given: what lies below the surface itself, the tangent plane of
                                the normal from depth, does not occlude: for smooth normals on coarse meshes */
    int gl_bent;             /* 0; 0..1; OpenGL, SLABS: programs and textures of ssao_sat_gl_apply_bent are made too */
    int gl_signed;           /* 0; 0..1; OpenGL: those of ssao_sat_gl_apply_signed */
    sat_allocator allocator; /* malloc; used by create and destroy only */
    sat_threads threads;     /* serial; same bits for any worker count */
} ssao_sat_options;

/* What the last call met. Counts are pixels of the tables (a quarter of the picture at half resolution). */
typedef struct ssao_sat_stats {
    size_t pixels;            /* of the tables; = sky + tiny + flat + interpolated + estimated */
    size_t sky;               /* nothing there, or depth not a positive finite number */
    size_t tiny;              /* radius below min_pixels */
    size_t flat;              /* left out: the whole region is one plane */
    size_t interpolated;      /* SLABS: between neighbours that agree to options.tolerance */
    size_t estimated;
    size_t border;            /* estimated with a region that the picture's border cuts */
    size_t cut;               /* radius cut to max_pixels */
    size_t slabs_visited, slabs_skipped; /* SLABS, summed over groups of pixels: outside [z - R, z + R], or empty */
    size_t lookups;           /* published methods and PLANE: table entries read */
    size_t normals_replaced;  /* given normals that were NaN, infinite or zero */
    size_t normals_backfacing;/* given normals that point away from the camera: most of them, when a convention is
                                 wrong */
    size_t normals_compared, normals_off; /* of the 32 x 32 sample; those more than 45 degrees off the normal from
                                             depth: a tenth of them or more when the normals are not in view space */
    double nearest, farthest; /* depth range; 0, 0 when all is sky */
    size_t bytes;             /* memory the object holds */
} ssao_sat_stats;

typedef struct ssao_sat ssao_sat;

/* ------------------------------------------------------------------------------------------------
   >> calls
   ------------------------------------------------------------------------------------------------ */

SSAO_SAT_DEF int ssao_sat_version(void);
SSAO_SAT_DEF ssao_sat_options ssao_sat_defaults(void);
/* Linear depth and a symmetric perspective of this vertical field of view: fill in buffers and strides. */
SSAO_SAT_DEF ssao_sat_input ssao_sat_input_linear(const float *depth, int width, int height, double fov_y);

/* Scratch memory for pictures of this size; exactly one allocation. 1 <= width, height <= 32768. NULL options: the
   defaults. */
SSAO_SAT_DEF sat_result ssao_sat_create(ssao_sat **out, int width, int height, const ssao_sat_options *options);
/* Another size or other options in the memory that create took: SAT_ERR_SIZE when it does not hold them, and nothing
   changes. The allocator stays; NULL options: as they are. Costs nothing but where the layout changes (one pass over
   the memory). */
SSAO_SAT_DEF sat_result ssao_sat_resize(ssao_sat *ao, int width, int height, const ssao_sat_options *options);
/* What create or apply says SAT_ERR_ARGUMENT to, in a sentence ("scales is 99; 1..4") written into `text` and returned;
   "" for nothing. */
SSAO_SAT_DEF const char *ssao_sat_explain(char *text, size_t size, int width, int height,
                                          const ssao_sat_options *options);
SSAO_SAT_DEF const char *ssao_sat_explain_input(char *text, size_t size, const ssao_sat_input *input);
/* Accessibility of every pixel, 0 blocked .. 1 open; sky is 1. Allocates nothing. The output must not overlap the
   input. stats may be NULL. On an error nothing is written. */
SSAO_SAT_DEF sat_result ssao_sat_apply(ssao_sat *ao, float *accessibility, ptrdiff_t out_stride,
                                       const ssao_sat_input *input, ssao_sat_stats *stats);
/* The same in 8 bits (255 open) or in half floats, without a float picture in between; rounded to nearest. */
SSAO_SAT_DEF sat_result ssao_sat_apply_u8(ssao_sat *ao, uint8_t *accessibility, ptrdiff_t out_stride,
                                          const ssao_sat_input *input, ssao_sat_stats *stats);
SSAO_SAT_DEF sat_result ssao_sat_apply_half(ssao_sat *ao, uint16_t *accessibility, ptrdiff_t out_stride,
                                            const ssao_sat_input *input, ssao_sat_stats *stats);
#ifndef SSAO_SAT_NO_BENT
/* The same as apply, and the mean unblocked direction (unit, view space, xyz; the normal where all is open, 0 0 1 on
   sky): look up irradiance along it instead of the normal. SLABS only. */
SSAO_SAT_DEF sat_result ssao_sat_apply_bent(ssao_sat *ao, float *accessibility, ptrdiff_t out_stride,
                                            float *bent_normals, ptrdiff_t bent_stride, const ssao_sat_input *input,
                                            ssao_sat_stats *stats);
#endif
/* Depth unsharp masking (Luft 2006): mean depth of the region less the own depth, over the radius, times options.gain,
   clamped to -1..1: negative in creases and beside nearer objects, positive on ridges and rims. Sky is 0. From the same
   table. */
SSAO_SAT_DEF sat_result ssao_sat_apply_signed(ssao_sat *ao, float *out, ptrdiff_t out_stride,
                                              const ssao_sat_input *input, ssao_sat_stats *stats);
/* Light that bounces more than once (Jimenez 2016, eq 10): accessibility of a surface with this albedo, 0..1, one
   colour at a time. */
SSAO_SAT_DEF float ssao_sat_multi_bounce(float accessibility, float albedo);
/* How much of a highlight is open (Jimenez 2016, section 6): the overlap of two cones, that of the accessibility around
   the bent normal and that of the reflection. cosine: between bent normal and reflected view direction; roughness
   0..1. */
SSAO_SAT_DEF float ssao_sat_specular(float accessibility, float cosine, float roughness);
/* What the upsample weighs a neighbour by, for half-resolution effects of your own: 1 on the same plane with the same
   normal, 1e-4 on another surface. View positions and unit normals (xyz) of a pixel and of the one taken from; times
   1 / ((1 + dx^2) (1 + dy^2)) of the distance in pixels, over the 3 x 3 nearest that are not sky. 0 for NULL. */
SSAO_SAT_DEF float ssao_sat_edge(const float *position, const float *normal, const float *from,
                                 const float *from_normal);
SSAO_SAT_DEF void ssao_sat_destroy(ssao_sat *ao); /* NULL is fine */

#ifdef __cplusplus
}
#endif
#endif /* SSAO_SAT_H */
#if defined(SSAO_SAT_GL) && !defined(SSAO_SAT__GL_API)
#define SSAO_SAT__GL_API

#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------------------------------------
   >> on OpenGL: 3.3 core or ES 3.0 (with EXT_color_buffer_float)
   ------------------------------------------------------------------------------------------------ */

/* Belongs to the context that is current in create: it must be current in every call. Every call leaves the OpenGL
   state as it was (but for pending errors, which are lost). Does not wait for the GPU. All methods; band_rows, threads,
   float_table, tolerance and skip_flat mean nothing here. Textures drawn by OpenGL have the bottom row first: set
   options.bottom_up. */
typedef struct ssao_sat_gl ssao_sat_gl;

/* On an OpenGL error *out only answers ssao_sat_gl_message, and is to be destroyed; on the others it is NULL. */
SSAO_SAT_DEF sat_result ssao_sat_gl_create(ssao_sat_gl **out, sat_gl_get_proc *get_proc, int width, int height,
                                           const ssao_sat_options *options);
/* depth: a 2D texture whose red is the depth (R32F, R16F, or a depth format without comparison). normals: its red,
   green, blue are the view-space normal, signed; 0: from depth. Both may be larger than the picture, which lies at
   to->from. to: its red gets the accessibility; NULL: the object's own R32F, ssao_sat_gl_texture(). Of `input` only
   width, height, depth_kind, projection, clip_zero_to_one, sky and left_handed count. Another size a frame (dynamic
   resolution): width and height may be anything up to those of create, larger ones are SAT_ERR_SIZE; the own textures
   then hold the picture in their corner. */
SSAO_SAT_DEF sat_result ssao_sat_gl_apply(ssao_sat_gl *gl, const sat_gl_target *to, unsigned depth, unsigned normals,
                                          const ssao_sat_input *input);
#ifndef SSAO_SAT_NO_BENT
/* The same and the mean unblocked direction (see ssao_sat_apply_bent): of `to` red, green and blue get the direction,
   signed, and alpha the accessibility, so let it be RGBA16F or the like; NULL: the object's own,
   ssao_sat_gl_bent_texture(). For objects made with options.gl_bent. */
SSAO_SAT_DEF sat_result ssao_sat_gl_apply_bent(ssao_sat_gl *gl, const sat_gl_target *to, unsigned depth,
                                               unsigned normals, const ssao_sat_input *input);
SSAO_SAT_DEF unsigned ssao_sat_gl_bent_texture(const ssao_sat_gl *gl);
#endif
/* Depth unsharp masking, -1..1 (see ssao_sat_apply_signed) in the red of `to`; NULL: ssao_sat_gl_texture(). For objects
   made with options.gl_signed. */
SSAO_SAT_DEF sat_result ssao_sat_gl_apply_signed(ssao_sat_gl *gl, const sat_gl_target *to, unsigned depth,
                                                 unsigned normals, const ssao_sat_input *input);
/* Other options from the next frame on. Those that shaders and textures are made for stay: method, half_resolution,
   slabs, scales, plane_boxes, refine_levels, as_printed, inverted_depth, gl_bent, gl_signed: SAT_ERR_MISMATCH when one
   differs. The rest are uniforms and free. */
SSAO_SAT_DEF sat_result ssao_sat_gl_set_options(ssao_sat_gl *gl, const ssao_sat_options *options);
SSAO_SAT_DEF unsigned ssao_sat_gl_texture(const ssao_sat_gl *gl);
/* What the last SAT_ERR_GL_... was about; never NULL, and NULL is fine. */
SSAO_SAT_DEF const char *ssao_sat_gl_message(const ssao_sat_gl *gl);
SSAO_SAT_DEF void ssao_sat_gl_destroy(ssao_sat_gl *gl); /* NULL is fine */

/* GLSL (3.30 or ES 3.00) to put behind the #version line of a shader. `view` is the 12 floats of ssao_sat_gl_view as
   vec4 view[3]:

       float ssao_sat_distance(vec4 view[3], ivec2 pixel, float d)
           from a depth value to a distance; 0: nothing there
       float ssao_sat_distance(vec4 view[3], float d)
           the same, but for oblique near planes
       vec3  ssao_sat_position(vec4 view[3], ivec2 pixel, float z)
           z points forward
       vec3  ssao_sat_depth_normal(vec4 view[3], sampler2D depth, ivec2 pixel, float z)
           the same axes
       float ssao_sat_edge(vec3 p, vec3 n, vec3 from, vec3 from_n)
           see above; z forward, from ssao_sat_position */
SSAO_SAT_DEF const char *ssao_sat_gl_glsl(void);
SSAO_SAT_DEF sat_result ssao_sat_gl_view(float *view, const ssao_sat_input *input, int bottom_up);

#ifdef __cplusplus
}
#endif
#endif /* SSAO_SAT__GL_API */
/* ------------------------------------------------------------------------------------------------
   Stop here if you only want to use the library.
   ------------------------------------------------------------------------------------------------ */

#if defined(SSAO_SAT_IMPLEMENTATION) && !defined(SSAO_SAT_IMPLEMENTED)
#define SSAO_SAT_IMPLEMENTED

#ifndef SAT_SIBLING
#define SAT_SIBLING
#endif
#if defined(SSAO_SAT_GL) && !defined(SAT_SIBLING_GL)
#define SAT_SIBLING_GL
#endif
#include "sat.h"

SAT__IEEE_BEGIN
#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------------------------------------
   >> vectors: of four, those of sat.h. One kernel serves SSE2, NEON and plain C.
   ------------------------------------------------------------------------------------------------ */

static inline sat__f32x4 ssao_sat__if_positive(sat__f32x4 a, sat__f32x4 b) /* a > 0 ? b : 0 */
{
    return sat__f32x4_select(sat__f32x4_less(sat__f32x4_set1(0), a), b, sat__f32x4_set1(0));
}

static inline int ssao_sat__any_positive(sat__f32x4 a)
{
    return sat__i32x4_any(sat__f32x4_less(sat__f32x4_set1(0), a));
}

/* Words of the tables: unsigned, with the same sums. */
static inline sat__i32x4 ssao_sat__load_words(const uint32_t *p)
{
    return sat__i32x4_load((const int32_t *)(const void *)p);
}

static inline void ssao_sat__store_words(uint32_t *p, sat__i32x4 v) { sat__i32x4_store((int32_t *)(void *)p, v); }

static inline sat__f32x4 ssao_sat__dot(const sat__f32x4 *a, const sat__f32x4 *b)
{
    return sat__f32x4_add(sat__f32x4_add(sat__f32x4_mul(a[0], b[0]), sat__f32x4_mul(a[1], b[1])),
                          sat__f32x4_mul(a[2], b[2]));
}

static inline void ssao_sat__transpose(sat__f32x4 *m)
{
#if defined(SAT__SSE2)
    _MM_TRANSPOSE4_PS(m[0], m[1], m[2], m[3]);
#else
    float rows[16], columns[16];
    int i;
    for (i = 0; i < 4; i++) sat__f32x4_store(rows + 4 * i, m[i]);
    for (i = 0; i < 16; i++) columns[i] = rows[i % 4 * 4 + i / 4];
    for (i = 0; i < 4; i++) m[i] = sat__f32x4_load(columns + 4 * i);
#endif
}

/* ------------------------------------------------------------------------------------------------
   >> object: and frame, fitted numbers, options
   ------------------------------------------------------------------------------------------------ */

enum {
    SSAO_SAT__LEVEL_BITS = 20, /* of a word; then the slab, then SSAO_SAT__ROUGH */
    SSAO_SAT__NOTHING = 31 << SSAO_SAT__LEVEL_BITS,
    SSAO_SAT__ROUGH = 1 << 30,  /* in the first word of a table pixel: its pixels are no plane */
    SSAO_SAT__PAD = 16,       /* words of nothing left and right of a row: neighbours may be read blindly */
    SSAO_SAT__MAX_SIDE = 32768, /* of a picture */
    SSAO_SAT__MAX_SLABS = 16,
    SSAO_SAT__MAX_SCALES = 4,
    SSAO_SAT__BLOCK = 8,      /* table pixels of a row that are asked for a slab together */
    SSAO_SAT__GRID = 32,      /* the slabs are cut from a sample of 32 x 32 depths ... */
    SSAO_SAT__SPACING = 4,    /* of the table pixels that are estimated in any case; a power of 2 */
    SSAO_SAT__TRIM = 4        /* ... less the nearest and farthest 4 of its 256 blocks */
};
#define SSAO_SAT__BINS 256    /* the sample is counted in so many bins */
#define SSAO_SAT__MARGIN 4.0f  /* quanta hold what is nearer than the range by this factor */
#define SSAO_SAT__BEYOND 0.73f /* of a side's weight that the border takes, to the cells beside the pixel: a corner
                                  keeps its value */
#define SSAO_SAT__BLOCKED 2.0f  /* length of blocked directions against occlusion, fitted */
#define SSAO_SAT__SHARPNESS 50.0f /* upsampling: a neighbour off the tangent plane by 1/50 of the distance weighs no
                                  more than */
#define SSAO_SAT__ELSEWHERE 1e-4f /* one on another surface, against 1 on the same */
#define SSAO_SAT__BEND 0.2f   /* there is interpolation between neighbours on a plane up to a tenth of a radius, */
#define SSAO_SAT__ALIKE 0.9f  /* with normals less than 25 degrees apart */
#define SSAO_SAT__COARSE 6    /* half side from which it may be between those two apart */
#define SSAO_SAT__FAR 1e18f   /* distances beyond are sky: their squares would overflow */
#define SSAO_SAT__LEAST_AFFINE 1e-30f  /* 1/z from which on there is a distance */
#define SSAO_SAT__LEAST_SQUARE 1e-20f  /* of normals that are a direction */
#define SSAO_SAT__LARGEST_RADIUS 1e15f /* what is added to depth ranges for it, so that they stay finite */
#define SSAO_SAT__BEHIND 1.05f /* published methods: sky lies at this many farthest distances */
#define SSAO_SAT__GRAZING 1e-3f /* PLANE: normals that face the camera less count as facing it so much */
#define SSAO_SAT__RANGE_SLACK 0.001f /* of the range's ends, for the rounding of what lies there */
#define SSAO_SAT__OPEN_LENGTH (2 / 3.0f) /* mean direction of an open hemisphere along its normal */
#define SSAO_SAT__NO_DIRECTION 1e-3f /* bent normals shorter than this are the normal */

/* What was fitted to ray-traced references by tests/bench/bench_ssao_sat.c. reach: half side of the region in radii.
   range: SLABS: occluders count less with their distance, to nothing at this many radii; PLANE: heights h (in radii)
   count as h / (1 + range h^2). */
typedef struct ssao_sat__fit { float reach, range, bias, gain, power; } ssao_sat__fit;
static const ssao_sat__fit ssao_sat__fits[6] = {
    {0.91f, 1.8f, 0.06f, 1.0f, 3.0f},  /* SLABS: see ssao_sat__kernels */
    {0.3f, 8.0f, 0.00f, 3.3f, 1.0f},   /* PLANE, 2 x 2 boxes */
    {0.6f, 0.0f, 0.00f, 0.1f, 1.0f},   /* MINIMALIST: the fit wants no more than this; artists may */
    {1.5f, 0.0f, 0.00f, 0.1f, 1.0f},   /* NORMAL_GUIDED */
    {0.3f, 0.0f, 0.00f, 0.06f, 1.0f},  /* REFINED */
    {0.3f, 16.0f, 0.00f, 1.6f, 2.0f}   /* PLANE, one box */
};
/* SLABS: what an occluder counts, by its sine s over the tangent plane (less the bias) and its distance d in radii, in
   each ring, outermost first: sum of term[4 i + j] s^(i + 1) d^j. And what all of them count on surfaces seen at a
   grazing angle and face on, linear in n.v between these and 1 at n.v = 1/2. For 1 to 4 rings, fitted by
   tests/bench/fit_ssao_sat.c to four ray-traced scenes, with changes from frame to frame and of a crease at the border
   of the picture as penalties. */
enum { SSAO_SAT__TERMS = 12 };
typedef struct ssao_sat__kernel { float term[4][SSAO_SAT__TERMS], grazing, facing; } ssao_sat__kernel;
static const ssao_sat__kernel ssao_sat__kernels[4] = {
    {{{0.1625f, -0.0067f, -0.0875f, -0.0332f, -0.0911f, -0.0306f,
       0.0788f, 0.2081f, 0.1180f, -0.0654f, -0.0915f, -0.0080f}, {0}, {0}, {0}},
     1.320f, 0.607f},
    {{{0.1587f, -0.0488f, -0.0977f, 0.0110f, -0.0772f, -0.0400f,
       0.0432f, 0.1863f, -0.0203f, 0.1073f, -0.0017f, -0.1147f},
      {0.0801f, -0.0148f, -0.0690f, -0.0063f, -0.1307f, 0.1243f,
       0.0695f, 0.1122f, 0.1299f, 0.0266f, -0.2068f, -0.0776f}, {0}, {0}},
     1.185f, 0.563f},
    {{{0.1648f, -0.0545f, -0.0977f, 0.0098f, -0.0830f, -0.0492f,
       0.0569f, 0.1922f, -0.0179f, 0.1095f, 0.0192f, -0.1392f},
      {0.0547f, 0.0221f, -0.0626f, -0.0044f, -0.1230f, 0.1090f,
       0.0300f, 0.0973f, 0.0991f, 0.0972f, -0.1832f, -0.0885f},
      {0.0355f, -0.0650f, -0.0876f, 0.0504f, 0.0455f, 0.0312f,
       0.0380f, 0.0523f, -0.0499f, -0.0525f, 0.0426f, -0.0714f}, {0}},
     1.163f, 0.560f},
    {{{0.1646f, -0.0555f, -0.0989f, 0.0110f, -0.0823f, -0.0477f,
       0.0565f, 0.1934f, -0.0204f, 0.1130f, 0.0186f, -0.1422f},
      {0.0568f, 0.0070f, -0.0532f, -0.0075f, -0.1150f, 0.1135f,
       0.0384f, 0.0992f, 0.0920f, 0.0889f, -0.1915f, -0.0851f},
      {-0.0138f, 0.0144f, -0.1426f, 0.0520f, 0.0955f, 0.1238f,
       -0.0486f, 0.0862f, -0.0662f, -0.0508f, -0.0639f, -0.0225f},
      {0.0692f, -0.1379f, 0.1410f, -0.0462f, -0.0568f, -0.1758f,
       0.0963f, 0.0460f, -0.0085f, 0.1553f, 0.0398f, -0.1124f}},
     1.179f, 0.567f}};

/* View position of table pixel (i, j) at distance z along the axis: ((ax i + bx) s, (ay j + by) s, z), s = z in
   perspective and 1 in orthographic views. z points forward here, away from the camera. */
typedef struct ssao_sat__camera {
    double full[4];         /* ax, bx, ay, by for pixels of the picture, whose centres lie at i + 1/2 */
    float ax, bx, ay, by;   /* for pixels of the tables, centre offset included */
    double depth_a, depth_b;/* 1/z (perspective) or z (orthographic) = depth_a d + depth_b + tilt . pixel */
    double tilt[2];         /* of an oblique near plane */
    float forward;          /* z of the view space that z forward is: -1, left-handed +1 */
    int orthographic;
    float pixels;           /* table pixels per world unit, at z = 1 in perspective */
    float aspect;           /* those along y over those along x */
} ssao_sat__camera;

/* Arrays of pixels: distance, normal, accessibility, and the sum of the directions that are blocked. */
typedef struct ssao_sat__pixels { float *z, *nx, *ny, *nz, *open, *blocked[3]; } ssao_sat__pixels;

/* Pixels begin, begin + step, ... before end, of row y of the picture. */
typedef struct ssao_sat__strip { int y, begin, end, step; } ssao_sat__strip;

typedef struct ssao_sat__rect { int x0, y0, x1, y1; } ssao_sat__rect; /* half open */

/* What a call writes: `element` is bytes of an accessibility, 4 for float, 2 for half, 1 for 8 bits. */
typedef struct ssao_sat__output {
    void *out;
    float *bent;            /* or NULL */
    ptrdiff_t stride, bent_stride;
    int element, is_signed;
} ssao_sat__output;

/* One slab: depths between two edges. Its words: count, sum of the quantised affine depth, of x, of y. */
typedef struct ssao_sat__slab { float low, quantum, inverse; uint32_t top; } ssao_sat__slab; /* levels 0 .. top */

typedef struct ssao_sat__worker {
    ssao_sat_stats stats;
    float nearest, farthest;
} ssao_sat__worker;

struct ssao_sat {
    ssao_sat_options options;
    void *block;
    size_t bytes;
    int width, height;      /* of the picture */
    int step;               /* 2 at half resolution */
    int columns, rows;      /* of the tables: ceil(width / step), ceil(height / step) */
    int capacity, reserve;  /* rows held at once; those of them above and below the ones being estimated */
    size_t stride, table_stride, table_plane;
    int tables;             /* words a pixel: 4 a slab, or 1 */
    /* arrays of `capacity` rows, `stride` apart */
    ssao_sat__pixels work;
    float *affine;
    float *lower;           /* affine depth of the pixel below: half resolution has one between two table rows */
    uint32_t *words;        /* step x step a table pixel, rows `word_stride` apart: slab and quantised affine depth,
                               SSAO_SAT__NOTHING */
    size_t word_stride;
    uint32_t *row_slabs;    /* which slabs occur in the row */
    uint32_t *block_slabs;  /* and in each BLOCK pixels of it */
    size_t blocks;          /* in a row */
    uint32_t *table, *flags;
    float *scratch;         /* per worker: a row of the picture */
    ssao_sat__worker *workers;

    /* this frame */
    ssao_sat_input input;
    ssao_sat__camera camera;
    ssao_sat__fit fit;
    float radius, reach;    /* world units; reach = radius fit.reach */
    float range;            /* SLABS: world units */
    float limit, largest;   /* half sides in table pixels: allowed, and of the nearest pixel */
    float nearest, farthest; /* the range that slabs and quanta follow */
    float band_nearest, band_farthest; /* of all pixels held so far */
    float edge[SSAO_SAT__MAX_SLABS + 1]; /* distances; what lies before the first or behind the last is in the end
                                            slabs */
    ssao_sat__slab slabs[SSAO_SAT__MAX_SLABS];
    uint32_t used_slabs;
    ssao_sat__slab value;   /* single table: how a value is quantised */
    float sky_value, mean;  /* what stands for sky in it; mean taken off float tables */
    float flat_limit;
    int frame_slabs;        /* <= options.slabs */
    ssao_sat__output to;
    int geometric;          /* the option, where normals are given */
    /* this band: rows [first, first + held) are held, [begin, end) estimated */
    int first, held, begin, end;
    int estimated_first;    /* of the rows that are estimated: the band's, and those its pixels take from */
    int spacing;            /* of the pixels of this pass */
};

SSAO_SAT_DEF int ssao_sat_version(void) { return SSAO_SAT_VERSION; }

/* Defaults, ranges and names of the options: the comments of the struct say the same. */
#ifdef SSAO_SAT_NO_SLABS
enum { SSAO_SAT__FIRST_METHOD = SSAO_SAT_PLANE };
#else
enum { SSAO_SAT__FIRST_METHOD = SSAO_SAT_SLABS };
#endif
#ifdef SSAO_SAT_NO_REFINED
enum { SSAO_SAT__LAST_METHOD = SSAO_SAT_NORMAL_GUIDED };
#else
enum { SSAO_SAT__LAST_METHOD = SSAO_SAT_REFINED };
#endif
static const sat__field ssao_sat__fields[] = {
    SAT__FIELD(ssao_sat_options, 'i', method, SSAO_SAT__FIRST_METHOD, SSAO_SAT__FIRST_METHOD, SSAO_SAT__LAST_METHOD, ' '),
    SAT__FIELD(ssao_sat_options, 'd', radius, 0.5, 0, 1e15, ' '),
    SAT__FIELD(ssao_sat_options, 'd', gain, 1, 0, 1e6, ' '),
    SAT__FIELD(ssao_sat_options, 'd', power, 1, 0.001, 1000, ' '),
    SAT__FIELD(ssao_sat_options, 'i', half_resolution, 1, 0, 1, ' '),
    SAT__FIELD(ssao_sat_options, 'i', slabs, 8, 1, 16, ' '),
    SAT__FIELD(ssao_sat_options, 'i', scales, 3, 1, 4, ' '),
    SAT__FIELD(ssao_sat_options, 'i', plane_boxes, 2, 1, 2, ' '),
    SAT__FIELD(ssao_sat_options, 'd', normal_offset, 1.5, 0, 1000, ' '),
    SAT__FIELD(ssao_sat_options, 'i', refine_levels, 2, 0, 2, ' '),
    SAT__FIELD(ssao_sat_options, 'd', refine_threshold, 0.15, 0, 1e6, ' '),
    SAT__FIELD(ssao_sat_options, 'i', as_printed, 0, 0, 1, ' '),
    SAT__FIELD(ssao_sat_options, 'd', region_pixels, 0, 0, 512, ' '),
    SAT__FIELD(ssao_sat_options, 'd', depth_gain, 0, -1, 1e6, ' '),
    SAT__FIELD(ssao_sat_options, 'i', inverted_depth, 0, 0, 1, ' '),
    SAT__FIELD(ssao_sat_options, 'i', float_table, 0, 0, 2, ' '),
    SAT__FIELD(ssao_sat_options, 'd', min_pixels, 1.5, 1, 512, ' '),
    SAT__FIELD(ssao_sat_options, 'd', max_pixels, 256, 1, 512, ' '),
    SAT__FIELD(ssao_sat_options, 'i', band_rows, 0, 16, 32768, '0'),
    SAT__FIELD(ssao_sat_options, 'i', bottom_up, 0, 0, 1, ' '),
    SAT__FIELD(ssao_sat_options, 'i', skip_flat, 1, 0, 1, ' '),
    SAT__FIELD(ssao_sat_options, 'd', tolerance, 0.04, 0, 1, ' '),
    SAT__FIELD(ssao_sat_options, 'i', geometric, 0, 0, 1, ' '),
    SAT__FIELD(ssao_sat_options, 'i', gl_bent, 0, 0, 1, ' '),
    SAT__FIELD(ssao_sat_options, 'i', gl_signed, 0, 0, 1, ' '),
    SAT__FIELD(ssao_sat_options, 'a', allocator, 0, 0, 0, ' '),
    SAT__FIELD(ssao_sat_options, 't', threads, 0, 0, 0, ' ')};
enum { SSAO_SAT__FIELDS = sizeof ssao_sat__fields / sizeof ssao_sat__fields[0] };

SSAO_SAT_DEF ssao_sat_options ssao_sat_defaults(void)
{
    ssao_sat_options o;
    sat__fields_default(&o, sizeof o, ssao_sat__fields, SSAO_SAT__FIELDS);
    return o;
}

SSAO_SAT_DEF ssao_sat_input ssao_sat_input_linear(const float *depth, int width, int height, double fov_y)
{
    ssao_sat_input in;
    double f = 1 / tan(0.5 * fov_y);
    memset(&in, 0, sizeof in);
    in.depth = depth;
    in.width = width;
    in.height = height;
    in.projection[0] = (float)(width > 0 ? f * height / width : f);
    in.projection[5] = (float)f;
    in.projection[10] = -1;
    in.projection[11] = -1;
    in.projection[14] = -1;
    return in;
}

/* ------------------------------------------------------------------------------------------------
   >> camera: one matrix decides perspective or orthographic, the depth convention and the direction of y
   ------------------------------------------------------------------------------------------------ */

/* Solves clip = M view for the view coordinates of a pixel; 0 when M is no projection of the stated kind. */
static int ssao_sat__read_axes(ssao_sat__camera *c, const float *m, int width, int height, int bottom_up)
{
    double w = c->orthographic ? (double)m[15] : -(double)m[11];
    double shift_x = c->orthographic ? -(double)m[12] : (double)m[8],
           shift_y = c->orthographic ? -(double)m[13] : (double)m[9];
    double most = c->orthographic ? 1e15 : 1e6, least = c->orthographic ? 1e-15 : 1e-9;
    double top = m[5] > 0 ? 1 : -1; /* normalised y of the upper border: -1 when the matrix flips y, as Vulkan's do */
    if (bottom_up) top = -top;
    c->full[0] = 2 * w / (width * (double)m[0]);
    c->full[1] = (shift_x - w) / (double)m[0];
    c->full[2] = -2 * w * top / (height * (double)m[5]);
    c->full[3] = (w * top + shift_y) / (double)m[5];
    /* rays flatter than one in a million and pixels smaller than a billionth of the distance are no view */
    return fabs(c->full[0]) <= most && fabs(c->full[1]) <= most && fabs(c->full[2]) <= most &&
           fabs(c->full[3]) <= most && fabs(c->full[0]) >= least && fabs(c->full[2]) >= least;
}

/* depth d -> 1/z (perspective) or z (orthographic), both affine in d and, under an oblique near plane (Lengyel 2005:
   the third row holds a plane), in the pixel. The kind must agree with the matrix. */
static int ssao_sat__read_depth(ssao_sat__camera *c, const float *m, ssao_sat_depth kind, int zero_to_one)
{
    double scale = zero_to_one ? 1 : 2, shift = zero_to_one ? 0 : -1; /* normalised z = scale d + shift */
    double a, b, tx, ty;
    if (kind == SSAO_SAT_DEPTH_LINEAR) return 1;
    if (c->orthographic) {
        a = -(double)m[15] * scale / (double)m[10];
        b = ((double)m[14] - (double)m[15] * shift) / (double)m[10];
        tx = (double)m[2] / (double)m[10];
        ty = (double)m[6] / (double)m[10];
    } else {
        a = -(double)m[11] * scale / (double)m[14];
        b = (-(double)m[11] * shift + (double)m[10]) / (double)m[14];
        tx = -(double)m[2] / (double)m[14];
        ty = -(double)m[6] / (double)m[14];
    }
    c->depth_a = a;
    c->depth_b = b + tx * (0.5 * c->full[0] + c->full[1]) + ty * (0.5 * c->full[2] + c->full[3]);
    c->tilt[0] = tx * c->full[0];
    c->tilt[1] = ty * c->full[2];
    if (!sat__is_finite_double(a) || !sat__is_finite_double(c->depth_b) || a == 0) return 0;
    if (!sat__is_finite_double(c->tilt[0]) || !sat__is_finite_double(c->tilt[1])) return 0;
    return (kind == SSAO_SAT_DEPTH_REVERSED) == (c->orthographic ? a < 0 : a > 0);
}

/* Perspective, orthographic, or neither. What must be 0 may be the rounding of a product of float matrices:
   SSAO_SAT__ROUNDING of what it stands beside. */
#define SSAO_SAT__ROUNDING 1e-5
static int ssao_sat__read_kind(ssao_sat__camera *c, const float *m)
{
    double x = SSAO_SAT__ROUNDING * fabs((double)m[0]), y = SSAO_SAT__ROUNDING * fabs((double)m[5]), w;
    double beside = SSAO_SAT__ROUNDING * fabs((double)m[14]);
    if (m[11] < 0 && fabs((double)m[15]) <= beside && fabs((double)m[12]) <= beside && fabs((double)m[13]) <= beside)
        c->orthographic = 0;
    else if (m[15] > 0 && fabs((double)m[11]) <= SSAO_SAT__ROUNDING * fabs((double)m[10]) && fabs((double)m[8]) <= x &&
             fabs((double)m[9]) <= y)
        c->orthographic = 1;
    else return 0;
    w = SSAO_SAT__ROUNDING * fabs((double)(c->orthographic ? m[15] : m[11]));
    return fabs((double)m[4]) <= x && fabs((double)m[1]) <= y && fabs((double)m[3]) <= w && fabs((double)m[7]) <= w;
}

static int ssao_sat__read_camera(ssao_sat__camera *c, const ssao_sat_input *in, int step, int bottom_up)
{
    float m[16];
    int i;
    memset(c, 0, sizeof *c);
    memcpy(m, in->projection, sizeof m);
    for (i = 0; i < 16; i++)
        if (!sat__is_finite(m[i])) return 0;
    for (i = 8; i < 12 && in->left_handed; i++) m[i] = -m[i]; /* z mirrored: what follows looks along -z */
    c->forward = in->left_handed ? 1.0f : -1.0f;
    if (!ssao_sat__read_kind(c, m)) return 0;
    if (m[0] == 0 || m[5] == 0 || !ssao_sat__read_axes(c, m, in->width, in->height, bottom_up)) return 0;
    if (!ssao_sat__read_depth(c, m, in->depth_kind, in->clip_zero_to_one)) return 0;
    /* table pixel (i, j) is pixel (step i, step j) of the picture */
    c->ax = (float)(c->full[0] * step);
    c->bx = (float)(c->full[0] * 0.5 + c->full[1]);
    c->ay = (float)(c->full[2] * step);
    c->by = (float)(c->full[2] * 0.5 + c->full[3]);
    c->pixels = (float)(1 / (fabs(c->full[0]) * step));
    c->aspect = (float)fabs(c->full[0] / c->full[2]);
    return 1;
}

/* ------------------------------------------------------------------------------------------------
   >> reading pixels: distance, affine depth and normal of pixels; 0 where there is nothing
   ------------------------------------------------------------------------------------------------ */

/* Distance along the axis; 0 for sky and for whatever is no distance. Tested on bits: NaN must not reach a table. */
static inline float ssao_sat__distance(const ssao_sat *s, int x, int y)
{
    const ssao_sat_input *in = &s->input;
    float d, z;
    double affine;
    if (in->half_depth) {
        const unsigned char *row = (const unsigned char *)in->half_depth + (ptrdiff_t)y * in->depth_stride;
        d = sat__half_to_float(((const uint16_t *)(const void *)row)[x]);
    } else {
        const unsigned char *row = (const unsigned char *)in->depth + (ptrdiff_t)y * in->depth_stride;
        d = ((const float *)(const void *)row)[x];
    }
    if (!sat__is_finite(d)) return 0;
    if (in->depth_kind == SSAO_SAT_DEPTH_LINEAR) z = in->sky > 0 && d >= in->sky ? 0 : d;
    else {
        if (in->depth_kind == SSAO_SAT_DEPTH_HARDWARE ? d < 0 || d >= 1 : d <= 0 || d > 1) return 0;
        affine = s->camera.depth_a * (double)d + s->camera.depth_b + s->camera.tilt[0] * x + s->camera.tilt[1] * y;
        if (!(affine > (double)SSAO_SAT__LEAST_AFFINE)) return 0;
        z = (float)(s->camera.orthographic ? affine : 1 / affine);
    }
    return z > 1 / SSAO_SAT__FAR && z < SSAO_SAT__FAR ? z : 0;
}

typedef struct ssao_sat__vector { float x, y, z; } ssao_sat__vector;

static inline ssao_sat__vector ssao_sat__position(const ssao_sat *s, int x, int y, float z)
{
    ssao_sat__vector p;
    float scale = s->camera.orthographic ? 1 : z;
    p.x = (float)(s->camera.full[0] * (x + 0.5) + s->camera.full[1]) * scale;
    p.y = (float)(s->camera.full[2] * (y + 0.5) + s->camera.full[3]) * scale;
    p.z = z;
    return p;
}

/* Tangent along x (0) or y (1) from the neighbour whose affine depth is nearer; 0 when both are missing. */
static int ssao_sat__tangent(ssao_sat__vector *t, const ssao_sat *s, int x, int y, float z, int axis)
{
    ssao_sat__vector p = ssao_sat__position(s, x, y, z), q;
    int side, best = 0;
    float nearest = 0;
    for (side = -1; side <= 1; side += 2) {
        int i = axis ? x : x + side, j = axis ? y + side : y;
        float zi, difference;
        if (i < 0 || j < 0 || i >= s->width || j >= s->height) continue;
        zi = ssao_sat__distance(s, i, j);
        if (!(zi > 0)) continue;
        difference = fabsf(s->camera.orthographic ? zi - z : 1 / zi - 1 / z);
        if (best && difference >= nearest) continue;
        best = side;
        nearest = difference;
        q = ssao_sat__position(s, i, j, zi);
        t->x = (q.x - p.x) * (float)side;
        t->y = (q.y - p.y) * (float)side;
        t->z = (q.z - p.z) * (float)side;
    }
    return best;
}

/* Unit normal that faces the camera, from the pixel and two of its four neighbours. */
static ssao_sat__vector ssao_sat__depth_normal(const ssao_sat *s, int x, int y, float z)
{
    ssao_sat__vector n = {0, 0, -1}, u, v, p = ssao_sat__position(s, x, y, z);
    float length, facing;
    if (!ssao_sat__tangent(&u, s, x, y, z, 0) || !ssao_sat__tangent(&v, s, x, y, z, 1)) return n;
    length = 1 / sqrtf((u.x * u.x + u.y * u.y + u.z * u.z) * (v.x * v.x + v.y * v.y + v.z * v.z));
    u.x *= length; u.y *= length; u.z *= length; /* the cross product is then of order 1 at any scale */
    n.x = u.y * v.z - u.z * v.y;
    n.y = u.z * v.x - u.x * v.z;
    n.z = u.x * v.y - u.y * v.x;
    length = sqrtf(n.x * n.x + n.y * n.y + n.z * n.z);
    facing = s->camera.orthographic ? n.z : n.x * p.x + n.y * p.y + n.z * p.z;
    if (!(length > 1e-12f) || !sat__is_finite(length)) { n.x = n.y = 0; n.z = -1; return n; }
    length = (facing > 0 ? -1 : 1) / length;
    n.x *= length;
    n.y *= length;
    n.z *= length;
    return n;
}

/* The given normal, made unit; from depth when there is none or when it is no direction. stats may be NULL. */
static inline ssao_sat__vector ssao_sat__normal(const ssao_sat *s, int x, int y, float z, ssao_sat_stats *stats)
{
    ssao_sat__vector n;
    const float *p;
    float square;
    if (!s->input.normals) return ssao_sat__depth_normal(s, x, y, z);
    p = (const float *)(const void *)((const unsigned char *)s->input.normals + (ptrdiff_t)y * s->input.normal_stride) +
        3 * (ptrdiff_t)x;
    n.x = p[0];
    n.y = p[1];
    n.z = s->camera.forward * p[2];
    square = n.x * n.x + n.y * n.y + n.z * n.z;
    if (!sat__is_finite(square) || !(square > SSAO_SAT__LEAST_SQUARE)) {
        if (stats) stats->normals_replaced++;
        return ssao_sat__depth_normal(s, x, y, z);
    }
    if (fabsf(square - 1) > 1e-6f) {
        square = 1 / sqrtf(square);
        n.x *= square;
        n.y *= square;
        n.z *= square;
    }
    if (!stats) return n;
    if (s->camera.orthographic) stats->normals_backfacing += n.z > 0;
    else {
        ssao_sat__vector ray = ssao_sat__position(s, x, y, 1);
        stats->normals_backfacing += n.x * ray.x + n.y * ray.y + n.z > 0;
    }
    return n;
}

/* Distances and normals of a strip, from to[at] on. */
static inline void ssao_sat__read_strip(const ssao_sat *s, const ssao_sat__pixels *to, size_t at,
                                 const ssao_sat__strip *strip, ssao_sat_stats *stats)
{
    int x;
    for (x = strip->begin; x < strip->end; x += strip->step, at++) {
        float z = ssao_sat__distance(s, x, strip->y);
        ssao_sat__vector n = {0, 0, -1};
        if (z > 0) n = ssao_sat__normal(s, x, strip->y, z, stats);
        to->z[at] = z;
        to->nx[at] = n.x;
        to->ny[at] = n.y;
        to->nz[at] = n.z;
    }
}

/* ------------------------------------------------------------------------------------------------
   >> slabs: depth range and edges
   ------------------------------------------------------------------------------------------------ */

static float ssao_sat__scale_depth(const ssao_sat *s, float z) { return s->camera.orthographic ? z : logf(z); }

/* Pixel i + GRID j of the sample: GRID x GRID pixels spread over the tables. */
static inline void ssao_sat__sample_at(const ssao_sat *s, int i, int j, int *x, int *y)
{
    *x = (int)((2 * i + 1) * (int64_t)s->columns / (2 * SSAO_SAT__GRID)) * s->step;
    *y = (int)((2 * j + 1) * (int64_t)s->rows / (2 * SSAO_SAT__GRID)) * s->step;
}

static inline float ssao_sat__sample(const ssao_sat *s, int i, int j)
{
    int x, y;
    ssao_sat__sample_at(s, i, j, &x, &y);
    return ssao_sat__distance(s, x, y);
}

/* Keeps the 2 TRIM + 1 least of what it is given. */
static void ssao_sat__keep_least(float *kept, float v)
{
    int i;
    if (!(v < kept[2 * SSAO_SAT__TRIM])) return;
    for (i = 2 * SSAO_SAT__TRIM; i > 0 && kept[i - 1] > v; i--) kept[i] = kept[i - 1];
    kept[i] = v;
}

/* Mean of those after the first `trim`, so that one more or less of them hardly moves it. */
static float ssao_sat__mean_least(const float *kept, int trim)
{
    float sum = 0;
    int i;
    for (i = trim; i <= 2 * trim; i++) sum += kept[i];
    return sum / (float)(trim + 1);
}

/* Nearest and farthest distance that slabs and quanta follow: of the sample, in blocks of 2 x 2, less the TRIM blocks
   with the nearest and those with the farthest pixels, the mean of the next TRIM + 1. So no pixel and no small object
   (a bird, a spark) moves them. 0 when the sample meets nothing. */
static int ssao_sat__sample_range(ssao_sat *s)
{
    float least[2 * SSAO_SAT__TRIM + 1], most[2 * SSAO_SAT__TRIM + 1];
    int i, j, k, blocks = 0, trim;
    for (i = 0; i <= 2 * SSAO_SAT__TRIM; i++) least[i] = most[i] = 3e38f;
    for (j = 0; j < SSAO_SAT__GRID; j += 2)
        for (i = 0; i < SSAO_SAT__GRID; i += 2) {
            float low = 3e38f, high = 0;
            for (k = 0; k < 4; k++) {
                float z = ssao_sat__sample(s, i + k % 2, j + k / 2);
                if (!(z > 0)) continue;
                if (z < low) low = z;
                if (z > high) high = z;
            }
            if (!(high > 0)) continue;
            blocks++;
            ssao_sat__keep_least(least, low);
            ssao_sat__keep_least(most, -high);
        }
    trim = sat__min_int(SSAO_SAT__TRIM, blocks / 16);
    if (!blocks) return 0;
    s->nearest = ssao_sat__mean_least(least, trim);
    s->farthest = -ssao_sat__mean_least(most, trim);
    if (s->farthest < s->nearest) s->farthest = s->nearest; /* half of the picture nearer than the other by a block */
    return 1;
}

/* Without a sample: what there is lies between the sampled pixels. */
static int ssao_sat__whole_range(ssao_sat *s)
{
    int x, y;
    s->nearest = s->farthest = 0;
    for (y = 0; y < s->height; y++)
        for (x = 0; x < s->width; x++) {
            float z = ssao_sat__distance(s, x, y);
            if (!(z > 0)) continue;
            if (!(s->farthest > 0) || z < s->nearest) s->nearest = z;
            if (z > s->farthest) s->farthest = z;
        }
    return s->farthest > 0;
}

/* Share of the sample in front of each 1/BINS of the logarithmic (orthographic: linear) depth range. */
static void ssao_sat__count_depths(const ssao_sat *s, float *share, float low, float range)
{
    int i, j, n = 0, count[SSAO_SAT__BINS];
    float sum = 0;
    memset(count, 0, sizeof count);
    for (j = 0; j < SSAO_SAT__GRID; j++)
        for (i = 0; i < SSAO_SAT__GRID; i++) {
            float z = ssao_sat__sample(s, i, j);
            /* nothing, or what the range leaves out */
            if (!(z >= (1 - SSAO_SAT__RANGE_SLACK) * s->nearest && z <= (1 + SSAO_SAT__RANGE_SLACK) * s->farthest))
                continue;
            count[range > 0 ? sat__clamp_int((int)((ssao_sat__scale_depth(s, z) - low) / range * SSAO_SAT__BINS), 0,
                                             SSAO_SAT__BINS - 1)
                            : 0]++;
            n++;
        }
    for (i = 0; i <= SSAO_SAT__BINS; i++) {
        share[i] = n ? sum / (float)n : (float)i / SSAO_SAT__BINS;
        if (i < SSAO_SAT__BINS) sum += (float)count[i];
    }
}

/* Edges at equal steps of F = half the share of the depth range + half the share of the pixels, so that neither a long
   empty range nor a crowd at one depth leaves a slab useless. */
static void ssao_sat__cut_slabs(ssao_sat *s)
{
    float share[SSAO_SAT__BINS + 1], low = ssao_sat__scale_depth(s, s->nearest),
                                     range = ssao_sat__scale_depth(s, s->farthest) - low;
    int k, bin = 0, slabs = s->frame_slabs;
    ssao_sat__count_depths(s, share, low, range);
    s->edge[0] = s->nearest;
    s->edge[slabs] = s->farthest;
    for (k = 1; k < slabs; k++) {
        float target = (float)k / (float)slabs, below, above, z;
        while (bin < SSAO_SAT__BINS - 1 && 0.5f * (float)(bin + 1) / SSAO_SAT__BINS + 0.5f * share[bin + 1] < target)
            bin++;
        below = 0.5f * (float)bin / SSAO_SAT__BINS + 0.5f * share[bin];
        above = 0.5f * (float)(bin + 1) / SSAO_SAT__BINS + 0.5f * share[bin + 1];
        z = low + range * ((float)bin + (target - below) / (above - below)) / SSAO_SAT__BINS;
        z = s->camera.orthographic ? z : expf(z);
        s->edge[k] = z < s->edge[k - 1] ? s->edge[k - 1] : z > s->farthest ? s->farthest : z;
    }
}

/* The quantum spends the bits that a sum over `area` pixels leaves of 31. */
static ssao_sat__slab ssao_sat__quantise(float low, float high, double area)
{
    ssao_sat__slab q;
    int bits = 31;
    while (bits > 1 && area * ((double)((uint32_t)1 << bits)) > 2147483648.0) bits--;
    if (bits > SSAO_SAT__LEVEL_BITS) bits = SSAO_SAT__LEVEL_BITS;
    q.low = low;
    q.top = ((uint32_t)1 << bits) - 1;
    q.quantum = (high - low) / (float)q.top;
    q.inverse = q.quantum > 0 ? 1 / q.quantum : 0;
    if (!sat__is_finite(q.inverse)) q.inverse = 0;
    return q;
}

static inline uint32_t ssao_sat__level(const ssao_sat__slab *q, float v)
{
    float level = (v - q->low) * q->inverse + 0.5f;
    return level > 0 ? level < (float)q->top ? (uint32_t)level : q->top : 0;
}

static inline float ssao_sat__affine(const ssao_sat *s, float z) { return s->camera.orthographic ? z : 1 / z; }

/* How many slabs: those thinner than the radius, or than the region that max_pixels leaves of it, tell nothing new. */
static int ssao_sat__slab_count(const ssao_sat *s)
{
    double region = (double)s->limit / (double)s->camera.pixels * (s->camera.orthographic ? 1 : (double)s->nearest),
           thick;
    thick = ((double)s->farthest - (double)s->nearest) / ((double)s->radius < region ? (double)s->radius : region);
    return thick < s->options.slabs ? (int)thick + 1 : s->options.slabs;
}

/* The end slabs hold whatever is nearer or farther than the range: all of it behind, MARGIN times as near in front. */
static void ssao_sat__prepare_slabs(ssao_sat *s)
{
    double cell = (2 * (double)s->largest / (s->to.is_signed ? 1 : 3) + 2) * s->step;
    float spare = s->camera.orthographic ? s->farthest - s->nearest + SSAO_SAT__MARGIN * s->radius : 0;
    int k;
    s->frame_slabs = ssao_sat__slab_count(s);
    ssao_sat__cut_slabs(s);
    if (!(spare < SSAO_SAT__LARGEST_RADIUS)) spare = SSAO_SAT__LARGEST_RADIUS;
    for (k = 0; k < s->frame_slabs; k++) {
        float low = s->edge[k], high = s->edge[k + 1];
        if (k == 0) low = s->camera.orthographic ? low - spare : low / SSAO_SAT__MARGIN;
        if (s->camera.orthographic)
            s->slabs[k] = ssao_sat__quantise(low, k == s->frame_slabs - 1 ? high + spare : high, cell * cell);
        else s->slabs[k] = ssao_sat__quantise(k == s->frame_slabs - 1 ? 0 : 1 / high, 1 / low, cell * cell);
    }
}

/* The single table holds: PLANE: 1/z, or farthest - z when orthographic, sky 0. Published: z, sky just beyond the
   farthest, or 1/z, sky 0. */
static int ssao_sat__table_is_inverse(const ssao_sat *s)
{
    return s->options.method == SSAO_SAT_PLANE ? !s->camera.orthographic : s->options.inverted_depth;
}

static inline float ssao_sat__table_value(const ssao_sat *s, float z)
{
    if (!(z > 0)) return s->sky_value;
    if (ssao_sat__table_is_inverse(s)) return 1 / z;
    if (s->options.method == SSAO_SAT_PLANE) return s->farthest - z;
    return z < s->sky_value ? z : s->sky_value; /* nothing is behind the sky */
}

static void ssao_sat__prepare_value(ssao_sat *s)
{
    double side = 2 * (double)s->largest + 2;
    float high;
    s->sky_value = 0;
    if (ssao_sat__table_is_inverse(s)) high = SSAO_SAT__MARGIN / s->nearest;
    else if (s->options.method == SSAO_SAT_PLANE)
        high = s->farthest - s->nearest +
               SSAO_SAT__MARGIN * (s->radius < SSAO_SAT__LARGEST_RADIUS ? s->radius : SSAO_SAT__LARGEST_RADIUS);
    else high = s->sky_value = SSAO_SAT__BEHIND * s->farthest;
    s->value = ssao_sat__quantise(0, high, side * side);
}

/* ------------------------------------------------------------------------------------------------
   >> regions
   ------------------------------------------------------------------------------------------------ */

/* Half side along x, in table pixels, of a region of `reach` world units at distance z, cut so that neither side
   exceeds the limit. */
static inline float ssao_sat__half_side(const ssao_sat *s, float z, int *cut)
{
    float r;
    if (s->options.region_pixels > 0) r = (float)s->options.region_pixels / (float)s->step;
    else r = s->reach * s->camera.pixels / (s->camera.orthographic ? 1 : z);
    *cut = r > s->limit;
    return r < s->limit ? r : s->limit;
}

/* Regions fade out between twice min_pixels and min_pixels: far surfaces must not flicker. */
static inline float ssao_sat__fade(const ssao_sat *s, float half_side)
{
    float fade = half_side / (float)s->options.min_pixels - 1;
    return s->options.region_pixels > 0 || fade > 1 ? 1 : fade > 0 ? fade : 0;
}

/* ------------------------------------------------------------------------------------------------
   >> tables: the rows of a band, and their tables. All tables are sums modulo 2^32: box sums are exact
   wherever the table starts, so bands, workers and GPUs get the same bits.
   ------------------------------------------------------------------------------------------------ */

/* Where row y (counted in the table picture) of an array of `stride` words lies. */
static inline size_t ssao_sat__at(const ssao_sat *s, int y)
{
    return (size_t)(y - s->first) * s->stride + SSAO_SAT__PAD;
}

/* Do the pixels between those of the table lie on one plane with them? Affine depth has no second differences on
   planes. */
static inline uint32_t ssao_sat__is_rough(const float *a, int x, float limit)
{
    float c = a[x + 1];
    return !(fabsf(a[x] + a[x + 2] - 2 * c) <= limit * c) ? (uint32_t)SSAO_SAT__ROUGH : 0;
}

#ifndef SSAO_SAT_NO_SLABS
/* Words of one row of the picture; `affine` (columns * step + 1 of them, 0: nothing) is turned into them. Which slabs
   occur in the row, and in each BLOCK table pixels of it. */
static void ssao_sat__classify_row(ssao_sat *s, int y, const float *z, float *affine, uint32_t *words)
{
    uint32_t *found = s->block_slabs + (size_t)(y - s->first) * s->blocks;
    const int slabs = s->frame_slabs, n = s->columns * s->step, block = SSAO_SAT__BLOCK * s->step;
    int x, k;
    for (x = 0; x < n; x++) affine[x] = z[x] > 0 ? ssao_sat__affine(s, z[x]) : 0;
    affine[n] = 0;
    for (x = 0; x < n; x++) {
        int index = 0;
        if (!(z[x] > 0)) {
            words[x] = SSAO_SAT__NOTHING;
            continue;
        }
        for (k = 1; k < slabs; k++) index += z[x] >= s->edge[k];
        words[x] = (uint32_t)index << SSAO_SAT__LEVEL_BITS | ssao_sat__level(&s->slabs[index], affine[x]);
        found[x / block] |= 1u << index;
    }
    for (x = 0; x < (int)s->blocks; x++) s->row_slabs[y - s->first] |= found[x];
    for (x = 0; x + 2 < n && s->step == 2; x += 2) words[x] |= ssao_sat__is_rough(affine, x, s->flat_limit);
}

/* The pixels of table row y, all of them. `scratch` holds a row of the picture twice. */
static void ssao_sat__hold_words(ssao_sat *s, int y, float *scratch, ssao_sat__worker *w)
{
    int j, x, n = s->columns * s->step;
    float *z = scratch, *affine = scratch + 2 * s->stride;
    size_t at = ssao_sat__at(s, y);
    s->row_slabs[y - s->first] = 0;
    memset(s->block_slabs + (size_t)(y - s->first) * s->blocks, 0, s->blocks * sizeof *s->block_slabs);
    for (j = 0; j < s->step; j++) {
        uint32_t *words = s->words + ((size_t)(y - s->first) * (size_t)s->step + (size_t)j) * s->word_stride;
        int row = y * s->step + j;
        for (x = 0; x < n; x++) {
            z[x] = row < s->height && x < s->width ? ssao_sat__distance(s, x, row) : 0;
            if (!(z[x] > 0)) continue;
            if (!(w->farthest > 0) || z[x] < w->nearest) w->nearest = z[x];
            if (z[x] > w->farthest) w->farthest = z[x];
        }
        ssao_sat__classify_row(s, y, z, affine, words);
        for (x = 0; x < s->columns; x++) (j ? s->lower : s->affine)[at + (size_t)x] = affine[x * s->step];
    }
}
#endif

static void ssao_sat__hold_rows(int begin, int end, int worker, void *context)
{
    ssao_sat *s = (ssao_sat *)context;
    ssao_sat__worker *w = &s->workers[worker];
    int i, x;
    for (i = begin; i < end; i++) {
        int y = s->first + i;
        size_t at = ssao_sat__at(s, y);
        ssao_sat_stats *stats = y >= s->begin && y < s->end ? &w->stats : NULL;
        ssao_sat__strip strip = {0, 0, 0, 0};
        strip.y = y * s->step;
        strip.end = s->width;
        strip.step = s->step;
        ssao_sat__read_strip(s, &s->work, at, &strip, stats);
#ifndef SSAO_SAT_NO_SLABS
        if (s->options.method == SSAO_SAT_SLABS) {
            ssao_sat__hold_words(s, y, s->scratch + (size_t)worker * 8 * s->stride, w);
            continue;
        }
#endif
        for (x = 0; x < s->columns; x++) {
            float z = s->work.z[at + (size_t)x];
            if (!(z > 0)) continue;
            if (!(w->farthest > 0) || z < w->nearest) w->nearest = z;
            if (z > w->farthest) w->farthest = z;
        }
    }
}

#ifndef SSAO_SAT_NO_SLABS
/* Count, sum of q, x and y of one slab over all pixels of the picture. Rows without it are copies of the row above. */
static void ssao_sat__build_slab(ssao_sat *s, int k)
{
    size_t stride = 4 * s->table_stride;
    uint32_t *table = s->table + 4 * (size_t)k * s->table_plane, word[4];
    int row, x, i, step = s->step;
    memset(table, 0, stride * sizeof *table);
    word[0] = 1;
    for (row = 0; row < s->held; row++) {
        uint32_t *o = table + (size_t)(row + 1) * stride;
        const uint32_t *above = o - stride, *words = s->words + (size_t)(row * step) * s->word_stride;
        sat__i32x4 sum;
        if (!(s->row_slabs[row] >> k & 1)) {
            memcpy(o, above, stride * sizeof *table);
            continue;
        }
        memset(o, 0, 4 * sizeof *o);
        sum = ssao_sat__load_words(o);
        for (x = 0; x < s->columns; x++) {
            const int holds = s->block_slabs[(size_t)row * s->blocks + (size_t)(x / SSAO_SAT__BLOCK)] >> k & 1;
            o += 4;
            above += 4;
            for (i = 0; holds && i < step * step; i++) {
                uint32_t w = words[(size_t)(i / step) * s->word_stride + (size_t)(x * step + i % step)];
                if ((int)(w >> SSAO_SAT__LEVEL_BITS & 31) != k) continue;
                word[1] = w & ((1u << SSAO_SAT__LEVEL_BITS) - 1);
                word[2] = (uint32_t)(x * step + i % step);
                word[3] = (uint32_t)((s->first + row) * step + i / step); /* counted in the picture, so that bands give
                                                                             the same bits */
                sum = sat__i32x4_add(sum, ssao_sat__load_words(word));
            }
            ssao_sat__store_words(o, sat__i32x4_add(sum, ssao_sat__load_words(above)));
        }
    }
}

#endif

/* The single table of the other methods; floats restart nothing and round as they did in 2012. */
static void ssao_sat__build_value(ssao_sat *s)
{
    size_t stride = s->table_stride;
    int row, x;
    memset(s->table, 0, stride * sizeof *s->table);
    for (row = 0; row < s->held; row++) {
        uint32_t *o = s->table + (size_t)(row + 1) * stride, sum = 0;
        const uint32_t *above = o - stride;
        const float *z = s->work.z + (size_t)row * s->stride + SSAO_SAT__PAD;
        float real = 0;
        o[0] = 0;
        for (x = 0; x < s->columns; x++) {
            float v = ssao_sat__table_value(s, z[x]);
            if (s->options.float_table) {
                real += v - s->mean;
                o[x + 1] = sat__float_bits(real + sat__float_from_bits(above[x + 1]));
            } else {
                sum += ssao_sat__level(&s->value, v);
                o[x + 1] = above[x + 1] + sum;
            }
        }
    }
}

#ifndef SSAO_SAT_NO_SLABS
/* Is the pixel no part of a plane that its neighbours see too? Affine depth has no second differences on planes, and
   the tangent plane of the given normal falls as the depth does. What passes moves no sine beyond the bias:
   flat_limit. */
static int ssao_sat__is_bent(const ssao_sat *s, const float *a, size_t at, float rx, float ry)
{
    const float *above = a - s->stride, *below = a + s->stride;
    float c = *a, limit = s->flat_limit * c, z = s->work.z[at];
    const float nx = s->work.nx[at], ny = s->work.ny[at], nz = s->work.nz[at];
    float gx = 0.5f * (a[1] - a[-1]), gy = 0.5f * (*below - *above), scale;
    if (!(z > 0) || !(c > 0)) return 1;
    if (fabsf(a[-1] + a[1] - 2 * c) > limit || fabsf(*above + *below - 2 * c) > limit ||
        fabsf(a[0] - a[-1] - above[0] + above[-1]) > limit) return 1;
    if (s->camera.orthographic) {
        gx += s->camera.ax * nx / nz;
        gy += s->camera.ay * ny / nz;
        scale = s->camera.pixels;
    } else {
        float facing = (nx * rx + ny * ry + nz) * z;
        gx -= s->camera.ax * nx / facing;
        gy -= s->camera.ay * ny / facing;
        scale = s->camera.pixels * z;
    }
    return !((fabsf(gx) + fabsf(gy)) * scale < 0.5f * s->fit.bias);
}

/* Half resolution: is anything off the plane among the pixels between those of the table? In the last column and row
   that is asked of the pixels before. */
static int ssao_sat__hides_bend(const ssao_sat *s, int row, int x)
{
    const uint32_t *words = s->words + (size_t)(2 * row) * s->word_stride + (size_t)(2 * x);
    size_t at = (size_t)row * s->stride + SSAO_SAT__PAD + (size_t)x;
    float c = s->lower[at];
    if ((words[0] | words[s->word_stride]) & SSAO_SAT__ROUGH) return 1;
    if (row == s->held - 1) return 0;
    return !(fabsf(s->affine[at] + s->affine[at + s->stride] - 2 * c) <= s->flat_limit * c);
}

/* Table of the pixels that are no part of a plane. The border takes the differences of its inner neighbours. */
static void ssao_sat__build_flags(ssao_sat *s)
{
    int row, x, thin = s->held < 3 || s->columns < 3;
    memset(s->flags, 0, s->table_stride * sizeof *s->flags);
    for (row = 0; row < s->held; row++) {
        uint32_t *o = s->flags + (size_t)(row + 1) * s->table_stride, sum = 0;
        const uint32_t *up = o - s->table_stride;
        size_t at = (size_t)row * s->stride + SSAO_SAT__PAD;
        const float *a =
            s->affine + (size_t)(thin ? row : sat__clamp_int(row, 1, s->held - 2)) * s->stride + SSAO_SAT__PAD;
        float ry = s->camera.ay * (float)(s->first + row) + s->camera.by;
        o[0] = 0;
        for (x = 0; x < s->columns; x++) {
            int inner = sat__clamp_int(x, 1, s->columns - 2);
            sum += thin ||
                   ssao_sat__is_bent(s, a + inner, at + (size_t)x, s->camera.ax * (float)x + s->camera.bx, ry) ||
                   (s->step == 2 && ssao_sat__hides_bend(s, row, x));
            o[x + 1] = up[x + 1] + sum;
        }
    }
}
#endif

/* Table number `begin`..: the slabs, then the flags. */
static void ssao_sat__build_tables(int begin, int end, int worker, void *context)
{
    ssao_sat *s = (ssao_sat *)context;
    int i;
    (void)worker;
    for (i = begin; i < end; i++) {
#ifndef SSAO_SAT_NO_SLABS
        if (s->options.method == SSAO_SAT_SLABS) {
            if (i < s->frame_slabs) ssao_sat__build_slab(s, i);
            else ssao_sat__build_flags(s);
            continue;
        }
#endif
        ssao_sat__build_value(s);
    }
}

/* Box sum in a table of `words` words an entry, rows and columns within it. */
static inline uint32_t ssao_sat__box(const ssao_sat *s, const uint32_t *table, size_t words, ssao_sat__rect r)
{
    const uint32_t *above = table + words * (size_t)(r.y0 - s->first) * s->table_stride;
    const uint32_t *below = table + words * (size_t)(r.y1 - s->first) * s->table_stride;
    return below[words * (size_t)r.x1] - below[words * (size_t)r.x0] - above[words * (size_t)r.x1] +
           above[words * (size_t)r.x0];
}

/* (1 - strength occlusion)^power; the fitted exponents are 1, 1.5, 2 or 3, so powf is for callers who ask for
   others. */
static inline float ssao_sat__accessibility(const ssao_sat *s, float occlusion, float gain)
{
    float open = 1 - gain * occlusion;
    open = open > 0 ? open < 1 ? open : 1 : 0;
    if (s->fit.power == 1.5f) open *= sqrtf(open);
    else if (s->fit.power == 2.0f) open *= open;
    else if (s->fit.power == 3.0f) open *= open * open;
    return s->options.power == 1 ? open : powf(open, (float)s->options.power);
}

#ifndef SSAO_SAT_NO_SLABS
/* ------------------------------------------------------------------------------------------------
   >> estimate by slabs: in every cell of every ring, what each slab holds is one occluder at its exact centroid

       occlusion = f(n.v) sum over cells and slabs of coverage k(max(0, n.d / |d| - bias), |d| / radius)
                                                      max(0, 1 - |d|^2 / range^2)

   with the polynomials k and the factor f of ssao_sat__kernels.
   The eight cells around a pixel are two vectors: corners and sides. The four words of a table entry are one load.
   ------------------------------------------------------------------------------------------------ */

/* What all pixels share, the same in all lanes: read from memory that no store can be thought to change. */
typedef struct ssao_sat__lanes {
    sat__f32x4 low[SSAO_SAT__MAX_SLABS], quantum[SSAO_SAT__MAX_SLABS];
    sat__f32x4 ax, bx, ay, by, falloff, inverse_radius, bias;
    sat__f32x4 term[SSAO_SAT__MAX_SCALES][SSAO_SAT__MAX_SCALES][SSAO_SAT__TERMS]; /* kernel of rings [first, last] */
} ssao_sat__lanes;

typedef struct ssao_sat__point {
    int x, y, first_slab, end_slab;        /* slabs in reach */
    float half_side;
    float z, facing, slope[2];             /* n.ray and its change a column and a row; orthographic: n.z, n.x, n.y */
    sat__f32x4 at[3], n[3];               /* the same in all lanes */
    sat__f32x4 surface[3];                /* the normal from depth, where it counts too */
    sat__f32x4 least;                     /* square of a millionth of the distance: nothing is nearer than that */
    sat__f32x4 occlusion[2], blocked[2][3]; /* by cell */
} ssao_sat__point;

/* Half sides in pixels of a ring along an axis: its inner cells reach to the one, the outer ones to the other. */
typedef struct ssao_sat__ring { int inner, outer; } ssao_sat__ring;

/* The 3 cells along an axis: borders, clipped to the picture, and what one pixel weighs in each. */
typedef struct ssao_sat__cut { int border[4]; float weight[3]; } ssao_sat__cut;

/* The eight cells of a ring around a pixel, and what one slab holds in them. */
typedef struct ssao_sat__cells {
    ssao_sat__cut column, row;
    sat__f32x4 weight[2];
    const sat__f32x4 *term; /* of the kernel */
    int slab;
} ssao_sat__cells;

/* Horner in the distance, for one power of the sine. */
static inline sat__f32x4 ssao_sat__cubic(const sat__f32x4 *c, sat__f32x4 d)
{
    sat__f32x4 sum = sat__f32x4_add(c[2], sat__f32x4_mul(d, c[3]));
    sum = sat__f32x4_add(c[1], sat__f32x4_mul(d, sum));
    return sat__f32x4_add(c[0], sat__f32x4_mul(d, sum));
}

/* The occluders of one slab in four cells, given the sums over each. */
static inline void ssao_sat__add_occluders(ssao_sat__point *p, const ssao_sat *s, const ssao_sat__lanes *l,
                                           const ssao_sat__cells *c, sat__f32x4 *sums, int group)
{
    const sat__f32x4 one = sat__f32x4_set1(1), zero = sat__f32x4_set1(0);
    sat__f32x4 count, affine, r, z, d[3], square, height, share, length, inverse, sine, part;
    ssao_sat__transpose(sums); /* count, level, x, y of the four cells */
    count = sums[0];
    affine = sat__f32x4_add(sat__f32x4_mul(l->low[c->slab], count), sat__f32x4_mul(l->quantum[c->slab], sums[1]));
    r = sat__f32x4_div(one, s->camera.orthographic
                                ? sat__f32x4_max(count, one)
                                : sat__f32x4_max(affine, sat__f32x4_set1(SSAO_SAT__LEAST_AFFINE)));
    z = sat__f32x4_mul(s->camera.orthographic ? affine : count, r);
    d[0] = sat__f32x4_add(sat__f32x4_mul(l->ax, sums[2]), sat__f32x4_mul(l->bx, count));
    d[1] = sat__f32x4_add(sat__f32x4_mul(l->ay, sums[3]), sat__f32x4_mul(l->by, count));
    d[0] = sat__f32x4_sub(sat__f32x4_mul(d[0], r), p->at[0]);
    d[1] = sat__f32x4_sub(sat__f32x4_mul(d[1], r), p->at[1]);
    d[2] = sat__f32x4_sub(z, p->at[2]);
    square = ssao_sat__dot(d, d);
    height = ssao_sat__dot(d, p->n);
    if (s->geometric) height = sat__f32x4_min(height, ssao_sat__dot(d, p->surface));
    share = sat__f32x4_sub(one, sat__f32x4_mul(square, l->falloff));
    share = ssao_sat__if_positive(height, sat__f32x4_mul(sat__f32x4_max(zero, share), count));
    if (!ssao_sat__any_positive(share)) return;
    length = sat__f32x4_sqrt(sat__f32x4_max(square, p->least));
    inverse = sat__f32x4_div(one, length);
    sine = sat__f32x4_max(zero, sat__f32x4_sub(sat__f32x4_mul(height, inverse), l->bias));
    length = sat__f32x4_mul(length, l->inverse_radius);
    length = sat__f32x4_min(length, sat__f32x4_set1(2)); /* the share is 0 from fit.range on: no overflow beyond */
    part = sat__f32x4_mul(sine, ssao_sat__cubic(c->term + 8, length));
    part = sat__f32x4_mul(sine, sat__f32x4_add(part, ssao_sat__cubic(c->term + 4, length)));
    part = sat__f32x4_mul(sine, sat__f32x4_add(part, ssao_sat__cubic(c->term, length)));
    part = sat__f32x4_mul(sat__f32x4_mul(part, share), c->weight[group]);
    p->occlusion[group] = sat__f32x4_add(p->occlusion[group], part);
#ifndef SSAO_SAT_NO_BENT
    if (s->to.bent) {
        part = sat__f32x4_mul(part, inverse);
        p->blocked[group][0] = sat__f32x4_add(p->blocked[group][0], sat__f32x4_mul(part, d[0]));
        p->blocked[group][1] = sat__f32x4_add(p->blocked[group][1], sat__f32x4_mul(part, d[1]));
        p->blocked[group][2] = sat__f32x4_add(p->blocked[group][2], sat__f32x4_mul(part, d[2]));
    }
#endif
}

/* Sixteen table entries make the sums over eight cells of one slab. */
static inline void ssao_sat__add_slab(ssao_sat__point *p, const ssao_sat *s, const ssao_sat__lanes *l,
                                      const ssao_sat__cells *c)
{
    const uint32_t *table = s->table + 4 * (size_t)c->slab * s->table_plane, *row[4];
    sat__i32x4 band[3][4], upper, lower;
    sat__f32x4 corners[4], sides[4];
    size_t column[4];
    int j, t;
    for (t = 0; t < 4; t++) {
        column[t] = 4 * (size_t)c->column.border[t];
        row[t] = table + 4 * (size_t)(c->row.border[t] - s->first) * s->table_stride;
    }
    if (row[3][column[3]] - row[3][column[0]] == row[0][column[3]] - row[0][column[0]])
        return; /* no pixel of the slab in sight */
    for (t = 0; t < 4; t++) {
        upper = ssao_sat__load_words(row[0] + column[t]);
        for (j = 0; j < 3; j++, upper = lower) {
            lower = ssao_sat__load_words(row[j + 1] + column[t]);
            band[j][t] = sat__i32x4_sub(lower, upper);
        }
    }
#define SSAO_SAT__CELL(j, t) sat__i32x4_to_f32(sat__i32x4_sub(band[j][(t) + 1], band[j][t]))
    corners[0] = SSAO_SAT__CELL(0, 0);
    corners[1] = SSAO_SAT__CELL(0, 2);
    corners[2] = SSAO_SAT__CELL(2, 0);
    corners[3] = SSAO_SAT__CELL(2, 2);
    sides[0] = SSAO_SAT__CELL(0, 1);
    sides[1] = SSAO_SAT__CELL(1, 0);
    sides[2] = SSAO_SAT__CELL(1, 2);
    sides[3] = SSAO_SAT__CELL(2, 1);
#undef SSAO_SAT__CELL
    ssao_sat__add_occluders(p, s, l, c, corners, 0);
    ssao_sat__add_occluders(p, s, l, c, sides, 1);
}

/* Borders of the cells along one axis: [at - outer, at - inner) [at - inner, at + inner] (at + inner, at + outer], and
   what a pixel of the picture weighs in them. What the picture's border takes from a side goes to the middle, less for
   being farther off: as if the surroundings went on beyond the border, without a jump where a cell leaves the
   picture. */
static inline void ssao_sat__cut_axis(ssao_sat__cut *c, int at, ssao_sat__ring r, int end, int step, int pixels)
{
    float first, last, length = (float)(r.outer - r.inner);
    int t;
    c->border[0] = sat__max_int(at - r.outer, 0);
    c->border[1] = sat__max_int(at - r.inner, 0);
    c->border[2] = sat__min_int(at + r.inner + 1, end);
    c->border[3] = sat__min_int(at + r.outer + 1, end);
    for (t = 0; t < 3; t++) {
        int count = sat__min_int(c->border[t + 1] * step, pixels) - c->border[t] * step;
        c->weight[t] = count > 0 ? 1 / (float)count : 0;
    }
    if (c->border[0] == at - r.outer && c->border[3] == at + r.outer + 1) return;
    first = (float)(c->border[1] - c->border[0]) / length;
    last = (float)(c->border[3] - c->border[2]) / length;
    c->weight[0] *= first;
    c->weight[1] *= 1 + SSAO_SAT__BEYOND * (2 - first - last);
    c->weight[2] *= last;
}

static void ssao_sat__cut_cells(ssao_sat__cells *c, const ssao_sat *s, int x, int y, const ssao_sat__ring *ring)
{
    const float *u = c->column.weight, *v = c->row.weight;
    float corners[4], sides[4];
    ssao_sat__cut_axis(&c->column, x, ring[0], s->columns, s->step, s->width);
    ssao_sat__cut_axis(&c->row, y, ring[1], s->rows, s->step, s->height);
    corners[0] = u[0] * v[0];
    corners[1] = u[2] * v[0];
    corners[2] = u[0] * v[2];
    corners[3] = u[2] * v[2];
    sides[0] = u[1] * v[0];
    sides[1] = u[0] * v[1];
    sides[2] = u[2] * v[1];
    sides[3] = u[1] * v[2];
    c->weight[0] = sat__f32x4_load(corners);
    c->weight[1] = sat__f32x4_load(sides);
}

/* Can anything of the slab within the ring rise above the tangent plane by more than the bias? Its height is at most
   that of a corner of the frustum that holds it, and its distance at least that along the axis. */
static inline int ssao_sat__may_occlude(const ssao_sat__point *p, const ssao_sat *s, const ssao_sat__ring *ring, int k)
{
    float low = s->edge[k], high = s->edge[k + 1],
          spread = p->slope[0] * (float)(ring[0].outer + 1) + p->slope[1] * (float)(ring[1].outer + 1);
    float distance, height;
    if (k == 0 && s->band_nearest < low) low = s->band_nearest; /* the end slabs hold all that is beyond */
    if (k == s->frame_slabs - 1 && s->band_farthest > high) high = s->band_farthest;
    distance = low > p->z ? low - p->z : high < p->z ? p->z - high : 0;
    if (s->camera.orthographic) height = p->facing * ((p->facing > 0 ? high : low) - p->z) + spread;
    else height = (p->facing + spread) * (p->facing + spread > 0 ? high : low) - p->facing * p->z;
    return height > s->fit.bias * distance;
}

static void ssao_sat__set_lanes(ssao_sat__lanes *l, const ssao_sat *s)
{
    const ssao_sat__kernel *kernel = &ssao_sat__kernels[s->options.scales - 1];
    int first, last, ring, i;
    l->ax = sat__f32x4_set1((float)s->camera.full[0]);
    l->bx = sat__f32x4_set1(s->camera.bx);
    l->ay = sat__f32x4_set1((float)s->camera.full[2]);
    l->by = sat__f32x4_set1(s->camera.by);
    l->falloff = sat__f32x4_set1(1 / (s->range * s->range));
    l->inverse_radius = sat__f32x4_set1(1 / s->radius);
    l->bias = sat__f32x4_set1(s->fit.bias);
    for (i = 0; i < s->frame_slabs; i++) {
        l->low[i] = sat__f32x4_set1(s->slabs[i].low);
        l->quantum[i] = sat__f32x4_set1(s->slabs[i].quantum);
    }
    for (first = 0; first < s->options.scales; first++)
        for (last = first; last < s->options.scales; last++)
            for (i = 0; i < SSAO_SAT__TERMS; i++) {
                float term = 0;
                for (ring = first; ring <= last; ring++) term += kernel->term[ring][i];
                l->term[first][last][i] = sat__f32x4_set1(term);
            }
}

static inline ssao_sat__ring ssao_sat__ring_of(float r)
{
    ssao_sat__ring ring;
    ring.inner = sat__max_int(1, (int)(r / 3 + 0.5f));
    ring.outer = sat__max_int(ring.inner + 1, (int)(r + 0.5f));
    return ring;
}

/* The first `rings` rings around the point; those that round to the same pixels are looked up once. */
static void ssao_sat__add_rings(ssao_sat__point *p, const ssao_sat *s, const ssao_sat__lanes *l, int rings)
{
    float r = p->half_side;
    ssao_sat__ring now[2], next[2];
    int ring, first = 0;
    ssao_sat__cells cells;
    for (ring = 0; ring <= rings; ring++, r *= 1 / 3.0f) {
        next[0] = ssao_sat__ring_of(r);
        next[1] = ssao_sat__ring_of(r * s->camera.aspect);
        if (ring > 0 && (ring == rings || memcmp(next, now, sizeof now))) {
            ssao_sat__cut_cells(&cells, s, p->x, p->y, now);
            cells.term = l->term[first][ring - 1];
            for (cells.slab = p->first_slab; cells.slab < p->end_slab; cells.slab++)
                if (s->used_slabs >> cells.slab & 1 && ssao_sat__may_occlude(p, s, now, cells.slab))
                    ssao_sat__add_slab(p, s, l, &cells);
            first = ring;
        }
        memcpy(now, next, sizeof now);
    }
}

/* The kernel's factor by n.v. */
static inline float ssao_sat__by_facing(const ssao_sat *s, const ssao_sat__point *p)
{
    const ssao_sat__kernel *kernel = &ssao_sat__kernels[s->options.scales - 1];
    float x = s->camera.ax * (float)p->x + s->camera.bx, y = s->camera.ay * (float)p->y + s->camera.by;
    float cosine = s->camera.orthographic ? -p->facing : -p->facing / sqrtf(1 + x * x + y * y);
    cosine = cosine > 0 ? cosine < 1 ? cosine : 1 : 0;
    return cosine < 0.5f ? 1 + (kernel->grazing - 1) * (1 - 2 * cosine) : 1 + (kernel->facing - 1) * (2 * cosine - 1);
}

static inline float ssao_sat__sum_lanes(sat__f32x4 a, sat__f32x4 b)
{
    float v[4];
    sat__f32x4_store(v, sat__f32x4_add(a, b));
    return (v[0] + v[1]) + (v[2] + v[3]);
}

#ifndef SSAO_SAT_NO_BENT
/* Sum of the blocked directions. Kept as it is until the picture is written: upsampled, it spoils no detail of the
   normals. */
static void ssao_sat__store_blocked(const ssao_sat *s, const ssao_sat__point *p, size_t at, float gain)
{
    int c;
    for (c = 0; c < 3; c++) s->work.blocked[c][at] = gain * ssao_sat__sum_lanes(p->blocked[0][c], p->blocked[1][c]);
}
#endif

/* Is everything in sight one plane? */
static inline int ssao_sat__is_flat(const ssao_sat *s, int x, int y, float half_side)
{
    const int rx = (int)(half_side + 0.5f) + 2, ry = (int)(half_side * s->camera.aspect + 0.5f) + 2;
    ssao_sat__rect r;
    if (!s->options.skip_flat) return 0;
    r.x0 = sat__max_int(x - rx, 0);
    r.y0 = sat__max_int(y - ry, 0);
    r.x1 = sat__min_int(x + rx + 1, s->columns);
    r.y1 = sat__min_int(y + ry + 1, s->rows);
    return ssao_sat__box(s, s->flags, 1, r) == 0;
}

/* How many rings, from the outermost on, have anything but one plane in sight. */
static inline int ssao_sat__ring_count(const ssao_sat *s, int x, int y, float half_side)
{
    int rings = 1;
    while (rings < s->options.scales && !ssao_sat__is_flat(s, x, y, half_side *= 1 / 3.0f)) rings++;
    return rings;
}

static void ssao_sat__set_point(ssao_sat__point *p, const ssao_sat *s, int x, int y, size_t at)
{
    const float z = s->work.z[at], scale = s->camera.orthographic ? 1 : z, nx = s->work.nx[at], ny = s->work.ny[at];
    const float rx = s->camera.ax * (float)x + s->camera.bx, ry = s->camera.ay * (float)y + s->camera.by;
    int i;
    p->x = x;
    p->y = y;
    p->z = z;
    p->facing = s->work.nz[at];
    if (!s->camera.orthographic) p->facing += nx * rx + ny * ry;
    p->slope[0] = fabsf(nx * s->camera.ax);
    p->slope[1] = fabsf(ny * s->camera.ay);
    p->at[0] = sat__f32x4_set1(rx * scale);
    p->at[1] = sat__f32x4_set1(ry * scale);
    p->at[2] = sat__f32x4_set1(z);
    p->least = sat__f32x4_set1(z * z * 1e-12f + 1e-37f);
    p->n[0] = sat__f32x4_set1(nx);
    p->n[1] = sat__f32x4_set1(ny);
    p->n[2] = sat__f32x4_set1(s->work.nz[at]);
    p->occlusion[0] = p->occlusion[1] = sat__f32x4_set1(0);
    for (i = 0; i < 6; i++) p->blocked[i / 3][i % 3] = p->occlusion[0];
}

/* The slabs that meet [z - range, z + range], and what the statistics say of the pixel. */
static inline void ssao_sat__set_reach(ssao_sat__point *p, const ssao_sat *s, ssao_sat_stats *stats)
{
    const int side_x = (int)p->half_side + 1, side_y = (int)(p->half_side * s->camera.aspect) + 1;
    int k;
    p->first_slab = 0;
    p->end_slab = s->frame_slabs;
    while (p->first_slab < p->end_slab - 1 && s->edge[p->first_slab + 1] < p->z - s->range) p->first_slab++;
    while (p->end_slab > p->first_slab + 1 && s->edge[p->end_slab - 1] > p->z + s->range) p->end_slab--;
    for (k = 0; k < s->frame_slabs; k++)
        if (k >= p->first_slab && k < p->end_slab && s->used_slabs >> k & 1) stats->slabs_visited++;
        else stats->slabs_skipped++;
    stats->border +=
        p->x < side_x || p->y < side_y || p->x + side_x >= s->columns || p->y + side_y >= s->rows;
    stats->estimated++;
}

/* Occlusion of one pixel of the tables. */
static void ssao_sat__estimate_slabs(ssao_sat *s, const ssao_sat__lanes *l, int x, int y, ssao_sat_stats *stats)
{
    size_t at = ssao_sat__at(s, y) + (size_t)x;
    ssao_sat__point p;
    float fade, z = s->work.z[at];
    int cut;
    s->work.open[at] = 1;
    if (!(z > 0)) { stats->sky++; return; }
    ssao_sat__set_point(&p, s, x, y, at);
    p.half_side = ssao_sat__half_side(s, z, &cut);
    fade = ssao_sat__fade(s, p.half_side);
    stats->cut += (size_t)cut;
    if (!(fade > 0)) stats->tiny++;
    else if (ssao_sat__is_flat(s, x, y, p.half_side)) stats->flat++;
    else {
        ssao_sat__set_reach(&p, s, stats);
        if (s->geometric) {
            ssao_sat__vector n = ssao_sat__depth_normal(s, x * s->step, y * s->step, z);
            p.surface[0] = sat__f32x4_set1(n.x);
            p.surface[1] = sat__f32x4_set1(n.y);
            p.surface[2] = sat__f32x4_set1(n.z);
        }
        ssao_sat__add_rings(&p, s, l, ssao_sat__ring_count(s, x, y, p.half_side));
        fade *= ssao_sat__by_facing(s, &p);
        s->work.open[at] =
            ssao_sat__accessibility(s, ssao_sat__sum_lanes(p.occlusion[0], p.occlusion[1]), fade * s->fit.gain);
    }
#ifndef SSAO_SAT_NO_BENT
    if (s->to.bent) ssao_sat__store_blocked(s, &p, at, fade * s->fit.gain * SSAO_SAT__BLOCKED);
#endif
}
#endif /* SSAO_SAT_NO_SLABS */

/* ------------------------------------------------------------------------------------------------
   >> estimate by one table: MINIMALIST, NORMAL_GUIDED, REFINED as published, and PLANE
   ------------------------------------------------------------------------------------------------ */

/* A region and its corners in the table: 3 x 3 of them first, 5 x 5 when a child is split again (Slomp 2012, figure
   5.12: 9 and 25 lookups instead of 20 and 84). */
typedef struct ssao_sat__region {
    int x[5], y[5];
    uint32_t corner[5][5];
    int fine; /* all 25 are there */
    ssao_sat_stats *stats; /* counts the lookups */
} ssao_sat__region;

/* A pixel of the tables: its centre in them, its ray (0, 0 in orthographic views). */
typedef struct ssao_sat__pixel {
    float x, y, z, ray_x, ray_y, half_side;
    ssao_sat__vector n;
} ssao_sat__pixel;

/* Looks up the corners at multiples of `step`, except those at multiples of `have`. */
static void ssao_sat__look_up(ssao_sat__region *r, const ssao_sat *s, int step, int have)
{
    int i, j;
    for (j = 0; j < 5; j += step)
        for (i = 0; i < 5; i += step) {
            if (have && i % have == 0 && j % have == 0) continue;
            r->corner[j][i] = s->table[(size_t)(r->y[j] - s->first) * s->table_stride + (size_t)r->x[i]];
            r->stats->lookups++;
        }
}

static inline int ssao_sat__round(float v)
{
    float rounded = floorf(v + 0.5f);
    return (int)rounded;
}

static void ssao_sat__set_region(ssao_sat__region *r, const ssao_sat *s, float cx, float cy, float half_x)
{
    const float half_y = half_x * s->camera.aspect;
    float x0 = cx - half_x, x1 = cx + half_x, y0 = cy - half_y, y1 = cy + half_y;
    r->x[0] = sat__clamp_int(ssao_sat__round(x0), 0, s->columns - 1);
    r->y[0] = sat__clamp_int(ssao_sat__round(y0), 0, s->rows - 1);
    r->x[4] = sat__clamp_int(ssao_sat__round(x1), r->x[0] + 1, s->columns);
    r->y[4] = sat__clamp_int(ssao_sat__round(y1), r->y[0] + 1, s->rows);
    r->x[2] = (r->x[0] + r->x[4]) / 2;
    r->y[2] = (r->y[0] + r->y[4]) / 2;
    r->x[1] = (r->x[0] + r->x[2]) / 2;
    r->y[1] = (r->y[0] + r->y[2]) / 2;
    r->x[3] = (r->x[2] + r->x[4]) / 2;
    r->y[3] = (r->y[2] + r->y[4]) / 2;
    r->fine = 0;
}

/* Parts of a region: from corner (i, j) on, `step` of the 4 x 4 parts along both axes. */
static inline float ssao_sat__area(const ssao_sat__region *r, int i, int j, int step)
{
    return (float)((r->x[i + step] - r->x[i]) * (r->y[j + step] - r->y[j]));
}

/* Mean of the table's values over part of the region, of area > 0. */
static float ssao_sat__mean(const ssao_sat__region *r, const ssao_sat *s, int i0, int j0, int step)
{
    const int i1 = i0 + step, j1 = j0 + step;
    float area = ssao_sat__area(r, i0, j0, step);
    uint32_t a = r->corner[j0][i0], b = r->corner[j0][i1], c = r->corner[j1][i0], d = r->corner[j1][i1];
    if (s->options.float_table)
        return s->mean +
               (sat__float_from_bits(d) - sat__float_from_bits(c) - sat__float_from_bits(b) + sat__float_from_bits(a)) /
                   area;
    return s->value.low + s->value.quantum * (float)(d - c - b + a) / area;
}

/* How much nearer than z the mean is (Slomp 2012, 5.4.1), in world units. */
static float ssao_sat__deficit(const ssao_sat *s, float mean, float z)
{
    return s->options.inverted_depth ? (mean * z - 1) * z : z - mean;
}

#ifndef SSAO_SAT_NO_REFINED
/* Eq 5.4 over the children of one node: those that are nearer than their parent, weighted by area. As printed (E:
   "higher", where 5.4.1 calls higher values farther away) the others are kept. No child passes: the parent. */
static float ssao_sat__refine(ssao_sat__region *r, const ssao_sat *s, float z, int i0, int j0, int level)
{
    const int step = level ? 1 : 2; /* of the children */
    float parent_mean = ssao_sat__mean(r, s, i0, j0, 2 * step), parent = ssao_sat__deficit(s, parent_mean, z);
    float sum = 0, weight = 0;
    int i, j;
    if (level >= s->options.refine_levels || fabsf(parent) >= (float)s->options.refine_threshold * z) return parent;
    if (r->x[i0 + 2 * step] - r->x[i0] < 2 || r->y[j0 + 2 * step] - r->y[j0] < 2) return parent;
    if (level == 0) ssao_sat__look_up(r, s, 2, 4);
    else if (!r->fine) {
        ssao_sat__look_up(r, s, 1, 2);
        r->fine = 1;
    }
    for (j = j0; j < j0 + 2 * step; j += step)
        for (i = i0; i < i0 + 2 * step; i += step) {
            float mean = ssao_sat__mean(r, s, i, j, step), child = ssao_sat__deficit(s, mean, z);
            float area = ssao_sat__area(r, i, j, step);
            if (!(s->options.as_printed ? mean > parent_mean : child > parent)) continue;
            if (level == 0) child = ssao_sat__refine(r, s, z, i, j, 1);
            sum += area * child;
            weight += area;
        }
    return weight > 0 ? sum / weight : parent;
}
#endif

/* Where the region is centred: moved along the projected normal (5.4.2). A normal n at P moves its point along
   n.xy - n.z P.xy / P.z on the screen; the text's n.xy is right in orthographic views. PLANE: along n.xy too. */
static inline void ssao_sat__guide(const ssao_sat *s, const ssao_sat__pixel *p, float *cx, float *cy)
{
    const int plane = s->options.method == SSAO_SAT_PLANE;
    float straight = s->options.as_printed || s->camera.orthographic || plane ? 0 : p->n.z;
    float dx = (p->n.x - straight * p->ray_x) * (s->camera.ax > 0 ? 1.0f : -1.0f),
          dy = (p->n.y - straight * p->ray_y) * (s->camera.ay > 0 ? 1.0f : -1.0f);
    float offset = (plane ? 1 : (float)s->options.normal_offset) * p->half_side, length = dx * dx + dy * dy;
    if (length > 1 && !plane) offset /= sqrtf(length);
    *cx += dx * offset;
    *cy += dy * offset * s->camera.aspect;
}

static inline float ssao_sat__published(const ssao_sat *s, ssao_sat__region *r, float z)
{
    float deficit, gain = 1;
    ssao_sat__look_up(r, s, 4, 0);
#ifndef SSAO_SAT_NO_REFINED
    if (s->options.method == SSAO_SAT_REFINED) deficit = ssao_sat__refine(r, s, z, 0, 0, 0);
    else
#endif
        deficit = ssao_sat__deficit(s, ssao_sat__mean(r, s, 0, 0, 4), z);
    if (s->farthest > s->nearest) gain += (float)s->options.depth_gain * (z - s->nearest) / (s->farthest - s->nearest);
    return deficit > 0 ? gain * deficit / s->radius : 0;
}

/* Mean of max(plane, 0) over a box, of a plane with this value at the centre and at most `spread` off it: beyond its
   horizon there is sky, 0 in the table. Exact where the plane falls along an axis, and more than that otherwise. */
static inline float ssao_sat__plane_mean(float centre, float spread)
{
    if (centre >= spread) return centre;
    return centre > -spread ? (centre + spread) * (centre + spread) / (4 * spread) : 0;
}

/* Height of the mean over the tangent plane, for each of the boxes. In perspective the plane is 1/z = n.ray / n.P, in
   orthographic views z itself is affine: both are compared at the centre of the box, where their mean over the box
   lies. */
static inline float ssao_sat__over_plane(const ssao_sat *s, ssao_sat__region *r, const ssao_sat__pixel *p)
{
    float gx, gy, own, to_height, sum = 0, facing = p->n.x * p->ray_x + p->n.y * p->ray_y + p->n.z; /* n.P / z */
    int i, j, step = s->options.plane_boxes == 2 ? 2 : 4;
    if (facing > -SSAO_SAT__GRAZING) facing = -SSAO_SAT__GRAZING;
    if (s->camera.orthographic) {
        gx = p->n.x / facing * s->camera.ax;
        gy = p->n.y / facing * s->camera.ay;
        own = s->farthest - p->z;
        to_height = -facing / s->radius;
    } else {
        gx = p->n.x * s->camera.ax / (facing * p->z);
        gy = p->n.y * s->camera.ay / (facing * p->z);
        own = 1 / p->z;
        to_height = -facing * p->z * p->z / s->radius;
    }
    ssao_sat__look_up(r, s, step, 0);
    for (j = 0; j < 4; j += step)
        for (i = 0; i < 4; i += step) {
            float height, spread, cx = 0.5f * (float)(r->x[i] + r->x[i + step]),
                                  cy = 0.5f * (float)(r->y[j] + r->y[j + step]);
            if (!(ssao_sat__area(r, i, j, step) > 0)) continue;
            spread =
                0.5f * (fabsf(gx) * (float)(r->x[i + step] - r->x[i]) + fabsf(gy) * (float)(r->y[j + step] - r->y[j]));
            height = (ssao_sat__mean(r, s, i, j, step) -
                      ssao_sat__plane_mean(own + gx * (cx - p->x) + gy * (cy - p->y), spread)) *
                     to_height;
            if (height > 0) sum += height / (1 + s->fit.range * height * height);
        }
    return sum / (float)(s->options.plane_boxes * s->options.plane_boxes);
}

/* Mean depth of a region; harmonic where the table holds 1/z. */
static float ssao_sat__mean_depth(const ssao_sat *s, ssao_sat__region *r)
{
    float mean;
    if (s->options.method == SSAO_SAT_SLABS) {
        ssao_sat__rect rect;
        float affine = 0;
        uint32_t total = 0;
        int k;
        rect.x0 = r->x[0];
        rect.y0 = r->y[0];
        rect.x1 = r->x[4];
        rect.y1 = r->y[4];
        for (k = 0; k < s->frame_slabs; k++) {
            const uint32_t *table = s->table + 4 * (size_t)k * s->table_plane;
            uint32_t count = ssao_sat__box(s, table, 4, rect), level = ssao_sat__box(s, table + 1, 4, rect);
            affine += s->slabs[k].low * (float)count + s->slabs[k].quantum * (float)level;
            total += count;
            r->stats->lookups += 8;
        }
        mean = affine / (float)(total ? total : 1);
        return s->camera.orthographic ? mean : 1 / mean;
    }
    ssao_sat__look_up(r, s, 4, 0);
    mean = ssao_sat__mean(r, s, 0, 0, 4);
    if (ssao_sat__table_is_inverse(s)) return 1 / mean;
    return s->options.method == SSAO_SAT_PLANE ? s->farthest - mean : mean;
}

static inline void ssao_sat__set_pixel(ssao_sat__pixel *p, const ssao_sat *s, int x, int y)
{
    const size_t at = ssao_sat__at(s, y) + (size_t)x;
    const float perspective = s->camera.orthographic ? 0.0f : 1.0f;
    p->x = (float)x + 0.5f;
    p->y = (float)y + 0.5f;
    p->z = s->work.z[at];
    p->ray_x = (s->camera.ax * (float)x + s->camera.bx) * perspective;
    p->ray_y = (s->camera.ay * (float)y + s->camera.by) * perspective;
    p->n.x = s->work.nx[at];
    p->n.y = s->work.ny[at];
    p->n.z = s->work.nz[at];
}

/* One pixel of a single-table method, or of the signed output of any method. */
static float ssao_sat__estimate_pixel(const ssao_sat *s, int x, int y, ssao_sat_stats *stats)
{
    float cx, cy, fade, half_y, v;
    ssao_sat__region region;
    ssao_sat__pixel p;
    int cut;
    ssao_sat__set_pixel(&p, s, x, y);
    if (!(p.z > 0)) { stats->sky++; return s->to.is_signed ? 0.0f : 1.0f; }
    p.half_side = ssao_sat__half_side(s, p.z, &cut);
    fade = ssao_sat__fade(s, p.half_side);
    if (!(fade > 0)) { stats->tiny++; return s->to.is_signed ? 0.0f : 1.0f; }
    stats->cut += (size_t)cut;
    stats->estimated++;
    cx = p.x;
    cy = p.y;
    if (!s->to.is_signed && s->options.method != SSAO_SAT_MINIMALIST) ssao_sat__guide(s, &p, &cx, &cy);
    half_y = p.half_side * s->camera.aspect;
    stats->border += cx - p.half_side < 0 || cx + p.half_side > (float)s->columns || cy - half_y < 0 ||
                     cy + half_y > (float)s->rows;
    region.stats = stats;
    ssao_sat__set_region(&region, s, cx, cy, p.half_side);
    if (s->to.is_signed) {
        v = fade * (float)s->options.gain * (ssao_sat__mean_depth(s, &region) - p.z) / s->radius;
        return v > 1 ? 1 : v > -1 ? v : -1;
    }
    v = s->options.method == SSAO_SAT_PLANE ? ssao_sat__over_plane(s, &region, &p)
                                            : ssao_sat__published(s, &region, p.z);
    return ssao_sat__accessibility(s, v, fade * s->fit.gain);
}

#ifndef SSAO_SAT_NO_SLABS
/* Of the angle between the normals of two pixels. */
static inline float ssao_sat__cosine(const ssao_sat__pixels *p, size_t a, size_t b)
{
    return p->nx[a] * p->nx[b] + p->ny[a] * p->ny[b] + p->nz[a] * p->nz[b];
}

/* Do the table pixels `offset` before and after this one lie on a plane with it, and agree? */
static inline int ssao_sat__agrees(const ssao_sat *s, size_t at, ptrdiff_t offset, float z)
{
    const size_t a = at - (size_t)offset, b = at + (size_t)offset;
    const float own = s->affine[at], bend = s->affine[a] + s->affine[b] - 2 * own;
    if (!(s->work.z[a] > 0) || !(s->work.z[b] > 0)) return 0;
    if (!(fabsf(s->work.open[a] - s->work.open[b]) <= (float)s->options.tolerance)) return 0;
    if (!(fabsf(bend) * (s->camera.orthographic ? 1 : z) <= SSAO_SAT__BEND * s->radius * own / z)) return 0;
    return ssao_sat__cosine(&s->work, at, a) > SSAO_SAT__ALIKE && ssao_sat__cosine(&s->work, at, b) > SSAO_SAT__ALIKE;
}

/* A pixel between two or four of those `spacing` apart takes their mean where they agree. */
static int ssao_sat__interpolate(ssao_sat *s, int x, int y, int spacing, ssao_sat_stats *stats)
{
    const int dx = x & spacing, dy = y & spacing;
    const size_t at = ssao_sat__at(s, y) + (size_t)x;
    const ptrdiff_t down = (ptrdiff_t)s->stride * dy, first = down + dx, second = down - dx;
    const float z = s->work.z[at], tolerance = (float)s->options.tolerance;
    float *planes[4];
    int i, cut;
    if (!(z > 0) || x + dx >= s->columns || y + dy >= s->rows) return 0;
    if (spacing > 1 && ssao_sat__half_side(s, z, &cut) < SSAO_SAT__COARSE) return 0;
    if (!ssao_sat__agrees(s, at, first, z)) return 0;
    if (dx && dy && (!(fabsf(s->work.open[at - (size_t)first] - s->work.open[at - (size_t)second]) <= tolerance) ||
                     !ssao_sat__agrees(s, at, second, z)))
        return 0;
    planes[0] = s->work.open;
    for (i = 0; i < 3; i++) planes[i + 1] = s->work.blocked[i];
    for (i = 0; i < (s->to.bent ? 4 : 1); i++) {
        float *v = planes[i] + at, mean = 0.5f * (v[-first] + v[first]);
        if (dx && dy) mean = 0.5f * mean + 0.25f * (v[-second] + v[second]);
        *v = mean;
    }
    stats->interpolated++;
    return 1;
}

/* A row of one of the passes: estimates SPACING apart, then what lies between them, then between these. */
static void ssao_sat__estimate_row(ssao_sat *s, const ssao_sat__lanes *lanes, int y, ssao_sat_stats *stats)
{
    const int spacing = s->spacing, first = spacing == SSAO_SAT__SPACING || !(s->options.tolerance > 0);
    int x;
    if (y % spacing) return;
    for (x = 0; x < s->columns; x += spacing) {
        if (!first && !((x | y) & spacing)) continue;
        if (first || !ssao_sat__interpolate(s, x, y, spacing, stats)) ssao_sat__estimate_slabs(s, lanes, x, y, stats);
    }
}
#endif

static void ssao_sat__estimate_rows(int begin, int end, int worker, void *context)
{
    ssao_sat *s = (ssao_sat *)context;
    ssao_sat_stats unused;
    int y, x;
#ifndef SSAO_SAT_NO_SLABS
    ssao_sat__lanes lanes;
    if (s->options.method == SSAO_SAT_SLABS && !s->to.is_signed) ssao_sat__set_lanes(&lanes, s);
#endif
    memset(&unused, 0, sizeof unused);
    for (y = s->estimated_first + begin; y < s->estimated_first + end; y++) {
        ssao_sat_stats *stats =
            y >= s->begin && y < s->end ? &s->workers[worker].stats : &unused; /* neighbours of the band count there */
#ifndef SSAO_SAT_NO_SLABS
        if (s->options.method == SSAO_SAT_SLABS && !s->to.is_signed) {
            ssao_sat__estimate_row(s, &lanes, y, stats);
            continue;
        }
#endif
        for (x = 0; x < s->columns; x++)
            s->work.open[ssao_sat__at(s, y) + (size_t)x] = ssao_sat__estimate_pixel(s, x, y, stats);
    }
}

/* ------------------------------------------------------------------------------------------------
   >> output: copied, or upsampled with weights that fall with the distance of a neighbour from the pixel's tangent
   plane and with the angle between the normals. Sky has no weight; a pixel without neighbours on its plane takes what
   is near.
   ------------------------------------------------------------------------------------------------ */

static inline float *ssao_sat__out_row(void *out, ptrdiff_t stride, int y)
{
    return (float *)(void *)((unsigned char *)out + (ptrdiff_t)y * stride);
}

/* A row of accessibility as the caller wants it. */
static void ssao_sat__pack_row(const ssao_sat *s, int y, const float *row)
{
    void *out = ssao_sat__out_row(s->to.out, s->to.stride, y);
    int x;
    if (s->to.element == 4) memcpy(out, row, (size_t)s->width * sizeof *row);
    for (x = 0; x < s->width && s->to.element == 2; x++) ((uint16_t *)out)[x] = sat__half_from_float(row[x]);
    for (x = 0; x < s->width && s->to.element == 1; x++) ((uint8_t *)out)[x] = (uint8_t)(row[x] * 255 + 0.5f);
}

#ifndef SSAO_SAT_NO_BENT
/* Mean free direction of pixel i: that of the open hemisphere less what is blocked. z turns from forward to
   OpenGL's. */
static inline void ssao_sat__write_bent(const ssao_sat *s, float *out, const ssao_sat__pixels *p, size_t i)
{
    const float x = SSAO_SAT__OPEN_LENGTH * p->nx[i] - p->blocked[0][i],
                y = SSAO_SAT__OPEN_LENGTH * p->ny[i] - p->blocked[1][i],
                z = SSAO_SAT__OPEN_LENGTH * p->nz[i] - p->blocked[2][i], length = sqrtf(x * x + y * y + z * z);
    const int is_there = p->z[i] > 0, has_direction = is_there && length > SSAO_SAT__NO_DIRECTION;
    out[0] = has_direction ? x / length : is_there ? p->nx[i] : 0;
    out[1] = has_direction ? y / length : is_there ? p->ny[i] : 0;
    out[2] = s->camera.forward * (has_direction ? z / length : is_there ? p->nz[i] : -1);
}

static void ssao_sat__write_bents(const ssao_sat *s, const ssao_sat__pixels *p, size_t i, const ssao_sat__strip *strip)
{
    float *bent = ssao_sat__out_row(s->to.bent, s->to.bent_stride, strip->y);
    int x;
    for (x = strip->begin; x < strip->end; x += strip->step) ssao_sat__write_bent(s, bent + 3 * x, p, i++);
}
#endif

static void ssao_sat__copy_row(const ssao_sat *s, int y)
{
    const size_t at = ssao_sat__at(s, y);
    ssao_sat__pack_row(s, y, s->work.open + at);
#ifndef SSAO_SAT_NO_BENT
    if (s->to.bent) {
        ssao_sat__strip strip = {0, 0, 0, 1};
        strip.y = y;
        strip.end = s->width;
        ssao_sat__write_bents(s, &s->work, at, &strip);
    }
#endif
}

/* n.p of a pixel at distance z on the ray (rx, ry, 1); scale: z in perspective, else 1. */
static inline sat__f32x4 ssao_sat__along(const sat__f32x4 *n, sat__f32x4 scale, sat__f32x4 rx, float ry, sat__f32x4 z)
{
    const sat__f32x4 xy = sat__f32x4_add(sat__f32x4_mul(n[0], rx), sat__f32x4_mul(n[1], sat__f32x4_set1(ry)));
    return sat__f32x4_add(sat__f32x4_mul(scale, xy), sat__f32x4_mul(n[2], z));
}

/* Pixels first .. first + 3 of a strip: the 3 x 3 table pixels around (x / 2, y / 2). */
static void ssao_sat__upsample_lanes(const ssao_sat *s, const ssao_sat__pixels *r, const ssao_sat__strip *strip,
                                     int first)
{
    const int x0 = strip->begin, y = strip->y;
    const sat__f32x4 orthographic = sat__f32x4_set1(s->camera.orthographic ? 1.0f : 0.0f),
                     perspective = sat__f32x4_set1(s->camera.orthographic ? 0.0f : 1.0f);
    const sat__f32x4 zero = sat__f32x4_set1(0), one = sat__f32x4_set1(1), z = sat__f32x4_load(r->z + first);
    const sat__f32x4 scale = sat__f32x4_add(sat__f32x4_mul(z, perspective), orthographic);
    float lane[4], ry = (float)(s->camera.full[2] * (y + 0.5) + s->camera.full[3]);
    sat__f32x4 total = sat__f32x4_set1(1e-20f), sum = s->to.is_signed ? zero : total, n[3], rx, own, sharpness,
               blocked[3];
    int i, j, k, c;
    n[0] = sat__f32x4_load(r->nx + first);
    n[1] = sat__f32x4_load(r->ny + first);
    n[2] = sat__f32x4_load(r->nz + first);
    for (i = 0; i < 4; i++) lane[i] = (float)(s->camera.full[0] * (x0 + 2 * (first + i) + 0.5) + s->camera.full[1]);
    rx = sat__f32x4_load(lane);
    own = ssao_sat__along(n, scale, rx, ry, z);
    sharpness = sat__f32x4_max(z, sat__f32x4_set1(1 / SSAO_SAT__FAR));
    sharpness = sat__f32x4_div(sat__f32x4_set1(SSAO_SAT__SHARPNESS), sharpness);
    for (c = 0; c < 3; c++) blocked[c] = zero;
    for (j = sat__max_int(y / 2 - 1, 0); j <= sat__min_int(y / 2 + 1, s->rows - 1); j++) {
        size_t at = ssao_sat__at(s, j) + (size_t)first;
        float row_y = s->camera.ay * (float)j + s->camera.by;
        for (k = -1; k <= 1; k++) {
            const size_t t = at + (size_t)k; /* at >= 1: rows are padded */
            const int dx = 2 * k - x0, dy = 2 * j - y;
            sat__f32x4 tx = sat__f32x4_add(rx, sat__f32x4_set1((float)s->camera.full[0] * (float)dx)),
                       tz = sat__f32x4_load(s->work.z + t), tn[3], on_plane, alike, weight;
            on_plane = ssao_sat__along(n, sat__f32x4_add(sat__f32x4_mul(tz, perspective), orthographic), tx, row_y, tz);
            on_plane = sat__f32x4_mul(sat__f32x4_abs(sat__f32x4_sub(on_plane, own)), sharpness);
            on_plane = sat__f32x4_max(zero, sat__f32x4_sub(one, on_plane));
            tn[0] = sat__f32x4_load(s->work.nx + t);
            tn[1] = sat__f32x4_load(s->work.ny + t);
            tn[2] = sat__f32x4_load(s->work.nz + t);
            alike = sat__f32x4_max(zero, ssao_sat__dot(n, tn));
            alike = sat__f32x4_mul(alike, alike);
            weight = sat__f32x4_mul(on_plane, sat__f32x4_mul(alike, alike));
            weight = sat__f32x4_add(weight, sat__f32x4_set1(SSAO_SAT__ELSEWHERE));
            weight = sat__f32x4_mul(weight, sat__f32x4_set1(1 / (float)((1 + dx * dx) * (1 + dy * dy))));
            weight = ssao_sat__if_positive(tz, weight);
            total = sat__f32x4_add(total, weight);
            sum = sat__f32x4_add(sum, sat__f32x4_mul(weight, sat__f32x4_load(s->work.open + t)));
            for (c = 0; c < 3 && s->to.bent; c++)
                blocked[c] =
                    sat__f32x4_add(blocked[c], sat__f32x4_mul(weight, sat__f32x4_load(s->work.blocked[c] + t)));
        }
    }
    sat__f32x4_store(r->open + first, sat__f32x4_div(sum, total));
    for (c = 0; c < 3 && s->to.bent; c++) sat__f32x4_store(r->blocked[c] + first, sat__f32x4_div(blocked[c], total));
}

/* Are all table pixels around these four of the picture open? Then they are, whatever the weights. */
static inline int ssao_sat__is_open(const ssao_sat *s, int y, int first)
{
    const sat__f32x4 one = sat__f32x4_set1(1);
    int j;
    if (s->to.bent || s->to.is_signed) return 0;
    for (j = sat__max_int(y / 2 - 1, 0); j <= sat__min_int(y / 2 + 1, s->rows - 1); j++) {
        const float *open = s->work.open + ssao_sat__at(s, j) + (size_t)first;
        if (ssao_sat__any_positive(sat__f32x4_sub(one, sat__f32x4_load(open - 1))) ||
            ssao_sat__any_positive(sat__f32x4_sub(one, sat__f32x4_load(open + 1))))
            return 0;
    }
    return 1;
}

/* Every second pixel of a row into r. */
static void ssao_sat__upsample_strip(const ssao_sat *s, const ssao_sat__pixels *r, const ssao_sat__strip *strip)
{
    ssao_sat__strip four = *strip;
    int i;
    for (i = 0; four.begin < strip->end; i += 4, four.begin += 8) {
        if (ssao_sat__is_open(s, strip->y, i)) {
            sat__f32x4_store(r->open + i, sat__f32x4_set1(1));
            sat__f32x4_store(r->z + i, sat__f32x4_set1(1));
            continue;
        }
        four.end = sat__min_int(four.begin + 8, strip->end);
        ssao_sat__read_strip(s, r, (size_t)i, &four, NULL);
        ssao_sat__upsample_lanes(s, r, strip, i);
    }
}

static void ssao_sat__write_strip(const ssao_sat *s, float *out, const ssao_sat__pixels *r,
                                  const ssao_sat__strip *strip)
{
    int x, i = 0;
    for (x = strip->begin; x < strip->end; x += strip->step, i++)
        out[x] = r->z[i] > 0 ? r->open[i] : s->to.is_signed ? 0.0f : 1.0f;
#ifndef SSAO_SAT_NO_BENT
    if (s->to.bent) ssao_sat__write_bents(s, r, 0, strip);
#endif
}

static void ssao_sat__write_rows(int begin, int end, int worker, void *context)
{
    ssao_sat *s = (ssao_sat *)context;
    float *scratch = s->scratch + (size_t)worker * 8 * s->stride;
    ssao_sat__pixels r;
    ssao_sat__strip strip = {0, 0, 0, 2};
    float *out;
    int c;
    r.z = scratch;
    r.nx = scratch + s->stride;
    r.ny = scratch + 2 * s->stride;
    r.nz = scratch + 3 * s->stride;
    r.open = scratch + 4 * s->stride;
    for (c = 0; c < 3; c++) r.blocked[c] = scratch + (size_t)(5 + c) * s->stride;
    strip.end = s->width;
    for (strip.y = s->begin * s->step + begin; strip.y < s->begin * s->step + end; strip.y++) {
        if (s->step == 1) {
            ssao_sat__copy_row(s, strip.y);
            continue;
        }
        out = r.blocked[0]; /* not bent then */
        if (s->to.element == 4) out = ssao_sat__out_row(s->to.out, s->to.stride, strip.y);
        for (strip.begin = 0; strip.begin < 2 && strip.begin < s->width; strip.begin++) {
            ssao_sat__upsample_strip(s, &r, &strip);
            ssao_sat__write_strip(s, out, &r, &strip);
        }
        if (s->to.element != 4) ssao_sat__pack_row(s, strip.y, out);
    }
}

/* ------------------------------------------------------------------------------------------------
   >> frame: band by band rows are read, tables built, pixels estimated, rows written
   ------------------------------------------------------------------------------------------------ */

static void ssao_sat__run_band(ssao_sat *s, int begin, int end)
{
    const sat_threads *threads = &s->options.threads;
    int sparse = s->options.method == SSAO_SAT_SLABS && !s->to.is_signed && s->options.tolerance > 0;
    int reserve = s->reserve, i, last,
        tables = s->options.method == SSAO_SAT_SLABS ? s->frame_slabs + s->options.skip_flat : 1;
    s->begin = begin;
    s->end = end;
    s->first = sat__max_int(0, begin - reserve);
    s->held = sat__min_int(s->rows, end + reserve) - s->first;
    sat__parallel_for(threads, s->held, ssao_sat__hold_rows, s);
    for (i = 0; i < sat__worker_count(threads); i++) {
        const ssao_sat__worker *w = &s->workers[i];
        if (!(w->farthest > 0)) continue;
        if (w->nearest < s->band_nearest) s->band_nearest = w->nearest;
        if (w->farthest > s->band_farthest) s->band_farthest = w->farthest;
    }
    s->used_slabs = 0;
    for (i = 0; i < s->held && s->options.method == SSAO_SAT_SLABS; i++) s->used_slabs |= s->row_slabs[i];
    sat__parallel_for(threads, tables, ssao_sat__build_tables, s);
    s->estimated_first = begin - (s->step == 2 && begin > 0); /* upsampling takes from the rows beside the band */
    last = end - (s->step == 1 || end == s->rows);
    if (sparse) { /* and what lies between from what is around */
        s->estimated_first -= s->estimated_first % SSAO_SAT__SPACING;
        last = sat__min_int((last + SSAO_SAT__SPACING - 1) / SSAO_SAT__SPACING * SSAO_SAT__SPACING, s->rows - 1);
    }
    for (s->spacing = sparse ? SSAO_SAT__SPACING : 1; s->spacing; s->spacing /= 2)
        sat__parallel_for(threads, last + 1 - s->estimated_first, ssao_sat__estimate_rows, s);
    sat__parallel_for(threads, sat__min_int(end * s->step, s->height) - begin * s->step, ssao_sat__write_rows, s);
}

/* Nothing can occlude: all open, signed 0. */
static void ssao_sat__fill(ssao_sat *s)
{
    int y, x;
    for (y = 0; y < s->height; y++) {
        float *o = s->to.element == 4 ? ssao_sat__out_row(s->to.out, s->to.stride, y) : s->scratch;
        for (x = 0; x < s->width; x++) o[x] = s->to.is_signed ? 0.0f : 1.0f;
        if (s->to.element != 4) ssao_sat__pack_row(s, y, o);
#ifndef SSAO_SAT_NO_BENT
        if (s->to.bent) {
            float *b = ssao_sat__out_row(s->to.bent, s->to.bent_stride, y);
            for (x = 0; x < s->width; x++) {
                float z = ssao_sat__distance(s, x, y);
                ssao_sat__vector n = {0, 0, -1};
                if (z > 0) n = ssao_sat__normal(s, x, y, z, &s->workers[0].stats);
                b[3 * x] = n.x;
                b[3 * x + 1] = n.y;
                b[3 * x + 2] = s->camera.forward * n.z;
            }
        }
#endif
    }
}

/* The mean that float_table 2 takes off: of the 32 x 32 sample, near enough and cheap. */
static float ssao_sat__sample_mean(const ssao_sat *s)
{
    float sum = 0;
    int i, j;
    for (j = 0; j < SSAO_SAT__GRID; j++)
        for (i = 0; i < SSAO_SAT__GRID; i++) sum += ssao_sat__table_value(s, ssao_sat__sample(s, i, j));
    return sum / (SSAO_SAT__GRID * SSAO_SAT__GRID);
}

/* Half side of regions, in table pixels, whose cells' sums of x and y fit 31 bits. */
static double ssao_sat__largest_side(int columns, int rows, int step)
{
    return 1.5 * (sqrt(2147483648.0 / sat__max_int(columns, rows) / (step * step * step)) - 2);
}

static void ssao_sat__prepare_frame(ssao_sat *s)
{
    float side = (float)ssao_sat__largest_side(s->columns, s->rows, s->step);
    int cut;
    s->limit = (float)s->options.max_pixels < side ? (float)s->options.max_pixels : side;
    if (s->camera.aspect > 1) s->limit /= s->camera.aspect;
    s->largest = s->limit;
    side = ssao_sat__half_side(s, s->nearest, &cut);
    s->largest = (side > 2 ? side : 2) * (s->camera.aspect > 1 ? s->camera.aspect : 1);
    s->flat_limit = s->fit.bias / (4 * s->largest * s->camera.pixels);
    if (!s->camera.orthographic && !(s->options.region_pixels > 0)) { /* what is nearer than the range has larger
                                                                         regions */
        side *= SSAO_SAT__MARGIN;
        if (side > s->limit) side = s->limit;
        s->largest = (side > 2 ? side : 2) * (s->camera.aspect > 1 ? s->camera.aspect : 1);
    }
    if (s->camera.orthographic) s->flat_limit /= s->nearest; /* relative to z there */
    if (s->flat_limit < 5e-7f) s->flat_limit = 5e-7f;         /* the rounding of float depths */
    if (s->options.method == SSAO_SAT_SLABS) {
        ssao_sat__prepare_slabs(s);
    } else {
        ssao_sat__prepare_value(s);
        s->mean = s->options.float_table == 2 ? ssao_sat__sample_mean(s) : 0;
    }
}

/* Is the space of the given normals the view's? Those of the sample against the normals from depth. */
static void ssao_sat__compare_normals(const ssao_sat *s, ssao_sat_stats *stats)
{
    int i, j, x, y;
    for (j = 0; j < SSAO_SAT__GRID && s->input.normals; j++)
        for (i = 0; i < SSAO_SAT__GRID; i++) {
            ssao_sat__vector given, n;
            float z = ssao_sat__sample(s, i, j);
            if (!(z > 0)) continue;
            ssao_sat__sample_at(s, i, j, &x, &y);
            given = ssao_sat__normal(s, x, y, z, NULL);
            n = ssao_sat__depth_normal(s, x, y, z);
            stats->normals_compared++;
            stats->normals_off += given.x * n.x + given.y * n.y + given.z * n.z < 0.7f;
        }
}

static void ssao_sat__collect(const ssao_sat *s, ssao_sat_stats *stats, int was_filled)
{
    float low = 0, high = 0;
    int i;
    memset(stats, 0, sizeof *stats);
    stats->pixels = (size_t)s->columns * (size_t)s->rows;
    stats->bytes = s->bytes;
    ssao_sat__compare_normals(s, stats);
    for (i = 0; i < sat__worker_count(&s->options.threads); i++) {
        const ssao_sat__worker *w = &s->workers[i];
        if (!(w->farthest > 0)) continue;
        if (!(high > 0) || w->nearest < low) low = w->nearest;
        if (w->farthest > high) high = w->farthest;
    }
    stats->nearest = (double)(was_filled ? s->nearest : low);
    stats->farthest = (double)(was_filled ? s->farthest : high);
    for (i = 0; i < sat__worker_count(&s->options.threads); i++) {
        const ssao_sat_stats *w = &s->workers[i].stats;
        stats->sky += w->sky;
        stats->tiny += w->tiny;
        stats->flat += w->flat;
        stats->interpolated += w->interpolated;
        stats->estimated += w->estimated;
        stats->border += w->border;
        stats->cut += w->cut;
        stats->slabs_visited += w->slabs_visited;
        stats->slabs_skipped += w->slabs_skipped;
        stats->lookups += w->lookups;
        stats->normals_replaced += w->normals_replaced;
        stats->normals_backfacing += w->normals_backfacing;
    }
}

static void ssao_sat__run(ssao_sat *s, ssao_sat_stats *stats)
{
    int begin, band = s->options.band_rows ? s->options.band_rows : s->rows, fill;
    memset(s->workers, 0, (size_t)sat__worker_count(&s->options.threads) * sizeof *s->workers);
    fill = !(s->reach > 0) || !(s->fit.gain > 0);
    if (fill) ssao_sat__whole_range(s);
    else fill = !ssao_sat__sample_range(s) && !ssao_sat__whole_range(s);
    if (fill) ssao_sat__fill(s);
    else {
        s->band_nearest = s->nearest;
        s->band_farthest = s->farthest;
        ssao_sat__prepare_frame(s);
        for (begin = 0; begin < s->rows; begin += band)
            ssao_sat__run_band(s, begin, sat__min_int(begin + band, s->rows));
    }
    if (stats) ssao_sat__collect(s, stats, fill);
}

/* ------------------------------------------------------------------------------------------------
   >> entry points
   ------------------------------------------------------------------------------------------------ */

typedef struct ssao_sat__rows { const void *at; ptrdiff_t stride; size_t bytes; } ssao_sat__rows; /* bytes of a row */

static ssao_sat__rows ssao_sat__rows_of(const void *at, ptrdiff_t stride, int width, size_t pixel)
{
    ssao_sat__rows r;
    r.at = at;
    r.stride = stride;
    r.bytes = (size_t)width * pixel;
    return r;
}

/* First byte of the rows and the one after the last. */
static void ssao_sat__extent(uintptr_t *first, uintptr_t *end, const ssao_sat__rows *r, int height)
{
    *first = *end = (uintptr_t)r->at;
    if (r->stride < 0) *first -= (uintptr_t)(0 - r->stride) * (uintptr_t)(height - 1);
    else *end += (uintptr_t)r->stride * (uintptr_t)(height - 1);
    *end += r->bytes;
}

/* Do two sets of rows share a byte? Interleaved rows of one buffer count as sharing. */
static int ssao_sat__overlap(ssao_sat__rows a, ssao_sat__rows b, int height)
{
    uintptr_t first[2], end[2];
    if (!a.at || !b.at) return 0;
    ssao_sat__extent(&first[0], &end[0], &a, height);
    ssao_sat__extent(&first[1], &end[1], &b, height);
    return first[0] < end[1] && first[1] < end[0];
}

static const char *ssao_sat__bad_buffer(ssao_sat_input *in);

static sat_result ssao_sat__check_input(ssao_sat *s, const ssao_sat_input *input)
{
    ssao_sat_input *in = &s->input;
    *in = *input;
    if (in->width != s->width || in->height != s->height) return SAT_ERR_MISMATCH;
    if ((unsigned)in->depth_kind > (unsigned)SSAO_SAT_DEPTH_REVERSED || !(in->sky >= 0) || ssao_sat__bad_buffer(in))
        return SAT_ERR_ARGUMENT;
    return ssao_sat__read_camera(&s->camera, in, s->step, s->options.bottom_up) ? SAT_OK : SAT_ERR_ARGUMENT;
}

static int ssao_sat__rows_are_free(const ssao_sat *s, ssao_sat__rows out)
{
    const ssao_sat_input *in = &s->input;
    return !ssao_sat__overlap(out, ssao_sat__rows_of(in->depth, in->depth_stride, s->width, 4), s->height) &&
           !ssao_sat__overlap(out, ssao_sat__rows_of(in->half_depth, in->depth_stride, s->width, 2), s->height) &&
           !ssao_sat__overlap(out, ssao_sat__rows_of(in->normals, in->normal_stride, s->width, 12), s->height);
}

/* Resolves strides of 0. */
static int ssao_sat__output_is_valid(const ssao_sat *s, ssao_sat__output *to)
{
    const size_t element = (size_t)to->element;
    ssao_sat__rows out, bent;
    if (!sat__rows_are_valid(to->out, &to->stride, s->width, s->height, element, element)) return 0;
    out = ssao_sat__rows_of(to->out, to->stride, s->width, element);
    if (!ssao_sat__rows_are_free(s, out)) return 0;
    if (!to->bent) return 1;
    if (!sat__rows_are_valid(to->bent, &to->bent_stride, s->width, s->height, 12, 4)) return 0;
    bent = ssao_sat__rows_of(to->bent, to->bent_stride, s->width, 12);
    return ssao_sat__rows_are_free(s, bent) && !ssao_sat__overlap(out, bent, s->height);
}

static ssao_sat__fit ssao_sat__fit_of(const ssao_sat_options *o)
{
    ssao_sat__fit fit = ssao_sat__fits[o->method == SSAO_SAT_PLANE && o->plane_boxes == 1 ? 5 : (int)o->method];
    fit.gain *= (float)o->gain;
    return fit;
}

static sat_result ssao_sat__apply_to(ssao_sat *s, ssao_sat__output *to, const ssao_sat_input *input,
                                     ssao_sat_stats *stats)
{
    sat_result result;
    if (!s || !to->out || !input) return SAT_ERR_ARGUMENT;
    result = ssao_sat__check_input(s, input);
    if (result != SAT_OK) return result;
    if (!ssao_sat__output_is_valid(s, to)) return SAT_ERR_ARGUMENT;
    s->to = *to;
    s->geometric = s->options.geometric && s->input.normals != NULL;
    s->fit = ssao_sat__fit_of(&s->options);
    s->radius = (float)s->options.radius;
    s->reach = to->is_signed ? s->radius : s->radius * s->fit.reach;
    s->range = s->radius * s->fit.range;
    ssao_sat__run(s, stats);
    return SAT_OK;
}

static ssao_sat__output ssao_sat__output_of(void *out, ptrdiff_t stride, int element)
{
    ssao_sat__output to;
    memset(&to, 0, sizeof to);
    to.out = out;
    to.stride = stride;
    to.element = element;
    return to;
}

SSAO_SAT_DEF sat_result ssao_sat_apply(ssao_sat *ao, float *accessibility, ptrdiff_t out_stride,
                                       const ssao_sat_input *input, ssao_sat_stats *stats)
{
    ssao_sat__output to = ssao_sat__output_of(accessibility, out_stride, 4);
    return ssao_sat__apply_to(ao, &to, input, stats);
}

SSAO_SAT_DEF sat_result ssao_sat_apply_u8(ssao_sat *ao, uint8_t *accessibility, ptrdiff_t out_stride,
                                          const ssao_sat_input *input, ssao_sat_stats *stats)
{
    ssao_sat__output to = ssao_sat__output_of(accessibility, out_stride, 1);
    return ssao_sat__apply_to(ao, &to, input, stats);
}

SSAO_SAT_DEF sat_result ssao_sat_apply_half(ssao_sat *ao, uint16_t *accessibility, ptrdiff_t out_stride,
                                            const ssao_sat_input *input, ssao_sat_stats *stats)
{
    ssao_sat__output to = ssao_sat__output_of(accessibility, out_stride, 2);
    return ssao_sat__apply_to(ao, &to, input, stats);
}

SSAO_SAT_DEF sat_result ssao_sat_apply_signed(ssao_sat *ao, float *out, ptrdiff_t out_stride,
                                              const ssao_sat_input *input, ssao_sat_stats *stats)
{
    ssao_sat__output to = ssao_sat__output_of(out, out_stride, 4);
    to.is_signed = 1;
    return ssao_sat__apply_to(ao, &to, input, stats);
}

#ifndef SSAO_SAT_NO_BENT
SSAO_SAT_DEF sat_result ssao_sat_apply_bent(ssao_sat *ao, float *accessibility, ptrdiff_t out_stride,
                                            float *bent_normals, ptrdiff_t bent_stride, const ssao_sat_input *input,
                                            ssao_sat_stats *stats)
{
    ssao_sat__output to = ssao_sat__output_of(accessibility, out_stride, 4);
    if (!ao || !bent_normals || ao->options.method != SSAO_SAT_SLABS) return SAT_ERR_ARGUMENT;
    to.bent = bent_normals;
    to.bent_stride = bent_stride;
    return ssao_sat__apply_to(ao, &to, input, stats);
}
#endif

static int ssao_sat__size_is_valid(int width, int height)
{
    return width >= 1 && height >= 1 && width <= SSAO_SAT__MAX_SIDE && height <= SSAO_SAT__MAX_SIDE;
}

static int ssao_sat__options_are_valid(const ssao_sat_options *o)
{
    return !sat__fields_check(o, ssao_sat__fields, SSAO_SAT__FIELDS) && o->max_pixels >= o->min_pixels;
}

SSAO_SAT_DEF const char *ssao_sat_explain(char *text, size_t size, int width, int height,
                                          const ssao_sat_options *options)
{
    sat__text t = sat__text_begin(text, size);
    ssao_sat_options o = options ? *options : ssao_sat_defaults();
    const sat__field *field = sat__fields_check(&o, ssao_sat__fields, SSAO_SAT__FIELDS);
    if (width < 1 || width > SSAO_SAT__MAX_SIDE) sat__text_range(&t, "width", width, 1, SSAO_SAT__MAX_SIDE, ' ');
    else if (height < 1 || height > SSAO_SAT__MAX_SIDE)
        sat__text_range(&t, "height", height, 1, SSAO_SAT__MAX_SIDE, ' ');
    else if (field) sat__text_field(&t, field, &o);
    else if (o.max_pixels < o.min_pixels)
        sat__text_range(&t, "max_pixels (from min_pixels on)", o.max_pixels, o.min_pixels, 512, ' ');
    return t.size ? text : "";
}

/* NULL: depth, strides and normals are as they must be. Resolves strides of 0. */
static const char *ssao_sat__bad_buffer(ssao_sat_input *in)
{
    if (!in->depth == !in->half_depth) return "depth or half_depth, one of them, is needed";
    if (in->depth && !sat__rows_are_valid(in->depth, &in->depth_stride, in->width, in->height, 4, 4))
        return "depth: not aligned, or depth_stride is less than a row or no multiple of 4";
    if (in->half_depth &&
        !sat__rows_are_valid(in->half_depth, &in->depth_stride, in->width, in->height, 2, 2))
        return "half_depth: not aligned, or depth_stride is less than a row or odd";
    if (in->normals &&
        !sat__rows_are_valid(in->normals, &in->normal_stride, in->width, in->height, 12, 4))
        return "normals: not aligned, or normal_stride is less than a row or no multiple of 4";
    return NULL;
}

/* NULL: the view is one. */
static const char *ssao_sat__bad_view(const ssao_sat_input *in)
{
    ssao_sat__camera camera;
    ssao_sat_input linear = *in;
    linear.depth_kind = SSAO_SAT_DEPTH_LINEAR;
    if ((unsigned)in->depth_kind > (unsigned)SSAO_SAT_DEPTH_REVERSED) return "depth_kind is none of the three";
    if (!(in->sky >= 0)) return "sky is negative or NaN";
    if (!ssao_sat__read_camera(&camera, &linear, 1, 0))
        return "projection: neither a perspective ([11] < 0, left-handed > 0) nor an orthographic matrix ([15] > 0), or it has other entries that are not 0";
    if (!ssao_sat__read_camera(&camera, in, 1, 0)) return "projection maps depth the other way than depth_kind says, or not at all";
    return NULL;
}

SSAO_SAT_DEF const char *ssao_sat_explain_input(char *text, size_t size, const ssao_sat_input *input)
{
    sat__text t = sat__text_begin(text, size);
    const char *wrong = NULL;
    ssao_sat_input in;
    if (!input) wrong = "input is NULL";
    else {
        in = *input;
        if (in.width < 1 || in.height < 1) wrong = "width and height must be those of ssao_sat_create";
        else if ((wrong = ssao_sat__bad_buffer(&in)) == NULL) wrong = ssao_sat__bad_view(&in);
    }
    if (wrong) sat__text_add(&t, wrong);
    return t.size ? text : "";
}

/* The same calls measure (base NULL) and lay out the one block. */
static int ssao_sat__lay_out(ssao_sat *s, sat__arena *arena)
{
    size_t rows = (size_t)s->capacity, picture, words;
    int bent = 0, i;
#ifndef SSAO_SAT_NO_BENT
    bent = s->options.method == SSAO_SAT_SLABS;
#endif
    if (!sat__multiply_size(&picture, rows, s->stride) ||
        !sat__multiply_size(&s->table_plane, rows + 1, s->table_stride) ||
        !sat__multiply_size(&words, s->table_plane, (size_t)s->tables))
        return 0;
    s->work.z = (float *)sat__carve(arena, picture, 4);
    s->affine = (float *)sat__carve(arena, picture, 4);
    s->work.nx = (float *)sat__carve(arena, picture, 4);
    s->work.ny = (float *)sat__carve(arena, picture, 4);
    s->work.nz = (float *)sat__carve(arena, picture, 4);
    s->work.open = (float *)sat__carve(arena, picture, 4);
    for (i = 0; i < 3; i++) s->work.blocked[i] = (float *)sat__carve(arena, bent ? picture : 0, 4);
    s->lower = (float *)sat__carve(arena, s->tables > 1 && s->step == 2 ? picture : 0, 4);
    s->word_stride = ((size_t)s->columns * (size_t)s->step + 15) / 16 * 16;
    s->words = (uint32_t *)sat__carve(arena, s->tables > 1 ? rows * (size_t)s->step * s->word_stride : 0, 4);
    s->row_slabs = (uint32_t *)sat__carve(arena, rows, 4);
    s->blocks = ((size_t)s->columns + SSAO_SAT__BLOCK - 1) / SSAO_SAT__BLOCK;
    s->block_slabs = (uint32_t *)sat__carve(arena, s->tables > 1 ? rows * s->blocks : 0, 4);
    s->table = (uint32_t *)sat__carve(arena, words, 4);
    s->flags = (uint32_t *)sat__carve(arena, s->tables > 1 ? s->table_plane : 0, 4);
    s->scratch = (float *)sat__carve(arena, (size_t)sat__worker_count(&s->options.threads) * 8, s->stride * 4);
    s->workers =
        (ssao_sat__worker *)sat__carve(arena, (size_t)sat__worker_count(&s->options.threads), sizeof(ssao_sat__worker));
    return !arena->overflow;
}

/* The sizes of everything for s->options, into an arena that measures; 0 when they overflow. */
static int ssao_sat__measure(ssao_sat *s, sat__arena *arena, int width, int height)
{
    s->width = width;
    s->height = height;
    s->step = s->options.half_resolution ? 2 : 1;
    s->columns = (width + s->step - 1) / s->step;
    s->rows = (height + s->step - 1) / s->step;
    s->reserve = (int)s->options.max_pixels + 4 + SSAO_SAT__SPACING;
    s->capacity = s->options.band_rows ? sat__min_int(s->rows, s->options.band_rows + 2 * s->reserve) : s->rows;
    s->stride = ((size_t)s->columns + 15) / 16 * 16 + 3 * SSAO_SAT__PAD;
    s->table_stride = ((size_t)s->columns + 1 + 15) / 16 * 16;
    s->tables = s->options.method == SSAO_SAT_SLABS ? 4 * s->options.slabs : 1;
    memset(arena, 0, sizeof *arena);
    sat__carve(arena, 1, sizeof *s);
    return ssao_sat__lay_out(s, arena);
}

/* Lays the block out anew for `s`, the object itself at its start. */
static ssao_sat *ssao_sat__place(const ssao_sat *s)
{
    ssao_sat copy = *s, *made;
    sat__arena arena;
    memset(&arena, 0, sizeof arena);
    arena.base = sat__align64(s->block);
    made = (ssao_sat *)sat__carve(&arena, 1, sizeof copy);
    ssao_sat__lay_out(&copy, &arena);
    memset(arena.base, 0, s->bytes - 63); /* the padding must be sky; the rest costs one touch */
    *made = copy;
    return made;
}

SSAO_SAT_DEF sat_result ssao_sat_create(ssao_sat **out, int width, int height, const ssao_sat_options *options)
{
    ssao_sat s;
    sat_allocator allocator;
    sat__arena arena;
    sat_result result;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    memset(&s, 0, sizeof s);
    s.options = options ? *options : ssao_sat_defaults();
    if (!ssao_sat__size_is_valid(width, height) || !ssao_sat__options_are_valid(&s.options)) return SAT_ERR_ARGUMENT;
    if (!sat__resolve_allocator(&allocator, &s.options.allocator)) return SAT_ERR_ARGUMENT;
    s.options.allocator = allocator;
    if (!ssao_sat__measure(&s, &arena, width, height)) return SAT_ERR_SIZE;
    result = sat__arena_allocate(&arena, &s.block, &s.bytes, &allocator);
    if (result == SAT_OK) *out = ssao_sat__place(&s);
    return result;
}

SSAO_SAT_DEF sat_result ssao_sat_resize(ssao_sat *ao, int width, int height, const ssao_sat_options *options)
{
    ssao_sat s;
    sat__arena arena;
    if (!ao || !ssao_sat__size_is_valid(width, height)) return SAT_ERR_ARGUMENT;
    if (options && !ssao_sat__options_are_valid(options)) return SAT_ERR_ARGUMENT;
    s = *ao;
    if (options) s.options = *options;
    s.options.allocator = ao->options.allocator;
    if (!ssao_sat__measure(&s, &arena, width, height) || arena.used + 63 > ao->bytes) return SAT_ERR_SIZE;
    if (width == ao->width && height == ao->height && s.step == ao->step && s.capacity == ao->capacity &&
        s.tables == ao->tables && sat__worker_count(&s.options.threads) == sat__worker_count(&ao->options.threads)) {
        ao->options = s.options; /* the same layout */
        ao->reserve = s.reserve;
    } else ssao_sat__place(&s);
    return SAT_OK;
}

SSAO_SAT_DEF float ssao_sat_multi_bounce(float accessibility, float albedo)
{
    float v = accessibility, a = 2.0404f * albedo - 0.3324f, b = -4.7951f * albedo + 0.6417f,
          c = 2.7552f * albedo + 0.6903f, fit;
    fit = ((v * a + b) * v + c) * v;
    return fit > v ? fit < 1 ? fit : 1 : v;
}

SSAO_SAT_DEF float ssao_sat_specular(float accessibility, float cosine, float roughness)
{
    float open = acosf(
        sqrtf(accessibility > 0 ? accessibility < 1 ? 1 - accessibility : 0.0f : 1.0f)); /* half angles of the cones */
    float shine = acosf(exp2f(-3.32193f * roughness * roughness));
    float apart = acosf(cosine > -1 ? cosine < 1 ? cosine : 1.0f : -1.0f), inside = fabsf(open - shine), share;
    float lesser = open < shine ? open : shine, full = 1 - cosf(lesser), all = 1 - cosf(shine);
    if (!(all > 1e-7f)) return apart < open ? 1.0f : 0.0f; /* a mirror */
    if (apart >= open + shine) return 0;
    share = apart <= inside ? 1 : 1 - (apart - inside) / (open + shine - inside);
    return full / all * share * share * (3 - 2 * share);
}

SSAO_SAT_DEF float ssao_sat_edge(const float *position, const float *normal, const float *from,
                                 const float *from_normal)
{
    float off = 0, alike = 0, plane, z;
    int i;
    if (!position || !normal || !from || !from_normal) return 0;
    for (i = 0; i < 3; i++) {
        off += normal[i] * (from[i] - position[i]);
        alike += normal[i] * from_normal[i];
    }
    z = fabsf(position[2]);
    plane = 1 - fabsf(off) * SSAO_SAT__SHARPNESS / (z > 1 / SSAO_SAT__FAR ? z : 1 / SSAO_SAT__FAR);
    alike = alike > 0 ? alike * alike : 0;
    return (plane > 0 ? plane : 0) * alike * alike + SSAO_SAT__ELSEWHERE;
}

SSAO_SAT_DEF void ssao_sat_destroy(ssao_sat *ao)
{
    sat_allocator allocator;
    if (!ao) return;
    allocator = ao->options.allocator;
    sat__release(&allocator, ao->block, ao->bytes);
}

#ifdef __cplusplus
}
#endif
SAT__IEEE_END
#endif /* SSAO_SAT_IMPLEMENTATION */

/* ------------------------------------------------------------------------------------------------
   >> shaders: depth range, slab edges, table by recursive doubling (Slomp 2012, 4.4), estimate, upsample

   The tables of all slabs are tiles of one integer texture, so that one pass scans them all. Sums are those of the C
   code modulo 2^32, whatever the order; distances and edges are computed in the GPU's floats and may differ in the last
   bits. ------------------------------------------------------------------------------------------------ */

#if defined(SSAO_SAT_GL) && defined(SSAO_SAT_IMPLEMENTATION) && !defined(SSAO_SAT__GL_IMPLEMENTED)
#define SSAO_SAT__GL_IMPLEMENTED

SAT__IEEE_BEGIN
#ifdef __cplusplus
extern "C" {
#endif

/* A constant of C for the shaders: the macro's digits. */
#define SSAO_SAT__CONSTANT(name, value) SSAO_SAT__CONSTANT_LINE(#name, value)
#define SSAO_SAT__CONSTANT_LINE(name, value) "#define " name " " #value "\n"

static const char ssao_sat__gl_functions[] =
    "#ifndef SSAO_SAT_GLSL\n"
    "#define SSAO_SAT_GLSL\n"
    SSAO_SAT__CONSTANT(SSAO_SAT_FAR, SSAO_SAT__FAR)
    SSAO_SAT__CONSTANT(SSAO_SAT_LEAST_AFFINE, SSAO_SAT__LEAST_AFFINE)
    SSAO_SAT__CONSTANT(SSAO_SAT_SHARPNESS, SSAO_SAT__SHARPNESS)
    SSAO_SAT__CONSTANT(SSAO_SAT_ELSEWHERE, SSAO_SAT__ELSEWHERE)
    SAT__GLSL(
        float ssao_sat_distance(vec4 view[3], ivec2 pixel, float d) {
            float z = d;
            if (isnan(d) || isinf(d)) return 0.0;
            if (view[1].z > 0.5) {
                if (view[1].z < 1.5 ? d < 0.0 || d >= 1.0 : d <= 0.0 || d > 1.0) return 0.0;
                z = view[1].x * d + view[1].y + dot(view[2].yz, vec2(pixel));
                if (!(z > SSAO_SAT_LEAST_AFFINE)) return 0.0;
                if (view[1].w < 0.5) z = 1.0 / z;
            } else if (view[2].x > 0.0 && d >= view[2].x) return 0.0;
            return z > 1.0 / SSAO_SAT_FAR && z < SSAO_SAT_FAR ? z : 0.0;
        })
    SAT__GLSL(float ssao_sat_distance(vec4 view[3], float d) { return ssao_sat_distance(view, ivec2(0), d); })
    SAT__GLSL(
        vec3 ssao_sat_position(vec4 view[3], ivec2 pixel, float z) {
            return vec3((view[0].xz * (vec2(pixel) + 0.5) + view[0].yw) * (view[1].w > 0.5 ? 1.0 : z), z);
        })
    SAT__GLSL(
        /* part: where the picture lies in the texture: corner and size */
        vec3 ssao_sat_tangent(vec4 view[3], sampler2D depth, ivec4 part, ivec2 pixel, float z, ivec2 along) {
            vec3 p = ssao_sat_position(view, pixel, z), t = vec3(0.0);
            float nearest = 0.0;
            bool found = false;
            for (int side = -1; side <= 1; side += 2) {
                ivec2 q = pixel + side * along;
                if (any(lessThan(q, ivec2(0))) || any(greaterThanEqual(q, part.zw))) continue;
                float zq = ssao_sat_distance(view, q, texelFetch(depth, part.xy + q, 0).r);
                if (!(zq > 0.0)) continue;
                float off = abs(view[1].w > 0.5 ? zq - z : 1.0 / zq - 1.0 / z);
                if (found && off >= nearest) continue;
                found = true;
                nearest = off;
                t = (ssao_sat_position(view, q, zq) - p) * float(side);
            }
            return t;
        })
    SAT__GLSL(
        vec3 ssao_sat_depth_normal(vec4 view[3], sampler2D depth, ivec4 part, ivec2 pixel, float z) {
            vec3 u = ssao_sat_tangent(view, depth, part, pixel, z, ivec2(1, 0)),
                v = ssao_sat_tangent(view, depth, part, pixel, z, ivec2(0, 1));
            if (dot(u, u) * dot(v, v) <= 0.0) return vec3(0.0, 0.0, -1.0);
            vec3 n = cross(normalize(u), normalize(v));
            if (!(dot(n, n) > 1e-24)) return vec3(0.0, 0.0, -1.0);
            n = normalize(n);
            return (view[1].w > 0.5 ? n.z : dot(n, ssao_sat_position(view, pixel, z))) > 0.0 ? -n : n;
        })
    SAT__GLSL(
        float ssao_sat_edge(vec3 p, vec3 n, vec3 from, vec3 from_n) {
            float alike = max(dot(n, from_n), 0.0),
                plane = max(0.0, 1.0 - abs(dot(n, from - p)) * SSAO_SAT_SHARPNESS / p.z);
            return plane * alike * alike * alike * alike + SSAO_SAT_ELSEWHERE;
        })
    SAT__GLSL(
        vec3 ssao_sat_depth_normal(vec4 view[3], sampler2D depth, ivec2 pixel, float z) {
            return ssao_sat_depth_normal(view, depth, ivec4(ivec2(0), textureSize(depth, 0)), pixel, z);
        })
    "#endif\n";

SSAO_SAT_DEF const char *ssao_sat_gl_glsl(void) { return ssao_sat__gl_functions; }

/* What the passes share. `work` is a pixel of the tables; size their columns and rows. */
static const char ssao_sat__gl_common[] =
    SAT__GLSL(
        uniform sampler2D depth, normals, finer, edges;
        uniform vec4 view[3];
        uniform ivec2 size, picture, sat_from;
        float distance_at(ivec2 pixel) {
            return ssao_sat_distance(view, pixel, texelFetch(depth, sat_from + min(pixel, picture - 1), 0).r);
        })
    SAT__GLSL(vec3 normal_at(ivec2 pixel, float z) {)
    "#ifdef NORMALS\n"
    SAT__GLSL(
            vec3 n = texelFetch(normals, sat_from + pixel, 0).xyz * vec3(1.0, 1.0, view[2].w);
            float square = dot(n, n);
            if (!isnan(square) && !isinf(square) && square > LEAST_SQUARE) return n / sqrt(square);)
    "#endif\n"
    SAT__GLSL(
            return ssao_sat_depth_normal(view, depth, ivec4(sat_from, picture), pixel, z);
        })
    SAT__GLSL(
        /* the same in orthographic views */
        vec2 ray(vec2 work) { return view[0].xz * (work * float(STEP) + 0.5) + view[0].yw; })
    SAT__GLSL(float pixels() { return 1.0 / (abs(view[0].x) * float(STEP)); })
    SAT__GLSL(float aspect() { return abs(view[0].x / view[0].z); })
    SAT__GLSL(bool orthographic() { return view[1].w > 0.5; });

/* First nearest and farthest distance in 2 x 2 of the sample, then the range without the TRIM blocks at its ends, as in
   C. Where the sample meets nothing the range is that of nothing: 1 to 1. */
static const char ssao_sat__gl_range[] =
    SAT__GLSL(
        out vec4 result;
        void main() {)
    "#ifdef FIRST\n"
    SAT__GLSL(
            ivec2 block = ivec2(gl_FragCoord.xy);
            vec2 r = vec2(3e38, 0.0);
            for (int k = 0; k < 4; k++) {
                float z = distance_at(STEP * ((2 * (2 * block + ivec2(k % 2, k / 2)) + 1) * size / (2 * GRID)));
                if (z > 0.0) r = vec2(min(r.x, z), max(r.y, z));
            })
    "#else\n"
    SAT__GLSL(
            float least[2 * TRIM + 1], most[2 * TRIM + 1];
            int blocks = 0, trim;
            for (int i = 0; i <= 2 * TRIM; i++) least[i] = most[i] = 3e38;
            for (int k = 0; k < GRID * GRID / 4; k++) {
                vec2 v = texelFetch(finer, ivec2(k % (GRID / 2), k / (GRID / 2)), 0).xy;
                if (!(v.y > 0.0)) continue;
                blocks++;
                v.y = -v.y;
                for (int i = 0; i <= 2 * TRIM; i++) {
                    float a = least[i], b = most[i];
                    least[i] = min(a, v.x);
                    v.x = max(a, v.x);
                    most[i] = min(b, v.y);
                    v.y = max(b, v.y);
                }
            }
            trim = min(TRIM, blocks / 16);
            vec2 r = vec2(0.0);
            for (int i = trim; i <= 2 * trim; i++) r += vec2(least[i], -most[i]) / float(trim + 1);
            if (blocks == 0) r = vec2(1.0);
            r.y = max(r.x, r.y);)
    "#endif\n"
    SAT__GLSL(
            result = vec4(r, 0.0, 0.0);
        });

/* The bin of the depth range that each of the 32 x 32 samples falls into; -1: none. */
static const char ssao_sat__gl_bins[] =
    SAT__GLSL(
        out vec4 result;
        float scaled(float z) { return orthographic() ? z : log(z); })
    SAT__GLSL(
        void main() {
            vec2 range = texelFetch(finer, ivec2(0), 0).xy;
            float z = distance_at(STEP * ((2 * ivec2(gl_FragCoord.xy) + 1) * size / (2 * GRID))),
                low = scaled(range.x), width = scaled(range.y) - low, bin = 0.0;
            if (width > 0.0) bin = clamp(floor((scaled(z) - low) / width * float(BINS)), 0.0, float(BINS - 1));
            if (!(z >= (1.0 - RANGE_SLACK) * range.x && z <= (1.0 + RANGE_SLACK) * range.y)) bin = -1.0;
            result = vec4(bin);
        });

/* Texel b: the share of the sample in the first b bins. */
static const char ssao_sat__gl_shares[] =
    SAT__GLSL(
        out vec4 result;
        void main() {
            float below = 0.0, all = 0.0, b = floor(gl_FragCoord.x);
            for (int j = 0; j < GRID * GRID; j++) {
                float bin = texelFetch(finer, ivec2(j % GRID, j / GRID), 0).r;
                if (bin >= 0.0) all += 1.0;
                if (bin >= 0.0 && bin < b) below += 1.0;
            }
            result = vec4(all > 0.0 ? below / all : b / float(BINS));
        });

/* Texel k: edge k; low value, quantum and highest level of slab k. The last has the farthest distance and the number of
   slabs. As in C. */
static const char ssao_sat__gl_edges[] =
    SAT__GLSL(
        uniform sampler2D shares;
        uniform vec4 region; /* radius, reach, limit; parts of a side that a box of the table takes */
        out vec4 result;
        float filled(int bin) { return 0.5 * float(bin) / float(BINS) + 0.5 * texelFetch(shares, ivec2(bin, 0), 0).r; })
    SAT__GLSL(
        float cut(int k, int slabs, vec2 range) {
            vec2 ends = orthographic() ? range : log(range);
            float target = float(k) / float(slabs), z;
            int a = 0, b = BINS;
            if (k <= 0) return range.x;
            if (k >= slabs) return range.y;
            while (b - a > 1) { /* filled(a) < target <= filled(b) */
                int middle = (a + b) / 2;
                if (filled(middle) < target) a = middle; else b = middle;
            }
            z = mix(ends.x, ends.y, (float(a) + (target - filled(a)) / (filled(b) - filled(a))) / float(BINS));
            return clamp(orthographic() ? z : exp(z), range.x, range.y);
        })
    SAT__GLSL(
        void main() {
            vec2 range = texelFetch(finer, ivec2(0), 0).xy, ends = vec2(0.0);
            float thin = min(region.x, region.z / pixels() * (orthographic() ? 1.0 : range.x));
            int k = int(gl_FragCoord.x), slabs = METHOD == 0
                ? int(min(float(SLABS), floor((range.y - range.x) / thin) + 1.0)) : 1, bits = 31;
            float largest = max(min(region.y * pixels() / (orthographic() ? 1.0 : range.x / MARGIN), region.z), 2.0)
                * max(aspect(), 1.0);
            float side = 2.0 * largest / region.w + 2.0, first = cut(k, slabs, range),
                second = cut(k + 1, slabs, range);
            float spare = orthographic() ? min(range.y - range.x + MARGIN * region.x, LARGEST_RADIUS) : 0.0,
                low = first, high = second;
            if (METHOD == 0) side *= float(STEP);
            if (k == 0) low = orthographic() ? low - spare : low / MARGIN;
            if (k == slabs - 1) high += spare;
            while (bits > 1 && side * side * exp2(float(bits)) > 2147483648.0) bits--;
            bits = min(bits, LEVEL_BITS);
            if (METHOD == 0) ends = orthographic() ? vec2(low, high)
                : vec2(k == slabs - 1 ? 0.0 : 1.0 / high, 1.0 / low);
            else if (METHOD == 1) ends.y = orthographic() ? range.y - range.x + MARGIN * min(region.x, LARGEST_RADIUS)
                : MARGIN / range.x;
            else ends.y = INVERTED == 1 ? MARGIN / range.x : BEHIND * range.y;
            float top = exp2(float(bits)) - 1.0;
            result = vec4(first, ends.x, (ends.y - ends.x) / top, k == SLABS ? float(slabs) : top);
        });

/* One word or four for every pixel and slab. */
static const char ssao_sat__gl_words[] =
    SAT__GLSL(
        out uvec4 result;
        uint level(float v, vec4 edge) {
            return edge.z > 0.0 ? uint(clamp((v - edge.y) / edge.z + 0.5, 0.0, edge.w)) : 0u;
        })
    SAT__GLSL(
        void main() {
            ivec2 at = ivec2(gl_FragCoord.xy), tile = at / size, work = at - tile * size;
            vec4 first = texelFetch(edges, ivec2(0), 0);
            result = uvec4(0u);)
    "#if METHOD == 0\n"
    SAT__GLSL(
            int k = tile.y * TILES + tile.x, slabs = int(texelFetch(edges, ivec2(SLABS, 0), 0).w);
            if (k >= slabs) return;
            vec4 edge = texelFetch(edges, ivec2(k, 0), 0);
            float next = texelFetch(edges, ivec2(k + 1, 0), 0).x;
            for (int i = 0; i < STEP * STEP; i++) { /* all pixels of the picture */
                ivec2 pixel = STEP * work + ivec2(i % STEP, i / STEP);
                float z = all(lessThan(pixel, picture)) ? distance_at(pixel) : 0.0;
                if (z > 0.0 && (k == 0 || z >= edge.x) && (k == slabs - 1 || z < next))
                    result += uvec4(1u, level(orthographic() ? z : 1.0 / z, edge), uvec2(pixel));
            })
    "#else\n"
    SAT__GLSL(
            float z = distance_at(STEP * work);
            float nearest = first.x, farthest = texelFetch(edges, ivec2(SLABS, 0), 0).x, v;
            if (METHOD == 1) v = z > 0.0 ? (orthographic() ? farthest - z : 1.0 / z) : 0.0;
            else if (INVERTED == 1) v = z > 0.0 ? 1.0 / z : 0.0;
            else v = z > 0.0 ? z : BEHIND * farthest;
            result.x = level(v, first);)
    "#endif\n"
    SAT__GLSL(});

/* Four texels `reach` apart, within the tile. */
static const char ssao_sat__gl_scan[] =
    SAT__GLSL(
        uniform usampler2D table;
        uniform ivec2 reach;
        out uvec4 result;
        void main() {
            ivec2 at = ivec2(gl_FragCoord.xy), work = at - at / size * size;
            result = texelFetch(table, at, 0);
            for (int i = 1; i < 4; i++)
                if (all(greaterThanEqual(work, i * reach))) result += texelFetch(table, at - i * reach, 0);
        });

static const char ssao_sat__gl_tone[] =
    SAT__GLSL(
        uniform usampler2D table;
        uniform vec4 fit, region, tone; /* reach, range, bias, gain; radius, limit, min_pixels, pixels of a fixed
                                           region; power, power of the caller */
        out vec4 result;
        float open(float occlusion, float gain) {
            return pow(clamp(1.0 - gain * occlusion, 0.0, 1.0), tone.x * tone.y);
        })
    SAT__GLSL(
        float half_side(float z) {
            float r = region.w > 0.0 ? region.w / float(STEP) : fit.x * pixels() / (orthographic() ? 1.0 : z);
            return min(r, region.y);
        })
    SAT__GLSL(float fade(float side) { return region.w > 0.0 ? 1.0 : clamp(side / region.z - 1.0, 0.0, 1.0); });

static const char ssao_sat__gl_slabs[] =
    SAT__GLSL(
        uvec4 corner(ivec2 tile, int x, int y) {
            return x > 0 && y > 0 ? texelFetch(table, tile + ivec2(x - 1, y - 1), 0) : uvec4(0u);
        })
    SAT__GLSL(
        uniform vec4 kernel[13]; /* three a ring, then the factors by n.v: see ssao_sat__kernel; options.geometric */
        vec3 surface;
        /* of one slab in one cell, times its pixels; and the directions it blocks */
        vec4 occluder(uvec4 sums, vec4 edge, vec3 p, vec3 n, int ring) {
            vec4 s = vec4(ivec4(sums));
            if (s.x < 0.5) return vec4(0.0);
            float mean = (edge.y * s.x + edge.z * s.y) / s.x,
                z = orthographic() ? mean : 1.0 / max(mean, SSAO_SAT_LEAST_AFFINE);
            vec3 d = vec3((view[0].xz * (s.zw / s.x + 0.5) + view[0].yw) * (orthographic() ? 1.0 : z), z) - p;
            float square = dot(d, d), height = min(dot(d, n), dot(d, surface)), share = 1.0 - square / (fit.y * fit.y);
            if (height <= 0.0 || share <= 0.0) return vec4(0.0);
            float away = sqrt(max(square, p.z * p.z * 1e-12 + 1e-37)), sine = max(height / away - fit.z, 0.0),
                r = min(away / region.x, 2.0);
            vec4 powers = vec4(1.0, r, r * r, r * r * r);
            vec3 k = vec3(dot(kernel[3 * ring], powers), dot(kernel[3 * ring + 1], powers),
                dot(kernel[3 * ring + 2], powers));
            return vec4(1.0, d / away) * (sine * (k.x + sine * (k.y + sine * k.z)) * share * s.x);
        })
    /* What a pixel weighs in each third of an axis: see ssao_sat__cut_axis. */
    SAT__GLSL(
        vec3 cut(ivec4 border, int outer, int inner, bool whole, int pixels) {
            vec3 share = vec3(1.0), count = vec3(min(STEP * border.yzw, ivec3(pixels)) - STEP * border.xyz);
            float a = float(border.y - border.x) / float(outer - inner),
                b = float(border.w - border.z) / float(outer - inner);
            if (!whole) share = vec3(a, 1.0 + BEYOND * (2.0 - a - b), b);
            return vec3(count.x > 0.0 ? share.x / count.x : 0.0, count.y > 0.0 ? share.y / count.y : 0.0,
                count.z > 0.0 ? share.z / count.z : 0.0);
        })
    SAT__GLSL(
        /* x[t] = borders along both axes; weights of the thirds */
        vec4 slab(int k, ivec2 x[4], vec3 u, vec3 v, vec3 p, vec3 n, int ring) {
            ivec2 tile = ivec2(k % TILES, k / TILES) * size;
            vec4 edge = texelFetch(edges, ivec2(k, 0), 0);
            uvec4 row[4];
            vec4 sum = vec4(0.0);
            if (corner(tile, x[3].x, x[3].y).x - corner(tile, x[0].x, x[3].y).x == corner(tile, x[3].x, x[0].y).x
                - corner(tile, x[0].x, x[0].y).x) return vec4(0.0);
            for (int t = 0; t < 4; t++) row[t] = corner(tile, x[t].x, x[0].y);
            for (int j = 0; j < 3; j++) {
                uvec4 last = uvec4(0u);
                for (int t = 0; t < 4; t++) {
                    uvec4 below = corner(tile, x[t].x, x[j + 1].y), band = below - row[t];
                    row[t] = below;
                    if (t > 0 && !(t == 2 && j == 1)) sum += occluder(band - last, edge, p, n, ring) * u[t - 1] * v[j];
                    last = band;
                }
            }
            return sum;
        })
    SAT__GLSL(
        void main() {
            ivec2 work = ivec2(gl_FragCoord.xy), x[4];
            float z = distance_at(STEP * work), side = half_side(z), strength = fade(side), r = side;
            vec4 sum = vec4(0.0);
            result = vec4(1.0, 0.0, 0.0, 0.0);
            if (!(z > 0.0) || !(strength > 0.0)) return;
            vec3 n = normal_at(STEP * work, z), p = vec3(ray(vec2(work)) * (orthographic() ? 1.0 : z), z);
            surface = n;
            if (kernel[12].z > 0.0)
                surface = ssao_sat_depth_normal(view, depth, ivec4(sat_from, picture), STEP * work, z);
            int slabs = int(texelFetch(edges, ivec2(SLABS, 0), 0).w);
            for (int ring = 0; ring < RINGS; ring++, r /= 3.0) {
                ivec2 inner = max(ivec2(vec2(r, r * aspect()) / 3.0 + 0.5), 1),
                    outer = max(ivec2(vec2(r, r * aspect()) + 0.5), inner + 1);
                x[0] = max(work - outer, 0);
                x[1] = max(work - inner, 0);
                x[2] = min(work + inner + 1, size);
                x[3] = min(work + outer + 1, size);
                vec3 u = cut(ivec4(x[0].x, x[1].x, x[2].x, x[3].x), outer.x, inner.x,
                    x[0].x == work.x - outer.x && x[3].x == work.x + outer.x + 1, picture.x);
                vec3 v = cut(ivec4(x[0].y, x[1].y, x[2].y, x[3].y), outer.y, inner.y,
                    x[0].y == work.y - outer.y && x[3].y == work.y + outer.y + 1, picture.y);
                for (int k = 0; k < slabs; k++) {
                    float low = texelFetch(edges, ivec2(k, 0), 0).x, high = texelFetch(edges, ivec2(k + 1, 0), 0).x;
                    if ((k < slabs - 1 && high < z - fit.y) || (k > 0 && low > z + fit.y)) continue;
                    sum += slab(k, x, u, v, p, n, ring);
                }
            }
            float cosine = clamp(-dot(n, orthographic() ? vec3(0.0, 0.0, 1.0) : normalize(p)), 0.0, 1.0);
            strength *= cosine < 0.5 ? mix(1.0, kernel[12].x, 1.0 - 2.0 * cosine)
                : mix(1.0, kernel[12].y, 2.0 * cosine - 1.0);
            result = vec4(open(sum.x, strength * fit.w), strength * fit.w * BLOCKED * sum.yzw);
        });

static const char ssao_sat__gl_single[] =
    SAT__GLSL(
        uniform vec4 published; /* offset, refine threshold, depth gain, - */
        ivec4 box; /* low and high corner of the region */
        uint corner(ivec2 at) { return at.x > 0 && at.y > 0 ? texelFetch(table, at - 1, 0).x : 0u; })
    SAT__GLSL(
        float mean(ivec4 b, vec4 edge) {
            uint sum = corner(b.zw) - corner(b.xw) - corner(b.zy) + corner(b.xy);
            return edge.y + edge.z * float(sum) / float((b.z - b.x) * (b.w - b.y));
        })
    SAT__GLSL(float deficit(float m, float z) { return INVERTED == 1 ? (m * z - 1.0) * z : z - m; });

/* Eq 5.4 over four children. GLSL has no recursion: the text is there once for each level, under two names. */
static const char ssao_sat__gl_refine_last[] = "#define NAME refine_last\n#define CHILD\n#define LEVEL 1\n";
static const char ssao_sat__gl_refine_all[] =
    "#undef NAME\n#undef CHILD\n#undef LEVEL\n#define NAME refine_all\n#define LEVEL 0\n"
    "#define CHILD child = refine_last(c, z, edge);\n";
static const char ssao_sat__gl_refine[] =
    SAT__GLSL(
        float NAME(ivec4 b, float z, vec4 edge) {
            float parent_mean = mean(b, edge), parent = deficit(parent_mean, z), sum = 0.0, weight = 0.0;
            ivec2 x[3];
            x[0] = b.xy; x[1] = (b.xy + b.zw) / 2; x[2] = b.zw;
            if (LEVEL >= LEVELS || abs(parent) >= published.y * z || any(lessThan(b.zw - b.xy, ivec2(2))))
                return parent;
            for (int i = 0; i < 4; i++) {
                int u = i % 2, v = i / 2;
                ivec4 c = ivec4(x[u].x, x[v].y, x[u + 1].x, x[v + 1].y);
                float m = mean(c, edge), child = deficit(m, z), area = float((c.z - c.x) * (c.w - c.y));
                if (!(PRINTED == 1 ? m > parent_mean : child > parent)) continue;
                CHILD
                sum += area * child;
                weight += area;
            }
            return weight > 0.0 ? sum / weight : parent;
        });

static const char ssao_sat__gl_single_main[] =
    SAT__GLSL(
        float over_plane(vec3 n, vec2 at, float z, vec2 r, vec4 edge, float farthest) {
            vec2 g;
            float own, height, sum = 0.0;
            ivec2 x[3];
            if (orthographic()) {
                float facing = min(n.z, -GRAZING);
                g = n.xy / facing * view[0].xz * float(STEP);
                own = farthest - z;
                height = -facing / region.x;
            } else {
                float facing = min(dot(n.xy, r) + n.z, -GRAZING);
                g = n.xy * view[0].xz * float(STEP) / (facing * z);
                own = 1.0 / z;
                height = -facing * z * z / region.x;
            }
            x[0] = box.xy; x[1] = BOXES == 2 ? (box.xy + box.zw) / 2 : box.zw; x[2] = box.zw;
            for (int j = 0; j < BOXES; j++)
                for (int i = 0; i < BOXES; i++) {
                    ivec4 c = ivec4(x[i].x, x[j].y, x[i + 1].x, x[j + 1].y);
                    if (c.z <= c.x || c.w <= c.y) continue;
                    float spread = 0.5 * dot(abs(g), vec2(c.zw - c.xy)),
                        centre = own + dot(g, 0.5 * vec2(c.xy + c.zw) - at);
                    /* see ssao_sat__plane_mean */
                    if (centre < spread) centre = centre > -spread
                        ? (centre + spread) * (centre + spread) / (4.0 * spread) : 0.0;
                    float h = (mean(c, edge) - centre) * height;
                    if (h > 0.0) sum += h / (1.0 + fit.y * h * h);
                }
            return sum / float(BOXES * BOXES);
        })
    SAT__GLSL(
        void main() {
            ivec2 work = ivec2(gl_FragCoord.xy);
            float z = distance_at(STEP * work), side = half_side(z), strength = fade(side), gain = 1.0, occlusion;
            vec4 edge = texelFetch(edges, ivec2(0), 0);
            float farthest = texelFetch(edges, ivec2(SLABS, 0), 0).x;
            vec2 c = vec2(work) + 0.5, half_box = vec2(side, side * aspect()),
                r = orthographic() ? vec2(0.0) : ray(vec2(work));
            result = vec4(1.0);
            if (!(z > 0.0) || !(strength > 0.0)) return;
            vec3 n = normal_at(STEP * work, z);
            vec2 shift = METHOD == 2 ? vec2(0.0) : n.xy - (METHOD == 1 || PRINTED == 1 ? vec2(0.0) : n.z * r);
            if (METHOD != 1) shift *= published.x / max(length(shift), 1.0);
            c += shift * sign(view[0].xz) * half_box;
            box.xy = clamp(ivec2(floor(c - half_box + 0.5)), ivec2(0), size - 1);
            box.zw = clamp(ivec2(floor(c + half_box + 0.5)), box.xy + 1, size);
            if (METHOD == 1) occlusion = over_plane(n, vec2(work) + 0.5, z, r, edge, farthest);
            else {
                occlusion = METHOD == 4 ? refine_all(box, z, edge) : deficit(mean(box, edge), z);
                if (farthest > edge.x) gain += published.z * (z - edge.x) / (farthest - edge.x);
                occlusion = max(occlusion, 0.0) * gain / region.x;
            }
            result.r = open(occlusion, strength * fit.w);
        });

/* Depth unsharp masking: mean depth of the region less the own depth, as in C. */
static const char ssao_sat__gl_signed_slabs[] =
    SAT__GLSL(
        uvec4 corner(ivec2 tile, ivec2 at) {
            return at.x > 0 && at.y > 0 ? texelFetch(table, tile + at - 1, 0) : uvec4(0u);
        })
    SAT__GLSL(
        float mean_depth(ivec4 b) {
            int slabs = int(texelFetch(edges, ivec2(SLABS, 0), 0).w);
            float sum = 0.0, count = 0.0;
            for (int k = 0; k < slabs; k++) {
                ivec2 tile = ivec2(k % TILES, k / TILES) * size;
                vec4 edge = texelFetch(edges, ivec2(k, 0), 0);
                uvec4 s = corner(tile, b.zw) - corner(tile, b.xw) - corner(tile, b.zy) + corner(tile, b.xy);
                sum += edge.y * float(s.x) + edge.z * float(s.y);
                count += float(s.x);
            }
            sum /= max(count, 1.0);
            return orthographic() ? sum : 1.0 / sum;
        });

static const char ssao_sat__gl_signed_single[] =
    SAT__GLSL(
        float mean_depth(ivec4 b) {
            float m = mean(b, texelFetch(edges, ivec2(0), 0));
            if (METHOD == 1 ? !orthographic() : INVERTED == 1) return 1.0 / m;
            return METHOD == 1 ? texelFetch(edges, ivec2(SLABS, 0), 0).x - m : m;
        });

static const char ssao_sat__gl_signed_main[] =
    SAT__GLSL(
        void main() {
            ivec2 work = ivec2(gl_FragCoord.xy), low, high;
            float z = distance_at(STEP * work), side = half_side(z), strength = fade(side);
            vec2 c = vec2(work) + 0.5, half_box = vec2(side, side * aspect());
            result = vec4(0.0);
            if (!(z > 0.0) || !(strength > 0.0)) return;
            low = clamp(ivec2(floor(c - half_box + 0.5)), ivec2(0), size - 1);
            high = clamp(ivec2(floor(c + half_box + 0.5)), low + 1, size);
            result.r = clamp(strength * fit.w * (mean_depth(ivec4(low, high)) - z) / region.x, -1.0, 1.0);
        });

/* To the picture: the 3 x 3 table pixels around, by distance to the tangent plane and angle between normals. BLANK is
   what sky gets. */
static const char ssao_sat__gl_upsample[] =
    SAT__GLSL(
        uniform sampler2D coarse;
        out vec4 result;
        void main() {
            ivec2 at = sat_pixel();
            float z = distance_at(at), total = 0.0;
            vec4 sum = vec4(0.0);
            result = vec4(BLANK);)
    "#ifdef BENT\n"
    SAT__GLSL(result.xyz = vec3(0.0, 0.0, -view[2].w);)
    "#endif\n"
    SAT__GLSL(if (!(z > 0.0)) return;)
    "#if STEP == 1\n"
    SAT__GLSL(
            sum = texelFetch(coarse, at, 0);
            total = 1.0;)
    "#else\n"
    SAT__GLSL(
            vec3 n = normal_at(at, z), p = ssao_sat_position(view, at, z);
            for (int j = -1; j <= 1; j++)
                for (int i = -1; i <= 1; i++) {
                    ivec2 t = at / 2 + ivec2(i, j), off = 2 * t - at;
                    if (any(lessThan(t, ivec2(0))) || any(greaterThanEqual(t, size))) continue;
                    float zt = distance_at(2 * t);
                    if (!(zt > 0.0)) continue;
                    float weight = ssao_sat_edge(p, n, ssao_sat_position(view, 2 * t, zt), normal_at(2 * t, zt))
                        / float((1 + off.x * off.x) * (1 + off.y * off.y));
                    total += weight;
                    sum += weight * texelFetch(coarse, t, 0);
                })
    "#endif\n"
    SAT__GLSL(sum = total > 0.0 ? sum / total : vec4(BLANK, 0.0, 0.0, 0.0);)
    "#ifdef BENT\n"
    SAT__GLSL(
            vec3 up = normal_at(at, z), bent = OPEN_LENGTH * up - sum.yzw;
            if (length(bent) > NO_DIRECTION) up = normalize(bent);
            result = vec4(up * vec3(1.0, 1.0, view[2].w), sum.x);)
    "#else\n"
    SAT__GLSL(result.r = sum.x;)
    "#endif\n"
    SAT__GLSL(});

/* ------------------------------------------------------------------------------------------------
   >> passes: programs, textures, frames
   ------------------------------------------------------------------------------------------------ */

typedef enum ssao_sat__gl_output { SSAO_SAT__GL_OPEN, SSAO_SAT__GL_BENT, SSAO_SAT__GL_SIGNED } ssao_sat__gl_output;

/* What is made for some options only. */
enum { SSAO_SAT__IF_SLABS = 1, SSAO_SAT__IF_SINGLE = 2, SSAO_SAT__IF_BENT = 4, SSAO_SAT__IF_SIGNED = 8 };

/* The programs, in the order of the table. Those from SSAO_SAT__GL_ESTIMATE on read normals, and are there without and
   with them. */
enum {
    SSAO_SAT__GL_SAMPLE, SSAO_SAT__GL_RANGE, SSAO_SAT__GL_BINS, SSAO_SAT__GL_SHARES, SSAO_SAT__GL_EDGES,
    SSAO_SAT__GL_WORDS, SSAO_SAT__GL_SCAN, SSAO_SAT__GL_DIFFERENCE, SSAO_SAT__GL_DIFFERENCE_SINGLE,
    SSAO_SAT__GL_ESTIMATE, SSAO_SAT__GL_ESTIMATE_SINGLE,
    SSAO_SAT__GL_UPSAMPLE, /* as ssao_sat__gl_output counts */
    SSAO_SAT__GL_PROGRAMS = SSAO_SAT__GL_UPSAMPLE + 3
};

static const sat__gl_program ssao_sat__programs[SSAO_SAT__GL_PROGRAMS] = {
    {"ssao_sat: sample", 0, "depth", "#define FIRST\n", NULL, {ssao_sat__gl_range}},
    {"ssao_sat: range", 0, "finer", NULL, NULL, {ssao_sat__gl_range}},
    {"ssao_sat: bins", SSAO_SAT__IF_SLABS, "depth finer", NULL, NULL, {ssao_sat__gl_bins}},
    {"ssao_sat: shares", SSAO_SAT__IF_SLABS, "finer", NULL, NULL, {ssao_sat__gl_shares}},
    {"ssao_sat: edges", 0, "finer shares", NULL, NULL, {ssao_sat__gl_edges}},
    {"ssao_sat: words", 0, "depth edges", NULL, NULL, {ssao_sat__gl_words}},
    {"ssao_sat: sums", 0, "table", NULL, NULL, {ssao_sat__gl_scan}},
    {"ssao_sat: signed", SSAO_SAT__IF_SIGNED | SSAO_SAT__IF_SLABS, "depth table edges", NULL, NULL,
     {ssao_sat__gl_tone, ssao_sat__gl_signed_slabs, ssao_sat__gl_signed_main}},
    {"ssao_sat: signed", SSAO_SAT__IF_SIGNED | SSAO_SAT__IF_SINGLE, "depth table edges", NULL, NULL,
     {ssao_sat__gl_tone, ssao_sat__gl_single, ssao_sat__gl_signed_single, ssao_sat__gl_signed_main}},
    {"ssao_sat: estimate", SSAO_SAT__IF_SLABS, "depth table edges normals", NULL, NULL,
     {ssao_sat__gl_tone, ssao_sat__gl_slabs}},
    {"ssao_sat: estimate", SSAO_SAT__IF_SINGLE, "depth table edges normals", NULL, NULL,
     {ssao_sat__gl_tone, ssao_sat__gl_single, ssao_sat__gl_refine_last, ssao_sat__gl_refine, ssao_sat__gl_refine_all,
      ssao_sat__gl_refine, ssao_sat__gl_single_main}},
    {"ssao_sat: picture", 0, "depth coarse normals", "#define BLANK 1.0\n", NULL,
     {SAT__GL_PIXEL, ssao_sat__gl_upsample}},
    {"ssao_sat: picture with bent normals", SSAO_SAT__IF_BENT, "depth coarse normals",
     "#define BLANK 1.0\n#define BENT\n", NULL, {SAT__GL_PIXEL, ssao_sat__gl_upsample}},
    {"ssao_sat: signed picture", SSAO_SAT__IF_SIGNED, "depth coarse normals", "#define BLANK 0.0\n", NULL,
     {SAT__GL_PIXEL, ssao_sat__gl_upsample}}};

/* What they draw into. */
enum {
    SSAO_SAT__T_SAMPLE, SSAO_SAT__T_RANGE, SSAO_SAT__T_BINS, SSAO_SAT__T_SHARES, SSAO_SAT__T_EDGES, SSAO_SAT__T_TABLE,
    SSAO_SAT__T_TABLE_1, SSAO_SAT__T_OPEN, SSAO_SAT__T_OUT, SSAO_SAT__T_BENT, SSAO_SAT__TARGETS, SSAO_SAT__GL_UNITS = 4
};

struct ssao_sat_gl {
    sat__gl gl;
    ssao_sat_options options;
    int width, height, step, tiles, given, is_built; /* as created */
    struct { int width, height, columns, rows; } now; /* of this frame: not larger; all lies in the textures' corners */
    int from[2]; /* where the picture lies in the inputs of this call */
    unsigned program[2][SSAO_SAT__GL_PROGRAMS]; /* without and with normals; [1] from SSAO_SAT__GL_ESTIMATE on */
    sat__gl_target target[SSAO_SAT__TARGETS];   /* of the tables [0] holds the sums */
    ssao_sat__gl_output output; /* of this frame */
    ssao_sat__camera camera;
    ssao_sat__fit fit;
    float view[12], limit;
};

static void ssao_sat__gl_pack_view(float *view, const ssao_sat__camera *c, const ssao_sat_input *in)
{
    int i;
    for (i = 0; i < 4; i++) view[i] = (float)c->full[i];
    view[4] = (float)c->depth_a;
    view[5] = (float)c->depth_b;
    view[6] = (float)(int)in->depth_kind;
    view[7] = (float)c->orthographic;
    view[8] = in->sky;
    view[9] = (float)c->tilt[0];
    view[10] = (float)c->tilt[1];
    view[11] = c->forward;
}

SSAO_SAT_DEF sat_result ssao_sat_gl_view(float *view, const ssao_sat_input *input, int bottom_up)
{
    ssao_sat__camera camera;
    if (!view || !input || input->width < 1 || input->height < 1 ||
        (unsigned)input->depth_kind > (unsigned)SSAO_SAT_DEPTH_REVERSED ||
        !ssao_sat__read_camera(&camera, input, 1, bottom_up))
        return SAT_ERR_ARGUMENT;
    ssao_sat__gl_pack_view(view, &camera, input);
    return SAT_OK;
}

static void ssao_sat__gl_define(ssao_sat_gl *g)
{
    const ssao_sat_options *o = &g->options;
    sat__gl *gl = &g->gl;
    sat__gl_define(gl, "METHOD", (int)o->method);
    sat__gl_define(gl, "STEP", g->step);
    sat__gl_define(gl, "SLABS", o->slabs);
    sat__gl_define(gl, "RINGS", o->scales);
    sat__gl_define(gl, "TILES", g->tiles);
    sat__gl_define(gl, "INVERTED", o->inverted_depth != 0);
    sat__gl_define(gl, "PRINTED", o->as_printed != 0);
    sat__gl_define(gl, "LEVELS", o->refine_levels);
    sat__gl_define(gl, "BOXES", o->plane_boxes);
    sat__gl_define(gl, "GRID", SSAO_SAT__GRID);
    sat__gl_define(gl, "BINS", SSAO_SAT__BINS);
    sat__gl_define(gl, "TRIM", SSAO_SAT__TRIM);
    sat__gl_define(gl, "LEVEL_BITS", SSAO_SAT__LEVEL_BITS);
    sat__gl_define_float(gl, "BEYOND", SSAO_SAT__BEYOND);
    sat__gl_define_float(gl, "MARGIN", SSAO_SAT__MARGIN);
    sat__gl_define_float(gl, "BLOCKED", SSAO_SAT__BLOCKED);
    sat__gl_define_float(gl, "BEHIND", SSAO_SAT__BEHIND);
    sat__gl_define_float(gl, "GRAZING", SSAO_SAT__GRAZING);
    sat__gl_define_float(gl, "RANGE_SLACK", SSAO_SAT__RANGE_SLACK);
    sat__gl_define_float(gl, "LEAST_SQUARE", SSAO_SAT__LEAST_SQUARE);
    sat__gl_define_float(gl, "LARGEST_RADIUS", SSAO_SAT__LARGEST_RADIUS);
    sat__gl_define_float(gl, "OPEN_LENGTH", SSAO_SAT__OPEN_LENGTH);
    sat__gl_define_float(gl, "NO_DIRECTION", SSAO_SAT__NO_DIRECTION);
}

/* All without normals, then those that read them once more. */
static sat_result ssao_sat__gl_make_programs(ssao_sat_gl *g)
{
    const char *const library[3] = {ssao_sat__gl_functions, ssao_sat__gl_common, NULL};
    const int first = SSAO_SAT__GL_ESTIMATE;
    sat_result result;
    ssao_sat__gl_define(g);
    result = sat__gl_build_table(&g->gl, g->program[0], ssao_sat__programs, SSAO_SAT__GL_PROGRAMS, g->given, library);
    if (result != SAT_OK) return result;
    ssao_sat__gl_define(g);
    sat__gl_define_text(&g->gl, "NORMALS", "");
    return sat__gl_build_table(&g->gl, g->program[1] + first, ssao_sat__programs + first, SSAO_SAT__GL_PROGRAMS - first,
                               g->given, library);
}

static sat_result ssao_sat__gl_make_targets(ssao_sat_gl *g)
{
    const int slabs = g->given & SSAO_SAT__IF_SLABS, bent = g->given & SSAO_SAT__IF_BENT;
    const int columns = g->now.columns, rows = g->now.rows, width = columns * g->tiles,
              height = rows * (slabs ? (g->options.slabs + g->tiles - 1) / g->tiles : 1);
    const struct { unsigned internal; int width, height; } list[SSAO_SAT__TARGETS] = {
        {SAT__GL_RG32F, SSAO_SAT__GRID / 2, SSAO_SAT__GRID / 2},
        {SAT__GL_RG32F, 1, 1},
        {SAT__GL_R32F, SSAO_SAT__GRID, slabs ? SSAO_SAT__GRID : 0},
        {SAT__GL_R32F, SSAO_SAT__BINS + 1, slabs ? 1 : 0},
        {SAT__GL_RGBA32F, g->options.slabs + 1, 1},
        {slabs ? SAT__GL_RGBA32UI : SAT__GL_R32UI, width, height},
        {slabs ? SAT__GL_RGBA32UI : SAT__GL_R32UI, width, height},
        {bent ? SAT__GL_RGBA16F : SAT__GL_R32F, columns, rows},
        {SAT__GL_R32F, g->now.width, g->now.height},
        {SAT__GL_RGBA16F, g->now.width, bent ? g->now.height : 0}};
    sat_result result = SAT_OK;
    int i;
    for (i = 0; i < SSAO_SAT__TARGETS && result == SAT_OK; i++)
        if (!list[i].height) continue;
        else if (!g->target[i].texture)
            result = sat__gl_make_target(&g->gl, &g->target[i], list[i].internal, list[i].width, list[i].height);
        else {
            g->target[i].width = list[i].width;
            g->target[i].height = list[i].height;
        }
    return result;
}

/* What passes draw into of the textures, for a picture of this size; the first time they are made. */
static sat_result ssao_sat__gl_set_size(ssao_sat_gl *g, int width, int height)
{
    if (width == g->now.width && height == g->now.height) return SAT_OK;
    g->now.width = width;
    g->now.height = height;
    g->now.columns = (width + g->step - 1) / g->step;
    g->now.rows = (height + g->step - 1) / g->step;
    return ssao_sat__gl_make_targets(g);
}

SSAO_SAT_DEF sat_result ssao_sat_gl_create(ssao_sat_gl **out, sat_gl_get_proc *get_proc, int width, int height,
                                           const ssao_sat_options *options)
{
    ssao_sat_options o = options ? *options : ssao_sat_defaults();
    sat_allocator allocator;
    sat__gl_state state;
    ssao_sat_gl *g;
    sat_result result;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    if (!ssao_sat__size_is_valid(width, height) || !ssao_sat__options_are_valid(&o)) return SAT_ERR_ARGUMENT;
    if (!sat__resolve_allocator(&allocator, &o.allocator)) return SAT_ERR_ARGUMENT;
    g = (ssao_sat_gl *)sat__alloc(&allocator, sizeof *g);
    if (!g) return SAT_ERR_MEMORY;
    memset(g, 0, sizeof *g);
    *out = g;
    g->options = o;
    g->options.allocator = allocator;
    g->width = width;
    g->height = height;
    g->step = o.half_resolution ? 2 : 1;
    g->tiles = o.method != SSAO_SAT_SLABS ? 1 : o.slabs > 4 ? 4 : o.slabs > 1 ? 2 : 1;
    g->given = (o.method == SSAO_SAT_SLABS ? SSAO_SAT__IF_SLABS : SSAO_SAT__IF_SINGLE) |
               (o.gl_signed ? SSAO_SAT__IF_SIGNED : 0);
#ifndef SSAO_SAT_NO_BENT
    if (o.gl_bent && o.method == SSAO_SAT_SLABS) g->given |= SSAO_SAT__IF_BENT;
#endif
    result = sat__gl_open(&g->gl, get_proc);
    if (result != SAT_OK) return result;
    sat__gl_begin(&g->gl, &state, SSAO_SAT__GL_UNITS);
    result = ssao_sat__gl_set_size(g, width, height);
    if (result == SAT_OK) result = ssao_sat__gl_make_programs(g);
    sat__gl_end(&g->gl, &state);
    g->is_built = result == SAT_OK;
    return result;
}

SSAO_SAT_DEF sat_result ssao_sat_gl_set_options(ssao_sat_gl *gl, const ssao_sat_options *options)
{
    ssao_sat_options o = options ? *options : ssao_sat_defaults();
    if (!gl || !gl->is_built || !ssao_sat__options_are_valid(&o)) return SAT_ERR_ARGUMENT;
    if (o.method != gl->options.method || o.half_resolution != gl->options.half_resolution ||
        o.slabs != gl->options.slabs || o.scales != gl->options.scales || o.plane_boxes != gl->options.plane_boxes ||
        o.refine_levels != gl->options.refine_levels || o.as_printed != gl->options.as_printed ||
        o.inverted_depth != gl->options.inverted_depth || o.gl_bent != gl->options.gl_bent ||
        o.gl_signed != gl->options.gl_signed)
        return SAT_ERR_MISMATCH;
    o.allocator = gl->options.allocator;
    gl->options = o;
    return SAT_OK;
}

SSAO_SAT_DEF const char *ssao_sat_gl_message(const ssao_sat_gl *gl) { return gl ? gl->gl.message : ""; }
SSAO_SAT_DEF unsigned ssao_sat_gl_texture(const ssao_sat_gl *gl)
{
    return gl ? gl->target[SSAO_SAT__T_OUT].texture : 0;
}


SSAO_SAT_DEF void ssao_sat_gl_destroy(ssao_sat_gl *gl)
{
    sat_allocator allocator;
    int i;
    if (!gl) return;
    if (gl->gl.vertex_array) {
        sat__gl_delete_programs(&gl->gl, gl->program[0], 2 * SSAO_SAT__GL_PROGRAMS);
        for (i = 0; i < SSAO_SAT__TARGETS; i++) sat__gl_free_target(&gl->gl, &gl->target[i]);
        sat__gl_close(&gl->gl);
    }
    allocator = gl->options.allocator;
    sat__release(&allocator, gl, sizeof *gl);
}

/* The uniforms that all programs share; of one that was started. */
static void ssao_sat__gl_set_frame(ssao_sat_gl *g, unsigned program)
{
    g->gl.Uniform4fv(g->gl.GetUniformLocation(program, "view"), 3, g->view);
    sat__gl_set_int2(&g->gl, program, "size", g->now.columns, g->now.rows);
    sat__gl_set_int2(&g->gl, program, "picture", g->now.width, g->now.height);
    sat__gl_set_int2(&g->gl, program, "sat_from", g->from[0], g->from[1]);
}

/* A pass without uniforms of its own. */
#define SSAO_SAT__GL_PASS(g, index, to, ...)                                                                           \
    do {                                                                                                               \
        SAT__GL_START(&(g)->gl, (g)->program[0][index], to, __VA_ARGS__);                                              \
        ssao_sat__gl_set_frame(g, (g)->program[0][index]);                                                             \
        sat__gl_draw(&(g)->gl);                                                                                        \
    } while (0)

/* Depth range, then the edges of the slabs. */
static void ssao_sat__gl_find_edges(ssao_sat_gl *g, unsigned depth)
{
    const ssao_sat_options *o = &g->options;
    const sat__gl_target *t = g->target;
    unsigned program = g->program[0][SSAO_SAT__GL_EDGES];
    float region[4];
    SSAO_SAT__GL_PASS(g, SSAO_SAT__GL_SAMPLE, &t[SSAO_SAT__T_SAMPLE], depth);
    SSAO_SAT__GL_PASS(g, SSAO_SAT__GL_RANGE, &t[SSAO_SAT__T_RANGE], t[SSAO_SAT__T_SAMPLE].texture);
    if (g->given & SSAO_SAT__IF_SLABS) {
        SSAO_SAT__GL_PASS(g, SSAO_SAT__GL_BINS, &t[SSAO_SAT__T_BINS], depth, t[SSAO_SAT__T_RANGE].texture);
        SSAO_SAT__GL_PASS(g, SSAO_SAT__GL_SHARES, &t[SSAO_SAT__T_SHARES], t[SSAO_SAT__T_BINS].texture);
    }
    region[0] = (float)o->radius;
    region[1] = o->region_pixels > 0 ? 1e30f : (float)o->radius * g->fit.reach;
    region[2] = o->region_pixels > 0 ? (float)o->region_pixels / (float)g->step : g->limit;
    region[3] = o->method == SSAO_SAT_SLABS && g->output != SSAO_SAT__GL_SIGNED ? 3.0f : 1.0f;
    SAT__GL_START(&g->gl, program, &t[SSAO_SAT__T_EDGES], t[SSAO_SAT__T_RANGE].texture, t[SSAO_SAT__T_SHARES].texture);
    ssao_sat__gl_set_frame(g, program);
    sat__gl_set_float4(&g->gl, program, "region", region);
    sat__gl_draw(&g->gl);
}

/* Words of all slabs, and their sums along x, then y. */
static void ssao_sat__gl_sum(ssao_sat_gl *g, unsigned depth)
{
    sat__gl *gl = &g->gl;
    sat__gl_target *t = g->target, *table = &t[SSAO_SAT__T_TABLE];
    unsigned program = g->program[0][SSAO_SAT__GL_SCAN];
    int axis, reach;
    SSAO_SAT__GL_PASS(g, SSAO_SAT__GL_WORDS, table, depth, t[SSAO_SAT__T_EDGES].texture);
    for (axis = 0; axis < 2; axis++)
        for (reach = 1; reach < (axis ? g->now.rows : g->now.columns); reach *= 4) {
            const sat__gl_target from = table[0];
            SAT__GL_START(gl, program, &table[1], from.texture);
            ssao_sat__gl_set_frame(g, program);
            sat__gl_set_int2(gl, program, "reach", axis ? 0 : reach, axis ? reach : 0);
            sat__gl_draw(gl);
            table[0] = table[1];
            table[1] = from;
        }
}

static void ssao_sat__gl_estimate(ssao_sat_gl *g, unsigned depth, unsigned normals)
{
    sat__gl *gl = &g->gl;
    const ssao_sat_options *o = &g->options;
    const sat__gl_target *t = g->target;
    const int single = g->given & SSAO_SAT__IF_SINGLE ? 1 : 0, is_signed = g->output == SSAO_SAT__GL_SIGNED;
    unsigned program = is_signed ? g->program[0][SSAO_SAT__GL_DIFFERENCE + single]
                                 : g->program[normals != 0][SSAO_SAT__GL_ESTIMATE + single];
    const float fit[4] = {(float)o->radius * g->fit.reach, (single ? 1 : (float)o->radius) * g->fit.range, g->fit.bias,
                          g->fit.gain};
    const float region[4] = {(float)o->radius, g->limit, (float)o->min_pixels, (float)o->region_pixels};
    const float tone[4] = {g->fit.power, (float)o->power, 0, 0};
    const float published[4] = {o->method == SSAO_SAT_MINIMALIST ? 0 : (float)o->normal_offset,
                                (float)o->refine_threshold, (float)o->depth_gain, 0};
    SAT__GL_START(gl, program, &t[SSAO_SAT__T_OPEN], depth, t[SSAO_SAT__T_TABLE].texture, t[SSAO_SAT__T_EDGES].texture,
                  normals);
    ssao_sat__gl_set_frame(g, program);
    sat__gl_set_float4(gl, program, "fit", fit);
    sat__gl_set_float4(gl, program, "region", region);
    sat__gl_set_float4(gl, program, "tone", tone);
    sat__gl_set_float4(gl, program, "published", published);
    if (!single && !is_signed) {
        const ssao_sat__kernel *kernel = &ssao_sat__kernels[o->scales - 1];
        float k[52] = {0};
        memcpy(k, kernel->term, sizeof kernel->term);
        k[48] = kernel->grazing;
        k[49] = kernel->facing;
        k[50] = (float)o->geometric;
        gl->Uniform4fv(gl->GetUniformLocation(program, "kernel"), 13, k);
    }
    sat__gl_draw(gl);
}

static sat_result ssao_sat__gl_run(ssao_sat_gl *g, const sat_gl_target *to, unsigned depth, unsigned normals)
{
    sat__gl *gl = &g->gl;
    const sat__gl_target *t = g->target;
    unsigned program = g->program[normals != 0][SSAO_SAT__GL_UPSAMPLE + (int)g->output];
    unsigned own = t[g->output == SSAO_SAT__GL_BENT ? SSAO_SAT__T_BENT : SSAO_SAT__T_OUT].framebuffer;
    sat_result result;
    if (g->options.radius > 0 && g->fit.gain > 0) {
        ssao_sat__gl_find_edges(g, depth);
        ssao_sat__gl_sum(g, depth);
        ssao_sat__gl_estimate(g, depth, normals);
    } else {
        const float open[4] = {g->output == SSAO_SAT__GL_SIGNED ? 0.0f : 1.0f, 0, 0, 0};
        gl->BindFramebuffer(SAT__GL_FRAMEBUFFER, t[SSAO_SAT__T_OPEN].framebuffer);
        gl->ClearBufferfv(SAT__GL_COLOR, 0, open);
    }
    result = sat__gl_pass_to(gl, program, to, own, g->now.width, g->now.height);
    if (result != SAT_OK) return result;
    SAT__GL_INPUTS(gl, depth, t[SSAO_SAT__T_OPEN].texture, normals);
    ssao_sat__gl_set_frame(g, program);
    sat__gl_draw(gl);
    sat__gl_release_target(gl, to);
    return SAT_OK;
}

/* What the object was made for. */
static int ssao_sat__gl_has_output(const ssao_sat_gl *g, ssao_sat__gl_output output)
{
    return output == SSAO_SAT__GL_OPEN ||
           g->given & (output == SSAO_SAT__GL_BENT ? SSAO_SAT__IF_BENT : SSAO_SAT__IF_SIGNED);
}

static sat_result ssao_sat__gl_apply(ssao_sat_gl *gl, const sat_gl_target *to, unsigned depth, unsigned normals,
                                     const ssao_sat_input *input, ssao_sat__gl_output output)
{
    sat__gl_state state;
    sat_result result;
    double side;
    if (!gl || !input || !depth || !gl->is_built || !sat__gl_target_is_valid(to)) return SAT_ERR_ARGUMENT;
    if (!ssao_sat__gl_has_output(gl, output)) return SAT_ERR_ARGUMENT;
    if (sat__gl_target_is(to, depth) || sat__gl_target_is(to, normals)) return SAT_ERR_ARGUMENT;
    if (input->width < 1 || input->height < 1) return SAT_ERR_ARGUMENT;
    if (input->width > gl->width || input->height > gl->height) return SAT_ERR_SIZE;
    if (to && to->width && (to->width != input->width || to->height != input->height)) return SAT_ERR_MISMATCH;
    if ((unsigned)input->depth_kind > (unsigned)SSAO_SAT_DEPTH_REVERSED || !(input->sky >= 0)) return SAT_ERR_ARGUMENT;
    if (!ssao_sat__read_camera(&gl->camera, input, gl->step, gl->options.bottom_up)) return SAT_ERR_ARGUMENT;
    ssao_sat__gl_pack_view(gl->view, &gl->camera, input);
    gl->fit = ssao_sat__fit_of(&gl->options);
    gl->output = output;
    if (output == SSAO_SAT__GL_SIGNED) {
        gl->fit.reach = 1;
        gl->fit.gain = (float)gl->options.gain;
    }
    ssao_sat__gl_set_size(gl, input->width, input->height); /* makes nothing */
    side = ssao_sat__largest_side(gl->now.columns, gl->now.rows, gl->step);
    gl->limit = (float)(gl->options.max_pixels < side ? gl->options.max_pixels : side);
    if (gl->camera.aspect > 1) gl->limit /= gl->camera.aspect;
    gl->from[0] = to ? to->from_x : 0;
    gl->from[1] = to ? to->from_y : 0;
    sat__gl_begin(&gl->gl, &state, SSAO_SAT__GL_UNITS);
    result = ssao_sat__gl_run(gl, to, depth, normals);
    sat__gl_end(&gl->gl, &state);
    return result;
}

SSAO_SAT_DEF sat_result ssao_sat_gl_apply(ssao_sat_gl *gl, const sat_gl_target *to, unsigned depth, unsigned normals,
                                          const ssao_sat_input *input)
{
    return ssao_sat__gl_apply(gl, to, depth, normals, input, SSAO_SAT__GL_OPEN);
}

#ifndef SSAO_SAT_NO_BENT
SSAO_SAT_DEF sat_result ssao_sat_gl_apply_bent(ssao_sat_gl *gl, const sat_gl_target *to, unsigned depth,
                                               unsigned normals, const ssao_sat_input *input)
{
    return ssao_sat__gl_apply(gl, to, depth, normals, input, SSAO_SAT__GL_BENT);
}

SSAO_SAT_DEF unsigned ssao_sat_gl_bent_texture(const ssao_sat_gl *gl)
{
    return gl ? gl->target[SSAO_SAT__T_BENT].texture : 0;
}
#endif

SSAO_SAT_DEF sat_result ssao_sat_gl_apply_signed(ssao_sat_gl *gl, const sat_gl_target *to, unsigned depth,
                                                 unsigned normals, const ssao_sat_input *input)
{
    return ssao_sat__gl_apply(gl, to, depth, normals, input, SSAO_SAT__GL_SIGNED);
}

#ifdef __cplusplus
}
#endif
SAT__IEEE_END
#endif /* SSAO_SAT__GL_IMPLEMENTED */

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
