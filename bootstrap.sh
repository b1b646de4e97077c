#!/usr/bin/env bash
# Takes a bare Debian 12 machine to a working pilesim.
#   ./bootstrap.sh demo   install what is needed, build, simulate and render the default preset
#   ./bootstrap.sh test   install what is needed, build, run all tests
#   ./bootstrap.sh build  install what is needed, build
#   ./bootstrap.sh fuzz [SECONDS]  install what is needed and clang, feed every reader broken files for
#                                  so long each (20)
set -euo pipefail
cd "$(dirname "$0")"

packages=(
  g++ cmake ninja-build ccache pkg-config
  libeigen3-dev libbullet-dev libassimp-dev libosmesa6-dev libcli11-dev nlohmann-json3-dev
  libstb-dev fonts-dejavu-core
  libtbb-dev librandom123-dev libhwy-dev libxxhash-dev libzstd-dev
  libqhull-dev zlib1g-dev libmeshoptimizer-dev libcgal-dev
  ffmpeg gnuplot-nox
  libgtest-dev libgmock-dev python3 python3-zarr
)

install_packages() {
  local missing=()
  for package in "${packages[@]}"; do
    dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null | grep -qx installed ||
      missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return
  echo "Installing: ${missing[*]}" >&2
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || {
      echo "bootstrap.sh: not root and no sudo; install as root: apt-get install ${missing[*]}" >&2
      exit 1
    }
    as_root=(sudo)
  fi
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -y -qq --no-install-recommends "${missing[@]}" >/dev/null
}

build() {
  install_packages
  cmake --preset release >build-configure.log 2>&1 || { cat build-configure.log >&2; exit 1; }
  rm -f build-configure.log
  cmake --build --preset release -- "$@"
}

demo() {
  build pilesim
  local pilesim=build/release/commands/pilesim
  local preset=presets/impulse/rabbits_in_a_crate.json
  local out=out/rabbits_in_a_crate
  # Nothing that the result is made of changed: keep it.
  if [ -s $out/video.mp4 ] && [ -z "$(find $pilesim $preset assets -newer $out/video.mp4)" ]; then
    echo "$out/video.mp4 is up to date"
    return
  fi
  $pilesim simulate $preset -o $out --force
  $pilesim render $out --force
}

# What crashes, hangs or takes too much memory is kept in build/fuzz/found/ and named.
fuzz() {
  local seconds=$1
  packages+=(clang libclang-rt-14-dev)
  install_packages
  cmake --preset fuzz >build-configure.log 2>&1 || { cat build-configure.log >&2; exit 1; }
  rm -f build-configure.log
  cmake --build --preset fuzz
  local found=build/fuzz/found failed=0
  mkdir -p $found
  for folder in tests/fuzz/corpus/*/; do
    local name grown
    name=$(basename "$folder")
    grown=build/fuzz/corpus/$name
    mkdir -p "$grown"
    build/fuzz/tests/fuzz/fuzz_"$name" "$grown" "$folder" -artifact_prefix=$found/"$name"- -seed=1 \
      -max_total_time="$seconds" -rss_limit_mb=2048 -timeout=10 -print_final_stats=1 \
      >$found/"$name".log 2>&1 || failed=1
    echo "$name: $(sed -n 's/^stat::number_of_executed_units: */executions: /p' $found/"$name".log)" \
      "$(sed -n 's/.*Test unit written to /FAILED, kept in /p' $found/"$name".log)"
  done
  return $failed
}

case "${1:-}" in
  build) build ;;
  demo) demo ;;
  test)
    build
    ctest --preset release -j "$(nproc)"
    ;;
  fuzz) fuzz "${2:-20}" ;;
  *)
    sed -n '3,7s/^#   //p' "$0" >&2
    exit 2
    ;;
esac
