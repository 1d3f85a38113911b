/* Figures and gauges over a finished picture. */
#ifndef SKIFF_RENDER_HUD_H
#define SKIFF_RENDER_HUD_H

#include "text.h"

#include <stdbool.h>

/* What is shown. A number that is NaN, a negative count and a NULL text are left out. */
typedef struct GfxHudValues {
    double time;             /* s */
    double speed;            /* m/s, of the boat over ground */
    double throttle, rudder; /* -1..1; rudder: positive to starboard */
    const char *keys;        /* names of the pressed keys, separated by blanks; "": none is pressed */
    double particles;        /* number of */
    long moves;              /* of the window, so far */
    bool has_legend; /* a legend takes the lower left corner: speed, throttle and rudder are centred */
    double step_ms;  /* wall time of a step: differs between runs, and with it the bytes of the picture */
} GfxHudValues;

GfxHudValues gfx_hud_nothing(void);

typedef struct GfxHud GfxHud;

/* For pictures of this height (px): everything scales with it. ERR_IO when there is no memory. */
GfxHud *gfx_hud_create(int height, Err *err);
void gfx_hud_destroy(GfxHud *hud); /* NULL is fine */
void gfx_hud_draw(const GfxHud *hud, GfxImage image, const GfxHudValues *values);

#endif
