"""python/pilesim.py: scenes as dictionaries, runs, poses and pictures as numpy."""

import os
import runpy
import sys
import unittest
from unittest import mock

import numpy

from support import BOXES, SOURCE, CommandTest

sys.path.insert(0, str(SOURCE / "python"))
sys.dont_write_bytecode = True

import pilesim  # noqa: E402
import pilesim_batch  # noqa: E402


class Python(CommandTest):
    def setUp(self):
        super().setUp()
        here = os.getcwd()
        os.chdir(self.dir)
        self.addCleanup(os.chdir, here)

    def test_a_dictionary_is_run_and_comes_back_as_arrays(self):
        run = pilesim.simulate(BOXES, "out", seed=5, values={"/duration_s": 0.2}, options=["--no-picture"])
        self.assertEqual(run.position.shape, (7, 9, 3))
        self.assertEqual(run.orientation.shape, (7, 9, 4))
        numpy.testing.assert_allclose(numpy.linalg.norm(run.orientation, axis=-1), 1, atol=1e-6)
        numpy.testing.assert_allclose(run.time_s, numpy.arange(7) / 30)
        self.assertEqual(run.names[:2], ["ground", "boxes/0"])
        self.assertEqual(run.moves.tolist(), [False] + 8 * [True])
        self.assertTrue(run.present.all())
        # Free fall: the closed form.
        fallen = run.position[0, 1:, 1] - run.position[3, 1:, 1]
        numpy.testing.assert_allclose(fallen, 0.5 * 9.81 * 0.1**2, rtol=0.05)
        again = pilesim.simulate(self.write_scene(), "again", seed=5, values={"/duration_s": 0.2},
                                 options=["--no-picture"])
        numpy.testing.assert_array_equal(again.position, run.position)

    def test_pictures_are_arrays(self):
        run = pilesim.simulate(BOXES, "out", values={"/duration_s": 0.1}, options=["--no-picture"])
        picture = run.picture(size=(64, 48))
        self.assertEqual((picture.shape, picture.dtype), ((48, 64, 3), numpy.uint8))
        numpy.testing.assert_array_equal(run.pictures("2-3", size=(64, 48))[1], picture)
        self.assertEqual(run.pictures(size=(64, 48), options=["--orbit", "0.1s"]).shape, (3, 48, 64, 3))
        self.assertFalse((self.dir / "out/frames").exists())
        with self.assertRaisesRegex(ValueError, "'--camera', 'all'.* draw into no frames/"):
            run.pictures(size=(64, 48), options=["--camera", "all"])

    def test_pictures_are_in_the_order_of_their_frames(self):
        values = {"/duration_s": 0.1, "/frame_rate": 1e5}
        run = pilesim.simulate(BOXES, "out", values=values, options=["--no-picture"])
        early, late = run.pictures("1001,10000", size=(64, 48))
        numpy.testing.assert_array_equal(early, run.picture(1001, size=(64, 48)))
        self.assertFalse(numpy.array_equal(early, late))

    def test_what_is_wrong_names_the_place(self):
        with self.assertRaises(pilesim.PilesimError) as raised:
            pilesim.check({**BOXES, "duraton_s": 1})
        self.assertEqual(raised.exception.code, 3)
        self.assertIn('/duraton_s: is no key of a scene', str(raised.exception))
        self.assertIn('Did you mean "duration_s"?', str(raised.exception))
        self.assertEqual(pilesim.check(BOXES, seed=9)["seed"], 9)
        self.assertIn("materials", pilesim.schema()["properties"])
        pilesim.simulate(BOXES, "out", values={"/duration_s": 0.1}, options=["--no-picture"])
        with self.assertRaises(pilesim.PilesimError) as raised:
            pilesim.simulate(BOXES, "out")
        self.assertEqual(raised.exception.code, 2)

    def test_values_may_be_of_numpy(self):
        heights = numpy.array([0, 2, 0], numpy.float32)
        scene = pilesim.check({**BOXES, "seed": numpy.int64(4)},
                              values={"/duration_s": numpy.float32(0.5), "/emitters/0/centre": heights})
        self.assertEqual((scene["seed"], scene["duration_s"], scene["emitters"][0]["centre"]), (4, 0.5, [0, 2, 0]))
        with self.assertRaisesRegex(TypeError, r"the value of /seed holds a set, \{4\}; expected numbers, text"):
            pilesim.check(BOXES, values={"/seed": {4}})

    def test_what_is_missing_is_said_in_words(self):
        with self.assertRaisesRegex(pilesim.PilesimError, "^nowhere: holds no trajectory.zarr; expected"):
            pilesim.Run("nowhere")
        (self.dir / "begun/trajectory.zarr").mkdir(parents=True)
        (self.dir / "begun/trajectory.zarr/.zgroup").write_text('{"zarr_format": 2}')
        with self.assertRaisesRegex(pilesim.PilesimError, "report.json: is not there: the run has not ended"):
            pilesim.Run("begun").report
        with self.assertRaisesRegex(FileNotFoundError, "^nowhere: holds no plan.json; expected the directory"):
            pilesim_batch.Batch("nowhere")
        with mock.patch.dict(os.environ, {"PILESIM": "/no/such/pilesim"}):
            with self.assertRaisesRegex(pilesim.PilesimError, '^the program "/no/such/pilesim" cannot be started: No'):
                pilesim.schema()

    def test_a_scene_to_start_from_can_be_changed(self):
        scene = pilesim.new("pile", SOURCE / "assets/box.obj", count=7)
        scene["materials"]["body"]["friction"] = 0.1
        self.assertEqual(pilesim.check(scene)["emitters"][0]["count"], 7)
        with self.assertRaises(ValueError):
            pilesim.new("heap", "box.obj")

    def test_the_example(self):
        printed = []
        with mock.patch("builtins.print", lambda *words: printed.append(" ".join(map(str, words)))):
            runpy.run_path(str(SOURCE / "python/example.py"))
        self.assertIn('Did you mean "duration_s"?', printed[0])
        heights = [float(line.split(": ")[1].split(" m")[0]) for line in printed[1:4]]
        self.assertLess(heights[0], heights[2])
        self.assertEqual(printed[-1], "around: (8, 240, 320, 3)")


if __name__ == "__main__":
    unittest.main()
