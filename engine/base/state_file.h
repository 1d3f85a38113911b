/* Container of named, typed, counted arrays: the format of checkpoints, rest tiles and particle frames.
 *
 * Layout, little endian: magic "SKIFFST1" (8 bytes), u32 version, u32 field count, u64 XXH3 of the field
 * table, then a table of fields (name[48] zero-padded, u32 type, u32 components, u64 count, u64 byte offset,
 * u64 XXH3 of the data), then the data, each field aligned to 64 bytes. A reader treats every byte as
 * hostile: sizes are checked against the file before use, names must be terminated, unique and printable,
 * offsets in range, checksums right. */
#ifndef SKIFF_BASE_STATE_FILE_H
#define SKIFF_BASE_STATE_FILE_H

#include "err.h"

#include <stdint.h>

typedef enum StateType { STATE_U8 = 1, STATE_U32, STATE_U64, STATE_I32, STATE_F32, STATE_F64 } StateType;

enum { STATE_NAME_SIZE = 48, STATE_MAX_FIELDS = 256 };

typedef struct StateField {
    char name[STATE_NAME_SIZE];
    StateType type;
    uint32_t components; /* scalars an element, >= 1 */
    uint64_t count;      /* elements */
    const void *data;    /* components * count scalars, contiguous */
} StateField;

typedef struct StateFile StateFile;

size_t state_type_size(StateType type);

/* Writes atomically (temporary name, flush, rename). Borrowed data. ERR_IO on failure, nothing half-written.
 */
bool state_file_write(const char *path, uint32_t version, const StateField *fields, uint32_t field_count,
                      Err *err);

/* Reads and verifies a whole file. NULL with ERR_INPUT (not such a file, damaged, other version: the message
 * says found and expected) or ERR_IO. The fields' data stays valid until state_file_close. */
StateFile *state_file_open(const char *path, uint32_t version, Err *err);
/* The same from memory (copied); `name` is used in messages. */
StateFile *state_file_parse(const char *name, const void *bytes, size_t size, uint32_t version, Err *err);
void state_file_close(StateFile *file);

uint32_t state_file_field_count(const StateFile *file);
const StateField *state_file_field_at(const StateFile *file, uint32_t index);
/* Field by name, checked to have this type and these components and, unless count is UINT64_MAX, this count.
 * NULL and ERR_INPUT naming what is wrong. */
const StateField *state_file_field(const StateFile *file, const char *name, StateType type,
                                   uint32_t components, uint64_t count, Err *err);

#endif
