#define SAT_IMPLEMENTATION
#define SSAO_SAT_IMPLEMENTATION
#include "ssao_sat.h"

int main(void)
{
    float depth[64], open[64];
    ssao_sat_input in;
    ssao_sat *ao;
    int i;
    for (i = 0; i < 64; i++) depth[i] = 2;
    in = ssao_sat_input_linear(depth, 8, 8, 1.0);
    if (ssao_sat_create(&ao, 8, 8, NULL) != SAT_OK) return 1;
    if (ssao_sat_apply(ao, open, 0, &in, NULL) != SAT_OK) return 2;
    ssao_sat_destroy(ao);
    return open[20] < 0.999f;
}
