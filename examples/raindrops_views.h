/* raindrops_views.h - for raindrops.c: a sky where there is no picture, a sheet of three speeds, and one drop beside
   ray tracing.
   SPDX-License-Identifier: MIT-0 OR Unlicense */

/* ---- dusk over hills with lamps ---- */

static int made_up_sky(image *sky)
{
    int x, y, c;
    if (!image_create(sky, 1024, 512, 3)) return 0;
    for (y = 0; y < sky->height; y++) {
        for (x = 0; x < sky->width; x++) {
            double a = 6.283185 * (x + 0.5) / sky->width, up = cos(3.141593 * (y + 0.5) / sky->height),
                   hills = 0.1 + 0.04 * sin(5 * a) + 0.02 * sin(13 * a + 1);
            double glow = exp(-6 * fabs(up - hills)) * (0.6 - 0.4 * cos(a)),
                   lamp = pow(fmax(0, cos(40 * a) * cos(31 * up)), 60);
            double sky_rgb[3] = {0.12 + 2.2 * glow, 0.2 + 0.9 * glow, 0.5 + 0.35 * glow}, land[3] = {0.03, 0.035, 0.02};
            float *p = sky->pixels + 3 * ((size_t)y * (size_t)sky->width + (size_t)x);
            for (c = 0; c < 3; c++)
                p[c] = (float)(up > hills ? sky_rgb[c] : land[c] + (up > -0.3 ? lamp * (c == 2 ? 8 : 20) : 0));
        }
    }
    return 1;
}

/* ---- sequences on one sheet ---- */

/* Four moments each of a paused scene around which the camera turns, of slow motion (1/100) and of real time. */
static int save_sheet(scene *s, const char *path)
{
    static const struct { const char *label; double dt, exposure, turn;
    } rows[3] = {{"paused, the camera turns", 0, 0, 0.12},
                 {"slow motion 1/100", 1 / 6000.0, 1 / 12000.0, 0},
                 {"real time, 1/120 s exposure", 1 / 60.0, 1 / 120.0, 0}};
    size_t bytes = (size_t)s->picture.width * (size_t)s->picture.height * 3;
    unsigned char *rgb = (unsigned char *)malloc(12 * bytes);
    common_cell cells[12];
    int row, i, ok = rgb != NULL;
    for (row = 0; row < 3 && ok; row++) {
        for (i = 0; i < 4 && ok; i++) {
            float eye[3] = {0, 0, 0}, up[3] = {0, 1, 0}, target[3], angle = s->set->turn + (float)(rows[row].turn * i);
            target[0] = sinf(angle);
            target[1] = 0.05f;
            target[2] = -cosf(angle);
            eye[0] = (float)(-0.02 * rows[row].turn * i);
            s->camera = raindrop_camera_look(eye, target, up, s->set->fov * 0.01745329f);
            s->camera.depth_near = s->set->depth_near;
            s->camera.exposure = (float)rows[row].exposure;
            ok = draw_background(s);
            cells[4 * row + i].rgb = rgb + (size_t)(4 * row + i) * bytes;
            cells[4 * row + i].width = s->picture.width;
            cells[4 * row + i].height = s->picture.height;
            cells[4 * row + i].label = rows[row].label;
            ok = ok && draw(s) && tone(rgb + (size_t)(4 * row + i) * bytes, s) &&
                 check("advance", raindrop_rain_advance(s->rain, rows[row].dt));
        }
    }
    ok = ok && common_contact_sheet(&s->set->common, path, cells, 12, 4);
    free(rgb);
    return ok;
}

/* ---- one drop beside ray tracing (Slomp 2012, figure 2.1) ---- */

/* out = refracted d, normal against d, relative index n; double, straight from Snell's law. */
static void bend(double out[3], const double d[3], const double normal[3], double n)
{
    double c = -(d[0] * normal[0] + d[1] * normal[1] + d[2] * normal[2]), k = sqrt(fmax(0, 1 - (1 - c * c) / (n * n)));
    int i;
    for (i = 0; i < 3; i++) out[i] = d[i] / n + normal[i] * (c / n - k);
}

/* Light along d through a sphere of radius 1 around `centre`: hit, bend, hit, bend, and the mirrored ray; 0: no hit. */
static int trace(float rgb[3], const scene *s, const double d[3], const double centre[3])
{
    double along = 0, b2 = 0, t, n = (double)RAINDROP_WATER, p[3], q[3], inner[3], leave[3], ci, cr, fs, fp, fresnel;
    float direction[3], mirrored[3], through[3];
    int i;
    for (i = 0; i < 3; i++) along += d[i] * centre[i];
    for (i = 0; i < 3; i++) b2 += (d[i] * along - centre[i]) * (d[i] * along - centre[i]);
    if (b2 >= 1) return 0;
    t = along - sqrt(1 - b2);
    for (i = 0; i < 3; i++) p[i] = d[i] * t - centre[i]; /* the normal, too */
    ci = sqrt(1 - b2);
    bend(inner, d, p, n);
    cr = -(inner[0] * p[0] + inner[1] * p[1] + inner[2] * p[2]);
    for (i = 0; i < 3; i++) q[i] = p[i] + 2 * cr * inner[i];
    for (i = 0; i < 3; i++) leave[i] = -q[i];
    bend(leave, inner, leave, 1 / n);
    fs = (ci - n * cr) / (ci + n * cr);
    fp = (n * ci - cr) / (n * ci + cr);
    fresnel = 0.5 * (fs * fs + fp * fp);
    for (i = 0; i < 3; i++) direction[i] = (float)(d[i] + 2 * ci * p[i]);
    raindrop_environment_sample(mirrored, s->environment, direction, 0);
    for (i = 0; i < 3; i++) direction[i] = (float)leave[i];
    raindrop_environment_sample(through, s->environment, direction, 0);
    for (i = 0; i < 3; i++) rgb[i] = (float)(fresnel * (double)mirrored[i] + (1 - fresnel) * (double)through[i]);
    return 1;
}

static void trace_picture(scene *s, const double centre[3])
{
    const raindrop_camera *camera = &s->camera;
    int w = s->picture.width, h = s->picture.height, x, y, k, i, c;
    double focal = 0.5 * h / tan(0.5 * (double)camera->fov_y);
    for (y = 0; y < h; y++) {
        for (x = 0; x < w; x++) {
            float *out = s->picture.pixels + 3 * ((size_t)y * (size_t)w + (size_t)x), rgb[3], f[3];
            double sum[3] = {0, 0, 0};
            for (k = 0; k < 64; k++) { /* 8 x 8 rays */
                double px = (x + (k % 8 + 0.5) / 8 - 0.5 * w) / focal, py = (0.5 * h - y - (k / 8 + 0.5) / 8) / focal,
                       d[3], length = sqrt(px * px + py * py + 1);
                for (i = 0; i < 3; i++)
                    d[i] =
                        (px * (double)camera->right[i] + py * (double)camera->up[i] - (double)camera->back[i]) / length;
                for (i = 0; i < 3; i++) f[i] = (float)d[i];
                if (!trace(rgb, s, d, centre)) raindrop_environment_sample(rgb, s->environment, f, 0);
                for (c = 0; c < 3; c++) sum[c] += (double)rgb[c] / 64;
            }
            for (c = 0; c < 3; c++) out[c] = (float)sum[c];
        }
    }
}

static int save_closeup(scene *s, const char *path)
{
    static const char *const labels[4] = {"ray traced, 8 x 8 rays", "ray (closed form)", "closed form on a sprite",
                                          "published map"};
    static const raindrop_look looks[4] = {RAINDROP_LOOK_RAY, RAINDROP_LOOK_RAY, RAINDROP_LOOK_SPRITE,
                                           RAINDROP_LOOK_MAP};
    size_t bytes = (size_t)s->picture.width * (size_t)s->picture.height * 3;
    unsigned char *rgb = (unsigned char *)malloc(8 * bytes);
    common_cell cells[8];
    int place, i, k, ok = rgb != NULL;
    s->render.orders = 0; /* eq 2.5 in all of them */
    for (place = 0; place < 2 && ok; place++) { /* in the middle, and to the side, where a sprite cannot be right */
        raindrop_drop drop;
        double centre[3];
        memset(&drop, 0, sizeof drop);
        drop.radius = drop.axis_ratio = 1;
        for (k = 0; k < 3; k++) {
            drop.position[k] =
                (place ? 1.15f * s->camera.right[k] + 0.7f * s->camera.up[k] : 0) - 2.3f * s->camera.back[k];
            centre[k] = (double)drop.position[k];
        }
        ok = check("drop", raindrop_rain_set_drops(s->rain, &drop, 1));
        for (i = 0; i < 4 && ok; i++) {
            s->render.look = looks[i];
            if (i == 0) trace_picture(s, centre);
            else ok = draw(s);
            cells[4 * place + i].rgb = rgb + (size_t)(4 * place + i) * bytes;
            cells[4 * place + i].width = s->picture.width;
            cells[4 * place + i].height = s->picture.height;
            cells[4 * place + i].label = labels[i];
            ok = ok && tone(rgb + (size_t)(4 * place + i) * bytes, s);
        }
    }
    ok = ok && common_contact_sheet(&s->set->common, path, cells, 8, 4);
    free(rgb);
    return ok;
}
