/* A ring of frame buffers between the thread that draws and one that compresses. The frames leave in the
 * order in which they came, so what is on disk after a failure is an unbroken sequence. */
#include "writer.h"

#include "png.h"

#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { PATH_SIZE = 4096 };

typedef struct Slot {
    char path[PATH_SIZE]; /* "": no file */
    GfxVideo *video;
    uint8_t *rgb;
} Slot;

struct GfxWriter {
    int width, height;
    Slot *slots;
    int capacity, first, count; /* ring: slots first .. first + count - 1 hold frames */
    bool is_ending;
    Err error; /* of the first frame that failed */
    pthread_mutex_t mutex;
    pthread_cond_t changed;
    pthread_t thread;
};

static bool write_slot(const GfxWriter *writer, const Slot *slot, Err *err) {
    return (!*slot->path || gfx_png_write(slot->path, slot->rgb, writer->width, writer->height, err)) &&
           (!slot->video || gfx_video_add(slot->video, slot->rgb, err));
}

static void *work(void *argument) {
    GfxWriter *writer = argument;
    pthread_mutex_lock(&writer->mutex);
    for (;;) {
        while (writer->count == 0 && !writer->is_ending)
            pthread_cond_wait(&writer->changed, &writer->mutex);
        if (writer->count == 0)
            break;
        const Slot *slot = &writer->slots[writer->first];
        bool skip = writer->error.code != ERR_NONE;
        Err err = {0};
        pthread_mutex_unlock(&writer->mutex);
        if (!skip)
            write_slot(writer, slot, &err);
        pthread_mutex_lock(&writer->mutex);
        if (err.code != ERR_NONE)
            writer->error = err;
        writer->first = (writer->first + 1) % writer->capacity;
        writer->count--;
        pthread_cond_broadcast(&writer->changed);
    }
    pthread_mutex_unlock(&writer->mutex);
    return NULL;
}

static void release(GfxWriter *writer) {
    for (int i = 0; writer->slots && i < writer->capacity; i++)
        free(writer->slots[i].rgb);
    free(writer->slots);
    pthread_cond_destroy(&writer->changed);
    pthread_mutex_destroy(&writer->mutex);
    free(writer);
}

static bool allocate(GfxWriter *writer) {
    size_t size = (size_t)writer->width * (size_t)writer->height * 3;
    writer->slots = calloc((size_t)writer->capacity, sizeof *writer->slots);
    bool ok = writer->slots != NULL;
    for (int i = 0; ok && i < writer->capacity; i++)
        ok = (writer->slots[i].rgb = malloc(size)) != NULL;
    return ok;
}

GfxWriter *gfx_writer_begin(int width, int height, int capacity, Err *err) {
    GfxWriter *writer = calloc(1, sizeof *writer);
    if (!writer) {
        err_set(err, ERR_IO, "not enough memory for the queue of frames");
        return NULL;
    }
    writer->width = width;
    writer->height = height;
    writer->capacity = capacity;
    pthread_mutex_init(&writer->mutex, NULL);
    pthread_cond_init(&writer->changed, NULL);
    if (!allocate(writer)) {
        err_set(err, ERR_IO, "not enough memory for %d frames of %dx%d", capacity, width, height);
        release(writer);
        return NULL;
    }
    /* Signals are for the thread that steps. */
    sigset_t all, old;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &old);
    int fault = pthread_create(&writer->thread, NULL, work, writer);
    pthread_sigmask(SIG_SETMASK, &old, NULL);
    if (fault) {
        err_set(err, ERR_IO, "cannot start the thread that writes frames: %s", strerror(fault));
        release(writer);
        return NULL;
    }
    return writer;
}

bool gfx_writer_add(GfxWriter *writer, const char *path, GfxVideo *video, const uint8_t *rgb, Err *err) {
    if (path && strlen(path) >= PATH_SIZE)
        return err_set(err, ERR_IO, "%.64s...: cannot write: the name is too long", path);
    pthread_mutex_lock(&writer->mutex);
    while (writer->count == writer->capacity)
        pthread_cond_wait(&writer->changed, &writer->mutex);
    Err error = writer->error;
    Slot *slot = &writer->slots[(writer->first + writer->count) % writer->capacity];
    pthread_mutex_unlock(&writer->mutex);
    if (error.code != ERR_NONE)
        return err_set(err, error.code, "%s", error.message);
    /* Only this thread adds, so the slot stays free without the lock. */
    snprintf(slot->path, sizeof slot->path, "%s", path ? path : "");
    slot->video = video;
    memcpy(slot->rgb, rgb, (size_t)writer->width * (size_t)writer->height * 3);
    pthread_mutex_lock(&writer->mutex);
    writer->count++;
    pthread_cond_broadcast(&writer->changed);
    pthread_mutex_unlock(&writer->mutex);
    return true;
}

bool gfx_writer_finish(GfxWriter *writer, Err *err) {
    if (!writer)
        return true;
    pthread_mutex_lock(&writer->mutex);
    writer->is_ending = true;
    pthread_cond_broadcast(&writer->changed);
    pthread_mutex_unlock(&writer->mutex);
    pthread_join(writer->thread, NULL);
    Err error = writer->error;
    release(writer);
    return error.code == ERR_NONE || err_set(err, error.code, "%s", error.message);
}
