"""Invariants of a directory after any accident: whole files, and no other file touched."""

import csv
import json
import re
import subprocess
import zlib

import numpy
from numcodecs import zstd

TEMPORARY = re.compile(r"\.pilesim\.[0-9.]+\.tmp|\.[0-9]+\.part")
# They hold times of the clock, or charts of them: no two runs have the same. Checkpoints are of the
# moment, until the run is done.
VOLATILE = re.compile(
    r"(^|/)(timing\.csv|report\.(json|html)|compare\..*|(render_)?checkpoint\.bin|"
    r"job\.json|log\.txt|table\.csv)$"
)


class Broken(Exception):
    pass


def require(condition, *what):
    if not condition:
        raise Broken(" ".join(map(str, what)))


def tree(place):
    """Relative path -> bytes of all files but temporary ones."""
    return {
        str(path.relative_to(place)): path.read_bytes()
        for path in sorted(place.rglob("*"))
        if path.is_file() and not is_temporary(path.relative_to(place))
    }


def is_temporary(path):
    return any(TEMPORARY.fullmatch(part) for part in path.parts)


def temporaries(place):
    return [path for path in place.rglob("*") if TEMPORARY.fullmatch(path.name)]


def stores(place):
    """Relative path -> directory of each trajectory, whole or not."""
    paths = {path.relative_to(place): path for path in place.rglob("trajectory.zarr")}
    return {str(name): path for name, path in paths.items() if not is_temporary(name)}


def check_png(data, name):
    require(data[:8] == b"\x89PNG\r\n\x1a\n", name, "is no PNG")
    at, pixels, last = 8, b"", b""
    while at < len(data):
        size = int.from_bytes(data[at : at + 4], "big")
        body = data[at + 4 : at + 8 + size]
        crc = data[at + 8 + size : at + 12 + size]
        require(len(crc) == 4 and zlib.crc32(body) == int.from_bytes(crc, "big"), name, "is cut")
        last = body[:4]
        pixels += body[4:] if last == b"IDAT" else b""
        at += 12 + size
    require(last == b"IEND", name, "has no end")
    zlib.decompress(pixels)


def check_volatile(name, data, killed=False):
    """Whole by its own form. `killed`: the last row of a table may lack its end."""
    if name.endswith(".bin"):
        require(data.startswith(b"pilesim checkpoint\n"), name, "is no checkpoint")
        return
    text = "" if name.endswith(".png") else data.decode()
    if name.endswith(".png"):
        check_png(data, name)
    elif name.endswith(".json"):
        try:
            json.loads(text)
        except ValueError as fault:
            raise Broken(f"{name}: {fault}") from fault
    elif name.endswith(".csv"):
        if killed:
            text = text[: text.rfind("\n") + 1]
        rows = list(csv.reader(text.splitlines()))
        require(text == "" or text.endswith("\n"), name, "ends within a row")
        require(all(len(row) == len(rows[0]) for row in rows), name, "has a cut row")
        numbers = [int(row[0]) for row in rows[1:]]
        # For frames, one after another; for jobs, those that were tried.
        whole = numbers == list(range(len(numbers))) if "timing" in name else numbers == sorted({*numbers})
        require(whole, name, "rows")
    elif not name.endswith("log.txt"):
        require(text.rstrip().endswith(("</html>", "</svg>")), name, "is cut")


def check_video(path):
    """Holds as many pictures as there are files of them beside it."""
    probe = subprocess.run(
        ["ffprobe", "-v", "error", "-select_streams", "v:0", "-count_frames", "-of", "csv=p=0",
         "-show_entries", "stream=nb_read_frames", path],
        capture_output=True,
        text=True,
        check=False,
    )
    require(probe.returncode == 0 and not probe.stderr, path, "does not decode:", probe.stderr)
    pictures = [p for p in (path.parent / "frames").iterdir() if re.search(r"\d\.png", p.name)]
    require(int(probe.stdout) == len(pictures), path, "has", probe.stdout, "of", len(pictures))


class Trajectory:
    """Frames of a store, read without pilesim; a chunk that is missing or cut is an exception."""

    ARRAYS = ("position", "orientation", "state")

    def __init__(self, store):
        self.attributes = (store / ".zattrs").read_bytes()
        self.frames = [self.read(store / name) for name in self.ARRAYS]
        self.count = min(map(len, self.frames))

    @staticmethod
    def read(directory):
        layout = json.loads((directory / ".zarray").read_text())
        rows, *rest = layout["shape"]
        per_chunk = layout["chunks"][0]
        chunks = []
        for index in range(-(-rows // per_chunk)):
            packed = (directory / ".".join([str(index), *("0" for _ in rest)])).read_bytes()
            values = numpy.frombuffer(zstd.decompress(packed), layout["dtype"])
            chunks.append(values.reshape([per_chunk, *rest]))
        return numpy.concatenate(chunks)[:rows] if chunks else numpy.zeros([0, *rest])

    def begins(self, other):
        """True: its frames are the first ones of the other's."""
        return all(
            numpy.array_equal(mine[: self.count], whole[: self.count])
            for mine, whole in zip(self.frames, other.frames)
        )


class Reference:
    """The output of an undisturbed run."""

    def __init__(self, place):
        self.files = tree(place)
        self.trajectories = {
            name: Trajectory(store) for name, store in stores(place).items()
        }


def check_trajectory(store, name, references):
    if not (store / ".zattrs").exists():
        return  # not yet a trajectory, which pilesim says when it is asked to draw it
    try:
        found = Trajectory(store)
    except (OSError, ValueError, RuntimeError) as fault:
        raise Broken(f"{name}: {fault!r}") from fault
    candidates = [
        (reference.trajectories[name], reference.files)
        for reference in references
        if name in reference.trajectories
    ]
    same = [c for c in candidates if c[0].attributes == found.attributes]
    require(same, name, "is of no run that was started")
    whole, files = same[0]
    require(found.count <= whole.count and found.begins(whole), name, "has other frames")
    for path, data in files.items():
        inside = path.startswith(f"{name}/") and path[len(name) + 1 :].split("/")[0]
        if inside and inside not in Trajectory.ARRAYS:
            there = store / path[len(name) + 1 :]
            require(there.exists() and there.read_bytes() == data, path, "is missing or another")


def check(place, references, own_files, shorter=False, killed=False):
    """After any accident. `references`: of the runs that may have left something here. `shorter`:
    the command was asked to stop and has brought its result to an end."""
    for name, text in own_files.items():
        require((place / name).read_text() == text, name, "was touched")
    there = stores(place)
    for name, store in there.items():
        check_trajectory(store, name, references)
    for name, data in tree(place).items():
        if name in own_files or any(name.startswith(store + "/") for store in there):
            continue
        if VOLATILE.search(name):
            check_volatile(name, data, killed)
        elif shorter and name.endswith(".mp4"):
            check_video(place / name)
        elif shorter and name.endswith(("piles.json", "guide.json")):
            json.loads(data)
        elif name.endswith("index.jsonl"):  # of the jobs so far
            lines = [line for reference in references for line in reference.files.get(name, b"").splitlines()]
            require(data.endswith(b"\n") or not data, name, "ends within a line")
            require(all(line in lines for line in data.splitlines()), name, "has another job")
        elif not name.endswith(".partial"):  # read by the run that goes on from it
            known = [reference.files.get(name) for reference in references]
            require(data in known, name, f"is not whole ({len(data)} bytes)")


def check_complete(place, reference, own_files):
    """After the command that brings it to its end."""
    check(place, [reference], own_files)
    require(not temporaries(place), "left behind:", *temporaries(place))
    found = tree(place)
    missing = {*reference.files} ^ {*found}
    require(not missing, "missing or left over:", *sorted(missing))
    for name, data in reference.files.items():
        if not VOLATILE.search(name):
            require(found[name] == data, name, "is another than without the accident")

