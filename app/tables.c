#include "tables.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(table) ((int)(sizeof(table) / sizeof *(table)))

/* ---- Columns ---- */

typedef enum ColumnType { COLUMN_U64, COLUMN_U32, COLUMN_INT, COLUMN_BOOL, COLUMN_DOUBLE } ColumnType;

typedef struct Column {
    const char *name;
    ColumnType type;
    size_t offset; /* in SkiffStats */
    int digits;
} Column;

#define STAT(member) offsetof(SkiffStats, member)

static const Column step_columns[] = {
    {"step", COLUMN_U64, STAT(step), 0},
    {"t", COLUMN_DOUBLE, STAT(time), 8},
    {"dt", COLUMN_DOUBLE, STAT(dt), 7},
    {"particles", COLUMN_U32, STAT(particles), 0},
    {"density_iterations", COLUMN_INT, STAT(density_iterations), 0},
    {"divergence_iterations", COLUMN_INT, STAT(divergence_iterations), 0},
    {"density_error_percent", COLUMN_DOUBLE, STAT(density_error_percent), 7},
    {"density_max_percent", COLUMN_DOUBLE, STAT(density_max_percent), 7},
    {"divergence_error_percent", COLUMN_DOUBLE, STAT(divergence_error_percent), 7},
    {"residual_percent", COLUMN_DOUBLE, STAT(residual_percent), 7},
    {"neighbours", COLUMN_DOUBLE, STAT(neighbours), 7},
    {"mean_speed", COLUMN_DOUBLE, STAT(mean_speed), 7},
    {"max_speed", COLUMN_DOUBLE, STAT(max_speed), 7},
    {"mean_height", COLUMN_DOUBLE, STAT(mean_height), 9},
    {"kinetic", COLUMN_DOUBLE, STAT(kinetic_energy), 9},
    {"potential", COLUMN_DOUBLE, STAT(potential_energy), 9},
    {"moved", COLUMN_BOOL, STAT(moved), 0},
};

/* What stands before and after the counts by cause. */
static const Column ledger_columns[] = {
    {"step", COLUMN_U64, STAT(step), 0},
    {"t", COLUMN_DOUBLE, STAT(time), 8},
    {"particles", COLUMN_U32, STAT(particles), 0},
    {"mean_height", COLUMN_DOUBLE, STAT(mean_height), 9},
    {"kinetic", COLUMN_DOUBLE, STAT(kinetic_energy), 9},
    {"potential", COLUMN_DOUBLE, STAT(potential_energy), 9},
};

typedef struct HullColumn {
    const char *name;
    size_t offset; /* of a double in SkiffBody or SkiffDrive */
} HullColumn;

#define HULL(name, member, index)                                                                            \
    { name, offsetof(SkiffBody, member) + (index) * sizeof(double) }

static const HullColumn hull_columns[] = {
    HULL("x", position, 0),
    HULL("y", position, 1),
    HULL("z", position, 2),
    HULL("qx", rotation, 0),
    HULL("qy", rotation, 1),
    HULL("qz", rotation, 2),
    HULL("qw", rotation, 3),
    HULL("vx", velocity, 0),
    HULL("vy", velocity, 1),
    HULL("vz", velocity, 2),
    HULL("wx", angular_velocity, 0),
    HULL("wy", angular_velocity, 1),
    HULL("wz", angular_velocity, 2),
    HULL("fx", force, 0),
    HULL("fy", force, 1),
    HULL("fz", force, 2),
    HULL("tx", torque, 0),
    HULL("ty", torque, 1),
    HULL("tz", torque, 2),
};

/* Of a body that has a drive, after its hull_columns. */
static const HullColumn drive_columns[] = {
    {"throttle", offsetof(SkiffDrive, controls.throttle)},
    {"thrust", offsetof(SkiffDrive, thrust)},
    {"rudder", offsetof(SkiffDrive, rudder)},
    {"steering", offsetof(SkiffDrive, torque)},
    {"heading", offsetof(SkiffDrive, heading)},
    {"speed", offsetof(SkiffDrive, speed)},
};

/* ---- Headers; malloc'ed ---- */

static char *steps_header(void) {
    char *text = NULL;
    size_t size;
    FILE *stream = open_memstream(&text, &size);
    if (!stream)
        return NULL;
    for (int i = 0; i < COUNT(step_columns); i++)
        fprintf(stream, "%s,", step_columns[i].name);
    for (int i = 0; i < SKIFF_PHASE_COUNT; i++)
        fprintf(stream, "%s_ms,", skiff_phase_key(i));
    fputs("step_ms", stream);
    return fclose(stream) == 0 ? text : NULL;
}

static char *ledger_header(void) {
    char *text = NULL;
    size_t size;
    FILE *stream = open_memstream(&text, &size);
    if (!stream)
        return NULL;
    for (int i = 0; i < COUNT(ledger_columns); i++)
        fprintf(stream, "%s%s", i > 0 ? "," : "", ledger_columns[i].name);
    for (int i = 0; i < SKIFF_IN_COUNT; i++)
        fprintf(stream, ",in_%s", skiff_in_key(i));
    for (int i = 0; i < SKIFF_OUT_COUNT; i++)
        fprintf(stream, ",out_%s", skiff_out_key(i));
    return fclose(stream) == 0 ? text : NULL;
}

/* Number of the drive that a body has, or -1. */
static int drive_of(const SkiffSim *sim, int body) {
    for (int d = 0; d < skiff_drive_count(sim); d++)
        if (skiff_drive(sim, d).body == body)
            return d;
    return -1;
}

static char *hull_header(const SkiffSim *sim) {
    char *text = NULL;
    size_t size;
    FILE *stream = open_memstream(&text, &size);
    if (!stream)
        return NULL;
    fputs("step,t", stream);
    for (int body = 0; body < skiff_body_count(sim); body++) {
        const char *name = skiff_body(sim, body).name;
        for (int i = 0; i < COUNT(hull_columns); i++)
            fprintf(stream, ",%s.%s", name, hull_columns[i].name);
        for (int i = 0; drive_of(sim, body) >= 0 && i < COUNT(drive_columns); i++)
            fprintf(stream, ",%s.%s", name, drive_columns[i].name);
    }
    return fclose(stream) == 0 ? text : NULL;
}

static char *probes_header(const SkiffSim *sim) {
    char *text = NULL;
    size_t size;
    FILE *stream = open_memstream(&text, &size);
    if (!stream)
        return NULL;
    fputs("t", stream);
    for (int i = 0; i < skiff_probe_channel_count(sim); i++)
        fprintf(stream, ",%s", skiff_probe_channel_name(sim, i));
    return fclose(stream) == 0 ? text : NULL;
}

/* ---- Rows ---- */

static void put_column(CsvWriter *writer, const Column *column, const SkiffStats *stats) {
    const char *member = (const char *)stats + column->offset;
    switch (column->type) {
    case COLUMN_U64:
        csv_put_count(writer, *(const uint64_t *)(const void *)member);
        break;
    case COLUMN_U32:
        csv_put_count(writer, *(const uint32_t *)(const void *)member);
        break;
    case COLUMN_INT:
        csv_put(writer, *(const int *)(const void *)member, 9);
        break;
    case COLUMN_BOOL:
        csv_put_count(writer, *(const bool *)(const void *)member);
        break;
    case COLUMN_DOUBLE:
        csv_put(writer, *(const double *)(const void *)member, column->digits);
        break;
    }
}

static void add_step(CsvWriter *writer, const SkiffStats *stats) {
    for (int i = 0; i < COUNT(step_columns); i++)
        put_column(writer, &step_columns[i], stats);
    for (int i = 0; i < SKIFF_PHASE_COUNT; i++)
        csv_put(writer, stats->phase_ms[i], 5);
    csv_put(writer, stats->step_ms, 5);
    csv_end_row(writer);
}

static void add_ledger(CsvWriter *writer, const SkiffStats *stats) {
    for (int i = 0; i < COUNT(ledger_columns); i++)
        put_column(writer, &ledger_columns[i], stats);
    for (int i = 0; i < SKIFF_IN_COUNT; i++)
        csv_put_count(writer, stats->particles_in[i]);
    for (int i = 0; i < SKIFF_OUT_COUNT; i++)
        csv_put_count(writer, stats->particles_out[i]);
    csv_end_row(writer);
}

static void put_hull(CsvWriter *writer, const HullColumn *columns, int count, const void *object) {
    for (int i = 0; i < count; i++)
        csv_put(writer, *(const double *)(const void *)((const char *)object + columns[i].offset), 9);
}

static void add_bodies(CsvWriter *writer, const SkiffSim *sim) {
    csv_put_count(writer, skiff_step_count(sim));
    csv_put(writer, skiff_time(sim), 8);
    for (int index = 0; index < skiff_body_count(sim); index++) {
        const SkiffBody body = skiff_body(sim, index);
        const int number = drive_of(sim, index);
        put_hull(writer, hull_columns, COUNT(hull_columns), &body);
        if (number < 0)
            continue;
        const SkiffDrive drive = skiff_drive(sim, number);
        put_hull(writer, drive_columns, COUNT(drive_columns), &drive);
    }
    csv_end_row(writer);
}

/* Whether a multiple of the probe period lies in the last step. Depends on the time alone, so that a resumed
 * run samples alike. */
static bool is_probe_due(const Tables *tables, const SkiffSim *sim) {
    const double slack = 1e-6;
    double now = skiff_time(sim), before = now - skiff_stats(sim)->dt;
    return tables->probe_rate <= 0 ||
           floor(now * tables->probe_rate + slack) > floor(before * tables->probe_rate + slack);
}

void tables_add(Tables *tables, const SkiffSim *sim) {
    add_step(&tables->steps, skiff_stats(sim));
    add_ledger(&tables->ledger, skiff_stats(sim));
    if (tables->hull.stream)
        add_bodies(&tables->hull, sim);
    if (!tables->probes.stream || !is_probe_due(tables, sim))
        return;
    skiff_probe_read(sim, tables->probe_values);
    csv_put(&tables->probes, skiff_time(sim), 8);
    for (int i = 0; i < tables->probe_count; i++)
        csv_put(&tables->probes, tables->probe_values[i], 9);
    csv_end_row(&tables->probes);
}

/* ---- Files ---- */

typedef struct TableFile {
    CsvWriter *writer;
    const char *name;
    char *header;
    double limit;     /* first number of the last row to keep when resuming */
    bool is_complete; /* every step up to the limit must be there */
} TableFile;

static bool open_file(const TableFile *file, const char *folder, bool resume, Err *err) {
    char path[4096];
    double last;
    snprintf(path, sizeof path, "%.4000s/%s", folder, file->name);
    if (!file->header)
        return err_set(err, ERR_IO, "%s: out of memory", path);
    if (!resume)
        return csv_create(file->writer, path, file->header, err);
    if (!csv_cut(path, file->header, file->limit, &last, err))
        return false;
    if (file->is_complete && file->limit > 0 && last != file->limit)
        return err_set(err, ERR_INPUT,
                       "%s: ends at step %.0f, before the checkpoint at step %.0f; start again with --force",
                       path, last > 0 ? last : 0, file->limit);
    return csv_append(file->writer, path, err);
}

static bool tables_open(Tables *tables, const char *folder, const SkiffSim *sim, double probe_rate,
                        bool resume, Err *err) {
    double step = (double)skiff_step_count(sim);
    double time = skiff_time(sim) + 0.25 * (double)skiff_params(sim)->time_step;
    *tables = (Tables){.probe_rate = probe_rate, .probe_count = skiff_probe_channel_count(sim)};
    tables->probe_values = calloc((size_t)tables->probe_count + 1, sizeof *tables->probe_values);
    TableFile files[4];
    int count = 0;
    files[count++] = (TableFile){&tables->steps, "steps.csv", steps_header(), step, true};
    files[count++] = (TableFile){&tables->ledger, "ledger.csv", ledger_header(), step, true};
    if (skiff_body_count(sim) > 0)
        files[count++] = (TableFile){&tables->hull, "hull.csv", hull_header(sim), step, true};
    if (tables->probe_count > 0)
        files[count++] = (TableFile){&tables->probes, "probes.csv", probes_header(sim), time, false};
    bool opened = tables->probe_values || err_set(err, ERR_IO, "out of memory");
    for (int i = 0; i < count; i++) {
        opened = opened && open_file(&files[i], folder, resume, err);
        free(files[i].header);
    }
    if (!opened)
        tables_close(tables, NULL);
    return opened;
}

bool tables_create(Tables *tables, const char *folder, const SkiffSim *sim, double probe_rate, Err *err) {
    return tables_open(tables, folder, sim, probe_rate, false, err);
}

bool tables_resume(Tables *tables, const char *folder, const SkiffSim *sim, double probe_rate, Err *err) {
    return tables_open(tables, folder, sim, probe_rate, true, err);
}

bool tables_flush(Tables *tables, bool durable, Err *err) {
    return csv_flush(&tables->steps, durable, err) && csv_flush(&tables->ledger, durable, err) &&
           csv_flush(&tables->hull, durable, err) && csv_flush(&tables->probes, durable, err);
}

bool tables_close(Tables *tables, Err *err) {
    CsvWriter *writers[] = {&tables->steps, &tables->ledger, &tables->hull, &tables->probes};
    bool good = true;
    for (int i = 0; i < COUNT(writers); i++)
        good = csv_close(writers[i], good ? err : NULL) && good;
    free(tables->probe_values);
    tables->probe_values = NULL;
    return good;
}
