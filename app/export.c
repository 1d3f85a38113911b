/* Three formats from one table of attributes:
 *
 *   vtk   XML UnstructuredGrid with raw appended arrays and a vertex cell for each particle (without cells
 *         ParaView shows nothing and other readers refuse the file)
 *   ply   binary little endian, version 1.0; ids as doubles, since it has no 64-bit integers
 *   bgeo  Houdini's classic version 5, as Partio reads and writes it: big endian, 32 bits, no primitives
 *
 * Nothing is compressed. */
#include "export.h"

#include "engine/base/file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

typedef struct Source {
    const Frame *frame;
    float rest_density;
} Source;

typedef enum ValueType { VALUE_ID, VALUE_FLOAT, VALUE_DOUBLE } ValueType;

typedef struct Attribute {
    const char *name, *bgeo_name;
    ValueType type;
    int components; /* 1 or 3 */
    bool of_window;
    void (*get)(const Source *source, uint32_t i, double value[3]); /* not of VALUE_ID */
} Attribute;

static void get_velocity(const Source *source, uint32_t i, double value[3]) {
    for (int k = 0; k < 3; k++)
        value[k] = (double)source->frame->velocity[i][k];
}

static void get_density(const Source *source, uint32_t i, double value[3]) {
    value[0] = (double)(source->frame->density[i] * source->rest_density);
}

static void get_birth(const Source *source, uint32_t i, double value[3]) {
    value[0] = source->frame->birth[i];
}

static void get_edge(const Source *source, uint32_t i, double value[3]) {
    value[0] = (double)source->frame->edge[i];
}

static const Attribute attributes[] = {
    {"id", "id", VALUE_ID, 1, false, NULL},
    {"velocity", "v", VALUE_FLOAT, 3, false, get_velocity},
    {"density", "density", VALUE_FLOAT, 1, false, get_density},
    {"birth", "birth", VALUE_DOUBLE, 1, false, get_birth},
    {"edge_distance", "edge_distance", VALUE_FLOAT, 1, true, get_edge},
};
enum { ATTRIBUTE_COUNT = sizeof attributes / sizeof *attributes };

/* Attribute `a` of this frame; NULL: it has no meaning here. */
static const Attribute *attribute_at(const Source *source, int a) {
    return attributes[a].of_window && !source->frame->has_window ? NULL : &attributes[a];
}

static void position_of(const Source *source, uint32_t i, double value[3]) {
    for (int k = 0; k < 3; k++)
        value[k] = source->frame->origin[k] + (double)source->frame->position[i][k];
}

static bool check_ids(const Source *source, uint64_t most, const char *format, Err *err) {
    for (uint32_t i = 0; i < source->frame->live; i++)
        if (source->frame->id[i] > most)
            return err_set(err, ERR_INPUT, "particle %llu: %s holds ids up to %llu",
                           (unsigned long long)source->frame->id[i], format, (unsigned long long)most);
    return true;
}

/* ---- Bytes. A write that fails shows when the file is committed. ---- */

static void put(FILE *stream, const void *bytes, size_t size) {
    fwrite(bytes, 1, size, stream);
}

static void put_real(FILE *stream, ValueType type, double value) {
    float single = (float)value;
    if (type == VALUE_FLOAT)
        put(stream, &single, sizeof single);
    else
        put(stream, &value, sizeof value);
}

static void put_big32(FILE *stream, uint32_t value) {
    const uint8_t bytes[4] = {(uint8_t)(value >> 24), (uint8_t)(value >> 16), (uint8_t)(value >> 8),
                              (uint8_t)value};
    put(stream, bytes, sizeof bytes);
}

static void put_big16(FILE *stream, unsigned value) {
    const uint8_t bytes[2] = {(uint8_t)(value >> 8), (uint8_t)value};
    put(stream, bytes, sizeof bytes);
}

static void put_big_float(FILE *stream, double value) {
    float single = (float)value;
    uint32_t bits;
    memcpy(&bits, &single, sizeof bits);
    put_big32(stream, bits);
}

/* ---- VTK ---- */

/* Announces an array of `size` bytes in the appended data and moves the offset past it. */
static void announce(FILE *stream, const char *type, const char *name, int components, uint64_t size,
                     uint64_t *offset) {
    fprintf(stream,
            "<DataArray type=\"%s\" Name=\"%s\" NumberOfComponents=\"%d\" format=\"appended\" "
            "offset=\"%llu\"/>\n",
            type, name, components, (unsigned long long)*offset);
    *offset += sizeof(uint64_t) + size;
}

static void put_size(FILE *stream, uint64_t size) {
    put(stream, &size, sizeof size);
}

static const char *vtk_type(ValueType type) {
    return type == VALUE_ID ? "UInt64" : type == VALUE_FLOAT ? "Float32" : "Float64";
}

static uint64_t attribute_size(const Attribute *attribute, uint64_t count) {
    return count * (uint64_t)attribute->components * (attribute->type == VALUE_FLOAT ? 4 : 8);
}

static void write_vtk_header(const Source *source, FILE *stream) {
    uint64_t count = source->frame->live, offset = 0;
    fprintf(stream,
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
            "byte_order=\"LittleEndian\" header_type=\"UInt64\">\n<UnstructuredGrid>\n"
            "<FieldData>\n<DataArray type=\"Float64\" Name=\"TimeValue\" NumberOfTuples=\"1\" "
            "format=\"ascii\">%.17g</DataArray>\n</FieldData>\n"
            "<Piece NumberOfPoints=\"%llu\" NumberOfCells=\"%llu\">\n<Points>\n",
            source->frame->time, (unsigned long long)count, (unsigned long long)count);
    announce(stream, "Float64", "Points", 3, 24 * count, &offset);
    fputs("</Points>\n<Cells>\n", stream);
    announce(stream, "Int64", "connectivity", 1, 8 * count, &offset);
    announce(stream, "Int64", "offsets", 1, 8 * count, &offset);
    announce(stream, "UInt8", "types", 1, count, &offset);
    fputs("</Cells>\n<PointData>\n", stream);
    for (int a = 0; a < ATTRIBUTE_COUNT; a++) {
        const Attribute *attribute = attribute_at(source, a);
        if (attribute)
            announce(stream, vtk_type(attribute->type), attribute->name, attribute->components,
                     attribute_size(attribute, count), &offset);
    }
    fputs("</PointData>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_", stream);
}

static void write_vtk_attribute(const Source *source, const Attribute *attribute, FILE *stream) {
    put_size(stream, attribute_size(attribute, source->frame->live));
    for (uint32_t i = 0; i < source->frame->live; i++) {
        double value[3];
        if (attribute->type == VALUE_ID) {
            put(stream, &source->frame->id[i], sizeof source->frame->id[i]);
            continue;
        }
        attribute->get(source, i, value);
        for (int k = 0; k < attribute->components; k++)
            put_real(stream, attribute->type, value[k]);
    }
}

static bool write_vtk(const Source *source, FILE *stream, Err *err) {
    (void)err;
    const uint64_t count = source->frame->live;
    const uint8_t vertex = 1; /* VTK_VERTEX */
    write_vtk_header(source, stream);
    put_size(stream, 24 * count);
    for (uint32_t i = 0; i < count; i++) {
        double position[3];
        position_of(source, i, position);
        put(stream, position, sizeof position);
    }
    for (uint64_t first = 0; first < 2; first++) { /* connectivity 0, 1, ...; offsets 1, 2, ... */
        put_size(stream, 8 * count);
        for (uint64_t i = first; i < count + first; i++)
            put(stream, &i, sizeof i);
    }
    put_size(stream, count);
    for (uint32_t i = 0; i < count; i++)
        put(stream, &vertex, 1);
    for (int a = 0; a < ATTRIBUTE_COUNT; a++)
        if (attribute_at(source, a))
            write_vtk_attribute(source, attribute_at(source, a), stream);
    fputs("\n</AppendedData>\n</VTKFile>\n", stream);
    return true;
}

/* ---- PLY ---- */

static bool write_ply(const Source *source, FILE *stream, Err *err) {
    static const char *const axes[] = {"x", "y", "z"};
    if (!check_ids(source, (uint64_t)1 << 53, "ply", err))
        return false;
    fprintf(stream,
            "ply\nformat binary_little_endian 1.0\ncomment time %.17g\nelement vertex %u\n"
            "property double x\nproperty double y\nproperty double z\n",
            source->frame->time, source->frame->live);
    for (int a = 0; a < ATTRIBUTE_COUNT; a++) {
        const Attribute *attribute = attribute_at(source, a);
        for (int k = 0; attribute && k < attribute->components; k++)
            fprintf(stream, "property %s %s%s%s\n", attribute->type == VALUE_FLOAT ? "float" : "double",
                    attribute->name, attribute->components > 1 ? "_" : "",
                    attribute->components > 1 ? axes[k] : "");
    }
    fputs("end_header\n", stream);
    for (uint32_t i = 0; i < source->frame->live; i++) {
        double value[3];
        position_of(source, i, value);
        put(stream, value, sizeof value);
        for (int a = 0; a < ATTRIBUTE_COUNT; a++) {
            const Attribute *attribute = attribute_at(source, a);
            if (!attribute)
                continue;
            if (attribute->get)
                attribute->get(source, i, value);
            else
                value[0] = (double)source->frame->id[i];
            for (int k = 0; k < attribute->components; k++)
                put_real(stream, attribute->type, value[k]);
        }
    }
    return true;
}

/* ---- BGEO ---- */

static void write_bgeo_header(const Source *source, FILE *stream) {
    enum { TYPE_FLOAT = 0, TYPE_INT = 1, TYPE_VECTOR = 5 };
    uint32_t count = 0;
    for (int a = 0; a < ATTRIBUTE_COUNT; a++)
        count += attribute_at(source, a) != NULL;
    /* points, primitives, point groups, primitive groups, attributes of points, vertices, primitives, file */
    const uint32_t counts[8] = {source->frame->live, 0, 0, 0, count, 0, 0, 0};
    put(stream, "BgeoV", 5);
    put_big32(stream, 5);
    for (int i = 0; i < 8; i++)
        put_big32(stream, counts[i]);
    for (int a = 0; a < ATTRIBUTE_COUNT; a++) {
        const Attribute *attribute = attribute_at(source, a);
        if (!attribute)
            continue;
        size_t length = strlen(attribute->bgeo_name);
        put_big16(stream, (unsigned)length);
        put(stream, attribute->bgeo_name, length);
        put_big16(stream, (unsigned)attribute->components);
        put_big32(stream, attribute->type == VALUE_ID  ? TYPE_INT
                          : attribute->components == 3 ? TYPE_VECTOR
                                                       : TYPE_FLOAT);
        for (int k = 0; k < attribute->components; k++)
            put_big32(stream, 0); /* default value */
    }
}

static bool write_bgeo(const Source *source, FILE *stream, Err *err) {
    if (!check_ids(source, INT32_MAX, "bgeo", err))
        return false;
    write_bgeo_header(source, stream);
    for (uint32_t i = 0; i < source->frame->live; i++) {
        double value[3];
        position_of(source, i, value);
        for (int k = 0; k < 3; k++)
            put_big_float(stream, value[k]);
        put_big_float(stream, 1); /* homogeneous */
        for (int a = 0; a < ATTRIBUTE_COUNT; a++) {
            const Attribute *attribute = attribute_at(source, a);
            if (attribute && !attribute->get)
                put_big32(stream, (uint32_t)source->frame->id[i]);
            if (!attribute || !attribute->get)
                continue;
            attribute->get(source, i, value);
            for (int k = 0; k < attribute->components; k++)
                put_big_float(stream, value[k]);
        }
    }
    put(stream, "\0\xff", 2); /* end marks, as Partio writes them */
    return true;
}

/* ---- The table ---- */

static const struct {
    const char *suffix;
    bool (*write)(const Source *source, FILE *stream, Err *err);
} formats[] = {[EXPORT_VTK] = {"vtu", write_vtk},
               [EXPORT_PLY] = {"ply", write_ply},
               [EXPORT_BGEO] = {"bgeo", write_bgeo}};

const char *export_suffix(ExportFormat format) {
    return formats[format].suffix;
}

bool export_write(const Frame *frame, float rest_density, ExportFormat format, const char *path, Err *err) {
    const Source source = {frame, rest_density};
    FileWriter writer;
    if (!file_begin(&writer, path, err))
        return false;
    if (formats[format].write(&source, writer.stream, err))
        return file_commit(&writer, err);
    file_abort(&writer);
    return false;
}
