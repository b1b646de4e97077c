"""A scene that is 5,000 km away from the world's origin, where floats are half a metre apart, comes out as one at the origin."""

import csv
import json
import unittest

import numpy
import zarr

from support import CommandTest
from test_export_vat import read_exr, read_glb
from test_view import Page

PLACE = numpy.array([500000.0, 0.0, 5200000.0])


class FarAway(CommandTest):
    def setUp(self):
        super().setUp()
        self.stores = []
        for name, place in (("near", 0 * PLACE), ("far", PLACE)):

            def move(scene, place=place):
                at = lambda *point: (numpy.array(point) + place).tolist()  # noqa: E731
                del scene["emitters"]
                scene["shapes"]["ball"] = {"type": "sphere", "radius": 0.1}
                for kind, x, height, role in (("box", 0, 0.3, "dynamic"), ("ball", 1, 0.4, "dynamic"),
                                              ("box", -1, 0.1, "static"), ("ball", -1, 0.298, "dynamic")):
                    scene["bodies"].append({"shape": kind, "material": "wood", "role": role,
                                            "position": at(x / 3, height, 0.1 * x)})
                scene["camera"] = {"position": at(1, 1.2, 2), "target": at(0, 0.2, 0)}

            self.succeed("simulate", self.write_scene(move, f"{name}.json"), "-o", name)
            self.stores.append(zarr.open(str(self.dir / name / "trajectory.zarr"), mode="r"))
        near, self.far = (store["position"][:] for store in self.stores)
        self.bodies = range(1, near.shape[1])  # the ground stays where it is
        self.assertLess(abs(self.far - PLACE - near)[:, self.bodies].max(), 1e-4)

    def export(self, name, *options):
        self.succeed("export", "far", "-o", name, *options)
        return self.dir / name

    def test_the_judge(self):
        ends = [json.loads((self.dir / name / "report.json").read_text())["quality_at_end"] for name in ("near", "far")]
        for key in ("deepest_penetration_m", "mean_penetration_diameters"):
            self.assertAlmostEqual(ends[0][key], ends[1][key], delta=1e-5)
        self.assertEqual(ends[0]["overlapping_pairs"], ends[1]["overlapping_pairs"])

    def test_csv_and_npz_have_the_world(self):
        rows = csv.DictReader(self.export("a.csv", "--frames", "last").read_text().splitlines())
        rows = sorted(rows, key=lambda row: int(row["id"]))
        read = [[float(row[k]) for k in ("x_m", "y_m", "z_m")] for row in rows]
        self.assertTrue((read == self.far[-1]).all())
        arrays = numpy.load(self.export("a.npz"))
        order = arrays["id"].argsort()
        self.assertTrue((arrays["position"][:, order] == self.far).all())

    def test_gltf(self):
        for options in ((), ("--frames", "last", "--as", "objects")):
            document, arrays = read_glb(self.export("a.glb", "--force", *options))
            (root,) = document["scenes"][0]["nodes"]
            pile = document["nodes"][root]
            nodes = {document["nodes"][i].get("extras", {}).get("id"): i for i in pile["children"]}
            for body in self.bodies:
                wanted = self.far[-1 if options else 0, body] - pile["translation"]
                self.assertLess(abs(document["nodes"][nodes[body]]["translation"] - wanted).max(), 1e-6)
            if options:
                continue
            ends = {c["target"]["node"]: arrays[document["animations"][0]["samplers"][c["sampler"]]["output"]][-1]
                    for c in document["animations"][0]["channels"] if c["target"]["path"] == "translation"}
            for body in (1, 2, 4):
                self.assertLess(abs(ends[nodes[body]] - (self.far[-1, body] - pile["translation"])).max(), 1e-6)

    def test_usd(self):
        for form in ("objects", "instances"):
            text = self.export("a.usda", "--force", "--frames", "last", "--as", form).read_text()
            tuples = lambda line: [[float(v) for v in part.strip("()[] ").split(",")]  # noqa: E731
                                   for part in line.partition("=")[2].split("), (")]
            lines = [line for line in text.splitlines() if "xformOp:translate =" in line or "point3f[] positions =" in line]
            (origin,) = tuples(lines[0])
            self.assertIn("double3", lines[0])
            found = numpy.concatenate([tuples(line) for line in lines[1:]])
            for body in self.bodies:
                self.assertLess(abs(found - (self.far[-1, body] - origin)).max(1).min(), 1e-6)

    def test_vertex_animation(self):
        self.export("a.vat.glb")
        about = json.loads((self.dir / "a.vat.json").read_text())
        picture = read_exr(self.dir / about["positions"])
        for number, body in enumerate(about["body_id"]):
            if body in self.bodies:
                texel = [picture[c][-1, number] for c in "RGB"]
                self.assertLess(abs(texel - (self.far[-1, body] - about["origin_m"])).max(), 1e-6)

    def test_view(self):
        pages = []
        for name in ("near", "far"):
            self.succeed("view", name, "-o", f"{name}.html")
            pages.append(Page((self.dir / f"{name}.html").read_text()))
        # Bodies and the camera by where they are from the first body.
        own = [[page.pose(body, 15)[0] for body in numpy.argsort(page.id)[1:]] for page in pages]
        eyes = [numpy.array(page.about["camera"][0][:3]) for page in pages]
        for near, far in ((numpy.array(own[i]) - own[i][0] for i in (0, 1)), (eyes[i] - own[i][0] for i in (0, 1))):
            self.assertLess(abs(near - far).max(), 1e-4)

    def test_blender(self):
        from test_blender_addon import load

        addon = load()
        for pile in (addon.open_pile(str(self.dir / "far/trajectory.zarr")), self.export_to_blender()):
            order = numpy.argsort(pile.array("id"))
            places = addon.from_origin(pile, numpy.array(pile.position[len(pile.frame) - 1]))[order][self.bodies]
            self.assertLess(abs(places).max(), 2)
            self.assertLess(abs(places - (self.far[-1, self.bodies] - pile.origin)).max(), 1e-7)
            ground = addon.from_origin(pile, numpy.zeros((1, 3)), numpy.array([[1.0, 0, 0, 0]]), True)
            self.assertLess(abs(ground + [0, pile.origin[1], 0]).max(), 1e-7)

    def export_to_blender(self):
        from test_blender_addon import load

        return load(self.export("a.py")).Pile(str(self.dir / "a.npz"))


if __name__ == "__main__":
    unittest.main()
