/* Writes and reads the container described in state_file.h.
 *
 * A file has exactly one valid form: fields lie in the order of the table, each at the next multiple of 64
 * bytes, with zeros between them and nothing behind. The reader demands that form, so together with the
 * checksums no byte can change unnoticed and fields cannot overlap. It does not convert: a type, a shape or a
 * version that differs from the expected one is an error. */
#include "state_file.h"

#include "arena.h"
#include "file.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#define XXH_INLINE_ALL
#include <xxhash.h>

#if defined(__BYTE_ORDER__) && __BYTE_ORDER__ != __ORDER_LITTLE_ENDIAN__
#error "states are stored in the byte order of the machine, which must be little endian"
#endif

static const char state_magic[8] = {'S', 'K', 'I', 'F', 'F', 'S', 'T', '1'};

/* As on disk. Neither has padding. */
typedef struct Header {
    char magic[8];
    uint32_t version, field_count;
    uint64_t table_hash;
} Header;

typedef struct Entry {
    char name[STATE_NAME_SIZE];
    uint32_t type, components;
    uint64_t count, offset, hash;
} Entry;

_Static_assert(sizeof(Header) == 24 && sizeof(Entry) == 80, "the format's sizes");

struct StateFile {
    char *name;  /* for messages */
    char *bytes; /* the whole file; fields point into it */
    uint32_t field_count;
    StateField fields[STATE_MAX_FIELDS];
};

static const struct {
    const char *name;
    size_t size;
} state_types[] = {[STATE_U8] = {"u8", 1},   [STATE_U32] = {"u32", 4}, [STATE_U64] = {"u64", 8},
                   [STATE_I32] = {"i32", 4}, [STATE_F32] = {"f32", 4}, [STATE_F64] = {"f64", 8}};

size_t state_type_size(StateType type) {
    return type >= STATE_U8 && type <= STATE_F64 ? state_types[type].size : 0;
}

static uint64_t align_up(uint64_t offset) {
    return (offset + 63) / 64 * 64;
}

/* NULL, or what is wrong with a name. */
static const char *name_fault(const char name[STATE_NAME_SIZE]) {
    size_t length = 0;
    for (; length < STATE_NAME_SIZE && name[length]; length++)
        if (name[length] < 0x20 || name[length] > 0x7e)
            return "has a name that is not printable ASCII";
    if (length == 0)
        return "has no name";
    if (length == STATE_NAME_SIZE)
        return "has a name that does not end";
    return NULL;
}

/* Bytes of a field's data. False when its type, components or count are impossible. */
static bool field_bytes(uint32_t type, uint32_t components, uint64_t count, uint64_t *bytes) {
    uint64_t scalars;
    *bytes = 0;
    if (type < STATE_U8 || type > STATE_F64 || components == 0)
        return false;
    return !__builtin_mul_overflow(count, (uint64_t)components, &scalars) &&
           !__builtin_mul_overflow(scalars, (uint64_t)state_types[type].size, bytes);
}

/* ---- Writing ---- */

/* Fills the table from the fields and checks what the caller passed. */
static bool make_table(const char *path, const StateField *fields, uint32_t field_count, Entry *table,
                       Err *err) {
    uint64_t end = sizeof(Header) + (uint64_t)field_count * sizeof(Entry);
    for (uint32_t i = 0; i < field_count; i++) {
        const StateField *field = &fields[i];
        const char *fault = name_fault(field->name);
        if (fault)
            return err_set(err, ERR_USAGE, "%s: field %u %s", path, i, fault);
        for (uint32_t k = 0; k < i; k++)
            if (strcmp(field->name, fields[k].name) == 0)
                return err_set(err, ERR_USAGE, "%s: two fields are called '%s'", path, field->name);
        uint64_t bytes;
        if (!field_bytes(field->type, field->components, field->count, &bytes) ||
            bytes > INT64_MAX - end - 64)
            return err_set(err, ERR_USAGE, "%s: field '%s' has an impossible type or size", path,
                           field->name);
        Entry *entry = &table[i];
        memset(entry, 0, sizeof *entry);
        memcpy(entry->name, field->name, strlen(field->name));
        entry->type = field->type;
        entry->components = field->components;
        entry->count = field->count;
        entry->offset = align_up(end);
        entry->hash = XXH3_64bits(field->data, bytes);
        end = entry->offset + bytes;
    }
    return true;
}

static bool write_all(FILE *stream, const Header *header, const Entry *table, const StateField *fields) {
    static const char zeros[64];
    uint32_t n = header->field_count;
    uint64_t end = sizeof *header + n * sizeof *table;
    if (fwrite(header, sizeof *header, 1, stream) != 1 || fwrite(table, sizeof *table, n, stream) != n)
        return false;
    for (uint32_t i = 0; i < n; i++) {
        size_t gap = table[i].offset - end;
        uint64_t bytes;
        field_bytes(table[i].type, table[i].components, table[i].count, &bytes);
        if (fwrite(zeros, 1, gap, stream) != gap)
            return false;
        if (bytes > 0 && fwrite(fields[i].data, 1, bytes, stream) != bytes)
            return false;
        end = table[i].offset + bytes;
    }
    return true;
}

bool state_file_write(const char *path, uint32_t version, const StateField *fields, uint32_t field_count,
                      Err *err) {
    if (field_count > STATE_MAX_FIELDS)
        return err_set(err, ERR_USAGE, "%s: %u fields, at most %d fit", path, field_count, STATE_MAX_FIELDS);
    Entry table[STATE_MAX_FIELDS];
    if (!make_table(path, fields, field_count, table, err))
        return false;
    Header header = {.version = version, .field_count = field_count};
    memcpy(header.magic, state_magic, sizeof state_magic);
    header.table_hash = XXH3_64bits(table, field_count * sizeof table[0]);

    FileWriter writer;
    if (!file_begin(&writer, path, err))
        return false;
    if (!write_all(writer.stream, &header, table, fields)) {
        int fault = errno;
        file_abort(&writer);
        return err_set(err, ERR_IO, "%s: cannot write: %s", path, strerror(fault));
    }
    return file_commit(&writer, err);
}

/* ---- Reading ---- */

/* Checks one entry against the file and returns its field. *end: where the field before it ended, then where
 * this one ends. */
static bool read_entry(StateFile *file, uint32_t index, const Entry *entry, size_t size, uint64_t *end,
                       Err *err) {
    const char *fault = name_fault(entry->name);
    if (fault)
        return err_set(err, ERR_INPUT, "%s: damaged: field %u %s", file->name, index, fault);
    for (size_t i = strlen(entry->name); i < STATE_NAME_SIZE; i++)
        if (entry->name[i])
            return err_set(err, ERR_INPUT, "%s: damaged: field %u has bytes behind its name", file->name,
                           index);
    for (uint32_t i = 0; i < index; i++)
        if (strcmp(entry->name, file->fields[i].name) == 0)
            return err_set(err, ERR_INPUT, "%s: damaged: two fields are called '%s'", file->name,
                           entry->name);
    uint64_t bytes;
    if (!field_bytes(entry->type, entry->components, entry->count, &bytes))
        return err_set(err, ERR_INPUT, "%s: damaged: field '%s' has type %u, %u components, %llu elements",
                       file->name, entry->name, entry->type, entry->components,
                       (unsigned long long)entry->count);
    uint64_t offset = align_up(*end);
    if (entry->offset != offset)
        return err_set(err, ERR_INPUT, "%s: damaged: field '%s' lies at byte %llu, expected %llu", file->name,
                       entry->name, (unsigned long long)entry->offset, (unsigned long long)offset);
    if (offset > size || bytes > size - offset)
        return err_set(err, ERR_INPUT,
                       "%s: cut short: field '%s' needs %llu bytes from byte %llu, the file has %zu",
                       file->name, entry->name, (unsigned long long)bytes, (unsigned long long)offset, size);
    for (uint64_t i = *end; i < offset; i++)
        if (file->bytes[i])
            return err_set(err, ERR_INPUT, "%s: damaged: byte %llu between fields is not zero", file->name,
                           (unsigned long long)i);
    const char *data = file->bytes + offset;
    if (XXH3_64bits(data, bytes) != entry->hash)
        return err_set(err, ERR_INPUT, "%s: damaged: field '%s' does not match its checksum", file->name,
                       entry->name);

    StateField *field = &file->fields[index];
    memcpy(field->name, entry->name, STATE_NAME_SIZE);
    field->type = (StateType)entry->type;
    field->components = entry->components;
    field->count = entry->count;
    field->data = data;
    *end = offset + bytes;
    return true;
}

static bool read_fields(StateFile *file, size_t size, uint32_t version, Err *err) {
    Header header;
    if (size < sizeof header.magic || memcmp(file->bytes, state_magic, sizeof state_magic) != 0)
        return err_set(err, ERR_INPUT, "%s: not a Skiff state file", file->name);
    if (size < sizeof header)
        return err_set(err, ERR_INPUT, "%s: cut short: %zu bytes, the header alone has %zu", file->name, size,
                       sizeof header);
    memcpy(&header, file->bytes, sizeof header);
    if (header.version != version)
        return err_set(err, ERR_INPUT, "%s: version %u, expected %u", file->name, header.version, version);
    if (header.field_count > STATE_MAX_FIELDS)
        return err_set(err, ERR_INPUT, "%s: damaged: %u fields, at most %d can be", file->name,
                       header.field_count, STATE_MAX_FIELDS);
    const char *table = file->bytes + sizeof header;
    size_t table_size = header.field_count * sizeof(Entry);
    if (table_size > size - sizeof header)
        return err_set(err, ERR_INPUT, "%s: cut short: %zu bytes, the table of %u fields ends at byte %zu",
                       file->name, size, header.field_count, sizeof header + table_size);
    if (XXH3_64bits(table, table_size) != header.table_hash)
        return err_set(err, ERR_INPUT, "%s: damaged: the table of fields does not match its checksum",
                       file->name);

    uint64_t end = sizeof header + table_size;
    for (uint32_t i = 0; i < header.field_count; i++) {
        Entry entry;
        memcpy(&entry, table + i * sizeof entry, sizeof entry);
        if (!read_entry(file, i, &entry, size, &end, err))
            return false;
        file->field_count = i + 1;
    }
    if (end != size)
        return err_set(err, ERR_INPUT, "%s: damaged: %zu bytes, expected %llu", file->name, size,
                       (unsigned long long)end);
    return true;
}

/* Takes ownership of bytes, which malloc made: aligned for every scalar, and fields lie at multiples of 64.
 */
static StateFile *parse_owned(const char *name, char *bytes, size_t size, uint32_t version, Err *err) {
    StateFile *file = calloc(1, sizeof *file);
    char *own_name = strdup(name);
    if (!file || !own_name) {
        free(file);
        free(own_name);
        free(bytes);
        err_set(err, ERR_IO, "%s: not enough memory to read it", name);
        return NULL;
    }
    file->name = own_name;
    file->bytes = bytes;
    if (read_fields(file, size, version, err))
        return file;
    state_file_close(file);
    return NULL;
}

StateFile *state_file_open(const char *path, uint32_t version, Err *err) {
    char *bytes;
    size_t size;
    if (!file_read(path, memory_available(), &bytes, &size, err))
        return NULL;
    return parse_owned(path, bytes, size, version, err);
}

StateFile *state_file_parse(const char *name, const void *bytes, size_t size, uint32_t version, Err *err) {
    char *copy = malloc(size ? size : 1);
    if (!copy) {
        err_set(err, ERR_IO, "%s: not enough memory for %zu bytes", name, size);
        return NULL;
    }
    if (size)
        memcpy(copy, bytes, size);
    return parse_owned(name, copy, size, version, err);
}

void state_file_close(StateFile *file) {
    if (!file)
        return;
    free(file->name);
    free(file->bytes);
    free(file);
}

uint32_t state_file_field_count(const StateFile *file) {
    return file->field_count;
}

const StateField *state_file_field_at(const StateFile *file, uint32_t index) {
    return index < file->field_count ? &file->fields[index] : NULL;
}

const StateField *state_file_field(const StateFile *file, const char *name, StateType type,
                                   uint32_t components, uint64_t count, Err *err) {
    for (uint32_t i = 0; i < file->field_count; i++) {
        const StateField *field = &file->fields[i];
        if (strcmp(field->name, name) != 0)
            continue;
        if (field->type != type || field->components != components) {
            err_set(err, ERR_INPUT, "%s: field '%s' is %u x %s, expected %u x %s", file->name, name,
                    field->components, state_types[field->type].name, components, state_types[type].name);
            return NULL;
        }
        if (count != UINT64_MAX && field->count != count) {
            err_set(err, ERR_INPUT, "%s: field '%s' has %llu elements, expected %llu", file->name, name,
                    (unsigned long long)field->count, (unsigned long long)count);
            return NULL;
        }
        return field;
    }
    err_set(err, ERR_INPUT, "%s: field '%s' is missing", file->name, name);
    return NULL;
}
