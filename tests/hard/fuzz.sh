#!/bin/sh
# Builds the fuzzers of the file readers with clang and runs them at the lowest priority, as many at a time as
# VDB_DIFFUSE_FUZZ_JOBS says (2).
#
#   tests/hard/fuzz.sh FOLDER [SECONDS [KIND...]]       1200 s each of vdb, json, obj, gltf, glb, exr
#
# FOLDER/KIND is the corpus, begun with sound files of our own making and kept for the next time; FOLDER/KIND.found
# has what crashed, hung (25 s) or took more than 2 GB, FOLDER/KIND.log the fuzzer's own words. To repeat a find:
#   build_fuzz/tests/hard/fuzz_KIND FOLDER/KIND.found/crash-...
# Status 1 where there is any.
#
# The libraries' own branches guide the fuzzer only where they are built with clang and
# -fsanitize=fuzzer-no-link,address as well; VDB_DIFFUSE_FUZZ_PREFIX names a folder where such an assimp (with the
# OBJ and glTF importers alone) and OpenEXR are installed. Leaks are not looked for: OpenVDB drops the nodes it
# has made where a value does not unpack, and the program ends where a file is refused.
set -eu
[ $# -ge 1 ] || { sed -n '2,/^set/s/^# \{0,1\}//p' "$0"; exit 2; }
root=$(cd "$(dirname "$0")/../.." && pwd)
mkdir -p "$1"
folder=$(cd "$1" && pwd)
seconds=${2:-1200}
shift; [ $# -eq 0 ] || shift
kinds=${*:-vdb json obj gltf glb exr}

build=${VDB_DIFFUSE_BUILD:-$root/build}
cmake -S "$root" -B "$build" -G Ninja > "$folder/build.log"
nice cmake --build "$build" --target fuzz_seeds >> "$folder/build.log"
targets=$(for kind in $kinds; do echo "fuzz_$kind"; done)
CC=clang CXX=clang++ cmake -S "$root" -B "$root/build_fuzz" -G Ninja -DVDB_DIFFUSE_FUZZ=ON -DCMAKE_BUILD_TYPE=None \
  -DCMAKE_CXX_FLAGS=-O1 -DCMAKE_PREFIX_PATH="${VDB_DIFFUSE_FUZZ_PREFIX:-}" >> "$folder/build.log"
nice cmake --build "$root/build_fuzz" -j "$(nproc)" --target $targets >> "$folder/build.log"

"$build/tests/hard/fuzz_seeds" "$folder/seeds"
export ASAN_OPTIONS=detect_leaks=0

fuzz() {
  mkdir -p "$folder/$1" "$folder/$1.found" "$folder/$1.tmp"
  words=$folder/seeds/$1.dict
  [ "$1" != glb ] || words=$folder/seeds/gltf.dict
  dictionary=
  [ ! -s "$words" ] || dictionary=-dict=$words
  TMPDIR=$folder/$1.tmp nice -n 19 "$root/build_fuzz/tests/hard/fuzz_$1" -max_total_time="$seconds" $dictionary \
    -fork=1 -ignore_crashes=1 -ignore_timeouts=1 -ignore_ooms=1 -rss_limit_mb=2048 -timeout=25 -report_slow_units=25 \
    -artifact_prefix="$folder/$1.found/" "$folder/$1" "$folder/seeds/$1" > "$folder/$1.log" 2>&1 || true
  rm -r "$folder/$1.tmp"
}

jobs=${VDB_DIFFUSE_FUZZ_JOBS:-2}
running=0
for kind in $kinds; do
  fuzz "$kind" &
  running=$((running + 1))
  [ $((running % jobs)) -ne 0 ] || wait
done
wait
status=0
for kind in $kinds; do
  last=$(grep '^#[0-9]*: cov:' "$folder/$kind.log" | tail -n 1)
  found=$(ls "$folder/$kind.found" | wc -l)
  echo "$kind: $last, $found found"
  [ "$found" -eq 0 ] || status=1
done
exit $status
