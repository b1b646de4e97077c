"""Scenes to start from, scenes of several files and from standard input, and what starts inside."""

import json
import subprocess
import unittest

from support import BOX_OBJ, PILESIM, SOURCE, CommandTest

ASSETS = SOURCE / "assets"


class New(CommandTest):
    def test_each_kind_runs_as_it_is(self):
        for kind in ("pile", "bin", "dataset"):
            result = self.succeed("new", kind, ASSETS / "l_shape.obj", "--count", "6",
                                  "-o", f"{kind}.json")
            self.assertIn("across", result.stdout)
            result = self.succeed("simulate", f"{kind}.json", "-o", kind,
                                  "--set", "/duration_s=0.4", "--set", "/until=duration")
            self.assertNotIn("inside", result.stderr, kind)
            self.assertIn("of", result.stdout)

    def test_a_guide_is_filled(self):
        self.succeed("new", "guide", ASSETS / "stick.obj", "--count", "12", "-o", "tower.json")
        self.assertTrue((self.dir / "tower.guide.obj").exists())
        self.succeed("direct-pile", "tower.json", "-o", "out", "--set", "/duration_s=0.1",
                     "--set", "/emitters/0/count=6")

    def test_a_pile_settles_before_its_time_is_over(self):
        (self.dir / "box.obj").write_text(BOX_OBJ)
        self.succeed("new", "pile", "box.obj", "--scale", "0.1", "--count", "5")
        self.succeed("simulate", "scene.json", "-o", "out", "--fail-on", "unsettled>0,escaped>0")
        self.assertTrue(json.loads((self.dir / "out/report.json").read_text())["until"]["settled"])

    def test_sizes_follow_the_mesh(self):
        (self.dir / "box.obj").write_text(BOX_OBJ)
        radius = {}
        for scale in ("1", "0.001"):
            self.succeed("new", "pile", "box.obj", "--scale", scale, "-o", f"{scale}.json")
            printed = self.succeed("validate", f"{scale}.json", "--print-config").stdout
            radius[scale] = json.loads(printed)["emitters"][0]["radius"]
        self.assertAlmostEqual(radius["1"] / radius["0.001"], 1000, delta=5)

    def test_a_mesh_that_is_open_wide_runs_as_its_hull(self):
        (self.dir / "open.obj").write_text(BOX_OBJ.replace("f 4 8 5 1\n", ""))
        self.succeed("new", "pile", "open.obj", "--count", "3")
        self.assertIn('"solid": "hull"', (self.dir / "scene.json").read_text())
        self.succeed("validate", "scene.json")

    def test_what_is_there_is_kept(self):
        (self.dir / "scene.json").write_text("mine")
        result = self.expect_exit(2, "new", "pile", ASSETS / "box.obj")
        self.assertIn("--force", result.stderr)
        self.assertEqual((self.dir / "scene.json").read_text(), "mine")
        self.succeed("new", "pile", ASSETS / "box.obj", "--force")
        self.expect_exit(2, "new", "heap", ASSETS / "box.obj", "-o", "other.json")
        self.expect_exit(4, "new", "pile", "none.obj", "-o", "other.json")
        self.assertFalse((self.dir / "other.json").exists())

    def test_a_seed_draws_another_dataset(self):
        self.succeed("new", "dataset", ASSETS / "box.obj", "-o", "d.json")
        drawn = [self.succeed("validate", "d.json", "--print-config", "--seed", seed).stdout
                 for seed in ("1", "1", "2", "3")]
        self.assertEqual(drawn[0], drawn[1])
        self.assertEqual(len({json.loads(text)["camera"]["keys"][0]["position"][0]
                              for text in drawn}), 3)


class Documents(CommandTest):
    def test_standard_input(self):
        text = (self.dir / self.write_scene()).read_text()
        for text, code in ((text, 0), (text.replace("0.5", "-1", 1), 3)):
            result = subprocess.run([PILESIM, "simulate", "-", "-o", "out", "--force", "-q"],
                                    cwd=self.dir, input=text, capture_output=True, text=True)
            self.assertEqual(result.returncode, code, result.stderr)
        self.assertIn("-:5:", result.stderr)

    def test_included_and_named_values(self):
        self.write_scene()
        main = {"version": 1, "include": ["scene.json"], "variables": {"t": 0.1},
                "duration_s": {"var": "t"}}
        (self.dir / "main.json").write_text(json.dumps(main))
        self.assertIn("4 frames", self.succeed("validate", "main.json").stdout)
        result = self.succeed("validate", "main.json", "--set", "/variables/t=0.2")
        self.assertIn("7 frames", result.stdout)

    def test_what_starts_inside_is_said_before_it_runs(self):
        def crowd(scene):
            scene["emitters"][0]["spacing"] = [0.1, 0.5, 0.5]

        scene = self.write_scene(crowd)
        self.assertIn("4 pairs of bodies start inside", self.succeed("validate", scene).stderr)
        result = self.succeed("simulate", scene, "-o", "out")
        self.assertIn("4 pairs of bodies start inside", result.stderr)
        notes = json.loads((self.dir / "out/report.json").read_text())["notes"]
        self.assertIn("4 pairs", notes[0])
        self.assertEqual(self.succeed("simulate", scene, "-o", "b", "--quiet").stderr, "")


if __name__ == "__main__":
    unittest.main()
