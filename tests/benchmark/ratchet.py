#!/usr/bin/python3
"""Counts the instructions of small runs, each on one thread under valgrind's callgrind, and compares them
with instructions.txt beside this file. More than 3 % above fails and names the run; less rewrites the
file, which is then committed with the change that made it so.

    tests/benchmark/ratchet.py build/release/commands/pilesim            # all runs
    tests/benchmark/ratchet.py build/release/commands/pilesim glue rays  # these
    tests/benchmark/ratchet.py build/release/commands/pilesim --renew    # takes the counts as they are

Counts depend on the compiler and on the versions of libraries, those of `render` also on what Mesa makes
of the processor; not on the machine's speed. Valgrind 3.19 does not know all
instructions that the compiler may choose: a run that has one is said and not counted."""

import argparse
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SCENES = ROOT / "tests/determinism/scenes"
COUNTS = Path(__file__).with_name("instructions.txt")
MOST_MORE, NOTED_LESS = 0.03, 0.01

# A closed box, and another that it overlaps: not a solid, so that it is wrapped.
CUBE_FACES = ((1, 2, 3, 4), (8, 7, 6, 5), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 8, 4), (4, 8, 5, 1))


def two_boxes():
    text = ""
    for shift in (0, 0.6):
        for y in (0, 1):
            for x, z in ((0, 0), (1, 0), (1, 1), (0, 1)):
                text += f"v {x + shift} {y + shift} {z + shift}\n"
    for first in (0, 8):
        for face in CUBE_FACES:
            text += "f " + " ".join(str(first + corner) for corner in face) + "\n"
    return text


def scene_of(place, shape, **more):
    scene = {"version": 1, "duration_s": 0.1, "materials": {"wood": {}}, "shapes": {"it": shape},
             "bodies": [{"shape": "it", "material": "wood"}], **more}
    (place / "scene.json").write_text(json.dumps(scene))
    return "scene.json"


SIGNATURE = ("sample-signature", ROOT / "assets/l_shape.obj", "-o", "l_shape.sig", "--trials", "4", "--exemplars", "2",
             "--no-accuracy", "--pours", "1")
SIGNED = ("--set", '/shapes/l_shape/signature="{place}/l_shape.sig"')
RUN = ("-o", "run", "--no-picture", "--checkpoint", "1e9")
SHORT = ("--set", "/duration_s=0.5")
POURED = ("simulate", SCENES / "spheres.json", *RUN, "--set", '/simulator/mode="particle"',
          "--set", "/emitters/0/count=[7,7,7]")
PIECES = ("simulate", SCENES / "pieces.json", *RUN, *SHORT)


def wrap(place):
    (place / "two.obj").write_text(two_boxes())
    return ("validate", scene_of(place, {"type": "mesh", "file": "two.obj"}))


def decomposition(place):
    return ("validate", scene_of(place, {"type": "mesh", "file": str(ROOT / "assets/biped_50.obj"),
                                         "collision": "decomposition", "decomposition_max_pieces": 6}))


# By name: what is run before, and what is counted, or a function of the directory that gives it.
RUNS = {
    "impulse": ([], ("simulate", SCENES / "hulls.json", *RUN, *SHORT)),
    "statistical": ([SIGNATURE], ("simulate", SCENES / "spheres.json", *RUN, *SIGNED, *SHORT)),
    "mixed": ([SIGNATURE], ("simulate", SCENES / "mixed.json", *RUN, *SIGNED, *SHORT)),
    "particle": ([], POURED),
    "finish": ([POURED], ("finish", "run", "-o", "sound", "--no-picture", "--longest", "0.1")),
    "glue": ([], ("direct-pile", SCENES / "guide.json", *RUN, *SHORT, "--set", '/guide/hold="glue"')),
    "repose": ([], ("direct-pile", SCENES / "piles.json", *RUN, *SHORT)),
    "decomposition": ([], decomposition),
    "wrap": ([], wrap),
    "render": ([PIECES], ("render", "run", "--frames", "last", "--size", "160x120", "--no-video")),
    "rays": ([PIECES], ("render", "run", "--renderer", "rays", "--samples", "8", "--frames", "last", "--size", "160x120",
                        "--no-video")),
}


class NotCounted(Exception):
    pass


def compare(kept, counted):
    """Errors in counts by name, one line each, and the counts to keep from now on."""
    faults, kept_now = [], dict(kept)
    for name, count in counted.items():
        before = kept.get(name)
        if before is None or count < (1 - NOTED_LESS) * before:
            kept_now[name] = count
        elif count > (1 + MOST_MORE) * before:
            faults.append(f"{name}: {count:,} instructions, {count / before - 1:.1%} more than {before:,}")
    return faults, kept_now


def read(text):
    """Lines of a name and a count."""
    return {name: int(count) for name, count in (line.split() for line in text.splitlines())}


def written(counts):
    return "".join(f"{name} {counts[name]}\n" for name in RUNS if name in counts)


def count(pilesim, name):
    """The instructions of a run, with caches of its own and without gnuplot and ffmpeg. Raises NotCounted."""
    before, run = RUNS[name]
    place = Path(tempfile.mkdtemp(prefix="pilesim-ratchet-"))
    try:
        environment = {"HOME": str(place), "XDG_CACHE_HOME": str(place / "cache"), "PATH": "/nowhere", "LC_ALL": "C"}

        def call(*command):
            words = [str(word).replace("{place}", str(place)) for word in command]
            done = subprocess.run(words, cwd=place, env=environment, stdin=subprocess.DEVNULL, capture_output=True,
                                  text=True, check=False)
            if "valgrind: Unrecognised instruction" in done.stderr:
                raise NotCounted()
            if done.returncode != 0:
                sys.exit(f"{name}: {' '.join(words)}: exit {done.returncode}\n{done.stderr}")
            return done.stderr

        for command in before:
            call(pilesim, *command, "--threads", "1")
        command = run(place) if callable(run) else run
        threads = () if command[0] == "validate" else ("--threads", "1")
        told = call(shutil.which("valgrind"), "--tool=callgrind", "--callgrind-out-file=/dev/null", pilesim, *command,
                    *threads)
        # A child that it forks begins with its parent's count, and tells its own, too.
        return max(map(int, re.findall(r"Collected : (\d+)", told)))
    finally:
        shutil.rmtree(place)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("pilesim", type=lambda path: Path(path).resolve())
    parser.add_argument("runs", nargs="*", help="all, where none is named")
    parser.add_argument("--renew", action="store_true", help="keep the counts, also where they are higher")
    options = parser.parse_args()
    unknown = set(options.runs) - set(RUNS)
    if unknown:
        parser.error(f"no such run: {', '.join(sorted(unknown))}; there are {', '.join(RUNS)}")
    kept = read(COUNTS.read_text()) if COUNTS.exists() else {}
    counted = {}
    for name in options.runs or RUNS:
        try:
            counted[name] = count(options.pilesim, name)
        except NotCounted:
            print(f"{name}: not counted, valgrind does not know one of its instructions", flush=True)
            continue
        change = f"{counted[name] / kept[name] - 1:+.2%}" if name in kept else "new"
        print(f"{name}: {counted[name]:,} instructions, {change}", flush=True)
    faults, kept_now = compare(kept, counted)
    if options.renew:
        faults, kept_now = [], kept | counted
    if written(kept_now) != written(kept):
        COUNTS.write_text(written(kept_now))
        print(f"{COUNTS.relative_to(ROOT)} is rewritten: commit it with the change")
    print("\n".join(faults), end="\n" if faults else "")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
