/* The first program with fiv.h: the soft shadow of a shape under a picture of the sky, on the ground seen from above.
   SPDX-License-Identifier: MIT-0 OR Unlicense
   cc -O2 first_fiv.c -lm && ./a.out                    writes first_fiv.png */

#define SAT_IMPLEMENTATION
#define FIV_IMPLEMENTATION
#include "../fiv.h"
#include "png.h"

enum { SIDE = 256, SKY = 128 };
static float sky[3 * SKY * SKY / 2], points[3 * SIDE * SIDE], up[3 * SIDE * SIDE], light[3 * SIDE * SIDE];
static unsigned char shown[3 * SIDE * SIDE];

int main(void)
{
    static const float corners[18] = {1, 0, 0, -1, 0, 0, 0, 1.6f, 0, 0, -1.6f, 0, 0, 0, 1, 0, 0, -1};
    static const unsigned triangles[24] = {0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5};
    sat_image picture = sat_image_f32(sky, SKY, SKY / 2, 3); /* all directions, by longitude and latitude */
    fiv_environment *environment = NULL;
    fiv_occluder *occluder = NULL;
    fiv_instance instance = {NULL, {0, 1.7f, 0}, 1};
    sat_result result;
    float open[3];
    int x, y, c;
    for (y = 0; y < SKY / 4; y++) /* blue above the horizon, and a sun */
        for (x = 0; x < SKY; x++)
            for (c = 0; c < 3; c++)
                sky[3 * (y * SKY + x) + c] =
                    (x > 38 && x < 44 && y > 12 && y < 18) ? 160 - 20 * (float)c : 0.6f + 0.3f * (float)c;
    for (y = 0; y < SIDE; y++)
        for (x = 0; x < SIDE; x++) {
            float *p = points + 3 * (y * SIDE + x);
            p[0] = 6 * ((float)x / SIDE - 0.5f), p[1] = 0, p[2] = 6 * ((float)y / SIDE - 0.5f);
            up[3 * (y * SIDE + x) + 1] = 1;
        }
    result = fiv_environment_create(&environment, &picture, NULL, NULL);
    if (!result)
        result = fiv_occluder_create(&occluder, corners, 6, triangles, 8, NULL, NULL); /* slow, once for a shape */
    if (!result) result = fiv_occluder_light(occluder, environment, NULL); /* when the light changes */
    instance.occluder = occluder;
    if (!result) result = fiv_irradiance(light, points, up, SIDE * SIDE, environment, &instance, 1, NULL, NULL);
    if (result) {
        fprintf(stderr, "%s\n", sat_result_text(result));
        return 1;
    }
    fiv_environment_irradiance(open, environment, up); /* where nothing is in the way */
    for (x = 0; x < 3 * SIDE * SIDE; x++) shown[x] = (unsigned char)(230 * sqrtf(fminf(light[x] / open[x % 3], 1)));
    fiv_occluder_destroy(occluder);
    fiv_environment_destroy(environment);
    return !png_save("first_fiv.png", shown, SIDE, SIDE, 3);
}
