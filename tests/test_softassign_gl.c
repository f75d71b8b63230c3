#include "expect.h"
#define SAT_IMPLEMENTATION
#define SOFTASSIGN_IMPLEMENTATION
#define SOFTASSIGN_GL
#include "softassign.h"
#include "test_softassign_gl.h"
EXPECT_MAIN()
