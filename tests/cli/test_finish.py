"""pilesim finish, "finish" in scenes, and runs that end when all has settled."""

import itertools
import json
import os
import signal
import unittest

from support import BOXES, CommandTest, tree_bytes

GATES = "penetration>0.02D,floating>0,unsettled>0,escaped>0"


def overlapping(scene):
    """Boxes that sleep a third of the way in each other."""
    scene["emitters"][0].update(
        centre=[0, 0.26, 0], count=[3, 3, 3], spacing=[0.14, 0.14, 0.14], asleep=True,
        orientation=[1, 0, 0, 0],
    )


def many_overlapping(scene):
    overlapping(scene)
    scene["emitters"][0].update(centre=[0, 0.68, 0], count=[5, 6, 5])


def icosahedron(radius):
    golden = (1 + 5**0.5) / 2
    corners = [
        corner
        for one in (1, -1)
        for other in (golden, -golden)
        for corner in ((0, one, other), (one, other, 0), (other, 0, one))
    ]
    near = [[sum((x - y) ** 2 for x, y in zip(a, b)) < 4.1 for b in corners] for a in corners]
    lines = ["v " + " ".join(str(radius * x / (1 + golden**2) ** 0.5) for x in a) for a in corners]
    for i, j, k in itertools.combinations(range(12), 3):
        if not (near[i][j] and near[j][k] and near[k][i]):
            continue
        (a, b, c), (d, e, f), (g, h, l) = corners[i], corners[j], corners[k]
        outwards = a * (e * l - f * h) - b * (d * l - f * g) + c * (d * h - e * g) > 0
        lines.append(f"f {i + 1} {j + 1} {k + 1}" if outwards else f"f {i + 1} {k + 1} {j + 1}")
    return "\n".join(lines) + "\n"


class FinishTest(CommandTest):
    def report(self, directory):
        return json.loads((self.dir / directory / "report.json").read_text())

    def simulate_overlapping(self, change=overlapping):
        self.succeed("simulate", self.write_scene(change), "-o", "out")
        self.assertGreater(
            self.report("out")["quality_at_end"]["deepest_penetration_diameters"], 0.1
        )

    def test_makes_a_pile_sound_and_leaves_the_run_alone(self):
        self.simulate_overlapping()
        before = tree_bytes(self.dir / "out")
        result = self.succeed("finish", "out", "-o", "sound", "--fail-on", GATES)
        self.assertRegex(result.stdout, r"finished 27 bodies in .* overlaps of .* became .*; 0 not")
        self.assertEqual(tree_bytes(self.dir / "out"), before)
        report = self.report("sound")
        self.assertEqual(report["command"], "finish")
        self.assertEqual(report["finish"]["not_at_rest"], 0)
        self.assertGreater(report["finish"]["deepest_before_diameters"], 0.1)
        self.assertLess(report["finish"]["deepest_after_diameters"], 0.02)
        self.assertGreater(report["finish"]["largest_extra_speed_m_s"], 0)
        self.succeed("render", "sound", "--sheet", "2x1")
        # The result is a run like any other.
        self.succeed("finish", "sound", "-o", "again", "--fail-on", GATES)
        self.assertLess(self.report("again")["finish"]["largest_moved_diameters"], 0.01)
        self.succeed("simulate", "scene.json", "-o", "on", "--from", "sound")

    def test_what_is_wrong_in_a_trajectory_is_not_blamed_on_the_scene_file(self):
        self.simulate_overlapping()
        attributes = self.dir / "out/trajectory.zarr/.zattrs"
        stored = json.loads(attributes.read_text())
        stored["scene"]["frame_rate"] = -1
        attributes.write_text(json.dumps(stored))
        result = self.expect_exit(3, "finish", "out", "-o", "sound")
        self.assertRegex(result.stderr, r"out/trajectory\.zarr:\d+:\d+: /frame_rate: is -1;")
        self.assertNotIn("scene.json", result.stderr)

    def test_a_scene_finishes_itself_with_the_same_bytes(self):
        self.simulate_overlapping()
        self.succeed("finish", "out", "-o", "sound")
        result = self.succeed(
            "simulate", "scene.json", "-o", "own", "--set", "/finish={}", "--fail-on", GATES
        )
        self.assertIn("finished 27 bodies", result.stdout)
        for array in ("position", "orientation", "state"):
            self.assertEqual(
                tree_bytes(self.dir / "own/trajectory.zarr" / array),
                tree_bytes(self.dir / "sound/trajectory.zarr" / array),
            )
        self.assertEqual(
            sorted(path.name for path in (self.dir / "own").iterdir()),
            ["checkpoint.bin", "report.html", "report.json", "timing.csv", "trajectory.zarr"],
        )
        self.assertEqual(self.report("own")["finish"]["bodies"], 27)

    def test_the_mixed_mode_finishes_a_pile_at_rest_unless_it_is_told_not_to(self):
        def mixed(scene):
            # Spheres around boxes that start high: they come to rest, and the boxes overlap.
            scene["simulator"] = {"mode": "mixed", "level_of_detail": {"level": 2}}
            scene["duration_s"] = 4

        self.write_scene(mixed)
        result = self.succeed("simulate", "scene.json", "-o", "out", "--fail-on", GATES)
        self.assertEqual(result.stderr, "")
        self.assertEqual(self.report("out")["finish"]["bodies"], 8)
        self.succeed("simulate", "scene.json", "-o", "quick", "--set", "/finish=false")
        self.assertNotIn("finish", self.report("quick"))
        falling = self.succeed("simulate", "scene.json", "-o", "falling", "--set", "/duration_s=0.3")
        self.assertIn('8 bodies of 8 still move at the end, so overlaps were left as they are; let the run last longer '
                      '("duration_s"), or set "finish" to true or false', falling.stderr)
        self.assertNotIn("finish", self.report("falling"))
        self.succeed("simulate", "scene.json", "-o", "asked", "--set", "/duration_s=0.3", "--set", "/finish=true")
        self.assertEqual(self.report("asked")["finish"]["bodies"], 8)
        # The modes are compared as they simulate.
        self.succeed("compare", "scene.json", "-o", "compared", "--modes", "mixed", "--reference", "impulse")
        self.assertEqual([run for run in (self.dir / "compared/runs").glob("*/*/report.json")
                          if "finish" in json.loads(run.read_text())], [])

    def test_says_what_stands_in_the_way(self):
        self.simulate_overlapping()
        result = self.expect_exit(2, "finish", "out", "-o", "out", "--force")
        self.assertIn("is the run that is to be finished", result.stderr)
        self.assertTrue((self.dir / "out/trajectory.zarr").is_dir())
        result = self.expect_exit(3, "finish", "nowhere", "-o", "sound")
        self.assertIn("nowhere: does not exist", result.stderr)
        (self.dir / "out/checkpoint.bin").unlink()
        result = self.expect_exit(3, "finish", "out", "-o", "sound")
        self.assertIn("--scene", result.stderr)
        self.assertFalse((self.dir / "sound").exists())
        self.succeed("finish", "out", "-o", "sound", "--scene", "scene.json")
        result = self.expect_exit(2, "finish", "out", "-o", "sound", "--scene", "scene.json")
        self.assertIn("--force", result.stderr)

    def test_tells_what_had_not_come_to_rest(self):
        self.simulate_overlapping()
        result = self.expect_exit(
            5, "finish", "out", "-o", "sound", "--longest", "0.01", "--fail-on", "unsettled>0"
        )
        self.assertRegex(result.stderr, r"unsettled is \d+")
        self.assertGreater(self.report("sound")["finish"]["not_at_rest"], 0)
        # Once it is complete the gates are judged all the same.
        again = ("finish", "out", "-o", "sound", "--longest", "0.01", "--resume")
        judged = self.expect_exit(5, *again, "--fail-on", "unsettled>0")
        self.assertEqual(judged.stderr, result.stderr)
        self.succeed(*again, "--fail-on", "unsettled>1000")

    def interrupt(self, *arguments):
        struck = self.at_change(arguments[0], signal.SIGINT, 1, "/finishing.bin")
        return self.expect_exit(130, *arguments, env=struck).stderr

    def test_ctrl_c_leaves_a_valid_run_that_says_so(self):
        self.simulate_overlapping(many_overlapping)
        errors = self.interrupt("finish", "out", "-o", "sound")
        self.assertRegex(errors, r"interrupted; holds 16 frames, and \d+ of 150 bodies are at rest")
        report = self.report("sound")
        self.assertTrue(report["interrupted"])
        self.assertTrue(report["finish"]["interrupted"])
        self.succeed("render", "sound", "--sheet", "1x1")

    def stop_once_it_goes_on(self, directory, fault, *arguments):
        """After two checkpoints, of which the second is of later steps."""
        struck = self.at_change(arguments[0], fault, 3, "/finishing.bin")
        self.expect_exit(-signal.SIGKILL if fault == "kill" else 130, *arguments, "--checkpoint", "0",
                         env=struck)
        self.assertTrue((self.dir / directory / "finishing.bin").exists())

    def test_a_killed_one_goes_on_and_ends_with_the_same_bytes(self):
        self.simulate_overlapping(many_overlapping)
        command = ("finish", "out", "--longest", "0.2")
        self.succeed(*command, "-o", "a", "--threads", "2")
        resumed = (*command, "-o", "b", "--resume")
        for fault in ("kill", signal.SIGINT, "kill"):
            self.stop_once_it_goes_on("b", fault, *resumed)
        result = self.succeed(*resumed, "--threads", "1")
        self.assertRegex(result.stdout, r"resumed after \d+ steps? of finishing")
        for name in ("trajectory.zarr", "checkpoint.bin"):
            self.assertEqual(self.bytes_of("b", name), self.bytes_of("a", name))
        self.assertEqual(
            sorted(path.name for path in (self.dir / "b").iterdir()),
            ["checkpoint.bin", "report.html", "report.json", "timing.csv", "trajectory.zarr"],
        )
        a, b = self.report("a")["finish"], self.report("b")["finish"]
        del a["wall_s"], b["wall_s"]
        self.assertEqual(a, b)
        self.assertIn("nothing was left to do", self.succeed(*resumed).stdout)

    def bytes_of(self, directory, name):
        path = self.dir / directory / name
        if path.is_file():
            return path.read_bytes()
        return {
            file: data for file, data in tree_bytes(path).items() if not file.startswith("frames/.")
        }

    def test_what_is_of_other_work_is_not_gone_on_with(self):
        self.simulate_overlapping()
        self.succeed("finish", "out", "-o", "b", "--resume")
        before = tree_bytes(self.dir / "b")
        result = self.expect_exit(3, "finish", "out", "-o", "b", "--resume", "--longest", "3")
        self.assertIn("is of another scene or of other options", result.stderr)
        result = self.expect_exit(3, "finish", "b", "-o", "out", "--resume")
        self.assertIn("is of pilesim simulate", result.stderr)
        self.assertEqual(tree_bytes(self.dir / "b"), before)
        (self.dir / "b/checkpoint.bin").unlink()
        result = self.expect_exit(2, "finish", "out", "-o", "b", "--resume")
        self.assertIn("no checkpoint to resume from", result.stderr)
        self.expect_exit(2, "finish", "out", "-o", "b", "--resume", "--force")

    def test_a_scene_whose_finishing_is_killed_goes_on_with_it(self):
        scene = self.write_scene(many_overlapping)
        own = ("simulate", scene, "-o", "own", "--set", '/finish={"longest_s": 0.2}')
        self.stop_once_it_goes_on("own", "kill", *own)
        result = self.succeed(*own, "--resume")
        self.assertRegex(result.stdout, r"resumed after \d+ steps? of finishing")
        self.succeed("simulate", scene, "-o", "at_once", *own[4:])
        for name in ("trajectory.zarr", "checkpoint.bin"):
            self.assertEqual(self.bytes_of("own", name), self.bytes_of("at_once", name))
        self.assertFalse((self.dir / "own/finishing.bin").exists())

    def test_what_cannot_be_seen_is_left(self):
        def deep(scene):
            # A shape that almost fills its bounding sphere: few of them make a deep pile.
            (self.dir / "ball.obj").write_text(icosahedron(0.1))
            scene["shapes"]["box"] = {"type": "mesh", "file": "ball.obj"}
            scene["emitters"][0].update(centre=[0, 0.4, 0], count=[17, 5, 17],
                                        spacing=[0.14, 0.14, 0.14], asleep=True)

        self.simulate_overlapping(deep)
        self.succeed("finish", "out", "-o", "sound", "--visible-only", "--fail-on", GATES)
        figures = self.report("sound")["finish"]
        self.assertGreater(figures["left_as_they_were"], 10)
        self.assertEqual(figures["left_as_they_were"] + figures["bodies"], 17 * 5 * 17)
        self.assertGreater(figures["deepest_left_diameters"], 0.1)
        self.assertLess(figures["deepest_after_diameters"], 0.02)
        for name in ("out", "sound"):
            self.succeed("export", name, "-o", name + ".csv", "--frame", "last")
        # Where each body lies, without its state.
        before, after = (
            [line.rsplit(",", 1)[0] for line in (self.dir / name).read_text().splitlines()[2:]]
            for name in ("out.csv", "sound.csv")
        )
        # Bodies that others could not get out of have given way.
        unmoved = sum(one == other for one, other in zip(before, after, strict=True))
        self.assertGreater(unmoved, figures["left_as_they_were"] / 2)
        # The scene may ask for it, too. The energy at its end is that of all bodies.
        self.succeed("simulate", "scene.json", "-o", "own", "--set",
                     '/finish={"visible_only": true}', "--fail-on", GATES)
        potential = [self.report(name)["energy"]["potential_end_j"] for name in ("out", "own")]
        heights = [sum(float(line.split(",")[5]) for line in lines) for lines in (before, after)]
        self.assertAlmostEqual(potential[1] / potential[0], heights[1] / heights[0], delta=0.001)
        self.assertEqual(self.bytes_of("own", "trajectory.zarr/position"),
                         self.bytes_of("sound", "trajectory.zarr/position"))

    def test_a_scene_whose_finishing_is_interrupted_is_resumed(self):
        scene = self.write_scene(many_overlapping)
        own = ("simulate", scene, "-o", "own", "--set", "/finish={\"longest_s\": 0.3}")
        errors = self.interrupt(*own)
        self.assertIn("the pile is not finished", errors)
        self.assertEqual(list((self.dir / "own").glob("*.zarr")), [self.dir / "own/trajectory.zarr"])
        self.succeed(*own, "--resume")
        self.succeed("simulate", scene, "-o", "at_once", *own[4:])
        for array in ("position", "orientation", "state"):
            self.assertEqual(
                tree_bytes(self.dir / "own/trajectory.zarr" / array),
                tree_bytes(self.dir / "at_once/trajectory.zarr" / array),
            )


class SettledTest(CommandTest):
    def run_until_settled(self, mode, **more):
        def change(scene):
            scene.update({"duration_s": 20, "until": "settled"} | more)
            scene["simulator"] = {"mode": mode}

        self.succeed("simulate", self.write_scene(change), "-o", "out", "--force")
        return json.loads((self.dir / "out/report.json").read_text())

    def test_a_run_ends_when_all_has_settled(self):
        for mode in ("impulse", "particle"):
            with self.subTest(mode=mode):
                report = self.run_until_settled(mode)
                self.assertEqual(report["until"]["settled"], True)
                self.assertEqual(report["until"]["unsettled"], 0)
                self.assertEqual(report["quality_at_end"]["unsettled"], 0)
                frames = report["counts"]["frames"]
                self.assertGreater(frames, 15)  # 1 m takes 0.45 s to fall
                self.assertLess(frames, 150)
                self.assertAlmostEqual(report["until"]["since_s"], frames / 30, delta=1)

    def test_who_does_not_come_as_its_region_is_full_is_not_waited_for(self):
        poured = {
            "shapes": BOXES["shapes"] | {"bin": {"type": "bin", "size": [0.6, 0.5, 0.6]}},
            "bodies": BOXES["bodies"] + [{"shape": "bin", "material": "wood", "role": "static"}],
            "emitters": [
                {
                    "name": "boxes",
                    "type": "stream",
                    "shape": "box",
                    "material": "wood",
                    "position": [0, 0.9, 0],
                    "position_jitter_m": 0.1,
                    "rate_hz": 4,
                    "end_s": 50,
                    "until": {"full": {"min": [-0.3, 0.4, -0.3], "max": [0.3, 0.7, 0.3]}},
                }
            ],
        }
        for mode in ("impulse", "particle"):
            with self.subTest(mode=mode):
                report = self.run_until_settled(mode, **poured)
                self.assertEqual(report["until"]["settled"], True)
                came = report["counts"]["dynamic_bodies"]
                self.assertIn(came, range(2, 40))
                self.assertEqual(report["quality_at_end"]["bodies"], came)
                line = f"'boxes' stopped when its region was full: {came} of 200 bodies came"
                self.assertIn(line, report["notes"])
        self.assertIn("at most 200 bodies", self.succeed("validate", "scene.json").stdout)

    def test_what_is_finished_is_reported_as_it_lies_then(self):
        for longest in (20, 0.3):
            with self.subTest(longest=longest):
                report = self.run_until_settled("particle", duration_s=longest, finish={})
                self.assertEqual(report["until"]["settled"], longest == 20)
                self.assertEqual(report["settled"], True)
                self.assertEqual(report["energy"]["kinetic_end_j"], 0)

    def test_not_before_all_that_is_to_come_has_come(self):
        report = self.run_until_settled(
            "impulse", events=[{"type": "impulse", "time_s": 4, "bodies": ["boxes/0"],
                                "impulse": [0, 20, 0]}]
        )
        self.assertGreater(report["until"]["since_s"], 4.2)

    def test_at_the_longest_time_it_says_what_moves(self):
        self.succeed("simulate", self.write_scene(), "-o", "out", "--set", "/until=settled",
                     "--set", "/duration_s=0.3")
        report = json.loads((self.dir / "out/report.json").read_text())
        self.assertEqual(report["counts"]["frames"], 10)
        self.assertEqual(report["until"], {"settled": False, "unsettled": 8})


if __name__ == "__main__":
    unittest.main()
