/* guided - smooths a picture, or a map of depths, and keeps its edges.  SPDX-License-Identifier: MIT-0 OR Unlicense

       guided in.exr out.png --radius 12 --epsilon 0.02
       guided                                        a noisy map of depths about 1000 m: out/guided.png
       guided --stats                                errors and times beside the same filter in plain sums

   The guided filter (He, Sun, Tang 2010): around each pixel a line q = a I + b is fitted to the pixels p by their
   variance and covariance, a = cov(I, p) / (var(I) + epsilon), b = mean(p) - a mean(I); then the lines that a pixel
   lies in are averaged. Here I is the luminance and p each channel. Where the variance is small beside the mean, sums
   of x and x * x have lost it; sat.h keeps moments about the mean of each tile. */

#define _POSIX_C_SOURCE 200809L
#define SAT_IMPLEMENTATION
#include "../sat.h"
#include "common.h"

typedef struct filter {
    int radius;
    double epsilon;
    const sat_threads *threads;
} filter;

/* ---- with sat.h */

typedef struct tables {
    sat_moments *moments;
    sat_table *lines;
    float *pairs, *variance, *covariance, *mean_i, *mean_p; /* (I, p), later (a, b) */
} tables;

static sat_result make_tables(tables *t, int width, int height, const filter *f)
{
    size_t n = (size_t)width * (size_t)height;
    sat_moments_options moments = sat_moments_defaults();
    sat_options lines = sat_defaults();
    sat_result result;
    memset(t, 0, sizeof *t);
    moments.covariance = 1;
    moments.threads = lines.threads = *f->threads;
    t->pairs = (float *)malloc(n * 6 * sizeof(float));
    if (!t->pairs) return SAT_ERR_MEMORY;
    t->variance = t->pairs + 2 * n;
    t->covariance = t->variance + n;
    t->mean_i = t->covariance + n;
    t->mean_p = t->mean_i + n;
    result = sat_moments_create(&t->moments, width, height, 2, &moments);
    return result == SAT_OK ? sat_create(&t->lines, width, height, 2, &lines) : result;
}

static void free_tables(tables *t)
{
    sat_moments_destroy(t->moments);
    sat_destroy(t->lines);
    free(t->pairs);
}

/* One channel of the picture, in place. guide: one float a pixel. */
static sat_result guide_channel(tables *t, image *picture, int channel, const float *guide, const filter *f)
{
    size_t n = (size_t)picture->width * (size_t)picture->height, step = (size_t)picture->channels, i;
    sat_image pairs = sat_image_f32(t->pairs, picture->width, picture->height, 2);
    float *p = picture->pixels + channel;
    sat_result result;
    for (i = 0; i < n; i++) {
        t->pairs[2 * i] = guide[i];
        t->pairs[2 * i + 1] = p[i * step];
    }
    result = sat_moments_build(t->moments, &pairs);
    if (result == SAT_OK) result = sat_moments_filter(t->variance, t->mean_i, 0, t->moments, 0, 0, f->radius);
    if (result == SAT_OK) result = sat_moments_filter(t->covariance, t->mean_p, 0, t->moments, 1, 0, f->radius);
    for (i = 0; i < n && result == SAT_OK; i++) {
        double a = (double)t->covariance[i] / ((double)t->variance[i] + f->epsilon * f->epsilon);
        t->pairs[2 * i] = (float)a;
        t->pairs[2 * i + 1] = (float)((double)t->mean_p[i] - a * (double)t->mean_i[i]);
    }
    if (result == SAT_OK) result = sat_build(t->lines, &pairs);
    if (result == SAT_OK) result = sat_box_filter(t->pairs, 0, t->lines, f->radius);
    for (i = 0; i < n && result == SAT_OK; i++) p[i * step] = t->pairs[2 * i] * guide[i] + t->pairs[2 * i + 1];
    return result;
}

/* ---- the same in plain sums of x and x * x, in doubles or in floats, as box filters commonly run */

#define PLAIN_MEANS(name, type)                                                                                        \
    static void name(type *out, const type *in, type *column, int width, int height, int r)                            \
    {                                                                                                                  \
        int x, y;                                                                                                      \
        for (x = 0; x < width; x++) column[x] = 0;                                                                     \
        for (y = 0; y < r && y < height; y++)                                                                          \
            for (x = 0; x < width; x++) column[x] += in[(size_t)y * (size_t)width + (size_t)x];                        \
        for (y = 0; y < height; y++) {                                                                                 \
            const type *enter = in + (size_t)(y + r) * (size_t)width, *leave = in + (size_t)(y - r - 1) * (size_t)width; \
            int rows = (y + r < height ? y + r : height - 1) - (y > r ? y - r : 0) + 1;                                \
            type sum = 0;                                                                                              \
            for (x = 0; x < width; x++) {                                                                              \
                if (y + r < height) column[x] += enter[x];                                                             \
                if (y > r) column[x] -= leave[x];                                                                      \
            }                                                                                                          \
            for (x = 0; x < r && x < width; x++) sum += column[x];                                                     \
            for (x = 0; x < width; x++) {                                                                              \
                int columns = (x + r < width ? x + r : width - 1) - (x > r ? x - r : 0) + 1;                           \
                if (x + r < width) sum += column[x + r];                                                               \
                if (x > r) sum -= column[x - r - 1];                                                                   \
                out[(size_t)y * (size_t)width + (size_t)x] = sum / (type)(rows * columns);                             \
            }                                                                                                          \
        }                                                                                                              \
    }
PLAIN_MEANS(plain_means_f64, double)
PLAIN_MEANS(plain_means_f32, float)

#define PLAIN_GUIDE(name, means, type)                                                                                 \
    static int name(float *out, const image *picture, int channel, const float *guide, const filter *f)                \
    {                                                                                                                  \
        int w = picture->width, h = picture->height, r = f->radius, k;                                                 \
        size_t n = (size_t)w * (size_t)h, step = (size_t)picture->channels, i;                                         \
        type *in[4], *mean[4], *memory = (type *)malloc((n * 8 + (size_t)w) * sizeof(type));                           \
        const float *p = picture->pixels + channel;                                                                    \
        if (!memory) return 0;                                                                                         \
        for (k = 0; k < 4; k++) in[k] = memory + (size_t)k * n, mean[k] = memory + (size_t)(k + 4) * n;                \
        for (i = 0; i < n; i++) {                                                                                      \
            type x = (type)guide[i], y = (type)p[i * step];                                                            \
            in[0][i] = x, in[1][i] = y, in[2][i] = x * x, in[3][i] = x * y;                                            \
        }                                                                                                              \
        for (k = 0; k < 4; k++) means(mean[k], in[k], memory + 8 * n, w, h, r);                                        \
        for (i = 0; i < n; i++) {                                                                                      \
            type variance = mean[2][i] - mean[0][i] * mean[0][i], covariance = mean[3][i] - mean[0][i] * mean[1][i];   \
            in[0][i] = covariance / (variance + (type)(f->epsilon * f->epsilon));                                      \
            in[1][i] = mean[1][i] - in[0][i] * mean[0][i];                                                             \
        }                                                                                                              \
        for (k = 0; k < 2; k++) means(mean[k], in[k], memory + 8 * n, w, h, r);                                        \
        for (i = 0; i < n; i++) out[i * step] = (float)(mean[0][i] * (type)guide[i] + mean[1][i]);                     \
        free(memory);                                                                                                  \
        return 1;                                                                                                      \
    }
PLAIN_GUIDE(plain_guide_f64, plain_means_f64, double)
PLAIN_GUIDE(plain_guide_f32, plain_means_f32, float)

/* ---- inputs and outputs */

/* Two slopes and steps about 1000 m, with noise of 5 cm. */
static int make_depth(image *picture, int width, int height)
{
    uint32_t state = 12345;
    int x, y;
    if (!image_create(picture, width, height, 1)) return 0;
    for (y = 0; y < height; ++y)
        for (x = 0; x < width; ++x) {
            double u = (double)x / width, v = (double)y / height, noise;
            int k;
            for (noise = 0, k = 0; k < 4; k++) {
                state = state * 1664525u + 1013904223u;
                noise += (double)(state >> 8) / 16777216 - 0.5;
            }
            picture->pixels[(size_t)y * (size_t)width + (size_t)x] =
                (float)(1000 + 0.6 * u + ((int)(u * 8) + (int)(v * 4)) % 2 * 0.8 + (v > u ? 0.9 : 0) + 0.09 * noise);
        }
    return 1;
}

static float *make_guide(const image *picture)
{
    size_t n = (size_t)picture->width * (size_t)picture->height, i;
    float *guide = (float *)malloc(n * sizeof(float));
    for (i = 0; i < n && guide; i++) {
        const float *p = picture->pixels + i * (size_t)picture->channels;
        guide[i] = picture->channels < 3 ? p[0] : 0.2126729f * p[0] + 0.7151522f * p[1] + 0.0721750f * p[2];
    }
    return guide;
}

static void print_errors(const char *name, const image *out, const image *reference, double seconds)
{
    size_t n = (size_t)out->width * (size_t)out->height * (size_t)out->channels, i;
    double squares = 0, worst = 0;
    for (i = 0; i < n; i++) {
        double e = fabs((double)out->pixels[i] - (double)reference->pixels[i]);
        squares += e * e;
        if (!(e <= worst)) worst = e;
    }
    printf("%-22s %8.2f ms, off by %.2g at most, %.2g RMS\n", name, 1e3 * seconds, worst, sqrt(squares / (double)n));
}

static image copy_of(const image *picture)
{
    image copy;
    if (image_create(&copy, picture->width, picture->height, picture->channels))
        memcpy(copy.pixels, picture->pixels,
               (size_t)copy.width * (size_t)copy.height * (size_t)copy.channels * sizeof(float));
    return copy;
}

/* Filters the picture; with --stats the other two ways as well. */
static int run(const common_settings *common, image *picture, const filter *f)
{
    image plain = copy_of(picture), single = copy_of(picture);
    float *guide = make_guide(picture);
    int c, ok = guide && plain.pixels && single.pixels;
    double start, seconds[3] = {0, 0, 0};
    sat_result result = SAT_OK;
    tables t;
    memset(&t, 0, sizeof t);
    for (c = 0; c < picture->channels && ok && common->stats; c++) {
        start = common_clock();
        ok = plain_guide_f64(plain.pixels + c, picture, c, guide, f);
        seconds[1] += common_clock() - start;
        start = common_clock();
        ok = ok && plain_guide_f32(single.pixels + c, picture, c, guide, f);
        seconds[2] += common_clock() - start;
    }
    if (ok) result = make_tables(&t, picture->width, picture->height, f);
    for (c = 0; c < picture->channels && ok && result == SAT_OK; c++) {
        start = common_clock();
        result = guide_channel(&t, picture, c, guide, f);
        seconds[0] += common_clock() - start;
    }
    free_tables(&t);
    if (!ok) common_say(common, "no memory");
    if (result != SAT_OK) ok = common_say_result(common, "guided filter", result, NULL);
    if (ok && common->stats) {
        print_errors("plain sums of doubles", &plain, &plain, seconds[1]);
        print_errors("sat.h", picture, &plain, seconds[0]);
        print_errors("plain sums of floats", &single, &plain, seconds[2]);
    }
    free(guide);
    image_free(&plain);
    image_free(&single);
    return ok;
}

int main(int argc, char **argv)
{
    const char *in = NULL;
    int size[2] = {640, 360}, ok;
    filter f = {8, 0.1, NULL};
    const common_option options[] = {
        {"in", 'P', (void *)&in, 0, 0, "picture to smooth; without one a map of depths is made"},
        {"radius", 'i', &f.radius, 1, 1000, "of the boxes, in pixels"},
        {"epsilon", 'd', &f.epsilon, 1e-6, 1e6, "differences below this are smoothed"},
        {"size", 'z', size, 1, 16384, "of the map that is made when no picture is given"},
    };
    common_settings common;
    image picture;
    size_t n, i;
    common_parse(&common, argc, argv, "guided", ".png .exr .hdr .pfm", options, SAT__COUNT(options));
    f.threads = &common.threads;
    if (!(in ? image_load(&picture, in) : make_depth(&picture, size[0], size[1])))
        return common_say(&common, picture.message), 1;
    ok = run(&common, &picture, &f);
    n = (size_t)picture.width * (size_t)picture.height;
    for (i = 0; i < n && !in && image_ends_with(common.out, ".png"); i++)
        picture.pixels[i] = (picture.pixels[i] - 999.8f) / 3; /* depths as light */
    ok = ok && common_save(&common, common.out, &picture);
    image_free(&picture);
    common_close(&common);
    return !ok;
}
