/* What other headers define: the headers of this project must compile after it (tests/check_house.sh). The standard
   headers go first, for they would not survive it. SPDX-License-Identifier: MIT-0 OR Unlicense */

#include <assert.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#ifdef __SSE2__
#include <emmintrin.h>
#include <immintrin.h>
#endif

/* windows.h, rpcndr.h */
#define min(a, b) (((a) < (b)) ? (a) : (b))
#define max(a, b) (((a) > (b)) ? (a) : (b))
#define near
#define far
#define small char
#define interface struct
#define pascal
#define cdecl
#define IN
#define OUT
#define VOID void
#define CONST const
#define TRUE 1
#define FALSE 0
#define ERROR 0
#define DELETE 1
#define IGNORE 0
#define STRICT 1
#define NO_ERROR 0
#define DIFFERENCE 11
/* Xlib.h */
#define None 0L
#define Status int
#define Bool int
#define True 1
#define False 0
#define Success 0
#define Always 2
#define Above 0
#define Below 1
#define Complex 1
/* complex.h, math.h of System V */
#define I (1.0fi)
#define DOMAIN 1
#define SING 2
#define OVERFLOW 3
#define UNDERFLOW 4
/* Qt */
#define slots
#define signals public
#define emit
#define foreach Q_FOREACH
#define forever for (;;)
/* raylib, SDL, and what compilers define in their GNU modes */
#define PI 3.14159265358979323846f
#define DEG2RAD 0.0174533f
#define RED 1
#define BLACK 2
#define CLAMP(v, a, b) (v)
#define main SDL_main
#define unix 1
#define linux 1
