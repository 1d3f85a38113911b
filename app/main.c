/* Entry of the program. What it does is in cli.c. */
#include "cli.h"

#include <stdlib.h>
#include <unistd.h>

/* OpenMP's idle threads spin for milliseconds by default. As soon as anything else runs on the machine, the
 * spinning takes the cores from the very threads it waits for: a step of 25 ms took 350. The runtime reads
 * its settings before main, so the program starts itself once more with short spinning, unless the user has
 * chosen. KMP_BLOCKTIME is LLVM's name for it. */
static void limit_spinning(char **argv) {
    static const char *const settings[][2] = {{"GOMP_SPINCOUNT", "1000"}, {"KMP_BLOCKTIME", "0"}};
    /* Bound threads stay bound through exec: all of them would share the first one's core. */
    static const char *const chosen[] = {"OMP_WAIT_POLICY", "OMP_PROC_BIND", "GOMP_CPU_AFFINITY"};
    for (size_t k = 0; k < sizeof chosen / sizeof chosen[0]; k++)
        if (getenv(chosen[k]) != NULL)
            return;
    for (size_t k = 0; k < sizeof settings / sizeof settings[0]; k++)
        if (getenv(settings[k][0]) != NULL)
            return;
    for (size_t k = 0; k < sizeof settings / sizeof settings[0]; k++)
        setenv(settings[k][0], settings[k][1], 1);
    execv("/proc/self/exe", argv); /* where that fails the program goes on as it is */
}

int main(int argc, char **argv) {
    if (argc > 0)
        limit_spinning(argv);
    return cli_main(argc, argv);
}
