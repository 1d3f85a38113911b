/* PNG by libpng, at level 1 with the SUB filter: a 720p frame takes 23 ms and 0.8 MB, where the default level
 * takes 165 ms to save another 8 %. libpng's stdio is not used, because it reports a full disk as "Write
 * Error" without a reason. No metadata is written, so equal pictures are equal files. */
#include "png.h"

#include "engine/base/file.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdlib.h>
#include <string.h>

typedef struct Sink {
    FILE *stream;
    int fault;        /* errno of the write that failed, or 0 */
    char reason[128]; /* libpng's own words, where no write failed */
} Sink;

static void write_bytes(png_structp png, png_bytep data, size_t size) {
    Sink *sink = png_get_io_ptr(png);
    if (fwrite(data, 1, size, sink->stream) != size) {
        sink->fault = errno ? errno : EIO;
        png_error(png, "write");
    }
}

/* fclose and rename follow in file_commit. */
static void flush_bytes(png_structp png) {
    (void)png;
}

static void on_error(png_structp png, png_const_charp message) {
    Sink *sink = png_get_error_ptr(png);
    snprintf(sink->reason, sizeof sink->reason, "%s", message);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message) {
    (void)png;
    (void)message;
}

/* Everything that can jump. False: sink says why. */
static bool encode(png_structp png, png_infop info, const uint8_t *rgb, int width, int height) {
    if (setjmp(png_jmpbuf(png)))
        return false;
    png_set_compression_level(png, 1);
    png_set_filter(png, 0, PNG_FILTER_SUB);
    png_set_IHDR(png, info, (png_uint_32)width, (png_uint_32)height, 8, PNG_COLOR_TYPE_RGB,
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_write_info(png, info);
    for (int y = 0; y < height; y++)
        png_write_row(png, rgb + (size_t)y * (size_t)width * 3);
    png_write_end(png, NULL);
    return true;
}

bool gfx_png_write(const char *path, const uint8_t *rgb, int width, int height, Err *err) {
    FileWriter writer;
    Sink sink = {0};
    if (!file_begin(&writer, path, err))
        return false;
    sink.stream = writer.stream;
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &sink, on_error, on_warning);
    png_infop info = png ? png_create_info_struct(png) : NULL;
    bool encoded = false;
    if (info) {
        png_set_write_fn(png, &sink, write_bytes, flush_bytes);
        encoded = encode(png, info, rgb, width, height);
    } else {
        snprintf(sink.reason, sizeof sink.reason, "not enough memory");
    }
    png_destroy_write_struct(&png, &info);
    if (encoded)
        return file_commit(&writer, err);
    file_abort(&writer);
    return err_set(err, ERR_IO, "%s: cannot write: %s", path,
                   sink.fault ? strerror(sink.fault) : sink.reason);
}

bool gfx_png_read(const char *path, uint8_t *rgb, int width, int height, Err *err) {
    enum { LARGEST = 1 << 30 };
    char *bytes;
    size_t size;
    if (!file_read(path, LARGEST, &bytes, &size, err))
        return false;
    png_image image = {.version = PNG_IMAGE_VERSION};
    bool ok = png_image_begin_read_from_memory(&image, bytes, size) != 0;
    if (!ok)
        err_set(err, ERR_INPUT, "%s: %s", path, image.message);
    if (ok && (image.width != (png_uint_32)width || image.height != (png_uint_32)height))
        ok = err_set(err, ERR_INPUT, "%s: %ux%u pixels, expected %dx%d", path, image.width, image.height,
                     width, height);
    image.format = PNG_FORMAT_RGB;
    if (ok && !png_image_finish_read(&image, NULL, rgb, 3 * width, NULL))
        ok = err_set(err, ERR_INPUT, "%s: %s", path, image.message);
    png_image_free(&image);
    free(bytes);
    return ok;
}
