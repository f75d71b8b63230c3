/* Compiles the header alone under the strictest flags, and calls it. */
#define SAT_IMPLEMENTATION
#include "sat.h"
#define SOFTASSIGN_IMPLEMENTATION
#include "softassign.h"
#include <string.h>

int main(void)
{
    static const float cost[6] = {1, 2, 3, 1, 3, 9};
    softassign_problem problem;
    int column_of_row[2];
    memset(&problem, 0, sizeof problem);
    problem.rows = 2;
    problem.columns = 3;
    problem.cost = cost;
    problem.stride = 3;
    return softassign_solve(column_of_row, &problem, NULL, NULL) != SAT_OK || column_of_row[0] != 1 ||
           column_of_row[1] != 0;
}
