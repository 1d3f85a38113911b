/* Tables that bind JSON objects to C structs. One row a key; the same row reads, checks, writes, documents
 * (JSON schema) and edits (--set) it.
 *
 * A struct starts out as its type's `init` leaves it, which is where defaults live. A field that may be
 * absent holds a sentinel then: NaN or infinity in numbers and vectors, NULL in text and objects; it reads
 * and writes as null. */
#ifndef SKIFF_APP_FIELD_H
#define SKIFF_APP_FIELD_H

#include "problems.h"

#include <jansson.h>
#include <stddef.h>
#include <stdint.h>

typedef struct ObjectType ObjectType;

/* C type of the struct's member in brackets. */
typedef enum FieldType {
    FIELD_FLOAT,  /* (float) */
    FIELD_DOUBLE, /* (double) */
    FIELD_INT,    /* (int) */
    FIELD_BOOL,   /* (bool) */
    FIELD_VEC3,   /* (float[3]) */
    FIELD_ENUM,   /* (int) position in `names` */
    FIELD_FLAGS,  /* (uint32_t) list of `names`, bit = position; UINT32_MAX: absent */
    FIELD_TEXT,   /* (const char *) */
    FIELD_NAME,   /* (const char *) letters, digits, _ and -, at most 63 */
    FIELD_FILE, /* (const char *) file name, relative to the folder of the file it stands in; absolute in the
                   struct */
    FIELD_OBJECT, /* (pointer to a struct of `object`) */
    FIELD_LIST    /* (FieldList of structs of `object`, at most `max`) */
} FieldType;

enum {
    FIELD_REQUIRED = 1, /* of a group: one of its members */
    FIELD_NULLABLE = 2  /* may be null or absent */
};

typedef struct Field {
    const char *key;
    FieldType type;
    size_t offset;
    double min, max;   /* of numbers and of each component */
    const char *unit;  /* NULL where there is none */
    const char *names; /* "a|b|c" */
    const char *help;
    unsigned flags;
    unsigned variants; /* values of the type's variant_key (bit = position) for which the key has a meaning;
                          0: all */
    int group;         /* of the fields with the same number at most one is given; 0: none */
    const ObjectType *object;
} Field;

typedef struct FieldList {
    void *items;
    int count;
} FieldList;

/* What concerns several keys at once. Not asked while one of them is missing or wrong. */
typedef struct FieldRule {
    const char *keys; /* "a|b" */
    void (*check)(void *object, Problems *problems);
} FieldRule;

struct ObjectType {
    const char *help;
    const Field *fields;
    int field_count;
    bool (*more)(int index,
                 Field *field); /* rows after those of the table, made from another list; or NULL */
    size_t size;                /* of the struct */
    void (*init)(void *object);
    const FieldRule *rules;
    int rule_count;
    const char *variant_key; /* key of the FIELD_ENUM that selects `variants`, or NULL */
};

/* Memory that lives as long as the structs: freed as one. Zero-initialise. */
typedef struct Pool {
    void **blocks;
    size_t count;
} Pool;
void *pool_alloc(Pool *pool, size_t size); /* zeroed; ends the program when memory is exhausted */
void pool_free(Pool *pool);

typedef struct FieldReader {
    Problems *problems;
    Pool *pool;
    const char *folder; /* that relative file names start from */
} FieldReader;

/* Row `index` of a type; false past the last one. */
bool field_at(const ObjectType *type, int index, Field *field);
bool field_find(const ObjectType *type, const char *key, Field *field);
/* Position of a name in "a|b|c", or -1. */
int field_name_index(const char *names, const char *name);
/* Name at a position, copied; "" when there is none. */
void field_name_at(const char *names, int index, char *out, size_t size);

/* Fills *object (of type->size bytes) from JSON, starting at its defaults; all problems go to the reader's
 * list. Text is borrowed from `value`. */
void field_read(const ObjectType *type, const json_t *value, void *object, FieldReader *reader);
/* Everything that has a meaning, defaults included. New reference. */
json_t *field_write(const ObjectType *type, const void *object);
/* JSON schema, draft 2020-12, of the objects of this type. New reference. */
json_t *field_schema(const ObjectType *type);

/* Applies "path=value" to a document of this type before it is read. A path whose first key is unknown is
 * looked up below `shortcut` as well. path receives the full path. ERR_USAGE when there is no such key; the
 * value itself is checked by field_read. */
bool field_edit(const ObjectType *type, const char *shortcut, const char *edit, json_t *document, char *path,
                size_t size, Err *err);

/* What each type reads, writes and says of itself (field_types.c). */
typedef struct FieldTypeRow {
    void (*read)(const Field *field, const json_t *value, void *member, FieldReader *reader);
    json_t *(*write)(const Field *field, const void *member);
    void (*schema)(const Field *field, json_t *schema);
    void (*describe)(const Field *field, char *out, size_t size); /* "a number from 0 to 1 m" */
} FieldTypeRow;
const FieldTypeRow *field_type_row(FieldType type);

/* describe, with "or null" where that is allowed. */
void field_describe(const Field *field, char *out, size_t size);

#endif
