/* image.h - pictures in and out for the examples.                    SPDX-License-Identifier: MIT-0 OR Unlicense

       image picture;
       if (!image_load(&picture, "in.exr")) { fprintf(stderr, "%s\n", picture.message); return 1; }
       image_save(&picture, "out.png");
       image_free(&picture);

   In memory: rows from top to bottom, packed, linear light with Rec. 709 primaries, one float a channel; image_load
   gives three channels. What is written depends on the ending of the path:

     .exr        needs HAVE_OPENEXR (libopenexr-dev, -lOpenEXRCore-3_1): the first part; scan lines or tiles; RGB, one
                 channel as grey, or luminance and subsampled chroma; other primaries are converted (Bradford)
     .hdr .png .jpg  needs HAVE_STB (libstb-dev, -lstb); 8-bit files are sRGB
     .pfm        always; .png is always written, larger without libstb

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

typedef struct image {
    float *pixels;
    int width, height, channels;
    char message[320];       /* why a call returned 0 */
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
        snprintf(out->message, sizeof out->message, "%d x %d pixels of %d channels is no picture", width, height, channels);
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
    FILE *file = fopen(path, "wb");
    int x, y, c, channels = picture->channels >= 3 ? 3 : 1, bad;
    if (!file) return snprintf(picture->message, sizeof picture->message, "%.250s: cannot be written", path), 0;
    fprintf(file, "P%c\n%d %d\n-1.0\n", channels == 3 ? 'F' : 'f', picture->width, picture->height);
    for (y = picture->height - 1; y >= 0; --y)
        for (x = 0; x < picture->width; ++x)
            for (c = 0; c < channels; ++c) {
                uint32_t bits;
                memcpy(&bits, picture->pixels + ((size_t)y * (size_t)picture->width + (size_t)x) * (size_t)picture->channels + c, 4);
                fputc((int)(bits & 255), file);
                fputc((int)(bits >> 8 & 255), file);
                fputc((int)(bits >> 16 & 255), file);
                fputc((int)(bits >> 24), file);
            }
    bad = ferror(file);
    if (fclose(file) || bad) return snprintf(picture->message, sizeof picture->message, "%.250s: cannot be written", path), 0;
    return 1;
}

/* ---- PNG, JPEG, Radiance HDR ---- */

#ifdef HAVE_STB
#include <stb/stb_image.h>
#include <stb/stb_image_write.h>

static inline int image_load_stb(image *out, const char *path)
{
    int width = 0, height = 0, channels;
    size_t i, n;
    float *light = NULL;
    unsigned char *bytes = NULL;
    if (stbi_is_hdr(path)) light = stbi_loadf(path, &width, &height, &channels, 3);
    else bytes = stbi_load(path, &width, &height, &channels, 3);
    if (!light && !bytes) return image_fail(out, path, stbi_failure_reason());
    if (image_create(out, width, height, 3)) {
        n = (size_t)width * (size_t)height * 3;
        for (i = 0; i < n; ++i) out->pixels[i] = light ? light[i] : sat__srgb_decode((float)bytes[i] / 255.0f);
    }
    stbi_image_free(light);
    stbi_image_free(bytes);
    return out->pixels != NULL;
}

static inline int image_write_png(const char *path, const unsigned char *bytes, int width, int height, int channels)
{
    return stbi_write_png(path, width, height, channels, bytes, width * channels);
}

#else

static inline int image_load_stb(image *out, const char *path)
{
    return image_fail(out, path, "this program was built without libstb (libstb-dev), which reads .hdr, .png and .jpg");
}

/* PNG with its deflate stream in stored blocks, one a row (PNG 1.2, RFC 1950 and 1951). */
typedef struct image_png { FILE *file; uint32_t crc, a, b; } image_png;

static inline void image_png_bytes(image_png *png, const unsigned char *p, size_t n)
{
    size_t i;
    int k;
    for (i = 0; i < n; ++i) {
        png->crc ^= p[i];
        for (k = 0; k < 8; ++k) png->crc = png->crc & 1 ? png->crc >> 1 ^ UINT32_C(0xedb88320) : png->crc >> 1;
    }
    fwrite(p, 1, n, png->file);
}

static inline void image_png_u32(image_png *png, uint32_t v)
{
    unsigned char b[4];
    b[0] = (unsigned char)(v >> 24);
    b[1] = (unsigned char)(v >> 16);
    b[2] = (unsigned char)(v >> 8);
    b[3] = (unsigned char)v;
    image_png_bytes(png, b, 4);
}

static inline void image_png_begin(image_png *png, uint32_t size, const char *name)
{
    image_png_u32(png, size);
    png->crc = UINT32_C(0xffffffff);
    image_png_bytes(png, (const unsigned char *)name, 4);
}

static inline void image_png_end(image_png *png) { image_png_u32(png, ~png->crc); }

/* bytes of the deflate stream that count for its Adler checksum */
static inline void image_png_data(image_png *png, const unsigned char *p, size_t n)
{
    size_t i;
    for (i = 0; i < n; ++i) {
        png->a = (png->a + p[i]) % 65521;
        png->b = (png->b + png->a) % 65521;
    }
    image_png_bytes(png, p, n);
}

static inline int image_write_png(const char *path, const unsigned char *bytes, int width, int height, int channels)
{
    static const unsigned char colour[5] = {0, 0, 4, 2, 6}, signature[8] = {137, 'P', 'N', 'G', 13, 10, 26, 10}, zlib[2] = {0x78, 1};
    uint32_t row = (uint32_t)width * (uint32_t)channels, blocks, part, at;
    unsigned char head[5] = {8, 0, 0, 0, 0}, filter = 0;
    image_png png = {NULL, 0, 1, 0};
    int y, bad;
    png.file = fopen(path, "wb");
    if (!png.file) return 0;
    fwrite(signature, 1, 8, png.file);
    image_png_begin(&png, 13, "IHDR");
    image_png_u32(&png, (uint32_t)width);
    image_png_u32(&png, (uint32_t)height);
    head[1] = colour[channels];
    image_png_bytes(&png, head, 5);
    image_png_end(&png);
    blocks = (row + 1 + 65534) / 65535;
    image_png_begin(&png, 2 + (uint32_t)height * (row + 1 + 5 * blocks) + 4, "IDAT");
    image_png_bytes(&png, zlib, 2);
    for (y = 0; y < height; ++y) {
        for (at = 0; at < row + 1; at += part) {      /* the row with its filter byte, at most 65535 a block */
            unsigned char block[5];
            part = row + 1 - at < 65535 ? row + 1 - at : 65535;
            block[0] = y == height - 1 && at + part == row + 1;
            block[1] = (unsigned char)part;
            block[2] = (unsigned char)(part >> 8);
            block[3] = (unsigned char)~part;
            block[4] = (unsigned char)(~part >> 8);
            image_png_bytes(&png, block, 5);
            if (at == 0) image_png_data(&png, &filter, 1);
            image_png_data(&png, bytes + (size_t)y * row + (at ? at - 1 : 0), part - (at == 0));
        }
    }
    image_png_u32(&png, png.b << 16 | png.a);
    image_png_end(&png);
    image_png_begin(&png, 0, "IEND");
    image_png_end(&png);
    bad = ferror(png.file);
    return !(fclose(png.file) | bad);
}
#endif

/* 8-bit pixels as they are (sRGB), 1 to 4 channels. */
static inline int image_save_u8(const char *path, const unsigned char *bytes, int width, int height, int channels)
{
    return image_write_png(path, bytes, width, height, channels);
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
    ok = image_write_png(path, bytes, picture->width, picture->height, picture->channels);
    free(bytes);
    if (!ok) snprintf(picture->message, sizeof picture->message, "%.250s: cannot be written", path);
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
    FILE *file;
    memset(out, 0, sizeof *out);
    file = fopen(path, "rb");
    if (!file) return image_fail(out, path, "cannot be opened");
    fclose(file);
    if (image_ends_with(path, ".exr")) return image_load_exr(out, path);
    if (image_ends_with(path, ".pfm")) return image_load_pfm(out, path);
    if (image_ends_with(path, ".hdr") || image_ends_with(path, ".png") || image_ends_with(path, ".jpg") ||
        image_ends_with(path, ".jpeg")) return image_load_stb(out, path);
    return image_fail(out, path, "is none of .exr .hdr .pfm .png .jpg");
}

/* .exr and .pfm keep every float (image_save_exr can halve them), .png clamps to [0, 1]. */
static inline int image_save(image *picture, const char *path)
{
    if (image_ends_with(path, ".exr")) return image_save_exr(picture, path, 0);
    if (image_ends_with(path, ".pfm")) return image_save_pfm(picture, path);
    if (image_ends_with(path, ".png")) return image_save_png(picture, path);
    snprintf(picture->message, sizeof picture->message, "%.250s: is none of .exr .pfm .png", path);
    return 0;
}

#endif /* IMAGE_H */
