#!/bin/sh
# Builds everything with sanitizers, assertions on, and runs the tests under them, but for those that build
# against the installed library or need a server.
#
#   tests/hard/sanitize.sh address,undefined|thread [ctest options]     in build_address, build_thread
#
# ThreadSanitizer has to see how TBB's threads wait for each other, or it takes most of what they share for races.
# VDB_DIFFUSE_TSAN_TBB names the folder where such a oneTBB is installed, of the version that the other libraries
# are linked to:
#   cmake -S oneTBB -B b -DTBB_SANITIZE=thread -DTBB_TEST=OFF -DTBB_STRICT=OFF -DCMAKE_INSTALL_PREFIX=FOLDER
#   cmake --build b --target install
# tests/hard/tsan_suppressions.txt has what it reports of other libraries, and why that is no fault of ours.
set -eu
[ $# -ge 1 ] || { sed -n '2,/^set/s/^# \{0,1\}//p' "$0"; exit 2; }
root=$(cd "$(dirname "$0")/../.." && pwd)
sanitizers=$1
shift
build=$root/build_${sanitizers%%,*}
set -- -E '^(install|farm)$' "$@"
if [ "$sanitizers" = thread ]; then
  export LD_LIBRARY_PATH="${VDB_DIFFUSE_TSAN_TBB:?names no folder with a TBB for ThreadSanitizer}/lib"
  export TSAN_OPTIONS="history_size=4 suppressions=$root/tests/hard/tsan_suppressions.txt ${TSAN_OPTIONS:-}"
  tbb=$VDB_DIFFUSE_TSAN_TBB/lib/cmake/TBB
fi
export UBSAN_OPTIONS="print_stacktrace=1 ${UBSAN_OPTIONS:-}"
cmake -S "$root" -B "$build" -G Ninja -DVDB_DIFFUSE_SANITIZE="$sanitizers" -DCMAKE_BUILD_TYPE=None \
  -DCMAKE_CXX_FLAGS=-O1 ${tbb:+-DTBB_DIR="$tbb"}
cmake --build "$build"
cd "$build"
exec ctest --output-on-failure -j "$(nproc)" --timeout 3000 "$@"
