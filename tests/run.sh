#!/bin/sh
# Installs what is missing, builds everything and runs the tests.
#
#   sh tests/run.sh [ctest options]
#
# VDB_DIFFUSE_SAMPLES names a folder of real volumes; tests that need it are skipped without.
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
more_packages=""
. "$root/vdb_diffuse/packages.sh"

build=${VDB_DIFFUSE_BUILD:-$root/build}
cmake -S "$root" -B "$build" -G Ninja -DVDB_DIFFUSE_TESTS=ON > "$build.log" 2>&1 || { cat "$build.log"; exit 1; }
rm -f "$build.log"
cmake --build "$build"
[ -n "${VDB_DIFFUSE_SAMPLES:-}" ] || echo "VDB_DIFFUSE_SAMPLES is not set: tests on real volumes are skipped"
cd "$build"
ctest --output-on-failure -j "$(nproc)" "$@"
