"""Signals: what asks politely gets a shorter, whole result; what is impatient, an end at once."""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "cli"))
from bench import adopt_orphans, heed_signals, reap_orphans  # noqa: E402
from invariants import Trajectory, check_png, check_video, temporaries  # noqa: E402
from support import HANGING, PILESIM, CommandTest, endless, stop, tree_bytes, wait_until_stopped  # noqa: E402


def children(pid):
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


class SignalTest(CommandTest):
    @classmethod
    def setUpClass(cls):
        adopt_orphans()
        heed_signals()

    def start(self, *arguments, **options):
        process = subprocess.Popen(
            [PILESIM, *map(str, arguments)],
            cwd=self.dir,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            **options,
        )
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.kill)
        return process

    def rows(self, file):
        """Rows of timing.csv, without the header."""
        return file.read_text().count("\n") - 1 if file.exists() else 0

    def end_of(self, process):
        _, errors = process.communicate(timeout=HANGING)
        reap_orphans()
        return process.returncode, errors


class Simulate(SignalTest):
    def interrupted_by(self, *signals, **options):
        process = self.start("simulate", self.write_scene(endless), "-o", "out", **options)
        self.wait_until(process, lambda: self.rows(self.dir / "out/timing.csv") > 20)
        for number in signals:
            process.send_signal(number)
        return self.end_of(process)

    def check_shorter(self):
        report = json.loads((self.dir / "out/report.json").read_text())
        self.assertTrue(report["interrupted"])
        frames = Trajectory(self.dir / "out/trajectory.zarr").count
        with open(self.dir / "out/timing.csv") as file:
            self.assertEqual(len(list(csv.DictReader(file))), frames)
        self.assertGreater(frames, 20)
        self.assertEqual(temporaries(self.dir), [])

    def test_each_polite_signal_leaves_a_report(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            with self.subTest(number.name):
                code, errors = self.interrupted_by(number)
                self.assertEqual(code, 130, errors)
                self.assertIn("interrupted", errors)
                self.check_shorter()
                shutil.rmtree(self.dir / "out")

    def test_a_terminal_that_closes_says_so_twice(self):
        code, errors = self.interrupted_by(signal.SIGHUP, signal.SIGHUP)
        self.assertEqual(code, 130, errors)
        self.check_shorter()

    def test_nohup(self):
        code, errors = self.interrupted_by(
            signal.SIGHUP,
            signal.SIGTERM,
            preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN),
        )
        self.assertEqual(code, 130, errors)
        self.succeed(
            "simulate", "scene.json", "-o", "out", "--force", "--set", "/duration_s=2",
            preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN),
            env=self.at_change("simulate", signal.SIGHUP, 3, "/timing.csv"),
        )

    def test_while_it_is_set_up_it_ends_at_once_and_touches_nothing(self):
        def many(scene):  # which takes seconds to set up
            scene["emitters"] = [{**scene["emitters"][0], "count": [100, 100, 50]}]

        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            process = self.start("simulate", self.write_scene(many), "-o", "out")
            name = Path(f"/proc/{process.pid}/comm")
            self.wait_until(process, lambda name=name: name.read_text() == "pilesim\n")
            process.send_signal(number)
            self.assertEqual(self.end_of(process)[0], -number)
            self.assertFalse((self.dir / "out").exists())


class Render(SignalTest):
    def setUp(self):
        super().setUp()
        self.succeed("simulate", self.write_scene(), "-o", "run", "--set", "/frame_rate=120")

    def start_rendering(self):
        """It has stopped after two pictures, and goes on with SIGCONT."""
        struck = self.at_change("render", signal.SIGSTOP, 3, ".png", under=self.dir / "out/frames")
        process = self.start("render", "run", "-o", "out", "--size", "32x24", env=struck)
        self.assertTrue(wait_until_stopped(process))
        return process

    def test_ctrl_c_while_ffmpeg_encodes(self):
        process = self.start_rendering()
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGCONT)
        code, errors = self.end_of(process)
        self.assertEqual(code, 130, errors)
        check_video(self.dir / "out/video.mp4")
        for picture in (self.dir / "out/frames").iterdir():
            check_png(picture.read_bytes(), picture)
        self.assertEqual(temporaries(self.dir), [])

    def stopped_ffmpeg(self):
        """One that will never end by itself, so that pilesim waits for it."""
        process = self.start_rendering()
        (ffmpeg,) = children(process.pid)
        stop(ffmpeg)
        process.send_signal(signal.SIGCONT)
        return process, ffmpeg

    def check_that_nothing_half_written_is_taken_for_whole(self):
        self.assertFalse((self.dir / "out/video.mp4").exists())
        for picture in (self.dir / "out/frames").glob("frame*"):
            check_png(picture.read_bytes(), picture)
        self.succeed("render", "run", "-o", "out", "--size", "32x24", "--force", "--frames", "0-9")
        check_video(self.dir / "out/video.mp4")
        self.assertEqual(temporaries(self.dir), [])

    def test_ctrl_c_twice_ends_at_once(self):
        for first, second in (("SIGINT", "SIGINT"), ("SIGTERM", "SIGINT")):
            process, _ = self.stopped_ffmpeg()
            process.send_signal(signal.Signals[first])
            # The first one has been taken when it is no longer pending.
            self.wait_until(process, lambda process=process: self.caught_all(process))
            process.send_signal(signal.Signals[second])
            code, _ = self.end_of(process)  # which waits for ffmpeg, too
            self.assertEqual(code, -signal.Signals[second])
            self.check_that_nothing_half_written_is_taken_for_whole()
            shutil.rmtree(self.dir / "out")

    def caught_all(self, process):
        status = Path(f"/proc/{process.pid}/status").read_text()
        return "ShdPnd:\t0000000000000000" in status and "SigPnd:\t0000000000000000" in status

    def test_kill_9_takes_ffmpeg_with_it(self):
        process, ffmpeg = self.stopped_ffmpeg()
        process.kill()
        self.end_of(process)
        self.assertFalse(Path(f"/proc/{ffmpeg}").exists())
        self.check_that_nothing_half_written_is_taken_for_whole()


class Compare(SignalTest):
    COMMAND = ("compare", "scene.json", "-o", "out", "--runs", "3", "--modes", "impulse@1/120")
    FIRST = "out/runs/impulse/seed3"

    def start_comparing(self):
        self.write_scene(endless)
        process = self.start(*self.COMMAND)
        self.wait_until(process, lambda: self.rows(self.dir / self.FIRST / "timing.csv") > 5)
        return process

    def check_and_resume(self):
        self.assertFalse((self.dir / "out/compare.json").exists())
        self.write_scene(lambda scene: scene.update(duration_s=0.2))
        self.succeed(*self.COMMAND, "--resume", env={**os.environ, "PATH": str(self.dir)})
        self.assertEqual(temporaries(self.dir), [])

    def test_the_run_that_is_asked_to_stop_stops_in_good_order(self):
        for number in (signal.SIGTERM, signal.SIGHUP):
            process = self.start_comparing()
            process.send_signal(number)
            code, errors = self.end_of(process)
            self.assertEqual(code, 130, errors)
            self.assertIn("--resume", errors)
            report = json.loads((self.dir / self.FIRST / "report.json").read_text())
            self.assertTrue(report["interrupted"])
            self.check_and_resume()
            shutil.rmtree(self.dir / "out")

    def test_ctrl_c_twice_ends_at_once_where_the_run_is_stuck(self):
        for first, second in (("SIGINT", "SIGINT"), ("SIGTERM", "SIGTERM")):
            process = self.start_comparing()
            (run,) = children(process.pid)
            stop(run)  # it never takes what it is asked
            process.send_signal(signal.Signals[first])
            self.wait_until(process, lambda run=run: self.is_asked(run))
            process.send_signal(signal.Signals[second])
            code, _ = self.end_of(process)  # which waits for the run, too
            self.assertEqual(code, -signal.Signals[second])
            self.assertFalse(Path(f"/proc/{run}").exists())
            store = Trajectory(self.dir / self.FIRST / "trajectory.zarr")
            self.assertGreaterEqual(store.count, 0)
            self.check_and_resume()
            shutil.rmtree(self.dir / "out")

    def is_asked(self, run):
        """SIGTERM waits for it: pilesim has taken the first signal and passed it on."""
        status = Path(f"/proc/{run}/status").read_text()
        pending = [int(line.split()[1], 16) for line in status.splitlines() if "dPnd:" in line]
        return any(mask >> (signal.SIGTERM - 1) & 1 for mask in pending)

    def test_kill_9_takes_the_run_with_it(self):
        process = self.start_comparing()
        (run,) = children(process.pid)
        process.kill()
        self.end_of(process)  # would wait for a simulation that never ends
        self.assertFalse(Path(f"/proc/{run}").exists())
        self.check_and_resume()

    def test_an_old_report_does_not_stand_beside_new_runs(self):
        self.write_scene(lambda scene: scene.update(duration_s=0.2))
        self.succeed(*self.COMMAND, env={**os.environ, "PATH": str(self.dir)})
        self.assertTrue((self.dir / "out/compare.json").exists())
        self.write_scene(endless)
        (self.dir / self.FIRST / "timing.csv").unlink()
        process = self.start(*self.COMMAND, "--resume")
        self.wait_until(process, lambda: self.rows(self.dir / self.FIRST / "timing.csv") > 5)
        process.kill()
        self.end_of(process)
        self.assertFalse((self.dir / "out/compare.json").exists())


class SampleSignature(SignalTest):
    MESH = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"

    def test_asked_to_stop_again_and_again_it_gets_there_all_the_same(self):
        (self.dir / "a.obj").write_text(self.MESH)
        settings = ("--trials", "60", "--exemplars", "2", "--no-accuracy", "--pours", "0")
        self.succeed("sample-signature", "a.obj", "-o", "whole.sig", *settings)
        partial = self.dir / "a.sig.partial"
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            struck = self.at_change("sample-signature", number, 0)
            self.expect_exit(130, "sample-signature", "a.obj", "-o", "a.sig", *settings, env=struck)
            self.assertTrue(partial.exists())
        self.succeed("sample-signature", "a.obj", "-o", "a.sig", *settings)
        files = tree_bytes(self.dir)
        self.assertEqual(files["a.sig"], files["whole.sig"])
        self.assertFalse(partial.exists())


if __name__ == "__main__":
    unittest.main()
