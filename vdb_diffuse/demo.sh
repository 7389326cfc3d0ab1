#!/bin/sh
# Builds vdb_diffuse, lights a cloud with a sun, a sky and an occluder, and leaves a lit VDB and a picture.
#
#   sh vdb_diffuse/demo.sh [OUTPUT_FOLDER]      default: demo_out beside the sources
set -eu
root=$(cd "$(dirname "$0")/.." && pwd)
out=${1:-$root/demo_out}
more_packages=""
. "$root/vdb_diffuse/packages.sh"

build=${VDB_DIFFUSE_BUILD:-$root/build}
cmake -S "$root" -B "$build" -G Ninja -DVDB_DIFFUSE_TESTS=OFF > "$build.log" 2>&1 || { cat "$build.log"; exit 1; }
rm -f "$build.log"
cmake --build "$build" --target vdb_diffuse

mkdir -p "$out"
program=$build/vdb_diffuse
"$program" info "$root/data/cumulus.vdb"
"$program" bake "$root/data/cumulus.vdb" -o "$out/lit.vdb" --scene "$root/data/sun_sky_plate.json" \
  --grids density,diffuse,direct,flux --stats "$out/stats.json"
"$program" render "$out/lit.vdb" -o "$out/lit.png" --size 960x540
echo
echo "Lit volume:  $out/lit.vdb"
echo "Picture:     $out/lit.png"
echo "Statistics:  $out/stats.json"
