/* expect.h - unit tests in one header, for C99 and C++11.            SPDX-License-Identifier: MIT-0 OR Unlicense

   USE

       #include "expect.h"
       TEST(half_of_four) { EXPECT_EQ(4 / 2, 2); EXPECT_NEAR(sqrt(4.0), 2.0, 1e-15); }
       EXPECT_MAIN()

   A test registers itself. Every macro is an expression that is 1 when it held and 0 when it failed, so that
   `if (!EXPECT(p != NULL)) return;` ends a test early. A failure prints file:line and both values and goes on.
   A test without any check fails: it could never have found anything.

     EXPECT(cond)               cond holds
     EXPECT_EQ(a, b)            integers (or enums) are equal
     EXPECT_NEAR(a, b, abs)     |a - b| <= abs
     EXPECT_REL(a, b, rel)      |a - b| <= rel |b|          b is the reference
     EXPECT_ULP(a, b, n)        floats at most n representable values apart
     REPORT("name", value, "unit")  prints a figure; no check
     SKIP("needs libosmesa6")   leaves the test and counts it as skipped; name the package or the file

   NaN fails every numeric check, also where both sides are NaN: the bits are looked at, so that not even
   -ffast-math can remove the test. Two equal infinities are near each other.

   COMMAND LINE: prog [-v] [-l] [words]; only tests whose name contains one of the words are run, -l lists, -v prints
   the tests that passed. The exit code is 1 when something failed. If the environment names a file in
   EXPECT_COUNTS, the line "passed failed skipped" is appended to it. */

#ifndef EXPECT_H
#define EXPECT_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct expect_test {
    const char *name;
    void (*run)(void);
    struct expect_test *next;
} expect_test;

static struct {
    expect_test *first, *last;
    const char *current;             /* name of the running test */
    int checks, failures, skipped;   /* of the running test */
} expect_state;

enum { EXPECT_MAX_LINES = 10 };      /* failures printed per test */

static inline void expect_add(expect_test *test)
{
    if (expect_state.last) expect_state.last->next = test;
    else expect_state.first = test;
    expect_state.last = test;
}

static inline int expect_is_nan(double x)
{
    uint64_t bits;
    memcpy(&bits, &x, sizeof bits);
    return (bits & UINT64_C(0x7fffffffffffffff)) > UINT64_C(0x7ff0000000000000);
}

/* Counts one check; 1 when a failure is to be printed by the caller. */
static inline int expect_failed(int ok, const char *file, int line)
{
    ++expect_state.checks;
    if (ok) return 0;
    if (++expect_state.failures > EXPECT_MAX_LINES) return 0;
    printf("%s:%d: %s: ", file, line, expect_state.current);
    return 1;
}

static inline int expect_true(int ok, const char *text, const char *file, int line)
{
    if (expect_failed(ok, file, line)) printf("EXPECT(%s)\n", text);
    return ok;
}

static inline int expect_equal(long long a, long long b, const char *text, const char *file, int line)
{
    int ok = a == b;
    if (expect_failed(ok, file, line)) printf("%s: %lld is not %lld\n", text, a, b);
    return ok;
}

/* |a - b| <= limit, where a NaN anywhere fails. */
static inline int expect_within(double a, double b, double limit, const char *text, const char *file, int line)
{
    double off = a > b ? a - b : b - a;
    int nan = expect_is_nan(a) || expect_is_nan(b) || expect_is_nan(limit);
    int same = !nan && memcmp(&a, &b, sizeof a) == 0;
    int ok = same || (!nan && !expect_is_nan(off) && off <= limit);
    if (expect_failed(ok, file, line))
        printf("%s: %.9g against %.9g, off by %.9g, limit %.9g\n", text, a, b, off, limit);
    return ok;
}

static inline int expect_relative(double a, double b, double rel, const char *text, const char *file, int line)
{
    return expect_within(a, b, rel * (b < 0 ? -b : b), text, file, line);
}

/* Floats in the order of their values: neighbours differ by 1, and +0 and -0 are the same. */
static inline int64_t expect_order(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits & UINT32_C(0x80000000) ? -(int64_t)(bits & UINT32_C(0x7fffffff)) : (int64_t)bits;
}

static inline int expect_ulp(float a, float b, long long limit, const char *text, const char *file, int line)
{
    int nan = expect_is_nan((double)a) || expect_is_nan((double)b);
    int64_t off = expect_order(a) - expect_order(b);
    int ok;
    if (off < 0) off = -off;
    ok = !nan && (long long)off <= limit;
    if (expect_failed(ok, file, line))
        printf("%s: %.9g against %.9g, %lld ulp apart, limit %lld\n", text, (double)a, (double)b, (long long)off,
               limit);
    return ok;
}

static inline void expect_skip(const char *reason)
{
    expect_state.skipped = 1;
    printf("skip %s: %s\n", expect_state.current, reason);
}

#define EXPECT(cond)            expect_true((cond) ? 1 : 0, #cond, __FILE__, __LINE__)
#define EXPECT_EQ(a, b)         expect_equal((long long)(a), (long long)(b), "EXPECT_EQ(" #a ", " #b ")", __FILE__, __LINE__)
#define EXPECT_NEAR(a, b, abs)  expect_within((double)(a), (double)(b), (double)(abs), \
                                              "EXPECT_NEAR(" #a ", " #b ", " #abs ")", __FILE__, __LINE__)
#define EXPECT_REL(a, b, rel)   expect_relative((double)(a), (double)(b), (double)(rel), \
                                                "EXPECT_REL(" #a ", " #b ", " #rel ")", __FILE__, __LINE__)
#define EXPECT_ULP(a, b, n)     expect_ulp((float)(a), (float)(b), (long long)(n), \
                                           "EXPECT_ULP(" #a ", " #b ", " #n ")", __FILE__, __LINE__)
#define REPORT(name, value, unit) ((void)printf("report %-44s %14.6g %s\n", name, (double)(value), unit))
#define SKIP(reason)            do { expect_skip(reason); return; } while (0)

#if defined(_MSC_VER)
#pragma section(".CRT$XCU", read)
#define EXPECT_REGISTER(name)                                                                                       \
    static void expect_register_##name(void);                                                                       \
    __declspec(allocate(".CRT$XCU")) void (*expect_start_##name)(void) = expect_register_##name;                    \
    static void expect_register_##name(void)
#else
#define EXPECT_REGISTER(name)                                                                                       \
    __attribute__((constructor)) static void expect_register_##name(void);                                          \
    static void expect_register_##name(void)
#endif

#define TEST(name)                                                                                                  \
    static void test_##name(void);                                                                                  \
    EXPECT_REGISTER(name)                                                                                           \
    {                                                                                                               \
        static expect_test test = {#name, test_##name, NULL};                                                       \
        expect_add(&test);                                                                                          \
    }                                                                                                               \
    static void test_##name(void)

static inline int expect_wanted(const char *name, int argc, char **argv)
{
    int i, words = 0;
    for (i = 1; i < argc; ++i) {
        if (argv[i][0] == '-') continue;
        ++words;
        if (strstr(name, argv[i])) return 1;
    }
    return words == 0;
}

static inline int expect_flag(const char *flag, int argc, char **argv)
{
    int i;
    for (i = 1; i < argc; ++i)
        if (strcmp(argv[i], flag) == 0) return 1;
    return 0;
}

/* Runs one test: 0 passed, 1 failed, 2 skipped. */
static inline int expect_run(expect_test *test, int verbose)
{
    clock_t start = clock();
    double seconds;
    expect_state.current = test->name;
    expect_state.checks = expect_state.failures = expect_state.skipped = 0;
    test->run();
    seconds = (double)(clock() - start) / (double)CLOCKS_PER_SEC;
    if (expect_state.checks == 0 && !expect_state.skipped) {
        expect_state.failures = 1;
        printf("%s: made no check\n", test->name);
    }
    if (expect_state.failures) {
        printf("not ok %s: %d of %d checks failed\n", test->name, expect_state.failures, expect_state.checks);
        return 1;
    }
    if (verbose && !expect_state.skipped)
        printf("ok %s (%d checks, %.2f s)\n", test->name, expect_state.checks, seconds);
    return expect_state.skipped ? 2 : 0;
}

static inline int expect_main(int argc, char **argv)
{
    const char *slash = strrchr(argv[0], '/'), *counts = getenv("EXPECT_COUNTS");
    int verbose = expect_flag("-v", argc, argv), n[3] = {0, 0, 0};
    expect_test *test;
    for (test = expect_state.first; test; test = test->next) {
        if (!expect_wanted(test->name, argc, argv)) continue;
        if (expect_flag("-l", argc, argv)) puts(test->name);
        else ++n[expect_run(test, verbose)];
        fflush(stdout);
    }
    if (expect_flag("-l", argc, argv)) return 0;
    printf("%s: %d passed, %d failed, %d skipped\n", slash ? slash + 1 : argv[0], n[0], n[1], n[2]);
    if (counts && *counts) {
        FILE *file = fopen(counts, "a");
        if (!file) return 1;
        fprintf(file, "%d %d %d\n", n[0], n[1], n[2]);
        fclose(file);
    }
    return n[1] != 0;
}

#define EXPECT_MAIN() int main(int argc, char **argv) { return expect_main(argc, argv); }

#endif /* EXPECT_H */
