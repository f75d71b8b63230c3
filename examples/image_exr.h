/* image_exr.h - OpenEXR files through OpenEXR's C library; part of image.h.
   SPDX-License-Identifier: MIT-0 OR Unlicense */

#include <openexr.h>

enum { IMAGE_EXR_CHANNELS = 3 };

typedef struct image_exr {
    exr_context_t file;
    exr_attr_box2i_t window;
    int width, height;
    const char *names[IMAGE_EXR_CHANNELS];           /* R G B, or Y RY BY, or one channel and NULL */
    int chroma;                                      /* the names are Y RY BY */
    unsigned char *planes[IMAGE_EXR_CHANNELS];       /* samples as they are stored */
    int types[IMAGE_EXR_CHANNELS], x_step[IMAGE_EXR_CHANNELS], y_step[IMAGE_EXR_CHANNELS];
    int plane_width[IMAGE_EXR_CHANNELS], plane_height[IMAGE_EXR_CHANNELS];
} image_exr;

/* What the library says goes into the message of the image. */
static void image_exr_error(exr_const_context_t file, exr_result_t code, const char *text)
{
    void *user = NULL;
    (void)code;
    if (file && exr_get_user_data(file, &user) == EXR_ERR_SUCCESS && user) snprintf((char *)user, 128, "%s", text);
}

static inline void image_exr_initializer(exr_context_initializer_t *options, char *text)
{
    memset(options, 0, sizeof *options);
    options->size = sizeof *options;
    options->error_handler_fn = image_exr_error;
    options->user_data = text;
    options->zip_level = -2;
    options->dwa_quality = -1.0f;
}

/* ---- which channels make the picture ---- */

static inline int image_exr_find(const exr_attr_chlist_t *list, const char *name)
{
    int i;
    for (i = 0; i < list->num_channels; ++i)
        if (strcmp(list->entries[i].name.str, name) == 0) return i;
    return -1;
}

static inline const char *image_exr_choose(image_exr *exr)
{
    static const char *const sets[2][3] = {{"R", "G", "B"}, {"Y", "RY", "BY"}};
    const exr_attr_chlist_t *list = NULL;
    int i, set;
    if (exr_get_channels(exr->file, 0, &list) != EXR_ERR_SUCCESS || list->num_channels < 1) return "has no channels";
    for (set = 0; set < 2 && !exr->names[0]; ++set) {
        int found = 1;
        for (i = 0; i < 3; ++i) found &= image_exr_find(list, sets[set][i]) >= 0;
        for (i = 0; i < 3 && found; ++i) exr->names[i] = sets[set][i];
        exr->chroma = found && set == 1;
    }
    if (!exr->names[0]) {       /* grey: Y, else the first one */
        i = image_exr_find(list, "Y");
        exr->names[0] = list->entries[i < 0 ? 0 : i].name.str;
    }
    for (i = 0; i < 3 && exr->names[i]; ++i) {
        const exr_attr_chlist_entry_t *entry = &list->entries[image_exr_find(list, exr->names[i])];
        size_t bytes = entry->pixel_type == EXR_PIXEL_HALF ? 2 : 4;
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
    rc = exr_decoding_initialize(exr->file, 0, chunk, &decode);
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
            channel->decode_to_ptr = exr->planes[i] + (py * (size_t)exr->plane_width[i] + px) * (size_t)channel->bytes_per_element;
        }
    }
    rc = exr_decoding_choose_default_routines(exr->file, 0, &decode);
    if (rc == EXR_ERR_SUCCESS) rc = exr_decoding_run(exr->file, 0, &decode);
    exr_decoding_destroy(exr->file, &decode);
    return rc;
}

static inline exr_result_t image_exr_lines(image_exr *exr)
{
    int step = 0, y;
    exr_result_t rc = exr_get_scanlines_per_chunk(exr->file, 0, &step);
    for (y = 0; rc == EXR_ERR_SUCCESS && y < exr->height; y += step) {
        exr_chunk_info_t chunk;
        rc = exr_read_scanline_chunk_info(exr->file, 0, y + exr->window.min.y, &chunk);
        if (rc == EXR_ERR_SUCCESS) rc = image_exr_chunk(exr, &chunk, 0, y);
    }
    return rc;
}

static inline exr_result_t image_exr_tiles(image_exr *exr)
{
    int width = 0, height = 0, x, y;
    exr_result_t rc = exr_get_tile_sizes(exr->file, 0, 0, 0, &width, &height);
    for (y = 0; rc == EXR_ERR_SUCCESS && y < exr->height; y += height)
        for (x = 0; rc == EXR_ERR_SUCCESS && x < exr->width; x += width) {
            exr_chunk_info_t chunk;
            rc = exr_read_tile_chunk_info(exr->file, 0, x / width, y / height, 0, 0, &chunk);
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
    static const image_matrix cones = {{{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
    image_matrix scaled = cones, inverse = image_invert(&cones);
    int i, j;
    for (i = 0; i < 3; ++i) {
        double a = cones.m[i][0] * from[0] / from[1] + cones.m[i][1] + cones.m[i][2] * (1 - from[0] - from[1]) / from[1];
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
    if (exr_get_attribute_by_name(exr->file, 0, "chromaticities", &attribute) != EXR_ERR_SUCCESS || !attribute ||
        attribute->type != EXR_ATTR_CHROMATICITIES) return 0;
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
    image_matrix to_xyz = image_rgb_to_xyz(xy), from_xyz = image_rgb_to_xyz(rec709), adapt = image_adapt(xy[3], rec709[3]), m;
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
                pixel[c] = convert && exr->names[1] ? (float)(m.m[c][0] * (double)v[0] + m.m[c][1] * (double)v[1] + m.m[c][2] * (double)v[2]) : v[c];
        }
}

/* ---- reading ---- */

static inline const char *image_exr_read(image_exr *exr, image *out)
{
    exr_storage_t storage = EXR_STORAGE_SCANLINE;
    exr_compression_t compression = EXR_COMPRESSION_NONE;
    const char *why;
    exr_result_t rc;
    exr_get_storage(exr->file, 0, &storage);
    exr_get_compression(exr->file, 0, &compression);
    if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED) return "holds deep pixels, which are not supported";
    if (compression == EXR_COMPRESSION_DWAA || compression == EXR_COMPRESSION_DWAB)
        return compression == EXR_COMPRESSION_DWAA ? "is DWAA-compressed, which OpenEXR's C library cannot decode; try exrmaketiled -z piz (Debian's openexr)"
                                                   : "is DWAB-compressed, which OpenEXR's C library cannot decode; try exrmaketiled -z piz (Debian's openexr)";
    if (exr_get_data_window(exr->file, 0, &exr->window) != EXR_ERR_SUCCESS) return "has no data window";
    exr->width = exr->window.max.x - exr->window.min.x + 1;
    exr->height = exr->window.max.y - exr->window.min.y + 1;
    if (!image_create(out, exr->width, exr->height, 3)) return "is too large or empty";
    why = image_exr_choose(exr);
    if (why) return why;
    rc = storage == EXR_STORAGE_TILED ? image_exr_tiles(exr) : image_exr_lines(exr);
    if (rc != EXR_ERR_SUCCESS) return exr_get_default_error_message(rc);
    image_exr_pixels(exr, out);
    return NULL;
}

static inline int image_load_exr(image *out, const char *path)
{
    char text[128] = "";
    image_exr exr;
    exr_context_initializer_t options;
    const char *why = "is not an OpenEXR file";
    int c;
    memset(&exr, 0, sizeof exr);
    memset(out, 0, sizeof *out);
    image_exr_initializer(&options, text);
    if (exr_start_read(&exr.file, path, &options) == EXR_ERR_SUCCESS) why = image_exr_read(&exr, out);
    if (why) image_fail(out, path, why);
    for (c = 0; c < 3; ++c) free(exr.planes[c]);
    exr_finish(&exr.file);
    return why == NULL;
}

/* ---- writing ---- */

static inline exr_result_t image_exr_write_chunk(exr_context_t file, const image *picture, const unsigned char *samples, int bytes, int y)
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
        channel->encode_from_ptr = samples + ((size_t)y * (size_t)picture->width * (size_t)picture->channels + (size_t)i) * (size_t)bytes;
    }
    rc = exr_encoding_choose_default_routines(file, 0, &encode);
    if (rc == EXR_ERR_SUCCESS) rc = exr_encoding_run(file, 0, &encode);
    exr_encoding_destroy(file, &encode);
    return rc;
}

static inline exr_result_t image_exr_write(exr_context_t file, const image *picture, const unsigned char *samples, int half)
{
    static const char *const names[] = {"R", "G", "B", "A"};
    int part = 0, c, y, step = 0;
    exr_result_t rc = exr_add_part(file, "picture", EXR_STORAGE_SCANLINE, &part);
    if (rc == EXR_ERR_SUCCESS)
        rc = exr_initialize_required_attr_simple(file, part, picture->width, picture->height, EXR_COMPRESSION_ZIP);
    for (c = 0; c < picture->channels && rc == EXR_ERR_SUCCESS; ++c)
        rc = exr_add_channel(file, part, picture->channels < 3 ? (c ? "A" : "Y") : names[c], half ? EXR_PIXEL_HALF : EXR_PIXEL_FLOAT,
                             EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1);
    if (rc == EXR_ERR_SUCCESS) rc = exr_write_header(file);
    if (rc == EXR_ERR_SUCCESS) rc = exr_get_scanlines_per_chunk(file, part, &step);
    for (y = 0; y < picture->height && rc == EXR_ERR_SUCCESS; y += step)
        rc = image_exr_write_chunk(file, picture, samples, half ? 2 : 4, y);
    return rc;
}

/* Scan lines, ZIP; R G B (A), or Y for one channel; half rounds to 16 bits. */
static inline int image_save_exr(image *picture, const char *path, int half)
{
    char text[128] = "";
    exr_context_t file = NULL;
    exr_context_initializer_t options;
    exr_result_t rc;
    size_t i, n = (size_t)picture->width * (size_t)picture->height * (size_t)picture->channels;
    uint16_t *halves = half ? (uint16_t *)malloc(n * 2) : NULL;
    if (half && !halves) return snprintf(picture->message, sizeof picture->message, "no memory"), 0;
    for (i = 0; halves && i < n; ++i) halves[i] = sat__half_from_float(picture->pixels[i]);
    image_exr_initializer(&options, text);
    rc = exr_start_write(&file, path, EXR_WRITE_FILE_DIRECTLY, &options);
    if (rc == EXR_ERR_SUCCESS)
        rc = image_exr_write(file, picture, half ? (const unsigned char *)halves : (const unsigned char *)picture->pixels, half);
    if (file) exr_finish(&file);
    free(halves);
    if (rc != EXR_ERR_SUCCESS)
        snprintf(picture->message, sizeof picture->message, "%.180s: %.120s", path, text[0] ? text : exr_get_default_error_message(rc));
    return rc == EXR_ERR_SUCCESS;
}
