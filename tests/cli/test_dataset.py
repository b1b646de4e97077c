"""render --passes, --annotations and --camera: what is written, read again with nothing but Python."""

import csv
import json
import math
import os
import shutil
import unittest

import bop_rules
from png_reader import read_png
from support import BOXES, CommandTest, tree_bytes

SIZE = (160, 120)
# Two frames while the boxes fall, one when they have hit the ground.
FRAMES = (2, 9)


def decode_mask(segmentation):
    """A COCO mask, by the format's own description: rows of 0 and 1."""
    height, width = segmentation["size"]
    runs, text, at = [], segmentation["counts"], 0
    while at < len(text):
        value, shift, more = 0, 0, True
        while more:
            group = ord(text[at]) - 48
            value |= (group & 0x1F) << shift
            more = bool(group & 0x20)
            at, shift = at + 1, shift + 5
            if not more and group & 0x10:
                value |= -1 << shift
        if len(runs) > 2:
            value += runs[-2]
        runs.append(value)
    assert sum(runs) == width * height
    flat = [i % 2 for i, run in enumerate(runs) for _ in range(run)]
    return [[flat[column * height + row] for column in range(width)] for row in range(height)]


def read_ply(path):
    lines = path.read_text().splitlines()
    end = lines.index("end_header")
    count = {line.split()[1]: int(line.split()[2]) for line in lines if line.startswith("element")}
    vertices = [[float(x) for x in line.split()[:3]] for line in lines[end + 1 :][: count["vertex"]]]
    faces = [[int(x) for x in line.split()[1:]] for line in lines[end + 1 + count["vertex"] :]]
    assert len(faces) == count["face"]
    return vertices, faces


def apply(rotation, translation, point):
    return [
        sum(rotation[3 * row + k] * point[k] for k in range(3)) + translation[row] for row in range(3)
    ]


def depths(vertices, faces, k, rotation, translation):
    """Pixels whose middles the mesh covers, with the nearest depth there."""
    placed = [apply(rotation, translation, vertex) for vertex in vertices]
    flat = [(k[0] * x / z + k[2], k[4] * y / z + k[5], 1 / z) for x, y, z in placed]
    nearest = {}
    for face in faces:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = (flat[i] for i in face)
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0:
            continue
        for row in range(math.ceil(min(ay, by, cy)), math.floor(max(ay, by, cy)) + 1):
            for column in range(math.ceil(min(ax, bx, cx)), math.floor(max(ax, bx, cx)) + 1):
                u = ((column - ax) * (cy - ay) - (row - ay) * (cx - ax)) / area
                v = ((bx - ax) * (row - ay) - (by - ay) * (column - ax)) / area
                if u < 0 or v < 0 or u + v > 1:
                    continue
                depth = 1 / (az + u * (bz - az) + v * (cz - az))
                nearest[column, row] = min(depth, nearest.get((column, row), math.inf))
    return nearest


class Dataset(CommandTest):
    def simulate(self, **changes):
        scene = json.loads(json.dumps(BOXES))
        scene["render"] = {"size": list(SIZE), "samples": 1}
        scene["shapes"]["brick"] = {"type": "box", "size": [0.5, 0.1, 0.2]}
        scene["bodies"].append(
            {"name": "brick", "shape": "brick", "material": "wood", "position": [0.1, 0.3, 0.6]}
        )
        # So near that what is at the sides is cut.
        scene["camera"] = {"position": [0.6, 1.0, 2.1], "target": [0, 0.7, 0]}
        scene.update(changes)
        (self.dir / "scene.json").write_text(json.dumps(scene))
        self.succeed("simulate", "scene.json", "-o", "out")

    def draw(self, *arguments, output="set", frames="2-9x7", **options):
        self.succeed("render", "out", "-o", output, "--frames", frames, "--no-video", *arguments, **options)
        return self.dir / output

    def test_bop(self):
        self.simulate()
        root = self.draw("--annotations", "bop") / "bop"
        scene = root / "train_pbr/000000"
        cameras, poses, infos = (
            json.loads((scene / f"scene_{name}.json").read_text()) for name in ("camera", "gt", "gt_info")
        )
        models = json.loads((root / "models/models_info.json").read_text())
        meshes = {int(key): read_ply(root / f"models/obj_{int(key):06d}.ply") for key in models}
        self.assertEqual([len(each) for each in (cameras, poses, infos)], [2, 2, 2])
        self.assertEqual(sorted(len(vertices) for vertices, _ in meshes.values()), [24, 24])
        brick = max(models.values(), key=lambda model: model["size_x"])
        self.assertAlmostEqual(brick["size_x"], 500, places=3)
        self.assertAlmostEqual(brick["diameter"], math.hypot(500, 100, 200), places=3)
        # Half turns about the three axes of a brick with unlike sides.
        self.assertEqual(
            sorted([turn[0], turn[5], turn[10], turn[15]] for turn in brick["symmetries_discrete"]),
            [[-1, -1, 1, 1], [-1, 1, -1, 1], [1, -1, -1, 1]],
        )
        for key in cameras:
            self.check_image(scene, int(key), cameras[key], poses[key], infos[key], meshes)

    def test_bop_keeps_the_rules_of_its_format(self):
        scene = json.loads(json.dumps(BOXES))
        wall = {"name": "wall", "shape": "wall", "material": "wood", "role": "static",
                "position": [0, 1, -1]}
        hidden = {"name": "hidden", "shape": "roller", "material": "wood", "position": [0, 0.2, -1.5]}
        self.simulate(
            shapes={**scene["shapes"], "wall": {"type": "box", "size": [6, 2, 0.05]},
                    "roller": {"type": "cylinder", "radius": 0.1, "height": 0.3}},
            bodies=[*scene["bodies"], wall, hidden],
            cameras=[{"name": "near", "view": {"position": [0.4, 0.8, 1.2], "target": [0, 0.3, 0]}}],
        )
        for renderer in ("raster", "rays"):
            root = self.draw("--annotations", "bop", "--camera", "all", "--renderer", renderer,
                             "--set", "/render/rays/quality=preview", output=renderer) / "bop"
            self.assertEqual(bop_rules.problems(root), [])
            scenes = sorted(path.name for path in (root / "train_pbr").iterdir())
            self.assertEqual(scenes, ["000000", "000001"])
            infos = json.loads((root / "train_pbr/000000/scene_gt_info.json").read_text())
            seen = [info["visib_fract"] for image in infos.values() for info in image]
            # Hidden, in part and wholly seen: the rules were tried on all.
            self.assertEqual(min(seen), 0)
            self.assertTrue(any(0.1 < share < 0.9 for share in seen))
            self.assertEqual(max(seen), 1)

    def test_what_breaks_the_rules_of_bop_is_noticed(self):
        self.simulate()
        root = self.draw("--annotations", "bop") / "bop"
        self.assertEqual(bop_rules.problems(root), [])
        scene = "train_pbr/000000/"

        def in_json(name, change):
            def apply_to(copy):
                data = json.loads((copy / name).read_text())
                change(data)
                (copy / name).write_text(json.dumps(data))
            return apply_to

        def in_first(name, change):
            return in_json(scene + name, lambda data: change(next(iter(data.values()))[0]))

        def scale(numbers, factor):
            numbers[:] = [factor * x for x in numbers]

        def in_camera(change):
            return in_json(scene + "scene_camera.json", lambda data: change(data["2"]))

        def swap_masks(copy):
            masks = copy / scene / "mask_visib"
            first, second = masks / "000002_000000.png", masks / "000002_000001.png"
            first.rename(copy / "other")
            second.rename(first)
            (copy / "other").rename(second)

        changes = {
            "is no rotation": in_first("scene_gt.json", lambda gt: scale(gt["cam_R_m2c"], -1)),
            "cam_R_w2c is no rotation": in_camera(lambda each: scale(each["cam_R_w2c"], 1.001)),
            "has the keys": in_first("scene_gt.json", lambda gt: gt.pop("obj_id")),
            "of no model": in_first("scene_gt.json", lambda gt: gt.update(obj_id=77)),
            # In metres, which are as many millimetres too near.
            "is not where depth has it": in_first("scene_gt.json",
                                                  lambda gt: scale(gt["cam_t_m2c"], 1e-3)),
            "is not where its mask is": in_first("scene_gt.json",
                                                 lambda gt: gt["cam_t_m2c"].reverse()),
            "where depth has it": in_camera(lambda each: each.update(depth_scale=2 * each["depth_scale"])),
            "visib_fract": in_first("scene_gt_info.json", lambda i: i.update(visib_fract=0.123)),
            "px_count_visib": in_first("scene_gt_info.json",
                                       lambda i: i.update(px_count_visib=i["px_count_visib"] + 1)),
            "px_count_valid": in_first("scene_gt_info.json", lambda i: i.update(px_count_valid=3)),
            "bbox_visib": in_first("scene_gt_info.json", lambda i: i["bbox_visib"].reverse()),
            "bbox_obj": in_first("scene_gt_info.json", lambda i: i["bbox_obj"].reverse()),
            "diameter": in_json("models/models_info.json",
                                lambda infos: infos["2"].update(diameter=1)),
            "size_x": in_json("models/models_info.json", lambda infos: infos["2"].update(size_x=1)),
            "not within its mask": swap_masks,
            "are missing": lambda copy: (copy / scene / "mask/000002_000000.png").unlink(),
            "are of nothing": lambda copy: (copy / scene / "rgb/7.png").write_bytes(b""),
        }
        for words, change in changes.items():
            shutil.copytree(root, self.dir / "copy")
            change(self.dir / "copy")
            found = bop_rules.problems(self.dir / "copy")
            self.assertTrue(any(words in each for each in found), (words, found))
            shutil.rmtree(self.dir / "copy")

    def check_image(self, scene, image, camera, poses, infos, meshes):
        width, height, depth = read_png(scene / f"depth/{image:06d}.png")
        self.assertEqual((width, height), SIZE)
        self.assertEqual(
            (scene / f"rgb/{image:06d}.png").read_bytes(),
            (self.dir / f"set/frames/frame.{image:04d}.png").read_bytes(),
        )
        self.assertGreaterEqual(len(poses), 8)
        k, owner, solids = camera["cam_K"], {}, []
        for i, (pose, info) in enumerate(zip(poses, infos)):
            solid = depths(*meshes[pose["obj_id"]], k, pose["cam_R_m2c"], pose["cam_t_m2c"])
            solids.append(solid)
            mask, seen = (
                read_png(scene / f"{name}/{image:06d}_{i:06d}.png")[2] for name in ("mask", "mask_visib")
            )
            covered = {(x, y) for y in range(height) for x in range(width) if mask[y][x]}
            visible = {(x, y) for y in range(height) for x in range(width) if seen[y][x]}
            self.assertEqual({mask[y][x] for x, y in covered}, {255})
            self.assertLessEqual(visible, covered)
            for pixel in visible:
                self.assertNotIn(pixel, owner)  # one owner
                owner[pixel] = i
            inside = {p for p in solid if 0 <= p[0] < width and 0 <= p[1] < height}
            self.assertLessEqual(len(inside ^ covered), 0.001 * width * height)
            self.assertLessEqual(abs(len(solid) - info["px_count_all"]), 0.01 * len(solid) + 2)
            self.assertEqual(info["px_count_visib"], len(visible))
            self.assertEqual(info["px_count_valid"], sum(depth[y][x] > 0 for x, y in covered))
            self.assertAlmostEqual(info["visib_fract"], len(visible) / info["px_count_all"], places=9)
            if visible:
                xs, ys = [x for x, _ in visible], [y for _, y in visible]
                box = [min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys)]
                self.assertEqual(info["bbox_visib"], box)
                xs, ys = [x for x, _ in solid], [y for _, y in solid]
                box = [min(xs), min(ys), max(xs) - min(xs), max(ys) - min(ys)]
                for told, found in zip(info["bbox_obj"], box):
                    self.assertLessEqual(abs(told - found), 1)
        self.check_owners(camera, depth, owner, solids)

    def check_owners(self, camera, depth, owner, solids):
        """The nearest of the bodies and the ground, whose position in the camera follows as well."""
        rotation, translation, k = camera["cam_R_w2c"], camera["cam_t_w2c"], camera["cam_K"]
        up = [rotation[1], rotation[4], rotation[7]]
        offset = sum(u * t for u, t in zip(up, translation))
        wrong = far = 0
        for y in range(SIZE[1]):
            for x in range(SIZE[0]):
                slope = up[0] * (x - k[2]) / k[0] + up[1] * (y - k[5]) / k[4] + up[2]
                ground = offset / slope if slope < 0 else math.inf
                nearest = min(range(len(solids)), key=lambda i: solids[i].get((x, y), math.inf))
                at = solids[nearest].get((x, y), math.inf)
                wrong += owner.get((x, y)) != (nearest if at < ground else None)
                if min(at, ground) < 60000 * camera["depth_scale"]:
                    far += abs(depth[y][x] * camera["depth_scale"] - min(at, ground)) > 2
        self.assertLessEqual(wrong, 0.001 * SIZE[0] * SIZE[1])
        self.assertLessEqual(far, 0.002 * SIZE[0] * SIZE[1])

    def test_coco_has_the_masks_of_the_ids(self):
        self.simulate()
        out = self.draw("--annotations", "coco", "--passes", "ids,shapes,visibility")
        coco = json.loads((out / "coco.json").read_text())
        names = {category["id"]: category["name"] for category in coco["categories"]}
        self.assertEqual(sorted(names.values()), ["box", "brick"])
        self.assertEqual([image["file_name"] for image in coco["images"]],
                         ["frames/frame.0002.png", "frames/frame.0009.png"])
        told = json.loads((out / "passes/passes.json").read_text())
        self.assertEqual(len({a["id"] for a in coco["annotations"]}), len(coco["annotations"]))
        for frame in FRAMES:
            width, height, ids = read_png(out / f"passes/ids.{frame:04d}.png")
            shapes = read_png(out / f"passes/shapes.{frame:04d}.png")[2]
            with open(out / f"passes/visibility.{frame:04d}.csv", newline="") as file:
                visibility = {int(row["instance"]): row for row in csv.DictReader(file)}
            annotations = [a for a in coco["annotations"] if a["image_id"] == frame]
            seen = {ids[y][x] for y in range(height) for x in range(width)} - {0, 1}
            self.assertEqual({a["instance"] for a in annotations}, seen)
            self.assertGreater(len(seen), 5)
            for a in annotations:
                mask = decode_mask(a["segmentation"])
                pixels = [(x, y) for y in range(height) for x in range(width) if mask[y][x]]
                self.assertEqual({ids[y][x] for x, y in pixels}, {a["instance"]})
                self.assertEqual(len(pixels), sum(row.count(a["instance"]) for row in ids))
                self.assertEqual(a["area"], len(pixels))
                self.assertEqual({shapes[y][x] for x, y in pixels}, {a["category_id"]})
                self.assertEqual(told["shapes"][a["category_id"] - 1], names[a["category_id"]])
                xs, ys = [x for x, _ in pixels], [y for _, y in pixels]
                left, top = min(xs), min(ys)
                self.assertEqual(a["bbox"], [left, top, max(xs) - left + 1, max(ys) - top + 1])
                row = visibility[a["instance"]]
                self.assertEqual(int(row["visible_pixels"]), a["area"])
                self.assertAlmostEqual(float(row["visible_share"]), a["visible_share"], places=5)
        self.assertEqual(told["instances"][0], "ground")

    def test_normals_and_depth_of_the_ground(self):
        self.simulate()
        out = self.draw("--passes", "depth,normals,ids")
        camera = json.loads((out / "cameras.json").read_text())
        ids = read_png(out / "passes/ids.0002.png")[2]
        normals = read_png(out / "passes/normals.0002.png")[2]
        depth = read_png(out / "passes/depth.0002.png")[2]
        frame = camera["frames"][0]
        up = [row[1] for row in frame["R"]]
        seen = [(x, y) for y in range(SIZE[1]) for x in range(SIZE[0]) if ids[y][x] == 1]
        self.assertGreater(len(seen), 1000)
        for x, y in seen:
            self.assertEqual(normals[y][x], [32768 + round(32767 * value) for value in up])
            ray = [(x - frame["K"][0][2]) / frame["K"][0][0], (y - frame["K"][1][2]) / frame["K"][1][1], 1]
            # The world's origin, at t in the camera's frame, is on the ground.
            expected = sum(u * t for u, t in zip(up, frame["t"])) / sum(u * r for u, r in zip(up, ray))
            told = depth[y][x] * frame["depth_unit_mm"] / 1000
            if told > 0:
                self.assertAlmostEqual(told, expected, delta=frame["depth_unit_mm"] / 1000)

    def test_same_bytes_whatever_else_is_drawn(self):
        self.simulate()
        every = ["--passes", "depth,ids,shapes,normals,motion,visibility", "--annotations", "coco,bop"]
        whole = self.draw(*every, "--threads", "2", frames="2-5", output="whole")
        alone = dict(os.environ, LP_NUM_THREADS="0")
        part = self.draw(*every, "--threads", "1", frames="4-5", output="part", env=alone)
        plain = self.draw(frames="2-5", output="plain")
        whole, part, plain = (tree_bytes(each) for each in (whole, part, plain))
        shared = [name for name in part if not name.endswith(".json") and not name.endswith(".bin")]
        self.assertGreater(len(shared), 40)
        for name in shared:
            self.assertEqual(part[name], whole[name], name)
        pictures = [name for name in plain if str(name).endswith(".png")]
        self.assertEqual(len(pictures), 4)
        for name in pictures:
            self.assertEqual(plain[name], whole[name], name)

    def test_both_renderers_tell_the_same(self):
        self.simulate()
        every = ["--passes", "depth,ids,shapes,normals,motion,visibility", "--annotations", "coco,bop"]
        raster = self.draw(*every, output="raster")
        rays = self.draw(*every, "--quality", "preview", "--threads", "1", output="rays")
        again = self.draw(*every, "--quality", "preview", "--threads", "2", output="again")
        self.assertEqual(tree_bytes(rays), tree_bytes(again))
        self.assertEqual(set(tree_bytes(raster)), set(tree_bytes(rays)))
        # All but the pictures, and what is kept to go on with them.
        told = [name for name in tree_bytes(raster)
                if name.startswith(("passes/", "bop/", "c")) and "/rgb/" not in name]
        self.assertGreater(len(told), 20)
        for name in told:
            self.assertEqual((raster / name).read_bytes(), (rays / name).read_bytes(), name)

    def test_several_cameras(self):
        self.simulate()
        cameras = "/cameras=" + json.dumps([
            {"name": "top", "view": {"position": [0, 4, 0.01], "target": [0, 0, 0], "roll_deg": 30,
                                     "focal_length_mm": 50}},
            {"name": "around", "orbit": {"distance_m": 3, "elevation_deg": 30, "period_s": 0.5}},
            {"name": "views", "random_views": {"count": 3, "distance_m": [2, 3],
                                               "elevation_deg": [10, 80]}},
        ])
        out = self.draw("--camera", "all", "--annotations", "bop", "--set", cameras)
        names = sorted(path.name for path in (out / "cameras").iterdir())
        self.assertEqual(names, ["around", "camera", "top", "views_000", "views_001", "views_002"])
        self.assertEqual(len(list((out / "bop/train_pbr").iterdir())), 6)
        for name in names:
            told = json.loads((out / "cameras" / name / "cameras.json").read_text())
            self.assertEqual([frame["frame"] for frame in told["frames"]], list(FRAMES))
        top = json.loads((out / "cameras/top/cameras.json").read_text())["frames"][0]
        self.assertAlmostEqual(top["K"][0][0], 50 / 36 * SIZE[0], places=6)
        first = json.loads((out / "cameras/views_000/cameras.json").read_text())
        again = self.draw("--camera", "views", "--set", cameras, output="again")
        self.assertEqual(json.loads((again / "cameras/views_000/cameras.json").read_text()), first)
        result = self.expect_exit(2, "render", "out", "-o", "x", "--camera", "side", "--set", cameras)
        self.assertIn('"side" is no camera of the scene', result.stderr)
        self.assertIn('"top"', result.stderr)

    def test_what_is_refused(self):
        self.simulate()
        result = self.expect_exit(2, "render", "out", "-o", "x", "--passes", "depth,albedo")
        self.assertIn('"albedo" is none of "depth", "ids"', result.stderr)
        self.expect_exit(2, "render", "out", "-o", "x", "--annotations", "voc")
        self.expect_exit(2, "render", "out", "-o", "x", "--passes", "ids", "--sheet", "2x2")
        self.assertFalse((self.dir / "x").exists())
        self.draw("--passes", "ids", "--annotations", "bop")
        before = tree_bytes(self.dir / "set")
        for path in (self.dir / "set/frames").iterdir():
            path.unlink()
        result = self.expect_exit(2, "render", "out", "-o", "set", "--passes", "ids", "--no-video")
        self.assertIn("passes", result.stderr)
        self.draw("--passes", "ids", "--annotations", "bop", "--force")
        self.assertEqual(tree_bytes(self.dir / "set"), before)


if __name__ == "__main__":
    unittest.main()
