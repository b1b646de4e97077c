#!/usr/bin/env bash
# Makes the pictures of the documentation again, from presets: docs/pictures/make.sh [PILESIM [WORK]].
# PILESIM is the program (build/release/commands/pilesim), WORK a directory for what is simulated (out/pictures); what is there already is kept.
# Needs ffmpeg. About five minutes on two cores; with LARGE=1 100,000 rabbits are finished, too, in some ten minutes and 2.4 GB.
set -euo pipefail
cd "$(dirname "$0")/../.."
pilesim=${1:-build/release/commands/pilesim}
work=${2:-out/pictures}
mkdir -p "$work"

# run COMMAND PRESET [NAME]: simulates it into WORK.
run() {
  local out
  out=$work/${3:-$(basename "$2")}
  [ -s "$out/report.json" ] || "$pilesim" "$1" "presets/$2.json" -o "$out" --force
}

# still PRESET TIME NAME CAMERA: the frame at that time, by rays, as WORK/NAME.png.
still() {
  local out=$work/still_$3
  if [ ! -s "$work/$3.png" ]; then
    "$pilesim" render "$work/$1" -o "$out" --frames "$2" --renderer rays --size 640x360 --no-video --force \
      --set "/camera=$4"
    cp "$out"/frames/*.png "$work/$3.png"
  fi
}

run direct-pile guides/letters
run direct-pile equilibrium/chair_pile
run simulate impulse/rabbits_in_a_crate
run simulate artist/things_on_a_table
letters='{"position": [1.2, 2.6, 8], "target": [0, 0.75, 0], "field_of_view_deg": 25}'
still letters 2.4s letters "$letters"
still letters 3.2s letters_hit "$letters"
still chair_pile last chairs '{"position": [4.2, 3, 8], "target": [0, 1.35, 0], "field_of_view_deg": 28}'
still rabbits_in_a_crate last rabbits '{"position": [1.9, 1.9, 3.4], "target": [0.1, 0.38, 0.1], "field_of_view_deg": 25}'
# The camera of the scene.
if [ ! -s "$work/things_on_a_table.png" ]; then
  "$pilesim" render "$work/things_on_a_table" -o "$work/still_things" --frames last --renderer rays --size 960x540 --no-video --force
  cp "$work"/still_things/frames/*.png "$work/things_on_a_table.png"
fi
ffmpeg -loglevel error -y -i "$work/things_on_a_table.png" -q:v 5 docs/pictures/things_on_a_table.jpg
ffmpeg -loglevel error -y -i "$work/letters.png" -i "$work/letters_hit.png" -i "$work/chairs.png" -i "$work/rabbits.png" \
  -filter_complex "[0][1]hstack[upper];[2][3]hstack[lower];[upper][lower]vstack" -q:v 4 -frames:v 1 docs/pictures/piles.jpg

# A chain, and surfaces that move, by the cameras of their scenes.
moving() {
  run simulate "impulse/$1"
  if [ ! -s "$work/$1.png" ]; then
    "$pilesim" render "$work/$1" -o "$work/still_$1" --frames "$2" --renderer rays --size 640x360 --no-video --force
    cp "$work/still_$1"/frames/*.png "$work/$1.png"
  fi
}
moving wrecking_ball 1.5s
moving belt last
moving tumbling_drum last
moving vibrating_bowl last
ffmpeg -loglevel error -y -i "$work/wrecking_ball.png" -i "$work/belt.png" -i "$work/tumbling_drum.png" -i "$work/vibrating_bowl.png" \
  -filter_complex "[0][1]hstack[upper];[2][3]hstack[lower];[upper][lower]vstack" -q:v 4 -frames:v 1 docs/pictures/moving.jpg

# Looks, and glass.
moving looks last
moving jar last
ffmpeg -loglevel error -y -i "$work/looks.png" -i "$work/jar.png" -filter_complex hstack -q:v 4 -frames:v 1 docs/pictures/looks.jpg

# The same fall, as it was simulated and as it was made sound.
run simulate statistical/rabbits_10000
run simulate finish/rabbits_10000 rabbits_10000_finished
near='{"position": [2.2, 2.3, 3.4], "target": [0.6, 1.25, 0.6], "field_of_view_deg": 14}'
still rabbits_10000 last rabbits_10000 "$near"
still rabbits_10000_finished last rabbits_10000_finished "$near"
ffmpeg -loglevel error -y -i "$work/rabbits_10000.png" -i "$work/rabbits_10000_finished.png" -filter_complex hstack \
  -q:v 4 -frames:v 1 docs/pictures/finish.jpg

if [ -n "${LARGE:-}" ]; then
  if [ ! -s "$work/rabbits_100000/report.json" ]; then
    "$pilesim" simulate presets/statistical/rabbits_100000.json -o "$work/rabbits_100000" --force --set /shapes/rabbit/collision=decomposition \
      --set /shapes/rabbit/decomposition_max_pieces=6 --set /shapes/rabbit/hull_max_vertices=24
  fi
  [ -s "$work/rabbits_100000_finished/report.json" ] ||
    "$pilesim" finish "$work/rabbits_100000" -o "$work/rabbits_100000_finished" --force
  near='{"position": [3.2, 2.6, 4.6], "target": [0.9, 1.0, 1.0], "field_of_view_deg": 17}'
  still rabbits_100000 last rabbits_100000 "$near"
  still rabbits_100000_finished last rabbits_100000_finished "$near"
  ffmpeg -loglevel error -y -i "$work/rabbits_100000.png" -i "$work/rabbits_100000_finished.png" -filter_complex hstack \
    -q:v 4 -frames:v 1 docs/pictures/finish_100000.jpg
fi

# The first three bins, each from its four views.
[ -s "$work/bins/shards/00000.jsonl" ] || "$pilesim" batch presets/batch/bins.plan.json -o "$work/bins" --shard 0/333
ffmpeg -loglevel error -y -pattern_type glob -i "$work/bins/jobs/*/*/run/cameras/*/frames/*.png" \
  -vf scale=240:-1,tile=4x3 -frames:v 1 -q:v 4 docs/pictures/bins.jpg
