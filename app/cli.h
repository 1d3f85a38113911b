/* The command line: one table of commands, one table of options for each. */
#ifndef SKIFF_APP_CLI_H
#define SKIFF_APP_CLI_H

#include "engine/base/err.h"

enum { CLI_MAX_EDITS = 64 };

/* What it said about pictures. -1, 0 and NULL: nothing. */
typedef struct CliPictures {
    bool render, no_render, video;
    int look, field, hud, fade, gl, export; /* position in the option's list of words */
    int fps, supersample, save_particles;
    const char *size, *camera, *frames;
} CliPictures;

/* What the command line said. Options that a command does not have keep their defaults. */
typedef struct CliArgs {
    const char *operand; /* what a command is about: a scene, a folder...; NULL: left out where it may be */
    const char *input;   /* --input; NULL: not given */
    const char *output;  /* -o; NULL: not given */
    double duration;     /* s; NaN: the scene's */
    int threads;         /* 0: one for each core */
    int simd;            /* SkiffSimd */
    const char *edits[CLI_MAX_EDITS]; /* --set, in order */
    int edit_count;
    bool force, resume, quiet;
    double checkpoint_every; /* s of wall time */
    bool schema;             /* check */
    double settle;           /* bench, s */
    int steps, windows;
    bool json, no_results;
    const char *results; /* NULL: the source tree's */
    CliPictures pictures;
    double edge; /* rest make, d */
    int seed;
    double min[3], max[3]; /* rest cut, m; NaN: not given */
    int free_steps;        /* rest fill */
    int runs;              /* reproduce */
    bool paper_only;       /* reproduce */
    double radius;         /* reproduce, m; NaN: the standard one */
    bool help;
} CliArgs;

/* Results never replace others unasked: ERR_USAGE when `folder` exists, but for --force. */
bool cli_check_folder(const CliArgs *args, const char *folder, Err *err);

/* Runs the program. Returns its exit code. */
int cli_main(int argc, char **argv);

#endif
