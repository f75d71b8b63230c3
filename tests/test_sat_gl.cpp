#include "expect.h"
#define SAT_IMPLEMENTATION
#define SAT_GL
#include "sat.h"
#include "test_sat_gl.h"
EXPECT_MAIN()
