#include "interrupt.h"

#include <signal.h>
#include <stddef.h>

static const int numbers[] = {SIGINT, SIGTERM, SIGHUP};
enum { NUMBER_COUNT = sizeof numbers / sizeof *numbers };

void interrupt_hold(void) {
    sigset_t set;
    sigemptyset(&set);
    for (int i = 0; i < NUMBER_COUNT; i++) {
        struct sigaction action;
        if (sigaction(numbers[i], NULL, &action) == 0 && action.sa_handler != SIG_IGN)
            sigaddset(&set, numbers[i]);
    }
    sigprocmask(SIG_BLOCK, &set, NULL);
}

bool interrupt_pending(void) {
    sigset_t set;
    if (sigpending(&set) != 0)
        return false;
    for (int i = 0; i < NUMBER_COUNT; i++)
        if (sigismember(&set, numbers[i]) == 1)
            return true;
    return false;
}
