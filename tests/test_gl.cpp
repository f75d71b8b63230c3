/* What the OpenGL parts of all headers share: where they draw, what a frame may do. */
#define LIGHTSCAN_IMPLEMENTATION
#define TONEMAP_GL
#define SSAO_SAT_GL
#define FIV_GL
#define RAINDROP_GL
#define SOFTASSIGN_GL
#include "fiv.h"
#include "raindrop.h"
#include "softassign.h"
#include "ssao_sat.h"
#include "tonemap.h"
#include "expect.h"
#include "test_gl.h"
EXPECT_MAIN()
