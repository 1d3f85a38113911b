#include "machine.h"

#include "version.h"

#include <sched.h>
#include <stdio.h>
#include <string.h>

/* The value of a line "key : value" of /proc/cpuinfo; NULL for another key. */
static const char *cpu_value(const char *line, const char *key) {
    const size_t length = strlen(key);
    const char *colon = strchr(line, ':');
    if (!colon || strncmp(line, key, length) != 0 || line[length + strspn(line + length, " \t")] != ':')
        return NULL;
    return colon + 1 + strspn(colon + 1, " \t");
}

/* A hypervisor gives processors of several generations the same name; their number tells them apart. */
static void read_cpu_name(char *out, size_t size) {
    FILE *file = fopen("/proc/cpuinfo", "r");
    char line[512], name[96] = "", model[16] = "";
    while (file &&
           fgets(line, sizeof line, file)) { /* the first processor's; ARM names the board after all */
        const char *value;
        if (!*name &&
            ((value = cpu_value(line, "model name")) != NULL || (value = cpu_value(line, "Model")) != NULL))
            snprintf(name, sizeof name, "%.*s", (int)strcspn(value, "\n"), value);
        else if (!*model && (value = cpu_value(line, "model")) != NULL)
            snprintf(model, sizeof model, "%.*s", (int)strcspn(value, "\n"), value);
    }
    if (file)
        fclose(file);
    snprintf(out, size, *model ? "%s (model %s)" : "%s", *name ? name : "unknown", model);
    for (char *c = out; *c; c++) /* it becomes a CSV cell */
        if (*c == ',' || *c == '"' || *c < ' ')
            *c = ' ';
}

Machine machine_describe(const SkiffSim *sim) {
    Machine machine = {.cores = 1,
                       .threads = skiff_threads(sim),
                       .isa = skiff_simd_name(skiff_simd(sim)),
                       .compiler = SKIFF_COMPILER,
                       .commit = SKIFF_COMMIT,
                       .version = SKIFF_VERSION};
    cpu_set_t set;
    read_cpu_name(machine.cpu, sizeof machine.cpu);
    if (sched_getaffinity(0, sizeof set, &set) == 0)
        machine.cores = CPU_COUNT(&set);
    return machine;
}

json_t *machine_json(const Machine *machine) {
    return json_pack("{sssisissssssss}", "cpu", machine->cpu, "cores", machine->cores, "threads",
                     machine->threads, "isa", machine->isa, "compiler", machine->compiler, "commit",
                     machine->commit, "version", machine->version);
}
