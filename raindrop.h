/* raindrop.h - 0.1.0 - spherical raindrops that reflect and refract - SPDX-License-Identifier: MIT-0 OR Unlicense

   Rain that can be paused: drops of real sizes and speeds, each a small lens and mirror for an HDR environment, by the
   hundred thousand, blended over a picture that is already there, on the CPU and in OpenGL (Slomp 2012, chapter 2).

   USE

       #define SAT_IMPLEMENTATION             // in exactly one C or C++ file
       #define RAINDROP_IMPLEMENTATION
       #include "raindrop.h"

       raindrop_environment *sky;
       raindrop_rain *rain;
       raindrop_environment_create(&sky, &equirectangular_image, NULL, NULL);
       raindrop_rain_create(&rain, NULL);     // 10 mm/h in a box of 8 m around the origin
       raindrop_rain_advance(rain, 1 / 60.0); // every frame; 0 pauses
       raindrop_render(rgb, width * 12, width, height, depth, &camera, rain, sky, NULL, NULL);

   Build with `cc -std=c99 program.c -lm`; sat.h is all that is needed. C99 and C++11.

   WHAT IT DOES

   - The published hierarchical reflective and refractive maps (table 2.1, figure 2.5) on screen-aligned sprites.
   - The closed form that the thesis left as future work: both rays, Fresnel factors and footprints from two square
     roots, without any map; any number of internal reflections; air bubbles with total reflection; flattened drops.
   - True perspective: a ray for each pixel, exact bounds, antialiased rims. Far drops as one lookup in the environment
     filtered by the drop's own phase function.
   - Rain from a rate: Marshall-Palmer sizes, measured speeds, wind, a drag step that is exact for any dt.
   - Streaks and depth of field, whose light does not swing with their place among the pixels; occlusion by scene depth;
     statistics of what was left out.
   - Primary and secondary rainbow, by geometrical optics or Airy's theory with its supernumerary arcs; the veil of the
     rain beyond the drops that are drawn, and the bows in it by the depth of what stands there.
   - Lamps of the scene, all around or in cones, seen in each drop by the mirrored ray, order 0 and the bow's two; drops
     that oscillate by their first two modes, so that streaks speckle.
   - OpenGL 3.3 / ES 3.0, see OPENGL: rain falls by transform feedback.

   WHAT IT DOES NOT

   - Drops do not see the scene or each other, only the environment; they do not collide, merge, splash or run down.
   - A drop that reaches the near plane, or that the eye is in, is left out (and counted).
   - Sprites (MAP, SPRITE) are still spheres in focus, without lamps. Flattened and swinging drops have order 0 only,
     and lamps' glints as spheres do. Lamps cast no shadows and have no halo in the veil.
   - It starts no thread, opens no window, creates no OpenGL context, keeps no global state.

   OPTIONS (macros)

     RAINDROP_IMPLEMENTATION  off     implementing file   brings the code; LIGHTSCAN_IMPLEMENTATION does so for all six
     RAINDROP_STATIC          off     everywhere          all functions are private to each file
     RAINDROP_DEF             extern  everywhere          replaces the linkage, as in __declspec(dllexport)
     RAINDROP_GL              off     everywhere          OpenGL; needs no GL header, loader or library
     RAINDROP_NO_MAP          off     everywhere          without the published maps and RAINDROP_LOOK_MAP
     RAINDROP_NO_RAIN         off     everywhere          without rain from a rate: drops of your own only
     RAINDROP_NO_STREAK       off     implementing file   exposure and aperture must be 0
     RAINDROP_NO_BOW          off     everywhere          bow_optical_depth and bow_by_depth must be 0
   and those of sat.h: SAT_NO_SIMD, SAT_NO_STDLIB, SAT_ASSERT.

   MEMORY, THREADS, ERRORS

   A rain and a map are one allocation each; an environment is one that stays (22.6 MB for a 1024 x 512 picture) and up
   to two while it is made, and with RAINDROP_FILTER_SAT a table. advance and render allocate nothing. A rain carries
   the scratch memory of one render; environments and maps may be shared by any number of threads. Options may carry a
   parallel_for, which create, advance and render then use. What can fail returns a sat_result and leaves outputs alone
   unless it is SAT_OK; arguments are checked in every build.

   ROWS, LIGHT, FAILURES

   Light is linear radiance, in the environment (decode_srgb for codes) and in the picture. Strides are bytes: 0 packed,
   negative the bottom row first with the pointer at the top one; scene depths are packed. A create that fails sets *out
   to NULL and holds nothing (OpenGL: an object for its message, to be destroyed). On OpenGL the environment is copied
   from the CPU's, and the drops are drawn over your framebuffer: a float texture that you sample or read by
   glReadPixels.

   OPENGL

   It has all looks, streaks, depth of field, flattened drops, orders, exit factors, lamps, oscillation, the veil and
   its bows, rain of any dt, wind, and tests against any depth buffer; into textures, layers, framebuffers and parts of
   them. Instead of the order: none, or slices of depth. It has not: RAINDROP_FILTER_SAT, statistics, drops left out
   behind the scene's depth before they are drawn, doubles in the step. The environment is made on the CPU.

   NUMERICS

   - raindrop_trace: 3e-7 from a ray traced in long double, eye distance 1.01 to 1025 radii, index 1 and 1.33; 3e-6 for
     glass and bubbles. Orders 0..3: 1e-6. The shares of all orders sum to 1 within 1e-6.
   - b -> 1, n = 1 (which gives the direction itself, bit for bit), total reflection and the view along the up vector
     are all ordinary cases; a radius or position that is no number leaves the drop out and counts it.
   - The drag step is exact for vertical fall and rise in a steady wind, for h/tau from 0 to 1e6 (a 1 um drop, 10 s):
     the fixed point to 1e-6, two half steps equal one to 1e-6. Sideways the drag takes the vertical speed for the whole
     speed: a gust is followed up to about a third too slowly by the largest drops, and never unstably; one step
     instead of many ends as fast, its way in the first second off by up to an eighth.
   - Terminal velocity: Stokes' law and Best 1950 blended, rms 3.5 % from Gunn and Kinzer 1949. Rain rate: within 3 % of
     the asked one for time steps from 1/240 to 3600 s (Marshall and Palmer's own number of drops would carry 1.13 mm/h
     where 1 is asked for); mean sizes within 1 % in boxes that climb, sink or jump and in air that rises or sinks.
   - A drop's light is its area's within 1.3 % wherever it stands among the pixels, for all radii, streaks and blurs, on
     CPU and GPU; of sharp drops below 1.4 pixels exactly. Sprites, as published, are at least a pixel wide.
   - The veil: within 1 % of the drops that it stands for, drawn. Airy's bows: the angles of the maxima within .1
     degrees, their light within .5 % of geometrical optics'.
   - RMSE from sorted drops (bench_raindrop, "The order of drops"): in rain of 50 mm/h unsorted ones 1e-5; 1e5 drops
     of 2 mm in the published box unsorted .0067, 4 slices .0004, 16 slices 3e-6; 1e6 of them .022, .0065, .0025.
     Weighted blending (McGuire and Bavoil 2013) errs 4e-5, .001 to .003 and .008 there: more than four slices, and in
     natural rain more than no order at all. It is left out.
   - Lamps: a glint's light within 5 % of traced rays (8 % half a degree beside the bow), its place within a pixel of a
     drop 160 wide; lamps all around sum to a white sky within .5 %. Swinging drops keep the mean light of their streaks
     within .2 %; a still one is the spheroid of the moment.
   - Environment: NaN counts as 0, infinity (from 1e36 on, so that no sum of light overflows) as the largest value
     below, negative light as 0; all are counted. One texel of 1e8 stays what it is: mips and footprints spread it, or
     `max_radiance` cuts it.
   - The same bits for any number of workers, and of pictures with SSE2, NEON or plain C (raindrop_trace_n: but for the
     last count % lanes rays, whose last digits differ). The GPU's picture is within an RMSE of 5e-4 of the CPU's
     (tone-mapped luminance, quads, both unsorted; llvmpipe: 4e-5, with the longest streaks 2e-4), its drops within 3e-4
     m over tens of steps.

   COST (one core, SSE2; ratios from tests/bench/bench_raindrop.c, forest environment)

   - Vectors of a fragment, closed form on arrays: SSE2 3.5 ns, AVX2 1.5 ns with gcc and clang alike. The trilinear map
     (base 512, in the cache) takes 4.7 and 7 times as long with gcc, 13 and 21 times with clang; 44.7 MB against none.
   - One drop of 256 pixels 33 degrees off axis, RMSE over its pixels: map .192, sprite .192, ray .013. In the middle:
     .069, .068, .015.
   - 1e5 drops of 2 mm in the published box at 512 x 512, time over the map's and RMSE: map 1 .0586, sprite 1.0 .0498,
     ray .80 .0311, auto .79 .0312 (far drops below 1.5 px, the default; 3 px .0331); no rain at all .0556: far drops of
     at least a pixel, as published, are worse than none. 1e6 drops: map 1 .140, ray .70 .0767, auto .62 .0772.
   - Lamps, rain of 25 mm/h with streaks: each a sixth of the frame; oscillation twice the frame, and each lamp then
     two thirds of it. Both off: the time without them.
   - Lookups in mips: a texel of the octahedral picture 256..2048 wide costs the same; 1024 is as good as 2048 (.0212,
     .0199). Boxes of a table: 11 to 85 times as long, better for small drops only (12 pixels: .030 against .044).
   - Streaks: RMSE .0004 to .0014 from 64 still moments, 35 to 75 times faster.
   - Sorting is 2 % of a frame.
   - OpenGL, auto, 50000 drops of 2 mm at 512 x 512 on llvmpipe (tests/bench/gpu_raindrop.c), over round, sharp and
     still drops without internal reflections: orders 1.0, flattened drops 1.1, a lens 1.4, a shutter 2, oscillation
     1.8, each lamp 6 more: its four paths' vertices.
*/

/* What stands where; each name stands once more, with its arrows, where its section begins.

   CONTENTS

   >> interface     what the library offers, in the order of the parts below
   >> vectors       random numbers, SIMD
   >> options       tables of defaults and ranges, raindrop_explain_...
   >> one drop      a ray through a sphere or a spheroid, all orders
   >> maps          the published hierarchical maps
   >> environment   the octahedral picture, its mips, the far drops' prefilter
   >> rainbows      geometrical optics and Airy's theory
   >> rain          sizes, speeds, the drag step, the box
   >> lamps         their light through drops; drops that oscillate
   >> picture       camera, culling, sorting
   >> drawing       rays in batches, far drops, streaks, depth of field
   >> glints        lamps seen in drops, far drops that swing
   >> sprites       the published sprites; bands and whole pictures, background, veil
   >> shaders       the same in GLSL: environment, veil, the vertices of drops, lamps
   >> fragments     the fragments of drops
   >> rain shader   the rain's step in GLSL
   >> OpenGL        the object: programs, environment, drops
   >> OpenGL picture  drops, glints and veil
*/

#if defined(LIGHTSCAN_IMPLEMENTATION) && !defined(RAINDROP_IMPLEMENTATION)
#define RAINDROP_IMPLEMENTATION
#endif

#ifndef RAINDROP_H
#define RAINDROP_H

#define RAINDROP_VERSION_MAJOR 0
#define RAINDROP_VERSION_MINOR 1
#define RAINDROP_VERSION_PATCH 0
#define RAINDROP_VERSION (RAINDROP_VERSION_MAJOR * 10000 + RAINDROP_VERSION_MINOR * 100 + RAINDROP_VERSION_PATCH)

#if defined(RAINDROP_IMPLEMENT) || defined(RAINDROP_IMPL)
#error "raindrop.h: the macro is called RAINDROP_IMPLEMENTATION"
#endif

#if defined(RAINDROP_GL) && !defined(SAT_GL)
#define SAT_GL
#endif
#include "sat.h"
#if SAT_VERSION < 100
#error "raindrop.h: needs sat.h 0.1.0 or newer"
#endif

/* RAINDROP_STATIC makes every function private to the file; RAINDROP_DEF replaces the linkage altogether. */
#ifndef RAINDROP_DEF
#ifdef RAINDROP_STATIC
#define RAINDROP_DEF static inline
#else
#define RAINDROP_DEF extern
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The version the implementation was compiled with: compare with RAINDROP_VERSION. */
RAINDROP_DEF int raindrop_version(void);

/* ------------------------------------------------------------------------------------------------
   >> interface

   One ray and one drop, free of units: the drop has radius 1
   ------------------------------------------------------------------------------------------------ */

#define RAINDROP_WATER 1.33f /* water in air, as Slomp 2012; 1 / 1.33f is an air bubble in water */

/* What leaves a drop. Directions are unit vectors. A pencil of rays `w` radii
   wide leaves as a cone of about footprint * w radians. */
typedef struct raindrop_ray {
    float reflected[3], refracted[3]; /* mirrored at the front; through the drop with two refractions */
    float fresnel;                /* F, the reflected share of the power, unpolarised */
    float transmit;               /* share that passes both surfaces: the mean of (1-F)^2 over both polarisations */
    float footprint_reflected, footprint_refracted;
} raindrop_ray;

/* direction d: unit vector. centre_offset p: from the centre to the point of the ray nearest to it, |p| = b <= 1.
   one_minus_b2: 1 - b^2, asked for because the caller often knows it better than 1 - |p|^2 does (raindrop_sprite_ray
   makes all three). n > 0: index of the drop over that of its surroundings; where the ray is totally reflected (a
   bubble's rim) F is 1 and `refracted` repeats `reflected`. */
RAINDROP_DEF void raindrop_trace(raindrop_ray *out, const float direction[3], const float centre_offset[3],
                                 float one_minus_b2, float n);

/* The same for `count` rays, as arrays; any output may be NULL. */
typedef struct raindrop_ray_inputs { const float *direction[3], *centre_offset[3], *one_minus_b2; } raindrop_ray_inputs;
typedef struct raindrop_ray_outputs {
    float *reflected[3], *refracted[3], *fresnel, *transmit, *footprint_reflected, *footprint_refracted;
} raindrop_ray_outputs;
RAINDROP_DEF void raindrop_trace_n(const raindrop_ray_outputs *out, const raindrop_ray_inputs *in, int count, float n);

/* Order k >= 0: k internal reflections between the two refractions; k = 0 is `refracted`, 1 the rainbow, 2 the second.
   *weight is the order's share of the power, *rest its share with all later ones: rest(0) + F = 1. */
typedef struct raindrop_order { float direction[3], weight, rest, footprint; } raindrop_order;
RAINDROP_DEF void raindrop_trace_order(raindrop_order *out, const float direction[3], const float centre_offset[3],
                                       float one_minus_b2, float n, int k);

/* A ray for the point (s, t) of a unit disc that shows a drop at `distance` > 1 radii from the eye, which looks along
   -z at its centre: the published map's geometry, without the loss of digits of far drops. Outside the disc the point
   moves to the rim. */
RAINDROP_DEF void raindrop_sprite_ray(float direction[3], float centre_offset[3], float *one_minus_b2, float s, float t,
                                      float distance);

/* A flattened drop: half axes 1 across and `axis_ratio` along y. Returns 0 (and writes nothing) when the ray misses. */
RAINDROP_DEF int raindrop_trace_spheroid(raindrop_ray *out, const float direction[3], const float centre_offset[3],
                                         float axis_ratio, float n);

/* ------------------------------------------------------------------------------------------------
   The published hierarchical maps (Slomp 2012, section 2.4.2)
   ------------------------------------------------------------------------------------------------ */

#ifndef RAINDROP_NO_MAP
/* Level i is base / 2^i texels wide and shows the drop from sqrt(1 + 4^i) radii (table 2.1). 32 bytes a texel:
   44.7 MB for a base of 1024. A texel is reflected xyz, F, refracted xyz, alpha; all 0 outside the drop. */
typedef struct raindrop_map raindrop_map;
typedef struct raindrop_map_options {
    int resolution;          /* 1024; 1..4096; a power of two: width of level 0 */
    int alpha_samples;       /* 32; 1..4096; rays a texel for alpha, random, from a fixed seed */
    float n;                 /* 1.33; 0.1..10; index of the drops */
    sat_allocator allocator; /* malloc; used by create and destroy only */
} raindrop_map_options;
RAINDROP_DEF raindrop_map_options raindrop_map_defaults(void);
RAINDROP_DEF sat_result raindrop_map_create(raindrop_map **out, const raindrop_map_options *options);
/* One sentence that names the first argument that raindrop_map_create refuses, and its range; "" when it takes them.
   Written into the caller's memory, cut where that ends; returns `text`. So do all raindrop_explain_... */
RAINDROP_DEF const char *raindrop_explain_map(char *text, size_t size, const raindrop_map_options *options);
RAINDROP_DEF int raindrop_map_levels(const raindrop_map *map);
/* Rows from the bottom (t = -1) up, 8 floats a texel; NULL outside 0..levels-1. resolution may be NULL. */
RAINDROP_DEF const float *raindrop_map_level(int *resolution, const raindrop_map *map, int level);
/* The same as half floats, 8 a texel, written to the caller's memory. */
RAINDROP_DEF sat_result raindrop_map_level_half(uint16_t *out, const raindrop_map *map, int level);
RAINDROP_DEF double raindrop_map_distance(int level); /* radii from the eye to the centre, table 2.1 */
/* Trilinear lookup at (s, t) in [-1, 1]^2 for a drop at `distance` radii: 8 floats. */
RAINDROP_DEF void raindrop_map_sample(float out[8], const raindrop_map *map, float s, float t, float distance);
RAINDROP_DEF void raindrop_map_destroy(raindrop_map *map); /* NULL is fine */
#else
typedef struct raindrop_map raindrop_map;
#endif

/* ------------------------------------------------------------------------------------------------
   Environment
   ------------------------------------------------------------------------------------------------ */

typedef enum raindrop_layout {
    RAINDROP_LAYOUT_EQUIRECT, /* u = atan2(x, -z) / 2pi + 1/2, v = acos(y) / pi, row 0 at the top */
    RAINDROP_LAYOUT_CUBE      /* six squares, one below the other: +x -x +y -y +z -z as OpenGL has them */
} raindrop_layout;

typedef enum raindrop_filter {
    RAINDROP_FILTER_MIPS, /* octahedral picture with mips, trilinear */
    RAINDROP_FILTER_SAT   /* box of the footprint's size in a summed-area table that wraps around; equirect only */
} raindrop_filter;

typedef struct raindrop_environment_options {
    raindrop_layout layout;       /* RAINDROP_LAYOUT_EQUIRECT */
    raindrop_filter filter;       /* RAINDROP_FILTER_MIPS; 5 to 20 times faster, and closer; see COST */
    int resolution;               /* 0; 0..4096; 0: from the picture; a power of two of at least 16: side of the
                                     octahedral picture */
    int far_resolution;           /* 64; 8..256; a power of two: side of the far drops' prefilter */
    int far_samples;              /* 256; 16..65536; of each of its texels */
    int far_orders;               /* 1; 0..3; internal reflections that it knows */
    float n;                      /* 1.33; 0.1..10; index of the drops */
    float scale;                  /* 1; 1e-18..1e18; 1/255.f for 8-bit input */
    int decode_srgb;              /* 0; 0..1; 1: scaled values are sRGB, for LDR pictures */
    float max_radiance;           /* 0; 0..1e36; 0: none; otherwise brighter values become this one, and are
                                     counted */
    float sun_direction[3];       /* 0, 1, 0: a unit vector towards the sun, which lights the bows */
    float sun_irradiance[3];      /* 1, 1, 1; not negative */
    float bow_optical_depth;      /* 0; 0..10; 0: no bows; share of the sun's light that the rain in view scatters */
    int far_swing;                /* 0; 0..1; 1: the prefilter knows how the light of far drops swings with their shape,
                                     which raindrop_render_options.oscillation shows; takes 3 times as long to make */
    int bow_by_depth;             /* 0; 0..1; 1: raindrop_veil shows the bows, as bright as there is rain before what
                                     stands there; 43 KB */
    double bow_drop_mm;           /* 0; 0.05..6; or 0: geometrical optics; otherwise Airy's theory for drops of this
                                     diameter, with supernumerary arcs */
    sat_allocator allocator;      /* malloc */
    sat_threads threads;          /* serial; used by create; same bits for any worker count */
} raindrop_environment_options;
RAINDROP_DEF raindrop_environment_options raindrop_environment_defaults(void);

typedef struct raindrop_environment_stats {
    size_t nan, infinite, negative, clamped; /* channel values replaced: by 0, by the largest one below 1e36, by 0,
                                                by `max_radiance` */
    float largest;                           /* after that */
    size_t bytes;
} raindrop_environment_stats;

/* image: 1 (grey), 3 or 4 channels, any format. The picture is read once and not kept. */
typedef struct raindrop_environment raindrop_environment;
RAINDROP_DEF sat_result raindrop_environment_create(raindrop_environment **out, const sat_image *image,
                                                    const raindrop_environment_options *options,
                                                    raindrop_environment_stats *stats);
RAINDROP_DEF const char *raindrop_explain_environment(char *text, size_t size, const sat_image *image,
                                                      const raindrop_environment_options *options);
RAINDROP_DEF void raindrop_environment_destroy(raindrop_environment *environment); /* NULL is fine */
/* Radiance from a direction (any length but 0), averaged over a cone of `footprint` radians. */
RAINDROP_DEF void raindrop_environment_sample(float rgb[3], const raindrop_environment *environment,
                                              const float direction[3], float footprint);
/* Mean colour of a far drop seen in that direction: the environment filtered by the drop's own phase function. */
RAINDROP_DEF void raindrop_environment_far(float rgb[3], const raindrop_environment *environment,
                                           const float direction[3]);

/* ------------------------------------------------------------------------------------------------
   Rainbows
   ------------------------------------------------------------------------------------------------ */

/* Scattering angle of the bow of order k = 1, 2, ... in radians from the forward direction, by geometrical optics:
   cos i = sqrt((n^2-1) / (k(k+2))). The bow stands at pi minus this (k = 1) or this minus pi (k = 2) from the
   antisolar point. */
RAINDROP_DEF double raindrop_bow_angle(int order, double n);
/* Index of water at 20 degrees by wavelength, 380..780 nm. */
RAINDROP_DEF double raindrop_water_index(double wavelength_nm);
#ifndef RAINDROP_NO_BOW
/* Share of the light scattered per steradian by orders 1 and 2, white light from a sun 0.53 degrees wide, linear
   Rec. 709; bin i of `count` >= 16 covers scattering angles pi i/count .. pi (i+1)/count. diameter_mm: 0 for
   geometrical optics, else 0.05..6: Airy's theory, whose supernumerary arcs lie closer the larger the drops are. */
RAINDROP_DEF sat_result raindrop_bow_profile(float *rgb, int count, double diameter_mm);
#endif

/* ------------------------------------------------------------------------------------------------
   Rain. Lengths in metres (drop diameters in millimetres where the name says so), times in seconds, y up.
   ------------------------------------------------------------------------------------------------ */

/* Speed of fall at sea level, 1e-4..6 mm; rms 4 % from the table of Gunn and Kinzer 1949. */
RAINDROP_DEF double raindrop_terminal_velocity(double diameter_mm);
/* Height over width of a falling drop, Beard and Chuang 1987; 1 up to 0.4 mm. */
RAINDROP_DEF double raindrop_oblateness(double diameter_mm);
/* Drops per cubic metre and millimetre of diameter, Marshall and Palmer 1948. */
RAINDROP_DEF double raindrop_marshall_palmer(double diameter_mm, double rate_mm_h);

/* Share of the light that rain of that rate takes out of a metre: the drops' area in a cubic metre, for the sizes and
   number that raindrop_rain_create makes by default. What is bent by less than a drop's diffraction is not counted. */
RAINDROP_DEF double raindrop_extinction(double rate_mm_h);

/* position, velocity: metres, m/s. radius: of the sphere of equal volume. axis_ratio: height over width, 1 = sphere. */
typedef struct raindrop_drop { float position[3], radius, velocity[3], axis_ratio; } raindrop_drop;

#ifndef RAINDROP_NO_RAIN
/* One step of any length dt >= 0 under gravity and drag towards the terminal velocity in a steady wind (see NUMERICS);
   dt = 0 changes nothing. SAT_ERR_ARGUMENT, and the drop as it was, for what is not finite, radius <= 0, dt < 0, or a
   dt after which its place is no float. */
RAINDROP_DEF sat_result raindrop_fall(raindrop_drop *drop, const float wind[3], double dt);
#endif

typedef struct raindrop_rain_options {
    double rate_mm_h;            /* 10; 0.01..500; sizes and number of the drops */
    int count;                   /* 0; 0..33554432; 0: from rate_mm_h and the box */
    double diameter_mm;          /* 0; 0.001..6; or 0: Marshall-Palmer; otherwise of all drops */
    double diameter_min_mm;      /* 0.1; 0.001..6 */
    double diameter_max_mm;      /* 6; 0.001..6; above the smallest */
    float box_size[3];           /* 8, 8, 8: edges of the rain box. The published scene: 2.05 each, 1e6 drops of 2 mm */
    float centre[3];             /* 0, 0, 0: of the box */
    float wind[3];               /* 0, 0, 0 */
    float speed;                 /* 0; 0..1e18; 0: terminal; otherwise all drops fall with it, as published */
    int oblate;                  /* 0; 0..1; 1: Beard-Chuang shapes */
    uint32_t seed;               /* 1 */
    const raindrop_drop *drops;  /* NULL; otherwise `count` drops of your own, copied; they never wrap */
    sat_allocator allocator;     /* malloc; used by create and destroy only */
    sat_threads threads;         /* serial; advance and render use it; same bits for any worker count */
} raindrop_rain_options;
RAINDROP_DEF raindrop_rain_options raindrop_rain_defaults(void);

/* 100 bytes a drop, one allocation. Holds the scratch memory of raindrop_render too: one render at a time a rain. */
typedef struct raindrop_rain raindrop_rain;
RAINDROP_DEF sat_result raindrop_rain_create(raindrop_rain **out, const raindrop_rain_options *options);
RAINDROP_DEF const char *raindrop_explain_rain(char *text, size_t size, const raindrop_rain_options *options);
RAINDROP_DEF void raindrop_rain_destroy(raindrop_rain *rain); /* NULL is fine */
RAINDROP_DEF const raindrop_drop *raindrop_rain_drops(int *count, const raindrop_rain *rain); /* count may be NULL */
/* Replaces the drops by at most as many of your own, which never wrap: particles of another simulation. */
RAINDROP_DEF sat_result raindrop_rain_set_drops(raindrop_rain *rain, const raindrop_drop *drops, int count);
#ifndef RAINDROP_NO_RAIN
/* Any dt >= 0, in seconds; 0 pauses. Drops that leave the box below come back on top with the size of another drop
   (Marshall-Palmer weighted by speed, as rain arrives at a plane); those that leave by another side come back on the
   opposite one. So it is when the box moves: rain that the camera climbs through keeps its sizes and their number.
   Needs no time for drag while all drops have reached their terminal velocity. */
RAINDROP_DEF sat_result raindrop_rain_advance(raindrop_rain *rain, double dt);
RAINDROP_DEF sat_result raindrop_rain_set_wind(raindrop_rain *rain, const float wind[3]);
RAINDROP_DEF sat_result raindrop_rain_set_centre(raindrop_rain *rain, const float centre[3]); /* at the next advance */
#endif

/* ------------------------------------------------------------------------------------------------
   Picture
   ------------------------------------------------------------------------------------------------ */

typedef struct raindrop_camera {
    float position[3];               /* 0, 0, 0 */
    float right[3], up[3], back[3];  /* x, y, z: orthonormal, looks along -back */
    float velocity[3];               /* 0, 0, 0: streaks are relative to it */
    float fov_y;                     /* 1.5707963267948966; 0.001..3; full vertical angle in radians */
    float depth_near;                /* 0.01; 0..1e18; drops that reach nearer are left out */
    float depth_far;                 /* 0; 0..1e18; raindrop_gl_render: > depth_near: the depth test is on, against a
                                        depth buffer of the usual perspective with these two planes */
    float exposure;                  /* 0; 0..1e18; seconds; 0: still drops; otherwise streaks around their positions */
    float aperture;                  /* 0; 0..1e18; metres; 0: all in focus; otherwise diameter of a thin lens */
    float focus_distance;            /* 3; 1e-18..1e18; metres along the viewing axis */
} raindrop_camera;
RAINDROP_DEF raindrop_camera raindrop_camera_defaults(void);
/* The defaults, placed and turned: `up` only fixes the roll and may be parallel to the view. */
RAINDROP_DEF raindrop_camera raindrop_camera_look(const float position[3], const float target[3], const float up[3],
                                                  float fov_y);
RAINDROP_DEF const char *raindrop_explain_camera(char *text, size_t size, const raindrop_camera *camera);

typedef enum raindrop_look {
    RAINDROP_LOOK_MAP,    /* as published: square sprites of at least a pixel from the hierarchical map */
    RAINDROP_LOOK_SPRITE, /* the same sprites from the closed form; no map */
    RAINDROP_LOOK_RAY,    /* a ray a pixel: true perspective, antialiased rim */
    RAINDROP_LOOK_AUTO    /* far drops as one lookup in the prefiltered environment, near ones as rays */
} raindrop_look;

/* A lamp of the scene: a small ball of light, all around or in a cone. It lights the drops and is not drawn itself.
   What stands between it and the drops casts no shadow. */
typedef struct raindrop_lamp {
    float position[3];  /* 0, 0, 0: metres */
    float intensity[3]; /* 1, 1, 1: radiance of the ball times pi radius^2, in the environment's unit and metres */
    float radius;       /* 0.1; 0..1e18; of the ball, in metres */
    float direction[3]; /* 0, -1, 0: a unit vector, the axis of the cone */
    float inner;        /* 3.1415926535897932; 0..3.1416; radians from the axis within which it has its full light */
    float outer;        /* 3.1415926535897932; 0..3.1416; radians from which on it has none; not below inner */
} raindrop_lamp;
RAINDROP_DEF raindrop_lamp raindrop_lamp_defaults(void);
RAINDROP_DEF const char *raindrop_explain_lamp(char *text, size_t size, const raindrop_lamp *lamp);

typedef struct raindrop_render_options {
    raindrop_look look;        /* RAINDROP_LOOK_AUTO */
    const raindrop_map *map;   /* NULL; needed by RAINDROP_LOOK_MAP */
    float far_radius;          /* 1.5; 0..64; pixels: AUTO takes smaller drops for far; more is faster and coarser. RAY
                                  and AUTO do so with all below 1.4, of which a ray a pixel would see too little */
    float coverage_threshold;  /* 0.0001; 0..1; drops that cover less of a pixel are left out and counted */
    int orders;                /* 1; 0..3; internal reflections, RAY and AUTO */
    int exit_fresnel;          /* 0; 0..1; 0: the last order carries what later ones would (0 orders: eq 2.5); 1: only
                                  its own */
    float orders_radius;       /* 8; 0..1e18; pixels: smaller drops do with order 0, and one ray a pixel at the rim */
    int sort;                  /* 1; 0..1; raindrop_render: 1: far to near; 0: in the array's order, as published */
    int slices;                /* 1; 1..64; raindrop_gl_render: slices of depth, thinner the nearer, drawn from far to
                                  near, each in the array's order; all vertices run once a slice */
    float oscillation;         /* 0; 0..0.25; RAY and AUTO: share by which the axes of drops from 1.2 mm on swing (none
                                  below 0.8 mm), so that near drops wobble and streaks speckle; 0.1 is much */
    const raindrop_lamp *lamps; /* NULL; read by the call: RAY and AUTO draw their glints */
    int lamp_count;            /* 0; 0..16 */
} raindrop_render_options;
RAINDROP_DEF raindrop_render_options raindrop_render_defaults(void);

/* How many drops were drawn, and why the others were not: the counts from `drawn_near` to `below_threshold` sum to
   `drops`. */
typedef struct raindrop_render_stats {
    size_t drops;
    size_t drawn_near, drawn_far; /* by rays (or sprites); by one lookup */
    size_t invalid;               /* radius not above 0, or something not finite */
    size_t inside;                /* the eye is in the drop */
    size_t behind, near_plane;    /* behind the camera; in front but nearer than depth_near */
    size_t outside;               /* of the picture */
    size_t hidden;                /* wholly behind the scene's depth */
    size_t below_threshold;
    double coverage_left_out;     /* pixels that those would have covered */
    size_t fragments, order_fragments; /* pixels blended; those of them with orders >= 1 */
} raindrop_render_stats;

/* Blends the drops over the picture in rgb: 3 floats a pixel, rows `stride` bytes apart, linear radiance in the
   environment's unit. depth: NULL, or width x height packed distances along the viewing axis in metres; what is not
   above 0 or not finite is empty. Width and height 1..32768. No allocation. stats may be NULL. */
RAINDROP_DEF sat_result raindrop_render(float *rgb, ptrdiff_t stride, int width, int height, const float *depth,
                                        const raindrop_camera *camera, const raindrop_rain *rain,
                                        const raindrop_environment *environment, const raindrop_render_options *options,
                                        raindrop_render_stats *stats);
/* For raindrop_render, and with a stride of 0 for raindrop_gl_render: "" when rgb, rain and environment are the
   only arguments left that could be refused. */
RAINDROP_DEF const char *raindrop_explain_render(char *text, size_t size, ptrdiff_t stride, int width, int height,
                                                 const raindrop_camera *camera,
                                                 const raindrop_render_options *options);

/* The environment as a background picture for that camera. */
RAINDROP_DEF sat_result raindrop_environment_render(float *rgb, ptrdiff_t stride, int width, int height,
                                                    const raindrop_camera *camera,
                                                    const raindrop_environment *environment,
                                                    const sat_threads *threads);

/* The rain beyond the drops that are drawn: what lies behind s metres of it keeps exp(-extinction s) of its light, and
   the rest comes from all around as a far drop sends it, with the bows where the environment has bow_by_depth. One
   scattering, as rain up to an optical depth of about 1 shows it. Before raindrop_render, on the same picture. */
typedef struct raindrop_veil_options {
    float extinction;    /* 0.00069; 0..1e18; a metre: raindrop_extinction of the rate, here of 10 mm/h */
    float from;          /* 4; 0..1e18; metres from the eye: what is nearer is left to the drops that are drawn */
    float reach;         /* 1000; 0..1e18; metres: as far as it rains, and how far it is where depth is empty */
    int clip_zero_to_one; /* 0; 0..1; raindrop_gl_veil: 0: projection takes depth to [-1,1] (OpenGL); 1: to [0,1]
                            (glClipControl) */
    sat_threads threads; /* serial; same bits for any worker count */
} raindrop_veil_options;
RAINDROP_DEF raindrop_veil_options raindrop_veil_defaults(void);
RAINDROP_DEF const char *raindrop_explain_veil(char *text, size_t size, const raindrop_veil_options *options);
/* rgb, stride, depth: as in raindrop_render. */
RAINDROP_DEF sat_result raindrop_veil(float *rgb, ptrdiff_t stride, int width, int height, const float *depth,
                                      const raindrop_camera *camera, const raindrop_environment *environment,
                                      const raindrop_veil_options *options);

#ifdef __cplusplus
}
#endif
#endif /* RAINDROP_H */

/* ------------------------------------------------------------------------------------------------
   OpenGL: GL 3.3 core and ES 3.0 / WebGL 2 (define RAINDROP_GL)
   ------------------------------------------------------------------------------------------------ */

#if defined(RAINDROP_GL) && !defined(RAINDROP__GL_API)
#define RAINDROP__GL_API

#ifdef __cplusplus
extern "C" {
#endif

typedef struct raindrop_gl_options {
    const raindrop_map *map; /* NULL; needed by RAINDROP_LOOK_MAP, copied to the GPU */
    int half_map;            /* 1; 0..1; 1: half floats, 22 MB for a base of 1024; 0: floats */
    int quads;               /* 1; 0..1; 1: instanced quads; 0: point sprites, as published, which vanish when their
                                centre leaves the picture and are cut at the context's largest point */
    int sprites;             /* 1; 0..1; 0: pictures have no RAINDROP_LOOK_SPRITE. This and the next six are what create
                                compiles programs for; a picture that needs one which is 0 is refused by name */
    int motion;              /* 1; 0..1; 0: no exposure, no aperture */
    int oblate;              /* 1; 0..1; 0: no flattened drops */
    int orders;              /* 1; 0..1; 0: no internal reflections (render options' orders 0), all drops quicker */
    int veil;                /* 1; 0..1; 0: no raindrop_gl_veil */
    int oscillation;         /* 0; 0..1; 1: render options' oscillation */
    int lamps;               /* 0; 0..1; 1: render options' lamps: all drops once more for each and its four paths */
    sat_allocator allocator; /* malloc; used by create and destroy only */
} raindrop_gl_options;
RAINDROP_DEF raindrop_gl_options raindrop_gl_defaults(void);

/* Belongs to the context that is current in create: it must be current in every call. Every call leaves the OpenGL
   state as it was (but for pending errors, which are lost). */
typedef struct raindrop_gl raindrop_gl;
/* Compiles all that the options ask for; nothing is compiled or allocated later, but for what set_environment and
   set_rain send. On an OpenGL error *out only answers raindrop_gl_message, and is to be destroyed; on the others it is
   NULL. */
RAINDROP_DEF sat_result raindrop_gl_create(raindrop_gl **out, sat_gl_get_proc *get_proc,
                                           const raindrop_gl_options *options);
/* Other options: whatever needs no other program or texture, so one of the last seven that was 1 and is 0 now.
   SAT_ERR_MISMATCH, the message names it and nothing changes, when a map, half_map, quads or one of them that was 0
   differs. The allocator is not looked at. All else is an option of each raindrop_gl_render. */
RAINDROP_DEF sat_result raindrop_gl_set_options(raindrop_gl *gl, const raindrop_gl_options *options);
RAINDROP_DEF const char *raindrop_explain_gl(char *text, size_t size, const raindrop_gl_options *options);
RAINDROP_DEF void raindrop_gl_destroy(raindrop_gl *gl); /* NULL is fine */
/* What the last SAT_ERR_GL_... was about; never NULL, and NULL is fine. */
RAINDROP_DEF const char *raindrop_gl_message(const raindrop_gl *gl);

/* Copies; needed before render. Radiance above 65000 makes it floats instead of half floats, which ES cannot filter. */
RAINDROP_DEF sat_result raindrop_gl_set_environment(raindrop_gl *gl, const raindrop_environment *environment);
RAINDROP_DEF sat_result raindrop_gl_set_rain(raindrop_gl *gl, const raindrop_rain *rain);
#ifndef RAINDROP_NO_RAIN
/* raindrop_rain_advance by transform feedback: the same step, in floats, and the same random numbers. */
RAINDROP_DEF sat_result raindrop_gl_advance(raindrop_gl *gl, double dt);
RAINDROP_DEF sat_result raindrop_gl_set_wind(raindrop_gl *gl, const float wind[3]);
RAINDROP_DEF sat_result raindrop_gl_set_centre(raindrop_gl *gl, const float centre[3]); /* at the next advance */
#endif
/* The drops back from the GPU, which waits for it; count as in the rain. */
RAINDROP_DEF sat_result raindrop_gl_read_drops(raindrop_gl *gl, raindrop_drop *drops, int count);

/* Blends the drops over a picture of this size, another one in each frame as you like, in the target `to`, which should
   hold floats; NULL: in the framebuffer that is bound. Row 0 is the bottom one, as OpenGL has it. Unsorted, as
   published, or in slices; else as raindrop_render, lamps' glints last. What a picture does not need, its program does
   not know.

   projection: the perspective matrix (column-major) that drew the framebuffer's depth buffer: the depth test is on,
   depth is not written. It may be reversed, infinite, or made for glClipControl's [0,1]. NULL: no test, or where
   camera.depth_far says so the usual perspective with depth_near and depth_far. */
RAINDROP_DEF sat_result raindrop_gl_render(raindrop_gl *gl, const sat_gl_target *to, int width, int height,
                                           const raindrop_camera *camera, const float projection[16],
                                           const raindrop_render_options *options);

/* raindrop_veil over the target `to`; NULL: over the framebuffer that is bound. depth: a depth texture of the picture's
   size, row for row with it, or a larger one (to->from_x, from_y), which the target must not hold; where it is as far
   as it can be, it is empty. 0: empty everywhere. projection: as in raindrop_gl_render; options->clip_zero_to_one tells
   how it maps depth. */
RAINDROP_DEF sat_result raindrop_gl_veil(raindrop_gl *gl, const sat_gl_target *to, int width, int height,
                                         unsigned depth, const raindrop_camera *camera, const float projection[16],
                                         const raindrop_veil_options *options);

/* GLSL (3.30 or ES 3.00) for shaders of your own: raindrop_ray raindrop_trace(d, p, one_minus_b2, n) as on the CPU. */
RAINDROP_DEF const char *raindrop_gl_glsl(void);

#ifdef __cplusplus
}
#endif
#endif /* RAINDROP__GL_API */

/* ------------------------------------------------------------------------------------------------
   Stop here if you only want to use the library.
   ------------------------------------------------------------------------------------------------ */

#if defined(RAINDROP_IMPLEMENTATION) && !defined(RAINDROP_IMPLEMENTED)
#define RAINDROP_IMPLEMENTED
#ifndef SAT_SIBLING
#define SAT_SIBLING
#endif
#if defined(RAINDROP_GL) && !defined(SAT_SIBLING_GL)
#define SAT_SIBLING_GL
#endif
#include "sat.h"

SAT__IEEE_BEGIN
#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------------------------------------
   >> vectors   random numbers, and as many floats at a time as the compiler was told to use
   ------------------------------------------------------------------------------------------------ */

#define RAINDROP__PI 3.14159265358979323846
#define RAINDROP__GOLDEN 2.39996323f /* the golden angle */
#define RAINDROP__SQUARE 0.886227f   /* sqrt(pi)/2: half the side of the square that is as large as the unit disc */

RAINDROP_DEF int raindrop_version(void) { return RAINDROP_VERSION; }

/* A block that the object lies in itself: hence the allocator by value. */
static inline void raindrop__release(sat_allocator memory, void *block, size_t bytes)
{
    sat__release(&memory, block, bytes);
}

/* ---- vectors and clamps */

static inline float raindrop__dot(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void raindrop__set(float out[3], float x, float y, float z)
{
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

/* out = a x + b y */
static inline void raindrop__combine(float out[3], float a, const float x[3], float b, const float y[3])
{
    raindrop__set(out, a * x[0] + b * y[0], a * x[1] + b * y[1], a * x[2] + b * y[2]);
}

static inline void raindrop__normalise(float v[3])
{
    float length = sqrtf(raindrop__dot(v, v)), scale = length > 0 ? 1 / length : 0;
    raindrop__set(v, v[0] * scale, v[1] * scale, v[2] * scale);
}

static inline float raindrop__clamp(float v, float low, float high)
{
    return v > low ? v < high ? v : high : low;
} /* NaN: low */

static inline int raindrop__finite3(const float v[3])
{
    return sat__is_finite(v[0]) && sat__is_finite(v[1]) && sat__is_finite(v[2]);
}

/* Random bits for the i-th number of a stream: the same on CPU and GPU, in any order (a mixing of 32-bit words by
   multiplication and shifts, after Wellons' lowbias32). */
static inline uint32_t raindrop__mix(uint32_t v)
{
    v = (v ^ (v >> 16)) * 0x7feb352du;
    v = (v ^ (v >> 15)) * 0x846ca68bu;
    return v ^ (v >> 16);
}
static inline uint32_t raindrop__hash(uint32_t seed, uint32_t stream, uint32_t i)
{
    return raindrop__mix(i ^ raindrop__mix(stream ^ raindrop__mix(seed ^ 0x9e3779b9u)));
}
static inline float raindrop__uniform(uint32_t bits)
{
    return ((float)(bits >> 9) + 0.5f) * (1.0f / 8388608.0f);
} /* (0, 1) */

/* ---- as many floats at a time as the compiler was told to use; one function a sum, the same text for all widths */

#if defined(SAT__AVX2)
enum { RAINDROP__LANES = 8 };
typedef __m256 raindrop__v;
#define RAINDROP__OF(eight, four) eight
static inline raindrop__v raindrop__abs(raindrop__v a) { return _mm256_andnot_ps(_mm256_set1_ps(-0.0f), a); }
static inline raindrop__v raindrop__if_less(raindrop__v a, raindrop__v b, raindrop__v yes, raindrop__v no)
{
    return _mm256_blendv_ps(no, yes, _mm256_cmp_ps(a, b, _CMP_LT_OQ));
}
#else
enum { RAINDROP__LANES = 4 };
typedef sat__f32x4 raindrop__v;
#define RAINDROP__OF(eight, four) four
static inline raindrop__v raindrop__abs(raindrop__v a) { return sat__f32x4_abs(a); }
static inline raindrop__v raindrop__if_less(raindrop__v a, raindrop__v b, raindrop__v yes, raindrop__v no)
{
    return sat__f32x4_select(sat__f32x4_less(a, b), yes, no);
}
#endif
static inline raindrop__v raindrop__load(const float *p) { return RAINDROP__OF(_mm256_loadu_ps, sat__f32x4_load)(p); }
static inline void raindrop__store(float *p, raindrop__v v) { RAINDROP__OF(_mm256_storeu_ps, sat__f32x4_store)(p, v); }
static inline raindrop__v raindrop__splat(float v) { return RAINDROP__OF(_mm256_set1_ps, sat__f32x4_set1)(v); }
static inline raindrop__v raindrop__sqrt(raindrop__v a) { return RAINDROP__OF(_mm256_sqrt_ps, sat__f32x4_sqrt)(a); }
#define RAINDROP__OPERATION(name, eight, four)                                                                         \
    static inline raindrop__v name(raindrop__v a, raindrop__v b) { return RAINDROP__OF(eight, four)(a, b); }
RAINDROP__OPERATION(raindrop__add, _mm256_add_ps, sat__f32x4_add)
RAINDROP__OPERATION(raindrop__sub, _mm256_sub_ps, sat__f32x4_sub)
RAINDROP__OPERATION(raindrop__mul, _mm256_mul_ps, sat__f32x4_mul)
RAINDROP__OPERATION(raindrop__div, _mm256_div_ps, sat__f32x4_div)
RAINDROP__OPERATION(raindrop__min, _mm256_min_ps, sat__f32x4_min)
RAINDROP__OPERATION(raindrop__max, _mm256_max_ps, sat__f32x4_max)

/* ------------------------------------------------------------------------------------------------
   >> options   tables of defaults and ranges, and what X_explain says; each function here writes one sentence about
                what is wrong and returns whether nothing is
   ------------------------------------------------------------------------------------------------ */

static inline int raindrop__fields_are_valid(sat__text *t, const void *options, const sat__field *fields, int count)
{
    const sat__field *wrong = sat__fields_check(options, fields, count);
    if (wrong) sat__text_field(t, wrong, options);
    return !wrong;
}

static inline int raindrop__vector_is_valid(sat__text *t, const char *name, const float v[3], double low, double high)
{
    int i;
    for (i = 0; i < 3; i++) {
        if (sat__is_finite(v[i]) && v[i] >= (float)low && v[i] <= (float)high) continue;
        sat__text_add(t, name);
        sat__text_range(t, i == 0 ? "[0]" : i == 1 ? "[1]" : "[2]", (double)v[i], low, high, ' ');
        return 0;
    }
    return 1;
}

static inline int raindrop__say(sat__text *t, const char *words)
{
    sat__text_add(t, words);
    return 0;
}

static inline int raindrop__int_is_valid(sat__text *t, const char *name, int v, int low, int high, char also)
{
    if (v >= low && v <= high && (also != '2' || !(v & (v - 1)))) return 1;
    sat__text_range(t, name, v, low, high, also);
    return 0;
}

#ifndef RAINDROP_NO_MAP
static const sat__field raindrop__map_fields[] = {
    SAT__FIELD(raindrop_map_options, 'i', resolution, 1024, 1, 4096, '2'),
    SAT__FIELD(raindrop_map_options, 'i', alpha_samples, 32, 1, 4096, ' '),
    SAT__FIELD(raindrop_map_options, 'f', n, 1.33, 0.1, 10, ' '),
    SAT__FIELD(raindrop_map_options, 'a', allocator, 0, 0, 0, ' '),
};

RAINDROP_DEF raindrop_map_options raindrop_map_defaults(void)
{
    raindrop_map_options o;
    sat__fields_default(&o, sizeof o, raindrop__map_fields, SAT__COUNT(raindrop__map_fields));
    return o;
}

RAINDROP_DEF const char *raindrop_explain_map(char *text, size_t size, const raindrop_map_options *options)
{
    sat__text t = sat__text_begin(text, size);
    if (options) raindrop__fields_are_valid(&t, options, raindrop__map_fields, SAT__COUNT(raindrop__map_fields));
    return text;
}
#endif

#define RAINDROP__MOST_LIGHT 1e36 /* in an environment: sums of some more do not overflow */
#define RAINDROP__MAX_DROPS 33554432

static const sat__field raindrop__environment_fields[] = {
    SAT__FIELD(raindrop_environment_options, 'i', layout, RAINDROP_LAYOUT_EQUIRECT, 0, RAINDROP_LAYOUT_CUBE, ' '),
    SAT__FIELD(raindrop_environment_options, 'i', filter, RAINDROP_FILTER_MIPS, 0, RAINDROP_FILTER_SAT, ' '),
    SAT__FIELD(raindrop_environment_options, 'i', resolution, 0, 0, 4096, '2'),
    SAT__FIELD(raindrop_environment_options, 'i', far_resolution, 64, 8, 256, '2'),
    SAT__FIELD(raindrop_environment_options, 'i', far_samples, 256, 16, 65536, ' '),
    SAT__FIELD(raindrop_environment_options, 'i', far_orders, 1, 0, 3, ' '),
    SAT__FIELD(raindrop_environment_options, 'f', n, 1.33, 0.1, 10, ' '),
    SAT__FIELD(raindrop_environment_options, 'f', scale, 1, 1e-18, 1e18, ' '),
    SAT__FIELD(raindrop_environment_options, 'i', decode_srgb, 0, 0, 1, ' '),
    SAT__FIELD(raindrop_environment_options, 'f', max_radiance, 0, 0, RAINDROP__MOST_LIGHT, ' '),
    SAT__FIELD(raindrop_environment_options, 'f', bow_optical_depth, 0, 0, 10, ' '),
    SAT__FIELD(raindrop_environment_options, 'i', far_swing, 0, 0, 1, ' '),
    SAT__FIELD(raindrop_environment_options, 'i', bow_by_depth, 0, 0, 1, ' '),
    SAT__FIELD(raindrop_environment_options, 'd', bow_drop_mm, 0, 0.05, 6, '0'),
    SAT__FIELD(raindrop_environment_options, 'a', allocator, 0, 0, 0, ' '),
    SAT__FIELD(raindrop_environment_options, 't', threads, 0, 0, 0, ' '),
};

RAINDROP_DEF raindrop_environment_options raindrop_environment_defaults(void)
{
    raindrop_environment_options o;
    sat__fields_default(&o, sizeof o, raindrop__environment_fields, SAT__COUNT(raindrop__environment_fields));
    o.sun_direction[1] = 1;
    o.sun_irradiance[0] = o.sun_irradiance[1] = o.sun_irradiance[2] = 1;
    return o;
}

static inline int raindrop__sun_is_valid(sat__text *t, const raindrop_environment_options *o)
{
    float sun2 = raindrop__dot(o->sun_direction, o->sun_direction);
    if (!raindrop__vector_is_valid(t, "sun_direction", o->sun_direction, -1e18, 1e18)) return 0;
    if (!raindrop__vector_is_valid(t, "sun_irradiance", o->sun_irradiance, 0, 1e30)) return 0;
    if ((o->bow_optical_depth > 0 || o->bow_by_depth) && !(sun2 > 0.99f && sun2 < 1.01f))
        return raindrop__say(t, "sun_direction is no unit vector, which bows need");
#ifdef RAINDROP_NO_BOW
    if (o->bow_optical_depth > 0 || o->bow_by_depth)
        return raindrop__say(t, "bow_optical_depth or bow_by_depth is above 0; RAINDROP_NO_BOW left them out");
#endif
    return 1;
}

static inline int raindrop__environment_is_valid(sat__text *t, const sat_image *image,
                                                 const raindrop_environment_options *o)
{
    if (!sat__image_is_valid(image)) {
        sat_explain_image(t->at, t->size, image);
        return 0;
    }
    if (image->channels == 2) return raindrop__say(t, "image.channels is 2; 1, 3 or 4");
    if (!raindrop__int_is_valid(t, "image.width", image->width, 1, 32768, ' ')) return 0;
    if (!raindrop__int_is_valid(t, "image.height", image->height, 1, 65536, ' ')) return 0;
    if (!raindrop__fields_are_valid(t, o, raindrop__environment_fields, SAT__COUNT(raindrop__environment_fields)))
        return 0;
    if (o->resolution && o->resolution < 16) {
        sat__text_range(t, "resolution", o->resolution, 16, 4096, '0');
        return 0;
    }
    if (o->layout == RAINDROP_LAYOUT_CUBE && image->height != 6 * image->width)
        return raindrop__say(t, "image.height is not 6 times its width, as layout says");
    if (o->layout == RAINDROP_LAYOUT_CUBE && o->filter == RAINDROP_FILTER_SAT)
        return raindrop__say(t, "filter is RAINDROP_FILTER_SAT, which takes RAINDROP_LAYOUT_EQUIRECT only");
    return raindrop__sun_is_valid(t, o);
}

RAINDROP_DEF const char *raindrop_explain_environment(char *text, size_t size, const sat_image *image,
                                                      const raindrop_environment_options *options)
{
    const raindrop_environment_options o = options ? *options : raindrop_environment_defaults();
    sat__text t = sat__text_begin(text, size);
    raindrop__environment_is_valid(&t, image, &o);
    return text;
}


static const sat__field raindrop__rain_fields[] = {
    SAT__FIELD(raindrop_rain_options, 'd', rate_mm_h, 10, 0.01, 500, ' '),
    SAT__FIELD(raindrop_rain_options, 'i', count, 0, 0, RAINDROP__MAX_DROPS, ' '),
    SAT__FIELD(raindrop_rain_options, 'd', diameter_mm, 0, 0.001, 6, '0'),
    SAT__FIELD(raindrop_rain_options, 'd', diameter_min_mm, 0.1, 0.001, 6, ' '),
    SAT__FIELD(raindrop_rain_options, 'd', diameter_max_mm, 6, 0.001, 6, ' '),
    SAT__FIELD(raindrop_rain_options, 'f', speed, 0, 0, 1e18, ' '),
    SAT__FIELD(raindrop_rain_options, 'i', oblate, 0, 0, 1, ' '),
    SAT__FIELD(raindrop_rain_options, 'a', allocator, 0, 0, 0, ' '),
    SAT__FIELD(raindrop_rain_options, 't', threads, 0, 0, 0, ' '),
};

RAINDROP_DEF raindrop_rain_options raindrop_rain_defaults(void)
{
    raindrop_rain_options o;
    sat__fields_default(&o, sizeof o, raindrop__rain_fields, SAT__COUNT(raindrop__rain_fields));
    raindrop__set(o.box_size, 8, 8, 8);
    o.seed = 1;
    return o;
}

static inline int raindrop__rain_is_valid(sat__text *t, const raindrop_rain_options *o)
{
    if (!raindrop__fields_are_valid(t, o, raindrop__rain_fields, SAT__COUNT(raindrop__rain_fields))) return 0;
    if (!(o->diameter_min_mm < o->diameter_max_mm))
        return raindrop__say(t, "diameter_min_mm is not below diameter_max_mm");
#ifdef RAINDROP_NO_RAIN
    if (!o->drops) return raindrop__say(t, "drops is NULL; RAINDROP_NO_RAIN left out all but drops of your own");
#endif
    return raindrop__vector_is_valid(t, "box_size", o->box_size, 1e-6, 1e18) &&
           raindrop__vector_is_valid(t, "centre", o->centre, -1e30, 1e30) &&
           raindrop__vector_is_valid(t, "wind", o->wind, -1e18, 1e18);
}

RAINDROP_DEF const char *raindrop_explain_rain(char *text, size_t size, const raindrop_rain_options *options)
{
    sat__text t = sat__text_begin(text, size);
    if (options) raindrop__rain_is_valid(&t, options);
    return text;
}

static const sat__field raindrop__camera_fields[] = {
    SAT__FIELD(raindrop_camera, 'f', fov_y, 1.5707963267948966, 0.001, 3, ' '),
    SAT__FIELD(raindrop_camera, 'f', depth_near, 0.01, 0, 1e18, ' '),
    SAT__FIELD(raindrop_camera, 'f', depth_far, 0, 0, 1e18, ' '),
    SAT__FIELD(raindrop_camera, 'f', exposure, 0, 0, 1e18, ' '),
    SAT__FIELD(raindrop_camera, 'f', aperture, 0, 0, 1e18, ' '),
    SAT__FIELD(raindrop_camera, 'f', focus_distance, 3, 1e-18, 1e18, ' '),
};

RAINDROP_DEF raindrop_camera raindrop_camera_defaults(void)
{
    raindrop_camera camera;
    sat__fields_default(&camera, sizeof camera, raindrop__camera_fields, SAT__COUNT(raindrop__camera_fields));
    camera.right[0] = camera.up[1] = camera.back[2] = 1;
    return camera;
}

static inline int raindrop__camera_is_valid(sat__text *t, const raindrop_camera *c)
{
    float rr = raindrop__dot(c->right, c->right), uu = raindrop__dot(c->up, c->up),
          bb = raindrop__dot(c->back, c->back);
    float skew = fabsf(raindrop__dot(c->right, c->up)) + fabsf(raindrop__dot(c->up, c->back)) +
                 fabsf(raindrop__dot(c->back, c->right));
    if (!raindrop__vector_is_valid(t, "position", c->position, -1e38, 1e38)) return 0;
    if (!raindrop__vector_is_valid(t, "velocity", c->velocity, -1e38, 1e38)) return 0;
    if (!(fabsf(rr - 1) < 0.01f && fabsf(uu - 1) < 0.01f && fabsf(bb - 1) < 0.01f && skew < 0.01f))
        return raindrop__say(t, "right, up and back are not orthonormal");
    if (c->depth_far > 0 && !(c->depth_near > 0 && c->depth_far > c->depth_near))
        return raindrop__say(t, "depth_far is above 0 but not above a depth_near above 0");
#ifdef RAINDROP_NO_STREAK
    if (c->exposure > 0 || c->aperture > 0)
        return raindrop__say(t, "exposure or aperture is above 0; RAINDROP_NO_STREAK left them out");
#endif
    return raindrop__fields_are_valid(t, c, raindrop__camera_fields, SAT__COUNT(raindrop__camera_fields));
}

RAINDROP_DEF const char *raindrop_explain_camera(char *text, size_t size, const raindrop_camera *camera)
{
    sat__text t = sat__text_begin(text, size);
    if (camera) raindrop__camera_is_valid(&t, camera);
    return text;
}

static const sat__field raindrop__render_fields[] = {
    SAT__FIELD(raindrop_render_options, 'i', look, RAINDROP_LOOK_AUTO, 0, RAINDROP_LOOK_AUTO, ' '),
    SAT__FIELD(raindrop_render_options, 'f', far_radius, 1.5, 0, 64, ' '),
    SAT__FIELD(raindrop_render_options, 'f', coverage_threshold, 0.0001, 0, 1, ' '),
    SAT__FIELD(raindrop_render_options, 'i', orders, 1, 0, 3, ' '),
    SAT__FIELD(raindrop_render_options, 'i', exit_fresnel, 0, 0, 1, ' '),
    SAT__FIELD(raindrop_render_options, 'f', orders_radius, 8, 0, 1e18, ' '),
    SAT__FIELD(raindrop_render_options, 'i', sort, 1, 0, 1, ' '),
    SAT__FIELD(raindrop_render_options, 'i', slices, 1, 1, 64, ' '),
    SAT__FIELD(raindrop_render_options, 'f', oscillation, 0, 0, 0.25, ' '),
    SAT__FIELD(raindrop_render_options, 'i', lamp_count, 0, 0, 16, ' '),
};

static const sat__field raindrop__lamp_fields[] = {
    SAT__FIELD(raindrop_lamp, 'f', radius, 0.1, 0, 1e18, ' '),
    SAT__FIELD(raindrop_lamp, 'f', inner, RAINDROP__PI, 0, 3.1416, ' '),
    SAT__FIELD(raindrop_lamp, 'f', outer, RAINDROP__PI, 0, 3.1416, ' '),
};

RAINDROP_DEF raindrop_lamp raindrop_lamp_defaults(void)
{
    raindrop_lamp lamp;
    sat__fields_default(&lamp, sizeof lamp, raindrop__lamp_fields, SAT__COUNT(raindrop__lamp_fields));
    raindrop__set(lamp.intensity, 1, 1, 1);
    lamp.direction[1] = -1;
    return lamp;
}

static inline int raindrop__lamp_is_valid(sat__text *t, const raindrop_lamp *lamp)
{
    float d2 = raindrop__dot(lamp->direction, lamp->direction);
    if (!raindrop__vector_is_valid(t, "position", lamp->position, -1e18, 1e18)) return 0;
    if (!raindrop__vector_is_valid(t, "intensity", lamp->intensity, 0, 1e18)) return 0;
    if (!raindrop__vector_is_valid(t, "direction", lamp->direction, -2, 2)) return 0;
    if (!(d2 > 0.99f && d2 < 1.01f)) return raindrop__say(t, "direction is no unit vector");
    if (!raindrop__fields_are_valid(t, lamp, raindrop__lamp_fields, SAT__COUNT(raindrop__lamp_fields))) return 0;
    return lamp->outer >= lamp->inner ? 1 : raindrop__say(t, "outer is below inner");
}

RAINDROP_DEF const char *raindrop_explain_lamp(char *text, size_t size, const raindrop_lamp *lamp)
{
    sat__text t = sat__text_begin(text, size);
    if (lamp) raindrop__lamp_is_valid(&t, lamp);
    else raindrop__say(&t, "lamp is NULL");
    return text;
}

RAINDROP_DEF raindrop_render_options raindrop_render_defaults(void)
{
    raindrop_render_options o;
    sat__fields_default(&o, sizeof o, raindrop__render_fields, SAT__COUNT(raindrop__render_fields));
    return o;
}

static inline int raindrop__size_is_valid(sat__text *t, int width, int height)
{
    return raindrop__int_is_valid(t, "width", width, 1, 32768, ' ') &&
           raindrop__int_is_valid(t, "height", height, 1, 32768, ' ');
}

static inline int raindrop__picture_is_valid(sat__text *t, ptrdiff_t stride, int width, int height)
{
    float aligned = 0;
    if (!raindrop__size_is_valid(t, width, height)) return 0;
    if (stride % (ptrdiff_t)sizeof(float)) return raindrop__say(t, "stride is not a multiple of 4 bytes");
    if (sat__rows_are_valid(&aligned, &stride, width, height, 3 * sizeof(float), sizeof(float))) return 1;
    return raindrop__say(t, "stride is shorter than a row");
}

static inline int raindrop__render_is_valid(sat__text *t, const raindrop_render_options *o)
{
    int i;
    if (!raindrop__fields_are_valid(t, o, raindrop__render_fields, SAT__COUNT(raindrop__render_fields))) return 0;
#ifdef RAINDROP_NO_MAP
    if (o->look == RAINDROP_LOOK_MAP) return raindrop__say(t, "RAINDROP_LOOK_MAP: RAINDROP_NO_MAP left it out");
#endif
    if (o->lamp_count > 0 && !o->lamps) return raindrop__say(t, "lamps is NULL, and lamp_count above 0");
    for (i = 0; i < o->lamp_count; i++)
        if (!raindrop__lamp_is_valid(t, &o->lamps[i])) return 0;
    return 1;
}

RAINDROP_DEF const char *raindrop_explain_render(char *text, size_t size, ptrdiff_t stride, int width, int height,
                                                 const raindrop_camera *camera, const raindrop_render_options *options)
{
    const raindrop_camera c = camera ? *camera : raindrop_camera_defaults();
    const raindrop_render_options o = options ? *options : raindrop_render_defaults();
    sat__text t = sat__text_begin(text, size);
    if (raindrop__picture_is_valid(&t, stride, width, height) && raindrop__camera_is_valid(&t, &c) &&
        raindrop__render_is_valid(&t, &o) && o.look == RAINDROP_LOOK_MAP && !o.map)
        raindrop__say(&t, "map is NULL, which RAINDROP_LOOK_MAP needs");
    return text;
}

static const sat__field raindrop__veil_fields[] = {
    SAT__FIELD(raindrop_veil_options, 'f', extinction, 0.00069, 0, 1e18, ' '),
    SAT__FIELD(raindrop_veil_options, 'f', from, 4, 0, 1e18, ' '),
    SAT__FIELD(raindrop_veil_options, 'f', reach, 1000, 0, 1e18, ' '),
    SAT__FIELD(raindrop_veil_options, 'i', clip_zero_to_one, 0, 0, 1, ' '),
    SAT__FIELD(raindrop_veil_options, 't', threads, 0, 0, 0, ' '),
};

RAINDROP_DEF raindrop_veil_options raindrop_veil_defaults(void)
{
    raindrop_veil_options o;
    sat__fields_default(&o, sizeof o, raindrop__veil_fields, SAT__COUNT(raindrop__veil_fields));
    return o;
}

RAINDROP_DEF const char *raindrop_explain_veil(char *text, size_t size, const raindrop_veil_options *options)
{
    sat__text t = sat__text_begin(text, size);
    if (options) raindrop__fields_are_valid(&t, options, raindrop__veil_fields, SAT__COUNT(raindrop__veil_fields));
    return text;
}

/* ------------------------------------------------------------------------------------------------
   >> one drop   one ray through it

   In the plane of incidence sin i = b and sin r = b/n. Each refraction turns the ray by i - r towards the axis and each
   internal reflection by pi - 2r; the mirrored ray turns by pi - 2i. None of it depends on the distance of the eye, and
   with ci = cos i = sqrt(1 - b^2) and cr = cos r it needs no angle:

       sin(i-r) = b (cr - ci/n) = b sd,      cos(i-r) = ci cr + b^2/n = cd
       refracted = (1 - 2 b^2 sd^2) d - 2 sd cd p,      reflected = (2b^2 - 1) d + 2 ci p

   where 1 - 2 b^2 sd^2 is cos 2(i-r), written so that n = 1 gives d itself. The exit has the entry's Fresnel factors.

   A pencil of rays widens by the derivative of the angle turned along the radius and by sin(angle)/b across it. The
   footprint is their geometric mean, which keeps the pencil's solid angle: 2 for the mirrored ray, everywhere (a ball
   scatters evenly), and finite enough at the rim that a lookup there does not gather the whole sky.
   ------------------------------------------------------------------------------------------------ */

/* The angles of one ray as above; what both the single ray and the orders need. */
typedef struct raindrop__optics {
    float b2, ci, cr, sd, cd;
    float fs, fp;           /* Fresnel reflectances of the two polarisations */
    float per_ci, per_n_cr; /* 1/ci and 1/(n cr): d(i)/db and d(r)/db */
    int total;              /* totally reflected */
} raindrop__optics;

#define RAINDROP__TINY 1e-12f /* keeps 0/0 away at the rim when n = 1 */
#define RAINDROP__RIM 1e-6f   /* bounds 1/cos at the rim */
#define RAINDROP__INNER 0.999f /* rays beyond it are moved to it, this side of the rim */

static inline raindrop__optics raindrop__refract(float one_minus_b2, float n)
{
    raindrop__optics o;
    float per_n = 1 / n, inside, a, c;
    one_minus_b2 = raindrop__clamp(one_minus_b2, 0, 1);
    o.b2 = 1 - one_minus_b2;
    inside = (one_minus_b2 + (n - 1) * (n + 1)) * per_n * per_n; /* 1 - b^2/n^2; below 0: totally reflected */
    o.ci = sqrtf(one_minus_b2);
    o.total = inside <= 0 && n < 1;
    o.cr = inside > 0 ? sqrtf(inside) : 0;
    o.cd = o.ci * o.cr + o.b2 * per_n;
    o.sd = o.cr - o.ci * per_n;
    a = (o.ci - n * o.cr) / (o.ci + n * o.cr + RAINDROP__TINY);
    c = (n * o.ci - o.cr) / (n * o.ci + o.cr + RAINDROP__TINY);
    o.fs = o.total ? 1 : a * a;
    o.fp = o.total ? 1 : c * c;
    o.per_ci = 1 / (o.ci + RAINDROP__RIM);
    o.per_n_cr = 1 / (n * o.cr + RAINDROP__RIM);
    return o;
}

RAINDROP_DEF void raindrop_trace(raindrop_ray *out, const float direction[3], const float centre_offset[3],
                                 float one_minus_b2, float n)
{
    raindrop__optics o = raindrop__refract(one_minus_b2, n);
    if (!out || !direction || !centre_offset) return;
    raindrop__combine(out->reflected, 2 * o.b2 - 1, direction, 2 * o.ci, centre_offset);
    if (o.total) raindrop__set(out->refracted, out->reflected[0], out->reflected[1], out->reflected[2]);
    else raindrop__combine(out->refracted, 1 - 2 * o.b2 * o.sd * o.sd, direction, -2 * o.sd * o.cd, centre_offset);
    out->fresnel = 0.5f * (o.fs + o.fp);
    out->transmit = 0.5f * ((1 - o.fs) * (1 - o.fs) + (1 - o.fp) * (1 - o.fp));
    out->footprint_reflected = 2;
    out->footprint_refracted = o.total ? 2 : 2 * sqrtf(fabsf((o.per_ci - o.per_n_cr) * o.sd * o.cd));
}

/* The same for RAINDROP__LANES rays, without branches: a totally reflected lane takes its values by selection. */
typedef struct raindrop__rays {
    raindrop__v reflected[3], refracted[3], fresnel, transmit, footprint_reflected, footprint_refracted;
} raindrop__rays;

/* GCC at -O2 leaves a function of this size and its vectors in memory: 1.4 to 1.8 times as long. */
#if defined(__GNUC__)
#define RAINDROP__INLINE static inline __attribute__((always_inline))
#define RAINDROP__APART static __attribute__((noinline)) /* options that are off must not crowd the loops of the usual */
#else
#define RAINDROP__INLINE static inline
#define RAINDROP__APART static inline
#endif

/* a x + b y */
static inline raindrop__v raindrop__sum(raindrop__v a, raindrop__v x, raindrop__v b, raindrop__v y)
{
    return raindrop__add(raindrop__mul(a, x), raindrop__mul(b, y));
}

RAINDROP__INLINE void raindrop__trace_v(raindrop__rays *out, const raindrop__v d[3], const raindrop__v p[3],
                                        raindrop__v one_minus_b2, float n)
{
    const raindrop__v zero = raindrop__splat(0), one = raindrop__splat(1), two = raindrop__splat(2),
                      per_n = raindrop__splat(1 / n);
    const raindrop__v index = raindrop__splat(n), tiny = raindrop__splat(RAINDROP__TINY),
                      rim = raindrop__splat(RAINDROP__RIM);
    const raindrop__v total_below = raindrop__splat(n < 1 ? 0 : -1.0f);
    raindrop__v m = raindrop__min(raindrop__max(one_minus_b2, zero), one), b2 = raindrop__sub(one, m);
    raindrop__v inside =
        raindrop__mul(raindrop__add(m, raindrop__splat((n - 1) * (n + 1))), raindrop__mul(per_n, per_n));
    raindrop__v ci = raindrop__sqrt(m), cr = raindrop__sqrt(raindrop__max(inside, zero));
    raindrop__v cd = raindrop__add(raindrop__mul(ci, cr), raindrop__mul(b2, per_n)),
                sd = raindrop__sub(cr, raindrop__mul(ci, per_n));
    raindrop__v n_cr = raindrop__mul(index, cr), n_ci = raindrop__mul(index, ci);
    /* four quotients by one division */
    raindrop__v sum_s = raindrop__add(raindrop__add(ci, n_cr), tiny),
                sum_p = raindrop__add(raindrop__add(n_ci, cr), tiny);
    raindrop__v both = raindrop__mul(sum_s, sum_p),
                cosines = raindrop__mul(raindrop__add(ci, rim), raindrop__add(n_cr, rim));
    raindrop__v per_all = raindrop__div(one, raindrop__mul(both, cosines)), per_both = raindrop__mul(per_all, cosines);
    raindrop__v less = raindrop__sub(ci, n_cr), a = raindrop__mul(raindrop__mul(less, sum_p), per_both);
    raindrop__v c = raindrop__mul(raindrop__mul(raindrop__sub(n_ci, cr), sum_s), per_both);
    raindrop__v below = raindrop__sub(inside, tiny); /* so that 0 itself counts as totally reflected when n < 1 */
    raindrop__v fs = raindrop__if_less(below, total_below, one, raindrop__mul(a, a));
    raindrop__v fp = raindrop__if_less(below, total_below, one, raindrop__mul(c, c));
    raindrop__v along = raindrop__sub(one, raindrop__mul(raindrop__mul(two, b2), raindrop__mul(sd, sd)));
    raindrop__v across = raindrop__mul(raindrop__mul(raindrop__splat(-2), sd), cd);
    raindrop__v mirror = raindrop__sub(raindrop__mul(two, b2), one), outward = raindrop__mul(two, ci);
    raindrop__v widening = raindrop__mul(raindrop__mul(less, raindrop__mul(per_all, both)), raindrop__mul(sd, cd));
    raindrop__v ts = raindrop__sub(one, fs), tp = raindrop__sub(one, fp);
    along = raindrop__if_less(below, total_below, mirror, along);
    across = raindrop__if_less(below, total_below, outward, across);
    out->reflected[0] = raindrop__sum(mirror, d[0], outward, p[0]);
    out->reflected[1] = raindrop__sum(mirror, d[1], outward, p[1]);
    out->reflected[2] = raindrop__sum(mirror, d[2], outward, p[2]);
    out->refracted[0] = raindrop__sum(along, d[0], across, p[0]);
    out->refracted[1] = raindrop__sum(along, d[1], across, p[1]);
    out->refracted[2] = raindrop__sum(along, d[2], across, p[2]);
    out->fresnel = raindrop__mul(raindrop__splat(0.5f), raindrop__add(fs, fp));
    out->transmit = raindrop__mul(raindrop__splat(0.5f), raindrop__add(raindrop__mul(ts, ts), raindrop__mul(tp, tp)));
    out->footprint_reflected = two;
    out->footprint_refracted = raindrop__mul(two, raindrop__sqrt(raindrop__abs(widening)));
    out->footprint_refracted = raindrop__if_less(below, total_below, two, out->footprint_refracted);
}

static inline void raindrop__keep(float *out, int at, raindrop__v v)
{
    if (out) raindrop__store(out + at, v);
}

RAINDROP__INLINE void raindrop__trace_block(const raindrop_ray_outputs *out, const raindrop_ray_inputs *in, int at,
                                            float n)
{
    raindrop__v d[3], p[3];
    raindrop__rays rays;
    int i;
    for (i = 0; i < 3; i++) {
        d[i] = raindrop__load(in->direction[i] + at);
        p[i] = raindrop__load(in->centre_offset[i] + at);
    }
    raindrop__trace_v(&rays, d, p, raindrop__load(in->one_minus_b2 + at), n);
    for (i = 0; i < 3; i++) {
        raindrop__keep(out->reflected[i], at, rays.reflected[i]);
        raindrop__keep(out->refracted[i], at, rays.refracted[i]);
    }
    raindrop__keep(out->fresnel, at, rays.fresnel);
    raindrop__keep(out->transmit, at, rays.transmit);
    raindrop__keep(out->footprint_reflected, at, rays.footprint_reflected);
    raindrop__keep(out->footprint_refracted, at, rays.footprint_refracted);
}

/* One ray of the arrays by itself: what is left after the last whole block. */
static inline void raindrop__trace_one(const raindrop_ray_outputs *out, const raindrop_ray_inputs *in, int at, float n)
{
    raindrop_ray ray;
    float d[3], p[3];
    int i;
    for (i = 0; i < 3; i++) {
        d[i] = in->direction[i][at];
        p[i] = in->centre_offset[i][at];
    }
    raindrop_trace(&ray, d, p, in->one_minus_b2[at], n);
    for (i = 0; i < 3; i++) {
        if (out->reflected[i]) out->reflected[i][at] = ray.reflected[i];
        if (out->refracted[i]) out->refracted[i][at] = ray.refracted[i];
    }
    if (out->fresnel) out->fresnel[at] = ray.fresnel;
    if (out->transmit) out->transmit[at] = ray.transmit;
    if (out->footprint_reflected) out->footprint_reflected[at] = ray.footprint_reflected;
    if (out->footprint_refracted) out->footprint_refracted[at] = ray.footprint_refracted;
}

RAINDROP_DEF void raindrop_trace_n(const raindrop_ray_outputs *out, const raindrop_ray_inputs *in, int count, float n)
{
    int at = 0, i;
    if (!out || !in || !in->one_minus_b2) return;
    for (i = 0; i < 3; i++)
        if (!in->direction[i] || !in->centre_offset[i]) return;
    for (; at + RAINDROP__LANES <= count; at += RAINDROP__LANES) raindrop__trace_block(out, in, at, n);
    for (; at < count; at++) raindrop__trace_one(out, in, at, n);
}

/* Order k turns the ray by 2(i-r) + k(pi-2r) towards the axis: a product of complex numbers of modulus 1. Of each
   polarisation it carries (1-F)^2 F^k, and (1-F) F^k together with all later orders. */
RAINDROP_DEF void raindrop_trace_order(raindrop_order *out, const float direction[3], const float centre_offset[3],
                                       float one_minus_b2, float n, int k)
{
    raindrop__optics o = raindrop__refract(one_minus_b2, n);
    /* re + i b im: the sine is kept divided by b, which is 0 at the centre */
    float re = 1 - 2 * o.b2 * o.sd * o.sd, im = 2 * o.sd * o.cd;
    float turn_re = 2 * o.b2 / (n * n) - 1, turn_im = 2 * o.cr / n, power_s = 1, power_p = 1;
    int i;
    if (!out || !direction || !centre_offset) return;
    if (k < 0) k = 0;
    for (i = 0; i < k; i++) {
        float next = re * turn_re - o.b2 * im * turn_im;
        im = im * turn_re + re * turn_im;
        re = next;
        power_s *= o.fs;
        power_p *= o.fp;
    }
    raindrop__combine(out->direction, re, direction, -im, centre_offset);
    out->rest = o.total ? 0 : 0.5f * ((1 - o.fs) * power_s + (1 - o.fp) * power_p);
    out->weight = o.total ? 0 : 0.5f * ((1 - o.fs) * (1 - o.fs) * power_s + (1 - o.fp) * (1 - o.fp) * power_p);
    out->footprint = sqrtf(fabsf(2 * (o.per_ci - (float)(k + 1) * o.per_n_cr) * im));
}

/* The point (s, t) of the silhouette disc lies at the tangent of its angle, tan(alpha) = |(s,t)| / sqrt(D^2-1), and
   1 - b^2 = (1 - s^2 - t^2) cos^2(alpha): no difference of large numbers (p = t d - c loses three digits at D =
   1000). */
RAINDROP_DEF void raindrop_sprite_ray(float direction[3], float centre_offset[3], float *one_minus_b2, float s, float t,
                                      float distance)
{
    double away = (double)distance, scale = 1 / sqrt((away - 1) * (away + 1)), x = (double)s, y = (double)t,
           rho2 = x * x + y * y, cos2;
    if (!direction || !centre_offset || !one_minus_b2) return;
    if (rho2 > 1) {
        scale /= sqrt(rho2);
        rho2 = 1;
    }
    x *= scale;
    y *= scale;
    cos2 = 1 / (1 + x * x + y * y);
    raindrop__set(direction, (float)(x * sqrt(cos2)), (float)(y * sqrt(cos2)), (float)-sqrt(cos2));
    /* p = q - (q.d) d for the point q = D (x, y, 0) of the ray beside the centre */
    raindrop__set(centre_offset, (float)(away * x * cos2), (float)(away * y * cos2), (float)(away * (1 - cos2)));
    *one_minus_b2 = (float)((1 - rho2) * cos2);
}

/* ---- flattened drops: two quadric hits in the space where the drop is a sphere */

/* Snell's law: direction d meets the surface of unit normal `normal` (against d) from index 1 to index n; 0: totally
   reflected. */
static inline int raindrop__snell(float out[3], const float d[3], const float normal[3], float n)
{
    float ci = -raindrop__dot(d, normal), per_n = 1 / n, inside = 1 - (1 - ci * ci) * per_n * per_n;
    if (inside < 0) return 0;
    raindrop__combine(out, per_n, d, ci * per_n - sqrtf(inside), normal);
    return 1;
}

/* Fresnel's factors and the footprint of a ray through a drop whose entry has these cosines. */
static inline void raindrop__surface(raindrop_ray *out, float ci, float cr, float n)
{
    float a = (ci - n * cr) / (ci + n * cr + RAINDROP__TINY), c = (n * ci - cr) / (n * ci + cr + RAINDROP__TINY);
    float turn = (cr - ci / n) * (ci * cr + (1 - ci * ci) / n);
    out->fresnel = 0.5f * (a * a + c * c);
    out->transmit = 0.5f * ((1 - a * a) * (1 - a * a) + (1 - c * c) * (1 - c * c));
    out->footprint_refracted = 2 * sqrtf(fabsf((1 / (ci + RAINDROP__RIM) - 1 / (n * cr + RAINDROP__RIM)) * turn));
}

RAINDROP_DEF int raindrop_trace_spheroid(raindrop_ray *out, const float direction[3], const float centre_offset[3],
                                         float axis_ratio, float n)
{
    float stretch = 1 / axis_ratio, d2, along, half, ci, q[3], hit[3], normal[3], inner[3], leave[3], unit[3];
    if (!out || !direction || !centre_offset) return 0;
    /* in the stretched space: ray q + t unit, sphere of radius 1 */
    raindrop__set(unit, direction[0], direction[1] * stretch, direction[2]);
    d2 = raindrop__dot(unit, unit);
    raindrop__set(q, centre_offset[0], centre_offset[1] * stretch, centre_offset[2]);
    along = raindrop__dot(q, unit) / d2;
    raindrop__combine(q, 1, q, -along, unit);
    half = 1 - raindrop__dot(q, q);
    if (!(half >= 0) || !(axis_ratio > 0)) return 0;
    raindrop__combine(hit, 1, q, -sqrtf(half / d2), unit);
    raindrop__set(normal, hit[0], hit[1] * stretch, hit[2]);
    raindrop__normalise(normal);
    ci = -raindrop__dot(direction, normal);
    raindrop__combine(out->reflected, 1, direction, 2 * ci, normal);
    out->footprint_reflected = 2;
    if (!raindrop__snell(inner, direction, normal, n)) {
        raindrop__set(out->refracted, out->reflected[0], out->reflected[1], out->reflected[2]);
        out->fresnel = 1;
        out->transmit = 0;
        out->footprint_refracted = 2;
        return 1;
    }
    raindrop__surface(out, ci, -raindrop__dot(inner, normal), n);
    /* the far hit, then out: the normal now points inwards */
    raindrop__set(unit, inner[0], inner[1] * stretch, inner[2]);
    along = -2 * raindrop__dot(hit, unit) / raindrop__dot(unit, unit);
    raindrop__combine(hit, 1, hit, along, unit);
    raindrop__set(normal, -hit[0], -hit[1] * stretch, -hit[2]);
    raindrop__normalise(normal);
    if (!raindrop__snell(leave, inner, normal, 1 / n)) { /* the rim of a flat drop: mirrored inside, rare; straight
                                                            on */
        out->transmit = 0;
        raindrop__set(leave, inner[0], inner[1], inner[2]);
    }
    raindrop__set(out->refracted, leave[0], leave[1], leave[2]);
    return 1;
}

/* ------------------------------------------------------------------------------------------------
   >> maps   as published
   ------------------------------------------------------------------------------------------------ */

#ifndef RAINDROP_NO_MAP
struct raindrop_map {
    int base, levels;
    float n;
    const float *level[13];
    sat_allocator allocator;
    void *block;
    size_t bytes;
};

/* tan(theta_i) = 2^-i, so that the drop fills the picture: D_i = 1/sin(theta_i) */
RAINDROP_DEF double raindrop_map_distance(int level) { return sqrt(1 + ldexp(1.0, 2 * level)); }

/* Share of a texel of half width h around (s, t) that the unit disc covers: 1 or 0, or counted where the rim passes. */
static inline float raindrop__map_alpha(float s, float t, float h, int samples, uint32_t stream)
{
    float near_s = fabsf(s) > h ? fabsf(s) - h : 0, near_t = fabsf(t) > h ? fabsf(t) - h : 0, far_s = fabsf(s) + h,
          far_t = fabsf(t) + h;
    int i, covered = 0;
    if (near_s * near_s + near_t * near_t >= 1) return 0;
    if (far_s * far_s + far_t * far_t <= 1) return 1;
    for (i = 0; i < samples; i++) {
        float a = s + h * (2 * raindrop__uniform(raindrop__hash(1, stream, 2 * (uint32_t)i)) - 1);
        float b = t + h * (2 * raindrop__uniform(raindrop__hash(1, stream, 2 * (uint32_t)i + 1)) - 1);
        covered += a * a + b * b < 1;
    }
    return (float)covered / (float)samples;
}

/* A texel holds the vectors of its centre (moved to the rim where the centre misses the drop) and its alpha. */
static inline void raindrop__map_fill(float *texels, int resolution, int level, float n, int alpha_samples)
{
    float distance = (float)raindrop_map_distance(level), h = 1 / (float)resolution;
    int x, y;
    for (y = 0; y < resolution; y++) {
        for (x = 0; x < resolution; x++, texels += 8) {
            float s = (float)(2 * x + 1) * h - 1, t = (float)(2 * y + 1) * h - 1, d[3], p[3], m,
                  rho = sqrtf(s * s + t * t);
            float alpha =
                raindrop__map_alpha(s, t, h, alpha_samples, raindrop__hash((uint32_t)level, (uint32_t)x, (uint32_t)y));
            raindrop_ray ray;
            memset(texels, 0, 8 * sizeof *texels);
            if (!(alpha > 0)) continue;
            if (rho > 0.9999f) {
                s *= 0.9999f / rho;
                t *= 0.9999f / rho;
            }
            raindrop_sprite_ray(d, p, &m, s, t, distance);
            raindrop_trace(&ray, d, p, m, n);
            raindrop__set(texels, ray.reflected[0], ray.reflected[1], ray.reflected[2]);
            texels[3] = ray.fresnel;
            raindrop__set(texels + 4, ray.refracted[0], ray.refracted[1], ray.refracted[2]);
            texels[7] = alpha;
        }
    }
}

RAINDROP_DEF sat_result raindrop_map_create(raindrop_map **out, const raindrop_map_options *options)
{
    raindrop_map_options o = options ? *options : raindrop_map_defaults();
    sat__arena arena = {0, 0, 0};
    raindrop_map map;
    float *texels;
    size_t count = 0;
    sat_result result;
    int level, r;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    if (sat__fields_check(&o, raindrop__map_fields, SAT__COUNT(raindrop__map_fields))) return SAT_ERR_ARGUMENT;
    if (!sat__resolve_allocator(&map.allocator, &o.allocator)) return SAT_ERR_ARGUMENT;
    for (r = o.resolution; r; r >>= 1) count += (size_t)r * (size_t)r;
    sat__carve(&arena, 1, sizeof map);
    sat__carve(&arena, count, 8 * sizeof(float));
    result = sat__arena_allocate(&arena, &map.block, &map.bytes, &map.allocator);
    if (result != SAT_OK) return result;
    *out = (raindrop_map *)sat__carve(&arena, 1, sizeof map);
    texels = (float *)sat__carve(&arena, count, 8 * sizeof(float));
    map.base = o.resolution;
    map.n = o.n;
    for (level = 0, r = o.resolution; r; r >>= 1, level++) {
        map.level[level] = texels;
        raindrop__map_fill(texels, r, level, o.n, o.alpha_samples);
        texels += (size_t)r * (size_t)r * 8;
    }
    map.levels = level;
    **out = map;
    return SAT_OK;
}

RAINDROP_DEF void raindrop_map_destroy(raindrop_map *map)
{
    if (map) raindrop__release(map->allocator, map->block, map->bytes);
}

RAINDROP_DEF int raindrop_map_levels(const raindrop_map *map) { return map ? map->levels : 0; }

RAINDROP_DEF const float *raindrop_map_level(int *resolution, const raindrop_map *map, int level)
{
    if (!map || level < 0 || level >= map->levels) return NULL;
    if (resolution) *resolution = map->base >> (level);
    return map->level[level];
}

RAINDROP_DEF sat_result raindrop_map_level_half(uint16_t *out, const raindrop_map *map, int level)
{
    int resolution = 0;
    const float *texels = raindrop_map_level(&resolution, map, level);
    size_t i, count = 8 * (size_t)resolution * (size_t)resolution;
    if (!out || !texels) return SAT_ERR_ARGUMENT;
    for (i = 0; i < count; i++) out[i] = sat__half_from_float(texels[i]);
    return SAT_OK;
}

static inline void raindrop__map_bilinear(float out[8], const raindrop_map *map, int level, float s, float t)
{
    int r = map->base >> (level), i, x, y;
    float a = (s * 0.5f + 0.5f) * (float)r + 0.5f, b = (t * 0.5f + 0.5f) * (float)r + 0.5f, w00, w10, w01, w11;
    const float *p00, *p10, *p01, *p11;
    size_t x0, x1, y0, y1;
    a = a > 0 ? a : 0; /* a sprite's corner may lie half a texel outside */
    b = b > 0 ? b : 0;
    x = (int)a;
    y = (int)b;
    a -= (float)x;
    b -= (float)y;
    w00 = (1 - a) * (1 - b);
    w10 = a * (1 - b);
    w01 = (1 - a) * b;
    w11 = a * b;
    x0 = (size_t)sat__clamp_int(x - 1, 0, r - 1);
    x1 = (size_t)sat__min_int(x, r - 1);
    y0 = (size_t)sat__clamp_int(y - 1, 0, r - 1) * (size_t)r;
    y1 = (size_t)sat__min_int(y, r - 1) * (size_t)r;
    p00 = map->level[level] + 8 * (y0 + x0);
    p10 = map->level[level] + 8 * (y0 + x1);
    p01 = map->level[level] + 8 * (y1 + x0);
    p11 = map->level[level] + 8 * (y1 + x1);
    for (i = 0; i < 8; i++) out[i] = w00 * p00[i] + w10 * p10[i] + w01 * p01[i] + w11 * p11[i];
}

/* Levels stand for distances, so the level is log2 sqrt(D^2-1) whatever the size of the picture: what a GPU finds from
   the sprite's size holds only for a base as high as the picture with a field of 90 degrees (bias log2(2 f/base)). */
static inline float raindrop__map_lod(float distance2) { return distance2 > 2 ? 0.5f * log2f(distance2 - 1) : 0; }

static inline void raindrop__map_trilinear(float out[8], const raindrop_map *map, float s, float t, float lod)
{
    int level, i;
    float f, coarse[8];
    lod = raindrop__clamp(lod, 0, (float)(map->levels - 1));
    level = (int)lod;
    f = lod - (float)level;
    raindrop__map_bilinear(out, map, level, s, t);
    if (!(f > 0)) return;
    raindrop__map_bilinear(coarse, map, level + 1, s, t);
    for (i = 0; i < 8; i++) out[i] += (coarse[i] - out[i]) * f;
}

RAINDROP_DEF void raindrop_map_sample(float out[8], const raindrop_map *map, float s, float t, float distance)
{
    if (!out) return;
    memset(out, 0, 8 * sizeof *out);
    if (map)
        raindrop__map_trilinear(out, map, raindrop__clamp(s, -1, 1), raindrop__clamp(t, -1, 1),
                                raindrop__map_lod(distance * distance));
}
#endif

/* ------------------------------------------------------------------------------------------------
   >> environment   an octahedral picture with mips

   A direction is folded onto an octahedron and that onto a square (y is the folded axis): no angles, one picture, and
   texels whose solid angle is 1/|p|^3 of their area, |p| being the length of the point on the octahedron. Each level
   has a border of one texel, copied from where the square's edge continues, so that bilinear lookups need no case.
   ------------------------------------------------------------------------------------------------ */

typedef struct raindrop__sphere {
    float *texels; /* 4 floats each: RGB and 0 */
    int resolution, levels;
    size_t offset[13]; /* of each level, in floats */
} raindrop__sphere;

#define RAINDROP__BOW_SIDE 60 /* of a texture */
#define RAINDROP__BOW_BINS (RAINDROP__BOW_SIDE * RAINDROP__BOW_SIDE)

struct raindrop_environment {
    raindrop__sphere near_sphere, far_sphere;
    raindrop_filter filter;
    sat_table *table;
    int table_width, table_height;
    float *bow; /* RGB by scattering angle, RAINDROP__BOW_BINS of them; NULL: no bows in the veil */
    float sun_direction[3], sun_irradiance[3];
    float n, largest;
    sat_allocator allocator;
    void *block;
    size_t bytes;
};

static inline size_t raindrop__sphere_size(raindrop__sphere *sphere, int resolution, int levels)
{
    size_t size = 0;
    int level;
    sphere->resolution = resolution;
    sphere->levels = levels;
    for (level = 0; level < levels; level++) {
        size_t side = (size_t)(resolution >> (level)) + 2;
        sphere->offset[level] = size;
        size += 4 * side * side;
    }
    return size;
}

static inline float *raindrop__texel(const raindrop__sphere *sphere, int level, int x, int y)
{
    size_t side = (size_t)(sphere->resolution >> (level)) + 2;
    return sphere->texels + sphere->offset[level] + 4 * (((size_t)(y + 1)) * side + (size_t)(x + 1));
}

/* Direction to the unit square; returns the direction's |x|+|y|+|z| over its length, 1 .. sqrt(3). */
static inline float raindrop__fold(float uv[2], const float d[3])
{
    float sum = fabsf(d[0]) + fabsf(d[1]) + fabsf(d[2]), a, b;
    sat__octahedral_fold(&a, &b, d);
    uv[0] = raindrop__clamp(a * 0.5f + 0.5f, 0, 1);
    uv[1] = raindrop__clamp(b * 0.5f + 0.5f, 0, 1);
    return sum / sqrtf(raindrop__dot(d, d));
}

static inline void raindrop__fill_border(const raindrop__sphere *sphere, int level)
{
    int r = sphere->resolution >> (level), i;
    for (i = 0; i < r; i++) {
        memcpy(raindrop__texel(sphere, level, i, -1), raindrop__texel(sphere, level, r - 1 - i, 0), 4 * sizeof(float));
        memcpy(raindrop__texel(sphere, level, i, r), raindrop__texel(sphere, level, r - 1 - i, r - 1),
               4 * sizeof(float));
        memcpy(raindrop__texel(sphere, level, -1, i), raindrop__texel(sphere, level, 0, r - 1 - i), 4 * sizeof(float));
        memcpy(raindrop__texel(sphere, level, r, i), raindrop__texel(sphere, level, r - 1, r - 1 - i),
               4 * sizeof(float));
    }
    for (i = 0; i < 4; i++)
        memcpy(raindrop__texel(sphere, level, i & 1 ? r : -1, i & 2 ? r : -1),
               raindrop__texel(sphere, level, i & 1 ? 0 : r - 1, i & 2 ? 0 : r - 1), 4 * sizeof(float));
}

/* Area to solid angle, up to a constant. */
static inline float raindrop__texel_weight(int x, int y, int r)
{
    float d[3], p2;
    sat__octahedral_unfold(d, (2 * (float)x + 1) / (float)r - 1, (2 * (float)y + 1) / (float)r - 1);
    p2 = raindrop__dot(d, d);
    return 1 / (p2 * sqrtf(p2));
}

/* Every level holds solid-angle means of the one below: the top is the mean of the whole sphere. The weights of a
   coarse texel are the sums of those of its four, so that the means of means stay exact. */
static inline void raindrop__build_level(const raindrop__sphere *sphere, int level)
{
    int r = sphere->resolution >> (level), x, y, c, k;
    for (y = 0; y < r; y++) {
        for (x = 0; x < r; x++) {
            float *out = raindrop__texel(sphere, level, x, y);
            double sum[3] = {0, 0, 0}, total = 0;
            for (k = 0; k < 4; k++) {
                int fine_x = 2 * x + (k & 1), fine_y = 2 * y + (k >> 1);
                const float *in = raindrop__texel(sphere, level - 1, fine_x, fine_y);
                double w = level == 1 ? (double)raindrop__texel_weight(fine_x, fine_y, 2 * r) : (double)in[3];
                for (c = 0; c < 3; c++) sum[c] += w * (double)in[c];
                total += w;
            }
            for (c = 0; c < 3; c++) out[c] = (float)(sum[c] / total);
            out[3] = (float)total;
        }
    }
}

static inline void raindrop__build_levels(const raindrop__sphere *sphere)
{
    int level;
    raindrop__fill_border(sphere, 0);
    for (level = 1; level < sphere->levels; level++) {
        raindrop__build_level(sphere, level);
        raindrop__fill_border(sphere, level);
    }
}

/* ---- lookups: four texels of four floats, one vector each */

static inline void raindrop__bilinear(float out[4], const raindrop__sphere *sphere, int level, const float uv[2])
{
    int r = sphere->resolution >> (level), x, y;
    float a = uv[0] * (float)r + 0.5f, b = uv[1] * (float)r + 0.5f; /* + 1 for the border, - 1/2 for the texel's
                                                                       centre */
    const float *p, *q;
    x = (int)a;
    y = (int)b;
    a -= (float)x;
    b -= (float)y;
    p = sphere->texels + sphere->offset[level] + 4 * ((size_t)y * (size_t)(r + 2) + (size_t)x);
    q = p + 4 * (size_t)(r + 2);
    {
        sat__f32x4 va = sat__f32x4_set1(a), vb = sat__f32x4_set1(b), p0 = sat__f32x4_load(p), q0 = sat__f32x4_load(q);
        p0 = sat__f32x4_add(p0, sat__f32x4_mul(va, sat__f32x4_sub(sat__f32x4_load(p + 4), p0)));
        q0 = sat__f32x4_add(q0, sat__f32x4_mul(va, sat__f32x4_sub(sat__f32x4_load(q + 4), q0)));
        sat__f32x4_store(out, sat__f32x4_add(p0, sat__f32x4_mul(vb, sat__f32x4_sub(q0, p0))));
    }
}

/* log2 to 0.05, enough to choose between mips; v > 0 */
#define RAINDROP__LOG2_STEP 1.1920929e-7f /* 2^-23 */
#define RAINDROP__LOG2_BIAS 126.957f      /* 127, less the mean of what the mantissa lacks */

static inline float raindrop__rough_log2(float v)
{
    uint32_t bits = sat__float_bits(v);
    return (float)bits * RAINDROP__LOG2_STEP - RAINDROP__LOG2_BIAS;
}

/* texels: width of the cone in texels of level 0 there. A bilinear lookup is wider than one texel of its level, so a
   finer one is read: of 0.35, 0.5, 0.6, 0.7 and 1 this factor is nearest to 8 x 8 rays for drops of 16..256 pixels. */
#define RAINDROP__FINER 0.6f

static inline void raindrop__trilinear(float out[4], const raindrop__sphere *sphere, const float uv[2], float texels)
{
    float lod, f, coarse[4];
    int level, c;
    texels *= RAINDROP__FINER;
    if (!(texels > 1)) {
        raindrop__bilinear(out, sphere, 0, uv);
        return;
    }
    lod = raindrop__clamp(raindrop__rough_log2(texels), 0, (float)(sphere->levels - 1));
    level = (int)lod;
    f = lod - (float)level;
    raindrop__bilinear(out, sphere, level, uv);
    if (level + 1 >= sphere->levels) return;
    raindrop__bilinear(coarse, sphere, level + 1, uv);
    for (c = 0; c < 4; c++) out[c] += f * (coarse[c] - out[c]);
}

/* A box of the footprint's size on the equirectangular picture, wider towards the poles. */
static inline void raindrop__sample_table(float out[4], const raindrop_environment *environment, const float d[3],
                                          float footprint)
{
    double length = sqrt((double)raindrop__dot(d, d)), y = (double)d[1] / length,
           sine = sqrt(y < 1 && y > -1 ? 1 - y * y : 0);
    double u = (atan2((double)d[0], -(double)d[2]) / (2 * RAINDROP__PI) + 0.5) * environment->table_width;
    double v = acos(y > 1 ? 1 : y < -1 ? -1 : y) / RAINDROP__PI * environment->table_height;
    double half = 0.5 * (double)footprint / RAINDROP__PI * environment->table_height, wide;
    int c;
    if (!(half > 0.5)) half = 0.5;
    wide = sine * environment->table_width > 2 * half ? half / sine : 0.5 * environment->table_width;
    for (c = 0; c < 3; c++)
        out[c] = (float)sat_mean_border(environment->table, c, u - wide, v - half, u + wide, v + half, SAT_BORDER_WRAP,
                                        SAT_BORDER_CLIP);
    out[3] = 0;
}

static inline void raindrop__sample(float out[4], const raindrop_environment *environment, const float d[3],
                                    float footprint)
{
    float uv[2], s;
    if (environment->table) {
        raindrop__sample_table(out, environment, d, footprint);
        return;
    }
    s = raindrop__fold(uv, d);
    raindrop__trilinear(out, &environment->near_sphere, uv,
                        footprint * 0.5f * (float)environment->near_sphere.resolution / (s * sqrtf(s)));
}

RAINDROP_DEF void raindrop_environment_sample(float rgb[3], const raindrop_environment *environment,
                                              const float direction[3], float footprint)
{
    float v[4] = {0, 0, 0, 0};
    if (!rgb) return;
    if (environment && direction) raindrop__sample(v, environment, direction, footprint);
    raindrop__set(rgb, v[0], v[1], v[2]);
}

static inline void raindrop__far(float out[4], const raindrop_environment *environment, const float d[3])
{
    float uv[2];
    raindrop__fold(uv, d);
    raindrop__bilinear(out, &environment->far_sphere, 0, uv);
}

RAINDROP_DEF void raindrop_environment_far(float rgb[3], const raindrop_environment *environment,
                                           const float direction[3])
{
    float v[4] = {0, 0, 0, 0};
    if (!rgb) return;
    if (environment && direction) raindrop__far(v, environment, direction);
    raindrop__set(rgb, v[0], v[1], v[2]);
}

/* ---- making it */

/* The caller's picture as packed RGB floats without NaN, infinity and negative light. */
typedef struct raindrop__picture {
    float *rgb;
    int width, height;
    raindrop_layout layout;
} raindrop__picture;

/* What a lookup stays in: the whole picture, which goes once around, or a face of the cube. */
typedef struct raindrop__sheet { const float *rgb; int width, height, wraps; } raindrop__sheet;

static inline float raindrop__repair(float v, float largest, float limit, raindrop_environment_stats *stats)
{
    if (sat__is_nan(v)) { stats->nan++; v = 0; }
    else if (!(fabsf(v) <= (float)RAINDROP__MOST_LIGHT)) { stats->infinite++; v = v > 0 ? largest : 0; }
    else if (v < 0) { stats->negative++; v = 0; }
    if (limit > 0 && v > limit) { stats->clamped++; v = limit; }
    if (v > stats->largest) stats->largest = v;
    return v;
}

static inline void raindrop__read_picture(raindrop__picture *picture, const sat_image *image,
                                          const raindrop_environment_options *o, raindrop_environment_stats *stats)
{
    size_t i, count = (size_t)image->width * (size_t)image->height * 3;
    float largest = 0;
    int x, y, c;
    for (y = 0; y < image->height; y++) {
        float *row = picture->rgb + (size_t)y * (size_t)image->width * 3;
        const unsigned char *bytes = (const unsigned char *)sat__image_row(image, y);
        size_t size = sat__format_size(image->format);
        for (x = 0; x < image->width; x++) {
            for (c = 0; c < 3; c++) {
                size_t at = (size_t)x * (size_t)image->channels + (size_t)(image->channels < 3 ? 0 : c);
                float v;
                switch (image->format) {
                case SAT_U8: v = (float)bytes[at]; break;
                case SAT_U16: { uint16_t u; memcpy(&u, bytes + at * size, size); v = (float)u; break; }
                case SAT_F16: { uint16_t u; memcpy(&u, bytes + at * size, size); v = sat__half_to_float(u); break; }
                default: memcpy(&v, bytes + at * size, sizeof v);
                }
                v *= o->scale;
                if (o->decode_srgb && sat__is_finite(v)) v = sat__srgb_decode(v);
                if (v <= (float)RAINDROP__MOST_LIGHT && v > largest) largest = v;
                row[3 * x + c] = v;
            }
        }
    }
    for (i = 0; i < count; i++) picture->rgb[i] = raindrop__repair(picture->rgb[i], largest, o->max_radiance, stats);
}

/* u, v: 0..1 from the left and from the top. */
static inline void raindrop__sheet_bilinear(float rgb[3], const raindrop__sheet *sheet, float u, float v)
{
    const int width = sheet->width, height = sheet->height;
    float x = u * (float)width - 0.5f, y = v * (float)height - 0.5f, fx = floorf(x), fy = floorf(y), a = x - fx,
          b = y - fy;
    int x0 = (int)fx, x1 = x0 + 1, y0 = sat__clamp_int((int)fy, 0, height - 1),
        y1 = sat__clamp_int((int)fy + 1, 0, height - 1), c;
    const float *row0 = sheet->rgb + 3 * (size_t)y0 * (size_t)width,
                *row1 = sheet->rgb + 3 * (size_t)y1 * (size_t)width;
    x0 = sheet->wraps ? (x0 + width) % width : sat__clamp_int(x0, 0, width - 1);
    x1 = sheet->wraps ? (x1 + width) % width : sat__clamp_int(x1, 0, width - 1);
    for (c = 0; c < 3; c++) {
        float v0 = row0[3 * x0 + c] * (1 - a) + row0[3 * x1 + c] * a,
              v1 = row1[3 * x0 + c] * (1 - a) + row1[3 * x1 + c] * a;
        rgb[c] = v0 * (1 - b) + v1 * b;
    }
}

static inline void raindrop__picture_sample(float rgb[3], const raindrop__picture *p, const float d[3])
{
    raindrop__sheet sheet = {p->rgb, p->width, p->height, 1};
    if (p->layout == RAINDROP_LAYOUT_EQUIRECT) {
        float length = sqrtf(raindrop__dot(d, d)), y = raindrop__clamp(d[1] / length, -1, 1);
        raindrop__sheet_bilinear(rgb, &sheet, atan2f(d[0], -d[2]) * (float)(0.5 / RAINDROP__PI) + 0.5f,
                                 acosf(y) * (float)(1 / RAINDROP__PI));
    } else {
        float ax = fabsf(d[0]), ay = fabsf(d[1]), az = fabsf(d[2]), s, t, m;
        int face;
        if (ax >= ay && ax >= az) { face = d[0] < 0; m = ax; s = d[0] < 0 ? d[2] : -d[2]; t = -d[1]; }
        else if (ay >= az) { face = 2 + (d[1] < 0); m = ay; s = d[0]; t = d[1] < 0 ? -d[2] : d[2]; }
        else { face = 4 + (d[2] < 0); m = az; s = d[2] < 0 ? -d[0] : d[0]; t = -d[1]; }
        sheet.rgb += 3 * (size_t)face * (size_t)p->width * (size_t)p->width;
        sheet.height = p->width;
        sheet.wraps = 0;
        raindrop__sheet_bilinear(rgb, &sheet, s / m * 0.5f + 0.5f, t / m * 0.5f + 0.5f);
    }
}

typedef struct raindrop__environment_job {
    raindrop_environment *environment;
    const raindrop__picture *picture;
    const raindrop_environment_options *options;
    const float *bow; /* NULL: no bows in the picture */
} raindrop__environment_job;

/* What the bows add for a unit of optical depth, in the direction d that the eye looks along: light that travels along
   -sun is scattered towards it, along -d. */
static inline void raindrop__bow(float rgb[3], const float *bow, const float sun[3], const float irradiance[3],
                                 const float d[3])
{
    float c = raindrop__dot(d, sun) / sqrtf(raindrop__dot(d, d)), x;
    int bin, i;
    x = acosf(raindrop__clamp(c, -1, 1)) * (float)(RAINDROP__BOW_BINS / RAINDROP__PI) - 0.5f;
    bin = x > 0 ? sat__min_int((int)x, RAINDROP__BOW_BINS - 2) : 0;
    x = raindrop__clamp(x - (float)bin, 0, 1);
    for (i = 0; i < 3; i++) rgb[i] = (bow[3 * bin + i] * (1 - x) + bow[3 * bin + 3 + i] * x) * irradiance[i];
}

static inline void raindrop__add_bow(float rgb[3], const raindrop__environment_job *job, const float d[3])
{
    float v[3];
    int i;
    raindrop__bow(v, job->bow, job->options->sun_direction, job->options->sun_irradiance, d);
    for (i = 0; i < 3; i++) rgb[i] += v[i] * job->options->bow_optical_depth;
}

/* Rows of the octahedral picture, four samples a texel. */
static void raindrop__resample_rows(int begin, int end, int worker, void *context)
{
    const raindrop__environment_job *job = (const raindrop__environment_job *)context;
    const raindrop__sphere *sphere = &job->environment->near_sphere;
    float step = 1 / (float)sphere->resolution;
    int x, y, k, c;
    (void)worker;
    for (y = begin; y < end; y++) {
        for (x = 0; x < sphere->resolution; x++) {
            float *out = raindrop__texel(sphere, 0, x, y), d[3], rgb[3], sum[3] = {0, 0, 0};
            for (k = 0; k < 4; k++) {
                sat__octahedral_unfold(d, ((float)x + ((k & 1) ? 0.75f : 0.25f)) * 2 * step - 1,
                                       ((float)y + ((k & 2) ? 0.75f : 0.25f)) * 2 * step - 1);
                raindrop__picture_sample(rgb, job->picture, d);
                for (c = 0; c < 3; c++) sum[c] += 0.25f * rgb[c];
            }
            if (job->bow) {
                sat__octahedral_unfold(d, ((float)x + 0.5f) * 2 * step - 1, ((float)y + 0.5f) * 2 * step - 1);
                raindrop__add_bow(sum, job, d);
            }
            raindrop__set(out, sum[0], sum[1], sum[2]);
            out[3] = 0;
        }
    }
}

/* Two unit vectors perpendicular to the unit vector n (Duff et al. 2017). */
static inline void raindrop__perpendicular(float u[3], float v[3], const float n[3])
{
    float sign = copysignf(1, n[2]), a = -1 / (sign + n[2]), b = n[0] * n[1] * a;
    raindrop__set(u, 1 + sign * n[0] * n[0] * a, sign * b, -sign * n[0]);
    raindrop__set(v, b, sign + n[1] * n[1] * a, -n[1]);
}

/* How rays through a drop look at the environment: the orders they have, whether the last one carries only its own
   light, and their width, in radii of the drop and in radians before it; lookups are `blur` times as wide. */
typedef struct raindrop__gaze {
    const raindrop_environment *environment;
    int orders, exit_fresnel;
    float width, pixel, blur;
} raindrop__gaze;

static inline void raindrop__add_light(float colour[3], const raindrop__gaze *gaze, float share, const float d[3],
                                       float cone)
{
    float v[4];
    int c;
    raindrop__sample(v, gaze->environment, d, gaze->blur * cone);
    for (c = 0; c < 3; c++) colour[c] += share * v[c];
}

static inline void raindrop__add_mirrored(float colour[3], const raindrop__gaze *gaze, const raindrop_ray *ray)
{
    raindrop__add_light(colour, gaze, ray->fresnel, ray->reflected,
                        ray->footprint_reflected * gaze->width + gaze->pixel);
}

/* Adds what one ray shows by its mirrored light and order 0. */
static inline void raindrop__add_ray(float colour[3], const raindrop__gaze *gaze, const raindrop_ray *ray)
{
    raindrop__add_mirrored(colour, gaze, ray);
    raindrop__add_light(colour, gaze, gaze->exit_fresnel ? ray->transmit : 1 - ray->fresnel, ray->refracted,
                        fabsf(ray->footprint_refracted * gaze->width - gaze->pixel));
}

/* Adds what one ray shows by all its orders. */
static inline void raindrop__add_orders(float colour[3], const raindrop__gaze *gaze, const float d[3], const float p[3],
                                        float one_minus_b2)
{
    const float n = gaze->environment->n;
    raindrop_order order;
    raindrop_ray ray;
    int k;
    raindrop_trace(&ray, d, p, one_minus_b2, n);
    raindrop__add_mirrored(colour, gaze, &ray);
    for (k = 0; k <= gaze->orders; k++) {
        raindrop_trace_order(&order, d, p, one_minus_b2, n, k);
        raindrop__add_light(colour, gaze, k == gaze->orders && !gaze->exit_fresnel ? order.rest : order.weight,
                            order.direction, fabsf(order.footprint * gaze->width - gaze->pixel));
    }
}

/* Point i of `count` on a spiral that fills the unit disc evenly: turned by the golden angle each. */
static inline void raindrop__spiral(float at[2], int i, int count)
{
    float b = sqrtf(((float)i + 0.5f) / (float)count), angle = RAINDROP__GOLDEN * (float)i;
    at[0] = b * cosf(angle);
    at[1] = b * sinf(angle);
}

/* The gaze of the prefilter's samples: each is as wide as its share of the disc. */
static inline raindrop__gaze raindrop__far_gaze(const raindrop__environment_job *job)
{
    raindrop__gaze gaze = {NULL, 0, 0, 0, 0, 1};
    gaze.environment = job->environment;
    gaze.orders = job->options->far_orders;
    gaze.width = 2 * RAINDROP__SQUARE / sqrtf((float)job->options->far_samples);
    return gaze;
}

/* Mean light of a far spheroid seen along the unit vector d, by order 0: samples on a spiral in its elliptic disc, with
   half axes of 1 to the side and k upwards. */
static inline double raindrop__spheroid_light(const raindrop__environment_job *job, const float d[3], float ratio)
{
    const raindrop__gaze gaze = raindrop__far_gaze(job);
    const int samples = job->options->far_samples;
    float k = sqrtf(ratio * ratio * (1 - d[1] * d[1]) + d[1] * d[1]), side[3], up[3], p[3], at[2];
    double sum = 0;
    int i;
    raindrop__set(side, -d[2], 0, d[0]);
    raindrop__normalise(side);
    if (!(raindrop__dot(side, side) > 0.5f)) side[0] = 1;
    raindrop__set(up, side[1] * d[2] - side[2] * d[1], side[2] * d[0] - side[0] * d[2],
                  side[0] * d[1] - side[1] * d[0]);
    for (i = 0; i < samples; i++) {
        float rgb[3] = {0, 0, 0};
        raindrop_ray ray;
        raindrop__spiral(at, i, samples);
        raindrop__combine(p, RAINDROP__INNER * at[0], side, RAINDROP__INNER * at[1] * k, up);
        if (!raindrop_trace_spheroid(&ray, d, p, ratio, job->environment->n)) continue;
        raindrop__add_ray(rgb, &gaze, &ray);
        sum += (double)rgb[0] + (double)rgb[1] + (double)rgb[2];
    }
    return sum;
}

/* Relative change of a far drop's light with its axis ratio. */
static inline float raindrop__far_swing(const raindrop__environment_job *job, const float d[3])
{
    const float change = 0.07f;
    double flat = raindrop__spheroid_light(job, d, 1 - change), tall = raindrop__spheroid_light(job, d, 1 + change),
           both = flat + tall;
    return both > 0 ? (float)((tall - flat) / ((double)change * both)) : 0;
}

/* Rows of the far drops' picture: the mean over the drop's disc, samples on a spiral of equal areas. */
static void raindrop__prefilter_rows(int begin, int end, int worker, void *context)
{
    const raindrop__environment_job *job = (const raindrop__environment_job *)context;
    const raindrop__sphere *sphere = &job->environment->far_sphere;
    const raindrop__gaze gaze = raindrop__far_gaze(job);
    int samples = job->options->far_samples, x, y, i, c;
    (void)worker;
    for (y = begin; y < end; y++) {
        for (x = 0; x < sphere->resolution; x++) {
            float *out = raindrop__texel(sphere, 0, x, y), d[3], u[3], v[3], p[3], at[2];
            double sum[3] = {0, 0, 0};
            sat__octahedral_unfold(d, (2 * (float)x + 1) / (float)sphere->resolution - 1,
                                   (2 * (float)y + 1) / (float)sphere->resolution - 1);
            raindrop__normalise(d);
            raindrop__perpendicular(u, v, d);
            for (i = 0; i < samples; i++) {
                float rgb[3] = {0, 0, 0};
                raindrop__spiral(at, i, samples);
                raindrop__combine(p, at[0], u, at[1], v);
                raindrop__add_orders(rgb, &gaze, d, p, 1 - ((float)i + 0.5f) / (float)samples);
                for (c = 0; c < 3; c++) sum[c] += (double)rgb[c];
            }
            for (c = 0; c < 3; c++) out[c] = (float)(sum[c] / samples);
            out[3] = job->options->far_swing ? raindrop__far_swing(job, d) : 0;
        }
    }
}

/* A texel a quarter of the picture's at the equator: lookups of level 0 then add no blur of their own. */
static inline int raindrop__default_resolution(const sat_image *image, raindrop_layout layout)
{
    int texels = layout == RAINDROP_LAYOUT_CUBE ? 3 * image->width : image->width, r = 16;
    while (r < texels && r < 4096) r *= 2;
    return r;
}

static inline sat_result raindrop__make_table(raindrop_environment *e, const raindrop__picture *picture,
                                              const raindrop_environment_options *o, const sat_allocator *memory)
{
    sat_options options = sat_defaults();
    sat_image image = sat_image_f32(picture->rgb, picture->width, picture->height, 3);
    sat_result result;
    options.allocator = *memory;
    options.threads = o->threads;
    e->table_width = picture->width;
    e->table_height = picture->height;
    result = sat_create(&e->table, picture->width, picture->height, 3, &options);
    return result == SAT_OK ? sat_build(e->table, &image) : result;
}

RAINDROP_DEF void raindrop_environment_destroy(raindrop_environment *environment)
{
    if (!environment) return;
    if (environment->table) sat_destroy(environment->table);
    raindrop__release(environment->allocator, environment->block, environment->bytes);
}

/* The object, its two octahedral pictures and the bows in one block, once to measure and once on it; returns where the
   object is. */
static inline raindrop_environment *raindrop__environment_layout(raindrop_environment *e, sat__arena *arena,
                                                                 int resolution, const raindrop_environment_options *o)
{
    raindrop_environment *place = (raindrop_environment *)sat__carve(arena, 1, sizeof *e);
    size_t size;
    int levels = 1;
    while (resolution >> (levels)) levels++;
    size = raindrop__sphere_size(&e->near_sphere, resolution, levels);
    e->near_sphere.texels = (float *)sat__carve(arena, size, sizeof(float));
    size = raindrop__sphere_size(&e->far_sphere, o->far_resolution, 1);
    e->far_sphere.texels = (float *)sat__carve(arena, size, sizeof(float));
    if (o->bow_by_depth) e->bow = (float *)sat__carve(arena, 3 * RAINDROP__BOW_BINS, sizeof(float));
    return place;
}

static inline sat_result raindrop__allocate_environment(raindrop_environment **out, int resolution,
                                                        const raindrop_environment_options *o,
                                                        const sat_allocator *memory)
{
    raindrop_environment e;
    sat__arena arena = {0, 0, 0};
    sat_result result;
    memset(&e, 0, sizeof e);
    e.allocator = *memory;
    raindrop__environment_layout(&e, &arena, resolution, o);
    result = sat__arena_allocate(&arena, &e.block, &e.bytes, memory);
    if (result != SAT_OK) return result;
    *out = raindrop__environment_layout(&e, &arena, resolution, o);
    **out = e;
    return SAT_OK;
}

static inline sat_result raindrop__fill_environment(raindrop_environment *e, const raindrop__picture *picture,
                                                    float *bow, const raindrop_environment_options *o,
                                                    const sat_allocator *memory)
{
    raindrop__environment_job job;
    sat_result result = SAT_OK;
    e->n = o->n;
    e->filter = o->filter;
    memcpy(e->sun_direction, o->sun_direction, sizeof e->sun_direction);
    memcpy(e->sun_irradiance, o->sun_irradiance, sizeof e->sun_irradiance);
    if (e->bow && bow) memcpy(e->bow, bow, 3 * RAINDROP__BOW_BINS * sizeof *bow);
    job.environment = e;
    job.picture = picture;
    job.options = o;
    job.bow = o->bow_optical_depth > 0 ? bow : NULL;
    sat__parallel_for(&o->threads, e->near_sphere.resolution, raindrop__resample_rows, &job);
    raindrop__build_levels(&e->near_sphere);
    sat__parallel_for(&o->threads, e->far_sphere.resolution, raindrop__prefilter_rows, &job);
    raindrop__fill_border(&e->far_sphere, 0);
    if (o->filter == RAINDROP_FILTER_SAT) result = raindrop__make_table(e, picture, o, memory);
    return result;
}

RAINDROP_DEF sat_result raindrop_environment_create(raindrop_environment **out, const sat_image *image,
                                                    const raindrop_environment_options *options,
                                                    raindrop_environment_stats *stats)
{
    raindrop_environment_options o = options ? *options : raindrop_environment_defaults();
    raindrop_environment_stats local;
    raindrop_environment *e = NULL;
    raindrop__picture picture;
    sat_allocator memory;
    sat__text ignored = sat__text_begin(NULL, 0);
    sat_result result;
    size_t bytes;
    int bows;
    float *bow = NULL;
    const size_t bow_bytes = 3 * RAINDROP__BOW_BINS * sizeof(float);
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    if (!raindrop__environment_is_valid(&ignored, image, &o) || !sat__resolve_allocator(&memory, &o.allocator))
        return SAT_ERR_ARGUMENT;
    if (!sat__multiply_size(&bytes, (size_t)image->width * 3 * sizeof(float), (size_t)image->height))
        return SAT_ERR_SIZE;
    memset(&local, 0, sizeof local);
    picture.width = image->width;
    picture.height = image->height;
    picture.layout = o.layout;
    result = raindrop__allocate_environment(
        &e, o.resolution ? o.resolution : raindrop__default_resolution(image, o.layout), &o, &memory);
    if (result != SAT_OK) return result;
    picture.rgb = (float *)sat__alloc(&memory, bytes);
    bows = o.bow_optical_depth > 0 || o.bow_by_depth;
    if (bows) bow = (float *)sat__alloc(&memory, bow_bytes);
    if (!picture.rgb || (bows && !bow)) result = SAT_ERR_MEMORY;
    else {
        raindrop__read_picture(&picture, image, &o, &local);
#ifndef RAINDROP_NO_BOW
        if (bow) raindrop_bow_profile(bow, RAINDROP__BOW_BINS, o.bow_drop_mm);
#endif
        e->largest = local.largest;
        result = raindrop__fill_environment(e, &picture, bow, &o, &memory);
    }
    sat__release(&memory, picture.rgb, bytes);
    sat__release(&memory, bow, bow_bytes);
    local.bytes = e->bytes + (e->table ? sat_get_stats(e->table).bytes : 0);
    if (result != SAT_OK) raindrop_environment_destroy(e);
    else *out = e;
    if (stats && result == SAT_OK) *stats = local;
    return result;
}

/* ------------------------------------------------------------------------------------------------
   >> rainbows   orders 1 and 2, gathered by wavelength
   ------------------------------------------------------------------------------------------------ */

RAINDROP_DEF double raindrop_bow_angle(int order, double n)
{
    double k = order < 1 ? 1 : order, cosine2 = (n * n - 1) / (k * (k + 2)), i, r;
    if (!(cosine2 > 0)) return 0;
    i = acos(sqrt(cosine2 < 1 ? cosine2 : 1));
    r = asin(sin(i) / n);
    return 2 * (i - r) + k * (RAINDROP__PI - 2 * r);
}

/* A + B/wavelength^2 through the Fraunhofer lines C (656.3 nm, 1.3311) and F (486.1 nm, 1.3371); 1.3329 at D
   (1.3330). */
RAINDROP_DEF double raindrop_water_index(double wavelength_nm)
{
    return 1.3239 + 3125 / (wavelength_nm * wavelength_nm);
}

#ifndef RAINDROP_NO_BOW
/* CIE 1931 colour matching by the lobes of Wyman, Sloan and Shirley 2013, to linear Rec. 709. */
static inline double raindrop__lobe(double x, double centre, double left, double right)
{
    double t = (x - centre) / (x < centre ? left : right);
    return exp(-0.5 * t * t);
}

static inline void raindrop__wavelength_rgb(double rgb[3], double w)
{
    double x = 1.056 * raindrop__lobe(w, 599.8, 37.9, 31.0) + 0.362 * raindrop__lobe(w, 442.0, 16.0, 26.7) -
               0.065 * raindrop__lobe(w, 501.1, 20.4, 26.2);
    double y = 0.821 * raindrop__lobe(w, 568.8, 46.9, 40.5) + 0.286 * raindrop__lobe(w, 530.9, 16.3, 31.1);
    double z = 1.217 * raindrop__lobe(w, 437.0, 11.8, 36.0) + 0.681 * raindrop__lobe(w, 459.0, 26.0, 13.8);
    rgb[0] = 3.2404542 * x - 1.5371385 * y - 0.4985314 * z;
    rgb[1] = -0.9692660 * x + 1.8760108 * y + 0.0415560 * z;
    rgb[2] = 0.0556434 * x - 0.2040259 * y + 1.0572252 * z;
}

/* Airy's integral Ai(-y), y = -6..40, by its equation Ai'' = x Ai (Runge and Kutta, from where it has decayed). */
#define RAINDROP__AIRY_STEPS 50
#define RAINDROP__AIRY_COUNT (46 * RAINDROP__AIRY_STEPS + 1)

static inline void raindrop__fill_airy(float *table)
{
    double x = 6, v = 9.947694360252891e-6, slope = -2.476520039703480e-5, h = -1.0 / RAINDROP__AIRY_STEPS;
    int i;
    for (i = 0; i < RAINDROP__AIRY_COUNT; i++, x += h) {
        double a1 = slope, b1 = x * v, a2 = slope + h / 2 * b1, b2 = (x + h / 2) * (v + h / 2 * a1);
        double a3 = slope + h / 2 * b2, b3 = (x + h / 2) * (v + h / 2 * a2), a4 = slope + h * b3,
               b4 = (x + h) * (v + h * a3);
        table[i] = (float)v;
        v += h / 6 * (a1 + 2 * a2 + 2 * a3 + a4);
        slope += h / 6 * (b1 + 2 * b2 + 2 * b3 + b4);
    }
}

static inline double raindrop__airy(const float *table, double y)
{
    double at = (y + 6) * RAINDROP__AIRY_STEPS;
    int i = (int)at;
    if (!(at > 0) || i >= RAINDROP__AIRY_COUNT - 1) return 0;
    return (double)table[i] + (at - i) * ((double)table[i + 1] - (double)table[i]);
}

/* One bow of one wavelength: order k, index n. Airy's theory: e beyond the bow's angle, geometry's two rays of
   brightness c/sqrt(e) interfere as 2 pi c sqrt(s) Ai(-s e)^2, s = (pi diameter/wavelength)^(2/3) / h^(1/3) (van de
   Hulst 1957, 13.2); s = 0: geometrical optics. Its phase is 4/3 (s e)^(3/2). */
typedef struct raindrop__bow_of {
    int k, count;
    double n, s, share[3];
    const float *airy;
    float *rgb;
} raindrop__bow_of;

/* Spreads power evenly over scattering angles, widened by the sun's disc (radius 0.27 degrees; a box of its variance):
   no holes, no poles. */
static inline void raindrop__bow_add(const raindrop__bow_of *bow, double from, double to, double power)
{
    const double per_bin = bow->count / RAINDROP__PI, sun = 0.2665 * 0.8660254 * RAINDROP__PI / 180 * per_bin;
    int at, c;
    from = from * per_bin - sun;
    to = to * per_bin + sun;
    if (from < 0) from = 0;
    if (to > bow->count) to = bow->count;
    for (at = (int)from; at < to; at++) {
        double overlap = (to < at + 1 ? to : at + 1) - (from > at ? from : at);
        for (c = 0; c < 3; c++) bow->rgb[3 * at + c] += (float)(power * bow->share[c] * overlap / (to - from));
    }
}

/* The order's share of the light at 1 - b^2. */
static inline double raindrop__bow_power(const raindrop__bow_of *bow, double one_minus_b2)
{
    raindrop__optics o = raindrop__refract((float)one_minus_b2, (float)bow->n);
    double fs = (double)o.fs, fp = (double)o.fp, k = bow->k;
    return 0.5 * ((1 - fs) * (1 - fs) * pow(fs, k) + (1 - fp) * (1 - fp) * pow(fp, k));
}

static inline double raindrop__deviation(const raindrop__bow_of *bow, double b)
{
    double r = asin(b / bow->n);
    return 2 * (asin(b < 1 ? b : 1) - r) + bow->k * (RAINDROP__PI - 2 * r);
}

/* All rays of the order, in strips of b^2. */
static inline void raindrop__bow_rays(const raindrop__bow_of *bow)
{
    const int strips = 4096;
    double last = (bow->k & 1) ? RAINDROP__PI : 0, least = raindrop_bow_angle(bow->k, bow->n);
    int i;
    for (i = 0; i < strips; i++) {
        double turn = fabs(remainder(raindrop__deviation(bow, sqrt((i + 1.0) / strips)), 2 * RAINDROP__PI));
        double power = raindrop__bow_power(bow, 1 - (i + 0.5) / strips) / strips;
        double y = bow->s * (raindrop__deviation(bow, sqrt((i + 0.5) / strips)) - least);
        if (y > 0 && y < 40) { /* diameters that spread by 7 % blur all but the first arcs */
            double ai = raindrop__airy(bow->airy, y), waves = 2 * RAINDROP__PI * sqrt(y) * ai * ai;
            power *= 1 + (waves - 1) * exp(-0.5 * 0.0933 * 0.0933 * y * y * y);
        }
        raindrop__bow_add(bow, last < turn ? last : turn, last < turn ? turn : last, power);
        last = turn;
    }
}

/* Airy's light on the dark side of the bow. */
static inline void raindrop__bow_shade(const raindrop__bow_of *bow)
{
    double k1 = bow->k + 1, n2 = bow->n * bow->n, b2 = 1 - (n2 - 1) / (bow->k * (bow->k + 2.0)), b = sqrt(b2);
    double bend = 2 * b * pow(1 - b2, -1.5) - 2 * k1 * b / (bow->n * n2) * pow(1 - b2 / n2, -1.5);
    double c = 4 * b * raindrop__bow_power(bow, 1 - b2) / sqrt(2 * bend), step = 0.1 / bow->s,
           angle = fabs(remainder(raindrop_bow_angle(bow->k, bow->n), 2 * RAINDROP__PI));
    int i;
    for (i = 0; i < 50; i++) {
        double ai = raindrop__airy(bow->airy, -0.1 * (i + 0.5));
        double from = bow->k == 1 ? angle - (i + 1) * step : angle + i * step;
        raindrop__bow_add(bow, from, from + step, 2 * RAINDROP__PI * c * sqrt(bow->s) * ai * ai * step);
    }
}

RAINDROP_DEF sat_result raindrop_bow_profile(float *rgb, int count, double diameter_mm)
{
    float airy[RAINDROP__AIRY_COUNT];
    double white[3] = {0, 0, 0}, wavelength;
    raindrop__bow_of bow;
    int i, c;
    if (!rgb || count < 16 || count > (1 << 20)) return SAT_ERR_ARGUMENT;
    if (!(diameter_mm == 0 || (diameter_mm >= 0.05 && diameter_mm <= 6))) return SAT_ERR_ARGUMENT;
    raindrop__fill_airy(airy);
    bow.rgb = rgb;
    bow.count = count;
    bow.airy = airy;
    for (wavelength = 380; wavelength <= 780; wavelength += 10) {
        raindrop__wavelength_rgb(bow.share, wavelength);
        for (c = 0; c < 3; c++) white[c] += bow.share[c];
    }
    memset(rgb, 0, (size_t)count * 3 * sizeof *rgb);
    for (wavelength = 380; wavelength <= 780; wavelength += 10) {
        raindrop__wavelength_rgb(bow.share, wavelength);
        for (c = 0; c < 3; c++) bow.share[c] /= white[c];
        bow.n = raindrop_water_index(wavelength);
        for (bow.k = 1; bow.k <= 2; bow.k++) {
            double p2 = (bow.k + 1.0) * (bow.k + 1), n2 = bow.n * bow.n,
                   h = (p2 - 1) * (p2 - 1) / p2 * sqrt((p2 - n2) / ((n2 - 1) * (n2 - 1) * (n2 - 1)));
            bow.s = pow(RAINDROP__PI * diameter_mm * 1e6 / wavelength, 2.0 / 3) / cbrt(h);
            raindrop__bow_rays(&bow);
            if (bow.s > 0) raindrop__bow_shade(&bow);
        }
    }
    for (i = 0; i < count; i++) {
        double solid_angle = 2 * RAINDROP__PI * (cos(RAINDROP__PI * i / count) - cos(RAINDROP__PI * (i + 1) / count));
        for (c = 0; c < 3; c++) rgb[3 * i + c] = rgb[3 * i + c] > 0 ? (float)((double)rgb[3 * i + c] / solid_angle) : 0;
    }
    return SAT_OK;
}
#endif

/* ------------------------------------------------------------------------------------------------
   >> rain   drops, their fall, the box
   ------------------------------------------------------------------------------------------------ */

#define RAINDROP__TURN 0x2545f491u /* from one crossing of the box to the next in the streams of random numbers */
#define RAINDROP__FORGETS 64.0     /* crossings after which a drop has forgotten where it began */
enum { RAINDROP__CHUNK = 4096 }; /* drops that are culled together; fixes the order of everything, whatever the
                                    workers */

static inline int raindrop__chunk_count(int drops) { return drops / RAINDROP__CHUNK + (drops % RAINDROP__CHUNK != 0); }

/* A drop in the picture. `rows`: first row and row behind the last, packed, of those it may touch. */
typedef struct raindrop__visible {
    float x, y, radius, depth; /* pixels; radius of the circle of the projected area; depth along the axis in metres */
    float colour[3];           /* far drops */
    float streak[2], blur;     /* pixels: path during the exposure, circle of confusion */
    uint32_t drop;             /* index; the top bit marks a far drop */
    uint32_t rows;
} raindrop__visible;

/* Why a drop is drawn or not, as in raindrop_render_stats. */
typedef enum raindrop__fate {
    RAINDROP__NEAR, RAINDROP__FAR, RAINDROP__INVALID, RAINDROP__INSIDE, RAINDROP__BEHIND, RAINDROP__NEAR_PLANE,
    RAINDROP__OUTSIDE, RAINDROP__HIDDEN, RAINDROP__BELOW, RAINDROP__FATES
} raindrop__fate;

typedef struct raindrop__chunk {
    int visible, fates[RAINDROP__FATES];
    double coverage_left_out;
} raindrop__chunk;

typedef struct raindrop__tally {
    size_t fragments, order_fragments;
    char apart[64 - 2 * sizeof(size_t)];
} raindrop__tally;

struct raindrop_rain {
    raindrop_drop *drops;
    int count, capacity, own; /* own: the caller's drops, which do not wrap */
    int settled;              /* all fall with their terminal velocity */
    uint32_t step;            /* advances with dt > 0 so far: the random stream */
    double time;              /* seconds so far, less whole RAINDROP__PERIODs: phases of the oscillations */
    float height;             /* of the box's centre in the last advance */
    raindrop_rain_options options;
    raindrop__visible *visible;
    uint64_t *pairs[2];         /* the bits of the depth, inverted, and the place in visible below them */
    uint32_t *rows;           /* visible[].rows in drawing order: what a band scans */
    raindrop__chunk *chunks;
    int *unsettled;           /* a flag a chunk */
    raindrop__tally *tally;   /* one a worker */
    sat_allocator allocator;
    void *block;
    size_t bytes;
};

/* Written as GLSL has them too. */
#define RAINDROP__GRAVITY (9.80665 * (1.0 - 1.204 / 998.2)) /* m/s^2; less the air's buoyancy */
#define RAINDROP__VISCOSITY 1.81e-5                         /* of air, Pa s */
#define RAINDROP__DENSITY 998.2                             /* of water, kg/m^3 */
#define RAINDROP__TENSION 0.0728                            /* of water's surface, N/m */
#define RAINDROP__BEST_SPEED 9.32                           /* of falling drops, Best 1950: m/s, mm and a power */
#define RAINDROP__BEST_MM 1.77
#define RAINDROP__BEST_POWER 1.147
#define RAINDROP__OBLATE(d) (1.0048 + (d) * (5.7e-4 + (d) * (-2.628e-2 + (d) * (3.682e-3 - (d) * 1.677e-4))))
#define RAINDROP__PERIOD 16.0 /* seconds; frequencies of oscillations are whole multiples of 1 over it */

/* Stokes' law for the smallest and Best 1950 for the others, blended; rms 4 % of Gunn and Kinzer's table. */
RAINDROP_DEF double raindrop_terminal_velocity(double diameter_mm)
{
    double d = diameter_mm * 1e-3, stokes, best, slow;
    if (!(diameter_mm > 0)) return 0;
    stokes = RAINDROP__GRAVITY * RAINDROP__DENSITY * d * d / (18 * RAINDROP__VISCOSITY);
    best = RAINDROP__BEST_SPEED * -expm1(-pow(diameter_mm / RAINDROP__BEST_MM, RAINDROP__BEST_POWER));
    slow = stokes < best ? stokes : best; /* factored out: no power of a small number underflows */
    return slow * pow(pow(slow / stokes, 4) + pow(slow / best, 4), -0.25);
}

RAINDROP_DEF double raindrop_oblateness(double diameter_mm)
{
    double d = diameter_mm < 6 ? diameter_mm : 6, ratio;
    if (!(diameter_mm > 0)) return 1;
    ratio = RAINDROP__OBLATE(d);
    return ratio < 1 ? ratio : 1;
}

/* N(D) = N0 exp(-lambda D), N0 = 8000 /(m^3 mm), lambda = 4.1 R^-0.21 /mm */
static inline double raindrop__lambda(double rate_mm_h) { return 4.1 * pow(rate_mm_h, -0.21); }

RAINDROP_DEF double raindrop_marshall_palmer(double diameter_mm, double rate_mm_h)
{
    if (!(diameter_mm >= 0) || !(rate_mm_h > 0)) return 0;
    return 8000 * exp(-raindrop__lambda(rate_mm_h) * diameter_mm);
}

#ifndef RAINDROP_NO_RAIN
/* ---- the exact drag step

   v' = g - a v - b v|v| downwards, relative to the wind, with Stokes' a = 18 mu / (rho D^2) and b such that the
   terminal velocity vt is the fixed point. With u = v - vt and k = a + 2 b vt this is Riccati's equation,

       u(h) = u0 e / (1 + q),   q = (b u0/k) (1 - e),   e = exp(-k h),   fallen = vt h + log(1 + q) / b,

   for any h and any stiffness (a step of 1/60 s is 5400 time constants of a 1 um drop). A drop that rises obeys the
   same with -b, up to its apex. Sideways the drag is that of the vertical speed, so that the damping is the integral of
   a + b|v|, which is known; two half steps equal a whole one. */
typedef struct raindrop__drag { double vt, a, b; } raindrop__drag;

static inline raindrop__drag raindrop__drag_of(double radius)
{
    raindrop__drag drag;
    double d = 2 * radius;
    drag.vt = raindrop_terminal_velocity(d * 1e3);
    drag.a = 18 * RAINDROP__VISCOSITY / (RAINDROP__DENSITY * d * d);
    drag.b = (RAINDROP__GRAVITY - drag.a * drag.vt) / (drag.vt * drag.vt);
    if (!(drag.b > 0)) {
        drag.b = 0;
        drag.a = RAINDROP__GRAVITY / drag.vt;
    }
    return drag;
}

/* One phase of a step: speed downwards, way downwards, and the integral of a + b|v|. */
typedef struct raindrop__phase { double speed, way, damping; } raindrop__phase;

static inline raindrop__phase raindrop__sink(double v, const raindrop__drag *drag, double h)
{
    raindrop__phase out;
    double u = v - drag->vt, k = drag->a + 2 * drag->b * drag->vt, lost = -expm1(-k * h), q = drag->b * u / k * lost;
    out.speed = drag->vt + u * exp(-k * h) / (1 + q);
    out.way = drag->vt * h + u * lost / k * (fabs(q) > 1e-8 ? log1p(q) / q : 1 - q / 2);
    out.damping = (drag->a + drag->b * drag->vt) * h + log1p(q);
    return out;
}

/* s' = -(g + a s + b s^2) for a speed s upwards, at most until s = 0; *h becomes the time that is left. */
static inline raindrop__phase raindrop__rise(double s, const raindrop__drag *drag, double *h)
{
    const double g = RAINDROP__GRAVITY, a = drag->a, b = drag->b, discriminant = a * a - 4 * b * g;
    raindrop__phase out;
    double apex, t, end, way;
    if (discriminant > 0) { /* roots -r1, -r2 of b s^2 + a s + g: (s + r1)/(s + r2) decays like exp(-root t) */
        double root = sqrt(discriminant), sum = a + root, r1 = 2 * g / sum, start = (s + r1) / (2 * b * s + sum);
        apex = log(start * sum / r1) / root;
        t = *h < apex ? *h : apex;
        start *= exp(-root * t);
        end = *h < apex ? (start * sum - r1) / (1 - 2 * b * start) : 0;
        way = r1 * log((end + r1) / (s + r1));
        way -= b > 0 ? sum / (2 * b) * log1p(2 * b * (end - s) / (2 * b * s + sum)) : end - s;
        way /= root;
    } else {
        double root = sqrt(-discriminant) + 1e-300, phase = atan((2 * b * s + a) / root), last = atan(a / root);
        apex = 2 * (phase - last) / root;
        t = *h < apex ? *h : apex;
        last = phase - 0.5 * root * t;
        end = *h < apex ? (root * tan(last) - a) / (2 * b) : 0;
        way = log(cos(last) / cos(phase)) / b - a * t / (2 * b);
    }
    *h = *h < apex ? 0 : *h - apex;
    out.speed = end > 0 ? -end : 0;
    out.way = -way;
    out.damping = a * t + b * way;
    return out;
}

/* Sideways: speed relative to the wind decays by the damping; the way is that of a steady decay of the same size. */
static inline void raindrop__drift(double *speed, double *way, double damping, double h)
{
    double left = exp(-damping);
    *way += *speed * h * (damping > 1e-8 ? -expm1(-damping) / damping : 1);
    *speed *= left;
}

static inline void raindrop__step(double velocity[3], double way[3], double radius, const float wind[3], double h)
{
    raindrop__drag drag = raindrop__drag_of(radius);
    double fall = (double)wind[1] - velocity[1], sideways[2], left = h;
    raindrop__phase phase;
    sideways[0] = velocity[0] - (double)wind[0];
    sideways[1] = velocity[2] - (double)wind[2];
    way[0] = (double)wind[0] * h;
    way[1] = (double)wind[1] * h;
    way[2] = (double)wind[2] * h;
    if (fall < 0) {
        phase = raindrop__rise(-fall, &drag, &left);
        raindrop__drift(&sideways[0], &way[0], phase.damping, h - left);
        raindrop__drift(&sideways[1], &way[2], phase.damping, h - left);
        way[1] -= phase.way;
        fall = phase.speed;
    }
    if (left > 0) {
        phase = raindrop__sink(fall, &drag, left);
        raindrop__drift(&sideways[0], &way[0], phase.damping, left);
        raindrop__drift(&sideways[1], &way[2], phase.damping, left);
        way[1] -= phase.way;
        fall = phase.speed;
    }
    velocity[0] = sideways[0] + (double)wind[0];
    velocity[1] = (double)wind[1] - fall;
    velocity[2] = sideways[1] + (double)wind[2];
}

RAINDROP_DEF sat_result raindrop_fall(raindrop_drop *drop, const float wind[3], double dt)
{
    double velocity[3], way[3];
    int i;
    if (!drop || !wind || !raindrop__finite3(wind) || !raindrop__finite3(drop->position) ||
        !raindrop__finite3(drop->velocity))
        return SAT_ERR_ARGUMENT;
    if (!sat__is_finite(drop->radius) || !(drop->radius > 0) || !sat__is_finite_double(dt) || dt < 0)
        return SAT_ERR_ARGUMENT;
    if (dt == 0) return SAT_OK;
    for (i = 0; i < 3; i++) velocity[i] = (double)drop->velocity[i];
    raindrop__step(velocity, way, (double)drop->radius, wind, dt);
    for (i = 0; i < 3; i++) {
        way[i] += (double)drop->position[i];
        if (!(fabs(way[i]) < 3e38) || !(fabs(velocity[i]) < 3e38)) return SAT_ERR_ARGUMENT;
    }
    for (i = 0; i < 3; i++) {
        drop->velocity[i] = (float)velocity[i];
        drop->position[i] = (float)way[i];
    }
    return SAT_OK;
}

/* ---- sizes */

/* What all drops of a step share. rise: speed of the box upwards in this step; through: the same through the air, which
   may move up or down; fastest: speed of the largest drops through the box. */
typedef struct raindrop__advance_job { raindrop_rain *rain; double dt, rise, through, fastest; } raindrop__advance_job;

/* A diameter in mm. In a volume (no plane) sizes are Marshall-Palmer's, by the inverse of its integral; at a plane that
   rises through the air they arrive weighted with their speed through it: a diameter is taken with that probability
   over the fastest's, else the next one is tried. */
static inline double raindrop__diameter(const raindrop_rain_options *o, uint32_t stream, uint32_t i,
                                        const raindrop__advance_job *plane)
{
    double lambda = raindrop__lambda(o->rate_mm_h), span = o->diameter_max_mm - o->diameter_min_mm,
           all = -expm1(-lambda * span), d;
    uint32_t attempt;
    if (o->diameter_mm > 0) return o->diameter_mm;
    for (attempt = 0;; attempt++) {
        uint32_t bits = raindrop__hash(o->seed, stream + 16 + attempt, i);
        d = o->diameter_min_mm - log1p(-(double)raindrop__uniform(bits) * all) / lambda;
        if (!plane || o->speed > 0 || attempt == 255) return d;
        if ((double)raindrop__uniform(raindrop__mix(bits)) * plane->fastest <
            raindrop_terminal_velocity(d) + plane->through)
            return d;
    }
}

static inline void raindrop__give_size(raindrop_drop *drop, const raindrop_rain_options *o, double diameter_mm)
{
    double speed = o->speed > 0 ? (double)o->speed : raindrop_terminal_velocity(diameter_mm);
    drop->radius = (float)(diameter_mm * 0.5e-3);
    drop->axis_ratio = o->oblate ? (float)raindrop_oblateness(diameter_mm) : 1;
    raindrop__set(drop->velocity, o->wind[0], o->wind[1] - (float)speed, o->wind[2]);
}

static inline float raindrop__place(const raindrop_rain_options *o, int axis, uint32_t bits)
{
    return o->centre[axis] + (raindrop__uniform(bits) - 0.5f) * o->box_size[axis];
}

static void raindrop__create_range(int begin, int end, int worker, void *context)
{
    raindrop_rain *rain = (raindrop_rain *)context;
    const raindrop_rain_options *o = &rain->options;
    int i, axis, last = sat__min_int(end * RAINDROP__CHUNK, rain->count);
    (void)worker;
    for (i = begin * RAINDROP__CHUNK; i < last; i++) {
        raindrop_drop *drop = &rain->drops[i];
        for (axis = 0; axis < 3; axis++)
            drop->position[axis] = raindrop__place(o, axis, raindrop__hash(o->seed, (uint32_t)axis, (uint32_t)i));
        raindrop__give_size(drop, o, raindrop__diameter(o, 0, (uint32_t)i, NULL));
    }
}

/* ---- one step of all drops */

static inline float raindrop__wrap(double position, double low, double size)
{
    double inside = position - floor((position - low) / size) * size;
    return (float)(inside < low + size ? inside : low);
}

/* Seconds after which even the fastest drop has crossed the box so often. */
static inline double raindrop__forgets(const raindrop_rain_options *o, double fastest)
{
    return fastest > 0 ? RAINDROP__FORGETS * (double)o->box_size[1] / fastest : 1e300;
}

/* Out below since `left` seconds: another drop comes in on top, one more for each crossing of the box that the time
   allows. After many crossings the box is again what it was in the beginning: any size of a volume at any height. */
static inline void raindrop__reenter(raindrop_drop *drop, double at[3], const raindrop__advance_job *job, double below,
                                     uint32_t i)
{
    const raindrop_rain_options *o = &job->rain->options;
    double size = (double)o->box_size[1], top = (double)o->centre[1] + size / 2,
           old = job->rise - (double)drop->velocity[1], left = old > 0 ? below / old : 0, speed;
    uint32_t stream = job->rain->step * 512u;
    int turn;
    if (o->diameter_mm > 0) {
        at[1] = top - fmod(below, size);
        return;
    }
    if (left > raindrop__forgets(o, job->fastest)) {
        raindrop__give_size(drop, o, raindrop__diameter(o, stream, i, NULL));
        below = (double)raindrop__uniform(raindrop__hash(o->seed, stream + 1, i)) * size;
    } else {
        for (turn = 0;; turn++, stream += RAINDROP__TURN) {
            raindrop__give_size(drop, o, raindrop__diameter(o, stream, i, job));
            speed = job->rise - (double)drop->velocity[1];
            if (!(left * speed >= size) || turn == 255) break;
            left -= size / speed;
        }
        below = speed > 0 ? left * speed : 0;
    }
    at[0] = (double)raindrop__place(o, 0, raindrop__hash(o->seed, stream, i));
    at[2] = (double)raindrop__place(o, 2, raindrop__hash(o->seed, stream + 2, i));
    at[1] = top - fmod(below, size);
}

/* The drag of one drop, or none once all are settled; returns whether its velocity still changes. */
static inline int raindrop__move(double way[3], raindrop_drop *drop, const raindrop_rain *rain, double dt)
{
    double velocity[3];
    int axis, moving = 0;
    for (axis = 0; axis < 3; axis++) {
        velocity[axis] = (double)drop->velocity[axis];
        way[axis] = velocity[axis] * dt;
    }
    if (rain->settled || !(drop->radius > 0) || !(dt > 0)) return 0;
    raindrop__step(velocity, way, (double)drop->radius, rain->options.wind, dt);
    for (axis = 0; axis < 3; axis++) {
        float v = (float)velocity[axis];
        moving |= fabsf(v - drop->velocity[axis]) > 1e-6f * fabsf(v);
        drop->velocity[axis] = v;
    }
    return moving;
}

/* Speed of the box upwards since its centre had this height, which becomes today's. */
static inline double raindrop__rise_of(float *height, const raindrop_rain_options *o, double dt)
{
    double way = (double)o->centre[1] - (double)*height;
    *height = o->centre[1];
    return dt > 0 ? way / dt : 0;
}

static void raindrop__advance_range(int begin, int end, int worker, void *context)
{
    const raindrop__advance_job *job = (const raindrop__advance_job *)context;
    raindrop_rain *rain = job->rain;
    const raindrop_rain_options *o = &rain->options;
    const int reenters = !rain->own && job->dt > 0; /* in a pause the box only wraps; else the fall brought them out */
    double way[3], low[3], at[3];
    int chunk, i, axis;
    (void)worker;
    for (axis = 0; axis < 3; axis++) low[axis] = (double)o->centre[axis] - (double)o->box_size[axis] / 2;
    for (chunk = begin; chunk < end; chunk++) {
        int last = sat__min_int((chunk + 1) * RAINDROP__CHUNK, rain->count), moving = 0;
        for (i = chunk * RAINDROP__CHUNK; i < last; i++) {
            raindrop_drop *drop = &rain->drops[i];
            moving |= raindrop__move(way, drop, rain, job->dt);
            for (axis = 0; axis < 3; axis++) at[axis] = (double)drop->position[axis] + way[axis];
            if (reenters && at[1] < low[1])
                raindrop__reenter(drop, at, job, low[1] - at[1], (uint32_t)i);
            for (axis = 0; axis < 3; axis++) {
                double size = (double)o->box_size[axis];
                int outside = !rain->own && (at[axis] < low[axis] || at[axis] >= low[axis] + size);
                drop->position[axis] = outside ? raindrop__wrap(at[axis], low[axis], size) : (float)at[axis];
            }
        }
        rain->unsettled[chunk] = moving;
    }
}

RAINDROP_DEF sat_result raindrop_rain_advance(raindrop_rain *rain, double dt)
{
    const raindrop_rain_options *o;
    raindrop__advance_job job;
    int chunk, chunks, moving = 0;
    if (!rain || !sat__is_finite_double(dt) || dt < 0) return SAT_ERR_ARGUMENT;
    o = &rain->options;
    chunks = raindrop__chunk_count(rain->count);
    job.rain = rain;
    job.dt = dt;
    job.rise = raindrop__rise_of(&rain->height, o, dt);
    job.through = job.rise - (double)o->wind[1];
    job.fastest = (o->speed > 0 ? (double)o->speed : raindrop_terminal_velocity(o->diameter_max_mm)) + job.through;
    if (dt > 0) rain->step++;
    rain->time = fmod(rain->time + fmod(dt, RAINDROP__PERIOD), RAINDROP__PERIOD);
    sat__parallel_for(&rain->options.threads, chunks, raindrop__advance_range, &job);
    for (chunk = 0; chunk < chunks; chunk++) moving |= rain->unsettled[chunk];
    if (dt > 0 && !moving) rain->settled = 1;
    return SAT_OK;
}

RAINDROP_DEF sat_result raindrop_rain_set_wind(raindrop_rain *rain, const float wind[3])
{
    if (!rain || !wind || !raindrop__finite3(wind)) return SAT_ERR_ARGUMENT;
    raindrop__set(rain->options.wind, wind[0], wind[1], wind[2]);
    rain->settled = rain->options.speed > 0; /* drops of one published speed know no drag */
    return SAT_OK;
}

RAINDROP_DEF sat_result raindrop_rain_set_centre(raindrop_rain *rain, const float centre[3])
{
    if (!rain || !centre || !raindrop__finite3(centre)) return SAT_ERR_ARGUMENT;
    raindrop__set(rain->options.centre, centre[0], centre[1], centre[2]);
    return SAT_OK;
}
#endif

/* Drops in a cubic metre and their area, so that their volumes times their speeds make the rate asked for. The sizes
   are Marshall-Palmer's; their own number with today's speeds would carry 11 (at 5 mm/h) to 14 % (at 1) more than the
   rate they are named after. */
static inline double raindrop__density_of(double *area, const raindrop_rain_options *o)
{
    double lambda = raindrop__lambda(o->rate_mm_h), span = o->diameter_max_mm - o->diameter_min_mm, drops = 0,
           water = 0, shade = 0;
    const int steps = 256;
    int i;
    for (i = 0; i < steps; i++) {
        double d = o->diameter_mm > 0 ? o->diameter_mm : o->diameter_min_mm + span * (i + 0.5) / steps;
        double share = o->diameter_mm > 0 ? 1 : exp(-lambda * (d - o->diameter_min_mm));
        drops += share;
        shade += share * RAINDROP__PI / 4 * d * d * 1e-6;
        water += share * RAINDROP__PI / 6 * d * d * d * 1e-9 *
                 (o->speed > 0 ? (double)o->speed : raindrop_terminal_velocity(d));
    }
    *area = o->rate_mm_h * (1e-3 / 3600) * shade / water;
    return o->rate_mm_h * (1e-3 / 3600) * drops / water;
}

static inline double raindrop__expected_count(const raindrop_rain_options *o)
{
    double area;
    return raindrop__density_of(&area, o) * (double)o->box_size[0] * (double)o->box_size[1] * (double)o->box_size[2];
}

RAINDROP_DEF double raindrop_extinction(double rate_mm_h)
{
    raindrop_rain_options o = raindrop_rain_defaults();
    double area;
    if (!(rate_mm_h > 0 && rate_mm_h <= 1e6)) return 0;
    o.rate_mm_h = rate_mm_h;
    raindrop__density_of(&area, &o);
    return area;
}

/* Lays the object and its arrays out, once to measure and once on the block; returns where the object is. */
static inline raindrop_rain *raindrop__rain_layout(raindrop_rain *rain, sat__arena *arena, int capacity, int workers)
{
    raindrop_rain *place = (raindrop_rain *)sat__carve(arena, 1, sizeof *rain);
    size_t n = (size_t)sat__max_int(capacity, 1);
    rain->drops = (raindrop_drop *)sat__carve(arena, n, sizeof(raindrop_drop));
    rain->visible = (raindrop__visible *)sat__carve(arena, n, sizeof(raindrop__visible));
    rain->pairs[0] = (uint64_t *)sat__carve(arena, n, sizeof(uint64_t));
    rain->pairs[1] = (uint64_t *)sat__carve(arena, n, sizeof(uint64_t));
    rain->rows = (uint32_t *)sat__carve(arena, n, sizeof(uint32_t));
    rain->chunks = (raindrop__chunk *)sat__carve(arena, n / RAINDROP__CHUNK + 1, sizeof(raindrop__chunk));
    rain->unsettled = (int *)sat__carve(arena, n / RAINDROP__CHUNK + 1, sizeof(int));
    rain->tally = (raindrop__tally *)sat__carve(arena, (size_t)workers, sizeof(raindrop__tally));
    return place;
}

RAINDROP_DEF sat_result raindrop_rain_create(raindrop_rain **out, const raindrop_rain_options *options)
{
    raindrop_rain_options o = options ? *options : raindrop_rain_defaults();
    raindrop_rain layout, *rain;
    sat__arena arena = {0, 0, 0};
    sat__text ignored = sat__text_begin(NULL, 0);
    double expected;
    sat_result result;
    int count, workers;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    memset(&layout, 0, sizeof layout);
    if (!raindrop__rain_is_valid(&ignored, &o) || !sat__resolve_allocator(&layout.allocator, &o.allocator))
        return SAT_ERR_ARGUMENT;
    expected = o.drops || o.count ? (double)o.count : raindrop__expected_count(&o);
    if (expected > RAINDROP__MAX_DROPS) return SAT_ERR_LIMIT;
    count = (int)(expected + 0.5);
    workers = sat__worker_count(&o.threads);
    raindrop__rain_layout(&layout, &arena, count, workers);
    result = sat__arena_allocate(&arena, &layout.block, &layout.bytes, &layout.allocator);
    if (result != SAT_OK) return result;
    rain = raindrop__rain_layout(&layout, &arena, count, workers);
    layout.options = o;
    layout.options.drops = NULL;
    layout.height = o.centre[1];
    layout.count = layout.capacity = count;
    layout.own = o.drops != NULL;
    layout.settled = !layout.own;
    *rain = layout;
    if (o.drops && count) memcpy(rain->drops, o.drops, (size_t)count * sizeof *rain->drops);
#ifndef RAINDROP_NO_RAIN
    if (!o.drops) sat__parallel_for(&o.threads, raindrop__chunk_count(count), raindrop__create_range, rain);
#endif
    *out = rain;
    return SAT_OK;
}

RAINDROP_DEF void raindrop_rain_destroy(raindrop_rain *rain)
{
    if (rain) raindrop__release(rain->allocator, rain->block, rain->bytes);
}

RAINDROP_DEF const raindrop_drop *raindrop_rain_drops(int *count, const raindrop_rain *rain)
{
    if (count) *count = rain ? rain->count : 0;
    return rain ? rain->drops : NULL;
}

RAINDROP_DEF sat_result raindrop_rain_set_drops(raindrop_rain *rain, const raindrop_drop *drops, int count)
{
    if (!rain || (!drops && count) || count < 0 || count > rain->capacity) return SAT_ERR_ARGUMENT;
    if (count) memcpy(rain->drops, drops, (size_t)count * sizeof *drops);
    rain->count = count;
    rain->own = 1;
    rain->settled = 0;
    return SAT_OK;
}

/* ------------------------------------------------------------------------------------------------
   >> lamps   light of lamps through drops, and drops that oscillate

   A lamp is seen in a drop as one point, a glint, for each path that turns the view by the angle theta between the view
   and the lamp: the mirrored ray, b = cos(theta/2); order 0, tan r = sin(theta/2) / (n - cos(theta/2)), b = n sin r;
   order 1, two of them beyond the bow's angle, by Newton's method. Of an irradiance E the drop sends E r^2 G to the
   eye, G = share d(b^2) / (2 d(-cos theta)): of a lamp of half width a the mean over theta - a .. theta + a, which is
   finite at the bow too. Near drops, D radii away, show it along a ray that leaves the axis by alpha, sin(alpha) = b/D:
   theta is smaller by alpha for the mirrored ray and larger for the others, found by iteration. The shares are those of
   raindrop_render with one internal reflection: the light of lamps from all sides sums to that of a white sky.

   Oscillation: the first two modes (Garg and Nayar 2006), at Rayleigh's frequencies omega^2 = n (n-1) (n+2) sigma /
   (rho r^3), n = 2 and 3, which those of Beard and Kubesh 1991 follow: the oblate-prolate one changes the axis ratio,
   the transverse one leans. A surface r (1 + e f(direction)) is curved 1 + (n-1) (n+2) e f times as much there, and a
   glint inversely bright: exp(-x sin(phase)) over its mean, Bessel's I0(x), keeps its light.
   ------------------------------------------------------------------------------------------------ */

/* Index of the drops, order 1's least angle, internal reflections that are drawn. */
typedef struct raindrop__water { float n, bow; int orders; } raindrop__water;

static inline raindrop__water raindrop__water_of(float n, int orders)
{
    raindrop__water water;
    water.n = n;
    water.orders = orders;
    water.bow = n > 1.1f && n < 1.9f ? (float)raindrop_bow_angle(1, (double)n) : 4; /* none, or not of this kind */
    return water;
}

enum { RAINDROP__GLINTS = 4 }; /* mirrored, order 0, order 1 by its inner and its outer ray */
#define RAINDROP__LEAST_LAMP 0.004 /* radians; lamps that look smaller are as wide as this, as the sun is */
#define RAINDROP__LEAST_GLINT 0.3f /* pixels; smaller ones of near drops are as large as this */
#define RAINDROP__NEAREST 0.25f    /* radii over distance: nearer drops show glints as if they were there */
#define RAINDROP__SWINGS 0.0004f   /* metres; drops of smaller radius do not swing */
#define RAINDROP__SWINGS_RISE 5000.0f /* share of the amplitude that a metre more brings, up to 1 */
#define RAINDROP__OVERTONE 1.9364917f /* sqrt(15/4): the second mode's frequency over the first's */
#define RAINDROP__LEAN 2.07f       /* the transverse mode's largest height, of P31 */
#define RAINDROP__FLICKERS 0.6f    /* largest exponent of a far drop's first mode; the second's is more by */
#define RAINDROP__FLICKERS_MORE 2.5f

typedef struct raindrop__swing { float amplitude, cycles[2], rate[2], lean[2]; } raindrop__swing;

/* Phases, in turns, and frequencies of a drop, and where to it leans; amplitude 0: it does not swing. */
static inline raindrop__swing raindrop__swing_of(const raindrop_rain *rain, uint32_t index, float oscillation)
{
    raindrop__swing s = {0, {0, 0}, {0, 0}, {0, 0}};
    float r = rain->drops[index].radius, frequency;
    int k;
    if (!(oscillation > 0) || !(r > RAINDROP__SWINGS)) return s;
    s.amplitude = oscillation * raindrop__clamp((r - RAINDROP__SWINGS) * RAINDROP__SWINGS_RISE, 0, 1);
    frequency = sqrtf((float)(8 * RAINDROP__TENSION / RAINDROP__DENSITY) / (r * r * r)) * (float)(0.5 / RAINDROP__PI);
    for (k = 0; k < 2; k++) {
        uint32_t bits = raindrop__hash(rain->options.seed, 8 + (uint32_t)k, index);
        double turns;
        s.rate[k] = floorf(frequency * (float)RAINDROP__PERIOD) / (float)RAINDROP__PERIOD;
        frequency *= RAINDROP__OVERTONE;
        turns = (double)s.rate[k] * rain->time;
        s.cycles[k] = raindrop__uniform(bits) + (float)(turns - floor(turns));
        if (k) continue;
        s.lean[0] = cosf((float)(2 * RAINDROP__PI) * raindrop__uniform(raindrop__mix(bits)));
        s.lean[1] = sinf((float)(2 * RAINDROP__PI) * raindrop__uniform(raindrop__mix(bits)));
    }
    return s;
}

static inline float raindrop__sine_of(float turns) { return sinf((float)(2 * RAINDROP__PI) * (turns - floorf(turns))); }

/* The axis ratio `dt` seconds from now. */
static inline float raindrop__swung(float ratio, const raindrop__swing *s, float dt)
{
    return ratio * (1 + s->amplitude * raindrop__sine_of(s->cycles[0] + s->rate[0] * dt));
}

static inline float raindrop__bessel(float x)
{
    float q = 0.25f * x * x;
    return 1 + q * (1 + q * (1.0f / 4 + q * (1.0f / 36 + q * (1.0f / 576 + q / 14400))));
}

/* Brightness over its mean, `dt` seconds from now, over `span` seconds: of both modes exp(x sin phase)/I0(x). */
static inline float raindrop__flicker(const float x[2], const raindrop__swing *s, float dt, float span)
{
    float sum = 0, mean = 1;
    int k;
    for (k = 0; k < 2; k++) {
        float turn = (float)RAINDROP__PI * s->rate[k] * span, v = x[k] * (turn > 0.01f ? sinf(turn) / turn : 1);
        sum += v * raindrop__sine_of(s->cycles[k] + s->rate[k] * dt);
        mean *= raindrop__bessel(v);
    }
    return expf(sum) / mean;
}

/* The modes' exponents where the surface has the unit normal n: P2 changes the ratio by 3/2 of its own height; the
   transverse mode P31 cos(angle), over its largest value, is as high. */
static inline void raindrop__flicker_at(float x[2], const raindrop__swing *s, const float n[3])
{
    float y2 = n[1] * n[1], e = s->amplitude / 1.5f;
    x[0] = -4 * e * (1.5f * y2 - 0.5f);
    x[1] = -10 * e * 1.5f * (5 * y2 - 1) * (n[0] * s->lean[0] + n[2] * s->lean[1]) / RAINDROP__LEAN;
}

/* b^2 of the rays of a path that turn by `angle`, at its ends where there are none; path: as RAINDROP__GLINTS. */
static inline float raindrop__turned_b2(float angle, int path, const raindrop__water *water)
{
    const float n = water->n;
    float half_sine = sinf(0.5f * angle), half_cosine = cosf(0.5f * angle), bow2, b, e, bend;
    int i;
    if (path == 0) return half_cosine * half_cosine;
    if (path == 1) { /* tan r = sin/(n - cos); beyond the last ray: 1 */
        if (n < 1 ? n >= half_cosine : n * half_cosine <= 1) return n < 1 ? n * n : 1;
        return n * n * half_sine * half_sine / (1 + n * n - 2 * n * half_cosine);
    }
    bow2 = raindrop__clamp((4 - n * n) / 3, 0, 1);
    b = sqrtf(bow2);
    e = angle - water->bow;
    if (!(e > 0)) return bow2;
    /* around the bow the angle is a parabola */
    bend = 2 * b / ((1 - bow2) * sqrtf(1 - bow2) + 1e-6f) -
           4 * b / (n * n * n * (1 - bow2 / (n * n)) * sqrtf(1 - bow2 / (n * n)));
    b = raindrop__clamp(b + (path == 2 ? -1 : 1) * sqrtf(2 * e / (bend > 0.1f ? bend : 0.1f)), path == 2 ? 0 : b,
                        path == 2 ? b : 1);
    for (i = 0; i < 6; i++) {
        float slope = 2 / (sqrtf((1 - b) * (1 + b)) + 1e-4f) - 4 / sqrtf(n * n - b * b);
        b -= ((float)RAINDROP__PI + 2 * asinf(b) - 4 * asinf(b / n) - angle) / slope;
        b = path == 2 ? raindrop__clamp(b, 0, sqrtf(bow2)) : raindrop__clamp(b, sqrtf(bow2), 1);
    }
    return b * b;
}

/* Share of a path at b^2: without further orders, order 0 has theirs. */
static inline float raindrop__path_share(float b2, int path, const raindrop__water *water)
{
    raindrop__optics o = raindrop__refract(1 - b2, water->n);
    const int orders = water->orders;
    if (path == 0) return 0.5f * (o.fs + o.fp);
    if (o.total) return 0;
    if (path == 1)
        return orders ? 0.5f * ((1 - o.fs) * (1 - o.fs) + (1 - o.fp) * (1 - o.fp)) : 1 - 0.5f * (o.fs + o.fp);
    return orders ? 0.5f * ((1 - o.fs) * o.fs + (1 - o.fp) * o.fp) : 0;
}

/* b^2 of the ray to the lamp that is `angle` off the axis from the eye to the drop, per_distance = 1/D. */
static inline float raindrop__glint_b2(float angle, int path, const raindrop__water *water, float per_distance)
{
    float b2 = raindrop__turned_b2(angle, path, water);
    int i;
    for (i = 0; per_distance > 0 && i < 8; i++) {
        float off = asinf(sqrtf(b2) * per_distance), next;
        next = raindrop__clamp(path ? angle + off : angle - off, 0, (float)RAINDROP__PI);
        b2 = 0.5f * (b2 + raindrop__turned_b2(next, path, water));
    }
    return b2;
}

/* A drop that is seen along a unit vector, its radius over its distance (0: far away); and a lamp as it sees it: a unit
   vector to it, its irradiance, half its width in radians; the angle between the two, less and plus that, and
   2 (cos low - cos high). */
typedef struct raindrop__lit {
    float along[3], per_distance, to[3], irradiance[3], width, cosine, angle, low, high, ring;
} raindrop__lit;

/* Fills what is the lamp's; 0: it is dark there. */
static inline int raindrop__light(raindrop__lit *lit, const raindrop_lamp *lamp, const raindrop_drop *drop)
{
    float distance, axis, share = 1;
    int c;
    raindrop__combine(lit->to, 1, lamp->position, -1, drop->position);
    distance = sqrtf(raindrop__dot(lit->to, lit->to));
    if (!(distance > drop->radius) || !sat__is_finite(distance)) return 0;
    raindrop__combine(lit->to, 1 / distance, lit->to, 0, lit->to);
    if (lamp->inner < 3.14f) {
        axis = acosf(raindrop__clamp(-raindrop__dot(lit->to, lamp->direction), -1, 1));
        share = axis <= lamp->inner  ? 1
                : axis < lamp->outer ? (lamp->outer - axis) / (lamp->outer - lamp->inner)
                                     : 0;
        share *= share * (3 - 2 * share);
    }
    lit->width = lamp->radius / (distance > lamp->radius ? distance : lamp->radius);
    if (!(lit->width > (float)RAINDROP__LEAST_LAMP)) lit->width = (float)RAINDROP__LEAST_LAMP;
    for (c = 0; c < 3; c++) lit->irradiance[c] = share * lamp->intensity[c] / (distance * distance);
    lit->cosine = raindrop__clamp(raindrop__dot(lit->along, lit->to), -1, 1);
    lit->angle = acosf(lit->cosine);
    lit->low = lit->angle > lit->width ? lit->angle - lit->width : 0;
    lit->high = lit->angle + lit->width < (float)RAINDROP__PI ? lit->angle + lit->width : (float)RAINDROP__PI;
    lit->ring = 4 * sinf(0.5f * (lit->low + lit->high)) * sinf(0.5f * (lit->high - lit->low));
    return share > 0;
}

/* A path to a lamp: b^2, G without its share, the share; 0: there is none. */
typedef struct raindrop__way { float b2, g, share; } raindrop__way;

static inline int raindrop__find_way(raindrop__way *out, const raindrop__lit *lit, int path,
                                     const raindrop__water *water)
{
    const float per = lit->per_distance, per2 = per * per;
    if (path == 0 && !(per > 0)) { /* the usual case */
        out->b2 = 0.5f + 0.5f * lit->cosine;
        out->g = 0.25f;
    } else {
        float low, high;
        if (path > 1 && (!water->orders || lit->high + 1.02f * per < water->bow)) return 0;
        low = raindrop__glint_b2(lit->low, path, water, per);
        high = raindrop__glint_b2(lit->high, path, water, per);
        out->g = fabsf(high - low) / (lit->ring + 1e-9f) * (1 - per2) / sqrtf(1 - 0.5f * (low + high) * per2);
        if (!(out->g > 0)) return 0;
        out->b2 = raindrop__glint_b2(lit->angle, path, water, per);
    }
    out->share = raindrop__path_share(out->b2, path, water);
    return out->share > 0;
}

/* A glint: the unit vector that shows it; what it sends, E G; its radius in radii of the drop; the normal where its
   light enters. */
typedef struct raindrop__glint { float seen[3], light[3], radius, normal[3]; } raindrop__glint;

static inline int raindrop__glint_of(raindrop__glint *out, const raindrop__lit *lit, int path,
                                     const raindrop__water *water)
{
    const float *d = lit->along;
    float b, side[3], p[3], off, sign = path && water->n > 1 ? -1.0f : 1;
    raindrop__way way;
    int c;
    if (!raindrop__find_way(&way, lit, path, water)) return 0;
    b = sqrtf(way.b2);
    off = b * lit->per_distance;
    raindrop__combine(side, 1, lit->to, -lit->cosine, d);
    if (!(raindrop__dot(side, side) > 1e-12f)) raindrop__perpendicular(side, p, d);
    raindrop__normalise(side);
    raindrop__combine(out->seen, sqrtf(1 - off * off), d, sign * off, side);
    raindrop__combine(p, sign * b * sqrtf(1 - off * off), side, -b * off, d);
    raindrop__combine(out->normal, -sqrtf((1 - b) * (1 + b)), out->seen, 1, p);
    out->radius = lit->width * sqrtf(way.g);
    for (c = 0; c < 3; c++) out->light[c] = lit->irradiance[c] * way.share * way.g;
    return 1;
}

/* Adds the lamps' light to that of a far drop, the mean over its disc. */
RAINDROP__APART void raindrop__far_lamps(float colour[3], const raindrop_render_options *o, const raindrop_drop *drop,
                                         const float d[3], const raindrop__water *water)
{
    raindrop__lit lit;
    raindrop__way way;
    int i, path, c;
    raindrop__set(lit.along, d[0], d[1], d[2]);
    lit.per_distance = 0;
    for (i = 0; i < o->lamp_count; i++) {
        float sum = 0;
        if (!raindrop__light(&lit, &o->lamps[i], drop)) continue;
        for (path = 0; path < RAINDROP__GLINTS; path++)
            if (raindrop__find_way(&way, &lit, path, water)) sum += way.share * way.g;
        for (c = 0; c < 3; c++) colour[c] += lit.irradiance[c] * sum * (float)(1 / RAINDROP__PI);
    }
}

/* ------------------------------------------------------------------------------------------------
   >> picture   what is seen, and in what order

   1 cull: each drop to a fate and, if it may be seen, a record; 2 sort the records from far to near; 3 draw bands of
   rows, each by one worker, all drops in order. In a band the fragments of near drops are gathered in a batch, traced
   as vectors, looked up and blended.
   ------------------------------------------------------------------------------------------------ */

RAINDROP_DEF raindrop_camera raindrop_camera_look(const float position[3], const float target[3], const float up[3],
                                                  float fov_y)
{
    raindrop_camera camera = raindrop_camera_defaults();
    float side[3], along;
    if (!position || !target || !up) return camera;
    raindrop__set(camera.position, position[0], position[1], position[2]);
    raindrop__combine(camera.back, 1, position, -1, target);
    raindrop__normalise(camera.back);
    if (!(raindrop__dot(camera.back, camera.back) > 0)) camera.back[2] = 1;
    along = raindrop__dot(up, camera.back);
    raindrop__combine(camera.up, 1, up, -along, camera.back);
    if (raindrop__dot(camera.up, camera.up) <= 1e-8f * raindrop__dot(up, up))
        raindrop__perpendicular(side, camera.up, camera.back);
    raindrop__normalise(camera.up);
    raindrop__set(camera.right, camera.up[1] * camera.back[2] - camera.up[2] * camera.back[1],
                  camera.up[2] * camera.back[0] - camera.up[0] * camera.back[2],
                  camera.up[0] * camera.back[1] - camera.up[1] * camera.back[0]);
    camera.fov_y = fov_y;
    return camera;
}

enum { RAINDROP__BAND = 16, RAINDROP__BATCH = 128 };
#define RAINDROP__LEAST_RADIUS 1.4f /* pixels; smaller drops are far in every look but the sprites; and those that are
                                       blurred less than this are not round */
#define RAINDROP__LEAST_BLUR 0.61f  /* pixels; such a disc cancels what a lattice of pixels would add */
#define RAINDROP__SHORT 2.5f        /* pixels; shorter streaks are two still drops, */
#define RAINDROP__GAUSS 0.288675f   /* of their length to each side of the middle: 1/(2 sqrt(3)) */
#define RAINDROP__FAR_BIT 0x80000000u

typedef struct raindrop__frame {
    raindrop_camera camera;
    raindrop_render_options options;
    const raindrop_rain *rain;
    const raindrop_environment *environment;
    const float *depth;
    unsigned char *rgb;
    ptrdiff_t stride;
    int width, height, visible;
    float focal, half_width, half_height; /* pixels */
    float side_x, side_y;                 /* lengths of the normals of the frustum's sides */
    const uint64_t *order;
    raindrop__water water;                /* with lamps */
} raindrop__frame;

/* A drop in view space: x right, y up, z forward; the quantities drawing starts from. radius: half axis across; reach:
   of a ball that holds the drop, however it swings. */
typedef struct raindrop__placed { float x, y, z, radius, distance2, flatness, reach; } raindrop__placed;

RAINDROP__APART void raindrop__swing_drop(raindrop__placed *placed, const raindrop__frame *frame, uint32_t index)
{
    const raindrop_drop *drop = &frame->rain->drops[index];
    const raindrop__swing swing = raindrop__swing_of(frame->rain, index, frame->options.oscillation);
    float tall = cbrtf(placed->flatness * (1 + swing.amplitude));
    if (!(swing.amplitude > 0)) return;
    placed->reach = drop->radius / cbrtf(placed->flatness * (1 - swing.amplitude));
    if (tall * tall * drop->radius > placed->reach) placed->reach = tall * tall * drop->radius;
    placed->flatness = raindrop__swung(placed->flatness, &swing, 0);
    placed->radius = drop->radius / cbrtf(placed->flatness);
}

static inline void raindrop__place_drop(raindrop__placed *placed, const raindrop__frame *frame, uint32_t index)
{
    const raindrop_drop *drop = &frame->rain->drops[index];
    float rel[3];
    raindrop__combine(rel, 1, drop->position, -1, frame->camera.position);
    placed->x = raindrop__dot(rel, frame->camera.right);
    placed->y = raindrop__dot(rel, frame->camera.up);
    placed->z = -raindrop__dot(rel, frame->camera.back);
    placed->flatness = drop->axis_ratio;
    /* half axis across: the sphere of equal volume has radius a ratio^(1/3) */
    placed->radius = drop->axis_ratio < 1 ? drop->radius / cbrtf(drop->axis_ratio) : drop->radius;
    placed->reach = placed->radius;
    if (frame->options.oscillation > 0) raindrop__swing_drop(placed, frame, index);
    placed->distance2 = placed->x * placed->x + placed->y * placed->y + placed->z * placed->z;
}

/* Where the drop's silhouette begins and ends in a direction of the picture, by the tangents from the eye; exact for
   z > radius, which the near plane guarantees. In units of the focal length. */
static inline void raindrop__tangents(float range[2], float u, float z, float radius)
{
    float q = sqrtf(u * u + z * z - radius * radius);
    range[0] = (u * q - radius * z) / (z * q + radius * u);
    range[1] = (u * q + radius * z) / (z * q - radius * u);
}

typedef struct raindrop__box { int x0, y0, x1, y1; } raindrop__box;

/* Rounded down or up after clamping to the picture: no call of floor. */
static inline int raindrop__pixel_down(float v, int limit)
{
    float inside = raindrop__clamp(v, 0, (float)limit);
    return (int)inside;
}

static inline int raindrop__pixel_up(float v, int limit)
{
    float inside = raindrop__clamp(v, 0, (float)limit);
    int down = (int)inside;
    return down + ((float)down < inside);
}

static inline raindrop__box raindrop__make_box(const raindrop__frame *frame, float x0, float y0, float x1, float y1)
{
    raindrop__box box;
    box.x0 = raindrop__pixel_down(x0, frame->width);
    box.y0 = raindrop__pixel_down(y0, frame->height);
    box.x1 = raindrop__pixel_up(x1, frame->width);
    box.y1 = raindrop__pixel_up(y1, frame->height);
    return box;
}

static inline int raindrop__is_sprite(const raindrop__frame *frame)
{
    return frame->options.look <= RAINDROP_LOOK_SPRITE;
}
static inline int raindrop__is_still(const raindrop__visible *v)
{
    return v->streak[0] * v->streak[0] + v->streak[1] * v->streak[1] + v->blur * v->blur < 0.0625f;
}

/* Half side in pixels of the published sprite: from the depth, not the Euclidean distance, which is the better of the
   two readings off axis; at least a pixel wide. */
static inline float raindrop__sprite_half(const raindrop__frame *frame, const raindrop__placed *placed)
{
    float half = frame->focal * placed->radius / sqrtf(placed->distance2 - placed->radius * placed->radius);
    half *= sqrtf(placed->distance2) / placed->z;
    return half > 0.5f ? half : 0.5f;
}

/* A far drop, moving or not: a parallelogram with the drop's area and, for every streak, its second moments: of a disc
   of area a that moves by (sx, sy), |sy| >= |sx| (else x and y change places), those of a square of that area and the
   way, (a + sx^2)/12, sx sy/12 and (a + sy^2)/12. Two edges are level: its share of a pixel is a sum of squares, and
   the shares of all pixels sum to its area exactly, wherever it stands. */
typedef struct raindrop__shape { float half_height, slope, half_width, opacity; int swapped; } raindrop__shape;

static inline raindrop__shape raindrop__far_shape(const raindrop__visible *v)
{
    raindrop__shape shape;
    float a, across, along, height2, way = fabsf(v->streak[0]) + fabsf(v->streak[1]) + v->blur;
    if (!(way > 0)) { /* the usual case: a square */
        shape.half_height = shape.half_width = RAINDROP__SQUARE * v->radius;
        shape.slope = 0;
        shape.opacity = 1;
        shape.swapped = 0;
        return shape;
    }
    a = (float)RAINDROP__PI * (v->radius * v->radius + v->blur * v->blur);
    shape.swapped = fabsf(v->streak[0]) > fabsf(v->streak[1]);
    across = shape.swapped ? v->streak[1] : v->streak[0];
    along = shape.swapped ? v->streak[0] : v->streak[1];
    height2 = along * along + a;
    shape.slope = across * along / height2;
    shape.half_height = 0.5f * sqrtf(height2);
    shape.half_width = 0.5f * sqrtf(a * (1 + across * across / height2));
    shape.opacity = (float)RAINDROP__PI * v->radius * v->radius / (4 * shape.half_height * shape.half_width);
    return shape;
}

/* Far drops that are blurred much stay round. */
static inline int raindrop__is_round(const raindrop__visible *v) { return v->blur > RAINDROP__LEAST_RADIUS; }

static inline float raindrop__path_radius(const raindrop__visible *v)
{
    return v->blur > 0.25f ? sqrtf(v->radius * v->radius + v->blur * v->blur) : v->radius;
}

/* The pixels a drop may touch; placed: not looked at for far drops. */
static inline raindrop__box raindrop__bounds(const raindrop__frame *frame, const raindrop__visible *v,
                                             const raindrop__placed *placed)
{
    float across[2], up[2], ax = 0.5f * fabsf(v->streak[0]) + 0.5f + v->blur,
                            ay = 0.5f * fabsf(v->streak[1]) + 0.5f + v->blur;
    if (raindrop__is_sprite(frame)) {
        float half = raindrop__sprite_half(frame, placed);
        return raindrop__make_box(frame, ceilf(v->x - half - 0.5f), ceilf(v->y - half - 0.5f),
                                  floorf(v->x + half - 0.5f) + 1, floorf(v->y + half - 0.5f) + 1);
    }
    if (v->drop & RAINDROP__FAR_BIT) {
        if (raindrop__is_round(v)) {
            ax += v->radius;
            ay += v->radius;
        } else {
            raindrop__shape shape = raindrop__far_shape(v);
            float wide = shape.half_width + fabsf(shape.slope) * shape.half_height;
            ax = shape.swapped ? shape.half_height : wide;
            ay = shape.swapped ? wide : shape.half_height;
        }
        return raindrop__make_box(frame, v->x - ax, v->y - ay, v->x + ax, v->y + ay);
    }
    raindrop__tangents(across, placed->x, placed->z, placed->reach);
    raindrop__tangents(up, placed->y, placed->z, placed->reach);
    return raindrop__make_box(
        frame, frame->half_width + frame->focal * across[0] - ax, frame->half_height - frame->focal * up[1] - ay,
        frame->half_width + frame->focal * across[1] + ax, frame->half_height - frame->focal * up[0] + ay);
}

/* A scene depth that lies in front. */
static inline int raindrop__occluded(const raindrop__frame *frame, size_t pixel, float depth)
{
    float scene;
    if (!frame->depth) return 0;
    scene = frame->depth[pixel];
    return scene > 0 && scene < depth && sat__is_finite(scene);
}

static inline int raindrop__all_occluded(const raindrop__frame *frame, const raindrop__box *box, float depth)
{
    int x, y;
    if (!frame->depth) return 0;
    for (y = box->y0; y < box->y1; y++)
        for (x = box->x0; x < box->x1; x++)
            if (!raindrop__occluded(frame, (size_t)y * (size_t)frame->width + (size_t)x, depth)) return 0;
    return 1;
}

/* ---- 1 cull */

#ifndef RAINDROP_NO_STREAK
static inline void raindrop__add_motion(raindrop__visible *v, const raindrop__frame *frame,
                                        const raindrop__placed *placed, const raindrop_drop *drop)
{
    const raindrop_camera *camera = &frame->camera;
    float relative[3], vx, vy, vz, scale = frame->focal * camera->exposure / placed->z;
    if (camera->exposure > 0) {
        raindrop__combine(relative, 1, drop->velocity, -1, camera->velocity);
        vx = raindrop__dot(relative, camera->right);
        vy = raindrop__dot(relative, camera->up);
        vz = -raindrop__dot(relative, camera->back);
        v->streak[0] = raindrop__clamp(scale * (vx - placed->x / placed->z * vz), -1e5f, 1e5f);
        v->streak[1] = raindrop__clamp(-scale * (vy - placed->y / placed->z * vz), -1e5f, 1e5f);
    }
    if (camera->aperture > 0)
        v->blur = raindrop__clamp(
            0.5f * camera->aperture * frame->focal * fabsf(1 / placed->z - 1 / camera->focus_distance), 0, 1e5f);
    if (v->streak[0] * v->streak[0] + v->streak[1] * v->streak[1] + v->blur * v->blur < 1e-4f)
        v->streak[0] = v->streak[1] = v->blur = 0;
}
#endif

static inline raindrop__fate raindrop__reject(const raindrop__frame *frame, const raindrop_drop *drop,
                                              const raindrop__placed *placed, float reach)
{
    float r = placed->reach;
    float all = fabsf(drop->velocity[0]) + fabsf(drop->velocity[1]) + fabsf(drop->velocity[2]) +
                placed->distance2; /* finite if all are */
    if (!sat__is_finite(all) || !sat__is_finite(r) || !(r > 0) || !(drop->axis_ratio > 0 && drop->axis_ratio <= 1))
        return RAINDROP__INVALID;
    if (placed->distance2 <= 1.0001f * r * r) return RAINDROP__INSIDE;
    if (placed->z <= 0) return RAINDROP__BEHIND;
    if (!(placed->z - r > frame->camera.depth_near) || !(placed->z > 1.0001f * r)) return RAINDROP__NEAR_PLANE;
    reach = r + reach * placed->z / frame->focal;
    if (fabsf(placed->x) * frame->focal - placed->z * frame->half_width > reach * frame->side_x)
        return RAINDROP__OUTSIDE;
    if (fabsf(placed->y) * frame->focal - placed->z * frame->half_height > reach * frame->side_y)
        return RAINDROP__OUTSIDE;
    return RAINDROP__NEAR;
}

/* Direction from the eye to a view-space point, in the world. */
static inline void raindrop__to_world(float out[3], const raindrop_camera *camera, float x, float y, float forward)
{
    int i;
    for (i = 0; i < 3; i++) out[i] = x * camera->right[i] + y * camera->up[i] - forward * camera->back[i];
}

/* Far drops whose light changes along their streak. */
static inline int raindrop__flickers(const raindrop__frame *frame, const raindrop_drop *drop)
{
    return frame->options.oscillation > 0 && drop->radius > RAINDROP__SWINGS;
}

static inline raindrop__fate raindrop__cull(raindrop__visible *v, const raindrop__frame *frame, uint32_t index,
                                            double *left_out)
{
    const raindrop_drop *drop = &frame->rain->drops[index];
    raindrop__placed placed;
    raindrop__fate fate;
    raindrop__box box;
    float tangent2, stretch, area, world[3], colour[4];
    raindrop__place_drop(&placed, frame, index);
    v->streak[0] = v->streak[1] = v->blur = 0;
    fate = raindrop__reject(frame, drop, &placed, 1);
    if (fate == RAINDROP__INVALID || fate == RAINDROP__INSIDE || fate == RAINDROP__BEHIND ||
        fate == RAINDROP__NEAR_PLANE)
        return fate;
#ifndef RAINDROP_NO_STREAK
    if (!raindrop__is_sprite(frame) && (frame->camera.exposure > 0 || frame->camera.aperture > 0)) {
        raindrop__add_motion(v, frame, &placed, drop);
        fate = raindrop__reject(frame, drop, &placed, 1 + v->blur + 0.5f * (fabsf(v->streak[0]) + fabsf(v->streak[1])));
    }
#endif
    if (fate != RAINDROP__NEAR) return fate;
    /* the silhouette is an ellipse of half axes f tan and about f tan / cos^2 of the angle off axis: area f^2 tan^2 pi
       / cos^3 */
    tangent2 = placed.radius * placed.radius / (placed.distance2 - placed.radius * placed.radius);
    stretch = sqrtf(placed.distance2) / placed.z;
    v->radius = frame->focal * sqrtf(tangent2 * placed.flatness * stretch * stretch * stretch);
    area = (float)RAINDROP__PI * v->radius * v->radius;
    if (area < frame->options.coverage_threshold) {
        *left_out += (double)area;
        return RAINDROP__BELOW;
    }
    v->x = frame->half_width + frame->focal * placed.x / placed.z;
    v->y = frame->half_height - frame->focal * placed.y / placed.z;
    v->depth = placed.z;
    v->drop = index;
    if (!raindrop__is_sprite(frame) &&
        v->radius < (frame->options.look == RAINDROP_LOOK_AUTO && frame->options.far_radius > RAINDROP__LEAST_RADIUS
                         ? frame->options.far_radius
                         : RAINDROP__LEAST_RADIUS)) {
        v->drop |= RAINDROP__FAR_BIT;
        fate = RAINDROP__FAR;
    }
    box = raindrop__bounds(frame, v, &placed);
    if (box.x0 >= box.x1 || box.y0 >= box.y1) return RAINDROP__OUTSIDE;
    if (raindrop__all_occluded(frame, &box, v->depth)) return RAINDROP__HIDDEN;
    v->rows = (uint32_t)box.y0 << 16 | (uint32_t)box.y1;
    if (fate == RAINDROP__FAR) {
        raindrop__to_world(world, &frame->camera, placed.x, placed.y, placed.z);
        raindrop__far(colour, frame->environment, world);
        raindrop__set(v->colour, colour[0], colour[1], colour[2]);
        if (frame->options.lamp_count > 0 && !raindrop__flickers(frame, drop)) {
            raindrop__normalise(world);
            raindrop__far_lamps(v->colour, &frame->options, drop, world, &frame->water);
        }
    }
    return fate;
}

static void raindrop__cull_range(int begin, int end, int worker, void *context)
{
    const raindrop__frame *frame = (const raindrop__frame *)context;
    int chunk, i;
    (void)worker;
    for (chunk = begin; chunk < end; chunk++) {
        int first = chunk * RAINDROP__CHUNK, last = sat__min_int(first + RAINDROP__CHUNK, frame->rain->count);
        raindrop__chunk tally;
        memset(&tally, 0, sizeof tally);
        for (i = first; i < last; i++) {
            raindrop__fate fate = raindrop__cull(&frame->rain->visible[first + tally.visible], frame, (uint32_t)i,
                                                 &tally.coverage_left_out);
            tally.fates[fate]++;
            tally.visible += fate <= RAINDROP__FAR;
        }
        frame->rain->chunks[chunk] = tally;
    }
}

/* ---- 2 sort: a stable radix sort by depth, three passes of 11 bits */

static inline int raindrop__gather_pairs(const raindrop_rain *rain)
{
    int chunk, i, n = 0, chunks = raindrop__chunk_count(rain->count);
    for (chunk = 0; chunk < chunks; chunk++) {
        for (i = 0; i < rain->chunks[chunk].visible; i++, n++) {
            uint32_t at = (uint32_t)(chunk * RAINDROP__CHUNK + i);
            /* depths are positive: bits order as values do */
            rain->pairs[0][n] = (uint64_t)~sat__float_bits(rain->visible[at].depth) << 32 | at;
        }
    }
    return n;
}

static inline const uint64_t *raindrop__sort(const raindrop_rain *rain, int n, int sort)
{
    const uint64_t *order = rain->pairs[0];
    int i;
    if (sort) order = sat__radix_sort(rain->pairs[0], rain->pairs[1], (size_t)n, 32, 64, 11);
    for (i = 0; i < n; i++) rain->rows[i] = rain->visible[(uint32_t)order[i]].rows;
    return order;
}

/* ------------------------------------------------------------------------------------------------
   >> drawing   3: fragments of near drops in batches of arrays, far drops, streaks
   ------------------------------------------------------------------------------------------------ */

typedef struct raindrop__batch {
    const raindrop__frame *frame;
    raindrop__tally *tally;
    int count, samples; /* fragments; consecutive ones that are averaged before they are blended */
    int y0, y1;           /* rows of the band */
    float focal_in_radii; /* of the drop being drawn: z / (focal radius), so that q = pixels times this */
    raindrop__gaze gaze;  /* of a pixel; its orders -1: the short way without orders */
    float flatness;       /* of the drop being drawn */
    int slow;             /* flattened or swinging: no sphere */
    const raindrop__swing *swing; /* NULL: it does not change along the streak */
    const float *flicker; /* exponents of a far drop; NULL: one colour */
    float covers;         /* 1; 0: light is added, of lamps */
    float *pixel[RAINDROP__BATCH];
    float slope_x[RAINDROP__BATCH], slope_y[RAINDROP__BATCH]; /* the pixel's ray (x, y, -1) */
    float offset_x[RAINDROP__BATCH], offset_y[RAINDROP__BATCH]; /* q: where it passes the plane of the centre, in
                                                                   radii */
    float alpha[RAINDROP__BATCH], ratio[RAINDROP__BATCH]; /* axis ratio, with `swing` */
    float direction[3][RAINDROP__BATCH], closest[3][RAINDROP__BATCH], one_minus_b2[RAINDROP__BATCH];
    float reflected[3][RAINDROP__BATCH], refracted[3][RAINDROP__BATCH], fresnel[RAINDROP__BATCH], pass[RAINDROP__BATCH];
    float reflect_cone[RAINDROP__BATCH], refract_cone[RAINDROP__BATCH]; /* footprints in radians */
} raindrop__batch;

/* Share of a pixel on the inner side of a straight edge, s pixels from its middle: exact for any normal n, as the
   convolution of the two boxes that a square is. A rim of radius d has a straight edge's mean coverage where the edge
   lies 1/(24 d) farther in: half the curvature times the pixel's variance. Discs of a radius of 1 pixel or more so keep
   their area within 2 % wherever they stand, where the distance clamped to a pixel has 8 % too much, and swings. */
static inline float raindrop__half_plane(float s, float nx, float ny)
{
    float lo = fabsf(nx), hi = fabsf(ny), h, g, sum;
    if (lo > hi) {
        lo = hi;
        hi = fabsf(nx);
    }
    lo = lo > 0.01f ? lo : 0.01f;
    hi = hi > 0.7f ? hi : 0.7f;
    s = raindrop__clamp(s, -1, 1);
    h = 0.5f * (hi + lo);
    g = 0.5f * (hi - lo);
    sum = s + h > 0 ? (s + h) * (s + h) : 0;
    sum -= s + g > 0 ? (s + g) * (s + g) : 0;
    sum -= s - g > 0 ? (s - g) * (s - g) : 0;
    sum += s - h > 0 ? (s - h) * (s - h) : 0;
    return raindrop__clamp(0.5f * sum / (lo * hi), 0, 1);
}

/* The same for vectors: (gx, gy) any length but 0, per_length the inverse of it. */
static inline raindrop__v raindrop__half_plane_v(raindrop__v s, raindrop__v gx, raindrop__v gy, raindrop__v per_length)
{
    const raindrop__v zero = raindrop__splat(0), one = raindrop__splat(1), half = raindrop__splat(0.5f);
    raindrop__v nx = raindrop__mul(raindrop__abs(gx), per_length), ny = raindrop__mul(raindrop__abs(gy), per_length);
    raindrop__v lo = raindrop__max(raindrop__min(nx, ny), raindrop__splat(0.01f)),
                hi = raindrop__max(raindrop__max(nx, ny), raindrop__splat(0.7f));
    raindrop__v h = raindrop__mul(half, raindrop__add(hi, lo)), g = raindrop__mul(half, raindrop__sub(hi, lo));
    raindrop__v a, b, c, d;
    s = raindrop__min(raindrop__max(s, raindrop__splat(-1)), one);
    a = raindrop__max(raindrop__add(s, h), zero);
    b = raindrop__max(raindrop__add(s, g), zero);
    c = raindrop__max(raindrop__sub(s, g), zero);
    d = raindrop__max(raindrop__sub(s, h), zero);
    a = raindrop__add(raindrop__mul(a, a), raindrop__mul(d, d));
    b = raindrop__add(raindrop__mul(b, b), raindrop__mul(c, c));
    a = raindrop__div(raindrop__mul(half, raindrop__sub(a, b)), raindrop__mul(lo, hi));
    return raindrop__min(raindrop__max(a, zero), one);
}

/* b and its gradient at a pixel decide how much of it the drop covers; p and 1-b^2 stay this side of the rim. */
static inline void raindrop__batch_rays(raindrop__batch *batch, int keep_alpha)
{
    const raindrop_camera *camera = &batch->frame->camera;
    const raindrop__v one = raindrop__splat(1), rim = raindrop__splat(batch->slow ? 1e9f : RAINDROP__INNER);
    const raindrop__v k = raindrop__splat(batch->focal_in_radii), per_focal = raindrop__splat(1 / batch->frame->focal);
    int at, i;
    for (at = 0; at < batch->count; at += RAINDROP__LANES) {
        raindrop__v x = raindrop__load(batch->slope_x + at), y = raindrop__load(batch->slope_y + at);
        raindrop__v qx = raindrop__load(batch->offset_x + at), qy = raindrop__load(batch->offset_y + at);
        raindrop__v per_length2 =
            raindrop__div(one, raindrop__add(one, raindrop__add(raindrop__mul(x, x), raindrop__mul(y, y))));
        raindrop__v per_length = raindrop__sqrt(per_length2),
                    w = raindrop__add(raindrop__mul(qx, x), raindrop__mul(qy, y));
        raindrop__v t = raindrop__mul(w, per_length2); /* p = q - t (x, y, -1) */
        raindrop__v px = raindrop__sub(qx, raindrop__mul(t, x)), py = raindrop__sub(qy, raindrop__mul(t, y));
        raindrop__v b2 =
            raindrop__add(raindrop__add(raindrop__mul(px, px), raindrop__mul(py, py)), raindrop__mul(t, t));
        raindrop__v b = raindrop__sqrt(raindrop__max(b2, raindrop__splat(1e-12f))), inward, pz = t;
        if (!keep_alpha && batch->slow) raindrop__store(batch->alpha + at, one); /* raindrop__flat_cover knows */
        else if (!keep_alpha) {
            /* half the gradient of b^2: (q - t r) (k - t / f), without the small change of the ray's length */
            raindrop__v scale = raindrop__sub(k, raindrop__mul(t, per_focal));
            raindrop__v gx = raindrop__mul(px, scale), gy = raindrop__mul(py, scale);
            raindrop__v length = raindrop__sqrt(raindrop__add(raindrop__mul(gx, gx), raindrop__mul(gy, gy)));
            raindrop__v slope = raindrop__max(raindrop__div(length, b), raindrop__splat(1e-9f));
            raindrop__v inside = raindrop__div(raindrop__sub(one, b), slope); /* pixels */
            raindrop__v twice_apart =
                raindrop__max(raindrop__mul(raindrop__splat(24), b), raindrop__mul(raindrop__splat(12), slope));
            inside = raindrop__sub(inside, raindrop__div(slope, twice_apart));
            raindrop__store(batch->alpha + at,
                            raindrop__half_plane_v(inside, gx, gy,
                                                   raindrop__div(one, raindrop__max(length, raindrop__splat(1e-20f)))));
        }
        inward = raindrop__min(one, raindrop__div(rim, b));
        raindrop__store(batch->one_minus_b2 + at,
                        raindrop__max(raindrop__sub(one, b2), raindrop__splat(1 - RAINDROP__INNER * RAINDROP__INNER)));
        px = raindrop__mul(px, inward);
        py = raindrop__mul(py, inward);
        pz = raindrop__mul(pz, inward);
        for (i = 0; i < 3; i++) {
            raindrop__v right = raindrop__splat(camera->right[i]), up = raindrop__splat(camera->up[i]),
                        back = raindrop__splat(camera->back[i]);
            raindrop__v d = raindrop__sub(raindrop__add(raindrop__mul(x, right), raindrop__mul(y, up)), back);
            raindrop__store(batch->direction[i] + at, raindrop__mul(d, per_length));
            raindrop__store(
                batch->closest[i] + at,
                raindrop__add(raindrop__add(raindrop__mul(px, right), raindrop__mul(py, up)), raindrop__mul(pz, back)));
        }
    }
}

/* The two lookups' directions, weights and cones. */
static inline void raindrop__batch_trace(raindrop__batch *batch)
{
    const raindrop__v width = raindrop__splat(batch->gaze.width), pixel = raindrop__splat(batch->gaze.pixel),
                      blur = raindrop__splat(batch->gaze.blur);
    const int exit_fresnel = batch->gaze.exit_fresnel;
    const float n = batch->gaze.environment->n;
    int at, i;
    for (at = 0; at < batch->count; at += RAINDROP__LANES) {
        raindrop__v d[3], p[3];
        raindrop__rays rays;
        for (i = 0; i < 3; i++) {
            d[i] = raindrop__load(batch->direction[i] + at);
            p[i] = raindrop__load(batch->closest[i] + at);
        }
        raindrop__trace_v(&rays, d, p, raindrop__load(batch->one_minus_b2 + at), n);
        for (i = 0; i < 3; i++) {
            raindrop__store(batch->reflected[i] + at, rays.reflected[i]);
            raindrop__store(batch->refracted[i] + at, rays.refracted[i]);
        }
        raindrop__store(batch->fresnel + at, rays.fresnel);
        raindrop__store(batch->pass + at,
                        exit_fresnel ? rays.transmit : raindrop__sub(raindrop__splat(1), rays.fresnel));
        raindrop__store(batch->reflect_cone + at,
                        raindrop__mul(blur, raindrop__add(raindrop__mul(rays.footprint_reflected, width), pixel)));
        raindrop__store(
            batch->refract_cone + at,
            raindrop__mul(blur, raindrop__abs(raindrop__sub(raindrop__mul(rays.footprint_refracted, width), pixel))));
    }
}

/* Places in the octahedral square, and widths in texels. */
typedef struct raindrop__lookups {
    float u[RAINDROP__BATCH], v[RAINDROP__BATCH], texels[RAINDROP__BATCH];
} raindrop__lookups;

/* Those of a block of directions: raindrop__fold without branches. */
static inline void raindrop__batch_fold(raindrop__lookups *out, float (*direction)[RAINDROP__BATCH], const float *cone,
                                        int at, float half_resolution)
{
    const raindrop__v one = raindrop__splat(1), zero = raindrop__splat(0), half = raindrop__splat(0.5f);
    raindrop__v x = raindrop__load(direction[0] + at), y = raindrop__load(direction[1] + at),
                z = raindrop__load(direction[2] + at);
    raindrop__v sum = raindrop__add(raindrop__add(raindrop__abs(x), raindrop__abs(y)), raindrop__abs(z)),
                scale = raindrop__div(one, sum);
    raindrop__v a = raindrop__mul(x, scale), b = raindrop__mul(z, scale), c, d, wide;
    c = raindrop__sub(one, raindrop__abs(b));
    d = raindrop__sub(one, raindrop__abs(a));
    c = raindrop__if_less(a, zero, raindrop__sub(zero, c), c);
    d = raindrop__if_less(b, zero, raindrop__sub(zero, d), d);
    a = raindrop__if_less(y, zero, c, a);
    b = raindrop__if_less(y, zero, d, b);
    a = raindrop__add(raindrop__mul(a, half), half);
    b = raindrop__add(raindrop__mul(b, half), half);
    wide = raindrop__mul(raindrop__load(cone + at), raindrop__splat(half_resolution));
    raindrop__store(out->u + at, raindrop__min(raindrop__max(a, zero), one));
    raindrop__store(out->v + at, raindrop__min(raindrop__max(b, zero), one));
    raindrop__store(out->texels + at, raindrop__div(wide, raindrop__mul(sum, raindrop__sqrt(sum))));
}

/* Colours by two lookups each; colour[i] gets red, green, blue, and a lane that means nothing. */
static inline void raindrop__batch_lookup(float (*colour)[4], raindrop__batch *batch)
{
    const raindrop_environment *environment = batch->gaze.environment;
    const raindrop__sphere *sphere = &environment->near_sphere;
    raindrop__lookups at[2];
    float mirrored[4], through[4], uv[2], half = 0.5f * (float)sphere->resolution;
    int i, c;
    SAT_ASSERT(batch->count > 0);
    if (!environment->table) {
        for (i = 0; i < batch->count; i += RAINDROP__LANES) {
            raindrop__batch_fold(&at[0], batch->reflected, batch->reflect_cone, i, half);
            raindrop__batch_fold(&at[1], batch->refracted, batch->refract_cone, i, half);
        }
    }
    for (i = 0; i < batch->count; i++) {
        if (!(batch->alpha[i] > 0)) {
            memset(colour[i], 0, sizeof colour[i]);
            continue;
        }
        if (environment->table) {
            float d[3];
            raindrop__set(d, batch->reflected[0][i], batch->reflected[1][i], batch->reflected[2][i]);
            raindrop__sample_table(mirrored, environment, d, batch->reflect_cone[i]);
            raindrop__set(d, batch->refracted[0][i], batch->refracted[1][i], batch->refracted[2][i]);
            raindrop__sample_table(through, environment, d, batch->refract_cone[i]);
        } else {
            uv[0] = at[0].u[i];
            uv[1] = at[0].v[i];
            raindrop__trilinear(mirrored, sphere, uv, at[0].texels[i]);
            uv[0] = at[1].u[i];
            uv[1] = at[1].v[i];
            raindrop__trilinear(through, sphere, uv, at[1].texels[i]);
        }
        for (c = 0; c < 4; c++) colour[i][c] = batch->fresnel[i] * mirrored[c] + batch->pass[i] * through[c];
    }
}

/* Share of pixel i that a flattened drop covers, by b and its gradient in the space where it is a sphere; p moves to
   this side of the rim. */
static inline float raindrop__flat_cover(const raindrop__batch *batch, float flatness, const float d[3], float p[3])
{
    const raindrop_camera *camera = &batch->frame->camera;
    float stretch = 1 / flatness, unit[3], q[3], along, b, gx, gy, slope;
    raindrop__set(unit, d[0], d[1] * stretch, d[2]);
    raindrop__set(q, p[0], p[1] * stretch, p[2]);
    along = raindrop__dot(q, unit) / raindrop__dot(unit, unit);
    raindrop__combine(q, 1, q, -along, unit);
    b = sqrtf(raindrop__dot(q, q)) + 1e-9f;
    gx = q[0] * camera->right[0] + q[1] * stretch * camera->right[1] + q[2] * camera->right[2];
    gy = q[0] * camera->up[0] + q[1] * stretch * camera->up[1] + q[2] * camera->up[2];
    slope = sqrtf(gx * gx + gy * gy) + 1e-20f;
    if (b > RAINDROP__INNER) raindrop__combine(q, RAINDROP__INNER / b, q, 0, q);
    raindrop__set(p, q[0], q[1] * flatness, q[2]);
    gx /= slope;
    gy /= slope;
    slope = slope * batch->focal_in_radii / b + 1e-9f;
    return raindrop__half_plane((1 - b) / slope - slope / (2 * b > slope ? 24 * b : 12 * slope), gx, gy);
}

/* One fragment of a flattened drop. */
static inline void raindrop__flat_colour(float colour[4], raindrop__batch *batch, int i, const float d[3], float p[3])
{
    float flatness = batch->swing ? batch->ratio[i] : batch->flatness,
          cover = raindrop__flat_cover(batch, flatness, d, p);
    raindrop_ray ray;
    if (batch->samples == 1 && !(batch->gaze.blur > 1)) batch->alpha[i] = cover;
    if (raindrop_trace_spheroid(&ray, d, p, flatness, batch->gaze.environment->n))
        raindrop__add_ray(colour, &batch->gaze, &ray);
}

/* One fragment of a large drop. At the rim the angles change so fast along the radius that one lookup, however wide, is
   wrong: four rays there share the pixel. */
static inline void raindrop__large_colour(float colour[4], raindrop__batch *batch, int i, const float d[3],
                                          const float p[3])
{
    const int taps = 4;
    float b = sqrtf(1 - batch->one_minus_b2[i]), tap[3];
    int j, c, n = 0;
    if (1 - b > 3 * batch->gaze.width || batch->gaze.width > 0.25f) {
        raindrop__add_orders(colour, &batch->gaze, d, p, batch->one_minus_b2[i]);
        return;
    }
    for (j = 0; j < taps; j++) {
        float at = b + (((float)j + 0.5f) / (float)taps - 0.5f) * batch->gaze.width;
        if (at >= 1 || at <= 0) continue;
        raindrop__combine(tap, at / b, p, 0, p);
        raindrop__add_orders(colour, &batch->gaze, d, tap, (1 - at) * (1 + at));
        n++;
    }
    for (c = 0; c < 3; c++) colour[c] /= (float)n;
}

/* Large drops: all orders, one ray at a time. Flattened ones: their own two hits. */
static inline void raindrop__batch_slow(float (*colour)[4], raindrop__batch *batch)
{
    float d[3], p[3];
    int i;
    for (i = 0; i < batch->count; i++) {
        memset(colour[i], 0, sizeof colour[i]);
        if (!(batch->alpha[i] > 0)) continue;
        raindrop__set(d, batch->direction[0][i], batch->direction[1][i], batch->direction[2][i]);
        raindrop__set(p, batch->closest[0][i], batch->closest[1][i], batch->closest[2][i]);
        if (batch->slow) raindrop__flat_colour(colour[i], batch, i, d, p);
        else {
            raindrop__large_colour(colour[i], batch, i, d, p);
            batch->tally->order_fragments += batch->gaze.orders > 0;
        }
    }
}

static inline float *raindrop__pixel(const raindrop__frame *frame, int x, int y)
{
    return (float *)(void *)(frame->rgb + (ptrdiff_t)y * frame->stride) + 3 * (ptrdiff_t)x;
}

static inline void raindrop__blend(float *out, float alpha, const float colour[3], float covers)
{
    out[0] += alpha * (colour[0] - covers * out[0]);
    out[1] += alpha * (colour[1] - covers * out[1]);
    out[2] += alpha * (colour[2] - covers * out[2]);
}

static inline void raindrop__batch_blend(raindrop__batch *batch, float (*colour)[4])
{
    int i, j, c, m = batch->samples;
    for (i = 0; i + m <= batch->count; i += m) {
        float mean[3] = {0, 0, 0};
        for (j = i; j < i + m; j++)
            for (c = 0; c < 3; c++) mean[c] += colour[j][c];
        for (c = 0; c < 3; c++) mean[c] /= (float)m;
        if (!(batch->alpha[i] > 0)) continue;
        raindrop__blend(batch->pixel[i], batch->alpha[i], mean, 1);
        batch->tally->fragments++;
    }
    batch->count = 0;
}

/* The arrays are traced in whole vectors: what lies behind the last fragment repeats it. */
static inline void raindrop__batch_pad(raindrop__batch *batch)
{
    int at, last = batch->count - 1, end = (batch->count + RAINDROP__LANES - 1) / RAINDROP__LANES * RAINDROP__LANES;
    for (at = batch->count; at < end; at++) {
        batch->slope_x[at] = batch->slope_x[last];
        batch->slope_y[at] = batch->slope_y[last];
        batch->offset_x[at] = batch->offset_x[last];
        batch->offset_y[at] = batch->offset_y[last];
    }
}

static inline void raindrop__flush_rays(raindrop__batch *batch, int keep_alpha)
{
    float colour[RAINDROP__BATCH][4];
    if (!batch->count) return;
    raindrop__batch_pad(batch);
    raindrop__batch_rays(batch, keep_alpha);
    if (batch->gaze.orders >= 0 || batch->slow) raindrop__batch_slow(colour, batch);
    else {
        raindrop__batch_trace(batch);
        raindrop__batch_lookup(colour, batch);
    }
    raindrop__batch_blend(batch, colour);
}

/* A fragment: pixel (x, y) sees the drop whose centre is projected to (centre_x, centre_y). */
static inline void raindrop__push_ray(raindrop__batch *batch, int x, int y, float centre_x, float centre_y)
{
    const raindrop__frame *frame = batch->frame;
    int at = batch->count++;
    batch->pixel[at] = raindrop__pixel(frame, x, y);
    batch->slope_x[at] = ((float)x + 0.5f - frame->half_width) / frame->focal;
    batch->slope_y[at] = (frame->half_height - (float)y - 0.5f) / frame->focal;
    batch->offset_x[at] = ((float)x + 0.5f - centre_x) * batch->focal_in_radii;
    batch->offset_y[at] = (centre_y - (float)y - 0.5f) * batch->focal_in_radii;
}

static inline void raindrop__begin_drop(raindrop__batch *batch, const raindrop__visible *v,
                                        const raindrop__placed *placed)
{
    const raindrop_render_options *o = &batch->frame->options;
    batch->focal_in_radii = placed->z / (batch->frame->focal * placed->radius);
    batch->gaze.width =
        1 / (batch->frame->focal * placed->radius / sqrtf(placed->distance2 - placed->radius * placed->radius));
    batch->gaze.blur = 1;
    batch->samples = 1;
    batch->flatness = placed->flatness;
    batch->slow = placed->flatness < 1 || placed->flatness > 1;
    batch->swing = NULL;
    batch->gaze.orders = v->radius >= o->orders_radius && !raindrop__is_sprite(batch->frame) ? o->orders : -1;
}

static inline void raindrop__draw_still(raindrop__batch *batch, const raindrop__visible *v, const raindrop__box *box)
{
    const raindrop__frame *frame = batch->frame;
    int x, y;
    for (y = box->y0; y < box->y1; y++) {
        for (x = box->x0; x < box->x1; x++) {
            if (raindrop__occluded(frame, (size_t)y * (size_t)frame->width + (size_t)x, v->depth)) continue;
            raindrop__push_ray(batch, x, y, v->x, v->y);
            if (batch->count == RAINDROP__BATCH) raindrop__flush_rays(batch, 0);
        }
    }
    raindrop__flush_rays(batch, 0);
}

/* ---- motion and defocus

   A disc of radius r that moves l pixels covers a point, u along and w across the path from the middle, for the share
   ([u-h, u+h] cut with [-l/2, l/2]) / l of the time, h = sqrt(r^2 - w^2) being half its chord. A pixel takes the mean
   over boxes as wide, along and across, as the path needs to cross a pixel: a chord at the pixel's centre would let the
   streak's energy swing with its place (by half for thin ones). Along it the mean of a clamped ramp is a difference of
   squares. Of streaks shorter than RAINDROP__SHORT it is that of two still discs, the points of Gauss' quadrature. */

typedef struct raindrop__path { float along[2], length, radius, width; } raindrop__path;

static inline raindrop__path raindrop__path_of(const raindrop__visible *v, float radius)
{
    raindrop__path path;
    float length = sqrtf(v->streak[0] * v->streak[0] + v->streak[1] * v->streak[1]), x, y;
    path.along[0] = length > 1e-6f ? v->streak[0] / length : 1;
    path.along[1] = length > 1e-6f ? v->streak[1] / length : 0;
    x = fabsf(path.along[0]);
    y = fabsf(path.along[1]);
    path.length = length;
    path.radius = radius;
    path.width = 1 / (x > y ? x : y);
    return path;
}

static inline float raindrop__disc_cover(float radius, float dx, float dy)
{
    float apart = sqrtf(dx * dx + dy * dy) + 1e-6f;
    return raindrop__half_plane(radius - apart - 1 / (24 * (apart > 0.5f ? apart : 0.5f)), dx / apart, dy / apart);
}

/* Half the chord's mean over a pixel: its integral is half a segment of the circle. */
static inline float raindrop__mean_chord(const raindrop__path *path, float w)
{
    float r = path->radius, half = 0.5f * path->width, a = raindrop__clamp((w - half) / r, -1, 1),
          b = raindrop__clamp((w + half) / r, -1, 1), area;
    if (!(b > a)) return 0;
    area = b * sqrtf((1 - b) * (1 + b)) - a * sqrtf((1 - a) * (1 + a)) + asinf(b) - asinf(a);
    return 0.5f * r * r * area / path->width;
}

/* The mean over a pixel of v clamped to [-l/2, l/2], and l/2. */
static inline float raindrop__mean_clamp(const raindrop__path *path, float v)
{
    float w = path->width, half = 0.5f * path->length, a, b, c, d;
    a = raindrop__clamp(v + 0.5f * w + half, 0, w);
    b = raindrop__clamp(v + 0.5f * w - half, 0, w);
    c = v - 0.5f * w + half;
    d = v - 0.5f * w - half;
    return 0.5f * (a * a - b * b) / w + (c > 0 ? c : 0) - (d > 0 ? d : 0);
}

/* [from, to] along the path, in pixels from its middle, while the pixel is covered; returns its share. */
static inline float raindrop__path_cover(float span[2], const raindrop__path *path, float dx, float dy)
{
    float u = dx * path->along[0] + dy * path->along[1], w = dy * path->along[0] - dx * path->along[1];
    float h2 = path->radius * path->radius - w * w, h = h2 > 0 ? sqrtf(h2) : 0, half = 0.5f * path->length;
    span[0] = raindrop__clamp(u - h, -half, half);
    span[1] = raindrop__clamp(u + h, -half, half);
    if (path->length < RAINDROP__SHORT) {
        float apart = RAINDROP__GAUSS * path->length, x = apart * path->along[0], y = apart * path->along[1];
        return 0.5f * (raindrop__disc_cover(path->radius, dx - x, dy - y) +
                       raindrop__disc_cover(path->radius, dx + x, dy + y));
    }
    h = raindrop__mean_chord(path, w);
    if (!(h > 0)) return 0;
    return (raindrop__mean_clamp(path, u + h) - raindrop__mean_clamp(path, u - h)) / path->length;
}

/* A far drop that is far out of focus. */
static inline void raindrop__draw_far_round(raindrop__batch *batch, const raindrop__visible *v,
                                            const raindrop__box *box)
{
    const raindrop__frame *frame = batch->frame;
    raindrop__path path = raindrop__path_of(v, raindrop__path_radius(v));
    float opacity = v->radius * v->radius / (path.radius * path.radius), span[2];
    int x, y;
    for (y = box->y0; y < box->y1; y++) {
        for (x = box->x0; x < box->x1; x++) {
            float alpha = opacity * raindrop__path_cover(span, &path, (float)x + 0.5f - v->x, (float)y + 0.5f - v->y);
            if (!(alpha > 0) || raindrop__occluded(frame, (size_t)y * (size_t)frame->width + (size_t)x, v->depth))
                continue;
            raindrop__blend(raindrop__pixel(frame, x, y), alpha, v->colour, batch->covers);
            batch->tally->fragments++;
        }
    }
}

#ifndef RAINDROP_NO_STREAK
/* Area that discs of radii r and c share, their centres `apart`: how much of a lens sees the drop. */
static inline float raindrop__lens(float r, float c, float apart)
{
    float less = r < c ? r : c, x, y, k;
    if (apart >= r + c) return 0;
    if (apart <= fabsf(r - c)) return (float)RAINDROP__PI * less * less;
    x = raindrop__clamp((apart * apart + r * r - c * c) / (2 * apart * r), -1, 1);
    y = raindrop__clamp((apart * apart + c * c - r * r) / (2 * apart * c), -1, 1);
    k = (r + c - apart) * (apart + r - c) * (apart - r + c) * (apart + r + c);
    return r * r * acosf(x) + c * c * acosf(y) - 0.5f * sqrtf(k > 0 ? k : 0);
}

static inline void raindrop__flush_soft(raindrop__batch *batch, float *alpha)
{
    int i;
    for (i = 0; i < batch->count; i++) batch->alpha[i] = alpha[i];
    raindrop__flush_rays(batch, 1);
}

/* A near drop that moves or is out of focus. Its colour at a pixel is the mean of a few rays along the covered part of
   the path; across the lens the drop is blurred by wider footprints. */
static inline void raindrop__draw_soft(raindrop__batch *batch, const raindrop__visible *v, const raindrop__box *box)
{
    const raindrop__frame *frame = batch->frame;
    raindrop__path path = raindrop__path_of(v, raindrop__path_radius(v));
    int moving = v->streak[0] * v->streak[0] + v->streak[1] * v->streak[1] > 0.0625f, samples = !moving          ? 1
                                                                                                : v->radius < 6  ? 4
                                                                                                : v->radius < 24 ? 8
                                                                                                                 : 16;
    float opacity = v->radius * v->radius / (path.radius * path.radius), alpha[RAINDROP__BATCH], span[2] = {0, 0},
          spacing;
    int x, y, j;
    raindrop__swing swing = {0, {0, 0}, {0, 0}, {0, 0}};
    const float focal_in_radii = batch->focal_in_radii;
    SAT_ASSERT(batch->count == 0);
    batch->samples = samples;
    batch->gaze.orders = -1;
    if (moving && frame->options.oscillation > 0) {
        swing = raindrop__swing_of(frame->rain, v->drop, frame->options.oscillation);
        if (swing.amplitude > 0) {
            batch->swing = &swing;
            batch->slow = 1;
        }
    }
    spacing = moving ? (2 * v->radius < path.length ? 2 * v->radius : path.length) / (float)samples : 0;
    batch->gaze.blur = 1 + 2 * v->blur + (spacing > 1 ? spacing - 1 : 0);
    for (y = box->y0; y < box->y1; y++) {
        for (x = box->x0; x < box->x1; x++) {
            float dx = (float)x + 0.5f - v->x, dy = (float)y + 0.5f - v->y, cover;
            if (moving) cover = opacity * raindrop__path_cover(span, &path, dx, dy);
            else {
                float blur = v->blur > RAINDROP__LEAST_BLUR ? v->blur : RAINDROP__LEAST_BLUR;
                cover = raindrop__lens(v->radius, blur, sqrtf(dx * dx + dy * dy)) / ((float)RAINDROP__PI * blur * blur);
            }
            if (!(cover > 0) || raindrop__occluded(frame, (size_t)y * (size_t)frame->width + (size_t)x, v->depth))
                continue;
            for (j = 0; j < samples; j++) {
                float t = span[0] + (span[1] - span[0]) * ((float)j + 0.5f) / (float)samples;
                alpha[batch->count] = cover;
                if (batch->swing) {
                    float ratio = raindrop__swung(frame->rain->drops[v->drop].axis_ratio, &swing,
                                                  t / path.length * frame->camera.exposure);
                    batch->ratio[batch->count] = ratio;
                    batch->focal_in_radii = focal_in_radii * cbrtf(ratio / batch->flatness);
                }
                raindrop__push_ray(batch, x, y, v->x + t * path.along[0], v->y + t * path.along[1]);
            }
            if (batch->count + samples > RAINDROP__BATCH) raindrop__flush_soft(batch, alpha);
        }
    }
    raindrop__flush_soft(batch, alpha);
    batch->focal_in_radii = focal_in_radii;
    batch->swing = NULL;
}
#endif

/* The colour of a far drop in a row, or column: it speckles where the drop swings. */
static inline void raindrop__far_colour(float colour[3], const raindrop__batch *batch, const raindrop__visible *v,
                                        const raindrop__shape *shape, int major)
{
    float along, per_pixel, flicker;
    raindrop__set(colour, v->colour[0], v->colour[1], v->colour[2]);
    if (!batch->flicker) return;
    along = (float)major + 0.5f - (shape->swapped ? v->x : v->y);
    per_pixel = batch->frame->camera.exposure / (2 * shape->half_height);
    if ((shape->swapped ? v->streak[0] : v->streak[1]) < 0) along = -along;
    flicker = raindrop__flicker(batch->flicker, batch->swing, along * per_pixel, per_pixel);
    raindrop__set(colour, flicker * colour[0], flicker * colour[1], flicker * colour[2]);
}

/* One row of a far drop's pixels, a column where x and y have changed places: its number, the first pixel and the
   one behind the last, the share of the light that falls into it; x: where the first begins, seen from the middle of
   the part of the path that is in this row, which moves by w. */
typedef struct raindrop__row { int major, first, last; float opacity, x, w; } raindrop__row;

static inline void raindrop__far_row(raindrop__batch *batch, const raindrop__visible *v, const raindrop__shape *shape,
                                     const raindrop__row *row)
{
    const raindrop__frame *frame = batch->frame;
    float scale = 0.5f / row->w, left = shape->half_width - 0.5f * row->w, right = shape->half_width + 0.5f * row->w,
          right_of = 0, x = row->x, colour[3];
    int at;
    raindrop__far_colour(colour, batch, v, shape, row->major);
    for (at = row->first; at <= row->last; at++, x += 1) {
        /* the mean over the way w of what lies right of x: of ramps, whose integrals are squares */
        float a = left - x > 0 ? left - x : 0, b = right - x > 0 ? right - x : 0, c = -right - x > 0 ? -right - x : 0,
              d = -left - x > 0 ? -left - x : 0, more = scale * ((b - a) * (b + a) - (d - c) * (d + c)),
              alpha = row->opacity * (right_of - more);
        int px = shape->swapped ? row->major : at - 1, py = shape->swapped ? at - 1 : row->major;
        right_of = more;
        if (at == row->first || !(alpha > 0) ||
            raindrop__occluded(frame, (size_t)py * (size_t)frame->width + (size_t)px, v->depth))
            continue;
        raindrop__blend(raindrop__pixel(frame, px, py), alpha < 1 ? alpha : 1, colour, batch->covers);
        batch->tally->fragments++;
    }
}

/* A far drop that stands still: a square cut with the pixels, which is quicker. */
static inline void raindrop__draw_far_still(raindrop__batch *batch, const raindrop__visible *v,
                                            const raindrop__box *box)
{
    const raindrop__frame *frame = batch->frame;
    float half = RAINDROP__SQUARE * v->radius;
    int x, y;
    for (y = box->y0; y < box->y1; y++) {
        float low = v->y - half > (float)y ? v->y - half : (float)y,
              high = v->y + half < (float)(y + 1) ? v->y + half : (float)(y + 1);
        for (x = box->x0; x < box->x1; x++) {
            float left = v->x - half > (float)x ? v->x - half : (float)x,
                  right = v->x + half < (float)(x + 1) ? v->x + half : (float)(x + 1);
            float alpha = (high - low) * (right - left);
            if (!(high > low) || !(right > left) ||
                raindrop__occluded(frame, (size_t)y * (size_t)frame->width + (size_t)x, v->depth))
                continue;
            raindrop__blend(raindrop__pixel(frame, x, y), alpha, v->colour, batch->covers);
            batch->tally->fragments++;
        }
    }
}

/* A far drop: its parallelogram cut with the pixels. */
static inline void raindrop__draw_far(raindrop__batch *batch, const raindrop__visible *v, const raindrop__box *box)
{
    const raindrop__shape shape = raindrop__far_shape(v);
    float middle = shape.swapped ? v->y : v->x, across = shape.swapped ? v->x : v->y;
    int end = shape.swapped ? box->x1 : box->y1;
    int low = shape.swapped ? box->y0 : box->x0, high = shape.swapped ? box->y1 : box->x1;
    raindrop__row row;
    for (row.major = shape.swapped ? box->x0 : box->y0; row.major < end; row.major++) {
        float from = (float)row.major - across, to = from + 1, at, reach;
        from = from > -shape.half_height ? from : -shape.half_height;
        to = to < shape.half_height ? to : shape.half_height;
        if (!(to > from)) continue;
        row.w = fabsf(shape.slope) * (to - from);
        row.w = row.w > 0.01f ? row.w : 0.01f;
        at = middle + shape.slope * 0.5f * (from + to);
        reach = shape.half_width + 0.5f * row.w;
        row.first = sat__max_int(raindrop__pixel_down(at - reach, high), low);
        row.last = sat__min_int(raindrop__pixel_up(at + reach, high), high);
        row.x = (float)row.first - at;
        row.opacity = shape.opacity * (to - from);
        raindrop__far_row(batch, v, &shape, &row);
    }
}

static inline void raindrop__draw_far_any(raindrop__batch *batch, const raindrop__visible *v, const raindrop__box *box)
{
    if (!(fabsf(v->streak[0]) + fabsf(v->streak[1]) + v->blur > 0) && !batch->flicker)
        raindrop__draw_far_still(batch, v, box);
    else if (raindrop__is_round(v)) raindrop__draw_far_round(batch, v, box);
    else raindrop__draw_far(batch, v, box);
}

/* ------------------------------------------------------------------------------------------------
   >> glints   lamps seen in drops, and far drops that swing
   ------------------------------------------------------------------------------------------------ */

/* The pixels of the band that a drop may touch; placed: NULL for far drops. */
static inline raindrop__box raindrop__band_box(const raindrop__batch *batch, const raindrop__visible *v,
                                               const raindrop__placed *placed)
{
    raindrop__box box = raindrop__bounds(batch->frame, v, placed);
    box.y0 = sat__max_int(box.y0, batch->y0);
    box.y1 = sat__min_int(box.y1, batch->y1);
    return box;
}

/* The glint of a lamp by one path as a far drop of its own: in a near drop at its place, in a far one all over it. */
static inline int raindrop__glint_seen(raindrop__visible *out, float normal[3], const raindrop__frame *frame,
                                       const raindrop__visible *v, const raindrop__lit *lit, int path)
{
    const raindrop_camera *camera = &frame->camera;
    const int is_far = (v->drop & RAINDROP__FAR_BIT) != 0;
    raindrop__glint glint;
    float z, scale;
    int c;
    if (!raindrop__glint_of(&glint, lit, path, &frame->water)) return 0;
    *out = *v;
    out->drop |= RAINDROP__FAR_BIT;
    if (!is_far) {
        z = -raindrop__dot(glint.seen, camera->back);
        if (!(z > 0)) return 0;
        out->x = frame->half_width + frame->focal * raindrop__dot(glint.seen, camera->right) / z;
        out->y = frame->half_height - frame->focal * raindrop__dot(glint.seen, camera->up) / z;
        out->radius = raindrop__clamp(v->radius * glint.radius, RAINDROP__LEAST_GLINT, v->radius);
    }
    scale = v->radius * v->radius / ((float)RAINDROP__PI * out->radius * out->radius);
    for (c = 0; c < 3; c++) out->colour[c] = glint.light[c] * scale;
    memcpy(normal, glint.normal, sizeof glint.normal);
    return 1;
}

RAINDROP__APART void raindrop__draw_glints(raindrop__batch *batch, const raindrop__visible *v)
{
    const raindrop__frame *frame = batch->frame;
    const uint32_t index = v->drop & ~RAINDROP__FAR_BIT;
    const raindrop_drop *drop = &frame->rain->drops[index];
    const raindrop__swing swing = raindrop__swing_of(frame->rain, index, frame->options.oscillation);
    raindrop__visible glint;
    raindrop__box box;
    raindrop__lit lit;
    float normal[3], flicker[2], *d = lit.along;
    int i, path;
    raindrop__combine(d, 1, drop->position, -1, frame->camera.position);
    lit.per_distance = v->drop & RAINDROP__FAR_BIT
                           ? 0
                           : raindrop__clamp(drop->radius / sqrtf(raindrop__dot(d, d)), 0, RAINDROP__NEAREST);
    raindrop__normalise(d);
    batch->covers = 0;
    batch->swing = &swing;
    for (i = 0; i < frame->options.lamp_count; i++) {
        if (!raindrop__light(&lit, &frame->options.lamps[i], drop)) continue;
        for (path = 0; path < RAINDROP__GLINTS; path++) {
            if (!raindrop__glint_seen(&glint, normal, frame, v, &lit, path)) continue;
            raindrop__flicker_at(flicker, &swing, normal);
            batch->flicker = swing.amplitude > 0 ? flicker : NULL;
            box = raindrop__band_box(batch, &glint, NULL);
            raindrop__draw_far_any(batch, &glint, &box);
        }
    }
    batch->covers = 1;
    batch->swing = NULL;
    batch->flicker = NULL;
}

/* A far drop that swings: the environment's light by what its prefilter knows of it, the transverse mode's curvature
   swings 10/4 times as much; then each lamp's. */
RAINDROP__APART void raindrop__draw_flickering(raindrop__batch *batch, const raindrop__visible *v)
{
    const raindrop__frame *frame = batch->frame;
    const uint32_t index = v->drop & ~RAINDROP__FAR_BIT;
    const raindrop__swing swing = raindrop__swing_of(frame->rain, index, frame->options.oscillation);
    const raindrop__box box = raindrop__band_box(batch, v, NULL);
    float d[3], colour[4], flicker[2];
    raindrop__combine(d, 1, frame->rain->drops[index].position, -1, frame->camera.position);
    raindrop__far(colour, frame->environment, d);
    flicker[0] = raindrop__clamp(swing.amplitude * colour[3], -RAINDROP__FLICKERS, RAINDROP__FLICKERS);
    flicker[1] = RAINDROP__FLICKERS_MORE * flicker[0];
    batch->swing = &swing;
    batch->flicker = fabsf(flicker[0]) > 0 ? flicker : NULL;
    raindrop__draw_far_any(batch, v, &box);
    batch->swing = NULL;
    batch->flicker = NULL;
    if (frame->options.lamp_count > 0) raindrop__draw_glints(batch, v);
}

/* ------------------------------------------------------------------------------------------------
   >> sprites   as published; then bands, whole pictures, background and veil

   R = [u v n] turns the map's frame into the world (eq 2.1), n pointing from the drop to the eye (eq 2.2). Eq 2.3 takes
   u = V x n, which is not a unit vector and vanishes where n is parallel to V. Here u and v are the camera's right and
   up under the shortest rotation that takes its back to n: orthonormal for every drop before the camera.
   ------------------------------------------------------------------------------------------------ */
static inline void raindrop__sprite_frame(float u[3], float v[3], float n[3], const raindrop_camera *camera,
                                          const raindrop__placed *placed)
{
    float per_distance = 1 / sqrtf(placed->distance2), r = -placed->x * per_distance, t = -placed->y * per_distance,
          b = placed->z * per_distance;
    float k = 1 / (1 + b);
    int i;
    for (i = 0; i < 3; i++) {
        n[i] = r * camera->right[i] + t * camera->up[i] + b * camera->back[i];
        u[i] = camera->right[i] - r * k * (camera->back[i] + n[i]);
        v[i] = camera->up[i] - t * k * (camera->back[i] + n[i]);
    }
}

static inline void raindrop__rotate(float out[3], const float u[3], const float v[3], const float n[3],
                                    const float in[3])
{
    int i;
    for (i = 0; i < 3; i++) out[i] = u[i] * in[0] + v[i] * in[1] + n[i] * in[2];
}

static inline void raindrop__flush_sprite(raindrop__batch *batch)
{
    float colour[RAINDROP__BATCH][4];
    if (!batch->count) return;
    if (batch->frame->options.look == RAINDROP_LOOK_SPRITE) raindrop__batch_trace(batch);
    raindrop__batch_lookup(colour, batch);
    raindrop__batch_blend(batch, colour);
}

#ifndef RAINDROP_NO_MAP
/* One texel of the map, turned; 0 when it is transparent. */
static inline int raindrop__push_map(raindrop__batch *batch, int at, float s, float t, float lod, float frame[3][3])
{
    float texel[8], turned[3], n = batch->frame->environment->n, pixel = 1 / batch->frame->focal;
    float b2 = raindrop__clamp(s * s + t * t, 0, 0.9999f * (n < 1 ? n * n : 1));
    raindrop_ray ray;
    int i;
    raindrop__map_trilinear(texel, batch->frame->options.map, s, t, lod);
    if (!(texel[7] > 1.0f / 255)) return 0;
    raindrop__rotate(turned, frame[0], frame[1], frame[2], texel);
    raindrop__normalise(turned); /* interpolated vectors are shorter than 1 */
    for (i = 0; i < 3; i++) batch->reflected[i][at] = turned[i];
    raindrop__rotate(turned, frame[0], frame[1], frame[2], texel + 4);
    raindrop__normalise(turned);
    for (i = 0; i < 3; i++) batch->refracted[i][at] = turned[i];
    batch->alpha[at] = texel[7];
    batch->fresnel[at] = texel[3];
    batch->pass[at] = 1 - texel[3];
    raindrop__surface(&ray, sqrtf(1 - b2), sqrtf(n * n - b2) / n, n);
    batch->reflect_cone[at] = 2 * batch->gaze.width + pixel;
    batch->refract_cone[at] = fabsf(ray.footprint_refracted * batch->gaze.width - pixel);
    return 1;
}
#endif

static inline int raindrop__push_sprite(raindrop__batch *batch, int at, float s, float t, float distance,
                                        float frame[3][3])
{
    float d[3], p[3], turned[3], rho = sqrtf(s * s + t * t);
    int i;
    batch->alpha[at] = raindrop__clamp((1 - rho) / batch->gaze.width + 0.5f, 0, 1);
    if (!(batch->alpha[at] > 0)) return 0;
    if (rho > RAINDROP__INNER) {
        s *= RAINDROP__INNER / rho;
        t *= RAINDROP__INNER / rho;
    }
    raindrop_sprite_ray(d, p, &batch->one_minus_b2[at], s, t, distance);
    raindrop__rotate(turned, frame[0], frame[1], frame[2], d);
    for (i = 0; i < 3; i++) batch->direction[i][at] = turned[i];
    raindrop__rotate(turned, frame[0], frame[1], frame[2], p);
    for (i = 0; i < 3; i++) batch->closest[i][at] = turned[i];
    return 1;
}

static inline void raindrop__draw_sprite(raindrop__batch *batch, const raindrop__visible *v,
                                         const raindrop__placed *placed, const raindrop__box *box)
{
    const raindrop__frame *frame = batch->frame;
    float per_half = 1 / raindrop__sprite_half(frame, placed), axes[3][3],
          distance2 = placed->distance2 / (placed->radius * placed->radius);
    float distance = sqrtf(distance2);
    int x, y, kept;
#ifndef RAINDROP_NO_MAP
    float lod = raindrop__map_lod(distance2);
#endif
    raindrop__sprite_frame(axes[0], axes[1], axes[2], &frame->camera, placed);
    for (y = box->y0; y < box->y1; y++) {
        for (x = box->x0; x < box->x1; x++) {
            float s = ((float)x + 0.5f - v->x) * per_half, t = (v->y - (float)y - 0.5f) * per_half;
            int at = batch->count;
            if (raindrop__occluded(frame, (size_t)y * (size_t)frame->width + (size_t)x, v->depth)) continue;
#ifndef RAINDROP_NO_MAP
            if (frame->options.look == RAINDROP_LOOK_MAP) kept = raindrop__push_map(batch, at, s, t, lod, axes);
            else
#endif
                kept = raindrop__push_sprite(batch, at, s, t, distance, axes);
            if (!kept) continue;
            batch->pixel[at] = raindrop__pixel(frame, x, y);
            batch->count++;
            if (batch->count == RAINDROP__BATCH) raindrop__flush_sprite(batch);
        }
    }
    raindrop__flush_sprite(batch);
}

/* ---- one drop, one band, one picture */

static inline void raindrop__draw(raindrop__batch *batch, const raindrop__visible *v)
{
    const raindrop__frame *frame = batch->frame;
    const int is_far = (v->drop & RAINDROP__FAR_BIT) != 0;
    raindrop__placed placed;
    raindrop__box box;
    if (!is_far) {
        raindrop__place_drop(&placed, frame, v->drop);
        raindrop__begin_drop(batch, v, &placed);
    } else if (raindrop__flickers(frame, &frame->rain->drops[v->drop & ~RAINDROP__FAR_BIT])) {
        raindrop__draw_flickering(batch, v);
        return;
    }
    box = raindrop__band_box(batch, v, is_far ? NULL : &placed);
    if (is_far) raindrop__draw_far_any(batch, v, &box);
    else if (raindrop__is_sprite(frame)) raindrop__draw_sprite(batch, v, &placed, &box);
#ifndef RAINDROP_NO_STREAK
    else if (!raindrop__is_still(v)) raindrop__draw_soft(batch, v, &box);
#endif
    else raindrop__draw_still(batch, v, &box);
    if (frame->options.lamp_count > 0 && !is_far) raindrop__draw_glints(batch, v);
}

/* Records lie in the order of the array, not of the depths: those of the next drops are asked for before they are
   used. */
static inline void raindrop__fetch(const raindrop__visible *v)
{
#if defined(SAT__SSE2)
    _mm_prefetch((const char *)v, _MM_HINT_T0);
#elif defined(__GNUC__)
    __builtin_prefetch(v);
#else
    (void)v;
#endif
}

static inline void raindrop__draw_queue(raindrop__batch *batch, const uint32_t *queue, int count)
{
    int i;
    for (i = 0; i < count; i++) raindrop__draw(batch, &batch->frame->rain->visible[queue[i]]);
}

/* What all drops of a picture share. */
static inline void raindrop__begin_batch(raindrop__batch *batch, const raindrop__frame *frame, raindrop__tally *tally)
{
    memset(batch, 0, sizeof *batch);
    batch->frame = frame;
    batch->tally = tally;
    batch->covers = 1;
    batch->gaze.environment = frame->environment;
    batch->gaze.exit_fresnel = frame->options.exit_fresnel;
    batch->gaze.pixel = 1 / frame->focal;
}

static void raindrop__draw_bands(int begin, int end, int worker, void *context)
{
    enum { QUEUE = 32 };
    const raindrop__frame *frame = (const raindrop__frame *)context;
    raindrop__batch batch;
    uint32_t queue[QUEUE];
    int band, i, n;
    raindrop__begin_batch(&batch, frame, &frame->rain->tally[worker]);
    for (band = begin; band < end; band++) {
        batch.y0 = band * RAINDROP__BAND;
        batch.y1 = sat__min_int(batch.y0 + RAINDROP__BAND, frame->height);
        for (i = n = 0; i < frame->visible; i++) {
            uint32_t rows = frame->rain->rows[i];
            if ((int)(rows >> 16) >= batch.y1 || (int)(rows & 0xffffu) <= batch.y0) continue;
            queue[n] = (uint32_t)frame->order[i];
            raindrop__fetch(&frame->rain->visible[queue[n]]);
            if (++n < QUEUE) continue;
            raindrop__draw_queue(&batch, queue, n);
            n = 0;
        }
        raindrop__draw_queue(&batch, queue, n);
    }
}

/* The picture that is drawn to, and the camera; resolves a stride of 0. */
static inline int raindrop__frame_is_valid(raindrop__frame *frame)
{
    sat__text ignored = sat__text_begin(NULL, 0);
    return raindrop__picture_is_valid(&ignored, frame->stride, frame->width, frame->height) &&
           raindrop__camera_is_valid(&ignored, &frame->camera) &&
           sat__rows_are_valid(frame->rgb, &frame->stride, frame->width, frame->height, 3 * sizeof(float),
                               sizeof(float));
}

static inline void raindrop__set_frame(raindrop__frame *frame)
{
    if (frame->environment) frame->water = raindrop__water_of(frame->environment->n, frame->options.orders);
    if (raindrop__is_sprite(frame)) { /* still spheres under the environment alone, as published */
        frame->options.oscillation = 0;
        frame->options.lamp_count = 0;
    }
    frame->half_width = 0.5f * (float)frame->width;
    frame->half_height = 0.5f * (float)frame->height;
    frame->focal = frame->half_height / tanf(0.5f * frame->camera.fov_y);
    frame->side_x = sqrtf(frame->focal * frame->focal + frame->half_width * frame->half_width);
    frame->side_y = sqrtf(frame->focal * frame->focal + frame->half_height * frame->half_height);
}

/* A picture of the CPU, not checked yet. */
static inline raindrop__frame raindrop__frame_of(float *rgb, ptrdiff_t stride, int width, int height,
                                                 const raindrop_camera *camera)
{
    raindrop__frame frame;
    memset(&frame, 0, sizeof frame);
    frame.camera = camera ? *camera : raindrop_camera_defaults();
    frame.rgb = (unsigned char *)rgb;
    frame.stride = stride;
    frame.width = width;
    frame.height = height;
    return frame;
}

static inline void raindrop__sum_stats(raindrop_render_stats *stats, const raindrop__frame *frame, int workers)
{
    const raindrop_rain *rain = frame->rain;
    size_t *const fates[RAINDROP__FATES] = {&stats->drawn_near, &stats->drawn_far, &stats->invalid, &stats->inside,
                                            &stats->behind,     &stats->near_plane, &stats->outside, &stats->hidden,
                                            &stats->below_threshold}; /* in the order of raindrop__fate */
    int i, k, chunks = raindrop__chunk_count(rain->count);
    memset(stats, 0, sizeof *stats);
    for (i = 0; i < chunks; i++) {
        for (k = 0; k < RAINDROP__FATES; k++) *fates[k] += (size_t)rain->chunks[i].fates[k];
        stats->coverage_left_out += rain->chunks[i].coverage_left_out;
    }
    for (i = 0; i < workers; i++) {
        stats->fragments += rain->tally[i].fragments;
        stats->order_fragments += rain->tally[i].order_fragments;
    }
    stats->drops = (size_t)rain->count;
}

RAINDROP_DEF sat_result raindrop_render(float *rgb, ptrdiff_t stride, int width, int height, const float *depth,
                                        const raindrop_camera *camera, const raindrop_rain *rain,
                                        const raindrop_environment *environment, const raindrop_render_options *options,
                                        raindrop_render_stats *stats)
{
    raindrop__frame frame = raindrop__frame_of(rgb, stride, width, height, camera);
    const sat_threads *threads;
    sat__text ignored = sat__text_begin(NULL, 0);
    int workers;
    frame.options = options ? *options : raindrop_render_defaults();
    frame.rain = rain;
    frame.environment = environment;
    frame.depth = depth;
    if (!rain || !environment || !raindrop__frame_is_valid(&frame) ||
        !raindrop__render_is_valid(&ignored, &frame.options) ||
        (frame.options.look == RAINDROP_LOOK_MAP && !frame.options.map))
        return SAT_ERR_ARGUMENT;
    raindrop__set_frame(&frame);
    threads = &rain->options.threads;
    workers = sat__worker_count(threads);
    memset(rain->tally, 0, (size_t)workers * sizeof *rain->tally);
    sat__parallel_for(threads, raindrop__chunk_count(rain->count), raindrop__cull_range, &frame);
    frame.visible = raindrop__gather_pairs(rain);
    frame.order = raindrop__sort(rain, frame.visible, frame.options.sort);
    sat__parallel_for(threads, (height + RAINDROP__BAND - 1) / RAINDROP__BAND, raindrop__draw_bands, &frame);
    if (stats) raindrop__sum_stats(stats, &frame, workers);
    return SAT_OK;
}

/* ---- the background */

static void raindrop__background_rows(int begin, int end, int worker, void *context)
{
    const raindrop__frame *frame = (const raindrop__frame *)context;
    int x, y;
    (void)worker;
    for (y = begin; y < end; y++) {
        float *row = (float *)(void *)(frame->rgb + (ptrdiff_t)y * frame->stride), d[3];
        for (x = 0; x < frame->width; x++) {
            raindrop__to_world(d, &frame->camera, ((float)x + 0.5f - frame->half_width) / frame->focal,
                               (frame->half_height - (float)y - 0.5f) / frame->focal, 1);
            raindrop_environment_sample(row + 3 * x, frame->environment, d, 1 / frame->focal);
        }
    }
}

RAINDROP_DEF sat_result raindrop_environment_render(float *rgb, ptrdiff_t stride, int width, int height,
                                                    const raindrop_camera *camera,
                                                    const raindrop_environment *environment, const sat_threads *threads)
{
    raindrop__frame frame = raindrop__frame_of(rgb, stride, width, height, camera);
    frame.environment = environment;
    if (!environment || !raindrop__frame_is_valid(&frame)) return SAT_ERR_ARGUMENT;
    if (threads && !sat__threads_are_valid(threads)) return SAT_ERR_ARGUMENT;
    raindrop__set_frame(&frame);
    sat__parallel_for(threads, height, raindrop__background_rows, &frame);
    return SAT_OK;
}

/* ---- the veil of the rain beyond the drops that are drawn */

typedef struct raindrop__veil_job { const raindrop__frame *frame; raindrop_veil_options options; } raindrop__veil_job;

static void raindrop__veil_rows(int begin, int end, int worker, void *context)
{
    const raindrop__veil_job *job = (const raindrop__veil_job *)context;
    const raindrop__frame *frame = job->frame;
    const raindrop_environment *environment = frame->environment;
    const raindrop_veil_options *o = &job->options;
    float d[3], colour[4], bow[3] = {0, 0, 0};
    int x, y, c;
    (void)worker;
    for (y = begin; y < end; y++)
        for (x = 0; x < frame->width; x++) {
            float right = ((float)x + 0.5f - frame->half_width) / frame->focal,
                  up = (frame->half_height - (float)y - 0.5f) / frame->focal, *out = raindrop__pixel(frame, x, y), kept;
            float z = frame->depth ? frame->depth[(size_t)y * (size_t)frame->width + (size_t)x] : 0,
                  way = z > 0 && sat__is_finite(z) ? z * sqrtf(1 + right * right + up * up) : o->reach;
            way = (way < o->reach ? way : o->reach) - o->from;
            if (!(way > 0)) continue;
            kept = expf(-o->extinction * way);
            raindrop__to_world(d, &frame->camera, right, up, 1);
            raindrop__far(colour, environment, d);
            if (environment->bow)
                raindrop__bow(bow, environment->bow, environment->sun_direction, environment->sun_irradiance, d);
            for (c = 0; c < 3; c++) out[c] = kept * out[c] + (1 - kept) * (colour[c] + bow[c]);
        }
}

RAINDROP_DEF sat_result raindrop_veil(float *rgb, ptrdiff_t stride, int width, int height, const float *depth,
                                      const raindrop_camera *camera, const raindrop_environment *environment,
                                      const raindrop_veil_options *options)
{
    raindrop__frame frame = raindrop__frame_of(rgb, stride, width, height, camera);
    raindrop__veil_job job;
    frame.environment = environment;
    frame.depth = depth;
    job.frame = &frame;
    job.options = options ? *options : raindrop_veil_defaults();
    if (!environment || !raindrop__frame_is_valid(&frame)) return SAT_ERR_ARGUMENT;
    if (sat__fields_check(&job.options, raindrop__veil_fields, SAT__COUNT(raindrop__veil_fields)))
        return SAT_ERR_ARGUMENT;
    raindrop__set_frame(&frame);
    sat__parallel_for(&job.options.threads, height, raindrop__veil_rows, &job);
    return SAT_OK;
}

#ifdef __cplusplus
}
#endif
SAT__IEEE_END
#endif /* RAINDROP_IMPLEMENTATION */

/* ------------------------------------------------------------------------------------------------
   >> shaders   GLSL 3.30 and ES 3.00
   ------------------------------------------------------------------------------------------------ */

#if defined(RAINDROP_IMPLEMENTATION) && defined(RAINDROP_GL) && !defined(RAINDROP__GL_IMPLEMENTED)
#define RAINDROP__GL_IMPLEMENTED

SAT__IEEE_BEGIN
#ifdef __cplusplus
extern "C" {
#endif

RAINDROP_DEF const char *raindrop_gl_glsl(void)
{
    return "#ifndef RAINDROP_GLSL\n"
           "#define RAINDROP_GLSL\n"
           SAT__GLSL(
               struct raindrop_ray { vec3 reflected, refracted; float fresnel, transmit, footprint; vec2 polarised,
                   turn; };
               void raindrop_surface(inout raindrop_ray ray, float ci, float cr, float n, bool total) {
                   float a = (ci - n * cr) / (ci + n * cr + 1e-12), c = (n * ci - cr) / (n * ci + cr + 1e-12);
                   float b2 = 1.0 - ci * ci, cd = ci * cr + b2 / n, sd = cr - ci / n;
                   vec2 f = total ? vec2(1.0) : vec2(a * a, c * c), enter = 1.0 - f;
                   ray.turn = vec2(1.0 - 2.0 * b2 * sd * sd, 2.0 * sd * cd);
                   ray.polarised = f;
                   ray.fresnel = 0.5 * (f.x + f.y);
                   ray.transmit = 0.5 * dot(enter, enter);
                   ray.footprint = total ? 2.0 : sqrt(abs(2.0 * (1.0 / (ci + 1e-6) - 1.0 / (n * cr + 1e-6))
                       * ray.turn.y));
               })
           SAT__GLSL(
               raindrop_ray raindrop_trace(vec3 d, vec3 p, float one_minus_b2, float n) {
                   raindrop_ray ray;
                   float m = clamp(one_minus_b2, 0.0, 1.0), b2 = 1.0 - m,
                       inside = (m + (n - 1.0) * (n + 1.0)) / (n * n);
                   bool total = inside <= 0.0 && n < 1.0;
                   raindrop_surface(ray, sqrt(m), sqrt(max(inside, 0.0)), n, total);
                   ray.reflected = (2.0 * b2 - 1.0) * d + 2.0 * sqrt(m) * p;
                   ray.refracted = total ? ray.reflected : ray.turn.x * d - ray.turn.y * p;
                   return ray;
               })
           "#endif\n";
}

/* The constants that the shaders share with the code above, as it has them. */
#define RAINDROP__TEXT(value) #value
#define RAINDROP__WORD(name) RAINDROP__TEXT(name)
#define RAINDROP__FLOAT(name, value) "const float " name " = " RAINDROP__TEXT(value) ";\n"
static const char raindrop__glsl_constants[] =
    RAINDROP__FLOAT("PI", RAINDROP__PI)
    RAINDROP__FLOAT("INNER", RAINDROP__INNER)
    RAINDROP__FLOAT("FINER", RAINDROP__FINER)
    RAINDROP__FLOAT("LOG2_STEP", RAINDROP__LOG2_STEP)
    RAINDROP__FLOAT("LOG2_BIAS", RAINDROP__LOG2_BIAS)
    RAINDROP__FLOAT("LEAST_RADIUS", RAINDROP__LEAST_RADIUS)
    RAINDROP__FLOAT("LEAST_BLUR", RAINDROP__LEAST_BLUR)
    RAINDROP__FLOAT("SHORT", RAINDROP__SHORT)
    RAINDROP__FLOAT("GAUSS", RAINDROP__GAUSS)
    RAINDROP__FLOAT("TENSION", RAINDROP__TENSION)
    RAINDROP__FLOAT("DENSITY", RAINDROP__DENSITY)
    RAINDROP__FLOAT("PERIOD", RAINDROP__PERIOD)
    RAINDROP__FLOAT("LEAST_LAMP", RAINDROP__LEAST_LAMP)
    RAINDROP__FLOAT("LEAST_GLINT", RAINDROP__LEAST_GLINT)
    RAINDROP__FLOAT("NEAREST", RAINDROP__NEAREST)
    RAINDROP__FLOAT("SWINGS", RAINDROP__SWINGS)
    RAINDROP__FLOAT("SWINGS_RISE", RAINDROP__SWINGS_RISE)
    RAINDROP__FLOAT("OVERTONE", RAINDROP__OVERTONE)
    RAINDROP__FLOAT("LEAN", RAINDROP__LEAN)
    RAINDROP__FLOAT("FLICKERS", RAINDROP__FLICKERS)
    RAINDROP__FLOAT("FLICKERS_MORE", RAINDROP__FLICKERS_MORE);

/* raindrop__hash and its like. */
static const char raindrop__glsl_random[] =
    SAT__GLSL(
        uniform uint seed;
        uint mix_bits(uint v) {
            v = (v ^ (v >> 16)) * 0x7feb352du;
            v = (v ^ (v >> 15)) * 0x846ca68bu;
            return v ^ (v >> 16);
        }
        uint hash(uint s, uint i) { return mix_bits(i ^ mix_bits(s ^ mix_bits(seed ^ 0x9e3779b9u))); }
        float uniform_of(uint bits) { return (float(bits >> 9) + 0.5) / 8388608.0; });

/* Lookups in the environment's levels, laid out as an atlas: level 0, and to its right the others one above another. */
static const char raindrop__glsl_environment[] =
    SAT__GLSL(
        uniform sampler2D environment, far_drops;
        uniform vec2 environment_size; /* resolution, levels */
        vec3 fold(vec3 d) { /* unit square, and |x|+|y|+|z| */
            float sum = abs(d.x) + abs(d.y) + abs(d.z);
            vec2 p = d.xz / sum, s = vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
            if (d.y < 0.0) p = (1.0 - abs(p.yx)) * s;
            return vec3(p * 0.5 + 0.5, sum / length(d));
        })
    SAT__GLSL(
        vec3 atlas(vec2 uv, float level) {
            float r = environment_size.x, below = exp2(level), side = r / below;
            vec2 corner = level < 0.5 ? vec2(0.0) : vec2(r + 2.0, r * (1.0 - 2.0 / below) + 2.0 * (level - 1.0));
            return textureLod(environment, (corner + 1.0 + uv * side) / vec2(textureSize(environment, 0)), 0.0).rgb;
        })
    SAT__GLSL(
        vec3 look(vec3 d, float cone) {
            vec3 at = fold(d);
            float texels = FINER * cone * 0.5 * environment_size.x / (at.z * sqrt(at.z));
            /* raindrop__rough_log2 */
            float lod = texels > 1.0 ? float(floatBitsToUint(texels)) * LOG2_STEP - LOG2_BIAS : 0.0;
            lod = clamp(lod, 0.0, environment_size.y - 1.0);
            float level = floor(lod);
            vec3 fine = atlas(at.xy, level);
            if (level + 1.0 >= environment_size.y) return fine;
            return mix(fine, atlas(at.xy, level + 1.0), lod - level);
        });

/* raindrop__veil_rows; BOW where the environment keeps the bows. */
static const char raindrop__glsl_veil[] =
    SAT__GLSL(
        uniform vec3 right, up, back, sun, irradiance;
        uniform vec4 view; /* half width, half height, focal length in pixels; 1: depth is a texture */
        uniform vec4 rain; /* extinction, from, reach */
        uniform vec4 planes; /* normalised depth is x + y / distance, and z times what the texture holds + w */
        uniform sampler2D depth;)
    "#ifdef BOW\n"
    SAT__GLSL(uniform sampler2D bow;)
    "#endif\n"
    SAT__GLSL(
        layout(location = 0) out vec4 colour;
        void main() {
            vec3 d = vec3((vec2(sat_pixel()) + 0.5 - view.xy) / view.z, 1.0);
            float way = rain.z;
            if (view.w > 0.5) {
                float at = texelFetch(depth, sat_pixel() + sat_from, 0).r;
                bool is_empty = planes.y > 0.0 ? at <= 0.0 : at >= 1.0;
                if (!is_empty) way = min(way, length(d) * planes.y / (planes.z * at + planes.w - planes.x));
            }
            if (way <= rain.y) discard;
            d = d.x * right + d.y * up - d.z * back;
            vec2 size = vec2(textureSize(far_drops, 0));
            colour = vec4(textureLod(far_drops, (fold(d).xy * (size - 2.0) + 1.0) / size, 0.0).rgb,
                1.0 - exp(-rain.x * (way - rain.y)));)
    "#ifdef BOW\n"
    SAT__GLSL(
            int side = textureSize(bow, 0).x, count = side * side;
            float x = acos(clamp(dot(d, sun) / length(d), -1.0, 1.0)) * float(count) / PI - 0.5;
            int bin = clamp(int(x), 0, count - 2), after = bin + 1;
            vec3 a = texelFetch(bow, ivec2(bin % side, bin / side), 0).rgb,
                b = texelFetch(bow, ivec2(after % side, after / side), 0).rgb;
            colour.rgb += irradiance * mix(a, b, clamp(x - float(bin), 0.0, 1.0));)
    "#endif\n"
    SAT__GLSL(});

/* A drop's square or streak. LOOK 0 map, 1 sprite, 2 ray, 3 auto; SOFT where drops leave streaks or are out of focus,
   FLAT where some are flattened. */
static const char raindrop__glsl_draw_vertex[] =
    SAT__GLSL(
        layout(location = 0) in vec4 drop; /* position, radius */
        layout(location = 1) in vec4 motion; /* velocity, axis ratio */
        uniform vec3 eye, right, up, back;
        uniform vec4 view; /* half width, half height, focal length in pixels, near distance */
        uniform vec4 limits; /* far radius, coverage threshold; depth is z + w / distance */
        uniform ivec3 sat_corner_of; /* as sat__gl_pixel has it: z > 0, upside down */
        uniform vec2 slice; /* depths that are drawn */
        flat out vec4 place; /* centre in pixels, half side (sprite) or radius, focal length in
                                                  radii; of a far drop: opacity */
        flat out vec4 seen; /* centre in radii, view space, z forward; axis ratio. Of a far drop
                                                  raindrop__shape: half height, slope, half width, swapped */
        flat out vec4 far_colour;) /* colour; 1: a far drop */
    "#ifdef SWING\n"
    SAT__GLSL(
        uniform vec2 swings; /* oscillation, seconds */
        flat out vec4 beat; /* cycles and frequencies of two modes */
        flat out vec4 wobble; /* amplitude, axis ratio without it; exponents of a far drop's light */
        vec2 lean;
        void swing_of(uint index) { /* raindrop__swing_of */
            beat = wobble = vec4(0.0, 0.0, 0.0, 0.0);
            wobble.y = motion.w;
            if (drop.w <= SWINGS) return;
            uint a = hash(8u, index), b = hash(9u, index);
            vec2 rate = sqrt(8.0 * TENSION / DENSITY / (drop.w * drop.w * drop.w)) / (2.0 * PI) * vec2(1.0, OVERTONE);
            rate = floor(rate * PERIOD) / PERIOD;
            wobble.x = swings.x * clamp((drop.w - SWINGS) * SWINGS_RISE, 0.0, 1.0);
            beat = vec4(vec2(uniform_of(a), uniform_of(b)) + fract(rate * swings.y), rate);
            float turn = 2.0 * PI * uniform_of(mix_bits(a));
            lean = vec2(cos(turn), sin(turn));
        }
        float sine_of(float turns) { return sin(2.0 * PI * fract(turns)); })
    "#endif\n"
    "#ifdef SOFT\n"
    SAT__GLSL(
        uniform vec4 shutter; /* the camera's velocity, exposure */
        uniform vec2 lens; /* aperture, focus distance */
        flat out vec4 path; /* in pixels: streak, circle of confusion, radius of what moves (0: sharp
                                                  and still, or far and not round) */
        vec4 path_of(vec3 v, float r, bool is_far) {
            vec3 w = motion.xyz - shutter.xyz;
            vec2 fall = vec2(dot(w, right), dot(w, up)) + v.xy / v.z * dot(w, back);
            vec2 streak = clamp(shutter.w * view.z / v.z * fall, -1e5, 1e5);
            float blur = min(0.5 * lens.x * view.z * abs(1.0 / v.z - 1.0 / lens.y), 1e5), way2 = dot(streak, streak);
            return vec4(streak, blur, way2 + blur * blur < 0.0625 ? 0.0 : way2 <= 0.0625 && !is_far
                ? r + max(blur, LEAST_BLUR) : blur > 0.25 ? length(vec2(r, blur)) : r);
        })
    "#endif\n";

static const char raindrop__glsl_draw_place[] =
    SAT__GLSL(
        void main() {
            vec3 rel = drop.xyz - eye, v = vec3(dot(rel, right), dot(rel, up), -dot(rel, back));)
    /* r: half axis across; ball: radius of a ball around the drop, however it swings */
    "#ifdef SWING\n"
    "#ifdef QUADS\n"
    SAT__GLSL(swing_of(uint(gl_InstanceID));)
    "#else\n"
    SAT__GLSL(swing_of(uint(gl_VertexID));)
    "#endif\n"
    SAT__GLSL(
            float tall = pow(motion.w * (1.0 + wobble.x), 2.0 / 3.0),
                wide = pow(motion.w * (1.0 - wobble.x), -1.0 / 3.0);
            float ratio = motion.w * (1.0 + wobble.x * sine_of(beat.x)), r = drop.w * pow(ratio, -1.0 / 3.0),
                ball = drop.w * max(tall, wide);)
    "#elif defined FLAT\n"
    SAT__GLSL(float ratio = motion.w, r = drop.w * pow(ratio, -1.0 / 3.0), ball = r;)
    "#else\n"
    SAT__GLSL(
            const float ratio = 1.0;
            float r = drop.w, ball = r;)
    "#endif\n"
    SAT__GLSL(
            float d2 = dot(v, v), tangent2 = r * r / (d2 - r * r), stretch = sqrt(d2) / v.z;
            float area_radius = view.z * sqrt(tangent2 * ratio * stretch * stretch * stretch);
            /* from the middle to the sides of the square or streak */
            vec2 right_reach = vec2(0.0), up_reach = vec2(0.0);
            gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
            place = vec4(0.0);
            seen = vec4(0.0);
            far_colour = vec4(0.0);)
    "#ifdef SOFT\n"
    SAT__GLSL(path = vec4(0.0);)
    "#endif\n"
    SAT__GLSL(
            bool kept = motion.w > 0.0 && motion.w <= 1.0 && drop.w > 0.0 && d2 > 1.0001 * ball * ball
                && v.z - ball > view.w && v.z > 1.0001 * ball && v.z >= slice.x && v.z < slice.y;
            if (kept && PI * area_radius * area_radius >= limits.y) {
                vec2 middle = view.xy + view.z * v.xy / v.z;
                seen = vec4(v / r, ratio);
                place = vec4(middle, area_radius, v.z / (view.z * r));)
    "#if LOOK < 2\n"
    SAT__GLSL(
                place.z = max(view.z * sqrt(tangent2) * stretch, 0.5);
                right_reach = vec2(place.z + 0.01, 0.0);
                up_reach = right_reach.yx;) /* rasterisers snap to 1/256 of a pixel; the fragment cuts exactly */
    "#else\n"
    /* tangents from the eye, exact off axis */
    SAT__GLSL(
                vec2 q = sqrt(v.xy * v.xy + v.z * v.z - ball * ball),
                    low = (v.xy * q - ball * v.z) / (v.z * q + ball * v.xy);
                vec2 high = (v.xy * q + ball * v.z) / (v.z * q - ball * v.xy);
                bool is_far = area_radius < max(limits.x, LEAST_RADIUS);
                vec4 blurred = vec4(0.0);
                vec2 reach = 0.5 * view.z * (high - low) + 1.0;
                middle = view.xy + 0.5 * view.z * (low + high);)
    "#ifdef GLINT\n"
    SAT__GLSL(
                vec3 light;
                bool lit = glint(light, place.xy, area_radius, is_far);
                place.z = area_radius;
                is_far = true;)
    "#endif\n"
    "#ifdef SOFT\n"
    SAT__GLSL(
                path = blurred = path_of(v, area_radius, is_far);
                if (is_far && path.z <= LEAST_RADIUS) path.w = 0.0;
                if (path.w > 0.0) {
                    float way = length(path.xy);
                    vec2 along = way > 1e-6 ? path.xy / way : vec2(1.0, 0.0);
                    reach = vec2(path.w) + vec2(0.5 * way + 1.0, 1.0);
                    middle = place.xy;
                    right_reach = reach.x * along;
                    up_reach = reach.y * vec2(-along.y, along.x);
                } else)
    "#endif\n"
    SAT__GLSL(
                {
                    right_reach = vec2(reach.x, 0.0);
                    up_reach = vec2(0.0, reach.y);
                }
                if (is_far) {
                    vec3 d = v.x * right + v.y * up - v.z * back, at = fold(d);
                    vec2 size = vec2(textureSize(far_drops, 0));
                    far_colour = textureLod(far_drops, (at.xy * (size - 2.0) + 1.0) / size, 0.0);)
    "#ifdef GLINT\n"
    SAT__GLSL(far_colour.rgb = light;)
    "#elif defined SWING\n"
    SAT__GLSL(wobble.zw = clamp(wobble.x * far_colour.a, -FLICKERS, FLICKERS) * vec2(1.0, FLICKERS_MORE);)
    "#endif\n"
    SAT__GLSL(far_colour.a = 1.0;)
    /* raindrop__far_shape */
    SAT__GLSL(
                    bool swapped = abs(blurred.x) > abs(blurred.y);
                    vec2 way = swapped ? blurred.yx : blurred.xy;
                    float a = PI * (area_radius * area_radius + blurred.z * blurred.z), h2 = way.y * way.y + a,
                        slope = way.x * way.y / h2;
                    vec2 half_size = 0.5 * sqrt(vec2(a * (1.0 + way.x * way.x / h2), h2));
                    seen = vec4(half_size.y, slope, half_size.x, swapped ? 1.0 : 0.0);
                    middle = place.xy;
                    place.w = PI * area_radius * area_radius / (4.0 * half_size.x * half_size.y);
                    if (blurred.z <= LEAST_RADIUS) { /* one more pixel on all sides, whose squares it may touch */
                        right_reach = vec2(half_size.x + 0.51 + 0.5 * abs(slope), 0.0);
                        up_reach = vec2(slope, 1.0) * (half_size.y + 0.51);
                        if (swapped) right_reach = right_reach.yx, up_reach = up_reach.yx;
                    }
                })
    "#endif\n"
        "#ifdef QUADS\n"
    SAT__GLSL(
                vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 2.0 - 1.0;
                middle += corner.x * right_reach + corner.y * up_reach;)
    "#endif\n"
    SAT__GLSL(
                gl_Position = vec4(middle / view.xy - 1.0, limits.z + limits.w / v.z, 1.0);
                if (sat_corner_of.z > 0) gl_Position.y = -gl_Position.y;)
    "#ifdef GLINT\n"
    SAT__GLSL(if (!lit) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);)
    "#endif\n"
    SAT__GLSL(})
    "#ifndef QUADS\n"
    SAT__GLSL(
            vec2 reach = abs(right_reach) + abs(up_reach);
            gl_PointSize = max(2.0 * max(reach.x, reach.y), 1.0);)
    "#endif\n"
    SAT__GLSL(});

/* raindrop__turned_b2, raindrop__path_share. */
static const char raindrop__glsl_lamp[] =
    SAT__GLSL(
        uniform vec4 lamp; /* position, radius */
        uniform vec3 intensity;
        uniform vec3 axis;
        uniform vec4 cone; /* angles of full light and of none, path: as RAINDROP__GLINTS, the bow's angle */
        uniform vec2 optics; /* index */
        uniform vec2 orders; /* 0: order 0 has the later ones' light */
        float turned_b2(float angle) {
            float n = optics.x, c = cos(0.5 * angle), s = sin(0.5 * angle);
            if (cone.z < 0.5) return c * c;
            if (cone.z < 1.5) {
                if (n < 1.0 ? n >= c : n * c <= 1.0) return min(n * n, 1.0);
                return n * n * s * s / (1.0 + n * n - 2.0 * n * c);
            }
            float bow2 = clamp((4.0 - n * n) / 3.0, 0.0, 1.0), bow = sqrt(bow2);
            float e = angle - cone.w;
            if (e <= 0.0) return bow2;
            float bend = 2.0 * bow / ((1.0 - bow2) * sqrt(1.0 - bow2) + 1e-6)
                - 4.0 * bow / (n * n * n * (1.0 - bow2 / (n * n)) * sqrt(1.0 - bow2 / (n * n)));
            vec2 range = cone.z < 2.5 ? vec2(0.0, bow) : vec2(bow, 1.0);
            float b = clamp(bow + (cone.z < 2.5 ? -1.0 : 1.0) * sqrt(2.0 * e / max(bend, 0.1)), range.x, range.y);
            for (int i = 0; i < 6; i++) {
                float slope = 2.0 / (sqrt((1.0 - b) * (1.0 + b)) + 1e-4) - 4.0 / sqrt(n * n - b * b);
                b = clamp(b - (PI + 2.0 * asin(b) - 4.0 * asin(b / n) - angle) / slope, range.x, range.y);
            }
            return b * b;
        }
        float path_share(float b2) {
            raindrop_ray ray = raindrop_trace(vec3(0.0, 0.0, -1.0), vec3(sqrt(b2), 0.0, 0.0), 1.0 - b2, optics.x);
            vec2 f = ray.polarised, enter = 1.0 - f;
            if (cone.z < 0.5) return ray.fresnel;
            if (cone.z < 1.5) return orders.x > 0.5 ? ray.transmit : 1.0 - ray.fresnel;
            return orders.x > 0.5 ? 0.5 * dot(enter, f) : 0.0;
        });

/* raindrop__light, raindrop__glint_of, raindrop__flicker_at. */
static const char raindrop__glsl_glint[] =
    SAT__GLSL(
        float glint_b2(float angle, float per_distance) {
            float b2 = turned_b2(angle);
            for (int i = 0; per_distance > 0.0 && i < 8; i++) {
                float off = asin(sqrt(b2) * per_distance);
                b2 = 0.5 * (b2 + turned_b2(clamp(cone.z > 0.5 ? angle + off : angle - off, 0.0, PI)));
            }
            return b2;
        }
        float lamp_share(vec3 to) {
            if (cone.x >= 3.14) return 1.0;
            float at = acos(clamp(-dot(to, axis), -1.0, 1.0));
            float share = at <= cone.x ? 1.0 : at < cone.y ? (cone.y - at) / (cone.y - cone.x) : 0.0;
            return share * share * (3.0 - 2.0 * share);
        })
    SAT__GLSL(
        bool glint(out vec3 light, inout vec2 middle, inout float radius, bool is_far) {
            vec3 d = drop.xyz - eye, to = lamp.xyz - drop.xyz;
            float away = length(to), distance = length(d) / drop.w, per = is_far ? 0.0 : min(1.0 / distance, NEAREST);
            light = vec3(0.0);
            if (away <= drop.w) return false;
            d = normalize(d);
            to /= away;
            float cosine = clamp(dot(d, to), -1.0, 1.0), angle = acos(cosine), wide = max(lamp.w / max(away, lamp.w),
                LEAST_LAMP), low = max(angle - wide, 0.0), high = min(angle + wide, PI);
            if (cone.z > 1.5 && high + 1.02 * per < cone.w) return false;
            float low_b2 = glint_b2(low, per), high_b2 = glint_b2(high, per), b2 = glint_b2(angle, per), b = sqrt(b2);
            float g = abs(high_b2 - low_b2) / (4.0 * sin(0.5 * (low + high)) * sin(0.5 * (high - low)) + 1e-9);
            g *= (1.0 - per * per) / sqrt(1.0 - 0.5 * (low_b2 + high_b2) * per * per);
            light = path_share(b2) * g * lamp_share(to) / (away * away) * intensity;
            vec3 side = to - cosine * d, other = abs(d.y) < 0.9 ? vec3(-d.z, 0.0, d.x) : vec3(0.0, d.z, -d.y);
            side = normalize(dot(side, side) > 1e-12 ? side : other);
            float off = b * per, turn = cone.z > 0.5 && optics.x > 1.0 ? -1.0 : 1.0;
            vec3 ray = sqrt(1.0 - off * off) * d + turn * off * side,
                normal = turn * b * sqrt(1.0 - off * off) * side - b * off * d - sqrt((1.0 - b) * (1.0 + b)) * ray;
            float y2 = normal.y * normal.y, e = wobble.x / 1.5, old = radius;
            wobble.zw = e * vec2(-4.0 * (1.5 * y2 - 0.5),
                -15.0 * (5.0 * y2 - 1.0) * (normal.x * lean.x + normal.z * lean.y) / LEAN);
            if (!is_far) {
                middle = view.xy + view.z * vec2(dot(ray, right), dot(ray, up)) / -dot(ray, back);
                radius = clamp(radius * wide * sqrt(g), LEAST_GLINT, radius);
            }
            light *= old * old / (PI * radius * radius);
            return g > 0.0 && light.r + light.g + light.b > 0.0;
        });

/* ------------------------------------------------------------------------------------------------
   >> fragments   the fragments of drops
   ------------------------------------------------------------------------------------------------ */

/* Two lookups a ray, and raindrop__half_plane: what all looks share. */
static const char raindrop__glsl_shade[] =
    SAT__GLSL(
        float half_plane(float s, vec2 n) {
            float lo = max(min(abs(n.x), abs(n.y)), 0.01), hi = max(max(abs(n.x), abs(n.y)), 0.7), h = 0.5 * (hi + lo),
                g = 0.5 * (hi - lo);
            vec4 v = max(clamp(s, -1.0, 1.0) + vec4(h, g, -g, -h), 0.0);
            return clamp(0.5 * dot(v * v, vec4(1.0, -1.0, -1.0, 1.0)) / (lo * hi), 0.0, 1.0);
        })
    SAT__GLSL(
        flat in vec4 place;
        flat in vec4 seen;
        flat in vec4 far_colour;
        uniform vec3 right, up, back;
        uniform vec4 view;
        uniform vec2 optics; /* index, whether the exit has Fresnel factors */
        layout(location = 0) out vec4 colour;
        vec2 here() { /* points reach beyond the viewport */
            vec2 p = vec2(sat_pixel()) + 0.5;)
    "#ifndef QUADS\n"
    SAT__GLSL(if (any(lessThan(p, vec2(0.0))) || any(greaterThan(p, 2.0 * view.xy))) discard;)
    "#endif\n"
    SAT__GLSL(
            return p;
        })
    SAT__GLSL(float pixel_width() { return sqrt(dot(seen.xyz, seen.xyz) - 1.0) / view.z; }) /* in radii */
    SAT__GLSL(
        vec3 mirrored(raindrop_ray ray, float blur) {
            return ray.fresnel * look(ray.reflected, blur * (2.0 * pixel_width() + 1.0 / view.z));
        })
    SAT__GLSL(
        vec3 shade(raindrop_ray ray, float blur) {
            float pass = optics.y > 0.5 ? ray.transmit : 1.0 - ray.fresnel;
            return mirrored(ray, blur) + pass
                * look(ray.refracted, blur * abs(ray.footprint * pixel_width() - 1.0 / view.z));
        });

/* LOOK 0 and 1. */
static const char raindrop__glsl_draw_sprite[] =
    "#if LOOK == 0\n"
    SAT__GLSL(uniform sampler2D reflections, refractions;)
    "#endif\n"
    /* the camera's axes under the shortest rotation from back to the direction of the eye (eq 2.1 without eq 2.3) */
    SAT__GLSL(
        vec3 turned(vec3 v, vec3 n) {
            float k = 1.0 / (1.0 + n.z);
            vec3 to_eye = n.x * right + n.y * up + n.z * back;
            return v.x * (right - n.x * k * (back + to_eye)) + v.y * (up - n.y * k * (back + to_eye)) + v.z * to_eye;
        })
    SAT__GLSL(
        void main() {
            vec2 st = (here() - place.xy) / place.z;
            if (max(abs(st.x), abs(st.y)) > 1.0) discard;
            float d2 = dot(seen.xyz, seen.xyz);
            vec3 n = vec3(-seen.xy, seen.z) / sqrt(d2);
            raindrop_ray ray;)
    "#if LOOK == 0\n"
    SAT__GLSL(
            float lod = max(0.5 * log2(max(d2 - 1.0, 1.0)), 0.0),
                b2 = min(dot(st, st), 0.9999 * min(optics.x * optics.x, 1.0));
            vec4 l = textureLod(reflections, st * 0.5 + 0.5, lod), r = textureLod(refractions, st * 0.5 + 0.5, lod);
            if (r.a <= 1.0 / 255.0) discard;
            /* for the footprint */
            ray = raindrop_trace(vec3(0.0, 0.0, -1.0), vec3(sqrt(b2), 0.0, 0.0), 1.0 - b2, optics.x);
            ray.reflected = turned(normalize(l.xyz), n);
            ray.refracted = turned(normalize(r.xyz), n);
            ray.fresnel = l.a;
            ray.transmit = 1.0 - l.a;
            colour = vec4(shade(ray, 1.0), r.a);)
    "#else\n"
    SAT__GLSL(
            float rho = length(st), alpha = clamp((1.0 - rho) * view.z / sqrt(d2 - 1.0) + 0.5, 0.0, 1.0),
                dist = sqrt(d2);
            if (alpha <= 0.0) discard;
            if (rho > INNER) st *= INNER / rho;
            vec2 xy = st / sqrt(d2 - 1.0);
            float c2 = 1.0 / (1.0 + dot(xy, xy));
            vec3 d = vec3(xy, -1.0) * sqrt(c2), p = dist * vec3(xy * c2, 1.0 - c2);
            ray = raindrop_trace(turned(d, n), turned(p, n), (1.0 - dot(st, st)) * c2, optics.x);
            colour = vec4(shade(ray, 1.0), alpha);)
    "#endif\n"
    SAT__GLSL(});

/* raindrop__large_colour and raindrop__add_orders. */
static const char raindrop__glsl_orders[] =
    "#ifdef ORDERS\n"
    SAT__GLSL(
        uniform vec2 orders; /* their number, radius in pixels from which drops have them */
        vec3 add_orders(vec3 d, vec3 p, float m, int last) {
            raindrop_ray ray = raindrop_trace(d, p, m, optics.x);
            float n = optics.x, b2 = 1.0 - m, cr = sqrt(max((m + (n - 1.0) * (n + 1.0)) / (n * n), 0.0));
            vec2 turn = ray.turn, once = vec2(2.0 * b2 / (n * n) - 1.0, 2.0 * cr / n), enter = 1.0 - ray.polarised,
                inside = enter;
            vec3 sum = mirrored(ray, 1.0);
            for (int k = 0; k <= last; k++) {
                vec2 leave = k == last && optics.y < 0.5 ? vec2(1.0) : enter;
                float footprint = sqrt(abs(2.0 * (1.0 / (sqrt(m) + 1e-6) - float(k + 1) / (n * cr + 1e-6)) * turn.y));
                sum += 0.5 * dot(inside, leave)
                    * look(turn.x * d - turn.y * p, abs(footprint * pixel_width() - 1.0 / view.z));
                turn = vec2(turn.x * once.x - b2 * turn.y * once.y, turn.y * once.x + turn.x * once.y);
                inside *= ray.polarised;
            }
            return sum;
        })
    SAT__GLSL(
        vec3 still_colour(vec3 d, vec3 p, float m) { /* large drops: four rays at the rim */
            float b = sqrt(1.0 - m), width = pixel_width(), count = 0.0;
            bool is_large = place.z >= orders.y;
            int last = is_large ? int(orders.x) : 0, taps = is_large && 1.0 - b <= 3.0 * width && width <= 0.25 ? 4 : 1;
            vec3 sum = vec3(0.0);
            for (int j = 0; j < taps; j++) {
                float at = taps == 1 ? b : b + (0.25 * float(j) - 0.375) * width;
                if (at >= 1.0) continue;
                sum += add_orders(d, p * (at / max(b, 1e-9)), taps == 1 ? m : (1.0 - at) * (1.0 + at), last);
                count += 1.0;
            }
            return sum / count;
        })
    "#endif\n";

/* raindrop_trace_spheroid behind raindrop__flat_cover; raindrop__flicker. */
static const char raindrop__glsl_flat[] =
    "#ifdef SWING\n"
    SAT__GLSL(
        uniform vec4 shutter;
        flat in vec4 beat;
        flat in vec4 wobble;
        float bent, radii; /* axis ratio of the moment, and pixels in radii */
        float sine_of(float turns) { return sin(2.0 * PI * fract(turns)); }
        float bessel(float x) {
            float q = 0.25 * x * x;
            return 1.0 + q * (1.0 + q * (1.0 / 4.0 + q * (1.0 / 36.0 + q * (1.0 / 576.0 + q / 14400.0))));
        }
        float flicker(float along) {
            float span = shutter.w / (2.0 * seen.x), dt = along * span;
            vec2 turn = PI * beat.zw * span, x = wobble.zw;
            if (turn.x > 0.01) x.x *= sin(turn.x) / turn.x;
            if (turn.y > 0.01) x.y *= sin(turn.y) / turn.y;
            return exp(x.x * sine_of(beat.x + beat.z * dt) + x.y * sine_of(beat.y + beat.w * dt))
                / (bessel(x.x) * bessel(x.y));
        }
        void bend(float dt) {
            bent = wobble.y * (1.0 + wobble.x * sine_of(beat.x + beat.z * dt));
            radii = place.w * pow(bent / seen.w, 1.0 / 3.0);
        })
    "#else\n"
    "#define bent seen.w\n"
    "#define radii place.w\n"
    "#endif\n"
    "#ifdef FLAT\n"
    SAT__GLSL(
        float trace_flat(out raindrop_ray ray, vec3 d, vec3 p) {
            vec3 s = vec3(1.0, 1.0 / bent, 1.0), unit = d * s, q = p * s;
            float n = optics.x, d2 = dot(unit, unit);
            q -= dot(q, unit) / d2 * unit;
            vec2 rim = vec2(dot(q * s, right), dot(q * s, up));
            float b = length(q) + 1e-9, length_of_rim = length(rim) + 1e-20, slope = radii * length_of_rim / b + 1e-9;
            q *= min(1.0, INNER / b);
            vec3 hit = q - sqrt((1.0 - dot(q, q)) / d2) * unit, normal = normalize(hit * s),
                inner = refract(d, normal, 1.0 / n);
            bool total = dot(inner, inner) < 0.5; /* refract then gives 0 */
            ray.reflected = ray.refracted = reflect(d, normal);
            raindrop_surface(ray, -dot(d, normal), -dot(inner, normal), n, total);
            if (!total) {
                unit = inner * s;
                hit -= 2.0 * dot(hit, unit) / dot(unit, unit) * unit;
                ray.refracted = refract(inner, -normalize(hit * s), n);
                if (dot(ray.refracted, ray.refracted) < 0.5) ray.transmit = 0.0, ray.refracted = inner;
            }
            return half_plane((1.0 - b) / slope - slope / max(24.0 * b, 12.0 * slope), rim / length_of_rim);
        })
    "#endif\n";

/* LOOK 2 and 3: raindrop__batch_rays, raindrop__draw_far. */
static const char raindrop__glsl_draw_trace[] =
    SAT__GLSL(
        float disc_cover(float radius, vec2 at) { /* raindrop__disc_cover */
            float apart = length(at) + 1e-6;
            return half_plane(radius - apart - 1.0 / (24.0 * max(apart, 0.5)), at / apart);
        })
    /* raindrop__far_row: one pixel of it */
    SAT__GLSL(
        float far_cover(vec2 at) {
            if (seen.w > 0.5) at = at.yx;
            float low = max(at.y - 0.5, -seen.x), high = min(at.y + 0.5, seen.x),
                w = max(abs(seen.y) * (high - low), 0.01);
            if (high <= low) return 0.0;
            vec2 x = at.x - seen.y * 0.5 * (low + high) + vec2(-0.5, 0.5);
            vec2 a = max(seen.z - 0.5 * w - x, 0.0), b = max(seen.z + 0.5 * w - x, 0.0),
                c = max(-seen.z - 0.5 * w - x, 0.0), d = max(-seen.z + 0.5 * w - x, 0.0);
            vec2 right_of = ((b - a) * (b + a) - (d - c) * (d + c)) * 0.5 / w;
            return place.w * (high - low) * (right_of.x - right_of.y);
        })
    /* the pixel's ray through the drop whose centre is projected `at` from here; cover: the share of the pixel it
       takes */
    SAT__GLSL(
        struct fragment { raindrop_ray ray; vec3 d, p; float one_minus_b2, cover; };
        fragment trace(vec2 at) {
            fragment f;
            vec3 d = vec3((here() - view.xy) / view.z, 1.0), q = vec3(at * radii, 0.0);
            float l2 = dot(d, d), t = dot(q, d) / l2;
            vec3 p = q - t * d;
            float b2 = dot(p, p), b = sqrt(max(b2, 1e-12)),
                slope = max(length(p.xy * (radii - t / view.z)) / b, 1e-9);
            f.d = (d.x * right + d.y * up - d.z * back) / sqrt(l2);
            f.p = p.x * right + p.y * up - p.z * back;)
    "#ifdef FLAT\n"
    SAT__GLSL(
            if (bent < 1.0 || bent > 1.0) {
                f.cover = trace_flat(f.ray, f.d, f.p);
                return f;
            })
    "#endif\n"
    SAT__GLSL(
            f.p *= min(1.0, INNER / b);
            f.one_minus_b2 = max(1.0 - b2, 1.0 - INNER * INNER);
            f.ray = raindrop_trace(f.d, f.p, f.one_minus_b2, optics.x);
            f.cover = half_plane((1.0 - b) / slope - slope / max(24.0 * b, 12.0 * slope),
                p.xy / max(length(p.xy), 1e-20));
            return f;
        });

/* raindrop__draw_soft, raindrop__draw_far_round. */
static const char raindrop__glsl_draw_soft[] =
    "#ifdef SOFT\n"
    SAT__GLSL(
        flat in vec4 path;
        float lens_share(float r, float c, float apart) {
            if (apart >= r + c) return 0.0;
            if (apart <= abs(r - c)) return min(r * r / (c * c), 1.0);
            float x = clamp((apart * apart + r * r - c * c) / (2.0 * apart * r), -1.0, 1.0);
            float y = clamp((apart * apart + c * c - r * r) / (2.0 * apart * c), -1.0, 1.0);
            float k = (r + c - apart) * (apart + r - c) * (apart - r + c) * (apart + r + c);
            return (r * r * acos(x) + c * c * acos(y) - 0.5 * sqrt(max(k, 0.0))) / (PI * c * c);
        })
    /* raindrop__mean_chord, raindrop__mean_clamp, raindrop__path_cover */
    SAT__GLSL(
        float mean_chord(float r, float w, float width) {
            vec2 x = clamp(vec2(w - 0.5 * width, w + 0.5 * width) / r, -1.0, 1.0),
                s = x * sqrt((1.0 - x) * (1.0 + x)) + asin(x);
            return r * r * 0.5 * (s.y - s.x) / width;
        })
    SAT__GLSL(
        float mean_clamp(float v, float way, float w) {
            vec2 e = vec2(0.5 * way, -0.5 * way), a = clamp(v + 0.5 * w + e, 0.0, w), b = max(v - 0.5 * w + e, 0.0);
            return 0.5 * (a.x * a.x - a.y * a.y) / w + b.x - b.y;
        })
    SAT__GLSL(
        float path_cover(vec2 at, vec2 along, float way, float u, float w) {
            vec2 apart = GAUSS * way * along;
            if (way < SHORT) return 0.5 * (disc_cover(path.w, at - apart) + disc_cover(path.w, at + apart));
            float width = 1.0 / max(abs(along.x), abs(along.y)), h = mean_chord(path.w, w, width);
            return h > 0.0 ? (mean_clamp(u + h, way, width) - mean_clamp(u - h, way, width)) / way : 0.0;
        })
    SAT__GLSL(
        void draw_soft(vec2 at) {
            float r = place.z, way = length(path.xy);
            bool is_far = far_colour.w > 0.5, moves = way > 0.25;
            vec2 along = way > 1e-6 ? path.xy / way : vec2(1.0, 0.0);
            float u = dot(at, along), w = along.x * at.y - along.y * at.x, h = sqrt(max(path.w * path.w - w * w, 0.0));
            float from = clamp(u - h, -0.5 * way, 0.5 * way), to = clamp(u + h, -0.5 * way, 0.5 * way), alpha;
            if (moves || is_far) alpha = path_cover(at, along, way, u, w) * r * r / (path.w * path.w);
            else alpha = lens_share(r, max(path.z, LEAST_BLUR), length(at)), from = to = 0.0;
            if (alpha <= 0.0) discard;
            colour = vec4(far_colour.rgb, alpha);
            if (is_far) return;
            int samples = !moves ? 1 : r < 6.0 ? 4 : r < 24.0 ? 8 : 16;
            float blur = 2.0 * path.z + (moves ? max(min(2.0 * r, way) / float(samples), 1.0) : 1.0);
            vec3 sum = vec3(0.0);
            for (int j = 0; j < samples; j++) {
                float t = mix(from, to, (float(j) + 0.5) / float(samples));)
    "#ifdef SWING\n"
    SAT__GLSL(if (moves) bend(t / way * shutter.w);)
    "#endif\n"
    SAT__GLSL(
                sum += shade(trace(at - along * t).ray, blur);
            }
            colour.rgb = sum / float(samples);
        })
    "#endif\n";

static const char raindrop__glsl_draw_ray[] =
    SAT__GLSL(
        void main() {
            vec2 at = here() - place.xy;)
    "#ifdef SWING\n"
    SAT__GLSL(
            bent = seen.w;
            radii = place.w;)
    "#endif\n"
    "#ifdef SOFT\n"
    SAT__GLSL(
            if (path.w > 0.0) {
                draw_soft(at);
                return;
            })
    "#endif\n"
    SAT__GLSL(
            if (far_colour.w > 0.5) {
                colour = vec4(far_colour.rgb, far_cover(at));
                if (colour.a <= 0.0) discard;)
    "#ifdef SWING\n"
    SAT__GLSL(
                float along = seen.w > 0.5 ? at.x : at.y, way = seen.w > 0.5 ? path.x : path.y;
                colour.rgb *= flicker(way < 0.0 ? -along : along);)
    "#endif\n"
    SAT__GLSL(
                return;
            }
)
    "#ifdef GLINT\n"
    SAT__GLSL(discard;)
    "#else\n"
    SAT__GLSL(
            fragment f = trace(at);
            if (f.cover <= 0.0) discard;)
    "#endif\n"
    "#if defined GLINT\n"
    "#elif defined ORDERS && defined FLAT\n"
    SAT__GLSL(
            bool is_flat = bent < 1.0 || bent > 1.0;
            colour = vec4(is_flat ? shade(f.ray, 1.0) : still_colour(f.d, f.p, f.one_minus_b2), f.cover);)
    "#elif defined ORDERS\n"
    SAT__GLSL(colour = vec4(still_colour(f.d, f.p, f.one_minus_b2), f.cover);)
    "#else\n"
    SAT__GLSL(colour = vec4(shade(f.ray, 1.0), f.cover);)
    "#endif\n"
    SAT__GLSL(});

/* ------------------------------------------------------------------------------------------------
   >> rain shader   raindrop__step and raindrop__reenter in floats
   ------------------------------------------------------------------------------------------------ */

#ifndef RAINDROP_NO_RAIN
#define RAINDROP__FUNCTION(head, value) "float " head " { return " RAINDROP__TEXT(value) "; }\n"
static const char raindrop__glsl_step[] =
    RAINDROP__FLOAT("GRAVITY", RAINDROP__GRAVITY)
    RAINDROP__FLOAT("VISCOSITY", RAINDROP__VISCOSITY)
    RAINDROP__FLOAT("BEST_SPEED", RAINDROP__BEST_SPEED)
    RAINDROP__FLOAT("BEST_MM", RAINDROP__BEST_MM)
    RAINDROP__FLOAT("BEST_POWER", RAINDROP__BEST_POWER)
    RAINDROP__FLOAT("FORGETS", RAINDROP__FORGETS)
    RAINDROP__FUNCTION("oblate(float d)", RAINDROP__OBLATE(d))
    "const uint TURN = " RAINDROP__WORD(RAINDROP__TURN) ";\n"
    SAT__GLSL(float decay(float x) { return x < 1e-3 ? x * (1.0 - x * (0.5 - x / 6.0)) : 1.0 - exp(-x); })
    SAT__GLSL(float log_1p(float x) { return abs(x) < 1e-3 ? x * (1.0 - x * (0.5 - x / 3.0)) : log(1.0 + x); })
    SAT__GLSL(
        float terminal(float mm) {
            float stokes = GRAVITY * DENSITY * mm * mm * 1e-6 / (18.0 * VISCOSITY),
                best = BEST_SPEED * decay(pow(mm / BEST_MM, BEST_POWER));
            float slow = min(stokes, best), s = slow / stokes, t = slow / best;
            return slow * inversesqrt(sqrt(s * s * s * s + t * t * t * t));
        })
    /* speed downwards, way downwards, integral of a + b|v| */
    SAT__GLSL(
        vec3 sink(float v, float vt, float a, float b, float h) {
            float u = v - vt, k = a + 2.0 * b * vt, lost = decay(k * h), q = b * u / k * lost;
            return vec3(vt + u * (1.0 - lost) / (1.0 + q),
                vt * h + u * lost / k * (abs(q) > 1e-3 ? log_1p(q) / q : 1.0 - q * (0.5 - q / 3.0)),
                        (a + b * vt) * h + log_1p(q));
        })
    SAT__GLSL(
        vec3 rise(float s, float a, float b, inout float h) {
            float d = a * a - 4.0 * b * GRAVITY, apex, t, end, way;
            if (d > 0.0) {
                float root = sqrt(d), sum = a + root, r1 = 2.0 * GRAVITY / sum, start = (s + r1) / (2.0 * b * s + sum);
                apex = log(start * sum / r1) / root;
                t = min(h, apex);
                start *= exp(-root * t);
                end = h < apex ? (start * sum - r1) / (1.0 - 2.0 * b * start) : 0.0;
                way = (r1 * log((end + r1) / (s + r1)) - sum / (2.0 * b)
                    * log_1p(2.0 * b * (end - s) / (2.0 * b * s + sum))) / root;
            } else {
                float root = sqrt(-d) + 1e-12, phase = atan((2.0 * b * s + a) / root), last = atan(a / root);
                apex = 2.0 * (phase - last) / root;
                t = min(h, apex);
                last = phase - 0.5 * root * t;
                end = h < apex ? (root * tan(last) - a) / (2.0 * b) : 0.0;
                way = log(cos(last) / cos(phase)) / b - a * t / (2.0 * b);
            }
            h -= t;
            return vec3(-max(end, 0.0), -way, a * t + b * way);
        })
    SAT__GLSL(
        void drift(inout vec2 speed, inout vec2 way, float damping, float h) {
            way += speed * h * (damping > 1e-6 ? decay(damping) / damping : 1.0);
            speed *= exp(-damping);
        })
    SAT__GLSL(
        void fall(inout vec3 velocity, out vec3 way, float radius, vec3 wind, float h) {
            float mm = 2e3 * radius, vt = terminal(mm), a = 18.0 * VISCOSITY / (DENSITY * mm * mm * 1e-6),
                b = max(GRAVITY - a * vt, 1e-6) / (vt * vt);
            float v = wind.y - velocity.y, left = h;
            vec2 side = velocity.xz - wind.xz, side_way = wind.xz * h;
            way = wind * h;
            if (v < 0.0) {
                vec3 up_phase = rise(-v, a, b, left);
                drift(side, side_way, up_phase.z, h - left);
                way.y -= up_phase.y;
                v = up_phase.x;
            }
            if (left > 0.0) {
                vec3 down_phase = sink(v, vt, a, b, left);
                drift(side, side_way, down_phase.z, left);
                way.y -= down_phase.y;
                v = down_phase.x;
            }
            way.xz = side_way;
            velocity = vec3(side.x + wind.x, wind.y - v, side.y + wind.z);
        });

static const char raindrop__glsl_advance[] =
    SAT__GLSL(
        layout(location = 0) in vec4 drop;
        layout(location = 1) in vec4 motion;
        uniform vec3 wind, centre, box;
        uniform vec4 sizes; /* lambda, smallest, largest diameter in mm, the fixed one or 0 */
        uniform vec4 step_and; /* dt, settled, own drops, published speed */
        uniform vec2 fastest; /* terminal velocity of the largest, oblate */
        uniform float climb; /* speed of the box upwards */
        uniform uint stream;
        out vec4 next_drop, next_motion;
        float diameter(uint stream, uint i, bool at_plane) {
            float span = sizes.z - sizes.y, all = 1.0 - exp(-sizes.x * span), d = sizes.y;
            for (uint attempt = 0u; attempt < 256u; attempt++) {
                uint bits = hash(stream + 16u + attempt, i);
                d = sizes.y - log_1p(-uniform_of(bits) * all) / sizes.x;
                if (!at_plane || step_and.w > 0.0) break;
                if (uniform_of(mix_bits(bits)) * (fastest.x + climb - wind.y) < terminal(d) + climb - wind.y) break;
            }
            return d;
        })
    SAT__GLSL(
        void main() {
            vec3 velocity = motion.xyz, way = velocity * step_and.x, low = centre - 0.5 * box, at;
            float radius = drop.w, ratio = motion.w;
            if (step_and.y < 0.5 && radius > 0.0 && step_and.x > 0.0) fall(velocity, way, radius, wind, step_and.x);
            at = drop.xyz + way;
            if (step_and.z < 0.5) {
                float below = low.y - at.y;
                bool leaves = way.y < climb * step_and.x && below > 0.0;
                if (leaves && sizes.w <= 0.0) {
                    uint i = uint(gl_VertexID);
                    uint s = stream;
                    float mm, speed, left = velocity.y < climb ? below / (climb - velocity.y) : 0.0,
                        most = (step_and.w > 0.0 ? step_and.w : fastest.x) + climb - wind.y;
                    if (most > 0.0 && left > FORGETS * box.y / most) { /* raindrop__forgets */
                        mm = diameter(s, i, false);
                        below = uniform_of(hash(s + 1u, i)) * box.y;
                    } else {
                        for (int turn = 0; turn < 256; turn++, s += TURN) {
                            mm = diameter(s, i, true);
                            speed = (step_and.w > 0.0 ? step_and.w : terminal(mm)) + climb - wind.y;
                            if (!(left * speed >= box.y) || turn == 255) break;
                            left -= box.y / speed;
                        }
                        below = max(left * speed, 0.0);
                    }
                    radius = 0.5e-3 * mm;
                    ratio = fastest.y > 0.5 ? min(1.0, oblate(mm)) : 1.0;
                    velocity = wind - vec3(0.0, step_and.w > 0.0 ? step_and.w : terminal(mm), 0.0);
                    at.x = centre.x + (uniform_of(hash(s, i)) - 0.5) * box.x;
                    at.z = centre.z + (uniform_of(hash(s + 2u, i)) - 0.5) * box.z;
                }
                if (leaves) at.y = low.y + box.y - mod(below, box.y);
                for (int i = 0; i < 6; i++) { /* from far away each time with the digits that the last one left */
                    vec3 turns = floor((at - low) / box);
                    if (turns == vec3(0.0)) break;
                    at -= turns * box;
                }
                if (!all(lessThanEqual(abs(at - centre), box))) at = centre; /* no number any more */
            }
            next_drop = vec4(at, radius);
            next_motion = vec4(velocity, ratio);
            gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
            gl_PointSize = 1.0;
        });
#endif

/* ------------------------------------------------------------------------------------------------
   >> OpenGL   the object and its calls
   ------------------------------------------------------------------------------------------------ */

enum { RAINDROP__GL_TEXTURE_MIN_LOD_LINEAR = 0x2703 }; /* GL_LINEAR_MIPMAP_LINEAR */

/* The programs. Those of rays: of still spheres, plus RAINDROP__GL_SOFT and RAINDROP__GL_FLAT for what moves or is out
   of focus and for what is flattened. */
enum { RAINDROP__GL_SOFT = 1, RAINDROP__GL_FLAT = 2 };
enum {
    RAINDROP__GL_MAP, RAINDROP__GL_SPRITE, RAINDROP__GL_RAYS, RAINDROP__GL_SWING = RAINDROP__GL_RAYS + 4,
    RAINDROP__GL_GLINT, RAINDROP__GL_VEIL, RAINDROP__GL_BOWS, RAINDROP__GL_PROGRAMS
};

/* What a program is made for: bits in the order of the names. */
enum {
    RAINDROP__IF_MAP = 1, RAINDROP__IF_SPRITES = 2, RAINDROP__IF_MOTION = 4, RAINDROP__IF_OBLATE = 8,
    RAINDROP__IF_ORDERS = 16, RAINDROP__IF_VEIL = 32, RAINDROP__IF_SWING = 64, RAINDROP__IF_LAMPS = 128
};
static const char *const raindrop__gl_needs[8] = {"map", "sprites", "motion", "oblate", "orders", "veil", "oscillation",
                                                  "lamps"};

static const char *const raindrop__vertices[] = {raindrop__glsl_draw_vertex, raindrop__glsl_draw_place, NULL},
                         *const raindrop__vertices_swing[] = {raindrop__glsl_random, raindrop__glsl_draw_vertex,
                                                              raindrop__glsl_draw_place, NULL},
                         *const raindrop__vertices_glint[] = {raindrop__glsl_random, raindrop__glsl_draw_vertex,
                                                              raindrop__glsl_lamp, raindrop__glsl_glint,
                                                              raindrop__glsl_draw_place, NULL};

#define RAINDROP__SKY "environment far_drops reflections refractions"
#define RAINDROP__SPRITES {SAT__GL_PIXEL, raindrop__glsl_shade, raindrop__glsl_draw_sprite}
#define RAINDROP__RAYS                                                                                                 \
    {SAT__GL_PIXEL, raindrop__glsl_shade, raindrop__glsl_orders, raindrop__glsl_flat, raindrop__glsl_draw_trace,       \
     raindrop__glsl_draw_soft, raindrop__glsl_draw_ray}
#define RAINDROP__SWINGING "#define LOOK 3\n#define SOFT 1\n#define FLAT 1\n#define SWING 1\n"

static const sat__gl_program raindrop__programs[RAINDROP__GL_PROGRAMS] = {
    {"raindrop: map", RAINDROP__IF_MAP, RAINDROP__SKY, "#define LOOK 0\n#define FLAT 1\n", raindrop__vertices,
     RAINDROP__SPRITES},
    {"raindrop: sprites", RAINDROP__IF_SPRITES, RAINDROP__SKY, "#define LOOK 1\n#define FLAT 1\n", raindrop__vertices,
     RAINDROP__SPRITES},
    {"raindrop: rays", 0, RAINDROP__SKY, "#define LOOK 3\n", raindrop__vertices, RAINDROP__RAYS},
    {"raindrop: motion", RAINDROP__IF_MOTION, RAINDROP__SKY, "#define LOOK 3\n#define SOFT 1\n", raindrop__vertices,
     RAINDROP__RAYS},
    {"raindrop: oblate", RAINDROP__IF_OBLATE, RAINDROP__SKY, "#define LOOK 3\n#define FLAT 1\n", raindrop__vertices,
     RAINDROP__RAYS},
    {"raindrop: oblate, motion", RAINDROP__IF_MOTION | RAINDROP__IF_OBLATE, RAINDROP__SKY,
     "#define LOOK 3\n#define SOFT 1\n#define FLAT 1\n", raindrop__vertices, RAINDROP__RAYS},
    {"raindrop: oscillation", RAINDROP__IF_SWING, RAINDROP__SKY, RAINDROP__SWINGING, raindrop__vertices_swing,
     RAINDROP__RAYS},
    {"raindrop: glints", RAINDROP__IF_LAMPS, RAINDROP__SKY, RAINDROP__SWINGING "#define GLINT 1\n",
     raindrop__vertices_glint, RAINDROP__RAYS},
    {"raindrop: veil", RAINDROP__IF_VEIL, "far_drops depth", NULL, NULL, {SAT__GL_FROM SAT__GL_PIXEL, raindrop__glsl_veil}},
    {"raindrop: veil with bows", RAINDROP__IF_VEIL, "far_drops depth bow", "#define BOW 1\n", NULL,
     {SAT__GL_FROM SAT__GL_PIXEL, raindrop__glsl_veil}},
};

struct raindrop_gl {
    sat__gl gl;
    raindrop_gl_options options;
    unsigned programs[RAINDROP__GL_PROGRAMS]; /* 0: not among those that create's options ask for */
    unsigned advance;                 /* the program of the rain's step */
    int made;                         /* RAINDROP__IF_... of create */
    unsigned environment, far_drops, bow, map[2];
    float sun_direction[3], sun_irradiance[3];
    unsigned drops[2], arrays[2];     /* ping-pong buffers and their vertex arrays */
    sat__gl_target scratch;           /* of one texel: transform feedback needs a framebuffer of ours */
    int resolution, levels, count, front, settled, own;
    float low[3], high[3];            /* where the caller's drops were in set_rain */
    int flat;                         /* some drops are, or will be when they come back on top */
    float n;
    uint32_t step;
    double time;
    float height;                     /* of the box's centre in the last advance */
    int moved;                        /* the box, since then */
    raindrop_rain_options rain;
    sat_allocator allocator;
};

static const sat__field raindrop__gl_fields[] = {
    SAT__FIELD(raindrop_gl_options, 'i', half_map, 1, 0, 1, ' '),
    SAT__FIELD(raindrop_gl_options, 'i', quads, 1, 0, 1, ' '),
    SAT__FIELD(raindrop_gl_options, 'i', sprites, 1, 0, 1, ' '),
    SAT__FIELD(raindrop_gl_options, 'i', motion, 1, 0, 1, ' '),
    SAT__FIELD(raindrop_gl_options, 'i', oblate, 1, 0, 1, ' '),
    SAT__FIELD(raindrop_gl_options, 'i', orders, 1, 0, 1, ' '),
    SAT__FIELD(raindrop_gl_options, 'i', veil, 1, 0, 1, ' '),
    SAT__FIELD(raindrop_gl_options, 'i', oscillation, 0, 0, 1, ' '),
    SAT__FIELD(raindrop_gl_options, 'i', lamps, 0, 0, 1, ' '),
    SAT__FIELD(raindrop_gl_options, 'a', allocator, 0, 0, 0, ' '),
};

RAINDROP_DEF raindrop_gl_options raindrop_gl_defaults(void)
{
    raindrop_gl_options o;
    sat__fields_default(&o, sizeof o, raindrop__gl_fields, SAT__COUNT(raindrop__gl_fields));
    return o;
}

RAINDROP_DEF const char *raindrop_explain_gl(char *text, size_t size, const raindrop_gl_options *options)
{
    sat__text t = sat__text_begin(text, size);
    if (options) raindrop__fields_are_valid(&t, options, raindrop__gl_fields, SAT__COUNT(raindrop__gl_fields));
    return text;
}

RAINDROP_DEF const char *raindrop_gl_message(const raindrop_gl *gl)
{
    return gl ? gl->gl.message : "there is no object";
}

/* What options ask for. */
static inline int raindrop__gl_given(const raindrop_gl_options *o)
{
    return (o->map ? RAINDROP__IF_MAP : 0) | (o->sprites ? RAINDROP__IF_SPRITES : 0) |
           (o->motion ? RAINDROP__IF_MOTION : 0) | (o->oblate ? RAINDROP__IF_OBLATE : 0) |
           (o->orders ? RAINDROP__IF_ORDERS : 0) | (o->veil ? RAINDROP__IF_VEIL : 0) |
           (o->oscillation ? RAINDROP__IF_SWING : 0) | (o->lamps ? RAINDROP__IF_LAMPS : 0);
}

static inline sat_result raindrop__gl_programs(raindrop_gl *g)
{
    const char *const library[4] = {raindrop_gl_glsl(), raindrop__glsl_constants, raindrop__glsl_environment, NULL};
    sat_result result;
    g->made = raindrop__gl_given(&g->options);
    if (g->options.quads) sat__gl_define(&g->gl, "QUADS", 1);
    if (g->options.orders) sat__gl_define(&g->gl, "ORDERS", 1);
    result = sat__gl_build_table(&g->gl, g->programs, raindrop__programs, RAINDROP__GL_PROGRAMS, g->made, library);
#ifndef RAINDROP_NO_RAIN
    if (result == SAT_OK) {
        static const char *const step[] = {raindrop__glsl_random, raindrop__glsl_step, raindrop__glsl_advance, NULL},
                                *const varyings[] = {"next_drop", "next_motion", NULL};
        sat__gl_shaders shaders;
        memset(&shaders, 0, sizeof shaders);
        shaders.name = "raindrop: advance";
        shaders.library = library;
        shaders.vertex = step;
        shaders.varyings = varyings;
        result = sat__gl_build(&g->gl, &g->advance, &shaders);
    }
#endif
    return result;
}

#ifndef RAINDROP_NO_MAP
/* The map's two textures, level by level: the texels' halves are taken apart in the caller's scratch memory. */
static inline sat_result raindrop__gl_map(raindrop_gl *g, const raindrop_map *map, float *scratch)
{
    sat__gl *gl = &g->gl;
    int half, level;
    size_t i;
    gl->GenTextures(2, g->map);
    gl->ActiveTexture(SAT__GL_TEXTURE0);
    for (half = 0; half < 2; half++) {
        gl->BindTexture(SAT__GL_TEXTURE_2D, g->map[half]);
        for (level = 0; level < map->levels; level++) {
            const float *texels = map->level[level];
            int r = map->base >> (level);
            for (i = 0; i < (size_t)r * (size_t)r; i++)
                memcpy(scratch + 4 * i, texels + 8 * i + 4 * half, 4 * sizeof(float));
            gl->TexImage2D(SAT__GL_TEXTURE_2D, level, g->options.half_map ? SAT__GL_RGBA16F : SAT__GL_RGBA32F, r, r, 0,
                           SAT__GL_RGBA, SAT__GL_FLOAT, scratch);
        }
        gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_MAX_LEVEL, map->levels - 1);
        gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_MIN_FILTER, RAINDROP__GL_TEXTURE_MIN_LOD_LINEAR);
        gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_MAG_FILTER, SAT__GL_LINEAR);
        gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_WRAP_S, SAT__GL_CLAMP_TO_EDGE);
        gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_WRAP_T, SAT__GL_CLAMP_TO_EDGE);
    }
    return sat__gl_check(gl, "OpenGL refused the map's textures");
}
#endif

RAINDROP_DEF sat_result raindrop_gl_create(raindrop_gl **out, sat_gl_get_proc *get_proc,
                                           const raindrop_gl_options *options)
{
    raindrop_gl_options o = options ? *options : raindrop_gl_defaults();
    sat_allocator memory;
    sat__gl_state state;
    sat_result result;
    raindrop_gl *g;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    if (!get_proc || sat__fields_check(&o, raindrop__gl_fields, SAT__COUNT(raindrop__gl_fields)))
        return SAT_ERR_ARGUMENT;
    if (!sat__resolve_allocator(&memory, &o.allocator)) return SAT_ERR_ARGUMENT;
    g = (raindrop_gl *)sat__alloc(&memory, sizeof *g);
    if (!g) return SAT_ERR_MEMORY;
    memset(g, 0, sizeof *g);
    g->allocator = memory;
    g->options = o;
    *out = g;
    result = sat__gl_open(&g->gl, get_proc);
    if (result != SAT_OK) return result;
    sat__gl_begin(&g->gl, &state, 1);
    result = raindrop__gl_programs(g);
    if (result == SAT_OK) result = sat__gl_make_target(&g->gl, &g->scratch, SAT__GL_RGBA8, 1, 1);
#ifndef RAINDROP_NO_MAP
    if (result == SAT_OK && o.map) {
        size_t bytes = (size_t)o.map->base * (size_t)o.map->base * 4 * sizeof(float);
        float *scratch = (float *)sat__alloc(&memory, bytes);
        result = scratch ? raindrop__gl_map(g, o.map, scratch) : SAT_ERR_MEMORY;
        sat__release(&memory, scratch, bytes);
    }
#endif
    sat__gl_end(&g->gl, &state);
    if (result == SAT_ERR_MEMORY) {
        raindrop_gl_destroy(g);
        *out = NULL;
    }
    return result;
}

RAINDROP_DEF void raindrop_gl_destroy(raindrop_gl *g)
{
    sat_allocator memory;
    sat__gl *gl;
    if (!g) return;
    gl = &g->gl;
    memory = g->allocator;
    if (gl->vertex_array) { /* the context was good enough to open */
        sat__gl_delete_programs(gl, g->programs, RAINDROP__GL_PROGRAMS);
        gl->DeleteProgram(g->advance);
        sat__gl_free_target(gl, &g->scratch);
        gl->DeleteTextures(1, &g->environment);
        gl->DeleteTextures(1, &g->far_drops);
        gl->DeleteTextures(1, &g->bow);
        gl->DeleteTextures(2, g->map);
        gl->DeleteBuffers(2, g->drops);
        gl->DeleteVertexArrays(2, g->arrays);
    }
    sat__gl_close(gl);
    sat__release(&memory, g, sizeof *g);
}

RAINDROP_DEF sat_result raindrop_gl_set_options(raindrop_gl *g, const raindrop_gl_options *options)
{
    raindrop_gl_options o = options ? *options : raindrop_gl_defaults();
    sat__text t;
    int i;
    if (!g || !g->gl.vertex_array) return SAT_ERR_ARGUMENT;
    t = sat__text_begin(g->gl.message, sizeof g->gl.message);
    if (!raindrop__fields_are_valid(&t, &o, raindrop__gl_fields, SAT__COUNT(raindrop__gl_fields)))
        return SAT_ERR_ARGUMENT;
    if (o.map != g->options.map || o.half_map != g->options.half_map || o.quads != g->options.quads) {
        raindrop__say(&t, "map, half_map and quads are made at create");
        return SAT_ERR_MISMATCH;
    }
    for (i = 0; i < 8; i++)
        if (raindrop__gl_given(&o) & ~g->made & 1 << i) {
            raindrop__say(&t, raindrop__gl_needs[i]);
            raindrop__say(&t, " is 1 and was 0: it is made at create");
            return SAT_ERR_MISMATCH;
        }
    o.allocator = g->options.allocator;
    g->options = o;
    return SAT_OK;
}

/* ---- environment */

static inline void raindrop__gl_sphere(sat__gl *gl, unsigned texture, const raindrop__sphere *sphere, unsigned internal,
                                       int width, int height)
{
    int level, x = 0, y = 0;
    gl->BindTexture(SAT__GL_TEXTURE_2D, texture);
    gl->TexImage2D(SAT__GL_TEXTURE_2D, 0, (int)internal, width, height, 0, SAT__GL_RGBA, SAT__GL_FLOAT, NULL);
    for (level = 0; level < sphere->levels; level++) {
        int side = (sphere->resolution >> (level)) + 2;
        gl->TexSubImage2D(SAT__GL_TEXTURE_2D, 0, x, y, side, side, SAT__GL_RGBA, SAT__GL_FLOAT,
                          sphere->texels + sphere->offset[level]);
        if (level == 0) x = side;
        else y += side;
    }
    gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_MAX_LEVEL, 0);
    gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_MIN_FILTER, SAT__GL_LINEAR);
    gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_MAG_FILTER, SAT__GL_LINEAR);
    gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_WRAP_S, SAT__GL_CLAMP_TO_EDGE);
    gl->TexParameteri(SAT__GL_TEXTURE_2D, SAT__GL_TEXTURE_WRAP_T, SAT__GL_CLAMP_TO_EDGE);
}

RAINDROP_DEF sat_result raindrop_gl_set_environment(raindrop_gl *g, const raindrop_environment *environment)
{
    sat__gl_state state;
    sat_result result;
    const raindrop__sphere *sphere;
    unsigned internal;
    int width, height;
    if (!g || !environment || !g->gl.vertex_array) return SAT_ERR_ARGUMENT;
    sphere = &environment->near_sphere;
    internal = environment->largest < 65000 ? SAT__GL_RGBA16F : SAT__GL_RGBA32F;
    width = sphere->resolution + 2 + sphere->resolution / 2 + 2;
    height = sphere->resolution + 2 * sphere->levels;
    if (width > g->gl.max_size) return sat__gl_fail(&g->gl, SAT_ERR_SIZE, "the context's largest texture is smaller than the environment", NULL);
    sat__gl_begin(&g->gl, &state, 1);
    g->gl.ActiveTexture(SAT__GL_TEXTURE0);
    if (!g->environment) g->gl.GenTextures(1, &g->environment);
    if (!g->far_drops) g->gl.GenTextures(1, &g->far_drops);
    raindrop__gl_sphere(&g->gl, g->environment, sphere, internal, width, height);
    raindrop__gl_sphere(&g->gl, g->far_drops, &environment->far_sphere, internal,
                        environment->far_sphere.resolution + 2, environment->far_sphere.resolution + 2);
    if (g->bow) g->gl.DeleteTextures(1, &g->bow);
    g->bow = 0;
    result = sat__gl_check(&g->gl, "OpenGL refused the environment");
    if (result == SAT_OK && environment->bow)
        result = sat__gl_texture(&g->gl, &g->bow, SAT__GL_RGB32F, RAINDROP__BOW_SIDE, RAINDROP__BOW_SIDE,
                                 environment->bow);
    sat__gl_end(&g->gl, &state);
    memcpy(g->sun_direction, environment->sun_direction, sizeof g->sun_direction);
    memcpy(g->sun_irradiance, environment->sun_irradiance, sizeof g->sun_irradiance);
    g->resolution = sphere->resolution;
    g->levels = sphere->levels;
    g->n = environment->n;
    return result;
}

/* ---- drops */

/* A box around the drops. */
static inline void raindrop__gl_bound(raindrop_gl *g, const raindrop_rain *rain)
{
    int i, axis;
    for (axis = 0; axis < 3; axis++) {
        float half = 0.5f * rain->options.box_size[axis], centre = rain->options.centre[axis];
        g->low[axis] = rain->own && rain->count ? rain->drops[0].position[axis] : centre - half;
        g->high[axis] = rain->own && rain->count ? g->low[axis] : centre + half;
    }
    for (i = 0; rain->own && i < rain->count; i++)
        for (axis = 0; axis < 3; axis++) {
            float at = rain->drops[i].position[axis];
            if (at < g->low[axis]) g->low[axis] = at;
            if (at > g->high[axis]) g->high[axis] = at;
        }
}

RAINDROP_DEF sat_result raindrop_gl_set_rain(raindrop_gl *g, const raindrop_rain *rain)
{
    sat__gl_state state;
    sat_result result;
    int i;
    if (!g || !rain || !g->gl.vertex_array) return SAT_ERR_ARGUMENT;
    sat__gl_begin(&g->gl, &state, 1);
    if (!g->drops[0]) {
        g->gl.GenBuffers(2, g->drops);
        g->gl.GenVertexArrays(2, g->arrays);
    }
    for (i = 0; i < 2; i++) {
        g->gl.BindVertexArray(g->arrays[i]);
        g->gl.BindBuffer(SAT__GL_ARRAY_BUFFER, g->drops[i]);
        g->gl.BufferData(SAT__GL_ARRAY_BUFFER, (ptrdiff_t)sizeof(raindrop_drop) * sat__max_int(rain->count, 1),
                         rain->count && i == 0 ? rain->drops : NULL, SAT__GL_DYNAMIC_COPY);
        g->gl.VertexAttribPointer(0, 4, SAT__GL_FLOAT, 0, (int)sizeof(raindrop_drop), NULL);
        g->gl.VertexAttribPointer(1, 4, SAT__GL_FLOAT, 0, (int)sizeof(raindrop_drop), (const void *)sizeof(float[4]));
        g->gl.EnableVertexAttribArray(0);
        g->gl.EnableVertexAttribArray(1);
    }
    result = sat__gl_check(&g->gl, "OpenGL refused the buffers of the drops");
    sat__gl_end(&g->gl, &state);
    g->count = rain->count;
    g->front = 0;
    g->settled = rain->settled;
    g->own = rain->own;
    g->flat = rain->options.oblate;
    for (i = 0; i < rain->count && !g->flat; i++)
        g->flat = !(rain->drops[i].axis_ratio >= 1 && rain->drops[i].axis_ratio <= 1);
    g->step = rain->step;
    g->time = rain->time;
    g->height = rain->height;
    g->moved = 1;
    g->rain = rain->options;
    raindrop__gl_bound(g, rain);
    return result;
}

RAINDROP_DEF sat_result raindrop_gl_read_drops(raindrop_gl *g, raindrop_drop *drops, int count)
{
    sat__gl_state state;
    const void *mapped;
    ptrdiff_t bytes = (ptrdiff_t)sizeof *drops * count;
    if (!g || !drops || count < 1 || count > g->count) return SAT_ERR_ARGUMENT;
    if (!g->gl.MapBufferRange || !g->gl.UnmapBuffer)
        return sat__gl_fail(&g->gl, SAT_ERR_GL_FUNCTION, "the context cannot read buffers", "glMapBufferRange");
    sat__gl_begin(&g->gl, &state, 1);
    g->gl.BindBuffer(SAT__GL_ARRAY_BUFFER, g->drops[g->front]);
    mapped = g->gl.MapBufferRange(SAT__GL_ARRAY_BUFFER, 0, bytes, SAT__GL_MAP_READ_BIT);
    if (mapped) memcpy(drops, mapped, (size_t)bytes);
    g->gl.UnmapBuffer(SAT__GL_ARRAY_BUFFER);
    sat__gl_end(&g->gl, &state);
    return mapped ? SAT_OK : sat__gl_fail(&g->gl, SAT_ERR_GL_STATE, "OpenGL refused to read the drops", NULL);
}

#ifndef RAINDROP_NO_RAIN
RAINDROP_DEF sat_result raindrop_gl_set_wind(raindrop_gl *g, const float wind[3])
{
    if (!g || !wind || !raindrop__finite3(wind)) return SAT_ERR_ARGUMENT;
    raindrop__set(g->rain.wind, wind[0], wind[1], wind[2]);
    g->settled = g->rain.speed > 0;
    return SAT_OK;
}

RAINDROP_DEF sat_result raindrop_gl_set_centre(raindrop_gl *g, const float centre[3])
{
    if (!g || !centre || !raindrop__finite3(centre)) return SAT_ERR_ARGUMENT;
    raindrop__set(g->rain.centre, centre[0], centre[1], centre[2]);
    g->moved = 1;
    return SAT_OK;
}

static inline void raindrop__gl_set_advance(raindrop_gl *g, double dt)
{
    sat__gl *gl = &g->gl;
    const unsigned program = g->advance;
    const raindrop_rain_options *o = &g->rain;
    const float sizes[4] = {(float)raindrop__lambda(o->rate_mm_h), (float)o->diameter_min_mm,
                            (float)o->diameter_max_mm, (float)o->diameter_mm},
                step[4] = {(float)(dt < 1e9 ? dt : 1e9), (float)g->settled, (float)g->own, o->speed};
    sat__gl_set_float3(gl, program, "wind", o->wind);
    sat__gl_set_float3(gl, program, "centre", o->centre);
    sat__gl_set_float3(gl, program, "box", o->box_size);
    sat__gl_set_float4(gl, program, "sizes", sizes);
    sat__gl_set_float4(gl, program, "step_and", step);
    sat__gl_set_float2(gl, program, "fastest", (float)raindrop_terminal_velocity(o->diameter_max_mm),
                       (float)(o->oblate != 0));
    sat__gl_set_uint(gl, program, "seed", o->seed);
    sat__gl_set_uint(gl, program, "stream", g->step * 512u);
    sat__gl_set_float(gl, program, "climb", (float)raindrop__rise_of(&g->height, o, dt));
}

RAINDROP_DEF sat_result raindrop_gl_advance(raindrop_gl *g, double dt)
{
    sat__gl_state state;
    sat__gl *gl;
    if (!g || !g->drops[0] || !sat__is_finite_double(dt) || dt < 0) return SAT_ERR_ARGUMENT;
    if (!g->count || (!(dt > 0) && !g->moved)) return SAT_OK;
    gl = &g->gl;
    g->moved = 0;
    if (dt > 0) g->step++;
    g->time = fmod(g->time + fmod(dt, RAINDROP__PERIOD), RAINDROP__PERIOD);
    sat__gl_begin(gl, &state, 1);
    gl->BindFramebuffer(SAT__GL_FRAMEBUFFER, g->scratch.framebuffer);
    gl->UseProgram(g->advance);
    raindrop__gl_set_advance(g, dt);
    gl->BindBuffer(SAT__GL_ARRAY_BUFFER, 0);
    gl->BindVertexArray(g->arrays[g->front]);
    if (g->options.quads) {
        gl->VertexAttribDivisor(0, 0);
        gl->VertexAttribDivisor(1, 0);
    }
    gl->BindBufferBase(SAT__GL_TRANSFORM_FEEDBACK_BUFFER, 0, g->drops[1 - g->front]);
    gl->Enable(SAT__GL_RASTERIZER_DISCARD);
    gl->BeginTransformFeedback(SAT__GL_POINTS);
    gl->DrawArrays(SAT__GL_POINTS, 0, g->count);
    gl->EndTransformFeedback();
    gl->Disable(SAT__GL_RASTERIZER_DISCARD);
    gl->BindBufferBase(SAT__GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
    sat__gl_end(gl, &state);
    g->front = 1 - g->front;
    return SAT_OK;
}
#endif

/* ------------------------------------------------------------------------------------------------
   >> OpenGL picture   drops, glints and veil
   ------------------------------------------------------------------------------------------------ */

static inline void raindrop__gl_set_view(sat__gl *gl, unsigned program, const raindrop__frame *frame, float last)
{
    const float view[4] = {frame->half_width, frame->half_height, frame->focal, last};
    sat__gl_set_float3(gl, program, "right", frame->camera.right);
    sat__gl_set_float3(gl, program, "up", frame->camera.up);
    sat__gl_set_float3(gl, program, "back", frame->camera.back);
    sat__gl_set_float4(gl, program, "view", view);
}

static inline void raindrop__gl_set_draw(raindrop_gl *g, unsigned program, const raindrop__frame *frame,
                                         const float depth[2])
{
    sat__gl *gl = &g->gl;
    const raindrop_camera *camera = &frame->camera;
    const float limits[4] = {frame->options.look == RAINDROP_LOOK_AUTO ? frame->options.far_radius : 0,
                             frame->options.coverage_threshold, depth[0], depth[1]},
                shutter[4] = {camera->velocity[0], camera->velocity[1], camera->velocity[2], camera->exposure};
    sat__gl_set_float3(gl, program, "eye", camera->position);
    raindrop__gl_set_view(gl, program, frame, camera->depth_near);
    sat__gl_set_float4(gl, program, "limits", limits);
    sat__gl_set_float4(gl, program, "shutter", shutter);
    sat__gl_set_float2(gl, program, "lens", camera->aperture, camera->focus_distance);
    sat__gl_set_float2(gl, program, "orders", (float)frame->options.orders, frame->options.orders_radius);
    sat__gl_set_float2(gl, program, "optics", g->n, (float)(frame->options.exit_fresnel != 0));
    sat__gl_set_float2(gl, program, "swings", frame->options.oscillation, (float)g->time);
    sat__gl_set_uint(gl, program, "seed", g->rain.seed);
    sat__gl_set_float2(gl, program, "environment_size", (float)g->resolution, (float)g->levels);
    SAT__GL_INPUTS(gl, g->environment, g->far_drops, g->map[0], g->map[1]);
}

/* What a picture needs, and the object was not made for. */
static inline int raindrop__gl_has(const raindrop_gl *g, const raindrop__frame *frame, sat__text *t)
{
    const raindrop_gl_options *o = &g->options;
    if (raindrop__is_sprite(frame))
        return o->sprites || frame->options.look == RAINDROP_LOOK_MAP
                   ? 1
                   : raindrop__say(t, "look is RAINDROP_LOOK_SPRITE; raindrop_gl_options.sprites is 0");
    if (!o->motion && (frame->camera.exposure > 0 || frame->camera.aperture > 0))
        return raindrop__say(t, "exposure or aperture is above 0; raindrop_gl_options.motion is 0");
    if (!o->oblate && g->flat) return raindrop__say(t, "drops are flattened; raindrop_gl_options.oblate is 0");
    if (!o->orders && frame->options.orders > 0)
        return raindrop__say(t, "orders is above 0; raindrop_gl_options.orders is 0");
    if (!o->oscillation && frame->options.oscillation > 0)
        return raindrop__say(t, "oscillation is above 0; raindrop_gl_options.oscillation is 0");
    if (!o->lamps && frame->options.lamp_count > 0)
        return raindrop__say(t, "lamp_count is above 0; raindrop_gl_options.lamps is 0");
    return 1;
}

/* The message says what is wrong, in the words of raindrop_explain_render. */
static inline int raindrop__gl_frame_is_valid(raindrop_gl *g, const raindrop__frame *frame)
{
    sat__text t = sat__text_begin(g->gl.message, sizeof g->gl.message);
    if (!raindrop__size_is_valid(&t, frame->width, frame->height)) return 0;
    if (!raindrop__camera_is_valid(&t, &frame->camera) || !raindrop__render_is_valid(&t, &frame->options)) return 0;
    if (frame->options.look == RAINDROP_LOOK_MAP && !g->options.map)
        return raindrop__say(&t, "map is NULL, which RAINDROP_LOOK_MAP needs");
    if (!raindrop__gl_has(g, frame, &t)) return 0;
    if (!g->environment) return raindrop__say(&t, "there was no raindrop_gl_set_environment");
    return g->drops[0] ? 1 : raindrop__say(&t, "there was no raindrop_gl_set_rain");
}

/* The program of a picture. */
static inline int raindrop__gl_program_of(const raindrop_gl *g, const raindrop__frame *frame)
{
    int kind = g->flat ? RAINDROP__GL_FLAT : 0;
    if (raindrop__is_sprite(frame)) return (int)frame->options.look;
    if (frame->options.oscillation > 0) return RAINDROP__GL_SWING;
    if (frame->camera.exposure > 0 || frame->camera.aperture > 0) kind |= RAINDROP__GL_SOFT;
    return RAINDROP__GL_RAYS + kind;
}

/* Depth as OpenGL keeps it is v[0] + v[1] / distance; 0 for matrices that are no perspective. */
static inline int raindrop__gl_depth(float v[2], const raindrop_camera *camera, const float *projection)
{
    float n = camera->depth_near, f = camera->depth_far, w;
    v[0] = v[1] = 0;
    if (projection) {
        w = fabsf(projection[11]);
        v[0] = projection[11] < 0 ? -projection[10] / w : projection[10] / w;
        v[1] = projection[14] / w;
        return w > 0 && sat__is_finite(v[0]) && sat__is_finite(v[1]) && !(fabsf(projection[15]) > 0);
    }
    if (f > 0) {
        v[0] = (f + n) / (f - n);
        v[1] = -2 * f * n / (f - n);
    }
    return 1;
}

/* Whether the target takes the picture; how the projection keeps depth. */
static inline sat_result raindrop__gl_aim(float depth[2], raindrop_gl *g, const sat_gl_target *to,
                                          const raindrop__frame *frame, const float *projection)
{
    if (!sat__gl_target_is_valid(to)) return sat__gl_fail(&g->gl, SAT_ERR_ARGUMENT, "the target is none", NULL);
    if (to && to->width && (to->width != frame->width || to->height != frame->height))
        return sat__gl_fail(&g->gl, SAT_ERR_MISMATCH, "the target has another width or height than the call", NULL);
    if (!raindrop__gl_depth(depth, &frame->camera, projection))
        return sat__gl_fail(&g->gl, SAT_ERR_ARGUMENT, "projection is no perspective", NULL);
    return SAT_OK;
}

/* Everything that a blended draw needs beside the program's uniforms. */
static inline void raindrop__gl_blend(raindrop_gl *g, const float depth[2])
{
    sat__gl *gl = &g->gl;
    gl->Enable(SAT__GL_BLEND);
    gl->BlendEquationSeparate(0x8006, 0x8006); /* GL_FUNC_ADD */
    gl->BlendFuncSeparate(SAT__GL_SRC_ALPHA, SAT__GL_ONE_MINUS_SRC_ALPHA, SAT__GL_ZERO, SAT__GL_ONE);
    if (depth[0] < 0 || depth[0] > 0 || depth[1] < 0 || depth[1] > 0) {
        gl->Enable(SAT__GL_DEPTH_TEST);
        gl->DepthFunc(depth[1] > 0 ? 0x0206u : (unsigned)SAT__GL_LEQUAL); /* GL_GEQUAL: reversed */
    }
    gl->DepthMask(0);
    if (!gl->is_es) gl->Enable(SAT__GL_PROGRAM_POINT_SIZE);
}

/* The depth of the farthest corner of the box around the drops, along the viewing axis. */
static inline float raindrop__gl_deepest(const raindrop_gl *g, const raindrop_camera *camera)
{
    float depth = 0;
    int axis;
    for (axis = 0; axis < 3; axis++) {
        float low = (g->low[axis] - camera->position[axis]) * -camera->back[axis],
              high = (g->high[axis] - camera->position[axis]) * -camera->back[axis];
        depth += low > high ? low : high;
    }
    return depth > 0 ? depth : 0;
}

static inline void raindrop__gl_draw_drops(raindrop_gl *g)
{
    if (g->options.quads) g->gl.DrawArraysInstanced(SAT__GL_TRIANGLE_STRIP, 0, 4, g->count);
    else g->gl.DrawArrays(SAT__GL_POINTS, 0, g->count);
}

static inline void raindrop__gl_draw_slices(raindrop_gl *g, unsigned program, const raindrop__frame *frame)
{
    sat__gl *gl = &g->gl;
    int i, slices = frame->options.slices;
    float deep = raindrop__gl_deepest(g, &frame->camera) / ((float)slices * (float)slices);
    gl->BindVertexArray(g->arrays[g->front]);
    if (g->options.quads) {
        gl->VertexAttribDivisor(0, 1);
        gl->VertexAttribDivisor(1, 1);
    }
    for (i = slices - 1; i >= 0; i--) {
        sat__gl_set_float2(gl, program, "slice", deep * (float)(i * i),
                          i == slices - 1 ? 3e38f : deep * (float)((i + 1) * (i + 1)));
        raindrop__gl_draw_drops(g);
    }
}

/* The lamps' glints, added, when the drops are drawn. */
static inline void raindrop__gl_draw_glints(raindrop_gl *g, const raindrop__frame *frame)
{
    sat__gl *gl = &g->gl;
    const unsigned program = g->programs[RAINDROP__GL_GLINT];
    int i, path;
    sat__gl_set_float2(gl, program, "slice", 0, 3e38f);
    gl->BlendFuncSeparate(SAT__GL_SRC_ALPHA, SAT__GL_ONE, SAT__GL_ZERO, SAT__GL_ONE);
    for (i = 0; i < frame->options.lamp_count; i++) {
        const raindrop_lamp *lamp = &frame->options.lamps[i];
        const float place[4] = {lamp->position[0], lamp->position[1], lamp->position[2], lamp->radius};
        float cone[4] = {lamp->inner, lamp->outer, 0, raindrop__water_of(g->n, frame->options.orders).bow};
        sat__gl_set_float4(gl, program, "lamp", place);
        sat__gl_set_float3(gl, program, "intensity", lamp->intensity);
        sat__gl_set_float3(gl, program, "axis", lamp->direction);
        for (path = 0; path < (frame->options.orders ? RAINDROP__GLINTS : 2); path++) {
            cone[2] = (float)path;
            sat__gl_set_float4(gl, program, "cone", cone);
            raindrop__gl_draw_drops(g);
        }
    }
}

RAINDROP_DEF sat_result raindrop_gl_render(raindrop_gl *g, const sat_gl_target *to, int width, int height,
                                           const raindrop_camera *camera, const float projection[16],
                                           const raindrop_render_options *options)
{
    raindrop__frame frame;
    sat__gl_state state;
    sat__gl *gl;
    sat_result result;
    unsigned program;
    float depth[2];
    frame = raindrop__frame_of(NULL, 0, width, height, camera);
    frame.options = options ? *options : raindrop_render_defaults();
    if (!g || !g->gl.vertex_array) return SAT_ERR_ARGUMENT;
    if (!raindrop__gl_frame_is_valid(g, &frame)) return SAT_ERR_ARGUMENT;
    result = raindrop__gl_aim(depth, g, to, &frame, projection);
    if (result != SAT_OK || !g->count) return result;
    gl = &g->gl;
    program = g->programs[raindrop__gl_program_of(g, &frame)];
    raindrop__set_frame(&frame);
    sat__gl_begin(gl, &state, 4);
    result = sat__gl_pass_to(gl, program, to, (unsigned)state.draw_framebuffer, width, height);
    if (result != SAT_OK) {
        sat__gl_end(gl, &state);
        return result;
    }
    raindrop__gl_set_draw(g, program, &frame, depth);
    raindrop__gl_blend(g, depth);
    raindrop__gl_draw_slices(g, program, &frame);
    if (frame.options.lamp_count > 0) {
        program = g->programs[RAINDROP__GL_GLINT];
        result = sat__gl_pass_to(gl, program, to, (unsigned)state.draw_framebuffer, width, height);
        raindrop__gl_set_draw(g, program, &frame, depth);
        if (result == SAT_OK) raindrop__gl_draw_glints(g, &frame);
    }
    sat__gl_release_target(gl, to);
    sat__gl_end(gl, &state);
    return result;
}

/* ---- the veil */

/* planes: raindrop__gl_depth. */
static inline void raindrop__gl_set_veil(raindrop_gl *g, unsigned program, const raindrop__frame *frame, unsigned depth,
                                         const float planes[2], const raindrop_veil_options *o)
{
    sat__gl *gl = &g->gl;
    const float rain[4] = {o->extinction, o->from, o->reach, 0},
                maps[4] = {planes[0], planes[1], o->clip_zero_to_one ? 1.0f : 2, o->clip_zero_to_one ? 0 : -1.0f};
    raindrop__gl_set_view(gl, program, frame, depth ? 1.0f : 0);
    sat__gl_set_float3(gl, program, "sun", g->sun_direction);
    sat__gl_set_float3(gl, program, "irradiance", g->sun_irradiance);
    sat__gl_set_float4(gl, program, "rain", rain);
    sat__gl_set_float4(gl, program, "planes", maps);
    SAT__GL_INPUTS(gl, g->far_drops, depth ? depth : g->far_drops, g->bow);
}

static inline int raindrop__gl_veil_is_valid(raindrop_gl *g, const raindrop__frame *frame,
                                             const raindrop_veil_options *o)
{
    sat__text t = sat__text_begin(g->gl.message, sizeof g->gl.message);
    if (!raindrop__size_is_valid(&t, frame->width, frame->height) || !raindrop__camera_is_valid(&t, &frame->camera) ||
        !raindrop__fields_are_valid(&t, o, raindrop__veil_fields, SAT__COUNT(raindrop__veil_fields)))
        return 0;
    if (!g->options.veil) return raindrop__say(&t, "raindrop_gl_options.veil is 0");
    return g->environment ? 1 : raindrop__say(&t, "there was no raindrop_gl_set_environment");
}

RAINDROP_DEF sat_result raindrop_gl_veil(raindrop_gl *g, const sat_gl_target *to, int width, int height, unsigned depth,
                                         const raindrop_camera *camera, const float projection[16],
                                         const raindrop_veil_options *options)
{
    const raindrop_veil_options o = options ? *options : raindrop_veil_defaults();
    const float none[2] = {0, 0};
    float planes[2];
    raindrop__frame frame;
    sat__gl_state state;
    sat_result result;
    unsigned program;
    if (!g || !g->gl.vertex_array) return SAT_ERR_ARGUMENT;
    frame = raindrop__frame_of(NULL, 0, width, height, camera);
    if (!raindrop__gl_veil_is_valid(g, &frame, &o)) return SAT_ERR_ARGUMENT;
    result = raindrop__gl_aim(planes, g, to, &frame, projection);
    if (result != SAT_OK) return result;
    if (depth && !(fabsf(planes[1]) > 0))
        return sat__gl_fail(&g->gl, SAT_ERR_ARGUMENT, "depth needs a projection or a depth_far", NULL);
    program = g->programs[g->bow ? RAINDROP__GL_BOWS : RAINDROP__GL_VEIL];
    raindrop__set_frame(&frame);
    sat__gl_begin(&g->gl, &state, 3);
    result = sat__gl_pass_to(&g->gl, program, to, (unsigned)state.draw_framebuffer, width, height);
    if (result == SAT_OK) {
        sat__gl_set_from(&g->gl, program, to);
        raindrop__gl_set_veil(g, program, &frame, depth, planes, &o);
        raindrop__gl_blend(g, none);
        sat__gl_draw(&g->gl);
        sat__gl_release_target(&g->gl, to);
    }
    sat__gl_end(&g->gl, &state);
    return result;
}

#ifdef __cplusplus
}
#endif
SAT__IEEE_END
#endif /* RAINDROP_IMPLEMENTATION && RAINDROP_GL */

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
