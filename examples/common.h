/* common.h - what the examples share: threads, clock, progress, command line, labels on pictures.
   SPDX-License-Identifier: MIT-0 OR Unlicense

   Every example has the same command line: arguments without a name are inputs, the output is -o or --out FILE (behind
   a single input it may stand without), and without that out/PROGRAM.png; its path is printed. A program declares its
   own options in a table, with their defaults and ranges, and gets --out, --threads, --stats and --help besides:

       int main(int argc, char **argv)
       {
           float key = 0.18f;
           const char *in = NULL;
           int local = 0;
           common_settings common;
           const common_option options[] = {
               {"in", 'P', (void *)&in, 0, 0, "picture to read; may stand without --in"},
               {"key", 'f', &key, 0, 10, "middle grey"},
               {"local", 'b', &local, 0, 0, "local operator"},
           };
           common_parse(&common, argc, argv, "tonemap", ".png", options, 3);
           ... common_save_u8(&common, common.out, pixels, width, height, 3) ...

   A value out of its range, an unknown ending, an output that is also an input, or one that cannot be written, ends the
   program with a sentence before anything is computed.

   Build with -fopenmp for threads; without it everything is serial. Define _POSIX_C_SOURCE 200809L under -std=c99. */

#ifndef COMMON_H
#define COMMON_H

#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#ifdef _OPENMP
#include <omp.h>
#endif
#include "../sat.h"
#include "image.h"

/* ---- time ---- */

/* seconds since some moment */
static inline double common_clock(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* A line on stderr for work that takes longer than a second. Start with a zeroed common_progress and call often;
   done == total ends the line. */
typedef struct common_progress { double start, last; } common_progress;

static inline void common_show_progress(common_progress *p, const char *what, double done, double total)
{
    double now = common_clock();
    if (p->start == 0.0) p->start = p->last = now;
    if (now - p->start < 1.0 || (now - p->last < 0.2 && done < total)) return;
    p->last = now;
    fprintf(stderr, "\r%s: %3.0f %%, %.0f s ", what, total > 0 ? 100.0 * done / total : 100.0, now - p->start);
    if (done >= total) fputc('\n', stderr);
    fflush(stderr);
}

/* ---- threads: the hook of sat_threads on OpenMP ---- */

#ifdef _OPENMP
static inline void common_parallel_for(int count, sat_range_fn *body, void *context, void *user)
{
    int workers = *(const int *)user, piece = count / (4 * workers) + 1, pieces = (count + piece - 1) / piece, i;
#pragma omp parallel for num_threads(workers) schedule(dynamic, 1)
    for (i = 0; i < pieces; ++i)
        body(i * piece, count - i * piece > piece ? (i + 1) * piece : count, omp_get_thread_num(), context);
}
#endif

/* 0 workers: one for each processor. The count must stay where it is as long as the result is used. */
static inline sat_threads common_threads(int *workers)
{
    sat_threads t;
    memset(&t, 0, sizeof t);
#ifdef _OPENMP
    if (*workers < 1) *workers = omp_get_num_procs();
    if (*workers > 64) *workers = 64;
    t.parallel_for = common_parallel_for;
#else
    *workers = 1;
#endif
    t.workers = *workers;
    t.user = workers;
    return t;
}

/* ---- command line ---- */

typedef struct common_option {
    const char *name;
    char type;           /* f float, d double, i int, z int[2] as in 1280x720, m float with or without "mm" behind it;
                            b int set to 1, s const char *, w int: which word of `help`, that begins with
                            "one|two|three"; P, M const char *: path of a picture, of a mesh, that may stand without the
                            option's name */
    void *value;         /* holds the default; what P, M and s point to may be NULL */
    double low, high;    /* of f d i z m; high = INFINITY: no limit */
    const char *help;
} common_option;

typedef struct common_settings {
    const char *name;    /* of the program */
    int workers;         /* --threads N; 0 = all */
    int stats;           /* --stats */
    const char *out;     /* -o, --out FILE, or a last argument, or out/NAME.png; NULL only where there is no default */
    const char *writes;  /* the endings that can be written, ".png .exr" */
    sat_threads threads; /* ready for use; points into this struct */
    char default_out[80];
    file_id *inputs;     /* files that were read: nothing may be written over them */
    int input_count, input_room;
} common_settings;

enum { COMMON_MAX_OPTIONS = 48 };

/* "tonemap: sentence" on stderr; returns 0. */
static inline int common_say(const common_settings *common, const char *sentence)
{
    fprintf(stderr, "%s: %s\n", common->name, sentence);
    return 0;
}

/* What a library call said, or better the sentence of the header's explain function; returns 0. */
static inline int common_say_result(const common_settings *common, const char *what, sat_result result,
                                    const char *explained)
{
    fprintf(stderr, "%s: %s: %s\n", common->name, what, explained && *explained ? explained : sat_result_text(result));
    return 0;
}

/* The same about a path or an option, and the end of the program. */
static inline void common_leave(const common_settings *common, int status, const char *about, const char *sentence)
{
    fprintf(stderr, "%s: %s%s%s\n", common->name, about, *about ? ": " : "", sentence);
    exit(status);
}

static inline void common_number(char *text, size_t size, double v)
{
    snprintf(text, size, v == floor(v) && fabs(v) < 1e15 ? "%.0f" : "%.7g", v);
}

/* "one|two|three words" becomes "one, two or three". */
static inline void common_words(char *text, size_t size, const char *words)
{
    size_t end = strcspn(words, " "), last = end, i, used = 0;
    for (i = 0; i < end; ++i)
        if (words[i] == '|') last = i;
    for (i = 0; i < end && used + 5 < size; ++i) {
        if (words[i] == '|') used += (size_t)sprintf(text + used, i == last ? " or " : ", ");
        else text[used++] = words[i];
    }
    text[used] = 0;
}

/* "must be 1 to 8" and the like. */
static inline void common_range(char *text, size_t size, const common_option *o)
{
    char low[32], high[32], words[128];
    common_number(low, sizeof low, o->low);
    common_number(high, sizeof high, o->high);
    common_words(words, sizeof words, o->help);
    if (o->type == 'w') snprintf(text, size, "must be %s", words);
    else if (o->type == 'z') snprintf(text, size, "must be %sx%s to %sx%s", low, low, high, high);
    else if (o->high > 1e30) snprintf(text, size, "must be a number of at least %s", low);
    else snprintf(text, size, "must be %s%s to %s", o->type == 'i' ? "" : "a number from ", low, high);
}

/* The default as it would be typed, "" for none. */
static inline void common_default(char *text, size_t size, const common_option *o)
{
    const int *i = (const int *)o->value;
    const char *word = o->help;
    int k;
    text[0] = 0;
    if (o->type == 'f' || o->type == 'm') common_number(text, size, (double)*(const float *)o->value);
    else if (o->type == 'd') common_number(text, size, *(const double *)o->value);
    else if (o->type == 'i') snprintf(text, size, "%d", *i);
    else if (o->type == 'z') snprintf(text, size, "%dx%d", i[0], i[1]);
    else if (o->type == 'w') {
        for (k = 0; k < *i; ++k) word += strcspn(word, "| ") + 1;
        snprintf(text, size, "%.*s", (int)strcspn(word, "| "), word);
    } else if (o->type != 'b' && *(const char *const *)o->value)
        snprintf(text, size, "%s", *(const char *const *)o->value);
}

static inline void common_help(const char *name, const common_option *options, int count, int inputs)
{
    int i;
    printf("usage: %s [options]", name);
    for (i = 0; i < count; ++i)
        if (options[i].type == 'P' || options[i].type == 'M')
            printf(" [%s]", options[i].type == 'P' ? "PICTURE" : "MESH");
    printf("%s\n\n", inputs == 1 ? " [OUT]" : "");
    for (i = 0; i < count; ++i) {
        const common_option *o = &options[i];
        const char *argument = o->type == 'b'            ? ""
                               : o->type == 'z'          ? " WxH"
                               : strchr("fdim", o->type) ? " N"
                               : o->type == 'w'          ? " WORD"
                                                         : " FILE";
        char value[80], range[160];
        common_default(value, sizeof value, o);
        common_range(range, sizeof range, o);
        printf("  --%s%-*s %s", o->name, 20 - (int)strlen(o->name), argument, o->help);
        if (value[0]) printf(" (%s", value);
        if (value[0]) printf(strchr("fdimz", o->type) ? "; %s)" : ")", range + 8);
        putchar('\n');
    }
}

/* 1 when the text is a value of the option's type, in its range, and nothing else. */
static inline int common_set(const common_option *o, const char *text)
{
    char *end, rest;
    int *i = (int *)o->value;
    if (o->type == 'b') return *i = 1;
    if (o->type == 's' || o->type == 'P' || o->type == 'M') return *(const char **)o->value = text, 1;
    if (o->type == 'w') {
        const char *word = o->help;
        size_t n = strlen(text);
        int k;
        for (k = 0; *word && *word != ' '; ++k, word += *word == '|') {
            size_t length = strcspn(word, "| ");
            if (length == n && strncmp(word, text, n) == 0) return *i = k, 1;
            word += length;
        }
        return 0;
    }
    if (o->type == 'z') {
        int v[2];
        if (sscanf(text, "%9dx%9d%c", &v[0], &v[1], &rest) != 2 || v[0] < o->low || v[1] < o->low || v[0] > o->high || v[1] > o->high) return 0;
        return i[0] = v[0], i[1] = v[1], 1;
    }
    if (o->type == 'i') {
        long v = strtol(text, &end, 10);
        if (end == text || *end || (double)v < o->low || (double)v > o->high) return 0;
        return *i = (int)v, 1;
    } else {
        double v = strtod(text, &end);
        if (o->type == 'm' && strcmp(end, "mm") == 0) end += 2;
        if (end == text || *end || !(v >= o->low && v <= o->high)) return 0;
        if (o->type == 'd') *(double *)o->value = v;
        else *(float *)o->value = (float)v;
    }
    return 1;
}

/* ---- inputs and outputs ---- */

static inline int common_is_picture(const char *path)
{
    return image_ends_with(path, ".exr") || image_ends_with(path, ".hdr") || image_ends_with(path, ".pfm") ||
           image_ends_with(path, ".png") || image_ends_with(path, ".jpg") || image_ends_with(path, ".jpeg");
}

static inline int common_is_mesh(const char *path)
{
    return image_ends_with(path, ".ply") || image_ends_with(path, ".obj");
}

/* 1 when the path ends with one of the endings, ".png .exr". */
static inline int common_ends_with(const char *path, const char *endings)
{
    char ending[8];
    size_t n;
    for (; *endings; endings += n + (endings[n] == ' ')) {
        n = strcspn(endings, " ");
        snprintf(ending, sizeof ending, "%.*s", (int)n, endings);
        if (image_ends_with(path, ending)) return 1;
    }
    return 0;
}

/* A sentence on why the path is no output, or NULL: its ending, or that it was read. */
static inline const char *common_refuses(char *text, size_t size, const common_settings *common, const char *path)
{
    file_id id;
    int i;
    if (!common_ends_with(path, common->writes)) {
        const char *name = path + file_folder(path), *dot = strrchr(name, '.');
        if (dot) snprintf(text, size, "%s is not among the formats that can be written: %s", dot, common->writes);
        else snprintf(text, size, "has no ending that says what to write: %s", common->writes);
        return text;
    }
    for (i = 0; file_identify(&id, path) && i < common->input_count; ++i)
        if (common->inputs[i].volume == id.volume && common->inputs[i].number == id.number)
            return "is one of the files that are read";
    return NULL;
}

/* Notes that this file is read: from here on nothing is written over it. 0, with a sentence, when it is the output. */
static inline int common_read(common_settings *common, const char *path)
{
    char text[160];
    const char *why;
    if (common->input_count == common->input_room) {
        int room = common->input_room ? 2 * common->input_room : 16;
        file_id *more = (file_id *)realloc(common->inputs, (size_t)room * sizeof *more);
        if (!more) return common_say(common, "no memory");
        common->inputs = more, common->input_room = room;
    }
    if (!file_identify(&common->inputs[common->input_count], path)) return 1; /* opening it will say so */
    ++common->input_count;
    why = common->out ? common_refuses(text, sizeof text, common, common->out) : NULL;
    if (why) fprintf(stderr, "%s: %s: %s\n", common->name, common->out, why);
    return !why;
}

/* 1, and the path on stdout, when `ok` says that the file was written; the sentence otherwise. */
static inline int common_wrote(const common_settings *common, const char *path, int ok, const char *why)
{
    if (!ok) return common_say(common, why);
    printf("%s\n", path);
    return fflush(stdout) == 0;
}

/* 1 when the path may be written, or 0 with a sentence on stderr. */
static inline int common_may_write(const common_settings *common, const char *path)
{
    char text[160];
    const char *why = common_refuses(text, sizeof text, common, path);
    if (why) fprintf(stderr, "%s: %s: %s\n", common->name, path, why);
    return !why;
}

/* A PNG of 8-bit pixels. */
static inline int common_save_u8(const common_settings *common, const char *path, const unsigned char *bytes, int width,
                                 int height, int channels)
{
    char why[FILE_MESSAGE];
    return common_may_write(common, path) &&
           common_wrote(common, path, image_save_u8(why, path, bytes, width, height, channels), why);
}

/* Floats in the format that the ending says. */
static inline int common_save(const common_settings *common, const char *path, image *picture)
{
    return common_may_write(common, path) && common_wrote(common, path, image_save(picture, path), picture->message);
}

/* "out/rain.png" and "_0003" make "out/rain_0003.png": 1, or 0 with a sentence when that is too long. */
static inline int common_path(const common_settings *common, char out[FILE_PATH], const char *path, const char *more)
{
    const char *dot = strrchr(path, '.');
    size_t stem = dot && (size_t)(dot - path) >= file_folder(path) ? (size_t)(dot - path) : strlen(path);
    if (strlen(path) + strlen(more) >= FILE_PATH) return common_say(common, "the path to write to is too long");
    memcpy(out, path, stem);
    strcpy(out + stem, more);
    strcat(out, path + stem);
    return 1;
}

/* An argument without a name: the next picture or mesh, or behind a single input the output. */
static inline void common_argument(common_settings *common, const common_option *options, int count, int inputs,
                                   const char *path)
{
    const char *type = common_is_picture(path) ? "P" : common_is_mesh(path) ? "M" : "", *first = NULL;
    int i, takes[2] = {0, 0};
    file_id id, own;
    for (i = 0; i < count; ++i) {
        if (options[i].type != 'P' && options[i].type != 'M') continue;
        ++takes[options[i].type == 'M'];
        if (*(const char **)options[i].value) first = *(const char **)options[i].value;
        else if (*type == options[i].type) {
            *(const char **)options[i].value = path;
            return;
        }
    }
    if (inputs == 1 && first && !common->out) {
        const char *dot = strrchr(first, '.');
        if (file_identify(&id, path) && file_identify(&own, first) && id.volume == own.volume &&
            id.number == own.number)
            common_leave(common, 2, path, "is the input");
        if (dot && image_ends_with(path, dot) && file_identify(&id, path))
            common_leave(common, 2, path, "is there already and looks like another input; to write over it say --out");
        common->out = path;
    } else if (inputs == 0 || (*type && takes[*type == 'M'])) common_leave(common, 2, path, "is one argument too many");
    else if (takes[0] && takes[1]) common_leave(common, 2, path, "is neither a picture (.exr .hdr .pfm .png .jpg) nor a mesh (.ply .obj); the output is named by --out");
    else common_leave(common, 2, path, takes[0] ? "is no picture (.exr .hdr .pfm .png .jpg); the output is named by --out"
                                                : "is no mesh (.ply .obj); the output is named by --out");
}

/* Where the output goes: checked before anything is computed. */
static inline void common_open(common_settings *common, const common_option *options, int count, int optional)
{
    char why[FILE_MESSAGE];
    int i;
    if (!common->out && !optional) {
        snprintf(common->default_out, sizeof common->default_out, "out/%s.png", common->name);
        common->out = common->default_out;
        file_make_folder("out");
    }
    if (common->out && !common_may_write(common, common->out)) exit(2);
    for (i = 0; i < count; ++i) {
        const char *path = options[i].type == 'P' || options[i].type == 'M' ? *(const char **)options[i].value : NULL;
        if (path && !common_read(common, path)) exit(2);
    }
    if (common->out && !file_can_write(common->out, why)) common_leave(common, 1, "", why);
}

/* Reads the command line into the options' values. Prints help or what is wrong, and leaves the program, by itself.
   writes: the endings of what can be written; with a '?' in front the program writes only when --out asks for it. */
static inline void common_parse(common_settings *common, int argc, char **argv, const char *name, const char *writes,
                                const common_option *options, int count)
{
    const common_option shared[4] = {
        {"out", 's', (void *)&common->out, 0, 0, "file to write; -o for short"},
        {"threads", 'i', &common->workers, 0, 64, "worker threads; 0: as many as there are processors"},
        {"stats", 'b', &common->stats, 0, 0, "print times and what was left out"},
        {"help", 'b', NULL, 0, 0, "this list"}};
    common_option all[COMMON_MAX_OPTIONS + 4];
    struct option words[COMMON_MAX_OPTIONS + 5];
    int i, found, picked = 0, inputs = 0, n = count < COMMON_MAX_OPTIONS ? count : COMMON_MAX_OPTIONS;
    memset(common, 0, sizeof *common);
    memset(words, 0, sizeof words);
    common->name = name;
    common->writes = writes + (writes[0] == '?');
    for (i = 0; i < n; ++i) all[i] = options[i], inputs += options[i].type == 'P' || options[i].type == 'M';
    for (i = 0; i < 4; ++i) all[n + i] = shared[i];
    for (i = 0; i < n + 4; ++i) {
        words[i].name = all[i].name;
        words[i].has_arg = all[i].type == 'b' ? no_argument : required_argument;
    }
    while ((found = getopt_long(argc, argv, "o:h", words, &picked)) != -1) {
        if (found == '?') exit(2);
        if (found == 'o') picked = n;
        if (found == 'h' || picked == n + 3) {
            common_help(name, all, n + 4, inputs);
            printf("\nwrites %s; without --out %s%s%s\n", common->writes, writes[0] == '?' ? "nothing" : "out/",
                   writes[0] == '?' ? "" : name, writes[0] == '?' ? "" : ".png");
            exit(0);
        }
        if (!common_set(&all[picked], optarg)) {
            char range[160];
            common_range(range, sizeof range, &all[picked]);
            fprintf(stderr, "%s: --%s %s: %s\n", name, all[picked].name, optarg, range);
            exit(2);
        }
    }
    for (i = optind; i < argc; ++i) common_argument(common, all, n, inputs, argv[i]);
    common_open(common, all, n, writes[0] == '?');
    common->threads = common_threads(&common->workers);
}

static inline void common_close(common_settings *common)
{
    free(common->inputs);
    common->inputs = NULL;
    common->input_count = common->input_room = 0;
}

/* ---- labels and contact sheets: 8-bit RGB ---- */

typedef struct common_canvas { unsigned char *rgb; int width, height; } common_canvas;

/* The letters from blank to ~, 7 rows of 5 bits, each row a digit in base 32 (0-9, A-V). */
static inline int common_letter_row(char letter, int row)
{
    static const char rows[] =
        "0000000" "4444404" "AA00000" "AVAAVA0" "EH16404" "PQ48M60" "CICLID0" "4400000" "2488842" "8422248"
        "0LEL000" "044V440" "0000648" "000V000" "00000CC" "122488G" "EHJLPHE" "4CK444V" "EH168GV" "U11E11U"
        "IIIV222" "VGU11HE" "EGGUHHE" "V122444" "EHHEHHE" "EHHF11E" "0CC0CC0" "0CC0C48" "16O6100" "00V0V00"
        "GC3CG00" "EH16404" "EHNLNGE" "4AHHVHH" "UHHUHHU" "FGGGGGF" "UHHHHHU" "VGGUGGV" "VGGUGGG" "FGGJHHF"
        "HHHVHHH" "E44444E" "71111HE" "HIKOKIH" "GGGGGGV" "HRLLHHH" "HPPLJJH" "EHHHHHE" "UHHUGGG" "EHHHLID"
        "UHHUKIH" "FGGE11U" "V444444" "HHHHHHE" "HHHAA44" "HHHLLRH" "HAA4AAH" "HHA4444" "V1248GV" "E88888E"
        "EH16404" "E22222E" "EH16404" "000000V" "EH16404" "00E1FHF" "GGUHHHU" "00FGGGF" "11FHHHF" "00EHVGF"
        "68U8888" "00FHF1E" "GGUHHHH" "40C444E" "206222C" "GGIKSIH" "C44444E" "00ULLLL" "00UHHHH" "00EHHHE"
        "00UHUGG" "00FHF11" "00MPGGG" "00FGE1U" "88U8886" "00HHHHF" "00HHAA4" "00HLLLA" "00HA4AH" "00HHF1E"
        "00V248V" "EH16404" "4444444" "EH16404" "009LI00";
    char digit = letter >= ' ' && letter <= '~' ? rows[7 * (letter - ' ') + row] : '0';
    return digit <= '9' ? digit - '0' : digit - 'A' + 10;
}

/* White text; a letter takes 6 x 8 dots of scale x scale pixels. What lies outside is cut. */
static inline void common_text(common_canvas *canvas, int left, int top, const char *text, int scale)
{
    int i, x, y;
    for (i = 0; text[i]; ++i)
        for (y = 0; y < 7 * scale; ++y)
            for (x = 0; x < 5 * scale; ++x) {
                int px = left + (6 * i) * scale + x, py = top + y;
                if (px < 0 || py < 0 || px >= canvas->width || py >= canvas->height) continue;
                if (common_letter_row(text[i], y / scale) >> (4 - x / scale) & 1)
                    memset(canvas->rgb + ((size_t)py * (size_t)canvas->width + (size_t)px) * 3, 255, 3);
            }
}

typedef struct common_cell { const unsigned char *rgb; int width, height; const char *label; } common_cell;

/* Writes a PNG of all cells, `columns` a row, each under its label: 1, or 0 with a sentence on stderr. */
static inline int common_contact_sheet(const common_settings *common, const char *path, const common_cell *cells,
                                       int count, int columns)
{
    enum { GAP = 4, BAR = 14 };
    common_canvas sheet;
    int width = 0, height = 0, i, y, ok;
    if (count < 1 || columns < 1) return 0;
    if (columns > count) columns = count;
    for (i = 0; i < count; ++i) {
        if (cells[i].width > width) width = cells[i].width;
        if (cells[i].height > height) height = cells[i].height;
    }
    sheet.width = columns * (width + GAP) + GAP;
    sheet.height = (count + columns - 1) / columns * (height + GAP + BAR) + GAP;
    sheet.rgb = (unsigned char *)malloc((size_t)sheet.width * (size_t)sheet.height * 3);
    if (!sheet.rgb) return common_say(common, "no memory");
    memset(sheet.rgb, 32, (size_t)sheet.width * (size_t)sheet.height * 3);
    for (i = 0; i < count; ++i) {
        int left = GAP + i % columns * (width + GAP), top = GAP + i / columns * (height + GAP + BAR);
        common_text(&sheet, left, top + 3, cells[i].label ? cells[i].label : "", 1);
        for (y = 0; y < cells[i].height; ++y)
            memcpy(sheet.rgb + ((size_t)(top + BAR + y) * (size_t)sheet.width + (size_t)left) * 3,
                   cells[i].rgb + (size_t)y * (size_t)cells[i].width * 3, (size_t)cells[i].width * 3);
    }
    ok = common_save_u8(common, path, sheet.rgb, sheet.width, sheet.height, 3);
    free(sheet.rgb);
    return ok;
}

#endif /* COMMON_H */
