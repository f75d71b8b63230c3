/* support.h - what tests and benchmarks share: allocators, parallel_for, random numbers, clock, hash, pictures, data.
   SPDX-License-Identifier: MIT-0 OR Unlicense

   Include after sat.h's IMPLEMENTATION macro is settled; compile with -D_POSIX_C_SOURCE=200809L (the Makefile does)
   and link -lpthread. Everything is static inline. */

#ifndef SUPPORT_H
#define SUPPORT_H

#include <math.h>
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "sat.h"

/* ---- memory: counts calls, fails at the n-th, and checks that blocks come back with the size they left with ---- */

typedef struct support_memory {
    long calls;       /* allocations asked for so far */
    long fail_at;     /* this call (1 = the first) and all later ones return NULL; 0 = never */
    long live;        /* blocks not yet released */
    size_t bytes;     /* bytes not yet released */
    size_t peak;      /* largest value of bytes */
    long errors;      /* releases of a wrong size, or of something that never was a block */
} support_memory;

typedef struct support_block { uint64_t magic; size_t size; char pad[48]; } support_block;

#define SUPPORT_MAGIC UINT64_C(0x6c69676874736361)

static inline void *support_alloc(size_t size, void *user)
{
    support_memory *m = (support_memory *)user;
    support_block *block;
    ++m->calls;
    if (m->fail_at > 0 && m->calls >= m->fail_at) return NULL;
    if (size > SIZE_MAX - sizeof *block) return NULL;
    block = (support_block *)malloc(sizeof *block + size);
    if (!block) return NULL;
    block->magic = SUPPORT_MAGIC;
    block->size = size;
    memset(block + 1, 0xa5, size);    /* nobody may count on zeroed memory */
    ++m->live;
    m->bytes += size;
    if (m->bytes > m->peak) m->peak = m->bytes;
    return block + 1;
}

static inline void support_release(void *p, size_t size, void *user)
{
    support_memory *m = (support_memory *)user;
    support_block *block = (support_block *)p;
    if (!p) return;
    --block;
    if (block->magic != SUPPORT_MAGIC) { ++m->errors; return; }
    if (block->size != size) ++m->errors;
    --m->live;
    m->bytes -= block->size;
    block->magic = 0;
    free(block);
}

/* An allocator that books into *m; set m->fail_at before or after. */
static inline sat_allocator support_allocator(support_memory *m)
{
    sat_allocator a;
    memset(m, 0, sizeof *m);
    a.alloc = support_alloc;
    a.release = support_release;
    a.user = m;
    return a;
}

/* Everything went back, with the right sizes. */
static inline int support_memory_clean(const support_memory *m)
{
    return m->live == 0 && m->bytes == 0 && m->errors == 0;
}

/* ---- threads ---- */

enum { SUPPORT_MAX_WORKERS = 64 };

/* user of the hooks below: a pointer into this table is the number of workers */
static inline int *support_worker_count(int workers)
{
    static int table[SUPPORT_MAX_WORKERS + 1];
    if (workers < 1) workers = 1;
    if (workers > SUPPORT_MAX_WORKERS) workers = SUPPORT_MAX_WORKERS;
    table[workers] = workers;
    return &table[workers];
}

typedef struct support_job {
    sat_range_fn *body;
    void *context;
    int count, chunk, next;
    pthread_mutex_t lock;
} support_job;

typedef struct support_worker { support_job *job; int index; } support_worker;

static inline void *support_work(void *p)
{
    support_worker *w = (support_worker *)p;
    support_job *job = w->job;
    for (;;) {
        int begin, end;
        pthread_mutex_lock(&job->lock);
        begin = job->next;
        end = job->count - begin > job->chunk ? begin + job->chunk : job->count;
        job->next = end;
        pthread_mutex_unlock(&job->lock);
        if (begin >= end) return NULL;
        job->body(begin, end, w->index, job->context);
    }
}

static inline void support_parallel_for(int count, sat_range_fn *body, void *context, void *user)
{
    int workers = *(int *)user, i;
    support_job job;
    support_worker worker[SUPPORT_MAX_WORKERS];
    pthread_t thread[SUPPORT_MAX_WORKERS];
    int started[SUPPORT_MAX_WORKERS] = {0};
    job.body = body;
    job.context = context;
    job.count = count;
    job.chunk = count / (4 * workers) + 1;
    job.next = 0;
    pthread_mutex_init(&job.lock, NULL);
    for (i = 0; i < workers; ++i) {
        worker[i].job = &job;
        worker[i].index = i;
        if (i > 0) started[i] = pthread_create(&thread[i], NULL, support_work, &worker[i]) == 0;
    }
    support_work(&worker[0]);
    for (i = 1; i < workers; ++i)
        if (started[i]) pthread_join(thread[i], NULL);
    pthread_mutex_destroy(&job.lock);
}

/* One thread, but the work arrives in pieces of 1, 2, 3, 1, ... items, last piece first, under changing worker
   numbers: results that depend on how the work is cut or ordered differ from the serial ones, every time. */
static inline void support_odd_for(int count, sat_range_fn *body, void *context, void *user)
{
    int workers = *(int *)user, end = count, piece = 0;
    while (end > 0) {
        int size = 1 + piece % 3, begin = end > size ? end - size : 0;
        body(begin, end, piece % workers, context);
        end = begin;
        ++piece;
    }
}

static inline sat_threads support_make_threads(
    int workers, void (*loop)(int count, sat_range_fn *body, void *context, void *user))
{
    sat_threads t;
    memset(&t, 0, sizeof t);
    t.parallel_for = loop;
    t.user = support_worker_count(workers);
    t.workers = *(int *)t.user;
    return t;
}

/* Real threads (started anew by each call), and the odd order on one thread. */
static inline sat_threads support_threads(int workers) { return support_make_threads(workers, support_parallel_for); }
static inline sat_threads support_odd_threads(int workers) { return support_make_threads(workers, support_odd_for); }

/* ---- hash, random numbers ---- */

/* FNV-1a, 64 bit. Start with support_hash(p, n), go on with support_hash_add. */
static inline uint64_t support_hash_add(uint64_t hash, const void *bytes, size_t size)
{
    const unsigned char *p = (const unsigned char *)bytes;
    size_t i;
    for (i = 0; i < size; ++i) hash = (hash ^ p[i]) * UINT64_C(0x100000001b3);
    return hash;
}

static inline uint64_t support_hash(const void *bytes, size_t size)
{
    return support_hash_add(UINT64_C(0xcbf29ce484222325), bytes, size);
}

/* splitmix64: any seed will do; the state is the argument. */
static inline uint64_t support_random(uint64_t *state)
{
    uint64_t z = (*state += UINT64_C(0x9e3779b97f4a7c15));
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

/* 1 where the program asked for subnormal floats to count as 0 (-ffast-math and -Ofast of gcc do), at run time. */
static inline int support_subnormals_flushed(void)
{
    volatile float tiny = 1.17549435e-38f, half = 0.5f;
    return tiny * half == 0;
}

/* The larger one, and NaN when either is: the largest error of a test must not hide one that is no number. */
static inline double support_larger(double a, double b) { return a >= b || a != a ? a : b; }

/* uniform in [0, 1) */
static inline double support_uniform(uint64_t *state)
{
    return (double)(support_random(state) >> 11) * (1.0 / 9007199254740992.0);
}

/* integer in [0, n) */
static inline int support_below(uint64_t *state, int n)
{
    return (int)(support_uniform(state) * (double)n);
}

/* normal deviate (Box and Muller 1958), mean 0, variance 1 */
static inline double support_gaussian(uint64_t *state)
{
    double u = 1.0 - support_uniform(state), v = support_uniform(state);
    return sqrt(-2.0 * log(u)) * cos(6.283185307179586476925 * v);
}

/* ---- time ---- */

/* seconds, monotonic */
static inline double support_clock(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static inline int support_compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Median; sorts the values in place. */
static inline double support_median(double *values, int count)
{
    if (count < 1) return 0.0;
    qsort(values, (size_t)count, sizeof *values, support_compare_doubles);
    return 0.5 * (values[(count - 1) / 2] + values[count / 2]);
}

/* ---- pictures ---- */

/* A smooth field from 1e8 at the top to 1e-6 at the bottom under mild noise, `channels` floats a pixel, rows packed;
   the same for the same seed. Alpha (channel 3) is 1. */
static inline void support_hdr_image(float *pixels, int width, int height, int channels, uint64_t seed)
{
    uint64_t state = seed;
    double phase = 6.28 * support_uniform(&state);
    int x, y, c;
    for (y = 0; y < height; ++y) {
        for (x = 0; x < width; ++x) {
            double u = ((double)x + 0.5) / (double)width, v = ((double)y + 0.5) / (double)height;
            double depth = 0.1 + 0.8 * v + 0.1 * sin(6.28 * u + phase);
            double light = pow(10.0, 8.0 - 14.0 * depth) * (1.0 + 0.2 * (support_uniform(&state) - 0.5));
            for (c = 0; c < channels; ++c) {
                double tint = c == 3 ? 1.0 : light * (1.0 + 0.3 * sin(6.28 * (u * (c + 1) + v)));
                pixels[((size_t)y * (size_t)width + (size_t)x) * (size_t)channels + (size_t)c] = (float)tint;
            }
        }
    }
}

/* n floats, uniform in [low, high) */
static inline void support_fill(float *values, size_t count, double low, double high, uint64_t seed)
{
    size_t i;
    for (i = 0; i < count; ++i) values[i] = (float)(low + (high - low) * support_uniform(&seed));
}

/* ---- data ---- */

/* Path of an input such as "hdr/StillLife.exr", looked for in $LIGHTSCAN_DATA, ../shared/data and data; NULL when
   it is nowhere (SKIP then). The text stays valid for the next seven calls. */
static inline const char *support_data(const char *name)
{
    static char paths[8][1024];
    static int turn;
    const char *folders[3];
    int i;
    folders[0] = getenv("LIGHTSCAN_DATA");
    folders[1] = "../shared/data";
    folders[2] = "data";
    turn = (turn + 1) % 8;
    for (i = 0; i < 3; ++i) {
        FILE *file;
        if (!folders[i] || snprintf(paths[turn], sizeof paths[0], "%s/%s", folders[i], name) >= (int)sizeof paths[0])
            continue;
        file = fopen(paths[turn], "rb");
        if (file) { fclose(file); return paths[turn]; }
    }
    return NULL;
}

#endif /* SUPPORT_H */
