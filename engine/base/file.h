/* Whole files: read at once, written under a temporary name, flushed, renamed. A reader never sees half a
 * file. */
#ifndef SKIFF_BASE_FILE_H
#define SKIFF_BASE_FILE_H

#include "err.h"

#include <stdint.h>
#include <stdio.h>

/* Reads a whole regular file. *data is malloc'ed, zero-terminated past `size`, owned by the caller (free).
 * ERR_INPUT when it does not exist or is not a regular file, ERR_IO when reading fails, ERR_INPUT when larger
 * than max_size bytes. */
bool file_read(const char *path, size_t max_size, char **data, size_t *size, Err *err);

/* Opens `path`.tmp for writing (binary). file_commit flushes, fsyncs, closes and renames it to `path`;
 * file_abort removes it. ERR_IO when one of these fails, a write before the commit included: no file is left
 * then but an older `path`. */
typedef struct FileWriter {
    FILE *stream;
    char path[4096];
    char temporary[4096];
} FileWriter;

bool file_begin(FileWriter *writer, const char *path, Err *err);
bool file_commit(FileWriter *writer, Err *err);
void file_abort(FileWriter *writer);

/* Writes `size` bytes as one atomic file. ERR_IO. */
bool file_write(const char *path, const void *data, size_t size, Err *err);

/* Creates a directory and its parents; fine when it exists. ERR_IO. */
bool file_make_directory(const char *path, Err *err);
/* Whether files could be written into a directory that is there or could be made. Changes nothing, and cannot
 * know everything: a disk may be full. ERR_IO. */
bool file_check_directory(const char *path, Err *err);
/* Anything of that name. */
bool file_exists(const char *path);

#endif
