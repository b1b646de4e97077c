"""`pilesim batch` as a user calls it: tables, kills, exit codes."""

import json
import os
import random
import signal
import subprocess
import sys
import unittest

from support import PILESIM, SOURCE, CommandTest

SCENE = {
    "version": 1, "duration_s": 0.5, "frame_rate": 20, "materials": {"wood": {}},
    "shapes": {"ground": {"type": "plane"}, "box": {"type": "box", "size": [0.1, 0.06, 0.04]}},
    "bodies": [{"name": "ground", "shape": "ground", "material": "wood", "role": "static"}],
    "emitters": [{"name": "boxes", "type": "disk", "shape": "box", "material": "wood",
                  "centre": [0, 0.5, 0], "radius": 0.15, "height": 0.4, "count": 5}],
    "render": {"size": [32, 24]}}
PLAN = {"version": 1, "scene": "scene.json", "count": 3,
        "vary": [{"set": "/materials/wood/friction", "values": [0.2, 0.6]},
                 {"set": "/emitters/0/count", "integers": [3, 9]}],
        "steps": [["simulate"], ["render", "--frames", "0-0", "--no-video"], ["export", "-o", "pile.npz"]]}


class BatchTest(CommandTest):
    def write(self, name, value):
        (self.dir / name).write_text(json.dumps(value))

    def setUp(self):
        super().setUp()
        self.write("scene.json", SCENE)
        self.write("plan.json", PLAN)

    def test_makes_every_job_and_tables_of_them(self):
        done = self.run_pilesim("batch", "plan.json", "-o", "out")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("6 of 6 jobs done", done.stdout)
        job = self.dir / "out/jobs/0000/0000004"
        self.assertTrue((job / "run/frames/frame.0000.png").is_file())
        self.assertTrue((job / "pile.npz").is_file())
        record = json.loads((job / "job.json").read_text())
        report = json.loads((job / "run/report.json").read_text())
        self.assertEqual(report["seed"], record["attempts"][0]["seed"])
        self.assertEqual(report["counts"]["dynamic_bodies"], record["values"]["/emitters/0/count"])
        lines = [json.loads(line) for line in (self.dir / "out/index.jsonl").read_text().splitlines()]
        self.assertEqual([line["id"] for line in lines], [f"{i:07}" for i in range(6)])
        self.assertEqual((self.dir / "out/table.csv").read_text().count("\n"), 7)

    def test_ends_with_the_same_bytes_however_it_is_killed(self):
        self.assertEqual(self.run_pilesim("batch", "plan.json", "-o", "whole", "-q").returncode, 0)
        random.seed(1)
        for _ in range(100):
            process = subprocess.Popen([PILESIM, "batch", "plan.json", "-o", "killed", "-q"],
                                       cwd=self.dir, stderr=subprocess.DEVNULL)
            try:
                process.wait(random.uniform(0.1, 0.8))
                break
            except subprocess.TimeoutExpired:
                process.send_signal(random.choice([signal.SIGKILL, signal.SIGINT, signal.SIGTERM]))
                process.wait()
        self.assertEqual(self.run_pilesim("batch", "plan.json", "-o", "killed", "-q").returncode, 0)
        self.assertEqual((self.dir / "killed/index.jsonl").read_bytes(),
                         (self.dir / "whole/index.jsonl").read_bytes())

    def test_a_gate_that_no_seed_passes(self):
        self.write("plan.json", PLAN | {"steps": [["simulate", "--fail-on", "unsettled>0"]], "tries": 2})
        done = self.run_pilesim("batch", "plan.json", "-o", "out")
        self.assertEqual(done.returncode, 5)
        self.assertIn("6 failed a quality gate", done.stderr)
        self.assertIn("--retry", done.stderr)
        self.assertIn("expected not unsettled>0", (self.dir / "out/table.csv").read_text())

    def test_a_step_that_takes_too_long_is_ended(self):
        self.write("scene.json", SCENE | {"duration_s": 5000})
        self.write("plan.json", PLAN | {"count": 1, "longest_s": 1})
        done = self.run_pilesim("batch", "plan.json", "-o", "out")
        self.assertEqual(done.returncode, 5)
        self.assertIn("2 took too long", done.stderr)

    def test_says_what_a_changed_plan_changes(self):
        self.run_pilesim("batch", "plan.json", "-o", "out", "-q")
        self.write("plan.json", PLAN | {"seed": 9})
        done = self.run_pilesim("batch", "plan.json", "-o", "out", "--dry-run")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("/seed: was nothing, is 9", done.stdout)
        done = self.run_pilesim("batch", "plan.json", "-o", "out")
        self.assertEqual(done.returncode, 2)
        self.assertIn("6 jobs that would be another now. Give --force", done.stderr)

    def test_shards_are_the_whole(self):
        self.run_pilesim("batch", "plan.json", "-o", "whole", "-q")
        for i in (1, 0):
            self.assertEqual(self.run_pilesim("batch", "plan.json", "-o", "out", "-q", "--shard", f"{i}/2").returncode, 0)
        self.assertEqual(self.run_pilesim("batch", "plan.json", "-o", "out", "--collect").returncode, 0)
        self.assertEqual((self.dir / "out/index.jsonl").read_bytes(),
                         (self.dir / "whole/index.jsonl").read_bytes())
        self.assertEqual(self.run_pilesim("batch", "plan.json", "-o", "out", "--shard", "2/2").returncode, 2)

    def test_slurm_scripts(self):
        done = self.run_pilesim("batch", "plan.json", "-o", "out", "--slurm", "--no-submit")
        self.assertEqual(done.returncode, 0, done.stderr)
        script = (self.dir / "out/slurm/array.sh").read_text()
        self.assertIn("#SBATCH --array=0-0\n", script)
        self.assertEqual(subprocess.run(["sh", "-n", self.dir / "out/slurm/array.sh"]).returncode, 0)
        environment = os.environ | {"SLURM_ARRAY_TASK_ID": "0"}
        subprocess.run(["sh", self.dir / "out/slurm/array.sh"], env=environment, check=True,
                       stdout=subprocess.DEVNULL)
        subprocess.run(["sh", self.dir / "out/slurm/collect.sh"], check=True, stdout=subprocess.DEVNULL)
        self.assertEqual((self.dir / "out/index.jsonl").read_text().count('"done"'), 12)

    def test_training_code_reads_it(self):
        sys.path.insert(0, str(SOURCE / "python"))
        import numpy
        import pilesim_batch

        self.write("plan.json", PLAN | {"count": 1, "steps": [
            ["simulate"], ["render", "--frames", "9", "--no-video", "--passes", "depth,ids"],
            ["export", "-o", "pile.npz"]]})
        self.assertEqual(self.run_pilesim("batch", "plan.json", "-o", "out", "-q").returncode, 0)
        batch = pilesim_batch.Batch(self.dir / "out")
        pictures = pilesim_batch.Pictures(batch)
        self.assertEqual((len(batch), len(batch.done()), len(pictures)), (2, 2, 2))
        sample = pictures[1]
        self.assertEqual((sample["job"], sample["frame"]), ("0000001", 9))
        self.assertEqual(sample["image"].shape, (24, 32, 3))
        self.assertEqual(sample["image"].dtype, numpy.uint8)
        # A body is where its camera and its pose say.
        poses = batch[1].poses()
        self.assertEqual(int(sample["ids"].max()), poses["position"].shape[1])
        seen = 0
        for body, place in enumerate(poses["position"][9]):
            q = sample["R"] @ place + sample["t"]
            column, row = (sample["K"] @ (q / q[2]))[:2].round().astype(int)
            if 0 <= column < 32 and 0 <= row < 24 and sample["ids"][row, column] == body + 1 and body > 0:
                seen += 1
                self.assertLess(abs(sample["depth"][row, column] - q[2]), 0.08)
        self.assertGreater(seen, 0)
        # Decoded here as Pillow would.
        filtered = (self.dir / "out/jobs/0000/0000001/run/frames/frame.0009.png").read_bytes()
        numpy.testing.assert_array_equal(pilesim_batch._decode_png(filtered)[..., :3], sample["image"])


if __name__ == "__main__":
    unittest.main()
