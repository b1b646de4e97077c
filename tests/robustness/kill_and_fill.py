#!/usr/bin/python3
"""Kills pilesim at random moments and at every change that it makes to files, fills its disk, asks
it to stop; prints how often each was survived, as the rows of docs/lab/soundness.md.

    PILESIM=build/release/commands/pilesim PILESIM_SOURCE=. \\
    FAILING_DISK=build/release/tests/robustness/libfailing_disk.so \\
    tests/robustness/kill_and_fill.py --kills 100
"""

import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

from bench import Bench, adopt_orphans, heed_signals, require_no_temporaries
from cases import CASES
from invariants import Broken, require


class Tally:
    """Counts one kind of accident of a case; a broken invariant is told and counted, too."""

    def __init__(self, bench, kind):
        self.bench, self.kind, self.tried, self.survived = bench, kind, 0, 0
        self.broken = 0

    def attempt(self, what, accident, counts=True):
        self.tried += counts
        try:
            result = accident()
            self.survived += counts
            return result
        except Broken as fault:
            self.broken += 1
            print(f"BROKEN {self.bench.case.name}, {self.kind}, {what}: {fault}", flush=True)
            self.bench.restore("prepared")
            return None

    def __str__(self):
        return f"{self.survived} of {self.tried}"


def random_kills(bench, count, rng):
    tally = Tally(bench, "killed")
    bench.restore("prepared")
    for i in range(count):
        killed = False
        while not killed:
            after_s = rng.uniform(0, 1.05 * bench.duration_s)
            killed = tally.attempt(
                f"after {after_s:.4f} s", lambda after_s=after_s: bench.kill_at_a_moment(after_s)
            )
            if killed is None:
                break
            if not killed:  # it came too late
                tally.tried -= 1
                tally.survived -= 1
                bench.restore(rng.choice(bench.starts()))
        if i % 10 == 9:
            tally.attempt("the next run", bench.bring_to_its_end, counts=False)
            bench.restore(rng.choice(bench.starts()))
    return tally


def subcommands(bench):
    return [None, "simulate"] if bench.case.subcommand == "compare" else [None]


def swept(bench, kind, accident, numbers_of, most, rng):
    """`accident(number, subcommand)` at each change that numbers_of(changes) names, or at `most`
    of them, of each command and each start."""
    tally = Tally(bench, kind)
    for subcommand in subcommands(bench):
        for start in bench.starts():
            changes = bench.changes(start, subcommand)
            if subcommand:  # of the first of all runs of compare
                changes = changes[: len(changes) // 6]
            numbers = list(numbers_of(changes))
            if most and most < len(numbers):
                numbers = sorted(rng.sample(numbers, most))
            for number in numbers:

                def attempt(number=number, start=start, subcommand=subcommand):
                    bench.restore(start)
                    accident(number, subcommand)
                    bench.bring_to_its_end()

                tally.attempt(f"{start} {number} {changes[number - 1]} {subcommand or ''}", attempt)
    return tally


def every_change(changes):
    """Numbers from 1. A change between two that are the same again is like them."""
    return [
        i + 1
        for i, change in enumerate(changes)
        if not change == changes[i - 1] == changes[i + 1 - len(changes)]
    ]


def every_change_that_takes_room(changes):
    return [i for i in every_change(changes) if changes[i - 1][0] in ("create", "mkdir", "write")]


def small_disks(bench, count):
    """Disks of growing size, from one that holds the inputs to one that holds all."""
    tally = Tally(bench, "small disk")
    page = 4096

    def sizes():
        return {path: page + -(-path.stat().st_size // page) * page
                for path in bench.place.rglob("*")}

    results = sizes()
    bench.restore("prepared")
    inputs = sum(sizes().values())
    whole = sum({**results, **sizes()}.values())  # some inputs are gone in the end
    for i in range(count):
        size = inputs + (whole - inputs) * i // count // page * page

        def attempt(size=size):
            mount(bench.place, size)
            try:
                bench.restore("prepared")
                code, errors = bench.run()
                require(code in (0, 4), "exit", code, errors)
                if code == 4:
                    require("No space left on device" in errors, "says", errors)
                    bench.check()
                    require_no_temporaries(bench.place)
                subprocess.run(
                    ["mount", "-o", "remount,size=256m", bench.place], check=True
                )
                bench.bring_to_its_end()
            finally:
                subprocess.run(["umount", "-l", bench.place], check=True)

        tally.attempt(f"{size} bytes", attempt)
    return tally


def mount(place, size):
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", place], check=True)


def signals(bench, count, rng):
    tally = Tally(bench, "signal")
    ends = {}
    for i in range(count):
        number = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)[i % 3]
        bench.restore(rng.choice(bench.starts()))
        after_s = rng.uniform(0, 1.05 * bench.duration_s)

        def attempt(number=number, after_s=after_s):
            end = bench.signal_at_a_moment(number, after_s)
            bench.bring_to_its_end()
            return end

        end = tally.attempt(f"{number.name} after {after_s:.4f} s", attempt)
        ends[end] = ends.get(end, 0) + 1
    tally.ends = ends
    return tally


def in_own_mounts():
    """Starts this program again where it may mount disks, if it may anywhere."""
    if "OWN_MOUNTS" in os.environ:
        return os.environ["OWN_MOUNTS"] == "yes"
    for flags in (["--mount"], ["--map-root-user", "--mount"]):
        if subprocess.run(["unshare", *flags, "true"], capture_output=True, check=False).returncode:
            continue
        os.environ["OWN_MOUNTS"] = "yes"
        os.execvp("unshare", ["unshare", *flags, sys.executable, *sys.argv])
    return False


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=100, help="at random moments, a case")
    parser.add_argument("--disks", type=int, default=20, help="of growing size, a case")
    parser.add_argument("--signals", type=int, default=30, help="at random moments, a case")
    parser.add_argument("--changes", type=int, default=0, help="at most, a case; 0: every one")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--case", action="append", help="only cases whose name holds this")
    parser.add_argument("--only", choices=("kills", "changes", "fills", "disks", "signals"))
    options = parser.parse_args()
    own_mounts = in_own_mounts()
    adopt_orphans()
    heed_signals()
    kinds = {
        "kills": lambda bench, rng: random_kills(bench, options.kills, rng),
        "changes": lambda bench, rng: swept(
            bench, "killed", bench.kill_at_a_change, every_change, options.changes, rng
        ),
        "fills": lambda bench, rng: swept(
            bench,
            "full",
            bench.fill_at_a_change,
            every_change_that_takes_room,
            options.changes,
            rng,
        ),
        "disks": lambda bench, _: small_disks(bench, options.disks) if own_mounts else "no mounts",
        "signals": lambda bench, rng: signals(bench, options.signals, rng),
    }
    if options.only:
        kinds = {options.only: kinds[options.only]}
    broken = False
    base = Path(tempfile.mkdtemp(prefix="kill-and-fill-")).resolve()
    try:
        print("| Case | " + " | ".join(kinds) + " |")
        for case in CASES:
            if options.case and not any(name in case.name for name in options.case):
                continue
            rng = random.Random(f"{options.seed} {case.name}")
            bench = Bench(case, base)
            tallies = []
            for name, kind in kinds.items():
                tallies.append(kind(bench, rng))
                print(f"{case.name}, {name}: {tallies[-1]}", file=sys.stderr, flush=True)
            print(f"| {case.name} | " + " | ".join(map(str, tallies)) + " |", flush=True)
            broken |= any(
                isinstance(t, Tally) and t.broken for t in tallies
            )
            for tally in tallies:
                if hasattr(tally, "ends"):
                    print(f"    {case.name} ended: {tally.ends}", flush=True)
    finally:
        shutil.rmtree(base)
    return broken


if __name__ == "__main__":
    sys.exit(main())
