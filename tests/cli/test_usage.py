"""Help, misuse and the commands that print."""

import json
import os
import pathlib
import re
import unittest

from support import CommandTest


class Usage(CommandTest):
    def test_help_names_every_command_and_has_examples(self):
        text = self.succeed("--help").stdout
        for word in ("simulate", "render", "validate", "schema", "Examples:", "Exit codes:"):
            self.assertIn(word, text)

    def test_each_command_has_help_with_an_example(self):
        for command in ("simulate", "render", "validate", "schema"):
            text = self.succeed(command, "--help").stdout
            self.assertRegex(text, r"Examples?[,:]", command)

    def test_examples_name_files_that_are_there(self):
        root = pathlib.Path(__file__).parents[2]
        commands = ["simulate", "direct-pile", "sample-signature", "fit-bspline", "render"]
        commands += ["inspect", "compare", "validate", "schema"]
        texts = [self.succeed(command, "--help").stdout for command in commands]
        texts += [file.read_text() for file in [root / "README.md", *root.glob("docs/*.md")]]
        named = re.findall(r"(?:presets|assets)/[a-z0-9_/]+\.(?!sig)\w+", "\n".join(texts))
        self.assertGreater(len(named), 20)
        for name in sorted(set(named)):
            self.assertTrue((root / name).exists(), name)

    def test_version(self):
        self.assertRegex(self.succeed("--version").stdout, r"^pilesim \d+\.\d+\.\d+\n$")

    def test_misuse_exits_with_2_and_prints_nothing_to_stdout(self):
        scene = self.write_scene()
        for arguments in (
            [],
            ["simulat"],
            ["simulate"],
            ["simulate", scene],
            ["simulate", scene, "-o", "out", "--thread", "2"],
            ["simulate", scene, "-o", "out", "--threads", "0"],
            ["simulate", scene, "-o", "out", "--progress", "maybe"],
            ["simulate", scene, "-o", "out", "--seed", "x"],
            ["render", "out", "--size", "64"],
            ["render", "out", "--frames", "5-1"],
            ["render", "out", "--frames", "-3"],
            ["render", "out", "--set", "/duration_s=99"],
            ["render", "out", "--set", "/rendering=1"],
            ["simulate", scene, "-o", "out", "--set", "seed=3"],
            ["validate", scene, "--set", "/seed"],
        ):
            result = self.expect_exit(2, *arguments)
            self.assertEqual(result.stdout, "", arguments)
            self.assertNotEqual(result.stderr, "", arguments)
        self.assertFalse((self.dir / "out").exists())

    def test_a_wrong_value_names_its_option_once(self):
        result = self.expect_exit(2, "render", "out", "--frames", "5-1")
        self.assertEqual(result.stderr.count("--frames"), 1, result.stderr)

    def test_a_full_disk_behind_stdout_is_an_error(self):
        with open("/dev/full", "w") as full:
            import subprocess

            from support import PILESIM

            result = subprocess.run([PILESIM, "schema"], stdout=full, stderr=subprocess.PIPE)
        self.assertEqual(result.returncode, 4)


class Validate(CommandTest):
    def test_a_valid_scene(self):
        result = self.succeed("validate", self.write_scene())
        self.assertIn("scene.json: valid; 9 bodies (8 dynamic), 16 frames", result.stdout)

    def test_all_problems_at_once_with_place_and_suggestion(self):
        def spoil(scene):
            scene["duration"] = scene.pop("duration_s")
            scene["materials"]["wood"]["friction"] = -1
            scene["bodies"][0]["shape"] = "grund"

        result = self.expect_exit(3, "validate", self.write_scene(spoil))
        self.assertEqual(result.stdout, "")
        lines = result.stderr.strip().splitlines()
        self.assertEqual(len(lines), 3, result.stderr)
        for part in ("/duration", "duration_s", "/materials/wood/friction", "-1", "grund", "ground"):
            self.assertIn(part, result.stderr)
        for line in lines:
            self.assertRegex(line, r"scene\.json:\d+:\d+: /")

    def test_validate_knows_what_the_mode_needs(self):
        def spoil(scene):
            scene["simulator"] = {"mode": "statistical"}

        result = self.expect_exit(3, "validate", self.write_scene(spoil))
        self.assertIn("has no signature", result.stderr)
        self.assertIn("sample-signature", result.stderr)

    def test_missing_meshes_are_named_with_all_else(self):
        def spoil(scene):
            scene["duration_s"] = -1
            scene["shapes"]["rabbit"] = {"type": "mesh", "file": "rabbit.obj"}
            scene["shapes"]["crate"] = {"type": "mesh", "file": "crate.obj"}
            scene["emitters"].append(
                {
                    "type": "volume",
                    "file": "heart.obj",
                    "spacing": 0.1,
                    "shape": "box",
                    "material": "wood",
                }
            )

        result = self.expect_exit(3, "validate", self.write_scene(spoil))
        lines = result.stderr.strip().splitlines()
        self.assertEqual(len(lines), 4, result.stderr)
        for part in ("/duration_s", "/shapes/rabbit/file", "/shapes/crate/file", "/emitters/1/file"):
            self.assertRegex(result.stderr, r"scene\.json:\d+:\d+: " + part)
        self.assertIn("heart.obj", result.stderr)

    def test_a_missing_mesh_makes_the_scene_invalid(self):
        def spoil(scene):
            scene["shapes"]["box"] = {"type": "mesh", "file": "rabbit.obj"}

        self.expect_exit(3, "validate", self.write_scene(spoil))

    def test_syntax_error_has_line_and_column(self):
        (self.dir / "scene.json").write_text('{\n  "version": 1,\n  "name" "x"\n}\n')
        result = self.expect_exit(3, "validate", "scene.json")
        self.assertRegex(result.stderr, r"scene\.json:3:\d+")

    def test_missing_file(self):
        result = self.expect_exit(4, "validate", "nowhere.json")
        self.assertIn("nowhere.json", result.stderr)
        self.assertIn("No such file", result.stderr)

    def test_what_is_no_regular_file(self):
        os.mkfifo(self.dir / "pipe")
        for name in ("/dev/zero", "pipe"):
            self.assertIn("expected a regular file", self.expect_exit(4, "validate", name).stderr)

    def test_print_config_is_a_scene_again(self):
        scene = self.write_scene()
        first = self.succeed("validate", scene, "--set", "/seed=9", "--print-config").stdout
        self.assertEqual(json.loads(first)["seed"], 9)
        (self.dir / "resolved.json").write_text(first)
        self.assertEqual(self.succeed("validate", "resolved.json", "--print-config").stdout, first)

    def test_set_that_names_nothing(self):
        result = self.expect_exit(3, "validate", self.write_scene(), "--set", "/simulator/sleping=false")
        self.assertIn("--set", result.stderr)
        self.assertIn("sleeping", result.stderr)


class Schema(CommandTest):
    def test_is_a_json_schema(self):
        schema = json.loads(self.succeed("schema").stdout)
        self.assertIn("2020-12", schema["$schema"])
        self.assertIn("bodies", schema["properties"])


if __name__ == "__main__":
    unittest.main()
