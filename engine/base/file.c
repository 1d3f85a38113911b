/* Whole files in and out. Written files appear by rename only; the folder entry itself is not synced, since
 * after a power cut the old file is as good an answer as the new one. */
#include "file.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Reads an open file to its end. Its reported size is a first guess only: files of /proc report 0, others may
 * grow. */
static bool read_all(int fd, const char *path, size_t guess, size_t max_size, char **data, size_t *size,
                     Err *err) {
    /* One byte for the terminator, one so that the read that finds the end has room. */
    size_t capacity = guess + 2, length = 0;
    char *bytes = malloc(capacity);
    while (bytes) {
        ssize_t n = read(fd, bytes + length, capacity - 1 - length);
        if (n == 0)
            break;
        if (n < 0 && errno != EINTR) {
            int fault = errno;
            free(bytes);
            return err_set(err, ERR_IO, "%s: cannot read: %s", path, strerror(fault));
        }
        length += n > 0 ? (size_t)n : 0;
        if (length > max_size) {
            free(bytes);
            return err_set(err, ERR_INPUT, "%s: larger than %zu bytes", path, max_size);
        }
        if (length + 1 == capacity) {
            char *grown = realloc(bytes, 2 * capacity + 4096);
            if (!grown)
                free(bytes);
            capacity = 2 * capacity + 4096;
            bytes = grown;
        }
    }
    if (!bytes)
        return err_set(err, ERR_IO, "%s: not enough memory to read it", path);
    bytes[length] = '\0';
    *data = bytes;
    *size = length;
    return true;
}

bool file_read(const char *path, size_t max_size, char **data, size_t *size, Err *err) {
    /* Not blocking: a pipe without a writer must be refused below, not waited for. */
    int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (fd < 0) {
        bool absent = errno == ENOENT || errno == ENOTDIR || errno == ENAMETOOLONG || errno == ELOOP;
        return err_set(err, absent ? ERR_INPUT : ERR_IO, "%s: cannot open: %s", path, strerror(errno));
    }
    struct stat status;
    bool ok;
    if (fstat(fd, &status) != 0)
        ok = err_set(err, ERR_IO, "%s: cannot read: %s", path, strerror(errno));
    else if (!S_ISREG(status.st_mode))
        ok = err_set(err, ERR_INPUT, "%s: %s", path,
                     S_ISDIR(status.st_mode) ? "is a directory" : "is not a regular file");
    else if ((uint64_t)status.st_size > max_size)
        ok = err_set(err, ERR_INPUT, "%s: %lld bytes, larger than %zu bytes", path, (long long)status.st_size,
                     max_size);
    else
        ok = read_all(fd, path, (size_t)status.st_size, max_size, data, size, err);
    close(fd);
    return ok;
}

bool file_begin(FileWriter *writer, const char *path, Err *err) {
    writer->stream = NULL;
    size_t length = strlen(path);
    struct stat status;
    if (length == 0)
        return err_set(err, ERR_IO, "cannot write a file without a name");
    if (length + sizeof ".tmp" > sizeof writer->temporary)
        return err_set(err, ERR_IO, "%.64s...: cannot write: %s", path, strerror(ENAMETOOLONG));
    if (path[length - 1] == '/' || (stat(path, &status) == 0 && S_ISDIR(status.st_mode)))
        return err_set(err, ERR_IO, "%s: cannot write: %s", path, strerror(EISDIR));
    memcpy(writer->path, path, length + 1);
    memcpy(writer->temporary, path, length);
    memcpy(writer->temporary + length, ".tmp", sizeof ".tmp");
    writer->stream = fopen(writer->temporary, "wbe");
    if (!writer->stream)
        return err_set(err, ERR_IO, "%s: cannot write: %s", path, strerror(errno));
    return true;
}

bool file_commit(FileWriter *writer, Err *err) {
    FILE *stream = writer->stream;
    writer->stream = NULL;
    /* A write that failed earlier left its mark on the stream but not in errno. */
    int fault = ferror(stream) ? EIO : 0;
    if (fflush(stream) != 0)
        fault = errno;
    /* EINVAL: what the name leads to cannot be synced (a device); its data is out all the same. */
    if (!fault && fsync(fileno(stream)) != 0 && errno != EINVAL)
        fault = errno;
    if (fclose(stream) != 0 && !fault)
        fault = errno;
    if (!fault && rename(writer->temporary, writer->path) != 0)
        fault = errno;
    if (!fault)
        return true;
    unlink(writer->temporary);
    return err_set(err, ERR_IO, "%s: cannot write: %s", writer->path, strerror(fault));
}

void file_abort(FileWriter *writer) {
    if (!writer->stream)
        return;
    fclose(writer->stream);
    writer->stream = NULL;
    unlink(writer->temporary);
}

bool file_write(const char *path, const void *data, size_t size, Err *err) {
    FileWriter writer;
    if (!file_begin(&writer, path, err))
        return false;
    if (size > 0 && fwrite(data, 1, size, writer.stream) != size) {
        int fault = errno;
        file_abort(&writer);
        return err_set(err, ERR_IO, "%s: cannot write: %s", path, strerror(fault));
    }
    return file_commit(&writer, err);
}

/* One level. Fine when a directory, or a link to one, is already there. */
static bool make_one(const char *path) {
    struct stat status;
    if (mkdir(path, 0777) == 0)
        return true;
    int fault = errno;
    if (stat(path, &status) == 0) {
        if (S_ISDIR(status.st_mode))
            return true;
        fault = ENOTDIR;
    }
    errno = fault;
    return false;
}

bool file_make_directory(const char *path, Err *err) {
    char part[4096];
    size_t length = strlen(path);
    if (length == 0)
        return err_set(err, ERR_IO, "cannot make a directory without a name");
    if (length >= sizeof part)
        return err_set(err, ERR_IO, "%.64s...: cannot make directory: %s", path, strerror(ENAMETOOLONG));
    memcpy(part, path, length + 1);
    for (size_t i = 1; i <= length; i++) {
        if (part[i] != '/' && part[i] != '\0')
            continue;
        char end = part[i];
        part[i] = '\0';
        if (!make_one(part))
            return err_set(err, ERR_IO, "%s: cannot make directory: %s", part, strerror(errno));
        part[i] = end;
    }
    return true;
}

bool file_check_directory(const char *path, Err *err) {
    char part[4096];
    struct stat status = {0};
    size_t length = strlen(path);
    if (length == 0 || length >= sizeof part)
        return err_set(err, ERR_IO, "%.64s...: cannot make directory: %s", path,
                       strerror(length == 0 ? ENOENT : ENAMETOOLONG));
    memcpy(part, path, length + 1);
    /* down to what is there */
    while (stat(part, &status) != 0 && strcmp(part, ".") != 0) {
        char *slash = strrchr(part, '/');
        if (!slash)
            strcpy(part, ".");
        else
            slash[slash == part ? 1 : 0] = '\0';
    }
    if (!S_ISDIR(status.st_mode))
        errno = ENOTDIR;
    else if (access(part, W_OK | X_OK) == 0)
        return true;
    return err_set(err, ERR_IO, "%s: cannot write: %s", part, strerror(errno));
}

bool file_exists(const char *path) {
    struct stat status;
    return stat(path, &status) == 0;
}
