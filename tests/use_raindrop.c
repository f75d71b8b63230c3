/* Compiled at the strictest warnings; calls one function of each kind. */
#define SAT_IMPLEMENTATION
#include "sat.h"
#define RAINDROP_IMPLEMENTATION
#include "raindrop.h"

int main(void)
{
    const float direction[3] = {0, 0, -1}, offset[3] = {0.6f, 0, 0};
    raindrop_ray ray;
    raindrop_trace(&ray, direction, offset, 0.64f, RAINDROP_WATER);
    return !(raindrop_version() == RAINDROP_VERSION && ray.fresnel > 0 && ray.fresnel < 1);
}
