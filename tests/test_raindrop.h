/* Tests of raindrop.h: optics against a drop traced in long double, rain against its formulas and tables, pictures
   against ray tracing, and what must not happen on bad input. */

#include "reference_raindrop.h"

enum { RT_SKY_W = 512, RT_SKY_H = 256 };

/* The sky of all pictures, and the environment made of it once by the defaults: nobody writes to them. */
static const float *rt_sky(void)
{
    static float sky[3 * RT_SKY_W * RT_SKY_H];
    if (!(sky[0] > 0)) reference_sky(sky, RT_SKY_W, RT_SKY_H);
    return sky;
}

static raindrop_environment_stats rt_sky_stats;

static raindrop_environment *rt_environment(void)
{
    static raindrop_environment *environment;
    sat_image image = sat_image_f32(rt_sky(), RT_SKY_W, RT_SKY_H, 3);
    if (!environment) EXPECT_EQ(raindrop_environment_create(&environment, &image, NULL, &rt_sky_stats), SAT_OK);
    return environment;
}

/* Defaults but for the far drops' prefilter, which is as small as it may be where a test does not ask for it. */
static raindrop_environment_options rt_no_far(void)
{
    raindrop_environment_options o = raindrop_environment_defaults();
    o.far_resolution = 8;
    o.far_samples = 16;
    return o;
}

static raindrop_rain *rt_rain_of(const raindrop_drop *drops, int count)
{
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    o.drops = drops;
    o.count = count;
    EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK);
    return rain;
}

static raindrop_drop rt_drop(float x, float y, float z, float radius)
{
    raindrop_drop d;
    memset(&d, 0, sizeof d);
    d.position[0] = x;
    d.position[1] = y;
    d.position[2] = z;
    d.radius = radius;
    d.axis_ratio = 1;
    return d;
}

static double rt_distance(const float *a, const reference_real *b)
{
    double sum = 0;
    int i;
    for (i = 0; i < 3; i++) sum += pow((double)a[i] - (double)b[i], 2);
    return sqrt(sum);
}

/* ---- optics ---- */

typedef struct rt_errors { double refracted, reflected, fresnel, transmit, worst_s; } rt_errors;

/* Sprite points against the traced drop, both from the same floats. */
static rt_errors rt_sprite_errors(double near, double far, float n, int rays)
{
    rt_errors worst;
    uint64_t seed = 7;
    int i, c;
    memset(&worst, 0, sizeof worst);
    for (i = 0; i < rays; i++) {
        double r = sqrt(support_uniform(&seed)), angle = 6.283185307 * support_uniform(&seed), e;
        float s = (float)(r * cos(angle)), t = (float)(r * sin(angle)),
              distance = (float)(near + (far - near) * support_uniform(&seed));
        float d[3], p[3], m;
        reference_real scale = 1 / sqrtl(((reference_real)distance - 1) * ((reference_real)distance + 1)),
                       x = s * scale, y = t * scale, length;
        reference_real origin[3] = {0, 0, 0}, direction[3];
        reference_drop truth;
        raindrop_ray ray;
        origin[2] = (reference_real)distance;
        length = sqrtl(x * x + y * y + 1);
        direction[0] = x / length;
        direction[1] = y / length;
        direction[2] = -1 / length;
        truth = reference_trace(origin, direction, 1, (reference_real)n);
        if (!truth.hit) continue;
        raindrop_sprite_ray(d, p, &m, s, t, distance);
        raindrop_trace(&ray, d, p, m, n);
        e = rt_distance(ray.refracted, truth.refracted);
        if (e > worst.refracted) worst.refracted = e;
        e = rt_distance(ray.reflected, truth.reflected);
        if (e > worst.reflected) worst.reflected = e;
        e = fabs((double)ray.fresnel - (double)truth.fresnel);
        if (e > worst.fresnel) { worst.fresnel = e; worst.worst_s = r; }
        e = fabs((double)ray.transmit - (double)truth.transmit);
        if (e > worst.transmit) worst.transmit = e;
        for (c = 0; c < 3; c++)
            if (expect_is_nan((double)ray.refracted[c]) || expect_is_nan((double)ray.reflected[c]))
                worst.refracted = 1e9;
    }
    return worst;
}

TEST(raindrop_closed_form_is_exact_to_2e_6)
{
    static const double range[4] = {1.01, 10, 100, 1025};
    int i;
    for (i = 0; i < 3; i++) {
        rt_errors e = rt_sprite_errors(range[i], range[i + 1], 1.33f, 40000);
        EXPECT(e.refracted <= 2e-6);
        EXPECT(e.reflected <= 2e-6);
        EXPECT(e.fresnel <= 2e-6);
        EXPECT(e.transmit <= 4e-6);
        REPORT("closed form, largest error of refract", e.refracted, "");
        REPORT("closed form, largest error of reflect", e.reflected, "");
    }
}

TEST(raindrop_other_indices_are_exact_too)
{
    rt_errors glass = rt_sprite_errors(1.2, 20, 1.5f, 20000), bubble = rt_sprite_errors(1.2, 20, 1 / 1.33f, 20000);
    EXPECT(glass.refracted <= 3e-6 && glass.fresnel <= 3e-6);
    /* at the critical angle the derivative of cos r is infinite: the bubble's digits go with the root of the
       rounding */
    EXPECT(bubble.reflected <= 3e-6);
    EXPECT(bubble.refracted <= 2e-3);
    REPORT("bubble, largest error of refract", bubble.refracted, "");
}

TEST(raindrop_index_one_changes_nothing)
{
    uint64_t seed = 3;
    int i, c;
    for (i = 0; i < 2000; i++) {
        float d[3], p[3], m, r = sqrtf((float)support_uniform(&seed));
        raindrop_ray ray;
        raindrop_sprite_ray(d, p, &m, r, 0, 1.5f + 100 * (float)support_uniform(&seed));
        raindrop_trace(&ray, d, p, m, 1);
        for (c = 0; c < 3; c++) EXPECT_EQ(expect_order(ray.refracted[c]), expect_order(d[c]));
        EXPECT(ray.fresnel == 0 && ray.transmit == 1);
    }
}

TEST(raindrop_bubbles_reflect_totally)
{
    int i, total = 0, rays = 20000;
    for (i = 0; i < rays; i++) {
        float b2 = ((float)i + 0.5f) / (float)rays, d[3] = {0, 0, -1}, p[3] = {0, 0, 0};
        raindrop_ray ray;
        p[0] = sqrtf(b2);
        raindrop_trace(&ray, d, p, 1 - b2, 1 / RAINDROP_WATER);
        EXPECT(ray.fresnel >= 0 && ray.fresnel <= 1);
        EXPECT_NEAR(raindrop__dot(ray.refracted, ray.refracted), 1, 1e-5);
        if (ray.fresnel >= 1) {
            total++;
            EXPECT(memcmp(ray.refracted, ray.reflected, sizeof ray.refracted) == 0 && ray.transmit == 0);
        }
    }
    EXPECT_NEAR((double)total / rays, 1 - 1 / (1.33 * 1.33), 2e-4);
}

TEST(raindrop_vector_path_equals_the_plain_one)
{
    enum { N = 1003 };
    static float in[7][N], out[10][N];
    static const float indices[3] = {1.33f, 1 / 1.33f, 1.0f};
    raindrop_ray_inputs inputs;
    raindrop_ray_outputs outputs;
    uint64_t seed = 5;
    int i, c, k;
    for (i = 0; i < N; i++) {
        float d[3], p[3], m, r = i == 0 ? 0 : i == 1 ? 1.0f : sqrtf((float)support_uniform(&seed));
        raindrop_sprite_ray(d, p, &m, r * 0.6f, r * 0.8f, 1.01f + 50 * (float)support_uniform(&seed));
        for (c = 0; c < 3; c++) { in[c][i] = d[c]; in[3 + c][i] = p[c]; }
        in[6][i] = m;
    }
    for (c = 0; c < 3; c++) {
        inputs.direction[c] = in[c];
        inputs.centre_offset[c] = in[3 + c];
        outputs.reflected[c] = out[c];
        outputs.refracted[c] = out[3 + c];
    }
    inputs.one_minus_b2 = in[6];
    outputs.fresnel = out[6];
    outputs.transmit = out[7];
    outputs.footprint_reflected = out[8];
    outputs.footprint_refracted = out[9];
    for (k = 0; k < 3; k++) {
        raindrop_trace_n(&outputs, &inputs, N, indices[k]);
        for (i = 0; i < N; i++) {
            float d[3], p[3];
            raindrop_ray ray;
            for (c = 0; c < 3; c++) { d[c] = in[c][i]; p[c] = in[3 + c][i]; }
            raindrop_trace(&ray, d, p, in[6][i], indices[k]);
            for (c = 0; c < 3; c++) {
                EXPECT_NEAR(out[c][i], ray.reflected[c], 1e-6);
                EXPECT_NEAR(out[3 + c][i], ray.refracted[c], 1e-6);
            }
            EXPECT_NEAR(out[6][i], ray.fresnel, 1e-6);
            EXPECT_NEAR(out[7][i], ray.transmit, 2e-6);
            EXPECT_NEAR(out[8][i], ray.footprint_reflected, 1e-3);
            EXPECT_NEAR(out[9][i], ray.footprint_refracted, 1e-3);
        }
    }
    /* outputs left out are left alone */
    memset(&outputs, 0, sizeof outputs);
    outputs.fresnel = out[6];
    raindrop_trace_n(&outputs, &inputs, N, 1.33f);
    EXPECT(out[6][3] > 0);
}

TEST(raindrop_orders_follow_the_traced_ray)
{
    uint64_t seed = 9;
    double worst = 0;
    int i, k;
    for (i = 0; i < 5000; i++) {
        double r = sqrt(support_uniform(&seed)) * 0.999;
        float d[3], p[3], m, s = (float)r, distance = 1.1f + 30 * (float)support_uniform(&seed);
        reference_real origin[3] = {0, 0, 0}, direction[3] = {0, 0, 0}, x, length;
        reference_drop truth;
        raindrop_order order;
        origin[2] = (reference_real)distance;
        x = s / sqrtl(((reference_real)distance - 1) * ((reference_real)distance + 1));
        length = sqrtl(x * x + 1);
        direction[0] = x / length;
        direction[2] = -1 / length;
        truth = reference_trace(origin, direction, 1, (reference_real)1.33f);
        raindrop_sprite_ray(d, p, &m, s, 0, distance);
        for (k = 0; k < 4; k++) {
            double e;
            raindrop_trace_order(&order, d, p, m, 1.33f, k);
            e = rt_distance(order.direction, truth.order[k]);
            if (e > worst) worst = e;
            EXPECT_NEAR(order.weight, truth.share[k], 2e-6);
        }
    }
    EXPECT(worst <= 5e-6);
    REPORT("orders 0..3, largest error of the direction", worst, "");
}

TEST(raindrop_orders_share_all_the_power)
{
    int i, k;
    double worst = 0, worst_rest = 0;
    for (i = 0; i <= 1000; i += 2) {
        float b = (float)i / 1000 * 0.9995f, d[3] = {0, 0, -1}, p[3] = {0, 0, 0};
        double sum;
        raindrop_ray ray;
        raindrop_order order;
        p[1] = b;
        raindrop_trace(&ray, d, p, (1 - b) * (1 + b), 1.33f);
        sum = (double)ray.fresnel;
        for (k = 0; k < 600; k++) {
            raindrop_trace_order(&order, d, p, (1 - b) * (1 + b), 1.33f, k);
            if (k == 3) worst_rest = support_larger(worst_rest, fabs(sum + (double)order.rest - 1));
            sum += (double)order.weight;
        }
        worst = support_larger(worst, fabs(sum - 1));
    }
    EXPECT(worst <= 1e-6);
    EXPECT(worst_rest <= 1e-6);
    REPORT("energy of all orders, largest distance from 1", worst, "");
}

TEST(raindrop_footprints_are_the_derivatives)
{
    int i, k;
    for (i = 1; i < 950; i++) {
        double b = i / 1000.0, h = 1e-4, turn[2][4];
        float d[3] = {0, 0, -1}, p[3] = {0, 0, 0};
        raindrop_order order;
        int j;
        for (j = 0; j < 2; j++) {
            double x = b + (j ? h : -h), in = asin(x), out = asin(x / 1.33);
            for (k = 0; k < 4; k++) turn[j][k] = 2 * (in - out) + k * (acos(-1.0) - 2 * out);
        }
        p[0] = (float)b;
        for (k = 0; k < 4; k++) {
            double angle = 0.5 * (turn[0][k] + turn[1][k]),
                   truth = sqrt(fabs((turn[1][k] - turn[0][k]) / (2 * h) * sin(angle) / b));
            raindrop_trace_order(&order, d, p, (float)(1 - b * b), 1.33f, k);
            EXPECT_NEAR(order.footprint, truth, 1e-3 + 1e-3 * truth);
        }
    }
}

TEST(raindrop_spheroids_are_traced)
{
    uint64_t seed = 21;
    double sphere = 0, flat = 0;
    int i, c;
    for (i = 0; i < 20000; i++) {
        double r = sqrt(support_uniform(&seed)) * 0.99, angle = 6.283 * support_uniform(&seed);
        float d[3], p[3], m, ratio = i & 1 ? 1.0f : 0.7f;
        reference_real origin[3], direction[3], length = 0;
        reference_drop truth;
        raindrop_ray ray;
        raindrop_sprite_ray(d, p, &m, (float)(r * cos(angle)), (float)(r * sin(angle)), 3);
        for (c = 0; c < 3; c++) {
            direction[c] = (reference_real)d[c];
            origin[c] = (reference_real)p[c];
            length += direction[c] * direction[c];
        }
        length = sqrtl(length);
        for (c = 0; c < 3; c++) direction[c] /= length;
        truth = reference_trace(origin, direction, (reference_real)ratio, (reference_real)1.33f);
        if (truth.b > 0.99L) continue;
        EXPECT_EQ(raindrop_trace_spheroid(&ray, d, p, ratio, 1.33f), truth.hit);
        if (!truth.hit) continue;
        if (i & 1) sphere = support_larger(sphere, rt_distance(ray.refracted, truth.refracted));
        else flat = support_larger(flat, rt_distance(ray.refracted, truth.refracted));
    }
    EXPECT(sphere <= 5e-6);
    EXPECT(flat <= 2e-5);
    REPORT("spheroid of ratio 1, largest error", sphere, "");
    REPORT("spheroid of ratio 0.7, largest error", flat, "");
}

TEST(raindrop_spheroid_of_ratio_one_is_the_sphere)
{
    int i, c;
    double worst = 0;
    for (i = 0; i < 9000; i++) {
        float b = (float)i * 1e-4f, d[3] = {0, 0, -1}, p[3] = {0, 0, 0};
        raindrop_ray a, s;
        p[0] = 0.6f * b;
        p[1] = 0.8f * b;
        raindrop_trace(&a, d, p, 1 - raindrop__dot(p, p), 1.33f);
        EXPECT_EQ(raindrop_trace_spheroid(&s, d, p, 1, 1.33f), 1);
        for (c = 0; c < 3; c++) {
            worst = support_larger(worst, fabs((double)a.refracted[c] - (double)s.refracted[c]));
            worst = support_larger(worst, fabs((double)a.reflected[c] - (double)s.reflected[c]));
        }
        worst = support_larger(worst, fabs((double)a.fresnel - (double)s.fresnel));
    }
    EXPECT(worst <= 1e-6);
    REPORT("spheroid of ratio 1 against the sphere, b <= 0.9", worst, "");
}

/* ---- maps ---- */

TEST(raindrop_map_has_table_2_1)
{
    static const struct { int resolution; double angle, distance; } rows[11] = {
        {1024, 45, 1.4142},       {512, 26.5651, 2.2361},  {256, 14.0362, 4.1231},  {128, 7.1250, 8.0623},
        {64, 3.5763, 16.0312},    {32, 1.7899, 32.0156},   {16, 0.8952, 64.0078},   {8, 0.4476, 128.0039},
        {4, 0.2238, 256.0020},    {2, 0.1119, 512.0010},   {1, 0.0560, 1024.0005}};
    raindrop_map *map = NULL;
    int i, resolution = 0;
    size_t texels = 0;
    if (!EXPECT_EQ(reference_map(&map, 1024, 32, RAINDROP_WATER), SAT_OK)) return;
    EXPECT_EQ(raindrop_map_levels(map), 11);
    for (i = 0; i < 11; i++) {
        double distance = raindrop_map_distance(i), angle = asin(1 / distance) * 180 / acos(-1.0);
        EXPECT(raindrop_map_level(&resolution, map, i) != NULL);
        EXPECT_EQ(resolution, rows[i].resolution);
        EXPECT_NEAR(distance, rows[i].distance, 0.5e-4);
        EXPECT_NEAR(angle, rows[i].angle, 0.5e-4 + 1e-9);
        texels += (size_t)resolution * (size_t)resolution;
    }
    EXPECT_NEAR((double)(texels * 32) / 1e6, 44.7, 0.05);
    EXPECT(raindrop_map_level(NULL, map, 11) == NULL && raindrop_map_level(NULL, map, -1) == NULL);
    raindrop_map_destroy(map);
}

TEST(raindrop_map_holds_the_traced_drop)
{
    raindrop_map *map = NULL;
    int level, r = 0, x, y, c, inside = 0;
    double covered = 0;
    if (!EXPECT_EQ(reference_map(&map, 256, 32, RAINDROP_WATER), SAT_OK)) return;
    for (level = 0; level < 9; level += 2) {
        const float *texels = raindrop_map_level(&r, map, level);
        for (y = 0; y < r; y += 3) {
            for (x = 0; x < r; x += 3) {
                const float *texel = texels + 8 * (y * r + x);
                reference_real s = (2 * x + 1) / (reference_real)r - 1, t = (2 * y + 1) / (reference_real)r - 1,
                               tangent = powl(2, -level);
                reference_real origin[3] = {0, 0, 0}, direction[3],
                               length = sqrtl(1 + (s * s + t * t) * tangent * tangent);
                reference_drop truth;
                origin[2] = sqrtl(1 + powl(4, level));
                direction[0] = s * tangent / length;
                direction[1] = t * tangent / length;
                direction[2] = -1 / length;
                if (s * s + t * t > 1.0L + 4.0L / r) {
                    if (fabsl(s) > 1 ||
                        (fabsl(s) - 1.0L / r) * (fabsl(s) - 1.0L / r) + (fabsl(t) - 1.0L / r) * (fabsl(t) - 1.0L / r) >=
                            1)
                        for (c = 0; c < 8; c++) EXPECT(texel[c] == 0);
                    continue;
                }
                truth = reference_trace(origin, direction, 1, (reference_real)RAINDROP_WATER);
                if (!truth.hit || s * s + t * t > 0.999L) continue;
                inside++;
                EXPECT(rt_distance(texel, truth.reflected) < 4e-6);
                EXPECT(rt_distance(texel + 4, truth.refracted) < 4e-6);
                EXPECT_NEAR(texel[3], truth.fresnel, 4e-6);
                EXPECT(texel[7] > 0 && texel[7] <= 1);
            }
        }
    }
    EXPECT(inside > 1000);
    {
        const float *texels = raindrop_map_level(&r, map, 0);
        for (c = 0; c < r * r; c++) covered += (double)texels[8 * c + 7];
    }
    EXPECT_REL(covered / (r * r), acos(-1.0) / 4, 2e-4); /* the disc's share of its square */
    raindrop_map_destroy(map);
}

TEST(raindrop_map_as_half_floats)
{
    raindrop_map *map = NULL;
    uint16_t *half = (uint16_t *)malloc(64 * 64 * 8 * sizeof(uint16_t));
    const float *texels;
    int i;
    if (!EXPECT_EQ(reference_map(&map, 64, 32, RAINDROP_WATER), SAT_OK)) return;
    texels = raindrop_map_level(NULL, map, 0);
    EXPECT_EQ(raindrop_map_level_half(half, map, 0), SAT_OK);
    for (i = 0; i < 64 * 64 * 8; i++)
        EXPECT_NEAR(sat__half_to_float(half[i]), texels[i], 4.9e-4 * fabs((double)texels[i]) + 3e-8);
    EXPECT_EQ(raindrop_map_level_half(half, map, 7), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_map_level_half(NULL, map, 0), SAT_ERR_ARGUMENT);
    raindrop_map_destroy(map);
    free(half);
}

TEST(raindrop_map_lookup_interpolates_distances)
{
    raindrop_map *map = NULL;
    double worst = 0, off = 0;
    int i;
    if (!EXPECT_EQ(reference_map(&map, 512, 32, RAINDROP_WATER), SAT_OK)) return;
    for (i = 0; i < 500; i++) {
        float q[8], d[3], p[3], m, s = 0.7f * (float)i / 500, distance = 1.5f + 0.02f * (float)i;
        raindrop_ray ray;
        raindrop_map_sample(q, map, s, 0.1f, distance);
        raindrop_sprite_ray(d, p, &m, s, 0.1f, distance);
        raindrop_trace(&ray, d, p, m, RAINDROP_WATER);
        worst = support_larger(worst, fabs((double)q[4] - (double)ray.refracted[0]));
        raindrop_map_sample(q, map, s, 0.1f, 2 * distance); /* a level too far: what a wrong bias would read */
        off = support_larger(off, fabs((double)q[4] - (double)ray.refracted[0]));
    }
    EXPECT(worst < 0.02);
    EXPECT(off > 3 * worst);
    REPORT("map lookup, largest error", worst, "");
    raindrop_map_destroy(map);
}

TEST(raindrop_map_refuses_bad_sizes)
{
    raindrop_map *map;
    static const int bad[6] = {0, -1, 3, 100, 8192, 1023};
    int i;
    for (i = 0; i < 6; i++) EXPECT_EQ(reference_map(&map, bad[i], 32, 1.33f), SAT_ERR_ARGUMENT);
    EXPECT(map == NULL);
    EXPECT_EQ(reference_map(&map, 16, 0, 1.33f), SAT_ERR_ARGUMENT);
    EXPECT_EQ(reference_map(&map, 16, 32, 0), SAT_ERR_ARGUMENT);
    EXPECT_EQ(reference_map(&map, 16, 32, (float)NAN), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_map_create(NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(reference_map(&map, 1, 1, 1 / 1.33f), SAT_OK);
    EXPECT_EQ(raindrop_map_levels(map), 1);
    raindrop_map_destroy(map);
    raindrop_map_destroy(NULL);
}

/* ---- environment ---- */

TEST(raindrop_environment_keeps_the_picture)
{
    const float *sky = rt_sky();
    const raindrop_environment *environment = rt_environment();
    const raindrop_environment_stats stats = rt_sky_stats;
    sat_image image = sat_image_f32(sky, RT_SKY_W, RT_SKY_H, 3);
    uint64_t seed = 4;
    double sum = 0, n = 0, mean[3] = {0, 0, 0}, total = 0;
    float top[3], d[3] = {0.1f, 0.2f, 0.3f};
    int i, c, x, y;
    EXPECT(stats.nan == 0 && stats.infinite == 0 && stats.negative == 0 && stats.clamped == 0 && stats.bytes > 1000000);
    for (i = 0; i < 20000; i++) {
        double v[3], truth[3];
        float got[3];
        for (c = 0; c < 3; c++) v[c] = support_gaussian(&seed);
        for (c = 0; c < 3; c++) d[c] = (float)v[c];
        raindrop_environment_sample(got, environment, d, 0);
        reference_environment(truth, &image, v);
        for (c = 0; c < 3; c++) {
            double e = ((double)got[c] - truth[c]) / (truth[c] + 0.05);
            sum += e * e;
            n += 1;
        }
    }
    EXPECT(sqrt(sum / n) < 0.15); /* edges of trees and sun, softened by at most a texel */
    REPORT("environment, rms error of a lookup", sqrt(sum / n), "relative");
    /* the widest cone sees the mean of the sphere */
    for (y = 0; y < RT_SKY_H; y++) {
        double w = sin(acos(-1.0) * (y + 0.5) / RT_SKY_H);
        for (x = 0; x < RT_SKY_W; x++)
            for (c = 0; c < 3; c++) mean[c] += w * (double)sky[3 * (y * RT_SKY_W + x) + c];
        total += w * RT_SKY_W;
    }
    raindrop_environment_sample(top, environment, d, 100);
    for (c = 0; c < 3; c++) EXPECT_REL(top[c], mean[c] / total, 0.01);
}

/* Middle of the picture is -z, right of it +x, the top +y; and across the seam, the poles and the folds nothing
   jumps. */
TEST(raindrop_environment_has_no_seams)
{
    enum { W = 64, H = 32 };
    static float sky[3 * W * H];
    const raindrop_environment_options o = rt_no_far();
    raindrop_environment *environment = NULL;
    sat_image image;
    double pi = acos(-1.0), worst = 0, step = 0;
    float rgb[3], last[3] = {0, 0, 0};
    int x, y, i, ring;
    for (y = 0; y < H; y++)
        for (x = 0; x < W; x++) {
            double v = pi * (y + 0.5) / H, u = 2 * pi * ((x + 0.5) / W - 0.5);
            float *p = sky + 3 * (y * W + x);
            p[0] = (float)(1 + sin(v) * sin(u));  /* 1 + x */
            p[1] = (float)(1 + cos(v));           /* 1 + y */
            p[2] = (float)(1 - sin(v) * cos(u));  /* 1 + z */
        }
    image = sat_image_f32(sky, W, H, 3);
    if (!EXPECT_EQ(raindrop_environment_create(&environment, &image, &o, NULL), SAT_OK)) return;
    for (ring = 0; ring < 3; ring++) {
        for (i = 0; i <= 2000; i++) {
            double a = 2 * pi * i / 2000;
            float d[3];
            int c;
            d[0] = (float)(ring == 1 ? 0.02 : sin(a));
            d[1] = (float)(ring == 0 ? 0.01 : ring == 1 ? sin(a) : 0.7);
            d[2] = (float)cos(a);
            raindrop__normalise(d);
            raindrop_environment_sample(rgb, environment, d, 0.05f);
            for (c = 0; c < 3; c++) {
                worst = support_larger(worst, fabs((double)rgb[c] - 1 - (double)d[c]));
                if (i) step = support_larger(step, fabs((double)rgb[c] - (double)last[c]));
                last[c] = rgb[c];
            }
        }
    }
    EXPECT(worst < 0.02);
    EXPECT(step < 0.012);
    raindrop_environment_destroy(environment);
}

TEST(raindrop_environment_repairs_and_counts)
{
    enum { W = 64, H = 32 };
    static float sky[3 * W * H];
    raindrop_environment_options o = rt_no_far();
    raindrop_environment *environment = NULL;
    raindrop_environment_stats stats;
    sat_image image = sat_image_f32(sky, W, H, 3);
    float rgb[3], d[3];
    uint64_t seed = 8;
    int i, c;
    for (i = 0; i < 3 * W * H; i++) sky[i] = 1;
    sky[0] = (float)NAN;
    sky[4] = (float)INFINITY;
    sky[8] = -(float)INFINITY;
    sky[12] = -5;
    sky[300] = 1e8f;
    if (!EXPECT_EQ(raindrop_environment_create(&environment, &image, &o, &stats), SAT_OK)) return;
    EXPECT(stats.nan == 1 && stats.infinite == 2 && stats.negative == 1 && stats.clamped == 0);
    EXPECT_NEAR(stats.largest, 1e8, 1);
    for (i = 0; i < 3000; i++) {
        for (c = 0; c < 3; c++) d[c] = (float)support_gaussian(&seed);
        raindrop_environment_sample(rgb, environment, d, 0.01f * (float)i);
        for (c = 0; c < 3; c++) EXPECT(sat__is_finite(rgb[c]) && rgb[c] >= 0);
        raindrop_environment_far(rgb, environment, d);
        for (c = 0; c < 3; c++) EXPECT(sat__is_finite(rgb[c]) && rgb[c] >= 0);
    }
    raindrop_environment_destroy(environment);
    o.max_radiance = 100;
    EXPECT_EQ(raindrop_environment_create(&environment, &image, &o, &stats), SAT_OK);
    EXPECT(stats.clamped == 2 && stats.largest == 100);
    raindrop_environment_destroy(environment);
}

/* Under a sky of the most light there may be, whatever takes means of it stays finite: blurred near drops above all. */
TEST(raindrop_the_most_light_stays_finite)
{
    enum { W = 8, H = 64 };
    static float sky[3 * 16 * 8], picture[3 * W * H];
    static const float kinds[6][3] = {{0, 0, 0}, {0.01f, 1, 0}, {0.01f, 0, 0.25f}, {0, 0.005f, 0}, {1e18f, 0, 0},
                                      {0.01f, 1e18f, 0.25f}}; /* exposure, aperture, oscillation */
    raindrop_environment_options e = rt_no_far();
    raindrop_environment_stats stats;
    raindrop_environment *environment = NULL;
    raindrop_rain *rain = NULL;
    raindrop_rain_options r = raindrop_rain_defaults();
    raindrop_lamp lamp = raindrop_lamp_defaults();
    sat_image image = sat_image_f32(sky, 16, 8, 3);
    int i, k, bright, bad = 0;
    raindrop__set(lamp.position, 0, 1, -1);
    raindrop__set(lamp.intensity, 1e18f, 1e18f, 1e18f);
    r.count = 300;
    r.box_size[0] = r.box_size[1] = r.box_size[2] = 0.5f;
    EXPECT_EQ(raindrop_rain_create(&rain, &r), SAT_OK);
    e.far_swing = e.bow_by_depth = 1;
    e.bow_optical_depth = 10;
    for (bright = 0; bright < 2; bright++) { /* 3e38 is no light: such a sky is as black as one of infinity */
        for (i = 0; i < 3 * 16 * 8; i++) sky[i] = bright ? 3e38f : 1e36f;
        if (!EXPECT_EQ(raindrop_environment_create(&environment, &image, &e, &stats), SAT_OK)) return;
        EXPECT_EQ(stats.infinite, bright ? 3 * 16 * 8 : 0);
        for (k = 0; k < 12; k++) {
            raindrop_camera camera = raindrop_camera_defaults();
            raindrop_render_options o = raindrop_render_defaults();
            camera.exposure = kinds[k % 6][0];
            camera.aperture = kinds[k % 6][1];
            o.oscillation = kinds[k % 6][2];
            o.orders = k < 6 ? 1 : 3;
            o.exit_fresnel = k < 6;
            o.lamps = &lamp;
            o.lamp_count = k & 1;
            EXPECT_EQ(raindrop_environment_render(picture, 0, W, H, &camera, environment, NULL), SAT_OK);
            EXPECT_EQ(raindrop_veil(picture, 0, W, H, NULL, &camera, environment, NULL), SAT_OK);
            EXPECT_EQ(raindrop_render(picture, 0, W, H, NULL, &camera, rain, environment, &o, NULL), SAT_OK);
            for (i = 0; i < 3 * W * H; i++) bad += !sat__is_finite(picture[i]) || picture[i] < 0;
        }
        raindrop_environment_destroy(environment);
    }
    EXPECT_EQ(bad, 0);
    e.sun_irradiance[1] = -1; /* a sun that takes light away */
    EXPECT_EQ(raindrop_environment_create(&environment, &image, &e, NULL), SAT_ERR_ARGUMENT);
    raindrop_rain_destroy(rain);
}

TEST(raindrop_environment_reads_every_format_and_layout)
{
    enum { S = 32 };
    static unsigned char bytes[6 * S * S * 4];
    static uint16_t half[6 * S * S * 3];
    raindrop_environment_options o = rt_no_far();
    raindrop_environment *environment = NULL;
    sat_image image;
    float rgb[3], d[6][3] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    int i;
    for (i = 0; i < 6 * S * S; i++) {
        int face = i / (S * S);
        bytes[4 * i] = (unsigned char)(40 * face);
        bytes[4 * i + 1] = 255;
        bytes[4 * i + 2] = 128;
        half[3 * i] = sat__half_from_float((float)face);
        half[3 * i + 1] = half[3 * i + 2] = 0;
    }
    memset(&image, 0, sizeof image);
    image.pixels = bytes;
    image.width = S;
    image.height = 6 * S;
    image.channels = 4;
    image.stride = 4 * S;
    image.format = SAT_U8;
    o.layout = RAINDROP_LAYOUT_CUBE;
    o.scale = 1 / 255.f;
    o.decode_srgb = 1;
    if (!EXPECT_EQ(raindrop_environment_create(&environment, &image, &o, NULL), SAT_OK)) return;
    for (i = 0; i < 6; i++) {
        raindrop_environment_sample(rgb, environment, d[i], 0);
        EXPECT_NEAR(rgb[0], sat__srgb_decode((float)(40 * i) / 255.f), 1e-4);
        EXPECT_NEAR(rgb[1], 1, 1e-5);
        EXPECT_NEAR(rgb[2], sat__srgb_decode(128 / 255.f), 1e-4);
    }
    raindrop_environment_destroy(environment);
    image.pixels = half;
    image.channels = 3;
    image.stride = 6 * S;
    image.format = SAT_F16;
    o.scale = 1;
    o.decode_srgb = 0;
    EXPECT_EQ(raindrop_environment_create(&environment, &image, &o, NULL), SAT_OK);
    for (i = 0; i < 6; i++) {
        raindrop_environment_sample(rgb, environment, d[i], 0);
        EXPECT_NEAR(rgb[0], i, 1e-4);
    }
    raindrop_environment_destroy(environment);
}

/* Mips and the wrapping table see the same light. */
TEST(raindrop_environment_filters_agree)
{
    float *sky = (float *)malloc(sizeof(float) * 3 * RT_SKY_W * RT_SKY_H);
    raindrop_environment_options o = rt_no_far();
    raindrop_environment *mips = NULL, *boxes = NULL;
    sat_image image;
    uint64_t seed = 6;
    double sum = 0, n = 0;
    int i, c;
    for (i = 0; i < 3 * RT_SKY_W * RT_SKY_H; i++)
        sky[i] = rt_sky()[i] < 3 ? rt_sky()[i] : 3; /* no sun: filters differ in shape */
    image = sat_image_f32(sky, RT_SKY_W, RT_SKY_H, 3);
    EXPECT_EQ(raindrop_environment_create(&mips, &image, &o, NULL), SAT_OK);
    o.filter = RAINDROP_FILTER_SAT;
    if (!EXPECT_EQ(raindrop_environment_create(&boxes, &image, &o, NULL), SAT_OK)) return;
    for (i = 0; i < 4000; i++) {
        float a[3], b[3], d[3], footprint = 0.02f + 0.3f * (float)support_uniform(&seed);
        for (c = 0; c < 3; c++) d[c] = (float)support_gaussian(&seed);
        if (fabsf(d[1]) > 2 * (fabsf(d[0]) + fabsf(d[2]))) continue; /* near the poles a box is no cone */
        raindrop_environment_sample(a, mips, d, footprint);
        raindrop_environment_sample(b, boxes, d, footprint);
        for (c = 0; c < 3; c++) {
            double e = ((double)a[c] - (double)b[c]) / ((double)b[c] + 0.1);
            sum += e * e;
            n += 1;
        }
    }
    EXPECT(sqrt(sum / n) < 0.2);
    REPORT("mips against boxes, rms", sqrt(sum / n), "relative");
    {   /* across the seam the box wraps around */
        float a[3], b[3], left[3] = {-0.001f, 0, 1}, right[3] = {0.001f, 0, 1};
        raindrop_environment_sample(a, boxes, left, 0.3f);
        raindrop_environment_sample(b, boxes, right, 0.3f);
        for (c = 0; c < 3; c++) EXPECT_REL(a[c], b[c], 0.02);
    }
    raindrop_environment_destroy(mips);
    raindrop_environment_destroy(boxes);
    free(sky);
}

/* A far drop in front of a uniform sky has the sky's colour: no order is lost, none counted twice. */
TEST(raindrop_far_drop_conserves_energy)
{
    enum { W = 64, H = 32 };
    static float sky[3 * W * H];
    raindrop_environment_options o = raindrop_environment_defaults();
    raindrop_environment *environment = NULL;
    sat_image image = sat_image_f32(sky, W, H, 3);
    float rgb[3], d[3] = {0.3f, -0.5f, 0.2f};
    int i, orders;
    for (i = 0; i < 3 * W * H; i++) sky[i] = 2.5f;
    for (orders = 0; orders <= 3; orders++) {
        o.far_orders = orders;
        o.far_samples = orders == 3 ? 256 : 16;
        if (!EXPECT_EQ(raindrop_environment_create(&environment, &image, &o, NULL), SAT_OK)) return;
        raindrop_environment_far(rgb, environment, d);
        for (i = 0; i < 3; i++) EXPECT_REL(rgb[i], 2.5, 2e-6);
        raindrop_environment_destroy(environment);
    }
}

TEST(raindrop_environment_refuses_nonsense)
{
    static float sky[3 * 8 * 4];
    raindrop_environment *environment;
    raindrop_environment_options o = raindrop_environment_defaults();
    sat_image image = sat_image_f32(sky, 8, 4, 3), bad = image;
    EXPECT_EQ(raindrop_environment_create(&environment, NULL, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_environment_create(NULL, &image, NULL, NULL), SAT_ERR_ARGUMENT);
    bad.channels = 2;
    EXPECT_EQ(raindrop_environment_create(&environment, &bad, NULL, NULL), SAT_ERR_ARGUMENT);
    o.resolution = 100;
    EXPECT_EQ(raindrop_environment_create(&environment, &image, &o, NULL), SAT_ERR_ARGUMENT);
    o.resolution = 64;
    o.layout = RAINDROP_LAYOUT_CUBE;
    EXPECT_EQ(raindrop_environment_create(&environment, &image, &o, NULL), SAT_ERR_ARGUMENT);
    o.layout = RAINDROP_LAYOUT_EQUIRECT;
    o.n = (float)NAN;
    EXPECT_EQ(raindrop_environment_create(&environment, &image, &o, NULL), SAT_ERR_ARGUMENT);
    o.n = 1.33f;
    o.far_samples = 3;
    EXPECT_EQ(raindrop_environment_create(&environment, &image, &o, NULL), SAT_ERR_ARGUMENT);
    o.far_samples = 64;
    o.bow_optical_depth = 1;
    raindrop__set(o.sun_direction, 0, 3, 0);
    EXPECT_EQ(raindrop_environment_create(&environment, &image, &o, NULL), SAT_ERR_ARGUMENT);
    EXPECT(environment == NULL);
    raindrop_environment_destroy(NULL);
}

/* ---- rainbows ---- */

TEST(raindrop_bows_stand_where_they_should)
{
    static float profile[3 * 7200];
    double pi = acos(-1.0), degrees = 180 / pi, best[2] = {0, 0}, at[2] = {0, 0}, energy = 0;
    int i, k;
    EXPECT_NEAR(180 - raindrop_bow_angle(1, 1.333) * degrees, 42.1, 0.1);
    EXPECT_NEAR(raindrop_bow_angle(2, 1.333) * degrees - 180, 50.9, 0.1);
    for (k = 1; k <= 3; k++) { /* the stationary angle, found by search */
        double least = 1e9;
        for (i = 1; i < 100000; i++) {
            double b = i / 100000.0, r = asin(b / 1.333), turn = 2 * (asin(b) - r) + k * (pi - 2 * r);
            if (turn < least) least = turn;
        }
        EXPECT_NEAR(raindrop_bow_angle(k, 1.333), least, 1e-7);
    }
    EXPECT_EQ(raindrop_bow_profile(profile, 7200, 0), SAT_OK);
    for (i = 0; i < 7200; i++) {
        double from_antisolar = 180 - (i + 0.5) / 7200 * 180, l = 0.7152 * (double)profile[3 * i + 1] +
                                                                  0.2126 * (double)profile[3 * i] +
                                                                  0.0722 * (double)profile[3 * i + 2];
        EXPECT(l >= 0);
        k = from_antisolar > 47 && from_antisolar < 56;
        if ((k || (from_antisolar > 38 && from_antisolar < 46)) && l > best[k]) {
            best[k] = l;
            at[k] = from_antisolar;
        }
        energy += (double)profile[3 * i + 1] * 2 * pi * (cos(pi * i / 7200) - cos(pi * (i + 1) / 7200));
    }
    /* the brightest place lies inside the primary by about the sun's radius, outside the secondary */
    EXPECT_NEAR(at[0], 42.1, 0.6);
    EXPECT_NEAR(at[1], 50.9, 0.8);
    EXPECT(best[0] > 1.5 * best[1]);
    REPORT("brightest angle of the primary bow", at[0], "degrees");
    REPORT("brightest angle of the secondary bow", at[1], "degrees");
    /* red outside the primary, inside the secondary */
    for (k = 0; k < 2; k++) {
        int red = (int)((180 - (k ? 50.4 : 42.35)) * 40), blue = (int)((180 - (k ? 53.3 : 40.75)) * 40);
        EXPECT(profile[3 * red] > profile[3 * red + 2]);
        EXPECT(profile[3 * blue + 2] > profile[3 * blue]);
    }
    {   /* the means of orders 1 and 2 over the disc at the middle of the spectrum */
        double mean = 0;
        float d[3] = {0, 0, -1}, p[3] = {0, 0, 0};
        raindrop_order order;
        for (i = 0; i < 10000; i++) {
            float b2 = ((float)i + 0.5f) / 10000;
            p[0] = sqrtf(b2);
            for (k = 1; k <= 2; k++) {
                raindrop_trace_order(&order, d, p, 1 - b2, 1.3345f, k);
                mean += (double)order.weight / 10000;
            }
        }
        EXPECT_REL(energy, mean, 0.01);
    }
    REPORT("share of the light in both bows", energy, "");
    EXPECT_EQ(raindrop_bow_profile(NULL, 100, 0), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_bow_profile(profile, 3, 0), SAT_ERR_ARGUMENT);
}

/* Airy's integral against its tabulated values, and the arcs against the maxima of its square, at 1.0188 and 3.2482. */
TEST(raindrop_bows_have_supernumerary_arcs)
{
    static const double values[5][2] = {{0, 0.3550280538878}, {1, 0.5355608832924}, {-2, 0.0349241304233},
                                        {2.338107410460, 0}, {10, 0.0402412384864}};
    static const double diameters[3] = {0.2, 0.5, 2};
    static float airy[RAINDROP__AIRY_COUNT], profile[3 * 7200], geometry[3 * 7200];
    double n = raindrop_water_index(550), h = 9.0 / 4 * sqrt((4 - n * n) / pow(n * n - 1, 3));
    int i, k;
    raindrop__fill_airy(airy);
    for (i = 0; i < 5; i++) EXPECT_NEAR(raindrop__airy(airy, values[i][0]), values[i][1], 2e-5);
    EXPECT_EQ(raindrop_bow_profile(geometry, 7200, 0), SAT_OK);
    for (k = 0; k < 3; k++) {
        double s = pow(acos(-1.0) * diameters[k] * 1e6 / 550, 2.0 / 3) / cbrt(h) * acos(-1.0) / 180, sum[2] = {0, 0};
        double bow = 180 - raindrop_bow_angle(1, n) * 180 / acos(-1.0);
        double first = bow - 1.0188 / s, arc = bow - 3.2482 / s;
        int best = 0;
        EXPECT_EQ(raindrop_bow_profile(profile, 7200, diameters[k]), SAT_OK);
        for (i = 0; i < 7200; i++) {
            double weight = cos(acos(-1.0) * i / 7200) - cos(acos(-1.0) * (i + 1) / 7200);
            sum[0] += (double)profile[3 * i + 1] * weight;
            sum[1] += (double)geometry[3 * i + 1] * weight;
            if (i < 170 * 40 && profile[3 * i + 1] > profile[3 * best + 1]) best = i;
        }
        EXPECT_REL(sum[0], sum[1], 0.005); /* no light is lost or won */
        EXPECT_NEAR(180 - (best + 0.5) / 40, first, 0.25);
        REPORT("bow of Airy's theory, brightest green", 180 - (best + 0.5) / 40, "degrees");
        if (k == 2) continue; /* of large drops the sun's disc blurs the arcs */
        for (best = i = (int)((180 - arc - 0.4) * 40); i < (int)((180 - arc + 0.4) * 40); i++)
            if (profile[3 * i + 1] > profile[3 * best + 1]) best = i;
        EXPECT_NEAR(180 - (best + 0.5) / 40, arc, 0.25);
        EXPECT(profile[3 * best + 1] > 1.3f * geometry[3 * best + 1]); /* an arc, not a slope */
        REPORT("first supernumerary arc, green", 180 - (best + 0.5) / 40, "degrees");
    }
    EXPECT_EQ(raindrop_bow_profile(profile, 7200, 7), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_bow_profile(profile, 7200, -1), SAT_ERR_ARGUMENT);
}

TEST(raindrop_environment_shows_the_bows)
{
    enum { W = 256, H = 128 };
    static float sky[3 * W * H];
    raindrop_environment_options o = rt_no_far();
    raindrop_environment *environment = NULL;
    sat_image image = sat_image_f32(sky, W, H, 3);
    double best = 0, at = 0;
    int i;
    o.bow_optical_depth = 1;
    o.resolution = 1024;
    raindrop__set(o.sun_direction, 0, 0.5f, 0.8660254f); /* 30 degrees high, behind the viewer */
    if (!EXPECT_EQ(raindrop_environment_create(&environment, &image, &o, NULL), SAT_OK)) return;
    for (i = 0; i < 6000; i++) { /* upwards from the antisolar point */
        double a = i / 6000.0 * acos(-1.0) / 3, elevation = a - acos(-1.0) / 6, l;
        float d[3], rgb[3];
        raindrop__set(d, 0, (float)sin(elevation), (float)-cos(elevation));
        raindrop_environment_sample(rgb, environment, d, 0);
        l = (double)rgb[1];
        if (l > best) { best = l; at = a * 180 / acos(-1.0); }
    }
    EXPECT_NEAR(at, 41.8, 0.6);
    {
        float rgb[3], up[3] = {0, 0.5f, 0.8660254f};
        raindrop_environment_far(rgb, environment, up); /* drops show light that the sky without bows would not have */
        EXPECT(rgb[1] > 0);
    }
    raindrop_environment_destroy(environment);
}

/* ---- rain ---- */

static const double rt_gunn_kinzer[][2] = {{0.1, 0.27}, {0.2, 0.72}, {0.3, 1.17}, {0.4, 1.62}, {0.5, 2.06}, {0.6, 2.47},
                                           {0.8, 3.27}, {1.0, 4.03}, {1.2, 4.64}, {1.4, 5.17}, {1.6, 5.65}, {1.8, 6.09},
                                           {2.0, 6.49}, {2.4, 7.27}, {3.0, 8.06}, {3.4, 8.44}, {4.0, 8.83}, {4.4, 8.98},
                                           {5.0, 9.09}, {5.4, 9.14}, {5.8, 9.17}};

TEST(raindrop_terminal_velocity_fits_the_measured_one)
{
    double sum = 0, atlas = 0, last = 0;
    int i, n = (int)(sizeof rt_gunn_kinzer / sizeof rt_gunn_kinzer[0]), big = 0;
    for (i = 0; i < n; i++) {
        double d = rt_gunn_kinzer[i][0], truth = rt_gunn_kinzer[i][1], e = raindrop_terminal_velocity(d) / truth - 1;
        sum += e * e;
        if (d >= 0.6) { /* the table itself against an independent fit, Atlas et al. 1973 */
            e = (9.65 - 10.3 * exp(-0.6 * d)) / truth - 1;
            atlas += e * e;
            big++;
        }
    }
    EXPECT(sqrt(sum / n) <= 0.04);
    EXPECT(sqrt(atlas / big) <= 0.015);
    REPORT("terminal velocity, rms from Gunn and Kinzer", 100 * sqrt(sum / n), "%");
    for (i = 1; i <= 6000; i++) { /* grows everywhere, down to a micrometre */
        double v = raindrop_terminal_velocity(i * 1e-3);
        EXPECT(v > last);
        last = v;
    }
    EXPECT_REL(raindrop_terminal_velocity(1e-3), 9.80665 * (1 - 1.204 / 998.2) * 998.2 * 1e-12 / (18 * 1.81e-5), 1e-3);
    EXPECT(raindrop_terminal_velocity(0) == 0 && raindrop_terminal_velocity(-1) == 0 &&
           raindrop_terminal_velocity(NAN) == 0);
}

TEST(raindrop_shapes_and_sizes_follow_their_formulas)
{
    double pi = acos(-1.0), rates[4] = {1, 5, 25, 100};
    int i, k;
    EXPECT_NEAR(raindrop_oblateness(1), 0.983, 1e-3);
    EXPECT_NEAR(raindrop_oblateness(2), 0.928, 1e-3);
    EXPECT_NEAR(raindrop_oblateness(5), 0.706, 1e-3);
    for (i = 10; i <= 60; i++) /* against an independent fit, Pruppacher and Beard 1970 */
        EXPECT_NEAR(raindrop_oblateness(i * 0.1), 1.03 - 0.062 * i * 0.1, 0.035);
    EXPECT(raindrop_oblateness(0.1) == 1 && raindrop_oblateness(9) == raindrop_oblateness(6));
    EXPECT_REL(raindrop_marshall_palmer(0, 10), 8000, 1e-12);
    EXPECT_REL(raindrop_marshall_palmer(2, 25), 8000 * exp(-4.1 * pow(25, -0.21) * 2), 1e-12);
    for (k = 0; k < 4; k++) { /* the water that the published number of drops carries is up to 14 % more than its
                                 rate */
        double flux = 0;
        for (i = 0; i < 6000; i++) {
            double d = (i + 0.5) * 1e-3;
            flux += raindrop_marshall_palmer(d, rates[k]) * 1e-3 * pi / 6 * pow(d * 1e-3, 3) *
                    raindrop_terminal_velocity(d) * 3600e3;
        }
        EXPECT_REL(flux, rates[k], 0.15);
    }
}

static raindrop_drop rt_fall(double diameter_mm, double speed, double dt, int steps, const float *wind)
{
    static const float calm[3] = {0, 0, 0};
    raindrop_drop d = rt_drop(0, 0, 0, (float)(diameter_mm * 0.5e-3));
    int i;
    d.velocity[1] = (float)-speed;
    for (i = 0; i < steps; i++) EXPECT_EQ(raindrop_fall(&d, wind ? wind : calm, dt / steps), SAT_OK);
    return d;
}

static const double rt_diameters[9] = {0.001, 0.005, 0.01, 0.03, 0.1, 0.3, 1, 2, 6};

TEST(raindrop_drag_is_stiff_and_exact)
{
    static const double steps[3] = {1 / 60.0, 10, 1e-4};
    int i, k;
    for (i = 0; i < 9; i++) {
        double d = rt_diameters[i], vt = raindrop_terminal_velocity((double)(float)(d * 0.5e-3) * 2e3);
        for (k = 0; k < 3; k++) {
            raindrop_drop still = rt_fall(d, vt, steps[k], 1, NULL), whole = rt_fall(d, 10, steps[k], 1, NULL),
                          halves = rt_fall(d, 10, steps[k], 2, NULL);
            EXPECT_REL(-still.velocity[1], vt, 1e-6);              /* the fixed point */
            EXPECT_REL(whole.velocity[1], halves.velocity[1], 1e-6); /* h = h/2 + h/2 */
            EXPECT_REL(whole.position[1], halves.position[1], 1e-6);
            EXPECT(-whole.velocity[1] <= 10 && -(double)whole.velocity[1] >= fmin(vt, 10) * 0.999999);
            EXPECT(sat__is_finite(whole.position[1]));
        }
    }
    {   /* 1 um for 10 s: three million time constants */
        raindrop_drop dust = rt_fall(0.001, 10, 10, 1, NULL);
        EXPECT_REL(-dust.velocity[1], raindrop_terminal_velocity(0.001), 1e-6);
    }
}

/* Against 20000 small steps of the classical Runge-Kutta method, falling and rising, also through the apex. */
TEST(raindrop_drag_solves_the_equation)
{
    static const double sizes[4] = {0.12, 0.3, 1, 5}, start[4] = {20, 0, -3, -12};
    int i, k, s;
    for (i = 0; i < 4; i++) {
        for (k = 0; k < 4; k++) {
            double d = (double)(float)(sizes[i] * 0.5e-3) * 2, vt = raindrop_terminal_velocity(d * 1e3),
                   a = 18 * 1.81e-5 / (998.2 * d * d);
            double g = 9.80665 * (1 - 1.204 / 998.2), b = (g - a * vt) / (vt * vt), v = start[k], x = 0,
                   h = 0.5 / 20000;
            raindrop_drop drop = rt_fall(sizes[i], start[k], 0.5, 1, NULL);
            for (s = 0; s < 20000; s++) {
                double k1 = g - a * v - b * v * fabs(v), w = v + h / 2 * k1, k2 = g - a * w - b * w * fabs(w),
                       u = v + h / 2 * k2;
                double k3 = g - a * u - b * u * fabs(u), q = v + h * k3, k4 = g - a * q - b * q * fabs(q);
                x += h * (v + h / 6 * (k1 + k2 + k3));
                v += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
            }
            EXPECT_NEAR(-drop.velocity[1], v, 2e-6 * (1 + fabs(v)));
            EXPECT_NEAR(-drop.position[1], x, 5e-6 * (1 + fabs(x)));
        }
    }
}

TEST(raindrop_wind_carries_drops)
{
    static const float wind[3] = {5, 0.5f, -2}, up[3] = {0, 12, 0};
    int i;
    for (i = 0; i < 9; i++) {
        double vt = raindrop_terminal_velocity(rt_diameters[i]);
        raindrop_drop late = rt_fall(rt_diameters[i], 0, 60, 1, wind),
                      halves = rt_fall(rt_diameters[i], 0, 60, 2, wind), risen = rt_fall(rt_diameters[i], 0, 30, 1, up);
        EXPECT_REL(late.velocity[0], 5, 1e-5);
        EXPECT_REL(late.velocity[2], -2, 1e-5);
        EXPECT_NEAR(late.velocity[1], 0.5 - vt, 1e-5 * (1 + vt));
        EXPECT_REL(late.velocity[0], halves.velocity[0], 1e-6);
        EXPECT_NEAR(risen.velocity[1], 12 - vt, 1e-5 * 12);
    }
    for (i = 0; i < 9; i++) { /* into a gust by one step and by many */
        raindrop_drop whole = rt_fall(rt_diameters[i], 3, 1, 1, wind), many = rt_fall(rt_diameters[i], 3, 1, 100, wind);
        EXPECT_REL(whole.velocity[0], many.velocity[0], 1e-4);
        EXPECT_REL(whole.position[0], many.position[0], 0.125);
        EXPECT_REL(whole.position[1], many.position[1], 1e-4);
    }
    {   /* nothing moves while time stands still, not even by rounding; bad steps are refused */
        raindrop_drop a = rt_fall(1, 3, 0.1, 1, NULL), b = a;
        EXPECT_EQ(raindrop_fall(&a, wind, 0), SAT_OK);
        EXPECT(memcmp(&a, &b, sizeof a) == 0);
        EXPECT_EQ(raindrop_fall(&a, wind, -1), SAT_ERR_ARGUMENT);
        EXPECT_EQ(raindrop_fall(&a, wind, NAN), SAT_ERR_ARGUMENT);
        EXPECT_EQ(raindrop_fall(NULL, wind, 1), SAT_ERR_ARGUMENT);
        a.radius = 0;
        EXPECT_EQ(raindrop_fall(&a, wind, 1), SAT_ERR_ARGUMENT);
    }
}

/* Water per area and hour from the drops in the box, and from what crosses the floor. */
TEST(raindrop_rain_has_the_asked_rate)
{
    static const double rates[3] = {1, 10, 100};
    int k, i, step;
    for (k = 0; k < 3; k++) {
        raindrop_rain_options o = raindrop_rain_defaults();
        raindrop_rain *rain = NULL;
        const raindrop_drop *drops;
        double flux = 0, crossed = 0, mean = 0, pi = acos(-1.0), area, volume;
        double *before;
        int count;
        o.rate_mm_h = rates[k];
        o.box_size[0] = o.box_size[2] = rates[k] > 50 ? 4 : 6;
        o.box_size[1] = 2;
        if (!EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK)) return;
        drops = raindrop_rain_drops(&count, rain);
        area = (double)o.box_size[0] * (double)o.box_size[2];
        volume = area * (double)o.box_size[1];
        before = (double *)malloc(sizeof(double) * (size_t)count);
        for (i = 0; i < count; i++)
            flux += 4 * pi / 3 * pow((double)drops[i].radius, 3) * -(double)drops[i].velocity[1] / volume * 3600e3;
        EXPECT_REL(flux, rates[k], 0.05);
        for (step = 0; step < 40; step++) {
            for (i = 0; i < count; i++) before[i] = (double)drops[i].radius;
            for (i = 0; i < count; i++)
                if (drops[i].position[1] + drops[i].velocity[1] * 0.05f < -1) crossed += 4 * pi / 3 * pow(before[i], 3);
            raindrop_rain_advance(rain, 0.05);
        }
        crossed = crossed / area / 2 * 3600e3;
        EXPECT_REL(crossed, rates[k], 0.05);
        for (i = 0; i < count; i++)
            mean += 4 * pi / 3 * pow((double)drops[i].radius, 3) * -(double)drops[i].velocity[1] / volume * 3600e3;
        EXPECT_REL(mean, rates[k], 0.05); /* sizes stay as they were although drops were replaced */
        REPORT("rain rate asked", rates[k], "mm/h");
        REPORT("rain rate in the box", flux, "mm/h");
        REPORT("rain rate through the floor", crossed, "mm/h");
        raindrop_rain_destroy(rain);
        free(before);
    }
}

/* Water and mean diameter of the drops in the box over what they were asked to be, after every step of one rain, which
   goes on from one length of the step to the next. No drop is above 3 mm: of larger ones there are so few that four
   times as many drops would be needed for as sure a sum. */
static inline void rain_at_any_time_step(float height, const double *dt, const int *steps, int lengths)
{
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    const raindrop_drop *drops;
    double first = 0;
    int i, k, step, count;
    o.diameter_max_mm = 3;
    o.box_size[1] = height;
    o.box_size[0] = o.box_size[2] = 2 / sqrtf(height / 8);
    if (!EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK)) return;
    drops = raindrop_rain_drops(&count, rain);
    for (i = 0; i < count; i++) first += (double)drops[i].radius;
    for (k = 0; k < lengths; k++) {
        double rate = 0, diameter = 0;
        for (step = 0; step < steps[k]; step++) raindrop_rain_advance(rain, dt[k]);
        for (i = 0; i < count; i++) {
            diameter += (double)drops[i].radius / first;
            rate += 4 * acos(-1.0) / 3 * pow((double)drops[i].radius, 3) * -(double)drops[i].velocity[1];
        }
        rate *= 3600e3 / ((double)o.box_size[0] * (double)o.box_size[1] * (double)o.box_size[2]) / o.rate_mm_h;
        if (!EXPECT_NEAR(rate, 1, 0.03) || !EXPECT_NEAR(diameter, 1, 0.03))
            printf("  steps of %g s, box of %g m: %g %g\n", dt[k], (double)height, rate, diameter);
    }
    raindrop_rain_destroy(rain);
}

TEST(raindrop_rain_has_the_asked_rate_at_any_time_step)
{
    static const double dt[6] = {1 / 240.0, 0.2, 1, 5, 10, 3600};
    static const int steps[6] = {12, 6, 5, 3, 2, 1};
    rain_at_any_time_step(8, dt, steps, 6);
    rain_at_any_time_step(4, dt + 4, steps + 4, 2);
}

TEST(raindrop_a_fixed_diameter_has_the_asked_rate)
{
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    int count = 0;
    o.diameter_mm = 2;
    if (!EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK)) return;
    raindrop_rain_drops(&count, rain); /* rate = count / volume * drop * speed */
    EXPECT_REL(count / 512.0 * acos(-1.0) / 6 * 8e-9 * raindrop_terminal_velocity(2) * 3600e3, 10, 0.01);
    raindrop_rain_destroy(rain);
}

/* A place that no float holds is refused, and the drop stays. */
TEST(raindrop_a_fall_of_ages_is_refused)
{
    raindrop_drop drop = {{0, 100, 0}, 1e-3f, {0, -6, 0}, 1}, before = drop;
    float wind[3] = {1, 0, 0};
    EXPECT_EQ(raindrop_fall(&drop, wind, 1e300), SAT_ERR_ARGUMENT);
    EXPECT(memcmp(&drop, &before, sizeof drop) == 0);
    EXPECT_EQ(raindrop_fall(&drop, wind, 1e6), SAT_OK);
    EXPECT_REL((double)drop.position[0], 1e6, 0.01);
}

TEST(raindrop_water_index_is_that_of_water)
{
    EXPECT_NEAR(raindrop_water_index(589.3), 1.333, 5e-4); /* sodium's yellow at 20 degrees */
    EXPECT_NEAR(raindrop_water_index(404.7), 1.3428, 1e-3);
    EXPECT_NEAR(raindrop_water_index(706.5), 1.3300, 1e-3);
    EXPECT(raindrop_water_index(400) > raindrop_water_index(700));
}

TEST(raindrop_sizes_are_marshall_palmer)
{
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    const raindrop_drop *drops;
    int count, i, k, step;
    double lambda = 4.1 * pow(10, -0.21);
    o.count = 200000;
    if (!EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK)) return;
    drops = raindrop_rain_drops(&count, rain);
    EXPECT_EQ(count, 200000);
    for (step = 0; step < 3; step++) {
        for (k = 1; k <= 8; k++) { /* share of drops above k/2 mm */
            double d = 0.5 * k, truth = (exp(-lambda * d) - exp(-lambda * 6)) / (exp(-lambda * 0.1) - exp(-lambda * 6)),
                   n = 0;
            for (i = 0; i < count; i++) n += 2e3 * (double)drops[i].radius > d;
            EXPECT_NEAR(n / count, truth, 4 * sqrt(truth / count) + 1e-5);
        }
        for (i = 0; i < 25 && step < 2; i++) raindrop_rain_advance(rain, 0.2); /* many have been replaced by now */
    }
    raindrop_rain_destroy(rain);
}

TEST(raindrop_rain_stays_in_its_box)
{
    static const double steps[5] = {1 / 60.0, 0, 10, 1e9, 1e-9};
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    const raindrop_drop *drops;
    float moved[3] = {100, -3, 0.5f};
    int count, i, k, c;
    o.count = 20000;
    o.wind[0] = 3;
    o.wind[2] = -40;
    if (!EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK)) return;
    drops = raindrop_rain_drops(&count, rain);
    for (k = 0; k < 12; k++) {
        if (k == 6) EXPECT_EQ(raindrop_rain_set_centre(rain, moved), SAT_OK);
        if (k == 8) { float up[3] = {0, 30, 0}; EXPECT_EQ(raindrop_rain_set_wind(rain, up), SAT_OK); }
        EXPECT_EQ(raindrop_rain_advance(rain, steps[k % 5]), SAT_OK);
        for (i = 0; i < count; i++)
            for (c = 0; c < 3; c++) {
                float centre = k < 6 ? 0 : moved[c];
                if (!(drops[i].position[c] >= centre - 4.0001f && drops[i].position[c] <= centre + 4.0001f))
                    EXPECT_NEAR(drops[i].position[c], centre, 4.0001);
            }
    }
    EXPECT_EQ(raindrop_rain_advance(rain, -1), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_rain_advance(rain, NAN), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_rain_advance(NULL, 1), SAT_ERR_ARGUMENT);
    raindrop_rain_destroy(rain);
}

/* Pausing, gusts, and the published scene: one size, one speed, back at the top where they fell. */
TEST(raindrop_rain_pauses_and_publishes)
{
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    const raindrop_drop *drops;
    uint64_t before;
    int count, i;
    o.count = 5000;
    o.diameter_mm = 2;
    o.speed = 6;
    o.box_size[0] = o.box_size[1] = o.box_size[2] = 2.05f;
    if (!EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK)) return;
    drops = raindrop_rain_drops(&count, rain);
    before = support_hash(drops, sizeof *drops * (size_t)count);
    EXPECT_EQ(raindrop_rain_advance(rain, 0), SAT_OK);
    EXPECT(support_hash(drops, sizeof *drops * (size_t)count) == before);
    {
        raindrop_drop *old = (raindrop_drop *)malloc(sizeof *old * (size_t)count);
        memcpy(old, drops, sizeof *old * (size_t)count);
        EXPECT_EQ(raindrop_rain_advance(rain, 0.1), SAT_OK);
        for (i = 0; i < count; i++) {
            double fallen = (double)old[i].position[1] - (double)drops[i].position[1];
            EXPECT(drops[i].position[0] == old[i].position[0] && drops[i].position[2] == old[i].position[2] &&
                   drops[i].radius == 0.001f);
            EXPECT(fabs(fallen - 0.6) < 1e-5 || fabs(fallen - 0.6 + 2.05) < 1e-5);
        }
        free(old);
    }
    raindrop_rain_destroy(rain);
    o = raindrop_rain_defaults();
    o.count = 3000;
    o.oblate = 1;
    EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK);
    drops = raindrop_rain_drops(&count, rain);
    for (i = 0; i < count; i++)
        EXPECT_NEAR(drops[i].axis_ratio, raindrop_oblateness((double)drops[i].radius * 2e3), 1e-6);
    {
        float gust[3] = {8, 0, 0};
        EXPECT_EQ(raindrop_rain_set_wind(rain, gust), SAT_OK);
        for (i = 0; i < 600; i++) raindrop_rain_advance(rain, 1 / 60.0);
        EXPECT_EQ(rain->settled, 1);
        for (i = 0; i < count; i++) EXPECT_NEAR(drops[i].velocity[0], 8, 1e-3);
    }
    raindrop_rain_destroy(rain);
}

/* Every row of every table at its ends, beyond them and as NaN: create and explain agree, and the sentence begins with
   the option's name. */
typedef struct rt_table { const sat__field *fields; int count; } rt_table;

static const char *rt_explain(int which, void *options, int create, sat_result *result)
{
    static char text[160];
    static float sky[3 * 8 * 48];
    sat_image image = sat_image_f32(sky, 8, 48, 3);
    raindrop_environment *e = NULL;
    raindrop_rain *r = NULL;
    float rgb[3] = {0, 0, 0};
    *result = SAT_OK;
    if (which == 4) {
        raindrop_map *map = NULL;
        raindrop_explain_map(text, sizeof text, (const raindrop_map_options *)options);
        if (create) {
            *result = raindrop_map_create(&map, (const raindrop_map_options *)options);
            raindrop_map_destroy(map);
        }
    } else if (which == 0) {
        raindrop_explain_environment(text, sizeof text, &image, (const raindrop_environment_options *)options);
        if (create) {
            *result = raindrop_environment_create(&e, &image, (const raindrop_environment_options *)options, NULL);
            raindrop_environment_destroy(e);
        }
    } else if (which == 1) {
        raindrop_explain_rain(text, sizeof text, (const raindrop_rain_options *)options);
        if (create) {
            *result = raindrop_rain_create(&r, (const raindrop_rain_options *)options);
            raindrop_rain_destroy(r);
        }
    } else {
        raindrop_rain_options o = raindrop_rain_defaults();
        raindrop_environment_options quick = raindrop_environment_defaults();
        const raindrop_camera *camera = which == 2 ? (const raindrop_camera *)options : NULL;
        const raindrop_render_options *render = which == 3 ? (const raindrop_render_options *)options : NULL;
        image.height = 4;
        o.count = 1;
        quick.far_resolution = 8;
        quick.far_samples = 16;
        EXPECT_EQ(raindrop_environment_create(&e, &image, &quick, NULL), SAT_OK);
        EXPECT_EQ(raindrop_rain_create(&r, &o), SAT_OK);
        raindrop_explain_render(text, sizeof text, 12, 1, 1, camera, render);
        *result = raindrop_render(rgb, 12, 1, 1, NULL, camera, r, e, render, NULL);
        raindrop_environment_destroy(e);
        raindrop_rain_destroy(r);
    }
    return text;
}

TEST(raindrop_options_are_checked_and_named)
{
    const rt_table tables[5] = {
        {raindrop__environment_fields, SAT__COUNT(raindrop__environment_fields)},
        {raindrop__rain_fields, SAT__COUNT(raindrop__rain_fields)},
        {raindrop__camera_fields, SAT__COUNT(raindrop__camera_fields)},
        {raindrop__render_fields, SAT__COUNT(raindrop__render_fields)},
        {raindrop__map_fields, SAT__COUNT(raindrop__map_fields)}};
    raindrop_lamp lamps[16];
    int which, i, at;
    for (i = 0; i < 16; i++) lamps[i] = raindrop_lamp_defaults();
    for (which = 0; which < 5; which++)
        for (i = 0; i < tables[which].count; i++) {
            const sat__field *f = &tables[which].fields[i];
            if (f->type == 'a' || f->type == 't') continue;
            for (at = 0; at < 6; at++) {
                raindrop_environment_options e = raindrop_environment_defaults();
                raindrop_rain_options r = raindrop_rain_defaults();
                raindrop_camera c = raindrop_camera_defaults();
                raindrop_render_options o = raindrop_render_defaults();
                raindrop_map_options m = raindrop_map_defaults();
                void *const each[5] = {&e, &r, &c, &o, &m}, *options = each[which];
                const double values[5] = {f->initial, f->low, f->high, f->low - 1, f->high * 1.1 + 1};
                /* the largest take seconds or gigabytes */
                int large = at == 2 && (strstr(f->name, "resolution") || strstr(f->name, "samples") ||
                                        !strcmp(f->name, "count"));
                int smallest = !strcmp(f->name, "diameter_max_mm") && at == 1; /* not above the other one */
                sat_result result;
                const char *text;
                if (at == 5 && f->type == 'i') continue;
                r.count = 10;
                m.resolution = e.resolution = 16;
                e.far_resolution = 8;
                e.far_samples = 16;
                sat__field_set(f, options, at == 5 ? (double)sat__float_from_bits(0x7fc00000u) : values[at]);
                if (!strcmp(f->name, "look") && at == 1) continue; /* which needs a map */
                o.lamps = lamps;
                if (!strcmp(f->name, "diameter_min_mm") && at == 2) r.diameter_min_mm = 5.9;
                text = rt_explain(which, options, !large, &result);
                if (at < 3 && !smallest) {
                    if (!EXPECT(!*text)) puts(text);
                    EXPECT_EQ(result, SAT_OK);
                } else {
                    if (!EXPECT(smallest || strstr(text, f->name) == text)) puts(text);
                    EXPECT_EQ(result, SAT_ERR_ARGUMENT);
                }
            }
        }
}

TEST(raindrop_sentences_name_what_is_wrong)
{
    static float sky[3 * 8 * 4];
    char text[160];
    sat_image image = sat_image_f32(sky, 8, 4, 3);
    raindrop_environment_options e = raindrop_environment_defaults();
    raindrop_rain_options r = raindrop_rain_defaults();
    raindrop_camera c = raindrop_camera_defaults();
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_map_options m = raindrop_map_defaults();
    EXPECT(strcmp(raindrop_explain_environment(text, sizeof text, &image, NULL), "") == 0);
    EXPECT(strcmp(raindrop_explain_environment(text, sizeof text, NULL, NULL), "image is NULL") == 0);
    EXPECT(raindrop_explain_environment(NULL, 0, NULL, NULL) == NULL);
    e.resolution = 8;
    EXPECT(strcmp(raindrop_explain_environment(text, sizeof text, &image, &e), "resolution is 8; 16..4096 or 0") == 0);
    e.resolution = 0;
    e.sun_direction[2] = sat__float_from_bits(0x7fc00000u);
    raindrop_explain_environment(text, sizeof text, &image, &e);
    EXPECT(strcmp(text, "sun_direction[2] is NaN; -1e18..1e18") == 0);
    EXPECT(strcmp(raindrop_explain_rain(text, sizeof text, NULL), "") == 0);
    r.box_size[1] = -1;
    EXPECT(strcmp(raindrop_explain_rain(text, sizeof text, &r), "box_size[1] is -1; 1e-6..1e18") == 0);
    r.box_size[1] = 1e-6f; /* the end that is named, as a float has it */
    EXPECT(strcmp(raindrop_explain_rain(text, sizeof text, &r), "") == 0);
    EXPECT(strcmp(raindrop_explain_camera(text, sizeof text, NULL), "") == 0);
    c.up[0] = 1;
    EXPECT(strcmp(raindrop_explain_camera(text, sizeof text, &c), "right, up and back are not orthonormal") == 0);
    raindrop_explain_render(text, sizeof text, 8, 1, 2, NULL, NULL);
    EXPECT(strcmp(text, "stride is shorter than a row") == 0);
    EXPECT(strcmp(raindrop_explain_render(text, sizeof text, 12, 0, 1, NULL, NULL), "width is 0; 1..32768") == 0);
    o.look = RAINDROP_LOOK_MAP;
    raindrop_explain_render(text, sizeof text, 12, 1, 1, NULL, &o);
    EXPECT(strcmp(text, "map is NULL, which RAINDROP_LOOK_MAP needs") == 0);
    EXPECT(strcmp(raindrop_explain_map(text, sizeof text, NULL), "") == 0);
    m.resolution = 48;
    EXPECT(strcmp(raindrop_explain_map(text, sizeof text, &m), "resolution is 48; 1..4096, a power of two") == 0);
    c = raindrop_camera_defaults();
    c.depth_far = 0.005f;
    raindrop_explain_camera(text, sizeof text, &c);
    EXPECT(strcmp(text, "depth_far is above 0 but not above a depth_near above 0") == 0);
}

TEST(raindrop_rain_refuses_nonsense)
{
    raindrop_rain *rain;
    raindrop_rain_options o = raindrop_rain_defaults();
    EXPECT_EQ(raindrop_rain_create(NULL, &o), SAT_ERR_ARGUMENT);
    o.rate_mm_h = -1;
    EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_ERR_ARGUMENT);
    o = raindrop_rain_defaults();
    o.box_size[1] = 0;
    EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_ERR_ARGUMENT);
    o.box_size[1] = 1e6f;
    EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_ERR_LIMIT);
    o = raindrop_rain_defaults();
    o.count = -5;
    EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_ERR_ARGUMENT);
    o = raindrop_rain_defaults();
    o.diameter_max_mm = 0.05;
    EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_ERR_ARGUMENT);
    o = raindrop_rain_defaults();
    o.wind[2] = (float)NAN;
    EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_ERR_ARGUMENT);
    EXPECT(rain == NULL);
    raindrop_rain_destroy(NULL);
}

/* ---- pictures ---- */

enum { RT_W = 192, RT_H = 192 };

typedef struct rt_scene {
    raindrop_environment *environment;
    raindrop_camera camera;
    float *background, *picture, *truth;
    unsigned char *mask;
    double key;
} rt_scene;

static rt_scene rt_open(void)
{
    static float background[3 * RT_W * RT_H];
    static double key;
    rt_scene scene;
    const size_t pixels = (size_t)RT_W * RT_H;
    memset(&scene, 0, sizeof scene);
    scene.environment = rt_environment();
    scene.camera = raindrop_camera_defaults();
    scene.camera.depth_near = 0;
    scene.background = (float *)malloc(pixels * 3 * sizeof(float));
    scene.picture = (float *)malloc(pixels * 3 * sizeof(float));
    scene.truth = (float *)malloc(pixels * 3 * sizeof(float));
    scene.mask = (unsigned char *)malloc(pixels);
    if (!(key > 0)) {
        EXPECT_EQ(raindrop_environment_render(background, 0, RT_W, RT_H, &scene.camera, scene.environment, NULL),
                  SAT_OK);
        key = reference_key(background, pixels);
    }
    memcpy(scene.background, background, sizeof background);
    scene.key = key;
    return scene;
}

static void rt_close(rt_scene *scene)
{
    free(scene->background);
    free(scene->picture);
    free(scene->truth);
    free(scene->mask);
}

/* The picture of drops over the background, NaN-free. */
static raindrop_render_stats rt_render(rt_scene *scene, const raindrop_rain *rain,
                                       const raindrop_render_options *options, const float *depth)
{
    raindrop_render_stats stats;
    size_t i, pixels = (size_t)RT_W * RT_H;
    int bad = 0;
    memset(&stats, 0, sizeof stats);
    memcpy(scene->picture, scene->background, pixels * 3 * sizeof(float));
    EXPECT_EQ(raindrop_render(scene->picture, RT_W * 12, RT_W, RT_H, depth, &scene->camera, rain, scene->environment,
                              options, &stats),
              SAT_OK);
    for (i = 0; i < 3 * pixels; i++) bad += !sat__is_finite(scene->picture[i]) || scene->picture[i] < 0;
    EXPECT_EQ(bad, 0);
    EXPECT_EQ(stats.drawn_near + stats.drawn_far + stats.invalid + stats.inside + stats.behind + stats.near_plane +
                  stats.outside + stats.hidden + stats.below_threshold,
              stats.drops);
    return stats;
}

static double rt_error(const rt_scene *scene)
{
    return reference_rmse(scene->picture, scene->truth, scene->mask, (size_t)RT_W * RT_H, scene->key);
}

/* A drop `size` pixels wide (as seen on axis) in a direction given by its slopes. */
static raindrop_drop rt_drop_of(double size, double slope_x, double slope_y)
{
    double focal = 0.5 * RT_H, r = size / 2, distance = sqrt(1 + focal * focal / (r * r)),
           scale = distance / sqrt(1 + slope_x * slope_x + slope_y * slope_y);
    return rt_drop((float)(slope_x * scale), (float)(slope_y * scale), (float)-scale, 1);
}

TEST(raindrop_looks_against_ray_tracing)
{
    static const struct {
        double size, x, y;
    } drops[4] = {{96, 0.03, 0.02}, {40, -0.2, 0.1}, {96, 0.55, 0.35}, {24, 0.55, 0.35}};
    rt_scene scene = rt_open();
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_map *map = NULL;
    int i, look;
    EXPECT_EQ(reference_map(&map, 256, 32, RAINDROP_WATER), SAT_OK);
    o.map = map;
    o.orders = 0;
    for (i = 0; i < 4; i++) {
        raindrop_drop drop = rt_drop_of(drops[i].size, drops[i].x, drops[i].y);
        raindrop_rain *rain = rt_rain_of(&drop, 1);
        double error[4];
        EXPECT(
            reference_render(scene.truth, scene.mask, RT_W, RT_H, 8, &scene.camera, &drop, 1, scene.environment, -1));
        for (look = 0; look < 4; look++) {
            o.look = (raindrop_look)look;
            rt_render(&scene, rain, &o, NULL);
            error[look] = rt_error(&scene);
        }
        EXPECT(error[RAINDROP_LOOK_RAY] < 0.03);
        EXPECT(error[RAINDROP_LOOK_RAY] <= error[RAINDROP_LOOK_SPRITE] * 1.05);
        EXPECT(error[RAINDROP_LOOK_SPRITE] <= error[RAINDROP_LOOK_MAP] * 1.05);
        EXPECT_NEAR(error[RAINDROP_LOOK_AUTO], error[RAINDROP_LOOK_RAY], 1e-9);
        if (i == 2) EXPECT(error[RAINDROP_LOOK_RAY] <= error[RAINDROP_LOOK_SPRITE] / 5);
        REPORT("drop, RMSE of map", error[0], "");
        REPORT("drop, RMSE of sprite", error[1], "");
        REPORT("drop, RMSE of ray", error[2], "");
        raindrop_rain_destroy(rain);
    }
    raindrop_map_destroy(map);
    rt_close(&scene);
}

TEST(raindrop_orders_in_the_picture)
{
    rt_scene scene = rt_open();
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_drop drop = rt_drop_of(100, 0.1, 0.05);
    raindrop_rain *rain = rt_rain_of(&drop, 1);
    raindrop_render_stats stats;
    double with, without;
    EXPECT(reference_render(scene.truth, scene.mask, RT_W, RT_H, 8, &scene.camera, &drop, 1, scene.environment, 3));
    o.orders = 3;
    o.exit_fresnel = 1;
    stats = rt_render(&scene, rain, &o, NULL);
    EXPECT(stats.order_fragments > 6000 && stats.order_fragments <= stats.fragments);
    with = rt_error(&scene);
    o.orders = 0;
    o.exit_fresnel = 0;
    stats = rt_render(&scene, rain, &o, NULL);
    EXPECT(stats.order_fragments == 0);
    without = rt_error(&scene);
    EXPECT(with < 0.9 * without);
    REPORT("all orders, RMSE with them", with, "");
    REPORT("all orders, RMSE of eq 2.5", without, "");
    raindrop_rain_destroy(rain);
    rt_close(&scene);
}

TEST(raindrop_flattened_drop_against_ray_tracing)
{
    rt_scene scene = rt_open();
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_drop drop = rt_drop_of(90, 0.3, -0.2);
    raindrop_rain *rain;
    double flat, round;
    drop.axis_ratio = 0.7f;
    EXPECT(reference_render(scene.truth, scene.mask, RT_W, RT_H, 8, &scene.camera, &drop, 1, scene.environment, -1));
    rain = rt_rain_of(&drop, 1);
    rt_render(&scene, rain, &o, NULL);
    flat = rt_error(&scene);
    drop.axis_ratio = 1;
    EXPECT_EQ(raindrop_rain_set_drops(rain, &drop, 1), SAT_OK);
    rt_render(&scene, rain, &o, NULL);
    round = rt_error(&scene);
    EXPECT(flat < 0.04);
    EXPECT(flat < 0.3 * round);
    REPORT("flattened drop, RMSE", flat, "");
    raindrop_rain_destroy(rain);
    rt_close(&scene);
}

/* The published box: drops of one size, mostly below a pixel. */
static raindrop_rain *rt_published(int count, const sat_threads *threads, const sat_allocator *allocator)
{
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    o.count = count;
    o.diameter_mm = 2;
    o.box_size[0] = o.box_size[1] = o.box_size[2] = 1.05f;
    if (threads) o.threads = *threads;
    if (allocator) o.allocator = *allocator;
    EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK);
    return rain;
}

TEST(raindrop_auto_beats_the_map_in_rain)
{
    rt_scene scene = rt_open();
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_map *map = NULL;
    raindrop_rain *rain = rt_published(20000, NULL, NULL);
    const raindrop_drop *drops = raindrop_rain_drops(NULL, rain);
    raindrop_render_stats stats;
    double error[4], none;
    int look;
    scene.camera.depth_near = 0.01f;
    EXPECT_EQ(reference_map(&map, 256, 32, RAINDROP_WATER), SAT_OK);
    EXPECT(reference_render(scene.truth, NULL, RT_W, RT_H, 8, &scene.camera, drops, 20000, scene.environment, 3));
    none = reference_rmse(scene.background, scene.truth, NULL, (size_t)RT_W * RT_H, scene.key);
    o.map = map;
    for (look = 0; look < 4; look++) {
        o.look = (raindrop_look)look;
        stats = rt_render(&scene, rain, &o, NULL);
        error[look] = reference_rmse(scene.picture, scene.truth, NULL, (size_t)RT_W * RT_H, scene.key);
        EXPECT((stats.drawn_far > 1000) == (look >= RAINDROP_LOOK_RAY));
    }
    EXPECT(error[RAINDROP_LOOK_AUTO] < none); /* sprites of at least a pixel are worse than no rain here */
    EXPECT(error[RAINDROP_LOOK_AUTO] < 0.5 * error[RAINDROP_LOOK_MAP]);
    EXPECT(error[RAINDROP_LOOK_RAY] < error[RAINDROP_LOOK_MAP]);
    REPORT("rain, RMSE without rain", none, "");
    REPORT("rain, RMSE of map", error[0], "");
    REPORT("rain, RMSE of sprite", error[1], "");
    REPORT("rain, RMSE of ray", error[2], "");
    REPORT("rain, RMSE of auto", error[3], "");
    raindrop_rain_destroy(rain);
    raindrop_map_destroy(map);
    rt_close(&scene);
}

/* Averages `steps` still pictures over the exposure (or, with an aperture, over points of the lens) into truth. */
static void rt_average(rt_scene *scene, raindrop_rain *rain, const raindrop_drop *drops, int count, int steps)
{
    raindrop_drop *moved = (raindrop_drop *)malloc(sizeof *moved * (size_t)count);
    raindrop_camera camera = scene->camera;
    raindrop_render_options o = raindrop_render_defaults();
    size_t pixels = (size_t)RT_W * RT_H, k;
    double *sum = (double *)calloc(3 * pixels, sizeof *sum);
    int step, i, c;
    o.orders = 0;
    o.coverage_threshold = 0;
    scene->camera.exposure = scene->camera.aperture = 0;
    for (step = 0; step < steps; step++) {
        double t = ((step + 0.5) / steps - 0.5) * (double)camera.exposure;
        double r = 0.5 * (double)camera.aperture * sqrt((step + 0.5) / steps), a = 2.399963 * step,
               f = (double)camera.focus_distance;
        memcpy(moved, drops, sizeof *moved * (size_t)count);
        for (i = 0; i < count; i++) {
            for (c = 0; c < 3; c++)
                moved[i].position[c] += (float)(t * (double)(drops[i].velocity[c] - camera.velocity[c]));
            if (camera.aperture > 0) { /* seen from a point of the lens, sheared so that the plane of focus stays */
                double z = -(double)moved[i].position[2], shear = z / f - 1;
                moved[i].position[0] += (float)(r * cos(a) * shear);
                moved[i].position[1] += (float)(r * sin(a) * shear);
            }
        }
        raindrop_rain_set_drops(rain, moved, count);
        rt_render(scene, rain, &o, NULL);
        for (k = 0; k < 3 * pixels; k++) sum[k] += (double)scene->picture[k] / steps;
    }
    for (k = 0; k < 3 * pixels; k++) scene->truth[k] = (float)sum[k];
    for (k = 0; k < pixels; k++) scene->mask[k] = memcmp(scene->truth + 3 * k, scene->background + 3 * k, 12) != 0;
    scene->camera = camera;
    raindrop_rain_set_drops(rain, drops, count);
    free(moved);
    free(sum);
}

static raindrop_drop *rt_falling(int count, double lo, double hi, uint64_t seed)
{
    raindrop_drop *drops = (raindrop_drop *)malloc(sizeof *drops * (size_t)count);
    int i;
    for (i = 0; i < count; i++) {
        double z = -(lo + (hi - lo) * support_uniform(&seed)), mm = 0.6 + 2.4 * support_uniform(&seed);
        double x = z * (2 * support_uniform(&seed) - 1), y = z * (2 * support_uniform(&seed) - 1);
        drops[i] = rt_drop((float)x, (float)y, (float)z, (float)(mm * 0.5e-3));
        drops[i].velocity[1] = (float)-raindrop_terminal_velocity(mm);
        drops[i].velocity[0] = 1;
    }
    return drops;
}

TEST(raindrop_streaks_equal_64_moments)
{
    static const double exposures[3] = {1 / 60.0, 1 / 500.0, 1 / 4000.0};
    rt_scene scene = rt_open();
    raindrop_render_options o = raindrop_render_defaults();
    int i, near;
    for (near = 0; near < 2; near++) {
        int count = near ? 30 : 1500;
        raindrop_drop *drops = rt_falling(count, near ? 0.02 : 0.15, near ? 0.1 : 3, 11);
        raindrop_rain *rain = rt_rain_of(drops, count);
        for (i = 0; i < 3; i++) {
            double error;
            scene.camera.exposure = (float)exposures[i];
            rt_average(&scene, rain, drops, count, 64);
            rt_render(&scene, rain, &o, NULL);
            error = reference_rmse(scene.picture, scene.truth, scene.mask, (size_t)RT_W * RT_H, scene.key);
            EXPECT(error <= 0.02);
            REPORT(near ? "near streaks, RMSE from 64 moments" : "streaks, RMSE from 64 moments", error, "");
        }
        free(drops);
        raindrop_rain_destroy(rain);
    }
    rt_close(&scene);
}

/* No exposure at all and hardly any are the same picture, and a drop at the camera's own velocity has no streak. */
TEST(raindrop_streaks_end_in_still_drops)
{
    rt_scene scene = rt_open();
    raindrop_drop *drops = rt_falling(200, 0.05, 1, 5);
    raindrop_rain *rain = rt_rain_of(drops, 200);
    int i;
    for (i = 0; i < 200; i++) drops[i].velocity[1] = -3;
    raindrop_rain_set_drops(rain, drops, 200);
    rt_render(&scene, rain, NULL, NULL);
    memcpy(scene.truth, scene.picture, sizeof(float) * 3 * RT_W * RT_H);
    scene.camera.exposure = 1e-7f;
    rt_render(&scene, rain, NULL, NULL);
    EXPECT(memcmp(scene.truth, scene.picture, sizeof(float) * 3 * RT_W * RT_H) == 0);
    scene.camera.exposure = 0.02f;
    raindrop__set(scene.camera.velocity, 1, -3, 0); /* falling with the rain */
    rt_render(&scene, rain, NULL, NULL);
    EXPECT(memcmp(scene.truth, scene.picture, sizeof(float) * 3 * RT_W * RT_H) == 0);
    raindrop__set(scene.camera.velocity, 0, 0, 0);
    rt_render(&scene, rain, NULL, NULL);
    EXPECT(reference_rmse(scene.truth, scene.picture, NULL, (size_t)RT_W * RT_H, scene.key) > 0.002);
    free(drops);
    raindrop_rain_destroy(rain);
    rt_close(&scene);
}

TEST(raindrop_depth_of_field_equals_a_sampled_lens)
{
    rt_scene scene = rt_open();
    raindrop_drop *drops = rt_falling(400, 0.05, 2, 23);
    raindrop_rain *rain = rt_rain_of(drops, 400);
    double sharp, soft;
    scene.camera.focus_distance = 0.6f;
    scene.camera.aperture = 0.01f;
    rt_average(&scene, rain, drops, 400, 256);
    rt_render(&scene, rain, NULL, NULL);
    soft = reference_rmse(scene.picture, scene.truth, scene.mask, (size_t)RT_W * RT_H, scene.key);
    scene.camera.aperture = 0;
    rt_render(&scene, rain, NULL, NULL);
    sharp = reference_rmse(scene.picture, scene.truth, scene.mask, (size_t)RT_W * RT_H, scene.key);
    EXPECT(soft <= 0.02);
    EXPECT(soft < 0.6 * sharp);
    REPORT("depth of field, RMSE from 256 points of the lens", soft, "");
    REPORT("depth of field, RMSE without it", sharp, "");
    free(drops);
    raindrop_rain_destroy(rain);
    rt_close(&scene);
}

/* A white sky: the picture of a drop before black is what it covers. */
static raindrop_environment *rt_white(void)
{
    static float white[3 * 16 * 8];
    sat_image image = sat_image_f32(white, 16, 8, 3);
    raindrop_environment_options e = raindrop_environment_defaults();
    raindrop_environment *environment = NULL;
    int i;
    for (i = 0; i < 3 * 16 * 8; i++) white[i] = 1;
    e.far_samples = 16;
    EXPECT_EQ(raindrop_environment_create(&environment, &image, &e, NULL), SAT_OK);
    return environment;
}

/* The veil is the mean picture of the drops that it stands for: a shell of them, drawn, and the closed form. */
TEST(raindrop_veil_is_the_mean_of_the_drops)
{
    enum { COUNT = 60000 };
    rt_scene scene = rt_open();
    raindrop_drop *drops = (raindrop_drop *)malloc(sizeof *drops * COUNT);
    raindrop_rain *rain;
    raindrop_veil_options o = raindrop_veil_defaults();
    raindrop_render_options r = raindrop_render_defaults();
    const size_t pixels = (size_t)RT_W * RT_H;
    const double from = 3, reach = 9, radius = 0.025, volume = 4.0 / 3 * acos(-1.0) * (9.0 * 9 * 9 - 27);
    double drawn[3] = {0, 0, 0}, closed[3] = {0, 0, 0}, sum = 0;
    uint64_t seed = 9;
    size_t k;
    int i, c;
    for (i = 0; i < COUNT; i++) {
        double d = cbrt(27 + support_uniform(&seed) * (729 - 27)), t = 2 * support_uniform(&seed) - 1,
               a = 6.283185307179586 * support_uniform(&seed), s = sqrt(1 - t * t);
        drops[i] = rt_drop((float)(d * s * cos(a)), (float)(d * s * sin(a)), (float)(d * t), (float)radius);
    }
    rain = rt_rain_of(drops, COUNT);
    r.far_radius = 64;
    for (k = 0; k < 3 * pixels; k++) scene.background[k] = 2; /* what the rain hides, and what it sends */
    rt_render(&scene, rain, &r, NULL);
    o.extinction = (float)(COUNT * acos(-1.0) * radius * radius / volume);
    o.from = (float)from;
    o.reach = (float)reach;
    EXPECT_EQ(raindrop_veil(scene.background, 0, RT_W, RT_H, NULL, &scene.camera, scene.environment, &o), SAT_OK);
    for (k = 0; k < pixels; k++)
        for (c = 0; c < 3; c++) {
            drawn[c] += (double)scene.picture[3 * k + (size_t)c] / (double)pixels;
            closed[c] += (double)scene.background[3 * k + (size_t)c] / (double)pixels;
        }
    for (c = 0; c < 3; c++) {
        EXPECT_REL(closed[c] - 2, drawn[c] - 2, 0.02);
        sum += (closed[c] - 2) / (drawn[c] - 2) / 3;
    }
    REPORT("veil over drawn drops, mean change of the picture", sum, "");
    EXPECT(o.extinction * 6 > 0.2f);
    free(drops);
    raindrop_rain_destroy(rain);
    rt_close(&scene);
}

TEST(raindrop_veil_grows_with_the_depth)
{
    static float depth[16] = {0.5f, 5, 50, 500, 5000, 0, -1, 1e30f}, rgb[3 * 8], want[3];
    raindrop_environment *white = rt_white();
    raindrop_veil_options o = raindrop_veil_defaults();
    raindrop_camera camera = raindrop_camera_defaults();
    char text[160];
    int i;
    camera.fov_y = 0.01f;
    EXPECT_NEAR(raindrop_extinction(10), 0.00069, 1e-5);
    EXPECT_REL(raindrop_extinction(50), 0.0021, 0.1); /* 2.1 a kilometre */
    EXPECT_EQ(raindrop_extinction(-1), 0);
    EXPECT(!(raindrop_extinction((double)sat__float_from_bits(0x7fc00000u)) > 0));
    o.extinction = 0.0021f;
    EXPECT_EQ(raindrop_veil(rgb, 0, 8, 1, depth, &camera, white, &o), SAT_OK);
    for (i = 0; i < 8; i++) {
        double z = i > 3 ? 1000 : (double)depth[i], s = z > 4 ? z - 4 : 0;
        EXPECT_NEAR(rgb[3 * i], 1 - exp(-0.0021 * s), 3e-5);
    }
    memcpy(want, rgb + 3, sizeof want);
    o.extinction = -1;
    EXPECT_EQ(raindrop_veil(rgb, 0, 8, 1, depth, &camera, white, &o), SAT_ERR_ARGUMENT);
    EXPECT(strcmp(raindrop_explain_veil(text, sizeof text, &o), "extinction is -1; 0..1e18") == 0);
    EXPECT(strcmp(raindrop_explain_veil(text, sizeof text, NULL), "") == 0);
    o.extinction = 0; /* no rain, no change */
    EXPECT_EQ(raindrop_veil(rgb, 0, 8, 1, depth, &camera, white, &o), SAT_OK);
    EXPECT(memcmp(want, rgb + 3, sizeof want) == 0);
    EXPECT_EQ(raindrop_veil(NULL, 0, 8, 1, depth, &camera, white, &o), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_veil(rgb, 0, 8, 1, depth, &camera, NULL, &o), SAT_ERR_ARGUMENT);
    raindrop_environment_destroy(white);
}

/* Whatever the size, the streak and the blur, a drop takes as much light away as its disc: black drops before white. */
TEST(raindrop_coverage_is_the_area)
{
    rt_scene scene = rt_open();
    size_t pixels = (size_t)RT_W * RT_H, k;
    int i, look, blur;
    for (k = 0; k < 3 * pixels; k++) scene.background[k] = 1;
    for (look = RAINDROP_LOOK_RAY; look <= RAINDROP_LOOK_AUTO; look++) {
        for (blur = 0; blur < 4; blur++) {
            double total = 0, truth = 0;
            for (i = 0; i < 200; i += 4) {
                double size = look == RAINDROP_LOOK_RAY ? 3 + 0.05 * i : 0.2 + 0.02 * i;
                raindrop_drop drop = rt_drop_of(size, 0.1 + 0.001 * i, 0.05 + 0.0017 * i);
                raindrop_rain *rain;
                raindrop_render_options o = raindrop_render_defaults();
                double slope = 1 + pow(0.1 + 0.001 * i, 2) + pow(0.05 + 0.0017 * i, 2);
                drop.velocity[0] = 1;
                drop.velocity[1] = -2;
                rain = rt_rain_of(&drop, 1);
                o.look = (raindrop_look)look;
                scene.camera.exposure = blur & 1 ? (float)(0.01 * i / size * 4) : 0;
                scene.camera.aperture = blur & 2 ? 1.0f : 0;
                scene.camera.focus_distance = drop.position[2] * -1.1f;
                {   /* white where the drop is, black behind it */
                    float sum = 0;
                    raindrop_environment *old = scene.environment;
                    static float white[3 * 16 * 8];
                    sat_image image = sat_image_f32(white, 16, 8, 3);
                    raindrop_environment_options e = raindrop_environment_defaults();
                    static raindrop_environment *glow;
                    for (k = 0; k < 3 * 16 * 8; k++) white[k] = 1;
                    if (i == 0) {
                        e.far_samples = 16;
                        EXPECT_EQ(raindrop_environment_create(&glow, &image, &e, NULL), SAT_OK);
                    }
                    scene.environment = glow;
                    memset(scene.background, 0, pixels * 3 * sizeof(float));
                    rt_render(&scene, rain, &o, NULL);
                    for (k = 0; k < pixels; k++) sum += scene.picture[3 * k];
                    total += (double)sum;
                    truth += acos(-1.0) / 4 * size * size * pow(slope, 1.5);
                    scene.environment = old;
                    if (i == 196) raindrop_environment_destroy(glow);
                }
                raindrop_rain_destroy(rain);
            }
            EXPECT_REL(total, truth, 0.02);
            REPORT("coverage over area", total / truth, look == RAINDROP_LOOK_RAY ? "near" : "far");
        }
    }
    rt_close(&scene);
}

/* The light of one drop of a radius, streak and blur in pixels over its area; its place and direction are drawn. */
static double rt_energy(raindrop_environment *white, raindrop_look look, double radius, double streak, double blur,
                        uint64_t *seed)
{
    enum { SIDE = 64 };
    static float picture[3 * SIDE * SIDE];
    const double pixel = 2.0 / SIDE, angle = 6.283185307179586 * support_uniform(seed), r = radius * pixel;
    const double x = pixel * support_uniform(seed), y = pixel * support_uniform(seed);
    raindrop_drop drop = rt_drop((float)x, (float)y, -1, (float)r);
    raindrop_camera camera = raindrop_camera_defaults();
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_rain *rain;
    double sum = 0;
    int i;
    drop.velocity[0] = (float)cos(angle);
    drop.velocity[1] = (float)sin(angle);
    rain = rt_rain_of(&drop, 1);
    camera.exposure = (float)(streak * pixel);
    camera.focus_distance = 2;
    camera.aperture = (float)(4 * blur * pixel);
    o.look = look;
    o.coverage_threshold = 0;
    memset(picture, 0, sizeof picture);
    EXPECT_EQ(raindrop_render(picture, SIDE * 12, SIDE, SIDE, NULL, &camera, rain, white, &o, NULL), SAT_OK);
    for (i = 0; i < SIDE * SIDE; i++) sum += (double)picture[3 * i];
    raindrop_rain_destroy(rain);
    return sum * (1 - r * r) / (acos(-1.0) * radius * radius);
}

/* A streak neither twinkles nor grows with its place among the pixels. */
TEST(raindrop_streaks_do_not_shimmer)
{
    static const double radii[] = {0.02, 0.1, 0.5, 0.9, 1.1, 1.39, 1.41, 1.5, 1.75, 2, 2.3, 3, 5, 9};
    static const double streaks[] = {0, 0.1, 0.3, 0.6, 1, 1.7, 2.4, 2.6, 4, 9, 20}, blurs[] = {0, 0.5, 1.2, 1.5, 6};
    static const char *const names[2] = {"ray: largest error of a drop's energy", "auto: largest error of a drop's energy"};
    raindrop_environment *white = rt_white();
    uint64_t seed = 5;
    size_t i, j, k;
    int look, place;
    for (look = 0; look < 2; look++) {
        double worst = 0;
        for (i = 0; i < sizeof radii / sizeof *radii; i++)
            for (j = 0; j < sizeof streaks / sizeof *streaks; j++)
                for (k = 0; k < sizeof blurs / sizeof *blurs; k++)
                    for (place = 0; place < (k ? 4 : 16); place++) {
                        raindrop_look which = look ? RAINDROP_LOOK_AUTO : RAINDROP_LOOK_RAY;
                        double error = rt_energy(white, which, radii[i], streaks[j], blurs[k], &seed) - 1;
                        if (fabs(error) > worst) worst = fabs(error);
                        if (fabs(error) > 0.02)
                            fprintf(stderr, "%g, streak %g, blur %g: %g\n", radii[i], streaks[j], blurs[k], error);
                    }
        EXPECT(worst <= 0.02);
        REPORT(names[look], 100 * worst, "%");
    }
    raindrop_environment_destroy(white);
}

/* A box that rises, sinks or jumps with the camera, and air that moves up or down: as much water and drops as large. */
TEST(raindrop_rate_holds_in_a_box_that_moves)
{
    static const struct { double rise, dt; float wind; int turns;
    } cases[8] = {{-10, 1 / 60.0, 0, 60}, {2, 1 / 60.0, 0, 240}, {10, 1 / 60.0, 0, 120}, {300, 1 / 60.0, 0, 30},
                  {10, 2, 0, 10}, {1e5, 0.5, 0, 6}, {0, 1 / 60.0, -5, 120}, {5, 1 / 60.0, 3, 240}};
    double worst = 0;
    int i, k;
    for (i = 0; i < 8; i++) {
        raindrop_rain_options o = raindrop_rain_defaults();
        raindrop_rain *rain = NULL;
        const raindrop_drop *drops;
        double sum[2][2] = {{0, 0}, {0, 0}}, volume, size;
        int n = 0, turn;
        o.count = 20000;
        o.diameter_max_mm = 3; /* few large drops would make the sum of volumes a matter of chance */
        o.wind[1] = cases[i].wind;
        EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK);
        for (turn = 0; turn <= cases[i].turns; turn++) {
            drops = raindrop_rain_drops(&n, rain);
            for (k = 0; k < n && (turn == 0 || turn == cases[i].turns); k++) {
                double d = 2e3 * (double)drops[k].radius;
                sum[turn > 0][0] += d;
                sum[turn > 0][1] += d * d * d;
                EXPECT(fabsf(drops[k].position[1] - o.centre[1]) < 4.001f + 1e-7f * fabsf(o.centre[1]));
            }
            o.centre[1] += (float)(cases[i].rise * cases[i].dt);
            if (turn == cases[i].turns) break;
            EXPECT_EQ(raindrop_rain_set_centre(rain, o.centre), SAT_OK);
            EXPECT_EQ(raindrop_rain_advance(rain, cases[i].dt), SAT_OK);
        }
        size = sum[1][0] / sum[0][0] - 1;
        volume = sum[1][1] / sum[0][1] - 1;
        if (!EXPECT(fabs(size) < 0.03 && fabs(volume) < 0.06))
            printf("rise %g, wind %g, dt %g: %g %g\n", cases[i].rise, (double)cases[i].wind, cases[i].dt, size, volume);
        if (fabs(size) > worst) worst = fabs(size);
        raindrop_rain_destroy(rain);
    }
    REPORT("mean diameter in a box that moves, largest error", 100 * worst, "%");
}

/* ---- lamps, and drops that oscillate ---- */

/* Lamps from all sides are a white sky. */
TEST(raindrop_lamps_all_around_are_a_white_sky)
{
    enum { LAMPS = 4000 };
    static const float indices[3] = {1.33f, 1.5f, 1 / 1.33f};
    raindrop_drop drop = rt_drop(0, 0, 0, 0.001f);
    const float d[3] = {0.48f, 0.6f, -0.64f};
    int i, k, orders;
    for (k = 0; k < 3; k++)
        for (orders = 0; orders < 2; orders++) {
            raindrop_lamp lamp = raindrop_lamp_defaults();
            raindrop_render_options o = raindrop_render_defaults();
            float colour[3] = {0, 0, 0};
            raindrop__water water = raindrop__water_of(indices[k], orders);
            double bubble = 0;
            if (k == 2 && orders) continue; /* a bubble shows no bow of order 1 */
            o.lamps = &lamp;
            o.lamp_count = 1;
            o.orders = orders;
            lamp.radius = 0.3f;
            for (i = 0; i < LAMPS; i++) {
                double t = 1 - (2 * i + 1.0) / LAMPS, a = 2.39996323 * i, s = sqrt(1 - t * t);
                raindrop__set(lamp.position, (float)(10 * s * cos(a)), (float)(10 * t), (float)(10 * s * sin(a)));
                lamp.intensity[0] = lamp.intensity[1] = lamp.intensity[2] = (float)(100 * 4 * acos(-1.0) / LAMPS);
                raindrop__far_lamps(colour, &o, &drop, d, &water);
            }
            EXPECT_NEAR(colour[0], 1, 0.01);
            bubble += (double)colour[0];
            REPORT("light of lamps from all sides over that of a white sky", bubble, "");
        }
}

/* The picture of a drop lit by one lamp, before black, against rays: its light, and where it is. */
TEST(raindrop_glints_are_the_traced_lamp)
{
    static const double angles[7] = {10, 40, 75, 110, 139, 150, 172};
    static const double sizes[2] = {160, 5};
    static float black[3 * 16 * 8];
    sat_image image = sat_image_f32(black, 16, 8, 3);
    raindrop_environment *dark = NULL;
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_lamp lamp = raindrop_lamp_defaults();
    rt_scene scene = rt_open();
    double worst_light = 0, worst_place = 0, worst_far = 0, focal;
    int i, k, c, size;
    scene.camera.fov_y = 0.3f;
    focal = 0.5 * RT_H / tan(0.15);
    EXPECT_EQ(raindrop_environment_create(&dark, &image, NULL, NULL), SAT_OK);
    o.lamps = &lamp;
    o.lamp_count = 1;
    lamp.radius = 64;
    for (size = 0; size < 2; size++)
        for (i = 0; i < 7; i++) {
            const double away = sqrt(1 + pow(2 * focal / sizes[size], 2)) / sqrt(1 + 0.05 * 0.05 + 0.03 * 0.03);
            raindrop_drop drop = rt_drop((float)(0.05 * away), (float)(-0.03 * away), (float)-away, 1);
            raindrop_rain *rain = rt_rain_of(&drop, 1);
            double d[3], side[3], length = 0, want[3], have[3] = {0, 0, 0}, error;
            for (c = 0; c < 3; c++) length += (double)drop.position[c] * (double)drop.position[c];
            for (c = 0; c < 3; c++) d[c] = (double)drop.position[c] / sqrt(length);
            side[0] = d[1] / hypot(d[0], d[1]);
            side[1] = -d[0] / hypot(d[0], d[1]);
            side[2] = 0;
            for (c = 0; c < 3; c++) {
                double a = angles[i] * acos(-1.0) / 180, to = cos(a) * d[c] + sin(a) * side[c];
                lamp.position[c] = drop.position[c] + (float)(1600 * to);
            }
            reference_lamp(want, RT_W, RT_H, &scene.camera, &drop, &lamp);
            memset(scene.picture, 0, sizeof(float) * 3 * RT_W * RT_H);
            EXPECT_EQ(raindrop_render(scene.picture, 0, RT_W, RT_H, NULL, &scene.camera, rain, dark, &o, NULL), SAT_OK);
            for (k = 0; k < RT_W * RT_H; k++) {
                double v = (double)scene.picture[3 * k];
                have[0] += v;
                have[1] += v * (k % RT_W + 0.5);
                have[2] += v * (k / RT_W + 0.5);
            }
            error = fabs(have[0] / want[0] - 1);
            if (error > worst_light) worst_light = error;
            if (error > 0.08) printf("%g px, %g degrees: light %g, %g\n", sizes[size], angles[i], have[0], want[0]);
            error = hypot(have[1] / have[0] - want[1], have[2] / have[0] - want[2]);
            if (size == 1 && error > worst_far) worst_far = error;
            if (size == 0 && error > worst_place) worst_place = error;
            if (error > 0.02 * sizes[size] + 0.2)
                printf("%g px, %g degrees: %g pixels off\n", sizes[size], angles[i], error);
            raindrop_rain_destroy(rain);
        }
    EXPECT(worst_light <= 0.08); /* the most within half a degree of the bow */
    EXPECT(worst_place <= 2 && worst_far <= 0.3);
    REPORT("glints of a lamp, largest error of their light", 100 * worst_light, "%");
    REPORT("glints of a lamp, largest error of their place", worst_place, "pixels of 160");
    raindrop_environment_destroy(dark);
    rt_close(&scene);
}

/* Swinging drops keep the light of their streaks on average, and change it along them. */
TEST(raindrop_oscillation_speckles_and_keeps_the_light)
{
    enum { SIDE = 64, MOMENTS = 300 };
    static float picture[3 * SIDE * SIDE], sky[3 * 64 * 32];
    static const double radii[3] = {0.3, 1.2, 4};
    sat_image image = sat_image_f32(sky, 64, 32, 3);
    raindrop_environment_options e = raindrop_environment_defaults();
    raindrop_environment *environment = NULL;
    raindrop_lamp lamp = raindrop_lamp_defaults();
    int i, k, lit;
    memset(sky, 0, sizeof sky);
    for (i = 0; i < 3 * 64; i++) sky[3 * 64 * 14 + i] = (float)(i % 60); /* lamps along the horizon */
    e.far_swing = 1;
    e.far_samples = 64;
    EXPECT_EQ(raindrop_environment_create(&environment, &image, &e, NULL), SAT_OK);
    lamp.position[0] = 3;
    lamp.position[1] = 4;
    lamp.position[2] = -6;
    lamp.intensity[0] = lamp.intensity[1] = lamp.intensity[2] = 500;
    for (lit = 0; lit < 2; lit++)
        for (i = 0; i < 3; i++) {
            raindrop_camera camera = raindrop_camera_defaults();
            raindrop_drop drop = rt_drop(0, 0, 0, 0.0012f);
            raindrop_render_options o = raindrop_render_defaults();
            raindrop_rain *rain;
            double mean[2] = {0, 0}, speckle = 0, least, most;
            int moment, swings;
            const double pixel = (double)drop.radius / radii[i] / (2.0 / SIDE); /* distance */
            drop.position[2] = (float)-pixel;
            drop.velocity[1] = -6;
            camera.depth_near = 0;
            camera.exposure = (float)(pixel * (2.0 / SIDE) * 24 / 6); /* 24 pixels */
            rain = rt_rain_of(&drop, 1);
            if (lit) {
                o.lamps = &lamp;
                o.lamp_count = 1;
            }
            for (moment = 0; moment < MOMENTS; moment++)
                for (swings = moment > 0; swings < 2; swings++) { /* a still streak is always the same */
                    double rows[SIDE];
                    o.oscillation = swings ? 0.1f : 0;
                    rain->time = fmod(0.000371 * moment, RAINDROP__PERIOD);
                    memset(picture, 0, sizeof picture);
                    memset(rows, 0, sizeof rows);
                    EXPECT_EQ(raindrop_render(picture, 0, SIDE, SIDE, NULL, &camera, rain, environment, &o, NULL),
                              SAT_OK);
                    for (k = 0; k < SIDE * SIDE; k++) {
                        mean[swings] += (double)picture[3 * k] / (swings ? MOMENTS : 1);
                        rows[k / SIDE] += (double)picture[3 * k];
                    }
                    if (!swings) continue;
                    for (k = 26, least = most = rows[k]; k < 37; k++) {
                        least = fmin(least, rows[k]);
                        most = fmax(most, rows[k]);
                    }
                    speckle += (1 - least / most) / MOMENTS;
                }
            EXPECT_REL(mean[1], mean[0], 0.02);
            if (lit) EXPECT(speckle > 0.1);
            REPORT(lit ? "swinging streaks under a lamp, mean light over that of still ones"
                       : "swinging streaks, mean light over that of still ones", mean[1] / mean[0], "");
            REPORT("darkest over brightest row of the middle half", 1 - speckle, "on average");
            raindrop_rain_destroy(rain);
        }
    raindrop_environment_destroy(environment);
}

/* A still near drop that swings is the spheroid of that moment. */
TEST(raindrop_swinging_drop_against_ray_tracing)
{
    rt_scene scene = rt_open();
    raindrop_drop drop = rt_drop(0.001f, 0.0005f, -0.01f, 0.0022f), bent = drop;
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_rain *rain = rt_rain_of(&drop, 1);
    raindrop__swing swing;
    double error;
    int i;
    o.oscillation = 0.1f;
    o.orders = 0;
    for (i = 0; i < 2; i++) { /* flat and tall */
        rain->time = 0;
        do {
            rain->time += 0.0001;
            swing = raindrop__swing_of(rain, 0, o.oscillation);
            bent.axis_ratio = raindrop__swung(1, &swing, 0);
        } while ((bent.axis_ratio > 1) != i || fabsf(bent.axis_ratio - 1) < 0.09f);
        EXPECT(reference_render(scene.truth, scene.mask, RT_W, RT_H, 4, &scene.camera, &bent, 1, scene.environment,
                                -1));
        rt_render(&scene, rain, &o, NULL);
        error = rt_error(&scene);
        EXPECT(error < 0.03);
        REPORT(i ? "a drop swung tall, RMSE from rays" : "a drop swung flat, RMSE from rays", error, "");
    }
    raindrop_rain_destroy(rain);
    rt_close(&scene);
}

TEST(raindrop_lamps_refuse_nonsense)
{
    char text[160];
    raindrop_lamp lamps[2];
    raindrop_render_options o = raindrop_render_defaults();
    float spot[3] = {0, 0, 0}, all[3] = {0, 0, 0};
    raindrop_drop drop = rt_drop(0, -5, 0, 0.001f);
    const float d[3] = {0, 0, -1};
    const raindrop__water water = raindrop__water_of(1.33f, o.orders);
    lamps[0] = lamps[1] = raindrop_lamp_defaults();
    EXPECT(strcmp(raindrop_explain_lamp(text, sizeof text, &lamps[0]), "") == 0);
    EXPECT(strcmp(raindrop_explain_lamp(text, sizeof text, NULL), "lamp is NULL") == 0);
    o.lamp_count = 2;
    EXPECT(strcmp(raindrop_explain_render(text, sizeof text, 0, 1, 1, NULL, &o), "lamps is NULL, and lamp_count above 0") == 0);
    o.lamps = lamps;
    EXPECT(strcmp(raindrop_explain_render(text, sizeof text, 0, 1, 1, NULL, &o), "") == 0);
    lamps[1].inner = 1;
    lamps[1].outer = 0.5f;
    EXPECT(strcmp(raindrop_explain_render(text, sizeof text, 0, 1, 1, NULL, &o), "outer is below inner") == 0);
    lamps[1].outer = sat__float_from_bits(0x7fc00000u);
    EXPECT(strcmp(raindrop_explain_lamp(text, sizeof text, &lamps[1]), "outer is NaN; 0..3.1416") == 0);
    lamps[1] = lamps[0];
    lamps[1].direction[1] = -1.5f;
    EXPECT(strcmp(raindrop_explain_lamp(text, sizeof text, &lamps[1]), "direction is no unit vector") == 0);
    lamps[1] = lamps[0];
    lamps[1].intensity[2] = -1;
    EXPECT(strcmp(raindrop_explain_lamp(text, sizeof text, &lamps[1]), "intensity[2] is -1; 0..1e18") == 0);
    /* a cone lights what it points at, as brightly as a lamp all around, and nothing beside it */
    o.lamp_count = 1;
    raindrop__far_lamps(all, &o, &drop, d, &water);
    lamps[0].inner = 0.3f;
    lamps[0].outer = 0.5f;
    raindrop__far_lamps(spot, &o, &drop, d, &water);
    EXPECT(all[0] > 0 && memcmp(all, spot, sizeof all) == 0);
    raindrop__set(spot, 0, 0, 0);
    drop.position[0] = 5 * tanf(0.4f);
    raindrop__far_lamps(spot, &o, &drop, d, &water);
    EXPECT(spot[0] > 0);
    raindrop__set(spot, 0, 0, 0);
    drop.position[0] = 5 * tanf(0.51f);
    raindrop__far_lamps(spot, &o, &drop, d, &water);
    EXPECT(!(spot[0] > 0));
    drop.position[1] = 0; /* in the drop */
    drop.position[0] = 0;
    raindrop__far_lamps(spot, &o, &drop, d, &water);
    EXPECT(!(spot[0] > 0));
}

TEST(raindrop_same_bits_for_any_workers)
{
    enum { COUNT = 30000 };
    static const int workers[4] = {1, 2, 3, 7};
    uint64_t truth = 0, rain_truth = 0;
    rt_scene scene = rt_open();
    raindrop_lamp lamp = raindrop_lamp_defaults();
    raindrop_render_options render = raindrop_render_defaults();
    int i, odd;
    lamp.position[1] = 1;
    render.lamps = &lamp;
    render.lamp_count = 1;
    render.oscillation = 0.1f;
    scene.camera.exposure = 0.005f;
    scene.camera.aperture = 0.002f;
    for (odd = 0; odd < 2; odd++) {
        for (i = 0; i < 4; i++) {
            sat_threads threads = odd ? support_odd_threads(workers[i]) : support_threads(workers[i]);
            raindrop_rain_options o = raindrop_rain_defaults();
            raindrop_rain *rain = NULL;
            raindrop_render_stats stats;
            uint64_t hash, drops;
            float gust[3] = {3, 0, 1};
            o.count = COUNT;
            o.box_size[0] = o.box_size[1] = o.box_size[2] = 2;
            o.threads = threads;
            EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK);
            raindrop_rain_advance(rain, 0.3);
            raindrop_rain_set_wind(rain, gust);
            raindrop_rain_advance(rain, 0.02);
            stats = rt_render(&scene, rain, &render, NULL);
            drops = support_hash(raindrop_rain_drops(NULL, rain), COUNT * sizeof(raindrop_drop));
            hash = support_hash_add(support_hash(scene.picture, sizeof(float) * 3 * RT_W * RT_H), &stats, sizeof stats);
            if (!truth) { truth = hash; rain_truth = drops; }
            EXPECT(hash == truth);
            EXPECT(drops == rain_truth);
            raindrop_rain_destroy(rain);
        }
    }
    rt_close(&scene);
}

TEST(raindrop_frames_do_not_allocate)
{
    support_memory memory;
    sat_allocator allocator = support_allocator(&memory);
    raindrop_rain *rain = rt_published(5000, NULL, &allocator);
    rt_scene scene = rt_open();
    long calls = memory.calls;
    int i;
    EXPECT_EQ(calls, 1);
    for (i = 0; i < 3; i++) {
        raindrop_rain_advance(rain, 0.01);
        rt_render(&scene, rain, NULL, NULL);
    }
    EXPECT_EQ(memory.calls, calls);
    raindrop_rain_destroy(rain);
    EXPECT(support_memory_clean(&memory));
    rt_close(&scene);
}

TEST(raindrop_failing_allocator_leaks_nothing)
{
    static float sky[3 * 32 * 16];
    sat_image image = sat_image_f32(sky, 32, 16, 3);
    long n;
    int what;
    for (what = 0; what < 3; what++) {
        for (n = 1; n < 12; n++) {
            support_memory memory;
            raindrop_environment_options e = raindrop_environment_defaults();
            raindrop_environment *environment = NULL;
            raindrop_rain_options r = raindrop_rain_defaults();
            raindrop_rain *rain = NULL;
            raindrop_map *map = NULL;
            raindrop_map_options m = raindrop_map_defaults();
            sat_result result;
            sat_allocator allocator = support_allocator(&memory);
            memory.fail_at = n;
            e.allocator = r.allocator = m.allocator = allocator;
            m.resolution = 8;
            e.filter = RAINDROP_FILTER_SAT;
            e.bow_optical_depth = 0.1f;
            e.far_samples = 16;
            r.count = 10;
            result = what == 0   ? raindrop_environment_create(&environment, &image, &e, NULL)
                     : what == 1 ? raindrop_rain_create(&rain, &r)
                                 : raindrop_map_create(&map, &m);
            EXPECT(result == SAT_OK || (result == SAT_ERR_MEMORY && !environment && !rain && !map));
            EXPECT(result == SAT_OK || memory.live == 0);
            raindrop_environment_destroy(environment);
            raindrop_rain_destroy(rain);
            raindrop_map_destroy(map);
            EXPECT(support_memory_clean(&memory));
            if (result == SAT_OK) break;
        }
        EXPECT(n < 12);
    }
}

TEST(raindrop_extreme_drops)
{
    rt_scene scene = rt_open();
    raindrop_drop d[14];
    raindrop_rain *rain;
    raindrop_render_stats stats;
    raindrop_map *map = NULL;
    raindrop_render_options o = raindrop_render_defaults();
    int look, i;
    for (i = 0; i < 14; i++) d[i] = rt_drop(0, 0, -1, 0.1f);
    d[0].radius = 0;
    d[1].radius = -1;
    d[2].radius = (float)NAN;
    d[3].position[1] = (float)NAN;
    d[4].velocity[0] = (float)INFINITY;
    d[5].axis_ratio = 0;
    d[6].radius = 5;                     /* the eye is inside */
    d[7] = rt_drop(0, 0, 0, 0.1f);       /* the eye is its centre */
    d[8] = rt_drop(0, 0, 2, 0.1f);       /* behind */
    d[9] = rt_drop(0.05f, 0, -0.05f, 0.0499f); /* on the near plane */
    d[10] = rt_drop(30, 0, -1, 0.1f);    /* outside */
    d[11] = rt_drop(1e30f, 0, -1e30f, 1e29f); /* its square overflows */
    d[12] = rt_drop(0, 0, -1, 1e-30f);   /* covers nothing */
    d[13] = rt_drop(0.3f, 0.2f, -1, 1e-3f); /* the only one to draw */
    scene.camera.depth_near = 0.01f;
    EXPECT_EQ(reference_map(&map, 64, 32, RAINDROP_WATER), SAT_OK);
    o.map = map;
    rain = rt_rain_of(d, 14);
    for (look = 0; look < 4; look++) {
        o.look = (raindrop_look)look;
        stats = rt_render(&scene, rain, &o, NULL);
        EXPECT_EQ(stats.invalid, 7);
        EXPECT_EQ(stats.inside, 2);
        EXPECT_EQ(stats.behind, 1);
        EXPECT_EQ(stats.near_plane, 1);
        EXPECT_EQ(stats.outside, 1);
        EXPECT_EQ(stats.below_threshold, 1);
        EXPECT_EQ(stats.drawn_near + stats.drawn_far, 1);
        scene.camera.exposure = look < 2 ? 0 : 0.01f;
    }
    raindrop_rain_destroy(rain);
    /* nothing at all, and one drop that fills the picture */
    rain = rt_rain_of(d, 0);
    stats = rt_render(&scene, rain, NULL, NULL);
    EXPECT_EQ(stats.drops, 0);
    EXPECT(memcmp(scene.picture, scene.background, sizeof(float) * 3 * RT_W * RT_H) == 0);
    raindrop_rain_destroy(rain);
    d[0] = rt_drop(0, 0, -1.05f, 1);
    rain = rt_rain_of(d, 1);
    scene.camera.exposure = 0;
    for (look = 0; look < 4; look++) {
        o.look = (raindrop_look)look;
        stats = rt_render(&scene, rain, &o, NULL);
        EXPECT_EQ(stats.drawn_near, 1);
        EXPECT_EQ(stats.fragments, RT_W * RT_H);
    }
    raindrop_rain_destroy(rain);
    raindrop_map_destroy(map);
    rt_close(&scene);
}

/* Straight up and down, where the published frame (u = V x n) is not defined; a turned camera sees a turned world. */
TEST(raindrop_camera_may_look_anywhere)
{
    rt_scene scene = rt_open();
    float eye[3] = {1, 2, 3}, target[3], up[3] = {0, 1, 0};
    raindrop_map *map = NULL;
    raindrop_render_options o = raindrop_render_defaults();
    int i, look;
    EXPECT_EQ(reference_map(&map, 64, 32, RAINDROP_WATER), SAT_OK);
    o.map = map;
    for (i = 0; i < 4; i++) {
        raindrop_drop drop;
        raindrop_rain *rain;
        raindrop__set(target, eye[0] + (i == 2 ? 1.0f : 0),
                      eye[1] + (i == 0   ? 1.0f
                                : i == 1 ? -1.0f
                                         : 0),
                      eye[2] + (i == 3 ? -1.0f : 0));
        scene.camera = raindrop_camera_look(eye, target, up, 1.57079633f);
        EXPECT_NEAR(raindrop__dot(scene.camera.right, scene.camera.right), 1, 1e-5);
        EXPECT_NEAR(raindrop__dot(scene.camera.up, scene.camera.back), 0, 1e-5);
        drop = rt_drop(target[0], target[1], target[2], 0.3f);
        rain = rt_rain_of(&drop, 1);
        raindrop_environment_render(scene.background, RT_W * 12, RT_W, RT_H, &scene.camera, scene.environment, NULL);
        EXPECT(
            reference_render(scene.truth, scene.mask, RT_W, RT_H, 4, &scene.camera, &drop, 1, scene.environment, -1));
        for (look = 0; look < 3; look++) {
            o.look = (raindrop_look)look;
            o.orders = 0;
            rt_render(&scene, rain, &o, NULL);
            EXPECT(rt_error(&scene) < 0.05);
        }
        raindrop_rain_destroy(rain);
    }
    raindrop_map_destroy(map);
    rt_close(&scene);
}

TEST(raindrop_index_one_is_invisible)
{
    static float sky[3 * 64 * 32];
    raindrop_environment_options e = rt_no_far();
    rt_scene scene = rt_open();
    raindrop_drop drop = rt_drop_of(120, 0.1, 0.1);
    raindrop_rain *rain = rt_rain_of(&drop, 1);
    sat_image image = sat_image_f32(sky, 64, 32, 3);
    size_t i;
    support_fill(sky, 3 * 64 * 32, 0, 1, 3);
    e.n = 1;
    e.resolution = 64;
    EXPECT_EQ(raindrop_environment_create(&scene.environment, &image, &e, NULL), SAT_OK);
    raindrop_environment_render(scene.background, RT_W * 12, RT_W, RT_H, &scene.camera, scene.environment, NULL);
    rt_render(&scene, rain, NULL, NULL);
    for (i = 0; i < 3 * RT_W * RT_H; i++) EXPECT_NEAR(scene.picture[i], scene.background[i], 2e-5);
    raindrop_rain_destroy(rain);
    raindrop_environment_destroy(scene.environment);
    rt_close(&scene);
}

TEST(raindrop_depth_hides_drops)
{
    rt_scene scene = rt_open();
    float *depth = (float *)malloc(sizeof(float) * RT_W * RT_H);
    raindrop_rain *rain = rt_published(20000, NULL, NULL);
    raindrop_render_stats open, half, wall;
    int i;
    for (i = 0; i < RT_W * RT_H; i++)
        depth[i] = i % 4 == 0 ? (float)NAN : i % 4 == 1 ? (float)INFINITY : i % 4 == 2 ? 0 : -1.0f;
    open = rt_render(&scene, rain, NULL, depth);
    EXPECT(open.hidden == 0 && open.drawn_far > 500);
    for (i = 0; i < RT_W * RT_H; i++) depth[i] = i / RT_W < RT_H / 2 ? 0.3f : 100;
    half = rt_render(&scene, rain, NULL, depth);
    EXPECT(half.hidden > 500 && half.fragments < open.fragments);
    for (i = 0; i < RT_W * RT_H; i++) depth[i] = 1e-4f;
    wall = rt_render(&scene, rain, NULL, depth);
    EXPECT(wall.drawn_far + wall.drawn_near == 0 && wall.fragments == 0);
    EXPECT(memcmp(scene.picture, scene.background, sizeof(float) * 3 * RT_W * RT_H) == 0);
    EXPECT_EQ(half.hidden + half.drawn_far + half.drawn_near, open.drawn_far + open.drawn_near);
    raindrop_rain_destroy(rain);
    free(depth);
    rt_close(&scene);
}

/* The order of the array does not matter, that of the depths does. */
TEST(raindrop_drops_are_sorted)
{
    enum { COUNT = 3000 };
    rt_scene scene = rt_open();
    raindrop_drop *drops = rt_falling(COUNT, 0.05, 1, 77), swapped;
    raindrop_rain *rain = rt_rain_of(drops, COUNT);
    raindrop_render_options o = raindrop_render_defaults();
    uint64_t truth;
    int i;
    rt_render(&scene, rain, NULL, NULL);
    truth = support_hash(scene.picture, sizeof(float) * 3 * RT_W * RT_H);
    for (i = 0; i < COUNT / 2; i++) {
        swapped = drops[i];
        drops[i] = drops[COUNT - 1 - i];
        drops[COUNT - 1 - i] = swapped;
    }
    raindrop_rain_set_drops(rain, drops, COUNT);
    rt_render(&scene, rain, NULL, NULL);
    EXPECT(support_hash(scene.picture, sizeof(float) * 3 * RT_W * RT_H) == truth);
    o.sort = 0;
    rt_render(&scene, rain, &o, NULL);
    EXPECT(support_hash(scene.picture, sizeof(float) * 3 * RT_W * RT_H) != truth);
    free(drops);
    raindrop_rain_destroy(rain);
    rt_close(&scene);
}

TEST(raindrop_threshold_counts_what_it_leaves_out)
{
    rt_scene scene = rt_open();
    raindrop_rain *rain = rt_published(20000, NULL, NULL);
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_render_stats all, some;
    o.coverage_threshold = 0;
    all = rt_render(&scene, rain, &o, NULL);
    EXPECT(all.below_threshold == 0 && all.coverage_left_out == 0);
    o.coverage_threshold = 0.2f;
    some = rt_render(&scene, rain, &o, NULL);
    EXPECT(some.below_threshold > 100 && some.coverage_left_out > 0 &&
           some.coverage_left_out < 0.2 * (double)some.below_threshold);
    EXPECT_EQ(some.below_threshold + some.drawn_far + some.drawn_near + some.outside,
              all.drawn_far + all.drawn_near + all.outside);
    raindrop_rain_destroy(rain);
    rt_close(&scene);
}

TEST(raindrop_render_refuses_nonsense)
{
    static float rgb[3 * 8 * 8], again[3 * 8 * 8];
    rt_scene scene = rt_open();
    raindrop_drop drop = rt_drop(0, 0, -2, 0.1f);
    raindrop_rain *rain = rt_rain_of(&drop, 1);
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_camera camera = raindrop_camera_defaults();
    EXPECT_EQ(raindrop_render(NULL, 96, 8, 8, NULL, NULL, rain, scene.environment, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_render(rgb, 95, 8, 8, NULL, NULL, rain, scene.environment, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_render(rgb, 96, 0, 8, NULL, NULL, rain, scene.environment, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_render(rgb, 96, 8, 8, NULL, NULL, NULL, scene.environment, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_render(rgb, 96, 8, 8, NULL, NULL, rain, NULL, NULL, NULL), SAT_ERR_ARGUMENT);
    o.look = RAINDROP_LOOK_MAP;
    EXPECT_EQ(raindrop_render(rgb, 96, 8, 8, NULL, NULL, rain, scene.environment, &o, NULL), SAT_ERR_ARGUMENT);
    o = raindrop_render_defaults();
    o.orders = 9;
    EXPECT_EQ(raindrop_render(rgb, 96, 8, 8, NULL, NULL, rain, scene.environment, &o, NULL), SAT_ERR_ARGUMENT);
    o = raindrop_render_defaults();
    o.far_radius = (float)NAN;
    EXPECT_EQ(raindrop_render(rgb, 96, 8, 8, NULL, NULL, rain, scene.environment, &o, NULL), SAT_ERR_ARGUMENT);
    camera.fov_y = 4;
    EXPECT_EQ(raindrop_render(rgb, 96, 8, 8, NULL, &camera, rain, scene.environment, NULL, NULL), SAT_ERR_ARGUMENT);
    camera = raindrop_camera_defaults();
    camera.right[0] = 2;
    EXPECT_EQ(raindrop_render(rgb, 96, 8, 8, NULL, &camera, rain, scene.environment, NULL, NULL), SAT_ERR_ARGUMENT);
    camera = raindrop_camera_defaults();
    camera.exposure = (float)NAN;
    EXPECT_EQ(raindrop_render(rgb, 96, 8, 8, NULL, &camera, rain, scene.environment, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT(rgb[0] == 0);
    /* packed */
    EXPECT_EQ(raindrop_render(rgb, 0, 8, 8, NULL, NULL, rain, scene.environment, NULL, NULL), SAT_OK);
    EXPECT_EQ(raindrop_render(again, 96, 8, 8, NULL, NULL, rain, scene.environment, NULL, NULL), SAT_OK);
    EXPECT(memcmp(rgb, again, sizeof rgb) == 0 && rgb[3 * (4 * 8 + 4)] > 0);
    EXPECT_EQ(raindrop_environment_render(rgb, 0, 8, 8, NULL, scene.environment, NULL), SAT_OK);
    EXPECT_EQ(raindrop_environment_render(again, 96, 8, 8, NULL, scene.environment, NULL), SAT_OK);
    EXPECT(memcmp(rgb, again, sizeof rgb) == 0);
    memset(rgb, 0, sizeof rgb);
    /* bottom row first in memory */
    EXPECT_EQ(raindrop_render(rgb + 3 * 8 * 7, -96, 8, 8, NULL, NULL, rain, scene.environment, NULL, NULL), SAT_OK);
    EXPECT(rgb[3 * (4 * 8 + 4)] > 0);
    raindrop_rain_destroy(rain);
    rt_close(&scene);
}
