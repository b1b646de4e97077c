#!/usr/bin/env python3
"""Finds the tests that notice a wrong tuned constant.

    tests/mutation/constants.py src/simulate/sphere/*.h src/simulate/sphere/*.cpp
    tests/mutation/constants.py src/pile/guide/guide_constants.h --only kMoved kTouch --list
    tests/mutation/constants.py src/simulate/exact/exact_constants.h --programs benchmark/hard_cases_benchmark

Takes every constant of the files (constexpr numbers named k...) as half and as twice its value, runs
the test programs of the files' folder with each and prints the tests that fail. The program is built
once, in a git worktree of the last commit under build/mutation, where the constants are read from
the environment (tuned.h); --here takes this tree itself and build/release instead, and puts the
sources back. For hard_cases_benchmark, which is no test, it counts the cases of presets/hard that fail at the
default step and pass with the constant as it is. Pinned hashes are left out: they notice every change and judge none. Results are lines
of JSON in build/mutation/constants.jsonl; what is in there is not tried again.
"""

import argparse
import concurrent.futures
import json
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from mutate import ROOT, Copy, Here, programs_of, run

CONSTANT = re.compile(
    r"(?P<indent>^ *)(?P<inline>inline )?constexpr (?P<type>double|float|int|size_t|uint64_t|uint8_t) "
    r"(?P<name>k\w+)\s*=\s*(?P<value>[^;,(]+);", re.M)
# Sizes of arrays, and what other constants are computed from at compile time.
NEEDED_BY_THE_COMPILER = {"kAzimuths", "kCells", "kDiagonal", "kFacingIds", "kLanes", "kMostGroups"}
WHOLE = {"int", "size_t", "uint64_t", "uint8_t"}


@dataclass(frozen=True)
class Constant:
    file: Path  # from the root
    name: str
    type: str
    value: str

    @property
    def key(self):
        return f"{self.file.stem}.{self.name}"

    def values(self):
        """Half and twice; of nothing, two values that are something."""
        try:
            value = float(self.value.rstrip("FU").replace("'", ""))
        except ValueError:
            return []
        if value == 0:
            return [0.1, 0.4]
        if self.type not in WHOLE:
            return [value / 2, value * 2]
        return [v for v in (int(value) // 2, int(value) * 2) if v > 0]


def constants_of(tree, file):
    found = []
    for match in CONSTANT.finditer((tree / file).read_text()):
        if match["name"] not in NEEDED_BY_THE_COMPILER:
            found.append(Constant(file, match["name"], match["type"], match["value"].strip()))
    return [constant for constant in found if constant.values()]


def make_tunable(tree, file, names):
    def replace(match):
        if match["name"] not in names:
            # Values computed from them cannot be constexpr either.
            computed = names & set(re.findall(r"\bk\w+", match["value"]))
            return match[0].replace("constexpr", "const") if computed else match[0]
        local = "static " if match["indent"] else ""  # in a function: once
        return (f"{match['indent']}{match['inline'] or ''}{local}const {match['type']} {match['name']} = "
                f"static_cast<{match['type']}>(tuned(\"{file.stem}.{match['name']}\", {match['value']}));")

    path = tree / file
    text = CONSTANT.sub(replace, path.read_text())
    at = re.search(r"^#include|^namespace", text, re.M).start()
    path.write_text(text[:at] + f'#include "{ROOT}/tests/mutation/tuned.h"\n' + text[at:])


def failed_tests(program, tree, left_out, setting, scratch):
    environment = os.environ | {"PILESIM_TUNED": setting, "TMPDIR": str(scratch)}
    scratch.mkdir(parents=True, exist_ok=True)
    is_hard = program.name == "hard_cases_benchmark"
    arguments = ["--step", "240"] if is_hard else [f"--gtest_filter=-{left_out}", "--gtest_brief=1"]
    try:
        result = run([program, *arguments], cwd=tree, env=environment, timeout=900)
    except subprocess.TimeoutExpired:
        return ["does not end"]
    finally:
        shutil.rmtree(scratch, ignore_errors=True)
    if is_hard:
        return re.findall(r"^\| (\w+) \| impulse \| .* \| FAIL", result.stdout, re.M) or (
            ["crashes"] if result.returncode != 0 else [])
    failed = re.findall(r"^\[  FAILED  \] ([\w./-]+)(?:, where.*| \(\d+ ms\))?$", result.stdout, re.M)
    if result.returncode != 0 and not failed:
        failed = ["crashes"]
    return sorted(set(failed))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", help="sources, from the root of the tree")
    parser.add_argument("--only", nargs="+", help="names of constants")
    parser.add_argument("--programs", nargs="+", help="test programs instead of the folder's")
    parser.add_argument("--without", default="*Pinned*", help="tests that are left out")
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--directory", type=Path, default=ROOT / "build" / "mutation")
    parser.add_argument("--here", action="store_true", help="change this tree, for a while")
    parser.add_argument("--list", action="store_true", help="print the constants and stop")
    options = parser.parse_args()

    files = [Path(f).resolve().relative_to(ROOT) for f in options.files]
    chosen = [c for file in files for c in constants_of(ROOT, file)
              if not options.only or c.name in options.only]
    if options.list:
        print("\n".join(f"{c.key} = {c.value}" for c in chosen))
        return
    programs = options.programs or programs_of(files[0])
    options.directory.mkdir(parents=True, exist_ok=True)
    log = options.directory / "constants.jsonl"
    known = {}
    if log.exists():
        for line in log.read_text().splitlines():
            result = json.loads(line)
            known[result["setting"]] = result["failed"]

    copy = Here() if options.here else Copy(options.directory)
    texts = {file: (copy.tree / file).read_text() for file in files}
    try:
        for file in files:
            make_tunable(copy.tree, file, {c.name for c in chosen if c.file == file})
        made = copy.make([Path(name).name for name in programs], options.jobs)
    finally:
        for file, text in texts.items():
            (copy.tree / file).write_text(text)
    if made.returncode != 0:
        sys.exit(made.stdout)

    def fail(setting):
        scratch = options.directory / "scratch" / setting
        return [f"{name}: {test}" for name in programs
                for test in failed_tests(copy.program(name), copy.tree, options.without, setting,
                                          scratch)]

    before = set(fail("nothing=0"))
    if tests := [name for name in before if "hard_cases" not in name]:
        sys.exit(f"fails without any change: {tests}")
    settings = [f"{c.key}={value:g}" for c in chosen for value in c.values()]
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        new = [setting for setting in settings if setting not in known]
        for setting, failed in zip(new, pool.map(fail, new)):
            failed = [name for name in failed if name not in before]
            known[setting] = failed
            with log.open("a") as stream:
                stream.write(json.dumps({"setting": setting, "failed": failed}) + "\n")
            print(f"{setting}: {', '.join(failed) or 'no test notices'}", flush=True)
    noticed = sum(1 for setting in settings if known[setting])
    print(f"{noticed} of {len(settings)} values are noticed")


if __name__ == "__main__":
    main()
