/* png_strips.h - PNG files of any size, a few rows at a time.         SPDX-License-Identifier: MIT-0 OR Unlicense

       png_strips png;
       if (!png_strips_begin(&png, &file, width, height, 3)) ...     no memory
       while (...) png_strips_rows(&png, bytes, rows);               packed, from top to bottom, `height` in all
       png_strips_end(&png);                                         file_close then says whether all was written

   8 bits, 1 to 4 channels. Rows are predicted by Paeth's filter and coded with a Huffman code of their own a strip
   (RFC 1951, dynamic blocks of literals): photographs take what other writers make of them, and memory is a few strips.
 */

#ifndef PNG_STRIPS_H
#define PNG_STRIPS_H

#include <limits.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "file.h"

enum { PNG_STRIPS_SYMBOLS = 257, PNG_STRIPS_LONGEST = 15 }; /* bytes and the end of a block; bits of a code */

typedef struct png_strips {
    file_writer *file;
    size_t row;            /* bytes */
    int channels, failed;  /* failed: no memory for a strip */
    unsigned char *before; /* the last row of the strip before */
    unsigned char *filtered, *coded;
    size_t room, used; /* of filtered; of coded */
    uint64_t bits;     /* of the stream, that are no whole byte yet */
    int bit_count;
    uint32_t a, b, crc[256]; /* checksums: Adler's, and the table of the other one */
} png_strips;

static inline void png_strips_chunk(png_strips *p, const char *name, const unsigned char *bytes, size_t size)
{
    unsigned char head[8], tail[4];
    uint32_t crc = UINT32_C(0xffffffff);
    size_t i;
    int k;
    for (k = 0; k < 4; ++k) head[k] = (unsigned char)((uint32_t)size >> (24 - 8 * k));
    memcpy(head + 4, name, 4);
    for (i = 4; i < 8; ++i) crc = p->crc[(crc ^ head[i]) & 255u] ^ crc >> 8;
    for (i = 0; i < size; ++i) crc = p->crc[(crc ^ bytes[i]) & 255u] ^ crc >> 8;
    for (k = 0; k < 4; ++k) tail[k] = (unsigned char)(~crc >> (24 - 8 * k));
    file_put(p->file, head, 8);
    file_put(p->file, bytes, size);
    file_put(p->file, tail, 4);
}

static inline void png_strips_bits(png_strips *p, uint32_t value, int count)
{
    p->bits |= (uint64_t)value << p->bit_count;
    for (p->bit_count += count; p->bit_count >= 8; p->bit_count -= 8, p->bits >>= 8)
        p->coded[p->used++] = (unsigned char)p->bits;
}

/* Lengths of a Huffman code for symbols that occur so often; those that do not occur have none. 0 when one is longer
   than deflate allows. */
static inline int png_strips_tree(const uint32_t *often, int *length)
{
    uint64_t weight[2 * PNG_STRIPS_SYMBOLS];
    int parent[2 * PNG_STRIPS_SYMBOLS], nodes = PNG_STRIPS_SYMBOLS, i, ok = 1;
    for (i = 0; i < PNG_STRIPS_SYMBOLS; ++i) weight[i] = often[i], parent[i] = 0;
    for (;; ++nodes) { /* the two rarest become one */
        int rare = -1, next = -1;
        for (i = 0; i < nodes; ++i) {
            if (parent[i] || weight[i] == 0) continue;
            if (rare < 0 || weight[i] < weight[rare]) next = rare, rare = i;
            else if (next < 0 || weight[i] < weight[next]) next = i;
        }
        if (next < 0) break;
        parent[rare] = parent[next] = nodes;
        parent[nodes] = 0;
        weight[nodes] = weight[rare] + weight[next];
    }
    for (i = 0; i < PNG_STRIPS_SYMBOLS; ++i) {
        int at;
        length[i] = 0;
        for (at = i; parent[at]; at = parent[at]) ++length[i];
        ok &= length[i] <= PNG_STRIPS_LONGEST;
    }
    return ok;
}

/* The codes that go with the lengths (RFC 1951, 3.2.2), first bit lowest. */
static inline void png_strips_codes(const int *length, uint32_t *code)
{
    uint32_t next = 0;
    int bits, i, k;
    for (bits = 1; bits <= PNG_STRIPS_LONGEST; ++bits, next <<= 1)
        for (i = 0; i < PNG_STRIPS_SYMBOLS; ++i) {
            if (length[i] != bits) continue;
            code[i] = 0;
            for (k = 0; k < bits; ++k) code[i] |= (next >> k & 1u) << (bits - 1 - k);
            ++next;
        }
}

/* One block: the lengths of the code in four bits each, the bytes, the end. */
static inline void png_strips_block(png_strips *p, const unsigned char *bytes, size_t count)
{
    static const unsigned char order[19] = {16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
    uint32_t often[PNG_STRIPS_SYMBOLS] = {0}, code[PNG_STRIPS_SYMBOLS] = {0};
    int length[PNG_STRIPS_SYMBOLS], i, k;
    size_t at;
    for (at = 0; at < count; ++at) ++often[bytes[at]];
    often[PNG_STRIPS_SYMBOLS - 1] = 1;
    while (!png_strips_tree(often, length))
        for (i = 0; i < PNG_STRIPS_SYMBOLS; ++i) often[i] = (often[i] + 1) / 2;
    png_strips_codes(length, code);
    png_strips_bits(p, 4, 3);      /* not the last, dynamic */
    png_strips_bits(p, 0, 5);      /* 257 literals */
    png_strips_bits(p, 0, 5);      /* one distance */
    png_strips_bits(p, 19 - 4, 4); /* lengths of 0 to 15 all have four bits */
    for (i = 0; i < 19; ++i) png_strips_bits(p, order[i] < 16 ? 4 : 0, 3);
    for (i = 0; i < PNG_STRIPS_SYMBOLS + 1; ++i) {
        uint32_t value = i < PNG_STRIPS_SYMBOLS ? (uint32_t)length[i] : 1, turned = 0;
        for (k = 0; k < 4; ++k) turned |= (value >> k & 1u) << (3 - k);
        png_strips_bits(p, turned, 4);
    }
    for (at = 0; at < count; ++at) png_strips_bits(p, code[bytes[at]], length[bytes[at]]);
    png_strips_bits(p, code[PNG_STRIPS_SYMBOLS - 1], length[PNG_STRIPS_SYMBOLS - 1]);
}

/* What lies nearest to left + above - left above (PNG 1.2, 6.6). */
static inline int png_strips_paeth(int left, int above, int corner)
{
    int x = abs(above - corner), y = abs(left - corner), z = abs(left + above - 2 * corner);
    return x <= y && x <= z ? left : y <= z ? above : corner;
}

static inline void png_strips_filter(png_strips *p, unsigned char *out, const unsigned char *row,
                                     const unsigned char *above)
{
    size_t i, n = (size_t)p->channels;
    *out++ = 4;
    for (i = 0; i < p->row; ++i)
        out[i] = (unsigned char)(row[i] - png_strips_paeth(i < n ? 0 : row[i - n], above[i], i < n ? 0 : above[i - n]));
}

/* 1, or 0 without memory; nothing is to be released then. */
static inline int png_strips_begin(png_strips *p, file_writer *file, int width, int height, int channels)
{
    static const unsigned char start[8] = {137, 'P', 'N', 'G', 13, 10, 26, 10}, colour[5] = {0, 0, 4, 2, 6};
    unsigned char head[13] = {0};
    uint32_t i;
    int k;
    memset(p, 0, sizeof *p);
    p->file = file;
    p->row = (size_t)width * (size_t)channels;
    p->channels = channels;
    p->a = 1;
    p->before = (unsigned char *)calloc(p->row, 1);
    if (!p->before) return 0;
    for (i = 0; i < 256; ++i) {
        p->crc[i] = i;
        for (k = 0; k < 8; ++k) p->crc[i] = (p->crc[i] & 1u ? UINT32_C(0xedb88320) : 0) ^ p->crc[i] >> 1;
    }
    for (k = 0; k < 4; ++k) {
        head[k] = (unsigned char)((uint32_t)width >> (24 - 8 * k));
        head[4 + k] = (unsigned char)((uint32_t)height >> (24 - 8 * k));
    }
    head[8] = 8, head[9] = colour[channels];
    file_put(file, start, 8);
    png_strips_chunk(p, "IHDR", head, 13);
    png_strips_chunk(p, "IDAT", (const unsigned char *)"\x78\x01", 2);
    return 1;
}

static inline void png_strips_rows(png_strips *p, const unsigned char *bytes, int rows)
{
    size_t count = (size_t)rows * (p->row + 1), i;
    int y;
    if (count > p->room) {
        free(p->filtered);
        free(p->coded);
        p->filtered = (unsigned char *)malloc(count);
        p->coded = (unsigned char *)malloc(2 * count + 512);
        p->room = p->filtered && p->coded ? count : 0;
        if (!p->room) p->failed = 1;
    }
    if (p->failed || rows < 1) return;
    for (y = 0; y < rows; ++y)
        png_strips_filter(p, p->filtered + (size_t)y * (p->row + 1), bytes + (size_t)y * p->row,
                          y ? bytes + (size_t)(y - 1) * p->row : p->before);
    memcpy(p->before, bytes + (size_t)(rows - 1) * p->row, p->row);
    for (i = 0; i < count; ++i) {
        p->a += p->filtered[i];
        if (p->a >= 65521) p->a -= 65521;
        p->b += p->a;
        if (p->b >= 65521) p->b -= 65521;
    }
    p->used = 0;
    png_strips_block(p, p->filtered, count);
    png_strips_chunk(p, "IDAT", p->coded, p->used);
}

/* Ends the file's contents and releases the memory; a strip for which there was none makes the file fail. */
static inline void png_strips_end(png_strips *p)
{
    unsigned char last[16];
    int k;
    free(p->coded);
    p->coded = last;
    p->used = 0;
    png_strips_bits(p, 3, 3); /* the last block, of fixed codes, */
    png_strips_bits(p, 0, 7); /* is empty */
    png_strips_bits(p, 0, (8 - p->bit_count) % 8);
    for (k = 0; k < 4; ++k) last[p->used++] = (unsigned char)((p->b << 16 | p->a) >> (24 - 8 * k));
    png_strips_chunk(p, "IDAT", last, p->used);
    png_strips_chunk(p, "IEND", last, 0);
    if (p->failed && !p->file->error) p->file->error = ENOMEM;
    free(p->filtered);
    free(p->before);
}

#endif /* PNG_STRIPS_H */
