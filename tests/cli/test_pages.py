"""Tutorials: every command on them runs, one after the other, in one directory. On other pages the quick commands run, beside a small
run with the names of the pages.

A block of ```sh is run line by line, as a shell does. A block of ```json or ```python is written to the file that the
paragraph above it names first, in backquotes, if it ends with a colon. A python block without one is run. Steps
that take minutes are done at a smaller size: SMALLER has the replacements in a page's blocks, all of which must occur.
"""

import copy
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import unittest
from pathlib import Path

from support import BOXES, HANGING, PILESIM, SOURCE, CommandTest
from test_documents import commands

BLOCK = re.compile(r"((?:^[^\n]+\n)*)\n*^```(\w+)\n(.*?)^```$", re.M | re.S)
NAMED = re.compile(r"`([\w.-]+\.(?:json|py))`.*:$", re.S)


def blocks(page):
    """(paragraph above, language, text) of a page's fenced blocks."""
    return [match.groups() for match in BLOCK.finditer((SOURCE / "docs" / page).read_text())]


class Pages(CommandTest):
    def setUp(self):
        super().setUp()
        # The program by its name, as it is installed.
        (self.dir / "bin").mkdir()
        (self.dir / "bin/pilesim").symlink_to(PILESIM)
        (self.dir / "bin/python3").symlink_to("/usr/bin/python3")
        (self.dir / "work").mkdir()
        self.environment = {**os.environ, "PATH": f"{self.dir}/bin:{os.environ['PATH']}"}

    def shell(self, command, where):
        result = subprocess.run(
            ["bash", "-euc", command],
            cwd=self.dir / "work",
            env=self.environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=HANGING,
        )
        self.assertEqual(result.returncode, 0, f"{where}: {command}\n{result.stdout}{result.stderr}")
        return result.stdout

    def walk(self, page, smaller=()):
        """Does what the page says. Returns what its commands printed."""
        left = {old for old, _ in smaller}
        printed = ""
        for above, language, text in blocks(page):
            for old, new in smaller:
                if old in text:
                    left.discard(old)
                    text = text.replace(old, new)
            name = NAMED.search(above.strip())
            if language in ("json", "python") and name:
                (self.dir / "work" / name[1]).write_text(text)
            elif language == "python":
                (self.dir / "work/block.py").write_text(text)
                printed += self.shell("python3 block.py", page)
            elif language == "sh":
                for command in text.replace("\\\n", " ").splitlines():
                    if command.strip() and not command.startswith("#"):
                        printed += self.shell(command, page)
        self.assertEqual(left, set(), f"{page} has none of these")
        return printed

    def test_a_shot(self):
        printed = self.walk("tutorial_blender.md", [
            ("cp rabbit.obj", "cp crate.obj"),
            ("--scale 0.3 --count 60", "--scale 0.1 --count 3"),
            ('"scale": 0.3', '"scale": 0.1'),
            ('"duration_s": 5', '"duration_s": 0.5'),
            ('"count": 120', '"count": 3'),
            ("simulate heap.json", "simulate heap.json --set /duration_s=0.3"),
            ("320x180", "64x36"),
            # Blender is not there.
            ("blender --python shot.py", "python3 -m py_compile shot.py"),
        ])
        self.assertRegex(printed, r"shot\.py \(.*6 bodies, 4 of them moving, in 16 frames")

    def test_a_dataset(self):
        printed = self.walk("tutorial_dataset.md", [
            ('"count": 50', '"count": 2'),
            ('"count": 4', '"count": 2'),
            ("--count 30", "--count 6"),
            ("[640, 480]", "[160, 120]"),
            ("-o part.json", "-o part.json -q && sed -i 's/640, 480/160, 120/' part.json"),
            ("/usr/local/share/pilesim/python", str(SOURCE / "python")),
        ])
        self.assertIn("4 pictures; ", printed)
        self.assertRegex(printed, r"masks of the first cover \d{3,} pixels")

    def test_things_on_a_table(self):
        printed = self.walk("tutorial_artist.md", [
            ("new pile mug.obj", "new pile chair.obj"),
            ('"up": "z", "collision": "decomposition"}', '"up": "z", "solid": "hull"}'),
            ('"up": "z", "collision": "decomposition", "thickness_m": 0.003}', '"up": "z", "solid": "hull"}'),
            ('"count": 500, "rate_hz": 120', '"count": 9, "rate_hz": 60'),
            ("--size 320x180", "--size 64x36"),
            ("--size 960x540", "--size 64x36 --quality preview"),
        ])
        self.assertIn("wrapped with cells of", printed)
        self.assertRegex(printed, r"mug: 0\.11\d x 0\.09 x 0\.082 m, 3 bodies")
        # The page shows the preset.
        (scene,) = [text for _, language, text in blocks("tutorial_artist.md") if language == "json"]
        preset = (SOURCE / "presets/artist/things_on_a_table.json").read_text()
        self.assertEqual(json.loads(scene), json.loads(preset))

    def test_a_table(self):
        printed = self.walk("tutorial_researcher.md", [
            ("--rest-drops 600", "--rest-drops 2 --trials 2 --no-accuracy --pours 1"),
            ('"duration_s": 7', '"duration_s": 0.4'),
            ("[0, 1.4, 0]", "[0, 0.4, 0]"),
            ("[5, 4, 5]", "[2, 1, 2]"),
        ])
        for name in ("| speed-up |", "| tilt |", "| deepest overlap, D |"):
            self.assertIn(name, printed)

    def test_troubleshooting(self):
        work = self.dir / "work"
        (work / "mug.obj").write_bytes((SOURCE / "assets/ring.obj").read_bytes())
        self.shell("pilesim new bin mug.obj --count 6 -q", "set-up")
        self.shell("pilesim simulate scene.json -o out/a -q", "set-up")
        plan = {"version": 1, "scene": "scene.json", "steps": [["simulate"]]}
        (work / "plan.json").write_text(json.dumps(plan))
        self.shell("pilesim batch plan.json -o out/jobs -q", "set-up")
        self.walk("troubleshooting.md", [])

    def run_commands(self, page, smaller=(), left_out=()):
        """Those of the page. `smaller`: what is added to commands that have these words. `left_out`: words of commands that do not run."""
        parts = {part for part, _ in smaller} | set(left_out)
        used = set()
        for place, words in commands(SOURCE / page):
            command = place.split(": ", 1)[1]
            used |= {part for part in parts if part in command}
            if any(part in command for part in left_out):
                continue
            more = [text for part, text in smaller if part in command]
            self.shell(shlex.join(["pilesim", *words]) + " " + " ".join(more), place)
        self.assertEqual(parts - used, set(), f"{page} has none of these")

    def test_commands_of_other_pages(self):
        work = self.dir / "work"
        for name in ("presets", "assets"):
            (work / name).symlink_to(SOURCE / name)
        for name in ("mug.obj", "stick.obj", "brick.obj"):
            (work / name).write_bytes((SOURCE / "assets/ring.obj").read_bytes())
        scene = copy.deepcopy(BOXES)
        scene["duration_s"] = 5.1
        scene["emitters"][0]["name"] = "rabbits"
        for name in ("scene.json", "hit.json", "bin.json"):
            (work / name).write_text(json.dumps(scene))
        self.shell("pilesim simulate scene.json -o out/a -q", "set-up")
        for name in ("b", "crate", "flood", "rabbits_in_a_crate"):
            shutil.copytree(work / "out/a", work / "out" / name)
        self.shell("pilesim export out/a -o part.glb --frame 0 --as objects --only rabbits/1 --no-camera -q", "set-up")
        stl = ["solid bolt"]
        for corners in ("0 0 0 0 9 0 9 0 0", "0 0 0 9 0 0 0 0 9", "0 0 0 0 0 9 0 9 0", "9 0 0 0 9 0 0 0 9"):
            points = corners.split()
            stl.append("facet normal 0 0 0 outer loop")
            stl += [f"vertex {' '.join(points[i : i + 3])}" for i in (0, 3, 6)] + ["endloop endfacet"]
        (work / "bolt.stl").write_text("\n".join([*stl, "endsolid bolt"]))
        quick = "--trials 2 --rest-drops 2 --no-accuracy --pours 0"
        self.run_commands("docs/export.md")
        self.run_commands("docs/view.md")
        self.run_commands("docs/meshes.md", [("sample-signature", quick)])
        self.run_commands("docs/render.md", left_out=["out/film"])
        # The collisions that are written are those that are read.
        self.run_commands("docs/signatures.md", [
            ("--rest-drops 100", "--trials 2 --no-accuracy --pours 0"),
            ("--write-collisions", "--trials 3 --no-accuracy --pours 0"), ("--collisions", "--no-accuracy --pours 0"),
        ])  # fmt: skip
        self.run_commands("docs/files.md", left_out=["direct-pile"])
        self.run_commands("README.md", [
            ("simulate scene.json", "--force"),
            ("render out/a", "--force"),
            ("export out/a", "--force"),
        ], ["new bin", "heart", "compare scene.json", "batch"])  # fmt: skip
        self.run_commands("docs/use.md", [
            ("presets copy", "--force"),
            ("simulate scene.json -o out/a  ", "--force"),
            ("--seed 7", "--force"),
            ("finish out/a", "--force"),
            ("sample-signature", quick),
            ("render out/a", "--force"),
            ("--passes", "--frames 3-5"),
            ("view out/a", "--force"),
            ("export out/a", "--force"),
            ("direct-pile", "--set /duration_s=0.1"),
            ("--overlay", "--frames last --no-video --size 64x36"),
        ], ["new bin", "heart", "out/mixed", "compare scene.json", "batch"])  # fmt: skip
        self.run_commands("docs/authoring.md", [("new pile", "--force")])
        self.run_commands("docs/install.md", [("simulate rabbits_in", "--set /duration_s=0.1 --force")])

    def test_errors_in_troubleshooting_are_as_the_program_says_them(self):
        known = (Path(__file__).with_name("errors.txt")).read_text().splitlines()
        shown = [text for _, language, text in blocks("troubleshooting.md") if language == "text"]
        self.assertGreater(len(shown), 2)
        for line in "".join(shown).splitlines():
            self.assertIn("| " + line, known)


if __name__ == "__main__":
    unittest.main()
