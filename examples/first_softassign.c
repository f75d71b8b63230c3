/* The first program with softassign.h: a picture made of the tiles of another one, each used once.
   SPDX-License-Identifier: MIT-0 OR Unlicense
   cc -O2 first_softassign.c -lm && ./a.out             writes first_softassign.png */

#define SAT_IMPLEMENTATION
#define SOFTASSIGN_IMPLEMENTATION
#include "../softassign.h"
#include "png.h"

enum { GRID = 32, SHEET = 64, TILE = 12, SIDE = GRID * TILE, WIDE = SHEET * TILE };
enum { CELLS = GRID * GRID, TILES = SHEET * SHEET, PARTS = 2, FEATURES = PARTS * PARTS * 3 };
static unsigned char target[3 * SIDE * SIDE], other[3 * WIDE * WIDE], mosaic[3 * SIDE * SIDE];
static float wanted[CELLS * FEATURES], offered[TILES * FEATURES];
static int tile_of_cell[CELLS];

static sat_image view(const unsigned char *pixels, int side)
{
    sat_image image = sat_image_f32(NULL, side, side, 3);
    image.pixels = pixels;
    image.stride = 3 * side;
    image.format = SAT_U8;
    return image;
}

int main(void)
{
    sat_image target_view = view(target, SIDE), other_view = view(other, WIDE);
    softassign_problem problem;
    softassign_stats report;
    sat_result result;
    int x, y, c;
    for (y = 0; y < SIDE; y++) /* a sun over the sea */
        for (x = 0; x < SIDE; x++)
            for (c = 0; c < 3; c++) {
                int dx = x - 200, dy = y - 170, sun = dx * dx + dy * dy < 9000, sea = y > 240;
                target[3 * (y * SIDE + x) + c] = (unsigned char)(sun && !sea ? 240 - 50 * c
                                                                 : sea       ? 30 + 40 * c
                                                                             : 190 - y / 3 - 15 * c);
            }
    for (y = 0; y < WIDE; y++) /* waves of many colours */
        for (x = 0; x < WIDE; x++)
            for (c = 0; c < 3; c++)
                other[3 * (y * WIDE + x) + c] =
                    (unsigned char)(128 + 80 * sin(0.011 * x + 0.3 * c) + 40 * sin(0.017 * y * (1 + c) + sin(0.1 * x)));
    result = softassign_features(wanted, &target_view, GRID, GRID, PARTS, PARTS, NULL); /* what the cells look like */
    if (!result) result = softassign_features(offered, &other_view, SHEET, SHEET, PARTS, PARTS, NULL);
    memset(&problem, 0, sizeof problem);
    problem.rows = CELLS, problem.columns = TILES;
    problem.row_features = wanted, problem.column_features = offered;
    problem.feature_count = FEATURES;
    if (!result) result = softassign_solve(tile_of_cell, &problem, NULL, &report);
    if (!result)
        result = softassign_mosaic(mosaic, 3 * SIDE, &other_view, TILE, TILE, tile_of_cell, GRID, GRID, NULL, 0);
    if (result) {
        fprintf(stderr, "%s\n", sat_result_text(result));
        return 1;
    }
    printf("at most %.2g %% from the best choice\n", 100 * report.gap);
    return !png_save("first_softassign.png", mosaic, SIDE, SIDE, 3);
}
