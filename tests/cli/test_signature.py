"""Signatures as a user makes and inspects them."""

import json
import os
import re
import shlex
import signal
import unittest

from support import SOURCE, CommandTest, tree_bytes

BOX = SOURCE / "assets" / "box.obj"
BRIEF = ["--trials", "4", "--exemplars", "2", "--no-accuracy"]
SIX = ["--trials", "6", "--no-accuracy", "--pours", "0"]
QUICK = [*BRIEF, "--pours", "0"]


def write_fine_cube(file, n):
    """A closed cube, each face a grid of n x n squares."""
    numbers, lines = {}, []

    def vertex(*point):
        number = numbers.setdefault(point, len(numbers) + 1)
        if number > len(lines):
            lines.append("v %d %d %d" % point)
        return number

    faces = []
    for a in range(n):
        for b in range(n):
            for far in (0, n):
                # In the order of a right-handed turn about each axis.
                corners = ((a, b), (a + 1, b), (a + 1, b + 1), (a, b + 1))
                if far == 0:
                    corners = corners[::-1]
                faces.append([vertex(far, u, v) for u, v in corners])
                faces.append([vertex(v, far, u) for u, v in corners])
                faces.append([vertex(u, v, far) for u, v in corners])
    lines += ["f %d %d %d %d" % tuple(face) for face in faces]
    file.write_text("\n".join(lines) + "\n")


class MeasuredWhenNeeded(CommandTest):
    """A scene that names none: it is measured once, and the cache has it from then on."""

    def test_simulate_mixed_and_compare(self):
        def change(scene):
            scene["simulator"] = {"mode": "statistical"}
            scene["duration_s"] = 0.4
            scene["finish"] = False
            scene["emitters"][0].update(centre=[0, 0.5, 0], count=[2, 1, 2])

        scene = self.write_scene(change)
        cache = os.environ | {"XDG_CACHE_HOME": str(self.dir / "cache")}
        first = self.succeed("simulate", scene, "-o", "first", "--no-picture", env=cache)
        self.assertRegex(first.stdout, "signatures measured in .* s")
        self.assertIn("box: measured for restitution 0.2 and friction 0.6, tables", first.stdout)
        self.assertEqual(first.stderr, "")  # no progress where there is no terminal
        (kept,) = (self.dir / "cache/pilesim").glob("signature-*")
        bytes_kept = kept.read_bytes()

        again = self.succeed("simulate", scene, "-o", "again", "--no-picture", env=cache)
        self.assertNotIn("measured in", again.stdout)
        self.assertEqual(tree_bytes(self.dir / "first/trajectory.zarr"), tree_bytes(self.dir / "again/trajectory.zarr"))
        self.assertIn("box: measured for", self.succeed("validate", scene, env=cache).stdout)

        mixed = self.succeed("simulate", scene, "-o", "mixed", "--no-picture", "--set", "/simulator/mode=mixed", env=cache)
        self.assertIn("box: measured for", mixed.stdout)
        self.succeed("compare", scene, "-o", "compared", "--modes", "statistical", "--reference", "impulse", "--runs",
                     "3", "--times", "2", env=cache | {"PATH": "/nowhere"})
        self.assertEqual([file.read_bytes() for file in (self.dir / "cache/pilesim").glob("signature-*")], [bytes_kept])


class SampleSignature(CommandTest):
    def test_a_box_is_sampled_and_inspected_the_same(self):
        sampled = self.succeed("sample-signature", BOX, "-o", "box.sig", *QUICK).stdout
        inspected = self.succeed("inspect", "box.sig").stdout
        self.assertIn(inspected, sampled)
        self.assertIn("rest poses:", inspected)
        self.assertEqual(inspected.count("by geometry"), 6)
        self.assertFalse((self.dir / "box.sig.partial").exists())

    def test_a_scene_gives_mesh_scale_and_material(self):
        scene = {"version": 1, "materials": {"oak": {"restitution": 0.4, "friction": 0.3}, "ice": {"friction": 0}},
                 "shapes": {"ground": {"type": "plane"}, "block": {"type": "mesh", "file": str(BOX), "size_m": 0.5}},
                 "bodies": [{"shape": "ground", "material": "ice", "role": "static"}],
                 "emitters": [{"type": "stream", "shape": "block", "material": "oak", "count": 2, "rate_hz": 1}]}
        (self.dir / "scene.json").write_text(json.dumps(scene))
        quick = ["--trials", "2", "--exemplars", "0", "--no-accuracy", "--pours", "0"]
        result = self.succeed("sample-signature", "--scene", "scene.json", "-o", "taken.sig", *quick)
        self.assertNotIn("joints", result.stderr)
        self.succeed("sample-signature", BOX, "--scale", "2.5", "--restitution", "0.4", "--friction", "0.3",
                     "-o", "told.sig", *quick)
        self.assertEqual((self.dir / "taken.sig").read_bytes(), (self.dir / "told.sig").read_bytes())
        for options, text in (
            (["--shape", "blok"], 'scene.json: --shape "blok" is no shape; expected one of "block"'),
            (["--shape", "ground"], '--shape "ground" is not the mesh of a body that moves; expected one of "block"'),
            (["--scale", "2"], "--scale"),
        ):
            result = self.expect_exit(2, "sample-signature", "--scene", "scene.json", "-o", "no.sig", *options)
            self.assertIn(text, result.stderr)
        self.assertIn("--scene", self.expect_exit(2, "sample-signature", "-o", "no.sig").stderr)
        chained = scene | {"emitters": [], "chains": [{"shape": "block", "material": "oak", "count": 2,
                                                       "from": [0, 4, 0], "to": [0, 3, 0]}]}
        (self.dir / "chained.json").write_text(json.dumps(chained))
        result = self.expect_exit(2, "sample-signature", "--scene", "chained.json", "-o", "link.sig", *quick)
        self.assertIn('all bodies of shape "block" have joints', result.stderr)
        self.assertFalse((self.dir / "link.sig").exists())
        scene["bodies"].append({"shape": "block", "material": "ice"})
        (self.dir / "scene.json").write_text(json.dumps(scene))
        result = self.expect_exit(2, "sample-signature", "--scene", "scene.json", "-o", "no.sig")
        self.assertIn('is used with the materials "ice", "oak"', result.stderr)

    def test_what_a_message_advises_is_an_option(self):
        (self.dir / "sheet.obj").write_text("v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nv 0.5 0.3 0.5\n"
                                            "f 1 2 5\nf 2 3 5\n")
        quick = ["--trials", "2", "--exemplars", "0", "--no-accuracy", "--pours", "0"]
        result = self.expect_exit(3, "sample-signature", "sheet.obj", "-o", "a.sig", *quick)
        self.assertIn("(--thickness), or --solid hull takes its convex hull", result.stderr)
        self.succeed("sample-signature", "sheet.obj", "-o", "hull.sig", "--solid", "hull", *quick)
        self.succeed("sample-signature", "sheet.obj", "-o", "thick.sig", "--thickness", "0.05", *quick)
        # With a scene, which these options exclude, its keys are named.
        scene = {"version": 1, "materials": {"oak": {}}, "shapes": {"sheet": {"type": "mesh", "file": "sheet.obj"}},
                 "bodies": [{"shape": "sheet", "material": "oak"}]}
        (self.dir / "scene.json").write_text(json.dumps(scene))
        of_scene = ["--scene", "scene.json", "--shape", "sheet"]
        result = self.expect_exit(3, "sample-signature", *of_scene, "-o", "a.sig", *quick)
        self.assertIn('("thickness_m"), or "solid": "hull" takes its convex hull', result.stderr)
        scene["shapes"]["sheet"]["solid"] = "hull"
        (self.dir / "scene.json").write_text(json.dumps(scene))
        self.succeed("sample-signature", *of_scene, "-o", "a.sig", *quick)
        # A signature that a scene cannot take: the command to copy makes one, but for the number of pours.
        scene["shapes"]["sheet"]["signature"] = "a.sig"
        scene["simulator"] = {"mode": "statistical"}
        (self.dir / "scene.json").write_text(json.dumps(scene))
        advice = self.expect_exit(3, "validate", "scene.json").stderr
        command = shlex.split(advice[advice.index("pilesim sample-signature"):].replace("SCENE", "scene.json"))
        self.succeed(*command[1:], *quick)
        # The solid is made again as it was sampled.
        for name in ("hull", "thick"):
            self.succeed("inspect", f"{name}.sig", "--plot", f"{name}_plots", "--mesh", "sheet.obj")

    def test_the_help_names_the_defaults_that_are_taken(self):
        text = " ".join(self.succeed("sample-signature", "--help").stdout.split())
        for layout in ("scale-free", "dissertation"):
            sampled = self.succeed("sample-signature", BOX, "-o", f"{layout}.sig", "--no-accuracy", "--pours", "0",
                                   "--micro", "--layout", layout).stdout
            trials = re.search(r" (\d+) \.\. \1 effective trials a cell", sampled)
            exemplars = re.search(r"(\d+) exemplars a cell", sampled)
            for option, taken in (("--trials N", trials), ("--exemplars N", exemplars)):
                number = taken[1] if taken else "0"
                pattern = rf"{option}.*?default " + (
                    rf"{number}," if layout == "scale-free" else rf"\d+, or {number} in"
                )
                self.assertRegex(text, pattern)

    def test_the_help_names_all_pictures_and_none_is_replaced_unasked(self):
        self.succeed("sample-signature", BOX, "-o", "box.sig", *BRIEF, "--pours", "1")
        text = self.succeed("inspect", "--help").stdout
        draw = ["inspect", "box.sig", "--plot", "pictures", "--mesh", BOX]
        self.assertIn("pictures/rest_pose_bodies.png", self.succeed(*draw).stdout)
        data = (self.dir / "pictures" / "rest_pose_bodies.png").read_bytes()
        # Six poses in two rows of up to four.
        size = [int.from_bytes(data[i : i + 4], "big") for i in (16, 20)]
        self.assertEqual(size, [4 * 360 + 3 * 4, 2 * 300 + 4])
        pictures = sorted(path.name for path in (self.dir / "pictures").iterdir())
        self.assertEqual(len(pictures), 6)
        for name in pictures:
            self.assertIn(name, text)
            for other in pictures:
                (self.dir / "pictures" / other).unlink(missing_ok=True)
            (self.dir / "pictures" / name).write_text("of an hour ago")
            self.assertIn(name, self.expect_exit(2, *draw).stderr)
        self.succeed(*draw, "--force")
        for name in pictures:
            self.assertTrue((self.dir / "pictures" / name).read_bytes().startswith(b"\x89PNG"), name)
        # Without the mesh there is no picture of an earlier one left.
        self.succeed(*draw[:-2], "--force")
        left = sorted(path.name for path in (self.dir / "pictures").iterdir())
        self.assertEqual(left, [name for name in pictures if name != "rest_pose_bodies.png"])

    def test_a_mesh_that_was_not_sampled_is_refused(self):
        self.succeed("sample-signature", BOX, "-o", "box.sig", *QUICK)
        other = SOURCE / "assets" / "ring.obj"
        failed = self.expect_exit(
            3, "inspect", "box.sig", "--plot", "again", "--mesh", other
        )
        self.assertIn("the mesh that was sampled, box.obj", failed.stderr)
        self.assertFalse((self.dir / "again").exists())
        self.expect_exit(2, "inspect", "box.sig", "--mesh", BOX)

    def test_threads_do_not_change_the_bytes(self):
        for threads in ("1", "3"):
            self.succeed(
                "sample-signature", BOX, "-o", f"{threads}.sig", "--threads", threads, *QUICK
            )
        self.assertEqual((self.dir / "1.sig").read_bytes(), (self.dir / "3.sig").read_bytes())

    def test_an_interrupted_run_goes_on(self):
        settings = ["--trials", "60", "--no-accuracy", "--exemplars", "0", "--pours", "0"]
        struck = self.at_change("sample-signature", signal.SIGINT, 0)
        self.expect_exit(130, "sample-signature", BOX, "-o", "a.sig", *settings, env=struck)
        self.assertTrue((self.dir / "a.sig.partial").exists())
        for setting in (["--friction", "0.1"], ["--solid", "hull"], ["--thickness", "0.01"]):
            other = self.expect_exit(2, "sample-signature", BOX, "-o", "a.sig", *settings, *setting)
            self.assertIn("interrupted run with other settings", other.stderr)
        self.succeed("sample-signature", BOX, "-o", "a.sig", *settings)
        self.succeed("sample-signature", BOX, "-o", "b.sig", *settings)
        self.assertEqual((self.dir / "a.sig").read_bytes(), (self.dir / "b.sig").read_bytes())

    def test_drops_find_the_faces_of_a_die(self):
        result = self.succeed("sample-signature", BOX, "-o", "box.sig", *QUICK, "--rest-drops", "60")
        self.assertEqual(result.stderr, "")
        inspected = self.succeed("inspect", "box.sig").stdout
        self.assertIn(inspected, result.stdout)
        self.assertEqual(inspected.count("by simulation"), 6)
        self.assertIn("they agree on which poses exist", inspected)

    def test_bad_input_is_named(self):
        square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
        meshes = {
            "open": square + "v 0 0 1\nf 1 2 3\nf 1 3 4\nf 1 2 5\n",
            "point": "v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n",
            "flat": square + "f 1 2 3\nf 1 3 4\nf 1 3 2\nf 1 4 3\n",
        }
        for name, text in meshes.items():
            (self.dir / f"{name}.obj").write_text(text)
            result = self.expect_exit(3, "sample-signature", f"{name}.obj", "-o", "x.sig")
            self.assertIn(f"{name}.obj", result.stderr)
        result = self.expect_exit(
            2, "sample-signature", BOX, "-o", "x.sig", "--restitution", "1.2"
        )
        self.assertIn("0 to 1", result.stderr)
        result = self.expect_exit(
            2, "sample-signature", BOX, "-o", "x.sig", "--restitution-threshold", "0.5"
        )
        self.assertIn("--layout dissertation", result.stderr)
        self.assertFalse((self.dir / "x.sig").exists())

    def test_collisions_that_were_written_are_measured_again(self):
        drops = self.dir / "drops.csv"
        self.succeed("sample-signature", BOX, "-o", "a.sig", *SIX, "--write-collisions", drops)
        result = self.succeed("sample-signature", BOX, "-o", "b.sig", "--collisions", drops, "--pours", "0")
        self.assertEqual(result.stderr, "")
        self.assertIn("from 35280 collisions of drops.csv", result.stdout)
        self.assertIn(self.succeed("inspect", "b.sig").stdout, result.stdout)

        # How near the tables are to fresh trials.
        def distance(sig):
            options = ["--trials", "20"] if sig == "c.sig" else ["--collisions", drops]
            more = ["--write-collisions", drops, "--force"] if sig == "c.sig" else []
            text = self.succeed("sample-signature", BOX, "-o", sig, "--pours", "0", *options, *more).stdout
            return float(re.search(r"4 keys, exemplars +([\d.]+)", text)[1])

        sampled, measured = distance("c.sig"), distance("d.sig")
        self.assertLess(abs(measured / sampled - 1), 0.1)

    def test_few_collisions_leave_cells_empty_which_are_named(self):
        drops = self.dir / "drops.csv"
        self.succeed("sample-signature", BOX, "-o", "a.sig", *SIX, "--write-collisions", drops)
        # Those at the first node of theta.
        header, *rows = drops.read_text().splitlines()
        drops.write_text("\n".join(["number," + header, *(f"{i},{row}" for i, row in enumerate(rows[:5040]))]))
        result = self.succeed("sample-signature", BOX, "-o", "b.sig", "--collisions", drops, "--pours", "0")
        self.assertIn("columns that say nothing of a collision: number", result.stderr)
        self.assertIn("5040 of 5880 cells have fewer than 4 collisions", result.stderr)
        inspected = self.succeed("inspect", "b.sig").stdout
        self.assertIn("5040 cells had too few collisions", inspected)
        self.assertIn("by theta (deg), of 840 each: 0: 0, 14: 840,", inspected)
        self.assertIn("they are (14 0 -180 0), (14 0 -180 9.67),", inspected)
        self.assertIn(" and 5032 more", inspected)

    def test_collisions_are_not_sampled_too(self):
        (self.dir / "drops.csv").write_text("")
        for option in ("--trials", "--target-error", "--write-collisions"):
            self.expect_exit(2, "sample-signature", BOX, "-o", "a.sig", "--collisions", "drops.csv", option, "2")
        self.expect_exit(2, "sample-signature", BOX, "-o", "a.sig", "--layout", "dissertation", "--write-collisions", "w.csv")
        (self.dir / "w.csv").write_text("mine")
        self.expect_exit(2, "sample-signature", BOX, "-o", "a.sig", "--write-collisions", "w.csv")
        self.assertEqual((self.dir / "w.csv").read_text(), "mine")
        self.assertFalse((self.dir / "a.sig").exists())

    def test_a_mesh_of_a_hundred_thousand_vertices(self):
        write_fine_cube(self.dir / "fine.obj", 130)  # 101,402 vertices
        sampled = self.succeed("sample-signature", "fine.obj", "-o", "fine.sig", *QUICK).stdout
        self.assertIn("hull of 8 vertices", sampled)
        self.assertEqual(sampled.count("by geometry"), 6)

    def test_an_output_that_exists_is_kept(self):
        (self.dir / "box.sig").write_text("mine")
        self.expect_exit(2, "sample-signature", BOX, "-o", "box.sig", *QUICK)
        self.assertEqual((self.dir / "box.sig").read_text(), "mine")


class Inspect(CommandTest):
    def test_refuses_what_is_no_signature(self):
        self.succeed("sample-signature", BOX, "-o", "box.sig", *QUICK)
        whole = (self.dir / "box.sig").read_bytes()
        for name, data in {"text": b"hello", "cut": whole[: len(whole) // 2], "none": b""}.items():
            (self.dir / name).write_bytes(data)
            self.assertIn(name, self.expect_exit(3, "inspect", name).stderr)
        self.expect_exit(4, "inspect", "nowhere.sig")
        (self.dir / "nested").write_bytes(b"\xa1\x61a" * 100_000)  # a map in a map
        self.assertIn("nested too deeply", self.expect_exit(3, "inspect", "nested").stderr)
        flipped = bytearray(whole)
        flipped[len(whole) // 3] ^= 1
        (self.dir / "flipped").write_bytes(flipped)
        self.assertIn("checksum", self.expect_exit(3, "inspect", "flipped").stderr)


if __name__ == "__main__":
    unittest.main()
