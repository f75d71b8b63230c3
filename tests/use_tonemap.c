/* Compiles tonemap.h as a user would and calls it. */
#define TONEMAP_IMPLEMENTATION
#define SAT_IMPLEMENTATION
#include "tonemap.h"

int main(void)
{
    static const float pixels[12] = {0.01f, 0.01f, 0.01f, 1, 1, 1, 100, 50, 20, 0.1f, 0.2f, 0.3f};
    unsigned char out[12] = {0};
    return tonemap_once_u8(out, pixels, 2, 2, 3, NULL) != SAT_OK || out[0] >= out[3];
}
