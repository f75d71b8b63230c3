/* photomosaic - a picture made of pictures, each used once.           SPDX-License-Identifier: MIT-0 OR Unlicense

       photomosaic target.jpg --tiles folder --cells 2000 --index tiles.index --out mosaic.png
       photomosaic target.jpg --tiles sheet_0.png,sheet_1.png --grid 30x30 --out mosaic.png
       photomosaic target.jpg --tiles folder --gap 0.001 --method fast --compare --out both.png
       photomosaic target.jpg --tiles folder --method ants --video frames      frames/0000.png, ...: order out of chaos
       photomosaic target.jpg --tiles folder --pan 24 --switching 0.05 --video frames      a film, frame by frame warm
       photomosaic                                                              target and tiles drawn here

   Several target pictures in a row need several calls. The last line is the proof: no other choice of tiles is
   nearer to the target by more than the gap.

   Pictures in a folder, and in its folders, are turned as the camera was held, cut to the shape of a cell, laid over
   --paper where they are transparent, and shrunk in linear light; what cannot be read is named and left out. Likeness
   is the distance of 4 x 4 means of linear light in CIELAB. Tiles stand in a file, by default one that goes with the
   program; --index keeps it, so that each picture is read once in its life, and a stopped run goes on. In memory are
   250 bytes a tile and its path. The mosaic is written as it is drawn, a strip at a time. docs/mosaic.md tells more. */

#define _POSIX_C_SOURCE   200809L
#define _FILE_OFFSET_BITS 64
#include <dirent.h>
#define SAT_IMPLEMENTATION
#define SOFTASSIGN_IMPLEMENTATION
#include "../softassign.h"
#include "common.h"
#include "png_strips.h"

enum { PARTS = 4, FEATURES = PARTS * PARTS * 3, MADE_TILES = 4096, DEPTH = 16 };
enum { STRIP_BYTES = 16 << 20, LIST_BYTES = 256000000 };
#define INDEX_NAME "photomosaic 1\n\0\0\1\2\3\4" /* the last bytes: what another order of bytes would change */

#ifdef _WIN32
#define seek_to(file, at) _fseeki64(file, at, SEEK_SET)
#else
#define seek_to(file, at) fseeko(file, (off_t)(at), SEEK_SET)
#endif

/* ---- pictures as their files hold them ---- */

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

/* ---- tiles: records in a file; colours of their parts, and where they stand, in memory ---- */

typedef struct record {           /* as in the file, followed by the features and the pixels */
    uint64_t name, size, changed; /* what tells whether the picture is still the same */
    uint64_t sum;                 /* of the rest */
} record;

typedef struct index_head {
    char name[24];
    int32_t width, height, paper, features;
} index_head;
typedef struct known_tile {
    record head;
    int64_t at;
} known_tile;

typedef struct tile_set {
    int width, height, paper;
    FILE *file;
    int64_t end;         /* of the whole records */
    unsigned char *data; /* one record behind its head: features, then pixels */
    float *features;     /* FEATURES a tile */
    int64_t *at;         /* a tile's record */
    int count, room;
    known_tile *known; /* of the index, sorted by name */
    int known_count, unread, reused;
    common_settings *common;
} tile_set;

static size_t pixel_bytes(const tile_set *t) { return (size_t)t->width * (size_t)t->height * 3; }
static size_t data_bytes(const tile_set *t) { return FEATURES * sizeof(float) + pixel_bytes(t); }

static uint64_t hash_of(const void *bytes, size_t n, uint64_t hash) /* FNV-1a */
{
    const unsigned char *p = (const unsigned char *)bytes;
    while (n-- > 0) hash = (hash ^ *p++) * UINT64_C(1099511628211);
    return hash;
}
static const uint64_t hash_start = UINT64_C(14695981039346656037);

/* A tile whose record stands at `at`. */
static int note_tile(tile_set *t, int64_t at, const float *features)
{
    if (t->count == t->room) {
        int room = t->room ? 2 * t->room : 1024;
        float *more = (float *)realloc(t->features, (size_t)room * FEATURES * sizeof *more);
        int64_t *more_at = more ? (int64_t *)realloc(t->at, (size_t)room * sizeof *more_at) : NULL;
        if (more) t->features = more;
        if (!more_at) return common_say(t->common, "no memory");
        t->at = more_at;
        t->room = room;
    }
    memcpy(t->features + (size_t)t->count * FEATURES, features, FEATURES * sizeof(float));
    t->at[t->count++] = at;
    return 1;
}

/* Appends the record of a tile, whose pixels are linear light. */
static int add_tile(tile_set *t, record head, float *light)
{
    source whole;
    float *features = (float *)(void *)t->data;
    unsigned char *pixels = t->data + FEATURES * sizeof(float);
    size_t i, n = pixel_bytes(t);
    int64_t at = t->end;
    memset(&whole, 0, sizeof whole);
    whole.light = light;
    whole.width = t->width, whole.height = t->height, whole.channels = 3;
    if (!shrink(&whole, 0, 0, t->width, t->height, PARTS, PARTS, features)) return common_say(t->common, "no memory");
    to_lab(features, PARTS * PARTS);
    for (i = 0; i < n; i++) pixels[i] = to_byte(light[i]);
    head.sum = hash_of(t->data, data_bytes(t), hash_of(&head, 3 * sizeof(uint64_t), hash_start));
    if (seek_to(t->file, at) || fwrite(&head, sizeof head, 1, t->file) != 1 ||
        fwrite(t->data, data_bytes(t), 1, t->file) != 1 || fflush(t->file)) {
        fprintf(stderr, "photomosaic: the file of tiles cannot be written: %s\n", strerror(errno));
        return 0;
    }
    t->end = at + (int64_t)(sizeof head + data_bytes(t));
    return note_tile(t, at, features);
}

static int by_record_name(const void *a, const void *b)
{
    const known_tile *x = (const known_tile *)a, *y = (const known_tile *)b;
    return x->head.name < y->head.name ? -1 : x->head.name > y->head.name ? 1 : x->at < y->at ? -1 : x->at > y->at;
}

/* The records of an index. The first that is damaged or cut short, and what follows, is made again. */
static int read_records(tile_set *t)
{
    record r;
    int room = 0;
    while (fread(&r, sizeof r, 1, t->file) == 1 && fread(t->data, data_bytes(t), 1, t->file) == 1) {
        if (r.sum != hash_of(t->data, data_bytes(t), hash_of(&r, 3 * sizeof(uint64_t), hash_start))) break;
        if (t->known_count == room) {
            known_tile *more;
            room = room ? 2 * room : 1024;
            more = (known_tile *)realloc(t->known, (size_t)room * sizeof *more);
            if (!more) return common_say(t->common, "no memory");
            t->known = more;
        }
        t->known[t->known_count].head = r;
        t->known[t->known_count++].at = t->end;
        t->end += (int64_t)(sizeof r + data_bytes(t));
    }
    if (t->known_count) qsort(t->known, (size_t)t->known_count, sizeof *t->known, by_record_name);
    return 1;
}

/* The file of tiles: at `path`, where an index of the same kind of tiles is gone on with, or one without a name. */
static int open_tiles(tile_set *t, const char *path)
{
    index_head head, old;
    memset(&head, 0, sizeof head);
    memcpy(head.name, INDEX_NAME, sizeof INDEX_NAME);
    head.width = t->width, head.height = t->height, head.paper = t->paper, head.features = FEATURES;
    t->end = (int64_t)sizeof head;
    t->data = (unsigned char *)malloc(data_bytes(t));
    if (!t->data) return common_say(t->common, "no memory");
    t->file = path ? fopen(path, "r+b") : tmpfile();
    if (path && !t->file && errno == ENOENT) t->file = fopen(path, "w+b");
    if (!t->file) {
        fprintf(stderr, "photomosaic: %s: %s\n", path ? path : "a file for the tiles", strerror(errno));
        return 0;
    }
    if (path && fread(&old, 1, sizeof old, t->file) > 0) {
        int same = memcmp(old.name, head.name, sizeof old.name) == 0;
        if (same && memcmp(&old, &head, sizeof head) == 0) return read_records(t);
        fprintf(stderr, "photomosaic: --index %s: %s\n", path,
                same ? "is of tiles of another size or over another paper" : "is there already and no index of tiles");
        return 0;
    }
    rewind(t->file);
    if (fwrite(&head, sizeof head, 1, t->file) == 1 && fflush(t->file) == 0) return 1;
    fprintf(stderr, "photomosaic: %s: %s\n", path ? path : "a file for the tiles", strerror(errno));
    return 0;
}

static void close_tiles(tile_set *t)
{
    if (t->file) fclose(t->file);
    free(t->data);
    free(t->features);
    free(t->at);
    free(t->known);
}

/* The tile of a picture that the index knows as it is now: 1 when it was taken over, -1 on failure. */
static int reuse_tile(tile_set *t, const record *r)
{
    int low = 0, high = t->known_count;
    while (low < high) {
        int middle = low + (high - low) / 2;
        if (t->known[middle].head.name < r->name) low = middle + 1;
        else high = middle;
    }
    for (; low < t->known_count && t->known[low].head.name == r->name; low++) {
        const record *old = &t->known[low].head;
        int64_t at = t->known[low].at;
        if (old->size != r->size || old->changed != r->changed) continue;
        if (seek_to(t->file, at + (int64_t)sizeof *r) || fread(t->data, FEATURES * sizeof(float), 1, t->file) != 1)
            return -1;
        t->reused++;
        return note_tile(t, at, (const float *)(const void *)t->data) ? 1 : -1;
    }
    return 0;
}

/* ---- reading tiles ---- */

/* Adds every tile of a sheet, or the whole of a picture that is smaller than a tile. */
static int add_sheet(tile_set *t, const char *path)
{
    image message;
    source s;
    record none = {0, 0, 0, 0};
    float *light = (float *)malloc(pixel_bytes(t) * sizeof(float));
    int across, down, i, j, ok = light != NULL;
    if (!common_read(t->common, path)) exit(2);
    if (!source_load(&s, path, t->paper, &message)) {
        free(light);
        return common_say(t->common, message.message);
    }
    across = s.width / t->width;
    down = s.height / t->height;
    if (across < 1 || down < 1) {
        image whole;
        ok = ok && shrink_upright(&s, t->width, t->height, &whole) && add_tile(t, none, whole.pixels);
        if (ok) image_free(&whole);
        across = 0;
    }
    for (j = 0; j < down; j++)
        for (i = 0; i < across && ok; i++)
            ok = shrink(&s, i * t->width, j * t->height, t->width, t->height, t->width, t->height, light) &&
                 add_tile(t, none, light);
    source_free(&s);
    free(light);
    return ok;
}

static int by_name(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

typedef struct names {
    char **name;
    int count, room;
    file_id inside[DEPTH]; /* the folders that are being listed: a link to one of them leads nowhere new */
} names;

/* All files of a folder and its folders but hidden ones. Names that are too long are left out, like what is deeper. */
static int list_folder(names *n, const char *where, int depth)
{
    DIR *folder = opendir(where);
    struct dirent *entry;
    char path[FILE_PATH];
    struct stat about;
    int ok = 1, i;
    for (i = 0; file_identify(&n->inside[depth], where) && i < depth; i++)
        if (n->inside[i].volume == n->inside[depth].volume && n->inside[i].number == n->inside[depth].number) {
            if (folder) closedir(folder);
            return 1;
        }
    while (folder && ok && (entry = readdir(folder)) != NULL) {
        if (entry->d_name[0] == '.' || strlen(where) + 1 + strlen(entry->d_name) >= FILE_PATH) continue;
        strcpy(path, where);
        strcat(strcat(path, "/"), entry->d_name);
        if (stat(path, &about)) continue;
        if (S_ISDIR(about.st_mode)) {
            if (depth + 1 < DEPTH) ok = list_folder(n, path, depth + 1);
            continue;
        }
        if (!S_ISREG(about.st_mode)) continue; /* a pipe would wait for ever */
        if (n->count == n->room) {
            char **more = (char **)realloc(n->name, (size_t)(n->room ? 2 * n->room : 256) * sizeof *more);
            if (!(ok = more != NULL)) break;
            n->name = more, n->room = n->room ? 2 * n->room : 256;
        }
        n->name[n->count] = (char *)malloc(strlen(path) + 1);
        if (!(ok = n->name[n->count] != NULL)) break;
        strcpy(n->name[n->count++], path);
    }
    if (folder) closedir(folder);
    return ok;
}

/* Pictures that workers read at once. */
typedef struct batch {
    const tile_set *tiles;
    char *const *path;
    image *tile;
} batch;

static void read_range(int begin, int end, int worker, void *context)
{
    batch *b = (batch *)context;
    int i;
    (void)worker;
    for (i = begin; i < end; i++) {
        source s;
        if (!source_load(&s, b->path[i], b->tiles->paper, &b->tile[i])) continue;
        if (!shrink_upright(&s, b->tiles->width, b->tiles->height, &b->tile[i]))
            image_fail(&b->tile[i], b->path[i], "no memory");
        source_free(&s);
    }
}

/* Reads `count` new pictures, and adds them in their order. */
static int read_batch(tile_set *t, char *const *path, const record *head, int count)
{
    image *tile = (image *)calloc((size_t)count, sizeof *tile);
    batch b;
    int i, ok = tile != NULL;
    b.tiles = t;
    b.path = path;
    b.tile = tile;
    if (ok && t->common->threads.parallel_for && count > 1)
        t->common->threads.parallel_for(count, read_range, &b, t->common->threads.user);
    else if (ok) read_range(0, count, 0, &b);
    for (i = 0; ok && i < count; i++) {
        if (tile[i].pixels) ok = add_tile(t, head[i], tile[i].pixels);
        else {
            fprintf(stderr, "photomosaic: left out: %s\n", tile[i].message);
            t->unread++;
        }
        image_free(&tile[i]);
    }
    free(tile);
    return ok;
}

/* Notes that the file is read, as common_read does, whose time grows with the files noted before. */
static int note_input(common_settings *common, const char *path, const file_id *out, int have_out)
{
    file_id id;
    if (!file_identify(&id, path)) return 1;
    if (have_out && id.volume == out->volume && id.number == out->number) return common_read(common, path);
    if (common->input_count == common->input_room) {
        int room = common->input_room ? 2 * common->input_room : 256;
        file_id *more = (file_id *)realloc(common->inputs, (size_t)room * sizeof *more);
        if (!more) return common_say(common, "no memory");
        common->inputs = more, common->input_room = room;
    }
    common->inputs[common->input_count++] = id;
    return 1;
}

/* The pictures of a folder, in the order of their names; those that the index knows are not opened. */
static int add_folder(tile_set *t, const char *where, const char *index)
{
    enum { BATCH = 64 };
    names n;
    record heads[BATCH];
    char *paths[BATCH];
    common_progress progress = {0, 0};
    file_id out = {0, 0}, own = {0, 0};
    int ok, i, waiting = 0, have_out = file_identify(&out, t->common->out), have_index,
               batch_size = t->common->workers * 4 < BATCH ? t->common->workers * 4 : BATCH;
    memset(&n, 0, sizeof n);
    ok = list_folder(&n, where, 0);
    have_index = index && file_identify(&own, index);
    if (!ok) common_say(t->common, "no memory");
    if (n.name) qsort(n.name, (size_t)n.count, sizeof *n.name, by_name);
    for (i = 0; ok && i < n.count; i++) {
        struct stat about;
        record *head = &heads[waiting];
        file_id id;
        int found;
        if (stat(n.name[i], &about)) continue;
        if (have_index && file_identify(&id, n.name[i]) && id.volume == own.volume && id.number == own.number) continue;
        if (!note_input(t->common, n.name[i], &out, have_out)) exit(2);
        memset(head, 0, sizeof *head);
        head->name = hash_of(n.name[i], strlen(n.name[i]), hash_start);
        head->size = (uint64_t)about.st_size;
        head->changed = (uint64_t)about.st_mtime;
        found = reuse_tile(t, head);
        ok = found >= 0;
        if (found == 0) paths[waiting++] = n.name[i];
        if (waiting == batch_size || (waiting && i == n.count - 1)) {
            ok = ok && read_batch(t, paths, heads, waiting);
            waiting = 0;
        }
        common_show_progress(&progress, "reading tiles", i + 1, n.count);
    }
    if (ok && waiting) ok = read_batch(t, paths, heads, waiting);
    for (i = 0; i < n.count; i++) free(n.name[i]);
    free(n.name);
    if (ok && t->unread)
        fprintf(stderr, "photomosaic: %d of %d files could not be read and were left out\n", t->unread,
                t->unread + t->count);
    if (ok && t->common->stats) printf("%d tiles, %d of them from the index\n", t->count, t->reused);
    if (ok && t->count == 0) fprintf(stderr, "photomosaic: --tiles %s: no picture in this folder can be read\n", where);
    return ok && t->count > 0;
}

/* A folder of photographs, or sheets separated by commas. */
static int load_tiles(tile_set *t, const char *where, const char *index)
{
    struct stat about;
    char path[FILE_PATH];
    if (stat(where, &about) == 0 && S_ISDIR(about.st_mode)) return add_folder(t, where, index);
    if (index) return common_say(t->common, "--index: keeps the tiles of a folder; --tiles is none");
    while (*where) {
        size_t n = strcspn(where, ",");
        if (n >= sizeof path) return common_say(t->common, "--tiles: the path is too long");
        snprintf(path, sizeof path, "%.*s", (int)n, where);
        if (!add_sheet(t, path)) return 0;
        where += n + (where[n] == ',');
    }
    return t->count > 0 || common_say(t->common, "--tiles: no tiles");
}

/* 4096 drawn tiles: two colours parted by a line, a disc or stripes. */
static int draw_tiles(tile_set *t)
{
    float *light = (float *)malloc(pixel_bytes(t) * sizeof(float));
    record none = {0, 0, 0, 0};
    int k, x, y, c, ok = light != NULL;
    for (k = 0; ok && k < MADE_TILES; k++) {
        unsigned h = (unsigned)k * 2654435761u, g = (h ^ h >> 13) * 2246822519u;
        float turn = (float)(h >> 24) / 40.0f, offset = (float)(g >> 24) / 128.0f - 1;
        for (y = 0; y < t->height; y++)
            for (x = 0; x < t->width; x++) {
                float u = 2 * ((float)x + 0.5f) / (float)t->width - 1, v = 2 * ((float)y + 0.5f) / (float)t->height - 1;
                float line = cosf(turn) * u + sinf(turn) * v, inside = k % 3 == 0   ? line - offset
                                                                       : k % 3 == 1 ? 0.6f - hypotf(u, v)
                                                                                    : sinf(line * 6);
                for (c = 0; c < 3; c++)
                    light[(y * t->width + x) * 3 + c] = linear_of[(inside > 0 ? h : g) >> (8 * c) & 255u];
            }
        ok = add_tile(t, none, light);
    }
    free(light);
    return ok;
}

/* ---- the target ---- */

/* A target for want of one: a sun over the sea. */
static int draw_target(image *picture)
{
    int x, y, c, n = 480;
    if (!image_create(picture, n, n, 3)) return 0;
    for (y = 0; y < n; y++)
        for (x = 0; x < n; x++) {
            float u = (float)x / (float)n - 0.5f, v = (float)y / (float)n,
                  *p = picture->pixels + ((size_t)y * (size_t)n + (size_t)x) * 3;
            float sun = hypotf(u, v - 0.45f), sea = v > 0.62f ? 1.0f : 0.0f,
                  wave = 12 * sinf(60 * v + 6 * sinf(9 * u)) * sea;
            p[0] = sun < 0.17f && sea < 0.5f ? 250 : 240 - 190 * sea - 90 * v + wave;
            p[1] = sun < 0.17f && sea < 0.5f ? 220 : 120 + 40 * v - 30 * sea + wave;
            p[2] = sun < 0.17f && sea < 0.5f ? 90 : 90 + 110 * v + wave;
            for (c = 0; c < 3; c++) p[c] = sat__srgb_decode(p[c] / 255);
        }
    return 1;
}

/* The grid of about so many cells for a picture of this shape. */
static void choose_grid(int *grid, int cells, double shape)
{
    double across = floor(sqrt(cells * shape) + 0.5), down;
    across = across < 1 ? 1 : across > cells ? cells : across;
    down = floor(cells / across + 0.5);
    grid[0] = (int)across;
    grid[1] = (int)down;
}

/* The whole target in linear light, no more of its pixels than 16 to a part of a cell. cells > 0 chooses the grid;
   shape: of a cell, width over height. */
static int load_target(image *picture, const char *path, int paper, int *grid, int cells, double shape)
{
    source s;
    double most = 4e6, width, height, scale = 1;
    int ok;
    if (!source_load(&s, path, paper, picture)) return 0;
    width = s.turn >= 5 ? s.height : s.width;
    height = s.turn >= 5 ? s.width : s.height;
    if (cells > 0) choose_grid(grid, cells, width / height / shape);
    if (16.0 * PARTS * PARTS * grid[0] * grid[1] > most) most = 16.0 * PARTS * PARTS * grid[0] * grid[1];
    if (width * height > most) scale = sqrt(most / (width * height));
    ok = shrink_upright(&s, (int)ceil(width * scale), (int)ceil(height * scale), picture);
    source_free(&s);
    return ok;
}

/* ---- mosaics ---- */

typedef struct studio {
    tile_set tiles;
    image picture, tint;   /* tint: a pixel a cell, in display values */
    sat_image target;      /* the middle of the picture, in the shape of the grid */
    float *cells;          /* features of the target's cells */
    int *columns, *order;  /* order: 0, 1, 2, ... */
    unsigned char *mosaic; /* whole, for films and comparisons */
    unsigned char *sheet;  /* the tiles of a row of cells, side by side, or some lines of them */
    softassign_problem problem;
    softassign_options options;
    int grid[2];
    const common_settings *common;
    float blend;
    const char *folder;        /* of the video */
    int frame, frames, failed; /* failed: a frame could not be written */
    common_progress progress;
} studio;

/* Lines first to first + count - 1 of a row of cells. */
static int draw_lines(studio *s, unsigned char *out, int row, int first, int count, const int *columns)
{
    const tile_set *t = &s->tiles;
    size_t line = (size_t)t->width * 3, wide = line * (size_t)s->grid[0];
    sat_image sheet, tint;
    int x, y;
    for (x = 0; x < s->grid[0]; x++) {
        int64_t at = t->at[columns[row * s->grid[0] + x]] + (int64_t)(sizeof(record) + FEATURES * sizeof(float));
        if (seek_to(t->file, at + (int64_t)line * first) ||
            fread(t->data, line, (size_t)count, t->file) != (size_t)count)
            return common_say(s->common, "the file of tiles cannot be read");
        for (y = 0; y < count; y++)
            memcpy(s->sheet + (size_t)y * wide + (size_t)x * line, t->data + (size_t)y * line, line);
    }
    memset(&sheet, 0, sizeof sheet);
    sheet.pixels = s->sheet;
    sheet.width = s->grid[0] * t->width;
    sheet.height = count;
    sheet.channels = 3;
    sheet.stride = (ptrdiff_t)wide;
    sheet.format = SAT_U8;
    tint = image_view(&s->tint);
    tint.pixels = s->tint.pixels + (size_t)row * (size_t)s->grid[0] * 3;
    tint.height = 1;
    return softassign_mosaic(out, (ptrdiff_t)wide, &sheet, t->width, count, s->order, s->grid[0], 1,
                             s->blend > 0 ? &tint : NULL, s->blend) == SAT_OK ||
           common_say(s->common, "the mosaic cannot be drawn");
}

/* Lines of the strips that are drawn at once. */
static int strip_lines(const studio *s)
{
    int lines = STRIP_BYTES / (s->grid[0] * s->tiles.width * 3);
    return lines < 1 ? 1 : lines > s->tiles.height ? s->tiles.height : lines;
}

/* The mosaic in memory. */
static int draw(studio *s, unsigned char *out, const int *columns)
{
    size_t wide = (size_t)s->grid[0] * pixel_bytes(&s->tiles);
    int row, first, lines = strip_lines(s);
    for (row = 0; row < s->grid[1]; row++)
        for (first = 0; first < s->tiles.height; first += lines) {
            int count = s->tiles.height - first < lines ? s->tiles.height - first : lines;
            if (!draw_lines(s,
                            out + (size_t)row * wide + (size_t)first * (size_t)s->grid[0] * (size_t)s->tiles.width * 3,
                            row, first, count, columns))
                return 0;
        }
    return 1;
}

/* The mosaic as a PNG, strip after strip. */
static int write_mosaic(studio *s, const char *path)
{
    char why[FILE_MESSAGE];
    file_writer file;
    png_strips png;
    common_progress progress = {0, 0};
    int row, first, lines = strip_lines(s), ok = 1, height = s->grid[1] * s->tiles.height;
    unsigned char *strip = (unsigned char *)malloc((size_t)lines * (size_t)s->grid[0] * (size_t)s->tiles.width * 3);
    if (!strip) return common_say(s->common, "no memory");
    if (!common_may_write(s->common, path)) return free(strip), 0;
    if (file_open(&file, path, why) &&
        (ok = png_strips_begin(&png, &file, s->grid[0] * s->tiles.width, height, 3)) != 0) {
        for (row = 0; row < s->grid[1] && ok; row++)
            for (first = 0; first < s->tiles.height && ok; first += lines) {
                int count = s->tiles.height - first < lines ? s->tiles.height - first : lines;
                ok = draw_lines(s, strip, row, first, count, s->columns);
                if (ok) png_strips_rows(&png, strip, count);
                common_show_progress(&progress, "writing", row * s->tiles.height + first + count, height);
            }
        png_strips_end(&png);
    } else if (!ok) file.error = ENOMEM;
    free(strip);
    return common_wrote(s->common, path, file_close(&file, ok, why) && ok, why);
}

static int write_frame(studio *s, const int *columns)
{
    char path[FILE_PATH];
    if (strlen(s->folder) + 16 > sizeof path) return common_say(s->common, "--video: the path is too long");
    snprintf(path, sizeof path, "%s/%04d.png", s->folder, s->frame++);
    return draw(s, s->mosaic, columns) &&
           common_save_u8(s->common, path, s->mosaic, s->grid[0] * s->tiles.width, s->grid[1] * s->tiles.height, 3);
}

/* The bar shows what is proven: how far the mosaic can be from the best one. */
static int watch(const softassign_stats *report, const int *columns, void *user)
{
    studio *s = (studio *)user;
    char text[96] = "no mosaic yet";
    if (columns) snprintf(text, sizeof text, "at most %.3g %% from the best", 100 * report->gap);
    common_show_progress(
        &s->progress, text,
        s->folder && s->frames ? (double)s->frame / s->frames : 1 - (report->gap < 1 ? report->gap : 1), 1.0001);
    if (s->folder && columns && !write_frame(s, columns)) s->failed = 1;
    return s->failed;
}

static void print_report(const studio *s, const softassign_stats *r, double seconds)
{
    printf("cost %.6g, no choice costs less than %.6g: gap %.3g %%, %.0f ms; colours differ by %.3g (CIELAB)\n",
           r->cost, r->lower_bound, 100 * r->gap, 1e3 * seconds, r->cost / s->problem.rows / PARTS);
    if (r->conflicts) printf("  %d pairs of equal tiles are too close\n", r->conflicts);
    if (s->common->stats)
        printf("  %zu distances, %zu lists, %zu paths, %zu prices raised back, %.2f MB\n", r->distances_computed,
               r->lists_built, r->paths, r->columns_finished, (double)r->bytes / 1e6);
}

/* Features of the cells of a picture. */
static sat_result cell_features(studio *s, const sat_image *picture)
{
    sat_result result = softassign_features(s->cells, picture, s->grid[0], s->grid[1], PARTS, PARTS, &s->options);
    if (result == SAT_OK) to_lab(s->cells, (size_t)s->problem.rows * PARTS * PARTS);
    return result;
}

/* A window of three quarters pans over the target; prices and tiles of a frame are the start of the next. */
static sat_result film(studio *s, int frames)
{
    softassign *solver = NULL;
    softassign_stats report;
    sat_result result;
    sat_image window = s->target;
    int frame;
    s->options.method = SOFTASSIGN_EXACT;
    s->options.progress = NULL;
    window.width = s->target.width * 3 / 4 > 0 ? s->target.width * 3 / 4 : 1;
    result = softassign_create(&solver, s->problem.rows, s->problem.columns, &s->options);
    for (frame = 0; result == SAT_OK && frame < frames; frame++) {
        double start = common_clock();
        int left = (s->target.width - window.width) * frame / (frames > 1 ? frames - 1 : 1);
        window.pixels = (const float *)s->target.pixels + (size_t)left * 3;
        softassign_next_frame(solver);
        result = cell_features(s, &window);
        s->problem.previous = frame ? s->columns : NULL;
        if (result == SAT_OK) result = softassign_step(solver, s->columns, &s->problem, (size_t)-1 / 4, &report);
        s->failed = result == SAT_OK && s->folder && !write_frame(s, s->columns);
        if (result != SAT_OK || s->failed) break;
        printf("frame %d: %d tiles changed, ", frame, report.switched);
        print_report(s, &report, common_clock() - start);
    }
    softassign_destroy(solver);
    s->problem.previous = NULL;
    return result;
}

/* Beside the mosaic the one in which tiles may repeat. */
static int compare(studio *s, const char *out)
{
    common_cell cells[2];
    softassign_stats report;
    int i, used = 0, ok, width = s->grid[0] * s->tiles.width, height = s->grid[1] * s->tiles.height;
    unsigned char *other = (unsigned char *)malloc((size_t)width * (size_t)height * 3);
    char *seen = (char *)calloc((size_t)s->tiles.count, 1), label[64];
    ok = other && seen && draw(s, s->mosaic, s->columns);
    s->options.capacity_default = s->problem.rows;
    s->options.min_distance = 0;
    s->options.method = SOFTASSIGN_AUTO;
    s->options.progress = NULL;
    ok = ok && softassign_solve(s->columns, &s->problem, &s->options, &report) == SAT_OK && draw(s, other, s->columns);
    for (i = 0; ok && i < s->problem.rows; i++)
        if (!seen[s->columns[i]]) seen[s->columns[i]] = 1, used++;
    snprintf(label, sizeof label, "best match with repeats: %d tiles", used);
    for (i = 0; i < 2; i++) {
        cells[i].rgb = i ? other : s->mosaic;
        cells[i].label = i ? label : "as asked";
        cells[i].width = width;
        cells[i].height = height;
    }
    if (ok) printf("best match with repeats: cost %.6g, %d different tiles\n", report.cost, used);
    ok = ok ? common_contact_sheet(s->common, out, cells, 2, 2)
            : common_say(s->common, "the comparison cannot be drawn");
    free(other);
    free(seen);
    return ok;
}

/* A pixel a cell for --blend. */
static int make_tint(studio *s)
{
    source picture;
    size_t i, n = (size_t)s->problem.rows * 3;
    memset(&picture, 0, sizeof picture);
    picture.light = s->picture.pixels;
    picture.width = s->picture.width, picture.height = s->picture.height, picture.channels = 3;
    if (!image_create(&s->tint, s->grid[0], s->grid[1], 3) ||
        !shrink(&picture, (s->picture.width - s->target.width) / 2, (s->picture.height - s->target.height) / 2,
                s->target.width, s->target.height, s->grid[0], s->grid[1], s->tint.pixels))
        return 0;
    for (i = 0; i < n; i++) s->tint.pixels[i] = to_byte(s->tint.pixels[i]);
    return 1;
}

/* The target is cut to the shape of the grid. */
static sat_result open_studio(studio *s, int whole)
{
    double shape = (double)s->grid[0] * s->tiles.width / ((double)s->grid[1] * s->tiles.height);
    int width = s->picture.width, height = s->picture.height, i;
    size_t lines = (size_t)strip_lines(s) * (size_t)s->grid[0] * (size_t)s->tiles.width * 3;
    if (width > height * shape) width = (int)(height * shape + 0.5);
    else height = (int)(width / shape + 0.5);
    s->target = image_view(&s->picture);
    s->target.width = width = width > 0 ? width : 1;
    s->target.height = height = height > 0 ? height : 1;
    s->target.pixels = s->picture.pixels + ((size_t)((s->picture.height - height) / 2) * (size_t)s->picture.width +
                                            (size_t)((s->picture.width - width) / 2)) *
                                               3;
    s->problem.rows = s->grid[0] * s->grid[1];
    if (s->problem.rows > LIST_BYTES / 12 / s->options.neighbours)
        s->options.neighbours = s->problem.rows > LIST_BYTES / 12 / 16 ? 16 : LIST_BYTES / 12 / s->problem.rows;
    s->problem.columns = s->tiles.count;
    s->problem.feature_count = FEATURES;
    s->problem.row_features = s->cells = (float *)malloc((size_t)s->problem.rows * FEATURES * sizeof(float));
    s->problem.column_features = s->tiles.features;
    s->columns = (int *)malloc((size_t)s->problem.rows * sizeof(int));
    s->order = (int *)malloc((size_t)s->grid[0] * sizeof(int));
    s->sheet = (unsigned char *)malloc(lines);
    if (whole) s->mosaic = (unsigned char *)malloc((size_t)s->problem.rows * pixel_bytes(&s->tiles));
    if (!s->cells || !s->columns || !s->order || !s->sheet || (whole && !s->mosaic) || !make_tint(s))
        return SAT_ERR_MEMORY;
    for (i = 0; i < s->grid[0]; i++) s->order[i] = i;
    return cell_features(s, &s->target);
}

static void close_studio(studio *s)
{
    free(s->cells);
    free(s->columns);
    free(s->order);
    free(s->mosaic);
    free(s->sheet);
    image_free(&s->picture);
    image_free(&s->tint);
    close_tiles(&s->tiles);
}

/* Solves, or films, and writes. */
static int work(studio *s, int pan, int both, const char *out)
{
    softassign_stats report;
    double start = common_clock();
    sat_result result = open_studio(s, both || s->folder);
    report.row_error = -1;
    if (result == SAT_OK && pan > 0) result = film(s, pan);
    else if (result == SAT_OK) {
        result = softassign_solve(s->columns, &s->problem, &s->options, &report);
        if (result == SAT_OK) print_report(s, &report, common_clock() - start);
    }
    if (s->failed) return 0;
    if (result == SAT_ERR_LIMIT) {
        int uses = (s->problem.rows - 1) / s->tiles.count + 1;
        fprintf(stderr,
                "photomosaic: %d cells need as many tiles, and there are %d; with --capacity %d each may be used so "
                "often\n",
                s->problem.rows, s->tiles.count, uses);
        return 0;
    }
    if (result != SAT_OK) return common_say(s->common, sat_result_text(result));
    return both ? compare(s, out) : write_mosaic(s, out);
}

int main(int argc, char **argv)
{
    double gap = 0.001, distance = 0, switching = 0, cell_shape;
    int method = 0, capacity = 1, both = 0, pan = 0, seed = 1, iterations = 0, cells = 0, ok, i, shape[2] = {1, 1};
    const char *target = NULL, *tiles = NULL, *index = NULL;
    studio s;
    common_settings common;
    const common_option options[] = {
        {"target", 'P', (void *)&target, 0, 0, "picture to be made; without one it is drawn here"},
        {"tiles", 's', (void *)&tiles, 0, 0,
         "folder of pictures, or sheets of tiles separated by commas; without them they are drawn"},
        {"index", 's', (void *)&index, 0, 0, "file that keeps the tiles of a folder for the next time"},
        {"tile", 'i', &s.tiles.width, 1, 1024, "width of a tile in pixels"},
        {"shape", 'z', shape, 1, 64, "of tiles and cells: width to height"},
        {"grid", 'z', s.grid, 1, 1000, "tiles across and down"},
        {"cells", 'i', &cells, 0, 1000000,
         "about so many tiles in the shape of the picture, instead of a grid; 0: the grid"},
        {"paper", 'i', &s.tiles.paper, 0, 255, "grey behind transparent pictures"},
        {"method", 'w', &method, 0, 0, "auto|exact|fast|entropic|published|greedy|2opt|annealing|ants"},
        {"gap", 'd', &gap, 0, 1e6, "fast: proven distance from the best mosaic"},
        {"capacity", 'i', &capacity, 1, 1000000, "uses of a tile"},
        {"distance", 'd', &distance, 0, 1000, "smallest distance of equal tiles in cells"},
        {"blend", 'f', &s.blend, 0, 1, "tint tiles towards the target"},
        {"compare", 'b', &both, 0, 0, "beside it the mosaic in which tiles repeat"},
        {"video", 's', (void *)&s.folder, 0, 0, "folder for numbered frames"},
        {"pan", 'i', &pan, 0, 9999, "frames of a pan over the target"},
        {"switching", 'd', &switching, 0, 1e6, "what keeping a tile is worth, in mean costs"},
        {"iterations", 'i', &iterations, 0, 1000000000, "of ants, annealing, published; 0: the method's own"},
        {"seed", 'i', &seed, 0, 2147483647, "of random methods"},
    };
    memset(&s, 0, sizeof s);
    s.grid[0] = s.grid[1] = 30;
    s.tiles.width = 32;
    s.tiles.paper = 255;
    common_parse(&common, argc, argv, "photomosaic", ".png", options, (int)(sizeof options / sizeof options[0]));
    for (i = 0; i < 256; i++) linear_of[i] = sat__srgb_decode((float)i / 255);
    s.common = s.tiles.common = &common;
    s.tiles.height = (s.tiles.width * shape[1] + shape[0] / 2) / shape[0];
    if (s.tiles.height < 1) s.tiles.height = 1;
    cell_shape = (double)s.tiles.width / s.tiles.height;
    if (cells > 0) choose_grid(s.grid, cells, 1 / cell_shape);
    if (!(target ? load_target(&s.picture, target, s.tiles.paper, s.grid, cells, cell_shape) : draw_target(&s.picture)))
        return common_say(&common, s.picture.message), 1;
    s.options = softassign_method_defaults((softassign_method)method);
    s.options.gap = gap;
    s.options.capacity_default = capacity;
    s.options.seed = (uint64_t)seed;
    s.options.switching = switching;
    s.options.grid_width = s.grid[0];
    s.options.min_distance = distance;
    s.options.threads = common.threads;
    if (iterations > 0) s.options.iterations[0] = iterations;
    s.options.progress = watch;
    s.options.progress_user = &s;
    s.frames = s.options.iterations[0];
    if (index && !tiles) common_leave(&common, 2, "--index", "keeps the tiles of a folder; --tiles names none");
    if (s.folder && !file_make_folder(s.folder)) common_leave(&common, 1, s.folder, strerror(errno));
    ok = open_tiles(&s.tiles, tiles ? index : NULL) && (!tiles || !index || common_read(&common, index)) &&
         (tiles ? load_tiles(&s.tiles, tiles, index) : draw_tiles(&s.tiles)) && work(&s, pan, both, common.out);
    close_studio(&s);
    common_close(&common);
    return !ok;
}
