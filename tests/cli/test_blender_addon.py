"""The add-on for Blender reads the Zarr store as python3-zarr does. Its scenes are checked by hand: tests/external."""

import json
import sys
import types
import unittest
from pathlib import Path
from unittest import mock

import numpy
import zarr

from support import PILESIM, CommandTest
from test_export import WEDGE_OBJ, add_life, add_wedges, textured_wedge

ADDON = Path(PILESIM).parents[1] / "import_pilesim.py"


class Made:
    """Stands for what Blender makes: remembers what is put into it."""

    def __init__(self, *told):
        self.told, self.made, self.values, self.inner = told, [], {}, {}

    def __getattr__(self, name):
        if name.startswith("__"):
            raise AttributeError(name)
        setattr(self, name, Made())
        return self.__dict__[name]

    def __getitem__(self, key):
        return self.inner.setdefault(key, Made())

    def __iter__(self):
        return iter(self.made)

    def __call__(self, *_, **__):
        return Made()

    def new(self, *told, **_):
        self.made.append(Made(*told))
        return self.made[-1]

    def append(self, thing):
        self.made.append(thing)

    def foreach_set(self, *told):
        self.values[told[0] if len(told) > 1 else ""] = numpy.array(told[-1])


def material_with_nodes(name):
    material, shader = Made(name), Made()
    shader.type = "BSDF_PRINCIPLED"
    material.node_tree.nodes.append(shader)
    return material


def load(path=ADDON, version=(4, 2, 0)):
    """The functions of a script for Blender, without a Blender: what they make are Mades."""
    blender = mock.MagicMock()
    blender.app.version = version
    blender.data.meshes, blender.data.images = Made(), Made()
    blender.data.materials.new = material_with_nodes
    blender.types.Operator = object
    handlers = types.SimpleNamespace(persistent=lambda function: function)
    addon = {"__name__": "import_pilesim", "__file__": str(path)}
    modules = {"bpy": blender, "bpy.app": blender.app, "bpy.app.handlers": handlers}
    with mock.patch.dict(sys.modules, modules):
        exec(compile(path.read_text(), path, "exec"), addon)
    # Its quaternions are Blender's own: the way a camera looks stands for them.
    addon["towards"] = lambda way, roll: (1, *way)
    return types.SimpleNamespace(**addon)


class Addon(CommandTest):
    def setUp(self):
        super().setUp()
        (self.dir / "wedge.obj").write_text(WEDGE_OBJ)
        self.succeed("simulate", self.write_scene(add_life), "-o", "run")
        self.path = str(self.dir / "run/trajectory.zarr")
        self.addon = load()

    def test_reads_what_zarr_reads(self):
        pile, store = self.addon.Store(self.path), zarr.open(self.path, "r")
        for name in ("position", "orientation", "state"):
            array = getattr(pile, name)
            self.assertTrue((array.whole() == store[name][:]).all())
            self.assertTrue((array[7] == store[name][7]).all())
            self.assertEqual(len(array), len(store[name]))
        self.assertEqual(pile.about["body_name"], store.attrs["body_name"])
        self.assertEqual(pile.about["frame_rate"], 30)
        for body, colour in enumerate(store["body_colour"][:]):
            self.assertEqual(tuple(pile.about["look_colour"][pile.look[body]]), tuple(colour))
        for shape, about in enumerate(store.attrs["shapes"]):
            points = pile.array(f"shape_{shape}_vertices")
            corners = points[pile.array(f"shape_{shape}_triangles")]
            self.assertEqual(len(numpy.unique(points, axis=0)), len(points))
            if not about["plane"]:
                expected = store[f"shapes/{shape}/vertices"][:][store[f"shapes/{shape}/triangles"][:]]
                self.assertTrue((corners == expected).all())

    def test_frames_are_read_in_parts(self):
        """More chunks than are held, and one that is not there."""
        data = numpy.arange(300 * 4, dtype="f4").reshape(300, 4)
        zarr.save_array(str(self.dir / "many"), data, chunks=(2, 4), compressor=zarr.Zstd(level=1))
        array = self.addon.Array(str(self.dir / "many"), self.addon.decompressor())
        for frame in (0, 299, 5, 150, 4):
            self.assertTrue((array[frame] == data[frame]).all())
        self.assertTrue((array.whole() == data).all())
        self.assertLessEqual(len(array.held), self.addon.MOST_HELD)
        (self.dir / "many/3.0").unlink()
        array = self.addon.Array(str(self.dir / "many"), self.addon.decompressor())
        self.assertTrue((array[6] == 0).all())

    def test_the_camera_is_that_of_an_export(self):
        """Sampled again: positions, fields of view and targets of its path."""
        self.succeed("export", "run", "-o", "pile.npz", "-q")
        expected = numpy.load(self.dir / "pile.npz")["camera"]
        store = zarr.open(self.path, "r")
        rows = self.addon.camera_rows(store.attrs["scene"]["camera"], numpy.arange(len(expected)) / 30)
        self.assertLess(abs(rows[:, :3] - expected[:, :3]).max(), 1e-9)
        self.assertLess(abs(rows[:, 7] - expected[:, 7]).max(), 1e-9)
        w, x, y, z = expected[:, 3:7].T
        looks = -numpy.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], -1)
        way = rows[:, 4:7] / numpy.linalg.norm(rows[:, 4:7], axis=1)[:, None]
        self.assertLess(abs(looks - way).max(), 1e-6)

    def test_materials_are_those_of_the_run(self):
        """By the add-on from the store and by the exported script: each triangle has its picture, where it is to be."""
        pixels = textured_wedge(self.dir)

        def glossy(scene):
            add_wedges(scene)
            scene["bodies"][-1]["colour"] = "#00ff00"
            scene["materials"]["wood"].update(roughness=0.25, clear_coat=0.5)

        self.succeed("simulate", self.write_scene(glossy), "-o", "glossy")
        self.succeed("export", "glossy", "-o", "pile.py", "-q")
        store = zarr.open(str(self.dir / "glossy/trajectory.zarr"), "r")
        names = store.attrs["body_name"]
        for script, version in ((ADDON, (3, 4, 1)), (ADDON, (4, 2, 0)), (self.dir / "pile.py", (4, 2, 0))):
            blender = load(script, version)
            pile = (blender.Store(str(self.dir / "glossy/trajectory.zarr")) if script == ADDON
                    else blender.Pile(str(self.dir / "pile.npz")))
            meshes = blender.make_meshes(pile)
            looks = dict(zip(pile.about["body_name"], zip(pile.shape.tolist(), pile.look.tolist())))
            mesh, plain = meshes[looks["falling wedge"]], meshes[looks["leaning wedge"]]
            shape = store["body_shape"][names.index("falling wedge")]
            uv, textures = store[f"shapes/{shape}/uv"][:], store[f"shapes/{shape}/texture"][:]
            expected = {tuple(numpy.round(corner, 5)) for corner in (uv[textures == 1] * [1, -1] + [0, 1]).reshape(-1, 2)}
            places = mesh.uv_layers.made[0].data.values["uv"].reshape(-1, 3, 2)
            shown = [mesh.materials.made[i] for i in mesh.polygons.values["material_index"]]
            with_picture = []
            for triangle, material in enumerate(shown):
                shader, paint = material.node_tree.nodes.made
                (link,) = material.node_tree.links.made
                self.assertEqual(link.told, (paint.outputs["Color"], shader.inputs["Base Color"]))
                if paint.told == ("ShaderNodeTexImage",):
                    with_picture.append(triangle)
                    rows = paint.image.pixels.values[""].reshape(2, 2, 4)
                    self.assertTrue((numpy.rint(255 * rows[::-1, :, :3]) == pixels).all())
                    self.assertEqual(paint.image.told[1:], (2, 2))
                else:
                    self.assertEqual(paint.told, ("ShaderNodeAttribute",))
            self.assertEqual(len(with_picture), 1)
            self.assertEqual({tuple(corner) for corner in places[with_picture[0]].round(5)}, expected)
            # One that has a colour of its own has no pictures.
            (material,) = plain.materials.made
            self.assertEqual(len(material.node_tree.nodes.made), 1)
            coat = ("Clearcoat", "Clearcoat Roughness") if version < (4, 0, 0) else ("Coat Weight", "Coat Roughness")
            for material in (*mesh.materials.made, *plain.materials.made):
                inputs = material.node_tree.nodes.made[0].inputs
                self.assertAlmostEqual(inputs["Roughness"].default_value, 0.25)
                self.assertAlmostEqual(inputs[coat[0]].default_value, 0.5)
                self.assertAlmostEqual(inputs[coat[1]].default_value, 0.08)
            ground = meshes[pile.shape[0], pile.look[0]] if script == ADDON else meshes[looks[names[0]]]
            self.assertEqual(ground.materials.made[0].node_tree.nodes.made[0].inputs["Roughness"].default_value, 1)

    def test_many_kinds_of_gloss_are_rounded_as_an_export_has_them(self):
        def drawn(scene):
            scene["emitters"][0].update(count=[5, 5, 4], palette=["#808080"], roughness=[0.1, 0.9], clear_coat=[0, 1])

        self.succeed("simulate", self.write_scene(drawn), "-o", "drawn")
        self.succeed("export", "drawn", "-o", "drawn.npz", "-q")
        arrays = numpy.load(self.dir / "drawn.npz")
        about = json.loads(bytes(arrays["about_json"]))
        pile = self.addon.Store(str(self.dir / "drawn/trajectory.zarr"))
        exact = zarr.open(pile.path, "r")["body_gloss"][:]
        for name, column, step in (("look_roughness", 0, 0.1), ("look_clear_coat", 1, 0.2)):
            exported = numpy.array(about[name])[arrays["look"]]
            self.assertLess(abs(exported - numpy.array(pile.about[name])[pile.look[arrays["id"]]]).max(), 1e-6)
            boxes = arrays["shape"] == about["shape_name"].index("box")
            off = abs(exported - exact[arrays["id"], column])[boxes]
            self.assertLessEqual(off.max(), step / 2 + 1e-6)
            self.assertGreater(off.max(), step / 8)
        self.assertLessEqual(len(about["look_name"]), 61)

    def test_what_is_no_trajectory_is_refused_in_words(self):
        def refused(change):
            attributes = json.loads((self.dir / "run/trajectory.zarr/.zattrs").read_text())
            change(attributes)
            (self.dir / "run/trajectory.zarr/.zattrs").write_text(json.dumps(attributes))
            with self.assertRaises(self.addon.NoPile) as refusal:
                self.addon.Store(self.path)
            return str(refusal.exception)

        with self.assertRaisesRegex(self.addon.NoPile, "choose the output directory"):
            self.addon.Store(str(self.dir))
        self.assertIn("of version 9", refused(lambda attributes: attributes.update(format_version=9)))
        with self.assertRaisesRegex(self.addon.NoPile, "damaged"):
            self.addon.decompressor()(b"no zstd at all", 100)


if __name__ == "__main__":
    unittest.main()
