/* metrics.h - how different two pictures are.                        SPDX-License-Identifier: MIT-0 OR Unlicense

   All take 8-bit sRGB codes as doubles 0..255, packed, not necessarily whole numbers. Planes: one value a pixel.
   Colour: three. */

#ifndef METRICS_H
#define METRICS_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static inline double *metrics_alloc(size_t n)
{
    double *p = (double *)malloc((n ? n : 1) * sizeof *p);
    if (!p) { puts("no memory"); exit(1); }
    return p;
}

/* ---- differences of codes */

typedef struct metrics_codes { double rms, largest, over1, over5, p99; } metrics_codes; /* shares of values in 0..1 */

static inline metrics_codes metrics_compare_codes(const double *a, const double *b, size_t n)
{
    metrics_codes m = {0, 0, 0, 0, 0};
    size_t histogram[2561], i, seen = 0;
    memset(histogram, 0, sizeof histogram);
    for (i = 0; i < n; ++i) {
        double d = fabs(a[i] - b[i]);
        m.rms += d * d;
        if (!(d <= m.largest)) m.largest = d;
        m.over1 += d > 1;
        m.over5 += d > 5;
        histogram[d < 256 ? (int)(d * 10) : 2560]++;
    }
    for (i = 0; i <= 2560 && (double)seen < 0.99 * (double)n; ++i) seen += histogram[i];
    m.p99 = (double)i / 10;
    m.rms = sqrt(m.rms / (double)n);
    m.over1 /= (double)n;
    m.over5 /= (double)n;
    return m;
}

/* ---- separable convolution; the kernel is renormalised where it leaves the picture */

static inline void metrics_convolve(double *out, const double *in, int width, int height, const double *kernel,
                                    int radius)
{
    double *middle = metrics_alloc((size_t)width * (size_t)height);
    int x, y, i;
    for (y = 0; y < height; ++y)
        for (x = 0; x < width; ++x) {
            double sum = 0, weight = 0;
            for (i = -radius; i <= radius; ++i) {
                if (x + i < 0 || x + i >= width) continue;
                sum += kernel[i + radius] * in[(size_t)y * (size_t)width + (size_t)(x + i)];
                weight += kernel[i + radius];
            }
            middle[(size_t)y * (size_t)width + (size_t)x] = sum / weight;
        }
    for (y = 0; y < height; ++y) {
        double *row = out + (size_t)y * (size_t)width, weight = 0;
        memset(row, 0, (size_t)width * sizeof *row);
        for (i = -radius; i <= radius; ++i) {
            const double *from = middle + (size_t)(y + i) * (size_t)width;
            if (y + i < 0 || y + i >= height) continue;
            weight += kernel[i + radius];
            for (x = 0; x < width; ++x) row[x] += kernel[i + radius] * from[x];
        }
        for (x = 0; x < width; ++x) row[x] /= weight;
    }
    free(middle);
}

/* sigma in pixels, cut at 5 sigma */
static inline void metrics_gauss(double *out, const double *in, int width, int height, double sigma)
{
    int radius = (int)ceil(5 * sigma), i;
    double *kernel = metrics_alloc((size_t)(2 * radius + 1));
    for (i = -radius; i <= radius; ++i) kernel[i + radius] = sigma > 0 ? exp(-0.5 * i * i / (sigma * sigma)) : 1;
    metrics_convolve(out, in, width, height, kernel, radius);
    free(kernel);
}

/* ---- SSIM (Wang 2004): 11 x 11 Gaussian window of sigma 1.5, mean over the windows that lie inside */

static inline double metrics_ssim(const double *a, const double *b, int width, int height)
{
    double *plane[5], *tmp, kernel[11], total = 0;
    size_t n = (size_t)width * (size_t)height, i;
    int k, x, y;
    if (width < 11 || height < 11) return NAN;
    tmp = metrics_alloc(n);
    for (k = 0; k < 11; ++k) kernel[k] = exp(-0.5 * (k - 5) * (k - 5) / 2.25);
    for (k = 0; k < 5; ++k) {
        plane[k] = metrics_alloc(n);
        for (i = 0; i < n; ++i)
            tmp[i] = k == 0 ? a[i] : k == 1 ? b[i] : k == 2 ? a[i] * a[i] : k == 3 ? b[i] * b[i] : a[i] * b[i];
        metrics_convolve(plane[k], tmp, width, height, kernel, 5);
    }
    for (y = 5; y < height - 5; ++y)
        for (x = 5; x < width - 5; ++x) {
            double ma, mb, va, vb, c;
            i = (size_t)y * (size_t)width + (size_t)x;
            ma = plane[0][i];
            mb = plane[1][i];
            va = plane[2][i] - ma * ma;
            vb = plane[3][i] - mb * mb;
            c = plane[4][i] - ma * mb;
            total += (2 * ma * mb + 6.5025) * (2 * c + 58.5225) / ((ma * ma + mb * mb + 6.5025) * (va + vb + 58.5225));
        }
    for (k = 0; k < 5; ++k) free(plane[k]);
    free(tmp);
    return total / ((double)(width - 10) * (height - 10));
}

/* ---- colour */

static inline double metrics_linear(double code)
{
    double v = code / 255;
    return v <= 0.04045 ? v / 12.92 : pow((v + 0.055) / 1.055, 2.4);
}

static inline double metrics_code(double linear)
{
    if (!(linear > 0)) return 0;
    if (linear >= 1) return 255;
    return 255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - 0.055);
}

static inline void metrics_xyz(double *xyz, const double *rgb)
{
    xyz[0] = 0.4124564 * rgb[0] + 0.3575761 * rgb[1] + 0.1804375 * rgb[2];
    xyz[1] = 0.2126729 * rgb[0] + 0.7151522 * rgb[1] + 0.0721750 * rgb[2];
    xyz[2] = 0.0193339 * rgb[0] + 0.1191920 * rgb[1] + 0.9503041 * rgb[2];
}

static inline void metrics_rgb(double *rgb, const double *xyz)
{
    rgb[0] = 3.2404542 * xyz[0] - 1.5371385 * xyz[1] - 0.4985314 * xyz[2];
    rgb[1] = -0.9692660 * xyz[0] + 1.8760108 * xyz[1] + 0.0415560 * xyz[2];
    rgb[2] = 0.0556434 * xyz[0] - 0.2040259 * xyz[1] + 1.0572252 * xyz[2];
}

static inline double metrics_lab_f(double t) { return t > 216.0 / 24389 ? cbrt(t) : t * (24389.0 / 3132) + 16.0 / 116; }
static inline double metrics_lab_inverse(double f)
{
    return f > 6.0 / 29 ? f * f * f : (f - 16.0 / 116) * (3132.0 / 24389);
}

/* D65, Y of white 1 */
static inline void metrics_lab(double *lab, const double *xyz)
{
    double fx = metrics_lab_f(xyz[0] / 0.95047), fy = metrics_lab_f(xyz[1]), fz = metrics_lab_f(xyz[2] / 1.08883);
    lab[0] = 116 * fy - 16;
    lab[1] = 500 * (fx - fy);
    lab[2] = 200 * (fy - fz);
}

/* ---- S-CIELAB (Zhang and Wandell 1997): mean of Delta E 1976 after blurring the opponent planes as the eye does */

static inline void metrics_scielab_planes(double *plane[3], const double *codes, int width, int height,
                                          double pixels_per_degree)
{
    static const double weight[3][3] = {{0.921, 0.105, -0.108}, {0.531, 0.330, 0}, {0.488, 0.371, 0}};
    static const double spread[3][3] = {{0.0283, 0.133, 4.336}, {0.0392, 0.494, 0}, {0.0536, 0.386, 0}};
    size_t n = (size_t)width * (size_t)height, i;
    double *blurred = metrics_alloc(n), *source = metrics_alloc(n);
    int c, k;
    for (i = 0; i < n; ++i) {
        double rgb[3], xyz[3];
        for (c = 0; c < 3; ++c) rgb[c] = metrics_linear(codes[3 * i + (size_t)c]);
        metrics_xyz(xyz, rgb);
        plane[0][i] = 0.279 * xyz[0] + 0.72 * xyz[1] - 0.107 * xyz[2];
        plane[1][i] = -0.449 * xyz[0] + 0.29 * xyz[1] - 0.077 * xyz[2];
        plane[2][i] = 0.086 * xyz[0] - 0.59 * xyz[1] + 0.501 * xyz[2];
    }
    for (c = 0; c < 3; ++c) {
        double total = weight[c][0] + weight[c][1] + weight[c][2];
        memcpy(source, plane[c], n * sizeof *source);
        memset(plane[c], 0, n * sizeof *source);
        for (k = 0; k < 3; ++k) {
            double sigma = spread[c][k] * pixels_per_degree / sqrt(2.0);
            if (weight[c][k] == 0) continue;
            if (sigma > 40) sigma = 40;      /* the widest is a mean of the surroundings; wider than this changes
                                                nothing */
            metrics_gauss(blurred, source, width, height, sigma);
            for (i = 0; i < n; ++i) plane[c][i] += weight[c][k] / total * blurred[i];
        }
    }
    free(blurred);
    free(source);
}

static inline double metrics_scielab(const double *a, const double *b, int width, int height, double pixels_per_degree)
{
    size_t n = (size_t)width * (size_t)height, i;
    double *plane[6], total = 0;
    int c, k;
    for (c = 0; c < 6; ++c) plane[c] = metrics_alloc(n);
    metrics_scielab_planes(plane, a, width, height, pixels_per_degree);
    metrics_scielab_planes(plane + 3, b, width, height, pixels_per_degree);
    for (i = 0; i < n; ++i) {
        double lab[2][3], d = 0;
        for (k = 0; k < 2; ++k) {
            double p = plane[3 * k][i], q = plane[3 * k + 1][i], r = plane[3 * k + 2][i], xyz[3];
            xyz[0] = 0.62656 * p - 1.86718 * q - 0.15316 * r;      /* the inverse of the three sums above */
            xyz[1] = 1.36985 * p + 0.93476 * q + 0.43623 * r;
            xyz[2] = 1.50565 * p + 1.42132 * q + 2.53602 * r;
            metrics_lab(lab[k], xyz);
        }
        for (c = 0; c < 3; ++c) d += (lab[0][c] - lab[1][c]) * (lab[0][c] - lab[1][c]);
        total += sqrt(d);
    }
    for (c = 0; c < 6; ++c) free(plane[c]);
    return total / (double)n;
}

/* ---- FLIP (Andersson 2020) for 8-bit pictures: mean over the pixels, 0 the same .. 1 */

static inline void metrics_flip_blur(double *out, const double *in, int width, int height, double b, double ppd)
{
    int radius = (int)ceil(3 * sqrt(0.04 / (2 * 9.8696044)) * ppd), i;
    double *kernel = metrics_alloc((size_t)(2 * radius + 1));
    for (i = -radius; i <= radius; ++i) kernel[i + radius] = exp(-9.8696044 * i * i / (ppd * ppd * b));
    metrics_convolve(out, in, width, height, kernel, radius);
    free(kernel);
}

static inline void metrics_ycc(double *ycc, const double *xyz)
{
    double x = xyz[0] / 0.950428545, y = xyz[1], z = xyz[2] / 1.088900371;
    ycc[0] = 116 * y - 16;
    ycc[1] = 500 * (x - y);
    ycc[2] = 200 * (y - z);
}

static inline void metrics_hunt_lab(double *lab, const double *rgb)
{
    double xyz[3];
    metrics_xyz(xyz, rgb);
    metrics_lab(lab, xyz);
    lab[1] *= 0.01 * lab[0];
    lab[2] *= 0.01 * lab[0];
}

static inline double metrics_hyab(const double *p, const double *q)
{
    return fabs(p[0] - q[0]) + hypot(p[1] - q[1], p[2] - q[2]);
}

/* The filtered picture as Hunt-adjusted Lab, and its achromatic plane (0..1) for the features. */
static inline void metrics_flip_planes(double *lab, double *grey, const double *codes, int width, int height,
                                       double ppd)
{
    static const double far_share = 13.5 * 11.2099824 * 0.025,
                        near_share = 34.1 * 8.86226925 * 0.04; /* a sqrt(pi / b) times the area ~ b */
    size_t n = (size_t)width * (size_t)height, i;
    double *plane[3], *one = metrics_alloc(n), *two = metrics_alloc(n);
    int c;
    for (c = 0; c < 3; ++c) plane[c] = metrics_alloc(n);
    for (i = 0; i < n; ++i) {
        double rgb[3], xyz[3], ycc[3];
        for (c = 0; c < 3; ++c) rgb[c] = metrics_linear(codes[3 * i + (size_t)c]);
        metrics_xyz(xyz, rgb);
        metrics_ycc(ycc, xyz);
        for (c = 0; c < 3; ++c) plane[c][i] = ycc[c];
        grey[i] = (ycc[0] + 16) / 116;
    }
    metrics_flip_blur(one, plane[0], width, height, 0.0047, ppd);
    memcpy(plane[0], one, n * sizeof *one);
    metrics_flip_blur(one, plane[1], width, height, 0.0053, ppd);
    memcpy(plane[1], one, n * sizeof *one);
    metrics_flip_blur(one, plane[2], width, height, 0.04, ppd);
    metrics_flip_blur(two, plane[2], width, height, 0.025, ppd);
    for (i = 0; i < n; ++i) {
        double xyz[3], rgb[3], y = (plane[0][i] + 16) / 116,
                               blue = (near_share * one[i] + far_share * two[i]) / (near_share + far_share);
        xyz[1] = y;
        xyz[0] = 0.950428545 * (y + plane[1][i] / 500);
        xyz[2] = 1.088900371 * (y - blue / 200);
        metrics_rgb(rgb, xyz);
        for (c = 0; c < 3; ++c) rgb[c] = rgb[c] < 0 ? 0 : rgb[c] > 1 ? 1 : rgb[c];
        metrics_hunt_lab(lab + 3 * i, rgb);
    }
    for (c = 0; c < 3; ++c) free(plane[c]);
    free(one);
    free(two);
}

/* Strength of edges and of points: first and second derivatives of a Gaussian, positive and negative lobes
   normalised. */
static inline void metrics_flip_features(double *edge, double *point, const double *grey, int width, int height,
                                         double ppd)
{
    double sigma = 0.5 * 0.082 * ppd, sums[4] = {0, 0, 0, 0}, kernel[3][64];
    int radius = (int)ceil(3 * sigma), i, x, y;
    double *row = metrics_alloc(3 * (size_t)width * (size_t)height);
    for (i = -radius; i <= radius; ++i) {
        double g = exp(-i * i / (2 * sigma * sigma));
        kernel[0][i + radius] = g;
        kernel[1][i + radius] = -i * g;
        kernel[2][i + radius] = (i * i / (sigma * sigma) - 1) * g;
        sums[0] += g;
        if (i < 0) sums[1] += -i * g;
        if (kernel[2][i + radius] > 0) sums[2] += kernel[2][i + radius];
        else sums[3] -= kernel[2][i + radius];
    }
    for (i = 0; i <= 2 * radius; ++i) {
        kernel[0][i] /= sums[0];
        kernel[1][i] /= sums[1];
        kernel[2][i] /= kernel[2][i] > 0 ? sums[2] : sums[3];
    }
    for (y = 0; y < height; ++y)
        for (x = 0; x < width; ++x) {
            double s[3] = {0, 0, 0};
            for (i = -radius; i <= radius; ++i) {
                int at = x + i < 0 ? 0 : x + i >= width ? width - 1 : x + i, k;
                for (k = 0; k < 3; ++k) s[k] += kernel[k][i + radius] * grey[(size_t)y * (size_t)width + (size_t)at];
            }
            memcpy(row + 3 * ((size_t)y * (size_t)width + (size_t)x), s, sizeof s);
        }
    for (y = 0; y < height; ++y)
        for (x = 0; x < width; ++x) {
            double ex = 0, ey = 0, px = 0, py = 0;
            for (i = -radius; i <= radius; ++i) {
                int at = y + i < 0 ? 0 : y + i >= height ? height - 1 : y + i;
                const double *s = row + 3 * ((size_t)at * (size_t)width + (size_t)x);
                ex += kernel[0][i + radius] * s[1];
                px += kernel[0][i + radius] * s[2];
                ey += kernel[1][i + radius] * s[0];
                py += kernel[2][i + radius] * s[0];
            }
            edge[(size_t)y * (size_t)width + (size_t)x] = hypot(ex, ey);
            point[(size_t)y * (size_t)width + (size_t)x] = hypot(px, py);
        }
    free(row);
}

static inline double metrics_flip(const double *a, const double *b, int width, int height, double pixels_per_degree)
{
    static const double green[3] = {0, 1, 0}, blue[3] = {0, 0, 1};
    size_t n = (size_t)width * (size_t)height, i;
    double *lab[2], *grey[2], *edge[2], *point[2], total = 0, p[3], q[3], most;
    int k;
    metrics_hunt_lab(p, green);
    metrics_hunt_lab(q, blue);
    most = pow(metrics_hyab(p, q), 0.7);
    for (k = 0; k < 2; ++k) {
        lab[k] = metrics_alloc(3 * n);
        grey[k] = metrics_alloc(n);
        edge[k] = metrics_alloc(n);
        point[k] = metrics_alloc(n);
        metrics_flip_planes(lab[k], grey[k], k ? b : a, width, height, pixels_per_degree);
        metrics_flip_features(edge[k], point[k], grey[k], width, height, pixels_per_degree);
    }
    for (i = 0; i < n; ++i) {
        double colour = pow(metrics_hyab(lab[0] + 3 * i, lab[1] + 3 * i), 0.7), limit = 0.4 * most;
        double e = fabs(edge[0][i] - edge[1][i]), f = fabs(point[0][i] - point[1][i]),
               feature = sqrt((e > f ? e : f) / sqrt(2.0));
        colour = colour < limit ? 0.95 / limit * colour : 0.95 + (colour - limit) / (most - limit) * 0.05;
        total += pow(colour, 1 - (feature < 1 ? feature : 1));
    }
    for (k = 0; k < 2; ++k) {
        free(lab[k]);
        free(grey[k]);
        free(edge[k]);
        free(point[k]);
    }
    return total / (double)n;
}

#endif /* METRICS_H */
