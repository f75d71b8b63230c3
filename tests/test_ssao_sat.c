#define SAT_IMPLEMENTATION
#define SSAO_SAT_IMPLEMENTATION
#include "ssao_sat.h"
#include "expect.h"
#include "support.h"
#include "mesh.h"
#include "reference_ssao.h"
#include "test_ssao_sat.h"
EXPECT_MAIN()
