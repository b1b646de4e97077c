"""Bounds on memory, reads and writes of a stranger's scene, mesh or plan."""

import json
import os
import random
import resource
import shutil
import signal
import struct
import subprocess
import unittest
import zlib

from support import BOX_OBJ, HANGING, PILESIM, CommandTest, endless, stop, tree_bytes, wait_until_stopped

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

    def test_faces_of_other_files_are_counted_before_they_are_read(self):
        for name, text in (("mesh.stl", "solid a\n" + "facet\n" * 4_000_001),
                           ("mesh.stl", "solid a\nfacet\n" + "vertex 0\n" * 12_000_003),
                           ("mesh.ply", "ply\nformat ascii 1.0\nelement face 4000001\n"
                            "property list uchar int vertex_index\nend_header\n" + " " * 4_000_001)):
            (self.dir / name).write_text(text)
            self.write_scene(mesh(name))
            self.refused("has more than 4000000 faces", memory=2 * GIB)

    def test_what_parts_and_sizes_multiply_is_bounded(self):
        stairs = {"type": "stairs", "size": [1, 1, 1], "steps": 1000}

        def parts(scene):
            scene["shapes"] |= {"stairs": stairs, "box": {"type": "compound", "parts": [{"shape": "stairs"}] * 2000}}

        self.write_scene(parts)
        self.refused("/shapes/box: makes more than 20000000 triangles")

        def sizes(scene):
            parts = [{"shape": "ball", "position": [i, 0, 0]} for i in range(1000)]
            scene["shapes"] |= {"ball": {"type": "sphere", "radius": 0.4}, "box": {"type": "compound", "parts": parts}}
            scene["emitters"][0] |= {"count": [10, 10, 10], "sizes": {"from": 1, "to": 1.5, "steps": 64}}

        self.write_scene(sizes)
        self.refused("/shapes/box: makes more than 20000000 triangles", memory=4 * GIB)

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


class AtTheSameTime(CommandTest):
    def begin(self, output):
        """An endless simulation that has written something, and stands still now."""
        self.write_scene(endless, "endless.json")
        process = subprocess.Popen([PILESIM, "simulate", "endless.json", "-o", output, "-q"], cwd=self.dir,
                                   stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        self.wait_until(process, (self.dir / output / "checkpoint.bin").exists)
        stop(process.pid)
        self.assertTrue(wait_until_stopped(process))
        return process

    def test_two_do_not_write_one_run(self):
        process = self.begin("out")
        self.write_scene()
        before = tree_bytes(self.dir / "out")
        for scene, option in (("scene.json", "--force"), ("endless.json", "--resume")):
            result = self.expect_exit(2, "simulate", scene, "-o", "out", "-q", option)
            self.assertIn("is being written by another pilesim", result.stderr)
        self.assertEqual(tree_bytes(self.dir / "out"), before)
        # Readers get a complete file.
        self.succeed("export", "out", "-o", "poses.csv", "-q")
        self.succeed("view", "out", "-o", "view.html", "-q")
        process.kill()
        process.wait()
        self.succeed("simulate", "scene.json", "-o", "out", "-q", "--force", "--no-picture")

    def test_signals_leave_no_half_export(self):
        self.write_scene()
        self.succeed("simulate", "scene.json", "-o", "out", "-q", "--no-picture")
        for fault in (signal.SIGINT, signal.SIGTERM, "kill"):
            code = -signal.SIGKILL if fault == "kill" else -fault
            self.expect_exit(code, "export", "out", "-o", "poses.csv", env=self.at_change("export", fault, 2))
            self.assertFalse((self.dir / "poses.csv").exists())
        self.succeed("export", "out", "-o", "poses.csv")
        self.assertEqual(sorted(path.name for path in self.dir.iterdir()), ["out", "poses.csv", "scene.json"])


class Links(CommandTest):
    def test_what_a_link_names_is_never_written(self):
        name = "impulse/rabbits_in_a_crate"
        victim, links = self.dir / "victim", self.dir / "copy"
        victim.write_text("mine")
        links.mkdir()
        for file, target in (("rabbits_in_a_crate.json", victim), ("rabbit.obj", self.dir / "missing")):
            (links / file).symlink_to(target)
            result = self.expect_exit(2, "presets", "copy", name, "copy")
            self.assertIn(f"{file}: the file exists already", result.stderr)
            self.succeed("presets", "copy", name, "copy", "--force")
            self.assertFalse((links / file).is_symlink())
            for written in links.iterdir():
                written.unlink()
        self.assertEqual(victim.read_text(), "mine")
        self.assertFalse((self.dir / "missing").exists())


class Caches(CommandTest):
    def test_what_was_tampered_with_is_made_again(self):
        (self.dir / "box.obj").write_text(BOX_OBJ)
        environment = os.environ | {"XDG_CACHE_HOME": str(self.dir / "cache")}

        def dented(scene):
            scene["shapes"]["box"] = {"type": "mesh", "file": "box.obj", "scale": 0.2, "collision": "decomposition"}
            scene["duration_s"] = 0.1

        self.write_scene(dented)
        run = ("simulate", "scene.json", "-o", "out", "-q", "--no-picture", "--force")
        self.succeed(*run, env=environment)
        whole = tree_bytes(self.dir / "out/trajectory.zarr")
        dice = random.Random(3)
        cached = list((self.dir / "cache/pilesim").iterdir())
        self.assertNotEqual(cached, [])
        for file in cached:
            content = file.read_bytes()
            flipped = bytearray(content)
            flipped[dice.randrange(len(content))] ^= 1 << dice.randrange(8)
            for tampered in (flipped, content[: len(content) // 2], b"", content + b"x"):
                file.write_bytes(tampered)
                self.succeed(*run, env=environment)
                self.assertEqual(tree_bytes(self.dir / "out/trajectory.zarr"), whole)
                self.assertEqual(file.read_bytes(), content)
            file.unlink()
            os.mkfifo(file)  # nobody waits for it
            self.expect_exit(4, *run, env=environment)
            file.unlink()


class Surroundings(CommandTest):
    def test_decimal_commas_of_a_locale_change_nothing(self):
        names = subprocess.run(["locale", "-a"], capture_output=True, text=True).stdout.split()
        environment = dict(os.environ)
        if not any(name.startswith("de_DE") for name in names):
            made = shutil.which("localedef") and subprocess.run(
                ["localedef", "-i", "de_DE", "-f", "UTF-8", str(self.dir / "de_DE.UTF-8")], capture_output=True)
            if not made or made.returncode > 1:
                self.skipTest("there is no locale with decimal commas")
            environment["LOCPATH"] = str(self.dir)
        self.write_scene(lambda scene: scene.update(duration_s=0.1))
        written = []
        for number, locale in enumerate(("C", "de_DE.UTF-8")):
            environment["LC_ALL"] = locale
            run = f"out{number}"
            self.succeed("simulate", "scene.json", "-o", run, "-q", "--no-picture", env=environment)
            for kind in ("csv", "usda", "glb", "py"):
                self.succeed("export", run, "-o", f"{run}/poses.{kind}", "-q", env=environment)
            files = tree_bytes(self.dir / run)
            written.append({name: files[name] for name in files if not name.startswith(("report", "timing"))})
        self.assertEqual(written[0], written[1])

    @unittest.skipUnless(os.geteuid() == 0, "only root may become another user")
    def test_an_ordinary_user_is_told_what_is_not_allowed(self):
        self.dir.chmod(0o755)
        self.write_scene(lambda scene: scene.update(duration_s=0.1))
        (self.dir / "secret.json").write_bytes((self.dir / "scene.json").read_bytes())
        (self.dir / "secret.json").chmod(0o600)
        for name, mode in (("theirs", 0o777), ("others", 0o755)):
            (self.dir / name).mkdir()
            (self.dir / name).chmod(mode)

        def run(code, *arguments, **environment):
            result = self.run_pilesim(*arguments, user=65534, group=65534, extra_groups=[],
                                      env=os.environ | {"HOME": str(self.dir / "none")} | environment)
            self.assertEqual(result.returncode, code, result.stderr)
            return result.stderr

        try:
            run(0, "--version")
        except PermissionError:
            self.skipTest("others may not run this program where it lies")
        self.assertIn("Permission denied", run(4, "simulate", "scene.json", "-o", "others/out", "-q"))
        self.assertIn("Permission denied", run(4, "simulate", "secret.json", "-o", "theirs/out", "-q"))
        run(0, "simulate", "scene.json", "-o", "theirs/out", "-q", XDG_CACHE_HOME=str(self.dir / "others"))
        self.assertIn("Permission denied", run(4, "export", "theirs/out", "-o", "others/poses.csv"))
        (self.dir / "theirs/out/trajectory.zarr/position/0.0.0").chmod(0)
        self.assertIn("Permission denied", run(4, "export", "theirs/out", "-o", "theirs/poses.csv"))


class Tables(CommandTest):
    def test_no_cell_is_a_formula(self):
        self.write_scene(lambda scene: (scene["emitters"][0].update(name="=1+1"), scene.update(duration_s=0.1)))
        self.succeed("simulate", "scene.json", "-o", "out", "--no-picture")
        self.succeed("export", "out", "-o", "poses.csv")
        self.assertIn(",\"'=1+1/0\",", (self.dir / "poses.csv").read_text())


if __name__ == "__main__":
    unittest.main()
