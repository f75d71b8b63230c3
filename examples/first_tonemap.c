/* The first program with tonemap.h: light from 0.01 to 10000, which no screen shows, as a picture for the screen.
   SPDX-License-Identifier: MIT-0 OR Unlicense
   cc -O2 first_tonemap.c -lm && ./a.out                writes first_tonemap.png */

#define SAT_IMPLEMENTATION
#define TONEMAP_IMPLEMENTATION
#include "../tonemap.h"
#include "png.h"

enum { WIDTH = 640, HEIGHT = 360 };
static float pixels[WIDTH * HEIGHT * 3]; /* linear light: red, green, blue */
static unsigned char shown[WIDTH * HEIGHT * 3];

int main(void)
{
    tonemap_options options = tonemap_defaults();
    sat_image hdr = sat_image_f32(pixels, WIDTH, HEIGHT, 3);
    sat_result result;
    tonemap *map;
    char why[200];
    int x, y, c;
    for (y = 0; y < HEIGHT; y++) /* a tiled wall, and a window to the sun */
        for (x = 0; x < WIDTH; x++) {
            float dx = (float)(x - 420) / 200, dy = (float)(y - 150) / 200, d = sqrtf(dx * dx + dy * dy);
            float light = fabsf(dx) < 0.3f && fabsf(dy) < 0.45f ? 300 + 10000 * expf(-40 * d * d) : 3 * expf(-4 * d);
            static const float colour[3] = {1.1f, 1, 0.8f};
            if (x % 40 < 2 || y % 30 < 2) light *= 0.3f;
            for (c = 0; c < 3; c++) pixels[3 * (y * WIDTH + x) + c] = light * colour[c];
        }
    options.key = 0.18;                        /* the middle grey of the picture */
    options.white = 0;                         /* what is shown as white: estimated */
    options.mesopic = TONEMAP_MESOPIC_LOCAL;   /* reds fade where it is dark */
    options.cd_per_unit = 1;                   /* a luminance of 1 is 1 cd/m2 */
    options.dither = 1;                        /* no bands in the slow gradients of the wall */
    if (tonemap_create(&map, WIDTH, HEIGHT, &options) != SAT_OK) {
        fprintf(stderr, "%s\n", tonemap_explain(why, sizeof why, WIDTH, HEIGHT, &options));
        return 1;
    }
    result = tonemap_apply_u8(map, shown, 0, &hdr, 0, NULL); /* for every frame */
    tonemap_destroy(map);
    if (result != SAT_OK) return 1;
    return !png_save("first_tonemap.png", shown, WIDTH, HEIGHT, 3);
}
