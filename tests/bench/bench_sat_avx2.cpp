/* The build table of bench_sat.cpp once more, with the eight-lane loop that sat.h has for AVX2. */
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#pragma GCC target("avx2")
#endif
#define BENCH_BUILD_ONLY
#include "bench_sat.cpp"
