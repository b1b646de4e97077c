"""Commands that are killed or run out of space: each command of pilesim on a scene of a second, and its inputs."""

import copy
import dataclasses
import json
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "cli"))
import support  # noqa: E402
from support import BOX_OBJ, BOXES  # noqa: E402

PILESIM = str(Path(support.PILESIM).resolve())
SOURCE = support.SOURCE.resolve()

QUICK = ["--trials", "4", "--exemplars", "2", "--no-accuracy", "--pours", "0"]
# Files of the user, in the way of everything that is replaced; they must never be changed.
OWN_FILES = {
    "out/notes.txt": "years of work",
    "out/frames/frame.cover.png": "mine",
    "out/.pilesim.notes.tmp": "mine, too",
    "out/trajectory.zarr.old/.zattrs": "{}",
}


@dataclasses.dataclass
class Case:
    name: str
    command: list[str]  # with what brings it to its end after an accident
    prepare: Callable  # (place): writes the inputs
    gnuplot: bool = False  # charts take longer than all the rest
    earlier: list[str] | None = None  # writes older results, which `command` then replaces

    @property
    def subcommand(self):
        return self.command[0]


def environment(place, gnuplot=False):
    """Environment of pilesim: a cache of the case's own; without gnuplot, whose absence costs charts only."""
    tools = place.parent / "tools"
    tools.mkdir(exist_ok=True)
    if not (tools / "ffmpeg").exists() and shutil.which("ffmpeg"):
        (tools / "ffmpeg").symlink_to(shutil.which("ffmpeg"))
    variables = {**os.environ, "XDG_CACHE_HOME": str(place / "cache")}
    variables["MESA_SHADER_CACHE_DISABLE"] = variables["MESA_GLSL_CACHE_DISABLE"] = "true"
    if not gnuplot:
        variables["PATH"] = str(tools)
    return variables


def succeed(place, *arguments, gnuplot=False):
    result = subprocess.run(
        [PILESIM, *map(str, arguments)],
        cwd=place,
        env=environment(place, gnuplot),
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    if result.returncode != 0:
        raise RuntimeError(f"{arguments}: exit {result.returncode}: {result.stderr}")


def scene(place, change=None, name="scene.json"):
    document = copy.deepcopy(BOXES)
    # More frames than a chunk of the trajectory holds.
    document.update(frame_rate=240, duration_s=1.25)
    if change:
        change(document)
    (place / name).write_text(json.dumps(document))


def sampled_box(place):
    """box.obj with its signature, measured once."""
    shutil.copy(SOURCE / "assets/box.obj", place / "box.obj")
    kept = place.parent / "box.sig"
    if not kept.exists():
        succeed(place, "sample-signature", "box.obj", "-o", kept, "--restitution", "0.2",
                "--friction", "0.6", *QUICK[:-1], "1")
    shutil.copy(kept, place / "box.sig")


def simulate_impulse(place):
    def change(document):
        shutil.copy(SOURCE / "assets/l_shape.obj", place)
        document["shapes"]["box"] = {
            "type": "mesh",
            "file": "l_shape.obj",
            "collision": "decomposition",
        }

    scene(place, change)


def spheres(mode):
    def prepare(place):
        def change(document):
            sampled_box(place)
            document["shapes"]["box"] = {"type": "mesh", "file": "box.obj", "signature": "box.sig"}
            document["simulator"] = {"mode": mode}

        scene(place, change)

    return prepare


def batch(place):
    def change(document):
        document.update(frame_rate=30, duration_s=0.5)
        document["cameras"] = [{"name": "views", "random_views": {
            "count": 1, "target": [0, 0, 0], "distance_m": [2, 3], "elevation_deg": [40, 80]}}]

    scene(place, change)
    (place / "plan.json").write_text(json.dumps({
        "version": 1, "scene": "scene.json", "count": 2, "collect": ["coco", "bop", "tar"], "tar_jobs": 2,
        "steps": [["simulate"], ["render", "--frames", "last", "--camera", "views", "--no-video", "--passes",
                                 "depth,ids", "--annotations", "coco,bop"]]}))


def repose(place):
    scene(place, lambda document: document.update(piles=[{"angle_deg": 35, "centre": [0, 0]}]))


def guide(place):
    (place / "guide.obj").write_text(BOX_OBJ)

    def change(document):
        document["guide"] = {"file": "guide.obj", "hold": "freeze"}
        document["emitters"] = [
            {
                "name": "boxes",
                "type": "upside_down",
                "shape": "box",
                "material": "wood",
                "count": 6,
                "rate_hz": 20,
            }
        ]

    scene(place, change)


def trajectory(place):
    scene(place, lambda document: document.update(frame_rate=20, duration_s=1))
    succeed(place, "simulate", "scene.json", "-o", "run")


def comparison(place):
    scene(place, lambda document: document.update(duration_s=0.2))


def box(place):
    shutil.copy(SOURCE / "assets/box.obj", place)


def partial_signature(place):
    """An interrupted measurement, taken once."""
    box(place)
    kept = place.parent / "a.sig.partial"
    if not kept.exists():
        at_once = support.failing_disk(place, RESUMED[0], signal.SIGINT, 0)
        subprocess.run([PILESIM, *RESUMED], cwd=place, env=environment(place) | at_once,
                       stdin=subprocess.DEVNULL, capture_output=True, check=False)
        shutil.move(place / "a.sig.partial", kept)
    shutil.copy(kept, place / "a.sig.partial")


RESUMED = ["sample-signature", "box.obj", "-o", "a.sig", "--trials", "60", "--exemplars", "2",
           "--no-accuracy", "--pours", "0"]
SIMULATE = ["simulate", "scene.json", "-o", "out", "--force"]
PILE = ["direct-pile", "scene.json", "-o", "out", "--force"]
RENDER = ["render", "run", "-o", "out", "--force", "--size", "96x64"]
# A checkpoint after every frame, so that most kills come between one and the next.
RESUME = ["-o", "out", "--resume", "--checkpoint", "0"]
COMPARE = ["compare", "scene.json", "-o", "out", "--runs", "3", "--reference", "impulse",
           "--modes", "impulse@1/120"]
SEED = ["--seed", "8"]

CASES = [
    Case("simulate impulse", SIMULATE, simulate_impulse, earlier=SIMULATE + SEED),
    Case("simulate statistical", SIMULATE, spheres("statistical"), earlier=SIMULATE + SEED),
    Case("simulate mixed", SIMULATE, spheres("mixed"), earlier=SIMULATE + SEED),
    Case("simulate with charts", SIMULATE, scene, gnuplot=True),
    Case("direct-pile repose", PILE, repose, earlier=PILE + SEED),
    Case("direct-pile guide", PILE, guide, earlier=PILE + SEED),
    Case("simulate impulse resumed", ["simulate", "scene.json", *RESUME], simulate_impulse),
    Case("simulate statistical resumed", ["simulate", "scene.json", *RESUME],
         spheres("statistical")),
    Case("simulate mixed resumed", ["simulate", "scene.json", *RESUME], spheres("mixed")),
    Case("direct-pile repose resumed", ["direct-pile", "scene.json", *RESUME], repose),
    Case("direct-pile guide resumed", ["direct-pile", "scene.json", *RESUME], guide),
    Case("render resumed", ["render", "run", "-o", "out", "--resume", "--size", "96x64"],
         trajectory),
    Case("render pictures", [*RENDER, "--no-video"], trajectory,
         earlier=[*RENDER, "--no-video", "--frames", "15-", "--samples", "2"]),
    Case("render video", RENDER, trajectory, earlier=[*RENDER, "--samples", "2"]),
    Case("render sheet", [*RENDER, "--sheet", "3x2"], trajectory),
    Case("export usda", ["export", "run", "-o", "out.usda", "--force"], trajectory,
         earlier=["export", "run", "-o", "out.usda", "--every", "3"]),
    Case("export glb", ["export", "run", "-o", "out.glb", "--force"], trajectory),
    Case("export blender", ["export", "run", "-o", "out.py", "--force"], trajectory,
         earlier=["export", "run", "-o", "out.py", "--every", "3"]),
    Case("batch", ["batch", "plan.json", "-o", "out", "-q"], batch),
    Case("compare", [*COMPARE, "--force"], comparison, earlier=[*COMPARE, "--force", *SEED]),
    Case("compare resumed", [*COMPARE, "--resume"], comparison),
    Case("compare with charts", [*COMPARE, "--resume"], comparison, gnuplot=True),
    Case("sample-signature", ["sample-signature", "box.obj", "-o", "a.sig", "--rest-drops", "10",
                              "--force", *QUICK], box,
         earlier=["sample-signature", "box.obj", "-o", "a.sig", "--force", *QUICK, *SEED]),
    Case("sample-signature resumed", [*RESUMED, "--threads", "2"], partial_signature),
    Case("fit-bspline", ["fit-bspline", "box.sig", "-o", "fit.sig", "--plot", "plots", "--force"],
         sampled_box, gnuplot=True),
    Case("inspect", ["inspect", "box.sig", "--plot", "plots", "--force"], sampled_box,
         gnuplot=True),
]
