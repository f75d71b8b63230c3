/* tile_set.h - many pictures as tiles of one size, in a file.         SPDX-License-Identifier: MIT-0 OR Unlicense

       tile_set t = {...};                              width, height, paper, common
       if (!load_tiles(&t, "folder", "tiles.index")) ...   or "sheet.png,sheet.png", or NULL: drawn here
       close_tiles(&t);

   Records stand in a file, which an index keeps from run to run, so that a picture is read once in its life; in memory
   are the colours of a tile's parts, and where its record stands. The file of the program defines POSIX before it
   includes anything. */

#ifndef TILE_SET_H
#define TILE_SET_H

#include <dirent.h>
#include "common.h"
#include "photo_source.h"

enum { PARTS = 4, FEATURES = PARTS * PARTS * 3, MADE_TILES = 4096, DEPTH = 16 };
#define INDEX_NAME "photomosaic 1\n\0\0\1\2\3\4" /* the last bytes: what another order of bytes would change */

#ifdef _WIN32
#define seek_to(file, at) _fseeki64(file, at, SEEK_SET)
#else
#define seek_to(file, at) fseeko(file, (off_t)(at), SEEK_SET)
#endif

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

#endif
