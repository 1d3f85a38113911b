/* The commands of the program, each in the file of its name. Results go to stdout, progress to stderr;
 * err->code becomes the exit code. */
#ifndef SKIFF_APP_COMMANDS_H
#define SKIFF_APP_COMMANDS_H

#include "cli.h"

bool run_command(const CliArgs *args, Err *err);
bool check_command(const CliArgs *args, Err *err);
bool bench_command(const CliArgs *args, Err *err);
bool render_command(const CliArgs *args, Err *err);
bool gl_info_command(const CliArgs *args, Err *err);
bool profile_command(const CliArgs *args, Err *err);
bool rest_make_command(const CliArgs *args, Err *err);
bool rest_surface_command(const CliArgs *args, Err *err);
bool rest_cut_command(const CliArgs *args, Err *err);
bool rest_show_command(const CliArgs *args, Err *err);
bool rest_fill_command(const CliArgs *args, Err *err);
bool reproduce_carensac_command(const CliArgs *args, Err *err);

#endif
