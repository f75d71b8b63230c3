/* The build table of bench_sat.cpp once more, with the eight-lane loop that sat.h has for AVX2 (the Makefile adds
   -mavx2). */
#define BENCH_BUILD_ONLY
#include "bench_sat.cpp"
