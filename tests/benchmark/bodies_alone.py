#!/usr/bin/env python3
"""How far bodies alone go in the statistical mode, against the impulse mode, and how they spin after a hit.

    bodies_alone.py PILESIM DIRECTORY SHAPE ...

DIRECTORY: of shape_benchmark, with SHAPE.obj and SHAPE.sig. Results stay in DIRECTORY/alone.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy

STARTS = {"dropped": (1.0, 0.0), "pushed": (0.4, 1.5), "thrown": (1.0, 3.0)}  # height m, sideways m/s
RATE_HZ = 60


def scene(mesh, mode, height_m, velocity, gravity, duration_s):
    shape = {"type": "mesh", "file": str(mesh), "collision": "decomposition"}
    if mode == "statistical":
        shape["signature"] = str(mesh.with_suffix(".sig"))
    return {
        "version": 1,
        "name": "alone",
        "duration_s": duration_s,
        "frame_rate": RATE_HZ,
        "step_s": 1 / RATE_HZ if mode == "statistical" else 1 / 240,
        "gravity": [0, -gravity, 0],
        "simulator": {"mode": mode},
        "materials": {"stuff": {"restitution": 0.25, "friction": 0.5, "density_kg_m3": 500}},
        "shapes": {"ground": {"type": "plane"}, "body": shape},
        "bodies": [{"name": "ground", "shape": "ground", "material": "stuff", "role": "static"}],
        "emitters": [
            {
                "type": "grid",
                "name": "bodies",
                "shape": "body",
                "material": "stuff",
                "centre": [0, height_m, 0],
                "count": [12, 1, 12],
                "spacing": [30, 1, 30],
                "linear_velocity": velocity,
                "angular_velocity_jitter": 2 if gravity else 0.001,
            }
        ],
    }


def run(pilesim, directory, **options):
    """Positions (frames, bodies, 3) and orientations (frames, bodies, w x y z)."""
    directory.mkdir(parents=True, exist_ok=True)
    file = directory / "scene.json"
    file.write_text(json.dumps(scene(**options)))
    out = directory / "out"
    subprocess.run([pilesim, "simulate", file, "-o", out, "--force", "--quiet"], check=True)
    subprocess.run([pilesim, "export", out, "-o", directory / "out.npz", "--force", "--quiet"], check=True)
    states = numpy.load(directory / "out.npz")
    return states["position"][:, -144:], states["orientation"][:, -144:]


def spin(orientation):
    """rad/s, of the last two frames."""
    cosine = numpy.abs((orientation[-1] * orientation[-2]).sum(1)).clip(0, 1)
    return 2 * numpy.arccos(cosine) * RATE_HZ


def main(pilesim, directory, *shapes):
    directory = Path(directory).resolve()
    for shape in shapes:
        mesh, place = directory / f"{shape}.obj", directory / "alone"
        for name, (height_m, sideways) in STARTS.items():
            ways = {}
            for mode in ("impulse", "statistical"):
                position, _ = run(
                    pilesim, place, mesh=mesh, mode=mode, height_m=height_m, velocity=[sideways, 0, 0], gravity=9.81, duration_s=5
                )
                way = (position[-1] - position[0])[:, [0, 2]]
                ways[mode] = numpy.hypot(way[:, 0], way[:, 1])
            exact, drawn = ways["impulse"], ways["statistical"]
            print(
                f"{shape:12} {name:8} {exact.mean():.3f} +- {exact.std() / 12:.3f} m, statistical {drawn.mean():.3f} m, "
                f"{100 * (drawn.mean() / exact.mean() - 1):+.0f} %",
                flush=True,
            )
        for mode in ("impulse", "statistical"):
            position, orientation = run(
                pilesim, place, mesh=mesh, mode=mode, height_m=1, velocity=[0, -4, 0], gravity=0, duration_s=1
            )
            leaves = (position[-1] - position[-2]) * RATE_HZ
            print(
                f"{shape:12} after a hit at 4 m/s without gravity, {mode}: sideways "
                f"{numpy.hypot(leaves[:, 0], leaves[:, 2]).mean():.2f} m/s, up {leaves[:, 1].mean():.2f} m/s, "
                f"spin {spin(orientation).mean():.1f} rad/s",
                flush=True,
            )


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
