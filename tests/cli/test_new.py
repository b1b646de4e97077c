"""Scenes to start from, scenes of several files and from standard input, and what starts inside."""

import json
import math
import re
import subprocess
import unittest

import numpy
import zarr

from support import BOX_OBJ, PILESIM, SOURCE, CommandTest

ASSETS = SOURCE / "assets"


def cup_obj(corners=24):
    """A cup of 8 by 9 cm with walls of 4 mm: hollow, and much less solid than it takes room."""
    rings = [(0.032, 0.0), (0.04, 0.09), (0.036, 0.09), (0.029, 0.004)]  # radius and height
    vertices = [(r * math.cos(2 * math.pi * i / corners), y, r * math.sin(2 * math.pi * i / corners))
                for r, y in rings for i in range(corners)]
    vertices += [(0, 0, 0), (0, 0.004, 0)]
    faces = []
    for i in range(corners):
        j = (i + 1) % corners
        for a, b in ((0, 1), (1, 2), (2, 3)):
            a, b = a * corners, b * corners
            faces += [(a + i, b + i, b + j), (a + i, b + j, a + j)]
        faces += [(4 * corners, i, j), (4 * corners + 1, 3 * corners + j, 3 * corners + i)]
    return ("".join("v {} {} {}\n".format(*v) for v in vertices) +
            "".join("f {} {} {}\n".format(*(k + 1 for k in face)) for face in faces))


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

    def test_what_is_flat_gets_a_thickness_and_what_is_tiny_runs(self):
        (self.dir / "card.obj").write_text("v 0 0 0\nv 0.09 0 0\nv 0.09 0 0.06\nv 0 0 0.06\nf 1 2 3 4\n")
        self.succeed("new", "pile", "card.obj", "--count", "20", "-o", "cards.json")
        self.assertIn('"thickness_m": 0.00216', (self.dir / "cards.json").read_text())
        self.succeed("simulate", "cards.json", "-o", "cards", "--fail-on", "penetration>0.02D,floating>0")
        (self.dir / "box.obj").write_text(BOX_OBJ)
        self.succeed("new", "pile", "box.obj", "--scale", "0.00002", "--count", "30", "-o", "dust.json")
        self.succeed("simulate", "dust.json", "-o", "dust", "--fail-on",
                     "penetration>0.02D,floating>0,unsettled>0,escaped>0")
        sheet = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nf 1 2 3\nf 1 3 4\nf 2 1 4\nf 2 4 3\n"  # both its sides
        (self.dir / "sheet.obj").write_text(sheet)
        self.succeed("new", "pile", "sheet.obj", "--count", "20", "-o", "sheets.json")
        self.assertIn('"thickness_m": 0.0283', (self.dir / "sheets.json").read_text())
        self.succeed("simulate", "sheets.json", "-o", "sheets", "--fail-on", "penetration>0.02D,floating>0")
        (self.dir / "points.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 0 1\n")
        self.assertIn("points.obj: ", self.expect_exit(3, "new", "pile", "points.obj").stderr)

    def test_a_guide_is_filled_with_about_as_many_and_keeps_its_shape(self):
        (self.dir / "cup.obj").write_text(cup_obj())
        (self.dir / "box.obj").write_text(BOX_OBJ)
        for mesh, count in (("cup.obj", 60), ("box.obj", 60), ("box.obj", 150)):
            # Hollow and solid, few and many.
            name = f"{mesh[:3]}{count}"
            said = self.succeed("new", "guide", mesh, "--count", str(count), "-o", f"{name}.json").stdout
            self.assertIn(f"about {count} of them", said)
            self.assertTrue((self.dir / f"{name}.guide.obj").exists())
            result = self.succeed("direct-pile", f"{name}.json", "-o", name, "--set", "/duration_s=2")
            self.assertNotIn("has not kept its shape", result.stdout + result.stderr)
            guide = json.loads((self.dir / name / "report.json").read_text())["piles"]["guide"]
            self.assertEqual(guide["bodies_inside"], 1, name)
            self.assertAlmostEqual(guide["filling"]["kept"], count, delta=count / 3, msg=name)

    def test_a_guide_of_long_bodies_is_full_of_a_number(self):
        """They find room beside each other for long, each round a few: as many as are to be, and in about the whole cone."""
        (self.dir / "box.obj").write_text(BOX_OBJ)
        long = "".join(f"v {float(x) / 14} {y} {float(z) / 14}\n" if kind == "v" else " ".join((kind, x, y, z, *more)) + "\n"
                       for kind, x, y, z, *more in (line.split() for line in BOX_OBJ.splitlines()))
        (self.dir / "stick.obj").write_text(long)
        self.succeed("new", "guide", "box.obj", "-o", "boxes.json")
        self.assertNotIn('"count"', (self.dir / "boxes.json").read_text())
        said = self.succeed("new", "guide", "stick.obj", "-o", "sticks.json").stdout
        count = int(re.search(r"about (\d+) of them", said)[1])
        self.assertLess(count, 150)
        self.assertIn(f'"count": {count}', (self.dir / "sticks.json").read_text())
        self.succeed("direct-pile", "sticks.json", "-o", "sticks", "--set", "/duration_s=0.5")
        filling = json.loads((self.dir / "sticks/report.json").read_text())["piles"]["guide"]["filling"]
        self.assertLessEqual(filling["kept"], count)
        self.assertGreater(filling["kept"], 0.9 * count)

    def test_a_guide_of_too_few_is_refused(self):
        (self.dir / "cup.obj").write_text(cup_obj())
        result = self.expect_exit(2, "new", "guide", "cup.obj", "--count", "3")
        self.assertIn("--count: 3 are too few", result.stderr)
        self.assertEqual([path.name for path in self.dir.iterdir()], ["cup.obj"])
        least = result.stderr.split("at least ")[1].split(",")[0]
        self.succeed("new", "guide", "cup.obj", "--count", least)
        self.expect_exit(2, "new", "guide", "cup.obj", "--count", str(int(least) - 1), "--force")

    def test_a_guide_that_is_left_says_so(self):
        self.succeed("new", "guide", ASSETS / "box.obj", "--count", "60", "-o", "tower.json")
        result = self.succeed("direct-pile", "tower.json", "-o", "out", "--set", "/duration_s=4",
                              "--set", "/guide/control=false", "--set", "/materials/body/friction=0",
                              "--set", "/materials/ground/friction=0")
        self.assertIn("the pile has not kept its shape", result.stdout + result.stderr)

    def test_a_bin_holds_what_is_poured_and_the_camera_sees_it(self):
        (self.dir / "cup.obj").write_text(cup_obj())
        for count, seed in ((30, 1), (30, 2), (6, 1)):
            self.succeed("new", "bin", "cup.obj", "--count", str(count), "-o", "bin.json", "--force")
            self.succeed("simulate", "bin.json", "-o", "out", "--force", "--seed", str(seed),
                         "--fail-on", "unsettled>0,escaped>0")
            scene = json.loads(self.succeed("validate", "bin.json", "--print-config").stdout)
            half = scene["shapes"]["bin"]["size"][0] / 2
            depth = scene["shapes"]["bin"]["size"][1]
            trajectory = zarr.open(str(self.dir / "out/trajectory.zarr"), mode="r")
            position, present = trajectory["position"][:], trajectory["state"][:] & 1
            last = position[-1, 2:]
            self.assertLess(numpy.abs(last[:, [0, 2]]).max(), half)
            if count == 30:  # it is seen to be full, and hardly any lie above its rim
                self.assertGreater(numpy.quantile(last[:, 1], 0.9), 0.6 * depth)
                self.assertLess((last[:, 1] > depth).mean(), 0.1)
            # None lies on others that lie above the rim: by the radius of a cup. Chance stacks some.
            self.assertLess(last[:, 1].max(), depth + 0.06)
            # Everything there is, at any time, is within the picture, with the radius of a cup.
            key = scene["camera"]["keys"][0]
            eye = numpy.array(key["position"])
            ahead = numpy.array(key["target"]) - eye
            ahead /= numpy.linalg.norm(ahead)
            right = numpy.cross(ahead, [0, 1, 0])
            right /= numpy.linalg.norm(right)
            places = position[:, 2:][present[:, 2:] > 0] - eye
            width, height = scene["render"]["size"]
            rise = math.tan(math.radians(scene["camera"].get("field_of_view_deg", 35)) / 2)
            for axis, most in ((numpy.cross(right, ahead), rise), (right, rise * width / height)):
                # Distance from the side planes of the picture.
                beside = (most * (places @ ahead) - abs(places @ axis)) / math.hypot(1, most)
                self.assertGreater(beside.min(), 0.06)
            # The bin is large in it.
            wall = half + scene["shapes"]["bin"]["thickness"]
            corners = numpy.array([(x, y, z) for x in (-wall, wall) for y in (0, depth) for z in (-wall, wall)]) - eye
            beside = corners @ right / (corners @ ahead) / (rise * width / height)
            self.assertGreater(numpy.ptp(beside) / 2, 0.6)
            # The near wall hides less than half of the bottom.
            self.assertLess(depth * numpy.hypot(eye[0], eye[2]) / eye[1], half)

    def test_a_pile_is_a_heap(self):
        """It rises from its edge to its middle, in several layers."""
        self.succeed("new", "pile", ASSETS / "box.obj", "--count", "80")
        self.succeed("simulate", "scene.json", "-o", "out", "--fail-on", "unsettled>0,escaped>0", "--no-picture")
        end = zarr.open(str(self.dir / "out/trajectory.zarr"), mode="r")["position"][-1, 1:]
        beside = numpy.hypot(end[:, 0], end[:, 2])
        width = numpy.quantile(beside, 0.9)
        self.assertGreater(end[:, 1].max(), 3 * 0.2)
        self.assertGreater(end[:, 1].max() / width, 0.35)
        self.assertGreater(end[beside < width / 3, 1].max(), 2 * end[beside > width * 0.8, 1].mean())

    def test_units_and_axes_that_are_unlikely_are_asked_about(self):
        def said(obj, *options, name="a.obj"):
            (self.dir / name).write_text(obj)
            return self.succeed("new", "pile", name, "--force", *options).stdout

        def scaled(by, shift=(0, 0, 0)):
            return "".join("v {} {} {}\n".format(*(by * float(x) + d for x, d in zip(line.split()[1:], shift)))
                           if line.startswith("v ") else line + "\n" for line in BOX_OBJ.splitlines())

        text = said(scaled(100))
        self.assertIn("in millimetres (--scale 0.001, 0.145 m across), or in centimetres (--scale 0.01, 1.45 m", text)
        self.assertNotIn("millimetres", said(scaled(100), "--scale", "0.01"))
        self.assertIn("is the file in metres? Then leave --scale out: 0.145 m", said(scaled(0.1), "--scale", "0.001"))
        self.assertNotIn("--up z", text)
        upright = scaled(1, (0, -0.45, 0.4))  # its middle on y = 0, its base on z = 0
        self.assertIn("it stands on z = 0: does z point up? Then say --up z", said(upright))
        self.assertNotIn("--up z", said(upright, "--up", "z"))
        self.assertNotIn("--up z", said(upright, "--up", "y"))

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

    def test_the_next_command_is_for_a_shell(self):
        said = self.succeed("new", "pile", ASSETS / "box.obj", "-o", "my scene.json").stdout
        self.assertIn("next: pilesim simulate 'my scene.json' -o out", said)

    def test_what_is_there_is_kept(self):
        (self.dir / "scene.json").write_text("mine")
        result = self.expect_exit(2, "new", "pile", ASSETS / "box.obj")
        self.assertIn("--force", result.stderr)
        self.assertEqual((self.dir / "scene.json").read_text(), "mine")
        self.succeed("new", "pile", ASSETS / "box.obj", "--force")
        self.expect_exit(2, "new", "heap", ASSETS / "box.obj", "-o", "other.json")
        self.expect_exit(4, "new", "pile", "none.obj", "-o", "other.json")
        self.assertFalse((self.dir / "other.json").exists())

    def test_the_mesh_is_never_replaced(self):
        for name in ("box.obj", "box.guide.obj"):
            (self.dir / name).write_text(BOX_OBJ)
        for kind, mesh, output in (("pile", "box.obj", "./box.obj"), ("guide", "box.guide.obj", "box.json")):
            result = self.expect_exit(2, "new", kind, mesh, "-o", output, "--force")
            self.assertIn(f"{mesh}: is the mesh itself; expected another file", result.stderr)
            self.assertEqual((self.dir / mesh).read_text(), BOX_OBJ)
        self.assertFalse((self.dir / "box.json").exists())

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
