"""Makes scenes, runs them and hands back poses, reports and pictures as numpy, by calling pilesim.

    import pilesim

    scene = pilesim.new("bin", "mug.obj", count=40)      # or any dictionary: docs/scene.md
    scene["materials"]["body"]["friction"] = 0.2
    run = pilesim.simulate(scene, "out/mugs", seed=7)
    run.position[-1]                                     # (bodies, 3), m, at the end
    run.report["quality_at_end"]
    picture = run.picture(size=(640, 360))               # (360, 640, 3), uint8

The program is the one that the variable PILESIM names, else `pilesim` of the PATH. It checks every scene
itself: errors name the place in the scene and the remedy. Needs numpy and zarr.
"""

from __future__ import annotations

import functools
import json
import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any, Mapping, Sequence, Union

import numpy
import zarr

from pilesim_batch import read_png

__all__ = ["PilesimError", "Run", "check", "new", "schema", "simulate"]

Scene = Mapping[str, Any]
PathLike = Union[str, "os.PathLike[str]"]

_PRESENT = 1  # bit of a body's state


class PilesimError(RuntimeError):
    """The program has refused or failed. `code` is its exit code: 2 usage, 3 scene or input, 4 files, 5 gates."""

    def __init__(self, code: int, text: str):
        super().__init__(text)
        self.code = code


def _json(value: Any, name: str) -> str:
    """JSON of a value that may hold numbers and arrays of numpy."""

    def plain(part: Any) -> Any:
        if isinstance(part, (numpy.generic, numpy.ndarray)):
            return part.tolist()
        if isinstance(part, os.PathLike):
            return os.fspath(part)
        raise TypeError(f"{name} holds a {type(part).__name__}, {part!r}; expected numbers, text, lists, "
                        "dictionaries, arrays of numpy")

    return json.dumps(value, default=plain)


def _call(*arguments: object, scene: Scene | None = None) -> str:
    program = os.environ.get("PILESIM", "pilesim")
    text = None if scene is None else _json(scene, "the scene")
    try:
        result = subprocess.run(
            [program, *map(str, arguments)], input=text, stdin=subprocess.DEVNULL if text is None else None,
            capture_output=True, text=True, check=False)
    except OSError as error:
        raise PilesimError(4, f'the program "{program}" cannot be started: {error.strerror}. Put pilesim on the PATH, '
                              "or name its file in the variable PILESIM") from None
    if result.returncode != 0:
        raise PilesimError(result.returncode, result.stderr.strip())
    return result.stdout


def _scene_options(seed: int | None, values: Mapping[str, Any] | None) -> list[str]:
    options = [] if seed is None else ["--seed", str(seed)]
    for pointer, value in (values or {}).items():
        options += ["--set", f"{pointer}={_json(value, f'the value of {pointer}')}"]
    return options


def schema() -> dict[str, Any]:
    """The JSON Schema of scenes."""
    return json.loads(_call("schema"))


def check(scene: Scene, *, seed: int | None = None, values: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """The scene with every default written out. Raises PilesimError with all that is wrong. Paths in it are
    relative to the working directory."""
    return json.loads(_call("validate", "-", "--print-config", *_scene_options(seed, values), scene=scene))


def new(kind: str, mesh: PathLike, *, count: int | None = None, scale: float | None = None,
        up: str | None = None) -> dict[str, Any]:
    """A scene to start from, sized to a mesh: kind is "pile" or "bin"."""
    if kind not in ("pile", "bin"):
        raise ValueError(f'kind is "{kind}"; expected "pile" or "bin"')
    options = [word for name, value in (("--count", count), ("--scale", scale), ("--up", up)) if value is not None
               for word in (name, value)]
    with tempfile.TemporaryDirectory() as directory:
        file = Path(directory) / "scene.json"
        _call("new", kind, Path(mesh).absolute(), "-o", file, "-q", *options)
        return json.loads(_call("validate", file, "--print-config"))


def simulate(scene: Scene | PathLike, output: PathLike, *, seed: int | None = None,
             values: Mapping[str, Any] | None = None, direct_piles: bool = False, force: bool = False,
             options: Sequence[str] = ()) -> "Run":
    """Runs a scene, a dictionary or a file, into the directory `output`. `values` are overrides such as
    {"/duration_s": 2}; `options` are others of the command line. `direct_piles`: as `pilesim direct-pile`.
    Raises PilesimError."""
    is_file = isinstance(scene, (str, os.PathLike))
    _call("direct-pile" if direct_piles else "simulate", scene if is_file else "-", "-o", output, "-q",
          *_scene_options(seed, values), *(["--force"] if force else []), *options,
          scene=None if is_file else scene)
    return Run(output)


class Run:
    """What `pilesim simulate` wrote. Arrays are read when they are first asked for."""

    def __init__(self, directory: PathLike):
        self.directory = Path(directory)
        if not (self.directory / "trajectory.zarr").is_dir():
            raise PilesimError(4, f"{self.directory}: holds no trajectory.zarr; expected the directory of a run, as "
                                  "pilesim.simulate(scene, directory) makes it")
        self._store = zarr.open(str(self.directory / "trajectory.zarr"), mode="r")

    @property
    def names(self) -> list[str]:
        """Of the bodies, in the order of all arrays."""
        return list(self._store.attrs["body_name"])

    @functools.cached_property
    def report(self) -> dict[str, Any]:
        """report.json."""
        file = self.directory / "report.json"
        if not file.is_file():
            raise PilesimError(4, f"{file}: is not there: the run has not ended. Go on with it: "
                                  "pilesim.simulate(scene, directory, options=[\"--resume\"])")
        return json.loads(file.read_text())

    @functools.cached_property
    def position(self) -> numpy.ndarray:
        """Centres of mass, m, y up: (frames, bodies, 3)."""
        return self._store["position"][:]

    @functools.cached_property
    def orientation(self) -> numpy.ndarray:
        """Unit quaternions w, x, y, z from body to world: (frames, bodies, 4)."""
        return self._store["orientation"][:]

    @functools.cached_property
    def present(self) -> numpy.ndarray:
        """Which bodies are there: (frames, bodies), bool."""
        return (self._store["state"][:] & _PRESENT) != 0

    @functools.cached_property
    def moves(self) -> numpy.ndarray:
        """Which bodies are not fixed: (bodies), bool."""
        return self._store["body_moves"][:] != 0

    @functools.cached_property
    def time_s(self) -> numpy.ndarray:
        """Of the frames."""
        return numpy.arange(len(self.position)) / self._store.attrs["frame_rate"]

    def picture(self, frame: int | str = "last", *, size: tuple[int, int] = (960, 540),
                options: Sequence[str] = ()) -> numpy.ndarray:
        """One frame, drawn: (height, width, 3), uint8. `options` are others of `pilesim render`."""
        return self.pictures(str(frame), size=size, options=options)[0]

    def pictures(self, frames: str | None = None, *, size: tuple[int, int] = (960, 540),
                 options: Sequence[str] = ()) -> numpy.ndarray:
        """Frames as `pilesim render --frames` names them, drawn: (pictures, height, width, 3), uint8. With
        options=["--orbit", "6s"] the last frame, turned. Raises ValueError for options that draw elsewhere:
        --camera."""
        chosen = [] if frames is None else ["--frames", frames]
        with tempfile.TemporaryDirectory() as directory:
            _call("render", self.directory, "-o", directory, "--no-video", "-q",
                  "--size", f"{size[0]}x{size[1]}", *chosen, *options)
            files = sorted(Path(directory).glob("frames/frame.*.png"), key=lambda file: int(file.name.split(".")[1]))
            if not files:
                raise ValueError(f"options {list(options)} draw into no frames/; expected options other than --camera")
            return numpy.stack([read_png(file) for file in files])
