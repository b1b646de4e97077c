"""Presets from anywhere, the reference made of the options, what the program is linked with."""

import json
import os
import re
import shutil
import subprocess
import unittest
from pathlib import Path

from support import PILESIM, SOURCE, CommandTest


class Presets(CommandTest):
    def test_lists_them_with_a_line_each(self):
        lines = self.succeed("presets").stdout.splitlines()
        files = [p for p in (SOURCE / "presets").rglob("*.json")]
        self.assertEqual(len(lines), len(files))
        line = next(line for line in lines if line.startswith("impulse/rabbits_in_a_crate "))
        self.assertRegex(line, r"  impulse, [\d.]+ s: Rabbits in a crate$")

    def test_a_copy_runs_where_it_is(self):
        printed = self.succeed("presets", "copy", "impulse/rabbits_in_a_crate", "mine").stdout.split()
        self.assertEqual(sorted(printed), ["mine/crate.obj", "mine/rabbit.obj", "mine/rabbits_in_a_crate.json"])
        self.assertNotIn("../", (self.dir / "mine/rabbits_in_a_crate.json").read_text())
        self.succeed("validate", "mine/rabbits_in_a_crate.json")

    def test_a_copy_of_a_plan_has_what_its_scene_names(self):
        printed = self.succeed("presets", "copy", "bins.plan", "mine").stdout.split()
        names = ["bin.json", "bins.plan.json", "cross.obj", "l_shape.obj", "ring.obj"]
        self.assertEqual(sorted(printed), [f"mine/{name}" for name in names])
        self.succeed("validate", "mine/bin.json")

    def test_refuses(self):
        for name, found in (("rabbits_in_a_crate", "is the name of several"), ("nothing", "is not there")):
            result = self.run_pilesim("presets", "copy", name)
            self.assertEqual(result.returncode, 2)
            self.assertIn(found, result.stderr)
        self.succeed("presets", "copy", "tower_of_boxes")
        result = self.run_pilesim("presets", "copy", "tower_of_boxes")
        self.assertEqual(result.returncode, 2)
        self.assertIn("--force", result.stderr)

    def test_are_found_beside_an_installed_program(self):
        program = self.dir / "usr/bin/pilesim"
        program.parent.mkdir(parents=True)
        shutil.copy(PILESIM, program)
        result = subprocess.run([program, "presets"], capture_output=True, text=True)
        self.assertEqual(result.returncode, 4)
        self.assertIn("usr/share/pilesim/presets", result.stderr)
        share = self.dir / "usr/share/pilesim/presets/a"
        share.mkdir(parents=True)
        shutil.copy(SOURCE / "presets/impulse/tower_of_boxes.json", share / "tower.json")
        listed = subprocess.run([program, "presets"], capture_output=True, text=True).stdout
        self.assertTrue(listed.startswith("a/tower  "), listed)


class Installation(CommandTest):
    def test_what_presets_name_is_installed_with_them(self):
        prefix = self.dir / "usr"
        subprocess.run(["cmake", "--install", Path(PILESIM).parents[1], "--prefix", prefix],
                       check=True, stdout=subprocess.DEVNULL)  # fmt: skip
        named = set()
        for file in (SOURCE / "presets").rglob("*"):
            if file.suffix not in (".json", ".obj"):
                continue
            for name in re.findall(r"[\w./-]+\.(?!py)\w+", file.read_text()):
                if (file.parent / name).is_file():
                    named.add((file.parent / name).resolve().relative_to(SOURCE.resolve()))
        self.assertGreater(len(named), 20)
        missing = [str(file) for file in named if not (prefix / "share/pilesim" / file).is_file()]
        self.assertEqual(missing, [])
        copied = subprocess.run([prefix / "bin/pilesim", "presets", "copy", "things_on_a_table"],
                                cwd=self.dir, capture_output=True, text=True)  # fmt: skip
        self.assertEqual(copied.returncode, 0, copied.stderr)
        self.succeed("validate", "things_on_a_table.json")
        listed = subprocess.run([prefix / "bin/pilesim", "reproduce", "list"], capture_output=True, text=True)
        self.assertIn("table 3.1", listed.stdout, listed.stderr)


class Reference(CommandTest):
    def test_the_pages_are_what_options_and_keys_say(self):
        for form, page in (("markdown", "commands"), ("scene", "scene")):
            self.assertEqual(
                (SOURCE / f"docs/reference/{page}.md").read_text(),
                self.succeed("reference", form).stdout,
                f"make it again: pilesim reference {form} -o docs/reference/{page}.md",
            )

    def test_the_page_of_keys_has_every_key_of_the_schema(self):
        page = self.succeed("reference", "scene").stdout
        rows = re.findall(r"^\| \**`([^`]+)`", page, re.M)

        def collect(schema):
            if isinstance(schema, dict):
                for key in schema.get("properties", {}):
                    keys.add(key)
                for part in schema.values():
                    collect(part)
            elif isinstance(schema, list):
                for part in schema:
                    collect(part)

        keys, schema = set(), json.loads(self.succeed("schema").stdout)
        del schema["$defs"]
        collect(schema)
        self.assertEqual(keys, set(rows))
        for name in re.findall(r"\]\(#([^)]+)\)", page):
            self.assertIn(name, [h.lower().replace("/", "") for h in re.findall(r"^## (.*)", page, re.M)])

    def test_the_shells_take_what_is_made_for_them(self):
        words = self.succeed("reference", "bash").stdout
        (self.dir / "completion").write_text(words)
        asked = (
            "source ./completion; COMP_WORDS=(pilesim export --ev); COMP_CWORD=2; _pilesim; "
            'echo "${COMPREPLY[@]}"; COMP_WORDS=(pilesim val); COMP_CWORD=1; _pilesim; echo "${COMPREPLY[@]}"'
        )
        result = subprocess.run(["bash", "-c", asked], cwd=self.dir, capture_output=True, text=True)
        self.assertEqual(result.stdout.split(), ["--every", "validate"], result.stderr)

    @unittest.skipUnless(shutil.which("man"), "man is not installed")
    def test_man_takes_the_page(self):
        self.succeed("reference", "man", "-o", "pilesim.1")
        result = subprocess.run(
            ["man", "--warnings", "-l", "pilesim.1"],
            cwd=self.dir, capture_output=True, text=True, env={**os.environ, "MANPAGER": "cat"},
        )  # fmt: skip
        self.assertIn("pilesim export", result.stdout)


class Linked(CommandTest):
    def test_every_library_is_on_the_page_of_licences(self):
        page = (SOURCE / "docs/licences.md").read_text()
        listed = " ".join(re.findall(r"^\| ([^|]+) \|", page, re.M)).lower()
        shown = subprocess.run(["objdump", "-p", PILESIM], capture_output=True, text=True, check=True).stdout
        libraries = re.findall(r"NEEDED +lib(\w+?)(?:-[\w.]+|_r)?\.so", shown)
        names = {"BulletDynamics": "bullet", "BulletCollision": "bullet", "LinearMath": "bullet", "z": "zlib", "tbb": "onetbb",
                 "embree3": "embree", "stdc++": "libstdc++", "gcc_s": "libgcc", "m": "glibc", "c": "glibc"}  # fmt: skip
        self.assertGreater(len(libraries), 10)
        for library in libraries:
            self.assertIn(names.get(library, library).lower(), listed, library)

    def test_notices_of_what_is_built_in_are_there(self):
        notices = (Path(PILESIM).parents[1] / "copyright").read_text()
        for words in ("MPL", "Henry Schreiner", "Niels Lohmann", "D. E. Shaw", "Bitstream Vera"):
            self.assertIn(words, notices)

    def test_nothing_of_cgal_is_in_the_program(self):
        libraries = subprocess.run(["ldd", PILESIM], capture_output=True, text=True).stdout
        self.assertNotRegex(libraries, r"(?i)cgal|libgmp|libmpfr")
        self.assertNotIn(b"CGAL", Path(PILESIM).read_bytes())
        for folder in ("src", "commands"):
            for file in (SOURCE / folder).rglob("*.[hc]*"):
                self.assertIsNone(re.search(r"#include.*CGAL", file.read_text()), file)
