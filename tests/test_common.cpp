#include "expect.h"
#define SAT_IMPLEMENTATION
#include "sat.h"
#include "test_common.h"
EXPECT_MAIN()
