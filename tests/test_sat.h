/* Tests of sat.h on the CPU. References: long double sums of the pixels of each box, one by one. */

/* ---- scans */

static const sat_scan_algorithm scan_algorithms[] = {SAT_SCAN_SEQUENTIAL, SAT_SCAN_RECURSIVE_DOUBLING,
                                                     SAT_SCAN_BALANCED_TREE};
static const int scan_ks[] = {2, 3, 4, 5, 6, 7, 8, 16, 64};
static const size_t scan_sizes[] = {0,  1,  2,  3,  4,   5,   7,   8,   9,   15,   16,  17,
                                    27, 31, 64, 65, 100, 243, 255, 256, 257, 1000, 4099};
enum { SCAN_KS = sizeof scan_ks / sizeof *scan_ks, SCAN_SIZES = sizeof scan_sizes / sizeof *scan_sizes };

static int scan_is_right(size_t n, const sat_scan_options *o, int in_place)
{
    uint32_t *in = (uint32_t *)malloc((n + 1) * 4), *out = (uint32_t *)malloc((n + 1) * 4), sum = 0;
    uint64_t state = n + 1;
    size_t i, wrong = 0;
    for (i = 0; i < n; i++) in[i] = (uint32_t)support_random(&state);
    if (in_place) memcpy(out, in, n * 4);
    if (sat_scan_u32(out, in_place ? out : in, n, o) != SAT_OK) wrong++;
    for (i = 0; i < n; i++) {
        if (!o->exclusive) sum += in[i];
        wrong += out[i] != sum;
        if (o->exclusive) sum += in[i];
    }
    free(in);
    free(out);
    return wrong == 0;
}

TEST(scan_every_algorithm_k_and_length)
{
    int a, k, n, variant;
    for (a = 0; a < 3; a++)
        for (k = 0; k < SCAN_KS; k++)
            for (n = 0; n < SCAN_SIZES; n++)
                for (variant = 0; variant < 4; variant++) {
                    sat_scan_options o = sat_scan_defaults();
                    o.algorithm = scan_algorithms[a];
                    o.k = scan_ks[k];
                    o.exclusive = variant & 1;
                    if (!EXPECT(scan_is_right(scan_sizes[n], &o, variant >> 1)))
                        printf("algorithm %d k %d n %d variant %d\n", a, o.k, (int)scan_sizes[n], variant);
                }
}

TEST(scan_counters_equal_the_closed_formulas)
{
    static const int ks[] = {2, 3, 4, 6, 8};
    uint64_t *values = (uint64_t *)calloc(40000, 8);
    int i;
    for (i = 0; i < 5; i++) {
        size_t k = (size_t)ks[i], m = 0, n = 1, offset, adds = 0, copies = 0, j;
        sat_scan_counters c;
        sat_scan_options o = sat_scan_defaults();
        while (n * k < 40000) {
            n *= k;
            m++;
        }
        o.k = ks[i];
        o.counters = &c;
        o.algorithm = SAT_SCAN_BALANCED_TREE;
        EXPECT_EQ(sat_scan_u64(values, values, n, &o), SAT_OK);
        EXPECT_EQ(c.passes, 2 * m - 1);
        EXPECT_EQ(c.nodes, (n * (k + 1) - 2 * k) / (k - 1)); /* eq 4.33 less the two roots */
        EXPECT_EQ(c.writes, c.nodes);
        EXPECT_EQ(c.copies, 0);
        /* accesses n (k^2/2 + 7k/2 + 1) / (k - 1), smallest at k = 4, up to the top of the tree */
        EXPECT_REL((double)(c.reads + c.writes),
                   (double)n * ((double)(k * k) / 2 + 3.5 * (double)k + 1) / (double)(k - 1), 0.02);

        o.algorithm = SAT_SCAN_RECURSIVE_DOUBLING;
        EXPECT_EQ(sat_scan_u64(values, values, n, &o), SAT_OK);
        EXPECT_EQ(c.passes, m);
        for (offset = 1; offset < n; offset *= k) {
            copies += offset - offset / k; /* 1, then (k-1) k^(i-2) */
            for (j = 1; j < k; j++) adds += n - j * offset;
        }
        EXPECT_EQ(c.copies, copies);
        EXPECT_EQ(c.adds, adds);
        o.algorithm = SAT_SCAN_SEQUENTIAL;
        EXPECT_EQ(sat_scan_u64(values, values, n, &o), SAT_OK);
        EXPECT_EQ(c.adds, n - 1);
    }
    free(values);
}

TEST(scan_types_and_floats)
{
    enum { N = 3000 };
    float *f = (float *)malloc(N * 4), *g = (float *)malloc(N * 4);
    double *d = (double *)malloc(N * 8);
    int32_t *s = (int32_t *)malloc(N * 4);
    int a, i;
    support_fill(f, N, 0, 1, 5);
    for (a = 0; a < 3; a++) {
        long double exact = 0;
        int32_t sum = 0;
        sat_scan_options o = sat_scan_defaults();
        o.algorithm = scan_algorithms[a];
        for (i = 0; i < N; i++) d[i] = (double)f[i], s[i] = i % 7 - 3;
        EXPECT_EQ(sat_scan_f32(g, f, N, &o), SAT_OK);
        EXPECT_EQ(sat_scan_f64(d, d, N, &o), SAT_OK);
        EXPECT_EQ(sat_scan_i32(s, s, N, &o), SAT_OK);
        for (i = 0; i < N; i++) {
            exact += (long double)f[i];
            sum += i % 7 - 3;
            /* depth of the sum: i additions one after the other, else (k - 1) log_k n, twice for the tree */
            EXPECT_REL(g[i], (double)exact, (a == 0 ? i + 1 : 40) * 6e-8);
            EXPECT_REL(d[i], (double)exact, (a == 0 ? i + 1 : 40) * 1.2e-16);
            EXPECT_EQ(s[i], sum);
        }
    }
    free(f);
    free(g);
    free(d);
    free(s);
}

/* 2x2 integer matrices: associative, not commutative */
static void multiply_matrices(void *out, const void *left, const void *right, void *user)
{
    const uint32_t *a = (const uint32_t *)left, *b = (const uint32_t *)right;
    uint32_t *c = (uint32_t *)out;
    c[0] = a[0] * b[0] + a[1] * b[2];
    c[1] = a[0] * b[1] + a[1] * b[3];
    c[2] = a[2] * b[0] + a[3] * b[2];
    c[3] = a[2] * b[1] + a[3] * b[3];
    ++*(size_t *)user;
}

TEST(scan_any_operation_keeps_the_order)
{
    enum { N = 777 };
    static uint32_t in[N][4], out[N][4], expected[N][4];
    const uint32_t identity[4] = {1, 0, 0, 1};
    uint64_t state = 3;
    size_t calls = 0;
    int i, a, k;
    for (i = 0; i < N * 4; i++) in[i / 4][i % 4] = (uint32_t)support_random(&state);
    memcpy(expected[0], in[0], 16);
    for (i = 1; i < N; i++) multiply_matrices(expected[i], expected[i - 1], in[i], &calls);
    for (a = 0; a < 3; a++)
        for (k = 2; k < 10; k++) {
            sat_scan_options o = sat_scan_defaults();
            o.algorithm = scan_algorithms[a];
            o.k = k;
            EXPECT_EQ(sat_scan_any(out, in, N, 16, multiply_matrices, identity, &calls, &o), SAT_OK);
            EXPECT(memcmp(out, expected, sizeof out) == 0);
            o.exclusive = 1;
            EXPECT_EQ(sat_scan_any(out, in, N, 16, multiply_matrices, identity, &calls, &o), SAT_OK);
            EXPECT(memcmp(out[0], identity, 16) == 0 && memcmp(out[1], expected, sizeof out - 16) == 0);
        }
}

TEST(scan_same_bits_for_any_worker_count)
{
    enum { N = 100003 };
    static const int workers[] = {1, 2, 3, 7};
    float *in = (float *)malloc(N * 4), *out = (float *)malloc(N * 4);
    int a, w;
    support_hdr_image(in, N, 1, 1, 9);
    for (a = 1; a < 3; a++) {
        uint64_t hash = 0;
        for (w = 0; w < 8; w++) {
            sat_scan_options o = sat_scan_defaults();
            o.algorithm = scan_algorithms[a];
            o.threads = w < 4 ? support_threads(workers[w]) : support_odd_threads(workers[w - 4]);
            EXPECT_EQ(sat_scan_f32(out, in, N, &o), SAT_OK);
            if (w == 0) hash = support_hash(out, N * 4);
            EXPECT(support_hash(out, N * 4) == hash);
        }
    }
    free(in);
    free(out);
}

TEST(scan_refuses_bad_arguments_and_survives_a_failing_allocator)
{
    float v[4] = {1, 2, 3, 4};
    uint32_t one[8] = {1, 2, 3, 4, 1, 2, 3, 4};
    sat_scan_counters counters;
    size_t products = 0;
    long calls;
    support_memory m;
    sat_scan_options o = sat_scan_defaults();
    EXPECT_EQ(sat_scan_f32(NULL, v, 4, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_scan_f32(v, NULL, 4, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_scan_f32(NULL, NULL, 0, NULL), SAT_OK);
    o.k = 1;
    EXPECT_EQ(sat_scan_f32(v, v, 4, &o), SAT_ERR_ARGUMENT);
    o.k = 65;
    EXPECT_EQ(sat_scan_f32(v, v, 4, &o), SAT_ERR_ARGUMENT);
    o = sat_scan_defaults();
    o.threads.workers = 3;
    EXPECT_EQ(sat_scan_f32(v, v, 4, &o), SAT_ERR_ARGUMENT);
    o = sat_scan_defaults();
    EXPECT_EQ(sat_scan_any(v, v, 4, 0, multiply_matrices, NULL, NULL, &o), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_scan_any(v, v, 4, 4, NULL, NULL, NULL, &o), SAT_ERR_ARGUMENT);
    o.algorithm = SAT_SCAN_BALANCED_TREE;
    o.allocator = support_allocator(&m);
    m.fail_at = 1;
    EXPECT_EQ(sat_scan_f32(v, v, 4, &o), SAT_ERR_MEMORY);
    EXPECT(support_memory_clean(&m));
    m.fail_at = 0;
    EXPECT_EQ(sat_scan_f32(v, v, 4, &o), SAT_OK);
    EXPECT(support_memory_clean(&m));
    EXPECT_NEAR(v[3], 10, 0);
    o.algorithm = SAT_SCAN_SEQUENTIAL; /* allocates nothing, in place, counted and of any type, too */
    o.counters = &counters;
    calls = m.calls;
    EXPECT_EQ(sat_scan_f32(v, v, 4, &o), SAT_OK);
    EXPECT_EQ(sat_scan_any(one, one, 2, 16, multiply_matrices, NULL, &products, &o), SAT_OK);
    EXPECT_EQ(m.calls, calls);
    EXPECT_NEAR(v[3], 20, 0);
    EXPECT(one[4] == 7 && one[5] == 10 && one[6] == 15 && one[7] == 22);
}

TEST(reduction_in_a_fixed_order)
{
    enum { N = 50021 };
    float *v = (float *)malloc(3 * N * 4);
    int k, i;
    support_hdr_image(v, N, 1, 3, 4);
    for (k = 2; k <= 16; k++) {
        long double exact = 0;
        for (i = 0; i < N; i++) exact += (long double)v[3 * i + 1];
        EXPECT_REL(sat_reduce_f32(v + 1, N, 12, k), (double)exact, 17.0 * (k - 1) * 1.2e-16);
        exact = 0;
        for (i = 0; i < N; i++) exact += (long double)v[i];
        EXPECT_REL(sat_reduce_f32(v, N, 4, k), (double)exact, 17.0 * (k - 1) * 1.2e-16);
    }
    EXPECT_NEAR(sat_reduce_f32(v, 0, 4, 4), 0, 0);
    EXPECT_NEAR(sat_reduce_f32(v + 9, 10, -4, 4), sat_reduce_f32(v, 10, 4, 4), 1e-6 * sat_reduce_f32(v, 10, 4, 4));
    free(v);
}

/* ---- tables */

static const sat_kind kinds[] = {SAT_KIND_TILED, SAT_KIND_FLOAT, SAT_KIND_DOUBLE, SAT_KIND_FIXED32};
static const int shapes[][2] = {{1, 1},   {2, 1},   {1, 2},   {1, 300},  {300, 1},  {7, 9},    {8, 8},    {31, 33},
                                {32, 32}, {33, 31}, {64, 65}, {129, 70}, {513, 20}, {20, 521}, {1030, 40}};
enum { SHAPES = sizeof shapes / sizeof *shapes };

/* One value of an image, with the rule for non-finite pixels left out. */
static double pixel(const sat_image *view, int x, int y, int c)
{
    float v = 0;
    if (x < 0 || y < 0 || x >= view->width || y >= view->height) return 0;
    sat__read_row(&v, view, y, x, x + 1, c);
    return (double)v;
}

static double exact_sum(const sat_image *view, int c, int x0, int y0, int x1, int y1)
{
    float row[256];
    long double sum = 0;
    int x, y, i, n;
    x0 = sat__max_int(x0, 0), x1 = sat__min_int(x1, view->width);
    for (y = sat__max_int(y0, 0); y < y1 && y < view->height; y++)
        for (x = x0; x < x1; x += n) {
            n = sat__min_int(x1 - x, 256);
            sat__read_row(row, view, y, x, x + n, c);
            for (i = 0; i < n; i++) sum += (long double)row[i];
        }
    return (double)sum;
}

static void random_box(uint64_t *state, int w, int h, int largest, int box[4])
{
    box[0] = support_below(state, w + 6) - 3;
    box[1] = support_below(state, h + 6) - 3;
    box[2] = box[0] + 1 + support_below(state, largest);
    box[3] = box[1] + 1 + support_below(state, largest);
}

static sat_table *build(const sat_image *view, const sat_options *options)
{
    sat_table *table = NULL;
    EXPECT_EQ(sat_create(&table, view->width, view->height, view->channels, options), SAT_OK);
    if (table) EXPECT_EQ(sat_build(table, view), SAT_OK);
    return table;
}

/* Every random box within the stated bound, and a bit for the double that returns it. */
static void check_boxes(const sat_table *t, const sat_image *view, int boxes, uint64_t seed)
{
    int i, c;
    for (i = 0; i < boxes; i++) {
        int b[4], w, h;
        double exact, area;
        c = i % view->channels;
        random_box(&seed, view->width, view->height, i % 3 ? 12 : 90, b);
        exact = exact_sum(view, c, b[0], b[1], b[2], b[3]);
        w = sat__min_int(b[2], view->width) - sat__max_int(b[0], 0);
        h = sat__min_int(b[3], view->height) - sat__max_int(b[1], 0);
        area = w > 0 && h > 0 ? (double)w * h : 0;
        EXPECT_NEAR(sat_sum(t, c, b[0], b[1], b[2], b[3]), exact,
                    area * sat_error_bound(t, c, w > 0 ? w : 1, h > 0 ? h : 1));
        if (area > 0)
            EXPECT_NEAR(sat_mean(t, c, b[0], b[1], b[2], b[3]), exact / area,
                        1.0001 * sat_error_bound(t, c, w, h) + 1e-300);
        else EXPECT_NEAR(sat_mean(t, c, b[0], b[1], b[2], b[3]), 0, 0);
    }
}

TEST(tables_of_every_kind_shape_and_format)
{
    static unsigned char memory[1030 * 70 * 4 * 4 + 600000];
    int k, s, f, c;
    for (s = 0; s < SHAPES; s++)
        for (f = 0; f < 4; f++)
            for (c = 1; c <= 4; c++) {
                int w = shapes[s][0], h = shapes[s][1], i, n = w * h * c;
                sat_image view;
                uint64_t state = (uint64_t)(s * 17 + f * 5 + c);
                if (c == 2 && f != 0 && f != 3) continue;
                memset(&view, 0, sizeof view);
                view.width = w;
                view.height = h;
                view.channels = c;
                view.format = (sat_format)f;
                view.stride = (ptrdiff_t)((size_t)(w * c) * sat__format_size(view.format));
                if (f == 0) support_hdr_image((float *)(void *)memory, w, h, c, state);
                for (i = 0; i < n; i++) {
                    if (f == 1) memory[i] = (unsigned char)support_random(&state);
                    if (f == 2) ((uint16_t *)(void *)memory)[i] = (uint16_t)support_random(&state);
                    if (f == 3)
                        ((uint16_t *)(void *)memory)[i] = sat__half_from_float((float)(100 * support_gaussian(&state)));
                }
                view.pixels = memory;
                if (s % 2) { /* the same rows upside down in memory */
                    view.pixels = memory + (ptrdiff_t)(h - 1) * view.stride;
                    view.stride = -view.stride;
                }
                for (k = 0; k < 4; k++) {
                    sat_options o = sat_defaults();
                    sat_table *t;
                    o.kind = kinds[k];
                    o.tile = 8 << (s % 5);
                    t = build(&view, &o);
                    if (!t) continue;
                    check_boxes(t, &view, 12, (uint64_t)s);
                    sat_destroy(t);
                }
            }
}

TEST(integer_images_are_exact_in_tiles_and_come_back)
{
    enum { W = 211, H = 97 };
    static uint16_t wide[W * H];
    static uint8_t narrow[W * H];
    uint64_t state = 8;
    int i, bits;
    for (i = 0; i < W * H; i++) {
        wide[i] = (uint16_t)support_random(&state);
        narrow[i] = (uint8_t)support_random(&state);
    }
    for (bits = 8; bits <= 16; bits += 8) {
        sat_options o = sat_defaults();
        sat_image view;
        sat_table *t;
        view.width = W;
        view.height = H;
        view.channels = 1;
        view.format = bits == 8 ? SAT_U8 : SAT_U16;
        view.stride = W * bits / 8;
        view.pixels = bits == 8 ? (const void *)narrow : (const void *)wide;
        o.tile = bits == 8 ? 32 : 128;
        t = build(&view, &o);
        EXPECT(sat_error_bound(t, 0, 9, 9) < 1e-7 && sat_error_bound_box(t, 0, 1, 1, 9, 9) < 1e-7);
        for (i = 0; i < 2000; i++) {
            int b[4];
            random_box(&state, W, H, 100, b);
            EXPECT_NEAR(sat_sum(t, 0, b[0], b[1], b[2], b[3]), exact_sum(&view, 0, b[0], b[1], b[2], b[3]), 0);
            EXPECT_NEAR(sat_restore(t, 0, i % W, i % H), pixel(&view, i % W, i % H, 0), 0);
        }
        EXPECT_NEAR(sat_restore(t, 0, -1, 0), 0, 0);
        sat_destroy(t);
    }
}

TEST(fixed32_wraps_around_and_boxes_stay_exact)
{
    enum { W = 600, H = 500 };
    float *p = (float *)malloc(W * H * 4);
    sat_image view = sat_image_f32(p, W, H, 1);
    sat_options o = sat_defaults();
    sat_table *t;
    uint64_t state = 1;
    int i;
    for (i = 0; i < W * H; i++) p[i] = (float)(support_below(&state, 1 << 20) - (1 << 19)) / 1024.0f;
    o.kind = SAT_KIND_FIXED32;
    o.quantum = 1.0 / 1024;
    o.max_box_area = 41 * 41;
    t = build(&view, &o);
    for (i = 0; i < 3000; i++) {
        int b[4];
        random_box(&state, W, H, 41, b);
        EXPECT_NEAR(sat_sum(t, 0, b[0], b[1], b[2], b[3]), exact_sum(&view, 0, b[0], b[1], b[2], b[3]), 0);
    }
    EXPECT_EQ(sat_get_stats(t).clamped, 0);
    sat_destroy(t);
    o.max_value = 100; /* beyond it: clamped and counted */
    t = build(&view, &o);
    EXPECT(sat_get_stats(t).clamped > 1000);
    EXPECT_NEAR(sat_restore(t, 0, 5, 5), p[5 * W + 5] > 100 ? 100 : p[5 * W + 5] < -100 ? -100 : p[5 * W + 5], 0);
    sat_destroy(t);
    o.max_box_area = 4e9;
    o.quantum = 0;
    EXPECT_EQ(sat_create(&t, W, H, 1, &o), SAT_OK);
    EXPECT_EQ(sat_build(t, &view), SAT_OK); /* no box is larger than the table */
    EXPECT_NEAR(sat_restore(t, 0, 5, 5), p[5 * W + 5] > 100 ? 100 : p[5 * W + 5] < -100 ? -100 : p[5 * W + 5],
                sat_error_bound(t, 0, 1, 1));
    sat_destroy(t);
    free(p);
}

TEST(constant_images_are_exact_in_every_kind)
{
    static float p[150 * 130];
    int k, i;
    for (i = 0; i < 150 * 130; i++) p[i] = 0.75f;
    for (k = 0; k < 4; k++) {
        sat_image view = sat_image_f32(p, 150, 130, 1);
        sat_options o = sat_defaults();
        sat_table *t;
        uint64_t state = 2;
        o.kind = kinds[k];
        t = build(&view, &o);
        for (i = 0; i < 500; i++) {
            int b[4];
            random_box(&state, 150, 130, 140, b);
            if (b[0] < 150 && b[1] < 130 && b[2] > 0 && b[3] > 0)
                EXPECT_NEAR(sat_mean(t, 0, b[0], b[1], b[2], b[3]), 0.75, 0);
            EXPECT_NEAR(
                sat_mean_border(t, 0, b[0] + 0.25, b[1] + 0.5, b[2], b[3] + 0.125, SAT_BORDER_WRAP, SAT_BORDER_MIRROR),
                0.75, 1e-15);
        }
        sat_destroy(t);
    }
}

TEST(dark_boxes_of_high_dynamic_range)
{
    enum { W = 1500, H = 1100, BOXES = 4000 };
    float *p = (float *)malloc((size_t)W * H * 4);
    static double tiled[BOXES], flat[BOXES];
    sat_image view = sat_image_f32(p, W, H, 1);
    sat_options o = sat_defaults();
    sat_table *t, *f;
    uint64_t state = 3;
    int i;
    support_hdr_image(p, W, H, 1, 77);
    t = build(&view, &o);
    o.kind = SAT_KIND_FLOAT;
    f = build(&view, &o);
    for (i = 0; i < BOXES; i++) {
        int x = support_below(&state, W - 3), y = support_below(&state, H - 3);
        double exact = exact_sum(&view, 0, x, y, x + 3, y + 3);
        tiled[i] = fabs(sat_sum(t, 0, x, y, x + 3, y + 3) - exact) / exact;
        flat[i] = fabs(sat_sum(f, 0, x, y, x + 3, y + 3) - exact) / exact;
    }
    EXPECT(support_median(tiled, BOXES) <= 1e-5);
    EXPECT(support_median(flat, BOXES) > 100 * support_median(tiled, BOXES));
    REPORT("tiled 3x3 median relative error", support_median(tiled, BOXES), "");
    REPORT("float 3x3 median relative error", support_median(flat, BOXES), "");
    sat_destroy(t);
    sat_destroy(f);
    free(p);
}

TEST(mean_subtraction_helps_low_contrast)
{
    enum { W = 700, H = 600 };
    float *p = (float *)malloc(W * H * 4);
    sat_image view = sat_image_f32(p, W, H, 1);
    double worst[2] = {0, 0};
    int i, lowered;
    support_fill(p, W * H, 0.9, 1.1, 6);
    for (lowered = 0; lowered < 2; lowered++) {
        sat_options o = sat_defaults();
        sat_table *t;
        uint64_t state = 2;
        o.kind = SAT_KIND_FLOAT;
        o.subtract_mean = lowered;
        t = build(&view, &o);
        check_boxes(t, &view, 300, 5);
        for (i = 0; i < 2000; i++) {
            int x = support_below(&state, W - 5), y = support_below(&state, H - 5);
            double error = fabs(sat_sum(t, 0, x, y, x + 5, y + 5) - exact_sum(&view, 0, x, y, x + 5, y + 5));
            if (error > worst[lowered]) worst[lowered] = error;
        }
        sat_destroy(t);
    }
    EXPECT(worst[1] * 20 < worst[0]);
    free(p);
}

/* ---- real corners and borders, against the definition pixel by pixel */

static double overlap(double a0, double a1, double b0, double b1)
{
    double low = a0 > b0 ? a0 : b0, high = a1 < b1 ? a1 : b1;
    return high > low ? high - low : 0;
}

static int border_index(int i, int n, sat_border border)
{
    if (border == SAT_BORDER_CLAMP) return i < 0 ? 0 : i >= n ? n - 1 : i;
    if (border == SAT_BORDER_WRAP) return ((i % n) + n) % n;
    if (border == SAT_BORDER_MIRROR) {
        i = ((i % (2 * n)) + 2 * n) % (2 * n);
        return i < n ? i : 2 * n - 1 - i;
    }
    return i < 0 || i >= n ? -1 : i;
}

static double exact_border_mean(const sat_image *view, const double b[4], sat_border bx, sat_border by)
{
    long double sum = 0, area = 0;
    int x, y;
    for (y = (int)floor(b[1]) - 1; y < b[3]; y++)
        for (x = (int)floor(b[0]) - 1; x < b[2]; x++) {
            double weight = overlap(b[0], b[2], x, x + 1) * overlap(b[1], b[3], y, y + 1);
            int ix = border_index(x, view->width, bx), iy = border_index(y, view->height, by);
            if ((bx == SAT_BORDER_CLIP && ix < 0) || (by == SAT_BORDER_CLIP && iy < 0)) continue;
            area += (long double)weight;
            if (ix >= 0 && iy >= 0) sum += (long double)weight * (long double)pixel(view, ix, iy, 0);
        }
    return area > 0 ? (double)(sum / area) : 0;
}

TEST(borders_and_real_corners)
{
    static float p[23 * 17];
    static const int sizes[][2] = {{23, 17}, {1, 17}, {23, 1}, {1, 1}, {5, 3}};
    uint64_t state = 12;
    int s, bx, by, i;
    support_fill(p, 23 * 17, 0, 1, 4);
    for (s = 0; s < 5; s++) {
        sat_image view = sat_image_f32(p, sizes[s][0], sizes[s][1], 1);
        sat_options o = sat_defaults();
        sat_table *t;
        o.kind = SAT_KIND_DOUBLE;
        t = build(&view, &o);
        for (bx = 0; bx < 5; bx++)
            for (by = 0; by < 5; by++)
                for (i = 0; i < 40; i++) {
                    double b[4];
                    b[0] = 60 * support_uniform(&state) - 30;
                    b[1] = 60 * support_uniform(&state) - 30;
                    b[2] = b[0] + 50 * support_uniform(&state);
                    b[3] = b[1] + (i % 2 ? 50 : 3) * support_uniform(&state);
                    if (i % 5 == 0) {
                        b[0] = floor(b[0]);
                        b[3] = ceil(b[3]);
                    }
                    EXPECT_NEAR(sat_mean_border(t, 0, b[0], b[1], b[2], b[3], (sat_border)bx, (sat_border)by),
                                exact_border_mean(&view, b, (sat_border)bx, (sat_border)by), 1e-12);
                    EXPECT_NEAR(sat_sum_fractional(t, 0, b[0], b[1], b[2], b[3]),
                                exact_border_mean(&view, b, SAT_BORDER_CLIP, SAT_BORDER_CLIP) *
                                    overlap(b[0], b[2], 0, view.width) * overlap(b[1], b[3], 0, view.height), 1e-10);
                }
        EXPECT_NEAR(sat_mean_border(t, 0, 2, 2, 2, 5, SAT_BORDER_WRAP, SAT_BORDER_WRAP), 0, 0);
        EXPECT_NEAR(sat_mean_border(t, 0, sqrt(-1.0), 2, 3, 5, SAT_BORDER_WRAP, SAT_BORDER_WRAP), 0, 0);
        EXPECT_NEAR(sat_mean_border(t, 0, -1e300, 2, 1e300, 5, SAT_BORDER_WRAP, SAT_BORDER_WRAP), 0, 0);
        EXPECT_REL(sat_mean_border(t, 0, -1e6, -1e6, 1e6, 1e6, SAT_BORDER_WRAP, SAT_BORDER_MIRROR),
                   sat_mean(t, 0, 0, 0, sizes[s][0], sizes[s][1]), 1e-4);
        sat_destroy(t);
    }
}

/* ---- filters and streams */

static float *filtered(const sat_table *t, int w, int h, int c, int radius)
{
    float *out = (float *)malloc((size_t)(w * h * c) * 4);
    EXPECT_EQ(sat_box_filter(out, (ptrdiff_t)((size_t)(w * c) * 4), t, radius), SAT_OK);
    return out;
}

TEST(box_filters_are_the_means_they_promise)
{
    static float p[70 * 50 * 3], radii[70 * 50], out[70 * 50 * 3];
    static const int rs[] = {0, 1, 5, 20, 1000};
    sat_image view = sat_image_f32(p, 70, 50, 3);
    int k, i, x, y, c;
    support_hdr_image(p, 70, 50, 3, 3);
    for (i = 0; i < 70 * 50; i++) radii[i] = (float)(i % 50) * 0.3f - 1;
    radii[0] = sat__float_from_bits(0x7fc00000u);
    radii[1] = 1e30f;
    for (k = 0; k < 4; k++) {
        sat_options o = sat_defaults();
        sat_table *t;
        o.kind = kinds[k];
        t = build(&view, &o);
        for (i = 0; i < 5; i++) {
            float *means = filtered(t, 70, 50, 3, rs[i]);
            for (y = 0; y < 50; y++)
                for (x = 0; x < 70; x++)
                    for (c = 0; c < 3; c++)
                        EXPECT_NEAR(means[(y * 70 + x) * 3 + c],
                                    (float)sat_mean(t, c, x - rs[i], y - rs[i], x + rs[i] + 1, y + rs[i] + 1), 0);
            free(means);
        }
        EXPECT_EQ(sat_box_filter_variable(out, 70 * 12, t, radii, 70 * 4), SAT_OK);
        for (i = 0; i < 70 * 50; i++) {
            double reach = radii[i] > 0 ? (double)radii[i] + 0.5 : 0.5;
            x = i % 70;
            y = i / 70;
            if (i == 1) reach = 120;
            EXPECT_REL(out[i * 3 + 1],
                       sat_mean_border(t, 1, x + 0.5 - reach, y + 0.5 - reach, x + 0.5 + reach, y + 0.5 + reach,
                                       SAT_BORDER_CLIP, SAT_BORDER_CLIP),
                       1e-6);
        }
        EXPECT_EQ(sat_box_filter(out, 70 * 12, t, -1), SAT_ERR_ARGUMENT);
        EXPECT_EQ(sat_box_filter(out, 70 * 12 - 4, t, 1), SAT_ERR_ARGUMENT);
        EXPECT_EQ(sat_box_filter(NULL, 70 * 12, t, 1), SAT_ERR_ARGUMENT);
        EXPECT_EQ(sat_box_filter_variable(out, 70 * 12, t, NULL, 70 * 4), SAT_ERR_ARGUMENT);
        sat_destroy(t);
    }
}

TEST(streams_equal_the_whole_image_bit_for_bit)
{
    enum { W = 140, H = 333 };
    static float p[W * H * 2], row_out[W * 2];
    static const int rs[] = {0, 1, 7, 15, 16, 31, 40, 400};
    sat_image view = sat_image_f32(p, W, H, 2);
    int k, r;
    support_hdr_image(p, W, H, 2, 8);
    p[999] = sat__float_from_bits(0x7fc00000u);
    p[2000] = (float)HUGE_VAL;
    for (k = 0; k < 4; k++)
        for (r = 0; r < 8; r++) {
            sat_options o = sat_defaults();
            sat_table *t;
            sat_stream *s;
            float *whole;
            int y, given = 0, got;
            o.kind = kinds[k];
            o.quantum = kinds[k] == SAT_KIND_FIXED32 ? 4096 : 1e-3;
            if (!sat__is_fixed(o.kind)) o.quantum = 0;
            o.max_value = 1e8;
            o.max_box_area = (2.0 * rs[r] + 1) * (2.0 * rs[r] + 1);
            if (o.kind == SAT_KIND_FIXED32 && rs[r] > 31) continue;
            o.tile = 8 << r % 4;
            t = build(&view, &o);
            whole = filtered(t, W, H, 2, rs[r]);
            if (!EXPECT_EQ(sat_stream_create(&s, W, 2, rs[r], &o), SAT_OK)) return;
            for (y = 0;; y++) {
                sat_image row = sat_image_f32(p + (size_t)(y < H ? y : 0) * W * 2, W, 1, 2);
                EXPECT_EQ(sat_stream_push(s, row_out, &got, y < H ? &row : NULL), SAT_OK);
                if (y >= H && !got) break;
                if (!got) continue;
                if (!EXPECT(memcmp(row_out, whole + (size_t)given * W * 2, sizeof row_out) == 0))
                    printf("kind %d radius %d row %d\n", k, rs[r], given);
                given++;
            }
            EXPECT_EQ(given, H);
            sat_stream_destroy(s);
            sat_destroy(t);
            free(whole);
        }
}

/* ---- workers, updates, bad pixels */

static uint64_t table_hash(const sat_table *t, int w, int h, int c)
{
    uint64_t hash = 1;
    int x, y, i;
    for (i = 0; i < c; i++)
        for (y = 1; y <= h; y += 3)
            for (x = 1; x <= w; x++) {
                double sums[2];
                sums[0] = sat_sum(t, i, 0, 0, x, y);
                sums[1] = sat_sum(t, i, x - 5, y - 4, x, y);
                hash = support_hash_add(hash, sums, sizeof sums);
            }
    return hash;
}

TEST(tables_same_bits_for_any_worker_count)
{
    enum { W = 1100, H = 139 };
    static const int workers[] = {1, 2, 3, 7};
    float *p = (float *)malloc(W * H * 2 * 4);
    int k, w, c;
    support_hdr_image(p, W, H, 2, 8);
    p[777] = -p[777];
    p[W * 100] = sat__float_from_bits(0x7fc00000u);
    for (c = 1; c <= 2; c++)
        for (k = 0; k < 4; k++) {
            uint64_t hash = 0, filter_hash = 0;
            double bound = 0;
            for (w = 0; w < 8; w++) {
                sat_image view = sat_image_f32(p, W, H, c);
                sat_options o = sat_defaults();
                sat_table *t;
                float *out;
                o.kind = kinds[k];
                o.threads = w < 4 ? support_threads(workers[w]) : support_odd_threads(workers[w - 4]);
                t = build(&view, &o);
                out = filtered(t, W, H, c, 4);
                if (w == 0) {
                    hash = table_hash(t, W, H, c);
                    filter_hash = support_hash(out, (size_t)(W * H * c) * 4);
                    bound = sat_error_bound(t, 0, 3, 3);
                }
                EXPECT(table_hash(t, W, H, c) == hash);
                EXPECT(support_hash(out, (size_t)(W * H * c) * 4) == filter_hash);
                EXPECT_NEAR(sat_error_bound(t, 0, 3, 3), bound, 0);
                EXPECT_EQ(sat_get_stats(t).nan, W * 100 < W * H * c ? 1 : 0);
                free(out);
                sat_destroy(t);
            }
        }
    free(p);
}

TEST(updates_equal_fresh_builds)
{
    enum { W = 300, H = 210 };
    static float p[W * H];
    sat_image view = sat_image_f32(p, W, H, 1);
    int k, i;
    for (k = 0; k < 4; k++) {
        sat_options o = sat_defaults();
        sat_table *t, *fresh;
        uint64_t state = 5;
        o.kind = kinds[k];
        o.quantum = sat__is_fixed(o.kind) ? 0.25 : 0;
        o.max_box_area = 90 * 90;
        o.tile = 16;
        support_hdr_image(p, W, H, 1, 8);
        t = build(&view, &o);
        for (i = 0; i < 25; i++) {
            int x0 = support_below(&state, W), y0 = support_below(&state, H), x, y;
            int x1 = sat__min_int(W, x0 + 1 + support_below(&state, 70)),
                y1 = sat__min_int(H, y0 + 1 + support_below(&state, 70));
            for (y = y0; y < y1; y++)
                for (x = x0; x < x1; x++)
                    p[y * W + x] = (float)pow(10, 5 * support_uniform(&state)) * (i % 3 ? 1.0f : -1.0f);
            if (i == 9) p[y0 * W + x0] = sat__float_from_bits(0x7fc00000u);
            EXPECT_EQ(sat_update(t, &view, x0, y0, x1, y1), SAT_OK);
            fresh = build(&view, &o);
            EXPECT(table_hash(t, W, H, 1) == table_hash(fresh, W, H, 1));
            EXPECT_NEAR(sat_error_bound(t, 0, 5, 5), sat_error_bound(fresh, 0, 5, 5), 0);
            sat_destroy(fresh);
        }
        EXPECT_EQ(sat_update(t, &view, 0, 0, 0, 5), SAT_OK);
        EXPECT_EQ(sat_update(t, &view, -1, 0, 5, 5), SAT_ERR_ARGUMENT);
        EXPECT_EQ(sat_update(t, &view, 0, 0, W + 1, 5), SAT_ERR_ARGUMENT);
        sat_destroy(t);
    }
}

TEST(a_bad_pixel_changes_no_box_without_it)
{
    enum { W = 150, H = 120, X = 70, Y = 45 };
    static float p[W * H];
    static const float bad[] = {(float)HUGE_VAL, -(float)HUGE_VAL, 3e38f, -3e38f};
    int k, b, i;
    for (k = 0; k < 4; k++)
        for (b = 0; b < 5; b++) {
            float value = b < 4 ? bad[b] : sat__float_from_bits(0x7fc00000u);
            sat_image view = sat_image_f32(p, W, H, 1);
            sat_options o = sat_defaults();
            sat_table *t, *without;
            sat_stats s;
            uint64_t state = 4;
            o.kind = kinds[k];
            if (sat__is_fixed(o.kind)) o.max_value = 1e6;
            support_fill(p, W * H, 0, 1000, 9);
            p[Y * W + X] = 0;
            without = build(&view, &o);
            p[Y * W + X] = value;
            t = build(&view, &o);
            s = sat_get_stats(t);
            EXPECT_EQ(s.nan, b == 4 ? 1 : 0);
            EXPECT_EQ(s.infinite, b < 2 ? 1 : 0);
            for (i = 0; i < 3000; i++) {
                int box[4];
                double got, expected;
                random_box(&state, W, H, i % 2 ? 9 : 60, box);
                if (X >= box[0] && X < box[2] && Y >= box[1] && Y < box[3]) continue;
                got = sat_sum(t, 0, box[0], box[1], box[2], box[3]);
                expected = sat_sum(without, 0, box[0], box[1], box[2], box[3]);
                if (b == 4 || sat__is_fixed(o.kind) || o.kind == SAT_KIND_TILED) EXPECT_NEAR(got, expected, 0);
                else EXPECT(fabs(got) < 1e39 && got - got <= 0); /* the flat kinds promise no more: finite */
            }
            sat_destroy(t);
            o.non_finite = SAT_NON_FINITE_REFUSE;
            EXPECT_EQ(sat_create(&t, W, H, 1, &o), SAT_OK);
            EXPECT_EQ(sat_build(t, &view), b == 4 || b < 2 ? SAT_ERR_NON_FINITE : SAT_OK);
            if (b == 4 || b < 2) {
                EXPECT_NEAR(sat_sum(t, 0, 0, 0, W, H), 0, 0);
                p[Y * W + X] = 1;
                EXPECT_EQ(sat_update(t, &view, X, Y, X + 1, Y + 1), SAT_OK);
                EXPECT_REL(sat_sum(t, 0, 0, 0, W, H), sat_sum(without, 0, 0, 0, W, H) + 1, 1e-5);
            }
            sat_destroy(t);
            sat_destroy(without);
        }
}

/* A table whose error stays where it is made: what users reported of others, and of this one's strips. */
static int boxes_off(const sat_table *t, const float *p, int w, int h, int r, double tolerance, int with_x, int with_y,
                     int *negative)
{
    int x, y, a, b, off = 0;
    for (y = r; y < h - r; y++)
        for (x = r; x < w - r; x++) {
            double exact = 0, got = sat_mean(t, 0, x - r, y - r, x + r + 1, y + r + 1);
            if (abs(x - with_x) <= r && abs(y - with_y) <= r) continue;
            for (b = -r; b <= r; b++)
                for (a = -r; a <= r; a++) exact += (double)p[(y + b) * w + x + a] / ((2 * r + 1) * (2 * r + 1));
            if (!(fabs(got - exact) <= tolerance * exact)) off++;
            if (negative && got < 0) ++*negative;
        }
    return off;
}

TEST(bright_pixels_change_no_mean_beside_them)
{
    enum { W = 512, H = 512 };
    static float p[W * H];
    sat_image view = sat_image_f32(p, W, H, 1);
    static const float bad[] = {(float)HUGE_VAL, 1e30f, 1e8f, 3e38f};
    uint64_t state = 1;
    sat_table *t;
    int i, negative = 0;
    for (i = 0; i < W * H; i++) p[i] = (float)(1e-4 + 1e-4 * support_uniform(&state));
    for (i = 0; i < 20; i++) p[support_below(&state, W * H)] = 6e4f;
    t = build(&view, NULL);
    EXPECT_EQ(boxes_off(t, p, W, H, 1, 0.01, -99, -99, &negative), 0);
    EXPECT_EQ(negative, 0);
    sat_destroy(t);
    view = sat_image_f32(p, 300, 200, 1);
    for (i = 0; i < 4; i++) {
        int j;
        for (j = 0; j < 300 * 200; j++) p[j] = 1;
        p[100 * 300 + 150] = i ? bad[i] : sat__float_from_bits(0x7f800000u);
        t = build(&view, NULL);
        EXPECT_EQ(boxes_off(t, p, 300, 200, 4, 1e-9, 150, 100, NULL), 0);
        sat_destroy(t);
    }
}

TEST(skies_of_any_sentinel_leave_the_ground_alone)
{
    enum { W = 256, H = 256, R = 4 };
    static float p[W * H];
    sat_image view = sat_image_f32(p, W, H, 1);
    static const float skies[] = {1e6f, 1e10f, 3.4028235e38f, 0};
    int s, x, y, a, b;
    for (s = 0; s < 4; s++) {
        uint64_t state = 2;
        sat_table *t;
        double worst = 0;
        for (y = 0; y < H; y++)
            for (x = 0; x < W; x++)
                p[y * W + x] = y < 60 + x / 8 ? (s < 3 ? skies[s] : sat__float_from_bits(0x7f800000u))
                                              : (float)(1 + 0.001 * (H - y) + 0.01 * support_uniform(&state));
        t = build(&view, NULL);
        for (y = R; y < H - R; y++)
            for (x = R; x < W - R; x++) {
                double exact = 0;
                if (y - R < 60 + (x + R) / 8) continue;
                for (b = -R; b <= R; b++)
                    for (a = -R; a <= R; a++) exact += (double)p[(y + b) * W + x + a] / 81;
                worst = fmax(worst, fabs(sat_mean(t, 0, x - R, y - R, x + R + 1, y + R + 1) - exact) / exact);
            }
        if (!EXPECT(worst <= 1e-5)) printf("sky %g: %g\n", (double)skies[s], worst);
        sat_destroy(t);
    }
}

TEST(fourteen_smooth_decades)
{
    enum { N = 1024, BOXES = 20000 };
    static const int radii[] = {0, 1, 5, 20, 100};
    float *p = (float *)malloc(sizeof(float) * N * N);
    double *errors = (double *)malloc(sizeof(double) * BOXES);
    sat_image view = sat_image_f32(p, N, N, 1);
    uint64_t state = 3;
    sat_table *t;
    int x, y, i, r;
    for (y = 0; y < N; y++)
        for (x = 0; x < N; x++) {
            double e = 7 * sin(x * 0.0031 + 1.3 * sin(y * 0.0017)) * cos(y * 0.0023 + 0.7) + 1 +
                       0.6 * (support_uniform(&state) - 0.5);
            p[y * N + x] = (float)fmin(fmax(pow(10, e), 1e-6), 1e8);
        }
    t = build(&view, NULL);
    for (r = 0; r < 5; r++) {
        int side = 2 * radii[r] + 1, boxes = r < 4 ? BOXES : 200;
        for (i = 0; i < boxes; i++) {
            int x0 = support_below(&state, N - side), y0 = support_below(&state, N - side);
            double exact = exact_sum(&view, 0, x0, y0, x0 + side, y0 + side);
            errors[i] = fabs(sat_sum(t, 0, x0, y0, x0 + side, y0 + side) - exact) / exact;
        }
        qsort(errors, (size_t)boxes, sizeof *errors, support_compare_doubles);
        printf("side %d: p99 %.2g max %.2g\n", side, errors[boxes * 99 / 100], errors[boxes - 1]);
        if (r == 1) {
            EXPECT(errors[boxes * 99 / 100] <= 5e-6);
            EXPECT(errors[boxes - 1] < 5e-5);
        } else EXPECT(errors[boxes - 1] < 1e-3);
    }
    sat_destroy(t);
    free(p);
    free(errors);
}

/* Light that changes by four decades within 64 pixels, in patches of 128: tiles of 64 are up to 1 off here. */
TEST(fourteen_rough_decades)
{
    enum { N = 1024, BOXES = 20000, G = N / 128 + 2 };
    float *p = (float *)malloc(sizeof(float) * N * N), grid[G * G];
    double *errors = (double *)malloc(sizeof(double) * BOXES);
    sat_image view = sat_image_f32(p, N, N, 1);
    uint64_t state = 88172645463325252u;
    sat_table *t;
    int x, y, i;
    for (i = 0; i < G * G; i++) grid[i] = (float)(1 + 2.4 * support_gaussian(&state));
    for (y = 0; y < N; y++)
        for (x = 0; x < N; x++) {
            const float *g = grid + y / 128 * G + x / 128;
            double fx = x % 128 / 128.0, fy = y % 128 / 128.0;
            double level = (1 - fy) * ((1 - fx) * (double)g[0] + fx * (double)g[1]) +
                           fy * ((1 - fx) * (double)g[G] + fx * (double)g[G + 1]);
            p[y * N + x] = (float)fmin(fmax(pow(10, level * 1.3 + 0.15 * support_gaussian(&state)), 1e-6), 1e8);
        }
    t = build(&view, NULL);
    for (i = 0; i < BOXES; i++) {
        int x0 = support_below(&state, N - 3), y0 = support_below(&state, N - 3);
        double exact = exact_sum(&view, 0, x0, y0, x0 + 3, y0 + 3);
        errors[i] = fabs(sat_sum(t, 0, x0, y0, x0 + 3, y0 + 3) - exact) / exact;
    }
    qsort(errors, BOXES, sizeof *errors, support_compare_doubles);
    EXPECT(errors[BOXES * 99 / 100] <= 5e-6);
    EXPECT(errors[BOXES - 1] < 5e-5);
    sat_destroy(t);
    free(p);
    free(errors);
}

TEST(large_boxes_across_super_tiles)
{
    enum { W = 2300, H = 1200 };
    uint16_t *p = (uint16_t *)malloc(sizeof *p * W * H);
    sat_image view = sat_image_f32(NULL, W, H, 1);
    uint64_t state = 8, exact[2];
    int i, x, y, tile;
    for (i = 0; i < W * H; i++) p[i] = (uint16_t)support_random(&state);
    view.pixels = p;
    view.format = SAT_U16;
    view.stride = W * 2;
    for (tile = 8; tile <= 128; tile *= 2) {
        sat_options o = sat_defaults();
        sat_table *t;
        o.tile = tile;
        t = build(&view, &o);
        for (i = 0; i < 12; i++) {
            int x0 = support_below(&state, W / 2), y0 = support_below(&state, H / 2),
                x1 = x0 + 1 + support_below(&state, W / 2), y1 = y0 + 1 + support_below(&state, H / 2);
            exact[0] = 0;
            for (y = y0; y < y1; y++)
                for (x = x0; x < x1; x++) exact[0] += p[y * W + x];
            EXPECT_NEAR(sat_sum(t, 0, x0, y0, x1, y1), (double)exact[0], 0); /* 16 bits are exact */
        }
        sat_destroy(t);
    }
    free(p);
}

TEST(a_column_of_pixels_takes_few_bytes)
{
    sat_table *t = NULL;
    EXPECT_EQ(sat_create(&t, 1, 100000, 1, NULL), SAT_OK);
    REPORT("bytes a pixel of a 1 x 100000 table", (double)sat_get_stats(t).bytes / 100000, "bytes");
    EXPECT(sat_get_stats(t).bytes < 100000 * 30);
    sat_destroy(t);
}

TEST(extreme_floats_keep_finite_sums)
{
    enum { W = 400, H = 300 };
    static float p[W * H];
    sat_image view = sat_image_f32(p, W, H, 1);
    int k, i, pattern;
    for (pattern = 0; pattern < 4; pattern++)
        for (k = 0; k < 4; k++) {
            sat_options o = sat_defaults();
            sat_table *t;
            uint64_t state = 6;
            for (i = 0; i < W * H; i++) {
                double sign = support_uniform(&state) < 0.5 ? -1 : 1, exponent = 76 * support_uniform(&state) - 38;
                p[i] = pattern == 0   ? 3.4e38f
                       : pattern == 1 ? (float)(sign * 1.7 * pow(10, exponent))
                       : pattern == 2 ? 1e-44f
                                      : (float)(sign * 3.4e38);
            }
            o.kind = kinds[k];
            t = build(&view, &o);
            for (i = 0; i < 500; i++) {
                int b[4];
                double sum;
                random_box(&state, W, H, 80, b);
                sum = sat_sum(t, 0, b[0], b[1], b[2], b[3]);
                EXPECT(sat__is_finite_double(sum));
                if (pattern == 2 && !sat__is_fixed(o.kind) && !support_subnormals_flushed())
                    EXPECT_NEAR(sum, exact_sum(&view, 0, b[0], b[1], b[2], b[3]), 1e-44);
            }
            sat_destroy(t);
        }
}

TEST(real_pictures_with_nan_infinity_and_every_half)
{
    static const char *const names[] = {"hdr/BrightRingsNanInf.exr", "hdr/AllHalfValues.exr", "hdr/WideFloatRange.exr",
                                        "hdr/Desk.exr"};
    int i, k;
    for (i = 0; i < 4; i++) {
        const char *path = support_data(names[i]);
        image picture;
        if (!path) SKIP("needs hdr/*.exr in ../shared/data or $LIGHTSCAN_DATA");
        if (!image_load(&picture, path)) SKIP("needs libopenexr-dev");
        for (k = 0; k < 4; k++) {
            sat_image view = sat_image_f32(picture.pixels, picture.width, picture.height, picture.channels);
            sat_options o = sat_defaults();
            sat_table *t;
            double sum;
            o.kind = kinds[k];
            t = build(&view, &o);
            sum = sat_sum(t, 0, 0, 0, view.width, view.height);
            EXPECT(sat__is_finite_double(sum));
            if (i == 0) EXPECT(sat_get_stats(t).nan + sat_get_stats(t).infinite > 0);
            sat_destroy(t);
        }
        image_free(&picture);
    }
}

/* ---- bounds and plans */

enum { BOUND_W = 640, BOUND_H = 480, BOUND_IMAGES = 4, BOUND_BOXES = 5 };

static void bound_image(float *p, int which)
{
    uint64_t state = 99;
    int i;
    if (which == 1) support_hdr_image(p, BOUND_W, BOUND_H, 1, 5);
    else
        for (i = 0; i < BOUND_W * BOUND_H; i++)
            p[i] = (float)(which == 3 ? support_gaussian(&state) : support_uniform(&state));
    if (which == 2) p[BOUND_W * 100 + 200] = 1e8f;
}

TEST(error_bounds_hold_and_the_expected_error_is_near)
{
    static float p[BOUND_W * BOUND_H];
    static const int boxes[BOUND_BOXES] = {1, 3, 11, 41, 201};
    int which, k, b, i;
    for (which = 0; which < BOUND_IMAGES; which++) {
        bound_image(p, which);
        for (k = 0; k < 4; k++) {
            sat_image view = sat_image_f32(p, BOUND_W, BOUND_H, 1);
            sat_options o = sat_defaults();
            sat_table *t;
            o.kind = kinds[k];
            t = build(&view, &o);
            for (b = 0; b < BOUND_BOXES; b++) {
                uint64_t state = 7;
                int n = boxes[b] > 100 ? 60 : 600;
                double squares = 0, worst = 0, rms;
                for (i = 0; i < n; i++) {
                    int x = support_below(&state, BOUND_W - boxes[b]), y = support_below(&state, BOUND_H - boxes[b]);
                    double area = (double)boxes[b] * boxes[b];
                    double e = fabs(sat_sum(t, 0, x, y, x + boxes[b], y + boxes[b]) -
                                    exact_sum(&view, 0, x, y, x + boxes[b], y + boxes[b])) /
                               area;
                    squares += e * e;
                    if (e > worst) worst = e;
                }
                rms = sqrt(squares / n);
                EXPECT(worst <= sat_error_bound(t, 0, boxes[b], boxes[b]));
                if (which < 2 && kinds[k] != (which ? SAT_KIND_FIXED32 : SAT_KIND_DOUBLE) && rms > 0) {
                    double ratio = sat_error_rms(t, 0, boxes[b], boxes[b]) / rms;
                    if (!EXPECT(ratio > 1.0 / 4 && ratio < 4))
                        printf("image %d kind %d box %d ratio %g\n", which, k, boxes[b], ratio);
                }
            }
            sat_destroy(t);
        }
    }
}

/* The bound of a very box: never below its error, and not raised by what lies in other tiles. */
TEST(the_bound_of_a_box_is_that_of_its_own_tiles)
{
    static float p[BOUND_W * BOUND_H];
    int which, k, i;
    for (which = 0; which < BOUND_IMAGES; which++)
        for (k = 0; k < 4; k++) {
            sat_image view = sat_image_f32(p, BOUND_W, BOUND_H, 1);
            sat_options o = sat_defaults();
            sat_table *t;
            uint64_t state = 11;
            bound_image(p, which);
            if (which == 1) p[1000] = 1e15f, p[77777] = (float)HUGE_VAL;
            o.kind = kinds[k];
            t = build(&view, &o);
            for (i = 0; i < 400; i++) {
                int b[4];
                double exact, bound;
                random_box(&state, BOUND_W, BOUND_H, i % 4 ? 20 : 300, b);
                b[0] = sat__max_int(b[0], 0), b[1] = sat__max_int(b[1], 0);
                b[2] = sat__min_int(b[2], BOUND_W), b[3] = sat__min_int(b[3], BOUND_H);
                if (b[2] <= b[0] || b[3] <= b[1]) continue;
                if (which == 1 && ((b[1] < 1 + 1000 / BOUND_W && b[3] > 1000 / BOUND_W) || k)) continue;
                if (which == 1 && b[1] <= 77777 / BOUND_W && b[3] > 77777 / BOUND_W) continue;
                exact = exact_sum(&view, 0, b[0], b[1], b[2], b[3]) / ((double)(b[2] - b[0]) * (b[3] - b[1]));
                bound = sat_error_bound_box(t, 0, b[0], b[1], b[2], b[3]);
                EXPECT_NEAR(sat_mean(t, 0, b[0], b[1], b[2], b[3]), exact, bound + fabs(exact) * 3e-16);
                EXPECT(bound <= 1.0001 * sat_error_bound(t, 0, b[2] - b[0], b[3] - b[1]) || k == 0);
                if (which == 0 && k == 0 && b[2] - b[0] < 60 && b[3] - b[1] < 60) EXPECT(bound <= 3e-6);
            }
            EXPECT_NEAR(sat_error_bound_box(t, 0, 5, 5, 5, 9) + sat_error_bound_box(t, 1, 0, 0, 9, 9), 0, 0);
            sat_destroy(t);
        }
    EXPECT_NEAR(sat_error_bound_box(NULL, 0, 0, 0, 9, 9), 0, 0);
}

TEST(many_sums_at_once_are_the_single_ones)
{
    enum { W = 1500, H = 1200, N = 3000 };
    static int boxes[4 * N];
    static double out[N];
    float *p = (float *)malloc(sizeof(float) * W * H);
    sat_image view = sat_image_f32(p, W, H, 1);
    int k, i;
    uint64_t state = 5;
    if (!p) return;
    support_hdr_image(p, W, H, 1, 8);
    p[W * 300 + 700] = (float)HUGE_VAL;
    for (i = 0; i < N; i++) random_box(&state, W, H, i % 3 == 0 ? 3 : i % 3 == 1 ? 60 : 1100, boxes + 4 * i);
    for (k = 0; k < 5; k++) {
        sat_options o = sat_defaults();
        sat_table *t;
        sat_view loop;
        o.kind = kinds[k % 4];
        if (k == 4) o.tile = 8;
        t = build(&view, &o);
        sat_sums(out, t, 0, boxes, N);
        EXPECT(sat_get_view(&loop, t, 0) == SAT_OK);
        for (i = 0; i < N; i++) {
            const int *b = boxes + 4 * i;
            double one = sat_sum(t, 0, b[0], b[1], b[2], b[3]);
            EXPECT(memcmp(&one, &out[i], sizeof one) == 0);
            if (b[0] < 0 || b[1] < 0 || b[0] >= b[2] || b[1] >= b[3] || b[2] > W || b[3] > H) continue;
            one = sat_view_sum(&loop, b[0], b[1], b[2], b[3]);
            EXPECT(memcmp(&one, &out[i], sizeof one) == 0);
        }
        EXPECT(sat_get_view(&loop, t, 1) == SAT_ERR_ARGUMENT && sat_get_view(NULL, t, 0) == SAT_ERR_ARGUMENT);
        EXPECT(sat_get_view(&loop, NULL, 0) == SAT_ERR_ARGUMENT && sat_get_view(&loop, t, -1) == SAT_ERR_ARGUMENT);
        sat_sums(out, t, 1, boxes, 2);
        EXPECT_NEAR(out[0] + out[1], 0, 0);
        sat_sums(NULL, t, 0, boxes, 2);
        sat_sums(out, t, 0, NULL, 2);
        sat_destroy(t);
    }
    out[0] = 7;
    sat_sums(out, NULL, 0, boxes, 1);
    EXPECT_NEAR(out[0], 0, 0);
    free(p);
}

/* A table of 5 x 5 tiles with spikes, a giant and a tile of many bright pixels; the view was had before the build. */
TEST(every_box_of_a_small_table_is_its_pixels)
{
    enum { N = 37 };
    float p[N * N];
    sat_image picture = sat_image_f32(p, N, N, 1);
    sat_options o = sat_defaults();
    sat_table *t;
    sat_view view;
    int i, x0, y0, x1, y1;
    o.tile = 8;
    if (!EXPECT(sat_create(&t, N, N, 1, &o) == SAT_OK && sat_get_view(&view, t, 0) == SAT_OK)) return;
    for (i = 0; i < N * N; i++) p[i] = (float)(i * 7 % 100);
    p[3 * N + 4] = 1048576;
    p[9 * N + 20] = 1e25f;
    for (i = 0; i < 8; i++) p[(17 + i) * N + i] = 1048576.0f * (float)(1 << i);
    EXPECT(sat_build(t, &picture) == SAT_OK);
    for (y0 = 0; y0 < N; y0++)
        for (x0 = 0; x0 < N; x0++)
            for (y1 = y0 + 1; y1 <= N; y1 += 1 + (y1 > y0 + 3) * 4)
                for (x1 = x0 + 1; x1 <= N; x1 += 1 + (x1 > x0 + 3) * 4) {
                    double sum = 0, got = sat_view_sum(&view, x0, y0, x1, y1);
                    int x, y;
                    for (y = y0; y < y1; y++)
                        for (x = x0; x < x1; x++) sum += (double)p[y * N + x];
                    if (!EXPECT(fabs(got - sum) <= 1e-12 * sum)) {
                        sat_destroy(t);
                        return;
                    }
                }
    sat_destroy(t);
}

/* opencv#20162: squares of 8 bits in 32 bits. */
TEST(fixed32_reads_constant_images_exactly)
{
    enum { N = 1024 };
    float *p = (float *)malloc(sizeof(float) * N * N);
    uint16_t *q = (uint16_t *)malloc(sizeof(uint16_t) * N * N);
    static const float values[] = {65025, 0.1f, 3.1415927f, 1e-20f, 77777};
    int v, i;
    for (v = 0; v < 5 && p && q; v++) {
        sat_image view = sat_image_f32(p, N, N, 1);
        sat_options o = sat_defaults();
        sat_table *t;
        for (i = 0; i < N * N; i++) p[i] = values[v], q[i] = 65025;
        o.kind = SAT_KIND_FIXED32;
        if (v == 4) {
            view.pixels = q, view.format = SAT_U16, view.stride = N * 2;
            p[0] = 65025;
        }
        t = build(&view, &o);
        EXPECT_NEAR(sat_restore(t, 0, 5, 5), p[0], 0);
        EXPECT_NEAR(sat_mean(t, 0, 0, 0, N, N), (double)p[0], 1e-15 * (double)p[0]);
        EXPECT_NEAR(sat_mean(t, 0, 3, 4, 500, 777), (double)p[0], 1e-15 * (double)p[0]);
        EXPECT_EQ(sat_get_stats(t).clamped, 0);
        if (v == 4) { /* a brighter frame fits, too */
            for (i = 0; i < N * N; i++) q[i] = 65535;
            EXPECT_EQ(sat_build(t, &view), SAT_OK);
            EXPECT_EQ(sat_get_stats(t).clamped, 0);
        }
        sat_destroy(t);
    }
    free(p);
    free(q);
}

/* Pixels that no sum of floats can hold are clamped in a stream as in a whole image. */
/* A column of pixels: the box counts with the pixels it has, or 7 would come out as 5. */
TEST(narrow_streams_of_integers_keep_their_pixels)
{
    const float pixels[2] = {7, 1e5f};
    int i, n, k;
    for (i = 0; i < 2; i++) {
        sat_image view = sat_image_f32(&pixels[i], 1, 1, 1);
        sat_options o = sat_defaults();
        sat_stream *s;
        float out = 0;
        o.kind = SAT_KIND_FIXED32;
        o.quantum = 1;
        o.max_value = 1e5;
        if (!EXPECT_EQ(sat_stream_create(&s, 1, 1, 10000, &o), SAT_OK)) continue;
        EXPECT_EQ(sat_stream_push(s, &out, &n, &view), SAT_OK);
        for (k = 0; k < 3 && !n; k++) EXPECT_EQ(sat_stream_push(s, &out, &n, NULL), SAT_OK);
        EXPECT_NEAR(out, pixels[i], 0);
        sat_stream_destroy(s);
    }
}

TEST(streams_of_huge_pixels_equal_the_whole_image)
{
    enum { W = 90, H = 70 };
    static float p[W * H], row_out[W];
    int k, i, signs;
    for (signs = 0; signs < 2; signs++)
        for (k = 0; k < 4; k++) {
            sat_image view = sat_image_f32(p, W, H, 1);
            sat_options o = sat_defaults();
            sat_table *t;
            sat_stream *s;
            float *whole;
            int y, given = 0, got;
            if (sat__is_fixed(kinds[k])) continue;
            for (i = 0; i < W * H; i++) p[i] = signs && i % 3 == 0 ? -1.0f : 1.0f;
            p[40 * W + 9] = 1e33f, p[40 * W + 10] = 3.4e38f, p[3] = 4e35f, p[50 * W] = signs ? -3e38f : 2e29f;
            o.kind = kinds[k];
            t = build(&view, &o);
            if (o.kind == SAT_KIND_FLOAT) EXPECT_EQ(sat_get_stats(t).clamped, 4);
            whole = filtered(t, W, H, 1, 2);
            if (!EXPECT_EQ(sat_stream_create(&s, W, 1, 2, &o), SAT_OK)) return;
            for (y = 0;; y++) {
                sat_image row = sat_image_f32(p + (size_t)(y < H ? y : 0) * W, W, 1, 1);
                EXPECT_EQ(sat_stream_push(s, row_out, &got, y < H ? &row : NULL), SAT_OK);
                if (y >= H && !got) break;
                if (got) EXPECT(memcmp(row_out, whole + (size_t)given++ * W, sizeof row_out) == 0);
            }
            EXPECT_EQ(given, H);
            sat_stream_destroy(s);
            sat_destroy(t);
            free(whole);
        }
}

TEST(plan_takes_the_cheapest_kind_that_is_good_enough)
{
    static float p[500 * 400];
    sat_image view = sat_image_f32(p, 500, 400, 1);
    sat_kind kind;
    support_fill(p, 500 * 400, 0, 1, 3);
    EXPECT_EQ(sat_plan(&kind, &view, 101, 101, 0.1, 0, NULL), SAT_OK);
    EXPECT_EQ(kind, SAT_KIND_FLOAT);
    EXPECT_EQ(sat_plan(&kind, &view, 3, 3, 1e-2, 0, NULL), SAT_OK);
    EXPECT(kind == SAT_KIND_FIXED32 || kind == SAT_KIND_TILED);
    EXPECT_EQ(sat_plan(&kind, &view, 101, 101, 1e-7, 0, NULL), SAT_OK);
    EXPECT_EQ(kind, SAT_KIND_DOUBLE);
    EXPECT_EQ(sat_plan(&kind, &view, 3, 3, 1e-7, 0, NULL), SAT_OK);
    EXPECT_EQ(kind, SAT_KIND_DOUBLE);
    EXPECT_EQ(sat_plan(&kind, &view, 3, 3, 1e-9, 500 * 400 * 5, NULL), SAT_ERR_LIMIT);
    EXPECT(kind != SAT_KIND_DOUBLE);
    EXPECT_EQ(sat_plan(&kind, &view, 3, 3, 0, 0, NULL), SAT_ERR_LIMIT);
    EXPECT_EQ(sat_plan(NULL, &view, 3, 3, 1e-9, 0, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_plan(&kind, &view, 0, 3, 1e-9, 0, NULL), SAT_ERR_ARGUMENT);
}

TEST(plans_keep_their_word)
{
    static float p[BOUND_W * BOUND_H];
    int which, e, i;
    for (which = 0; which < BOUND_IMAGES; which++)
        for (e = 1; e < 8; e++) {
            sat_image view = sat_image_f32(p, BOUND_W, BOUND_H, 1);
            double allowed = pow(10, -e), mean = 0;
            sat_options o = sat_defaults();
            sat_table *t;
            uint64_t state = 3;
            bound_image(p, which);
            o.max_box_area = 7 * 7;
            if (sat_plan(&o.kind, &view, 7, 7, allowed, 0, &o) != SAT_OK) continue;
            t = build(&view, &o);
            for (i = 0; i < BOUND_W * BOUND_H; i++) mean += fabs((double)p[i]) / (BOUND_W * BOUND_H);
            for (i = 0; i < 500; i++) {
                int x = support_below(&state, BOUND_W - 7), y = support_below(&state, BOUND_H - 7);
                EXPECT_NEAR(sat_mean(t, 0, x, y, x + 7, y + 7), exact_sum(&view, 0, x, y, x + 7, y + 7) / 49,
                            allowed * mean);
            }
            sat_destroy(t);
        }
}

/* What a plan names is built just so, and keeps its word for any kind, size and request. */
TEST(planned_options_meet_the_request)
{
    static float p[BOUND_W * BOUND_H];
    static const int sides[] = {1, 3, 11, 41, 201, BOUND_H};
    sat_image view = sat_image_f32(p, BOUND_W, BOUND_H, 1);
    int which, s, e, i, whole, cases = 0;
    for (which = 0; which < BOUND_IMAGES; which++) {
        double mean = 0;
        bound_image(p, which);
        for (i = 0; i < BOUND_W * BOUND_H; i++) mean += fabs((double)p[i]) / (BOUND_W * BOUND_H);
        for (s = 0; s < 6; s++)
            for (e = 1; e < 8; e++)
                for (whole = 0; whole < 2; whole++) {
                    double allowed = pow(10, -e);
                    sat_options o = sat_defaults();
                    sat_table *t;
                    sat_result r = whole ? sat_plan(&o.kind, &view, sides[s], sides[s], allowed, 0, NULL)
                                         : sat_plan_options(&o, &view, sides[s], sides[s], allowed, 0, NULL);
                    if (r != SAT_OK) continue;
                    t = build(&view, &o);
                    EXPECT(sat_error_bound(t, 0, sides[s], sides[s]) <= allowed * mean * 1.01);
                    cases++;
                    sat_destroy(t);
                }
    }
    REPORT("plans that were built and kept", cases, "plans");
    EXPECT(cases > 84);
    EXPECT_EQ(sat_plan_options(NULL, &view, 3, 3, 1, 0, NULL), SAT_ERR_ARGUMENT);
}

TEST(a_scan_of_many_floats_keeps_its_sum)
{
    size_t n = 20000000, i;
    float *p = (float *)malloc(n * sizeof *p);
    if (!EXPECT(p != NULL)) return;
    for (i = 0; i < n; i++) p[i] = 0.1f;
    EXPECT_EQ(sat_scan_f32(p, p, n, NULL), SAT_OK);
    EXPECT_ULP(p[n - 1], (float)((double)0.1f * 2e7), 1);
    free(p);
}

/* ---- moments */

static double exact_covariance(const sat_image *view, int a, int b, int x0, int y0, int x1, int y1)
{
    double n = (double)(x1 - x0) * (y1 - y0), ma = exact_sum(view, a, x0, y0, x1, y1) / n,
           mb = exact_sum(view, b, x0, y0, x1, y1) / n;
    long double co = 0;
    float rows[2][256];
    int x, y;
    if (!EXPECT(x1 - x0 <= 256)) return 0;
    for (y = y0; y < y1; y++) {
        sat__read_row(rows[0], view, y, x0, x1, a);
        sat__read_row(rows[1], view, y, x0, x1, b);
        for (x = 0; x < x1 - x0; x++) co += ((long double)rows[0][x] - ma) * ((long double)rows[1][x] - mb);
    }
    return (double)(co / n);
}

static sat_moments *moments_of(const sat_image *view, const sat_moments_options *o)
{
    sat_moments *m = NULL;
    EXPECT_EQ(sat_moments_create(&m, view->width, view->height, view->channels, o), SAT_OK);
    if (m) EXPECT_EQ(sat_moments_build(m, view), SAT_OK);
    return m;
}

TEST(variance_is_right_where_it_is_small_beside_the_mean)
{
    enum { W = 200, H = 150 };
    static float p[W * H], filtered_out[W * H], mean[W * H];
    static const int sides[] = {2, 3, 11, 41, 140};
    sat_image view = sat_image_f32(p, W, H, 1);
    int which, s, i;
    for (which = 0; which < 3; which++) {
        uint64_t state = 5;
        sat_moments *m;
        for (i = 0; i < W * H; i++)
            p[i] = which == 0   ? (float)(1e4 + support_gaussian(&state))
                   : which == 1 ? (float)(4096 + (i % W + i / W) % 2)
                                : 65025.0f;
        m = moments_of(&view, NULL);
        for (s = 0; s < 5; s++)
            for (i = 0; i < (s < 4 ? 400 : 60); i++) {
                int x = support_below(&state, W - sides[s]), y = support_below(&state, H - sides[s]);
                double got = sat_variance(m, 0, x, y, x + sides[s], y + sides[s]);
                EXPECT_NEAR(got, exact_covariance(&view, 0, 0, x, y, x + sides[s], y + sides[s]), 1e-9);
                EXPECT(got >= 0);
                EXPECT_REL(sat_moments_mean(m, 0, x, y, x + sides[s], y + sides[s]),
                           exact_sum(&view, 0, x, y, x + sides[s], y + sides[s]) / (sides[s] * sides[s]), 1e-13);
            }
        EXPECT_EQ(sat_moments_filter(filtered_out, mean, W * 4, m, 0, 0, 7), SAT_OK);
        for (i = 0; i < W * H; i++) {
            int x = i % W, y = i / W;
            EXPECT_NEAR(filtered_out[i], (float)sat_variance(m, 0, x - 7, y - 7, x + 8, y + 8), 0);
            EXPECT_NEAR(mean[i], (float)sat_moments_mean(m, 0, x - 7, y - 7, x + 8, y + 8), 0);
        }
        sat_moments_destroy(m);
    }
}

TEST(covariance_of_every_pair_and_bad_pixels_leave_other_boxes_alone)
{
    enum { W = 130, H = 90 };
    static float p[W * H * 3];
    sat_image view = sat_image_f32(p, W, H, 3);
    sat_moments_options o = sat_moments_defaults();
    sat_moments *m, *other;
    sat_threads threads = support_threads(3);
    uint64_t state = 6;
    int i, a, b;
    for (i = 0; i < W * H; i++) {
        double base = 100 * support_gaussian(&state);
        p[i * 3] = (float)(1000 + base);
        p[i * 3 + 1] = (float)(-500 - base + support_gaussian(&state));
        p[i * 3 + 2] = (float)support_uniform(&state);
    }
    o.covariance = 1;
    m = moments_of(&view, &o);
    for (i = 0; i < 300; i++) {
        int x = support_below(&state, W - 30), y = support_below(&state, H - 30), side = 1 + support_below(&state, 30);
        for (a = 0; a < 3; a++)
            for (b = 0; b < 3; b++) {
                double scale = sqrt(exact_covariance(&view, a, a, x, y, x + side, y + side) *
                                    exact_covariance(&view, b, b, x, y, x + side, y + side));
                EXPECT_NEAR(sat_covariance(m, a, b, x, y, x + side, y + side),
                            exact_covariance(&view, a, b, x, y, x + side, y + side), 1e-9 * scale + 1e-9);
            }
    }
    p[(45 * W + 70) * 3] = sat__float_from_bits(0x7f800000u);
    p[(45 * W + 71) * 3 + 1] = sat__float_from_bits(0x7fc00000u);
    o.threads = threads;
    other = moments_of(&view, &o);
    for (i = 0; i < 2000; i++) {
        int box[4];
        random_box(&state, W, H, 40, box);
        if (box[2] > 70 && box[0] < 72 && box[3] > 45 && box[1] < 46)
            EXPECT(sat__is_finite_double(sat_covariance(other, 0, 1, box[0], box[1], box[2], box[3])));
        else
            EXPECT_NEAR(sat_covariance(other, 0, 1, box[0], box[1], box[2], box[3]),
                        sat_covariance(m, 0, 1, box[0], box[1], box[2], box[3]), 1e-7);
    }
    sat_moments_destroy(other);
    o.non_finite = SAT_NON_FINITE_REFUSE;
    EXPECT_EQ(sat_moments_create(&other, W, H, 3, &o), SAT_OK);
    EXPECT_EQ(sat_moments_build(other, &view), SAT_ERR_NON_FINITE);
    EXPECT_NEAR(sat_variance(other, 0, 0, 0, W, H), 0, 0);
    sat_moments_destroy(other);
    EXPECT_NEAR(sat_variance(NULL, 0, 0, 0, 5, 5), 0, 0);
    EXPECT_NEAR(sat_variance(m, 3, 0, 0, 5, 5), 0, 0);
    EXPECT_NEAR(sat_variance(m, 0, 5, 5, 5, 9), 0, 0);
    sat_moments_destroy(m);
    o = sat_moments_defaults();
    m = NULL;
    EXPECT_EQ(sat_moments_create(&m, W, H, 3, NULL), SAT_OK);
    EXPECT_NEAR(sat_covariance(m, 0, 1, 0, 0, 9, 9), 0, 0);
    EXPECT_EQ(sat_moments_build(m, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_moments_build(NULL, &view), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_moments_filter(p, NULL, W * 4, m, 0, 1, 3), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_moments_filter(NULL, NULL, W * 4, m, 0, 0, 3), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_moments_filter(p, NULL, W * 4 - 4, m, 0, 0, 3), SAT_ERR_ARGUMENT);
    sat_moments_destroy(m);
    EXPECT_EQ(sat_moments_create(&m, 0, H, 3, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_moments_create(NULL, W, H, 3, NULL), SAT_ERR_ARGUMENT);
}

/* ---- sentences */

/* Every row of a table: values outside its range are refused and named, its ends and its default are not. */
typedef int refuse_fn(const void *options, char *text);

static void walk_fields(const sat__field *fields, int count, void *options, const void *defaults, size_t bytes,
                        refuse_fn *refused)
{
    int i, j;
    for (i = 0; i < count; i++) {
        const sat__field *f = &fields[i];
        double bad[3], good[3];
        char text[200];
        if (f->type == 'a' || f->type == 't') continue;
        bad[0] = f->type == 'i' ? f->low - 1 : f->low - 1 - fabs(f->low);
        bad[1] = f->type == 'i' ? f->high + 1 : f->high * 2;
        bad[2] = f->type == 'i' ? f->high + 100 : (double)sat__float_from_bits(0x7fc00000u);
        good[0] = f->low;
        good[1] = f->high;
        good[2] = f->initial;
        for (j = 0; j < 3; j++) {
            memcpy(options, defaults, bytes);
            sat__field_set(f, options, bad[j]);
            EXPECT(refused(options, text));
            if (!EXPECT(strncmp(text, f->name, strlen(f->name)) == 0)) printf("%s: \"%s\"\n", f->name, text);
            EXPECT_EQ(sat__fields_check(options, fields, count) == f, 1);
            memcpy(options, defaults, bytes);
            sat__field_set(f, options, good[j]);
            EXPECT(sat__fields_check(options, fields, count) == NULL);
        }
        memcpy(options, defaults, bytes);
        EXPECT(!refused(options, text) && !text[0]);
    }
}

static int table_refused(const void *options, char *text)
{
    sat_table *t = NULL;
    sat_result r = sat_create(&t, 16, 16, 1, (const sat_options *)options);
    sat_explain(text, 200, 16, 16, 1, (const sat_options *)options);
    sat_destroy(t);
    return r == SAT_ERR_ARGUMENT;
}

static int scan_refused(const void *options, char *text)
{
    float v[4] = {1, 2, 3, 4};
    sat_explain_scan(text, 200, (const sat_scan_options *)options);
    return sat_scan_f32(v, v, 4, (const sat_scan_options *)options) == SAT_ERR_ARGUMENT;
}

static int moments_refused(const void *options, char *text)
{
    sat_moments *m = NULL;
    sat_result r = sat_moments_create(&m, 16, 16, 1, (const sat_moments_options *)options);
    sat_explain_moments(text, 200, 16, 16, 1, (const sat_moments_options *)options);
    sat_moments_destroy(m);
    return r == SAT_ERR_ARGUMENT;
}

/* What a table of these options must answer for 16 x 16 pixels that none of them changes: each box within its bound. */
static void corner_of_options(const sat_options *o, const float *pixels, int channels)
{
    sat_image view = sat_image_f32(pixels, 16, 16, channels);
    char text[200];
    sat_table *t = NULL;
    int explained, i, box[4] = {3, 2, 12, 15};
    sat_explain(text, sizeof text, 16, 16, channels, o);
    explained = text[0] != 0;
    sat_result r = sat_create(&t, 16, 16, channels, o);
    if (!EXPECT_EQ(r != SAT_OK, explained)) puts(text);
    if (r != SAT_OK) return;
    EXPECT_EQ(sat_build(t, &view), SAT_OK);
    for (i = 0; i < channels; i++) {
        double sum = 0, bound = sat_error_bound(t, i, 9, 13), limit = o->max_value > 0 ? o->max_value : 1e300;
        int x, y;
        for (y = box[1]; y < box[3]; y++)
            for (x = box[0]; x < box[2]; x++) sum += fmin((double)pixels[(16 * y + x) * channels + i], limit);
        EXPECT_NEAR(sat_mean(t, i, box[0], box[1], box[2], box[3]), sum / 117, bound + 1e-12);
    }
    sat_destroy(t);
}

/* First, last and default of every option, in pairs, for every kind: create and explain agree, and boxes are right. */
TEST(corners_of_the_options_in_pairs)
{
    float pixels[16 * 16 * 3];
    int n = SAT__COUNT(sat__table_fields), kind, i, j, a, b;
    for (i = 0; i < 16 * 16 * 3; i++) pixels[i] = 0.25f * (float)(i * 37 % 101);
    for (kind = 0; kind < 5; kind++)
        for (i = 0; i < n; i++)
            for (j = 0; j < i; j++)
                for (a = 0; a < 3; a++)
                    for (b = 0; b < 3; b++) {
                        const sat__field *f = &sat__table_fields[i], *g = &sat__table_fields[j];
                        sat_options o = sat_defaults();
                        if (strchr("at", f->type) || strchr("at", g->type)) continue;
                        o.kind = (sat_kind)kind;
                        sat__field_set(f, &o, a == 0 ? f->low : a == 1 ? f->high : f->initial);
                        sat__field_set(g, &o, b == 0 ? g->low : b == 1 ? g->high : g->initial);
                        corner_of_options(&o, pixels, 1 + (i + j + a + b) % 3);
                    }
}

TEST(every_refusal_names_its_field)
{
    int unknown = 4;
    sat_options table = sat_defaults(), table_defaults = table;
    sat_scan_options scan = sat_scan_defaults(), scan_defaults = scan;
    sat_moments_options moments = sat_moments_defaults(), moments_defaults = moments;
    static const float pixels[16] = {0};
    char text[120];
    sat_image view = sat_image_f32(pixels, 4, 2, 2);
    walk_fields(sat__table_fields, SAT__COUNT(sat__table_fields), &table, &table_defaults, sizeof table, table_refused);
    walk_fields(sat__scan_fields, SAT__COUNT(sat__scan_fields), &scan, &scan_defaults, sizeof scan, scan_refused);
    walk_fields(sat__moments_fields, SAT__COUNT(sat__moments_fields), &moments, &moments_defaults, sizeof moments,
                moments_refused);
    table.tile = 48;
    EXPECT(strcmp(sat_explain(text, sizeof text, 4, 4, 1, &table), "tile is 48; 8..128, a power of two") == 0);
    EXPECT(strcmp(sat_explain(text, sizeof text, 4, 4, 9, NULL), "channels is 9; 1..4") == 0);
    EXPECT(strcmp(sat_explain(text, 9, 4, 4, 9, NULL), "channels") == 0);
    EXPECT(sat_explain(NULL, 0, 4, 4, 9, NULL) == NULL);
    table = sat_defaults();
    table.subtract_mean = 1;
    EXPECT(strncmp(sat_explain(text, sizeof text, 4, 4, 1, &table), "subtract_mean is 1", 18) == 0);
    EXPECT(strcmp(sat_explain_image(text, sizeof text, &view), "") == 0);
    EXPECT(strcmp(sat_explain_image(text, sizeof text, NULL), "image is NULL") == 0);
#define REFUSED(member, value, words) view = sat_image_f32(pixels, 4, 2, 2); view.member = value; EXPECT(!sat__image_is_valid(&view) && strcmp(sat_explain_image(text, sizeof text, &view), words) == 0)
    REFUSED(pixels, NULL, "image.pixels is NULL");
    REFUSED(pixels, (const char *)pixels + 1, "image.pixels is not aligned for its format");
    REFUSED(width, 0, "image.width is 0; 1..2147483647");
    REFUSED(height, -3, "image.height is -3; 1..2147483647");
    REFUSED(channels, 5, "image.channels is 5; 1..4");
    REFUSED(format, (sat_format)unknown, "image.format is 4; 0..3");
    REFUSED(stride, 28, "image.stride is shorter than a row");
    REFUSED(stride, 33, "image.stride is not a multiple of its format's bytes");
#undef REFUSED
}

/* Rows that do not start at a multiple of 16 bytes, in a table larger than the cache. */
TEST(narrow_and_very_tall_tables)
{
    int width = 17, height = 70000, y;
    float *pixels = (float *)malloc((size_t)width * (size_t)height * sizeof(float));
    sat_table *t = NULL;
    sat_image view = sat_image_f32(pixels, width, height, 1);
    for (y = 0; y < width * height; y++) pixels[y] = (float)(y % 5);
    EXPECT_EQ(sat_create(&t, width, height, 1, NULL), SAT_OK);
    EXPECT_EQ(sat_build(t, &view), SAT_OK);
    EXPECT(sat_sum(t, 0, 0, 0, width, height) == 2.0 * width * height);
    EXPECT(sat_sum(t, 0, 16, 69999, 17, 70000) == (double)pixels[width * height - 1]);
    sat_destroy(t);
    free(pixels);
}

/* ---- memory, arguments, small functions */

TEST(one_allocation_at_create_and_none_afterwards)
{
    static float p[100 * 90], out[100 * 90];
    sat_image view = sat_image_f32(p, 100, 90, 1);
    int k;
    support_fill(p, 100 * 90, -1, 1, 2);
    for (k = 0; k < 4; k++) {
        support_memory m;
        sat_options o = sat_defaults();
        sat_table *t;
        sat_stream *s;
        o.kind = kinds[k];
        o.allocator = support_allocator(&m);
        EXPECT_EQ(sat_create(&t, 100, 90, 1, &o), SAT_OK);
        EXPECT_EQ(sat_build(t, &view), SAT_OK);
        EXPECT_EQ(sat_update(t, &view, 3, 4, 50, 60), SAT_OK);
        EXPECT_EQ(sat_box_filter(out, 400, t, 3), SAT_OK);
        EXPECT_EQ(m.calls, 1);
        EXPECT_EQ(m.peak, sat_get_stats(t).bytes);
        sat_destroy(t);
        EXPECT(support_memory_clean(&m));
        m.fail_at = m.calls + 1;
        EXPECT_EQ(sat_create(&t, 100, 90, 1, &o), SAT_ERR_MEMORY);
        EXPECT(t == NULL);
        o.max_value = 1;
        m.fail_at = m.calls + 1;
        EXPECT_EQ(sat_stream_create(&s, 100, 1, 3, &o), SAT_ERR_MEMORY);
        m.fail_at = m.calls + 2;
        EXPECT_EQ(sat_stream_create(&s, 100, 1, 3, &o), SAT_ERR_MEMORY);
        EXPECT(s == NULL && support_memory_clean(&m));
    }
    sat_destroy(NULL);
    sat_stream_destroy(NULL);
}

TEST(bad_arguments_are_refused)
{
    static float p[64];
    sat_image view = sat_image_f32(p, 8, 8, 1), bad;
    sat_options o = sat_defaults();
    sat_table *t;
    support_memory memory;
    sat_stream *s;
    const unsigned nine = 9;
    EXPECT_EQ(sat_create(NULL, 8, 8, 1, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_create(&t, 0, 8, 1, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_create(&t, 8, -1, 1, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_create(&t, 8, 8, 0, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_create(&t, 8, 8, 5, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_create(&t, 0x7ffffffe, 0x7ffffffe, 4, NULL), SAT_ERR_SIZE);
    o.kind = SAT_KIND_FLOAT;
    o.allocator = support_allocator(&memory);
    memory.fail_at = 1; /* the widest row is asked for, with no overflow on the way */
    if (SIZE_MAX > 0xffffffffu) EXPECT_EQ(sat_create(&t, 0x7ffffffe, 1, 1, &o), SAT_ERR_MEMORY);
    o = sat_defaults();
    o.tile = 33;
    EXPECT_EQ(sat_create(&t, 8, 8, 1, &o), SAT_ERR_ARGUMENT);
    o.tile = 0;
    EXPECT_EQ(sat_create(&t, 8, 8, 1, &o), SAT_ERR_ARGUMENT);
    o = sat_defaults();
    o.subtract_mean = 1;
    EXPECT_EQ(sat_create(&t, 8, 8, 1, &o), SAT_ERR_ARGUMENT);
    o = sat_defaults();
    o.max_value = sqrt(-1.0);
    EXPECT_EQ(sat_create(&t, 8, 8, 1, &o), SAT_ERR_ARGUMENT);
    o = sat_defaults();
    o.allocator.alloc = support_alloc;
    EXPECT_EQ(sat_create(&t, 8, 8, 1, &o), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_create(&t, 8, 8, 1, NULL), SAT_OK);
    EXPECT_EQ(sat_build(t, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_build(NULL, &view), SAT_ERR_ARGUMENT);
    bad = view;
    bad.width = 7;
    EXPECT_EQ(sat_build(t, &bad), SAT_ERR_MISMATCH);
    bad = view;
    bad.stride = 28;
    EXPECT_EQ(sat_build(t, &bad), SAT_ERR_ARGUMENT);
    bad = view;
    bad.stride = 33;
    EXPECT_EQ(sat_build(t, &bad), SAT_ERR_ARGUMENT);
    bad = view;
    memcpy(&bad.format, &nine, sizeof bad.format);
    EXPECT_EQ(sat_build(t, &bad), SAT_ERR_ARGUMENT);
    EXPECT_NEAR(sat_sum(NULL, 0, 0, 0, 1, 1) + sat_sum(t, 1, 0, 0, 1, 1) + sat_sum(t, -1, 0, 0, 1, 1), 0, 0);
    EXPECT_NEAR(sat_error_bound(t, 3, 1, 1) + sat_error_rms(NULL, 0, 1, 1), 0, 0);
    sat_destroy(t);
    o = sat_defaults();
    o.kind = SAT_KIND_FIXED32;
    EXPECT_EQ(sat_stream_create(&s, 8, 1, 2, &o), SAT_ERR_ARGUMENT); /* no largest value */
    EXPECT_EQ(sat_stream_create(&s, 8, 1, -1, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(sat_stream_create(&s, 8, 1, 2, NULL), SAT_OK);
    EXPECT_EQ(sat_stream_push(s, p, NULL, &view), SAT_ERR_ARGUMENT);
    sat_stream_destroy(s);
}

TEST(result_texts_and_version)
{
    const unsigned ninety_nine = 99;
    sat_result unknown;
    int i, j;
    for (i = 0; i < SAT_RESULT_COUNT; i++) {
        EXPECT(strlen(sat_result_text((sat_result)i)) > 5);
        for (j = 0; j < i; j++) EXPECT(strcmp(sat_result_text((sat_result)i), sat_result_text((sat_result)j)) != 0);
    }
    memcpy(&unknown, &ninety_nine, sizeof unknown);
    EXPECT(strcmp(sat_result_text(unknown), "unknown result") == 0);
    EXPECT_EQ(sat_version(), SAT_VERSION);
}

TEST(half_floats_there_and_back)
{
    uint32_t h;
    uint64_t state = 5;
    int i;
    for (h = 0; h < 65536; h++) {
        float f = sat__half_to_float((uint16_t)h);
        if (sat__is_nan(f)) EXPECT((h & 0x7fff) > 0x7c00 && (sat__half_from_float(f) & 0x7fff) > 0x7c00);
        else EXPECT_EQ(sat__half_from_float(f), h);
    }
    for (i = 0; i < 100000; i++) { /* nearest: no neighbour is nearer */
        float v = (float)(pow(2, 45 * support_uniform(&state) - 28) * (i % 2 ? 1 : -1)), back;
        uint16_t half = sat__half_from_float(v), next = (uint16_t)(half + 1), previous = (uint16_t)(half - 1);
        back = sat__half_to_float(half);
        if (!sat__is_finite(back)) {
            EXPECT(fabs((double)v) >= 65520);
            continue;
        }
        if (sat__is_finite(sat__half_to_float(next)))
            EXPECT(fabs((double)back - (double)v) <= fabs((double)sat__half_to_float(next) - (double)v));
        if (half & 0x7fff)
            EXPECT(fabs((double)back - (double)v) <= fabs((double)sat__half_to_float(previous) - (double)v));
    }
}

TEST(srgb_there_and_back)
{
    int i;
    for (i = 0; i <= 255; i++) EXPECT_NEAR(sat__srgb_encode(sat__srgb_decode((float)i / 255)) * 255, i, 2e-4);
    EXPECT_NEAR(sat__srgb_encode(sat__float_from_bits(0x7fc00000u)), 0, 0);
    EXPECT_NEAR(sat__srgb_encode(7), 1, 0);
}

#ifdef SAT__VECTOR
TEST(sat_stride_of_0_is_packed)
{
    enum { W = 21, H = 13 };
    static const sat_format formats[4] = {SAT_F32, SAT_U8, SAT_U16, SAT_F16};
    static float pixels[W * H * 3], radius[W * H], out[2][W * H * 3], mean[2][W * H];
    uint64_t random = 7;
    int f, k;
    for (k = 0; k < W * H * 3; k++) pixels[k] = (float)support_uniform(&random);
    for (k = 0; k < W * H; k++) radius[k] = (float)(k % 5);
    for (f = 0; f < 4; f++) {
        sat_table *t[2] = {NULL, NULL};
        sat_moments *m = NULL;
        for (k = 0; k < 2; k++) {
            sat_image view = sat_image_f32(pixels, W, H, 3);
            view.format = formats[f];
            view.stride = k ? (ptrdiff_t)(W * 3 * sat__format_size(formats[f])) : 0;
            EXPECT_EQ(sat_create(&t[k], W, H, 3, NULL), SAT_OK);
            EXPECT_EQ(sat_build(t[k], &view), SAT_OK);
            EXPECT_EQ(sat_box_filter(out[k], k ? W * 12 : 0, t[k], 2), SAT_OK);
        }
        EXPECT(memcmp(out[0], out[1], sizeof out[0]) == 0);
        for (k = 0; k < 2; k++)
            EXPECT_EQ(sat_box_filter_variable(out[k], k ? W * 12 : 0, t[k], radius, k ? W * 4 : 0), SAT_OK);
        EXPECT(memcmp(out[0], out[1], sizeof out[0]) == 0);
        sat_destroy(t[0]);
        sat_destroy(t[1]);
        if (f) continue;
        EXPECT_EQ(sat_moments_create(&m, W, H, 1, NULL), SAT_OK);
        for (k = 0; k < 2; k++) {
            sat_image view = sat_image_f32(pixels, W, H, 1);
            if (!k) view.stride = 0;
            EXPECT_EQ(sat_moments_build(m, &view), SAT_OK);
            EXPECT_EQ(sat_moments_filter(out[k], mean[k], k ? W * 4 : 0, m, 0, 0, 3), SAT_OK);
        }
        EXPECT(memcmp(out[0], out[1], W * H * 4) == 0 && memcmp(mean[0], mean[1], sizeof mean[0]) == 0);
        sat_moments_destroy(m);
    }
    EXPECT_NEAR(sat_reduce_f32(pixels, 100, 0, 4), sat_reduce_f32(pixels, 100, 4, 4), 0);
}

TEST(vector_rows_equal_plain_rows_bit_for_bit)
{
    enum { N = 1003 };
    static float in[N], out[2][N + 16], column[2][N + 16];
    static double out64[2][N + 16], column64[2][N + 16];
    int n, i;
    support_hdr_image(in, N, 1, 1, 5);
    for (i = 0; i < N; i += 3) in[i] = -in[i];
    for (n = 0; n < N; n += n < 70 ? 1 : 97) {
        int32_t signs[2] = {0, 0};
        float last[2];
        double last64[2];
        memset(column, 0, sizeof column);
        memset(column64, 0, sizeof column64);
        for (i = 0; i < 3; i++) {
            last[0] = sat__sum_row_f32(out[0], column[0], in, n, 0.5f, 0, &signs[0]);
            last[1] = sat__sum_row_plain_f32(out[1], column[1], in, n, 0.5f, &signs[1]);
            last64[0] = sat__sum_row_f64(out64[0], column64[0], in, n, 0.5, 0, &signs[0]);
            last64[1] = sat__sum_row_plain_f64(out64[1], column64[1], in, n, 0.5, &signs[1]);
        }
        EXPECT(memcmp(out[0], out[1], (size_t)n * 4) == 0 && memcmp(column[0], column[1], (size_t)n * 4) == 0);
        EXPECT(memcmp(out64[0], out64[1], (size_t)n * 8) == 0 && memcmp(column64[0], column64[1], (size_t)n * 8) == 0);
        EXPECT(memcmp(&last[0], &last[1], 4) == 0 && memcmp(&last64[0], &last64[1], 8) == 0);
        EXPECT_EQ(signs[0] < 0, signs[1] < 0);
    }
}
#endif
