#define SAT_IMPLEMENTATION
#include "sat.h"
#include "expect.h"
#include "support.h"
#include "image.h"
#include "test_sat.h"
EXPECT_MAIN()
