#include "expect.h"
#include "test_expect.h"
