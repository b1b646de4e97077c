"""Vertex animations: the mesh and its two pictures, read again and put together as a shader does."""

import json
import struct
import unittest
import zlib

import numpy
import zarr

from support import CommandTest
from test_export import WEDGE_OBJ, add_life, matrix


def read_exr(path):
    """Channels of an OpenEXR file of floats, compressed by ZIP: name -> rows, by the format's description."""
    data = path.read_bytes()
    assert data[:8] == struct.pack("<II", 20000630, 2)
    at, attributes = 8, {}
    while data[at]:
        name = data[at : data.index(0, at)].decode()
        at += len(name) + 1
        kind = data[at : data.index(0, at)].decode()
        at += len(kind) + 1
        (size,) = struct.unpack_from("<I", data, at)
        attributes[name] = data[at + 4 : at + 4 + size]
        at += 4 + size
    assert attributes["compression"] == b"\x03"
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    names, text = [], attributes["channels"]
    while text[0]:
        name, _, text = text.partition(b"\0")
        assert struct.unpack_from("<I", text)[0] == 2  # 32 bits, floats
        names.append(name.decode())
        text = text[16:]
    rows = []
    for place in struct.unpack_from(f"<{(height + 15) // 16}Q", data, at + 1):
        first, size = struct.unpack_from("<iI", data, place)
        block, count = data[place + 8 : place + 8 + size], min(16, height - first)
        if size < 4 * width * count * len(names):
            coded = numpy.frombuffer(zlib.decompress(block), numpy.uint8).astype(int)
            coded[1:] -= 128
            halves = (numpy.cumsum(coded) % 256).astype(numpy.uint8)
            plain = numpy.empty_like(halves)
            plain[::2], plain[1::2] = numpy.split(halves, [(len(halves) + 1) // 2])
            block = plain.tobytes()
        rows.append(numpy.frombuffer(block, "<f4").reshape(count, len(names), width))
    whole = numpy.concatenate(rows)
    return {name: whole[:, i] for i, name in enumerate(names)}


def read_glb(path):
    """The document, and its accessors as arrays."""
    data = path.read_bytes()
    assert data[:4] == b"glTF" and struct.unpack_from("<II", data, 4) == (2, len(data))
    (length,) = struct.unpack_from("<I", data, 12)
    document = json.loads(data[20 : 20 + length])
    buffer = data[28 + length :]
    assert struct.unpack_from("<I", data, 20 + length)[0] == len(buffer) == document["buffers"][0]["byteLength"]
    types = {5126: "<f4", 5125: "<u4", 5123: "<u2"}
    widths = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}

    def values(accessor):
        view, width = document["bufferViews"][accessor["bufferView"]], widths[accessor["type"]]
        part = buffer[view["byteOffset"] :][: view["byteLength"]][accessor.get("byteOffset", 0) :]
        values = numpy.frombuffer(part, types[accessor["componentType"]], accessor["count"] * width)
        return values.reshape(accessor["count"], width)

    return document, [values(accessor) for accessor in document["accessors"]]


class VertexAnimation(CommandTest):
    def simulate(self):
        (self.dir / "wedge.obj").write_text(WEDGE_OBJ)
        self.succeed("simulate", self.write_scene(add_life), "-o", "run")
        return zarr.open(str(self.dir / "run/trajectory.zarr"), mode="r")

    def animation(self, name="pile"):
        about = json.loads((self.dir / f"{name}.vat.json").read_text())
        places = read_exr(self.dir / about["positions"])
        turns = read_exr(self.dir / about["rotations"])
        stack = lambda picture: numpy.stack([picture[c] for c in "RGBA"], -1)  # noqa: E731
        return about, stack(places), stack(turns)

    def test_bodies_are_where_the_trajectory_has_them(self):
        store = self.simulate()
        printed = self.succeed("export", "run", "-o", "pile.vat.glb").stdout
        for name in ("pile.vat.glb", "pile.vat.position.exr", "pile.vat.rotation.exr", "pile.vat.json"):
            self.assertIn(name, printed)
        about, places, turns = self.animation()
        self.assertEqual(places.shape, (about["height"], about["width"], 4))
        self.assertEqual((about["frames"], about["frame_rate"]), (len(store["position"]), 30))
        document, arrays = read_glb(self.dir / "pile.vat.glb")
        attributes = document["meshes"][0]["primitives"][0]["attributes"]
        vertices, normals, texels, body, colour = (arrays[attributes[a]] for a in
                                                   ("POSITION", "NORMAL", "TEXCOORD_0", "_BODY", "COLOR_0"))
        self.assertEqual(document["accessors"][attributes["POSITION"]]["min"], vertices.min(0).tolist())
        self.assertLess(abs(numpy.linalg.norm(normals, axis=1) - 1).max(), 1e-5)
        columns, rows = about["width"], about["rows_of_a_frame"]
        column, row = (texels * [columns, about["height"]]).astype(int).T
        self.assertTrue((row * columns + column == body[:, 0]).all())
        for number, index in enumerate(about["body_id"]):
            own = body[:, 0] == number
            self.assertTrue((colour[own] == colour[own][0]).all())
            mesh = store[f"shapes/{store['body_shape'][index]}/vertices"][:]
            if len(mesh):  # not the plane
                extent = abs(vertices[own].max(0) - mesh.max(0)).max()
                self.assertLess(extent, 1e-6, about["body_name"][number])
            for frame in range(about["frames"]):
                texel = (frame * rows + number // columns, number % columns)
                present = store["state"][frame, index] & 1
                self.assertEqual(places[texel][3], present)
                if present:
                    self.assertTrue((places[texel][:3] == store["position"][frame, index].astype("f4")).all())
                    q = turns[texel][[3, 0, 1, 2]]
                    expected = store["orientation"][frame, index]
                    self.assertLess(abs(matrix(q) - matrix(expected)).max(), 1e-6)
        same = (turns[rows:] * turns[:-rows]).sum(-1)
        self.assertGreater(same.min(), 0, "quaternions do not jump to the other sign")
        corners = arrays[document["meshes"][0]["primitives"][0]["indices"]].reshape(-1, 3)
        self.assertTrue((body[corners] == body[corners[:, :1]]).all(), "no triangle joins two bodies")

    def test_every_second_frame_plays_at_the_same_speed(self):
        store = self.simulate()
        self.succeed("export", "run", "-o", "half.vat.glb", "--every", "2", "--only", "boxes/*", "-q")
        about, places, _ = self.animation("half")
        self.assertEqual(about["frame_rate"], 15)
        self.assertEqual(len(about["body_name"]), 8)
        index = about["body_id"][5]
        self.assertTrue((places[1, 5, :3] == store["position"][2, index].astype("f4")).all())

    def test_more_bodies_than_a_row_holds(self):
        def many(scene):
            scene["emitters"][0].update(count=[10, 90, 10], centre=[0, 30, 0])
            scene.update(duration_s=0.1, simulator={"mode": "particle"})

        self.succeed("simulate", self.write_scene(many), "-o", "run", "-q")
        self.succeed("export", "run", "-o", "pile.vat.glb", "-q")
        about, places, _ = self.animation()
        self.assertEqual((about["rows_of_a_frame"], about["width"], about["height"]), (2, 4501, 8))
        store = zarr.open(str(self.dir / "run/trajectory.zarr"), mode="r")
        for number in (0, 4500, 4501, 9000):
            texel = places[2 * 2 + number // 4501, number % 4501, :3]
            self.assertTrue((texel == store["position"][2, about["body_id"][number]]).all())

    def test_a_picture_that_is_too_high_is_refused(self):
        def long(scene):
            scene["emitters"][0]["count"] = [1, 1, 1]
            scene.update(duration_s=8.2, frame_rate=1000, simulator={"mode": "particle"})

        self.succeed("simulate", self.write_scene(long), "-o", "run", "-q")
        stderr = self.expect_exit(2, "export", "run", "-o", "a.vat.glb").stderr
        self.assertIn("would have pictures 8201 pixels high; expected at most 8192", stderr)
        self.assertIn("--every", stderr)
        self.assertFalse(list(self.dir.glob("a.vat.*")))
        self.succeed("export", "run", "-o", "a.vat.glb", "--every", "2", "-q")


if __name__ == "__main__":
    unittest.main()
