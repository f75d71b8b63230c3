#define SAT_IMPLEMENTATION
#include "sat.h"

int main(void)
{
    float pixels[6] = {1, 2, 3, 4, 5, 6};
    sat_image image = sat_image_f32(pixels, 3, 2, 1);
    sat_table *table;
    double sum;
    if (sat_create(&table, 3, 2, 1, NULL) != SAT_OK) return 1;
    sat_build(table, &image);
    sum = sat_sum(table, 0, 1, 0, 3, 2);
    sat_destroy(table);
#ifdef SAT_GL
    if (sat_gl_table(NULL) != 0) return 1;
#endif
    return sum < 16 || sum > 16;
}
