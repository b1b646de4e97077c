#!/usr/bin/env python3
"""How far the videos of the user study look apart, for want of people to ask (docs/mixed.md).

    presets/mixed/user_study.sh OUT
    tests/benchmark/seen_table.py build/release/commands/pilesim OUT

Each run is drawn by the scene's camera, small, each sixth frame. Silhouette: of two pictures of the same time, the pixels in
which only one shows a moving body, over those in which either does; the mean over the frames. Bustle: the
share of such pixels that show another body than in the picture before; the mean difference over the frames.
Mean over pairs of runs of different seeds, and over the same mean among the runs of the first video.
"""
import argparse
import json
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "cli"))
from guide_table import row  # noqa: E402
from png_reader import read_png  # noqa: E402

SIZE = "128x72"
FRAMES = "0-x6"
# The reference first.
VIDEOS = {"rabbits": ["impulse_decomposition_1_240", "impulse_spheres7_1_240", "statistical"],
          "rings": ["impulse_1_240", "impulse_sphere_1_240", "mixed"]}


def seen(pilesim, run, out):
    """For each frame the moving body that each pixel shows, 0 for none."""
    if not (out / "passes").exists():
        subprocess.run([pilesim, "render", run, "-o", out, "--size", SIZE, "--frames", FRAMES, "--samples", "1",
                        "--passes", "ids", "--no-video", "--quiet", "--threads", "1"], check=True)
        shutil.rmtree(out / "frames")
    names = json.loads((out / "passes/passes.json").read_text())["instances"]
    pictures = []
    for file in sorted(out.glob("passes/ids.*.png")):
        rows = read_png(file)[2]
        # Bodies of emitters have a slash in their names.
        pictures.append([body if body and "/" in names[body - 1] else 0 for row in rows for body in row])
    return pictures


def bustle(pictures):
    shares = []
    for before, now in zip(pictures, pictures[1:]):
        either = sum(1 for a, b in zip(before, now) if a or b)
        shares.append(sum(1 for a, b in zip(before, now) if a != b) / max(1, either))
    return shares


def silhouette_difference(a, b):
    shares = []
    for one, other in zip(a, b):
        either = sum(1 for x, y in zip(one, other) if x or y)
        shares.append(sum(1 for x, y in zip(one, other) if bool(x) != bool(y)) / max(1, either))
    return statistics.mean(shares)


def bustle_difference(a, b):
    return statistics.mean(abs(x - y) for x, y in zip(a, b))


def of_pairs(difference, runs, reference):
    return statistics.mean(difference(runs[i], reference[j])
                           for i in range(len(runs)) for j in range(len(reference)) if i != j)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pilesim")
    parser.add_argument("out", type=Path)
    options = parser.parse_args()
    row("Scene", "Video", "Silhouette", "over its own", "Bustle", "over its own")
    row(*["---"] * 6)
    for scene, videos in VIDEOS.items():
        reference = None
        for video in videos:
            runs = sorted((options.out / scene / "runs" / video).glob("seed*"))
            pictures = [seen(options.pilesim, run, options.out / "seen" / scene / video / run.name)
                        for run in runs]
            busy = [bustle(run) for run in pictures]
            if reference is None:
                reference = pictures, busy
                own = (of_pairs(silhouette_difference, *[pictures] * 2), of_pairs(bustle_difference, *[busy] * 2))
            shape = of_pairs(silhouette_difference, pictures, reference[0])
            flow = of_pairs(bustle_difference, busy, reference[1])
            row(scene, video, "%.3f" % shape, "%.2f" % (shape / own[0]), "%.4f" % flow, "%.2f" % (flow / own[1]))


if __name__ == "__main__":
    main()
