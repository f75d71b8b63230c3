/* The tools that other tests trust. */

#include "support.h"
#include "bench/bench.h"
#include "gl_context.h"

TEST(allocator_counts_and_fails)
{
    support_memory m;
    sat_allocator a = support_allocator(&m);
    void *p = a.alloc(10, a.user), *q = a.alloc(20, a.user);
    EXPECT(p != NULL && q != NULL && m.calls == 2 && m.live == 2);
    EXPECT_EQ(m.bytes, 30);
    EXPECT(!support_memory_clean(&m));
    a.release(p, 10, a.user);
    a.release(q, 20, a.user);
    EXPECT(support_memory_clean(&m));
    EXPECT_EQ(m.peak, 30);
    m.fail_at = 3;
    EXPECT(a.alloc(1, a.user) == NULL);
    EXPECT(a.alloc(1, a.user) == NULL);
    m.fail_at = 0;
    p = a.alloc(8, a.user);
    a.release(p, 9, a.user);
    EXPECT_EQ(m.errors, 1);
}

typedef struct cover { int hits[1000], workers[8], pieces; } cover;

static void cover_range(int begin, int end, int worker, void *context)
{
    cover *c = (cover *)context;
    int i;
    for (i = begin; i < end; ++i) ++c->hits[i];
    ++c->workers[worker];     /* one worker never runs twice at a time */
}

static void check_cover(sat_threads t, int count)
{
    cover c;
    int i, once = 1, pieces = 0;
    memset(&c, 0, sizeof c);
    t.parallel_for(count, cover_range, &c, t.user);
    for (i = 0; i < 1000; ++i) once &= c.hits[i] == (i < count);
    for (i = 0; i < 8; ++i) pieces += c.workers[i];
    EXPECT(once);
    EXPECT(count == 0 || pieces > 0);
    for (i = t.workers; i < 8; ++i) EXPECT_EQ(c.workers[i], 0);
}

TEST(parallel_for_covers_each_item_once)
{
    int counts[] = {0, 1, 2, 7, 100, 1000}, i, w;
    for (i = 0; i < 6; ++i)
        for (w = 1; w <= 7; w += 3) {
            check_cover(support_threads(w), counts[i]);
            check_cover(support_odd_threads(w), counts[i]);
        }
}

TEST(the_larger_one_does_not_hide_what_is_no_number)
{
    EXPECT(support_larger(1, 2) == 2 && support_larger(2, 1) == 2);
    EXPECT(isnan(support_larger(NAN, 1)) && isnan(support_larger(1, NAN)));
}

TEST(hash_and_random_numbers_are_known)
{
    uint64_t state = 0;
    double sum = 0, square = 0;
    int i;
    EXPECT_EQ(support_hash("a", 1), UINT64_C(0xaf63dc4c8601ec8c));        /* the published FNV-1a vector */
    EXPECT_EQ(support_random(&state), UINT64_C(0xe220a8397b1dcdaf));      /* splitmix64 from 0 */
    for (i = 0; i < 20000; ++i) {
        double g = support_gaussian(&state);
        sum += g;
        square += g * g;
    }
    EXPECT_NEAR(sum / 20000, 0, 0.03);
    EXPECT_NEAR(square / 20000, 1, 0.05);
}

TEST(median_of_values)
{
    double odd[3] = {3, 1, 2}, even[4] = {4, 1, 3, 2};
    EXPECT_NEAR(support_median(odd, 3), 2, 0);
    EXPECT_NEAR(support_median(even, 4), 2.5, 0);
}

TEST(hdr_image_spans_14_decades)
{
    static float pixels[64 * 64 * 3];
    float low = 1e30f, high = 0;
    int i;
    support_hdr_image(pixels, 64, 64, 3, 1);
    for (i = 0; i < 64 * 64 * 3; ++i) {
        if (pixels[i] < low) low = pixels[i];
        if (pixels[i] > high) high = pixels[i];
    }
    EXPECT(low > 0 && high < 2e8f);
    EXPECT_NEAR(log10((double)(high / low)), 14, 0.5);
    REPORT("decades of the HDR test picture", log10((double)(high / low)), "");
}

static void busy(void *user)
{
    volatile double *x = (volatile double *)user;
    int i;
    for (i = 0; i < 20000; ++i) *x = *x * 0.999 + 1;
}

TEST(ratio_of_equal_work_is_near_one)
{
    double x = 0;
    bench_times t = bench_ratio(busy, &x, busy, &x, 9);
    EXPECT(t.ratio > 0.3 && t.ratio < 3.0);
    EXPECT(t.work > 0 && t.peer > 0);
}

TEST(gl_context_opens_or_names_the_package)
{
    gl_context gl;
    if (!gl_context_open(&gl, 3, 3)) {
        EXPECT(strstr(gl.message, "libosmesa6") || strstr(gl.message, "EGL") ||
               strstr(gl.message, "LIGHTSCAN_GL=none"));
        SKIP(gl.message);
    }
    EXPECT(gl.get_proc("glDrawArrays") != NULL);
    EXPECT(strstr(gl_context_renderer(&gl), "OpenGL ") != NULL);
    gl_context_close(&gl);
}

TEST(absent_data_is_null)
{
    EXPECT(support_data("no/such/file") == NULL);
}
