#include "expect.h"
#define SAT_IMPLEMENTATION
#define TONEMAP_IMPLEMENTATION
#define TONEMAP_GL
#include "tonemap.h"
#include "test_tonemap_gl.h"
EXPECT_MAIN()
