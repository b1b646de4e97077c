"""Standard streams and files that cannot take what is written, and outputs that vanish."""

import os
import resource
import shutil
import signal
import subprocess
import sys
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "cli"))
from invariants import Trajectory, check_volatile, temporaries  # noqa: E402
from support import HANGING, PILESIM, SOURCE, CommandTest, endless, stop, tree_bytes  # noqa: E402

BOX = SOURCE / "assets/box.obj"


def works(command):
    return subprocess.run([*command, "true"], capture_output=True, check=False).returncode == 0


# Flags that allow mounting; none if nothing does.
NAMESPACES = next(
    (flags for flags in (["--mount"], ["--map-root-user", "--mount"]) if works(["unshare", *flags])),
    [],
)
# The command that runs as an ordinary user, since root may do anything to files.
POWERLESS = ["setpriv", "--bounding-set=-all", "--inh-caps=-all"] if os.geteuid() == 0 else []
QUICK = ("--trials", "4", "--exemplars", "2", "--no-accuracy", "--pours", "0")


class Streams(CommandTest):
    def shell(self, line):
        """$P is pilesim. Gives its exit code, also of the first command of a pipe."""
        return subprocess.run(
            ["bash", "-c", f"set -o pipefail; {line}"],
            cwd=self.dir,
            env={**os.environ, "P": PILESIM},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
            timeout=HANGING,
        )

    def test_what_cannot_be_printed_is_an_error(self):
        self.write_scene()
        for command in ("schema", "--help", "--version", "simulate --help", "validate scene.json",
                        "simulate scene.json -o out --force"):
            result = self.shell(f'"$P" {command} > /dev/full')
            self.assertEqual(result.returncode, 4, command)
            self.assertIn("standard output: cannot be written: No space left", result.stderr)
            result = self.shell(f'"$P" {command} >&-')
            self.assertEqual(result.returncode, 4, command)
        self.assertTrue((self.dir / "out/report.json").exists())

    def test_a_reader_that_has_enough(self):
        # The pipe opens when the reader is there, who then goes: pilesim comes after.
        os.mkfifo(self.dir / "gone")
        to_nobody = 'true < gone & exec > gone && wait && exec "$P"'
        result = self.shell(f"{to_nobody} schema")
        self.assertEqual(result.returncode, -signal.SIGPIPE)
        self.assertEqual(result.stderr, "")
        self.write_scene()
        self.shell(f"{to_nobody} simulate scene.json -o out")
        self.assertTrue((self.dir / "out/report.json").exists())

    def test_closed_streams_end_in_no_file(self):
        """The next file to be opened would get their numbers."""
        self.write_scene()
        self.shell('"$P" simulate scene.json -o open')
        # Output that cannot be printed is an error; messages that cannot be printed are not.
        for name, closing, code in (("a", "2>&-", 0), ("b", "<&- >&- 2>&-", 4)):
            line = f'"$P" simulate scene.json -o {name} --progress json {closing}'
            self.assertEqual(self.shell(line).returncode, code)
            self.assertEqual(
                tree_bytes(self.dir / name / "trajectory.zarr"),
                tree_bytes(self.dir / "open/trajectory.zarr"),
            )
            for file in ("timing.csv", "report.json", "report.html"):
                check_volatile(file, (self.dir / name / file).read_bytes())
        line = '"$P" render a --frames 0-3 --quiet <&- >&- 2>&-'
        self.assertEqual(self.shell(line).returncode, 0)

    def test_a_reader_of_progress_that_goes_away_ends_no_run(self):
        self.write_scene(lambda scene: scene.update(duration_s=1))
        self.shell('"$P" simulate scene.json -o out --progress json 2> >(true) > /dev/null; wait')
        self.assertTrue((self.dir / "out/report.html").exists())


class Places(CommandTest):
    def test_what_is_no_file_is_no_output(self):
        """A pipe in place of /dev/full, which root would lose."""
        self.succeed("sample-signature", BOX, "-o", "box.sig", *QUICK)
        os.mkfifo(self.dir / "pipe")
        for command in (["sample-signature", BOX, *QUICK], ["fit-bspline", "box.sig"]):
            result = self.expect_exit(2, *command, "-o", "pipe", "--force")
            self.assertIn("pipe: exists and is not a regular file", result.stderr)
        self.assertTrue((self.dir / "pipe").is_fifo())

    def test_a_place_that_cannot_be_written_is_found_before_any_work(self):
        result = self.expect_exit(4, "sample-signature", "nowhere.obj", "-o", "none/box.sig")
        self.assertIn("none/box.sig: cannot be written: No such file", result.stderr)

    @unittest.skipUnless(NAMESPACES, "nothing can be mounted here")
    def test_a_mount_that_is_read_only_is_found_before_any_work(self):
        (self.dir / "disk/run").mkdir(parents=True)
        self.write_scene()
        self.succeed("simulate", "scene.json", "-o", "disk/run", "--set", "/duration_s=0.1")
        before = tree_bytes(self.dir)
        locked = (
            "mount --bind disk disk && mount -o remount,bind,ro disk || exit 99; exec \"$0\" \"$@\""
        )
        for command, place in (
            (["simulate", "nowhere.json"], "disk/new"),
            (["simulate", "nowhere.json", "--force"], "disk/run"),
            (["direct-pile", "nowhere.json"], "disk/a/b/c"),
            (["compare", "nowhere.json", "--modes", "impulse"], "disk/new"),
            (["sample-signature", "nowhere.obj"], "disk/a.sig"),
            (["fit-bspline", "nowhere.sig"], "disk/a.sig"),
            (["render", "disk/run"], "disk/new"),
            (["render", "disk/run", "--sheet", "2x2"], "disk/run"),
        ):
            result = subprocess.run(
                ["unshare", *NAMESPACES, "sh", "-c", locked, PILESIM, *command, "-o", place],
                cwd=self.dir,
                capture_output=True,
                text=True,
            )
            self.assertEqual(result.returncode, 4, result.stderr)
            self.assertIn(f"{place}: cannot be written: Read-only file system", result.stderr)
        self.assertEqual(tree_bytes(self.dir), before)

    def start_long_run(self, *before):
        """Writes frames into out/ without an end."""
        self.write_scene(endless)
        process = subprocess.Popen(
            [*before, PILESIM, "simulate", "scene.json", "-o", "out"],
            cwd=self.dir,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(process.kill)
        return process

    def go_on(self, process):
        """To its end, which is an error of files; what it says of it."""
        process.send_signal(signal.SIGCONT)
        _, errors = process.communicate(timeout=HANGING)
        self.assertEqual(process.returncode, 4, errors)
        return errors

    @unittest.skipUnless(works(POWERLESS), "root cannot be without its power over permissions")
    def test_a_directory_that_becomes_read_only_under_the_run(self):
        """Output written until then stays, complete."""
        process = self.start_long_run(*POWERLESS)
        store = self.dir / "out/trajectory.zarr"
        # The shape is what is written last of a frame.
        self.wait_until(
            process,
            lambda: (store / "position/0.0.0").exists() and Trajectory(store).count > 0,
        )
        # While a file has its temporary name nobody could take it away afterwards.
        stop(process.pid)
        while temporaries(store):
            process.send_signal(signal.SIGCONT)
            stop(process.pid)
        for directory in (store, *(path for path in store.rglob("*") if path.is_dir())):
            directory.chmod(0o555)
        errors = self.go_on(process)
        self.assertRegex(errors, r"out/trajectory\.zarr.*: Permission denied")
        self.assertRegex(errors, r"out/trajectory\.zarr: holds \d+ complete frames? and is valid")
        self.assertGreater(Trajectory(store).count, 0)
        check_volatile("timing.csv", (self.dir / "out/timing.csv").read_bytes())
        self.assertEqual(temporaries(self.dir), [])

    def test_an_output_that_is_removed_under_the_run(self):
        """Whatever file is the next to be written: it, or the checkpoint."""
        process = self.start_long_run()
        self.wait_until(process, (self.dir / "out/timing.csv").exists)
        stop(process.pid)
        shutil.rmtree(self.dir / "out")
        errors = self.go_on(process)
        self.assertRegex(errors, r"^pilesim: out/.*: cannot be (created|written): No such file")
        self.assertIn("out/trajectory.zarr: does not exist any more, or is damaged", errors)
        self.assertFalse((self.dir / "out").exists())

    def test_a_limit_on_file_sizes_is_a_full_disk(self):
        self.write_scene(lambda scene: scene.update(duration_s=20))
        result = self.run_pilesim(
            "simulate", "scene.json", "-o", "out", "--quiet", preexec_fn=limit_file_sizes
        )
        self.assertEqual(result.returncode, 4)
        self.assertIn("File too large", result.stderr)
        timing = self.dir / "out/timing.csv"
        check_volatile("timing.csv", timing.read_bytes())


def limit_file_sizes():
    resource.setrlimit(resource.RLIMIT_FSIZE, (10000, 10000))


if __name__ == "__main__":
    unittest.main()
