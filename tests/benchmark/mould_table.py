#!/usr/bin/env python3
"""The table of docs/lab/glue.md: shapes filled as moulds and held by the least glue.

    tests/benchmark/mould_table.py build/release/commands/pilesim [shape ...] [--bodies box,stick,...]
        [--seeds 1,2,3] [--set KEY=VALUE]

Each is left alone for 10 s and, in another run, hit by a ball. `!` marks what misses its goal: 90 %
of the bodies inside and 95 % of the mould's packing kept, mean drift below 1 % of the height, height
below 60 % after the hit, overlap at most 0.02 D. The packing of the same bodies in a box of 1 m
stands before the rows of a kind of body.
"""
import argparse
import json
import resource
import subprocess
import tempfile
from pathlib import Path

from guide_table import row

ASSETS = Path(__file__).resolve().parents[2] / "assets"
SHAPES = ["column", "cut_sphere", "l", "t", "arch", "torus", "heart", "spiral_tower", "letters",
          "figure"]
# Radius of the ball that hits, m: it has a third of the pile's mass or more.
BALLS = {"spiral_tower": 0.3}
# File and scale of those that are not in assets/guides.
OTHERS = {"figure": (ASSETS / "biped.obj", 8)}
BODIES = {
    "box": {"type": "box", "size": [0.13, 0.13, 0.13]},
    "stick": {"type": "box", "size": [0.3, 0.075, 0.075]},
    "rabbit": {"type": "mesh", "file": str(ASSETS / "rabbit_500.obj"), "scale": 0.7,
               "collision": "decomposition"},
    "chair": {"type": "mesh", "file": str(ASSETS / "chair.obj"), "scale": 0.3,
              "collision": "decomposition"},
}
BOX = """v -0.5 0 -0.5\nv 0.5 0 -0.5\nv 0.5 0 0.5\nv -0.5 0 0.5
v -0.5 1 -0.5\nv 0.5 1 -0.5\nv 0.5 1 0.5\nv -0.5 1 0.5
f 1 2 3\nf 1 3 4\nf 5 7 6\nf 5 8 7\nf 1 6 2\nf 1 5 6
f 2 7 3\nf 2 6 7\nf 3 8 4\nf 3 7 8\nf 4 5 1\nf 4 8 5\n"""


def scene(guide, scale, body, ball_m, is_hit):
    made = {
        "version": 1, "name": "mould", "duration_s": 5 if is_hit else 10, "frame_rate": 30,
        "materials": {"ground": {"friction": 0.7},
                      "wood": {"restitution": 0, "friction": 0.5, "density_kg_m3": 600},
                      "iron": {"restitution": 0.1, "friction": 0.5, "density_kg_m3": 7800}},
        "shapes": {"ground": {"type": "plane"}, "body": body,
                   "ball": {"type": "sphere", "radius": ball_m}},
        "bodies": [{"shape": "ground", "material": "ground", "role": "static"}],
        "emitters": [{"name": "pile", "type": "mould", "shape": "body", "material": "wood"}],
        "guide": {"file": str(guide), "scale": scale},
    }
    if is_hit:
        made["emitters"].append(
            {"name": "ball", "type": "stream", "shape": "ball", "material": "iron", "count": 1,
             "rate_hz": 1, "start_s": 1, "position": [-4, 0.7, 0.02],
             "linear_velocity": [14, 1.5, 0]})
    return made


def cpu_s():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def run(options, guide, scale, body, seed, ball_m=0.2, is_hit=False):
    with tempfile.TemporaryDirectory() as directory:
        file = Path(directory, "scene.json")
        file.write_text(json.dumps(scene(guide, scale, body, ball_m, is_hit)))
        start = cpu_s()
        sets = [part for override in options.set for part in ("--set", override)]
        subprocess.run([options.pilesim, "direct-pile", file, "-o", directory + "/out", "--quiet",
                        "--seed", str(seed), *sets], check=True)
        spent = cpu_s() - start
        frames = json.loads(Path(directory, "out/guide.json").read_text())["frames"]
        report = json.loads(Path(directory, "out/report.json").read_text())
        return frames, report["piles"]["guide"], report, spent


def goal(text, reached):
    return text if reached else text + " !"


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pilesim")
    parser.add_argument("shapes", nargs="*", default=SHAPES)
    parser.add_argument("--bodies", default=",".join(BODIES))
    parser.add_argument("--seeds", default="1,2,3")
    parser.add_argument("--set", action="append", default=[], help="override in every run")
    options = parser.parse_args()
    row("Guide", "Bodies", "Seed", "Number", "Packing", "Inside after 10 s", "Mean and largest drift",
        "Overlap", "Glue, weights", "Pairs, contacts glued", "Local rule", "Hit: height", "CPU")
    for name in options.bodies.split(","):
        body = BODIES[name]
        with tempfile.TemporaryDirectory() as directory:
            box = Path(directory, "box.obj")
            box.write_text(BOX)
            figures = run(options, box, 1, body, 1)[1]
            row("a box", name, "1", str(figures["filling"]["kept"]),
                "%.0f %%" % (100 * figures["filling"]["volume_share"]), *[""] * 8)
        for shape in options.shapes:
            guide = OTHERS.get(shape, (ASSETS / "guides" / (shape + ".obj"), 1))
            for seed in map(int, options.seeds.split(",")):
                frames, figures, report, spent = run(options, *guide, body, seed)
                filling, glue, last = figures["filling"], figures["glue_needed"], frames[-1]
                height = frames[0]["height_m"]
                hit = run(options, *guide, body, seed, BALLS.get(shape, 0.2), True)[0]
                # The ball is part of no pile, but counts until it has rolled away: its height is no more.
                left = min(frame["height_m"] for frame in hit[len(hit) // 2:]) / hit[0]["height_m"]
                kept = last["in_guide"] / filling["kept"]
                drift, most = last["mean_drift_m"] / height, last["largest_drift_m"] / height
                overlap = report["quality_at_end"]["deepest_penetration_diameters"]
                judged = last["passed"] + last["filtered"] + last["failed"]
                row(shape, name, str(seed), str(filling["kept"]),
                    "%.0f %%" % (100 * filling["volume_share"]),
                    goal("%.0f %%" % (100 * kept), kept >= 0.95),
                    goal("%.2f, %.1f %%" % (100 * drift, 100 * most), drift < 0.01),
                    goal("%.3f D" % overlap, overlap <= 0.02),
                    "%.2f" % glue["weights"],
                    "%d, %d of %d" % (glue["pairs"], glue["glued_contacts"], glue["contacts"]),
                    "%.0f %%" % (100 * last["passed"] / max(1, judged)),
                    goal("%.0f %%" % (100 * left), left < 0.6), "%.1f s" % spent)


main()
