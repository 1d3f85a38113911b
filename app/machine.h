/* The machine a result was made on. */
#ifndef SKIFF_APP_MACHINE_H
#define SKIFF_APP_MACHINE_H

#include "engine/skiff.h"

#include <jansson.h>

typedef struct Machine {
    char cpu[128];   /* model name and number, "Intel(R) Xeon(R) Processor (model 106)" */
    int cores;       /* processors that this process may use */
    int threads;     /* that the simulation uses */
    const char *isa; /* that the hot loops use */
    const char *compiler;
    const char *commit;
    const char *version;
} Machine;

Machine machine_describe(const SkiffSim *sim);
/* New reference. */
json_t *machine_json(const Machine *machine);

#endif
