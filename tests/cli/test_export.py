"""What other programs get of a trajectory: the Zarr store itself, and the files of pilesim export."""

import os
import re
import unittest

import numpy
import zarr

from support import SOURCE, CommandTest

# Far from its own origin, and with three principal axes that are not those of the file.
WEDGE_OBJ = """v 1 2 3
v 3 2 3
v 1 3 3
v 1 2 9
v 2 2.5 3
f 1 3 5
f 1 5 2
f 1 2 4
f 2 5 4
f 5 3 4
f 1 4 3
"""


def add_wedges(scene):
    scene["shapes"]["wedge"] = {"type": "mesh", "file": "wedge.obj", "scale": 0.1}
    scene["bodies"] += [
        {"name": "falling wedge", "shape": "wedge", "material": "wood", "position": [3, 1, 0]},
        {"name": "leaning wedge", "shape": "wedge", "material": "wood", "role": "static",
         "position": [-3, 1, 0.5], "orientation": [0.5, 0.5, -0.5, 0.5]},
    ]  # fmt: skip


def matrix(q):
    """The rotation of a quaternion w, x, y, z, by its effect on the axes."""

    def times(a, b):
        w, v = a[0] * b[0] - a[1:] @ b[1:], a[0] * b[1:] + b[0] * a[1:] + numpy.cross(a[1:], b[1:])
        return numpy.array([w, *v])

    q = numpy.array(q, float)
    back = q * [1, -1, -1, -1]
    return numpy.array([times(times(q, numpy.array([0, *axis])), back)[1:] for axis in numpy.eye(3)]).T


def inertia(vertices, triangles):
    """Of unit density about the origin."""
    corners = vertices[triangles]
    volumes = numpy.linalg.det(corners) / 6
    total = corners.sum(1)
    second = numpy.einsum("t,tci,tcj->ij", volumes, corners, corners)
    second = (second + numpy.einsum("t,ti,tj->ij", volumes, total, total)) / 20
    return numpy.trace(second) * numpy.eye(3) - second


class Store(CommandTest):
    """The trajectory says enough to put a body's mesh where the body is."""

    def setUp(self):
        super().setUp()
        (self.dir / "wedge.obj").write_text(WEDGE_OBJ)
        self.succeed("simulate", self.write_scene(add_wedges), "-o", "out/a")
        self.store = zarr.open(str(self.dir / "out/a/trajectory.zarr"), mode="r")

    def test_says_its_axes_and_unit(self):
        attributes = self.store.attrs
        self.assertEqual((attributes["handedness"], attributes["up_axis"]), ("right", "y"))
        self.assertEqual(attributes["metres_per_unit"], 1)

    def test_says_of_each_body_what_it_is(self):
        attributes = self.store.attrs
        names = attributes["body_name"]
        shapes = [attributes["shapes"][i] for i in self.store["body_shape"]]
        materials = [attributes["materials"][i] for i in self.store["body_material"]]
        self.assertEqual(set(materials), {"wood"})
        shape = dict(zip(names, shapes))
        self.assertEqual(shape["ground"]["type"], "plane")
        self.assertEqual((shape["boxes/3"]["type"], shape["boxes/3"]["file"]), ("box", ""))
        wedge = shape["falling wedge"]
        self.assertEqual((wedge["name"], wedge["file"], wedge["scale"]), ("wedge", "wedge.obj", 0.1))

    def test_the_example_of_the_docs_puts_a_file_where_the_body_is(self):
        text = (SOURCE / "docs/files.md").read_text()
        (example,) = [b for b in re.findall(r"^```python\n(.*?)^```", text, re.M | re.S) if "scale" in b]
        here = os.getcwd()
        os.chdir(self.dir)
        try:
            for name in ("falling wedge", "leaning wedge"):
                place = {}
                exec(example.replace("rabbits/3", name), place)
                body, world = place["body"], place["world"]
                shape = self.store["body_shape"][body]
                q, p = self.store["orientation"][-1, body], self.store["position"][-1, body]
                drawn = self.store[f"shapes/{shape}/vertices"][:] @ matrix(q).T + p
                self.assertEqual(len(world), 5)
                for vertex in world:
                    self.assertLess(abs(drawn - vertex).max(axis=1).min(), 1e-6)
        finally:
            os.chdir(here)
        # The static one stands where the scene has its file's origin.
        file = numpy.array([line.split()[1:] for line in WEDGE_OBJ.splitlines() if line[0] == "v"], float)
        expected = 0.1 * file @ matrix([0.5, 0.5, -0.5, 0.5]).T + [-3, 1, 0.5]
        self.assertLess(abs(world - expected).max(), 1e-6)

    def test_principal_axes_are_those_of_the_inertia(self):
        for index, shape in enumerate(self.store.attrs["shapes"]):
            if shape["plane"]:
                continue
            vertices = self.store[f"shapes/{index}/vertices"][:].astype(float)
            axes = matrix(shape["principal_axes"])
            moments = axes.T @ inertia(vertices, self.store[f"shapes/{index}/triangles"][:]) @ axes
            self.assertLess(abs(moments - numpy.diag(numpy.diag(moments))).max(), 1e-6 * moments.max())
            self.assertTrue((numpy.diff(numpy.diag(moments)) > -1e-6 * moments.max()).all())


if __name__ == "__main__":
    unittest.main()
