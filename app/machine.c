#include "machine.h"

#include "version.h"

#include <sched.h>
#include <stdio.h>
#include <string.h>

static void read_cpu_name(char *out, size_t size) {
    snprintf(out, size, "unknown");
    FILE *file = fopen("/proc/cpuinfo", "r");
    char line[512];
    while (file && fgets(line, sizeof line, file)) {
        const char *colon = strchr(line, ':');
        if (!colon || (strncmp(line, "model name", 10) != 0 && strncmp(line, "Model", 5) != 0))
            continue;
        const char *name = colon + 1 + strspn(colon + 1, " \t");
        snprintf(out, size, "%.*s", (int)strcspn(name, "\n"), name);
        break;
    }
    if (file)
        fclose(file);
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
