"""--resume and --from: runs that were killed, stopped or ended, and what is refused."""

import json
import os
import shutil
import signal
import subprocess
import unittest
from pathlib import Path

from support import BOX_OBJ, PILESIM, CommandTest, tree_bytes

# They hold times, or the moment.
OF_THE_CLOCK = ("timing.csv", "report.json", "report.html")


def results(directory):
    return {
        name: data
        for name, data in tree_bytes(directory).items()
        if name not in OF_THE_CLOCK and not name.startswith("frames/.")
    }


def figures(directory):
    """The parts of the report that do not depend on times."""
    report = json.loads((Path(directory) / "report.json").read_text())
    return report["quality_at_end"], report["quality_of_run"], report["interrupted"], report["scene"]


def eventful(scene):
    """120 frames: from 25 on bodies come late, from 50 on one is hit, from 80 on another is gone."""
    scene.update(duration_s=2, frame_rate=60)
    scene["emitters"][0].update(count=[4, 5, 4], spacing=[0.3, 0.3, 0.3])
    scene["emitters"].append(
        {
            "name": "late",
            "type": "grid",
            "shape": "box",
            "material": "wood",
            "centre": [0, 3, 0],
            "count": [2, 1, 2],
            "spacing": [0.5, 0.5, 0.5],
            "start_s": 0.4,
        }
    )
    scene["events"] = [
        {"type": "impulse", "time_s": 0.8, "bodies": ["boxes/9"], "impulse": [20, 5, 3]},
        {"type": "remove", "time_s": 1.3, "bodies": ["boxes/3"]},
    ]


def particles(scene):
    eventful(scene)
    scene["emitters"][0]["count"] = [12, 12, 12]
    scene["simulator"] = {"mode": "particle"}


def pile(scene):
    eventful(scene)
    scene["piles"] = [{"angle_deg": 35, "centre": [0, 0]}]


class Resume(CommandTest):
    def expect_same_after_kills(self, command, scene):
        self.succeed(command, scene, "-o", "a", "--threads", "2", "--inspect-every", "35")
        resumed = (command, scene, "-o", "b", "--resume", "--inspect-every", "35")
        # Each comes 35 frames further: after what begins late, the impulse, and the removal.
        for fault, code in (("kill", -signal.SIGKILL), (signal.SIGINT, 130), ("kill", -signal.SIGKILL)):
            struck = self.at_change(command, fault, 35, "/b/checkpoint.bin")
            self.expect_exit(code, *resumed, "--checkpoint", "0", env=struck)
        result = self.succeed(*resumed, "--threads", "1")
        self.assertRegex(result.stdout, r"resumed after \d+ frames")
        self.assertEqual(results(self.dir / "b"), results(self.dir / "a"))
        self.assertEqual(figures(self.dir / "b"), figures(self.dir / "a"))
        rows = [
            (self.dir / name / "timing.csv").read_text().splitlines() for name in ("a", "b")
        ]
        self.assertEqual(len(rows[0]), len(rows[1]))
        result = self.succeed(*resumed)
        self.assertIn("nothing was left to do", result.stdout)

    def test_impulse(self):
        self.expect_same_after_kills("simulate", self.write_scene(eventful))

    def test_bullet(self):
        def by_bullet(scene):
            eventful(scene)
            scene["simulator"] = {"engine": "bullet"}

        self.expect_same_after_kills("simulate", self.write_scene(by_bullet))

    def test_particles(self):
        self.expect_same_after_kills("simulate", self.write_scene(particles))

    def test_directed_pile(self):
        self.expect_same_after_kills("direct-pile", self.write_scene(pile))

    def test_begins_where_there_is_nothing(self):
        scene = self.write_scene()
        self.succeed("simulate", scene, "-o", "a")
        result = self.succeed("simulate", scene, "-o", "b", "--resume")
        self.assertNotIn("resumed", result.stdout)
        self.assertEqual(results(self.dir / "b"), results(self.dir / "a"))

    def test_gates_of_a_run_that_is_complete_are_judged(self):
        run = ("simulate", self.write_scene(), "-o", "b")
        first = self.expect_exit(5, *run, "--fail-on", "unsettled>0,penetration>1e-9D")
        before = tree_bytes(self.dir / "b")
        again = self.expect_exit(5, *run, "--resume", "--fail-on", "unsettled>0,penetration>1e-9D")
        self.assertEqual(again.stderr, first.stderr)
        for passed in ((), ("--fail-on", "unsettled>8,escaped>0")):
            result = self.succeed(*run, "--resume", *passed)
            self.assertIn("nothing was left to do", result.stdout)
        self.assertEqual(tree_bytes(self.dir / "b"), before)

    def test_what_is_of_other_work_is_refused_with_the_reason(self):
        scene = self.write_scene()
        self.succeed("simulate", scene, "-o", "b")
        before = tree_bytes(self.dir / "b")
        # The checkpoint of a run that is done is still one of that run only.
        for reason, arguments in {
            "is of another scene": ("simulate", scene, "--seed", "9"),
            "is of pilesim simulate": ("direct-pile", self.write_scene(pile, "pile.json")),
            "began from another state": ("simulate", scene, "--from", "b"),
        }.items():
            result = self.expect_exit(3, *arguments, "-o", "b", "--resume")
            self.assertIn(reason, result.stderr)
            self.assertIn("b/checkpoint.bin", result.stderr)
        checkpoint = self.dir / "b/checkpoint.bin"
        checkpoint.write_bytes(checkpoint.read_bytes()[:-1])
        result = self.expect_exit(3, "simulate", scene, "-o", "b", "--resume")
        self.assertIn("is damaged", result.stderr)
        checkpoint.unlink()
        result = self.expect_exit(2, "simulate", scene, "-o", "b", "--resume")
        self.assertIn("no checkpoint to resume from", result.stderr)
        after = tree_bytes(self.dir / "b")
        del before["checkpoint.bin"]
        self.assertEqual(after, before)

    def test_another_build_is_refused(self):
        scene = self.write_scene()
        self.succeed("simulate", scene, "-o", "b")
        other = self.dir / "other"
        shutil.copy(PILESIM, other)
        with other.open("ab") as file:
            file.write(b"\0")
        result = subprocess.run(
            [other, "simulate", scene, "-o", "b", "--resume"],
            cwd=self.dir,
            capture_output=True,
            text=True,
            check=False,
        )
        self.assertEqual(result.returncode, 3)
        self.assertIn("another build of pilesim", result.stderr)

    def test_not_with_force(self):
        self.expect_exit(2, "simulate", self.write_scene(), "-o", "b", "--resume", "--force")


class From(CommandTest):
    def test_begins_where_the_other_run_ended(self):
        import zarr

        scene = self.write_scene(lambda scene: scene.update(duration_s=4))
        self.succeed("simulate", scene, "-o", "settled")
        result = self.succeed("simulate", scene, "-o", "next", "--from", "settled")
        self.assertIn("8 bodies begin where they lay", result.stdout)
        first, second = (
            zarr.open(str(self.dir / name / "trajectory.zarr"), mode="r")
            for name in ("settled", "next")
        )
        for name in ("position", "orientation"):
            self.assertEqual(first[name][-1].tolist(), second[name][0].tolist())
        # Resting bodies stay.
        moved = abs(second["position"][-1] - second["position"][0]).max()
        self.assertLess(moved, 0.002)

    def test_what_sleeps_in_another_wakes_and_comes_out(self):
        import zarr

        def overlapping(scene):
            scene["emitters"][0].update(centre=[0, 0.16, 0], count=[1, 2, 1], spacing=[1, 0.12, 1], asleep=True)

        scene = self.write_scene(overlapping)
        self.succeed("simulate", scene, "-o", "a", "--set", "/duration_s=0.1")
        state = zarr.open(str(self.dir / "a/trajectory.zarr"), mode="r")["state"]
        self.assertEqual([int(flags) & 2 for flags in state[-1]], [0, 2, 2])  # as the scene says
        self.succeed("simulate", scene, "-o", "b", "--from", "a", "--set", "/duration_s=3",
                     "--fail-on", "penetration>0.02D")

    def test_nobody_begins_asleep_where_sleeping_is_off(self):
        import zarr

        scene = self.write_scene(lambda s: s.update(duration_s=4))
        self.succeed("simulate", scene, "-o", "a", "--fail-on", "unsettled>0")
        off = ("--set", "/simulator/sleeping=false", "--set", "/duration_s=0.1")
        self.succeed("simulate", scene, "-o", "b", "--from", "a", *off)
        self.succeed("simulate", scene, "-o", "c", "--set", "/emitters/0/asleep=true", *off)
        for name in ("b", "c"):
            state = zarr.open(str(self.dir / name / "trajectory.zarr"), mode="r")["state"]
            self.assertFalse((state[:] & 2).any(), name)

    def test_a_guide_is_not_filled_anew(self):
        import zarr

        (self.dir / "guide.obj").write_text(BOX_OBJ)

        def change(scene):
            scene.update(duration_s=0.5, guide={"file": "guide.obj", "scale": 0.8})
            wood = scene["bodies"][0]["material"]
            scene["shapes"]["brick"] = {"type": "box", "size": [0.3, 0.1, 0.15]}
            scene["shapes"]["cube"] = {"type": "box", "size": [0.12, 0.12, 0.12]}
            scene["emitters"] = [{"name": "pile", "type": "mould", "shapes": ["brick", "cube"], "material": wood}]

        scene = self.write_scene(change)
        self.succeed("direct-pile", scene, "-o", "held")
        self.succeed("simulate", scene, "-o", "free", "--from", "held")
        self.succeed("direct-pile", scene, "-o", "again", "--from", "held", "--seed", "2")
        self.succeed("finish", "held", "-o", "sound")
        self.succeed("finish", "free", "-o", "sound_too")
        held = zarr.open(str(self.dir / "held/trajectory.zarr"), mode="r")
        for name in ("free", "again", "sound", "sound_too"):
            other = zarr.open(str(self.dir / name / "trajectory.zarr"), mode="r")
            self.assertEqual(held["body_shape"][:].tolist(), other["body_shape"][:].tolist(), name)
            if name in ("free", "again"):
                self.assertEqual(held["position"][-1].tolist(), other["position"][0].tolist(), name)
                self.assertEqual(held["body_colour"][:].tolist(), other["body_colour"][:].tolist(), name)

    def test_bodies_of_other_names_are_as_the_scene_has_them(self):
        def hit(scene):
            scene["bodies"].append(
                {"name": "shot", "shape": "box", "material": "wood", "position": [-2, 0.3, 0],
                 "linear_velocity": [6, 0, 0]}
            )

        self.succeed("simulate", self.write_scene(lambda s: s.update(duration_s=2)), "-o", "a")
        result = self.succeed("simulate", self.write_scene(hit, "hit.json"), "-o", "b",
                              "--from", "a")
        self.assertIn("8 bodies begin where they lay", result.stdout)

    def test_what_does_not_fit_is_refused(self):
        self.succeed("simulate", self.write_scene(), "-o", "a")

        def renamed(scene):
            scene["emitters"][0]["name"] = "others"

        def reshaped(scene):
            scene["shapes"]["box"]["size"] = [0.3, 0.2, 0.2]

        result = self.expect_exit(
            3, "simulate", self.write_scene(renamed, "b.json"), "-o", "b", "--from", "a"
        )
        self.assertIn("no body with the name", result.stderr)
        result = self.expect_exit(
            3, "simulate", self.write_scene(reshaped, "c.json"), "-o", "b", "--from", "a"
        )
        self.assertIn("has the shape", result.stderr)
        self.expect_exit(3, "simulate", "scene.json", "-o", "b", "--from", "nowhere")
        self.assertFalse((self.dir / "b").exists())


class Render(CommandTest):
    def setUp(self):
        super().setUp()
        self.succeed("simulate", self.write_scene(lambda s: s.update(duration_s=1)), "-o", "run")

    def drawn(self):
        return len(list(self.dir.glob("b/frames/frame.*.png")))

    def test_a_killed_one_ends_with_the_same_bytes(self):
        command = ("render", "run", "--size", "96x72")
        self.succeed(*command, "-o", "a")
        struck = self.at_change("render", "kill", 9, ".png", under=self.dir / "b/frames")
        self.expect_exit(-signal.SIGKILL, *command, "-o", "b", env=struck)
        self.assertIn(self.drawn(), range(1, 31))
        first = self.dir / "b/frames/frame.0000.png"
        before = os.stat(first).st_mtime_ns
        result = self.expect_exit(3, "render", "run", "-o", "b", "--resume")
        self.assertIn("other options", result.stderr)
        result = self.succeed(*command, "-o", "b", "--resume")
        self.assertRegex(result.stdout, r"31 frames \(\d+ of them drawn before\)")
        self.assertEqual(os.stat(first).st_mtime_ns, before)
        self.assertEqual(tree_bytes(self.dir / "b"), tree_bytes(self.dir / "a"))

    def test_a_picture_that_is_damaged_is_drawn_again(self):
        command = ("render", "run", "--size", "96x72", "--frames", "0-9", "--no-video")
        self.succeed(*command, "-o", "a")
        shutil.copytree(self.dir / "a", self.dir / "b")
        picture = self.dir / "b/frames/frame.0004.png"
        picture.write_bytes(picture.read_bytes()[:100])
        self.succeed(*command, "-o", "b", "--resume")
        self.assertEqual(tree_bytes(self.dir / "b"), tree_bytes(self.dir / "a"))

    def test_pictures_without_a_checkpoint_are_refused(self):
        self.succeed("render", "run", "-o", "b", "--frames", "0-3", "--no-video")
        (self.dir / "b/render_checkpoint.bin").unlink()
        result = self.expect_exit(2, "render", "run", "-o", "b", "--resume", "--no-video")
        self.assertIn("nothing to resume", result.stderr)

    FILMS = ("--renderer", "rays", "--size", "64x48", "--keep-films")

    def render_films(self, output, *more, frames="28-"):
        return self.succeed("render", "run", *self.FILMS, "--frames", frames, "-o", output, *more)

    def test_more_samples_go_on_from_films_to_the_same_bytes(self):
        self.render_films("a", "--samples", "7")
        self.render_films("b", "--samples", "3")
        few = tree_bytes(self.dir / "b/frames")
        self.assertNotEqual(few, tree_bytes(self.dir / "a/frames"))
        result = self.render_films("b", "--samples", "7", "--resume")
        self.assertIn("3 frames in", result.stdout)  # none of them drawn before
        self.assertEqual(tree_bytes(self.dir / "b"), tree_bytes(self.dir / "a"))
        result = self.render_films("b", "--samples", "7", "--resume")
        self.assertIn("3 of them drawn before", result.stdout)
        # And are what the pictures are without any.
        without = [word for word in self.FILMS if word != "--keep-films"]
        self.succeed("render", "run", *without, "--frames", "28-", "--samples", "7", "-o", "c")
        self.assertEqual(tree_bytes(self.dir / "c/frames"), tree_bytes(self.dir / "a/frames"))
        self.assertFalse((self.dir / "c/films").exists())

    def test_films_of_other_work_are_refused(self):
        self.render_films("b", "--samples", "3")
        before = tree_bytes(self.dir / "b")
        for more, words in (
            (("--samples", "2"), "at most 2, as was asked for"),
            (("--samples", "4", "--set", "/render/size=[32, 32]"), "other options"),
            (("--samples", "4", "--set", "/render/light/sky=0.5"), "other options"),
            (("--samples", "4", "--set", '/camera={"position": [3, 2, 4], "target": [0, 0, 0]}'),
             "other options"),
        ):
            result = self.expect_exit(3, "render", "run", "--renderer", "rays", "--keep-films",
                                      "--set", "/render/size=[64, 48]", "--frames", "28-", *more,
                                      "-o", "b", "--resume")
            self.assertIn(words, result.stderr)
        self.assertEqual(tree_bytes(self.dir / "b"), before)
        result = self.expect_exit(2, "render", "run", "--keep-films", "-o", "c")
        self.assertIn("--renderer rays", result.stderr)
        self.assertFalse((self.dir / "c").exists())

    def test_force_begins_anew_and_removes_films(self):
        self.render_films("b", "--samples", "3")
        self.render_films("b", "--samples", "2", "--force", frames="29-")
        names = sorted(path.name for path in (self.dir / "b/films").iterdir())
        self.assertEqual(names, ["frame.0029.film", "frame.0030.film"])
        self.succeed("render", "run", "--frames", "0", "-o", "b", "--force")
        self.assertEqual(list((self.dir / "b/films").iterdir()), [])

    def test_a_picture_that_was_stopped_and_killed_half_way_goes_on(self):
        command = ("render", "run", *self.FILMS, "--samples", "1500", "--frames", "last")
        self.succeed(*command, "-o", "a")
        film = self.dir / "b/films/frame.0030.film"
        struck = self.at_change("render", signal.SIGINT, 1, "/b/films")
        self.assertIn("--resume", self.expect_exit(130, *command, "-o", "b", env=struck).stderr)
        self.assertEqual(self.drawn(), 0)
        kept = film.read_bytes()
        self.assertFalse((self.dir / "b/video.mp4").exists())
        # Killed before there is a later film.
        struck = self.at_change("render", "kill", 1, ".film")
        self.expect_exit(-signal.SIGKILL, *command, "-o", "b", "--resume", env=struck)
        self.assertEqual(self.drawn(), 0)
        self.assertEqual(film.read_bytes(), kept)
        self.succeed(*command, "-o", "b", "--resume")
        self.assertEqual(tree_bytes(self.dir / "b"), tree_bytes(self.dir / "a"))


if __name__ == "__main__":
    unittest.main()
