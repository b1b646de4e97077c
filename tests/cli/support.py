"""Shared by the command-line tests: running the program, small scenes, scratch directories."""

import copy
import json
import os
import shutil
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

PILESIM = os.environ["PILESIM"]
SOURCE = Path(os.environ["PILESIM_SOURCE"])
FAILING_DISK = Path(os.environ["FAILING_DISK"]).resolve()

# Seconds after which a program counts as hanging. Nothing is judged by it.
HANGING = 600

BOXES = {
    "version": 1,
    "name": "boxes",
    "seed": 3,
    "duration_s": 0.5,
    "frame_rate": 30,
    "materials": {"wood": {"restitution": 0.2, "friction": 0.6, "density_kg_m3": 700}},
    "shapes": {"ground": {"type": "plane"}, "box": {"type": "box", "size": [0.2, 0.2, 0.2]}},
    "bodies": [{"name": "ground", "shape": "ground", "material": "wood", "role": "static"}],
    "emitters": [
        {
            "name": "boxes",
            "type": "grid",
            "shape": "box",
            "material": "wood",
            "centre": [0, 1, 0],
            "count": [2, 2, 2],
            "spacing": [0.5, 0.5, 0.5],
        }
    ],
    "render": {"size": [64, 48], "samples": 1},
}

# A box that stands on the ground, 0.8 m wide: a guide.
BOX_OBJ = """v -0.4 0 -0.4
v 0.4 0 -0.4
v 0.4 0 0.4
v -0.4 0 0.4
v -0.4 0.9 -0.4
v 0.4 0.9 -0.4
v 0.4 0.9 0.4
v -0.4 0.9 0.4
f 1 2 3 4
f 8 7 6 5
f 1 5 6 2
f 2 6 7 3
f 3 7 8 4
f 4 8 5 1
"""


class CommandTest(unittest.TestCase):
    maxDiff = None

    def setUp(self):
        self.dir = Path(tempfile.mkdtemp(prefix="pilesim-test-"))
        self.addCleanup(shutil.rmtree, self.dir, ignore_errors=True)

    def run_pilesim(self, *arguments, **options):
        return subprocess.run(
            [PILESIM, *map(str, arguments)],
            cwd=options.pop("cwd", self.dir),
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=HANGING,
            **options,
        )

    def succeed(self, *arguments, **options):
        result = self.run_pilesim(*arguments, **options)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def expect_exit(self, code, *arguments, **options):
        result = self.run_pilesim(*arguments, **options)
        self.assertEqual(result.returncode, code, result.stderr)
        return result

    def wait_until(self, process, condition):
        """Returns once `condition()` holds, which it must do before `process` ends: one that never
        ends by itself, or that waits. Looks again and again, without a limit; CTest has one."""
        while not condition():
            self.assertIsNone(process.poll(), "the program ended before")
            time.sleep(0.005)

    def at_change(self, subcommand, fault, number, name="", under=None):
        """The environment of a pilesim that `fault`, "kill" or a signal, strikes before its `number`th
        change of files below `under`, of those whose paths end with `name`. At 0: as soon as it
        handles the signal."""
        return os.environ | failing_disk(under or self.dir, subcommand, fault, number, name)

    def write_scene(self, change=None, name="scene.json"):
        """Writes BOXES, after `change(scene)`, and returns its path relative to self.dir."""
        scene = copy.deepcopy(BOXES)
        if change:
            change(scene)
        (self.dir / name).write_text(json.dumps(scene, indent=2))
        return name


def endless(scene):
    """Nearly as many frames as a scene may have, at its 30 a second: who runs it ends it."""
    scene["duration_s"] = 3e5
    scene["simulator"] = {"sleeping": False}


def failing_disk(under, subcommand, fault, number, name="", log="/dev/null"):
    """Variables that preload failing_disk.cpp, which says what they are."""
    return {
        "LD_PRELOAD": str(FAILING_DISK),
        # It comes before the sanitizer's library.
        "ASAN_OPTIONS": os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0",
        "FAILING_DISK_UNDER": str(Path(under).resolve()),
        "FAILING_DISK_NAME": name,
        "FAILING_DISK_COMMAND": subcommand,
        "FAILING_DISK_LOG": str(log),
        "FAILING_DISK_AT": str(number),
        "FAILING_DISK_FAULT": str(int(fault) if isinstance(fault, int) else fault),
    }


def wait_until_stopped(process):
    """Returns once SIGSTOP has stopped `process`; False where it has ended instead."""
    state = os.waitid(os.P_PID, process.pid, os.WSTOPPED | os.WEXITED | os.WNOWAIT)
    return state.si_code == os.CLD_STOPPED


def stop(pid):
    """Returns when all its threads stand: until then they go on, and take other signals first."""
    os.kill(pid, signal.SIGSTOP)
    threads = list(Path(f"/proc/{pid}/task").iterdir())
    while any("State:\tT" not in (thread / "status").read_text() for thread in threads):
        time.sleep(0.001)


def tree_bytes(directory):
    """Relative path -> bytes of every file below `directory`."""
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in sorted(Path(directory).rglob("*"))
        if path.is_file()
    }
