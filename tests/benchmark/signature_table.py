#!/usr/bin/env python3
"""Errors of signatures in scenes (docs/dissertation.md): pilesim's own, its fit of 5 KB, the
dissertation's tables and their fit, each against the same runs of the impulse mode.

    tests/benchmark/signature_table.py build/release/commands/pilesim OUT [scene ...] [--batches N] [--runs N]

Measures what signatures are missing in OUT/signatures. A batch is a comparison of its own, of other seeds;
errors are the worst and the mean of the nine of `pilesim compare`. With 95 % intervals over batches, and how
much the mean differs from that of pilesim's own tables in the same batch.
"""
import argparse
import json
import math
import statistics
import subprocess
from pathlib import Path

from guide_table import row

ROOT = Path(__file__).resolve().parents[2]
# Restitution and friction of the presets.
MATERIALS = {"rabbit": (0.25, 0.5), "l_shape": (0.25, 0.45), "biped": (0.25, 0.5)}
SCENES = {
    "alone": ("compare/rabbits_on_a_plane", "rabbit",
              ["/emitters/0/count=[10,1,10]", "/emitters/0/spacing=[3,1,3]", "/duration_s=4"]),
    "plane": ("compare/rabbits_on_a_plane", "rabbit", []),
    "l_shapes": ("statistical/l_shapes_300", "l_shape", []),
    "bipeds": ("statistical/bipeds_100", "biped", []),
}
SIGNATURES = {"own": "", "own, 5 KB": ".5k", "dissertation": ".written", "its fit": ".written.fit"}
# Student's t for 95 %, by one less than the number of batches.
T95 = {1: 12.71, 2: 4.30, 3: 3.18, 4: 2.78, 5: 2.57, 6: 2.45, 7: 2.36, 8: 2.31, 9: 2.26, 10: 2.23, 11: 2.20}


def measure_signatures(pilesim, directory, shape):
    restitution, friction = MATERIALS[shape]
    mesh = ROOT / "assets" / (shape + ".obj")
    for ending, layout in (("", "scale-free"), (".written", "dissertation")):
        file = directory / (shape + ending + ".sig")
        if not file.exists():
            subprocess.run([pilesim, "sample-signature", mesh, "-o", file, "--layout", layout,
                            "--restitution", str(restitution), "--friction", str(friction),
                            "--rest-drops", "600", "--quiet"], check=True)
    for ending, fit in ((".5k", ["--max-bytes", "5000"]),
                        (".written.fit", ["--coordinates", "spherical", "--parameters", "centripetal"])):
        file = directory / (shape + ending + ".sig")
        if not file.exists():
            subprocess.run([pilesim, "fit-bspline", directory / (shape + ending.rsplit(".", 1)[0] + ".sig"),
                            "-o", file, *fit, "--quiet"], check=True)


def compare(pilesim, out, scene, first_seed, runs):
    """(worst, mean) of each signature."""
    preset, shape, overrides = SCENES[scene]
    modes = ["statistical+/shapes/%s/signature=%s" % (shape, out / "signatures" / (shape + ending + ".sig"))
             for ending in SIGNATURES.values()]
    directory = out / scene / ("seed%d" % first_seed)
    sets = [part for override in overrides for part in ("--set", override)]
    subprocess.run([pilesim, "compare", ROOT / "presets" / (preset + ".json"), "-o", directory, "--force",
                    "--quiet", "--threads", "1", "--runs", str(runs), "--seed", str(first_seed),
                    "--reference", "impulse:decomposition@1/240", "--modes", ",".join(modes), *sets],
                   check=True)
    found = []
    for mode in json.loads((directory / "compare.json").read_text())["modes"][1:]:
        errors = [error["normalised"]["value"] for error in mode["errors"].values()]
        errors = [error for error in errors if error is not None]
        found.append((max(errors), statistics.mean(errors)))
    return found


def interval(values):
    half = T95[min(len(values) - 1, max(T95))] * statistics.stdev(values) / math.sqrt(len(values))
    return "%.2f ± %.2f" % (statistics.mean(values), half)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pilesim")
    parser.add_argument("out", type=Path)
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--batches", type=int, default=6)
    parser.add_argument("--runs", type=int, default=6)
    options = parser.parse_args()
    out = options.out.resolve()
    (out / "signatures").mkdir(parents=True, exist_ok=True)
    row("Scene", "Signature", "Worst", "Mean", "Mean, less that of its own")
    row(*["---"] * 5)
    for scene in options.scenes:
        measure_signatures(options.pilesim, out / "signatures", SCENES[scene][1])
        batches = [compare(options.pilesim, out, scene, 1 + options.runs * i, options.runs)
                   for i in range(options.batches)]
        for i, signature in enumerate(SIGNATURES):
            row(scene, signature, interval([batch[i][0] for batch in batches]),
                interval([batch[i][1] for batch in batches]),
                "" if i == 0 else interval([batch[i][1] - batch[0][1] for batch in batches]))


if __name__ == "__main__":
    main()
