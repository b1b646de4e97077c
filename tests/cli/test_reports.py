"""report.html and compare.html as pages for people."""

import base64
import json
import os
import re
import signal
import struct

from support import CommandTest


class Report(CommandTest):
    def page(self):
        return (self.dir / "out/report.html").read_text()

    def test_opens_with_a_verdict_in_words(self):
        def long(scene):
            scene["duration_s"] = 6
            scene["simulator"] = {"mode": "impulse"}

        self.succeed("simulate", self.write_scene(long), "-o", "out")
        page = self.page()
        self.assertIn("<b class=\"head\">At rest and sound</b>", page)
        self.assertIn("All 8 bodies are at rest at the end", page)
        self.assertLess(page.index("At rest and sound"), page.index("<h2>"))
        self.assertIn("<title>boxes, impulse mode</title>", page)

    def test_of_a_run_that_is_too_short_says_what_to_do(self):
        self.succeed("simulate", self.write_scene(), "-o", "out")
        self.assertIn("8 of 8 bodies still move at the end", self.page())
        self.assertIn("Still moving", self.page())

    def test_figures_are_rounded_and_fit_a_phone(self):
        self.succeed("simulate", self.write_scene(), "-o", "out")
        page = re.sub(r"<svg.*?</svg>|<style>.*?</style>|<code>.*?</code>", "", self.page(), flags=re.S)
        self.assertIsNone(re.search(r"\d\.\d{7,}", page))
        self.assertIn('name="viewport"', page)
        self.assertEqual(page.count("<table"), page.count('<div class="wide"><table'))

    def test_of_a_comparison_figures_are_rounded_and_tables_and_charts_scroll_by_themselves(self):
        modes = "impulse@1/120,particle@1/60"
        self.succeed("compare", self.write_scene(), "-o", "cmp", "--modes", modes, "--runs", "3")
        page = (self.dir / "cmp/compare.html").read_text()
        self.assertIn("particle<wbr>@1/60</th>", page)
        self.assertIn("(D/T)&sup2;", page)
        self.assertEqual(page.count("<svg"), page.count('<div class="wide chart"><'))
        self.assertEqual(page.count("<table"), page.count('class="wide"><table') + page.count('class="wide modes"><table'))
        height = {word: float(re.search(r'translate\([\d.]+,([\d.]+)\)"[^>]*>\s*<text>(<tspan[^>]*>)?' + word, page)[1])
                  for word in ("largest error", "nothing better")}
        self.assertGreater(height["nothing better"], height["largest error"] + 16)
        text = re.sub(r"<svg.*?</svg>|<style>.*?</style>|<code>.*?</code>", "", page, flags=re.S)
        self.assertIsNone(re.search(r"\d\.\d{7,}", text))

    def test_names_the_joints_that_broke(self):
        def hang(scene):
            scene["simulator"] = {"mode": "impulse"}
            scene["bodies"] += [{"name": "lamp", "shape": "box", "material": "wood", "position": [5, 3, 5]},
                                {"name": "sign", "shape": "box", "material": "wood", "position": [8, 3, 5]}]
            scene["joints"] = [{"type": "ball", "a": "sign", "point": [8, 4, 5]},
                               {"type": "ball", "a": "lamp", "point": [5, 4, 5], "breaking_force_n": 0.001}]

        self.succeed("simulate", self.write_scene(hang), "-o", "out")
        report = json.loads((self.dir / "out/report.json").read_text())
        self.assertEqual(report["joints"], {"count": 2, "broken": 1, "breaks": [
            {"joint": "/joints/1", "a": "lamp", "b": "world", "frame": 1, "time_s": 1 / 30}]})
        self.assertIn("<h2>Joints</h2>", self.page())
        self.assertIn("<td>/joints/1</td><td>lamp</td><td>world</td>", self.page())

    def pictures(self, file="out/report.html"):
        page = (self.dir / file).read_text()
        return [base64.b64decode(text) for text in re.findall(r'src="data:image/png;base64,([^"]*)"', page)]

    def test_opens_with_a_picture_of_the_end_as_render_draws_it(self):
        scene = self.write_scene()
        self.succeed("simulate", scene, "-o", "out", "--threads", 1)
        self.assertLess(self.page().index("<img"), self.page().index('<div class="verdict'))
        self.assertIn("<figcaption>The pile at its end</figcaption>", self.page())
        self.succeed("simulate", scene, "-o", "again", "--threads", 3)
        self.assertEqual(self.pictures(), self.pictures("again/report.html"))
        self.succeed("render", "out", "-o", "drawn", "--frames", "last", "--no-video")
        self.assertEqual(self.pictures(), [(self.dir / "drawn/frames/frame.0015.png").read_bytes()])

    def test_the_picture_is_small_and_has_the_shape_of_the_scenes(self):
        def tall(scene):
            scene["render"]["size"] = [1200, 2400]
            scene["duration_s"] = 0.1

        self.succeed("simulate", self.write_scene(tall), "-o", "out")
        [picture] = self.pictures()
        self.assertEqual(struct.unpack(">II", picture[16:24]), (424, 848))

    def test_a_picture_that_cannot_be_drawn_is_told_of_and_the_run_is_whole(self):
        scene = self.write_scene()
        reasons = {"OSMesa made no OpenGL": {"MESA_GL_VERSION_OVERRIDE": "2.0"}, "drawing it crashes": {"GALLIUM_DRIVER": "none"}}
        for reason, change in reasons.items():
            result = self.succeed("simulate", scene, "-o", "out", "--force", env={**os.environ, **change})
            self.assertIn("warning: report.html lacks a picture of the pile: " + reason, result.stderr)
        self.assertIn("No picture yet: <code>pilesim render --frames last</code> puts one here", self.page())
        result = self.succeed("simulate", scene, "-o", "out", "--resume")
        self.assertIn("nothing was left to do", result.stdout)
        self.assertEqual(len(self.pictures()), 1)

    def test_of_an_interrupted_run_and_of_a_finished_one_there_is_a_picture_too(self):
        struck = self.at_change("simulate", signal.SIGINT, 3, "/timing.csv")
        self.expect_exit(130, "simulate", self.write_scene(), "-o", "out", env=struck)
        self.assertEqual(len(self.pictures()), 1)
        self.succeed("simulate", self.write_scene(), "-o", "out", "--force")
        self.succeed("finish", "out", "-o", "sound")
        self.assertEqual(len(self.pictures("sound/report.html")), 1)

    def test_render_puts_a_better_picture_of_the_end_there_and_none_of_other_frames(self):
        self.succeed("simulate", self.write_scene(), "-o", "out", "--no-picture")
        self.assertEqual(self.pictures(), [])
        self.succeed("render", "out", "--frames", "3-5", "--no-video")
        self.assertEqual(self.pictures(), [])
        for size in ("80x60", "96x72"):
            self.succeed("render", "out", "--frames", "13-last", "--no-video", "--force", "--size", size)
            self.assertEqual(self.pictures(), [(self.dir / "out/frames/frame.0015.png").read_bytes()])
            self.assertNotIn("No picture yet", self.page())
            self.assertIn("<figcaption>The pile at its end</figcaption>", self.page())
        best = self.pictures()
        self.succeed("render", "out", "--frames", "last", "--no-video", "--force", "--size", "2000x1200")
        self.succeed("render", "out", "--compare-with", "out", "--frames", "last", "--no-video", "--force")
        self.assertEqual(self.pictures(), best)

    def test_a_comparison_opens_with_a_picture_of_each_mode_by_the_scenes_camera(self):
        def above(scene):
            scene["camera"] = {"position": [0, 9, 0.1], "target": [0, 0, 0]}

        modes = "impulse@1/120,particle@1/60"
        arguments = ("compare", self.write_scene(above), "--modes", modes, "--runs", "3")
        self.succeed(*arguments, "-o", "cmp")
        page = (self.dir / "cmp/compare.html").read_text()
        self.assertLess(page.rindex("<img"), page.index('<div class="verdict'))
        pictures = self.pictures("cmp/compare.html")
        self.assertEqual(len(pictures), 3)  # the reference is one of them
        for mode, picture in zip(("impulse", "impulse_1_120", "particle_1_60"), pictures):
            run = next(self.dir.glob(f"cmp/runs/{mode}/seed3"))
            self.assertIn("No picture yet", (run / "report.html").read_text())
            self.succeed("render", run, "-o", mode, "--frames", "last", "--no-video")
            self.assertEqual(picture, (self.dir / mode / "frames/frame.0015.png").read_bytes())
        result = self.succeed(*arguments, "-o", "blind", env={**os.environ, "GALLIUM_DRIVER": "none"})
        self.assertIn("compare.html lacks a picture of the pile: ", result.stderr)
        self.assertEqual(self.pictures("blind/compare.html"), [])
