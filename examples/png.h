/* png.h - PNG files without any library: 8 bits, not compressed.      SPDX-License-Identifier: MIT-0 OR Unlicense

       png_save("out.png", rgb, width, height, 3);       1, or 0 when it could not be written */

#ifndef PNG_H
#define PNG_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static inline unsigned char *png_u32(unsigned char *at, uint32_t v)
{
    int i;
    for (i = 0; i < 4; ++i) *at++ = (unsigned char)(v >> (24 - 8 * i));
    return at;
}

/* Puts length, name and checksum around what stands at `at` + 8. Returns where the next chunk begins. */
static inline unsigned char *png_chunk(unsigned char *at, const char *name, size_t size)
{
    uint32_t crc = UINT32_C(0xffffffff);
    size_t i;
    int k;
    memcpy(png_u32(at, (uint32_t)size), name, 4);
    for (i = 0; i < size + 4; ++i) {
        crc ^= at[4 + i];
        for (k = 0; k < 8; ++k) crc = crc & 1 ? crc >> 1 ^ UINT32_C(0xedb88320) : crc >> 1;
    }
    return png_u32(at + 8 + size, ~crc);
}

/* The whole file, to be freed; NULL without memory. 1 to 4 channels. PNG 1.2 with its deflate stream in stored blocks,
   one or more a row (RFC 1950 and 1951). */
static inline unsigned char *png_encode(size_t *size, const unsigned char *bytes, int width, int height, int channels)
{
    static const unsigned char start[8] = {137, 'P', 'N', 'G', 13, 10, 26, 10}, colour[5] = {0, 0, 4, 2, 6};
    size_t row = (size_t)width * (size_t)channels, blocks = (row + 65535) / 65535, at, part, i, y;
    unsigned char *png = (unsigned char *)malloc(8 + 25 + 12 + 2 + (size_t)height * (row + 1 + 5 * blocks) + 4 + 12),
                  *p = png, *data;
    uint32_t a = 1, b = 0;
    if (!png) return NULL;
    memcpy(p, start, 8);
    p = png_u32(png_u32(p + 16, (uint32_t)width), (uint32_t)height);
    memset(p, 0, 5);
    p[0] = 8, p[1] = colour[channels];
    data = png_chunk(png + 8, "IHDR", 13);
    p = data + 8;
    *p++ = 0x78, *p++ = 1;
    for (y = 0; y < (size_t)height; ++y)
        for (at = 0; at < row + 1; at += part) { /* the row behind its filter byte, at most 65535 a block */
            part = row + 1 - at < 65535 ? row + 1 - at : 65535;
            *p++ = y == (size_t)height - 1 && at + part == row + 1;
            *p++ = (unsigned char)part, *p++ = (unsigned char)(part >> 8);
            *p++ = (unsigned char)~part, *p++ = (unsigned char)(~part >> 8);
            if (at == 0) *p = 0;
            memcpy(p + (at == 0), bytes + y * row + (at ? at - 1 : 0), part - (at == 0));
            for (i = 0; i < part; ++i) a = (a + *p++) % 65521, b = (b + a) % 65521;
        }
    p = png_u32(p, b << 16 | a);
    p = png_chunk(png_chunk(data, "IDAT", (size_t)(p - data) - 8), "IEND", 0);
    *size = (size_t)(p - png);
    return png;
}

static inline int png_save(const char *path, const unsigned char *bytes, int width, int height, int channels)
{
    size_t size = 0, written;
    unsigned char *png = png_encode(&size, bytes, width, height, channels);
    FILE *file = png ? fopen(path, "wb") : NULL;
    if (!file) return free(png), 0;
    written = fwrite(png, 1, size, file);
    free(png);
    return fclose(file) == 0 && written == size;
}

#endif /* PNG_H */
