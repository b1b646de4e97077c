"""Reads what `pilesim batch` made: jobs, their values and reports, pictures with passes and cameras,
poses. Needs numpy; pictures are decoded by Pillow where it is installed, else here, slowly.

    from pilesim_batch import Batch, Pictures

    batch = Batch("out/bins")
    for job in batch.done():
        print(job.id, job.values, job.report()["quality_at_end"])
    pictures = Pictures(batch)          # len() and [i], as torch.utils.data.DataLoader takes it
    sample = pictures[0]                # image, depth, ids, K, R, t, job, camera, frame
    for sample in Samples("out/bins"):  # of its tar files, one after another, with annotations
        ...

Coco and Bop read the datasets that a plan collects; no other package is needed.
"""

import io
import json
import re
import struct
import tarfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy

try:
    from PIL import Image
except ImportError:
    Image = None

__all__ = ["Batch", "Bop", "Coco", "Job", "Pictures", "Samples", "read_exr", "read_png", "unpack_mask"]


def read_png(file):
    """A PNG, by its path or its bytes, as numpy has it: (height, width) or (height, width, channels),
    uint8 or uint16."""
    data = file if isinstance(file, bytes) else Path(file).read_bytes()
    # Pillow makes 8 bits of three channels of 16.
    if Image is not None and data[24:26] != b"\x10\x02":
        with Image.open(io.BytesIO(data)) as image:
            # 16 bits of one channel come as int32.
            array = numpy.array(image)
        is_deep = array.dtype == numpy.int32
        return array.astype(numpy.uint16) if is_deep else array
    return _decode_png(data)


def read_exr(file, only=None):
    """The layers of an EXR file of passes, by its path or its bytes: depth (m), ids and shapes (height,
    width), normals (height, width, 3), motion (height, width, 2); those that `only` names, where given."""
    data = file if isinstance(file, bytes) else Path(file).read_bytes()
    at, header = 8, {}
    while data[at]:
        name, kind, rest = data[at:].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        size = struct.unpack_from("<I", data, at)[0]
        header[name] = data[at + 4:at + 4 + size]
        at += 4 + size
    if data[:4] != b"\x76\x2f\x31\x01" or header[b"compression"] != b"\3":
        raise ValueError("is an EXR of a kind that is not written by pilesim")
    left, top, right, bottom = struct.unpack("<4i", header[b"dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    channels, listed = [], header[b"channels"]
    while listed[0]:
        name, listed = listed.split(b"\0", 1)
        channels.append((name.decode(), {0: "<u4", 2: "<f4"}[struct.unpack_from("<I", listed)[0]]))
        listed = listed[16:]
    names = [name.split(".")[0] for name, _ in channels]
    if only is not None and not set(names) & set(only):
        return {}
    blocks = (height + 15) // 16
    rows = []
    for offset in struct.unpack_from(f"<{blocks}Q", data, at + 1):
        first, size = struct.unpack_from("<iI", data, offset)
        count = min(16, bottom + 1 - first)
        packed = data[offset + 8:offset + 8 + size]
        if size < count * width * 4 * len(channels):
            steps = numpy.frombuffer(zlib.decompress(packed), numpy.uint8).copy()
            steps[1:] -= 128
            halves = numpy.cumsum(steps, dtype=numpy.uint8)
            whole = numpy.empty_like(halves)
            whole[0::2], whole[1::2] = numpy.split(halves, [(halves.size + 1) // 2])
            packed = whole.tobytes()
        rows.append(numpy.frombuffer(packed, "<u4").reshape(count, len(channels), width))
    values = numpy.concatenate(rows)
    layers = {}
    for number, (name, (_, kind)) in enumerate(zip(names, channels)):
        if only is None or name in only:
            layers.setdefault(name, []).append(numpy.ascontiguousarray(values[:, number]).view(kind))
    return {name: planes[0] if len(planes) == 1 else numpy.stack(planes, -1) for name, planes in layers.items()}


def unpack_mask(segmentation):
    """The mask of COCO's compressed run lengths: (height, width), bool."""
    runs, value, shift = [], 0, 0
    for letter in segmentation["counts"].encode():
        letter -= 48
        value |= (letter & 0x1F) << shift
        shift += 5
        if not letter & 0x20:
            if letter & 0x10:
                value -= 1 << shift
            runs.append(value + (runs[-2] if len(runs) > 2 else 0))
            value = shift = 0
    height, width = segmentation["size"]
    mask = numpy.repeat(numpy.arange(len(runs)) % 2, runs)
    return mask.reshape(width, height).T.astype(bool)


def _metres(depth, unit_mm):
    return numpy.where(depth > 0, depth * (unit_mm * 1e-3), numpy.inf).astype(numpy.float32)


def _decode_png(data):
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError("is no PNG")
    at, packed, header = 8, b"", None
    while at < len(data):
        size, kind = struct.unpack(">I4s", data[at:at + 8])
        body = data[at + 8:at + 8 + size]
        if kind == b"IHDR":
            header = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        at += 12 + size
    width, height, depth, colour, _, _, interlaced = header
    channels = {0: 1, 2: 3, 4: 2, 6: 4}.get(colour)
    if channels is None or depth not in (8, 16) or interlaced:
        raise ValueError("is a PNG of a kind that is not written by pilesim")
    pixel = channels * depth // 8
    rows = numpy.frombuffer(zlib.decompress(packed), numpy.uint8).reshape(height, 1 + width * pixel)
    out = numpy.zeros((height + 1, (width + 1) * pixel), numpy.uint8)  # with zeros before and above
    for y in range(height):
        kind, line = rows[y, 0], rows[y, 1:]
        above, here = out[y], out[y + 1]
        if kind == 0:
            here[pixel:] = line
        elif kind == 2:
            here[pixel:] = line + above[pixel:]
        elif kind == 1:
            steps = line.reshape(width, pixel)
            here[pixel:] = numpy.cumsum(steps, axis=0, dtype=numpy.uint8).reshape(-1)
        else:
            _unfilter_sequential(kind, line, above, here, pixel)
    flat = out[1:, pixel:]
    if depth == 16:
        flat = flat.reshape(height, -1, 2)
        flat = flat[..., 0].astype(numpy.uint16) << 8 | flat[..., 1]
    shape = (height, width) if channels == 1 else (height, width, channels)
    return numpy.ascontiguousarray(flat.reshape(shape))


def _unfilter_sequential(kind, line, above, here, pixel):
    line, above, result = line.tolist(), above.tolist(), here.tolist()
    for i, value in enumerate(line):
        left, up, corner = result[i], above[i + pixel], above[i]
        if kind == 3:
            guess = (left + up) // 2
        else:  # Paeth
            estimate = left + up - corner
            far = abs(estimate - left), abs(estimate - up), abs(estimate - corner)
            guess = left if far[0] <= far[1] and far[0] <= far[2] else up if far[1] <= far[2] else corner
        result[i + pixel] = (value + guess) & 255
    here[:] = result


@dataclass(frozen=True)
class Job:
    """One job of a batch. `directory` is there while the batch is."""

    id: str
    end: str  # "done", or why it is not
    values: dict  # pointer into the scene -> value
    attempts: list  # of dicts with seed and end
    hash: str
    directory: Path

    @property
    def seed(self):
        """Of the scene as it was simulated."""
        return self.attempts[-1]["seed"]

    @property
    def runs(self):
        """The directories of its trajectories, as its steps made them: finished ones in the place of
        those that they are made of."""
        numbers = [int(d.name[4:] or 1) for d in self.directory.glob("run*") if re.fullmatch(r"run(_\d+)?", d.name)]
        names = ["" if number == 1 else f"_{number}" for number in sorted(numbers)]
        finished = [self.directory / f"finished{name}" for name in names]
        return [made if made.is_dir() else self.directory / f"run{name}" for made, name in zip(finished, names)]

    @property
    def run(self):
        """The last of them."""
        return self.runs[-1]

    def report(self):
        return json.loads((self.run / "report.json").read_text())

    def poses(self, name="pile.npz"):
        """The arrays of what the plan's step ["export", "-o", name] wrote."""
        with numpy.load(self.directory / name) as arrays:
            return {key: arrays[key] for key in arrays}

    def views(self):
        """Directories with frames/: one for each camera that was drawn, by the place of its pictures
        in the job, such as "run" or "run/cameras/left"."""
        frames = [*self.directory.glob("*/frames"), *self.directory.glob("*/cameras/*/frames")]
        return {str(f.parent.relative_to(self.directory)): f.parent for f in sorted(frames)}


class Batch:
    """The directory that `pilesim batch PLAN -o DIRECTORY` wrote; its jobs in order."""

    def __init__(self, directory):
        self.directory = Path(directory)
        for name in ("plan.json", "index.jsonl"):
            if not (self.directory / name).is_file():
                raise FileNotFoundError(f"{self.directory}: holds no {name}; expected the directory of a batch, as "
                                        "pilesim batch PLAN -o DIRECTORY makes it")
        self.plan = json.loads((self.directory / "plan.json").read_text())["plan"]
        self.jobs = []
        for line in (self.directory / "index.jsonl").read_text().splitlines():
            entry = json.loads(line)
            self.jobs.append(Job(entry["id"], entry["end"], entry["values"], entry["attempts"], entry["hash"],
                                 self.directory / "jobs" / entry["id"][:-3] / entry["id"]))

    def __len__(self):
        return len(self.jobs)

    def __getitem__(self, index):
        return self.jobs[index]

    def done(self):
        return [job for job in self.jobs if job.end == "done"]


class Pictures:
    """Every picture of every job that is done, as dicts: image (height, width, 3) uint8, K, R and t of
    its camera, and the passes that were drawn: depth (m, infinity where nothing is), ids, shapes
    (uint16), normals, motion (float32). `transform` is called with each."""

    def __init__(self, batch, transform=None):
        self.transform = transform
        self.places = []
        self._cameras = {}
        for job in batch.done():
            for camera, view in job.views().items():
                for picture in sorted((view / "frames").glob("frame.*.png")):
                    frame = int(re.fullmatch(r"frame\.(\d+)\.png", picture.name)[1])
                    self.places.append((job, camera, view, frame, picture))

    def __len__(self):
        return len(self.places)

    def _camera(self, view):
        if view not in self._cameras:
            file = view / "cameras.json"
            self._cameras[view] = json.loads(file.read_text()) if file.is_file() else {"frames": []}
        return self._cameras[view]

    def __getitem__(self, index):
        job, camera, view, frame, picture = self.places[index]
        sample = {"job": job.id, "camera": camera, "frame": frame, "values": job.values,
                  "image": read_png(picture)[..., :3]}
        cameras = self._camera(view)
        for entry in cameras["frames"]:
            if entry["frame"] == frame:
                sample |= {key: numpy.array(entry[key], float) for key in ("K", "R", "t")}
        number = picture.name[len("frame."):-len(".png")]
        for name in ("ids", "shapes"):
            file = view / "passes" / f"{name}.{number}.png"
            if file.is_file():
                sample[name] = read_png(file)
        depth = view / "passes" / f"depth.{number}.png"
        if depth.is_file():
            unit = next(e["depth_unit_mm"] for e in cameras["frames"] if e["frame"] == frame)
            sample["depth"] = _metres(read_png(depth), unit)
        layers = view / "passes" / f"frame.{number}.exr"
        if layers.is_file():
            sample |= read_exr(layers, only=("normals", "motion"))
        return self.transform(sample) if self.transform else sample


class Samples:
    """Every picture of a batch's tar files (DIRECTORY/tar, of a plan with "collect": ["tar"]), one after
    another, as Pictures gives them: "key", "image", "depth", "ids", "motion", "K", "R", "t" and what the
    file tells of it, such as "annotations". An iterable dataset: `part` of `parts` takes the files that are its own,
    for several workers; `transform` is called with each sample."""

    def __init__(self, directory, transform=None, part=0, parts=1):
        self.files = sorted((Path(directory) / "tar").glob("*.tar"))[part::parts]
        self.transform = transform

    def __iter__(self):
        for file in self.files:
            with tarfile.open(file) as tar:
                key, parts = None, {}
                for member in tar:
                    name, extension = member.name.split(".", 1)
                    if name != key and parts:
                        yield self._sample(key, parts)
                        parts = {}
                    key = name
                    parts[extension] = tar.extractfile(member).read()
                if parts:
                    yield self._sample(key, parts)

    def _sample(self, key, parts):
        sample = {"key": key, **json.loads(parts.pop("json"))}
        for extension, data in parts.items():
            name, kind = extension.rsplit(".", 1)
            if kind == "png":
                sample[name] = read_png(data)
        if "passes.exr" in parts:
            sample |= read_exr(parts["passes.exr"], only=("normals", "motion"))
        sample["image"] = sample.pop("rgb")[..., :3]
        if "depth" in sample:
            sample["depth"] = _metres(sample["depth"], sample["depth_unit_mm"])
        for name in ("K", "R", "t"):
            if name in sample:
                sample[name] = numpy.array(sample[name], float)
        return self.transform(sample) if self.transform else sample


class Coco:
    """A coco.json: of a batch (DIRECTORY/coco.json), or of a camera of a run. len() and [i] as dicts:
    image, "file_name", "annotations" with "category" (its name) and "mask" (height, width), bool."""

    def __init__(self, file, transform=None):
        self.directory = Path(file).parent
        self.transform = transform
        dataset = json.loads(Path(file).read_text())
        self.categories = {entry["id"]: entry["name"] for entry in dataset["categories"]}
        self.images = dataset["images"]
        self._annotations = {}
        for annotation in dataset["annotations"]:
            self._annotations.setdefault(annotation["image_id"], []).append(annotation)

    def __len__(self):
        return len(self.images)

    def __getitem__(self, index):
        entry = self.images[index]
        annotations = [annotation | {"category": self.categories[annotation["category_id"]],
                                     "mask": unpack_mask(annotation["segmentation"])}
                       for annotation in self._annotations.get(entry["id"], [])]
        sample = entry | {"image": read_png(self.directory / entry["file_name"])[..., :3],
                          "annotations": annotations}
        return self.transform(sample) if self.transform else sample


class Bop:
    """A dataset in BOP's format: DIRECTORY/bop of a batch or a run. len() and [i] as dicts: "image",
    "depth" (m), "K", "R" and "t" (m) of the camera, and "objects", each with "id" (of its model), "R", "t"
    (m), "mask" and "mask_visib" (height, width), bool, and what scene_gt_info.json tells."""

    def __init__(self, directory, transform=None):
        self.directory = Path(directory)
        self.transform = transform
        self.models = json.loads((self.directory / "models" / "models_info.json").read_text())
        self._scenes = sorted((self.directory / "train_pbr").iterdir())
        self._scene = (None, None)  # the one that was read last
        self.places = [(scene, int(image.stem)) for scene in self._scenes
                       for image in sorted((scene / "rgb").glob("*.png"))]

    def __len__(self):
        return len(self.places)

    def _told(self, scene):
        if self._scene[0] != scene:
            names = ("scene_camera", "scene_gt", "scene_gt_info")
            self._scene = scene, [json.loads((scene / f"{name}.json").read_text()) for name in names]
        return self._scene[1]

    def __getitem__(self, index):
        scene, image = self.places[index]
        cameras, poses, infos = (told[str(image)] for told in self._told(scene))
        objects = []
        for number, (pose, info) in enumerate(zip(poses, infos)):
            masks = {kind: read_png(scene / kind / f"{image:06}_{number:06}.png") > 0
                     for kind in ("mask", "mask_visib")}
            objects.append({"id": pose["obj_id"], "R": numpy.reshape(pose["cam_R_m2c"], (3, 3)),
                            "t": numpy.array(pose["cam_t_m2c"]) * 1e-3, **masks, **info})
        sample = {"scene": scene.name, "frame": image,
                  "image": read_png(scene / "rgb" / f"{image:06}.png")[..., :3],
                  "depth": _metres(read_png(scene / "depth" / f"{image:06}.png"), cameras["depth_scale"]),
                  "K": numpy.reshape(cameras["cam_K"], (3, 3)),
                  "R": numpy.reshape(cameras["cam_R_w2c"], (3, 3)),
                  "t": numpy.array(cameras["cam_t_w2c"]) * 1e-3, "objects": objects}
        return self.transform(sample) if self.transform else sample
