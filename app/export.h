/* Particles for other programs. */
#ifndef SKIFF_APP_EXPORT_H
#define SKIFF_APP_EXPORT_H

#include "frames.h"

/* Positions in VIEW_EXPORTS. */
typedef enum ExportFormat { EXPORT_VTK, EXPORT_PLY, EXPORT_BGEO } ExportFormat;

const char *export_suffix(ExportFormat format); /* "vtu", "ply", "bgeo" */

/* Writes the particles that exist, at their world positions, with id, velocity (m/s; "v" in bgeo, as Houdini
 * calls it), density (kg/m^3), birth (s) and, where there is a window, edge_distance (m, negative inside).
 * bgeo has 32-bit numbers only. ERR_INPUT when an id does not fit the format, ERR_IO. */
bool export_write(const Frame *frame, float rest_density, ExportFormat format, const char *path, Err *err);

#endif
