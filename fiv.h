/* fiv.h - 0.1.0 - fullsphere irradiance vectors: soft shadows from any environment - SPDX-License-Identifier: MIT-0 OR
   Unlicense

   Soft shadows of moving and turning meshes under any environment map, at a fixed cost for each occluder and receiver.

   USE

       #define SAT_IMPLEMENTATION             // in exactly one C or C++ file; sat.h lies beside; link with -lm
       #define FIV_IMPLEMENTATION
       #include "fiv.h"

       fiv_environment_create(&sky, &equirect, NULL, NULL);
       fiv_occluder_create(&bunny, positions, vertex_count, indices, triangle_count, NULL, NULL); // once: seconds
       fiv_occluder_light(bunny, sky, rotation);                   // new light or orientation: milliseconds
       instance.occluder = bunny, instance.scale = 1;              // and its position
       fiv_irradiance(rgb, points, normals, count, sky, &instance, 1, NULL, NULL);                // every frame
       fiv_occluder_destroy(bunny), fiv_environment_destroy(sky);

   Radiance of a diffuse receiver is colour / pi times rgb.

   WHAT IT DOES

   Michael 2010, chapter 3. A fullsphere irradiance vector (FIV, eq 10) is the sum of light times direction over a part
   of the environment; its product with a normal is irradiance (eq 11). For a set of positions of an occluder around a
   receiver, the vector of the light that it hides is known beforehand; a receiver interpolates eight of them and
   subtracts the product with its normal from what it would get in the open (eq 12). Self-shadows take what is left
   instead (eq 13). Beyond the thesis:
   - What is stored is not the light but the mask, as spans of texels on the rows of a cube. A mask's vector is a sum of
     differences of prefix sums, so a new environment, a turned one, or a turned occluder costs milliseconds.
   - Masks are drawn without clipping: a triangle seen from the receiver is a cone, and a cone cuts a row in one
     interval.
   - rho^2 times the vector is interpolated, samples inside the mesh are left out, and where the horizon cuts an
     occluder (by the extent of the mesh, not of its ball) a clipped cap in closed form stands for it; the published
     factor (d + R) / 2R makes a FIV, which is too small there, smaller still, and remains as FIV_TRILINEAR.
   - Suns and lamps, up to 32, leave the cube as directional lights with their direction, power and angular size. Each
     occluder has a depth map along each of them; the light's disc past it is the penumbra, a ray answers where the map
     of a sharp sun is not sure.
   - Near contact no interpolation is right, nor on the mesh itself: there 384 depth maps of the mesh along fixed
     directions ("views") say how much of the light around each is covered. Neither light nor rotation enters them;
     they are made once. Parallel to the faces of a cube, they are looked up by a column, a row and a depth. Of up to 32
     triangles (a box, a wall) rays along the views say it: depth maps blur the edge of what is flat.
   - Occluders of few triangles (own_triangles) draw a mask for such a receiver instead, which is right to its texels;
     receivers in a row, such as pixels, share them.
   - Overlapping occluders: the union of their masks (FIV_MASK), or discs of their true solid angle; never below 0.
   Deviations from the text: sums carry the solid angle of their texels, which eq 6 to 10 leave out; a sample's position
   is the occluder's centre minus the receiver; the first shell is free (0.3 R halves the error of the inner tangent
   sphere).

   WHAT IT DOES NOT
   Receivers are diffuse; light comes from infinitely far away; light reflected between objects is not there; nothing
   within a mesh is transparent. Meshes are not loaded. Occluders that deform need new masks (lazy: only those in use)
   and, unless contact_map asks for them, have no views: they leak at contact, but for own masks.
   OpenGL has FIV_SCALED with views, depth maps of suns and self-shadows; not FIV_MASK, own masks, rays where a sharp
   sun's map is not sure, cutoff and statistics. Vectors, masks and maps are made on the CPU.

   OPTIONS (macros)
     FIV_IMPLEMENTATION  the implementation, in one file     FIV_STATIC, FIV_DEF   linkage, everywhere
     FIV_GL              the OpenGL part, everywhere
     FIV_NO_MASKS        no stored masks: no FIV_MASK, share, save (keep_masks must be 0)
     FIV_NO_SELF         no self-shadows (eq 13)             FIV_NO_DELTA          no split-off lights

   MEMORY, THREADS, ERRORS
   An environment is one block; an occluder has one each for tables and maps, mesh and masks (keep_masks). Only create,
   share and load allocate; X_explain says in a sentence what was refused. Functions take sat_threads in their options;
   different objects may be used at once, and any number of threads may call fiv_irradiance on the same ones. All
   arguments are checked in every build. No function takes more than 32 KB of stack; at most 256 workers take part in
   one fiv_irradiance.

   ROWS, LIGHT, FAILURES
   Light is linear radiance (decode sRGB first), and so are the results. The stride of the picture is in bytes: 0
   packed, negative the bottom row first with `pixels` at the top one; receivers are packed, 3 floats each. A create
   that fails sets *out to NULL and holds nothing (OpenGL: an object for its message, to be destroyed). On OpenGL
   receivers come in by two float textures (glTexSubImage2D, or drawn); fiv_gl_texture is sampled, or attached to a
   framebuffer for glReadPixels.

   NUMERICS
   - Same bits for any number of workers and any order of instances (sums of parts of I_tot in 2^-40 fixed point); where
     the compiler contracts products and sums (-mfma without -ffp-contract=off), orders differ in the last digits, 1e-6.
   - NaN and negative radiance count as 0, what exceeds max_radiance as that much; all are counted. NaN receivers are
     black.
   - A texel of 1e8 changes no other vector: relative error of a span sum below 1e-10 (double prefixes), of the power of
     a split-off light 4e-5 (beside the poles of the image up to 2 % of it stays in the cube). Masks equal rays through
     the texel centres but for rays that graze an edge (2e-6 of the texels set).
   - OpenGL: half floats, filtered by the hardware: within 2e-3 of the largest irradiance of fiv_irradiance and
     fiv_self_irradiance with cutoff, own_masks and rays 0, 1e-4 rms (measured 3e-4 and 8e-6, in software). Filters with
     weights of 8 bits add 3e-4, 3e-5 rms. Six fetches, two a field: a 3D texture would take three of twice the work.
   - Of neighbours that share a mask each is within own_tolerance of its own, as far as the masks of both ends say.
   - I_tot: within 6e-4 of its largest value of the sum over all texels. Turned vectors: 1.7 % rms of the same vectors
     computed from a turned mesh.
   - Receivers up to 1e9 radii away, anywhere inside and on the mesh, scale 0. Below the first shell its samples stand.

   COST (tests/bench/bench_fiv.c; bunny of 3674 triangles, one core; ratios of one run). NRMSE is eq 17 on a plane below
   the bunny against rays to every texel of the light, in brackets the published one:
     samples      NRMSE forest    city    1 point light    masks made  light again  vectors  masks
     32x17x15     0.012 (0.023)   0.011   0.008 (0.1)      1.4 s       6 to 10 ms   0.33 MB  1.2 MB   default
     64x33x30     0.005 (0.008)   0.005                    11 s        30 to 47 ms  2.5 MB   8.9 MB
   - A receiver costs 0.19 to 0.49 us an occluder (the more the wider its lights), 280 to 700 times less than its rays;
     FIV_MASK 1 to 2 us where masks are needed. Depth maps of lights take 0.5 MB an occluder, views 1.6 MB, with dense
     samples 6.3 MB.
   - Standing on a floor 3 R wide, forest, gap 0 to 0.002 R; interpolated -> views -> own masks: box (default: own
     masks) 0.087 -> 0.0066 -> 0.0039, queen 0.063 -> 0.0098 -> 0.0045, fandisk 0.031 -> 0.0085 -> 0.005, bunny 0.030
     -> 0.0067 -> 0.004, dragon of 11k triangles 0.052 -> 0.009 -> 0.0045. FIV_TRILINEAR has 0.166 on the box and less
     than FIV_SCALED without views on the queen (0.056), which is why near contact neither stands alone.
   - The same at 64x33x30: box 0.0061, queen 0.0042, fandisk 0.0058 to 0.0067, bunny 0.0049, dragon 0.0059; with 64
     texels, not 128, all but the box 0.0057 to 0.0078; own masks 0.002 to 0.0034. Five sixths of the squared error that
     is left is that of 384 directions: more texels change little, 1536 directions would take four times the memory and
     twice the time for a fifth less. Lookups take as long with 64 as with 128 texels.
   - Own masks of a box end at 0.003: where a row of the cube's texels goes behind an edge at once the light itself is a
     step (0.007, 0.0034, 0.002 with 16, 32, 64 texels).
   - On the mesh itself; interpolated -> views: bunny forest 0.023 -> 0.009, night 0.029 -> 0.014; queen 0.10 -> 0.045,
     0.055 -> 0.042; dragon 0.077 -> 0.041, 0.054 -> 0.036.
   - Views take 2 to 4 us for each such receiver (rays to a box 12 us), and 50 to 160 ms once, 100 to 200 ms with 128
     texels. An own mask takes 0.01 ms (box) to 0.5 ms (queen, 10k triangles) for 10 to 40 % of those receivers; in a
     picture few pixels stand so near, and they share. The ground of a view on which two bunnies stand: 1.9 us a
     receiver, 1.4 without contact; 12 % of the receivers are near it.
   - Weak: beside acute corners of thin sheets that stand (a triangle on its edge), where samples on both sides see
     little, light leaks within 0.1 R. A deforming mesh without contact_map leaks as interpolated vectors do.
   - Suns, floor 4 R wide below the bunny: a bare sun has the error 0 of rays at 0.2 us (rays for 0.5 % of receivers;
     maps alone 0.025). Beside 128 of Embree's rays to lights drawn by power and cosine, penumbra 0: resting, forest
     0.006 to their 0.016, city 0.004 to 0.013, night 0.004 to 0.017, at 1/20 to 1/26 of their time; with own masks
     0.002 to 0.005 at 1.0 to 1.3 times it; 0.5 R above, 0.011 to 0.034, 0.004 to 0.021, 0.011 to 0.075, at 1/50. Twenty
     lamps: 0.0005, with 8 lights 0.04; more lights than 2 to 8 change nothing in city, forest and night. A disc's
     penumbra: 0.008, as of a point 0.07.
   - Shared masks, pixels R / 300 apart at the bunny's foot: a sixth of the time, 0.0012 rms of the largest off.
   - A mask costs 0.94 times Embree's eight-wide rays at 3.7k triangles, 1.3 to 1.75 times at 11k to 48k.
   - Two occluders, 64x33x30: NRMSE 0.034 with eq 14-15, 0.0105 FIV_SCALED, 0.007 FIV_MASK.
   - Cut by the horizon: FIV_SCALED has 0.14 to 0.36 of the error of (d + R) / 2R at d = 0 to 0.6 R.
   - Half octahedral storage: 0.29 times the published memory at 1.16 times the error (64x33x30).

   CONTENTS (each mark stands once more, where its section begins)
   >> interface      environments, occluders, receivers, deforming occluders; the OpenGL part
   >> options        tables of options, defaults, X_explain
   >> geometry       vectors, the cube's faces
   >> environments   from the image to the cube; directional lights
   >> integrals      prefix sums of the cube's rows, I_tot
   >> meshes         clusters, bounding ball
   >> masks          cones on rows of bits, rays, spans
   >> samples        shells, grids, cells
   >> occluders      creation, support function, depth maps, views, all masks
   >> lighting       depth maps of the lights, light around the views, vectors
   >> lookups        vectors between samples; where they are not enough
   >> views          the light around a receiver, by depth maps, or by rays to few triangles
   >> shadows        what one occluder takes from one receiver: own masks, lights, the horizon
   >> receivers      several occluders, tiles, self-shadows, lazy samples
   >> saves          saving and loading
   >> shaders        GLSL
   >> opengl         textures, scenes, passes
*/

#if defined(LIGHTSCAN_IMPLEMENTATION) && !defined(FIV_IMPLEMENTATION)
#define FIV_IMPLEMENTATION
#endif

#ifndef FIV_H
#define FIV_H

#define FIV_VERSION_MAJOR 0
#define FIV_VERSION_MINOR 1
#define FIV_VERSION_PATCH 0
#define FIV_VERSION (FIV_VERSION_MAJOR * 10000 + FIV_VERSION_MINOR * 100 + FIV_VERSION_PATCH)

#if defined(FIV_IMPLEMENT) || defined(FIV_IMPL)
#error "fiv.h: the macro is called FIV_IMPLEMENTATION"
#endif

#if defined(FIV_GL) && !defined(SAT_GL)
#define SAT_GL
#endif
#include "sat.h"
#if SAT_VERSION < 100
#error "fiv.h needs sat.h 0.1.0 or newer"
#endif

#include <stddef.h>
#include <stdint.h>

#ifndef FIV_DEF
#ifdef FIV_STATIC
#define FIV_DEF static inline
#else
#define FIV_DEF extern
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------------------------------------
   >> interface
   Environments: the light
   ------------------------------------------------------------------------------------------------ */

enum {
    FIV_MAX_LIGHTS = 32,    /* directional lights split off an environment */
    FIV_MAX_INSTANCES = 256 /* occluders of one fiv_irradiance call */
};

typedef struct fiv_environment_options {
    int resolution;        /* 32; 8..64; texels along an edge of the light's cube and of every mask */
    float delta_ratio;     /* 100; 0..1e38; a patch this many times brighter than the mean, and half a texel wide (so:
                              with 0.4 % of all light), becomes a directional light; those around it join at a quarter
                              of that; 0: none does */
    int max_lights;        /* 32; 0..FIV_MAX_LIGHTS; strongest patches first; those beyond stay in the cube, each
                              spread over its texel */
    float max_radiance;    /* 1e10; 1e-30..1e30; larger values, infinity included, count as this much */
    sat_allocator allocator; /* malloc; used by create and destroy only */
    sat_threads threads;     /* serial; used by create and update; same bits for any worker count */
} fiv_environment_options;
FIV_DEF fiv_environment_options fiv_environment_defaults(void);
/* One sentence on what create would refuse ("resolution is 99; 8..64"), "" when nothing; returns text. */
FIV_DEF const char *fiv_explain_environment(char *text, size_t size, const sat_image *equirect_rgb,
                                            const fiv_environment_options *options);

typedef struct fiv_environment_stats {
    size_t nan, negative, clamped; /* channel values that counted as 0, as 0 and as max_radiance */
    int lights;                    /* directional lights split off */
    float light_share;             /* their part of all light, 0..1 */
    size_t bytes;                  /* memory the environment holds */
} fiv_environment_stats;

typedef struct fiv_environment fiv_environment;

/* From an equirectangular image of 1 (grey), 3 or 4 channels, W/(m2 sr) or any other unit of radiance: x right, y up,
   the middle looks along -z, row 0 at the top. One allocation. stats may be NULL. */
FIV_DEF sat_result fiv_environment_create(fiv_environment **out, const sat_image *equirect_rgb,
                                          const fiv_environment_options *options, fiv_environment_stats *stats);
/* New light (NULL: keep the image) turned by `rotation` (row-major, world = rotation * image direction; NULL: not
   turned). No allocation. Occluders must be lit again afterwards. */
FIV_DEF sat_result fiv_environment_update(fiv_environment *environment, const sat_image *equirect_rgb,
                                          const float rotation[9]);
FIV_DEF fiv_environment_stats fiv_environment_get_stats(const fiv_environment *environment);
FIV_DEF void fiv_environment_destroy(fiv_environment *environment); /* NULL is fine */

/* I_tot (eq 6) of a surface with this normal, without any occluder; W/m2. The normal is normalised; 0 gives 0. */
FIV_DEF void fiv_environment_irradiance(float rgb[3], const fiv_environment *environment, const float normal[3]);
/* The vector of the whole environment (eq 10): x, y, z of red, then of green, then of blue. */
FIV_DEF void fiv_environment_vector(float fiv[9], const fiv_environment *environment);
/* The M directional lights that the environment is made of (eq 6): first the split-off ones, then one a cube texel.
   Fills at most `capacity` directions and powers (3 floats each: unit vector, radiance times solid angle; none where
   one of them is NULL) and returns M. */
FIV_DEF size_t fiv_environment_lights(float *directions, float *powers, size_t capacity,
                                      const fiv_environment *environment);

/* ------------------------------------------------------------------------------------------------
   Occluders: what casts shadows
   ------------------------------------------------------------------------------------------------ */

typedef enum fiv_storage {
    FIV_STORAGE_FLOAT,          /* longitude-latitude samples, 40 bytes each (published: 36) */
    FIV_STORAGE_HALF_OCTAHEDRAL /* theta / 2 + 1 squared octahedral samples a shell, 20 bytes each */
} fiv_storage;

/* Called between batches of the precompute with 0..1; anything but 0 cancels it. */
typedef int fiv_progress_fn(float done, void *user);

typedef struct fiv_occluder_options {
    int theta;               /* 32; 4..4096; azimuths of the samples; even */
    int phi;                 /* 17; 3..2049; polar angles, both poles among them */
    int rho;                 /* 15; 2..256; shells at logarithmic distances */
    float first_shell;       /* 0.3; 1e-6..1000; bounding radii */
    float last_shell;        /* 6; 1e-6..1000; bounding radii; beyond first_shell */
    int resolution;          /* 32; 8..64; that of the environments that will light it */
    fiv_storage storage;     /* FIV_STORAGE_FLOAT */
    int keep_masks;          /* 1; 0..1; 0: each fiv_occluder_light rasterises all masks anew; no FIV_MASK, no save */
    int lazy;                /* 0; 0..1; 1 (without keep_masks): only what fiv_occluder_prepare asks for is computed */
    int sun_map;             /* 512; 64..4096; side of the square in which all split-off lights have their depth maps:
                                one light the whole of it, two to four a quarter each, five to nine a ninth ... */
    int contact_map;         /* -1; -1..256; side of each of the 384 depth maps along fixed directions that answer near
                                contact and on the mesh itself: 0: none; 8..256; -1: 64 texels (1.6 MB), with 64
                                azimuths or more 128, where the error of resting meshes ends; none when lazy, since
                                each deformation draws them anew (30 to 160 ms) */
    fiv_progress_fn *progress;     /* NULL */
    void *progress_user;
    sat_allocator allocator; /* malloc; not used after create */
    sat_threads threads;     /* serial; same bits for any worker count */
} fiv_occluder_options;
FIV_DEF fiv_occluder_options fiv_occluder_defaults(void);

typedef struct fiv_occluder_stats {
    size_t triangles;              /* in use */
    size_t skipped_triangles;      /* with a vertex that is not finite, or twice the same one */
    int closed;                    /* 1: every edge is met once in each direction; half of the triangles are then left
                                      out */
    float centre[3], radius;       /* bounding ball in the mesh's own coordinates */
    size_t samples, rasterised;    /* positions of the occluder; masks made (shared ones once, stale ones not) */
    size_t inside;                 /* samples whose receiver lies inside the mesh */
    size_t spans;                  /* mask words; 2 bytes each */
    size_t table_bytes, mask_bytes, mesh_bytes, map_bytes, bytes; /* vectors; masks; triangles; depth maps;
                                                                     everything held */
} fiv_occluder_stats;

typedef struct fiv_occluder fiv_occluder;

/* Triangles, 3 indices each, counter-clockwise seen from outside or the other way round throughout. Vertices that are
   shared should share their index: only then is the mesh known to be closed. Makes all masks, which no light
   enters: this is the slow call. stats may be NULL. */
FIV_DEF sat_result fiv_occluder_create(fiv_occluder **out, const float *positions, size_t vertex_count,
                                       const unsigned *indices, size_t triangle_count,
                                       const fiv_occluder_options *options, fiv_occluder_stats *stats);
FIV_DEF const char *fiv_explain_occluder(char *text, size_t size, const float *positions, size_t vertex_count,
                                         const unsigned *indices, size_t triangle_count,
                                         const fiv_occluder_options *options);
/* Integrates the light over the masks (eq 10); `rotation` of the occluder about its own origin, row-major, NULL: none.
   No allocation. The environment must stay unchanged and alive until the next fiv_occluder_light. */
FIV_DEF sat_result fiv_occluder_light(fiv_occluder *occluder, const fiv_environment *environment,
                                      const float rotation[9]);
/* The same mesh in another orientation or light: own vectors, the masks of `masks_of`, which must outlive it. */
FIV_DEF sat_result fiv_occluder_share(fiv_occluder **out, const fiv_occluder *masks_of);
FIV_DEF fiv_occluder_stats fiv_occluder_get_stats(const fiv_occluder *occluder);
FIV_DEF void fiv_occluder_destroy(fiv_occluder *occluder); /* NULL is fine */

#ifndef FIV_NO_MASKS
/* Bytes that fiv_occluder_save writes; 0 when the occluder has no masks of its own. */
FIV_DEF size_t fiv_occluder_save_size(const fiv_occluder *occluder);
/* Masks and triangles, not the light. size is at least fiv_occluder_save_size; the bytes depend on the arguments of
   create alone. */
FIV_DEF sat_result fiv_occluder_save(void *memory, size_t size, const fiv_occluder *occluder);
/* Takes nothing on trust: SAT_ERR_DATA for anything but a complete save of this version. `options` gives sun_map,
   contact_map, allocator and threads; the rest comes from the save. Light it before use. */
FIV_DEF sat_result fiv_occluder_load(fiv_occluder **out, const void *memory, size_t size,
                                     const fiv_occluder_options *options);
#endif

/* ------------------------------------------------------------------------------------------------
   Receivers
   ------------------------------------------------------------------------------------------------ */

typedef struct fiv_instance {
    const fiv_occluder *occluder;
    float position[3]; /* where the mesh's own origin goes, after scale and rotation about it */
    float scale;       /* >= 0; 0 leaves the instance out */
} fiv_instance;

typedef enum fiv_accuracy {
    FIV_NEAREST,   /* the nearest sample; else as FIV_TRILINEAR */
    FIV_TRILINEAR, /* as published: 8 samples, (d + R) / 2R where the horizon cuts, discs where occluders overlap */
    FIV_SCALED,    /* rho^2 times the vector is interpolated, without samples inside the mesh; closed-form cap where the
                      horizon cuts */
    FIV_MASK       /* FIV_SCALED, and the stored masks where the horizon or another occluder cuts */
} fiv_accuracy;

typedef struct fiv_irradiance_options {
    fiv_accuracy accuracy; /* FIV_SCALED */
    int partial;           /* 1; 0..1; 0: no correction where the horizon cuts an occluder (figure 23, left) */
    int overlap;           /* 1; 0..1; 0: no correction where occluders overlap (figure 21, left) */
    float cutoff;          /* 0.001; 0..1; an occluder that cannot take more than this part of I_tot is left out */
    int contact;           /* 1; 0..1; from FIV_SCALED on: receivers in a cell with a sample inside the mesh, or from
                              which it covers 1.5 to 2 sr, pass to its depth maps along fixed directions, as do those
                              on the mesh itself; 0: they, too, are interpolated */
    int own_masks;         /* 64; 0..64; of each 64 receivers so many may get masks of their own, from FIV_SCALED on:
                              those in a cell with a sample inside the mesh, or from which it may cover 2 sr: half the
                              error of the depth maps at 100 times their time; 0: none */
    int own_triangles;     /* 500; 0..2147483647; an occluder of more gets none: a mask takes 50 ns a triangle */
    float own_tolerance;   /* 0.01; 0..1; of up to 16 receivers in a row, within R / 16, those between two whose masks
                              take the same to this part of I_tot get what lies between; 0: each its own */
    int rays;              /* 1; 0..1; 0: where a sharp sun's depth map is not sure, its texels say, not a ray */
    float penumbra;        /* 1; 0..100; times the measured radius of a sun; 0: all of them points */
    sat_threads threads;   /* serial; same bits for any worker count */
} fiv_irradiance_options;
FIV_DEF fiv_irradiance_options fiv_irradiance_defaults(void);

/* What a call did; each pair of a receiver and an occluder is counted once in the first four. */
typedef struct fiv_irradiance_stats {
    size_t below_horizon, below_cutoff; /* left out */
    size_t whole, clipped;              /* looked up: entirely above the horizon, cut by it */
    size_t overlaps;                    /* receivers that see occluders overlap */
    size_t masks;                       /* masks integrated for the last two */
    size_t contacts;                    /* near contact, or on the mesh itself: by its depth maps */
    size_t own_receivers, own_masks;    /* near contact: with masks of their own, or between two; masks made */
    size_t rays;                        /* to split-off lights */
    size_t non_finite;                  /* receivers with NaN or infinity: black */
    size_t missing;                     /* lookups that met stale samples only: no shadow */
} fiv_irradiance_stats;

/* Irradiance of `count` receivers, 3 floats each, lit by the environment and shadowed by the instances (eq 12): between
   0 and I_tot, and the same bits for any order of the instances. Points in world coordinates; normals are normalised.
   The occluders must have been lit by this environment. No allocation. stats may be NULL. */
FIV_DEF sat_result fiv_irradiance(float *rgb, const float *points, const float *normals, size_t count,
                                  const fiv_environment *environment, const fiv_instance *instances,
                                  size_t instance_count, const fiv_irradiance_options *options,
                                  fiv_irradiance_stats *stats);
/* What fiv_irradiance would refuse about the scene or the options ("instance 1: lit by another environment"), "" when
   nothing. */
FIV_DEF const char *fiv_explain_irradiance(char *text, size_t size, const fiv_environment *environment,
                                           const fiv_instance *instances, size_t instance_count,
                                           const fiv_irradiance_options *options);

#ifndef FIV_NO_SELF
/* The same for receivers on the surface of the mesh `self` (eq 13), which casts shadows on itself; `others` as
   above. */
FIV_DEF sat_result fiv_self_irradiance(float *rgb, const float *points, const float *normals, size_t count,
                                       const fiv_environment *environment, const fiv_instance *self,
                                       const fiv_instance *others, size_t other_count,
                                       const fiv_irradiance_options *options, fiv_irradiance_stats *stats);
#endif

/* ------------------------------------------------------------------------------------------------
   Deforming occluders (options.lazy)
   ------------------------------------------------------------------------------------------------ */

/* New vertex positions (as many as at creation, NULL: the same): all samples become stale; views are drawn anew where
   contact_map was asked for. No allocation. */
FIV_DEF sat_result fiv_occluder_invalidate(fiv_occluder *occluder, const float *positions);
/* Computes the stale samples that these receivers touch through the instances of this occluder. *computed (may be NULL)
   says how many. Needs a preceding fiv_occluder_light. No allocation. */
FIV_DEF sat_result fiv_occluder_prepare(fiv_occluder *occluder, size_t *computed, const fiv_instance *instances,
                                        size_t instance_count, const float *points, size_t count);

/* The version the implementation was compiled with: compare with FIV_VERSION. */
FIV_DEF int fiv_version(void);

#ifdef __cplusplus
}
#endif
#endif /* FIV_H */

/* ------------------------------------------------------------------------------------------------
   OpenGL: the receiver pass (FIV_SCALED with views, suns and self-shadows). Masks and vectors stay the CPU's work.
   ------------------------------------------------------------------------------------------------ */

#if defined(FIV_GL) && !defined(FIV__GL_API)
#define FIV__GL_API

#ifdef __cplusplus
extern "C" {
#endif

typedef struct fiv_gl_options {
    int max_instances;       /* 8; 1..64; of one scene; the shader keeps an array of so many */
    int self;                /* 0; 0..1; 1: shadows on the occluders themselves, see fiv_gl_irradiance */
    float penumbra;          /* 1; 0..100; times the measured radius of a sun; 0: all of them points */
    sat_allocator allocator; /* malloc; used by create and destroy */
} fiv_gl_options;
FIV_DEF fiv_gl_options fiv_gl_defaults(void);
/* What create would refuse, "" when nothing; also in fiv_gl_message. */
FIV_DEF const char *fiv_explain_gl(char *text, size_t size, int width, int height, const fiv_gl_options *options);

typedef struct fiv_gl fiv_gl;

/* For the current context (3.3 core, or ES 3.0 with EXT_color_buffer_float) and pictures of this size. On an error
   *out still is an object, for its message alone. */
FIV_DEF sat_result fiv_gl_create(fiv_gl **out, sat_gl_get_proc *get_proc, int width, int height,
                                 const fiv_gl_options *options);
/* Other options: penumbra, from the next fiv_gl_set_scene on. max_instances and self are compiled in: SAT_ERR_MISMATCH
   when one differs, and nothing changes. The allocator is not looked at. */
FIV_DEF sat_result fiv_gl_set_options(fiv_gl *gl, const fiv_gl_options *options);
/* After each fiv_occluder_light. Uploads the environment and those occluders that differ from the last scene; no
   allocation but, when tables grow, that of OpenGL. On an error the last scene stays as it was. */
FIV_DEF sat_result fiv_gl_set_scene(fiv_gl *gl, const fiv_environment *environment, const fiv_instance *instances,
                                    size_t count);
/* Only places and scales differ from the last fiv_gl_set_scene: what moving occluders cost a frame. */
FIV_DEF sat_result fiv_gl_move(fiv_gl *gl, const fiv_instance *instances, size_t count);
/* How a renderer has its receivers: a depth buffer, and normals in the camera's axes or the world's. */
typedef struct fiv_gl_view {
    float world_from_clip[16];  /* column-major; inverse of what drew the depth buffer: perspective or not, reversed,
                                   infinite, top-down: all is in it */
    int clip_zero_to_one;       /* 0: the matrix takes depth in [-1,1] (OpenGL); 1: in [0,1] (glClipControl) */
    float world_from_normal[9]; /* column-major; turns the normals into the world's axes */
} fiv_gl_view;

/* Irradiance of every pixel, in the target `to`, or, when NULL, in fiv_gl_texture() (RGBA32F). `points` and `normals`
   are float textures of world coordinates, at least of the created size (from to->from on) or of that which `to`
   names, smaller in any frame; a normal of 0 gives 0. With a view, `points` is a depth texture without comparison
   instead. With options.self an alpha says what a receiver lies on, that of `points`, with a view that of `normals`:
   2 + i the surface of instance i, which shadows itself as in fiv_self_irradiance; any other value, such as the 1 of
   RGB textures, nothing that casts shadows. */
FIV_DEF sat_result fiv_gl_irradiance(fiv_gl *gl, const sat_gl_target *to, unsigned points, unsigned normals,
                                     const fiv_gl_view *view);

FIV_DEF unsigned fiv_gl_texture(const fiv_gl *gl);
/* What the last SAT_ERR_GL_... was about; never NULL, and NULL is fine. */
FIV_DEF const char *fiv_gl_message(const fiv_gl *gl);
FIV_DEF void fiv_gl_destroy(fiv_gl *gl); /* NULL is fine */

/* For a shader of one's own: `vec3 fiv_irradiance(vec3 point, vec3 normal)` and `vec3 fiv_self_irradiance(int self,
   vec3 point, vec3 normal)` on the surface of instance `self` (-1: none), as a list of strings that ends with NULL.
   Define FIV_INSTANCES as max_instances in front of it. fiv_gl_bind uses the program and sets its uniforms; it takes
   seven texture units and leaves them bound. */
FIV_DEF const char *const *fiv_gl_glsl(void);
FIV_DEF sat_result fiv_gl_bind(fiv_gl *gl, unsigned program, int first_unit);

#ifdef __cplusplus
}
#endif
#endif /* FIV_GL */
/* ------------------------------------------------------------------------------------------------
   Stop here if you only want to use the library.
   ------------------------------------------------------------------------------------------------ */

#if defined(FIV_IMPLEMENTATION) && !defined(FIV_IMPLEMENTED)
#define FIV_IMPLEMENTED

#ifndef SAT_SIBLING
#define SAT_SIBLING
#endif
#if defined(FIV_GL) && !defined(SAT_SIBLING_GL)
#define SAT_SIBLING_GL
#endif
#include "sat.h"

SAT__IEEE_BEGIN
#ifdef __cplusplus
extern "C" {
#endif

FIV_DEF int fiv_version(void) { return FIV_VERSION; }

/* >> options   ---- defaults, ranges and sentences */

static const sat__field fiv__environment_fields[] = {
    SAT__FIELD(fiv_environment_options, 'i', resolution, 32, 8, 64, ' '),
    SAT__FIELD(fiv_environment_options, 'f', delta_ratio, 100, 0, 1e38, ' '),
    SAT__FIELD(fiv_environment_options, 'i', max_lights, 32, 0, FIV_MAX_LIGHTS, ' '),
    SAT__FIELD(fiv_environment_options, 'f', max_radiance, 1e10, 1e-30, 1e30, ' '),
    SAT__FIELD(fiv_environment_options, 'a', allocator, 0, 0, 0, ' '),
    SAT__FIELD(fiv_environment_options, 't', threads, 0, 0, 0, ' '),
};

FIV_DEF fiv_environment_options fiv_environment_defaults(void)
{
    fiv_environment_options o;
    sat__fields_default(&o, sizeof o, fiv__environment_fields, SAT__COUNT(fiv__environment_fields));
    return o;
}

FIV_DEF const char *fiv_explain_environment(char *text, size_t size, const sat_image *image,
                                            const fiv_environment_options *options)
{
    sat__text t = sat__text_begin(text, size);
    const sat__field *wrong =
        options ? sat__fields_check(options, fiv__environment_fields, SAT__COUNT(fiv__environment_fields)) : NULL;
    if (!sat__image_is_valid(image)) return sat_explain_image(text, size, image);
    if (image->channels == 2) sat__text_add(&t, "channels is 2; 1, 3 or 4");
    else if (image->width > 1 << 20) sat__text_range(&t, "width", image->width, 1, 1 << 20, ' ');
    else if (image->height > 1 << 20) sat__text_range(&t, "height", image->height, 1, 1 << 20, ' ');
    else if (wrong) sat__text_field(&t, wrong, options);
    return t.size ? text : "";
}

static const sat__field fiv__occluder_fields[] = {
    SAT__FIELD(fiv_occluder_options, 'i', theta, 32, 4, 4096, ' '),
    SAT__FIELD(fiv_occluder_options, 'i', phi, 17, 3, 2049, ' '),
    SAT__FIELD(fiv_occluder_options, 'i', rho, 15, 2, 256, ' '),
    SAT__FIELD(fiv_occluder_options, 'f', first_shell, 0.3, 1e-6, 1000, ' '),
    SAT__FIELD(fiv_occluder_options, 'f', last_shell, 6, 1e-6, 1000, ' '),
    SAT__FIELD(fiv_occluder_options, 'i', resolution, 32, 8, 64, ' '),
    SAT__FIELD(fiv_occluder_options, 'i', storage, FIV_STORAGE_FLOAT, FIV_STORAGE_FLOAT, FIV_STORAGE_HALF_OCTAHEDRAL, ' '),
    SAT__FIELD(fiv_occluder_options, 'i', keep_masks, 1, 0, 1, ' '),
    SAT__FIELD(fiv_occluder_options, 'i', lazy, 0, 0, 1, ' '),
    SAT__FIELD(fiv_occluder_options, 'i', sun_map, 512, 64, 4096, ' '),
    SAT__FIELD(fiv_occluder_options, 'i', contact_map, -1, -1, 256, ' '),
    SAT__FIELD(fiv_occluder_options, 'a', allocator, 0, 0, 0, ' '),
    SAT__FIELD(fiv_occluder_options, 't', threads, 0, 0, 0, ' '),
};

FIV_DEF fiv_occluder_options fiv_occluder_defaults(void)
{
    fiv_occluder_options o;
    sat__fields_default(&o, sizeof o, fiv__occluder_fields, SAT__COUNT(fiv__occluder_fields));
    return o;
}

static int fiv__explain_occluder_options(sat__text *t, const fiv_occluder_options *o)
{
    const sat__field *wrong = sat__fields_check(o, fiv__occluder_fields, SAT__COUNT(fiv__occluder_fields));
    if (wrong) sat__text_field(t, wrong, o);
    else if (o->theta & 1) sat__text_add(t, "theta is odd");
    else if (!(o->first_shell < o->last_shell)) sat__text_add(t, "last_shell is not beyond first_shell");
    else if (o->contact_map > 0 && o->contact_map < 8) sat__text_add(t, "contact_map is below 8; -1, 0 or 8..256");
    else if (o->keep_masks && o->lazy) sat__text_add(t, "lazy is 1 with keep_masks; what deforms keeps none");
#ifdef FIV_NO_MASKS
    else if (o->keep_masks) sat__text_add(t, "keep_masks is 1; 0 with FIV_NO_MASKS");
#endif
    else return 1;
    return 0;
}

static int fiv__occluder_options_are_valid(const fiv_occluder_options *o)
{
    sat__text ignored = sat__text_begin(NULL, 0);
    return fiv__explain_occluder_options(&ignored, o);
}

/* 0 and a sentence where an index is beyond the vertices, or a pointer is missing. */
static int fiv__explain_mesh(sat__text *t, const float *positions, size_t vertex_count, const unsigned *indices,
                             size_t triangle_count)
{
    size_t i;
    if (triangle_count && (!positions || !indices)) sat__text_add(t, "positions or indices are NULL");
    else {
        for (i = 0; i < 3 * triangle_count && indices[i] < vertex_count; i++) {}
        if (i == 3 * triangle_count) return 1;
        sat__text_add(t, "triangle ");
        sat__text_number(t, (double)(i / 3));
        sat__text_add(t, ": its index is ");
        sat__text_number(t, (double)indices[i]);
        sat__text_add(t, " of ");
        sat__text_number(t, (double)vertex_count);
        sat__text_add(t, " vertices");
    }
    return 0;
}

FIV_DEF const char *fiv_explain_occluder(char *text, size_t size, const float *positions, size_t vertex_count,
                                         const unsigned *indices, size_t triangle_count,
                                         const fiv_occluder_options *options)
{
    sat__text t = sat__text_begin(text, size);
    if (vertex_count > 0x7fffffff || triangle_count > 0x7fffffff / 3) sat__text_add(&t, "more than 2147483647 vertices or indices");
    else if (!options || fiv__explain_occluder_options(&t, options))
        fiv__explain_mesh(&t, positions, vertex_count, indices, triangle_count);
    return t.size ? text : "";
}

enum { FIV__TILE = 64, FIV__SHARES = 256 };

static const sat__field fiv__irradiance_fields[] = {
    SAT__FIELD(fiv_irradiance_options, 'i', accuracy, FIV_SCALED, FIV_NEAREST, FIV_MASK, ' '),
    SAT__FIELD(fiv_irradiance_options, 'i', partial, 1, 0, 1, ' '),
    SAT__FIELD(fiv_irradiance_options, 'i', overlap, 1, 0, 1, ' '),
    SAT__FIELD(fiv_irradiance_options, 'f', cutoff, 0.001, 0, 1, ' '),
    SAT__FIELD(fiv_irradiance_options, 'i', contact, 1, 0, 1, ' '),
    SAT__FIELD(fiv_irradiance_options, 'i', own_masks, FIV__TILE, 0, FIV__TILE, ' '),
    SAT__FIELD(fiv_irradiance_options, 'i', own_triangles, 500, 0, 2147483647, ' '),
    SAT__FIELD(fiv_irradiance_options, 'f', own_tolerance, 0.01, 0, 1, ' '),
    SAT__FIELD(fiv_irradiance_options, 'i', rays, 1, 0, 1, ' '),
    SAT__FIELD(fiv_irradiance_options, 'f', penumbra, 1, 0, 100, ' '),
    SAT__FIELD(fiv_irradiance_options, 't', threads, 0, 0, 0, ' '),
};

FIV_DEF fiv_irradiance_options fiv_irradiance_defaults(void)
{
    fiv_irradiance_options o;
    sat__fields_default(&o, sizeof o, fiv__irradiance_fields, SAT__COUNT(fiv__irradiance_fields));
    return o;
}

/* >> geometry   ---- small vectors and matrices */

static inline float fiv__dot(const float a[3], const float b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static inline void fiv__normalise(float out[3], const float v[3])
{
    float largest = fabsf(v[0]) > fabsf(v[1]) ? fabsf(v[0]) : fabsf(v[1]), x[3], length;
    if (fabsf(v[2]) > largest) largest = fabsf(v[2]);
    if (!(largest > 0)) {
        out[0] = out[1] = out[2] = 0;
        return;
    }
    x[0] = v[0] / largest;
    x[1] = v[1] / largest;
    x[2] = v[2] / largest;
    length = sqrtf(fiv__dot(x, x));
    out[0] = x[0] / length;
    out[1] = x[1] / length;
    out[2] = x[2] / length;
}

static inline void fiv__cross(float out[3], const float a[3], const float b[3])
{
    int k;
    for (k = 0; k < 3; k++) out[k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
}

/* out = m v, and out = transpose(m) v */
static inline void fiv__turn(float out[3], const float m[9], const float v[3])
{
    float x = v[0], y = v[1], z = v[2];
    out[0] = m[0] * x + m[1] * y + m[2] * z;
    out[1] = m[3] * x + m[4] * y + m[5] * z;
    out[2] = m[6] * x + m[7] * y + m[8] * z;
}

static inline void fiv__turn_back(float out[3], const float m[9], const float v[3])
{
    float x = v[0], y = v[1], z = v[2];
    out[0] = m[0] * x + m[3] * y + m[6] * z;
    out[1] = m[1] * x + m[4] * y + m[7] * z;
    out[2] = m[2] * x + m[5] * y + m[8] * z;
}

/* out = transpose(a) b */
static inline void fiv__turn_between(float out[9], const float a[9], const float b[9])
{
    int i, j;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++) out[3 * i + j] = a[i] * b[j] + a[3 + i] * b[3 + j] + a[6 + i] * b[6 + j];
}

static const float fiv__identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};

/* Copies a rotation; 0 unless its rows are unit and perpendicular to 1e-3, and right-handed. */
static int fiv__set_rotation(float out[9], const float m[9])
{
    int i, j;
    float det;
    if (!m) m = fiv__identity;
    for (i = 0; i < 9; i++)
        if (!sat__is_finite(m[i])) return 0;
    for (i = 0; i < 3; i++)
        for (j = i; j < 3; j++)
            if (fabsf(fiv__dot(m + 3 * i, m + 3 * j) - (i == j ? 1.0f : 0.0f)) > 1e-3f) return 0;
    det = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6]) + m[2] * (m[3] * m[7] - m[4] * m[6]);
    if (det < 0) return 0;
    memcpy(out, m, 9 * sizeof *out);
    return 1;
}

/* ---- the cube: face 2k looks along axis k, face 2k + 1 the other way; u and v are the two other axes, in the
   order that makes u, v, w right-handed on every face. Texel x of row y: direction w + u U + v V with
   u = (2x + 1) / face - 1. A row is a line of constant v; rows are numbered face * side + y. */

typedef struct fiv__axes {
    int w, u, v;
    float sign;
} fiv__axes;

static inline fiv__axes fiv__face_axes(int face)
{
    fiv__axes a;
    int k = face >> 1, flip = face & 1;
    a.w = k;
    a.u = (k + 1 + flip) % 3;
    a.v = (k + 2 - flip) % 3;
    a.sign = flip ? -1.0f : 1.0f;
    return a;
}

/* The face that a direction meets, and where: u and v in -1..1. The zero vector gives the middle of a face. */
static inline int fiv__cube_face(const float d[3], float *u, float *v)
{
    float ax = fabsf(d[0]), ay = fabsf(d[1]), az = fabsf(d[2]), w;
    int k = ax >= ay ? (ax >= az ? 0 : 2) : (ay >= az ? 1 : 2), face = 2 * k + (d[k] < 0);
    fiv__axes a = fiv__face_axes(face);
    w = fabsf(d[k]);
    w = w > 0 ? 1 / w : 0;
    *u = d[a.u] * w;
    *v = d[a.v] * w;
    return face;
}

static inline void fiv__cube_direction(float out[3], int face, float u, float v)
{
    fiv__axes a = fiv__face_axes(face);
    out[a.w] = a.sign;
    out[a.u] = u;
    out[a.v] = v;
}

static inline float fiv__texel_coordinate(int x, int size) { return (float)(2 * x + 1) / (float)size - 1; }

static inline size_t fiv__cube_texel(const float d[3], int size)
{
    float u, v;
    int face = fiv__cube_face(d, &u, &v);
    int x = sat__clamp_int((int)((u + 1) * 0.5f * (float)size), 0, size - 1);
    int y = sat__clamp_int((int)((v + 1) * 0.5f * (float)size), 0, size - 1);
    return (size_t)(face * size + y) * (size_t)size + (size_t)x;
}

/* Solid angle of the rectangle from (0,0) to (u,v) on a face. */
static inline double fiv__corner_angle(double u, double v) { return atan2(u * v, sqrt(u * u + v * v + 1)); }

static inline double fiv__texel_angle(int x, int y, int size)
{
    double u0 = 2.0 * x / size - 1, u1 = 2.0 * (x + 1) / size - 1, v0 = 2.0 * y / size - 1,
           v1 = 2.0 * (y + 1) / size - 1;
    return fiv__corner_angle(u1, v1) - fiv__corner_angle(u0, v1) - fiv__corner_angle(u1, v0) +
           fiv__corner_angle(u0, v0);
}

/* >> environments */

/* ---- environments */

enum {
    FIV__TERMS = 10,   /* of an integral: x, y, z of r, g, b, and the solid angle */
    FIV__MAX_FACE = 64,
    FIV__MAX_ROWS = 6 * FIV__MAX_FACE,
    FIV__BLOCK = 64    /* columns of the image that are mapped at a time */
};

typedef struct fiv__light {
    float direction[3]; /* in the image's frame */
    float power[3];     /* radiance times solid angle */
    float radius;       /* of the disc that is spread as widely: half its angle */
} fiv__light;

/* sums[row * (face + 1) + x]: the integral over texels 0..x-1 of a row, so that a span costs one difference. Doubles: a
   texel of 1e8 left of a span must cancel. */
struct fiv_environment {
    sat_allocator allocator;
    sat_threads threads;
    void *block;
    size_t block_size;
    int face, patch; /* texels along an edge; of the source cube, 2 * face */
    float delta_ratio, max_radiance;
    int max_lights, light_count;
    fiv__light lights[FIV_MAX_LIGHTS];
    unsigned stamp;      /* counts updates */
    float rotation[9];   /* world = rotation * image */
    float largest[3];    /* radiance of the brightest texel */
    double vector[9], flux[3];
    fiv_environment_stats stats;
    float *source;       /* 4 * 6 patch^2: radiance in the image's frame, without lights; 4th: weight */
    float *irradiance;   /* 3 * 6 (face + 1)^2: I_tot at the corners of the texels, image's frame, without lights */
    float *radiance;     /* 3 * 6 face^2: the cube in the world's frame */
    double *sums;        /* its integrals */
    double *angles;      /* solid angles of the texels of a face */
};

/* ---- from the image to the source cube: every image texel is cut into `cut` x `cut` points, and a patch of the cube
   takes the weighted mean of the points that fall into it */

typedef struct fiv__scan {
    fiv_environment *environment;
    const sat_image *image;
    int cut;
    int x0, count;                  /* a block of columns, in points */
    float sine[FIV__BLOCK], cosine[FIV__BLOCK];
} fiv__scan;

static void fiv__scan_columns(fiv__scan *scan, int x0)
{
    int i, width = scan->image->width * scan->cut;
    scan->x0 = x0;
    scan->count = sat__min_int(FIV__BLOCK, width - x0);
    for (i = 0; i < scan->count; i++) {
        double angle = 6.283185307179586 * ((x0 + i + 0.5) / width - 0.5);
        scan->sine[i] = (float)sin(angle);
        scan->cosine[i] = (float)cos(angle);
    }
}

/* Direction of point i of the block on a row with these sine and cosine of the polar angle. */
static inline void fiv__scan_direction(float d[3], const fiv__scan *scan, int i, float row_sine, float row_cosine)
{
    d[0] = scan->sine[i] * row_sine;
    d[1] = row_cosine;
    d[2] = -scan->cosine[i] * row_sine;
}

static float fiv__sanitise(float v, float limit, fiv_environment_stats *stats)
{
    if (v >= 0 && v <= limit) return v;
    if (sat__is_nan(v)) stats->nan++;
    else if (v < 0) stats->negative++;
    else {
        stats->clamped++;
        return limit;
    }
    return 0;
}

/* The block's pixels of image row y, three floats each. */
static void fiv__scan_read(float rgb[3 * FIV__BLOCK], const fiv__scan *scan, int y, fiv_environment_stats *stats)
{
    int i, c, n, first = scan->x0 / scan->cut;
    float channel[FIV__BLOCK];
    n = (scan->x0 + scan->count - 1) / scan->cut - first + 1;
    for (c = 0; c < 3; c++) {
        sat__read_row(channel, scan->image, y, first, first + n, scan->image->channels >= 3 ? c : 0);
        for (i = 0; i < n; i++) rgb[3 * i + c] = fiv__sanitise(channel[i], scan->environment->max_radiance, stats);
    }
}

/* Adds the block's points of one row of points to the source cube. */
static void fiv__splat(const fiv__scan *scan, const float *rgb, float row_sine, float row_cosine, float weight)
{
    fiv_environment *e = scan->environment;
    int i, first = scan->x0 / scan->cut;
    for (i = 0; i < scan->count; i++) {
        const float *p = rgb + 3 * ((scan->x0 + i) / scan->cut - first);
        float d[3], *cell;
        fiv__scan_direction(d, scan, i, row_sine, row_cosine);
        cell = e->source + 4 * fiv__cube_texel(d, e->patch);
        cell[0] += p[0] * weight;
        cell[1] += p[1] * weight;
        cell[2] += p[2] * weight;
        cell[3] += weight;
    }
}

/* Nearest pixel in a direction. */
static void fiv__fetch(float rgb[3], const fiv_environment *e, const sat_image *image, const float d[3])
{
    double length = sqrt((double)d[0] * (double)d[0] + (double)d[1] * (double)d[1] + (double)d[2] * (double)d[2]);
    double u = atan2((double)d[0], (double)-d[2]) / 6.283185307179586 + 0.5,
           v = acos((double)d[1] / length) / 3.141592653589793;
    int c, x = sat__clamp_int((int)(u * image->width), 0, image->width - 1);
    int y = sat__clamp_int((int)(v * image->height), 0, image->height - 1);
    fiv_environment_stats ignored;
    memset(&ignored, 0, sizeof ignored);
    for (c = 0; c < 3; c++) {
        sat__read_row(rgb + c, image, y, x, x + 1, image->channels >= 3 ? c : 0);
        rgb[c] = fiv__sanitise(rgb[c], e->max_radiance, &ignored);
    }
}

/* Divides by the weights; patches that no point met take the nearest pixel. */
static void fiv__finish_source(fiv_environment *e, const sat_image *image)
{
    int face, x, y, c;
    float *cell = e->source;
    for (face = 0; face < 6; face++)
        for (y = 0; y < e->patch; y++)
            for (x = 0; x < e->patch; x++, cell += 4) {
                if (cell[3] > 0) {
                    for (c = 0; c < 3; c++) cell[c] /= cell[3];
                } else {
                    float d[3];
                    fiv__cube_direction(d, face, fiv__texel_coordinate(x, e->patch),
                                        fiv__texel_coordinate(y, e->patch));
                    fiv__fetch(cell, e, image, d);
                }
                cell[3] = face ? e->source[4 * (y * e->patch + x) + 3] : (float)fiv__texel_angle(x, y, e->patch);
            }
}

static int fiv__cut(const fiv_environment *e, const sat_image *image)
{
    int x = (16 * e->patch + image->width - 1) / image->width, y = (8 * e->patch + image->height - 1) / image->height;
    return sat__clamp_int(sat__max_int(x, y), 1, 16);
}

static void fiv__read_image(fiv_environment *e, const sat_image *image)
{
    fiv__scan scan;
    int x, y, height;
    float rgb[3 * FIV__BLOCK];
    scan.environment = e;
    scan.image = image;
    scan.cut = fiv__cut(e, image);
    height = image->height * scan.cut;
    memset(e->source, 0, (size_t)e->patch * (size_t)e->patch * 24 * sizeof *e->source);
    e->stats.nan = e->stats.negative = e->stats.clamped = 0;
    for (x = 0; x < image->width * scan.cut; x += FIV__BLOCK) {
        fiv__scan_columns(&scan, x);
        for (y = 0; y < height; y++) {
            double angle = 3.141592653589793 * (y + 0.5) / height;
            if (y % scan.cut == 0) {
                fiv_environment_stats *counted = &e->stats, ignored;
                memset(&ignored, 0, sizeof ignored);
                fiv__scan_read(rgb, &scan, y / scan.cut, x % scan.cut ? &ignored : counted);
            }
            fiv__splat(&scan, rgb, (float)sin(angle), (float)cos(angle), (float)sin(angle));
        }
    }
    fiv__finish_source(e, image);
}

/* ---- directional lights: patches far above the mean leave the cube, with their exact direction and power */

#ifndef FIV_NO_DELTA

static inline double fiv__patch_light(const float *cell)
{
    return ((double)cell[0] + (double)cell[1] + (double)cell[2]) * (double)cell[3];
}

/* Power and mean direction of what the image holds above `floor` inside one patch; where patches are smaller than the
   texels of the image, so that not each holds a point, what the patch holds. */
static void fiv__measure_light(double power[3], double direction[3], fiv_environment *e, const sat_image *image,
                               size_t patch, const float floor_rgb[3])
{
    fiv__scan scan;
    float rgb[3 * FIV__BLOCK], middle[3];
    int x, y, i, c, size = e->patch, width, height;
    fiv_environment_stats ignored;
    double polar, reach = 3.0 / size, length;
    memset(&ignored, 0, sizeof ignored);
    scan.environment = e;
    scan.image = image;
    scan.cut = fiv__cut(e, image);
    height = image->height * scan.cut;
    fiv__cube_direction(middle, (int)(patch / (size_t)(size * size)),
                        fiv__texel_coordinate((int)(patch % (size_t)size), size),
                        fiv__texel_coordinate((int)(patch / (size_t)size % (size_t)size), size));
    length = sqrt((double)fiv__dot(middle, middle));
    polar = acos((double)middle[1] / length) / 3.141592653589793;
    for (c = 0; c < 3; c++) power[c] = direction[c] = 0;
    width = image->width < size || 2 * image->height < size ? 0 : image->width * scan.cut;
    for (x = 0; x < width; x += FIV__BLOCK) {
        fiv__scan_columns(&scan, x);
        for (y = sat__max_int(0, (int)((polar - reach) * height)); y < height && y < (polar + reach) * height + 1;
             y++) {
            double t = 3.141592653589793 * y / height, step = 3.141592653589793 / height, middle_angle = t + 0.5 * step;
            double solid = (cos(t) - cos(t + step)) * 6.283185307179586 / width;
            fiv__scan_read(rgb, &scan, y / scan.cut, &ignored);
            for (i = 0; i < scan.count; i++) {
                const float *p = rgb + 3 * ((scan.x0 + i) / scan.cut - scan.x0 / scan.cut);
                float d[3];
                double light = 0;
                fiv__scan_direction(d, &scan, i, (float)sin(middle_angle), (float)cos(middle_angle));
                if (fiv__cube_texel(d, size) != patch) continue;
                for (c = 0; c < 3; c++) {
                    double above = ((double)p[c] - (double)floor_rgb[c]) * solid;
                    power[c] += above;
                    light += above;
                }
                for (c = 0; c < 3; c++) direction[c] += light * (double)d[c];
            }
        }
    }
    for (c = 0; c < 3; c++) power[c] = power[c] > 0 ? power[c] : 0; /* a mean of equal floats may be the larger one */
    if (power[0] + power[1] + power[2] > 0) return;
    for (c = 0; c < 3; c++) {
        const float *cell = e->source + 4 * patch;
        power[c] = ((double)cell[c] - (double)floor_rgb[c]) * (double)cell[3];
    }
    for (c = 0; c < 3; c++) direction[c] = (power[0] + power[1] + power[2]) * (double)middle[c] / length;
}

/* 1 when a patch lies within one texel of the masks of a light. */
static int fiv__is_beside_light(const fiv_environment *e, double sums[FIV_MAX_LIGHTS][3], size_t patch)
{
    float d[3];
    int i, size = e->patch;
    double cosine = cos(2.0 / e->face);
    fiv__cube_direction(d, (int)(patch / (size_t)(size * size)),
                        fiv__texel_coordinate((int)(patch % (size_t)size), size),
                        fiv__texel_coordinate((int)(patch / (size_t)size % (size_t)size), size));
    fiv__normalise(d, d);
    for (i = 0; i < e->light_count; i++) {
        const double *s = sums[i];
        double length = sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2]);
        if ((double)d[0] * s[0] + (double)d[1] * s[1] + (double)d[2] * s[2] > cosine * length) return 1;
    }
    return 0;
}

/* The brightest patch above the limit, or above a quarter of it beside a light; 0 when there is none. */
static int fiv__brightest_patch(size_t *patch, const fiv_environment *e, double limit, double sums[FIV_MAX_LIGHTS][3])
{
    size_t i, n = (size_t)e->patch * (size_t)e->patch * 6;
    double best = 0;
    int found = 0;
    for (i = 0; i < n; i++) {
        double light = fiv__patch_light(e->source + 4 * i);
        double least = limit * (double)e->source[4 * i + 3];
        if (light > best && (light > least || (light > 0.25 * least && fiv__is_beside_light(e, sums, i)))) {
            best = light;
            *patch = i;
            found = 1;
        }
    }
    return found;
}

/* Adds to a light nearer than one texel of the masks, or starts a new one; 0 when there is no room. */
static int fiv__add_light(fiv_environment *e, double sums[FIV_MAX_LIGHTS][3], const double power[3],
                          const double direction[3])
{
    double length = sqrt(direction[0] * direction[0] + direction[1] * direction[1] + direction[2] * direction[2]);
    double near_cosine = cos(2.0 / e->face);
    int i, c;
    for (i = 0; i < e->light_count; i++) {
        double other = sqrt(sums[i][0] * sums[i][0] + sums[i][1] * sums[i][1] + sums[i][2] * sums[i][2]);
        double dot = sums[i][0] * direction[0] + sums[i][1] * direction[1] + sums[i][2] * direction[2];
        if (dot > near_cosine * length * other) break;
    }
    if (i == e->max_lights) return 0;
    if (i == e->light_count) {
        memset(&e->lights[i], 0, sizeof e->lights[i]);
        sums[i][0] = sums[i][1] = sums[i][2] = 0;
        e->light_count++;
    }
    for (c = 0; c < 3; c++) {
        e->lights[i].power[c] = (float)((double)e->lights[i].power[c] + power[c]);
        sums[i][c] += direction[c];
    }
    return 1;
}

static void fiv__split_lights(fiv_environment *e, const sat_image *image)
{
    size_t i, n = (size_t)e->patch * (size_t)e->patch * 6, patch = 0;
    double total = 0, rest, limit, split = 0, sums[FIV_MAX_LIGHTS][3];
    float floor_rgb[3];
    int k, c, tries;
    memset(sums, 0, sizeof sums);
    e->light_count = 0;
    for (i = 0; i < n; i++) total += fiv__patch_light(e->source + 4 * i);
    e->stats.light_share = 0;
    if (e->delta_ratio > 0 && total > 0) {
        limit = total / 12.566370614359172 * (double)e->delta_ratio;
        for (i = 0, rest = 0; i < n; i++) {
            double light = fiv__patch_light(e->source + 4 * i);
            if (light <= 0.25 * limit * (double)e->source[4 * i + 3]) rest += light;
        }
        rest /= 3 * 12.566370614359172; /* bright patches keep the mean of the others */
        for (tries = 0; tries < 8 * FIV_MAX_LIGHTS && fiv__brightest_patch(&patch, e, limit, sums); tries++) {
            double power[3], direction[3];
            for (c = 0; c < 3; c++) {
                float *cell = e->source + 4 * patch;
                floor_rgb[c] = cell[c] < (float)rest ? cell[c] : (float)rest;
            }
            fiv__measure_light(power, direction, e, image, patch, floor_rgb);
            if (!fiv__add_light(e, sums, power, direction)) break; /* no room: this and weaker patches stay */
            split += power[0] + power[1] + power[2];
            for (c = 0; c < 3; c++) e->source[4 * patch + (size_t)c] = floor_rgb[c];
        }
        e->stats.light_share = (float)(split / total < 1 ? split / total : 1);
    }
    for (k = 0; k < e->light_count; k++) { /* a disc of half angle a has the mean direction (1 + cos a) / 2 */
        fiv__light *l = &e->lights[k];
        double length = sqrt(sums[k][0] * sums[k][0] + sums[k][1] * sums[k][1] + sums[k][2] * sums[k][2]);
        double cosine = 2 * length / ((double)l->power[0] + (double)l->power[1] + (double)l->power[2]) - 1;
        for (c = 0; c < 3; c++) l->direction[c] = (float)(sums[k][c] / length);
        l->radius = cosine < 1 ? (float)acos(cosine > 0 ? cosine : 0) : 0;
    }
    e->stats.lights = e->light_count;
}

#endif /* FIV_NO_DELTA */

/* >> integrals */

/* ---- from the source cube to the integrals, seen from any frame */

typedef struct fiv__gather {
    const fiv_environment *environment;
    float frame[9];  /* image direction = frame * cube direction */
    double *sums;
    float *radiance; /* NULL: not wanted */
} fiv__gather;

/* Mean radiance of the texels of a row: 4 x 4 points of the source cube each. */
static void fiv__gather_radiance(float rgb[3 * FIV__MAX_FACE], const fiv__gather *g, int row)
{
    const fiv_environment *e = g->environment;
    int x, j, c, face = row / e->face, points = 4 * e->face;
    memset(rgb, 0, (size_t)(3 * e->face) * sizeof *rgb);
    for (j = 0; j < 4; j++) {
        float start[3], step[3];
        fiv__axes a = fiv__face_axes(face);
        fiv__cube_direction(start, face, 0, fiv__texel_coordinate(4 * (row % e->face) + j, points));
        fiv__turn(start, g->frame, start);
        for (c = 0; c < 3; c++) step[c] = g->frame[3 * c + a.u];
        for (x = 0; x < points; x++) {
            float u = fiv__texel_coordinate(x, points), d[3];
            const float *cell;
            for (c = 0; c < 3; c++) d[c] = start[c] + u * step[c];
            cell = e->source + 4 * fiv__cube_texel(d, e->patch);
            for (c = 0; c < 3; c++) rgb[3 * (x >> 2) + c] += cell[c];
        }
    }
    for (x = 0; x < 3 * e->face; x++) rgb[x] *= 0.0625f;
}

/* One row: the ten integrands of each texel, and their scans. */
static void fiv__gather_row(const fiv__gather *g, int row)
{
    double terms[FIV__TERMS][FIV__MAX_FACE], *out;
    float rgb[3 * FIV__MAX_FACE];
    int x, c, k, size = g->environment->face, face = row / size, y = row % size;
    const double *angles = g->environment->angles + y * size;
    fiv__gather_radiance(rgb, g, row);
    for (x = 0; x < size; x++) {
        float d[3];
        fiv__cube_direction(d, face, fiv__texel_coordinate(x, size), fiv__texel_coordinate(y, size));
        fiv__normalise(d, d);
        for (c = 0; c < 3; c++)
            for (k = 0; k < 3; k++) terms[3 * c + k][x] = (double)rgb[3 * x + c] * angles[x] * (double)d[k];
        terms[9][x] = angles[x];
    }
    if (g->radiance) memcpy(g->radiance + 3 * (size_t)row * (size_t)size, rgb, 3 * (size_t)size * sizeof *rgb);
    out = g->sums + (size_t)row * (size_t)(size + 1) * FIV__TERMS;
    for (k = 0; k < FIV__TERMS; k++) {
        sat_scan_f64(terms[k], terms[k], (size_t)size, NULL);
        out[k] = 0;
        for (x = 0; x < size; x++) out[(x + 1) * FIV__TERMS + k] = terms[k][x];
    }
}

static void fiv__gather_rows(int begin, int end, int worker, void *context)
{
    int row;
    (void)worker;
    for (row = begin; row < end; row++) fiv__gather_row((const fiv__gather *)context, row);
}

/* ---- I_tot: a half-space is one span a row, so that the O(n^2) double sum over normals and texels becomes O(n^1.5) */

/* The texels [*begin, *end) of a row whose centre lies above the horizon of N. */
static inline void fiv__half_space(int *begin, int *end, const float normal[3], int row, int size)
{
    fiv__axes a = fiv__face_axes(row / size);
    float constant = normal[a.w] * a.sign + normal[a.v] * fiv__texel_coordinate(row % size, size), slope = normal[a.u],
          x;
    *begin = 0;
    *end = size;
    if (slope == 0) {
        if (!(constant > 0)) *end = 0;
        return;
    }
    x = (1 - constant / slope) * 0.5f * (float)size - 0.5f;
    x = x < -1 ? -1 : x > (float)size ? (float)size : x;
    if (slope > 0) *begin = sat__clamp_int((int)(x + 2) - 1, 0, size);
    else *end = sat__clamp_int(size - (int)((float)size - x), 0, size);
}

static inline void fiv__add_span(double sum[FIV__TERMS], const double *row_sums, int begin, int end)
{
    const double *a = row_sums + begin * FIV__TERMS, *b = row_sums + end * FIV__TERMS;
    int k;
    for (k = 0; k < FIV__TERMS; k++) sum[k] += b[k] - a[k];
}

static void fiv__half_space_integral(double sum[FIV__TERMS], const double *sums, const float normal[3], int size)
{
    int row, begin, end;
    memset(sum, 0, FIV__TERMS * sizeof *sum);
    for (row = 0; row < 6 * size; row++) {
        fiv__half_space(&begin, &end, normal, row, size);
        if (begin < end) fiv__add_span(sum, sums + (size_t)row * (size_t)(size + 1) * FIV__TERMS, begin, end);
    }
}

/* I_tot at the corners of one row of texels of faces 0, 2, 4, and of the opposite normals by I(-N) = I(N) - N FIV. */
static void fiv__irradiance_row(fiv_environment *e, int row)
{
    int side = e->face + 1, face = 2 * (row / side), y = row % side, x, c;
    for (x = 0; x < side; x++) {
        float corner[3], normal[3], *front, *back;
        double sum[FIV__TERMS];
        fiv__cube_direction(corner, face, 2 * (float)x / (float)e->face - 1, 2 * (float)y / (float)e->face - 1);
        fiv__normalise(normal, corner);
        fiv__half_space_integral(sum, e->sums, normal, e->face);
        front = e->irradiance + 3 * ((size_t)(face * side + y) * (size_t)side + (size_t)x);
        /* -N lies on the opposite face, where u and v change places */
        back = e->irradiance + 3 * ((size_t)((face + 1) * side + side - 1 - x) * (size_t)side + (size_t)(side - 1 - y));
        for (c = 0; c < 3; c++) {
            double all = 0, above = 0;
            int k;
            for (k = 0; k < 3; k++) {
                above += sum[3 * c + k] * (double)normal[k];
                all += e->vector[3 * c + k] * (double)normal[k];
            }
            front[c] = (float)(above > 0 ? above : 0);
            back[c] = (float)(above - all > 0 ? above - all : 0);
        }
    }
}

static void fiv__irradiance_rows(int begin, int end, int worker, void *context)
{
    int row;
    (void)worker;
    for (row = begin; row < end; row++) fiv__irradiance_row((fiv_environment *)context, row);
}

static void fiv__environment_totals(fiv_environment *e)
{
    size_t i, n = 6 * (size_t)e->face * (size_t)e->face;
    int row, c, k;
    memset(e->vector, 0, sizeof e->vector);
    e->flux[0] = e->flux[1] = e->flux[2] = 0;
    e->largest[0] = e->largest[1] = e->largest[2] = 0;
    for (row = 0; row < 6 * e->face; row++) {
        const double *end = e->sums + ((size_t)row * (size_t)(e->face + 1) + (size_t)e->face) * FIV__TERMS;
        for (k = 0; k < 9; k++) e->vector[k] += end[k];
    }
    for (i = 0; i < n; i++) {
        double angle = e->angles[i % ((size_t)e->face * (size_t)e->face)];
        for (c = 0; c < 3; c++) {
            float v = e->radiance[3 * i + (size_t)c];
            e->flux[c] += (double)v * angle;
            if (v > e->largest[c]) e->largest[c] = v;
        }
    }
}

static void fiv__environment_gather(fiv_environment *e, const float rotation[9])
{
    fiv__gather g;
    int i, j;
    g.environment = e;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++) g.frame[3 * i + j] = rotation[3 * j + i];
    g.sums = e->sums;
    g.radiance = e->radiance;
    sat__parallel_for(&e->threads, 6 * e->face, fiv__gather_rows, &g);
    fiv__environment_totals(e);
}

static void fiv__environment_layout(fiv_environment *e, sat__arena *arena)
{
    size_t face = (size_t)e->face, patch = (size_t)e->patch;
    e->source = (float *)sat__carve(arena, 24 * patch * patch, sizeof(float));
    e->irradiance = (float *)sat__carve(arena, 18 * (face + 1) * (face + 1), sizeof(float));
    e->radiance = (float *)sat__carve(arena, 18 * face * face, sizeof(float));
    e->sums = (double *)sat__carve(arena, 6 * face * (face + 1) * FIV__TERMS, sizeof(double));
    e->angles = (double *)sat__carve(arena, face * face, sizeof(double));
}

static int fiv__image_is_valid(const sat_image *image)
{
    return sat__image_is_valid(image) && image->channels != 2 && image->width <= 1 << 20 && image->height <= 1 << 20;
}

FIV_DEF sat_result fiv_environment_create(fiv_environment **out, const sat_image *equirect_rgb,
                                          const fiv_environment_options *options, fiv_environment_stats *stats)
{
    fiv_environment_options o = options ? *options : fiv_environment_defaults();
    fiv_environment e, *made;
    sat__arena arena;
    sat_result result;
    int i;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    if (!fiv__image_is_valid(equirect_rgb) ||
        sat__fields_check(&o, fiv__environment_fields, SAT__COUNT(fiv__environment_fields)))
        return SAT_ERR_ARGUMENT;
    memset(&e, 0, sizeof e);
    if (!sat__resolve_allocator(&e.allocator, &o.allocator)) return SAT_ERR_ARGUMENT;
    e.threads = o.threads;
    e.face = o.resolution;
    e.patch = 2 * o.resolution;
    e.delta_ratio = o.delta_ratio;
    e.max_lights = o.max_lights;
    e.max_radiance = o.max_radiance;
    memset(&arena, 0, sizeof arena);
    sat__carve(&arena, 1, sizeof e);
    fiv__environment_layout(&e, &arena);
    result = sat__arena_allocate(&arena, &e.block, &e.block_size, &e.allocator);
    if (result != SAT_OK) return result;
    e.stats.bytes = e.block_size;
    made = (fiv_environment *)sat__carve(&arena, 1, sizeof e);
    fiv__environment_layout(&e, &arena);
    *made = e;
    for (i = 0; i < e.face * e.face; i++) made->angles[i] = fiv__texel_angle(i % e.face, i / e.face, e.face);
    result = fiv_environment_update(made, equirect_rgb, NULL);
    SAT_ASSERT(result == SAT_OK);
    *out = made;
    if (stats) *stats = made->stats;
    return result;
}

FIV_DEF sat_result fiv_environment_update(fiv_environment *e, const sat_image *equirect_rgb, const float rotation[9])
{
    float turned[9];
    if (!e || !fiv__set_rotation(turned, rotation)) return SAT_ERR_ARGUMENT;
    if (equirect_rgb && !fiv__image_is_valid(equirect_rgb)) return SAT_ERR_ARGUMENT;
    e->stamp++;
    if (equirect_rgb) {
        fiv__read_image(e, equirect_rgb);
#ifndef FIV_NO_DELTA
        fiv__split_lights(e, equirect_rgb);
#endif
        fiv__environment_gather(e, fiv__identity);
        sat__parallel_for(&e->threads, 3 * (e->face + 1), fiv__irradiance_rows, e);
    }
    if (!equirect_rgb || memcmp(turned, fiv__identity, sizeof turned) != 0) fiv__environment_gather(e, turned);
    memcpy(e->rotation, turned, sizeof turned);
    return SAT_OK;
}

FIV_DEF fiv_environment_stats fiv_environment_get_stats(const fiv_environment *e)
{
    fiv_environment_stats none;
    memset(&none, 0, sizeof none);
    return e ? e->stats : none;
}

FIV_DEF void fiv_environment_destroy(fiv_environment *e)
{
    sat_allocator allocator;
    if (!e) return;
    allocator = e->allocator;
    sat__release(&allocator, e->block, e->block_size);
}

/* I_tot without the directional lights: bilinear between the corners of the cube's texels. */
static void fiv__diffuse(float rgb[3], const fiv_environment *e, const float unit_normal[3])
{
    float d[3], u, v;
    int face, x, y, c, side = e->face + 1;
    const float *p;
    fiv__turn_back(d, e->rotation, unit_normal);
    face = fiv__cube_face(d, &u, &v);
    u = (u + 1) * 0.5f * (float)e->face;
    v = (v + 1) * 0.5f * (float)e->face;
    x = sat__clamp_int((int)u, 0, e->face - 1);
    y = sat__clamp_int((int)v, 0, e->face - 1);
    u -= (float)x;
    v -= (float)y;
    p = e->irradiance + 3 * ((size_t)(face * side + y) * (size_t)side + (size_t)x);
    for (c = 0; c < 3; c++) {
        float top = p[c] + (p[c + 3] - p[c]) * u,
              bottom = p[3 * side + c] + (p[3 * side + c + 3] - p[3 * side + c]) * u;
        rgb[c] = top + (bottom - top) * v;
    }
}

FIV_DEF void fiv_environment_irradiance(float rgb[3], const fiv_environment *e, const float normal[3])
{
    float n[3], d[3];
    int i, c;
    if (!rgb) return;
    rgb[0] = rgb[1] = rgb[2] = 0;
    if (!e || !normal) return;
    fiv__normalise(n, normal);
    if (!(fiv__dot(n, n) > 0.5f)) return;
    fiv__diffuse(rgb, e, n);
    fiv__turn_back(d, e->rotation, n);
    for (i = 0; i < e->light_count; i++) {
        float cosine = fiv__dot(d, e->lights[i].direction);
        if (cosine > 0)
            for (c = 0; c < 3; c++) rgb[c] += e->lights[i].power[c] * cosine;
    }
}

FIV_DEF void fiv_environment_vector(float fiv[9], const fiv_environment *e)
{
    int i, c, k;
    if (!fiv) return;
    for (k = 0; k < 9; k++) fiv[k] = e ? (float)e->vector[k] : 0;
    for (i = 0; e && i < e->light_count; i++) {
        float d[3];
        fiv__turn(d, e->rotation, e->lights[i].direction);
        for (c = 0; c < 3; c++)
            for (k = 0; k < 3; k++) fiv[3 * c + k] += e->lights[i].power[c] * d[k];
    }
}

FIV_DEF size_t fiv_environment_lights(float *directions, float *powers, size_t capacity, const fiv_environment *e)
{
    size_t i, c, texels, split;
    if (!e) return 0;
    if (!directions || !powers) capacity = 0;
    split = (size_t)e->light_count;
    texels = 6 * (size_t)e->face * (size_t)e->face;
    for (i = 0; i < split + texels && i < capacity; i++) {
        int size = e->face, x, y;
        size_t t = i - split;
        if (i < split) {
            fiv__turn(directions + 3 * i, e->rotation, e->lights[i].direction);
            memcpy(powers + 3 * i, e->lights[i].power, 3 * sizeof *powers);
            continue;
        }
        x = (int)(t % (size_t)size);
        y = (int)(t / (size_t)size % (size_t)size);
        fiv__cube_direction(directions + 3 * i, (int)(t / (size_t)(size * size)), fiv__texel_coordinate(x, size),
                            fiv__texel_coordinate(y, size));
        fiv__normalise(directions + 3 * i, directions + 3 * i);
        for (c = 0; c < 3; c++)
            powers[3 * i + c] = (float)((double)e->radiance[3 * t + c] * e->angles[y * size + x]);
    }
    return split + texels;
}

/* >> meshes */

/* ---- meshes: clusters of up to 64 triangles that lie near each other, with their own vertices as three arrays */

enum {
    FIV__CLUSTER = 64,                    /* triangles */
    FIV__CLUSTER_VERTICES = 3 * FIV__CLUSTER
};

typedef struct fiv__cluster {
    float centre[3], radius;   /* ball around its vertices */
    float axis[3], cosine;     /* cone around its normals; cosine <= 0: they point everywhere */
    size_t vertex, triangle;   /* the first of each */
    int vertices, triangles;   /* vertices is a multiple of 4: the last one repeats */
} fiv__cluster;

/* Vertices are relative to the bounding ball's centre, in units of its radius. */
typedef struct fiv__mesh {
    size_t triangle_count, cluster_count, vertex_count;
    size_t source_count;       /* vertices of the caller's array */
    int closed;                /* 1: every edge is met once in each direction */
    float turn;                /* -1: the triangles are clockwise seen from outside; changes places of u and v */
    fiv__cluster *clusters;
    float *x[3];
    uint32_t *source;          /* index into the caller's positions */
    unsigned char *corner;     /* 3 a triangle, into the cluster's vertices */
} fiv__mesh;

static int fiv__triangle_is_usable(const float *positions, const unsigned *t)
{
    int i, k;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++)
            if (!sat__is_finite(positions[3 * (size_t)t[i] + (size_t)k])) return 0;
    return t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
}

/* Every edge is met equally often in both directions: rays that enter must leave. keys and scratch: 3 a triangle. */
static int fiv__is_closed(const uint64_t *triangles, size_t count, const unsigned *indices, uint64_t *keys,
                          uint64_t *scratch)
{
    size_t i, n = 0;
    int k;
    for (i = 0; i < count; i++)
        for (k = 0; k < 3; k++) {
            const unsigned *t = indices + 3 * (size_t)(triangles[i] & 0xffffffffu);
            uint64_t a = t[k], b = t[(k + 1) % 3];
            keys[n++] = a < b ? a << 32 | b << 1 : b << 32 | a << 1 | 1;
        }
    keys = sat__radix_sort(keys, scratch, n, 0, 64, 8);
    for (i = 0; i < n;) {
        size_t j = i;
        long balance = 0;
        for (; j < n && keys[j] >> 1 == keys[i] >> 1; j++) balance += keys[j] & 1 ? -1 : 1;
        if (balance) return 0;
        i = j;
    }
    return n > 0;
}

static uint64_t fiv__spread(uint32_t v) /* bit i of 10 goes to bit 3 i */
{
    uint64_t x = v & 1023u;
    x = (x | x << 16) & 0x030000ff;
    x = (x | x << 8) & 0x0300f00f;
    x = (x | x << 4) & 0x030c30c3;
    return (x | x << 2) & 0x09249249;
}

/* Fills order[] with the usable triangles along a Morton curve, the index in the low half; returns the sorted array. */
static uint64_t *fiv__order_triangles(uint64_t *order, uint64_t *scratch, size_t *count, const float *positions,
                                      const unsigned *indices, size_t triangle_count)
{
    double low[3] = {1e300, 1e300, 1e300}, high[3] = {-1e300, -1e300, -1e300};
    size_t i, n = 0;
    int k, j;
    for (i = 0; i < triangle_count; i++) {
        if (!fiv__triangle_is_usable(positions, indices + 3 * i)) continue;
        order[n++] = i;
        for (j = 0; j < 3; j++)
            for (k = 0; k < 3; k++) {
                double v = (double)positions[3 * (size_t)indices[3 * i + (size_t)j] + (size_t)k];
                if (v < low[k]) low[k] = v;
                if (v > high[k]) high[k] = v;
            }
    }
    for (i = 0; i < n; i++) {
        const unsigned *t = indices + 3 * (size_t)order[i];
        uint64_t key = 0;
        for (k = 0; k < 3; k++) {
            double mean = 0, range = high[k] - low[k];
            for (j = 0; j < 3; j++) mean += (double)positions[3 * (size_t)t[j] + (size_t)k] / 3;
            key |= fiv__spread((uint32_t)(range > 0 ? (mean - low[k]) / range * 1023 : 0)) << k;
        }
        order[i] |= key << 32;
    }
    *count = n;
    return sat__radix_sort(order, scratch, n, 32, 64, 8);
}

/* Cuts the ordered triangles into clusters, each with its own list of vertices. */
static void fiv__make_clusters(fiv__mesh *mesh, const uint64_t *order, const unsigned *indices)
{
    size_t i, vertex = 0;
    for (i = 0; i < mesh->triangle_count; i += FIV__CLUSTER) {
        fiv__cluster *c = &mesh->clusters[i / FIV__CLUSTER];
        size_t left = mesh->triangle_count - i, n = left < FIV__CLUSTER ? left : (size_t)FIV__CLUSTER, t;
        int k, v;
        c->vertex = vertex;
        c->triangle = i;
        c->triangles = (int)n;
        c->vertices = 0;
        for (t = 0; t < n; t++)
            for (k = 0; k < 3; k++) {
                uint32_t source = indices[3 * (size_t)(order[i + t] & 0xffffffffu) + (size_t)k];
                for (v = 0; v < c->vertices && mesh->source[vertex + (size_t)v] != source; v++) {}
                if (v == c->vertices) mesh->source[vertex + (size_t)c->vertices++] = source;
                mesh->corner[3 * (i + t) + (size_t)k] = (unsigned char)v;
            }
        for (; c->vertices & 3; c->vertices++) mesh->source[vertex + (size_t)c->vertices] = mesh->source[vertex];
        vertex += (size_t)c->vertices;
    }
    mesh->vertex_count = vertex;
}

/* The ball around the vertices in use: the centre walks towards the farthest vertex, by 1/2, 1/3, 1/4 ... of the way
   (Badoiu and Clarkson 2003); within 1 % of the smallest ball. */
static void fiv__bounding_ball(double centre[3], double *radius, const fiv__mesh *mesh, const float *positions)
{
    size_t i, farthest = 0;
    int step, k;
    double best = 0;
    centre[0] = centre[1] = centre[2] = *radius = 0;
    if (mesh->vertex_count == 0) return;
    for (k = 0; k < 3; k++) centre[k] = (double)positions[3 * (size_t)mesh->source[0] + (size_t)k];
    for (step = 1; step <= 100; step++) {
        best = -1;
        for (i = 0; i < mesh->vertex_count; i++) {
            const float *p = positions + 3 * (size_t)mesh->source[i];
            double x = (double)p[0] - centre[0], y = (double)p[1] - centre[1], z = (double)p[2] - centre[2],
                   d = x * x + y * y + z * z;
            if (d > best) {
                best = d;
                farthest = i;
            }
        }
        if (step == 100) break;
        for (k = 0; k < 3; k++)
            centre[k] += ((double)positions[3 * (size_t)mesh->source[farthest] + (size_t)k] - centre[k]) / (step + 1);
    }
    for (k = 0; k < 3; k++) centre[k] = (double)(float)centre[k];
    *radius = sqrt(best) * 1.000001;
}

/* Ball of vertices and cone of normals of a cluster. */
static void fiv__bound_cluster(fiv__cluster *c, const fiv__mesh *mesh)
{
    float low[3] = {2, 2, 2}, high[3] = {-2, -2, -2}, normals[FIV__CLUSTER][3], square = 0;
    int i, k;
    for (i = 0; i < c->vertices; i++)
        for (k = 0; k < 3; k++) {
            float v = mesh->x[k][c->vertex + (size_t)i];
            if (v < low[k]) low[k] = v;
            if (v > high[k]) high[k] = v;
        }
    for (k = 0; k < 3; k++) {
        c->centre[k] = 0.5f * (low[k] + high[k]);
        c->axis[k] = 0;
    }
    for (i = 0; i < c->vertices; i++) {
        float d[3];
        for (k = 0; k < 3; k++) d[k] = mesh->x[k][c->vertex + (size_t)i] - c->centre[k];
        if (fiv__dot(d, d) > square) square = fiv__dot(d, d);
    }
    c->radius = sqrtf(square) * 1.0001f + 1e-6f;
    for (i = 0; i < c->triangles; i++) {
        const unsigned char *t = mesh->corner + 3 * (c->triangle + (size_t)i);
        float a[3], b[3], n[3];
        for (k = 0; k < 3; k++) {
            const float *x = mesh->x[k] + c->vertex;
            a[k] = x[t[1]] - x[t[0]];
            b[k] = x[t[2]] - x[t[0]];
        }
        for (k = 0; k < 3; k++) n[k] = (a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3]) * mesh->turn;
        fiv__normalise(normals[i], n);
        for (k = 0; k < 3; k++) c->axis[k] += normals[i][k];
    }
    fiv__normalise(c->axis, c->axis);
    c->cosine = 1;
    for (i = 0; i < c->triangles; i++) {
        float cosine = fiv__dot(c->axis, normals[i]) - 1e-4f;
        if (cosine < c->cosine && fiv__dot(normals[i], normals[i]) > 0.5f) c->cosine = cosine;
    }
}

/* Takes the caller's positions over: bounding ball, relative vertices, bounds of the clusters. 0: too large for
   float. */
static int fiv__place_mesh(fiv__mesh *mesh, float centre[3], float *radius, const float *positions)
{
    double middle[3], r, volume = 0;
    size_t i;
    int k;
    fiv__bounding_ball(middle, &r, mesh, positions);
    for (k = 0; k < 3; k++) centre[k] = (float)middle[k];
    *radius = (float)r;
    if (!(r < 1e18) || !sat__is_finite(*radius)) return 0;
    if (!(r > 0)) mesh->triangle_count = mesh->cluster_count = mesh->vertex_count = 0;
    for (i = 0; i < mesh->vertex_count; i++)
        for (k = 0; k < 3; k++)
            mesh->x[k][i] = (float)(((double)positions[3 * (size_t)mesh->source[i] + (size_t)k] - middle[k]) / r);
    mesh->turn = 1;
    for (i = 0; i < mesh->cluster_count; i++) {
        const fiv__cluster *c = &mesh->clusters[i];
        int t;
        for (t = 0; t < c->triangles; t++) {
            const unsigned char *corner = mesh->corner + 3 * (c->triangle + (size_t)t);
            double p[3][3];
            int j;
            for (j = 0; j < 3; j++)
                for (k = 0; k < 3; k++) p[j][k] = (double)mesh->x[k][c->vertex + corner[j]];
            volume += p[0][0] * (p[1][1] * p[2][2] - p[1][2] * p[2][1]) +
                      p[0][1] * (p[1][2] * p[2][0] - p[1][0] * p[2][2]) +
                      p[0][2] * (p[1][0] * p[2][1] - p[1][1] * p[2][0]);
        }
    }
    if (volume < 0) mesh->turn = -1;
    for (i = 0; i < mesh->cluster_count; i++) fiv__bound_cluster(&mesh->clusters[i], mesh);
    return 1;
}

static void fiv__mesh_layout(fiv__mesh *mesh, sat__arena *arena)
{
    size_t vertices = 3 * mesh->triangle_count + 4 * mesh->cluster_count;
    int k;
    mesh->clusters = (fiv__cluster *)sat__carve(arena, mesh->cluster_count, sizeof *mesh->clusters);
    for (k = 0; k < 3; k++) mesh->x[k] = (float *)sat__carve(arena, vertices, sizeof(float));
    mesh->source = (uint32_t *)sat__carve(arena, vertices, sizeof(uint32_t));
    mesh->corner = (unsigned char *)sat__carve(arena, 3 * mesh->triangle_count, 1);
}

/* >> masks */

/* ---- masks: which texels a mesh covers, seen from the origin when its centre stands at `offset`. One word a row, a
   bit a texel, set when the ray through the texel's centre meets a triangle, borders included. The triangle is the cone
   of its three corners, so that nothing needs to be clipped: on a row it is one interval, and one OR. */

typedef struct fiv__raster {
    const fiv__mesh *mesh;
    uint64_t *rows;
    float offset[3];
    int size;
} fiv__raster;

static inline uint64_t fiv__bits(int begin, int end) /* begin < end */
{
    return (end - begin >= 64 ? ~(uint64_t)0 : ((uint64_t)1 << (end - begin)) - 1) << begin;
}

static inline int fiv__first_bit(uint64_t v) /* v != 0 */
{
#if defined(__GNUC__) || defined(__clang__)
    return __builtin_ctzll(v);
#else
    int n = 0;
    for (; !(v & 0xff); v >>= 8) n += 8;
    for (; !(v & 1); v >>= 1) n++;
    return n;
#endif
}

static inline int fiv__count_bits(uint64_t v)
{
    v = v - ((v >> 1) & 0x5555555555555555u);
    v = (v & 0x3333333333333333u) + ((v >> 2) & 0x3333333333333333u);
    v = (v + (v >> 4)) & 0x0f0f0f0f0f0f0f0fu;
    return (int)((v * 0x0101010101010101u) >> 56);
}

static inline int fiv__floor(float v) { return (int)v - (v < (float)(int)v); }
static inline int fiv__ceil(float v) { return (int)v + (v > (float)(int)v); }

/* A triangle that may reach behind the eye: its three edge planes, in doubles. */
static void fiv__raster_cone(const fiv__raster *r, int face, double p[3][3])
{
    fiv__axes ax = fiv__face_axes(face);
    double e[3][3], det;
    int i, k, y, size = r->size;
    for (i = 0; i < 3; i++) {
        const double *a = p[i], *b = p[(i + 1) % 3];
        for (k = 0; k < 3; k++) e[i][k] = a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    }
    det = e[0][0] * p[2][0] + e[0][1] * p[2][1] + e[0][2] * p[2][2];
    if (r->mesh->closed) det *= (double)r->mesh->turn;
    if (!(det > 0 || (!r->mesh->closed && det < 0))) return;
    if (r->mesh->closed) det *= (double)r->mesh->turn;
    for (i = 0; i < 3; i++)
        for (k = 0; k < 3; k++) e[i][k] = det < 0 ? -e[i][k] : e[i][k];
    for (y = 0; y < size; y++) {
        double low = -1, high = 1, v = (2.0 * y + 1) / size - 1;
        int x0, x1;
        for (i = 0; i < 3; i++) {
            double constant = e[i][ax.w] * (double)ax.sign + v * e[i][ax.v], slope = e[i][ax.u];
            if (slope > 0) low = -constant / slope > low ? -constant / slope : low;
            else if (slope < 0) high = -constant / slope < high ? -constant / slope : high;
            else if (constant < 0) high = -2;
        }
        if (!(low <= high)) continue;
        low = ceil((low + 1) * 0.5 * size - 0.5);
        high = floor((high + 1) * 0.5 * size - 0.5);
        x0 = (int)low;
        x1 = (int)high;
        if (x0 < 0) x0 = 0;
        if (x1 > size - 1) x1 = size - 1;
        if (x0 <= x1) r->rows[face * size + y] |= fiv__bits(x0, x1 + 1);
    }
}

/* A triangle in front of the eye, corners in texels: x[i], y[i]. Both triangles at an edge compute the same crossing,
   lower corner first, so that no crack opens. */
static void fiv__raster_flat(uint64_t *rows, int size, const float x[3], const float y[3], int y0, int y1)
{
    float bottom[3], top[3], start[3], slope[3];
    int i, row;
    for (i = 0; i < 3; i++) {
        int a = i, b = (i + 1) % 3;
        if (y[a] > y[b] || (y[a] == y[b] && x[a] > x[b])) {
            a = b;
            b = i;
        }
        bottom[i] = y[a];
        top[i] = y[b];
        start[i] = x[a];
        slope[i] = y[b] > y[a] ? (x[b] - x[a]) / (y[b] - y[a]) : 0;
    }
    for (row = y0; row <= y1; row++) {
        float low = 1e30f, high = -1e30f, at = (float)row;
        int x0, x1;
        for (i = 0; i < 3; i++) {
            float cross = start[i] + (at - bottom[i]) * slope[i];
            if (bottom[i] > at || top[i] < at) continue;
            low = cross < low ? cross : low;
            high = cross > high ? cross : high;
        }
        if (!(low <= high)) continue;
        x0 = sat__max_int(fiv__ceil(low), 0);
        x1 = sat__min_int(fiv__floor(high), size - 1);
        if (x0 <= x1) rows[row] |= fiv__bits(x0, x1 + 1);
    }
}

/* Projects a cluster's vertices to texel coordinates of a face; box: least and largest x, then y. */
static void fiv__project(float *px, float *py, float box[4], const fiv__raster *r, const fiv__cluster *c, int face)
{
    fiv__axes ax = fiv__face_axes(face);
    const float *xu = r->mesh->x[ax.u] + c->vertex, *xv = r->mesh->x[ax.v] + c->vertex,
                *xw = r->mesh->x[ax.w] + c->vertex;
    float ou = r->offset[ax.u], ov = r->offset[ax.v], ow = r->offset[ax.w], half = 0.5f * (float)r->size;
    int i;
    sat__f32x4 scale = sat__f32x4_set1(half * ax.sign), shift = sat__f32x4_set1(half - 0.5f);
    sat__f32x4 low_x = sat__f32x4_set1(1e30f), low_y = low_x, high_x = sat__f32x4_set1(-1e30f), high_y = high_x;
    float lanes[4][4];
    for (i = 0; i < c->vertices; i += 4) {
        sat__f32x4 w = sat__f32x4_add(sat__f32x4_load(xw + i), sat__f32x4_set1(ow)), q = sat__f32x4_div(scale, w);
        sat__f32x4 x =
            sat__f32x4_add(sat__f32x4_mul(sat__f32x4_add(sat__f32x4_load(xu + i), sat__f32x4_set1(ou)), q), shift);
        sat__f32x4 y =
            sat__f32x4_add(sat__f32x4_mul(sat__f32x4_add(sat__f32x4_load(xv + i), sat__f32x4_set1(ov)), q), shift);
        sat__f32x4_store(px + i, x);
        sat__f32x4_store(py + i, y);
        low_x = sat__f32x4_min(low_x, x);
        high_x = sat__f32x4_max(high_x, x);
        low_y = sat__f32x4_min(low_y, y);
        high_y = sat__f32x4_max(high_y, y);
    }
    sat__f32x4_store(lanes[0], low_x);
    sat__f32x4_store(lanes[1], high_x);
    sat__f32x4_store(lanes[2], low_y);
    sat__f32x4_store(lanes[3], high_y);
    for (i = 0; i < 4; i++) {
        float *l = lanes[i];
        int k;
        box[i] = l[0];
        for (k = 1; k < 4; k++)
            if (i & 1 ? l[k] > box[i] : l[k] < box[i]) box[i] = l[k];
    }
}

/* 1 when all texels of the box are set already. */
static inline int fiv__is_covered(const uint64_t *rows, int x0, int x1, int y0, int y1)
{
    uint64_t bits = fiv__bits(x0, x1 + 1);
    int y;
    for (y = y0; y <= y1; y++)
        if ((rows[y] & bits) != bits) return 0;
    return 1;
}

static inline float fiv__min3(float a, float b, float c) { float m = a < b ? a : b; return m < c ? m : c; }
static inline float fiv__max3(float a, float b, float c) { float m = a > b ? a : b; return m > c ? m : c; }

/* Leaves out what faces the eye (turn != 0), holds no texel centre, or is covered already. */
static inline void fiv__raster_triangle(uint64_t *rows, const float x[3], const float y[3], int last, float turn)
{
    int x0, x1, y0, y1;
    if (turn != 0 && !(((x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])) * turn > 0)) return;
    y0 = sat__max_int(fiv__ceil(fiv__min3(y[0], y[1], y[2])), 0);
    y1 = sat__min_int(fiv__floor(fiv__max3(y[0], y[1], y[2])), last);
    if (y0 > y1) return;
    x0 = sat__max_int(fiv__ceil(fiv__min3(x[0], x[1], x[2])), 0);
    x1 = sat__min_int(fiv__floor(fiv__max3(x[0], x[1], x[2])), last);
    if (x0 > x1 || fiv__is_covered(rows, x0, x1, y0, y1)) return;
    fiv__raster_flat(rows, last + 1, x, y, y0, y1);
}

enum { FIV__BESIDE = 15, FIV__NEAR_EYE = 16 }; /* of a vertex: beside the pyramid of a face, a bit a side; behind or far
                                                  off it */

static void fiv__raster_corner(double p[3], const fiv__raster *r, size_t vertex)
{
    int k;
    for (k = 0; k < 3; k++) p[k] = (double)r->mesh->x[k][vertex] + (double)r->offset[k];
}

/* Texel coordinates of a cluster's vertices where they have some, and flags; returns the sides that all are beside. */
static int fiv__raster_corners(float *px, float *py, unsigned char *flags, const fiv__raster *r, const fiv__cluster *c,
                               int face)
{
    fiv__axes ax = fiv__face_axes(face);
    double half = 0.5 * r->size;
    int i, all = FIV__BESIDE;
    for (i = 0; i < c->vertices; i++) {
        double p[3], w, u, v, side;
        int beside;
        fiv__raster_corner(p, r, c->vertex + (size_t)i);
        w = p[ax.w] * (double)ax.sign;
        u = p[ax.u];
        v = p[ax.v];
        side = fabs(u) > fabs(v) ? fabs(u) : fabs(v);
        beside = (u > w) | (-u > w) << 1 | (v > w) << 2 | (-v > w) << 3;
        all &= beside;
        if (side <= 4 * w && w > 0) {
            px[i] = (float)((u / w + 1) * half - 0.5);
            py[i] = (float)((v / w + 1) * half - 0.5);
        } else beside |= FIV__NEAR_EYE;
        flags[i] = (unsigned char)beside;
    }
    return all;
}

/* A cluster that reaches behind the eye or far to its side: triangle by triangle. */
static void fiv__raster_cluster_cones(const fiv__raster *r, const fiv__cluster *c, int face)
{
    const fiv__mesh *mesh = r->mesh;
    float px[FIV__CLUSTER_VERTICES + 4], py[FIV__CLUSTER_VERTICES + 4];
    unsigned char flags[FIV__CLUSTER_VERTICES + 4];
    int t, j;
    if (fiv__raster_corners(px, py, flags, r, c, face)) return;
    for (t = 0; t < c->triangles; t++) {
        const unsigned char *corner = mesh->corner + 3 * (c->triangle + (size_t)t);
        if (flags[corner[0]] & flags[corner[1]] & flags[corner[2]] & FIV__BESIDE) continue;
        if ((flags[corner[0]] | flags[corner[1]] | flags[corner[2]]) & FIV__NEAR_EYE) {
            double p[3][3];
            for (j = 0; j < 3; j++) fiv__raster_corner(p[j], r, c->vertex + corner[j]);
            fiv__raster_cone(r, face, p);
        } else {
            float x[3], y[3];
            for (j = 0; j < 3; j++) {
                x[j] = px[corner[j]];
                y[j] = py[corner[j]];
            }
            fiv__raster_triangle(r->rows + (size_t)(face * r->size), x, y, r->size - 1, mesh->closed ? mesh->turn : 0);
        }
    }
}

static void fiv__raster_cluster(const fiv__raster *r, const fiv__cluster *c, int face)
{
    const fiv__mesh *mesh = r->mesh;
    const unsigned char *corner = mesh->corner + 3 * c->triangle;
    float px[FIV__CLUSTER_VERTICES + 4], py[FIV__CLUSTER_VERTICES + 4], box[4], turn = mesh->closed ? mesh->turn : 0;
    uint64_t *rows = r->rows + (size_t)(face * r->size);
    int t, last = r->size - 1, x0, x1, y0, y1;
    fiv__project(px, py, box, r, c, face);
    x0 = sat__max_int(fiv__ceil(box[0]), 0);
    x1 = sat__min_int(fiv__floor(box[1]), last);
    y0 = sat__max_int(fiv__ceil(box[2]), 0);
    y1 = sat__min_int(fiv__floor(box[3]), last);
    if (x0 > x1 || y0 > y1 || fiv__is_covered(rows, x0, x1, y0, y1)) return;
    for (t = 0; t < c->triangles; t++, corner += 3) {
        float x[3], y[3];
        x[0] = px[corner[0]];
        x[1] = px[corner[1]];
        x[2] = px[corner[2]];
        y[0] = py[corner[0]];
        y[1] = py[corner[1]];
        y[2] = py[corner[2]];
        fiv__raster_triangle(rows, x, y, last, turn);
    }
}

/* Of a closed mesh only the triangles that are left through are drawn: every ray that meets the mesh leaves it at last,
   also when it starts inside. A cluster is left out when all of its normals face the eye. */
static int fiv__cluster_faces_eye(const fiv__cluster *c, const float centre[3])
{
    float along = fiv__dot(c->axis, centre), square = fiv__dot(centre, centre) - along * along, sine;
    if (c->cosine <= 0) return 0;
    sine = sqrtf(1 - c->cosine * c->cosine);
    return along * c->cosine + sqrtf(square > 0 ? square : 0) * sine <= -c->radius;
}

/* normal: texels below its horizon do not matter, and may be set; NULL: all of them matter. */
static void fiv__raster_mesh(uint64_t *rows, const fiv__mesh *mesh, const float offset[3], int size,
                             const float *normal)
{
    fiv__raster r;
    size_t i;
    int face, low, high;
    r.mesh = mesh;
    r.rows = rows;
    r.size = size;
    memcpy(r.offset, offset, sizeof r.offset);
    memset(rows, 0, (size_t)(6 * size) * sizeof *rows);
    for (face = 0; normal && face < 6 * size; face++) {
        fiv__half_space(&low, &high, normal, face, size);
        rows[face] = fiv__bits(0, size) & (low < high ? ~fiv__bits(low, high) : ~(uint64_t)0);
    }
    for (i = 0; i < mesh->cluster_count; i++) {
        const fiv__cluster *c = &mesh->clusters[i];
        float centre[3], reach = c->radius * 1.4143f;
        int k;
        for (k = 0; k < 3; k++) centre[k] = c->centre[k] + offset[k];
        if (mesh->closed && fiv__cluster_faces_eye(c, centre)) continue;
        if (normal && fiv__dot(centre, normal) < -c->radius) continue;
        for (face = 0; face < 6; face++) {
            fiv__axes ax = fiv__face_axes(face);
            float w = centre[ax.w] * ax.sign, u = fabsf(centre[ax.u]), v = fabsf(centre[ax.v]), side = u > v ? u : v;
            if (w - side < -reach) continue;                       /* beside the face's pyramid, or behind it */
            if (4 * w - side > 4.1232f * c->radius && w > c->radius)
                fiv__raster_cluster(&r, c, face); /* within four faces */
            else fiv__raster_cluster_cones(&r, c, face);
        }
    }
}

/* 1 when a ray from the origin along d meets the mesh; clusters of a closed one through which it could only enter are
   left out. Seen along the ray a triangle is flat, and the sign of each of its edges is the same number for both of its
   triangles, so that no ray slips through between them. */
static int fiv__ray_meets_cluster(const fiv__mesh *mesh, const fiv__cluster *c, const float offset[3], float axes[3][3])
{
    float x[3][FIV__CLUSTER_VERTICES + 4];
    int i, k, t;
    const float *m[3];
    for (k = 0; k < 3; k++) m[k] = mesh->x[k] + c->vertex;
    for (i = 0; i < c->vertices; i += 4) {
        sat__f32x4 p[3];
        for (k = 0; k < 3; k++) p[k] = sat__f32x4_add(sat__f32x4_load(m[k] + i), sat__f32x4_set1(offset[k]));
        for (k = 0; k < 3; k++) {
            sat__f32x4 v = sat__f32x4_add(sat__f32x4_mul(p[0], sat__f32x4_set1(axes[k][0])),
                                          sat__f32x4_mul(p[1], sat__f32x4_set1(axes[k][1])));
            sat__f32x4_store(x[k] + i, sat__f32x4_add(v, sat__f32x4_mul(p[2], sat__f32x4_set1(axes[k][2]))));
        }
    }
    for (t = 0; t < c->triangles; t++) {
        const unsigned char *v = mesh->corner + 3 * (c->triangle + (size_t)t);
        float e0 = x[0][v[1]] * x[1][v[2]] - x[1][v[1]] * x[0][v[2]];
        float e1 = x[0][v[2]] * x[1][v[0]] - x[1][v[2]] * x[0][v[0]];
        float e2 = x[0][v[0]] * x[1][v[1]] - x[1][v[0]] * x[0][v[1]], sum = e0 + e1 + e2;
        if ((fiv__min3(e0, e1, e2) < 0 && fiv__max3(e0, e1, e2) > 0) || sum == 0) continue;
        if ((e0 * x[2][v[0]] + e1 * x[2][v[1]] + e2 * x[2][v[2]]) / sum > 0) return 1;
    }
    return 0;
}

static inline int fiv__ray_meets(const fiv__mesh *mesh, const float offset[3], const float d[3])
{
    float axes[3][3];
    size_t i;
    int k,
        least = fabsf(d[0]) < fabsf(d[1]) ? (fabsf(d[0]) < fabsf(d[2]) ? 0 : 2) : (fabsf(d[1]) < fabsf(d[2]) ? 1 : 2);
    for (k = 0; k < 3; k++) axes[0][k] = (k == least ? 1.0f : 0.0f) - d[k] * d[least];
    fiv__normalise(axes[0], axes[0]);
    for (k = 0; k < 3; k++) axes[1][k] = d[(k + 1) % 3] * axes[0][(k + 2) % 3] - d[(k + 2) % 3] * axes[0][(k + 1) % 3];
    memcpy(axes[2], d, sizeof axes[2]);
    for (i = 0; i < mesh->cluster_count; i++) {
        const fiv__cluster *c = &mesh->clusters[i];
        float to[3], along, across, up, facing = fiv__dot(c->axis, d);
        if (mesh->closed && c->cosine > 0 && facing <= 0 && facing * facing >= 1.0001f - c->cosine * c->cosine)
            continue;
        for (k = 0; k < 3; k++) to[k] = c->centre[k] + offset[k];
        along = fiv__dot(to, d);
        across = fiv__dot(to, axes[0]);
        up = fiv__dot(to, axes[1]);
        if (along < -c->radius || across * across + up * up > c->radius * c->radius) continue;
        if (fiv__ray_meets_cluster(mesh, c, offset, axes)) return 1;
    }
    return 0;
}

/* ---- spans: a mask as 16-bit words: first texel (6 bits), length - 1 (6), rows to go down (4). 15 rows: the other
   bits are the number of the row, and a span follows. */

enum { FIV__MAX_WORDS = FIV__MAX_ROWS * (FIV__MAX_FACE / 2 + 1) };

static size_t fiv__encode(uint16_t *words, const uint64_t *rows, int row_count)
{
    size_t n = 0;
    int row, last = 0;
    for (row = 0; row < row_count; row++) {
        uint64_t m = rows[row];
        if (m && row - last >= 15) {
            words[n++] = (uint16_t)(0xf000 | row);
            last = row;
        }
        while (m) {
            int begin = fiv__first_bit(m), end;
            uint64_t carry = m + ((uint64_t)1 << begin);
            end = carry ? fiv__first_bit(carry) : 64;
            words[n++] = (uint16_t)(begin | (end - begin - 1) << 6 | (row - last) << 12);
            last = row;
            m = end == 64 ? 0 : m & ~(((uint64_t)1 << end) - 1);
        }
    }
    return n;
}

static inline void fiv__decode(uint64_t *rows, const uint16_t *words, size_t count, int row_count)
{
    size_t i;
    int row = 0;
    memset(rows, 0, (size_t)row_count * sizeof *rows);
    for (i = 0; i < count; i++) {
        int word = words[i], begin = word & 63;
        if (word >> 12 == 15) {
            row = word & 0xfff;
            continue;
        }
        row += word >> 12;
        rows[row] |= fiv__bits(begin, begin + (word >> 6 & 63) + 1);
    }
}

/* The integral over a mask: one difference a span. */
static void fiv__integrate(double sum[FIV__TERMS], const double *sums, const uint16_t *words, size_t count, int size)
{
    double local[FIV__TERMS]; /* the compiler sees that nothing else points to it, and adds in pairs */
    size_t i;
    const double *row = sums;
    ptrdiff_t pitch = (ptrdiff_t)(size + 1) * FIV__TERMS;
    memset(local, 0, sizeof local);
    for (i = 0; i < count; i++) {
        int word = words[i], begin = word & 63;
        if (word >> 12 == 15) {
            row = sums + (word & 0xfff) * pitch;
            continue;
        }
        row += (word >> 12) * pitch;
        fiv__add_span(local, row, begin, begin + (word >> 6 & 63) + 1);
    }
    memcpy(sum, local, sizeof local);
}

#ifndef FIV_NO_MASKS
/* The same for what lies above the horizon of N. */
static void fiv__integrate_above(double sum[FIV__TERMS], const double *sums, const uint16_t *words, size_t count,
                                 int size, const float normal[3])
{
    size_t i;
    int row = 0, known = -1, low = 0, high = 0;
    memset(sum, 0, FIV__TERMS * sizeof *sum);
    for (i = 0; i < count; i++) {
        int word = words[i], begin = word & 63, end = begin + (word >> 6 & 63) + 1;
        if (word >> 12 == 15) {
            row = word & 0xfff;
            continue;
        }
        row += word >> 12;
        if (row != known) fiv__half_space(&low, &high, normal, row, size);
        known = row;
        begin = sat__max_int(begin, low);
        end = sat__min_int(end, high);
        if (begin < end) fiv__add_span(sum, sums + (size_t)row * (size_t)(size + 1) * FIV__TERMS, begin, end);
    }
}
#endif

/* >> samples */

/* ---- the positions of the samples: shells of logarithmic radii, on each a grid of directions */

enum { FIV__MAX_SHELLS = 256 };

typedef struct fiv__grid {
    int theta, phi, rho; /* octahedral: theta == phi == the side of the square */
    int octahedral;
    float first, last, log_first, per_log; /* shell = (log2 r - log_first) per_log */
    float shell[FIV__MAX_SHELLS];          /* radii */
} fiv__grid;

static size_t fiv__grid_samples(const fiv__grid *g) { return (size_t)g->theta * (size_t)g->phi * (size_t)g->rho; }

static inline void fiv__octahedron_direction(float d[3], float a, float b)
{
    sat__octahedral_unfold(d, a, b);
    fiv__normalise(d, d);
}

static void fiv__sample_offset(float offset[3], const fiv__grid *g, size_t sample)
{
    int i = (int)(sample % (size_t)g->theta), j = (int)(sample / (size_t)g->theta % (size_t)g->phi), k;
    float radius = g->shell[sample / ((size_t)g->theta * (size_t)g->phi)];
    if (g->octahedral) {
        fiv__octahedron_direction(offset, 2 * (float)i / (float)(g->theta - 1) - 1,
                                  2 * (float)j / (float)(g->phi - 1) - 1);
    } else {
        double azimuth = 6.283185307179586 * i / g->theta, polar = 3.141592653589793 * j / (g->phi - 1);
        double sine = j == g->phi - 1 ? 0 : sin(polar);
        offset[0] = (float)(sine * cos(azimuth));
        offset[1] = (float)cos(polar);
        offset[2] = (float)(sine * sin(azimuth));
    }
    for (k = 0; k < 3; k++) offset[k] *= radius;
}

/* The first sample at the same position: poles and the folded border of the square are stored more than once. */
static size_t fiv__first_twin(const fiv__grid *g, size_t sample)
{
    int n = g->theta, i = (int)(sample % (size_t)n), j = (int)(sample / (size_t)n % (size_t)g->phi);
    size_t shell = sample - (size_t)(j * n + i);
    if (!g->octahedral) return j == 0 || j == g->phi - 1 ? sample - (size_t)i : sample;
    if ((i == 0 || i == n - 1) && (j == 0 || j == n - 1)) return shell;
    if (i == 0 || i == n - 1) j = sat__min_int(j, n - 1 - j);
    else if (j == 0 || j == n - 1) i = sat__min_int(i, n - 1 - i);
    return shell + (size_t)(j * n + i);
}

/* Arc tangent to 1e-5 (Abramowitz and Stegun 4.4.49): enough to place a point in a cell. */
static inline float fiv__atan2(float y, float x)
{
    float ax = fabsf(x), ay = fabsf(y), big = ax > ay ? ax : ay, less = ax > ay ? ay : ax;
    float t = big > 0 ? less / big : 0, s = t * t;
    float a = t * (0.9998660f + s * (-0.3302995f + s * (0.1801410f + s * (-0.0851330f + s * 0.0208351f))));
    if (ay > ax) a = 1.57079633f - a;
    if (x < 0) a = 3.14159265f - a;
    return y < 0 ? -a : a;
}

/* The eight samples around an offset (in radii, the occluder's frame) and their weights. */
typedef struct fiv__cell {
    size_t index[8];
    float weight[8];
    float radius;     /* |offset|, but at least that of the first shell */
    int shell;        /* of index[0..3]; index[4..7] lie on the next */
} fiv__cell;

static void fiv__locate(fiv__cell *cell, const fiv__grid *g, const float c[3])
{
    float r = sqrtf(fiv__dot(c, c)), a, b, f;
    int i, j, k, q, right, n = g->theta;
    size_t base;
    if (!(r > g->first)) r = g->first;
    cell->radius = r;
    f = (sat__log2(r) - g->log_first) * g->per_log;
    f = f < 0 ? 0 : f > (float)(g->rho - 1) ? (float)(g->rho - 1) : f;
    if (g->octahedral) {
        sat__octahedral_fold(&a, &b, c);
        a = (a + 1) * 0.5f * (float)(n - 1);
        b = (b + 1) * 0.5f * (float)(n - 1);
    } else {
        a = fiv__atan2(c[2], c[0]) * (0.159154943f * (float)n);
        b = fiv__atan2(sqrtf(c[0] * c[0] + c[2] * c[2]), c[1]) * (0.318309886f * (float)(g->phi - 1));
        if (a < 0) a += (float)n;
    }
    i = sat__clamp_int((int)a, 0, g->octahedral ? n - 2 : n - 1);
    j = sat__clamp_int((int)b, 0, g->phi - 2);
    k = sat__min_int((int)f, g->rho - 2);
    a -= (float)i;
    b -= (float)j;
    f -= (float)k;
    a = a > 1 ? 1 : a;
    b = b > 1 ? 1 : b;
    right = i + 1 == n ? -i : 1;
    base = ((size_t)k * (size_t)g->phi + (size_t)j) * (size_t)n + (size_t)i;
    for (q = 0; q < 8; q++) {
        cell->index[q] = base + (q & 4 ? (size_t)n * (size_t)g->phi : 0) + (q & 2 ? (size_t)n : 0);
        if (q & 1) cell->index[q] = (size_t)((ptrdiff_t)cell->index[q] + right);
        cell->weight[q] = (q & 1 ? a : 1 - a) * (q & 2 ? b : 1 - b) * (q & 4 ? f : 1 - f);
    }
    cell->shell = k;
}

/* >> occluders */

/* ---- occluders */

enum {
    FIV__SUPPORT = 33,  /* side of the octahedral table of the support function */
    FIV__BATCH = 256,   /* masks between two calls of the progress function */
    FIV__VIEWS = 8,     /* fixed directions along an edge of the cube */
    FIV__ALL_VIEWS = 6 * FIV__VIEWS * FIV__VIEWS,
    FIV__FEW = 32       /* triangles that rays along all views take less time to meet than depth maps to say so */
};
enum { FIV__VALID, FIV__INSIDE, FIV__STALE, FIV__WANTED };

struct fiv_occluder {
    sat_allocator allocator;
    sat_threads threads;
    void *block, *mesh_block, *words_block;
    size_t block_size, mesh_size, words_size;
    int share;             /* masks belong to another occluder */
    fiv__grid grid;
    int face, keep_masks, lazy, half_floats;
    float centre[3], radius;
    fiv_occluder_stats stats;
    const fiv_environment *environment; /* that lit it; NULL: none yet */
    unsigned stamp, lit;   /* times that it was lit */
    uint64_t signature, view_signature; /* differ where what OpenGL holds of it, of its views, differs */
    int light_count;
    float rotation[9], table_scale;     /* stored vector = table_scale rho^2 vector */
    fiv__mesh mesh;
    float *table;          /* FIV__TERMS a sample: rho^2 times vector and solid angle, the latter < 0 where not valid */
    uint16_t *half_table;  /* the same as half floats */
    int map_side, cell_side, cells;              /* of the depth maps; of the cell of one; cells along the side */
    uint16_t *map;                               /* map_side^2 */
    float light_axes[FIV_MAX_LIGHTS][3][3];      /* right, up, towards the light, in the occluder's frame */
    int few;               /* triangles: rays along the views in place of depth maps */
    int contact_side;      /* of the depth map of a view; 0: none */
    uint8_t *contact;      /* of all views: FIV__VIEWS beside each other, 6 FIV__VIEWS below each other */
    float view_tangent[FIV__VIEWS], view_scale[FIV__VIEWS]; /* of a column or row of views; texels a radius */
    float *contact_light;  /* FIV__TERMS arrays of FIV__ALL_VIEWS: the integral over the light around each */
    double *sums;          /* integrals of the environment in the occluder's frame */
    unsigned char *state;  /* FIV__VALID ... a sample */
    float *support;        /* largest extent along a direction, in radii */
    uint32_t *first;       /* sample + 1: where its words begin and end */
    uint16_t *words;
};

/* Ten half floats. One stands before the first sample, so that fiv__upper_halves may start there. */
static inline uint16_t *fiv__half_sample(const fiv_occluder *o, size_t sample)
{
    return o->half_table + 1 + FIV__TERMS * sample;
}

static void fiv__set_grid(fiv_occluder *o, const fiv_occluder_options *options)
{
    fiv__grid *g = &o->grid;
    int k;
    g->octahedral = options->storage == FIV_STORAGE_HALF_OCTAHEDRAL;
    g->theta = g->octahedral ? options->theta / 2 + 1 : options->theta;
    g->phi = g->octahedral ? g->theta : options->phi;
    g->rho = options->rho;
    g->first = options->first_shell;
    g->last = options->last_shell;
    g->log_first = (float)(log((double)g->first) / log(2.0));
    g->per_log = (float)((g->rho - 1) * log(2.0) / log((double)g->last / (double)g->first));
    for (k = 0; k < g->rho; k++)
        g->shell[k] = (float)((double)g->first * pow((double)g->last / (double)g->first, (double)k / (g->rho - 1)));
    o->half_floats = g->octahedral;
    o->face = options->resolution;
    o->keep_masks = options->keep_masks != 0;
    o->lazy = options->lazy != 0;
    o->map_side = options->sun_map;
    o->contact_side = options->contact_map >= 0 ? options->contact_map : o->lazy ? 0 : options->theta < 64 ? 64 : 128;
    for (k = 0; k < FIV__VIEWS; k++) {
        float t = o->view_tangent[k] = fiv__texel_coordinate(k, FIV__VIEWS);
        o->view_scale[k] = 0.5f * (float)(o->contact_side - 2) / sqrtf(1 + t * t);
    }
}

static size_t fiv__contact_bytes(const fiv_occluder *o)
{
    return o->few ? 0 : (size_t)FIV__ALL_VIEWS * (size_t)o->contact_side * (size_t)o->contact_side;
}

/* Arrays of its own; those of a share's masks are set by the caller. */
static void fiv__occluder_layout(fiv_occluder *o, sat__arena *arena)
{
    size_t n = fiv__grid_samples(&o->grid), face = (size_t)o->face;
    o->sums = (double *)sat__carve(arena, 6 * face * (face + 1) * FIV__TERMS, sizeof(double));
    o->table = (float *)sat__carve(arena, o->half_floats ? 0 : n, FIV__TERMS * sizeof(float));
    o->half_table = (uint16_t *)sat__carve(arena, o->half_floats ? FIV__TERMS * n + 8 : 0, sizeof(uint16_t));
#ifndef FIV_NO_DELTA
    o->map = (uint16_t *)sat__carve(arena, (size_t)o->map_side * (size_t)o->map_side, sizeof(uint16_t));
#endif
    o->contact_light = (float *)sat__carve(arena, o->contact_side ? FIV__ALL_VIEWS : 0, FIV__TERMS * sizeof(float));
    if (o->share) return;
    o->contact = (uint8_t *)sat__carve(arena, fiv__contact_bytes(o), 1);
    o->state = (unsigned char *)sat__carve(arena, n, 1);
    o->support = (float *)sat__carve(arena, FIV__SUPPORT * FIV__SUPPORT, sizeof(float));
    o->first = (uint32_t *)sat__carve(arena, o->keep_masks ? n + 1 : 0, sizeof(uint32_t));
}

/* The occluder in one block, from a struct whose options are set. */
static sat_result fiv__allocate_occluder(fiv_occluder **out, const fiv_occluder *from)
{
    fiv_occluder o = *from, *made;
    sat__arena arena;
    sat_result result;
    memset(&arena, 0, sizeof arena);
    sat__carve(&arena, 1, sizeof o);
    fiv__occluder_layout(&o, &arena);
    if (fiv__grid_samples(&o.grid) > 0x7fffffff) return SAT_ERR_SIZE;
    result = sat__arena_allocate(&arena, &o.block, &o.block_size, &o.allocator);
    if (result != SAT_OK) return result;
    made = (fiv_occluder *)sat__carve(&arena, 1, sizeof o);
    fiv__occluder_layout(&o, &arena);
    o.stats.samples = fiv__grid_samples(&o.grid);
    o.stats.table_bytes = o.stats.samples * FIV__TERMS * (o.half_floats ? 2u : 4u);
    o.stats.map_bytes = o.share ? 0 : fiv__contact_bytes(&o);
#ifndef FIV_NO_DELTA
    o.stats.map_bytes += (size_t)o.map_side * (size_t)o.map_side * sizeof(uint16_t);
#endif
    *made = o;
    *out = made;
    return SAT_OK;
}

FIV_DEF void fiv_occluder_destroy(fiv_occluder *o)
{
    fiv_occluder copy;
    if (!o) return;
    copy = *o;
    sat__release(&copy.allocator, copy.mesh_block, copy.mesh_size);
    if (!copy.share) sat__release(&copy.allocator, copy.words_block, copy.words_size);
    sat__release(&copy.allocator, copy.block, copy.block_size);
}

FIV_DEF fiv_occluder_stats fiv_occluder_get_stats(const fiv_occluder *o)
{
    fiv_occluder_stats none;
    memset(&none, 0, sizeof none);
    return o ? o->stats : none;
}

static void fiv__count_bytes(fiv_occluder *o)
{
    size_t n = o->stats.samples, counts = o->keep_masks && !o->share ? (n + 1) * sizeof(uint32_t) : 0;
    o->stats.mask_bytes = (o->share ? 0 : o->words_size) + counts;
    o->stats.mesh_bytes = o->mesh_size;
    o->stats.bytes = o->block_size + o->mesh_size + (o->share ? 0 : o->words_size);
}

/* ---- support function: how far the mesh reaches along a direction, so that "cut by the horizon" means the mesh and
   not its ball. What rests on a floor is then whole. */

static void fiv__support_row(fiv_occluder *o, int j)
{
    int i;
    size_t v;
    for (i = 0; i < FIV__SUPPORT; i++) {
        float d[3], best = o->mesh.vertex_count ? -2.0f : 0.0f;
        fiv__octahedron_direction(d, 2 * (float)i / (FIV__SUPPORT - 1) - 1, 2 * (float)j / (FIV__SUPPORT - 1) - 1);
        for (v = 0; v < o->mesh.vertex_count; v++) {
            float reach = o->mesh.x[0][v] * d[0] + o->mesh.x[1][v] * d[1] + o->mesh.x[2][v] * d[2];
            best = reach > best ? reach : best;
        }
        o->support[j * FIV__SUPPORT + i] = best;
    }
}

static void fiv__support_rows(int begin, int end, int worker, void *context)
{
    (void)worker;
    for (; begin < end; begin++) fiv__support_row((fiv_occluder *)context, begin);
}

static float fiv__reach(const fiv_occluder *o, const float d[3])
{
    float u, v;
    int x, y;
    const float *p;
    sat__octahedral_fold(&u, &v, d);
    u = (u + 1) * 0.5f * (FIV__SUPPORT - 1);
    v = (v + 1) * 0.5f * (FIV__SUPPORT - 1);
    x = sat__clamp_int((int)u, 0, FIV__SUPPORT - 2);
    y = sat__clamp_int((int)v, 0, FIV__SUPPORT - 2);
    u -= (float)x;
    v -= (float)y;
    p = o->support + y * FIV__SUPPORT + x;
    return (p[0] * (1 - u) + p[1] * u) * (1 - v) + (p[FIV__SUPPORT] * (1 - u) + p[FIV__SUPPORT + 1] * u) * v;
}

/* ---- depth maps: the mesh seen along a direction (parallel rays), how far it reaches against it. A texel is 0 where
   there is nothing, else 1 + 65534 (z + 1) / 2, in bytes 1 + 254 (z + 1) / 2. */

typedef struct fiv__canvas {
    uint16_t *words; /* or */
    uint8_t *bytes;
    int pitch, side;
} fiv__canvas;

static inline float fiv__area(const float x[3], const float y[3])
{
    return (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
}

static inline void fiv__draw_texel(const fiv__canvas *c, int texel, float depth)
{
    if (c->words) {
        uint16_t word = (uint16_t)(1.5f + (depth + 1) * 32767);
        if (word > c->words[texel]) c->words[texel] = word;
    } else {
        uint8_t byte = (uint8_t)(1.5f + (depth + 1) * 127);
        if (byte > c->bytes[texel]) c->bytes[texel] = byte;
    }
}

/* One triangle, its corners in texels: the larger of what stands and its depth at each texel's centre. */
static void fiv__draw_depth(const fiv__canvas *canvas, const float x[3], const float y[3], const float z[3])
{
    float area = fiv__area(x, y), zx, zy, top = fiv__max3(z[0], z[1], z[2]);
    int row, x0, x1, y0 = sat__max_int(fiv__ceil(fiv__min3(y[0], y[1], y[2])), 0);
    int y1 = sat__min_int(fiv__floor(fiv__max3(y[0], y[1], y[2])), canvas->side - 1);
    if (y0 > y1 || area == 0) return;
    zx = ((z[1] - z[0]) * (y[2] - y[0]) - (z[2] - z[0]) * (y[1] - y[0])) / area;
    zy = ((z[2] - z[0]) * (x[1] - x[0]) - (z[1] - z[0]) * (x[2] - x[0])) / area;
    top = top > 1 ? 1 : top;
    for (row = y0; row <= y1; row++) {
        float low = 1e30f, high = -1e30f, at = (float)row;
        int i;
        for (i = 0; i < 3; i++) {
            int j = i == 2 ? 0 : i + 1, a = y[i] < y[j] ? i : j, b = i + j - a;
            float cross;
            if (y[a] > at || y[b] < at) continue;
            cross = y[b] > y[a] ? x[a] + (at - y[a]) * (x[b] - x[a]) / (y[b] - y[a]) : x[a];
            low = cross < low ? cross : low;
            high = cross > high ? cross : high;
            if (y[a] != y[b]) continue;
            low = x[b] < low ? x[b] : low;
            high = x[b] > high ? x[b] : high;
        }
        if (!(low <= high)) continue;
        x0 = sat__max_int(fiv__ceil(low), 0);
        x1 = sat__min_int(fiv__floor(high), canvas->side - 1);
        for (; x0 <= x1; x0++) {
            float depth = z[0] + ((float)x0 - x[0]) * zx + (at - y[0]) * zy;
            depth = depth > top ? top : depth < -1 ? -1 : depth; /* on an edge: no farther than a corner */
            fiv__draw_texel(canvas, row * canvas->pitch + x0, depth);
        }
    }
}

/* The whole mesh. to: right, up and towards the light, in texels and radii; of a closed mesh only what faces
   `direction` is drawn. */
static void fiv__draw_mesh(const fiv__canvas *canvas, const fiv__mesh *mesh, float to[3][3], float shift,
                           const float direction[3])
{
    size_t i;
    for (i = 0; i < mesh->cluster_count; i++) {
        const fiv__cluster *c = &mesh->clusters[i];
        float p[3][FIV__CLUSTER_VERTICES + 4], facing = -fiv__dot(c->axis, direction);
        int v, k, t;
        if (mesh->closed && c->cosine > 0 && facing > 0 && facing * facing >= 1.0001f - c->cosine * c->cosine)
            continue;
        for (v = 0; v < c->vertices; v++) {
            float q[3];
            for (k = 0; k < 3; k++) q[k] = mesh->x[k][c->vertex + (size_t)v];
            p[0][v] = fiv__dot(q, to[0]) + shift;
            p[1][v] = fiv__dot(q, to[1]) + shift;
            p[2][v] = fiv__dot(q, to[2]);
        }
        for (t = 0; t < c->triangles; t++) {
            const unsigned char *corner = mesh->corner + 3 * (c->triangle + (size_t)t);
            float x[3], y[3], z[3];
            for (k = 0; k < 3; k++) {
                x[k] = p[0][corner[k]];
                y[k] = p[1][corner[k]];
                z[k] = p[2][corner[k]];
            }
            if (mesh->closed && !(fiv__area(x, y) * mesh->turn > 0)) continue;
            fiv__draw_depth(canvas, x, y, z);
        }
    }
}

/* FNV-1a over 64-bit words and the bytes that remain. */
static uint64_t fiv__hash(uint64_t h, const void *from, size_t size)
{
    const unsigned char *p = (const unsigned char *)from;
    uint64_t word;
    size_t i;
    for (i = 0; i + 8 <= size; i += 8) {
        memcpy(&word, p + i, 8);
        h = (h ^ word) * UINT64_C(0x100000001b3);
        h ^= h >> 29;
    }
    for (; i < size; i++) h = (h ^ p[i]) * UINT64_C(0x100000001b3);
    return h;
}

#define FIV__HASH UINT64_C(0xcbf29ce484222325)

/* ---- views: depth maps along the middle of each of FIV__VIEWS^2 squares of the faces of a cube that is fixed to the
   occluder, so that neither light nor rotation enters. Rays are parallel to the direction, but the picture to the face:
   where a point is seen then depends on the view's column alone, or its row alone, and its depth on the face alone.
   The cube lies askew, since meshes are often made along their axes: else all views of a row would be covered at
   once. */

/* view = frame * occluder: 0.7 about (0.36, 0.48, 0.8) */
static const float fiv__view_frame[9] = {0.79531864f,   -0.47473888f, 0.37694994f, 0.55600942f, 0.819022547f,
                                         -0.141617767f, -0.24149904f, 0.322218967f, 0.915343187f};

static void fiv__draw_views(int begin, int end, int worker, void *context)
{
    fiv_occluder *o = (fiv_occluder *)context;
    (void)worker;
    for (; begin < end; begin++) {
        int column = begin % FIV__VIEWS, row = begin / FIV__VIEWS, face = row / FIV__VIEWS, k;
        float u = o->view_tangent[column], v = o->view_tangent[row % FIV__VIEWS];
        float to[3][3], direction[3];
        fiv__axes ax = fiv__face_axes(face);
        fiv__canvas canvas;
        canvas.words = NULL;
        canvas.side = o->contact_side;
        canvas.pitch = FIV__VIEWS * canvas.side;
        canvas.bytes = o->contact + (size_t)(row * canvas.side) * (size_t)canvas.pitch + column * canvas.side;
        for (k = 0; k < canvas.side; k++) memset(canvas.bytes + k * canvas.pitch, 0, (size_t)canvas.side);
        memset(to, 0, sizeof to);
        to[0][ax.u] = o->view_scale[column];
        to[0][ax.w] = -ax.sign * u * to[0][ax.u];
        to[1][ax.v] = o->view_scale[row % FIV__VIEWS];
        to[1][ax.w] = -ax.sign * v * to[1][ax.v];
        to[2][ax.w] = ax.sign;
        fiv__cube_direction(direction, face, u, v);
        fiv__normalise(direction, direction);
        fiv__turn_back(direction, fiv__view_frame, direction);
        for (k = 0; k < 3; k++) fiv__turn_back(to[k], fiv__view_frame, to[k]);
        fiv__draw_mesh(&canvas, &o->mesh, to, 0.5f * (float)canvas.side - 0.5f, direction);
    }
}

/* Of an occluder of few triangles their corners, in the frame of the views; returns how many triangles. */
static int fiv__few_corners(float corners[FIV__FEW][3][3], const fiv_occluder *o)
{
    const fiv__mesh *m = &o->mesh;
    size_t i;
    int t, j, k, count = 0;
    for (i = 0; i < m->cluster_count; i++)
        for (t = 0; t < m->clusters[i].triangles; t++, count++)
            for (j = 0; j < 3; j++) {
                const fiv__cluster *c = &m->clusters[i];
                size_t v = c->vertex + m->corner[3 * (c->triangle + (size_t)t) + (size_t)j];
                float p[3];
                for (k = 0; k < 3; k++) p[k] = m->x[k][v];
                fiv__turn(corners[count][j], fiv__view_frame, p);
            }
    return count;
}

static void fiv__draw_contact(fiv_occluder *o)
{
    float corners[FIV__FEW][3][3];
    if (!o->contact_side) return;
    if (o->few) {
        size_t n = (size_t)fiv__few_corners(corners, o);
        o->view_signature = fiv__hash(FIV__HASH, corners, n * sizeof corners[0]);
        return;
    }
    sat__parallel_for(&o->threads, FIV__ALL_VIEWS, fiv__draw_views, o);
    o->view_signature = fiv__hash(FIV__HASH, o->contact, fiv__contact_bytes(o));
}

/* ---- precompute */

/* A receiver sees nothing but the mesh: of a closed one in every direction, of an open one in four of five. */
static unsigned char fiv__judge_mask(const uint64_t *rows, int size, int closed)
{
    int row, count = 0, inside;
    for (row = 0; row < 6 * size; row++) count += fiv__count_bits(rows[row]);
    inside = closed ? count == 6 * size * size : count > 6 * size * size * 4 / 5;
    return (unsigned char)(inside ? FIV__INSIDE : FIV__VALID);
}

#ifndef FIV_NO_MASKS

typedef struct fiv__batch {
    fiv_occluder *occluder;
    size_t first;
    uint64_t *rows;
} fiv__batch;

static void fiv__make_masks(int begin, int end, int worker, void *context)
{
    const fiv__batch *b = (const fiv__batch *)context;
    fiv_occluder *o = b->occluder;
    (void)worker;
    for (; begin < end; begin++) {
        size_t sample = b->first + (size_t)begin;
        uint64_t *rows = b->rows + (size_t)begin * (size_t)(6 * o->face);
        float offset[3];
        if (fiv__first_twin(&o->grid, sample) != sample) continue;
        fiv__sample_offset(offset, &o->grid, sample);
        fiv__raster_mesh(rows, &o->mesh, offset, o->face, NULL);
        o->state[sample] = fiv__judge_mask(rows, o->face, o->mesh.closed);
    }
}

/* Room for `wanted` more words: doubles, so that a mask is copied a few times at most. */
static sat_result fiv__grow(fiv_occluder *o, size_t used, size_t wanted)
{
    size_t bytes = (used + wanted) * sizeof(uint16_t);
    void *block;
    if (used + wanted > 0x7fffffffu) return SAT_ERR_SIZE;
    if (bytes <= o->words_size) return SAT_OK;
    bytes = bytes > 2 * o->words_size ? bytes : 2 * o->words_size;
    block = sat__alloc(&o->allocator, bytes);
    if (!block) return SAT_ERR_MEMORY;
    if (used) memcpy(block, o->words_block, used * sizeof(uint16_t));
    sat__release(&o->allocator, o->words_block, o->words_size);
    o->words_block = block;
    o->words_size = bytes;
    o->words = (uint16_t *)block;
    return SAT_OK;
}

/* Appends the masks of a batch, in order. */
static sat_result fiv__store_masks(const fiv__batch *b, size_t count)
{
    fiv_occluder *o = b->occluder;
    size_t i;
    for (i = 0; i < count; i++) {
        size_t sample = b->first + i, twin = fiv__first_twin(&o->grid, sample), used = o->first[sample], n;
        sat_result result = fiv__grow(o, used, FIV__MAX_WORDS);
        if (result) return result;
        if (twin == sample) {
            n = fiv__encode(o->words + used, b->rows + i * (size_t)(6 * o->face), 6 * o->face);
            o->stats.rasterised++;
        } else {
            n = o->first[twin + 1] - o->first[twin];
            memcpy(o->words + used, o->words + o->first[twin], n * sizeof(uint16_t));
            o->state[sample] = o->state[twin];
        }
        o->stats.inside += o->state[sample] == FIV__INSIDE;
        o->first[sample + 1] = (uint32_t)(used + n);
    }
    return SAT_OK;
}

static sat_result fiv__precompute(fiv_occluder *o, const fiv_occluder_options *options)
{
    fiv__batch b;
    size_t n = o->stats.samples, size = FIV__BATCH * (size_t)(6 * o->face) * sizeof *b.rows, used;
    sat_result result = SAT_OK;
    void *trimmed;
    b.occluder = o;
    b.rows = (uint64_t *)sat__alloc(&o->allocator, size);
    if (!b.rows) return SAT_ERR_MEMORY;
    o->first[0] = 0;
    for (b.first = 0; b.first < n && !result; b.first += FIV__BATCH) {
        size_t left = n - b.first, count = left < FIV__BATCH ? left : (size_t)FIV__BATCH;
        if (options->progress && options->progress((float)((double)b.first / (double)n), options->progress_user)) {
            result = SAT_ERR_CANCELLED;
            break;
        }
        sat__parallel_for(&o->threads, (int)count, fiv__make_masks, &b);
        result = fiv__store_masks(&b, count);
    }
    sat__release(&o->allocator, b.rows, size);
    if (result) return result;
    used = o->first[n] * sizeof(uint16_t);
    trimmed = sat__alloc(&o->allocator, used);
    if (!trimmed) return SAT_ERR_MEMORY;
    memcpy(trimmed, o->words_block, used);
    sat__release(&o->allocator, o->words_block, o->words_size);
    o->words_block = trimmed;
    o->words = (uint16_t *)trimmed;
    o->words_size = used ? used : 1;
    o->stats.spans = o->first[n];
    if (options->progress) options->progress(1, options->progress_user);
    return SAT_OK;
}

#endif /* FIV_NO_MASKS */

static sat_result fiv__read_mesh(fiv_occluder *o, const float *positions, const unsigned *indices,
                                 size_t triangle_count)
{
    fiv__mesh *mesh = &o->mesh;
    sat__arena arena;
    sat_result result;
    uint64_t *scratch, *order;
    size_t size, usable = 0, k;
    for (k = 0; k < triangle_count; k++) usable += (size_t)fiv__triangle_is_usable(positions, indices + 3 * k);
    mesh->triangle_count = usable;
    mesh->cluster_count = (usable + FIV__CLUSTER - 1) / FIV__CLUSTER;
    memset(&arena, 0, sizeof arena);
    fiv__mesh_layout(mesh, &arena);
    if (!sat__multiply_size(&size, triangle_count, 8 * sizeof *scratch)) return SAT_ERR_SIZE;
    result = sat__arena_allocate(&arena, &o->mesh_block, &o->mesh_size, &o->allocator);
    if (result != SAT_OK) return result;
    scratch = (uint64_t *)sat__alloc(&o->allocator, size);
    if (!scratch) return SAT_ERR_MEMORY;
    fiv__mesh_layout(mesh, &arena);
    order = fiv__order_triangles(scratch, scratch + triangle_count, &usable, positions, indices, triangle_count);
    mesh->closed = fiv__is_closed(order, usable, indices, scratch + 2 * triangle_count, scratch + 5 * triangle_count);
    fiv__make_clusters(mesh, order, indices);
    sat__release(&o->allocator, scratch, size);
    o->stats.skipped_triangles = triangle_count - usable;
    return SAT_OK;
}

/* Ball, clusters and support function for these positions. */
static sat_result fiv__take_positions(fiv_occluder *o, const float *positions)
{
    int k;
    if (!fiv__place_mesh(&o->mesh, o->centre, &o->radius, positions)) return SAT_ERR_ARGUMENT;
    sat__parallel_for(&o->threads, FIV__SUPPORT, fiv__support_rows, o);
    o->stats.triangles = o->mesh.triangle_count;
    o->stats.closed = o->mesh.closed;
    o->stats.radius = o->radius;
    for (k = 0; k < 3; k++) o->stats.centre[k] = o->centre[k];
    return SAT_OK;
}

FIV_DEF sat_result fiv_occluder_create(fiv_occluder **out, const float *positions, size_t vertex_count,
                                       const unsigned *indices, size_t triangle_count,
                                       const fiv_occluder_options *options, fiv_occluder_stats *stats)
{
    fiv_occluder_options o = options ? *options : fiv_occluder_defaults();
    fiv_occluder from, *made = NULL;
    sat__text ignored = sat__text_begin(NULL, 0);
    sat_result result;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    if (!fiv__occluder_options_are_valid(&o)) return SAT_ERR_ARGUMENT;
    if (triangle_count && (!positions || !indices)) return SAT_ERR_ARGUMENT;
    if (vertex_count > 0x7fffffff || triangle_count > 0x7fffffff / 3) return SAT_ERR_SIZE;
    if (!fiv__explain_mesh(&ignored, positions, vertex_count, indices, triangle_count)) return SAT_ERR_ARGUMENT;
    memset(&from, 0, sizeof from);
    if (!sat__resolve_allocator(&from.allocator, &o.allocator)) return SAT_ERR_ARGUMENT;
    from.threads = o.threads;
    fiv__set_grid(&from, &o);
    from.few = triangle_count <= FIV__FEW;
    result = fiv__allocate_occluder(&made, &from);
    if (result) return result;
    made->mesh.source_count = vertex_count;
    result = fiv__read_mesh(made, positions, indices, triangle_count);
    if (!result) result = fiv__take_positions(made, positions);
    memset(made->state, FIV__STALE, made->stats.samples);
#ifndef FIV_NO_MASKS
    if (!result && made->keep_masks) result = fiv__precompute(made, &o);
#endif
    if (result) {
        fiv_occluder_destroy(made);
        return result;
    }
    fiv__draw_contact(made);
    fiv__count_bytes(made);
    if (stats) *stats = made->stats;
    *out = made;
    return SAT_OK;
}

FIV_DEF sat_result fiv_occluder_share(fiv_occluder **out, const fiv_occluder *masks_of)
{
    fiv_occluder from;
    sat_result result;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!masks_of || !masks_of->keep_masks) return SAT_ERR_ARGUMENT;
    from = *masks_of;
    from.share = 1;
    from.mesh_block = NULL; /* the triangles stay the other's */
    from.mesh_size = 0;
    from.environment = NULL;
    result = fiv__allocate_occluder(out, &from);
    if (!result) fiv__count_bytes(*out);
    return result;
}

/* >> lighting */

/* ---- split-off lights: a depth map each, seen along the light. All of them share a square of map_side^2 texels:
   cells of a grid, the middle of each the bounding ball, two texels at its border empty. */

#ifndef FIV_NO_DELTA

enum { FIV__MAP_BORDER = 2 };

/* Right, up and towards the light, right-handed. */
static void fiv__light_frame(float axes[3][3], const float direction[3])
{
    int k, least = 0;
    for (k = 1; k < 3; k++)
        if (fabsf(direction[k]) < fabsf(direction[least])) least = k;
    for (k = 0; k < 3; k++) axes[0][k] = (k == least ? 1.0f : 0.0f) - direction[k] * direction[least];
    fiv__normalise(axes[0], axes[0]);
    for (k = 0; k < 3; k++)
        axes[1][k] = direction[(k + 1) % 3] * axes[0][(k + 2) % 3] - direction[(k + 2) % 3] * axes[0][(k + 1) % 3];
    memcpy(axes[2], direction, sizeof axes[2]);
}

static inline float fiv__map_scale(const fiv_occluder *o) { return 0.5f * (float)(o->cell_side - 2 * FIV__MAP_BORDER); }

static inline size_t fiv__map_cell(const fiv_occluder *o, int light)
{
    return (size_t)(light / o->cells * o->cell_side) * (size_t)o->map_side + (size_t)(light % o->cells * o->cell_side);
}

static void fiv__draw_maps(int begin, int end, int worker, void *context)
{
    fiv_occluder *o = (fiv_occluder *)context;
    float scale = fiv__map_scale(o), to[3][3];
    (void)worker;
    for (; begin < end; begin++) {
        fiv__canvas canvas;
        int k;
        canvas.words = o->map + fiv__map_cell(o, begin);
        canvas.bytes = NULL;
        canvas.pitch = o->map_side;
        canvas.side = o->cell_side;
        for (k = 0; k < canvas.side; k++)
            memset(canvas.words + k * canvas.pitch, 0, (size_t)canvas.side * sizeof *canvas.words);
        memcpy(to, o->light_axes[begin], sizeof to);
        for (k = 0; k < 6; k++) to[k / 3][k % 3] *= scale;
        fiv__draw_mesh(&canvas, &o->mesh, to, scale + (float)FIV__MAP_BORDER - 0.5f, to[2]);
    }
}

static void fiv__find_lights(fiv_occluder *o)
{
    int i;
    for (o->cells = 1; o->cells * o->cells < o->light_count; o->cells++) {}
    o->cell_side = o->map_side / o->cells;
    for (i = 0; i < o->light_count; i++) {
        float d[3];
        fiv__turn(d, o->environment->rotation, o->environment->lights[i].direction);
        fiv__turn_back(d, o->rotation, d);
        fiv__normalise(d, d);
        fiv__light_frame(o->light_axes[i], d);
    }
}

#endif /* FIV_NO_DELTA */

/* ---- lighting */

static void fiv__store_vector(fiv_occluder *o, size_t sample, const double sum[FIV__TERMS])
{
    double radius = (double)o->grid.shell[sample / ((size_t)o->grid.theta * (size_t)o->grid.phi)];
    double square = radius * radius, scale = square * (double)o->table_scale;
    int k, valid = o->state[sample] == FIV__VALID;
    float v[FIV__TERMS];
    for (k = 0; k < 9; k++) v[k] = (float)(sum[k] * scale);
    v[9] = (float)(valid ? sum[9] * square : -sum[9] * square - 1e-6);
    for (k = 0; k < FIV__TERMS; k++)
        if (o->half_floats)
            fiv__half_sample(o, sample)[k] = sat__half_from_float(v[k] > 65504 ? 65504 : v[k] < -65504 ? -65504 : v[k]);
        else o->table[FIV__TERMS * sample + (size_t)k] = v[k];
}

/* The light around each view: each texel of the cube, in `cut`^2 parts, is the nearest view's. */
static void fiv__light_views(fiv_occluder *o)
{
    int row, x, i, k, n = o->face, cut = (31 + n) / n;
    float *light = o->contact_light;
    if (!o->contact_side) return;
    memset(light, 0, (size_t)FIV__TERMS * FIV__ALL_VIEWS * sizeof *light);
    for (row = 0; row < 6 * n; row++)
        for (x = 0; x < n; x++) {
            float part[FIV__TERMS], d[3];
            double sum[FIV__TERMS];
            memset(sum, 0, sizeof sum);
            fiv__add_span(sum, o->sums + (size_t)row * (size_t)(n + 1) * FIV__TERMS, x, x + 1);
            for (k = 0; k < FIV__TERMS; k++) part[k] = (float)(sum[k] / (cut * cut));
            for (k = 0; k < 9; k += 3) fiv__turn(part + k, fiv__view_frame, part + k);
            for (i = 0; i < cut * cut; i++) {
                fiv__cube_direction(d, row / n, fiv__texel_coordinate(x * cut + i % cut, n * cut),
                                    fiv__texel_coordinate(row % n * cut + i / cut, n * cut));
                fiv__turn(d, fiv__view_frame, d);
                for (k = 0; k < FIV__TERMS; k++)
                    light[(size_t)k * FIV__ALL_VIEWS + fiv__cube_texel(d, FIV__VIEWS)] += part[k];
            }
        }
}

static void fiv__light_sample(fiv_occluder *o, size_t sample, const uint16_t *words, size_t count)
{
    double sum[FIV__TERMS];
    fiv__integrate(sum, o->sums, words, count, o->face);
    fiv__store_vector(o, sample, sum);
}

#ifndef FIV_NO_MASKS
static void fiv__light_stored(int begin, int end, int worker, void *context)
{
    fiv_occluder *o = (fiv_occluder *)context;
    (void)worker;
    for (; begin < end; begin++)
        fiv__light_sample(o, (size_t)begin, o->words + o->first[begin], o->first[begin + 1] - o->first[begin]);
}
#endif

/* Rasterises and lights the samples that are wanted. */
static void fiv__light_wanted(int begin, int end, int worker, void *context)
{
    fiv_occluder *o = (fiv_occluder *)context;
    uint64_t rows[FIV__MAX_ROWS];
    uint16_t words[FIV__MAX_WORDS];
    (void)worker;
    for (; begin < end; begin++) {
        size_t sample = (size_t)begin;
        float offset[3];
        if (o->state[sample] != FIV__WANTED || fiv__first_twin(&o->grid, sample) != sample) continue;
        fiv__sample_offset(offset, &o->grid, sample);
        fiv__raster_mesh(rows, &o->mesh, offset, o->face, NULL);
        o->state[sample] = fiv__judge_mask(rows, o->face, o->mesh.closed);
        fiv__light_sample(o, sample, words, fiv__encode(words, rows, 6 * o->face));
    }
}

static void fiv__copy_sample(fiv_occluder *o, size_t to, size_t from)
{
    if (o->half_floats) memcpy(fiv__half_sample(o, to), fiv__half_sample(o, from), FIV__TERMS * sizeof *o->half_table);
    else memcpy(o->table + FIV__TERMS * to, o->table + FIV__TERMS * from, FIV__TERMS * sizeof *o->table);
    o->state[to] = o->state[from];
}

static void fiv__forget_samples(fiv_occluder *o, int state)
{
    size_t i, n = o->stats.samples;
    double none[FIV__TERMS];
    memset(none, 0, sizeof none);
    memset(o->state, state, n);
    for (i = 0; i < n; i++) fiv__store_vector(o, i, none);
    o->stats.inside = 0;
}

/* Makes all wanted samples; twins are copies. Returns how many masks were made. */
static size_t fiv__make_wanted(fiv_occluder *o)
{
    size_t i, made = 0, n = o->stats.samples;
    for (i = 0; i < n; i++)
        if (o->state[i] == FIV__WANTED) {
            size_t twin = fiv__first_twin(&o->grid, i);
            if (o->state[twin] == FIV__STALE) o->state[twin] = FIV__WANTED;
        }
    for (i = 0; i < n; i++) made += o->state[i] == FIV__WANTED && fiv__first_twin(&o->grid, i) == i;
    sat__parallel_for(&o->threads, (int)n, fiv__light_wanted, o);
    for (i = 0; i < n; i++)
        if (o->state[i] == FIV__WANTED) fiv__copy_sample(o, i, fiv__first_twin(&o->grid, i));
    o->stats.rasterised += made;
    for (i = 0, o->stats.inside = 0; i < n; i++) o->stats.inside += o->state[i] == FIV__INSIDE;
    return made;
}

/* rho^2 times a vector is at most the flux within one radius, and pi times the largest radiance beyond. A factor of
   four is left for texels that turning makes brighter; small values stay clear of subnormal half floats. */
static float fiv__half_scale(const fiv_environment *e)
{
    double bound = 0;
    int c;
    for (c = 0; c < 3; c++) {
        bound = e->flux[c] > bound ? e->flux[c] : bound;
        bound = 4 * (double)e->largest[c] > bound ? 4 * (double)e->largest[c] : bound;
    }
    return bound > 1e-20 ? (float)(16000 / bound) : 1;
}

/* Another occluder may stand at the same address: every 64th sample is looked at, too. */
static void fiv__sign(fiv_occluder *o)
{
    size_t i;
    uint64_t h = fiv__hash(FIV__HASH, &o, sizeof(void *));
    o->lit++;
    h = fiv__hash(h, &o->lit, sizeof o->lit);
    h = fiv__hash(h, o->rotation, sizeof o->rotation);
    h = fiv__hash(h, &o->radius, sizeof o->radius);
    h = fiv__hash(h, o->centre, sizeof o->centre);
    for (i = 0; i < o->stats.samples; i += 64)
        h = o->half_floats ? fiv__hash(h, fiv__half_sample(o, i), FIV__TERMS * sizeof *o->half_table)
                           : fiv__hash(h, o->table + FIV__TERMS * i, FIV__TERMS * sizeof *o->table);
    o->signature = h;
}

FIV_DEF sat_result fiv_occluder_light(fiv_occluder *o, const fiv_environment *e, const float rotation[9])
{
    fiv__gather g;
    if (!o || !e || e->face != o->face) return SAT_ERR_ARGUMENT;
    if (!fiv__set_rotation(o->rotation, rotation)) return SAT_ERR_ARGUMENT;
    o->table_scale = o->half_floats ? fiv__half_scale(e) : 1;
    o->environment = e;
    o->stamp = e->stamp;
    o->light_count = e->light_count;
    g.environment = e;
    g.sums = o->sums;
    g.radiance = NULL;
    fiv__turn_between(g.frame, e->rotation, o->rotation);
    sat__parallel_for(&o->threads, 6 * o->face, fiv__gather_rows, &g);
    fiv__light_views(o);
#ifndef FIV_NO_DELTA
    fiv__find_lights(o);
    sat__parallel_for(&o->threads, o->light_count, fiv__draw_maps, o);
#endif
#ifndef FIV_NO_MASKS
    if (o->keep_masks) sat__parallel_for(&o->threads, (int)o->stats.samples, fiv__light_stored, o);
#endif
    if (!o->keep_masks) {
        o->stats.rasterised = 0;
        fiv__forget_samples(o, o->lazy ? FIV__STALE : FIV__WANTED);
        if (!o->lazy) fiv__make_wanted(o);
    }
    fiv__sign(o);
    return SAT_OK;
}

FIV_DEF sat_result fiv_occluder_invalidate(fiv_occluder *o, const float *positions)
{
    sat_result result = SAT_OK;
    size_t i;
    if (!o || !o->lazy) return SAT_ERR_ARGUMENT;
    for (i = 0; positions && i < o->mesh.vertex_count; i++) {
        const float *p = positions + 3 * (size_t)o->mesh.source[i];
        if (!sat__is_finite(p[0]) || !sat__is_finite(p[1]) || !sat__is_finite(p[2])) return SAT_ERR_ARGUMENT;
    }
    if (positions && o->mesh.vertex_count) {
        result = fiv__take_positions(o, positions);
        fiv__draw_contact(o);
    }
#ifndef FIV_NO_DELTA
    sat__parallel_for(&o->threads, o->light_count, fiv__draw_maps, o);
#endif
    o->stats.rasterised = 0;
    fiv__forget_samples(o, FIV__STALE);
    fiv__sign(o);
    return result;
}

/* >> lookups */

/* Half floats of this table are finite, so that one multiplication does for normal and subnormal numbers. */
static inline float fiv__half(uint16_t half)
{
    float magnitude = sat__float_from_bits((uint32_t)(half & 0x7fffu) << 13) * 5.192296858534828e33f; /* 2^112 */
    return half & 0x8000u ? -magnitude : magnitude;
}

/* The solid angle of a sample; < 0: not valid. */
static inline float fiv__sample_angle(const fiv_occluder *o, size_t sample)
{
    return o->half_floats ? fiv__half(fiv__half_sample(o, sample)[9]) : o->table[FIV__TERMS * sample + 9];
}

/* The upper half of each lane; the lower one is masked out. */
static inline sat__f32x4 fiv__upper_halves(const uint16_t *p)
{
    int32_t lanes[4];
    sat__i32x4 v;
    memcpy(lanes, p, sizeof lanes);
    v = sat__i32x4_load(lanes);
    sat__i32x4 magnitude = sat__i32x4_and(sat__i32x4_shift_right(v, 3), sat__i32x4_set1(0x0fffe000));
    sat__f32x4 value = sat__f32x4_mul(sat__f32x4_from_bits(magnitude), sat__f32x4_set1(5.192296858534828e33f));
    return sat__f32x4_from_bits(
        sat__i32x4_or(sat__f32x4_bits(value), sat__i32x4_and(v, sat__i32x4_set1(-0x7fffffff - 1))));
}

/* out += weight * sample, with the absolute value of the solid angle */
static inline void fiv__add_sample(float out[FIV__TERMS], float weight, const fiv_occluder *o, size_t sample)
{
    sat__f32x4 w = sat__f32x4_set1(weight);
    if (o->half_floats) {
        const uint16_t *h = fiv__half_sample(o, sample);
        float even[4], odd[4];
        int k;
        sat__f32x4_store(even, sat__f32x4_mul(w, fiv__upper_halves(h - 1)));
        sat__f32x4_store(odd, sat__f32x4_mul(w, fiv__upper_halves(h)));
        for (k = 0; k < 4; k++) {
            out[2 * k] += even[k];
            out[2 * k + 1] += odd[k];
        }
        out[8] += weight * fiv__half(h[8]);
        out[9] += weight * fabsf(fiv__half(h[9]));
    } else {
        const float *v = o->table + FIV__TERMS * sample;
        sat__f32x4_store(out, sat__f32x4_add(sat__f32x4_load(out), sat__f32x4_mul(w, sat__f32x4_load(v))));
        sat__f32x4_store(out + 4, sat__f32x4_add(sat__f32x4_load(out + 4), sat__f32x4_mul(w, sat__f32x4_load(v + 4))));
        out[8] += weight * v[8];
        out[9] += weight * fabsf(v[9]);
    }
}

/* Vectors come back from the scale in which they are stored. */
static inline void fiv__unscale(float v[FIV__TERMS], const fiv_occluder *o, float factor)
{
    float scale = factor / o->table_scale;
    int k;
    for (k = 0; k < 9; k++) v[k] *= scale;
    v[9] *= factor;
}

/* Published: the vectors themselves are interpolated, and fall with the square of the distance beyond the last
   shell. */
static void fiv__lookup_published(float out[FIV__TERMS], const fiv_occluder *o, const fiv__cell *cell)
{
    float near_shell = o->grid.shell[cell->shell], far_shell = o->grid.shell[cell->shell + 1];
    int q;
    near_shell = 1 / (near_shell * near_shell);
    far_shell = 1 / (far_shell * far_shell);
    if (cell->radius > o->grid.last) far_shell = 1 / (cell->radius * cell->radius);
    memset(out, 0, FIV__TERMS * sizeof *out);
    for (q = 0; q < 8; q++)
        if (cell->weight[q] > 0)
            fiv__add_sample(out, cell->weight[q] * (q & 4 ? far_shell : near_shell), o, cell->index[q]);
    fiv__unscale(out, o, 1);
}

/* rho^2 times the vector changes slowly with the distance; samples inside the mesh see everything dark and are left
   out. Returns the weight of the valid samples; 0 and no light where there are none. */
static float fiv__lookup_scaled(float out[FIV__TERMS], const fiv_occluder *o, const fiv__cell *cell)
{
    float total = 0;
    int q;
    memset(out, 0, FIV__TERMS * sizeof *out);
    for (q = 0; q < 8; q++) {
        if (fiv__sample_angle(o, cell->index[q]) < 0) continue;
        fiv__add_sample(out, cell->weight[q], o, cell->index[q]);
        total += cell->weight[q];
    }
    if (!(total > 1e-4f)) {
        memset(out, 0, FIV__TERMS * sizeof *out);
        return 0;
    }
    fiv__unscale(out, o, 1 / (total * cell->radius * cell->radius));
    return total;
}

static int fiv__nearest(const fiv__cell *cell)
{
    int q, best = 0;
    for (q = 1; q < 8; q++)
        if (cell->weight[q] > cell->weight[best]) best = q;
    return best;
}

static void fiv__take_nearest(fiv__cell *cell)
{
    int q, best = fiv__nearest(cell);
    for (q = 0; q < 8; q++) cell->weight[q] = q == best ? 1.0f : 0.0f;
}

/* ---- near contact: samples inside the mesh are left out, and those that are left see light that the receiver does
   not. Such a receiver gets a mask of its own. */

#define FIV__CONTACT 2.0f /* sr */
#define FIV__BELOW 1e-4f  /* radii; from so far below a receiver masks and rays see what lies in its plane, such as the
                             lowest triangles of what stands there, above it */

static int fiv__is_contact(const fiv_occluder *o, const fiv__cell *cell, const float offset[3])
{
    float limit = FIV__CONTACT * fiv__dot(offset, offset);
    int q;
    for (q = 0; q < 8; q++)
        if (o->state[cell->index[q]] == FIV__INSIDE || fiv__sample_angle(o, cell->index[q]) > limit) return 1;
    return 0;
}

/* How much a receiver near contact, whose samples see light that it does not, is left to the views: 0..1. */
static float fiv__contact_part(const fiv_occluder *o, const fiv__cell *cell, float angle)
{
    float inside = 0, part;
    int q;
    for (q = 0; q < 8; q++) inside += o->state[cell->index[q]] == FIV__INSIDE ? cell->weight[q] : 0;
    part = 2 * angle - 3 > 8 * inside ? 2 * angle - 3 : 8 * inside;
    return part > 0 ? (part < 1 ? part : 1) : 0;
}

/* >> views */

/* A column, or a row, of the texels around a point, and its part of the way to the next one. The outermost texels are
   empty. */
static inline float fiv__view_texel(int *texel, float at, int side)
{
    at = at > 0 ? (at < (float)(side - 1) ? at : (float)(side - 1)) : 0;
    *texel = sat__min_int((int)at, side - 2);
    return at - (float)*texel;
}

/* From how far above the surface a receiver on it looks: two texels. */
static float fiv__view_lift(const fiv_occluder *o) { return o->few ? 1e-3f : 2 / (float)(o->contact_side - 2); }

/* Of few triangles: which rays along the views meet one, a bit each. All rays through a triangle lie on one side of the
   three planes through the receiver and its edges; of a closed mesh the triangles that are seen from behind do. */
static void fiv__trace_views(uint64_t hit[6], const fiv_occluder *o, const float offset[3], const float normal[3])
{
    float corners[FIV__FEW][3][3], side[3][3], turn, volume;
    int count = fiv__few_corners(corners, o), face, t, j, k, x, y;
    memset(hit, 0, 6 * sizeof *hit);
    for (t = 0; t < count; t++) {
        for (j = 0; j < 3; j++)
            for (k = 0; k < 3; k++) corners[t][j][k] += offset[k] + FIV__BELOW * normal[k];
        for (j = 0; j < 3; j++) fiv__cross(side[j], corners[t][j], corners[t][(j + 1) % 3]);
        volume = fiv__dot(corners[t][2], side[0]);
        turn = volume > 0 ? 1.0f : -1.0f;
        if (volume == 0 || (o->mesh.closed && turn != o->mesh.turn)) continue;
        for (face = 0; face < 6; face++) {
            fiv__axes ax = fiv__face_axes(face);
            for (y = 0; y < FIV__VIEWS; y++) {
                float along[3], v = fiv__texel_coordinate(y, FIV__VIEWS);
                for (j = 0; j < 3; j++) along[j] = turn * (side[j][ax.w] * ax.sign + side[j][ax.v] * v);
                for (x = 0; x < FIV__VIEWS; x++) {
                    float u = turn * o->view_tangent[x];
                    int meets = along[0] + side[0][ax.u] * u >= 0 && along[1] + side[1][ax.u] * u >= 0 &&
                                along[2] + side[2][ax.u] * u >= 0;
                    hit[face] |= (uint64_t)meets << (FIV__VIEWS * y + x);
                }
            }
        }
    }
}

/* Sums over all views, a lane a column. */
typedef struct fiv__around {
    float all[3][FIV__VIEWS], taken[3][FIV__VIEWS], angle[FIV__VIEWS];
} fiv__around;

/* A receiver as the views of a face see it, and one row of them. */
typedef struct fiv__facing {
    int side, column[FIV__VIEWS], beyond; /* texels; bytes above it stand between the receiver and the light */
    float part[FIV__VIEWS], up[FIV__VIEWS];
    const float *normal;
    const uint64_t *hit;   /* in place of depth maps */
    int y;                 /* the row of views: */
    float down, height;
    const uint8_t *row;    /* texels around the receiver's height */
    const float *light;    /* the first view's */
} fiv__facing;

/* 0..1: bilinear between the comparisons at four texels. */
static inline float fiv__view_covered(const uint8_t *p, int pitch, int beyond, float right, float down)
{
    int a = p[0] > beyond, b = p[1] > beyond, c = p[pitch] > beyond, d = p[pitch + 1] > beyond, count = a + b + c + d;
    if (!(count & 3)) return (float)(count >> 2);
    return ((a ? 1 - right : 0) + (b ? right : 0)) * (1 - down) + ((c ? 1 - right : 0) + (d ? right : 0)) * down;
}

/* A channel of the light around a row of views: all of it, and what is covered of it. */
static inline void fiv__add_channel(float all[FIV__VIEWS], float taken[FIV__VIEWS], const float *light,
                                  const float normal[3], const float over[FIV__VIEWS], const float covered[FIV__VIEWS])
{
    int x;
    for (x = 0; x < FIV__VIEWS; x += 4) {
        sat__f32x4 e = sat__f32x4_mul(sat__f32x4_load(light + x), sat__f32x4_set1(normal[0]));
        e = sat__f32x4_add(e, sat__f32x4_mul(sat__f32x4_load(light + x + FIV__ALL_VIEWS), sat__f32x4_set1(normal[1])));
        e = sat__f32x4_add(e, sat__f32x4_mul(sat__f32x4_load(light + x + 2 * FIV__ALL_VIEWS),
                                             sat__f32x4_set1(normal[2])));
        e = sat__f32x4_mul(sat__f32x4_max(e, sat__f32x4_set1(0)), sat__f32x4_load(over + x));
        sat__f32x4_store(all + x, sat__f32x4_add(sat__f32x4_load(all + x), e));
        e = sat__f32x4_mul(e, sat__f32x4_load(covered + x));
        sat__f32x4_store(taken + x, sat__f32x4_add(sat__f32x4_load(taken + x), e));
    }
}

static void fiv__add_views(fiv__around *sum, const fiv__facing *f)
{
    float covered[FIV__VIEWS], over[FIV__VIEWS];
    int x, c;
    for (x = 0; x < FIV__VIEWS; x++) {
        over[x] = f->height + f->up[x] > 0 ? 1.0f : 0.0f;
        if (!(over[x] > 0)) covered[x] = 0;
        else if (f->hit) covered[x] = (float)(*f->hit >> (FIV__VIEWS * f->y + x) & 1);
        else covered[x] = fiv__view_covered(f->row + x * f->side + f->column[x], FIV__VIEWS * f->side, f->beyond,
                                            f->part[x], f->down);
    }
    for (c = 0; c < 3; c++)
        fiv__add_channel(sum->all[c], sum->taken[c], f->light + 3 * c * FIV__ALL_VIEWS, f->normal, over, covered);
    for (x = 0; x < FIV__VIEWS; x++) sum->angle[x] += f->light[9 * FIV__ALL_VIEWS + x] * covered[x];
}

/* What an occluder takes of the light above the horizon, as a part of `diffuse`, and the solid angle that it covers
   there: the light around each view counts as its middle is covered. */
static void fiv__look_around(float taken[3], float *angle, const fiv_occluder *o, const float from[3],
                             const float upwards[3], const float diffuse[3])
{
    float offset[3], normal[3];
    uint64_t hit[6];
    int side = o->contact_side, face, x, c;
    float shift = 0.5f * (float)(side - 1), least = 0.5f / (float)(side - 2), all[3] = {0, 0, 0};
    const float *tangent = o->view_tangent, *scale = o->view_scale;
    fiv__around sum;
    fiv__facing f;
    memset(&sum, 0, sizeof sum);
    fiv__turn(offset, fiv__view_frame, from);
    fiv__turn(normal, fiv__view_frame, upwards);
    if (o->few) fiv__trace_views(hit, o, offset, normal);
    f.side = side;
    f.normal = normal;
    for (face = 0; face < 6; face++) {
        fiv__axes ax = fiv__face_axes(face);
        float depth = -offset[ax.w] * ax.sign, ahead = normal[ax.w] * ax.sign, reach = 1 + (depth + least + 1) * 127;
        float wide = fabsf(normal[ax.u]);
        if (ahead + wide + fabsf(normal[ax.v]) <= 0) continue;
        f.hit = o->few ? &hit[face] : NULL;
        f.beyond = reach > 0 ? (reach < 255 ? (int)reach : 255) : 0;
        for (x = 0; x < FIV__VIEWS; x++) {
            f.part[x] = fiv__view_texel(&f.column[x], (-offset[ax.u] - depth * tangent[x]) * scale[x] + shift, side);
            f.up[x] = normal[ax.u] * tangent[x];
        }
        for (f.y = 0; f.y < FIV__VIEWS; f.y++) {
            int line, row = face * FIV__VIEWS + f.y;
            f.height = ahead + normal[ax.v] * tangent[f.y];
            if (f.height + wide <= 0) continue;
            f.down = fiv__view_texel(&line, (-offset[ax.v] - depth * tangent[f.y]) * scale[f.y] + shift, side);
            f.row = o->contact + (o->few ? 0 : (size_t)((row * side + line) * FIV__VIEWS * side));
            f.light = o->contact_light + row * FIV__VIEWS;
            fiv__add_views(&sum, &f);
        }
    }
    *angle = 0;
    for (x = 0; x < FIV__VIEWS; x++) *angle += sum.angle[x];
    for (c = 0; c < 3; c++) {
        taken[c] = 0;
        for (x = 0; x < FIV__VIEWS; x++) {
            all[c] += sum.all[c][x];
            taken[c] += sum.taken[c][x];
        }
        taken[c] = all[c] > 0 ? diffuse[c] * (taken[c] / all[c]) : 0;
    }
}

/* >> shadows */

/* The integral over the texels of a mask above the horizon. */
static void fiv__integrate_mask(double sum[FIV__TERMS], const uint64_t *rows, const double *sums, const float normal[3],
                                int size)
{
    int row, low, high;
    memset(sum, 0, FIV__TERMS * sizeof *sum);
    for (row = 0; row < 6 * size; row++) {
        uint64_t m = rows[row];
        if (!m) continue;
        fiv__half_space(&low, &high, normal, row, size);
        if (low >= high) continue;
        m &= fiv__bits(low, high);
        while (m) {
            int begin = fiv__first_bit(m), end;
            uint64_t carry = m + ((uint64_t)1 << begin);
            end = carry ? fiv__first_bit(carry) : 64;
            fiv__add_span(sum, sums + (size_t)row * (size_t)(size + 1) * FIV__TERMS, begin, end);
            m = end == 64 ? 0 : m & ~(((uint64_t)1 << end) - 1);
        }
    }
}

#ifndef FIV_NO_MASKS
/* Irradiance that the texels above the horizon give. */
static void fiv__integrate_rows(float rgb[3], const uint64_t *rows, const double *sums, const float normal[3], int size)
{
    double sum[FIV__TERMS];
    int c, k;
    fiv__integrate_mask(sum, rows, sums, normal, size);
    for (c = 0; c < 3; c++) {
        double v = 0;
        for (k = 0; k < 3; k++) v += sum[3 * c + k] * (double)normal[k];
        rgb[c] = v > 0 ? (float)v : 0;
    }
}
#endif

/* ---- one occluder above the horizon of one receiver */

/* A disc of uniform light with this axis and half angle, cut by the horizon: its irradiance over that of the whole disc
   seen head on. cosine: of the axis over the horizon; half: of the half angle (formula of the clipped cap, exact for
   half angles up to 90 degrees). */
static float fiv__clipped_cap(float cosine, float half)
{
    float square = 1 - half * half, sine, x, y, q;
    if (cosine * cosine >= square) return cosine > 0 ? cosine : 0;
    sine = sqrtf(1 - cosine * cosine);
    x = half / sqrtf(square);
    y = -x * cosine / sine;
    y = y < -1 ? -1 : y > 1 ? 1 : y;
    q = sqrtf(1 - y * y);
    return ((cosine * acosf(y) - x * sine * q) * square + atanf(sine * q / x)) / (3.14159265f * square);
}

enum { FIV__ROW = 16, FIV__SLOTS = 64 };

/* The light above a receiver's horizon that an instance hides, and its solid angle: from a mask of its own. */
typedef struct fiv__own {
    const fiv_instance *instance;
    size_t receiver;
    float v[FIV__TERMS];
} fiv__own;

typedef struct fiv__receiver {
    const fiv_environment *environment;
    const fiv_instance *instances;
    size_t instance_count;
    const fiv_irradiance_options *options;
    fiv_irradiance_stats *stats;
    float point[3], normal[3];
    float diffuse[3];                    /* I_tot without the lights */
    float light_cosine[FIV_MAX_LIGHTS];  /* over the horizon */
    float light_direction[FIV_MAX_LIGHTS][3];
    float sun_tangent[FIV_MAX_LIGHTS];   /* of its radius */
    float total[3];
    int own_left;                        /* receivers of this tile that may still have own masks */
    const float *points, *normals;       /* of all receivers of the call */
    size_t count, index;                 /* of which this is one */
    fiv__own own[FIV__SLOTS];
} fiv__receiver;

typedef struct fiv__shadow {
    const fiv_occluder *occluder;
    float rgb[3];       /* irradiance the occluder takes, without the lights */
    float direction[3]; /* to its centre, world */
    float radius, disc; /* sine of the ball's half angle; radius of the disc it stands for on the unit sphere */
    size_t nearest;     /* sample */
} fiv__shadow;

/* Where an occluder stands: offset in its own frame and radii; 0 when it cannot matter. */
static int fiv__place(float offset[3], float world[3], float *distance, const fiv_instance *instance,
                      const float point[3])
{
    const fiv_occluder *o = instance->occluder;
    float centre[3], inverse;
    int k;
    if (!(o->radius > 0) || !(instance->scale > 0)) return 0;
    fiv__turn(centre, o->rotation, o->centre);
    inverse = 1 / (o->radius * instance->scale);
    for (k = 0; k < 3; k++) world[k] = (instance->position[k] - point[k] + instance->scale * centre[k]) * inverse;
    *distance = sqrtf(fiv__dot(world, world));
    if (!(*distance < 1e9f)) return 0; /* takes less than 1e-18 of the light */
    fiv__turn_back(offset, o->rotation, world);
    return 1;
}

/* 1 when even an occluder that filled its ball could take no more than the cutoff: L_max pi (R / r)^2 <= cutoff I_tot
   in each channel, and no split-off light within the ball. */
static int fiv__is_negligible(const fiv__receiver *r, const float world[3], float distance)
{
    float sine = distance > 1 ? 1 / distance : 1, reach;
    int c, i;
    for (c = 0; c < 3; c++)
        if (!(r->environment->largest[c] * 3.14159265f * sine * sine <= r->options->cutoff * r->total[c])) return 0;
    if (sine >= 1) return r->environment->light_count == 0;
    reach = distance * cosf(asinf(sine) + 4.0f / (float)r->environment->face);
    for (i = 0; i < r->environment->light_count; i++)
        if (r->light_cosine[i] > 0 && fiv__dot(world, r->light_direction[i]) > reach) return 0;
    return 1;
}

/* Irradiance taken: N vector, or the cap where the horizon cuts. `cut`: part of the occluder's height below the
   horizon. */
static void fiv__shade(float rgb[3], const float v[FIV__TERMS], const float normal[3], float cut)
{
    int c;
    for (c = 0; c < 3; c++) {
        float along = fiv__dot(v + 3 * c, normal);
        if (cut > 0) {
            float length = sqrtf(fiv__dot(v + 3 * c, v + 3 * c)), half = 1 - v[9] * 0.159154943f, cap, blend = 4 * cut;
            half = half < 0.01f ? 0.01f : half > 0.999999f ? 0.999999f : half;
            cap = length > 0 ? length * fiv__clipped_cap(along / length, half) : 0;
            along += (cap - along) * (blend < 1 ? blend : 1);
        }
        rgb[c] = along > 0 ? along : 0;
    }
}

#ifndef FIV_NO_MASKS
/* The eight masks, each cut by the horizon. */
static void fiv__shade_masks(float rgb[3], const fiv_occluder *o, const fiv__cell *cell, const float normal[3],
                             size_t *masks)
{
    double sum[FIV__TERMS], out[3] = {0, 0, 0}, total = 0;
    int q, c, k;
    for (q = 0; q < 8; q++) {
        size_t s = cell->index[q];
        double radius = (double)o->grid.shell[cell->shell + (q >> 2)], weight = (double)cell->weight[q];
        if (weight < 1e-4 || o->state[s] != FIV__VALID) continue;
        fiv__integrate_above(sum, o->sums, o->words + o->first[s], o->first[s + 1] - o->first[s], o->face, normal);
        ++*masks;
        total += weight;
        for (c = 0; c < 3; c++)
            for (k = 0; k < 3; k++) out[c] += weight * radius * radius * sum[3 * c + k] * (double)normal[k];
    }
    total *= (double)cell->radius * (double)cell->radius;
    for (c = 0; c < 3; c++) rgb[c] = total > 0 && out[c] > 0 ? (float)(out[c] / total) : 0;
}
#endif

/* ---- masks of a receiver's own. Receivers often stand in rows, such as the pixels of a picture: where the masks of
   two of them take nearly the same, those between get what lies between. Rows are cut every 16 receivers of the call
   and then in halves, so that the result depends on the receivers alone. */

static const fiv__own *fiv__own_mask(fiv__receiver *r, const fiv_instance *instance, size_t i)
{
    const fiv_occluder *o = instance->occluder;
    fiv__own *own = &r->own[(i % (2 * FIV__ROW) + 2 * FIV__ROW * (size_t)(instance - r->instances)) % FIV__SLOTS];
    uint64_t rows[FIV__MAX_ROWS];
    double sum[FIV__TERMS];
    float offset[3] = {0, 0, 0}, world[3], normal[3], distance;
    int k;
    if (own->instance == instance && own->receiver == i) return own;
    own->instance = instance;
    own->receiver = i;
    fiv__normalise(normal, r->normals + 3 * i);
    fiv__turn_back(normal, o->rotation, normal);
    fiv__place(offset, world, &distance, instance, r->points + 3 * i);
    for (k = 0; k < 3; k++) offset[k] += FIV__BELOW * normal[k];
    fiv__raster_mesh(rows, &o->mesh, offset, o->face, normal);
    fiv__integrate_mask(sum, rows, o->sums, normal, o->face);
    for (k = 0; k < FIV__TERMS; k++) own->v[k] = (float)sum[k];
    r->stats->own_masks++;
    return own;
}

/* 1 when receiver i, too, is near contact, and its normal is nearly that of the present one. */
static int fiv__is_alike(const fiv__receiver *r, const fiv_instance *instance, size_t i)
{
    const float *p = r->points + 3 * i, *n = r->normals + 3 * i;
    float offset[3], world[3], distance, normal[3];
    fiv__cell cell;
    int k;
    for (k = 0; k < 3; k++)
        if (!sat__is_finite(p[k]) || !sat__is_finite(n[k])) return 0;
    fiv__normalise(normal, n);
    if (!(fiv__dot(normal, r->normal) > 0.98f) || !fiv__place(offset, world, &distance, instance, p)) return 0;
    fiv__locate(&cell, &instance->occluder->grid, offset);
    return fiv__is_contact(instance->occluder, &cell, offset);
}

/* How far the present receiver stands from a to b, 0..1; < 0: not between them, or they are too far apart. */
static float fiv__between(const fiv__receiver *r, const fiv_instance *instance, size_t a, size_t b)
{
    float d[3], e[3], square, along, limit = instance->occluder->radius * instance->scale * 0.0625f;
    int k;
    for (k = 0; k < 3; k++) {
        d[k] = r->points[3 * b + (size_t)k] - r->points[3 * a + (size_t)k];
        e[k] = r->point[k] - r->points[3 * a + (size_t)k];
    }
    square = fiv__dot(d, d);
    if (!(square > 0) || !(square <= limit * limit)) return -1;
    along = fiv__dot(d, e) / square;
    for (k = 0; k < 3; k++) e[k] -= along * d[k];
    return along >= 0 && along <= 1 && fiv__dot(e, e) <= square / 64 ? along : -1;
}

/* The present receiver's own light and solid angle: its mask, or what lies between two that take nearly the same. */
static void fiv__find_own(float v[FIV__TERMS], fiv__receiver *r, const fiv_instance *instance, const float normal[3])
{
    size_t i = r->index, a = i - i % FIV__ROW, b = a + FIV__ROW - ((a + FIV__ROW) % FIV__TILE == 0);
    int c, k, shared = r->options->own_masks == FIV__TILE && r->options->own_tolerance > 0;
    if (b >= r->count) b = r->count - 1;
    while (shared && a < i && i < b) {
        float t = fiv__between(r, instance, a, b), first[FIV__TERMS];
        size_t middle = (a + b) / 2;
        if (t >= 0 && fiv__is_alike(r, instance, a) && fiv__is_alike(r, instance, b)) {
            const fiv__own *last;
            int same = 1;
            memcpy(first, fiv__own_mask(r, instance, a)->v, sizeof first);
            last = fiv__own_mask(r, instance, b);
            for (c = 0; c < 3; c++) {
                float off = fiv__dot(last->v + 3 * c, normal) - fiv__dot(first + 3 * c, normal);
                same &= fabsf(off) <= r->options->own_tolerance * r->diffuse[c];
            }
            if (same) {
                for (k = 0; k < FIV__TERMS; k++) v[k] = first[k] + t * (last->v[k] - first[k]);
                return;
            }
        }
        if (i <= middle) b = middle;
        else a = middle;
    }
    memcpy(v, fiv__own_mask(r, instance, i)->v, FIV__TERMS * sizeof *v);
}

static float fiv__sun_tangent(const fiv__light *light, float penumbra)
{
    float angle = light->radius * penumbra;
    return tanf(angle < 1.2f ? angle : 1.2f);
}

#ifndef FIV_NO_DELTA

/* ---- split-off lights: what their depth maps say */

typedef struct fiv__seen {
    const uint16_t *cell;
    int pitch, side;
    float x, y, z, scale; /* the receiver, in texels; towards the light in radii; texels a radius */
} fiv__seen;

/* How far the mesh reaches beyond the receiver at a texel; < 0: not that far. */
static inline float fiv__beyond(const fiv__seen *s, int x, int y)
{
    int word = x < 0 || y < 0 || x >= s->side || y >= s->side ? 0 : s->cell[y * s->pitch + x];
    return word ? (float)(word - 1) * (1.0f / 32767) - 1 - s->z : -1;
}

/* Bilinear between the comparisons at four texels. */
static float fiv__compare(const fiv__seen *s, float x, float y)
{
    int i = fiv__floor(x), j = fiv__floor(y);
    float u = x - (float)i, v = y - (float)j, least = 0.25f / s->scale;
    return ((fiv__beyond(s, i, j) > least ? 1 - u : 0) + (fiv__beyond(s, i + 1, j) > least ? u : 0)) * (1 - v) +
           ((fiv__beyond(s, i, j + 1) > least ? 1 - u : 0) + (fiv__beyond(s, i + 1, j + 1) > least ? u : 0)) * v;
}

/* 1 or 0 where the 16 texels around all say so, by three texels; else -1. */
static int fiv__all_agree(const fiv__seen *s)
{
    int x = fiv__floor(s->x) - 1, y = fiv__floor(s->y) - 1, i, over = 0, under = 0;
    float margin = 3 / s->scale;
    for (i = 0; i < 16; i++) {
        float beyond = fiv__beyond(s, x + (i & 3), y + (i >> 2));
        over += beyond > margin;
        under += beyond < -margin || beyond == -1;
    }
    return over == 16 ? 1 : under == 16 ? 0 : -1;
}

/* Of points on a disc around the receiver, in texels: the part that is covered; *distance: their mean distance, in
   radii (Fernando 2005, percentage-closer soft shadows). */
static float fiv__disc(float *distance, const fiv__seen *s, float radius, int search)
{
    int n = sat__clamp_int((int)((search ? 0.35f : 0.75f) * radius) + 3, 4, 12), i, j;
    float covered = 0, count = 0, sum = 0, step = 2 / (float)n;
    for (j = 0; j < n; j++)
        for (i = 0; i < n; i++) {
            float u = ((float)i + 0.5f) * step - 1, v = ((float)j + 0.5f) * step - 1, x, y;
            if (u * u + v * v > 1) continue;
            x = s->x + radius * u;
            y = s->y + radius * v;
            count++;
            if (search) {
                float beyond = fiv__beyond(s, fiv__floor(x + 0.5f), fiv__floor(y + 0.5f));
                if (!(beyond > 0.25f / s->scale)) continue;
                sum += beyond;
                covered++;
            } else covered += fiv__compare(s, x, y);
        }
    *distance = covered > 0 ? sum / covered : 0;
    return covered / count;
}

/* How much of a light an occluder takes, 0..1. A light's disc, seen past the silhouette, is the penumbra: its width is
   the distance to the silhouette times the light's tangent. */
static float fiv__cover_light(const fiv__receiver *r, const fiv_occluder *o, int light, const float offset[3], int rays)
{
    fiv__seen s;
    const float (*axes)[3] = (const float (*)[3])o->light_axes[light];
    float shift, reach, distance;
    int sure;
    s.z = -fiv__dot(offset, axes[2]);
    if (s.z >= 1) return 0;
    s.scale = fiv__map_scale(o);
    shift = s.scale + (float)FIV__MAP_BORDER - 0.5f;
    s.cell = o->map + fiv__map_cell(o, light);
    s.pitch = o->map_side;
    s.side = o->cell_side;
    s.x = shift - fiv__dot(offset, axes[0]) * s.scale;
    s.y = shift - fiv__dot(offset, axes[1]) * s.scale;
    reach = r->sun_tangent[light] * (1 - s.z) * s.scale;
    if (!(fabsf(s.x - shift) < s.scale + reach + 2 && fabsf(s.y - shift) < s.scale + reach + 2)) return 0;
    if (reach > 1) {
        float part = fiv__disc(&distance, &s, reach, 1);
        if (part == 0 || part == 1) return part;
        reach = r->sun_tangent[light] * distance * s.scale;
        if (reach > 1) return fiv__disc(&distance, &s, reach, 0);
    }
    if (!rays) return fiv__compare(&s, s.x, s.y);
    sure = fiv__all_agree(&s);
    if (sure >= 0) return (float)sure;
    r->stats->rays++;
    return fiv__ray_meets(&o->mesh, offset, axes[2]) ? 1.0f : 0.0f;
}

#endif /* FIV_NO_DELTA */

/* The same of all lights above the horizon. */
static void fiv__cover_lights(float covered[FIV_MAX_LIGHTS], const fiv__receiver *r, const fiv_occluder *o,
                              const float offset[3], int rays)
{
    int i;
    for (i = 0; i < o->light_count; i++) {
        covered[i] = 0;
#ifndef FIV_NO_DELTA
        if (r->light_cosine[i] > 0) covered[i] = fiv__cover_light(r, o, i, offset, rays);
#else
        (void)r, (void)offset, (void)rays;
#endif
    }
}

/* The share of the occluder's ball that the receiver's horizon cuts; -1 when it takes nothing: behind the horizon, or
   too little. `normal` is the receiver's, turned into the occluder's frame. */
static float fiv__horizon_cut(float normal[3], fiv__receiver *r, const fiv_occluder *o, const float world[3],
                              float distance)
{
    float height = fiv__dot(world, r->normal), below = 1, above = 1, back[3], cut = 0;
    int k;
    if (height <= -1) {
        r->stats->below_horizon++;
        return -1;
    }
    if (fiv__is_negligible(r, world, distance)) {
        r->stats->below_cutoff++;
        return -1;
    }
    fiv__turn_back(normal, o->rotation, r->normal);
    if (height < 1 && r->options->accuracy > FIV_TRILINEAR) {
        for (k = 0; k < 3; k++) back[k] = -normal[k];
        below = fiv__reach(o, back);
        above = fiv__reach(o, normal);
        if (height <= -above) {
            r->stats->below_horizon++;
            return -1;
        }
    }
    if (height < below - 1e-4f) cut = (below - height) / (below + above);
    r->stats->clipped += cut > 0;
    r->stats->whole += !(cut > 0);
    return cut;
}

/* Fills in a shadow; 0 when the occluder takes nothing. */
static int fiv__cast(fiv__shadow *shadow, float covered[FIV_MAX_LIGHTS], fiv__receiver *r, const fiv_instance *instance)
{
    const fiv_occluder *o = instance->occluder;
    float offset[3], world[3], distance, normal[3] = {0, 0, 0}, v[FIV__TERMS], cut;
    int k, published = r->options->accuracy <= FIV_TRILINEAR, masks = 0, own = 0, inside = 0;
    float contact = 0, around[3], angle;
    fiv__cell cell;
    if (!fiv__place(offset, world, &distance, instance, r->point)) return 0;
    cut = fiv__horizon_cut(normal, r, o, world, distance);
    if (cut < 0) return 0;
    fiv__locate(&cell, &o->grid, offset);
    if (r->options->accuracy == FIV_NEAREST) fiv__take_nearest(&cell);
    if (published) {
        fiv__lookup_published(v, o, &cell);
        for (k = 0; k < 9 && cut > 0 && r->options->partial; k++) v[k] *= 1 - cut; /* (d + R) / 2R */
    } else {
        own = r->own_left > 0 && o->mesh.triangle_count <= (size_t)r->options->own_triangles &&
              r->diffuse[0] + r->diffuse[1] + r->diffuse[2] > 0 && fiv__is_contact(o, &cell, offset);
        if (fiv__lookup_scaled(v, o, &cell) == 0) {
            inside = o->state[cell.index[0]] != FIV__STALE;
            r->stats->missing += !inside;
        }
        if (o->contact_side && r->options->contact && !own && r->diffuse[0] + r->diffuse[1] + r->diffuse[2] > 0)
            contact = inside ? 1 : fiv__contact_part(o, &cell, v[9]);
    }
    if (own) {
        fiv__find_own(v, r, instance, normal);
        fiv__shade(shadow->rgb, v, normal, 0);
        r->stats->own_receivers++;
    }
#ifndef FIV_NO_MASKS
    masks = r->options->accuracy == FIV_MASK && cut > 0 && o->keep_masks && !own;
    if (masks) fiv__shade_masks(shadow->rgb, o, &cell, normal, &r->stats->masks);
#endif
    if (!masks && !own) fiv__shade(shadow->rgb, v, normal, published || !r->options->partial ? 0 : cut);
    if (contact > 0) {
        fiv__look_around(around, &angle, o, offset, normal, r->diffuse);
        for (k = 0; k < 3; k++) shadow->rgb[k] += contact * (around[k] - shadow->rgb[k]);
        v[9] += contact * (angle - v[9]);
        r->stats->contacts++;
    } else if (inside && !own) memcpy(shadow->rgb, r->diffuse, sizeof shadow->rgb); /* dark all around */
    fiv__cover_lights(covered, r, o, offset, r->options->rays && !published);
    shadow->occluder = o;
    shadow->radius = distance > 1 ? 1 / distance : 1;
    shadow->disc = published ? shadow->radius : sqrtf(v[9] * 0.318309886f);
    for (k = 0; k < 3; k++) {
        shadow->direction[k] = world[k] / (distance > 0 ? distance : 1);
        shadow->rgb[k] = shadow->rgb[k] < r->diffuse[k] ? shadow->rgb[k] : r->diffuse[k];
    }
    if (r->options->accuracy == FIV_MASK && r->instance_count > 1) shadow->nearest = cell.index[fiv__nearest(&cell)];
    return 1;
}

/* >> receivers */

/* ---- several occluders. Sums are taken in fixed point, as parts of I_tot, so that their order does not matter. */

#define FIV__ONE 1099511627776.0 /* 2^40 */

static inline int64_t fiv__fixed(float part, float whole)
{
    return whole > 0 ? (int64_t)((double)part / (double)whole * FIV__ONE + 0.5) : 0;
}

/* Common area of two discs, d apart. */
static float fiv__lens(float r1, float r2, float d)
{
    float a, b;
    if (d >= r1 + r2) return 0;
    if (d <= fabsf(r1 - r2)) return 3.14159265f * (r1 < r2 ? r1 * r1 : r2 * r2);
    a = (d * d + r1 * r1 - r2 * r2) / (2 * d * r1);
    b = (d * d + r2 * r2 - r1 * r1) / (2 * d * r2);
    a = acosf(a < -1 ? -1 : a > 1 ? 1 : a);
    b = acosf(b < -1 ? -1 : b > 1 ? 1 : b);
    return r1 * r1 * (a - 0.5f * sinf(2 * a)) + r2 * r2 * (b - 0.5f * sinf(2 * b));
}

/* Published (eq 14 and 15): the part of the summed areas that two discs share, of the summed irradiances. FIV_SCALED:
   the discs have the solid angle of the silhouettes, and the smaller irradiance bounds what is shared. */
static int fiv__discs_overlap(float shared[3], const fiv__shadow *a, const fiv__shadow *b, int published)
{
    float d[3], area, smaller;
    int k;
    for (k = 0; k < 3; k++) d[k] = a->direction[k] - b->direction[k];
    area =
        fiv__lens(a->disc > b->disc ? a->disc : b->disc, a->disc > b->disc ? b->disc : a->disc, sqrtf(fiv__dot(d, d)));
    if (!(area > 0)) return 0;
    smaller = a->disc < b->disc ? a->disc : b->disc;
    for (k = 0; k < 3; k++) {
        float low = a->rgb[k] < b->rgb[k] ? a->rgb[k] : b->rgb[k];
        if (published)
            shared[k] = area / (3.14159265f * (a->disc * a->disc + b->disc * b->disc)) * (a->rgb[k] + b->rgb[k]);
        else shared[k] = area / (3.14159265f * smaller * smaller) * low;
    }
    return 1;
}

static void fiv__subtract_discs(int64_t taken[3], const fiv__receiver *r, const fiv__shadow *shadows, int count)
{
    int i, j, k, met = 0, published = r->options->accuracy <= FIV_TRILINEAR;
    int64_t largest[3] = {0, 0, 0}, shared_sum[3] = {0, 0, 0};
    for (i = 0; i < count; i++) {
        for (k = 0; k < 3; k++) {
            int64_t v = fiv__fixed(shadows[i].rgb[k], r->diffuse[k]);
            if (v > largest[k]) largest[k] = v;
        }
        for (j = 0; j < i; j++) {
            float shared[3];
            if (!fiv__discs_overlap(shared, &shadows[i], &shadows[j], published)) continue;
            met = 1;
            for (k = 0; k < 3; k++) shared_sum[k] += fiv__fixed(shared[k], r->diffuse[k]);
        }
    }
    r->stats->overlaps += (size_t)met;
    for (k = 0; k < 3; k++) {
        taken[k] -= shared_sum[k];
        if (!published && taken[k] < largest[k]) taken[k] = largest[k];
    }
}

#ifndef FIV_NO_MASKS

/* The mask of a sample in the world's frame. */
static void fiv__world_mask(uint64_t *rows, const fiv_occluder *o, size_t sample, const float direction[3],
                            float radius)
{
    uint64_t own[FIV__MAX_ROWS];
    const uint16_t *words = o->words + o->first[sample];
    size_t count = o->first[sample + 1] - o->first[sample];
    float limit = cosf(asinf(radius) * 1.5f + 8.0f / (float)o->face);
    int row, x, size = o->face;
    if (memcmp(o->rotation, fiv__identity, sizeof fiv__identity) == 0) {
        fiv__decode(rows, words, count, 6 * size);
        return;
    }
    if (radius >= 0.7f) limit = -2;
    fiv__decode(own, words, count, 6 * size);
    for (row = 0; row < 6 * size; row++) {
        rows[row] = 0;
        for (x = 0; x < size; x++) {
            float d[3];
            size_t texel;
            fiv__cube_direction(d, row / size, fiv__texel_coordinate(x, size), fiv__texel_coordinate(row % size, size));
            if (limit > -1 && fiv__dot(d, direction) < limit * sqrtf(fiv__dot(d, d))) continue;
            fiv__turn_back(d, o->rotation, d);
            texel = fiv__cube_texel(d, size);
            rows[row] |= (own[texel / (size_t)size] >> (texel % (size_t)size) & 1) << x;
        }
    }
}

static int fiv__balls_overlap(const fiv__shadow *a, const fiv__shadow *b)
{
    float cosine = sqrtf(1 - a->radius * a->radius) * sqrtf(1 - b->radius * b->radius) - a->radius * b->radius;
    if (a->radius >= 1 || b->radius >= 1) return 1;
    return fiv__dot(a->direction, b->direction) > cosine - 1e-3f;
}

/* Exact union: the nearest masks of the occluders that may overlap are ORed; what the union takes, over what they take
   one by one, scales their interpolated sum. Where the nearest masks lie below the horizon and the interpolated ones do
   not, their texels say how much is shared. */
static void fiv__unite_masks(int64_t taken[3], const fiv__receiver *r, const fiv__shadow *shadows, int count)
{
    uint64_t all[FIV__MAX_ROWS], one[FIV__MAX_ROWS], twice = 0;
    int64_t group[3] = {0, 0, 0}, alone[3] = {0, 0, 0};
    float rgb[3];
    double texels = 0, covered = 0, part;
    int i, j, k, row, members = 0;
    memset(all, 0, sizeof all);
    memset(one, 0, sizeof one);
    for (i = 0; i < count; i++) {
        for (j = 0; j < count; j++)
            if (i != j && fiv__balls_overlap(&shadows[i], &shadows[j])) break;
        if (j == count || !shadows[i].occluder->keep_masks) continue;
        fiv__world_mask(one, shadows[i].occluder, shadows[i].nearest, shadows[i].direction, shadows[i].radius);
        for (row = 0; row < 6 * r->environment->face; row++) {
            twice |= all[row] & one[row];
            all[row] |= one[row];
            texels += fiv__count_bits(one[row]);
        }
        fiv__integrate_rows(rgb, one, r->environment->sums, r->normal, r->environment->face);
        members++;
        for (k = 0; k < 3; k++) {
            alone[k] += fiv__fixed(rgb[k], r->diffuse[k]);
            group[k] += fiv__fixed(shadows[i].rgb[k], r->diffuse[k]);
        }
    }
    r->stats->masks += (size_t)members;
    if (!twice) return;
    r->stats->overlaps++;
    fiv__integrate_rows(rgb, all, r->environment->sums, r->normal, r->environment->face);
    for (row = 0; row < 6 * r->environment->face; row++) covered += fiv__count_bits(all[row]);
    for (k = 0; k < 3; k++) {
        int64_t together = fiv__fixed(rgb[k], r->diffuse[k]);
        part = alone[k] > 0 ? (double)together / (double)alone[k] : covered / texels;
        if (part < 1) taken[k] -= group[k] - (int64_t)((double)group[k] * part);
    }
}

#endif /* FIV_NO_MASKS */

/* What all instances take of the diffuse light (fixed point) and of each split-off light. */
static void fiv__gather_shadows(int64_t taken[3], float covered[FIV_MAX_LIGHTS], fiv__receiver *r)
{
    fiv__shadow shadows[FIV_MAX_INSTANCES];
    float one[FIV_MAX_LIGHTS];
    const int lights = r->environment->light_count;
    size_t i;
    int k, count = 0;
    taken[0] = taken[1] = taken[2] = 0;
    for (k = 0; k < lights; k++) covered[k] = 0;
    for (i = 0; i < r->instance_count; i++) {
        if (!fiv__cast(&shadows[count], one, r, &r->instances[i])) continue;
        for (k = 0; k < 3; k++) taken[k] += fiv__fixed(shadows[count].rgb[k], r->diffuse[k]);
        for (k = 0; k < lights; k++) covered[k] = one[k] > covered[k] ? one[k] : covered[k];
        count++;
    }
    if (count < 2 || !r->options->overlap) return;
#ifndef FIV_NO_MASKS
    if (r->options->accuracy == FIV_MASK) {
        fiv__unite_masks(taken, r, shadows, count);
        return;
    }
#endif
    fiv__subtract_discs(taken, r, shadows, count);
}

/* Normal, I_tot and lights of a receiver; 0 when it is not finite. */
static int fiv__start_receiver(fiv__receiver *r, const float *point, const float *normal)
{
    const fiv_environment *e = r->environment;
    int i, k;
    for (k = 0; k < 3; k++)
        if (!sat__is_finite(point[k]) || !sat__is_finite(normal[k])) {
            r->stats->non_finite++;
            return 0;
        }
    memcpy(r->point, point, sizeof r->point);
    fiv__normalise(r->normal, normal);
    r->total[0] = r->total[1] = r->total[2] = 0;
    if (!(fiv__dot(r->normal, r->normal) > 0.5f)) return 0;
    fiv__diffuse(r->diffuse, e, r->normal);
    memcpy(r->total, r->diffuse, sizeof r->total);
    for (i = 0; i < e->light_count; i++) {
        fiv__turn(r->light_direction[i], e->rotation, e->lights[i].direction);
        r->light_cosine[i] = fiv__dot(r->normal, r->light_direction[i]);
        if (!(r->light_cosine[i] > 0)) r->light_cosine[i] = 0;
        for (k = 0; k < 3; k++) r->total[k] += e->lights[i].power[k] * r->light_cosine[i];
    }
    return 1;
}

static void fiv__finish_receiver(float rgb[3], const fiv__receiver *r, const int64_t taken[3],
                                 const float covered[FIV_MAX_LIGHTS])
{
    int i, k;
    for (k = 0; k < 3; k++) {
        double part = 1 - (double)taken[k] / FIV__ONE;
        rgb[k] = part <= 0 ? 0 : part >= 1 ? r->diffuse[k] : (float)((double)r->diffuse[k] * part);
        for (i = 0; i < r->environment->light_count; i++)
            rgb[k] += r->environment->lights[i].power[k] * r->light_cosine[i] * (1 - covered[i]);
    }
}

static void fiv__receive(float rgb[3], fiv__receiver *r, const float *point, const float *normal)
{
    int64_t taken[3];
    float covered[FIV_MAX_LIGHTS];
    rgb[0] = rgb[1] = rgb[2] = 0;
    if (!fiv__start_receiver(r, point, normal)) return;
    fiv__gather_shadows(taken, covered, r);
    fiv__finish_receiver(rgb, r, taken, covered);
}

/* ---- many receivers, in tiles of fixed size */

typedef struct fiv__job {
    float *rgb;
    const float *points, *normals;
    size_t count;
    const fiv_environment *environment;
    const fiv_instance *self, *instances;
    size_t instance_count;
    const fiv_irradiance_options *options;
    fiv_irradiance_stats *stats; /* one a share */
    size_t share;                /* receivers of a share: whole tiles */
} fiv__job;

#ifndef FIV_NO_SELF
static void fiv__receive_self(float rgb[3], fiv__receiver *r, const fiv_instance *self, const float *point,
                              const float *normal);
#endif

/* Shares [begin, end): no other call has the first of them, so that its counters are this call's own. */
static void fiv__run_shares(int begin, int end, int worker, void *context)
{
    const fiv__job *job = (const fiv__job *)context;
    fiv__receiver r;
    size_t i, last = (size_t)end * job->share < job->count ? (size_t)end * job->share : job->count;
    int k;
    (void)worker;
    r.environment = job->environment;
    r.instances = job->instances;
    r.instance_count = job->instance_count;
    r.options = job->options;
    r.stats = &job->stats[begin];
    r.points = job->points;
    r.normals = job->normals;
    r.count = job->count;
    memset(r.light_cosine, 0, sizeof r.light_cosine);
    memset(r.own, 0, sizeof r.own);
    for (k = 0; k < r.environment->light_count; k++)
        r.sun_tangent[k] = fiv__sun_tangent(&r.environment->lights[k], r.options->penumbra);
    for (i = (size_t)begin * job->share; i < last; i++) {
        size_t made = r.stats->own_receivers;
        r.index = i;
        if (i % FIV__TILE == 0) r.own_left = r.options->own_masks;
#ifndef FIV_NO_SELF
        if (job->self)
            fiv__receive_self(job->rgb + 3 * i, &r, job->self, job->points + 3 * i, job->normals + 3 * i);
        else
#endif
            fiv__receive(job->rgb + 3 * i, &r, job->points + 3 * i, job->normals + 3 * i);
        r.own_left -= r.stats->own_receivers > made;
    }
}

/* NULL, or what is wrong with an instance. */
static const char *fiv__bad_instance(const fiv_instance *instance, const fiv_environment *e,
                                     const fiv_irradiance_options *o)
{
    const fiv_occluder *occluder = instance->occluder;
    int k;
    if (!occluder) return "occluder is NULL";
    if (!occluder->environment) return "not lit yet (fiv_occluder_light)";
    if (occluder->environment != e) return "lit by another environment";
    if (occluder->stamp != e->stamp) return "the environment has changed since it was lit (fiv_occluder_light)";
    if (!sat__is_finite(instance->scale) || !(instance->scale >= 0)) return "scale is negative or not finite";
    for (k = 0; k < 3; k++)
        if (!sat__is_finite(instance->position[k])) return "position is not finite";
    if (o->accuracy == FIV_MASK && !occluder->keep_masks) return "no keep_masks, which FIV_MASK needs";
    return NULL;
}

static int fiv__explain_instances(sat__text *t, const fiv_environment *e, const fiv_instance *instances, size_t count,
                                  const fiv_irradiance_options *o)
{
    const char *wrong = NULL;
    size_t i;
    if (!e) sat__text_add(t, "environment is NULL");
    else if (count && !instances) sat__text_add(t, "instances are NULL");
    else if (count > FIV_MAX_INSTANCES) sat__text_range(t, "instance_count", (double)count, 0, FIV_MAX_INSTANCES, ' ');
    else {
        for (i = 0; i < count && (wrong = fiv__bad_instance(&instances[i], e, o)) == NULL; i++) {}
        if (!wrong) return 1;
        sat__text_add(t, "instance ");
        sat__text_number(t, (double)i);
        sat__text_add(t, ": ");
        sat__text_add(t, wrong);
    }
    return 0;
}

FIV_DEF const char *fiv_explain_irradiance(char *text, size_t size, const fiv_environment *environment,
                                           const fiv_instance *instances, size_t instance_count,
                                           const fiv_irradiance_options *options)
{
    sat__text t = sat__text_begin(text, size);
    fiv_irradiance_options o = options ? *options : fiv_irradiance_defaults();
    const sat__field *wrong = sat__fields_check(&o, fiv__irradiance_fields, SAT__COUNT(fiv__irradiance_fields));
    if (wrong) sat__text_field(&t, wrong, &o);
    else fiv__explain_instances(&t, environment, instances, instance_count, &o);
    return t.size ? text : "";
}

static void fiv__add_stats(fiv_irradiance_stats *sum, const fiv_irradiance_stats *s)
{
    sum->below_horizon += s->below_horizon;
    sum->below_cutoff += s->below_cutoff;
    sum->whole += s->whole;
    sum->clipped += s->clipped;
    sum->overlaps += s->overlaps;
    sum->masks += s->masks;
    sum->contacts += s->contacts;
    sum->own_receivers += s->own_receivers;
    sum->own_masks += s->own_masks;
    sum->rays += s->rays;
    sum->non_finite += s->non_finite;
    sum->missing += s->missing;
}

static sat_result fiv__run(fiv__job *job, const fiv_irradiance_options *options, fiv_irradiance_stats *stats)
{
    fiv_irradiance_options o = options ? *options : fiv_irradiance_defaults();
    fiv_irradiance_stats shares[FIV__SHARES], sum;
    sat__text ignored = sat__text_begin(NULL, 0);
    size_t i, tiles, used;
    if (job->count && (!job->rgb || !job->points || !job->normals)) return SAT_ERR_ARGUMENT;
    if (sat__fields_check(&o, fiv__irradiance_fields, SAT__COUNT(fiv__irradiance_fields))) return SAT_ERR_ARGUMENT;
    if (job->environment && job->instance_count > FIV_MAX_INSTANCES) return SAT_ERR_LIMIT;
    if (!fiv__explain_instances(&ignored, job->environment, job->instances, job->instance_count, &o))
        return SAT_ERR_ARGUMENT;
    if (job->self && fiv__bad_instance(job->self, job->environment, &o)) return SAT_ERR_ARGUMENT;
    tiles = job->count / FIV__TILE + (job->count % FIV__TILE != 0);
    if (tiles > 0x7fffffff) return SAT_ERR_SIZE;
    job->share = FIV__TILE * (tiles / FIV__SHARES + (tiles % FIV__SHARES != 0));
    used = job->count ? (job->count - 1) / job->share + 1 : 0;
    memset(shares, 0, used * sizeof *shares);
    memset(&sum, 0, sizeof sum);
    job->options = &o;
    job->stats = shares;
    sat__parallel_for(&o.threads, (int)used, fiv__run_shares, job);
    for (i = 0; i < used; i++) fiv__add_stats(&sum, &shares[i]);
    job->options = NULL;
    job->stats = NULL;
    if (stats) *stats = sum;
    return SAT_OK;
}

FIV_DEF sat_result fiv_irradiance(float *rgb, const float *points, const float *normals, size_t count,
                                  const fiv_environment *environment, const fiv_instance *instances,
                                  size_t instance_count, const fiv_irradiance_options *options,
                                  fiv_irradiance_stats *stats)
{
    fiv__job job;
    memset(&job, 0, sizeof job);
    job.rgb = rgb;
    job.points = points;
    job.normals = normals;
    job.count = count;
    job.environment = environment;
    job.instances = instances;
    job.instance_count = instance_count;
    return fiv__run(&job, options, stats);
}

/* ---- self-shadows: all that is not covered lies above the horizon (eq 13), so that what remains is N (FIV - FIV_occ).
   That holds on the surface, and no longer at the nearest sample above it; FIV_SCALED therefore cuts the open part at
   the horizon as a cap. Where there are views, they say what is open. */

#ifndef FIV_NO_SELF

/* A point in a fold may lie among samples that are all inside the mesh: step out along the normal until a quarter
   of the weight is valid. */
static void fiv__locate_outside(fiv__cell *cell, const fiv_occluder *o, const float offset[3], const float normal[3])
{
    static const float steps[6] = {0, 0.05f, 0.1f, 0.2f, 0.4f, 0.8f};
    int i, q, k;
    for (i = 0; i < 6; i++) {
        float moved[3], valid = 0;
        for (k = 0; k < 3; k++) moved[k] = offset[k] - steps[i] * normal[k];
        fiv__locate(cell, &o->grid, moved);
        for (q = 0; q < 8; q++)
            if (o->state[cell->index[q]] == FIV__VALID) valid += cell->weight[q];
        if (valid > 0.25f) return;
    }
}

static void fiv__self_samples(float rgb[3], const fiv__receiver *r, const fiv_occluder *o, const float offset[3],
                              const float normal[3])
{
    float v[FIV__TERMS], open[FIV__TERMS], world[3], total = 0;
    int c, k, q;
    fiv__cell cell;
    fiv__locate_outside(&cell, o, offset, normal);
    if (r->options->accuracy == FIV_NEAREST) fiv__take_nearest(&cell);
    memset(v, 0, sizeof v);
    for (q = 0; q < 8; q++) { /* whole vectors, not rho^2 times them: what is open does not fall with the distance */
        float radius = o->grid.shell[cell.shell + (q >> 2)];
        if (o->state[cell.index[q]] != FIV__VALID) continue;
        fiv__add_sample(v, cell.weight[q] / (radius * radius), o, cell.index[q]);
        total += cell.weight[q];
    }
    fiv__unscale(v, o, 1);
    for (c = 0; c < 3; c++) {
        for (k = 0; k < 3; k++) world[k] = (float)r->environment->vector[3 * c + k];
        fiv__turn_back(open + 3 * c, o->rotation, world);
        for (k = 0; k < 3; k++) open[3 * c + k] -= total > 1e-4f ? v[3 * c + k] / total : open[3 * c + k];
    }
    open[9] = total > 1e-4f ? 12.5663706f - v[9] / total : 0;
    fiv__shade(rgb, open, normal, r->options->accuracy >= FIV_SCALED && r->options->partial ? 1.0f : 0.0f);
}

/* By the views, from a texel above the surface. */
static void fiv__self_views(float rgb[3], const fiv__receiver *r, const fiv_occluder *o, const float offset[3],
                            const float normal[3])
{
    float lifted[3], angle, lift = fiv__view_lift(o);
    int k;
    for (k = 0; k < 3; k++) lifted[k] = offset[k] - normal[k] * lift;
    fiv__look_around(rgb, &angle, o, lifted, normal, r->diffuse);
    for (k = 0; k < 3; k++) rgb[k] = r->diffuse[k] > rgb[k] ? r->diffuse[k] - rgb[k] : 0;
    r->stats->contacts++;
}

/* A receiver on the mesh looks at its depth maps from two texels above it. */
static float fiv__self_lift(const fiv_occluder *o)
{
#ifndef FIV_NO_DELTA
    return o->light_count ? 2 / fiv__map_scale(o) : 0;
#else
    (void)o;
    return 0;
#endif
}

/* What the others take is taken of what the mesh itself leaves. */
static void fiv__receive_self(float rgb[3], fiv__receiver *r, const fiv_instance *self, const float *point,
                              const float *normal)
{
    const fiv_occluder *o = self->occluder;
    float offset[3], world[3], distance, own_normal[3], covered[FIV_MAX_LIGHTS], own[FIV_MAX_LIGHTS], open[3];
    int64_t taken[3];
    int k;
    rgb[0] = rgb[1] = rgb[2] = 0;
    if (!fiv__start_receiver(r, point, normal)) return;
    fiv__gather_shadows(taken, covered, r);
    if (fiv__place(offset, world, &distance, self, point)) {
        fiv__turn_back(own_normal, o->rotation, r->normal);
        if (o->contact_side && r->options->contact && r->options->accuracy >= FIV_SCALED)
            fiv__self_views(open, r, o, offset, own_normal);
        else fiv__self_samples(open, r, o, offset, own_normal);
        for (k = 0; k < 3; k++) offset[k] -= own_normal[k] * fiv__self_lift(o);
        fiv__cover_lights(own, r, o, offset, 0);
        for (k = 0; k < 3; k++) r->diffuse[k] = open[k] < r->diffuse[k] ? open[k] : r->diffuse[k];
        for (k = 0; k < r->environment->light_count; k++) covered[k] = own[k] > covered[k] ? own[k] : covered[k];
    }
    fiv__finish_receiver(rgb, r, taken, covered);
}

FIV_DEF sat_result fiv_self_irradiance(float *rgb, const float *points, const float *normals, size_t count,
                                       const fiv_environment *environment, const fiv_instance *self,
                                       const fiv_instance *others, size_t other_count,
                                       const fiv_irradiance_options *options, fiv_irradiance_stats *stats)
{
    fiv__job job;
    if (!self) return SAT_ERR_ARGUMENT;
    memset(&job, 0, sizeof job);
    job.rgb = rgb;
    job.points = points;
    job.normals = normals;
    job.count = count;
    job.environment = environment;
    job.self = self;
    job.instances = others;
    job.instance_count = other_count;
    return fiv__run(&job, options, stats);
}

#endif /* FIV_NO_SELF */

/* ---- lazy occluders */

FIV_DEF sat_result fiv_occluder_prepare(fiv_occluder *o, size_t *computed, const fiv_instance *instances,
                                        size_t instance_count, const float *points, size_t count)
{
    fiv__cell cell;
    size_t i, j, made;
    int q, k;
    if (!o || !o->lazy || !o->environment || o->stamp != o->environment->stamp) return SAT_ERR_ARGUMENT;
    if ((instance_count && !instances) || (count && !points)) return SAT_ERR_ARGUMENT;
    for (j = 0; j < instance_count; j++) {
        if (instances[j].occluder != o) continue;
        for (k = 0; k < 3; k++)
            if (!sat__is_finite(instances[j].position[k]) || !sat__is_finite(instances[j].scale))
                return SAT_ERR_ARGUMENT;
        for (i = 0; i < count; i++) {
            const float *p = points + 3 * i;
            float offset[3], world[3], distance;
            if (!sat__is_finite(p[0]) || !sat__is_finite(p[1]) || !sat__is_finite(p[2])) continue;
            if (!fiv__place(offset, world, &distance, &instances[j], p)) continue;
            fiv__locate(&cell, &o->grid, offset);
            for (q = 0; q < 8; q++)
                if (cell.weight[q] > 0 && o->state[cell.index[q]] == FIV__STALE) o->state[cell.index[q]] = FIV__WANTED;
        }
    }
    made = fiv__make_wanted(o);
    if (made) fiv__sign(o);
    if (computed) *computed = made;
    return SAT_OK;
}

/* >> saves */

/* ---- saves: a header of fixed-width little-endian fields, the states, the support function, the counts of words, the
   words; then the mesh: of each cluster the counts of vertices and triangles, the vertices, the corners */

#ifndef FIV_NO_MASKS

typedef struct fiv__save {
    uint64_t magic, hash;    /* of all bytes after this field */
    uint64_t words;
    int32_t octahedral, theta, phi, rho, face, closed, turn, clusters;
    float first, last, centre[3], radius;
    uint64_t vertices, triangles, skipped, rasterised, inside;
} fiv__save;

#define FIV__MAGIC UINT64_C(0x3230307669667473) /* reads "stfiv002" in memory where bytes are in this order */

static size_t fiv__save_size(const fiv_occluder *o, size_t words)
{
    const fiv__mesh *m = &o->mesh;
    size_t samples = fiv__grid_samples(&o->grid);
    return sizeof(fiv__save) + samples + FIV__SUPPORT * FIV__SUPPORT * sizeof(float) +
           (samples + 1) * sizeof(uint32_t) + words * sizeof(uint16_t) + m->cluster_count * 2 * sizeof(uint32_t) +
           m->vertex_count * 3 * sizeof(float) + 3 * m->triangle_count;
}

FIV_DEF size_t fiv_occluder_save_size(const fiv_occluder *o)
{
    return o && o->keep_masks ? fiv__save_size(o, o->first[o->stats.samples]) : 0;
}

static unsigned char *fiv__put(unsigned char *p, const void *from, size_t size)
{
    if (size) memcpy(p, from, size);
    return p + size;
}

static const unsigned char *fiv__take(void *to, const unsigned char *p, size_t size)
{
    if (size) memcpy(to, p, size);
    return p + size;
}

static void fiv__save_mesh(unsigned char *p, const fiv__mesh *m)
{
    size_t i;
    for (i = 0; i < m->cluster_count; i++) {
        uint32_t counts[2];
        counts[0] = (uint32_t)m->clusters[i].vertices;
        counts[1] = (uint32_t)m->clusters[i].triangles;
        p = fiv__put(p, counts, sizeof counts);
    }
    for (i = 0; i < 3; i++) p = fiv__put(p, m->x[i], m->vertex_count * sizeof(float));
    fiv__put(p, m->corner, 3 * m->triangle_count);
}

FIV_DEF sat_result fiv_occluder_save(void *memory, size_t size, const fiv_occluder *o)
{
    fiv__save s;
    unsigned char *p = (unsigned char *)memory;
    size_t needed = fiv_occluder_save_size(o), n;
    if (!needed || !memory || size < needed) return SAT_ERR_ARGUMENT;
    n = o->stats.samples;
    memset(&s, 0, sizeof s);
    s.magic = FIV__MAGIC;
    s.words = o->first[n];
    s.octahedral = o->grid.octahedral;
    s.theta = o->grid.theta;
    s.phi = o->grid.phi;
    s.rho = o->grid.rho;
    s.face = o->face;
    s.closed = o->stats.closed;
    s.turn = o->mesh.turn < 0 ? -1 : 1;
    s.clusters = (int32_t)o->mesh.cluster_count;
    s.vertices = o->mesh.vertex_count;
    s.first = o->grid.first;
    s.last = o->grid.last;
    memcpy(s.centre, o->centre, sizeof s.centre);
    s.radius = o->radius;
    s.triangles = o->stats.triangles;
    s.skipped = o->stats.skipped_triangles;
    s.rasterised = o->stats.rasterised;
    s.inside = o->stats.inside;
    p = fiv__put(p, &s, sizeof s);
    p = fiv__put(p, o->state, n);
    p = fiv__put(p, o->support, FIV__SUPPORT * FIV__SUPPORT * sizeof(float));
    p = fiv__put(p, o->first, (n + 1) * sizeof(uint32_t));
    p = fiv__put(p, o->words, (size_t)s.words * sizeof(uint16_t));
    fiv__save_mesh(p, &o->mesh);
    p = (unsigned char *)memory;
    s.hash = fiv__hash(FIV__HASH, p + 16, needed - 16);
    memcpy(p, &s, sizeof s);
    return SAT_OK;
}

/* Every word of every sample is one of the `count` that there are, and stays within the mask's rows and texels. */
static int fiv__words_are_valid(const fiv_occluder *o, size_t count)
{
    size_t sample, i;
    for (sample = 0; sample < o->stats.samples; sample++) {
        int row = 0;
        if (o->first[sample] > o->first[sample + 1] || o->first[sample + 1] > count) return 0;
        if (o->state[sample] > FIV__INSIDE) return 0;
        for (i = o->first[sample]; i < o->first[sample + 1]; i++) {
            int word = o->words[i];
            row = word >> 12 == 15 ? word & 0xfff : row + (word >> 12);
            if (row >= 6 * o->face) return 0;
            if (word >> 12 != 15 && (word & 63) + (word >> 6 & 63) + 1 > o->face) return 0;
        }
    }
    return 1;
}

/* The header's fields as an occluder without memory; 0 when one is out of range or the size differs. */
static int fiv__read_header(fiv_occluder *from, fiv__save *s, const unsigned char *p, size_t size)
{
    fiv_occluder_options o = fiv_occluder_defaults();
    size_t samples;
    if (size < sizeof *s) return 0;
    memcpy(s, p, sizeof *s);
    if (s->magic != FIV__MAGIC || s->hash != fiv__hash(FIV__HASH, p + 16, size - 16)) return 0;
    o.storage = s->octahedral ? FIV_STORAGE_HALF_OCTAHEDRAL : FIV_STORAGE_FLOAT;
    o.theta = s->octahedral ? (s->theta > 0 && s->theta <= 2049 ? 2 * (s->theta - 1) : 0) : s->theta;
    o.phi = s->octahedral ? 3 : s->phi;
    o.rho = s->rho;
    o.resolution = s->face;
    o.first_shell = s->first;
    o.last_shell = s->last;
    if (!fiv__occluder_options_are_valid(&o) || !sat__is_finite(s->radius) || s->radius < 0) return 0;
    if (!sat__is_finite(s->centre[0]) || !sat__is_finite(s->centre[1]) || !sat__is_finite(s->centre[2])) return 0;
    o.sun_map = from->map_side;
    o.contact_map = from->contact_side;
    fiv__set_grid(from, &o);
    samples = fiv__grid_samples(&from->grid);
    if (s->triangles > 0x7fffffff / 3 || s->skipped > 0x7fffffff / 3 - s->triangles || s->clusters < 0) return 0;
    from->few = s->triangles + s->skipped <= FIV__FEW;
    if (s->vertices > 3 * s->triangles + 4 * (uint64_t)s->clusters) return 0;
    if ((uint64_t)s->clusters != (s->triangles + FIV__CLUSTER - 1) / FIV__CLUSTER) return 0;
    if ((s->turn != 1 && s->turn != -1) || (s->closed != 0 && s->closed != 1)) return 0;
    from->mesh.triangle_count = (size_t)s->triangles;
    from->mesh.cluster_count = (size_t)s->clusters;
    from->mesh.vertex_count = (size_t)s->vertices;
    from->mesh.closed = s->closed;
    from->mesh.turn = (float)s->turn;
    return s->phi == from->grid.phi && samples <= 0x7fffffff && s->words <= 0x7fffffff &&
           size == fiv__save_size(from, (size_t)s->words);
}

/* Clusters follow each other and hold what the header says; vertices lie in the ball, corners among the vertices. */
static int fiv__load_mesh(fiv__mesh *m, const unsigned char *p)
{
    size_t i, j, vertices = 0, triangles = 0;
    for (i = 0; i < m->cluster_count; i++) {
        fiv__cluster *c = &m->clusters[i];
        uint32_t counts[2];
        p = fiv__take(counts, p, sizeof counts);
        if (counts[0] > FIV__CLUSTER_VERTICES || counts[0] & 3 || counts[1] < 1 || counts[1] > FIV__CLUSTER) return 0;
        c->vertex = vertices;
        c->triangle = triangles;
        c->vertices = (int)counts[0];
        c->triangles = (int)counts[1];
        vertices += counts[0];
        triangles += counts[1];
    }
    if (vertices != m->vertex_count || triangles != m->triangle_count) return 0;
    for (i = 0; i < 3; i++) p = fiv__take(m->x[i], p, vertices * sizeof(float));
    for (i = 0; i < vertices; i++) {
        float x = m->x[0][i], y = m->x[1][i], z = m->x[2][i];
        if (!(x * x + y * y + z * z < 1.001f)) return 0;
    }
    fiv__take(m->corner, p, 3 * triangles);
    for (i = 0; i < m->cluster_count; i++) {
        fiv__cluster *c = &m->clusters[i];
        for (j = 0; j < 3 * (size_t)c->triangles; j++)
            if (m->corner[3 * c->triangle + j] >= c->vertices) return 0;
        fiv__bound_cluster(c, m);
    }
    return 1;
}

/* Memory for the words and the mesh of a save whose header is read. */
static sat_result fiv__allocate_loaded(fiv_occluder *o, size_t words)
{
    sat__arena arena;
    sat_result result;
    o->words_size = words ? words * sizeof(uint16_t) : 1;
    o->words_block = sat__alloc(&o->allocator, o->words_size);
    o->words = (uint16_t *)o->words_block;
    memset(&arena, 0, sizeof arena);
    fiv__mesh_layout(&o->mesh, &arena);
    if (!o->words_block) return SAT_ERR_MEMORY;
    result = sat__arena_allocate(&arena, &o->mesh_block, &o->mesh_size, &o->allocator);
    if (result != SAT_OK) return result;
    memset(o->mesh_block, 0, o->mesh_size);
    fiv__mesh_layout(&o->mesh, &arena);
    return SAT_OK;
}

FIV_DEF sat_result fiv_occluder_load(fiv_occluder **out, const void *memory, size_t size,
                                     const fiv_occluder_options *options)
{
    fiv_occluder_options options_used = options ? *options : fiv_occluder_defaults();
    fiv_occluder from, *o = NULL;
    fiv__save s;
    const unsigned char *p = (const unsigned char *)memory;
    sat_result result;
    size_t n;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    memset(&from, 0, sizeof from);
    if (!p || !fiv__occluder_options_are_valid(&options_used)) return SAT_ERR_ARGUMENT;
    if (!sat__resolve_allocator(&from.allocator, &options_used.allocator)) return SAT_ERR_ARGUMENT;
    from.threads = options_used.threads;
    from.map_side = options_used.sun_map;
    from.contact_side = options_used.contact_map;
    if (!fiv__read_header(&from, &s, p, size)) return SAT_ERR_DATA;
    result = fiv__allocate_occluder(&o, &from);
    if (result) return result;
    n = o->stats.samples;
    result = fiv__allocate_loaded(o, (size_t)s.words);
    if (result) {
        fiv_occluder_destroy(o);
        return result;
    }
    memcpy(o->centre, s.centre, sizeof s.centre);
    memcpy(o->stats.centre, s.centre, sizeof s.centre);
    o->radius = o->stats.radius = s.radius;
    o->stats.closed = s.closed;
    o->stats.triangles = (size_t)s.triangles;
    o->stats.skipped_triangles = (size_t)s.skipped;
    o->stats.rasterised = (size_t)s.rasterised;
    o->stats.inside = (size_t)s.inside;
    o->stats.spans = (size_t)s.words;
    p = fiv__take(o->state, p + sizeof s, n);
    p = fiv__take(o->support, p, FIV__SUPPORT * FIV__SUPPORT * sizeof(float));
    p = fiv__take(o->first, p, (n + 1) * sizeof(uint32_t));
    p = fiv__take(o->words, p, (size_t)s.words * sizeof(uint16_t));
    if (o->first[0] != 0 || o->first[n] != s.words || !fiv__words_are_valid(o, (size_t)s.words) ||
        !fiv__load_mesh(&o->mesh, p)) {
        fiv_occluder_destroy(o);
        return SAT_ERR_DATA;
    }
    fiv__draw_contact(o);
    fiv__count_bytes(o);
    *out = o;
    return SAT_OK;
}

#endif /* FIV_NO_MASKS */

#ifdef __cplusplus
}
#endif
SAT__IEEE_END
#endif /* FIV_IMPLEMENTATION */

/* ------------------------------------------------------------------------------------------------
   >> shaders
   OpenGL
   ------------------------------------------------------------------------------------------------ */

#if defined(FIV_IMPLEMENTATION) && defined(FIV_GL) && !defined(FIV__GL_IMPLEMENTED)
#define FIV__GL_IMPLEMENTED

#ifndef SAT_SIBLING_GL
#define SAT_SIBLING_GL
#endif
#include "sat.h"

SAT__IEEE_BEGIN
#ifdef __cplusplus
extern "C" {
#endif

/* fiv_shells: half floats that the hardware filters; a layer a shell, samples inside the mesh 0. Three fields of it
   above each other: vector 0..3; 4..7; 8, solid angle, 1 where valid, 1 where inside. Columns are azimuths, the first
   once more at the end. fiv_support: the support function, a field an occluder. fiv_maps: depth maps of the lights,
   four occluders side by side. fiv_scene: a row an instance, see fiv__gl_row and fiv__gl_light; two texels a light in
   the row behind them. fiv_diffuse: I_tot at the corners of the cube. fiv_views: the depth maps of the views, a layer
   an occluder; fiv_view_light: the light around each, three rows an occluder, the solid angle in the first's alpha, and
   a fourth with the corners of few triangles. */
static const char fiv__glsl_cube[] =
    "#ifndef FIV_GLSL\n"
    "#define FIV_GLSL\n"
    SAT__GLSL(
        uniform highp sampler2DArray fiv_shells;
        uniform highp sampler2D fiv_support, fiv_scene, fiv_diffuse;
        uniform highp usampler2DArray fiv_views;
        uniform highp sampler2D fiv_view_light;
        uniform highp usampler2D fiv_maps;
        uniform ivec4 fiv_counts; /* instances, lights, columns of a depth map's field, face */
        uniform vec3 fiv_x, fiv_y, fiv_z; /* columns of the environment's rotation */
        vec4 fiv_row(int instance, int texel) { return texelFetch(fiv_scene, ivec2(texel, instance), 0); })
    SAT__GLSL(
        vec3 fiv_corner(int face, int x, int y) {
            return texelFetch(fiv_diffuse, ivec2(x, face * (fiv_counts.w + 1) + y), 0).rgb;
        })
    SAT__GLSL(
        vec3 fiv_total(vec3 normal) {
            vec3 d = vec3(dot(fiv_x, normal), dot(fiv_y, normal), dot(fiv_z, normal)), a = abs(d);
            int k = a.x >= a.y ? (a.x >= a.z ? 0 : 2) : (a.y >= a.z ? 1 : 2);
            bool back = d[k] < 0.0;
            vec2 p = k == 0 ? d.yz : k == 1 ? d.zx : d.xy;
            p = ((back ? p.yx : p) / a[k] + 1.0) * 0.5 * float(fiv_counts.w);
            ivec2 i = clamp(ivec2(p), 0, fiv_counts.w - 1);
            int face = 2 * k + (back ? 1 : 0);
            p -= vec2(i);
            return mix(mix(fiv_corner(face, i.x, i.y), fiv_corner(face, i.x + 1, i.y), p.x),
                       mix(fiv_corner(face, i.x, i.y + 1), fiv_corner(face, i.x + 1, i.y + 1), p.x), p.y);
        })
    SAT__GLSL(
        vec2 fiv_square(vec3 d) {
            vec2 p = d.xz / (abs(d.x) + abs(d.y) + abs(d.z));
            vec2 folded = (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
            return d.y < 0.0 ? folded : p;
        })
    SAT__GLSL(
        float fiv_reach(float slot, vec3 d) {
            vec2 p = (fiv_square(d) + 1.0) * 16.0 + 0.5;
            return textureLod(fiv_support, (p + vec2(0.0, 33.0 * slot)) / vec2(textureSize(fiv_support, 0)), 0.0).r;
        });

/* The cell around an offset, as fiv__locate has it, and the sums over its eight samples. */
static const char fiv__glsl_cell[] =
    SAT__GLSL(
        struct fiv_cell {
            vec3 at; /* column, row, layer of the inner four samples */
            float rows, r, part;
            vec2 shell;
        };)
    SAT__GLSL(
        struct fiv_sum { mat3 v; float angle, total, inside; };
        vec3 fiv_own(int instance, vec3 v) {
            return fiv_row(instance, 1).xyz * v.x + fiv_row(instance, 2).xyz * v.y + fiv_row(instance, 3).xyz * v.z;
        })
    SAT__GLSL(
        fiv_cell fiv_locate(int instance, vec3 d) {
            vec4 grid = fiv_row(instance, 4), shells = fiv_row(instance, 5);
            bool octahedral = fiv_row(instance, 2).w > 0.5;
            fiv_cell c;
            c.rows = grid.y;
            c.r = max(length(d), shells.x);
            float f = clamp((log2(c.r) - grid.w) * shells.y, 0.0, grid.z - 1.0), k = min(floor(f), grid.z - 2.0);
            vec2 p = octahedral ? (fiv_square(d) + 1.0) * 0.5 * (grid.xy - 1.0)
                : vec2(atan(d.z, d.x == 0.0 && d.z == 0.0 ? 1.0 : d.x) * 0.159154943 * grid.x,
                       atan(length(d.xz), d == vec3(0.0) ? 1.0 : d.y) * 0.318309886 * (grid.y - 1.0));
            if (p.x < 0.0) p.x += grid.x;
            c.at = vec3(p, fiv_row(instance, 1).w + k);
            c.part = f - k;
            c.shell = exp2(grid.w + (k + vec2(0.0, 1.0)) / shells.y);
            return c;
        })
    SAT__GLSL(
        vec4 fiv_shell(fiv_cell c, float field, float shell) {
            vec2 p = (c.at.xy + vec2(0.5, 0.5 + field * c.rows)) / vec2(textureSize(fiv_shells, 0).xy);
            return textureLod(fiv_shells, vec3(p, c.at.z + shell), 0.0);
        })
    SAT__GLSL(
        fiv_sum fiv_gather(int instance, fiv_cell c, vec2 scale) {
            vec4 e = fiv_shell(c, 2.0, 0.0), f = fiv_shell(c, 2.0, 1.0);
            float unit = fiv_row(instance, 5).z;
            scale *= vec2(1.0 - c.part, c.part);
            vec4 a = scale.x * fiv_shell(c, 0.0, 0.0) + scale.y * fiv_shell(c, 0.0, 1.0);
            vec4 b = scale.x * fiv_shell(c, 1.0, 0.0) + scale.y * fiv_shell(c, 1.0, 1.0);
            vec2 g = scale.x * e.xy + scale.y * f.xy, h = mix(e.zw, f.zw, c.part);
            return fiv_sum(unit * mat3(a.xyz, vec3(a.w, b.xy), vec3(b.zw, g.x)), g.y, h.x, h.y);
        });

/* What the views say, as fiv__look_around has it: p the receiver, n its normal, in the occluder's frame and then in the
   views'; the part of `open` that is taken, and the solid angle. */
static const char fiv__glsl_views[] =
    SAT__GLSL(
        bool fiv_hit(ivec3 p, float beyond) { return float(texelFetch(fiv_views, p, 0).r) > beyond; }
        float fiv_view(vec2 at, float side, ivec3 corner, float beyond) {
            at = clamp(at, 0.0, side - 1.0);
            ivec2 i = min(ivec2(at), int(side) - 2);
            vec2 f = at - vec2(i);
            ivec3 p = corner + ivec3(i, 0);
            vec2 low = vec2(fiv_hit(p, beyond), fiv_hit(p + ivec3(1, 0, 0), beyond));
            vec2 high = vec2(fiv_hit(p + ivec3(0, 1, 0), beyond), fiv_hit(p + ivec3(1, 1, 0), beyond));
            low = mix(low, high, f.y);
            return mix(low.x, low.y, f.x);
        })
    SAT__GLSL(
        void fiv_trace(int instance, vec3 p, inout uint hit[12]) {
            int row = 4 * int(fiv_row(instance, 3).w) + 3, count = int(fiv_row(instance, 9).w);
            float closed = fiv_row(instance, 10).w;
            for (int i = 0; i < count; i++) {
                vec3 a = texelFetch(fiv_view_light, ivec2(3 * i, row), 0).xyz - p;
                vec3 b = texelFetch(fiv_view_light, ivec2(3 * i + 1, row), 0).xyz - p;
                vec3 c = texelFetch(fiv_view_light, ivec2(3 * i + 2, row), 0).xyz - p;
                float turn = sign(dot(cross(a, b), c));
                if (turn == 0.0 || closed * turn < 0.0) continue;
                mat3 sides = turn * mat3(cross(a, b), cross(b, c), cross(c, a));
                for (int j = 0; j < 384; j++) {
                    int face = j >> 6;
                    vec3 d = vec3((2.0 * vec2(j & 7, j >> 3 & 7) + 1.0) / 8.0 - 1.0, 1.0);
                    if ((face & 1) != 0) d = vec3(d.yx, -1.0);
                    d = face < 2 ? d.zxy : face < 4 ? d.yzx : d;
                    if (all(greaterThanEqual(d * sides, vec3(0.0)))) hit[j >> 5] |= 1u << (j & 31);
                }
            }
        })
    SAT__GLSL(
        vec4 fiv_around(int instance, vec3 p, vec3 n, vec3 open) {
            int slot = int(fiv_row(instance, 3).w);
            bool few = fiv_row(instance, 9).w >= 0.0;
            uint hit[12];
            for (int k = 0; k < 12; k++) hit[k] = 0u;
            float side = fiv_row(instance, 8).w, angle = 0.0;
            vec3 all = vec3(0.0), taken = vec3(0.0);
            mat3 turn = mat3(fiv_row(instance, 9).xyz, fiv_row(instance, 10).xyz, fiv_row(instance, 11).xyz);
            p = turn * p;
            n = turn * n;
            if (few) fiv_trace(instance, p - 1e-4 * n, hit);
            for (int face = 0; face < 6; face++) {
                bool back = (face & 1) != 0;
                vec3 q = face < 2 ? p.yzx : face < 4 ? p.zxy : p, m = face < 2 ? n.yzx : face < 4 ? n.zxy : n;
                if (back) q = vec3(q.yx, -q.z);
                if (back) m = vec3(m.yx, -m.z);
                float beyond = max(1.0 + (q.z + 0.5 / (side - 2.0) + 1.0) * 127.0, 0.0);
                for (int y = 0; y < 8; y++) for (int x = 0; x < 8; x++) {
                    vec2 t = (2.0 * vec2(x, y) + 1.0) / 8.0 - 1.0;
                    if (!(m.z + dot(m.xy, t) > 0.0)) continue;
                    ivec2 view = ivec2(x, face * 8 + y), light = ivec2(view.y * 8 + x, 4 * slot);
                    vec2 at = (q.xy - q.z * t) * (0.5 * (side - 2.0)) / sqrt(1.0 + t * t) + 0.5 * (side - 1.0);
                    float covered = few ? float(hit[light.x >> 5] >> (light.x & 31) & 1u)
                        : fiv_view(at, side, ivec3(view * int(side), slot), beyond);
                    vec4 red = texelFetch(fiv_view_light, light, 0);
                    vec3 green = texelFetch(fiv_view_light, light + ivec2(0, 1), 0).rgb;
                    vec3 blue = texelFetch(fiv_view_light, light + ivec2(0, 2), 0).rgb;
                    vec3 e = max(vec3(dot(red.rgb, n), dot(green, n), dot(blue, n)), 0.0);
                    all += e;
                    taken += e * covered;
                    angle += red.a * covered;
                }
            }
            for (int k = 0; k < 3; k++) taken[k] = all[k] > 0.0 ? open[k] * (taken[k] / all[k]) : 0.0;
            return vec4(taken, angle);
        });

/* What one occluder takes, and its solid angle in w; what is left of the light on its own surface (eq 13). */
static const char fiv__glsl_occluder[] =
    SAT__GLSL(
        float fiv_cap(float c, float h) {
            float s = 1.0 - h * h;
            if (c * c >= s) return max(c, 0.0);
            float w = sqrt(1.0 - c * c), x = h / sqrt(s), y = clamp(-x * c / w, -1.0, 1.0), q = sqrt(1.0 - y * y);
            return ((c * acos(y) - x * w * q) * s + atan(w * q / x)) / (3.14159265 * s);
        })
    SAT__GLSL(
        vec3 fiv_shade(mat3 v, float angle, vec3 n, float cut) {
            vec3 along = n * v;
            float h = clamp(1.0 - angle * 0.159154943, 0.01, 0.999999);
            for (int k = 0; k < 3; k++) {
                float size = length(v[k]);
                if (cut > 0.0 && size > 0.0) along[k] = mix(along[k], size * fiv_cap(along[k] / size, h),
                    min(4.0 * cut, 1.0));
            }
            return max(along, 0.0);
        })
    SAT__GLSL(
        vec4 fiv_occluder(int instance, vec3 d, vec3 n, float cut, vec3 open) {
            fiv_cell c = fiv_locate(instance, d);
            fiv_sum s = fiv_gather(instance, c, vec2(1.0));
            vec4 taken = s.inside > 0.5 ? vec4(open, 0.0) : vec4(0.0);
            float part = s.inside > 0.5 ? 1.0 : 0.0;
            if (s.total > 1e-3) {
                float scale = 1.0 / (s.total * c.r * c.r);
                taken = vec4(fiv_shade(s.v * scale, s.angle * scale, n, cut), s.angle * scale);
                part = clamp(max(2.0 * taken.w - 3.0, 8.0 * s.inside), 0.0, 1.0);
            }
            if (part > 0.0 && fiv_row(instance, 8).w > 0.0) taken = mix(taken, fiv_around(instance, -d, n, open), part);
            return vec4(min(taken.rgb, open), taken.w);
        })
#ifndef FIV_NO_SELF
    SAT__GLSL(
        vec3 fiv_self(int self, vec3 d, vec3 n, vec3 all) {
            fiv_cell c;
            float out_by = 0.0, side = fiv_row(self, 8).w;
            if (side > 0.0) return max(all - fiv_around(self, fiv_row(self, 11).w * n - d, n, all).rgb, 0.0);
            for (int k = 0; k < 6; k++) {
                c = fiv_locate(self, d - out_by * n);
                if (mix(fiv_shell(c, 2.0, 0.0).z, fiv_shell(c, 2.0, 1.0).z, c.part) > 0.25) break;
                out_by = max(2.0 * out_by, 0.05);
            }
            fiv_sum s = fiv_gather(self, c, 1.0 / (c.shell * c.shell));
            if (!(s.total > 1e-3)) return vec3(0.0);
            mat3 open = mat3(fiv_row(self, 6).xyz, fiv_row(self, 7).xyz, fiv_row(self, 8).xyz) - s.v / s.total;
            return fiv_shade(open, 12.5663706 - s.angle / s.total, n, 1.0);
        })
#endif
    ;

#ifndef FIV_NO_DELTA
/* Split-off lights, as fiv__cover_light has them without rays. */
static const char fiv__glsl_lights[] =
    SAT__GLSL(
        struct fiv_seen { ivec2 cell; int side; vec2 at; float z, scale; };
        float fiv_beyond(fiv_seen s, ivec2 p) {
            if (p.x < 0 || p.y < 0 || p.x >= s.side || p.y >= s.side) return -1.0;
            int word = int(texelFetch(fiv_maps, s.cell + p, 0).r);
            return word > 0 ? float(word - 1) / 32767.0 - 1.0 - s.z : -1.0;
        })
    SAT__GLSL(
        float fiv_compare(fiv_seen s, vec2 at) {
            ivec2 i = ivec2(floor(at));
            vec2 f = at - vec2(i);
            float least = 0.25 / s.scale;
            vec2 low = vec2(fiv_beyond(s, i) > least, fiv_beyond(s, i + ivec2(1, 0)) > least);
            vec2 high = vec2(fiv_beyond(s, i + ivec2(0, 1)) > least, fiv_beyond(s, i + ivec2(1, 1)) > least);
            low = mix(low, high, f.y);
            return mix(low.x, low.y, f.x);
        })
    SAT__GLSL(
        vec2 fiv_disc(fiv_seen s, float radius, bool search) {
            int n = clamp(int((search ? 0.35 : 0.75) * radius) + 3, 4, 12);
            float covered = 0.0, count = 0.0, sum = 0.0;
            for (int j = 0; j < n; j++) for (int i = 0; i < n; i++) {
                vec2 u = (vec2(i, j) + 0.5) * (2.0 / float(n)) - 1.0, at = s.at + radius * u;
                if (dot(u, u) > 1.0) continue;
                count++;
                if (search) {
                    float beyond = fiv_beyond(s, ivec2(floor(at + 0.5)));
                    if (beyond > 0.25 / s.scale) { sum += beyond; covered++; }
                } else covered += fiv_compare(s, at);
            }
            return vec2(covered / count, covered > 0.0 ? sum / covered : 0.0);
        })
    SAT__GLSL(
        float fiv_cover(int instance, int light, vec3 d, float tangent) {
            fiv_seen s;
            int slot = int(fiv_row(instance, 3).w), cells = int(fiv_row(instance, 7).w), side = fiv_counts.z;
            s.side = int(fiv_row(instance, 6).w);
            s.z = -dot(d, fiv_row(instance, 16 + 3 * light + 2).xyz);
            if (s.z >= 1.0) return 0.0;
            s.scale = fiv_row(instance, 5).w;
            s.cell = ivec2(slot & 3, slot >> 2) * side + ivec2(light % cells, light / cells) * s.side;
            float shift = 0.5 * float(s.side) - 0.5, reach = tangent * (1.0 - s.z) * s.scale;
            s.at = shift - s.scale * vec2(dot(d, fiv_row(instance, 16 + 3 * light).xyz),
                dot(d, fiv_row(instance, 17 + 3 * light).xyz));
            if (any(greaterThanEqual(abs(s.at - shift), vec2(s.scale + reach + 2.0)))) return 0.0;
            if (reach > 1.0) {
                vec2 found = fiv_disc(s, reach, true);
                if (found.x == 0.0 || found.x == 1.0) return found.x;
                reach = tangent * found.y * s.scale;
                if (reach > 1.0) return fiv_disc(s, reach, false).x;
            }
            return fiv_compare(s, s.at);
        });
#endif

static const char fiv__glsl_receiver[] =
    SAT__GLSL(
        float fiv_lens(float r, float s, float d) {
            if (d >= r + s) return 0.0;
            if (d <= abs(r - s)) return 3.14159265 * min(r, s) * min(r, s);
            float a = acos(clamp((d * d + r * r - s * s) / (2.0 * d * r), -1.0, 1.0));
            float b = acos(clamp((d * d + s * s - r * r) / (2.0 * d * s), -1.0, 1.0));
            return r * r * (a - 0.5 * sin(2.0 * a)) + s * s * (b - 0.5 * sin(2.0 * b));
        })
    SAT__GLSL(
        bool fiv_place(int instance, vec3 point, out vec3 world) {
            vec4 place = fiv_row(instance, 0);
            world = (place.xyz - point) * place.w;
            return place.w > 0.0 && length(world) < 1e9;
        })
    SAT__GLSL(
        vec3 fiv_receive(int self, vec3 point, vec3 normal) {
            if (!(dot(normal, normal) > 0.0)) return vec3(0.0);
            normal = normalize(normal);
            vec3 open = fiv_total(normal), sum = vec3(0.0), shared_sum = vec3(0.0), largest = vec3(0.0), world;
            vec4 discs[FIV_INSTANCES];
            vec3 takes[FIV_INSTANCES];
            int count = 0;
            for (int i = 0; i < FIV_INSTANCES; i++) {
                if (i >= fiv_counts.x) break;
                if (i == self || !fiv_place(i, point, world)) continue;
                vec3 n = fiv_own(i, normal);
                float height = dot(world, normal), cut = 0.0;
                if (height <= -1.0) continue;
                if (height < 1.0) {
                    float slot = fiv_row(i, 3).w, below = fiv_reach(slot, -n), above = fiv_reach(slot, n);
                    if (height <= -above) continue;
                    if (height < below - 1e-4) cut = (below - height) / (below + above);
                }
                vec4 taken = fiv_occluder(i, fiv_own(i, world), n, cut, open);
                vec3 own = taken.rgb;
                discs[count] = vec4(world / max(length(world), 1e-30), sqrt(taken.w * 0.318309886));
                takes[count] = own;
                sum += own;
                largest = max(largest, own);
                for (int j = 0; j < count; j++) {
                    float area = fiv_lens(discs[j].w, discs[count].w, length(discs[j].xyz - discs[count].xyz)),
                        less = min(discs[j].w, discs[count].w);
                    if (area > 0.0) shared_sum += area / (3.14159265 * less * less) * min(takes[j], own);
                }
                count++;
            }
            vec3 result = clamp(open - max(sum - shared_sum, largest), vec3(0.0), open);)
#ifndef FIV_NO_SELF
    SAT__GLSL(
            if (self >= 0 && self < fiv_counts.x && fiv_place(self, point, world))
                result *= min(fiv_self(self, fiv_own(self, world), fiv_own(self, normal), open) / max(open, 1e-30),
                    1.0);)
#endif
#ifndef FIV_NO_DELTA
    SAT__GLSL(
            for (int k = 0; k < fiv_counts.y; k++) {
                vec4 direction = fiv_row(FIV_INSTANCES, 2 * k);
                float cosine = dot(normal, direction.xyz), cover = 0.0;
                for (int i = 0; i < FIV_INSTANCES && cosine > 0.0; i++) {
                    if (i >= fiv_counts.x) break;
                    if (!fiv_place(i, point, world) || (i != self && dot(world, normal) <= -1.0)) continue;
                    if (i == self) world -= normal * (2.0 / fiv_row(i, 5).w);
                    cover = max(cover, fiv_cover(i, k, fiv_own(i, world), direction.w));
                }
                result += fiv_row(FIV_INSTANCES, 2 * k + 1).rgb * max(cosine, 0.0) * (1.0 - cover);
            })
#endif
    SAT__GLSL(
            return result;
        })
    SAT__GLSL(vec3 fiv_irradiance(vec3 point, vec3 normal) { return fiv_receive(-1, point, normal); })
#ifndef FIV_NO_SELF
    SAT__GLSL(vec3 fiv_self_irradiance(int self, vec3 point, vec3 normal) { return fiv_receive(self, point, normal); })
#endif
    "#endif\n";

static const char *const fiv__glsl[] = {fiv__glsl_cube, fiv__glsl_cell, fiv__glsl_views, fiv__glsl_occluder,
#ifndef FIV_NO_DELTA
                                        fiv__glsl_lights,
#endif
                                        fiv__glsl_receiver, NULL};

FIV_DEF const char *const *fiv_gl_glsl(void) { return fiv__glsl; }

static const char fiv__glsl_main[] =
    SAT__GLSL(
        uniform highp sampler2D fiv_points, fiv_normals;
        uniform vec4 fiv_world[4];
        uniform vec3 fiv_turn[3], fiv_depth; /* fiv_depth: 2 / size; 0 points, 1 depth in [-1,1], 2 in [0,1] */
        out vec4 value;
        void main() {
            ivec2 p = sat_pixel();
            vec4 point = texelFetch(fiv_points, p + sat_from, 0), normal = texelFetch(fiv_normals, p + sat_from, 0);
            float on = point.w;
            if (fiv_depth.z > 0.5) {
                vec3 clip = vec3((vec2(p) + 0.5) * fiv_depth.xy - 1.0,
                    fiv_depth.z > 1.5 ? point.x : 2.0 * point.x - 1.0);
                point = fiv_world[0] * clip.x + fiv_world[1] * clip.y + fiv_world[2] * clip.z + fiv_world[3];
                point.xyz /= point.w;
                on = normal.w;
                normal.xyz = fiv_turn[0] * normal.x + fiv_turn[1] * normal.y + fiv_turn[2] * normal.z;
            }
            int self = FIV_SELF != 0 && on >= 2.0 && on < 66.0 ? int(on) - 2 : -1;
            value = vec4(fiv_receive(self, point.xyz, normal.xyz), 1.0);
        });

/* >> opengl   ---- objects, scenes, passes */

enum {
    FIV__GL_UNITS = 9,
    FIV__GL_INSTANCES = 64,
    FIV__GL_STAGED = 16384, /* texels on their way at a time: wider than any row of samples */
    FIV__SCENE_WIDTH = 16 + 3 * FIV_MAX_LIGHTS
};

/* What textures have room for. */
typedef struct fiv__gl_room {
    int columns, rows, layers; /* of fiv_shells */
    int map_side, face;
    int view_side, kinds; /* of fiv_views */
} fiv__gl_room;

struct fiv_gl {
    sat__gl gl;
    sat_allocator allocator;
    int width, height, max_instances, self;
    float penumbra;
    int count, lights, kinds; /* what the scene holds: instances, split-off lights, different occluders */
    int kind[FIV__GL_INSTANCES];                              /* of each instance */
    const fiv_occluder *occluders[FIV__GL_INSTANCES];         /* of each kind */
    int layer[FIV__GL_INSTANCES];                             /* where its shells begin */
    uint64_t signature[FIV__GL_INSTANCES], light_signature;   /* of what the textures hold; 0: nothing */
    size_t uploads, view_uploads;                             /* occluders and their views sent so far */
    fiv__gl_room room;
    float rotation[9];
    uint64_t view_signature[FIV__GL_INSTANCES];               /* of its views, which no light enters */
    unsigned program, target, out, shells, support, maps, scene, diffuse, views, view_light;
    float rows[FIV__GL_INSTANCES + 1][FIV__SCENE_WIDTH][4];   /* fiv_scene */
    float staged[FIV__GL_STAGED][4];
};

static const sat__field fiv__gl_fields[] = {
    SAT__FIELD(fiv_gl_options, 'i', max_instances, 8, 1, 64, ' '),
    SAT__FIELD(fiv_gl_options, 'i', self, 0, 0, 1, ' '),
    SAT__FIELD(fiv_gl_options, 'f', penumbra, 1, 0, 100, ' '),
    SAT__FIELD(fiv_gl_options, 'a', allocator, 0, 0, 0, ' '),
};

FIV_DEF fiv_gl_options fiv_gl_defaults(void)
{
    fiv_gl_options o;
    sat__fields_default(&o, sizeof o, fiv__gl_fields, SAT__COUNT(fiv__gl_fields));
    return o;
}

FIV_DEF const char *fiv_explain_gl(char *text, size_t size, int width, int height, const fiv_gl_options *options)
{
    sat__text t = sat__text_begin(text, size);
    const sat__field *wrong = options ? sat__fields_check(options, fiv__gl_fields, SAT__COUNT(fiv__gl_fields)) : NULL;
    if (width < 1 || width > 16384) sat__text_range(&t, "width", width, 1, 16384, ' ');
    else if (height < 1 || height > 16384) sat__text_range(&t, "height", height, 1, 16384, ' ');
    else if (wrong) sat__text_field(&t, wrong, options);
#ifdef FIV_NO_SELF
    else if (options && options->self) sat__text_add(&t, "self is 1; 0 with FIV_NO_SELF");
#endif
    return t.size ? text : "";
}

FIV_DEF const char *fiv_gl_message(const fiv_gl *g) { return g ? g->gl.message : "no object"; }
FIV_DEF unsigned fiv_gl_texture(const fiv_gl *g) { return g ? g->out : 0; }

FIV_DEF void fiv_gl_destroy(fiv_gl *g)
{
    sat_allocator allocator;
    if (!g) return;
    if (g->out || g->program) {
        unsigned textures[8];
        textures[0] = g->out;
        textures[1] = g->shells;
        textures[2] = g->support;
        textures[3] = g->maps;
        textures[4] = g->scene;
        textures[5] = g->diffuse;
        textures[6] = g->views;
        textures[7] = g->view_light;
        if (g->target) g->gl.DeleteFramebuffers(1, &g->target);
        if (g->program) g->gl.DeleteProgram(g->program);
        g->gl.DeleteTextures(8, textures);
    }
    sat__gl_close(&g->gl);
    allocator = g->allocator;
    sat__release(&allocator, g, sizeof *g);
}

static void fiv__gl_filter(sat__gl *gl, unsigned kind)
{
    gl->TexParameteri(kind, SAT__GL_TEXTURE_MIN_FILTER, SAT__GL_LINEAR);
    gl->TexParameteri(kind, SAT__GL_TEXTURE_MAG_FILTER, SAT__GL_LINEAR);
    gl->TexParameteri(kind, SAT__GL_TEXTURE_WRAP_S, SAT__GL_CLAMP_TO_EDGE);
    gl->TexParameteri(kind, SAT__GL_TEXTURE_WRAP_T, SAT__GL_CLAMP_TO_EDGE);
    gl->TexParameteri(kind, SAT__GL_TEXTURE_MAX_LEVEL, 0);
}

/* The units are those of fiv__gl_uniforms. */
static const sat__gl_program fiv__gl_receivers = {
    "fiv: receivers",
    0,
    "fiv_support fiv_scene fiv_diffuse fiv_maps fiv_shells fiv_view_light fiv_views fiv_points fiv_normals",
    NULL,
    NULL,
    {SAT__GL_FROM SAT__GL_PIXEL, fiv__glsl_main, NULL, NULL, NULL, NULL, NULL, NULL}};

static sat_result fiv__gl_start(fiv_gl *g, sat_gl_get_proc *get_proc)
{
    sat__gl *gl = &g->gl;
    sat__gl_state state;
    sat_result r = sat__gl_open(gl, get_proc);
    if (r) return r;
    sat__gl_begin(gl, &state, 1);
    sat__gl_define(gl, "FIV_INSTANCES", g->max_instances);
    sat__gl_define(gl, "FIV_SELF", g->self);
    r = sat__gl_build_table(gl, &g->program, &fiv__gl_receivers, 1, 0, fiv__glsl);
    if (!r) r = sat__gl_texture(gl, &g->out, SAT__GL_RGBA32F, g->width, g->height, NULL);
    if (!r) r = sat__gl_framebuffer(gl, &g->target, &g->out, 1, 0);
    if (!r) r = sat__gl_texture(gl, &g->scene, SAT__GL_RGBA32F, FIV__SCENE_WIDTH, g->max_instances + 1, NULL);
    if (!r) r = sat__gl_texture(gl, &g->support, SAT__GL_R16F, FIV__SUPPORT, FIV__SUPPORT * g->max_instances, NULL);
    if (!r) fiv__gl_filter(gl, SAT__GL_TEXTURE_2D);
    if (!r) r = sat__gl_texture(gl, &g->view_light, SAT__GL_RGBA32F, FIV__ALL_VIEWS, 4 * g->max_instances, NULL);
    sat__gl_end(gl, &state);
    return r;
}

FIV_DEF sat_result fiv_gl_create(fiv_gl **out, sat_gl_get_proc *get_proc, int width, int height,
                                 const fiv_gl_options *options)
{
    fiv_gl_options o = options ? *options : fiv_gl_defaults();
    sat_allocator allocator;
    fiv_gl *g;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    if (!sat__resolve_allocator(&allocator, &o.allocator)) return SAT_ERR_ARGUMENT;
    g = (fiv_gl *)sat__alloc(&allocator, sizeof *g);
    if (!g) return SAT_ERR_MEMORY;
    memset(g, 0, sizeof *g);
    g->allocator = allocator;
    *out = g;
    if (*fiv_explain_gl(g->gl.message, sizeof g->gl.message, width, height, &o)) return SAT_ERR_ARGUMENT;
    if (!get_proc) return sat__gl_fail(&g->gl, SAT_ERR_ARGUMENT, "get_proc is NULL", NULL);
    g->width = width;
    g->height = height;
    g->max_instances = o.max_instances;
    g->self = o.self != 0;
    g->penumbra = o.penumbra;
    return fiv__gl_start(g, get_proc);
}

FIV_DEF sat_result fiv_gl_set_options(fiv_gl *g, const fiv_gl_options *options)
{
    fiv_gl_options o = options ? *options : fiv_gl_defaults();
    if (!g || !g->scene) return SAT_ERR_ARGUMENT;
    if (*fiv_explain_gl(g->gl.message, sizeof g->gl.message, g->width, g->height, &o)) return SAT_ERR_ARGUMENT;
    if (o.max_instances != g->max_instances || (o.self != 0) != g->self) return SAT_ERR_MISMATCH;
    g->penumbra = o.penumbra;
    return SAT_OK;
}

/* The four components of a field of fiv_shells; all samples that are not valid are 0. */
static void fiv__gl_sample(float out[4], const fiv_occluder *o, size_t sample, int field, float scale)
{
    float v[FIV__TERMS + 2], angle = fiv__sample_angle(o, sample);
    int k;
    memset(v, 0, sizeof v);
    if (angle >= 0) {
        fiv__add_sample(v, 1, o, sample);
        for (k = 0; k < 9; k++) v[k] *= scale;
        v[10] = 1;
    }
    v[11] = o->state[sample] == FIV__INSIDE;
    memcpy(out, v + 4 * field, 4 * sizeof *out);
}

/* What the shader multiplies vectors by, whose stored halves fit. */
static float fiv__gl_unit(const fiv_occluder *o)
{
    return o->half_floats ? 1 / o->table_scale : 1 / fiv__half_scale(o->environment);
}

static void fiv__gl_send_shells(fiv_gl *g, const fiv_occluder *o, int layer)
{
    const fiv__grid *grid = &o->grid;
    int columns = grid->theta + 1, at_once = FIV__GL_STAGED / columns, rows = 3 * grid->phi, shell, row, i, x;
    float scale = 1 / (o->table_scale * fiv__gl_unit(o));
    g->gl.ActiveTexture(SAT__GL_TEXTURE0);
    g->gl.BindTexture(SAT__GL_TEXTURE_2D_ARRAY, g->shells);
    SAT_ASSERT(grid->theta > 0);
    for (shell = 0; shell < grid->rho; shell++)
        for (row = 0; row < rows; row += at_once) {
            int n = sat__min_int(at_once, rows - row);
            for (i = 0; i < n; i++) {
                int field = (row + i) / grid->phi, y = (row + i) % grid->phi;
                size_t first = ((size_t)shell * (size_t)grid->phi + (size_t)y) * (size_t)grid->theta;
                for (x = 0; x < columns; x++)
                    fiv__gl_sample(g->staged[i * columns + x], o, first + (size_t)(x % grid->theta), field, scale);
            }
            g->gl.TexSubImage3D(SAT__GL_TEXTURE_2D_ARRAY, 0, 0, row, layer + shell, columns, n, 1, SAT__GL_RGBA,
                                SAT__GL_FLOAT, g->staged);
        }
}

static void fiv__gl_send_corners(fiv_gl *g, const fiv_occluder *o, int kind)
{
    float corners[FIV__FEW][3][3];
    int n = 3 * fiv__few_corners(corners, o), i;
    for (i = 0; i < n; i++) memcpy(g->staged[i], corners[i / 3][i % 3], sizeof corners[0][0]);
    g->gl.BindTexture(SAT__GL_TEXTURE_2D, g->view_light);
    if (n)
        g->gl.TexSubImage2D(SAT__GL_TEXTURE_2D, 0, 0, 4 * kind + 3, n, 1, SAT__GL_RGBA, SAT__GL_FLOAT, g->staged);
}

/* The depth maps of the views, or the triangles in place of them, once; the light around the views. */
static void fiv__gl_send_views(fiv_gl *g, const fiv_occluder *o, int kind)
{
    int width = FIV__VIEWS * o->contact_side, c, view;
    if (!o->contact_side) return;
    if (g->view_signature[kind] != o->view_signature) {
        if (o->few) fiv__gl_send_corners(g, o, kind);
        else {
            g->gl.BindTexture(SAT__GL_TEXTURE_2D_ARRAY, g->views);
            g->gl.TexSubImage3D(SAT__GL_TEXTURE_2D_ARRAY, 0, 0, 0, kind, width, 6 * width, 1, SAT__GL_RED_INTEGER,
                                SAT__GL_UNSIGNED_BYTE, o->contact);
        }
        g->view_uploads++;
    }
    g->view_signature[kind] = o->view_signature;
    g->gl.BindTexture(SAT__GL_TEXTURE_2D, g->view_light);
    for (c = 0; c < 3; c++) {
        for (view = 0; view < FIV__ALL_VIEWS; view++) {
            const float *v = o->contact_light + view;
            g->staged[view][0] = v[3 * c * FIV__ALL_VIEWS];
            g->staged[view][1] = v[(3 * c + 1) * FIV__ALL_VIEWS];
            g->staged[view][2] = v[(3 * c + 2) * FIV__ALL_VIEWS];
            g->staged[view][3] = v[9 * FIV__ALL_VIEWS];
        }
        g->gl.TexSubImage2D(SAT__GL_TEXTURE_2D, 0, 0, 4 * kind + c, FIV__ALL_VIEWS, 1, SAT__GL_RGBA, SAT__GL_FLOAT,
                            g->staged);
    }
}

static void fiv__gl_send(fiv_gl *g, const fiv_occluder *o, int kind, int layer)
{
    fiv__gl_send_shells(g, o, layer);
    g->gl.BindTexture(SAT__GL_TEXTURE_2D, g->support);
    g->gl.TexSubImage2D(SAT__GL_TEXTURE_2D, 0, 0, FIV__SUPPORT * kind, FIV__SUPPORT, FIV__SUPPORT, SAT__GL_RED,
                        SAT__GL_FLOAT, o->support);
#ifndef FIV_NO_DELTA
    if (o->light_count) {
        int side = g->room.map_side;
        g->gl.BindTexture(SAT__GL_TEXTURE_2D, g->maps);
        g->gl.TexSubImage2D(SAT__GL_TEXTURE_2D, 0, kind % 4 * side, kind / 4 * side, o->map_side, o->map_side,
                            SAT__GL_RED_INTEGER, SAT__GL_UNSIGNED_SHORT, o->map);
    }
#endif
    fiv__gl_send_views(g, o, kind);
    g->uploads++;
}

/* I_tot of the environment, a row of texels at a time. */
static void fiv__gl_send_diffuse(fiv_gl *g, const fiv_environment *e)
{
    int side = e->face + 1, row, x;
    g->gl.BindTexture(SAT__GL_TEXTURE_2D, g->diffuse);
    for (row = 0; row < 6 * side; row++) {
        for (x = 0; x < side; x++) {
            memcpy(g->staged[x], e->irradiance + 3 * (row * side + x), 3 * sizeof(float));
            g->staged[x][3] = 1;
        }
        g->gl.TexSubImage2D(SAT__GL_TEXTURE_2D, 0, 0, row, side, 1, SAT__GL_RGBA, SAT__GL_FLOAT, g->staged);
    }
}

/* Texels 0 to 11 of an instance: where it is, its tables, and the frame of its views. */
static void fiv__gl_row(float row[FIV__SCENE_WIDTH][4], const fiv_instance *instance, int layer, int kind)
{
    const fiv_occluder *o = instance->occluder;
    float centre[3];
    int k;
    fiv__turn(centre, o->rotation, o->centre);
    for (k = 0; k < 3; k++) row[0][k] = instance->position[k] + instance->scale * centre[k];
    row[0][3] = o->radius > 0 && instance->scale > 0 ? 1 / (o->radius * instance->scale) : 0;
    for (k = 0; k < 9; k++) row[1 + k / 3][k % 3] = o->rotation[k];
    for (k = 0; k < 9; k++) row[9 + k % 3][k / 3] = fiv__view_frame[k];
    row[9][3] = o->few ? (float)o->mesh.triangle_count : -1;
    row[10][3] = o->mesh.closed ? o->mesh.turn : 0;
    row[11][3] = fiv__view_lift(o);
    row[1][3] = (float)layer;
    row[2][3] = (float)o->grid.octahedral;
    row[3][3] = (float)kind;
    row[4][0] = (float)o->grid.theta;
    row[4][1] = (float)o->grid.phi;
    row[4][2] = (float)o->grid.rho;
    row[4][3] = o->grid.log_first;
    row[5][0] = o->grid.first;
    row[5][1] = o->grid.per_log;
    row[5][2] = fiv__gl_unit(o);
    row[8][3] = (float)o->contact_side;
#ifndef FIV_NO_DELTA
    row[5][3] = fiv__map_scale(o);
    row[6][3] = (float)o->cell_side;
    row[7][3] = (float)o->cells;
#endif
}

/* What stays while instances move: texels 6 to 8, the environment's vector in the occluder's frame, and the lights. */
static void fiv__gl_light(fiv_gl *g, const fiv_environment *e)
{
    int i, k, c;
    memset(g->rows, 0, sizeof g->rows);
    for (i = 0; i < g->count; i++) {
        const fiv_occluder *o = g->occluders[g->kind[i]];
        for (c = 0; c < 3; c++) {
            float world[3];
            for (k = 0; k < 3; k++) world[k] = (float)e->vector[3 * c + k];
            fiv__turn_back(g->rows[i][6 + c], o->rotation, world);
        }
        for (k = 0; k < 3 * o->light_count; k++)
            memcpy(g->rows[i][16 + k], o->light_axes[k / 3][k % 3], sizeof o->light_axes[0][0]);
    }
    for (k = 0; k < e->light_count; k++) {
        float *direction = g->rows[g->max_instances][2 * k];
        fiv__turn(direction, e->rotation, e->lights[k].direction);
        direction[3] = fiv__sun_tangent(&e->lights[k], g->penumbra);
        memcpy(g->rows[g->max_instances][2 * k + 1], e->lights[k].power, sizeof e->lights[k].power);
    }
}

FIV_DEF sat_result fiv_gl_move(fiv_gl *g, const fiv_instance *instances, size_t count)
{
    sat__gl_state state;
    size_t i;
    int k;
    if (!g || !g->shells || count != (size_t)g->count || (count && !instances)) return SAT_ERR_ARGUMENT;
    for (i = 0; i < count; i++) {
        if (instances[i].occluder != g->occluders[g->kind[i]] || !sat__is_finite(instances[i].scale) ||
            !(instances[i].scale >= 0))
            return SAT_ERR_ARGUMENT;
        for (k = 0; k < 3; k++)
            if (!sat__is_finite(instances[i].position[k])) return SAT_ERR_ARGUMENT;
    }
    for (i = 0; i < count; i++) fiv__gl_row(g->rows[i], &instances[i], g->layer[g->kind[i]], g->kind[i]);
    sat__gl_begin(&g->gl, &state, 1);
    sat__gl_upload(&g->gl, g->scene, SAT__GL_RGBA32F, FIV__SCENE_WIDTH, g->max_instances + 1, g->rows);
    sat__gl_end(&g->gl, &state);
    return SAT_OK;
}

static sat_result fiv__gl_make_array(fiv_gl *g, unsigned *made, int bytes, int width, int height, int layers)
{
    sat__gl *gl = &g->gl;
    gl->GenTextures(1, made);
    gl->ActiveTexture(SAT__GL_TEXTURE0);
    gl->BindTexture(SAT__GL_TEXTURE_2D_ARRAY, *made);
    gl->TexImage3D(SAT__GL_TEXTURE_2D_ARRAY, 0, bytes ? SAT__GL_R8UI : SAT__GL_RGBA16F, width, height, layers, 0,
                   bytes ? SAT__GL_RED_INTEGER : SAT__GL_RGBA, bytes ? SAT__GL_UNSIGNED_BYTE : SAT__GL_FLOAT, NULL);
    fiv__gl_filter(gl, SAT__GL_TEXTURE_2D_ARRAY);
    if (bytes) {
        gl->TexParameteri(SAT__GL_TEXTURE_2D_ARRAY, SAT__GL_TEXTURE_MIN_FILTER, SAT__GL_NEAREST);
        gl->TexParameteri(SAT__GL_TEXTURE_2D_ARRAY, SAT__GL_TEXTURE_MAG_FILTER, SAT__GL_NEAREST);
    }
    return sat__gl_check(gl, bytes ? "fiv: OpenGL refused the texture of the views (contact_map)"
                                   : "fiv: OpenGL refused the texture of the samples");
}

/* Textures of this room in place of smaller ones. All are made before one is given up. */
static sat_result fiv__gl_grow(fiv_gl *g, const fiv__gl_room *asked)
{
    sat__gl *gl = &g->gl;
    fiv__gl_room room = *asked;
    unsigned made[4] = {0, 0, 0, 0}, *at[4], old[4];
    int grows[4], i;
    sat_result r = SAT_OK;
    room.columns = sat__max_int(room.columns, g->room.columns);
    room.rows = sat__max_int(room.rows, g->room.rows);
    room.layers = sat__max_int(room.layers, g->room.layers);
    room.map_side = sat__max_int(room.map_side, g->room.map_side);
    room.view_side = sat__max_int(room.view_side, g->room.view_side);
    room.kinds = sat__max_int(room.kinds, g->room.kinds);
    at[0] = &g->shells;
    at[1] = &g->maps;
    at[2] = &g->diffuse;
    at[3] = &g->views;
    grows[0] = room.columns > g->room.columns || room.rows > g->room.rows || room.layers > g->room.layers;
    grows[1] = room.map_side > g->room.map_side;
    grows[2] = room.face != g->room.face;
    grows[3] = room.view_side > g->room.view_side || (room.view_side > 1 && room.kinds > g->room.kinds);
    if (grows[0]) r = fiv__gl_make_array(g, &made[0], 0, room.columns, room.rows, room.layers);
    if (!r && grows[1])
        r = sat__gl_texture(gl, &made[1], SAT__GL_R16UI, 4 * room.map_side, (g->max_instances + 3) / 4 * room.map_side,
                            NULL);
    if (!r && grows[2]) r = sat__gl_texture(gl, &made[2], SAT__GL_RGBA32F, room.face + 1, 6 * (room.face + 1), NULL);
    if (!r && grows[3])
        r = fiv__gl_make_array(g, &made[3], 1, FIV__VIEWS * room.view_side, 6 * FIV__VIEWS * room.view_side,
                               room.kinds);
    if (r) {
        gl->DeleteTextures(4, made);
        return r;
    }
    for (i = 0; i < 4; i++) {
        old[i] = grows[i] ? *at[i] : 0;
        if (grows[i]) *at[i] = made[i];
    }
    gl->DeleteTextures(4, old);
    if (grows[0] || grows[1] || grows[3]) memset(g->signature, 0, sizeof g->signature);
    if (grows[2]) g->light_signature = 0;
    if (grows[3]) memset(g->view_signature, 0, sizeof g->view_signature);
    g->room = room;
    return r;
}

/* The scene's different occluders, where their shells begin, and the room that they take. */
static int fiv__gl_kinds(const fiv_occluder *occluders[FIV__GL_INSTANCES], int kind[FIV__GL_INSTANCES],
                         int layer[FIV__GL_INSTANCES], fiv__gl_room *room, const fiv_instance *instances, size_t count)
{
    size_t i;
    int j, kinds = 0;
    room->columns = room->rows = room->layers = room->map_side = room->view_side = room->kinds = 1;
    for (i = 0; i < count; i++) {
        const fiv_occluder *o = instances[i].occluder;
        for (j = 0; j < kinds && occluders[j] != o; j++) {}
        kind[i] = j;
        if (j < kinds) continue;
        layer[kinds] = kinds ? room->layers : 0;
        occluders[kinds++] = o;
        room->columns = sat__max_int(room->columns, o->grid.theta + 1);
        room->rows = sat__max_int(room->rows, 3 * o->grid.phi);
        room->layers = layer[j] + o->grid.rho;
        if (o->light_count) room->map_side = sat__max_int(room->map_side, o->map_side);
        if (!o->few) room->view_side = sat__max_int(room->view_side, o->contact_side);
        room->kinds = kinds;
    }
    return kinds;
}

/* All that can fail comes before all that changes the scene. */
FIV_DEF sat_result fiv_gl_set_scene(fiv_gl *g, const fiv_environment *e, const fiv_instance *instances, size_t count)
{
    sat__gl_state state;
    sat__text t;
    fiv_irradiance_options o = fiv_irradiance_defaults();
    const fiv_occluder *occluders[FIV__GL_INSTANCES];
    int kind[FIV__GL_INSTANCES], layer[FIV__GL_INSTANCES], kinds, i;
    fiv__gl_room room;
    uint64_t light;
    sat_result r;
    if (!g || !g->scene) return SAT_ERR_ARGUMENT;
    t = sat__text_begin(g->gl.message, sizeof g->gl.message);
    if (count > (size_t)g->max_instances) {
        sat__text_range(&t, "count", (double)count, 0, g->max_instances, ' ');
        return SAT_ERR_LIMIT;
    }
    if (!fiv__explain_instances(&t, e, instances, count, &o)) return SAT_ERR_ARGUMENT;
    kinds = fiv__gl_kinds(occluders, kind, layer, &room, instances, count);
    room.face = e->face;
    sat__gl_begin(&g->gl, &state, 1);
    r = fiv__gl_grow(g, &room);
    if (!r) {
        g->count = (int)count;
        g->kinds = kinds;
        g->lights = e->light_count;
        memcpy(g->rotation, e->rotation, sizeof g->rotation);
        for (i = 0; i < (int)count; i++) g->kind[i] = kind[i];
        for (i = 0; i < kinds; i++) {
            if (g->signature[i] != occluders[i]->signature || g->layer[i] != layer[i])
                fiv__gl_send(g, occluders[i], i, layer[i]);
            g->signature[i] = occluders[i]->signature;
            g->occluders[i] = occluders[i];
            g->layer[i] = layer[i];
        }
        light = fiv__hash(FIV__HASH, e->irradiance, 18 * (size_t)(e->face + 1) * (size_t)(e->face + 1) * sizeof(float));
        if (light != g->light_signature) fiv__gl_send_diffuse(g, e);
        g->light_signature = light;
        fiv__gl_light(g, e);
    }
    sat__gl_end(&g->gl, &state);
    return r ? r : fiv_gl_move(g, instances, count);
}

static void fiv__gl_uniforms(fiv_gl *g, unsigned program, int unit)
{
    sat__gl *gl = &g->gl;
    float column[3];
    int counts = gl->GetUniformLocation(program, "fiv_counts"), k;
    static const char *const names[3] = {"fiv_x", "fiv_y", "fiv_z"};
    sat__gl_set_texture(gl, program, "fiv_support", unit, g->support);
    sat__gl_set_texture(gl, program, "fiv_scene", unit + 1, g->scene);
    sat__gl_set_texture(gl, program, "fiv_diffuse", unit + 2, g->diffuse);
    sat__gl_set_texture(gl, program, "fiv_maps", unit + 3, g->maps);
    sat__gl_set_int(gl, program, "fiv_shells", unit + 4);
    gl->ActiveTexture(SAT__GL_TEXTURE0 + (unsigned)(unit + 4));
    gl->BindTexture(SAT__GL_TEXTURE_2D_ARRAY, g->shells);
    gl->BindSampler((unsigned)(unit + 4), 0);
    sat__gl_set_texture(gl, program, "fiv_view_light", unit + 5, g->view_light);
    sat__gl_set_int(gl, program, "fiv_views", unit + 6);
    gl->ActiveTexture(SAT__GL_TEXTURE0 + (unsigned)(unit + 6));
    gl->BindTexture(SAT__GL_TEXTURE_2D_ARRAY, g->views);
    gl->BindSampler((unsigned)(unit + 6), 0);
    for (k = 0; k < 3; k++) {
        column[0] = g->rotation[k];
        column[1] = g->rotation[3 + k];
        column[2] = g->rotation[6 + k];
        sat__gl_set_float3(gl, program, names[k], column);
    }
    if (counts >= 0) gl->Uniform4i(counts, g->count, g->lights, g->room.map_side, g->room.face);
}

FIV_DEF sat_result fiv_gl_bind(fiv_gl *g, unsigned program, int first_unit)
{
    if (!g || !g->shells || first_unit < 0) return SAT_ERR_ARGUMENT;
    g->gl.UseProgram(program);
    fiv__gl_uniforms(g, program, first_unit);
    return SAT_OK;
}

static void fiv__gl_set_view(fiv_gl *g, const fiv_gl_view *view, int width, int height)
{
    sat__gl *gl = &g->gl;
    float depth[3] = {0, 0, 0};
    if (view) {
        depth[0] = 2 / (float)width;
        depth[1] = 2 / (float)height;
        depth[2] = view->clip_zero_to_one ? 2.0f : 1.0f;
        gl->Uniform4fv(gl->GetUniformLocation(g->program, "fiv_world"), 4, view->world_from_clip);
        gl->Uniform3fv(gl->GetUniformLocation(g->program, "fiv_turn"), 3, view->world_from_normal);
    }
    sat__gl_set_float3(gl, g->program, "fiv_depth", depth);
}

FIV_DEF sat_result fiv_gl_irradiance(fiv_gl *g, const sat_gl_target *to, unsigned points, unsigned normals,
                                     const fiv_gl_view *view)
{
    sat__gl_state state;
    sat_result result;
    int width, height;
    if (!g || !g->shells || !points || !normals || !sat__gl_target_is_valid(to)) return SAT_ERR_ARGUMENT;
    if (sat__gl_target_is(to, points) || sat__gl_target_is(to, normals)) return SAT_ERR_ARGUMENT;
    width = g->width;
    height = g->height;
    if (!sat__gl_take_size(to, &width, &height)) return SAT_ERR_SIZE;
    sat__gl_begin(&g->gl, &state, FIV__GL_UNITS);
    result = sat__gl_pass_to(&g->gl, g->program, to, g->target, width, height);
    if (result == SAT_OK) {
        fiv__gl_uniforms(g, g->program, 0);
        fiv__gl_set_view(g, view, width, height);
        sat__gl_set_from(&g->gl, g->program, to);
        sat__gl_set_texture(&g->gl, g->program, "fiv_points", 7, points);
        sat__gl_set_texture(&g->gl, g->program, "fiv_normals", 8, normals);
        sat__gl_draw(&g->gl);
    }
    sat__gl_release_target(&g->gl, to);
    sat__gl_end(&g->gl, &state);
    return result;
}

#ifdef __cplusplus
}
#endif
SAT__IEEE_END
#endif /* FIV_IMPLEMENTATION && FIV_GL */

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
