#!/bin/sh
# The engine in other programs: the example of README.md, built with what `cmake --install` leaves, by CMake, by pkg-config
# (where there is one) and as C++ (where there is a compiler), and as a part of another project.
# test_embed.sh SOURCE BUILD C_COMPILER
set -eu
source=$1 build=$2 cc=$3
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

fail() {
    echo "test_embed: $*" >&2
    exit 1
}

# run PROGRAM: the crate must have come to float where half of it is under water
run() {
    "$1" >"$work/said" || fail "$1 failed"
    cat "$work/said"
    awk '{ y = $(NF - 1); good = /^[0-9]+ particles, the crate at / && y > -0.03 && y < 0.03 } END { exit !(NR == 1 && good) }' \
        "$work/said" || fail "the crate does not float where it should"
}

# consumer NAME LINE: a project whose CMakeLists.txt gets the target skiff::skiff by this line
consumer() {
    mkdir -p "$work/$1"
    cat >"$work/$1/CMakeLists.txt" <<EOF
cmake_minimum_required(VERSION 3.20)
project(consumer LANGUAGES C)
$2
add_executable(crate $work/crate.c)
target_link_libraries(crate PRIVATE skiff::skiff)
EOF
    if ! { cmake -S "$work/$1" -B "$work/$1/build" -DCMAKE_C_COMPILER="$cc" -DCMAKE_PREFIX_PATH="$work/prefix" &&
        cmake --build "$work/$1/build" --target crate --parallel 2; } >"$work/log"; then
        cat "$work/log"
        fail "$1 does not build"
    fi
}

awk '/^    #include <skiff.h>/ { on = 1 } on && /^[^ ]/ { exit } on { print substr($0, 5) }' "$source/README.md" >"$work/crate.c"
grep -q skiff_create "$work/crate.c" || fail "README.md has no example"

cmake --install "$build" --prefix "$work/prefix" >"$work/log" || fail "cmake --install failed"
"$work/prefix/bin/skiff" check "$work/prefix/share/skiff/scenes/boat.json" >"$work/log" || fail "the installed program does not run the installed scenes"
others=$(nm -g --defined-only "$work"/prefix/lib*/libskiff.a "$work"/prefix/lib/*/libskiff.a 2>/dev/null |
    awk 'NF == 3 && $3 !~ /^(skiff|err)_/ { print $3 }')
[ -z "$others" ] || fail "the archive shows more than its headers declare:" "$others"

echo "find_package:"
consumer package "find_package(skiff 0.1 REQUIRED)"
run "$work/package/build/crate"

if command -v pkg-config >/dev/null; then
    echo "pkg-config:"
    PKG_CONFIG_PATH=$(dirname "$(find "$work/prefix" -name skiff.pc)")
    export PKG_CONFIG_PATH
    # shellcheck disable=SC2046 # a list of flags
    "$cc" -o "$work/crate" "$work/crate.c" $(pkg-config --cflags --libs skiff) || fail "pkg-config's flags are wrong"
    run "$work/crate"
fi

if command -v c++ >/dev/null; then
    echo "C++: a wrong time step must be refused by name"
    cat >"$work/wrong.cpp" <<'EOF'
#include <skiff.h>
#include <cstdio>
int main() {
    SkiffDef def = skiff_def_default();
    Err err = {};
    def.params.time_step = -1;
    SkiffSim *sim = skiff_create(&def, &err);
    std::puts(err.message);
    return sim == nullptr && err.code == ERR_INPUT ? 0 : 1;
}
EOF
    c++ -std=c++17 -Wall -Wextra -Werror -I"$work/prefix/include/skiff" -o "$work/wrong" "$work/wrong.cpp" \
        -L"$(dirname "$(find "$work/prefix" -name libskiff.a)")" -lskiff -fopenmp -lm || fail "not a C++ header"
    "$work/wrong" | grep timeStepSize || fail "the engine does not work from C++"
fi

echo "add_subdirectory:"
consumer part "add_subdirectory($source skiff)"
[ ! -e "$work/part/build/skiff/skiff" ] || fail "the program was built, too"
run "$work/part/build/crate"
