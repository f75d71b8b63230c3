#define SAT_IMPLEMENTATION
#define RAINDROP_IMPLEMENTATION
#define RAINDROP_GL
#include "raindrop.h"
#include "expect.h"
#include "support.h"
#include "gl_context.h"
#include "reference_raindrop.h"
#include "test_raindrop_gl.h"
EXPECT_MAIN()
