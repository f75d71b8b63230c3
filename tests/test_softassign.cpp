#include "expect.h"
#define SAT_IMPLEMENTATION
#include "sat.h"
#define SOFTASSIGN_IMPLEMENTATION
#include "softassign.h"
#include "test_softassign.h"
EXPECT_MAIN()
