#!/bin/sh
# The six videos of the dissertation's user study (Tables 4.2 to 4.4) and the error reports that stand in
# for its people: from the repository, presets/mixed/user_study.sh OUT [RABBITS [RINGS]]
# RABBITS and RINGS: how many along each axis, [10,10,10] and [5,40,5] as in the study.
set -eu
[ $# -ge 1 ] || { sed -n 's/^# //p' "$0" >&2; exit 2; }
out=$1 rabbits=${2:-[10,10,10]} rings=${3:-[5,40,5]}
pilesim=${PILESIM:-build/release/commands/pilesim}

camera='{"position": [3.5, 3, 6], "target": [0, 0.9, 0]}'

"$pilesim" compare presets/statistical/rabbits_10000.json -o "$out/rabbits" --runs 3 \
  --reference impulse:decomposition@1/240 --modes impulse:spheres7@1/240,statistical \
  --set "/emitters/0/count=$rabbits" --set '/emitters/0/centre=[0,2.6,0]' --set "/camera=$camera" \
  --set /duration_s=5
"$pilesim" compare presets/mixed/rings_and_poles.json -o "$out/rings" --runs 3 \
  --reference impulse@1/240 --modes impulse:sphere@1/240,mixed+/simulator/level_of_detail/level=2 \
  --set "/emitters/0/count=$rings"

# draw SCENE REFERENCE MODE: side by side, under the modes' names.
draw() {
  for mode in "$2" "$3"; do ln -sfn "runs/$mode/seed1" "$out/$1/$mode"; done
  "$pilesim" render "$out/$1/$2" --compare-with "$out/$1/$3" -o "$out/videos/$1_$3"
}
draw rabbits impulse_decomposition_1_240 impulse_spheres7_1_240
draw rabbits impulse_decomposition_1_240 statistical
draw rings impulse_1_240 impulse_sphere_1_240
draw rings impulse_1_240 mixed__simulator_level_of_detail_level_2
