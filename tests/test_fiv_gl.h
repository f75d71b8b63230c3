/* fiv.h on the GPU: the receiver pass against the CPU, state, errors. Needs OSMesa (or a GPU, see gl_context.h). */

#include "fiv.h"
#include "expect.h"
#include "support.h"
#include "gl_context.h"
#include "gl_es.h"
#include "reference_fiv.h"

enum { WIDTH = 40, HEIGHT = 24, COUNT = WIDTH * HEIGHT };

typedef struct test_scene {
    gl_context context;
    reference_mesh mesh;
    fiv_environment *environment;
    fiv_occluder *upright, *turned;
    fiv_instance instances[3];
    float points[4 * COUNT], normals[4 * COUNT];
    unsigned point_texture, normal_texture;
    fiv_gl *gl;
    support_memory memory;
} test_scene;

static test_scene scene;
static float test_penumbra = 1;

#ifdef FIV_NO_SELF
enum { TEST_SELF = 0 };
#else
enum { TEST_SELF = 1 };
#endif

/* A sky with `suns` bright texels, turned; made once, as nothing changes it. */
static void test_sky(int suns)
{
    static const float turn[9] = {1, 0, 0, 0, 0.8f, -0.6f, 0, 0.6f, 0.8f};
    static fiv_environment *made[8];
    static float pixels[64 * 32 * 3];
    sat_image image = sat_image_f32(pixels, 64, 32, 3);
    fiv_environment_options o = fiv_environment_defaults();
    int i;
    if (made[suns]) {
        scene.environment = made[suns];
        return;
    }
    o.delta_ratio = 100;
    for (i = 0; i < 64 * 32 * 3; i++)
        pixels[i] = (i / 3 / 64 < 16 ? 1.0f : 0.2f) * (1 + 0.5f * sinf(0.1f * (float)(i / 3 % 64) + (float)(i % 3)));
    for (i = 0; i < suns; i++) pixels[3 * (64 * (4 + 2 * i) + 9 * i) + i % 3] = 3000;
    EXPECT_EQ(fiv_environment_create(&made[suns], &image, &o, NULL), SAT_OK);
    EXPECT_EQ(fiv_environment_update(made[suns], NULL, turn), SAT_OK);
    scene.environment = made[suns];
}

static void test_light(void)
{
    static const float turn[9] = {0.6f, 0, 0.8f, 0, 1, 0, -0.8f, 0, 0.6f};
    EXPECT_EQ(fiv_occluder_light(scene.upright, scene.environment, NULL), SAT_OK);
    EXPECT_EQ(fiv_occluder_light(scene.turned, scene.environment, turn), SAT_OK);
}

static void test_receivers(void)
{
    uint64_t seed = 8;
    int i, k;
    for (i = 0; i < COUNT; i++) {
        float n[3];
        for (k = 0; k < 3; k++) n[k] = (float)support_gaussian(&seed);
        if (i < COUNT / 2) n[0] = n[2] = 0, n[1] = 1;
        fiv__normalise(n, n);
        if (i == 5) n[1] = 0;
        for (k = 0; k < 3; k++) {
            scene.points[4 * i + k] = (float)(k == 1 ? (i < COUNT / 2 ? -0.9 : 2 * support_uniform(&seed) - 1)
                                                     : 8 * support_uniform(&seed) - 4);
            scene.normals[4 * i + k] = n[k];
        }
        scene.points[4 * i + 3] = scene.normals[4 * i + 3] = 1;
    }
}

/* The knot and its masks are made once. */
static int test_open(fiv_storage storage, int self)
{
    static reference_mesh mesh;
    static fiv_occluder *upright[2];
    fiv_occluder_options o = fiv_occluder_defaults();
    fiv_gl_options options = fiv_gl_defaults();
    sat__gl_state state;
    sat_result result;
    int i;
    memset(&scene, 0, sizeof scene);
    if (!gl_context_open(&scene.context, 3, 3)) return 0;
    if (!mesh.triangles) mesh = reference_knot(2, 3, 40, 8, 0.25);
    scene.mesh = mesh;
    o.theta = 16, o.phi = 9, o.rho = 8;
    o.storage = storage;
    if (!upright[storage])
        EXPECT_EQ(fiv_occluder_create(&upright[storage], mesh.positions, mesh.vertices, mesh.indices, mesh.triangles,
                                      &o, NULL),
                  SAT_OK);
    scene.upright = upright[storage];
    EXPECT_EQ(fiv_occluder_share(&scene.turned, scene.upright), SAT_OK);
    test_sky(1);
    test_light();
    for (i = 0; i < 3; i++) {
        scene.instances[i].occluder = i == 1 ? scene.turned : scene.upright;
        scene.instances[i].position[0] = 1.5f * (float)i - 1.2f, scene.instances[i].position[1] = 0.3f * (float)i;
        scene.instances[i].position[2] = 0.4f * (float)(i * i);
        scene.instances[i].scale = 1 - 0.2f * (float)i;
    }
    test_receivers();
    options.allocator = support_allocator(&scene.memory);
    options.self = self;
    result = fiv_gl_create(&scene.gl, scene.context.get_proc, WIDTH, HEIGHT, &options);
    if (result) printf("%s\n", fiv_gl_message(scene.gl));
    if (!EXPECT_EQ(result, SAT_OK)) return 0;
    sat__gl_begin(&scene.gl->gl, &state, 1);
    EXPECT_EQ(sat__gl_texture(&scene.gl->gl, &scene.point_texture, SAT__GL_RGBA32F, WIDTH, HEIGHT, scene.points),
              SAT_OK);
    EXPECT_EQ(sat__gl_texture(&scene.gl->gl, &scene.normal_texture, SAT__GL_RGBA32F, WIDTH, HEIGHT, scene.normals),
              SAT_OK);
    sat__gl_end(&scene.gl->gl, &state);
    return 1;
}

static void test_close(void)
{
    if (scene.gl) {
        scene.gl->gl.DeleteTextures(1, &scene.point_texture);
        scene.gl->gl.DeleteTextures(1, &scene.normal_texture);
    }
    fiv_gl_destroy(scene.gl);
    EXPECT(support_memory_clean(&scene.memory));
    fiv_occluder_destroy(scene.turned);
    gl_context_close(&scene.context);
}

/* One receiver on the CPU; on the surface of the instance that the alpha of its point names. */
static void test_cpu(float rgb[3], int i, size_t count)
{
    const float *point = scene.points + 4 * i, *normal = scene.normals + 4 * i;
    fiv_irradiance_options o = fiv_irradiance_defaults();
    fiv_instance others[3];
    size_t j, n = 0;
    o.cutoff = 0;
    o.own_masks = o.rays = 0; /* what the shader does */
    o.penumbra = test_penumbra;
    for (j = 0; j < count; j++)
        if (!(point[3] >= (float)j + 2 && point[3] < (float)j + 3)) others[n++] = scene.instances[j];
#ifndef FIV_NO_SELF
    if (n < count) {
        EXPECT_EQ(fiv_self_irradiance(rgb, point, normal, 1, scene.environment, &scene.instances[(int)point[3] - 2],
                                      others, n, &o, NULL),
                  SAT_OK);
        return;
    }
#endif
    EXPECT_EQ(fiv_irradiance(rgb, point, normal, 1, scene.environment, others, n, &o, NULL), SAT_OK);
}

/* The largest and the root-mean-square difference between both sides, as parts of the largest irradiance. */
static void test_difference(double *worst, double *rms, size_t count)
{
    static float gpu[4 * COUNT], cpu[3 * COUNT];
    sat__gl_state state;
    double largest = 0;
    int i, k;
    for (i = 0; i < COUNT; i++) test_cpu(cpu + 3 * i, i, count);
    EXPECT_EQ(fiv_gl_irradiance(scene.gl, NULL, scene.point_texture, scene.normal_texture, NULL), SAT_OK);
    sat__gl_begin(&scene.gl->gl, &state, 1);
    EXPECT_EQ(sat__gl_read(&scene.gl->gl, gpu, fiv_gl_texture(scene.gl), SAT__GL_RGBA32F, WIDTH, HEIGHT), SAT_OK);
    sat__gl_end(&scene.gl->gl, &state);
    *worst = *rms = 0;
    for (i = 0; i < COUNT; i++)
        for (k = 0; k < 3; k++) {
            double off = fabs((double)gpu[4 * i + k] - (double)cpu[3 * i + k]);
            EXPECT(!expect_is_nan((double)gpu[4 * i + k]));
            if (off > *worst) *worst = off;
            if ((double)cpu[3 * i + k] > largest) largest = (double)cpu[3 * i + k];
            *rms += off * off / (3 * COUNT);
        }
    EXPECT(largest > 1);
    *worst /= largest;
    *rms = sqrt(*rms) / largest;
}

TEST(receiver_pass_equals_the_cpu)
{
    int storage, suns;
    size_t count;
    for (storage = 0; storage < 2; storage++) {
        if (!test_open((fiv_storage)storage, 0)) SKIP(scene.context.message);
        for (suns = 0; suns < 5; suns += suns < 2 ? 1 : 2) {
            test_sky(suns);
            EXPECT_EQ(fiv_environment_get_stats(scene.environment).lights, suns);
            test_light();
            for (count = 0; count < 4; count += suns == 1 ? 1 : 3) {
                double worst, rms;
                EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, count), SAT_OK);
                test_difference(&worst, &rms, count);
                EXPECT(worst < 2e-3);
                EXPECT(rms < 1e-4);
                if (suns == 1 && count == 3) REPORT("GPU against CPU, three occluders: worst", worst, "of the largest");
                if (suns == 1 && count == 3) REPORT("GPU against CPU, three occluders: rms", rms, "of the largest");
            }
        }
        test_close();
    }
}

#ifndef FIV_NO_SELF
/* Receivers on the knots, in turn on each of the first two instances, and every fifth one as it was: on none, or on one
   that is not there. Writes the texture anew. */
static void test_receivers_on_knots(void)
{
    static const float none[5] = {1, 0, -3, 2 + 3, 1e9f};
    sat__gl_state state;
    int i, j, k;
    for (i = 0; i < COUNT; i++) {
        const fiv_instance *self = &scene.instances[i & 1];
        const unsigned *corner = scene.mesh.indices + 3 * ((size_t)i % scene.mesh.triangles);
        const float *p[3];
        float e[2][3], n[3], middle[3];
        scene.points[4 * i + 3] = i % 5 ? (float)(2 + (i & 1)) : none[i / 5 % 5];
        if (i % 5 == 0) continue;
        for (j = 0; j < 3; j++) p[j] = scene.mesh.positions + 3 * (size_t)corner[j];
        for (k = 0; k < 3; k++)
            e[0][k] = p[1][k] - p[0][k], e[1][k] = p[2][k] - p[0][k], middle[k] = (p[0][k] + p[1][k] + p[2][k]) / 3;
        for (k = 0; k < 3; k++)
            n[k] = (float)self->occluder->mesh.turn *
                   (e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3]);
        fiv__turn(scene.normals + 4 * i, self->occluder->rotation, n);
        fiv__turn(scene.points + 4 * i, self->occluder->rotation, middle);
        for (k = 0; k < 3; k++) scene.points[4 * i + k] = self->position[k] + self->scale * scene.points[4 * i + k];
    }
    sat__gl_begin(&scene.gl->gl, &state, 1);
    sat__gl_upload(&scene.gl->gl, scene.point_texture, SAT__GL_RGBA32F, WIDTH, HEIGHT, scene.points);
    sat__gl_upload(&scene.gl->gl, scene.normal_texture, SAT__GL_RGBA32F, WIDTH, HEIGHT, scene.normals);
    sat__gl_end(&scene.gl->gl, &state);
}

/* Alone, with a second occluder and with a third that no receiver lies on; without split-off lights and with some. */
TEST(self_shadows_equal_the_cpu)
{
    int storage, suns, i;
    size_t count;
    double worst, rms;
    for (storage = 0; storage < 2; storage++) {
        if (!test_open((fiv_storage)storage, 1)) SKIP(scene.context.message);
        test_receivers_on_knots();
        for (suns = 0; suns < 5; suns += suns < 1 ? 1 : 3) {
            test_sky(suns);
            test_light();
            for (count = 0; count < 4; count++) {
                EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, count), SAT_OK);
                test_difference(&worst, &rms, count);
                EXPECT(worst < 2e-3);
                EXPECT(rms < 1e-4);
                if (suns == 1 && count == 3)
                    REPORT("GPU against CPU, receivers on occluders: worst", worst, "of the largest");
                if (suns == 1 && count == 3)
                    REPORT("GPU against CPU, receivers on occluders: rms", rms, "of the largest");
            }
        }
        for (i = 0; i < COUNT; i++) scene.points[4 * i + 3] = 1; /* on the CPU alone: the difference sees what is
                                                                    compared */
        test_difference(&worst, &rms, 3);
        EXPECT(rms > 0.02);
        test_close();
    }
}
#endif

/* The same in GLSL ES 3.00, on the same driver. */
TEST(shaders_are_es)
{
    fiv_gl_options o = fiv_gl_defaults();
    fiv_gl *desktop;
    double worst, rms;
    if (!test_open(FIV_STORAGE_FLOAT, 0)) SKIP(scene.context.message);
    desktop = scene.gl;
    o.allocator = scene.gl->allocator;
#ifndef FIV_NO_SELF
    o.self = 1;
    test_receivers_on_knots();
#endif
    EXPECT_EQ(fiv_gl_create(&scene.gl, gl_es_pretend(scene.context.get_proc), WIDTH, HEIGHT, &o), SAT_OK);
    EXPECT(scene.gl->gl.is_es);
    EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, 3), SAT_OK);
    test_difference(&worst, &rms, 3);
    EXPECT(worst < 2e-3 && rms < 1e-4);
    fiv_gl_destroy(desktop);
    test_close();
}

TEST(moving_needs_no_tables)
{
    double worst, rms;
    long calls;
    if (!test_open(FIV_STORAGE_FLOAT, 0)) SKIP(scene.context.message);
    EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, 3), SAT_OK);
    scene.instances[0].position[0] += 0.7f;
    scene.instances[2].scale = 0;
    calls = scene.memory.calls;
    EXPECT_EQ(fiv_gl_move(scene.gl, scene.instances, 3), SAT_OK);
    test_difference(&worst, &rms, 3);
    EXPECT(worst < 2e-3 && rms < 1e-4);
    EXPECT_EQ(scene.memory.calls, calls);
    EXPECT_EQ(fiv_gl_move(scene.gl, scene.instances, 2), SAT_ERR_ARGUMENT);
    scene.instances[0].occluder = scene.turned;
    EXPECT_EQ(fiv_gl_move(scene.gl, scene.instances, 3), SAT_ERR_ARGUMENT);
    test_close();
}

/* OpenGL that refuses textures: every allocation of memory and of textures in turn. The scene before stays whole. */
static int test_refuse, test_images;
static void (SAT__GL_CALL *test_image_2d)(unsigned, int, int, int, int, int, unsigned, unsigned, const void *);
static void (SAT__GL_CALL *test_image_3d)(unsigned, int, int, int, int, int, int, unsigned, unsigned, const void *);

static void SAT__GL_CALL test_tex_image_2d(unsigned a, int b, int c, int w, int h, int d, unsigned e, unsigned f,
                                           const void *p)
{
    test_image_2d(a, b, c, ++test_images == test_refuse ? -1 : w, h, d, e, f, p);
}

static void SAT__GL_CALL test_tex_image_3d(unsigned a, int b, int c, int w, int h, int z, int d, unsigned e, unsigned f,
                                           const void *p)
{
    test_image_3d(a, b, c, ++test_images == test_refuse ? -1 : w, h, z, d, e, f, p);
}

/* Only the occluder that turned is sent again; nothing is allocated; what fails changes nothing. */
TEST(scenes_cost_what_changed)
{
    static float before[4 * COUNT], after[4 * COUNT];
    fiv_occluder_options o = fiv_occluder_defaults();
    fiv_occluder *large = NULL;
    fiv_environment *other = NULL, *kept;
    fiv_environment_options eo = fiv_environment_defaults();
    fiv_instance two[2];
    float grey[2] = {1, 1}, turn[9] = {0, 0, 1, 0, 1, 0, -1, 0, 0};
    sat_image image = sat_image_f32(grey, 2, 1, 1);
    sat__gl_state state;
    double worst, rms;
    size_t sent;
    long calls;
    int k;
    if (!test_open(FIV_STORAGE_FLOAT, 0)) SKIP(scene.context.message);
    calls = scene.memory.calls;
    EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, 3), SAT_OK);
    EXPECT_EQ(scene.gl->uploads, 2);
    EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, 3), SAT_OK);
    EXPECT_EQ(scene.gl->uploads, 2);
    EXPECT_EQ(fiv_occluder_light(scene.turned, scene.environment, turn), SAT_OK);
    EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, 3), SAT_OK);
    EXPECT_EQ(scene.gl->uploads, 3);
    EXPECT_EQ(scene.gl->view_uploads, 2); /* the light enters no depth map of a view */
    test_difference(&worst, &rms, 3);
    EXPECT(worst < 2e-3 && rms < 1e-4);
    EXPECT_EQ(scene.memory.calls, calls);
    /* a larger scene under another light: each of its textures is refused once */
    eo.resolution = o.resolution = 16;
    o.theta = 32, o.phi = 17, o.rho = 12, o.sun_map = 1024;
    EXPECT_EQ(fiv_environment_create(&other, &image, &eo, NULL), SAT_OK);
    EXPECT_EQ(fiv_occluder_create(&large, scene.mesh.positions, scene.mesh.vertices, scene.mesh.indices,
                                  scene.mesh.triangles, &o, NULL),
              SAT_OK);
    EXPECT_EQ(fiv_occluder_light(large, other, NULL), SAT_OK);
    two[0] = two[1] = scene.instances[0];
    two[0].occluder = two[1].occluder = large;
    test_image_2d = scene.gl->gl.TexImage2D;
    test_image_3d = scene.gl->gl.TexImage3D;
    scene.gl->gl.TexImage2D = test_tex_image_2d;
    scene.gl->gl.TexImage3D = test_tex_image_3d;
    EXPECT_EQ(fiv_gl_irradiance(scene.gl, NULL, scene.point_texture, scene.normal_texture, NULL), SAT_OK);
    sat__gl_begin(&scene.gl->gl, &state, 1);
    EXPECT_EQ(sat__gl_read(&scene.gl->gl, before, fiv_gl_texture(scene.gl), SAT__GL_RGBA32F, WIDTH, HEIGHT), SAT_OK);
    sat__gl_end(&scene.gl->gl, &state);
    sent = scene.gl->uploads;
    for (k = 1; k < 9; k++) {
        sat_result r;
        test_images = 0;
        test_refuse = k;
        r = fiv_gl_set_scene(scene.gl, other, two, 2);
        if (r == SAT_OK) break;
        EXPECT(strlen(fiv_gl_message(scene.gl)) > 3);
        EXPECT_EQ(scene.gl->uploads, sent);
        EXPECT_EQ(fiv_gl_irradiance(scene.gl, NULL, scene.point_texture, scene.normal_texture, NULL), SAT_OK);
        sat__gl_begin(&scene.gl->gl, &state, 1);
        EXPECT_EQ(sat__gl_read(&scene.gl->gl, after, fiv_gl_texture(scene.gl), SAT__GL_RGBA32F, WIDTH, HEIGHT), SAT_OK);
        sat__gl_end(&scene.gl->gl, &state);
        EXPECT(memcmp(before, after, sizeof before) == 0);
    }
    EXPECT_EQ(k, 3); /* the samples and the new cube's I_tot; no light is split off, no map grows */
    EXPECT_EQ(scene.gl->uploads, sent + 1);
    kept = scene.environment;
    scene.environment = other;
    scene.instances[0] = two[0];
    scene.instances[1] = two[1];
    test_difference(&worst, &rms, 2);
    EXPECT(worst < 2e-3 && rms < 1e-4);
    scene.environment = kept;
    EXPECT_EQ(scene.memory.calls, calls);
    fiv_occluder_destroy(large);
    fiv_environment_destroy(other);
    test_close();
}

/* What stands on a floor leaks no light: many of these receivers are near contact, and the GPU has what the CPU has,
   which is twice as near to the truth as interpolated vectors, or nearer. */
TEST(no_light_leaks_at_contact)
{
    static float truth[3 * COUNT], rgb[3 * COUNT], none[3 * COUNT], gpu[4 * COUNT], points[3 * COUNT],
        normals[3 * COUNT];
    static const float origin[3] = {0, 0, 0};
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_irradiance_stats stats;
    reference_scene rays;
    sat__gl_state state;
    double worst, rms;
    float low = 0, *directions, *powers;
    size_t i, lights;
    if (!test_open(FIV_STORAGE_FLOAT, 0)) SKIP(scene.context.message);
    test_sky(0);
    test_light();
    for (i = 0; i < scene.mesh.vertices; i++)
        low = scene.mesh.positions[3 * i + 1] < low ? scene.mesh.positions[3 * i + 1] : low;
    memset(scene.instances[0].position, 0, sizeof scene.instances[0].position);
    for (i = 0; i < COUNT; i++) {
        float *p = scene.points + 4 * i, *n = scene.normals + 4 * i;
        p[0] = 4 * (((float)(i % WIDTH) + 0.5f) / WIDTH - 0.5f);
        p[1] = low - 0.002f;
        p[2] = 4 * (((float)(i / WIDTH) + 0.5f) / HEIGHT - 0.5f);
        n[0] = n[2] = 0;
        n[1] = 1;
        memcpy(points + 3 * i, p, sizeof origin);
        memcpy(normals + 3 * i, n, sizeof origin);
    }
    sat__gl_begin(&scene.gl->gl, &state, 1);
    sat__gl_upload(&scene.gl->gl, scene.point_texture, SAT__GL_RGBA32F, WIDTH, HEIGHT, scene.points);
    sat__gl_upload(&scene.gl->gl, scene.normal_texture, SAT__GL_RGBA32F, WIDTH, HEIGHT, scene.normals);
    sat__gl_end(&scene.gl->gl, &state);
    EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, 1), SAT_OK);
    test_difference(&worst, &rms, 1);
    EXPECT(worst < 2e-3 && rms < 1e-4);
    memset(&rays, 0, sizeof rays);
    reference_add(&rays, scene.mesh.positions, scene.mesh.indices, scene.mesh.triangles, NULL, origin, 1);
    reference_build(&rays);
    lights = fiv_environment_lights(NULL, NULL, 0, scene.environment);
    directions = (float *)malloc(6 * lights * sizeof *directions);
    powers = directions + 3 * lights;
    fiv_environment_lights(directions, powers, lights, scene.environment);
    for (i = 0; i < COUNT; i++) {
        double sum[3];
        int k;
        reference_irradiance(sum, &rays, directions, powers, lights, points + 3 * i, normals + 3 * i);
        for (k = 0; k < 3; k++) truth[3 * i + (size_t)k] = (float)sum[k];
    }
    io.own_masks = 0;
    EXPECT_EQ(fiv_irradiance(rgb, points, normals, COUNT, scene.environment, scene.instances, 1, &io, &stats), SAT_OK);
    EXPECT(stats.contacts > COUNT / 20);
    io.contact = 0;
    EXPECT_EQ(fiv_irradiance(none, points, normals, COUNT, scene.environment, scene.instances, 1, &io, NULL), SAT_OK);
    sat__gl_begin(&scene.gl->gl, &state, 1);
    EXPECT_EQ(sat__gl_read(&scene.gl->gl, gpu, fiv_gl_texture(scene.gl), SAT__GL_RGBA32F, WIDTH, HEIGHT), SAT_OK);
    sat__gl_end(&scene.gl->gl, &state);
    for (i = 0; i < 3 * COUNT; i++) rgb[i] = gpu[4 * (i / 3) + i % 3];
    REPORT("GPU, resting: NRMSE", reference_nrmse(truth, rgb, COUNT), "");
    REPORT("GPU, resting, interpolated: NRMSE", reference_nrmse(truth, none, COUNT), "");
    EXPECT(2 * reference_nrmse(truth, rgb, COUNT) < reference_nrmse(truth, none, COUNT));
    free(directions);
    reference_free(&rays);
    test_close();
}

/* Few triangles: rays along the views instead of depth maps, the same as on the CPU; a box that stands on a floor leaks
   nothing, wherever the receivers lie, and neither does one beside it, nor the box on itself. */
TEST(few_triangles_equal_the_cpu)
{
    static float points[3 * COUNT], normals[3 * COUNT], truth[3 * COUNT], gpu[4 * COUNT], rgb[3 * COUNT];
    reference_mesh box = reference_box(0.5f, 0.3f, 0.4f);
    fiv_occluder_options o = fiv_occluder_defaults();
    fiv_occluder *made = NULL;
    reference_scene rays;
    sat__gl_state state;
    uint64_t seed = 4;
    double worst, rms;
    float *directions, *powers;
    size_t lights;
    int i, k, round;
    for (round = 0; round < 2 + TEST_SELF; round++) { /* closed; an open one; on the box itself */
        if (!test_open(FIV_STORAGE_FLOAT, round == 2)) SKIP(scene.context.message);
        test_sky(0);
        test_light();
        EXPECT_EQ(fiv_occluder_create(&made, box.positions, box.vertices, box.indices, round == 1 ? 10 : 12, &o, NULL),
                  SAT_OK);
        EXPECT(made->few && made->mesh.closed == (round != 1));
        EXPECT_EQ(fiv_occluder_light(made, scene.environment, NULL), SAT_OK);
        scene.instances[0].occluder = scene.instances[1].occluder = made;
        for (k = 0; k < 3; k++) {
            scene.instances[0].position[k] = -made->centre[k];
            scene.instances[1].position[k] = -made->centre[k] + (k == 0 ? 1.2f : 0);
        }
        scene.instances[0].scale = scene.instances[1].scale = 1;
        for (i = 0; i < COUNT; i++) {
            float *p = scene.points + 4 * i, *n = scene.normals + 4 * i;
            for (k = 0; k < 3; k++) {
                p[k] = (float)(3 * support_uniform(&seed) - 1.5);
                n[k] = k == 1;
            }
            p[1] = -0.3f;
            p[3] = 1;
            if (round == 2 && i & 1) { /* a side of the box */
                p[0] = -0.5f, p[1] = 0.25f * p[2] - 0.1f, p[2] = 0.3f * p[2], p[3] = 2;
                n[0] = -1, n[1] = 0;
            }
            memcpy(points + 3 * i, p, sizeof points[0] * 3);
            memcpy(normals + 3 * i, n, sizeof points[0] * 3);
        }
        sat__gl_begin(&scene.gl->gl, &state, 1);
        sat__gl_upload(&scene.gl->gl, scene.point_texture, SAT__GL_RGBA32F, WIDTH, HEIGHT, scene.points);
        sat__gl_upload(&scene.gl->gl, scene.normal_texture, SAT__GL_RGBA32F, WIDTH, HEIGHT, scene.normals);
        sat__gl_end(&scene.gl->gl, &state);
        EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, 2), SAT_OK);
        EXPECT_EQ(scene.gl->room.view_side, 1); /* no depth maps */
        EXPECT_EQ(scene.gl->view_uploads, 1);
        test_difference(&worst, &rms, 2);
        REPORT("GPU against CPU, boxes: worst", worst, "of the largest");
        EXPECT(worst < 2e-3 && rms < 1e-4);
        EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, 1), SAT_OK);
        test_difference(&worst, &rms, 1);
        memset(&rays, 0, sizeof rays);
        reference_add(&rays, box.positions, box.indices, round == 1 ? 10 : 12, NULL, scene.instances[0].position, 1);
        reference_build(&rays);
        lights = fiv_environment_lights(NULL, NULL, 0, scene.environment);
        directions = (float *)malloc(6 * lights * sizeof *directions);
        powers = directions + 3 * lights;
        fiv_environment_lights(directions, powers, lights, scene.environment);
        for (i = 0; i < COUNT; i++) {
            double sum[3];
            points[3 * i + (round == 2 && i & 1 ? 0 : 1)] -= 1e-4f;
            reference_irradiance(sum, &rays, directions, powers, lights, points + 3 * i, normals + 3 * i);
            for (k = 0; k < 3; k++) truth[3 * i + k] = (float)sum[k];
        }
        sat__gl_begin(&scene.gl->gl, &state, 1);
        EXPECT_EQ(sat__gl_read(&scene.gl->gl, gpu, fiv_gl_texture(scene.gl), SAT__GL_RGBA32F, WIDTH, HEIGHT), SAT_OK);
        sat__gl_end(&scene.gl->gl, &state);
        for (i = 0; i < 3 * COUNT; i++) rgb[i] = gpu[4 * (i / 3) + i % 3];
        REPORT("GPU, a box that rests: NRMSE", reference_nrmse(truth, rgb, COUNT), "");
        EXPECT(reference_nrmse(truth, rgb, COUNT) <= 0.012);
        free(directions);
        reference_free(&rays);
        fiv_occluder_destroy(made);
        test_close();
    }
    reference_mesh_free(&box);
}

/* Another size a frame: what an object of that size gives, from points and from a depth buffer. */
TEST(another_size_a_frame)
{
    static const float identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    enum { W = WIDTH / 2 + 1, H = HEIGHT - 3 };
    static float a[4 * WIDTH * HEIGHT], b[4 * WIDTH * HEIGHT];
    fiv_gl_view view;
    sat_gl_target to;
    fiv_gl *smaller = NULL;
    fiv_gl_options options = fiv_gl_defaults();
    sat__gl_state state;
    int y, depth;
    if (!test_open(FIV_STORAGE_FLOAT, 0)) SKIP(scene.context.message);
    options.allocator = scene.gl->allocator;
    memset(&view, 0, sizeof view);
    memset(&to, 0, sizeof to);
    for (y = 0; y < 4; y++) view.world_from_clip[5 * y] = y < 3 ? 3.0f : 1.0f;
    memcpy(view.world_from_normal, identity, sizeof identity);
    EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, 2), SAT_OK);
    EXPECT_EQ(fiv_gl_create(&smaller, scene.context.get_proc, W, H, &options), SAT_OK);
    EXPECT_EQ(fiv_gl_set_scene(smaller, scene.environment, scene.instances, 2), SAT_OK);
    for (depth = 0; depth < 2; depth++) {
        const fiv_gl_view *used = depth ? &view : NULL;
        EXPECT_EQ(fiv_gl_irradiance(scene.gl, NULL, scene.point_texture, scene.normal_texture, used), SAT_OK);
        to.width = W, to.height = H;
        EXPECT_EQ(fiv_gl_irradiance(scene.gl, &to, scene.point_texture, scene.normal_texture, used), SAT_OK);
        EXPECT_EQ(fiv_gl_irradiance(smaller, NULL, scene.point_texture, scene.normal_texture, used), SAT_OK);
        sat__gl_begin(&scene.gl->gl, &state, 1);
        EXPECT_EQ(sat__gl_read(&scene.gl->gl, a, fiv_gl_texture(scene.gl), SAT__GL_RGBA32F, WIDTH, HEIGHT), SAT_OK);
        EXPECT_EQ(sat__gl_read(&scene.gl->gl, b, fiv_gl_texture(smaller), SAT__GL_RGBA32F, W, H), SAT_OK);
        sat__gl_end(&scene.gl->gl, &state);
        for (y = 0; y < H; y++) EXPECT(memcmp(a + 4 * WIDTH * y, b + 4 * W * y, 4 * W * sizeof *a) == 0);
        to.width = WIDTH + 1;
        EXPECT_EQ(fiv_gl_irradiance(scene.gl, &to, scene.point_texture, scene.normal_texture, used), SAT_ERR_SIZE);
    }
    fiv_gl_destroy(smaller);
    test_close();
}

/* Pairs of options of both sides: the corners of storage, sizes of samples and of maps, suns, penumbra; one object for
   all scenes of a storage. */
TEST(corners_in_pairs_equal_the_cpu)
{
    static const int grids[3][3] = {{4, 3, 2}, {64, 5, 3}, {6, 33, 4}};
    static const float shells[2][2] = {{0.05f, 1}, {0.9f, 20}}, penumbrae[3] = {0, 1, 6};
    int i, storage;
    double worst_of_all = 0;
    EXPECT(strcmp(fiv_gl_message(NULL), "no object") == 0);
    for (storage = 0; storage < 2; storage++) {
        fiv_gl_options options = fiv_gl_defaults();
        fiv_gl *first;
        if (!test_open((fiv_storage)storage, 0)) SKIP(scene.context.message);
        first = scene.gl;
        options.allocator = first->allocator;
        options.max_instances = storage ? 3 : 64;
        EXPECT_EQ(fiv_gl_create(&scene.gl, scene.context.get_proc, WIDTH, HEIGHT, &options), SAT_OK);
        fiv_gl_destroy(first);
        EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, 3), SAT_OK);
        for (i = storage; i < 18; i += 2) {
            fiv_occluder_options o = fiv_occluder_defaults();
            fiv_occluder *made = NULL;
            double worst, rms;
            o.storage = (fiv_storage)storage;
            o.theta = grids[i % 3][0], o.phi = grids[i % 3][1], o.rho = grids[i % 3][2];
            o.first_shell = shells[i / 3 % 2][0], o.last_shell = shells[i / 3 % 2][1];
            o.sun_map = i % 5 ? 64 << i % 4 : 1000;
            o.contact_map = i % 3 ? 8 << i % 4 : 0;
            o.keep_masks = i % 7 != 0;
            EXPECT_EQ(fiv_occluder_create(&made, scene.mesh.positions, scene.mesh.vertices, scene.mesh.indices,
                                          scene.mesh.triangles, &o, NULL),
                      SAT_OK);
            test_sky(i % 4 * 2);
            test_light();
            EXPECT_EQ(fiv_occluder_light(made, scene.environment, NULL), SAT_OK);
            scene.instances[0].occluder = scene.instances[2].occluder = made;
            options.penumbra = test_penumbra = penumbrae[i / 6];
            EXPECT_EQ(fiv_gl_set_options(scene.gl, &options), SAT_OK);
            EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, 3), SAT_OK);
            test_difference(&worst, &rms, 3);
            EXPECT(worst < 1e-2 && rms < 3e-4); /* wide penumbrae: one point of a disc on the other side of an edge */
            if (worst > worst_of_all) worst_of_all = worst;
            fiv_occluder_destroy(made);
        }
        test_penumbra = 1;
        test_close();
    }
    REPORT("GPU against CPU, corners in pairs: worst", worst_of_all, "of the largest");
}

TEST(state_is_put_back)
{
    enum {
        VIEWPORT = 0x0BA2,
        PROGRAM = 0x8B8D,
        DRAW_FRAMEBUFFER = 0x8CA6,
        VERTEX_ARRAY = 0x85B5,
        TEXTURE_2D = 0x8069,
        ACTIVE = 0x84E0
    };
    static const unsigned names[6] = {VIEWPORT, PROGRAM, DRAW_FRAMEBUFFER, VERTEX_ARRAY, TEXTURE_2D, ACTIVE};
    int before[6][4], after[6][4], i;
    unsigned texture = 0;
    if (!test_open(FIV_STORAGE_FLOAT, TEST_SELF)) SKIP(scene.context.message);
    scene.gl->gl.GenTextures(1, &texture);
    scene.gl->gl.ActiveTexture(0x84C0 + 1);
    scene.gl->gl.BindTexture(0x0DE1, texture);
    scene.gl->gl.Viewport(1, 2, 3, 4);
    memset(before, 0, sizeof before);
    memset(after, 0, sizeof after);
    for (i = 0; i < 6; i++) scene.gl->gl.GetIntegerv(names[i], before[i]);
    EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, 3), SAT_OK);
    EXPECT_EQ(fiv_gl_irradiance(scene.gl, NULL, scene.point_texture, scene.normal_texture, NULL), SAT_OK);
    for (i = 0; i < 6; i++) scene.gl->gl.GetIntegerv(names[i], after[i]);
    EXPECT(memcmp(before, after, sizeof before) == 0);
    EXPECT_EQ(scene.gl->gl.GetError(), 0);
    scene.gl->gl.DeleteTextures(1, &texture);
    test_close();
}

/* A shader of one's own calls fiv_irradiance or fiv_self_irradiance. */
static void test_shader(const char *call, int self)
{
    const char *const body[] = {"uniform sampler2D p, n;\nout vec4 value;\nvoid main() { ivec2 i = ivec2(gl_FragCoord.xy);\n"
        "    vec4 point = texelFetch(p, i, 0); vec3 normal = texelFetch(n, i, 0).xyz;\n    value = vec4(", call, ", 1.0); }\n", NULL};
    static float mine[4 * COUNT], theirs[4 * COUNT];
    sat__gl_shaders shaders;
    sat__gl_state state;
    unsigned program = 0, target = 0, out = 0;
    sat__gl *gl;
    if (!test_open(FIV_STORAGE_FLOAT, self)) SKIP(scene.context.message);
    gl = &scene.gl->gl;
#ifndef FIV_NO_SELF
    if (self) test_receivers_on_knots();
#endif
    EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, scene.instances, 3), SAT_OK);
    EXPECT_EQ(fiv_gl_irradiance(scene.gl, NULL, scene.point_texture, scene.normal_texture, NULL), SAT_OK);
    memset(&shaders, 0, sizeof shaders);
    shaders.name = "own";
    shaders.library = fiv_gl_glsl();
    shaders.fragment = body;
    sat__gl_define(gl, "FIV_INSTANCES", 8);
    EXPECT_EQ(sat__gl_build(gl, &program, &shaders), SAT_OK);
    sat__gl_begin(gl, &state, 6);
    EXPECT_EQ(sat__gl_texture(gl, &out, SAT__GL_RGBA32F, WIDTH, HEIGHT, NULL), SAT_OK);
    EXPECT_EQ(sat__gl_framebuffer(gl, &target, &out, 1, 0), SAT_OK);
    sat__gl_pass(gl, program, target, WIDTH, HEIGHT);
    EXPECT_EQ(fiv_gl_bind(scene.gl, program, 2), SAT_OK);
    sat__gl_set_texture(gl, program, "p", 0, scene.point_texture);
    sat__gl_set_texture(gl, program, "n", 1, scene.normal_texture);
    sat__gl_draw(gl);
    EXPECT_EQ(sat__gl_read(gl, mine, out, SAT__GL_RGBA32F, WIDTH, HEIGHT), SAT_OK);
    EXPECT_EQ(sat__gl_read(gl, theirs, fiv_gl_texture(scene.gl), SAT__GL_RGBA32F, WIDTH, HEIGHT), SAT_OK);
    sat__gl_end(gl, &state);
    EXPECT(memcmp(mine, theirs, sizeof mine) == 0);
    gl->DeleteFramebuffers(1, &target);
    gl->DeleteTextures(1, &out);
    gl->DeleteProgram(program);
    test_close();
}

TEST(own_shader)
{
    test_shader("fiv_irradiance(point.xyz, normal)", 0);
#ifndef FIV_NO_SELF
    test_shader("fiv_self_irradiance(point.w > 9.0 ? 99 : int(point.w) - 2, point.xyz, normal)", 1);
#endif
}

static sat_gl_proc test_nothing(const char *name)
{
    (void)name;
    return NULL;
}

TEST(bad_arguments)
{
    fiv_gl *gl = NULL;
    fiv_gl_options o = fiv_gl_defaults();
    fiv_instance many[9];
    int i;
    EXPECT_EQ(o.max_instances, 8);
    EXPECT_EQ(fiv_gl_create(&gl, test_nothing, 4, 4, NULL), SAT_ERR_GL_FUNCTION);
    EXPECT(strlen(fiv_gl_message(gl)) > 3);
    EXPECT_EQ(fiv_gl_irradiance(gl, NULL, 1, 2, NULL), SAT_ERR_ARGUMENT);
    fiv_gl_destroy(gl);
    fiv_gl_destroy(NULL);
    EXPECT_EQ(fiv_gl_create(NULL, test_nothing, 4, 4, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(fiv_gl_create(&gl, NULL, 4, 4, NULL), SAT_ERR_ARGUMENT);
    fiv_gl_destroy(gl);
    EXPECT_EQ(fiv_gl_create(&gl, test_nothing, 0, 4, NULL), SAT_ERR_ARGUMENT);
    EXPECT(strcmp(fiv_gl_message(gl), "width is 0; 1..16384") == 0);
    fiv_gl_destroy(gl);
    EXPECT_EQ(o.self, 0);
#ifdef FIV_NO_SELF
    o.self = 1;
    EXPECT_EQ(fiv_gl_create(&gl, test_nothing, 4, 4, &o), SAT_ERR_ARGUMENT);
    fiv_gl_destroy(gl);
    o.self = 0;
#endif
    for (i = 0; i < SAT__COUNT(fiv__gl_fields); i++) {
        const sat__field *f = &fiv__gl_fields[i];
        char text[160];
        if (f->type != 'i' && f->type != 'f') continue;
        o = fiv_gl_defaults();
        EXPECT(strcmp(fiv_explain_gl(text, sizeof text, 4, 4, &o), "") == 0);
        sat__field_set(f, &o, f->high + 1);
        EXPECT(strstr(fiv_explain_gl(text, sizeof text, 4, 4, &o), f->name) == text);
        EXPECT_EQ(fiv_gl_create(&gl, test_nothing, 4, 4, &o), SAT_ERR_ARGUMENT);
        EXPECT(strcmp(fiv_gl_message(gl), text) == 0);
        fiv_gl_destroy(gl);
    }
    if (!test_open(FIV_STORAGE_FLOAT, 0)) SKIP(scene.context.message);
    EXPECT_EQ(fiv_gl_irradiance(scene.gl, NULL, scene.point_texture, scene.normal_texture, NULL),
              SAT_ERR_ARGUMENT); /* no scene */
    for (i = 0; i < 9; i++) many[i] = scene.instances[0];
    EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, many, 9), SAT_ERR_LIMIT);
    many[0].scale = -1;
    EXPECT_EQ(fiv_gl_set_scene(scene.gl, scene.environment, many, 1), SAT_ERR_ARGUMENT);
    EXPECT_EQ(fiv_gl_set_scene(scene.gl, NULL, many, 1), SAT_ERR_ARGUMENT);
    test_close();
}
