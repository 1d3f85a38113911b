/* Error reports, buffers, files, log. arena.c is included whole, so that control groups of a made-up machine
 * can be read. */
#include "../../engine/base/arena.c"

#include "base/err.h"
#include "base/file.h"
#include "base/log.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <fcntl.h>
#include <sys/stat.h>

#include "scratch.h"

/* ---- err ---- */

static void err_sets_code_and_message(void **state) {
    (void)state;
    Err err = {0};
    assert_false(err_set(&err, ERR_INPUT, "%s: %d", "a", 7));
    assert_int_equal(err.code, ERR_INPUT);
    assert_string_equal(err.message, "a: 7");
    err_set(&err, ERR_IO, "again: %s", err.message);
    assert_int_equal(err.code, ERR_IO);
    assert_string_equal(err.message, "again: a: 7");
    assert_false(err_set(NULL, ERR_IO, "nobody asks"));
}

static void err_add_makes_lines_and_keeps_the_first_code(void **state) {
    (void)state;
    Err err = {0};
    assert_false(err_add(&err, ERR_INPUT, "one"));
    assert_false(err_add(&err, ERR_IO, "two %d", 2));
    assert_int_equal(err.code, ERR_INPUT);
    assert_string_equal(err.message, "one\ntwo 2");
    err_prefix(&err, "file %s", "x.json");
    assert_string_equal(err.message, "file x.json: one\nfile x.json: two 2");
    assert_false(err_add(NULL, ERR_IO, "nobody asks"));
    err_prefix(NULL, "nobody");
}

static void err_marks_what_does_not_fit(void **state) {
    (void)state;
    static char text[2 * ERR_MESSAGE_SIZE];
    memset(text, 'a', sizeof text - 1);
    Err err = {0};
    err_set(&err, ERR_INPUT, "%s", text);
    assert_int_equal(strlen(err.message), ERR_MESSAGE_SIZE - 1);
    assert_string_equal(err.message + ERR_MESSAGE_SIZE - 5, "a...");

    /* One byte less than the limit is left alone. */
    text[ERR_MESSAGE_SIZE - 1] = '\0';
    err_set(&err, ERR_INPUT, "%s", text);
    assert_string_equal(err.message, text);

    /* Many lines fill it up: it stays terminated, marked and bounded, whatever is added. */
    for (int length = 1; length < 200; length += 7) {
        memset(&err, 0, sizeof err);
        for (int i = 0; i < 5000; i++)
            err_add(&err, ERR_INPUT, "%.*s", length, text);
        assert_int_equal(strlen(err.message), ERR_MESSAGE_SIZE - 1);
        assert_string_equal(err.message + ERR_MESSAGE_SIZE - 4, "...");
        err_prefix(&err, "prefix");
        assert_memory_equal(err.message, "prefix: a", 9);
        assert_string_equal(err.message + ERR_MESSAGE_SIZE - 4, "...");
    }
}

/* ---- buffers ---- */

static bool all_zero(const char *bytes, size_t from, size_t to) {
    for (size_t i = from; i < to; i++)
        if (bytes[i])
            return false;
    return true;
}

static void buffer_grows_and_keeps(void **state) {
    (void)state;
    /* Within a page, across pages, from small to huge, from huge to huge. */
    static const size_t sizes[] = {1, 100, 4096, 4097, 65536, 2097151, 2097152, 2097153, 9000000, 33554432};
    Buffer buffer = {0};
    Err err = {0};
    size_t filled = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        assert_true(buffer_reserve(&buffer, "test", sizes[i], &err));
        assert_true(buffer.size >= sizes[i]);
        assert_int_equal((uintptr_t)buffer.data % 64, 0);
        unsigned char *bytes = buffer.data;
        for (size_t k = 0; k < filled; k++)
            assert_int_equal(bytes[k], (k * 31 + 1) & 255);
        assert_true(all_zero(buffer.data, filled, sizes[i]));
        for (size_t k = filled; k < sizes[i]; k++)
            bytes[k] = (unsigned char)(k * 31 + 1);
        filled = sizes[i];
    }
    assert_int_equal((uintptr_t)buffer.data % HUGE_BYTES, 0);
    buffer_free(&buffer);
    assert_null(buffer.data);
    assert_int_equal(buffer.size, 0);
    buffer_free(&buffer);
}

static void buffer_that_is_large_enough_stays(void **state) {
    (void)state;
    Buffer buffer = {0};
    assert_true(buffer_reserve(&buffer, "test", 100000, NULL));
    void *data = buffer.data;
    uint64_t count = buffer_allocation_count();
    assert_true(buffer_reserve(&buffer, "test", 100000, NULL));
    assert_true(buffer_reserve(&buffer, "test", 1, NULL));
    assert_true(buffer_reserve(&buffer, "test", 0, NULL));
    assert_ptr_equal(buffer.data, data);
    assert_int_equal(buffer_allocation_count(), count);
    assert_true(buffer_reserve(&buffer, "test", 200000, NULL));
    assert_int_equal(buffer_allocation_count(), count + 1);
    buffer_free(&buffer);
}

static void buffer_refuses_more_than_there_is(void **state) {
    (void)state;
    static const size_t sizes[] = {SIZE_MAX, SIZE_MAX / 2, (size_t)1 << 60, (size_t)1 << 46};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        Buffer buffer = {0};
        assert_true(buffer_reserve(&buffer, "test", 5000, NULL));
        ((char *)buffer.data)[4999] = 'x';
        Buffer before = buffer;
        uint64_t count = buffer_allocation_count();
        Err err = {0};
        assert_false(buffer_reserve(&buffer, "packed rows", sizes[i], &err));
        assert_int_equal(err.code, ERR_INPUT);
        assert_non_null(strstr(err.message, "not enough memory for packed rows"));
        assert_memory_equal(&buffer, &before, sizeof buffer);
        assert_int_equal(buffer_allocation_count(), count);
        assert_int_equal(((char *)buffer.data)[4999], 'x');
        buffer_free(&buffer);
    }
}

/* ---- memory ---- */

static void memory_numbers_are_plausible(void **state) {
    (void)state;
    assert_true(memory_available() > (size_t)1 << 20);
    assert_true(memory_available() < (size_t)1 << 46);
    assert_true(memory_peak() > (size_t)1 << 20);
    size_t before = memory_peak();
    Buffer buffer = {0};
    assert_true(buffer_reserve(&buffer, "test", before + ((size_t)64 << 20), NULL));
    memset(buffer.data, 1, buffer.size);
    assert_true(memory_peak() >= before + ((size_t)32 << 20));
    buffer_free(&buffer);
}

static void put(const char *name, const char *text) {
    char path[600];
    snprintf(path, sizeof path, "%s", name);
    *strrchr(path, '/') = '\0';
    assert_true(file_make_directory(path, NULL));
    assert_true(file_write(name, text, strlen(text), NULL));
}

static void memory_obeys_the_tightest_group(void **state) {
    (void)state;
    static const char v2[] = "v2", v1[] = "v1";
    put("v2/proc/meminfo", "MemTotal:       9000000 kB\nMemFree:  1 kB\nMemAvailable:    8000000 kB\n");
    assert_true(available_under(v2) == (size_t)8000000 * 1024);
    put("v2/proc/self/cgroup", "0::/outer/inner\n");
    put("v2/sys/fs/cgroup/outer/inner/memory.max", "max\n");
    put("v2/sys/fs/cgroup/outer/inner/memory.current", "5000\n");
    assert_true(available_under(v2) == (size_t)8000000 * 1024);
    put("v2/sys/fs/cgroup/outer/memory.max", "1000000\n");
    put("v2/sys/fs/cgroup/outer/memory.current", "400000\n");
    assert_int_equal(available_under(v2), 600000);
    put("v2/sys/fs/cgroup/outer/memory.stat", "anon 1\ninactive_file 150000\nactive_file 2\n");
    assert_int_equal(available_under(v2), 750000);
    put("v2/sys/fs/cgroup/memory.max", "300\n");
    put("v2/sys/fs/cgroup/memory.current", "500\n");
    assert_int_equal(available_under(v2), 0);

    put("v1/proc/meminfo", "MemAvailable: 8000 kB\n");
    put("v1/proc/self/cgroup", "3:cpu:/gone\n4:memory:/gone/too\n0::/\n");
    put("v1/sys/fs/cgroup/memory/memory.limit_in_bytes", "70000\n");
    put("v1/sys/fs/cgroup/memory/memory.usage_in_bytes", "20000\n");
    put("v1/sys/fs/cgroup/memory/memory.stat", "cache 9\ntotal_inactive_file 1000\n");
    assert_int_equal(available_under(v1), 51000);
}

/* ---- files ---- */

static void assert_file(const char *path, const char *text) {
    char *data = NULL;
    size_t size = 0;
    Err err = {0};
    if (!file_read(path, 1 << 20, &data, &size, &err))
        fail_msg("%s", err.message);
    assert_int_equal(size, strlen(text));
    assert_string_equal(data, text);
    free(data);
}

static void file_round_trip(void **state) {
    (void)state;
    Err err = {0};
    const char *path = "a.txt";
    assert_true(file_write(path, "first", 5, &err));
    assert_file(path, "first");
    assert_true(file_write(path, "", 0, &err));
    assert_file(path, "");

    size_t size = 300000, read_size = 0;
    char *bytes = malloc(size), *read_bytes = NULL;
    for (size_t i = 0; i < size; i++)
        bytes[i] = (char)(i * i >> 3);
    assert_true(file_write(path, bytes, size, &err));
    assert_true(file_read(path, size, &read_bytes, &read_size, &err));
    assert_int_equal(read_size, size);
    assert_memory_equal(read_bytes, bytes, size);
    assert_int_equal(read_bytes[size], 0);
    free(read_bytes);
    assert_false(file_read(path, size - 1, &read_bytes, &read_size, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.message, "larger than 299999 bytes"));
    free(bytes);
}

static void file_of_unknown_size_is_read_whole(void **state) {
    (void)state;
    /* Reports size 0 and holds more. */
    char *data = NULL;
    size_t size = 0;
    Err err = {0};
    assert_true(file_read("/proc/self/status", 1 << 20, &data, &size, &err));
    assert_true(size > 100);
    assert_int_equal(strlen(data), size);
    assert_non_null(strstr(data, "VmHWM"));
    free(data);
    assert_false(file_read("/proc/self/status", 10, &data, &size, &err));
    assert_int_equal(err.code, ERR_INPUT);
}

static void file_read_says_what_is_wrong(void **state) {
    (void)state;
    char *data = NULL;
    size_t size = 0;
    Err err = {0};
    assert_false(file_read("none", 100, &data, &size, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.message, "none: cannot open: No such file"));
    assert_false(file_read(scratch_folder, 100, &data, &size, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.message, "is a directory"));
    /* A pipe nobody writes to must not be waited for. */
    assert_int_equal(mkfifo("pipe", 0600), 0);
    assert_false(file_read("pipe", 100, &data, &size, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.message, "not a regular file"));
    assert_null(data);
}

static void file_is_seen_only_when_committed(void **state) {
    (void)state;
    Err err = {0};
    FileWriter writer;
    const char *path = "b.txt", *temporary = "b.txt.tmp";
    assert_true(file_write(path, "old", 3, &err));

    assert_true(file_begin(&writer, path, &err));
    fputs("new", writer.stream);
    fflush(writer.stream);
    assert_file(path, "old");
    assert_true(file_exists(temporary));
    file_abort(&writer);
    assert_false(file_exists(temporary));
    assert_file(path, "old");
    file_abort(&writer);

    assert_true(file_begin(&writer, path, &err));
    fputs("new", writer.stream);
    assert_true(file_commit(&writer, &err));
    assert_false(file_exists(temporary));
    assert_file(path, "new");
}

static void file_write_failures_leave_nothing(void **state) {
    (void)state;
    Err err = {0};
    assert_false(file_write("no/such/folder/x", "a", 1, &err));
    assert_int_equal(err.code, ERR_IO);
    assert_non_null(strstr(err.message, "No such file"));
    assert_false(file_write(scratch_folder, "a", 1, &err));
    assert_non_null(strstr(err.message, "Is a directory"));
    assert_false(file_write("slash/", "a", 1, &err));
    assert_false(file_write("", "a", 1, &err));

    static char name[8192];
    memset(name, 'a', sizeof name - 1);
    assert_false(file_write(name, "a", 1, &err));
    assert_int_equal(err.code, ERR_IO);
    assert_non_null(strstr(err.message, "name too long"));

    /* A full disk: the temporary name leads to a device that takes nothing. The old file survives, the
     * temporary is gone. */
    const char *path = "full.txt", *temporary = "full.txt.tmp";
    if (access("/dev/full", W_OK) != 0)
        return;
    static char bytes[100000];
    for (size_t size = 1; size <= sizeof bytes; size += sizeof bytes - 1) {
        assert_true(file_write(path, "old", 3, &err));
        assert_int_equal(symlink("/dev/full", temporary), 0);
        assert_false(file_write(path, bytes, size, &err));
        assert_int_equal(err.code, ERR_IO);
        assert_non_null(strstr(err.message, "No space left"));
        assert_non_null(strstr(err.message, path));
        assert_false(file_exists(temporary));
        assert_file(path, "old");
    }
}

static void directories_with_parents(void **state) {
    (void)state;
    Err err = {0};
    assert_true(file_make_directory("p/q//r/", &err));
    assert_true(file_exists("p/q/r"));
    assert_true(file_make_directory("p/q/r", &err));
    assert_true(file_make_directory("/", &err));
    assert_true(file_write("p/file", "", 0, &err));
    assert_false(file_make_directory("p/file/sub", &err));
    assert_int_equal(err.code, ERR_IO);
    assert_non_null(strstr(err.message, "p/file: cannot make directory: Not a directory"));
    assert_false(file_make_directory("", &err));
    static char name[8192];
    memset(name, 'a', sizeof name - 1);
    assert_false(file_make_directory(name, &err));
    assert_non_null(strstr(err.message, "name too long"));
    assert_false(file_check_directory(name, &err));
}

static void directories_are_checked_beforehand(void **state) {
    (void)state;
    Err err = {0};
    assert_true(file_make_directory("there", &err) && file_write("there/file", "", 0, &err));
    static const char *const good[] = {"there", "there/", "there/a/b", "a", "a/", "./a", ".", "//tmp/a/"};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++)
        if (!file_check_directory(good[i], &err))
            fail_msg("%s: %s", good[i], err.message);
    assert_false(file_exists("a") || file_exists("there/a"));
    assert_false(file_check_directory("there/file/a/b", &err));
    assert_int_equal(err.code, ERR_IO);
    assert_string_equal(err.message, "there/file: cannot write: Not a directory");
    assert_false(file_check_directory("", &err));
    if (geteuid() == 0)
        return; /* may write anywhere */
    assert_int_equal(chmod("there", 0500), 0);
    assert_false(file_check_directory("there/a", &err));
    assert_string_equal(err.message, "there: cannot write: Permission denied");
    assert_int_equal(chmod("there", 0700), 0);
}

/* ---- log ---- */

static char logged[ERR_MESSAGE_SIZE + 16];

static void remember(LogLevel level, const char *message, void *user) {
    ++*(int *)user;
    snprintf(logged, sizeof logged, "%d %s", (int)level, message);
}

static void log_reaches_the_sink(void **state) {
    (void)state;
    int count = 0;
    log_set_sink(remember, &count, LOG_INFO);
    log_write(LOG_DEBUG, "not heard");
    assert_int_equal(count, 0);
    log_write(LOG_INFO, "n = %d", 3);
    assert_int_equal(count, 1);
    assert_string_equal(logged, "1 n = 3");
    static char text[2 * ERR_MESSAGE_SIZE];
    memset(text, 'a', sizeof text - 1);
    log_write(LOG_ERROR, "%s", text);
    assert_string_equal(logged + strlen(logged) - 4, "a...");

    log_set_sink(NULL, NULL, LOG_DEBUG);
    log_write(LOG_INFO, "below the default");
    assert_int_equal(count, 2);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(err_sets_code_and_message),
        cmocka_unit_test(err_add_makes_lines_and_keeps_the_first_code),
        cmocka_unit_test(err_marks_what_does_not_fit),
        cmocka_unit_test(buffer_grows_and_keeps),
        cmocka_unit_test(buffer_that_is_large_enough_stays),
        cmocka_unit_test(buffer_refuses_more_than_there_is),
        cmocka_unit_test(memory_numbers_are_plausible),
        cmocka_unit_test(memory_obeys_the_tightest_group),
        cmocka_unit_test(file_round_trip),
        cmocka_unit_test(file_of_unknown_size_is_read_whole),
        cmocka_unit_test(file_read_says_what_is_wrong),
        cmocka_unit_test(file_is_seen_only_when_committed),
        cmocka_unit_test(file_write_failures_leave_nothing),
        cmocka_unit_test(directories_with_parents),
        cmocka_unit_test(directories_are_checked_beforehand),
        cmocka_unit_test(log_reaches_the_sink),
    };
    return cmocka_run_group_tests_name("base", tests, scratch_enter, scratch_leave);
}
