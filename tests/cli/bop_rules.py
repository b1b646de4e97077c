"""Rules of the BOP format for a dataset, by its description (bop_datasets_format.md of
the BOP toolkit, and calc_gt_info.py for boxes and counts), tried on files alone."""

import json
import math
import re

from png_reader import read_png

INFO_KEYS = {"bbox_obj", "bbox_visib", "px_count_all", "px_count_valid", "px_count_visib",
             "visib_fract"}
MODEL_KEYS = {"diameter", "min_x", "min_y", "min_z", "size_x", "size_y", "size_z"}
NOTHING = [-1, -1, -1, -1]


def problems(root):
    """Every rule that the dataset below `root` breaks, in words."""
    checker = Checker(root)
    checker.check_models()
    for split in sorted((root / "train_pbr").iterdir()):
        checker.check_scene(split)
    return checker.found


def is_rotation(numbers):
    rows = [numbers[0:3], numbers[3:6], numbers[6:9]]
    for i in range(3):
        for k in range(3):
            if abs(sum(a * b for a, b in zip(rows[i], rows[k])) - (i == k)) > 1e-6:
                return False
    (a, b, c), (d, e, f), (g, h, i) = rows
    return abs(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g) - 1) < 1e-6


def box_of(pixels):
    """The toolkit's: width and height are from the first column and row to the last."""
    if not pixels:
        return NOTHING
    columns, rows = [x for x, _ in pixels], [y for _, y in pixels]
    return [min(columns), min(rows), max(columns) - min(columns), max(rows) - min(rows)]


class Checker:
    def __init__(self, root):
        self.root, self.found, self.models = root, [], {}

    def require(self, holds, words):
        if not holds:
            self.found.append(words)
        return holds

    def require_names(self, folder, wanted):
        there = {path.name for path in folder.iterdir()}
        self.require(wanted <= there, f"{folder.name}: {sorted(wanted - there)} are missing")
        self.require(there <= wanted, f"{folder.name}: {sorted(there - wanted)} are of nothing")

    def require_keys(self, what, entry, wanted):
        return self.require(set(entry) == wanted, f"{what} has the keys {sorted(entry)}")

    def require_numbers(self, what, values, count):
        whole = len(values) == count and all(math.isfinite(value) for value in values)
        return self.require(whole, f"{what} is not {count} numbers")

    # Models: meshes in millimetres with unit normals, and their boxes and diameters.

    def check_models(self):
        self.models = json.loads((self.root / "models/models_info.json").read_text())
        files = {f"obj_{int(key):06d}.ply" for key in self.models}
        self.require_names(self.root / "models", files | {"models_info.json"})
        for key, info in self.models.items():
            self.require(re.fullmatch("[1-9][0-9]*", key), f"model {key} is no number from 1 on")
            plain = {name: value for name, value in info.items() if not name.startswith("symmetries_")}
            if self.require_keys(f"model {key}", plain, MODEL_KEYS):
                self.check_model(key, info, self.root / f"models/obj_{int(key):06d}.ply")

    def check_model(self, key, info, file):
        lines = file.read_text().splitlines()
        end = lines.index("end_header")
        head = lines[:end]
        self.require(head[:2] == ["ply", "format ascii 1.0"], f"model {key} is no ASCII PLY")
        names = [line.split()[-1] for line in head if line.startswith("property float")]
        self.require(names == ["x", "y", "z", "nx", "ny", "nz"], f"model {key} has {names}")
        count = next(int(line.split()[2]) for line in head if line.startswith("element vertex"))
        rows = [[float(x) for x in line.split()] for line in lines[end + 1 :][:count]]
        for row in rows:
            self.require(abs(math.hypot(*row[3:]) - 1) < 0.02, f"model {key}: a normal is no unit")
        for line in lines[end + 1 + count :]:
            corners = [int(x) for x in line.split()]
            self.require(corners[0] == 3 and all(0 <= c < count for c in corners[1:]),
                         f"model {key}: a face is no triangle of its vertices")
        close = 1e-5 * info["diameter"] + 1e-6
        for axis, name in enumerate("xyz"):
            low, high = min(row[axis] for row in rows), max(row[axis] for row in rows)
            self.require(abs(info[f"min_{name}"] - low) <= close, f"model {key}: min_{name}")
            size = info[f"size_{name}"]
            self.require(abs(size - (high - low)) <= close, f"model {key}: size_{name}")
        widest = max(math.dist(a[:3], b[:3]) for a in rows for b in rows)
        self.require(abs(info["diameter"] - widest) <= close, f"model {key}: diameter")
        for turn in info.get("symmetries_discrete", []):
            if self.require_numbers(f"a symmetry of model {key}", turn, 16):
                rotation = turn[0:3] + turn[4:7] + turn[8:11]
                self.require(is_rotation(rotation) and turn[3::4] == [0, 0, 0, 1],
                             f"model {key}: a symmetry is no rotation")
        for symmetry in info.get("symmetries_continuous", []):
            length = math.hypot(*symmetry["axis"])
            self.require(abs(length - 1) < 1e-6 and len(symmetry["offset"]) == 3,
                         f"model {key}: an axis of symmetry")

    # Scenes: one name for all that belongs to an image.

    def check_scene(self, scene):
        self.require(re.fullmatch("[0-9]{6}", scene.name), f"scene {scene.name} is not six digits")
        cameras, poses, infos = (
            json.loads((scene / f"scene_{name}.json").read_text())
            for name in ("camera", "gt", "gt_info")
        )
        folders = {"rgb", "depth", "mask", "mask_visib"}
        files = {f"scene_{name}.json" for name in ("camera", "gt", "gt_info")}
        self.require_names(scene, folders | files)
        same = set(cameras) == set(poses) == set(infos)
        self.require(same, "the images differ between the files")
        self.require(all(str(int(key)) == key for key in cameras), "an image is no number")
        images = {f"{int(key):06d}.png" for key in cameras}
        masks = {f"{int(key):06d}_{i:06d}.png" for key in poses for i in range(len(poses[key]))}
        for folder, wanted in (("rgb", images), ("depth", images), ("mask", masks),
                               ("mask_visib", masks)):
            self.require_names(scene / folder, wanted)
        if self.found:
            return
        for key in cameras:
            self.check_image(scene, int(key), cameras[key], poses[key], infos[key])

    def check_image(self, scene, image, camera, poses, infos):
        what = f"image {image}"
        if not self.require_keys(what, camera, {"cam_K", "cam_R_w2c", "cam_t_w2c", "depth_scale"}):
            return
        self.require_numbers(f"{what}: cam_t_w2c", camera["cam_t_w2c"], 3)
        self.require(is_rotation(camera["cam_R_w2c"]), f"{what}: cam_R_w2c is no rotation")
        k = camera["cam_K"]
        self.require([k[i] for i in (1, 3, 6, 7, 8)] == [0, 0, 0, 0, 1] and k[0] > 0 and k[4] > 0,
                     f"{what}: cam_K is no camera matrix, row by row")
        width, height, rgb = read_png(scene / f"rgb/{image:06d}.png")
        *size, depth = read_png(scene / f"depth/{image:06d}.png")
        self.require(size == [width, height], f"{what}: depth is of another size")
        self.require(len(rgb[0][0]) == 3, f"{what}: rgb has no three channels")
        self.require(camera["depth_scale"] > 0, f"{what}: depth_scale")
        self.require(len(poses) == len(infos), f"{what}: as many poses as infos")
        owned = set()
        for i, (pose, info) in enumerate(zip(poses, infos)):
            name = f"{image:06d}_{i:06d}.png"
            mask, visible = (self.mask(scene / folder / name, [width, height])
                             for folder in ("mask", "mask_visib"))
            self.require(visible <= mask, f"{what}, {i}: mask_visib is not within its mask")
            self.require(not visible & owned, f"{what}, {i}: mask_visib overlaps another")
            owned |= visible
            if self.check_pose(f"{what}, {i}", pose):
                self.check_place(f"{what}, {i}", pose, camera, visible, depth)
            if self.require_keys(f"{what}, {i}", info, INFO_KEYS):
                self.check_info(f"{what}, {i}", info, mask, visible, depth)

    def mask(self, file, size):
        *own, rows = read_png(file)
        self.require(own == size, f"{file.name}: a mask of another size")
        values = {value for row in rows for value in row}
        self.require(values <= {0, 255}, f"{file.name}: more than 0 and 255")
        return {(x, y) for y, row in enumerate(rows) for x, value in enumerate(row) if value}

    def check_pose(self, what, pose):
        if not self.require_keys(what, pose, {"cam_R_m2c", "cam_t_m2c", "obj_id"}):
            return False
        known = self.require(str(pose["obj_id"]) in self.models, f"{what} is of no model")
        turned = self.require_numbers(f"{what}: cam_R_m2c", pose["cam_R_m2c"], 9) and self.require(
            is_rotation(pose["cam_R_m2c"]), f"{what}: cam_R_m2c is no rotation")
        return known and turned and self.require_numbers(f"{what}: cam_t_m2c", pose["cam_t_m2c"], 3)

    def check_place(self, what, pose, camera, visible, depth):
        """In millimetres: what is seen is no farther from the model's origin than its corners are,
        where the pose has it and where depth has it."""
        info, k, scale = self.models[str(pose["obj_id"])], camera["cam_K"], camera["depth_scale"]
        reach = math.hypot(*(max(abs(info[f"min_{a}"]), abs(info[f"min_{a}"] + info[f"size_{a}"]))
                             for a in "xyz"))
        at = pose["cam_t_m2c"]
        for x, y in visible:
            direction = [(x - k[2]) / k[0], (y - k[5]) / k[4], 1]
            along = sum(a * d for a, d in zip(at, direction)) / sum(d * d for d in direction)
            aside = math.dist(at, [along * d for d in direction])
            if not self.require(along > 0 and aside <= reach * 1.001,
                                f"{what} is not where its mask is"):
                return
            z = depth[y][x] * scale
            there = math.dist(at, [z * d for d in direction])
            if depth[y][x] and not self.require(there <= reach * 1.001 + 2 * scale,
                                                f"{what} is not where depth has it"):
                return

    def check_info(self, what, info, mask, visible, depth):
        self.require(info["px_count_visib"] == len(visible), f"{what}: px_count_visib")
        valid = sum(depth[y][x] > 0 for x, y in mask)
        self.require(info["px_count_valid"] == valid, f"{what}: px_count_valid")
        counted = info["px_count_all"]
        self.require(counted >= max(1, len(mask)), f"{what}: px_count_all")
        share = len(visible) / max(1, counted)
        self.require(abs(info["visib_fract"] - share) < 1e-9, f"{what}: visib_fract")
        self.require(info["bbox_visib"] == box_of(visible), f"{what}: bbox_visib")
        box = info["bbox_obj"]
        if not visible:
            self.require(box == NOTHING, f"{what}: bbox_obj of what is not seen")
            return
        # The mask ends with the picture, the box does not: a mask that reaches no border is whole.
        inner = box_of(mask)
        if counted == len(mask):
            self.require(box == inner, f"{what}: bbox_obj")
        else:
            self.require(box[0] <= inner[0] and box[1] <= inner[1]
                         and box[0] + box[2] >= inner[0] + inner[2]
                         and box[1] + box[3] >= inner[1] + inner[3], f"{what}: bbox_obj")
