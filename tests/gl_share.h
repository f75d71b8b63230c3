/* gl_share.h - shaders and programs of the same text are one: what tests make again and again with other options is
   compiled once a context. Include it after the header that brings the function table; where gl_context_open gave
   get_proc, take gl_share(get_proc).

   #define lines of names that a text does not mention are left out of it, so that options which a pass does not know do
   not make it another one. Uniforms keep their values from object to object: a forgotten one is the last's. */

#ifndef GL_SHARE_H
#define GL_SHARE_H

#include <ctype.h>

#include "support.h"

enum { GL_SHARE_NAMES = 1 << 16, GL_SHARE_KNOWN = 8192 }; /* more than the tests make */

static sat_gl_get_proc *gl_share_real;
static sat__gl gl_share_gl;                     /* the driver's own */
static uint64_t gl_share_hash[GL_SHARE_NAMES];  /* by name: of a shader's type and text, of a program's shaders */
static unsigned gl_share_alias[GL_SHARE_NAMES]; /* by name: the first of that hash, 0: itself */
static struct { uint64_t hash; unsigned name; } gl_share_known[GL_SHARE_KNOWN]; /* compiled or linked, never deleted */
static int gl_share_count;

static unsigned gl_share_name(unsigned name) { return gl_share_alias[name] ? gl_share_alias[name] : name; }

/* The first of the hash of this name, or 0. */
static unsigned gl_share_find(unsigned name)
{
    int i;
    for (i = 0; i < gl_share_count; i++)
        if (gl_share_known[i].hash == gl_share_hash[name]) return gl_share_known[i].name;
    return 0;
}

static void gl_share_keep(unsigned name)
{
    if (gl_share_count == GL_SHARE_KNOWN) return;
    gl_share_known[gl_share_count].hash = gl_share_hash[name];
    gl_share_known[gl_share_count++].name = name;
}

/* Whether a word stands in a text. */
static int gl_share_mentions(const char *text, const char *word, size_t n)
{
    const char *p;
    char name[64];
    if (n >= sizeof name) return 1;
    memcpy(name, word, n);
    name[n] = 0;
    for (p = strstr(text, name); p; p = strstr(p + 1, name)) {
        const char after = p[n], before = p == text ? ' ' : p[-1];
        if (after == '_' || before == '_') continue;
        if (!isalnum((unsigned char)after) && !isalnum((unsigned char)before)) return 1;
    }
    return 0;
}

/* Leaves out the #define lines, which stand in front of all else, that nothing behind them mentions. */
static void gl_share_strip(char *text)
{
    char *line = text, *end, *to = text;
    while (*line == '#' || strncmp(line, "precision", 9) == 0) {
        size_t n = strcspn(line, "\n") + (strchr(line, '\n') != NULL);
        end = line + n;
        if (strncmp(line, "#define ", 8) != 0 || gl_share_mentions(end, line + 8, strcspn(line + 8, " \n"))) {
            memmove(to, line, n);
            to += n;
        }
        line = end;
    }
    memmove(to, line, strlen(line) + 1);
}

static void SAT__GL_CALL gl_share_source(unsigned shader, int count, const char *const *parts, const int *lengths)
{
    size_t n = 1;
    char *text;
    const char *given;
    int i;
    (void)lengths; /* the headers pass none */
    for (i = 0; i < count; i++) n += strlen(parts[i]);
    text = (char *)malloc(n);
    text[0] = 0;
    for (i = 0, n = 0; i < count; n += strlen(parts[i++])) strcpy(text + n, parts[i]);
    gl_share_strip(text);
    given = text;
    gl_share_gl.ShaderSource(shader, 1, &given, NULL);
    gl_share_hash[shader] = support_hash_add(gl_share_hash[shader], text, strlen(text));
    gl_share_alias[shader] = gl_share_find(shader);
    free(text);
}

static void SAT__GL_CALL gl_share_compile(unsigned shader)
{
    int ok = 0;
    if (gl_share_alias[shader]) return;
    gl_share_gl.CompileShader(shader);
    gl_share_gl.GetShaderiv(shader, SAT__GL_COMPILE_STATUS, &ok);
    if (ok) gl_share_keep(shader);
}

static unsigned SAT__GL_CALL gl_share_create_shader(unsigned type)
{
    unsigned shader = gl_share_gl.CreateShader(type);
    gl_share_hash[shader] = UINT64_C(0xcbf29ce484222325) ^ type;
    gl_share_alias[shader] = 0;
    return shader;
}

static void SAT__GL_CALL gl_share_get_shader(unsigned shader, unsigned name, int *value)
{
    gl_share_gl.GetShaderiv(gl_share_name(shader), name, value);
}

static unsigned SAT__GL_CALL gl_share_create_program(void)
{
    unsigned program = gl_share_gl.CreateProgram();
    gl_share_hash[program] = UINT64_C(0xcbf29ce484222325);
    gl_share_alias[program] = 0;
    return program;
}

static void SAT__GL_CALL gl_share_attach(unsigned program, unsigned shader)
{
    gl_share_hash[program] = support_hash_add(gl_share_hash[program], &gl_share_hash[shader],
                                              sizeof gl_share_hash[shader]);
    gl_share_gl.AttachShader(program, gl_share_name(shader));
}

static void SAT__GL_CALL gl_share_varyings(unsigned program, int count, const char *const *names, unsigned mode)
{
    int i;
    for (i = 0; i < count; i++)
        gl_share_hash[program] = support_hash_add(gl_share_hash[program], names[i], strlen(names[i]) + 1);
    gl_share_gl.TransformFeedbackVaryings(program, count, names, mode);
}

static void SAT__GL_CALL gl_share_link(unsigned program)
{
    int ok = 0;
    gl_share_alias[program] = gl_share_find(program);
    if (gl_share_alias[program]) return;
    gl_share_gl.LinkProgram(program);
    gl_share_gl.GetProgramiv(program, SAT__GL_LINK_STATUS, &ok);
    if (ok) gl_share_keep(program);
}

static void SAT__GL_CALL gl_share_get_program(unsigned program, unsigned name, int *value)
{
    gl_share_gl.GetProgramiv(gl_share_name(program), name, value);
}

static void SAT__GL_CALL gl_share_use(unsigned program) { gl_share_gl.UseProgram(gl_share_name(program)); }

static int SAT__GL_CALL gl_share_location(unsigned program, const char *name)
{
    return gl_share_gl.GetUniformLocation(gl_share_name(program), name);
}

static void SAT__GL_CALL gl_share_delete_shader(unsigned shader)
{
    if (shader && gl_share_find(shader) != shader) gl_share_gl.DeleteShader(shader);
}

static void SAT__GL_CALL gl_share_delete_program(unsigned program)
{
    if (program && gl_share_find(program) != program) gl_share_gl.DeleteProgram(program);
}

static sat_gl_proc gl_share_proc(const char *name)
{
    static const struct { const char *name; sat_gl_proc proc; } own[] = {
        {"glCreateShader", (sat_gl_proc)gl_share_create_shader}, {"glShaderSource", (sat_gl_proc)gl_share_source},
        {"glCompileShader", (sat_gl_proc)gl_share_compile},      {"glGetShaderiv", (sat_gl_proc)gl_share_get_shader},
        {"glDeleteShader", (sat_gl_proc)gl_share_delete_shader},
        {"glCreateProgram", (sat_gl_proc)gl_share_create_program},
        {"glAttachShader", (sat_gl_proc)gl_share_attach},        {"glLinkProgram", (sat_gl_proc)gl_share_link},
        {"glGetProgramiv", (sat_gl_proc)gl_share_get_program},   {"glUseProgram", (sat_gl_proc)gl_share_use},
        {"glDeleteProgram", (sat_gl_proc)gl_share_delete_program},
        {"glGetUniformLocation", (sat_gl_proc)gl_share_location},
        {"glTransformFeedbackVaryings", (sat_gl_proc)gl_share_varyings}};
    size_t i;
    for (i = 0; i < sizeof own / sizeof own[0]; i++)
        if (strcmp(own[i].name, name) == 0) return own[i].proc;
    return gl_share_real(name);
}

/* What to hand to X_gl_create in place of the real loader; for one context a program, which stays current. */
static sat_gl_get_proc *gl_share(sat_gl_get_proc *real)
{
    gl_share_real = real;
    return sat__gl_open(&gl_share_gl, real) == SAT_OK ? gl_share_proc : real;
}

#endif /* GL_SHARE_H */
