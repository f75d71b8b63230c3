/* The first program with sat.h: a picture whose blur grows from left to right, in the same time a pixel for any width.
   SPDX-License-Identifier: MIT-0 OR Unlicense
   cc -O2 first_sat.c -lm && ./a.out                    writes first_sat.png */

#define SAT_IMPLEMENTATION
#include "../sat.h"
#include "png.h"

enum { WIDTH = 640, HEIGHT = 360 };
static float pixels[WIDTH * HEIGHT];
static unsigned char shown[WIDTH * HEIGHT];

int main(void)
{
    sat_image image = sat_image_f32(pixels, WIDTH, HEIGHT, 1);
    sat_table *table;
    sat_result result;
    int x, y;
    for (y = 0; y < HEIGHT; y++) /* rings on squares */
        for (x = 0; x < WIDTH; x++) {
            int dx = x % 160 - 80, dy = y % 120 - 60;
            pixels[y * WIDTH + x] =
                (float)(((x / 10 + y / 10) % 2 ? 60 : 120) + ((dx * dx + dy * dy) / 400 % 2 ? 120 : 0));
        }
    result = sat_create(&table, WIDTH, HEIGHT, 1, NULL); /* the only allocation */
    if (result == SAT_OK) result = sat_build(table, &image);
    if (result != SAT_OK) {
        fprintf(stderr, "%s\n", sat_result_text(result));
        return 1;
    }
    for (y = 0; y < HEIGHT; y++)
        for (x = 0; x < WIDTH; x++) {
            int r = x / 16; /* 0 to 39: boxes of 1 to 79 pixels, cut at the border */
            shown[y * WIDTH + x] = (unsigned char)(sat_mean(table, 0, x - r, y - r, x + r + 1, y + r + 1) + 0.5);
        }
    sat_destroy(table);
    return !png_save("first_sat.png", shown, WIDTH, HEIGHT, 1);
}
