"""Reads what `pilesim batch` made: jobs, their values and reports, pictures with passes and cameras,
poses. Needs numpy; pictures are decoded by Pillow where it is installed, else here, slowly.

    from pilesim_batch import Batch, Pictures

    batch = Batch("out/bins")
    for job in batch.done():
        print(job.id, job.values, job.report()["quality_at_end"])
    pictures = Pictures(batch)          # len() and [i], as torch.utils.data.DataLoader takes it
    sample = pictures[0]                # image, depth, ids, K, R, t, job, camera, frame
"""

import json
import re
import struct
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy

try:
    from PIL import Image
except ImportError:
    Image = None

__all__ = ["Batch", "Job", "Pictures", "read_png"]


def read_png(file):
    """A PNG as numpy has it: (height, width) or (height, width, channels), uint8 or uint16."""
    if Image is not None:
        with Image.open(file) as image:
            # 16 bits of one channel come as int32.
            array = numpy.array(image)
        is_deep = array.dtype == numpy.int32
        return array.astype(numpy.uint16) if is_deep else array
    return _decode_png(Path(file).read_bytes())


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
    def run(self):
        """The directory of its trajectory, finished if the plan finishes it."""
        finished = self.directory / "finished"
        return finished if finished.is_dir() else self.directory / "run"

    def report(self):
        return json.loads((self.run / "report.json").read_text())

    def poses(self, name="pile.npz"):
        """The arrays of what the plan's step ["export", "-o", name] wrote."""
        with numpy.load(self.directory / name) as arrays:
            return {key: arrays[key] for key in arrays}

    def views(self):
        """Directories with frames/: one for each camera that was drawn, by its name."""
        views = {"camera": self.run} if (self.run / "frames").is_dir() else {}
        cameras = self.run / "cameras"
        for view in sorted(cameras.iterdir()) if cameras.is_dir() else ():
            if (view / "frames").is_dir():
                views[view.name] = view
        return views


class Batch:
    """The directory that `pilesim batch PLAN -o DIRECTORY` wrote; its jobs in order."""

    def __init__(self, directory):
        self.directory = Path(directory)
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
    (uint16). `transform` is called with each."""

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
            raw = read_png(depth)
            sample["depth"] = numpy.where(raw > 0, raw * (unit * 1e-3), numpy.inf).astype(numpy.float32)
        return self.transform(sample) if self.transform else sample
