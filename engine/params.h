/* Checks of the settings that stand in tables (params.inl, drive.inl). */
#ifndef SKIFF_PARAMS_H
#define SKIFF_PARAMS_H

#include "skiff.h"

/* Every field in its range and finite; a line of message, beginning with `path`, for each that is not. */
bool params_check_drive(const SkiffDriveDef *def, const char *path, Err *err);

#endif
