"""Several processes use the same mesh at the same time: solids, decompositions, signatures."""

import os
import subprocess
import unittest

from support import BOX_OBJ, PILESIM, CommandTest

SIGNATURE = ("--trials", "2", "--exemplars", "0", "--rest-drops", "2", "--no-accuracy", "--pours", "0", "-q", "--force")


def bracket_obj():
    """An L with a triangle that is the wrong way round: it is mended, and then cut in two."""
    outline = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    lines = [f"v {x} {y} {z}" for z in (0, 1) for x, y in outline]
    for i in range(1, 5):
        lines += [f"f 1 {i + 2} {i + 1}", f"f 7 {i + 7} {i + 8}"]
    for i in range(6):
        a, b = i + 1, (i + 1) % 6 + 1
        lines += [f"f {a} {b} {b + 6}", f"f {a} {b + 6} {a + 6}"]
    lines[-1] = "f 12 7 6"
    return "\n".join(lines) + "\n"


class CachesTest(CommandTest):
    def setUp(self):
        super().setUp()
        (self.dir / "bracket.obj").write_text(bracket_obj())
        (self.dir / "box.obj").write_text(BOX_OBJ)

        def change(scene):
            scene["shapes"]["box"] = {"type": "mesh", "file": "bracket.obj", "scale": 0.1, "collision": "decomposition"}
            scene["duration_s"] = 0.2

        self.write_scene(change)

    def run_at_once(self, cache, commands):
        environment = os.environ | {"XDG_CACHE_HOME": str(self.dir / cache)}
        processes = [subprocess.Popen([PILESIM, *words], cwd=self.dir, env=environment, stdin=subprocess.DEVNULL,
                                      stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
                     for words in commands]
        for process in processes:
            _, errors = process.communicate()
            self.assertEqual(process.returncode, 0, errors)

    def simulate(self, cache, *outputs):
        self.run_at_once(cache, [("simulate", "scene.json", "-o", out, "-q") for out in outputs])

    def cached(self, cache):
        """All files of a cache, hidden ones too."""
        return {file.name: file.read_bytes() for file in (self.dir / cache / "pilesim").iterdir()}

    def test_made_by_several_at_once(self):
        self.simulate("alone", "first")
        whole = self.cached("alone")
        self.assertEqual({name.split("-")[0] for name in whole}, {"solid", "decomposition"})
        outputs = [f"out{i}" for i in range(4)]
        self.simulate("shared", *outputs)
        self.assertEqual(self.cached("shared"), whole)
        poses = "trajectory.zarr/position/0.0.0"
        for out in outputs:
            self.assertEqual((self.dir / out / poses).read_bytes(), (self.dir / "first" / poses).read_bytes())

    def test_signatures_made_twice_at_once(self):
        def measure(out):
            return ("sample-signature", "box.obj", "-o", out, *SIGNATURE)

        self.run_at_once("cache", [measure("alone.sig")])
        self.run_at_once("cache", [measure("shared.sig")] * 3)
        self.assertEqual((self.dir / "shared.sig").read_bytes(), (self.dir / "alone.sig").read_bytes())
        self.assertEqual(list(self.dir.glob(".pilesim.*")), [])


if __name__ == "__main__":
    unittest.main()
