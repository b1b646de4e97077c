"""One case of cases.py, run again and again under accidents, and what is checked after each."""

import ctypes
import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

from cases import OWN_FILES, PILESIM, environment, support
from invariants import Reference, check, check_complete, require

PR_SET_CHILD_SUBREAPER = 36
LONGEST_S = 300  # no run takes a hundredth of it: what is not over then hangs


def adopt_orphans():
    """Children of a pilesim that was killed become ours, so that none can hide."""
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)


def heed_signals():
    """A job in the background ignores SIGINT, and so would what it starts: pilesim asks no more."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def reap_orphans():
    """Waits for them; they end by themselves, at once or with what their parent gave them."""
    end = time.monotonic() + LONGEST_S
    while True:
        try:
            child, _ = os.waitpid(-1, os.WNOHANG)
        except ChildProcessError:
            return
        require(child != 0 or time.monotonic() < end, "a child outlives pilesim")
        if child == 0:
            time.sleep(0.002)


class Bench:
    def __init__(self, case, base):
        self.case = case
        self.place = Path(base) / case.name.replace(" ", "_") / "place"
        self.place.mkdir(parents=True)
        for name, text in OWN_FILES.items():
            (self.place / name).parent.mkdir(parents=True, exist_ok=True)
            (self.place / name).write_text(text)
        case.prepare(self.place)
        self.keep("prepared")
        self.references = []
        if case.earlier:
            require(self.run(case.earlier)[0] == 0, case.name, "fails")
            self.keep("earlier")
            self.references.append(Reference(self.place))
            self.restore("prepared")
        start = time.monotonic()
        log = self.place.parent / "changes.log"
        code, errors = self.run(case.command, self.failing_disk("none", 0, log))
        self.duration_s = time.monotonic() - start
        require(code == 0, case.name, "fails:", errors)
        self.changes_of_first = changes_in(log)
        self.reference = Reference(self.place)
        self.references += [self.reference, Reference(self.kept("prepared"))]

    def kept(self, name):
        return self.place.parent / name

    def keep(self, name):
        shutil.copytree(self.place, self.kept(name), symlinks=True)

    def restore(self, name):
        """Without replacing the directory itself, which may be a disk of its own."""
        for path in self.place.iterdir():
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        shutil.copytree(self.kept(name), self.place, symlinks=True, dirs_exist_ok=True)

    def starts(self):
        """Possible states of a directory before the command."""
        return ["prepared", "earlier"] if self.case.earlier else ["prepared"]

    def start(self, command=None, variables=None, **options):
        return subprocess.Popen(
            [PILESIM, *(command or self.case.command)],
            cwd=self.place,
            env={**environment(self.place, self.case.gnuplot), **(variables or {})},
            stdin=subprocess.DEVNULL,
            **{"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, **options},
        )

    def run(self, command=None, variables=None):
        process = self.start(command, variables)
        _, errors = process.communicate(timeout=LONGEST_S)
        return process.returncode, errors.decode()

    def failing_disk(self, fault, at, log="/dev/null", subcommand=None):
        return support.failing_disk(self.place, subcommand or self.case.subcommand, fault, at, log=log)

    def changes(self, start, subcommand=None):
        """The changes to files that the command makes, in their order: (operation, path)."""
        if start == "prepared" and subcommand is None:
            return self.changes_of_first
        log = self.place.parent / "changes.log"
        log.unlink(missing_ok=True)
        self.restore(start)
        code, errors = self.run(None, self.failing_disk("none", 0, log, subcommand))
        require(code == 0, errors)
        return changes_in(log)

    def check(self, **how):
        check(self.place, self.references, OWN_FILES, **how)

    def bring_to_its_end(self):
        code, errors = self.run()
        if code == 2 and "exists already" in errors:  # it was killed after the last of its work
            code, errors = self.run([*self.case.command, "--force"])
        require(code == 0, "the next run fails:", errors)
        check_complete(self.place, self.reference, OWN_FILES)

    # --- Accidents. Each gives what happened, to be counted; Broken: an invariant does not hold.

    def kill_at_a_moment(self, after_s):
        """SIGKILL; False: it had ended before. The next accident comes on top of this one."""
        process = self.start(stderr=subprocess.DEVNULL)
        time.sleep(after_s)
        process.kill()
        killed = process.wait(timeout=LONGEST_S) == -signal.SIGKILL
        reap_orphans()
        self.check(killed=True)
        return killed

    def run_to_a_change(self, fault, number, subcommand):
        """How the command ends, or None: this time there were fewer changes, since a trajectory is
        written every second, too."""
        log = self.place.parent / "changes.log"
        log.unlink(missing_ok=True)
        code, errors = self.run(None, self.failing_disk(fault, number, log, subcommand))
        reap_orphans()
        reached = log.read_text().count("\n") >= number
        require(reached or code == 0, "exit", code, errors)
        return (code, errors) if reached else None

    def kill_at_a_change(self, number, subcommand=None):
        end = self.run_to_a_change("kill", number, subcommand)
        if end is None:
            return
        code, errors = end
        if subcommand is None:
            require(code == -signal.SIGKILL, "was not killed:", code, errors)
        else:
            require(code not in (0, -signal.SIGKILL), "does not miss its child:", errors)
        self.check(killed=True)

    def fill_at_a_change(self, number, subcommand=None):
        end = self.run_to_a_change("full", number, subcommand)
        if end is None:
            return
        code, errors = end
        require(code == 4, "exit", code, errors)
        require("No space left on device" in errors, "says", errors)
        require(any(word in errors for word in ("out", ".sig", "plots", "cache")), "says", errors)
        self.check()
        require_no_temporaries(self.place)

    def signal_at_a_moment(self, number, after_s):
        """Asks once. Ended before it was asked, in good order, or while it was set up."""
        process = self.start()
        time.sleep(after_s)
        process.send_signal(number)
        _, errors = process.communicate(timeout=LONGEST_S)
        code = process.returncode
        require(code in (0, 130, -number), "exit", code, errors.decode())
        require(code != 130 or b"interrupted" in errors, "says", errors)
        reap_orphans()
        self.check(shorter=True)
        if code == 130:
            require_no_temporaries(self.place)
        return {0: "whole", 130: "shorter"}.get(code, "at once")


def changes_in(log):
    return [line.split(" ", 1) for line in log.read_text().splitlines()]


def require_no_temporaries(place):
    left = [path for path in place.rglob(".pilesim.*.tmp") if path.name != ".pilesim.notes.tmp"]
    require(not left, "left behind:", *left)
