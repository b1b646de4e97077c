"""simulate: what it writes, that it repeats, and that no accident leaves a broken result."""

import csv
import json
import os
import resource
import signal
import subprocess
import time
import unittest

import zarr
from support import PILESIM, SOURCE, CommandTest, tree_bytes


def long_scene(scene):
    scene["duration_s"] = 600
    scene["simulator"] = {"sleeping": False}


class Output(CommandTest):
    def test_writes_trajectory_timing_and_report(self):
        result = self.succeed("simulate", self.write_scene(), "-o", "out")
        self.assertIn("16 frames", result.stdout)
        self.assertEqual(result.stderr, "")
        store = zarr.open(str(self.dir / "out/trajectory.zarr"), mode="r")
        self.assertEqual(store["position"].shape, (16, 9, 3))
        self.assertEqual(store["orientation"].shape, (16, 9, 4))
        self.assertEqual(store["state"].shape, (16, 9))
        with open(self.dir / "out/timing.csv") as file:
            self.assertEqual(len(list(csv.DictReader(file))), 16)
        report = json.loads((self.dir / "out/report.json").read_text())
        self.assertFalse(report["interrupted"])
        self.assertIn("<svg", (self.dir / "out/report.html").read_text())

    def test_boxes_fall_as_bodies_do(self):
        self.succeed("simulate", self.write_scene(), "-o", "out")
        height = zarr.open(str(self.dir / "out/trajectory.zarr"), mode="r")["position"][:, 1, 1]
        t = 6 / 30  # free until the lowest corner lands
        self.assertAlmostEqual(height[0] - height[6], 0.5 * 9.81 * t * t, places=5)

    def test_same_scene_same_bytes_whatever_the_threads(self):
        scene = self.write_scene()
        self.succeed("simulate", scene, "-o", "a", "--threads", "1")
        self.succeed("simulate", scene, "-o", "b", "--threads", "2")
        self.assertEqual(
            tree_bytes(self.dir / "a/trajectory.zarr"), tree_bytes(self.dir / "b/trajectory.zarr")
        )

    def test_another_seed_another_result(self):
        scene = self.write_scene()
        self.succeed("simulate", scene, "-o", "a")
        self.succeed("simulate", scene, "-o", "b", "--seed", "4")
        self.assertNotEqual(
            tree_bytes(self.dir / "a/trajectory.zarr"), tree_bytes(self.dir / "b/trajectory.zarr")
        )

    def test_quiet(self):
        result = self.succeed("simulate", self.write_scene(), "-o", "out", "--quiet")
        self.assertEqual((result.stdout, result.stderr), ("", ""))

    def test_progress_as_json(self):
        result = self.succeed("simulate", self.write_scene(), "-o", "out", "--progress", "json")
        last = json.loads(result.stderr.strip().splitlines()[-1])
        self.assertEqual((last["stage"], last["done"], last["total"]), ("simulate", 16, 16))


class Refusals(CommandTest):
    def test_existing_output_is_kept_without_force(self):
        scene = self.write_scene()
        self.succeed("simulate", scene, "-o", "out")
        before = tree_bytes(self.dir / "out")
        result = self.expect_exit(2, "simulate", scene, "-o", "out")
        self.assertIn("--force", result.stderr)
        self.assertEqual(tree_bytes(self.dir / "out"), before)
        self.succeed("simulate", scene, "-o", "out", "--force")

    def test_force_removes_what_pilesim_wrote_and_nothing_else(self):
        scene = self.write_scene()
        (self.dir / "notes.txt").write_text("years of work")
        (self.dir / "frames").mkdir()
        (self.dir / "frames/frame.cover.png").write_text("mine")
        kept = tree_bytes(self.dir)
        self.succeed("simulate", scene, "-o", ".")
        (self.dir / "frames/frame.0003.png").write_text("of the run before")
        (self.dir / "video.mp4").write_text("of the run before")
        self.expect_exit(2, "simulate", scene, "-o", ".")
        self.succeed("simulate", scene, "-o", ".", "--force")
        left = tree_bytes(self.dir)
        self.assertEqual({name: left.get(name) for name in kept}, kept)
        others = {name.split("/")[0] for name in left if name not in kept}
        self.assertEqual(others, {"trajectory.zarr", "timing.csv", "report.json", "report.html"})

    def test_output_through_a_link(self):
        scene = self.write_scene()
        (self.dir / "disk").mkdir()
        (self.dir / "out").symlink_to("disk")
        self.succeed("simulate", scene, "-o", "out")
        self.succeed("simulate", scene, "-o", "out", "--force")
        self.assertTrue((self.dir / "out").is_symlink())
        self.assertTrue((self.dir / "disk/report.json").exists())

    def test_existing_output_is_refused_before_anything_else(self):
        self.succeed("simulate", self.write_scene(), "-o", "out")
        self.expect_exit(2, "simulate", "nowhere.json", "-o", "out")

    def test_output_without_a_name(self):
        result = self.expect_exit(2, "simulate", self.write_scene(), "-o", "")
        self.assertIn("output", result.stderr)

    def test_an_invalid_scene_touches_nothing(self):
        def spoil(scene):
            scene["emitters"][0]["material"] = "gold"

        self.expect_exit(3, "simulate", self.write_scene(spoil), "-o", "out")
        self.assertFalse((self.dir / "out").exists())

    def test_output_below_a_file(self):
        (self.dir / "file").write_text("")
        result = self.expect_exit(4, "simulate", self.write_scene(), "-o", "file/out")
        self.assertIn("file/out", result.stderr)


class Accidents(CommandTest):
    def start(self, scene):
        process = subprocess.Popen(
            [PILESIM, "simulate", scene, "-o", "out", "--progress", "none"],
            cwd=self.dir,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        timing = self.dir / "out/timing.csv"
        for _ in range(600):
            if timing.exists() and timing.read_text().count("\n") > 200:
                return process
            time.sleep(0.05)
        process.kill()
        raise AssertionError("the run did not start")

    def test_ctrl_c_during_set_up_ends_at_once_and_leaves_nothing(self):
        def slow_to_set_up(scene):
            scene["shapes"]["box"] = {
                "type": "mesh",
                "file": str(SOURCE / "assets/biped.obj"),
                "collision": "decomposition",
                "decomposition_max_pieces": 256,
                "decomposition_max_volume_error": 1e-6,
            }

        cache = self.dir / "cache"
        process = subprocess.Popen(
            [PILESIM, "simulate", self.write_scene(slow_to_set_up), "-o", "out"],
            cwd=self.dir,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "XDG_CACHE_HOME": str(cache)},
        )
        self.addCleanup(process.kill)
        time.sleep(1)
        self.assertIsNone(process.poll())
        process.send_signal(signal.SIGINT)
        self.assertEqual(process.wait(timeout=10), -signal.SIGINT)
        self.assertFalse((self.dir / "out").exists())
        self.assertEqual(tree_bytes(cache), {})

    def test_gnuplot_missing_costs_the_charts_only(self):
        environment = {**os.environ, "PATH": str(self.dir)}
        result = self.succeed("simulate", self.write_scene(), "-o", "out", env=environment)
        self.assertRegex(result.stderr, r"^pilesim: warning: .*no charts.*gnuplot.*apt install")
        self.assertIn("16 frames", result.stdout)
        page = (self.dir / "out/report.html").read_text()
        self.assertIn("no charts", page)
        self.assertIn("gnuplot", page)
        self.assertIn("Time by stage", page)

    def frames_on_disk(self):
        store = zarr.open(str(self.dir / "out/trajectory.zarr"), mode="r")
        count = min(store[name].shape[0] for name in ("position", "orientation", "state"))
        self.assertGreater(float(abs(store["position"][:count]).sum()), 0)
        return count

    def test_ctrl_c_leaves_a_complete_shorter_result(self):
        process = self.start(self.write_scene(long_scene))
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=60)
        self.assertEqual(process.returncode, 130, errors)
        self.assertIn("interrupted", errors)
        frames = self.frames_on_disk()
        self.assertGreater(frames, 200)
        self.assertTrue(json.loads((self.dir / "out/report.json").read_text())["interrupted"])
        with open(self.dir / "out/timing.csv") as file:
            self.assertEqual(len(list(csv.DictReader(file))), frames)
        self.succeed("render", "out", "--frames", f"{frames - 1}")

    def test_kill_9_leaves_a_valid_shorter_trajectory(self):
        process = self.start(self.write_scene(long_scene))
        time.sleep(1.2)
        process.kill()
        process.communicate(timeout=60)
        frames = self.frames_on_disk()
        self.assertGreater(frames, 0)
        self.succeed("render", "out", "--frames", "0")

    def test_full_disk_is_an_error_that_loses_nothing_written(self):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))

        result = self.expect_exit(
            4,
            "simulate",
            self.write_scene(long_scene),
            "-o",
            "out",
            preexec_fn=limit,
        )
        self.assertRegex(result.stderr, r"cannot be written")
        self.assertRegex(result.stderr, r"holds the \d+ frames")
        leftovers = [name for name in os.listdir(self.dir / "out") if name.endswith(".tmp")]
        self.assertEqual(leftovers, [])
        store = zarr.open(str(self.dir / "out/trajectory.zarr"), mode="r")
        self.assertEqual(store["position"].shape[1:], (9, 3))


if __name__ == "__main__":
    unittest.main()
