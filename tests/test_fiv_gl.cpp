/* The tests of fiv.h on the GPU, as C++11. */
#define LIGHTSCAN_IMPLEMENTATION
#define FIV_GL
#include "test_fiv_gl.h"
EXPECT_MAIN()
