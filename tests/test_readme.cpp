#include "test_readme.h"
EXPECT_MAIN()
