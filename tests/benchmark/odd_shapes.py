#!/usr/bin/env python3
"""Shapes and guides that nothing was tuned on, made here.

    tests/benchmark/odd_shapes.py build/release/commands/pilesim piles [--seeds 1,2,3]
    tests/benchmark/odd_shapes.py build/release/commands/pilesim guides [--seeds 1,2,3]

`piles`: 200 of each poured on the ground, in the scene that `pilesim new pile` writes. `guides`: an S
of strokes of 0.3 m filled with boxes of three sizes, and a star embedded in the ground.
"""
import argparse
import json
import math
import subprocess
import tempfile
from pathlib import Path

from guide_table import row


def obj(path, vertices, faces):
    path.write_text("".join("v %.6f %.6f %.6f\n" % tuple(v) for v in vertices) +
                    "".join("f %s\n" % " ".join(str(i + 1) for i in face) for face in faces))


def extruded(path, outline, thickness, standing=False):
    """An outline in x and z, or standing in x and y; counter-clockwise from above, or from the front."""
    n = len(outline)
    low = [(x, -thickness / 2, z) for x, z in outline]
    high = [(x, thickness / 2, z) for x, z in outline]
    vertices = [(x, z, y) if standing else (x, y, z) for x, y, z in low + high]
    faces = [range(n), range(2 * n - 1, n - 1, -1)]
    faces += [(i, n + i, n + (i + 1) % n, (i + 1) % n) for i in range(n)]
    obj(path, vertices, [face[::-1] for face in faces] if standing else faces)


def revolved(path, profile, corners):
    """About y; of radius and height, from the bottom up, both ends on the axis or close to it."""
    m = len(profile)
    around = [2 * math.pi * k / corners for k in range(corners)]
    vertices = [(r * math.cos(a), y, r * math.sin(a)) for a in around for r, y in profile]
    faces = [(k * m + i, k * m + i + 1, (k + 1) % corners * m + i + 1, (k + 1) % corners * m + i)
             for k in range(corners) for i in range(m - 1)]
    faces += [[k * m for k in range(corners)], [k * m + m - 1 for k in reversed(range(corners))]]
    obj(path, vertices, faces)


def star(radius, inner):
    tips = [(radius if k % 2 == 0 else inner, math.pi * k / 5) for k in range(10)]
    return [(r * math.cos(a), r * math.sin(a)) for r, a in tips]


def gear():
    teeth = [(a + da, r) for a in (math.pi * k / 6 for k in range(12))
             for da, r in ((-0.12, 0.08), (-0.07, 0.1), (0.07, 0.1), (0.12, 0.08))]
    return [(r * math.cos(a), r * math.sin(a)) for a, r in teeth]


def write_bodies(directory):
    d, w = 0.08, 0.02
    extruded(directory / "u_profile.obj", [(-d, -0.05), (d, -0.05), (d, 0.05), (d - w, 0.05), (d - w, -0.03),
                                           (w - d, -0.03), (w - d, 0.05), (-d, 0.05)], 0.16)
    extruded(directory / "star.obj", star(0.1, 0.045), 0.05)
    extruded(directory / "wedge.obj", [(0, 0), (0.2, 0), (0, 0.08)], 0.1)
    extruded(directory / "gear.obj", gear(), 0.03)
    extruded(directory / "plank.obj", [(0, 0), (0.3, 0), (0.3, 0.2), (0, 0.2)], 0.004)
    revolved(directory / "bottle.obj", [(0.03, 0), (0.045, 0.02), (0.045, 0.18), (0.016, 0.24), (0.016, 0.3)], 16)
    return sorted(path.stem for path in directory.glob("*.obj"))


def run(pilesim, command, scene, out, seed, *overrides):
    sets = [word for override in overrides for word in ("--set", override)]
    subprocess.run([pilesim, command, scene, "-o", out, "--force", "-q", "--seed", str(seed), *sets], check=True)
    return json.loads((out / "report.json").read_text())


def piles(options, work):
    row("Shape", "Seed", "Penetration, D", "Unsettled", "Floating", "Escaped")
    for name in write_bodies(work):
        scene = work / (name + ".json")
        subprocess.run([options.pilesim, "new", "pile", work / (name + ".obj"), "--count", "200", "-o", scene, "-q"],
                       check=True)
        for seed in options.seeds.split(","):
            end = run(options.pilesim, "simulate", scene, work / "out", seed)["quality_at_end"]
            row(name, seed, "%.4f" % end["deepest_penetration_diameters"],
                *(str(end[key]) for key in ("unsettled", "floating", "escaped")))


def guide_scene(guide, edge):
    return {
        "version": 1, "name": "odd guide", "duration_s": 3, "frame_rate": 30,
        "materials": {"wood": {"restitution": 0, "friction": 0.5, "density_kg_m3": 600}},
        "shapes": {"ground": {"type": "plane"}, "box": {"type": "box", "size": [edge] * 3}},
        "bodies": [{"shape": "ground", "material": "wood", "role": "static"}],
        "emitters": [{"name": "pile", "type": "mould", "shape": "box", "material": "wood"}],
        "guide": {"file": guide},
    }


def guides(options, work):
    extruded(work / "s.obj", [(0, 0), (1, 0), (1, 1.1), (0.3, 1.1), (0.3, 1.6), (1, 1.6), (1, 1.9), (0, 1.9),
                              (0, 0.8), (0.7, 0.8), (0.7, 0.3), (0, 0.3)], 0.5, standing=True)
    outline = [(x, z + 0.656) for x, z in star(0.8, 0.36)]  # its feet are 0.1 m below the ground
    extruded(work / "sunk_star.obj", outline, 0.5, standing=True)
    row("Guide", "Boxes of, m", "Seed", "Bodies", "Left out as they hang", "Inside after 3 s", "Penetration, D")
    for name, edge in (("s", 0.13), ("s", 0.1), ("s", 0.07), ("sunk_star", 0.13)):
        scene = work / "scene.json"
        scene.write_text(json.dumps(guide_scene(name + ".obj", edge)))
        for seed in options.seeds.split(","):
            report = run(options.pilesim, "direct-pile", scene, work / "out", seed)
            guide = report["piles"]["guide"]
            row(name, str(edge), seed, str(guide["filling"]["kept"]), str(guide["filling"]["hanging"]),
                "%.0f %%" % (100 * guide["bodies_inside"]),
                "%.4f" % report["quality_at_end"]["deepest_penetration_diameters"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pilesim", type=lambda text: Path(text).resolve())
    parser.add_argument("what", choices=["piles", "guides"])
    parser.add_argument("--seeds", default="1,2,3")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        {"piles": piles, "guides": guides}[options.what](options, Path(directory))


main()
