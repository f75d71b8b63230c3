/* Fits the kernel of SSAO_SAT_SLABS, polynomials in sine and distance for each ring, to ray-traced pixels and prints it
   as C, beside the error of the kernel that ssao_sat.h has.

   Build as a bench; arguments: side of the pictures, rays a pixel, one of how many pixels (512 256 17), and for trials
   the number of rings (0: 1 to 4), the weights of motion, crease and thin things, and the ridge (4 3 3 1e-3). Scenes 0
   to 2 and the yard are fitted, 0 to 2 also left out once each; table, grass and hall are only measured.

   The model: accessibility = (1 - x)^3, x = face(n.v) fade sum over rings, cells and slabs of
   coverage (1 - d^2 / range^2) sum c[ring][i][j] s^(i + 1) d^j, s the sine over the tangent plane less the bias, d the
   distance in radii. Least squares by Levenberg and Marquardt of four sums:
   - (model - truth)^2, scenes weighing the same, the yard (posts, wires, leaves) more;
   - (model - model)^2 of the same pixel in two frames of a gliding camera: what moves is not wanted;
   - of a crease between two walls, each pixel near the border of the picture against the one in the middle, and against
     its neighbour, beyond 0.01 and 0.003: it cannot depend on where the picture ends;
   - a ridge on the effect that each coefficient has. */
#define SAT_IMPLEMENTATION
#define SSAO_SAT_IMPLEMENTATION
#include "ssao_sat.h"
#include "bench.h"
#include "mesh.h"
#include "reference_ssao.h"

enum { SINES = 3, DISTANCES = 4, TERMS = SINES * DISTANCES, MOST = 4 * TERMS + 2, CREASE = 256 };
enum { MOVED, CENTRE, NEXT, PAIRS };

typedef struct sample { float truth, header, fade, facing, x[4][TERMS]; } sample;
typedef struct samples { sample *s; size_t n, room; } samples; /* pairs: two in a row */

static samples data[REF_ALL_SCENES], pairs[REF_ALL_SCENES][PAIRS]; /* the crease's are those of scene 0 */
static const double dead[PAIRS] = {0, 0.01, 0.003}; /* differences that do not count */
static double weights[PAIRS] = {4, 3, 3}, thin = 3, ridge = 1e-3;
static int rings;

static int is_fitted(int scene) { return scene < 3 || scene == REF_YARD; }
static double weight_of(int scene) { return scene == REF_YARD ? thin : 1; }

/* What the slab holds in cell (i, j), added to the terms of the ring. */
static void add_cell(float *x, const ssao_sat *s, const ssao_sat__point *p, const ssao_sat__cells *c, int i, int j)
{
    const uint32_t *table = s->table + 4 * (size_t)c->slab * s->table_plane;
    const ssao_sat__rect box = {c->column.border[i], c->row.border[j], c->column.border[i + 1], c->row.border[j + 1]};
    const size_t at = ssao_sat__at(s, p->y) + (size_t)p->x;
    float word[4], d[3], own[3], scale = s->camera.orthographic ? 1 : p->z, mean, z, square, sine, distance, share,
                                 power;
    int t, a, b;
    for (t = 0; t < 4; t++) word[t] = (float)(int32_t)ssao_sat__box(s, table + t, 4, box);
    if (!(word[0] > 0)) return;
    mean = (s->slabs[c->slab].low * word[0] + s->slabs[c->slab].quantum * word[1]) / word[0];
    z = s->camera.orthographic ? mean : 1 / mean;
    own[0] = (s->camera.ax * (float)p->x + s->camera.bx) * scale;
    own[1] = (s->camera.ay * (float)p->y + s->camera.by) * scale;
    d[0] = ((float)s->camera.full[0] * word[2] / word[0] + s->camera.bx) * (s->camera.orthographic ? 1 : z) - own[0];
    d[1] = ((float)s->camera.full[2] * word[3] / word[0] + s->camera.by) * (s->camera.orthographic ? 1 : z) - own[1];
    d[2] = z - p->z;
    square = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    share = 1 - square / (s->range * s->range);
    distance = sqrtf(square) / s->radius;
    sine = d[0] * s->work.nx[at] + d[1] * s->work.ny[at] + d[2] * s->work.nz[at];
    sine = sine / sqrtf(square + 1e-30f) - s->fit.bias;
    if (!(share > 0) || !(sine > 0)) return;
    share *= word[0] * (c->column.weight[i] * c->row.weight[j]) * sine;
    for (a = 0; a < SINES; a++, share *= sine)
        for (b = 0, power = share; b < DISTANCES; b++, power *= distance) x[a * DISTANCES + b] += power;
}

static sample *append(samples *to, const sample *s)
{
    if (to->n == to->room) {
        to->room = 2 * to->room + 1024;
        to->s = (sample *)realloc(to->s, to->room * sizeof *to->s);
        if (!to->s) exit(1);
    }
    to->s[to->n] = *s;
    return &to->s[to->n++];
}

/* What the estimate of a pixel is made of; 0 on sky. Regions that are flat or tiny are 1 whatever the kernel. */
static int read_pixel(sample *o, const ssao_sat *s, int x, int y)
{
    size_t at = ssao_sat__at(s, y) + (size_t)x;
    ssao_sat__point p;
    ssao_sat__cells c;
    float r, rx = s->camera.ax * (float)x + s->camera.bx, ry = s->camera.ay * (float)y + s->camera.by;
    int cut, ring, i;
    memset(o, 0, sizeof *o);
    if (!(s->work.z[at] > 0)) return 0;
    r = ssao_sat__half_side(s, s->work.z[at], &cut);
    o->header = s->work.open[at];
    o->fade = ssao_sat__is_flat(s, x, y, r) ? 0 : ssao_sat__fade(s, r);
    if (!(o->fade > 0)) return 1;
    ssao_sat__set_point(&p, s, x, y, at);
    o->facing = ref_clamp(s->camera.orthographic ? -p.facing : -p.facing / sqrtf(1 + rx * rx + ry * ry), 0, 1);
    for (ring = 0; ring < rings; ring++, r *= 1 / 3.0f) {
        const ssao_sat__ring size = ssao_sat__ring_of(r);
        ssao_sat__cut_axis(&c.column, x, size, s->columns, s->step, s->width);
        ssao_sat__cut_axis(&c.row, y, size, s->rows, s->step, s->height);
        for (c.slab = 0; c.slab < s->frame_slabs; c.slab++)
            for (i = 0; i < 9; i++)
                if (i != 4) add_cell(o->x[ring], s, &p, &c, i % 3, i / 3);
    }
    return 1;
}

static ssao_sat *run(const ssao_sat_input *in, double radius, int half)
{
    float *out = (float *)malloc((size_t)in->width * (size_t)in->height * 4);
    ssao_sat_options o = ssao_sat_defaults();
    ssao_sat *ao;
    o.radius = radius;
    o.scales = rings;
    o.half_resolution = half;
    if (!out || ssao_sat_create(&ao, in->width, in->height, &o) != SAT_OK ||
        ssao_sat_apply(ao, out, 0, in, NULL) != SAT_OK)
        exit(1);
    free(out);
    return ao;
}

static ssao_sat *run_picture(const ref_picture *p, int r)
{
    ssao_sat_input in = ssao_sat_input_linear(p->z, p->width, p->height, p->fov);
    in.normals = p->normals;
    return run(&in, (double)p->radius[r], 1);
}

/* The sampled pixels, and these beside the same pixels of the next frame where depth hardly changes. */
static void add_picture(int scene, const ref_picture *p, const ref_picture *next, int every)
{
    int r, i;
    for (r = 0; r < REF_RADII; r++) {
        ssao_sat *a = run_picture(p, r), *b = run_picture(next, r);
        for (i = 0; i < a->columns * a->rows; i++) {
            int x = i % a->columns, y = i / a->columns;
            size_t at = (size_t)(y * a->step) * (size_t)p->width + (size_t)(x * a->step);
            sample s, t;
            if (!ref_is_sampled(x * a->step, y * a->step, every) || !read_pixel(&s, a, x, y)) continue;
            append(&data[scene], &s)->truth = p->ao[r][at];
            if (!(fabsf(p->z[at] - next->z[at]) < 0.005f * p->z[at]) || !read_pixel(&t, b, x, y)) continue;
            append(&pairs[scene][MOVED], &s);
            append(&pairs[scene][MOVED], &t);
        }
        ssao_sat_destroy(a);
        ssao_sat_destroy(b);
    }
}

/* Rows of a crease z = 4 - |x|, or columns of one along x, from the border to where the region is whole. */
static void add_crease(int turned, int half, double radius)
{
    enum { N = CREASE };
    static float z[N * N], n[3 * N * N];
    ssao_sat_input in;
    ssao_sat *s;
    int i, k, x, rows, step;
    memset(&in, 0, sizeof in);
    in.depth = z;
    in.normals = n;
    in.width = in.height = N;
    in.projection[0] = in.projection[5] = in.projection[15] = 1;
    in.projection[10] = -0.1f;
    for (i = 0; i < N * N; i++) {
        float u = ((float)(turned ? i / N : i % N) + 0.5f - N / 2) * (2.0f / N);
        z[i] = 4 - fabsf(u);
        n[3 * i] = turned ? 0 : u < 0 ? 0.70710678f : -0.70710678f;
        n[3 * i + 1] = turned ? u < 0 ? -0.70710678f : 0.70710678f : 0;
        n[3 * i + 2] = 0.70710678f;
    }
    s = run(&in, radius, half);
    step = s->columns / 64;
    rows = sat__min_int((int)(radius * (double)s->fit.reach * s->columns / 2) + 3, s->columns / 2);
    for (x = 10 / s->step; x < s->columns / 2; x += step * (x < s->columns / 2 - 12 * step ? 5 : 1)) {
        sample centre, last, now;
        read_pixel(&centre, s, turned ? s->columns / 2 : x, turned ? x : s->columns / 2);
        for (k = 0; k < rows; k++, last = now) {
            read_pixel(&now, s, turned ? k : x, turned ? x : k);
            append(&pairs[0][CENTRE], &now);
            append(&pairs[0][CENTRE], &centre);
            if (k == 0) continue;
            append(&pairs[0][NEXT], &now);
            append(&pairs[0][NEXT], &last);
        }
    }
    ssao_sat_destroy(s);
}

static void read_all(const ref_picture *pictures, const ref_picture *moved, int every)
{
    static const double radii[4] = {0.1, 0.25, 0.5, 1};
    int scene, i;
    for (scene = 0; scene < REF_ALL_SCENES; scene++) {
        data[scene].n = 0;
        for (i = 0; i < PAIRS; i++) pairs[scene][i].n = 0;
    }
    for (scene = 0; scene < REF_ALL_SCENES; scene++) add_picture(scene, &pictures[scene], &moved[scene], every);
    for (i = 0; i < 16; i++) add_crease(i / 8, i / 4 % 2, radii[i % 4]);
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

typedef struct sums { double total, gradient[MOST], matrix[MOST][MOST]; } sums;

static void add_square(sums *to, double w, double e, const double *slope, int m)
{
    int i, j;
    to->total += w * e * e;
    for (i = 0; i < m && slope; i++) {
        double v = w * slope[i];
        to->gradient[i] += v * e;
        for (j = 0; j <= i; j++) to->matrix[i][j] += v * slope[j];
    }
}

/* Differences of pairs beyond what does not count. */
static void add_pairs(sums *to, double w, double ignored, const samples *of, const double *q, int n, int sloping)
{
    double a[MOST], b[MOST];
    size_t k;
    int i;
    for (k = 0; k + 1 < of->n; k += 2) {
        double e = model(q, n, &of->s[k], sloping ? a : NULL) - model(q, n, &of->s[k + 1], sloping ? b : NULL);
        if (fabs(e) <= ignored) continue;
        for (i = 0; i < n + 2 && sloping; i++) a[i] -= b[i];
        add_square(to, 2 * w / (double)of->n, e > 0 ? e - ignored : e + ignored, sloping ? a : NULL, n + 2);
    }
}

/* Sum of squares over the fitted scenes but one; gradient and Gauss-Newton matrix when wanted. */
static double squares(sums *to, const double *q, int n, int left_out, int sloping)
{
    double slope[MOST], scenes = 0;
    int scene, i;
    size_t k;
    memset(to, 0, sizeof *to);
    for (scene = 0; scene < REF_ALL_SCENES; scene++) {
        if (scene == left_out || !is_fitted(scene)) continue;
        scenes++;
        for (k = 0; k < data[scene].n; k++) {
            double e = model(q, n, &data[scene].s[k], sloping ? slope : NULL) - (double)data[scene].s[k].truth;
            add_square(to, weight_of(scene) / (double)data[scene].n, e, sloping ? slope : NULL, n + 2);
        }
        add_pairs(to, weights[MOVED], dead[MOVED], &pairs[scene][MOVED], q, n, sloping);
    }
    for (i = CENTRE; i < PAIRS; i++) add_pairs(to, scenes * weights[i], dead[i], &pairs[0][i], q, n, sloping);
    return to->total;
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

static void fit(double *q, int n, int left_out)
{
    static sums now, other;
    static double trial[MOST][MOST];
    double step[MOST], size[MOST], damping = 1e-3;
    int i, round, m = n + 2;
    for (i = 0; i < m; i++) q[i] = i < n ? (i % TERMS == 0 ? 0.3 / (1 + i / TERMS) : 0) : 1;
    squares(&now, q, n, left_out, 1);
    for (i = 0; i < m; i++) size[i] = i < n ? ridge * (now.matrix[i][i] + 1e-12) : 0;
    for (round = 0; round < 30; round++) {
        double before = squares(&now, q, n, left_out, 1), after = before;
        for (i = 0; i < n; i++) before += size[i] * q[i] * q[i];
        for (; damping < 1e6; damping *= 10) {
            double next[MOST];
            memcpy(trial, now.matrix, sizeof trial);
            for (i = 0; i < m; i++) {
                step[i] = -(now.gradient[i] + size[i] * q[i]);
                trial[i][i] += size[i] + damping * (now.matrix[i][i] + 1e-9);
            }
            if (!solve(trial, step, m)) continue;
            for (i = 0; i < m; i++) next[i] = q[i] + step[i];
            after = squares(&other, next, n, left_out, 0);
            for (i = 0; i < n; i++) after += size[i] * next[i] * next[i];
            if (!(after < before)) continue;
            memcpy(q, next, sizeof next);
            damping *= 0.3;
            break;
        }
        if (!(damping < 1e6) || before - after < 1e-5 * before) return;
    }
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

/* Mean change from frame to frame, and the crease's largest difference from its centre and from pixel to pixel. */
static void print_pairs(const double *q, int n)
{
    double most[PAIRS] = {0, 0, 0}, sum = 0;
    size_t k, count = 0;
    int scene, i;
    for (scene = 0; scene < REF_ALL_SCENES; scene++)
        for (i = 0; i < PAIRS; i++)
            for (k = 0; k + 1 < pairs[scene][i].n; k += 2) {
                const sample *s = &pairs[scene][i].s[k];
                double e = fabs(model(q, n, s, NULL) - model(q, n, s + 1, NULL));
                most[i] = support_larger(most[i], e);
                if (i != MOVED) continue;
                sum += e;
                count++;
            }
    printf("; motion %.5f, crease %.4f %.4f", sum / (double)count, most[CENTRE], most[NEXT]);
}

int main(int count, char **arguments)
{
    int side = count > 1 ? atoi(arguments[1]) : 512, rays = count > 2 ? atoi(arguments[2]) : 256,
        every = count > 3 ? atoi(arguments[3]) : 17, only = count > 4 ? atoi(arguments[4]) : 0, scene, left;
    static ref_picture pictures[REF_ALL_SCENES], moved[REF_ALL_SCENES];
    double q[MOST];
    if (count > 5) weights[MOVED] = atof(arguments[5]);
    if (count > 6) weights[CENTRE] = weights[NEXT] = atof(arguments[6]);
    if (count > 7) thin = atof(arguments[7]);
    if (count > 8) ridge = atof(arguments[8]);
    for (scene = 0; scene < REF_ALL_SCENES; scene++) {
        ref_scene s;
        ref_open(&s, scene);
        pictures[scene] = ref_draw_some(&s, side, side, 0, rays, ref_make(0, 0, 0), 2, 0.25f, every);
        moved[scene] = ref_draw(&s, side, side, 0, 0, ref_make(0.0015f, 0.0007f, 0), 2);
        ref_close(&s);
    }
    for (rings = only ? only : 1; rings <= (only ? only : 4); rings++) {
        int n = rings * TERMS;
        read_all(pictures, moved, every);
        printf("/* %d rings: pixels of the tables, RMSE by scene (corner, room, field, table, grass, hall, yard): as the "
               "header is:", rings);
        for (scene = 0; scene < REF_ALL_SCENES; scene++) printf(" %.4f", error_of_header(scene));
        for (left = 0; left < 3 && rings == 3; left++) {
            fit(q, n, left);
            printf("%s %.4f", left ? "" : "; 0 to 2 left out of the fit:", error_on(q, n, left));
        }
        fit(q, n, -1);
        printf("; fitted to 0 to 2 and 6:");
        for (scene = 0; scene < REF_ALL_SCENES; scene++) printf(" %.4f", error_on(q, n, scene));
        print_pairs(q, n);
        printf(" */\n");
        print_kernel(q);
        fflush(stdout);
    }
    for (scene = 0; scene < REF_ALL_SCENES; scene++) {
        ref_free(&pictures[scene]);
        ref_free(&moved[scene]);
        free(data[scene].s);
        for (left = 0; left < PAIRS; left++) free(pairs[scene][left].s);
    }
    return 0;
}
