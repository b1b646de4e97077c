#!/usr/bin/env python3
"""Writes tests/fuzz/corpus: small files of every kind that pilesim reads, whole ones and broken ones.

    tests/fuzz/make_corpus.py build/release/commands/pilesim

Files that are there already are replaced; others, such as what libFuzzer found, stay.
"""

import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
CORPUS = ROOT / "tests" / "fuzz" / "corpus"


def put(target, name, data):
    folder = CORPUS / target
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_bytes(data.encode() if isinstance(data, str) else data)


def head(kind, value):
    if value < 24:
        return bytes([kind << 5 | value])
    return bytes([kind << 5 | 26]) + struct.pack(">I", value)


def cbor(value):
    if isinstance(value, bool):
        return b"\xf5" if value else b"\xf4"
    if isinstance(value, int):
        return head(0, value)
    if isinstance(value, float):
        return b"\xfb" + struct.pack(">d", value)
    if isinstance(value, str):
        return head(3, len(value.encode())) + value.encode()
    if isinstance(value, bytes):
        return head(2, len(value)) + value
    if isinstance(value, Typed):
        data = struct.pack(f"<{len(value.values)}{value.code}", *value.values)
        return head(6, value.tag) + head(2, len(data)) + data
    if isinstance(value, list):
        return head(4, len(value)) + b"".join(map(cbor, value))
    return head(5, len(value)) + b"".join(cbor(k) + cbor(v) for k, v in value.items())


class Typed:
    def __init__(self, code, values):
        self.code, self.values = code, values
        self.tag = {"f": 85, "B": 64, "I": 70, "b": 72}[code]


def axis(name, nodes, period=0.0):
    return {"name": name, "unit": "rad", "period": period, "nodes": nodes}


def table_signature():
    floats = lambda count: Typed("f", [0.1] * count)
    axes = [axis("theta", [0.0, 1.0]), axis("phi", [0.0, 1.0]), axis("psi", [-1.0, 1.0], 6.0),
            axis("alpha", [0.0, 1.0])]
    return {
        "format": "pilesim signature",
        "version": 6,
        "body": {"mesh": "a.obj", "mesh_hash": "0", "scale": 1.0, "hull_vertices": 8,
                 "volume_m3": 1.0, "centre_of_mass_m": [0.0, 0.0, 0.0],
                 "principal_inertia_m2": [1.0, 1.0, 1.0], "principal_axes_wxyz": [1.0, 0.0, 0.0, 0.0],
                 "gyration_m": 0.5, "outer_radius_m": 1.0},
        "material": {"restitution": 0.25, "friction": 0.5, "restitution_threshold_m_s": 0.0},
        "kind": "macro",
        "seed": 1,
        "sampling": {"trials_per_cell": 2, "target_error": 0.0},
        "heights": {"layout": "scale-free", "spin": axis("spin", [0.0, 1.0]),
                    "tilt": axis("tilt", [0.0, 1.0]), "trials": floats(4), "mean_m": floats(4),
                    "deviation_m": floats(4), "error_m": floats(4)},
        "responses": {"layout": "scale-free", "axes": axes, "trials": floats(16),
                      "mean": floats(96), "spread": floats(336), "mean_error": floats(96),
                      "most_growth": 1.5, "exemplar_count": 1, "exemplar_unit": 0.01,
                      "exemplars": Typed("b", [1] * 96)},
        "rest_poses": {"count": 1, "up": Typed("f", [0.0, 1.0, 0.0]), "height_m": Typed("f", [0.5]),
                       "probability": Typed("f", [1.0]), "simulated": Typed("B", [1]),
                       "family": Typed("I", [0])},
        "rest_drops": 100,
        "packing": {"pours": 3, "measured": floats(6), "error": floats(6), "spheres": floats(6),
                    "radius_m": 0.5, "rolling": 0.2},
    }


SEAL = b"\x50" + bytes(16)  # the document of it is read whatever the checksum says


def signatures(pilesim):
    put("signature", "table", cbor(table_signature()) + SEAL)
    bomb = table_signature()
    bomb["responses"]["axes"] = [axis("theta", [0.001 * i for i in range(200)])] * 4
    put("signature", "cells_without_end", cbor(bomb) + SEAL)
    put("signature", "nested", b"\x81" * 5000)
    put("signature", "nested_tags", b"\xc1" * 5000)
    put("signature", "length", b"\x9b\x00\x00\x00\xff\xff\xff\xff\xff" + bytes(20))
    put("signature", "version_3", cbor({"format": "pilesim signature", "version": 3}))
    partial = {"format": "pilesim partial signature", "version": 6, "fingerprint": "0", "cells": 2,
               "trials": 1, "launched": Typed("I", [1, 2]), "wanted": Typed("I", [2, 2]),
               "first_node": Typed("I", [0]), "keys": Typed("f", [0.1] * 3),
               "responses": Typed("f", [0.1] * 6)}
    put("partial_signature", "whole", cbor(partial) + SEAL)
    partial["trials"] = 2**31
    put("partial_signature", "trials_without_end", cbor(partial) + SEAL)
    names = ["normal"] + [f"{what}_{when}_{unit}" for when in ("before", "after") for what, unit in
                          (("v", "m_s"), ("w", "rad_s"))]
    header = ",".join(name.replace("_", axis + "_", 1) if "_" in name else f"{name}_{axis}"
                      for name in names for axis in "xyz")
    row = "\n0,1,0,1,-2,0,1,2,3,0.5,1,0,0,0,1"
    put("collisions", "whole", header + row * 6)
    put("collisions", "huge", header + row.replace("-2", "-1e300").replace("0.5", "1e300") * 6)
    put("collisions", "tiny", header + row.replace(",1,-2,0,1,2,3", ",0,-1e-300,0,0,0,0") * 6)
    put("collisions", "commas", header + "\n" + "," * 5000)
    put("collisions", "no_column", header[9:] + row)
    with tempfile.TemporaryDirectory() as folder:
        table, fitted = f"{folder}/box.sig", f"{folder}/box.fit.sig"
        box = ROOT / "assets" / "box.obj"
        subprocess.run([pilesim, "sample-signature", box, "-o", table, "--trials", "2", "--exemplars",
                        "0", "--no-accuracy", "--pours", "0", "--quiet"], check=True)
        subprocess.run([pilesim, "fit-bspline", table, "-o", fitted, "--max-bytes", "2500",
                        "--quiet"], check=True)
        whole = pathlib.Path(fitted).read_bytes()
    put("signature", "fitted", whole)
    put("signature", "truncated", whole[: len(whole) // 2])


def scenes():
    for name in ("impulse/tower_of_boxes", "hard/arch", "mixed/crosses", "repose/rabbit_matrix_35"):
        put("scene", name.replace("/", "_"), (ROOT / "presets" / f"{name}.json").read_bytes())
    put("scene", "all_keys_wrong", '{"version": 1, "bodies": 3, "materials": [], "camera": {"keys": 1}}')
    put("scene", "nested", "[" * 5000)
    put("scene", "nested_objects", '{"a":' * 2000)
    variables = '{"version": 1, "variables": {%s}, "materials": {%s}}'
    put("scene", "variables", variables % (
        '"d": 700, "m": {"density_kg_m3": {"var": "d"}}',
        '"a": {"var": "m"}, "b": {"friction": {"random": {"from": 0, "to": {"var": "d"}}}}'))
    put("scene", "variables_multiply", variables % (
        '"long": "' + "x" * 60_000 + '"', ", ".join('"m%d": {"note": {"var": "long"}}' % i for i in range(1200))))
    put("scene", "variables_of_variables", variables % (
        '"v0": [0, 0]' + "".join(', "v%d": [%s, %s]' % (i, *['{"var": "v%d"}' % (i - 1)] * 2) for i in range(1, 40)),
        '"a": {"var": "v39"}'))
    put("names", "control", b"a\x1b[31m\n\x00\x7f\xc2\x9b\xe2\x80\xae")
    put("names", "no_utf_8", b"\xff\xc0\xaf\xed\xa0\x80\xf4\x90\x80\x80\xe2\x82")
    put("names", "formula", "=HYPERLINK(\"x\")")
    put("names", "long", "n" * 300)
    put("json", "kinds", '// a\n{"a": [1, -2.5e3, true, null, "\\u00e9\\n"], "b/~": {}, "a": 1}')
    put("json", "nested", "[" * 5000)
    put("json", "nested_closed", "[" * 3000 + "]" * 3000)
    put("json", "number", "1e999")
    put("json", "bytes", b'"\xff\xfe\x80"')
    for name, value in ("number", "1e999"), ("vector", "[0, -9.81, 0]"), ("word", "down"), ("nested", "[" * 3000):
        put("override_value", name, value)


def meshes():
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    faces = [(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]
    obj = "".join("v %g %g %g\n" % c for c in corners)
    obj_faces = "".join("f %d %d %d\n" % tuple(i + 1 for i in f) for f in faces)
    put("mesh_obj", "whole", "mtllib /dev/zero\no a\n" + obj + obj_faces)
    put("mesh_obj", "index", obj + "f 1 2 900000000\nf -9 -8 -7\n")
    put("mesh_obj", "far", "v 1e30 0 0\nv 1e30 1 0\nv 1e30 0 1\nf 1 2 3\n")
    put("mesh_obj", "numbers", "v nan inf 1e999\nv 1 1 1\nv 2 2 2\nf 1 2 3\n")
    put("mesh_off", "whole", "OFF\n4 4 0\n" + "".join("%g %g %g\n" % c for c in corners)
        + "".join("3 %d %d %d\n" % f for f in faces))
    put("mesh_off", "counts", "OFF\n4000000000 4000000000 0\n0 0 0\n")
    ply = ("ply\nformat %s 1.0\nelement vertex %d\nproperty float x\nproperty float y\n"
           "property float z\nelement face %d\nproperty list uchar int vertex_index\nend_header\n")
    put("mesh_ply", "ascii", ply % ("ascii", 4, 4) + "".join("%g %g %g\n" % c for c in corners)
        + "".join("3 %d %d %d\n" % f for f in faces))
    binary = b"".join(struct.pack("<3f", *c) for c in corners)
    put("mesh_ply", "binary", (ply % ("binary_little_endian", 4, 4)).encode() + binary
        + b"".join(b"\x03" + struct.pack("<3i", *f) for f in faces))
    put("mesh_ply", "counts", ply % ("binary_little_endian", 4_000_000_000, 4_000_000_000))
    put("mesh_ply", "no_end", (ply % ("ascii", 4, 4)).replace("end_header", "end_heade"))
    put("mesh_ply", "counts_of_nothing", (ply % ("binary_little_endian", 4_000_000_000, 4)).replace(
        "property float x", "property flkat x"))
    put("mesh_ply", "list", (ply % ("binary_little_endian", 4, 1)).encode() + binary
        + b"\xff" + struct.pack("<3i", 0, 1, 2_000_000_000))
    stl = b"".join(struct.pack("<12fH", 0, 0, 0, *corners[a], *corners[b], *corners[c], 0)
                   for a, b, c in faces)
    put("mesh_bounds", "obj", "\0f 1 2 \\\n3\n f" + " 1" * 300 + "\nf\n")
    put("mesh_bounds", "stl", "\x01solid a\n" + " facet vertex vertex" * 50 + "facet")
    put("mesh_bounds", "ply", "\x02ply\nelement face 99999999999999999999\nelement face 4000001\nend_header\nelement face")
    put("mesh_stl", "binary", bytes(80) + struct.pack("<I", 4) + stl)
    put("mesh_stl", "count", bytes(80) + struct.pack("<I", 0xFFFFFFF0))
    put("mesh_stl", "ascii", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\n"
        "vertex 0 1 0\nendloop\nendfacet\nendsolid a\n")
    indices = struct.pack("<12H", *[i for f in faces for i in f])
    gltf = ('{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],'
            '"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],'
            '"buffers":[{"byteLength":72%s}],"bufferViews":[{"buffer":0,"byteLength":48},'
            '{"buffer":0,"byteOffset":48,"byteLength":24}],"accessors":[{"bufferView":0,'
            '"componentType":5126,"count":%d,"type":"VEC3"},{"bufferView":1,"componentType":5123,'
            '"count":12,"type":"SCALAR"}]}')

    def glb(text, data, length=None):
        text = text.encode() + b" " * (-len(text) % 4)
        chunks = struct.pack("<II", length or len(text), 0x4E4F534A) + text
        chunks += struct.pack("<II", len(data), 0x004E4942) + data
        return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks

    import base64
    uri = ',"uri":"data:application/octet-stream;base64,%s"'
    inline = uri % base64.b64encode(binary + indices).decode()
    put("mesh_glb", "whole", glb(gltf % ("", 4), binary + indices))
    put("mesh_glb", "length", glb(gltf % ("", 4), b"", 0xFFFFFFF0)[:22])
    put("mesh_glb", "count", glb(gltf % ("", 4_000_000_000), binary + indices))
    put("mesh_gltf", "inline", gltf % (inline, 4))
    put("mesh_gltf", "device", gltf % (',"uri":"/dev/zero"', 4))
    put("mesh_gltf", "count", gltf % (inline, 4_000_000_000))
    put("mesh_gltf", "cycle", '{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],'
        '"nodes":[{"children":[0]}]}')
    put("mesh_fbx", "empty", b"Kaydara FBX Binary  \x00\x1a\x00" + struct.pack("<I", 7400) + bytes(64))
    put("mesh_fbx", "length", b"Kaydara FBX Binary  \x00\x1a\x00" + struct.pack(
        "<IIIIB", 7400, 0xFFFFFFF0, 0xFFFFFFF0, 0xFFFFFFF0, 4) + b"Node")
    put("mesh_fbx", "ascii", "; FBX 7.4.0 project file\nFBXHeaderExtension: {\n}\n")
    put("mesh_dae", "mesh", '<?xml version="1.0"?><COLLADA version="1.4.1"><library_geometries>'
        '<geometry id="g"><mesh><source id="p"><float_array id="a" count="9">0 0 0 1 0 0 0 1 0'
        '</float_array><technique_common><accessor source="#a" count="3" stride="3"><param name="X" '
        'type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor>'
        '</technique_common></source><vertices id="v"><input semantic="POSITION" source="#p"/>'
        '</vertices><triangles count="1"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2'
        '</p></triangles></mesh></geometry></library_geometries><library_visual_scenes><visual_scene '
        'id="s"><node><instance_geometry url="#g"/></node></visual_scene></library_visual_scenes>'
        '<scene><instance_visual_scene url="#s"/></scene></COLLADA>')
    put("mesh_dae", "nested", '<COLLADA version="1.4.1">' + "<node>" * 700)


def others():
    place = '"file":"t.obj","scale":1,"centre_of_mass":[0,0,0],"principal_axes":[1,0,0,0]'
    zattrs = ('{"format":"pilesim-trajectory","format_version":3,"frame_rate":60.0,"seed":1,"scene":'
              '{"version":1},"shapes":[{"name":"t","plane":false,"type":"mesh",' + place +
              '},{"name":"g","plane":true,"type":"plane",' + place +
              '}],"materials":["wood"],"body_name":["a","b"]}')
    array = ('{"zarr_format":2,"shape":%s,"chunks":%s,"dtype":"%s","order":"C","fill_value":0,'
             '"compressor":{"id":"zstd","level":1},"filters":null}')
    put("trajectory", "attributes", b"\x00" + zattrs.encode())
    put("trajectory", "nested", b"\x00" + b"[" * 5000)
    put("trajectory", "position", b"\x01" + (array % ("[3,2,3]", "[256,2,3]", "<f8")).encode())
    put("trajectory", "long_chunk", b"\x01" + (array % ("[3,2,3]", "[1000000000,2,3]", "<f8")).encode())
    put("trajectory", "vertices", b"\x07" + (array % ("[4,3]", "[4,3]", "<f4")).encode())
    put("trajectory", "many_vertices",
        b"\x07" + (array % ("[100000000,3]", "[100000000,3]", "<f4")).encode())
    # A frame of zstd whose header promises a terabyte.
    put("trajectory", "content_size", b"\x02\x28\xb5\x2f\xfd\xe0" + struct.pack("<Q", 1 << 40) + bytes(8))
    put("trajectory", "no_frame", b"\x02 no frame of zstd")
    head = '{"format":"pilesim piles","version":2,'
    put("piles", "whole", head + '"changes":[{"frame":0,"piles":[{"core":[[0,0],[1,0],[0,1]],'
        '"walls":[],"layers":[{"bottom_m":0,"top_m":1,"radius_m":2}]}]}]}')
    put("piles", "no_core",
        head + '"changes":[{"frame":0,"piles":[{"core":[],"walls":[],"layers":[]}]}]}')
    put("piles", "version", '{"format":"pilesim piles","version":1,"changes":[]}')
    put("piles", "nested", "[" * 5000)
    head = '{"format":"pilesim guide","version":3,"frames":[],'
    put("guide", "whole", head + '"guide":{"vertices":[[0,0,0],[1,0,0],[0,1,0]],'
        '"triangles":[[0,1,2]]},"constraints":[{"frame":0,"points":[[0,0,0]]}],'
        '"glue":[{"a":1,"b":0,"b_stands":true,"arm":[0,0,0],"weights":1,"from_s":0}],'
        '"forces":[{"a":1,"b":2,"b_stands":false,"arm":[0,0,0],"weights":-1,"from_s":0,'
        '"until_s":1}]}')
    put("guide", "index",
        head + '"guide":{"vertices":[],"triangles":[[0,1,2]]},"constraints":[],"glue":[],"forces":[]}')
    put("guide", "nested", '{"guide":' + "[" * 5000)
    magic = b"pilesim checkpoint\n"
    source = (ROOT / "src" / "core" / "checkpoint_file.cpp").read_text()
    version = int(re.search(r"kVersion = (\d+)", source)[1])
    put("checkpoint", "no_state", magic + struct.pack("<I", version))
    put("checkpoint", "version", magic + struct.pack("<I", 9999))
    put("checkpoint", "length", magic + struct.pack("<IQ", version, 1 << 60))
    # A byte in the middle of each run's state; all that follows cut off; the sign of each 50th.
    for run in range(7):
        put("checkpoint", f"changed_{run}", struct.pack("<BHB", run, 40000, 0x80))
        put("checkpoint", f"cut_{run}", struct.pack("<BHB", run, 50000, 0))
        put("checkpoint", f"signs_{run}", bytes([run]) + b"".join(
            struct.pack("<HB", at, 0xC0) for at in range(0, 65536, 1311)))
    piece = {"vertices": struct.pack("<9d", 0, 0, 0, 1, 0, 0, 0, 1, 0),
             "triangles": struct.pack("<3I", 0, 1, 2)}
    whole = {"pieces": [piece], "mesh_volume_m3": 1.0, "union_volume_m3": 1.0,
             "excess_volume_m3": 0.0, "missing_volume_m3": 0.0, "surface_error_m": 0.0,
             "mean_surface_error_m": 0.0, "from_groups": False, "more_pieces": 0, "error_with_more": 0.0}
    put("decomposition", "whole", cbor(whole))
    piece["triangles"] = struct.pack("<3I", 0, 1, 900)
    put("decomposition", "index", cbor(whole))
    put("decomposition", "kind", cbor(["pieces"]))
    put("decomposition", "nested", b"\x81" * 5000)
    solid = {**piece, "triangles": struct.pack("<3I", 0, 1, 2), "way": "wrapped", "note": ""}
    put("solid", "whole", cbor(solid))
    put("solid", "way", cbor({**solid, "way": "hull"}))
    put("solid", "length", cbor({**solid, "vertices": b"\0" * 70}))
    put("solid", "nested", b"\x81" * 5000)


def png(width, height, depth, colour, rows, claimed=None):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    head = struct.pack(">IIBBBBB", *(claimed or (width, height)), depth, colour, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 9))
            + chunk(b"IEND", b""))


def height_fields():
    rows = b"".join(b"\x00" + struct.pack(">4H", *[j * 9000 + i * 3000 for i in range(4)]) for j in range(3))
    put("height_field", "grey_16", png(4, 3, 16, 0, rows))
    put("height_field", "rgb_8", png(2, 2, 8, 2, b"\x00" + bytes(range(6)) + b"\x01" + bytes(range(6))))
    put("height_field", "too_few_rows", png(4, 3, 16, 0, rows[:9]))
    put("height_field", "large", png(4, 3, 16, 0, rows, (60000, 60000)))
    put("height_field", "long_row", png(4, 3, 16, 0, rows, (0x7FFFFFFF, 2)))
    put("height_field", "inflates", png(2, 2, 8, 0, bytes(1 << 22)))
    put("height_field", "cut_off", png(4, 3, 16, 0, rows)[:50])
    put("height_field", "no_palette", png(4, 3, 8, 3, rows))


def hdr(width, height, pixels):
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + pixels


def exr(width, height, channels=(b"B", b"G", b"R"), tile=None, window=None):
    """Without compression."""
    def attribute(name, kind, data):
        return name + b"\0" + kind + b"\0" + struct.pack("<I", len(data)) + data
    listed = b"".join(name + b"\0" + struct.pack("<IIII", 2, 0, 1, 1) for name in channels) + b"\0"
    box = struct.pack("<4i", *(window or (0, 0, width - 1, height - 1)))
    head = struct.pack("<II", 20000630, 2 | (512 if tile else 0)) + b"".join((
        attribute(b"channels", b"chlist", listed), attribute(b"compression", b"compression", b"\0"),
        attribute(b"dataWindow", b"box2i", box), attribute(b"displayWindow", b"box2i", box),
        attribute(b"lineOrder", b"lineOrder", b"\0"), attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1)),
        attribute(b"screenWindowCenter", b"v2f", bytes(8)), attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)),
        attribute(b"tiles", b"tiledesc", struct.pack("<IIB", *tile, 0)) if tile else b"", b"\0"))
    values = struct.pack("<4f", 0.5, -1, float("nan"), 1e30) * width
    row = values[:4 * width] * len(channels)
    first = len(head) + 8 * height
    size = 8 + len(row)
    return (head + b"".join(struct.pack("<Q", first + y * size) for y in range(height))
            + b"".join(struct.pack("<iI", y, len(row)) + row for y in range(height)))


def skies():
    row = b"\2\2\0\x10" + (b"\x90\x64" * 2 + b"\x08abcdefgh\x88\x10" + b"\x90\x81")
    put("sky", "runs", hdr(16, 8, row * 8))
    put("sky", "flat", hdr(4, 2, bytes(range(100, 132))))
    put("sky", "no_runs", hdr(16, 8, b"\2\2\0\x10" + bytes(200)))
    put("sky", "long_run", hdr(16, 8, b"\2\2\0\x10\xff\x01" * 8))
    put("sky", "cut_off", hdr(16, 8, row * 8)[:90])
    put("sky", "large", hdr(0x7FFFFFFE, 0x3FFFFFFF, row))
    put("sky", "square", hdr(8, 8, bytes(256)))
    put("sky", "exr", exr(8, 4))
    put("sky", "exr_no_red", exr(8, 4, (b"B", b"G")))
    put("sky", "exr_cut_off", exr(8, 4)[:-40])
    put("sky", "exr_large", exr(8, 4, window=(-2**31, -2**31, 2**31 - 1, 2**31 - 1)))
    put("sky", "exr_large_tiles", exr(8, 4, tile=(2**31 - 1, 2**31 - 1)))


def batches():
    plan = ('{"version": 1, "scene": "scene.json", "count": %s, "vary": [%s], '
            '"steps": [["simulate"], ["render", "--no-video"]], "tries": 2}')
    draw = '{"set": "/gravity/1", "uniform": [-9, -8]}, {"set": "/seed", "values": [1, 2]}'
    put("batch_plan", "whole", plan % (5, draw))
    put("batch_plan", "many", plan % (10**18, draw + ', {"set": "/a", "range": [0, 1e300, 1e-300]}'))
    put("batch_plan", "product", plan % (10**12, ", ".join(
        '{"set": "/a%d", "range": [0, 1000000, 1]}' % i for i in range(9))))
    put("batch_plan", "wrong", plan % (-1, '{"set": 3}, 4'))
    outside = '{"version": 1, "vary": [{"set": "to", "values": ["../x", "/x", "--output=x", "a", ""]}], "scene": "scene.json", '
    put("batch_plan", "outputs", outside + '"steps": [["simulate"], ["export", "-o", "{to}/a.csv"], ["render", "-o{to}"]]}')
    put("batch_plan", "braces", outside + '"steps": [["simulate"], ["export", "-o", "{}{{to}}{to", "{to}"]]}')
    put("batch_plan", "nested", '{"version": 1, "vary": ' + "[" * 5000)
    record = ('{"version": 1, "index": %s, "key": "0", "values": {"/gravity": 3}, "attempts": [{"seed": 1, '
              '"end": "done", "what": "", "wall_s": 1.5, "processor_s": 1, "peak_memory_bytes": 9}], '
              '"steps_done": 0, "hash": "00", "files": 3, "bytes": 900}')
    put("job_record", "whole", record % 3)
    put("job_record", "index", record % -1e300)
    put("job_record", "nested", "[" * 5000)


if len(sys.argv) != 2:
    sys.exit(__doc__)
scenes()
meshes()
others()
height_fields()
skies()
batches()
signatures(sys.argv[1])
