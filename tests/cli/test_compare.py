"""compare and --fail-on: what they write, refuse, resume, and that they see what is wrong."""

import json
import math
import os
import re
import signal
import subprocess
import unittest

from support import HANGING, PILESIM, SOURCE, CommandTest, endless, tree_bytes


def meshes(scene):
    """BOXES with L-shapes, whose collision can be chosen."""
    scene["duration_s"] = 0.4
    scene["shapes"]["box"] = {"type": "mesh", "file": str(SOURCE / "assets/l_shape.obj")}
    scene["emitters"][0].update(centre=[0, 0.5, 0], spacing=[0.3, 0.3, 0.3])


class Compare(CommandTest):
    def compare(self, *arguments):
        """Without gnuplot, whose charts take longer than all runs."""
        return self.succeed(
            "compare",
            self.write_scene(meshes),
            "-o",
            "out",
            "--runs",
            3,
            *arguments,
            env={**os.environ, "PATH": str(self.dir)},
        )

    def expect_labels_apart(self, svg):
        """Labels that stand side by side: letters are 6.5 pixels wide in the mean."""
        rows = {}
        for x, y, text in re.findall(r'translate\(([\d.]+),([\d.]+)\)"[^>]*text-anchor="middle"[^>]*>\s*'
                                     r"<text><tspan[^>]*>\s*([^<]*?)\s*</tspan>", svg):
            rows.setdefault(y, []).append((float(x), text))
        self.assertGreater(max(map(len, rows.values())), 2)
        for row in map(sorted, rows.values()):
            for (x, text), (other_x, other) in zip(row, row[1:]):
                self.assertGreater(other_x - x, 6.5 * (len(text) + len(other)) / 2, (text, other))

    def figures(self):
        return json.loads((self.dir / "out/compare.json").read_text())

    def test_writes_figures_page_and_charts(self):
        modes = "impulse,impulse:spheres3,impulse:decomposition@1/120"
        result = self.succeed(
            "compare", self.write_scene(meshes), "-o", "out", "--runs", 3, "--modes", modes
        )
        self.assertIn("impulse:spheres3", result.stdout)
        figures = self.figures()
        names = [mode["name"] for mode in figures["modes"]]
        self.assertEqual(names, ["impulse:decomposition", *modes.split(",")])
        self.assertEqual(figures["seeds"], [3, 4, 5])
        reference = figures["modes"][0]
        for error in reference["errors"].values():
            if error["spread_of_reference"]["value"] > 0:
                self.assertAlmostEqual(error["normalised"]["value"], 1)
        for mode in figures["modes"]:
            self.expect_times_of_its_runs(mode)
            self.assertGreater(mode["peak_memory_bytes"]["value"], 1e6)
            self.assertLessEqual(mode["speed_up"]["low"], mode["speed_up"]["value"])
            self.assertEqual(mode["quality_at_end"]["bodies_at_end"]["value"], 8)
        self.assertIn("3 pieces", "".join(figures["modes"][2]["collision_shapes"]))
        page = (self.dir / "out/compare.html").read_text()
        self.assertEqual(page.count("<svg"), 4)
        for outside in ('src="http', 'href="http', "<link", "<script src"):
            self.assertNotIn(outside, page)
        for chart in ("pareto", "overlap", "errors", "energy"):
            svg = (self.dir / f"out/compare.{chart}.svg").read_text()
            self.assertIn("<svg", svg)
            self.expect_labels_apart(svg)
            png = (self.dir / f"out/compare.{chart}.png").read_bytes()
            self.assertTrue(png.startswith(b"\x89PNG"))
        self.succeed("render", "out/runs/impulse_spheres3/seed4", "--frames", "0", "--no-video")

    def test_bullet_gives_a_second_opinion(self):
        self.compare("--modes", "impulse:decomposition+/simulator/engine=bullet")
        second = self.figures()["modes"][1]
        self.assertEqual(second["quality_at_end"]["bodies_at_end"]["value"], 8)
        self.assertGreater(second["errors"]["energy"]["normalised"]["value"], 0)

    def expect_times_of_its_runs(self, mode):
        """How long anything takes is not judged: that the means are of what the runs report is."""
        directory = "".join(c if c.isalnum() or c == "." else "_" for c in mode["name"])
        runs = sorted((self.dir / "out/runs" / directory).glob("seed*/report.json"))
        times = [json.loads(run.read_text())["time"] for run in runs]
        self.assertEqual(len(times), 3)
        for name, of in (
            ("wall", lambda time: time["stages"]["all"]["total_s"]),
            ("cpu", lambda time: time["cpu_s"]),
        ):
            for time in times:
                self.assertTrue(0 <= of(time) < math.inf, time)
            mean = sum(map(of, times)) / len(times) / 0.4
            self.assertAlmostEqual(mode[f"{name}_per_simulated_second"]["value"] / mean, 1)

    def test_sees_an_injected_fault(self):
        """Large ones, in eight bodies and three seeds."""
        result = self.compare(
            "--modes",
            "impulse:decomposition+/gravity=[0,-16,0],"
            "impulse:decomposition+/materials/wood/restitution=0.9",
        )
        self.assertRegex(result.stderr, r"warning: .*no charts.*gnuplot.*apt install")
        _, wrong, bouncing = self.figures()["modes"]
        self.assertGreater(wrong["worst_error"]["low"], 2)
        self.assertGreater(bouncing["worst_error"]["low"], 1.5)
        self.assertGreater(wrong["motion"]["relative"]["value"], 0.05)

    def test_sees_doubled_restitution_but_not_half_the_step(self):
        def heap(scene):
            scene["duration_s"] = 1.5
            scene["materials"]["wood"]["restitution"] = 0.4
            scene["emitters"][0].update(
                count=[4, 4, 4],
                spacing=[0.35, 0.35, 0.35],
                position_jitter_m=0.05,
                angular_velocity_jitter=2,
            )

        self.succeed(
            "compare", self.write_scene(heap), "-o", "out", "--runs", 8, "--reference", "impulse",
            "--modes", "impulse@1/480,impulse+/materials/wood/restitution=0.8",
            env={**os.environ, "PATH": str(self.dir)},
        )
        _, finer, bouncing = self.figures()["modes"]
        for quantity in ("energy", "radial_distance", "height", "speed", "spin"):
            self.assertLess(finer["errors"][quantity]["normalised"]["value"], 1.35, quantity)
            self.assertGreater(bouncing["errors"][quantity]["normalised"]["low"], 1.25, quantity)

    def test_resume_keeps_finished_runs_and_force_does_not(self):
        self.compare("--modes", "impulse")
        runs = self.dir / "out/runs"
        (self.dir / "out/compare.json").unlink()
        first = tree_bytes(runs)
        (runs / "impulse/seed5/finished.key").unlink()
        self.compare("--modes", "impulse", "--resume")
        second = tree_bytes(runs)
        same = [name for name in first if first[name] == second[name] and name.endswith("report.json")]
        self.assertEqual(len(same), 5)  # of 6
        # The finished runs no longer match the request.
        self.compare("--modes", "impulse", "--resume", "--set", "/gravity=[0,-5,0]")
        third = tree_bytes(runs)
        self.assertFalse(any(second[n] == third[n] for n in second if n.endswith("report.json")))
        self.expect_exit(2, "compare", "scene.json", "-o", "out", "--modes", "impulse")
        self.compare("--modes", "impulse:hull", "--force")
        self.assertFalse((runs / "impulse").exists())

    def test_ctrl_c_can_be_resumed(self):
        def long(scene):
            meshes(scene)
            endless(scene)

        scene = self.write_scene(long)
        process = subprocess.Popen(
            [PILESIM, "compare", scene, "-o", "out", "--modes", "impulse", "--runs", "3"],
            cwd=self.dir,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.addCleanup(process.stderr.close)
        self.addCleanup(process.kill)
        timing = self.dir / "out/runs/impulse_decomposition/seed3/timing.csv"
        self.wait_until(process, lambda: timing.exists() and timing.read_text().count("\n") > 5)
        process.send_signal(signal.SIGINT)
        _, errors = process.communicate(timeout=HANGING)
        self.assertEqual(process.returncode, 130, errors)
        self.assertIn("--resume", errors)
        self.assertFalse((self.dir / "out/compare.json").exists())
        self.compare("--modes", "impulse", "--resume")

    def refuse(self, code, *arguments):
        result = self.expect_exit(
            code, "compare", self.write_scene(meshes), "-o", "out", *arguments
        )
        self.assertFalse((self.dir / "out").exists())
        return result.stderr

    def test_a_collision_needs_a_mesh_to_choose_it_for(self):
        scene = self.write_scene()
        for modes in ("impulse:hull99999", "impulse:hull"):
            result = self.expect_exit(2, "compare", scene, "-o", "out", "--modes", modes)
            self.assertIn("no dynamic body has a mesh", result.stderr)
        self.assertFalse((self.dir / "out").exists())

    def test_what_is_wrong_with_a_mode_names_the_mode(self):
        for mode, found in (("magic", '"magic"'), ("impulse:hull99999", "is 99999")):
            errors = self.refuse(3, "--modes", mode)
            self.assertIn(f'mode "{mode}"', errors)
            self.assertIn(found, errors)
            self.assertNotIn("--set", errors)

    def test_refusals_come_before_any_run(self):
        self.assertIn("cubes", self.refuse(2, "--modes", "impulse:cubes"))
        self.assertIn("twice", self.refuse(2, "--modes", "impulse,impulse"))
        self.assertIn("--runs", self.refuse(2, "--modes", "impulse", "--runs", "2"))
        self.assertIn("magic", self.refuse(3, "--modes", "impulse,magic"))
        self.assertIn("none.sig", self.refuse(3, "--modes", "statistical", "--set", '/shapes/box/signature="none.sig"'))
        errors = self.refuse(3, "--modes", "mixed+/simulator/engine=bullet")
        self.assertIn('mode "mixed+/simulator/engine=bullet"', errors)
        self.assertIn('Use "engine": "exact"', errors)
        self.refuse(2, "--modes", "impulse", "--force", "--resume")


class Gates(CommandTest):
    def test_a_failing_gate_ends_with_5_and_keeps_the_result(self):
        # Half a second is too short for anything to come to rest.
        result = self.expect_exit(
            5, "simulate", self.write_scene(), "-o", "out", "--fail-on", "unsettled>0,escaped>0"
        )
        self.assertRegex(result.stderr, r"unsettled is \d bod(y|ies); expected not unsettled>0")
        self.assertNotIn("escaped is", result.stderr)
        report = json.loads((self.dir / "out/report.json").read_text())
        self.assertEqual([gate["passed"] for gate in report["gates"]], [False, True])
        page = (self.dir / "out/report.html").read_text()
        self.assertIn("Quality gates", page)
        self.succeed("render", "out", "--frames", "0", "--no-video")

    def test_a_sound_pile_passes(self):
        def settled(scene):
            scene["duration_s"] = 3

        gates = "penetration>0.02D,unsettled>0,escaped>0,floating>0"
        result = self.succeed(
            "simulate", self.write_scene(settled), "-o", "out", "--fail-on", gates
        )
        self.assertIn("0 unsettled, 0 escaped, 0 floating", result.stdout)
        report = json.loads((self.dir / "out/report.json").read_text())
        self.assertEqual(len(report["gates"]), 4)
        self.assertTrue(all(gate["passed"] for gate in report["gates"]))

    def test_a_bad_gate_is_refused_before_any_work(self):
        for gates in ("penetration>0.02", "weight>3", "unsettled", ""):
            result = self.expect_exit(
                2, "simulate", self.write_scene(), "-o", "out", "--fail-on", gates
            )
            self.assertIn("--fail-on", result.stderr)
            self.assertFalse((self.dir / "out").exists())


if __name__ == "__main__":
    unittest.main()
