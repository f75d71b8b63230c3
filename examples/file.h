/* file.h - files that are written whole or not at all.                SPDX-License-Identifier: MIT-0 OR Unlicense

       file_writer file;
       char why[FILE_MESSAGE];
       if (file_open(&file, "out.png", why)) file_put(&file, bytes, count);
       if (!file_close(&file, 1, why)) { fprintf(stderr, "%s\n", why); return 1; }

   The bytes go into a file beside the named one, which takes its name when all of them are on the disk: a full disk, or
   a program that is stopped, leaves the old file as it was. Symbolic links are followed. What is no plain file (a
   device, a pipe) is written as it is. Needs POSIX, or Windows' C library with its POSIX names (mingw). */

#ifndef FILE_H
#define FILE_H

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/types.h>
#include <unistd.h>
#ifdef _WIN32
#include <io.h>
#endif
#ifndef O_BINARY
#define O_BINARY 0
#endif

enum { FILE_PATH = 1024, FILE_MESSAGE = 320 };

typedef struct file_writer {
    FILE *file;
    int error;                   /* errno of the first call that failed */
    char path[FILE_PATH];        /* of the file itself, links followed */
    char part[FILE_PATH + 40];   /* what is written; "" when that is `path` */
} file_writer;

static inline int file_fail(char *why, const char *path, const char *text)
{
    if (why) snprintf(why, FILE_MESSAGE, "%.180s: %.130s", path, text);
    return 0;
}

/* How many characters of the path are its folder, with the last slash. */
static inline size_t file_folder(const char *path)
{
    size_t n = strlen(path);
    while (n > 0 && path[n - 1] != '/') --n;
    return n;
}

/* "cannot be written" and what the system says */
static inline int file_fail_errno(char *why, const char *path, int error)
{
    char text[130], folder[FILE_PATH];
    struct stat s;
    snprintf(folder, sizeof folder, "%.*s.", (int)file_folder(path), path);
    snprintf(text, sizeof text, "cannot be written: %.100s",
             error != ENOENT    ? strerror(error)
             : stat(folder, &s) ? "there is no such folder"
                                : "files cannot be made in this folder");
    return file_fail(why, path, text);
}

/* The path of what the symbolic links at its end lead to, there or not: 0 when they lead nowhere or the path is too
   long. */
static inline int file_follow(char *out, const char *path)
{
    size_t n = strlen(path);
    if (n == 0 || n >= FILE_PATH) return 0;
    memcpy(out, path, n + 1);
#ifndef _WIN32
    {
        int steps;
        for (steps = 0; steps < 32; ++steps) {
            char target[FILE_PATH];
            ssize_t length = readlink(out, target, sizeof target - 1);
            size_t folder = length > 0 && target[0] != '/' ? file_folder(out) : 0;
            if (length < 0) return 1;
            if (folder + (size_t)length >= FILE_PATH) return 0;
            memcpy(out + folder, target, (size_t)length);
            out[folder + (size_t)length] = 0;
        }
        return 0;
    }
#else
    return 1;
#endif
}

/* What is the same for all paths and links to a file and for no other one: 1, or 0 when it is not there. */
typedef struct file_id { unsigned long long volume, number; } file_id;

static inline int file_identify(file_id *id, const char *path)
{
    struct stat s;
    if (stat(path, &s)) return 0;
#ifdef _WIN32
    {
        char full[FILE_PATH];
        int i;
        if (!_fullpath(full, path, FILE_PATH)) return 0;
        id->volume = 0, id->number = 14695981039346656037ull; /* FNV-1a of the whole path */
        for (i = 0; full[i]; ++i)
            id->number = (id->number ^ (unsigned char)(full[i] >= 'A' && full[i] <= 'Z' ? full[i] + 32 : full[i])) *
                         1099511628211ull;
    }
#else
    id->volume = (unsigned long long)s.st_dev, id->number = (unsigned long long)s.st_ino;
#endif
    return 1;
}

static inline int file_make_folder(const char *path)
{
#ifdef _WIN32
    return mkdir(path) == 0 || errno == EEXIST;
#else
    return mkdir(path, 0777) == 0 || errno == EEXIST;
#endif
}

/* 1, or 0 with a sentence (FILE_MESSAGE bytes, or NULL); file_close must follow in either case. */
static inline int file_open(file_writer *f, const char *path, char *why)
{
    struct stat old;
    int there, fd = -1, i;
    memset(f, 0, sizeof *f);
    f->error = EINVAL;
    if (path[0] == 0) return file_fail(why, "\"\"", "is no name of a file");
    if (!file_follow(f->path, path)) return file_fail(why, path, "cannot be written: the path is too long, or a link that leads to itself");
    there = stat(f->path, &old) == 0;
    if (there && S_ISDIR(old.st_mode)) return file_fail(why, path, "is a folder");
    if (there && !S_ISREG(old.st_mode)) fd = open(f->path, O_WRONLY | O_BINARY);
    else if (!there || access(f->path, W_OK) == 0) {
        for (i = 0; i < 10000 && fd < 0; ++i) {
            snprintf(f->part, sizeof f->part, "%.*s.lightscan_%d.part", (int)file_folder(f->path), f->path, i);
            fd = open(f->part, O_WRONLY | O_CREAT | O_EXCL | O_BINARY, 0666);
            if (fd < 0 && errno != EEXIST) break;
        }
        if (fd >= 0 && there) chmod(f->part, old.st_mode & 0777);
    }
    f->error = errno;
    if (fd < 0) f->part[0] = 0;
    if (fd >= 0) f->file = fdopen(fd, "wb");
    if (!f->file) return file_fail_errno(why, path, f->error);
    f->error = 0;
    return 1;
}

static inline void file_put(file_writer *f, const void *bytes, size_t count)
{
    if (f->error || count == 0) return;
    errno = 0;
    if (fwrite(bytes, 1, count, f->file) != count) f->error = errno ? errno : EIO;
}

/* Moves to a byte, for formats that go back. */
static inline void file_seek(file_writer *f, long at)
{
    if (!f->error && fseek(f->file, at, SEEK_SET)) f->error = errno;
}

/* Gives the file its name when all went well and keep is 1; otherwise nothing is left: 1, or 0 with a sentence. After a
   file_open that failed it returns 0 and leaves the sentence. */
static inline int file_close(file_writer *f, int keep, char *why)
{
    if (!f->file) return 0;
    errno = 0;
    if (fflush(f->file) && !f->error) f->error = errno ? errno : EIO;
    if (fclose(f->file) && !f->error) f->error = errno ? errno : EIO;
    f->file = NULL;
    if (f->part[0] && keep && !f->error) {
#ifdef _WIN32 /* where rename does not replace */
        remove(f->path);
#endif
        if (rename(f->part, f->path)) f->error = errno;
    }
    if (f->part[0] && (!keep || f->error)) remove(f->part);
    return f->error ? file_fail_errno(why, f->path, f->error) : 1;
}

/* 1 when the file could be written, or 0 with a sentence: better known before a picture is drawn than after. */
static inline int file_can_write(const char *path, char *why)
{
    file_writer f;
    return file_open(&f, path, why) && file_close(&f, 0, why);
}

/* All bytes of a file, to be freed: NULL with a sentence when it cannot be read. */
static inline unsigned char *file_read(const char *path, size_t *size, char *why)
{
    FILE *file = fopen(path, "rb");
    unsigned char *bytes = NULL;
    size_t room = 0, n;
    *size = 0;
    if (!file)
        return file_fail(why, path, errno == ENOENT ? "cannot be opened: there is no such file" : strerror(errno)),
               (unsigned char *)NULL;
    errno = 0;
    do {
        if (*size == room) {
            unsigned char *more;
            room = room ? 2 * room : 1 << 16;
            more = (unsigned char *)realloc(bytes, room);
            if (!more) {
                free(bytes);
                fclose(file);
                return file_fail(why, path, "is too large for the memory"), (unsigned char *)NULL;
            }
            bytes = more;
        }
        n = fread(bytes + *size, 1, room - *size, file);
        *size += n;
    } while (n > 0);
    if (ferror(file)) {
        file_fail(why, path, errno == EISDIR ? "is a folder" : strerror(errno));
        free(bytes);
        bytes = NULL;
    }
    fclose(file);
    return bytes;
}

#endif /* FILE_H */
