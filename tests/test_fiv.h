/* test_fiv.h - tests of fiv.h against rays through every light (reference_fiv.h). */

#include "fiv.h"
#include "expect.h"
#include "support.h"
#include "reference_fiv.h"

/* ---- scenes ---- */

/* From its bits: what divides 0 by 0 is whatever -ffast-math likes. */
static float test_nan(void) { return sat__float_from_bits(0x7fc00000u); }

enum { SKY_WIDTH = 128, SKY_HEIGHT = 64 };

/* A sky with a bright side, a coloured horizon and a dark ground; `sun` in W/(m2 sr) on one texel (0: none). */
static sat_image test_sky(float *pixels, float sun)
{
    int x, y, c;
    for (y = 0; y < SKY_HEIGHT; y++)
        for (x = 0; x < SKY_WIDTH; x++) {
            double v = (y + 0.5) / (double)SKY_HEIGHT, u = (x + 0.5) / (double)SKY_WIDTH;
            for (c = 0; c < 3; c++) {
                double light =
                    v < 0.5 ? 1 + 4 * exp(-30 * ((u - 0.3) * (u - 0.3) + (v - 0.25) * (v - 0.25)) * (1 + 0.5 * c))
                            : 0.2;
                pixels[3 * (y * SKY_WIDTH + x) + c] = (float)(light * (1 + 0.3 * sin(9 * u + c)) * (0.6 + 0.2 * c));
            }
        }
    if (sun > 0)
        for (c = 0; c < 3; c++) pixels[3 * (12 * SKY_WIDTH + 50) + c] = sun;
    return sat_image_f32(pixels, SKY_WIDTH, SKY_HEIGHT, 3);
}

static fiv_environment *test_environment(float sun, float delta_ratio)
{
    static float pixels[SKY_WIDTH * SKY_HEIGHT * 3];
    sat_image sky = test_sky(pixels, sun);
    fiv_environment_options o = fiv_environment_defaults();
    fiv_environment *e = NULL;
    o.delta_ratio = delta_ratio;
    EXPECT_EQ(fiv_environment_create(&e, &sky, &o, NULL), SAT_OK);
    return e;
}

/* A closed knot of 640 triangles. */
static reference_mesh test_knot(void) { return reference_knot(2, 3, 40, 8, 0.25); }

static fiv_occluder *test_occluder(const reference_mesh *m, const fiv_occluder_options *options,
                                   fiv_occluder_stats *stats)
{
    fiv_occluder *o = NULL;
    EXPECT_EQ(fiv_occluder_create(&o, m->positions, m->vertices, m->indices, m->triangles, options, stats), SAT_OK);
    return o;
}

static fiv_occluder_options test_small_set(void)
{
    fiv_occluder_options o = fiv_occluder_defaults();
    o.theta = 16;
    o.phi = 9;
    o.rho = 8;
    return o;
}

/* The same bits; where the compiler contracts a product and a sum into one instruction, which it does differently in
   each place, the same but for the last digits. */
static int test_same(const float *a, const float *b, size_t n)
{
#if defined(__FMA__) || defined(__aarch64__)
    size_t i;
    for (i = 0; i < n; i++)
        if (!(fabsf(a[i] - b[i]) <= 1e-6f * fabsf(b[i]))) return 0;
    return 1;
#else
    return memcmp(a, b, n * sizeof *a) == 0;
#endif
}

/* What many tests read and none of them changes is made once, and stays until the program ends: environments by their
   sun and delta_ratio, occluders by their mesh and the options that follow. Each test lights its occluder anew. */
enum { TEST_SHARED = 16 };

static fiv_environment *test_shared_environment(float sun, float delta_ratio)
{
    static struct { float key[2]; fiv_environment *made; } all[TEST_SHARED];
    float key[2];
    int i = 0;
    key[0] = sun, key[1] = delta_ratio;
    while (all[i].made && memcmp(all[i].key, key, sizeof key) != 0) i++;
    if (!EXPECT(i < TEST_SHARED - 1)) abort();
    if (!all[i].made) memcpy(all[i].key, key, sizeof key), all[i].made = test_environment(sun, delta_ratio);
    return all[i].made;
}

static fiv_occluder *test_shared_occluder(const reference_mesh *m, const fiv_occluder_options *options)
{
    static struct { uint64_t key; fiv_occluder *made; } all[TEST_SHARED];
    fiv_occluder_options o = options ? *options : fiv_occluder_defaults();
    int i = 0, numbers[6];
    uint64_t key = support_hash(m->positions, 3 * m->vertices * sizeof *m->positions);
    numbers[0] = o.theta, numbers[1] = o.phi, numbers[2] = o.rho, numbers[3] = o.resolution;
    numbers[4] = (int)o.storage, numbers[5] = o.contact_map;
    key = support_hash_add(key, m->indices, 3 * m->triangles * sizeof *m->indices);
    key = support_hash_add(key, numbers, sizeof numbers);
    while (all[i].made && all[i].key != key) i++;
    if (!EXPECT(i < TEST_SHARED - 1)) abort();
    if (!all[i].made) all[i].key = key, all[i].made = test_occluder(m, &o, NULL);
    return all[i].made;
}

static fiv_instance test_instance(const fiv_occluder *o, float x, float y, float z)
{
    fiv_instance i;
    i.occluder = o;
    i.position[0] = x, i.position[1] = y, i.position[2] = z;
    i.scale = 1;
    return i;
}

/* A square of side * side receivers that look up, at height y. */
static void test_plane(float *points, float *normals, int side, float width, float y)
{
    int i, j;
    for (j = 0; j < side; j++)
        for (i = 0; i < side; i++) {
            float *p = points + 3 * (j * side + i), *n = normals + 3 * (j * side + i);
            p[0] = width * (((float)i + 0.5f) / (float)side - 0.5f), p[1] = y;
            p[2] = width * (((float)j + 0.5f) / (float)side - 0.5f);
            n[0] = n[2] = 0, n[1] = 1;
        }
}

typedef struct test_lights { float *directions, *powers; size_t count; } test_lights;

static test_lights test_get_lights(const fiv_environment *e)
{
    test_lights l;
    l.count = fiv_environment_lights(NULL, NULL, 0, e);
    l.directions = (float *)malloc(3 * l.count * sizeof(float));
    l.powers = (float *)malloc(3 * l.count * sizeof(float));
    EXPECT_EQ(fiv_environment_lights(l.directions, l.powers, l.count, e), l.count);
    return l;
}

static void test_free_lights(test_lights *l)
{
    free(l->directions);
    free(l->powers);
}

static void test_truth(float *rgb, const reference_scene *s, const fiv_environment *e, const float *points,
                       const float *normals, size_t count)
{
    test_lights l = test_get_lights(e);
    size_t i;
    for (i = 0; i < count; i++) {
        double v[3];
        reference_irradiance(v, s, l.directions, l.powers, l.count, points + 3 * i, normals + 3 * i);
        rgb[3 * i] = (float)v[0], rgb[3 * i + 1] = (float)v[1], rgb[3 * i + 2] = (float)v[2];
    }
    test_free_lights(&l);
}

static double test_nrmse(const float *truth, const float *points, const float *normals, size_t count,
                         const fiv_environment *e, const fiv_instance *instances, size_t n, fiv_accuracy accuracy)
{
    fiv_irradiance_options o = fiv_irradiance_defaults();
    float *rgb = (float *)malloc(3 * count * sizeof(float));
    double error;
    o.accuracy = accuracy;
    EXPECT_EQ(fiv_irradiance(rgb, points, normals, count, e, instances, n, &o, NULL), SAT_OK);
    error = reference_nrmse(truth, rgb, count);
    free(rgb);
    return error;
}

static void test_random_unit(float n[3], uint64_t *seed)
{
    double z = 2 * support_uniform(seed) - 1, a = 6.283185307 * support_uniform(seed), r = sqrt(1 - z * z);
    n[0] = (float)(r * cos(a)), n[1] = (float)z, n[2] = (float)(r * sin(a));
}

/* Rotation by `angle` about an axis. */
static void test_rotation(float m[9], const float axis[3], double angle)
{
    double c = cos(angle), s = sin(angle), x = (double)axis[0], y = (double)axis[1], z = (double)axis[2];
    m[0] = (float)(c + x * x * (1 - c)), m[1] = (float)(x * y * (1 - c) - z * s),
    m[2] = (float)(x * z * (1 - c) + y * s);
    m[3] = (float)(y * x * (1 - c) + z * s), m[4] = (float)(c + y * y * (1 - c)),
    m[5] = (float)(y * z * (1 - c) - x * s);
    m[6] = (float)(z * x * (1 - c) - y * s), m[7] = (float)(z * y * (1 - c) + x * s),
    m[8] = (float)(c + z * z * (1 - c));
}

/* ---- environments ---- */

TEST(uniform_light)
{
    float white[2] = {1, 1}, normal[3], rgb[3], fiv[9];
    sat_image image = sat_image_f32(white, 2, 1, 1);
    fiv_environment *e = NULL;
    fiv_environment_stats stats;
    test_lights l;
    uint64_t seed = 3;
    double all = 0;
    size_t i;
    int k;
    if (!EXPECT_EQ(fiv_environment_create(&e, &image, NULL, &stats), SAT_OK)) return;
    EXPECT_EQ(stats.lights, 0);
    for (k = 0; k < 50; k++) {
        test_random_unit(normal, &seed);
        fiv_environment_irradiance(rgb, e, normal);
        EXPECT_REL(rgb[0], 3.14159265, 1e-3);
        EXPECT_REL(rgb[2], 3.14159265, 1e-3);
    }
    fiv_environment_vector(fiv, e);
    for (k = 0; k < 9; k++) EXPECT_NEAR(fiv[k], 0, 1e-5);
    l = test_get_lights(e);
    for (i = 0; i < l.count; i++) all += (double)l.powers[3 * i];
    EXPECT_REL(all, 12.566370614359172, 1e-6);
    test_free_lights(&l);
    fiv_environment_destroy(e);
}

/* u = atan2(x, -z) / 2 pi + 1/2, v = acos(y) / pi. */
TEST(orientation_of_the_image)
{
    static float pixels[SKY_WIDTH * SKY_HEIGHT * 3];
    sat_image image = sat_image_f32(pixels, SKY_WIDTH, SKY_HEIGHT, 3);
    int x = 100, y = 20, k;
    double u = (x + 0.5) / (double)SKY_WIDTH, v = (y + 0.5) / (double)SKY_HEIGHT, a = 6.283185307179586 * (u - 0.5),
           b = 3.141592653589793 * v;
    double d[3], solid = 6.283185307179586 / (double)SKY_WIDTH *
                         (cos(3.141592653589793 * y / (double)SKY_HEIGHT) -
                          cos(3.141592653589793 * (y + 1) / (double)SKY_HEIGHT));
    fiv_environment *e = NULL;
    fiv_environment_stats stats;
    float direction[3], power[3], normal[3], rgb[3];
    memset(pixels, 0, sizeof pixels);
    pixels[3 * (y * SKY_WIDTH + x)] = 1e8f, pixels[3 * (y * SKY_WIDTH + x) + 1] = 2e8f;
    d[0] = sin(a) * sin(b), d[1] = cos(b), d[2] = -cos(a) * sin(b);
    if (!EXPECT_EQ(fiv_environment_create(&e, &image, NULL, &stats), SAT_OK)) return;
    EXPECT_EQ(stats.lights, 1);
    EXPECT_NEAR(stats.light_share, 1, 1e-6);
    fiv_environment_lights(direction, power, 1, e);
    for (k = 0; k < 3; k++) EXPECT_NEAR(direction[k], d[k], 1e-3);
    EXPECT_REL(power[0], 1e8 * solid, 1e-6);
    EXPECT_REL(power[1], 2e8 * solid, 1e-6);
    normal[0] = normal[2] = 0, normal[1] = 1;
    fiv_environment_irradiance(rgb, e, normal);
    EXPECT_REL(rgb[0], 1e8 * solid * (double)direction[1], 1e-6);
    fiv_environment_destroy(e);
}

TEST(irradiance_is_the_sum_over_the_lights)
{
    fiv_environment *e = test_environment(300, 400);
    test_lights l = test_get_lights(e);
    uint64_t seed = 1;
    int k, c, turned;
    double worst = 0, scale = 0, vector[9];
    float rotation[9], axis[3] = {0.6f, 0.8f, 0}, fiv[9];
    size_t i;
    for (turned = 0; turned < 2; turned++) {
        if (turned) {
            test_rotation(rotation, axis, 1.1);
            EXPECT_EQ(fiv_environment_update(e, NULL, rotation), SAT_OK);
            fiv_environment_lights(l.directions, l.powers, l.count, e);
        }
        for (k = 0; k < 100; k++) {
            static const float origin[3] = {0, 0, 0};
            float normal[3], rgb[3];
            double truth[3];
            test_random_unit(normal, &seed);
            fiv_environment_irradiance(rgb, e, normal);
            reference_irradiance(truth, NULL, l.directions, l.powers, l.count, origin, normal);
            for (c = 0; c < 3; c++) {
                double off = fabs((double)rgb[c] - truth[c]);
                worst = off > worst ? off : worst;
                scale = truth[c] > scale ? truth[c] : scale;
            }
        }
        EXPECT_NEAR(worst / scale, 0, turned ? 4e-3 : 1.5e-3);
        REPORT(turned ? "I_tot, turned: worst error" : "I_tot: worst error", worst / scale, "of the largest");
        memset(vector, 0, sizeof vector);
        for (i = 0; i < l.count; i++)
            for (c = 0; c < 3; c++)
                for (k = 0; k < 3; k++)
                    vector[3 * c + k] += (double)l.powers[3 * i + (size_t)c] * (double)l.directions[3 * i + (size_t)k];
        fiv_environment_vector(fiv, e);
        for (k = 0; k < 9; k++) EXPECT_NEAR(fiv[k], vector[k], 1e-5 * scale);
    }
    test_free_lights(&l);
    fiv_environment_destroy(e);
}

TEST(bad_pixels_are_counted)
{
    static float pixels[SKY_WIDTH * SKY_HEIGHT * 3];
    sat_image image = test_sky(pixels, 0);
    fiv_environment *e = NULL, *clean = NULL;
    fiv_environment_stats stats;
    fiv_environment_options o = fiv_environment_defaults();
    float up[3] = {0, 1, 0}, rgb[3], same[3];
    o.delta_ratio = 0;
    o.max_radiance = 50;
    pixels[10] = pixels[11] = 0, pixels[400] = 0, pixels[3000] = 50;
    EXPECT_EQ(fiv_environment_create(&clean, &image, &o, NULL), SAT_OK);
    pixels[10] = test_nan();
    pixels[11] = sat__float_from_bits(0xffc00000u);
    pixels[400] = -3;
    pixels[3000] = sat__float_from_bits(0x7f800000u);
    if (!EXPECT_EQ(fiv_environment_create(&e, &image, &o, &stats), SAT_OK)) return;
    EXPECT_EQ(stats.nan, 2);
    EXPECT_EQ(stats.negative, 1);
    EXPECT_EQ(stats.clamped, 1);
    fiv_environment_irradiance(rgb, e, up);
    fiv_environment_irradiance(same, clean, up);
    EXPECT(memcmp(rgb, same, sizeof rgb) == 0);
    fiv_environment_destroy(e);
    fiv_environment_destroy(clean);
}

/* One bright texel of an image with fewer texels than the cube: most patches that it covers hold no point of the image.
   Its light is its radiance times its solid angle all the same, whatever becomes a directional light. */
TEST(coarse_images)
{
    static const int sizes[4][2] = {{1, 1}, {5, 1}, {8, 4}, {15, 7}};
    static float pixels[15 * 7];
    int i, y, ratio, resolution;
    double pi = 3.14159265358979323846;
    for (i = 0; i < 4; i++)
        for (resolution = 8; resolution <= 16; resolution += 8)
            for (ratio = 0; ratio < 3; ratio++)
                for (y = 0; y < sizes[i][1]; y += 3) {
                    int width = sizes[i][0], height = sizes[i][1], k, negative = 0;
                    sat_image image = sat_image_f32(pixels, width, height, 1);
                    fiv_environment_options o = fiv_environment_defaults();
                    fiv_environment *e = NULL;
                    double all = 0, truth = 1000 * 2 * pi / width * (cos(pi * y / height) - cos(pi * (y + 1) / height));
                    test_lights l;
                    size_t n;
                    float vector[9];
                    memset(pixels, 0, sizeof pixels);
                    pixels[y * width + width / 3] = 1000;
                    o.resolution = resolution;
                    o.delta_ratio = ratio == 0 ? 100.0f : ratio == 1 ? 0.5f : 1e-30f;
                    if (!EXPECT_EQ(fiv_environment_create(&e, &image, &o, NULL), SAT_OK)) return;
                    l = test_get_lights(e);
                    for (n = 0; n < l.count; n++) all += (double)l.powers[3 * n], negative += !(l.powers[3 * n] >= 0);
                    EXPECT_EQ(negative, 0);
                    EXPECT_REL(all, truth, 0.05);
                    fiv_environment_vector(vector, e);
                    for (k = 0; k < 9; k++) EXPECT(fabsf(vector[k]) <= 1.01f * (float)truth);
                    test_free_lights(&l);
                    fiv_environment_destroy(e);
                }
}

/* A sun of 1e8 on one texel: split off or not, no sum may lose what lies beside it. */
TEST(sun_of_1e8)
{
    reference_mesh m = test_knot();
    fiv_occluder_options options = test_small_set();
    fiv_environment *e = test_shared_environment(1e8f, 0);
    fiv_occluder *o = test_shared_occluder(&m, &options);
    size_t i, s;
    double worst = 0;
    EXPECT_EQ(fiv_occluder_light(o, e, NULL), SAT_OK);
    for (s = 0; s < o->stats.samples; s += 13) {
        uint64_t rows[FIV__MAX_ROWS];
        double truth[9], sum[FIV__TERMS], largest = 0;
        int k;
        memset(truth, 0, sizeof truth);
        fiv__decode(rows, o->words + o->first[s], o->first[s + 1] - o->first[s], 6 * 32);
        for (i = 0; i < 6 * 32 * 32; i++) {
            const double *p = o->sums + (i / 32 * 33 + i % 32) * FIV__TERMS;
            float d[3];
            int c;
            if (!(rows[i / 32] >> (i % 32) & 1)) continue;
            (void)p;
            fiv__cube_direction(d, (int)(i / 1024), fiv__texel_coordinate((int)(i % 32), 32),
                                fiv__texel_coordinate((int)(i / 32 % 32), 32));
            fiv__normalise(d, d);
            for (c = 0; c < 3; c++)
                for (k = 0; k < 3; k++)
                    truth[3 * c + k] += (double)e->radiance[3 * i + (size_t)c] *
                                        fiv__texel_angle((int)(i % 32), (int)(i / 32 % 32), 32) * (double)d[k];
        }
        fiv__integrate(sum, o->sums, o->words + o->first[s], o->first[s + 1] - o->first[s], 32);
        for (k = 0; k < 9; k++) largest = fabs(truth[k]) > largest ? fabs(truth[k]) : largest;
        for (k = 0; k < 9; k++)
            if (largest > 0 && fabs(sum[k] - truth[k]) / largest > worst) worst = fabs(sum[k] - truth[k]) / largest;
    }
    REPORT("sun of 1e8 in the cube: worst relative error of a vector", worst, "");
    EXPECT_NEAR(worst, 0, 1e-6);
    reference_mesh_free(&m);
}

/* ---- masks ---- */

/* Texels of a mask that differ from rays; *set counts those that rays set. */
static int test_mask_errors(const fiv_occluder *lazy, const reference_scene *s, const float offset[3], int size,
                            int *set)
{
    uint64_t rows[FIV__MAX_ROWS];
    double origin[3], d[3];
    float direction[3];
    int row, x, k, wrong = 0;
    fiv__raster_mesh(rows, &lazy->mesh, offset, size, NULL);
    for (k = 0; k < 3; k++) origin[k] = -(double)offset[k];
    for (row = 0; row < 6 * size; row++)
        for (x = 0; x < size; x++) {
            int hit;
            fiv__cube_direction(direction, row / size, fiv__texel_coordinate(x, size),
                                fiv__texel_coordinate(row % size, size));
            for (k = 0; k < 3; k++) d[k] = (double)direction[k];
            hit = reference_occluded(s, origin, d);
            wrong += hit != (int)(rows[row] >> x & 1);
            *set += hit;
        }
    return wrong;
}

/* Masks seen from far, near, inside and within the tube; flip: clockwise triangles; open: every seventh triangle is
   missing. */
static void test_masks_of(const reference_mesh *m, int size, int flip, int open, int closed)
{
    static const float offsets[][3] = {
        {0, 0, 3},           {1.1f, 0.4f, -0.3f}, {0.2f, 0.1f, 0.3f}, {0.013f, 0.007f, -0.005f},
        {0.5f, -0.7f, 0.1f}, {-40, 3, 20},        {0.62f, 0, 0.02f}};
    static const float no_move[3] = {0, 0, 0};
    fiv_occluder_options o = test_small_set();
    fiv_occluder *lazy;
    fiv_occluder_stats stats;
    reference_scene s;
    unsigned *index = (unsigned *)malloc(3 * m->triangles * sizeof *index);
    size_t t, n = 0, i;
    int wrong = 0, set = 0;
    reference_mesh part = *m, unit = *m;
    for (t = 0; t < m->triangles; t++) {
        if (open && t % 7 == 3) continue;
        index[3 * n] = m->indices[3 * t], index[3 * n + 1] = m->indices[3 * t + (flip ? 2 : 1)];
        index[3 * n++ + 2] = m->indices[3 * t + (flip ? 1 : 2)];
    }
    part.indices = index;
    part.triangles = n;
    o.keep_masks = 0;
    o.lazy = 1;
    o.resolution = size;
    lazy = test_occluder(&part, &o, &stats);
    EXPECT_EQ(stats.closed, closed);
    EXPECT_EQ(stats.triangles, n);
    unit.positions = (float *)malloc(3 * m->vertices * sizeof(float));
    for (i = 0; i < 3 * m->vertices; i++)
        unit.positions[i] = (float)(((double)m->positions[i] - (double)stats.centre[i % 3]) / (double)stats.radius);
    memset(&s, 0, sizeof s);
    reference_add(&s, unit.positions, index, n, NULL, no_move, 1);
    reference_build(&s);
    for (i = 0; i < sizeof offsets / sizeof *offsets; i++) wrong += test_mask_errors(lazy, &s, offsets[i], size, &set);
    EXPECT(set > 100);
    EXPECT_NEAR(wrong, 0, set * 1e-5);
    reference_free(&s);
    fiv_occluder_destroy(lazy);
    free(unit.positions);
    free(index);
}

TEST(masks_equal_rays)
{
    reference_mesh knot = test_knot(), box = reference_box(0.4f, 0.3f, 0.7f), fine = reference_knot(3, 2, 150, 10, 0.2);
    test_masks_of(&knot, 32, 0, 0, 1);
    test_masks_of(&knot, 32, 1, 0, 1);
    test_masks_of(&knot, 32, 0, 1, 0);
    test_masks_of(&knot, 64, 0, 0, 1);
    test_masks_of(&knot, 8, 0, 0, 1);
    test_masks_of(&box, 32, 0, 0, 1);
    test_masks_of(&box, 27, 1, 1, 0);
    test_masks_of(&fine, 32, 0, 0, 1);
    reference_mesh_free(&knot);
    reference_mesh_free(&box);
    reference_mesh_free(&fine);
}

TEST(spans_hold_any_mask)
{
    uint64_t seed = 5, rows[FIV__MAX_ROWS], back[FIV__MAX_ROWS];
    uint16_t words[FIV__MAX_WORDS];
    int size, kind, row;
    for (size = 8; size <= 64; size += 8)
        for (kind = 0; kind < 6; kind++) {
            uint64_t full = size == 64 ? ~(uint64_t)0 : ((uint64_t)1 << size) - 1;
            size_t n;
            for (row = 0; row < 6 * size; row++) {
                uint64_t noise = support_random(&seed);
                rows[row] = full & (kind == 0   ? 0
                                    : kind == 1 ? full
                                    : kind == 2 ? noise
                                    : kind == 3 ? 0x5555555555555555u
                                    : kind == 4 ? (row % 40 == 39 ? noise : 0)
                                                : noise & noise << 1 & noise << 2);
            }
            n = fiv__encode(words, rows, 6 * size);
            EXPECT(n <= FIV__MAX_WORDS);
            fiv__decode(back, words, n, 6 * size);
            EXPECT(memcmp(rows, back, (size_t)(6 * size) * sizeof *rows) == 0);
        }
}

/* FIV(mask) + FIV(not mask) = FIV(everything). */
TEST(mask_and_complement_make_the_whole)
{
    fiv_environment *e = test_shared_environment(0, 400);
    uint64_t seed = 9, rows[FIV__MAX_ROWS];
    uint16_t words[FIV__MAX_WORDS];
    int round, row, k;
    for (round = 0; round < 10; round++) {
        double a[FIV__TERMS], b[FIV__TERMS];
        for (row = 0; row < 192; row++) rows[row] = support_random(&seed) & 0xffffffffu;
        fiv__integrate(a, e->sums, words, fiv__encode(words, rows, 192), 32);
        for (row = 0; row < 192; row++) rows[row] ^= 0xffffffffu;
        fiv__integrate(b, e->sums, words, fiv__encode(words, rows, 192), 32);
        for (k = 0; k < 9; k++) EXPECT_NEAR(a[k] + b[k], e->vector[k], 1e-6 * e->flux[0]);
        EXPECT_REL(a[9] + b[9], 12.566370614359172, 1e-12);
    }
}

/* ---- receivers ---- */

typedef struct test_scene {
    reference_mesh mesh;
    fiv_environment *environment;
    fiv_occluder *occluder;
    fiv_occluder_stats stats;
    reference_scene truth;
} test_scene;

/* The knot at a position, twice when `second` is given, lit and with its ground truth. */
static void test_open_scene(test_scene *s, float sun, const fiv_occluder_options *options, const float *first,
                            const float *second)
{
    memset(s, 0, sizeof *s);
    s->mesh = test_knot();
    s->environment = test_shared_environment(sun, 400);
    s->occluder = test_shared_occluder(&s->mesh, options);
    s->stats = fiv_occluder_get_stats(s->occluder);
    EXPECT_EQ(fiv_occluder_light(s->occluder, s->environment, NULL), SAT_OK);
    reference_add(&s->truth, s->mesh.positions, s->mesh.indices, s->mesh.triangles, NULL, first, 1);
    if (second) reference_add(&s->truth, s->mesh.positions, s->mesh.indices, s->mesh.triangles, NULL, second, 1);
    reference_build(&s->truth);
}

static void test_close_scene(test_scene *s)
{
    reference_free(&s->truth);
    reference_mesh_free(&s->mesh);
}

enum { SIDE = 24, COUNT = SIDE * SIDE };

/* The knot stands on the plane, as the bunny in figure 18. */
TEST(shadow_on_a_plane)
{
    static const float where[3] = {0, 0.66f, 0};
    static float points[3 * COUNT], normals[3 * COUNT], truth[3 * COUNT];
    static const float suns[2] = {0, 2000};
    int i;
    for (i = 0; i < 2; i++) {
        test_scene s;
        fiv_instance instance;
        double error[4];
        int a;
        test_open_scene(&s, suns[i], NULL, where, NULL);
        instance = test_instance(s.occluder, where[0], where[1], where[2]);
        test_plane(points, normals, SIDE, 6, 0);
        test_truth(truth, &s.truth, s.environment, points, normals, COUNT);
        for (a = 0; a < 4; a++) {
            error[a] = test_nrmse(truth, points, normals, COUNT, s.environment, &instance, 1, (fiv_accuracy)a);
            REPORT(a == 0   ? "plane: nearest"
                   : a == 1 ? "plane: trilinear"
                   : a == 2 ? "plane: scaled"
                            : "plane: masks",
                   error[a], "NRMSE");
        }
        EXPECT(error[2] < (i ? 0.06 : 0.02));
        EXPECT(error[2] < error[1] && error[1] < error[0]);
        EXPECT(error[3] < (i ? 0.06 : 0.02));
        test_close_scene(&s);
    }
}

/* Objects that stand on a plane: receivers near contact get masks of their own, suns get rays. The box's plane also at
   gap 0, where receivers lie in its lowest face. */
static void test_resting(const reference_mesh *m, float low, float gap, float sun, float width, double bound,
                         double view_bound)
{
    static float points[3 * COUNT], normals[3 * COUNT], truth[3 * COUNT];
    static const float origin[3] = {0, 0, 0};
    fiv_environment *e = test_shared_environment(sun, 400);
    fiv_irradiance_options io = fiv_irradiance_defaults();
    int big;
    reference_scene scene;
    double error[2];
    memset(&scene, 0, sizeof scene);
    reference_add(&scene, m->positions, m->indices, m->triangles, NULL, origin, 1);
    reference_build(&scene);
    io.penumbra = 0; /* as the rays have it */
    io.own_triangles = 20000;
    test_plane(points, normals, SIDE, width, low);
    for (big = 0; big < 2; big++) {
        fiv_occluder_options options = fiv_occluder_defaults();
        fiv_occluder_stats stats;
        fiv_irradiance_stats made;
        fiv_occluder *o;
        fiv_instance instance;
        static float rgb[3 * COUNT], views[3 * COUNT], none[3 * COUNT];
        double by_views;
        size_t i;
        if (big) options.theta = 48, options.phi = 25, options.rho = 20;
        o = test_shared_occluder(m, &options);
        stats = fiv_occluder_get_stats(o);
        EXPECT_EQ(fiv_occluder_light(o, e, NULL), SAT_OK);
        instance = test_instance(o, 0, 0, 0);
        if (!big) {
            for (i = 0; i < COUNT; i++) points[3 * i + 1] = low - (gap > 0 ? gap : 1e-4f) * stats.radius;
            test_truth(truth, &scene, e, points, normals, COUNT);
            for (i = 0; i < COUNT; i++) points[3 * i + 1] = low - gap * stats.radius;
        }
        EXPECT_EQ(fiv_irradiance(rgb, points, normals, COUNT, e, &instance, 1, &io, &made), SAT_OK);
        error[big] = reference_nrmse(truth, rgb, COUNT);
        EXPECT(made.own_masks > 0 && made.own_masks < COUNT);
        EXPECT(sun > 0 ? made.rays > 0 && made.rays < COUNT / 4 : made.rays == 0);
        REPORT(big ? "resting, 48x25x20" : "resting, 32x17x15", error[big], "NRMSE");
        io.own_masks = 0;
        EXPECT_EQ(fiv_irradiance(views, points, normals, COUNT, e, &instance, 1, &io, &made), SAT_OK);
        EXPECT(made.own_masks == 0 && made.contacts > 0 && made.contacts < COUNT);
        by_views = reference_nrmse(truth, views, COUNT);
        REPORT("resting, views instead", by_views, "NRMSE");
        EXPECT(by_views <= view_bound);
        io.contact = 0;
        EXPECT_EQ(fiv_irradiance(none, points, normals, COUNT, e, &instance, 1, &io, &made), SAT_OK);
        EXPECT(made.own_masks == 0 && made.contacts == 0);
        REPORT("resting, interpolated", reference_nrmse(truth, none, COUNT), "NRMSE");
        EXPECT(reference_nrmse(truth, none, COUNT) > 3 * error[big]);
        EXPECT(reference_nrmse(truth, none, COUNT) > 1.5 * by_views);
        io.own_masks = 64;
        io.contact = 1;
    }
    EXPECT(error[0] <= bound);
    EXPECT(error[1] < error[0]);
    reference_free(&scene);
}

TEST(resting_objects)
{
    reference_mesh box = reference_box(0.5f, 0.3f, 0.4f), knot = test_knot();
    float low = 0;
    size_t i;
    for (i = 0; i < knot.vertices; i++) low = knot.positions[3 * i + 1] < low ? knot.positions[3 * i + 1] : low;
    test_resting(&box, -0.3f, 0, 0, 2, 0.012, 0.012);
    test_resting(&box, -0.3f, 0.002f, 2000, 2, 0.012, 0.012);
    box.triangles = 10; /* open at a side: its lowest triangles lie in the plane of the receivers and still cover it */
    test_resting(&box, -0.3f, 0, 0, 2, 0.012, 0.012);
    test_resting(&knot, low, 0, 2000, 4, 0.012, 0.012);
    test_resting(&knot, low, 0.002f, 0, 4, 0.012, 0.012);
    reference_mesh_free(&box);
    reference_mesh_free(&knot);
}

/* Near contact and on the mesh itself the views see the mesh from anywhere: inside a closed box nothing is left, above
   a floor beside it no more is taken than of the floor's own half. Shares see the same; a side of 8 to 256 will do. */
TEST(views_from_anywhere)
{
    static const int sides[6] = {8, 64, 256, 8, 64, 256};
    static const float half[3] = {0.5f, 0.3f, 0.4f};
    reference_mesh box = reference_box(0.5f, 0.3f, 0.4f);
    unsigned thrice[3][36];
    fiv_environment *e = test_shared_environment(0, 0);
    uint64_t seed = 3;
    int i, k, n;
    for (k = 0; k < 3; k++) memcpy(thrice[k], box.indices, sizeof thrice[k]);
    free(box.indices);
    box.indices = thrice[0];
    for (i = 0; i < 6; i++) { /* few triangles: rays along the views; each three times: depth maps */
        fiv_occluder_options options = test_small_set();
        fiv_irradiance_options io = fiv_irradiance_defaults();
        fiv_occluder *o, *shared;
        fiv_instance instance;
        fiv_occluder_stats stats;
        float turn[9] = {0.6f, 0, 0.8f, 0, 1, 0, -0.8f, 0, 0.6f};
        box.triangles = i < 3 ? 36 : 12;
        options.contact_map = sides[i];
        io.own_masks = 0;
        io.cutoff = 0;
        o = test_occluder(&box, &options, &stats);
        EXPECT(stats.closed);
        EXPECT_EQ(stats.map_bytes, 512u * 512 * 2 + (i < 3 ? 384u * (size_t)(sides[i] * sides[i]) : 0));
        EXPECT_EQ(fiv_occluder_light(o, e, NULL), SAT_OK);
        EXPECT_EQ(fiv_occluder_share(&shared, o), SAT_OK);
        EXPECT_EQ(fiv_occluder_light(shared, e, turn), SAT_OK);
        for (n = 0; n < 200; n++) {
            float p[3], turned[3], normal[3], rgb[3], own[3], open[3];
            fiv_irradiance_stats made;
            test_random_unit(normal, &seed);
            for (k = 0; k < 3; k++) p[k] = (float)(1.6 * support_uniform(&seed) - 0.8) * half[k];
            fiv_environment_irradiance(open, e, normal);
            instance = test_instance(n & 1 ? shared : o, 0, 0, 0);
            fiv__turn(turned, instance.occluder->rotation, p);
            EXPECT_EQ(fiv_irradiance(rgb, turned, normal, 1, e, &instance, 1, &io, &made), SAT_OK);
            if (sides[i] >= 64 || i >= 3)
                EXPECT(rgb[0] <= (i < 3 ? 0.02f : 1e-6f) * open[0] && made.contacts == 1);
            for (k = 0; k < 3; k++) p[k] *= 1.6f; /* without the walls, and beyond them */
            EXPECT_EQ(fiv_irradiance(rgb, p, normal, 1, e, &instance, 1, &io, NULL), SAT_OK);
            io.contact = 0;
            EXPECT_EQ(fiv_irradiance(own, p, normal, 1, e, &instance, 1, &io, NULL), SAT_OK);
            io.contact = 1;
            for (k = 0; k < 3; k++) EXPECT(rgb[k] >= 0 && rgb[k] <= open[k] * 1.0001f);
        }
        fiv_occluder_destroy(shared);
        fiv_occluder_destroy(o);
    }
    free(box.positions);
}

/* A bare sun's edge is that of the rays: at every receiver but those whose ray grazes an edge. */
TEST(suns_have_edges)
{
    static float points[3 * COUNT], normals[3 * COUNT], truth[3 * COUNT], rgb[3 * COUNT],
        pixels[SKY_WIDTH * SKY_HEIGHT * 3];
    static const float where[3] = {0.1f, 0.7f, -0.2f}, axis[3] = {0.6f, 0, 0.8f};
    sat_image image = sat_image_f32(pixels, SKY_WIDTH, SKY_HEIGHT, 3);
    fiv_occluder_options options = test_small_set();
    fiv_environment *e = NULL;
    fiv_instance instance;
    reference_mesh m = test_knot();
    reference_scene scene;
    fiv_occluder *o, *shared = NULL;
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_irradiance_stats stats;
    float turn[9];
    int c, i, pass, differ;
    memset(&scene, 0, sizeof scene);
    memset(pixels, 0, sizeof pixels);
    for (c = 0; c < 3; c++) pixels[3 * (12 * SKY_WIDTH + 50) + c] = 1000;
    EXPECT_EQ(fiv_environment_create(&e, &image, NULL, NULL), SAT_OK);
    test_rotation(turn, axis, 0.7);
    io.penumbra = 0;
    o = test_shared_occluder(&m, &options);
    EXPECT_EQ(fiv_occluder_share(&shared, o), SAT_OK);
    EXPECT_EQ(fiv_occluder_light(shared, e, turn), SAT_OK);
    reference_add(&scene, m.positions, m.indices, m.triangles, turn, where, 0.8f);
    reference_build(&scene);
    instance = test_instance(shared, where[0], where[1], where[2]);
    instance.scale = 0.8f;
    for (pass = 0; pass < 2; pass++) {
        test_plane(points, normals, SIDE, 4, pass ? -1 : -0.6f);
        test_truth(truth, &scene, e, points, normals, COUNT);
        EXPECT_EQ(fiv_irradiance(rgb, points, normals, COUNT, e, &instance, 1, &io, &stats), SAT_OK);
        for (i = 0, differ = 0; i < COUNT; i++)
            differ += fabsf(rgb[3 * i] - truth[3 * i]) > 1e-3f * truth[3 * i] + 1e-6f;
        REPORT("receivers of 576 on the wrong side of a sun's edge", differ, "");
        EXPECT(differ <= 1);
        EXPECT(stats.rays > 0 && stats.rays < COUNT / 2);
    }
    fiv_occluder_destroy(shared);
    reference_free(&scene);
    reference_mesh_free(&m);
    fiv_environment_destroy(e);
}

/* A light's disc past the silhouette: against rays to points all over it. The sun is a texel 2.8 degrees wide. */
TEST(penumbra_of_a_disc)
{
    enum { ACROSS = 24 };
    static const float where[3] = {0, 1.2f, 0};
    static float points[3 * COUNT], normals[3 * COUNT], truth[3 * COUNT], rgb[3 * COUNT],
        directions[3 * ACROSS * ACROSS], powers[3 * ACROSS * ACROSS], pixels[SKY_WIDTH * SKY_HEIGHT * 3];
    sat_image image = sat_image_f32(pixels, SKY_WIDTH, SKY_HEIGHT, 3);
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_occluder_options oo = test_small_set();
    reference_mesh m = test_knot();
    reference_scene scene;
    fiv_environment *e = NULL;
    fiv_instance instance;
    fiv_occluder *o;
    double error[2];
    float axes[3][3];
    int i, j, k, n = 0, pass;
    memset(&scene, 0, sizeof scene);
    memset(pixels, 0, sizeof pixels);
    for (k = 0; k < 3; k++) pixels[3 * (12 * SKY_WIDTH + 50) + k] = 1000;
    EXPECT_EQ(fiv_environment_create(&e, &image, NULL, NULL), SAT_OK);
    EXPECT_EQ(fiv_environment_get_stats(e).lights, 1);
    EXPECT_NEAR(e->lights[0].radius, 0.023, 0.004); /* the texel is 0.049 x 0.027 there: a disc of that variance */
    fiv__light_frame(axes, e->lights[0].direction);
    for (j = 0; j < ACROSS; j++)
        for (i = 0; i < ACROSS; i++) {
            float u = (2 * (float)i + 1) / ACROSS - 1, v = (2 * (float)j + 1) / ACROSS - 1;
            float t = tanf(e->lights[0].radius);
            if (u * u + v * v > 1) continue;
            for (k = 0; k < 3; k++) directions[3 * n + k] = axes[2][k] + t * (u * axes[0][k] + v * axes[1][k]);
            fiv__normalise(directions + 3 * n, directions + 3 * n);
            n++;
        }
    for (i = 0; i < 3 * n; i++) powers[i] = e->lights[0].power[i % 3] / (float)n;
    o = test_shared_occluder(&m, &oo);
    EXPECT_EQ(fiv_occluder_light(o, e, NULL), SAT_OK);
    reference_add(&scene, m.positions, m.indices, m.triangles, NULL, where, 1);
    reference_build(&scene);
    instance = test_instance(o, where[0], where[1], where[2]);
    test_plane(points, normals, SIDE, 4, -0.5f);
    for (i = 0; i < COUNT; i++) {
        double sum[3];
        reference_irradiance(sum, &scene, directions, powers, (size_t)n, points + 3 * i, normals + 3 * i);
        for (k = 0; k < 3; k++) truth[3 * i + k] = (float)sum[k];
    }
    for (pass = 0; pass < 2; pass++) {
        io.penumbra = pass ? 0.0f : 1.0f;
        EXPECT_EQ(fiv_irradiance(rgb, points, normals, COUNT, e, &instance, 1, &io, NULL), SAT_OK);
        error[pass] = reference_nrmse(truth, rgb, COUNT);
        REPORT(pass ? "a disc's shadow: as of a point" : "a disc's shadow: percentage closer", error[pass], "NRMSE");
    }
    EXPECT(error[0] < 0.03 && error[0] < 0.35 * error[1]);
    fiv_environment_destroy(e);
    reference_free(&scene);
    reference_mesh_free(&m);
}

/* Twenty equal lamps stay twenty lights, each with its shadow; of forty, those that stay in the cube are spread over a
   texel. */
TEST(twenty_lamps)
{
    static const float where[3] = {0, 0.6f, 0};
    static float points[3 * COUNT], normals[3 * COUNT], truth[3 * COUNT], rgb[3 * COUNT],
        pixels[SKY_WIDTH * SKY_HEIGHT * 3];
    sat_image image = sat_image_f32(pixels, SKY_WIDTH, SKY_HEIGHT, 3);
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_environment_options eo = fiv_environment_defaults();
    reference_mesh m = test_knot();
    fiv_occluder_options oo = test_small_set();
    fiv_occluder *o = test_shared_occluder(&m, &oo);
    fiv_instance instance = test_instance(o, where[0], where[1], where[2]);
    reference_scene scene;
    int lamps, i, pass;
    double error[2];
    io.penumbra = 0;
    memset(&scene, 0, sizeof scene);
    reference_add(&scene, m.positions, m.indices, m.triangles, NULL, where, 1);
    reference_build(&scene);
    test_plane(points, normals, SIDE, 5, -0.4f);
    for (lamps = 20; lamps <= 40; lamps += 20) {
        fiv_environment *all = NULL;
        memset(pixels, 0, sizeof pixels);
        for (i = 0; i < 3 * lamps; i++) {
            int lamp = i / 3, x = 6 * (lamp / 4) + lamp * 37 % 64, y = 8 + 5 * (lamp % 4);
            pixels[3 * (y * SKY_WIDTH + x) + i % 3] = 1000;
        }
        EXPECT_EQ(fiv_environment_create(&all, &image, NULL, NULL), SAT_OK);
        EXPECT_EQ(fiv_environment_get_stats(all).lights, lamps < FIV_MAX_LIGHTS ? lamps : FIV_MAX_LIGHTS);
        for (pass = 0; pass < 2; pass++) {
            fiv_environment *e = NULL;
            eo.max_lights = pass ? 8 : FIV_MAX_LIGHTS;
            EXPECT_EQ(fiv_environment_create(&e, &image, &eo, NULL), SAT_OK);
            EXPECT_EQ(fiv_occluder_light(o, e, NULL), SAT_OK);
            if (!pass) test_truth(truth, &scene, e, points, normals, COUNT);
            EXPECT_EQ(fiv_irradiance(rgb, points, normals, COUNT, e, &instance, 1, &io, NULL), SAT_OK);
            error[pass] = reference_nrmse(truth, rgb, COUNT);
            REPORT(pass ? "lamps, 8 of them split off" : lamps == 20 ? "20 lamps" : "40 lamps", error[pass], "NRMSE");
            fiv_environment_destroy(e);
        }
        EXPECT(lamps > 20 ? error[0] < error[1] : error[0] < 1e-3);
        fiv_environment_destroy(all);
    }
    reference_free(&scene);
    reference_mesh_free(&m);
}

/* A row of receivers half a hundredth of R apart, across the foot of a box, with normals that rock: few masks, and
   nearly what each has by its own. */
TEST(receivers_in_a_row_share_masks)
{
    enum { ALONG = 640 };
    static float points[3 * ALONG], normals[3 * ALONG], rgb[3][3 * ALONG];
    reference_mesh m = reference_box(0.5f, 0.3f, 0.4f);
    fiv_occluder_options oo = test_small_set();
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_environment *e = test_shared_environment(0, 400);
    fiv_occluder *o = test_shared_occluder(&m, &oo);
    fiv_instance instance = test_instance(o, 0, 0.3f, 0);
    fiv_irradiance_stats each, shared, three;
    float worst = 0, largest = 0;
    int i;
    EXPECT_EQ(fiv_occluder_light(o, e, NULL), SAT_OK);
    for (i = 0; i < ALONG; i++) {
        points[3 * i] = 0.003f * (float)i - 0.96f, points[3 * i + 1] = -0.001f, points[3 * i + 2] = 0.42f;
        normals[3 * i] = 0.03f * sinf(0.2f * (float)i), normals[3 * i + 1] = 1, normals[3 * i + 2] = 0;
    }
    io.own_triangles = 20000;
    io.own_tolerance = 0;
    EXPECT_EQ(fiv_irradiance(rgb[0], points, normals, ALONG, e, &instance, 1, &io, &each), SAT_OK);
    io.own_tolerance = fiv_irradiance_defaults().own_tolerance;
    EXPECT_EQ(fiv_irradiance(rgb[1], points, normals, ALONG, e, &instance, 1, &io, &shared), SAT_OK);
    io.threads = support_threads(3);
    EXPECT_EQ(fiv_irradiance(rgb[2], points, normals, ALONG, e, &instance, 1, &io, &three), SAT_OK);
    EXPECT(memcmp(rgb[1], rgb[2], sizeof rgb[1]) == 0);
    EXPECT_EQ(each.own_masks, each.own_receivers);
    EXPECT_EQ(shared.own_receivers, each.own_receivers);
    EXPECT_EQ(shared.own_masks, three.own_masks);
    for (i = 0; i < 3 * ALONG; i++) {
        worst = fmaxf(worst, fabsf(rgb[1][i] - rgb[0][i]));
        largest = fmaxf(largest, rgb[0][i]);
    }
    REPORT("receivers in a row: masks a receiver", (double)shared.own_masks / (double)shared.own_receivers, "");
    REPORT("receivers in a row: worst difference to own masks", (double)(worst / largest), "of the largest");
    EXPECT(worst <= 0.01f * largest);
    EXPECT(3 * shared.own_masks < shared.own_receivers);
    reference_mesh_free(&m);
}

/* own_masks bounds the receivers of each 64 in a row, whatever the order of the instances; published accuracies take
   none. */
TEST(own_masks_are_bounded)
{
    static float points[3 * COUNT], normals[3 * COUNT], rgb[2][3 * COUNT];
    reference_mesh m = reference_box(0.5f, 0.3f, 0.4f);
    fiv_occluder_options options = test_small_set();
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_environment *e = test_shared_environment(2000, 400);
    fiv_instance instances[2], swapped[2];
    fiv_irradiance_stats stats, last;
    fiv_occluder *o;
    int bound;
    o = test_shared_occluder(&m, &options);
    EXPECT_EQ(fiv_occluder_light(o, e, NULL), SAT_OK);
    instances[0] = swapped[1] = test_instance(o, -0.3f, 0.3f, 0);
    instances[1] = swapped[0] = test_instance(o, 0.4f, 0.35f, 0.2f);
    test_plane(points, normals, SIDE, 2, 0);
    memset(&last, 0, sizeof last);
    io.penumbra = 0;
    for (bound = 0; bound <= 64; bound += 16) {
        io.own_masks = bound;
        EXPECT_EQ(fiv_irradiance(rgb[0], points, normals, COUNT, e, instances, 2, &io, &stats), SAT_OK);
        EXPECT_EQ(fiv_irradiance(rgb[1], points, normals, COUNT, e, swapped, 2, &io, NULL), SAT_OK);
        EXPECT(test_same(rgb[0], rgb[1], 3 * COUNT));
        EXPECT(stats.own_receivers <= (size_t)(2 * bound * (COUNT / 64)));
        EXPECT(stats.own_masks <= stats.own_receivers);
        EXPECT(bound ? stats.own_receivers >= last.own_receivers : stats.own_receivers == 0);
        last = stats;
        io.threads = support_threads(3);
        EXPECT_EQ(fiv_irradiance(rgb[1], points, normals, COUNT, e, instances, 2, &io, &stats), SAT_OK);
        EXPECT(memcmp(rgb[0], rgb[1], sizeof rgb[0]) == 0);
        EXPECT_EQ(stats.own_masks, last.own_masks);
        memset(&io.threads, 0, sizeof io.threads);
    }
    EXPECT(last.own_masks > 64);
    io.accuracy = FIV_TRILINEAR;
    EXPECT_EQ(fiv_irradiance(rgb[0], points, normals, COUNT, e, instances, 2, &io, &stats), SAT_OK);
    EXPECT(stats.own_masks == 0 && stats.rays == 0);
    io.accuracy = FIV_SCALED;
    io.own_triangles = 11;
    EXPECT_EQ(fiv_irradiance(rgb[0], points, normals, COUNT, e, instances, 2, &io, &stats), SAT_OK);
    EXPECT(stats.own_masks == 0 && stats.rays > 0);
    io.own_masks = 65;
    EXPECT_EQ(fiv_irradiance(rgb[0], points, normals, COUNT, e, instances, 2, &io, NULL), SAT_ERR_ARGUMENT);
    io.own_masks = -1;
    EXPECT_EQ(fiv_irradiance(rgb[0], points, normals, COUNT, e, instances, 2, &io, NULL), SAT_ERR_ARGUMENT);
    reference_mesh_free(&m);
}

/* One point light: the shadow is a step in space (figure 19, left: 0.1). */
TEST(point_light)
{
    static const float where[3] = {0, 0.9f, 0};
    static float points[3 * COUNT], normals[3 * COUNT], truth[3 * COUNT], pixels[SKY_WIDTH * SKY_HEIGHT * 3];
    sat_image image = sat_image_f32(pixels, SKY_WIDTH, SKY_HEIGHT, 3);
    test_scene s;
    fiv_instance instance;
    double error;
    int c;
    test_open_scene(&s, 0, NULL, where, NULL);
    s.environment = test_environment(0, 400);
    memset(pixels, 0, sizeof pixels);
    for (c = 0; c < 3; c++) pixels[3 * (12 * SKY_WIDTH + 50) + c] = 1000;
    EXPECT_EQ(fiv_environment_update(s.environment, &image, NULL), SAT_OK);
    EXPECT_EQ(fiv_environment_get_stats(s.environment).lights, 1);
    EXPECT_EQ(fiv_occluder_light(s.occluder, s.environment, NULL), SAT_OK);
    instance = test_instance(s.occluder, where[0], where[1], where[2]);
    test_plane(points, normals, SIDE, 5, 0);
    test_truth(truth, &s.truth, s.environment, points, normals, COUNT);
    error = test_nrmse(truth, points, normals, COUNT, s.environment, &instance, 1, FIV_SCALED);
    REPORT("point light through a thin knot, 32x17x15", error, "NRMSE");
    EXPECT(error < 0.16);
    fiv_environment_destroy(s.environment);
    test_close_scene(&s);
}

/* What a horizon leaves of an occluder, d above it: against (d + R) / 2R. */
TEST(partial_occluders)
{
    static const float origin[3] = {0, 0, 0}, heights[4] = {0.6f, 0.3f, 0, -0.4f};
    fiv_occluder_options options = fiv_occluder_defaults();
    test_scene s;
    test_lights lights;
    int h, i, k;
    test_open_scene(&s, 0, &options, origin, NULL);
    lights = test_get_lights(s.environment);
    for (h = 0; h < 4; h++) {
        double square[4] = {0, 0, 0, 0};
        uint64_t seed = 17;
        for (i = 0; i < 150; i++) {
            float n[3], t[3], p[3], rgb[3], open[3], cosine;
            double truth[3], r = (double)s.stats.radius * (1.3 + 1.5 * support_uniform(&seed));
            fiv_instance instance = test_instance(s.occluder, 0, 0, 0);
            int a;
            test_random_unit(n, &seed);
            test_random_unit(t, &seed);
            cosine = fiv__dot(n, t);
            for (k = 0; k < 3; k++) t[k] -= cosine * n[k];
            fiv__normalise(t, t);
            for (k = 0; k < 3; k++) p[k] = s.stats.centre[k] - (float)r * t[k] - heights[h] * s.stats.radius * n[k];
            reference_irradiance(truth, &s.truth, lights.directions, lights.powers, lights.count, p, n);
            fiv_environment_irradiance(open, s.environment, n);
            for (a = 0; a < 4; a++) {
                fiv_irradiance_options o = fiv_irradiance_defaults();
                o.accuracy = (fiv_accuracy)a;
                o.cutoff = 0;
                if (a == 0) o.accuracy = FIV_TRILINEAR, o.partial = 0;
                EXPECT_EQ(fiv_irradiance(rgb, p, n, 1, s.environment, &instance, 1, &o, NULL), SAT_OK);
                for (k = 0; k < 3; k++) square[a] += pow(((double)rgb[k] - truth[k]) / (double)open[k], 2) / 450;
            }
        }
        printf("partial d = %+.1f R: rmse of the fraction: uncorrected %.4f, (d + R) / 2R %.4f, cap %.4f, masks %.4f\n",
               (double)heights[h], sqrt(square[0]), sqrt(square[1]), sqrt(square[2]), sqrt(square[3]));
        if (h < 3) EXPECT(square[2] <= 0.25 * square[1]);
        EXPECT(square[2] < square[1]);
        EXPECT(square[3] < square[1]);
    }
    test_free_lights(&lights);
    test_close_scene(&s);
}

TEST(two_occluders)
{
    static const float first[3] = {-0.6f, 0.7f, 0}, second[3] = {0.7f, 1.6f, 0.3f};
    static float points[3 * COUNT], normals[3 * COUNT], truth[3 * COUNT];
    fiv_occluder_options options = fiv_occluder_defaults();
    fiv_instance instances[2];
    test_scene s;
    double error[4];
    int a;
    options.theta = 48, options.phi = 25, options.rho = 20;
    test_open_scene(&s, 0, &options, first, second);
    instances[0] = test_instance(s.occluder, first[0], first[1], first[2]);
    instances[1] = test_instance(s.occluder, second[0], second[1], second[2]);
    test_plane(points, normals, SIDE, 6, 0);
    test_truth(truth, &s.truth, s.environment, points, normals, COUNT);
    for (a = 0; a < 4; a++) {
        error[a] = test_nrmse(truth, points, normals, COUNT, s.environment, instances, 2, (fiv_accuracy)a);
        REPORT(a == 0   ? "two: nearest"
               : a == 1 ? "two: trilinear, eq 14-15"
               : a == 2 ? "two: scaled"
                        : "two: masks",
               error[a], "NRMSE");
    }
    EXPECT(error[3] <= 0.5 * error[1]);
    EXPECT(error[2] < error[1]);
    test_close_scene(&s);
}

/* With the light, the occluder or both turned: as near to the truth as without. */
TEST(turning_light_and_occluder)
{
    static const float where[3] = {0, 1.8f, 0};
    static float points[3 * COUNT], normals[3 * COUNT], truth[3 * COUNT];
    float axis[3] = {0.48f, 0.6f, 0.64f}, light_turn[9], mesh_turn[9];
    int which;
    test_rotation(light_turn, axis, 0.9);
    test_rotation(mesh_turn, axis, -2.0);
    test_plane(points, normals, SIDE, 6, 0);
    for (which = 2; which < 4; which++) {
        test_scene s;
        fiv_instance instance;
        double error;
        test_open_scene(&s, 0, NULL, where, NULL);
        s.environment = test_environment(0, 400);
        reference_free(&s.truth);
        reference_add(&s.truth, s.mesh.positions, s.mesh.indices, s.mesh.triangles, which & 2 ? mesh_turn : NULL, where,
                      1);
        reference_build(&s.truth);
        EXPECT_EQ(fiv_environment_update(s.environment, NULL, which & 1 ? light_turn : NULL), SAT_OK);
        EXPECT_EQ(fiv_occluder_light(s.occluder, s.environment, which & 2 ? mesh_turn : NULL), SAT_OK);
        instance = test_instance(s.occluder, where[0], where[1], where[2]);
        test_truth(truth, &s.truth, s.environment, points, normals, COUNT);
        error = test_nrmse(truth, points, normals, COUNT, s.environment, &instance, 1, FIV_SCALED);
        REPORT(which == 2 ? "occluder turned" : "both turned", error, "NRMSE");
        EXPECT(error < 0.02);
        error = test_nrmse(truth, points, normals, COUNT, s.environment, &instance, 1, FIV_MASK);
        EXPECT(error < 0.02);
        fiv_environment_destroy(s.environment);
        test_close_scene(&s);
    }
}

/* Light, occluder and receivers turned together: nothing changes but the cube's orientation. */
TEST(turning_everything)
{
    static const float where[3] = {0, 0.8f, 0};
    static float points[3 * COUNT], normals[3 * COUNT], before[3 * COUNT], after[3 * COUNT];
    float axis[3] = {0.48f, 0.6f, 0.64f}, turn[9], moved[3];
    fiv_instance instance;
    test_scene s;
    fiv_occluder_options small = test_small_set();
    int a, i;
    test_rotation(turn, axis, 1.3);
    for (a = 1; a < 4; a++) {
        fiv_irradiance_options o = fiv_irradiance_defaults();
        o.accuracy = (fiv_accuracy)a;
        test_open_scene(&s, 3000, &small, where, NULL);
        s.environment = test_environment(3000, 400);
        EXPECT_EQ(fiv_occluder_light(s.occluder, s.environment, NULL), SAT_OK);
        test_plane(points, normals, SIDE, 6, 0);
        instance = test_instance(s.occluder, where[0], where[1], where[2]);
        EXPECT_EQ(fiv_irradiance(before, points, normals, COUNT, s.environment, &instance, 1, &o, NULL), SAT_OK);
        EXPECT_EQ(fiv_environment_update(s.environment, NULL, turn), SAT_OK);
        EXPECT_EQ(fiv_occluder_light(s.occluder, s.environment, turn), SAT_OK);
        for (i = 0; i < COUNT; i++) {
            fiv__turn(points + 3 * i, turn, points + 3 * i);
            fiv__turn(normals + 3 * i, turn, normals + 3 * i);
        }
        fiv__turn(moved, turn, where);
        instance = test_instance(s.occluder, moved[0], moved[1], moved[2]);
        EXPECT_EQ(fiv_irradiance(after, points, normals, COUNT, s.environment, &instance, 1, &o, NULL), SAT_OK);
        EXPECT(reference_nrmse(before, after, COUNT) < 0.004);
        REPORT("everything turned: difference", reference_nrmse(before, after, COUNT), "NRMSE");
        fiv_environment_destroy(s.environment);
        test_close_scene(&s);
    }
}

/* Vectors of a turned occluder against those of a turned mesh, as a root mean square over samples. */
TEST(turned_vectors)
{
    static const float suns[2] = {0, 3000};
    float axis[3] = {0.6f, 0, 0.8f}, turn[9];
    int i;
    test_rotation(turn, axis, 0.7);
    for (i = 0; i < 2; i++) {
        reference_mesh m = test_knot(), turned = test_knot();
        fiv_environment *e = test_shared_environment(suns[i], 400);
        fiv_occluder_options options = test_small_set();
        fiv_occluder *a, *b;
        double off = 0, all = 0;
        size_t v;
        uint64_t seed = 2;
        int k, n;
        for (v = 0; v < m.vertices; v++) fiv__turn(turned.positions + 3 * v, turn, m.positions + 3 * v);
        options.keep_masks = 0;
        options.lazy = 1;
        a = test_occluder(&m, &options, NULL);
        b = test_occluder(&turned, &options, NULL);
        fiv_occluder_light(a, e, turn);
        fiv_occluder_light(b, e, NULL);
        for (n = 0; n < 100; n++) {
            uint64_t rows[FIV__MAX_ROWS];
            uint16_t words[FIV__MAX_WORDS];
            float offset[3], world[3], got[3];
            double x[FIV__TERMS], y[FIV__TERMS], part[3];
            test_random_unit(offset, &seed);
            for (k = 0; k < 3; k++) offset[k] *= 1.2f + 2 * (float)n / 100;
            fiv__turn(world, turn, offset);
            fiv__raster_mesh(rows, &a->mesh, offset, 32, NULL);
            fiv__integrate(x, a->sums, words, fiv__encode(words, rows, 192), 32);
            fiv__raster_mesh(rows, &b->mesh, world, 32, NULL);
            fiv__integrate(y, b->sums, words, fiv__encode(words, rows, 192), 32);
            for (k = 0; k < 9; k++) {
                if (k % 3 == 0) {
                    int j;
                    for (j = 0; j < 3; j++) got[j] = (float)x[k + j];
                    fiv__turn(got, turn, got);
                    for (j = 0; j < 3; j++) part[j] = (double)got[j];
                }
                off += pow(part[k % 3] - y[k], 2);
                all += y[k] * y[k];
            }
        }
        REPORT(i ? "turned vectors, sun split off" : "turned vectors", sqrt(off / all), "relative rms");
        EXPECT(sqrt(off / all) < 0.04 + 0.01 * i);
        fiv_occluder_destroy(a);
        fiv_occluder_destroy(b);
        reference_mesh_free(&m);
        reference_mesh_free(&turned);
    }
}

/* Any order of 2 to 8 occluders: the same bits; in 0 .. I_tot. */
TEST(order_of_occluders)
{
    static float points[3 * COUNT], normals[3 * COUNT], rgb[2][3 * COUNT];
    static const float origin[3] = {0, 0, 0};
    fiv_occluder_options options = test_small_set();
    fiv_instance instances[8], shuffled[8];
    fiv_occluder *turned = NULL;
    test_scene s;
    float axis[3] = {1, 0, 0}, turn[9];
    uint64_t seed = 11;
    int n, a, i, k;
    test_open_scene(&s, 2000, &options, origin, NULL);
    test_rotation(turn, axis, 0.8);
    EXPECT_EQ(fiv_occluder_share(&turned, s.occluder), SAT_OK);
    EXPECT_EQ(fiv_occluder_light(turned, s.environment, turn), SAT_OK);
    test_plane(points, normals, SIDE, 6, 0);
    for (i = 0; i < COUNT; i++) test_random_unit(normals + 3 * i, &seed);
    for (i = 0; i < 8; i++) {
        instances[i] = test_instance(i % 3 == 1 ? turned : s.occluder, 4 * (float)support_uniform(&seed) - 2,
                                     2 * (float)support_uniform(&seed), 4 * (float)support_uniform(&seed) - 2);
        instances[i].scale = 0.5f + (float)support_uniform(&seed);
    }
    for (a = 0; a < 4; a++)
        for (n = 2; n <= 8; n += a == 3 ? 3 : 1) {
            fiv_irradiance_options o = fiv_irradiance_defaults();
            fiv_irradiance_stats stats;
            o.accuracy = (fiv_accuracy)a;
            EXPECT_EQ(fiv_irradiance(rgb[0], points, normals, a == 3 ? 100 : COUNT, s.environment, instances, (size_t)n,
                                     &o, &stats),
                      SAT_OK);
            EXPECT(stats.overlaps > 0);
            memcpy(shuffled, instances, sizeof shuffled);
            for (i = n - 1; i > 0; i--) {
                fiv_instance swap = shuffled[i];
                k = support_below(&seed, i + 1);
                shuffled[i] = shuffled[k];
                shuffled[k] = swap;
            }
            EXPECT_EQ(fiv_irradiance(rgb[1], points, normals, a == 3 ? 100 : COUNT, s.environment, shuffled, (size_t)n,
                                     &o, NULL),
                      SAT_OK);
            EXPECT(test_same(rgb[0], rgb[1], a == 3 ? 300 : 3 * COUNT));
            for (i = 0; i < (a == 3 ? 100 : COUNT); i++) {
                float open[3];
                fiv_environment_irradiance(open, s.environment, normals + 3 * i);
                for (k = 0; k < 3; k++) EXPECT(rgb[0][3 * i + k] >= 0 && rgb[0][3 * i + k] <= open[k] * 1.00001f);
            }
        }
    fiv_occluder_destroy(turned);
    test_close_scene(&s);
}

/* Copies of one occluder in one place darken as much as one. */
TEST(copies_count_once)
{
    static float points[3 * COUNT], normals[3 * COUNT], one[3 * COUNT], three[3 * COUNT];
    static const float where[3] = {0, 0.9f, 0};
    fiv_occluder_options options = test_small_set();
    fiv_instance instances[3];
    test_scene s;
    int a, i;
    test_open_scene(&s, 2000, &options, where, NULL);
    test_plane(points, normals, SIDE, 6, 0);
    for (i = 0; i < 3; i++) instances[i] = test_instance(s.occluder, where[0], where[1], where[2]);
    for (a = 2; a < 4; a++) {
        fiv_irradiance_options o = fiv_irradiance_defaults();
        o.accuracy = (fiv_accuracy)a;
        fiv_irradiance(one, points, normals, COUNT, s.environment, instances, 1, &o, NULL);
        fiv_irradiance(three, points, normals, COUNT, s.environment, instances, 3, &o, NULL);
        for (i = 0; i < 3 * COUNT; i++) EXPECT_REL(three[i], one[i], 1e-6);
    }
    test_close_scene(&s);
}

#ifndef FIV_NO_MASKS
/* Anywhere around it, also where its nearest mask is below the horizon and the interpolated vector is not. */
TEST(the_same_occluder_twice_is_once)
{
    enum { AROUND = 4000 };
    static float points[3 * AROUND], normals[3 * AROUND], one[3 * AROUND], two[3 * AROUND];
    reference_mesh m = reference_knot(2, 3, 96, 12, 0.3);
    fiv_environment *e = test_shared_environment(0, 0);
    fiv_occluder_options options = test_small_set();
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_occluder *o;
    fiv_instance instances[2];
    uint64_t seed = 5;
    double worst = 0;
    int i;
    options.theta = 16, options.phi = 9, options.rho = 8;
    o = test_occluder(&m, &options, NULL);
    EXPECT_EQ(fiv_occluder_light(o, e, NULL), SAT_OK);
    instances[0] = instances[1] = test_instance(o, 0, 0, 0);
    for (i = 0; i < 3 * AROUND; i++) points[i] = (float)(8 * support_uniform(&seed) - 4);
    for (i = 0; i < AROUND; i++) test_random_unit(normals + 3 * i, &seed);
    io.accuracy = FIV_MASK;
    EXPECT_EQ(fiv_irradiance(one, points, normals, AROUND, e, instances, 1, &io, NULL), SAT_OK);
    EXPECT_EQ(fiv_irradiance(two, points, normals, AROUND, e, instances, 2, &io, NULL), SAT_OK);
    for (i = 0; i < 3 * AROUND; i++) worst = support_larger(worst, fabs((double)two[i] - (double)one[i]));
    REPORT("the same occluder twice: largest difference of irradiance", worst, "");
    EXPECT_NEAR(worst, 0, 2e-5);
    fiv_occluder_destroy(o);
    reference_mesh_free(&m);
}
#endif

#ifndef FIV_NO_SELF
/* Points on the mesh itself, against rays that start a hair above it. */
TEST(self_shadows)
{
    static const float origin[3] = {0, 0, 0};
    static float points[3 * 640], normals[3 * 640], truth[3 * 640], rgb[3 * 640];
    fiv_occluder_options options = fiv_occluder_defaults();
    fiv_instance self;
    test_scene s;
    size_t t;
    int a, k, j;
    test_open_scene(&s, 0, &options, origin, NULL);
    self = test_instance(s.occluder, 0, 0, 0);
    for (t = 0; t < s.mesh.triangles; t++) {
        float *p = points + 3 * t, *n = normals + 3 * t, corner[3][3], e[2][3];
        for (j = 0; j < 3; j++)
            memcpy(corner[j], s.mesh.positions + 3 * (size_t)s.mesh.indices[3 * t + (size_t)j], sizeof corner[j]);
        for (k = 0; k < 3; k++) e[0][k] = corner[1][k] - corner[0][k], e[1][k] = corner[2][k] - corner[0][k];
        for (k = 0; k < 3; k++) n[k] = e[0][(k + 1) % 3] * e[1][(k + 2) % 3] - e[0][(k + 2) % 3] * e[1][(k + 1) % 3];
        fiv__normalise(n, n);
        for (k = 0; k < 3; k++) n[k] *= s.occluder->mesh.turn;
        for (k = 0; k < 3; k++) p[k] = (corner[0][k] + corner[1][k] + corner[2][k]) / 3 + 1e-4f * n[k];
    }
    test_truth(truth, &s.truth, s.environment, points, normals, s.mesh.triangles);
    for (a = 1; a < 4; a++) {
        fiv_irradiance_options o = fiv_irradiance_defaults();
        double error, open = 0;
        static float unshadowed[3 * 640];
        o.accuracy = (fiv_accuracy)a;
        EXPECT_EQ(fiv_self_irradiance(rgb, points, normals, s.mesh.triangles, s.environment, &self, NULL, 0, &o, NULL),
                  SAT_OK);
        for (t = 0; t < s.mesh.triangles; t++)
            fiv_environment_irradiance(unshadowed + 3 * t, s.environment, normals + 3 * t);
        error = reference_nrmse(truth, rgb, s.mesh.triangles);
        open = reference_nrmse(truth, unshadowed, s.mesh.triangles);
        REPORT("self: without shadows", open, "NRMSE");
        REPORT(a == 1 ? "self: eq 13" : a == 2 ? "self: scaled" : "self: masks", error, "NRMSE");
        EXPECT(error < 0.7 * open);
        EXPECT(a < 2 || error < 0.1 * open);
        for (t = 0; t < 3 * s.mesh.triangles; t++) EXPECT(rgb[t] >= 0 && rgb[t] <= unshadowed[t] * 1.001f);
    }
    test_close_scene(&s);
}
#endif

/* ---- storage ---- */

TEST(half_octahedral_storage)
{
    static const float where[3] = {0, 0.8f, 0};
    static float points[3 * COUNT], normals[3 * COUNT], truth[3 * COUNT];
    fiv_occluder_options options = fiv_occluder_defaults();
    fiv_occluder_stats stats;
    test_scene s;
    double error[2];
    int storage;
    options.theta = 64, options.phi = 33, options.rho = 8, options.contact_map = 64;
    options.lazy = 1, options.keep_masks = 0; /* only those samples that the plane needs */
    test_open_scene(&s, 0, NULL, where, NULL);
    test_plane(points, normals, SIDE, 6, 0);
    test_truth(truth, &s.truth, s.environment, points, normals, COUNT);
    for (storage = 0; storage < 2; storage++) {
        fiv_occluder *o;
        fiv_instance instance;
        options.storage = (fiv_storage)storage;
        o = test_occluder(&s.mesh, &options, &stats);
        instance = test_instance(o, where[0], where[1], where[2]);
        EXPECT_EQ(fiv_occluder_light(o, s.environment, NULL), SAT_OK);
        EXPECT_EQ(fiv_occluder_prepare(o, NULL, &instance, 1, points, COUNT), SAT_OK);
        error[storage] = test_nrmse(truth, points, normals, COUNT, s.environment, &instance, 1, FIV_SCALED);
        fiv_occluder_destroy(o);
    }
    REPORT("longitude-latitude floats", error[0], "NRMSE");
    REPORT("octahedral half floats", error[1], "NRMSE");
    REPORT("memory of the vectors over the published", (double)stats.table_bytes / (36.0 * 64 * 33 * 8), "");
    EXPECT(error[1] <= 1.1 * error[0]);
    EXPECT((double)stats.table_bytes <= 0.3 * 36.0 * 64 * 33 * 8);
    test_close_scene(&s);
}

/* Every direction's cell: weights sum to one, and the eight offsets surround the point; also across seams and poles. */
TEST(cells_surround_their_point)
{
    uint64_t seed = 4;
    int octahedral, i, k, q;
    for (octahedral = 0; octahedral < 2; octahedral++) {
        fiv_occluder o;
        fiv_occluder_options options = fiv_occluder_defaults();
        options.storage = octahedral ? FIV_STORAGE_HALF_OCTAHEDRAL : FIV_STORAGE_FLOAT;
        memset(&o, 0, sizeof o);
        fiv__set_grid(&o, &options);
        for (i = 0; i < 2000; i++) {
            float c[3], sum = 0, mean[3] = {0, 0, 0}, reach = 0.31f + 5.6f * (float)support_uniform(&seed);
            fiv__cell cell;
            test_random_unit(c, &seed);
            if (i % 5 == 0) c[2] = i % 10 ? 1e-7f : -1e-7f;
            if (i % 7 == 0) c[0] = c[2] = i % 14 ? 0 : 1e-9f;
            fiv__normalise(c, c);
            for (k = 0; k < 3; k++) c[k] *= reach;
            fiv__locate(&cell, &o.grid, c);
            for (q = 0; q < 8; q++) {
                float offset[3];
                EXPECT(cell.index[q] < fiv__grid_samples(&o.grid));
                EXPECT(cell.weight[q] >= 0 && cell.weight[q] <= 1);
                fiv__sample_offset(offset, &o.grid, cell.index[q]);
                sum += cell.weight[q];
                for (k = 0; k < 3; k++) mean[k] += cell.weight[q] * offset[k];
            }
            EXPECT_NEAR(sum, 1, 1e-5);
            for (k = 0; k < 3; k++) EXPECT_NEAR(mean[k], c[k], 0.035 * (double)reach);
        }
        for (i = 0; i < (int)fiv__grid_samples(&o.grid); i += 3) {
            float a[3], b[3];
            fiv__sample_offset(a, &o.grid, (size_t)i);
            fiv__sample_offset(b, &o.grid, fiv__first_twin(&o.grid, (size_t)i));
            for (k = 0; k < 3; k++) EXPECT_NEAR(a[k], b[k], 1e-6 * (double)o.grid.last);
            EXPECT(fiv__first_twin(&o.grid, fiv__first_twin(&o.grid, (size_t)i)) ==
                   fiv__first_twin(&o.grid, (size_t)i));
        }
    }
}

#ifndef FIV_NO_MASKS
/* Receivers at the foot of two occluders, with own masks and rays: the same bits. */
static void test_resting_same(const fiv_occluder *a, const fiv_occluder *b, const fiv_environment *e)
{
    static float points[3 * COUNT], normals[3 * COUNT], rgb[2][3 * COUNT];
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_irradiance_stats stats;
    fiv_instance instance = test_instance(a, 0, 0, 0);
    io.penumbra = 0;
    test_plane(points, normals, SIDE, 3, -0.66f);
    for (io.own_triangles = 0; io.own_triangles <= 20000; io.own_triangles += 20000) {
        instance.occluder = a;
        EXPECT_EQ(fiv_irradiance(rgb[0], points, normals, COUNT, e, &instance, 1, &io, &stats), SAT_OK);
        EXPECT((io.own_triangles ? stats.own_masks : stats.contacts) > 0 && stats.rays > 0);
        instance.occluder = b;
        EXPECT_EQ(fiv_irradiance(rgb[1], points, normals, COUNT, e, &instance, 1, &io, NULL), SAT_OK);
        EXPECT(memcmp(rgb[0], rgb[1], sizeof rgb[0]) == 0);
    }
}

TEST(save_and_load)
{
    reference_mesh m = test_knot();
    fiv_occluder_options options = test_small_set();
    fiv_environment *e = test_shared_environment(2000, 400);
    int storage;
    options.rho = 4;
    for (storage = 0; storage < 2; storage++) {
        fiv_occluder *o, *back = NULL;
        size_t size, i;
        unsigned char *bytes;
        options.storage = (fiv_storage)storage;
        o = test_occluder(&m, &options, NULL);
        size = fiv_occluder_save_size(o);
        bytes = (unsigned char *)malloc(size + 1);
        EXPECT_EQ(fiv_occluder_save(bytes, size - 1, o), SAT_ERR_ARGUMENT);
        EXPECT_EQ(fiv_occluder_save(bytes, size, o), SAT_OK);
        EXPECT_EQ(fiv_occluder_load(&back, bytes, size, NULL), SAT_OK);
        fiv_occluder_light(o, e, NULL);
        EXPECT_EQ(fiv_occluder_light(back, e, NULL), SAT_OK);
        if (storage) EXPECT(memcmp(o->half_table + 1, back->half_table + 1, o->stats.samples * FIV__TERMS * 2) == 0);
        else EXPECT(memcmp(o->table, back->table, o->stats.samples * FIV__TERMS * 4) == 0);
        EXPECT(o->light_count == 1 && memcmp(o->map, back->map, 512 * 512 * sizeof *o->map) == 0);
        EXPECT(memcmp(o->contact, back->contact, o->stats.map_bytes - 512 * 512 * sizeof *o->map) == 0);
        EXPECT(memcmp(&o->stats.centre, &back->stats.centre, sizeof o->stats.centre) == 0);
        test_resting_same(o, back, e);
        fiv_occluder_destroy(back);
        for (i = 0; i < size; i += i < 200 ? 1 : size / 150) {
            EXPECT_EQ(fiv_occluder_load(&back, bytes, i, NULL), SAT_ERR_DATA);
            bytes[i] ^= 0x10;
            EXPECT_EQ(fiv_occluder_load(&back, bytes, size, NULL), SAT_ERR_DATA);
            EXPECT(back == NULL);
            bytes[i] ^= 0x10;
        }
        EXPECT_EQ(fiv_occluder_load(&back, bytes, size + 1, NULL), SAT_ERR_DATA);
        free(bytes);
        fiv_occluder_destroy(o);
    }
    reference_mesh_free(&m);
}

/* From 64 azimuths on the views have 128 texels, whatever the storage, and so have those of a save; an option says
   otherwise. */
TEST(views_of_dense_samples)
{
    reference_mesh m = reference_box(0.5f, 0.3f, 0.4f);
    fiv_occluder_options options = test_small_set();
    int storage, wanted;
    options.phi = 3, options.rho = 2;
    for (storage = 0; storage < 2; storage++)
        for (options.theta = 62; options.theta <= 64; options.theta += 2)
            for (wanted = -1; wanted <= 16; wanted += 17) {
                size_t side = wanted >= 0 ? (size_t)wanted : options.theta < 64 ? 64 : 128, size;
                fiv_occluder *o, *back = NULL;
                void *bytes;
                options.storage = (fiv_storage)storage;
                options.contact_map = wanted;
                o = test_occluder(&m, &options, NULL);
                size = fiv_occluder_save_size(o);
                bytes = malloc(size);
                EXPECT_EQ(o->contact_side, side);
                EXPECT_EQ(fiv_occluder_save(bytes, size, o), SAT_OK);
                EXPECT_EQ(fiv_occluder_load(&back, bytes, size, &options), SAT_OK);
                EXPECT(back && back->contact_side == (int)side &&
                       memcmp(o->contact, back->contact, fiv__contact_bytes(o)) == 0);
                fiv_occluder_destroy(back);
                fiv_occluder_destroy(o);
                free(bytes);
            }
    reference_mesh_free(&m);
}

/* The hash is no protection against malice: words that pass it are still checked one by one. */
TEST(forged_saves_are_refused)
{
    reference_mesh m = test_knot();
    fiv_occluder_options options = test_small_set();
    fiv_occluder_options small = test_small_set(); /* each load draws its depth maps */
    fiv_environment *lights[FIV__MAX_FACE + 1];
    fiv_occluder *o, *back = NULL;
    size_t size, i;
    unsigned char *bytes, *whole;
    uint64_t hash, seed = 1;
    int refused = 0, k;
    options.rho = 2;
    options.resolution = 16;
    small.sun_map = 64;
    memset(lights, 0, sizeof lights);
    o = test_occluder(&m, &options, NULL);
    size = fiv_occluder_save_size(o);
    bytes = (unsigned char *)malloc(size);
    whole = (unsigned char *)malloc(size);
    EXPECT_EQ(fiv_occluder_save(whole, size, o), SAT_OK);
    for (k = 0; k < 300; k++) {
        sat_result result;
        memcpy(bytes, whole, size);
        i = k < 100 ? 16 + (size_t)support_below(&seed, 100) : 16 + (size_t)support_below(&seed, (int)size - 16);
        bytes[i] = (unsigned char)support_random(&seed);
        hash = fiv__hash(FIV__HASH, bytes + 16, size - 16);
        memcpy(bytes + 8, &hash, 8);
        small.contact_map = k % 3 ? 0 : 8;
        result = fiv_occluder_load(&back, bytes, size, &small);
        EXPECT(result == SAT_OK || result == SAT_ERR_DATA);
        refused += result == SAT_ERR_DATA;
        if (result == SAT_OK) {
            fiv_environment **e = &lights[back->face];
            float grey[2] = {1, 1};
            sat_image image = sat_image_f32(grey, 2, 1, 1);
            fiv_environment_options eo = fiv_environment_defaults();
            eo.resolution = back->face;
            if (!*e) EXPECT_EQ(fiv_environment_create(e, &image, &eo, NULL), SAT_OK);
            EXPECT_EQ(fiv_occluder_light(back, *e, NULL), SAT_OK);
        }
        fiv_occluder_destroy(back);
    }
    EXPECT(refused > 50);
    { /* counts whose sum wraps around: many triangles must not pass for few */
        fiv__save head;
        memcpy(bytes, whole, size);
        memcpy(&head, bytes, sizeof head);
        head.skipped = (uint64_t)0 - head.triangles;
        memcpy(bytes, &head, sizeof head);
        hash = fiv__hash(FIV__HASH, bytes + 16, size - 16);
        memcpy(bytes + 8, &hash, 8);
        EXPECT(head.triangles > FIV__FEW);
        EXPECT_EQ(fiv_occluder_load(&back, bytes, size, NULL), SAT_ERR_DATA);
        EXPECT(back == NULL);
    }
    for (k = 0; k <= FIV__MAX_FACE; k++) fiv_environment_destroy(lights[k]);
    free(bytes);
    free(whole);
    fiv_occluder_destroy(o);
    reference_mesh_free(&m);
}
#endif

/* ---- lazy occluders ---- */

static void test_lazy(int contact_map, float height)
{
    const float where[3] = {0, height, 0};
    static float points[3 * COUNT], normals[3 * COUNT], whole[3 * COUNT], lazy_rgb[3 * COUNT];
    fiv_occluder_options options = fiv_occluder_defaults();
    fiv_irradiance_stats stats;
    fiv_instance instance;
    fiv_occluder *lazy, *made;
    test_scene s;
    size_t computed, again, v;
    float *moved;
    options.theta = 24, options.phi = 13, options.rho = 8;
    options.contact_map = contact_map;
    test_open_scene(&s, 2000, &options, where, NULL);
    options.keep_masks = 0;
    options.lazy = 1;
    lazy = test_occluder(&s.mesh, &options, NULL);
    EXPECT_EQ(fiv_occluder_light(lazy, s.environment, NULL), SAT_OK);
    test_plane(points, normals, SIDE, 6, 0);
    instance = test_instance(s.occluder, where[0], where[1], where[2]);
    fiv_irradiance(whole, points, normals, COUNT, s.environment, &instance, 1, NULL, NULL);
    instance.occluder = lazy;
    fiv_irradiance(lazy_rgb, points, normals, COUNT, s.environment, &instance, 1, NULL, &stats);
    EXPECT(stats.missing == stats.whole + stats.clipped && stats.missing > 0);
    EXPECT_EQ(fiv_occluder_prepare(lazy, &computed, &instance, 1, points, COUNT), SAT_OK);
    EXPECT_EQ(fiv_occluder_prepare(lazy, &again, &instance, 1, points, COUNT), SAT_OK);
    EXPECT_EQ(again, 0);
    fiv_irradiance(lazy_rgb, points, normals, COUNT, s.environment, &instance, 1, NULL, &stats);
    EXPECT_EQ(stats.missing, 0);
    EXPECT(memcmp(whole, lazy_rgb, sizeof whole) == 0);
    EXPECT((stats.contacts > 0) == (contact_map > 0));
    REPORT("samples that a plane needs", (double)computed / (double)lazy->stats.samples, "of all");
    EXPECT((double)computed <= 0.2 * (double)lazy->stats.samples);
    /* the mesh shrinks: as if made so */
    moved = (float *)malloc(3 * s.mesh.vertices * sizeof *moved);
    for (v = 0; v < 3 * s.mesh.vertices; v++) moved[v] = s.mesh.positions[v] * (v % 3 == 1 ? 0.5f : 1.0f);
    EXPECT_EQ(fiv_occluder_invalidate(lazy, moved), SAT_OK);
    EXPECT_EQ(fiv_occluder_prepare(lazy, &computed, &instance, 1, points, COUNT), SAT_OK);
    EXPECT(computed > 0);
    fiv_irradiance(lazy_rgb, points, normals, COUNT, s.environment, &instance, 1, NULL, NULL);
    memcpy(s.mesh.positions, moved, 3 * s.mesh.vertices * sizeof *moved);
    options.keep_masks = 1;
    options.lazy = 0;
    made = test_occluder(&s.mesh, &options, NULL);
    fiv_occluder_light(made, s.environment, NULL);
    instance.occluder = made;
    fiv_irradiance(whole, points, normals, COUNT, s.environment, &instance, 1, NULL, &stats);
    EXPECT((stats.contacts > 0) == (contact_map > 0));
    EXPECT(memcmp(whole, lazy_rgb, sizeof whole) == 0);
    free(moved);
    fiv_occluder_destroy(lazy);
    fiv_occluder_destroy(made);
    test_close_scene(&s);
}

/* What deforms is lit as if it had been made so; its views, too, when they are asked for. */
TEST(lazy_samples)
{
    fiv_occluder_options options = fiv_occluder_defaults();
    reference_mesh box = reference_box(1, 1, 1);
    fiv_occluder *o;
    test_lazy(0, 0.8f);
    test_lazy(32, 0.3f);
    options.keep_masks = 0;
    options.lazy = 1;
    o = test_occluder(&box, &options, NULL);
    EXPECT_EQ(o->contact_side, 0); /* not asked for */
    fiv_occluder_destroy(o);
    reference_mesh_free(&box);
}

/* keep_masks = 0 gives the same vectors as stored masks, for float and half storage. */
TEST(without_stored_masks)
{
    reference_mesh m = test_knot();
    fiv_environment *e = test_shared_environment(2000, 400);
    fiv_occluder_options options = test_small_set();
    int storage;
    for (storage = 0; storage < 2; storage++) {
        fiv_occluder *a, *b;
        options.storage = (fiv_storage)storage;
        options.keep_masks = 1;
        a = test_shared_occluder(&m, &options);
        options.keep_masks = 0;
        b = test_occluder(&m, &options, NULL);
        EXPECT_EQ(fiv_occluder_light(a, e, NULL), SAT_OK);
        EXPECT_EQ(fiv_occluder_light(b, e, NULL), SAT_OK);
        if (storage) EXPECT(memcmp(a->half_table + 1, b->half_table + 1, a->stats.samples * FIV__TERMS * 2) == 0);
        else EXPECT(memcmp(a->table, b->table, a->stats.samples * FIV__TERMS * 4) == 0);
        EXPECT(a->light_count > 0 && memcmp(a->map, b->map, a->stats.map_bytes) == 0);
        EXPECT(memcmp(a->state, b->state, a->stats.samples) == 0);
        EXPECT_EQ(a->stats.inside, b->stats.inside);
        fiv_occluder_destroy(b);
    }
    reference_mesh_free(&m);
}

/* ---- extremes ---- */

TEST(empty_and_degenerate_meshes)
{
    static const unsigned index[12] = {0, 1, 2, 0, 0, 1, 3, 1, 2, 4, 4, 4};
    float positions[15] = {0, 0, 0, 1, 0, 0, 2, 0, 0, 0, 0, 0, 1, 1, 1};
    float point[3] = {0.5f, -1, 0.1f}, normal[3] = {0, 1, 0}, rgb[3], open[3];
    fiv_environment *e = test_shared_environment(2000, 400);
    fiv_occluder_options options = test_small_set();
    fiv_occluder *o = NULL;
    fiv_occluder_stats stats;
    fiv_instance instance;
    int round;
    positions[9] = test_nan();
    fiv_environment_irradiance(open, e, normal);
    for (round = 0; round < 3; round++) { /* no triangle; one without area; all at one point */
        if (round == 2) memset(positions, 0, sizeof positions);
        EXPECT_EQ(fiv_occluder_create(&o, positions, 5, index, round == 0 ? 0 : 4, &options, &stats), SAT_OK);
        EXPECT_EQ(stats.skipped_triangles, round == 0 ? 0 : round == 1 ? 3 : 2);
        EXPECT_EQ(fiv_occluder_get_stats(o).skipped_triangles, stats.skipped_triangles);
        EXPECT_EQ(fiv_occluder_get_stats(o).samples, stats.samples);
        EXPECT_EQ(fiv_occluder_light(o, e, NULL), SAT_OK);
        instance = test_instance(o, 0, 0, 0);
        EXPECT_EQ(fiv_irradiance(rgb, point, normal, 1, e, &instance, 1, NULL, NULL), SAT_OK);
        EXPECT(test_same(rgb, open, 3));
        fiv_occluder_destroy(o);
    }
    EXPECT_EQ(fiv_occluder_create(&o, NULL, 0, NULL, 0, &options, &stats), SAT_OK);
    fiv_occluder_destroy(o);
}

TEST(extreme_receivers)
{
    static const float origin[3] = {0, 0, 0};
    fiv_occluder_options options = test_small_set();
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_irradiance_stats stats;
    fiv_instance instance;
    test_scene s;
    float point[3], normal[3] = {0, 1, 0}, rgb[3], open[3];
    int a, k;
    test_open_scene(&s, 2000, &options, origin, NULL);
    fiv_environment_irradiance(open, s.environment, normal);
    for (a = 0; a < 4; a++) {
        io.accuracy = (fiv_accuracy)a;
        instance = test_instance(s.occluder, 0, 0, 0);
        point[0] = 0, point[1] = -1e6f * s.stats.radius, point[2] = 0; /* 1e6 R away */
        io.cutoff = 0;
        EXPECT_EQ(fiv_irradiance(rgb, point, normal, 1, s.environment, &instance, 1, &io, &stats), SAT_OK);
        for (k = 0; k < 3; k++) EXPECT_REL(rgb[k], open[k], 1e-6);
        io.cutoff = 0.001f;
        EXPECT_EQ(fiv_irradiance(rgb, point, normal, 1, s.environment, &instance, 1, &io, &stats), SAT_OK);
        EXPECT_EQ(stats.below_cutoff, 1);
        EXPECT(test_same(rgb, open, 3));
        point[1] = 1e38f; /* offsets that overflow */
        EXPECT_EQ(fiv_irradiance(rgb, point, normal, 1, s.environment, &instance, 1, &io, NULL), SAT_OK);
        EXPECT(test_same(rgb, open, 3));
        memcpy(point, s.stats.centre, sizeof point); /* at the centre, on a vertex, inside the tube */
        EXPECT_EQ(fiv_irradiance(rgb, point, normal, 1, s.environment, &instance, 1, &io, NULL), SAT_OK);
        for (k = 0; k < 3; k++) EXPECT(rgb[k] >= 0 && rgb[k] <= open[k] * 1.000001f);
        memcpy(point, s.mesh.positions + 30, sizeof point);
        EXPECT_EQ(fiv_irradiance(rgb, point, normal, 1, s.environment, &instance, 1, &io, NULL), SAT_OK);
        for (k = 0; k < 3; k++) EXPECT(rgb[k] >= 0 && rgb[k] <= open[k] * 1.000001f);
        instance.scale = 0;
        EXPECT_EQ(fiv_irradiance(rgb, point, normal, 1, s.environment, &instance, 1, &io, NULL), SAT_OK);
        EXPECT(test_same(rgb, open, 3));
        instance.scale = 1e-30f;
        EXPECT_EQ(fiv_irradiance(rgb, point, normal, 1, s.environment, &instance, 1, &io, NULL), SAT_OK);
        for (k = 0; k < 3; k++) EXPECT(rgb[k] >= 0 && rgb[k] <= open[k] * 1.000001f);
    }
    instance = test_instance(s.occluder, 0, 0, 0);
    normal[1] = 0; /* no normal: no light */
    EXPECT_EQ(fiv_irradiance(rgb, point, normal, 1, s.environment, &instance, 1, NULL, &stats), SAT_OK);
    EXPECT(rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0);
    normal[1] = test_nan();
    EXPECT_EQ(fiv_irradiance(rgb, point, normal, 1, s.environment, &instance, 1, NULL, &stats), SAT_OK);
    EXPECT_EQ(stats.non_finite, 1);
    EXPECT(rgb[0] == 0);
    normal[1] = 3e-30f; /* any length */
    point[1] = -50;
    EXPECT_EQ(fiv_irradiance(rgb, point, normal, 1, s.environment, NULL, 0, NULL, NULL), SAT_OK);
    EXPECT_REL(rgb[1], open[1], 1e-6);
    test_close_scene(&s);
}

/* All light is taken in a closed box, and inside flags tell. */
TEST(inside_a_closed_box)
{
    reference_mesh box = reference_box(1, 1, 1);
    fiv_environment *e = test_shared_environment(2000, 400);
    fiv_occluder_options options = test_small_set();
    fiv_occluder_stats stats;
    fiv_occluder *o;
    fiv_instance instance;
    float point[3] = {0.05f, 0.02f, 0}, normal[3] = {0.6f, 0.8f, 0}, rgb[3], open[3];
    int a, k;
    options.first_shell = 0.1f;
    o = test_occluder(&box, &options, &stats);
    EXPECT(stats.inside > 0 && stats.inside < stats.samples);
    EXPECT_EQ(fiv_occluder_light(o, e, NULL), SAT_OK);
    instance = test_instance(o, 0, 0, 0);
    fiv_environment_irradiance(open, e, normal);
    for (a = 0; a < 3; a++) {
        fiv_irradiance_options io = fiv_irradiance_defaults();
        io.accuracy = (fiv_accuracy)a;
        io.partial = 0;
        EXPECT_EQ(fiv_irradiance(rgb, point, normal, 1, e, &instance, 1, &io, NULL), SAT_OK);
        for (k = 0; k < 3; k++) EXPECT(rgb[k] <= open[k]);
    }
    fiv_occluder_destroy(o);
    reference_mesh_free(&box);
}

/* An occluder that is left out could not have taken more than the cutoff. */
TEST(cutoff_is_a_bound)
{
    static float points[3 * COUNT], normals[3 * COUNT], all[3 * COUNT], some[3 * COUNT];
    static const float where[3] = {0, 0.8f, 0};
    fiv_occluder_options options = test_small_set();
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_irradiance_stats stats;
    fiv_instance instance;
    test_scene s;
    int i;
    test_open_scene(&s, 0, &options, where, NULL);
    instance = test_instance(s.occluder, where[0], where[1], where[2]);
    test_plane(points, normals, SIDE, 60, 0);
    io.cutoff = 0;
    fiv_irradiance(all, points, normals, COUNT, s.environment, &instance, 1, &io, NULL);
    io.cutoff = 0.02f;
    fiv_irradiance(some, points, normals, COUNT, s.environment, &instance, 1, &io, &stats);
    EXPECT(stats.below_cutoff > COUNT / 4);
    EXPECT_EQ(stats.below_cutoff + stats.whole + stats.clipped + stats.below_horizon, COUNT);
    for (i = 0; i < 3 * COUNT; i++) {
        float open[3];
        fiv_environment_irradiance(open, s.environment, normals + i / 3 * 3);
        EXPECT_NEAR(some[i], all[i], 0.0201 * (double)open[i % 3]);
    }
    test_close_scene(&s);
}

/* ---- promises ---- */

TEST(same_bits_for_any_workers)
{
    static const float where[3] = {0, 0.8f, 0};
    static const int counts[4] = {1, 2, 3, 7};
    static float points[3 * COUNT], normals[3 * COUNT], rgb[3 * COUNT], first[3 * COUNT];
    fiv_occluder_options options = test_small_set();
    fiv_environment_options eo = fiv_environment_defaults();
    static float pixels[SKY_WIDTH * SKY_HEIGHT * 3];
    sat_image sky = test_sky(pixels, 2000);
    reference_mesh m = test_knot();
    int i, odd;
    uint64_t hash = 0, table;
    options.rho = 4, options.contact_map = 16;
    test_plane(points, normals, SIDE, 6, 0);
    for (odd = 0; odd < 2; odd++)
        for (i = 0; i < 4; i++) {
            sat_threads threads = odd ? support_odd_threads(counts[i]) : support_threads(counts[i]);
            fiv_environment *e = NULL;
            fiv_occluder *o;
            fiv_instance instance;
            fiv_irradiance_options io = fiv_irradiance_defaults();
            fiv_irradiance_stats stats;
            options.threads = eo.threads = io.threads = threads;
            io.accuracy = FIV_MASK;
            EXPECT_EQ(fiv_environment_create(&e, &sky, &eo, NULL), SAT_OK);
            o = test_occluder(&m, &options, NULL);
            EXPECT_EQ(fiv_occluder_light(o, e, NULL), SAT_OK);
            instance = test_instance(o, where[0], where[1], where[2]);
            EXPECT_EQ(fiv_irradiance(rgb, points, normals, COUNT, e, &instance, 1, &io, &stats), SAT_OK);
            EXPECT_EQ(stats.whole + stats.clipped + stats.below_horizon + stats.below_cutoff, COUNT);
            table = support_hash(o->table, o->stats.samples * FIV__TERMS * sizeof(float));
            table = support_hash_add(table, o->words, o->stats.spans * 2);
            table = support_hash_add(table, o->map, (size_t)(o->map_side * o->map_side) * sizeof *o->map);
            table = support_hash_add(table, o->contact, fiv__contact_bytes(o));
            table = support_hash_add(table, e->irradiance, 18 * 33 * 33 * sizeof(float));
            if (i == 0 && odd == 0) {
                hash = table;
                memcpy(first, rgb, sizeof first);
            }
            EXPECT(table == hash);
            EXPECT(memcmp(first, rgb, sizeof first) == 0);
            fiv_occluder_destroy(o);
            fiv_environment_destroy(e);
        }
    reference_mesh_free(&m);
}

TEST(failing_allocators)
{
    static float pixels[SKY_WIDTH * SKY_HEIGHT * 3];
    sat_image sky = test_sky(pixels, 2000);
    reference_mesh m = test_knot();
    int fail, kind;
    for (kind = 0; kind < 2; kind++)
        for (fail = 1; fail < 14; fail++) {
            support_memory memory;
            fiv_occluder_options options = test_small_set();
            fiv_environment_options eo = fiv_environment_defaults();
            fiv_environment *e = NULL;
            fiv_occluder *o = NULL, *share = NULL;
            options.rho = 2, options.sun_map = 64, options.contact_map = 8;
            eo.resolution = options.resolution = 8;
            options.keep_masks = kind == 0;
            options.allocator = eo.allocator = support_allocator(&memory);
            memory.fail_at = fail;
            if (fiv_environment_create(&e, &sky, &eo, NULL) != SAT_OK) EXPECT(e == NULL);
            if (fiv_occluder_create(&o, m.positions, m.vertices, m.indices, m.triangles, &options, NULL) != SAT_OK)
                EXPECT(o == NULL);
            if (o && kind == 0 && fiv_occluder_share(&share, o) != SAT_OK) EXPECT(share == NULL);
            if (fail == 13) EXPECT(e && o);
            fiv_occluder_destroy(share);
            fiv_occluder_destroy(o);
            fiv_environment_destroy(e);
            EXPECT(support_memory_clean(&memory));
        }
    reference_mesh_free(&m);
}

#ifndef FIV_NO_MASKS
TEST(loads_that_run_out_of_memory)
{
    reference_mesh m = reference_box(0.5f, 0.3f, 0.4f);
    fiv_occluder_options options = test_small_set();
    fiv_occluder *o, *back = NULL;
    sat_result result = SAT_ERR_MEMORY;
    size_t size;
    void *bytes;
    int fail;
    options.rho = 2;
    o = test_occluder(&m, &options, NULL);
    size = fiv_occluder_save_size(o);
    bytes = malloc(size);
    EXPECT_EQ(fiv_occluder_save(bytes, size, o), SAT_OK);
    for (fail = 1; fail < 9 && result == SAT_ERR_MEMORY; fail++) {
        support_memory memory;
        options.allocator = support_allocator(&memory);
        memory.fail_at = fail;
        result = fiv_occluder_load(&back, bytes, size, &options);
        EXPECT((result == SAT_OK) == (back != NULL));
        fiv_occluder_destroy(back);
        EXPECT(support_memory_clean(&memory));
    }
    EXPECT(fail == 5 && result == SAT_OK); /* its tables, its masks, its mesh */
    free(bytes);
    fiv_occluder_destroy(o);
    reference_mesh_free(&m);
}
#endif

TEST(no_allocation_per_frame)
{
    static float pixels[SKY_WIDTH * SKY_HEIGHT * 3], points[3 * COUNT], normals[3 * COUNT], rgb[3 * COUNT];
    sat_image sky = test_sky(pixels, 2000);
    reference_mesh m = test_knot();
    support_memory memory;
    fiv_occluder_options options = test_small_set();
    fiv_environment_options eo = fiv_environment_defaults();
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_environment *e = NULL;
    fiv_occluder *o = NULL, *lazy = NULL;
    fiv_instance instance;
    float turn[9], axis[3] = {0, 1, 0};
    long calls;
    int a;
    options.allocator = eo.allocator = support_allocator(&memory);
    EXPECT_EQ(fiv_environment_create(&e, &sky, &eo, NULL), SAT_OK);
    EXPECT_EQ(memory.calls, 1);
    o = test_occluder(&m, &options, NULL);
    EXPECT_EQ(memory.live, 4);
    options.keep_masks = 0, options.lazy = 1;
    lazy = test_occluder(&m, &options, NULL);
    calls = memory.calls;
    test_plane(points, normals, SIDE, 6, -1);
    test_rotation(turn, axis, 0.3);
    EXPECT_EQ(fiv_environment_update(e, &sky, turn), SAT_OK);
    EXPECT_EQ(fiv_occluder_light(o, e, turn), SAT_OK);
    EXPECT_EQ(fiv_occluder_light(lazy, e, turn), SAT_OK);
    instance = test_instance(lazy, 0, 0, 0);
    EXPECT_EQ(fiv_occluder_invalidate(lazy, m.positions), SAT_OK);
    EXPECT_EQ(fiv_occluder_prepare(lazy, NULL, &instance, 1, points, COUNT), SAT_OK);
    instance.occluder = o;
    for (a = 0; a < 4; a++) {
        io.accuracy = (fiv_accuracy)a;
        EXPECT_EQ(fiv_irradiance(rgb, points, normals, COUNT, e, &instance, 1, &io, NULL), SAT_OK);
        EXPECT_EQ(fiv_self_irradiance(rgb, points, normals, COUNT, e, &instance, &instance, 1, &io, NULL), SAT_OK);
    }
    EXPECT_EQ(memory.calls, calls);
    fiv_occluder_destroy(o);
    fiv_occluder_destroy(lazy);
    fiv_environment_destroy(e);
    EXPECT(support_memory_clean(&memory));
    reference_mesh_free(&m);
}

static int test_stop_at(float done, void *user)
{
    float *last = (float *)user;
    EXPECT(done >= last[0]);
    last[0] = done;
    last[2] += 1;
    return done >= last[1];
}

TEST(progress_and_cancelling)
{
    reference_mesh m = reference_box(0.5f, 0.3f, 0.4f);
    fiv_occluder_options options = fiv_occluder_defaults();
    fiv_occluder *o = NULL;
    float state[3] = {0, 2, 0};
    options.progress = test_stop_at;
    options.progress_user = state;
    EXPECT_EQ(fiv_occluder_create(&o, m.positions, m.vertices, m.indices, m.triangles, &options, NULL), SAT_OK);
    EXPECT_NEAR(state[0], 1, 0);
    EXPECT(state[2] > 10);
    fiv_occluder_destroy(o);
    state[0] = 0, state[1] = 0.5f;
    EXPECT_EQ(fiv_occluder_create(&o, m.positions, m.vertices, m.indices, m.triangles, &options, NULL),
              SAT_ERR_CANCELLED);
    EXPECT(o == NULL);
    EXPECT(state[0] < 0.6f);
    reference_mesh_free(&m);
}

TEST(bad_arguments)
{
    static float pixels[SKY_WIDTH * SKY_HEIGHT * 3];
    sat_image sky = test_sky(pixels, 0), two = sat_image_f32(pixels, 4, 4, 2);
    reference_mesh m = test_knot();
    fiv_environment_options eo = fiv_environment_defaults();
    fiv_occluder_options oo = test_small_set(), bad;
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_environment *e = NULL, *other = NULL;
    fiv_occluder *o = NULL, *none = NULL;
    fiv_instance instance, many[FIV_MAX_INSTANCES + 1];
    float p[3] = {0, 0, 0}, n[3] = {0, 1, 0}, rgb[3], skew[9] = {1, 0.1f, 0, 0, 1, 0, 0, 0, 1},
          mirror[9] = {-1, 0, 0, 0, 1, 0, 0, 0, 1};
    unsigned over[3] = {0, 1, 320};
    int i;
    EXPECT_EQ(fiv_environment_create(NULL, &sky, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(fiv_environment_create(&e, NULL, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(fiv_environment_create(&e, &two, NULL, NULL), SAT_ERR_ARGUMENT);
    for (i = 0; i < 7; i++) {
        eo = fiv_environment_defaults();
        if (i == 0) eo.resolution = 7;
        if (i == 1) eo.resolution = 65;
        if (i == 2) eo.delta_ratio = -1;
        if (i == 3) eo.max_lights = FIV_MAX_LIGHTS + 1;
        if (i == 4) eo.max_radiance = 0;
        if (i == 5) eo.delta_ratio = test_nan();
        if (i == 6) eo.threads.workers = 2;
        EXPECT_EQ(fiv_environment_create(&e, &sky, &eo, NULL), SAT_ERR_ARGUMENT);
        EXPECT(e == NULL);
    }
    EXPECT_EQ(fiv_environment_create(&e, &sky, NULL, NULL), SAT_OK);
    eo = fiv_environment_defaults();
    eo.resolution = 16;
    EXPECT_EQ(fiv_environment_create(&other, &sky, &eo, NULL), SAT_OK);
    EXPECT_EQ(fiv_environment_update(e, NULL, skew), SAT_ERR_ARGUMENT);
    EXPECT_EQ(fiv_environment_update(e, NULL, mirror), SAT_ERR_ARGUMENT);
    EXPECT_EQ(fiv_environment_update(NULL, &sky, NULL), SAT_ERR_ARGUMENT);
    for (i = 0; i < 13; i++) {
        bad = oo;
        if (i == 0) bad.theta = 2;
        if (i == 1) bad.theta = 17;
        if (i == 2) bad.phi = 2;
        if (i == 3) bad.rho = 1;
        if (i == 4) bad.first_shell = 0;
        if (i == 5) bad.last_shell = 0.2f;
        if (i == 6) bad.last_shell = test_nan();
        if (i == 7) bad.resolution = 65;
        if (i == 8) bad.rho = 257;
        if (i == 9) bad.lazy = 1;
        if (i == 10) bad.sun_map = 63;
        if (i == 11) bad.threads.workers = -1;
        if (i == 12) bad.first_shell = test_nan();
        EXPECT_EQ(fiv_occluder_create(&none, m.positions, m.vertices, m.indices, m.triangles, &bad, NULL),
                  SAT_ERR_ARGUMENT);
    }
    EXPECT_EQ(fiv_occluder_create(&none, m.positions, m.vertices, over, 1, &oo, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(fiv_occluder_create(&none, NULL, 3, over, 1, &oo, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(fiv_occluder_create(NULL, m.positions, m.vertices, m.indices, m.triangles, &oo, NULL), SAT_ERR_ARGUMENT);
    bad = oo;
    bad.theta = 4096, bad.phi = 2049, bad.rho = 256;
    EXPECT_EQ(fiv_occluder_create(&none, m.positions, m.vertices, m.indices, m.triangles, &bad, NULL), SAT_ERR_SIZE);
    o = test_occluder(&m, &oo, NULL);
    instance = test_instance(o, 0, 0, 0);
    EXPECT_EQ(fiv_irradiance(rgb, p, n, 1, e, &instance, 1, NULL, NULL), SAT_ERR_ARGUMENT); /* not lit */
    EXPECT_EQ(fiv_occluder_light(o, other, NULL), SAT_ERR_ARGUMENT);                       /* another face */
    EXPECT_EQ(fiv_occluder_light(o, e, skew), SAT_ERR_ARGUMENT);
    EXPECT_EQ(fiv_occluder_light(o, e, NULL), SAT_OK);
    EXPECT_EQ(fiv_irradiance(rgb, p, n, 1, e, &instance, 1, NULL, NULL), SAT_OK);
    EXPECT_EQ(fiv_irradiance(NULL, p, n, 1, e, &instance, 1, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(fiv_irradiance(rgb, p, n, 0, e, NULL, 0, NULL, NULL), SAT_OK);
    instance.scale = -1;
    EXPECT_EQ(fiv_irradiance(rgb, p, n, 1, e, &instance, 1, NULL, NULL), SAT_ERR_ARGUMENT);
    instance.scale = 1, instance.position[1] = test_nan();
    EXPECT_EQ(fiv_irradiance(rgb, p, n, 1, e, &instance, 1, NULL, NULL), SAT_ERR_ARGUMENT);
    instance.position[1] = 0;
    io.cutoff = 2;
    EXPECT_EQ(fiv_irradiance(rgb, p, n, 1, e, &instance, 1, &io, NULL), SAT_ERR_ARGUMENT);
    io.cutoff = test_nan();
    EXPECT_EQ(fiv_irradiance(rgb, p, n, 1, e, &instance, 1, &io, NULL), SAT_ERR_ARGUMENT);
    for (i = 0; i <= FIV_MAX_INSTANCES; i++) many[i] = instance;
    EXPECT_EQ(fiv_irradiance(rgb, p, n, 1, e, many, FIV_MAX_INSTANCES + 1, NULL, NULL), SAT_ERR_LIMIT);
    EXPECT_EQ(fiv_environment_update(e, NULL, NULL), SAT_OK);
    EXPECT_EQ(fiv_irradiance(rgb, p, n, 1, e, &instance, 1, NULL, NULL), SAT_ERR_ARGUMENT); /* lit before the update */
    EXPECT_EQ(fiv_occluder_invalidate(o, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(fiv_occluder_share(&none, NULL), SAT_ERR_ARGUMENT);
    fiv_occluder_destroy(o);
    fiv_occluder_destroy(NULL);
    fiv_environment_destroy(NULL);
    fiv_environment_destroy(e);
    fiv_environment_destroy(other);
    reference_mesh_free(&m);
}

/* Each row of a table: its default and both ends are taken, what lies beyond is refused, with a sentence that starts
   with the name. */
typedef const char *test_explain(char *text, size_t size, const void *options);
typedef sat_result test_use(const void *options);

static void test_fields(const sat__field *fields, int count, const void *defaults, size_t size, test_explain *explain,
                        test_use *use)
{
    union { double align; unsigned char bytes[256]; } o;
    char text[160];
    int i, at;
    EXPECT(size <= sizeof o);
    EXPECT(strcmp(explain(text, sizeof text, defaults), "") == 0);
    EXPECT(strcmp(explain(NULL, 0, defaults), "") == 0);
    for (i = 0; i < count; i++) {
        const sat__field *f = &fields[i];
        if (f->type != 'i' && f->type != 'f') continue;
        for (at = 0; at < 6; at++) {
            double v = at == 0   ? f->initial
                       : at == 1 ? f->low
                       : at == 2 ? f->high
                       : at == 3 ? f->low - 1
                                 : f->high * 1.1 + 1;
            if (f->type == 'i' && (v < -2147483647 || v > 2147483647)) continue;
            if (at == 5 && f->type != 'f') continue;
            memcpy(o.bytes, defaults, size);
            sat__field_set(f, o.bytes, at == 5 ? (double)test_nan() : v);
            EXPECT_EQ(sat__field_is_valid(f, o.bytes), at < 3);
            if (at < 3 && strncmp(explain(text, sizeof text, o.bytes), f->name, strlen(f->name)) != 0) {
                EXPECT_EQ(use(o.bytes), *text ? SAT_ERR_ARGUMENT : SAT_OK); /* an end may not suit another option */
            } else {
                EXPECT(strstr(explain(text, sizeof text, o.bytes), f->name) == text);
                EXPECT_EQ(use(o.bytes), SAT_ERR_ARGUMENT);
            }
        }
    }
}

static struct {
    sat_image sky;
    reference_mesh mesh;
    fiv_environment *environment;
    fiv_instance instance;
} test_used;

static const char *test_explain_environment(char *text, size_t size, const void *options)
{
    return fiv_explain_environment(text, size, &test_used.sky, (const fiv_environment_options *)options);
}

static sat_result test_use_environment(const void *options)
{
    fiv_environment *e = NULL;
    sat_result r = fiv_environment_create(&e, &test_used.sky, (const fiv_environment_options *)options, NULL);
    fiv_environment_destroy(e);
    return r;
}

static const char *test_explain_occluder(char *text, size_t size, const void *options)
{
    return fiv_explain_occluder(text, size, test_used.mesh.positions, test_used.mesh.vertices, test_used.mesh.indices,
                                test_used.mesh.triangles, (const fiv_occluder_options *)options);
}

/* Of twelve triangles, so that 4096 azimuths are made, too. */
static sat_result test_use_occluder(const void *options)
{
    fiv_occluder *o = NULL;
    sat_result r = fiv_occluder_create(&o, test_used.mesh.positions, test_used.mesh.vertices, test_used.mesh.indices,
                                       test_used.mesh.triangles, (const fiv_occluder_options *)options, NULL);
    fiv_occluder_destroy(o);
    return r;
}

static const char *test_explain_irradiance(char *text, size_t size, const void *options)
{
    return fiv_explain_irradiance(text, size, test_used.environment, &test_used.instance, 1,
                                  (const fiv_irradiance_options *)options);
}

static sat_result test_use_irradiance(const void *options)
{
    static const float points[6] = {0, -0.31f, 0, 2, -0.31f, 0}, normals[6] = {0, 1, 0, 0, 1, 0};
    float rgb[6] = {-1, -1, -1, -1, -1, -1};
    int i;
    sat_result r = fiv_irradiance(rgb, points, normals, 2, test_used.environment, &test_used.instance, 1,
                                  (const fiv_irradiance_options *)options, NULL);
    for (i = 0; i < 6; i++) EXPECT(r ? rgb[i] < 0 : rgb[i] >= 0);
    return r;
}

TEST(options_are_checked_and_named)
{
    static float pixels[SKY_WIDTH * SKY_HEIGHT * 3];
    fiv_environment_options eo = fiv_environment_defaults();
    fiv_occluder_options oo = fiv_occluder_defaults();
    fiv_irradiance_options io = fiv_irradiance_defaults();
    fiv_instance two[2];
    fiv_occluder *o;
    char text[160];
    unsigned index[3] = {0, 1, 8};
    test_used.sky = test_sky(pixels, 2000);
    test_used.mesh = reference_box(0.5f, 0.3f, 0.4f);
    test_fields(fiv__environment_fields, SAT__COUNT(fiv__environment_fields), &eo, sizeof eo, test_explain_environment,
                test_use_environment);
    oo.theta = 8, oo.phi = 3, oo.rho = 2, oo.resolution = 8, oo.sun_map = 64;
    test_fields(fiv__occluder_fields, SAT__COUNT(fiv__occluder_fields), &oo, sizeof oo, test_explain_occluder,
                test_use_occluder);
    oo.resolution = 32;
    test_used.environment = test_environment(2000, 400);
    o = test_occluder(&test_used.mesh, &oo, NULL);
    test_used.instance = test_instance(o, 0, 0, 0);
    EXPECT(strcmp(test_explain_irradiance(text, sizeof text, NULL), "instance 0: not lit yet (fiv_occluder_light)") == 0);
    EXPECT_EQ(fiv_occluder_light(o, test_used.environment, NULL), SAT_OK);
    test_fields(fiv__irradiance_fields, SAT__COUNT(fiv__irradiance_fields), &io, sizeof io, test_explain_irradiance,
                test_use_irradiance);
    two[0] = two[1] = test_used.instance;
    two[1].scale = -1;
    EXPECT(strcmp(fiv_explain_irradiance(text, sizeof text, test_used.environment, two, 2, NULL),
                  "instance 1: scale is negative or not finite") == 0);
    EXPECT(strcmp(fiv_explain_irradiance(text, sizeof text, NULL, two, 1, NULL), "environment is NULL") == 0);
    EXPECT(strcmp(fiv_explain_occluder(text, sizeof text, test_used.mesh.positions, 8, index, 1, NULL),
                  "triangle 0: its index is 8 of 8 vertices") == 0);
    oo.theta = 7;
    EXPECT(strcmp(test_explain_occluder(text, sizeof text, &oo), "theta is odd") == 0);
    oo.theta = 8, oo.contact_map = 7;
    EXPECT(strcmp(test_explain_occluder(text, sizeof text, &oo), "contact_map is below 8; -1, 0 or 8..256") == 0);
    oo.contact_map = 0, oo.last_shell = 0.2f;
    EXPECT(strcmp(test_explain_occluder(text, sizeof text, &oo), "last_shell is not beyond first_shell") == 0);
    test_used.sky.channels = 2;
    EXPECT(strcmp(test_explain_environment(text, sizeof text, &eo), "channels is 2; 1, 3 or 4") == 0);
    EXPECT(*fiv_explain_environment(text, sizeof text, NULL, NULL) != 0);
    fiv_occluder_destroy(o);
    fiv_environment_destroy(test_used.environment);
    reference_mesh_free(&test_used.mesh);
}

/* Bright texels far apart on black, each of 1 over its solid angle: the power of each is 1; beside the poles, where
   texels are narrow, a part of it stays in the cube. */
TEST(power_of_a_split_off_light)
{
    enum { APART = 12 };
    static float pixels[SKY_WIDTH * SKY_HEIGHT * 3];
    sat_image image = sat_image_f32(pixels, SKY_WIDTH, SKY_HEIGHT, 3);
    double worst = 0, poles = 0, pi = 3.14159265358979323846;
    int first, y, c;
    for (first = 0; first < APART; first += 3) {
        fiv_environment *e = NULL;
        memset(pixels, 0, sizeof pixels);
        for (y = first; y < SKY_HEIGHT; y += APART)
            for (c = 0; c < 3; c++)
                pixels[3 * (y * SKY_WIDTH + 50) + c] =
                    (float)(1 / ((2 * pi / SKY_WIDTH) * (cos(pi * y / SKY_HEIGHT) - cos(pi * (y + 1) / SKY_HEIGHT))));
        if (!EXPECT_EQ(fiv_environment_create(&e, &image, NULL, NULL), SAT_OK)) return;
        EXPECT_EQ(fiv_environment_get_stats(e).lights, (SKY_HEIGHT - first + APART - 1) / APART);
        for (c = 0; c < fiv_environment_get_stats(e).lights; c++) {
            double error = fabs((double)e->lights[c].power[0] - 1);
            y = (int)(acos((double)e->lights[c].direction[1]) / pi * SKY_HEIGHT);
            EXPECT(y % APART == first);
            if (y >= 8 && y < SKY_HEIGHT - 8) worst = support_larger(worst, error);
            else poles = support_larger(poles, error);
        }
        fiv_environment_destroy(e);
    }
    REPORT("power of a split-off light: worst relative error", worst, "");
    EXPECT_NEAR(worst, 0, 4e-5);
    EXPECT_NEAR(poles, 0, 0.02);
}

TEST(defaults_are_the_stated_ones)
{
    fiv_environment_options e = fiv_environment_defaults();
    fiv_occluder_options o = fiv_occluder_defaults();
    fiv_irradiance_options i = fiv_irradiance_defaults();
    EXPECT_EQ(fiv_version(), FIV_VERSION);
    EXPECT_EQ(e.resolution, 32);
    EXPECT_NEAR(e.delta_ratio, 100, 0);
    EXPECT_EQ(e.max_lights, 32);
    EXPECT(o.theta == 32 && o.phi == 17 && o.rho == 15 && o.resolution == 32 && o.keep_masks == 1 && o.lazy == 0 &&
           o.sun_map == 512 && o.contact_map == -1);
    EXPECT_NEAR(o.first_shell, 0.3f, 0);
    EXPECT_NEAR(o.last_shell, 6, 0);
    EXPECT(i.accuracy == FIV_SCALED && i.partial == 1 && i.overlap == 1);
    EXPECT_NEAR(i.cutoff, 0.001f, 0);
    EXPECT(i.own_masks == 64 && i.own_triangles == 500 && i.rays == 1);
    EXPECT_NEAR(i.own_tolerance, 0.01f, 0);
    EXPECT_EQ(i.contact, 1);
    EXPECT_NEAR(i.penumbra, 1, 0);
}

/* Sums of samples, four half floats at a time, are those of one after the other. */
TEST(sums_of_samples)
{
    reference_mesh m = test_knot();
    fiv_environment *e = test_shared_environment(2000, 400);
    int storage, k;
    for (storage = 0; storage < 2; storage++) {
        fiv_occluder_options options = test_small_set();
        fiv_occluder *o;
        size_t i;
        options.storage = (fiv_storage)storage;
        o = test_shared_occluder(&m, &options);
        EXPECT_EQ(fiv_occluder_light(o, e, NULL), SAT_OK);
        for (i = 0; i < o->stats.samples; i += 7) {
            float a[FIV__TERMS], b[FIV__TERMS];
            for (k = 0; k < FIV__TERMS; k++) {
                float v = storage ? sat__half_to_float(fiv__half_sample(o, i)[k])
                                  : o->table[FIV__TERMS * i + (size_t)k];
                a[k] = 0.25f * (float)k;
                b[k] = a[k] + 0.37f * (k == 9 ? fabsf(v) : v);
            }
            fiv__add_sample(a, 0.37f, o, i);
            for (k = 0; k < FIV__TERMS; k++) EXPECT_NEAR(a[k], b[k], 1e-6 * (1 + fabs((double)b[k])));
        }
    }
    reference_mesh_free(&m);
}
