/* The first program with raindrop.h: rain before a picture of the surroundings, which shines through every drop.
   SPDX-License-Identifier: MIT-0 OR Unlicense
   cc -O2 first_raindrop.c -lm && ./a.out               writes first_raindrop.png */

#define SAT_IMPLEMENTATION
#define RAINDROP_IMPLEMENTATION
#include "../raindrop.h"
#include "png.h"

enum { WIDTH = 640, HEIGHT = 360, SKY = 512 };
static float sky[3 * SKY * SKY / 2], picture[3 * WIDTH * HEIGHT];
static unsigned char shown[3 * WIDTH * HEIGHT];

int main(void)
{
    const ptrdiff_t stride = 3 * WIDTH * (ptrdiff_t)sizeof(float);
    sat_image around = sat_image_f32(sky, SKY, SKY / 2, 3); /* all directions, by longitude and latitude */
    raindrop_environment *environment = NULL;
    raindrop_rain *rain = NULL;
    raindrop_rain_options options = raindrop_rain_defaults();
    raindrop_camera camera = raindrop_camera_defaults();
    sat_result result;
    int x, y;
    for (y = 0; y < SKY / 2; y++) /* an evening: bright above dark hills */
        for (x = 0; x < SKY; x++) {
            float up = cosf(3.1416f * ((float)y + 0.5f) / (SKY / 2)), *p = sky + 3 * (y * SKY + x);
            float hills = 0.06f + 0.03f * sinf((float)x * 0.0614f), glow = up > hills ? expf(-5 * (up - hills)) : 0;
            p[0] = up > hills ? 0.1f + 0.9f * glow : 0.03f;
            p[1] = up > hills ? 0.15f + 0.5f * glow : 0.04f;
            p[2] = up > hills ? 0.35f + 0.2f * glow : 0.03f;
        }
    options.count = 20000;        /* or options.rate_mm_h, and sizes as nature has them */
    options.diameter_mm = 5;
    options.box_size[0] = options.box_size[1] = options.box_size[2] = 3; /* metres around the camera */
    camera.fov_y = 0.8f;
    camera.depth_near = 0.1f;
    camera.exposure = 0;          /* frozen; 0.01 seconds: streaks */
    result = raindrop_environment_create(&environment, &around, NULL, NULL);
    if (!result) result = raindrop_rain_create(&rain, &options);
    if (!result) result = raindrop_environment_render(picture, stride, WIDTH, HEIGHT, &camera, environment, NULL);
    if (!result) result = raindrop_rain_advance(rain, 1 / 60.0); /* for every frame, then: */
    if (!result) result = raindrop_render(picture, stride, WIDTH, HEIGHT, NULL, &camera, rain, environment, NULL, NULL);
    if (result) {
        fprintf(stderr, "%s\n", sat_result_text(result));
        return 1;
    }
    for (x = 0; x < 3 * WIDTH * HEIGHT; x++) shown[x] = (unsigned char)(255 * sqrtf(fminf(picture[x], 1)));
    raindrop_rain_destroy(rain);
    raindrop_environment_destroy(environment);
    return !png_save("first_raindrop.png", shown, WIDTH, HEIGHT, 3);
}
