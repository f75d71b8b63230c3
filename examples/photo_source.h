/* photo_source.h - pictures as their files hold them, shrunk to any size.   SPDX-License-Identifier: MIT-0 OR Unlicense

       source s;
       if (!source_load(&s, path, paper, &out)) ...     out.message says why
       shrink_upright(&s, width, height, &out);         turned as the camera was held, cut to that shape, linear light
       source_free(&s);

   JPEG and PNG stay bytes; what shows through a picture is paper. to_lab makes CIELAB of linear light. */

#ifndef PHOTO_SOURCE_H
#define PHOTO_SOURCE_H

#include "image.h"

typedef struct source {
    unsigned char *bytes; /* sRGB; or */
    float *light;         /* linear */
    int width, height, channels;
    int turn;    /* EXIF 2.3, tag 0x0112 */
    float paper; /* what shows through, linear */
} source;

static float linear_of[256]; /* sRGB bytes in linear light */

static void source_free(source *s)
{
    free(s->bytes);
    free(s->light);
}

/* 1, or 0 with a sentence in out->message. JPEG and PNG stay bytes: 36 MB for twelve million pixels. */
static int source_load(source *s, const char *path, int paper, image *out)
{
#ifdef HAVE_STB
    const char *why = NULL;
    unsigned char *file;
    size_t size;
#endif
    memset(s, 0, sizeof *s);
    memset(out, 0, sizeof *out);
    s->turn = 1;
    s->paper = linear_of[paper];
#ifdef HAVE_STB
    if (image_ends_with(path, ".jpg") || image_ends_with(path, ".jpeg") || image_ends_with(path, ".png")) {
        file = file_read(path, &size, out->message);
        if (!file) return 0;
        if (size > 0x7fffffff) why = "is too large";
        else if (size > 2 && file[0] == 0xff && file[1] == 0xd8) why = image_jpeg_check(file, size, &s->turn);
        if (!why && stbi_info_from_memory(file, (int)size, &s->width, &s->height, &s->channels)) {
            s->channels = s->channels % 2 ? 3 : 4;
            s->bytes = stbi_load_from_memory(file, (int)size, &s->width, &s->height, NULL, s->channels);
        }
        if (!why && !s->bytes) why = stbi_failure_reason();
        free(file);
        return why ? image_fail(out, path, why) : 1;
    }
#endif
    if (!image_load(out, path)) return 0;
    s->light = out->pixels;
    s->width = out->width;
    s->height = out->height;
    s->channels = 3;
    out->pixels = NULL;
    return 1;
}

/* Adds a part of a row to a line of linear colours. */
static void add_row(const source *s, int y, int from, int to, float weight, float *line)
{
    size_t at = ((size_t)y * (size_t)s->width + (size_t)from) * (size_t)s->channels;
    int x, c;
    for (x = from; x < to; x++, at += (size_t)s->channels, line += 3) {
        float cover = s->channels == 4 ? (float)s->bytes[at + 3] / 255.0f : 1.0f;
        for (c = 0; c < 3; c++) {
            float v = s->bytes ? linear_of[s->bytes[at + (size_t)c]] : s->light[at + (size_t)c];
            line[c] += weight * (cover * v + (1 - cover) * s->paper);
        }
    }
}

/* How much of pixel i lies between two places. */
static float overlap(int i, double from, double to)
{
    return (float)((to < i + 1 ? to : i + 1) - (from > i ? from : i));
}

/* Means of linear light over the boxes of a width x height grid that lies over a part of the picture; from_x to from_y
   + down may be fractions. 0 without memory. */
static int shrink(const source *s, double from_x, double from_y, double across, double down, int width, int height,
                  float *out)
{
    int left = (int)from_x, right = (int)ceil(from_x + across - 1e-9), x, y, i, c;
    float *line;
    if (right > s->width) right = s->width;
    line = (float *)malloc((size_t)(right - left) * 3 * sizeof(float));
    for (y = 0; line && y < height; y++) {
        double top = from_y + down * y / height, bottom = from_y + down * (y + 1) / height;
        memset(line, 0, (size_t)(right - left) * 3 * sizeof(float));
        for (i = (int)top; i < s->height && i < bottom; i++)
            add_row(s, i, left, right, overlap(i, top, bottom) / (float)(down / height), line);
        for (x = 0; x < width; x++) {
            double begin = from_x + across * x / width, end = from_x + across * (x + 1) / width;
            float *p = out + ((size_t)y * (size_t)width + (size_t)x) * 3;
            p[0] = p[1] = p[2] = 0;
            for (i = (int)begin; i < right && i < end; i++)
                for (c = 0; c < 3; c++)
                    p[c] += line[(i - left) * 3 + c] * overlap(i, begin, end) / (float)(across / width);
        }
    }
    free(line);
    return line != NULL;
}

/* The middle of the picture in the shape of width x height, so many pixels of it, turned as the camera was held. */
static int shrink_upright(const source *s, int width, int height, image *out)
{
    int swap = s->turn >= 5, w = swap ? height : width, h = swap ? width : height;
    double across = s->width, down = s->height;
    if (across * h > down * w) across = down * w / h;
    else down = across * h / w;
    if (!image_create(out, w, h, 3)) return 0;
    if (!shrink(s, (s->width - across) / 2, (s->height - down) / 2, across, down, w, h, out->pixels)) {
        image_free(out);
        snprintf(out->message, sizeof out->message, "no memory");
        return 0;
    }
#ifdef HAVE_STB
    return image_turn(out, s->turn);
#else
    return 1;
#endif
}

/* Linear colours become CIELAB under D65. */
static void to_lab(float *colour, size_t count)
{
    static const float to_xyz[9] = {0.43395f, 0.37621f, 0.18984f, 0.21264f, 0.71517f,
                                    0.07219f, 0.01776f, 0.10947f, 0.87277f};
    for (; count-- > 0; colour += 3) {
        float f[3];
        int k;
        for (k = 0; k < 3; k++) { /* X, Y, Z over those of white */
            float v = to_xyz[3 * k] * colour[0] + to_xyz[3 * k + 1] * colour[1] + to_xyz[3 * k + 2] * colour[2];
            v = v > 0 ? v < 1e6f ? v : 1e6f : 0; /* NaN too */
            f[k] = v > 0.008856452f ? cbrtf(v) : v * 7.787037f + 0.13793103f;
        }
        colour[0] = 116 * f[1] - 16;
        colour[1] = 500 * (f[0] - f[1]);
        colour[2] = 200 * (f[1] - f[2]);
    }
}

static unsigned char to_byte(float linear)
{
    return (unsigned char)(255 * sat__srgb_encode(linear > 0 ? linear < 1 ? linear : 1 : 0) + 0.5f);
}

#endif
