/* Fuzzing softassign.h: any sizes, costs, capacities, options, and budgets. Build: clang
   -fsanitize=fuzzer,address,undefined. */
#define SAT_IMPLEMENTATION
#include "sat.h"
#define SOFTASSIGN_IMPLEMENTATION
#include "softassign.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROWS = 24, COLUMNS = 40, FEATURES = 20 };

typedef struct input {
    const unsigned char *bytes;
    size_t size;
} input;

static uint32_t take(input *in, uint32_t below)
{
    uint32_t v = 0;
    size_t n = in->size < 4 ? in->size : 4;
    memcpy(&v, in->bytes, n);
    in->bytes += n;
    in->size -= n;
    return below ? v % below : v;
}

static float take_float(input *in)
{
    uint32_t bits = take(in, 0);
    float v;
    memcpy(&v, &bits, sizeof v);
    return v;
}

/* Mostly tame values, so that the solvers get to work; now and then any bits at all. */
static float take_cost(input *in)
{
    uint32_t kind = take(in, 64);
    if (kind == 0) return take_float(in);
    if (kind < 4) return (float)HUGE_VAL;
    return kind < 32 ? (float)take(in, 8) : (float)take(in, 100000) * 0.01f;
}

/* What must hold of every answer. */
static void check(const int *x, const softassign_problem *p, const softassign_options *o, const softassign_stats *r)
{
    int used[COLUMNS] = {0}, i;
    for (i = 0; i < p->rows; i++) {
        if (x[i] < 0 || x[i] >= p->columns) abort();
        if (++used[x[i]] > (p->capacity ? p->capacity[x[i]] : o->capacity_default)) abort();
    }
    for (i = 0; p->minimum_use && o->min_distance <= 0 && i < p->columns; i++)
        if (used[i] < p->minimum_use[i] && o->method <= SOFTASSIGN_FAST) abort();
    if (!(r->lower_bound <= r->cost) || r->gap < 0) {
        fprintf(stderr, "method %d: cost %.17g, bound %.17g, gap %g\n", (int)r->method, r->cost, r->lower_bound,
                r->gap);
        abort();
    }
}

static void walk(const softassign_problem *p, const softassign_options *o, input *in)
{
    softassign *s = NULL;
    softassign_stats r;
    int x[ROWS], steps;
    if (softassign_create(&s, p->rows, p->columns, o) != SAT_OK) return;
    for (steps = 0; steps < 30; steps++) {
        if (softassign_step(s, x, p, take(in, 40), &r) == SAT_OK) check(x, p, o, &r);
        if (take(in, 5) == 0) softassign_next_frame(s);
    }
    softassign_destroy(s);
}

int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size)
{
    static float cost[ROWS * COLUMNS], rows[ROWS * FEATURES], columns[COLUMNS * FEATURES];
    input in;
    softassign_problem p;
    softassign_options o;
    softassign_stats r;
    int x[ROWS], capacity[COLUMNS], least[COLUMNS], previous[ROWS], i;
    in.bytes = bytes;
    in.size = size;
    o = softassign_method_defaults((softassign_method)take(&in, 9));
    memset(&p, 0, sizeof p);
    p.rows = (int)take(&in, ROWS + 1);
    p.columns = (int)take(&in, COLUMNS + 1);
    if (take(&in, 2)) {
        p.cost = cost;
        p.stride = take(&in, 8) ? COLUMNS : (ptrdiff_t)(int32_t)take(&in, 0) % COLUMNS;
        if (p.stride < 0) p.cost = cost + (ROWS - 1) * COLUMNS;
    } else {
        p.row_features = rows;
        p.column_features = columns;
        p.feature_count = (int)take(&in, FEATURES + 1);
    }
    o.gap = take(&in, 4) ? 0.01 : (double)take_float(&in);
    o.capacity_default = (int)take(&in, 4);
    o.neighbours = (int)take(&in, 260);
    o.certify = (int)take(&in, 2);
    o.temperature = take(&in, 4) ? 0.1 : (double)take_float(&in);
    o.cooling = take(&in, 4) ? 0.5 : (double)take_float(&in);
    o.alpha = take(&in, 4) ? 1 : (double)take_float(&in);
    o.outlier = take(&in, 4) ? 1 : (double)take_float(&in);
    o.double_precision = (int)take(&in, 2);
    o.outlier_evolves = (int)take(&in, 2);
    o.gather = (int)take(&in, 66);
    o.ants = (int)take(&in, 3);
    for (i = 0; i < 3; i++) o.iterations[i] = (int)take(&in, 5);
    o.switching = take(&in, 4) ? 0 : (double)take_float(&in);
    o.grid_width = (int)take(&in, 8);
    o.min_distance = take(&in, 3) ? 0 : (double)take(&in, 5);
    for (i = 0; i < COLUMNS; i++) {
        capacity[i] = (int)take(&in, 4);
        least[i] = (int)take(&in, 16) == 0;
    }
    for (i = 0; i < ROWS; i++) previous[i] = (int)take(&in, COLUMNS) - 1;
    if (take(&in, 2)) p.capacity = capacity;
    if (!take(&in, 4)) p.minimum_use = least;
    if (!take(&in, 3)) p.previous = previous;
    for (i = 0; i < ROWS * COLUMNS; i++) cost[i] = take_cost(&in);
    for (i = 0; i < ROWS * FEATURES; i++) rows[i] = take(&in, 200) ? (float)take(&in, 256) : take_float(&in);
    for (i = 0; i < COLUMNS * FEATURES; i++) columns[i] = take(&in, 200) ? (float)take(&in, 256) : take_float(&in);
    if (softassign_solve(x, &p, &o, &r) == SAT_OK) check(x, &p, &o, &r);
    walk(&p, &o, &in);
    return 0;
}
