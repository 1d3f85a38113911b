/* skiff profile: the distribution of the step times of a run, with and without window moves, and for the ten
 * slowest steps what they did that others did not. Phases are the columns of steps.csv that end in "_ms", so
 * that a run of another version is understood too. */
#include "profile.h"

#include "commands.h"
#include "json_text.h"
#include "summary.h"

#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

/* ---- Columns ---- */

const char *const profile_columns[PROFILE_COLUMN_COUNT] = {
#define COLUMN(id, name) name,
    PROFILE_COLUMNS(COLUMN)
#undef COLUMN
};

/* A table with the places of its columns. */
typedef struct Source {
    const CsvTable *table;
    int columns[PROFILE_COLUMN_COUNT];
    int phases[PROFILE_MAX_PHASES];
    uint8_t *age;  /* [rows] steps since the last move: 0 for the move itself, 255 long ago */
    double *spare; /* [rows] */
    double p50_iterations[2];
} Source;

static double cell(const Source *source, size_t row, int column) {
    return source->table->values[row * (size_t)source->table->column_count + (size_t)column];
}

static double value_at(const Source *source, size_t row, ProfileColumn column) {
    return cell(source, row, source->columns[column]);
}

bool profile_phase_key(const char *column, char *key, size_t size) {
    const size_t length = strlen(column);
    if (length <= 3 || length >= size || strcmp(column + length - 3, "_ms") != 0 ||
        strcmp(column, profile_columns[PROFILE_STEP_MS]) == 0)
        return false;
    memcpy(key, column, length - 3);
    key[length - 3] = '\0';
    return true;
}

static bool find_columns(Source *source, const char *name, Profile *profile, Err *err) {
    const CsvTable *table = source->table;
    for (int c = 0; c < PROFILE_COLUMN_COUNT; c++) {
        source->columns[c] = csv_column(table, profile_columns[c]);
        if (source->columns[c] < 0)
            return err_set(err, ERR_INPUT, "%s: has no column %s", name, profile_columns[c]);
    }
    for (int c = 0; c < table->column_count && profile->phase_count < PROFILE_MAX_PHASES; c++) {
        ProfilePhase *phase = &profile->phases[profile->phase_count];
        if (profile_phase_key(table->names[c], phase->key, sizeof phase->key))
            source->phases[profile->phase_count++] = c;
    }
    return table->row_count > 0 || err_set(err, ERR_INPUT, "%s: has no rows: no step was made", name);
}

/* ---- Means and percentiles ---- */

typedef enum Group { ALL, PLAIN, MOVES, AFTER } Group;

static bool is_in(const Source *source, size_t row, Group group) {
    const uint8_t age = source->age[row];
    return group == ALL || (group == PLAIN && age > PROFILE_AFTER) || (group == MOVES && age == 0) ||
           (group == AFTER && age > 0 && age <= PROFILE_AFTER);
}

/* NaN over nothing. */
static double group_mean(const Source *source, int column, Group group) {
    double sum = 0;
    size_t count = 0;
    for (size_t row = 0; row < source->table->row_count; row++)
        if (is_in(source, row, group)) {
            sum += cell(source, row, column);
            count++;
        }
    return count > 0 ? sum / (double)count : (double)NAN;
}

/* The column's values in ascending order, in source->spare. */
static const double *sorted_column(Source *source, int column) {
    for (size_t row = 0; row < source->table->row_count; row++)
        source->spare[row] = cell(source, row, column);
    summary_sort(source->spare, source->table->row_count);
    return source->spare;
}

static double column_median(Source *source, int column) {
    return summary_percentile(sorted_column(source, column), source->table->row_count, 50);
}

static void find_moves(Source *source, Profile *profile) {
    unsigned age = UINT8_MAX;
    for (size_t row = 0; row < source->table->row_count; row++) {
        const bool moved = value_at(source, row, PROFILE_MOVED) > 0;
        profile->moves += moved;
        age = moved ? 0 : age < UINT8_MAX ? age + 1 : age;
        source->age[row] = (uint8_t)age;
    }
}

static void measure(Source *source, Profile *profile) {
    const size_t count = source->table->row_count;
    const int step_ms = source->columns[PROFILE_STEP_MS];
    profile->steps = count;
    profile->mean_ms = group_mean(source, step_ms, ALL);
    profile->plain_ms = group_mean(source, step_ms, PLAIN);
    profile->move_ms = group_mean(source, step_ms, MOVES);
    profile->after5_ms = group_mean(source, step_ms, AFTER);
    const double *sorted = sorted_column(source, step_ms);
    profile->p50_ms = summary_percentile(sorted, count, 50);
    profile->p95_ms = summary_percentile(sorted, count, 95);
    profile->p99_ms = summary_percentile(sorted, count, 99);
    profile->max_ms = sorted[count - 1];
    profile->real_time_factor =
        summary_real_time_factor(group_mean(source, source->columns[PROFILE_DT], ALL), profile->mean_ms);
    for (int p = 0; p < profile->phase_count; p++) {
        ProfilePhase *phase = &profile->phases[p];
        phase->mean_ms = group_mean(source, source->phases[p], ALL);
        phase->plain_ms = group_mean(source, source->phases[p], PLAIN);
        phase->move_ms = group_mean(source, source->phases[p], MOVES);
        phase->p50_ms = column_median(source, source->phases[p]);
    }
    for (int k = 0; k < 2; k++)
        source->p50_iterations[k] = column_median(source, source->columns[PROFILE_DENSITY_ITERATIONS + k]);
}

/* ---- Why a step was slow ---- */

static void add_reason(char *why, size_t size, const char *format, ...) ERR_PRINTF(3, 4);

static void add_reason(char *why, size_t size, const char *format, ...) {
    const size_t used = strlen(why);
    va_list arguments;
    va_start(arguments, format);
    const int comma = snprintf(why + used, size - used, "%s", used > 0 ? "; " : "");
    vsnprintf(why + used + (size_t)comma, size - used - (size_t)comma, format, arguments);
    va_end(arguments);
}

/* The work that this step had and most have not. */
static void explain_work(const Source *source, size_t row, char *why, size_t size) {
    static const char *const solves[2] = {"density", "divergence"};
    if (row == 0)
        add_reason(why, size, "first step of the table: memory is touched for the first time");
    if (source->age[row] == 0)
        add_reason(why, size, "window move");
    else if (source->age[row] <= PROFILE_AFTER)
        add_reason(why, size, "%u after a window move", (unsigned)source->age[row]);
    for (int k = 0; k < 2; k++) {
        const double iterations = value_at(source, row, PROFILE_DENSITY_ITERATIONS + k);
        if (iterations > 1.2 * source->p50_iterations[k] + 0.5)
            add_reason(why, size, "%.0f %s iterations (median %.0f)", iterations, solves[k],
                       source->p50_iterations[k]);
    }
    const double change =
        row > 0 ? value_at(source, row, PROFILE_PARTICLES) - value_at(source, row - 1, PROFILE_PARTICLES) : 0;
    if (change > 0)
        add_reason(why, size, "%.0f particles more", change);
}

static void explain(const Source *source, const Profile *profile, size_t row, ProfileStep *step) {
    int most = -1;
    double excess = 0;
    for (int p = 0; p < profile->phase_count; p++) {
        const double over = cell(source, row, source->phases[p]) - profile->phases[p].p50_ms;
        if (over > excess) {
            excess = over;
            most = p;
        }
    }
    explain_work(source, row, step->why, sizeof step->why);
    if (!*step->why)
        add_reason(step->why, sizeof step->why, "no more work than other steps");
    if (most >= 0)
        add_reason(step->why, sizeof step->why, "%s +%.3g ms", profile->phases[most].key, excess);
}

/* The slowest rows, by selection: there are ten of them. */
static void find_worst(const Source *source, Profile *profile) {
    const size_t count = source->table->row_count;
    size_t rows[PROFILE_WORST];
    for (size_t row = 0; row < count; row++) {
        const double ms = value_at(source, row, PROFILE_STEP_MS);
        int place = profile->worst_count;
        while (place > 0 && value_at(source, rows[place - 1], PROFILE_STEP_MS) < ms)
            place--;
        if (place == PROFILE_WORST)
            continue;
        if (profile->worst_count < PROFILE_WORST)
            profile->worst_count++;
        memmove(rows + place + 1, rows + place, (size_t)(profile->worst_count - 1 - place) * sizeof *rows);
        rows[place] = row;
    }
    for (int k = 0; k < profile->worst_count; k++) {
        ProfileStep *step = &profile->worst[k];
        *step = (ProfileStep){.step = value_at(source, rows[k], PROFILE_STEP),
                              .t = value_at(source, rows[k], PROFILE_TIME),
                              .ms = value_at(source, rows[k], PROFILE_STEP_MS),
                              .moved = source->age[rows[k]] == 0};
        explain(source, profile, rows[k], step);
    }
}

bool profile_make(const CsvTable *steps, const char *name, Profile *profile, Err *err) {
    Source source = {.table = steps};
    *profile = (Profile){0};
    if (!find_columns(&source, name, profile, err))
        return false;
    source.age = malloc(steps->row_count);
    source.spare = malloc(steps->row_count * sizeof *source.spare);
    const bool good = (source.age && source.spare) || err_set(err, ERR_IO, "%s: out of memory", name);
    if (good) {
        find_moves(&source, profile);
        measure(&source, profile);
        find_worst(&source, profile);
    }
    free(source.age);
    free(source.spare);
    return good;
}

/* ---- JSON ---- */

static void put_ms(json_t *object, const char *key, double value) {
    json_object_set_new(object, key, summary_figure(value));
}

json_t *profile_json(const Profile *profile) {
    json_t *object =
        json_pack("{sIsI}", "steps", (json_int_t)profile->steps, "moves", (json_int_t)profile->moves);
    put_ms(object, "mean_ms", profile->mean_ms);
    put_ms(object, "p50_ms", profile->p50_ms);
    put_ms(object, "p95_ms", profile->p95_ms);
    put_ms(object, "p99_ms", profile->p99_ms);
    put_ms(object, "max_ms", profile->max_ms);
    put_ms(object, "plain_ms", profile->plain_ms);
    put_ms(object, "move_ms", profile->move_ms);
    put_ms(object, "after5_ms", profile->after5_ms);
    put_ms(object, "real_time_factor", profile->real_time_factor);
    json_t *mean = json_object(), *plain = json_object(), *move = json_object(), *worst = json_array();
    for (int p = 0; p < profile->phase_count; p++) {
        const ProfilePhase *phase = &profile->phases[p];
        put_ms(mean, phase->key, phase->mean_ms);
        put_ms(plain, phase->key, phase->plain_ms);
        put_ms(move, phase->key, phase->move_ms);
    }
    for (int k = 0; k < profile->worst_count; k++) {
        const ProfileStep *step = &profile->worst[k];
        json_array_append_new(worst, json_pack("{sIsososbss}", "step", (json_int_t)step->step, "t",
                                               summary_figure(step->t), "ms", summary_figure(step->ms),
                                               "moved", step->moved, "why", step->why));
    }
    json_object_set_new(object, "phases_ms", mean);
    json_object_set_new(object, "phases_plain_ms", plain);
    json_object_set_new(object, "phases_move_ms", move);
    json_object_set_new(object, "worst", worst);
    return object;
}

/* ---- The command ---- */

static void print_ms(double value) {
    if (isfinite(value))
        printf(" %10.3f", value);
    else
        printf(" %10s", "-");
}

static void print_ratio(const char *what, double value, double base) {
    if (isfinite(value / base))
        printf("  %-28s %10.3f\n", what, value / base);
}

static void print_profile(const Profile *profile) {
    printf("%zu steps, %zu of them with a window move; real-time factor %.3g\n\n", profile->steps,
           profile->moves, profile->real_time_factor);
    printf("  %-28s %10s %10s %10s %10s %10s\n  %-28s", "ms", "mean", "p50", "p95", "p99", "max", "step");
    print_ms(profile->mean_ms);
    print_ms(profile->p50_ms);
    print_ms(profile->p95_ms);
    print_ms(profile->p99_ms);
    print_ms(profile->max_ms);
    printf("\n\n  %-28s %10s %10s %10s\n", "mean ms of a phase", "all", "plain", "moves");
    for (int p = 0; p < profile->phase_count; p++) {
        printf("  %-28s", profile->phases[p].key);
        print_ms(profile->phases[p].mean_ms);
        print_ms(profile->phases[p].plain_ms);
        print_ms(profile->phases[p].move_ms);
        putchar('\n');
    }
    printf("  %-28s", "whole step");
    print_ms(profile->mean_ms);
    print_ms(profile->plain_ms);
    print_ms(profile->move_ms);
    printf("\n  %-28s", "the 5 steps after a move");
    print_ms(profile->after5_ms);
    printf("\n\n");
    print_ratio("p99 / p50", profile->p99_ms, profile->p50_ms);
    print_ratio("move / plain", profile->move_ms, profile->plain_ms);
    print_ratio("after a move / plain", profile->after5_ms, profile->plain_ms);
    printf("\n  slowest steps\n  %10s %10s %10s  why\n", "step", "t, s", "ms");
    for (int k = 0; k < profile->worst_count; k++) {
        const ProfileStep *step = &profile->worst[k];
        printf("  %10.0f %10.3f %10.3f  %s\n", step->step, step->t, step->ms, step->why);
    }
}

bool profile_command(const CliArgs *args, Err *err) {
    char path[4096];
    CsvTable steps;
    snprintf(path, sizeof path, "%.4000s/steps.csv", args->operand);
    if (!csv_read(path, &steps, err))
        return false;
    Profile *profile = malloc(sizeof *profile);
    bool good = profile || err_set(err, ERR_IO, "out of memory");
    good = good && profile_make(&steps, path, profile, err);
    if (good && args->json) {
        json_t *object = profile_json(profile);
        json_text_print(stdout, object, -1);
        putchar('\n');
        json_decref(object);
    } else if (good) {
        print_profile(profile);
    }
    free(profile);
    csv_free(&steps);
    return good;
}
