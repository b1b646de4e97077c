"""direct-pile: what it writes and reports, what it refuses, and the layers in pictures."""

import json
import unittest

import zarr
from support import BOX_OBJ, SOURCE, CommandTest, tree_bytes


def pile_of_boxes(scene):
    scene["duration_s"] = 4
    scene["emitters"][0].update(count=[3, 4, 3], centre=[0, 1.2, 0], spacing=[0.25, 0.25, 0.25])
    scene["piles"] = [{"angle_deg": 35, "centre": [0, 0]}]


class Guides(CommandTest):
    def setUp(self):
        super().setUp()
        (self.dir / "guide.obj").write_text(BOX_OBJ)

    def filled(self, **keys):
        def change(scene):
            scene.update(duration_s=2, guide={"file": "guide.obj", "hold": "freeze"})
            scene["emitters"] = [
                {
                    "name": "boxes",
                    "type": "upside_down",
                    "shape": "box",
                    "material": "wood",
                    "count": 12,
                    "rate_hz": 20,
                    **keys,
                }
            ]

        return self.write_scene(change)

    def test_a_guide_is_filled_upside_down_and_its_bodies_released(self):
        result = self.succeed("direct-pile", self.filled(), "-o", "out")
        self.assertIn("guide: filled upside down; 12 of 12 bodies lie inside", result.stdout)
        figures = json.loads((self.dir / "out/report.json").read_text())["piles"]["guide"]
        self.assertEqual((figures["filling"]["dropped"], figures["filling"]["kept"]), (12, 12))
        # Each of the 12 bodies leaves or stays by chance: .79 +- .14 inside over 24 runs, so .04 for a mean of twelve.
        inside = []
        for seed in range(1, 13):
            self.succeed("direct-pile", self.filled(), "-o", "inside", "--seed", seed, "--no-picture", "--force")
            report = json.loads((self.dir / "inside/report.json").read_text())
            inside.append(report["piles"]["guide"]["bodies_inside"])
        self.assertGreater(sum(inside) / len(inside), 0.67)
        state = zarr.open(str(self.dir / "out/trajectory.zarr"), mode="r")["state"]
        waiting = [sum(int(flags) & 8 == 8 for flags in state[frame]) for frame in (0, 10, 60)]
        self.assertEqual(waiting[0], 11)  # the first is released at the start
        self.assertTrue(0 < waiting[1] < 11)
        self.assertEqual(waiting[2], 0)

    def test_validate_says_how_many_fit_at_most(self):
        result = self.succeed("validate", self.filled())
        self.assertIn("valid; at most 12 bodies, 1 static", result.stdout)

    def test_a_guide_of_boxes_that_overlap_is_filled_as_one(self):
        (self.dir / "hi.obj").write_bytes((SOURCE / "tests/cli/meshes/hi.obj").read_bytes())

        def change(scene):
            scene.update(duration_s=0.1, guide={"file": "hi.obj"})
            scene["shapes"]["brick"] = {"type": "box", "size": [0.14, 0.1, 0.1]}
            scene["emitters"] = [{"name": "bricks", "type": "mould", "shape": "brick", "material": "wood"}]

        scene = self.write_scene(change)
        said = self.succeed("validate", scene).stdout
        self.assertIn("guide: 2.3 x 2 x 0.4 m", said)
        self.assertIn("solid: wrapped", said)
        self.assertIn("volume error", said)
        self.succeed("direct-pile", scene, "-o", "out")
        filling = json.loads((self.dir / "out/report.json").read_text())["piles"]["guide"]["filling"]
        self.assertGreater(filling["filled_share"], 0.85)
        self.assertEqual(filling["empty"], [])

    def test_what_stays_empty_is_said_before_and_after(self):
        def change(scene):
            scene.update(duration_s=0.1, guide={"file": "guide.obj", "scale": 0.35})
            scene["emitters"] = [{"name": "boxes", "type": "mould", "shape": "box", "material": "wood", "count": 30}]
            scene["shapes"]["box"] = {"type": "box", "size": [0.05, 0.05, 0.05]}

        scene = self.write_scene(change)
        result = self.succeed("direct-pile", scene, "-o", "out")
        self.assertRegex(result.stderr, r'guide: the upper \d+ % of the guide .* is empty: .*"count"')
        report = json.loads((self.dir / "out/report.json").read_text())
        self.assertTrue(any("is empty" in note for note in report["notes"]))
        self.assertIn("is empty", (self.dir / "out/report.html").read_text())
        self.assertEqual(len(report["piles"]["guide"]["filling"]["empty"]), 1)

    def test_simulate_fills_it_too_whatever_the_threads(self):
        for name, threads in (("a", "1"), ("b", "2")):
            self.succeed("simulate", self.filled(), "-o", name, "--threads", threads)
        self.assertEqual(
            tree_bytes(self.dir / "a/trajectory.zarr"), tree_bytes(self.dir / "b/trajectory.zarr")
        )

    def test_overlay_draws_the_guide_and_dots_where_bodies_are_held(self):
        self.succeed("direct-pile", self.filled(), "-o", "out")
        written = json.loads((self.dir / "out/guide.json").read_text())
        self.assertEqual(len(written["guide"]["vertices"]), 8)
        self.assertEqual(len(written["guide"]["triangles"]), 12)
        changes = written["constraints"]
        frames = [change["frame"] for change in changes]
        self.assertEqual(frames, sorted(set(frames)))
        self.assertEqual(len(changes[-1]["points"]), written["frames"][-1]["held"])
        common = ("render", "out", "--frames", "60", "--no-video", "--size", "96x64")
        self.succeed(*common, "-o", "plain", "--set", "/render/analysis=true")
        self.succeed(*common, "-o", "over", "--overlay", "guide")
        self.succeed(*common, "-o", "beside", "--compare-with", "out")
        pictures = [
            (self.dir / name / "frames/frame.0060.png").read_bytes() for name in ("plain", "over")
        ]
        self.assertNotEqual(pictures[0], pictures[1])

    def test_overlay_of_a_damaged_file(self):
        self.succeed("direct-pile", self.filled(), "-o", "out")
        file = self.dir / "out/guide.json"
        written = json.loads(file.read_text())
        for damage in (
            {"constraints": 3},
            {"guide": {"vertices": [], "triangles": [[0, 1, 2]]}},
            {"forces": [{}]},
        ):
            file.write_text(json.dumps({**written, **damage}))
            result = self.expect_exit(
                3, "render", "out", "--overlay", "guide", "--no-video", "-o", "over"
            )
            self.assertIn("guide.json", result.stderr)

    def test_overlay_draws_the_forces_of_a_pile_that_glue_holds(self):
        def change(scene):
            scene.update(duration_s=0.2, guide={"file": "guide.obj"})
            scene["emitters"] = [
                {"name": "boxes", "type": "mould", "shape": "box", "material": "wood"}
            ]

        self.succeed("direct-pile", self.write_scene(change), "-o", "out")
        common = ("render", "out", "--frames", "6", "--no-video", "--size", "96x64")
        self.succeed(*common, "-o", "plain")
        self.succeed(*common, "-o", "over", "--overlay", "forces")
        pictures = [
            (self.dir / name / "frames/frame.0006.png").read_bytes() for name in ("plain", "over")
        ]
        self.assertNotEqual(pictures[0], pictures[1])

    def test_there_are_no_forces_where_no_pile_was_analysed_as_a_whole(self):
        self.succeed("direct-pile", self.filled(), "-o", "out")
        result = self.expect_exit(3, "render", "out", "--overlay", "forces", "-o", "over")
        self.assertIn("guide.json", result.stderr)
        self.assertIn("/forces", result.stderr)
        self.assertIn('"hold": "glue"', result.stderr)
        self.assertFalse((self.dir / "over").exists())

    def test_a_guide_that_cannot_be_filled(self):
        (self.dir / "guide.obj").write_text(BOX_OBJ.replace("v -0.4 0 -0.4", "v -0.4 -0.2 -0.4"))
        result = self.expect_exit(3, "direct-pile", self.filled(), "-o", "out")
        self.assertIn("guide.obj", result.stderr)
        self.assertIn("no level base", result.stderr)
        (self.dir / "guide.obj").write_text(BOX_OBJ)
        result = self.expect_exit(
            3, "direct-pile", self.filled(asleep=True), "-o", "out"
        )
        self.assertIn("/emitters/0/asleep", result.stderr)


class Output(CommandTest):
    def test_bodies_sleep_and_the_report_has_the_pile(self):
        result = self.succeed("direct-pile", self.write_scene(pile_of_boxes), "-o", "out")
        self.assertIn("pile: asked 35 degrees", result.stdout)
        self.assertIn("0 in the air and 0 inside another", result.stdout)
        report = json.loads((self.dir / "out/report.json").read_text())
        self.assertEqual(report["command"], "direct-pile")
        self.assertEqual(report["piles"]["pile 0"]["angle_asked_deg"], 35)
        counts = report["piles"]["all"]
        self.assertEqual((counts["asleep_in_the_air"], counts["asleep_inside_another"]), (0, 0))
        state = zarr.open(str(self.dir / "out/trajectory.zarr"), mode="r")["state"][-1]
        self.assertEqual(counts["asleep"], sum(int(flags) & 2 == 2 for flags in state))
        self.assertGreater(counts["asleep"], 30)

    def test_simulate_says_that_it_steers_nothing(self):
        scene = self.write_scene(pile_of_boxes)
        words = "pilesim direct-pile does"
        short = ("--set", "/duration_s=0.1")
        self.assertIn(words, self.succeed("simulate", scene, "-o", "plain", *short).stderr)
        self.assertNotIn(words, self.succeed("direct-pile", scene, "-o", "steered", *short).stderr)

    def test_layers_are_written_frame_by_frame_where_they_change(self):
        self.succeed("direct-pile", self.write_scene(pile_of_boxes), "-o", "out")
        layers = json.loads((self.dir / "out/piles.json").read_text())
        frames = [change["frame"] for change in layers["changes"]]
        self.assertEqual(frames, sorted(set(frames)))
        self.assertEqual(frames[0], 1)
        last = layers["changes"][-1]["piles"][0]
        self.assertEqual(last["core"], [[0, 0]])
        self.assertEqual(last["layers"][0]["bottom_m"], 0)
        radii = [layer["radius_m"] for layer in last["layers"]]
        self.assertEqual(radii, sorted(radii, reverse=True))

    def test_same_scene_same_bytes_whatever_the_threads(self):
        scene = self.write_scene(pile_of_boxes)
        for name, threads in (("a", "1"), ("b", "2")):
            self.succeed("direct-pile", scene, "-o", name, "--threads", threads)
        self.assertEqual(
            tree_bytes(self.dir / "a/trajectory.zarr"), tree_bytes(self.dir / "b/trajectory.zarr")
        )
        self.assertEqual(
            (self.dir / "a/piles.json").read_bytes(), (self.dir / "b/piles.json").read_bytes()
        )

    def test_overlay_draws_the_layers(self):
        self.succeed("direct-pile", self.write_scene(pile_of_boxes), "-o", "out")
        common = ("render", "out", "--frames", "60", "--no-video", "--size", "96x64")
        self.succeed(*common, "-o", "plain")
        self.succeed(*common, "-o", "layers", "--overlay", "piles")
        pictures = [
            (self.dir / name / "frames/frame.0060.png").read_bytes() for name in ("plain", "layers")
        ]
        self.assertNotEqual(pictures[0], pictures[1])


class Refusals(CommandTest):
    def refused(self, change, *expected):
        def scene(document):
            pile_of_boxes(document)
            change(document)

        result = self.expect_exit(3, "direct-pile", self.write_scene(scene), "-o", "out")
        for text in ("scene.json", *expected):
            self.assertIn(text, result.stderr)
        self.assertFalse((self.dir / "out").exists())

    def test_a_scene_without_piles(self):
        self.refused(lambda scene: scene.pop("piles"), "/piles", "at least one pile")

    def test_another_mode(self):
        self.refused(
            lambda scene: scene.update(simulator={"mode": "statistical"}), "/simulator/mode"
        )

    def test_angles_and_tau_out_of_range(self):
        for angle in (0, 81):
            self.refused(
                lambda scene, angle=angle: scene["piles"][0].update(angle_deg=angle),
                "/piles/0/angle_deg",
            )
        for tau in (0, 1):
            self.refused(
                lambda scene, tau=tau: scene["piles"][0].update(tau=tau), "/piles/0/tau"
            )

    def test_a_pile_under_the_ground(self):
        self.refused(lambda scene: scene["piles"][0].update(base_m=-1), "/piles/0/base_m")

    def test_a_boundary_smaller_than_a_body(self):
        boundary = {"polygon": [[-1, -0.1], [1, -0.1], [1, 0.1], [-1, 0.1]], "rim_m": 0.5}
        self.refused(
            lambda scene: scene["piles"][0].update(boundary=boundary),
            "/piles/0/boundary/polygon",
            "less than a body",
        )

    def test_gravity_that_is_not_straight_down(self):
        self.refused(lambda scene: scene.update(gravity=[1, -9.81, 0]), "/gravity")

    def test_nothing_to_pile_up(self):
        self.refused(lambda scene: scene.update(emitters=[]), "/piles/0", "nothing to pile up")

    def test_layers_of_a_run_without_piles(self):
        self.succeed("simulate", self.write_scene(), "-o", "out")
        result = self.expect_exit(2, "render", "out", "--overlay", "piles", "--no-video")
        self.assertIn("piles.json", result.stderr)


if __name__ == "__main__":
    unittest.main()
