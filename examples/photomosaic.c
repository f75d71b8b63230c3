/* photomosaic - a picture made of pictures, each used once.           SPDX-License-Identifier: MIT-0 OR Unlicense

       photomosaic target.jpg --tiles sheet_0.png,sheet_1.png --grid 30x30 --out mosaic.png
       photomosaic target.jpg --tiles folder --gap 0.001 --method fast --compare --out both.png
       photomosaic target.jpg --tiles folder --method ants --video frames      frames/0000.png, ...: order out of chaos
       photomosaic target.jpg --tiles folder --pan 24 --switching 0.05 --video frames      a film, frame by frame warm
       photomosaic                                                              target and tiles drawn here:
       out/photomosaic.png

   Several target pictures in a row need several calls. The proof stands in the last line: no other choice of tiles is
   nearer to the target by more than the gap. */

#define _POSIX_C_SOURCE 200809L
#include <dirent.h>
#define SAT_IMPLEMENTATION
#define SOFTASSIGN_IMPLEMENTATION
#include "../softassign.h"
#include "common.h"

enum { PARTS = 4, FEATURES = PARTS * PARTS * 3, MADE_TILES = 4096, MADE_ACROSS = 64 };

/* ---- tiles: one sheet of bytes, `across` tiles wide ---- */

typedef struct tile_set {
    unsigned char *pixels;
    int size, across, count, room;
    common_settings *common;
} tile_set;

static sat_image bytes_view(const unsigned char *pixels, int width, int height)
{
    sat_image view;
    view.pixels = pixels;
    view.width = width;
    view.height = height;
    view.channels = 3;
    view.stride = (ptrdiff_t)width * 3;
    view.format = SAT_U8;
    return view;
}

/* Display values 0..255 of a picture, as floats. */
static int load_display(image *picture, const char *path)
{
    size_t i, n;
    if (!image_load(picture, path)) return 0;
    n = (size_t)picture->width * (size_t)picture->height * 3;
    for (i = 0; i < n; i++) picture->pixels[i] = 255 * sat__srgb_encode(picture->pixels[i]);
    return 1;
}

/* The top left pixel of a new tile, or NULL without memory. */
static unsigned char *new_tile(tile_set *set)
{
    size_t row = (size_t)(set->across * set->size) * 3, strip = row * (size_t)set->size;
    int at = set->count;
    if (at == set->room) {
        int more = set->room ? set->room : 16 * set->across;
        unsigned char *grown = (unsigned char *)realloc(set->pixels, strip * (size_t)((at + more) / set->across));
        if (!grown) return NULL;
        set->pixels = grown;
        memset(grown + strip * (size_t)(at / set->across), 0, strip * (size_t)(more / set->across));
        set->room += more;
    }
    set->count++;
    return set->pixels + strip * (size_t)(at / set->across) + (size_t)(at % set->across * set->size) * 3;
}

/* Adds every tile of a picture: cut into a grid where it is a sheet, shrunk as a whole where it is a photograph. Means
   of rectangles shrink it, so a tile of any shape fills the square. */
static int add_picture(tile_set *set, const char *path, int sheet)
{
    image picture;
    int across, down, i, j, x, y, n = set->size;
    float *shrunk;
    sat_image view;
    if (!common_read(set->common, path)) exit(2);
    if (!load_display(&picture, path)) return common_say(set->common, picture.message);
    across = sheet ? picture.width / n : 1;
    down = sheet ? picture.height / n : 1;
    if (across < 1 || down < 1) across = down = 1;
    shrunk = (float *)malloc((size_t)(across * n) * (size_t)(down * n) * 3 * sizeof(float));
    view = image_view(&picture);
    if (!shrunk || softassign_features(shrunk, &view, across * n, down * n, 1, 1, NULL) != SAT_OK) return 0;
    for (j = 0; j < down; j++)
        for (i = 0; i < across; i++) {
            unsigned char *tile = new_tile(set);
            for (y = 0; tile && y < n; y++)
                for (x = 0; x < 3 * n; x++)
                    tile[y * set->across * n * 3 + x] =
                        (unsigned char)(shrunk[(size_t)(j * n + y) * (size_t)(across * n * 3) +
                                               (size_t)(i * n * 3 + x)] +
                                        0.5f);
            if (!tile) return 0;
        }
    free(shrunk);
    image_free(&picture);
    return 1;
}

static int by_name(const void *a, const void *b) { return strcmp(*(char *const *)a, *(char *const *)b); }

/* All files of a folder but hidden ones, in the order of their names. */
static char **list_folder(DIR *folder, const char *where, int *count)
{
    char **names = NULL;
    struct dirent *entry;
    int room = 0;
    *count = 0;
    while ((entry = readdir(folder)) != NULL) {
        size_t length = strlen(where) + 1 + strlen(entry->d_name);
        if (entry->d_name[0] == '.' || length >= FILE_PATH) continue;
        if (*count == room) {
            char **more = (char **)realloc(names, (size_t)(room ? 2 * room : 256) * sizeof *names);
            if (!more) break;
            names = more, room = room ? 2 * room : 256;
        }
        names[*count] = (char *)malloc(length + 1);
        if (!names[*count]) break;
        strcpy(names[*count], where);
        strcat(strcat(names[(*count)++], "/"), entry->d_name);
    }
    if (names) qsort(names, (size_t)*count, sizeof *names, by_name);
    return names;
}

/* A folder of photographs, of which those that cannot be read are named and left out; or sheets separated by commas. */
static int load_tiles(tile_set *set, const char *where)
{
    DIR *folder = opendir(where);
    char path[FILE_PATH], **names;
    int count = 0, i, read = 0;
    while (!folder && *where) {
        size_t n = strcspn(where, ",");
        if (n >= sizeof path) return common_say(set->common, "--tiles: the path is too long");
        snprintf(path, sizeof path, "%.*s", (int)n, where);
        if (!add_picture(set, path, 1)) return 0;
        where += n + (where[n] == ',');
    }
    if (!folder) return set->count > 0 || common_say(set->common, "--tiles: no tiles");
    names = list_folder(folder, where, &count);
    closedir(folder);
    for (i = 0; i < count; i++) {
        read += add_picture(set, names[i], 0);
        free(names[i]);
    }
    free(names);
    if (read == 0) fprintf(stderr, "photomosaic: --tiles %s: no picture in this folder can be read\n", where);
    return read > 0;
}

/* 4096 drawn tiles: two colours parted by a line, a disc or stripes. */
static int draw_tiles(tile_set *set)
{
    int t, x, y, c, n = set->size;
    for (t = 0; t < MADE_TILES; t++) {
        unsigned char *tile = new_tile(set);
        unsigned h = (unsigned)t * 2654435761u, g = (h ^ h >> 13) * 2246822519u;
        float turn = (float)(h >> 24) / 40.0f, offset = (float)(g >> 24) / 128.0f - 1;
        if (!tile) return 0;
        for (y = 0; y < n; y++)
            for (x = 0; x < n; x++) {
                float u = 2 * ((float)x + 0.5f) / (float)n - 1, v = 2 * ((float)y + 0.5f) / (float)n - 1;
                float line = cosf(turn) * u + sinf(turn) * v, inside = t % 3 == 0   ? line - offset
                                                                       : t % 3 == 1 ? 0.6f - hypotf(u, v)
                                                                                    : sinf(line * 6);
                for (c = 0; c < 3; c++) {
                    unsigned colour = (inside > 0 ? h : g) >> (8 * c) & 255u;
                    tile[(y * set->across * n + x) * 3 + c] = (unsigned char)colour;
                }
            }
    }
    return 1;
}

/* A target for want of one: a sun over the sea. */
static int draw_target(image *picture)
{
    int x, y, n = 480;
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
        }
    return 1;
}

/* ---- mosaics ---- */

typedef struct studio {
    tile_set tiles;
    image picture;
    sat_image sheet, target; /* target: the middle of the picture, in the shape of the grid */
    float *cells, *features; /* of the target's cells, of the tiles */
    int *columns;
    unsigned char *mosaic;
    softassign_problem problem;
    softassign_options options;
    int grid[2];
    const common_settings *common;
    float blend;
    const char *folder; /* of the video */
    int frame, frames, failed; /* failed: a frame could not be written */
    common_progress progress;
} studio;

static int draw(studio *s, unsigned char *out, const int *columns)
{
    return softassign_mosaic(out, (ptrdiff_t)s->grid[0] * s->tiles.size * 3, &s->sheet, s->tiles.size, s->tiles.size,
                             columns, s->grid[0], s->grid[1], s->blend > 0 ? &s->target : NULL, s->blend) == SAT_OK;
}

static int write_frame(studio *s, const int *columns)
{
    char path[FILE_PATH];
    if (strlen(s->folder) + 16 > sizeof path) return common_say(s->common, "--video: the path is too long");
    snprintf(path, sizeof path, "%s/%04d.png", s->folder, s->frame++);
    return (draw(s, s->mosaic, columns) || common_say(s->common, "the mosaic cannot be drawn")) &&
           common_save_u8(s->common, path, s->mosaic, s->grid[0] * s->tiles.size, s->grid[1] * s->tiles.size, 3);
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
    printf("cost %.6g, no choice costs less than %.6g: gap %.3g %%, %.0f ms\n", r->cost, r->lower_bound, 100 * r->gap, 1e3 * seconds);
    if (r->conflicts) printf("  %d pairs of equal tiles are too close\n", r->conflicts);
    if (s->common->stats)
        printf("  %zu distances, %zu lists, %zu paths, %zu prices raised back, %.2f MB\n", r->distances_computed, r->lists_built, r->paths,
               r->columns_finished, (double)r->bytes / 1e6);
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
    window.width = s->target.width * 3 / 4;
    result = softassign_create(&solver, s->problem.rows, s->problem.columns, &s->options);
    for (frame = 0; result == SAT_OK && frame < frames; frame++) {
        double start = common_clock();
        int left = (s->target.width - window.width) * frame / (frames > 1 ? frames - 1 : 1);
        window.pixels = (const float *)s->target.pixels + (size_t)left * 3;
        softassign_next_frame(solver);
        result = softassign_features(s->cells, &window, s->grid[0], s->grid[1], PARTS, PARTS, &s->options);
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
    int i, used = 0, ok, width = s->grid[0] * s->tiles.size, height = s->grid[1] * s->tiles.size;
    unsigned char *other = (unsigned char *)malloc((size_t)width * (size_t)height * 3);
    char *seen = (char *)calloc((size_t)s->tiles.count, 1), label[64];
    s->options.capacity_default = s->problem.rows;
    s->options.min_distance = 0;
    s->options.method = SOFTASSIGN_AUTO;
    s->options.progress = NULL;
    ok = other && seen && softassign_solve(s->columns, &s->problem, &s->options, &report) == SAT_OK &&
         draw(s, other, s->columns);
    for (i = 0; ok && i < s->problem.rows; i++) used += !seen[s->columns[i]]++;
    snprintf(label, sizeof label, "best match with repeats: %d tiles", used);
    for (i = 0; i < 2; i++) {
        cells[i].rgb = i ? other : s->mosaic;
        cells[i].label = i ? label : "as asked";
        cells[i].width = width;
        cells[i].height = height;
    }
    if (ok) printf("best match with repeats: cost %.6g, %d different tiles\n", report.cost, used);
    ok = ok && common_contact_sheet(s->common, out, cells, 2, 2);
    free(other);
    free(seen);
    return ok;
}

/* Pictures, tiles and their features; the target is cut to the shape of the grid. */
static sat_result open_studio(studio *s)
{
    int n = s->tiles.size, width = s->picture.width, height = s->picture.height, down;
    sat_result result;
    if ((double)width * s->grid[1] > (double)height * s->grid[0])
        width = (int)((double)height * s->grid[0] / s->grid[1]);
    else height = (int)((double)width * s->grid[1] / s->grid[0]);
    s->target = image_view(&s->picture);
    s->target.pixels = s->picture.pixels + ((size_t)((s->picture.height - height) / 2) * (size_t)s->picture.width +
                                            (size_t)((s->picture.width - width) / 2)) *
                                               3;
    s->target.width = width > 0 ? width : 1;
    s->target.height = height > 0 ? height : 1;
    down = (s->tiles.count + s->tiles.across - 1) / s->tiles.across;
    s->sheet = bytes_view(s->tiles.pixels, s->tiles.across * n, down * n);
    s->problem.rows = s->grid[0] * s->grid[1];
    s->problem.columns = s->tiles.count;
    s->problem.feature_count = FEATURES;
    s->problem.row_features = s->cells = (float *)malloc((size_t)s->problem.rows * FEATURES * sizeof(float));
    s->problem.column_features = s->features =
        (float *)malloc((size_t)(s->tiles.across * down) * FEATURES * sizeof(float));
    s->columns = (int *)malloc((size_t)s->problem.rows * sizeof(int));
    s->mosaic = (unsigned char *)malloc((size_t)s->problem.rows * (size_t)(n * n) * 3);
    if (!s->cells || !s->features || !s->columns || !s->mosaic) return SAT_ERR_MEMORY;
    result = softassign_features(s->features, &s->sheet, s->tiles.across, down, PARTS, PARTS, &s->options);
    if (result != SAT_OK) return result;
    return softassign_features(s->cells, &s->target, s->grid[0], s->grid[1], PARTS, PARTS, &s->options);
}

static void close_studio(studio *s)
{
    free(s->cells);
    free(s->features);
    free(s->columns);
    free(s->mosaic);
    free(s->tiles.pixels);
    image_free(&s->picture);
}

/* Solves, or films, and writes. */
static int work(studio *s, int pan, int both, const char *out)
{
    softassign_stats report;
    double start = common_clock();
    sat_result result = open_studio(s);
    report.row_error = -1;
    if (result == SAT_OK && pan > 0) result = film(s, pan);
    else if (result == SAT_OK) {
        result = softassign_solve(s->columns, &s->problem, &s->options, &report);
        if (result == SAT_OK) print_report(s, &report, common_clock() - start);
    }
    if (s->failed) return 0;
    if (result != SAT_OK) {
        if (report.row_error >= 0)
            fprintf(stderr, "photomosaic: cell %d finds no tile: %d cells, %d tiles\n", report.row_error,
                    s->problem.rows, s->problem.columns);
        else common_say(s->common, sat_result_text(result));
        return 0;
    }
    if (!draw(s, s->mosaic, s->columns)) return common_say(s->common, "the mosaic cannot be drawn");
    return both ? compare(s, out)
                : common_save_u8(s->common, out, s->mosaic, s->grid[0] * s->tiles.size, s->grid[1] * s->tiles.size, 3);
}

int main(int argc, char **argv)
{
    double gap = 0.001, distance = 0, switching = 0;
    int method = 0, capacity = 1, both = 0, pan = 0, seed = 1, iterations = 0, ok;
    const char *target = NULL, *tiles = NULL;
    studio s;
    common_settings common;
    const common_option options[] = {
        {"target", 'P', (void *)&target, 0, 0, "picture to be made; without one it is drawn here"},
        {"tiles", 's', (void *)&tiles, 0, 0, "folder of pictures, or sheets of tiles separated by commas; without them they are drawn"},
        {"tile", 'i', &s.tiles.size, 1, 1024, "side of a tile in pixels"},
        {"grid", 'z', s.grid, 1, 1000, "tiles across and down"},
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
    s.tiles.size = 32;
    s.tiles.across = MADE_ACROSS;
    common_parse(&common, argc, argv, "photomosaic", ".png", options, (int)(sizeof options / sizeof options[0]));
    s.common = s.tiles.common = &common;
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
    if (!(target ? load_display(&s.picture, target) : draw_target(&s.picture)))
        return common_say(&common, s.picture.message), 1;
    if (!(tiles ? load_tiles(&s.tiles, tiles) : draw_tiles(&s.tiles) || common_say(&common, "no memory"))) return 1;
    if (s.folder && !file_make_folder(s.folder)) common_leave(&common, 1, s.folder, strerror(errno));
    ok = work(&s, pan, both, common.out);
    close_studio(&s);
    common_close(&common);
    return !ok;
}
