/* image.h - pictures in and out for the examples.                    SPDX-License-Identifier: MIT-0 OR Unlicense

       image picture;
       if (!image_load(&picture, "in.exr")) { fprintf(stderr, "%s\n", picture.message); return 1; }
       image_save(&picture, "out.png");
       image_free(&picture);

   In memory: rows from top to bottom, packed, linear light with Rec. 709 primaries, one float a channel; image_load
   gives three channels. What is written depends on the ending of the path:

     .exr        needs HAVE_OPENEXR (libopenexr-dev, -lOpenEXRCore-3_1): scan lines or tiles; RGB, also of a layer or a
                 part of its own, one channel as grey, or luminance and subsampled chroma; other primaries are converted
                 (Bradford)
     .png .jpg   are read with HAVE_STB (libstb-dev, -lstb): sRGB in 8 or 16 bits; turned as EXIF says. .png is always
                 written, 8 bits, larger without libstb
     .hdr .pfm   always

   Values are those of the file: NaN, infinities and negative components stay. */

#ifndef IMAGE_H
#define IMAGE_H

#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#define SAT_SIBLING      /* sat.h then lends its half floats and sRGB curve */
#include "../sat.h"
#undef SAT_SIBLING
#include "file.h"
#ifndef HAVE_STB
#include "png.h"
#endif

typedef struct image {
    float *pixels;
    int width, height, channels;
    char message[FILE_MESSAGE]; /* why a call returned 0 */
} image;

enum { IMAGE_MAX_SIDE = 1 << 16 };

static inline void image_free(image *picture)
{
    free(picture->pixels);
    picture->pixels = NULL;
}

/* Gives pixels to an image, all 0: 1, or 0 with a message. */
static inline int image_create(image *out, int width, int height, int channels)
{
    memset(out, 0, sizeof *out);
    if (width < 1 || height < 1 || channels < 1 || width > IMAGE_MAX_SIDE || height > IMAGE_MAX_SIDE || channels > 4) {
        snprintf(out->message, sizeof out->message, "%d x %d pixels of %d channels is no picture", width, height,
                 channels);
        return 0;
    }
    out->pixels = (float *)calloc((size_t)width * (size_t)height, (size_t)channels * sizeof(float));
    if (!out->pixels) {
        snprintf(out->message, sizeof out->message, "no memory for %d x %d pixels", width, height);
        return 0;
    }
    out->width = width;
    out->height = height;
    out->channels = channels;
    return 1;
}

static inline sat_image image_view(const image *picture)
{
    return sat_image_f32(picture->pixels, picture->width, picture->height, picture->channels);
}

static inline int image_fail(image *out, const char *path, const char *why)
{
    snprintf(out->message, sizeof out->message, "%.180s: %.130s", path, why);
    image_free(out);
    return 0;
}

/* The path ends with this, in any case of letters. */
static inline int image_ends_with(const char *path, const char *ending)
{
    size_t n = strlen(path), m = strlen(ending), i;
    if (n < m) return 0;
    for (i = 0; i < m; ++i)
        if (tolower((unsigned char)path[n - m + i]) != ending[i]) return 0;
    return 1;
}

/* ---- PFM: three lines of text, then floats, bottom row first; a negative scale means little endian ---- */

static inline int image_load_pfm(image *out, const char *path)
{
    FILE *file = fopen(path, "rb");
    char kind = 0;
    int width = 0, height = 0, x, y, c, channels;
    float scale = 0;
    if (!file) return image_fail(out, path, "cannot be opened");
    if (fscanf(file, "P%c %d %d %f", &kind, &width, &height, &scale) != 4 || fgetc(file) == EOF || (kind != 'F' && kind != 'f')) {
        fclose(file);
        return image_fail(out, path, "is not a PFM file");
    }
    if (!image_create(out, width, height, 3)) { fclose(file); return 0; }
    channels = kind == 'F' ? 3 : 1;
    for (y = height - 1; y >= 0; --y) {
        float *row = out->pixels + (size_t)y * (size_t)width * 3;
        for (x = 0; x < width; ++x) {
            for (c = 0; c < channels; ++c) {
                unsigned char b[4];
                uint32_t bits;
                if (fread(b, 1, 4, file) != 4) { fclose(file); return image_fail(out, path, "ends too early"); }
                bits = scale < 0 ? (uint32_t)b[0] | (uint32_t)b[1] << 8 | (uint32_t)b[2] << 16 | (uint32_t)b[3] << 24
                                 : (uint32_t)b[3] | (uint32_t)b[2] << 8 | (uint32_t)b[1] << 16 | (uint32_t)b[0] << 24;
                memcpy(&row[3 * x + c], &bits, 4);
            }
            for (c = channels; c < 3; ++c) row[3 * x + c] = row[3 * x];
        }
    }
    fclose(file);
    return 1;
}

static inline int image_save_pfm(image *picture, const char *path)
{
    file_writer file;
    int x, y, c, channels = picture->channels >= 3 ? 3 : 1;
    char head[64];
    if (!file_open(&file, path, picture->message)) return 0;
    snprintf(head, sizeof head, "P%c\n%d %d\n-1.0\n", channels == 3 ? 'F' : 'f', picture->width, picture->height);
    file_put(&file, head, strlen(head));
    for (y = picture->height - 1; y >= 0; --y)
        for (x = 0; x < picture->width; ++x)
            for (c = 0; c < channels; ++c) {
                unsigned char bytes[4];
                uint32_t bits;
                memcpy(&bits,
                       picture->pixels + ((size_t)y * (size_t)picture->width + (size_t)x) * (size_t)picture->channels +
                           c,
                       4);
                bytes[0] = (unsigned char)bits, bytes[1] = (unsigned char)(bits >> 8);
                bytes[2] = (unsigned char)(bits >> 16), bytes[3] = (unsigned char)(bits >> 24);
                file_put(&file, bytes, 4);
            }
    return file_close(&file, 1, picture->message);
}

/* ---- Radiance HDR: lines of text, then rows of bytes R G B and a common exponent (Ward, Graphics Gems II, 1991)
   ---- */

/* One row of four bytes a pixel: run lengths a component since 1991, before that plain pixels. 0: the bytes end too
   early. */
static inline int image_hdr_row(unsigned char *row, int width, const unsigned char **at, const unsigned char *end)
{
    const unsigned char *p = *at;
    int c, x, n;
    if (end - p < 4) return 0;
    if (width < 8 || width > 32767 || p[0] != 2 || p[1] != 2 || p[2] * 256 + p[3] != width) {
        if ((size_t)(end - p) < 4 * (size_t)width) return 0;
        memcpy(row, p, 4 * (size_t)width);
        *at = p + 4 * (size_t)width;
        return 1;
    }
    for (c = 0, p += 4; c < 4; ++c)
        for (x = 0; x < width; x += n) {
            int run, i;
            if (p == end) return 0;
            run = *p > 128;
            n = run ? *p - 128 : *p;
            ++p;
            if (n == 0 || n > width - x || end - p < (run ? 1 : n)) return 0;
            for (i = 0; i < n; ++i) row[4 * (x + i) + c] = run ? p[0] : p[i];
            p += run ? 1 : n;
        }
    *at = p;
    return 1;
}

static inline int image_load_hdr(image *out, const char *path)
{
    size_t size;
    unsigned char *bytes = file_read(path, &size, out->message), *row = NULL;
    const unsigned char *at, *end, *line;
    int width = 0, height = 0, known = 0, x, y, c;
    const char *why = NULL;
    if (!bytes) return 0;
    end = bytes + size;
    if (size < 10 || memcmp(bytes, "#?", 2) != 0) why = "is not a Radiance picture";
    for (at = line = bytes; !why; line = at) { /* up to the line with the size */
        while (at < end && *at != '\n') ++at;
        if (at == end) why = "ends too early";
        else if (at - line == 22 && memcmp(line, "FORMAT=32-bit_rle_rgbe", 22) == 0) known = 1;
        else if (at - line > 7 && memcmp(line, "FORMAT=", 7) == 0) why = "is in a format other than 32-bit_rle_rgbe";
        else if (line > bytes && at - line > 8 && (line[0] == '-' || line[0] == '+') && line[2] == ' ') {
            char text[64];
            snprintf(text, sizeof text, "%.*s", (int)(at - line), (const char *)line);
            if (sscanf(text, "-Y %d +X %d", &height, &width) != 2) why = "has rows that do not go from top to bottom and left to right";
            ++at;
            break;
        }
        if (!why) ++at;
    }
    if (!why && !known) why = "does not say that its format is 32-bit_rle_rgbe";
    if (!why && !image_create(out, width, height, 3)) why = "is too large or empty";
    width = out->width, height = out->height;
    if (!why && !(row = (unsigned char *)malloc(4 * (size_t)width))) why = "is too large for the memory";
    for (y = 0; !why && y < height; ++y) {
        if (!image_hdr_row(row, width, &at, end)) why = "ends too early or is damaged";
        for (x = 0; !why && x < width; ++x)
            for (c = 0; c < 3; ++c)
                out->pixels[3 * ((size_t)y * (size_t)width + (size_t)x) + (size_t)c] =
                    row[4 * x + 3] ? (float)ldexp(row[4 * x + c], row[4 * x + 3] - 136) : 0.0f;
    }
    free(row);
    free(bytes);
    return why ? image_fail(out, path, why) : 1;
}

/* The common exponent is that of the largest component: the others keep what is above 1/256 of it. NaN and what is
   below 0 become 0. */
static inline void image_hdr_pixel(unsigned char *out, const float *rgb, int channels)
{
    double v[3], most = 0;
    int c, e;
    for (c = 0; c < 3; ++c) {
        v[c] = (double)rgb[channels >= 3 ? c : 0];
        v[c] = v[c] > 0 ? (v[c] < 1.6e38 ? v[c] : 1.6e38) : 0;
        if (v[c] > most) most = v[c];
    }
    memset(out, 0, 4);
    if (most < 1e-38) return;
    frexp(most, &e);
    if (ldexp(most, 8 - e) >= 255.5) ++e;
    for (c = 0; c < 3; ++c) out[c] = (unsigned char)(ldexp(v[c], 8 - e) + 0.5);
    out[3] = (unsigned char)(e + 128);
}

static inline int image_save_hdr(image *picture, const char *path)
{
    file_writer file;
    size_t i, n = (size_t)picture->width * (size_t)picture->height;
    char head[96];
    if (!file_open(&file, path, picture->message)) return 0;
    snprintf(head, sizeof head, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n", picture->height, picture->width);
    file_put(&file, head, strlen(head));
    for (i = 0; i < n; ++i) {
        unsigned char pixel[4];
        image_hdr_pixel(pixel, picture->pixels + i * (size_t)picture->channels, picture->channels);
        file_put(&file, pixel, 4);
    }
    return file_close(&file, 1, picture->message);
}

/* ---- PNG and JPEG ---- */

#ifdef HAVE_STB
#include <stb/stb_image.h>
#include <stb/stb_image_write.h>

static inline int image_jpeg_u16(const unsigned char *p, int little)
{
    return little ? p[0] | p[1] << 8 : p[0] << 8 | p[1];
}

/* What the camera says about the way it was held (EXIF 2.3, tag 0x0112): 1 to 8, 1 when it says nothing. p: an APP1
   segment. */
static inline int image_jpeg_turn(const unsigned char *p, size_t size)
{
    size_t ifd, i, entries;
    int little;
    if (size < 22 || memcmp(p, "Exif\0\0", 6) != 0) return 1;
    p += 6, size -= 6;
    little = p[0] == 'I';
    ifd = little ? (size_t)p[4] | (size_t)p[5] << 8 | (size_t)p[6] << 16
                 : (size_t)p[7] | (size_t)p[6] << 8 | (size_t)p[5] << 16;
    if (ifd + 2 > size) return 1;
    entries = (size_t)image_jpeg_u16(p + ifd, little);
    for (i = 0; i < entries && ifd + 14 + 12 * i <= size; ++i) {
        const unsigned char *entry = p + ifd + 2 + 12 * i;
        int turn = image_jpeg_u16(entry + 8, little);
        if (image_jpeg_u16(entry, little) == 0x0112) return turn >= 1 && turn <= 8 ? turn : 1;
    }
    return 1;
}

/* Walks over a JPEG file's segments: what stb_image passes over in silence. NULL, or what is wrong. */
static inline const char *image_jpeg_check(const unsigned char *p, size_t size, int *turn)
{
    size_t at = 2;
    *turn = 1;
    while (at + 4 <= size && p[at] == 0xff && p[at + 1] != 0xda) {
        size_t length = (size_t)image_jpeg_u16(p + at + 2, 0);
        if (p[at + 1] == 0xff) { ++at; continue; } /* filling */
        if (at + 2 + length > size) break;
        if (p[at + 1] == 0xe1 && *turn == 1 && length > 2) *turn = image_jpeg_turn(p + at + 4, length - 2);
        at += 2 + length;
    }
    for (; at + 2 <= size; ++at) /* 255 217 ends the picture and cannot be part of its data */
        if (p[at] == 0xff && p[at + 1] == 0xd9) return NULL;
    return "ends too early";
}

/* The picture as the camera was held. Bit 0 of `how`: mirror left and right; 1: top and bottom; 2: swap x and y
   afterwards. */
static inline int image_turn(image *picture, int turn)
{
    static const unsigned char ways[8] = {0, 1, 3, 2, 4, 6, 7, 5};
    int how = ways[turn - 1], x, y;
    image from = *picture;
    if (how == 0) return 1;
    if (!image_create(picture, how & 4 ? from.height : from.width, how & 4 ? from.width : from.height, 3)) {
        image_free(&from);
        return 0;
    }
    for (y = 0; y < from.height; ++y)
        for (x = 0; x < from.width; ++x) {
            int u = how & 1 ? from.width - 1 - x : x, v = how & 2 ? from.height - 1 - y : y;
            size_t to = how & 4 ? (size_t)u * (size_t)picture->width + (size_t)v
                                : (size_t)v * (size_t)picture->width + (size_t)u;
            memcpy(picture->pixels + 3 * to, from.pixels + 3 * ((size_t)y * (size_t)from.width + (size_t)x),
                   3 * sizeof(float));
        }
    image_free(&from);
    return 1;
}

static inline int image_load_stb(image *out, const char *path)
{
    int width = 0, height = 0, channels, turn = 1;
    size_t size, i, n;
    unsigned char *file = file_read(path, &size, out->message), *bytes = NULL;
    unsigned short *words = NULL;
    const char *why = NULL;
    if (!file) return 0;
    if (size > 0x7fffffff) why = "is too large";
    else if (size > 2 && file[0] == 0xff && file[1] == 0xd8) why = image_jpeg_check(file, size, &turn);
    if (!why && stbi_is_16_bit_from_memory(file, (int)size))
        words = stbi_load_16_from_memory(file, (int)size, &width, &height, &channels, 3);
    else if (!why) bytes = stbi_load_from_memory(file, (int)size, &width, &height, &channels, 3);
    free(file);
    if (!why && !words && !bytes) why = stbi_failure_reason();
    if (why) image_fail(out, path, why);
    else if (image_create(out, width, height, 3)) {
        n = (size_t)width * (size_t)height * 3;
        for (i = 0; i < n; ++i)
            out->pixels[i] = sat__srgb_decode(words ? (float)words[i] / 65535.0f : (float)bytes[i] / 255.0f);
        image_turn(out, turn);
    }
    stbi_image_free(words);
    stbi_image_free(bytes);
    return out->pixels != NULL;
}

static void image_stb_put(void *file, void *bytes, int count) { file_put((file_writer *)file, bytes, (size_t)count); }

static inline int image_write_png(file_writer *file, const unsigned char *bytes, int width, int height, int channels)
{
    return stbi_write_png_to_func(image_stb_put, file, width, height, channels, bytes, width * channels);
}

#else

static inline int image_load_stb(image *out, const char *path)
{
    return image_fail(out, path, "this program was built without libstb (libstb-dev), which reads .png and .jpg");
}

static inline int image_write_png(file_writer *file, const unsigned char *bytes, int width, int height, int channels)
{
    size_t size = 0;
    unsigned char *png = png_encode(&size, bytes, width, height, channels);
    if (png) file_put(file, png, size);
    free(png);
    return png != NULL;
}
#endif

/* A PNG of 8-bit pixels as they are (sRGB), 1 to 4 channels: 1, or 0 with a sentence (FILE_MESSAGE bytes, or NULL). */
static inline int image_save_u8(char *why, const char *path, const unsigned char *bytes, int width, int height,
                                int channels)
{
    file_writer file;
    int ok;
    if (!image_ends_with(path, ".png")) return file_fail(why, path, "8-bit pixels are written as .png");
    if (!file_open(&file, path, why)) return 0;
    ok = image_write_png(&file, bytes, width, height, channels);
    if (!ok && !file.error) file.error = ENOMEM;
    return file_close(&file, ok, why);
}

/* Linear light, clamped to [0, 1], NaN to 0. */
static inline int image_save_png(image *picture, const char *path)
{
    size_t i, n = (size_t)picture->width * (size_t)picture->height * (size_t)picture->channels;
    unsigned char *bytes = (unsigned char *)malloc(n);
    int ok;
    if (!bytes) return snprintf(picture->message, sizeof picture->message, "no memory"), 0;
    for (i = 0; i < n; ++i) {
        float v = picture->pixels[i];
        v = v > 0.0f ? (v < 1.0f ? v : 1.0f) : 0.0f;
        bytes[i] = (unsigned char)(sat__srgb_encode(v) * 255.0f + 0.5f);
    }
    ok = image_save_u8(picture->message, path, bytes, picture->width, picture->height, picture->channels);
    free(bytes);
    return ok;
}

#ifdef HAVE_OPENEXR
#include "image_exr.h"
#else
static inline int image_load_exr(image *out, const char *path)
{
    return image_fail(out, path, "this program was built without OpenEXR (libopenexr-dev), which reads .exr");
}
static inline int image_save_exr(image *picture, const char *path, int half)
{
    (void)half;
    snprintf(picture->message, sizeof picture->message, "%.180s: this program was built without OpenEXR (libopenexr-dev), which writes .exr", path);
    return 0;
}
#endif

/* ---- by the ending of the path ---- */

static inline int image_load(image *out, const char *path)
{
    memset(out, 0, sizeof *out);
    if (access(path, R_OK))
        return image_fail(out, path, errno == ENOENT ? "cannot be opened: there is no such file" : strerror(errno));
    if (image_ends_with(path, ".exr")) return image_load_exr(out, path);
    if (image_ends_with(path, ".pfm")) return image_load_pfm(out, path);
    if (image_ends_with(path, ".hdr")) return image_load_hdr(out, path);
    if (image_ends_with(path, ".png") || image_ends_with(path, ".jpg") || image_ends_with(path, ".jpeg"))
        return image_load_stb(out, path);
    return image_fail(out, path, "is none of .exr .hdr .pfm .png .jpg");
}

/* .exr and .pfm keep every float (image_save_exr can halve them), .hdr keeps 8 bits of what is not negative, .png
   clamps to [0, 1]. */
static inline int image_save(image *picture, const char *path)
{
    if (image_ends_with(path, ".exr")) return image_save_exr(picture, path, 0);
    if (image_ends_with(path, ".pfm")) return image_save_pfm(picture, path);
    if (image_ends_with(path, ".hdr")) return image_save_hdr(picture, path);
    if (image_ends_with(path, ".png")) return image_save_png(picture, path);
    return file_fail(picture->message, path, "is none of .exr .hdr .pfm .png");
}

#endif /* IMAGE_H */
