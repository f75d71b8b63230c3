/* A whole program that uses fiv.h: a tetrahedron casts its shadow. */
#define SAT_IMPLEMENTATION
#define FIV_IMPLEMENTATION
#include "fiv.h"

int main(void)
{
    static const float corners[12] = {0, 1, 0, 1, -1, 1, -1, -1, 1, 0, -1, -1};
    static const unsigned triangles[12] = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
    static const float sky[6] = {1, 2, 3, 1, 2, 3}, point[3] = {0, -2, 0}, up[3] = {0, 1, 0};
    sat_image image = sat_image_f32(sky, 2, 1, 3);
    fiv_environment *environment = NULL;
    fiv_occluder *occluder = NULL;
    fiv_occluder_options options = fiv_occluder_defaults();
    fiv_instance instance = {0, {0, 0, 0}, 1};
    float open[3], rgb[3] = {0, 0, 0};
    sat_result result;
    options.theta = 8, options.phi = 5, options.rho = 4;
#ifdef FIV_NO_MASKS
    options.keep_masks = 0;
#endif
    result = fiv_environment_create(&environment, &image, NULL, NULL);
    if (!result) result = fiv_occluder_create(&occluder, corners, 4, triangles, 4, &options, NULL);
    if (!result) result = fiv_occluder_light(occluder, environment, NULL);
    instance.occluder = occluder;
    if (!result) result = fiv_irradiance(rgb, point, up, 1, environment, &instance, 1, NULL, NULL);
    if (!result) fiv_environment_irradiance(open, environment, up);
    fiv_occluder_destroy(occluder);
    fiv_environment_destroy(environment);
    return result || !(rgb[1] > 0 && rgb[1] < 0.9f * open[1]) || fiv_version() != FIV_VERSION;
}
