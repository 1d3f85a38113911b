/* Page-aligned blocks straight from the system, and how much of them the machine can give.
 *
 * Blocks are mapped, not malloc'ed: fresh pages are zero without being touched, so that each page lands with
 * the thread that first uses it, and growing moves page tables instead of bytes. A block is exactly as large
 * as asked, rounded to pages; callers that grow decide by how much. Blocks of 2 MB and more start on a huge
 * page boundary, or the first and last part could not be one. */
#define _GNU_SOURCE
#include "arena.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define WITH_ASAN 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__)
#define WITH_ASAN 1
#endif
#ifdef WITH_ASAN
#include <sanitizer/asan_interface.h>
#endif

#define HUGE_BYTES    ((size_t)2 << 20)
#define CHECKED_BYTES ((size_t)64 << 20)

static uint64_t allocation_count;

static size_t page_bytes(void) {
    return (size_t)sysconf(_SC_PAGESIZE);
}

/* Length of the mapping behind a block of `size` bytes. Under AddressSanitizer one page more, closed to the
 * program, so that an overrun is reported here as it would be for the heap. */
static size_t mapping_length(size_t size) {
    size_t length = (size + page_bytes() - 1) / page_bytes() * page_bytes();
#ifdef WITH_ASAN
    length += page_bytes();
#endif
    return length;
}

static void mark_accessible(void *data, size_t size, size_t length) {
#ifdef WITH_ASAN
    ASAN_UNPOISON_MEMORY_REGION(data, size);
    ASAN_POISON_MEMORY_REGION((char *)data + size, length - size);
#else
    (void)data, (void)size, (void)length;
#endif
}

static void release(void *data, size_t length) {
#ifdef WITH_ASAN
    ASAN_UNPOISON_MEMORY_REGION(data, length);
#endif
    munmap(data, length);
}

/* Without huge pages everything works, slower: a refusal is of no interest. */
static void advise(void *data, size_t length) {
    if (length >= HUGE_BYTES)
        madvise(data, length, MADV_HUGEPAGE);
}

/* New zeroed pages; NULL when there are none. */
static void *map_pages(size_t length) {
    size_t slack = length >= HUGE_BYTES ? HUGE_BYTES : 0;
    char *raw = mmap(NULL, length + slack, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (raw == MAP_FAILED)
        return NULL;
    if (!slack)
        return raw;
    size_t before = (HUGE_BYTES - (uintptr_t)raw % HUGE_BYTES) % HUGE_BYTES;
    if (before)
        munmap(raw, before);
    if (slack - before)
        munmap(raw + before + length, slack - before);
    advise(raw + before, length);
    return raw + before;
}

/* Moves the pages of a block to a larger place, which is mapped first for its alignment, then replaced. */
static void *grow_pages(void *old, size_t old_length, size_t new_length) {
    char *place = map_pages(new_length);
    if (!place)
        return NULL;
    mark_accessible(old, old_length, old_length);
    if (mremap(old, old_length, old_length, MREMAP_MAYMOVE | MREMAP_FIXED, place) == MAP_FAILED) {
        release(place, new_length);
        return NULL;
    }
    advise(place, new_length); /* the moved pages brought their own advice */
    return place;
}

bool buffer_reserve(Buffer *buffer, const char *name, size_t size, Err *err) {
    if (size <= buffer->size)
        return true;
    if (size > SIZE_MAX / 4)
        return err_set(err, ERR_INPUT, "not enough memory for %s: %zu bytes is more than can exist", name,
                       size);

    size_t old_length = buffer->data ? mapping_length(buffer->size) : 0, new_length = mapping_length(size);
    void *data = buffer->data;
    if (new_length > old_length) {
        /* The kernel promises more than it has and kills the program later. A large request is refused. */
        size_t more = new_length - old_length, left = more >= CHECKED_BYTES ? memory_available() : SIZE_MAX;
        if (more <= left)
            data = data ? grow_pages(data, old_length, new_length) : map_pages(new_length);
        if (more > left || !data)
            return err_set(err, ERR_INPUT, "not enough memory for %s: needs %.1f MB, %.1f MB are left", name,
                           (double)size / 1e6, (double)memory_available() / 1e6);
        allocation_count++;
    }
    mark_accessible(data, size, new_length);
    *buffer = (Buffer){data, size, name};
    return true;
}

void buffer_free(Buffer *buffer) {
    if (buffer->data)
        release(buffer->data, mapping_length(buffer->size));
    buffer->data = NULL;
    buffer->size = 0;
}

uint64_t buffer_allocation_count(void) {
    return allocation_count;
}

/* Number after `key` at the start of a line of a small system file; without a key, the file's first word.
 * SIZE_MAX when it is absent or says "max". */
static size_t read_number(const char *path, const char *key) {
    size_t value = SIZE_MAX, key_length = strlen(key);
    FILE *stream = fopen(path, "re");
    if (!stream)
        return value;
    char line[256];
    while (fgets(line, sizeof line, stream)) {
        if (strncmp(line, key, key_length) != 0)
            continue;
        char *end;
        errno = 0;
        unsigned long long number = strtoull(line + key_length, &end, 10);
        if (end != line + key_length && errno == 0)
            value = (size_t)number;
        break;
    }
    fclose(stream);
    return value;
}

/* What one control group still allows. Cached file pages count as used but are given back on demand. */
static size_t group_left(const char *folder, const char *limit_name, const char *usage_name,
                         const char *cache_key) {
    char path[4608];
    snprintf(path, sizeof path, "%s/%s", folder, limit_name);
    size_t limit = read_number(path, "");
    snprintf(path, sizeof path, "%s/%s", folder, usage_name);
    size_t usage = read_number(path, "");
    snprintf(path, sizeof path, "%s/memory.stat", folder);
    size_t cache = read_number(path, cache_key);
    if (limit == SIZE_MAX || usage == SIZE_MAX)
        return SIZE_MAX;
    if (cache != SIZE_MAX)
        usage -= cache < usage ? cache : usage;
    return limit > usage ? limit - usage : 0;
}

/* The tightest limit from a process's group up to the root of the hierarchy at `mount`. In a container the
 * path may name groups that are not visible; those are passed over. */
static size_t hierarchy_left(const char *mount, const char *group, bool unified) {
    char folder[4352];
    size_t root_length = (size_t)snprintf(folder, sizeof folder, "%s", mount), least = SIZE_MAX;
    snprintf(folder + root_length, sizeof folder - root_length, "%s", group);
    for (;;) {
        size_t left = unified ? group_left(folder, "memory.max", "memory.current", "inactive_file ")
                              : group_left(folder, "memory.limit_in_bytes", "memory.usage_in_bytes",
                                           "total_inactive_file ");
        if (left < least)
            least = left;
        char *slash = strrchr(folder, '/');
        if (!slash || (size_t)(slash - folder) < root_length)
            return least;
        *slash = '\0';
    }
}

/* memory_available for a system whose /proc and /sys lie under `root` ("" for this one). */
static size_t available_under(const char *root) {
    char path[4096], line[2048];
    snprintf(path, sizeof path, "%s/proc/meminfo", root);
    size_t kilobytes = read_number(path, "MemAvailable:");
    size_t least = kilobytes > SIZE_MAX / 1024 ? SIZE_MAX : kilobytes * 1024;

    snprintf(path, sizeof path, "%s/proc/self/cgroup", root);
    FILE *stream = fopen(path, "re");
    if (!stream)
        return least;
    /* Lines are ID:CONTROLLERS:PATH; version 2 is the line "0::PATH". */
    while (fgets(line, sizeof line, stream)) {
        line[strcspn(line, "\n")] = '\0';
        char *controllers = strchr(line, ':');
        char *group = controllers ? strchr(controllers + 1, ':') : NULL;
        if (!group)
            continue;
        *group++ = '\0';
        controllers++;
        bool unified = strcmp(line, "0:") == 0 || *controllers == '\0';
        if (!unified && strcmp(controllers, "memory") != 0)
            continue;
        snprintf(path, sizeof path, "%s/sys/fs/cgroup%s", root, unified ? "" : "/memory");
        size_t left = hierarchy_left(path, group, unified);
        if (left < least)
            least = left;
    }
    fclose(stream);
    return least;
}

size_t memory_available(void) {
    return available_under("");
}

size_t memory_peak(void) {
    /* Not ru_maxrss alone: that one survives exec and would report the parent's peak. */
    size_t kilobytes = read_number("/proc/self/status", "VmHWM:");
    if (kilobytes == SIZE_MAX) {
        struct rusage usage;
        kilobytes = getrusage(RUSAGE_SELF, &usage) == 0 ? (size_t)usage.ru_maxrss : 0;
    }
    return kilobytes * 1024;
}
