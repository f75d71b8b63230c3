/* raindrop.h on the GPU: the same pictures and the same rain as on the CPU, and the state left as it was. Needs OSMesa
   (or a GPU, see gl_context.h); skips without. */

enum { RG_W = 160, RG_H = 120 };

typedef struct rg_scene {
    gl_context context;
    sat__gl gl;
    unsigned texture, depth, framebuffer;
    raindrop_environment *environment;
    raindrop_map *map;
    raindrop_camera camera;
    float *background, *cpu, *gpu;
    double key;
} rg_scene;

static raindrop_environment *rg_environment(float n)
{
    float *sky = (float *)calloc(3 * 256 * 128, sizeof(float));
    sat_image image = sat_image_f32(sky, 256, 128, 3);
    raindrop_environment_options o = raindrop_environment_defaults();
    raindrop_environment *environment = NULL;
    reference_sky(sky, 256, 128);
    o.n = n;
    EXPECT_EQ(raindrop_environment_create(&environment, &image, &o, NULL), SAT_OK);
    free(sky);
    return environment;
}

/* Made by the first test; nobody writes to them. */
static raindrop_environment *rg_water;
static raindrop_map *rg_map;

static int rg_open(rg_scene *s)
{
    sat__gl_state state;
    memset(s, 0, sizeof *s);
    if (!gl_context_open(&s->context, 3, 3)) {
        expect_skip(s->context.message);
        return 0;
    }
    EXPECT_EQ(sat__gl_open(&s->gl, s->context.get_proc), SAT_OK);
    if (!rg_map) {
        rg_water = rg_environment(RAINDROP_WATER);
        EXPECT_EQ(reference_map(&rg_map, 256, 32, RAINDROP_WATER), SAT_OK);
    }
    s->environment = rg_water;
    s->map = rg_map;
    s->camera = raindrop_camera_defaults();
    s->camera.fov_y = 1.3f;
    s->background = (float *)malloc(sizeof(float) * 3 * RG_W * RG_H);
    s->cpu = (float *)malloc(sizeof(float) * 3 * RG_W * RG_H);
    s->gpu = (float *)malloc(sizeof(float) * 4 * RG_W * RG_H);
    raindrop_environment_render(s->background, RG_W * 12, RG_W, RG_H, &s->camera, s->environment, NULL);
    s->key = reference_key(s->background, RG_W * RG_H);
    sat__gl_begin(&s->gl, &state, 1);
    EXPECT_EQ(sat__gl_texture(&s->gl, &s->texture, SAT__GL_RGBA32F, RG_W, RG_H, NULL), SAT_OK);
    EXPECT_EQ(sat__gl_texture(&s->gl, &s->depth, SAT__GL_DEPTH_COMPONENT32F, RG_W, RG_H, NULL), SAT_OK);
    EXPECT_EQ(sat__gl_framebuffer(&s->gl, &s->framebuffer, &s->texture, 1, s->depth), SAT_OK);
    sat__gl_end(&s->gl, &state);
    return 1;
}

static void rg_close(rg_scene *s)
{
    s->gl.BindFramebuffer(SAT__GL_FRAMEBUFFER, 0);
    s->gl.DeleteFramebuffers(1, &s->framebuffer);
    s->gl.DeleteTextures(1, &s->texture);
    s->gl.DeleteTextures(1, &s->depth);
    EXPECT_EQ(s->gl.GetError(), 0);
    sat__gl_close(&s->gl);
    gl_context_close(&s->context);
    free(s->background);
    free(s->cpu);
    free(s->gpu);
}

/* An object that knows the scene's environment; options: NULL for the defaults. */
static raindrop_gl *rg_make(rg_scene *s, const raindrop_gl_options *options)
{
    raindrop_gl *g = NULL;
    if (!EXPECT_EQ(raindrop_gl_create(&g, s->context.get_proc, options), SAT_OK)) puts(raindrop_gl_message(g));
    EXPECT_EQ(raindrop_gl_set_environment(g, s->environment), SAT_OK);
    return g;
}

/* The picture that is drawn over: rgb, or black. */
static void rg_fill(rg_scene *s, const float *rgb)
{
    sat__gl_state state;
    int x, y, c;
    for (y = 0; y < RG_H; y++)
        for (x = 0; x < RG_W; x++)
            for (c = 0; c < 4; c++)
                s->gpu[4 * ((RG_H - 1 - y) * RG_W + x) + c] = c == 3 ? 1 : rgb ? rgb[3 * (y * RG_W + x) + c] : 0;
    sat__gl_begin(&s->gl, &state, 1);
    sat__gl_upload(&s->gl, s->texture, SAT__GL_RGBA32F, RG_W, RG_H, s->gpu);
    sat__gl_end(&s->gl, &state);
    s->gl.BindFramebuffer(SAT__GL_FRAMEBUFFER, s->framebuffer);
}

/* It back into gpu, four floats a pixel, the bottom row first. */
static void rg_read(rg_scene *s)
{
    sat__gl_state state;
    sat__gl_begin(&s->gl, &state, 1);
    EXPECT_EQ(sat__gl_read(&s->gl, s->gpu, s->texture, SAT__GL_RGBA32F, RG_W, RG_H), SAT_OK);
    sat__gl_end(&s->gl, &state);
}

/* Drops of the CPU's rain over the background, both ways; returns the RMSE after tone mapping. */
static double rg_compare(rg_scene *s, raindrop_gl *g, const raindrop_rain *rain, const raindrop_render_options *options)
{
    int x, y, c;
    memcpy(s->cpu, s->background, sizeof(float) * 3 * RG_W * RG_H);
    EXPECT_EQ(raindrop_render(s->cpu, RG_W * 12, RG_W, RG_H, NULL, &s->camera, rain, s->environment, options, NULL),
              SAT_OK);
    rg_fill(s, s->background);
    EXPECT_EQ(raindrop_gl_set_rain(g, rain), SAT_OK);
    EXPECT_EQ(raindrop_gl_render(g, NULL, RG_W, RG_H, &s->camera, NULL, options), SAT_OK);
    rg_read(s);
    for (y = 0; y < RG_H / 2; y++) /* top row first, packed */
        for (x = 0; x < RG_W; x++)
            for (c = 0; c < 4; c++) {
                float *a = s->gpu + 4 * (y * RG_W + x) + c, *b = s->gpu + 4 * ((RG_H - 1 - y) * RG_W + x) + c, t = *a;
                *a = *b;
                *b = t;
            }
    for (x = 0; x < RG_W * RG_H; x++) memmove(s->gpu + 3 * x, s->gpu + 4 * x, 3 * sizeof(float));
    return reference_rmse(s->gpu, s->cpu, NULL, RG_W * RG_H, s->key);
}

static raindrop_rain *rg_rain(int count, float box, float diameter)
{
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    o.count = count;
    o.diameter_mm = (double)diameter;
    o.box_size[0] = o.box_size[1] = o.box_size[2] = box;
    EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK);
    return rain;
}

TEST(raindrop_gl_draws_the_picture_of_the_cpu)
{
    static const char *const names[4] = {"map", "sprite", "ray", "auto"};
    rg_scene s;
    raindrop_gl_options g_options = raindrop_gl_defaults();
    int quads, look;
    if (!rg_open(&s)) return;
    g_options.map = s.map;
    for (quads = 0; quads < 2; quads++) {
        raindrop_gl *g = NULL;
        raindrop_rain *few = rg_rain(300, 0.1f, 2), *many = rg_rain(20000, 1, 2);
        raindrop_render_options o = raindrop_render_defaults();
        g_options.quads = quads;
        g = rg_make(&s, &g_options);
        o.map = s.map;
        o.orders_radius = 1e9f;
        o.sort = 0;
        s.camera.depth_near = quads ? 0.001f : 0.01f;
        for (look = 0; look < 4; look++) {
            double error;
            o.look = (raindrop_look)look;
            error = rg_compare(&s, g, many, &o);
            EXPECT(error < (quads ? 5e-4 : 2e-3)); /* points vanish with their centres */
            REPORT(names[look], error, quads ? "RMSE from the CPU, rain, quads" : "RMSE from the CPU, rain, points");
            if (!quads) s.camera.depth_near = 0.03f; /* no centre of a drop that is seen lies outside */
            error = rg_compare(&s, g, few, &o);
            if (quads) EXPECT(error < 5e-4);
            REPORT(names[look], error,
                   quads ? "RMSE from the CPU, near drops, quads" : "RMSE from the CPU, near drops, points");
        }
        EXPECT(reference_rmse(s.cpu, s.background, NULL, RG_W * RG_H, s.key) > 0.01); /* there was something to see */
        raindrop_gl_destroy(g);
        raindrop_rain_destroy(few);
        raindrop_rain_destroy(many);
    }
    rg_close(&s);
}

/* Streaks and lenses of any size, near and far; the camera moves too. Point sprites are left out: they vanish with
   their centres. */
static void rg_compare_soft(rg_scene *s, double exposure, double aperture, const char *name)
{
    raindrop_gl_options g_options = raindrop_gl_defaults();
    raindrop_gl *g = NULL;
    raindrop_rain *few = rg_rain(200, 0.2f, 2), *many = rg_rain(20000, 1, 1);
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_camera camera = s->camera;
    int look;
    g_options.quads = 1;
    o.sort = 0;
    o.orders_radius = 1e9f;
    s->camera.velocity[0] = 1.5f;
    s->camera.velocity[2] = -2;
    s->camera.focus_distance = 0.06f;
    g = rg_make(s, &g_options);
    for (look = RAINDROP_LOOK_RAY; look <= RAINDROP_LOOK_AUTO; look++) {
        double near_error, error, sharp;
        o.look = (raindrop_look)look;
        s->camera.exposure = (float)exposure;
        s->camera.aperture = (float)aperture;
        error = rg_compare(s, g, many, &o);
        near_error = rg_compare(s, g, few, &o);
        REPORT(name, error, "RMSE from the CPU");
        REPORT(name, near_error, "RMSE from the CPU, near drops");
        EXPECT(error < 5e-4 && near_error < 5e-4);
        s->camera.exposure = s->camera.aperture = 0;
        memcpy(s->gpu, s->background, sizeof(float) * 3 * RG_W * RG_H);
        EXPECT_EQ(raindrop_render(s->gpu, RG_W * 12, RG_W, RG_H, NULL, &s->camera, few, s->environment, &o, NULL),
                  SAT_OK);
        sharp = reference_rmse(s->gpu, s->cpu, NULL, RG_W * RG_H, s->key);
        EXPECT(sharp > 20 * near_error); /* there was something to be wrong */
    }
    s->camera = camera;
    raindrop_gl_destroy(g);
    raindrop_rain_destroy(few);
    raindrop_rain_destroy(many);
}

TEST(raindrop_gl_streaks_as_on_the_cpu)
{
    rg_scene s;
    if (!rg_open(&s)) return;
    rg_compare_soft(&s, 1 / 4000.0, 0, "streaks of 1/4000 s");
    rg_compare_soft(&s, 1 / 500.0, 0, "streaks of 1/500 s");
    rg_compare_soft(&s, 1 / 60.0, 0, "streaks of 1/60 s");
    rg_close(&s);
}

TEST(raindrop_gl_focuses_as_on_the_cpu)
{
    rg_scene s;
    if (!rg_open(&s)) return;
    rg_compare_soft(&s, 0, 0.002, "lens of 2 mm");
    rg_compare_soft(&s, 0, 0.01, "lens of 10 mm");
    rg_compare_soft(&s, 1 / 500.0, 0.002, "lens of 2 mm, 1/500 s");
    rg_close(&s);
}

static void rg_draw_on_black(rg_scene *s, raindrop_gl *g, const raindrop_render_options *options)
{
    rg_fill(s, NULL);
    EXPECT_EQ(raindrop_gl_render(g, NULL, RG_W, RG_H, &s->camera, NULL, options), SAT_OK);
    rg_read(s);
}

/* The light of one drop before black under a white sky over its area, wherever it stands and moves: within 2 %. */
TEST(raindrop_gl_streaks_do_not_shimmer)
{
    static const double radii[] = {0.1, 0.5, 1.39, 1.41, 2, 5}, streaks[] = {0, 0.6, 2.4, 2.6, 20};
    static const double blurs[] = {0, 1.2, 3};
    static float white[3 * 16 * 8];
    sat_image image = sat_image_f32(white, 16, 8, 3);
    rg_scene s;
    raindrop_environment *sky = NULL;
    raindrop_gl_options g_options = raindrop_gl_defaults();
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_gl *g = NULL;
    uint64_t seed = 3;
    double worst = 0, pixel, truth;
    size_t i, j, k;
    int quads, x;
    if (!rg_open(&s)) return;
    for (x = 0; x < 3 * 16 * 8; x++) white[x] = 1;
    EXPECT_EQ(raindrop_environment_create(&sky, &image, NULL, NULL), SAT_OK);
    s.camera.fov_y = (float)acos(0.0);
    pixel = 2.0 / RG_H;
    o.coverage_threshold = 0;
    for (quads = 0; quads < 2; quads++) {
        g_options.quads = quads;
        EXPECT_EQ(raindrop_gl_create(&g, s.context.get_proc, &g_options), SAT_OK);
        EXPECT_EQ(raindrop_gl_set_environment(g, sky), SAT_OK);
        for (i = 0; i < sizeof radii / sizeof *radii; i++)
            for (j = 0; j < sizeof streaks / sizeof *streaks; j++)
                for (k = 0; k < sizeof blurs / sizeof *blurs; k++) {
                    raindrop_drop drop = {{0, 0, -1}, 0, {0, 0, 0}, 1};
                    raindrop_rain_options r = raindrop_rain_defaults();
                    raindrop_rain *rain = NULL;
                    double angle = 6.283185307179586 * support_uniform(&seed), sum = 0, radius = radii[i] * pixel;
                    drop.position[0] = (float)(pixel * support_uniform(&seed));
                    drop.position[1] = (float)(pixel * support_uniform(&seed));
                    drop.radius = (float)radius;
                    drop.velocity[0] = (float)cos(angle);
                    drop.velocity[1] = (float)sin(angle);
                    r.drops = &drop;
                    r.count = 1;
                    EXPECT_EQ(raindrop_rain_create(&rain, &r), SAT_OK);
                    EXPECT_EQ(raindrop_gl_set_rain(g, rain), SAT_OK);
                    raindrop_rain_destroy(rain);
                    s.camera.exposure = (float)(streaks[j] * pixel);
                    s.camera.focus_distance = 2;
                    s.camera.aperture = (float)(4 * blurs[k] * pixel);
                    o.look = i & 1 ? RAINDROP_LOOK_RAY : RAINDROP_LOOK_AUTO;
                    rg_draw_on_black(&s, g, &o);
                    for (x = 0; x < RG_W * RG_H; x++) sum += (double)s.gpu[4 * x];
                    truth = acos(-1.0) * radii[i] * radii[i] / (1 - radius * radius);
                    if (fabs(sum / truth - 1) > 0.02)
                        fprintf(stderr, "%g, streak %g, blur %g: %g\n", radii[i], streaks[j], blurs[k], sum / truth);
                    if (fabs(sum / truth - 1) > worst) worst = fabs(sum / truth - 1);
                }
        raindrop_gl_destroy(g);
    }
    EXPECT(worst <= 0.02);
    REPORT("largest error of a drop's energy", 100 * worst, "%");
    raindrop_environment_destroy(sky);
    rg_close(&s);
}

/* Flattened drops, and among them spheres and such as are no drops; seen by a tilted camera. */
TEST(raindrop_gl_flattens_as_the_cpu)
{
    static const float ratios[6] = {0.5f, 0.75f, 1, 0.95f, 0, 1.5f};
    static const char *const names[4] = {"map", "sprite", "ray", "auto"};
    rg_scene s;
    raindrop_gl_options g_options = raindrop_gl_defaults();
    raindrop_rain_options r = raindrop_rain_defaults();
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_rain *rain = rg_rain(300, 0.2f, 4), *spheres;
    raindrop_drop drops[300];
    raindrop_gl *g = NULL;
    float eye[3] = {0, 0.03f, 0.05f}, target[3] = {0, 0, 0}, up[3] = {0.3f, 1, 0};
    int i, look, soft;
    if (!rg_open(&s)) return;
    memcpy(drops, raindrop_rain_drops(NULL, rain), sizeof drops);
    for (i = 0; i < 300; i++) drops[i].axis_ratio = ratios[i % 6];
    raindrop_rain_set_drops(rain, drops, 300);
    for (i = 0; i < 300; i++) drops[i].axis_ratio = 1;
    r.drops = drops;
    r.count = 300;
    EXPECT_EQ(raindrop_rain_create(&spheres, &r), SAT_OK);
    s.camera = raindrop_camera_look(eye, target, up, 1.3f);
    g_options.quads = 1;
    g_options.map = o.map = s.map;
    o.sort = 0;
    o.orders_radius = 1e9f;
    g = rg_make(&s, &g_options);
    for (look = 0; look < 4; look++)
        for (soft = 0; soft < (look < RAINDROP_LOOK_RAY ? 1 : 3); soft++) {
            double error;
            o.look = (raindrop_look)look;
            s.camera.exposure = soft == 1 ? 0.002f : 0;
            s.camera.aperture = soft == 2 ? 0.002f : 0;
            error = rg_compare(&s, g, rain, &o);
            REPORT(names[look], error,
                   soft == 2 ? "RMSE from the CPU, flattened, blurred"
                   : soft    ? "RMSE from the CPU, flattened streaks"
                             : "RMSE from the CPU, flattened");
            EXPECT(error < 5e-4);
            memcpy(s.gpu, s.background, sizeof(float) * 3 * RG_W * RG_H);
            EXPECT_EQ(raindrop_render(s.gpu, RG_W * 12, RG_W, RG_H, NULL, &s.camera, spheres, s.environment, &o, NULL),
                      SAT_OK);
            EXPECT(reference_rmse(s.gpu, s.cpu, NULL, RG_W * RG_H, s.key) > 20 * error);
        }
    raindrop_gl_destroy(g);
    raindrop_rain_destroy(rain);
    raindrop_rain_destroy(spheres);
    rg_close(&s);
}

/* Internal reflections in drops of some size, among smaller ones. */
TEST(raindrop_gl_reflects_inside_as_the_cpu)
{
    rg_scene s;
    raindrop_gl_options g_options = raindrop_gl_defaults();
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_rain *rain = rg_rain(60, 0.06f, 6);
    raindrop_gl *g = NULL;
    int orders, exit;
    if (!rg_open(&s)) return;
    g_options.quads = 1;
    s.camera.depth_near = 0.001f;
    o.sort = 0;
    g = rg_make(&s, &g_options);
    for (orders = 1; orders <= 3; orders++)
        for (exit = 0; exit < 2; exit++) {
            double error;
            o.orders = orders;
            o.orders_radius = 6;
            o.exit_fresnel = exit;
            error = rg_compare(&s, g, rain, &o);
            EXPECT(error < 5e-4);
            REPORT(exit ? "orders, only the last one's own light" : "orders", error, "RMSE from the CPU");
            o.orders_radius = 1e9f;
            memcpy(s.gpu, s.background, sizeof(float) * 3 * RG_W * RG_H);
            EXPECT_EQ(raindrop_render(s.gpu, RG_W * 12, RG_W, RG_H, NULL, &s.camera, rain, s.environment, &o, NULL),
                      SAT_OK);
            EXPECT(reference_rmse(s.gpu, s.cpu, NULL, RG_W * RG_H, s.key) > 20 * error);
        }
    o.look = RAINDROP_LOOK_RAY; /* out of range: an error, as on the CPU */
    o.orders = 4;
    EXPECT_EQ(raindrop_gl_render(g, NULL, RG_W, RG_H, &s.camera, NULL, &o), SAT_ERR_ARGUMENT);
    raindrop_gl_destroy(g);
    raindrop_rain_destroy(rain);
    rg_close(&s);
}

/* Air in water, total reflection and all: round with orders, flattened, and blurred. */
TEST(raindrop_gl_bubbles_as_on_the_cpu)
{
    rg_scene s;
    raindrop_gl_options g_options = raindrop_gl_defaults();
    raindrop_render_options o = raindrop_render_defaults();
    raindrop_rain *rain = rg_rain(60, 0.06f, 6);
    raindrop_gl *g = NULL;
    int i, kind;
    if (!rg_open(&s)) return;
    s.environment = rg_environment(1 / RAINDROP_WATER);
    g_options.quads = 1;
    o.sort = 0;
    g = rg_make(&s, &g_options);
    for (kind = 0; kind < 3; kind++) {
        double error;
        for (i = 0; i < rain->count; i++) rain->drops[i].axis_ratio = kind == 1 ? 0.7f : 1;
        s.camera.aperture = kind == 2 ? 0.001f : 0;
        error = rg_compare(&s, g, rain, &o);
        EXPECT(error < 5e-4);
        REPORT(kind == 2 ? "blurred bubbles" : kind ? "flattened bubbles" : "bubbles", error, "RMSE from the CPU");
    }
    raindrop_gl_destroy(g);
    raindrop_rain_destroy(rain);
    raindrop_environment_destroy(s.environment);
    rg_close(&s);
}

TEST(raindrop_gl_respects_the_depth_buffer)
{
    rg_scene s;
    raindrop_gl *g = NULL;
    raindrop_drop drops[2];
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    float depth, *left, *right, near = 0.1f, far = 10;
    if (!rg_open(&s)) return;
    memset(drops, 0, sizeof drops);
    drops[0].position[0] = -0.5f;
    drops[0].position[2] = -1;
    drops[1].position[0] = 1.5f;
    drops[1].position[2] = -3;
    drops[0].radius = 0.1f;
    drops[1].radius = 0.3f;
    drops[0].axis_ratio = drops[1].axis_ratio = 1;
    o.drops = drops;
    o.count = 2;
    EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK);
    g = rg_make(&s, NULL);
    EXPECT_EQ(raindrop_gl_set_rain(g, rain), SAT_OK);
    rg_fill(&s, NULL);
    depth = ((far + near) - 2 * far * near / 2.0f) / (far - near) * 0.5f + 0.5f; /* a wall at 2 m */
    s.gl.ClearBufferfv(0x1801, 0, &depth);
    s.camera.depth_near = near;
    s.camera.depth_far = far;
    EXPECT_EQ(raindrop_gl_render(g, NULL, RG_W, RG_H, &s.camera, NULL, NULL), SAT_OK);
    rg_read(&s);
    {
        double focal = 0.5 * RG_H / tan(0.65);
        left = s.gpu + 4 * (RG_H / 2 * RG_W + (int)(RG_W / 2 - focal * 0.5));
        right = s.gpu + 4 * (RG_H / 2 * RG_W + (int)(RG_W / 2 + focal * 0.5));
    }
    EXPECT(left[1] > 0);   /* before the wall */
    EXPECT(right[1] == 0); /* behind it */
    s.camera.depth_near = 1;
    s.camera.depth_far = 0.5f;
    EXPECT_EQ(raindrop_gl_render(g, NULL, RG_W, RG_H, &s.camera, NULL, NULL), SAT_ERR_ARGUMENT);
    raindrop_gl_destroy(g);
    raindrop_rain_destroy(rain);
    rg_close(&s);
}

/* Positions and speeds against the CPU's after the same steps; drops that the two re-entered at different steps, by a
   rounding at the floor, are few. */
static double rg_advance(raindrop_gl *g, raindrop_rain *rain, const float *wind, const double *steps, int count)
{
    int n = 0, i, k, c, off = 0;
    const raindrop_drop *cpu = raindrop_rain_drops(&n, rain);
    raindrop_drop *gpu = (raindrop_drop *)malloc(sizeof *gpu * (size_t)n);
    EXPECT_EQ(raindrop_gl_set_rain(g, rain), SAT_OK);
    if (wind) { /* the wind turns when the drops are on the GPU already */
        EXPECT_EQ(raindrop_rain_set_wind(rain, wind), SAT_OK);
        EXPECT_EQ(raindrop_gl_set_wind(g, wind), SAT_OK);
    }
    for (k = 0; k < count; k++) {
        EXPECT_EQ(raindrop_rain_advance(rain, steps[k]), SAT_OK);
        EXPECT_EQ(raindrop_gl_advance(g, steps[k]), SAT_OK);
    }
    EXPECT_EQ(raindrop_gl_read_drops(g, gpu, n), SAT_OK);
    for (i = 0; i < n; i++) {
        int same = fabsf(gpu[i].radius - cpu[i].radius) <= 1e-5f * cpu[i].radius &&
                   fabsf(gpu[i].axis_ratio - cpu[i].axis_ratio) < 1e-5f;
        for (c = 0; c < 3; c++) {
            same = same && fabsf(gpu[i].position[c] - cpu[i].position[c]) < 3e-4f;
            same = same && fabsf(gpu[i].velocity[c] - cpu[i].velocity[c]) < 1e-4f * (1 + fabsf(cpu[i].velocity[c]));
        }
        off += !same;
    }
    free(gpu);
    return (double)off / n;
}

TEST(raindrop_gl_rain_falls_as_on_the_cpu)
{
    static const double frames[8] = {1 / 60.0, 1 / 60.0, 0, 0.1, 0.2, 1e-4, 0.05, 0.3};
    rg_scene s;
    raindrop_gl *g = NULL;
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    float gust[3] = {4, 0, -2}, updraught[3] = {0, 15, 0}, calm[3] = {0, 0, 0};
    double off;
    if (!rg_open(&s)) return;
    o.count = 20000;
    o.oblate = 1;
    EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK);
    EXPECT_EQ(raindrop_gl_create(&g, s.context.get_proc, NULL), SAT_OK);
    off = rg_advance(g, rain, NULL, frames, 8);
    EXPECT(off < 2e-3);
    REPORT("drops that fell differently on the GPU", 100 * off, "%");
    off = rg_advance(g, rain, gust, frames, 8);
    EXPECT(off < 5e-3);
    REPORT("the same in a gust", 100 * off, "%");
    off = rg_advance(g, rain, updraught, frames, 4);
    EXPECT(off < 2e-2);
    REPORT("the same in an updraught", 100 * off, "%");
    off = rg_advance(g, rain, calm, frames, 8); /* risen, stopped, falling again */
    EXPECT(off < 2e-2);
    gust[1] = sat__float_from_bits(0x7fc00000u);
    EXPECT_EQ(raindrop_gl_set_wind(g, gust), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_gl_set_wind(g, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_gl_set_rain(g, rain), SAT_OK);
    gust[1] = 100; /* the box moves with the camera, on both sides */
    EXPECT_EQ(raindrop_rain_set_centre(rain, gust), SAT_OK);
    EXPECT_EQ(raindrop_gl_set_centre(g, gust), SAT_OK);
    EXPECT_EQ(raindrop_gl_set_centre(g, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_rain_advance(rain, 0.01), SAT_OK);
    EXPECT_EQ(raindrop_gl_advance(g, 0.01), SAT_OK);
    {
        raindrop_drop back[100];
        int i;
        off = 0;
        EXPECT_EQ(raindrop_gl_read_drops(g, back, 100), SAT_OK);
        for (i = 0; i < 100; i++) off += fabs((double)(back[i].position[1] - rain->drops[i].position[1])) > 1e-3;
        EXPECT(off <= 1);
        for (i = 0; i < 30; i++) { /* and climbs */
            gust[1] += 0.25f;
            EXPECT_EQ(raindrop_rain_set_centre(rain, gust), SAT_OK);
            EXPECT_EQ(raindrop_gl_set_centre(g, gust), SAT_OK);
            EXPECT_EQ(raindrop_rain_advance(rain, 1 / 60.0), SAT_OK);
            EXPECT_EQ(raindrop_gl_advance(g, 1 / 60.0), SAT_OK);
        }
        EXPECT_EQ(raindrop_gl_read_drops(g, back, 100), SAT_OK);
        for (i = 0, off = 0; i < 100; i++)
            off += !(fabs((double)(back[i].position[1] - rain->drops[i].position[1])) < 2e-3 &&
                     fabsf(back[i].radius - rain->drops[i].radius) < 1e-5f * back[i].radius);
        EXPECT(off <= 4);
        REPORT("drops that fell differently through a climbing box", off, "%");
        gust[0] += 3; /* a jump in a pause */
        gust[1] -= 21;
        EXPECT_EQ(raindrop_rain_set_centre(rain, gust), SAT_OK);
        EXPECT_EQ(raindrop_gl_set_centre(g, gust), SAT_OK);
        EXPECT_EQ(raindrop_rain_advance(rain, 0), SAT_OK);
        EXPECT_EQ(raindrop_gl_advance(g, 0), SAT_OK);
        EXPECT_EQ(raindrop_gl_read_drops(g, back, 100), SAT_OK);
        for (i = 0, off = 0; i < 100; i++)
            off += !(fabsf(back[i].position[0] - gust[0]) < 4.001f && fabsf(back[i].position[1] - gust[1]) < 4.001f &&
                     fabsf(back[i].position[1] - rain->drops[i].position[1]) < 2e-3f);
        EXPECT(off <= 4);
    }
    EXPECT_EQ(raindrop_gl_advance(g, -1), SAT_ERR_ARGUMENT);
    raindrop_gl_destroy(g);
    raindrop_rain_destroy(rain);
    rg_close(&s);
}

/* After steps and in winds whose way has no digits left for a place in the box. */
TEST(raindrop_gl_rain_stays_in_its_box)
{
    enum { COUNT = 500 };
    static const double steps[5] = {1e5, 1 / 60.0, 1e30, 1e300, 1};
    rg_scene s;
    raindrop_gl *g = NULL;
    raindrop_drop back[COUNT];
    raindrop_rain *rain = rg_rain(COUNT, 0.3f, 0);
    float wind[3] = {1e4f, 1e4f, -1e4f};
    int i, k, c, turn, out = 0;
    if (!rg_open(&s)) {
        raindrop_rain_destroy(rain);
        return;
    }
    EXPECT_EQ(raindrop_gl_create(&g, s.context.get_proc, NULL), SAT_OK);
    EXPECT_EQ(raindrop_gl_set_rain(g, rain), SAT_OK);
    for (turn = 0; turn < 3; turn++) {
        if (turn) EXPECT_EQ(raindrop_gl_set_wind(g, wind), SAT_OK);
        for (k = 0; k < 5; k++) {
            EXPECT_EQ(raindrop_gl_advance(g, steps[k]), SAT_OK);
            EXPECT_EQ(raindrop_gl_read_drops(g, back, COUNT), SAT_OK);
            for (i = 0; i < COUNT; i++)
                for (c = 0; c < 3; c++) out += !(fabsf(back[i].position[c]) <= 0.150001f && back[i].radius > 0);
        }
        wind[0] = 3e38f;
    }
    EXPECT_EQ(out, 0);
    raindrop_gl_destroy(g);
    raindrop_rain_destroy(rain);
    rg_close(&s);
}

TEST(raindrop_gl_steps_1um_drops)
{
    rg_scene s;
    raindrop_gl *g = NULL;
    raindrop_drop dust[4], back[4];
    raindrop_rain_options o = raindrop_rain_defaults();
    raindrop_rain *rain = NULL;
    int i;
    if (!rg_open(&s)) return;
    memset(dust, 0, sizeof dust);
    for (i = 0; i < 4; i++) {
        dust[i].radius = 0.5e-6f * (float)pow(10, i);
        dust[i].velocity[1] = -10;
        dust[i].axis_ratio = 1;
    }
    o.drops = dust;
    o.count = 4;
    EXPECT_EQ(raindrop_rain_create(&rain, &o), SAT_OK);
    EXPECT_EQ(raindrop_gl_create(&g, s.context.get_proc, NULL), SAT_OK);
    EXPECT_EQ(raindrop_gl_set_rain(g, rain), SAT_OK);
    EXPECT_EQ(raindrop_gl_advance(g, 10), SAT_OK);
    EXPECT_EQ(raindrop_gl_read_drops(g, back, 4), SAT_OK);
    for (i = 0; i < 4; i++)
        EXPECT_REL(-back[i].velocity[1], raindrop_terminal_velocity((double)dust[i].radius * 2e3), 2e-5);
    raindrop_gl_destroy(g);
    raindrop_rain_destroy(rain);
    rg_close(&s);
}

/* Everything sat__gl_begin can save is as before, after every call. */
TEST(raindrop_gl_restores_the_state)
{
    rg_scene s;
    raindrop_gl *g = NULL;
    raindrop_gl_options o = raindrop_gl_defaults();
    raindrop_rain *rain = rg_rain(1000, 1, 2);
    sat__gl_state before, after, scratch;
    unsigned texture, buffer, array;
    if (!rg_open(&s)) return;
    o.map = s.map;
    memset(&before, 0, sizeof before);
    memset(&after, 0, sizeof after);
    s.gl.GenTextures(1, &texture);
    s.gl.GenBuffers(1, &buffer);
    s.gl.GenVertexArrays(1, &array);
    s.gl.BindVertexArray(array);
    s.gl.ActiveTexture(SAT__GL_TEXTURE0 + 2);
    s.gl.BindTexture(SAT__GL_TEXTURE_2D, texture);
    s.gl.BindBuffer(SAT__GL_ARRAY_BUFFER, buffer);
    s.gl.BindFramebuffer(SAT__GL_FRAMEBUFFER, s.framebuffer);
    s.gl.Enable(SAT__GL_CULL_FACE);
    s.gl.Enable(SAT__GL_DEPTH_TEST);
    s.gl.DepthFunc(0x0207);
    s.gl.BlendFuncSeparate(SAT__GL_ONE, SAT__GL_ZERO, SAT__GL_ONE, SAT__GL_ONE);
    s.gl.Viewport(3, 4, 50, 60);
    s.gl.PixelStorei(SAT__GL_UNPACK_ALIGNMENT, 8);
    sat__gl_begin(&s.gl, &before, 8);
    sat__gl_end(&s.gl, &before);
    g = rg_make(&s, &o);
    EXPECT_EQ(raindrop_gl_set_rain(g, rain), SAT_OK);
    EXPECT_EQ(raindrop_gl_advance(g, 0.01), SAT_OK);
    s.camera.depth_near = 0.1f;
    s.camera.depth_far = 10;
    EXPECT_EQ(raindrop_gl_render(g, NULL, RG_W, RG_H, &s.camera, NULL, NULL), SAT_OK);
    {
        raindrop_drop drop;
        EXPECT_EQ(raindrop_gl_read_drops(g, &drop, 1), SAT_OK);
    }
    sat__gl_begin(&s.gl, &after, 8);
    sat__gl_end(&s.gl, &after);
    EXPECT(memcmp(&before, &after, sizeof before) == 0);
    raindrop_gl_destroy(g);
    sat__gl_begin(&s.gl, &scratch, 8);
    sat__gl_end(&s.gl, &scratch);
    EXPECT(memcmp(&before, &scratch, sizeof before) == 0);
    s.gl.Disable(SAT__GL_CULL_FACE);
    s.gl.Disable(SAT__GL_DEPTH_TEST);
    s.gl.DeleteTextures(1, &texture);
    s.gl.DeleteBuffers(1, &buffer);
    s.gl.DeleteVertexArrays(1, &array);
    raindrop_rain_destroy(rain);
    rg_close(&s);
}

/* The veil before hills of several depths, with the bows and without. */
TEST(raindrop_gl_veils_as_the_cpu)
{
    static float sky[3 * 64 * 32], depth[RG_W * RG_H], window[2][RG_W * RG_H];
    static const float reversed[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, -1, 0, 0, 0.1f, 0}; /* and infinite */
    sat_image image = sat_image_f32(sky, 64, 32, 3);
    raindrop_environment_options e = raindrop_environment_defaults();
    raindrop_environment *environment = NULL;
    raindrop_veil_options o = raindrop_veil_defaults();
    raindrop_gl *g = NULL;
    sat__gl_state state;
    unsigned textures[2] = {0, 0}, texture, target = 0;
    sat_gl_target to;
    rg_scene s;
    int bow, kind, x, y, c;
    if (!rg_open(&s)) return;
    reference_sky(sky, 64, 32);
    s.camera.depth_near = 0.1f;
    s.camera.depth_far = 5000;
    for (x = 0; x < RG_W * RG_H; x++) {
        double z = x % 7 == 0 ? 0 : 0.5 * pow(1.0005, x % 17000), far = 5000, near = (double)s.camera.depth_near;
        depth[x] = (float)z;
        y = RG_H - 1 - x / RG_W;
        window[1][y * RG_W + x % RG_W] = z > 0 ? (float)(0.1 / z) : 0;
        window[0][y * RG_W + x % RG_W] =
            z > 0 ? (float)(((far + near) - 2 * far * near / z) / (far - near) * 0.5 + 0.5) : 1;
    }
    EXPECT_EQ(raindrop_gl_create(&g, s.context.get_proc, NULL), SAT_OK);
    EXPECT_EQ(raindrop_gl_veil(g, NULL, RG_W, RG_H, 0, NULL, NULL, NULL), SAT_ERR_ARGUMENT); /* no environment */
    sat__gl_begin(&s.gl, &state, 1);
    for (kind = 0; kind < 2; kind++)
        EXPECT_EQ(sat__gl_texture(&s.gl, &textures[kind], SAT__GL_DEPTH_COMPONENT32F, RG_W, RG_H, window[kind]),
                  SAT_OK);
    EXPECT_EQ(sat__gl_framebuffer(&s.gl, &target, &s.texture, 1, 0), SAT_OK);
    sat__gl_end(&s.gl, &state);
    to = sat_gl_to_texture(s.texture);
    for (bow = 0; bow < 4; bow++) { /* by the usual depth over what is bound, by reversed depth over a target */
        double error, worst = 0;
        kind = bow >> 1;
        texture = textures[kind];
        o.clip_zero_to_one = kind;
        e.bow_by_depth = bow & 1;
        e.sun_direction[1] = 0.3f;
        e.sun_direction[2] = sqrtf(1 - 0.3f * 0.3f);
        e.far_samples = 16;
        o.extinction = 0.002f;
        EXPECT_EQ(raindrop_environment_create(&environment, &image, &e, NULL), SAT_OK);
        EXPECT_EQ(raindrop_gl_set_environment(g, environment), SAT_OK);
        memcpy(s.cpu, s.background, sizeof(float) * 3 * RG_W * RG_H);
        EXPECT_EQ(raindrop_veil(s.cpu, 0, RG_W, RG_H, depth, &s.camera, environment, &o), SAT_OK);
        rg_fill(&s, s.background);
        s.gl.BindFramebuffer(SAT__GL_FRAMEBUFFER, kind ? 0 : target);
        EXPECT_EQ(raindrop_gl_veil(g, kind ? &to : NULL, RG_W, RG_H, texture, &s.camera, kind ? reversed : NULL, &o),
                  SAT_OK);
        rg_read(&s);
        for (y = 0; y < RG_H; y++)
            for (x = 0; x < RG_W; x++)
                for (c = 0; c < 3; c++) {
                    double want = (double)s.cpu[3 * (y * RG_W + x) + c];
                    error = fabs((double)s.gpu[4 * ((RG_H - 1 - y) * RG_W + x) + c] - want) / (1 + want);
                    if (error > worst) worst = error;
                }
        EXPECT(worst < 2e-3);
        REPORT(bow & 1 ? "veil with bows, largest difference" : "veil, largest difference", worst, "from the CPU");
        raindrop_environment_destroy(environment);
    }
    texture = textures[0];
    o.reach = -1;
    EXPECT_EQ(raindrop_gl_veil(g, NULL, RG_W, RG_H, texture, &s.camera, NULL, &o), SAT_ERR_ARGUMENT);
    EXPECT(strcmp(raindrop_gl_message(g), "reach is -1; 0..1e18") == 0);
    s.camera.depth_far = 0;
    EXPECT_EQ(raindrop_gl_veil(g, NULL, RG_W, RG_H, texture, &s.camera, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT(strcmp(raindrop_gl_message(g), "depth needs a projection or a depth_far") == 0);
    s.gl.BindFramebuffer(SAT__GL_FRAMEBUFFER, 0);
    s.gl.DeleteFramebuffers(1, &target);
    s.gl.DeleteTextures(2, textures);
    raindrop_gl_destroy(g);
    rg_close(&s);
}

/* Another size each frame, and a place in the target and in the depth: the picture of the CPU, nothing beside it. */
TEST(raindrop_gl_takes_another_size_a_frame)
{
    static const int sizes[7][4] = {{RG_W, RG_H, 0, 0}, {97, 53, 31, 7}, {1, 1, 5, 5}, {40, 30, 120, 90},
                                    {3, 119, 20, 1}, {159, 2, 1, 60}, {80, 60, 40, 0}};
    static float depth[RG_W * RG_H], window[RG_W * RG_H], cpu[3 * RG_W * RG_H];
    static const float projection[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, -1, 0, 0, 0.1f, 0}; /* reversed, infinite */
    raindrop_rain *rain = rg_rain(3000, 0.5f, 2);
    raindrop_veil_options veil = raindrop_veil_defaults();
    raindrop_render_options o = raindrop_render_defaults();
    unsigned texture = 0;
    sat__gl_state state;
    raindrop_gl *g;
    rg_scene s;
    int i, x, y, c, flip;
    if (!rg_open(&s)) {
        raindrop_rain_destroy(rain);
        return;
    }
    for (i = 0; i < RG_W * RG_H; i++) window[i] = 0.1f / (1 + (float)(i * 7919 % 1000)); /* the bottom row first */
    sat__gl_begin(&s.gl, &state, 1);
    EXPECT_EQ(sat__gl_texture(&s.gl, &texture, SAT__GL_R32F, RG_W, RG_H, window), SAT_OK);
    sat__gl_end(&s.gl, &state);
    o.sort = 0;
    veil.clip_zero_to_one = 1;
    veil.extinction = 0.01f;
    g = rg_make(&s, NULL);
    EXPECT_EQ(raindrop_gl_set_rain(g, rain), SAT_OK);
    for (i = 0; i < 14; i++) {
        const int *size = sizes[i % 7], w = size[0], h = size[1];
        sat_gl_target to = sat_gl_to_texture(s.texture);
        double worst = 0;
        int beside = 0;
        flip = i / 7;
        to.x = size[2];
        to.y = size[3];
        to.from_x = RG_W - w - size[2]; /* somewhere else in the depth */
        to.from_y = RG_H - h - size[3];
        to.flip = flip;
        for (y = 0; y < h; y++)
            for (x = 0; x < w; x++) depth[(h - 1 - y) * w + x] = 0.1f / window[(to.from_y + y) * RG_W + to.from_x + x];
        memset(cpu, 0, sizeof cpu);
        EXPECT_EQ(raindrop_veil(cpu, 0, w, h, depth, &s.camera, s.environment, &veil), SAT_OK);
        EXPECT_EQ(raindrop_render(cpu, 0, w, h, NULL, &s.camera, rain, s.environment, &o, NULL), SAT_OK);
        rg_fill(&s, NULL);
        EXPECT_EQ(raindrop_gl_veil(g, &to, w, h, texture, &s.camera, projection, &veil), SAT_OK);
        EXPECT_EQ(raindrop_gl_render(g, &to, w, h, &s.camera, NULL, &o), SAT_OK);
        rg_read(&s);
        for (y = 0; y < RG_H; y++)
            for (x = 0; x < RG_W; x++)
                for (c = 0; c < 3; c++) {
                    int px = x - to.x, py = flip ? y - to.y : to.y + h - 1 - y; /* rows of the CPU's picture */
                    double got = (double)s.gpu[4 * (y * RG_W + x) + c], want;
                    if (px < 0 || px >= w || py < 0 || py >= h) {
                        beside += got != 0;
                        continue;
                    }
                    want = (double)cpu[3 * (py * w + px) + c];
                    if (fabs(got - want) / (1 + want) > worst) worst = fabs(got - want) / (1 + want);
                }
        if (!EXPECT(worst < 5e-3 && beside == 0)) printf("%d x %d: %g, %d beside it\n", w, h, worst, beside);
    }
    {
        sat_gl_target to = sat_gl_to_texture(s.texture); /* its size, where it names one, is the call's */
        to.width = 40;
        to.height = 30;
        EXPECT_EQ(raindrop_gl_render(g, &to, 40, 30, &s.camera, NULL, &o), SAT_OK);
        EXPECT_EQ(raindrop_gl_veil(g, &to, 40, 30, texture, &s.camera, projection, &veil), SAT_OK);
        EXPECT_EQ(raindrop_gl_render(g, &to, 40, 31, &s.camera, NULL, &o), SAT_ERR_MISMATCH);
        EXPECT_EQ(raindrop_gl_veil(g, &to, 41, 30, texture, &s.camera, projection, &veil), SAT_ERR_MISMATCH);
    }
    s.gl.DeleteTextures(1, &texture);
    raindrop_gl_destroy(g);
    raindrop_rain_destroy(rain);
    rg_close(&s);
}

/* Slices of depth bring the picture to that of sorted drops: in rain fifty times as dense as the heaviest. */
TEST(raindrop_gl_slices_sort)
{
    static const int slices[4] = {1, 4, 16, 64};
    rg_scene s;
    raindrop_gl *g = NULL;
    raindrop_rain *rain = rg_rain(30000, 1, 3);
    double error[4];
    int i;
    if (!rg_open(&s)) {
        raindrop_rain_destroy(rain);
        return;
    }
    g = rg_make(&s, NULL);
    for (i = 0; i < 4; i++) {
        raindrop_render_options o = raindrop_render_defaults();
        o.slices = slices[i];
        error[i] = rg_compare(&s, g, rain, &o);
        REPORT(i ? "slices of depth, RMSE from sorted drops" : "unsorted, RMSE from sorted drops", error[i], "");
    }
    EXPECT(error[1] < 0.8 * error[0] && error[2] < 0.4 * error[0] && error[3] < 0.05 * error[0]);
    raindrop_gl_destroy(g);
    raindrop_rain_destroy(rain);
    rg_close(&s);
}

/* The functions for shaders of the caller's own, a ray a texel, against raindrop_trace. */
TEST(raindrop_gl_glsl_traces_as_the_cpu)
{
    static const char fragment[] = "layout(location = 0) out vec4 colour;\n"
                                   "uniform vec2 which;\n" /* index, 0 reflected, 1 refracted, 2 shares */
                                   "void main() {\n"
                                   "    float b = (floor(gl_FragCoord.x) + 0.5) / 64.0, m = (1.0 - b) * (1.0 + b);\n"
                                   "    float a = floor(gl_FragCoord.y) * 0.1;\n"
                                   "    vec3 p = b * vec3(cos(a), sin(a), 0.0);\n"
                                   "    raindrop_ray ray = raindrop_trace(vec3(0.0, 0.0, -1.0), p, m, which.x);\n"
                                   "    colour = vec4(which.y < 0.5 ? ray.reflected : ray.refracted, ray.fresnel);\n"
                                   "    if (which.y > 1.5) colour = vec4(ray.transmit, ray.footprint, 0.0, 0.0);\n"
                                   "}\n";
    static const float indices[3] = {1.33f, 1, 1 / 1.33f};
    static float out[64 * 64][4];
    const char *library[2], *text[2];
    sat__gl_shaders shaders;
    sat__gl_state state;
    unsigned program = 0, target = 0, framebuffer = 0;
    double worst = 0;
    rg_scene s;
    int i, k, c, which;
    if (!rg_open(&s)) return;
    memset(&shaders, 0, sizeof shaders);
    library[0] = raindrop_gl_glsl();
    text[0] = fragment;
    library[1] = text[1] = NULL;
    shaders.name = "rays";
    shaders.library = library;
    shaders.fragment = text;
    sat__gl_begin(&s.gl, &state, 1);
    if (!EXPECT_EQ(sat__gl_build(&s.gl, &program, &shaders), SAT_OK)) puts(s.gl.message);
    EXPECT_EQ(sat__gl_texture(&s.gl, &target, SAT__GL_RGBA32F, 64, 64, NULL), SAT_OK);
    EXPECT_EQ(sat__gl_framebuffer(&s.gl, &framebuffer, &target, 1, 0), SAT_OK);
    for (k = 0; k < 3; k++)
        for (which = 0; which < 3; which++) {
            sat__gl_pass(&s.gl, program, framebuffer, 64, 64);
            sat__gl_set_float2(&s.gl, program, "which", indices[k], (float)which);
            sat__gl_draw(&s.gl);
            EXPECT_EQ(sat__gl_read(&s.gl, out, target, SAT__GL_RGBA32F, 64, 64), SAT_OK);
            for (i = 0; i < 64 * 64; i++) {
                static const float d[3] = {0, 0, -1};
                float b = ((float)(i % 64) + 0.5f) / 64, a = (float)(i / 64) * 0.1f, p[3], want[4] = {0, 0, 0, 0};
                raindrop_ray ray;
                raindrop__set(p, b * cosf(a), b * sinf(a), 0);
                raindrop_trace(&ray, d, p, (1 - b) * (1 + b), indices[k]);
                if (which < 2) memcpy(want, which ? ray.refracted : ray.reflected, sizeof ray.refracted);
                else want[1] = ray.footprint_refracted;
                if (which == 2) want[0] = ray.transmit;
                else want[3] = ray.fresnel;
                for (c = 0; c < 4; c++) {
                    double error = fabs((double)out[i][c] - (double)want[c]) / (1 + fabs((double)want[c]));
                    if (error > worst) worst = error;
                }
            }
        }
    s.gl.DeleteProgram(program);
    s.gl.DeleteFramebuffers(1, &framebuffer);
    s.gl.DeleteTextures(1, &target);
    sat__gl_end(&s.gl, &state);
    EXPECT(worst < 2e-5);
    REPORT("rays of a shader of one's own, largest error", worst, "");
    rg_close(&s);
}

/* Any two options away from their defaults, ends of their ranges among them: the CPU's picture and the GPU's. */
enum { RG_OPTIONS = 16 };

static raindrop_lamp rg_lamps[2];

static void rg_set_lamps(void)
{
    rg_lamps[0] = rg_lamps[1] = raindrop_lamp_defaults();
    raindrop__set(rg_lamps[0].position, 0.5f, 2, -3);
    raindrop__set(rg_lamps[0].intensity, 30, 25, 10);
    raindrop__set(rg_lamps[1].position, -1, 3, 2);
    raindrop__set(rg_lamps[1].intensity, 50, 80, 90);
    rg_lamps[1].inner = 0.3f;
    rg_lamps[1].outer = 0.6f;
}

static void rg_set(rg_scene *s, raindrop_render_options *o, raindrop_rain *rain, int option)
{
    int i;
    if (option == 0) o->look = RAINDROP_LOOK_SPRITE;
    if (option == 1) o->look = RAINDROP_LOOK_RAY;
    if (option == 2) o->far_radius = 0;
    if (option == 3) o->far_radius = 64;
    if (option == 4) o->coverage_threshold = 1;
    if (option == 5) o->orders = 0;
    if (option == 6) o->orders = 3;
    if (option == 7) o->exit_fresnel = 1;
    if (option == 8) o->orders_radius = 0;
    if (option == 9) s->camera.exposure = 0.002f;
    if (option == 10) s->camera.aperture = 0.004f;
    if (option == 11) s->camera.fov_y = 2.2f;
    if (option == 12) s->camera.depth_near = 0.2f;
    if (option == 13)
        for (i = 0; i < rain->count; i++) rain->drops[i].axis_ratio = 0.8f;
    if (option == 14) o->oscillation = 0.25f;
    if (option == 15) {
        o->lamps = rg_lamps;
        o->lamp_count = 2;
    }
}

TEST(raindrop_gl_takes_options_in_pairs)
{
    rg_scene s;
    raindrop_gl *g;
    raindrop_gl_options options = raindrop_gl_defaults();
    raindrop_rain *rain = rg_rain(150, 0.8f, 6);
    double worst = 0;
    int a, b, i;
    if (!rg_open(&s)) {
        raindrop_rain_destroy(rain);
        return;
    }
    rg_set_lamps();
    options.lamps = options.oscillation = 1;
    g = rg_make(&s, &options);
    for (a = 0; a < RG_OPTIONS; a++)
        for (b = a; b < RG_OPTIONS; b++) {
            raindrop_render_options o = raindrop_render_defaults();
            raindrop_camera camera = s.camera;
            double error;
            o.sort = 0;
            for (i = 0; i < rain->count; i++) rain->drops[i].axis_ratio = 1;
            s.camera.focus_distance = 0.3f;
            rg_set(&s, &o, rain, a);
            rg_set(&s, &o, rain, b);
            error = rg_compare(&s, g, rain, &o);
            if (!EXPECT(error < 5e-4)) printf("options %d and %d: %g\n", a, b, error);
            if (error > worst) worst = error;
            s.camera = camera;
        }
    REPORT("options in pairs, largest RMSE from the CPU", worst, "");
    raindrop_gl_destroy(g);
    raindrop_rain_destroy(rain);
    rg_close(&s);
}

/* Lamps and swinging drops, still and moving, near and far: the pictures of the CPU. */
TEST(raindrop_gl_has_lamps_and_oscillation)
{
    rg_scene s;
    raindrop_gl *g = NULL;
    raindrop_gl_options options = raindrop_gl_defaults();
    int kind, i, changed;
    double worst = 0;
    if (!rg_open(&s)) return;
    rg_set_lamps();
    options.lamps = options.oscillation = 1;
    g = rg_make(&s, &options);
    for (kind = 0; kind < 16; kind++) {
        raindrop_render_options o = raindrop_render_defaults();
        raindrop_rain *rain = rg_rain(kind & 8 ? 3000 : 60, kind & 8 ? 4.0f : 0.3f, 3);
        double error;
        rain->time = 1.2345;
        o.sort = 0;
        if (kind & 1) o.lamps = rg_lamps;
        if (kind & 1) o.lamp_count = 2;
        o.oscillation = kind & 2 ? 0.2f : 0;
        s.camera.exposure = kind & 4 ? 0.004f : 0;
        error = rg_compare(&s, g, rain, &o);
        if (!EXPECT(error < 5e-4)) printf("kind %d: %g\n", kind, error);
        o.oscillation = 0;
        o.lamp_count = 0;
        EXPECT_EQ(raindrop_render(s.background, 0, RG_W, RG_H, NULL, &s.camera, rain, s.environment, &o, NULL), SAT_OK);
        for (i = changed = 0; i < 3 * RG_W * RG_H; i++) changed += fabsf(s.background[i] / s.cpu[i] - 1) > 0.01f;
        if (!EXPECT(kind & 3 ? changed > 5 : changed == 0)) printf("kind %d: %d\n", kind, changed); /* they are seen */
        raindrop_environment_render(s.background, 0, RG_W, RG_H, &s.camera, s.environment, NULL);
        if (error > worst) worst = error;
        raindrop_rain_destroy(rain);
    }
    REPORT("lamps and oscillation, largest RMSE from the CPU", worst, "");
    raindrop_gl_destroy(g);
    rg_close(&s);
}

/* Phases go on on the GPU as on the CPU. */
TEST(raindrop_gl_oscillates_in_time)
{
    rg_scene s;
    raindrop_gl *g = NULL;
    raindrop_gl_options options = raindrop_gl_defaults();
    raindrop_rain *rain = rg_rain(10, 0.3f, 4);
    if (!rg_open(&s)) {
        raindrop_rain_destroy(rain);
        return;
    }
    options.oscillation = 1;
    EXPECT_EQ(raindrop_gl_create(&g, s.context.get_proc, &options), SAT_OK);
    EXPECT_EQ(raindrop_gl_set_rain(g, rain), SAT_OK);
    EXPECT_EQ(raindrop_gl_advance(g, 3601.25), SAT_OK);
    EXPECT_EQ(raindrop_rain_advance(rain, 3601.25), SAT_OK);
    EXPECT_NEAR(g->time, rain->time, 0);
    EXPECT_NEAR(rain->time, 1.25, 1e-9);
    raindrop_rain_destroy(rain);
    raindrop_gl_destroy(g);
    rg_close(&s);
}

/* What the object was not made for is refused by name, in a picture and by set_options; nothing is made later. */
TEST(raindrop_gl_refuses_what_it_was_not_made_for)
{
    rg_scene s;
    raindrop_gl *g = NULL;
    raindrop_gl_options o = raindrop_gl_defaults();
    raindrop_rain *rain = rg_rain(10, 1, 2);
    raindrop_render_options r;
    int i;
    static const char *const names[7] = {"look is", "exposure or", "drops are", "orders is", "oscillation is",
                                         "lamp_count is", "raindrop_gl_options.veil is 0"};
    if (!rg_open(&s)) {
        raindrop_rain_destroy(rain);
        return;
    }
    rg_set_lamps();
    o.sprites = o.motion = o.oblate = o.orders = o.veil = 0;
    g = rg_make(&s, &o);
    for (i = 0; i < 8; i++) {
        sat_result result;
        int k;
        r = raindrop_render_defaults();
        r.orders = i == 3;
        s.camera.exposure = i == 1 ? 0.01f : 0;
        for (k = 0; k < rain->count; k++) rain->drops[k].axis_ratio = i == 2 ? 0.9f : 1;
        if (i == 0) r.look = RAINDROP_LOOK_SPRITE;
        if (i == 4) r.oscillation = 0.1f;
        if (i == 5) r.lamps = rg_lamps, r.lamp_count = 1;
        EXPECT_EQ(raindrop_gl_set_rain(g, rain), SAT_OK);
        result = i == 6 ? raindrop_gl_veil(g, NULL, RG_W, RG_H, 0, NULL, NULL, NULL)
                        : raindrop_gl_render(g, NULL, RG_W, RG_H, &s.camera, NULL, &r);
        EXPECT_EQ(result, i < 7 ? SAT_ERR_ARGUMENT : SAT_OK);
        if (i < 7 && !EXPECT(strstr(raindrop_gl_message(g), names[i]) == raindrop_gl_message(g)))
            puts(raindrop_gl_message(g));
    }
    EXPECT_EQ(raindrop_gl_set_options(g, &o), SAT_OK);
    EXPECT_EQ(raindrop_gl_set_options(g, NULL), SAT_ERR_MISMATCH);
    EXPECT(strstr(raindrop_gl_message(g), "made at create") != NULL);
    o.quads = 0;
    EXPECT_EQ(raindrop_gl_set_options(g, &o), SAT_ERR_MISMATCH);
    o.quads = 2;
    EXPECT_EQ(raindrop_gl_set_options(g, &o), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_gl_set_options(NULL, NULL), SAT_ERR_ARGUMENT);
    raindrop_gl_destroy(g);
    EXPECT_EQ(raindrop_gl_create(&g, s.context.get_proc, NULL), SAT_OK);
    o = raindrop_gl_defaults();
    o.veil = 0; /* what there is may be left aside, and taken up again */
    EXPECT_EQ(raindrop_gl_set_options(g, &o), SAT_OK);
    EXPECT_EQ(raindrop_gl_set_environment(g, s.environment), SAT_OK);
    EXPECT_EQ(raindrop_gl_veil(g, NULL, RG_W, RG_H, 0, NULL, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_gl_set_options(g, NULL), SAT_OK);
    EXPECT_EQ(raindrop_gl_veil(g, NULL, RG_W, RG_H, 0, NULL, NULL, NULL), SAT_OK);
    raindrop_rain_destroy(rain);
    raindrop_gl_destroy(g);
    rg_close(&s);
}

static sat_gl_proc rg_no_procs(const char *name) { (void)name; return NULL; }

TEST(raindrop_gl_says_what_is_wrong)
{
    raindrop_gl *g = NULL;
    raindrop_gl_options wrong = raindrop_gl_defaults();
    char text[160];
    rg_scene s;
    EXPECT(strcmp(raindrop_explain_gl(text, sizeof text, &wrong), "") == 0);
    wrong.half_map = 2;
    EXPECT(strcmp(raindrop_explain_gl(text, sizeof text, &wrong), "half_map is 2; 0..1") == 0);
    EXPECT_EQ(raindrop_gl_create(&g, rg_no_procs, &wrong), SAT_ERR_ARGUMENT);
    EXPECT_EQ(raindrop_gl_create(&g, rg_no_procs, NULL), SAT_ERR_GL_FUNCTION);
    EXPECT(g && strstr(raindrop_gl_message(g), "gl") != NULL);
    EXPECT_EQ(raindrop_gl_render(g, NULL, 10, 10, NULL, NULL, NULL), SAT_ERR_ARGUMENT);
    raindrop_gl_destroy(g);
    EXPECT_EQ(raindrop_gl_create(&g, NULL, NULL), SAT_ERR_ARGUMENT);
    EXPECT(g == NULL && raindrop_gl_message(NULL) != NULL);
    raindrop_gl_destroy(NULL);
    if (!rg_open(&s)) return;
    g = rg_make(&s, NULL);
    EXPECT_EQ(raindrop_gl_render(g, NULL, 10, 10, NULL, NULL, NULL), SAT_ERR_ARGUMENT); /* no rain yet */
    EXPECT(strcmp(raindrop_gl_message(g), "there was no raindrop_gl_set_rain") == 0);
    EXPECT_EQ(raindrop_gl_advance(g, 1), SAT_ERR_ARGUMENT);
    {
        raindrop_render_options o = raindrop_render_defaults();
        raindrop_rain *rain = rg_rain(10, 1, 2);
        EXPECT_EQ(raindrop_gl_set_rain(g, rain), SAT_OK);
        o.look = RAINDROP_LOOK_MAP; /* without a map */
        EXPECT_EQ(raindrop_gl_render(g, NULL, 10, 10, NULL, NULL, &o), SAT_ERR_ARGUMENT);
        EXPECT(strcmp(raindrop_explain_render(text, sizeof text, 0, 10, 10, NULL, &o), raindrop_gl_message(g)) == 0);
        EXPECT_EQ(raindrop_gl_render(g, NULL, 10, 0, NULL, NULL, NULL), SAT_ERR_ARGUMENT);
        EXPECT(strcmp(raindrop_gl_message(g), "height is 0; 1..32768") == 0);
        raindrop_rain_destroy(rain);
    }
    raindrop_gl_destroy(g);
    rg_close(&s);
}

/* The shaders are GLSL ES 3.00 too: a context that calls itself ES gets them so, and draws; and the reference compiler
   takes them, each string no longer than C99 promises. */
static const unsigned char *(SAT__GL_CALL *rg_get_string)(unsigned name);
static void(SAT__GL_CALL *rg_shader_source)(unsigned shader, int count, const char *const *text, const int *lengths);
static sat_gl_get_proc *rg_real_procs;
static int rg_shaders, rg_valid;
static size_t rg_longest;

static const unsigned char *SAT__GL_CALL rg_es_string(unsigned name)
{
    return name == SAT__GL_VERSION ? (const unsigned char *)"OpenGL ES 3.0 (pretended)" : rg_get_string(name);
}

static void SAT__GL_CALL rg_es_source(unsigned shader, int count, const char *const *text, const int *lengths)
{
    char path[64], command[256];
    FILE *file;
    int i, is_vertex = 0;
    snprintf(path, sizeof path, "/tmp/test_raindrop_gl_%p", (void *)&file);
    file = fopen(path, "w");
    for (i = 0; i < count; i++) {
        if (file) fputs(text[i], file);
        is_vertex |= strstr(text[i], "gl_Position") != NULL;
        if (strlen(text[i]) > rg_longest) rg_longest = strlen(text[i]);
    }
    if (file) fclose(file);
    snprintf(command, sizeof command, "glslangValidator -S %s %s >%s.log 2>&1", is_vertex ? "vert" : "frag", path,
             path);
    rg_shaders++;
    rg_valid += system(command) == 0;
    remove(path);
    strcat(path, ".log");
    remove(path);
    rg_shader_source(shader, count, text, lengths);
}

static sat_gl_proc rg_es_procs(const char *name)
{
    if (strcmp(name, "glShaderSource") == 0) return (sat_gl_proc)rg_es_source;
    return strcmp(name, "glGetString") == 0 ? (sat_gl_proc)rg_es_string : rg_real_procs(name);
}

TEST(raindrop_gl_shaders_are_es)
{
    rg_scene s;
    raindrop_gl *g = NULL;
    raindrop_gl_options o = raindrop_gl_defaults();
    raindrop_rain *rain = rg_rain(2000, 1, 2);
    raindrop_render_options r = raindrop_render_defaults();
    raindrop_lamp lamp = raindrop_lamp_defaults();
    int kind, shaders;
    if (!rg_open(&s)) return;
    rg_get_string = s.gl.GetString;
    rg_shader_source = s.gl.ShaderSource;
    rg_real_procs = s.context.get_proc;
    o.map = s.map;
    o.oscillation = o.lamps = 1;
    raindrop__set(lamp.position, 1, 2, -1);
    r.sort = 0;
    r.orders_radius = 1e9f;
    if (!EXPECT_EQ(raindrop_gl_create(&g, rg_es_procs, &o), SAT_OK)) puts(raindrop_gl_message(g));
    EXPECT_EQ(raindrop_gl_set_environment(g, s.environment), SAT_OK);
    shaders = rg_shaders; /* of every program; none is made later */
    EXPECT(shaders >= 2 * RAINDROP__GL_PROGRAMS - 1);
    for (kind = 0; kind < 16; kind++) {
        int i;
        for (i = 0; i < rain->count; i++) rain->drops[i].axis_ratio = kind & RAINDROP__GL_FLAT ? 0.8f : 1;
        s.camera.exposure = kind & RAINDROP__GL_SOFT ? 0.001f : 0;
        r.orders = kind & 4 ? 2 : 0;
        r.oscillation = kind & 8 ? 0.1f : 0;
        r.lamps = &lamp;
        r.lamp_count = kind & 8 ? 1 : 0;
        EXPECT(rg_compare(&s, g, rain, &r) < 5e-4);
    }
    EXPECT_EQ(raindrop_gl_advance(g, 0.01), SAT_OK);
    EXPECT_EQ(rg_shaders, shaders);
    EXPECT(rg_longest < 4096);
    if (system("glslangValidator --version >/dev/null 2>&1") == 0) EXPECT_EQ(rg_valid, rg_shaders);
    raindrop_gl_destroy(g);
    raindrop_rain_destroy(rain);
    rg_close(&s);
}
