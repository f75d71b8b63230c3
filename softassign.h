/* softassign.h - 0.1.0 - assignment without repetition, and photomosaics - SPDX-License-Identifier: MIT-0 OR Unlicense

   Every row (patch, unit, seat) gets one column (tile, place), every column at most once, at the least total cost; with
   a proof beside every answer.

   USE

       #define SAT_IMPLEMENTATION             // in exactly one C or C++ file, as the next line
       #define SOFTASSIGN_IMPLEMENTATION
       #include "softassign.h"

       softassign_problem p = {0};
       p.rows = 900, p.columns = 8192, p.feature_count = 48;
       p.row_features = patches, p.column_features = tiles;
       softassign_solve(column_of_row, &p, NULL, NULL);

   Needs sat.h beside it and -lm. examples/photomosaic.c is the whole use.

   A tracker's gate: a track (row) takes a detection (column), or none (-1) where all are too far or taken:

       float distance[TRACKS][DETECTIONS];
       int detection_of_track[TRACKS];
       softassign_problem p = {0};
       p.rows = TRACKS, p.columns = DETECTIONS;
       p.cost = &distance[0][0], p.stride = DETECTIONS;
       p.unassigned_cost = 30;
       softassign_solve(detection_of_track, &p, NULL, NULL);

   WHAT IT DOES
     * the optimum (AUTO, EXACT), or an answer certified to a gap (FAST), from a matrix of floats, doubles or integers,
       dense or sparse, from a function or from features
     * a lower bound with every answer of every method: cost, lower_bound, gap (Slomp 2012, eq 3.2 to 3.5)
     * capacities, forbidden pairs, minimum use, minimum distance of repeats, a bonus for staying (video)
     * rows left out at a price, the largest instead of the least, dual prices, the margin of each pair of the optimum
     * a solver that goes on from its prices, stops at any time and then still has a valid answer
     * the methods of Slomp 2012, chapter 3: greedy, annealing, softassign as published, ants; GPU passes (section 3.7),
       whose assignment stays in a texture
     * features of eq 3.1 from pictures, and the drawing of the mosaic
   DOES NOT
     * quadratic or multi-way assignment; transport of fractions
     * start threads, open files, write to the console

   OPTIONS (define before the implementation; S: also before every other inclusion)
     SOFTASSIGN_STATIC S          every function private to the file
     SOFTASSIGN_DEF S             linkage of the functions
     SOFTASSIGN_GL S              the passes of section 3.7 and the entropic sweep for OpenGL
     SOFTASSIGN_NO_HEURISTICS     without greedy, 2-opt, annealing, ants      (3.1 of 61 KB; `make size`)
     SOFTASSIGN_NO_MATRIX         without ENTROPIC and PUBLISHED              (7.3 KB)
     SOFTASSIGN_NO_MOSAIC         without the picture helpers                 (2.8 KB)
     SAT_NO_SIMD, SAT_NO_STDLIB, SAT_ASSERT as in sat.h. A method left out returns SAT_ERR_ARGUMENT.

   MEMORY, THREADS, ERRORS
     AUTO reads a given matrix of floats or doubles where it stands, and copies it (up to 64 million cells) only with a
     bonus, maximise or unassigned_cost; integers are copied, and sparse ones up to 600 000 cells or of one cell in 32;
     features and functions make a matrix up to 600 000 cells. softassign_solve
     allocates once (ENTROPIC and PUBLISHED twice) and releases; a solver allocates in create only. Lists take 12 x
     neighbours bytes a row: 3.2 MB in all for 900 x 8192, 27 MB for 8192 x 65536 (the matrix: 30, 2147 MB). One
     solver, one thread at a time; different solvers at once. sat_threads speeds up lists, sweeps and checks. Errors
     name a row or a column in the stats and leave column_of_row as it was: NaN and -infinity SAT_ERR_NON_FINITE, too
     large SAT_ERR_ARGUMENT, more rows than places or forbidden pairs that leave no choice SAT_ERR_LIMIT.

   ROWS, LIGHT, FAILURES
     Strides of matrices are in floats, those of pictures in bytes: 0 packed, negative the bottom row first with the
     pointer at the top one. Features are means of the values as they are: sRGB codes are the more even measure of what
     is seen, linear light of what is drawn small. A create that fails sets *out to NULL and holds nothing (OpenGL: an
     object for its message, to be destroyed). On OpenGL matrices go up by softassign_gl_set_costs and come back by
     softassign_gl_published, assignments by softassign_gl_assign.

   NUMERICS
     Costs are floats, prices and path lengths doubles, sums compensated. A pair has one cost, always rounded the same
     way. lower_bound is below every assignment's cost, rounding included; after EXACT the gap is that rounding, about
     1e-15. The optimum is proven by complementary slackness with differences of twice the width; where doubles do not
     hold what the costs span (1e-45 to 1e30 in one problem), the last paths are searched in fixed point of 320 bits, so
     that no cost that is not used spoils the proof (stats.exact_repair). Softassign stays finite
     at any temperature, 0 too. Ties: free columns first, then the smaller index.
     Same bits for any number of workers. A compiler that contracts a*b+c may change the last bit of distances.

   METHOD (EXACT)
     Column prices v <= 0 give the bound sum_i min_j (c_ij - v_j) + sum_j v_j. A list holds the columns of smallest
     c_ij - v_j of a row and a limit for all others. Since prices only fall in the path search, the limit stays true,
     and a list that runs out is not lengthened but made anew at the prices of the moment: short lists are enough.
     Making one costs 16 numbers a column: projections on the main directions bound the distance from below, and the
     others are never computed (stats.distances_computed). Sparse softassign with inequality columns finds the prices,
     shortest augmenting paths the assignment, and columns that were left with a price below 0 are raised back along a
     reverse path (finish). Given matrices, and what makes one of up to 600 000 cells, go to a dense solver without
     lists: column reduction (square), augmenting row reduction, shortest paths on the matrix where it stands, scanned
     in floats that leave out all that cannot matter. AUTO leaves it for lists where rows compete and 128 rows and more
     have 3000 columns and more, at least four a row: from there on lists are faster (table "What AUTO chooses from").
     Time over a plain LAPJV's (Jonker and Volgenant 1987) and over scipy's, checks and proof included, one thread:
                                     512^2        1024^2       256 x 1024
       uniform                       0.40 0.15    0.50 0.09    0.63 0.10
       integers to n                 0.58 0.17    0.54 0.13    0.48 0.19
       zeros and ones                0.46 0.44    0.41 0.39    0.14 0.10
       points in a plane             0.50 0.36    0.44 0.36    0.43 0.18
       low rank                      0.50 0.37    0.38 0.29    0.34 0.32
       i * j shuffled                0.44 0.77    0.66 0.56    0.37 0.64
       5 % cheap pairs               0.43 0.20    0.48 0.12    0.47 0.22
   COST (one thread, measured by tests/bench/bench_softassign.c on real photographs and tiles)
     time from features to the proven answer, as a ratio to scipy's linear_sum_assignment and to a plain LAPJV, both
     without the time of their matrix:           900 x 8192 (six photos)           2048 x 8192 (three photos)
       EXACT                                     0.09 to 0.17; LAPJV 0.11 to 0.31   0.06, 0.07; LAPJV 0.09, 0.10
       FAST, gap 0.1 %                           0.05 to 0.12; LAPJV 0.09 to 0.22   0.05, 0.06; LAPJV 0.08, 0.09
     A picture whose cells hardly compete (stream) is easy for all: EXACT 0.31 and 0.25, FAST 0.37 and 0.16 of scipy,
     which needs 0.14 s; there a plain LAPJV is about as fast at 900 x 8192, if its matrix is free. 100 x 100, dense:
     0.9 of LAPJV, checks and bound included. 8192 x 65536: the optimum in a minute on two cores, 4 % of the distances.
     Video, 30 x 30 of 8192, an eighth of a cell a frame: 0.07 of LAPJV from prices; a switching bonus of 0.05 changes
     39 % of the tiles (74 % without) at +0.9 % cost. Beside the optimum the published methods cost, 100x100 to
     400x1500: greedy +3 to 10 %, greedy and 2-opt +0.4 to 0.7 %, annealing 0 to +0.2 %, softassign as printed +1.5 to 7
     % (its outlier and alpha decide), ants +2 to 3 %.
*/

/*
   CONTENTS (each section begins with its mark: search for it)

     >> types            structs of problems, options and what a call found out
     >> easy calls       defaults, solve, features, mosaic
     >> full calls       create, step, explain
     >> calls of OpenGL  the same matrix methods on the GPU
     >> sums             limits, sums, random numbers
     >> options          their table, and what is refused
     >> solver           the struct of the solver
     >> costs            of a pair, keys below them
     >> bound            projections of features
     >> lists            nearest columns of a row
     >> prices           start prices of EXACT
     >> assignment       who is where
     >> paths            on lists
     >> finish           columns left below their top price
     >> certificate      the bound of prices
     >> auction          FAST
     >> dense            paths on the matrix
     >> repair           fixed point of 320 bits
     >> proof            complementary slackness
     >> phases           what a step does next
     >> memory           one block
     >> greedy           GREEDY, GREEDY_2OPT
     >> annealing        ANNEALING
     >> ants             ANTS
     >> entropic         ENTROPIC
     >> published        PUBLISHED
     >> statistics       costs, gaps, dual prices, progress
     >> checks           NaN and what is too large
     >> start            slots, bonus, first phase
     >> step             softassign_create, softassign_step
     >> solve            softassign_solve
     >> mosaics          features, drawing
     >> OpenGL           programs, textures
     >> passes of OpenGL  costs, the published method, sweeps
*/

#if defined(LIGHTSCAN_IMPLEMENTATION) && !defined(SOFTASSIGN_IMPLEMENTATION)
#define SOFTASSIGN_IMPLEMENTATION
#endif

#ifndef SOFTASSIGN_H
#define SOFTASSIGN_H

#define SOFTASSIGN_VERSION_MAJOR 0
#define SOFTASSIGN_VERSION_MINOR 1
#define SOFTASSIGN_VERSION_PATCH 0
#define SOFTASSIGN_VERSION (SOFTASSIGN_VERSION_MAJOR * 10000 + SOFTASSIGN_VERSION_MINOR * 100 + SOFTASSIGN_VERSION_PATCH)

#if defined(SOFTASSIGN_IMPLEMENT) || defined(SOFTASSIGN_IMPL)
#error "softassign.h: the macro is called SOFTASSIGN_IMPLEMENTATION"
#endif

#if defined(SOFTASSIGN_GL) && !defined(SAT_GL)
#define SAT_GL
#endif
#include "sat.h"
#if SAT_VERSION < 100
#error "softassign.h needs sat.h 0.1.0 or newer"
#endif

/* SOFTASSIGN_STATIC makes every function private to the file; SOFTASSIGN_DEF replaces the linkage altogether. */
#ifndef SOFTASSIGN_DEF
#ifdef SOFTASSIGN_STATIC
#define SOFTASSIGN_DEF static inline
#else
#define SOFTASSIGN_DEF extern
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------------------------------------
   >> types
   Types
   ------------------------------------------------------------------------------------------------ */

typedef enum softassign_method {
    SOFTASSIGN_AUTO,        /* the optimum: given matrices, and what makes one of up to 600 000 cells, densely (wide
                               ones whose rows compete: on lists), others as SOFTASSIGN_EXACT */
    SOFTASSIGN_EXACT,       /* the optimum: softassign prices on lists, shortest augmenting paths, finish */
    SOFTASSIGN_FAST,        /* auction on lists; certified to options.gap. With minimum_use, and where the auction
                               does not get there: SOFTASSIGN_EXACT, and stats.method says so */
    SOFTASSIGN_ENTROPIC,    /* softassign with inequality columns over the whole matrix, rounded by paths */
    SOFTASSIGN_PUBLISHED,   /* Slomp 2012, section 3.6, as printed */
    SOFTASSIGN_GREEDY,      /* Slomp 2012, section 3.4.2 */
    SOFTASSIGN_GREEDY_2OPT, /* the same, then moves and swaps while they help */
    SOFTASSIGN_ANNEALING,   /* Slomp 2012, section 3.4.3 */
    SOFTASSIGN_ANTS         /* Slomp 2012, appendix 3.A */
} softassign_method;

/* The cost of a pair; the same pair must always get the same number. */
typedef float softassign_cost_fn(int row, int column, void *user);

/* Rows are patches, columns are tiles. Costs come from the first of these that is given: a matrix of floats, doubles or
   integers, dense or sparse; a function; or features, whose Euclidean distance (Slomp 2012, eq 3.1) is computed when it
   is needed. Infinite costs forbid a pair; NaN, -infinity and |cost| > 1e30 are refused, as are features beyond
   +-1e16. */
typedef struct softassign_problem {
    int rows, columns;                     /* >= 1 */
    const float *cost;                     /* cost[row * stride + column] */
    const double *cost_double;             /* the same in doubles, whose differences count as they are. These two: all
                                              methods but ENTROPIC and PUBLISHED */
    const int *cost_int;                   /* the same in integers, all exact; 2147483647 forbids a pair (maximise:
                                              -2147483648) */
    ptrdiff_t stride;                      /* in elements, not bytes; 0: packed */
    const int *row_start;                  /* not NULL: the matrix is sparse (CSR), what it lacks is forbidden: row i
                                              has the values row_start[i] to row_start[i + 1] - 1; rows + 1 numbers
                                              from 0 */
    const int *column_index;               /* of each value, rising in a row */
    softassign_cost_fn *cost_fn;
    void *cost_user;
    const float *row_features;             /* rows x feature_count, packed */
    const float *column_features;          /* columns x feature_count, packed */
    int feature_count;
    const int *capacity;                   /* per column, >= 0; NULL: options.capacity_default */
    const int *minimum_use;                /* per column, 0..capacity: so many rows must get it; NULL: 0. AUTO, EXACT
                                              and FAST of softassign_solve */
    const int *previous;                   /* per row, the column of the last frame or -1; NULL: none. See
                                              options.switching */
    int maximise;                          /* 1: the largest total; -infinity forbids a pair, stats.lower_bound is an
                                              upper one */
    float unassigned_cost;                 /* > 0: a row may stay without a column (-1) at this price, and never takes a
                                              dearer one (maximise: at this gain); 0: every row gets a column. These
                                              two: AUTO, EXACT and FAST */
} softassign_problem;

/* What a call found out. gap = (cost - lower_bound) / cost holds at any moment: no assignment costs less than
   lower_bound. */
typedef struct softassign_stats {
    double cost;               /* of column_of_row, without the switching bonus */
    double lower_bound;
    double gap;                /* 0 when both are 0; infinite when the cost alone is 0, or no bound is known yet */
    softassign_method method;  /* what was run */
    int complete;              /* 1: the method came to its end; 0: the budget or `progress` stopped it */
    int row_error;             /* the row that an error is about, or -1 */
    int column_error;          /* the same for a column */
    size_t iterations;         /* sweeps, bids, moves or ants, see the method */
    size_t distances_computed; /* costs evaluated, of rows x columns */
    size_t bytes;              /* largest memory in use beyond the caller's */
    size_t work;               /* units that softassign_step counts */
    size_t lists_built;        /* lists of nearest columns, first ones and renewed ones */
    size_t rows_expanded;      /* times a path search looked at a whole row because its list had ended */
    size_t paths;              /* augmenting paths */
    size_t columns_finished;   /* columns whose price had to be raised back */
    int conflicts;             /* pairs of rows with one column closer than min_distance, 0 when all could be undone */
    int switched;              /* rows that differ from problem.previous */
    double soft_cost;          /* PUBLISHED: the lowest sum of Q */
    double column_sum_max;     /* PUBLISHED, ENTROPIC: largest column sum of the soft matrix */
    int exact_repair;          /* 1: doubles could not prove the optimum, and the last paths were searched in exact
                                  arithmetic */
    int duplicate_rows;        /* PUBLISHED: rows whose largest element was another row's column already */
} softassign_stats;

/* Called now and then with a valid assignment; not 0 stops the solver, which keeps what it has. */
typedef int softassign_progress_fn(const softassign_stats *stats, const int *column_of_row, void *user);

typedef struct softassign_options {
    softassign_method method;  /* SOFTASSIGN_AUTO; SOFTASSIGN_AUTO..SOFTASSIGN_ANTS */
    double gap;                /* 0.001; 0..1e300 or infinity; FAST ends when its certified gap is not larger */
    int capacity_default;      /* 1; 0..2147483647; uses of a column where problem.capacity is NULL */
    int neighbours;            /* 160; 4..256; length of a row's list. 64 is a third faster where few rows want the same
                                  columns, and five times slower where many do */
    int certify;               /* 1; 0..1; GREEDY to ANTS and PUBLISHED buy their bound from the auction; 0: from row
                                  minima */
    uint64_t seed;             /* 1; any; ANNEALING, ANTS, PUBLISHED */

    /* schedules: defaults of AUTO; softassign_method_defaults() has those of each method */
    double temperature;        /* 0.3; 0..1e30; ENTROPIC, ANNEALING: the first, times the mean row minimum; PUBLISHED:
                                  times the largest cost */
    double cooling;            /* 0.5; 0..1; factor from one temperature to the next */
    int iterations[3];         /* 6, 10, 10; 0..2147483647; ENTROPIC: temperatures, sweeps at each; PUBLISHED:
                                  temperatures, stabilisations, Sinkhorn iterations; ANNEALING: temperatures, moves a
                                  row; ANTS: iterations; 2OPT: passes */
    double alpha;              /* 1; -1e30..1e30; PUBLISHED: bias of eq 3.9, times the largest cost */
    double outlier;            /* 1e6; 0..1e30; PUBLISHED: element of the outlier row */
    int outlier_evolves;       /* 0; 0..1; PUBLISHED: 0 constant in the Sinkhorn loop, as printed; 1 normalised as a row
                                  of M */
    int gold;                  /* 0; 0..1; PUBLISHED: 1: M = exp(-(D - alpha) / t), the update of Gold et al. 1997 */
    int double_precision;      /* 0; 0..1; PUBLISHED: 0 float, exponents clamped to +-70; 1 double, +-650 */
    int gather;                /* 4; 2..64; values a reduction step sums */
    int ants;                  /* 30; 1..2147483647 */
    double evaporation;        /* 0.1; 0..1; ANTS: pheromone lost in an iteration */
    double noise;              /* 1; 0..1; ANTS: share of replaced tiles at the start; falls to 0 */

    double switching;          /* 0; 0..1e6; staying with problem.previous is worth this times the mean cost */
    int grid_width;            /* 0; 0..2147483647; rows are cells of a grid so wide, for min_distance */
    double min_distance;       /* 0; 0..1e9; smallest distance of two cells with the same column, in cells */

    double *row_price;         /* NULL; AUTO, EXACT: receive the dual prices u, v of the optimum: u_i + v_j <= cost_ij
                                  (less */
    double *column_price;      /* NULL; the bonus), equal where i got j; v_j <= 0, and 0 where j has room, unless rows =
                                  columns. cost_ij - u_i - v_j bounds what forcing the pair would add. Not with
                                  minimum_use */
    double *row_margin;        /* NULL; AUTO, EXACT: receive what the best assignment without the row's pair is
                                  worse by, to 1e-15 of the largest cost that is not infinite; infinite where there is
                                  none. One more path a row. Not with minimum_use, min_distance */
    float *soft;               /* NULL; ENTROPIC, PUBLISHED: receives the soft matrix, rows x columns */
    ptrdiff_t soft_stride;     /* in floats; 0: packed */
    sat_allocator allocator;   /* malloc */
    sat_threads threads;       /* serial; same bits for any worker count */
    softassign_progress_fn *progress;
    void *progress_user;
} softassign_options;

/* ------------------------------------------------------------------------------------------------
   >> easy calls
   Easy calls
   ------------------------------------------------------------------------------------------------ */

SOFTASSIGN_DEF int softassign_version(void);
SOFTASSIGN_DEF softassign_options softassign_defaults(void);
/* The same with another method and its schedule. */
SOFTASSIGN_DEF softassign_options softassign_method_defaults(softassign_method method);

/* column_of_row: rows ints. options and stats may be NULL. On SAT_ERR_LIMIT no assignment exists: stats->row_error
   names a row that found no column, and column_of_row is untouched as after any error. */
SOFTASSIGN_DEF sat_result softassign_solve(int *column_of_row, const softassign_problem *problem,
                                           const softassign_options *options, softassign_stats *stats);

/* Means of parts_x x parts_y rectangles of every cell of a grid_width x grid_height grid: the features of eq 3.1.
   out: grid_width * grid_height rows of parts_x * parts_y * channels floats. Cells may be smaller than pixels. */
SOFTASSIGN_DEF sat_result softassign_features(float *out, const sat_image *image, int grid_width, int grid_height,
                                              int parts_x, int parts_y, const softassign_options *options);

/* Draws the mosaic: 8-bit pixels, grid_width * tile width x grid_height * tile height. tiles: SAT_U8, tiles of
   tile_width x tile_height in a sheet without gaps, numbered row by row. blend 0..1 tints every tile towards the mean
   of target's cell (NULL or 0: not at all). */
SOFTASSIGN_DEF sat_result softassign_mosaic(unsigned char *out, ptrdiff_t stride, const sat_image *tiles,
                                            int tile_width, int tile_height, const int *column_of_row, int grid_width,
                                            int grid_height, const sat_image *target, float blend);

/* ------------------------------------------------------------------------------------------------
   >> full calls
   Full calls: anytime, and frame after frame
   ------------------------------------------------------------------------------------------------ */

/* A solver for problems of one size; maximise, unassigned_cost and the kind of costs are as each frame says. One
   allocation here, none in the steps. Methods: AUTO and EXACT. minimum_use is refused. */
typedef struct softassign softassign;
SOFTASSIGN_DEF sat_result softassign_create(softassign **out, int rows, int columns, const softassign_options *options);
/* Works on for about work_budget units (a unit is a row looked at, 1 to 100 microseconds) and writes a valid assignment
   with its certificate; stats->complete says that it is the optimum. The costs must stay as they are until then. */
SOFTASSIGN_DEF sat_result softassign_step(softassign *solver, int *column_of_row, const softassign_problem *problem,
                                          size_t work_budget, softassign_stats *stats);
/* The costs have changed: the next step starts anew from the prices found so far. */
SOFTASSIGN_DEF void softassign_next_frame(softassign *solver);
SOFTASSIGN_DEF void softassign_destroy(softassign *solver); /* NULL is fine */

/* One sentence that names what is refused with SAT_ERR_ARGUMENT, and its range; "" when nothing is. Written into text
   (cut to size, always ended); returns text. The first: options of softassign_solve, softassign_create and
   softassign_gl_create; the second: a problem with the options it is solved with (NULL: the defaults) by
   softassign_solve. Costs and features are not read; the stats names their row. */
SOFTASSIGN_DEF const char *softassign_explain(char *text, size_t size, const softassign_options *options);
SOFTASSIGN_DEF const char *softassign_explain_problem(char *text, size_t size, const softassign_problem *problem,
                                                const softassign_options *options);

#ifdef __cplusplus
}
#endif
#endif /* SOFTASSIGN_H */

/* ------------------------------------------------------------------------------------------------
   >> calls of OpenGL
   OpenGL: the matrix methods on the GPU, for GL 3.3 core and ES 3.0 / WebGL 2 with float render targets
   (define SOFTASSIGN_GL)
   ------------------------------------------------------------------------------------------------ */

#if defined(SOFTASSIGN_GL) && !defined(SOFTASSIGN__GL_API)
#define SOFTASSIGN__GL_API

#ifdef __cplusplus
extern "C" {
#endif

/* Belongs to the context that is current in create: it must be current in every call. Every call leaves the OpenGL
   state as it was (but for pending errors, which are lost). Columns and rows up to the largest texture; capacities of
   1. */
typedef struct softassign_gl softassign_gl;

/* On an OpenGL error *out only answers softassign_gl_message, and is to be destroyed; on the others it is NULL.
   Options read: alpha, temperature, cooling, iterations, outlier, outlier_evolves, gather, seed, allocator; NULL means
   softassign_defaults(), the published schedule is softassign_method_defaults(SOFTASSIGN_PUBLISHED). */
SOFTASSIGN_DEF sat_result softassign_gl_create(softassign_gl **out, sat_gl_get_proc *get_proc,
                                               const softassign_options *options);
SOFTASSIGN_DEF void softassign_gl_destroy(softassign_gl *gl); /* NULL is fine */
/* Other options from the next call on, free but for gather, which the shaders are compiled for: SAT_ERR_MISMATCH when
   it differs, and nothing changes. The allocator is not looked at. */
SOFTASSIGN_DEF sat_result softassign_gl_set_options(softassign_gl *gl, const softassign_options *options);
/* What the last SAT_ERR_GL_... or SAT_ERR_ARGUMENT of set_costs was about; never NULL, and NULL is fine. */
SOFTASSIGN_DEF const char *softassign_gl_message(const softassign_gl *gl);

/* The distance matrix: uploaded, or by a pass from features (eq 3.1). Costs must be finite or +infinity, |cost| <=
   1e30. capacity, minimum_use, previous, maximise and unassigned_cost are refused; the message names them. */
SOFTASSIGN_DEF sat_result softassign_gl_set_costs(softassign_gl *gl, const softassign_problem *problem);

/* Slomp 2012, section 3.7: the whole schedule of the options, as SOFTASSIGN_PUBLISHED in float. soft: rows x columns
   floats, rows soft_stride floats apart (0: packed), or NULL; soft_cost: the lowest sum of Q, or NULL. Waits for one
   texel a temperature. */
SOFTASSIGN_DEF sat_result softassign_gl_published(softassign_gl *gl, float *soft, ptrdiff_t soft_stride,
                                                  double *soft_cost);

/* Who gets what in the soft matrix of the last softassign_gl_published: the largest element of a row; of rows that want
   one column the first keeps it, and the others take turns for the nearest that is left. The texture of
   softassign_gl_columns then holds it, for shaders that draw; column_of_row: rows ints, or NULL: nothing is read but
   one texel in eight turns. SAT_ERR_LIMIT: forbidden pairs, or columns fewer than rows, leave a row without (-1). */
SOFTASSIGN_DEF sat_result softassign_gl_assign(softassign_gl *gl, int *column_of_row);
/* Its name: R32F, one texel wide, as high as there are rows: texelFetch(columns, ivec2(0, row), 0).x; 0 before
   softassign_gl_set_costs, whose next problem of another size makes another one. */
SOFTASSIGN_DEF unsigned softassign_gl_columns(const softassign_gl *gl);

/* `sweeps` sweeps of softassign with inequality columns at one temperature (in units of cost), from the prices given,
   one a column and all <= 0; they are replaced. lower_bound: of the last sweep's start, less its rounding; or NULL. */
SOFTASSIGN_DEF sat_result softassign_gl_sweep(softassign_gl *gl, float *price, double *lower_bound, double temperature,
                                              int sweeps);

/* GLSL (3.30 or ES 3.00) of one step of the entropic reduction, for shaders of your own; put it behind the #version
   line:

       vec2 softassign_join(vec2 a, vec2 b, float inverse_temperature)   of (minimum, sum of exp((minimum - x) / t)) */
SOFTASSIGN_DEF const char *softassign_gl_glsl(void);

#ifdef __cplusplus
}
#endif
#endif /* SOFTASSIGN__GL_API */
/* ------------------------------------------------------------------------------------------------
   Stop here if you only want to use the library.
   ------------------------------------------------------------------------------------------------ */

#if defined(SOFTASSIGN_IMPLEMENTATION) && !defined(SOFTASSIGN_IMPLEMENTED)
#define SOFTASSIGN_IMPLEMENTED

#ifndef SAT_SIBLING
#define SAT_SIBLING
#endif
#include "sat.h"

SAT__IEEE_BEGIN
#ifdef __cplusplus
extern "C" {
#endif

/* ------------------------------------------------------------------------------------------------
   >> sums
   Portability, limits, small sums
   ------------------------------------------------------------------------------------------------ */

#define SOFTASSIGN__INFINITY (sat__float_from_bits(0x7f800000u))
#define SOFTASSIGN__LARGEST_COST 1e30f /* sums of a million of them are floats */
#define SOFTASSIGN__LARGEST_FEATURE 1e16f
#define SOFTASSIGN__DENSE_CELLS 100000 /* a solver of frames has a matrix up to this */
#define SOFTASSIGN__MADE_CELLS 600000  /* from features or a function, one is made up to this */
#define SOFTASSIGN__WIDE 4             /* columns a row, columns and rows from which lists are faster than a matrix */
#define SOFTASSIGN__WIDE_COLUMNS 3000  /* where rows compete (the bench prints both times) */
#define SOFTASSIGN__WIDE_ROWS 128
#ifndef SOFTASSIGN__MATRIX_ALWAYS      /* the bench times what AUTO does not choose */
#define SOFTASSIGN__MATRIX_ALWAYS 0
#endif
#define SOFTASSIGN__MATRIX_CELLS 67108864 /* a given matrix up to this is tried without lists */
#define SOFTASSIGN__SPARSE 32          /* a larger sparse one with fewer of its cells than one in this goes to lists */
#define SOFTASSIGN__SHORT_LIST 16      /* the first ones where rows hardly compete */
#define SOFTASSIGN__DIMS 16            /* coordinates of the cheap bound; the last is the norm of what the others
                                          leave */
#define SOFTASSIGN__BOUND_FEATURES 1024 /* features beyond these are left out of the cheap bound */
#define SOFTASSIGN__BLOCK 16           /* columns that share a block minimum */
#define SOFTASSIGN__STEP 64            /* the same in a path on the matrix */

/* A sum whose rounding error does not grow with the number of terms (Neumaier 1974). */
typedef struct softassign__sum {
    double sum, correction, magnitude;
} softassign__sum;

static inline void softassign__add(softassign__sum *s, double x)
{
    double t = s->sum + x, a = fabs(s->sum), b = fabs(x);
    s->correction += a >= b ? (s->sum - t) + x : (x - t) + s->sum;
    s->sum = t;
    s->magnitude += b;
}

static inline double softassign__total(const softassign__sum *s) { return s->sum + s->correction; }
/* Not above the exact sum of the exact terms, each of which was rounded once. */
static inline double softassign__total_below(const softassign__sum *s)
{
    return s->sum + s->correction - s->magnitude * 4.5e-16;
}

/* magnitude: the sum of |costs|, for a cost of 0 that is a sum of others. */
static inline double softassign__gap(double cost, double bound, double magnitude)
{
    double off = cost - bound, size = fabs(cost);
    if (!(off > 0)) return 0;
    if (!sat__is_finite_double(bound)) return (double)SOFTASSIGN__INFINITY;
    if (size > 0) return off / size;
    return off <= 1e-13 * magnitude ? 0 : (double)SOFTASSIGN__INFINITY;
}

/* 1 / sqrt(t), but no more than keeps the sum of `count` elements of exp(70) or exp(650) finite: below that temperature
   it only weighs elements against the outlier, which is nothing beside them. */
static inline double softassign__published_factor(double t, int count, int wide)
{
    double factor = 1 / sqrt(t), largest = (wide ? 1e25 : 1e7) / count;
    return factor < largest ? factor : largest;
}

/* splitmix64 */
static inline uint64_t softassign__random(uint64_t *state)
{
    uint64_t z = (*state += 0x9e3779b97f4a7c15u);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return z ^ (z >> 31);
}
static inline double softassign__uniform(uint64_t *state)
{
    return (double)(softassign__random(state) >> 11) * 1.1102230246251565e-16;
}

/* ------------------------------------------------------------------------------------------------
   >> options
   The table of options, and what is refused
   ------------------------------------------------------------------------------------------------ */

static const sat__field softassign__fields[] = {
    SAT__FIELD(softassign_options, 'i', method, SOFTASSIGN_AUTO, SOFTASSIGN_AUTO, SOFTASSIGN_ANTS, ' '),
    SAT__FIELD(softassign_options, 'd', gap, 0.001, 0, 1e300, 'I'),
    SAT__FIELD(softassign_options, 'i', capacity_default, 1, 0, 2147483647, ' '),
    SAT__FIELD(softassign_options, 'i', neighbours, 160, 4, 256, ' '),
    SAT__FIELD(softassign_options, 'i', certify, 1, 0, 1, ' '),
    SAT__FIELD(softassign_options, 'd', temperature, 0.3, 0, 1e30, ' '),
    SAT__FIELD(softassign_options, 'd', cooling, 0.5, 0, 1, ' '),
    {"iterations[0]", offsetof(softassign_options, iterations), 'i', ' ', 6, 0, 2147483647, NULL},
    {"iterations[1]", offsetof(softassign_options, iterations) + sizeof(int), 'i', ' ', 10, 0, 2147483647, NULL},
    {"iterations[2]", offsetof(softassign_options, iterations) + 2 * sizeof(int), 'i', ' ', 10, 0, 2147483647, NULL},
    SAT__FIELD(softassign_options, 'd', alpha, 1, -1e30, 1e30, ' '),
    SAT__FIELD(softassign_options, 'd', outlier, 1e6, 0, 1e30, ' '),
    SAT__FIELD(softassign_options, 'i', outlier_evolves, 0, 0, 1, ' '),
    SAT__FIELD(softassign_options, 'i', gold, 0, 0, 1, ' '),
    SAT__FIELD(softassign_options, 'i', double_precision, 0, 0, 1, ' '),
    SAT__FIELD(softassign_options, 'i', gather, 4, 2, 64, ' '),
    SAT__FIELD(softassign_options, 'i', ants, 30, 1, 2147483647, ' '),
    SAT__FIELD(softassign_options, 'd', evaporation, 0.1, 0, 1, ' '),
    SAT__FIELD(softassign_options, 'd', noise, 1, 0, 1, ' '),
    SAT__FIELD(softassign_options, 'd', switching, 0, 0, 1e6, ' '),
    SAT__FIELD(softassign_options, 'i', grid_width, 0, 0, 2147483647, ' '),
    SAT__FIELD(softassign_options, 'd', min_distance, 0, 0, 1e9, ' '),
    SAT__FIELD(softassign_options, 'a', allocator, 0, 0, 0, ' '),
    SAT__FIELD(softassign_options, 't', threads, 0, 0, 0, ' '),
};

/* The table, and what one field asks of another. 1 when all is well. */
static int softassign__explain_options(sat__text *t, const softassign_options *o)
{
    const sat__field *wrong = sat__fields_check(o, softassign__fields, SAT__COUNT(softassign__fields));
    if (wrong) sat__text_field(t, wrong, o);
    else if (o->min_distance > 0 && o->grid_width < 1)
        sat__text_add(t, "grid_width is 0; min_distance above 0 needs the grid");
    else if ((o->row_price || o->column_price) && (int)o->method > (int)SOFTASSIGN_EXACT)
        sat__text_add(t, "row_price or column_price is given; only AUTO and EXACT have them");
    else if (o->row_margin && (int)o->method > (int)SOFTASSIGN_EXACT)
        sat__text_add(t, "row_margin is given; only AUTO and EXACT have it");
    else if (o->row_margin && o->min_distance > 0)
        sat__text_add(t, "row_margin is given; min_distance does not go with it");
    else return 1;
    return 0;
}

static int softassign__options_are_valid(const softassign_options *o)
{
    sat__text ignored = sat__text_begin(NULL, 0);
    return softassign__explain_options(&ignored, o);
}

SOFTASSIGN_DEF const char *softassign_explain(char *text, size_t size, const softassign_options *options)
{
    sat__text t = sat__text_begin(text, size);
    if (options) softassign__explain_options(&t, options);
    return text;
}

static int softassign__explain_element(sat__text *t, const char *name, int index, int value, int low, int high)
{
    if (value >= low && value <= high) return 1;
    sat__text_add(t, name);
    sat__text_add(t, "[");
    sat__text_number(t, index);
    sat__text_range(t, "]", value, low, high, ' ');
    return 0;
}

static inline int softassign__is_matrix(const softassign_problem *p)
{
    return p->cost || p->cost_double || p->cost_int;
}
static inline int softassign__is_features(const softassign_problem *p)
{
    return !softassign__is_matrix(p) && !p->cost_fn;
}

/* A sparse matrix whose rows follow each other, columns rising. */
static int softassign__explain_sparse(sat__text *t, const softassign_problem *p)
{
    int i, k;
    if (!softassign__is_matrix(p)) sat__text_add(t, "row_start is given; cost, cost_double and cost_int are NULL");
    else if (!p->column_index) sat__text_add(t, "row_start is given; column_index is NULL");
    else if (!softassign__explain_element(t, "row_start", 0, p->row_start[0], 0, 0)) return 0;
    else {
        for (i = 0; i < p->rows; i++)
            if (!softassign__explain_element(t, "row_start", i + 1, p->row_start[i + 1], p->row_start[i], 2147483647))
                return 0;
        for (i = 0; i < p->rows; i++)
            for (k = p->row_start[i]; k < p->row_start[i + 1]; k++)
                if (!softassign__explain_element(t, "column_index", k, p->column_index[k],
                                                 k > p->row_start[i] ? p->column_index[k - 1] + 1 : 0, p->columns - 1))
                    return 0;
        return 1;
    }
    return 0;
}

/* Where the costs come from, and the lists that go with columns and rows. */
static int softassign__explain_costs(sat__text *t, const softassign_problem *p)
{
    int i, features = p && softassign__is_features(p);
    if (!p) sat__text_add(t, "problem is NULL");
    else if (p->rows < 1) sat__text_range(t, "rows", p->rows, 1, 2147483647, ' ');
    else if (p->columns < 1) sat__text_range(t, "columns", p->columns, 1, 2147483647, ' ');
    else if (softassign__is_matrix(p) && !p->row_start && p->stride && p->stride < p->columns &&
             p->stride > -(ptrdiff_t)p->columns && p->rows > 1)
        sat__text_add(t, "stride is shorter than a row of the matrix");
    else if (p->row_start && !softassign__explain_sparse(t, p)) return 0;
    else if (features && !p->row_features) sat__text_add(t, "cost, cost_fn and row_features are NULL");
    else if (features && !p->column_features) sat__text_add(t, "column_features is NULL");
    else if (features && p->feature_count < 1)
        sat__text_range(t, "feature_count", p->feature_count, 1, 2147483647, ' ');
    else if (p->maximise < 0 || p->maximise > 1) sat__text_range(t, "maximise", p->maximise, 0, 1, ' ');
    else if (!(p->unassigned_cost >= 0 && p->unassigned_cost <= SOFTASSIGN__LARGEST_COST))
        sat__text_range(t, "unassigned_cost", (double)p->unassigned_cost, 0, 1e30, ' ');
    else {
        for (i = 0; p->capacity && i < p->columns; i++)
            if (!softassign__explain_element(t, "capacity", i, p->capacity[i], 0, 2147483647)) return 0;
        for (i = 0; p->minimum_use && i < p->columns; i++)
            if (!softassign__explain_element(t, "minimum_use", i, p->minimum_use[i], 0, 2147483647)) return 0;
        for (i = 0; p->previous && i < p->rows; i++)
            if (!softassign__explain_element(t, "previous", i, p->previous[i], -1, p->columns - 1)) return 0;
        return 1;
    }
    return 0;
}

/* What not every method can do. */
static int softassign__explain_problem(sat__text *t, const softassign_problem *p, const softassign_options *o)
{
    int j, exact = (int)o->method <= (int)SOFTASSIGN_FAST;
    if (!softassign__explain_costs(t, p)) return 0;
    for (j = 0; p->minimum_use && j < p->columns; j++)
        if (!softassign__explain_element(t, "minimum_use", j, p->minimum_use[j], 0, p->capacity ? p->capacity[j] : o->capacity_default)) return 0;
    if (p->minimum_use && !exact) sat__text_add(t, "minimum_use is given; only AUTO, EXACT and FAST take it");
    else if (p->minimum_use && (o->row_price || o->column_price)) sat__text_add(t, "minimum_use is given; row_price and column_price do not go with it");
    else if (p->minimum_use && o->row_margin) sat__text_add(t, "minimum_use is given; row_margin does not go with it");
    else if (!p->cost && (p->cost_double || p->cost_int) &&
             (o->method == SOFTASSIGN_ENTROPIC || o->method == SOFTASSIGN_PUBLISHED))
        sat__text_add(t, "cost_double or cost_int is given; ENTROPIC and PUBLISHED read floats");
    else if (p->maximise && !exact) sat__text_add(t, "maximise is 1; only AUTO, EXACT and FAST take it");
    else if (p->unassigned_cost > 0 && !exact) sat__text_add(t, "unassigned_cost is above 0; only AUTO, EXACT and FAST take it");
    else if (p->unassigned_cost > 0 && o->min_distance > 0) sat__text_add(t, "unassigned_cost is above 0; min_distance does not go with it");
    else return 1;
    return 0;
}

static int softassign__problem_is_valid(const softassign_problem *p)
{
    sat__text ignored = sat__text_begin(NULL, 0);
    return softassign__explain_costs(&ignored, p);
}

SOFTASSIGN_DEF const char *softassign_explain_problem(char *text, size_t size, const softassign_problem *problem,
                                                const softassign_options *options)
{
    sat__text t = sat__text_begin(text, size);
    softassign_options o = options ? *options : softassign_defaults();
    if (softassign__explain_options(&t, &o)) softassign__explain_problem(&t, problem, &o);
    return text;
}

/* ------------------------------------------------------------------------------------------------
   >> solver
   The solver's memory
   ------------------------------------------------------------------------------------------------ */

typedef struct softassign__candidate {
    double value; /* cost - price */
    float cost;
    int slot;
} softassign__candidate;

/* What one worker needs to list a row. */
typedef struct softassign__scratch {
    float *keys;      /* per slot, never above cost - price */
    float *block_min; /* of 16 keys */
    float *select;    /* copy of the above for the selection */
    softassign__candidate *candidates;
    size_t distances;
} softassign__scratch;

enum {
    SOFTASSIGN__START,
    SOFTASSIGN__LISTS,
    SOFTASSIGN__PRICES,
    SOFTASSIGN__RELIST,
    SOFTASSIGN__PATHS,
    SOFTASSIGN__FINISH,
    SOFTASSIGN__REPAIR,
    SOFTASSIGN__DONE
};

/* Index of the smallest value of a row, -1: none is finite; the second smallest value, and where it is. Ties go to the
   smaller index. */
typedef struct softassign__pair_of_least {
    int at, second_at;
    double least, second;
} softassign__pair_of_least;

typedef struct softassign__fixed softassign__fixed;

/* Slots are the columns, followed by one mandatory slot for each column with a minimum use: same costs, but its
   price starts at `top`, so high that rows go there; a full one may have any price. One that stays free all the same is
   filled by the exact repair. */
struct softassign {
    softassign_options options;
    sat_allocator allocator;
    size_t bytes;
    void *block;
    int rows, columns, max_slots, padded, list, has_lists; /* columns: one more where rows may stay without one */
    int most_columns;      /* the same with that one in any case, in a solver made by softassign_create */
    int dense;             /* costs stand in `matrix`, or */
    int in_place;          /* in problem.cost or cost_double, as they are */
    int wide;              /* costs are doubles or integers, */
    int integers;          /* or integers */
    size_t paths_from;     /* stats.work when the paths on the matrix began */
    int dense_paths;       /* and paths are searched on it, without lists */
    int unit_capacities;   /* every slot holds one row, but for the one that stands for none */
    int none;              /* that slot, or -1. Paths on the matrix end there: it is always free, and its first_row
                              stays -1 */
    int square;            /* as many rows as columns, and every row gets one: all columns are used */
    int all_open;          /* no slot has a capacity of 0 */
    int projected;         /* costs are distances of features, which projections bound from below */

    softassign_problem problem;
    int slot_count, dims;
    float shrink, slack;   /* bound = distance of the projections * shrink - slack */
    float *matrix;         /* dense: rows x columns costs, the bonus included */
    double *wide_matrix;   /* the same memory where `wide` */
    float *coarse;         /* per 16 slots: dims x 16 projected coordinates */
    float *row_coarse;     /* rows x dims */
    double *basis;         /* dims x features */
    int *slot_column, *capacity;
    double *top;

    double *price;
    float *price_f;        /* the same as floats, never below */
    int *used, *first_row; /* per slot: how many rows it holds, and the first of them */
    int *slot_of_row, *next_row;
    double *cost_of_row;   /* cost of the row's slot, with the switching bonus */
    float bonus;

    int *list_slot;        /* rows x list, by value when listed */
    float *list_cost, *list_value; /* costs: see softassign__listed_cost */
    int *list_length, *list_wanted; /* wanted: of the row's next list */
    int easy;              /* a sample of the rows hardly competes: short lists, and no prices first */
    int *row_result;       /* checks: a row's sat_result; the memory of list_length, which comes later */
    double *row_largest;   /* checks: its largest finite |cost|, where `wide`; the memory of row_distance */
    double scale;          /* the largest of those and of unassigned_cost, 0 where not `wide` */
    float *pheromone;      /* ants: of the columns in the lists; the memory of list_value, which they do not read */
    int *order;            /* ants: rows; the memory of `closed` of the paths */
    int *holders;          /* rows that hold a slot in an assignment beside the solver's; the memory of `touched` */
    double *list_limit;    /* every slot outside the list has cost - price at or above this, as long as prices fall */
    unsigned char *raised; /* per slot: its price rose since the lists were made */
    unsigned char *stale;  /* per row: its list is to be made (anew) */

    double *distance, *row_distance; /* path search: per slot, per row */
    double *bid;           /* auction: what the row pays for its place */
    double *dense_price, *closed_distance; /* the same on the matrix: prices of open slots, distances of closed ones, */
    softassign__pair_of_least *seen; /* of each row at prices of 0, */
    int has_seen;          /* where costs were checked */
    double dearest;        /* no |price| is above it */
    double *block_distance; /* the smallest distance of SOFTASSIGN__STEP slots, */
    float *reach;          /* and distance + price of a slot, not below it */
    int *parent, *stamp, *row_stamp, *touched, *closed, *heap, *heap_at;
    double *parent_cost;
    int epoch, heap_size;
    float *column_sum, *soft_row;

    softassign__scratch *scratch;
    int *kept, *leader, *shown, *shown_column; /* slots of rows: best so far, best ant, for the caller; columns of
                                                  those */
    int phase, next, left, prices_known;
    double temperature, bound;
    double excess;         /* of the proof, see softassign__prove */
    int proving, stopped;  /* costs of the bound include the bonus; the progress callback said stop */
    softassign__fixed *exact_price, *exact_distance;
    int schedule[2];
    softassign_stats stats;
};

static inline int softassign__column(const softassign *s, int slot)
{
    return slot < s->columns ? slot : s->slot_column[slot];
}

/* The float at x, or the next one above. */
static inline float softassign__round_up(double x)
{
    float f = (float)x;
    return (double)f < x ? f + (fabsf(f) * 1.2e-7f + 1e-44f) : f;
}

static inline void softassign__set_price(softassign *s, int slot, double price)
{
    s->price[slot] = price;
    s->price_f[slot] = softassign__round_up(price);
    if (fabs(price) > s->dearest) s->dearest = fabs(price);
}

/* ------------------------------------------------------------------------------------------------
   >> costs
   Costs
   ------------------------------------------------------------------------------------------------ */

/* Euclidean distance in four partial sums. Every distance of the library comes from here, so that a pair has ONE
   cost: two roundings of it would let a path search go round in circles. */
static float softassign__distance(const float *a, const float *b, int n)
{
    float lanes[4];
    int k = 0;
    sat__f32x4 sum = sat__f32x4_set1(0);
    for (; k + 4 <= n; k += 4) {
        sat__f32x4 d = sat__f32x4_sub(sat__f32x4_load(a + k), sat__f32x4_load(b + k));
        sum = sat__f32x4_add(sum, sat__f32x4_mul(d, d));
    }
    sat__f32x4_store(lanes, sum);
    for (; k < n; k++) lanes[k & 3] += (a[k] - b[k]) * (a[k] - b[k]);
    return sqrtf((lanes[0] + lanes[1]) + (lanes[2] + lanes[3]));
}

/* Where the cost of a pair stands in a given matrix; -1: nowhere. */
static inline ptrdiff_t softassign__element(const softassign_problem *p, int row, int column)
{
    int low, high;
    if (!p->row_start) return (ptrdiff_t)row * (p->stride ? p->stride : p->columns) + column;
    low = p->row_start[row];
    high = p->row_start[row + 1];
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (p->column_index[middle] < column) low = middle + 1;
        else high = middle;
    }
    return low < p->row_start[row + 1] && p->column_index[low] == column ? low : -1;
}

/* An element of a given matrix, as it is minimised. */
static inline double softassign__value(const softassign_problem *p, ptrdiff_t at)
{
    double value;
    if (p->cost) value = (double)p->cost[at];
    else if (p->cost_double) value = p->cost_double[at];
    else if (p->cost_int[at] == (p->maximise ? -2147483647 - 1 : 2147483647)) return (double)SOFTASSIGN__INFINITY;
    else value = (double)p->cost_int[at];
    return p->maximise ? -value : value;
}

/* The cost of a pair as the problem states it, negative where it asks for the largest total. The column behind the
   last stands for none. */
static double softassign__pair(const softassign_problem *p, int row, int column)
{
    double value;
    if (column >= p->columns) value = (double)p->unassigned_cost;
    else if (softassign__is_matrix(p)) {
        ptrdiff_t at = softassign__element(p, row, column);
        return at < 0 && p->row_start ? (double)SOFTASSIGN__INFINITY : softassign__value(p, at);
    } else if (p->cost_fn) value = (double)p->cost_fn(row, column, p->cost_user);
    else
        value = (double)softassign__distance(p->row_features + (size_t)row * (size_t)p->feature_count,
                                             p->column_features + (size_t)column * (size_t)p->feature_count,
                                             p->feature_count);
    return p->maximise ? -value : value;
}

/* A row of the matrix: floats, or doubles. */
typedef struct softassign__row {
    const float *f;
    const double *d;
} softassign__row;

static inline softassign__row softassign__matrix_row(const softassign *s, int row)
{
    softassign__row r = {NULL, NULL};
    ptrdiff_t at = s->in_place ? softassign__element(&s->problem, row, 0) : (ptrdiff_t)row * s->columns;
    if (s->wide) r.d = (s->in_place ? s->problem.cost_double : s->wide_matrix) + at;
    else r.f = (s->in_place ? s->problem.cost : s->matrix) + at;
    SAT_ASSERT(r.f || r.d);
    return r;
}

static inline double softassign__row_cost(softassign__row r, int j) { return r.f ? (double)r.f[j] : r.d[j]; }

/* The cost that is minimised: less the bonus for staying. */
static inline double softassign__cost(const softassign *s, int row, int slot)
{
    int column = softassign__column(s, slot);
    double cost;
    if (s->dense) return softassign__row_cost(softassign__matrix_row(s, row), column);
    cost = softassign__pair(&s->problem, row, column);
    if (!s->problem.previous || s->problem.previous[row] != column) return cost;
    return s->wide ? cost - (double)s->bonus : (double)((float)cost - s->bonus);
}

/* The cost of an entry of a list: floats stand there, doubles do not. */
static inline double softassign__listed_cost(const softassign *s, int row, size_t at)
{
    return s->wide ? softassign__cost(s, row, s->list_slot[at]) : (double)s->list_cost[at];
}

/* keys[j] <= cost - price for every slot, from the projections: |P(a - b)| <= |a - b| for orthonormal P. */
static void softassign__project_keys(const softassign *s, int row, softassign__scratch *w)
{
    const float *p = s->row_coarse + (size_t)row * (size_t)s->dims, *c = s->coarse;
    int b, k, l, dims = s->dims;
    for (b = 0; b < s->padded; b += SOFTASSIGN__BLOCK) {
        float *keys = w->keys + b;
        sat__f32x4 a0 = sat__f32x4_set1(0), a1 = a0, a2 = a0, a3 = a0, least;
        sat__f32x4 acc[4];
        for (k = 0; k < dims; k++, c += SOFTASSIGN__BLOCK) {
            sat__f32x4 x = sat__f32x4_set1(p[k]), d0 = sat__f32x4_sub(x, sat__f32x4_load(c));
            sat__f32x4 d1 = sat__f32x4_sub(x, sat__f32x4_load(c + 4)), d2 = sat__f32x4_sub(x, sat__f32x4_load(c + 8));
            sat__f32x4 d3 = sat__f32x4_sub(x, sat__f32x4_load(c + 12));
            a0 = sat__f32x4_add(a0, sat__f32x4_mul(d0, d0));
            a1 = sat__f32x4_add(a1, sat__f32x4_mul(d1, d1));
            a2 = sat__f32x4_add(a2, sat__f32x4_mul(d2, d2));
            a3 = sat__f32x4_add(a3, sat__f32x4_mul(d3, d3));
        }
        acc[0] = a0;
        acc[1] = a1;
        acc[2] = a2;
        acc[3] = a3;
        least = sat__f32x4_set1(SOFTASSIGN__INFINITY);
        for (l = 0; l < 4; l++) {
            sat__f32x4 bound = sat__f32x4_mul(sat__f32x4_sqrt(acc[l]), sat__f32x4_set1(s->shrink));
            sat__f32x4 price = sat__f32x4_load(s->price_f + b + 4 * l);
            sat__f32x4 loss = sat__f32x4_mul(sat__f32x4_add(bound, sat__f32x4_abs(price)), sat__f32x4_set1(3e-7f));
            bound = sat__f32x4_sub(sat__f32x4_sub(sat__f32x4_sub(bound, price), loss), sat__f32x4_set1(s->slack));
            sat__f32x4_store(keys + 4 * l, bound);
            least = sat__f32x4_min(bound, least);
        }
        {
            float m[4];
            sat__f32x4_store(m, least);
            m[0] = m[1] < m[0] ? m[1] : m[0];
            m[2] = m[3] < m[2] ? m[3] : m[2];
            w->block_min[b / SOFTASSIGN__BLOCK] = m[2] < m[0] ? m[2] : m[0];
        }
    }
}

/* The same from costs that are known. */
static void softassign__dense_keys(const softassign *s, int row, softassign__scratch *w)
{
    int j, l;
    for (j = 0; j < s->slot_count; j++) {
        float cost = (float)softassign__cost(s, row, j), price = s->price_f[j];
        w->keys[j] = cost < SOFTASSIGN__INFINITY && s->capacity[j] > 0
                         ? (cost - price) - (fabsf(cost) + fabsf(price)) * 3e-7f
                         : SOFTASSIGN__INFINITY;
    }
    w->distances += (size_t)s->slot_count;
    for (; j < s->padded; j++) w->keys[j] = SOFTASSIGN__INFINITY;
    for (j = 0; j < s->padded; j += SOFTASSIGN__BLOCK) {
        float least = SOFTASSIGN__INFINITY;
        for (l = 0; l < SOFTASSIGN__BLOCK; l++) least = w->keys[j + l] < least ? w->keys[j + l] : least;
        w->block_min[j / SOFTASSIGN__BLOCK] = least;
    }
}

/* Slots without capacity, and what pads the last block, are in nobody's sight: no block minimum stands for them. The
   column that stands for none has no features. */
static void softassign__hide_closed(const softassign *s, softassign__scratch *w)
{
    int b, j, none = s->problem.columns;
    if (none < s->columns) {
        float cost = (float)softassign__pair(&s->problem, 0, none), price = s->price_f[none];
        w->keys[none] = (cost - price) - (fabsf(cost) + fabsf(price)) * 3e-7f;
    }
    for (b = s->all_open ? sat__min_int(none, s->slot_count) / SOFTASSIGN__BLOCK * SOFTASSIGN__BLOCK : 0; b < s->padded;
         b += SOFTASSIGN__BLOCK) {
        float least = SOFTASSIGN__INFINITY;
        for (j = b; j < b + SOFTASSIGN__BLOCK; j++) {
            if (j >= s->slot_count || s->capacity[j] == 0) w->keys[j] = SOFTASSIGN__INFINITY;
            least = w->keys[j] < least ? w->keys[j] : least;
        }
        w->block_min[b / SOFTASSIGN__BLOCK] = least;
    }
}

static void softassign__keys(const softassign *s, int row, softassign__scratch *w)
{
    int j, stay;
    if (s->dense || !s->projected) {
        softassign__dense_keys(s, row, w);
        return;
    }
    softassign__project_keys(s, row, w);
    softassign__hide_closed(s, w);
    if (!s->problem.previous || (stay = s->problem.previous[row]) < 0) return;
    for (j = stay; j < s->slot_count; j = j < s->columns ? s->columns : j + 1)
        if (softassign__column(s, j) == stay && s->capacity[j] > 0) {
            w->keys[j] -= s->bonus * 1.000001f;
            if (w->keys[j] < w->block_min[j / SOFTASSIGN__BLOCK]) w->block_min[j / SOFTASSIGN__BLOCK] = w->keys[j];
        }
}

/* ------------------------------------------------------------------------------------------------
   >> bound
   The cheap bound: projection onto the main directions of the column features
   ------------------------------------------------------------------------------------------------ */

/* Gram and Schmidt, twice, so that the directions are orthonormal to rounding. Directions that vanish become 0. */
static void softassign__orthonormalise(double *basis, int count, int n)
{
    int a, b, k, pass;
    for (a = 0; a < count; a++) {
        double *v = basis + (size_t)a * (size_t)n, before = 0, after = 0;
        for (k = 0; k < n; k++) before += v[k] * v[k];
        for (pass = 0; pass < 2; pass++)
            for (b = 0; b < a; b++) {
                const double *u = basis + (size_t)b * (size_t)n;
                double dot = 0;
                for (k = 0; k < n; k++) dot += u[k] * v[k];
                for (k = 0; k < n; k++) v[k] -= dot * u[k];
            }
        for (k = 0; k < n; k++) after += v[k] * v[k];
        after = after > before * 1e-20 && after > 1e-300 ? 1 / sqrt(after) : 0;
        for (k = 0; k < n; k++) v[k] *= after;
    }
}

/* A few steps of subspace iteration on a sample of the columns. Any orthonormal basis gives a valid bound; this one
   makes it tight. The mean stands behind the basis. */
static void softassign__find_basis(softassign *s, int n, int directions)
{
    const softassign_problem *p = &s->problem;
    double *mean = s->basis + (size_t)directions * (size_t)n, *next = mean + n;
    int samples = sat__min_int(p->columns, 512), i, k, a, step;
    uint64_t seed = 1;
    for (k = 0; k < n; k++) mean[k] = 0;
    for (i = 0; i < samples; i++) {
        const float *f = p->column_features + (size_t)((int64_t)i * p->columns / samples) * (size_t)p->feature_count;
        for (k = 0; k < n; k++) mean[k] += (double)f[k] / samples;
    }
    for (k = 0; k < directions * n; k++) s->basis[k] = softassign__uniform(&seed) - 0.5;
    softassign__orthonormalise(s->basis, directions, n);
    for (step = 0; step < 4; step++) {
        for (k = 0; k < directions * n; k++) next[k] = 0;
        for (i = 0; i < samples; i++) {
            const float *f =
                p->column_features + (size_t)((int64_t)i * p->columns / samples) * (size_t)p->feature_count;
            for (a = 0; a < directions; a++) {
                const double *u = s->basis + (size_t)a * (size_t)n;
                double *v = next + (size_t)a * (size_t)n, dot = 0;
                for (k = 0; k < n; k++) dot += u[k] * ((double)f[k] - mean[k]);
                for (k = 0; k < n; k++) v[k] += dot * ((double)f[k] - mean[k]);
            }
        }
        for (k = 0; k < directions * n; k++) s->basis[k] = next[k];
        softassign__orthonormalise(s->basis, directions, n);
    }
}

/* Coordinates of one feature vector, `stride` floats apart; returns its norm around the mean. */
static double softassign__project(const softassign *s, const float *f, int n, int directions, float *out, int stride)
{
    const double *mean = s->basis + (size_t)directions * (size_t)n;
    double whole = 0, part = 0, rest;
    int a, k;
    for (k = 0; k < n; k++) whole += ((double)f[k] - mean[k]) * ((double)f[k] - mean[k]);
    for (a = 0; a < directions; a++) {
        const double *u = s->basis + (size_t)a * (size_t)n;
        double dot = 0;
        for (k = 0; k < n; k++) dot += u[k] * ((double)f[k] - mean[k]);
        part += dot * dot;
        out[a * stride] = (float)dot;
    }
    rest = whole > part ? sqrt(whole - part) : 0;
    if (s->dims > directions) out[directions * stride] = (float)rest;
    return sqrt(whole);
}

typedef struct softassign__projection {
    softassign *s;
    int features, directions;
    double largest[2]; /* norms are maxima: no order to mind */
    double *norm;      /* per worker, two */
} softassign__projection;

static void softassign__project_range(int begin, int end, int worker, void *context)
{
    softassign__projection *p = (softassign__projection *)context;
    softassign *s = p->s;
    int i, d = s->dims, wide = s->problem.feature_count;
    for (i = begin; i < end; i++) {
        double norm;
        int is_row = i >= s->slot_count, j = i - s->slot_count;
        if (!is_row && softassign__column(s, i) >= s->problem.columns) continue;
        if (is_row)
            norm = softassign__project(s, s->problem.row_features + (size_t)j * (size_t)wide, p->features,
                                       p->directions, s->row_coarse + (size_t)j * (size_t)d, 1);
        else
            norm = softassign__project(s, s->problem.column_features + (size_t)softassign__column(s, i) * (size_t)wide,
                                       p->features, p->directions,
                                       s->coarse + (size_t)(i / SOFTASSIGN__BLOCK) * (size_t)(d * SOFTASSIGN__BLOCK) +
                                           i % SOFTASSIGN__BLOCK,
                                       SOFTASSIGN__BLOCK);
        if (norm > p->norm[2 * worker + is_row]) p->norm[2 * worker + is_row] = norm;
    }
}

static void softassign__start_bound(softassign *s)
{
    softassign__projection p;
    int n = sat__min_int(s->problem.feature_count, SOFTASSIGN__BOUND_FEATURES), w, a;
    int workers = sat__worker_count(&s->options.threads);
    p.s = s;
    p.features = n;
    p.directions = n <= SOFTASSIGN__DIMS ? n : SOFTASSIGN__DIMS - 1;
    s->dims = sat__min_int(n, SOFTASSIGN__DIMS);
    p.norm = s->distance; /* not in use yet */
    if (n > SOFTASSIGN__DIMS) softassign__find_basis(s, n, p.directions);
    else
        for (a = 0; a < (n + 1) * n; a++) s->basis[a] = a < n * n && a % (n + 1) == 0 ? 1 : 0;
    for (w = 0; w < 2 * workers; w++) p.norm[w] = 0;
    memset(s->coarse, 0, (size_t)s->padded * (size_t)s->dims * sizeof(float)); /* what has no features reads as zeros */
    sat__parallel_for(&s->options.threads, s->slot_count + s->rows, softassign__project_range, &p);
    for (w = 1; w < workers; w++)
        for (a = 0; a < 2; a++)
            if (p.norm[2 * w + a] > p.norm[a]) p.norm[a] = p.norm[2 * w + a];
    s->shrink = 1 - 1.2e-7f * (float)(s->problem.feature_count + 32);
    if (s->shrink < 0) s->shrink = 0;
    s->slack = (float)((p.norm[0] + p.norm[1]) * 4.8e-7 + 1e-18 * sqrt((double)s->problem.feature_count + 4));
}

/* ------------------------------------------------------------------------------------------------
   >> lists
   Lists: the slots of smallest cost - price of a row, and a limit that no other slot falls below

   Prices only fall while paths are searched, so a list made at some prices stays valid with its limit. It need not
   grow: made anew at the prices of the moment it holds the columns that matter now.
   ------------------------------------------------------------------------------------------------ */

static inline int softassign__before(const softassign__candidate *a, const softassign__candidate *b)
{
    return a->value < b->value || (!(b->value < a->value) && a->slot < b->slot);
}

/* The k-th smallest (from 0) of n floats; reorders them. */
static float softassign__select(float *v, int n, int k)
{
    int low = 0, high = n - 1;
    while (low < high) {
        float pivot = v[low + (high - low) / 2];
        int i = low, j = high;
        while (i <= j) {
            while (v[i] < pivot) i++;
            while (v[j] > pivot) j--;
            if (i <= j) {
                float t = v[i];
                v[i++] = v[j];
                v[j--] = t;
            }
        }
        if (k <= j) high = j;
        else if (k >= i) low = i;
        else break;
    }
    return v[k];
}

/* Moves the k smallest of n candidates, in the total order above, to the front. */
static void softassign__partition(softassign__candidate *v, int n, int k)
{
    int low = 0, high = n - 1;
    while (low < high) {
        softassign__candidate pivot = v[low + (high - low) / 2];
        int i = low, j = high;
        while (i <= j) {
            while (softassign__before(&v[i], &pivot)) i++;
            while (softassign__before(&pivot, &v[j])) j--;
            if (i <= j) {
                softassign__candidate t = v[i];
                v[i++] = v[j];
                v[j--] = t;
            }
        }
        if (k <= j) high = j;
        else if (k >= i) low = i;
        else break;
    }
}

static void softassign__sort(softassign__candidate *v, int n)
{
    int gap, i, j;
    for (gap = 57; gap > 0; gap = gap == 57 ? 23 : gap == 23 ? 10 : gap == 10 ? 4 : gap == 4 ? 1 : 0) /* Ciura 2001 */
        for (i = gap; i < n; i++) {
            softassign__candidate x = v[i];
            for (j = i; j >= gap && softassign__before(&x, &v[j - gap]); j -= gap) v[j] = v[j - gap];
            v[j] = x;
        }
}

/* Rows are read from a sparse matrix. */
static inline int softassign__is_sparse(const softassign *s) { return s->problem.row_start && !s->dense; }

/* Appends a slot that the row may get; returns the new count. */
static inline int softassign__append(const softassign *s, int row, softassign__scratch *w, int count, int slot)
{
    softassign__candidate *c = &w->candidates[count];
    double cost = softassign__cost(s, row, slot);
    if (s->projected) w->distances++;
    if (s->capacity[slot] == 0 || !(cost < (double)SOFTASSIGN__INFINITY)) return count;
    c->cost = (float)cost;
    c->value = cost - s->price[slot];
    c->slot = slot;
    return count + 1;
}

/* Evaluates the slots with low < key <= high and appends them. */
static int softassign__gather(const softassign *s, int row, softassign__scratch *w, int count, float low, float high)
{
    int b, j, n = s->padded / SOFTASSIGN__BLOCK;
    for (b = 0; b < n; b++) {
        if (!(w->block_min[b] <= high)) continue;
        for (j = b * SOFTASSIGN__BLOCK; j < (b + 1) * SOFTASSIGN__BLOCK; j++)
            if (w->keys[j] <= high && w->keys[j] > low && j < s->slot_count && s->capacity[j] > 0)
                count = softassign__append(s, row, w, count, j);
    }
    return count;
}

/* All slots of a row of a sparse matrix: its columns, none, and mandatory slots. */
static int softassign__gather_sparse(const softassign *s, int row, softassign__scratch *w)
{
    const softassign_problem *p = &s->problem;
    int k, j, count = 0;
    for (k = p->row_start[row]; k < p->row_start[row + 1]; k++)
        count = softassign__append(s, row, w, count, p->column_index[k]);
    for (j = p->columns; j < s->slot_count; j++) count = softassign__append(s, row, w, count, j);
    return count;
}

/* A float at or above x. */
static inline float softassign__float_above(double x) { return (float)(x + fabs(x) * 1.2e-7 + 1e-44); }
static inline float softassign__float_below(double x) { return (float)(x - fabs(x) * 1.2e-7 - 1e-44); }

static void softassign__list_row(softassign *s, int row, softassign__scratch *w)
{
    int blocks = s->padded / SOFTASSIGN__BLOCK, k = s->list_wanted[row], count, q;
    size_t at = (size_t)row * (size_t)s->list;
    float cut = SOFTASSIGN__INFINITY;
    double limit = (double)SOFTASSIGN__INFINITY;
    if (!softassign__is_sparse(s)) softassign__keys(s, row, w);
    if (blocks > k && !softassign__is_sparse(s)) { /* at least k keys are not above the k-th smallest block minimum */
        memcpy(w->select, w->block_min, (size_t)blocks * sizeof(float));
        cut = softassign__select(w->select, blocks, k - 1);
        if (!(cut < 3e38f)) cut = SOFTASSIGN__INFINITY;
    }
    count = softassign__is_sparse(s) ? softassign__gather_sparse(s, row, w)
                                     : softassign__gather(s, row, w, 0, -SOFTASSIGN__INFINITY, cut);
    if (count >= k) softassign__partition(w->candidates, count, k - 1);
    if (cut < SOFTASSIGN__INFINITY) { /* a slot that is better than the k-th so far has a key below it */
        float reach = cut;
        int old = count;
        if (count >= k) {
            reach = softassign__float_above(w->candidates[k - 1].value);
            if (reach > cut) count = softassign__gather(s, row, w, count, cut, reach);
        }
        limit = (double)(reach > cut ? reach : cut);
        if (count > old) softassign__partition(w->candidates, count, k - 1);
    }
    if (count > k) {
        for (q = k; q < count; q++)
            if (w->candidates[q].value < limit) limit = w->candidates[q].value;
        count = k;
    }
    softassign__sort(w->candidates, count);
    for (q = 0; q < count; q++) {
        s->list_slot[at + (size_t)q] = w->candidates[q].slot;
        s->list_cost[at + (size_t)q] = w->candidates[q].cost;
        s->list_value[at + (size_t)q] = softassign__float_below(w->candidates[q].value);
    }
    s->list_length[row] = count;
    s->list_limit[row] = limit;
}

static void softassign__list_range(int begin, int end, int worker, void *context)
{
    softassign *s = (softassign *)context;
    int i;
    for (i = s->next + begin; i < s->next + end; i++)
        if (s->stale[i]) softassign__list_row(s, i, &s->scratch[worker]);
}

/* A list made again while serial work goes on, twice as long where it was short. */
static void softassign__relist(softassign *s, int row)
{
    s->list_wanted[row] = sat__min_int(2 * s->list_wanted[row], s->list);
    softassign__list_row(s, row, &s->scratch[0]);
    s->stats.lists_built++;
}

/* The smallest cost - price of a row's list. */
static double softassign__list_least(const softassign *s, int row)
{
    size_t at = (size_t)row * (size_t)s->list, end = at + (size_t)s->list_length[row];
    double least = (double)SOFTASSIGN__INFINITY;
    for (; at < end; at++) {
        double value = softassign__listed_cost(s, row, at) - s->price[s->list_slot[at]];
        if (value < least) least = value;
    }
    return least;
}

/* ------------------------------------------------------------------------------------------------
   >> prices
   Softassign prices on lists

   min <C,X> + eps sum x ln x, row sums 1, column sums <= capacity. The projection onto a column's inequality is
   v <- min(top, v - eps ln(sum / capacity)): no outlier row. What lies beyond a list is left out: these prices are a
   start for the paths, which are exact from any start.
   ------------------------------------------------------------------------------------------------ */

/* exp for x <= 0 with a relative error of 3e-7; below -87 about 1e-38 (Cody and Waite reduction, minimax of degree
   5) */
static inline float softassign__exp(float x)
{
    float z, k, r, p;
    if (!(x > -87.0f)) x = -87.0f; /* NaN too */
    if (x > 88.0f) x = 88.0f;
    z = x * 1.44269504f + 12582912.0f;
    k = z - 12582912.0f;
    r = (x - k * 0.693359375f) - k * -2.12194440e-4f;
    p = 1.9875691500e-4f;
    p = p * r + 1.3981999507e-3f;
    p = p * r + 8.3334519073e-3f;
    p = p * r + 4.1665795894e-2f;
    p = p * r + 1.6666665459e-1f;
    p = p * r + 5.0000001201e-1f;
    p = p * r * r + r + 1.0f;
    return p * sat__float_from_bits((uint32_t)((int32_t)k + 127) << 23);
}

static inline sat__f32x4 softassign__exp4(sat__f32x4 x)
{
    sat__f32x4 z, k, r, p, magic = sat__f32x4_set1(12582912.0f);
    x = sat__f32x4_min(sat__f32x4_max(x, sat__f32x4_set1(-87.0f)), sat__f32x4_set1(88.0f));
    z = sat__f32x4_add(sat__f32x4_mul(x, sat__f32x4_set1(1.44269504f)), magic);
    k = sat__f32x4_sub(z, magic);
    r = sat__f32x4_sub(x, sat__f32x4_mul(k, sat__f32x4_set1(0.693359375f)));
    r = sat__f32x4_sub(r, sat__f32x4_mul(k, sat__f32x4_set1(-2.12194440e-4f)));
    p = sat__f32x4_set1(1.9875691500e-4f);
    p = sat__f32x4_add(sat__f32x4_mul(p, r), sat__f32x4_set1(1.3981999507e-3f));
    p = sat__f32x4_add(sat__f32x4_mul(p, r), sat__f32x4_set1(8.3334519073e-3f));
    p = sat__f32x4_add(sat__f32x4_mul(p, r), sat__f32x4_set1(4.1665795894e-2f));
    p = sat__f32x4_add(sat__f32x4_mul(p, r), sat__f32x4_set1(1.6666665459e-1f));
    p = sat__f32x4_add(sat__f32x4_mul(p, r), sat__f32x4_set1(5.0000001201e-1f));
    p = sat__f32x4_add(sat__f32x4_add(sat__f32x4_mul(sat__f32x4_mul(p, r), r), r), sat__f32x4_set1(1.0f));
    k = sat__f32x4_mul(sat__f32x4_add(k, sat__f32x4_set1(127.0f)), sat__f32x4_set1(8388608.0f));
    return sat__f32x4_mul(p, sat__f32x4_from_bits(sat__f32x4_truncate(k)));
}

/* 1 / eps, finite, so that 0 / eps is 0. */
static inline float softassign__inverse(float eps) { return eps > 1e-37f ? 1 / eps : 1e37f; }

/* e[q] = exp((least - e[q]) / eps); returns the sum. */
static float softassign__weights(float *e, int n, float least, float inverse)
{
    float lanes[4];
    int q = 0;
    sat__f32x4 sum = sat__f32x4_set1(0), top = sat__f32x4_set1(least), factor = sat__f32x4_set1(inverse);
    for (; q + 4 <= n; q += 4) {
        sat__f32x4 x = softassign__exp4(sat__f32x4_mul(sat__f32x4_sub(top, sat__f32x4_load(e + q)), factor));
        sat__f32x4_store(e + q, x);
        sum = sat__f32x4_add(sum, x);
    }
    sat__f32x4_store(lanes, sum);
    for (; q < n; q++) {
        e[q] = softassign__exp((least - e[q]) * inverse);
        lanes[q & 3] += e[q];
    }
    return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]);
}

/* One sweep over all rows; returns how far the fullest column overflows. */
static float softassign__price_sweep(softassign *s, float eps)
{
    float worst = 0, *e = s->soft_row;
    int i, j, q;
    for (j = 0; j < s->slot_count; j++) s->column_sum[j] = 0;
    for (i = 0; i < s->rows; i++) {
        size_t at = (size_t)i * (size_t)s->list;
        float least = SOFTASSIGN__INFINITY, sum;
        int again;
        for (again = 0; again < 2; again++) {
            least = SOFTASSIGN__INFINITY;
            for (q = 0; q < s->list_length[i]; q++) {
                e[q] = s->list_cost[at + (size_t)q] - s->price_f[s->list_slot[at + (size_t)q]];
                least = e[q] < least ? e[q] : least;
            }
            if (again || (double)least <= s->list_limit[i]) break;
            softassign__relist(s, i);
            s->stale[i] = 1; /* these prices may rise again */
        }
        sum = 1 / softassign__weights(e, s->list_length[i], least, softassign__inverse(eps));
        for (q = 0; q < s->list_length[i]; q++) s->column_sum[s->list_slot[at + (size_t)q]] += e[q] * sum;
    }
    for (j = 0; j < s->slot_count; j++) {
        double limit = s->top[j], price, fill;
        if (s->capacity[j] == 0) continue;
        fill = (double)s->column_sum[j] / s->capacity[j];
        if (fill > 1 && fill - 1 > (double)worst) worst = (float)(fill - 1);
        if (fill <= 1 && s->price[j] >= limit) continue;
        price = fill < 1e-36 ? s->price[j] + 82 * (double)eps : s->price[j] - (double)eps * log(fill);
        softassign__set_price(s, j, price < limit ? price : limit);
    }
    s->stats.iterations++;
    return worst;
}

/* ------------------------------------------------------------------------------------------------
   >> assignment
   Assignment: rows of a slot are a chain
   ------------------------------------------------------------------------------------------------ */

static inline int softassign__is_free(const softassign *s, int slot) { return s->used[slot] < s->capacity[slot]; }

static void softassign__unassign(softassign *s, int row)
{
    int slot = s->slot_of_row[row], *link;
    if (slot < 0) return;
    for (link = &s->first_row[slot]; *link != row;) link = &s->next_row[*link];
    *link = s->next_row[row];
    s->used[slot]--;
    s->slot_of_row[row] = -1;
}

static void softassign__assign(softassign *s, int row, int slot, double cost)
{
    softassign__unassign(s, row);
    s->slot_of_row[row] = slot;
    s->cost_of_row[row] = cost;
    s->next_row[row] = s->first_row[slot];
    s->first_row[slot] = row;
    s->used[slot]++;
}

/* ------------------------------------------------------------------------------------------------
   >> paths
   Shortest augmenting paths on lists

   Dijkstra over slots with reduced costs (c_ij - c_ix) - (v_j - v_x), where x is the row's own slot: differences of
   costs, so that one huge cost does not drown the small ones. A node slots + i stands for everything outside row i's
   list: when it surfaces, the list is made anew, and when that was not enough, the whole row is looked at. Closed
   nodes are never relaxed again.
   ------------------------------------------------------------------------------------------------ */

static inline double softassign__node_key(const softassign *s, int node)
{
    return node < s->slot_count ? s->distance[node] : s->row_distance[node - s->slot_count];
}

/* Order of the heap: distance, then free slots, full slots, lists; then the index. */
static inline int softassign__node_before(const softassign *s, int a, int b)
{
    double x = softassign__node_key(s, a), y = softassign__node_key(s, b);
    int class_a, class_b;
    if (x < y) return 1;
    if (y < x) return 0;
    class_a = a >= s->slot_count ? 2 : !softassign__is_free(s, a);
    class_b = b >= s->slot_count ? 2 : !softassign__is_free(s, b);
    return class_a < class_b || (class_a == class_b && a < b);
}

static void softassign__heap_up(softassign *s, int at)
{
    int node = s->heap[at];
    while (at > 0 && softassign__node_before(s, node, s->heap[(at - 1) / 2])) {
        s->heap[at] = s->heap[(at - 1) / 2];
        s->heap_at[s->heap[at]] = at;
        at = (at - 1) / 2;
    }
    s->heap[at] = node;
    s->heap_at[node] = at;
}

static void softassign__heap_push(softassign *s, int node)
{
    s->heap[s->heap_size] = node;
    softassign__heap_up(s, s->heap_size++);
}

static int softassign__heap_pop(softassign *s)
{
    int first = s->heap[0], node = s->heap[--s->heap_size], at = 0, child;
    while ((child = 2 * at + 1) < s->heap_size) {
        if (child + 1 < s->heap_size && softassign__node_before(s, s->heap[child + 1], s->heap[child])) child++;
        if (!softassign__node_before(s, s->heap[child], node)) break;
        s->heap[at] = s->heap[child];
        s->heap_at[s->heap[at]] = at;
        at = child;
    }
    s->heap[at] = node;
    s->heap_at[node] = at;
    return first;
}

typedef struct softassign__search {
    double nearest; /* distance of the nearest end met so far */
    double rise;    /* from a free slot to the end: 0, or of a margin */
    int root, avoided; /* the pair that a margin does without; -1 */
    double root_cost, root_price; /* reference of the root, which has no slot of its own */
    int row;        /* the row that is looked from, */
    double base, own_cost, own_price, shift; /* its distance, its reference, and base - (own_cost - own_price) */
} softassign__search;

enum { SOFTASSIGN__OPEN = 1, SOFTASSIGN__CLOSED = 2 };

/* Stamps are 4 * epoch + state: before that overflows they are wiped. */
#define SOFTASSIGN__LAST_EPOCH 0x1ffffffe
static void softassign__new_epoch(softassign *s)
{
    if (s->epoch++ < SOFTASSIGN__LAST_EPOCH) return;
    memset(s->stamp, 0, (size_t)s->max_slots * sizeof(int));
    memset(s->row_stamp, 0, (size_t)s->rows * sizeof(int));
    s->epoch = 1;
}

static void softassign__look_from(const softassign *s, softassign__search *q, int row, double base)
{
    q->row = row;
    q->base = base;
    q->own_cost = row == q->root ? q->root_cost : s->cost_of_row[row];
    q->own_price = row == q->root ? q->root_price : s->price[s->slot_of_row[row]];
    q->shift = base - (q->own_cost - q->own_price);
}

/* The distance at which a slot surfaces whose cost - price is at least `value`, never above it. */
static inline double softassign__surface(const softassign__search *q, double value)
{
    return value + q->shift - (fabs(value) + fabs(q->shift)) * 4e-16;
}

static void softassign__open(softassign *s, int slot, double distance)
{
    int known = s->stamp[slot] - 4 * s->epoch;
    s->distance[slot] = distance;
    if (known == SOFTASSIGN__OPEN) softassign__heap_up(s, s->heap_at[slot]);
    else {
        s->stamp[slot] = 4 * s->epoch + SOFTASSIGN__OPEN;
        softassign__heap_push(s, slot);
    }
}

static void softassign__relax(softassign *s, softassign__search *q, int slot, double cost)
{
    double w = q->base + ((cost - q->own_cost) - (s->price[slot] - q->own_price));
    int known = s->stamp[slot] - 4 * s->epoch;
    if (slot == q->avoided) { /* the end of a circle, which must not begin with the pair itself */
        if (q->row != q->root && w < q->nearest) q->nearest = w < q->base ? q->base : w;
        return;
    }
    if (known == SOFTASSIGN__CLOSED || w >= q->nearest) {
        if (known == SOFTASSIGN__CLOSED || w > q->nearest || !softassign__is_free(s, slot)) return;
    }
    if (w < q->base) w = q->base; /* rounding */
    if (known == SOFTASSIGN__OPEN && w >= s->distance[slot]) return;
    s->parent[slot] = q->row;
    s->parent_cost[slot] = cost;
    softassign__open(s, slot, w);
    if (w + q->rise < q->nearest && softassign__is_free(s, slot)) q->nearest = w + q->rise;
}

/* Relaxes the row's list at distance `base`, and leaves a node for the rest. */
static void softassign__relax_list(softassign *s, softassign__search *q, int row, double base)
{
    size_t at = (size_t)row * (size_t)s->list, end = at + (size_t)s->list_length[row];
    double beyond;
    softassign__look_from(s, q, row, base);
    for (; at < end; at++) {
        if (softassign__surface(q, (double)s->list_value[at]) > q->nearest) break; /* sorted */
        softassign__relax(s, q, s->list_slot[at], softassign__listed_cost(s, row, at));
    }
    if (s->list_limit[row] >= (double)SOFTASSIGN__INFINITY) return;
    beyond = softassign__surface(q, s->list_limit[row]);
    if (beyond >= q->nearest) return;
    s->row_distance[row] = beyond < base ? base : beyond;
    softassign__heap_push(s, s->slot_count + row);
}

/* Relaxes every slot of the row. */
static void softassign__relax_row(softassign *s, softassign__search *q, int row, double base)
{
    softassign__scratch *w = &s->scratch[0];
    int j, count;
    softassign__look_from(s, q, row, base);
    s->stats.rows_expanded++;
    if (softassign__is_sparse(s)) {
        count = softassign__gather_sparse(s, row, w);
        for (j = 0; j < count; j++)
            softassign__relax(s, q, w->candidates[j].slot, softassign__cost(s, row, w->candidates[j].slot));
        return;
    }
    softassign__keys(s, row, w);
    for (j = 0; j < s->slot_count; j++) {
        int known = s->stamp[j] - 4 * s->epoch;
        double least = softassign__surface(q, (double)w->keys[j]), cost;
        if (s->capacity[j] == 0 || least > q->nearest || known == SOFTASSIGN__CLOSED) continue;
        if (known == SOFTASSIGN__OPEN && least >= s->distance[j]) continue;
        cost = softassign__cost(s, row, j);
        if (s->projected) w->distances++;
        if (cost < (double)SOFTASSIGN__INFINITY) softassign__relax(s, q, j, cost);
    }
}

/* The node of a list surfaced at distance key. */
static void softassign__open_list(softassign *s, softassign__search *q, int row)
{
    double base = row == q->root ? 0 : s->distance[s->slot_of_row[row]];
    if (s->row_stamp[row] == s->epoch) {
        softassign__relax_row(s, q, row, base);
        return;
    }
    s->row_stamp[row] = s->epoch;
    softassign__relist(s, row);
    softassign__relax_list(s, q, row, base);
}

/* Assigns the root along the shortest path and lowers the prices on the way; 0 when no path exists. */
static int softassign__augment(softassign *s, int root)
{
    softassign__search q;
    int closed = 0, end = -1, i, j;
    size_t at = (size_t)root * (size_t)s->list, q_at;
    double least = (double)SOFTASSIGN__INFINITY;
    q.root = root;
    q.avoided = -1;
    q.rise = 0;
    q.nearest = (double)SOFTASSIGN__INFINITY;
    softassign__new_epoch(s);
    s->heap_size = 0;
    s->stats.paths++;
    if (softassign__list_least(s, root) > s->list_limit[root]) softassign__relist(s, root);
    for (q_at = at; q_at < at + (size_t)s->list_length[root]; q_at++) {
        double price = s->price[s->list_slot[q_at]], cost = softassign__listed_cost(s, root, q_at);
        if (cost - price < least) {
            least = cost - price;
            q.root_cost = cost;
            q.root_price = price;
        }
    }
    if (!(least < (double)SOFTASSIGN__INFINITY)) return 0;
    softassign__relax_list(s, &q, root, 0);
    s->stats.work++;
    while (s->heap_size > 0) {
        int node = softassign__heap_pop(s);
        s->stats.work++;
        if (node >= s->slot_count) {
            softassign__open_list(s, &q, node - s->slot_count);
            continue;
        }
        if (softassign__is_free(s, node)) {
            end = node;
            break;
        }
        s->stamp[node] = 4 * s->epoch + SOFTASSIGN__CLOSED;
        s->closed[closed++] = node;
        for (i = s->first_row[node]; i >= 0; i = s->next_row[i]) softassign__relax_list(s, &q, i, s->distance[node]);
    }
    if (end < 0) return 0;
    for (i = 0; i < closed; i++) {
        j = s->closed[i];
        softassign__set_price(s, j, s->price[j] + (s->distance[j] - s->distance[end]));
    }
    for (j = end;;) {
        int row = s->parent[j], old = s->slot_of_row[row];
        softassign__assign(s, row, j, s->parent_cost[j]);
        if (row == root) return 1;
        j = old;
    }
}

/* ------------------------------------------------------------------------------------------------
   >> finish
   Finish: a slot with room must have its top price. Where the start prices left one below, it is raised along a
   shortest path of slots; the distance between slots a and b is the smallest reduced cost, in a, of a row of b.
   Costs of a whole column are computed, no list is needed.
   ------------------------------------------------------------------------------------------------ */

/* Relaxes from slot `from` at distance `base` to the slots of all rows. */
static void softassign__relax_column(softassign *s, int from, double base, double *nearest)
{
    int i;
    for (i = 0; i < s->rows; i++) {
        int j = s->slot_of_row[i], known;
        double w, cost;
        if (j < 0 || j == from) continue;
        known = s->stamp[j] - 4 * s->epoch;
        if (known == SOFTASSIGN__CLOSED) continue;
        cost = softassign__cost(s, i, from);
        if (!(cost < (double)SOFTASSIGN__INFINITY)) continue;
        w = ((cost - s->cost_of_row[i]) - (s->price[from] - s->price[j]));
        w = base + (w > 0 ? w : 0);
        if (w >= *nearest || (known == SOFTASSIGN__OPEN && w >= s->distance[j])) continue;
        s->parent[j] = i; /* the row of j that moves to `from` */
        s->parent_cost[j] = cost;
        s->touched[j] = from;
        softassign__open(s, j, w);
    }
    s->scratch[0].distances += (size_t)s->rows;
    s->stats.work += (size_t)s->rows / 16 + 1;
}

static void softassign__finish(softassign *s, int slot)
{
    double nearest = s->top[slot] - s->price[slot]; /* raising the slot alone */
    int end = slot, closed = 0, i, j;
    softassign__new_epoch(s);
    s->heap_size = 0;
    s->stats.columns_finished++;
    s->stamp[slot] = 4 * s->epoch + SOFTASSIGN__CLOSED;
    s->distance[slot] = 0;
    s->closed[closed++] = slot;
    softassign__relax_column(s, slot, 0, &nearest);
    while (s->heap_size > 0) {
        j = softassign__heap_pop(s);
        if (s->distance[j] >= nearest) break;
        s->stamp[j] = 4 * s->epoch + SOFTASSIGN__CLOSED;
        s->closed[closed++] = j;
        if (s->distance[j] + (s->top[j] - s->price[j]) < nearest) { /* j may lose a row and rise to its top */
            nearest = s->distance[j] + (s->top[j] - s->price[j]);
            end = j;
        }
        softassign__relax_column(s, j, s->distance[j], &nearest);
    }
    for (i = 0; i < closed; i++) {
        double up;
        j = s->closed[i];
        up = s->price[j] + (nearest - s->distance[j]);
        if (!(s->distance[j] < nearest)) continue;
        softassign__set_price(s, j, up < s->top[j] ? up : s->top[j]);
        s->raised[j] = 1;
    }
    for (j = end; j != slot;) {
        int to = s->touched[j];
        softassign__assign(s, s->parent[j], to, s->parent_cost[j]);
        j = to;
    }
    softassign__set_price(s, end, s->top[end]);
}

/* ------------------------------------------------------------------------------------------------
   >> certificate
   The certificate: sum_i min_j (c_ij - v_j) + sum_j capacity_j v_j is below every assignment when v <= 0 (mandatory
   slots, which are full in every assignment: any v).
   ------------------------------------------------------------------------------------------------ */

#ifdef SAT__SSE2
/* Four costs of a row as doubles. */
static inline void softassign__load4(softassign__row r, int j, __m128d *low, __m128d *high)
{
    if (r.f) {
        __m128 four = _mm_loadu_ps(r.f + j);
        *low = _mm_cvtps_pd(four);
        *high = _mm_cvtps_pd(_mm_movehl_ps(four, four));
    } else {
        *low = _mm_loadu_pd(r.d + j);
        *high = _mm_loadu_pd(r.d + j + 2);
    }
}
#endif

/* 1 when one of eight values cost - price is below the limit. */
static inline int softassign__eight_below(softassign__row cost, int j, const double *price, double limit)
{
#ifdef SAT__SSE2
    __m128d a, b, d, f;
    softassign__load4(cost, j, &a, &b);
    softassign__load4(cost, j + 4, &d, &f);
    a = _mm_min_pd(_mm_sub_pd(a, _mm_loadu_pd(price + j)), _mm_sub_pd(b, _mm_loadu_pd(price + j + 2)));
    d = _mm_min_pd(_mm_sub_pd(d, _mm_loadu_pd(price + j + 4)), _mm_sub_pd(f, _mm_loadu_pd(price + j + 6)));
    return _mm_movemask_pd(_mm_cmplt_pd(_mm_min_pd(a, d), _mm_set1_pd(limit))) != 0;
#else
    int k, below = 0;
    for (k = j; k < j + 8; k++) below |= softassign__row_cost(cost, k) - price[k] < limit;
    return below;
#endif
}

/* One bit of four for each lane of a comparison. */
static inline int softassign__lanes(sat__i32x4 mask)
{
#ifdef SAT__SSE2
    return _mm_movemask_ps(_mm_castsi128_ps(mask));
#else
    return sat__i32x4_any(mask) ? 15 : 0; /* those that are not are looked at for nothing */
#endif
}

/* Looks for values cost - price of a row at or below a limit, sixteen at a time. Floats come first: what they round is
   a lower bound, as their prices are not below the prices, and rounding keeps the order. Where they find too much for
   nothing, as among ties, doubles go on alone, and look for what is below it. */
typedef struct softassign__scan {
    softassign__row cost;
    const double *price;
    const float *price_f;
    double limit;
    float most;   /* not below limit */
    int patience;
} softassign__scan;

static inline softassign__scan softassign__scan_row(const softassign *s, int row, double limit)
{
    softassign__scan q;
    q.cost = softassign__matrix_row(s, row);
    q.price = s->price;
    q.price_f = s->price_f;
    q.limit = limit;
    q.most = softassign__round_up(limit);
    q.patience = q.cost.f ? 4 : 0;
    return q;
}

static inline double softassign__scan_value(const softassign__scan *q, int j)
{
    return softassign__row_cost(q->cost, j) - q->price[j];
}

/* Sixteen values as floats. */
static inline void softassign__load_reduced(const softassign__scan *q, int j, sat__f32x4 *v)
{
    const float *c = q->cost.f + j, *p = q->price_f + j;
    v[0] = sat__f32x4_sub(sat__f32x4_load(c), sat__f32x4_load(p));
    v[1] = sat__f32x4_sub(sat__f32x4_load(c + 4), sat__f32x4_load(p + 4));
    v[2] = sat__f32x4_sub(sat__f32x4_load(c + 8), sat__f32x4_load(p + 8));
    v[3] = sat__f32x4_sub(sat__f32x4_load(c + 12), sat__f32x4_load(p + 12));
}

static inline sat__f32x4 softassign__least_of_four(const sat__f32x4 *v)
{
    return sat__f32x4_min(sat__f32x4_min(v[0], v[1]), sat__f32x4_min(v[2], v[3]));
}

/* The next sixteen from j on of which one may be within the limit, or where less than sixteen are left. */
static inline int softassign__next_within(const softassign__scan *q, int j, int n)
{
    sat__f32x4 v[4], most = sat__f32x4_set1(q->most);
    if (q->patience <= 0) {
        while (j + 16 <= n && !softassign__eight_below(q->cost, j, q->price, q->limit) &&
               !softassign__eight_below(q->cost, j + 8, q->price, q->limit))
            j += 16;
        return j;
    }
    for (; j + 16 <= n; j += 16) {
        softassign__load_reduced(q, j, v);
        if (sat__i32x4_any(sat__f32x4_less_equal(softassign__least_of_four(v), most))) break;
    }
    return j;
}

/* Those of sixteen that may be within the limit, one bit each. */
static inline int softassign__sixteen_within(const softassign__scan *q, int j)
{
    sat__f32x4 v[4], most = sat__f32x4_set1(q->most);
    if (q->patience <= 0) return 0xffff;
    softassign__load_reduced(q, j, v);
    return softassign__lanes(sat__f32x4_less_equal(v[0], most)) |
           softassign__lanes(sat__f32x4_less_equal(v[1], most)) << 4 |
           softassign__lanes(sat__f32x4_less_equal(v[2], most)) << 8 |
           softassign__lanes(sat__f32x4_less_equal(v[3], most)) << 12;
}

/* Two smallest ones of what four lanes hold, which stay apart. */
typedef struct softassign__lane_minima {
    sat__f32x4 least, second;
} softassign__lane_minima;

static inline void softassign__take_lanes(softassign__lane_minima *m, sat__f32x4 v)
{
    m->second = sat__f32x4_min(sat__f32x4_max(m->least, v), m->second);
    m->least = sat__f32x4_min(v, m->least);
}

static float softassign__second_of_lanes(const softassign__lane_minima *m)
{
    float v[8], least = SOFTASSIGN__INFINITY, second = least;
    int k;
    sat__f32x4_store(v, m->least);
    sat__f32x4_store(v + 4, m->second);
    for (k = 0; k < 8; k++) {
        second = v[k] < least ? least : v[k] < second ? v[k] : second;
        least = v[k] < least ? v[k] : least;
    }
    return second;
}

/* At or above the second smallest value of a row: the second smallest of minima of different columns, and what floats
   round. */
static double softassign__second_at_most(const softassign *s, const softassign__scan *q, int n)
{
    double second;
    softassign__lane_minima m;
    sat__f32x4 v[4];
    int j;
    m.least = m.second = sat__f32x4_set1(SOFTASSIGN__INFINITY);
    for (j = 0; j + 16 <= n; j += 16) {
        softassign__load_reduced(q, j, v);
        softassign__take_lanes(&m, softassign__least_of_four(v));
    }
    second = (double)softassign__second_of_lanes(&m);
    return second + (fabs(second) + s->dearest) * 3e-7;
}

static inline void softassign__take_value(softassign__pair_of_least *two, int j, double value)
{
    if (value < two->least) {
        two->second = two->least;
        two->second_at = two->at;
        two->least = value;
        two->at = j;
    } else if (value < two->second) {
        two->second = value;
        two->second_at = j;
    }
}

/* The two smallest values of a row, the second of which is known to be at most q->limit. */
static softassign__pair_of_least softassign__look_within(softassign__scan *q, int n)
{
    softassign__pair_of_least two;
    int j = 0, k, within;
    two.at = two.second_at = -1;
    two.least = two.second = (double)SOFTASSIGN__INFINITY;
    for (; (j = softassign__next_within(q, j, n)) + 16 <= n; j += 16) {
        double before = two.second;
        for (k = j, within = softassign__sixteen_within(q, j); within; k++, within >>= 1) {
            for (; !(within & 15); within >>= 4) k += 4;
            if (within & 1) softassign__take_value(&two, k, softassign__scan_value(q, k));
        }
        q->patience = two.second > two.least ? q->patience - !(two.second < before) : 0; /* a tie: only below it */
        if (!(two.second < q->limit)) continue;
        q->limit = two.second;
        q->most = softassign__round_up(q->limit);
    }
    for (; j < n; j++) softassign__take_value(&two, j, softassign__scan_value(q, j));
    return two;
}

static softassign__pair_of_least softassign__look_at_row(const softassign *s, int row)
{
    softassign__scan q = softassign__scan_row(s, row, (double)SOFTASSIGN__INFINITY);
    if (q.patience && s->columns >= 32) {
        q.limit = softassign__second_at_most(s, &q, s->columns);
        q.most = softassign__round_up(q.limit);
    }
    return softassign__look_within(&q, s->columns);
}

/* What was seen when costs were checked holds as long as these two slots keep their price: prices only fall. */
static softassign__pair_of_least softassign__two_smallest(const softassign *s, int row)
{
    const softassign__pair_of_least *seen = &s->seen[row];
    if (s->has_seen && seen->at >= 0 && !(s->price[seen->at] < 0) &&
        (seen->second_at < 0 || !(s->price[seen->second_at] < 0)))
        return *seen;
    return softassign__look_at_row(s, row);
}

/* The smallest cost - price of a row, which is known to be at most `known`. */
static double softassign__smallest(const softassign *s, int row, double known)
{
    softassign__scan q = softassign__scan_row(s, row, known);
    int j = 0, k, n = s->columns, within;
    for (; (j = softassign__next_within(&q, j, n)) + 16 <= n; j += 16) {
        q.patience--;
        for (k = j, within = softassign__sixteen_within(&q, j); within; k++, within >>= 1)
            if (within & 1 && softassign__scan_value(&q, k) < q.limit) q.limit = softassign__scan_value(&q, k);
    }
    for (; j < n; j++)
        if (softassign__scan_value(&q, j) < q.limit) q.limit = softassign__scan_value(&q, j);
    return q.limit;
}

/* A list that ended below the row's own value is made anew first when the solver is done: the bound is then tight. */
static double softassign__row_bound(softassign *s, int row)
{
    size_t at = (size_t)row * (size_t)s->list, end;
    int stay = s->problem.previous ? s->problem.previous[row] : -1, own = s->slot_of_row[row];
    double least;
    if (s->dense_paths) { /* with the switching bonus, which only lowers it */
        least = own >= 0 ? s->cost_of_row[row] - s->price[own] : (double)SOFTASSIGN__INFINITY;
        return softassign__smallest(s, row, least);
    }
    if (s->phase == SOFTASSIGN__DONE && own >= 0 && s->list_limit[row] < s->cost_of_row[row] - s->price[own])
        softassign__relist(s, row);
    least = s->list_limit[row];
    for (end = at + (size_t)s->list_length[row]; at < end; at++) {
        int slot = s->list_slot[at];
        double cost = softassign__listed_cost(s, row, at), value;
        if (!s->proving && softassign__column(s, slot) == stay) cost = softassign__pair(&s->problem, row, stay);
        value = cost - s->price[slot];
        if (value < least) least = value;
    }
    return least;
}

static void softassign__certify(softassign *s)
{
    softassign__sum bound = {0, 0, 0};
    double *least = s->row_distance;
    int i, j;
    for (i = 0; i < s->rows; i++) least[i] = softassign__row_bound(s, i);
    for (j = 0; j < s->slot_count; j++) {
        if (s->price[j] != 0 && s->capacity[j] > 0) softassign__add(&bound, s->price[j] * s->capacity[j]);
        if (!s->raised[j] || s->capacity[j] == 0 || s->dense_paths) continue;
        s->scratch[0].distances += (size_t)s->rows;
        for (i = 0; i < s->rows; i++) {
            double value = (s->proving ? softassign__cost(s, i, j)
                                       : softassign__pair(&s->problem, i, softassign__column(s, j))) -
                           s->price[j];
            if (value < least[i]) least[i] = value;
        }
    }
    for (i = 0; i < s->rows; i++) softassign__add(&bound, least[i]);
    s->bound = softassign__total_below(&bound);
    if (!sat__is_finite_double(s->bound)) s->bound = -(double)SOFTASSIGN__INFINITY;
}

/* ------------------------------------------------------------------------------------------------
   >> auction
   Auction on lists (Bertsekas 1988): every row bids for its best slot and pays down to its second best, less eps.
   The places of a slot are alike: one that is full has the price of its cheapest place, which the next bidder takes
   over (Bertsekas and Castanon 1989); one with room has its top price. So the bound loses at most eps a row.
   ------------------------------------------------------------------------------------------------ */

/* Best slot of a row and the value of its second best, which the limit of the list may stand for. */
static int softassign__best_two(softassign *s, int row, double *best, double *second)
{
    size_t at = (size_t)row * (size_t)s->list, end;
    int again, entry = -1;
    for (again = 0; again < 2; again++) {
        double m1 = (double)SOFTASSIGN__INFINITY, m2 = m1;
        for (entry = -1, end = at + (size_t)s->list_length[row]; at < end; at++) {
            double value;
            if ((double)s->list_value[at] >= m2) break; /* sorted, and values only rise */
            value = softassign__listed_cost(s, row, at) - s->price[s->list_slot[at]];
            if (value < m1) {
                m2 = m1;
                m1 = value;
                entry = (int)(at - (size_t)row * (size_t)s->list);
            } else if (value < m2) m2 = value;
        }
        *best = m1;
        *second = m2 < s->list_limit[row] ? m2 : s->list_limit[row];
        if (m1 <= s->list_limit[row]) break;
        softassign__relist(s, row);
        at = (size_t)row * (size_t)s->list;
    }
    return entry;
}

/* The row with the cheapest place of a slot. */
static int softassign__cheapest_place(const softassign *s, int slot)
{
    int row = s->first_row[slot], best = row;
    for (; row >= 0; row = s->next_row[row])
        if (s->bid[row] > s->bid[best]) best = row;
    return best;
}

/* Bids until every row has a slot; 0 when the budget ran out first or a row has no choice at all. */
static int softassign__auction(softassign *s, double eps, size_t budget)
{
    int *stack = s->heap, size = 0, i;
    for (i = s->rows - 1; i >= 0; i--)
        if (s->slot_of_row[i] < 0) stack[size++] = i;
    while (size > 0) {
        double best, second;
        int row = stack[--size], entry, slot, out;
        size_t at;
        if (budget-- == 0) return 0;
        entry = softassign__best_two(s, row, &best, &second);
        if (entry < 0) return 0;
        if (!(second < (double)SOFTASSIGN__INFINITY)) second = best;
        at = (size_t)row * (size_t)s->list + (size_t)entry;
        slot = s->list_slot[at];
        out = softassign__is_free(s, slot) ? -1 : softassign__cheapest_place(s, slot);
        if (out >= 0) {
            softassign__unassign(s, out);
            stack[size++] = out;
        }
        softassign__assign(s, row, slot, softassign__listed_cost(s, row, at));
        s->bid[row] = s->price[slot] - (second - best) - eps;
        if (!softassign__is_free(s, slot))
            softassign__set_price(s, slot, s->bid[softassign__cheapest_place(s, slot)]);
        s->stats.iterations++;
        s->stats.work++;
    }
    return 1;
}

/* ------------------------------------------------------------------------------------------------
   >> dense
   The dense solver for small problems: shortest augmenting paths after two rounds of augmenting row reduction
   (Jonker and Volgenant 1987, with prices that never rise above 0). Capacities of 1 only.
   ------------------------------------------------------------------------------------------------ */

/* One row that a path has reached, and the slots it is compared with. */
typedef struct softassign__dense_step {
    softassign__row cost;
    double base, own_cost, own_price; /* distance, cost and price of the row's own slot */
    double *price;                    /* of open slots */
    double *distance, *block;         /* block: the smallest distance of SOFTASSIGN__STEP slots */
    float *reach;
    int *pred;
    const int *first_row;
    int row, plain;                   /* rows to come in which floats would leave out too little: reach stands still */
} softassign__dense_step;

static inline void softassign__sit(softassign *s, int row, int slot)
{
    s->slot_of_row[row] = slot;
    if (slot != s->none) s->first_row[slot] = row;
}

static void softassign__dense_swap(softassign *s, int row, int slot)
{
    int out = s->first_row[slot];
    if (s->slot_of_row[row] >= 0) s->first_row[s->slot_of_row[row]] = -1;
    softassign__sit(s, row, slot);
    if (out >= 0) s->slot_of_row[out] = -1;
}

/* The row's best slot falls to what the second best is worth. */
static void softassign__pay_second(softassign *s, const softassign__pair_of_least *two)
{
    if (two->second < (double)SOFTASSIGN__INFINITY && two->second > two->least && two->at != s->none)
        softassign__set_price(s, two->at, s->price[two->at] - (two->second - two->least));
}

/* The least cost of every column goes to price, the row that has it to from. */
static void softassign__least_of_columns(softassign *s, int *from)
{
    int n = s->columns, i, j, k;
    float *least = s->price_f; /* floats: half the memory to go through */
    for (j = 0; j < n; j++) {
        s->price[j] = (double)(least[j] = SOFTASSIGN__INFINITY);
        from[j] = -1;
    }
    for (i = 0; i < n; i++) {
        softassign__row cost = softassign__matrix_row(s, i);
        for (j = 0; j < n; j = k) {
            k = sat__min_int(n, j + 4);
            if (cost.f && k == j + 4 &&
                !sat__i32x4_any(sat__f32x4_less(sat__f32x4_load(cost.f + j), sat__f32x4_load(least + j))))
                continue;
            for (; j < k; j++) {
                if (!(softassign__row_cost(cost, j) < s->price[j])) continue;
                softassign__set_price(s, j, softassign__row_cost(cost, j));
                from[j] = i;
            }
        }
    }
    for (j = 0; j < n; j++)
        if (from[j] < 0) softassign__set_price(s, j, 0);
}

/* Every column is used in a square problem, so its price may have any sign: it starts at the least cost, and the row of
   that cost takes it; a row that got just one pays down to its second best (Jonker and Volgenant 1987). */
static void softassign__reduce_columns(softassign *s)
{
    int n = s->columns, i, j, *from = s->parent, *times = s->holders;
    softassign__least_of_columns(s, from);
    for (i = 0; i < n; i++) times[i] = 0;
    for (j = n - 1; j >= 0; j--)
        if (from[j] >= 0 && !times[from[j]]++) softassign__dense_swap(s, from[j], j);
    for (i = 0; i < n; i++) {
        softassign__pair_of_least two;
        if (times[i] != 1) continue;
        two = softassign__two_smallest(s, i);
        two.at = s->slot_of_row[i];
        softassign__pay_second(s, &two);
    }
}

/* Rows without a slot take their best one and pay down to the second best; returns how many are left. */
static int softassign__reduce_rows(softassign *s, int *rows, int count)
{
    int next = 0, left = 0, budget = 8 * count + 64;
    while (next < count) {
        int row = rows[next++], out, pays;
        softassign__pair_of_least two = softassign__two_smallest(s, row);
        if (two.at < 0) {
            rows[left++] = row;
            continue;
        }
        out = s->first_row[two.at];
        if (two.second_at < 0 && out >= 0) { /* its only choice is taken: leave it to the paths */
            rows[left++] = row;
            continue;
        }
        pays = two.second > two.least;
        if (pays) softassign__pay_second(s, &two);
        else if (out >= 0 && two.second_at >= 0) { /* a tie */
            two.at = two.second_at;
            out = s->first_row[two.at];
        }
        softassign__dense_swap(s, row, two.at);
        if (out < 0) continue;
        if (pays && budget-- > 0) rows[--next] = out;
        else rows[left++] = out;
    }
    return left;
}

/* The smallest of n distances. */
static double softassign__least_distance(const double *distance, int n)
{
    double nearest = (double)SOFTASSIGN__INFINITY;
    int j = 0;
#ifdef SAT__SSE2
    double lanes[2];
    __m128d a = _mm_set1_pd(nearest), b = a;
    for (; j + 4 <= n; j += 4) {
        a = _mm_min_pd(_mm_loadu_pd(distance + j), a);
        b = _mm_min_pd(_mm_loadu_pd(distance + j + 2), b);
    }
    _mm_storeu_pd(lanes, _mm_min_pd(a, b));
    nearest = lanes[1] < lanes[0] ? lanes[1] : lanes[0];
#endif
    for (; j < n; j++) nearest = distance[j] < nearest ? distance[j] : nearest;
    return nearest;
}

/* A float above distance + price. cost + base - (own cost - own price) of a slot that comes nearer is below it. */
static inline float softassign__reach_of(double distance, double price)
{
    float f = (float)(distance + price);
    return f + (fabsf(f) * 1.2e-7f + 1e-37f);
}

#ifdef SAT__SSE2
/* The same of four slots. */
static inline void softassign__store_reach(const softassign__dense_step *q, int j, __m128d x, __m128d y)
{
    __m128 f = _mm_movelh_ps(_mm_cvtpd_ps(_mm_add_pd(x, _mm_loadu_pd(q->price + j))),
                             _mm_cvtpd_ps(_mm_add_pd(y, _mm_loadu_pd(q->price + j + 2))));
    __m128 more = _mm_mul_ps(sat__f32x4_abs(f), _mm_set1_ps(1.2e-7f));
    _mm_storeu_ps(q->reach + j, _mm_add_ps(f, _mm_add_ps(more, _mm_set1_ps(1e-37f))));
}

/* Distances of four slots from the row of the step. */
static inline void softassign__load_distances(const softassign__dense_step *q, int j, __m128d *x, __m128d *y)
{
    __m128d c0 = _mm_set1_pd(q->own_cost), p0 = _mm_set1_pd(q->own_price), from = _mm_set1_pd(q->base);
    softassign__load4(q->cost, j, x, y);
    *x = _mm_add_pd(from, _mm_sub_pd(_mm_sub_pd(*x, c0), _mm_sub_pd(_mm_loadu_pd(q->price + j), p0)));
    *y = _mm_add_pd(from, _mm_sub_pd(_mm_sub_pd(*y, c0), _mm_sub_pd(_mm_loadu_pd(q->price + j + 2), p0)));
}
#endif

static inline double softassign__slot_distance(const softassign__dense_step *q, int j)
{
    return q->base + ((softassign__row_cost(q->cost, j) - q->own_cost) - (q->price[j] - q->own_price));
}

/* Relaxes some slots from a row. *least: the smallest distance. */
static inline void softassign__relax_few(const softassign__dense_step *q, int j, int end, double *least)
{
    for (; j < end; j++) {
        double w = softassign__slot_distance(q, j);
        if (!(w < q->distance[j])) continue;
        q->distance[j] = w;
        q->reach[j] = softassign__reach_of(w, q->price[j]);
        q->pred[j] = q->row;
        *least = w < *least ? w : *least;
    }
}

#ifdef SAT__SSE2
/* The same for four. */
static inline void softassign__relax_four(const softassign__dense_step *q, int j, int keep_reach, __m128d *least)
{
    __m128d x, y, d = _mm_loadu_pd(q->distance + j), e = _mm_loadu_pd(q->distance + j + 2), lower, lower2;
    __m128i less, old, row = _mm_set1_epi32(q->row);
    softassign__load_distances(q, j, &x, &y);
    lower = _mm_cmplt_pd(x, d);
    lower2 = _mm_cmplt_pd(y, e);
    less = _mm_castps_si128(_mm_shuffle_ps(_mm_castpd_ps(lower), _mm_castpd_ps(lower2), _MM_SHUFFLE(2, 0, 2, 0)));
    if (!sat__i32x4_any(less)) return;
    x = _mm_min_pd(x, d);
    y = _mm_min_pd(y, e);
    _mm_storeu_pd(q->distance + j, x);
    _mm_storeu_pd(q->distance + j + 2, y);
    if (keep_reach) softassign__store_reach(q, j, x, y);
    *least = _mm_min_pd(_mm_min_pd(x, y), *least);
    old = _mm_loadu_si128((const __m128i *)(const void *)(q->pred + j));
    old = _mm_or_si128(_mm_and_si128(less, row), _mm_andnot_si128(less, old));
    _mm_storeu_si128((__m128i *)(void *)(q->pred + j), old);
}
#endif

/* All distances from the root. */
static void softassign__relax_root(const softassign__dense_step *q, int n)
{
    int b, j, end;
    for (b = j = 0; j < n; b++) {
        end = sat__min_int(n, j + SOFTASSIGN__STEP);
#ifdef SAT__SSE2
        for (; j + 4 <= end; j += 4) {
            __m128d x, y;
            softassign__load_distances(q, j, &x, &y);
            _mm_storeu_pd(q->distance + j, x);
            _mm_storeu_pd(q->distance + j + 2, y);
            softassign__store_reach(q, j, x, y);
            _mm_storeu_si128((__m128i *)(void *)(q->pred + j), _mm_set1_epi32(q->row));
        }
#endif
        for (; j < end; j++) {
            q->distance[j] = softassign__slot_distance(q, j);
            q->reach[j] = softassign__reach_of(q->distance[j], q->price[j]);
            q->pred[j] = q->row;
        }
        j = b * SOFTASSIGN__STEP;
        q->block[b] = softassign__least_distance(q->distance + j, end - j);
        j = end;
    }
}

/* Which fours of sixteen slots may come nearer: bits. */
static inline int softassign__sixteen_nearer(const float *cost, const float *reach, sat__f32x4 shift)
{
    sat__i32x4 a = sat__f32x4_less(sat__f32x4_add(sat__f32x4_load(cost), shift), sat__f32x4_load(reach));
    sat__i32x4 b = sat__f32x4_less(sat__f32x4_add(sat__f32x4_load(cost + 4), shift), sat__f32x4_load(reach + 4));
    sat__i32x4 c = sat__f32x4_less(sat__f32x4_add(sat__f32x4_load(cost + 8), shift), sat__f32x4_load(reach + 8));
    sat__i32x4 d = sat__f32x4_less(sat__f32x4_add(sat__f32x4_load(cost + 12), shift), sat__f32x4_load(reach + 12));
    if (!sat__i32x4_any(sat__i32x4_or(sat__i32x4_or(a, b), sat__i32x4_or(c, d)))) return 0;
    return sat__i32x4_any(a) | sat__i32x4_any(b) << 1 | sat__i32x4_any(c) << 2 | sat__i32x4_any(d) << 3;
}

/* Relaxes slots from a row; floats leave out sixteen at a time. Returns how many fours they did not leave out. */
static int softassign__relax_coarsely(const softassign__dense_step *q, int begin, int end, double *least)
{
    int j = begin, k, quads, hits = 0;
    sat__f32x4 shift = sat__f32x4_set1(softassign__float_below(q->base - (q->own_cost - q->own_price)));
#ifdef SAT__SSE2
    double lanes[2];
    __m128d lower = _mm_set1_pd(*least);
#endif
    for (; j + 16 <= end; j += 16) {
        quads = softassign__sixteen_nearer(q->cost.f + j, q->reach + j, shift);
        for (k = j; quads; k += 4, quads >>= 1) {
            if (!(quads & 1)) continue;
            hits++;
#ifdef SAT__SSE2
            softassign__relax_four(q, k, 1, &lower);
#else
            softassign__relax_few(q, k, k + 4, least);
#endif
        }
    }
#ifdef SAT__SSE2
    _mm_storeu_pd(lanes, lower);
    *least = lanes[0] < lanes[1] ? lanes[0] : lanes[1];
#endif
    softassign__relax_few(q, j, end, least);
    return hits;
}

/* The same where most come nearer. */
static void softassign__relax_plainly(const softassign__dense_step *q, int begin, int end, double *least)
{
    int j = begin;
#ifdef SAT__SSE2
    double lanes[2];
    __m128d lower = _mm_set1_pd(*least);
    for (; j + 4 <= end; j += 4) softassign__relax_four(q, j, 0, &lower);
    _mm_storeu_pd(lanes, lower);
    *least = lanes[0] < lanes[1] ? lanes[0] : lanes[1];
#endif
    softassign__relax_few(q, j, end, least);
}

/* A free slot that is no farther than `nearest`, or -1; slots so near that are taken are appended to a list. */
static int softassign__free_within(const softassign__dense_step *q, int j, int end, double nearest, int *list,
                                   int *count)
{
#ifdef SAT__SSE2
    __m128d most = _mm_set1_pd(nearest);
    for (; j + 4 <= end; j += 4) {
        int k, within = _mm_movemask_pd(_mm_cmple_pd(_mm_loadu_pd(q->distance + j), most)) |
                        _mm_movemask_pd(_mm_cmple_pd(_mm_loadu_pd(q->distance + j + 2), most)) << 2;
        for (k = j; within; k++, within >>= 1) {
            if (!(within & 1)) continue;
            if (q->first_row[k] < 0) return k;
            list[(*count)++] = k;
        }
    }
#endif
    for (; j < end; j++) {
        if (q->distance[j] > nearest) continue;
        if (q->first_row[j] < 0) return j;
        list[(*count)++] = j;
    }
    return -1;
}

/* Relaxes all slots from a row. Returns a free one that is no farther than `base`, which ends the path, or -1. A closed
   slot has an infinite distance here and a price of minus infinity, so that nothing is below either. */
static int softassign__relax_dense(softassign__dense_step *q, int n)
{
    int j, b, end, step = SOFTASSIGN__STEP, hits = 0, taken[SOFTASSIGN__STEP], ignored;
    for (b = 0; b * step < n; b++) {
        double before = q->block[b];
        end = n - b * step < step ? n : (b + 1) * step;
        if (q->plain) softassign__relax_plainly(q, b * step, end, &q->block[b]);
        else hits += softassign__relax_coarsely(q, b * step, end, &q->block[b]);
        ignored = 0;
        if (q->block[b] < before && q->block[b] <= q->base &&
            (j = softassign__free_within(q, b * step, end, q->base, taken, &ignored)) >= 0)
            return j;
    }
    if (hits * 12 > n) q->plain = 16;
    else if (q->cost.f && q->plain > 0 && --q->plain == 0)
        for (j = 0; j < n; j++) q->reach[j] = softassign__reach_of(q->distance[j], q->price[j]);
    return -1;
}

/* The nearest open slots. A free one ends the path and is returned; else they leave the search, all at once, and go to
   the end of s->closed. -1: there are none, or not a free one. */
static int softassign__close_nearest(softassign *s, softassign__dense_step *q, int *closed)
{
    int n = s->slot_count, step = SOFTASSIGN__STEP, b, j, k, first, blocks = (n + step - 1) / step, from = *closed;
    double nearest = softassign__least_distance(q->block, blocks);
    if (!(nearest < (double)SOFTASSIGN__INFINITY)) return -1;
    if (nearest > q->base) q->base = nearest; /* else rounding */
    for (b = 0; b < blocks; b++) {
        if (q->block[b] > nearest) continue;
        j = softassign__free_within(q, b * step, sat__min_int(n, (b + 1) * step), nearest, s->closed, closed);
        if (j < 0) continue;
        *closed = from; /* the others do not count */
        return j;
    }
    for (k = from; k < *closed; k++) {
        j = s->closed[k];
        s->closed_distance[k] = q->base;
        q->distance[j] = (double)SOFTASSIGN__INFINITY;
        q->price[j] = -(double)SOFTASSIGN__INFINITY;
        q->reach[j] = -SOFTASSIGN__INFINITY;
        first = j / step * step;
        if (k + 1 == *closed || s->closed[k + 1] / step != j / step)
            q->block[j / step] = softassign__least_distance(q->distance + first, sat__min_int(n - first, step));
    }
    return -1;
}

/* A free slot that is as good for the row as its best one, or -1. */
static int softassign__free_tie(const softassign__dense_step *q, int from, int n)
{
    int j;
    for (j = from; j < n; j++)
        if (q->first_row[j] < 0 && softassign__slot_distance(q, j) <= 0) return j;
    return -1;
}

static int softassign__augment_dense(softassign *s, int root)
{
    softassign__dense_step q;
    softassign__pair_of_least two = softassign__two_smallest(s, root);
    int closed = 0, next = 0, row, j, k, end = two.at, n = s->slot_count;
    s->stats.paths++;
    if (end < 0) return 0;
    memset(&q, 0, sizeof q);
    q.cost = softassign__matrix_row(s, root);
    q.row = root;
    q.own_cost = softassign__row_cost(q.cost, end);
    q.own_price = s->price[end];
    q.price = s->price;
    q.distance = s->distance;
    q.reach = s->reach;
    q.block = s->block_distance;
    q.pred = s->parent;
    q.first_row = s->first_row;
    q.plain = !q.cost.f;
    s->stats.work++;
    end = softassign__free_tie(&q, end, two.second > two.least ? end + 1 : n);
    if (end >= 0) {
        q.pred[end] = root;
    } else {
        q.price = s->dense_price;
        memcpy(q.price, s->price, (size_t)n * sizeof *q.price);
        softassign__relax_root(&q, n);
    }
    while (end < 0) {
        if (next == closed && ((end = softassign__close_nearest(s, &q, &closed)) >= 0 || next == closed)) break;
        j = s->closed[next++];
        q.row = s->first_row[j];
        q.cost = softassign__matrix_row(s, q.row);
        q.own_cost = softassign__row_cost(q.cost, j);
        q.own_price = s->price[j];
        s->stats.work++;
        end = softassign__relax_dense(&q, n);
    }
    if (end < 0) return 0;
    for (k = 0; k < closed; k++)
        softassign__set_price(s, s->closed[k], s->price[s->closed[k]] + (s->closed_distance[k] - q.base));
    for (j = end;;) {
        int old;
        row = q.pred[j];
        old = s->slot_of_row[row];
        softassign__sit(s, row, j);
        if (row == root) return 1;
        j = old;
    }
}

/* What the rest of the library reads of an assignment. done: there are no more paths on the matrix. */
static void softassign__dense_publish(softassign *s, int done)
{
    int i, j;
    for (j = 0; j < s->slot_count; j++) s->used[j] = s->first_row[j] >= 0;
    for (i = 0; i < s->rows; i++) {
        s->next_row[i] = -1;
        if ((j = s->slot_of_row[i]) < 0) continue;
        s->cost_of_row[i] = softassign__cost(s, i, j);
        if (j != s->none) continue;
        s->used[j]++;
        if (!done) continue;
        s->next_row[i] = s->first_row[j];
        s->first_row[j] = i;
    }
}

/* ------------------------------------------------------------------------------------------------
   >> repair
   Exact repair

   Prices are sums of costs: with costs from 1e-45 to 1e30 in one problem no double holds them. Where the proof in
   doubles is not tight (softassign__prove), the rest of the work is done in fixed point of 320 bits, in which every
   cost, path length and price is exact; a mandatory slot then costs 2^136, above every sum of costs, and drowns
   nothing. ------------------------------------------------------------------------------------------------ */

/* Two's complement, least word first, in units of 2^-149: what floats are multiples of. */
struct softassign__fixed {
    uint64_t word[5];
};

static softassign__fixed softassign__fixed_sum(const softassign__fixed *a, const softassign__fixed *b)
{
    softassign__fixed r = {{0, 0, 0, 0, 0}};
    uint64_t carry = 0;
    int k;
    for (k = 0; k < 5; k++) {
        uint64_t t = a->word[k] + carry;
        carry = t < carry;
        r.word[k] = t + b->word[k];
        carry += r.word[k] < t;
    }
    return r;
}

static softassign__fixed softassign__fixed_difference(const softassign__fixed *a, const softassign__fixed *b)
{
    softassign__fixed r = {{0, 0, 0, 0, 0}};
    uint64_t borrow = 0;
    int k;
    for (k = 0; k < 5; k++) {
        uint64_t t = a->word[k] - borrow;
        borrow = a->word[k] < borrow;
        r.word[k] = t - b->word[k];
        borrow += t < b->word[k];
    }
    return r;
}

static int softassign__fixed_less(const softassign__fixed *a, const softassign__fixed *b)
{
    int k = 4;
    if ((a->word[4] ^ b->word[4]) >> 63) return (int)(a->word[4] >> 63);
    while (k > 0 && a->word[k] == b->word[k]) k--;
    return a->word[k] < b->word[k];
}

/* Exact for floats; a double loses what is below 2^-149, and is cut at +-2^130. */
static softassign__fixed softassign__fixed_from(double x)
{
    softassign__fixed r = {{0, 0, 0, 0, 0}}, zero = {{0, 0, 0, 0, 0}};
    double scaled;
    uint64_t mantissa;
    int exponent, shift, negative = x < 0;
    if (!(x < 1e39)) x = 1e39;
    if (x < -1e39) x = -1e39;
    scaled = ldexp(frexp(fabs(x), &exponent), 53);
    mantissa = (uint64_t)scaled;
    shift = exponent - 53 + 149;
    if (shift < 0) {
        r.word[0] = shift > -64 ? mantissa >> -shift : 0;
    } else {
        r.word[shift / 64] = mantissa << shift % 64;
        if (shift % 64) r.word[shift / 64 + 1] = mantissa >> (64 - shift % 64);
    }
    return negative ? softassign__fixed_difference(&zero, &r) : r;
}

static double softassign__fixed_to(const softassign__fixed *a)
{
    softassign__fixed zero = {{0, 0, 0, 0, 0}}, b = *a;
    int k, negative = (int)(a->word[4] >> 63);
    double r = 0;
    if (negative) b = softassign__fixed_difference(&zero, a);
    for (k = 4; k >= 0; k--) r += ldexp((double)b.word[k], 64 * k - 149);
    return negative ? -r : r;
}

static softassign__fixed softassign__fixed_top(const softassign *s, int slot)
{
    softassign__fixed top = {{0, 0, 0, 0, 0}};
    if (slot >= s->columns) top.word[4] = (uint64_t)1 << 29; /* 2^285 units; a million times less than the word holds */
    return top;
}

/* cost - price, exactly. */
static softassign__fixed softassign__fixed_value(const softassign *s, double cost, int slot)
{
    softassign__fixed c = softassign__fixed_from(cost);
    return softassign__fixed_difference(&c, &s->exact_price[slot]);
}

/* The row's own slot is not its best one. */
static int softassign__is_dissatisfied(const softassign *s, int row)
{
    softassign__fixed own = softassign__fixed_value(s, s->cost_of_row[row], s->slot_of_row[row]), other;
    int j;
    for (j = 0; j < s->slot_count; j++) {
        double cost;
        if (s->capacity[j] == 0 || !((cost = softassign__cost(s, row, j)) < (double)SOFTASSIGN__INFINITY)) continue;
        other = softassign__fixed_value(s, cost, j);
        if (softassign__fixed_less(&other, &own)) return 1;
    }
    return 0;
}

/* Takes over the prices; slots with room go to their top price, and rows that are then better off elsewhere leave,
   until nothing changes. What is left is optimal for the rows that stayed. */
static void softassign__start_repair(softassign *s)
{
    int i, j, changed = 1;
    for (i = 0; i < s->rows; i++) { /* their memory is used, and prices may rise */
        s->stale[i] = 1;
        s->list_length[i] = 0;
        s->list_limit[i] = -(double)SOFTASSIGN__INFINITY;
    }
    for (j = 0; j < s->slot_count; j++) {
        softassign__fixed top = softassign__fixed_top(s, j);
        s->exact_price[j] = softassign__fixed_from(s->price[j]);
        if (softassign__fixed_less(&top, &s->exact_price[j])) s->exact_price[j] = top;
    }
    while (changed) {
        for (j = 0; j < s->slot_count; j++)
            if (softassign__is_free(s, j)) s->exact_price[j] = softassign__fixed_top(s, j);
        for (changed = i = 0; i < s->rows; i++)
            if (s->slot_of_row[i] >= 0 && softassign__is_dissatisfied(s, i)) {
                softassign__unassign(s, i);
                changed = 1;
            }
        s->stats.work += (size_t)s->rows;
    }
    s->stats.exact_repair = 1;
}

/* Relaxes all open slots from `row`, whose own value is `own` (of the root: 0) at distance `base`. */
static void softassign__relax_exact(softassign *s, int row, const softassign__fixed *base)
{
    int j, slot = s->slot_of_row[row];
    softassign__fixed shift = *base;
    if (slot >= 0) {
        softassign__fixed own = softassign__fixed_value(s, s->cost_of_row[row], slot);
        shift = softassign__fixed_difference(base, &own);
    }
    for (j = 0; j < s->slot_count; j++) {
        int known = s->stamp[j] - 4 * s->epoch;
        softassign__fixed w;
        double cost;
        if (s->capacity[j] == 0 || known == SOFTASSIGN__CLOSED ||
            !((cost = softassign__cost(s, row, j)) < (double)SOFTASSIGN__INFINITY))
            continue;
        w = softassign__fixed_value(s, cost, j);
        w = softassign__fixed_sum(&w, &shift);
        if (known == SOFTASSIGN__OPEN && !softassign__fixed_less(&w, &s->exact_distance[j])) continue;
        s->exact_distance[j] = w;
        s->parent[j] = row;
        s->parent_cost[j] = cost;
        s->stamp[j] = 4 * s->epoch + SOFTASSIGN__OPEN;
    }
}

/* The nearest open slot, free ones first; -1: none. */
static int softassign__nearest_exact(const softassign *s)
{
    int j, best = -1;
    for (j = 0; j < s->slot_count; j++) {
        if (s->stamp[j] != 4 * s->epoch + SOFTASSIGN__OPEN) continue;
        if (best >= 0 && softassign__fixed_less(&s->exact_distance[best], &s->exact_distance[j])) continue;
        if (best >= 0 && !softassign__fixed_less(&s->exact_distance[j], &s->exact_distance[best]) &&
            (softassign__is_free(s, best) || !softassign__is_free(s, j))) continue;
        best = j;
    }
    return best;
}

static int softassign__augment_exact(softassign *s, int root)
{
    softassign__fixed zero = {{0, 0, 0, 0, 0}};
    int closed = 0, j, k, i;
    softassign__new_epoch(s);
    s->stats.paths++;
    softassign__relax_exact(s, root, &zero);
    for (;;) {
        j = softassign__nearest_exact(s);
        s->stats.work++;
        if (j < 0) return 0;
        if (softassign__is_free(s, j)) break;
        s->stamp[j] = 4 * s->epoch + SOFTASSIGN__CLOSED;
        s->closed[closed++] = j;
        for (i = s->first_row[j]; i >= 0; i = s->next_row[i]) softassign__relax_exact(s, i, &s->exact_distance[j]);
    }
    for (k = 0; k < closed; k++) {
        softassign__fixed change =
            softassign__fixed_difference(&s->exact_distance[s->closed[k]], &s->exact_distance[j]);
        s->exact_price[s->closed[k]] = softassign__fixed_sum(&s->exact_price[s->closed[k]], &change);
    }
    for (;;) {
        int row = s->parent[j], old = s->slot_of_row[row];
        softassign__assign(s, row, j, s->parent_cost[j]);
        if (row == root) return 1;
        j = old;
    }
}

/* One path a call. The prices that are left are those of the next frame. */
static sat_result softassign__repair_phase(softassign *s)
{
    int j;
    while (s->next < s->rows && s->slot_of_row[s->next] >= 0) s->next++;
    if (s->next < s->rows) {
        if (softassign__augment_exact(s, s->next)) return SAT_OK;
        s->stats.row_error = s->next;
        return SAT_ERR_LIMIT;
    }
    for (j = 0; j < s->slot_count; j++) {
        double price = softassign__fixed_to(&s->exact_price[j]);
        if (j >= s->columns && softassign__is_free(s, j)) { /* forbidden pairs keep a column below its minimum use */
            s->stats.column_error = softassign__column(s, j);
            return SAT_ERR_LIMIT;
        }
        softassign__set_price(s, j, price < s->top[j] ? price : s->top[j]);
    }
    s->excess = 0;
    s->phase = SOFTASSIGN__DONE;
    s->prices_known = 1;
    return SAT_OK;
}

/* ------------------------------------------------------------------------------------------------
   >> proof
   The proof: with every slot full or at its top price, no assignment is cheaper than this one less the excess, the sum
   over the rows of what their own slot's cost - price lies above the least one (complementary slackness).
   ------------------------------------------------------------------------------------------------ */

/* (a - b) - (c - d) and a bound of its error, 0 where the differences are exact. */
static double softassign__difference(double a, double b, double c, double d, double *error)
{
    double x = a - b, t = x - a, x_low = (a - (x - t)) - (b + t);
    double y = c - d, y_low, z, z_low;
    t = y - c;
    y_low = (c - (y - t)) - (d + t);
    z = x - y;
    t = z - x;
    z_low = (x - (z - t)) - (y + t);
    *error = x_low != 0 || y_low != 0 || z_low != 0 ? (fabs(a) + fabs(b) + fabs(c) + fabs(d)) * 1e-31 : 0;
    return z + (z_low + (x_low - y_low));
}

/* How far the row's own slot is from its best, from all costs. */
static double softassign__row_excess(const softassign *s, int row)
{
    double own_cost = s->cost_of_row[row], own_price = s->price[s->slot_of_row[row]], least = 0;
    int j;
    for (j = 0; j < s->slot_count; j++) {
        double w, error, cost;
        if (s->capacity[j] == 0 || !((cost = softassign__cost(s, row, j)) < (double)SOFTASSIGN__INFINITY)) continue;
        w = softassign__difference(cost, own_cost, s->price[j], own_price, &error);
        if (j != s->slot_of_row[row] && w - error < least) least = w - error;
    }
    return -least;
}

/* Sets s->excess; 1 when it is small beside the costs that are used. The rounding of row minima is enough nearly
   always. */
static int softassign__prove(softassign *s)
{
    double *least = s->row_distance, used = 0, quick = 0, most;
    int i;
    s->proving = 1;
    softassign__certify(s);
    s->proving = 0;
    for (i = 0; i < s->rows; i++) {
        double own = s->cost_of_row[i] - s->price[s->slot_of_row[i]], over = own - least[i];
        used += fabs(s->cost_of_row[i]);
        least[i] = (over > 0 ? over : 0) + 4.5e-16 * (fabs(own) + fabs(least[i]));
        quick += least[i];
    }
    most = 1e-13 * used;
    if (s->integers && most > 0.5) most = 0.5; /* a whole unit is never rounding */
    s->excess = quick;
    if (quick <= most) return 1;
    s->excess = 0;
    for (i = 0; i < s->rows; i++)
        if (least[i] > 0) s->excess += softassign__row_excess(s, i);
    return s->excess <= most;
}

/* ------------------------------------------------------------------------------------------------
   >> phases
   The solver: phases that can be left at any time
   ------------------------------------------------------------------------------------------------ */

static void softassign__reset_assignment(softassign *s)
{
    int i, j;
    for (j = 0; j < s->max_slots; j++) {
        s->used[j] = 0;
        s->first_row[j] = -1;
        s->raised[j] = 0;
    }
    for (i = 0; i < s->rows; i++) {
        s->slot_of_row[i] = -1;
        s->stale[i] = 1;
    }
}

static void softassign__reset_prices(softassign *s)
{
    int j;
    s->dearest = 0;
    for (j = 0; j < s->max_slots; j++) softassign__set_price(s, j, j < s->slot_count ? s->top[j] : 0);
    for (; j < s->padded; j++) s->price_f[j] = 0;
}

/* The mean of the row minima at the prices of the moment: the scale of the temperatures. */
static double softassign__mean_least(const softassign *s)
{
    double sum = 0;
    int i, count = 0;
    for (i = 0; i < s->rows; i++)
        if (s->list_length[i] > 0) {
            sum += fabs((double)s->list_cost[(size_t)i * (size_t)s->list]);
            count++;
        }
    return count ? sum / count : 0;
}

/* Rows whose nearest slot is no row's before. */
static int softassign__different_choices(softassign *s)
{
    int *taken = s->holders, i, j, different = 0;
    for (j = 0; j < s->slot_count; j++) taken[j] = 0;
    for (i = 0; i < s->rows; i++)
        different += s->list_length[i] > 0 && !taken[s->list_slot[(size_t)i * (size_t)s->list]]++;
    return different;
}

/* Where hardly two rows of a sample want one slot, short lists will do. Neighbours, which are alike in a picture, stand
   in the sample: runs of rows, not one here and there. */
static void softassign__sample_rows(softassign *s)
{
    int i, part = s->rows / 32, run, different = 0, *taken = s->holders;
    if (s->list <= SOFTASSIGN__SHORT_LIST || s->rows < 128) return;
    for (i = 0; i < s->slot_count; i++) taken[i] = 0;
    for (run = 0; run < 4; run++)
        for (i = 0; i < part; i++) {
            int row = (int)((int64_t)(2 * run + 1) * s->rows / 8) + i;
            s->list_wanted[row] = 4;
            softassign__list_row(s, row, &s->scratch[0]);
            different += s->list_length[row] > 0 && !taken[s->list_slot[(size_t)row * (size_t)s->list]]++;
        }
    s->easy = different > 3 * part; /* photographs: 84 % where they hardly compete, 29 to 51 % elsewhere */
    for (i = 0; i < s->rows; i++) s->list_wanted[i] = s->easy ? SOFTASSIGN__SHORT_LIST : s->list;
}

/* Lists made before the prices moved, at the top prices, hold for any prices; only those made in between are renewed.
   One step of a phase; sets the next phase when it is over. SAT_ERR_LIMIT: stats.row_error found no column. */
static sat_result softassign__list_phase(softassign *s, size_t budget)
{
    int count = s->rows - s->next, i;
    if (s->next == 0 && s->phase == SOFTASSIGN__LISTS && !s->prices_known) softassign__sample_rows(s);
    if ((size_t)count > budget) count = (int)budget;
    sat__parallel_for(&s->options.threads, count, softassign__list_range, s);
    for (i = s->next; i < s->next + count; i++) {
        s->stats.lists_built += s->stale[i];
        s->stale[i] = 0;
    }
    s->next += count;
    s->stats.work += (size_t)count;
    if (s->next < s->rows) return SAT_OK;
    s->next = 0;
    if (s->phase == SOFTASSIGN__RELIST || s->prices_known) s->phase = SOFTASSIGN__PATHS;
    else if (s->easy && softassign__different_choices(s) > s->rows / 2) s->phase = SOFTASSIGN__PATHS;
    else {
        for (i = 0; i < s->rows; i++) s->list_wanted[i] = s->list;
        softassign__certify(s); /* row minima: a bound to show until prices stand still again */
        s->phase = SOFTASSIGN__PRICES;
        s->temperature = 0.3 * softassign__mean_least(s);
        s->schedule[0] = s->schedule[1] = 0;
        if (!(s->temperature > 1e-30)) s->phase = SOFTASSIGN__PATHS;
    }
    return SAT_OK;
}

static sat_result softassign__price_phase(softassign *s)
{
    float overflow = softassign__price_sweep(s, (float)s->temperature);
    s->stats.work += (size_t)s->rows;
    if (overflow >= 0.02f && ++s->schedule[1] < 10) return SAT_OK;
    s->schedule[1] = 0;
    s->temperature *= 0.5;
    if (++s->schedule[0] < 6) return SAT_OK;
    s->phase = SOFTASSIGN__RELIST;
    s->next = 0;
    return SAT_OK;
}

/* Rows that compete leave the matrix: on lists, from prices that softassign finds, their paths are short. */
static void softassign__leave_dense(softassign *s)
{
    s->dense_paths = 0;
    s->prices_known = 0;
    softassign__reset_prices(s);
    softassign__reset_assignment(s);
    s->next = 0;
    s->phase = SOFTASSIGN__LISTS;
}

/* Paths on the matrix go through all columns, those on lists through few. */
static int softassign__is_wide(int rows, int columns)
{
    return !SOFTASSIGN__MATRIX_ALWAYS && columns >= SOFTASSIGN__WIDE_COLUMNS && rows >= SOFTASSIGN__WIDE_ROWS &&
           columns / SOFTASSIGN__WIDE >= rows;
}

/* The first choices of a wide problem: 1 when half of the rows have a best slot of their own, or one of several. A row
   whose slot is still free takes it and pays down to its second best; prices only fall, so that one may be nearer than
   it was, but never farther. The others are left in s->kept. */
static int softassign__first_choices(softassign *s, int *count)
{
    int i, j, different = 0, left = 0;
    for (j = 0; j < s->columns; j++) s->holders[j] = 0;
    for (i = 0; i < s->rows; i++) {
        softassign__pair_of_least two;
        if (s->slot_of_row[i] >= 0) continue;
        two = softassign__two_smallest(s, i);
        j = two.at;
        different += two.second <= two.least || j < 0 || j == s->none || !s->holders[j]++;
        if (j < 0 || s->first_row[j] >= 0) s->kept[left++] = i;
        else {
            softassign__dense_swap(s, i, j);
            softassign__pay_second(s, &two);
        }
    }
    *count = left;
    return different > s->rows / 2;
}

/* Column and row reduction in the first call, then one path a call. Wide problems whose paths grow long go to
   lists; square ones are faster here, also where they compete (tests/bench/bench_softassign.c). */
static sat_result softassign__dense_phase(softassign *s)
{
    int i, large = softassign__is_wide(s->rows, s->columns);
    size_t spent;
    if (s->next == 0) {
        int count = 0;
        if (s->none >= 0) softassign__set_price(s, s->none, 0); /* of another frame */
        if (s->square) {
            if (!s->prices_known) softassign__reduce_columns(s);
            for (i = 0; i < s->rows; i++)
                if (s->slot_of_row[i] < 0) s->kept[count++] = i;
        } else if (!softassign__first_choices(s, &count) && large) {
            softassign__leave_dense(s);
            return SAT_OK;
        }
        s->left = softassign__reduce_rows(s, s->kept, count);
        s->left = softassign__reduce_rows(s, s->kept, s->left);
        s->stats.work += (size_t)s->rows;
        s->paths_from = s->stats.work;
    }
    spent = s->stats.work - s->paths_from;
    if (large &&
        (spent > 40 * (size_t)s->rows || (s->left > s->rows / 4 && s->next >= 16 && spent > 4 * (size_t)s->next))) {
        softassign__leave_dense(s);
        return SAT_OK;
    }
    if (s->next < s->left) {
        if (!softassign__augment_dense(s, s->kept[s->next])) {
            s->stats.row_error = s->kept[s->next];
            return SAT_ERR_LIMIT;
        }
        s->next++;
    }
    if (s->next < s->left) return SAT_OK;
    softassign__dense_publish(s, 1);
    s->phase = SOFTASSIGN__FINISH;
    s->next = 0;
    return SAT_OK;
}

static sat_result softassign__path_phase(softassign *s)
{
    if (s->dense_paths) return softassign__dense_phase(s);
    if (!softassign__augment(s, s->next)) {
        s->stats.row_error = s->next;
        return SAT_ERR_LIMIT;
    }
    if (++s->next < s->rows) return SAT_OK;
    s->phase = SOFTASSIGN__FINISH;
    s->next = 0;
    return SAT_OK;
}

static sat_result softassign__finish_phase(softassign *s)
{
    while (s->next < s->slot_count) {
        int j = s->next;
        if (softassign__is_free(s, j) && s->price[j] < s->top[j]) {
            softassign__finish(s, j);
            return SAT_OK;
        }
        if (j >= s->columns && softassign__is_free(s, j)) break;
        s->next++;
    }
    if (s->next >= s->slot_count) s->phase = SOFTASSIGN__DONE;
    if (s->next < s->slot_count || !softassign__prove(s)) {
        s->excess = -1;
        softassign__start_repair(s);
        s->phase = SOFTASSIGN__REPAIR;
        s->next = 0;
        return SAT_OK;
    }
    s->prices_known = 1;
    return SAT_OK;
}

static sat_result softassign__advance(softassign *s, size_t budget)
{
    size_t stop = s->stats.work + budget;
    sat_result result = SAT_OK;
    while (s->phase != SOFTASSIGN__DONE && s->stats.work < stop && result == SAT_OK) {
        if (s->phase == SOFTASSIGN__LISTS || s->phase == SOFTASSIGN__RELIST)
            result = softassign__list_phase(s, stop - s->stats.work);
        else if (s->phase == SOFTASSIGN__PRICES) result = softassign__price_phase(s);
        else if (s->phase == SOFTASSIGN__PATHS) result = softassign__path_phase(s);
        else if (s->phase == SOFTASSIGN__FINISH) result = softassign__finish_phase(s);
        else result = softassign__repair_phase(s);
    }
    return result;
}

/* ------------------------------------------------------------------------------------------------
   >> memory
   Memory
   ------------------------------------------------------------------------------------------------ */

/* The matrix, and what paths on it need. */
static void softassign__carve_matrix(softassign *s, sat__arena *a)
{
    size_t cells = 0, rows = (size_t)s->rows, seats = (size_t)s->max_slots;
    if (s->dense && !s->in_place && !sat__multiply_size(&cells, rows, (size_t)s->columns)) a->overflow = 1;
    s->wide_matrix = (double *)sat__carve(a, cells, s->wide ? sizeof(double) : sizeof(float));
    s->matrix = (float *)(void *)s->wide_matrix;
    s->dense_price = (double *)sat__carve(a, s->dense ? seats : 0, sizeof(double));
    s->closed_distance = (double *)sat__carve(a, s->dense ? seats : 0, sizeof(double));
    s->block_distance = (double *)sat__carve(a, s->dense ? seats / SOFTASSIGN__STEP + 1 : 0, sizeof(double));
    s->reach = (float *)sat__carve(a, s->dense ? seats : 0, sizeof(float));
    s->seen = (softassign__pair_of_least *)sat__carve(a, s->dense ? rows : 0, sizeof *s->seen);
}

/* Lists, and in their memory the repair, which needs none. */
static void softassign__carve_lists(softassign *s, sat__arena *a)
{
    size_t rows = (size_t)s->rows, list = rows * (size_t)s->list,
           shared = (size_t)s->max_slots * (sizeof(softassign__fixed) / sizeof(float));
    s->list_limit = (double *)sat__carve(a, rows, sizeof(double));
    s->exact_price = (softassign__fixed *)sat__carve(a, list > shared ? list : shared,
                                                     sizeof(float)); /* the repair needs no lists */
    s->exact_distance = (softassign__fixed *)sat__carve(a, list > shared ? list : shared, sizeof(float));
    s->list_cost = (float *)(void *)s->exact_price;
    s->pheromone = s->list_value = (float *)(void *)s->exact_distance;
    s->list_slot = (int *)sat__carve(a, list, sizeof(int));
    s->list_length = (int *)sat__carve(a, rows, sizeof(int));
    s->row_result = s->list_length;
    s->list_wanted = (int *)sat__carve(a, rows, sizeof(int));
}

/* One element a row. */
static void softassign__carve_rows(softassign *s, sat__arena *a)
{
    size_t rows = (size_t)s->rows;
    s->row_largest = s->row_distance = (double *)sat__carve(a, rows, sizeof(double));
    s->bid = (double *)sat__carve(a, rows, sizeof(double));
    s->cost_of_row = (double *)sat__carve(a, rows, sizeof(double));
    s->slot_of_row = (int *)sat__carve(a, rows, sizeof(int));
    s->next_row = (int *)sat__carve(a, rows, sizeof(int));
    s->row_stamp = (int *)sat__carve(a, rows, sizeof(int));
    s->kept = (int *)sat__carve(a, rows, sizeof(int));
    s->leader = (int *)sat__carve(a, rows, sizeof(int));
    s->shown = (int *)sat__carve(a, rows, sizeof(int));
    s->shown_column = (int *)sat__carve(a, rows, sizeof(int));
    s->stale = (unsigned char *)sat__carve(a, rows, 1);
}

/* One element a slot. */
static void softassign__carve_slots(softassign *s, sat__arena *a)
{
    size_t seats = (size_t)s->max_slots, padded = (size_t)s->padded;
    s->price = (double *)sat__carve(a, seats, sizeof(double));
    s->top = (double *)sat__carve(a, seats, sizeof(double));
    s->price_f = (float *)sat__carve(a, padded, sizeof(float));
    s->column_sum = (float *)sat__carve(a, seats, sizeof(float));
    s->soft_row = (float *)sat__carve(a, padded, sizeof(float));
    s->slot_column = (int *)sat__carve(a, seats, sizeof(int));
    s->capacity = (int *)sat__carve(a, seats, sizeof(int));
    s->used = (int *)sat__carve(a, seats, sizeof(int));
    s->first_row = (int *)sat__carve(a, seats, sizeof(int));
    s->holders = s->touched = (int *)sat__carve(a, seats, sizeof(int));
    s->raised = (unsigned char *)sat__carve(a, seats, 1);
}

static void softassign__carve_paths(softassign *s, sat__arena *a)
{
    size_t rows = (size_t)s->rows, seats = (size_t)s->max_slots,
           workers = (size_t)sat__worker_count(&s->options.threads);
    s->distance = (double *)sat__carve(a, seats > 2 * workers ? seats : 2 * workers, sizeof(double));
    s->parent_cost = (double *)sat__carve(a, seats, sizeof(double));
    s->parent = (int *)sat__carve(a, seats, sizeof(int));
    s->stamp = (int *)sat__carve(a, seats, sizeof(int));
    s->order = s->closed = (int *)sat__carve(a, seats + rows, sizeof(int));
    s->heap = (int *)sat__carve(a, seats + rows, sizeof(int));
    s->heap_at = (int *)sat__carve(a, seats + rows, sizeof(int));
}

/* Projections of features. */
static void softassign__carve_bound(softassign *s, sat__arena *a, int features)
{
    size_t rows = (size_t)s->rows, padded = (size_t)s->padded;
    s->basis = (double *)sat__carve(a, (size_t)(2 * SOFTASSIGN__DIMS + 1) * (size_t)features, sizeof(double));
    s->coarse = (float *)sat__carve(a, padded * (size_t)sat__min_int(features, SOFTASSIGN__DIMS), sizeof(float));
    s->row_coarse = (float *)sat__carve(a, rows * (size_t)sat__min_int(features, SOFTASSIGN__DIMS), sizeof(float));
}

static void softassign__carve_scratch(softassign *s, sat__arena *a)
{
    size_t padded = (size_t)s->padded;
    int workers = sat__worker_count(&s->options.threads), w;
    s->scratch = (softassign__scratch *)sat__carve(a, (size_t)workers, sizeof *s->scratch);
    for (w = 0; w < workers; w++) {
        float *keys = (float *)sat__carve(a, padded, sizeof(float));
        float *block_min = (float *)sat__carve(a, padded / SOFTASSIGN__BLOCK, sizeof(float));
        float *select = (float *)sat__carve(a, padded / SOFTASSIGN__BLOCK, sizeof(float));
        softassign__candidate *candidates = (softassign__candidate *)sat__carve(a, padded + 1, sizeof *candidates);
        if (!a->base) continue;
        s->scratch[w].keys = keys;
        s->scratch[w].block_min = block_min;
        s->scratch[w].select = select;
        s->scratch[w].candidates = candidates;
        s->scratch[w].distances = 0;
    }
}

static void softassign__carve_solver(softassign *s, sat__arena *a, int features)
{
    softassign__carve_matrix(s, a);
    softassign__carve_slots(s, a);
    softassign__carve_rows(s, a);
    softassign__carve_lists(s, a);
    softassign__carve_paths(s, a);
    softassign__carve_bound(s, a, features);
    softassign__carve_scratch(s, a);
}

static int softassign__progress(softassign *s, const int *seats);

/* ------------------------------------------------------------------------------------------------
   >> greedy
   Greedy search (Slomp 2012, section 3.4.2), and moves and swaps while they help
   ------------------------------------------------------------------------------------------------ */

#if !defined(SOFTASSIGN_NO_HEURISTICS) || !defined(SOFTASSIGN_NO_MATRIX)

/* The nearest slot with room, through lists that see full slots as infinitely dear. */
static int softassign__nearest_free(softassign *s, int row, double *cost)
{
    size_t at = (size_t)row * (size_t)s->list;
    int again, q;
    for (again = 0; again < 2; again++) {
        for (q = 0; q < s->list_length[row]; q++)
            if (softassign__is_free(s, s->list_slot[at + (size_t)q])) {
                *cost = softassign__listed_cost(s, row, at + (size_t)q);
                return s->list_slot[at + (size_t)q];
            }
        if (!again) softassign__relist(s, row);
    }
    return -1;
}

#define SOFTASSIGN__FULL_PRICE (-1e37)

static void softassign__greedy_take(softassign *s, int row, int slot, double cost)
{
    softassign__assign(s, row, slot, cost);
    if (!softassign__is_free(s, slot)) softassign__set_price(s, slot, SOFTASSIGN__FULL_PRICE);
}

#endif /* SOFTASSIGN_NO_HEURISTICS and SOFTASSIGN_NO_MATRIX */

#ifndef SOFTASSIGN_NO_HEURISTICS

/* Every row takes its best match; rows of a slot that was chosen too often then move, in order, to their best free one.
   Returns the number of rows that found none. */
static int softassign__greedy(softassign *s)
{
    int *wanted = s->holders, *best = s->heap, i, j, lost = 0;
    for (j = 0; j < s->slot_count; j++) wanted[j] = 0;
    for (i = 0; i < s->rows; i++) {
        best[i] = s->list_length[i] ? s->list_slot[(size_t)i * (size_t)s->list] : -1;
        if (best[i] >= 0) wanted[best[i]]++;
    }
    for (i = s->rows - 1; i >= 0; i--) /* the last ones in order keep it */
        if (best[i] >= 0 && s->used[best[i]] < s->capacity[best[i]] )
            softassign__greedy_take(s, i, best[i], softassign__listed_cost(s, i, (size_t)i * (size_t)s->list));
    for (i = 0; i < s->rows; i++) {
        double cost = 0;
        if (s->slot_of_row[i] >= 0) continue;
        j = softassign__nearest_free(s, i, &cost);
        if (j >= 0) softassign__greedy_take(s, i, j, cost);
        else lost++;
        s->stats.iterations++;
    }
    return lost;
}

#endif /* SOFTASSIGN_NO_HEURISTICS */

/* What changes when `row` goes to `slot`: into a place, or in exchange with the row that gains most by it. */
static double softassign__move_gain(softassign *s, int row, int slot, double cost, int *partner, double *partner_cost)
{
    double own = cost - s->cost_of_row[row], best = (double)SOFTASSIGN__INFINITY;
    int k, from = s->slot_of_row[row];
    *partner = -1;
    if (softassign__is_free(s, slot)) return own;
    for (k = s->first_row[slot]; k >= 0; k = s->next_row[k]) {
        double back = softassign__cost(s, k, from), change = own + (back - s->cost_of_row[k]);
        s->scratch[0].distances++;
        if (!(change < best)) continue;
        best = change;
        *partner = k;
        *partner_cost = back;
    }
    return best;
}

static void softassign__move(softassign *s, int row, int slot, double cost, int partner, double partner_cost)
{
    int from = s->slot_of_row[row];
    if (partner >= 0) softassign__unassign(s, partner);
    softassign__assign(s, row, slot, cost);
    if (partner >= 0) softassign__assign(s, partner, from, partner_cost);
}

/* The grid distance of two rows is below the minimum. */
static int softassign__too_close(const softassign *s, int a, int b)
{
    int w = s->options.grid_width;
    double dx = a % w - b % w, dy = a / w - b / w;
    return dx * dx + dy * dy < s->options.min_distance * s->options.min_distance;
}

/* Rows with the same column too close to `row`, were it in `slot`. */
static int softassign__conflicts(const softassign *s, int row, int slot, int without)
{
    int column = softassign__column(s, slot), count = 0, j, k;
    if (s->options.grid_width < 1 || !(s->options.min_distance > 0)) return 0;
    for (j = column; j < s->slot_count; j = j < s->columns ? s->columns : j + 1) {
        if (softassign__column(s, j) != column) continue;
        for (k = s->first_row[j]; k >= 0; k = s->next_row[k])
            count += k != row && k != without && softassign__too_close(s, row, k);
    }
    return count;
}

/* The best move or swap of a row among all columns that are nearer than its own. */
static int softassign__improve_row(softassign *s, int row)
{
    softassign__scratch *w = &s->scratch[0];
    double best = -1e-9 * fabs(s->cost_of_row[row]), to_cost = 0, partner_cost = 0;
    int j, to = -1, partner = -1;
    softassign__keys(s, row, w);
    for (j = 0; j < s->slot_count; j++) {
        double cost, back = 0, gain;
        int other;
        if (!((double)w->keys[j] < s->cost_of_row[row]) || s->capacity[j] == 0 || j == s->slot_of_row[row]) continue;
        cost = softassign__cost(s, row, j);
        w->distances++;
        if (!(cost < s->cost_of_row[row])) continue;
        gain = softassign__move_gain(s, row, j, cost, &other, &back);
        if (!(gain < best) || softassign__conflicts(s, row, j, other)) continue;
        if (other < 0 && s->slot_of_row[row] >= s->columns) continue; /* a mandatory slot stays full */
        if (other >= 0 && softassign__conflicts(s, other, s->slot_of_row[row], row)) continue;
        best = gain;
        to = j;
        to_cost = cost;
        partner = other;
        partner_cost = back;
    }
    if (to >= 0) softassign__move(s, row, to, to_cost, partner, partner_cost);
    s->stats.iterations++;
    return to >= 0;
}

#ifndef SOFTASSIGN_NO_HEURISTICS

static void softassign__two_opt(softassign *s, int passes)
{
    int pass, i, changed = 1, j;
    for (j = 0; j < s->slot_count; j++) softassign__set_price(s, j, 0);
    for (pass = 0; pass < passes && changed; pass++) {
        for (changed = i = 0; i < s->rows; i++) changed += softassign__improve_row(s, i);
        if (changed && softassign__progress(s, s->slot_of_row)) break;
    }
}

#endif /* SOFTASSIGN_NO_HEURISTICS */

/* Assignments are kept as the slots of rows. */
static void softassign__keep_best(softassign *s, int *best)
{
    int i;
    for (i = 0; i < s->rows; i++) best[i] = s->slot_of_row[i];
}

static void softassign__take_back(softassign *s, const int *best)
{
    int i;
    for (i = 0; i < s->rows; i++) softassign__unassign(s, i);
    for (i = 0; i < s->rows; i++) softassign__assign(s, i, best[i], softassign__cost(s, i, best[i]));
}

/* ------------------------------------------------------------------------------------------------
   >> annealing
   Simulated annealing (Slomp 2012, eq 3.7 and 3.8). alpha cancels, as every state has one element a row. A slot is
   drawn at random: free, the row moves; taken, the two rows swap, which section 3.4.3 does for square problems only.
   ------------------------------------------------------------------------------------------------ */

#ifndef SOFTASSIGN_NO_HEURISTICS

static double softassign__cost_now(const softassign *s)
{
    softassign__sum sum = {0, 0, 0};
    int i;
    for (i = 0; i < s->rows; i++) softassign__add(&sum, s->cost_of_row[i]);
    return softassign__total(&sum);
}

static void softassign__anneal(softassign *s, int *best)
{
    const softassign_options *o = &s->options;
    uint64_t seed = o->seed;
    double temperature = o->temperature * softassign__mean_least(s), lowest = softassign__cost_now(s), cost = lowest;
    int step, count = s->rows * sat__min_int(o->iterations[1], 2147483647 / s->rows), n;
    softassign__keep_best(s, best);
    for (step = 0; step < o->iterations[0]; step++, temperature *= o->cooling) {
        for (n = 0; n < count; n++) {
            int row = (int)(softassign__uniform(&seed) * s->rows),
                slot = (int)(softassign__uniform(&seed) * s->slot_count), other;
            double here, back = 0, change;
            s->stats.iterations++;
            if (slot == s->slot_of_row[row] || s->capacity[slot] == 0) continue;
            here = softassign__cost(s, row, slot);
            s->scratch[0].distances++;
            if (!(here < (double)SOFTASSIGN__INFINITY)) continue;
            change = softassign__move_gain(s, row, slot, here, &other, &back);
            if (!(change < (double)SOFTASSIGN__INFINITY)) continue;
            if (change > 0 && !(softassign__uniform(&seed) < exp(-change / temperature))) continue;
            softassign__move(s, row, slot, here, other, back);
            cost += change;
        }
        cost = softassign__cost_now(s); /* the running sum drifts */
        if (cost < lowest) {
            lowest = cost;
            softassign__keep_best(s, best);
        }
        if (softassign__progress(s, s->slot_of_row)) break;
    }
    softassign__take_back(s, best);
}

/* ------------------------------------------------------------------------------------------------
   >> ants
   Ants (Slomp 2012, appendix 3.A): every ant builds an assignment row by row, drawn by pheromone times similarity; all
   trails evaporate, good ones are renewed; what is shown has a share of random tiles that falls to none.
   Pheromone lies on the lists; a row whose list is used up takes the best of some random free slots.
   ------------------------------------------------------------------------------------------------ */

static int softassign__ant_choice(softassign *s, int row, uint64_t *seed, double *cost)
{
    size_t at = (size_t)row * (size_t)s->list;
    float *weight = s->soft_row, sum = 0, nearest = s->list_length[row] ? s->list_cost[at] : 0, near_scale;
    double draw;
    int q, last = -1, tries, slot = -1;
    near_scale = nearest > 0 ? nearest : 1e-30f;
    for (q = 0; q < s->list_length[row]; q++) {
        float ratio = near_scale / (s->list_cost[at + (size_t)q] - nearest + near_scale);
        weight[q] = 0;
        if (!softassign__is_free(s, s->list_slot[at + (size_t)q])) continue;
        ratio *= ratio;
        ratio *= ratio; /* similarity to the fourth */
        weight[q] = s->pheromone[at + (size_t)q] * ratio * ratio;
        sum += weight[q];
        last = q;
    }
    draw = softassign__uniform(seed) * (double)sum;
    for (q = 0; q <= last; q++) {
        draw -= (double)weight[q];
        if (weight[q] > 0 && (draw < 0 || q == last)) {
            *cost = softassign__listed_cost(s, row, at + (size_t)q);
            return s->list_slot[at + (size_t)q];
        }
    }
    for (tries = 0; tries < 64 || slot < 0; tries++) {
        int j = (int)(softassign__uniform(seed) * s->slot_count), n;
        double c;
        for (n = 0; n < s->slot_count && !softassign__is_free(s, j); n++) j = j + 1 < s->slot_count ? j + 1 : 0;
        c = softassign__cost(s, row, j);
        s->scratch[0].distances++;
        if (slot >= 0 && !(c < *cost)) continue;
        slot = j;
        *cost = c;
    }
    return slot;
}

/* One ant; rows in random order. Returns its cost. */
static double softassign__ant(softassign *s, uint64_t *seed, int *order)
{
    int i;
    for (i = 0; i < s->rows; i++) softassign__unassign(s, i);
    for (i = s->rows - 1; i >= 0; i--) {
        int k = (int)(softassign__uniform(seed) * (i + 1)), row = order[k], slot;
        double cost = 0;
        order[k] = order[i];
        order[i] = row;
        slot = softassign__ant_choice(s, row, seed, &cost);
        softassign__assign(s, row, slot, cost);
    }
    s->stats.iterations++;
    return softassign__cost_now(s);
}

static void softassign__deposit(softassign *s, const int *seats, float amount)
{
    int i, q;
    for (i = 0; i < s->rows; i++)
        for (q = 0; q < s->list_length[i]; q++) {
            size_t at = (size_t)i * (size_t)s->list + (size_t)q;
            if (s->list_slot[at] == seats[i]) s->pheromone[at] += amount;
        }
}

/* The iterate for the eye: `count` rows of it get random free slots. */
static void softassign__add_noise(softassign *s, int *shown, int count, uint64_t *seed)
{
    int n, j, i;
    for (j = 0; j < s->slot_count; j++) s->holders[j] = 0;
    for (i = 0; i < s->rows; i++) s->holders[shown[i]]++;
    for (n = 0; n < count; n++) {
        i = (int)(softassign__uniform(seed) * s->rows);
        j = (int)(softassign__uniform(seed) * s->slot_count);
        if (s->holders[j] >= s->capacity[j] || !(softassign__cost(s, i, j) < (double)SOFTASSIGN__INFINITY)) continue;
        s->holders[shown[i]]--;
        s->holders[j]++;
        shown[i] = j;
    }
}

static void softassign__run_ants(softassign *s, int *best, int *leader, int *shown)
{
    const softassign_options *o = &s->options;
    uint64_t seed = o->seed;
    double lowest = (double)SOFTASSIGN__INFINITY;
    int step, ant, i, *order = s->order;
    size_t at, cells = (size_t)s->rows * (size_t)s->list;
    for (at = 0; at < cells; at++) s->pheromone[at] = 1;
    for (i = 0; i < s->rows; i++) order[i] = i;
    for (step = 0; step < o->iterations[0]; step++) {
        double nearest = (double)SOFTASSIGN__INFINITY;
        for (ant = 0; ant < o->ants; ant++) {
            double cost = softassign__ant(s, &seed, order);
            if (!(cost < nearest)) continue;
            nearest = cost;
            softassign__keep_best(s, leader);
        }
        if (nearest < lowest) {
            lowest = nearest;
            for (i = 0; i < s->rows; i++) best[i] = leader[i];
        }
        for (at = 0; at < cells; at++) {
            s->pheromone[at] *= (float)(1 - o->evaporation);
            if (s->pheromone[at] < 1e-3f) s->pheromone[at] = 1e-3f;
        }
        softassign__deposit(s, leader, (float)o->evaporation * 4);
        softassign__deposit(s, best, (float)o->evaporation * 8);
        for (i = 0; i < s->rows; i++) shown[i] = leader[i];
        softassign__add_noise(s, shown, (int)(o->noise * (1 - (double)step / o->iterations[0]) * s->rows), &seed);
        if (softassign__progress(s, shown)) break;
    }
    softassign__take_back(s, best);
}

#endif /* SOFTASSIGN_NO_HEURISTICS */

#ifndef SOFTASSIGN_NO_MATRIX

/* ------------------------------------------------------------------------------------------------
   >> entropic
   Softassign with inequality columns over the whole matrix

   One sweep gives, row by row, the minimum of c - v (which is the row's share of the bound and keeps exp from
   overflowing), the weights, their sum and the column sums. Rows go in 8 fixed chunks: same bits for any worker count.
   ------------------------------------------------------------------------------------------------ */

#define SOFTASSIGN__CHUNKS 8

typedef struct softassign__sweep {
    softassign *s;
    float eps;
    float *columns, *rows;    /* per chunk: column sums, one row of weights */
    double bound[SOFTASSIGN__CHUNKS];
    float *soft;              /* not NULL: the soft matrix is wanted */
    ptrdiff_t soft_stride;
} softassign__sweep;

/* e[j] = c - v and their minimum. */
static float softassign__reduced_row(const float *cost, const float *price, float *e, int n)
{
    float least, m[4];
    int j = 0;
    sat__f32x4 lanes = sat__f32x4_set1(SOFTASSIGN__INFINITY);
    for (; j + 4 <= n; j += 4) {
        sat__f32x4 x = sat__f32x4_sub(sat__f32x4_load(cost + j), sat__f32x4_load(price + j));
        sat__f32x4_store(e + j, x);
        lanes = sat__f32x4_min(x, lanes);
    }
    sat__f32x4_store(m, lanes);
    least = m[0] < m[1] ? m[0] : m[1];
    least = m[2] < least ? m[2] : least;
    least = m[3] < least ? m[3] : least;
    for (; j < n; j++) {
        e[j] = cost[j] - price[j];
        least = e[j] < least ? e[j] : least;
    }
    return least;
}

/* sum[j] += e[j] * factor */
static void softassign__accumulate(float *sum, const float *e, float factor, int n)
{
    int j = 0;
    sat__f32x4 f = sat__f32x4_set1(factor);
    for (; j + 4 <= n; j += 4)
        sat__f32x4_store(sum + j, sat__f32x4_add(sat__f32x4_load(sum + j), sat__f32x4_mul(sat__f32x4_load(e + j), f)));
    for (; j < n; j++) sum[j] += e[j] * factor;
}

static void softassign__sweep_range(int begin, int end, int worker, void *context)
{
    softassign__sweep *w = (softassign__sweep *)context;
    const softassign *s = w->s;
    int chunk, i, j, n = s->columns;
    (void)worker;
    for (chunk = begin; chunk < end; chunk++) {
        float *sum = w->columns + (size_t)chunk * (size_t)n, *e = w->rows + (size_t)chunk * (size_t)n;
        int first = (int)((int64_t)s->rows * chunk / SOFTASSIGN__CHUNKS),
            last = (int)((int64_t)s->rows * (chunk + 1) / SOFTASSIGN__CHUNKS);
        for (j = 0; j < n; j++) sum[j] = 0;
        w->bound[chunk] = 0;
        for (i = first; i < last; i++) {
            float least = softassign__reduced_row(s->matrix + (size_t)i * (size_t)n, s->price_f, e, n), total;
            if (!(least < SOFTASSIGN__INFINITY)) continue;
            w->bound[chunk] += (double)least;
            total = 1 / softassign__weights(e, n, least, softassign__inverse(w->eps));
            softassign__accumulate(sum, e, total, n);
            if (w->soft)
                for (j = 0; j < n; j++) w->soft[(ptrdiff_t)i * w->soft_stride + j] = e[j] * total;
        }
    }
}

/* One sweep; column sums end in the first chunk. Returns the bound at the prices of the sweep, to float rounding. */
static double softassign__sweep_once(softassign__sweep *w)
{
    softassign *s = w->s;
    double bound = 0;
    int c, j;
    sat__parallel_for(&s->options.threads, SOFTASSIGN__CHUNKS, softassign__sweep_range, w);
    for (c = 0; c < SOFTASSIGN__CHUNKS; c++) {
        bound += w->bound[c];
        if (c) softassign__accumulate(w->columns, w->columns + (size_t)c * (size_t)s->columns, 1, s->columns);
    }
    for (j = 0; j < s->columns; j++) bound += (double)s->price_f[j] * s->capacity[j];
    s->stats.iterations++;
    return bound;
}

static float softassign__move_prices(softassign__sweep *w)
{
    softassign *s = w->s;
    float worst = 0;
    int j;
    for (j = 0; j < s->columns; j++) {
        float fill, price;
        if (s->capacity[j] == 0) continue;
        fill = w->columns[j] / (float)s->capacity[j];
        if (fill - 1 > worst) worst = fill - 1;
        if (fill <= 1 && !(s->price_f[j] < 0)) continue;
        price = fill < 1e-36f ? s->price_f[j] + 82 * w->eps : s->price_f[j] - w->eps * logf(fill);
        softassign__set_price(s, j, (double)(price < 0 ? price : 0));
    }
    return worst;
}

/* The prices of the best bound stay. */
static void softassign__entropic(softassign *s, softassign__sweep *w, double *best_price)
{
    const softassign_options *o = &s->options;
    double best = -(double)SOFTASSIGN__INFINITY, eps = o->temperature * softassign__mean_least(s);
    int step, sweep, j, stop = 0;
    SAT_ASSERT(best_price && s->price_f);
    if (!(eps > 0)) eps = 1e-30;
    for (j = 0; j < s->columns; j++) best_price[j] = 0;
    for (j = 0; j < s->columns; j++)
        if (s->capacity[j] == 0) s->price_f[j] = -1e37f; /* out of every row's sight */
    for (step = 0; step < o->iterations[0] && !stop; step++, eps *= o->cooling) {
        w->eps = eps > 1e-37 ? (float)eps : 1e-37f;
        for (sweep = 0; sweep < o->iterations[1]; sweep++) {
            double bound = softassign__sweep_once(w);
            if (bound > best) {
                best = bound;
                for (j = 0; j < s->columns; j++) best_price[j] = s->capacity[j] ? (double)s->price_f[j] : 0;
            }
            if (softassign__move_prices(w) < 0.02f) break;
        }
        stop = softassign__progress(s, NULL);
    }
    if (o->soft) {
        w->soft = o->soft;
        w->soft_stride = o->soft_stride ? o->soft_stride : s->columns;
        (void)softassign__sweep_once(w);
    } else (void)softassign__sweep_once(w);
    for (j = 0; j < s->columns; j++)
        if ((double)w->columns[j] > s->stats.column_sum_max) s->stats.column_sum_max = (double)w->columns[j];
    for (j = 0; j < s->columns; j++) softassign__set_price(s, j, best_price[j]);
}

/* ------------------------------------------------------------------------------------------------
   >> published
   The published softassign, statement by statement (Slomp 2012, section 3.6; D = cost / largest |cost|):

       Q = M .* (D - alpha);  M = exp(clamp(-Q / t)) / sqrt(t)          (Gold et al. 1997: exp(clamp(-(D - alpha) / t)))
       repeat: M = M ./ (sum_cols(M) + outlier);  M = M ./ sum_rows(M)
       once a temperature: cost = sum_all(Q); if (cost < lowest) S = M

   Sums are trees of k gathers as in section 3.7. Forbidden elements are 0. Extraction, which the source leaves open:
   the largest element of each row of S, rows in order; a row whose column is taken gets the nearest free column.
   ------------------------------------------------------------------------------------------------ */

typedef struct softassign__published {
    softassign *s;
    void *m, *best;           /* rows x columns, float or double */
    void *column, *outlier;   /* per column */
    double *row_cost;
    double largest, t, factor;
    int evolves;
} softassign__published;

/* The sum of n values `step` apart: a tree in which every node gathers k. */
static double softassign__gather_f64(const double *v, size_t n, size_t step, int k)
{
    size_t part = 1, i;
    double sum = 0;
    if (n <= (size_t)k) {
        for (i = 0; i < n; i++) sum += v[i * step];
        return sum;
    }
    while (part * (size_t)k < n) part *= (size_t)k;
    for (i = 0; i < n; i += part) sum += softassign__gather_f64(v + i * step, n - i < part ? n - i : part, step, k);
    return sum;
}

static double softassign__gather_f32(const float *v, size_t n, size_t step, int k)
{
    return sat_reduce_f32(v, n, (ptrdiff_t)(step * sizeof(float)), k);
}

static inline double softassign__exp_clamped_f32(double x)
{
    float y = (float)x;
    return (double)expf(y < -70.0f ? -70.0f : y > 70.0f ? 70.0f : y);
}
static inline double softassign__exp_clamped_f64(double x) { return exp(x < -650 ? -650 : x > 650 ? 650 : x); }

#define SOFTASSIGN__DEFINE_PUBLISHED(T, suffix)                                                                        \
    /* Q and M of a range of rows; row_cost[i] = sum of Q's row */                                                     \
    static void softassign__update_##suffix(int begin, int end, int worker, void *context)                             \
    {                                                                                                                  \
        softassign__published *p = (softassign__published *)context;                                                   \
        const softassign *s = p->s;                                                                                    \
        int i, j, n = s->columns, gold = s->options.gold;                                                              \
        T alpha = (T)s->options.alpha, scale = (T)(1 / p->largest), inverse = (T)(1 / p->t), factor = (T)p->factor;\
        (void)worker;                                                                                                  \
        for (i = begin; i < end; i++) {                                                                                \
            const float *cost = s->matrix + (size_t)i * (size_t)n;                                                     \
            T *m = (T *)p->m + (size_t)i * (size_t)n;                                                                  \
            double sum = 0;                                                                                            \
            for (j = 0; j < n; j++) {                                                                                  \
                T q;                                                                                                   \
                if (!(cost[j] < SOFTASSIGN__INFINITY) || s->capacity[j] == 0) continue;                                \
                q = m[j] * ((T)cost[j] * scale - alpha);                                                               \
                sum += (double)q;                                                                                      \
                if (gold) q = (T)cost[j] * scale - alpha;                                                              \
                m[j] = (T)softassign__exp_clamped_##suffix((double)(-q * inverse)) * factor;                           \
            }                                                                                                          \
            p->row_cost[i] = sum;                                                                                      \
        }                                                                                                              \
    }                                                                                                                  \
                                                                                                                       \
    /* 1 / (sum_cols(M) + outlier) for a range of blocks of 64 columns */                                              \
    static void softassign__sum_columns_##suffix(int begin, int end, int worker, void *context)                        \
    {                                                                                                                  \
        softassign__published *p = (softassign__published *)context;                                                   \
        int j, n = p->s->columns, last = sat__min_int(n, end * 64);                                                    \
        (void)worker;                                                                                                  \
        for (j = begin * 64; j < last; j++) {                                                                          \
            double sum = softassign__gather_##suffix((const T *)p->m + j, (size_t)p->s->rows, (size_t)n, p->s->options.gather);\
            T all = (T)sum + ((T *)p->outlier)[j];                                                                     \
            ((T *)p->column)[j] = all > 0 ? 1 / all : 0;                                                               \
            if (p->evolves) ((T *)p->outlier)[j] *= ((T *)p->column)[j];                                               \
        }                                                                                                              \
    }                                                                                                                  \
                                                                                                                       \
    /* M = M ./ columns, then M = M ./ sum_rows(M) */                                                                  \
    static void softassign__normalise_##suffix(int begin, int end, int worker, void *context)                          \
    {                                                                                                                  \
        softassign__published *p = (softassign__published *)context;                                                   \
        int i, j, n = p->s->columns;                                                                                   \
        (void)worker;                                                                                                  \
        for (i = begin; i < end; i++) {                                                                                \
            T *m = (T *)p->m + (size_t)i * (size_t)n, sum;                                                             \
            const T *column = (const T *)p->column;                                                                    \
            for (j = 0; j < n; j++) m[j] *= column[j];                                                                 \
            sum = (T)softassign__gather_##suffix(m, (size_t)n, 1, p->s->options.gather);                               \
            sum = sum > 0 ? 1 / sum : 0;                                                                               \
            for (j = 0; j < n; j++) m[j] *= sum;                                                                       \
        }                                                                                                              \
    }                                                                                                                  \
                                                                                                                       \
    static void softassign__published_##suffix(softassign__published *p)                                               \
    {                                                                                                                  \
        softassign *s = p->s;                                                                                          \
        const softassign_options *o = &s->options;                                                                     \
        size_t cells = (size_t)s->rows * (size_t)s->columns, k;                                                        \
        int cool, steady, turn, j, blocks = (s->columns + 63) / 64;                                                    \
        uint64_t seed = o->seed;                                                                                       \
        double lowest = (double)SOFTASSIGN__INFINITY;                                                                  \
        T *m = (T *)p->m, *best = (T *)p->best;                                                                        \
        p->t = o->temperature;                                                                                         \
        for (k = 0; k < cells; k++) {                                                                                  \
            int column = (int)(k % (size_t)s->columns);                                                                \
            m[k] = (T)(1e-6 + 1e-3 * softassign__uniform(&seed));                                                      \
            if (!(s->matrix[k] < SOFTASSIGN__INFINITY) || s->capacity[column] == 0) m[k] = 0;                          \
            best[k] = m[k];                                                                                            \
        }                                                                                                              \
        for (cool = 0; cool < o->iterations[0]; cool++, p->t *= o->cooling) {                                          \
            double cost = 0;                                                                                           \
            if (!(p->t > 1e-30)) p->t = 1e-30;                                                                         \
            p->factor = softassign__published_factor(p->t, sat__max_int(s->rows, s->columns), o->double_precision);    \
            for (steady = 0; steady < o->iterations[1]; steady++) {                                                    \
                sat__parallel_for(&o->threads, s->rows, softassign__update_##suffix, p);                               \
                for (j = 0; j < s->columns; j++) ((T *)p->outlier)[j] = (T)o->outlier;                                 \
                for (turn = 0; turn < o->iterations[2]; turn++) {                                                      \
                    sat__parallel_for(&o->threads, blocks, softassign__sum_columns_##suffix, p);                       \
                    sat__parallel_for(&o->threads, s->rows, softassign__normalise_##suffix, p);                        \
                    s->stats.iterations++;                                                                             \
                }                                                                                                      \
            }                                                                                                          \
            cost = softassign__gather_f64(p->row_cost, (size_t)s->rows, 1, o->gather);                                 \
            if (cost < lowest) {                                                                                       \
                lowest = cost;                                                                                         \
                for (k = 0; k < cells; k++) best[k] = m[k];                                                            \
            }                                                                                                          \
            if (softassign__progress(s, NULL)) break;                                                                  \
        }                                                                                                              \
        s->stats.soft_cost = lowest;                                                                                   \
    }                                                                                                                  \
                                                                                                                       \
    /* Reads S: the largest element of each row to wanted, the stats, the caller's copy */                             \
    static void softassign__read_soft_##suffix(softassign__published *p, int *wanted)                                  \
    {                                                                                                                  \
        softassign *s = p->s;                                                                                          \
        int i, j, n = s->columns;                                                                                      \
        ptrdiff_t soft_stride = s->options.soft_stride ? s->options.soft_stride : n;                                   \
        for (i = 0; i < s->rows; i++) {                                                                                \
            const T *row = (const T *)p->best + (size_t)i * (size_t)n;                                                 \
            T top = 0;                                                                                                 \
            wanted[i] = -1;                                                                                            \
            for (j = 0; j < n; j++) {                                                                                  \
                if (row[j] > top) {                                                                                    \
                    top = row[j];                                                                                      \
                    wanted[i] = j;                                                                                     \
                }                                                                                                      \
                if (s->options.soft) s->options.soft[(ptrdiff_t)i * soft_stride + j] = (float)row[j];                  \
            }                                                                                                          \
        }                                                                                                              \
        for (j = 0; j < n; j++) {                                                                                      \
            double sum = softassign__gather_##suffix((const T *)p->best + j, (size_t)s->rows, (size_t)n, s->options.gather);\
            if (sum > s->stats.column_sum_max) s->stats.column_sum_max = sum;                                          \
        }                                                                                                              \
    }

SOFTASSIGN__DEFINE_PUBLISHED(float, f32)
SOFTASSIGN__DEFINE_PUBLISHED(double, f64)

/* Hard assignment from the largest elements; duplicates are counted and repaired greedily. Returns rows left over. */
static int softassign__extract(softassign *s, const int *wanted)
{
    int i, j, lost = 0;
    for (i = 0; i < s->rows; i++) {
        j = wanted[i];
        if (j >= 0 && softassign__is_free(s, j)) softassign__greedy_take(s, i, j, softassign__cost(s, i, j));
        else if (j >= 0) s->stats.duplicate_rows++;
    }
    for (i = 0; i < s->rows; i++) {
        double cost = 0;
        if (s->slot_of_row[i] >= 0) continue;
        j = softassign__nearest_free(s, i, &cost);
        if (j >= 0) softassign__greedy_take(s, i, j, cost);
        else lost++;
    }
    return lost;
}

#endif /* SOFTASSIGN_NO_MATRIX */

/* ------------------------------------------------------------------------------------------------
   >> statistics
   Reports
   ------------------------------------------------------------------------------------------------ */

/* Fills cost, bound, gap and counts for an assignment given by slots. */
static void softassign__report_slots(softassign *s, const int *seats)
{
    softassign__sum cost = {0, 0, 0};
    int i, workers = sat__worker_count(&s->options.threads);
    s->stats.switched = 0;
    for (i = 0; i < s->rows; i++) {
        int column = softassign__column(s, seats[i]);
        softassign__add(&cost, softassign__pair(&s->problem, i, column));
        s->stats.switched += s->problem.previous && s->problem.previous[i] >= 0 && s->problem.previous[i] != column;
    }
    s->stats.cost = softassign__total(&cost);
    s->stats.lower_bound = s->bound;
    if (s->phase == SOFTASSIGN__DONE && s->excess >= 0 && s->bonus <= 0) { /* proven by softassign__prove */
        double proven = s->stats.cost - s->excess - fabs(s->stats.cost) * 4.5e-16 - cost.magnitude * 1e-28;
        if (proven > s->bound) s->stats.lower_bound = s->bound = proven;
    }
    s->stats.gap = softassign__gap(s->stats.cost, s->bound, cost.magnitude);
    s->stats.bytes = s->bytes;
    for (i = 0; i < workers; i++) {
        s->stats.distances_computed += s->scratch[i].distances;
        s->scratch[i].distances = 0;
    }
}

/* The column for the caller: -1 for the one that stands for none. */
static inline int softassign__shown_column(const softassign *s, int slot)
{
    int column = softassign__column(s, slot);
    return column < s->problem.columns ? column : -1;
}

/* The stats for the caller: gains where the negative costs were minimised. */
static softassign_stats softassign__outward(const softassign *s)
{
    softassign_stats stats = s->stats;
    if (s->problem.maximise) {
        stats.cost = -stats.cost;
        stats.lower_bound = -stats.lower_bound;
    }
    return stats;
}

/* The dual prices of the optimum, as options.row_price describes them. */
static void softassign__tell_prices(const softassign *s)
{
    const softassign_options *o = &s->options;
    double sign = s->problem.maximise ? -1 : 1;
    int i, j, columns = s->problem.columns, nobody = columns < s->columns && s->used[columns] == s->rows;
    {
        for (j = 0; o->column_price && j < columns; j++) o->column_price[j] = nobody ? 0 : sign * s->price[j];
        for (i = 0; o->row_price && i < s->rows; i++) {
            int slot = s->slot_of_row[i];
            o->row_price[i] = sign * (s->cost_of_row[i] - (nobody ? 0 : s->price[slot]));
        }
    }
}

/* One free slot surfaced at `base`: a row may end there, and another in its stead leave any slot, which then rises to
   its top price. */
static void softassign__open_used(softassign *s, const softassign__search *q, double base)
{
    int j;
    for (j = 0; j < s->slot_count; j++) {
        int known = s->stamp[j] - 4 * s->epoch;
        double w = base + (s->top[j] - s->price[j]);
        if (s->used[j] == 0 || j == q->avoided || known == SOFTASSIGN__CLOSED || w >= q->nearest ||
            (known == SOFTASSIGN__OPEN && w >= s->distance[j]))
            continue;
        softassign__open(s, j, w);
    }
}

/* What the best assignment without a row's pair costs more: the shortest circle through the pair, over rows that change
   their slots, and once over a free slot and one that becomes free. */
static double softassign__margin(softassign *s, int root)
{
    softassign__search q;
    int i, ended = 0;
    q.root = root;
    q.avoided = s->slot_of_row[root];
    q.root_cost = s->cost_of_row[root];
    q.root_price = s->price[q.avoided];
    q.rise = s->top[q.avoided] - q.root_price;
    q.nearest = (double)SOFTASSIGN__INFINITY;
    softassign__new_epoch(s);
    s->heap_size = 0;
    softassign__relax_list(s, &q, root, 0);
    while (s->heap_size > 0) {
        int node = softassign__heap_pop(s);
        double base = softassign__node_key(s, node);
        if (base >= q.nearest) break;
        if (node >= s->slot_count) {
            softassign__open_list(s, &q, node - s->slot_count);
            continue;
        }
        s->stamp[node] = 4 * s->epoch + SOFTASSIGN__CLOSED;
        if (softassign__is_free(s, node) && !ended) {
            ended = 1;
            softassign__open_used(s, &q, base);
        }
        for (i = s->first_row[node]; i >= 0; i = s->next_row[i]) softassign__relax_list(s, &q, i, base);
    }
    return q.nearest;
}

static void softassign__tell_margins(softassign *s)
{
    int i, j, stale = s->dense_paths || s->stats.exact_repair;
    size_t paths = s->stats.paths;
    for (j = 0; j < s->slot_count; j++) stale |= s->raised[j];
    for (i = 0; stale && i < s->rows; i++) { /* prices rose: lists are made anew as they are met */
        s->list_length[i] = 0;
        s->list_limit[i] = -(double)SOFTASSIGN__INFINITY;
    }
    for (i = 0; i < s->rows; i++) s->options.row_margin[i] = softassign__margin(s, i);
    s->stats.paths = paths;
}

/* What options ask for beside the assignment, once it is the optimum. */
static void softassign__tell(softassign *s)
{
    if (!s->stats.complete || s->slot_count != s->columns) return;
    softassign__tell_prices(s);
    if (s->options.row_margin) softassign__tell_margins(s);
}

/* 1 when the caller wants to stop. slots: NULL while there is no assignment to show. */
static int softassign__progress(softassign *s, const int *seats)
{
    softassign_stats shown;
    int i;
    if (!s->options.progress) return 0;
    if (!seats) return s->stopped = s->options.progress(&s->stats, NULL, s->options.progress_user) != 0;
    softassign__report_slots(s, seats);
    for (i = 0; i < s->rows; i++) s->shown_column[i] = softassign__shown_column(s, seats[i]);
    shown = softassign__outward(s);
    return s->stopped = s->options.progress(&shown, s->shown_column, s->options.progress_user) != 0;
}

/* Completes the solver's assignment for the eye: rows without a slot get the nearest listed free one, else the first
   free one. 0 when a row finds none. */
static int softassign__fill(softassign *s, int *seats)
{
    int *used = s->holders, i, j, q, next = 0;
    for (j = 0; j < s->slot_count; j++) used[j] = s->used[j];
    for (i = 0; i < s->rows; i++) seats[i] = s->slot_of_row[i];
    for (i = 0; i < s->rows; i++) {
        if (seats[i] >= 0) continue;
        for (q = 0; s->has_lists && q < s->list_length[i] && seats[i] < 0; q++) {
            j = s->list_slot[(size_t)i * (size_t)s->list + (size_t)q];
            if (used[j] < s->capacity[j]) seats[i] = j;
        }
        while (next < s->slot_count && used[next] >= s->capacity[next]) next++;
        for (j = next; j < s->slot_count && seats[i] < 0; j++)
            if (used[j] < s->capacity[j] && softassign__cost(s, i, j) < (double)SOFTASSIGN__INFINITY) seats[i] = j;
        if (seats[i] < 0) return 0;
        used[seats[i]]++;
    }
    return 1;
}

/* ------------------------------------------------------------------------------------------------
   >> checks
   Checks of costs and features
   ------------------------------------------------------------------------------------------------ */

/* What is wrong with a row of costs; also the copy into the matrix. Costs that are finite and small enough pass a
   comparison of exponents; only a row with others is looked at more closely. */
static sat_result softassign__check_cost(double cost)
{
    if (!sat__is_finite_double(cost)) return cost > 0 ? SAT_OK : SAT_ERR_NON_FINITE; /* NaN is not above 0 */
    return fabs(cost) > (double)SOFTASSIGN__LARGEST_COST ? SAT_ERR_ARGUMENT : SAT_OK;
}

/* 1 when all costs are between -1e30 and 1e30. *second: at or above the second smallest. */
static int softassign__all_tame(const float *cost, int n, float *second)
{
    int j = 0, tame = 1;
    sat__f32x4 most = sat__f32x4_set1(SOFTASSIGN__LARGEST_COST), v[4];
    sat__i32x4 all = sat__i32x4_set1(-1), a, b;
    softassign__lane_minima m;
    m.least = m.second = sat__f32x4_set1(SOFTASSIGN__INFINITY);
    for (; j + 16 <= n; j += 16) {
        v[0] = sat__f32x4_load(cost + j);
        v[1] = sat__f32x4_load(cost + j + 4);
        v[2] = sat__f32x4_load(cost + j + 8);
        v[3] = sat__f32x4_load(cost + j + 12);
        a = sat__i32x4_and(sat__f32x4_less_equal(sat__f32x4_abs(v[0]), most),
                           sat__f32x4_less_equal(sat__f32x4_abs(v[1]), most));
        b = sat__i32x4_and(sat__f32x4_less_equal(sat__f32x4_abs(v[2]), most),
                           sat__f32x4_less_equal(sat__f32x4_abs(v[3]), most));
        all = sat__i32x4_and(all, sat__i32x4_and(a, b));
        softassign__take_lanes(&m, softassign__least_of_four(v));
    }
    *second = softassign__second_of_lanes(&m);
    if (!sat__i32x4_all(all)) return 0;
    for (; j < n; j++) tame &= fabsf(cost[j]) <= SOFTASSIGN__LARGEST_COST;
    return tame;
}

/* Into the copy of the matrix, or nowhere. */
static inline void softassign__store(const softassign *s, size_t at, double cost)
{
    if (!s->dense || s->in_place) return;
    if (s->wide) s->wide_matrix[at] = cost;
    else s->matrix[at] = (float)cost;
}

static inline void softassign__check_one(double cost, double *largest, sat_result *result)
{
    double size = fabs(cost);
    if (size <= (double)SOFTASSIGN__LARGEST_COST) *largest = size > *largest ? size : *largest;
    else if (*result != SAT_ERR_NON_FINITE && softassign__check_cost(cost) != SAT_OK)
        *result = softassign__check_cost(cost);
}

/* Checks what stands in a row, and copies it. */
static sat_result softassign__check_row(softassign *s, int row)
{
    const softassign_problem *p = &s->problem;
    sat_result result = SAT_OK;
    int j, k, plain = p->cost && !p->row_start && !p->maximise;
    const float *floats = plain ? p->cost + softassign__element(p, row, 0) : NULL;
    float second = SOFTASSIGN__INFINITY;
    size_t at = (size_t)row * (size_t)s->columns;
    double largest = 0;
    if (plain && softassign__all_tame(floats, p->columns, &second)) {
        if (s->dense && !s->in_place)
            memcpy(s->matrix + at, floats, (size_t)p->columns * sizeof(float));
        if (s->has_seen && s->in_place) { /* while it is in the cache */
            softassign__scan q = softassign__scan_row(s, row, (double)second);
            s->seen[row] = softassign__look_within(&q, s->columns);
            return result;
        }
    } else if (p->row_start) {
        for (j = 0; s->dense && j < p->columns; j++) softassign__store(s, at + (size_t)j, (double)SOFTASSIGN__INFINITY);
        for (k = p->row_start[row]; k < p->row_start[row + 1]; k++) {
            double cost = softassign__value(p, k);
            softassign__check_one(cost, &largest, &result);
            softassign__store(s, at + (size_t)p->column_index[k], cost);
        }
    } else {
        ptrdiff_t from = softassign__is_matrix(p) ? softassign__element(p, row, 0) : -1;
        int matrix = softassign__is_matrix(p);
        for (j = 0; j < p->columns; j++) {
            double cost = matrix ? softassign__value(p, from + j) : softassign__pair(p, row, j);
            softassign__check_one(cost, &largest, &result);
            softassign__store(s, at + (size_t)j, cost);
        }
    }
    if (s->wide) s->row_largest[row] = largest;
    if (s->columns > p->columns) softassign__store(s, at + (size_t)p->columns, softassign__pair(p, row, p->columns));
    if (s->has_seen) s->seen[row].at = -1;
    return result;
}

static void softassign__check_range(int begin, int end, int worker, void *context)
{
    softassign *s = (softassign *)context;
    int i;
    (void)worker;
    for (i = begin; i < end; i++) {
        int stay = s->problem.previous ? s->problem.previous[i] : -1;
        size_t at = (size_t)i * (size_t)s->columns + (size_t)stay;
        sat_result result;
        s->row_largest[i] = 0;
        result = softassign__check_row(s, i);
        s->row_result[i] = (int)result;
        if (stay >= 0 && s->dense && !s->in_place) {
            if (s->wide) s->wide_matrix[at] -= (double)s->bonus;
            else s->matrix[at] -= s->bonus;
        }
        if (s->has_seen && s->seen[i].at < 0) s->seen[i] = softassign__look_at_row(s, i);
    }
}

static sat_result softassign__check_feature(float f)
{
    return !sat__is_finite(f) ? SAT_ERR_NON_FINITE : fabsf(f) > SOFTASSIGN__LARGEST_FEATURE ? SAT_ERR_ARGUMENT : SAT_OK;
}

static sat_result softassign__check_costs(softassign *s)
{
    const softassign_problem *p = &s->problem;
    size_t k, n = (size_t)p->feature_count;
    sat_result result;
    int i, from_features = softassign__is_features(p);
    for (k = 0; from_features && k < n * (size_t)s->rows; k++)
        if ((result = softassign__check_feature(p->row_features[k])) != SAT_OK) {
            s->stats.row_error = (int)(k / n);
            return result;
        }
    for (k = 0; from_features && k < n * (size_t)p->columns; k++)
        if ((result = softassign__check_feature(p->column_features[k])) != SAT_OK) {
            s->stats.row_error = 0; /* every row meets it */
            s->stats.column_error = (int)(k / n);
            return result;
        }
    if (from_features && !s->dense) return SAT_OK;
    sat__parallel_for(&s->options.threads, s->rows, softassign__check_range, s);
    if (!softassign__is_matrix(p)) s->stats.distances_computed += (size_t)s->rows * (size_t)s->columns;
    for (i = 0; i < s->rows; i++)
        if (s->row_result[i] != SAT_OK) {
            s->stats.row_error = i;
            return (sat_result)s->row_result[i];
        }
    return SAT_OK;
}

/* ------------------------------------------------------------------------------------------------
   >> start
   Starting a problem
   ------------------------------------------------------------------------------------------------ */

/* What a solver has to hold. features, of the basis, and extra, mandatory slots, are 0 where not wanted. */
typedef struct softassign__size {
    int rows, columns, extra, features;
    int dense, in_place, wide; /* as in the solver */
} softassign__size;

/* A given matrix is read where it stands. */
static int softassign__stays(const softassign_problem *p, const softassign_options *o)
{
    return (p->cost || p->cost_double) && !p->row_start && !p->maximise && !(p->unassigned_cost > 0) &&
           !(p->previous && o->switching > 0) && o->method == SOFTASSIGN_AUTO;
}

/* Costs are gone through without lists, in the matrix that is given or made. */
static int softassign__is_dense(const softassign_problem *p, const softassign_options *o)
{
    int64_t cells = (int64_t)p->rows * p->columns;
    if (o->method == SOFTASSIGN_ENTROPIC || o->method == SOFTASSIGN_PUBLISHED) return 1;
    if (o->method != SOFTASSIGN_AUTO) return 0;
    if (cells <= SOFTASSIGN__DENSE_CELLS || SOFTASSIGN__MATRIX_ALWAYS) return 1;
    if (!softassign__is_matrix(p))
        return cells <= SOFTASSIGN__MADE_CELLS && !softassign__is_wide(p->rows, p->columns);
    if (cells > SOFTASSIGN__MATRIX_CELLS) return 0;
    return !p->row_start || cells <= SOFTASSIGN__MADE_CELLS || p->row_start[p->rows] > cells / SOFTASSIGN__SPARSE;
}

/* What a mandatory slot starts at: four times the widest difference of costs. A chain of moves may save more than that
   and leave the slot free; the exact repair knows no such limit. */
static double softassign__mandatory_price(const softassign *s)
{
    const softassign_problem *p = &s->problem;
    double low = 0, high = 0;
    int i, j;
    if (s->projected) { /* no distance is above the sum of the norms */
        for (i = 0; i < s->rows + p->columns; i++) {
            const float *f = i < s->rows ? p->row_features + (size_t)i * (size_t)p->feature_count
                                         : p->column_features + (size_t)(i - s->rows) * (size_t)p->feature_count;
            double norm = 0, *largest = i < s->rows ? &low : &high;
            for (j = 0; j < p->feature_count; j++)
                norm += ((double)f[j] - (double)p->column_features[j]) * ((double)f[j] - (double)p->column_features[j]);
            if (norm > *largest) *largest = norm;
        }
        return 4 * (sqrt(low) + sqrt(high) + (double)p->unassigned_cost) + 1e-30;
    }
    for (i = 0; i < s->rows; i++)
        for (j = 0; j < s->columns; j++) {
            double cost = softassign__cost(s, i, j);
            if (cost < low) low = cost;
            if (cost < (double)SOFTASSIGN__INFINITY && cost > high) high = cost;
        }
    return 4 * (high - low) + 1e-30;
}

static sat_result softassign__make_slots(softassign *s)
{
    const softassign_problem *p = &s->problem;
    int64_t room = 0, needed = 0;
    int j, units = 1;
    s->slot_count = s->columns;
    s->all_open = 1;
    for (j = 0; j < s->columns; j++) {
        int none = j == p->columns, least = p->minimum_use && !none ? p->minimum_use[j] : 0,
            capacity = none ? s->rows : p->capacity ? p->capacity[j] : s->options.capacity_default;
        if (least > capacity) {
            s->stats.column_error = j;
            return SAT_ERR_ARGUMENT;
        }
        room += sat__min_int(capacity, s->rows);
        needed += least;
        units &= none || (capacity == 1 && least == 0);
        s->slot_column[j] = j;
        s->capacity[j] = sat__min_int(capacity - least, s->rows);
        s->all_open &= s->capacity[j] > 0;
        if (least == 0) continue;
        if (s->slot_count == s->max_slots) return needed > s->rows ? SAT_ERR_LIMIT : SAT_ERR_ARGUMENT;
        s->slot_column[s->slot_count] = j;
        s->capacity[s->slot_count++] = least;
    }
    s->unit_capacities = units;
    if (room >= s->rows && needed <= s->rows) return SAT_OK;
    s->stats.row_error = room < s->rows ? (int)room : s->rows - 1;
    return SAT_ERR_LIMIT;
}

/* The bonus for staying, in units of cost: a share of the mean cost of staying. */
static float softassign__switching_bonus(const softassign *s)
{
    softassign__sum sum = {0, 0, 0};
    int i, count = 0;
    if (!s->problem.previous || !(s->options.switching > 0)) return 0;
    for (i = 0; i < s->rows; i++) {
        double cost = s->problem.previous[i] < 0 ? (double)SOFTASSIGN__INFINITY
                                                 : softassign__pair(&s->problem, i, s->problem.previous[i]);
        if (!(fabs(cost) <= (double)SOFTASSIGN__LARGEST_COST)) continue;
        softassign__add(&sum, fabs(cost));
        count++;
    }
    return count ? (float)(s->options.switching * softassign__total(&sum) / count) : 0;
}

/* Prices of another frame end with digits of their own, below those of these costs, and sums of both would round.
   Multiples of a coarse power of 2 leave the sums exact. */
static void softassign__round_prices(softassign *s)
{
    double unit;
    int exponent, j;
    (void)frexp(s->scale, &exponent);
    unit = ldexp(1, exponent - 24);
    for (j = 0; j < s->max_slots; j++) softassign__set_price(s, j, floor(s->price[j] / unit) * unit);
}

/* Checks a problem and makes everything that does not depend on prices. */
static sat_result softassign__start(softassign *s, const softassign_problem *problem)
{
    sat_result result;
    double before = s->scale;
    int j, known = s->prices_known, optional = problem->unassigned_cost > 0;
    s->problem = *problem;
    s->columns = problem->columns + optional;
    s->none = optional ? problem->columns : -1;
    s->square = s->rows == s->columns && !optional;
    s->wide = !problem->cost && softassign__is_matrix(problem);
    s->integers = s->wide && !problem->cost_double;
    s->projected = softassign__is_features(problem) && !problem->maximise && !s->dense;
    s->phase = SOFTASSIGN__START;
    memset(&s->stats, 0, sizeof s->stats);
    s->stats.row_error = s->stats.column_error = -1;
    s->bound = -(double)SOFTASSIGN__INFINITY;
    s->excess = -1;
    result = softassign__make_slots(s);
    if (result != SAT_OK) return result;
    s->bonus = softassign__switching_bonus(s);
    s->in_place = s->dense && softassign__stays(problem, &s->options);
    s->dense_paths = s->dense && s->unit_capacities && s->options.method == SOFTASSIGN_AUTO;
    s->has_seen = s->dense_paths && !s->square && !known;
    for (j = 0; s->has_seen && j < s->columns; j++) softassign__set_price(s, j, 0);
    result = softassign__check_costs(s);
    if (result != SAT_OK) return result;
    s->scale = s->wide ? (double)problem->unassigned_cost : 0;
    for (j = 0; s->wide && j < s->rows; j++)
        if (s->row_largest[j] > s->scale) s->scale = s->row_largest[j];
    if (s->wide && !(s->scale < before * 4 && before < s->scale * 4))
        s->prices_known = known = 0; /* they would drown these costs */
    if (s->wide && known) softassign__round_prices(s);
    for (j = 0; j < s->max_slots; j++) s->top[j] = 0;
    s->dims = 0;
    if (s->projected) softassign__start_bound(s);
    if (s->slot_count > s->columns) {
        double high = softassign__mandatory_price(s);
        for (j = s->columns; j < s->slot_count; j++) s->top[j] = high;
    }
    if (!known) softassign__reset_prices(s);
    softassign__reset_assignment(s);
    for (j = 0; j < s->rows; j++) {
        s->list_length[j] = 0;
        s->list_wanted[j] = s->list;
        s->list_limit[j] = s->projected ? 0 : -(double)SOFTASSIGN__INFINITY;
    }
    s->next = s->easy = 0;
    s->phase = s->dense_paths ? SOFTASSIGN__PATHS : SOFTASSIGN__LISTS;
    for (j = 0; known && !(s->dense_paths && s->square) && j < s->slot_count;
         j++) /* a square matrix lets prices rise above 0 */
        if (s->price[j] > s->top[j]) softassign__set_price(s, j, s->top[j]);
    return SAT_OK;
}

/* ------------------------------------------------------------------------------------------------
   >> step
   Public: create, step, destroy
   ------------------------------------------------------------------------------------------------ */

SOFTASSIGN_DEF int softassign_version(void) { return SOFTASSIGN_VERSION; }

SOFTASSIGN_DEF softassign_options softassign_method_defaults(softassign_method method)
{
    softassign_options o;
    sat__fields_default(&o, sizeof o, softassign__fields, SAT__COUNT(softassign__fields));
    o.method = method;
    o.seed = 1;
    if (method == SOFTASSIGN_PUBLISHED) {
        o.temperature = 0.1;
        o.cooling = 0.9;
        o.iterations[0] = 50;
    }
    if (method == SOFTASSIGN_ANNEALING) {
        o.temperature = 0.5;
        o.cooling = 0.95;
        o.iterations[0] = 120;
        o.iterations[1] = 400;
    }
    if (method == SOFTASSIGN_ANTS) {
        o.neighbours = 192;
        o.iterations[0] = 200;
    }
    if (method == SOFTASSIGN_GREEDY_2OPT) o.iterations[0] = 20;
    return o;
}

SOFTASSIGN_DEF softassign_options softassign_defaults(void) { return softassign_method_defaults(SOFTASSIGN_AUTO); }

static sat_result softassign__allocate(softassign **out, const softassign__size *size,
                                       const softassign_options *options)
{
    softassign *s, measure;
    sat__arena arena = {NULL, 0, 0};
    sat_allocator allocator;
    sat_result result;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    if (!sat__resolve_allocator(&allocator, &options->allocator)) return SAT_ERR_ARGUMENT;
    if (size->columns > 2147483647 / 2 - 64 || size->rows > 2147483647 / 2 - 64 ||
        size->extra > 2147483647 / 2 - 64 - size->columns)
        return SAT_ERR_SIZE;
    memset(&measure, 0, sizeof measure);
    measure.options = *options;
    measure.allocator = allocator;
    measure.rows = size->rows;
    measure.columns = measure.most_columns = size->columns;
    measure.max_slots = size->columns + size->extra;
    measure.padded = (measure.max_slots + SOFTASSIGN__BLOCK - 1) / SOFTASSIGN__BLOCK * SOFTASSIGN__BLOCK;
    measure.dense = size->dense;
    measure.in_place = size->in_place;
    measure.wide = size->wide;
    measure.has_lists = 1;
    measure.list = sat__min_int(options->neighbours, measure.max_slots);
    sat__carve(&arena, 1, sizeof *s);
    softassign__carve_solver(&measure, &arena, size->features);
    result = sat__arena_allocate(&arena, &measure.block, &measure.bytes, &allocator);
    if (result != SAT_OK) return result;
    s = (softassign *)sat__carve(&arena, 1, sizeof *s);
    *s = measure;
    softassign__carve_solver(s, &arena, size->features);
    memset(s->stamp, 0, (size_t)s->max_slots * sizeof(int));
    memset(s->row_stamp, 0, (size_t)size->rows * sizeof(int));
    s->phase = SOFTASSIGN__START;
    *out = s;
    return SAT_OK;
}

SOFTASSIGN_DEF sat_result softassign_create(softassign **out, int rows, int columns, const softassign_options *options)
{
    softassign_options o;
    softassign__size size = {0, 0, 0, 0, 0, 0, 1};
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    o = options ? *options : softassign_defaults();
    if (!softassign__options_are_valid(&o) || rows < 1 || columns < 1 ||
        (unsigned)o.method > (unsigned)SOFTASSIGN_EXACT)
        return SAT_ERR_ARGUMENT;
    size.rows = rows;
    size.columns = columns < 2147483647 ? columns + 1 : columns; /* and none */
    size.dense = o.method == SOFTASSIGN_AUTO && (int64_t)rows * columns <= SOFTASSIGN__DENSE_CELLS;
    size.features = size.dense ? 0 : SOFTASSIGN__BOUND_FEATURES;
    return softassign__allocate(out, &size, &o);
}

SOFTASSIGN_DEF void softassign_destroy(softassign *solver)
{
    sat_allocator allocator;
    if (!solver) return;
    allocator = solver->allocator;
    sat__release(&allocator, solver->block, solver->bytes);
}

SOFTASSIGN_DEF void softassign_next_frame(softassign *solver)
{
    if (!solver) return;
    if (solver->phase < SOFTASSIGN__PATHS && solver->phase != SOFTASSIGN__START) solver->prices_known = 0;
    solver->phase = SOFTASSIGN__START;
}

/* Bounds hold in every phase but while prices move up and down. */
static void softassign__update_bound(softassign *s)
{
    double before = s->bound;
    if (s->phase == SOFTASSIGN__PRICES || s->phase == SOFTASSIGN__RELIST || s->phase == SOFTASSIGN__REPAIR) return;
    if (s->phase == SOFTASSIGN__DONE && s->bonus <= 0) return; /* the proof is the bound */
    softassign__certify(s);
    if (before > s->bound) s->bound = before;
}

static sat_result softassign__step_slots(softassign *s, size_t budget, int *seats)
{
    sat_result result = softassign__advance(s, budget);
    for (;;) {
        if (s->dense_paths && s->phase == SOFTASSIGN__PATHS) softassign__dense_publish(s, 0);
        if (result != SAT_OK || softassign__fill(s, seats)) break;
        result = softassign__advance(s, 1); /* forbidden pairs: the paths must decide */
    }
    if (result != SAT_OK) return result;
    softassign__update_bound(s);
    softassign__report_slots(s, seats);
    s->stats.complete = s->phase == SOFTASSIGN__DONE;
    s->stats.method = s->dense_paths ? SOFTASSIGN_AUTO : SOFTASSIGN_EXACT;
    return SAT_OK;
}

/* What was begun may be gone on with: the same kind of costs. */
static int softassign__goes_on(const softassign_problem *a, const softassign_problem *b)
{
    return !a->cost == !b->cost && !a->cost_double == !b->cost_double && !a->cost_int == !b->cost_int &&
           !a->cost_fn == !b->cost_fn && !a->row_start == !b->row_start && a->maximise == b->maximise &&
           (a->unassigned_cost > 0) == (b->unassigned_cost > 0);
}

SOFTASSIGN_DEF sat_result softassign_step(softassign *solver, int *column_of_row, const softassign_problem *problem,
                                          size_t work_budget, softassign_stats *stats)
{
    softassign *s = solver;
    sat_result result = SAT_OK;
    int i;
    if (!s || !column_of_row || !softassign__problem_is_valid(problem)) return SAT_ERR_ARGUMENT;
    if (problem->rows != s->rows || problem->columns != s->most_columns - 1) return SAT_ERR_MISMATCH;
    if (problem->minimum_use) return SAT_ERR_ARGUMENT;
    if (s->phase == SOFTASSIGN__START) result = softassign__start(s, problem);
    else if (softassign__goes_on(&s->problem, problem)) s->problem = *problem;
    else return SAT_ERR_MISMATCH;
    if (result == SAT_OK) result = softassign__step_slots(s, work_budget, s->shown);
    if (stats) *stats = softassign__outward(s);
    if (result != SAT_OK) {
        s->phase = SOFTASSIGN__START;
        s->prices_known = 0;
        return result;
    }
    for (i = 0; i < s->rows; i++) column_of_row[i] = softassign__shown_column(s, s->shown[i]);
    softassign__tell(s);
    return SAT_OK;
}

/* ------------------------------------------------------------------------------------------------
   >> solve
   Public: one problem, any method
   ------------------------------------------------------------------------------------------------ */

static sat_result softassign__list_all(softassign *s)
{
    memset(s->stale, 1, (size_t)s->rows);
    s->next = 0;
    s->phase = SOFTASSIGN__RELIST; /* goes on to the paths */
    return softassign__list_phase(s, (size_t)-1);
}

static sat_result softassign__solve_exact(softassign *s)
{
    size_t budget = s->options.progress ? 8 * (size_t)s->rows : (size_t)-1 / 4;
    sat_result result;
    do {
        result = softassign__step_slots(s, budget, s->shown);
        if (result != SAT_OK) return result;
    } while (!s->stats.complete && !softassign__progress(s, s->shown));
    return SAT_OK;
}

/* The optimum from the prices of the moment. */
static sat_result softassign__solve_from_prices(softassign *s)
{
    softassign__reset_assignment(s);
    softassign__list_all(s);
    return softassign__solve_exact(s);
}

static sat_result softassign__solve_fast(softassign *s)
{
    double scale, eps;
    int turn, done = 0;
    if (s->slot_count > s->columns) return softassign__solve_exact(s); /* bids for a minimum use climb in small steps */
    softassign__list_all(s);
    scale = softassign__mean_least(s);
    eps = 1.6 * fmin(s->options.gap, 1) * scale; /* measured: the certified gap is 0.37 to 0.6 eps */
    for (turn = 0; eps > 0 && turn < 2000; turn++) {
        if ((done = softassign__auction(s, eps, (size_t)s->rows)) != 0 || !s->options.progress) {
            if (done) break;
            continue;
        }
        softassign__certify(s);
        if (!softassign__fill(s, s->shown) || !softassign__progress(s, s->shown)) continue;
        s->stats.method = SOFTASSIGN_FAST; /* stopped: complete stays 0 */
        return SAT_OK;
    }
    if (done) {
        s->phase = SOFTASSIGN__DONE;
        softassign__keep_best(s, s->shown);
        softassign__certify(s);
        softassign__report_slots(s, s->shown);
        s->stats.complete = 1;
        s->stats.method = SOFTASSIGN_FAST;
        if (s->stats.gap <= s->options.gap) return SAT_OK;
    }
    return softassign__solve_from_prices(s);
}

#ifndef SOFTASSIGN_NO_MATRIX

static sat_result softassign__solve_entropic(softassign *s, softassign__sweep *w, double *best_price)
{
    sat_result result;
    double swept;
    w->s = s;
    w->soft = NULL;
    softassign__list_all(s);
    softassign__entropic(s, w, best_price);
    softassign__list_all(s);
    softassign__certify(s);
    swept = s->bound;
    for (s->next = 0; s->phase == SOFTASSIGN__PATHS;) {
        result = softassign__path_phase(s);
        if (result != SAT_OK) return result;
    }
    softassign__certify(s);
    if (swept > s->bound) s->bound = swept;
    softassign__keep_best(s, s->shown);
    return SAT_OK;
}

#endif /* SOFTASSIGN_NO_MATRIX */

#if !defined(SOFTASSIGN_NO_HEURISTICS) || !defined(SOFTASSIGN_NO_MATRIX)

/* Rows that a greedy search could not place get an augmenting path, which exists if any assignment does. */
static sat_result softassign__place_rest(softassign *s, int lost)
{
    int i;
    softassign__reset_prices(s);
    if (!lost) return SAT_OK;
    softassign__list_all(s);
    for (i = 0; i < s->rows; i++)
        if (s->slot_of_row[i] < 0 && !softassign__augment(s, i)) {
            s->stats.row_error = i;
            return SAT_ERR_LIMIT;
        }
    softassign__reset_prices(s);
    return SAT_OK;
}

#endif

#ifndef SOFTASSIGN_NO_MATRIX

static sat_result softassign__solve_published(softassign *s, softassign__published *p)
{
    size_t k, cells = (size_t)s->rows * (size_t)s->columns;
    int wide = s->options.double_precision;
    p->s = s;
    p->evolves = s->options.outlier_evolves;
    p->largest = 0;
    for (k = 0; k < cells; k++)
        if (s->matrix[k] < SOFTASSIGN__INFINITY && fabs((double)s->matrix[k]) > p->largest)
            p->largest = fabs((double)s->matrix[k]);
    if (!(p->largest > 1e-30)) p->largest = 1;
    softassign__list_all(s);
    softassign__certify(s);
    SAT_ASSERT(p->m && p->best && p->column && p->outlier);
    if (wide) softassign__published_f64(p);
    else softassign__published_f32(p);
    if (wide) softassign__read_soft_f64(p, s->shown);
    else softassign__read_soft_f32(p, s->shown);
    return softassign__place_rest(s, softassign__extract(s, s->shown));
}

#endif /* SOFTASSIGN_NO_MATRIX */

#ifndef SOFTASSIGN_NO_HEURISTICS

static sat_result softassign__solve_heuristic(softassign *s)
{
    const softassign_options *o = &s->options;
    sat_result result;
    softassign__list_all(s);
    softassign__certify(s);
    result = softassign__place_rest(s, softassign__greedy(s));
    if (result != SAT_OK) return result;
    if (o->method == SOFTASSIGN_GREEDY) {
        (void)softassign__progress(s, s->slot_of_row);
        return result;
    }
    if (o->method == SOFTASSIGN_GREEDY_2OPT) softassign__two_opt(s, o->iterations[0]);
    else {
        softassign__list_all(s);
        softassign__keep_best(s, s->kept);
        softassign__keep_best(s, s->leader);
        if (o->method == SOFTASSIGN_ANNEALING) softassign__anneal(s, s->kept);
        else softassign__run_ants(s, s->kept, s->leader, s->shown);
    }
    return SAT_OK;
}

#endif /* SOFTASSIGN_NO_HEURISTICS */

#if !defined(SOFTASSIGN_NO_HEURISTICS) || !defined(SOFTASSIGN_NO_MATRIX)

/* A bound for the methods that have no prices, from the auction. */
static sat_result softassign__buy_bound(softassign *s)
{
    double before = s->bound;
    softassign_stats kept = s->stats;
    sat_result result = SAT_OK;
    softassign_progress_fn *progress = s->options.progress;
    s->options.progress = NULL;
    softassign__keep_best(s, s->kept);
    softassign__reset_assignment(s);
    softassign__reset_prices(s);
    result = softassign__solve_fast(s);
    s->options.progress = progress;
    if (before > s->bound) s->bound = before;
    s->excess = -1; /* the proof was about the optimum */
    kept.distances_computed = s->stats.distances_computed;
    s->stats = kept;
    softassign__reset_assignment(s);
    softassign__take_back(s, s->kept);
    return result;
}

#endif

/* Undoes pairs of rows that have one column too close: each such row moves to its best column without conflict; then
   moves and swaps that create none. The bound is that of the problem without distances, so it holds. */
static void softassign__separate(softassign *s)
{
    int i, j, round;
    for (j = 0; j < s->slot_count; j++) softassign__set_price(s, j, 0);
    for (i = 0; i < s->rows; i++) {
        softassign__scratch *w = &s->scratch[0];
        double best = (double)SOFTASSIGN__INFINITY;
        int to = -1;
        if (s->slot_of_row[i] >= s->columns || !softassign__conflicts(s, i, s->slot_of_row[i], -1))
            continue; /* mandatory ones stay */
        softassign__keys(s, i, w);
        for (j = 0; j < s->slot_count; j++) {
            double cost;
            if (!((double)w->keys[j] < best) || !softassign__is_free(s, j) || softassign__conflicts(s, i, j, -1))
                continue;
            cost = softassign__cost(s, i, j);
            if (!(cost < best)) continue;
            best = cost;
            to = j;
        }
        if (to >= 0) softassign__assign(s, i, to, best);
    }
    for (round = 0; round < 4; round++) {
        int changed = 0;
        for (i = 0; i < s->rows; i++) changed += softassign__improve_row(s, i);
        if (!changed) break;
    }
    s->stats.conflicts = 0;
    for (i = 0; i < s->rows; i++) s->stats.conflicts += softassign__conflicts(s, i, s->slot_of_row[i], -1);
    s->stats.conflicts /= 2;
}

/* Scratch of the matrix methods, in one block of its own. */
typedef struct softassign__matrix_work {
#ifndef SOFTASSIGN_NO_MATRIX
    softassign__sweep sweep;
    softassign__published published;
    double *best_price;
#endif
    void *block;
    size_t bytes;
} softassign__matrix_work;

#ifndef SOFTASSIGN_NO_MATRIX

static sat_result softassign__allocate_matrix_work(softassign *s, softassign__matrix_work *w)
{
    sat__arena a = {NULL, 0, 0};
    size_t columns = (size_t)s->columns, cells, element = s->options.double_precision ? sizeof(double) : sizeof(float);
    int pass;
    if (s->options.method != SOFTASSIGN_ENTROPIC && s->options.method != SOFTASSIGN_PUBLISHED) return SAT_OK;
    if (!sat__multiply_size(&cells, (size_t)s->rows, columns)) return SAT_ERR_SIZE;
    for (pass = 0; pass < 2; pass++) {
        if (s->options.method == SOFTASSIGN_ENTROPIC) {
            w->sweep.columns = (float *)sat__carve(&a, columns * SOFTASSIGN__CHUNKS, sizeof(float));
            w->sweep.rows = (float *)sat__carve(&a, columns * SOFTASSIGN__CHUNKS, sizeof(float));
            w->best_price = (double *)sat__carve(&a, columns, sizeof(double));
        } else {
            w->published.m = sat__carve(&a, cells, element);
            w->published.best = sat__carve(&a, cells, element);
            w->published.column = sat__carve(&a, columns, element);
            w->published.outlier = sat__carve(&a, columns, element);
            w->published.row_cost = (double *)sat__carve(&a, (size_t)s->rows, sizeof(double));
        }
        if (pass) break;
        if (a.overflow) return SAT_ERR_SIZE;
        w->bytes = a.used + 63;
        w->block = sat__alloc(&s->allocator, w->bytes);
        if (!w->block) {
            w->bytes = 0;
            return SAT_ERR_MEMORY;
        }
        a.base = sat__align64(w->block);
        a.used = 0;
    }
    s->bytes += w->bytes; /* reported; the solver's own block is released with its own size */
    return SAT_OK;
}

#endif /* SOFTASSIGN_NO_MATRIX */

/* The method itself: from here on the assignment stands in s->shown for the methods with prices, else in the solver. */
static sat_result softassign__run_method(softassign *s, softassign__matrix_work *w)
{
    int method = (int)s->options.method;
    (void)w;
    if (method <= SOFTASSIGN_EXACT) return softassign__solve_exact(s);
    if (method == SOFTASSIGN_FAST) return softassign__solve_fast(s);
#ifndef SOFTASSIGN_NO_MATRIX
    if (method == SOFTASSIGN_ENTROPIC) return softassign__solve_entropic(s, &w->sweep, w->best_price);
    if (method == SOFTASSIGN_PUBLISHED) return softassign__solve_published(s, &w->published);
#endif
#ifndef SOFTASSIGN_NO_HEURISTICS
    if (method >= SOFTASSIGN_GREEDY) return softassign__solve_heuristic(s);
#endif
    return SAT_ERR_ARGUMENT; /* left out */
}

static sat_result softassign__run(softassign *s, softassign__matrix_work *w)
{
    sat_result result = softassign__run_method(s, w);
    int method = (int)s->options.method, has_prices = method <= SOFTASSIGN_ENTROPIC;
    if (result != SAT_OK) return result;
#if !defined(SOFTASSIGN_NO_HEURISTICS) || !defined(SOFTASSIGN_NO_MATRIX)
    if (!has_prices && s->options.certify) result = softassign__buy_bound(s);
#endif
    if (method > SOFTASSIGN_FAST) {
        s->stats.method = s->options.method;
        s->stats.complete = !s->stopped;
    }
    if (s->options.min_distance > 0) {
        s->excess = -1; /* what follows is another assignment */
        if (s->dense_paths) softassign__dense_publish(s, 0);
        if (has_prices) softassign__take_back(s, s->shown);
        softassign__separate(s);
    }
    if (s->options.min_distance > 0 || !has_prices) softassign__keep_best(s, s->shown);
    softassign__report_slots(s, s->shown);
    return result;
}

static int softassign__mandatory_count(const softassign_problem *p)
{
    int j, count = 0;
    for (j = 0; p->minimum_use && j < p->columns; j++) count += p->minimum_use[j] > 0;
    return count;
}

/* The first column whose minimum use is above its capacity, or -1. */
static int softassign__over_used(const softassign_problem *p, const softassign_options *o)
{
    int j;
    for (j = 0; p->minimum_use && j < p->columns; j++)
        if (p->minimum_use[j] > (p->capacity ? p->capacity[j] : o->capacity_default)) return j;
    return -1;
}

static sat_result softassign__solve_valid(int *column_of_row, const softassign_problem *problem,
                                          const softassign_options *options, softassign_stats *stats)
{
    softassign__matrix_work work;
    softassign__size size;
    softassign *s;
    sat_result result;
    int i;
    if (problem->columns == 2147483647) return SAT_ERR_SIZE;
    size.rows = problem->rows;
    size.columns = problem->columns + (problem->unassigned_cost > 0);
    size.extra = softassign__mandatory_count(problem);
    size.features =
        softassign__is_features(problem) ? sat__min_int(problem->feature_count, SOFTASSIGN__BOUND_FEATURES) : 0;
    size.dense = softassign__is_dense(problem, options);
    size.in_place = size.dense && softassign__stays(problem, options);
    size.wide = !problem->cost && softassign__is_matrix(problem);
    result = softassign__allocate(&s, &size, options);
    if (result != SAT_OK) return result;
    memset(&work, 0, sizeof work);
#ifndef SOFTASSIGN_NO_MATRIX
    result = softassign__allocate_matrix_work(s, &work);
#endif
    if (result == SAT_OK) result = softassign__start(s, problem);
    if (result == SAT_OK) result = softassign__run(s, &work);
    if (stats) *stats = softassign__outward(s);
    for (i = 0; result == SAT_OK && i < s->rows; i++) column_of_row[i] = softassign__shown_column(s, s->shown[i]);
    if (result == SAT_OK) softassign__tell(s);
    s->bytes -= work.bytes;
    if (work.block) sat__release(&s->allocator, work.block, work.bytes);
    softassign_destroy(s);
    return result;
}

SOFTASSIGN_DEF sat_result softassign_solve(int *column_of_row, const softassign_problem *problem,
                                           const softassign_options *options, softassign_stats *stats)
{
    softassign_options o = options ? *options : softassign_defaults();
    sat__text ignored = sat__text_begin(NULL, 0);
    if (stats) {
        memset(stats, 0, sizeof *stats);
        stats->row_error = stats->column_error = -1;
    }
    if (!column_of_row || !softassign__options_are_valid(&o)) return SAT_ERR_ARGUMENT;
    if (!softassign__problem_is_valid(problem)) return SAT_ERR_ARGUMENT;
    if (!softassign__explain_problem(&ignored, problem, &o)) {
        if (stats) stats->column_error = softassign__over_used(problem, &o);
        return SAT_ERR_ARGUMENT;
    }
    return softassign__solve_valid(column_of_row, problem, &o, stats);
}

#ifndef SOFTASSIGN_NO_MOSAIC

/* ------------------------------------------------------------------------------------------------
   >> mosaics
   Public: photomosaics
   ------------------------------------------------------------------------------------------------ */

SOFTASSIGN_DEF sat_result softassign_features(float *out, const sat_image *image, int grid_width, int grid_height,
                                              int parts_x, int parts_y, const softassign_options *options)
{
    sat_options o = sat_defaults();
    sat_table *table;
    sat_result result;
    size_t size;
    int cx, cy, u, v, c, channels;
    if (!out || !sat__image_is_valid(image) || grid_width < 1 || grid_height < 1 || parts_x < 1 || parts_y < 1)
        return SAT_ERR_ARGUMENT;
    if ((int64_t)grid_width * parts_x > 2147483647 || (int64_t)grid_height * parts_y > 2147483647) return SAT_ERR_SIZE;
    channels = image->channels;
    if (!sat__multiply_size(&size, (size_t)(grid_width * parts_x), (size_t)(grid_height * parts_y)) ||
        !sat__multiply_size(&size, size, (size_t)channels * sizeof(float))) return SAT_ERR_SIZE;
    if (options) {
        o.allocator = options->allocator;
        o.threads = options->threads;
    }
    result = sat_create(&table, image->width, image->height, channels, &o);
    if (result != SAT_OK) return result;
    result = sat_build(table, image);
    for (cy = 0; result == SAT_OK && cy < grid_height; cy++)
        for (cx = 0; cx < grid_width; cx++)
            for (v = 0; v < parts_y; v++)
                for (u = 0; u < parts_x; u++) {
                    double step_x = (double)image->width / (grid_width * parts_x),
                           step_y = (double)image->height / (grid_height * parts_y);
                    double x0 = (cx * parts_x + u) * step_x, y0 = (cy * parts_y + v) * step_y;
                    double x1 = (cx * parts_x + u + 1) * step_x, y1 = (cy * parts_y + v + 1) * step_y;
                    for (c = 0; c < channels; c++)
                        *out++ = (float)(sat_sum_fractional(table, c, x0, y0, x1, y1) / ((x1 - x0) * (y1 - y0)));
                }
    sat_destroy(table);
    return result;
}

/* Mean of a cell's pixels, one channel, for the tint. */
static float softassign__cell_mean(const sat_image *image, int grid_width, int grid_height, int x, int y, int channel)
{
    int x0 = (int)((int64_t)image->width * x / grid_width), x1 = (int)((int64_t)image->width * (x + 1) / grid_width);
    int y0 = (int)((int64_t)image->height * y / grid_height),
        y1 = (int)((int64_t)image->height * (y + 1) / grid_height);
    double sum = 0;
    int i, j;
    if (x1 <= x0) x1 = x0 + 1;
    if (y1 <= y0) y1 = y0 + 1;
    for (j = y0; j < y1; j++)
        for (i = x0; i < x1; i++) {
            float value = 0;
            sat__read_row(&value, image, j, i, i + 1, channel);
            sum += (double)value;
        }
    return (float)(sum / ((double)(x1 - x0) * (y1 - y0)));
}

static unsigned char softassign__to_byte(float v) { return (unsigned char)(v < 0 ? 0 : v > 255 ? 255 : v + 0.5f); }

SOFTASSIGN_DEF sat_result softassign_mosaic(unsigned char *out, ptrdiff_t stride, const sat_image *tiles,
                                            int tile_width, int tile_height, const int *column_of_row, int grid_width,
                                            int grid_height, const sat_image *target, float blend)
{
    int across, count, cell, y, k, channels, tint = target && blend > 0;
    if (!sat__image_is_valid(tiles) || tiles->format != SAT_U8 || !column_of_row || tile_width < 1 ||
        tile_height < 1 || grid_width < 1 || grid_height < 1 || grid_width > 2147483647 / grid_height ||
        !(blend >= 0 && blend <= 1))
        return SAT_ERR_ARGUMENT;
    channels = tiles->channels;
    if (target && (!sat__image_is_valid(target) || target->channels != channels)) return SAT_ERR_MISMATCH;
    across = tiles->width / tile_width;
    count = across * (tiles->height / tile_height);
    if (grid_width > 2147483647 / tile_width || grid_height > 2147483647 / tile_height ||
        !sat__rows_are_valid(out, &stride, grid_width * tile_width, grid_height * tile_height, (size_t)channels, 1))
        return SAT_ERR_ARGUMENT;
    for (cell = 0; cell < grid_width * grid_height; cell++)
        if (column_of_row[cell] < 0 || column_of_row[cell] >= count) return SAT_ERR_ARGUMENT;
    for (cell = 0; cell < grid_width * grid_height; cell++) {
        int cx = cell % grid_width, cy = cell / grid_width, tile = column_of_row[cell], n = tile_width * channels;
        float mean[4] = {0, 0, 0, 0};
        for (k = 0; tint && k < channels; k++)
            mean[k] = softassign__cell_mean(target, grid_width, grid_height, cx, cy, k);
        for (y = 0; y < tile_height; y++) {
            const unsigned char *from = (const unsigned char *)sat__image_row(tiles, tile / across * tile_height + y) +
                                        (ptrdiff_t)(tile % across) * n;
            unsigned char *to = out + ((ptrdiff_t)cy * tile_height + y) * stride + (ptrdiff_t)cx * n;
            for (k = 0; k < n; k++)
                to[k] = tint ? softassign__to_byte((float)from[k] * (1 - blend) + mean[k % channels] * blend) : from[k];
        }
    }
    return SAT_OK;
}

#endif /* SOFTASSIGN_NO_MOSAIC */

#ifdef __cplusplus
}
#endif
SAT__IEEE_END
#endif /* SOFTASSIGN_IMPLEMENTATION */

/* ------------------------------------------------------------------------------------------------
   >> OpenGL
   OpenGL (Slomp 2012, section 3.7)

   Textures are columns x rows, R32F. Sums are trees: a pass writes the sum of `gather` texels along one axis, until one
   is left; texels beyond the border count as the neutral element. No texture is read and written by one pass.
   ------------------------------------------------------------------------------------------------ */

#if defined(SOFTASSIGN_IMPLEMENTATION) && defined(SOFTASSIGN_GL) && !defined(SOFTASSIGN__GL_IMPLEMENTED)
#define SOFTASSIGN__GL_IMPLEMENTED

#ifndef SAT_SIBLING_GL
#define SAT_SIBLING_GL
#endif
#include "sat.h"

SAT__IEEE_BEGIN
#ifdef __cplusplus
extern "C" {
#endif

SOFTASSIGN_DEF const char *softassign_gl_glsl(void)
{
    return "#ifndef SOFTASSIGN_GLSL\n"
           "#define SOFTASSIGN_GLSL\n"
           SAT__GLSL(
               vec2 softassign_join(vec2 a, vec2 b, float inverse_temperature) {
                   float least = min(a.x, b.x);
                   float left = a.y > 0.0 ? a.y * exp((least - a.x) * inverse_temperature) : 0.0;
                   float right = b.y > 0.0 ? b.y * exp((least - b.x) * inverse_temperature) : 0.0;
                   return vec2(least, left + right);
               })
           "#endif\n";
}

static const char softassign__glsl_inputs[] =
    SAT__GLSL(
        uniform sampler2D source, first, second; /* second: per column, first: per row, as the pass says */
        uniform ivec2 size; /* of the source */
        uniform float alpha, inverse_t, factor, scale;
        out vec4 result;
        ivec2 here() { return ivec2(gl_FragCoord.xy); })
    SAT__GLSL(float at(sampler2D s, ivec2 p) { return texelFetch(s, p, 0).x; });

/* D from features, four to a texel: first = rows, second = columns (eq 3.1). */
static const char softassign__glsl_distance[] =
    SAT__GLSL(
        void main() {
            float sum = 0.0;
            for (int k = 0; k < size.x; k++) {
                vec4 d = texelFetch(first, ivec2(k, here().y), 0) - texelFetch(second, ivec2(k, here().x), 0);
                sum += dot(d, d);
            }
            result = vec4(sqrt(sum));
        });

/* source = M, first = D: Q, or M = exp(clamp(-Q / t)) / sqrt(t). */
static const char softassign__glsl_update[] =
    SAT__GLSL(
        void main() {
            float d = at(first, here()), q = at(source, here()) * (d * scale - alpha);
            bool allowed = d < 1e37;)
    "#if WRITES_Q\n"
    SAT__GLSL(result = vec4(allowed ? q : 0.0);)
    "#else\n"
    SAT__GLSL(result = vec4(allowed ? exp(clamp(-q * inverse_t, -70.0, 70.0)) * factor : 0.0);)
    "#endif\n"
    SAT__GLSL(});

/* The sum of K texels along an axis, or their largest finite |value|. */
static const char softassign__glsl_reduce[] =
    SAT__GLSL(
        void main() {
            float sum = 0.0;
            ivec2 p = VERTICAL == 1 ? ivec2(here().x, here().y * K) : ivec2(here().x * K, here().y);
            for (int k = 0; k < K; k++) {
                float x = p.x < size.x && p.y < size.y ? at(source, p) : 0.0;)
    "#if TAKES_MAX\n"
    SAT__GLSL(if (abs(x) < 1e37) sum = max(sum, abs(x));)
    "#else\n"
    SAT__GLSL(sum += x;)
    "#endif\n"
    SAT__GLSL(
                p += VERTICAL == 1 ? ivec2(0, 1) : ivec2(1, 0);
            }
            result = vec4(sum);
        });

/* source = M, first = sums of columns or of rows. */
static const char softassign__glsl_divide[] =
    SAT__GLSL(
        void main() {
            float sum = VERTICAL == 1 ? at(first, ivec2(here().x, 0)) + at(second, ivec2(here().x, 0))
                : at(first, ivec2(0, here().y));
            result = vec4(sum > 0.0 ? at(source, here()) / sum : 0.0);
        });

/* The outlier row of the next iteration: o / (sum + o) where it evolves. source = outliers, first = sums of columns. */
static const char softassign__glsl_outlier[] =
    SAT__GLSL(
        void main() {
            float o = at(source, ivec2(here().x, 0)), sum = at(first, ivec2(here().x, 0)) + o;
            result = vec4(sum > 0.0 ? o / sum : 0.0);
        });

/* Entropic rows: (minimum, sum of weights) of K columns; the first level reads D and the prices (second). */
static const char softassign__glsl_rows[] =
    SAT__GLSL(
        void main() {
            vec2 both = vec2(3e38, 0.0);
            for (int k = 0; k < K; k++) {
                int x = here().x * K + k;
                if (x >= size.x) break;)
    "#if FIRST_LEVEL\n"
    SAT__GLSL(
                float d = at(source, ivec2(x, here().y));
                vec2 other = d < 1e37 ? vec2(d - at(second, ivec2(x, 0)), 1.0) : vec2(3e38, 0.0);)
    "#else\n"
    SAT__GLSL(vec2 other = texelFetch(source, ivec2(x, here().y), 0).xy;)
    "#endif\n"
    SAT__GLSL(
                both = softassign_join(both, other, inverse_t);
            }
            result = vec4(both, 0.0, 0.0);
        });

/* Entropic columns, first level: weights of K rows. source = D, first = (minimum, sum) per row, second = prices. */
static const char softassign__glsl_columns[] =
    SAT__GLSL(
        void main() {
            float sum = 0.0, price = at(second, ivec2(here().x, 0));
            for (int k = 0; k < K; k++) {
                int y = here().y * K + k;
                if (y >= size.y) break;
                vec2 row = texelFetch(first, ivec2(0, y), 0).xy;
                float d = at(source, ivec2(here().x, y));
                if (d < 1e37) sum += exp((row.x - (d - price)) * inverse_t) / row.y;
            }
            result = vec4(sum);
        });

/* v <- min(0, v - t ln s). source = prices, first = column sums; factor = t. */
static const char softassign__glsl_prices[] =
    SAT__GLSL(
        void main() {
            float v = at(source, ivec2(here().x, 0)), s = at(first, ivec2(here().x, 0));
            result = vec4(min(0.0, s < 1e-36 ? v + 82.0 * factor : v - factor * log(s)));
        });

/* What a row without a seat wants of K columns without an owner: (minus the element of S, or the cost; column).
   source = S or D, first = seats, second = owners. The next level: source = such pairs. */
static const char softassign__glsl_choose[] =
    SAT__GLSL(
        void main() {
            vec2 best = vec2(3e38, -1.0);
            for (int k = 0; k < K; k++) {
                int x = here().x * K + k;
                if (x >= size.x || (FIRST_LEVEL == 1 && at(first, ivec2(0, here().y)) >= 0.0)) break;)
    "#if FIRST_LEVEL\n"
    SAT__GLSL(
                float value = at(source, ivec2(x, here().y)) * factor;
                bool open = at(second, ivec2(x, 0)) < 0.0 && (factor < 0.0 ? value < 0.0 : value < 1e37);
                vec2 other = open ? vec2(value, float(x)) : vec2(3e38, -1.0);)
    "#else\n"
    SAT__GLSL(vec2 other = texelFetch(source, ivec2(x, here().y), 0).xy;)
    "#endif\n"
    SAT__GLSL(
                if (other.x < best.x) best = other;
            }
            result = vec4(best, 0.0, 0.0);
        });

/* The first row without a seat that wants a column gets it. source = owners, first = seats, second = choices; size.y =
   rows. */
static const char softassign__glsl_grant[] =
    SAT__GLSL(
        void main() {
            float owner = at(source, ivec2(here().x, 0));
            for (int y = 0; y < size.y && owner < 0.0; y++)
                if (at(first, ivec2(0, y)) < 0.0 && int(texelFetch(second, ivec2(0, y), 0).y) == here().x)
                    owner = float(y);
            result = vec4(owner);
        });

/* source = seats, first = owners, second = choices. */
static const char softassign__glsl_seat[] =
    SAT__GLSL(
        void main() {
            float seat = at(source, ivec2(0, here().y)), column = texelFetch(second, ivec2(0, here().y), 0).y;
            if (seat < 0.0 && column >= 0.0 && int(at(first, ivec2(int(column), 0))) == here().y) seat = column;
            result = vec4(seat);
        });

/* How many rows have no seat. */
static const char softassign__glsl_count[] =
    SAT__GLSL(
        void main() {
            float left = 0.0;
            for (int y = 0; y < size.y; y++) left += at(source, ivec2(0, y)) < 0.0 ? 1.0 : 0.0;
            result = vec4(left);
        });

/* A plain copy. */
static const char softassign__glsl_copy[] = SAT__GLSL(void main() { result = vec4(at(source, here())); });

/* ---- the object */

enum {
    SOFTASSIGN__DISTANCE,
    SOFTASSIGN__UPDATE_Q,
    SOFTASSIGN__UPDATE_M,
    SOFTASSIGN__SUM_DOWN,
    SOFTASSIGN__SUM_ACROSS,
    SOFTASSIGN__MAX_DOWN,
    SOFTASSIGN__MAX_ACROSS,
    SOFTASSIGN__DIVIDE_COLUMNS,
    SOFTASSIGN__DIVIDE_ROWS,
    SOFTASSIGN__OUTLIER,
    SOFTASSIGN__ROWS_FIRST,
    SOFTASSIGN__ROWS_NEXT,
    SOFTASSIGN__COLUMNS,
    SOFTASSIGN__UPDATE_PRICES,
    SOFTASSIGN__CHOOSE_FIRST,
    SOFTASSIGN__CHOOSE_NEXT,
    SOFTASSIGN__GRANT,
    SOFTASSIGN__SEAT,
    SOFTASSIGN__COUNT,
    SOFTASSIGN__COPY,
    SOFTASSIGN__PROGRAMS
};

enum {
    SOFTASSIGN__D,
    SOFTASSIGN__M,
    SOFTASSIGN__A,
    SOFTASSIGN__S,
    SOFTASSIGN__DOWN,
    SOFTASSIGN__DOWN_2,
    SOFTASSIGN__ACROSS,
    SOFTASSIGN__ACROSS_2,
    SOFTASSIGN__OUTLIERS,
    SOFTASSIGN__OUTLIERS_2,
    SOFTASSIGN__V,
    SOFTASSIGN__V_2,
    SOFTASSIGN__SEATS, /* a column: of the rows; all from here on */
    SOFTASSIGN__SEATS_2,
    SOFTASSIGN__TEXTURES
};

typedef struct softassign__gl_uniforms {
    int size, alpha, inverse_t, factor, scale; /* locations */
} softassign__gl_uniforms;

/* Textures that a pass reads, and how many of their texels count. */
typedef struct softassign__gl_sources {
    unsigned texture[3];
    int width, height;
} softassign__gl_sources;

struct softassign_gl {
    sat__gl gl;
    softassign__gl_sources from;
    softassign_options options;
    sat_allocator allocator;
    unsigned program[SOFTASSIGN__PROGRAMS];
    softassign__gl_uniforms uniforms[SOFTASSIGN__PROGRAMS];
    unsigned texture[SOFTASSIGN__TEXTURES], framebuffer[SOFTASSIGN__TEXTURES];
    int rows, columns, has_soft; /* has_soft: of these costs, softassign_gl_published was here */
    float *scratch;  /* a row of costs or prices, or two floats a row: from softassign_gl_set_costs on */
    size_t scratch_bytes;
    float largest; /* cost */
    double rounding; /* of a cost, relative */
};

static void softassign__gl_delete_textures(softassign_gl *g)
{
    int i;
    for (i = 0; i < SOFTASSIGN__TEXTURES; i++) {
        if (g->framebuffer[i]) g->gl.DeleteFramebuffers(1, &g->framebuffer[i]);
        if (g->texture[i]) g->gl.DeleteTextures(1, &g->texture[i]);
        g->framebuffer[i] = g->texture[i] = 0;
    }
    sat__release(&g->allocator, g->scratch, g->scratch_bytes);
    g->scratch = NULL;
    g->rows = g->columns = 0;
}

#define SOFTASSIGN__LINE(name, defines, text)                                                                          \
    {"softassign: " name, 0, "source first second", defines, NULL, {softassign__glsl_inputs, text}}

/* In the order of the enumeration. */
static const sat__gl_program softassign__programs[SOFTASSIGN__PROGRAMS] = {
    SOFTASSIGN__LINE("distances", NULL, softassign__glsl_distance),
    SOFTASSIGN__LINE("Q", "#define WRITES_Q 1\n", softassign__glsl_update),
    SOFTASSIGN__LINE("M", "#define WRITES_Q 0\n", softassign__glsl_update),
    SOFTASSIGN__LINE("sum_cols", "#define VERTICAL 1\n#define TAKES_MAX 0\n", softassign__glsl_reduce),
    SOFTASSIGN__LINE("sum_rows", "#define VERTICAL 0\n#define TAKES_MAX 0\n", softassign__glsl_reduce),
    SOFTASSIGN__LINE("largest of columns", "#define VERTICAL 1\n#define TAKES_MAX 1\n", softassign__glsl_reduce),
    SOFTASSIGN__LINE("largest of rows", "#define VERTICAL 0\n#define TAKES_MAX 1\n", softassign__glsl_reduce),
    SOFTASSIGN__LINE("columns", "#define VERTICAL 1\n", softassign__glsl_divide),
    SOFTASSIGN__LINE("rows", "#define VERTICAL 0\n", softassign__glsl_divide),
    SOFTASSIGN__LINE("outliers", NULL, softassign__glsl_outlier),
    SOFTASSIGN__LINE("entropic rows, first", "#define FIRST_LEVEL 1\n", softassign__glsl_rows),
    SOFTASSIGN__LINE("entropic rows, next", "#define FIRST_LEVEL 0\n", softassign__glsl_rows),
    SOFTASSIGN__LINE("entropic columns", NULL, softassign__glsl_columns),
    SOFTASSIGN__LINE("prices", NULL, softassign__glsl_prices),
    SOFTASSIGN__LINE("choices, first", "#define FIRST_LEVEL 1\n", softassign__glsl_choose),
    SOFTASSIGN__LINE("choices, next", "#define FIRST_LEVEL 0\n", softassign__glsl_choose),
    SOFTASSIGN__LINE("grants", NULL, softassign__glsl_grant),
    SOFTASSIGN__LINE("seats", NULL, softassign__glsl_seat),
    SOFTASSIGN__LINE("rows left", NULL, softassign__glsl_count),
    SOFTASSIGN__LINE("copy", NULL, softassign__glsl_copy)};

static sat_result softassign__gl_make_programs(softassign_gl *g)
{
    const char *library[2];
    sat_result result;
    int i;
    library[0] = softassign_gl_glsl();
    library[1] = NULL;
    sat__gl_define(&g->gl, "K", g->options.gather);
    result = sat__gl_build_table(&g->gl, g->program, softassign__programs, SOFTASSIGN__PROGRAMS, 0, library);
    for (i = 0; i < SOFTASSIGN__PROGRAMS && result == SAT_OK; i++) {
        softassign__gl_uniforms *u = &g->uniforms[i];
        u->size = g->gl.GetUniformLocation(g->program[i], "size");
        u->alpha = g->gl.GetUniformLocation(g->program[i], "alpha");
        u->inverse_t = g->gl.GetUniformLocation(g->program[i], "inverse_t");
        u->factor = g->gl.GetUniformLocation(g->program[i], "factor");
        u->scale = g->gl.GetUniformLocation(g->program[i], "scale");
    }
    return result;
}

SOFTASSIGN_DEF sat_result softassign_gl_create(softassign_gl **out, sat_gl_get_proc *get_proc,
                                               const softassign_options *options)
{
    softassign_options o = options ? *options : softassign_defaults();
    sat_allocator allocator;
    sat__gl_state state;
    softassign_gl *g;
    sat_result result;
    if (!out) return SAT_ERR_ARGUMENT;
    *out = NULL;
    if (!sat__version_matches()) return SAT_ERR_VERSION;
    if (!get_proc || !softassign__options_are_valid(&o) || !sat__resolve_allocator(&allocator, &o.allocator))
        return SAT_ERR_ARGUMENT;
    g = (softassign_gl *)sat__alloc(&allocator, sizeof *g);
    if (!g) return SAT_ERR_MEMORY;
    memset(g, 0, sizeof *g);
    g->options = o;
    g->allocator = allocator;
    *out = g;
    result = sat__gl_open(&g->gl, get_proc);
    if (result != SAT_OK) return result;
    sat__gl_begin(&g->gl, &state, 3);
    result = softassign__gl_make_programs(g);
    sat__gl_end(&g->gl, &state);
    return result;
}

SOFTASSIGN_DEF void softassign_gl_destroy(softassign_gl *gl)
{
    sat_allocator allocator;
    if (!gl) return;
    if (gl->program[0]) sat__gl_delete_programs(&gl->gl, gl->program, SOFTASSIGN__PROGRAMS);
    if (gl->texture[0] || gl->framebuffer[0] || gl->scratch) softassign__gl_delete_textures(gl);
    sat__gl_close(&gl->gl);
    allocator = gl->allocator;
    sat__release(&allocator, gl, sizeof *gl);
}

SOFTASSIGN_DEF sat_result softassign_gl_set_options(softassign_gl *gl, const softassign_options *options)
{
    softassign_options o = options ? *options : softassign_defaults();
    if (!gl || !gl->program[SOFTASSIGN__PROGRAMS - 1] || !softassign__options_are_valid(&o))
        return SAT_ERR_ARGUMENT;
    if (o.gather != gl->options.gather) return SAT_ERR_MISMATCH;
    gl->options = o;
    return SAT_OK;
}

SOFTASSIGN_DEF const char *softassign_gl_message(const softassign_gl *gl) { return gl ? gl->gl.message : ""; }

/* ---- costs */

static sat_result softassign__gl_make_textures(softassign_gl *g, int rows, int columns)
{
    int i, k = g->options.gather;
    softassign__gl_delete_textures(g);
    g->scratch_bytes = (size_t)sat__max_int(columns, 2 * rows) * sizeof(float);
    g->scratch = (float *)sat__alloc(&g->allocator, g->scratch_bytes);
    if (!g->scratch) return SAT_ERR_MEMORY;
    for (i = 0; i < SOFTASSIGN__TEXTURES; i++) {
        int width = columns, height = rows;
        unsigned internal = SAT__GL_R32F;
        sat_result result;
        if (i == SOFTASSIGN__DOWN || i == SOFTASSIGN__DOWN_2) height = (rows + k - 1) / k;
        if (i == SOFTASSIGN__ACROSS || i == SOFTASSIGN__ACROSS_2) {
            width = (columns + k - 1) / k;
            internal = SAT__GL_RG32F;
        }
        if (i >= SOFTASSIGN__OUTLIERS) height = 1;
        if (i >= SOFTASSIGN__SEATS) {
            width = 1;
            height = rows;
        }
        result = sat__gl_texture(&g->gl, &g->texture[i], internal, width, height, NULL);
        if (result == SAT_OK) result = sat__gl_framebuffer(&g->gl, &g->framebuffer[i], &g->texture[i], 1, 0);
        if (result != SAT_OK) {
            softassign__gl_delete_textures(g);
            return result;
        }
    }
    g->rows = rows;
    g->columns = columns;
    return SAT_OK;
}

/* ------------------------------------------------------------------------------------------------
   >> passes of OpenGL
   One draw each; sums, texels, costs, then the two methods
   ------------------------------------------------------------------------------------------------ */

/* One pass into texture `to`; 0 stands for no texture. Textures may be read as bound names. */
static void softassign__gl_run(softassign_gl *g, int program, int to, int width, int height)
{
    sat__gl *gl = &g->gl;
    const softassign__gl_sources *from = &g->from;
    int i;
    sat__gl_pass(gl, g->program[program], g->framebuffer[to], width, height);
    for (i = 0; i < 3; i++) {
        gl->ActiveTexture(SAT__GL_TEXTURE0 + (unsigned)i);
        gl->BindTexture(SAT__GL_TEXTURE_2D, from->texture[i]);
        gl->BindSampler((unsigned)i, 0);
    }
    gl->Uniform2i(g->uniforms[program].size, from->width, from->height);
    sat__gl_draw(gl);
}

/* What the next passes read: three textures (0: none), of which width x height texels count. */
static void softassign__gl_read_from(softassign_gl *g, unsigned source, unsigned first, unsigned second, int width,
                                     int height)
{
    g->from.texture[0] = source;
    g->from.texture[1] = first;
    g->from.texture[2] = second;
    g->from.width = width;
    g->from.height = height;
}

static void softassign__gl_values(softassign_gl *g, int program, float alpha, float inverse_t, float factor,
                                  float scale)
{
    const softassign__gl_uniforms *p = &g->uniforms[program];
    g->gl.UseProgram(g->program[program]);
    g->gl.Uniform1f(p->alpha, alpha);
    g->gl.Uniform1f(p->inverse_t, inverse_t);
    g->gl.Uniform1f(p->factor, factor);
    g->gl.Uniform1f(p->scale, scale);
}

/* ---- sums */

/* Sums (or takes the largest of) a texture of width x height down to one row or column; returns the texture that holds
   it. */
static int softassign__gl_reduce(softassign_gl *g, int program, int from, int width, int height)
{
    int k = g->options.gather, vertical = program == SOFTASSIGN__SUM_DOWN || program == SOFTASSIGN__MAX_DOWN;
    int a = vertical ? SOFTASSIGN__DOWN : SOFTASSIGN__ACROSS;
    while ((vertical ? height : width) > 1) {
        int to = from == a ? a + 1 : a, w = vertical ? width : (width + k - 1) / k,
            h = vertical ? (height + k - 1) / k : height;
        softassign__gl_read_from(g, g->texture[from], 0, 0, width, height);
        softassign__gl_run(g, program, to, w, h);
        from = to;
        width = w;
        height = h;
    }
    return from;
}

/* One texel of a texture. */
static sat_result softassign__gl_texel(softassign_gl *g, int from, float *value)
{
    unsigned internal = from == SOFTASSIGN__ACROSS || from == SOFTASSIGN__ACROSS_2 ? SAT__GL_RG32F : SAT__GL_R32F;
    float texel[2] = {0, 0};
    sat_result result = sat__gl_read(&g->gl, texel, g->texture[from], internal, 1, 1);
    *value = texel[0];
    return result;
}

/* ---- distances from features */

/* Packs features four to a texel, zeros behind. */
static sat_result softassign__gl_feature_texture(softassign_gl *g, unsigned *texture, const float *features, int count,
                                                 int n)
{
    int texels = (n + 3) / 4, i;
    size_t size, width = (size_t)texels * 4 * sizeof(float);
    float *packed;
    sat_result result;
    *texture = 0;
    if (!sat__multiply_size(&size, width, (size_t)count)) return SAT_ERR_SIZE;
    packed = (float *)sat__alloc(&g->allocator, size);
    if (!packed) return SAT_ERR_MEMORY;
    memset(packed, 0, size);
    for (i = 0; i < count; i++)
        memcpy(packed + (size_t)i * (size_t)texels * 4, features + (size_t)i * (size_t)n, (size_t)n * sizeof(float));
    result = sat__gl_texture(&g->gl, texture, SAT__GL_RGBA32F, texels, count, packed);
    sat__release(&g->allocator, packed, size);
    return result;
}

static sat_result softassign__gl_distances(softassign_gl *g, const softassign_problem *p)
{
    unsigned rows = 0, columns = 0;
    sat_result result = softassign__gl_feature_texture(g, &rows, p->row_features, p->rows, p->feature_count);
    if (result == SAT_OK)
        result = softassign__gl_feature_texture(g, &columns, p->column_features, p->columns, p->feature_count);
    if (result == SAT_OK) {
        softassign__gl_read_from(g, 0, rows, columns, (p->feature_count + 3) / 4, 1);
        softassign__gl_run(g, SOFTASSIGN__DISTANCE, SOFTASSIGN__D, g->columns, g->rows);
    }
    if (rows) g->gl.DeleteTextures(1, &rows);
    if (columns) g->gl.DeleteTextures(1, &columns);
    return result;
}

static sat_result softassign__gl_upload_costs(softassign_gl *g, const softassign_problem *p, float *row)
{
    int i, j;
    for (i = 0; i < p->rows; i++) {
        for (j = 0; j < p->columns; j++) row[j] = (float)softassign__pair(p, i, j);
        g->gl.ActiveTexture(SAT__GL_TEXTURE0);
        g->gl.BindTexture(SAT__GL_TEXTURE_2D, g->texture[SOFTASSIGN__D]);
        g->gl.TexSubImage2D(SAT__GL_TEXTURE_2D, 0, 0, i, p->columns, 1, SAT__GL_RED, SAT__GL_FLOAT, row);
    }
    return SAT_OK;
}

/* Features, or the costs themselves: finite where they must be. */
static sat_result softassign__gl_check_costs(const softassign_problem *p)
{
    size_t k, n = (size_t)p->feature_count;
    sat_result result = SAT_OK;
    int i, j;
    if (!softassign__is_features(p)) {
        for (i = 0; i < p->rows && result == SAT_OK; i++)
            for (j = 0; j < p->columns && result == SAT_OK; j++)
                result = softassign__check_cost(softassign__pair(p, i, j));
        return result;
    }
    for (k = 0; k < n * (size_t)p->rows && result == SAT_OK; k++)
        result = softassign__check_feature(p->row_features[k]);
    for (k = 0; k < n * (size_t)p->columns && result == SAT_OK; k++)
        result = softassign__check_feature(p->column_features[k]);
    return result;
}

/* The scale of D. */
static sat_result softassign__gl_find_largest(softassign_gl *g)
{
    int at = softassign__gl_reduce(g, SOFTASSIGN__MAX_DOWN, SOFTASSIGN__D, g->columns, g->rows);
    sat_result result;
    at = softassign__gl_reduce(g, SOFTASSIGN__MAX_ACROSS, at, g->columns, 1);
    result = softassign__gl_texel(g, at, &g->largest);
    g->largest = fabsf(g->largest) > 1e-30f ? fabsf(g->largest) : 1;
    return result;
}

/* What no pass looks at is refused, not ignored. */
static int softassign__gl_explain(softassign_gl *g, const softassign_problem *p)
{
    sat__text t = sat__text_begin(g->gl.message, sizeof g->gl.message);
    const char *name = NULL;
    if (!softassign__explain_costs(&t, p)) return 0;
    if (p->capacity) name = "capacity";
    else if (p->minimum_use) name = "minimum_use";
    else if (p->previous) name = "previous";
    else if (p->maximise) name = "maximise";
    else if (p->unassigned_cost > 0) name = "unassigned_cost";
    else if (p->row_start) name = "row_start";
    else if (!p->cost && p->cost_double) name = "cost_double";
    else if (!p->cost && p->cost_int) name = "cost_int";
    if (!name) return 1;
    sat__text_add(&t, name);
    sat__text_add(&t, " is given; the passes do not know it");
    return 0;
}

SOFTASSIGN_DEF sat_result softassign_gl_set_costs(softassign_gl *gl, const softassign_problem *problem)
{
    sat__gl_state state;
    sat_result result = SAT_OK;
    if (!gl) return SAT_ERR_ARGUMENT;
    if (!softassign__gl_explain(gl, problem)) return SAT_ERR_ARGUMENT;
    result = softassign__gl_check_costs(problem);
    if (result != SAT_OK) return result;
    gl->has_soft = 0;
    sat__gl_begin(&gl->gl, &state, 3);
    if (gl->rows != problem->rows || gl->columns != problem->columns)
        result = softassign__gl_make_textures(gl, problem->rows, problem->columns);
    if (result == SAT_OK && softassign__is_features(problem)) result = softassign__gl_distances(gl, problem);
    else if (result == SAT_OK) result = softassign__gl_upload_costs(gl, problem, gl->scratch);
    gl->rounding = !softassign__is_features(problem) ? 1e-6 : 1e-6 + 6e-8 * problem->feature_count;
    if (result == SAT_OK) result = softassign__gl_find_largest(gl);
    if (result == SAT_OK) result = sat__gl_check(&gl->gl, "OpenGL refused the costs");
    sat__gl_end(&gl->gl, &state);
    return result;
}

/* ---- the published method */

/* M starts as on the CPU. */
static void softassign__gl_start_matrix(softassign_gl *g)
{
    float *row = g->scratch;
    uint64_t seed = g->options.seed;
    int i, j;
    for (i = 0; i < g->rows; i++) {
        for (j = 0; j < g->columns; j++) row[j] = (float)(1e-6 + 1e-3 * softassign__uniform(&seed));
        g->gl.ActiveTexture(SAT__GL_TEXTURE0);
        g->gl.BindTexture(SAT__GL_TEXTURE_2D, g->texture[SOFTASSIGN__M]);
        g->gl.TexSubImage2D(SAT__GL_TEXTURE_2D, 0, 0, i, g->columns, 1, SAT__GL_RED, SAT__GL_FLOAT, row);
    }
    for (j = 0; j < g->columns; j++) row[j] = (float)g->options.outlier;
    sat__gl_upload(&g->gl, g->texture[SOFTASSIGN__OUTLIERS], SAT__GL_R32F, g->columns, 1, row);
}

/* One Sinkhorn iteration, A to A by way of M. */
static void softassign__gl_sinkhorn(softassign_gl *g, int *outlier)
{
    int w = g->columns, h = g->rows, sums = softassign__gl_reduce(g, SOFTASSIGN__SUM_DOWN, SOFTASSIGN__A, w, h);
    softassign__gl_read_from(g, g->texture[SOFTASSIGN__A], g->texture[sums], g->texture[*outlier], w, h);
    softassign__gl_run(g, SOFTASSIGN__DIVIDE_COLUMNS, SOFTASSIGN__M, w, h);
    if (g->options.outlier_evolves) {
        int to = *outlier == SOFTASSIGN__V ? SOFTASSIGN__OUTLIERS_2 : SOFTASSIGN__V;
        softassign__gl_read_from(g, g->texture[*outlier], g->texture[sums], 0, w, 1);
        softassign__gl_run(g, SOFTASSIGN__OUTLIER, to, w, 1);
        *outlier = to;
    }
    sums = softassign__gl_reduce(g, SOFTASSIGN__SUM_ACROSS, SOFTASSIGN__M, w, h);
    softassign__gl_read_from(g, g->texture[SOFTASSIGN__M], g->texture[sums], 0, w, h);
    softassign__gl_run(g, SOFTASSIGN__DIVIDE_ROWS, SOFTASSIGN__A, w, h);
}

/* One temperature; afterwards M holds the matrix and *cost the sum of the last Q. */
static sat_result softassign__gl_cool(softassign_gl *g, double t, float *cost)
{
    const softassign_options *o = &g->options;
    int w = g->columns, h = g->rows, steady, turn, q;
    float alpha = (float)o->alpha, inverse = (float)(1 / t), scale = 1 / g->largest,
          factor = (float)softassign__published_factor(t, sat__max_int(w, h), 0);
    sat_result result = SAT_OK;
    *cost = 0;
    softassign__gl_values(g, SOFTASSIGN__UPDATE_M, alpha, inverse, factor, scale);
    softassign__gl_values(g, SOFTASSIGN__UPDATE_Q, alpha, inverse, factor, scale);
    for (steady = 0; steady < o->iterations[1]; steady++) {
        int outlier = SOFTASSIGN__OUTLIERS;
        if (steady == o->iterations[1] - 1) {
            softassign__gl_read_from(g, g->texture[SOFTASSIGN__M], g->texture[SOFTASSIGN__D], 0, w, h);
            softassign__gl_run(g, SOFTASSIGN__UPDATE_Q, SOFTASSIGN__A, w, h);
            q = softassign__gl_reduce(g, SOFTASSIGN__SUM_DOWN, SOFTASSIGN__A, w, h);
            q = softassign__gl_reduce(g, SOFTASSIGN__SUM_ACROSS, q, w, 1);
            result = softassign__gl_texel(g, q, cost);
            if (result != SAT_OK) return result;
        }
        softassign__gl_read_from(g, g->texture[SOFTASSIGN__M], g->texture[SOFTASSIGN__D], 0, w, h);
        softassign__gl_run(g, SOFTASSIGN__UPDATE_M, SOFTASSIGN__A, w, h);
        for (turn = 0; turn < o->iterations[2]; turn++) softassign__gl_sinkhorn(g, &outlier);
        softassign__gl_read_from(g, g->texture[SOFTASSIGN__A], 0, 0, w, h);
        softassign__gl_run(g, SOFTASSIGN__COPY, SOFTASSIGN__M, w, h);
    }
    return result;
}

SOFTASSIGN_DEF sat_result softassign_gl_published(softassign_gl *gl, float *soft, ptrdiff_t soft_stride,
                                                  double *soft_cost)
{
    softassign_gl *g = gl;
    sat__gl_state state;
    sat_result result = SAT_OK;
    double t, lowest = (double)SOFTASSIGN__INFINITY;
    int i;
    if (!g || !g->rows || (soft && !sat__rows_are_valid(soft, &soft_stride, g->columns, g->rows, 1, 1)))
        return SAT_ERR_ARGUMENT; /* a stride in floats: as if they were bytes */
    sat__gl_begin(&g->gl, &state, 3);
    softassign__gl_start_matrix(g);
    softassign__gl_read_from(g, g->texture[SOFTASSIGN__M], 0, 0, g->columns, g->rows);
    softassign__gl_run(g, SOFTASSIGN__COPY, SOFTASSIGN__S, g->columns, g->rows);
    for (t = g->options.temperature, i = 0; result == SAT_OK && i < g->options.iterations[0];
         i++, t *= g->options.cooling) {
        float cost;
        if (!(t > 1e-30)) t = 1e-30;
        result = softassign__gl_cool(g, t, &cost);
        if (result != SAT_OK || !((double)cost < lowest)) continue;
        lowest = (double)cost;
        softassign__gl_read_from(g, g->texture[SOFTASSIGN__M], 0, 0, g->columns, g->rows);
        softassign__gl_run(g, SOFTASSIGN__COPY, SOFTASSIGN__S, g->columns, g->rows);
    }
    if (result == SAT_OK && soft) {
        result = sat__gl_attach(&g->gl, g->gl.framebuffer, &g->texture[SOFTASSIGN__S], 1, 0);
        for (i = 0; result == SAT_OK && i < g->rows; i++)
            g->gl.ReadPixels(0, i, g->columns, 1, SAT__GL_RED, SAT__GL_FLOAT, soft + (ptrdiff_t)i * soft_stride);
    }
    if (result == SAT_OK) result = sat__gl_check(&g->gl, "OpenGL refused a pass");
    sat__gl_end(&g->gl, &state);
    g->has_soft = result == SAT_OK;
    if (soft_cost) *soft_cost = lowest;
    return result;
}

/* ---- who gets what */

/* One turn: rows without a seat choose by S or by D, columns grant, rows sit down. Owners and seats change textures. */
static void softassign__gl_turn(softassign_gl *g, int by, int *owners, int *seats)
{
    int k = g->options.gather, w = g->columns, h = g->rows, width = w, from = by, to = SOFTASSIGN__ACROSS;
    int next_owners = *owners == SOFTASSIGN__V ? SOFTASSIGN__V_2 : SOFTASSIGN__V,
        next_seats = *seats == SOFTASSIGN__SEATS ? SOFTASSIGN__SEATS_2 : SOFTASSIGN__SEATS;
    softassign__gl_values(g, SOFTASSIGN__CHOOSE_FIRST, 0, 0, by == SOFTASSIGN__S ? -1.0f : 1.0f, 0);
    do {
        int program = from == by ? SOFTASSIGN__CHOOSE_FIRST : SOFTASSIGN__CHOOSE_NEXT;
        softassign__gl_read_from(g, g->texture[from], g->texture[*seats], g->texture[*owners], width, h);
        softassign__gl_run(g, program, to, (width + k - 1) / k, h);
        from = to;
        to = to == SOFTASSIGN__ACROSS ? SOFTASSIGN__ACROSS_2 : SOFTASSIGN__ACROSS;
        width = (width + k - 1) / k;
    } while (width > 1);
    softassign__gl_read_from(g, g->texture[*owners], g->texture[*seats], g->texture[from], w, h);
    softassign__gl_run(g, SOFTASSIGN__GRANT, next_owners, w, 1);
    softassign__gl_read_from(g, g->texture[*seats], g->texture[next_owners], g->texture[from], 1, h);
    softassign__gl_run(g, SOFTASSIGN__SEAT, next_seats, 1, h);
    *owners = next_owners;
    *seats = next_seats;
}

/* Turns until every row sits; as long as there are free columns that it may get, the first row without a seat gets one
   in each. */
static sat_result softassign__gl_seat_all(softassign_gl *g, int *seats)
{
    int owners = SOFTASSIGN__V, turn;
    float left = (float)g->rows, before = left + 1;
    sat_result result = SAT_OK;
    softassign__gl_turn(g, SOFTASSIGN__S, &owners, seats);
    while (result == SAT_OK && left > 0 && left < before) {
        before = left;
        for (turn = 0; turn < 8; turn++) softassign__gl_turn(g, SOFTASSIGN__D, &owners, seats);
        softassign__gl_read_from(g, g->texture[*seats], 0, 0, 1, g->rows);
        softassign__gl_run(g, SOFTASSIGN__COUNT, SOFTASSIGN__OUTLIERS_2, 1, 1);
        result = softassign__gl_texel(g, SOFTASSIGN__OUTLIERS_2, &left);
    }
    return result == SAT_OK && left > 0 ? SAT_ERR_LIMIT : result;
}

SOFTASSIGN_DEF sat_result softassign_gl_assign(softassign_gl *gl, int *column_of_row)
{
    softassign_gl *g = gl;
    sat__gl_state state;
    sat_result result, read = SAT_OK;
    int i, seats = SOFTASSIGN__SEATS;
    if (!g || !g->has_soft) return SAT_ERR_ARGUMENT;
    sat__gl_begin(&g->gl, &state, 3);
    for (i = 0; i < g->columns || i < g->rows; i++) g->scratch[i] = -1;
    sat__gl_upload(&g->gl, g->texture[SOFTASSIGN__V], SAT__GL_R32F, g->columns, 1, g->scratch);
    sat__gl_upload(&g->gl, g->texture[SOFTASSIGN__SEATS], SAT__GL_R32F, 1, g->rows, g->scratch);
    result = softassign__gl_seat_all(g, &seats);
    if (seats != SOFTASSIGN__SEATS) { /* the texture whose name is told */
        softassign__gl_read_from(g, g->texture[seats], 0, 0, 1, g->rows);
        softassign__gl_run(g, SOFTASSIGN__COPY, SOFTASSIGN__SEATS, 1, g->rows);
    }
    if (column_of_row) read = sat__gl_read(&g->gl, g->scratch, g->texture[SOFTASSIGN__SEATS], SAT__GL_R32F, 1, g->rows);
    for (i = 0; column_of_row && read == SAT_OK && i < g->rows; i++) column_of_row[i] = (int)g->scratch[i];
    if (result == SAT_OK) result = read;
    if (result == SAT_OK) result = sat__gl_check(&g->gl, "OpenGL refused a pass");
    sat__gl_end(&g->gl, &state);
    return result;
}

SOFTASSIGN_DEF unsigned softassign_gl_columns(const softassign_gl *gl)
{
    return gl ? gl->texture[SOFTASSIGN__SEATS] : 0;
}

/* ---- entropic sweeps */

/* (minimum, sum of weights) of every row; the first pass reads D and the prices, so a row is read once. */
static int softassign__gl_rows(softassign_gl *g, int price)
{
    int k = g->options.gather, width = g->columns, to = SOFTASSIGN__ACROSS, from = SOFTASSIGN__D;
    do {
        int w = (width + k - 1) / k, program = from == SOFTASSIGN__D ? SOFTASSIGN__ROWS_FIRST : SOFTASSIGN__ROWS_NEXT;
        softassign__gl_read_from(g, g->texture[from], 0, g->texture[price], width, g->rows);
        softassign__gl_run(g, program, to, w, g->rows);
        from = to;
        to = to == SOFTASSIGN__ACROSS ? SOFTASSIGN__ACROSS_2 : SOFTASSIGN__ACROSS;
        width = w;
    } while (width > 1);
    return from;
}

/* The bound at the prices of the sweep, lowered by what float sums may have lost. */
static sat_result softassign__gl_bound(softassign_gl *g, int rows, const float *price, double *bound)
{
    float *least = g->scratch;
    softassign__sum sum = {0, 0, 0};
    double dearest = 0, lost = 0;
    sat_result result;
    int i;
    result = sat__gl_read(&g->gl, least, g->texture[rows], SAT__GL_RG32F, 1, g->rows);
    for (i = 0; i < g->columns; i++) {
        softassign__add(&sum, (double)price[i]);
        if (fabs((double)price[i]) > dearest) dearest = fabs((double)price[i]);
    }
    for (i = 0; i < g->rows; i++) { /* |cost| is at most |least| + the price */
        softassign__add(&sum, (double)least[2 * i]);
        lost += fabs((double)least[2 * i]) + 2 * dearest;
    }
    *bound = softassign__total_below(&sum) - lost * g->rounding;
    return result;
}

SOFTASSIGN_DEF sat_result softassign_gl_sweep(softassign_gl *gl, float *price, double *lower_bound, double temperature,
                                              int sweeps)
{
    softassign_gl *g = gl;
    sat__gl_state state;
    sat_result result = SAT_OK;
    int i,
        v = SOFTASSIGN__V,
        programs[4] = {SOFTASSIGN__ROWS_FIRST, SOFTASSIGN__ROWS_NEXT, SOFTASSIGN__COLUMNS, SOFTASSIGN__UPDATE_PRICES};
    if (!g || !g->rows || !price || sweeps < 1 || !(temperature > 1e-30 && temperature < 1e30)) return SAT_ERR_ARGUMENT;
    for (i = 0; i < g->columns; i++)
        if (!(price[i] <= 0 && price[i] > -1e36f)) return SAT_ERR_ARGUMENT;
    sat__gl_begin(&g->gl, &state, 3);
    sat__gl_upload(&g->gl, g->texture[v], SAT__GL_R32F, g->columns, 1, price);
    for (i = 0; i < 4; i++) softassign__gl_values(g, programs[i], 0, (float)(1 / temperature), (float)temperature, 0);
    for (i = 0; i < sweeps && result == SAT_OK; i++) {
        int k = g->options.gather, height = (g->rows + k - 1) / k,
            next = v == SOFTASSIGN__V ? SOFTASSIGN__V_2 : SOFTASSIGN__V;
        int rows = softassign__gl_rows(g, v), sums;
        if (i == sweeps - 1 && lower_bound) {
            result = sat__gl_read(&g->gl, price, g->texture[v], SAT__GL_R32F, g->columns, 1);
            if (result == SAT_OK) result = softassign__gl_bound(g, rows, price, lower_bound);
        }
        softassign__gl_read_from(g, g->texture[SOFTASSIGN__D], g->texture[rows], g->texture[v], g->columns, g->rows);
        softassign__gl_run(g, SOFTASSIGN__COLUMNS, SOFTASSIGN__DOWN, g->columns, height);
        sums = softassign__gl_reduce(g, SOFTASSIGN__SUM_DOWN, SOFTASSIGN__DOWN, g->columns, height);
        softassign__gl_read_from(g, g->texture[v], g->texture[sums], 0, g->columns, 1);
        softassign__gl_run(g, SOFTASSIGN__UPDATE_PRICES, next, g->columns, 1);
        v = next;
    }
    if (result == SAT_OK) result = sat__gl_read(&g->gl, price, g->texture[v], SAT__GL_R32F, g->columns, 1);
    if (result == SAT_OK) result = sat__gl_check(&g->gl, "OpenGL refused a pass");
    sat__gl_end(&g->gl, &state);
    return result;
}

#ifdef __cplusplus
}
#endif
SAT__IEEE_END
#endif /* SOFTASSIGN_GL */

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
