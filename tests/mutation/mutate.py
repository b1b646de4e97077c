#!/usr/bin/env python3
"""Which wrong changes to the physics no test notices.

    tests/mutation/mutate.py --files src/simulate/sphere_*.cpp --sample 200
    tests/mutation/mutate.py --files src/pile/*.cpp --seconds 3600       # goes on where it stopped
    tests/mutation/mutate.py --files src/signature/rest/rest_poses.cpp --list
    tests/mutation/mutate.py --here --files src/simulate/mixed/*     # nothing is built twice

Changes a copy of the last commit (a git worktree under build/mutation), builds the test programs of
the file's folder and of those above it, and runs them until one fails; --here takes this tree itself
and build/release instead, and puts each source back. Pinned hashes are left out: they notice every
change and judge none. Results are lines of JSON in build/mutation/results.jsonl; what is in there is
not tried again. Ctrl-C stops at any time.
"""

import argparse
import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

from mutants import choose, mutants_of

ROOT = Path(__file__).resolve().parents[2]
# Test programs that a folder's changes can reach, the ones nearest to it first.
PROGRAMS = {
    "signature": ["property_signature", "unit_signature", "unit_simulate"],
    "simulate": ["unit_simulate", "property_simulate", "unit_pile", "unit_job"],
    "simulate/exact": ["property_simulate", "unit_simulate", "unit_pile", "unit_job"],
    "pile": ["unit_pile", "property_pile", "unit_job"],
    "inspect": ["unit_inspect"],
    "geometry": ["unit_geometry", "property_geometry", "unit_inspect", "unit_model", "unit_signature"],
    "model": ["unit_model", "unit_simulate"],
    "scene": ["unit_scene", "property_scene"],
}
FILTER = "--gtest_filter=-*Pinned*"


def programs_of(file):
    folders = Path(file).parts[1:-1]
    return next(PROGRAMS[name] for n in range(len(folders), 0, -1)
                if (name := "/".join(folders[:n])) in PROGRAMS)


def run(command, **options):
    return subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          **options)


class Copy:
    """A worktree of the last commit with a build of its own."""

    def __init__(self, directory):
        self.tree = directory / "tree"
        self.build = directory / "build"
        commit = run(["git", "-C", ROOT, "rev-parse", "HEAD"], check=True).stdout.strip()
        if not self.tree.exists():
            run(["git", "-C", ROOT, "worktree", "prune"], check=True)
            run(["git", "-C", ROOT, "worktree", "add", "--detach", self.tree, commit], check=True)
        run(["git", "-C", self.tree, "checkout", "--force", "--detach", commit], check=True)
        # Without warnings: a change may leave something unused.
        configured = run(["cmake", "-S", self.tree, "-B", self.build, "-G", "Ninja",
                          "-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_CXX_FLAGS=-w"])
        if configured.returncode != 0:
            sys.exit(configured.stdout)
        self.forget()

    def forget(self):
        self.times = {}  # s, of a program's tests
        self.binaries = {}  # hash of a program

    def program(self, name):
        return self.build / "tests" / name

    def make(self, names, jobs):
        return run(["ninja", "-C", self.build, f"-j{jobs}", *names])

    def digest(self, name):
        return hashlib.sha256(self.program(name).read_bytes()).hexdigest()

    def measure(self, names, jobs):
        made = self.make(names, jobs)
        if made.returncode != 0:
            sys.exit(made.stdout)
        for name in names:
            start = time.monotonic()
            result = run([self.program(name), FILTER, "--gtest_brief=1"], cwd=self.tree)
            if result.returncode != 0:
                sys.exit(f"{name} fails without any change:\n{result.stdout}")
            self.times[name] = time.monotonic() - start
            self.binaries[name] = self.digest(name)

    def try_out(self, mutant, names, jobs):
        """(verdict, what says so)"""
        file = self.tree / mutant.file
        text = file.read_text()
        try:
            file.write_text(mutant.apply(text))
            same = True
            for name in names:
                if self.make([name], jobs).returncode != 0:
                    return "does not compile", ""
                if self.digest(name) == self.binaries[name]:
                    continue
                same = False
                try:
                    result = run([self.program(name), FILTER, "--gtest_fail_fast",
                                  "--gtest_brief=1"],
                                 cwd=self.tree, timeout=60 + 10 * self.times[name])
                except subprocess.TimeoutExpired:
                    return "killed", f"{name} does not end"
                if result.returncode != 0:
                    failed = [line for line in result.stdout.split("\n") if "[  FAILED  ]" in line]
                    return "killed", failed[0][13:] if failed else f"{name} crashes"
            return ("same program" if same else "survived"), ""
        finally:
            file.write_text(text)


class Here(Copy):
    """The tree itself."""

    def __init__(self):
        self.tree = ROOT
        self.build = ROOT / "build" / "release"
        self.forget()


def show(results, chosen):
    verdicts = {m.key: results[m.key] for m in chosen if m.key in results}
    for key in sorted(k for k, v in verdicts.items() if v["verdict"] == "survived"):
        print(f"survived: {key}")
    counts = Counter(v["verdict"] for v in verdicts.values())
    print(f"{len(verdicts)} of {len(chosen)} tried: " +
          ", ".join(f"{n} {verdict}" for verdict, n in sorted(counts.items())))


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--files", nargs="+", required=True, help="sources, from the root of the tree")
    parser.add_argument("--sample", type=int, default=0, help="how many changes (default: all)")
    parser.add_argument("--seed", type=int, default=1, help="which ones, and their order")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="stop after this time")
    parser.add_argument("--programs", nargs="+", help="test programs instead of the folder's")
    parser.add_argument("--jobs", type=int, default=len(os.sched_getaffinity(0)))
    parser.add_argument("--directory", type=Path, default=ROOT / "build" / "mutation")
    parser.add_argument("--here", action="store_true", help="change this tree, for a while")
    parser.add_argument("--list", action="store_true", help="print the changes and stop")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, signal.default_int_handler)

    files = [Path(f).resolve().relative_to(ROOT) for f in options.files]
    mutants = [m for f in files for m in mutants_of(ROOT, f)]
    chosen = choose(mutants, options.sample, options.seed)
    if options.list:
        print("\n".join(m.key for m in chosen))
        return
    end = time.monotonic() + options.seconds
    options.directory.mkdir(parents=True, exist_ok=True)
    log = options.directory / "results.jsonl"
    results = {}
    if log.exists():
        for line in log.read_text().splitlines():
            result = json.loads(line)
            results[result["change"]] = result
    # A change of another text of the same file is another change.
    hashes = {str(f): hashlib.sha256((ROOT / f).read_bytes()).hexdigest()[:12] for f in files}
    results = {k: r for k, r in results.items() if hashes.get(k.split(":")[0]) == r["file_hash"]}

    copy = Here() if options.here else Copy(options.directory)
    try:
        for i, mutant in enumerate(chosen):
            if mutant.key in results:
                continue
            if time.monotonic() > end:
                break
            names = options.programs or programs_of(mutant.file)
            missing = [name for name in names if name not in copy.times]
            if missing:
                copy.measure(missing, options.jobs)
            start = time.monotonic()
            verdict, by = copy.try_out(mutant, names, options.jobs)
            result = {"change": mutant.key, "verdict": verdict, "by": by,
                      "seconds": round(time.monotonic() - start, 1),
                      "file_hash": hashes[mutant.file]}
            results[mutant.key] = result
            with log.open("a") as stream:
                stream.write(json.dumps(result) + "\n")
            print(f"[{i + 1}/{len(chosen)}] {verdict}: {mutant.key}  {by}", flush=True)
    except KeyboardInterrupt:
        print("stopped")
    show(results, chosen)


if __name__ == "__main__":
    main()
