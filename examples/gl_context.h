/* gl_context.h - an OpenGL core context without a window.            SPDX-License-Identifier: MIT-0 OR Unlicense

       gl_context gl;
       if (!gl_context_open(&gl, 3, 3)) { puts(gl.message); return 1; }
       sat_gl_create(&tables, gl.get_proc, NULL);
       ...
       gl_context_close(&gl);

   OSMesa (a software renderer, Debian's libosmesa6) by default; with LIGHTSCAN_GL=egl in the environment the GPU,
   through EGL (libegl1): the first device that gives a context, else Mesa's surfaceless platform; LIGHTSCAN_GL=none
   refuses. Both libraries are opened at run time, so that a program compiles and links without them. Some drivers
   give a newer version than the one asked for, never an older one. There is no default framebuffer to speak of:
   draw into your own. Needs -ldl before glibc 2.34. */

#ifndef GL_CONTEXT_H
#define GL_CONTEXT_H

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if !defined(_WIN32)
#include <dlfcn.h>
#endif

typedef void (*gl_context_proc)(void);

typedef struct gl_context {
    gl_context_proc (*get_proc)(const char *name);
    char message[256];       /* why gl_context_open returned 0; else the renderer and version, as gl_context_renderer */
    int egl;                 /* 1 EGL, 0 OSMesa */
    void *display, *context;
    unsigned char pixels[16 * 16 * 4];
} gl_context;

static inline const char *gl_context_renderer(const gl_context *gl) { return gl->message; }

#if defined(_WIN32)

static inline int gl_context_open(gl_context *gl, int major, int minor)
{
    (void)major; (void)minor;
    memset(gl, 0, sizeof *gl);
    strcpy(gl->message, "OpenGL without a window needs OSMesa or EGL, which this system does not have");
    return 0;
}
static inline void gl_context_close(gl_context *gl) { (void)gl; }

#else

/* The library stays open: drivers leave threads and exit handlers behind. */
static inline void *gl_context_library(const char *name, const char *other)
{
    void *library = dlopen(name, RTLD_NOW | RTLD_LOCAL);
    return library ? library : dlopen(other, RTLD_NOW | RTLD_LOCAL);
}

/* ISO C has no cast from an object pointer to a function pointer; POSIX promises the same representation. */
static inline gl_context_proc gl_context_symbol(void *library, const char *name)
{
    void *p = dlsym(library, name);
    gl_context_proc f;
    memcpy(&f, &p, sizeof f);
    return f;
}

static inline void gl_context_describe(gl_context *gl)
{
    typedef const unsigned char *get_string(unsigned int name);
    get_string *text = (get_string *)gl->get_proc("glGetString");
    const unsigned char *renderer = text ? text(0x1F01) : NULL, *version = text ? text(0x1F02) : NULL;
    snprintf(gl->message, sizeof gl->message, "%s: %s, OpenGL %s", gl->egl ? "EGL" : "OSMesa",
             renderer ? (const char *)renderer : "?", version ? (const char *)version : "?");
}

/* ---- OSMesa ---- */

static inline int gl_context_open_osmesa(gl_context *gl, int major, int minor)
{
    typedef void *create_context(const int *attributes, void *share);
    typedef unsigned char make_current(void *context, void *buffer, unsigned int type, int width, int height);
    void *library = gl_context_library("libOSMesa.so.8", "libOSMesa.so");
    /* OSMESA_FORMAT RGBA, OSMESA_PROFILE CORE, major, minor */
    int attributes[9] = {0x22, 0x1908, 0x33, 0x34, 0x36, 0, 0x37, 0, 0};
    create_context *create;
    make_current *current;
    attributes[5] = major;
    attributes[7] = minor;
    if (!library) {
        strcpy(gl->message, "no OpenGL: install libosmesa6 (software) or set LIGHTSCAN_GL=egl (libegl1)");
        return 0;
    }
    create = (create_context *)gl_context_symbol(library, "OSMesaCreateContextAttribs");
    current = (make_current *)gl_context_symbol(library, "OSMesaMakeCurrent");
    gl->get_proc = (gl_context_proc(*)(const char *))gl_context_symbol(library, "OSMesaGetProcAddress");
    gl->context = create ? create(attributes, NULL) : NULL;
    if (!gl->context || !gl->get_proc || !current || !current(gl->context, gl->pixels, 0x1401, 16, 16)) {
        snprintf(gl->message, sizeof gl->message, "OSMesa gives no OpenGL %d.%d core context", major, minor);
        return 0;
    }
    return 1;
}

/* ---- EGL ---- */

typedef struct gl_context_egl {
    gl_context_proc (*get_proc)(const char *name);
    void *(*get_display)(void *native);
    unsigned int (*initialize)(void *display, int *major, int *minor);
    unsigned int (*choose)(void *display, const int *attributes, void **configs, int size, int *count);
    unsigned int (*bind_api)(unsigned int api);
    void *(*create)(void *display, void *config, void *share, const int *attributes);
    unsigned int (*current)(void *display, void *draw, void *read, void *context);
    unsigned int (*destroy)(void *display, void *context);
    void *(*platform_display)(unsigned int platform, void *native, const int *attributes);
    unsigned int (*devices)(int size, void **devices, int *count);
} gl_context_egl;

static inline int gl_context_load_egl(gl_context_egl *egl)
{
    void *library = gl_context_library("libEGL.so.1", "libEGL.so");
    gl_context_proc f;
    if (!library) return 0;
#define GL_CONTEXT_LOAD(member, name) f = gl_context_symbol(library, name); memcpy(&egl->member, &f, sizeof f)
    GL_CONTEXT_LOAD(get_proc, "eglGetProcAddress");
    GL_CONTEXT_LOAD(get_display, "eglGetDisplay");
    GL_CONTEXT_LOAD(initialize, "eglInitialize");
    GL_CONTEXT_LOAD(choose, "eglChooseConfig");
    GL_CONTEXT_LOAD(bind_api, "eglBindAPI");
    GL_CONTEXT_LOAD(create, "eglCreateContext");
    GL_CONTEXT_LOAD(current, "eglMakeCurrent");
    GL_CONTEXT_LOAD(destroy, "eglDestroyContext");
#undef GL_CONTEXT_LOAD
    if (!egl->get_proc) return 0;
    f = egl->get_proc("eglGetPlatformDisplayEXT");
    memcpy(&egl->platform_display, &f, sizeof f);
    f = egl->get_proc("eglQueryDevicesEXT");
    memcpy(&egl->devices, &f, sizeof f);
    return egl->get_display && egl->initialize && egl->choose && egl->bind_api && egl->create && egl->current;
}

static inline int gl_context_try_display(gl_context *gl, const gl_context_egl *egl, void *display, int major, int minor)
{
    /* EGL_SURFACE_TYPE pbuffer-or-nothing, EGL_RENDERABLE_TYPE OpenGL */
    static const int want[] = {0x3033, 0, 0x3040, 0x0008, 0x3038};
    /* EGL_CONTEXT_MAJOR_VERSION, MINOR_VERSION, OPENGL_PROFILE_MASK core */
    int attributes[7] = {0x3098, 0, 0x30FB, 0, 0x30FD, 1, 0x3038};
    void *config = NULL;
    int count = 0, a, b;
    attributes[1] = major;
    attributes[3] = minor;
    if (!display || !egl->initialize(display, &a, &b) || !egl->bind_api(0x30A2)) return 0;
    if (!egl->choose(display, want, &config, 1, &count) || count < 1) config = NULL;
    gl->context = egl->create(display, config, NULL, attributes);
    if (!gl->context) return 0;
    if (!egl->current(display, NULL, NULL, gl->context)) {
        if (egl->destroy) egl->destroy(display, gl->context);
        gl->context = NULL;
        return 0;
    }
    gl->display = display;
    return 1;
}

static inline int gl_context_open_egl(gl_context *gl, int major, int minor)
{
    gl_context_egl egl;
    void *devices[16];
    int count = 0, i;
    memset(&egl, 0, sizeof egl);
    gl->egl = 1;
    if (!gl_context_load_egl(&egl)) {
        strcpy(gl->message, "no EGL: install libegl1 (and the driver of the GPU), or unset LIGHTSCAN_GL");
        return 0;
    }
    gl->get_proc = egl.get_proc;
    if (egl.platform_display && egl.devices && egl.devices(16, devices, &count))
        for (i = 0; i < count; ++i)   /* EGL_PLATFORM_DEVICE_EXT */
            if (gl_context_try_display(gl, &egl, egl.platform_display(0x313F, devices[i], NULL), major, minor))
                return 1;
    if (egl.platform_display &&       /* EGL_PLATFORM_SURFACELESS_MESA */
        gl_context_try_display(gl, &egl, egl.platform_display(0x31DD, NULL, NULL), major, minor)) return 1;
    if (gl_context_try_display(gl, &egl, egl.get_display(NULL), major, minor)) return 1;
    snprintf(gl->message, sizeof gl->message, "EGL gives no OpenGL %d.%d core context on any device", major, minor);
    return 0;
}

/* Opens a context of at least this version and makes it current: 1, or 0 with the reason in gl->message. */
static inline int gl_context_open(gl_context *gl, int major, int minor)
{
    const char *kind = getenv("LIGHTSCAN_GL");
    memset(gl, 0, sizeof *gl);
    if (kind && strcmp(kind, "none") == 0) {
        strcpy(gl->message, "OpenGL is switched off by LIGHTSCAN_GL=none");
        return 0;
    }
    if (kind && strcmp(kind, "egl") == 0 ? !gl_context_open_egl(gl, major, minor)
                                         : !gl_context_open_osmesa(gl, major, minor)) return 0;
    gl_context_describe(gl);
    return 1;
}

static inline void gl_context_close(gl_context *gl)
{
    void *library;
    if (!gl->context) return;
    if (gl->egl) {
        gl_context_egl egl;
        memset(&egl, 0, sizeof egl);
        if (gl_context_load_egl(&egl)) {
            egl.current(gl->display, NULL, NULL, NULL);
            if (egl.destroy) egl.destroy(gl->display, gl->context);
        }
    } else if ((library = gl_context_library("libOSMesa.so.8", "libOSMesa.so")) != NULL) {
        typedef void destroy_context(void *context);
        destroy_context *destroy = (destroy_context *)gl_context_symbol(library, "OSMesaDestroyContext");
        if (destroy) destroy(gl->context);
    }
    memset(gl, 0, sizeof *gl);
}

#endif /* _WIN32 */
#endif /* GL_CONTEXT_H */
