#!/usr/bin/env python3
"""clang-tidy over the sources of a configured build, affordably.

    tests/lint/lint.py build/release              src/ and commands/
    tests/lint/lint.py build/release --tests      tests/, too
    tests/lint/lint.py build/release FILE...      these .cpp files
    tests/lint/lint.py build/release --recent 60  of src/ and commands/, what the last commits changed, the newest
                                                  first, as far as one comes in 60 s

Most of clang-tidy's time on one of our files goes into the packages' headers, which every check
walks through. So files are checked together, many in one translation unit. Two of them share one
only if their unnamed namespaces have no name in common; what does not compile in company is checked
alone. A unit whose text, headers and .clang-tidy have not changed since it was clean is not checked
again (stamps in BUILD/lint).
"""

import argparse
import functools
import hashlib
import json
import os
import re
import shlex
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
MOST_LINES = 6500  # of a unit: clang's memory grows with them
MOST_LINES_OF_RECENT = 1200  # some half a minute
RECENT_COMMITS = 40
# A definition at the start of a line (the tree is formatted): an alias, a type, a function, a
# constant.
NAMED = re.compile(
    r"(?P<alias>(?:using|namespace) (?P<a>\w+) =.*)"
    r"|(?:struct|class|enum class|enum|union) (?P<b>\w+)"
    r"|(?P<function>\w[\w:<>,&* ]*?[ &*](?P<c>\w+)\(.*)"
    r"|\w[\w:<>,&*\[\] ]*?[ &*](?P<d>\w+)(?:\{| = |;|\[)")


class Source:
    def __init__(self, entry):
        self.path = Path(entry["file"])
        self.flags = list(flags_of(entry))
        text = self.path.read_text()
        self.lines = text.count("\n")
        self.names = names_of(text)
        self.known = {}  # what its headers declare
        for header in headers_of(self.path):
            self.known |= declared_in(header)


def flags_of(entry):
    """The part of the compiler's command that clang needs: include paths and definitions."""
    words = shlex.split(entry["command"])
    i = 0
    while i < len(words):
        word = words[i]
        if word == "-isystem":
            yield f"-isystem{words[i + 1]}"
            i += 1
        elif word.startswith(("-I", "-D")) and word != "-DNDEBUG":
            yield word
        i += 1


def kind_of(named):
    return "alias" if named["a"] else "type" if named["b"] else ""


def names_of(text):
    """Names of unnamed namespaces and the like, which must be unique in a unit: name -> (kind, line)."""
    names = {name: ("", "") for name in re.findall(r"^#define (\w+)", text, re.M)}
    inside = False
    for line in text.split("\n"):
        if line.startswith("namespace {"):
            inside = True
        elif re.match(r"\}  // namespace$", line):
            inside = False
        elif inside or line.startswith(("static ", "using ")):
            named = NAMED.match(line)
            if named:
                name = named["a"] or named["b"] or named["c"] or named["d"]
                names[name] = kind_of(named), line
    return names


@functools.cache
def included_by(file):
    found = re.findall(r'^#include "(.*)"', file.read_text(), re.M)
    places = [folder / name for name in found for folder in (ROOT / "src", ROOT / "tests", file.parent)]
    return {place for place in places if place.exists()}


def headers_of(file):
    """Those of the tree that it includes, and those that they include."""
    found, left = set(), [file]
    while left:
        new = included_by(left.pop()) - found
        found |= new
        left += new
    return found


@functools.cache
def declared_in(header):
    names = {}
    for line in header.read_text().split("\n"):
        named = NAMED.match(line)
        if named and not line.startswith("namespace") and not (named["b"] and line.endswith(";")):
            names[named["a"] or named["b"] or named["c"] or named["d"]] = kind_of(named), f"{header}: {line}"
    return names


def clash(a, b):
    """Only aliases may be the same."""
    return any(a[name] != b[name] or a[name][0] != "alias" for name in a.keys() & b.keys())


def meet(a, b):
    # Two headers may define a type of the same name.
    types = [{n: t for n, t in s.known.items() if t[0] == "type"} for s in (a, b)]
    twice = any(types[0][n] != types[1][n] for n in types[0].keys() & types[1].keys())
    return twice or clash(a.names, b.names) or clash(a.names, b.known) or clash(a.known, b.names)


def together(sources, most_lines=MOST_LINES):
    """Units of sources without common names, in their order, the fewest by first fit."""
    units = []
    for source in sources:
        for unit in units:
            fits = sum(s.lines for s in unit) + source.lines <= most_lines
            if fits and not any(meet(s, source) for s in unit):
                unit.append(source)
                break
        else:
            units.append([source])
    return units


def most_names_first(sources):
    return sorted(sources, key=lambda s: (-len(s.names), s.path))


def recent(sources):
    """Those that the last commits changed, the newest first; all where there is no history."""
    log = subprocess.run(["git", "log", f"-{RECENT_COMMITS}", "--name-only", "--format="], cwd=ROOT,
                         capture_output=True, text=True)
    if log.returncode != 0:
        return list(sources.values())
    paths = dict.fromkeys(ROOT / line for line in log.stdout.split("\n"))
    return [sources[path] for path in paths if path in sources]


def headers_digest():
    digest = hashlib.sha256((ROOT / ".clang-tidy").read_bytes())
    for folder in ("src", "commands", "tests"):
        for header in sorted((ROOT / folder).rglob("*.h")):
            digest.update(header.read_bytes())
    return digest.hexdigest()


class Lint:
    def __init__(self, build):
        self.directory = build / "lint"
        self.directory.mkdir(exist_ok=True)
        self.headers = headers_digest()

    def run(self, unit):
        """Empty: clean. Otherwise what clang-tidy says."""
        flags = sorted({flag for source in unit for flag in source.flags})
        text = "".join(f'#include "{s.path}"  // NOLINT\n' for s in unit)
        digest = hashlib.sha256((self.headers + text + repr(flags)).encode())
        for source in unit:
            digest.update(source.path.read_bytes())
        name = digest.hexdigest()[:16]
        stamp = self.directory / f"{name}.clean"
        if stamp.exists():
            return ""
        file = self.directory / f"{name}.cpp"
        file.write_text(text)
        compiler = [*flags, "-std=c++20", "-march=x86-64-v3"]
        try:
            if len(unit) > 1:
                alone = subprocess.run(["clang++", "-fsyntax-only", "-w", *compiler, file],
                                       capture_output=True, text=True)
                if alone.returncode != 0:
                    wrong = {line.split(":")[0] for line in alone.stderr.split("\n")
                             if ": error:" in line}
                    culprits = [s for s in unit if str(s.path) in wrong]
                    rest = [s for s in unit if s not in culprits]
                    parts = [[s] for s in culprits] + ([rest] if culprits and rest else [])
                    if not parts:  # the fault is in a header that two of them share
                        parts = [unit[: len(unit) // 2], unit[len(unit) // 2 :]]
                    return "".join(self.run(part) for part in parts)
            config = f"--config-file={ROOT / '.clang-tidy'}"
            result = subprocess.run(["clang-tidy", "--quiet", config, file, "--", *compiler],
                                    capture_output=True, text=True)
        finally:
            file.unlink()
        if result.returncode == 0:
            stamp.touch()
            return ""
        return result.stdout or result.stderr


def main():
    parser = argparse.ArgumentParser(description="clang-tidy over the sources, see the file's head")
    parser.add_argument("build", type=Path)
    parser.add_argument("files", type=Path, nargs="*")
    parser.add_argument("--tests", action="store_true")
    parser.add_argument("--recent", type=float, metavar="SECONDS")
    options = parser.parse_args()
    folders = ["src/", "commands/"] + (["tests/"] if options.tests else [])
    wanted = {f.resolve() for f in options.files}
    sources = {}
    for entry in json.loads((options.build / "compile_commands.json").read_text()):
        path = Path(entry["file"])
        if not path.is_relative_to(ROOT):
            # A file that CMake made of several.
            for part in re.findall(r'#include "(.*\.cpp)"', path.read_text()):
                sources.setdefault(Path(part), Source({**entry, "file": part}))
        elif not wanted and str(path.relative_to(ROOT)).startswith(tuple(folders)):
            sources.setdefault(path, Source(entry))
        elif path in wanted:
            sources.setdefault(path, Source(entry))
    if wanted:
        sources = {path: s for path, s in sources.items() if path in wanted}
    start = time.monotonic()
    if options.recent is None:
        chosen, units = sources, together(most_names_first(sources.values()))
    else:
        chosen = recent(sources)
        units = together(chosen, MOST_LINES_OF_RECENT)
    lint = Lint(options.build)
    left = []

    def run(unit):
        if options.recent is not None and time.monotonic() - start > options.recent:
            left.extend(unit)
            return ""
        return lint.run(unit)

    with ThreadPoolExecutor(len(os.sched_getaffinity(0))) as pool:
        findings = "".join(pool.map(run, units))
    # A header's findings come with every unit that includes it.
    shown = list(dict.fromkeys(re.split(r"\n(?=/)", findings.strip()))) if findings else []
    print("\n".join(shown), end="\n" if shown else "")
    count = sum(bool(re.match(r"\S+: (error|warning):", entry)) for entry in shown)
    print(f"lint: {len(chosen) - len(left)} of {len(chosen)} files in {len(units)} units, {count} findings, "
          f"{time.monotonic() - start:.0f} s")
    return 1 if shown else 0


sys.exit(main())
