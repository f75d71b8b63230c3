#include "expect.h"
#define SAT_IMPLEMENTATION
#include "sat.h"
#include "test_support.h"
EXPECT_MAIN()
