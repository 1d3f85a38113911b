#!/bin/sh
# Installs what is missing (as root, on Debian), builds Skiff and runs its main job. Works from any folder.
# BUILD_DIR: another build folder than build/.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
. "$root/app/setup.sh"

setup_packages demo
build=$(setup_build_dir)
# A first build leaves the tests out, and their packages with them; a folder that has them keeps them.
if [ -f "$build/CMakeCache.txt" ]; then
    setup_configure "$build" -DCMAKE_BUILD_TYPE=Release
else
    setup_configure "$build" -DCMAKE_BUILD_TYPE=Release -DSKIFF_TESTS=OFF
fi
setup_compile "$build" --target skiff_app

cd "$root"
# A thread that waits sleeps: where other programs share the cores, spinning costs several times the run.
export OMP_WAIT_POLICY="${OMP_WAIT_POLICY:-passive}"
"$build/skiff" run assets/scenes/boat.json -o out/demo --force --video
echo "The film is $root/out/demo/video.mp4, its frames are in $root/out/demo/frames, the report is $root/out/demo/report.html"
