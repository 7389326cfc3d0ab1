# Installs, with apt-get, what the build needs on Debian 12 and is not there yet. Sourced by demo.sh and
# tests/run.sh; needs root (or sudo) only where something is missing.
packages="g++ cmake ninja-build pkg-config libopenvdb-dev libboost-dev libboost-iostreams-dev libblosc-dev zlib1g-dev
libtbb-dev libembree-dev libopenexr-dev libimath-dev libpng-dev libcairo2-dev libassimp-dev libeigen3-dev nlohmann-json3-dev
libcli11-dev libgtest-dev $more_packages"
missing=""
for package in $packages; do
  dpkg-query -W -f='${Status}\n' "$package" 2>/dev/null | grep -q '^install ok installed' || missing="$missing $package"
done
if [ -n "$missing" ]; then
  echo "installing:$missing"
  as_root=""
  [ "$(id -u)" = 0 ] || as_root=sudo
  $as_root apt-get update -q
  DEBIAN_FRONTEND=noninteractive $as_root apt-get install -y -q --no-install-recommends $missing
fi
