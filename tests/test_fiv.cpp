/* The tests of fiv.h as C++11. */
#define LIGHTSCAN_IMPLEMENTATION
#include "test_fiv.h"
EXPECT_MAIN()
