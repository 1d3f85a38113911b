/* The program as a user meets it: exit codes, messages, files. Drives the real binary. */
#include "app/csv.h"
#include "engine/base/err.h"
#include "engine/base/file.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <jansson.h>
#include <math.h>
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>
#include <cmocka.h>

#include "scratch.h"

#define COUNT(table) ((int)(sizeof(table) / sizeof *(table)))
#define SMALL        SKIFF_SOURCE_DIR "/assets/scenes/small.json"

enum { MAX_ARGUMENTS = 24, PATH_SIZE = 512 };

/* ---- Running the program ---- */

typedef struct Result {
    int code; /* exit code, or -signal */
    char *out, *err;
} Result;

/* Arguments separated by blanks; none holds one. */
static pid_t start(const char *arguments) {
    char *words = strdup(arguments), *argv[MAX_ARGUMENTS] = {(char *)(uintptr_t)SKIFF_PROGRAM};
    assert_non_null(words);
    int count = 1;
    for (char *word = strtok(words, " "); word && count + 1 < MAX_ARGUMENTS; word = strtok(NULL, " "))
        argv[count++] = word;
    pid_t child = fork();
    assert_true(child >= 0);
    if (child == 0) {
        int out = open("stdout.txt", O_WRONLY | O_CREAT | O_TRUNC, 0644);
        int err = open("stderr.txt", O_WRONLY | O_CREAT | O_TRUNC, 0644);
        if (out < 0 || err < 0 || dup2(out, 1) < 0 || dup2(err, 2) < 0)
            _exit(99);
        execv(SKIFF_PROGRAM, argv);
        _exit(98);
    }
    free(words);
    return child;
}

static Result finish(pid_t child) {
    int status;
    while (waitpid(child, &status, 0) < 0)
        assert_int_equal(errno, EINTR);
    return (Result){.code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status),
                    .out = scratch_read("stdout.txt"),
                    .err = scratch_read("stderr.txt")};
}

static void drop(Result *result) {
    free(result->out);
    free(result->err);
}

/* Runs and checks exit code and what stdout and stderr contain (NULL: nothing at all, "": whatever). */
static void expect(const char *arguments, int code, const char *out, const char *err) {
    Result result = finish(start(arguments));
    if (result.code != code)
        fail_msg("skiff %s: exit code %d, expected %d\n%s", arguments, result.code, code, result.err);
    if (out ? !strstr(result.out, out) : *result.out)
        fail_msg("skiff %s: stdout is\n%s\nexpected\n%s", arguments, result.out, out ? out : "nothing");
    if (err ? !strstr(result.err, err) : *result.err)
        fail_msg("skiff %s: stderr is\n%s\nexpected\n%s", arguments, result.err, err ? err : "nothing");
    drop(&result);
}

static bool exists(const char *path) {
    return access(path, F_OK) == 0;
}

static int entry_count(const char *path) {
    DIR *directory = opendir(path);
    int count = 0;
    assert_non_null(directory);
    while (readdir(directory))
        count++;
    closedir(directory);
    return count - 2;
}

/* ---- The command line ---- */

static void usage_mistakes_exit_with_2(void **state) {
    (void)state;
    static const struct {
        const char *arguments, *message;
    } rows[] = {
        {"", "skiff: a command is missing\nTry 'skiff --help'.\n"},
        {"rnu", "skiff: unknown command rnu, did you mean run?\nTry 'skiff --help'.\n"},
        {"elephant", "skiff: unknown command elephant\nTry 'skiff --help'.\n"},
        {"help rnu", "skiff: unknown command rnu, did you mean run?\n"},
        {"run", "skiff run: the scene is missing\nTry 'skiff run --help'.\n"},
        {"run a.json", "skiff run: -o DIR is missing: the folder for the results\n"},
        {"run a.json b.json", "skiff run: one scene at a time: \"a.json\" and \"b.json\" are given\n"},
        {"profile", "skiff profile: the folder is missing\nTry 'skiff profile --help'.\n"},
        {"profile a b", "skiff profile: one folder at a time: \"a\" and \"b\" are given\n"},
        {"run a.json --frce", "skiff run: unknown option --frce, did you mean --force?\n"},
        {"run a.json --check 3", "skiff run: unknown option --check, did you mean --checkpoint-every?\n"},
        {"run a.json -z", "skiff run: unknown option -z\n"},
        {"run a.json --force=yes", "skiff run: --force takes no value\n"},
        {"run a.json -o", "skiff run: --output: DIR is missing\n"},
        {"run a.json -o out --threads 0",
         "skiff run: --threads: expected an integer from 1 to 256, found \"0\"\n"},
        {"run a.json -o out --threads 2.5",
         "skiff run: --threads: expected an integer from 1 to 256, found \"2.5\"\n"},
        {"run a.json -o out --threads many",
         "skiff run: --threads: expected an integer from 1 to 256, found \"many\"\n"},
        {"run a.json -o out --duration nan",
         "skiff run: --duration: expected a number from 1e-06 to 1e+06, found \"nan\"\n"},
        {"run a.json -o out --duration -1",
         "skiff run: --duration: expected a number from 1e-06 to 1e+06, found \"-1\"\n"},
        {"run a.json -o out --simd axv2",
         "skiff run: --simd: expected auto|plain|avx2|avx512, found \"axv2\", did you mean avx2?\n"},
        {"run a.json -o out --force --resume",
         "skiff run: --force starts anew and --resume goes on: give one of them\n"},
        {"run a.json -o out --resume", "skiff run: out: there is no such folder to resume\n"},
        {"bench a.json --steps 0",
         "skiff bench: --steps: expected an integer from 1 to 1e+06, found \"0\"\n"},
        {"rest", "skiff rest: a command is missing\nTry 'skiff rest --help'.\n"},
        {"rest mkae", "skiff rest: unknown command mkae, did you mean make?\nTry 'skiff rest --help'.\n"},
        {"help rest mkae", "skiff rest: unknown command mkae, did you mean make?\n"},
        {"reproduce carensac2023 tabel1",
         "skiff reproduce carensac2023: expected table1, fig2, fig4c, fig5, boat or all, found \"tabel1\"\n"},
        {"reproduce carensac2023 --runs 0",
         "skiff reproduce carensac2023: --runs: expected an integer from 1 to 10000, found \"0\"\n"},
        {"reproduce carensac2023 --radius 1",
         "skiff reproduce carensac2023: --radius: expected a number from 0.0125 to 0.1, found \"1\"\n"},
        {"reproduce carensac2023 fig4c -o .",
         "skiff reproduce carensac2023: .: the folder exists; --force replaces its results\n"},
        {"rest make tile", "skiff rest make: takes options only, \"tile\" is given\n"},
        {"rest make --edge 5", "skiff rest make: --edge: expected a number from 6 to 64, found \"5\"\n"},
        {"rest cut -o block.skiff", "skiff rest cut: the folder is missing\n"},
        {"rest cut out", "skiff rest cut: -o FILE is missing\n"},
        {"rest cut out --min 1,2,x",
         "skiff rest cut: --min: expected three numbers, X,Y,Z, found \"1,2,x\"\n"},
        {"rest cut out --max 1,2,3,4",
         "skiff rest cut: --max: expected three numbers, X,Y,Z, found \"1,2,3,4\"\n"},
        {"check " SMALL " --set viscosty=1",
         "skiff check: --set viscosty=1: no key \"viscosty\", did you mean viscosity?\n"},
    };
    for (int i = 0; i < COUNT(rows); i++)
        expect(rows[i].arguments, ERR_USAGE, NULL, rows[i].message);
}

static void help_explains_every_command(void **state) {
    (void)state;
    static const char *const commands[] = {"run", "check", "bench"};
    expect("--help", 0, "Usage:", NULL);
    expect("-h", 0, "Exit codes: 0 ok, 2 usage, 3 bad input, 4 no OpenGL, 5 diverged", NULL);
    expect("help", 0, "skiff bench SCENE", NULL);
    expect("--version", 0, "commit ", NULL);
    expect("rest --help", 0, "skiff rest cut DIR -o FILE", NULL);
    expect("help rest", 0, "skiff rest show [FILE]", NULL);
    expect("help rest make", 0, "Usage: skiff rest make [-o FILE] [OPTION]...", NULL);
    expect("help rest fill", 0, "Usage: skiff rest fill SCENE [OPTION]...", NULL);
    expect("help reproduce carensac2023", 0, "[EXPERIMENT] [OPTION]...", NULL);
    for (int i = 0; i < COUNT(commands); i++) {
        char arguments[64], usage[64];
        snprintf(usage, sizeof usage, "Usage: skiff %s SCENE", commands[i]);
        snprintf(arguments, sizeof arguments, "%s --help", commands[i]);
        expect(arguments, 0, usage, NULL);
        expect(arguments, 0, "--set PATH=VALUE", NULL);
        snprintf(arguments, sizeof arguments, "help %s", commands[i]);
        expect(arguments, 0, usage, NULL);
        expect(arguments, 0, "\nExamples:\n  skiff ", NULL);
    }
}

static void help_lines_are_short(void **state) {
    (void)state;
    static const char *const arguments[] = {"--help",          "run --help",      "check --help",
                                            "bench --help",    "rest --help",     "rest make --help",
                                            "rest cut --help", "rest show --help"};
    for (int i = 0; i < COUNT(arguments); i++) {
        Result result = finish(start(arguments[i]));
        for (const char *line = result.out; *line;) {
            size_t count = strcspn(line, "\n");
            assert_in_range(count, 0, 110);
            line += count + (line[count] == '\n');
        }
        drop(&result);
    }
}

/* ---- Scenes ---- */

static void bad_scenes_exit_with_3(void **state) {
    (void)state;
    expect("check nowhere.json", ERR_INPUT, NULL, "nowhere.json: ");
    expect("check /tmp", ERR_INPUT, NULL, "/tmp: is a directory");
    scratch_write("cut.json", "{\"version\": 1,\n \"Tank\": {");
    expect("check cut.json", ERR_INPUT, NULL, "cut.json:2:");
    expect("run cut.json -o cut", ERR_INPUT, NULL, "not valid JSON");
    expect("bench cut.json", ERR_INPUT, NULL, "cut.json:2:");
    expect("check " SMALL " --set viscosity=5", ERR_INPUT, NULL,
           "--set Configuration.viscosity: expected a number from 0 to 1, found 5\n");
    assert_false(exists("cut")); /* nothing is written for a bad scene */
}

/* What only the engine can tell comes with file and path too. */
static void the_engine_reports_with_file_and_path(void **state) {
    (void)state;
    static const char *const heads[] = {
        "{\"version\": 1, \"FluidBlocks\": [{\"start\": [0, 0, 0], \"end\": [1, 1, 1]}],"};
    char text[1024];
    snprintf(
        text, sizeof text,
        "%s \"RigidBodies\": [{\"name\": \"a\", \"geometryFile\": \"missing.obj\", \"isDynamic\": true}]}",
        heads[0]);
    scratch_write("mesh.json", text);
    expect("check mesh.json", ERR_INPUT, NULL, "mesh.json: RigidBodies[0]");
    expect("run mesh.json -o mesh", ERR_INPUT, NULL, "missing.obj");
    assert_false(exists("mesh"));
    snprintf(text, sizeof text,
             "%s \"RigidBodies\": [{\"name\": \"a\", \"sphere\": 0.2}, {\"name\": \"a\", \"sphere\": 0.2,"
             " \"translation\": [3, 0, 0]}]}",
             heads[0]);
    scratch_write("twins.json", text);
    expect("check twins.json", ERR_INPUT, NULL, "twins.json: RigidBodies[1]");
}

static void a_scene_without_fluid_is_said_to_have_none(void **state) {
    (void)state;
    scratch_write("dry.json",
                  "{\"version\": 1, \"Tank\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1]}}");
    Result result = finish(start("check dry.json"));
    assert_non_null(strstr(result.err, "particles         0: the scene has no fluid\n"));
    drop(&result);
}

static void check_prints_a_scene_and_writes_nothing(void **state) {
    (void)state;
    assert_int_equal(mkdir("empty", 0755), 0);
    Result first = finish(start("check " SMALL));
    assert_int_equal(first.code, 0);
    assert_non_null(strstr(first.err, "particles         800\n"));
    assert_non_null(strstr(first.err, "crate: mass 4 kg, centre (0, 0.56, 0) m"));
    assert_non_null(strstr(first.out, "\"viscosity\": 0.02"));
    scratch_write("effective.json", first.out);
    Result second = finish(start("check effective.json"));
    assert_int_equal(second.code, 0);
    assert_string_equal(first.out, second.out);
    drop(&first);
    drop(&second);
    assert_int_equal(chdir("empty"), 0);
    Result third = finish(start("check " SMALL));
    assert_int_equal(third.code, 0);
    drop(&third);
    assert_int_equal(entry_count("."), 2); /* stdout.txt and stderr.txt */
    assert_int_equal(chdir(".."), 0);
}

static void the_schema_is_printed(void **state) {
    (void)state;
    Result result = finish(start("check --schema"));
    char *shipped = scratch_read(SKIFF_SOURCE_DIR "/assets/schema/scene.schema.json");
    assert_int_equal(result.code, 0);
    assert_string_equal(result.out, shipped);
    free(shipped);
    drop(&result);
}

/* ---- Runs ---- */

static void assert_same_file(const char *a, const char *b) {
    char *x = scratch_read(a), *y = scratch_read(b);
    if (strcmp(x, y) != 0)
        fail_msg("%s and %s differ", a, b);
    free(x);
    free(y);
}

/* Equal in all columns but the measured times. */
static void assert_same_steps(const char *a, const char *b) {
    CsvTable x, y;
    Err err = {0};
    if (!csv_read(a, &x, &err) || !csv_read(b, &y, &err))
        fail_msg("%s", err.message);
    assert_int_equal(x.column_count, y.column_count);
    assert_int_equal(x.row_count, y.row_count);
    assert_true(x.row_count > 0);
    for (int c = 0; c < x.column_count; c++) {
        assert_string_equal(x.names[c], y.names[c]);
        const char *ending = strrchr(x.names[c], '_');
        if (ending && strcmp(ending, "_ms") == 0)
            continue;
        for (size_t r = 0; r < x.row_count; r++) {
            size_t i = r * (size_t)x.column_count + (size_t)c;
            if (x.values[i] != y.values[i])
                fail_msg("%s and %s differ in row %zu, column %s", a, b, r + 1, x.names[c]);
        }
    }
    csv_free(&x);
    csv_free(&y);
}

static const char *in(const char *run, const char *name) {
    static char paths[4][PATH_SIZE];
    static int next;
    char *path = paths[next++ % 4];
    snprintf(path, PATH_SIZE, "%s/%s", run, name);
    return path;
}

static json_t *summary_of(const char *run) {
    json_t *summary = json_load_file(in(run, "summary.json"), 0, NULL);
    assert_non_null(summary);
    return summary;
}

static void assert_same_end(const char *a, const char *b) {
    json_t *x = summary_of(a), *y = summary_of(b);
    assert_string_equal(json_string_value(json_object_get(x, "state_hash")),
                        json_string_value(json_object_get(y, "state_hash")));
    assert_int_equal(json_integer_value(json_object_get(x, "steps")),
                     json_integer_value(json_object_get(y, "steps")));
    json_decref(x);
    json_decref(y);
    assert_same_steps(in(a, "steps.csv"), in(b, "steps.csv"));
    assert_same_file(in(a, "ledger.csv"), in(b, "ledger.csv"));
    assert_same_file(in(a, "hull.csv"), in(b, "hull.csv"));
    assert_same_file(in(a, "probes.csv"), in(b, "probes.csv"));
}

static void copy(const char *from, const char *to) {
    char *bytes;
    size_t size;
    Err err = {0};
    assert_true(file_read(from, 1 << 30, &bytes, &size, &err));
    assert_true(file_write(to, bytes, size, &err));
    free(bytes);
}

static void a_run_writes_its_results(void **state) {
    (void)state;
    static const char *const names[] = {"steps.csv",   "ledger.csv",   "hull.csv",
                                        "probes.csv",  "summary.json", "scene.json",
                                        "report.html", "state.skiff",  "trace.json"};
    expect("run " SMALL " -o done --duration 0.06", 0, NULL, "finished at t = 0.06 s, step 20");
    for (int i = 0; i < COUNT(names); i++)
        assert_true(exists(in("done", names[i])));
    assert_int_equal(entry_count("done"), COUNT(names)); /* no temporary files */
    json_t *summary = summary_of("done");
    assert_string_equal(json_string_value(json_object_get(summary, "status")), "finished");
    assert_int_equal(json_integer_value(json_object_get(summary, "particles")), 800);
    assert_non_null(json_object_get(json_object_get(json_object_get(summary, "ms"), "step"), "p99"));
    assert_non_null(json_object_get(json_object_get(summary, "machine"), "cpu"));
    json_decref(summary);
    char *report = scratch_read(in("done", "report.html"));
    assert_non_null(strstr(report, "A small tank for tests"));
    assert_non_null(strstr(report, "</html>"));
    assert_null(strstr(report, "http")); /* nothing from elsewhere */
    assert_null(strstr(report, "nan"));
    free(report);
    CsvTable steps;
    Err err = {0};
    assert_true(csv_read(in("done", "steps.csv"), &steps, &err));
    assert_int_equal(steps.row_count, 20);
    assert_int_equal(csv_column(&steps, "step"), 0);
    assert_true(csv_column(&steps, "step_ms") == steps.column_count - 1);
    csv_free(&steps);
    expect("profile done", 0, "slowest steps", NULL);
    expect("profile done --json", 0, "{\"steps\": 20, \"moves\": 0, \"mean_ms\": ", NULL);
    expect("profile nowhere", ERR_INPUT, NULL, "nowhere/steps.csv: ");
}

/* Names of files need not be UTF-8; JSON must be. */
static void any_name_of_a_scene_will_do(void **state) {
    (void)state;
    copy(SMALL, "caf\xe9.json");
    expect("run caf\xe9.json -o named -q --duration 0.003", 0, NULL, NULL);
    json_t *summary = summary_of("named");
    assert_string_equal(json_string_value(json_object_get(summary, "scene")), "caf?.json");
    json_decref(summary);
    assert_true(exists("named/report.html"));
    assert_int_equal(mkdir("d\xe9", 0700), 0);
    scratch_write("d\xe9/hull.obj", "");
    scratch_write("d\xe9/a.json",
                  "{\"version\": 1, \"RigidBodies\": [{\"name\": \"a\", \"geometryFile\": \"hull.obj\"}]}");
    expect("check d\xe9/a.json", ERR_INPUT, NULL,
           "RigidBodies[0].geometryFile: the name of its folder is not UTF-8 text");
}

static void an_existing_folder_is_refused(void **state) {
    (void)state;
    assert_int_equal(mkdir("kept", 0755), 0);
    scratch_write("kept/state.skiff", "old");
    scratch_write("kept/other.txt", "mine");
    expect("run " SMALL " -o kept --duration 0.01", ERR_USAGE, NULL,
           "kept: the folder exists; --resume goes on");
    assert_int_equal(entry_count("kept"), 2);
    expect("run " SMALL " -o kept --resume", ERR_INPUT, NULL, "kept/");
    expect("run " SMALL " -o kept --force --duration 0.01 --quiet", 0, NULL, NULL);
    assert_true(exists("kept/report.html") && exists("kept/other.txt"));
    scratch_write("file", "");
    expect("run " SMALL " -o file --force", ERR_USAGE, NULL, "file: exists and is not a folder");
    expect("run " SMALL " -o file/a", ERR_IO, NULL, "file: cannot write: Not a directory");
    expect("run " SMALL " -o file/below --duration 0.01", ERR_IO, NULL, "file");
}

static void probes_have_their_own_rate(void **state) {
    (void)state;
    CsvTable probes;
    Err err = {0};
    expect("run " SMALL " -o rate -q --duration 0.12 --set probeRate=100", 0, NULL, NULL);
    assert_true(csv_read("rate/probes.csv", &probes, &err));
    assert_int_equal(probes.row_count, 12);
    assert_string_equal(probes.names[0], "t");
    assert_string_equal(probes.names[1], "gauge");
    assert_string_equal(probes.names[probes.column_count - 1], "floor.tz");
    for (size_t r = 0; r < probes.row_count; r++) { /* the first step at or after each 10 ms */
        double late = probes.values[r * (size_t)probes.column_count] - 0.01 * (double)(r + 1);
        assert_true(late > -1e-6 && late < 0.003);
    }
    csv_free(&probes);
}

static void a_resumed_run_equals_a_whole_one(void **state) {
    (void)state;
    expect("run " SMALL " -o whole -q --duration 0.15 --threads 1", 0, NULL, NULL);
    expect("run " SMALL " -o parts -q --duration 0.06", 0, NULL, NULL);
    copy("parts/state.skiff", "early.skiff");
    expect("run " SMALL " -o parts -q --resume --duration 0.15", 0, NULL, NULL);
    assert_same_end("whole", "parts");
    /* killed after an old checkpoint: rows beyond it are cut off, a half-written one too */
    copy("early.skiff", "parts/state.skiff");
    FILE *steps = fopen("parts/steps.csv", "ab");
    assert_non_null(steps);
    fputs("51,0.15", steps);
    fclose(steps);
    expect("run " SMALL " -o parts -q --resume --duration 0.15", 0, NULL, NULL);
    assert_same_end("whole", "parts");
    /* resuming what is finished changes nothing */
    expect("run " SMALL " -o parts -q --resume --duration 0.15", 0, NULL, NULL);
    assert_same_end("whole", "parts");
}

static void a_resume_that_cannot_be_right_is_refused(void **state) {
    (void)state;
    expect("run " SMALL " -o odd -q --duration 0.03", 0, NULL, NULL);
    expect("run " SMALL " -o odd -q --resume --set viscosity=0.1", ERR_INPUT, NULL,
           "differs from odd/scene.json at Configuration.viscosity");
    expect("run " SMALL " -o odd -q --resume --set RigidBodies[0].density=1", ERR_INPUT, NULL,
           "at RigidBodies[0].density");
    copy("odd/steps.csv", "steps.csv");
    scratch_write("odd/steps.csv", "step,t\n1,0.003\n");
    expect("run " SMALL " -o odd -q --resume", ERR_INPUT, NULL, "odd/steps.csv: has other columns");
    char *text = scratch_read("steps.csv");
    strchr(strchr(strchr(text, '\n') + 1, '\n') + 1, '\n')[1] = '\0'; /* header and two steps */
    scratch_write("odd/steps.csv", text);
    free(text);
    expect("run " SMALL " -o odd -q --resume", ERR_INPUT, NULL,
           "odd/steps.csv: ends at step 2, before the checkpoint at step 10");
    copy("steps.csv", "odd/steps.csv");
    scratch_write("odd/state.skiff", "not a state");
    expect("run " SMALL " -o odd -q --resume", ERR_INPUT, NULL, "odd/state.skiff");
    unlink("odd/state.skiff");
    expect("run " SMALL " -o odd -q --resume", ERR_INPUT, NULL,
           "odd/state.skiff: there is no checkpoint to resume from");
}

static void wait_for_file(const char *path, pid_t child) {
    int status;
    while (!exists(path)) {
        assert_int_equal(waitpid(child, &status, WNOHANG), 0); /* it must not end by itself */
        nanosleep(&(struct timespec){.tv_nsec = 1000000}, NULL);
    }
}

static void signals_end_a_run_with_a_checkpoint(void **state) {
    (void)state;
    static const int numbers[] = {SIGINT, SIGTERM};
    static const char *const runs[] = {"sigint", "sigterm"};
    for (int i = 0; i < COUNT(numbers); i++) {
        char arguments[PATH_SIZE];
        unlink(in(runs[i], "state.skiff"));
        snprintf(arguments, sizeof arguments, "run " SMALL " -o %s --duration 100 --checkpoint-every 0",
                 runs[i]);
        pid_t child = start(arguments);
        wait_for_file(in(runs[i], "state.skiff"), child);
        assert_int_equal(kill(child, numbers[i]), 0);
        Result result = finish(child);
        assert_int_equal(result.code, ERR_INTERRUPTED);
        assert_non_null(strstr(result.err, "skiff run: interrupted; add --resume to go on from here\n"));
        drop(&result);
        json_t *summary = summary_of(runs[i]);
        assert_string_equal(json_string_value(json_object_get(summary, "status")), "interrupted");
        double time = json_number_value(json_object_get(summary, "time")) + 0.03;
        json_decref(summary);
        snprintf(arguments, sizeof arguments, "run " SMALL " -o %s -q --resume --duration %.9g", runs[i],
                 time);
        expect(arguments, 0, NULL, NULL);
        snprintf(arguments, sizeof arguments, "run " SMALL " -o whole-%s -q --duration %.9g", runs[i], time);
        expect(arguments, 0, NULL, NULL);
        snprintf(arguments, sizeof arguments, "whole-%s", runs[i]);
        assert_same_end(runs[i], arguments);
    }
}

static void a_blow_up_exits_with_5(void **state) {
    (void)state;
    expect("run " SMALL " -o wild -q --set speedLimit=0.5", ERR_DIVERGED, NULL,
           "the state is in wild/diverged.skiff");
    assert_true(exists("wild/diverged.skiff") && exists("wild/report.html"));
    json_t *summary = summary_of("wild");
    assert_string_equal(json_string_value(json_object_get(summary, "status")), "diverged");
    assert_true(strlen(json_string_value(json_object_get(summary, "message"))) > 0);
    json_decref(summary);
}

/* ---- Driving ---- */

/* A raft in a small tank; `drive` may be empty. */
static void write_raft(const char *path, const char *drive) {
    char text[2048];
    snprintf(
        text, sizeof text,
        "{\"version\": 1, \"input\": \"scene.input\", \"Configuration\": {\"duration\": 0.12},"
        " \"Tank\": {\"type\": \"box\", \"min\": [-0.4, 0, -0.3], \"max\": [0.4, 0.6, 0.3], \"open\": true},"
        " \"FluidBlocks\": [{\"start\": [-0.375, 0.025, -0.275], \"end\": [0.375, 0.175, 0.275]}],"
        " \"RigidBodies\": [{\"name\": \"raft\", \"box\": [0.3, 0.1, 0.2], \"density\": 500,"
        " \"translation\": [0, 0.2, 0], \"isDynamic\": true%s}]}",
        drive);
    scratch_write(path, text);
    scratch_write("scene.input", "0.03 throttle 0.5\n");
}

static const char raft_drive[] = ", \"drive\": {\"thrust\": 10, \"steeringTorque\": 0.5}";
static const char raft_input[] =
    "0 press w\n0.02 heading 20\n0.05 press d\n0.08 release d\n0.1 heading -10\n";

static void a_driven_run_replays_and_resumes(void **state) {
    (void)state;
    write_raft("raft.json", raft_drive);
    scratch_write("raft.input", raft_input);
    expect("run raft.json -o sailed -q --input raft.input --threads 1", 0, NULL, "");
    char *text = scratch_read("sailed/run.input");
    assert_non_null(strstr(text, " heading 20\n"));
    assert_non_null(strstr(text, " rudder 1\n")); /* d is bound to it */
    free(text);
    assert_same_file("sailed/script.input", "raft.input");
    /* what was driven, driven again */
    expect("run raft.json -o replayed -q --input sailed/run.input --threads 2", 0, NULL, "");
    assert_same_file("sailed/run.input", "replayed/run.input");
    /* 40 steps are 20 and 20: the folder knows its input */
    expect("run raft.json -o halves -q --input raft.input --duration 0.06", 0, NULL, "comes after the end");
    scratch_write("raft.input", "");
    expect("run raft.json -o halves -q --resume", 0, NULL, "");
    static const char *const others[] = {"replayed", "halves"};
    for (int i = 0; i < COUNT(others); i++) {
        json_t *x = summary_of("sailed"), *y = summary_of(others[i]);
        assert_string_equal(json_string_value(json_object_get(x, "state_hash")),
                            json_string_value(json_object_get(y, "state_hash")));
        json_decref(x);
        json_decref(y);
        assert_same_steps("sailed/steps.csv", in(others[i], "steps.csv"));
        assert_same_file("sailed/hull.csv", in(others[i], "hull.csv"));
    }
    assert_same_file("sailed/run.input", "halves/run.input");
    /* the scene's own input, and a raft without one, go elsewhere */
    expect("run raft.json -o own -q", 0, NULL, "");
    text = scratch_read("own/run.input");
    assert_non_null(strstr(text, " throttle 0.5\n"));
    free(text);
}

static void input_that_cannot_be_right_is_refused(void **state) {
    (void)state;
    char text[256];
    write_raft("raft.json", raft_drive);
    write_raft("drift.json", "");
    scratch_write("raft.input", raft_input);
    scratch_write("bad.input", "1 thottle 1\n0 rudder 3\n");
    expect("run raft.json -o never --input bad.input", ERR_INPUT, NULL,
           "bad.input:1: unknown command thottle, did you mean throttle?\n"
           "bad.input:2: 0 s is before the line above, which is at 1 s\n"
           "bad.input:2: rudder: expected");
    expect("run raft.json -o never --input none.input", ERR_INPUT, NULL, "none.input: ");
    assert_false(exists("never"));
    expect("run drift.json -o never --input raft.input", ERR_INPUT, NULL,
           "raft.input:1: no body of drift.json has a drive: RigidBodies[].drive is missing");
    /* before the scene becomes a simulation: this one cannot, its crate's mesh is missing */
    static const char crate[] = "}, {\"name\": \"crate\", \"geometryFile\": \"none.obj\"";
    write_raft("unfinished.json", crate);
    static const char *const commands[] = {"run unfinished.json -o never", "check unfinished.json",
                                           "bench unfinished.json"};
    for (int i = 0; i < COUNT(commands); i++)
        expect(commands[i], ERR_INPUT, NULL, "scene.input:1: no body of unfinished.json has a drive");
    assert_false(exists("never"));
    snprintf(text, sizeof text, "%s%s", raft_drive, crate);
    write_raft("unfinished.json", text);
    expect("check unfinished.json", ERR_INPUT, NULL, "none.obj");
    /* the past cannot change, the future can */
    expect("run raft.json -o past -q --input raft.input --duration 0.06", 0, NULL, "");
    scratch_write("other.input", "0 press w\n0.02 heading 21\n");
    expect("run raft.json -o past -q --resume --input other.input", ERR_INPUT, NULL,
           "other.input: differs from past/script.input near line 2, before the checkpoint");
    scratch_write("other.input", "0 press w\n0.02 heading 20\n0.05 press d\n0.07 throttle 0\n");
    expect("run raft.json -o past -q --resume --input other.input", 0, NULL, "");
    assert_same_file("past/script.input", "other.input");
    /* another scene is called that, and not one whose body lacks what the input drives */
    expect("run drift.json -o past -q --resume", ERR_INPUT, NULL,
           "drift.json: differs from past/scene.json at");
    scratch_write("lost.json", "{\"version\": 1, \"input\": \"lost.input\"}");
    expect("check lost.json", ERR_INPUT, NULL, "lost.json: input: there is no file ./lost.input\n");
}

/* ---- Benchmarks ---- */

static void bench_prints_one_line_of_json(void **state) {
    (void)state;
    static const char *const keys[] = {"scene",
                                       "particles",
                                       "boundary_samples",
                                       "threads",
                                       "isa",
                                       "ms_per_step",
                                       "ms_min",
                                       "ms_max",
                                       "search_ms",
                                       "iteration_ms",
                                       "density_iterations",
                                       "divergence_iterations",
                                       "density_error_percent",
                                       "density_max_percent",
                                       "neighbours",
                                       "peak_rss_mb",
                                       "particles_per_s",
                                       "real_time_factor",
                                       "state_hash"};
    Result result =
        finish(start("bench " SMALL " --settle 0.03 --steps 3 --windows 3 --json --quiet --no-results"));
    assert_int_equal(result.code, 0);
    assert_ptr_equal(strchr(result.out, '\n'), result.out + strlen(result.out) - 1);
    json_t *line = json_loads(result.out, 0, NULL);
    assert_non_null(line);
    for (int i = 0; i < COUNT(keys); i++)
        if (!json_object_get(line, keys[i]))
            fail_msg("bench --json has no %s", keys[i]);
    assert_int_equal(json_integer_value(json_object_get(line, "particles")), 800);
    double least = json_number_value(json_object_get(line, "ms_min"));
    double middle = json_number_value(json_object_get(line, "ms_per_step"));
    double most = json_number_value(json_object_get(line, "ms_max"));
    assert_true(0 < least && least <= middle && middle <= most);
    json_decref(line);
    drop(&result);
}

static void bench_keeps_rows(void **state) {
    (void)state;
    static const char arguments[] = "bench " SMALL " --settle 0 --steps 1 --windows 2 -q --results rows";
    expect(arguments, 0, "density solve", NULL);
    expect(arguments, 0, "real-time factor", NULL);
    char *text = scratch_read("rows/small.csv");
    int lines = 0;
    for (const char *c = text; *c; c++)
        lines += *c == '\n';
    assert_int_equal(lines, 3); /* a header and two rows */
    assert_ptr_equal(strstr(text, "date,commit,cpu,compiler,isa,threads,scene,"), text);
    free(text);
    scratch_write("rows/small.csv", "other,columns\n");
    expect(arguments, 0, "density solve", NULL);
    text = scratch_read("rows/small.csv");
    assert_string_equal(text, "other,columns\n");
    free(text);
    text = scratch_read("rows/small-2.csv");
    assert_ptr_equal(strstr(text, "date,commit,cpu,compiler,isa,threads,scene,"), text);
    free(text);
}

/* ---- Writing that fails ---- */

static void a_full_disk_is_noticed(void **state) {
    (void)state;
    CsvWriter writer;
    Err err = {0};
    assert_false(csv_create(&writer, "/dev/full", "a,b", &err));
    assert_int_equal(err.code, ERR_IO);
    assert_non_null(strstr(err.message, "/dev/full: writing failed: "));
    csv_close(&writer, NULL);
    assert_int_equal(system(SKIFF_PROGRAM " --help > /dev/full 2> full.txt") >> 8, ERR_IO);
    char *text = scratch_read("full.txt");
    assert_non_null(strstr(text, "writing to stdout failed"));
    free(text);
}

static void damaged_tables_are_refused(void **state) {
    (void)state;
    static const struct {
        const char *text, *message;
    } rows[] = {
        {"", "t.csv:1: the header is missing or cut off"},
        {"a,b", "t.csv:1: the header is missing or cut off"},
        {"a,b\n1,2\n1,x\n", "t.csv:3: column 2 is not a number"},
        {"a,b\n1\n", "t.csv:2: expected 2 numbers"},
        {"a,b\n1,2,3\n", "t.csv:2: expected 2 numbers"},
    };
    for (int i = 0; i < COUNT(rows); i++) {
        CsvTable table;
        Err err = {0};
        scratch_write("t.csv", rows[i].text);
        assert_false(csv_read("t.csv", &table, &err));
        assert_string_equal(err.message, rows[i].message);
    }
}

/* ---- Water at rest ---- */

static double figure_of(const char *arguments, const char *key) {
    Result result = finish(start(arguments));
    if (result.code != 0)
        fail_msg("skiff %s: exit code %d\n%s", arguments, result.code, result.err);
    assert_non_null(strchr(result.out, '\n'));
    assert_string_equal(strchr(result.out, '\n'), "\n"); /* one line */
    json_t *line = json_loads(result.out, 0, NULL);
    assert_true(json_is_number(json_object_get(line, key)));
    double value = json_number_value(json_object_get(line, key));
    json_decref(line);
    drop(&result);
    return value;
}

static void rest_tiles_are_made_and_shown(void **state) {
    (void)state;
    expect("rest show", 0, "periodic tile of 2171 points", NULL);
    assert_true(figure_of("rest make --edge 6 --seed 3 --threads 1 -o a.tile --json", "points") == 271);
    double spread = figure_of("rest show a.tile --json", "density_sd_percent");
    assert_true(spread > 0 && spread < 0.01);
    expect("rest make --edge 64 -o nowhere/a.tile", ERR_IO, NULL, /* before hours of work */
           "nowhere/a.tile: cannot write: No such file or directory");
    expect("rest show nowhere.tile", ERR_INPUT, NULL, "nowhere.tile: ");
    scratch_write("no.tile", "not a tile");
    expect("rest show no.tile", ERR_INPUT, NULL, "no.tile: not a Skiff state file");
}

static void blocks_are_cut_from_runs(void **state) {
    (void)state;
    expect("rest cut nowhere -o b.block", ERR_INPUT, NULL, "nowhere: there is no such folder");
    expect("run " SMALL " -o tank -q --duration 0.03", 0, NULL, NULL);
    expect("rest cut tank -o b.block", ERR_INPUT, NULL,
           "m in y (--min, --max; by default 0.2 m, two support radii, inside the outermost particles)");
    expect("rest cut tank --min -0.2,0.1,-0.2 --max 0.2,0.25,0.2 -o b.block", ERR_INPUT, NULL,
           "0.15 m long in y: it must be longer than two support radii, 0.2 m");
    assert_false(exists("b.block"));
    expect("rest cut tank --min -0.2,0.05,-0.2 --max 0.2,0.35,0.2 -o b.block", 0, "block of ", NULL);
    assert_float_equal(figure_of("rest show b.block --json", "size_y"), 12, 1e-5);
    expect("rest cut tank --min -0.2,0.3,-0.2 --max 0.2,0.1,0.2 -o c.block", ERR_INPUT, NULL,
           "tank: nothing to cut: the box reaches from 0.3 to 0.1 m in y");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(usage_mistakes_exit_with_2),
        cmocka_unit_test(help_explains_every_command),
        cmocka_unit_test(help_lines_are_short),
        cmocka_unit_test(bad_scenes_exit_with_3),
        cmocka_unit_test(the_engine_reports_with_file_and_path),
        cmocka_unit_test(a_scene_without_fluid_is_said_to_have_none),
        cmocka_unit_test(check_prints_a_scene_and_writes_nothing),
        cmocka_unit_test(the_schema_is_printed),
        cmocka_unit_test(a_run_writes_its_results),
        cmocka_unit_test(any_name_of_a_scene_will_do),
        cmocka_unit_test(an_existing_folder_is_refused),
        cmocka_unit_test(probes_have_their_own_rate),
        cmocka_unit_test(a_resumed_run_equals_a_whole_one),
        cmocka_unit_test(a_resume_that_cannot_be_right_is_refused),
        cmocka_unit_test(signals_end_a_run_with_a_checkpoint),
        cmocka_unit_test(a_blow_up_exits_with_5),
        cmocka_unit_test(a_driven_run_replays_and_resumes),
        cmocka_unit_test(input_that_cannot_be_right_is_refused),
        cmocka_unit_test(bench_prints_one_line_of_json),
        cmocka_unit_test(bench_keeps_rows),
        cmocka_unit_test(a_full_disk_is_noticed),
        cmocka_unit_test(damaged_tables_are_refused),
        cmocka_unit_test(rest_tiles_are_made_and_shown),
        cmocka_unit_test(blocks_are_cut_from_runs),
    };
    return cmocka_run_group_tests_name("cli", tests, scratch_enter, scratch_leave);
}
