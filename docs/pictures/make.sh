#!/usr/bin/env bash
# Makes the pictures of the pages again that are not in the gallery: docs/pictures/make.sh [PILESIM [WORK]].
# PILESIM is the program (build/release/commands/pilesim), WORK a directory for what is simulated (out/gallery, which docs/gallery/make.py fills);
# what is there already is kept. Needs ffmpeg and gnuplot. About five minutes on two cores; with LARGE=1 100,000 rabbits are finished,
# too, in some ten minutes and 2.4 GB.
set -euo pipefail
cd "$(dirname "$0")/../.."
pilesim=${1:-build/release/commands/pilesim}
work=${2:-out/gallery}
mkdir -p "$work"

# run COMMAND PRESET [NAME]: simulates it into WORK.
run() {
  local out
  out=$work/${3:-${2//\//_}}
  [ -s "$out/report.json" ] || "$pilesim" "$1" "presets/$2.json" -o "$out" --force
}

# picture NAME RUN FRAMES ARGUMENTS...: one frame as WORK/NAME.png.
picture() {
  if [ ! -s "$work/$1.png" ]; then
    "$pilesim" render "$work/$2" -o "$work/picture_$1" --frames "$3" --size 640x360 --no-video --force "${@:4}"
    cp "$work/picture_$1"/frames/*.png "$work/$1.png"
  fi
}

# jpeg NAME INPUTS...: pictures of WORK side by side, as docs/pictures/NAME.jpg.
jpeg() {
  local inputs=()
  for name in "${@:2}"; do inputs+=(-i "$work/$name.png"); done
  ffmpeg -loglevel error -y "${inputs[@]}" $([ $# -eq 2 ] || echo "-filter_complex hstack=inputs=$(($# - 1))") -q:v 4 -frames:v 1 "docs/pictures/$1.jpg"
}

run simulate artist/things_on_a_table
picture things_on_a_table artist_things_on_a_table last --renderer rays --size 960x540
jpeg things_on_a_table things_on_a_table

# Overlays: glue and forces, layers, the analysis, levels of detail.
run direct-pile guides/heart
picture glue guides_heart 2.9s --overlay guide
picture forces guides_heart 2.9s --overlay forces
jpeg glue glue forces
run direct-pile repose/rabbit_matrix_35
picture layers repose_rabbit_matrix_35 last --overlay piles
jpeg layers layers
run direct-pile equilibrium/stick_tower
picture analysis equilibrium_stick_tower 5.6s --overlay guide
jpeg analysis analysis
run simulate mixed/building
picture levels mixed_building 0.7s --overlay solver
jpeg levels levels

# Two modes side by side, frames of a run, bodies that start inside one another.
run simulate impulse/rabbits_in_a_crate
run simulate statistical/rabbits_in_a_crate
picture compare impulse_rabbits_in_a_crate 4s --compare-with "$work/statistical_rabbits_in_a_crate"
jpeg compare compare
[ -s "$work/sheet.png" ] || "$pilesim" render "$work/impulse_rabbits_in_a_crate" -o "$work/sheet" --sheet 3x2 --size 320x180 --force
cp "$work/sheet/sheet.png" "$work/sheet.png"
jpeg sheet sheet
run simulate hard/overlapping
picture overlapping hard_overlapping 0 --renderer rays
jpeg overlapping overlapping

# Colours, depth and normals of a bin.
run simulate batch/bin
if [ ! -s "$work/normals.png" ]; then
  "$pilesim" render "$work/batch_bin" -o "$work/passes" --frames last --size 480x360 --passes depth,normals --no-video --force
  cp "$work"/passes/frames/*.png "$work/colours.png"
  ffmpeg -loglevel error -y -pattern_type glob -i "$work/passes/passes/depth.*.png" -vf format=rgb48,normalize,format=rgb24 "$work/depth.png"
  ffmpeg -loglevel error -y -pattern_type glob -i "$work/passes/passes/normals.*.png" -vf format=rgb24 "$work/normals.png"
fi
jpeg passes colours depth normals

# The same fall, as it was simulated and as it was made sound.
run simulate statistical/rabbits_10000
run simulate finish/rabbits_10000
near='{"position": [2.2, 2.3, 3.4], "target": [0.6, 1.25, 0.6], "field_of_view_deg": 14}'
picture fallen statistical_rabbits_10000 last --renderer rays --set "/camera=$near"
picture finished finish_rabbits_10000 last --renderer rays --set "/camera=$near"
jpeg finish fallen finished

if [ -n "${LARGE:-}" ]; then
  if [ ! -s "$work/rabbits_100000/report.json" ]; then
    "$pilesim" simulate presets/statistical/rabbits_100000.json -o "$work/rabbits_100000" --force --set /shapes/rabbit/collision=decomposition \
      --set /shapes/rabbit/decomposition_max_pieces=6 --set /shapes/rabbit/hull_max_vertices=24
  fi
  [ -s "$work/rabbits_100000_finished/report.json" ] ||
    "$pilesim" finish "$work/rabbits_100000" -o "$work/rabbits_100000_finished" --force
  near='{"position": [3.2, 2.6, 4.6], "target": [0.9, 1.0, 1.0], "field_of_view_deg": 17}'
  picture rabbits_100000 rabbits_100000 last --renderer rays --set "/camera=$near"
  picture rabbits_100000_finished rabbits_100000_finished last --renderer rays --set "/camera=$near"
  jpeg finish_100000 rabbits_100000 rabbits_100000_finished
fi

# The first three bins, each from its four views.
[ -s "$work/bins/shards/00000.jsonl" ] || "$pilesim" batch presets/batch/bins.plan.json -o "$work/bins" --shard 0/333
ffmpeg -loglevel error -y -pattern_type glob -i "$work/bins/jobs/*/*/run/cameras/*/frames/*.png" \
  -vf scale=240:-1,tile=4x3 -frames:v 1 -q:v 4 docs/pictures/bins.jpg
