#!/bin/sh
# Installs what is missing (as root, on Debian), builds Skiff and runs the unit and golden tests. Works from any folder.
# BUILD_DIR: another build folder than build/. CI=true: warnings are errors.
# The last line is "N passed, N failed"; the exit code is 0 only when some tests ran and all passed.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
. "$root/app/setup.sh"

setup_packages test
build=$(setup_build_dir)
werror=OFF
if [ "${CI:-}" = true ]; then werror=ON; fi

passed=0 failed=0
if ! { setup_configure "$build" -DCMAKE_BUILD_TYPE=Release -DSKIFF_TESTS=ON -DSKIFF_WERROR="$werror" &&
    setup_compile "$build"; }; then
    echo "The build failed: no test was run"
    echo "0 passed, 0 failed"
    exit 1
fi
code=0
setup_ctest "$build" 'unit|golden' || code=1
if [ $((passed + failed)) = 0 ]; then echo "No test was run"; fi
echo "$passed passed, $failed failed"
exit "$code"
