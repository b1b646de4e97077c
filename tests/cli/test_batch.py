"""`pilesim batch` as a user calls it: tables, kills, exit codes."""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import unittest
import unittest.mock

from support import BOX_OBJ, SOURCE, CommandTest, tree_bytes

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
        for number, fault in enumerate(("kill", signal.SIGINT, "kill", signal.SIGTERM, "kill", "kill"), 2):
            struck = self.at_change("batch", fault, 3 * number)
            done = self.run_pilesim("batch", "plan.json", "-o", "killed", "-q", env=struck)
            self.assertEqual(done.returncode, -signal.SIGKILL if fault == "kill" else 130)
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


VIEWS = [["simulate"], ["render", "--frames", "last", "--camera", "views", "--no-video", "--passes", "depth,ids",
                        "--annotations", "coco,bop"]]


def times_left_out(directory):
    """All bytes but those that are of the moment."""
    files = tree_bytes(directory)
    for name in list(files):
        if re.search(r"(job\.json|log\.txt|table\.csv|report\.(json|html)|timing\.csv|^plan\.json|^shards/.*)$", name):
            del files[name]
    return files


class CollectionTest(CommandTest):
    """Datasets of all jobs together."""

    def setUp(self):
        super().setUp()
        sys.path.insert(0, str(SOURCE / "python"))
        views = {"name": "views", "random_views": {"count": 2, "target": [0, 0, 0], "distance_m": [0.5, 0.8],
                                                   "elevation_deg": [40, 80]}}
        self.scene = SCENE | {"cameras": [views]}
        self.plan = {"version": 1, "scene": "scene.json", "steps": VIEWS, "collect": ["coco", "bop", "tar"],
                     "tar_jobs": 2, "drop": ["run/trajectory.zarr", "run/checkpoint.bin"],
                     "vary": [{"set": "/shapes/box/size", "values": [[.1, .06, .04], [.12, .06, .04], [.1, .06, .04]]}]}
        self.write("scene.json", self.scene)
        self.write("plan.json", self.plan)

    def write(self, name, value):
        (self.dir / name).write_text(json.dumps(value))

    def batch(self, out, *words):
        return self.succeed("batch", "plan.json", "-o", out, *words).stdout

    def test_one_dataset_of_all_jobs(self):
        import numpy
        import pilesim_batch

        printed = self.batch("out")
        self.assertIn("bop: 6 scenes, 2 models", printed)
        self.assertIn("tar: 2 files, 6 samples of 3 jobs", printed)
        pictures = pilesim_batch.Pictures(pilesim_batch.Batch(self.dir / "out"))
        coco = pilesim_batch.Coco(self.dir / "out/coco.json")
        bop = pilesim_batch.Bop(self.dir / "out/bop")
        samples = list(pilesim_batch.Samples(self.dir / "out"))
        self.assertEqual([len(coco), len(bop), len(samples), len(pictures)], [6] * 4)
        self.assertEqual([i["id"] for i in coco.images], list(range(1, 7)))
        sizes = [self.plan["vary"][0]["values"][i // 2] for i in range(6)]
        for place, (picture, told, scene, sample, size) in enumerate(zip(pictures, coco, bop, samples, sizes)):
            with self.subTest(place):
                self.assertEqual(told["job"], picture["job"])
                self.assertEqual(sample["job"], picture["job"])
                self.assertEqual(sample["values"], {"/shapes/box/size": size})
                for other in (told, scene, sample):
                    numpy.testing.assert_array_equal(other["image"], picture["image"])
                for name in ("depth", "ids", "K", "R", "t"):
                    numpy.testing.assert_allclose(sample[name], picture[name])
                numpy.testing.assert_allclose(scene["depth"], picture["depth"])
                numpy.testing.assert_allclose(scene["t"], picture["t"])
                self.assertGreater(len(told["annotations"]), 0)
                self.assertEqual(len(sample["annotations"]), len(told["annotations"]))
                for annotation, packed in zip(told["annotations"], sample["annotations"]):
                    numpy.testing.assert_array_equal(annotation["mask"], picture["ids"] == annotation["instance"])
                    self.assertEqual(packed["segmentation"], annotation["segmentation"])
                    self.assertEqual((packed["category"], annotation["category"]), ("box", "box"))
                seen = [body for body in scene["objects"] if body["px_count_visib"] > 0]
                self.assertEqual(len(seen), len(told["annotations"]))
                for body, annotation in zip(seen, told["annotations"]):
                    numpy.testing.assert_array_equal(body["mask_visib"], annotation["mask"])
                    numpy.testing.assert_allclose(body["R"], annotation["R"])
                    numpy.testing.assert_allclose(body["t"], annotation["t"])
                    # Each object has its own job's model.
                    self.assertAlmostEqual(bop.models[str(body["id"])]["size_x"], 1000 * size[0], places=3)

    def test_the_same_bytes_in_parts_and_after_a_kill(self):
        self.batch("whole", "-q")
        for i in (1, 0):
            self.batch("out", "-q", "--shard", f"{i}/2")
        # A killed collection may leave fewer files, and incomplete ones.
        self.batch("out", "--collect", "-q")
        whole = times_left_out(self.dir / "whole")
        self.assertEqual(times_left_out(self.dir / "out"), whole)
        shutil.rmtree(self.dir / "out/bop/train_pbr/000002")
        (self.dir / "out/bop/train_pbr/.000002.part").mkdir()
        (self.dir / "out/bop/train_pbr/000006").mkdir()  # of a larger batch
        (self.dir / "out/tar/000001.json").unlink()
        (self.dir / "out/coco.json").write_text("{")
        kept = (self.dir / "out/tar/000000.tar").stat().st_mtime_ns
        self.batch("out", "--collect", "-q")
        self.assertEqual(times_left_out(self.dir / "out"), whole)
        self.assertEqual((self.dir / "out/tar/000000.tar").stat().st_mtime_ns, kept)

    def test_what_only_exr_has_is_in_tar_files(self):
        import numpy
        import pilesim_batch

        steps = [VIEWS[0], ["render", "--frames", "5", "--camera", "views", "--no-video",
                            "--passes", "depth,ids,normals,motion"]]
        self.write("plan.json", self.plan | {"steps": steps, "vary": [], "collect": ["tar"]})
        self.batch("out")
        batch = pilesim_batch.Batch(self.dir / "out")
        samples = list(pilesim_batch.Samples(self.dir / "out"))
        pictures = pilesim_batch.Pictures(batch)
        self.assertEqual(len(samples), 2)
        for sample, picture, view in zip(samples, pictures, batch[0].views().values()):
            for name in ("normals", "motion"):
                numpy.testing.assert_array_equal(sample[name], picture[name])
            seen = sample["ids"] > 1  # 1 is the ground
            self.assertGreater(seen.sum(), 0)
            self.assertGreater(numpy.mean(sample["motion"][seen, 1]), 1)  # pixels: they fall
            numpy.testing.assert_allclose(numpy.linalg.norm(sample["normals"][seen], axis=-1), 1, atol=1e-5)
            layers = pilesim_batch.read_exr(view / "passes/frame.0005.exr")
            numpy.testing.assert_array_equal(layers["ids"], sample["ids"])
            numpy.testing.assert_allclose(layers["depth"][seen], sample["depth"][seen], atol=1e-3)
            png = pilesim_batch.read_png(view / "passes/normals.0005.png")
            numpy.testing.assert_allclose((png[seen] - 32768.) / 32767, layers["normals"][seen], atol=1e-4)
            # Not by Pillow, which would make 8 bits of it, whether it is installed or not.
            with unittest.mock.patch.object(pilesim_batch, "Image"):
                again = pilesim_batch.read_png(view / "passes/normals.0005.png")
            numpy.testing.assert_array_equal(again, png)

    def test_lights_and_materials_anew(self):
        import pilesim_batch

        light = {"azimuth_deg": {"random": {"from": 0, "to": 360}}}
        self.write("scene.json", self.scene | {"render": {"size": [32, 24], "light": light}})
        last = ["render", "--frames", "last", "--no-video"]
        steps = [["simulate"], last,
                 [*last, "-o", "low", "--set", "/render/light/azimuth_deg={from}", "--set", "/render/light/sun=0.5"],
                 ["simulate", "--set", "/duration_s=0.1", "--set", "/emitters/0/colour={look}"], last]
        self.write("plan.json", {"version": 1, "scene": "scene.json", "steps": steps, "count": 2, "vary": [
            {"set": "from", "uniform": [0, 360]}, {"set": "look", "choice": ["#aa2200"]}]})
        self.batch("out")
        suns = set()
        for job in pilesim_batch.Batch(self.dir / "out"):
            shown = {str(name): next(view.glob("frames/*.png")).read_bytes() for name, view in job.views().items()}
            self.assertEqual(len(set(shown.values())), 3)
            for run in job.runs:
                resolved = json.loads((run / "trajectory.zarr/.zattrs").read_text())
                suns.add(json.dumps(resolved["scene"]["render"]["light"]["azimuth_deg"]))
        self.assertEqual(len(suns), 4)  # sampled again for each run of each job

    def test_what_is_packed_may_be_dropped(self):
        import pilesim_batch

        self.write("plan.json", self.plan | {"collect": ["tar"], "drop_packed": ["run"]})
        self.batch("out")
        self.assertEqual(list((self.dir / "out").rglob("*.png")), [])
        self.assertEqual(len(list(pilesim_batch.Samples(self.dir / "out", part=1, parts=2))), 2)
        before = tree_bytes(self.dir / "out/tar")
        self.assertIn("3 of 3 jobs done", self.batch("out"))
        self.batch("out", "--collect")
        self.assertEqual(tree_bytes(self.dir / "out/tar"), before)
        # A job that cannot be packed again says so.
        (self.dir / "out/tar/000000.tar").unlink()
        again = self.expect_exit(3, "batch", "plan.json", "-o", "out")
        self.assertIn("was packed into a tar file and dropped", again.stderr)

    def test_a_bin_that_is_emptied(self):
        import numpy
        import pilesim_batch

        self.write("scene.json", self.scene | {"duration_s": 1.5})
        steps = VIEWS + [["export", "-o", "1.npz"]]
        for i in (2, 3):
            steps += [["simulate", "--take", "2"], VIEWS[1], ["export", "-o", f"{i}.npz"]]
        self.write("plan.json", self.plan | {"steps": steps, "vary": [], "collect": ["tar"]})
        self.batch("out")
        job = pilesim_batch.Batch(self.dir / "out")[0]
        self.assertEqual([run.name for run in job.runs], ["run", "run_2", "run_3"])
        before, *later = (job.poses(f"{i}.npz")["position"][:, 1:] for i in (1, 2, 3))  # without the ground
        for after, left in zip(later, (3, 1)):
            lowest = numpy.sort(before[-1, :, 1])[:left]
            # Places on disk are singles about an origin that each run has of its own, within 1 m here.
            numpy.testing.assert_allclose(numpy.sort(after[0, :, 1]), lowest, rtol=0, atol=numpy.finfo("float32").eps)
            before = after
        keys = [sample["key"] for sample in pilesim_batch.Samples(self.dir / "out")]
        self.assertEqual(len(keys), 6)
        self.assertTrue(keys[-1].startswith("0000000_run_3_cameras_views_001_"))


class OtherCommandsTest(CommandTest):
    """Steps other than simulations take the same path."""

    def batch(self, plan):
        (self.dir / "plan.json").write_text(json.dumps({"version": 1} | plan))
        self.succeed("batch", "plan.json", "-o", "out", "-q")
        return [self.dir / "out/jobs/0000" / f"{i:07}" for i in range(2)]

    def test_many_meshes(self):
        (self.dir / "meshes").mkdir()
        for name in "ab":
            (self.dir / f"meshes/{name}.obj").write_text(BOX_OBJ.replace("0.9", "0.8" if name == "a" else "0.7"))
        jobs = self.batch({"vary": [{"set": "mesh", "files": "meshes/*.obj"}],
                           "steps": [["sample-signature", "{mesh}", "--trials", "2", "--exemplars", "0",
                                      "--rest-drops", "2", "--no-accuracy", "--pours", "0"]]})
        first, second = ((job / "signature.sig").read_bytes() for job in jobs)
        self.assertNotEqual(first, second)

    def test_ranges_of_frames(self):
        self.succeed("simulate", self.write_scene(), "-o", "pile")
        jobs = self.batch({"vary": [{"set": "frames", "values": ["0-2", "3-4"]}],
                           "steps": [["render", "pile", "--frames", "{frames}", "--no-video"]]})
        self.succeed("render", "pile", "-o", "whole", "--frames", "0-4", "--no-video")
        parts = {**tree_bytes(jobs[0] / "run/frames"), **tree_bytes(jobs[1] / "run/frames")}
        self.assertEqual(parts, tree_bytes(self.dir / "whole/frames"))

    def test_comparisons(self):
        self.write_scene()
        jobs = self.batch({"scene": "scene.json", "vary": [{"set": "/materials/wood/friction", "values": [0.2, 0.8]}],
                           "steps": [["compare", "--modes", "impulse", "--runs", "3", "--times", "1"]]})
        for job in jobs:
            json.loads((job / "comparison/compare.json").read_text())


if __name__ == "__main__":
    unittest.main()
