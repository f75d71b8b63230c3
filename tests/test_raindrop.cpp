#define SAT_IMPLEMENTATION
#define RAINDROP_IMPLEMENTATION
#include "raindrop.h"
#include "expect.h"
#include "support.h"
#include "test_raindrop.h"
EXPECT_MAIN()
