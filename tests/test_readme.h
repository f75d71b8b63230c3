/* The programs of README.md and docs/: `make docs` puts the text between the marks there, check_strict compares. */

#include "expect.h"

/* README: impl */
/* lightscan.c: one C (or C++) file of yours holds the code of all headers that you use */
#define LIGHTSCAN_IMPLEMENTATION
#include "sat.h"
#include "tonemap.h"
/* README end */
#include "fiv.h"
#include "raindrop.h"
#include "softassign.h"
#include "ssao_sat.h"
#include "support.h"

enum { SIDE = 64, READINGS = SIDE * SIDE };
static float pixels[3 * READINGS];

static void fill(double low, double high) { support_fill(pixels, 3 * READINGS, low, high, 7); }

TEST(readme_sat)
{
    int width = SIDE, height = SIDE, x = 30, y = 40;
    double mean = 0;
    fill(0, 1e4);
    {
        /* README: sat */
        sat_table *table;
        sat_image image = sat_image_f32(pixels, width, height, 3);
        sat_create(&table, width, height, 3, NULL);                     /* the only allocation */
        sat_build(table, &image);                                       /* every frame */
        mean = sat_mean(table, 1, x - 20, y - 20, x + 21, y + 21);      /* green, 41 x 41 pixels, constant time */
        sat_destroy(table);
        /* README end */
    }
    EXPECT(mean > 4000 && mean < 6000);
}

TEST(readme_tonemap)
{
    static unsigned char screen[3 * READINGS];
    int width = SIDE, height = SIDE;
    sat_result result;
    fill(0, 1e4);
    {
        /* README: tonemap */
        tonemap *map;
        tonemap_options options = tonemap_defaults();                   /* photographic curve, guided filter */
        sat_image hdr = sat_image_f32(pixels, width, height, 3);
        options.mesopic = TONEMAP_MESOPIC_LOCAL;                        /* reds fade in the dark */
        options.cd_per_unit = 1;
        tonemap_create(&map, width, height, &options);
        result = tonemap_apply_u8(map, screen, 0, &hdr, 0, NULL);       /* every frame: linear light in, sRGB out */
        tonemap_destroy(map);
        /* README end */
    }
    EXPECT_EQ(result, SAT_OK);
    EXPECT(screen[0] > 0);
}

TEST(readme_ssao_sat)
{
    static float open[READINGS];
    int width = SIDE, height = SIDE;
    const float *depth = pixels;
    ssao_sat_stats stats;
    fill(2, 2.2);
    {
        /* README: ssao_sat */
        ssao_sat *ao;
        ssao_sat_options options = ssao_sat_defaults();
        ssao_sat_input input = ssao_sat_input_linear(depth, width, height, 1.0); /* 57 degrees high */
        options.radius = 0.5;                                           /* in units of depth */
        ssao_sat_create(&ao, width, height, &options);
        ssao_sat_apply(ao, open, 0, &input, &stats);                    /* every frame: 0 blocked, 1 open */
        ssao_sat_destroy(ao);
        /* README end */
    }
    EXPECT_EQ(stats.pixels, READINGS / 4);
    EXPECT(open[100] >= 0 && open[100] <= 1);
}

TEST(readme_fiv)
{
    static const float positions[] = {1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1};
    static const unsigned indices[] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
    static const float points[] = {0, -1, 0}, normals[] = {0, 1, 0};
    float rgb[3], all[3];
    sat_image sky = sat_image_f32(pixels, SIDE, SIDE, 3);
    fill(0.9, 1.1);
    {
        /* README: fiv */
        fiv_environment *light;
        fiv_occluder *occluder;
        fiv_instance instance = {NULL, {0, 0, 0}, 1};
        fiv_environment_create(&light, &sky, NULL, NULL);               /* an equirectangular picture */
        fiv_occluder_create(&occluder, positions, 6, indices, 8, NULL, NULL); /* slow, once for a shape */
        fiv_occluder_light(occluder, light, NULL);                      /* when the light changes */
        instance.occluder = occluder;
        fiv_irradiance(rgb, points, normals, 1, light, &instance, 1, NULL, NULL);
        /* README end */
        fiv_environment_irradiance(all, light, normals);
        fiv_occluder_destroy(occluder);
        fiv_environment_destroy(light);
    }
    EXPECT(rgb[1] >= 0 && rgb[1] < 0.9f * all[1]);
}

TEST(readme_raindrop)
{
    static float picture[3 * READINGS];
    raindrop_render_stats stats;
    sat_image sky = sat_image_f32(pixels, SIDE, SIDE, 3);
    const float *depth = NULL;
    int width = SIDE, height = SIDE;
    fill(0.5, 2);
    {
        /* README: raindrop */
        raindrop_environment *environment;
        raindrop_rain *rain;
        raindrop_camera camera = raindrop_camera_defaults();
        raindrop_environment_create(&environment, &sky, NULL, NULL);
        raindrop_rain_create(&rain, NULL);                              /* 10 mm/h in a box of 8 m */
        raindrop_rain_advance(rain, 1 / 60.0);                          /* every frame, then: */
        raindrop_render(picture, (ptrdiff_t)sizeof(float) * 3 * width, width, height, depth, &camera, rain, environment,
                        NULL, &stats);
        /* README end */
        raindrop_rain_destroy(rain);
        raindrop_environment_destroy(environment);
    }
    EXPECT(stats.drawn_near + stats.drawn_far > 0);
}

TEST(readme_softassign)
{
    enum { ROWS = 100, COLUMNS = 150, FEATURES = 12 };
    static float patches[ROWS * FEATURES], tiles[COLUMNS * FEATURES];
    int tile_of_patch[ROWS], used[COLUMNS], i;
    softassign_stats report;
    fill(0, 1);
    memcpy(patches, pixels, sizeof patches);
    memcpy(tiles, pixels + ROWS * FEATURES, sizeof tiles);
    memset(used, 0, sizeof used);
    {
        /* README: softassign */
        softassign_problem problem;
        memset(&problem, 0, sizeof problem);
        problem.rows = ROWS, problem.columns = COLUMNS;                 /* patches and tiles */
        problem.row_features = patches, problem.column_features = tiles;
        problem.feature_count = FEATURES;
        softassign_solve(tile_of_patch, &problem, NULL, &report);       /* no tile twice, proven cheapest */
        printf("cost %g, at most %g %% above the optimum\n", report.cost, 100 * report.gap);
        /* README end */
    }
    for (i = 0; i < ROWS; ++i) ++used[tile_of_patch[i]];
    for (i = 0; i < COLUMNS; ++i) EXPECT(used[i] <= 1);
    EXPECT(report.gap < 1e-6);
}

/* ---- docs/engine.md and docs/faq.md ---- */

/* README: engine_threads */
/* a job system of yours: `count` pieces, each called with the number of the worker that runs it */
static void run_on_jobs(int count, sat_range_fn *body, void *context, void *user)
{
    int i;
    (void)user;
    for (i = 0; i < count; i++) body(i, i + 1, 0, context); /* here: one after the other, by worker 0 */
}
/* README end */

/* README: engine_memory */
/* an arena of yours: one piece at create, given back at destroy, nothing in a frame */
static void *take(size_t size, void *user)
{
    size_t *taken = (size_t *)user;
    *taken += size;
    return malloc(size);
}

static void give(void *memory, size_t size, void *user)
{
    size_t *taken = (size_t *)user;
    *taken -= size;
    free(memory);
}
/* README end */

TEST(engine_objects)
{
    int width = SIDE, height = SIDE;
    size_t taken = 0, most = 0;
    ssao_sat *ao = NULL;
    sat_result result;
    {
        /* README: engine_create */
        ssao_sat_options options = ssao_sat_defaults();
        options.radius = 0.5;
        options.threads.parallel_for = run_on_jobs;
        options.threads.workers = 4; /* scratch memory for so many; the same bits for any number */
        options.allocator.alloc = take;
        options.allocator.release = give;
        options.allocator.user = &taken;
        result = ssao_sat_create(&ao, width, height, &options);
        if (result != SAT_OK) {
            char why[120];
            puts(ssao_sat_explain(why, sizeof why, width, height, &options));
        }
        /* README end */
        most = taken;
    }
    EXPECT_EQ(result, SAT_OK);
    ssao_sat_destroy(ao);
    EXPECT(most > 0 && taken == 0);
}

TEST(engine_depth)
{
    static float depth[READINGS], normals[3 * READINGS], open[READINGS];
    static const float projection[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, -1, 0, 0, 0.1f, 0}; /* infinite, reversed */
    int width = SIDE, height = SIDE, i;
    ssao_sat *ao = NULL;
    ssao_sat_stats stats;
    for (i = 0; i < READINGS; i++) depth[i] = 0.1f / (i % SIDE < SIDE / 2 ? 2.0f : 2.2f); /* near / distance */
    for (i = 0; i < READINGS; i++) normals[3 * i + 2] = 1;
    EXPECT_EQ(ssao_sat_create(&ao, width, height, NULL), SAT_OK);
    {
        /* README: engine_depth */
        ssao_sat_input input;
        memset(&input, 0, sizeof input);
        input.depth = depth;
        input.normals = normals;
        input.width = width;
        input.height = height;
        input.depth_kind = SSAO_SAT_DEPTH_REVERSED; /* 1 at the near plane, cleared to 0 */
        input.clip_zero_to_one = 1;                 /* the matrix is Vulkan's, Direct3D's or glClipControl's */
        memcpy(input.projection, projection, sizeof input.projection); /* what drew it, jitter and all */
        ssao_sat_apply(ao, open, 0, &input, &stats);
        if (10 * stats.normals_off > stats.normals_compared) puts("are these normals in view space?");
        /* README end */
    }
    EXPECT_NEAR(stats.nearest, 2, 1e-5);
    EXPECT_NEAR(stats.farthest, 2.2, 1e-5);
    EXPECT(open[SIDE / 2 - 1 + SIDE * 20] > 0.9f && open[SIDE / 2 + SIDE * 20] < 0.95f);
    ssao_sat_destroy(ao);
}

TEST(engine_options)
{
    static unsigned char screen[3 * READINGS];
    int width = SIDE, height = SIDE;
    tonemap *map = NULL;
    sat_image hdr = sat_image_f32(pixels, width, height, 3);
    double dt = 1 / 60.0;
    fill(0, 4);
    {
        /* README: engine_options */
        tonemap_options options = tonemap_defaults();
        options.adapt_seconds = 0.4;  /* to brighter pictures; */
        options.darker_seconds = 2;   /* to darker ones */
        tonemap_create(&map, width, height, &options);
        tonemap_apply_u8(map, screen, 0, &hdr, dt, NULL);
        options.key = 0.25;           /* a slider moved: the adaptation goes on */
        tonemap_set_options(map, &options);
        tonemap_apply_u8(map, screen, 0, &hdr, dt, NULL);
        /* README end */
    }
    EXPECT(screen[0] > 0);
    tonemap_destroy(map);
}

TEST(faq_bottom_up)
{
    int width = SIDE, height = SIDE;
    float below, above;
    sat_table *table = NULL;
    fill(0, 1);
    pixels[0] = 50;
    {
        /* README: faq_bottom_up */
        /* rows from the bottom, as glReadPixels gives them: point at the top row, and count backwards */
        sat_image image = sat_image_f32(pixels + 3 * width * (height - 1), width, height, 3);
        image.stride = -(ptrdiff_t)sizeof(float) * 3 * width;
        /* README end */
        EXPECT_EQ(sat_create(&table, width, height, 3, NULL), SAT_OK);
        EXPECT_EQ(sat_build(table, &image), SAT_OK);
    }
    above = sat_restore(table, 0, 0, 0);
    below = sat_restore(table, 0, 0, height - 1);
    EXPECT(above <= 1 && below > 49);
    sat_destroy(table);
}
