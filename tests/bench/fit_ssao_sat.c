/* Fits a kernel for SSAO_SAT_SLABS, polynomials in sine and distance for each ring, to ray-traced pictures and prints
   it as C, beside the error of the kernel that ssao_sat.h has.

   Build as a bench, run with the side of the pictures, rays a pixel, one of how many pixels, ridge, rings, bias (512
   256 17 1e-3); build/ keeps the pictures. Scenes 0 to 2 are fitted, each also left out once (the error there is one
   nothing was fitted to); the others are only measured.

   The model: accessibility = (1 - x)^3, x = face(n.v) fade sum over rings, cells and slabs of
   coverage (1 - d^2 / range^2) sum c[ring][i][j] s^(i + 1) d^j, s the sine over the tangent plane less the bias, d the
   distance in radii. Least squares by Levenberg and Marquardt, ridge on the effect that a coefficient has. */
#define SAT_IMPLEMENTATION
#define SSAO_SAT_IMPLEMENTATION
#include "ssao_sat.h"
#include "bench.h"
#include "mesh.h"
#include "reference_ssao.h"

enum { SINES = 3, DISTANCES = 4, TERMS = SINES * DISTANCES, MOST = 4 * TERMS + 2, FITTED = 3 };

typedef struct sample { float truth, header, fade, facing, x[4][TERMS]; } sample;
typedef struct samples { sample *s; size_t n, room; } samples;

static samples data[REF_SCENES];
static float bias;
static int rings;

/* What one slab holds in one cell, added to the terms of the ring. */
static void add_cell(float *x, const ssao_sat *s, const ssao_sat__point *p, int k, const ssao_sat__cells *c, int i,
                     int j, const float *weight)
{
    const uint32_t *table = s->table + 4 * (size_t)k * s->table_plane;
    const size_t at = ssao_sat__at(s, p->y) + (size_t)p->x;
    float word[4], d[3], own[3], scale = s->camera.orthographic ? 1 : p->z, mean, z, square, sine, distance, share,
                                 power;
    int t, a, b;
    for (t = 0; t < 4; t++)
        word[t] =
            (float)(int32_t)ssao_sat__box(s, table + t, 4, c->column[i], c->row[j], c->column[i + 1], c->row[j + 1]);
    if (!(word[0] > 0)) return;
    mean = (s->slabs[k].low * word[0] + s->slabs[k].quantum * word[1]) / word[0];
    z = s->camera.orthographic ? mean : 1 / mean;
    own[0] = (s->camera.ax * (float)p->x + s->camera.bx) * scale;
    own[1] = (s->camera.ay * (float)p->y + s->camera.by) * scale;
    d[0] = ((float)s->camera.full[0] * word[2] / word[0] + s->camera.bx) * (s->camera.orthographic ? 1 : z) - own[0];
    d[1] = ((float)s->camera.full[2] * word[3] / word[0] + s->camera.by) * (s->camera.orthographic ? 1 : z) - own[1];
    d[2] = z - p->z;
    square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    share = 1 - square / (s->range * s->range);
    distance = sqrtf(square) / s->radius;
    sine = (d[0] * s->nx[at] + d[1] * s->ny[at] + d[2] * s->nz[at]) / sqrtf(square + 1e-30f) - bias;
    if (!(share > 0) || !(sine > 0)) return;
    share *= word[0] * weight[3 * j + i] * sine;
    for (a = 0; a < SINES; a++, share *= sine)
        for (b = 0, power = share; b < DISTANCES; b++, power *= distance) x[a * DISTANCES + b] += power;
}

static void add_pixel(samples *to, const ssao_sat *s, int x, int y, float truth)
{
    size_t at = ssao_sat__at(s, y) + (size_t)x;
    ssao_sat__point p;
    ssao_sat__cells c;
    sample *o;
    float r, rx = s->camera.ax * (float)x + s->camera.bx, ry = s->camera.ay * (float)y + s->camera.by;
    int cut, ring, k, i;
    if (to->n == to->room) {
        to->room = 2 * to->room + 1024;
        to->s = (sample *)realloc(to->s, to->room * sizeof *to->s);
        if (!to->s) exit(1);
    }
    o = &to->s[to->n];
    memset(o, 0, sizeof *o);
    if (!(s->z[at] > 0)) return;
    r = ssao_sat__half_side(s, s->z[at], &cut);
    o->fade = ssao_sat__fade(s, r);
    if (!(o->fade > 0) || ssao_sat__is_flat(s, x, y, r)) return;
    to->n++;
    ssao_sat__set_point(&p, s, x, y, at);
    o->truth = truth;
    o->header = s->open[at];
    o->facing = ref_clamp(-p.facing / sqrtf(1 + rx * rx + ry * ry), 0, 1);
    for (ring = 0; ring < rings; ring++, r *= 1 / 3.0f) {
        int inner[2], outer[2];
        float u[3], v[3], weight[9];
        inner[0] = inner[1] = sat__max_int(1, (int)(r / 3 + 0.5f));
        outer[0] = outer[1] = sat__max_int(inner[0] + 1, (int)(r + 0.5f));
        ssao_sat__cut_axis(c.column, u, x, inner[0], outer[0], s->columns, s->step, s->width);
        ssao_sat__cut_axis(c.row, v, y, inner[1], outer[1], s->rows, s->step, s->height);
        for (i = 0; i < 9; i++) weight[i] = u[i % 3] * v[i / 3];
        for (k = 0; k < s->frame_slabs; k++)
            for (i = 0; i < 9; i++)
                if (i != 4) add_cell(o->x[ring], s, &p, k, &c, i % 3, i / 3, weight);
    }
}

/* One pixel of so many of each radius of the picture. */
static void add_picture(samples *to, const ref_picture *p, int every)
{
    float *out = (float *)malloc((size_t)p->width * (size_t)p->height * 4);
    int r, i, state;
    for (r = 0; r < REF_RADII; r++) {
        ssao_sat_options o = ssao_sat_defaults();
        ssao_sat_input in = ssao_sat_input_linear(p->z, p->width, p->height, p->fov);
        ssao_sat *ao;
        o.radius = (double)p->radius[r];
        o.scales = rings;
        in.normals = p->normals;
        if (ssao_sat_create(&ao, p->width, p->height, &o) != SAT_OK || ssao_sat_apply(ao, out, 0, &in, NULL) != SAT_OK)
            exit(1);
        for (i = 0, state = 0; i < ao->columns * ao->rows; i++) {
            int x = i % ao->columns, y = i / ao->columns;
            state = (state * 73 + 11) % 8191;
            if (state % every == 0)
                add_pixel(to, ao, x, y, p->ao[r][(size_t)(y * ao->step) * (size_t)p->width + (size_t)(x * ao->step)]);
        }
        ssao_sat_destroy(ao);
    }
    free(out);
}

/* ---- the fit ---- */

/* Slopes of the two hats of the factor by facing: below and above a half. */
static float face(const double *q, float facing, double *below, double *above)
{
    *below = facing < 0.5f ? 1 - 2 * (double)facing : 0;
    *above = facing > 0.5f ? 2 * (double)facing - 1 : 0;
    return (float)(1 + (q[0] - 1) * *below + (q[1] - 1) * *above);
}

/* Accessibility by the model, and its derivatives by the coefficients and the two factors. */
static double model(const double *q, int n, const sample *s, double *slope)
{
    double below, above, sum = 0, f = (double)face(q + n, s->facing, &below, &above) * (double)s->fade, open;
    int i;
    for (i = 0; i < n; i++) sum += q[i] * (double)s->x[i / TERMS][i % TERMS];
    open = 1 - f * (sum > 0 ? sum : 0);
    if (open < 0) open = 0;
    if (slope) {
        double by = sum > 0 ? -3 * open * open : 0;
        for (i = 0; i < n; i++) slope[i] = by * f * (double)s->x[i / TERMS][i % TERMS];
        slope[n] = by * sum * (double)s->fade * below;
        slope[n + 1] = by * sum * (double)s->fade * above;
    }
    return open * open * open;
}

/* Sum of squares over all scenes but one; gradient and Gauss-Newton matrix when wanted. Scenes weigh the same. */
static double squares(const double *q, int n, int left_out, double *gradient, double (*matrix)[MOST])
{
    double slope[MOST], total = 0;
    int scene, i, j, m = n + 2;
    size_t k;
    if (matrix) {
        memset(gradient, 0, MOST * sizeof *gradient);
        memset(matrix, 0, MOST * sizeof *matrix);
    }
    for (scene = 0; scene < FITTED; scene++) {
        double w = 1 / (double)(data[scene].n + 1);
        if (scene == left_out) continue;
        for (k = 0; k < data[scene].n; k++) {
            const sample *s = &data[scene].s[k];
            double e = model(q, n, s, matrix ? slope : NULL) - (double)s->truth;
            total += w * e * e;
            if (!matrix) continue;
            for (i = 0; i < m; i++) {
                double v = w * slope[i];
                gradient[i] += v * e;
                for (j = 0; j <= i; j++) matrix[i][j] += v * slope[j];
            }
        }
    }
    return total;
}

/* x of a x = b, a symmetric (lower half given) and positive (Cholesky, in place). */
static int solve(double (*a)[MOST], double *b, int n)
{
    int i, j, k;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            double sum = a[i][j];
            for (k = 0; k < j; k++) sum -= a[i][k] * a[j][k];
            if (i == j && !(sum > 0)) return 0;
            a[i][j] = i == j ? sqrt(sum) : sum / a[j][j];
        }
    for (i = 0; i < n; i++) { for (k = 0; k < i; k++) b[i] -= a[i][k] * b[k]; b[i] /= a[i][i]; }
    for (i = n - 1; i >= 0; i--) { for (k = i + 1; k < n; k++) b[i] -= a[k][i] * b[k]; b[i] /= a[i][i]; }
    return 1;
}

static double fit(double *q, int n, int left_out, double ridge)
{
    static double matrix[MOST][MOST], trial[MOST][MOST];
    double gradient[MOST], step[MOST], size[MOST], damping = 1e-3, best = 1e9, now;
    int i, round, m = n + 2;
    for (i = 0; i < m; i++) q[i] = i < n ? (i % TERMS == 0 ? 0.3 : 0) : 1;
    squares(q, n, left_out, gradient, matrix);
    for (i = 0; i < m; i++) size[i] = ridge * (matrix[i][i] + 1e-12); /* a term that hardly shows may be large: ridge on
                                                                         its effect */
    for (round = 0; round < 60; round++) {
        double penalty = 0;
        now = squares(q, n, left_out, gradient, matrix);
        for (i = 0; i < n; i++) penalty += size[i] * q[i] * q[i];
        best = now + penalty;
        do {
            double next[MOST], after, more = 0;
            memcpy(trial, matrix, sizeof trial);
            for (i = 0; i < m; i++) {
                step[i] = -(gradient[i] + (i < n ? size[i] * q[i] : 0));
                trial[i][i] += (i < n ? size[i] : 0) + damping * (matrix[i][i] + 1e-9);
            }
            if (!solve(trial, step, m)) { damping *= 10; continue; }
            for (i = 0; i < m; i++) next[i] = q[i] + step[i];
            after = squares(next, n, left_out, NULL, NULL);
            for (i = 0; i < n; i++) more += size[i] * next[i] * next[i];
            if (after + more < best) {
                memcpy(q, next, sizeof next);
                damping *= 0.3;
                if (best - after - more < 1e-7 * best) return after;
                break;
            }
            damping *= 10;
        } while (damping < 1e6);
        if (!(damping < 1e6)) break;
    }
    return best;
}

static double error_on(const double *q, int n, int scene)
{
    double sum = 0;
    size_t k;
    for (k = 0; k < data[scene].n; k++) {
        double e = model(q, n, &data[scene].s[k], NULL) - (double)data[scene].s[k].truth;
        sum += e * e;
    }
    return sqrt(sum / (double)(data[scene].n + !data[scene].n));
}

static double error_of_header(int scene)
{
    double sum = 0;
    size_t k;
    for (k = 0; k < data[scene].n; k++) {
        double e = (double)data[scene].s[k].header - (double)data[scene].s[k].truth;
        sum += e * e;
    }
    return sqrt(sum / (double)(data[scene].n + !data[scene].n));
}

static void print_kernel(const double *q)
{
    int r, i;
    printf("    {{");
    for (r = 0; r < 4; r++) {
        printf("%s{", r ? r < rings ? ",\n      " : ", " : "");
        if (r >= rings) printf("0");
        for (i = 0; i < TERMS && r < rings; i++) printf("%s%.4ff", i ? ", " : "", q[r * TERMS + i]);
        printf("}");
    }
    printf("}, %.3ff, %.3ff},\n", q[rings * TERMS], q[rings * TERMS + 1]);
}

int main(int count, char **arguments)
{
    int side = count > 1 ? atoi(arguments[1]) : 512, rays = count > 2 ? atoi(arguments[2]) : 256,
        every = count > 3 ? atoi(arguments[3]) : 17, scene, left;
    double ridge = count > 4 ? atof(arguments[4]) : 1e-4, q[MOST];
    int first = count > 5 ? atoi(arguments[5]) : 1, last = count > 5 ? first : 4;
    ref_picture pictures[REF_SCENES];
    bias = count > 6 ? (float)atof(arguments[6]) : ssao_sat__fits[0].bias;
    for (scene = 0; scene < REF_SCENES; scene++) pictures[scene] = ref_draw_kept(scene, side, rays);
    for (rings = first; rings <= last; rings++) {
        for (scene = 0; scene < REF_SCENES; scene++) {
            data[scene].n = 0;
            add_picture(&data[scene], &pictures[scene], every);
        }
        printf("/* %d rings; estimated pixels, RMSE by scene; left out: fitted to the other two:", rings);
        for (left = 0; left < FITTED; left++) {
            fit(q, rings * TERMS, left, ridge);
            printf(" %.4f", error_on(q, rings * TERMS, left));
        }
        fit(q, rings * TERMS, -1, ridge);
        printf("; fitted to all three:");
        for (scene = 0; scene < REF_SCENES; scene++)
            printf("%s %.4f", scene == FITTED ? "; nothing fitted:" : "", error_on(q, rings * TERMS, scene));
        printf("; the header as it is:");
        for (scene = 0; scene < REF_SCENES; scene++) printf(" %.4f", error_of_header(scene));
        printf(" */\n");
        print_kernel(q);
        fflush(stdout);
    }
    for (scene = 0; scene < REF_SCENES; scene++) { ref_free(&pictures[scene]); free(data[scene].s); }
    return 0;
}
