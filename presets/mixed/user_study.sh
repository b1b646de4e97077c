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
  --reference impulse@1/240 --modes impulse:sphere@1/240,mixed \
  --set "/emitters/0/count=$rings"

# draw SCENE REFERENCE MODE NAME: side by side, under the modes' names; small, too, as NAME.mp4, for pages.
draw() {
  for mode in "$2" "$3"; do ln -sfn "runs/$mode/seed1" "$out/$1/$mode"; done
  "$pilesim" render "$out/$1/$2" --compare-with "$out/$1/$3" -o "$out/videos/$1_$3"
  ffmpeg -loglevel error -y -i "$out/videos/$1_$3/video.mp4" -vf scale=640:-2,fps=15 -c:v libx264 -crf 32 -preset slow \
    -pix_fmt yuv420p -movflags +faststart "$out/videos/$4.mp4"
}
draw rabbits impulse_decomposition_1_240 impulse_spheres7_1_240 study_rabbits_seven_spheres
draw rabbits impulse_decomposition_1_240 statistical study_rabbits_statistical
draw rings impulse_1_240 impulse_sphere_1_240 study_rings_one_sphere
draw rings impulse_1_240 mixed study_rings_mixed
