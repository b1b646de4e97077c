"""The exact text of errors, as errors.txt has them; and that they leave no file behind.

    PILESIM_WRITE_ERRORS=1 python3 -m unittest test_errors     # rewrites errors.txt: read the difference
"""

import copy
import json
import os
import shlex
import shutil
import unittest
from pathlib import Path

from support import BOXES, PILESIM, SOURCE, CommandTest, tree_bytes

CASES = Path(__file__).with_name("errors.txt")


class Case:
    """One error: what the scene and its neighbours are, the command, its exit code and its text."""

    def __init__(self, block):
        self.given, self.command, self.shown = [], "", []
        self.code = 0
        for line in block.splitlines():
            if line.startswith("$ "):
                self.command = line[2:]
            elif line.startswith("exit "):
                self.code = int(line[5:])
            elif line.startswith("| "):
                self.shown.append(line[2:])
            elif self.command:
                raise ValueError(f"errors.txt: {line!r} stands behind its command")
            else:
                self.given.append(line)
        self.name = self.given.pop(0)

    def text(self):
        shown = [f"| {line}" for line in self.shown]
        return "\n".join([self.name, *self.given, f"$ {self.command}", f"exit {self.code}", *shown])


def read_cases():
    """The text above the first case, and the cases."""
    head, *blocks = CASES.read_text().split("\n\n== ")
    return head, [Case(block.rstrip("\n")) for block in blocks]


def place_in(document, pointer):
    """The object or array that holds what `pointer` names, and its key there."""
    *way, last = pointer.split("/")[1:]
    for key in way:
        document = document[int(key)] if isinstance(document, list) else document[key]
    return document, int(last) if isinstance(document, list) and last != "-" else last


class Errors(CommandTest):
    def setUp(self):
        super().setUp()
        scene = copy.deepcopy(BOXES)
        scene["duration_s"] = 0.1
        (self.dir / "scene.json").write_text(json.dumps(scene))
        self.succeed("simulate", "scene.json", "-o", "run", "--quiet")
        (self.dir / "scene.json").unlink()

    def prepare(self, case):
        scene = copy.deepcopy(BOXES)
        for line in case.given:
            word, what, *value = line.split(" ", 2)
            if word == "with":
                holder, key = place_in(scene, what)
                if key == "-":
                    holder.append(json.loads(value[0]))
                else:
                    holder[key] = json.loads(value[0])
            elif word == "without":
                holder, key = place_in(scene, what)
                del holder[key]
            elif word == "file":
                (self.dir / what).write_text(value[0].replace("\\n", "\n"))
            elif word == "directory":
                (self.dir / what).mkdir()
            elif word == "asset":
                shutil.copy(SOURCE / "assets" / what, self.dir)
            else:
                raise ValueError(f"errors.txt: {word!r} is none of with, without, file, directory, asset")
        (self.dir / "scene.json").write_text(json.dumps(scene, indent=2))

    def test_each_has_its_text_and_leaves_nothing_behind(self):
        head, cases = read_cases()
        self.assertGreater(len(cases), 80)
        self.assertEqual(len({case.name for case in cases}), len(cases))
        original = tree_bytes(self.dir)
        writes = bool(os.environ.get("PILESIM_WRITE_ERRORS"))
        for case in cases:
            with self.subTest(case.name):
                self.prepare(case)
                before = tree_bytes(self.dir)
                program, *arguments = shlex.split(case.command)
                self.assertEqual(program, "pilesim")
                result = self.run_pilesim(*arguments)
                shown = result.stderr.replace(str(self.dir), "DIR").splitlines()
                if writes:
                    case.code, case.shown = result.returncode, shown
                self.assertEqual(shown, case.shown)
                self.assertEqual(result.returncode, case.code)
                self.assertNotEqual(case.code, 0)
                self.assertEqual(result.stdout, "")
                self.assertEqual(tree_bytes(self.dir), before)
            self.restore(original)
        if writes:
            CASES.write_text("\n\n== ".join([head, *(case.text() for case in cases)]) + "\n")

    def restore(self, original):
        for path in sorted(self.dir.rglob("*"), reverse=True):
            name = str(path.relative_to(self.dir))
            if path.is_dir():
                if not any(path.iterdir()) and not any(key.startswith(name + "/") for key in original):
                    path.rmdir()
            elif name not in original:
                path.unlink()
        for name, content in original.items():
            if not (self.dir / name).exists() or (self.dir / name).read_bytes() != content:
                (self.dir / name).write_bytes(content)


if __name__ == "__main__":
    unittest.main()
