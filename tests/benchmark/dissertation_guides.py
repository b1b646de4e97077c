#!/usr/bin/env python3
"""The table of chapter 6 in docs/dissertation.md: section 6.2 as it is written beside pilesim's own.

    tests/benchmark/dissertation_guides.py build/release/commands/pilesim [preset ...] [--way WAY]

Piles that are given body by body are left alone for 10 s (4 s without control, when they are down);
the others run as they are. Constraints are means of the last 512 steps, as in the dissertation.
"""
import argparse

from guide_table import GIVEN, GROWN, LEFT_ALONE, collapse, row, run

# Keys of a preset for pilesim's own method return to their defaults.
AS_WRITTEN = ["/guide/hold=nail", "/guide/neighbours=true",
              "/guide/least_normal_up=-0.5", "/guide/break_speed=0.3"]
WAYS = {
    "free": ["/guide/control=false"],
    "as written": AS_WRITTEN,
    "as written, alpha 0.01": [*AS_WRITTEN, "/guide/alpha=0.01"],
    "freeze": ["/guide/hold=freeze"],
    "glue": ["/guide/hold=glue"],
}
LAST_STEPS = 512


def measure(pilesim, preset, way):
    overrides = list(WAYS[way])
    if preset in GIVEN:
        overrides += LEFT_ALONE + ["/duration_s=%d" % (4 if way == "free" else 10)]
    frames, figures, cpu = run(pilesim, preset, *overrides)
    last = frames[-round(LAST_STEPS / 240 / (frames[1]["time_s"] - frames[0]["time_s"])):]
    height = frames[0]["height_m"]
    held = "%.0f" % (sum(frame["nails"] for frame in last) / len(last))
    if way in ("freeze", "glue"):
        held = "%d %s" % (frames[-1]["held" if way == "freeze" else "glue"],
                          "held" if way == "freeze" else "pairs")
    row("`%s`" % preset, way,
        collapse(frames) if preset in GIVEN else "height %.2f m" % frames[-1]["height_m"],
        "%.2g %%" % (100 * frames[-1]["mean_drift_m"] / height) if preset in GIVEN
        else "%.0f %%, %.0f %%" % (100 * figures["bodies_inside"], 100 * figures["overlap"]),
        held, "%.2g" % (1e3 * figures["simulation_step_s"]),
        "%.2g" % (1e3 * figures["control_step_s"]), "%.1f" % cpu)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pilesim")
    parser.add_argument("presets", nargs="*", default=GIVEN + GROWN)
    parser.add_argument("--way", action="append", choices=WAYS, help="these only")
    options = parser.parse_args()
    row("Preset", "Way", "Falls after, or ends at", "Mean drift of its height, or inside and overlap",
        "Constraints", "Step, ms", "Control step, ms", "CPU, s")
    row(*["---"] * 8)
    for preset in options.presets:
        for way in options.way or WAYS:
            measure(options.pilesim, preset, way)


if __name__ == "__main__":
    main()
