# Sourced by app/demo.sh, tests/run.sh and .ci/run after they set `root` to the checkout: packages, configuration, ctest.
# shellcheck shell=sh disable=SC2154
# The build folder is $BUILD_DIR, or build/ in the checkout.

setup_have() {
    command -v "$1" >/dev/null 2>&1
}

setup_die() {
    echo "$0: $*" >&2
    exit 1
}

# setup_command PACKAGE COMMAND...: PACKAGE is missing unless one of the commands exists
setup_command() {
    package=$1
    shift
    for name in "$@"; do
        if setup_have "$name"; then return; fi
    done
    missing="$missing $package"
}

# setup_package PACKAGE...: where there is no dpkg the headers are left to CMake, which names what it does not find
setup_package() {
    setup_have dpkg-query || return 0
    for package in "$@"; do
        [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing="$missing $package"
    done
}

# setup_packages build|demo|test|ci: installs the Debian packages that are missing; calls apt-get only when some are
setup_packages() {
    missing=
    setup_command gcc "${CC:-cc}" gcc clang
    setup_command cmake cmake
    setup_command ninja-build ninja make
    setup_package libc6-dev libjansson-dev libcglm-dev libxxhash-dev libpng-dev libegl-dev libgl-dev \
        libegl1 libegl-mesa0 libgl1-mesa-dri libosmesa6 libstb-dev fonts-dejavu-core
    case $1 in
    demo) setup_command ffmpeg ffmpeg ;;
    test | ci)
        setup_package libcmocka-dev
        setup_command ffmpeg ffmpeg
        ;;
    esac
    case $1 in
    ci)
        setup_command clang clang
        setup_command clang-format clang-format
        setup_package libomp-dev
        ;;
    esac
    [ -n "$missing" ] || return 0
    if ! setup_have apt-get; then
        setup_die "missing (names of the Debian packages):$missing"
    fi
    if [ "$(id -u)" != 0 ]; then
        setup_die "packages are missing; as root, run: apt-get update && apt-get install --no-install-recommends$missing"
    fi
    echo "Installing:$missing"
    apt-get update || echo "apt-get update failed; trying with the package lists that are there" >&2
    # shellcheck disable=SC2086 # a list
    DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends $missing ||
        setup_die "could not install:$missing"
}

# setup_build_dir: prints the absolute path of the build folder
setup_build_dir() {
    case ${BUILD_DIR:-} in
    '') echo "$root/build" ;;
    /*) echo "$BUILD_DIR" ;;
    *) echo "$(pwd)/$BUILD_DIR" ;;
    esac
}

# setup_configure DIR CMAKE_ARGUMENT...
setup_configure() {
    dir=$1
    shift
    # A folder copied along with a checkout still points to the old place.
    if [ -f "$dir/CMakeCache.txt" ] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$root" "$dir/CMakeCache.txt"; then
        rm -rf "$dir/CMakeCache.txt" "$dir/CMakeFiles"
    fi
    if [ ! -f "$dir/CMakeCache.txt" ] && setup_have ninja; then
        set -- -G Ninja "$@"
    fi
    cmake -S "$root" -B "$dir" "$@"
}

# setup_compile DIR CMAKE_ARGUMENT...
setup_compile() {
    dir=$1
    shift
    cmake --build "$dir" --parallel "${CMAKE_BUILD_PARALLEL_LEVEL:-$(nproc)}" "$@"
}

# setup_ctest DIR LABELS: runs the tests, sets `passed` and `failed` from ctest's own count, fails unless some ran and all passed
setup_ctest() {
    status=$1/ctest.status
    rm -f "$status"
    {
        result=0
        LC_ALL=C ctest --test-dir "$1" --output-on-failure -L "$2" -j2 || result=$?
        echo "$result" >"$status"
    } | tee "$1/ctest.log"
    result=$(cat "$status")
    # "83% tests passed, 1 tests failed out of 6"
    counts=$(sed -n 's/^[0-9]*% tests passed, \([0-9]*\) tests* failed out of \([0-9]*\).*/\1 \2/p' "$1/ctest.log" | tail -n 1)
    failed=${counts% *}
    passed=$((${counts#* } - ${failed:-0}))
    failed=${failed:-0}
    [ "$result" = 0 ] && [ "$passed" -gt 0 ] && [ "$failed" = 0 ]
}
