/* The container of arrays: what goes in comes out, and any damage is found and named. */
#include "base/file.h"
#include "base/random.h"
#include "base/state_file.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "scratch.h"

enum { VERSION = 7, HEADER_SIZE = 24, ENTRY_SIZE = 80 };
/* Where things lie in the file. */
enum { AT_VERSION = 8, AT_COUNT = 12, AT_HASH = 16 };
enum { IN_TYPE = 48, IN_COMPONENTS = 52, IN_ELEMENTS = 56, IN_OFFSET = 64, IN_HASH = 72 };

static char path[128];

static const float positions[5][3] = {{1, 2, 3}, {4, -5, 6}, {0.1f, -0.0f, 1e30f}, {7, 8, 9}, {1e-40f, 1, 2}};
static const uint8_t flags[3] = {0, 255, 7};
static const uint64_t ids[4] = {0, 1, UINT64_MAX, 42};
static const double time_now[1] = {12.25};
static const int32_t signs[2] = {-1, INT32_MAX};
static const uint32_t counts[16] = {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};

static const StateField sample[] = {
    {"position", STATE_F32, 3, 5, positions},
    {"flag", STATE_U8, 1, 3, flags},
    {"id", STATE_U64, 1, 4, ids},
    {"nothing", STATE_F64, 4, 0, NULL},
    {"time", STATE_F64, 1, 1, time_now},
    {"body 1: sign", STATE_I32, 2, 1, signs},
    {"counts", STATE_U32, 4, 4, counts},
};
enum { SAMPLE_COUNT = sizeof sample / sizeof sample[0] };

/* The sample as file bytes, freshly written; the caller frees. */
static unsigned char *sample_bytes(size_t *size) {
    Err err = {0};
    char *bytes = NULL;
    if (!state_file_write(path, VERSION, sample, SAMPLE_COUNT, &err) ||
        !file_read(path, 1 << 20, &bytes, size, &err))
        fail_msg("%s", err.message);
    return (unsigned char *)bytes;
}

static int setup(void **state) {
    if (scratch_enter(state) != 0)
        return -1;
    snprintf(path, sizeof path, "%s/sample.state", scratch_folder);
    return 0;
}

static void put32(unsigned char *bytes, size_t at, uint32_t value) {
    memcpy(bytes + at, &value, sizeof value);
}

static void put64(unsigned char *bytes, size_t at, uint64_t value) {
    memcpy(bytes + at, &value, sizeof value);
}

static uint64_t get64(const unsigned char *bytes, size_t at) {
    uint64_t value;
    memcpy(&value, bytes + at, sizeof value);
    return value;
}

static size_t entry_at(int field) {
    return HEADER_SIZE + (size_t)field * ENTRY_SIZE;
}

/* What an attacker does after changing the table. */
static void repair_table_hash(unsigned char *bytes, size_t size) {
    uint32_t count;
    memcpy(&count, bytes + AT_COUNT, sizeof count);
    uint64_t table_size = (uint64_t)count * ENTRY_SIZE;
    if (table_size <= size - HEADER_SIZE)
        put64(bytes, AT_HASH, XXH3_64bits(bytes + HEADER_SIZE, table_size));
}

static void assert_refused(const unsigned char *bytes, size_t size, const char *words) {
    Err err = {0};
    StateFile *file = state_file_parse("x.state", bytes, size, VERSION, &err);
    assert_null(file);
    assert_int_equal(err.code, ERR_INPUT);
    if (strncmp(err.message, "x.state: ", 9) != 0 || !strstr(err.message, words))
        fail_msg("expected '%s' in: %s", words, err.message);
}

/* ---- Round trip ---- */

static void assert_is_sample(const StateFile *file) {
    assert_int_equal(state_file_field_count(file), SAMPLE_COUNT);
    for (uint32_t i = 0; i < SAMPLE_COUNT; i++) {
        Err err = {0};
        const StateField *want = &sample[i];
        const StateField *got =
            state_file_field(file, want->name, want->type, want->components, want->count, &err);
        if (!got)
            fail_msg("%s", err.message);
        assert_ptr_equal(got, state_file_field_at(file, i));
        assert_ptr_equal(got,
                         state_file_field(file, want->name, want->type, want->components, UINT64_MAX, &err));
        assert_string_equal(got->name, want->name);
        assert_int_equal(got->count, want->count);
        assert_int_equal((uintptr_t)got->data % 8, 0);
        if (want->count)
            assert_memory_equal(got->data, want->data,
                                want->count * want->components * state_type_size(want->type));
    }
    assert_null(state_file_field_at(file, SAMPLE_COUNT));
}

static void what_goes_in_comes_out(void **state) {
    (void)state;
    size_t size;
    unsigned char *bytes = sample_bytes(&size);
    Err err = {0};
    StateFile *file = state_file_open(path, VERSION, &err);
    assert_non_null(file);
    assert_is_sample(file);
    state_file_close(file);

    file = state_file_parse("memory", bytes, size, VERSION, &err);
    free(bytes); /* parse copies */
    assert_non_null(file);
    assert_is_sample(file);
    state_file_close(file);
    state_file_close(NULL);
}

static void layout_is_the_documented_one(void **state) {
    (void)state;
    size_t size;
    unsigned char *bytes = sample_bytes(&size);
    assert_memory_equal(bytes, "SKIFFST1\7\0\0\0\7\0\0\0", 16);
    assert_true(get64(bytes, AT_HASH) == XXH3_64bits(bytes + HEADER_SIZE, SAMPLE_COUNT * ENTRY_SIZE));
    uint64_t end = HEADER_SIZE + SAMPLE_COUNT * ENTRY_SIZE;
    for (int i = 0; i < SAMPLE_COUNT; i++) {
        const unsigned char *entry = bytes + entry_at(i);
        uint64_t offset = get64(entry, IN_OFFSET);
        assert_string_equal((const char *)entry, sample[i].name);
        assert_int_equal(offset, (end + 63) / 64 * 64);
        end = offset + sample[i].count * sample[i].components * state_type_size(sample[i].type);
        assert_true(get64(entry, IN_HASH) == XXH3_64bits(bytes + offset, end - offset));
    }
    assert_int_equal(size, end);
    free(bytes);
}

static void no_fields_and_most_fields(void **state) {
    (void)state;
    Err err = {0};
    assert_true(state_file_write(path, VERSION, NULL, 0, &err));
    StateFile *file = state_file_open(path, VERSION, &err);
    assert_non_null(file);
    assert_int_equal(state_file_field_count(file), 0);
    state_file_close(file);

    static StateField many[STATE_MAX_FIELDS + 1];
    for (int i = 0; i <= STATE_MAX_FIELDS; i++) {
        many[i] = (StateField){"", STATE_U8, 1, 1, flags};
        snprintf(many[i].name, sizeof many[i].name, "field with the number %025d", i); /* longest: 47 */
    }
    assert_int_equal(strlen(many[0].name), STATE_NAME_SIZE - 1);
    assert_true(state_file_write(path, VERSION, many, STATE_MAX_FIELDS, &err));
    file = state_file_open(path, VERSION, &err);
    assert_non_null(file);
    assert_int_equal(state_file_field_count(file), STATE_MAX_FIELDS);
    assert_non_null(state_file_field(file, many[255].name, STATE_U8, 1, 1, &err));
    state_file_close(file);
    assert_false(state_file_write(path, VERSION, many, STATE_MAX_FIELDS + 1, &err));
    assert_int_equal(err.code, ERR_USAGE);
}

static void lookup_says_what_differs(void **state) {
    (void)state;
    size_t size;
    free(sample_bytes(&size));
    Err err = {0};
    StateFile *file = state_file_open(path, VERSION, &err);
    assert_non_null(file);
    assert_null(state_file_field(file, "velocity", STATE_F32, 3, 5, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.message, "sample.state: field 'velocity' is missing"));
    assert_null(state_file_field(file, "position", STATE_F64, 3, 5, &err));
    assert_non_null(strstr(err.message, "field 'position' is 3 x f32, expected 3 x f64"));
    assert_null(state_file_field(file, "position", STATE_F32, 4, 5, &err));
    assert_non_null(strstr(err.message, "field 'position' is 3 x f32, expected 4 x f32"));
    assert_null(state_file_field(file, "position", STATE_F32, 3, 6, &err));
    assert_non_null(strstr(err.message, "field 'position' has 5 elements, expected 6"));
    state_file_close(file);
}

/* ---- Writing fails ---- */

static void writer_refuses_wrong_fields(void **state) {
    (void)state;
    static const struct {
        StateField fields[2];
        const char *words;
    } cases[] = {
        {{{"a", STATE_U8, 1, 3, flags}, {"a", STATE_U8, 1, 3, flags}}, "two fields are called 'a'"},
        {{{"a", STATE_U8, 1, 3, flags}, {"", STATE_U8, 1, 3, flags}}, "field 1 has no name"},
        {{{"a\n", STATE_U8, 1, 3, flags}, {"b", STATE_U8, 1, 3, flags}}, "not printable"},
        {{{"a", STATE_U8, 0, 3, flags}, {"b", STATE_U8, 1, 3, flags}}, "field 'a' has an impossible"},
        {{{"a", (StateType)0, 1, 3, flags}, {"b", STATE_U8, 1, 3, flags}}, "field 'a' has an impossible"},
        {{{"a", (StateType)9, 1, 3, flags}, {"b", STATE_U8, 1, 3, flags}}, "field 'a' has an impossible"},
        {{{"a", STATE_U8, 1, 3, flags}, {"b", STATE_F64, 9, UINT64_MAX / 8, flags}},
         "field 'b' has an impossible"},
        {{{"a", STATE_U8, 1, 3, flags}, {"b", STATE_U8, 1, INT64_MAX, flags}}, "field 'b' has an impossible"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        Err err = {0};
        assert_false(state_file_write(path, VERSION, cases[i].fields, 2, &err));
        assert_int_equal(err.code, ERR_USAGE);
        if (!strstr(err.message, cases[i].words))
            fail_msg("expected '%s' in: %s", cases[i].words, err.message);
    }
    StateField endless = {"", STATE_U8, 1, 3, flags};
    memset(endless.name, 'n', sizeof endless.name);
    Err err = {0};
    assert_false(state_file_write(path, VERSION, &endless, 1, &err));
    assert_non_null(strstr(err.message, "does not end"));
}

static void failed_write_keeps_the_old_file(void **state) {
    (void)state;
    size_t size, size_after;
    unsigned char *before = sample_bytes(&size);
    char temporary[160];
    snprintf(temporary, sizeof temporary, "%s.tmp", path);
    Err err = {0};
    assert_false(state_file_write("/no/such/folder/x.state", VERSION, sample, SAMPLE_COUNT, &err));
    assert_int_equal(err.code, ERR_IO);
    if (access("/dev/full", W_OK) == 0) {
        static const char much[200000];
        const StateField large = {"large", STATE_U8, 1, sizeof much, much};
        assert_int_equal(symlink("/dev/full", temporary), 0);
        assert_false(state_file_write(path, VERSION, &large, 1, &err));
        assert_int_equal(err.code, ERR_IO);
        assert_non_null(strstr(err.message, "No space left"));
        assert_false(file_exists(temporary));
    }
    char *after;
    assert_true(file_read(path, 1 << 20, &after, &size_after, &err));
    assert_int_equal(size_after, size);
    assert_memory_equal(after, before, size);
    free(after);
    free(before);
}

/* ---- Damage ---- */

static void every_kind_of_damage_is_named(void **state) {
    (void)state;
    /* Changes one number of the table, then makes the table's checksum right again. */
    static const struct {
        int field, in, bytes;
        uint64_t value;
        const char *words;
    } cases[] = {
        {0, IN_TYPE, 4, 0, "field 'position' has type 0"},
        {0, IN_TYPE, 4, 7, "field 'position' has type 7"},
        {0, IN_TYPE, 4, UINT32_MAX, "field 'position' has type 4294967295"},
        {1, IN_COMPONENTS, 4, 0, "field 'flag' has type 1, 0 components"},
        {1, IN_COMPONENTS, 4, UINT32_MAX, "field 'flag' needs"},
        {2, IN_ELEMENTS, 8, UINT64_MAX, "field 'id' has type 3, 1 components, 18446744073709551615 elements"},
        {2, IN_ELEMENTS, 8, UINT64_MAX / 8, "field 'id' needs"},
        {2, IN_ELEMENTS, 8, 3, "field 'id' does not match its checksum"},
        {4, IN_OFFSET, 8, 0, "field 'time' lies at byte 0, expected"},
        {4, IN_OFFSET, 8, UINT64_MAX - 7, "field 'time' lies at byte 18446744073709551608, expected"},
        {6, IN_ELEMENTS, 8, 5, "cut short: field 'counts' needs 80 bytes from byte"},
        {6, IN_ELEMENTS, 8, 3, "does not match its checksum"},
        {3, IN_HASH, 8, 1, "field 'nothing' does not match its checksum"},
        {1, 0, 1, 0, "field 1 has no name"},
        {1, 0, 1, 7, "field 1 has a name that is not printable"},
        {1, 1, 1, 0xe4, "field 1 has a name that is not printable"},
        {1, 6, 1, 'x', "field 1 has bytes behind its name"},
        {1, 47, 1, 'x', "field 1 has bytes behind its name"},
        {2, 0, 8, 0x67616c66, "two fields are called 'flag'"},
    };
    size_t size;
    unsigned char *good = sample_bytes(&size), *bad = malloc(size);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        memcpy(bad, good, size);
        memcpy(bad + entry_at(cases[i].field) + cases[i].in, &cases[i].value, (size_t)cases[i].bytes);
        assert_refused(bad, size, "the table of fields does not match its checksum");
        repair_table_hash(bad, size);
        assert_refused(bad, size, cases[i].words);
    }
    memcpy(bad, good, size);
    memset(bad + entry_at(1), 'n', STATE_NAME_SIZE);
    repair_table_hash(bad, size);
    assert_refused(bad, size, "field 1 has a name that does not end");
    free(bad);
    free(good);
}

static void damage_outside_the_table_is_named(void **state) {
    (void)state;
    size_t size;
    unsigned char *good = sample_bytes(&size), *bad = calloc(1, size + 64);

    memcpy(bad, good, size);
    bad[0] = 's';
    assert_refused(bad, size, "not a Skiff state file");
    assert_refused((const unsigned char *)"", 0, "not a Skiff state file");
    assert_refused(NULL, 0, "not a Skiff state file");

    memcpy(bad, good, size);
    put32(bad, AT_VERSION, 6);
    assert_refused(bad, size, "version 6, expected 7");

    memcpy(bad, good, size);
    put32(bad, AT_COUNT, UINT32_MAX);
    assert_refused(bad, size, "4294967295 fields, at most 256");
    put32(bad, AT_COUNT, 256);
    assert_refused(bad, size, "cut short");
    put32(bad, AT_COUNT, 0);
    assert_refused(bad, size, "does not match its checksum");
    repair_table_hash(bad, size);
    assert_refused(bad, size, "bytes, expected 24");

    /* A byte of the gap between 'flag' and 'id', a byte of data, a byte too many. */
    memcpy(bad, good, size);
    bad[get64(good, entry_at(1) + IN_OFFSET) + 10] = 1;
    assert_refused(bad, size, "between fields is not zero");
    memcpy(bad, good, size);
    bad[get64(good, entry_at(1) + IN_OFFSET) + 2] ^= 1;
    assert_refused(bad, size, "field 'flag' does not match its checksum");
    memcpy(bad, good, size);
    assert_refused(bad, size + 1, "bytes, expected");
    free(bad);
    free(good);
}

static void any_truncation_is_refused(void **state) {
    (void)state;
    size_t size;
    unsigned char *good = sample_bytes(&size);
    for (size_t length = 0; length < size; length++)
        assert_refused(good, length, length < 8 ? "not a Skiff state file" : "cut short");
    free(good);
}

static void any_changed_bit_is_refused(void **state) {
    (void)state;
    size_t size;
    unsigned char *bytes = sample_bytes(&size);
    for (size_t bit = 0; bit < 8 * size; bit++) {
        bytes[bit / 8] ^= (unsigned char)(1u << bit % 8);
        assert_refused(bytes, size, "");
        bytes[bit / 8] ^= (unsigned char)(1u << bit % 8);
    }
    free(bytes);
}

static void open_reports_files_that_are_not_there(void **state) {
    (void)state;
    Err err = {0};
    assert_null(state_file_open("/no/such/file.state", VERSION, &err));
    assert_int_equal(err.code, ERR_INPUT);
    assert_non_null(strstr(err.message, "/no/such/file.state"));
    assert_null(state_file_open(scratch_folder, VERSION, &err));
    assert_int_equal(err.code, ERR_INPUT);
}

/* ---- Fuzz: several mutations at once, with the checksums made right again so that they reach the deeper
 * checks ---- */

static uint64_t random_stream, random_counter;

static uint64_t next_random(void) {
    return random_bits(random_stream, random_counter++);
}

/* Numbers at which sizes overflow or just fit. */
static uint64_t interesting_number(size_t size) {
    static const uint64_t numbers[] = {0,
                                       1,
                                       2,
                                       63,
                                       64,
                                       255,
                                       256,
                                       1u << 31,
                                       UINT32_MAX,
                                       1ull << 32,
                                       1ull << 60,
                                       1ull << 61,
                                       1ull << 62,
                                       INT64_MAX,
                                       1ull << 63,
                                       UINT64_MAX,
                                       UINT64_MAX - 63};
    uint64_t pick = next_random() % 24;
    if (pick < sizeof numbers / sizeof numbers[0])
        return numbers[pick];
    return pick < 20 ? size - next_random() % 70 : next_random() % (size + 100);
}

static void mutate(unsigned char *bytes, size_t size) {
    size_t at = next_random() % size, field = next_random() % SAMPLE_COUNT;
    static const int places[] = {IN_TYPE, IN_COMPONENTS, IN_ELEMENTS, IN_ELEMENTS, IN_OFFSET, IN_OFFSET};
    int place = places[next_random() % (sizeof places / sizeof places[0])];
    switch (next_random() % 6) {
    case 0:
        bytes[at] = (unsigned char)next_random();
        break;
    case 1:
        put32(bytes, at % (HEADER_SIZE + SAMPLE_COUNT * ENTRY_SIZE), (uint32_t)interesting_number(size));
        break;
    case 2:
        put32(bytes, AT_COUNT, (uint32_t)(next_random() % (SAMPLE_COUNT + 3)));
        break;
    default:
        if (place == IN_TYPE)
            put32(bytes, entry_at((int)field) + IN_TYPE, (uint32_t)(next_random() % 8));
        else if (place == IN_COMPONENTS)
            put32(bytes, entry_at((int)field) + IN_COMPONENTS, (uint32_t)interesting_number(size));
        else
            put64(bytes, entry_at((int)field) + (size_t)place, interesting_number(size));
    }
}

static void repair_data_hashes(unsigned char *bytes, size_t size) {
    for (int i = 0; i < SAMPLE_COUNT; i++) {
        unsigned char *entry = bytes + entry_at(i);
        uint32_t type, components;
        memcpy(&type, entry + IN_TYPE, 4);
        memcpy(&components, entry + IN_COMPONENTS, 4);
        uint64_t offset = get64(entry, IN_OFFSET), count = get64(entry, IN_ELEMENTS);
        uint64_t element = components * (uint64_t)state_type_size((StateType)type);
        if (offset <= size && (element == 0 || count <= (size - offset) / element))
            put64(entry, IN_HASH, XXH3_64bits(bytes + offset, count * element));
    }
}

static void hostile_bytes_do_no_harm(void **state) {
    (void)state;
    size_t size;
    unsigned char *good = sample_bytes(&size), *bad = malloc(size + 64);
    int accepted = 0;
    uint64_t sum = 0;
    for (uint64_t round = 0; round < 20000; round++) {
        random_stream = round;
        random_counter = 0;
        size_t length =
            next_random() % 8 == 0 ? HEADER_SIZE + next_random() % (size + 64 - HEADER_SIZE) : size;
        memset(bad, 0, size + 64);
        memcpy(bad, good, size);
        for (uint64_t i = 1 + next_random() % 3; i > 0; i--)
            mutate(bad, size);
        if (next_random() % 4)
            repair_data_hashes(bad, size);
        repair_table_hash(bad, length);
        Err err = {0};
        StateFile *file = state_file_parse("x.state", bad, length, VERSION, &err);
        if (!file) {
            assert_int_equal(err.code, ERR_INPUT);
            assert_true(strlen(err.message) > 9);
            continue;
        }
        /* Whatever was accepted can be read to its last byte: the sanitizers watch. */
        accepted++;
        for (uint32_t i = 0; i < state_file_field_count(file); i++) {
            const StateField *field = state_file_field_at(file, i);
            uint64_t n = field->count * field->components * state_type_size(field->type);
            for (uint64_t k = 0; k < n; k++)
                sum += ((const unsigned char *)field->data)[k];
        }
        state_file_close(file);
    }
    /* Mutations that keep the sizes consistent do get through, most do not. */
    assert_in_range(accepted, 100, 10000);
    assert_true(sum > 0);
    free(bad);
    free(good);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_goes_in_comes_out),
        cmocka_unit_test(layout_is_the_documented_one),
        cmocka_unit_test(no_fields_and_most_fields),
        cmocka_unit_test(lookup_says_what_differs),
        cmocka_unit_test(writer_refuses_wrong_fields),
        cmocka_unit_test(failed_write_keeps_the_old_file),
        cmocka_unit_test(every_kind_of_damage_is_named),
        cmocka_unit_test(damage_outside_the_table_is_named),
        cmocka_unit_test(any_truncation_is_refused),
        cmocka_unit_test(any_changed_bit_is_refused),
        cmocka_unit_test(open_reports_files_that_are_not_there),
        cmocka_unit_test(hostile_bytes_do_no_harm),
    };
    return cmocka_run_group_tests_name("state file", tests, setup, scratch_leave);
}
