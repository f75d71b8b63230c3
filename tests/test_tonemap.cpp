#include "expect.h"
#define SAT_IMPLEMENTATION
#define TONEMAP_IMPLEMENTATION
#include "tonemap.h"
#include "test_tonemap.h"
EXPECT_MAIN()
