"""Help, misuse and the commands that print."""

import json
import os
import pathlib
import re
import subprocess
import unittest

from support import PILESIM, SOURCE, CommandTest


class Usage(CommandTest):
    def test_help_names_every_command_and_has_examples(self):
        text = self.succeed("--help").stdout
        for word in ("simulate", "render", "validate", "schema", "Examples:", "Exit codes:"):
            self.assertIn(word, text)

    def test_each_command_has_help_with_an_example(self):
        for command in ("simulate", "render", "export", "validate", "schema", "new"):
            text = self.succeed(command, "--help").stdout
            self.assertRegex(text, r"Examples?[,:]", command)

    def test_help_names_types_in_words(self):
        for command in ("simulate", "direct-pile", "finish", "validate", "new", "render", "export", "view", "inspect",
                        "sample-signature", "fit-bspline", "compare", "batch", "schema", "presets"):
            text = self.succeed(command, "--help").stdout
            self.assertNotRegex(text, r"\b(TEXT|UINT|INT|FLOAT|WORD|ENUM)\b", command)
        self.assertIn("--progress auto|bar|json|none", self.succeed("render", "--help").stdout)

    def test_a_run_is_no_signature(self):
        (self.dir / "run/trajectory.zarr").mkdir(parents=True)
        result = self.expect_exit(3, "inspect", "run")
        self.assertEqual(result.stderr, "pilesim: run: is a run; expected a signature. Open run/report.html to judge "
                                        "the run, or play it: pilesim view run\n")

    def test_every_error_begins_with_the_program(self):
        for arguments in (["simulat"], ["simulate"], ["render", "out", "--size", "3"], ["inspect", "none.sig"],
                          ["validate", "none.json"], ["export", "none", "-o", "a.glb"]):
            result = self.run_pilesim(*arguments)
            self.assertTrue(result.stderr.startswith("pilesim: "), result.stderr)

    def test_examples_name_files_that_are_there(self):
        root = pathlib.Path(__file__).parents[2]
        commands = ["simulate", "direct-pile", "sample-signature", "fit-bspline", "render"]
        commands += ["export", "inspect", "compare", "validate", "schema", "batch", "new"]
        texts = [self.succeed(command, "--help").stdout for command in commands]
        texts += [file.read_text() for file in [root / "README.md", *root.glob("docs/*.md")]]
        named = re.findall(r"(?:presets|assets)/[a-z0-9_/]+(?:\.plan)?\.(?!sig)\w+", "\n".join(texts))
        self.assertGreater(len(named), 20)
        for name in sorted(set(named)):
            self.assertTrue((root / name).exists(), name)

    def test_version(self):
        self.assertRegex(self.succeed("--version").stdout, r"^pilesim \d+\.\d+\.\d+\nbuilt with GCC \S+ for x86-64-v3 \(AVX2\)(, of [0-9a-f]+(-dirty)?)?\n$")

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
            ["render", "out", "--frames", "-0"],
            ["render", "out", "--set", "/duration_s=99"],
            ["render", "out", "--set", "/rendering=1"],
            ["simulate", scene, "-o", "out", "--set", "seed=3"],
            ["validate", scene, "--set", "/seed"],
        ):
            result = self.expect_exit(2, *arguments)
            self.assertEqual(result.stdout, "", arguments)
            self.assertNotEqual(result.stderr, "", arguments)
        self.assertFalse((self.dir / "out").exists())

    def test_numbers_are_digits_within_their_range_and_nothing_else(self):
        """Every option that takes a number, of every command; the help states each range."""
        seen = 0
        for command, inputs in (
            ("validate", ["scene.json"]),
            ("simulate", ["scene.json", "-o", "out"]),
            ("direct-pile", ["scene.json", "-o", "out"]),
            ("render", ["out"]),
            ("export", ["out", "-o", "a.csv"]),
            ("compare", ["scene.json", "-o", "out", "--modes", "impulse"]),
            ("sample-signature", ["a.obj", "-o", "a.sig"]),
            ("fit-bspline", ["a.sig", "-o", "b.sig"]),
        ):
            text = self.succeed(command, "--help").stdout
            options = re.findall(r"--([a-z-]+) (?:N|NUMBER|N\[,N,N,N\])(?= |$)", text, re.M)
            for option in (f"--{name}" for name in options):
                seen += 1
                values = ["", "-1", "99999999999999999999", "0x10", "nan"]
                if option in ("--seed", "--max-error"):
                    values += [" ", "1e999", "inf", "+1", "1 ", " 1", "1x", "one", "1_000"]
                for value in values:
                    result = self.expect_exit(2, command, *inputs, option, value)
                    self.assertIn(f"{option}: '{value}' is not a", result.stderr)
                    self.assertRegex(result.stderr, r"\d to \d|above 0")
        self.assertGreater(seen, 20)
        self.assertFalse((self.dir / "out").exists())

    def test_zero_is_refused_where_it_means_nothing(self):
        for arguments in (
            ["fit-bspline", "a.sig", "-o", "b.sig", "--max-bytes", "0"],
            ["fit-bspline", "a.sig", "-o", "b.sig", "--max-error", "0"],
            ["fit-bspline", "a.sig", "-o", "b.sig", "--precision", "0"],
            ["fit-bspline", "a.sig", "-o", "b.sig", "--control-points", "4,0,4,4"],
            ["fit-bspline", "a.sig", "-o", "b.sig", "--control-points", "4,4"],
            ["sample-signature", "a.obj", "-o", "a.sig", "--target-error", "0"],
            ["sample-signature", "a.obj", "-o", "a.sig", "--scale", "0"],
            ["sample-signature", "a.obj", "-o", "a.sig", "--restitution", "1.01"],
            ["render", "out", "--sheet", "0x3"],
            ["render", "out", "--sheet", " 4x3"],
            ["render", "out", "--sheet", "+4x3"],
        ):
            self.assertIn(arguments[-2], self.expect_exit(2, *arguments).stderr)

    def test_places_for_results_that_are_none(self):
        """For each command that writes, before it reads anything."""
        (self.dir / "file").write_text("mine")
        long = "x" * 300
        for place, code, why in (
            ("", 2, "empty"),
            ("-", 2, "./-"),
            (long, 4, "name too long"),
            (f"new/{long}", 4, "name too long"),
            ("file/below", 4, "Not a directory"),
        ):
            for command, inputs in (
                ("simulate", ["nowhere.json"]),
                ("direct-pile", ["nowhere.json"]),
                ("compare", ["nowhere.json", "--modes", "impulse"]),
                ("sample-signature", ["nowhere.obj"]),
                ("fit-bspline", ["nowhere.sig"]),
            ):
                result = self.expect_exit(code, command, *inputs, "-o", place)
                self.assertRegex(result.stderr, why)
                if place:
                    self.assertIn(place[-100:], result.stderr)
        for command, inputs in (
            ("sample-signature", ["nowhere.obj"]),
            ("fit-bspline", ["nowhere.sig"]),
        ):
            for place in (".", "new/"):
                result = self.expect_exit(4, command, *inputs, "-o", place)
                self.assertIn("directory", result.stderr)
        for command in ("simulate", "direct-pile"):
            result = self.expect_exit(4, command, "nowhere.json", "-o", "file")
            self.assertIn("file: cannot be written: Not a directory", result.stderr)
        self.assertEqual([path.name for path in self.dir.iterdir()], ["file"])

    def test_a_place_without_permission_is_refused_before_any_work(self):
        locked = self.dir / "locked"
        locked.mkdir(mode=0o555)
        # Root without its powers is a user like others.
        powerless = ["setpriv", "--bounding-set=-all", "--inh-caps=-all"] if os.geteuid() == 0 else []
        if subprocess.run([*powerless, "true"], capture_output=True).returncode != 0:
            self.skipTest("no user without power over permissions")
        for command, place in (("simulate", "locked"), ("sample-signature", "locked/new/a.sig")):
            result = subprocess.run(
                [*powerless, PILESIM, command, "nowhere", "-o", place],
                cwd=self.dir,
                capture_output=True,
                text=True,
            )
            self.assertEqual(result.returncode, 4, result.stderr)
            self.assertIn(f"{place}: cannot be written: Permission denied", result.stderr)

    def test_inputs_that_are_none(self):
        long = "x" * 300
        for command, more in (
            ("validate", []),
            ("simulate", ["-o", "out"]),
            ("direct-pile", ["-o", "out"]),
            ("compare", ["-o", "out", "--modes", "impulse"]),
            ("sample-signature", ["-o", "a.sig"]),
            ("fit-bspline", ["-o", "a.sig"]),
            ("inspect", []),
            ("render", []),
            ("export", ["-o", "a.csv"]),
        ):
            self.assertIn("empty", self.expect_exit(2, command, "", *more).stderr)
            result = self.expect_exit(4, command, long, *more)
            self.assertIn("name too long", result.stderr)
            self.assertIn("xxx:", result.stderr)
        self.assertEqual(list(self.dir.iterdir()), [])

    def test_words_are_the_words_of_the_help_and_no_numbers(self):
        """Every option that takes one of some words, of every command."""
        for command, inputs, option, words in (
            ("simulate", ["scene.json", "-o", "out"], "--progress", "auto, bar, json, none"),
            ("render", ["out"], "--overlay", "piles, guide, solver, forces"),
            ("render", ["out"], "--renderer", "raster, rays"),
            ("render", ["out"], "--quality", "preview, good, final"),
            ("export", ["out", "-o", "a.csv"], "--as", "objects, instances"),
            ("sample-signature", ["a.obj", "-o", "a.sig"], "--layout", "scale-free, dissertation"),
            ("fit-bspline", ["a.sig", "-o", "b.sig"], "--coordinates", "cartesian, spherical"),
            ("fit-bspline", ["a.sig", "-o", "b.sig"], "--parameters", "uniform, centripetal"),
        ):
            text = self.succeed(command, "--help").stdout
            self.assertNotRegex(text, "->|value in| OR ")
            for word in words.split(", "):
                self.assertRegex(text, rf"(?s){option} .*\b{word}\b")
            for value in ("0", "3", "", "Auto", "x"):
                stderr = self.expect_exit(2, command, *inputs, option, value).stderr
                self.assertIn(f"{option}: '{value}' is not one of {words}\n", stderr)

    def test_a_fault_of_an_option_names_the_option(self):
        """Not the --set that it is short for."""
        self.succeed("simulate", self.write_scene(), "-o", "out")
        for arguments, option in (
            (["--size", "15x64"], "--size 15x64: /render/size/0: is 15"),
            (["--size", "16384x16384"], "--size 16384x16384: "),
            (["--size", "16384x16384", "--set", "/render/samples=8"], "--size 16384x16384: "),
        ):
            stderr = self.expect_exit(3, "render", "out", *arguments).stderr
            self.assertIn(option, stderr)
            self.assertNotIn("--set", stderr)
        (self.dir / "list.json").write_text("[]")
        stderr = self.expect_exit(3, "validate", "list.json", "--seed", "7").stderr
        self.assertIn("--seed 7: ", stderr)
        self.assertNotIn("--set", stderr)

    def test_a_wrong_value_names_its_option_once(self):
        result = self.expect_exit(2, "render", "out", "--frames", "5-1")
        self.assertEqual(result.stderr.count("--frames"), 1, result.stderr)

    def test_a_full_disk_behind_stdout_is_an_error(self):
        with open("/dev/full", "w") as full:
            result = subprocess.run([PILESIM, "schema"], stdout=full, stderr=subprocess.PIPE)
        self.assertEqual(result.returncode, 4)


class Validate(CommandTest):
    def test_a_valid_scene(self):
        result = self.succeed("validate", self.write_scene())
        self.assertIn("scene.json: valid; 8 bodies, 1 static, 16 frames", result.stdout)

    def test_what_stands_has_no_mass(self):
        def add(scene):
            place = {"shape": "box", "material": "wood", "position": [5, 5, 5]}
            scene["bodies"].append({**place, "role": "static"})
            scene["bodies"].append({**place, "role": "kinematic", "position": [9, 5, 5]})

        line = next(line for line in self.succeed("validate", self.write_scene(add)).stdout.splitlines()
                    if line.startswith("  box:"))
        self.assertRegex(line, r"m, 8 bodies of [1-9][0-9.]* kg, 1 static, 1 kinematic; ")

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
            self.assertRegex(line, r"^pilesim: scene\.json:\d+:\d+: /")

    def test_validate_says_what_is_to_be_measured(self):
        def change(scene):
            scene["simulator"] = {"mode": "statistical"}

        cache = self.dir / "cache"
        result = self.succeed("validate", self.write_scene(change), env=os.environ | {"XDG_CACHE_HOME": str(cache)})
        self.assertIn("box: its signature for restitution 0.2 and friction 0.6 is to be measured", result.stdout)
        self.assertEqual(list(cache.glob("**/signature-*")), [])

    def test_what_only_the_model_shows_names_the_scene(self):
        def no_body(scene):
            scene["emitters"][0] = {
                "name": "cloud", "type": "volume", "file": str(SOURCE / "assets/ring.obj"),
                "spacing": 100, "shape": "box", "material": "wood",
            }

        def hinge(scene):
            scene["simulator"] = {"mode": "particle"}
            scene["bodies"].append({"name": "flap", "shape": "box", "material": "wood",
                                    "hinge": {"axis": [0, 0, 1]}})

        def missed_target(scene):
            scene["events"] = [{"time_s": 0.1, "type": "remove", "bodies": ["boxes/99"]}]

        for spoil, where in ((no_body, ": /emitters/0: emits no body"),
                             (hinge, ": 'flap' has a hinge"),
                             (missed_target, ":")):
            scene = self.write_scene(spoil)
            for command, more in (("validate", []), ("simulate", ["-o", "out"]),
                                  ("compare", ["-o", "cmp", "--modes", "impulse"])):
                if command == "compare" and spoil is hinge:
                    more = ["-o", "cmp", "--modes", "particle"]
                stderr = self.expect_exit(3, command, scene, *more).stderr
                self.assertIn(f"scene.json{where}", stderr, command)

    def test_a_scene_of_very_many_keys_is_refused_early(self):
        """Such objects take the square of the number of their keys."""
        def spoil(scene):
            scene["shapes"].update({f"s{i}": {"type": "plane"} for i in range(200_000)})

        stderr = self.expect_exit(3, "validate", self.write_scene(spoil)).stderr
        self.assertRegex(stderr, r"scene\.json:\d+:\d+: follows one key too many")

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

    def test_nothing_in_a_scene_reaches_the_terminal_as_a_command(self):
        evil = "\x1b[2J\x9b31m\u202e\x7f\nall is well"

        def spoil(scene):
            scene[evil] = 1
            scene["bodies"][0]["shape"] = evil
            scene["shapes"][evil] = {"type": evil}

        def rename(scene):
            scene["shapes"][evil] = {"type": "mesh", "file": str(SOURCE / "assets/box.obj")}
            scene["emitters"][0]["shape"] = evil
            scene["name"] = evil

        shown = [self.expect_exit(3, "validate", self.write_scene(spoil)).stderr]
        scene = self.write_scene(rename)
        shown.append(self.succeed("validate", scene).stdout)
        config = self.succeed("validate", scene, "--print-config").stdout
        self.assertEqual(json.loads(config)["name"], evil)
        shown.append(config)
        shown.append(self.succeed("simulate", scene, "-o", "out").stdout)
        for arguments in (["validate", evil], ["validate", scene, "--set", evil]):
            result = self.run_pilesim(*arguments)
            self.assertIn(result.returncode, (2, 4))
            shown.append(result.stderr)
        for text in shown:
            self.assertRegex(text, r"\\u001b")
            self.assertNotRegex(text, "[\x00-\x09\x0b-\x1f\x7f-\x9f\u202e]")
            self.assertNotRegex(text, "(?m)^all is well")

    def test_many_problems_are_counted_and_not_all_shown(self):
        def spoil(scene):
            scene["bodies"] *= 60000
            for number, body in enumerate(scene["bodies"]):
                scene["bodies"][number] = {**body, "name": str(number), "shape": "grund"}

        result = self.expect_exit(3, "validate", self.write_scene(spoil))
        lines = result.stderr.strip().splitlines()
        self.assertEqual(len(lines), 51)
        self.assertEqual(lines[-1], "pilesim: and 59950 more problems")

    def test_set_is_named_for_what_it_does(self):
        result = self.expect_exit(
            3, "validate", self.write_scene(), "--set", "/emitters/0/count=[2000,2000,2000]"
        )
        self.assertIn("--set /emitters/0/count=[2000,2000,2000]: has 8", result.stderr)
        self.assertNotIn("1:1", result.stderr)

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
