/* A frame by public calls: nothing is made, uploaded or read in it, and its picture is the CPU's. Needs OSMesa. */

enum { FT_W = 96, FT_H = 64, FT_N = FT_W * FT_H };

/* ---- calls that no frame may have, counted on their way through get_proc */

static gl_context ft_context;
static long ft_calls;
static sat__gl ft_gl;

static void SAT__GL_CALL ft_gen_textures(int n, unsigned *out) { ft_calls++, ft_gl.GenTextures(n, out); }
static void SAT__GL_CALL ft_gen_buffers(int n, unsigned *out) { ft_calls++, ft_gl.GenBuffers(n, out); }
static void SAT__GL_CALL ft_gen_framebuffers(int n, unsigned *out) { ft_calls++, ft_gl.GenFramebuffers(n, out); }
static void SAT__GL_CALL ft_compile(unsigned shader) { ft_calls++, ft_gl.CompileShader(shader); }
static void SAT__GL_CALL ft_link(unsigned program) { ft_calls++, ft_gl.LinkProgram(program); }
static void SAT__GL_CALL ft_image(unsigned a, int b, int c, int w, int h, int d, unsigned e, unsigned f, const void *p)
{
    ft_calls++, ft_gl.TexImage2D(a, b, c, w, h, d, e, f, p);
}
static void SAT__GL_CALL ft_sub(unsigned a, int b, int x, int y, int w, int h, unsigned e, unsigned f, const void *p)
{
    ft_calls++, ft_gl.TexSubImage2D(a, b, x, y, w, h, e, f, p);
}
static void SAT__GL_CALL ft_data(unsigned target, ptrdiff_t size, const void *data, unsigned usage)
{
    ft_calls++, ft_gl.BufferData(target, size, data, usage);
}
static void SAT__GL_CALL ft_pixels(int x, int y, int w, int h, unsigned format, unsigned type, void *pixels)
{
    ft_calls++, ft_gl.ReadPixels(x, y, w, h, format, type, pixels);
}
static void *SAT__GL_CALL ft_map(unsigned target, ptrdiff_t offset, ptrdiff_t size, unsigned access)
{
    ft_calls++;
    return ft_gl.MapBufferRange(target, offset, size, access);
}

static sat_gl_proc ft_get_proc(const char *name)
{
    static const struct { const char *name; sat_gl_proc proc; } counted[] = {
        {"glGenTextures", (sat_gl_proc)ft_gen_textures}, {"glGenBuffers", (sat_gl_proc)ft_gen_buffers},
        {"glGenFramebuffers", (sat_gl_proc)ft_gen_framebuffers}, {"glCompileShader", (sat_gl_proc)ft_compile},
        {"glLinkProgram", (sat_gl_proc)ft_link}, {"glTexImage2D", (sat_gl_proc)ft_image},
        {"glTexSubImage2D", (sat_gl_proc)ft_sub}, {"glBufferData", (sat_gl_proc)ft_data},
        {"glReadPixels", (sat_gl_proc)ft_pixels}, {"glMapBufferRange", (sat_gl_proc)ft_map}};
    size_t i;
    for (i = 0; i < sizeof counted / sizeof *counted; i++)
        if (strcmp(counted[i].name, name) == 0) return counted[i].proc;
    return ft_context.get_proc(name);
}

static frame ft_frame; /* made by the first test, for all of them */

/* A tenth of the frame's drops: most of its time otherwise, and still thousands. */
static void ft_less_rain(void)
{
    raindrop_rain_options o = raindrop_rain_defaults();
    o.rate_mm_h = 15, o.box_size[0] = o.box_size[2] = 6, o.box_size[1] = 4, o.wind[0] = 1.2f;
    memcpy(o.centre, ft_frame.camera.position, sizeof o.centre);
    o.centre[2] -= 2.8f;
    raindrop_rain_destroy(ft_frame.drops);
    EXPECT_EQ(raindrop_rain_create(&ft_frame.drops, &o), SAT_OK);
    EXPECT_EQ(raindrop_gl_set_rain(ft_frame.rain, ft_frame.drops), SAT_OK);
}

static int ft_open(void)
{
    sat_threads serial;
    if (ft_context.context) return 1;
    memset(&serial, 0, sizeof serial);
    if (!gl_context_open(&ft_context, 3, 3)) {
        expect_skip(ft_context.message);
        return 0;
    }
    if (!EXPECT_EQ(sat__gl_open(&ft_gl, ft_context.get_proc), SAT_OK)) return 0;
    if (!EXPECT(frame_create(&ft_frame, ft_get_proc, FT_W, FT_H, &serial))) puts(ft_frame.message);
    else ft_less_rain();
    return ft_frame.message[0] == 0;
}

static void ft_close(void)
{
    frame_destroy(&ft_frame);
    EXPECT_EQ(ft_gl.GetError(), 0);
    sat__gl_close(&ft_gl);
    gl_context_close(&ft_context);
}

static void ft_read(void *out, unsigned texture, unsigned internal)
{
    sat__gl_state state;
    sat__gl_begin(&ft_gl, &state, 1);
    EXPECT_EQ(sat__gl_read(&ft_gl, out, texture, internal, FT_W, FT_H), SAT_OK);
    sat__gl_end(&ft_gl, &state);
}

/* What the depth buffer holds, by a copy into a colour texture. */
static void ft_read_depth(float *out)
{
    const gl_tools *t = &ft_frame.scene.t;
    static const char copy[] = "#version 330 core\nuniform sampler2D depth; out vec4 value;\n"
                               "void main() { value = vec4(texelFetch(depth, ivec2(gl_FragCoord.xy), 0).r); }\n";
    unsigned program = gl_tools_program(t, NULL, copy);
    unsigned texture = gl_tools_texture(t, GL_TOOLS_R32F, FT_W, FT_H, 0, NULL);
    unsigned framebuffer = gl_tools_framebuffer(t, texture, 0, 0);
    t->Viewport(0, 0, FT_W, FT_H);
    t->UseProgram(program);
    gl_tools_bind(t, program, 0, "depth", ft_frame.scene.depth);
    t->BindVertexArray(ft_frame.scene.vertex_array);
    t->DrawArrays(GL_TOOLS_TRIANGLES, 0, 3);
    gl_tools_read(t, out, framebuffer, GL_TOOLS_R32F, FT_W, FT_H);
    t->BindFramebuffer(GL_TOOLS_FRAMEBUFFER, 0);
    t->DeleteFramebuffers(1, &framebuffer);
    t->DeleteTextures(1, &texture);
    t->DeleteProgram(program);
}

/* ---- the CPU's picture of the same frame; rows from the bottom as in the textures */

static float ft_colour[4 * FT_N], ft_normal[4 * FT_N], ft_depth[FT_N], ft_dry[4 * FT_N], ft_irradiance[4 * FT_N],
    ft_open_[FT_N];
static float cpu_open[FT_N], cpu_hdr[3 * FT_N], cpu_normal[3 * FT_N], cpu_irradiance[3 * FT_N], cpu_distance[FT_N];

static void ft_shadows(void)
{
    fiv_instance casters[SCENE_OBJECTS], others[1];
    fiv_irradiance_options o = fiv_irradiance_defaults();
    const raindrop_camera *c = &ft_frame.scene.things.camera;
    const float *p = ft_frame.scene.projection;
    int i, k;
    o.own_masks = o.rays = 0; /* what the shader does */
    for (k = 0; k < SCENE_OBJECTS; k++) {
        casters[k].occluder = ft_frame.occluder[k];
        casters[k].scale = ft_frame.scene.things.objects[k].scale;
        memcpy(casters[k].position, ft_frame.scene.things.objects[k].place, sizeof casters[k].position);
    }
    for (i = 0; i < FT_N; i++) {
        double z = (double)p[14] / (-(2 * (double)ft_depth[i] - 1) - (double)p[10]); /* view space, below 0 */
        double x = ((i % FT_W + 0.5) * 2 / FT_W - 1) * -z / (double)p[0];
        double y = ((i / FT_W + 0.5) * 2 / FT_H - 1) * -z / (double)p[5];
        const float *n = ft_normal + 4 * i;
        float point[3], normal[3];
        int self = (int)n[3] - 2;
        cpu_distance[i] = ft_depth[i] < 1 ? (float)-z : (float)INFINITY;
        if (!(n[3] > 0)) continue;
        for (k = 0; k < 3; k++) {
            point[k] = (float)((double)c->position[k] + x * (double)c->right[k] + y * (double)c->up[k] +
                               z * (double)c->back[k]);
            normal[k] = n[0] * c->right[k] + n[1] * c->up[k] + n[2] * c->back[k];
        }
        if (self < 0) {
            EXPECT_EQ(fiv_irradiance(cpu_irradiance + 3 * i, point, normal, 1, ft_frame.light, casters, SCENE_OBJECTS,
                                     &o, NULL),
                      SAT_OK);
            continue;
        }
        others[0] = casters[1 - self];
        EXPECT_EQ(fiv_self_irradiance(cpu_irradiance + 3 * i, point, normal, 1, ft_frame.light, &casters[self], others,
                                      1, &o, NULL),
                  SAT_OK);
    }
}

static void ft_occlusion(void)
{
    ssao_sat_input in = ft_frame.input;
    ssao_sat_options o = ssao_sat_defaults();
    ssao_sat *ao;
    int i, k;
    o.radius = 0.12, o.bottom_up = 1;
    o.tolerance = 0; /* the GPU estimates all pixels */
    for (i = 0; i < FT_N; i++)
        for (k = 0; k < 3; k++) cpu_normal[3 * i + k] = ft_normal[4 * i + k];
    in.depth = ft_depth;
    in.normals = cpu_normal;
    EXPECT_EQ(ssao_sat_create(&ao, FT_W, FT_H, &o), SAT_OK);
    EXPECT_EQ(ssao_sat_apply(ao, cpu_open, 0, &in, NULL), SAT_OK);
    ssao_sat_destroy(ao);
}

/* Rain and tone: on pictures with the top row first. */
static void ft_finish(unsigned char *codes, double dt)
{
    static float top[3 * FT_N], distance[FT_N];
    tonemap_options o = tonemap_defaults();
    sat_image view = sat_image_f32(top, FT_W, FT_H, 3);
    tonemap *map;
    int y;
    for (y = 0; y < FT_H; y++) {
        memcpy(top + 3 * FT_W * y, cpu_hdr + 3 * FT_W * (FT_H - 1 - y), 3 * FT_W * sizeof *top);
        memcpy(distance + FT_W * y, cpu_distance + FT_W * (FT_H - 1 - y), FT_W * sizeof *distance);
    }
    EXPECT_EQ(raindrop_rain_advance(ft_frame.drops, dt), SAT_OK);
    EXPECT_EQ(raindrop_render(top, 0, FT_W, FT_H, distance, &ft_frame.camera, ft_frame.drops, ft_frame.mirror, NULL,
                              NULL),
              SAT_OK);
    o.key = 0.22, o.cd_per_unit = 1, o.mesopic = TONEMAP_MESOPIC_LOCAL;
    EXPECT_EQ(tonemap_create(&map, FT_W, FT_H, &o), SAT_OK);
    EXPECT_EQ(tonemap_apply_u8(map, codes, 0, &view, 0, NULL), SAT_OK);
    tonemap_destroy(map);
}

TEST(a_frame_is_the_picture_of_the_cpu)
{
    static unsigned char gpu[4 * FT_N], cpu[3 * FT_N];
    double open_rms = 0, shade_rms = 0, shade_all = 0, rms = 0;
    unsigned screen;
    sat_gl_target target;
    long off[2] = {0, 0};
    int i, k, lit = 0;
    if (!ft_open()) return;
    screen = gl_tools_texture(&ft_frame.scene.t, GL_TOOLS_RGBA8, FT_W, FT_H, 0, NULL);
    target = sat_gl_to_texture(screen);
    target.flip = 1;
    if (!EXPECT(frame_draw(&ft_frame, &target, 0.02))) puts(ft_frame.message);
    ft_read(gpu, screen, SAT__GL_RGBA8);
    ft_read(ft_colour, ft_frame.scene.colour, SAT__GL_RGBA16F);
    ft_read(ft_normal, ft_frame.scene.normal, SAT__GL_RGBA16F);
    ft_read(ft_irradiance, fiv_gl_texture(ft_frame.shadows), SAT__GL_RGBA32F);
    ft_read(ft_open_, ssao_sat_gl_texture(ft_frame.ao), SAT__GL_R32F);
    ft_frame.scene.t.Viewport(0, 0, FT_W, FT_H);
    gl_scene_light(&ft_frame.scene, fiv_gl_texture(ft_frame.shadows), ssao_sat_gl_texture(ft_frame.ao));
    ft_frame.scene.t.BindFramebuffer(GL_TOOLS_FRAMEBUFFER, 0);
    ft_read(ft_dry, ft_frame.scene.hdr, SAT__GL_RGBA16F); /* without rain: the sky of the CPU's picture */
    ft_read_depth(ft_depth);
    ft_occlusion();
    ft_shadows();
    for (i = 0; i < FT_N; i++)
        for (k = 0; k < 3; k++) {
            double a = (double)cpu_irradiance[3 * i + k], b = (double)ft_irradiance[4 * i + k];
            cpu_hdr[3 * i + k] = ft_dry[4 * i + k];
            if (!(ft_colour[4 * i + 3] > 0)) continue;
            cpu_hdr[3 * i + k] = ft_colour[4 * i + k] / 3.14159265f * cpu_irradiance[3 * i + k] * cpu_open[i];
            lit++;
            shade_rms += (a - b) * (a - b), shade_all += a * a;
            open_rms += (double)(cpu_open[i] - ft_open_[i]) * (double)(cpu_open[i] - ft_open_[i]);
        }
    ft_finish(cpu, 0.02);
    for (i = 0; i < FT_N; i++)
        for (k = 0; k < 3; k++) {
            int d = abs((int)gpu[4 * i + k] - (int)cpu[3 * i + k]);
            off[0] += d > 1;
            off[1] += d > 8;
            rms += (double)d * d;
        }
    REPORT("accessibility, rms", sqrt(open_rms / lit), "");
    REPORT("irradiance, rms", sqrt(shade_rms / shade_all), "of its own");
    REPORT("the picture, rms", sqrt(rms / (3 * FT_N)), "codes");
    REPORT("codes more than 1 off", 100.0 * (double)off[0] / (3 * FT_N), "%");
    REPORT("codes more than 8 off", 100.0 * (double)off[1] / (3 * FT_N), "%");
    EXPECT(lit > FT_N);
    EXPECT(sqrt(open_rms / lit) < 1e-3);
    EXPECT(sqrt(shade_rms / shade_all) < 1e-3);
    EXPECT(sqrt(rms / (3 * FT_N)) < 0.5);
    EXPECT(off[0] < 3 * FT_N / 200);
    EXPECT_EQ(ft_gl.GetError(), 0);
}

TEST(a_frame_uploads_reads_and_makes_nothing)
{
    unsigned screen, framebuffer;
    sat_gl_target target;
    long before;
    int i;
    if (!ft_open()) return;
    EXPECT(ft_calls > 50); /* create did */
    screen = gl_tools_texture(&ft_frame.scene.t, GL_TOOLS_RGBA8, FT_W, FT_H, 0, NULL);
    framebuffer = gl_tools_framebuffer(&ft_frame.scene.t, screen, 0, 0);
    target = sat_gl_to_framebuffer(framebuffer, 0, 0);
    before = ft_calls;
    for (i = 0; i < 3; i++) EXPECT(frame_draw(&ft_frame, &target, i ? 0.03 : 0));
    EXPECT_EQ(ft_calls, before);
    for (i = 0; i < FRAME_STAGES; i++) EXPECT(ft_frame.timer.seconds[i] >= 0);
    ft_close();
}
