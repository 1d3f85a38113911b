/* view.skiff, beside a checkpoint: without it the water behind a boat would turn clear where a run is
 * resumed, and the picture would leap. */
#include "view_memory.h"

#include "engine/base/state_file.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MEMORY_VERSION = 2, HEADER_SCALARS = 3, WAKE_SCALARS = 4 };

bool view_memory_save(const ViewMemory *memory, const char *path, Err *err) {
    uint64_t count = foam_count(memory->foam);
    uint64_t *id = malloc((count + 1) * sizeof *id);
    float *amount = malloc((count + 1) * sizeof *amount);
    bool ok = id && amount;
    if (ok)
        foam_store(memory->foam, id, amount);
    const double header[HEADER_SCALARS] = {memory->time, foam_time(memory->foam), memory->camera};
    const Wake *wake = memory->wake;
    const double wake_state[WAKE_SCALARS] = {wake->base[0], wake->base[1], wake->time, wake->is_started};
    const StateField fields[] = {{"header", STATE_F64, 1, HEADER_SCALARS, header},
                                 {"cameras", STATE_F64, 1, memory->state_count, memory->states},
                                 {"foam_id", STATE_U64, 1, count, id},
                                 {"foam_amount", STATE_F32, 1, count, amount},
                                 {"wake", STATE_F64, 1, WAKE_SCALARS, wake_state},
                                 {"wake_amount", STATE_F32, 1, wake_count(wake), wake->amount}};
    ok = ok ? state_file_write(path, MEMORY_VERSION, fields, sizeof fields / sizeof *fields, err)
            : err_set(err, ERR_IO, "%s: not enough memory to write it", path);
    free(id);
    free(amount);
    return ok;
}

static bool all_finite(const double *values, uint64_t count) {
    for (uint64_t i = 0; i < count; i++)
        if (!isfinite(values[i]))
            return false;
    return true;
}

/* False where an amount is not one. */
static bool load_wake(Wake *wake, const double *state, const float *amount) {
    for (uint64_t i = 0; i < wake_count(wake); i++)
        if (!(amount[i] >= 0 && amount[i] < 1e6f))
            return false;
    if (wake->amount)
        memcpy(wake->amount, amount, wake_count(wake) * sizeof *amount);
    memcpy(wake->base, state, sizeof wake->base);
    wake->time = state[2];
    wake->is_started = state[3] != 0;
    return true;
}

static bool load_fields(ViewMemory *memory, const StateFile *file, const char *path, Err *err) {
    const StateField *header = state_file_field(file, "header", STATE_F64, 1, HEADER_SCALARS, err);
    const StateField *states = state_file_field(file, "cameras", STATE_F64, 1, memory->state_count, err);
    const StateField *id = state_file_field(file, "foam_id", STATE_U64, 1, UINT64_MAX, err);
    const StateField *amount =
        id ? state_file_field(file, "foam_amount", STATE_F32, 1, id->count, err) : NULL;
    const StateField *wake = state_file_field(file, "wake", STATE_F64, 1, WAKE_SCALARS, err);
    const StateField *wake_amount =
        state_file_field(file, "wake_amount", STATE_F32, 1, wake_count(memory->wake), err);
    if (!header || !states || !amount || !wake || !wake_amount)
        return false;
    const double *numbers = header->data;
    if (!all_finite(numbers, HEADER_SCALARS) || !all_finite(states->data, memory->state_count) ||
        !all_finite(wake->data, WAKE_SCALARS))
        return err_set(err, ERR_INPUT, "%s: holds a number that is not finite", path);
    if (fabs(numbers[0] - memory->time) > frame_time_tolerance)
        return err_set(err, ERR_INPUT, "%s: belongs to t = %g s, not %g s", path, numbers[0], memory->time);
    if (!load_wake(memory->wake, wake->data, wake_amount->data))
        return err_set(err, ERR_INPUT, "%s: an amount of foam in the wake is out of range", path);
    if (!foam_restore(memory->foam, numbers[1], id->count, id->data, amount->data, err)) {
        err_prefix(err, "%s", path);
        return false;
    }
    memory->camera = (int)fmax(-1, fmin(numbers[2], 1e6));
    if (memory->state_count > 0)
        memcpy(memory->states, states->data, memory->state_count * sizeof *memory->states);
    return true;
}

bool view_memory_load(ViewMemory *memory, const char *path, Err *err) {
    StateFile *file = state_file_open(path, MEMORY_VERSION, err);
    bool ok = file && load_fields(memory, file, path, err);
    state_file_close(file);
    return ok;
}
