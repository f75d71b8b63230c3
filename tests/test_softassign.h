/* Tests of softassign.h against exact assignments and plain versions of the published methods. */

#include "image.h"
#include "reference_softassign.h"
#include "support.h"

/* ---- problems ---- */

typedef struct problem {
    softassign_problem p;
    float *rows_f, *columns_f, *cost; /* cost: the matrix, always */
    double optimum;
} problem;

/* Patches of a few flat colours and tiles spread around them: many patches want the same tiles. */
static inline problem make_features(int rows, int columns, int n, uint64_t seed)
{
    problem q;
    int i, k;
    memset(&q, 0, sizeof q);
    q.rows_f = (float *)malloc((size_t)rows * (size_t)n * sizeof(float));
    q.columns_f = (float *)malloc((size_t)columns * (size_t)n * sizeof(float));
    for (i = 0; i < rows; i++) {
        double level = 60 * (double)(i * 4 / rows) + 20 * support_uniform(&seed);
        for (k = 0; k < n; k++) q.rows_f[i * n + k] = (float)(level + 10 * k % 7 + 4 * support_gaussian(&seed));
    }
    for (i = 0; i < columns; i++) {
        double level = 250 * support_uniform(&seed), slope = 3 * support_gaussian(&seed);
        for (k = 0; k < n; k++) q.columns_f[i * n + k] = (float)(level + slope * k + 20 * support_gaussian(&seed));
    }
    q.p.rows = rows;
    q.p.columns = columns;
    q.p.row_features = q.rows_f;
    q.p.column_features = q.columns_f;
    q.p.feature_count = n;
    q.cost = reference_matrix(q.rows_f, q.columns_f, rows, columns, n);
    q.optimum = (double)reference_optimum(q.cost, rows, columns, NULL, NULL);
    return q;
}

static inline problem make_dense(int rows, int columns, float (*cost)(int i, int j, uint64_t *seed), uint64_t seed)
{
    problem q;
    int i, j;
    memset(&q, 0, sizeof q);
    q.cost = (float *)malloc((size_t)rows * (size_t)columns * sizeof(float));
    for (i = 0; i < rows; i++)
        for (j = 0; j < columns; j++) q.cost[(size_t)i * (size_t)columns + (size_t)j] = cost(i, j, &seed);
    q.p.rows = rows;
    q.p.columns = columns;
    q.p.cost = q.cost;
    q.p.stride = columns;
    q.optimum = (double)reference_optimum(q.cost, rows, columns, NULL, NULL);
    return q;
}

static inline void free_problem(problem *q)
{
    free(q->rows_f);
    free(q->columns_f);
    free(q->cost);
}

static float cost_uniform(int i, int j, uint64_t *seed) { (void)i; (void)j; return (float)support_uniform(seed); }
static float cost_zero(int i, int j, uint64_t *seed) { (void)i; (void)j; (void)seed; return 0; }
static float cost_equal(int i, int j, uint64_t *seed) { (void)i; (void)j; (void)seed; return 3.25f; }
static float cost_repeated(int i, int j, uint64_t *seed)
{
    (void)seed;
    return (float)(((uint32_t)(i * 7 + j / 40) * 2654435761u >> 20) & 1023u);
}
static float cost_wide(int i, int j, uint64_t *seed)
{
    (void)i;
    (void)j;
    return (float)pow(10, -30 + 60 * support_uniform(seed));
}
static float cost_negative(int i, int j, uint64_t *seed)
{
    (void)i;
    (void)j;
    return (float)(-1e3 * support_uniform(seed));
}
static float cost_offset(int i, int j, uint64_t *seed) { (void)i; (void)j; return 1e6f + (float)support_uniform(seed); }
static float cost_product(int i, int j, uint64_t *seed) { (void)seed; return (float)(i + 1) * (float)(j + 1); }
static float cost_steps(int i, int j, uint64_t *seed) { (void)i; (void)j; return (float)support_below(seed, 4); }
static float cost_denormal(int i, int j, uint64_t *seed)
{
    (void)i;
    (void)j;
    return (float)(1e-40 * support_uniform(seed));
}

static float cost_forced(int i, int j, uint64_t *seed) /* row 3 can only choose huge costs */
{
    (void)j;
    return i == 3 ? 1e30f : (float)support_uniform(seed);
}

static int is_valid(const int *x, int rows, int columns, const int *capacity)
{
    int *used = (int *)calloc((size_t)columns, sizeof *used), i, ok = 1;
    for (i = 0; i < rows && ok; i++) {
        ok = x[i] >= 0 && x[i] < columns;
        if (ok) ok = ++used[x[i]] <= (capacity ? capacity[x[i]] : 1);
    }
    free(used);
    return ok;
}

static double cost_of(const problem *q, const int *x)
{
    long double sum = 0;
    int i;
    for (i = 0; i < q->p.rows; i++) sum += q->cost[(size_t)i * (size_t)q->p.columns + (size_t)x[i]];
    return (double)sum;
}

/* The optimum is met to the rounding of the costs. */
static double slack_of(double v) { return 1e-6 * fabs(v) + 1e-37; }

/* allowed: the largest excess over the optimum; 1e9 asks for none. */
static void check_solution(const problem *q, const int *x, const softassign_stats *r, double allowed)
{
    EXPECT(is_valid(x, q->p.rows, q->p.columns, q->p.capacity));
    EXPECT_NEAR(r->cost, cost_of(q, x), slack_of(r->cost));
    EXPECT(r->lower_bound <= q->optimum + slack_of(q->optimum));
    EXPECT(r->lower_bound <= r->cost);
    EXPECT(r->cost >= q->optimum - slack_of(q->optimum));
    if (allowed < 1e9) EXPECT(r->cost <= q->optimum + allowed * fabs(q->optimum) + slack_of(q->optimum));
    EXPECT(r->gap >= 0 && !expect_is_nan(r->gap));
    EXPECT_EQ(r->row_error, -1);
}

static const softassign_method all_methods[9] = {
    SOFTASSIGN_AUTO, SOFTASSIGN_EXACT, SOFTASSIGN_FAST, SOFTASSIGN_ENTROPIC, SOFTASSIGN_PUBLISHED,
    SOFTASSIGN_GREEDY, SOFTASSIGN_GREEDY_2OPT, SOFTASSIGN_ANNEALING, SOFTASSIGN_ANTS};

/* Shorter schedules than the defaults, for small problems. */
static inline softassign_options quick_options(softassign_method method)
{
    softassign_options o = softassign_method_defaults(method);
    if (method == SOFTASSIGN_PUBLISHED) o.iterations[0] = 12, o.iterations[1] = o.iterations[2] = 4;
    if (method == SOFTASSIGN_ANNEALING) o.iterations[0] = 40, o.iterations[1] = 50;
    if (method == SOFTASSIGN_ANTS) o.iterations[0] = 10, o.ants = 5;
    return o;
}

static void check_exact(problem *q)
{
    softassign_stats r;
    int *x = (int *)malloc((size_t)q->p.rows * sizeof *x), m;
    for (m = SOFTASSIGN_AUTO; m <= SOFTASSIGN_EXACT; m++) {
        softassign_options o = softassign_method_defaults((softassign_method)m);
        if (EXPECT_EQ(softassign_solve(x, &q->p, &o, &r), SAT_OK)) {
            check_solution(q, x, &r, 0);
            EXPECT(r.gap <= 1e-6);
            EXPECT_EQ(r.complete, 1);
        }
    }
    free(x);
}

/* ---- the answer ---- */

TEST(softassign_defaults_are_as_documented)
{
    softassign_options o = softassign_defaults();
    EXPECT_EQ(softassign_version(), SOFTASSIGN_VERSION);
    EXPECT_EQ(o.method, SOFTASSIGN_AUTO);
    EXPECT_NEAR(o.gap, 0.001, 0);
    EXPECT_EQ(o.capacity_default, 1);
    EXPECT_EQ(o.neighbours, 160);
    EXPECT_EQ(o.certify, 1);
    EXPECT_EQ(o.gather, 4);
    EXPECT_EQ(o.ants, 30);
    EXPECT_EQ(o.grid_width, 0);
    EXPECT(o.progress == NULL && o.soft == NULL);
    EXPECT_EQ(softassign_method_defaults(SOFTASSIGN_ANTS).method, SOFTASSIGN_ANTS);
}

TEST(softassign_exact_on_features)
{
    static const int sizes[][3] = {{1, 1, 3},     {1, 50, 3},   {7, 7, 1},      {40, 40, 12},
                                   {60, 200, 13}, {90, 90, 48}, {150, 700, 48}, {30, 2000, 5}};
    size_t k;
    for (k = 0; k < sizeof sizes / sizeof *sizes; k++) {
        problem q = make_features(sizes[k][0], sizes[k][1], sizes[k][2], 7 + k);
        check_exact(&q);
        free_problem(&q);
    }
}

TEST(softassign_exact_on_matrices)
{
    static float (*const costs[])(int, int, uint64_t *) = {cost_uniform, cost_zero,     cost_equal,  cost_repeated,
                                                           cost_wide,    cost_negative, cost_offset, cost_product,
                                                           cost_steps,   cost_denormal, cost_forced};
    size_t k;
    for (k = 0; k < sizeof costs / sizeof *costs; k++) {
        problem tall = make_dense(60, 60, costs[k], k), wide = make_dense(60, 400, costs[k], k + 50);
        check_exact(&tall);
        check_exact(&wide);
        free_problem(&tall);
        free_problem(&wide);
    }
}

TEST(softassign_small_problems_by_brute_force)
{
    static const int permutations[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
    uint64_t seed = 3;
    int turn, k, i, x[3];
    for (turn = 0; turn < 200; turn++) {
        problem q = make_dense(3, 3, turn % 2 ? cost_uniform : cost_steps, support_random(&seed));
        double best = HUGE_VAL;
        for (k = 0; k < 6; k++) {
            double sum = 0;
            for (i = 0; i < 3; i++) sum += (double)q.cost[i * 3 + permutations[k][i]];
            if (sum < best) best = sum;
        }
        EXPECT_NEAR(q.optimum, best, 1e-6); /* the reference itself */
        EXPECT_EQ(softassign_solve(x, &q.p, NULL, NULL), SAT_OK);
        EXPECT_NEAR(cost_of(&q, x), best, 1e-6);
        free_problem(&q);
    }
}

TEST(softassign_every_method_gives_a_valid_certified_assignment)
{
    problem q = make_features(80, 300, 12, 5), square = make_dense(50, 50, cost_uniform, 6);
    int x[80], k;
    for (k = 0; k < 9; k++) {
        softassign_options o = quick_options(all_methods[k]);
        softassign_stats r;
        /* PUBLISHED and ANTS are not cut short for quality here: only validity and the bound are asked of them */
        double allowed = k <= SOFTASSIGN_EXACT ? 0 : k == SOFTASSIGN_FAST ? 0.001 : k == SOFTASSIGN_PUBLISHED ? 3 : 0.6;
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        check_solution(&q, x, &r, allowed);
        EXPECT_EQ(r.method, k == SOFTASSIGN_EXACT ? SOFTASSIGN_EXACT : all_methods[k]);
        EXPECT(r.bytes > 0);
        EXPECT_EQ(softassign_solve(x, &square.p, &o, &r), SAT_OK);
        check_solution(&square, x, &r, k == SOFTASSIGN_FAST ? 0.001 : k == SOFTASSIGN_PUBLISHED ? 30 : allowed * 3);
        o.certify = 0;
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        check_solution(&q, x, &r, allowed);
    }
    free_problem(&q);
    free_problem(&square);
}

TEST(softassign_fast_keeps_the_gap_it_was_asked_for)
{
    static const double gaps[] = {0.1, 0.01, 1e-3, 1e-4, 1e-6, 0};
    problem q = make_features(200, 800, 12, 15);
    int x[200];
    size_t k;
    for (k = 0; k < sizeof gaps / sizeof *gaps; k++) {
        softassign_options o = softassign_method_defaults(SOFTASSIGN_FAST);
        softassign_stats r;
        o.gap = gaps[k];
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        check_solution(&q, x, &r, gaps[k]);
        EXPECT(r.gap <= (gaps[k] > 1e-12 ? gaps[k] : 1e-12));
    }
    free_problem(&q);
}

/* The auction itself stops at the gap: it does not go on to the optimum. */
TEST(softassign_fast_with_capacities_keeps_its_gap_too)
{
    enum { ROWS = 100, COLUMNS = 200 };
    static const int kinds[] = {1, 3, 7, ROWS, 0};
    problem q = make_features(ROWS, COLUMNS, 12, 16);
    int x[ROWS], capacity[COLUMNS], least[COLUMNS], j;
    size_t k;
    for (k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        softassign_options o = softassign_method_defaults(SOFTASSIGN_FAST);
        softassign_stats fast, exact;
        for (j = 0; j < COLUMNS; j++) capacity[j] = kinds[k] ? kinds[k] : j * 7 % 5;
        for (j = 0; j < COLUMNS; j++) least[j] = capacity[j] > 1 && j % 9 == 0;
        o.gap = 0.05;
        q.p.capacity = capacity;
        q.p.minimum_use = k & 1 ? least : NULL;
        q.optimum = (double)reference_optimum(q.cost, ROWS, COLUMNS, capacity, q.p.minimum_use);
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &fast), SAT_OK);
        check_solution(&q, x, &fast, 0.05);
        EXPECT_EQ(fast.method, k & 1 ? SOFTASSIGN_EXACT : SOFTASSIGN_FAST);
        EXPECT(fast.gap <= 0.05);
        for (j = 0; q.p.minimum_use && j < COLUMNS; j++) {
            int i, used = 0;
            for (i = 0; i < ROWS; i++) used += x[i] == j;
            EXPECT(used >= least[j]);
        }
        o = softassign_method_defaults(SOFTASSIGN_EXACT);
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &exact), SAT_OK);
        EXPECT_NEAR(exact.cost, q.optimum, slack_of(q.optimum));
        if (fast.method == SOFTASSIGN_FAST) EXPECT(10 * fast.work < exact.work);
    }
    free_problem(&q);
}

static float from_matrix(int row, int column, void *user)
{
    const problem *q = (const problem *)user;
    return q->cost[(size_t)row * (size_t)q->p.columns + (size_t)column];
}

TEST(softassign_costs_by_function_equal_costs_by_matrix)
{
    problem q = make_dense(120, 1000, cost_uniform, 21);
    softassign_problem p;
    int x[120], y[120];
    memset(&p, 0, sizeof p);
    p.rows = 120;
    p.columns = 1000;
    p.cost_fn = from_matrix;
    p.cost_user = &q;
    EXPECT_EQ(softassign_solve(x, &q.p, NULL, NULL), SAT_OK);
    EXPECT_EQ(softassign_solve(y, &p, NULL, NULL), SAT_OK);
    EXPECT(memcmp(x, y, sizeof x) == 0);
    free_problem(&q);
}

TEST(softassign_stride_of_0_is_packed)
{
    float cost[2 * 3] = {9, 1, 9, 1, 0, 9}, soft[2][6];
    softassign_problem p;
    softassign_options o = softassign_method_defaults(SOFTASSIGN_PUBLISHED);
    int x[2], y[2], k, method;
    memset(&p, 0, sizeof p);
    p.rows = 2;
    p.columns = 3;
    p.cost = cost;
    EXPECT_EQ(softassign_solve(x, &p, NULL, NULL), SAT_OK);
    EXPECT(x[0] == 1 && x[1] == 0);
    for (method = 0; method < 2; method++) {
        o = softassign_method_defaults(method ? SOFTASSIGN_ENTROPIC : SOFTASSIGN_PUBLISHED);
        for (k = 0; k < 2; k++) {
            p.stride = o.soft_stride = k ? 3 : 0;
            o.soft = soft[k];
            EXPECT_EQ(softassign_solve(k ? y : x, &p, &o, NULL), SAT_OK);
        }
        EXPECT(memcmp(x, y, sizeof x) == 0 && memcmp(soft[0], soft[1], sizeof soft[0]) == 0);
        EXPECT(soft[0][1] > soft[0][0]);
    }
}

TEST(softassign_stride_may_be_wide_or_negative)
{
    float cost[3 * 5] = {9, 1, 9, 0, 0, 1, 9, 9, 0, 0, 9, 9, 1, 0, 0};
    softassign_problem p;
    int x[3];
    memset(&p, 0, sizeof p);
    p.rows = p.columns = 3;
    p.cost = cost;
    p.stride = 5;
    EXPECT_EQ(softassign_solve(x, &p, NULL, NULL), SAT_OK);
    EXPECT(x[0] == 1 && x[1] == 0 && x[2] == 2);
    p.cost = cost + 10;
    p.stride = -5;
    EXPECT_EQ(softassign_solve(x, &p, NULL, NULL), SAT_OK);
    EXPECT(x[0] == 2 && x[1] == 0 && x[2] == 1);
}

/* ---- ties, order, the two traps ---- */

TEST(softassign_ties_go_by_index)
{
    problem q = make_dense(40, 90, cost_equal, 1);
    int x[40], i, m;
    for (m = SOFTASSIGN_AUTO; m <= SOFTASSIGN_EXACT; m++) {
        softassign_options o = softassign_method_defaults((softassign_method)m);
        int ok = 1;
        EXPECT_EQ(softassign_solve(x, &q.p, &o, NULL), SAT_OK);
        for (i = 0; i < 40; i++) ok &= x[i] < 40;
        EXPECT(ok);
    }
    free_problem(&q);
}

/* A pair whose cost were rounded in two ways would send the search round in circles: duplicates and near-duplicates of
   features in every lane position, solved in a bounded number of visits. */
TEST(softassign_one_rounding_of_every_pair)
{
    int rows = 120, columns = 600, n = 11, i, k, x[120];
    float *a = (float *)malloc((size_t)rows * (size_t)n * sizeof *a),
          *b = (float *)malloc((size_t)columns * (size_t)n * sizeof *b);
    softassign_problem p;
    softassign_stats r;
    softassign_options o = softassign_method_defaults(SOFTASSIGN_EXACT);
    problem q;
    uint64_t seed = 4;
    memset(&q, 0, sizeof q);
    for (i = 0; i < rows; i++)
        for (k = 0; k < n; k++) a[i * n + k] = (float)(1e3 + (i % 5) * 0.1 + k * 1e-4);
    for (i = 0; i < columns; i++)
        for (k = 0; k < n; k++) b[i * n + k] = (float)(1e3 + (i % 9) * 0.1 + (double)support_below(&seed, 3) * 1e-4);
    memset(&p, 0, sizeof p);
    p.rows = rows;
    p.columns = columns;
    p.row_features = a;
    p.column_features = b;
    p.feature_count = n;
    q.p = p;
    q.cost = reference_matrix(a, b, rows, columns, n);
    q.optimum = (double)reference_optimum(q.cost, rows, columns, NULL, NULL);
    EXPECT_EQ(softassign_solve(x, &p, &o, &r), SAT_OK);
    check_solution(&q, x, &r, 0);
    EXPECT(r.work < 200000);
    free(a);
    free(b);
    free(q.cost);
}

/* Prices of an unrelated problem leave columns overbid; without the finish the answer is not the optimum. */
TEST(softassign_finish_restores_the_optimum_after_foreign_prices)
{
    problem a = make_features(100, 1500, 12, 31), b = make_features(100, 1500, 12, 77);
    softassign_options o = softassign_method_defaults(SOFTASSIGN_EXACT);
    softassign_stats r;
    softassign *s;
    int x[100];
    if (!EXPECT_EQ(softassign_create(&s, 100, 1500, &o), SAT_OK)) return;
    EXPECT_EQ(softassign_step(s, x, &a.p, (size_t)-1 / 4, &r), SAT_OK);
    check_solution(&a, x, &r, 0);
    softassign_next_frame(s);
    EXPECT_EQ(softassign_step(s, x, &b.p, (size_t)-1 / 4, &r), SAT_OK);
    check_solution(&b, x, &r, 0);
    EXPECT(r.columns_finished > 0);
    EXPECT(r.gap < 1e-9);
    softassign_destroy(s);
    free_problem(&a);
    free_problem(&b);
}

/* ---- capacities, minimum use, distance, switching ---- */

TEST(softassign_capacities)
{
    uint64_t seed = 9;
    int turn, k, x[60], capacity[40];
    for (turn = 0; turn < 12; turn++) {
        problem q = turn % 2 ? make_features(60, 40, 7, (uint64_t)turn)
                             : make_dense(60, 40, turn % 4 ? cost_uniform : cost_steps, (uint64_t)turn);
        softassign_stats r;
        for (k = 0; k < 40; k++) capacity[k] = support_below(&seed, 5);
        for (k = 0; k < 10; k++) capacity[k] = 4;
        for (k = 10; k < 20; k++) capacity[k] = turn % 3 + 2;
        capacity[39] = 0;
        q.p.capacity = capacity;
        q.optimum = (double)reference_optimum(q.cost, 60, 40, capacity, NULL);
        for (k = 0; k < 9; k++) {
            softassign_options o = quick_options(all_methods[k]);
            EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
            check_solution(&q, x, &r, k <= SOFTASSIGN_EXACT ? 0 : k == SOFTASSIGN_FAST ? 0.001 : 1e9);
        }
        free_problem(&q);
    }
}

TEST(softassign_capacity_default_allows_repeats)
{
    problem q = make_features(100, 30, 6, 3);
    softassign_options o = softassign_defaults();
    softassign_stats r;
    int x[100], capacity[30], k;
    o.capacity_default = 100;
    EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
    for (k = 0; k < 30; k++) capacity[k] = 100;
    q.p.capacity = capacity;
    q.optimum = (double)reference_optimum(q.cost, 100, 30, capacity, NULL); /* best match with repeats */
    check_solution(&q, x, &r, 0);
    EXPECT(r.gap < 1e-12);
    free_problem(&q);
}

TEST(softassign_minimum_use)
{
    int turn, k, x[50], capacity[30], least[30], used[30];
    for (turn = 0; turn < 6; turn++) {
        problem q =
            turn % 2 ? make_features(50, 30, 5, (uint64_t)turn) : make_dense(50, 30, cost_uniform, (uint64_t)turn);
        softassign_stats r;
        for (k = 0; k < 30; k++) {
            capacity[k] = 2 + k % 4;
            least[k] = turn < 2 ? 1 : k % 3 == 0 ? 2 : 0;
            used[k] = 0;
        }
        q.p.capacity = capacity;
        q.p.minimum_use = least;
        q.optimum = (double)reference_optimum(q.cost, 50, 30, capacity, least);
        EXPECT_EQ(softassign_solve(x, &q.p, NULL, &r), SAT_OK);
        check_solution(&q, x, &r, 0);
        EXPECT(r.gap < 1e-6);
        for (k = 0; k < 50; k++) used[x[k]]++;
        for (k = 0; k < 30; k++) EXPECT(used[k] >= least[k] && used[k] <= capacity[k]);
        free_problem(&q);
    }
}

TEST(softassign_impossible_minimum_use_names_its_column)
{
    problem q = make_dense(6, 9, cost_uniform, 3);
    int least[9] = {0, 0, 0, 1, 0, 0, 0, 0, 0}, x[6], i;
    softassign_stats r;
    for (i = 0; i < 6; i++) q.cost[i * 9 + 3] = INFINITY;
    q.p.minimum_use = least;
    EXPECT_EQ(softassign_solve(x, &q.p, NULL, &r), SAT_ERR_LIMIT);
    EXPECT_EQ(r.column_error, 3);
    least[3] = 2; /* more than the capacity */
    EXPECT_EQ(softassign_solve(x, &q.p, NULL, &r), SAT_ERR_ARGUMENT);
    EXPECT_EQ(r.column_error, 3);
    free_problem(&q);
}

TEST(softassign_minimum_distance_between_repeats)
{
    problem q = make_features(144, 60, 6, 8);
    int x[144], i, j, m, capacity[60];
    for (i = 0; i < 60; i++) capacity[i] = 6;
    for (m = 0; m < 3; m++) {
        static const softassign_method methods[] = {SOFTASSIGN_AUTO, SOFTASSIGN_GREEDY, SOFTASSIGN_EXACT};
        softassign_options o = quick_options(methods[m]);
        softassign_stats r;
        int close = 0;
        o.grid_width = 12;
        o.min_distance = 3;
        q.p.capacity = capacity;
        q.optimum = (double)reference_optimum(q.cost, 144, 60, capacity, NULL);
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        check_solution(&q, x, &r, 10);
        for (i = 0; i < 144; i++)
            for (j = 0; j < i; j++) {
                double dx = i % 12 - j % 12, dy = i / 12 - j / 12;
                close += x[i] == x[j] && dx * dx + dy * dy < 9;
            }
        EXPECT_EQ(close, 0);
        EXPECT_EQ(r.conflicts, 0);
    }
    free_problem(&q);
}

TEST(softassign_switching_bonus_keeps_tiles)
{
    problem a = make_features(100, 1200, 12, 40), b;
    softassign_options o = softassign_method_defaults(SOFTASSIGN_EXACT);
    softassign_stats r, free_run;
    int first[100], x[100], i, k, m;
    uint64_t seed = 2;
    b = make_features(100, 1200, 12, 40);
    for (i = 0; i < 100; i++)
        for (k = 0; k < 12; k++) b.rows_f[i * 12 + k] += (float)(3 * support_gaussian(&seed));
    free(b.cost);
    b.cost = reference_matrix(b.rows_f, b.columns_f, 100, 1200, 12);
    b.optimum = (double)reference_optimum(b.cost, 100, 1200, NULL, NULL);
    for (m = 0; m < 2; m++) {
        o.method = m ? SOFTASSIGN_AUTO : SOFTASSIGN_EXACT;
        o.switching = 0;
        EXPECT_EQ(softassign_solve(first, &a.p, &o, &r), SAT_OK);
        b.p.previous = first;
        EXPECT_EQ(softassign_solve(x, &b.p, &o, &free_run), SAT_OK);
        check_solution(&b, x, &free_run, 0);
        o.switching = 0.05;
        EXPECT_EQ(softassign_solve(x, &b.p, &o, &r), SAT_OK);
        check_solution(&b, x, &r, 0.05);
        EXPECT(r.switched < free_run.switched);
        o.switching = 1e5;
        EXPECT_EQ(softassign_solve(x, &b.p, &o, &r), SAT_OK);
        EXPECT_EQ(r.switched, 0);
        check_solution(&b, x, &r, 1e9);
    }
    free_problem(&a);
    free_problem(&b);
}

/* ---- refusals ---- */

static sat_result solve_with(problem *q, softassign_stats *r)
{
    int x[64], i;
    sat_result result;
    for (i = 0; i < 64; i++) x[i] = -7;
    result = softassign_solve(x, &q->p, NULL, r);
    for (i = 0; result != SAT_OK && i < 64; i++) EXPECT_EQ(x[i], -7); /* untouched after an error */
    return result;
}

TEST(softassign_bad_costs_are_refused_with_their_row)
{
    static const float bad[] = {NAN, -INFINITY, 2e30f, -2e30f};
    static const sat_result codes[] = {SAT_ERR_NON_FINITE, SAT_ERR_NON_FINITE, SAT_ERR_ARGUMENT, SAT_ERR_ARGUMENT};
    int k, m, x[30];
    for (k = 0; k < 4; k++)
        for (m = 0; m < 9; m++) {
            problem q = make_dense(30, 50, cost_uniform, 3);
            softassign_options o = quick_options(all_methods[m]);
            softassign_stats r;
            q.cost[17 * 50 + 49] = bad[k];
            EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), codes[k]);
            EXPECT_EQ(r.row_error, 17);
            q.p.cost = NULL;
            q.p.cost_fn = from_matrix;
            q.p.cost_user = &q;
            EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), codes[k]);
            EXPECT_EQ(r.row_error, 17);
            free_problem(&q);
        }
}

TEST(softassign_bad_features_are_refused)
{
    static const float bad[] = {NAN, INFINITY, -INFINITY, 2e16f};
    int k, large;
    for (large = 0; large < 2; large++)
        for (k = 0; k < 4; k++) {
            problem q = make_features(60, large ? 2500 : 80, 5, 3);
            softassign_stats r;
            q.rows_f[23 * 5 + 4] = bad[k];
            EXPECT_EQ(solve_with(&q, &r), k == 3 ? SAT_ERR_ARGUMENT : SAT_ERR_NON_FINITE);
            EXPECT_EQ(r.row_error, 23);
            q.rows_f[23 * 5 + 4] = 0;
            q.columns_f[70 * 5] = bad[k];
            EXPECT_EQ(solve_with(&q, &r), k == 3 ? SAT_ERR_ARGUMENT : SAT_ERR_NON_FINITE);
            EXPECT_EQ(r.column_error, 70);
            free_problem(&q);
        }
}

TEST(softassign_infinity_forbids_a_pair)
{
    uint64_t seed = 12;
    int turn, k, m, x[30];
    for (turn = 0; turn < 8; turn++) {
        problem q = make_dense(30, 32 + turn * 12, cost_uniform, (uint64_t)turn);
        for (k = 0; k < q.p.rows * q.p.columns; k++)
            if (support_uniform(&seed) < 0.75 && k % q.p.columns != (k / q.p.columns) * 31 % 32) q.cost[k] = INFINITY;
        q.optimum = (double)reference_optimum(q.cost, q.p.rows, q.p.columns, NULL, NULL);
        if (!EXPECT(q.optimum < 1e30)) return;
        for (m = 0; m < 9; m++) {
            softassign_options o = quick_options(all_methods[m]);
            softassign_stats r;
            EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
            check_solution(&q, x, &r, m <= SOFTASSIGN_EXACT ? 0 : m == SOFTASSIGN_FAST ? 0.001 : 1e9);
            for (k = 0; k < 30; k++) EXPECT(sat__is_finite(q.cost[k * q.p.columns + x[k]]));
        }
        free_problem(&q);
    }
}

TEST(softassign_impossible_problems_name_a_row)
{
    problem q = make_dense(40, 45, cost_uniform, 2);
    softassign_stats r;
    int m, k, x[64];
    for (k = 0; k < 45; k++) q.cost[11 * 45 + k] = INFINITY; /* row 11 has no column at all */
    for (m = 0; m < 9; m++) {
        softassign_options o = quick_options(all_methods[m]);
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_ERR_LIMIT);
        EXPECT_EQ(r.row_error, 11);
    }
    for (k = 0; k < 45; k++)
        q.cost[11 * 45 + k] = q.cost[12 * 45 + k] = k == 5 ? 1 : INFINITY; /* two rows want column 5 */
    for (m = 0; m < 9; m++) {
        softassign_options o = quick_options(all_methods[m]);
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_ERR_LIMIT);
        EXPECT(r.row_error >= 0 && r.row_error < 40);
    }
    free_problem(&q);
    q = make_dense(5, 5, cost_uniform, 2);
    q.p.columns = 4; /* m > n */
    q.p.stride = 5;
    EXPECT_EQ(solve_with(&q, &r), SAT_ERR_LIMIT);
    EXPECT_EQ(r.row_error, 4);
    free_problem(&q);
}

TEST(softassign_bad_arguments_are_refused)
{
    problem q = make_dense(4, 5, cost_uniform, 2);
    softassign_options o;
    softassign *s = NULL;
    softassign_problem p;
    int x[4], previous[4] = {0, 1, 5, 2}, capacity[5] = {1, 1, 1, -1, 1};
#define REFUSED(change) (o = softassign_defaults(), (void)(change), EXPECT_EQ(softassign_solve(x, &q.p, &o, NULL), SAT_ERR_ARGUMENT))
    REFUSED(o.method = (softassign_method)15);
    REFUSED(o.gap = -1);
    REFUSED(o.gap = (double)NAN);
    REFUSED(o.capacity_default = -1);
    REFUSED(o.neighbours = 3);
    REFUSED(o.neighbours = 257);
    REFUSED(o.gather = 1);
    REFUSED(o.ants = 0);
    REFUSED(o.iterations[2] = -1);
    REFUSED(o.temperature = (double)NAN);
    REFUSED(o.cooling = 1.5);
    REFUSED(o.alpha = (double)INFINITY);
    REFUSED(o.outlier = -1);
    REFUSED(o.evaporation = 2);
    REFUSED(o.noise = (double)NAN);
    REFUSED(o.switching = -1);
    REFUSED(o.min_distance = 3); /* without a grid */
    REFUSED(o.grid_width = -1);
    REFUSED(o.threads.workers = 3); /* without a parallel_for */
    REFUSED(o.allocator.release = support_release); /* half an allocator */
#undef REFUSED
    o = softassign_defaults();
    EXPECT_EQ(softassign_solve(NULL, &q.p, &o, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(softassign_solve(x, NULL, &o, NULL), SAT_ERR_ARGUMENT);
#define REFUSED(change) (p = q.p, (void)(change), EXPECT_EQ(softassign_solve(x, &p, NULL, NULL), SAT_ERR_ARGUMENT))
    REFUSED(p.rows = 0);
    REFUSED(p.columns = -1);
    REFUSED(p.cost = NULL);
    REFUSED(p.stride = 4);
    REFUSED(p.previous = previous);
    REFUSED(p.capacity = capacity);
    REFUSED((p.cost = NULL, p.row_features = q.cost, p.feature_count = 1)); /* no column features */
#undef REFUSED
    EXPECT_EQ(softassign_create(NULL, 4, 5, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(softassign_create(&s, 0, 5, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(softassign_create(&s, 2147483647, 2147483647, NULL), SAT_ERR_SIZE);
    o.method = SOFTASSIGN_ANTS;
    EXPECT_EQ(softassign_create(&s, 4, 5, &o), SAT_ERR_ARGUMENT);
    EXPECT(s == NULL);
    softassign_destroy(NULL);
    softassign_next_frame(NULL);
    if (!EXPECT_EQ(softassign_create(&s, 4, 6, NULL), SAT_OK)) return;
    EXPECT_EQ(softassign_step(s, x, &q.p, 1, NULL), SAT_ERR_MISMATCH);
    EXPECT_EQ(softassign_step(NULL, x, &q.p, 1, NULL), SAT_ERR_ARGUMENT);
    softassign_destroy(s);
    free_problem(&q);
}

/* ---- extremes ---- */

TEST(softassign_capacity_zero_everywhere)
{
    problem q = make_dense(3, 5, cost_uniform, 2);
    int capacity[5] = {0, 0, 0, 0, 0}, x[3];
    softassign_stats r;
    softassign_options o = softassign_defaults();
    q.p.capacity = capacity;
    EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_ERR_LIMIT);
    EXPECT_EQ(r.row_error, 0);
    q.p.capacity = NULL;
    o.capacity_default = 0;
    EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_ERR_LIMIT);
    free_problem(&q);
}

TEST(softassign_tiny_temperatures_stay_finite)
{
    static float (*const costs[])(int, int, uint64_t *) = {cost_uniform, cost_wide, cost_equal, cost_zero,
                                                           cost_negative};
    static const double temperatures[] = {1e-3, 1e-6, 1e-12, 0};
    size_t k, t;
    int m, x[50];
    float *soft = (float *)malloc(50 * 80 * sizeof *soft);
    for (k = 0; k < 5; k++)
        for (t = 0; t < 4; t++)
            for (m = 0; m < 3; m++) {
                problem q = make_dense(50, 80, costs[k], 5);
                softassign_options o = softassign_method_defaults(m ? SOFTASSIGN_PUBLISHED : SOFTASSIGN_ENTROPIC);
                softassign_stats r;
                int i, finite = 1;
                o.temperature = temperatures[t];
                o.iterations[0] = 4;
                o.double_precision = m == 2;
                o.soft = soft;
                o.soft_stride = 80;
                EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
                check_solution(&q, x, &r, 1e9);
                for (i = 0; i < 50 * 80; i++) finite &= sat__is_finite(soft[i]) && soft[i] >= 0;
                EXPECT(finite);
                free_problem(&q);
            }
    free(soft);
}

TEST(softassign_features_of_any_magnitude)
{
    static const double scales[] = {1e-30, 1e-18, 1e-6, 1, 1e6, 1e12};
    size_t k;
    int x[100], i;
    for (k = 0; k < 6; k++) {
        problem q = make_features(100, 1200, 6, 3);
        softassign_options o = softassign_method_defaults(SOFTASSIGN_EXACT);
        softassign_stats r;
        for (i = 0; i < 100 * 6; i++) q.rows_f[i] = (float)((double)q.rows_f[i] * scales[k]);
        for (i = 0; i < 1200 * 6; i++) q.columns_f[i] = (float)((double)q.columns_f[i] * scales[k]);
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        EXPECT(is_valid(x, 100, 1200, NULL));
        EXPECT(r.gap <= 1e-6);
        EXPECT(r.lower_bound <= r.cost);
        if (scales[k] > 1e-17) EXPECT_REL(r.cost, q.optimum * scales[k], 1e-5); /* squares below 1e-38 vanish */
        free_problem(&q);
    }
}

TEST(softassign_one_huge_forced_cost_does_not_drown_the_rest)
{
    problem q = make_dense(60, 2000, cost_forced, 5), rest;
    softassign_stats r;
    int x[60], m, i, j;
    double sum;
    rest = make_dense(60, 2000, cost_uniform, 99);
    for (i = 0; i < 60; i++)
        for (j = 0; j < 2000; j++) rest.cost[i * 2000 + j] = i == 3 ? 0 : q.cost[i * 2000 + j];
    rest.optimum = (double)reference_optimum(rest.cost, 60, 2000, NULL, NULL);
    for (m = SOFTASSIGN_AUTO; m <= SOFTASSIGN_EXACT; m++) {
        softassign_options o = softassign_method_defaults((softassign_method)m);
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        EXPECT(is_valid(x, 60, 2000, NULL));
        for (sum = 0, i = 0; i < 60; i++) sum += i == 3 ? 0 : (double)q.cost[i * 2000 + x[i]];
        EXPECT_NEAR(sum, rest.optimum, 1e-6);
    }
    free_problem(&q);
    free_problem(&rest);
}

TEST(softassign_more_than_2_31_cells)
{
    softassign_problem p;
    softassign_options o = softassign_method_defaults(SOFTASSIGN_EXACT);
    support_memory m;
    softassign *s = NULL;
    size_t i, n = 300000;
    enum { rows = 7200 };
    int *x = (int *)malloc(rows * sizeof *x), k, ok = 1;
    float *a = (float *)malloc(rows * sizeof *a), *b = (float *)malloc(n * sizeof *b);
    softassign_stats r;
    /* sizes that need more than the address space, or more than there is: refused, never wrapped */
    o.allocator = support_allocator(&m);
    m.fail_at = 1;
    EXPECT(softassign_create(&s, 1000000000, 1000000000, &o) != SAT_OK && s == NULL);
    o.method = SOFTASSIGN_AUTO;
    EXPECT(softassign_create(&s, 65536, 65536, &o) != SAT_OK && s == NULL);
    memset(&p, 0, sizeof p);
    p.rows = rows;
    p.columns = (int)n;
    p.row_features = a;
    p.column_features = b;
    p.feature_count = 1;
    o = softassign_method_defaults(SOFTASSIGN_ENTROPIC); /* the matrix alone is 8.6 GB: asked for in full, and
                                                            refused */
    o.allocator = support_allocator(&m);
    m.fail_at = 1;
    for (k = 0; k < rows; k++) a[k] = (float)k;
    for (i = 0; i < n; i++) b[i] = (float)i * 0.0625f;
    EXPECT_EQ(softassign_solve(x, &p, &o, NULL), SAT_ERR_MEMORY);
    o = softassign_method_defaults(SOFTASSIGN_GREEDY); /* 2.16e9 cells, no matrix */
    o.certify = 0;
    o.neighbours = 4;
    EXPECT_EQ(softassign_solve(x, &p, &o, &r), SAT_OK);
    for (k = 0; k < rows; k++) ok &= x[k] == 16 * k;
    EXPECT(ok);
    EXPECT_NEAR(r.cost, 0, 0);
    EXPECT_NEAR(r.lower_bound, 0, 0);
    free(x);
    free(a);
    free(b);
}

/* ---- threads, memory, steps ---- */

TEST(softassign_same_bits_for_any_number_of_workers)
{
    static const int workers[] = {1, 2, 3, 7};
    enum { ROWS = 60, COLUMNS = 700 };
    problem q = make_features(ROWS, COLUMNS, 12, 50);
    int x[ROWS], first[ROWS], k, m, odd;
    float *soft = (float *)malloc(ROWS * COLUMNS * sizeof *soft);
    for (m = 0; m < 9; m++) {
        uint64_t hash = 0;
        for (odd = 0; odd < 2; odd++)
            for (k = odd; k < 4; k++) {
                softassign_options o = quick_options(all_methods[m]);
                softassign_stats r;
                uint64_t h;
                o.threads = odd ? support_odd_threads(workers[k]) : support_threads(workers[k]);
                if (m == SOFTASSIGN_ENTROPIC || m == SOFTASSIGN_PUBLISHED) {
                    o.soft = soft;
                    o.soft_stride = COLUMNS;
                }
                EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
                h = support_hash(x, sizeof x);
                h = support_hash_add(h, &r.cost, sizeof r.cost);
                h = support_hash_add(h, &r.lower_bound, sizeof r.lower_bound);
                if (o.soft) h = support_hash_add(h, soft, ROWS * COLUMNS * sizeof *soft);
                if (odd == 0 && k == 0) {
                    hash = h;
                    memcpy(first, x, sizeof x);
                }
                EXPECT(h == hash);
                EXPECT(memcmp(first, x, sizeof x) == 0);
            }
    }
    free(soft);
    free_problem(&q);
}

TEST(softassign_failing_allocator_leaks_nothing)
{
    problem q = make_features(40, 500, 6, 4);
    int m, k, x[40];
    for (m = 0; m < 9; m++)
        for (k = 1; k < 6; k++) {
            softassign_options o = quick_options(all_methods[m]);
            support_memory memory;
            sat_result result;
            o.allocator = support_allocator(&memory);
            memory.fail_at = k;
            result = softassign_solve(x, &q.p, &o, NULL);
            EXPECT(result == SAT_OK || result == SAT_ERR_MEMORY);
            EXPECT(support_memory_clean(&memory));
            EXPECT(memory.calls <= 2); /* the solver, and the matrices of the matrix methods */
            EXPECT_EQ(result, memory.calls >= k ? SAT_ERR_MEMORY : SAT_OK);
        }
    free_problem(&q);
}

static void check_steps(problem *q, softassign_options o, size_t budget)
{
    softassign *s;
    softassign_stats r;
    support_memory memory;
    int *x = (int *)malloc((size_t)q->p.rows * sizeof *x), steps = 0;
    double bound = -HUGE_VAL;
    o.allocator = support_allocator(&memory);
    if (!EXPECT_EQ(softassign_create(&s, q->p.rows, q->p.columns, &o), SAT_OK)) return;
    EXPECT_EQ(memory.calls, 1);
    do {
        if (!EXPECT_EQ(softassign_step(s, x, &q->p, budget, &r), SAT_OK)) break;
        check_solution(q, x, &r, 1e9);
        EXPECT(r.lower_bound >= bound);
        bound = r.lower_bound;
    } while (!r.complete && ++steps < 10000);
    EXPECT_EQ(r.complete, 1);
    check_solution(q, x, &r, 0);
    EXPECT(r.gap < 1e-6);
    EXPECT(budget > 1 || steps > 0);
    EXPECT_EQ(memory.calls, 1); /* no allocation in the steps */
    EXPECT_EQ(memory.peak, r.bytes);
    softassign_destroy(s);
    EXPECT(support_memory_clean(&memory));
    free(x);
}

TEST(softassign_steps_are_valid_at_any_moment)
{
    problem q = make_features(90, 1200, 12, 60), small = make_dense(40, 60, cost_uniform, 4),
            forbidden = make_dense(40, 60, cost_uniform, 4);
    softassign_options o = softassign_method_defaults(SOFTASSIGN_EXACT);
    int k;
    check_steps(&q, o, 1);
    check_steps(&q, o, 50);
    check_steps(&q, o, 1000000);
    check_steps(&small, softassign_defaults(), 1);
    check_steps(&small, o, 7);
    for (k = 0; k < 40 * 60; k++)
        if (k % 60 >= k / 60 + 2) forbidden.cost[k] = INFINITY; /* a staircase: hardly any freedom */
    forbidden.optimum = (double)reference_optimum(forbidden.cost, 40, 60, NULL, NULL);
    check_steps(&forbidden, softassign_defaults(), 60);
    check_steps(&forbidden, o, 60);
    free_problem(&q);
    free_problem(&small);
    free_problem(&forbidden);
}

typedef struct counted { int calls, stop_at, rows, columns, valid, empty; double last_gap; } counted;

static int count_progress(const softassign_stats *report, const int *x, void *user)
{
    counted *c = (counted *)user;
    c->calls++;
    if (x) c->valid += is_valid(x, c->rows, c->columns, NULL) && report->lower_bound <= report->cost;
    else c->empty++;
    c->last_gap = report->gap;
    return c->calls >= c->stop_at;
}

TEST(softassign_progress_can_stop_every_method)
{
    problem q = make_features(80, 1500, 12, 61);
    int m, x[80];
    for (m = 0; m < 9; m++) {
        softassign_options o = quick_options(all_methods[m]);
        softassign_stats r;
        counted c = {0, 3, 80, 1500, 0, 0, 0};
        o.progress = count_progress;
        o.progress_user = &c;
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        check_solution(&q, x, &r, 1e9);
        EXPECT(c.calls <= 3);
        EXPECT_EQ(c.valid + c.empty, c.calls);
        if (m == SOFTASSIGN_ANTS || m == SOFTASSIGN_ANNEALING || m == SOFTASSIGN_EXACT)
            EXPECT(c.calls > 0 && c.empty == 0);
    }
    free_problem(&q);
}

/* ---- the published methods ---- */

TEST(softassign_greedy_is_the_published_one)
{
    uint64_t seed;
    int x[70], y[70];
    for (seed = 1; seed < 10; seed++) {
        problem q = make_features(70, 70 + (int)seed * 30, 9, seed);
        softassign_options o = softassign_method_defaults(SOFTASSIGN_GREEDY),
                           two = softassign_method_defaults(SOFTASSIGN_GREEDY_2OPT);
        softassign_stats r, better;
        reference_greedy(q.cost, 70, q.p.columns, y);
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        EXPECT_REL(cost_of(&q, x), cost_of(&q, y), 1e-6);
        EXPECT_EQ(softassign_solve(x, &q.p, &two, &better), SAT_OK);
        EXPECT(better.cost <= r.cost);
        free_problem(&q);
    }
}

TEST(softassign_published_is_the_pseudo_code)
{
    static const int iterations[3] = {14, 3, 4};
    problem q = make_features(30, 70, 12, 70);
    int i, turn, x[30], k, n = 30 * 70;
    double *m = (double *)malloc(2 * (size_t)n * sizeof *m), *soft = m + n, lowest;
    float *out = (float *)malloc((size_t)n * sizeof *out);
    for (turn = 0; turn < 4; turn++) {
        softassign_options o = softassign_method_defaults(SOFTASSIGN_PUBLISHED);
        softassign_stats r;
        uint64_t seed = 5;
        double worst = 0, column, widest = 0, sharpest = 0;
        int wide = turn % 2, gold = turn / 2;
        for (i = 0; i < 3; i++) o.iterations[i] = iterations[i];
        o.seed = 5;
        o.temperature = 0.02;
        o.cooling = 0.7;
        o.alpha = 1;
        o.outlier = 100;
        o.double_precision = wide;
        o.gold = gold;
        o.soft = out;
        o.soft_stride = 70;
        for (k = 0; k < n; k++) m[k] = 1e-6 + 1e-3 * support_uniform(&seed);
        lowest = reference_published(q.cost, 30, 70, m, soft, 0.02, 0.7, 1, 100, iterations, wide ? 650 : 70, gold);
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        EXPECT_REL(r.soft_cost, lowest, wide ? 1e-6 : 1e-4); /* costs are floats in both */
        for (k = 0; k < n; k++) {
            worst = support_larger(worst, fabs((double)out[k] - soft[k]));
            sharpest = fmax(sharpest, soft[k]);
        }
        EXPECT(sharpest > (gold ? 0.2 : 0.9)); /* the run went from blur to decision */
        EXPECT(worst < (wide ? 1e-5 : 2e-3));
        REPORT(wide ? "PUBLISHED, double against the pseudo-code" : "PUBLISHED, float against the pseudo-code", worst,
               "largest difference of S");
        for (k = 0; k < 70; k++) {
            for (column = 0, i = 0; i < 30; i++) column += soft[i * 70 + k];
            widest = fmax(widest, column);
        }
        EXPECT_REL(r.column_sum_max, widest, 1e-3);
        EXPECT(is_valid(x, 30, 70, NULL));
    }
    free(m);
    free(out);
    free_problem(&q);
}

/* Section 3.6.1: without the clamp exp overflows; with it, M stays finite even where every exponent saturates. */
TEST(softassign_published_clamps_hold)
{
    problem q = make_dense(20, 40, cost_uniform, 8);
    softassign_options o = softassign_method_defaults(SOFTASSIGN_PUBLISHED);
    softassign_stats r;
    int x[20], k, wide;
    float out[20 * 40];
    for (wide = 0; wide < 2; wide++) {
        o.temperature = 1e-6;
        o.alpha = 5;
        o.iterations[0] = 3;
        o.double_precision = wide;
        o.outlier = wide ? 1e-3 : 0;
        o.outlier_evolves = wide;
        o.soft = out;
        o.soft_stride = 40;
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        for (k = 0; k < 20 * 40; k++) EXPECT(out[k] >= 0 && out[k] <= 1.0001f);
        EXPECT(r.duplicate_rows >= 0 && r.duplicate_rows < 20);
        EXPECT(is_valid(x, 20, 40, NULL));
    }
    free_problem(&q);
}

TEST(softassign_entropic_matrix_is_feasible_and_the_bound_tightens)
{
    problem q = make_features(60, 200, 12, 90);
    softassign_options o = softassign_method_defaults(SOFTASSIGN_ENTROPIC);
    softassign_stats r;
    float *soft = (float *)malloc(60 * 200 * sizeof *soft);
    double before = -HUGE_VAL;
    int i, j, x[60], step;
    o.soft = soft;
    o.soft_stride = 200;
    for (step = 2; step <= 8; step += 2) {
        o.iterations[0] = step;
        o.iterations[1] = 60;
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        check_solution(&q, x, &r, 0.05);
        EXPECT(r.lower_bound >= before - 1e-3 * q.optimum);
        before = r.lower_bound;
        for (i = 0; i < 60; i++) {
            double sum = 0;
            for (j = 0; j < 200; j++) sum += (double)soft[i * 200 + j];
            EXPECT_NEAR(sum, 1, 1e-5);
        }
        EXPECT(r.column_sum_max < 1.05);
    }
    EXPECT(r.gap < 1e-3);
    free(soft);
    free_problem(&q);
}

TEST(softassign_annealing_and_ants_follow_their_seed)
{
    problem q = make_features(60, 150, 12, 91);
    int x[60], y[60], m;
    for (m = 0; m < 2; m++) {
        softassign_options o = quick_options(m ? SOFTASSIGN_ANTS : SOFTASSIGN_ANNEALING);
        softassign_stats a, b, c;
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &a), SAT_OK);
        EXPECT_EQ(softassign_solve(y, &q.p, &o, &b), SAT_OK);
        EXPECT(memcmp(x, y, sizeof x) == 0 && a.iterations == b.iterations);
        o.seed = 2;
        EXPECT_EQ(softassign_solve(y, &q.p, &o, &c), SAT_OK);
        EXPECT(memcmp(x, y, sizeof x) != 0);
        check_solution(&q, x, &a, m ? 0.5 : 0.1);
        check_solution(&q, y, &c, m ? 0.5 : 0.1);
    }
    free_problem(&q);
}

typedef struct ant_frames { int rows, columns, frames; double first, last; const problem *q; } ant_frames;

static int watch_ants(const softassign_stats *report, const int *x, void *user)
{
    ant_frames *f = (ant_frames *)user;
    double cost = cost_of(f->q, x);
    EXPECT_REL(report->cost, cost, 1e-6);
    EXPECT(is_valid(x, f->rows, f->columns, NULL));
    if (f->frames++ == 0) f->first = cost;
    f->last = cost;
    return 0;
}

TEST(softassign_ants_emerge_from_noise)
{
    problem q = make_features(80, 400, 12, 92);
    softassign_options o = softassign_method_defaults(SOFTASSIGN_ANTS);
    ant_frames f = {80, 400, 0, 0, 0, &q};
    softassign_stats r;
    int x[80];
    o.iterations[0] = 40;
    o.progress = watch_ants;
    o.progress_user = &f;
    EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
    EXPECT_EQ(f.frames, 40);
    EXPECT_EQ(r.iterations >= 40u * 30u, 1);
    EXPECT(f.first > 1.5 * f.last); /* chaos first */
    EXPECT(r.cost <= f.last);
    check_solution(&q, x, &r, 0.1);
    free_problem(&q);
}

/* ---- photomosaics ---- */

TEST(softassign_feature_means_are_exact_box_means)
{
    static const int sizes[][6] = {{64, 48, 4, 3, 4, 4}, {37, 23, 5, 3, 3, 2}, {5, 7, 8, 8, 2, 2}, {1, 1, 3, 2, 1, 2}};
    size_t k;
    for (k = 0; k < 4; k++) {
        int w = sizes[k][0], h = sizes[k][1], gw = sizes[k][2], gh = sizes[k][3], px = sizes[k][4], py = sizes[k][5];
        int cx, cy, u, v, c, i, j, at = 0, n = gw * gh * px * py * 3;
        uint8_t *pixels = (uint8_t *)malloc((size_t)(w * h * 3));
        float *out = (float *)malloc((size_t)n * sizeof *out);
        sat_image view;
        uint64_t seed = k;
        double worst = 0;
        for (i = 0; i < w * h * 3; i++) pixels[i] = (uint8_t)support_below(&seed, 256);
        view.pixels = pixels;
        view.width = w;
        view.height = h;
        view.channels = 3;
        view.stride = w * 3;
        view.format = SAT_U8;
        EXPECT_EQ(softassign_features(out, &view, gw, gh, px, py, NULL), SAT_OK);
        for (cy = 0; cy < gh; cy++)
            for (cx = 0; cx < gw; cx++)
                for (v = 0; v < py; v++)
                    for (u = 0; u < px; u++) {
                        double x0 = (double)w * (cx * px + u) / (gw * px),
                               x1 = (double)w * (cx * px + u + 1) / (gw * px);
                        double y0 = (double)h * (cy * py + v) / (gh * py),
                               y1 = (double)h * (cy * py + v + 1) / (gh * py);
                        for (c = 0; c < 3; c++, at++) {
                            double sum = 0;
                            for (j = 0; j < h; j++)
                                for (i = 0; i < w; i++) {
                                    double wide = fmin(x1, i + 1) - fmax(x0, i), high = fmin(y1, j + 1) - fmax(y0, j);
                                    if (wide > 0 && high > 0) sum += wide * high * pixels[(j * w + i) * 3 + c];
                                }
                            worst = support_larger(worst, fabs(sum / ((x1 - x0) * (y1 - y0)) - (double)out[at]));
                        }
                    }
        EXPECT(worst < 1e-3);
        EXPECT_EQ(softassign_features(out, &view, 0, gh, px, py, NULL), SAT_ERR_ARGUMENT);
        EXPECT_EQ(softassign_features(NULL, &view, gw, gh, px, py, NULL), SAT_ERR_ARGUMENT);
        free(pixels);
        free(out);
    }
}

TEST(softassign_mosaic_places_tiles)
{
    uint8_t sheet[6 * 4 * 3], out[4 * 6 * 3], target[2 * 3 * 3];
    sat_image tiles, goal;
    int x[6] = {5, 0, 3, 1, 4, 2}, i, j, c, bad[6] = {6, 0, 3, 1, 4, 2};
    for (i = 0; i < 6 * 4 * 3; i++) sheet[i] = (uint8_t)(i * 3);
    for (i = 0; i < 18; i++) target[i] = (uint8_t)(i * 14);
    tiles.pixels = sheet;
    tiles.width = 6;
    tiles.height = 4;
    tiles.channels = 3;
    tiles.stride = 18;
    tiles.format = SAT_U8;
    goal = tiles;
    goal.pixels = target;
    goal.width = 2;
    goal.height = 3;
    goal.stride = 6;
    tiles.stride = 0; /* packed, as the output */
    EXPECT_EQ(softassign_mosaic(out, 0, &tiles, 2, 2, x, 2, 3, NULL, 0), SAT_OK);
    tiles.stride = 18;
    for (j = 0; j < 6; j++)
        for (i = 0; i < 4; i++)
            for (c = 0; c < 3; c++) {
                int tile = x[(j / 2) * 2 + i / 2], from = ((tile / 3 * 2 + j % 2) * 6 + tile % 3 * 2 + i % 2) * 3 + c;
                EXPECT_EQ(out[(j * 4 + i) * 3 + c], sheet[from]);
            }
    EXPECT_EQ(softassign_mosaic(out, 12, &tiles, 2, 2, x, 2, 3, &goal, 1), SAT_OK);
    for (j = 0; j < 6; j++)
        for (i = 0; i < 4; i++)
            for (c = 0; c < 3; c++) EXPECT_EQ(out[(j * 4 + i) * 3 + c], target[((j / 2) * 2 + i / 2) * 3 + c]);
    EXPECT_EQ(softassign_mosaic(out, 12, &tiles, 2, 2, bad, 2, 3, NULL, 0), SAT_ERR_ARGUMENT);
    EXPECT_EQ(softassign_mosaic(out, 11, &tiles, 2, 2, x, 2, 3, NULL, 0), SAT_ERR_ARGUMENT);
}

/* ---- real pictures ---- */

#ifdef HAVE_STB
/* Features of a picture as it is displayed (sRGB values 0..255), grid x grid cells of 4 x 4 parts. */
static float *picture_features(const char *path, int grid_width, int grid_height)
{
    image picture;
    float *out;
    size_t i, n;
    sat_image view;
    if (!image_load(&picture, path)) return NULL;
    n = (size_t)picture.width * (size_t)picture.height * 3;
    for (i = 0; i < n; i++) picture.pixels[i] = 255 * sat__srgb_encode(picture.pixels[i]);
    out = (float *)malloc((size_t)(grid_width * grid_height) * 48 * sizeof *out);
    view = image_view(&picture);
    if (softassign_features(out, &view, grid_width, grid_height, 4, 4, NULL) != SAT_OK) out[0] = NAN;
    image_free(&picture);
    return out;
}
#endif

TEST(softassign_real_pictures_and_tiles)
{
#ifdef HAVE_STB
    const char *photo = support_data("photos/fig_bowl.jpg"), *sheet = support_data("tiles/tiles_0.png");
    problem q;
    softassign_stats r;
    int x[400], m;
    if (!photo || !sheet) SKIP("needs ../shared/data/photos and tiles");
    memset(&q, 0, sizeof q);
    q.rows_f = picture_features(photo, 20, 20);
    q.columns_f = picture_features(sheet, 64, 64);
    if (!EXPECT(q.rows_f != NULL && q.columns_f != NULL)) return;
    q.p.rows = 400;
    q.p.columns = 1500;
    q.p.row_features = q.rows_f;
    q.p.column_features = q.columns_f;
    q.p.feature_count = 48;
    q.cost = reference_matrix(q.rows_f, q.columns_f, 400, 1500, 48);
    q.optimum = (double)reference_optimum(q.cost, 400, 1500, NULL, NULL);
    for (m = SOFTASSIGN_AUTO; m <= SOFTASSIGN_FAST; m++) {
        softassign_options o = softassign_method_defaults((softassign_method)m);
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        check_solution(&q, x, &r, m == SOFTASSIGN_FAST ? 0.001 : 0);
        EXPECT(r.gap <= (m == SOFTASSIGN_FAST ? 0.001 : 1e-12));
        /* far below the matrix, though it is small */
        if (m != SOFTASSIGN_AUTO) EXPECT(r.bytes < 400u * 1500u * 4u / 2);
    }
    free_problem(&q);
#else
    SKIP("needs libstb-dev");
#endif
}

/* Many rows fight for the same columns with lists of a few entries: searches run out of their lists all the time. */
TEST(softassign_short_lists_stay_exact)
{
    uint64_t seed;
    int turn, x[60];
    for (turn = 0; turn < 36; turn++) {
        int columns = turn % 2 ? 1300 : 600, i, j;
        problem q = make_features(60, columns, 20, 1);
        softassign_options o = softassign_method_defaults(SOFTASSIGN_EXACT);
        softassign_stats r;
        seed = (uint64_t)(turn / 2) + 4;
        for (i = 0; i < 60 + columns; i++) {
            double level = (i < 60 ? 10 : 250) * support_uniform(&seed), spread = i < 60 ? 3 : 30;
            float *f = i < 60 ? q.rows_f + i * 20 : q.columns_f + (i - 60) * 20;
            for (j = 0; j < 20; j++) f[j] = (float)(level + spread * support_gaussian(&seed));
        }
        free(q.cost);
        q.cost = reference_matrix(q.rows_f, q.columns_f, 60, columns, 20);
        q.optimum = (double)reference_optimum(q.cost, 60, columns, NULL, NULL);
        o.neighbours = 4 + turn % 3 * 4;
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        check_solution(&q, x, &r, 0);
        EXPECT(r.gap < 1e-12);
        free_problem(&q);
    }
}

/* ---- small problems of all kinds against enumeration ---- */

enum { BRUTE_ROWS = 5, BRUTE_COLUMNS = 6 };

typedef struct brute {
    float cost[BRUTE_ROWS * BRUTE_COLUMNS];
    double wide[BRUTE_ROWS * BRUTE_COLUMNS]; /* what is enumerated: cost, or costs that are no floats */
    int rows, columns, left[BRUTE_COLUMNS], used[BRUTE_COLUMNS], least[BRUTE_COLUMNS], found;
    long double best, magnitude;
} brute;

static int brute_is_forbidden(double c) { return c > 3e38; }

static void brute_widen(brute *b)
{
    int i;
    for (i = 0; i < BRUTE_ROWS * BRUTE_COLUMNS; i++) b->wide[i] = (double)b->cost[i];
}

static void brute_walk(brute *b, int row, long double sum, long double magnitude)
{
    int j;
    if (row == b->rows) {
        for (j = 0; j < b->columns; j++)
            if (b->used[j] < b->least[j]) return;
        if (b->found && sum >= b->best) return;
        b->found = 1;
        b->best = sum;
        b->magnitude = magnitude;
        return;
    }
    for (j = 0; j < b->columns; j++) {
        double c = b->wide[row * BRUTE_COLUMNS + j];
        if (b->used[j] >= b->left[j] || brute_is_forbidden(c)) continue;
        b->used[j]++;
        brute_walk(b, row + 1, sum + (long double)c, magnitude + (long double)fabs(c));
        b->used[j]--;
    }
}

static float brute_cost(int kind, uint64_t *seed)
{
    double u = support_uniform(seed);
    switch (kind) {
    case 0: return (float)u;
    case 1: return (float)support_below(seed, 4);
    case 2: return (float)pow(10, -30 + 60 * u);
    case 3: return u < 0.3 ? 1e30f : (float)support_uniform(seed);
    case 4: return u < 0.3 ? SOFTASSIGN__INFINITY : (float)support_below(seed, 9);
    case 5: return (float)(u - 0.5) * (support_below(seed, 3) ? 1.0f : 1e12f);
    case 6: return (float)support_below(seed, 2);
    case 7: return u < 0.5 ? 1e20f : u < 0.6 ? SOFTASSIGN__INFINITY : (float)pow(2, -120 + 20 * support_uniform(seed));
    default: return (float)(support_below(seed, 1000) * support_below(seed, 1000));
    }
}

static void brute_check(brute *b, const softassign_problem *p, sat_result result, const int *x,
                        const softassign_stats *r, const char *what)
{
    long double sum = 0, allowed;
    int used[BRUTE_COLUMNS] = {0}, i, ok = 1;
    if (!b->found || result != SAT_OK) {
        if (!EXPECT_EQ(result, b->found ? SAT_OK : SAT_ERR_LIMIT)) printf("%s: %d x %d\n", what, b->rows, b->columns);
        return;
    }
    for (i = 0; i < p->rows; i++) {
        ok &= x[i] >= 0 && x[i] < p->columns && ++used[x[i]] <= b->left[x[i]];
        if (ok) sum += (long double)b->wide[i * BRUTE_COLUMNS + x[i]];
    }
    for (i = 0; i < p->columns; i++) ok &= used[i] >= b->least[i];
    allowed = 1e-12L * b->magnitude;
    ok &= sum <= b->best + allowed && r->complete == 1;
    ok &= (long double)r->lower_bound <= b->best + 1e-17L * b->magnitude &&
          (long double)r->lower_bound >= b->best - allowed;
    if (!ok) {
        printf("%s: %d x %d, cost %.17g optimum %.17Lg bound %.17g complete %d\n", what, b->rows, b->columns, (double)sum, b->best, r->lower_bound, r->complete);
        EXPECT(ok);
    }
}

/* An answer that need only be near: valid, between its bound and its gap. */
static void brute_gap(const brute *b, const softassign_problem *p, sat_result result, const int *x,
                      const softassign_stats *r, double gap)
{
    int i, used[BRUTE_COLUMNS] = {0}, ok = 1;
    long double sum = 0, rounding = 1e-12L * b->magnitude;
    if (result != SAT_OK) {
        EXPECT(result == SAT_ERR_LIMIT && !b->found);
        return;
    }
    for (i = 0; i < p->rows; i++) {
        ok &= x[i] >= 0 && x[i] < p->columns;
        if (!ok) break;
        used[x[i]]++;
        sum += (long double)b->wide[i * BRUTE_COLUMNS + x[i]];
    }
    for (i = 0; i < p->columns; i++) ok &= used[i] >= b->least[i] && used[i] <= (p->capacity ? p->capacity[i] : 1);
    ok &= r->complete == 1 && (long double)r->lower_bound <= b->best + 1e-17L * b->magnitude &&
          (sum <= b->best + rounding || (r->gap <= gap && sum - b->best <= gap * fabsl(sum) + rounding));
    EXPECT(ok);
}

/* SOFTASSIGN_BRUTE=1000000 in the environment for the long run. */
TEST(softassign_all_kinds_by_brute_force)
{
    const char *asked = getenv("SOFTASSIGN_BRUTE");
    long runs = asked ? atol(asked) : 20000, n;
    uint64_t seed = 20260;
    softassign *warm[BRUTE_ROWS][BRUTE_COLUMNS][2];
    memset(warm, 0, sizeof warm);
    for (n = 0; n < runs && expect_state.failures < 10; n++) {
        brute b;
        softassign_problem p;
        int kind = (int)support_below(&seed, 9), i, j, m, x[BRUTE_ROWS], capacities = support_below(&seed, 3) == 0,
            least = support_below(&seed, 4) == 0;
        memset(&b, 0, sizeof b);
        memset(&p, 0, sizeof p);
        p.rows = b.rows = 1 + (int)support_below(&seed, BRUTE_ROWS);
        p.columns = b.columns = 1 + (int)support_below(&seed, BRUTE_COLUMNS);
        for (i = 0; i < BRUTE_ROWS * BRUTE_COLUMNS; i++) b.cost[i] = brute_cost(kind, &seed);
        for (i = 1; i < b.rows && support_below(&seed, 8) == 0; i++) /* duplicate rows */
            for (j = 0; j < b.columns; j++) b.cost[i * BRUTE_COLUMNS + j] = b.cost[j];
        for (j = 0; j < b.columns; j++) {
            b.left[j] = capacities ? (int)support_below(&seed, 4) : 1;
            if (least && b.left[j]) b.least[j] = support_below(&seed, 2) ? 0 : (int)support_below(&seed, b.left[j] + 1);
        }
        p.cost = b.cost;
        p.stride = BRUTE_COLUMNS;
        if (capacities) p.capacity = b.left;
        if (least) p.minimum_use = b.least;
        brute_widen(&b);
        brute_walk(&b, 0, 0, 0);
        for (m = SOFTASSIGN_AUTO; m <= SOFTASSIGN_FAST; m++) {
            static const char *const names[3] = {"auto", "exact", "fast"};
            softassign_options o = softassign_method_defaults((softassign_method)m);
            softassign_stats r;
            o.gap = m == SOFTASSIGN_FAST && n % 2 ? 0.05 : 1e-14;
            if (o.gap > 0.01) {
                brute_gap(&b, &p, softassign_solve(x, &p, &o, &r), x, &r, o.gap);
                continue;
            }
            brute_check(&b, &p, softassign_solve(x, &p, &o, &r), x, &r, names[m]);
            if (m == SOFTASSIGN_FAST || least) continue;
            if (!warm[b.rows - 1][b.columns - 1][m])
                EXPECT_EQ(softassign_create(&warm[b.rows - 1][b.columns - 1][m], b.rows, b.columns, &o), SAT_OK);
            softassign_next_frame(warm[b.rows - 1][b.columns - 1][m]);
            brute_check(&b, &p, softassign_step(warm[b.rows - 1][b.columns - 1][m], x, &p, 1000000, &r), x, &r,
                        m ? "warm exact" : "warm auto");
        }
    }
    for (n = 0; n < BRUTE_ROWS * BRUTE_COLUMNS * 2; n++) softassign_destroy((&warm[0][0][0])[n]);
}

/* ---- what once went wrong ---- */

TEST(softassign_minimum_use_on_features_has_a_choice)
{
    enum { N = 1100 };
    static float rows[2 * N], columns[3 * N];
    const float one[1] = {0}, two[2] = {0, 1};
    const int least[2] = {0, 1}, last[3] = {0, 0, 1};
    softassign_problem p;
    softassign_stats r;
    int m, k, x[2];
    for (m = SOFTASSIGN_AUTO; m <= SOFTASSIGN_FAST; m++) {
        softassign_options o = softassign_method_defaults((softassign_method)m);
        memset(&p, 0, sizeof p);
        p.rows = 1, p.columns = 2, p.feature_count = 1;
        p.row_features = one, p.column_features = two, p.minimum_use = least;
        EXPECT_EQ(softassign_solve(x, &p, &o, &r), SAT_OK);
        EXPECT(x[0] == 1 && r.cost >= 1 && r.cost <= 1);
        for (k = 1024; k < N; k++) columns[2 * N + k] = 1000;
        columns[0] = 1;
        p.rows = 2, p.columns = 3, p.feature_count = N;
        p.row_features = rows, p.column_features = columns, p.minimum_use = last;
        EXPECT_EQ(softassign_solve(x, &p, &o, &r), SAT_OK);
        EXPECT(x[0] == 2 || x[1] == 2);
        EXPECT(x[0] == 1 || x[1] == 1);
    }
}

/* A tracker's frames: gated pairs carry a big number, prices are kept from frame to frame. */
TEST(softassign_warm_frames_with_big_gates_are_optimal)
{
    static const float gates[3] = {1e12f, 1e20f, 1e30f};
    enum { N = 40 };
    int g, frame, i, x[N];
    for (g = 0; g < 3; g++) {
        uint64_t seed = 5;
        softassign *s = NULL;
        EXPECT_EQ(softassign_create(&s, N, N, NULL), SAT_OK);
        for (frame = 0; frame < 60; frame++) {
            float cost[N * N];
            softassign_problem p;
            softassign_stats r;
            double best;
            for (i = 0; i < N * N; i++)
                cost[i] = support_uniform(&seed) < 0.85 ? gates[g] : (float)support_uniform(&seed);
            for (i = 0; i < N; i++) cost[i * N + (i * 7 + frame) % N] = (float)support_uniform(&seed);
            memset(&p, 0, sizeof p);
            p.rows = p.columns = N, p.cost = cost, p.stride = N;
            best = (double)reference_optimum(cost, N, N, NULL, NULL);
            if (frame) softassign_next_frame(s);
            EXPECT_EQ(softassign_step(s, x, &p, (size_t)-1 / 4, &r), SAT_OK);
            EXPECT_EQ(r.complete, 1);
            EXPECT_NEAR(r.cost, best, 1e-12 * best);
            EXPECT(r.lower_bound <= r.cost && r.cost - r.lower_bound <= 1e-12 * best);
        }
        softassign_destroy(s);
    }
}

TEST(softassign_costs_that_are_not_used_do_not_spoil_the_proof)
{
    static const float cost[6] = {0.25f, 1e30f, 1e30f, 0.5f, 0.125f, 1e30f}, zero[6] = {0, 1, 2, 1, 0, 2};
    softassign_problem p;
    softassign_stats r;
    int m, x[2];
    memset(&p, 0, sizeof p);
    p.rows = 2, p.columns = 3, p.stride = 3;
    for (m = SOFTASSIGN_AUTO; m <= SOFTASSIGN_FAST; m++) {
        softassign_options o = softassign_method_defaults((softassign_method)m);
        p.cost = cost;
        EXPECT_EQ(softassign_solve(x, &p, &o, &r), SAT_OK);
        EXPECT(r.cost >= 0.375 && r.cost <= 0.375 && r.complete == 1);
        EXPECT(r.lower_bound >= 0.375 * (1 - (m == SOFTASSIGN_FAST ? 1e-3 : 1e-12)));
        p.cost = zero;
        EXPECT_EQ(softassign_solve(x, &p, &o, &r), SAT_OK);
        EXPECT(r.cost >= 0 && r.cost <= 0 && r.gap >= 0 && r.gap <= 0 && r.complete == 1);
    }
}

static int stop_at_once(const softassign_stats *report, const int *x, void *user)
{
    (void)report, (void)x;
    ++*(int *)user;
    return 1;
}

TEST(softassign_a_stopped_method_is_not_complete)
{
    problem q = make_features(80, 8000, 12, 61); /* more than AUTO makes a matrix of, and is done with at once */
    int m, x[80];
    for (m = 0; m < 9; m++) {
        softassign_options o = quick_options(all_methods[m]);
        softassign_stats r;
        int calls = 0;
        o.progress = stop_at_once;
        o.progress_user = &calls;
        o.gap = 1e-7;
        EXPECT_EQ(softassign_solve(x, &q.p, &o, &r), SAT_OK);
        check_solution(&q, x, &r, 1e9);
        EXPECT_EQ(calls, 1);
        EXPECT_EQ(r.complete, 0);
    }
    free_problem(&q);
}

TEST(softassign_stamps_start_again_before_they_overflow)
{
    problem q = make_dense(12, 20, cost_uniform, 3);
    softassign_options o = softassign_method_defaults(SOFTASSIGN_EXACT);
    softassign_stats r;
    softassign *s = NULL;
    int x[12], frame;
    EXPECT_EQ(softassign_create(&s, 12, 20, &o), SAT_OK);
    s->epoch = SOFTASSIGN__LAST_EPOCH - 40;
    for (frame = 0; frame < 20; frame++) {
        softassign_next_frame(s);
        EXPECT_EQ(softassign_step(s, x, &q.p, 1000000, &r), SAT_OK);
        check_solution(&q, x, &r, 0);
    }
    EXPECT(s->epoch < 1000);
    softassign_destroy(s);
    free_problem(&q);
}

/* Closed columns among more than 16 times `neighbours`: every list must still be whole. */
TEST(softassign_closed_columns_leave_lists_whole)
{
    enum { M = 60, NN = 4100, F = 12 };
    float *rows = (float *)malloc(M * F * sizeof(float)), *columns = (float *)malloc(NN * F * sizeof(float)),
          *cost = (float *)malloc((size_t)M * NN * sizeof(float));
    int capacity[NN], x[M], t, i, j, k;
    uint64_t seed = 88;
    for (t = 0; t < 12; t++) {
        int n = 2600 + (int)support_below(&seed, 1500), steps = t % 3;
        double closed = 0.02 + 0.95 * support_uniform(&seed), off = 0.6 * support_uniform(&seed), best;
        softassign_options o = softassign_method_defaults(SOFTASSIGN_EXACT);
        softassign_stats r;
        softassign_problem p;
        memset(&p, 0, sizeof p);
        if (t >= 8) o.neighbours = 4 + t % 4;
        for (i = 0; i < M * F; i++) rows[i] = steps ? (float)support_below(&seed, 3) : (float)support_uniform(&seed);
        for (j = 0; j < n; j++) {
            capacity[j] = t >= 8 || support_uniform(&seed) > closed;
            for (k = 0; k < F; k++)
                columns[j * F + k] =
                    steps ? (float)support_below(&seed, 3) : (float)(support_uniform(&seed) + (capacity[j] ? off : 0));
        }
        for (i = 0; i < M; i++)
            for (j = 0; j < n; j++)
                cost[i * n + j] =
                    capacity[j] ? softassign__distance(rows + i * F, columns + j * F, F) : SOFTASSIGN__INFINITY;
        best = (double)reference_optimum(cost, M, n, NULL, NULL);
        p.rows = M, p.columns = n, p.feature_count = F, p.row_features = rows, p.column_features = columns;
        if (t < 8) p.capacity = capacity;
        EXPECT_EQ(softassign_solve(x, &p, &o, &r), SAT_OK);
        EXPECT_NEAR(r.cost, best, 1e-12 * best);
        EXPECT(r.complete == 1 && r.lower_bound <= best && best - r.lower_bound <= 1e-12 * best);
    }
    free(rows);
    free(columns);
    free(cost);
}

/* ---- options and problems: each row of the table, each sentence ---- */

static inline void set_field(const sat__field *field, softassign_options *o, double value)
{
    sat__field_set(field, o, value);
}

/* Refused by solve and create, and named. */
static inline void check_refused(const softassign_options *o, const char *name)
{
    const float cost[6] = {1, 2, 3, 4, 5, 6};
    softassign_problem p;
    softassign *s = NULL;
    char text[200];
    int x[2];
    memset(&p, 0, sizeof p);
    p.rows = 2;
    p.stride = p.columns = 3;
    p.cost = cost;
    EXPECT_EQ(softassign_solve(x, &p, o, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(softassign_create(&s, 2, 3, o), SAT_ERR_ARGUMENT);
    EXPECT(softassign_explain(text, sizeof text, o) == text && strncmp(text, name, strlen(name)) == 0);
    EXPECT(softassign_explain_problem(text, sizeof text, &p, o) == text && strncmp(text, name, strlen(name)) == 0);
}

TEST(softassign_every_option_is_checked_and_named)
{
    char text[200];
    int i, k;
    for (i = 0; i < SAT__COUNT(softassign__fields); i++) {
        const sat__field *f = &softassign__fields[i];
        softassign_options o = softassign_defaults();
        const double good[3] = {f->low, f->high, f->initial};
        if (f->type == 't' || f->type == 'a') continue;
        for (k = 0; k < 3; k++) {
            o.grid_width = 1; /* min_distance asks for it */
            set_field(f, &o, good[k]);
            EXPECT(softassign_explain(text, sizeof text, &o)[0] == 0);
        }
        if (f->high < 2147483647 || f->type != 'i') {
            set_field(f, &o, f->high + (f->type == 'i' ? 1 : fabs(f->high) * 1e-6));
            check_refused(&o, f->name);
        }
        set_field(f, &o, f->low - (f->type == 'i' ? 1 : fabs(f->low) * 1e-6 + 1e-12));
        check_refused(&o, f->name);
        if (f->type != 'd') continue;
        set_field(f, &o, (double)NAN);
        check_refused(&o, f->name);
    }
    EXPECT(strcmp(softassign_explain(text, sizeof text, NULL), "") == 0);
    EXPECT(softassign_explain(NULL, 0, NULL) == NULL);
}

/* First, last and default of every two options: what explain lets pass is solved, the rest is refused. */
TEST(softassign_corners_of_options_in_pairs)
{
    problem q = make_features(6, 8, 3, 4);
    int a, b, k, wrong = 0, count = SAT__COUNT(softassign__fields) - 2;
    for (a = 0; a < count; a++)
        for (b = a; b < count; b++)
            for (k = 0; k < 9; k++) {
                const sat__field *f = &softassign__fields[a], *g = &softassign__fields[b];
                const double first[3] = {f->low, f->high < 2e9 || f->type == 'd' ? f->high : 3, f->initial};
                const double second[3] = {g->low, g->high < 2e9 || g->type == 'd' ? g->high : 3, g->initial};
                softassign_options o =
                    softassign_method_defaults((softassign_method)((a + b + k) % (SOFTASSIGN_ANTS + 1)));
                softassign_stats r;
                char text[200];
                int x[6], j;
                sat_result result;
                for (j = 0; j < 3; j++) o.iterations[j] = 3;
                set_field(f, &o, first[k / 3]);
                set_field(g, &o, second[k % 3]);
                result = softassign_solve(x, &q.p, &o, &r);
                if (softassign_explain_problem(text, sizeof text, &q.p, &o)[0]) wrong += result != SAT_ERR_ARGUMENT;
                else if (o.capacity_default == 0) wrong += result != SAT_ERR_LIMIT;
                else wrong += result != SAT_OK || !(r.lower_bound <= r.cost);
            }
    EXPECT_EQ(wrong, 0);
    free_problem(&q);
}

TEST(softassign_every_refused_problem_is_named)
{
    const float cost[6] = {1, 2, 3, 4, 5, 6};
    int bad[3] = {1, -1, 1}, less[3] = {0, 2, 0}, stay[2] = {0, 3}, none[3] = {0, 0, 0}, x[2];
    const int starts[3] = {0, 2, 4}, falling[3] = {0, 2, 1}, places[4] = {0, 1, 1, 2}, twice[4] = {1, 1, 0, 2},
              beyond[4] = {0, 1, 1, 3};
    softassign_problem p;
    softassign_options o;
    softassign *s = NULL;
    double price[3];
    char text[200];
#define REFUSED(change, words)                                                                                                   \
    (memset(&p, 0, sizeof p), o = softassign_defaults(), p.rows = 2, p.columns = 3, p.cost = cost, p.stride = 3, (void)(change), \
     EXPECT_EQ(softassign_solve(x, &p, &o, NULL), SAT_ERR_ARGUMENT),                                                             \
     EXPECT(strcmp(softassign_explain_problem(text, sizeof text, &p, &o), words) == 0) ? (void)0 : (void)puts(text))
    REFUSED(p.rows = 0, "rows is 0; 1..2147483647");
    REFUSED(p.columns = -1, "columns is -1; 1..2147483647");
    REFUSED(p.stride = 2, "stride is shorter than a row of the matrix");
    REFUSED(p.cost = NULL, "cost, cost_fn and row_features are NULL");
    REFUSED((p.cost = NULL, p.row_features = cost), "column_features is NULL");
    REFUSED((p.cost = NULL, p.row_features = p.column_features = cost), "feature_count is 0; 1..2147483647");
    REFUSED(p.capacity = bad, "capacity[1] is -1; 0..2147483647");
    REFUSED(p.minimum_use = less, "minimum_use[1] is 2; 0..1");
    REFUSED(p.previous = stay, "previous[1] is 3; -1..2");
    REFUSED(p.maximise = 2, "maximise is 2; 0..1");
    REFUSED(p.unassigned_cost = -1, "unassigned_cost is -1; 0..1e30");
    REFUSED(p.unassigned_cost = NAN, "unassigned_cost is NaN; 0..1e30");
    REFUSED((p.maximise = 1, o.method = SOFTASSIGN_ANTS), "maximise is 1; only AUTO, EXACT and FAST take it");
    REFUSED((p.unassigned_cost = 1, o.method = SOFTASSIGN_GREEDY), "unassigned_cost is above 0; only AUTO, EXACT and FAST take it");
    REFUSED((p.unassigned_cost = 1, o.grid_width = 2, o.min_distance = 2), "unassigned_cost is above 0; min_distance does not go with it");
    REFUSED((p.minimum_use = none, o.method = SOFTASSIGN_GREEDY),
            "minimum_use is given; only AUTO, EXACT and FAST take it");
    REFUSED((p.minimum_use = none, o.row_price = price), "minimum_use is given; row_price and column_price do not go with it");
    REFUSED((o.method = SOFTASSIGN_FAST, o.column_price = price), "row_price or column_price is given; only AUTO and EXACT have them");
    REFUSED((o.method = SOFTASSIGN_FAST, o.row_margin = price), "row_margin is given; only AUTO and EXACT have it");
    REFUSED((o.row_margin = price, o.grid_width = 2, o.min_distance = 2), "row_margin is given; min_distance does not go with it");
    REFUSED((p.minimum_use = none, o.row_margin = price), "minimum_use is given; row_margin does not go with it");
    REFUSED((p.cost = NULL, p.cost_int = none, p.rows = 1, o.method = SOFTASSIGN_PUBLISHED), "cost_double or cost_int is given; ENTROPIC and PUBLISHED read floats");
    REFUSED((p.cost = NULL, p.row_start = starts), "row_start is given; cost, cost_double and cost_int are NULL");
    REFUSED(p.row_start = starts, "row_start is given; column_index is NULL");
    REFUSED((p.row_start = starts + 1, p.column_index = places), "row_start[0] is 2; 0..0");
    REFUSED((p.row_start = falling, p.column_index = places), "row_start[2] is 1; 2..2147483647");
    REFUSED((p.row_start = starts, p.column_index = twice), "column_index[1] is 1; 2..2");
    REFUSED((p.row_start = starts, p.column_index = beyond), "column_index[3] is 3; 2..2");
    REFUSED(o.min_distance = 1, "grid_width is 0; min_distance above 0 needs the grid");
#undef REFUSED
    EXPECT(strcmp(softassign_explain_problem(text, sizeof text, NULL, NULL), "problem is NULL") == 0);
    EXPECT(strcmp(softassign_explain_problem(text, 5, NULL, NULL), "prob") == 0);
    EXPECT(softassign_explain_problem(NULL, 0, &p, NULL) == NULL);
    EXPECT_EQ(softassign_create(&s, 2, 3, NULL), SAT_OK);
    memset(&p, 0, sizeof p);
    p.rows = 2;
    p.stride = p.columns = 3;
    p.cost = cost;
    p.minimum_use = none; /* of softassign_solve only */
    EXPECT_EQ(softassign_step(s, x, &p, 100, NULL), SAT_ERR_ARGUMENT);
    p.minimum_use = NULL;
    EXPECT_EQ(softassign_step(s, x, &p, 1, NULL), SAT_OK);
    p.maximise = 1; /* of the next frame only */
    EXPECT_EQ(softassign_step(s, x, &p, 100, NULL), SAT_ERR_MISMATCH);
    softassign_next_frame(s);
    EXPECT_EQ(softassign_step(s, x, &p, 100, NULL), SAT_OK);
    softassign_destroy(s);
}

/* ---- rows left out, the largest total, dual prices: against enumeration ---- */

/* u_i + v_j <= cost (maximise: >= gain), equal where used, 0 where there is room; together they are worth the
   optimum. */
static inline int prices_are_dual(const brute *b, int columns, const int *x, const double *u, const double *v,
                                  double price, int square, long double optimum)
{
    double scale = price, sum = 0;
    int i, j, ok = 1, used[BRUTE_COLUMNS] = {0};
    for (i = 0; i < b->rows * BRUTE_COLUMNS; i++)
        if (!brute_is_forbidden((double)b->cost[i]) && fabs((double)b->cost[i]) > scale)
            scale = fabs((double)b->cost[i]);
    for (i = 0; i < b->rows; i++) {
        if (x[i] >= 0) used[x[i]]++;
        sum += u[i];
        ok &= price == 0 || u[i] <= price + 1e-12 * scale;
        ok &= x[i] >= 0 || fabs(u[i] - price) <= 1e-12 * scale;
        for (j = 0; j < columns; j++) {
            double off = brute_is_forbidden((double)b->cost[i * BRUTE_COLUMNS + j]) || b->left[j] == 0
                             ? 0
                             : (double)b->cost[i * BRUTE_COLUMNS + j] - u[i] - v[j];
            ok &= off >= -1e-12 * scale && (x[i] != j || off <= 1e-12 * scale);
        }
    }
    for (j = 0; j < columns; j++) {
        sum += b->left[j] * v[j];
        if (!square) ok &= v[j] <= 0 && (v[j] >= 0 || used[j] >= b->left[j] || used[j] == b->rows);
    }
    return ok && fabs(sum - (double)optimum) <= 1e-11 * scale;
}

TEST(softassign_rows_left_out_and_the_largest_total_by_brute_force)
{
    uint64_t seed = 77;
    int n, m, i, j;
    for (n = 0; n < 6000 && expect_state.failures < 10; n++) {
        static const int kinds[] = {0, 1, 3, 4, 6, 8};
        brute b;
        softassign_problem p;
        float given[BRUTE_ROWS * BRUTE_COLUMNS];
        int kind = kinds[support_below(&seed, 6)], capacities = support_below(&seed, 3) == 0,
            optional = support_below(&seed, 3) > 0;
        int maximise = (int)support_below(&seed, 2);
        float price = optional ? (float)(support_uniform(&seed) * (kind == 0 ? 0.8 : kind == 8 ? 4e5 : 4)) + 1e-3f : 0;
        memset(&b, 0, sizeof b);
        memset(&p, 0, sizeof p);
        p.rows = b.rows = 1 + (int)support_below(&seed, BRUTE_ROWS);
        p.columns = 1 + (int)support_below(&seed, BRUTE_COLUMNS - 1);
        b.columns = p.columns + optional;
        for (i = 0; i < BRUTE_ROWS * BRUTE_COLUMNS; i++) {
            float c = brute_cost(kind, &seed);
            given[i] = maximise && brute_is_forbidden((double)c) ? -c : c;
            b.cost[i] = maximise && !brute_is_forbidden((double)c) ? -c : c;
            if (optional && i % BRUTE_COLUMNS == p.columns) b.cost[i] = maximise ? -price : price;
        }
        for (j = 0; j < p.columns; j++) b.left[j] = capacities ? (int)support_below(&seed, 4) : 1;
        if (optional) b.left[p.columns] = p.rows;
        p.cost = given;
        p.stride = BRUTE_COLUMNS;
        p.maximise = maximise;
        p.unassigned_cost = price;
        if (capacities) p.capacity = b.left;
        brute_widen(&b);
        brute_walk(&b, 0, 0, 0);
        for (m = SOFTASSIGN_AUTO; m <= SOFTASSIGN_FAST; m++) {
            softassign_options o = softassign_method_defaults((softassign_method)m);
            softassign_problem with_all = p;
            softassign_stats r;
            double u[BRUTE_ROWS], v[BRUTE_COLUMNS];
            int x[BRUTE_ROWS], y[BRUTE_ROWS];
            sat_result result;
            o.gap = 1e-14;
            if (m != SOFTASSIGN_FAST) {
                o.row_price = u;
                o.column_price = v;
            }
            result = softassign_solve(x, &p, &o, &r);
            for (i = 0; i < p.rows && result == SAT_OK; i++) {
                EXPECT(x[i] >= 0 || optional);
                y[i] = x[i] < 0 ? p.columns : x[i];
            }
            with_all.columns = b.columns;
            if (maximise) {
                r.cost = -r.cost;
                r.lower_bound = -r.lower_bound;
            }
            brute_check(&b, &with_all, result, y, &r, maximise ? "maximise" : "optional");
            if (result != SAT_OK || !b.found || m == SOFTASSIGN_FAST || kind == 3) continue;
            for (i = 0; maximise && i < p.rows; i++) u[i] = -u[i];
            for (j = 0; maximise && j < p.columns; j++) v[j] = -v[j];
            if (maximise && optional) { /* the price is a gain: compare as a shifted problem is no proof, so only the
                                           sums */
                double sum = 0;
                for (i = 0; i < p.rows; i++) sum += u[i];
                for (j = 0; j < p.columns; j++) sum += b.left[j] * v[j];
                EXPECT(fabs(sum - (double)b.best) <= 1e-10 * (1 + (double)b.magnitude));
            } else EXPECT(prices_are_dual(&b, p.columns, x, u, v, (double)price, p.rows == p.columns, b.best));
        }
    }
}

/* ---- costs as floats, doubles and integers, dense and sparse; margins; frames: against enumeration ---- */

typedef struct kinds_of_cost {
    float f[BRUTE_ROWS * 8];
    double d[BRUTE_ROWS * 8];
    int i[BRUTE_ROWS * 8], start[BRUTE_ROWS + 1], index[BRUTE_ROWS * BRUTE_COLUMNS];
} kinds_of_cost;

static double kind_of_number(int kind, uint64_t *seed)
{
    double u = support_uniform(seed);
    switch (kind) { /* what floats do not tell apart */
    case 0: return floor(u * 2147483646);
    case 1: return 1073741824 + support_below(seed, 20);
    case 2: return floor((u - 0.5) * 4294967290.0);
    case 3: return support_below(seed, 3);
    case 4: return 1e9 + ldexp(floor(u * 64), -20);
    case 5: return 1 + ldexp(floor(u * 64), -50);
    case 6: return ldexp(floor(u * 64) - 32, -40) + 7;
    default: return u < 0.3 ? 1e30 : support_uniform(seed);
    }
}

/* Writes one number into all arrays of its form; sparse: those that are forbidden are left out. */
static void state_costs(softassign_problem *p, kinds_of_cost *c, const brute *b, int form, int sparse)
{
    int i, j, n = 0;
    double sign = p->maximise ? -1 : 1;
    for (i = 0; i < p->rows; i++) {
        c->start[i] = n;
        for (j = 0; j < p->columns; j++) {
            double v = b->wide[i * BRUTE_COLUMNS + j];
            int at = sparse ? n : i * 8 + j, forbidden = brute_is_forbidden(v);
            if (sparse && forbidden) continue;
            c->f[at] = (float)(sign * v);
            c->d[at] = sign * v;
            c->i[at] = forbidden ? (sign > 0 ? 2147483647 : -2147483647 - 1) : form == 2 ? (int)(sign * v) : 0;
            c->index[n++] = j;
        }
    }
    c->start[p->rows] = n;
    p->stride = 8;
    if (form == 0) p->cost = c->f;
    if (form == 1) p->cost_double = c->d;
    if (form == 2) p->cost_int = c->i;
    if (!sparse) return;
    p->row_start = c->start;
    p->column_index = c->index;
}

static void check_margins(brute *b, const int *x, const double *margin)
{
    long double best = b->best, used = b->magnitude, magnitude = used;
    int i;
    for (i = 0; i < BRUTE_ROWS * BRUTE_COLUMNS; i++) /* prices are of the size of the largest cost */
        if (i / BRUTE_COLUMNS < b->rows && i % BRUTE_COLUMNS < b->columns && !brute_is_forbidden(b->wide[i]) &&
            fabsl((long double)b->wide[i]) > magnitude)
            magnitude = fabsl((long double)b->wide[i]);
    for (i = 0; i < b->rows; i++) {
        double *cell = &b->wide[i * BRUTE_COLUMNS + x[i]], kept = *cell;
        *cell = (double)SOFTASSIGN__INFINITY;
        b->found = 0;
        brute_walk(b, 0, 0, 0);
        *cell = kept;
        if (!b->found) EXPECT(margin[i] > 1e300);
        else if (!EXPECT(fabsl((long double)margin[i] - (b->best - best)) <= 1e-14L * (magnitude + b->magnitude)))
            printf("row %d: margin %.17g, by enumeration %.17Lg\n", i, margin[i], b->best - best);
    }
    b->found = 1;
    b->best = best;
    b->magnitude = used;
}

/* The sum as doubles hold it, to the last bit but those of adding up. */
static void check_exactly(brute *b, const softassign_problem *p, sat_result result, const int *x, softassign_stats *r,
                          const char *what)
{
    softassign_problem all = *p;
    int i, y[BRUTE_ROWS];
    long double sum = 0;
    for (i = 0; i < p->rows && result == SAT_OK; i++) {
        y[i] = x[i] < 0 ? p->columns : x[i];
        sum += (long double)b->wide[i * BRUTE_COLUMNS + y[i]];
    }
    all.columns = b->columns;
    if (p->maximise) {
        r->cost = -r->cost;
        r->lower_bound = -r->lower_bound;
    }
    brute_check(b, &all, result, y, r, what);
    if (result == SAT_OK && !EXPECT(sum - b->best <= 1e-18L * b->magnitude))
        printf("%s: %.20Lg instead of %.20Lg\n", what, sum, b->best);
}

TEST(softassign_every_kind_of_costs_by_brute_force)
{
    const char *asked = getenv("SOFTASSIGN_BRUTE");
    long runs = asked ? atol(asked) / 2 : 10000, n;
    uint64_t seed = 8;
    softassign *warm[BRUTE_ROWS][BRUTE_COLUMNS][2];
    memset(warm, 0, sizeof warm);
    for (n = 0; n < runs && expect_state.failures < 10; n++) {
        kinds_of_cost c;
        brute b;
        softassign_problem p;
        int kind = (int)support_below(&seed, 8), i, j, m, x[BRUTE_ROWS], capacities = support_below(&seed, 3) == 0;
        int optional = support_below(&seed, 2) == 0, sparse = support_below(&seed, 2) == 0;
        int form = kind == 3 ? (int)support_below(&seed, 3) : kind < 3 ? 1 + (int)support_below(&seed, 2) : 1;
        double price;
        memset(&b, 0, sizeof b);
        memset(&p, 0, sizeof p);
        p.rows = b.rows = 1 + (int)support_below(&seed, BRUTE_ROWS);
        p.columns = 1 + (int)support_below(&seed, BRUTE_COLUMNS - 1);
        p.maximise = kind != 2 && support_below(&seed, 4) == 0;
        b.columns = p.columns + optional;
        price = (double)(float)kind_of_number(kind, &seed);
        if (!(price > 0)) price = 1;
        if (optional) p.unassigned_cost = (float)price;
        for (i = 0; i < BRUTE_ROWS * BRUTE_COLUMNS; i++) {
            double number = kind_of_number(kind, &seed);
            b.wide[i] = support_below(&seed, sparse ? 3 : 20) ? number : (double)SOFTASSIGN__INFINITY;
            if (p.maximise && !brute_is_forbidden(b.wide[i])) b.wide[i] = -b.wide[i];
            if (optional && i % BRUTE_COLUMNS == p.columns) b.wide[i] = p.maximise ? -price : price;
        }
        for (j = 0; j < p.columns; j++) b.left[j] = capacities ? (int)support_below(&seed, 4) : 1;
        if (optional) b.left[p.columns] = p.rows;
        state_costs(&p, &c, &b, form, sparse);
        if (capacities) p.capacity = b.left;
        brute_walk(&b, 0, 0, 0);
        for (m = SOFTASSIGN_AUTO; m <= SOFTASSIGN_FAST; m++) {
            softassign_options o = softassign_method_defaults((softassign_method)m);
            softassign **s = m == SOFTASSIGN_FAST ? NULL : &warm[p.rows - 1][p.columns - 1][m];
            static double margin[BRUTE_ROWS];
            softassign_stats r;
            sat_result result;
            o.gap = 1e-17;
            if (m != SOFTASSIGN_FAST) o.row_margin = margin;
            result = softassign_solve(x, &p, &o, &r);
            check_exactly(&b, &p, result, x, &r, "solve");
            if (m == SOFTASSIGN_FAST) continue;
            for (i = 0; i < p.rows && result == SAT_OK; i++) x[i] = x[i] < 0 ? p.columns : x[i];
            if (result == SAT_OK) check_margins(&b, x, margin);
            if (!*s) EXPECT_EQ(softassign_create(s, p.rows, p.columns, &o), SAT_OK);
            softassign_next_frame(*s);
            result = softassign_step(*s, x, &p, 1000000, &r);
            check_exactly(&b, &p, result, x, &r, "warm");
            for (i = 0; i < p.rows && result == SAT_OK; i++) x[i] = x[i] < 0 ? p.columns : x[i];
            if (result == SAT_OK) check_margins(&b, x, margin);
        }
    }
    for (n = 0; n < BRUTE_ROWS * BRUTE_COLUMNS * 2; n++) softassign_destroy((&warm[0][0][0])[n]);
}

/* The lines of the header. */
TEST(softassign_a_tracker_leaves_far_detections_alone)
{
    enum { TRACKS = 3, DETECTIONS = 2 };
    float distance[TRACKS][DETECTIONS] = {{10, 25}, {12, 90}, {80, 70}};
    int detection_of_track[TRACKS];
    softassign_problem p;
    memset(&p, 0, sizeof p);
    p.rows = TRACKS, p.columns = DETECTIONS;
    p.cost = &distance[0][0], p.stride = DETECTIONS;
    p.unassigned_cost = 30;
    EXPECT_EQ(softassign_solve(detection_of_track, &p, NULL, NULL), SAT_OK);
    EXPECT(detection_of_track[0] == 1 && detection_of_track[1] == 0 && detection_of_track[2] == -1);
    distance[0][1] = SOFTASSIGN__INFINITY; /* 10 + 30 or 12 + 30 */
    EXPECT_EQ(softassign_solve(detection_of_track, &p, NULL, NULL), SAT_OK);
    EXPECT(detection_of_track[0] == 0 && detection_of_track[1] == -1 && detection_of_track[2] == -1);
}

/* Integers near 2^31 in so many rows that a unit is less than the share of the sum that doubles may round. */
TEST(softassign_integers_are_exact_in_large_sums)
{
    enum { PAIRS = 4000, ROWS = 2 * PAIRS };
    int *start = (int *)malloc((ROWS + 1) * sizeof *start), *index = (int *)malloc(2 * ROWS * sizeof *index),
        *cost = (int *)malloc(2 * ROWS * sizeof *cost), *x = (int *)malloc(ROWS * sizeof *x), i, way;
    long long best = 0;
    uint64_t seed = 5;
    softassign_problem p;
    softassign_stats r;
    for (i = 0; i < ROWS; i++) {
        start[i] = 2 * i;
        index[2 * i] = i / 2 * 2;
        index[2 * i + 1] = index[2 * i] + 1;
        cost[2 * i] = 2147483646 - (int)support_below(&seed, 4);
        cost[2 * i + 1] = 2147483646 - (int)support_below(&seed, 4);
    }
    start[ROWS] = 2 * ROWS;
    for (i = 0; i < PAIRS; i++) {
        const int *c = cost + 4 * i;
        long long a = (long long)c[0] + c[3], b = (long long)c[1] + c[2];
        best += a < b ? a : b;
    }
    memset(&p, 0, sizeof p);
    p.rows = p.columns = ROWS;
    p.cost_int = cost, p.row_start = start, p.column_index = index;
    for (way = 0; way < 2; way++) {
        softassign_options o = softassign_method_defaults(way ? SOFTASSIGN_EXACT : SOFTASSIGN_AUTO);
        EXPECT_EQ(softassign_solve(x, &p, &o, &r), SAT_OK);
        EXPECT(r.cost == (double)best && r.complete && r.cost - r.lower_bound < 0.5);
    }
    free(start), free(index), free(cost), free(x);
}

/* Small matrices that other solvers were told about: forbidden pairs where rows are fewer, a row of gates, a transposed
   one, pairs that are nearly equal, no pair at all. */
TEST(softassign_matrices_that_solvers_stumble_over)
{
    const float inf = SOFTASSIGN__INFINITY;
    const float few[6] = {inf, 11, 8, 8, inf, 7},
                gates[16] = {-625,       2187.5f,    -156.25f, 1e6f, -2500, 1e6f, -2500, -2500,
                             -1015.625f, -1015.625f, 1e6f,     1e6f, 1e6f,  1e6f, 1e6f,  1e6f};
    const float four[16] = {9, 7.6f, 7.5f, 7, 3.5f, 8.5f, 5.5f, 6.5f, 12.5f, 9.5f, 9, 10.5f, 4.5f, 11, 9.5f, 11.5f};
    static float equal[60 * 60];
    softassign_problem p;
    softassign_stats r;
    int x[60], i;
    memset(&p, 0, sizeof p);
    p.rows = 2, p.columns = 3, p.cost = few;
    EXPECT_EQ(softassign_solve(x, &p, NULL, &r), SAT_OK);
    EXPECT(r.cost == 16 && x[0] == 2 && x[1] == 0);
    p.rows = p.columns = 4, p.cost = gates;
    EXPECT_EQ(softassign_solve(x, &p, NULL, &r), SAT_OK);
    EXPECT(r.cost == 1e6 - 625 - 2500 - 1015.625 && r.complete && r.gap < 1e-12);
    p.cost = four;
    EXPECT_EQ(softassign_solve(x, &p, NULL, &r), SAT_OK);
    EXPECT_NEAR(r.cost, 7 + 5.5 + 9.5 + 4.5, 1e-6);
    p.rows = 3, p.columns = 2, p.cost = few;
    EXPECT_EQ(softassign_solve(x, &p, NULL, &r), SAT_ERR_LIMIT);
    p.unassigned_cost = 9; /* a row may stay without */
    EXPECT_EQ(softassign_solve(x, &p, NULL, &r), SAT_OK);
    EXPECT(x[0] == -1 && r.cost == 9 + 8 + 7); /* {inf, 11}, {8, 8}, {inf, 7} */
    p.unassigned_cost = 0;
    p.rows = p.columns = 60, p.cost = equal;
    for (i = 0; i < 3600; i++) equal[i] = 1 + (float)(i * 7919 % 3) * 1.1920929e-7f;
    EXPECT_EQ(softassign_solve(x, &p, NULL, &r), SAT_OK);
    EXPECT(r.complete && r.gap < 1e-12 && r.cost >= 60 && r.cost < 60.00001);
    for (i = 0; i < 3600; i++) equal[i] = inf;
    EXPECT_EQ(softassign_solve(x, &p, NULL, &r), SAT_ERR_LIMIT);
    p.unassigned_cost = 2;
    EXPECT_EQ(softassign_solve(x, &p, NULL, &r), SAT_OK);
    EXPECT(r.cost == 120 && x[0] == -1 && x[59] == -1);
}

/* Many rows, features and lists: as a matrix with a column of its own for every row. */
TEST(softassign_rows_left_out_of_larger_problems)
{
    int turn, i, j;
    for (turn = 0; turn < 4; turn++) {
        int rows = 60, columns = turn % 2 ? 2000 : 40, x[60], none = 0;
        problem q = make_features(rows, columns, 5, (uint64_t)turn + 3);
        float *wide = (float *)malloc((size_t)rows * (size_t)(rows + columns) * sizeof *wide),
              price = turn % 2 ? 14 : 40;
        softassign_stats r;
        long double optimum, sum = 0;
        for (i = 0; i < rows; i++)
            for (j = 0; j < columns + rows; j++)
                wide[i * (columns + rows) + j] = j < columns ? q.cost[i * columns + j] : price;
        optimum = reference_optimum(wide, rows, columns + rows, NULL, NULL);
        q.p.unassigned_cost = price;
        if (turn < 2) {
            q.p.cost = q.cost;
            q.p.stride = columns;
        }
        EXPECT_EQ(softassign_solve(x, &q.p, NULL, &r), SAT_OK);
        for (i = 0; i < rows; i++) {
            sum += (long double)(x[i] < 0 ? price : q.cost[i * columns + x[i]]);
            none += x[i] < 0;
        }
        EXPECT_REL(sum, optimum, 1e-6);
        EXPECT(r.complete && r.gap < 1e-12 && none > 0 && fabs(r.cost - (double)sum) < 1e-4 * r.cost);
        free(wide);
        free_problem(&q);
    }
}
