#define SAT_IMPLEMENTATION
#define SSAO_SAT_IMPLEMENTATION
#define SSAO_SAT_GL
#include "ssao_sat.h"
#include "expect.h"
#include "support.h"
#include "mesh.h"
#include "gl_context.h"
#include "reference_ssao.h"
#include "test_ssao_sat_gl.h"
EXPECT_MAIN()
