#!/usr/bin/env python3
"""The table of docs/equilibrium.md: each preset with a guide with and without control.

    tests/benchmark/guide_table.py build/release/commands/pilesim [preset ...] [--seeds N]

Piles that are given body by body have no random numbers: one run each, left alone for 10 s (4 s
without control, when they are down), and one with what hits them. The others run as they are, with
several seeds.
"""
import argparse
import json
import resource
import subprocess
import tempfile
from pathlib import Path

PRESETS = Path(__file__).resolve().parents[2] / "presets/equilibrium"
GIVEN = ["card_tower", "rough_crates", "tyre_fan", "stick_tower", "book_spiral"]
GROWN = ["chair_pile", "chair_cone", "stick_pile", "books_upside_down", "bananas_in_a_cart"]
LEFT_ALONE = ["/emitters=[]"]
OVERRIDES = []


def cpu_s():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run(pilesim, preset, *overrides):
    with tempfile.TemporaryDirectory() as directory:
        sets = [part for override in [*overrides, *OVERRIDES] for part in ("--set", override)]
        start = cpu_s()
        subprocess.run([pilesim, "direct-pile", PRESETS / (preset + ".json"), "-o",
                        directory + "/out", "--quiet", *sets], check=True)
        frames = json.loads(Path(directory, "out/guide.json").read_text())["frames"]
        report = json.loads(Path(directory, "out/report.json").read_text())
        return frames, report["piles"]["guide"], cpu_s() - start


def collapse(frames):
    """When bodies are a tenth of the height from their places, on average."""
    height = frames[0]["height_m"]
    for frame in frames:
        if frame["mean_drift_m"] > 0.1 * height:
            return "%.1f s" % frame["time_s"]
    return "stands"


def steps(figures):
    return "%d | %.2g ms, %.2g ms" % (figures["held"], 1e3 * figures["simulation_step_s"],
                                      1e3 * figures["control_step_s"])


def surface(figures):
    return "%.0f %% off, %.0f of %.0f degrees" % (100 * figures["surface"]["difference"],
                                                  figures["surface"]["slope_deg"],
                                                  figures["surface"]["guide_slope_deg"])


def row(*cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def given(pilesim, preset):
    for control, duration_s in (("true", 10), ("false", 4)):
        frames, figures, cpu = run(pilesim, preset, *LEFT_ALONE, "/guide/control=" + control,
                                   "/duration_s=%d" % duration_s)
        height = frames[0]["height_m"]
        row("`%s`" % preset, "with" if control == "true" else "without", "",
            collapse(frames), "%.2g %%" % (100 * frames[-1]["largest_drift_m"] / height),
            "%.2g %%" % (100 * (frames[-1]["largest_drift_m"] - frames[14]["largest_drift_m"])
                         / height),
            "", "", "%.1f s for %d s" % (cpu, duration_s), steps(figures))
    frames, figures, _ = run(pilesim, preset)
    print("  hit: height %.2f m before, %.2f m at the end, %d knocked loose"
          % (frames[0]["height_m"], frames[-1]["height_m"], figures["knocked_loose"]), flush=True)


def grown(pilesim, preset, seeds):
    for control in ("true", "false"):
        for seed in range(1, seeds + 1):
            frames, figures, cpu = run(pilesim, preset, "/guide/control=" + control,
                                       "/seed=%d" % seed)
            filling = figures.get("filling", {})
            row("`%s`" % preset, "with" if control == "true" else "without", str(seed),
                "height %.2f m" % frames[-1]["height_m"],
                "%.2g m" % frames[-1]["mean_drift_m"], "",
                "%.0f %%, overlap %.0f %%" % (100 * figures["bodies_inside"],
                                              100 * figures["overlap"]),
                surface(figures),
                "%.1f s for %.0f s" % (cpu, frames[-1]["time_s"]),
                steps(figures))
            if filling:
                print("  filled: %(kept)d of %(dropped)d" % filling, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pilesim")
    parser.add_argument("presets", nargs="*", default=GIVEN + GROWN)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--set", action="append", default=[], help="override in every run")
    options = parser.parse_args()
    OVERRIDES.extend(options.set)
    row("Preset", "Control", "Seed", "Falls after, or ends at", "Drift", "of it after 0.5 s", "Inside",
        "Surface", "CPU", "Held", "A step, a control step")
    row(*["---"] * 11)
    for preset in options.presets:
        if preset in GROWN:
            grown(options.pilesim, preset, options.seeds)
        else:
            given(options.pilesim, preset)


if __name__ == "__main__":
    main()
