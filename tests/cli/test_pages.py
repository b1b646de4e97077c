"""Pages that take their reader by the hand: every command on them runs, one after the other, in one directory.

A block of ```sh is run line by line, as a shell does. A block of ```json or ```python is written to the file that the
paragraph above it names first, in backquotes, if it ends with a colon. A python block without one is run. What a page takes minutes for
is done at a smaller size: SMALLER has what is replaced in its blocks, each of which must be there.
"""

import json
import os
import re
import subprocess
import sys
import unittest
from pathlib import Path

from support import HANGING, PILESIM, SOURCE, CommandTest

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

    def test_a_dataset(self):
        printed = self.walk("tutorial_dataset.md", [
            ('"count": 50', '"count": 2'),
            ('"count": 4', '"count": 2'),
            ("--count 30", "--count 6"),
            ("[640, 480]", "[160, 120]"),
            ("-o part.json", "-o part.json -q && sed -i 's/640, 480/160, 120/' part.json"),
        ])
        self.assertIn("4 pictures, ", printed)
        self.assertRegex(printed, r"masks cover \d{3,} pixels")

    def test_a_table(self):
        printed = self.walk("tutorial_researcher.md", [
            ("--rest-drops 600", "--rest-drops 2 --trials 2 --no-accuracy"),
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
        self.walk("troubleshooting.md", [("--trials 20", "--trials 2")])

    def test_errors_in_troubleshooting_are_as_the_program_says_them(self):
        known = (Path(__file__).with_name("errors.txt")).read_text().splitlines()
        shown = [text for _, language, text in blocks("troubleshooting.md") if language == "text"]
        self.assertGreater(len(shown), 4)
        for line in "".join(shown).splitlines():
            self.assertIn("| " + line, known)


if __name__ == "__main__":
    unittest.main()
