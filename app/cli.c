/* Finds the command, fills a CliArgs from its option table, prints help from the same tables, and turns an
 * Err into messages and the exit code. */
#include "cli.h"

#include "commands.h"
#include "nearest.h"
#include "problems.h"
#include "scene_table.h"
#include "view_options.h"
#include "version.h"

#include "engine/base/file.h"

#include <errno.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(table) ((int)(sizeof(table) / sizeof *(table)))

typedef enum OptionType {
    OPTION_FLAG,
    OPTION_TEXT,
    OPTION_NUMBER,
    OPTION_INTEGER,
    OPTION_CHOICE,
    OPTION_VECTOR,
    OPTION_EDIT
} OptionType;

typedef struct Option {
    char letter; /* 0: none */
    const char *name;
    const char *value; /* what help calls its value */
    OptionType type;
    size_t offset; /* in CliArgs */
    double min, max;
    const char *names; /* choices "a|b|c" */
    const char *help;
} Option;

typedef struct Command {
    const char *name;    /* one or two words */
    const char *operand; /* what its argument is called; NULL: it takes none */
    bool needs_operand;
    const char *arguments;
    const char *summary;
    const char *details;
    const char *examples;
    const Option *options;
    int option_count;
    bool (*run)(const CliArgs *args, Err *err);
} Command;

/* ---- The tables ---- */

#define AT(member) .offset = offsetof(CliArgs, member)
#define OPTION_ROW_THREADS                                                                                   \
    {                                                                                                        \
        0, "threads", "N", OPTION_INTEGER, AT(threads),                                                      \
            .min = 1, .max = SKIFF_MAX_THREADS,                                                              \
            .help = "Threads (default: one for each core). The results do not depend on it"                  \
    }
#define OPTION_ROWS_ENGINE                                                                                   \
    OPTION_ROW_THREADS, {                                                                                    \
        0, "simd", "ISA", OPTION_CHOICE, AT(simd),                                                           \
            .names = SKIFF_SIMD_NAMES, .help = "Instruction set: auto (default), plain, avx2 or avx512"      \
    }
#define OPTION_ROW_SET                                                                                       \
    {                                                                                                        \
        0, "set", "PATH=VALUE", OPTION_EDIT, AT(edits),                                                      \
            .help = "Change a key of the scene, e.g. Configuration.viscosity=0.05, viscosity=0.05 for "      \
                    "short, RigidBodies[0].density=300. Repeatable"                                          \
    }
#define OPTION_ROW_INPUT                                                                                     \
    {                                                                                                        \
        'i', "input", "FILE", OPTION_TEXT, AT(input),                                                        \
            .help = "Input file that drives and steers, in place of the scene's. Lines: TIME "               \
                    "throttle|rudder|heading VALUE, TIME press|release KEY, TIME camera NAME"                \
    }
#define OPTION_ROW_JSON                                                                                      \
    { 0, "json", NULL, OPTION_FLAG, AT(json), .help = "One line of JSON in place of the table" }
#define OPTION_ROW_FORCE                                                                                     \
    { 'f', "force", NULL, OPTION_FLAG, AT(force), .help = "Replace the results in an existing folder" }
#define OPTION_ROW_HELP                                                                                      \
    { 'h', "help", NULL, OPTION_FLAG, AT(help), .help = "Show this help" }

/* Of pictures; words in the order of the enumerations. */
#define PICTURE(member) .offset = offsetof(CliArgs, pictures.member)
#define OPTION_ROW_GL                                                                                        \
    {                                                                                                        \
        0, "gl", "WAY", OPTION_CHOICE, PICTURE(gl),                                                          \
            .names = VIEW_BACKENDS,                                                                          \
            .help = "How OpenGL is reached without a screen: " VIEW_BACKENDS " (default auto: the first "    \
                    "that works)"                                                                            \
    }
#define OPTION_ROWS_PICTURES                                                                                 \
    {                                                                                                        \
        0,           "video",        NULL,                                                                   \
        OPTION_FLAG, PICTURE(video), .help = "Film the frames: video.mp4 (H.264), by ffmpeg"},               \
        {0, "size", "WxH", OPTION_TEXT, PICTURE(size), .help = "Size of a frame, px (default 1280x720)"},    \
        {0,                                                                                                  \
         "supersample",                                                                                      \
         "N",                                                                                                \
         OPTION_INTEGER,                                                                                     \
         PICTURE(supersample),                                                                               \
         .min = 1,                                                                                           \
         .max = RENDER_SUPERSAMPLE_MAX,                                                                      \
         .help = "Draw N times larger, then average; for stills"},                                           \
        {0,                                                                                                  \
         "look",                                                                                             \
         "LOOK",                                                                                             \
         OPTION_CHOICE,                                                                                      \
         PICTURE(look),                                                                                      \
         .names = RENDER_LOOKS,                                                                              \
         .help = RENDER_LOOKS ": a surface, or spheres coloured by a field"},                                \
        {0,                                                                                                  \
         "field",                                                                                            \
         "FIELD",                                                                                            \
         OPTION_CHOICE,                                                                                      \
         PICTURE(field),                                                                                     \
         .names = RENDER_FIELDS,                                                                             \
         .help = "Colour of the look particles: " RENDER_FIELDS},                                            \
        {0,                                                                                                  \
         "camera",                                                                                           \
         "NAME",                                                                                             \
         OPTION_TEXT,                                                                                        \
         PICTURE(camera),                                                                                    \
         .help = "One of the scene's cameras, or chase, fixed, orbit, top, bow; cuts of the input script "   \
                 "are not followed then"},                                                                   \
        {0,                                                                                                  \
         "hud",                                                                                              \
         "WHICH",                                                                                            \
         OPTION_CHOICE,                                                                                      \
         PICTURE(hud),                                                                                       \
         .names = RENDER_HUDS,                                                                               \
         .help = "Figures in the picture: " RENDER_HUDS "; timing adds the wall time of a step, which "      \
                 "makes the frames of two runs differ"},                                                     \
        {0,                                                                                                  \
         "fade",                                                                                             \
         "WHICH",                                                                                            \
         OPTION_CHOICE,                                                                                      \
         PICTURE(fade),                                                                                      \
         .names = "off|on",                                                                                  \
         .help = "on (default): created and removed particles fade; off: they pop"},                         \
        {0, "frames", "A:B", OPTION_TEXT, PICTURE(frames), .help = "Draw only frames A to B, from 1"},       \
        OPTION_ROW_GL

static const Option run_options[] = {
    {'o', "output", "DIR", OPTION_TEXT, AT(output), .help = "Folder for the results, created; required"},
    OPTION_ROW_INPUT,
    {'d', "duration", "S", OPTION_NUMBER, AT(duration), .min = 1e-6, .max = 1e6,
     .help = "Simulated seconds, in place of the scene's"},
    OPTION_ROWS_ENGINE,
    OPTION_ROW_SET,
    OPTION_ROW_FORCE,
    {'r', "resume", NULL, OPTION_FLAG, AT(resume), .help = "Go on from the folder's last checkpoint"},
    {0, "checkpoint-every", "S", OPTION_NUMBER, AT(checkpoint_every), .min = 0, .max = 1e9,
     .help = "Wall-clock seconds between checkpoints (default 120; 0: after every step)"},
    {0, "render", NULL, OPTION_FLAG, PICTURE(render),
     .help = "Draw frames/frame_000001.png ... (default when the scene has a section \"Render\", or when one "
             "of the options below is given)"},
    {0, "no-render", NULL, OPTION_FLAG, PICTURE(no_render), .help = "Draw none; needs no OpenGL"},
    {0, "fps", "N", OPTION_INTEGER, PICTURE(fps), .min = 1, .max = 1000,
     .help = "Frames a simulated second (default 30); the step need not fit"},
    OPTION_ROWS_PICTURES,
    {0, "save-particles", "FPS", OPTION_INTEGER, PICTURE(save_particles), .min = 1, .max = 1000,
     .help = "Save particles/ as often, 52 bytes a particle, for `skiff render` and export"},
    {'q', "quiet", NULL, OPTION_FLAG, AT(quiet), .help = "No progress on stderr"},
    OPTION_ROW_HELP,
};

static const Option check_options[] = {
    {0, "schema", NULL, OPTION_FLAG, AT(schema),
     .help = "Print the JSON schema of scene files, which lists every key"},
    OPTION_ROWS_ENGINE,
    OPTION_ROW_SET,
    OPTION_ROW_HELP,
};

static const Option bench_options[] = {
    {0, "settle", "S", OPTION_NUMBER, AT(settle), .min = 0, .max = 1e6,
     .help = "Simulated seconds before the first measurement (default 1.2)"},
    {0, "steps", "N", OPTION_INTEGER, AT(steps), .min = 1, .max = 1e6,
     .help = "Steps of a window (default 20)"},
    {0, "windows", "N", OPTION_INTEGER, AT(windows), .min = 1, .max = 1e4, .help = "Windows (default 5)"},
    OPTION_ROW_JSON,
    OPTION_ROW_INPUT,
    OPTION_ROWS_ENGINE,
    OPTION_ROW_SET,
    {0, "results", "DIR", OPTION_TEXT, AT(results),
     .help = "Append a row to DIR/<scene>.csv (default: tests/bench/results of the source tree that the "
             "scene is in)"},
    {0, "no-results", NULL, OPTION_FLAG, AT(no_results), .help = "Append no row"},
    {'q', "quiet", NULL, OPTION_FLAG, AT(quiet), .help = "No progress on stderr"},
    OPTION_ROW_HELP,
};

static const Option profile_options[] = {
    OPTION_ROW_JSON,
    OPTION_ROW_HELP,
};

static const Option rest_make_options[] = {
    {'o', "output", "FILE", OPTION_TEXT, AT(output), .help = "Write the tile (default: measure it only)"},
    {0, "edge", "N", OPTION_NUMBER, AT(edge), .min = 6, .max = 64,
     .help = "Edge in particle diameters (default 12: 2171 points)"},
    {0, "seed", "S", OPTION_INTEGER, AT(seed), .min = 0, .max = 2147483647,
     .help = "Which of the arrangements (default 1, the one that comes with the program)"},
    OPTION_ROW_THREADS,
    OPTION_ROW_JSON,
    OPTION_ROW_HELP,
};

static const Option rest_surface_options[] = {
    {'o', "output", "FILE", OPTION_TEXT, AT(output), .help = "Write the surface (default: measure it only)"},
    OPTION_ROW_THREADS,
    OPTION_ROW_JSON,
    OPTION_ROW_HELP,
};

static const Option rest_cut_options[] = {
    {'o', "output", "FILE", OPTION_TEXT, AT(output), .help = "Write the block; required"},
    {0, "min", "X,Y,Z", OPTION_VECTOR, AT(min),
     .help = "Lower corner of the box to cut, m (default: two support radii inside the outermost particles)"},
    {0, "max", "X,Y,Z", OPTION_VECTOR, AT(max), .help = "Upper corner, m"},
    OPTION_ROW_JSON,
    OPTION_ROW_HELP,
};

static const Option rest_show_options[] = {
    OPTION_ROW_JSON,
    OPTION_ROW_HELP,
};

static const Option rest_fill_options[] = {
    {0, "free-steps", "N", OPTION_INTEGER, AT(free_steps), .min = 0, .max = 1e6,
     .help = "Steps to watch the water after the fill (default 100)"},
    OPTION_ROW_JSON,
    OPTION_ROWS_ENGINE,
    OPTION_ROW_SET,
    OPTION_ROW_HELP,
};

static const Option reproduce_options[] = {
    {'d', "duration", "S", OPTION_NUMBER, AT(duration), .min = 0.1, .max = 1000,
     .help = "Simulated seconds of fig5 and boat (default 6.6 and 25, of which 5 without thrust)"},
    {0, "runs", "N", OPTION_INTEGER, AT(runs), .min = 1, .max = 10000,
     .help = "Fills of each row of table1 and fig2, each with another offset (default 51, as the paper)"},
    {0, "paper-only", NULL, OPTION_FLAG, AT(paper_only),
     .help = "table1 without the rows named defaults, which take ten times as long"},
    {0, "radius", "R", OPTION_NUMBER, AT(radius), .min = 0.0125, .max = 0.1,
     .help = "Particle radius, m (default 0.025, as the paper): 0.05 gives a quick look at an eighth of the "
             "particles"},
    {'o', "output", "DIR", OPTION_TEXT, AT(output), .help = "Folder for report.html and the CSV files"},
    OPTION_ROW_FORCE,
    {0, "json", NULL, OPTION_FLAG, AT(json), .help = "One line of JSON for each row in place of the tables"},
    OPTION_ROWS_ENGINE,
    {'q', "quiet", NULL, OPTION_FLAG, AT(quiet), .help = "No progress on stderr"},
    OPTION_ROW_HELP,
};

static const Option render_options[] = {
    {'o', "output", "OUT", OPTION_TEXT, AT(output),
     .help = "Folder for the results (default DIR/redrawn, or DIR/export)"},
    OPTION_ROW_FORCE,
    OPTION_ROWS_PICTURES,
    {0, "export", "FORMAT", OPTION_CHOICE, PICTURE(export), .names = VIEW_EXPORTS,
     .help = "Convert the particles instead of drawing them: vtk (.vtu: ParaView, Blender), ply, bgeo "
             "(Houdini)"},
    {'q', "quiet", NULL, OPTION_FLAG, AT(quiet), .help = "No progress on stderr"},
    OPTION_ROW_HELP,
};

static const Option gl_info_options[] = {
    OPTION_ROW_GL,
    OPTION_ROW_HELP,
};

static const Command commands[] = {
    {"run", "scene", true, "SCENE -o DIR", "Simulate a scene and write its results into a folder",
     "The folder receives report.html (charts; open it in a browser), summary.json, steps.csv, ledger.csv\n"
     "(particles in and out by cause), hull.csv (bodies), probes.csv, trace.json (opens in Perfetto),\n"
     "scene.json (the scene with every default filled in), run.input (what was driven; --input replays it)\n"
     "and state.skiff (checkpoint); with pictures also frames/ and video.mp4.\n"
     "Ctrl-C finishes the step, writes a checkpoint and the report, and exits with 130; --resume goes on "
     "from there.\n",
     "  skiff run assets/scenes/boat.json --input assets/inputs/slalom.input -o out/slalom --no-render\n"
     "  skiff run assets/scenes/settling-tank.json -o out/tank\n"
     "  skiff run assets/scenes/dam-body.json -o out/dam --duration 2 --set RigidBodies[0].density=300\n"
     "  skiff run assets/scenes/dam-body.json -o out/dam --resume --duration 4\n"
     "  skiff run assets/scenes/dam-body.json -o out/film --video --size 960x540 --camera orbit\n",
     run_options, COUNT(run_options), run_command},
    {"check", "scene", true, "SCENE", "Check a scene and show what it means",
     "Reports every problem of the file, with its place, the values allowed and the nearest name. A good\n"
     "scene is printed to stdout as JSON with every default filled in; counts, bodies and memory follow on\n"
     "stderr. Writes no file.\n",
     "  skiff check assets/scenes/floating-box.json\n"
     "  skiff check scene.json --set particleRadius=0.02 > effective.json\n"
     "  skiff check --schema > scene.schema.json\n",
     check_options, COUNT(check_options), check_command},
    {"bench", "scene", true, "SCENE", "Measure the time of a step",
     "Lets the scene settle, then times windows of steps and prints the median over the windows: ms for\n"
     "each phase, iterations, particles a second, and the errors reached. Appends a row to the scene's CSV\n"
     "file of results.\n",
     "  skiff bench assets/scenes/bench-tank.json\n"
     "  skiff bench assets/scenes/bench-dam.json --settle 0 --steps 95 --windows 7 --json\n",
     bench_options, COUNT(bench_options), bench_command},
    {"profile", "folder", true, "DIR", "Show where the time of a run's steps went",
     "Reads steps.csv in a folder of results: percentiles of the step times, means of each phase for all\n"
     "steps, for plain ones (no window move, nor one within the last five steps) and for window moves, the\n"
     "mean of the five steps after a move, and for the ten slowest steps what they did that others did "
     "not.\n",
     "  skiff profile out/tank\n"
     "  skiff profile out/tank --json\n",
     profile_options, COUNT(profile_options), profile_command},
    {"rest make", NULL, false, "[-o FILE]", "Make a tile of water at rest, which shapes are filled from",
     "Relaxes random points of a periodic cube until every density is rest density and the pressures of "
     "still\n"
     "water push no point, and prints how well that went. Lengths in the file are in particle radii, so that "
     "one\n"
     "file serves every resolution. The tile made by the defaults is part of the program.\n",
     "  skiff rest make\n"
     "  skiff rest make --edge 16 --seed 7 -o tile.skiff\n",
     rest_make_options, COUNT(rest_make_options), rest_make_command},
    {"rest surface", NULL, false, "[-o FILE]", "Make the surface of the sea: the built-in tile, settled",
     "Cuts the tile that is part of the program at a level and lets what is left settle there, repeating\n"
     "without end to all sides. The sea ahead of a window is made of it and of the tile below. The surface\n"
     "itself is part of the program, too; it has to be made anew when the tile is.\n",
     "  skiff rest surface -o assets/rest/surface.skiff\n", rest_surface_options, COUNT(rest_surface_options),
     rest_surface_command},
    {"rest cut", "folder", true, "DIR -o FILE", "Cut a block of water at rest out of a finished run",
     "Takes the particles of a box out of the last state of a run, a tank that has settled, and prints how "
     "much\n"
     "they are at rest. Other than a tile, a block ends at its faces: it fills no more than its own size.\n",
     "  skiff run assets/scenes/settling-tank.json -o out/tank\n"
     "  skiff rest cut out/tank -o block.skiff\n"
     "  skiff rest cut out/tank --min -0.5,0.2,-0.5 --max 0.5,0.8,0.5 -o block.skiff\n",
     rest_cut_options, COUNT(rest_cut_options), rest_cut_command},
    {"rest show", "file", false, "[FILE]", "Show how much a tile or block is at rest",
     "Without a file: the tile that is part of the program.\n",
     "  skiff rest show\n"
     "  skiff rest show block.skiff --json\n",
     rest_show_options, COUNT(rest_show_options), rest_show_command},
    {"rest fill", "scene", true, "SCENE", "Fill a scene with water at rest and see how still it stands",
     "Fills what the scene fills at its start with \"fill\": \"rest\", lets the water go for some steps and\n"
     "prints counts, densities and times of the fill (of the last block, where there are several) and "
     "speeds\n"
     "and drift afterwards.\n",
     "  skiff rest fill assets/scenes/settling-tank.json --set FluidBlocks[0].fill=rest\n"
     "  skiff rest fill scene.json --free-steps 300 --json --set restSettle=candidates\n",
     rest_fill_options, COUNT(rest_fill_options), rest_fill_command},
    {"reproduce carensac2023", "experiment", false, "[EXPERIMENT]",
     "Run the experiments of a paper and set our figures beside its own",
     "Fluid initialization and dynamic window for SPH simulation (Carensac, Pronost, Bouakaz 2023):\n"
     "  table1   four fills with water at rest: counts, times, iterations, speeds afterwards\n"
     "  fig2     rules of the selection, over their parameters\n"
     "  fig4c    a floating cube for 3 s after a fill\n"
     "  fig5     a wedge falls into a corridor with one absorbing end: energies, counts, depth\n"
     "  boat     a boat in the moving windows of 5 m and 2.5 m: speed, times of steps\n"
     "  all      all of these (default); boat alone takes an hour or more\n"
     "In fills, rows with the paper's name follow its method; those named \"defaults\" are what this program "
     "does by\n"
     "itself.\n",
     "  skiff reproduce carensac2023 table1 --runs 5\n"
     "  skiff reproduce carensac2023 fig5 --radius 0.05 -o out/fig5\n"
     "  skiff reproduce carensac2023 fig4c --radius 0.05 -o float\n"
     "  skiff reproduce carensac2023 all -o out/carensac2023\n",
     reproduce_options, COUNT(reproduce_options), reproduce_carensac_command},
    {"render", "folder of a run", true, "DIR", "Draw a finished run again, or export its particles",
     "Reads what `skiff run --save-particles FPS -o DIR` left in DIR: a frame for each saved moment, with\n"
     "another look, camera or size. --export needs no OpenGL.\n",
     "  skiff run assets/scenes/dam-body.json -o out/dam --save-particles 30\n"
     "  skiff render out/dam --look particles --field pressure --camera top --video\n"
     "  skiff render out/dam --export vtk -o out/vtk\n",
     render_options, COUNT(render_options), render_command},
    {"gl-info", NULL, false, "", "Show how OpenGL is reached and who draws",
     "Tries the ways to draw without a screen and prints vendor, renderer and version of the one that is\n"
     "used. Exit code 4 where none works, with the packages to install.\n",
     "  skiff gl-info\n"
     "  skiff gl-info --gl osmesa\n",
     gl_info_options, COUNT(gl_info_options), gl_info_command},
};

/* ---- Help ---- */

/* Prints text broken at spaces to `width` columns, the lines after the first indented. */
static void print_wrapped(const char *text, int indent, int width) {
    int column = indent;
    while (*text) {
        int count = (int)strcspn(text, " ");
        if (column > indent && column + 1 + count > width) {
            printf("\n%*s", indent, "");
            column = indent;
        } else if (column > indent) {
            putchar(' ');
            column++;
        }
        printf("%.*s", count, text);
        column += count;
        text += count + (text[count] == ' ');
    }
    putchar('\n');
}

static void print_usage(const Command *command) {
    char usage[64];
    snprintf(usage, sizeof usage, "skiff %s %s", command->name, command->arguments);
    printf("  %-28s", usage);
    if (strlen(usage) > 28)
        printf("\n  %-28s", "");
    printf(" %s\n", command->summary);
}

static void print_main_help(void) {
    printf("skiff %s: particle water around moving bodies (SPH)\n\nUsage:\n", SKIFF_VERSION);
    for (int i = 0; i < COUNT(commands); i++)
        print_usage(&commands[i]);
    printf("  %-28s %s\n", "skiff help [COMMAND]", "Show help, with every option of a command");
    printf("  %-28s %s\n", "skiff --version", "Show version, commit and compiler");
    fputs(
        "\nScenes are JSON files; assets/scenes has examples and `skiff check --schema` lists every key.\n"
        "\nExamples:\n"
        "  skiff run assets/scenes/boat.json -o out/boat --video      then open out/boat/report.html\n"
        "  skiff profile out/boat\n"
        "  skiff check assets/scenes/floating-box.json\n"
        "  skiff bench assets/scenes/bench-tank.json --json\n"
        "\nExit codes: 0 ok, 2 usage, 3 bad input, 4 no OpenGL, 5 diverged, 6 reading or writing failed, 130 "
        "interrupted.\n",
        stdout);
}

static void print_command_help(const Command *command) {
    printf("skiff %s: %s\n\nUsage: skiff %s%s%s [OPTION]...\n\n%s\nOptions:\n", command->name,
           command->summary, command->name, *command->arguments ? " " : "", command->arguments,
           command->details);
    for (int i = 0; i < command->option_count; i++) {
        const Option *option = &command->options[i];
        char letter[8] = "    ", usage[64];
        if (option->letter)
            snprintf(letter, sizeof letter, "-%c, ", option->letter);
        snprintf(usage, sizeof usage, "%s--%s%s%s", letter, option->name, option->value ? " " : "",
                 option->value ? option->value : "");
        printf("  %-25s ", usage);
        print_wrapped(option->help, 28, 110);
    }
    printf("\nExamples:\n%s", command->examples);
}

static void print_version(void) {
    printf("skiff %s\ncommit %s\nbuilt by %s\n", SKIFF_VERSION, SKIFF_COMMIT, SKIFF_COMPILER);
}

/* ---- Parsing ---- */

static const Option *find_option(const Command *command, const char *name, size_t count) {
    for (int i = 0; i < command->option_count; i++)
        if (strlen(command->options[i].name) == count && memcmp(command->options[i].name, name, count) == 0)
            return &command->options[i];
    return NULL;
}

static const Option *find_letter(const Command *command, char letter) {
    for (int i = 0; i < command->option_count; i++)
        if (letter && command->options[i].letter == letter)
            return &command->options[i];
    return NULL;
}

static bool unknown_option(const Command *command, const char *argument, Err *err) {
    char name[64], quoted[64];
    snprintf(name, sizeof name, "%.*s", (int)strcspn(argument, "="), argument);
    Nearest nearest = nearest_begin(name + (name[1] == '-' ? 2 : 1));
    for (int i = 0; i < command->option_count; i++)
        nearest_offer(&nearest, command->options[i].name);
    const char *best = nearest_result(&nearest);
    problems_quote(quoted, sizeof quoted, name);
    return err_set(err, ERR_USAGE, "unknown option %s%s%s%s", quoted, best ? ", did you mean --" : "",
                   best ? best : "", best ? "?" : "");
}

static bool set_number(const Option *option, const char *text, CliArgs *args, Err *err) {
    char *end;
    double value = strtod(text, &end);
    bool whole = option->type == OPTION_NUMBER || value == floor(value);
    if (end == text || *end != '\0' || !isfinite(value) || !whole || value < option->min ||
        value > option->max)
        return err_set(err, ERR_USAGE, "--%s: expected %s from %g to %g, found \"%.80s\"", option->name,
                       option->type == OPTION_NUMBER ? "a number" : "an integer", option->min, option->max,
                       text);
    void *member = (char *)args + option->offset;
    if (option->type == OPTION_NUMBER)
        *(double *)member = value;
    else
        *(int *)member = (int)value;
    return true;
}

static bool set_vector(const Option *option, const char *text, CliArgs *args, Err *err) {
    double *member = (double *)(void *)((char *)args + option->offset), value[3];
    const char *rest = text;
    for (int k = 0; k < 3; k++) {
        char *end;
        value[k] = strtod(rest, &end);
        if (end == rest || *end != (k < 2 ? ',' : '\0') || !isfinite(value[k]))
            return err_set(err, ERR_USAGE, "--%s: expected three numbers, %s, found \"%.80s\"", option->name,
                           option->value, text);
        rest = end + 1;
    }
    memcpy(member, value, sizeof value);
    return true;
}

static bool set_choice(const Option *option, const char *text, CliArgs *args, Err *err) {
    int index = 0;
    Nearest nearest = nearest_begin(text);
    for (const char *name = option->names; *name; index++) {
        size_t count = strcspn(name, "|");
        if (strlen(text) == count && memcmp(text, name, count) == 0) {
            *(int *)(void *)((char *)args + option->offset) = index;
            return true;
        }
        name += count + (name[count] == '|');
    }
    nearest_offer_list(&nearest, option->names);
    const char *best = nearest_result(&nearest);
    return err_set(err, ERR_USAGE, "--%s: expected %s, found \"%.80s\"%s%s%s", option->name, option->names,
                   text, best ? ", did you mean " : "", best ? best : "", best ? "?" : "");
}

static bool set_option(const Option *option, const char *text, CliArgs *args, Err *err) {
    void *member = (char *)args + option->offset;
    switch (option->type) {
    case OPTION_FLAG:
        *(bool *)member = true;
        return true;
    case OPTION_TEXT:
        if (!*text)
            return err_set(err, ERR_USAGE, "--%s: the value is empty", option->name);
        *(const char **)member = text;
        return true;
    case OPTION_NUMBER:
    case OPTION_INTEGER:
        return set_number(option, text, args, err);
    case OPTION_CHOICE:
        return set_choice(option, text, args, err);
    case OPTION_VECTOR:
        return set_vector(option, text, args, err);
    case OPTION_EDIT:
        if (args->edit_count == CLI_MAX_EDITS)
            return err_set(err, ERR_USAGE, "--set: given more than %d times", CLI_MAX_EDITS);
        args->edits[args->edit_count++] = text;
        return true;
    }
    return false;
}

/* Handles argv[*i], which begins with '-', and its value. */
static bool parse_option(const Command *command, int argc, char **argv, int *i, CliArgs *args, Err *err) {
    const char *argument = argv[*i], *value = NULL;
    const Option *option;
    if (argument[1] == '-') {
        size_t count = strcspn(argument + 2, "=");
        option = find_option(command, argument + 2, count);
        value = argument[2 + count] == '=' ? argument + 2 + count + 1 : NULL;
    } else {
        option = find_letter(command, argument[1]);
        value = argument[2] != '\0' ? argument + 2 : NULL;
    }
    if (!option)
        return unknown_option(command, argument, err);
    if (option->type == OPTION_FLAG && value)
        return err_set(err, ERR_USAGE, "--%s takes no value", option->name);
    if (option->type != OPTION_FLAG && !value) {
        if (*i + 1 >= argc)
            return err_set(err, ERR_USAGE, "--%s: %s is missing", option->name, option->value);
        value = argv[++*i];
    }
    return set_option(option, value, args, err);
}

static bool parse(const Command *command, int argc, char **argv, CliArgs *args, Err *err) {
    bool only_arguments = false;
    for (int i = 0; i < argc; i++) {
        if (!only_arguments && strcmp(argv[i], "--") == 0) {
            only_arguments = true;
        } else if (!only_arguments && argv[i][0] == '-' && argv[i][1] != '\0') {
            if (!parse_option(command, argc, argv, &i, args, err))
                return false;
        } else if (!command->operand) {
            return err_set(err, ERR_USAGE, "takes options only, \"%.200s\" is given", argv[i]);
        } else if (args->operand) {
            return err_set(err, ERR_USAGE, "one %s at a time: \"%.200s\" and \"%.200s\" are given",
                           command->operand, args->operand, argv[i]);
        } else {
            args->operand = argv[i];
        }
    }
    if (command->needs_operand && !args->operand && !args->help && !args->schema)
        return err_set(err, ERR_USAGE, "the %s is missing", command->operand);
    return true;
}

static CliArgs default_args(void) {
    return (CliArgs){.duration = NAN,
                     .checkpoint_every = 120,
                     .settle = 1.2,
                     .steps = 20,
                     .windows = 5,
                     .free_steps = 100,
                     .runs = 51,
                     .radius = NAN,
                     .edge = 12,
                     .seed = 1,
                     .min = {NAN, NAN, NAN},
                     .max = {NAN, NAN, NAN},
                     .pictures = {.look = -1, .field = -1, .hud = -1, .fade = -1, .gl = -1, .export = -1}};
}

/* ---- Running ---- */

/* How many of the words are the command's name; 0: they are not. */
static int match_name(const Command *command, int count, char **words) {
    const char *blank = strchr(command->name, ' ');
    if (!blank)
        return strcmp(command->name, words[0]) == 0;
    const size_t length = (size_t)(blank - command->name);
    return count > 1 && strlen(words[0]) == length && memcmp(command->name, words[0], length) == 0 &&
                   strcmp(words[1], blank + 1) == 0
               ? 2
               : 0;
}

static const Command *find_command(int count, char **words, int *used) {
    for (int i = 0; i < COUNT(commands); i++) {
        *used = match_name(&commands[i], count, words);
        if (*used > 0)
            return &commands[i];
    }
    return NULL;
}

/* The second word of a command whose first is `group`, or NULL. */
static const char *word_in_group(const Command *command, const char *group) {
    const size_t length = strlen(group);
    return strncmp(command->name, group, length) == 0 && command->name[length] == ' '
               ? command->name + length + 1
               : NULL;
}

static bool is_group(const char *word) {
    for (int i = 0; i < COUNT(commands); i++)
        if (word_in_group(&commands[i], word))
            return true;
    return false;
}

static void print_group_help(const char *group) {
    printf("Usage:\n");
    for (int i = 0; i < COUNT(commands); i++)
        if (word_in_group(&commands[i], group))
            print_usage(&commands[i]);
    printf("\n'skiff help %s COMMAND' shows the options of one.\n", group);
}

/* `word` was not found among the commands (group NULL), or among those of a group. */
static int unknown_command(const char *group, const char *word) {
    char quoted[64];
    Nearest nearest = nearest_begin(word);
    for (int i = 0; i < COUNT(commands); i++)
        if (!group || word_in_group(&commands[i], group))
            nearest_offer(&nearest, group ? word_in_group(&commands[i], group) : commands[i].name);
    if (!group)
        nearest_offer(&nearest, "help");
    const char *best = nearest_result(&nearest);
    problems_quote(quoted, sizeof quoted, word);
    fprintf(stderr, "skiff%s%s: unknown command %s%s%s%s\nTry 'skiff%s%s --help'.\n", group ? " " : "",
            group ? group : "", quoted, best ? ", did you mean " : "", best ? best : "", best ? "?" : "",
            group ? " " : "", group ? group : "");
    return ERR_USAGE;
}

/* Output that did not reach its reader is a failure too. */
static int finish(int code) {
    if (fflush(stdout) == 0 && !ferror(stdout))
        return code;
    fprintf(stderr, "skiff: writing to stdout failed: %s\n", strerror(errno));
    return ERR_IO;
}

static int run_one(const Command *command, int argc, char **argv) {
    CliArgs args = default_args();
    Err err = {0};
    if (!parse(command, argc, argv, &args, &err)) {
        fprintf(stderr, "skiff %s: %s\nTry 'skiff %s --help'.\n", command->name, err.message, command->name);
        return ERR_USAGE;
    }
    if (args.help) {
        print_command_help(command);
        return finish(ERR_NONE);
    }
    if (command->run(&args, &err))
        return finish(ERR_NONE);
    fflush(stdout);
    if (err.code == ERR_USAGE)
        fprintf(stderr, "skiff %s: ", command->name);
    fprintf(stderr, "%s\n", err.message);
    return (int)err.code;
}

static bool asks_for_help(const char *word) {
    return strcmp(word, "--help") == 0 || strcmp(word, "-h") == 0;
}

/* No command has this name: the first word may be that of a group. */
static int run_group(int count, char **words) {
    if (!is_group(words[0]))
        return unknown_command(NULL, words[0]);
    if (count > 1 && !asks_for_help(words[1]))
        return unknown_command(words[0], words[1]);
    if (count > 1) {
        print_group_help(words[0]);
        return finish(ERR_NONE);
    }
    fprintf(stderr, "skiff %s: a command is missing\nTry 'skiff %s --help'.\n", words[0], words[0]);
    return ERR_USAGE;
}

bool cli_check_folder(const CliArgs *args, const char *folder, Err *err) {
    return args->force || !file_exists(folder) ||
           err_set(err, ERR_USAGE, "%s: the folder exists; --force replaces its results", folder);
}

int cli_main(int argc, char **argv) {
    if (argc < 2) {
        fputs("skiff: a command is missing\nTry 'skiff --help'.\n", stderr);
        return ERR_USAGE;
    }
    const char *name = argv[1];
    if (strcmp(name, "--version") == 0 || strcmp(name, "-V") == 0) {
        print_version();
        return finish(ERR_NONE);
    }
    bool is_help = strcmp(name, "help") == 0;
    if (asks_for_help(name) || (is_help && argc < 3)) {
        print_main_help();
        return finish(ERR_NONE);
    }
    int count = argc - 1 - is_help, used;
    char **words = argv + 1 + is_help;
    const Command *command = find_command(count, words, &used);
    if (is_help && !command && count == 1 && is_group(words[0]))
        print_group_help(words[0]);
    else if (!command)
        return run_group(count, words);
    else if (is_help)
        print_command_help(command);
    else
        return run_one(command, count - used, words + used);
    return finish(ERR_NONE);
}
