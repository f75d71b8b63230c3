/* The frame of examples/gl_frame.c against the same stages on the CPU. */
#define FRAME_NO_MAIN
#include "../examples/gl_frame.c"
#include "expect.h"
#include "support.h"
#include "test_gl_frame.h"
EXPECT_MAIN()
