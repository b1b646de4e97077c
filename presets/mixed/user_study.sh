#!/bin/sh
# The six videos of the dissertation's user study (Tables 4.2 to 4.4) and the error reports that stand in
# for its people: from the repository, presets/mixed/user_study.sh OUT [RABBITS [RINGS]]
# RABBITS and RINGS: how many along each axis, [10,10,10] and [5,40,5] as in the study.
set -eu
[ $# -ge 1 ] || { sed -n 's/^# //p' "$0" >&2; exit 2; }
out=$1 rabbits=${2:-[10,10,10]} rings=${3:-[5,40,5]}
pilesim=${PILESIM:-build/release/commands/pilesim}

"$pilesim" compare presets/statistical/rabbits_10000.json -o "$out/rabbits" --runs 3 \
  --reference impulse:decomposition@1/240 --modes impulse:spheres7@1/240,statistical \
  --set "/emitters/0/count=$rabbits" --set /duration_s=5
"$pilesim" compare presets/mixed/rings_and_poles.json -o "$out/rings" --runs 3 \
  --reference impulse@1/120 --modes impulse:sphere@1/120,mixed+/simulator/level_of_detail/level=2 \
  --set "/emitters/0/count=$rings"

for scene in rabbits rings; do
  for mode in "$out/$scene/runs"/*; do
    case $mode in */impulse_decomposition* | */impulse_1_120) continue ;; esac
    for reference in "$out/$scene/runs/impulse_decomposition"* "$out/$scene/runs/impulse_1_120"; do
      [ -d "$reference" ] || continue
      "$pilesim" render "$reference/seed1" --compare-with "$mode/seed1" \
        -o "$out/videos/${scene}_$(basename "$mode")"
    done
  done
done
