/* Every public function with NULL or zero for each argument in turn, in a child each: nothing may crash or hang.
   build/null_arguments.h is made from the prototypes by tests/null_arguments.awk; tests/check_house.sh does both.
   Prints the calls that died. SPDX-License-Identifier: MIT-0 OR Unlicense */

#define _POSIX_C_SOURCE 200809L
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define LIGHTSCAN_IMPLEMENTATION
#include "sat.h"
#include "tonemap.h"
#include "ssao_sat.h"
#include "fiv.h"
#include "raindrop.h"
#include "softassign.h"

enum { SIDE = 8 };

static double buffer[16][1 << 17];       /* what an argument may read or write: 1 MiB each */
static sat_image some_image;

/* one usable object of each kind; those of OpenGL stay NULL: there is no context here */
static sat_table *object_sat_table;
static sat_stream *object_sat_stream;
static sat_moments *object_sat_moments;
static tonemap *object_tonemap;
static ssao_sat *object_ssao_sat;
static fiv_environment *object_fiv_environment;
static fiv_occluder *object_fiv_occluder;
static raindrop_map *object_raindrop_map;
static raindrop_environment *object_raindrop_environment;
static raindrop_rain *object_raindrop_rain;
static softassign *object_softassign;
static sat_gl *object_sat_gl;
static tonemap_gl *object_tonemap_gl;
static ssao_sat_gl *object_ssao_sat_gl;
static fiv_gl *object_fiv_gl;
static raindrop_gl *object_raindrop_gl;
static softassign_gl *object_softassign_gl;

#include "null_arguments.h"

static int make_objects(void)
{
    static float pixels[3 * SIDE * SIDE * 2];
    static const float corners[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const unsigned faces[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    sat_image equirect;
    fiv_occluder_options o = fiv_occluder_defaults();
    raindrop_rain_options r = raindrop_rain_defaults();
    raindrop_map_options m = raindrop_map_defaults();
    int i, bad = 0;
    for (i = 0; i < 3 * SIDE * SIDE * 2; ++i) pixels[i] = 0.5f + 0.01f * (float)(i % 7);
    some_image = sat_image_f32(pixels, SIDE, SIDE, 3);
    equirect = sat_image_f32(pixels, 2 * SIDE, SIDE, 3);
    o.theta = 8, o.phi = 5, o.rho = 3;
    r.count = 100;
    m.resolution = 16;
    bad += sat_create(&object_sat_table, SIDE, SIDE, 3, NULL) != SAT_OK;
    bad += sat_build(object_sat_table, &some_image) != SAT_OK;
    bad += sat_stream_create(&object_sat_stream, SIDE, 1, 2, NULL) != SAT_OK;
    bad += sat_moments_create(&object_sat_moments, SIDE, SIDE, 3, NULL) != SAT_OK;
    bad += tonemap_create(&object_tonemap, SIDE, SIDE, NULL) != SAT_OK;
    bad += ssao_sat_create(&object_ssao_sat, SIDE, SIDE, NULL) != SAT_OK;
    bad += fiv_environment_create(&object_fiv_environment, &equirect, NULL, NULL) != SAT_OK;
    bad += fiv_occluder_create(&object_fiv_occluder, corners, 4, faces, 4, &o, NULL) != SAT_OK;
    bad += raindrop_map_create(&object_raindrop_map, &m) != SAT_OK;
    bad += raindrop_environment_create(&object_raindrop_environment, &equirect, NULL, NULL) != SAT_OK;
    bad += raindrop_rain_create(&object_raindrop_rain, &r) != SAT_OK;
    bad += softassign_create(&object_softassign, SIDE, SIDE, NULL) != SAT_OK;
    return bad;
}

int main(void)
{
    size_t i, count = sizeof calls / sizeof *calls, died = 0;
    int status, bad = make_objects();
    fill_options();
    if (bad) printf("%d objects could not be made\n", bad);
    fflush(stdout);
    for (i = 0; i < count; ++i) {
        pid_t child = fork();
        if (child == 0) {
            alarm(20);
            calls[i].call();
            _exit(0);
        }
        if (child < 0 || waitpid(child, &status, 0) < 0) return 2;
        if (WIFSIGNALED(status)) {
            printf("%s: %s\n", calls[i].what, WTERMSIG(status) == SIGALRM ? "does not end" : "crashes");
            ++died;
        }
    }
    fprintf(stderr, "%d calls, %d died\n", (int)count, (int)died);
    return died || bad;
}
