/* gl_es.h - a driver that calls itself OpenGL ES 3.0: the headers then write GLSL ES 3.00, which desktop drivers take
   too. Include it after the header that brings the function table. */

#ifndef GL_ES_H
#define GL_ES_H

static sat_gl_get_proc *gl_es_real;

static inline const unsigned char *SAT__GL_CALL gl_es_string(unsigned name)
{
    const unsigned char *(SAT__GL_CALL *get_string)(unsigned name);
    sat_gl_proc proc = gl_es_real("glGetString");
    memcpy(&get_string, &proc, sizeof proc);
    return name == SAT__GL_VERSION ? (const unsigned char *)"OpenGL ES 3.0 (pretended)" : get_string(name);
}

static inline sat_gl_proc gl_es_proc(const char *name)
{
    return strcmp(name, "glGetString") == 0 ? (sat_gl_proc)gl_es_string : gl_es_real(name);
}

/* What to hand to X_gl_create in place of the real loader. */
static inline sat_gl_get_proc *gl_es_pretend(sat_gl_get_proc *real)
{
    gl_es_real = real;
    return gl_es_proc;
}

#endif /* GL_ES_H */
