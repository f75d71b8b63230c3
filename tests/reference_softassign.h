/* reference_softassign.h - exact assignments and plain versions of the published methods.
   SPDX-License-Identifier: MIT-0 OR Unlicense

   Slow and simple on purpose. Long double costs; +INFINITY forbids a pair. */

#ifndef REFERENCE_SOFTASSIGN_H
#define REFERENCE_SOFTASSIGN_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const long double reference_forbidden = 1e60L;

/* Shortest augmenting paths with potentials, row by row, O(rows^2 columns): cost[i * columns + j], rows <= columns.
   Returns the optimum; column_of_row may be NULL. Above reference_forbidden: no assignment exists. */
static inline long double reference_assign(const long double *cost, int rows, int columns, int *column_of_row)
{
    size_t n = (size_t)columns + 1;
    long double *u = (long double *)calloc((size_t)rows + 1, sizeof *u), *v = (long double *)calloc(n, sizeof *v);
    long double *least = (long double *)calloc(n, sizeof *least), total = 0;
    int *row_of = (int *)calloc(n, sizeof *row_of), *way = (int *)calloc(n, sizeof *way), i, j;
    char *done = (char *)calloc(n, 1);
    for (i = 1; i <= rows; i++) {
        int at = 0;
        row_of[0] = i;
        for (j = 0; j <= columns; j++) {
            least[j] = 1e300L;
            done[j] = 0;
        }
        do {
            int row = row_of[at], next = 0;
            long double delta = 1e301L;
            done[at] = 1;
            for (j = 1; j <= columns; j++) {
                long double c;
                if (done[j]) continue;
                c = cost[(size_t)(row - 1) * (size_t)columns + (size_t)(j - 1)] - u[row] - v[j];
                if (c < least[j]) {
                    least[j] = c;
                    way[j] = at;
                }
                if (least[j] < delta) {
                    delta = least[j];
                    next = j;
                }
            }
            for (j = 0; j <= columns; j++)
                if (done[j]) {
                    u[row_of[j]] += delta;
                    v[j] -= delta;
                } else least[j] -= delta;
            at = next;
        } while (row_of[at] != 0);
        while (at != 0) {
            row_of[at] = row_of[way[at]];
            at = way[at];
        }
    }
    for (j = 1; j <= columns; j++)
        if (row_of[j] > 0) {
            total += cost[(size_t)(row_of[j] - 1) * (size_t)columns + (size_t)(j - 1)];
            if (column_of_row) column_of_row[row_of[j] - 1] = j - 1;
        }
    free(u);
    free(v);
    free(least);
    free(row_of);
    free(way);
    free(done);
    return total;
}

/* The optimum with capacities (NULL: 1) and minimum uses (NULL: 0): every unit becomes a column of its own, and the
   mandatory ones get cheaper by more than any assignment can save. */
static inline long double reference_optimum(const float *cost, int rows, int columns, const int *capacity,
                                            const int *minimum_use)
{
    int units = 0, i, j, k;
    long double *wide, largest = 0, bonus, total, mandatory = 0;
    for (j = 0; j < columns; j++) units += capacity ? capacity[j] : 1;
    if (units < rows) return 1e300L;
    wide = (long double *)malloc((size_t)rows * (size_t)units * sizeof *wide);
    for (i = 0; i < rows * columns; i++)
        if (cost[i] < HUGE_VALF && fabsl((long double)cost[i]) > largest) largest = fabsl((long double)cost[i]);
    bonus = 4 * (largest + 1) * (rows + 1);
    for (i = 0; i < rows; i++) {
        int at = 0;
        for (j = 0; j < columns; j++)
            for (k = 0; k < (capacity ? capacity[j] : 1); k++, at++) {
                float c = cost[(size_t)i * (size_t)columns + (size_t)j];
                wide[(size_t)i * (size_t)units + (size_t)at] = c < HUGE_VALF ? (long double)c : 1e80L;
                if (minimum_use && k < minimum_use[j]) wide[(size_t)i * (size_t)units + (size_t)at] -= bonus;
            }
    }
    for (j = 0; minimum_use && j < columns; j++) mandatory += minimum_use[j];
    total = reference_assign(wide, rows, units, NULL) + mandatory * bonus;
    free(wide);
    return total;
}

/* Eq 3.1 in long double. */
static inline long double reference_distance(const float *a, const float *b, int n)
{
    long double sum = 0;
    int k;
    for (k = 0; k < n; k++) sum += ((long double)a[k] - b[k]) * ((long double)a[k] - b[k]);
    return sqrtl(sum);
}

/* The matrix of eq 3.6 rounded to float. */
static inline float *reference_matrix(const float *rows_f, const float *columns_f, int rows, int columns, int n)
{
    float *cost = (float *)malloc((size_t)rows * (size_t)columns * sizeof *cost);
    int i, j;
    for (i = 0; i < rows; i++)
        for (j = 0; j < columns; j++)
            cost[(size_t)i * (size_t)columns + (size_t)j] =
                (float)reference_distance(rows_f + (size_t)i * (size_t)n, columns_f + (size_t)j * (size_t)n, n);
    return cost;
}

/* Section 3.4.2: best matches; then, in row order, rows of a tile that serves several take the best unused tile until
   the tile serves one. */
static inline void reference_greedy(const float *cost, int rows, int columns, int *x)
{
    int *uses = (int *)calloc((size_t)columns, sizeof *uses), i, j;
    for (i = 0; i < rows; i++) {
        const float *c = cost + (size_t)i * (size_t)columns;
        x[i] = 0;
        for (j = 1; j < columns; j++)
            if (c[j] < c[x[i]]) x[i] = j;
        uses[x[i]]++;
    }
    for (i = 0; i < rows; i++) {
        const float *c = cost + (size_t)i * (size_t)columns;
        int best = -1;
        if (uses[x[i]] < 2) continue;
        for (j = 0; j < columns; j++)
            if (uses[j] == 0 && (best < 0 || c[j] < c[best])) best = j;
        uses[x[i]]--;
        uses[best]++;
        x[i] = best;
    }
    free(uses);
}

/* Section 3.6 in double, statement by statement, from the given M; returns the lowest cost, S in soft.
   gold: the update of Gold et al. instead, exp(-(D - alpha) / t). */
static inline double reference_published(const float *cost, int rows, int columns, double *m, double *soft, double t,
                                         double cooling, double alpha, double outlier, const int *iterations,
                                         double clamp, int gold)
{
    size_t n = (size_t)columns, k;
    double lowest = HUGE_VAL, largest = 0, *q = (double *)malloc((size_t)rows * n * sizeof *q);
    int a, b, c, i, j;
    for (k = 0; k < (size_t)rows * n; k++)
        if (fabs((double)cost[k]) > largest) largest = fabs((double)cost[k]);
    for (a = 0; a < iterations[0]; a++, t *= cooling) {
        double sum = 0;
        for (b = 0; b < iterations[1]; b++) {
            for (k = 0; k < (size_t)rows * n; k++) {
                double e;
                q[k] = m[k] * ((double)cost[k] / largest - alpha);
                e = -(gold ? (double)cost[k] / largest - alpha : q[k]) / t;
                m[k] = exp(e < -clamp ? -clamp : e > clamp ? clamp : e) / sqrt(t);
            }
            for (c = 0; c < iterations[2]; c++) {
                for (j = 0; j < columns; j++) {
                    double s = outlier;
                    for (i = 0; i < rows; i++) s += m[(size_t)i * n + (size_t)j];
                    for (i = 0; i < rows; i++) m[(size_t)i * n + (size_t)j] /= s;
                }
                for (i = 0; i < rows; i++) {
                    double s = 0;
                    for (j = 0; j < columns; j++) s += m[(size_t)i * n + (size_t)j];
                    for (j = 0; j < columns; j++) m[(size_t)i * n + (size_t)j] /= s;
                }
            }
        }
        for (k = 0; k < (size_t)rows * n; k++) sum += q[k];
        if (sum < lowest) {
            lowest = sum;
            memcpy(soft, m, (size_t)rows * n * sizeof *m);
        }
    }
    free(q);
    return lowest;
}

/* The first two steps of Jonker and Volgenant (Computing 38, 1987) for a square matrix: column reduction, where each
   column in turn from the last pays down to its least cost and its row takes it unless it has one, and reduction
   transfer, where a row that was the least of just one column pays down to its second least. Leaves the unassigned
   rows. */
static inline int reference_reduce_columns(const float *cost, int n, int *x, int *y, double *v, int *times,
                                           int *unassigned)
{
    int i, j, left = 0;
    for (j = 0; j < n; j++) {
        times[j] = y[j] = 0;
        v[j] = (double)cost[j];
    }
    for (i = 1; i < n; i++)
        for (j = 0; j < n; j++)
            if ((double)cost[(size_t)i * (size_t)n + (size_t)j] < v[j]) {
                v[j] = (double)cost[(size_t)i * (size_t)n + (size_t)j];
                y[j] = i;
            }
    for (j = n - 1; j >= 0; j--) {
        int least = y[j];
        y[j] = -1;
        if (++times[least] > 1) continue;
        x[least] = j;
        y[j] = least;
    }
    for (i = 0; i < n; i++) {
        const float *c = cost + (size_t)i * (size_t)n;
        double second = HUGE_VAL;
        if (times[i] == 0) unassigned[left++] = i;
        if (times[i] != 1) continue;
        for (j = 0; j < n; j++)
            if (j != x[i] && (double)c[j] - v[j] < second) second = (double)c[j] - v[j];
        if (n > 1) v[x[i]] -= second;
    }
    return left;
}

/* Jonker and Volgenant's dense solver, plain: column reduction where the matrix is square, two rounds of augmenting row
   reduction, then shortest augmenting paths, for the benchmark. Doubles; rows <= columns. Scratch: price, distance
   (columns doubles), the ints: 2 x columns + rows + columns. */
static inline void reference_lapjv(const float *cost, int rows, int columns, int *x, int *y, double *v, double *d,
                                   int *pred, int *list, int *unassigned)
{
    int i, j, k, round, count = rows;
    for (j = 0; j < columns; j++) {
        v[j] = 0;
        y[j] = -1;
    }
    for (i = 0; i < rows; i++) {
        x[i] = -1;
        unassigned[i] = i;
    }
    if (rows == columns) count = reference_reduce_columns(cost, rows, x, y, v, pred, unassigned);
    for (round = 0; round < 2; round++) {
        int next = 0, left = 0, end = count, budget = 8 * count + 64;
        while (next < end) {
            int row = unassigned[next++], j1 = -1, j2 = -1, out;
            const float *c = cost + (size_t)row * (size_t)columns;
            double m1 = HUGE_VAL, m2 = HUGE_VAL;
            for (j = 0; j < columns; j++) {
                double h = (double)c[j] - v[j];
                if (h < m2) {
                    if (h < m1) {
                        m2 = m1;
                        j2 = j1;
                        m1 = h;
                        j1 = j;
                    } else {
                        m2 = h;
                        j2 = j;
                    }
                }
            }
            out = y[j1];
            if (m1 < m2 && j2 >= 0) v[j1] -= m2 - m1;
            else if (out >= 0 && j2 >= 0) {
                j1 = j2;
                out = y[j1];
            }
            x[row] = j1;
            y[j1] = row;
            if (out < 0) continue;
            x[out] = -1;
            if (m1 < m2 && budget-- > 0) unassigned[--next] = out;
            else unassigned[left++] = out;
        }
        count = left;
    }
    for (k = 0; k < count; k++) {
        int root = unassigned[k], low = 0, up = 0, last = 0, end = -1, at;
        const float *c = cost + (size_t)root * (size_t)columns;
        double least = 0;
        for (j = 0; j < columns; j++) {
            d[j] = (double)c[j] - v[j];
            pred[j] = root;
            list[j] = j;
        }
        while (end < 0) {
            if (low == up) {
                last = low;
                least = d[list[up++]];
                for (at = up; at < columns; at++) {
                    j = list[at];
                    if (d[j] > least) continue;
                    if (d[j] < least) {
                        up = low;
                        least = d[j];
                    }
                    list[at] = list[up];
                    list[up++] = j;
                }
                for (at = low; at < up; at++)
                    if (y[list[at]] < 0) {
                        end = list[at];
                        break;
                    }
            }
            if (end < 0) {
                int from = list[low++], row = y[from];
                const float *r = cost + (size_t)row * (size_t)columns;
                double h = (double)r[from] - v[from] - least;
                for (at = up; at < columns; at++) {
                    double w;
                    j = list[at];
                    w = (double)r[j] - v[j] - h;
                    if (!(w < d[j])) continue;
                    pred[j] = row;
                    d[j] = w;
                    if (w > least) continue;
                    if (y[j] < 0) {
                        end = j;
                        break;
                    }
                    list[at] = list[up];
                    list[up++] = j;
                }
            }
        }
        for (at = 0; at < last; at++) v[list[at]] += d[list[at]] - least;
        for (j = end;;) {
            int next;
            i = pred[j];
            y[j] = i;
            next = x[i];
            x[i] = j;
            if (i == root) break;
            j = next;
        }
    }
}

#endif /* REFERENCE_SOFTASSIGN_H */
