/* The checks of expect.h must fail when they should, above all on NaN. */

static float expect_nan_f(void)
{
    uint32_t bits = UINT32_C(0x7fc00001);
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static double expect_inf(void) { return 1e308 * 10.0; }

/* ---- checks that must fail: run one at a time by a child of this program ---- */

#define CHILDREN(X) \
    X(true_of_nan, EXPECT((double)expect_nan_f() < 1.0)) \
    X(equal, EXPECT_EQ(1, 2)) \
    X(near_nan, EXPECT_NEAR(expect_nan_f(), 1, 10)) \
    X(near_nan_nan, EXPECT_NEAR(expect_nan_f(), expect_nan_f(), 10)) \
    X(near_nan_limit, EXPECT_NEAR(1, 1.5, expect_nan_f())) \
    X(near_inf_finite, EXPECT_NEAR(expect_inf(), 1, 10)) \
    X(near_inf_minus_inf, EXPECT_NEAR(expect_inf(), -expect_inf(), 10)) \
    X(near_far, EXPECT_NEAR(1, 2, 0.5)) \
    X(rel_nan, EXPECT_REL(1, expect_nan_f(), 10)) \
    X(rel_zero, EXPECT_REL(1e-30, 0, 0.5)) \
    X(rel_far, EXPECT_REL(-1.1, -1, 0.01)) \
    X(ulp_nan, EXPECT_ULP(expect_nan_f(), expect_nan_f(), 1000000)) \
    X(ulp_far, EXPECT_ULP(1.0f, 1.0f + 3 * 1.1920929e-7f, 2)) \
    X(ulp_sign, EXPECT_ULP(-1e-38f, 1e-38f, 5)) \
    X(no_check, (void)0)

#define CHILD_FUNCTION(name, check) static void child_##name(void) { check; }
#define CHILD_ENTRY(name, check) {#name, child_##name, NULL},
CHILDREN(CHILD_FUNCTION)
static expect_test children[] = {CHILDREN(CHILD_ENTRY) {NULL, NULL, NULL}};

static const char *expect_program;   /* set by main of the twins */

/* What a child prints; its exit status. */
static int expect_child(const char *name, char *out, size_t size)
{
    char command[4096];
    FILE *pipe;
    snprintf(command, sizeof command, "EXPECT_COUNTS= EXPECT_CHILD=1 '%s' %s 2>&1", expect_program, name);
    pipe = popen(command, "r");
    if (!pipe) return -1;
    out[fread(out, 1, size - 1, pipe)] = 0;
    return pclose(pipe);
}

TEST(wrong_checks_fail)
{
    expect_test *child;
    char out[4096];
    for (child = children; child->name; ++child)
        if (!EXPECT(expect_child(child->name, out, sizeof out) > 0) ||
            !EXPECT(strstr(out, "\nnot ok ") || strncmp(out, "not ok ", 7) == 0))
            printf("    in %s: %s\n", child->name, out);
}

TEST(failures_show_place_and_values)
{
    char out[4096];
    EXPECT(expect_child("rel_far", out, sizeof out) > 0);
    EXPECT(strstr(out, "test_expect.h:") != NULL);
    EXPECT(strstr(out, "-1.1 against -1") != NULL);
    EXPECT(strstr(out, "0 passed, 1 failed, 0 skipped") != NULL);
}

TEST(right_checks_hold)
{
    EXPECT(1 + 1 == 2);
    EXPECT_EQ(UINT64_C(0xffffffffffffffff), UINT64_C(0xffffffffffffffff));
    EXPECT_NEAR(1, 1.5, 0.5);
    EXPECT_NEAR(expect_inf(), expect_inf(), 0);
    EXPECT_REL(-1.01, -1, 0.011);
    EXPECT_REL(0, 0, 0);
    EXPECT_ULP(1.0f, 1.0f + 2 * 1.1920929e-7f, 2);
    EXPECT_ULP(-0.0f, 0.0f, 0);
    EXPECT_ULP(-1e-45f, 1e-45f, 2);
    EXPECT(expect_is_nan((double)expect_nan_f()));
    EXPECT(!expect_is_nan(expect_inf()));
}

TEST(checks_are_expressions)
{
    if (!EXPECT(1)) EXPECT(0);
    REPORT("two halves", 2 * 0.5, "");
}

/* With EXPECT_CHILD in the environment the tests are the children, not those above. */
int main(int argc, char **argv)
{
    expect_test *child;
    expect_program = argv[0];
    if (getenv("EXPECT_CHILD")) {
        expect_state.first = expect_state.last = NULL;
        for (child = children; child->name; ++child) expect_add(child);
    }
    return expect_main(argc, argv);
}
