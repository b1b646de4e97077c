"""The page of pilesim view: what it holds, and what a browser makes of it where there is one."""

import base64
import json
import re
import shutil
import struct
import subprocess
import tempfile
import unittest
import zlib

import numpy
import zarr

from png_reader import read_png
from support import BOX_OBJ, HANGING, CommandTest
from test_export import WEDGE_OBJ, add_wedges, png, textured_wedge

CHROMIUM = shutil.which("chromium")


class Page:
    """Reads what page_data.js reads, from the description of the format."""

    def __init__(self, html):
        self.about = json.loads(re.search(r'id="about-json">(.*?)</script>', html, re.S)[1])
        data = re.search(r'id="data">(.*?)</script>', html, re.S)[1]
        self.bytes = zlib.decompress(base64.b64decode(data, validate=True))
        self.at = 0
        self.names = self.json()
        self.signs = self.json()
        self.meshes = []
        for mesh in self.about["meshes"]:
            count = mesh["vertices"]
            points = self.take("f4", 3 * count).reshape(-1, 3)
            self.take("i1", 4 * count)
            paint = self.take("u1", 4 * count * mesh["is_painted"]).reshape(-1, 4)
            places = self.take("f4", 2 * count * mesh["is_textured"]).reshape(-1, 2)
            levels = [self.take("u4", corners) for corners in mesh["levels"]]
            self.meshes.append((points, paint, places, levels, mesh["runs"]))
        n = self.about["bodies"]
        self.id, self.shape = self.take("u4", n), self.take("u4", n)
        self.colour = self.take("u1", 4 * n).reshape(n, 4)
        self.surface = self.take("u1", 4 * n).reshape(n, 4)
        self.pattern = self.take("f4", 2 * n).reshape(n, 2)
        self.low, self.step = self.take("f4", 3 * n).reshape(n, 3), self.take("f4", n)
        keys, changes = self.take("u4", n), self.take("u4", n)
        self.first = numpy.concatenate([[0], numpy.cumsum(keys)]).astype(int)
        self.first_change = numpy.concatenate([[0], numpy.cumsum(changes)]).astype(int)
        self.frame = self.take("u4", keys.sum())
        channels = [self.channel(keys) for _ in range(7)]
        self.place = numpy.stack(channels[:3], 1).astype(float)
        self.turn = numpy.stack(channels[3:], 1).astype("u2").view("i2") / 8191
        self.change_frame, self.change_state = self.take("u4", changes.sum()), self.take("u1", changes.sum())
        overlaps = self.about["overlaps"]
        moments = len(overlaps["frames"])
        self.depth = self.take("u2", n * moments).reshape(n, moments) / overlaps["units"]
        self.pictures = [self.take("u1", size).tobytes() for size in self.about["pictures"]]
        assert self.at == len(self.bytes)

    def take(self, kind, count):
        values = numpy.frombuffer(self.bytes, "<" + kind, int(count), self.at)
        self.at += values.nbytes
        return values

    def json(self):
        (length,) = struct.unpack_from("<I", self.bytes, self.at)
        self.at += 4 + length
        return json.loads(self.bytes[self.at - length : self.at])

    def channel(self, keys):
        total = keys.sum()
        low, high = self.take("u1", total), self.take("u1", total)
        change = low.astype("u2") + 256 * high.astype("u2")
        parts = numpy.split(change, numpy.cumsum(keys)[:-1])
        return numpy.concatenate([p.cumsum(dtype="u2").cumsum(dtype="u2") for p in parts])

    def pose(self, body, frame):
        part = slice(self.first[body], self.first[body + 1])
        place = [numpy.interp(frame, self.frame[part], self.place[part, i]) for i in range(3)]
        turn = [numpy.interp(frame, self.frame[part], self.turn[part, i]) for i in range(4)]
        return self.low[body] + self.step[body] * numpy.array(place), turn / numpy.linalg.norm(turn)

    def state(self, body, frame):
        part = slice(self.first_change[body], self.first_change[body + 1])
        return self.change_state[part][self.change_frame[part] <= frame][-1]


class View(CommandTest):
    def setUp(self):
        super().setUp()
        self.succeed("simulate", self.write_scene(lambda scene: None), "-o", "out/a")
        self.store = zarr.open(str(self.dir / "out/a/trajectory.zarr"), mode="r")

    def page(self, *options):
        self.succeed("view", "out/a", "-o", "page.html", "--force", *options)
        return Page((self.dir / "page.html").read_text())

    def test_has_the_poses_of_the_trajectory(self):
        page = self.page()
        self.assertEqual(page.about["frames"], self.store["position"].shape[0])
        self.assertEqual(sorted(page.id), list(range(9)))
        for body, number in enumerate(page.id):
            self.assertEqual(page.names[body], self.store.attrs["body_name"][number])
            for frame in range(page.about["frames"]):
                place, turn = page.pose(body, frame)
                self.assertLess(abs(place - self.store["position"][frame, number]).max(), 1e-4)
                w, *xyz = self.store["orientation"][frame, number]
                self.assertGreater(abs(turn @ [*xyz, w]), 1 - 1e-6)
                self.assertEqual(page.state(body, frame), self.store["state"][frame, number])

    def test_needs_nothing_else(self):
        self.page()
        html = (self.dir / "page.html").read_text()
        for outside in ("http://", "https://", "<link", "src=", "import(", "fetch("):
            self.assertNotIn(outside, html)

    def test_of_many_bodies_shows_some_and_says_so(self):
        page = self.page("--bodies", "3")
        self.assertEqual(sum(page.colour[:, 3]), 3)
        self.assertIn("Shows 3 of 8 bodies", page.about["thinned"])
        self.assertEqual(self.page().about["thinned"], "")

    def test_frames_keep_their_times(self):
        page = self.page("--frames", "4-12x2")
        self.assertEqual((page.about["frames"], page.about["first_frame"], page.about["every"]), (5, 4, 2))
        self.assertAlmostEqual(page.about["first_s"], 4 / 30)
        self.assertAlmostEqual(page.about["frame_rate"], 15)

    def test_has_how_deep_bodies_are_in_each_other(self):
        def overlapping(scene):
            scene["emitters"][0].update(centre=[0, 0.1, 0], count=[2, 1, 1], spacing=[0.14, 1, 1],
                                        orientation=[1, 0, 0, 0], asleep=True)
            scene["bodies"].append({"name": "falls", "shape": "box", "material": "wood", "position": [3, 1, 0]})

        self.succeed("simulate", self.write_scene(overlapping), "-o", "out/a", "--force")
        page = self.page("--overlaps")
        diameter = 0.2 * 3**0.5
        self.assertAlmostEqual(page.about["overlaps"]["diameter_m"], diameter)
        self.assertEqual(page.about["overlaps"]["frames"], list(range(page.about["frames"])))
        for body, number in enumerate(page.id):
            deep = 0.06 / diameter if page.names[body].startswith("boxes") else 0
            self.assertLess(abs(page.depth[body, :10] - deep).max(), 1e-4, page.names[body])
        # For the others only shown bodies, at the shown frames.
        self.assertEqual(self.page("--overlaps", "--frames", "4-12x2", "--only", "falls").depth.tolist(), [[0] * 5])
        self.assertEqual(self.page().depth.size, 0)

    def test_has_the_glue_of_a_guided_pile_while_it_holds(self):
        def leaning(scene):
            scene.update(duration_s=0.3, guide={"file": "guide.obj"})
            scene["emitters"] = [{"name": "boxes", "type": "mould", "shape": "box", "material": "wood"}]

        (self.dir / "guide.obj").write_text(re.sub(r"v (\S+) 0.9", lambda m: f"v {float(m[1]) + 0.8} 0.9", BOX_OBJ))
        self.succeed("direct-pile", self.write_scene(leaning), "-o", "out/a", "--force")
        written = json.loads((self.dir / "out/a/guide.json").read_text())["glue"]
        self.assertGreater(len(written), 10)
        signs = self.page().signs
        self.assertNotIn("constraints", signs)  # none is held but by glue
        self.assertEqual(len(signs["glue"]), len(written))
        for (a, b, *arm, begins, ends), pair in zip(signs["glue"], written):
            self.assertEqual((a, b), (pair["a"], -1 if pair["b_stands"] else pair["b"]))
            self.assertEqual(arm, pair["arm"])
            self.assertAlmostEqual(begins, 30 * pair["from_s"], 3)
            self.assertAlmostEqual(ends or -1, 30 * pair.get("until_s", -1 / 30), 3)
        # For a page that begins later, in its own frames.
        later = self.page("--frames", "2-9x2").signs["glue"]
        self.assertEqual(later[0][5], 0)
        if CHROMIUM:
            shown = self.shown_when_drawn("page.html#frame=3")
            self.assertNotIn("data-fault", shown)
            self.assertIn("Glue</label>", shown)

    def simulate_painted(self, change=lambda scene: None):
        """A wedge with a picture on one triangle, one in a plain colour. Returns the picture's pixels."""
        pixels = textured_wedge(self.dir)

        def painted(scene):
            add_wedges(scene)
            scene["bodies"][-1]["colour"] = "#00ff00"
            change(scene)

        self.succeed("simulate", self.write_scene(painted), "-o", "out/a", "--force")
        self.store = zarr.open(str(self.dir / "out/a/trajectory.zarr"), mode="r")
        return pixels

    def test_has_the_colours_and_pictures_of_meshes(self):
        pixels = self.simulate_painted()
        page = self.page()
        falling, leaning = (page.names.index(name) for name in ("falling wedge", "leaning wedge"))
        self.assertEqual([page.surface[falling, 2], page.surface[leaning, 2], sum(page.surface[:, 2])], [1, 0, 1])
        shape = page.shape[falling]
        points, paint, places, levels, runs = page.meshes[shape]
        self.assertFalse(any(mesh[1].size or mesh[2].size for i, mesh in enumerate(page.meshes) if i != shape))
        (picture,) = page.pictures
        (self.dir / "picture.png").write_bytes(picture)
        self.assertEqual(read_png(self.dir / "picture.png"), (2, 2, pixels.tolist()))
        store = self.store[f"shapes/{shape}"]
        (textured,) = numpy.flatnonzero(store["texture"][:])
        expected = {(*place.round(5), *uv.round(5)) for place, uv in zip(
            store["vertices"][:][store["triangles"][textured]], store["uv"][textured])}
        for corners, of_level in zip(levels, runs):
            self.assertEqual(of_level, [[0, 15], [1, 3]])
            self.assertTrue((paint[corners[:15], :3] == [255, 0, 0]).all())
            self.assertEqual({(*points[i].round(5), *places[i].round(5)) for i in corners[15:]}, expected)
        # Where no body shows them they are not there.
        page = self.page("--only", "leaning wedge")
        self.assertEqual((page.pictures, page.meshes[shape][1].size), ([], 0))

    def test_large_pictures_are_shrunk_and_it_says_so(self):
        textured_wedge(self.dir)
        (self.dir / "four.png").write_bytes(png(numpy.full((2, 1500, 3), (9, 99, 200), numpy.uint8)))
        self.succeed("simulate", self.write_scene(add_wedges), "-o", "out/a", "--force")
        page = self.page()
        (self.dir / "picture.png").write_bytes(page.pictures[0])
        self.assertEqual(read_png(self.dir / "picture.png"), (1024, 1, [[[9, 99, 200]] * 1024]))
        self.assertTrue(any("at most 1,024 texels" in line for line in page.about["lines"]))

    def test_has_how_bodies_shine(self):
        def glossy(scene):
            scene["materials"]["wood"].update(roughness=0.2, clear_coat=0.6)

        self.succeed("simulate", self.write_scene(glossy), "-o", "out/a", "--force")
        page = self.page()
        for body, name in enumerate(page.names):
            self.assertEqual(page.surface[body].tolist(), [255, 0, 0, 128] if name == "ground" else [51, 153, 0, 225])

    def test_has_what_bodies_are_made_of_their_patterns_and_the_light(self):
        def ground_of_planks(scene):
            scene["materials"]["wood"].update(look="glass", roughness=0.5)
            scene["materials"]["floor"] = {"look": "wood", "pattern_m": 0.5}
            scene["bodies"][0]["material"] = "floor"
            scene["render"] = {"exposure": 1, "light": {"name": "dark", "azimuth_deg": 90, "elevation_deg": 30}}

        self.succeed("simulate", self.write_scene(ground_of_planks), "-o", "out/a", "--force")
        page = self.page()
        for body, name in enumerate(page.names):
            self.assertEqual(page.pattern[body].tolist(), [3, 0.5] if name == "ground" else [0, 0.25])
            # The kind of clear bodies is 65 + 10 + roughness in ninths.
            self.assertEqual(page.surface[body, 3], 128 if name == "ground" else 80)
        light = page.about["light"]
        self.assertEqual(light["exposure"], 2)
        self.assertLess(max(abs(a - b) for a, b in zip(light["to_sun"], (0.75**0.5, 0.5, 0))), 1e-6)
        self.assertLess(max(light["zenith"]), 0.05)

    def test_overlaps_need_the_scene(self):
        (self.dir / "scene.json").rename(self.dir / "moved.json")
        self.succeed("view", "out/a", "--overlaps", "--scene", "moved.json")
        (self.dir / "out/a/checkpoint.bin").unlink()
        result = self.expect_exit(3, "view", "out/a", "--overlaps", "--force")
        self.assertIn("--scene", result.stderr)
        self.expect_exit(2, "view", "out/a", "--scene", "moved.json", "--force")

    def test_names_that_are_markup_stay_text(self):
        def named(scene):
            scene["name"] = "</script><b>&"

        self.succeed("simulate", self.write_scene(named), "-o", "out/b")
        self.succeed("view", "out/b")
        html = (self.dir / "out/b/view.html").read_text()
        self.assertNotIn("</script><b>", html)
        self.assertEqual(Page(html).about["title"], "</script><b>&")

    def test_refuses_a_page_that_is_there(self):
        self.succeed("view", "out/a")
        result = self.run_pilesim("view", "out/a")
        self.assertEqual(result.returncode, 2)
        self.assertIn("--force", result.stderr)
        self.succeed("simulate", self.dir / "scene.json", "-o", "out/a", "--force")
        self.assertFalse((self.dir / "out/a/view.html").exists())

    def shown_by_browser(self, page, budget_ms):
        with tempfile.TemporaryDirectory() as profile:
            return subprocess.run(
                [CHROMIUM, "--headless", "--no-sandbox", "--no-zygote", "--in-process-gpu", "--use-gl=angle",
                 "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-dev-shm-usage",
                 f"--user-data-dir={profile}", "--window-size=390,844", f"--virtual-time-budget={budget_ms}",
                 "--dump-dom", f"file://{self.dir}/{page}"],
                capture_output=True, text=True, timeout=HANGING,
            ).stdout  # fmt: skip

    def shown_when_drawn(self, page, sign="data-drawn="):
        # Time in the page is not the clock's: what it unpacks in other threads may take longer.
        for budget in (1000, 4000, 16000, 64000):
            shown = self.shown_by_browser(page, budget)
            if sign in shown:
                break
        return shown

    @unittest.skipUnless(CHROMIUM, "chromium is not installed")
    def test_on_a_phone_nothing_lies_over_a_long_title(self):
        def named(scene):
            scene["name"] = "Boxes that fall, in a scene whose name is longer than a phone is wide"

        self.succeed("simulate", self.write_scene(named), "-o", "out/a", "--force")
        self.page("--bodies", "3")
        page = self.dir / "page.html"
        measure = """<script>setInterval(() => {
            if (!document.documentElement.dataset.drawn) return;
            parent.postMessage(["#about", "#show", "#bar"].flatMap((name) => {
              const box = document.querySelector(name).getBoundingClientRect();
              return [box.left, box.top, box.right, box.bottom];
            }), "*");
          }, 50)</script>"""
        page.write_text(page.read_text().replace("</body>", measure + "</body>"))
        # Windows are 500 pixels wide at least.
        (self.dir / "phone.html").write_text("""<iframe src="page.html#frame=7&colours=speed" style="width: 390px; height: 844px; border: 0">
            </iframe><script>onmessage = (told) => { document.documentElement.dataset.drawn = told.data; }</script>""")
        shown = self.shown_when_drawn("phone.html")
        places = [float(number) for number in re.search(r'data-drawn="([^"]*)"', shown)[1].split(",")]
        about, show, bar = places[:4], places[4:8], places[8:]
        self.assertGreater(about[3] - about[1], 100)
        for above, below in ((about, show), (show, bar)):
            self.assertGreater(below[1], above[3])
        for left, _, right, _ in (about, show, bar):
            self.assertGreater(left, 0)
            self.assertLess(right, 390)

    @unittest.skipUnless(CHROMIUM, "chromium is not installed")
    def test_a_browser_shows_the_pictures(self):
        """Stripes of red and blue, where in the mean colour all would be one purple; by speed it is none of these."""

        def near(scene):
            scene["emitters"] = []
            scene["bodies"] = scene["bodies"][:2]
            scene["camera"] = {"position": [3, 1, 1.6], "target": [3, 1, 0]}

        self.simulate_painted(near)
        head, _, faces = WEDGE_OBJ.partition("f ")
        faces = ("f " + faces).strip().split("\n")
        (self.dir / "wedge.obj").write_text(
            f"mtllib t.mtl\n{head}vt 0 0\nvt 4 0\nvt 0 4\nusemtl t\n"
            + "\n".join("f " + " ".join(f"{v}/{i}" for i, v in enumerate(f.split()[1:], 1)) for f in faces))
        (self.dir / "four.png").write_bytes(png(numpy.array([[[255, 0, 0]] * 8 + [[0, 0, 255]] * 8] * 16, numpy.uint8)))
        self.succeed("simulate", self.dir / "scene.json", "-o", "out/a", "--force")
        self.page()
        page = self.dir / "page.html"
        measure = """<script>setInterval(() => {
            if (!document.documentElement.dataset.drawn || !window.page) return;
            const { renderer } = window.page, { gl, canvas } = renderer;
            renderer.draw(window.page.view(), window.page.scene, []);
            const seen = new Uint8Array(4 * canvas.width * canvas.height);
            gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, seen);
            let red = 0, blue = 0;
            for (let i = 0; i < seen.length; i += 4) {
              if (seen[i] > 2 * seen[i + 2] + 20) ++red;
              if (seen[i + 2] > 2 * seen[i] + 20) ++blue;
            }
            document.documentElement.dataset.seen = red + " " + blue;
          }, 50)</script>"""
        page.write_text(page.read_text().replace("</body>", measure + "</body>"))
        for colours, is_shown in (("body", True), ("speed", False)):
            shown = self.shown_when_drawn(f"page.html#frame=0&colours={colours}", "data-seen=")
            self.assertNotIn("data-fault", shown)
            red, blue = (int(count) for count in re.search(r'data-seen="(\d+) (\d+)"', shown).groups())
            self.assertEqual(red > 100 and blue > 100, is_shown, (colours, red, blue))

    @unittest.skipUnless(CHROMIUM, "chromium is not installed")
    def test_plays_in_a_browser(self):
        self.page("--overlaps")
        shown = self.shown_when_drawn("page.html#frame=7&body=3&colours=overlap")
        self.assertIn('data-drawn="7"', shown)
        self.assertNotIn("data-fault", shown)
        self.assertIn(f"<h2>{self.store.attrs['body_name'][3]}</h2>", shown)
        for axis, value in zip("xyz", self.store["position"][7, 3]):
            self.assertIn(f"<dt>{axis}</dt><dd>{round(value, 3) + 0.0:.3f} m</dd>", shown)
        self.assertIn("<dt>Overlap</dt><dd>0 mm, 0 %</dd>", shown)
        self.assertIn("<span>2 %</span><span>8 %</span>", shown)
