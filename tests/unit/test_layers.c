/* The rule of inclusion of the tree, and the length of its files. The rules are data at the top of this file;
 * the last tests plant violations in a made-up tree, so that the checker itself is known to see them. */
#include "base/err.h"
#include "base/file.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <cmocka.h>
#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MAX_LINES = 800, MAX_FILES = 2000, PATH_SIZE = 512 };

/* Headers of C and of the system, open to all. */
static const char libc_headers[] =
    " assert.h complex.h ctype.h dirent.h dlfcn.h errno.h fcntl.h fenv.h "
    "float.h getopt.h glob.h inttypes.h iso646.h libgen.h"
    " limits.h locale.h malloc.h math.h poll.h pthread.h pwd.h sched.h "
    "semaphore.h setjmp.h signal.h spawn.h stdalign.h stdarg.h"
    " stdatomic.h stdbool.h stddef.h stdint.h stdio.h stdlib.h stdnoreturn.h "
    "string.h strings.h tgmath.h time.h unistd.h wchar.h"
    " sys/mman.h sys/resource.h sys/socket.h sys/stat.h sys/statvfs.h sys/sysinfo.h "
    "sys/time.h sys/types.h sys/uio.h sys/utsname.h sys/wait.h ";

/* What the files of a folder may include: folders or single files of the tree, and other system headers (a
 * final '/' stands for all below). The first row whose path begins a file's path counts. tests/ has no row:
 * tests may include anything. */
static const struct Layer {
    const char *folder, *tree, *system;
} layers[] = {
    /* SIMD is confined to these two. */
    {"engine/base/simd.h", " engine/base/ ", " immintrin.h arm_neon.h "},
    {"engine/passes.c", " engine/ ", " cglm/ xxhash.h omp.h immintrin.h arm_neon.h "},
    {"engine/base/", " engine/base/ ", " xxhash.h sanitizer/asan_interface.h "},
    {"engine/", " engine/ ", " cglm/ xxhash.h omp.h "},
    {"render/", " render/ engine/base/ generated/ ", " cglm/ omp.h GL/ EGL/ KHR/ png.h stb/ "},
    {"app/", " app/ engine/skiff.h engine/base/ render/gfx.h generated/ ", " cglm/ jansson.h omp.h "},
};

/* Made at build time, found in the build folder. */
static const char generated_headers[] = " version.h ";

typedef struct Tree {
    const char *root;
    char files[MAX_FILES][PATH_SIZE]; /* relative to root */
    int count;
} Tree;

/* Is `path` in a list of the tables above? */
static bool in_list(const char *list, const char *path) {
    size_t length = strlen(path);
    for (const char *item = list + strspn(list, " "); *item; item += strspn(item, " ")) {
        size_t n = strcspn(item, " ");
        if (n <= length && strncmp(item, path, n) == 0 && (n == length || item[n - 1] == '/'))
            return true;
        item += n;
    }
    return false;
}

static bool has_suffix(const char *path, const char *suffixes) {
    const char *dot = strrchr(path, '.');
    char wanted[32];
    if (!dot || strlen(dot) > 20 || strchr(dot, '/'))
        return false;
    snprintf(wanted, sizeof wanted, " %s ", dot);
    return strstr(suffixes, wanted) != NULL;
}

/* ---- The list of files ---- */

static void add_file(Tree *tree, const char *path) {
    if (!has_suffix(path, " .c .h .inl .sh .glsl .vert .frag "))
        return;
    if (tree->count == MAX_FILES || strlen(path) >= PATH_SIZE)
        fail_msg("too many files, or too long a name: %s", path);
    strcpy(tree->files[tree->count++], path);
}

static void add_folder(Tree *tree, const char *folder) {
    char path[2 * PATH_SIZE];
    snprintf(path, sizeof path, "%s/%s", tree->root, folder);
    DIR *dir = opendir(path);
    if (!dir)
        return;
    for (struct dirent *entry = readdir(dir); entry; entry = readdir(dir)) {
        if (entry->d_name[0] == '.')
            continue;
        char name[2 * PATH_SIZE];
        struct stat status;
        snprintf(name, sizeof name, "%s/%s", folder, entry->d_name);
        snprintf(path, sizeof path, "%s/%.*s", tree->root, PATH_SIZE, name);
        if (stat(path, &status) == 0 && S_ISDIR(status.st_mode))
            add_folder(tree, name);
        else
            add_file(tree, name);
    }
    closedir(dir);
}

/* The files git knows; where there is no git, all that lie in the folders of the tree. */
static void list_files(Tree *tree) {
    char command[2 * PATH_SIZE], line[PATH_SIZE];
    tree->count = 0;
    snprintf(command, sizeof command, "git -C '%s' ls-files 2>/dev/null", tree->root);
    snprintf(line, sizeof line, "%s/.git", tree->root);
    FILE *stream = file_exists(line) ? popen(command, "r") : NULL;
    while (stream && fgets(line, sizeof line, stream)) {
        char path[2 * PATH_SIZE];
        line[strcspn(line, "\n")] = '\0';
        snprintf(path, sizeof path, "%s/%s", tree->root, line);
        if (file_exists(path)) /* deleted, not yet committed */
            add_file(tree, line);
    }
    if (stream)
        pclose(stream);
    static const char *const folders[] = {"app", "engine", "render", "shaders", "tests"};
    bool by_folder = tree->count == 0;
    for (size_t i = 0; by_folder && i < sizeof folders / sizeof folders[0]; i++)
        add_folder(tree, folders[i]);
}

/* ---- Includes ---- */

/* Name between quotes or angle brackets of an #include line. */
static bool parse_include(const char *line, char name[PATH_SIZE], bool *quoted) {
    line += strspn(line, " \t");
    if (*line++ != '#')
        return false;
    line += strspn(line, " \t");
    if (strncmp(line, "include", 7) != 0)
        return false;
    line += 7;
    line += strspn(line, " \t");
    if (*line != '"' && *line != '<')
        return false;
    *quoted = *line == '"';
    size_t n = strcspn(++line, "\">\n");
    if (n >= PATH_SIZE)
        return false;
    memcpy(name, line, n);
    name[n] = '\0';
    return true;
}

/* "a/b/../c" -> "a/c", in place. */
static void normalise(char *path) {
    char *up;
    while ((up = strstr(path, "/../"))) {
        char *start = up;
        while (start > path && start[-1] != '/')
            start--;
        memmove(start, up + 4, strlen(up + 4) + 1);
    }
}

/* Path in the tree of the file that an include in `from` reaches: beside it, under engine/, under the root.
 */
static bool resolve(const Tree *tree, const char *from, const char *name, char path[PATH_SIZE]) {
    char own[PATH_SIZE], full[2 * PATH_SIZE];
    snprintf(own, sizeof own, "%s", from);
    char *slash = strrchr(own, '/');
    slash[slash ? 1 : 0] = '\0';
    const char *const places[] = {own, "engine/", ""};
    for (size_t i = 0; i < sizeof places / sizeof places[0]; i++) {
        int n = snprintf(path, PATH_SIZE, "%s%s", places[i], name);
        if (n >= PATH_SIZE)
            continue;
        normalise(path);
        snprintf(full, sizeof full, "%s/%s", tree->root, path);
        if (file_exists(full))
            return true;
    }
    return false;
}

static const struct Layer *layer_of(const char *path) {
    for (size_t i = 0; i < sizeof layers / sizeof layers[0]; i++)
        if (strncmp(path, layers[i].folder, strlen(layers[i].folder)) == 0)
            return &layers[i];
    return NULL;
}

static FILE *open_source(const Tree *tree, const char *path) {
    char full[2 * PATH_SIZE];
    snprintf(full, sizeof full, "%s/%s", tree->root, path);
    FILE *stream = fopen(full, "r");
    if (!stream)
        fail_msg("cannot read %s", full);
    return stream;
}

static void check_include(const Tree *tree, const char *from, int line, const char *name, bool quoted,
                          Err *err) {
    const struct Layer *layer = layer_of(from);
    char path[PATH_SIZE];
    if (resolve(tree, from, name, path)) {
        if (!in_list(layer->tree, path))
            err_add(err, ERR_INPUT, "%s:%d: may not include %s", from, line, path);
    } else if (quoted && in_list(generated_headers, name)) {
        if (!in_list(layer->tree, "generated/"))
            err_add(err, ERR_INPUT, "%s:%d: may not include the generated %s", from, line, name);
    } else if (quoted || (!in_list(libc_headers, name) && !in_list(layer->system, name))) {
        err_add(err, ERR_INPUT, "%s:%d: may not include %s", from, line, name);
    }
}

/* Does `path`, directly or through headers of the tree, reach a file below `folder`? `depth` bounds cycles.
 */
static bool reaches(const Tree *tree, const char *path, const char *folder, int depth) {
    char line[4096], name[PATH_SIZE], next[PATH_SIZE];
    bool quoted, found = false;
    FILE *stream = open_source(tree, path);
    while (!found && depth > 0 && fgets(line, sizeof line, stream))
        if (parse_include(line, name, &quoted) && resolve(tree, path, name, next))
            found = strncmp(next, folder, strlen(folder)) == 0 ||
                    (strncmp(next, "app/", 4) == 0 && reaches(tree, next, folder, depth - 1));
    fclose(stream);
    return found;
}

/* One line of message for each violation. */
static void check_layers(const Tree *tree, Err *err) {
    for (int i = 0; i < tree->count; i++) {
        const char *path = tree->files[i];
        if (!layer_of(path) || !has_suffix(path, " .c .h .inl "))
            continue;
        char line[4096], name[PATH_SIZE];
        bool quoted;
        FILE *stream = open_source(tree, path);
        for (int number = 1; fgets(line, sizeof line, stream); number++)
            if (parse_include(line, name, &quoted))
                check_include(tree, path, number, name, quoted, err);
        fclose(stream);
        if (strncmp(path, "app/", 4) == 0 && strncmp(path, "app/view", 8) != 0 &&
            reaches(tree, path, "engine/skiff.h", 8) && reaches(tree, path, "render/", 8))
            err_add(err, ERR_INPUT, "%s: knows both engine and renderer; only app/view*.c may", path);
    }
}

static void check_lengths(const Tree *tree, Err *err) {
    for (int i = 0; i < tree->count; i++) {
        FILE *stream = open_source(tree, tree->files[i]);
        int lines = 0;
        for (int c = getc(stream); c != EOF; c = getc(stream))
            lines += c == '\n';
        fclose(stream);
        if (lines > MAX_LINES)
            err_add(err, ERR_INPUT, "%s: %d lines, at most %d", tree->files[i], lines, MAX_LINES);
    }
}

/* ---- The tests ---- */

static Tree tree;

static void sources_keep_to_their_layer(void **state) {
    (void)state;
    Err err = {0};
    tree.root = SKIFF_SOURCE_DIR;
    list_files(&tree);
    assert_true(tree.count > 10);
    check_layers(&tree, &err);
    if (err.code)
        fail_msg("%s", err.message);
}

static void sources_are_short(void **state) {
    (void)state;
    Err err = {0};
    tree.root = SKIFF_SOURCE_DIR;
    list_files(&tree);
    check_lengths(&tree, &err);
    if (err.code)
        fail_msg("%s", err.message);
}

static void plant(const char *root, const char *path, const char *text) {
    char full[2 * PATH_SIZE];
    snprintf(full, sizeof full, "%s/%s", root, path);
    *strrchr(full, '/') = '\0';
    assert_true(file_make_directory(full, NULL));
    snprintf(full, sizeof full, "%s/%s", root, path);
    assert_true(file_write(full, text, strlen(text), NULL));
}

static void planted_violations_are_found(void **state) {
    (void)state;
    static const struct {
        const char *path, *text, *expected; /* expected: NULL where it is allowed */
    } cases[] = {
        {"engine/skiff.h", "#include \"base/err.h\"\n#include <stdint.h>\n", NULL},
        {"engine/base/err.h", "#include <stdbool.h>\n", NULL},
        {"engine/base/hash.c", "#include <xxhash.h>\n#include \"err.h\"\n#include <sys/mman.h>\n", NULL},
        {"engine/grid.c", "#include <cglm/vec3.h>\n#include \"skiff.h\"\n#include <omp.h>\n", NULL},
        {"engine/passes.c", "#include <immintrin.h>\n", NULL},
        {"render/gfx.h", "#include \"../engine/base/err.h\"\n#include \"engine/base/err.h\"\n", NULL},
        {"render/gl.c", "#include <GL/gl.h>\n#include \"gfx.h\"\n#include <png.h>\n", NULL},
        {"app/view.h", "#include \"engine/skiff.h\"\n", NULL},
        {"app/view.c", "#include \"view.h\"\n#include \"render/gfx.h\"\n", NULL},
        {"app/view_mesh.c", "#include \"view.h\"\n#include \"render/gfx.h\"\n", NULL},
        {"app/main.c", "#include \"view.h\"\n#include <jansson.h>\n#include \"version.h\"\n", NULL},
        {"app/film.h", "#include \"render/gfx.h\"\n", NULL},
        {"tests/unit/test_a.c", "#include \"engine/grid.h\"\n#include <GL/gl.h>\n", NULL},
        {"engine/grid.h", "\n#include \"render/gfx.h\"\n", "engine/grid.h:2: may not include render/gfx.h"},
        {"engine/sim.c", "# include <GL/gl.h>\n", "engine/sim.c:1: may not include GL/gl.h"},
        {"engine/row.c", "#include <immintrin.h>\n", "engine/row.c:1: may not include immintrin.h"},
        {"engine/io.c", "#include <jansson.h>\n", "engine/io.c:1: may not include jansson.h"},
        {"engine/v.c", "#include \"version.h\"\n", "engine/v.c:1: may not include the generated version.h"},
        {"engine/t.c", "#include \"../tests/unit/test_a.c\"\n",
         "engine/t.c:1: may not include tests/unit/test_a.c"},
        {"engine/n.c", "#include \"nothing.h\"\n", "engine/n.c:1: may not include nothing.h"},
        {"engine/base/up.c", "#include \"../skiff.h\"\n",
         "engine/base/up.c:1: may not include engine/skiff.h"},
        {"engine/base/omp.c", "#include <omp.h>\n", "engine/base/omp.c:1: may not include omp.h"},
        {"render/sim.c", "#include \"engine/skiff.h\"\n", "render/sim.c:1: may not include engine/skiff.h"},
        {"render/app.c", "#include \"../app/view.h\"\n", "render/app.c:1: may not include app/view.h"},
        {"app/deep.c", "#include \"engine/grid.h\"\n", "app/deep.c:1: may not include engine/grid.h"},
        {"app/gl.c", "#include \"render/gl.c\"\n", "app/gl.c:1: may not include render/gl.c"},
        {"app/both.c", "#include \"film.h\"\n#include \"skiff.h\"\n",
         "app/both.c: knows both engine and renderer"},
    };
    enum { COUNT = sizeof cases / sizeof cases[0] };
    char root[] = "/tmp/skiff-test-layers-XXXXXX", command[128];
    assert_non_null(mkdtemp(root));
    int expected = 0, lines = 1;
    for (int i = 0; i < COUNT; i++)
        plant(root, cases[i].path, cases[i].text);
    static char text[4000];
    memset(text, '\n', MAX_LINES);
    plant(root, "engine/full.c", text);
    text[MAX_LINES] = '\n';
    plant(root, "shaders/long.frag", text);

    Err err = {0}, length_err = {0};
    tree.root = root;
    list_files(&tree);
    check_layers(&tree, &err);
    check_lengths(&tree, &length_err);
    snprintf(command, sizeof command, "rm -rf '%s'", root);
    assert_int_equal(system(command), 0);

    assert_int_equal(tree.count, COUNT + 2);
    for (int i = 0; i < COUNT; i++) {
        expected += cases[i].expected != NULL;
        if (cases[i].expected && !strstr(err.message, cases[i].expected))
            fail_msg("expected '%s' in:\n%s", cases[i].expected, err.message);
    }
    for (const char *c = err.message; *c; c++)
        lines += *c == '\n';
    if (lines != expected)
        fail_msg("expected %d violations, found:\n%s", expected, err.message);
    assert_string_equal(length_err.message, "shaders/long.frag: 801 lines, at most 800");
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(planted_violations_are_found),
        cmocka_unit_test(sources_keep_to_their_layer),
        cmocka_unit_test(sources_are_short),
    };
    return cmocka_run_group_tests_name("layers", tests, NULL, NULL);
}
