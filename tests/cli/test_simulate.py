"""simulate: what it writes, that it repeats, and that no accident leaves a broken result."""

import csv
import fcntl
import json
import os
import pty
import resource
import shutil
import signal
import struct
import subprocess
import termios
import unittest

import zarr
from support import HANGING, PILESIM, SOURCE, CommandTest, endless, tree_bytes


# Default material of sample-signature.
MATERIAL_OF_SIGNATURES = {"restitution": 0.3, "friction": 0.5}


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

    def test_each_figure_is_told_once_and_is_the_judges(self):
        result = self.succeed("simulate", self.write_scene(), "-o", "out", "--inspect-every", "5")
        self.assertRegex(result.stdout, r"out: 16 frames \(0\.50 s\) of 8 bodies, 1 static; it took [\d.]+ s\n")
        self.assertRegex(result.stdout, r"of the frames inspected: deepest overlap \S+ D \(\S+ m\), in frame \d+ \(0\.\d+ s\)\n")
        self.assertRegex(result.stdout, r"at the end: deepest overlap \S+ D \(\S+ m\); of 8 bodies \d unsettled, 0 escaped, ")
        page = (self.dir / "out/report.html").read_text()
        for words in (result.stdout, page):
            for of_the_solver in ("awake at the end", "not yet asleep", "contacts at the end", "the solver saw"):
                self.assertNotIn(of_the_solver, words)
        report = json.loads((self.dir / "out/report.json").read_text())
        self.assertEqual(report["counts"]["dynamic_bodies"], report["quality_at_end"]["bodies"])
        self.assertEqual(report["quality_at_end"]["frame"], 15)

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

    def test_same_scene_same_bytes_wherever_it_lies(self):
        """Two copies of a scene with its files, run from two directories into two others."""
        first, second = self.dir / "a/scenes", self.dir / "b/elsewhere/deep"
        (first / "meshes").mkdir(parents=True)
        shutil.copy(SOURCE / "assets/box.obj", first / "meshes")
        self.succeed(
            "sample-signature", "meshes/box.obj", "-o", "box.sig", "--trials", "4",
            "--exemplars", "2", "--no-accuracy", "--pours", "1", "--seed", "7",
            cwd=first,
        )  # fmt: skip

        def change(scene):
            box = {"type": "mesh", "file": "meshes/../meshes/box.obj", "signature": "box.sig"}
            scene["shapes"]["box"] = box
            scene["simulator"] = {"mode": "statistical"}
            scene["materials"]["wood"].update(MATERIAL_OF_SIGNATURES)
            heap = {"type": "volume", "file": "meshes/box.obj", "scale": 4, "spacing": 1.5}
            heap.update(shape="box", material="wood", mesh_position=[0, 8, 0])
            scene["emitters"].append(heap)

        self.write_scene(change, "a/scenes/scene.json")
        shutil.copytree(first, second)
        self.succeed("simulate", "scene.json", "-o", "../out", cwd=first)
        self.succeed("simulate", "b/elsewhere/deep/scene.json", "-o", self.dir / "b/out")
        trees = [tree_bytes(self.dir / name / "out/trajectory.zarr") for name in ("a", "b")]
        self.assertEqual(*trees)
        self.assertNotIn(str(self.dir).encode(), trees[0][".zattrs"])
        reports = [
            json.loads((self.dir / name / "out/report.json").read_text()) for name in ("a", "b")
        ]
        for report in reports:
            for key in ("time", "machine", "threads", "peak_memory_bytes"):
                del report[key]
        self.assertEqual(*reports)
        scene_hash = reports[0]["scene"]["hash"]
        self.assertEqual(json.loads(trees[0][".zattrs"])["scene_hash"], scene_hash)

        # The content of the files counts, not their names.
        (second / "meshes/box.obj").rename(second / "cube.obj")
        text = (second / "scene.json").read_text()
        text = text.replace("meshes/../meshes/box.obj", "cube.obj").replace("meshes/box.obj", "cube.obj")
        (second / "scene.json").write_text(text)
        self.assertEqual(self.hash_of_run("b/elsewhere/deep/scene.json"), scene_hash)
        with open(second / "cube.obj", "a") as mesh:
            mesh.write("# changed\n")
        self.assertNotEqual(self.hash_of_run("b/elsewhere/deep/scene.json"), scene_hash)

        # A trajectory is drawn without its scene.
        shutil.rmtree(self.dir / "a/scenes")
        self.succeed("render", "a/out", "-o", "pictures", "--frames", "0", "--no-video")

    def hash_of_run(self, scene):
        self.succeed("simulate", scene, "-o", "again", "--force")
        return json.loads((self.dir / "again/report.json").read_text())["scene"]["hash"]

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
        self.assertEqual(
            others,
            {"trajectory.zarr", "timing.csv", "report.json", "report.html", "checkpoint.bin"},
        )

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

    def test_a_bar_fits_into_a_narrow_terminal(self):
        def scene(document):
            document.update(duration_s=30, simulator={"sleeping": False})

        main, terminal = pty.openpty()
        fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 40, 0, 0))
        process = subprocess.Popen(
            [PILESIM, "simulate", self.write_scene(scene), "-o", "out"],
            cwd=self.dir,
            stdout=subprocess.DEVNULL,
            stderr=terminal,
        )
        self.addCleanup(process.kill)
        os.close(terminal)
        shown = b""
        try:
            while piece := os.read(main, 65536):
                shown += piece
        except OSError:  # the terminal has closed
            pass
        os.close(main)
        self.assertEqual(process.wait(timeout=HANGING), 0)
        for line in shown.decode().replace("\n", "\r").split("\r"):
            self.assertLess(len(line.replace("\033[K", "")), 40, line)

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
    def start(self, scene, **options):
        process = subprocess.Popen(
            [PILESIM, "simulate", scene, "-o", "out", "--progress", "none"],
            cwd=self.dir,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            **options,
        )
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.stderr.close)
        timing = self.dir / "out/timing.csv"
        self.addCleanup(process.kill)
        self.wait_until(process, lambda: timing.exists() and timing.read_text().count("\n") > 200)
        return process

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
        # The place for what is decomposed is made just before.
        struck = self.at_change("simulate", signal.SIGINT, 1, under=cache)
        # Ended by the signal itself, which waits for nothing.
        self.expect_exit(-signal.SIGINT, "simulate", self.write_scene(slow_to_set_up), "-o", "out",
                         env={**struck, "XDG_CACHE_HOME": str(cache)})
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

    def expect_complete_shorter_result(self, process):
        _, errors = process.communicate(timeout=HANGING)
        self.assertEqual(process.returncode, 130, errors)
        self.assertIn("interrupted", errors)
        frames = self.frames_on_disk()
        self.assertGreater(frames, 200)
        self.assertTrue(json.loads((self.dir / "out/report.json").read_text())["interrupted"])
        with open(self.dir / "out/timing.csv") as file:
            self.assertEqual(len(list(csv.DictReader(file))), frames)
        return frames

    def test_ctrl_c_leaves_a_complete_shorter_result(self):
        process = self.start(self.write_scene(endless))
        process.send_signal(signal.SIGINT)
        frames = self.expect_complete_shorter_result(process)
        self.succeed("render", "out", "--frames", f"{frames - 1}")

    def test_a_polite_kill_and_a_terminal_that_closes_do_so_too(self):
        process = self.start(self.write_scene(endless))
        process.send_signal(signal.SIGTERM)
        self.expect_complete_shorter_result(process)
        shutil.rmtree(self.dir / "out")
        process = self.start("scene.json")
        for _ in range(3):  # by the terminal, the shell and the session
            process.send_signal(signal.SIGHUP)
        self.expect_complete_shorter_result(process)

    def test_nohup_holds(self):
        process = self.start(
            self.write_scene(endless),
            preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN),
        )
        process.send_signal(signal.SIGHUP)
        rows = (self.dir / "out/timing.csv").read_text().count("\n")
        more = lambda: (self.dir / "out/timing.csv").read_text().count("\n") > rows + 100
        self.wait_until(process, more)
        process.kill()
        process.communicate(timeout=HANGING)

    def test_kill_9_leaves_a_valid_shorter_trajectory(self):
        process = self.start(self.write_scene(endless))
        shape = self.dir / "out/trajectory.zarr/position/.zarray"
        self.wait_until(process, lambda: json.loads(shape.read_text())["shape"][0] > 0)
        process.kill()
        process.communicate(timeout=HANGING)
        frames = self.frames_on_disk()
        self.assertGreater(frames, 0)
        self.succeed("render", "out", "--frames", "0")

    def test_what_leaves_all_bounds_names_the_scene(self):
        def burst(scene):
            scene["simulator"] = {"mode": "particle"}
            scene["materials"]["wood"]["density_kg_m3"] = 0.001
            scene["shapes"]["box"]["size"] = [0.001, 0.001, 0.001]
            scene["events"] = [{"time_s": 0.05, "type": "impulse", "bodies": ["boxes/0"],
                                "impulse": [1e-4, 1e-4, 1e-4], "point": [1e9, 0, -1e9]}]

        result = self.expect_exit(3, "simulate", self.write_scene(burst), "-o", "out")
        self.assertRegex(result.stderr, r"scene\.json: body 'boxes/0' left all bounds in frame \d+; ")
        self.assertRegex(
            result.stderr,
            r"out/trajectory\.zarr: holds (1 complete frame|(\d\d+|[02-9]) complete frames) and is valid\n",
        )

    def test_full_disk_is_an_error_that_loses_nothing_written(self):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))

        result = self.expect_exit(
            4,
            "simulate",
            self.write_scene(endless),
            "-o",
            "out",
            preexec_fn=limit,
        )
        self.assertRegex(result.stderr, r"cannot be written")
        self.assertRegex(result.stderr, r"holds \d+ complete frames? and is valid")
        leftovers = [name for name in os.listdir(self.dir / "out") if name.endswith(".tmp")]
        self.assertEqual(leftovers, [])
        store = zarr.open(str(self.dir / "out/trajectory.zarr"), mode="r")
        self.assertEqual(store["position"].shape[1:], (9, 3))


if __name__ == "__main__":
    unittest.main()
