/* gl_fake.h - an OpenGL that draws nothing and says yes to all: what the headers send it can be looked at on machines
   without any. Include it after sat.h with the function table (SAT_GL or SAT_SIBLING_GL).

       gl_fake.es = 1;                    "OpenGL ES 3.0" instead of 4.5
       gl_fake.shader = take_text;        called with every shader's type and whole text
       tonemap_gl_create(&map, gl_fake_proc, ...);
       gl_fake.made, gl_fake.compiled     counts of images, buffers, names and shaders so far */

#ifndef GL_FAKE_H
#define GL_FAKE_H

#include <stdlib.h>
#include <string.h>

typedef void gl_fake_take(unsigned type, const char *text);

static struct {
    int es;
    gl_fake_take *shader;
    long made;        /* names of textures, framebuffers, buffers, arrays, programs; images and buffer stores */
    long compiled;    /* shaders and programs */
    long uploads;     /* pixels and data that come from the program */
    long reads;       /* what comes back to the program */
    long draws;
    unsigned names, types[1 << 16];
} gl_fake;

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wpedantic"
#pragma GCC diagnostic ignored "-Wunused-function"
#endif
#define GL_FAKE(result, name, arguments)                                                                               \
    static result SAT__GL_CALL gl_fake_##name arguments { return (result)0; }
SAT__GL_FUNCTIONS(GL_FAKE)
SAT__GL_OPTIONAL_FUNCTIONS(GL_FAKE)

static unsigned gl_fake_name(void) { return 1 + gl_fake.names++ % 65535; }
static void SAT__GL_CALL gl_fake_gen(int n, unsigned *out)
{
    for (; n > 0; n--) *out++ = gl_fake_name(), gl_fake.made++;
}
static unsigned SAT__GL_CALL gl_fake_program(void) { return gl_fake.made++, gl_fake_name(); }
static unsigned SAT__GL_CALL gl_fake_create_shader(unsigned type)
{
    unsigned name = gl_fake_name();
    gl_fake.types[name] = type;
    return name;
}
static void SAT__GL_CALL gl_fake_source(unsigned shader, int count, const char *const *parts, const int *lengths)
{
    size_t used = 0;
    char *text;
    int i;
    (void)lengths;
    for (i = 0; i < count; i++) used += strlen(parts[i]);
    text = (char *)malloc(used + 1);
    text[used = 0] = 0;
    for (i = 0; i < count; i++) memcpy(text + used, parts[i], strlen(parts[i]) + 1), used += strlen(parts[i]);
    if (gl_fake.shader) gl_fake.shader(gl_fake.types[shader], text);
    free(text);
}
static void SAT__GL_CALL gl_fake_compile(unsigned name) { (void)name, gl_fake.compiled++; }
static void SAT__GL_CALL gl_fake_yes(unsigned object, unsigned name, int *value)
{
    (void)object, (void)name, *value = 1;
}
static unsigned SAT__GL_CALL gl_fake_complete(unsigned target) { return (void)target, SAT__GL_FRAMEBUFFER_COMPLETE; }
static void SAT__GL_CALL gl_fake_integer(unsigned name, int *value)
{
    int i;
    for (i = 0; i < (name == SAT__GL_VIEWPORT ? 4 : name == SAT__GL_POLYGON_MODE ? 2 : 1); i++) value[i] = 0;
    if (name == SAT__GL_MAX_TEXTURE_SIZE) *value = 16384;
}
static void SAT__GL_CALL gl_fake_integer_i(unsigned name, unsigned index, int *value)
{
    (void)name, (void)index, *value = 0;
}
static void SAT__GL_CALL gl_fake_integer64_i(unsigned name, unsigned index, int64_t *value)
{
    (void)name, (void)index, *value = 0;
}
static void SAT__GL_CALL gl_fake_boolean(unsigned name, unsigned char *value)
{
    memset(value, 1, name == SAT__GL_COLOR_WRITEMASK ? 4 : 1);
}
static const unsigned char *SAT__GL_CALL gl_fake_string(unsigned name)
{
    return (const unsigned char *)(name != SAT__GL_VERSION ? "none" : gl_fake.es ? "OpenGL ES 3.0 fake" : "4.5 fake");
}
static int SAT__GL_CALL gl_fake_location(unsigned program, const char *name) { return (void)program, (void)name, 0; }
static void SAT__GL_CALL gl_fake_image(unsigned target, int level, int internal, int width, int height, int border,
                                       unsigned format, unsigned type, const void *pixels)
{
    (void)target, (void)level, (void)internal, (void)width, (void)height, (void)border, (void)format, (void)type;
    gl_fake.made++;
    gl_fake.uploads += pixels != NULL;
}
static void SAT__GL_CALL gl_fake_sub_image(unsigned target, int level, int x, int y, int width, int height,
                                           unsigned format, unsigned type, const void *pixels)
{
    (void)target, (void)level, (void)x, (void)y, (void)width, (void)height, (void)format, (void)type, (void)pixels;
    gl_fake.uploads++;
}
static void SAT__GL_CALL gl_fake_buffer(unsigned target, ptrdiff_t size, const void *data, unsigned usage)
{
    (void)target, (void)size, (void)usage;
    gl_fake.made++;
    gl_fake.uploads += data != NULL;
}
static void SAT__GL_CALL gl_fake_read(int x, int y, int width, int height, unsigned format, unsigned type, void *pixels)
{
    (void)x, (void)y, (void)width, (void)height, (void)format, (void)type, (void)pixels;
    gl_fake.reads++;
}
static void SAT__GL_CALL gl_fake_draw(unsigned mode, int first, int count)
{
    (void)mode, (void)first, (void)count;
    gl_fake.draws++;
}

static sat_gl_proc gl_fake_proc(const char *name)
{
#define GL_FAKE_IS(text, function) if (strcmp(name, "gl" text) == 0) return (sat_gl_proc)function;
    GL_FAKE_IS("GenTextures", gl_fake_gen)
    GL_FAKE_IS("GenFramebuffers", gl_fake_gen)
    GL_FAKE_IS("GenVertexArrays", gl_fake_gen)
    GL_FAKE_IS("GenBuffers", gl_fake_gen)
    GL_FAKE_IS("CreateProgram", gl_fake_program)
    GL_FAKE_IS("CreateShader", gl_fake_create_shader)
    GL_FAKE_IS("ShaderSource", gl_fake_source)
    GL_FAKE_IS("CompileShader", gl_fake_compile)
    GL_FAKE_IS("LinkProgram", gl_fake_compile)
    GL_FAKE_IS("GetShaderiv", gl_fake_yes)
    GL_FAKE_IS("GetProgramiv", gl_fake_yes)
    GL_FAKE_IS("CheckFramebufferStatus", gl_fake_complete)
    GL_FAKE_IS("GetIntegerv", gl_fake_integer)
    GL_FAKE_IS("GetIntegeri_v", gl_fake_integer_i)
    GL_FAKE_IS("GetInteger64i_v", gl_fake_integer64_i)
    GL_FAKE_IS("GetBooleanv", gl_fake_boolean)
    GL_FAKE_IS("GetString", gl_fake_string)
    GL_FAKE_IS("GetUniformLocation", gl_fake_location)
    GL_FAKE_IS("TexImage2D", gl_fake_image)
    GL_FAKE_IS("TexSubImage2D", gl_fake_sub_image)
    GL_FAKE_IS("BufferData", gl_fake_buffer)
    GL_FAKE_IS("ReadPixels", gl_fake_read)
    GL_FAKE_IS("DrawArrays", gl_fake_draw)
#define GL_FAKE_FIND(result, function, arguments) GL_FAKE_IS(#function, gl_fake_##function)
    SAT__GL_FUNCTIONS(GL_FAKE_FIND)
    SAT__GL_OPTIONAL_FUNCTIONS(GL_FAKE_FIND)
    return NULL;
}

#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif
#endif /* GL_FAKE_H */
