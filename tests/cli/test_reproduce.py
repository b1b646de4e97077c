"""reproduce: the dissertation's tables and figures by number, what makes them, and the page."""

import json
import os
import re
import shlex
import unittest

from support import SOURCE, CommandTest

TABLES = {3: 1, 4: 4, 5: 2, 6: 3}
FIGURES = {1: 1, 2: 1, 3: 9, 4: 5, 5: 11, 6: 12}
NUMBERS = {f"{kind} {chapter}.{i + 1}" for kind, counts in (("table", TABLES), ("figure", FIGURES))
           for chapter, count in counts.items() for i in range(count)}  # fmt: skip
CHAPTERS = [json.loads(file.read_text()) for file in sorted((SOURCE / "reproduce").glob("*.json"))]
ENTRIES = [entry for chapter in CHAPTERS for entry in chapter["entries"]]


def values_of(json_value):
    """All objects within, and itself."""
    if isinstance(json_value, dict):
        yield json_value
    if isinstance(json_value, (dict, list)):
        for part in json_value.values() if isinstance(json_value, dict) else json_value:
            yield from values_of(part)


class Entries(unittest.TestCase):
    def test_each_number_of_the_dissertation_has_one(self):
        numbers = [entry["number"] for entry in ENTRIES]
        self.assertEqual(len(numbers), len(set(numbers)))
        self.assertEqual(set(numbers), NUMBERS)

    def test_each_shows_what_its_kind_says(self):
        for entry in ENTRIES:
            shown = {"measured": ("rows", "pictures"), "picture": ("pictures",), "method": ("method",)}
            self.assertTrue(any(entry.get(key) for key in shown[entry["kind"]]), entry["number"])
            for row in entry.get("rows", []):
                self.assertEqual(len(row), len(entry["columns"]), entry["number"])

    def test_methods_are_where_entries_say(self):
        for entry in ENTRIES:
            for place in entry.get("method", {}).values():
                self.assertTrue((SOURCE / place.partition("#")[0]).exists(), f"{entry['number']}: {place}")

    def test_results_come_from_runs_of_the_entry(self):
        for chapter in CHAPTERS:
            for entry in chapter["entries"]:
                needed = list(entry.get("runs", []))
                for name in needed:  # grows
                    needed += re.findall(r"\{(?!out\})(\w+)\}", chapter["runs"][name]["command"])
                used = [picture[0].split("/")[0] for picture in entry.get("pictures", [])]
                for value in values_of([entry.get("rows", []), entry.get("charts", [])]):
                    for key in ("at", "over", "bytes", "frames", "time", "motion"):
                        places = value.get(key, [])
                        used += [place.split("/")[0] for place in ([places] if isinstance(places, str) else places)]
                self.assertLessEqual(set(used), set(needed), entry["number"])

    def test_each_run_is_of_an_entry(self):
        for chapter in CHAPTERS:
            texts = [run["command"] for run in chapter.get("runs", {}).values()]
            named = {name for entry in chapter["entries"] for name in entry.get("runs", [])}
            named |= set(re.findall(r"\{(\w+)\}", " ".join(texts)))
            self.assertLessEqual(set(chapter.get("runs", {})), named)


class Reproduce(CommandTest):
    def test_the_list_has_each_number(self):
        lines = self.succeed("reproduce", "list").stdout.splitlines()[1:]
        self.assertEqual({line[:12].strip() for line in lines}, NUMBERS)

    def test_commands_are_taken_and_scenes_are_valid(self):
        tried, scenes = set(), set()
        for size in ([], ["--full"]):
            for line in self.succeed("reproduce", "all", "--dry-run", *size).stdout.splitlines():
                words = shlex.split(line)[1:]
                sets = [f"--set={words[i + 1]}" for i, word in enumerate(words) if word == "--set"]
                shape = (words[0], *[word for word in words if word.startswith("-")])
                if shape not in tried:  # an empty directory: misuse is said before files are looked for
                    self.assertIn(self.run_pilesim(*words).returncode, (3, 4), line)
                    tried.add(shape)
                if words[1].startswith("presets/") and (words[1], *sets) not in scenes:
                    scenes.add((words[1], *sets))
                    self.succeed("simulate", SOURCE / words[1], "--print-config", *sets)
        self.assertGreater(len(scenes), 100)

    def test_names_that_are_none(self):
        for name, nearest in (("tabel 3.1", "table 3.1"), ("chapter 9", "chapter"), ("figure 5.12", "figure 5.1")):
            result = self.expect_exit(2, "reproduce", name, "--dry-run")
            self.assertIn(f'"{name}": is not in the dissertation', result.stderr)
            self.assertIn(nearest, result.stderr)
        self.assertIn("--output", self.expect_exit(2, "reproduce", "table 3.1").stderr)

    def test_makes_numbers_and_pages_and_keeps_what_is_made(self):
        names = ["table", "6.1", "figure 6.12", "Table 6.1"]
        printed = self.succeed("reproduce", *names, "-o", "out").stdout
        self.assertEqual(printed.count("pilesim direct-pile "), 2, printed)
        figures = json.loads((self.dir / "out/reproduction.json").read_text())
        self.assertEqual([entry["number"] for entry in figures["entries"]], ["table 6.1", "figure 6.12"])
        drift = figures["entries"][1]["rows"][0]
        self.assertEqual(drift[0], "mean drift at the end, m")
        self.assertGreater(drift[1], 10 * drift[2])  # those whose contacts point up fall
        report = json.loads((self.dir / "out/runs/wedged_crates/report.json").read_text())
        self.assertEqual(drift[1], report["piles"]["guide"]["mean_drift_m"])
        self.assertEqual(figures["runs"][0]["seeds"], [report["seed"]])
        for page in ("html", "md"):
            text = (self.dir / f"out/reproduction.{page}").read_text()
            for image in re.findall(r'src="([^"]+)"|!\[[^]]*\]\(([^)]+)\)', text):
                self.assertTrue((self.dir / "out" / "".join(image)).is_file(), image)
            self.assertIn("wedged_crates_sheet/sheet.png", text)
            self.assertIn("Table 6.1", text)

        self.assertIn("--force", self.expect_exit(2, "reproduce", "table 6.1", "-o", "out").stderr)
        before = os.stat(self.dir / "out/runs/wedged_crates/report.json").st_mtime_ns
        again = self.succeed("reproduce", "figure 6.12", "-o", "out", "--resume")
        self.assertNotIn("direct-pile", again.stdout)
        self.assertEqual(os.stat(self.dir / "out/runs/wedged_crates/report.json").st_mtime_ns, before)
        self.assertEqual(len(json.loads((self.dir / "out/reproduction.json").read_text())["entries"]), 1)

    def test_charts_and_errors_of_motion(self):
        """Without gnuplot, which is told, and does not stop it."""
        result = self.succeed("reproduce", "figure 5.9", "-o", "out", env={**os.environ, "PATH": str(self.dir)})
        self.assertIn("charts are missing", result.stderr)
        rows = json.loads((self.dir / "out/reproduction.json").read_text())["entries"][0]["rows"]
        self.assertEqual([row[1] for row in rows], [2.4, 9.6])
        for value in rows[1][2:]:
            self.assertGreater(value, 0)
            self.assertLess(value, 1000)

    def test_a_command_that_fails_is_named_with_its_entry(self):
        (self.dir / "small").write_text("mine")
        result = self.expect_exit(4, "reproduce", "figure 6.12", "-o", "small/out")
        self.assertIn("small/out", result.stderr)
        result = self.expect_exit(4, "reproduce", "figure 6.12", "-o", "out", preexec_fn=limit_files)
        self.assertRegex(result.stderr, r'figure 6\.12.*: "pilesim .*" failed:')


def limit_files():
    """Files of at most 4 kB: enough for none of a run's."""
    import resource

    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
