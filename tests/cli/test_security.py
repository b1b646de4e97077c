"""What a stranger's scene, mesh or plan may take, read and write."""

import json
import os
import resource
import struct
import subprocess
import unittest
import zlib

from support import BOX_OBJ, HANGING, PILESIM, CommandTest

GIB = 1 << 30


def png(width, height, data):
    def chunk(kind, content):
        body = kind + content
        return struct.pack(">I", len(content)) + body + struct.pack(">I", zlib.crc32(body))

    head = struct.pack(">IIBBBBB", width, height, 16, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


def terrain(scene):
    scene["shapes"]["hills"] = {"type": "terrain", "file": "hills.png", "size": [100, 100], "height": [0, 5]}
    scene["bodies"].append({"name": "hills", "shape": "hills", "material": "wood", "role": "static"})


def mesh(name):
    def change(scene):
        scene["shapes"]["box"] = {"type": "mesh", "file": name}

    return change


class Bounds(CommandTest):
    def validate(self, memory=GIB):
        return self.run_pilesim("validate", "scene.json", preexec_fn=lambda: resource.setrlimit(
            resource.RLIMIT_AS, (memory, memory)))

    def refused(self, words, memory=GIB):
        result = self.validate(memory)
        self.assertEqual(result.returncode, 3, result.stderr)
        self.assertIn(words, result.stderr)

    def test_variables_are_counted_in_bytes(self):
        def change(scene):
            scene["variables"] = {"long": "x" * 1_000_000}
            wood = scene["materials"]["wood"]
            scene["materials"] |= {f"m{i}": wood | {"note": {"var": "long"}} for i in range(1000)}

        self.write_scene(change)
        self.refused("at most 64 MiB of values in their place", memory=2 * GIB)

    def test_names_are_bounded(self):
        self.write_scene(lambda scene: scene["emitters"][0].update(name="n" * 1000))
        self.refused("has 1000 bytes; expected a string of 1 to 255 bytes")
        self.write_scene(lambda scene: scene.update({"k" * 2000: 1}))
        self.refused("is a key of 2001 bytes; expected at most 1000")

    def test_all_that_is_included_is_bounded_together(self):
        blank = b'{"version": 1}' + b" " * (100 << 20)
        (self.dir / "part.json").write_bytes(blank)
        self.write_scene(lambda scene: scene.update(include=["part.json"] * 3))
        self.refused("at most 268435456 bytes in all", memory=4 * GIB)

    def test_a_picture_holds_no_more_than_its_pixels(self):
        packer = zlib.compressobj(9)
        data = b"".join(packer.compress(bytes(1 << 20)) for _ in range(1024)) + packer.flush()
        (self.dir / "hills.png").write_bytes(png(16, 16, data))
        self.write_scene(terrain)
        self.refused("holds more compressed data than its pixels")

    def test_the_largest_terrain_takes_half_a_gigabyte(self):
        side = 2048
        rows = bytearray()
        for row in range(side):
            rows += b"\0" + struct.pack(f">{side}H", *((row * 31 + c * 17) % 65536 for c in range(side)))
        (self.dir / "hills.png").write_bytes(png(side, side, zlib.compress(bytes(rows), 1)))
        self.write_scene(terrain)
        child = subprocess.Popen([PILESIM, "validate", "scene.json"], cwd=self.dir, stdout=subprocess.PIPE)
        _, status, used = os.wait4(child.pid, 0)
        child.stdout.close()
        child.returncode = status
        self.assertEqual(status, 0)
        self.assertLess(used.ru_maxrss, 500_000)  # KiB

    def test_polygons_and_faces_are_bounded(self):
        self.write_scene(mesh("mesh.obj"))
        corners = "".join(f"v {i} {i * i % 7} 0\n" for i in range(100))
        (self.dir / "mesh.obj").write_text(corners + "f" + " 1 2 3" * 20_000 + "\n")
        self.refused("has too large polygons, one of 60000 corners", memory=2 * GIB)
        (self.dir / "mesh.obj").write_text(corners + "f 1 1 1\n" * 4_000_001)
        self.refused("has more than 4000000 faces", memory=2 * GIB)

    def test_no_memory_is_no_crash(self):
        self.write_scene()
        result = self.validate(memory=40 << 20)
        if result.returncode != 127:  # the loader itself
            self.assertIn(result.returncode, (0, 7), result.stderr)


class Names(CommandTest):
    def test_arguments_are_utf_8(self):
        self.write_scene()
        for arguments in (["validate", b"caf\xe9.json"], ["simulate", "scene.json", "-o", b"out\xff"],
                          ["validate", "scene.json", "--set", b'/name="\xff"'], ["export", b"\xff", "-o", "a.csv"],
                          ["new", b"\xff.obj", "-o", "a.json"], ["compare", b"\xff.json", "-o", "out"]):
            result = subprocess.run([PILESIM.encode(), *[a if isinstance(a, bytes) else a.encode() for a in arguments]],
                                    cwd=self.dir, capture_output=True, timeout=HANGING)
            self.assertEqual(result.returncode, 2, result.stderr)
            self.assertIn(b"is not UTF-8", result.stderr)

    def test_outputs_have_no_control_characters(self):
        self.write_scene()
        result = self.expect_exit(2, "simulate", "scene.json", "-o", "out\n#SBATCH --partition=x")
        self.assertIn("has control characters in its name", result.stderr)

    def test_a_relative_cache_is_ignored(self):
        self.write_scene()
        self.succeed("validate", "scene.json", env=os.environ | {"XDG_CACHE_HOME": "cache", "HOME": str(self.dir / "home")})
        self.assertFalse((self.dir / "cache").exists())


class Reads(CommandTest):
    def gltf(self, uri):
        (self.dir / "meshes" / "secret.gltf").write_text(json.dumps({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "buffers": [{"uri": uri, "byteLength": 36}],
            "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": 36}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}]}))

    def test_a_mesh_names_files_beside_or_below_it(self):
        (self.dir / "meshes").mkdir()
        (self.dir / "secret.bin").write_bytes(bytes(36))
        (self.dir / "meshes" / "link.bin").symlink_to(self.dir / "secret.bin")
        self.write_scene(mesh("meshes/secret.gltf"))
        for uri in ("../secret.bin", "link.bin"):
            self.gltf(uri)
            result = self.expect_exit(3, "validate", "scene.json")
            self.assertIn("does not lie beside the mesh or below its directory", result.stderr)
        self.gltf(str(self.dir / "secret.bin"))
        self.assertIn("secret.bin", self.expect_exit(3, "validate", "scene.json").stderr)

    def test_textures_too(self):
        (self.dir / "meshes").mkdir()
        (self.dir / "secret.png").write_bytes(b"secret")
        (self.dir / "meshes" / "box.mtl").write_text("newmtl skin\nmap_Kd ../secret.png\n")
        faces = BOX_OBJ.replace("f 1 2 3 4", "usemtl skin\nf 1 2 3 4")
        (self.dir / "meshes" / "box.obj").write_text("mtllib box.mtl\n" + faces)
        self.write_scene(mesh("meshes/box.obj"))
        result = self.expect_exit(3, "validate", "scene.json")
        self.assertIn("secret.png, which does not lie beside the mesh", result.stderr)


class Batches(CommandTest):
    def refused(self, words, steps, **others):
        self.write_scene()
        plan = {"version": 1, "scene": "scene.json", "steps": steps} | others
        (self.dir / "plan.json").write_text(json.dumps(plan))
        result = self.run_pilesim("batch", "plan.json", "-o", "out/batch", "--quiet", "--force")
        self.assertIn(result.returncode, (3, 5), result.stderr)
        table = self.dir / "out/batch/table.csv"
        self.assertIn(words, result.stderr + (table.read_text() if table.exists() else ""))
        self.assertEqual([path.name for path in self.dir.rglob("X*")], [])

    def test_jobs_write_below_their_directories(self):
        below = "a path below the job's directory"
        for output in (["-o", "../../../X.csv"], ["--output", str(self.dir / "X.csv")], ["--output=../../../X.csv"]):
            self.refused(below, [["simulate"], ["export", *output]])
        for output in ("-o../../../X.csv", "-qo../X.csv"):
            self.refused("as two words", [["simulate"], ["export", output]])
        for word, value in (("{to}", "../../../X.csv"), ("run/{to}", "../../../X.csv")):
            self.refused("lies outside of the job's directory", [["simulate"], ["export", "-o", word]],
                         vary=[{"set": "to", "values": [value]}])
        self.refused("does not begin with -", [["simulate"], ["export", "-o", "a.csv", "{to}"]],
                     vary=[{"set": "to", "values": ["--output=../../../X.csv"]}])

    def test_a_job_that_does_nothing_is_none(self):
        self.refused("an option that the batch does not set itself", [["simulate", "--help"]])
        self.refused("and no step draws it", [["simulate"]], collect=["coco"])

    def test_a_job_does_not_follow_links(self):
        elsewhere = self.dir / "elsewhere"
        elsewhere.mkdir()
        (self.dir / "out/batch").mkdir(parents=True)
        (self.dir / "out/batch/jobs").symlink_to(elsewhere)
        self.write_scene()
        (self.dir / "plan.json").write_text(json.dumps({"version": 1, "scene": "scene.json", "steps": [["simulate"]]}))
        result = self.expect_exit(2, "batch", "plan.json", "-o", "out/batch", "--quiet")
        self.assertIn("symbolic link", result.stderr)


class CompleteRuns(CommandTest):
    def test_resume_looks_at_what_it_vouches_for(self):
        self.write_scene(lambda scene: scene.update(duration_s=0.1))
        self.succeed("simulate", "scene.json", "-o", "out", "--no-picture")
        self.succeed("simulate", "scene.json", "-o", "out", "--no-picture", "--resume")
        store = self.dir / "out/trajectory.zarr"
        for file in (store / ".zattrs", store / "position" / "0.0.0"):
            whole = file.read_bytes()
            file.write_bytes(b"")
            result = self.expect_exit(3, "simulate", "scene.json", "-o", "out", "--no-picture", "--resume")
            self.assertIn("simulate it again with --force", result.stderr)
            file.write_bytes(whole)


class Tables(CommandTest):
    def test_no_cell_is_a_formula(self):
        self.write_scene(lambda scene: (scene["emitters"][0].update(name="=1+1"), scene.update(duration_s=0.1)))
        self.succeed("simulate", "scene.json", "-o", "out", "--no-picture")
        self.succeed("export", "out", "-o", "poses.csv")
        self.assertIn(",\"'=1+1/0\",", (self.dir / "poses.csv").read_text())


if __name__ == "__main__":
    unittest.main()
