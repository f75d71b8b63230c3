/* snippets.h - what the programs under USE in the headers' first comments take for given; tests/check_house.sh compiles
   them behind this.                                                   SPDX-License-Identifier: MIT-0 OR Unlicense */

#include <stddef.h>

enum { TRACKS = 3, DETECTIONS = 4 };
extern int width, height, x, y;
extern float *pixels, *depth, *rgb, *points, *normals;
#ifdef TONEMAP_H
extern unsigned char *srgb;
#endif
#ifdef SSAO_SAT_H
extern float *open;
#endif
#ifdef FIV_H
extern fiv_environment *sky;
extern fiv_occluder *bunny;
extern fiv_instance instance;
extern sat_image equirect;
extern float *positions, rotation[9];
extern unsigned *indices;
extern size_t vertex_count, triangle_count, count;
#endif
#ifdef RAINDROP_H
extern sat_image equirectangular_image;
extern raindrop_camera camera;
#endif
#ifdef SOFTASSIGN_H
extern int *column_of_row;
extern float *patches, *tiles;
#endif
