"""The add-on for Blender reads the Zarr store as python3-zarr does. What it builds there is seen by hand: tests/external."""

import json
import sys
import types
import unittest
from pathlib import Path
from unittest import mock

import numpy
import zarr

from support import PILESIM, CommandTest
from test_export import WEDGE_OBJ, add_life

ADDON = Path(PILESIM).parents[1] / "import_pilesim.py"


def load():
    """The add-on's functions, without a Blender."""
    blender = mock.MagicMock()
    blender.types.Operator = object
    handlers = types.SimpleNamespace(persistent=lambda function: function)
    addon = {"__name__": "import_pilesim", "__file__": str(ADDON)}
    modules = {"bpy": blender, "bpy.app": blender.app, "bpy.app.handlers": handlers}
    with mock.patch.dict(sys.modules, modules):
        exec(compile(ADDON.read_text(), ADDON, "exec"), addon)
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
        """Whose path it has anew: places, fields of view and where it looks."""
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
