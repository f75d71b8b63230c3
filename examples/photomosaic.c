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
#define SAT_IMPLEMENTATION
#define SOFTASSIGN_IMPLEMENTATION
#include "../softassign.h"
#include "common.h"
#include "png_strips.h"
#include "tile_set.h"

enum { STRIP_BYTES = 16 << 20, LIST_BYTES = 256000000 };

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
