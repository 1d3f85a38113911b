/* The materials of the meshes in assets/ and some more that boats and harbours have: a row is all that
 * another one takes. OBJ's own colours (.mtl files) are not read: they are another file to lose. */
#include "palette.h"

#include <stddef.h>
#include <string.h>

static const struct {
    const char *name;
    uint8_t color[3];
} colors[] = {
    /* boats */
    {"bottom", {122, 36, 30}},
    {"stripe", {238, 238, 232}},
    {"hull", {84, 104, 118}},
    {"deck", {186, 134, 78}},
    {"cabin", {214, 62, 44}},
    {"glass", {22, 34, 48}},
    /* buoys */
    {"body", {226, 92, 34}},
    {"ring", {244, 240, 228}},
    {"mark", {250, 214, 72}},
    {"lamp", {250, 236, 168}},
    /* harbours and crates */
    {"stone", {148, 142, 132}},
    {"coping", {186, 180, 168}},
    {"iron", {74, 78, 84}},
    {"wood", {168, 122, 74}},
    {"white", {240, 240, 236}},
    {"red", {200, 44, 38}},
};

const uint8_t *palette_color(const char *material) {
    static const uint8_t other[3] = {200, 200, 196};
    for (size_t i = 0; i < sizeof colors / sizeof *colors; i++)
        if (strcmp(colors[i].name, material) == 0)
            return colors[i].color;
    return other;
}
