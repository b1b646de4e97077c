#!/usr/bin/env bash
# Takes a bare Debian 12 machine to a working pilesim.
#   ./bootstrap.sh demo   install what is needed, build, simulate and render the default preset
#   ./bootstrap.sh test   install what is needed, build, run all tests
#   ./bootstrap.sh build  install what is needed, build
#   ./bootstrap.sh check [--short]  install what is needed, clang-tidy, tests under sanitizers, fuzzing,
#                                  instructions counted; a selection of the first three, some three minutes
#   ./bootstrap.sh sanitize [--thread] [PROGRAM...]  these test programs under AddressSanitizer and
#                                  UndefinedBehaviorSanitizer, or under ThreadSanitizer
#   ./bootstrap.sh fuzz [SECONDS [READER...]]  install what is needed and clang, feed every reader, or
#                                  these, broken files for so long each (20)
set -euo pipefail
cd "$(dirname "$0")"

packages=(
  g++ cmake ninja-build ccache pkg-config
  libeigen3-dev libbullet-dev libassimp-dev libosmesa6-dev libcli11-dev nlohmann-json3-dev
  libstb-dev fonts-dejavu-core
  libtbb-dev librandom123-dev libhwy-dev libxxhash-dev libzstd-dev
  libqhull-dev zlib1g-dev libmeshoptimizer-dev libembree-dev libcgal-dev
  libopenexr-dev ffmpeg gnuplot-nox
  libgtest-dev libgmock-dev python3 python3-zarr
)

# Of `check` and `fuzz`.
clang_packages=(clang libclang-rt-14-dev)

# install_packages [PACKAGE...]: those of every stage, and these.
install_packages() {
  local missing=()
  for package in "${packages[@]}" "$@"; do
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
  local seconds=$1 names name
  shift
  names=("$@")
  [ $# -gt 0 ] || for folder in tests/fuzz/corpus/*/; do names+=("$(basename "$folder")"); done
  install_packages "${clang_packages[@]}"
  cmake --preset fuzz && cmake --build build/fuzz --target "${names[@]/#/fuzz_}" || return
  local found=build/fuzz/found failed=0
  mkdir -p $found
  for name in "${names[@]}"; do
    local grown=build/fuzz/corpus/$name
    mkdir -p "$grown"
    build/fuzz/tests/fuzz/fuzz_"$name" "$grown" tests/fuzz/corpus/"$name" -artifact_prefix=$found/"$name"- -seed=1 \
      -max_total_time="$seconds" -rss_limit_mb=2048 -timeout=300 -print_final_stats=1 \
      >$found/"$name".log 2>&1 || failed=1
    local executions kept
    executions=$(sed -n 's/^stat::number_of_executed_units: *//p' $found/"$name".log)
    kept=$(sed -n 's/.*Test unit written to //p' $found/"$name".log)
    echo "$name: ${executions:-FAILED, see $found/$name.log} executions${kept:+, FAILED, kept in $kept}"
  done
  return $failed
}

# stage NAME COMMAND...: a line with the result; of a failure all that it printed.
stage() {
  local name=$1 start=$SECONDS log
  shift
  log=$(mktemp)
  if "$@" >"$log" 2>&1; then
    echo "$name: passed in $((SECONDS - start)) s"
  else
    cat "$log"
    echo "$name: FAILED after $((SECONDS - start)) s"
    failed=1
  fi
  rm -f "$log"
}

# Programs that read what others wrote, geometry, and loops on several threads.
sanitized=(unit_core unit_json unit_trajectory property_trajectory unit_scene property_geometry determinism_geometry)
# Those that run on several threads.
threaded=(unit_core determinism_geometry determinism_simulate determinism_pile property_simulate)

# sanitize [--thread | --clang] PROGRAM...: --clang with what the fuzzers are built of.
sanitize() {
  local preset=asan-ubsan
  case "$1" in
    --thread) preset=tsan && shift ;;
    --clang) preset=fuzz && shift ;;
  esac
  install_packages
  cmake --preset $preset && cmake --build build/$preset --target "$@" || return
  local program
  for program in "$@"; do
    UBSAN_OPTIONS=print_stacktrace=1 build/$preset/tests/"$program" --gtest_brief=1 || return
  done
}

# check [--short]
check() {
  install_packages "${clang_packages[@]}" clang-tidy valgrind
  local failed=0
  stage configure cmake --preset release
  if [ "${1:-}" = --short ]; then
    stage "clang-tidy of what is new" tests/lint/lint.py build/release --recent 60
    stage "fuzzers of formats" fuzz 5 json trajectory
    stage "sanitizers, of clang" sanitize --clang unit_json unit_trajectory
    GTEST_FILTER='Team*:ParallelFor*' stage threads sanitize --thread unit_core
  else
    stage clang-tidy tests/lint/lint.py build/release
    stage sanitizers sanitize "${sanitized[@]}"
    stage threads sanitize --thread "${threaded[@]}"
    stage fuzzers fuzz 5
    stage "pilesim, to count instructions" build pilesim
    stage "benchmarks, which nothing else builds" build benchmarks
    stage instructions tests/benchmark/ratchet.py build/release/commands/pilesim
  fi
  return $failed
}

case "${1:-}" in
  build) build ;;
  demo) demo ;;
  test)
    build
    ctest --preset release -j "$(nproc)"
    ;;
  check) check "${2:-}" ;;
  sanitize)
    shift
    case $# in
      0) set -- "${sanitized[@]}" ;;
      1) [ "$1" != --thread ] || set -- --thread "${threaded[@]}" ;;
    esac
    sanitize "$@"
    ;;
  fuzz)
    shift
    fuzz "${1:-20}" "${@:2}"
    ;;
  *)
    sed -n '3,12s/^#   //p' "$0" >&2
    exit 2
    ;;
esac
