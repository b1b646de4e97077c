"""Trajectories for other programs: the Zarr store itself, and the files of pilesim export."""

import csv
import json
import os
import re
import struct
import unittest
import zlib

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


def png(pixels):
    """The file of rows of pixels."""

    def chunk(kind, data):
        body = kind + data
        return struct.pack(">I", len(data)) + body + struct.pack(">I", zlib.crc32(body))

    head = struct.pack(">IIBBBBB", pixels.shape[1], pixels.shape[0], 8, 2, 0, 0, 0)
    rows = zlib.compress(b"".join(b"\0" + row.tobytes() for row in pixels))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def textured_wedge(folder):
    """Writes a wedge one of whose triangles has a picture, another colour the others. Returns the picture's pixels."""
    pixels = numpy.array([[[200, 10, 20], [30, 40, 250]], [[0, 255, 0], [90, 91, 92]]], numpy.uint8)
    (folder / "four.png").write_bytes(png(pixels))
    (folder / "t.mtl").write_text("newmtl t\nmap_Kd four.png\nnewmtl red\nKd 1 0 0\n")
    head, _, faces = WEDGE_OBJ.partition("f ")
    first, *others = ("f " + faces).strip().split("\n")
    textured = "f " + " ".join(f"{v}/{i}" for i, v in enumerate(first.split()[1:], 1))
    (folder / "wedge.obj").write_text(
        f"mtllib t.mtl\n{head}vt 0.25 0.75\nvt 3 0.5\nvt 0 -1\nusemtl t\n{textured}\nusemtl red\n"
        + "\n".join(others))
    return pixels


def matrix(q):
    """The rotation of a quaternion w, x, y, z, by its effect on the axes."""

    def times(a, b):
        w, v = a[0] * b[0] - a[1:] @ b[1:], a[0] * b[1:] + b[0] * a[1:] + numpy.cross(a[1:], b[1:])
        return numpy.array([w, *v])

    q = numpy.array(q, float)
    back = q * [1, -1, -1, -1]
    return numpy.array([times(times(q, numpy.array([0, *axis])), back)[1:] for axis in numpy.eye(3)]).T


def inertia(vertices, triangles):
    """Inertia for unit density about the origin."""
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

    def test_a_file_whose_z_is_up_is_turned_for_all(self):
        def turn(scene):
            add_wedges(scene)
            scene["shapes"]["wedge"]["up"] = "z"

        self.succeed("simulate", self.write_scene(turn), "-o", "out/z")
        store = zarr.open(str(self.dir / "out/z/trajectory.zarr"), mode="r")
        (shape,) = [s for s in store.attrs["shapes"] if s["name"] == "wedge"]
        self.assertEqual(shape["up"], "z")
        (before,) = [s for s in self.store.attrs["shapes"] if s["name"] == "wedge"]
        self.assertEqual(before["up"], "y")
        x, y, z = before["centre_of_mass"]
        for turned, expected in zip(shape["centre_of_mass"], (x, z, -y)):
            self.assertAlmostEqual(turned, expected, places=9)
        here = os.getcwd()
        text = (SOURCE / "docs/files.md").read_text()
        (example,) = [b for b in re.findall(r"^```python\n(.*?)^```", text, re.M | re.S) if "scale" in b]
        os.chdir(self.dir)
        try:
            place = {}
            exec(example.replace("rabbits/3", "leaning wedge").replace("out/a", "out/z"), place)
        finally:
            os.chdir(here)
        # The static one stands where the scene has its file's origin.
        file = numpy.array([line.split()[1:] for line in WEDGE_OBJ.splitlines() if line[0] == "v"], float)
        turned = file[:, [0, 2, 1]] * [1, 1, -1]
        expected = 0.1 * turned @ matrix([0.5, 0.5, -0.5, 0.5]).T + [-3, 1, 0.5]
        self.assertLess(abs(place["world"] - expected).max(), 1e-6)

    def test_principal_axes_are_those_of_the_inertia(self):
        for index, shape in enumerate(self.store.attrs["shapes"]):
            if shape["plane"]:
                continue
            vertices = self.store[f"shapes/{index}/vertices"][:].astype(float)
            axes = matrix(shape["principal_axes"])
            moments = axes.T @ inertia(vertices, self.store[f"shapes/{index}/triangles"][:]) @ axes
            self.assertLess(abs(moments - numpy.diag(numpy.diag(moments))).max(), 1e-6 * moments.max())
            self.assertTrue((numpy.diff(numpy.diag(moments)) > -1e-6 * moments.max()).all())


class Colours(CommandTest):
    """Those of a mesh's file go with its bodies, unless the scene has one for them."""

    def test_a_texture_goes_through_gltf_and_back(self):
        pixels = textured_wedge(self.dir)
        self.succeed("simulate", self.write_scene(add_wedges), "-o", "run")

        def textured_corners(run):
            store = zarr.open(str(self.dir / run / "trajectory.zarr"), mode="r")
            (texture,) = (store[f"textures/{i}"][:] for i in range(len(store.attrs["textures"])))
            (shape,) = (s for s in store["shapes"].group_keys() if "uv" in store[f"shapes/{s}"])
            (triangle,) = numpy.flatnonzero(store[f"shapes/{shape}/texture"][:])
            self.assertEqual(len(set(map(tuple, store[f"shapes/{shape}/colours"][:].tolist()))), 2)
            uv = store[f"shapes/{shape}/uv"][triangle]
            return texture.tolist(), sorted(uv.round(5).tolist())

        expected = pixels.tolist(), sorted([[0.25, 0.25], [3, 0.5], [0, 2]])
        self.assertEqual(textured_corners("run"), expected)
        # The exported mesh equals the original one.
        for name in ("run.glb", "run.gltf"):
            self.succeed("export", "run", "--frames", "0", "--only", "leaning wedge", "--as", "objects",
                         "--no-camera", "-o", name)

            def as_mesh(scene):
                add_wedges(scene)
                scene["shapes"]["wedge"]["file"] = name

            self.succeed("simulate", self.write_scene(as_mesh), "-o", "from_" + name)
            self.assertEqual(textured_corners("from_" + name), expected)

    def test_a_picture_in_gltf_is_as_long_as_it_is(self):
        def png_sizes(name):
            data = (self.dir / name).read_bytes()
            length = struct.unpack_from("<I", data, 12)[0]
            document, buffer = json.loads(data[20:20 + length]), data[20 + length + 8:]
            self.assertEqual(len(buffer), document["buffers"][0]["byteLength"])
            for view in document["bufferViews"]:
                self.assertEqual(view["byteOffset"] % 4, 0)
            for image in document["images"]:
                view = document["bufferViews"][image["bufferView"]]
                picture = buffer[view["byteOffset"]:view["byteOffset"] + view["byteLength"]]
                self.assertEqual(picture[:4], b"\x89PNG")
                self.assertEqual(picture[-8:-4], b"IEND")  # and its checksum: nothing follows
                yield len(picture)

        # Many sizes, since a length may be a whole number of words by chance.
        noise = numpy.random.default_rng(7)
        (self.dir / "t.mtl").write_text("".join(f"newmtl t{i}\nmap_Kd {i}.png\n" for i in range(4)))
        for i in range(4):
            (self.dir / f"{i}.png").write_bytes(png(noise.integers(0, 256, (3 + i, 6, 3), numpy.uint8)))
        head, _, faces = WEDGE_OBJ.partition("f ")
        lines = [f"usemtl t{i % 4}\nf " + " ".join(f"{v}/1" for v in line.split()[1:])
                 for i, line in enumerate(("f " + faces).strip().split("\n"))]
        (self.dir / "wedge.obj").write_text(f"mtllib t.mtl\n{head}vt 0.5 0.5\n" + "\n".join(lines))
        self.succeed("simulate", self.write_scene(add_wedges), "-o", "run")
        self.succeed("export", "run", "--frames", "last", "-o", "a.glb")
        sizes = list(png_sizes("a.glb"))
        self.assertEqual(len(sizes), 4)
        self.assertTrue(any(size % 4 for size in sizes), sizes)

    def test_textures_go_into_usd(self):
        pictures = {"one": [[200, 10, 20], [30, 40, 250]], "two": [[0, 255, 0], [90, 91, 92]]}
        for name, row in pictures.items():
            (self.dir / f"{name}.png").write_bytes(png(numpy.array([row], numpy.uint8)))
        (self.dir / "t.mtl").write_text(
            "newmtl one\nmap_Kd one.png\nnewmtl two\nmap_Kd two.png\nnewmtl red\nKd 1 0 0\n")
        head, _, faces = WEDGE_OBJ.partition("f ")
        faces = [line.split()[1:] for line in ("f " + faces).strip().split("\n")]
        vertices = numpy.array([line.split()[1:] for line in head.strip().split("\n")], float)
        # A corner lies in the texture as its vertex does in space: OBJ and USD both count v upward.
        places = vertices[:, [0, 2]] * [0.25, -1.5]
        materials = {"wedge": ("one", "red", "two", "two", "red", "one"), "whole": ("two",) * 6}
        for name, of_faces in materials.items():
            (self.dir / f"{name}.obj").write_text(
                f"mtllib t.mtl\n{head}" + "".join(f"vt {u} {v}\n" for u, v in places) + "".join(
                    f"usemtl {m}\nf " + " ".join(f"{v}/{v}" for v in f) + "\n" for m, f in zip(of_faces, faces)))

        def add(scene):
            add_wedges(scene)
            scene["shapes"]["whole"] = {"type": "mesh", "file": "whole.obj", "scale": 0.1}
            for shape, more in (("whole", {}), ("wedge", {"colour": "#00ff00"})):
                scene["bodies"].append({"name": "another " + shape, "shape": shape, "material": "wood",
                                        "position": [6, 1, len(more)], **more})

        def blocks(kind, text):
            return {name: inside for _, name, inside in
                    re.findall(rf'^( *){kind} "(\w+)"(.*?)^\1\}}', text, re.M | re.S)}

        def shown(binding, usda):
            """The name of what a material's picture is, or its colour."""
            self.assertTrue(binding.startswith("/pile/materials/"))
            shaders = blocks("def Shader", blocks("def Material", usda)[binding.split("/")[-1]])
            self.assertEqual("texture" in shaders, "place" in shaders)
            (colour,) = re.findall(r"diffuseColor.*? = (.*)", shaders["surface"])
            if "texture" not in shaders:
                return "red" if colour == f"<{binding}/paint.outputs:result>" else colour
            self.assertEqual(colour, f"<{binding}/texture.outputs:rgb>")
            for line in ('token inputs:sourceColorSpace = "sRGB"', 'token inputs:wrapS = "repeat"',
                         'token inputs:wrapT = "repeat"', f"st.connect = <{binding}/place.outputs:result>"):
                self.assertIn(line, shaders["texture"])
            self.assertIn('string inputs:varname = "st"', shaders["place"])
            data = (self.dir / re.search(r"asset inputs:file = @\./(.*)@", shaders["texture"])[1]).read_bytes()
            rows = zlib.decompress(data[data.index(b"IDAT") + 4 : data.index(b"IEND") - 8])
            pixels = numpy.frombuffer(rows, numpy.uint8)[1:].reshape(-1, 3)
            self.assertEqual(rows[0], 1)  # differences to the left
            return {str(row): name for name, row in pictures.items()}[str((pixels.cumsum(0) % 256).tolist())]

        self.succeed("simulate", self.write_scene(add), "-o", "run")
        for form in ("objects", "instances"):
            self.succeed("export", "run", "--frames", "0", "--as", form, "-o", f"{form}.usda")
            self.assertEqual(len(list(self.dir.glob(f"{form}.texture.*.png"))), 2)
            # They are files like the others: not written over, and none stays without them.
            before = {file: file.read_bytes() for file in self.dir.glob(f"{form}.*")}
            (self.dir / f"{form}.usda").unlink()
            self.expect_exit(2, "export", "run", "--frames", "0", "--as", form, "-o", f"{form}.usda")
            self.assertFalse((self.dir / f"{form}.usda").exists())
            self.succeed("export", "run", "--frames", "0", "--as", form, "-o", f"{form}.usda", "--force")
            self.assertEqual({file: file.read_bytes() for file in self.dir.glob(f"{form}.*")}, before)
            usda = (self.dir / f"{form}.usda").read_text()
            for shape, of_faces in materials.items():
                mesh = blocks("def Mesh", usda.split('def Xform "pile"')[0])[shape]
                value = {name: numpy.array(eval(text)) for name, text in re.findall(r"^        \S+ (\S+) = (\[.*\])", mesh, re.M)}
                # The mesh is about its centre of mass, not turned.
                corners = value["points"][value["faceVertexIndices"]] / 0.1
                corners += vertices.min(0) - corners.min(0)
                at = abs(corners[:, None] - vertices).max(2).argmin(1).reshape(-1, 3)
                told = {frozenset(int(v) - 1 for v in face): m for face, m in zip(faces, of_faces)}
                wanted = [told.pop(frozenset(face)) for face in at.tolist()]
                for face, material in enumerate(wanted):
                    if material != "red":
                        off = value["primvars:st"][3 * face : 3 * face + 3] - places[at[face]]
                        self.assertLess(abs(off).max(), 1e-5)
                subsets = {name: eval(re.search(r"indices = (.*)", text)[1])
                           for name, text in blocks("def GeomSubset", mesh).items()}
                found = set()
                for body in blocks("def Mesh", usda).values():
                    if f"references = </meshes/{shape}>" not in body:
                        continue
                    (own,) = re.findall(r"binding = <(.*)>", body.split("over ")[0])
                    looks = [shown(own, usda)] * 6
                    for name, text in blocks("over", body).items():
                        for face in subsets[name]:
                            looks[face] = shown(re.search(r"binding = <(.*)>", text)[1], usda)
                    found.add(tuple(looks))
                self.assertEqual(found, {tuple(wanted)} | ({("(0, 1, 0)",) * 6} if shape == "wedge" else set()))

    def test_they_are_in_all_that_is_written(self):
        head, _, faces = WEDGE_OBJ.partition("f ")
        (self.dir / "two.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl dark\nKd 0.2 0.4 0.6\n")
        first, _, others = ("f " + faces).partition("\n")
        (self.dir / "wedge.obj").write_text(
            f"mtllib two.mtl\n{head}usemtl red\n{first}\nusemtl dark\n{others}")

        def paint(scene):
            add_wedges(scene)
            scene["bodies"][-1]["colour"] = "#00ff00"

        self.succeed("simulate", self.write_scene(paint), "-o", "run")
        store = zarr.open(str(self.dir / "run/trajectory.zarr"), mode="r")
        names = store.attrs["body_name"]
        painted = {name for name, is_painted in zip(names, store["body_painted"][:]) if is_painted}
        self.assertEqual(painted, {"falling wedge"})
        shape = store["body_shape"][names.index("falling wedge")]
        colours = store[f"shapes/{shape}/colours"][:]
        self.assertEqual(len(colours), len(store[f"shapes/{shape}/triangles"]))
        self.assertEqual({tuple(c) for c in colours.tolist()}, {(255, 0, 0), (51, 102, 153)})

        self.succeed("export", "run", "-o", "run.npz")
        arrays = numpy.load(self.dir / "run.npz")
        about = json.loads(bytes(arrays["about_json"]))
        looks = dict(zip(about["body_name"], (about["look_painted"][i] for i in arrays["look"])))
        self.assertTrue(looks["falling wedge"] and not looks["leaning wedge"])
        self.assertTrue((abs(arrays[f"shape_{shape}_colours"].astype(int) - colours) <= 2).all())

        self.succeed("export", "run", "-o", "run.gltf")
        gltf = json.loads((self.dir / "run.gltf").read_text())
        primitives = {gltf["meshes"][n["mesh"]]["name"]: gltf["meshes"][n["mesh"]]["primitives"][0]
                      for n in gltf["nodes"] if "wedge" in n["name"]}
        coloured = [p for p in primitives.values() if "COLOR_0" in p["attributes"]]
        self.assertEqual((len(primitives), len(coloured)), (2, 1))
        material = gltf["materials"][coloured[0]["material"]]
        self.assertEqual(material["pbrMetallicRoughness"]["baseColorFactor"], [1, 1, 1, 1])
        accessor = gltf["accessors"][coloured[0]["attributes"]["COLOR_0"]]
        self.assertEqual(accessor["count"], gltf["accessors"][coloured[0]["attributes"]["POSITION"]]["count"])

        self.succeed("export", "run", "-o", "run.usda")
        usda = (self.dir / "run.usda").read_text()
        (values,) = re.findall(r"primvars:displayColor = \[(.*?)\] \(", usda, re.S)
        self.assertEqual(values.count("("), len(colours))
        self.assertEqual(usda.count("UsdPrimvarReader_float3"), 1)


class Surfaces(CommandTest):
    """Roughness and clear coat of the scene are in all that is written."""

    def test_gloss(self):
        def glossy(scene):
            scene["materials"]["wood"]["roughness"] = 0.25
            scene["materials"]["lacquer"] = {"roughness": 0.6, "clear_coat": 0.5}
            scene["materials"]["gold"] = {"look": "gold", "roughness": 0.2}
            scene["materials"]["glass"] = {"roughness": 0.1, "transmission": 1}
            scene["materials"]["lamp"] = {"colour": "#ffffff", "roughness": 0.9, "emission": 4}
            scene["bodies"].append({"name": "lacquered", "shape": "box", "material": "lacquer", "position": [3, 1, 0]})
            for i, name in enumerate(("gold", "glass", "lamp")):
                scene["bodies"].append({"name": name, "shape": "box", "material": name, "position": [6 + 3 * i, 1, 0]})

        self.succeed("simulate", self.write_scene(glossy), "-o", "run")
        for name in ("a.gltf", "a.usda", "a.npz", "a.vat.glb"):
            self.succeed("export", "run", "--frame", "0", "-o", name, *(["--as", "instances"] if name == "a.gltf" else []))
        wanted = {"ground": (1, 0), "boxes/0": (0.25, 0), "lacquered": (0.6, 0.5), "gold": (0.2, 0), "glass": (0.1, 0),
                  "lamp": (0.9, 0)}
        substance = {"gold": (1, 0, 0), "glass": (0, 1, 0), "lamp": (0, 0, 4)}

        gltf = json.loads((self.dir / "a.gltf").read_text())
        self.assertEqual(gltf["extensionsUsed"], ["EXT_mesh_gpu_instancing", "KHR_materials_clearcoat",
                                                  "KHR_materials_emissive_strength", "KHR_materials_transmission"])
        self.assertEqual(gltf["extensionsRequired"], ["EXT_mesh_gpu_instancing"])
        found = {}
        for material in gltf["materials"]:
            coat = material.get("extensions", {}).get("KHR_materials_clearcoat", {})
            if coat:
                self.assertEqual(coat["clearcoatRoughnessFactor"], 0.08)
            gloss = material["pbrMetallicRoughness"]["roughnessFactor"], coat.get("clearcoatFactor", 0)
            found.setdefault(gloss, []).append(material["name"])
            more = material.get("extensions", {})
            values = (material["pbrMetallicRoughness"]["metallicFactor"],
                      more.get("KHR_materials_transmission", {}).get("transmissionFactor", 0),
                      more.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 0))
            self.assertEqual(values, substance.get(material["name"].split()[0], (0, 0, 0)))
            self.assertEqual(material.get("emissiveFactor"), [1, 1, 1] if values[2] else None)
        self.assertEqual(set(found), set(wanted.values()))
        self.assertTrue(found[0.6, 0.5][0].endswith(" roughness 0.6 coat 0.5"), found)
        self.assertTrue(found[0.25, 0][0].endswith(" roughness 0.25"), found)
        self.succeed("export", "run", "--frame", "0", "--only", "boxes/*", "-o", "plain.gltf", "--as", "objects")
        self.assertNotIn("extensionsUsed", json.loads((self.dir / "plain.gltf").read_text()))

        usda = (self.dir / "a.usda").read_text()
        found = set()
        for surface in re.findall(r'"UsdPreviewSurface"(.*?)\}', usda, re.S):
            value = {name: float(text) for name, text in re.findall(r"float inputs:(\w+) = (.*)", surface)}
            found.add((value["roughness"], value.get("clearcoat", 0)))
            emitted = re.search(r"emissiveColor = \((\S+), ", surface)
            self.assertIn((value.get("metallic", 0), 1 - value.get("opacity", 1), float(emitted[1]) if emitted else 0),
                          [(0, 0, 0), *substance.values()])
            self.assertEqual(value.get("clearcoatRoughness"), 0.08 if "clearcoat" in value else None)
        self.assertEqual(found, set(wanted.values()))

        arrays = numpy.load(self.dir / "a.npz")
        about = json.loads(bytes(arrays["about_json"]))
        for name, (roughness, coat) in wanted.items():
            look = arrays["look"][about["body_name"].index(name)]
            self.assertAlmostEqual(about["look_roughness"][look], roughness)
            self.assertAlmostEqual(about["look_clear_coat"][look], coat)
            told = tuple(about["look_" + key][look] for key in ("metallic", "transmission", "emission"))
            self.assertEqual(told, substance.get(name, (0, 0, 0)))

        # The one mesh has one material.
        data = (self.dir / "a.vat.glb").read_bytes()
        (length,) = struct.unpack_from("<I", data, 12)
        (material,) = json.loads(data[20 : 20 + length])["materials"]
        mean = numpy.mean(numpy.array(about["look_roughness"])[arrays["look"]])
        self.assertAlmostEqual(material["pbrMetallicRoughness"]["roughnessFactor"], mean, 3)


def add_life(scene):
    """Bodies that come late, go, rest for ever or for a while; a camera that moves."""
    add_wedges(scene)
    scene["materials"]["stone"] = {"density_kg_m3": 2500}
    scene["emitters"].append(
        {"name": "late, \"odd\" names", "type": "stream", "shape": "wedge", "material": "stone",
         "position": [0, 3, 2], "count": 3, "rate_hz": 8, "start_s": 0.1, "linear_velocity": [0, -3, 0],
         "angular_velocity": [1, 9, 2]})
    scene["events"] = [{"type": "remove", "time_s": 0.3, "bodies": ["boxes/2"]}]
    scene["bodies"].append(
        {"name": "asleep", "shape": "box", "material": "wood", "position": [9, 0.1, 0], "asleep": True})
    scene["camera"] = {"keys": [{"time_s": 0, "position": [4, 3, 9], "target": [0, 0, 0]},
                                {"time_s": 1, "position": [-4, 3, 9], "target": [0, 0.5, 0]}]}  # fmt: skip


def interpolated(times, values, t):
    """Straight between keys, as USD and glTF have it; the first and last hold outside."""
    if t <= times[0]:
        return values[0]
    for i in range(1, len(times)):
        if t < times[i]:
            share = (t - times[i - 1]) / (times[i] - times[i - 1])
            return values[i - 1] + share * (values[i] - values[i - 1])
    return values[-1]


def held(times, values, t):
    return [value for time, value in zip(times, values) if time <= t or time == times[0]][-1]


class Exported(CommandTest):
    """Each format gives back the poses of the trajectory, by a small reader of its own."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.kept = cls("test_npz")
        cls.kept.setUp()
        (cls.kept.dir / "wedge.obj").write_text(WEDGE_OBJ)
        scene = cls.kept.write_scene(add_life)
        cls.kept.succeed("simulate", scene, "-o", "run")
        cls.out = cls.kept.dir / "run"
        store = zarr.open(str(cls.out / "trajectory.zarr"), mode="r")
        cls.names = store.attrs["body_name"]
        cls.rate = store.attrs["frame_rate"]
        cls.position, cls.orientation = store["position"][:], store["orientation"][:]
        cls.present = store["state"][:] & 1 == 1
        cls.moves = (cls.position != cls.position[0]).any((0, 2)) | (~cls.present).any(0)

    @classmethod
    def tearDownClass(cls):
        cls.kept.doCleanups()
        super().tearDownClass()

    def export(self, name, *arguments):
        self.succeed("export", self.out, "-o", name, *arguments)
        return self.dir / name

    def same_turn(self, a, b, tolerance=1e-5):
        a, b = numpy.array(a, float), numpy.array(b, float)
        self.assertLess(min(abs(a - b).max(), abs(a + b).max()), tolerance)

    def check(self, frame, body, position, orientation=None, tolerance=1e-5):
        self.assertLess(abs(self.position[frame, body] - position).max(), 1e-5)
        if orientation is not None:
            self.same_turn(orientation, self.orientation[frame, body], tolerance)

    def test_the_run_has_what_is_to_be_tried(self):
        self.assertTrue((~self.present[0]).any() and (~self.present[-1]).any())
        self.assertGreater((~self.moves).sum(), 1)

    # npz and csv

    def test_npz(self):
        arrays = numpy.load(self.export("a.npz"))
        about = json.loads(bytes(arrays["about_json"]))
        self.assertEqual(sorted(about["body_name"]), sorted(self.names))
        ids = arrays["id"]
        self.assertEqual([self.names[i] for i in ids], about["body_name"])
        self.assertTrue((arrays["position"] == self.position[:, ids]).all())
        self.assertTrue((arrays["state"] & 1 == self.present[:, ids]).all())
        q, expected = arrays["orientation"], self.orientation[:, ids]
        self.assertTrue(((q == expected).all(-1) | (q == -expected).all(-1)).all())
        self.assertTrue(((q[1:] * q[:-1]).sum(-1) >= 0).all(), "jumps to the other sign")
        self.assertEqual(list(arrays["frame"]), list(range(16)))
        self.assertTrue(numpy.allclose(arrays["time_s"], numpy.arange(16) / self.rate))
        shape = arrays["shape"][about["body_name"].index("falling wedge")]
        self.assertEqual(arrays[f"shape_{shape}_triangles"].max() + 1, len(arrays[f"shape_{shape}_vertices"]))
        self.assertEqual(arrays["camera"].shape, (16, 8))

    def test_the_example_of_the_docs_runs(self):
        (example,) = re.findall(r"^```python\n(.*?)^```", (SOURCE / "docs/export.md").read_text(), re.M | re.S)
        place = {"print": lambda name, _: self.assertEqual(name, "leaning wedge")}
        exec(example.replace('"pile.npz"', repr(str(self.export("pile.npz", "--only", "*wedge")))), place)

    def test_csv(self):
        text = self.export("a.csv", "--every", "3").read_text()
        rows = list(csv.DictReader(text.splitlines()))
        self.assertEqual(len(rows), self.present[::3].sum())
        for row in rows:
            frame, body = int(row["frame"]), int(row["id"])
            self.assertEqual(row["name"], self.names[body])
            self.assertEqual(float(row["time_s"]), frame / self.rate)
            self.check(frame, body, [float(row[k]) for k in ("x_m", "y_m", "z_m")],
                       [float(row[k]) for k in ("qw", "qx", "qy", "qz")])

    # glTF

    def gltf(self, path):
        """The document, and the bytes of its buffers, one after the other."""
        data = path.read_bytes()
        if path.suffix == ".gltf":
            document = json.loads(data)
            buffers = []
            for buffer in document["buffers"]:
                buffers.append((path.parent / buffer["uri"].replace("%20", " ")).read_bytes())
                self.assertEqual(len(buffers[-1]), buffer["byteLength"])
            return document, b"".join(buffers)
        self.assertEqual(struct.unpack("<4sII", data[:12]), (b"glTF", 2, len(data)))
        length, kind = struct.unpack("<I4s", data[12:20])
        self.assertEqual((kind, length % 4), (b"JSON", 0))
        document = json.loads(data[20 : 20 + length])
        start = 20 + length
        size, kind = struct.unpack("<I4s", data[start : start + 8])
        self.assertEqual((kind, start + 8 + size), (b"BIN\0", len(data)))
        return document, data[start + 8 :]

    def accessor(self, document, buffer, index):
        accessor = document["accessors"][index]
        view = document["bufferViews"][accessor["bufferView"]]
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        kind = {5126: numpy.float32, 5125: numpy.uint32}[accessor["componentType"]]
        before = sum(buffer["byteLength"] for buffer in document["buffers"][: view["buffer"]])
        start = before + view["byteOffset"] + accessor["byteOffset"]
        end = accessor["byteOffset"] + 4 * width * accessor["count"]
        self.assertLessEqual(end, view["byteLength"])
        values = numpy.frombuffer(buffer, kind, width * accessor["count"], start)
        return values.reshape(-1, width) if width > 1 else values

    def test_moving_gltf(self):
        document, buffer = self.gltf(self.export("a b.gltf"))
        self.assertEqual(document["buffers"][0]["uri"], "a%20b.bin")
        self.assertEqual(self.gltf(self.export("a.glb"))[1], buffer)
        self.check_moving_gltf(document, buffer)

    def test_large_gltf_has_several_buffers(self):
        document, buffer = self.gltf(self.export("a b.gltf", "--part-bytes", "2000"))
        names = [buffer["uri"] for buffer in document["buffers"]]
        self.assertEqual(names[:3], ["a%20b.bin", "a%20b.2.bin", "a%20b.3.bin"])
        self.assertTrue(all(buffer["byteLength"] <= 2000 for buffer in document["buffers"]))
        self.check_moving_gltf(document, buffer)

    def check_moving_gltf(self, document, buffer):
        get = lambda index: self.accessor(document, buffer, index)
        (animation,) = document["animations"]
        tracks = {}
        for channel in animation["channels"]:
            sampler = animation["samplers"][channel["sampler"]]
            target = channel["target"]
            tracks[target["node"], target["path"]] = (
                get(sampler["input"]), get(sampler["output"]), sampler["interpolation"])  # fmt: skip
        bodies = 0
        for index, node in enumerate(document["nodes"]):
            if "mesh" not in node:
                continue
            bodies += 1
            body = node["extras"]["id"]
            self.assertEqual(node["name"], self.names[body])
            constant = ([0], numpy.array([node["translation"]]), "LINEAR")
            times, places, _ = tracks.get((index, "translation"), constant)
            turn_times, turns, _ = tracks.get((index, "rotation"), ([0], numpy.array([node["rotation"]]), ""))
            scale = ([0], [node.get("scale", [1, 1, 1])], "STEP")
            scale_times, scales, how = tracks.get((index, "scale"), scale)
            self.assertEqual(how, "STEP")
            self.assertEqual(len(times) > 1, bool((self.position[:, body] != self.position[0, body]).any()))
            self.assertTrue(((turns[1:] * turns[:-1]).sum(-1) >= 0).all(), "jumps to the other sign")
            for frame in range(16):
                t = numpy.float32(frame / self.rate)
                x, y, z, w = interpolated(turn_times, turns, t)
                self.check(frame, body, interpolated(times, places, t), [w, x, y, z])
                self.assertEqual(held(scale_times, scales, t)[0] == 1, self.present[frame, body])
        self.assertEqual(bodies, len(self.names))
        (camera,) = [node for node in document["nodes"] if "camera" in node]
        self.assertIn((document["nodes"].index(camera), "rotation"), tracks)

    def test_keys_only_where_a_body_moves(self):
        document, _ = self.gltf(self.export("a.glb", "--only", "asleep", "--only", "leaning*", "--no-camera"))
        self.assertEqual([node["name"] for node in document["nodes"]], ["asleep", "leaning wedge"])
        self.assertNotIn("animations", document)

    def test_one_frame_of_gltf_is_instanced(self):
        document, buffer = self.gltf(self.export("a.glb", "--frame", "0.4s"))
        self.assertEqual(document["extensionsRequired"], ["EXT_mesh_gpu_instancing"])
        self.assertNotIn("animations", document)
        seen = set()
        for node in document["nodes"]:
            if "mesh" not in node:
                continue
            attributes = node["extensions"]["EXT_mesh_gpu_instancing"]["attributes"]
            place, turn, ids = (
                self.accessor(document, buffer, attributes[name]) for name in ("TRANSLATION", "ROTATION", "_ID"))
            for p, (x, y, z, w), body in zip(place, turn, ids.astype(int)):
                self.check(12, body, p, [w, x, y, z])
                seen.add(body)
        self.assertEqual(seen, set(numpy.flatnonzero(self.present[12])))

    def test_one_frame_of_gltf_as_objects(self):
        document, _ = self.gltf(self.export("a.glb", "--frame", "12", "--as", "objects", "--no-camera"))
        self.assertNotIn("extensionsUsed", document)
        for node in document["nodes"]:
            x, y, z, w = node["rotation"]
            self.check(12, node["extras"]["id"], node["translation"], [w, x, y, z])
        self.assertEqual(len(document["nodes"]), self.present[12].sum())

    def test_meshes_of_gltf(self):
        document, buffer = self.gltf(self.export("a.glb", "--only", "falling wedge"))
        (mesh,) = document["meshes"]
        (primitive,) = mesh["primitives"]
        points, normals, corners = (
            self.accessor(document, buffer, index)
            for index in (*primitive["attributes"].values(), primitive["indices"]))  # fmt: skip
        self.assertEqual(len(corners), 18)
        a, b, c = points[corners.reshape(-1, 3)].transpose(1, 0, 2)
        outwards = numpy.cross(b - a, c - a)
        shading = normals[corners.reshape(-1, 3)[:, 0]]
        self.assertTrue(((outwards * shading).sum(-1) > 0).all())
        highest = numpy.array(document["accessors"][0]["max"], numpy.float32)
        self.assertTrue((highest == points.max(0)).all())
        colour = document["materials"][mesh["primitives"][0]["material"]]["pbrMetallicRoughness"]
        self.assertEqual(len(colour["baseColorFactor"]), 4)

    # USD

    def prims(self, path):
        """(kind, name, text) of the prims in /pile; of a clip their kinds are empty."""
        text = path.read_text()
        self.assertTrue(text.startswith("#usda 1.0\n"))
        for opening, closing in ("{}", "[]", "()"):
            plain = re.sub(r'"(\\.|[^"\\])*"', "", text)
            self.assertEqual(plain.count(opening), plain.count(closing))
        inside = re.split(r'^(?:def Xform|over) "pile"', text, maxsplit=1, flags=re.M)[1]
        parts = re.split(r"^    (?:def|over) (\w*) ?\"(\w+)\"", inside, flags=re.M)[1:]
        return text, list(zip(parts[::3], parts[1::3], parts[2::3]))

    def clips(self, path):
        """The prims of a scene, each with the text of its parts in the clips behind it, and the frames that a clip begins with."""
        text, prims = self.prims(path)
        paths = re.findall(r"@\./([^@]+)@", re.search(r"assetPaths = (.*)", text)[1])
        active = eval(re.search(r"double2\[\] active = (.*)", text)[1])
        self.assertEqual([index for _, index in active], list(range(len(paths))))
        starts = [start for start, _ in active]
        self.assertEqual(eval(re.search(r"double2\[\] times = (.*)", text)[1]), [(0, 0), (15, 15)])
        manifest = re.search(r"manifestAssetPath = @\./([^@]+)@", text)[1]
        declared = {name: re.findall(r"^        [^\n=]* (\S+)$", prim, re.M) for _, name, prim in self.prims(path.parent / manifest)[1]}
        parts = [{name: prim for _, name, prim in self.prims(path.parent / p)[1]} for p in paths]
        for part in parts:
            self.assertEqual(set(part), set(declared))
            for name, prim in part.items():
                self.assertEqual(re.findall(r"(\S+)\.timeSamples", prim), declared[name])
        for kind, name, prim in prims:
            # A value in the scene itself overrides a clip.
            for attribute in declared.get(name, []):
                self.assertRegex(prim, rf"(?m)^        [^=]* {attribute}$")
        return [(kind, name, [prim, *(part[name] for part in parts if name in part)]) for kind, name, prim in prims], starts

    def values(self, prim, name):
        """time -> value of an attribute; {None: value} where it has no samples, {} where it is missing."""
        found = re.search(
            rf"^        [^\n=]*\b{name}(\.timeSamples)? = (\{{[^}}]*\}}|[^\n]*)", prim, re.M)
        if not found:
            return {}
        value = eval(found[2])
        return value if found[1] else {None: value}

    def at(self, values, frame):
        if None in values:
            return numpy.array(values[None], float)
        return interpolated(list(values), [numpy.array(v, float) for v in values.values()], frame)

    def test_usda_of_few_bodies(self):
        text, prims = self.prims(self.export("a.usda"))
        for line in ("metersPerUnit = 1", 'upAxis = "Y"', "startTimeCode = 0", "endTimeCode = 15", "timeCodesPerSecond = 30"):
            self.assertIn("    " + line + "\n", text)
        bodies = set()
        for kind, name, prim in prims:
            if kind != "Mesh":
                continue
            body = self.values(prim, "pilesim:id")[None]
            bodies.add(body)
            self.assertEqual(self.values(prim, "pilesim:name")[None], self.names[body])
            place, turn = self.values(prim, "xformOp:translate"), self.values(prim, "xformOp:orient")
            still = (self.position[:, body] == self.position[0, body]).all()
            self.assertEqual(None in place, still)
            shown = self.values(prim, "visibility") or {0: "inherited"}
            for frame in range(16):
                self.check(frame, body, self.at(place, frame), self.at(turn, frame))
                present = held(list(shown), list(shown.values()), frame) == "inherited"
                self.assertEqual(present, self.present[frame, body])
        self.assertEqual(bodies, set(range(len(self.names))))
        self.assertEqual([name for kind, name, _ in prims if kind == "Camera"], ["camera"])
        for used in re.findall(r"material:binding = <(/pile/materials/\w+)>", text):
            self.assertIn(f'def Material "{used.split("/")[-1]}"', text)

    def clip_at(self, parts, starts, frame):
        """The part of the clip that plays in this frame, or the scene's where it has none."""
        return parts[sum(start <= frame for start in starts)] if len(parts) > 1 else parts[0]

    def test_long_usda_of_few_bodies_is_split_into_clips(self):
        prims, starts = self.clips(self.export("a.usda", "--part-bytes", "5000"))
        self.assertGreater(len(starts), 2)
        bodies = set()
        for kind, name, parts in prims:
            if kind != "Mesh":
                continue
            body = self.values(parts[0], "pilesim:id")[None]
            bodies.add(body)
            self.assertEqual(len(parts) > 1, bool(self.moves[body]))
            for frame in numpy.arange(0, 15.1, 0.5):
                part = self.clip_at(parts, starts, frame)
                place = self.values(part, "xformOp:translate") or self.values(parts[0], "xformOp:translate")
                turn = self.values(part, "xformOp:orient") or self.values(parts[0], "xformOp:orient")
                if frame == int(frame):
                    self.check(int(frame), body, self.at(place, frame), self.at(turn, frame))
                else:
                    middle = self.position[int(frame) : int(frame) + 2, body].mean(0)
                    self.assertLess(abs(self.at(place, frame) - middle).max(), 1e-5)
                shown = self.values(part, "visibility") or {0: "inherited"}
                present = held(list(shown), list(shown.values()), frame) == "inherited"
                self.assertEqual(present, self.present[int(frame), body])
        self.assertEqual(bodies, set(range(len(self.names))))

    def test_long_usda_of_many_bodies_is_split_into_clips(self):
        prims, starts = self.clips(self.export("a.usda", "--part-bytes", "5000", "--as", "instances"))
        self.assertGreater(len(starts), 2)
        bodies = set()
        for kind, name, parts in prims:
            if kind != "PointInstancer":
                continue
            ids = self.values(parts[0], "ids")[None]
            bodies |= set(ids)
            self.assertEqual(len(parts) > 1, name != "resting")
            for frame in numpy.arange(0, 15.1, 0.5):
                part = self.clip_at(parts, starts, frame)
                place, turn, speed, gone = (
                    self.values(part, a) for a in ("positions", "orientations", "velocities", "invisibleIds"))
                absent = held(list(gone), list(gone.values()), frame) if gone else []
                places, turns = self.at(place, frame), self.at(turn, frame)
                for i, body in enumerate(ids):
                    self.assertEqual(body not in absent, self.present[int(frame), body])
                    if frame == int(frame):
                        self.check(int(frame), body, places[i], turns[i], 1e-3)
                if len(parts) > 1:
                    # As Pixar's library does: on from the last sample, or back from the first one.
                    start = held(list(place), list(place), frame)
                    ahead = numpy.array(place[start]) + numpy.array(speed[start]) * (frame - start) / self.rate
                    between = self.position[[int(frame), int(numpy.ceil(frame))]][:, ids].mean(0)
                    self.assertLess(abs(ahead - between).max(), 1e-3)
        self.assertEqual(bodies, set(range(len(self.names))))

    def test_usda_of_many_bodies(self):
        text, prims = self.prims(self.export("a.usda", "--as", "instances"))
        bodies = {}
        for kind, name, prim in prims:
            if kind != "PointInstancer":
                continue
            ids = self.values(prim, "ids")[None]
            self.assertEqual(self.values(prim, "scales")[None], [(1, 1, 1)] * len(ids))
            self.assertEqual(self.values(prim, "pilesim:name")[None], [self.names[i] for i in ids])
            place, turn, speed = (
                self.values(prim, attribute) for attribute in ("positions", "orientations", "velocities"))
            gone = self.values(prim, "invisibleIds")
            self.assertEqual(None in place, name == "resting")
            prototypes = len(re.findall(r"^            def Mesh ", prim, re.M))
            self.assertEqual(max(self.values(prim, "protoIndices")[None]) + 1, prototypes)
            for frame in range(16):
                places, turns = self.at(place, frame), self.at(turn, frame)
                absent = held(list(gone), list(gone.values()), frame) if gone else []
                for i, body in enumerate(ids):
                    bodies[body] = name
                    # Halves have 11 bits.
                    self.check(frame, body, places[i], turns[i], 1e-3)
                    self.assertEqual(body not in absent, self.present[frame, body])
                if frame < 15 and speed:
                    # On from the last sample, or back from the first one.
                    start = held(list(place), list(place), frame + 1)
                    ahead = numpy.array(place[start]) + numpy.array(speed[start]) * (frame + 1 - start) / self.rate
                    self.assertLess(abs(ahead - self.position[frame + 1, ids]).max(), 1e-3)
                    start = held(list(place), list(place), frame + 0.5)
                    ahead = numpy.array(place[start]) + numpy.array(speed[start]) * (frame + 0.5 - start) / self.rate
                    between = self.position[frame : frame + 2, ids].mean(0)
                    self.assertLess(abs(ahead - between).max(), 1e-3)
        self.assertEqual(set(bodies), set(range(len(self.names))))
        self.assertEqual({self.names[b] for b in bodies if bodies[b] == "resting"},
                         {self.names[b] for b in numpy.flatnonzero(~self.moves)})
        self.assertGreater(len(set(bodies.values())), 2)

    # Blender

    def test_blender_script(self):
        script = self.export("my pile.py")
        text = script.read_text()
        self.assertIn('DATA, FORM = "my pile.npz", "objects"\n', text)
        compile(text, "my pile.py", "exec")
        self.assertIn("position", numpy.load(self.dir / "my pile.npz"))
        text = self.export("many.py", "--as", "instances").read_text()
        self.assertIn('DATA, FORM = "many.npz", "instances"\n', text)

    # Choices, output and rejected requests

    def test_chosen_frames_keep_their_times(self):
        frames = numpy.load(self.export("a.npz", "--frames", "3-14x2", "--every", "3"))["frame"]
        self.assertEqual(list(frames), [3, 9])
        text, _ = self.prims(self.export("a.usda", "--frames", "4-", "--every", "5"))
        self.assertIn("startTimeCode = 4\n", text)
        self.assertIn("endTimeCode = 14\n", text)
        self.assertEqual(list(numpy.load(self.export("b.npz", "--every", "1000000"))["frame"]), [0])

    def test_prints_what_there_is(self):
        result = self.succeed("export", self.out, "-o", "a.gltf", "--only", "boxes/*", "--every", "2")
        self.assertRegex(result.stdout, r"^a\.gltf \(\d+\.\d kB\), a\.bin \(\d+\.\d kB\): 8 bodies, "
                                        r"8 of them moving, in 8 frames; \d+\.\d s\n$")  # fmt: skip
        self.assertEqual(self.succeed("export", self.out, "-o", "b.csv", "-q").stdout, "")

    def test_same_bytes_again(self):
        for name in ("a.usda", "a.glb", "a.npz", "a.csv"):
            first = self.export(name).read_bytes()
            self.assertEqual(self.export(name, "--force").read_bytes(), first)

    def test_existing_files_are_refused(self):
        for name, other in (("a.gltf", "a.bin"), ("b.py", "b.npz"), ("c.usda", "c.usda")):
            (self.dir / other).write_text("mine")
            result = self.expect_exit(2, "export", self.out, "-o", name)
            self.assertIn(f"{other}: the file exists already", result.stderr)
            self.assertEqual((self.dir / other).read_text(), "mine")
            self.export(name, "--force")
            self.assertNotEqual((self.dir / other).read_bytes(), b"mine")
        self.assertEqual([p.name for p in self.dir.iterdir() if p.name.startswith(".")], [])

    def test_errors(self):
        for arguments, text in (
            (["-o", "a.fbx"], "a.fbx: ends in .fbx; expected .usda, .gltf, .glb, .vat.glb (game engines), .py (Blender), .csv or .npz"),
            (["-o", "pile"], "pile: has no ending that names a format"),
            (["-o", "a.csv", "--only", "rabbit*"], "--only rabbit*: fits the name of no body"),
            (["-o", "a.glb", "--as", "instances"], "--as instances: glTF cannot move instances"),
            (["-o", "a.csv", "--frames", "3-99"], "--frames: 99 is not within 0-15"),
            (["-o", "a.csv", "--frame", "3", "--every", "2"], "excludes"),
            (["-o", "a.csv", "--every", "0"], "--every"),
            (["-o", "a.glb", "--part-bytes", "5000"], "--part-bytes: a.glb is not written in parts"),
            (["-o", "no/where/a.csv"], "no/where/a.csv: cannot be written"),
        ):
            result = self.run_pilesim("export", self.out, *arguments)
            self.assertIn(result.returncode, (2, 4), arguments)
            self.assertIn(text, result.stderr)
        self.assertEqual(list(self.dir.iterdir()), [])
        self.expect_exit(3, "export", self.dir, "-o", "a.csv")


if __name__ == "__main__":
    unittest.main()
