/* common.h - what the examples share: threads, clock, progress, command line, labels on pictures.
   SPDX-License-Identifier: MIT-0 OR Unlicense

   Every example says the same words for the same options. A program declares its own and gets --threads, --stats, --out
   and --help besides:

       int main(int argc, char **argv)
       {
           float key = 0.18f;
           int local = 0, first;
           common_settings common;
           common_option options[] = {
               {"key", 'f', &key, "middle grey, 0.18"},
               {"local", 'b', &local, "local operator"},
           };
           first = common_parse(&common, argc, argv, "tonemap [options] in.exr out.png", options, 2);
           ... argv[first] is the first argument that is no option ...

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
    char type;           /* f float, i int, s const char *, b int set to 1, z int[2] as in 1280x720 */
    void *value;         /* holds the default */
    const char *help;
} common_option;

typedef struct common_settings {
    int workers;         /* --threads N; 0 = all */
    int stats;           /* --stats */
    const char *out;     /* --out FILE; NULL when not given */
    sat_threads threads; /* ready for use; points into this struct */
} common_settings;

enum { COMMON_MAX_OPTIONS = 48 };

static inline void common_help(const char *usage, const common_option *options, int count)
{
    int i;
    printf("usage: %s\n\n", usage);
    for (i = 0; i < count; ++i) {
        const char *argument = options[i].type == 'b' ? "" : options[i].type == 's' ? " WORD" : options[i].type == 'z' ? " WxH" : " N";
        printf("  --%s%-*s %s\n", options[i].name, 20 - (int)strlen(options[i].name), argument, options[i].help);
    }
}

/* 1 when the text is a value of the option's type and nothing else. */
static inline int common_set(const common_option *option, const char *text)
{
    char *end, rest;
    if (option->type == 'b') *(int *)option->value = 1;
    else if (option->type == 's') *(const char **)option->value = text;
    else if (option->type == 'z') return sscanf(text, "%dx%d%c", (int *)option->value, (int *)option->value + 1, &rest) == 2;
    else if (option->type == 'i') {
        long v = strtol(text, &end, 10);
        if (end == text || *end || v < -2147483647L || v > 2147483647L) return 0;
        *(int *)option->value = (int)v;
    } else {
        double v = strtod(text, &end);
        if (end == text || *end) return 0;
        *(float *)option->value = (float)v;
    }
    return 1;
}

/* The index of the first argument that is no option. Prints help or what is wrong, and leaves the program, by itself. */
static inline int common_parse(common_settings *common, int argc, char **argv, const char *usage,
                               const common_option *options, int count)
{
    common_option all[COMMON_MAX_OPTIONS + 4];
    struct option words[COMMON_MAX_OPTIONS + 5];
    int help = 0, i, found, picked = 0, n = count < COMMON_MAX_OPTIONS ? count : COMMON_MAX_OPTIONS;
    common_option shared[4];
    memset(common, 0, sizeof *common);
    shared[0].name = "out";     shared[0].type = 's'; shared[0].value = (void *)&common->out;  shared[0].help = "file to write";
    shared[1].name = "threads"; shared[1].type = 'i'; shared[1].value = &common->workers;      shared[1].help = "worker threads, all processors";
    shared[2].name = "stats";   shared[2].type = 'b'; shared[2].value = &common->stats;        shared[2].help = "print times and what was left out";
    shared[3].name = "help";    shared[3].type = 'b'; shared[3].value = &help;                 shared[3].help = "this list";
    for (i = 0; i < n; ++i) all[i] = options[i];
    for (i = 0; i < 4; ++i) all[n + i] = shared[i];
    n += 4;
    memset(words, 0, sizeof words);
    for (i = 0; i < n; ++i) {
        words[i].name = all[i].name;
        words[i].has_arg = all[i].type == 'b' ? no_argument : required_argument;
    }
    while ((found = getopt_long(argc, argv, "", words, &picked)) != -1) {
        if (found == '?') exit(2);
        if (!common_set(&all[picked], optarg)) {
            fprintf(stderr, "--%s: \"%s\" is not understood (%s)\n", all[picked].name, optarg, all[picked].help);
            exit(2);
        }
    }
    if (help) {
        common_help(usage, all, n);
        exit(0);
    }
    common->threads = common_threads(&common->workers);
    return optind;
}

/* 1 when the file is there or can be made: better known before a picture is drawn than after. */
static inline int common_can_write(const char *path)
{
    FILE *old = fopen(path, "rb"), *file = old ? old : fopen(path, "wb");
    if (file) fclose(file);
    if (file && !old) remove(path);
    return file != NULL;
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

/* Writes a PNG of all cells, `columns` a row, each under its label: 1, or 0 when there is no memory or no such file. */
static inline int common_contact_sheet(const char *path, const common_cell *cells, int count, int columns)
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
    if (!sheet.rgb) return 0;
    memset(sheet.rgb, 32, (size_t)sheet.width * (size_t)sheet.height * 3);
    for (i = 0; i < count; ++i) {
        int left = GAP + i % columns * (width + GAP), top = GAP + i / columns * (height + GAP + BAR);
        common_text(&sheet, left, top + 3, cells[i].label ? cells[i].label : "", 1);
        for (y = 0; y < cells[i].height; ++y)
            memcpy(sheet.rgb + ((size_t)(top + BAR + y) * (size_t)sheet.width + (size_t)left) * 3,
                   cells[i].rgb + (size_t)y * (size_t)cells[i].width * 3, (size_t)cells[i].width * 3);
    }
    ok = image_save_u8(path, sheet.rgb, sheet.width, sheet.height, 3);
    free(sheet.rgb);
    return ok;
}

#endif /* COMMON_H */
