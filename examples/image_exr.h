/* image_exr.h - OpenEXR files through OpenEXR's C library; part of image.h.
   SPDX-License-Identifier: MIT-0 OR Unlicense */

#include <openexr.h>

enum { IMAGE_EXR_CHANNELS = 3 };

typedef struct image_exr {
    exr_context_t file;
    exr_attr_box2i_t window;
    int part, width, height;
    const char *names[IMAGE_EXR_CHANNELS];           /* R G B, or Y RY BY, or one channel and NULL */
    int chroma;                                      /* the names are Y RY BY */
    unsigned char *planes[IMAGE_EXR_CHANNELS];       /* samples as they are stored */
    int types[IMAGE_EXR_CHANNELS], x_step[IMAGE_EXR_CHANNELS], y_step[IMAGE_EXR_CHANNELS];
    int plane_width[IMAGE_EXR_CHANNELS], plane_height[IMAGE_EXR_CHANNELS];
    char text[130];                                  /* a sentence of its own */
} image_exr;

/* The library calls this with its lock held, so that nothing can be asked of it here: the codes of the calls tell
   enough. */
static inline void image_exr_error(exr_const_context_t file, exr_result_t code, const char *text)
{
    (void)file, (void)code, (void)text;
}

static inline void image_exr_initializer(exr_context_initializer_t *options)
{
    memset(options, 0, sizeof *options);
    options->size = sizeof *options;
    options->error_handler_fn = image_exr_error;
    options->zip_level = -2;
    options->dwa_quality = -1.0f;
}

/* ---- which channels make the picture ---- */

/* The name of the channel that is prefix and name, or NULL. */
static inline const char *image_exr_find(const exr_attr_chlist_t *list, const char *prefix, int prefix_length,
                                         const char *name)
{
    int i;
    for (i = 0; i < list->num_channels; ++i) {
        const char *have = list->entries[i].name.str;
        if (strncmp(have, prefix, (size_t)prefix_length) == 0 && strcmp(have + prefix_length, name) == 0) return have;
    }
    return NULL;
}

/* R G B or Y RY BY under this prefix: 1 when all three are there. */
static inline int image_exr_three(image_exr *exr, const exr_attr_chlist_t *list, const char *prefix, int prefix_length)
{
    static const char *const sets[2][3] = {{"R", "G", "B"}, {"Y", "RY", "BY"}};
    int set, i, found;
    for (set = 0; set < 2; ++set) {
        for (i = 0, found = 1; i < 3; ++i) {
            exr->names[i] = image_exr_find(list, prefix, prefix_length, sets[set][i]);
            found &= exr->names[i] != NULL;
        }
        exr->chroma = set == 1;
        if (found) return 1;
    }
    exr->names[0] = exr->names[1] = exr->names[2] = NULL;
    exr->chroma = 0;
    return 0;
}

/* The picture without a layer; else a layer whose name says that it is the picture; else the first layer with colours;
   else the one channel beside alpha as grey. 0: nothing of that. */
static inline int image_exr_names(image_exr *exr, const exr_attr_chlist_t *list)
{
    int i, pass, others = 0;
    if (image_exr_three(exr, list, "", 0)) return 1;
    for (pass = 0; pass < 2; ++pass) /* Blender writes "ViewLayer.Combined.R" */
        for (i = 0; i < list->num_channels; ++i) {
            const char *name = list->entries[i].name.str, *dot = strrchr(name, '.');
            if (dot && (pass || strstr(name, "Combined.") || strstr(name, "beauty.") || strstr(name, "rgba.")) &&
                image_exr_three(exr, list, name, (int)(dot + 1 - name))) return 1;
        }
    exr->names[0] = image_exr_find(list, "", 0, "Y");
    for (i = 0; !exr->names[0] && i < list->num_channels; ++i) {
        const char *name = list->entries[i].name.str, *dot = strrchr(name, '.');
        if (strcmp(dot ? dot + 1 : name, "A") == 0 && list->num_channels > 1) continue;
        if (others++ == 0) exr->names[1] = name;
    }
    if (others == 1) exr->names[0] = exr->names[1];
    exr->names[1] = NULL;
    return exr->names[0] != NULL;
}

/* The names of the channels for a sentence. */
static inline const char *image_exr_list(char *text, size_t size, const exr_attr_chlist_t *list)
{
    size_t used = (size_t)snprintf(text, size, "has neither R, G and B nor a single channel, but");
    int i;
    for (i = 0; i < list->num_channels && used < size; ++i)
        used += (size_t)snprintf(text + used, size - used, " %s", list->entries[i].name.str);
    return text;
}

/* The first part that holds a picture, its channels and memory for them. NULL, or what is wrong. */
static inline const char *image_exr_choose(image_exr *exr)
{
    const exr_attr_chlist_t *list = NULL, *first = NULL;
    int parts = 0, i, k;
    exr_get_count(exr->file, &parts);
    for (exr->part = 0; exr->part < parts && !exr->names[0]; ++exr->part) {
        if (exr_get_channels(exr->file, exr->part, &list) != EXR_ERR_SUCCESS || list->num_channels < 1) continue;
        if (!first) first = list;
        if (image_exr_names(exr, list)) break;
    }
    if (!first) return "has no channels";
    if (!exr->names[0]) return image_exr_list(exr->text, sizeof exr->text, first);
    if (exr_get_data_window(exr->file, exr->part, &exr->window) != EXR_ERR_SUCCESS) return "has no data window";
    exr->width = exr->window.max.x - exr->window.min.x + 1;
    exr->height = exr->window.max.y - exr->window.min.y + 1;
    if (exr->width < 1 || exr->height < 1 || exr->width > IMAGE_MAX_SIDE || exr->height > IMAGE_MAX_SIDE)
        return "is too large or empty";
    for (i = 0; i < 3 && exr->names[i]; ++i) {
        const exr_attr_chlist_entry_t *entry = list->entries;
        size_t bytes;
        for (k = 0; k < list->num_channels; ++k)
            if (list->entries[k].name.str == exr->names[i]) entry = &list->entries[k];
        bytes = entry->pixel_type == EXR_PIXEL_HALF ? 2 : 4;
        exr->types[i] = (int)entry->pixel_type;
        exr->x_step[i] = entry->x_sampling;
        exr->y_step[i] = entry->y_sampling;
        if (entry->x_sampling < 1 || entry->y_sampling < 1) return "has a channel of no size";
        exr->plane_width[i] = (exr->width + entry->x_sampling - 1) / entry->x_sampling;
        exr->plane_height[i] = (exr->height + entry->y_sampling - 1) / entry->y_sampling;
        exr->planes[i] = (unsigned char *)calloc((size_t)exr->plane_width[i] * (size_t)exr->plane_height[i], bytes);
        if (!exr->planes[i]) return "is too large for the memory";
    }
    return NULL;
}

/* ---- chunks ----
   Samples are asked for in their stored type: the library's conversion to float fills only half of each row when
   channels are subsampled (3.1.5). */

static inline exr_result_t image_exr_chunk(image_exr *exr, const exr_chunk_info_t *chunk, int x, int y)
{
    exr_decode_pipeline_t decode;
    exr_result_t rc;
    int c, i;
    memset(&decode, 0, sizeof decode);
    rc = exr_decoding_initialize(exr->file, exr->part, chunk, &decode);
    if (rc != EXR_ERR_SUCCESS) return rc;
    for (c = 0; c < decode.channel_count; ++c) {
        exr_coding_channel_info_t *channel = &decode.channels[c];
        channel->decode_to_ptr = NULL;
        for (i = 0; i < 3 && exr->names[i]; ++i) {
            size_t px, py;
            if (strcmp(channel->channel_name, exr->names[i]) != 0) continue;
            px = (size_t)(x / exr->x_step[i]);
            py = (size_t)((y + exr->y_step[i] - 1) / exr->y_step[i]);
            channel->user_bytes_per_element = channel->bytes_per_element;
            channel->user_data_type = channel->data_type;
            channel->user_pixel_stride = channel->bytes_per_element;
            channel->user_line_stride = channel->bytes_per_element * exr->plane_width[i];
            channel->decode_to_ptr =
                exr->planes[i] + (py * (size_t)exr->plane_width[i] + px) * (size_t)channel->bytes_per_element;
        }
    }
    rc = exr_decoding_choose_default_routines(exr->file, exr->part, &decode);
    if (rc == EXR_ERR_SUCCESS) rc = exr_decoding_run(exr->file, exr->part, &decode);
    exr_decoding_destroy(exr->file, &decode);
    return rc;
}

static inline exr_result_t image_exr_lines(image_exr *exr)
{
    int step = 0, y;
    exr_result_t rc = exr_get_scanlines_per_chunk(exr->file, exr->part, &step);
    for (y = 0; rc == EXR_ERR_SUCCESS && y < exr->height; y += step) {
        exr_chunk_info_t chunk;
        rc = exr_read_scanline_chunk_info(exr->file, exr->part, y + exr->window.min.y, &chunk);
        if (rc == EXR_ERR_SUCCESS) rc = image_exr_chunk(exr, &chunk, 0, y);
    }
    return rc;
}

static inline exr_result_t image_exr_tiles(image_exr *exr)
{
    int width = 0, height = 0, x, y;
    exr_result_t rc = exr_get_tile_sizes(exr->file, exr->part, 0, 0, &width, &height);
    for (y = 0; rc == EXR_ERR_SUCCESS && y < exr->height; y += height)
        for (x = 0; rc == EXR_ERR_SUCCESS && x < exr->width; x += width) {
            exr_chunk_info_t chunk;
            rc = exr_read_tile_chunk_info(exr->file, exr->part, x / width, y / height, 0, 0, &chunk);
            if (rc == EXR_ERR_SUCCESS) rc = image_exr_chunk(exr, &chunk, x, y);
        }
    return rc;
}

/* ---- colour ---- */

typedef struct image_matrix { double m[3][3]; } image_matrix;

static inline image_matrix image_multiply(const image_matrix *a, const image_matrix *b)
{
    image_matrix r;
    int i, j;
    for (i = 0; i < 3; ++i)
        for (j = 0; j < 3; ++j) r.m[i][j] = a->m[i][0] * b->m[0][j] + a->m[i][1] * b->m[1][j] + a->m[i][2] * b->m[2][j];
    return r;
}

/* By cofactors; a determinant of 0 gives the identity (primaries on one line are not to be trusted). */
static inline image_matrix image_invert(const image_matrix *a)
{
    image_matrix r;
    double det;
    int i, j;
    for (i = 0; i < 3; ++i)
        for (j = 0; j < 3; ++j)
            r.m[j][i] = a->m[(i + 1) % 3][(j + 1) % 3] * a->m[(i + 2) % 3][(j + 2) % 3] -
                        a->m[(i + 1) % 3][(j + 2) % 3] * a->m[(i + 2) % 3][(j + 1) % 3];
    det = a->m[0][0] * r.m[0][0] + a->m[0][1] * r.m[1][0] + a->m[0][2] * r.m[2][0];
    for (i = 0; i < 3; ++i)
        for (j = 0; j < 3; ++j) r.m[i][j] = det != 0.0 ? r.m[i][j] / det : (i == j ? 1.0 : 0.0);
    return r;
}

/* RGB to XYZ of these primaries, white at Y = 1 (SMPTE RP 177). xy: red, green, blue, white. */
static inline image_matrix image_rgb_to_xyz(double xy[4][2])
{
    image_matrix p, q;
    double white[3];
    int i, j;
    for (j = 0; j < 3; ++j) {
        p.m[0][j] = xy[j][0];
        p.m[1][j] = xy[j][1];
        p.m[2][j] = 1.0 - xy[j][0] - xy[j][1];
    }
    white[0] = xy[3][0] / xy[3][1];
    white[1] = 1.0;
    white[2] = (1.0 - xy[3][0] - xy[3][1]) / xy[3][1];
    q = image_invert(&p);
    for (j = 0; j < 3; ++j) {
        double scale = q.m[j][0] * white[0] + q.m[j][1] * white[1] + q.m[j][2] * white[2];
        for (i = 0; i < 3; ++i) p.m[i][j] *= scale;
    }
    return p;
}

/* XYZ under one white to XYZ under another: scaling in the Bradford cone space (Lam 1985). */
static inline image_matrix image_adapt(const double from[2], const double to[2])
{
    static const image_matrix cones = {
        {{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
    image_matrix scaled = cones, inverse = image_invert(&cones);
    int i, j;
    for (i = 0; i < 3; ++i) {
        double a =
            cones.m[i][0] * from[0] / from[1] + cones.m[i][1] + cones.m[i][2] * (1 - from[0] - from[1]) / from[1];
        double b = cones.m[i][0] * to[0] / to[1] + cones.m[i][1] + cones.m[i][2] * (1 - to[0] - to[1]) / to[1];
        for (j = 0; j < 3; ++j) scaled.m[i][j] *= b / a;
    }
    return image_multiply(&inverse, &scaled);
}

/* The file's primaries: its attribute, else Rec. 709. 1 when they differ from Rec. 709. */
static inline int image_exr_primaries(const image_exr *exr, double xy[4][2], double rec709[4][2])
{
    const exr_attribute_t *attribute = NULL;
    int i, differs = 0;
    memcpy(xy, rec709, 8 * sizeof(double));
    if (exr_get_attribute_by_name(exr->file, exr->part, "chromaticities", &attribute) != EXR_ERR_SUCCESS ||
        !attribute || attribute->type != EXR_ATTR_CHROMATICITIES)
        return 0;
    xy[0][0] = (double)attribute->chromaticities->red_x;
    xy[0][1] = (double)attribute->chromaticities->red_y;
    xy[1][0] = (double)attribute->chromaticities->green_x;
    xy[1][1] = (double)attribute->chromaticities->green_y;
    xy[2][0] = (double)attribute->chromaticities->blue_x;
    xy[2][1] = (double)attribute->chromaticities->blue_y;
    xy[3][0] = (double)attribute->chromaticities->white_x;
    xy[3][1] = (double)attribute->chromaticities->white_y;
    for (i = 0; i < 4; ++i) differs |= fabs(xy[i][0] - rec709[i][0]) > 1e-3 || fabs(xy[i][1] - rec709[i][1]) > 1e-3;
    return differs && xy[3][1] > 0.0;
}

static inline float image_exr_sample(const image_exr *exr, int c, int px, int py)
{
    size_t at = (size_t)py * (size_t)exr->plane_width[c] + (size_t)px;
    const unsigned char *plane = exr->planes[c];
    uint16_t half;
    uint32_t word;
    float value;
    if (exr->types[c] == EXR_PIXEL_HALF) {
        memcpy(&half, plane + 2 * at, 2);
        return sat__half_to_float(half);
    }
    if (exr->types[c] == EXR_PIXEL_UINT) {
        memcpy(&word, plane + 4 * at, 4);
        return (float)word;
    }
    memcpy(&value, plane + 4 * at, 4);
    return value;
}

/* A channel at a pixel; bilinear between the samples of a subsampled one, which lie at multiples of its step. */
static inline float image_exr_at(const image_exr *exr, int c, int x, int y)
{
    int sx = exr->x_step[c], sy = exr->y_step[c], x0 = x / sx, y0 = y / sy;
    int x1 = x0 + 1 < exr->plane_width[c] ? x0 + 1 : x0, y1 = y0 + 1 < exr->plane_height[c] ? y0 + 1 : y0;
    float fx = (float)(x % sx) / (float)sx, fy = (float)(y % sy) / (float)sy, top, bottom;
    if (sx == 1 && sy == 1) return image_exr_sample(exr, c, x, y);
    top = (1 - fx) * image_exr_sample(exr, c, x0, y0) + fx * image_exr_sample(exr, c, x1, y0);
    bottom = (1 - fx) * image_exr_sample(exr, c, x0, y1) + fx * image_exr_sample(exr, c, x1, y1);
    return (1 - fy) * top + fy * bottom;
}

static inline void image_exr_pixels(const image_exr *exr, image *out)
{
    double rec709[4][2] = {{0.64, 0.33}, {0.30, 0.60}, {0.15, 0.06}, {0.3127, 0.3290}}, xy[4][2];
    int x, y, c, convert = image_exr_primaries(exr, xy, rec709);
    image_matrix to_xyz = image_rgb_to_xyz(xy), from_xyz = image_rgb_to_xyz(rec709),
                 adapt = image_adapt(xy[3], rec709[3]), m;
    from_xyz = image_invert(&from_xyz);
    m = image_multiply(&adapt, &to_xyz);
    m = image_multiply(&from_xyz, &m);
    for (y = 0; y < exr->height; ++y)
        for (x = 0; x < exr->width; ++x) {
            float v[3], *pixel = out->pixels + ((size_t)y * (size_t)exr->width + (size_t)x) * 3;
            for (c = 0; c < 3; ++c) v[c] = exr->names[c] ? image_exr_at(exr, c, x, y) : v[0];
            if (exr->chroma) {      /* RY = (R - Y) / Y, BY = (B - Y) / Y, Y by the weights of the file's primaries */
                float luminance = v[0], red = (v[1] + 1) * luminance, blue = (v[2] + 1) * luminance;
                v[0] = red;
                v[1] = (luminance - (float)to_xyz.m[1][0] * red - (float)to_xyz.m[1][2] * blue) / (float)to_xyz.m[1][1];
                v[2] = blue;
            }
            for (c = 0; c < 3; ++c)
                pixel[c] = convert && exr->names[1]
                               ? (float)(m.m[c][0] * (double)v[0] + m.m[c][1] * (double)v[1] + m.m[c][2] * (double)v[2])
                               : v[c];
        }
}

/* ---- reading ---- */

static inline const char *image_exr_read(image_exr *exr, image *out)
{
    exr_storage_t storage = EXR_STORAGE_SCANLINE;
    exr_compression_t compression = EXR_COMPRESSION_NONE;
    const char *why;
    exr_result_t rc;
    why = image_exr_choose(exr);
    if (why) return why;
    exr_get_storage(exr->file, exr->part, &storage);
    exr_get_compression(exr->file, exr->part, &compression);
    if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED)
        return "holds deep pixels, which are not supported";
    if (compression == EXR_COMPRESSION_DWAA || compression == EXR_COMPRESSION_DWAB)
        return compression == EXR_COMPRESSION_DWAA ? "is DWAA-compressed, which OpenEXR's C library cannot decode; try exrmaketiled -z piz (Debian's openexr)"
                                                   : "is DWAB-compressed, which OpenEXR's C library cannot decode; try exrmaketiled -z piz (Debian's openexr)";
    if (!image_create(out, exr->width, exr->height, 3)) return "is too large for the memory";
    rc = storage == EXR_STORAGE_TILED ? image_exr_tiles(exr) : image_exr_lines(exr);
    if (rc != EXR_ERR_SUCCESS) return exr_get_default_error_message(rc);
    image_exr_pixels(exr, out);
    return NULL;
}

static inline int image_load_exr(image *out, const char *path)
{
    image_exr exr;
    exr_context_initializer_t options;
    const char *why = "is not an OpenEXR file";
    int c;
    memset(&exr, 0, sizeof exr);
    memset(out, 0, sizeof *out);
    image_exr_initializer(&options);
    if (exr_start_read(&exr.file, path, &options) == EXR_ERR_SUCCESS) why = image_exr_read(&exr, out);
    if (why) image_fail(out, path, why);
    for (c = 0; c < 3; ++c) free(exr.planes[c]);
    exr_finish(&exr.file);
    return why == NULL;
}

/* ---- writing ---- */

typedef struct image_exr_sink { file_writer *file; uint64_t at; } image_exr_sink;

static inline exr_result_t image_exr_write_chunk(exr_context_t file, const image *picture, const unsigned char *samples,
                                                 int bytes, int y)
{
    static const char names[] = "RGBA";
    exr_chunk_info_t chunk;
    exr_encode_pipeline_t encode;
    exr_result_t rc = exr_write_scanline_chunk_info(file, 0, y, &chunk);
    int c, i;
    if (rc != EXR_ERR_SUCCESS) return rc;
    memset(&encode, 0, sizeof encode);
    rc = exr_encoding_initialize(file, 0, &chunk, &encode);
    if (rc != EXR_ERR_SUCCESS) return rc;
    for (c = 0; c < encode.channel_count; ++c) {
        exr_coding_channel_info_t *channel = &encode.channels[c];
        const char *place = strchr(names, channel->channel_name[0]);
        i = place && picture->channels > 1 ? (int)(place - names) : 0;
        channel->user_bytes_per_element = (int16_t)bytes;
        channel->user_data_type = channel->data_type;
        channel->user_pixel_stride = bytes * picture->channels;
        channel->user_line_stride = bytes * picture->channels * picture->width;
        channel->encode_from_ptr =
            samples + ((size_t)y * (size_t)picture->width * (size_t)picture->channels + (size_t)i) * (size_t)bytes;
    }
    rc = exr_encoding_choose_default_routines(file, 0, &encode);
    if (rc == EXR_ERR_SUCCESS) rc = exr_encoding_run(file, 0, &encode);
    exr_encoding_destroy(file, &encode);
    return rc;
}

static inline exr_result_t image_exr_write(exr_context_t file, const image *picture, const unsigned char *samples,
                                           int half)
{
    static const char *const names[] = {"R", "G", "B", "A"};
    int part = 0, c, y, step = 0;
    exr_result_t rc = exr_add_part(file, "picture", EXR_STORAGE_SCANLINE, &part);
    if (rc == EXR_ERR_SUCCESS)
        rc = exr_initialize_required_attr_simple(file, part, picture->width, picture->height, EXR_COMPRESSION_ZIP);
    for (c = 0; c < picture->channels && rc == EXR_ERR_SUCCESS; ++c)
        rc = exr_add_channel(file, part, picture->channels < 3 ? (c ? "A" : "Y") : names[c],
                             half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    if (rc == EXR_ERR_SUCCESS) rc = exr_write_header(file);
    if (rc == EXR_ERR_SUCCESS) rc = exr_get_scanlines_per_chunk(file, part, &step);
    for (y = 0; y < picture->height && rc == EXR_ERR_SUCCESS; y += step)
        rc = image_exr_write_chunk(file, picture, samples, half ? 2 : 4, y);
    return rc;
}

/* The library's bytes into the file, where it wants them. */
static inline int64_t image_exr_put(exr_const_context_t context, void *user, const void *bytes, uint64_t size,
                                    uint64_t at, exr_stream_error_func_ptr_t error)
{
    image_exr_sink *sink = (image_exr_sink *)user;
    (void)context, (void)error;
    if (at != sink->at) file_seek(sink->file, (long)at);
    file_put(sink->file, bytes, (size_t)size);
    sink->at = at + size;
    return sink->file->error ? -1 : (int64_t)size;
}

/* Scan lines, ZIP; R G B (A), or Y for one channel; half rounds to 16 bits. */
static inline int image_save_exr(image *picture, const char *path, int half)
{
    file_writer writer;
    image_exr_sink sink;
    exr_context_t file = NULL;
    exr_context_initializer_t options;
    exr_result_t rc;
    size_t i, n = (size_t)picture->width * (size_t)picture->height * (size_t)picture->channels;
    uint16_t *halves = half ? (uint16_t *)malloc(n * 2) : NULL;
    if (half && !halves) return file_fail(picture->message, path, "no memory");
    for (i = 0; halves && i < n; ++i) halves[i] = sat__half_from_float(picture->pixels[i]);
    if (!file_open(&writer, path, picture->message)) { free(halves); return 0; }
    sink.file = &writer, sink.at = 0;
    image_exr_initializer(&options);
    options.user_data = &sink;
    options.write_fn = image_exr_put;
    rc = exr_start_write(&file, path, EXR_WRITE_FILE_DIRECTLY, &options);
    if (rc == EXR_ERR_SUCCESS)
        rc = image_exr_write(file, picture,
                             half ? (const unsigned char *)halves : (const unsigned char *)picture->pixels, half);
    if (file) {
        exr_result_t end = exr_finish(&file);
        if (rc == EXR_ERR_SUCCESS) rc = end;
    }
    free(halves);
    if (rc != EXR_ERR_SUCCESS && !writer.error) {
        file_close(&writer, 0, NULL);
        return file_fail(picture->message, path, exr_get_default_error_message(rc));
    }
    return file_close(&writer, 1, picture->message);
}
