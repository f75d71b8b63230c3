/* reference_tonemap.h - the tone mapping operators as their equations say, slowly.
   SPDX-License-Identifier: MIT-0 OR Unlicense

   Double precision, exact Gaussians or boxes by direct sums, one full picture for each scale. */

#ifndef REFERENCE_TONEMAP_H
#define REFERENCE_TONEMAP_H

#include "metrics.h"

enum { REFERENCE_SCALES = 8, REFERENCE_ASHIKHMIN = 10 };
static const int reference_length[REFERENCE_SCALES] = {1, 3, 5, 7, 11, 17, 27, 41};

/* Luminance of RGB floats; NaN and what is not positive count as 0. */
static inline void reference_luminance(double *out, const float *rgb, size_t n)
{
    size_t i;
    for (i = 0; i < n; ++i) {
        double y =
            0.2126729 * (double)rgb[3 * i] + 0.7151522 * (double)rgb[3 * i + 1] + 0.0721750 * (double)rgb[3 * i + 2];
        out[i] = y > 0 ? y : 0;
    }
}

/* Eq A.1 over the positive luminances. */
static inline double reference_log_average(const double *luminance, size_t n)
{
    double sum = 0;
    size_t i, count = 0;
    for (i = 0; i < n; ++i)
        if (luminance[i] > 0) {
            sum += log(luminance[i]);
            ++count;
        }
    return count ? exp(sum / (double)count) : 1;
}

/* The mean over (2 radius + 1)^2 pixels, clipped to the picture: running sums along rows, then along columns. */
static inline void reference_box(double *out, const double *in, int width, int height, int radius)
{
    double *rows = metrics_alloc((size_t)width * (size_t)height);
    int x, y, i;
    for (y = 0; y < height; ++y)
        for (x = 0; x < width; ++x) {
            double s = 0;
            for (i = x - radius < 0 ? 0 : x - radius; i <= x + radius && i < width; ++i)
                s += in[(size_t)y * (size_t)width + (size_t)i];
            rows[(size_t)y * (size_t)width + (size_t)x] = s;
        }
    for (y = 0; y < height; ++y) {
        int y0 = y - radius < 0 ? 0 : y - radius, y1 = y + radius >= height ? height : y + radius + 1;
        double *row = out + (size_t)y * (size_t)width;
        memset(row, 0, (size_t)width * sizeof *row);
        for (i = y0; i < y1; ++i)
            for (x = 0; x < width; ++x) row[x] += rows[(size_t)i * (size_t)width + (size_t)x];
        for (x = 0; x < width; ++x) {
            int x0 = x - radius < 0 ? 0 : x - radius, x1 = x + radius >= width ? width : x + radius + 1;
            row[x] /= (double)(x1 - x0) * (y1 - y0);
        }
    }
    free(rows);
}

/* ---- photographic operator */

typedef struct reference_photographic {
    double key, phi, epsilon;
    int scales, gaussian;        /* gaussian: sigma = length / 4 (Reinhard 2002: the length is 4 sigma); else boxes */
    int pixel_scale;             /* 1: s of eq A.5 is the length; 0: the index 1..8 */
} reference_photographic;

static inline reference_photographic reference_photographic_defaults(int gaussian)
{
    reference_photographic r;
    r.key = 0.18;
    r.phi = 8;
    r.epsilon = 0.05;
    r.scales = REFERENCE_SCALES;
    r.gaussian = gaussian;
    r.pixel_scale = 1;
    return r;
}

/* La of every pixel from scaled luminances, eq A.5 to A.9: the centre of the first failing step, else the last. */
static inline void reference_local(double *la, const double *scaled, int width, int height,
                                   const reference_photographic *r)
{
    size_t n = (size_t)width * (size_t)height, i;
    double *centre = metrics_alloc(n), *surround = metrics_alloc(n);
    unsigned char *done = (unsigned char *)calloc(n, 1);
    int k;
    memcpy(centre, scaled, n * sizeof *centre);
    memcpy(la, scaled, n * sizeof *la);
    for (k = 0; k + 1 < r->scales; ++k) {
        double s = r->pixel_scale ? reference_length[k] : k + 1;
        if (r->gaussian) metrics_gauss(surround, scaled, width, height, reference_length[k + 1] / 4.0);
        else reference_box(surround, scaled, width, height, reference_length[k + 1] / 2);
        for (i = 0; i < n; ++i) {
            double v = (centre[i] - surround[i]) / (exp2(r->phi) * r->key / (s * s) + centre[i]);
            if (done[i]) continue;
            if (fabs(v) < r->epsilon) la[i] = surround[i];
            else done[i] = 1;
        }
        memcpy(centre, surround, n * sizeof *centre);
    }
    free(centre);
    free(surround);
    free(done);
}

/* ---- the guided filter (He 2013) of log2 of the scaled luminance by itself, over 21 x 21 pixels */

static inline void reference_guided(double *la, const double *scaled, int width, int height, double edge)
{
    size_t n = (size_t)width * (size_t)height, i;
    double *q = metrics_alloc(n), *a = metrics_alloc(n), *b = metrics_alloc(n), *mean = metrics_alloc(n);
    q[0] = b[0] = 0; /* n > 0, which compilers do not know */
    for (i = 0; i < n; ++i) {
        q[i] = log2(fmin(fmax(scaled[i], 1 / 1024.0), 256));
        b[i] = q[i] * q[i];
    }
    reference_box(mean, q, width, height, 10);
    reference_box(a, b, width, height, 10);
    for (i = 0; i < n; ++i) {
        double var = fmax(a[i] - mean[i] * mean[i], 0);
        a[i] = var / (var + edge * edge);
        b[i] = (1 - a[i]) * mean[i];
    }
    reference_box(la, a, width, height, 10);
    reference_box(mean, b, width, height, 10);
    for (i = 0; i < n; ++i) la[i] = exp2(la[i] * q[i] + mean[i]) * fmax(scaled[i] / 256, 1);
    free(q);
    free(a);
    free(b);
    free(mean);
}

/* ---- curves of one pixel, from their publications: curve 0 Neutral, 1 AgX, 2 ACES (Hill), 3 Hable */

static inline void reference_rows(double *out, const double m[3][3], const double *v)
{
    int i;
    for (i = 0; i < 3; ++i) out[i] = m[i][0] * v[0] + m[i][1] * v[1] + m[i][2] * v[2];
}

static inline double reference_hable(double x)
{
    const double A = 0.15, B = 0.50, C = 0.10, D = 0.20, E = 0.02, F = 0.30;
    return (x * (A * x + C * B) + D * E) / (x * (A * x + B) + D * F) - E / F;
}

static inline void reference_curve(double *out, const double *v, int curve)
{
    static const double aces_in[3][3] = {
        {0.59719, 0.35458, 0.04823}, {0.07600, 0.90834, 0.01566}, {0.02840, 0.13383, 0.83777}};
    static const double aces_out[3][3] = {
        {1.60475, -0.53108, -0.07367}, {-0.10208, 1.10813, -0.00605}, {-0.00327, -0.07276, 1.07602}};
    static const double agx_in[3][3] = {{0.842479062253094, 0.0784335999999992, 0.0792237451477643},
                                        {0.0423282422610123, 0.878468636469772, 0.0791661274605434},
                                        {0.0423756549057051, 0.0784336, 0.879142973793104}};
    static const double agx_out[3][3] = {{1.19687900512017, -0.0980208811401368, -0.0990297440797205},
                                         {-0.0528967518574562, 1.15190312990417, -0.0989611768448433},
                                         {-0.0529716355144438, -0.0980434501171241, 1.15107367264116}};
    double t[3], x, offset, peak, new_peak, g;
    int c;
    if (curve == 0) {
        x = fmin(v[0], fmin(v[1], v[2]));
        offset = x < 0.08 ? x - 6.25 * x * x : 0.04;
        for (c = 0; c < 3; ++c) out[c] = v[c] - offset;
        peak = fmax(out[0], fmax(out[1], out[2]));
        if (peak >= 0.8 - 0.04) {
            double d = 1 - (0.8 - 0.04);
            new_peak = 1 - d * d / (peak + d - (0.8 - 0.04));
            g = 1 - 1 / (0.15 * (peak - new_peak) + 1);
            for (c = 0; c < 3; ++c) out[c] = out[c] * new_peak / peak * (1 - g) + new_peak * g;
        }
    } else if (curve == 1) {
        reference_rows(t, agx_in, v);
        for (c = 0; c < 3; ++c) {
            x = (fmin(fmax(log2(fmax(t[c], 1e-10)), -12.47393), 4.026069) + 12.47393) / (4.026069 + 12.47393);
            t[c] = 15.5 * pow(x, 6) - 40.14 * pow(x, 5) + 31.96 * pow(x, 4) - 6.868 * pow(x, 3) + 0.4298 * x * x +
                   0.1191 * x - 0.00232;
        }
        reference_rows(out, agx_out, t);
        for (c = 0; c < 3; ++c) out[c] = pow(fmax(out[c], 0), 2.2);
    } else if (curve == 2) {
        for (c = 0; c < 3; ++c) out[c] = v[c] / 0.6;
        reference_rows(t, aces_in, out);
        for (c = 0; c < 3; ++c)
            t[c] = (t[c] * (t[c] + 0.0245786) - 0.000090537) / (t[c] * (0.983729 * t[c] + 0.4329510) + 0.238081);
        reference_rows(out, aces_out, t);
    } else {
        for (c = 0; c < 3; ++c) out[c] = reference_hable(2 * v[c]) / reference_hable(11.2);
    }
    for (c = 0; c < 3; ++c) out[c] = fmin(fmax(out[c], 0), 1);
}

/* SMPTE ST 2084 and ITU-R BT.2100, table 5 */
static inline double reference_pq(double cd)
{
    const double m1 = 2610.0 / 16384, m2 = 2523.0 / 4096 * 128, c1 = 3424.0 / 4096, c2 = 2413.0 / 4096 * 32,
                 c3 = 2392.0 / 4096 * 32;
    double y = pow(cd / 10000, m1);
    return pow((c1 + c2 * y) / (1 + c3 * y), m2);
}

static inline double reference_hlg(double scene)
{
    const double a = 0.17883277, b = 1 - 4 * a, c = 0.5 - a * log(4 * a);
    return scene <= 1.0 / 12 ? sqrt(3 * scene) : a * log(12 * scene - b) + c;
}

/* ---- colour as the thesis has it: RGB -> XYZ -> Lab -> La'b -> XYZ -> Yxy -> Y'xy -> XYZ -> RGB (section A.5.3) */

static inline double reference_rho(double lux)
{
    double e = lux > 0 ? 70 / (1 + pow(10 / lux, 0.383)) + 22 : 22, rho = e / 57;
    return rho < 1 ? rho : 1;
}

/* rho = 1 leaves Lab out of it; white is the luminance that counts as white in Lab, <= 0: the pixel's own. */
static inline void reference_colour(double *out, const float *in, double display, double rho, double white)
{
    double rgb[3], xyz[3], lab[3], x, y;
    int c;
    for (c = 0; c < 3; ++c) rgb[c] = (double)in[c];
    metrics_xyz(xyz, rgb);
    if (!(xyz[1] > 0)) {
        out[0] = out[1] = out[2] = 0;
        return;
    }
    if (rho < 1) {
        double w = white > 0 ? white : xyz[1], fx, fy, fz;
        for (c = 0; c < 3; ++c) xyz[c] /= w;
        metrics_lab(lab, xyz);
        if (lab[1] > 0) lab[1] *= rho;
        fy = (lab[0] + 16) / 116;
        fx = fy + lab[1] / 500;
        fz = fy - lab[2] / 200;
        xyz[0] = 0.95047 * metrics_lab_inverse(fx) * w;
        xyz[1] = metrics_lab_inverse(fy) * w;
        xyz[2] = 1.08883 * metrics_lab_inverse(fz) * w;
    }
    x = xyz[0] / (xyz[0] + xyz[1] + xyz[2]);
    y = xyz[1] / (xyz[0] + xyz[1] + xyz[2]);
    xyz[0] = x * display / y;
    xyz[1] = display;
    xyz[2] = (1 - x - y) * display / y;
    metrics_rgb(out, xyz);
}

/* ---- Ashikhmin */

/* Capacity with the published constants, or made continuous. */
static inline double reference_capacity(double cd, int continuous)
{
    double c1 = continuous ? 0.0034 / 0.0014 : 2.4483, c2, c3;
    c2 = continuous ? c1 + log(1 / 0.0034) / 0.4027 : 16.5630;
    c3 = continuous ? c2 + 6.2444 / 0.4027 : 32.0693;
    if (!(cd > 0)) return 0;
    if (cd < 0.0034) return cd / 0.0014;
    if (cd < 1) return c1 + log(cd / 0.0034) / 0.4027;
    if (cd < 7.2444) return c2 + (cd - 1) / 0.4027;
    return c3 + log(cd / 7.2444) / 0.0556;
}

/* La: the first of 10 neighbourhoods whose mean differs by half from that of twice its size. Gaussian of sigma s / 2,
   or the box of the same variance. */
static inline void reference_ashikhmin(double *la, const double *luminance, int width, int height, int gaussian)
{
    size_t n = (size_t)width * (size_t)height, i;
    double *plane[2 * REFERENCE_ASHIKHMIN + 1];
    int s;
    for (s = 1; s <= 2 * REFERENCE_ASHIKHMIN; ++s) {
        plane[s] = NULL;
        if (s > REFERENCE_ASHIKHMIN && s % 2) continue;
        plane[s] = metrics_alloc(n);
        if (s == 1) memcpy(plane[s], luminance, n * sizeof *la);
        else if (gaussian) metrics_gauss(plane[s], luminance, width, height, s / 2.0);
        else reference_box(plane[s], luminance, width, height, (int)floor((sqrt(3.0 * s * s + 1) - 1) / 2 + 0.5));
    }
    for (i = 0; i < n; ++i) {
        for (s = 1; s < REFERENCE_ASHIKHMIN; ++s)
            if (!(fabs(plane[s][i] - plane[2 * s][i]) < 0.5 * plane[s][i])) break;
        la[i] = plane[s][i];
    }
    for (s = 1; s <= 2 * REFERENCE_ASHIKHMIN; ++s) free(plane[s]);
}

/* Eq A.3 / A.4 as 8-bit codes of the display luminance. */
static inline void reference_codes(double *codes, const double *scaled, const double *la, size_t n)
{
    size_t i;
    for (i = 0; i < n; ++i) codes[i] = metrics_code(scaled[i] / (1 + la[i]));
}

#endif /* REFERENCE_TONEMAP_H */
