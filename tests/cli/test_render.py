"""render: pictures and videos of a trajectory, and what happens when something is missing."""

import json
import os
import shutil
import subprocess
import unittest

import numpy

from png_reader import read_png
from support import CommandTest, tree_bytes


def png_size(path):
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    return int.from_bytes(data[16:20], "big"), int.from_bytes(data[20:24], "big")


def probe(path):
    result = subprocess.run(
        ["ffprobe", "-v", "error", "-select_streams", "v:0", "-count_frames", "-of", "json"]
        + ["-show_entries", "stream=width,height,r_frame_rate,nb_read_frames,codec_name", path],
        capture_output=True,
        text=True,
        check=True,
    )
    return json.loads(result.stdout)["streams"][0]


class Render(CommandTest):
    def setUp(self):
        super().setUp()
        self.succeed("simulate", self.write_scene(), "-o", "out")

    def test_frames_and_video(self):
        result = self.succeed("render", "out")
        self.assertIn("16 frames", result.stdout)
        frames = sorted(path.name for path in (self.dir / "out/frames").iterdir())
        self.assertEqual(frames, [f"frame.{i:04d}.png" for i in range(16)])
        self.assertEqual(png_size(self.dir / "out/frames/frame.0000.png"), (64, 48))
        video = probe(self.dir / "out/video.mp4")
        self.assertEqual(video["codec_name"], "h264")
        self.assertEqual((video["width"], video["height"]), (64, 48))
        self.assertEqual(video["r_frame_rate"], "30/1")
        self.assertEqual(video["nb_read_frames"], "16")

    def test_selected_frames_play_at_the_right_speed(self):
        self.succeed("render", "out", "--frames", "1-15x2")
        frames = sorted(path.name for path in (self.dir / "out/frames").iterdir())
        self.assertEqual(frames, [f"frame.{i:04d}.png" for i in range(1, 16, 2)])
        self.assertEqual(probe(self.dir / "out/video.mp4")["r_frame_rate"], "15/1")

    def test_listed_frames(self):
        self.succeed("render", "out", "--frames", "last,3,0.2s,3-5", "--no-video")
        frames = sorted(path.name for path in (self.dir / "out/frames").iterdir())
        self.assertEqual(frames, [f"frame.{i:04d}.png" for i in (3, 4, 5, 6, 15)])
        self.succeed("render", "out", "--frames", "0,3,9", "-o", "uneven")
        video = probe(self.dir / "uneven/video.mp4")
        self.assertEqual((video["r_frame_rate"], video["nb_read_frames"]), ("10/1", "3"))
        for wrong in ("3,", ",3", "3,,4", "3, 4"):
            self.expect_exit(2, "render", "out", "--frames", wrong, "--no-video", "-o", "none")
        self.assertIn("'x'", self.expect_exit(2, "render", "out", "--frames", "1,x").stderr)

    def test_two_side_by_side(self):
        self.succeed("simulate", self.write_scene(), "-o", "short", "--set", "/duration_s=0.2")
        self.succeed("render", "out", "--compare-with", "short", "-o", "both")
        frames = sorted(path.name for path in (self.dir / "both/frames").iterdir())
        self.assertEqual(frames, [f"frame.{i:04d}.png" for i in range(7)])
        width, height = png_size(self.dir / "both/frames/frame.0000.png")
        self.assertGreater(width, 2 * 64)
        self.assertEqual(height, 48)
        self.assertEqual(probe(self.dir / "both/video.mp4")["width"], width)
        self.succeed("render", "out", "--compare-with", "short", "-o", "both", "--sheet", "2x1")
        self.assertGreater(png_size(self.dir / "both/sheet.png")[0], 4 * 64)

    def test_side_by_side_at_another_frame_rate(self):
        self.succeed("simulate", self.write_scene(), "-o", "slow", "--set", "/frame_rate=15")
        result = self.expect_exit(3, "render", "out", "--compare-with", "slow", "-o", "both")
        self.assertIn("frame_rate", result.stderr)
        self.assertFalse((self.dir / "both").exists())

    def test_odd_sizes(self):
        self.succeed("render", "out", "--size", "63x47", "--frames", "0-3")
        self.assertEqual(png_size(self.dir / "out/frames/frame.0001.png"), (63, 47))
        video = probe(self.dir / "out/video.mp4")
        self.assertEqual((video["width"] % 2, video["height"] % 2), (0, 0))

    def test_size_beside_overrides(self):
        self.succeed("render", "out", "--size", "63x47", "--frames", "0-1", "--no-video",
                     "--set", "/render/samples=1", "-o", "sized")
        self.assertEqual(png_size(self.dir / "sized/frames/frame.0001.png"), (63, 47))

    def test_frames_up_to_the_end(self):
        self.succeed("render", "out", "--frames", "13-")
        frames = sorted(path.name for path in (self.dir / "out/frames").iterdir())
        self.assertEqual(frames, [f"frame.{i:04d}.png" for i in (13, 14, 15)])

    def test_frames_from_the_end_and_by_time(self):
        for text, expected in (
            ("last", [15]), ("-1", [15]), ("-3", [13]), ("-2-", [14, 15]), ("0.1s", [3]),
            ("0.4s-last", [12, 13, 14, 15]), ("0s--9x3", [0, 3, 6]), ("12-0.5sx2", [12, 14]),
        ):
            self.succeed("render", "out", "--frames", text, "--no-video", "-o", "some", "--force")
            frames = sorted(path.name for path in (self.dir / "some/frames").iterdir())
            self.assertEqual(frames, [f"frame.{i:04d}.png" for i in expected], text)

    def test_frames_that_are_not_there(self):
        for text, word in (("-17", "before 0-15"), ("0.6s", "0.5s"), ("16", "within 0-15"),
                           ("last-3", "before 15"), ("0.4s-0.2s", "before 12"), ("-0", "last"),
                           ("2.5", "last"), ("lasts", "last"), ("3s4", "last")):
            result = self.expect_exit(2, "render", "out", f"--frames={text}", "-o", "none")
            self.assertIn(word, result.stderr, text)
        self.assertFalse((self.dir / "none").exists())

    def test_sizes_out_of_range(self):
        for size in ("1x1", "99999x10", "16x15"):
            result = self.expect_exit(3, "render", "out", "--size", size)
            self.assertIn("16384", result.stderr)
        self.assertFalse((self.dir / "out/frames").exists())

    def test_pictures_beyond_all_memory_are_refused_at_once(self):
        for size in ("16384x16384", "10000x10000"):
            result = self.expect_exit(3, "render", "out", "--size", size, "--samples", "8")
            self.assertIn(f"--size {size}: is {size.replace('x', ' x ')}, ", result.stderr)
            self.assertIn("67108864 pixels", result.stderr)
        result = self.expect_exit(2, "render", "out", "--size", "8192x8192", "--sheet", "4x2")
        self.assertIn("--sheet", result.stderr)
        arguments = ("render", "out", "--size", "16384x64", "--compare-with", "out", "-o", "both")
        self.assertIn("--no-video", self.expect_exit(2, *arguments).stderr)
        self.assertFalse((self.dir / "out/frames").exists())
        self.assertFalse((self.dir / "both").exists())

    def test_samples_that_cannot_be_drawn(self):
        for samples in ("0", "-1", "65537"):
            result = self.expect_exit(2, "render", "out", "--samples", samples)
            self.assertIn(f"--samples: '{samples}' is not a", result.stderr)
        for samples in ("0", "3", "16", "-1"):
            override = f"/render/samples={samples}"
            arguments = [["--set", override]]
            if samples in ("3", "16"):
                arguments += [["--samples", samples], ["--samples", samples, "--renderer", "raster"]]
            for given in arguments:
                result = self.expect_exit(3, "render", "out", *given)
                self.assertIn(f"{given[0]} {given[1]}: ", result.stderr)
                self.assertIn("1, 2, 4, 8", result.stderr)

    def test_exposure_brightens_pictures(self):
        for renderer in ("raster", "rays"):
            light = []
            for stops in (-1, 0, 1):
                self.succeed("render", "out", "--frames", "last", "--no-video", "--renderer", renderer,
                             "--samples", "1", "--set", f"/render/exposure={stops}", "-o", f"{renderer}{stops}")
                light.append(numpy.mean(read_png(self.dir / f"{renderer}{stops}/frames/frame.0015.png")[2]))
            self.assertGreater(light[1], 1.1 * light[0], renderer)
            self.assertGreater(light[2], 1.1 * light[1], renderer)

    def picture(self, run, *options):
        self.succeed("render", run, "-o", "drawn", "--frames", "last", "--no-video", "--force", *options)
        return (self.dir / "drawn/frames/frame.0015.png").read_bytes()

    def test_a_light_by_name_is_that_light_whatever_the_run_has_stored(self):
        def lit(light):
            return lambda scene: scene["render"].update(light=light)

        self.succeed("simulate", self.write_scene(lit({"sun": 4, "azimuth_deg": 10})), "-o", "stored")
        self.succeed("simulate", self.write_scene(lit({"name": "evening"})), "-o", "evening")
        self.assertEqual(self.picture("stored", "--set", "/render/light/name=evening"), self.picture("evening"))
        self.assertNotEqual(self.picture("stored"), self.picture("evening"))

    def test_a_sky_lies_beside_the_scene_or_beside_the_run(self):
        def sky(light):
            return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n" + bytes((light, light, light, 128)) * 128

        def with_sky(scene):
            scene["render"]["light"] = {"sky_file": "sky.hdr"}

        (self.dir / "sky.hdr").write_bytes(sky(128))
        self.succeed("simulate", self.write_scene(with_sky), "-o", "runs/sky")
        for renderer in ("raster", "rays"):
            self.assertNotEqual(self.picture("runs/sky", "--renderer", renderer), self.picture("out", "--renderer", renderer))
        beside_scene = self.picture("runs/sky")
        (self.dir / "runs/sky/sky.hdr").write_bytes(sky(40))
        self.assertNotEqual(self.picture("runs/sky"), beside_scene)
        (self.dir / "runs/sky/sky.hdr").write_bytes(sky(40)[:99])
        broken = self.expect_exit(3, "render", "runs/sky", "-o", "none", "--frames", "last", "--no-video")
        self.assertIn("sky.hdr: /render/light/sky_file: is broken", broken.stderr)
        (self.dir / "runs/sky/sky.hdr").unlink()
        (self.dir / "sky.hdr").unlink()
        missing = self.expect_exit(4, "render", "runs/sky", "-o", "none", "--frames", "last", "--no-video")
        self.assertIn("sky.hdr", missing.stderr)
        self.assertFalse((self.dir / "none").exists())

    def test_an_orbit_turns_a_still_frame(self):
        self.succeed("render", "out", "--orbit", "0.2s", "-o", "turned", "--renderer", "raster")
        cameras = json.loads((self.dir / "turned/cameras.json").read_text())["frames"]
        self.assertEqual([camera["time_s"] for camera in cameras], [i / 30 for i in range(6)])
        self.assertEqual([camera["shows_frame"] for camera in cameras], [15] * 6)
        eyes = [-numpy.array(camera["R"]).T @ camera["t"] for camera in cameras]
        self.assertAlmostEqual(numpy.ptp([eye[1] for eye in eyes]), 0)  # at one height
        middle = numpy.mean(eyes, axis=0)
        radii = [numpy.linalg.norm(eye - middle) for eye in eyes]
        numpy.testing.assert_allclose(radii, radii[0])
        numpy.testing.assert_allclose(eyes[3] - middle, middle - eyes[0], atol=1e-9)  # half a turn
        video = probe(self.dir / "turned/video.mp4")
        self.assertEqual((video["r_frame_rate"], video["nb_read_frames"]), ("30/1", "6"))
        # It begins as the last frame is seen without it, and the others differ.
        self.succeed("render", "out", "--frames", "last", "--no-video", "-o", "last")
        turned = self.pictures("turned")
        self.assertEqual(turned["frame.0000.png"], self.pictures("last")["frame.0015.png"])
        self.assertEqual(len(set(turned.values())), 6)
        self.succeed("render", "out", "--orbit", "0.1s", "--frames", "0", "--no-video", "-o", "first")
        self.succeed("render", "out", "--frames", "0", "--no-video", "-o", "plain")
        self.assertEqual(self.pictures("first")["frame.0000.png"], self.pictures("plain")["frame.0000.png"])

    def test_a_sheet_of_an_orbit_bears_the_time_of_its_frame(self):
        # A turn of one picture is what is seen without it, under the same label.
        self.succeed("render", "out", "--orbit", "0.03s", "--sheet", "1x1", "-o", "turned")
        self.succeed("render", "out", "--frames", "last", "--sheet", "1x1", "-o", "last")
        self.assertEqual((self.dir / "turned/sheet.png").read_bytes(), (self.dir / "last/sheet.png").read_bytes())

    def test_an_orbit_is_of_one_frame_and_any_camera(self):
        result = self.expect_exit(2, "render", "out", "--orbit", "1s", "--frames", "0-3", "-o", "none")
        self.assertIn("--orbit: 4 frames are selected; expected one", result.stderr)
        for wrong in ("6", "0s", "-1s", "last", "4000s"):
            result = self.expect_exit(2, "render", "out", f"--orbit={wrong}", "-o", "none")
            self.assertIn("is not a time such as 6s", result.stderr, wrong)
        self.assertFalse((self.dir / "none").exists())
        camera = '/cameras=[{"name": "top", "view": {"position": [0, 4, 1], "target": [0, 0, 0]}}]'
        self.succeed("render", "out", "--orbit", "0.1s", "--camera", "all", "--set", camera, "-o", "all")
        for name in ("camera", "top"):
            self.assertTrue((self.dir / "all/cameras" / name / "video.mp4").exists())
            self.assertEqual(len(self.pictures(f"all/cameras/{name}")), 3)
        self.succeed("render", "out", "--orbit", "0.1s", "--renderer", "rays", "--quality", "preview", "--no-video",
                     "--set", "/render/rays/shutter=0.5", "-o", "rays")
        self.assertEqual(len(set(self.pictures("rays").values())), 3)

    def test_bodies_that_are_left_out(self):
        view = ("--frames", "last", "--no-video", "--set", '/camera={"position": [1, 2, 3], "target": [0, 0, 0]}')
        for renderer in ("raster", "rays"):
            drawn = {}
            for name, options in (("all", []), ("one", ["--only", "boxes/3", "--only", "ground"]),
                                  ("rest", ["--hide", "boxes/[!3]"]), ("none", ["--hide", "boxes/*"])):
                self.succeed("render", "out", *view, "--renderer", renderer, *options, "-o", f"{renderer}_{name}")
                drawn[name] = self.pictures(f"{renderer}_{name}")["frame.0015.png"]
            self.assertEqual(drawn["one"], drawn["rest"])
            self.assertEqual(len(set(drawn.values())), 3, renderer)
        result = self.expect_exit(2, "render", "out", "--hide", "boxs/*", "-o", "nothing")
        self.assertIn("--hide boxs/*: fits the name of no body", result.stderr)
        for nobody in (["--hide", "*"], ["--only", "boxes/3", "--hide", "boxes/3"]):
            result = self.expect_exit(2, "render", "out", *nobody, "-o", "nothing")
            self.assertIn("--hide: no body is left to be drawn", result.stderr)
        self.assertFalse((self.dir / "nothing").exists())
        # Ids of the passes know nothing of them either.
        instances = []
        for options in ([], ["--hide", "boxes/3"]):
            self.succeed("render", "out", *view, *options, "--annotations", "coco", "-o", "set", "--force")
            coco = json.loads((self.dir / "set/coco.json").read_text())
            instances.append({each["instance"] for each in coco["annotations"]})
        boxes_3 = 5  # bodies count from 1, the ground is the first
        self.assertEqual(instances[0] - instances[1], {boxes_3})

    def pictures(self, name):
        return {path.name: path.read_bytes() for path in (self.dir / name / "frames").iterdir()}

    def test_rays_draw_the_same_bytes_on_any_thread_and_in_any_range(self):
        rays = ("--renderer", "rays", "--samples", "3", "--no-video")
        rays += ("--set", "/render/rays/shutter=0.5")
        self.succeed("render", "out", *rays, "-o", "a", "--threads", "1")
        self.succeed("render", "out", *rays, "-o", "b", "--threads", "3", "--frames", "0-9")
        self.succeed("render", "out", *rays, "-o", "c", "--threads", "2", "--frames", "10-")
        whole = self.pictures("a")
        self.assertEqual(len(whole), 16)
        self.assertEqual(whole, self.pictures("b") | self.pictures("c"))
        self.succeed("render", "out", "-o", "raster", "--no-video")
        self.assertNotEqual(whole, self.pictures("raster"))

    def test_who_draws_is_said_by_scene_option_or_quality(self):
        one = ("--frames", "7", "--no-video", "-o")
        self.succeed("render", "out", "--quality", "preview", *one, "a")
        self.succeed("render", "out", "--set", '/render/renderer="rays"', "--samples", "1",
                     "--set", "/render/rays/bounces=0", *one, "b")
        self.assertEqual(self.pictures("a"), self.pictures("b"))
        self.succeed("render", "out", "--renderer", "rays", "--compare-with", "out",
                     "--sheet", "2x1", "-o", "both")
        self.assertGreater(png_size(self.dir / "both/sheet.png")[0], 4 * 64)
        self.succeed("render", "out", "--quality", "good", "--overlay", "solver", *one, "told")
        self.succeed("render", "out", "--quality", "good", *one, "plain")
        self.assertNotEqual(self.pictures("told"), self.pictures("plain"))
        arguments = ("--renderer", "raster", "--quality", "good", *one, "c")
        result = self.expect_exit(2, "render", "out", *arguments)
        self.assertIn("--quality good with --renderer raster", result.stderr)
        result = self.expect_exit(3, "render", "out", "--set", "/render/rays/shutter=2", *one, "c")
        self.assertIn("/render/rays/shutter=2: is 2", result.stderr)
        self.assertFalse((self.dir / "c").exists())

    def test_a_step_beyond_all_frames(self):
        self.succeed("render", "out", "--frames", f"5-15x{2**64 - 1}", "--no-video")
        frames = [path.name for path in (self.dir / "out/frames").iterdir()]
        self.assertEqual(frames, ["frame.0005.png"])

    def test_a_sheet_is_no_wider_than_its_pictures(self):
        self.succeed("render", "out", "--frames", "0-2", "--sheet", "99999x1")
        width, _ = png_size(self.dir / "out/sheet.png")
        self.assertLess(width, 4 * 64)

    def test_the_example_of_the_help_works(self):
        self.succeed("render", "out", "--frames", "0", "--set", "/render/samples=8")

    def test_output_without_a_name(self):
        self.expect_exit(2, "render", "out", "-o", "")
        self.assertFalse((self.dir / "out/frames").exists())

    def test_existing_pictures_are_refused_before_anything_else(self):
        self.succeed("render", "out", "--frames", "0")
        # Framing reads the whole trajectory; one that cannot be read tells what comes first.
        for chunk in (self.dir / "out/trajectory.zarr/position").glob("[0-9]*"):
            chunk.write_bytes(b"damaged")
        self.expect_exit(2, "render", "out", "--frames", "0")

    def test_contact_sheet(self):
        self.succeed("render", "out", "--sheet", "3x2")
        width, height = png_size(self.dir / "out/sheet.png")
        self.assertGreaterEqual(width, 3 * 64)
        self.assertGreaterEqual(height, 2 * 48)
        self.assertFalse((self.dir / "out/frames").exists())

    def test_same_bytes_again(self):
        self.succeed("render", "out", "--frames", "7")
        first = tree_bytes(self.dir / "out/frames")
        self.succeed("render", "out", "--frames", "7", "--force")
        self.assertEqual(tree_bytes(self.dir / "out/frames"), first)

    def test_moves_with_its_directory(self):
        shutil.move(self.dir / "out", self.dir / "elsewhere")
        os.remove(self.dir / "scene.json")
        self.succeed("render", "elsewhere", "--frames", "0")

    def test_existing_pictures_are_kept_without_force(self):
        self.succeed("render", "out", "--frames", "0-2")
        before = tree_bytes(self.dir / "out")
        result = self.expect_exit(2, "render", "out", "--frames", "0-2")
        self.assertIn("--force", result.stderr)
        self.assertEqual(tree_bytes(self.dir / "out"), before)
        self.succeed("render", "out", "--frames", "0", "--force")
        self.assertEqual(len(list((self.dir / "out/frames").iterdir())), 1)

    def test_frames_that_are_not_there(self):
        result = self.expect_exit(2, "render", "out", "--frames", "10-40")
        self.assertIn("0-15", result.stderr)

    def test_no_trajectory(self):
        (self.dir / "empty").mkdir()
        result = self.expect_exit(3, "render", "empty")
        self.assertIn("empty", result.stderr)

    def test_damaged_trajectory(self):
        (self.dir / "out/trajectory.zarr/position/.zarray").write_text("{")
        result = self.expect_exit(3, "render", "out")
        self.assertIn("position", result.stderr)

    def test_ffmpeg_missing(self):
        environment = {**os.environ, "PATH": str(self.dir)}
        result = self.expect_exit(4, "render", "out", "--frames", "0-2", env=environment)
        self.assertIn("ffmpeg", result.stderr)
        self.assertIn("apt", result.stderr)
        self.assertFalse((self.dir / "out/video.mp4").exists())

    def test_ffmpeg_missing_costs_no_old_pictures(self):
        self.succeed("render", "out", "--frames", "0-2")
        before = tree_bytes(self.dir / "out")
        environment = {**os.environ, "PATH": str(self.dir)}
        self.expect_exit(4, "render", "out", "--force", env=environment)
        self.assertEqual(tree_bytes(self.dir / "out"), before)

    def test_pictures_without_a_video(self):
        self.succeed("render", "out", "--frames", "0-2")
        video = (self.dir / "out/video.mp4").read_bytes()
        environment = {**os.environ, "PATH": str(self.dir)}
        arguments = ("render", "out", "--frames", "2-3", "--no-video", "--force")
        result = self.succeed(*arguments, env=environment)
        self.assertIn("frames: 2 frames", result.stdout)
        frames = sorted(path.name for path in (self.dir / "out/frames").iterdir())
        self.assertEqual(frames, ["frame.0002.png", "frame.0003.png"])
        self.assertEqual((self.dir / "out/video.mp4").read_bytes(), video)


if __name__ == "__main__":
    unittest.main()
