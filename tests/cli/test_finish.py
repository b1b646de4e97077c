"""pilesim finish."""

import json
import signal
import subprocess
import unittest

from support import HANGING, PILESIM, CommandTest, tree_bytes

GATES = "penetration>0.02D,floating>0,unsettled>0,escaped>0"


def sunk(scene):
    """Boxes that sleep a third of the way in each other."""
    scene["emitters"][0].update(
        centre=[0, 0.26, 0], count=[3, 3, 3], spacing=[0.14, 0.14, 0.14], asleep=True,
        orientation=[1, 0, 0, 0],
    )


def many_sunk(scene):
    sunk(scene)
    scene["emitters"][0].update(centre=[0, 1.06, 0], count=[12, 15, 12])


class FinishTest(CommandTest):
    def report(self, directory):
        return json.loads((self.dir / directory / "report.json").read_text())

    def simulate_sunk(self, change=sunk):
        self.succeed("simulate", self.write_scene(change), "-o", "out")
        self.assertGreater(
            self.report("out")["quality_at_end"]["deepest_penetration_diameters"], 0.1
        )

    def test_makes_a_pile_sound_and_leaves_the_run_alone(self):
        self.simulate_sunk()
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
        # What comes of it is a run like any other.
        self.succeed("finish", "sound", "-o", "again", "--fail-on", GATES)
        self.assertLess(self.report("again")["finish"]["largest_moved_diameters"], 0.01)
        self.succeed("simulate", "scene.json", "-o", "on", "--from", "sound")

    def test_says_what_stands_in_the_way(self):
        self.simulate_sunk()
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
        self.simulate_sunk()
        result = self.expect_exit(
            5, "finish", "out", "-o", "sound", "--longest", "0.01", "--fail-on", "unsettled>0"
        )
        self.assertRegex(result.stderr, r"unsettled is \d+")
        self.assertGreater(self.report("sound")["finish"]["not_at_rest"], 0)

    def interrupt(self, *arguments):
        process = subprocess.Popen(
            [PILESIM, *arguments, "--progress", "json"],
            cwd=self.dir, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        )
        self.addCleanup(process.kill)
        for line in process.stderr:
            if '"finish"' in line:
                break
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=HANGING)
        self.assertEqual(process.returncode, 130, errors)
        return errors

    def test_ctrl_c_leaves_a_valid_run_that_says_so(self):
        self.simulate_sunk(many_sunk)
        errors = self.interrupt("finish", "out", "-o", "sound")
        self.assertRegex(errors, r"interrupted; holds 16 frames, and \d+ of 2160 bodies are at rest")
        report = self.report("sound")
        self.assertTrue(report["interrupted"])
        self.assertTrue(report["finish"]["interrupted"])
        self.succeed("render", "sound", "--sheet", "1x1")


if __name__ == "__main__":
    unittest.main()
