/* Wavefront OBJ input: v, f and usemtl records. Normals, texture coordinates and groups are not kept, and
 * what a material looks like is the business of whoever draws: only its name is read.
 *
 * The text is hostile: it need not end in a newline or a zero, and nothing in it is trusted before it is
 * checked. Two passes, so that memory is asked for once and a face may name a vertex that follows it. */
#include "mesh.h"

#include "base/file.h"
#include "mesh_build.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    TOKEN_SIZE = 64,          /* longest number or corner, with its terminator */
    FILE_MAX_SIZE = 1 << 30,  /* bytes */
    INDEX_LIMIT = 2000000000, /* no file within FILE_MAX_SIZE has as many vertices */
};

static const double coordinate_limit =
    1e9; /* m; squares and cubes of it are still far from overflow in float32 */

typedef struct Reader {
    const char *name;
    const char *next, *end; /* text not yet read */
    uint32_t line;          /* number of the line being read */
    const char *cursor, *line_end;
    char token[TOKEN_SIZE];
    Mesh *mesh;
    uint32_t vertex_count, triangle_count; /* read so far */
    uint8_t material;                      /* of the next face */
    Err *err;
} Reader;

static bool is_blank(char c) {
    return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

static bool next_line(Reader *reader) {
    if (reader->next == reader->end)
        return false;
    const char *newline = memchr(reader->next, '\n', (size_t)(reader->end - reader->next));
    reader->cursor = reader->next;
    reader->line_end = newline ? newline : reader->end;
    reader->next = newline ? newline + 1 : reader->end;
    reader->line++;
    return true;
}

/* The next word of the line, cut to fit `token`; false at the end of the line or at a comment. A cut word is
 * no number and no corner any more: its last character is replaced. */
static bool next_token(Reader *reader) {
    while (reader->cursor < reader->line_end && is_blank(*reader->cursor))
        reader->cursor++;
    if (reader->cursor == reader->line_end || *reader->cursor == '#')
        return false;
    size_t length = 0;
    for (; reader->cursor < reader->line_end && !is_blank(*reader->cursor); reader->cursor++, length++) {
        unsigned char c = (unsigned char)*reader->cursor;
        if (length < TOKEN_SIZE - 1) /* unprintable bytes must not reach a terminal through a message */
            reader->token[length] = (char)(c > ' ' && c < 127 ? c : '?');
    }
    if (length >= TOKEN_SIZE) {
        length = TOKEN_SIZE - 1;
        reader->token[length - 1] = '~';
    }
    reader->token[length] = '\0';
    return true;
}

static bool read_coordinate(Reader *reader, int axis, float *out) {
    const char *allowed = "a decimal number within +-1e9";
    if (!next_token(reader))
        return err_set(reader->err, ERR_INPUT,
                       "%s:%" PRIu32 ": vertex without %c coordinate; three numbers are needed", reader->name,
                       reader->line, "xyz"[axis]);
    /* The set keeps out nan, inf and hexadecimal numbers, which strtod would take. */
    char *rest = reader->token;
    double value = 0.0;
    if (strspn(reader->token, "0123456789+-.eE") == strlen(reader->token))
        value = strtod(reader->token, &rest);
    if (rest == reader->token || *rest != '\0' || !(fabs(value) <= coordinate_limit))
        return err_set(reader->err, ERR_INPUT, "%s:%" PRIu32 ": %c coordinate '%s' is not %s", reader->name,
                       reader->line, "xyz"[axis], reader -> token, allowed);
    *out = (float)value;
    return true;
}

/* An integer other than zero at *text, which is moved past it. */
static bool parse_index(const char **text, int64_t *out) {
    const char *c = *text;
    bool negative = *c == '-';
    c += negative;
    int64_t value = 0;
    if (*c < '0' || *c > '9')
        return false;
    for (; *c >= '0' && *c <= '9'; c++)
        value = value < INDEX_LIMIT ? 10 * value + (*c - '0') : value;
    *text = c;
    *out = negative ? -value : value;
    return value != 0;
}

/* One corner of a face: v, v/vt, v//vn or v/vt/vn, of which v is kept. */
static bool parse_corner(Reader *reader, uint32_t *vertex) {
    const char *text = reader->token;
    int64_t index = 0, other = 0;
    bool good = parse_index(&text, &index);
    if (good && *text == '/') {
        text++;
        bool texture = *text != '/';
        good = !texture || parse_index(&text, &other);
        if (good && *text == '/') {
            text++;
            good = parse_index(&text, &other);
        }
    }
    if (!good || *text != '\0')
        return err_set(reader->err, ERR_INPUT,
                       "%s:%" PRIu32
                       ": face corner '%s' is none of v, v/vt, v//vn, v/vt/vn with integers other than 0",
                       reader->name, reader->line, reader->token);
    int64_t seen = reader->vertex_count, all = reader->mesh->vertex_count;
    if (index > all || index < -seen) {
        if (all == 0)
            return err_set(reader->err, ERR_INPUT,
                           "%s:%" PRIu32 ": vertex index %s; the file has no vertices", reader->name,
                           reader->line, reader->token);
        return err_set(reader->err, ERR_INPUT,
                       "%s:%" PRIu32 ": vertex index of corner '%s' is out of range; 1..%" PRId64
                       " or -%" PRId64 "..-1 is allowed here",
                       reader->name, reader->line, reader->token, all, seen);
    }
    *vertex = (uint32_t)(index > 0 ? index - 1 : seen + index);
    return true;
}

static bool read_face(Reader *reader) {
    uint32_t first = 0, previous = 0, vertex = 0, corner = 0;
    for (; next_token(reader); corner++) {
        if (!parse_corner(reader, &vertex))
            return false;
        if (corner > 0 && (vertex == first || vertex == previous))
            return err_set(reader->err, ERR_INPUT, "%s:%" PRIu32 ": corner '%s' is in this face twice",
                           reader->name, reader->line, reader->token);
        if (corner == 0)
            first = vertex;
        if (corner >= 2) {
            if (reader->mesh->materials)
                reader->mesh->materials[reader->triangle_count] = reader->material;
            uint32_t *triangle = reader->mesh->triangles[reader->triangle_count++];
            triangle[0] = first;
            triangle[1] = previous;
            triangle[2] = vertex;
        }
        previous = vertex;
    }
    if (corner < 3)
        return err_set(reader->err, ERR_INPUT,
                       "%s:%" PRIu32 ": face with %" PRIu32 " corners; at least 3 are needed", reader->name,
                       reader->line, corner);
    return true;
}

/* Makes `name` the material of the faces that follow. */
static bool use_material(Reader *reader, const char *name) {
    Mesh *mesh = reader->mesh;
    uint32_t index = 0;
    while (index < mesh->material_count && strcmp(mesh->material_names[index], name) != 0)
        index++;
    if (index == MESH_MAX_MATERIALS)
        return err_set(reader->err, ERR_INPUT,
                       "%s:%" PRIu32 ": material '%s' is one more than the %d allowed", reader->name,
                       reader->line, name, (int)MESH_MAX_MATERIALS);
    if (index == mesh->material_count)
        strcpy(mesh->material_names[mesh->material_count++], name);
    reader->material = (uint8_t)index;
    return true;
}

static bool read_material(Reader *reader) {
    const bool found = next_token(reader);
    if (!found || strlen(reader->token) >= MESH_NAME_SIZE)
        return err_set(reader->err, ERR_INPUT,
                       "%s:%" PRIu32 ": usemtl '%s': a name of 1 to %d characters is needed", reader->name,
                       reader->line, found ? reader->token : "", MESH_NAME_SIZE - 1);
    return use_material(reader, reader->token);
}

static bool allocate_materials(Mesh *mesh, size_t triangle_count, const char *name, Err *err) {
    mesh->materials = calloc(triangle_count + 1, sizeof *mesh->materials);
    mesh->material_names = calloc(MESH_MAX_MATERIALS, sizeof *mesh->material_names);
    return (mesh->materials && mesh->material_names) ||
           err_set(err, ERR_INPUT, "%s: no memory for the materials of %zu triangles", name, triangle_count);
}

static bool read_records(Reader *reader) {
    while (next_line(reader)) {
        if (!next_token(reader))
            continue;
        if (strcmp(reader->token, "v") == 0) {
            float *out = reader->mesh->vertices[reader->vertex_count];
            for (int k = 0; k < 3; k++)
                if (!read_coordinate(reader, k, &out[k]))
                    return false;
            reader->vertex_count++; /* a weight or a colour may follow; neither is used */
        } else if (strcmp(reader->token, "f") == 0) {
            if (reader->mesh->materials && reader->mesh->material_count == 0 && !use_material(reader, ""))
                return false;
            if (!read_face(reader))
                return false;
        } else if (strcmp(reader->token, "usemtl") == 0 && !read_material(reader)) {
            return false;
        }
    }
    return true;
}

static void count_records(Reader reader, size_t *vertex_count, size_t *triangle_count, bool *has_materials) {
    *vertex_count = *triangle_count = 0;
    *has_materials = false;
    while (next_line(&reader)) {
        if (!next_token(&reader))
            continue;
        if (strcmp(reader.token, "v") == 0) {
            ++*vertex_count;
        } else if (strcmp(reader.token, "usemtl") == 0) {
            *has_materials = true;
        } else if (strcmp(reader.token, "f") == 0) {
            size_t corners = 0;
            while (next_token(&reader))
                corners++;
            *triangle_count += corners > 2 ? corners - 2 : 0;
        }
    }
}

bool mesh_parse_obj(const char *name, const char *text, size_t size, Mesh *mesh, Err *err) {
    memset(mesh, 0, sizeof *mesh);
    if (size > FILE_MAX_SIZE)
        return err_set(err, ERR_INPUT, "%s: %zu bytes; at most %d are allowed", name, size,
                       (int)FILE_MAX_SIZE);
    if (size == 0)
        return err_set(err, ERR_INPUT, "%s: empty; v and f records are needed", name);
    bool marked = size >= 3 && memcmp(text, "\xef\xbb\xbf", 3) == 0; /* UTF-8 byte order mark */
    Reader reader = {
        .name = name, .next = text + (marked ? 3 : 0), .end = text + size, .mesh = mesh, .err = err};
    size_t vertex_count, triangle_count;
    bool has_materials;
    count_records(reader, &vertex_count, &triangle_count, &has_materials);
    if (!mesh_allocate(mesh, name, vertex_count, triangle_count, err))
        return false;
    if ((has_materials && !allocate_materials(mesh, triangle_count, name, err)) || !read_records(&reader)) {
        mesh_free(mesh);
        return false;
    }
    if (triangle_count == 0) {
        mesh_free(mesh);
        return err_set(err, ERR_INPUT, "%s: no faces (f records) in %" PRIu32 " lines", name, reader.line);
    }
    return mesh_finish(mesh, name, err);
}

bool mesh_load_obj(const char *path, Mesh *mesh, Err *err) {
    char *text = NULL;
    size_t size = 0;
    memset(mesh, 0, sizeof *mesh);
    if (!file_read(path, FILE_MAX_SIZE, &text, &size, err))
        return false;
    bool ok = mesh_parse_obj(path, text, size, mesh, err);
    free(text);
    return ok;
}
