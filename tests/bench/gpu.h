/* gpu.h - what the GPU benches ask of OpenGL beside the headers' own table: the end of all work, and time on the GPU.
   Include it after sat.h with SAT_SIBLING_GL or SAT_GL. */

#ifndef GPU_H
#define GPU_H

#include "gl_context.h"
#include "support.h"

typedef struct gpu_clock {
    void(SAT__GL_CALL *finish)(void);
    void(SAT__GL_CALL *gen_queries)(int count, unsigned *queries);
    void(SAT__GL_CALL *delete_queries)(int count, const unsigned *queries);
    void(SAT__GL_CALL *begin_query)(unsigned target, unsigned query);
    void(SAT__GL_CALL *end_query)(unsigned target);
    void(SAT__GL_CALL *get_query)(unsigned query, unsigned name, uint64_t *value);
    int has_queries;    /* llvmpipe's are wrong at times: there the clock between two finishes is taken */
    unsigned query;
    double start;
} gpu_clock;

static inline int gpu_is_software(const gl_context *context)
{
    return strstr(context->message, "llvmpipe") != NULL || strstr(context->message, "softpipe") != NULL;
}

static inline void gpu_load(const gl_context *context, const char *name, void *function)
{
    gl_context_proc proc = context->get_proc(name);
    memcpy(function, &proc, sizeof proc);
}

static inline gpu_clock gpu_clock_of(const gl_context *context)
{
    gpu_clock c;
    memset(&c, 0, sizeof c);
    gpu_load(context, "glFinish", &c.finish);
    gpu_load(context, "glGenQueries", &c.gen_queries);
    gpu_load(context, "glDeleteQueries", &c.delete_queries);
    gpu_load(context, "glBeginQuery", &c.begin_query);
    gpu_load(context, "glEndQuery", &c.end_query);
    gpu_load(context, "glGetQueryObjectui64v", &c.get_query);
    c.has_queries = !gpu_is_software(context) && c.gen_queries && c.delete_queries && c.begin_query && c.end_query &&
                    c.get_query;
    return c;
}

static inline void gpu_begin(gpu_clock *c)
{
    c->finish();
    c->start = support_clock();
    if (!c->has_queries) return;
    c->gen_queries(1, &c->query);
    c->begin_query(0x88BF, c->query); /* GL_TIME_ELAPSED */
}

/* Seconds since gpu_begin; waits for the GPU. */
static inline double gpu_end(gpu_clock *c)
{
    uint64_t nanoseconds = 0;
    if (!c->has_queries) {
        c->finish();
        return support_clock() - c->start;
    }
    c->end_query(0x88BF);
    c->get_query(c->query, 0x8866, &nanoseconds); /* GL_QUERY_RESULT */
    c->delete_queries(1, &c->query);
    return 1e-9 * (double)nanoseconds;
}

#endif /* GPU_H */
