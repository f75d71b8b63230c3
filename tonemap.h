/* tonemap.h - 0.1.0 - tone mapping of high dynamic range pictures - SPDX-License-Identifier: MIT-0 OR Unlicense

   The photographic curve with local contrast from an edge-keeping filter or from exact box sums; curves that games use;
   metering, adaptation, colours beyond the display, mesopic vision.

   USE

       #define SAT_IMPLEMENTATION      // in one C file
       #define TONEMAP_IMPLEMENTATION
       #include "tonemap.h"

       tonemap *map;
       tonemap_create(&map, width, height, NULL);
       sat_image hdr = sat_image_f32(pixels, width, height, 3);
       tonemap_apply_u8(map, srgb, width * 3, &hdr, 0, NULL);      // for every frame
       tonemap_destroy(map);

   WHAT IT DOES

     guided         the default: the photographic curve (Reinhard 2002 as in Slomp 2012, appendix A: eq A.1 to A.4),
                    with La from a self-guided filter of log luminance (He 2013), which leaks over no edge
     photographic   La as in the thesis: the largest even neighbourhood around the pixel (eq A.5 to A.9), or the pixel
                    itself (eq A.3). Burn-out above a white; key and white estimated (Reinhard 2003)
     curves         Khronos PBR Neutral, AgX, ACES (Hill's fit), Hable: each with its source beside it
     mesopic        reds fade in dim light, by the whole picture or by each neighbourhood (eq A.10 to A.14)
     Ashikhmin      threshold against intensity, local and global (Michael 2010, section 4.3)
     colours        those beyond the display come back along their hue, dimmed and faded (gamut); primaries of Rec. 709,
                    P3 and Rec. 2020 on both sides; white balance
     displays       sRGB bytes, dithered if wanted; floats up to a peak above white paper, linear, PQ or HLG
     metering       as a camera: between percentiles, in steps, within limits, for the highlights, through a mask; or eq
                    A.1's log-average; or a fixed exposure
     adaptation     the metered light, key, white and range approach those of the picture with a time constant in
                    seconds, one for brighter and one for darker; what wavers by less than 1/64 octave moves nothing
     leaving out    searches away from edges (selective; Michael 2010, section 4.4)

   WHAT IT DOES NOT

     read files, resize, grade colours, model glare or the loss of acuity at night, keep a history of pixels (so nothing
     smears when the camera turns), or store anything but its options and seven numbers between frames.

   OPTIONS (define before the implementation)

     TONEMAP_STATIC         every function private to the file
     TONEMAP_NO_MESOPIC, TONEMAP_NO_ASHIKHMIN, TONEMAP_NO_SELECTIVE, TONEMAP_NO_SOFT, TONEMAP_NO_WHITE
                            leave that code out; asking for it is then SAT_ERR_ARGUMENT
     TONEMAP_GL             the OpenGL part
     and those of sat.h: SAT_NO_SIMD, SAT_NO_STDLIB, SAT_ASSERT

   MEMORY, THREADS, ERRORS

     One allocation, none in a frame: 4 bytes a pixel, rows 16 to 31 pixels longer; 80 such rows a worker; 5 bytes a
     row; 60 KB of tables, and 32 KB for each worker.
     threads shares out bands of 64 rows. Every call checks its arguments and answers with a sat_result; on an error the
     output is untouched. An object serves one call at a time.

   ROWS, LIGHT, FAILURES

     Pictures are linear light (decode sRGB first), results sRGB codes or, by tonemap_apply_f32, linear. Strides are
     bytes: 0 packed, negative the bottom row first, the pointer then at the top one. A create that fails sets *out to
     NULL and holds nothing (OpenGL: an object for its message, to be destroyed). On OpenGL pixels come in and go out by
     textures: glTexSubImage2D into hdr; ldr or tonemap_gl_texture attached to a framebuffer, then glReadPixels. There
     the order of rows does not matter.

   NUMERICS

     Sums are integers, so box means are exact. The search rounds the scaled luminance to 2^-12, the guided filter its
     logarithm to 1/64 octave; both cut it at 256, where the display has 0.4 % left, and beyond the cut La is taken to
     grow with the pixel. The logarithms of the log-average are
     added as integers too. So the result has the same bits for any number of workers, for vector and plain code
     (without fused multiply-add), and for pictures in units that differ by a power of two from 2^-20 to 2^20.
     Against OpenGL at most 1 code differs, in 2 % of codes (on a software renderer). 8-bit codes are at most one from
     the rounded value, and that in 2 % of cases, within 0.1 of a step.
     Luminances below 2^-100 are black, those above 2^100 count as 2^100. NaN and negative luminances count as 0,
     infinity, if only in one component, is white; none of them enters the log-average, and none changes a pixel outside
     the 41 x 41 around it. A firefly, of 1e4 or of 1e30, moves the meter by one pixel's part: outside by up to 3 codes
     in 120 x 90 pixels, by 1 with a fixed exposure (soft = 0: local scales may jump). A pixel of NaN or
     negative luminance (ringing beside lamps) shows the mean of what the usable ones around it show, up to 3 pixels
     away. A negative component of a positive luminance is kept until the display cuts it. Output lies in [0, 1], linear
     floats in [0, peak], for any input bits. PQ is within 3e-4. Black pictures stay black and leave the
     adaptation alone; constant ones get the key (to half of the meter's step of 1/64 octave).

     Deviations from the sources: eq A.1 averages positive luminances only and has no delta, which would depend on the
     unit; s in eq A.5 is the length in pixels; eq A.7 takes the centre of the first step that fails; the Lab of eq
     A.12 has the pixel's own luminance as white, so that the filter does not depend on exposure; Ashikhmin's range is
     between the 0.05 % and 99.95 % quantiles, and his capacity is made continuous; the gradient of selective mapping
     is that of the scaled luminance; what adapts over time is the whole picture's light, not each pixel's La.

   COST (tests/bench/bench_tonemap.cpp; one core, SSE2, 2 megapixels of float RGB to 8 bits)

     What version 0.1 did by default (TONEMAP_PHOTOGRAPHIC_LOCAL, soft = 0, gamut = -1, white = INFINITY and metering =
     TONEMAP_METERING_LOG_AVERAGE; 7.5 ns a pixel on an idle core) is 1. The default is 1.14: the guided filter itself
     0.94, metering by percentiles 0.04, estimated white 0.04, colours beyond the display 0.15 where 20 % of the pixels
     are such. Times the default: global 0.6, local with soft scales 1.3, + local mesopic 1.2, + uniform 1.1, Ashikhmin
     1.6, Neutral 1.3, Hable 1.3, ACES 1.8, AgX 2.4, dithering 1.25, other primaries 1.2; SAT_NO_SIMD 2.4 (gcc -O2);
     OpenCV's global Drago operator 3.0, pfstmo_reinhard02 -s 19.
     Halos beside steps of 10, 100 and 1000:1: guided 3, 4 and 4 codes, the search 12, 27 and 18. SSIM of the search
     against the operator with exact Gaussians 0.987 to 0.998. Under 0.5 % of noise single pixels move by less than 1
     code, with soft = 0 by up to 56. selective pays where few pixels are near edges, 0.9 to 1.1 of the local time, and
     for Ashikhmin, 0.6, at an SSIM of only 0.9. */

/* What is where.

   CONTENTS (search for the mark)

   >> interface            types, options, statistics, calls
   >> interface of OpenGL  the same on textures; GLSL to call
   >> options              their table, what is left out, sentences; the object and its memory
   >> numbers              log2 in fours, exp2 plain and in fours
   >> measuring            first pass: luminance, histogram, what is no measurement
   >> metering             key, white, range; adaptation; matrices of colour; the numbers of a picture
   >> search               sums in a ring of rows; La by the photographic search and by Ashikhmin's; selective mapping
   >> guided filter        La by it; La of a row by any operator
   >> mesopic vision       reds in dim light
   >> display values       gains, gamut, primaries; curves; PQ, HLG, sRGB, dithering; unusable pixels
   >> calls                create, apply, set_options
   >> shaders of OpenGL
   >> passes of OpenGL     programs, textures, one picture
*/

#if defined(LIGHTSCAN_IMPLEMENTATION) && !defined(TONEMAP_IMPLEMENTATION)
#define TONEMAP_IMPLEMENTATION
#endif

#ifndef TONEMAP_H
#define TONEMAP_H

#define TONEMAP_VERSION_MAJOR 0
#define TONEMAP_VERSION_MINOR 1
#define TONEMAP_VERSION_PATCH 0
#define TONEMAP_VERSION (TONEMAP_VERSION_MAJOR * 10000 + TONEMAP_VERSION_MINOR * 100 + TONEMAP_VERSION_PATCH)

#if defined(TONEMAP_IMPLEMENT) || defined(TONEMAP_IMPL)
#error "tonemap.h: the macro is called TONEMAP_IMPLEMENTATION"
#endif

#if defined(TONEMAP_GL) && !defined(SAT_GL)
#define SAT_GL
#endif
#include "sat.h"
#if SAT_VERSION < 100
#error "tonemap.h needs sat.h 0.1.0 or newer"
#endif

#ifndef TONEMAP_DEF
#ifdef TONEMAP_STATIC
#define TONEMAP_DEF static inline
#else
#define TONEMAP_DEF extern
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------------------------------------
   >> interface: types
   ------------------------------------------------------------------------------------------------ */

typedef enum tonemap_operator {
    TONEMAP_PHOTOGRAPHIC_LOCAL,  /* dodging and burning, Slomp 2012, eq A.4 to A.9 */
    TONEMAP_PHOTOGRAPHIC_GLOBAL, /* one curve for all pixels, eq A.3 */
    TONEMAP_ASHIKHMIN,           /* threshold against intensity, local; Michael 2010, section 4.3 */
    TONEMAP_ASHIKHMIN_GLOBAL,    /* its curve alone */
    TONEMAP_LINEAR,              /* exposure only: eq A.2, clipped */
    TONEMAP_GUIDED,              /* the photographic curve with La from a self-guided filter of log2 luminance: no rings
                                    round lamps, no seams, nothing flickers */
    /* curves of one pixel that pictures are graded for; the metered luminance becomes the key before them */
    TONEMAP_NEUTRAL,             /* Khronos PBR Neutral: colours up to 0.8 stay as they are */
    TONEMAP_AGX,                 /* Sobotka's AgX as fitted by Wrensch 2023: the brightest fade to white */
    TONEMAP_ACES,                /* Hill's fit of the ACES reference transforms, exposed by 1 / 0.6 as is usual */
    TONEMAP_HABLE                /* Hable 2010, filmic */
} tonemap_operator;

/* Reds fade towards orange in dim light (Slomp 2012, section A.5). */
typedef enum tonemap_mesopic {
    TONEMAP_MESOPIC_OFF,
    TONEMAP_MESOPIC_UNIFORM, /* one light level, the metered luminance: a lamp in the picture does not switch it off */
    TONEMAP_MESOPIC_LOCAL    /* the level around each pixel: a red lamp in the night stays red */
} tonemap_mesopic;

/* Which luminance becomes the key. */
typedef enum tonemap_metering {
    TONEMAP_METERING_PERCENTILES, /* between meter_low and meter_high; what is 18 to 24 octaves below the bright end
                                     counts less and less; in steps of 1/64 octave: a bad texel, a lamp or residue moves
                                     nothing */
    TONEMAP_METERING_LOG_AVERAGE  /* of every positive luminance, eq A.1 */
} tonemap_metering;

/* Of red, green and blue, with a white of D65. */
typedef enum tonemap_primaries {
    TONEMAP_PRIMARIES_709,
    TONEMAP_PRIMARIES_P3,
    TONEMAP_PRIMARIES_2020
} tonemap_primaries;

/* Of floats, and of what OpenGL draws; bytes are sRGB. */
typedef enum tonemap_encoding {
    TONEMAP_ENCODING_AUTO,   /* floats are linear, OpenGL draws sRGB */
    TONEMAP_ENCODING_LINEAR, /* 1 is white paper; up to peak */
    TONEMAP_ENCODING_PQ,     /* SMPTE ST 2084: 0 to 1 */
    TONEMAP_ENCODING_HLG     /* ITU-R BT.2100, for a display of that peak: 0 to 1 */
} tonemap_encoding;

typedef struct tonemap_options {
    tonemap_operator operation; /* TONEMAP_GUIDED */
    double key;                 /* 0.18; -1e6..10; the display value of the metered luminance before compression;
                                   <= 0: estimated from the log-average's place between dark and bright (Reinhard
                                   2003) */
    double white;               /* 0; 0..1e12 or infinity (no burn-out); the smallest luminance shown as white, in units
                                   in which the metered luminance is the key; 0: estimated, at least 1 (linear:
                                   none; and infinity is the default with TONEMAP_NO_WHITE) */
    double phi;                 /* 8; -16..16; sharpening of the scale test, eq A.5 */
    double epsilon;             /* 0.05; 1e-9..1e9; threshold of the scale test, eq A.7 */
    double edge;                /* 0.45; 0.01..10; guided: light that varies by so many octaves around a pixel (standard
                                   deviation) is half an edge; less is texture, whose contrast stays */
    int scales;                 /* 8; 1..8; how many of the box lengths 1 3 5 7 11 17 27 41 */
    double soft;                /* 1; 0..1; half width of the band around epsilon in which scales are mixed, as a share
                                   of epsilon; 0: the paper's hard choice, which flickers (and the default with
                                   TONEMAP_NO_SOFT) */
    double gamut;               /* 0.5; 0..1 or negative; how colours beyond the display come back: 0 keeps their
                                   luminance and fades them, 1 dims them and keeps their saturation; negative: each
                                   channel is clipped */
    tonemap_metering metering;  /* TONEMAP_METERING_PERCENTILES */
    double meter_low;           /* 0.02; 0..0.5; share of the darkest that percentile metering leaves out */
    double meter_high;          /* 0.98; 0.5..1; where it stops */
    tonemap_mesopic mesopic;    /* TONEMAP_MESOPIC_OFF */
    double cd_per_unit;         /* 0; 0..1e30; cd/m2 of a luminance of 1; 0: unknown, the metered luminance counts as 10
                                   for Ashikhmin's curve, and as 1 for mesopic vision, which is asked for in dim
                                   light */
    double lux_per_cd;          /* 1; 0..1e6; illuminance that belongs to a luminance of 1 cd/m2, eq A.10 */
    double selective;           /* 0; 0..1e30; 0: off; else only pixels whose Sobel gradient of the scaled luminance
                                   exceeds this are searched (Michael 2010, section 4.4) */
    double adapt_seconds;       /* 0; 0..1e30; time constant of the eye's adaptation; 0: each picture for itself */
    double darker_seconds;      /* 0; 0..1e30; the same while it grows darker; 0: as adapt_seconds */
    double adapt_low;           /* 0; 0..1e30; the metered luminance counts as at least this: nights stay dark */
    double adapt_high;          /* INFINITY; 1e-30..1e30 or infinity; and as at most this, or as adapt_low if that is
                                   more */
    double exposure;            /* 0; 0..1e30; 0: metered; else the key is at the luminance key / exposure, at once:
                                   what a camera model gives, as 1 / (1.2 exp2(EV100)) for luminances in cd/m2 */
    tonemap_primaries primaries; /* TONEMAP_PRIMARIES_709; of the picture */
    tonemap_primaries display;  /* TONEMAP_PRIMARIES_709; of the output; colours beyond it fade */
    double balance_red;         /* 1; 0..1000; white balance: factors of the picture's channels */
    double balance_green;       /* 1; 0..1000; */
    double balance_blue;        /* 1; 0..1000; */
    double peak; /* 1; 1..100; the brightest that the display shows, in units of white paper: light beyond
                    paper is compressed less (photographic and guided; the other curves end at paper);
                    bytes have 255 there */
    tonemap_encoding encoding;  /* TONEMAP_ENCODING_AUTO */
    double white_cd;            /* 203; 1..10000; cd/m2 of white paper, for PQ and HLG (ITU-R BT.2408) */
    int dither;                 /* 0; 0..1; 1: bytes are rounded up or down in a pattern of 8 x 8 pixels, so that slow
                                   gradients show no bands */
    const float
        *meter_weights; /* NULL, or a factor from 0 to 1 for each of width * height pixels, in steps of 1/15: how
                           much it counts in metering, key and white; read in every call (OpenGL: in create) */
    sat_allocator allocator;    /* malloc; used by create and destroy only */
    sat_threads threads;        /* serial; same bits for any worker count */
} tonemap_options;
/* NULL options mean these, here and in every call. */
TONEMAP_DEF tonemap_options tonemap_defaults(void);

/* What the last picture was like and what was done to it. */
typedef struct tonemap_stats {
    double log_average, mean;      /* of the positive luminances; of all; measured */
    double low, high;              /* 1 % and 99 % quantiles of the positive luminances */
    double adapted, key, white;    /* metered luminance, key and white that were used, after adaptation */
    size_t positive;               /* pixels with a finite luminance > 0: those that log_average, low and high are of */
    size_t nan, infinite, negative; /* pixels that are no measurement: nan and negative show their neighbours */
    size_t clamped;                /* pixels with a display component above 1 */
    size_t scale[10];              /* searched pixels by the box that was taken, smallest first */
    size_t searched, skipped;      /* pixels with and without a search */
} tonemap_stats;

typedef struct tonemap tonemap;

/* ------------------------------------------------------------------------------------------------
   Calls
   ------------------------------------------------------------------------------------------------ */

/* The version the implementation was compiled with: compare with TONEMAP_VERSION. */
TONEMAP_DEF int tonemap_version(void);

/* One picture, packed floats in, packed 8-bit sRGB of as many channels out. */
TONEMAP_DEF sat_result tonemap_once_u8(unsigned char *out, const float *pixels, int width, int height, int channels,
                                       const tonemap_options *options);

/* An operator for pictures of one size; exactly one allocation. Sides up to 2^24. */
TONEMAP_DEF sat_result tonemap_create(tonemap **out, int width, int height, const tonemap_options *options);
/* hdr: linear, 1 (grey), 3 (RGB) or 4 (RGB and alpha) channels; out: as many channels, rows out_stride bytes apart.
   dt: seconds since the last picture, >= 0; only adaptation looks at it. stats may be NULL. */
TONEMAP_DEF sat_result tonemap_apply_u8(tonemap *map, unsigned char *out, ptrdiff_t out_stride, const sat_image *hdr,
                                        double dt, tonemap_stats *stats);
/* The same without sRGB encoding: linear display values in [0, 1]. May work in place. */
TONEMAP_DEF sat_result tonemap_apply_f32(tonemap *map, float *out, ptrdiff_t out_stride, const sat_image *hdr,
                                         double dt, tonemap_stats *stats);
/* One sentence that names the first argument of tonemap_create or tonemap_gl_create that is refused, and its range; ""
   when none is. Written into text (cut to size, always ended); returns text. */
TONEMAP_DEF const char *tonemap_explain(char *text, size_t size, int width, int height, const tonemap_options *options);
/* Other options from the next picture on; the adaptation goes on, and what only the new options need starts with it.
   Allocator and worker count stay those of create. */
TONEMAP_DEF sat_result tonemap_set_options(tonemap *map, const tonemap_options *options);
TONEMAP_DEF void tonemap_destroy(tonemap *map); /* NULL is fine */

#ifdef __cplusplus
}
#endif
#endif /* TONEMAP_H */

/* ------------------------------------------------------------------------------------------------
   >> interface of OpenGL: 3.3 core, or ES 3.0 / WebGL 2 with EXT_color_buffer_float (define TONEMAP_GL)
   ------------------------------------------------------------------------------------------------ */

#if defined(TONEMAP_GL) && !defined(TONEMAP__GL_API)
#define TONEMAP__GL_API

#ifdef __cplusplus
extern "C" {
#endif

/* Belongs to the context that is current in create: it must be current in every call. Every call leaves the OpenGL
   state as it was (but for pending errors, which are lost). Nothing waits for the GPU: the log-average and the
   adaptation stay there. All options but threads work. Metering by percentiles (the default), an estimated key or
   white, and Ashikhmin's range take a histogram: by compute shaders where there is GL 4.3, else by one point a pixel,
   which on ES asks for EXT_float_blend; TONEMAP_METERING_LOG_AVERAGE with a white above 0 does without.
   The CPU alone has statistics, pictures of one channel, and keeps alpha, which is 1 here. Floats come by a target that
   is a float texture, with any encoding. All else is on both. */
typedef struct tonemap_gl tonemap_gl;

/* On an OpenGL error *out only answers tonemap_gl_message, and is to be destroyed; on the others it is NULL. */
TONEMAP_DEF sat_result tonemap_gl_create(tonemap_gl **out, sat_gl_get_proc *get_proc, int width, int height,
                                         const tonemap_options *options);
/* Maps the first texels (or those at to->from) of the 2D texture hdr (float RGB or RGBA, at least of the created size
   or the smaller one that `to` names, over which meter_weights are stretched; level 0) to sRGB codes and alpha 1: in
   the target `to` (8 bits a channel; the window's framebuffer:
   sat_gl_to_framebuffer(0, 0, 0)), or, when NULL, in tonemap_gl_texture(). */
TONEMAP_DEF sat_result tonemap_gl_apply(tonemap_gl *gl, const sat_gl_target *to, unsigned hdr, double dt);
TONEMAP_DEF unsigned tonemap_gl_texture(const tonemap_gl *gl);
/* Other options from the next picture on; the adaptation goes on. Costs nothing: key, white, exposure, the seconds, the
   limits of adaptation, units, primaries, white balance and peak are uniforms. What the shaders are compiled for is
   SAT_ERR_ARGUMENT, and nothing changes: another value of any other option, a key or white that is estimated where it
   was not or the other way round, a white that is infinite where it was not. Allocator and threads are not looked at.
 */
TONEMAP_DEF sat_result tonemap_gl_set_options(tonemap_gl *gl, const tonemap_options *options);
/* What the last SAT_ERR_GL_... was about; never NULL, and NULL is fine. */
TONEMAP_DEF const char *tonemap_gl_message(const tonemap_gl *gl);
TONEMAP_DEF void tonemap_gl_destroy(tonemap_gl *gl); /* NULL is fine */

/* GLSL (3.30 or ES 3.00) to put behind the #version line of a shader, once or more:

       float tonemap_luminance(vec3 rgb)                             0 for NaN and what is not positive
       float tonemap_rho(float lux)                                  eq A.11
       vec3  tonemap_mesopic(vec3 rgb, float luminance, float rho)   eq A.12 with the pixel's own white
       vec3  tonemap_srgb(vec3 linear)                               clipped and encoded

   and, after sat_gl_glsl(), the search of eq A.5 to A.9 on a table of SAT_GL_FIXED32:

       float tonemap_local(usampler2D table, float quantum, ivec2 pixel, float scaled_luminance, float key) */
TONEMAP_DEF const char *tonemap_gl_glsl(void);

#ifdef __cplusplus
}
#endif
#endif /* TONEMAP__GL_API */

/* ------------------------------------------------------------------------------------------------
   Stop here if you only want to use the library.
   ------------------------------------------------------------------------------------------------ */

#if defined(TONEMAP_IMPLEMENTATION) && !defined(TONEMAP_IMPLEMENTED)
#define TONEMAP_IMPLEMENTED

#ifndef SAT_SIBLING
#define SAT_SIBLING
#endif
#include "sat.h"
#include <float.h>

SAT__IEEE_BEGIN
#ifdef __cplusplus
extern "C" {
#endif

/* ---- >> options: their table, what is left out, sentences; the object

   What TONEMAP_NO_... leaves out: the conditions below become constants, and the code behind them goes. */
#ifdef TONEMAP_NO_ASHIKHMIN
enum { TONEMAP__HAS_ASHIKHMIN = 0 };
#else
enum { TONEMAP__HAS_ASHIKHMIN = 1 };
#endif
#ifdef TONEMAP_NO_MESOPIC
enum { TONEMAP__HAS_MESOPIC = 0 };
#else
enum { TONEMAP__HAS_MESOPIC = 1 };
#endif
#ifdef TONEMAP_NO_SELECTIVE
enum { TONEMAP__HAS_SELECTIVE = 0 };
#else
enum { TONEMAP__HAS_SELECTIVE = 1 };
#endif
#ifdef TONEMAP_NO_SOFT
enum { TONEMAP__HAS_SOFT = 0 };
#else
enum { TONEMAP__HAS_SOFT = 1 };
#endif
#ifdef TONEMAP_NO_WHITE
enum { TONEMAP__HAS_WHITE = 0 };
#else
enum { TONEMAP__HAS_WHITE = 1 };
#endif

enum {
    TONEMAP__LENGTHS = 8,  /* box lengths of the photographic operator */
    TONEMAP__ASHIKHMIN = 10, /* neighbourhoods of Ashikhmin's operator; each is compared with the one of twice its
                                size */
    TONEMAP__BOXES = 20,   /* room for the boxes of one row */
    TONEMAP__GROUP = 16,   /* pixels searched together */
    TONEMAP__RADIUS = 10,  /* of the two boxes of the guided filter: together they reach as far as the largest box */
    TONEMAP__GUIDED_ROWS = 2 * TONEMAP__RADIUS + 2,
    TONEMAP__RINGS = 3 * TONEMAP__GUIDED_ROWS + 2, /* rows of the guided filter; the search needs 42 of them */
    TONEMAP__BAND = 64,    /* rows of the smallest piece of work: 2 reach + 2 rows of sums are made anew for each */
    TONEMAP__CHUNK = 64,   /* pixels converted to display values together */
    TONEMAP__BINS = 16 * 201, /* of the luminance histogram: 16 an octave, from 2^-100 to 2^100 */
    TONEMAP__CODES = 13 * 512 + 1 /* entries of the sRGB table */
};

/* Luminances outside are taken as 0 and as the largest: a range that no unit and no scene reaches, in which products
   with any scale of eq A.2 stay normal floats. */
#define TONEMAP__DARKEST 7.8886090522101181e-31f  /* 2^-100 */
#define TONEMAP__BRIGHTEST 1.2676506002282294e30f /* 2^100 */
#define TONEMAP__DARKEST_BITS 0x0d800000u
#define TONEMAP__UNUSABLE 0x80000000u /* -0: a luminance that counts as 0 and says that the pixel shows its
                                         neighbours */
#define TONEMAP__HIGHLIGHTS 4.5       /* octaves from the metered luminance up to what a tenth of the picture reaches */
#define TONEMAP__LUMA 0.2126729, 0.7151522, 0.0721750 /* of Rec. 709's red, green and blue */
#define TONEMAP__WHITE_X 0.95047f     /* X of the white D65 of Y 1 */
#define TONEMAP__LOCAL_CAP 256.0f     /* of the scaled luminance in the sums; the display has 0.4 % left beyond it */
#define TONEMAP__QUANTUM 4096.0f      /* steps a unit: 41 * 41 * 256 * 4096 < 2^31 */
#define TONEMAP__STEPS 64.0f          /* of the guided filter, an octave: 441 (18 * 64)^2 < 2^31 */
#define TONEMAP__OCTAVES 10.0f        /* below a scaled luminance of 1, where they begin: code 3 */
#define TONEMAP__ASHIKHMIN_QUANTUM 1048576.0f /* the same for luminances up to 1: 35 * 35 * 2^20 < 2^31 */

TONEMAP_DEF int tonemap_version(void) { return TONEMAP_VERSION; }

static const sat__field tonemap__fields[] = {
    SAT__FIELD(tonemap_options, 'i', operation, TONEMAP_GUIDED, 0, TONEMAP_HABLE, ' '),
    SAT__FIELD(tonemap_options, 'd', key, 0.18, -1e6, 10, ' '),
    SAT__FIELD(tonemap_options, 'd', white, 0, 0, 1e12, 'I'),
    SAT__FIELD(tonemap_options, 'd', phi, 8, -16, 16, ' '),
    SAT__FIELD(tonemap_options, 'd', epsilon, 0.05, 1e-9, 1e9, ' '),
    SAT__FIELD(tonemap_options, 'd', edge, 0.45, 0.01, 10, ' '),
    SAT__FIELD(tonemap_options, 'i', scales, 8, 1, 8, ' '),
    SAT__FIELD(tonemap_options, 'd', soft, 1, 0, 1, ' '),
    SAT__FIELD(tonemap_options, 'd', gamut, 0.5, 0, 1, '-'),
    SAT__FIELD(tonemap_options, 'i', metering, 0, 0, TONEMAP_METERING_LOG_AVERAGE, ' '),
    SAT__FIELD(tonemap_options, 'd', meter_low, 0.02, 0, 0.5, ' '),
    SAT__FIELD(tonemap_options, 'd', meter_high, 0.98, 0.5, 1, ' '),
    SAT__FIELD(tonemap_options, 'i', mesopic, 0, 0, TONEMAP_MESOPIC_LOCAL, ' '),
    SAT__FIELD(tonemap_options, 'd', cd_per_unit, 0, 0, 1e30, ' '),
    SAT__FIELD(tonemap_options, 'd', lux_per_cd, 1, 0, 1e6, ' '),
    SAT__FIELD(tonemap_options, 'd', selective, 0, 0, 1e30, ' '),
    SAT__FIELD(tonemap_options, 'd', adapt_seconds, 0, 0, 1e30, ' '),
    SAT__FIELD(tonemap_options, 'd', darker_seconds, 0, 0, 1e30, ' '),
    SAT__FIELD(tonemap_options, 'd', adapt_low, 0, 0, 1e30, ' '),
    SAT__FIELD(tonemap_options, 'd', adapt_high, (double)INFINITY, 1e-30, 1e30, 'I'),
    SAT__FIELD(tonemap_options, 'd', exposure, 0, 0, 1e30, ' '),
    SAT__FIELD(tonemap_options, 'i', primaries, 0, 0, TONEMAP_PRIMARIES_2020, ' '),
    SAT__FIELD(tonemap_options, 'i', display, 0, 0, TONEMAP_PRIMARIES_2020, ' '),
    SAT__FIELD(tonemap_options, 'd', balance_red, 1, 0, 1000, ' '),
    SAT__FIELD(tonemap_options, 'd', balance_green, 1, 0, 1000, ' '),
    SAT__FIELD(tonemap_options, 'd', balance_blue, 1, 0, 1000, ' '),
    SAT__FIELD(tonemap_options, 'd', peak, 1, 1, 100, ' '),
    SAT__FIELD(tonemap_options, 'i', encoding, 0, 0, TONEMAP_ENCODING_HLG, ' '),
    SAT__FIELD(tonemap_options, 'd', white_cd, 203, 1, 10000, ' '),
    SAT__FIELD(tonemap_options, 'i', dither, 0, 0, 1, ' '),
    SAT__FIELD(tonemap_options, 'a', allocator, 0, 0, 0, ' '),
    SAT__FIELD(tonemap_options, 't', threads, 0, 0, 0, ' '),
};

TONEMAP_DEF tonemap_options tonemap_defaults(void)
{
    tonemap_options o;
    sat__fields_default(&o, sizeof o, tonemap__fields, SAT__COUNT(tonemap__fields));
    if (!TONEMAP__HAS_SOFT) o.soft = 0;
    if (!TONEMAP__HAS_WHITE) o.white = (double)INFINITY;
    return o;
}

static inline int tonemap__is_infinite(double v) { return !sat__is_finite_double(v) && v > 0; }

static inline int tonemap__in_range(double v, double low, double high)
{
    return sat__is_finite_double(v) && v >= low && v <= high;
}

/* What is asked for though TONEMAP_NO_... left it out, as a sentence; or NULL. */
static inline const char *tonemap__left_out(const tonemap_options *o)
{
    if (!TONEMAP__HAS_ASHIKHMIN && (o->operation == TONEMAP_ASHIKHMIN || o->operation == TONEMAP_ASHIKHMIN_GLOBAL))
        return "operation is Ashikhmin's; TONEMAP_NO_ASHIKHMIN left it out";
    if (!TONEMAP__HAS_MESOPIC && o->mesopic != TONEMAP_MESOPIC_OFF)
        return "mesopic is on; TONEMAP_NO_MESOPIC left it out";
    if (!TONEMAP__HAS_WHITE && !tonemap__is_infinite(o->white)) return "white is finite; TONEMAP_NO_WHITE left it out";
    if (!TONEMAP__HAS_SELECTIVE && o->selective > 0) return "selective is above 0; TONEMAP_NO_SELECTIVE left it out";
    if (!TONEMAP__HAS_SOFT && o->soft > 0) return "soft is above 0; TONEMAP_NO_SOFT left it out";
    return NULL;
}

static inline int tonemap__explain_options(sat__text *t, const tonemap_options *o)
{
    const sat__field *wrong = sat__fields_check(o, tonemap__fields, SAT__COUNT(tonemap__fields));
    if (wrong) sat__text_field(t, wrong, o);
    else if (tonemap__left_out(o)) sat__text_add(t, tonemap__left_out(o));
    return !wrong && !tonemap__left_out(o);
}

static inline int tonemap__options_are_valid(const tonemap_options *o)
{
    sat__text ignored = sat__text_begin(NULL, 0);
    return tonemap__explain_options(&ignored, o);
}

TONEMAP_DEF const char *tonemap_explain(char *text, size_t size, int width, int height, const tonemap_options *options)
{
    sat__text t = sat__text_begin(text, size);
    if (width < 1 || width > 1 << 24) sat__text_range(&t, "width", width, 1, 1 << 24, ' ');
    else if (height < 1 || height > 1 << 24) sat__text_range(&t, "height", height, 1, 1 << 24, ' ');
    else if (options) tonemap__explain_options(&t, options);
    return text;
}

/* ---- the object */

/* What one worker needs: sums of 2 reach + 2 rows, and rows of intermediate values. Rows are padded so that groups at
   the right border may read and write past the last pixel. */
typedef struct tonemap__worker {
    uint32_t *sums;       /* ring of rows; row j is the sum of all pixels above j and left of x, modulo 2^32; or the
                             guided filter's rings */
    uint32_t *column[4];  /* the guided filter's sums of 21 rows: q, q^2; a, b */
    const float *nothing; /* a row of zeros */
    float *pixels;        /* a row of the input as floats */
    float *local;         /* La, eq A.4; then the factor from input to display */
    float *rho;           /* eq A.11 */
    float *edge;          /* Sobel gradient */
    uint32_t *bins, *histogram; /* memory; the same or NULL when nobody asks */
    int64_t log_sum;      /* of log2 of the positive luminances, in 2^-16 */
    uint64_t counted;     /* how many they are; with a mask, of its weights */
    int beyond;           /* some luminance of the row is beyond TONEMAP__BRIGHTEST */
    const float *luma, *mask; /* weights of red, green and blue; of the row's pixels, or NULL */
    tonemap_stats stats;
} tonemap__worker;

/* What adapts over time, all as base-2 logarithms. */
enum {
    TONEMAP__AVERAGE,
    TONEMAP__KEY,
    TONEMAP__WHITE,
    TONEMAP__LOW,
    TONEMAP__HIGH,
    TONEMAP__STATES,
    TONEMAP__HELD = TONEMAP__STATES
};

/* What options say about colours; see tonemap__prepare_colours. */
typedef struct tonemap__colours {
    float luma[3];          /* luminance weights of the picture's red, green and blue */
    int mixes;              /* those of the display are mixed from them */
    float mix[9];           /* by this matrix, white balance in it */
    float red_x[3], red_step[3], display_luma[3]; /* X of the display's channels; channels of a step of X; Y */
} tonemap__colours;

/* The numbers of one picture that every pixel needs. */
typedef struct tonemap__frame {
    float scale;            /* scaled luminance = luminance * scale, eq A.2 */
    float cap, quantum;     /* of the sums */
    float inverse_cap;      /* 0 for the global operators, which have no sums */
    float inverse_white2;   /* 1 / white^2 */
    float epsilon, term[TONEMAP__LENGTHS]; /* the test of eq A.5 and A.7: |c - v| < epsilon c + term[k] */
    float soft, gamut;
    float peak;             /* display values are made in units of it */
    float edge2;            /* variance that makes half an edge, in q^2 of the guided filter */
    float lux;              /* illuminance of a scaled luminance of 1 */
    float rho;              /* eq A.11 of the whole picture; 1 where there is nothing to do */
    float curve_low, curve_factor, cd; /* Ashikhmin: display = (C(L cd) - curve_low) curve_factor */
    int reach, boxes;       /* largest radius; number of boxes */
    int radius[TONEMAP__BOXES];
} tonemap__frame;

/* Means over a range of the sorted pixels: unlike a quantile, they hardly notice one pixel more. A pixel counts less
   and less from 18 to 24 octaves below the 99 % quantile: residue is no light. */
typedef struct tonemap__meter {
    double share[TONEMAP__BINS]; /* pixels of each bin, as far as they count */
    double value[16], all, mean; /* log2 of the middles of an octave's bins; sum of the shares; log2 of every pixel */
} tonemap__meter;

struct tonemap {
    tonemap_options options;
    sat_allocator allocator;
    void *block;
    size_t block_size;
    int width, height, row, ring_row, workers, started;
    uint64_t counted;       /* pixels that metering looks at, or their weights */
    tonemap__colours colours;
    unsigned known;         /* bit i: state[i] was measured, not only set */
    tonemap__meter *meter;
    double held[2];         /* what percentile metering said, and the estimated white, until they move by more than a
                               step; see tonemap__hold */
    float *luminance;       /* the picture, rows `row` floats apart */
    float *row_sum;         /* of each row */
    unsigned char *row_odd; /* bits: 1: some pixel of the row shows its neighbours; 2: some is beyond the range */
    tonemap__worker *worker;
    double state[TONEMAP__STATES];
    tonemap__frame frame;
    tonemap_stats stats;
    uint16_t *fine;         /* codes in 256ths, for dithering */
    unsigned char code[TONEMAP__CODES];
};

/* ---- >> numbers: powers of 2; the logarithms are sat.h's */

/* |v| < 60; relative error below 5e-6 */
static inline float tonemap__exp2(float v)
{
    float whole = (float)(int32_t)(v + 64) - 64, t = v - whole;
    float q = -0.306996076f + t * (-0.0654462594f + t * -0.0137019985f);
    float octave = sat__float_from_bits((uint32_t)(int32_t)((whole + 127) * 8388608.0f));
    return octave * (1 + t + t * (1 - t) * q);
}

static inline sat__f32x4 tonemap__log2_octave4(sat__f32x4 t)
{
    sat__f32x4 q = sat__f32x4_mul(t, sat__f32x4_set1(0.0258414329f));
    q = sat__f32x4_mul(t, sat__f32x4_add(sat__f32x4_set1(-0.0959564262f), q));
    q = sat__f32x4_mul(t, sat__f32x4_add(sat__f32x4_set1(0.18194886f), q));
    q = sat__f32x4_mul(t, sat__f32x4_add(sat__f32x4_set1(-0.275600307f), q));
    q = sat__f32x4_add(sat__f32x4_set1(0.442544943f), q);
    return sat__f32x4_add(t, sat__f32x4_mul(sat__f32x4_mul(t, sat__f32x4_sub(sat__f32x4_set1(1), t)), q));
}

/* mantissa - 1 */
static inline sat__f32x4 tonemap__octave4(sat__i32x4 bits)
{
    sat__i32x4 mantissa = sat__i32x4_or(sat__i32x4_and(bits, sat__i32x4_set1(0x007fffff)), sat__i32x4_set1(0x3f800000));
    return sat__f32x4_sub(sat__f32x4_from_bits(mantissa), sat__f32x4_set1(1));
}

static inline sat__f32x4 tonemap__log2_4(sat__f32x4 v)
{
    sat__i32x4 bits = sat__f32x4_bits(v),
               exponent = sat__i32x4_sub(sat__i32x4_shift_right(bits, 23), sat__i32x4_set1(127));
    return sat__f32x4_add(sat__i32x4_to_f32(exponent), tonemap__log2_octave4(tonemap__octave4(bits)));
}

static inline sat__f32x4 tonemap__exp2_4(sat__f32x4 v)
{
    sat__f32x4 one = sat__f32x4_set1(1);
    sat__f32x4 whole = sat__f32x4_sub(sat__i32x4_to_f32(sat__f32x4_truncate(sat__f32x4_add(v, sat__f32x4_set1(64)))),
                                      sat__f32x4_set1(64));
    sat__f32x4 t = sat__f32x4_sub(v, whole),
               q = sat__f32x4_add(sat__f32x4_set1(-0.0654462594f), sat__f32x4_mul(t, sat__f32x4_set1(-0.0137019985f)));
    sat__i32x4 octave =
        sat__f32x4_truncate(sat__f32x4_mul(sat__f32x4_add(whole, sat__f32x4_set1(127)), sat__f32x4_set1(8388608.0f)));
    q = sat__f32x4_add(sat__f32x4_set1(-0.306996076f), sat__f32x4_mul(t, q));
    q = sat__f32x4_mul(sat__f32x4_mul(t, sat__f32x4_sub(one, t)), q);
    return sat__f32x4_mul(sat__f32x4_from_bits(octave), sat__f32x4_add(sat__f32x4_add(one, t), q));
}

/* ---- >> measuring: first pass: luminance, its logarithm, and what is wrong with it */

/* The luminance that counts, and its number in the statistics. */
static inline float tonemap__sane_luminance(float y, tonemap_stats *stats)
{
    if (sat__is_nan(y)) {
        stats->nan++;
        return sat__float_from_bits(TONEMAP__UNUSABLE);
    }
    if (y < 0) {
        stats->negative++;
        return sat__float_from_bits(TONEMAP__UNUSABLE);
    }
    if (!sat__is_finite(y)) stats->infinite++;
    return y < TONEMAP__DARKEST ? 0 : y > TONEMAP__BRIGHTEST ? TONEMAP__BRIGHTEST : y;
}

/* What a pixel of a mask counts: 0 to 15. */
static inline uint32_t tonemap__mask_weight(float v)
{
    return v > 0 ? v < 1 ? (uint32_t)(int32_t)(v * 15 + 0.5f) : 15 : 0;
}

/* A row that is measured. lane[x % 4] sums the luminances, so that four pixels at a time give the same sum. */
typedef struct tonemap__line {
    float *luminance, lane[4];
    const float *pixels;
    int channels;
} tonemap__line;

/* Pixels [x, end) of a row with whatever is in them and their weights. */
static inline void tonemap__measure_each(tonemap__worker *w, tonemap__line *line, int x, int end)
{
    float *luminance = line->luminance;
    const int channels = line->channels;
    int64_t log_sum = 0;
    uint64_t counted = 0;
    size_t positive = 0;
    for (; x < end; x++) {
        const float *p = line->pixels + (size_t)x * (size_t)channels;
        float y = channels == 1 ? p[0] : w->luma[0] * p[0] + w->luma[1] * p[1] + w->luma[2] * p[2], t;
        uint32_t bits, weight = w->mask ? tonemap__mask_weight(w->mask[x]) : 1;
        if (!(y >= TONEMAP__DARKEST && y <= TONEMAP__BRIGHTEST)) {
            int finite = sat__is_finite(y);
            w->beyond |= y > TONEMAP__BRIGHTEST;
            y = tonemap__sane_luminance(y, &w->stats);
            if (!(y > 0) || !finite) { /* infinity is shown as white, but says nothing about the light */
                luminance[x] = y;
                continue;
            }
        }
        luminance[x] = y;
        line->lane[x & 3] += y;
        bits = sat__float_bits(y);
        t = sat__float_from_bits((bits & 0x007fffffu) | 0x3f800000u) - 1;
        log_sum += (int64_t)weight * (((int32_t)(bits >> 23) - 127) * 65536 +
                                      (int32_t)(sat__log2_octave(t) * 65536 + 0.5f));
        positive++;
        counted += weight;
        if (w->histogram) w->histogram[(bits - TONEMAP__DARKEST_BITS) >> 19] += weight;
    }
    w->log_sum += log_sum;
    w->counted += counted;
    w->stats.positive += positive;
}

static inline sat__f32x4 tonemap__load_pixels(const float *p, int channels, sat__f32x4 *r, sat__f32x4 *g, sat__f32x4 *b)
{
    sat__f32x4 alpha = sat__f32x4_set1(1);
    if (channels == 3) sat__f32x4_load3(p, r, g, b);
    else if (channels == 4) sat__f32x4_load4(p, r, g, b, &alpha);
    else *r = *g = *b = sat__f32x4_load(p);
    return alpha;
}

static inline sat__f32x4 tonemap__luminance4(const float *luma, int channels, sat__f32x4 r, sat__f32x4 g, sat__f32x4 b)
{
    sat__f32x4 y =
        sat__f32x4_add(sat__f32x4_mul(sat__f32x4_set1(luma[0]), r), sat__f32x4_mul(sat__f32x4_set1(luma[1]), g));
    return channels == 1 ? r : sat__f32x4_add(y, sat__f32x4_mul(sat__f32x4_set1(luma[2]), b));
}

static inline void tonemap__count4(uint32_t *histogram, sat__i32x4 bits)
{
    int32_t bin[4];
    int i;
    sat__i32x4_store(bin,
                     sat__i32x4_shift_right(sat__i32x4_sub(bits, sat__i32x4_set1((int32_t)TONEMAP__DARKEST_BITS)), 19));
    for (i = 0; i < 4; i++) histogram[bin[i]]++;
}

/* Whole groups of four of a row of at most 2^16 pixels without a mask; returns where it stopped. */
static inline int tonemap__measure_fours(tonemap__worker *w, tonemap__line *line, int x, int end)
{
    const float *pixels = line->pixels;
    float *luminance = line->luminance, *lane = line->lane;
    const int channels = line->channels;
    sat__f32x4 sum = sat__f32x4_load(lane), low = sat__f32x4_set1(TONEMAP__DARKEST),
               high = sat__f32x4_set1(TONEMAP__BRIGHTEST);
    sat__i32x4 exponents = sat__i32x4_set1(0), fractions = sat__i32x4_set1(0);
    int32_t e[4], f[4];
    int i, groups = 0;
    for (; x + 4 <= end; x += 4) {
        sat__f32x4 r, g, b, y;
        sat__i32x4 bits;
        tonemap__load_pixels(pixels + (size_t)x * (size_t)channels, channels, &r, &g, &b);
        y = tonemap__luminance4(w->luma, channels, r, g, b);
        if (!sat__i32x4_all(sat__i32x4_and(sat__f32x4_less_equal(low, y), sat__f32x4_less_equal(y, high)))) {
            sat__f32x4_store(lane, sum);
            tonemap__measure_each(w, line, x, x + 4);
            sum = sat__f32x4_load(lane);
            continue;
        }
        sat__f32x4_store(luminance + x, y);
        sum = sat__f32x4_add(sum, y);
        bits = sat__f32x4_bits(y);
        exponents = sat__i32x4_add(exponents, sat__i32x4_shift_right(bits, 23));
        y = sat__f32x4_mul(tonemap__log2_octave4(tonemap__octave4(bits)), sat__f32x4_set1(65536));
        fractions = sat__i32x4_add(fractions, sat__f32x4_truncate(sat__f32x4_add(y, sat__f32x4_set1(0.5f))));
        if (w->histogram) tonemap__count4(w->histogram, bits);
        groups++;
    }
    sat__f32x4_store(lane, sum);
    sat__i32x4_store(e, exponents);
    sat__i32x4_store(f, fractions);
    for (i = 0; i < 4; i++) w->log_sum += ((int64_t)e[i] - 127 * (int64_t)groups) * 65536 + f[i];
    w->stats.positive += 4 * (size_t)groups;
    w->counted += 4 * (uint64_t)groups;
    return x;
}

static inline float tonemap__measure_row(tonemap__worker *w, float *luminance, const float *pixels, int channels,
                                         int width)
{
    tonemap__line line = {NULL, {0, 0, 0, 0}, NULL, 0};
    int x = 0, end;
    line.luminance = luminance;
    line.pixels = pixels;
    line.channels = channels;
    while (x < width) {
        end = width - x > 65536 ? x + 65536 : width;
        if (!w->mask) x = tonemap__measure_fours(w, &line, x, end);
        tonemap__measure_each(w, &line, x, end);
        x = end;
    }
    return (line.lane[0] + line.lane[1]) + (line.lane[2] + line.lane[3]);
}

/* A row of the input as packed floats: the input's own where it is that. */
static inline const float *tonemap__float_row(float *scratch, const sat_image *hdr, int y)
{
    sat_image flat = *hdr;
    if (hdr->format == SAT_F32) return (const float *)sat__image_row(hdr, y);
    flat.width *= hdr->channels;
    flat.channels = 1;
    sat__read_row(scratch, &flat, y, 0, flat.width, 0);
    return scratch;
}

/* One call of tonemap_apply: what the pieces of work share. */
typedef struct tonemap__job {
    tonemap *map;
    const sat_image *hdr;
    unsigned char *out;
    ptrdiff_t out_stride;
    int as_float;
} tonemap__job;

static void tonemap__measure_bands(int begin, int end, int worker, void *context)
{
    const tonemap__job *job = (const tonemap__job *)context;
    tonemap *map = job->map;
    tonemap__worker *w = &map->worker[worker];
    int x, y = begin * TONEMAP__BAND, y1 = sat__min_int(end * TONEMAP__BAND, map->height);
    for (; y < y1; y++) {
        float *luminance = map->luminance + (size_t)y * (size_t)map->row;
        const float *pixels = tonemap__float_row(w->pixels, job->hdr, y);
        size_t unusable = w->stats.nan + w->stats.negative;
        const float *mask = map->options.meter_weights;
        w->mask = mask ? mask + (size_t)y * (size_t)map->width : NULL;
        w->beyond = 0;
        map->row_sum[y] = tonemap__measure_row(w, luminance, pixels, job->hdr->channels, map->width);
        map->row_odd[y] = (unsigned char)((w->stats.nan + w->stats.negative > unusable) + 2 * w->beyond);
        for (x = map->width; x < map->row; x++) luminance[x] = luminance[map->width - 1];
    }
}

/* ---- >> metering: between the passes: key, white and range of the picture */

/* log2 of a luminance in a bin, part of the way through it. */
static inline double tonemap__bin_value(int bin, double part)
{
    return bin / 16 - 100 + log2(1 + (bin % 16 + part) / 16);
}

/* The luminance below which a share of the positive ones lies, as log2; within a sixteenth of an octave. */
static inline double tonemap__quantile(const uint32_t *histogram, size_t positive, double share)
{
    double wanted = share * (double)positive, seen = 0;
    int bin;
    for (bin = 0; bin < TONEMAP__BINS; bin++) {
        double count = (double)histogram[bin];
        if (count > 0 && seen + count >= wanted)
            return tonemap__bin_value(bin, wanted > seen ? (wanted - seen) / count : 0);
        seen += count;
    }
    return 0;
}

/* Below two steps of the histogram a picture is flat. */
static inline int tonemap__has_range(double low, double high) { return high - low > 0.125; }

/* The key from where the log-average lies between dark and bright, and the white from their distance (Reinhard 2003, on
   quantiles: minimum and maximum of a real picture are noise). All arguments and results are base-2 logarithms. The
   white is no brighter than the brightest pixels but a few (the 99.5 to 99.95 % quantiles): pictures of low range would
   end at a light grey; a white below 1 would brighten midtones more than highlights. */
static inline double tonemap__estimated_key(double average, double low, double high)
{
    double place = (2 * average - low - high) / (high - low);
    if (!tonemap__has_range(low, high)) place = 0;
    return log2(0.18) + 2 * (place < -1 ? -1 : place > 1 ? 1 : place);
}

static inline double tonemap__estimated_white(double low, double high, double brightest)
{
    double white = log2(1.5) + high - low - 5;
    if (brightest < white) white = brightest;
    return white > 0 ? white : 0;
}

static inline int tonemap__is_ashikhmin(const tonemap_options *o)
{
    return TONEMAP__HAS_ASHIKHMIN && (o->operation == TONEMAP_ASHIKHMIN || o->operation == TONEMAP_ASHIKHMIN_GLOBAL);
}

static inline int tonemap__needs_histogram(const tonemap_options *o, const tonemap_stats *stats)
{
    return stats != NULL || o->metering == TONEMAP_METERING_PERCENTILES || o->key <= 0 || o->white <= 0 ||
           tonemap__is_ashikhmin(o);
}

/* log2 of the log-average, eq A.1, over positive luminances only: a mean of integers, so that neither the order of the
   pixels nor a unit that is a power of two changes it. */
static inline double tonemap__log_average(int64_t log_sum, size_t positive)
{
    int64_t step = (int64_t)positive * 65536, whole = log_sum / step, rest = log_sum % step;
    return (double)whole + (double)rest / (double)step;
}

static inline void tonemap__open_meter(tonemap__meter *m, const uint32_t *histogram, size_t positive)
{
    double top = tonemap__quantile(histogram, positive, 0.99);
    int bin;
    m->all = m->mean = 0;
    for (bin = 0; bin < 16; bin++) m->value[bin] = tonemap__bin_value(16 * 100 + bin, 0.5);
    for (bin = 0; bin < TONEMAP__BINS; bin++) {
        double v = bin / 16 - 100 + m->value[bin % 16], w = (v - (top - 24)) / 6;
        m->share[bin] = (double)histogram[bin] * (w < 0 ? 0 : w > 1 ? 1 : w);
        m->all += m->share[bin];
        m->mean += (double)histogram[bin] * v / (double)positive;
    }
}

static inline double tonemap__mean_between(const tonemap__meter *m, double low, double high)
{
    double seen = 0, sum = 0, inner = 0;
    int bin;
    low *= m->all;
    high *= m->all;
    for (bin = 0; bin < TONEMAP__BINS; bin++) {
        double next = seen + m->share[bin], n = (next < high ? next : high) - (seen > low ? seen : low);
        if (n > 0) {
            inner += n;
            sum += n * (bin / 16 - 100 + m->value[bin % 16]);
        }
        seen = next;
    }
    return inner > 0 ? sum / inner : m->mean;
}

/* Percentile metering: how far the mean between the percentiles is from that of all, so that a flat picture has exactly
   its log-average. Where the brightest fifth would be beyond 22 times the key, the picture is exposed for that: a lit
   table is worth more than the dark room around it. */
static inline double tonemap__metered(const tonemap__meter *m, double average, const tonemap_options *o)
{
    double bright = tonemap__mean_between(m, 0.8, o->meter_high > 0.8 ? o->meter_high : 1) - TONEMAP__HIGHLIGHTS;
    average += tonemap__mean_between(m, o->meter_low, o->meter_high) - m->mean;
    return average > bright ? average : bright;
}

/* In steps of a fraction of an octave; while the eye adapts, what was held stays until the new value is more than a
   step away. */
static inline double tonemap__hold(const tonemap *map, double *held, unsigned known, double value, double steps)
{
    int holds = map->options.adapt_seconds > 0 && map->started && map->known & known;
    if (!holds || fabs(value - *held) * steps > 1) *held = floor(value * steps + 0.5) / steps;
    return *held;
}

/* Limits of adaptation, as log2. */
static inline double tonemap__limited(double average, const tonemap_options *o)
{
    if (!tonemap__is_infinite(o->adapt_high) && average > log2(o->adapt_high)) average = log2(o->adapt_high);
    if (o->adapt_low > 0 && average < log2(o->adapt_low)) average = log2(o->adapt_low);
    return average;
}

static inline void tonemap__collect(tonemap *map, int64_t *log_sum)
{
    double sum = 0;
    int i, y;
    tonemap_stats *total = &map->stats;
    *log_sum = 0;
    map->counted = 0;
    for (i = 0; i < map->workers; i++) {
        const tonemap__worker *w = &map->worker[i];
        *log_sum += w->log_sum;
        total->positive += w->stats.positive;
        map->counted += w->counted;
        total->nan += w->stats.nan;
        total->infinite += w->stats.infinite;
        total->negative += w->stats.negative;
        if (i > 0 && w->histogram)
            for (y = 0; y < TONEMAP__BINS; y++) map->worker[0].histogram[y] += w->histogram[y];
    }
    for (y = 0; y < map->height; y++) sum += (double)map->row_sum[y];
    total->mean = sum / ((double)map->width * map->height);
}

static inline double tonemap__measured_white(tonemap *map, const tonemap__meter *m, const double *state, double low,
                                             double high)
{
    const tonemap_options *o = &map->options;
    double brightest = tonemap__mean_between(m, 0.995, 0.9995) +
                       (o->exposure > 0 ? log2(o->exposure) : state[TONEMAP__KEY] - state[TONEMAP__AVERAGE]);
    return tonemap__hold(map, &map->held[1], 1u << TONEMAP__WHITE, tonemap__estimated_white(low, high, brightest), 8);
}

/* What this picture alone would ask for; 0 when it is black. */
static inline int tonemap__measured_state(tonemap *map, double *state)
{
    const tonemap_options *o = &map->options;
    const uint32_t *histogram = map->worker[0].histogram;
    int ashikhmin = tonemap__is_ashikhmin(o);
    double low = 0, high = 0, average;
    int64_t log_sum;
    tonemap__meter *m = map->meter;
    tonemap__collect(map, &log_sum);
    if (!map->counted) return 0;
    average = tonemap__log_average(log_sum, (size_t)map->counted);
    SAT_ASSERT(histogram || !ashikhmin);
    if (histogram) {
        tonemap__open_meter(m, histogram, (size_t)map->counted);
        low = tonemap__quantile(histogram, (size_t)map->counted, 0.01);
        high = tonemap__quantile(histogram, (size_t)map->counted, 0.99);
    }
    map->stats.log_average = exp2(average);
    if (o->metering == TONEMAP_METERING_PERCENTILES) {
        if (map->started && map->counted * 1000 < (uint64_t)map->width * (uint64_t)map->height)
            return 0; /* as good as black */
        average = tonemap__hold(map, &map->held[0], 1u << TONEMAP__HELD, tonemap__metered(m, average, o), 64);
    }
    state[TONEMAP__AVERAGE] = average = tonemap__limited(average, o);
    state[TONEMAP__KEY] = o->key > 0 ? log2(o->key) : tonemap__estimated_key(average, low, high);
    state[TONEMAP__WHITE] = o->white > 0 ? 0 : tonemap__measured_white(map, m, state, low, high);
    state[TONEMAP__LOW] = ashikhmin ? tonemap__quantile(histogram, (size_t)map->counted, 0.0005) : 0;
    state[TONEMAP__HIGH] = ashikhmin ? tonemap__quantile(histogram, (size_t)map->counted, 0.9995) : 0;
    map->stats.low = exp2(low);
    map->stats.high = exp2(high);
    return 1;
}

/* Share of the way that the state goes in a time; all of it without adaptation. */
static inline double tonemap__share(const tonemap_options *o, int darker, double dt)
{
    double tau = darker && o->darker_seconds > 0 ? o->darker_seconds : o->adapt_seconds;
    return o->adapt_seconds > 0 ? -expm1(-dt / tau) : 1;
}

/* Exponential approach with a time constant, exact for any step: two steps of dt / 2 are one of dt. */
static inline void tonemap__adapt(tonemap *map, const double *measured, double dt)
{
    const tonemap_options *o = &map->options;
    double weight = tonemap__share(o, measured[TONEMAP__AVERAGE] < map->state[TONEMAP__AVERAGE], dt);
    unsigned used = 1u << TONEMAP__AVERAGE | 1u << TONEMAP__KEY;
    int i;
    if (o->metering == TONEMAP_METERING_PERCENTILES) used |= 1u << TONEMAP__HELD;
    if (!(o->white > 0)) used |= 1u << TONEMAP__WHITE;
    if (tonemap__is_ashikhmin(o)) used |= 1u << TONEMAP__LOW | 1u << TONEMAP__HIGH;
    for (i = 0; i < TONEMAP__STATES; i++) {
        if (weight >= 1 || !(map->known & used & 1u << i))
            map->state[i] = measured[i]; /* what nobody knew yet is there at once */
        else map->state[i] += weight * (measured[i] - map->state[i]);
    }
    map->known = used;
    map->started = 1;
}

/* Ashikhmin's perceptual capacity C: the number of just noticeable steps below a luminance in cd/m2, the integral of
   1 / threshold with thresholds 0.0014, 0.4027 L, 0.4027, 0.0556 L. The constants make it continuous: the published
   2.4483 jumps at 0.0034. */
#define TONEMAP__CAPACITY(cd, ln)                                                                                      \
    (cd < 0.0034f    ? cd * (1.0f / 0.0014f)                                                                           \
     : cd < 1.0f     ? 16.5431894f + ln * (1.0f / 0.4027f)                                                             \
     : cd < 7.2444f  ? 16.5431894f + (cd - 1.0f) * (1.0f / 0.4027f)                                                    \
                     : -3.56579561f + ln * (1.0f / 0.0556f))

static inline float tonemap__capacity(float cd)
{
    float ln = 0.693147181f * sat__log2(cd < TONEMAP__DARKEST ? TONEMAP__DARKEST : cd);
    return TONEMAP__CAPACITY(cd, ln);
}

/* Eq A.10 and A.11 as a polynomial of log2 of the illuminance from 2^-24 to 10 lux, within 0.001 (0.2 codes) and
   exactly 1 from 10 lux on. The printed form is not finite at 0, where this is 22 / 57. */
#define TONEMAP__RHO_LOW 5.9604645e-8f /* 2^-24 lux */
#define TONEMAP__RHO_CENTRE -10.339036f
#define TONEMAP__RHO_WIDTH 0.073201276f

static inline float tonemap__rho(float lux)
{
    float i = lux > TONEMAP__RHO_LOW ? lux : TONEMAP__RHO_LOW, t, u, q;
    uint32_t bits;
    if (!(i < 10)) return 1;
    bits = sat__float_bits(i);
    t = sat__float_from_bits((bits & 0x007fffffu) | 0x3f800000u) - 1;
    u = (float)((int32_t)bits - 0x3f800000) * 1.1920929e-7f +
        t * (1 - t) * (0.422865337f + t * -0.159220122f); /* log2 */
    u = (u - TONEMAP__RHO_CENTRE) * TONEMAP__RHO_WIDTH;
    q = u * (u * -0.0893071936f + -0.150544156f) + 0.0254077498f;
    q = u * (u * (u * q + 0.287330944f) + 0.475713817f) + 0.582037485f;
    return 1 + (u - 1) * q;
}

static inline void tonemap__invert(double *out, const double *m)
{
    double determinant = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) +
                         m[2] * (m[3] * m[7] - m[4] * m[6]);
    int i, k;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) {
            int a = (i + 1) % 3, b = (i + 2) % 3, c = (k + 1) % 3, d = (k + 2) % 3;
            out[3 * k + i] = (m[3 * a + c] * m[3 * b + d] - m[3 * a + d] * m[3 * b + c]) / determinant;
        }
}

/* ---- colours: from the picture's primaries to the display's */

/* Rows X, Y, Z of red, green and blue whose sum is D65. */
static inline void tonemap__to_xyz(double *m, tonemap_primaries primaries)
{
    static const double xy[3][6] = {{0.64, 0.33, 0.30, 0.60, 0.15, 0.06},
                                    {0.68, 0.32, 0.265, 0.69, 0.15, 0.06},
                                    {0.708, 0.292, 0.170, 0.797, 0.131, 0.046}};
    static const double white[3] = {0.3127 / 0.3290, 1, 0.3583 / 0.3290};
    const double *p = xy[primaries];
    double inverse[9];
    int i, c;
    for (c = 0; c < 3; c++) {
        m[c] = p[2 * c] / p[2 * c + 1];
        m[3 + c] = 1;
        m[6 + c] = (1 - p[2 * c] - p[2 * c + 1]) / p[2 * c + 1];
    }
    tonemap__invert(inverse, m);
    for (c = 0; c < 3; c++) {
        double y = inverse[3 * c] * white[0] + inverse[3 * c + 1] * white[1] + inverse[3 * c + 2] * white[2];
        for (i = 0; i < 3; i++) m[3 * i + c] *= y;
    }
}

static inline void tonemap__prepare_colours(tonemap__colours *colours, const tonemap_options *o)
{
    static const double rec709[3] = {TONEMAP__LUMA}; /* what the other headers take */
    const double balance[3] = {o->balance_red, o->balance_green, o->balance_blue};
    double from[9], to[9], inverse[9];
    int i, c;
    tonemap__to_xyz(from, o->primaries);
    tonemap__to_xyz(to, o->display);
    tonemap__invert(inverse, to);
    colours->mixes = o->primaries != o->display;
    for (c = 0; c < 3; c++) {
        for (i = 0; i < 3; i++)
            colours->mix[3 * i + c] = (float)((inverse[3 * i] * from[c] + inverse[3 * i + 1] * from[3 + c] +
                                               inverse[3 * i + 2] * from[6 + c]) *
                                              balance[c]);
        colours->luma[c] = (float)((o->primaries == TONEMAP_PRIMARIES_709 ? rec709[c] : from[3 + c]) * balance[c]);
        if (balance[c] < 1 || balance[c] > 1) colours->mixes = 1;
        colours->red_x[c] = (float)to[c];
        colours->red_step[c] = (float)inverse[3 * c];
        colours->display_luma[c] = (float)to[3 + c];
    }
}

static inline void tonemap__frame_boxes(tonemap__frame *f, const tonemap_options *o, double key)
{
    static const int length[TONEMAP__LENGTHS] = {1, 3, 5, 7, 11, 17, 27, 41};
    int i;
    if (o->operation == TONEMAP_PHOTOGRAPHIC_LOCAL) {
        f->boxes = o->scales;
        for (i = 0; i < f->boxes; i++) {
            f->radius[i] = length[i] / 2;
            f->term[i] = (float)(o->epsilon * exp2(o->phi) * key / (length[i] * length[i]));
        }
    } else if (o->operation == TONEMAP_ASHIKHMIN) {
        f->boxes = 2 * TONEMAP__ASHIKHMIN;
        /* a box of the variance of a Gaussian whose standard deviation is s / 2 has length sqrt(3 s^2 + 1) */
        for (i = 1; i < f->boxes; i++) f->radius[i] = (int)((sqrt(3.0 * (i + 1) * (i + 1) + 1) - 1) / 2 + 0.5);
    } else {
        f->boxes = 1;
    }
    f->reach = f->radius[f->boxes - 1];
    f->inverse_cap = f->boxes > 1 || o->operation == TONEMAP_GUIDED ? 1 / f->cap : 0;
}

static inline void tonemap__prepare_frame(tonemap *map)
{
    const tonemap_options *o = &map->options;
    tonemap__frame *f = &map->frame;
    double average = map->started ? map->state[TONEMAP__AVERAGE] : 0,
           key = map->started ? exp2(map->state[TONEMAP__KEY]) : 0.18;
    double white = o->white > 0 ? o->white : exp2(map->state[TONEMAP__WHITE]);
    double cd;
    memset(f, 0, sizeof *f);
    if (o->exposure > 0)
        map->state[TONEMAP__AVERAGE] = average = log2(key / o->exposure); /* a meter starts from there */
    cd = o->cd_per_unit > 0 ? o->cd_per_unit : 10 / exp2(average);
    f->scale = (float)(o->exposure > 0 ? o->exposure : key * exp2(-average));
    f->cap = TONEMAP__LOCAL_CAP;
    f->quantum = TONEMAP__QUANTUM;
    f->inverse_white2 = !TONEMAP__HAS_WHITE || tonemap__is_infinite(white) ? 0 : (float)(o->peak / (white * white));
    f->epsilon = (float)o->epsilon;
    f->soft = (float)o->soft;
    f->peak = (float)o->peak;
    f->edge2 = (float)(o->edge * o->edge) * (TONEMAP__STEPS * TONEMAP__STEPS);
    f->gamut = o->gamut < 0 ? -1 : (float)o->gamut;
    f->curve_factor = o->operation == TONEMAP_LINEAR ? (float)(1 / o->peak) : 1;
    if (o->operation == TONEMAP_LINEAR && o->white > 0 && !tonemap__is_infinite(white))
        f->curve_factor = (float)(1 / white);
    if (tonemap__is_ashikhmin(o)) {
        double low = map->state[TONEMAP__LOW], high = map->state[TONEMAP__HIGH];
        f->scale = (float)exp2(-ceil(high)); /* whole octaves: a firefly does not round every pixel anew */
        f->cap = 1;
        f->quantum = TONEMAP__ASHIKHMIN_QUANTUM;
        f->cd = (float)(cd * exp2(ceil(high)));
        f->curve_low = tonemap__capacity((float)(cd * exp2(low)));
        f->curve_factor = 1 / (tonemap__capacity((float)(cd * exp2(high))) - f->curve_low);
        if (!tonemap__has_range(low, high))
            f->curve_low = f->curve_factor = 0; /* a flat picture has no range: it gets the key */
    }
    cd = (o->cd_per_unit > 0 ? o->cd_per_unit : 1 / exp2(average)) * o->lux_per_cd;
    f->lux = (float)(cd / (double)f->scale);
    f->rho =
        TONEMAP__HAS_MESOPIC && o->mesopic == TONEMAP_MESOPIC_UNIFORM ? tonemap__rho((float)(exp2(average) * cd)) : 1;
    tonemap__frame_boxes(f, o, key);
    map->stats.adapted = exp2(average);
    map->stats.key = key;
    map->stats.white = white;
}

/* ---- >> search: second pass: sums. A ring of rows of a summed-area table of the scaled luminance, rounded to a
   quantum and added modulo 2^32. A box never reaches further than the ring, and the difference of two sums is right
   wherever the sums began; so each worker begins its own, needs 42 rows of it instead of a table, and every box mean is
   exact. (sat.h's SAT_KIND_FIXED32 gives the same bits; it would cost a second pass over the picture and a table of its
   size.) */

static inline uint32_t *tonemap__ring_row(const tonemap *map, const tonemap__worker *w, int j)
{
    return w->sums + (size_t)(j % (2 * TONEMAP__BOXES + 2)) * (size_t)map->ring_row;
}

/* This and all loops in fours write up to three pixels beyond width or end: rows are longer than the picture. */
static inline void tonemap__quantise(int32_t *out, const float *luminance, int width, const tonemap__frame *f)
{
    sat__f32x4 scale = sat__f32x4_set1(f->scale), cap = sat__f32x4_set1(f->cap), quantum = sat__f32x4_set1(f->quantum);
    int x;
    for (x = 0; x < width; x += 4) {
        sat__f32x4 v = sat__f32x4_min(sat__f32x4_mul(sat__f32x4_load(luminance + x), scale), cap);
        sat__i32x4_store(out + x,
                         sat__f32x4_truncate(sat__f32x4_add(sat__f32x4_mul(v, quantum), sat__f32x4_set1(0.5f))));
    }
}

/* Row j + 1 of the ring from row j and the picture's row j. Columns left of the picture hold 0, those right of it the
   row's sum, so that boxes over the border need no case of their own. */
static inline void tonemap__add_ring_row(const tonemap *map, tonemap__worker *w, int j)
{
    const uint32_t *above = tonemap__ring_row(map, w, j) + TONEMAP__BOXES + 1;
    uint32_t *row = tonemap__ring_row(map, w, j + 1) + TONEMAP__BOXES + 1;
    int32_t *quanta = (int32_t *)(void *)w->edge;
    int x, end = map->ring_row - TONEMAP__BOXES - 1;
    tonemap__quantise(quanta, map->luminance + (size_t)j * (size_t)map->row, map->width, &map->frame);
    memset(row - TONEMAP__BOXES - 1, 0, (TONEMAP__BOXES + 1) * sizeof *row);
    sat__add_row(row, above, quanta, map->width);
    for (x = map->width; x < end; x++) row[x] = row[map->width - 1];
}

/* A row that is searched: its luminances, where La goes, and the boxes around its pixels: sums above and below, and the
   number of rows between them. */
typedef struct tonemap__window {
    const tonemap__frame *frame;
    const float *luminance;
    float *local;
    const uint32_t *top[TONEMAP__BOXES], *bottom[TONEMAP__BOXES]; /* both at x = 0 */
    int rows[TONEMAP__BOXES];
    float inverse[TONEMAP__BOXES]; /* 1 / (area quantum) of an unclipped row */
    int width;
} tonemap__window;

static inline void tonemap__open_window(tonemap__window *window, const tonemap *map, const tonemap__worker *w, int y)
{
    const tonemap__frame *f = &map->frame;
    int k;
    window->frame = f;
    window->luminance = map->luminance + (size_t)y * (size_t)map->row;
    window->local = w->local;
    window->width = map->width;
    for (k = 1; k < f->boxes; k++) {
        int r = f->radius[k], y0 = sat__max_int(y - r, 0), y1 = sat__min_int(y + r + 1, map->height);
        window->top[k] = tonemap__ring_row(map, w, y0) + TONEMAP__BOXES;
        window->bottom[k] = tonemap__ring_row(map, w, y1) + TONEMAP__BOXES;
        window->rows[k] = y1 - y0;
        window->inverse[k] = 1 / ((float)((y1 - y0) * (2 * r + 1)) * f->quantum);
    }
}

/* The inverse areas of four boxes of which some are clipped. */
static inline sat__f32x4 tonemap__inverse4(const tonemap__window *window, int k, int x)
{
    const tonemap__frame *f = window->frame;
    float inverse[4];
    int i, r = f->radius[k];
    for (i = 0; i < 4; i++) {
        int columns = sat__min_int(x + i + r + 1, window->width) - sat__max_int(x + i - r, 0);
        inverse[i] = 1 / ((float)(window->rows[k] * sat__max_int(columns, 1)) * f->quantum);
    }
    return sat__f32x4_load(inverse);
}

static inline sat__f32x4 tonemap__box_sum4(const tonemap__window *window, int k, int x)
{
    int r = window->frame->radius[k];
    const int32_t *top = (const int32_t *)(const void *)(window->top[k] + x),
                  *bottom = (const int32_t *)(const void *)(window->bottom[k] + x);
    return sat__i32x4_to_f32(
        sat__i32x4_sub(sat__i32x4_sub(sat__i32x4_load(bottom + r + 1), sat__i32x4_load(bottom - r)),
                       sat__i32x4_sub(sat__i32x4_load(top + r + 1), sat__i32x4_load(top - r))));
}

/* All ones where x + lane < end. */
static inline sat__i32x4 tonemap__inside4(int x, int end)
{
    static const int32_t lanes[4] = {0, 1, 2, 3};
    return sat__i32x4_greater(sat__i32x4_set1(end - x), sat__i32x4_load(lanes));
}

/* ---- the photographic operator's search for the largest even neighbourhood, eq A.5 to A.9

   Centre and surround of step k are the boxes k and k + 1; s of eq A.5 is the centre's length in pixels. The first step
   that fails gives its centre; when none fails, the last box is taken. (Eq A.7 does not say what happens when the first
   step fails; this is the reading under which it has an answer.) */

/* One step for four pixels: where it holds, the centre becomes the surround; else the pixel is done and keeps it. */
static inline sat__i32x4 tonemap__step4(sat__f32x4 *c, sat__i32x4 *live, sat__f32x4 v, sat__f32x4 epsilon,
                                        sat__f32x4 term)
{
    sat__f32x4 limit = sat__f32x4_add(sat__f32x4_mul(epsilon, *c), term);
    *live = sat__i32x4_and(*live, sat__f32x4_less(sat__f32x4_abs(sat__f32x4_sub(*c, v)), limit));
    *c = sat__f32x4_select(*live, v, *c);
    return *live;
}

/* Sixteen pixels, spelt out to stay in registers; done when the last of them is. */
static inline void tonemap__search_group(const tonemap__window *window, sat__i32x4 *passed, int x)
{
    const tonemap__frame *f = window->frame;
    const float *luminance = window->luminance;
    float *local = window->local;
    sat__f32x4 factor = sat__f32x4_set1(f->scale), cap = sat__f32x4_set1(f->cap), epsilon = sat__f32x4_set1(f->epsilon);
    sat__f32x4 c0 = sat__f32x4_min(sat__f32x4_mul(sat__f32x4_load(luminance + x), factor), cap);
    sat__f32x4 c1 = sat__f32x4_min(sat__f32x4_mul(sat__f32x4_load(luminance + x + 4), factor), cap);
    sat__f32x4 c2 = sat__f32x4_min(sat__f32x4_mul(sat__f32x4_load(luminance + x + 8), factor), cap);
    sat__f32x4 c3 = sat__f32x4_min(sat__f32x4_mul(sat__f32x4_load(luminance + x + 12), factor), cap);
    sat__i32x4 live0 = sat__i32x4_set1(-1), live1 = live0, live2 = live0, live3 = live0, alive;
    int k;
    for (k = 0; k + 1 < f->boxes; k++) {
        sat__f32x4 inverse = sat__f32x4_set1(window->inverse[k + 1]), term = sat__f32x4_set1(f->term[k]);
        alive =
            tonemap__step4(&c0, &live0, sat__f32x4_mul(tonemap__box_sum4(window, k + 1, x), inverse), epsilon, term);
        alive = sat__i32x4_add(
            alive, tonemap__step4(&c1, &live1, sat__f32x4_mul(tonemap__box_sum4(window, k + 1, x + 4), inverse),
                                  epsilon, term));
        alive = sat__i32x4_add(
            alive, tonemap__step4(&c2, &live2, sat__f32x4_mul(tonemap__box_sum4(window, k + 1, x + 8), inverse),
                                  epsilon, term));
        alive = sat__i32x4_add(
            alive, tonemap__step4(&c3, &live3, sat__f32x4_mul(tonemap__box_sum4(window, k + 1, x + 12), inverse),
                                  epsilon, term));
        if (!sat__i32x4_any(alive)) break;
        passed[k] = sat__i32x4_sub(passed[k], alive);
    }
    sat__f32x4_store(local + x, c0);
    sat__f32x4_store(local + x + 4, c1);
    sat__f32x4_store(local + x + 8, c2);
    sat__f32x4_store(local + x + 12, c3);
}

/* Four pixels, where boxes are clipped or a run ends. */
static inline void tonemap__search_four(const tonemap__window *window, sat__i32x4 *passed, int x, int end)
{
    const tonemap__frame *f = window->frame;
    sat__f32x4 epsilon = sat__f32x4_set1(f->epsilon),
               c = sat__f32x4_mul(sat__f32x4_load(window->luminance + x), sat__f32x4_set1(f->scale));
    sat__i32x4 live = tonemap__inside4(x, end);
    int k, border = x < f->reach || x + 4 + f->reach > window->width;
    c = sat__f32x4_min(c, sat__f32x4_set1(f->cap));
    for (k = 0; k + 1 < f->boxes; k++) {
        sat__f32x4 inverse = border ? tonemap__inverse4(window, k + 1, x) : sat__f32x4_set1(window->inverse[k + 1]);
        sat__f32x4 v = sat__f32x4_mul(tonemap__box_sum4(window, k + 1, x), inverse);
        tonemap__step4(&c, &live, v, epsilon, sat__f32x4_set1(f->term[k]));
        if (!sat__i32x4_any(live)) break;
        passed[k] = sat__i32x4_sub(passed[k], live);
    }
    sat__f32x4_store(window->local + x, c);
}

/* What passed step k moves on from scale k to k + 1 of the statistics. */
static inline void tonemap__move_on(size_t *scale, const sat__i32x4 *passed, int steps)
{
    int k;
    for (k = 0; k < steps; k++) {
        int32_t n[4];
        sat__i32x4_store(n, passed[k]);
        scale[k] -= (size_t)(n[0] + n[1] + n[2] + n[3]);
        scale[k + 1] += (size_t)(n[0] + n[1] + n[2] + n[3]);
    }
}

static inline void tonemap__search_hard(const tonemap__window *window, size_t *scale, int x, int end)
{
    const tonemap__frame *f = window->frame;
    sat__i32x4 passed[TONEMAP__LENGTHS];
    int k;
    for (k = 0; k < TONEMAP__LENGTHS; k++) passed[k] = sat__i32x4_set1(0);
    while (x < end) {
        if (x >= f->reach && x + TONEMAP__GROUP <= end && x + TONEMAP__GROUP + f->reach <= window->width) {
            tonemap__search_group(window, passed, x);
            x += TONEMAP__GROUP;
        } else {
            tonemap__search_four(window, passed, x, end);
            x += 4;
        }
    }
    tonemap__move_on(scale, passed, f->boxes - 1);
}

/* The same with scales mixed: the weight of what lies beyond a step falls from 1 to 0 while the step's contrast grows
   through a band around epsilon, so that noise moves La a little instead of across a scale. One step for four pixels:
   whether some are not done. */
static inline sat__i32x4 tonemap__soft_step4(sat__f32x4 *c, sat__f32x4 *taken, sat__f32x4 *weight, sat__f32x4 v,
                                             const tonemap__frame *f, int k)
{
    sat__f32x4 limit = sat__f32x4_add(sat__f32x4_mul(sat__f32x4_set1(f->epsilon), *c), sat__f32x4_set1(f->term[k])),
               difference = sat__f32x4_sub(v, *c);
    sat__f32x4 pass = sat__f32x4_sub(sat__f32x4_set1(1 + f->soft), sat__f32x4_div(sat__f32x4_abs(difference), limit));
    pass = sat__f32x4_mul(pass, sat__f32x4_set1(1 / (2 * f->soft)));
    *weight = sat__f32x4_mul(*weight, sat__f32x4_min(sat__f32x4_max(pass, sat__f32x4_set1(0)), sat__f32x4_set1(1)));
    *taken = sat__f32x4_add(*taken, sat__f32x4_mul(*weight, difference));
    *c = v;
    return sat__f32x4_less(sat__f32x4_set1(0), *weight);
}

/* Sixteen pixels, spelt out to stay in registers; done when the last of them is. */
static inline void tonemap__soft_group(const tonemap__window *window, sat__i32x4 *passed, int x)
{
    const tonemap__frame *f = window->frame;
    const float *luminance = window->luminance;
    float *local = window->local;
    sat__f32x4 factor = sat__f32x4_set1(f->scale), cap = sat__f32x4_set1(f->cap), half = sat__f32x4_set1(0.5f);
    sat__f32x4 c0 = sat__f32x4_min(sat__f32x4_mul(sat__f32x4_load(luminance + x), factor), cap), t0 = c0,
               w0 = sat__f32x4_set1(1);
    sat__f32x4 c1 = sat__f32x4_min(sat__f32x4_mul(sat__f32x4_load(luminance + x + 4), factor), cap), t1 = c1, w1 = w0;
    sat__f32x4 c2 = sat__f32x4_min(sat__f32x4_mul(sat__f32x4_load(luminance + x + 8), factor), cap), t2 = c2, w2 = w0;
    sat__f32x4 c3 = sat__f32x4_min(sat__f32x4_mul(sat__f32x4_load(luminance + x + 12), factor), cap), t3 = c3, w3 = w0;
    int k;
    for (k = 0; k + 1 < f->boxes; k++) {
        sat__f32x4 inverse = sat__f32x4_set1(window->inverse[k + 1]);
        sat__i32x4 alive, n;
        alive =
            tonemap__soft_step4(&c0, &t0, &w0, sat__f32x4_mul(tonemap__box_sum4(window, k + 1, x), inverse), f, k);
        alive = sat__i32x4_or(
            alive, tonemap__soft_step4(&c1, &t1, &w1,
                                       sat__f32x4_mul(tonemap__box_sum4(window, k + 1, x + 4), inverse), f, k));
        alive = sat__i32x4_or(
            alive, tonemap__soft_step4(&c2, &t2, &w2,
                                       sat__f32x4_mul(tonemap__box_sum4(window, k + 1, x + 8), inverse), f, k));
        alive = sat__i32x4_or(
            alive, tonemap__soft_step4(&c3, &t3, &w3,
                                       sat__f32x4_mul(tonemap__box_sum4(window, k + 1, x + 12), inverse), f, k));
        if (!sat__i32x4_any(alive)) break;
        n = sat__i32x4_add(sat__f32x4_less_equal(half, w0), sat__f32x4_less_equal(half, w1));
        n = sat__i32x4_add(n, sat__i32x4_add(sat__f32x4_less_equal(half, w2), sat__f32x4_less_equal(half, w3)));
        passed[k] = sat__i32x4_sub(passed[k], n);
    }
    sat__f32x4_store(local + x, t0);
    sat__f32x4_store(local + x + 4, t1);
    sat__f32x4_store(local + x + 8, t2);
    sat__f32x4_store(local + x + 12, t3);
}

/* Four pixels, where boxes are clipped or a run ends. */
static inline void tonemap__soft_four(const tonemap__window *window, sat__i32x4 *passed, int x, int end)
{
    const tonemap__frame *f = window->frame;
    sat__f32x4 c = sat__f32x4_min(sat__f32x4_mul(sat__f32x4_load(window->luminance + x), sat__f32x4_set1(f->scale)),
                                  sat__f32x4_set1(f->cap)),
               taken = c;
    sat__f32x4 weight = sat__f32x4_select(tonemap__inside4(x, end), sat__f32x4_set1(1), sat__f32x4_set1(0));
    int k, border = x < f->reach || x + 4 + f->reach > window->width;
    for (k = 0; k + 1 < f->boxes; k++) {
        sat__f32x4 inverse = border ? tonemap__inverse4(window, k + 1, x) : sat__f32x4_set1(window->inverse[k + 1]);
        if (!sat__i32x4_any(tonemap__soft_step4(&c, &taken, &weight,
                                                sat__f32x4_mul(tonemap__box_sum4(window, k + 1, x), inverse), f, k)))
            break;
        passed[k] = sat__i32x4_sub(passed[k], sat__f32x4_less_equal(sat__f32x4_set1(0.5f), weight));
    }
    sat__f32x4_store(window->local + x, taken);
}

static inline void tonemap__search_soft(const tonemap__window *window, size_t *scale, int x, int end)
{
    const tonemap__frame *f = window->frame;
    sat__i32x4 passed[TONEMAP__LENGTHS];
    int k;
    for (k = 0; k < TONEMAP__LENGTHS; k++) passed[k] = sat__i32x4_set1(0);
    while (x < end) {
        if (x >= f->reach && x + TONEMAP__GROUP <= end && x + TONEMAP__GROUP + f->reach <= window->width) {
            tonemap__soft_group(window, passed, x);
            x += TONEMAP__GROUP;
        } else {
            tonemap__soft_four(window, passed, x, end);
            x += 4;
        }
    }
    tonemap__move_on(scale, passed, f->boxes - 1);
}

/* ---- Ashikhmin's search: the first neighbourhood s = 1..10 whose mean differs from that of twice its size by half of
   itself; else the last. A mean below the quantum says nothing: the pixel then stands for itself. */

static inline void tonemap__search_ashikhmin(const tonemap__window *window, size_t *scale, int x, int end)
{
    const tonemap__frame *f = window->frame;
    const float *luminance = window->luminance;
    sat__f32x4 half = sat__f32x4_set1(0.5f), quantum = sat__f32x4_set1(1 / f->quantum);
    sat__i32x4 passed[TONEMAP__ASHIKHMIN];
    int s;
    for (s = 0; s < TONEMAP__ASHIKHMIN; s++) passed[s] = sat__i32x4_set1(0);
    for (; x < end; x += 4) {
        int border = x < f->reach || x + 4 + f->reach > window->width;
        sat__f32x4 own = sat__f32x4_mul(sat__f32x4_load(luminance + x), sat__f32x4_set1(f->scale));
        sat__f32x4 g = sat__f32x4_min(own, sat__f32x4_set1(f->cap)), taken = g;
        sat__i32x4 live = tonemap__inside4(x, end);
        for (s = 0; s + 1 < TONEMAP__ASHIKHMIN; s++) {
            int k = 2 * s + 1;
            sat__f32x4 wide =
                sat__f32x4_mul(tonemap__box_sum4(window, k, x),
                               border ? tonemap__inverse4(window, k, x) : sat__f32x4_set1(window->inverse[k]));
            live =
                sat__i32x4_and(live, sat__f32x4_less(sat__f32x4_abs(sat__f32x4_sub(g, wide)), sat__f32x4_mul(half, g)));
            if (!sat__i32x4_any(live)) break;
            k = s + 1;
            g = sat__f32x4_mul(tonemap__box_sum4(window, k, x),
                               border ? tonemap__inverse4(window, k, x) : sat__f32x4_set1(window->inverse[k]));
            taken = sat__f32x4_select(live, g, taken);
            passed[s] = sat__i32x4_sub(passed[s], live);
        }
        sat__f32x4_store(window->local + x, sat__f32x4_select(sat__f32x4_less(taken, quantum), own, taken));
    }
    tonemap__move_on(scale, passed, TONEMAP__ASHIKHMIN - 1);
}

/* Searches pixels [x, end) of a row and may overwrite what follows them in the group. */
static inline void tonemap__search(tonemap__worker *w, const tonemap__window *window, int ashikhmin, int x, int end)
{
    size_t *scale = w->stats.scale;
    scale[0] += (size_t)(end - x);
    if (TONEMAP__HAS_ASHIKHMIN && ashikhmin) tonemap__search_ashikhmin(window, scale, x, end);
    else if (TONEMAP__HAS_SOFT && window->frame->soft > 0) tonemap__search_soft(window, scale, x, end);
    else tonemap__search_hard(window, scale, x, end);
    w->stats.searched += (size_t)(end - x);
}

/* ---- selective tone mapping (Michael 2010, section 4.4): the squared Sobel gradient of the luminance; outside the
   picture its border goes on */

static inline float tonemap__sobel(const float *above, const float *row, const float *below, int left, int x, int right)
{
    float gx = (above[right] + 2 * row[right] + below[right]) - (above[left] + 2 * row[left] + below[left]);
    float gy = (below[left] + 2 * below[x] + below[right]) - (above[left] + 2 * above[x] + above[right]);
    return gx * gx + gy * gy;
}

static inline void tonemap__sobel_row(float *out, const float *above, const float *row, const float *below, int width)
{
    int x;
    out[0] = tonemap__sobel(above, row, below, 0, 0, 1);
    for (x = 1; x < width; x += 4) {
        sat__f32x4 a0 = sat__f32x4_load(above + x - 1), a1 = sat__f32x4_load(above + x),
                   a2 = sat__f32x4_load(above + x + 1);
        sat__f32x4 b0 = sat__f32x4_load(below + x - 1), b1 = sat__f32x4_load(below + x),
                   b2 = sat__f32x4_load(below + x + 1);
        sat__f32x4 r0 = sat__f32x4_load(row + x - 1), r2 = sat__f32x4_load(row + x + 1), two = sat__f32x4_set1(2);
        sat__f32x4 gx = sat__f32x4_sub(sat__f32x4_add(sat__f32x4_add(a2, sat__f32x4_mul(two, r2)), b2),
                                       sat__f32x4_add(sat__f32x4_add(a0, sat__f32x4_mul(two, r0)), b0));
        sat__f32x4 gy = sat__f32x4_sub(sat__f32x4_add(sat__f32x4_add(b0, sat__f32x4_mul(two, b1)), b2),
                                       sat__f32x4_add(sat__f32x4_add(a0, sat__f32x4_mul(two, a1)), a2));
        sat__f32x4_store(out + x, sat__f32x4_add(sat__f32x4_mul(gx, gx), sat__f32x4_mul(gy, gy)));
    }
}

/* ---- >> guided filter: the guided filter (He 2013, eq 5, 6 and 8 with the picture as its own guide), on q = log2 of
   the scaled luminance

   Around each pixel a = var / (var + edge^2) and b = mean (1 - a), over 21 x 21 pixels; La = exp2(mean(a) q + mean(b)),
   over as many. Where light varies less than edge, a is small and La the mean around; across an edge a is 1 and La the
   pixel's own: nothing leaks over it, and nothing is chosen that could flicker. All sums are of integers modulo 2^32:
   columns of 21 rows, to which a row is added and one taken away, then along the row. */

/* Rows are kept as long as they are in a sum: 0: steps, 1: a, 2: b; 3: sums along two rows. */
static inline uint32_t *tonemap__guided_ring(const tonemap *map, const tonemap__worker *w, int which, int j)
{
    int row = which * TONEMAP__GUIDED_ROWS + (which < 3 ? j % TONEMAP__GUIDED_ROWS : j);
    return w->sums + (size_t)row * (size_t)map->ring_row + TONEMAP__BOXES;
}

/* Steps above the darkest of the scaled luminances of row j. A pixel that is no measurement counts as the one to its
   left, or as the first usable one. */
static inline void tonemap__steps_row(float *out, const tonemap *map, int j)
{
    const float *luminance = map->luminance + (size_t)j * (size_t)map->row;
    sat__f32x4 offset = sat__f32x4_set1(TONEMAP__OCTAVES), steps = sat__f32x4_set1(TONEMAP__STEPS);
    int x, last;
    for (x = 0; x < map->row; x += 4) {
        sat__f32x4 v = sat__f32x4_mul(sat__f32x4_load(luminance + x), sat__f32x4_set1(map->frame.scale));
        v = sat__f32x4_max(sat__f32x4_min(v, sat__f32x4_set1(TONEMAP__LOCAL_CAP)), sat__f32x4_set1(1 / 1024.0f));
        sat__f32x4_store(out + x, sat__f32x4_mul(sat__f32x4_add(tonemap__log2_4(v), offset), steps));
    }
    if (!(map->row_odd[j] & 1)) return;
    for (last = 0; last < map->width && sat__float_bits(luminance[last]) == TONEMAP__UNUSABLE; last++) {}
    if (last == map->width) last = 0;
    for (x = 0; x < map->width; x++) {
        if (sat__float_bits(luminance[x]) == TONEMAP__UNUSABLE) out[x] = out[last];
        else last = x;
    }
}

/* Adds what enters to the columns' sums of steps and of their squares, and takes away what leaves. */
static inline void tonemap__move_steps(uint32_t *sum, uint32_t *square, const float *enters, const float *leaves,
                                       int width)
{
    int32_t *s = (int32_t *)(void *)sum, *s2 = (int32_t *)(void *)square;
    int x;
    for (x = 0; x < width; x += 4) {
        sat__i32x4 q = sat__f32x4_truncate(sat__f32x4_load(enters + x)),
                   old = sat__f32x4_truncate(sat__f32x4_load(leaves + x));
        sat__f32x4 v = sat__i32x4_to_f32(q), v_old = sat__i32x4_to_f32(old); /* squares below 2^24 are exact */
        v = sat__f32x4_sub(sat__f32x4_mul(v, v), sat__f32x4_mul(v_old, v_old));
        sat__i32x4_store(s + x, sat__i32x4_add(sat__i32x4_load(s + x), sat__i32x4_sub(q, old)));
        sat__i32x4_store(s2 + x, sat__i32x4_add(sat__i32x4_load(s2 + x), sat__f32x4_truncate(v)));
    }
}

static inline void tonemap__move_sums(uint32_t *sum, const uint32_t *enters, const uint32_t *leaves, int width)
{
    int32_t *s = (int32_t *)(void *)sum;
    const int32_t *in = (const int32_t *)(const void *)enters, *out = (const int32_t *)(const void *)leaves;
    int x;
    for (x = 0; x < width; x += 4)
        sat__i32x4_store(s + x, sat__i32x4_add(sat__i32x4_load(s + x),
                                               sat__i32x4_sub(sat__i32x4_load(in + x), sat__i32x4_load(out + x))));
}

/* Sums along two rows: entry x is what lies left of x, so that a box is a difference. Before the row stand zeros,
   behind it the whole. */
static inline void tonemap__add_along(uint32_t *sum0, uint32_t *sum1, const uint32_t *column0, const uint32_t *column1,
                                      int width)
{
    uint32_t s0 = 0, s1 = 0;
    int x;
    memset(sum0 - TONEMAP__RADIUS, 0, TONEMAP__RADIUS * sizeof *sum0);
    memset(sum1 - TONEMAP__RADIUS, 0, TONEMAP__RADIUS * sizeof *sum1);
    for (x = 0; x < width; x++) {
        sum0[x] = s0;
        sum1[x] = s1;
        s0 += column0[x];
        s1 += column1[x];
    }
    for (; x < width + TONEMAP__RADIUS + 1; x++) {
        sum0[x] = s0;
        sum1[x] = s1;
    }
}

/* Pixels [x, end) of a row whose boxes have one area: 1 / area. It changes at each pixel beside the borders. */
typedef struct tonemap__run { int x, end; float inverse; } tonemap__run;

/* The run that begins at x. */
static inline tonemap__run tonemap__guided_run(int x, int width, int rows)
{
    int x0 = sat__max_int(x - TONEMAP__RADIUS, 0), x1 = sat__min_int(x + TONEMAP__RADIUS + 1, width);
    tonemap__run run;
    run.x = x;
    run.end = x1 - x0 < 2 * TONEMAP__RADIUS + 1 ? x + 1 : width - TONEMAP__RADIUS;
    run.inverse = 1 / (float)(rows * (x1 - x0));
    return run;
}

/* a in 2^-20 and b in 2^-10 steps. */
static inline void tonemap__guided_fit(uint32_t *a, uint32_t *b, const uint32_t *sum, const uint32_t *square,
                                       const tonemap__run *run, float edge2)
{
    const int32_t *s = (const int32_t *)(const void *)sum, *s2 = (const int32_t *)(const void *)square;
    int r = TONEMAP__RADIUS, x;
    for (x = run->x; x < run->end; x += 4) {
        sat__f32x4 i = sat__f32x4_set1(run->inverse), half = sat__f32x4_set1(0.5f), share, mean, var;
        mean = sat__f32x4_mul(
            sat__i32x4_to_f32(sat__i32x4_sub(sat__i32x4_load(s + x + r + 1), sat__i32x4_load(s + x - r))), i);
        var = sat__f32x4_mul(
            sat__i32x4_to_f32(sat__i32x4_sub(sat__i32x4_load(s2 + x + r + 1), sat__i32x4_load(s2 + x - r))), i);
        var = sat__f32x4_max(sat__f32x4_sub(var, sat__f32x4_mul(mean, mean)), sat__f32x4_set1(0));
        share = sat__f32x4_div(var, sat__f32x4_add(var, sat__f32x4_set1(edge2)));
        mean = sat__f32x4_mul(sat__f32x4_add(mean, half), sat__f32x4_sub(sat__f32x4_set1(1), share));
        sat__i32x4_store((int32_t *)(void *)(a + x),
                         sat__f32x4_truncate(sat__f32x4_mul(share, sat__f32x4_set1(1048576.0f))));
        sat__i32x4_store((int32_t *)(void *)(b + x),
                         sat__f32x4_truncate(sat__f32x4_mul(mean, sat__f32x4_set1(1024.0f))));
    }
}

static inline void tonemap__guided_local(float *local, const float *steps, const uint32_t *a, const uint32_t *b,
                                         const tonemap__run *run)
{
    int r = TONEMAP__RADIUS, x;
    float share = run->inverse / (1048576.0f * TONEMAP__STEPS), base = run->inverse / (1024.0f * TONEMAP__STEPS);
    const int32_t *sa = (const int32_t *)(const void *)a, *sb = (const int32_t *)(const void *)b;
    for (x = run->x; x < run->end; x += 4) {
        sat__f32x4 va = sat__i32x4_to_f32(sat__i32x4_sub(sat__i32x4_load(sa + x + r + 1), sat__i32x4_load(sa + x - r)));
        sat__f32x4 vb = sat__i32x4_to_f32(sat__i32x4_sub(sat__i32x4_load(sb + x + r + 1), sat__i32x4_load(sb + x - r)));
        va = sat__f32x4_mul(sat__f32x4_mul(va, sat__f32x4_set1(share)), sat__f32x4_load(steps + x));
        vb = sat__f32x4_sub(sat__f32x4_mul(vb, sat__f32x4_set1(base)), sat__f32x4_set1(TONEMAP__OCTAVES));
        sat__f32x4_store(local + x, tonemap__exp2_4(sat__f32x4_add(va, vb)));
    }
}

static inline int tonemap__guided_rows(const tonemap *map, int y)
{
    return sat__min_int(y + TONEMAP__RADIUS + 1, map->height) - sat__max_int(y - TONEMAP__RADIUS, 0);
}

/* Row m of a and b; first: the first row of them that this piece of work needs. */
static inline void tonemap__guided_row(const tonemap *map, tonemap__worker *w, int m, int first)
{
    enum { R = TONEMAP__RADIUS };
    int j = m > first ? m + R : sat__max_int(m - R, 0), begin = sat__max_int(first - R, 0), x, which;
    uint32_t *sum = tonemap__guided_ring(map, w, 3, 0), *square = tonemap__guided_ring(map, w, 3, 1);
    tonemap__run run;
    if (m == first)
        for (which = 0; which < 4; which++) memset(w->column[which], 0, (size_t)map->row * sizeof(uint32_t));
    for (; j <= m + R; j++) {
        int leaves = j - 2 * R - 1;
        float *enters = (float *)(void *)tonemap__guided_ring(map, w, 0, j);
        if (j < map->height) tonemap__steps_row(enters, map, j);
        else memset(enters, 0, (size_t)map->row * sizeof *enters);
        tonemap__move_steps(w->column[0], w->column[1], enters,
                            leaves < begin ? w->nothing
                                           : (const float *)(const void *)tonemap__guided_ring(map, w, 0, leaves),
                            map->width);
    }
    tonemap__add_along(sum, square, w->column[0], w->column[1], map->width);
    for (x = 0; x < map->width; x = run.end) {
        run = tonemap__guided_run(x, map->width, tonemap__guided_rows(map, m));
        tonemap__guided_fit(tonemap__guided_ring(map, w, 1, m), tonemap__guided_ring(map, w, 2, m), sum, square, &run,
                            map->frame.edge2);
    }
}

/* La of row y. */
static inline void tonemap__guided_local_row(const tonemap *map, tonemap__worker *w, int y, int first)
{
    enum { R = TONEMAP__RADIUS };
    int begin = sat__max_int(first - R, 0), m = y > first ? y + R : begin, x, which;
    uint32_t *sum[2];
    tonemap__run run;
    for (; m <= y + R; m++) {
        if (m < map->height) tonemap__guided_row(map, w, m, begin);
        for (which = 0; which < 2; which++) {
            uint32_t *enters = tonemap__guided_ring(map, w, 1 + which, m);
            if (m >= map->height) memset(enters, 0, (size_t)map->row * sizeof *enters);
            tonemap__move_sums(w->column[2 + which], enters,
                               m - 2 * R - 1 < begin ? (const uint32_t *)(const void *)w->nothing
                                                     : tonemap__guided_ring(map, w, 1 + which, m - 2 * R - 1),
                               map->width);
        }
    }
    for (which = 0; which < 2; which++) sum[which] = tonemap__guided_ring(map, w, 3, which);
    tonemap__add_along(sum[0], sum[1], w->column[2], w->column[3], map->width);
    for (x = 0; x < map->width; x = run.end) {
        run = tonemap__guided_run(x, map->width, tonemap__guided_rows(map, y));
        tonemap__guided_local(w->local, (const float *)(const void *)tonemap__guided_ring(map, w, 0, y), sum[0], sum[1],
                              &run);
    }
}

/* ---- La for one row */

/* A row and what its pixels take for themselves: the scaled luminance up to a cap. `edge`: squared gradients, and the
   threshold below which a pixel is not worth a search. */
typedef struct tonemap__own {
    float *local;
    const float *luminance, *edge;
    float scale, cap, threshold;
} tonemap__own;

/* What the global operators take, and, capped as in the sums, pixels that are not worth a search. */
static inline void tonemap__own_luminance(const tonemap__own *own, int x, int end)
{
    const sat__f32x4 scale = sat__f32x4_set1(own->scale), cap = sat__f32x4_set1(own->cap);
    for (; x < end; x += 4)
        sat__f32x4_store(own->local + x,
                         sat__f32x4_min(sat__f32x4_mul(sat__f32x4_load(own->luminance + x), scale), cap));
}

/* Some squared gradient of [x, end) is above the threshold. */
static inline int tonemap__has_edge(const tonemap__own *own, int x, int end)
{
    const sat__f32x4 threshold = sat__f32x4_set1(own->threshold);
    sat__i32x4 above = sat__i32x4_set1(0);
    for (; x < end; x += 4)
        above = sat__i32x4_or(above, sat__i32x4_and(tonemap__inside4(x, end),
                                                    sat__f32x4_less(threshold, sat__f32x4_load(own->edge + x))));
    return sat__i32x4_any(above);
}

/* Where it is not, the pixel stands for itself. */
static inline void tonemap__reset_flat(const tonemap__own *own, int x, int end)
{
    const sat__f32x4 threshold = sat__f32x4_set1(own->threshold), scale = sat__f32x4_set1(own->scale),
                     cap = sat__f32x4_set1(own->cap);
    for (; x < end; x += 4) {
        sat__i32x4 above = sat__f32x4_less(threshold, sat__f32x4_load(own->edge + x));
        sat__f32x4 v = sat__f32x4_min(sat__f32x4_mul(sat__f32x4_load(own->luminance + x), scale), cap);
        sat__f32x4_store(own->local + x, sat__f32x4_select(above, sat__f32x4_load(own->local + x), v));
    }
}

static inline void tonemap__search_edges(tonemap *map, tonemap__worker *w, const tonemap__window *window, int y)
{
    const float *luminance = window->luminance, *above = y > 0 ? luminance - map->row : luminance,
                *below = y + 1 < map->height ? luminance + map->row : luminance;
    tonemap__own own;
    int x, end;
    own.local = w->local;
    own.luminance = luminance;
    own.edge = w->edge;
    own.scale = map->frame.scale;
    own.cap = map->frame.cap;
    own.threshold = (float)map->options.selective / own.scale;
    own.threshold *= own.threshold;
    tonemap__sobel_row(w->edge, above, luminance, below, map->width);
    for (x = 0; x < map->width; x = end) {
        end = sat__min_int(x + TONEMAP__GROUP, map->width);
        if (tonemap__has_edge(&own, x, end)) {
            tonemap__search(w, window, map->options.operation == TONEMAP_ASHIKHMIN, x, end);
            tonemap__reset_flat(&own, x, end);
        } else {
            tonemap__own_luminance(&own, x, end);
            w->stats.skipped += (size_t)(end - x);
        }
    }
}

static inline void tonemap__local_row(tonemap *map, tonemap__worker *w, int y, int first)
{
    const tonemap_options *o = &map->options;
    tonemap__window window;
    if (o->operation == TONEMAP_GUIDED) {
        tonemap__guided_local_row(map, w, y, first);
        return;
    }
    if (map->frame.boxes < 2) {
        tonemap__own own = {NULL, NULL, NULL, 0, FLT_MAX, 0};
        own.local = w->local;
        own.luminance = map->luminance + (size_t)y * (size_t)map->row;
        own.scale = map->frame.scale;
        tonemap__own_luminance(&own, 0, map->width);
        return;
    }
    tonemap__open_window(&window, map, w, y);
    if (TONEMAP__HAS_SELECTIVE && o->selective > 0) tonemap__search_edges(map, w, &window, y);
    else tonemap__search(w, &window, o->operation == TONEMAP_ASHIKHMIN, 0, map->width);
}

/* ---- >> mesopic vision

   Eq A.12 scales a > 0 of Lab by rho; L and b stay. Y then stays, so Z does, and only X moves. With the pixel's own
   luminance as the white of Lab (which makes the result independent of exposure) q = X / (Xn Y), a > 0 means q > 1, and
   X' = Xn Y (1 + rho (cbrt q - 1))^3: one cube root in place of two conversions. */

static inline void tonemap__rho_row(float *rho, const float *local, float lux, int end)
{
    int x;
    sat__f32x4 one = sat__f32x4_set1(1), ten = sat__f32x4_set1(10), least = sat__f32x4_set1(TONEMAP__RHO_LOW);
    for (x = 0; x < end; x += 4) {
        sat__f32x4 i = sat__f32x4_max(sat__f32x4_mul(sat__f32x4_load(local + x), sat__f32x4_set1(lux)), least), t, u, q;
        sat__i32x4 bits = sat__f32x4_bits(i), dim = sat__f32x4_less(i, ten);
        if (!sat__i32x4_any(dim)) {
            sat__f32x4_store(rho + x, one);
            continue;
        }
        t = tonemap__octave4(bits);
        u = sat__f32x4_add(sat__f32x4_set1(0.422865337f), sat__f32x4_mul(t, sat__f32x4_set1(-0.159220122f)));
        u = sat__f32x4_mul(sat__f32x4_mul(t, sat__f32x4_sub(one, t)), u);
        t = sat__f32x4_mul(sat__i32x4_to_f32(sat__i32x4_sub(bits, sat__i32x4_set1(0x3f800000))),
                           sat__f32x4_set1(1.1920929e-7f));
        u = sat__f32x4_mul(sat__f32x4_sub(sat__f32x4_add(t, u), sat__f32x4_set1(TONEMAP__RHO_CENTRE)),
                           sat__f32x4_set1(TONEMAP__RHO_WIDTH));
        q = sat__f32x4_add(sat__f32x4_mul(u, sat__f32x4_set1(-0.0893071936f)), sat__f32x4_set1(-0.150544156f));
        q = sat__f32x4_add(sat__f32x4_mul(u, q), sat__f32x4_set1(0.0254077498f));
        q = sat__f32x4_add(sat__f32x4_mul(u, q), sat__f32x4_set1(0.287330944f));
        q = sat__f32x4_add(sat__f32x4_mul(u, q), sat__f32x4_set1(0.475713817f));
        q = sat__f32x4_add(sat__f32x4_mul(u, q), sat__f32x4_set1(0.582037485f));
        q = sat__f32x4_add(one, sat__f32x4_mul(sat__f32x4_sub(u, one), q));
        sat__f32x4_store(rho + x, sat__f32x4_select(dim, q, one));
    }
}

/* Halley; error below 3e-5 */
static inline sat__f32x4 tonemap__cbrt4(sat__f32x4 q)
{
    sat__i32x4 third =
        sat__f32x4_truncate(sat__f32x4_mul(sat__i32x4_to_f32(sat__f32x4_bits(q)), sat__f32x4_set1(1 / 3.0f)));
    sat__f32x4 y = sat__f32x4_from_bits(sat__i32x4_add(third, sat__i32x4_set1(0x2a514067))),
               y3 = sat__f32x4_mul(sat__f32x4_mul(y, y), y);
    sat__f32x4 two = sat__f32x4_set1(2);
    return sat__f32x4_mul(
        y, sat__f32x4_div(sat__f32x4_add(y3, sat__f32x4_mul(two, q)), sat__f32x4_add(sat__f32x4_mul(two, y3), q)));
}

/* cbrt(q) - 1 for q > 1: a polynomial within 7e-5 up to 2.65, beyond the bluest colour of Rec. 709. */
static inline sat__f32x4 tonemap__root4(sat__f32x4 q)
{
    sat__f32x4 v = sat__f32x4_sub(q, sat__f32x4_set1(1)), p;
    sat__i32x4 far_out = sat__f32x4_less(sat__f32x4_set1(2.65f), q);
    p = sat__f32x4_add(sat__f32x4_set1(0.0339404425f), sat__f32x4_mul(v, sat__f32x4_set1(-0.00595350893f)));
    p = sat__f32x4_add(sat__f32x4_set1(-0.0999134065f), sat__f32x4_mul(v, p));
    p = sat__f32x4_mul(v, sat__f32x4_add(sat__f32x4_set1(0.331779718f), sat__f32x4_mul(v, p)));
    return sat__i32x4_any(far_out)
               ? sat__f32x4_select(far_out, sat__f32x4_sub(tonemap__cbrt4(q), sat__f32x4_set1(1)), p)
               : p;
}

static inline void tonemap__shift_red4(sat__f32x4 *v, sat__f32x4 luminance, sat__f32x4 rho, const tonemap__colours *f)
{
    sat__f32x4 one = sat__f32x4_set1(1), x = sat__f32x4_add(sat__f32x4_mul(sat__f32x4_set1(f->red_x[0]), v[0]),
                                                            sat__f32x4_mul(sat__f32x4_set1(f->red_x[1]), v[1]));
    sat__f32x4 y = sat__f32x4_mul(sat__f32x4_set1(TONEMAP__WHITE_X), luminance), q, c, dx;
    sat__i32x4 red;
    int i;
    x = sat__f32x4_add(x, sat__f32x4_mul(sat__f32x4_set1(f->red_x[2]), v[2]));
    red = sat__i32x4_and(sat__f32x4_less(y, x), sat__f32x4_less(rho, one));
    if (!sat__i32x4_any(red)) return;
    q = sat__f32x4_div(x, y);
    q = sat__f32x4_min(q, sat__f32x4_set1(1048576));
    c = sat__f32x4_add(one, sat__f32x4_mul(rho, tonemap__root4(q)));
    dx = sat__f32x4_sub(sat__f32x4_mul(sat__f32x4_mul(sat__f32x4_mul(c, c), c), y), sat__f32x4_mul(q, y));
    dx = sat__f32x4_from_bits(sat__i32x4_and(red, sat__f32x4_bits(dx)));
    for (i = 0; i < 3; i++) v[i] = sat__f32x4_add(v[i], sat__f32x4_mul(sat__f32x4_set1(f->red_step[i]), dx));
}

/* ---- >> display values: the factor from input to display, Ld / L: multiplying R, G and B by it is what replacing Y in
   Yxy does */

/* Eq A.3 and A.4 with burn-out: Ld = Lr (1 + Lr peak / white^2) / (1 + La / peak), and Lr = scale L; the thesis has a
   peak of 1. Where Lr is beyond the cap of the sums, La grows with it, so that the brightest places keep their
   colour as with the global operator. Made in units of the peak. */
static inline void tonemap__gain_photographic(float *gain, const float *local, const float *luminance,
                                              const tonemap__frame *f, int end)
{
    const float most = 1.1529215e18f; /* 2^60: larger scaled luminances are white too; infinity times 0 is no number */
    sat__f32x4 one = sat__f32x4_set1(1), zero = sat__f32x4_set1(0), scale = sat__f32x4_set1(f->scale),
               burn = sat__f32x4_set1(f->inverse_white2);
    sat__f32x4 inverse_cap = sat__f32x4_set1(f->inverse_cap), peak = sat__f32x4_set1(f->peak);
    int x;
    for (x = 0; x < end; x += 4) {
        sat__f32x4 y = sat__f32x4_load(luminance + x),
                   lr = sat__f32x4_min(sat__f32x4_mul(y, scale), sat__f32x4_set1(most));
        sat__f32x4 v = sat__f32x4_mul(scale, sat__f32x4_add(one, sat__f32x4_mul(lr, burn)));
        lr = sat__f32x4_max(sat__f32x4_mul(lr, inverse_cap), one);
        v = sat__f32x4_div(v, sat__f32x4_add(peak, sat__f32x4_mul(sat__f32x4_load(local + x), lr)));
        sat__f32x4_store(gain + x, sat__f32x4_select(sat__f32x4_less(zero, y), v, zero));
    }
}

static inline sat__f32x4 tonemap__capacity4(sat__f32x4 cd)
{
    sat__f32x4 ln = sat__f32x4_mul(sat__f32x4_set1(0.693147181f),
                                   tonemap__log2_4(sat__f32x4_max(cd, sat__f32x4_set1(TONEMAP__DARKEST))));
    sat__f32x4 c1 = sat__f32x4_mul(cd, sat__f32x4_set1(1 / 0.0014f)), c2, c3, c4;
    c2 = sat__f32x4_add(sat__f32x4_set1(16.5431894f), sat__f32x4_mul(ln, sat__f32x4_set1(1 / 0.4027f)));
    c3 = sat__f32x4_add(sat__f32x4_set1(16.5431894f),
                        sat__f32x4_mul(sat__f32x4_sub(cd, sat__f32x4_set1(1)), sat__f32x4_set1(1 / 0.4027f)));
    c4 = sat__f32x4_add(sat__f32x4_set1(-3.56579561f), sat__f32x4_mul(ln, sat__f32x4_set1(1 / 0.0556f)));
    c4 = sat__f32x4_select(sat__f32x4_less(cd, sat__f32x4_set1(7.2444f)), c3, c4);
    c4 = sat__f32x4_select(sat__f32x4_less(cd, sat__f32x4_set1(1)), c2, c4);
    return sat__f32x4_select(sat__f32x4_less(cd, sat__f32x4_set1(0.0034f)), c1, c4);
}

/* Ld = TM(La) L / La; a flat picture gets the key. */
static inline void tonemap__gain_ashikhmin(float *gain, const float *local, const float *luminance,
                                           const tonemap__frame *f, float key, int end)
{
    sat__f32x4 zero = sat__f32x4_set1(0), scale = sat__f32x4_set1(f->scale), low = sat__f32x4_set1(f->curve_low),
               factor = sat__f32x4_set1(f->curve_factor), display = sat__f32x4_set1(key);
    int x;
    for (x = 0; x < end; x += 4) {
        sat__f32x4 la = sat__f32x4_max(sat__f32x4_load(local + x), sat__f32x4_set1(TONEMAP__DARKEST));
        sat__i32x4 shown;
        if (f->curve_factor > 0)
            display = sat__f32x4_mul(
                sat__f32x4_sub(tonemap__capacity4(sat__f32x4_mul(la, sat__f32x4_set1(f->cd))), low), factor);
        shown = sat__i32x4_and(sat__f32x4_less(zero, sat__f32x4_load(luminance + x)), sat__f32x4_less(zero, display));
        sat__f32x4_store(gain + x, sat__f32x4_select(shown, sat__f32x4_div(sat__f32x4_mul(display, scale), la), zero));
    }
}

static inline void tonemap__gain_row(tonemap *map, tonemap__worker *w, int y)
{
    const tonemap__frame *f = &map->frame;
    const float *luminance = map->luminance + (size_t)y * (size_t)map->row;
    int x;
    if (tonemap__is_ashikhmin(&map->options)) {
        tonemap__gain_ashikhmin(w->local, w->local, luminance, f, (float)map->stats.key, map->width);
    } else if (map->options.operation == TONEMAP_LINEAR || map->options.operation > TONEMAP_GUIDED) {
        for (x = 0; x < map->width; x++) w->local[x] = luminance[x] > 0 ? f->scale * f->curve_factor : 0;
    } else {
        tonemap__gain_photographic(w->local, w->local, luminance, f, map->width);
    }
}

/* ---- display values */

typedef float tonemap__planes[3][TONEMAP__CHUNK];

/* Colours beyond the display: the largest component is top > 1. Both ways keep the hue: dimming by top^-gamut, then
   going towards the grey of the same luminance until the largest component is 1. Clipping each channel turns skies
   cyan. */
#define TONEMAP__GAMUT_TOP 5.7646075e17f /* 2^59 */

static inline void tonemap__gamut4(sat__f32x4 *v, sat__f32x4 top, sat__f32x4 grey, float gamut, sat__f32x4 least)
{
    sat__f32x4 one = sat__f32x4_set1(1), highest = sat__f32x4_set1(TONEMAP__GAMUT_TOP), tiny = sat__f32x4_set1(1e-20f),
               dim, share;
    sat__i32x4 over = sat__f32x4_less(one, top);
    int c;
    top = sat__f32x4_max(sat__f32x4_min(top, highest), one);
    dim = tonemap__exp2_4(sat__f32x4_mul(sat__f32x4_set1(-gamut), tonemap__log2_4(top)));
    grey = sat__f32x4_mul(sat__f32x4_min(grey, one), dim);
    share = sat__f32x4_max(sat__f32x4_sub(sat__f32x4_mul(top, dim), grey), tiny);
    share = sat__f32x4_min(sat__f32x4_div(sat__f32x4_sub(one, grey), share), one);
    for (c = 0; c < 3; c++) {
        sat__f32x4 d = sat__f32x4_mul(sat__f32x4_min(v[c], highest), dim);
        d = sat__f32x4_max(sat__f32x4_add(grey, sat__f32x4_mul(sat__f32x4_sub(d, grey), share)), least);
        v[c] = sat__f32x4_select(over, d, v[c]);
    }
}

/* What the pixels of a row become their display values by. rho is NULL where nothing is mesopic. */
typedef struct tonemap__shading {
    const float *pixels, *luminance, *gain, *rho;
    const tonemap__colours *colours;
    int channels, beyond; /* some luminance is beyond the range */
    float floor, most, gamut;
    size_t clamped;
} tonemap__shading;

/* To the display's primaries. A colour beyond them has a negative component: it fades until it has none. */
static inline void tonemap__mix4(sat__f32x4 *v, sat__f32x4 luminance, const float *mix)
{
    sat__f32x4 out[3], zero = sat__f32x4_set1(0), lowest = zero, share;
    sat__i32x4 beyond;
    int c;
    for (c = 0; c < 3; c++) {
        out[c] = sat__f32x4_add(sat__f32x4_mul(sat__f32x4_set1(mix[3 * c]), v[0]),
                                sat__f32x4_mul(sat__f32x4_set1(mix[3 * c + 1]), v[1]));
        out[c] = sat__f32x4_add(out[c], sat__f32x4_mul(sat__f32x4_set1(mix[3 * c + 2]), v[2]));
        lowest = sat__f32x4_min(out[c], lowest);
    }
    beyond = sat__f32x4_less(lowest, zero);
    share = sat__f32x4_div(luminance, sat__f32x4_sub(luminance, lowest));
    for (c = 0; c < 3; c++)
        v[c] = sat__f32x4_select(
            beyond, sat__f32x4_add(luminance, sat__f32x4_mul(sat__f32x4_sub(out[c], luminance), share)), out[c]);
}

/* Colours beyond the range come down to its brightest; all ones where they are infinite, which is shown as white. */
static inline sat__i32x4 tonemap__limit4(sat__f32x4 *v, sat__f32x4 luminance, const tonemap__shading *s)
{
    sat__f32x4 own = tonemap__luminance4(s->colours->luma, s->channels, v[0], v[1], v[2]);
    sat__i32x4 beyond = sat__f32x4_less_equal(sat__f32x4_set1(TONEMAP__BRIGHTEST), luminance);
    int c;
    for (c = 0; c < 3; c++)
        v[c] = sat__f32x4_select(beyond, sat__f32x4_mul(v[c], sat__f32x4_div(luminance, own)), v[c]);
    return sat__i32x4_and(beyond, sat__f32x4_less(sat__f32x4_set1(FLT_MAX), own));
}

/* Pixels [x, x + n) times their gain, clipped to [floor, most]. Minima and maxima are written so that NaN becomes the
   floor: it comes from pixels that are black. The last few are copied first: behind them the picture may end. */
static inline void tonemap__shade(tonemap__planes out, tonemap__shading *s, int x, int n)
{
    sat__f32x4 one = sat__f32x4_set1(1), least = sat__f32x4_set1(s->floor), most = sat__f32x4_set1(s->most);
    sat__i32x4 over = sat__i32x4_set1(0);
    size_t channels = (size_t)s->channels;
    int32_t count[4];
    float last[16];
    int i, c;
    for (i = 0; i < n; i += 4) {
        const float *pixels = s->pixels + (size_t)(x + i) * channels;
        sat__f32x4 v[3], top, gain = sat__f32x4_load(s->gain + x + i),
                              luminance = sat__f32x4_load(s->luminance + x + i);
        sat__i32x4 beyond, white = sat__i32x4_set1(0);
        if (i + 4 > n) {
            memset(last, 0, sizeof last);
            pixels = (const float *)memcpy(last, pixels, (size_t)(n - i) * channels * sizeof(float));
        }
        tonemap__load_pixels(pixels, s->channels, v, v + 1, v + 2);
        if (s->beyond) white = tonemap__limit4(v, luminance, s);
        if (s->colours->mixes && s->channels > 1) tonemap__mix4(v, luminance, s->colours->mix);
        if (TONEMAP__HAS_MESOPIC && s->rho)
            tonemap__shift_red4(v, luminance, sat__f32x4_load(s->rho + x + i), s->colours);
        for (c = 0; c < 3; c++) v[c] = sat__f32x4_max(sat__f32x4_mul(v[c], gain), least);
        if (s->beyond)
            for (c = 0; c < 3; c++) v[c] = sat__f32x4_select(white, sat__f32x4_set1(TONEMAP__GAMUT_TOP), v[c]);
        top = sat__f32x4_max(sat__f32x4_max(v[0], v[1]), v[2]);
        beyond = sat__i32x4_and(sat__f32x4_less(one, top), tonemap__inside4(i, n));
        over = sat__i32x4_sub(over, beyond);
        if (s->gamut >= 0 && sat__i32x4_any(beyond))
            tonemap__gamut4(v, top, sat__f32x4_mul(luminance, gain), s->gamut, least);
        for (c = 0; c < 3; c++) sat__f32x4_store(out[c] + i, sat__f32x4_min(v[c], most));
    }
    sat__i32x4_store(count, over);
    s->clamped += (size_t)(count[0] + count[1] + count[2] + count[3]);
}

/* ---- curves of one pixel, as published, for red, green and blue in which the metered luminance is the key */

static inline void tonemap__matrix(float *v, const float *m)
{
    float a = m[0] * v[0] + m[1] * v[1] + m[2] * v[2], b = m[3] * v[0] + m[4] * v[1] + m[5] * v[2];
    v[2] = m[6] * v[0] + m[7] * v[1] + m[8] * v[2];
    v[0] = a;
    v[1] = b;
}

static inline void tonemap__mix_planes(tonemap__planes p, const float *m, int n)
{
    int i, c;
    for (i = 0; i < n; i++) {
        float v[3];
        for (c = 0; c < 3; c++) v[c] = p[c][i];
        tonemap__matrix(v, m);
        for (c = 0; c < 3; c++) p[c][i] = v[c];
    }
}

/* log2 of each, from 1e-9 on. */
static inline void tonemap__log2_row(float *v, int n)
{
    int i;
    for (i = 0; i < n; i += 4)
        sat__f32x4_store(v + i, tonemap__log2_4(sat__f32x4_max(sat__f32x4_load(v + i), sat__f32x4_set1(1e-9f))));
}

static inline void tonemap__power_row(float *v, float power, int n)
{
    int i;
    tonemap__log2_row(v, n);
    for (i = 0; i < n; i += 4)
        sat__f32x4_store(v + i,
                         tonemap__exp2_4(sat__f32x4_max(sat__f32x4_mul(sat__f32x4_load(v + i), sat__f32x4_set1(power)),
                                                        sat__f32x4_set1(-59))));
}

/* Khronos 2024, "PBR Neutral tone mapper": a toe that takes off the reflection of 4 %, colours as they are up to 0.76,
   then the largest component is compressed and the colour fades. */
static inline void tonemap__neutral(float *v)
{
    const float start = 0.76f, room = 0.24f;
    float x = v[0] < v[1] ? v[0] : v[1], offset, peak, top, fade;
    int c;
    x = x < v[2] ? x : v[2];
    offset = x < 0.08f ? x - 6.25f * x * x : 0.04f;
    for (c = 0; c < 3; c++) v[c] -= offset;
    peak = v[0] > v[1] ? v[0] : v[1];
    peak = peak > v[2] ? peak : v[2];
    if (peak < start) return;
    top = 1 - room * room / (peak + room - start);
    fade = 1 / (0.15f * (peak - top) + 1);
    for (c = 0; c < 3; c++) v[c] = top + (v[c] * (top / peak) - top) * fade;
}

/* Sobotka's AgX in Wrensch's fit (iolite-engine.com/blog_posts/minimal_agx_implementation), its display values
   decoded with 2.2. */
static inline void tonemap__agx(tonemap__planes p, int n)
{
    static const float in[9] = {0.842479062f, 0.0784336f, 0.0792237451f, 0.0423282422f, 0.878468636f,
                                0.0791661275f, 0.0423756549f, 0.0784336f, 0.879142974f};
    static const float out[9] = {1.196879005f, -0.0980208811f, -0.0990297441f, -0.0528968518f, 1.15190313f,
                                 -0.0989611768f, -0.0529716355f, -0.0980434501f, 1.151073673f};
    int i, c;
    tonemap__mix_planes(p, in, n);
    for (c = 0; c < 3; c++) {
        tonemap__log2_row(p[c], n);
        for (i = 0; i < n; i++) {
            float x = (p[c][i] + 12.47393f) * (1 / 16.5f), x2, x4;
            x = x < 0 ? 0 : x > 1 ? 1 : x;
            x2 = x * x;
            x4 = x2 * x2;
            p[c][i] = 15.5f * x4 * x2 - 40.14f * x4 * x + 31.96f * x4 - 6.868f * x2 * x + 0.4298f * x2 + 0.1191f * x -
                      0.00232f;
        }
    }
    tonemap__mix_planes(p, out, n);
    for (c = 0; c < 3; c++) tonemap__power_row(p[c], 2.2f, n);
}

/* Stephen Hill's fit of the ACES reference rendering and sRGB output transforms (BakingLab, ACES.hlsl). */
static inline void tonemap__aces(float *v)
{
    static const float in[9] = {0.59719f, 0.35458f, 0.04823f, 0.07600f, 0.90834f,
                                0.01566f, 0.02840f, 0.13383f, 0.83777f};
    static const float out[9] = {1.60475f,  -0.53108f, -0.07367f, -0.10208f, 1.10813f,
                                 -0.00605f, -0.00327f, -0.07276f, 1.07602f};
    int c;
    tonemap__matrix(v, in);
    for (c = 0; c < 3; c++) {
        float x = v[c] * (1 / 0.6f);
        v[c] = (x * (x + 0.0245786f) - 0.000090537f) / (x * (0.983729f * x + 0.4329510f) + 0.238081f);
    }
    tonemap__matrix(v, out);
}

/* Hable 2010, "Uncharted 2: HDR lighting": A .15 B .5 C .1 D .2 E .02 F .3, exposure 2, white 11.2. */
static inline float tonemap__hable(float x)
{
    return (x * (0.15f * x + 0.05f) + 0.004f) / (x * (0.15f * x + 0.5f) + 0.06f) - 1 / 15.0f;
}

static inline void tonemap__curve_planes(tonemap__planes p, tonemap_operator curve, float floor, float scale, int n)
{
    int i, c;
    if (curve == TONEMAP_AGX) tonemap__agx(p, n);
    for (i = 0; i < n; i++) {
        float v[3];
        for (c = 0; c < 3; c++) v[c] = p[c][i];
        if (curve == TONEMAP_NEUTRAL) tonemap__neutral(v);
        else if (curve == TONEMAP_ACES) tonemap__aces(v);
        else if (curve == TONEMAP_HABLE)
            for (c = 0; c < 3; c++) v[c] = tonemap__hable(2 * v[c]) * (1 / 0.725129270f);
        for (c = 0; c < 3; c++) {
            v[c] = (v[c] < 1 ? v[c] : 1) * scale;
            p[c][i] = v[c] > floor ? v[c] : floor;
        }
    }
}

/* ---- encodings of floats, from values in units of the display's peak */

/* SMPTE ST 2084; cd: cd/m2. Within 3e-4: a third of a code of 10 bits. */
static inline float tonemap__pq(float cd)
{
    float y = cd > 1e-7f ? tonemap__exp2(0.1593017578125f * sat__log2(cd * 1e-4f)) : 0;
    y = (0.8359375f + 18.8515625f * y) / (1 + 18.6875f * y);
    return cd > 1e-7f ? tonemap__exp2(78.84375f * sat__log2(y)) : 0;
}

/* ITU-R BT.2100: the light of the scene. */
static inline float tonemap__hlg(float scene)
{
    float v = scene < 1 ? scene : 1;
    if (v <= 1 / 12.0f) return sqrtf(3 * v);
    return 0.17883277f * 0.693147181f * sat__log2(12 * v - 0.28466892f) + 0.55991073f;
}

static inline void tonemap__encode_planes(tonemap__planes v, const tonemap *map, int n)
{
    const float *luma = map->colours.display_luma;
    float peak_cd = (float)(map->options.peak * map->options.white_cd),
          power = (float)(1.2 + 0.42 * log10(map->options.peak * map->options.white_cd / 1000));
    int i, c;
    power = 1 / power - 1;
    for (i = 0; i < n; i++) {
        float y = luma[0] * v[0][i] + luma[1] * v[1][i] + luma[2] * v[2][i], factor;
        if (map->options.encoding == TONEMAP_ENCODING_PQ) {
            for (c = 0; c < 3; c++) v[c][i] = tonemap__pq(v[c][i] * peak_cd);
            continue;
        }
        factor = y > 1e-9f ? tonemap__exp2(power * sat__log2(y)) : 0;
        for (c = 0; c < 3; c++) v[c][i] = tonemap__hlg(v[c][i] * factor);
    }
}

/* sRGB codes by a table over the float's exponent and 9 bits of its mantissa, from 2^-13 (code 0) to 1: at most one
   code from the rounded value, and that only within 0.1 of a step. */
enum { TONEMAP__CODE_BASE = 0xe400, TONEMAP__CODE_SHIFT = 14 };
#define TONEMAP__CODE_FLOOR 0.0001220703125f /* 2^-13 */

static inline unsigned char tonemap__code(const tonemap *map, float v)
{
    return map->code[(sat__float_bits(v) >> (TONEMAP__CODE_SHIFT)) - TONEMAP__CODE_BASE];
}

static inline void tonemap__fill_codes(unsigned char *code)
{
    uint32_t i;
    for (i = 0; i < TONEMAP__CODES; i++) {
        uint32_t middle = ((i + TONEMAP__CODE_BASE) << TONEMAP__CODE_SHIFT) + (1u << (TONEMAP__CODE_SHIFT - 1));
        code[i] = (unsigned char)(255 * sat__srgb_encode(sat__float_from_bits(middle)) + 0.5f);
    }
    code[0] = 0;
}

/* 256 times the code where each entry begins, for dithering. */
static inline void tonemap__fill_fine(uint16_t *fine)
{
    uint32_t i;
    for (i = 0; i <= TONEMAP__CODES; i++) {
        float v = sat__float_from_bits((i + TONEMAP__CODE_BASE) << TONEMAP__CODE_SHIFT);
        fine[i] = (uint16_t)(65280 * sat__srgb_encode(v < 1 ? v : 1) + 0.5f);
    }
    fine[0] = 0;
}

/* Bayer's pattern, in 256ths of a code: the bits of x ^ y and y in turns, lowest first. */
static inline uint32_t tonemap__threshold(int x, int y)
{
    int d = x ^ y;
    return (uint32_t)((d & 1) << 7 | (y & 1) << 6 | (d & 2) << 4 | (y & 2) << 3 | (d & 4) << 1 | (y & 4)) + 2;
}

/* n pixels of row y from column x on, as they are written. */
typedef struct tonemap__piece {
    unsigned char *out;
    int channels, x, y, n;
} tonemap__piece;

static inline void tonemap__write_u8(const tonemap *map, const tonemap__piece *piece, tonemap__planes v)
{
    const int channels = piece->channels, n = piece->n;
    unsigned char *out = piece->out;
    int i;
    if (channels == 1) {
        for (i = 0; i < n; i++) out[i] = tonemap__code(map, v[0][i]);
        return;
    }
    for (i = 0; i < n; i++, out += channels) {
        out[0] = tonemap__code(map, v[0][i]);
        out[1] = tonemap__code(map, v[1][i]);
        out[2] = tonemap__code(map, v[2][i]);
    }
}

/* Ordered dithering: code + a threshold that is another 64th at each of 8 x 8 pixels, rounded down. The mean over such
   a block is that of the codes. */
static inline void tonemap__write_dithered(const tonemap *map, const tonemap__piece *piece, tonemap__planes v)
{
    const int channels = piece->channels, x = piece->x, y = piece->y, n = piece->n;
    unsigned char *out = piece->out;
    int i, c, colours = channels == 1 ? 1 : 3;
    for (i = 0; i < n; i++, out += channels)
        for (c = 0; c < colours; c++) {
            uint32_t bits = sat__float_bits(v[c][i]), at = (bits >> (TONEMAP__CODE_SHIFT)) - TONEMAP__CODE_BASE,
                     part = bits & ((1u << TONEMAP__CODE_SHIFT) - 1), low = map->fine[at], high = map->fine[at + 1];
            out[c] =
                (unsigned char)((low + ((high - low) * part >> (TONEMAP__CODE_SHIFT)) + tonemap__threshold(x + i, y)) >>
                                8);
        }
}

static inline void tonemap__write_f32(const tonemap *map, const tonemap__piece *piece, tonemap__planes v)
{
    const int channels = piece->channels, n = piece->n;
    float *out = (float *)(void *)piece->out;
    int i, c, colours = channels == 1 ? 1 : 3;
    if (map->options.encoding > TONEMAP_ENCODING_LINEAR) tonemap__encode_planes(v, map, n);
    else if (map->frame.peak > 1)
        for (c = 0; c < 3; c++)
            for (i = 0; i < n; i++) v[c][i] *= map->frame.peak;
    for (i = 0; i < n; i++, out += channels)
        for (c = 0; c < colours; c++) out[c] = v[c][i];
}

static inline float tonemap__unit(float v) { return v > 0 ? v < 1 ? v : 1 : 0; }

static inline void tonemap__write_row(const tonemap__job *job, tonemap__worker *w, const float *pixels,
                                      const float *rho, int y)
{
    tonemap *map = job->map;
    const float *luminance = map->luminance + (size_t)y * (size_t)map->row;
    unsigned char *row = job->out + (ptrdiff_t)y * job->out_stride;
    int x, i, n, channels = job->hdr->channels, curve = map->options.operation > TONEMAP_GUIDED;
    size_t element = job->as_float ? sizeof(float) : 1;
    tonemap__shading shading;
    tonemap__piece piece;
    tonemap__planes v;
    shading.pixels = pixels;
    shading.luminance = luminance;
    shading.gain = w->local;
    shading.rho = rho;
    shading.channels = channels;
    shading.colours = &map->colours;
    shading.most = curve ? 1e9f : 1;
    shading.floor = job->as_float ? 0 : TONEMAP__CODE_FLOOR;
    shading.gamut = channels > 1 && !curve ? map->frame.gamut : -1;
    shading.beyond = map->row_odd[y] & 2;
    shading.clamped = 0;
    piece.channels = channels;
    piece.y = y;
    for (x = 0; x < map->width; x += n) {
        size_t at = (size_t)x * (size_t)channels;
        piece.out = row + at * element;
        piece.x = x;
        piece.n = n = sat__min_int(TONEMAP__CHUNK, map->width - x);
        tonemap__shade(v, &shading, x, n);
        if (curve) tonemap__curve_planes(v, map->options.operation, shading.floor, 1 / map->frame.peak, n);
        if (channels == 4) /* alpha: before the colours, which may overwrite the input */
            for (i = 0; i < n; i++) {
                float alpha = tonemap__unit(pixels[at + 4 * (size_t)i + 3]);
                if (job->as_float) ((float *)(void *)piece.out)[4 * i + 3] = alpha;
                else piece.out[4 * i + 3] = (unsigned char)(alpha * 255 + 0.5f);
            }
        if (job->as_float) tonemap__write_f32(map, &piece, v);
        else if (map->options.dither) tonemap__write_dithered(map, &piece, v);
        else tonemap__write_u8(map, &piece, v);
    }
    if (!curve) w->stats.clamped += shading.clamped;
}

static void tonemap__map_bands(int begin, int end, int worker, void *context)
{
    const tonemap__job *job = (const tonemap__job *)context;
    tonemap *map = job->map;
    tonemap__worker *w = &map->worker[worker];
    const tonemap__frame *f = &map->frame;
    int y = begin * TONEMAP__BAND, y1 = sat__min_int(end * TONEMAP__BAND, map->height), first = y,
        next = sat__max_int(y - f->reach, 0), x;
    int mesopic = TONEMAP__HAS_MESOPIC && map->options.mesopic != TONEMAP_MESOPIC_OFF && job->hdr->channels > 1;
    if (mesopic && map->options.mesopic == TONEMAP_MESOPIC_UNIFORM) {
        mesopic = f->rho < 1;
        for (x = 0; x < map->width; x++) w->rho[x] = f->rho;
    }
    if (f->reach > 0) memset(tonemap__ring_row(map, w, next), 0, (size_t)map->ring_row * sizeof(uint32_t));
    for (; y < y1; y++) {
        const float *pixels = tonemap__float_row(w->pixels, job->hdr, y);
        if (f->reach > 0)
            for (; next < sat__min_int(y + f->reach + 1, map->height); next++) tonemap__add_ring_row(map, w, next);
        tonemap__local_row(map, w, y, first);
        if (mesopic && map->options.mesopic == TONEMAP_MESOPIC_LOCAL)
            tonemap__rho_row(w->rho, w->local, f->lux, map->width);
        tonemap__gain_row(map, w, y);
        tonemap__write_row(job, w, pixels, mesopic ? w->rho : NULL, y);
    }
}

/* ---- unusable pixels: NaN and negative luminances, which resampling leaves beside lamps, show the mean of what the
   usable ones around them show, out of the nearest square that has some. After the picture: in place the input is
   gone. */

static inline int tonemap__is_unusable(const tonemap *map, int x, int y)
{
    return sat__float_bits(map->luminance[(size_t)y * (size_t)map->row + (size_t)x]) == TONEMAP__UNUSABLE;
}

static inline void tonemap__fill_pixel(const tonemap__job *job, int x, int y)
{
    const tonemap *map = job->map;
    int channels = job->hdr->channels, colours = channels == 1 ? 1 : 3, radius, u, v, c, n = 0;
    size_t element = job->as_float ? sizeof(float) : 1;
    float sum[3] = {0, 0, 0};
    unsigned char *at;
    for (radius = 1; radius <= 3 && !n; radius++)
        for (v = sat__max_int(y - radius, 0); v <= sat__min_int(y + radius, map->height - 1); v++)
            for (u = sat__max_int(x - radius, 0); u <= sat__min_int(x + radius, map->width - 1); u++) {
                if (tonemap__is_unusable(map, u, v)) continue;
                at = job->out + (ptrdiff_t)v * job->out_stride + (size_t)u * (size_t)channels * element;
                for (c = 0; c < colours; c++) sum[c] += job->as_float ? ((const float *)(const void *)at)[c] : at[c];
                n++;
            }
    at = job->out + (ptrdiff_t)y * job->out_stride + (size_t)x * (size_t)channels * element;
    for (c = 0; c < colours && n; c++) {
        if (job->as_float) ((float *)(void *)at)[c] = sum[c] / (float)n;
        else at[c] = (unsigned char)(sum[c] / (float)n + 0.5f);
    }
}

static void tonemap__fill_bands(int begin, int end, int worker, void *context)
{
    const tonemap__job *job = (const tonemap__job *)context;
    int x, y = begin * TONEMAP__BAND, y1 = sat__min_int(end * TONEMAP__BAND, job->map->height);
    (void)worker;
    for (; y < y1; y++) {
        if (!(job->map->row_odd[y] & 1)) continue;
        for (x = 0; x < job->map->width; x++)
            if (tonemap__is_unusable(job->map, x, y)) tonemap__fill_pixel(job, x, y);
    }
}

/* ---- >> calls */

static inline void tonemap__carve(tonemap *map, sat__arena *arena)
{
    size_t row = (size_t)map->row, height = (size_t)map->height;
    int i, k;
    map->worker = (tonemap__worker *)sat__carve(arena, (size_t)map->workers, sizeof *map->worker);
    map->luminance = (float *)sat__carve(arena, height, row * sizeof(float));
    map->row_sum = (float *)sat__carve(arena, height, sizeof(float));
    map->row_odd = (unsigned char *)sat__carve(arena, height, 1);
    map->fine = (uint16_t *)sat__carve(arena, TONEMAP__CODES + 1, sizeof(uint16_t));
    map->meter = (tonemap__meter *)sat__carve(arena, 1, sizeof *map->meter);
    for (i = 0; i < map->workers; i++) {
        tonemap__worker ignored, *w = arena->base ? &map->worker[i] : &ignored;
        w->sums = (uint32_t *)sat__carve(arena, TONEMAP__RINGS, (size_t)map->ring_row * sizeof(uint32_t));
        for (k = 0; k < 4; k++) w->column[k] = (uint32_t *)sat__carve(arena, row, sizeof(uint32_t));
        w->nothing = (const float *)sat__carve(arena, row, sizeof(float));
        w->pixels = (float *)sat__carve(arena, 4 * row, sizeof(float));
        w->local = (float *)sat__carve(arena, row, sizeof(float));
        w->rho = (float *)sat__carve(arena, row, sizeof(float));
        w->edge = (float *)sat__carve(arena, row, sizeof(float));
        w->bins = (uint32_t *)sat__carve(arena, TONEMAP__BINS, sizeof(uint32_t));
    }
}

TONEMAP_DEF sat_result tonemap_create(tonemap **out, int width, int height, const tonemap_options *options)
{
    tonemap_options o = options ? *options : tonemap_defaults();
    tonemap shape, *map;
    sat__arena arena;
    sat_result result;
    void *block;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    if (width < 1 || height < 1 || width > 1 << 24 || height > 1 << 24 || !tonemap__options_are_valid(&o))
        return SAT_ERR_ARGUMENT;
    memset(&shape, 0, sizeof shape);
    if (!sat__resolve_allocator(&shape.allocator, &o.allocator)) return SAT_ERR_ARGUMENT;
    shape.options = o;
    shape.width = width;
    shape.height = height;
    shape.row = (width + 2 * TONEMAP__GROUP - 1) / TONEMAP__GROUP * TONEMAP__GROUP;
    shape.ring_row = shape.row + 2 * TONEMAP__BOXES + TONEMAP__GROUP + 8;
    shape.workers = sat__worker_count(&o.threads);
    memset(&arena, 0, sizeof arena);
    sat__carve(&arena, 1, sizeof shape);
    tonemap__carve(&shape, &arena);
    result = sat__arena_allocate(&arena, &block, &shape.block_size, &shape.allocator);
    if (result != SAT_OK) return result;
    memset(block, 0, shape.block_size);
    map = (tonemap *)sat__carve(&arena, 1, sizeof shape);
    *map = shape;
    map->block = block;
    tonemap__carve(map, &arena);
    tonemap__fill_codes(map->code);
    tonemap__fill_fine(map->fine);
    tonemap__prepare_colours(&map->colours, &o);
    *out = map;
    return SAT_OK;
}

TONEMAP_DEF void tonemap_destroy(tonemap *map)
{
    if (map) {
        sat_allocator allocator = map->allocator;
        sat__release(&allocator, map->block, map->block_size);
    }
}

TONEMAP_DEF sat_result tonemap_set_options(tonemap *map, const tonemap_options *options)
{
    tonemap_options o = options ? *options : tonemap_defaults();
    if (!map || !tonemap__options_are_valid(&o) || sat__worker_count(&o.threads) > map->workers)
        return SAT_ERR_ARGUMENT;
    map->options = o;
    tonemap__prepare_colours(&map->colours, &o);
    return SAT_OK;
}

static inline void tonemap__finish_stats(tonemap *map)
{
    int i, k;
    for (i = 0; i < map->workers; i++) {
        const tonemap_stats *s = &map->worker[i].stats;
        map->stats.clamped += s->clamped;
        map->stats.searched += s->searched;
        map->stats.skipped += s->skipped;
        for (k = 0; k < 10; k++) map->stats.scale[k] += s->scale[k];
    }
}

/* Resolves a stride of 0. */
static inline sat_result tonemap__check_call(tonemap__job *job, double dt)
{
    const sat_image *hdr = job->hdr;
    size_t element = job->as_float ? sizeof(float) : 1;
    if (!job->map || !sat__image_is_valid(hdr) || hdr->channels == 2) return SAT_ERR_ARGUMENT;
    if (hdr->width != job->map->width || hdr->height != job->map->height) return SAT_ERR_MISMATCH;
    if (!sat__rows_are_valid(job->out, &job->out_stride, hdr->width, hdr->height, (size_t)hdr->channels * element,
                             element))
        return SAT_ERR_ARGUMENT;
    return tonemap__in_range(dt, 0, 1e300) || tonemap__is_infinite(dt) ? SAT_OK : SAT_ERR_ARGUMENT;
}

static inline sat_result tonemap__apply(tonemap__job *job, double dt, tonemap_stats *stats)
{
    tonemap *map = job->map;
    const sat_result result = tonemap__check_call(job, dt);
    const sat_threads *threads;
    double measured[TONEMAP__STATES];
    int i, bands, histogram;
    if (result != SAT_OK) return result;
    threads = &map->options.threads;
    bands = (map->height + TONEMAP__BAND - 1) / TONEMAP__BAND;
    histogram = tonemap__needs_histogram(&map->options, stats);
    memset(&map->stats, 0, sizeof map->stats);
    for (i = 0; i < map->workers; i++) {
        tonemap__worker *w = &map->worker[i];
        memset(&w->stats, 0, sizeof w->stats);
        w->log_sum = 0;
        w->counted = 0;
        w->luma = map->colours.luma;
        w->histogram = histogram ? w->bins : NULL;
        memset(w->bins, 0, TONEMAP__BINS * sizeof *w->bins);
    }
    sat__parallel_for(threads, bands, tonemap__measure_bands, job);
    if (tonemap__measured_state(map, measured)) tonemap__adapt(map, measured, dt);
    tonemap__prepare_frame(map);
    sat__parallel_for(threads, bands, tonemap__map_bands, job);
    if (map->stats.nan + map->stats.negative) sat__parallel_for(threads, bands, tonemap__fill_bands, job);
    tonemap__finish_stats(map);
    if (stats) *stats = map->stats;
    return SAT_OK;
}

static inline tonemap__job tonemap__job_of(tonemap *map, void *out, ptrdiff_t out_stride, const sat_image *hdr,
                                           int as_float)
{
    tonemap__job job;
    job.map = map;
    job.hdr = hdr;
    job.out = (unsigned char *)out;
    job.out_stride = out_stride;
    job.as_float = as_float;
    return job;
}

TONEMAP_DEF sat_result tonemap_apply_u8(tonemap *map, unsigned char *out, ptrdiff_t out_stride, const sat_image *hdr,
                                        double dt, tonemap_stats *stats)
{
    tonemap__job job = tonemap__job_of(map, out, out_stride, hdr, 0);
    return tonemap__apply(&job, dt, stats);
}

TONEMAP_DEF sat_result tonemap_apply_f32(tonemap *map, float *out, ptrdiff_t out_stride, const sat_image *hdr,
                                         double dt, tonemap_stats *stats)
{
    tonemap__job job = tonemap__job_of(map, out, out_stride, hdr, 1);
    return tonemap__apply(&job, dt, stats);
}

TONEMAP_DEF sat_result tonemap_once_u8(unsigned char *out, const float *pixels, int width, int height, int channels,
                                       const tonemap_options *options)
{
    tonemap *map;
    sat_image image = sat_image_f32(pixels, width, height, channels);
    sat_result result = tonemap_create(&map, width, height, options);
    if (result != SAT_OK) return result;
    result = tonemap_apply_u8(map, out, (ptrdiff_t)width * channels, &image, 0, NULL);
    tonemap_destroy(map);
    return result;
}

#ifdef __cplusplus
}
#endif
SAT__IEEE_END
#endif /* TONEMAP_IMPLEMENTATION */

/* ------------------------------------------------------------------------------------------------
   >> shaders of OpenGL
   ------------------------------------------------------------------------------------------------ */

#if defined(TONEMAP_IMPLEMENTATION) && defined(TONEMAP_GL) && !defined(TONEMAP__GL_IMPLEMENTED)
#define TONEMAP__GL_IMPLEMENTED

#ifndef SAT_SIBLING_GL
#define SAT_SIBLING_GL
#endif
#include "sat.h"

SAT__IEEE_BEGIN
#ifdef __cplusplus
extern "C" {
#endif

static const char tonemap__glsl_library[] =
    "#ifndef TONEMAP_GLSL\n"
    "#define TONEMAP_GLSL\n"
    "#ifndef TONEMAP_PHI_TERM\n" /* epsilon, and epsilon 2^phi */
    "#define TONEMAP_EPSILON 0.05\n"
    "#define TONEMAP_PHI_TERM 12.8\n"
    "#define TONEMAP_SCALES 8\n"
    "#endif\n"
    "const vec3 tonemap_luma = vec3(" SAT__TEXT(TONEMAP__LUMA) ");\n"
    "const float tonemap_white_x = " SAT__TEXT(TONEMAP__WHITE_X) ";\n"
    "const float tonemap_darkest = " SAT__TEXT(TONEMAP__DARKEST) ";\n"
    SAT__GLSL(
        float tonemap_sane(float y) {
            uint bits = floatBitsToUint(y);
            if (bits > 0x7f800000u || bits < 0x0d800000u) return 0.0;
            return bits > 0x71800000u ? uintBitsToFloat(0x71800000u) : y;
        })
    SAT__GLSL(
        float tonemap_luminance(vec3 rgb) {
            return tonemap_sane(tonemap_luma.r * rgb.r + tonemap_luma.g * rgb.g + tonemap_luma.b * rgb.b);
        })
    SAT__GLSL(
        float tonemap_rho(float lux) {
            float t = pow(clamp(lux, 1e-8, 10.0), 0.383);
            return lux < 10.0 ? min((t * (92.0 / 57.0) + 0.93227627) / (t + 2.41546083), 1.0) : 1.0;
        })
    SAT__GLSL(
        /* x, step: X, and colour of a step of X, of the primaries */
        vec3 tonemap_mesopic_in(vec3 rgb, float luminance, float rho, vec3 x, vec3 step) {
            float y = tonemap_white_x * max(luminance, tonemap_darkest);
            float q = min(dot(rgb, x) / y, 1048576.0);
            if (!(q > 1.0 && rho < 1.0)) return rgb;
            float c = 1.0 + rho * (pow(q, 1.0 / 3.0) - 1.0);
            return rgb + (c * c * c - q) * y * step;
        })
    SAT__GLSL(
        vec3 tonemap_mesopic(vec3 rgb, float luminance, float rho) {
            return tonemap_mesopic_in(rgb, luminance, rho, vec3(0.4124564, 0.3575761, 0.1804375),
                vec3(3.2404542, -0.9692660, 0.0556434));
        })
    SAT__GLSL(
        vec3 tonemap_srgb(vec3 v) {
            v = clamp(v, 0.0, 1.0);
            return mix(12.92 * v, 1.055 * pow(max(v, 0.0031308), vec3(1.0 / 2.4)) - 0.055,
                greaterThan(v, vec3(0.0031308)));
        })
    "#ifdef SAT_GLSL\n"
    SAT__GLSL(
        float tonemap_local_in(usampler2D table, float quantum, ivec2 size, ivec2 pixel, float scaled, float key) {
            const int reach[8] = int[8](0, 1, 2, 3, 5, 8, 13, 20);
            float c = min(scaled, 256.0);
            for (int k = 1; k < TONEMAP_SCALES; k++) {
                float side = float(2 * reach[k - 1] + 1);
                float v = sat_mean(table, quantum, pixel - reach[k], min(pixel + reach[k] + 1, size));
                if (!(abs(c - v) < TONEMAP_EPSILON * c + TONEMAP_PHI_TERM * key / (side * side))) break;
                c = v;
            }
            return c;
        }
        float tonemap_local(usampler2D table, float quantum, ivec2 pixel, float scaled, float key) {
            return tonemap_local_in(table, quantum, textureSize(table, 0), pixel, scaled, key);
        })
    "#endif\n"
    "#endif\n";

TONEMAP_DEF const char *tonemap_gl_glsl(void) { return tonemap__glsl_library; }

/* The luminance plane. */
static const char tonemap__glsl_luminance[] =
    SAT__GLSL(
        uniform sampler2D hdr;
        uniform vec3 luma;
        out float value;
        void main() {
            vec3 rgb = texelFetch(hdr, ivec2(gl_FragCoord.xy) + sat_from, 0).rgb;
            float y = luma.r * rgb.r + luma.g * rgb.g + luma.b * rgb.b;
            uint bits = floatBitsToUint(y);
            value = bits > 0x7f800000u && bits != 0x80000000u ? -1.0 : tonemap_sane(y); /* -1: unusable */
        });

/* Sums over 4 x 4 texels. Texel: whole and 2^-16 parts of the sum of log2, carried over; pixels. Integers, so that the
   log-average is the CPU's. The polynomial is the CPU's, too. */
static const char tonemap__glsl_reduce[] =
    "#ifdef TONEMAP_FIRST\n"
    SAT__GLSL(
        uniform sampler2D source, mask;
        uniform ivec2 size;
        ivec4 tonemap_read(ivec2 p) {
            float y = texelFetch(source, p, 0).x;
            int weight = TONEMAP_MASK == 1 ? int(texelFetch(mask, p * textureSize(mask, 0) / size, 0).x) : 1;
            uint bits = floatBitsToUint(y);
            if (!(y > 0.0) || bits >= 0x71800000u) return ivec4(0);
            float t = uintBitsToFloat((bits & 0x007fffffu) | 0x3f800000u) - 1.0;
)
    "float q = " SAT__TEXT(SAT__LOG2_OF(t)) ";\n"
    SAT__GLSL(
            return weight * ivec4(int(bits >> 23) - 127, int((t + t * (1.0 - t) * q) * 65536.0 + 0.5), 1, 0);
        })
    "#else\n"
    SAT__GLSL(
        uniform highp isampler2D source;
        uniform ivec2 size;
        ivec4 tonemap_read(ivec2 p) { return texelFetch(source, p, 0); })
    "#endif\n"
    SAT__GLSL(
        out ivec4 value;
        void main() {
            ivec2 low = 4 * ivec2(gl_FragCoord.xy), high = min(low + 4, size);
            ivec3 sum = ivec3(0);
            for (int y = low.y; y < high.y; y++)
                for (int x = low.x; x < high.x; x++) {
                    sum += tonemap_read(ivec2(x, y)).xyz;
                }
            value = ivec4(sum.x + (sum.y >> 16), sum.y & 65535, sum.z, 0);
        });

/* The histogram, with the CPU's bins, 64 in a row: by compute shaders, 64 x 64 pixels in shared memory at a time ... */
static const char tonemap__glsl_squares[] =
    SAT__GLSL(
        layout(local_size_x = 256) in;
        layout(r32ui, binding = 0) uniform highp uimage2D counts;
        uniform sampler2D luminance, mask;
        uniform ivec2 picture;
        shared uint bins[TONEMAP_BINS];
        void main() {
            ivec2 low = 64 * ivec2(gl_WorkGroupID.xy);
            int lane = int(gl_LocalInvocationIndex);
            for (int i = lane; i < TONEMAP_BINS; i += 256) bins[i] = 0u;
            barrier();
            for (int i = lane; i < 4096; i += 256) {
                ivec2 p = low + ivec2(i % 64, i / 64);
                float y = all(lessThan(p, picture)) ? texelFetch(luminance, p, 0).x : 0.0;
                uint bits = floatBitsToUint(y);
                if (!(y > 0.0) || bits >= 0x71800000u) continue;
                uint weight = TONEMAP_MASK == 1 ? uint(texelFetch(mask, p * textureSize(mask, 0) / picture, 0).x) : 1u;
                atomicAdd(bins[(bits - uint(TONEMAP_LOWEST)) >> 19], weight);
            }
            barrier();
            for (int i = lane; i < TONEMAP_BINS; i += 256)
                if (bins[i] > 0u) imageAtomicAdd(counts, ivec2(i % 64, i / 64), bins[i]);
        });

static const char tonemap__glsl_nothing[] =
    SAT__GLSL(
        out uint value;
        void main() { value = 0u; });

/* ... or a point a pixel, added up by blending, which is exact up to 2^24 pixels in a bin. */
static const char tonemap__glsl_scatter[] =
    SAT__GLSL(
        uniform sampler2D luminance, mask;
        uniform ivec2 picture;
        flat out float weight;
        void main() {
            ivec2 p = ivec2(gl_VertexID % picture.x, gl_VertexID / picture.x);
            weight = TONEMAP_MASK == 1 ? texelFetch(mask, p * textureSize(mask, 0) / picture, 0).x : 1.0;
            float y = texelFetch(luminance, p, 0).x;
            uint bits = floatBitsToUint(y);
            int bin = int((bits - uint(TONEMAP_LOWEST)) >> 19);
            gl_PointSize = 1.0;
            gl_Position = vec4((vec2(bin % 64, bin / 64) + 0.5) / vec2(32.0, float(TONEMAP_BINS) / 128.0) - 1.0, 0.0,
                1.0);
            if (!(y > 0.0) || bits >= 0x71800000u) gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
        });

static const char tonemap__glsl_count[] =
    SAT__GLSL(
        flat in float weight;
        out float value;
        void main() { value = weight; });

/* The sums of the rows: most are empty, and the adaptation leaves those at the ends out. */
static const char tonemap__glsl_rows[] =
    SAT__GLSL(
        uniform highp TONEMAP_COUNTS histogram;
        out float value;
        void main() {
            value = 0.0;
            for (int x = 0; x < 64; x++) value += float(texelFetch(histogram, ivec2(x, int(gl_FragCoord.y)), 0).x);
        });

/* What is read from the histogram: in one loop each, quantiles and means. */
static const char tonemap__glsl_stats[] =
    SAT__GLSL(
        uniform sampler2D rows;
        uniform highp TONEMAP_COUNTS histogram;
        float tonemap_value(int bin, float part) {
            return float(bin / 16 - 100) + log2(1.0 + (float(bin % 16) + part) / 16.0);
        })
    SAT__GLSL(float tonemap_count(int bin) { return float(texelFetch(histogram, ivec2(bin % 64, bin / 64), 0).x); })
    SAT__GLSL(
        /* the bins before and from which on all are empty, by whole rows */
        ivec2 tonemap_filled() {
            ivec2 filled = ivec2(0, TONEMAP_BINS / 64);
            while (filled.x < filled.y && texelFetch(rows, ivec2(0, filled.x), 0).x <= 0.0) filled.x++;
            while (filled.x < filled.y && texelFetch(rows, ivec2(0, filled.y - 1), 0).x <= 0.0) filled.y--;
            return 64 * filled;
        })
    SAT__GLSL(
        vec4 tonemap_quantiles(vec4 shares, float positive, ivec2 filled) {
            vec4 wanted = shares * positive, found = vec4(0.0), open = vec4(1.0);
            float seen = 0.0;
            for (int bin = filled.x; bin < filled.y; bin++) {
                float count = tonemap_count(bin);
                vec4 hit = count > 0.0 ? vec4(lessThanEqual(wanted, vec4(seen + count))) * open : vec4(0.0);
                if (dot(hit, vec4(1.0)) > 0.0) {
                    vec4 part = float(bin % 16) + max(wanted - seen, 0.0) / count;
                    found = mix(found, float(bin / 16 - 100) + log2(1.0 + part / 16.0), hit);
                    open -= hit;
                }
                seen += count;
            }
            return found;
        })
    SAT__GLSL(
        float tonemap_share(float count, float octaves) { return count * clamp((octaves + 24.0) / 6.0, 0.0, 1.0); })
    SAT__GLSL(
        /* xyz: means between shares of what lies not too far below top; w: the mean of all; above top */
        vec4 tonemap_means(vec3 low, vec3 high, float positive, float top, ivec2 filled) {
            vec3 inner = vec3(0.0), sum = vec3(0.0);
            float all = 0.0, whole = 0.0, seen = 0.0;
            for (int bin = filled.x; bin < filled.y; bin++)
                all += tonemap_share(tonemap_count(bin), tonemap_value(bin, 0.5) - top);
            for (int bin = filled.x; bin < filled.y; bin++) {
                float count = tonemap_count(bin), octaves = tonemap_value(bin, 0.5) - top;
                float next = seen + tonemap_share(count, octaves);
                vec3 n = max(min(vec3(next), high * all) - max(vec3(seen), low * all), 0.0);
                inner += n;
                sum += n * octaves;
                whole += count * octaves;
                seen = next;
            }
            return vec4(sum / max(inner, 1e-30), whole / positive);
        });

/* The state, two texels: log2 of average, key and white, and 1; log2 of low and high, what the meter and what the white
   hold. An empty picture keeps the old one. */
static const char tonemap__glsl_state[] =
    SAT__GLSL(
        uniform highp isampler2D sums;
        uniform sampler2D old;
        /* key and white as log2; 0: estimated */
        uniform float weight, weight_darker, key, white, pixels, exposure, lowest, highest, dead_band;
        out vec4 value;
        float tonemap_hold(float held, bool fresh, float now, float steps) {
            return fresh || abs(now - held) * steps > dead_band ? floor(now * steps + 0.5) / steps : held;
        })
    SAT__GLSL(
        void main() {
            ivec4 sum = texelFetch(sums, ivec2(0), 0);
            vec4 first = texelFetch(old, ivec2(0), 0), second = texelFetch(old, ivec2(1, 0), 0);
            bool lit = sum.z > 0;)
    "#if TONEMAP_METERING == 0\n"
    SAT__GLSL(lit = lit && (first.w <= 0.0 || float(sum.z) * 1000.0 >= pixels);)
    "#endif\n"
    SAT__GLSL(
            if (lit) {
                int whole = sum.x / sum.z;
                float positive = float(sum.z),
                    average = float(whole) + (float(sum.x - whole * sum.z) + float(sum.y) / 65536.0) / positive;
                vec2 range = vec2(0.0);)
    "#if TONEMAP_HISTOGRAM\n"
    SAT__GLSL(
                ivec2 filled = tonemap_filled();
                vec4 quantiles = tonemap_quantiles(vec4(0.0005, 0.01, 0.99, 0.9995), positive, filled);
                vec3 from = vec3(TONEMAP_METER_LOW, 0.8, 0.995);
                vec3 to = vec3(TONEMAP_METER_HIGH, TONEMAP_METER_HIGH > 0.8 ? TONEMAP_METER_HIGH : 1.0, 0.9995);
                float top = quantiles.z;
                vec4 means = tonemap_means(from, to, positive, top, filled);)
    "#endif\n"
    "#if TONEMAP_METERING == 0\n"
    SAT__GLSL(
                average = max(average + means.x - means.w, top + means.y - TONEMAP_HIGHLIGHTS);
                average = second.z = tonemap_hold(second.z, first.w <= 0.0, average, 64.0);)
    "#endif\n"
    SAT__GLSL(
                average = max(min(average, highest), lowest);
                vec4 now = vec4(average, key, white, 1.0);)
    "#if TONEMAP_HISTOGRAM\n"
    SAT__GLSL(
                float low = quantiles.y, high = top;
                float place = high - low > 0.125 ? clamp((2.0 * average - low - high) / (high - low), -1.0, 1.0) : 0.0;
                if (TONEMAP_HISTOGRAM % 4 / 2 == 1) now.y = log2(0.18) + 2.0 * place;
                float scaled = top + means.z
                    + (exposure > 0.0 ? log2(exposure) : now.y - average);
                float burn = max(min(log2(1.5) + high - low - 5.0, scaled), 0.0);
                if (TONEMAP_HISTOGRAM % 8 / 4 == 1)
                    now.z = second.w = tonemap_hold(second.w, first.w <= 0.0, burn, 8.0);
                range = quantiles.xw;)
    "#endif\n"
    SAT__GLSL(
                float share = first.w > 0.0 ? average < first.x ? weight_darker : weight : 1.0;
                first = share < 1.0 ? mix(first, now, share) : now;
                second.xy = share < 1.0 ? mix(second.xy, range, share) : range;
                first.w = 1.0;
            }
            if (exposure > 0.0) first.x = first.y - log2(exposure);
            if (TONEMAP_HISTOGRAM % 8 / 4 == 0) first.z = white;
            value = gl_FragCoord.x < 1.0 ? first : second;
        });

/* What a pass reads from the state. Ashikhmin's unit is the octave above the upper end of its range. */
static const char tonemap__glsl_frame[] =
    SAT__GLSL(
        uniform sampler2D luminance, state;
        uniform ivec2 picture; /* its size; the textures may be larger */
        float tonemap_key() { vec4 s = texelFetch(state, ivec2(0), 0); return s.w > 0.0 ? exp2(s.y) : 0.18; })
    SAT__GLSL(float tonemap_scale() {)
    "#if TONEMAP_OPERATOR == 2 || TONEMAP_OPERATOR == 3\n"
    SAT__GLSL(return exp2(-ceil(texelFetch(state, ivec2(1, 0), 0).y));)
    "#else\n"
    SAT__GLSL(return tonemap_key() * exp2(-texelFetch(state, ivec2(0), 0).x);)
    "#endif\n"
    SAT__GLSL(});

static const char tonemap__glsl_quantise[] =
    SAT__GLSL(
        out uint value;
        void main() {
            float v = clamp(texelFetch(luminance, ivec2(gl_FragCoord.xy), 0).x * tonemap_scale(), 0.0, TONEMAP_CAP);
            value = uint(v * TONEMAP_STEPS + 0.5);
        });

/* The guided filter's passes, with the CPU's integers: steps; sums of 21 columns of steps and their squares, or of a
   and b; of 21 rows of them, from which a and b come. The last sum is in the mapping pass. */
static const char tonemap__glsl_steps[] =
    SAT__GLSL(
        out float value;
        /* a pixel that is no measurement counts as the usable one beside it */
        float tonemap_next(ivec2 p, int step, int end) {
            float y = -1.0;
            for (; p.x != end && y < 0.0; p.x += step) y = texelFetch(luminance, p, 0).x;
            return y;
        })
    SAT__GLSL(
        void main() {
            ivec2 p = ivec2(gl_FragCoord.xy);
            float y = tonemap_next(p, -1, -1);
            if (y < 0.0) y = tonemap_next(p, 1, picture.x);
            y = clamp(y * tonemap_scale(), exp2(-TONEMAP_OCTAVES), TONEMAP_LOCAL_CAP);
            value = (log2(y) + TONEMAP_OCTAVES) * TONEMAP_OCTAVE;
        });

static const char tonemap__glsl_along[] =
    "#ifdef TONEMAP_FIRST\n"
    SAT__GLSL(
        uniform sampler2D source;
        uvec2 tonemap_read(ivec2 p) { uint q = uint(texelFetch(source, p, 0).x); return uvec2(q, q * q); })
    "#else\n"
    SAT__GLSL(
        uniform highp usampler2D source;
        uvec2 tonemap_read(ivec2 p) { return texelFetch(source, p, 0).xy; })
    "#endif\n"
    SAT__GLSL(
        uniform ivec2 picture;
        out uvec2 value;
        void main() {
            ivec2 p = ivec2(gl_FragCoord.xy);
            int end = min(p.x + TONEMAP_RADIUS + 1, picture.x);
            value = uvec2(0u);
            for (int x = max(p.x - TONEMAP_RADIUS, 0); x < end; x++) value += tonemap_read(ivec2(x, p.y));
        });

/* The sums of 21 rows of such sums, as means. */
static const char tonemap__glsl_down[] =
    SAT__GLSL(
        vec2 tonemap_mean(highp usampler2D sums, ivec2 p, ivec2 size) {
            ivec2 low = max(p - TONEMAP_RADIUS, 0);
            ivec2 high = min(p + TONEMAP_RADIUS + 1, size);
            uvec2 sum = uvec2(0u);
            for (int y = low.y; y < high.y; y++) sum += texelFetch(sums, ivec2(p.x, y), 0).xy;
            return vec2(sum) / float((high.x - low.x) * (high.y - low.y));
        });

static const char tonemap__glsl_fit[] =
    SAT__GLSL(
        uniform highp usampler2D source;
        uniform ivec2 picture;
        out uvec2 value;
        void main() {
            vec2 m = tonemap_mean(source, ivec2(gl_FragCoord.xy), picture);
            float var = max(m.y - m.x * m.x, 0.0), share = var / (var + TONEMAP_EDGE2);
            value = uvec2(share * 1048576.0, (m.x + 0.5) * (1.0 - share) * 1024.0);
        });

/* La. Soft scales and Ashikhmin's search are here, the plain search in the library. */
static const char tonemap__glsl_search[] =
    "#if TONEMAP_OPERATOR == 0 || TONEMAP_OPERATOR == 2 || TONEMAP_OPERATOR == 5\n"
    SAT__GLSL(uniform highp usampler2D table;)
    "#if TONEMAP_OPERATOR != 5\n"
    SAT__GLSL(
        float tonemap_box(ivec2 p, int reach) {
            return sat_mean(table, 1.0 / TONEMAP_STEPS, p - reach, min(p + reach + 1, picture));
        })
    "#endif\n"
    "#if TONEMAP_OPERATOR == 5\n"
    SAT__GLSL(
        uniform sampler2D steps;
        float tonemap_find(ivec2 p, float own, float key) {
            vec2 m = tonemap_mean(table, p, picture);
            float q = m.x / 1048576.0 * texelFetch(steps, p, 0).x + m.y / 1024.0;
            return exp2(q / TONEMAP_OCTAVE - TONEMAP_OCTAVES);
        })
    "#elif TONEMAP_OPERATOR == 2\n"
    SAT__GLSL(
        float tonemap_find(ivec2 p, float own, float key) {
            const int reach[20] = int[20](0, 1, 2, 3, 4, 5, 6, 6, 7, 8, 9, 10, 11, 12, 12, 13, 14, 15, 16, 17);
            float g = min(own, TONEMAP_CAP);
            for (int s = 0; s < 9; s++) {
                if (!(abs(g - tonemap_box(p, reach[2 * s + 1])) < 0.5 * g)) break;
                g = tonemap_box(p, reach[s + 1]);
            }
            return g * TONEMAP_STEPS < 1.0 ? own : g;
        })
    "#elif TONEMAP_SOFT\n"
    SAT__GLSL(
        float tonemap_find(ivec2 p, float own, float key) {
            const int reach[8] = int[8](0, 1, 2, 3, 5, 8, 13, 20);
            float c = min(own, TONEMAP_LOCAL_CAP), taken = c, weight = 1.0;
            for (int k = 1; k < TONEMAP_SCALES; k++) {
                float side = float(2 * reach[k - 1] + 1), v = tonemap_box(p, reach[k]);
                float limit = TONEMAP_EPSILON * c + TONEMAP_PHI_TERM * key / (side * side);
                weight *= clamp((1.0 + TONEMAP_SOFTNESS - abs(c - v) / limit) / (2.0 * TONEMAP_SOFTNESS), 0.0, 1.0);
                if (!(weight > 0.0)) break;
                taken += weight * (v - c);
                c = v;
            }
            return taken;
        })
    "#else\n"
    SAT__GLSL(
        float tonemap_find(ivec2 p, float own, float key) {
            return tonemap_local_in(table, 1.0 / TONEMAP_STEPS, picture, p, own, key);
        })
    "#endif\n"
    SAT__GLSL(
        float tonemap_at(ivec2 p) {
            return max(texelFetch(luminance, clamp(p, ivec2(0), picture - 1), 0).x, 0.0);
        })
    SAT__GLSL(
        bool tonemap_is_edge(ivec2 p, float scale) {
            float a = tonemap_at(p + ivec2(-1, -1)), b = tonemap_at(p + ivec2(0, -1)), c = tonemap_at(p + ivec2(1, -1));
            float d = tonemap_at(p + ivec2(-1, 0)), e = tonemap_at(p + ivec2(1, 0));
            float f = tonemap_at(p + ivec2(-1, 1)), g = tonemap_at(p + ivec2(0, 1)), h = tonemap_at(p + ivec2(1, 1));
            vec2 gradient = vec2((c + 2.0 * e + h) - (a + 2.0 * d + f), (f + 2.0 * g + h) - (a + 2.0 * b + c)) * scale;
            return dot(gradient, gradient) > TONEMAP_SELECTIVE * TONEMAP_SELECTIVE;
        })
    "#endif\n";

/* Curves of one pixel, and encodings of values in units of the peak: the CPU's. */
static const char tonemap__glsl_curves[] =
    SAT__GLSL(
        uniform float peak, peak_cd;
        uniform vec3 display_luma;)
    "#if TONEMAP_OPERATOR == 6\n"
    SAT__GLSL(
        vec3 tonemap_curve(vec3 v) {
            float x = min(min(v.r, v.g), v.b);
            v -= x < 0.08 ? x - 6.25 * x * x : 0.04;
            float most = max(max(v.r, v.g), v.b), top = 1.0 - 0.0576 / (most + 0.24 - 0.76);
            return most < 0.76 ? v : top + (v * (top / most) - top) / (0.15 * (most - top) + 1.0);
        })
    "#elif TONEMAP_OPERATOR == 7\n"
    SAT__GLSL(
        vec3 tonemap_curve(vec3 v) {
            v = mat3(0.842479062, 0.0423282422, 0.0423756549, 0.0784336, 0.878468636, 0.0784336, 0.0792237451,
                0.0791661275, 0.879142974) * v;
            vec3 x = clamp((log2(max(v, 1e-9)) + 12.47393) / 16.5, 0.0, 1.0), x2 = x * x, x4 = x2 * x2;
            v = 15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x2 * x + 0.4298 * x2 + 0.1191 * x - 0.00232;
            v = mat3(1.196879005, -0.0528968518, -0.0529716355, -0.0980208811, 1.15190313, -0.0980434501, -0.0990297441,
                -0.0989611768, 1.151073673) * v;
            return pow(max(v, 1e-9), vec3(2.2));
        })
    "#elif TONEMAP_OPERATOR == 8\n"
    SAT__GLSL(
        vec3 tonemap_curve(vec3 v) {
            v = mat3(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777) * v / 0.6;
            v = (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.4329510) + 0.238081);
            return mat3(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602) * v;
        })
    "#elif TONEMAP_OPERATOR == 9\n"
    SAT__GLSL(
        vec3 tonemap_curve(vec3 v) {
            v *= 2.0;
            return ((v * (0.15 * v + 0.05) + 0.004) / (v * (0.15 * v + 0.5) + 0.06) - 1.0 / 15.0) / 0.725129270;
        })
    "#endif\n"
    SAT__GLSL(vec3 tonemap_encode(vec3 v) {)
    "#if TONEMAP_ENCODING == 1\n"
    SAT__GLSL(return clamp(v, 0.0, 1.0) * peak;)
    "#elif TONEMAP_ENCODING == 2\n"
    SAT__GLSL(
            v = pow(clamp(v, 0.0, 1.0) * peak_cd * 1e-4 + 1e-12, vec3(0.1593017578125));
            return pow((0.8359375 + 18.8515625 * v) / (1.0 + 18.6875 * v), vec3(78.84375));)
    "#elif TONEMAP_ENCODING == 3\n"
    SAT__GLSL(
            v = clamp(v, 0.0, 1.0);
            float power = 1.0 / (1.2 + 0.42 * log(peak_cd / 1000.0) / log(10.0)) - 1.0;
            v = min(v * pow(max(dot(display_luma, v), 1e-9), power), 1.0);
            return mix(sqrt(3.0 * v), 0.17883277 * log(max(12.0 * v - 0.28466892, 1e-9)) + 0.55991073,
                greaterThan(v, vec3(1.0 / 12.0)));)
    "#else\n"
    SAT__GLSL(return tonemap_srgb(v);)
    "#endif\n"
    SAT__GLSL(});

/* Local luminance, mesopic vision, display luminance and colour in one pass. */
static const char tonemap__glsl_map[] =
    SAT__GLSL(
        uniform sampler2D hdr;
        uniform float cd_per_unit, lux_per_cd;
        uniform vec3 luma, mix_r, mix_g, mix_b, red_x, red_step;
        uniform int mixes;
        out vec4 value;
        float tonemap_capacity(float cd) {
            float ln = log(max(cd, TONEMAP_DARKEST));
)
    "return " SAT__TEXT(TONEMAP__CAPACITY(cd, ln)) ";\n"
    SAT__GLSL(
        })
    SAT__GLSL(
        vec3 tonemap_gamut(vec3 v, float grey) {
            v = min(max(v, 0.0), TONEMAP_GAMUT_TOP);
            float top = max(max(v.r, v.g), v.b);
            if (TONEMAP_GAMUT < 0.0 || !(top > 1.0)) return v;
            float dim = exp2(-TONEMAP_GAMUT * log2(top));
            grey = min(grey, 1.0) * dim;
            return grey + (v * dim - grey) * min((1.0 - grey) / max(top * dim - grey, 1e-20), 1.0);
        })
    SAT__GLSL(
        vec3 tonemap_display(ivec2 p) {
            vec3 rgb = texelFetch(hdr, p + sat_from, 0).rgb;
            vec4 first = texelFetch(state, ivec2(0), 0), second = texelFetch(state, ivec2(1, 0), 0);
            float y = texelFetch(luminance, p, 0).x, scale = tonemap_scale(), key = tonemap_key(), own = y * scale,
                la = own, beyond = 1.0;
            float cd = cd_per_unit > 0.0 ? cd_per_unit : 10.0 * exp2(-first.x);
            float lux = (cd_per_unit > 0.0 ? cd_per_unit : exp2(-first.x)) * lux_per_cd;
            float gain;
            if (!(y > 0.0)) return tonemap_encode(vec3(0.0));
            if (!(y < TONEMAP_BRIGHTEST)) {
                float light = luma.r * rgb.r + luma.g * rgb.g + luma.b * rgb.b;
                if (floatBitsToUint(light) >= 0x7f800000u) /* infinite */
                    return tonemap_encode(vec3(TONEMAP_OPERATOR > 5 ? 1.0 / peak : 1.0));
                rgb *= y / light;
            }
            if (mixes > 0) {
                rgb = vec3(dot(mix_r, rgb), dot(mix_g, rgb), dot(mix_b, rgb));
                float lowest = min(min(rgb.r, rgb.g), rgb.b);
                if (lowest < 0.0) rgb = y + (rgb - y) * (y / (y - lowest));
            })
    "#if TONEMAP_OPERATOR == 5\n"
    SAT__GLSL(
            la = tonemap_find(p, own, key);
            beyond = max(own / TONEMAP_CAP, 1.0);)
    "#elif TONEMAP_OPERATOR == 0 || TONEMAP_OPERATOR == 2\n"
    SAT__GLSL(
            if (TONEMAP_SELECTIVE <= 0.0 || tonemap_is_edge(p, scale)) {
                la = tonemap_find(p, own, key);
                beyond = max(own / TONEMAP_CAP, 1.0);
            })
    "#endif\n"
    "#if TONEMAP_MESOPIC == 1\n"
    SAT__GLSL(rgb = tonemap_mesopic_in(rgb, y, tonemap_rho(exp2(first.x) * lux), red_x, red_step);)
    "#elif TONEMAP_MESOPIC == 2\n"
    SAT__GLSL(rgb = tonemap_mesopic_in(rgb, y, tonemap_rho(la / scale * lux), red_x, red_step);)
    "#endif\n"
    "#if TONEMAP_OPERATOR == 2 || TONEMAP_OPERATOR == 3\n"
    SAT__GLSL(
            float low = tonemap_capacity(cd * exp2(second.x)), high = tonemap_capacity(cd * exp2(second.y)),
                display = key;
            if (second.y - second.x > 0.125) display = (tonemap_capacity(la * cd / scale) - low) / (high - low);
            gain = max(display, 0.0) * scale / max(la, TONEMAP_DARKEST);)
    "#elif TONEMAP_OPERATOR == 4\n"
    SAT__GLSL(gain = scale * (TONEMAP_BURN == 1 ? exp2(-first.z) : 1.0 / peak);)
    "#elif TONEMAP_OPERATOR > 5\n"
    SAT__GLSL(return tonemap_encode(clamp(tonemap_curve(clamp(rgb * scale, 0.0, 1e9)), 0.0, 1.0) / peak);)
    "#else\n"
    SAT__GLSL(
            float burn = TONEMAP_BURN == 1 ? peak * exp2(-2.0 * first.z) : 0.0;
            gain = scale * (1.0 + min(own, 1.1529215e18) * burn) / (peak + la * beyond);)
    "#endif\n"
    SAT__GLSL(
            return tonemap_encode(tonemap_gamut(rgb * gain, y * gain));
        })
    SAT__GLSL(
        void main() {
            ivec2 p = sat_pixel(), high = picture - 1;
            vec4 sum = vec4(0.0);
            int radius = texelFetch(luminance, p, 0).x < 0.0 ? 1 : 0; /* an unusable pixel shows those around it */
            for (int last = radius * 3; radius <= last && sum.a == 0.0; radius++)
                for (int y = max(p.y - radius, 0); y <= min(p.y + radius, high.y); y++)
                    for (int x = max(p.x - radius, 0); x <= min(p.x + radius, high.x); x++)
                        if (texelFetch(luminance, ivec2(x, y), 0).x >= 0.0)
                            sum += vec4(tonemap_display(ivec2(x, y)), 1.0);
            value = vec4(sum.rgb / max(sum.a, 1.0), 1.0);)
    "#if TONEMAP_DITHER\n"
    SAT__GLSL(
            int d = p.x ^ p.y, threshold = (d & 1) << 7 | (p.y & 1) << 6 | (d & 2) << 4 | (p.y & 2) << 3 | (d & 4) << 1
                | (p.y & 4);
            value.rgb = floor(value.rgb * 255.0 + float(threshold + 2) / 256.0) / 255.0;)
    "#endif\n"
    SAT__GLSL(});

/* ---- >> passes of OpenGL */

/* What is made for some options only. */
enum {
    TONEMAP__IF_GUIDED = 1, TONEMAP__IF_TABLE = 2, TONEMAP__IF_HISTOGRAM = 4,
    TONEMAP__IF_BLENDED = 8, TONEMAP__IF_COUNTED = 16 /* how the histogram is made */
};

/* The programs, in the order of the table. */
enum {
    TONEMAP__GL_LUMINANCE, TONEMAP__GL_LOGARITHMS, TONEMAP__GL_REDUCE, TONEMAP__GL_BLEND, TONEMAP__GL_NOTHING,
    TONEMAP__GL_COUNT, TONEMAP__GL_ROWS, TONEMAP__GL_ADAPT,
    TONEMAP__GL_ROUND, TONEMAP__GL_STEPS, TONEMAP__GL_SUMS, TONEMAP__GL_FIT, TONEMAP__GL_SUMS_OF_FITS, TONEMAP__GL_MAP,
    TONEMAP__GL_PROGRAMS
};

static const char *const tonemap__points[] = {tonemap__glsl_scatter, NULL};

static const sat__gl_program tonemap__programs[TONEMAP__GL_PROGRAMS] = {
    {"tonemap: luminance", 0, "hdr", NULL, NULL, {SAT__GL_FROM, tonemap__glsl_luminance}},
    {"tonemap: log-average", 0, "source mask", "#define TONEMAP_FIRST\n", NULL, {tonemap__glsl_reduce}},
    {"tonemap: reduction", 0, "source", NULL, NULL, {tonemap__glsl_reduce}},
    {"tonemap: histogram", TONEMAP__IF_BLENDED, "luminance mask", NULL, tonemap__points, {tonemap__glsl_count}},
    {"tonemap: no counts", TONEMAP__IF_COUNTED, "", NULL, NULL, {tonemap__glsl_nothing}},
    {"tonemap: counts", TONEMAP__IF_COUNTED | SAT__GL_COMPUTE, "luminance mask", NULL, NULL, {tonemap__glsl_squares}},
    {"tonemap: rows", TONEMAP__IF_HISTOGRAM, "histogram", NULL, NULL, {tonemap__glsl_rows}},
    {"tonemap: adaptation", 0, "sums old histogram rows", NULL, NULL,
     {tonemap__glsl_stats, tonemap__glsl_state}},
    {"tonemap: rounding", TONEMAP__IF_TABLE, "luminance state", NULL, NULL, {tonemap__glsl_frame, tonemap__glsl_quantise}},
    {"tonemap: steps", TONEMAP__IF_GUIDED, "luminance state", NULL, NULL, {tonemap__glsl_frame, tonemap__glsl_steps}},
    {"tonemap: sums", TONEMAP__IF_GUIDED, "source", "#define TONEMAP_FIRST\n", NULL, {tonemap__glsl_along}},
    {"tonemap: a and b", TONEMAP__IF_GUIDED, "source", NULL, NULL, {tonemap__glsl_down, tonemap__glsl_fit}},
    {"tonemap: sums of a and b", TONEMAP__IF_GUIDED, "source", NULL, NULL, {tonemap__glsl_along}},
    {"tonemap: mapping", 0, "hdr luminance state table steps", NULL, NULL,
     {tonemap__glsl_frame, SAT__GL_FROM SAT__GL_PIXEL, tonemap__glsl_down, tonemap__glsl_search, tonemap__glsl_curves,
      tonemap__glsl_map}}};

/* What they draw into, in the order of the table; of the state [0] is the new one. */
enum { TONEMAP__LEVELS = 14, TONEMAP__BIN_ROWS = (TONEMAP__BINS + 63) / 64, TONEMAP__GL_UNITS = 5 };
enum {
    TONEMAP__T_LUMINANCE, TONEMAP__T_OUT, TONEMAP__T_STATE, TONEMAP__T_OLD_STATE, TONEMAP__T_BINS, TONEMAP__T_COUNTS,
    TONEMAP__T_ROWS, TONEMAP__T_QUANTA,
    TONEMAP__T_STEPS, TONEMAP__T_PAIR, TONEMAP__T_PAIR_1, TONEMAP__T_LEVEL, TONEMAP__TARGETS = TONEMAP__T_LEVEL + 14
};

static const struct { int when; unsigned internal; int width, height; } tonemap__targets[TONEMAP__T_LEVEL] = {
    {0, SAT__GL_R32F, 0, 0}, /* 0: as the picture */
    {0, SAT__GL_RGBA8, 0, 0},
    {0, SAT__GL_RGBA32F, 2, 1},
    {0, SAT__GL_RGBA32F, 2, 1},
    {TONEMAP__IF_BLENDED, SAT__GL_R32F, 64, TONEMAP__BIN_ROWS},
    {TONEMAP__IF_COUNTED, SAT__GL_R32UI, 64, TONEMAP__BIN_ROWS},
    {TONEMAP__IF_HISTOGRAM, SAT__GL_R32F, 1, TONEMAP__BIN_ROWS},
    {TONEMAP__IF_TABLE, SAT__GL_R32UI, 0, 0},
    {TONEMAP__IF_GUIDED, SAT__GL_R32F, 0, 0},
    {TONEMAP__IF_GUIDED, SAT__GL_RG32UI, 0, 0},
    {TONEMAP__IF_GUIDED, SAT__GL_RG32UI, 0, 0}};

struct tonemap_gl {
    sat__gl gl;
    tonemap_options options;
    sat_allocator allocator;
    sat_gl *sat;                /* NULL without a table */
    tonemap__colours colours;
    int width, height, levels, given;
    int frame_width, frame_height; /* of this picture; at most width and height */
    int histogram;              /* 0, or the estimates it serves, see the state shader */
    int ready;                  /* all programs are there */
    unsigned program[TONEMAP__GL_PROGRAMS], mask;
    sat__gl_target target[TONEMAP__TARGETS]; /* from TONEMAP__T_LEVEL on those of the sums of 4 x 4, finest first; their
                                                sizes are the part in use */
};

TONEMAP_DEF const char *tonemap_gl_message(const tonemap_gl *gl)
{
    if (!gl) return "no object";
    return gl->sat && sat_gl_message(gl->sat)[0] ? sat_gl_message(gl->sat) : gl->gl.message;
}

TONEMAP_DEF unsigned tonemap_gl_texture(const tonemap_gl *gl) { return gl ? gl->target[TONEMAP__T_OUT].texture : 0; }

static inline void tonemap__gl_define_options(tonemap_gl *g)
{
    const tonemap_options *o = &g->options;
    int ashikhmin = tonemap__is_ashikhmin(o);
    sat__gl *gl = &g->gl;
    sat__gl_define(gl, "TONEMAP_OPERATOR", (int)(o->operation == TONEMAP_PHOTOGRAPHIC_LOCAL && o->scales == 1 ? TONEMAP_PHOTOGRAPHIC_GLOBAL : o->operation));
    sat__gl_define(gl, "TONEMAP_MESOPIC", (int)o->mesopic);
    sat__gl_define(gl, "TONEMAP_SCALES", o->scales);
    sat__gl_define(gl, "TONEMAP_SOFT", o->soft > 0);
    sat__gl_define(gl, "TONEMAP_METERING", (int)o->metering);
    sat__gl_define_float(gl, "TONEMAP_METER_LOW", (float)o->meter_low);
    sat__gl_define_float(gl, "TONEMAP_METER_HIGH", (float)o->meter_high);
    sat__gl_define(gl, "TONEMAP_HISTOGRAM", g->histogram);
    sat__gl_define(gl, "TONEMAP_MASK", o->meter_weights != NULL);
    sat__gl_define(gl, "TONEMAP_ENCODING", (int)o->encoding);
    sat__gl_define(gl, "TONEMAP_DITHER", o->dither);
    sat__gl_define(gl, "TONEMAP_BINS", TONEMAP__BIN_ROWS * 64);
    sat__gl_define(gl, "TONEMAP_LOWEST", (int)TONEMAP__DARKEST_BITS);
    sat__gl_define(gl, "TONEMAP_RADIUS", TONEMAP__RADIUS);
    sat__gl_define_float(gl, "TONEMAP_OCTAVES", TONEMAP__OCTAVES);
    sat__gl_define_float(gl, "TONEMAP_OCTAVE", TONEMAP__STEPS); /* in steps */
    sat__gl_define_float(gl, "TONEMAP_LOCAL_CAP", TONEMAP__LOCAL_CAP);
    sat__gl_define_float(gl, "TONEMAP_DARKEST", TONEMAP__DARKEST);
    sat__gl_define_float(gl, "TONEMAP_BRIGHTEST", TONEMAP__BRIGHTEST);
    sat__gl_define_float(gl, "TONEMAP_GAMUT_TOP", TONEMAP__GAMUT_TOP);
    sat__gl_define_float(gl, "TONEMAP_HIGHLIGHTS", (float)TONEMAP__HIGHLIGHTS);
    sat__gl_define_text(gl, "TONEMAP_COUNTS", g->given & TONEMAP__IF_COUNTED ? "usampler2D" : "sampler2D");
    sat__gl_define(gl, "TONEMAP_BURN",
                   !tonemap__is_infinite(o->white) && (o->white > 0 || o->operation != TONEMAP_LINEAR));
    sat__gl_define_float(gl, "TONEMAP_EPSILON", (float)o->epsilon);
    sat__gl_define_float(gl, "TONEMAP_PHI_TERM", (float)(o->epsilon * exp2(o->phi)));
    sat__gl_define_float(gl, "TONEMAP_GAMUT", o->gamut < 0 ? -1.0f : (float)o->gamut);
    sat__gl_define_float(gl, "TONEMAP_SOFTNESS", (float)o->soft);
    sat__gl_define_float(gl, "TONEMAP_EDGE2", (float)(o->edge * o->edge) * (TONEMAP__STEPS * TONEMAP__STEPS));
    sat__gl_define_float(gl, "TONEMAP_SELECTIVE", (float)o->selective);
    sat__gl_define_float(gl, "TONEMAP_CAP", ashikhmin ? 1.0f : TONEMAP__LOCAL_CAP);
    sat__gl_define_float(gl, "TONEMAP_STEPS", ashikhmin ? TONEMAP__ASHIKHMIN_QUANTUM : TONEMAP__QUANTUM);
}

static inline sat_result tonemap__gl_make_mask(tonemap_gl *g)
{
    size_t n = (size_t)g->width * (size_t)g->height, i;
    float *weights = n > SIZE_MAX / sizeof(float) ? NULL : (float *)sat__alloc(&g->allocator, n * sizeof(float));
    sat_result r;
    if (!weights) return SAT_ERR_MEMORY;
    for (i = 0; i < n; i++) {
        uint32_t weight = tonemap__mask_weight(g->options.meter_weights[i]);
        weights[i] = (float)weight;
    }
    r = sat__gl_texture(&g->gl, &g->mask, SAT__GL_R32F, g->width, g->height, weights);
    sat__release(&g->allocator, weights, n * sizeof(float));
    return r;
}

static inline sat_result tonemap__gl_make_targets(tonemap_gl *g)
{
    static const float nothing[4] = {0, 0, 0, 0};
    int i, width = g->width, height = g->height;
    sat_result r = SAT_OK;
    for (i = 0; i < TONEMAP__T_LEVEL && r == SAT_OK; i++)
        if ((tonemap__targets[i].when & g->given) == tonemap__targets[i].when) {
            int w = tonemap__targets[i].width, h = tonemap__targets[i].height;
            r = sat__gl_make_target(&g->gl, &g->target[i], tonemap__targets[i].internal, w ? w : width, h ? h : height);
            if (r == SAT_OK && w == 2) g->gl.ClearBufferfv(SAT__GL_COLOR, 0, nothing); /* the state */
        }
    while (r == SAT_OK && (g->levels == 0 || width > 1 || height > 1)) {
        width = (width + 3) / 4;
        height = (height + 3) / 4;
        r = sat__gl_make_target(&g->gl, &g->target[TONEMAP__T_LEVEL + g->levels], SAT__GL_RGBA32I, width, height);
        g->levels++;
    }
    return r == SAT_OK && g->options.meter_weights ? tonemap__gl_make_mask(g) : r;
}

static inline void tonemap__gl_blend(tonemap_gl *g);

/* OpenGL ES blends into floats of 32 bits only with an extension, and says so when it draws. */
static inline sat_result tonemap__gl_try_blending(tonemap_gl *g)
{
    sat__gl_clear_errors(&g->gl);
    tonemap__gl_blend(g);
    if (g->gl.GetError() == SAT__GL_NO_ERROR) return SAT_OK;
    return sat__gl_fail(&g->gl, SAT_ERR_GL_STATE,
                        "the context lacks EXT_float_blend, which metering by percentiles (the default), an estimated key "
                        "or white, and Ashikhmin need; TONEMAP_METERING_LOG_AVERAGE with a white above 0 does without",
                        NULL);
}

static inline sat_result tonemap__gl_make(tonemap_gl *g, sat_gl_get_proc *get_proc)
{
    const tonemap_options *o = &g->options;
    const char *const library[3] = {sat_gl_glsl(), tonemap_gl_glsl(), NULL};
    sat__gl_state state;
    sat_gl_options table = sat_gl_defaults();
    sat_result r = sat__gl_open(&g->gl, get_proc);
    if (r != SAT_OK) return r;
    if (o->operation == TONEMAP_ASHIKHMIN || (o->operation == TONEMAP_PHOTOGRAPHIC_LOCAL && o->scales > 1)) {
        table.format = SAT_GL_FIXED32;
        table.unsigned_input = 1;
        table.width = g->width;
        table.height = g->height;
        table.allocator = g->allocator;
        r = sat_gl_create(&g->sat, get_proc, &table);
        if (r != SAT_OK) return r;
    }
    g->histogram = (tonemap__is_ashikhmin(o) ? 1 : 0) + (o->key > 0 ? 0 : 2) + (o->white > 0 ? 0 : 4) +
                   (o->metering == TONEMAP_METERING_PERCENTILES ? 8 : 0);
    g->given = (o->operation == TONEMAP_GUIDED ? TONEMAP__IF_GUIDED : 0) | (g->sat ? TONEMAP__IF_TABLE : 0) |
               (!g->histogram      ? 0
                : g->gl.has_compute ? TONEMAP__IF_HISTOGRAM | TONEMAP__IF_COUNTED
                                    : TONEMAP__IF_HISTOGRAM | TONEMAP__IF_BLENDED);
    sat__gl_begin(&g->gl, &state, TONEMAP__GL_UNITS);
    r = tonemap__gl_make_targets(g);
    tonemap__gl_define_options(g);
    if (r == SAT_OK)
        r = sat__gl_build_table(&g->gl, g->program, tonemap__programs, TONEMAP__GL_PROGRAMS, g->given, library);
    if (r == SAT_OK && g->given & TONEMAP__IF_BLENDED && g->gl.is_es) r = tonemap__gl_try_blending(g);
    g->ready = r == SAT_OK;
    sat__gl_end(&g->gl, &state);
    return r;
}

TONEMAP_DEF sat_result tonemap_gl_create(tonemap_gl **out, sat_gl_get_proc *get_proc, int width, int height,
                                         const tonemap_options *options)
{
    tonemap_options o = options ? *options : tonemap_defaults();
    sat_allocator allocator;
    tonemap_gl *g;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    if (!get_proc || width < 1 || height < 1 || width > 1 << 24 || height > 1 << 24 || !tonemap__options_are_valid(&o))
        return SAT_ERR_ARGUMENT;
    if (!sat__resolve_allocator(&allocator, &o.allocator)) return SAT_ERR_ARGUMENT;
    g = (tonemap_gl *)sat__alloc(&allocator, sizeof *g);
    if (!g) return SAT_ERR_MEMORY;
    memset(g, 0, sizeof *g);
    g->options = o;
    tonemap__prepare_colours(&g->colours, &o);
    g->allocator = allocator;
    g->width = g->frame_width = width;
    g->height = g->frame_height = height;
    *out = g;
    return tonemap__gl_make(g, get_proc);
}

/* Whether two sets of options have the same shaders: all but uniforms is the same. */
static inline int tonemap__gl_same_programs(const tonemap_options *a, const tonemap_options *b)
{
    static const char uniforms[] = " key white exposure adapt_seconds darker_seconds adapt_low adapt_high cd_per_unit "
                                   "lux_per_cd primaries display balance_red balance_green balance_blue peak white_cd ";
    int i;
    for (i = 0; i < SAT__COUNT(tonemap__fields); i++) {
        const sat__field *f = &tonemap__fields[i];
        double x = sat__field_value(f, a), y = sat__field_value(f, b);
        if (!strstr(uniforms, f->name) && (x < y || x > y)) return 0;
    }
    return (a->key > 0) == (b->key > 0) && (a->white > 0) == (b->white > 0) &&
           tonemap__is_infinite(a->white) == tonemap__is_infinite(b->white) && a->meter_weights == b->meter_weights;
}

TONEMAP_DEF sat_result tonemap_gl_set_options(tonemap_gl *gl, const tonemap_options *options)
{
    tonemap_options o = options ? *options : tonemap_defaults();
    if (!gl || !gl->ready || !tonemap__options_are_valid(&o) || !tonemap__gl_same_programs(&gl->options, &o))
        return SAT_ERR_ARGUMENT;
    gl->options = o;
    tonemap__prepare_colours(&gl->colours, &o);
    return SAT_OK;
}

TONEMAP_DEF void tonemap_gl_destroy(tonemap_gl *gl)
{
    sat_allocator allocator;
    sat__gl *t;
    if (!gl) return;
    t = &gl->gl;
    allocator = gl->allocator;
    sat_gl_destroy(gl->sat);
    if (t->vertex_array) {
        int i;
        sat__gl_delete_programs(t, gl->program, TONEMAP__GL_PROGRAMS);
        for (i = 0; i < TONEMAP__TARGETS; i++) sat__gl_free_target(t, &gl->target[i]);
        t->DeleteTextures(1, &gl->mask);
        sat__gl_close(t);
    }
    sat__release(&allocator, gl, sizeof *gl);
}

/* ---- the passes of a picture */

/* Smaller pictures take a part of the textures. */
static inline void tonemap__gl_set_size(tonemap_gl *g, int width, int height)
{
    int i;
    if (g->frame_width == width && g->frame_height == height) return;
    g->frame_width = width;
    g->frame_height = height;
    for (i = 0; i < TONEMAP__T_LEVEL + g->levels; i++) {
        if (i >= TONEMAP__T_LEVEL) {
            width = (width + 3) / 4;
            height = (height + 3) / 4;
        } else if (tonemap__targets[i].width) {
            continue;
        }
        g->target[i].width = width;
        g->target[i].height = height;
    }
}

static inline void tonemap__gl_set_picture(tonemap_gl *g, int which)
{
    sat__gl_set_int2(&g->gl, g->program[which], "picture", g->frame_width, g->frame_height);
}

/* A pass that reads at most two textures, from one that is as large as the picture into another. */
static inline void tonemap__gl_step(tonemap_gl *g, int which, int to, unsigned first, unsigned second)
{
    SAT__GL_START(&g->gl, g->program[which], &g->target[to], first, second);
    tonemap__gl_set_picture(g, which);
    sat__gl_draw(&g->gl);
}

static inline void tonemap__gl_measure(tonemap_gl *g, const sat_gl_target *to, unsigned hdr)
{
    sat__gl *gl = &g->gl;
    const sat__gl_target *from = &g->target[TONEMAP__T_LUMINANCE], *level = &g->target[TONEMAP__T_LEVEL];
    unsigned program = g->program[TONEMAP__GL_LUMINANCE];
    int i;
    SAT__GL_START(gl, program, from, hdr);
    sat__gl_set_from(gl, program, to);
    sat__gl_set_float3(gl, program, "luma", g->colours.luma);
    sat__gl_draw(gl);
    for (i = 0; i < g->levels; i++, from = level++) {
        program = g->program[i ? TONEMAP__GL_REDUCE : TONEMAP__GL_LOGARITHMS];
        SAT__GL_START(gl, program, level, from->texture, g->mask);
        sat__gl_set_int2(gl, program, "size", from->width, from->height);
        sat__gl_draw(gl);
    }
}

/* As floats: what ES draws into. */
static inline void tonemap__gl_blend(tonemap_gl *g)
{
    static const float nothing[4] = {0, 0, 0, 0};
    sat__gl *gl = &g->gl;
    SAT__GL_START(gl, g->program[TONEMAP__GL_BLEND], &g->target[TONEMAP__T_BINS],
                  g->target[TONEMAP__T_LUMINANCE].texture, g->mask);
    gl->ClearBufferfv(SAT__GL_COLOR, 0, nothing);
    gl->Enable(SAT__GL_BLEND);
    gl->BlendEquationSeparate(0x8006u, 0x8006u); /* GL_FUNC_ADD */
    gl->BlendFuncSeparate(SAT__GL_ONE, SAT__GL_ONE, SAT__GL_ONE, SAT__GL_ONE);
    tonemap__gl_set_picture(g, TONEMAP__GL_BLEND);
    gl->BindVertexArray(gl->vertex_array);
    gl->DrawArrays(SAT__GL_POINTS, 0, g->frame_width * g->frame_height);
    gl->Disable(SAT__GL_BLEND);
}

static inline void tonemap__gl_count(tonemap_gl *g)
{
    sat__gl *gl = &g->gl;
    const sat__gl_target *t = g->target, *counts = &t[TONEMAP__T_BINS];
    if (g->given & TONEMAP__IF_COUNTED) {
        counts = &t[TONEMAP__T_COUNTS];
        SAT__GL_PASS(gl, g->program[TONEMAP__GL_NOTHING], counts, 0);
        gl->UseProgram(g->program[TONEMAP__GL_COUNT]);
        SAT__GL_INPUTS(gl, t[TONEMAP__T_LUMINANCE].texture, g->mask);
        gl->BindImageTexture(0, counts->texture, 0, 0, 0, SAT__GL_READ_WRITE, SAT__GL_R32UI);
        tonemap__gl_set_picture(g, TONEMAP__GL_COUNT);
        gl->DispatchCompute((unsigned)(g->frame_width + 63) / 64, (unsigned)(g->frame_height + 63) / 64, 1);
        gl->MemoryBarrier(SAT__GL_TEXTURE_FETCH_BARRIER_BIT | SAT__GL_FRAMEBUFFER_BARRIER_BIT);
    } else {
        tonemap__gl_blend(g);
    }
    SAT__GL_PASS(gl, g->program[TONEMAP__GL_ROWS], &t[TONEMAP__T_ROWS], counts->texture);
}

static inline void tonemap__gl_adapt(tonemap_gl *g, double dt)
{
    sat__gl *gl = &g->gl;
    const tonemap_options *o = &g->options;
    sat__gl_target *t = g->target, old = t[TONEMAP__T_STATE];
    unsigned program = g->program[TONEMAP__GL_ADAPT];
    t[TONEMAP__T_STATE] = t[TONEMAP__T_OLD_STATE];
    t[TONEMAP__T_OLD_STATE] = old;
    SAT__GL_START(gl, program, &t[TONEMAP__T_STATE], t[TONEMAP__T_LEVEL + g->levels - 1].texture, old.texture,
                  t[g->given & TONEMAP__IF_COUNTED ? TONEMAP__T_COUNTS : TONEMAP__T_BINS].texture,
                  t[TONEMAP__T_ROWS].texture);
    sat__gl_set_float(gl, program, "weight", (float)tonemap__share(o, 0, dt));
    sat__gl_set_float(gl, program, "weight_darker", (float)tonemap__share(o, 1, dt));
    sat__gl_set_float(gl, program, "exposure", (float)o->exposure);
    sat__gl_set_float(gl, program, "lowest", (float)tonemap__limited(-200, o));
    sat__gl_set_float(gl, program, "highest", (float)tonemap__limited(200, o));
    sat__gl_set_float(gl, program, "dead_band", o->adapt_seconds > 0 ? 1.0f : -1.0f);
    sat__gl_set_float(gl, program, "key", o->key > 0 ? (float)log2(o->key) : 0);
    sat__gl_set_float(gl, program, "white", o->white > 0 && !tonemap__is_infinite(o->white) ? (float)log2(o->white) : 0);
    sat__gl_set_float(gl, program, "pixels", (float)((double)g->frame_width * g->frame_height));
    sat__gl_draw(gl);
}

/* What La comes from: the table, or the guided filter's a and b. */
static inline sat_result tonemap__gl_local(tonemap_gl *g)
{
    const sat__gl_target *t = g->target;
    const unsigned luminance = t[TONEMAP__T_LUMINANCE].texture, state = t[TONEMAP__T_STATE].texture;
    if (g->given & TONEMAP__IF_GUIDED) {
        tonemap__gl_step(g, TONEMAP__GL_STEPS, TONEMAP__T_STEPS, luminance, state);
        tonemap__gl_step(g, TONEMAP__GL_SUMS, TONEMAP__T_PAIR, t[TONEMAP__T_STEPS].texture, 0);
        tonemap__gl_step(g, TONEMAP__GL_FIT, TONEMAP__T_PAIR_1, t[TONEMAP__T_PAIR].texture, 0);
        tonemap__gl_step(g, TONEMAP__GL_SUMS_OF_FITS, TONEMAP__T_PAIR, t[TONEMAP__T_PAIR_1].texture, 0);
    }
    if (!g->sat) return SAT_OK;
    tonemap__gl_step(g, TONEMAP__GL_ROUND, TONEMAP__T_QUANTA, luminance, state);
    return sat_gl_build(g->sat, 0, t[TONEMAP__T_QUANTA].texture, g->frame_width, g->frame_height);
}

static inline sat_result tonemap__gl_map(tonemap_gl *g, const sat_gl_target *to, unsigned hdr)
{
    sat__gl *gl = &g->gl;
    const sat__gl_target *t = g->target;
    unsigned program = g->program[TONEMAP__GL_MAP];
    sat_result result = sat__gl_pass_to(gl, program, to, t[TONEMAP__T_OUT].framebuffer, g->frame_width,
                                        g->frame_height);
    if (result != SAT_OK) return result;
    SAT__GL_INPUTS(gl, hdr, t[TONEMAP__T_LUMINANCE].texture, t[TONEMAP__T_STATE].texture,
                   g->sat ? sat_gl_table(g->sat) : t[TONEMAP__T_PAIR].texture, t[TONEMAP__T_STEPS].texture);
    sat__gl_set_from(gl, program, to);
    tonemap__gl_set_picture(g, TONEMAP__GL_MAP);
    sat__gl_set_float(gl, program, "cd_per_unit", (float)g->options.cd_per_unit);
    sat__gl_set_float(gl, program, "lux_per_cd", (float)g->options.lux_per_cd);
    sat__gl_set_float(gl, program, "peak", (float)g->options.peak);
    sat__gl_set_float(gl, program, "peak_cd", (float)(g->options.peak * g->options.white_cd));
    sat__gl_set_int(gl, program, "mixes", g->colours.mixes);
    sat__gl_set_float3(gl, program, "luma", g->colours.luma);
    sat__gl_set_float3(gl, program, "mix_r", g->colours.mix);
    sat__gl_set_float3(gl, program, "mix_g", g->colours.mix + 3);
    sat__gl_set_float3(gl, program, "mix_b", g->colours.mix + 6);
    sat__gl_set_float3(gl, program, "red_x", g->colours.red_x);
    sat__gl_set_float3(gl, program, "red_step", g->colours.red_step);
    sat__gl_set_float3(gl, program, "display_luma", g->colours.display_luma);
    sat__gl_draw(gl);
    sat__gl_release_target(gl, to);
    return SAT_OK;
}

TONEMAP_DEF sat_result tonemap_gl_apply(tonemap_gl *gl, const sat_gl_target *to, unsigned hdr, double dt)
{
    sat__gl_state state;
    sat_result result;
    int width, height;
    if (!gl || !gl->ready || !hdr || !sat__gl_target_is_valid(to) || sat__gl_target_is(to, hdr))
        return SAT_ERR_ARGUMENT;
    if (!tonemap__in_range(dt, 0, 1e300) && !tonemap__is_infinite(dt)) return SAT_ERR_ARGUMENT;
    width = gl->width;
    height = gl->height;
    if (!sat__gl_take_size(to, &width, &height)) return SAT_ERR_SIZE;
    tonemap__gl_set_size(gl, width, height);
    sat__gl_begin(&gl->gl, &state, TONEMAP__GL_UNITS);
    tonemap__gl_measure(gl, to, hdr);
    if (gl->histogram) tonemap__gl_count(gl);
    tonemap__gl_adapt(gl, dt);
    result = tonemap__gl_local(gl);
    if (result == SAT_OK) result = tonemap__gl_map(gl, to, hdr);
    sat__gl_end(&gl->gl, &state);
    return result;
}

#ifdef __cplusplus
}
#endif
SAT__IEEE_END
#endif /* TONEMAP_GL */

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
