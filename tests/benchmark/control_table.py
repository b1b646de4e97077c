#!/usr/bin/env python3
"""Tables of docs/dissertation.md: what a pile reaches by how much control it is allowed.

    tests/benchmark/control_table.py build/release/commands/pilesim repose [--seeds N]
    tests/benchmark/control_table.py build/release/commands/pilesim glue [preset ...] [--seeds N]

repose: the angle that 300 rabbits take, by the angle asked, the method and tau (presets/repose). Mean
and deviation over seeds, and how many sleep in the air. glue: shapes of presets/guides left alone for
6 s, with all the glue that they need, shares of it by max_glue, and none.
"""
import argparse
import json
import statistics
import subprocess
import tempfile
from pathlib import Path

from guide_table import row

PRESETS = Path(__file__).resolve().parents[2] / "presets"
ANGLES = [10, 20, 35, 45, 60]
REPOSE = [("dissertation", 0.99), ("dissertation", 0.5), ("dissertation", 0.3), ("dissertation", 0.2),
          ("dissertation", 0.1), ("own", 0.99), ("own", 0.5), ("own", 0.1)]
SHARES = [1, 0.5, 0.25, 0.1, 0]
GUIDES = ["l", "arch", "column", "t"]


def run(pilesim, preset, seed, *overrides):
    """The report, and the frames of guide.json where there is a guide."""
    with tempfile.TemporaryDirectory() as directory:
        sets = [part for override in overrides for part in ("--set", override)]
        subprocess.run([pilesim, "direct-pile", PRESETS / (preset + ".json"), "-o", directory + "/out",
                        "--quiet", "--threads", "1", "--seed", str(seed), *sets], check=True)
        guide = Path(directory, "out/guide.json")
        frames = json.loads(guide.read_text())["frames"] if guide.exists() else []
        return json.loads(Path(directory, "out/report.json").read_text())["piles"], frames


def repose(pilesim, seeds):
    row("Control", *["asked %d" % angle for angle in ANGLES])
    row(*["---"] * (1 + len(ANGLES)))
    for method, tau in REPOSE:
        cells = []
        for angle in ANGLES:
            piles = [run(pilesim, "repose/rabbit_matrix_35", seed, "/piles/0/method=" + method,
                         "/piles/0/tau=%g" % tau, "/piles/0/angle_deg=%g" % angle)[0]
                     for seed in range(1, seeds + 1)]
            got = [pile["pile 0"]["angle_got_deg"] for pile in piles]
            asleep = statistics.mean(pile["all"]["asleep"] for pile in piles)
            in_air = statistics.mean(pile["all"]["asleep_in_the_air"] for pile in piles)
            got = [angle for angle in got if angle is not None]
            cells.append("%.1f ± %.1f, %.0f asleep, %.0f in the air"
                         % (statistics.mean(got), statistics.stdev(got), asleep, in_air)
                         + (" (%d of %d with a slope)" % (len(got), seeds) if len(got) < seeds else ""))
        row("%s, tau %g" % (method, tau), *cells)


def glue(pilesim, presets, seeds):
    row("Preset", "Seed", "Allowed", "Glue, weights", "Inside", "Height", "Mean drift", "Overlap")
    row(*["---"] * 8)
    for preset in presets:
        for seed in range(1, seeds + 1):
            needed = None
            for share in SHARES:
                allowed = [] if needed is None else ["/guide/max_glue=%.4g" % (share * needed)]
                # The ball comes after the end.
                piles, frames = run(pilesim, "guides/" + preset, seed, "/emitters/1/start_s=100", *allowed)
                figures, first, last = piles["guide"], frames[0], frames[-1]
                weights = figures["glue_needed"]["weights"]
                needed = weights if needed is None else needed
                row("`%s`" % preset, str(seed), "%.0f %%" % (100 * share),
                    "%.2f" % (share * needed),
                    "%.0f %%" % (100 * last["in_guide"] / figures["filling"]["kept"]),
                    "%.0f %%" % (100 * last["height_m"] / first["height_m"]),
                    "%.1f %%" % (100 * last["mean_drift_m"] / first["height_m"]),
                    "%.0f %%" % (100 * figures["overlap"]))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pilesim")
    parser.add_argument("table", choices=["repose", "glue"])
    parser.add_argument("presets", nargs="*", default=GUIDES)
    parser.add_argument("--seeds", type=int, default=3)
    options = parser.parse_args()
    if options.table == "repose":
        repose(options.pilesim, options.seeds)
    else:
        glue(options.pilesim, options.presets, options.seeds)


if __name__ == "__main__":
    main()
