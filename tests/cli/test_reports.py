"""report.html and compare.html as pages for people."""

import base64
import re

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
        text = re.sub(r"<svg.*?</svg>|<style>.*?</style>|<code>.*?</code>", "", page, flags=re.S)
        self.assertIsNone(re.search(r"\d\.\d{7,}", text))

    def test_render_puts_its_last_picture_there(self):
        self.succeed("simulate", self.write_scene(), "-o", "out")
        self.assertIn("none yet", self.page())
        for frames in ("3-5", "7-9"):
            self.succeed("render", "out", "--frames", frames, "--no-video", "--force")
            pictures = re.findall(r'src="data:image/png;base64,([^"]*)"', self.page())
            self.assertEqual(len(pictures), 1)
            last = (self.dir / f"out/frames/frame.000{frames[-1]}.png").read_bytes()
            self.assertEqual(base64.b64decode(pictures[0]), last)
            self.assertNotIn("none yet", self.page())
            self.assertIn(f"<figcaption>The pile at {'167 ms' if frames == '3-5' else '300 ms'}</figcaption>", self.page())
        self.succeed("render", "out", "--frames", "last", "--no-video", "--force")
        self.assertIn("<figcaption>The pile at its end</figcaption>", self.page())
