/* The first program with ssao_sat.h: how open every pixel of a depth buffer is.
   SPDX-License-Identifier: MIT-0 OR Unlicense
   cc -O2 first_ssao_sat.c -lm && ./a.out               writes first_ssao_sat.png */

#define SAT_IMPLEMENTATION
#define SSAO_SAT_IMPLEMENTATION
#include "../ssao_sat.h"
#include "png.h"

enum { WIDTH = 640, HEIGHT = 360 };
static float depth[WIDTH * HEIGHT], open[WIDTH * HEIGHT];
static unsigned char shown[WIDTH * HEIGHT];

/* Distance along the view axis of what the ray (x, y, 1) meets: a floor, a wall, and balls on the floor. */
static float meet(float x, float y)
{
    float nearest = y < 0 ? fminf(6, -1 / y) : 6;
    int i;
    for (i = 0; i < 5; i++) {
        float r = 0.35f + 0.1f * (float)(i % 3), c[3], b, q, a = x * x + y * y + 1;
        c[0] = 0.95f * (float)i - 1.9f, c[1] = r - 1, c[2] = 3.5f + 0.8f * (float)(i % 2);
        b = x * c[0] + y * c[1] + c[2];
        q = b * b - a * (c[0] * c[0] + c[1] * c[1] + c[2] * c[2] - r * r);
        if (q > 0) nearest = fminf(nearest, (b - sqrtf(q)) / a);
    }
    return nearest;
}

int main(void)
{
    const double fov = 0.9; /* full height of the view in radians */
    ssao_sat_options options = ssao_sat_defaults();
    ssao_sat_input input = ssao_sat_input_linear(depth, WIDTH, HEIGHT, fov);
    ssao_sat *ao;
    char why[200];
    float s = (float)tan(fov / 2) * 2 / HEIGHT;
    int x, y;
    for (y = 0; y < HEIGHT; y++)
        for (x = 0; x < WIDTH; x++)
            depth[y * WIDTH + x] = meet(((float)x + 0.5f - WIDTH / 2) * s, (HEIGHT / 2 - (float)y - 0.5f) * s);
    options.radius = 0.6; /* how far away an occluder counts, in units of depth */
    if (ssao_sat_create(&ao, WIDTH, HEIGHT, &options) != SAT_OK) {
        fprintf(stderr, "%s\n", ssao_sat_explain(why, sizeof why, WIDTH, HEIGHT, &options));
        return 1;
    }
    if (ssao_sat_apply(ao, open, 0, &input, NULL) != SAT_OK) return 1; /* for every frame */
    ssao_sat_destroy(ao);
    for (x = 0; x < WIDTH * HEIGHT; x++) shown[x] = (unsigned char)(255 * open[x] + 0.5f);
    return !png_save("first_ssao_sat.png", shown, WIDTH, HEIGHT, 1);
}
