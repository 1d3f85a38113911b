/* Ctrl-C and friends as a question instead of a handler: the signals are held back, and the run asks between
 * two steps whether one came. */
#ifndef SKIFF_APP_INTERRUPT_H
#define SKIFF_APP_INTERRUPT_H

#include <stdbool.h>

/* From now on SIGINT, SIGTERM and SIGHUP wait to be asked for. Call before threads are made, which inherit
 * this. Signals that were ignored, as in background jobs, stay so. */
void interrupt_hold(void);
/* Whether one of them has come since. */
bool interrupt_pending(void);

#endif
