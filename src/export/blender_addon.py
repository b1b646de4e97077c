"""An add-on for Blender that imports what pilesim simulate has written: File > Import > pilesim.

Edit > Preferences > Add-ons > Install takes this file. Where bodies become instances, Blender reads their places
from the run's directory in every frame: it stays there, and the add-on stays enabled.
"""

# CMake puts blender_import.py before this part, which turns its functions into an add-on: it reads
# a pile from the Zarr store itself, without an export.

bl_info = {
    "name": "pilesim",
    "description": "Imports piles that pilesim has simulated",
    "location": "File > Import > pilesim",
    "blender": (3, 0, 0),
    "version": (0, 1, 0),
    "category": "Import-Export",
}

MOST_OBJECTS = 1000  # above it bodies become instances, as in pilesim export
MOST_GLOSSES, GLOSS_STEPS = 64, numpy.array([10, 5])  # further ones are rounded to tenths and fifths
PLAIN_GLOSS = 0.45, 0  # roughness and clear coat of runs that do not specify them
MOST_HELD = 64  # chunks of frames that are kept in memory


class NoPile(Exception):
    """An error in a directory, in words."""


def decompressor():
    """A function that unpacks zstd with Blender's Python package or the system's library."""
    try:
        import zstandard

        return lambda data, size: zstandard.ZstdDecompressor().decompress(data, max_output_size=size)
    except ImportError:
        pass
    import ctypes
    import ctypes.util

    name = ctypes.util.find_library("zstd")
    try:
        library = ctypes.CDLL(name or "libzstd.so.1")
    except OSError as fault:
        raise NoPile("there is neither Python's package zstandard nor the library libzstd: install one of them") from fault
    library.ZSTD_decompress.restype = ctypes.c_size_t
    library.ZSTD_decompress.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]

    def unpack(data, size):
        place = ctypes.create_string_buffer(size)
        if library.ZSTD_decompress(place, size, data, len(data)) != size:
            raise NoPile("a chunk of the trajectory is damaged")
        return place.raw

    return unpack


class Array:
    """One array of the store; frames (or rows) are read on demand."""

    def __init__(self, folder, unpack):
        self.folder, self.unpack, self.held = folder, unpack, {}
        with open(os.path.join(folder, ".zarray"), encoding="utf-8") as file:
            about = json.load(file)
        if about["zarr_format"] != 2 or about["order"] != "C" or about["filters"]:
            raise NoPile(f"{folder} is none of pilesim's arrays")
        self.shape, self.chunks = tuple(about["shape"]), tuple(about["chunks"])
        self.kind, self.fill = numpy.dtype(about["dtype"]), about["fill_value"]
        self.compressed = about["compressor"] is not None

    def __len__(self):
        return self.shape[0]

    def chunk(self, number):
        """Rows, chunk by chunk along the first axis; a chunk spans the other axes."""
        if number not in self.held:
            while len(self.held) >= MOST_HELD:
                self.held.pop(next(iter(self.held)))
            name = ".".join([str(number)] + ["0"] * (len(self.shape) - 1))
            path = os.path.join(self.folder, name)
            if os.path.isfile(path):
                with open(path, "rb") as file:
                    data = file.read()
                if self.compressed:
                    data = self.unpack(data, self.kind.itemsize * int(numpy.prod(self.chunks)))
                self.held[number] = numpy.frombuffer(data, self.kind).reshape(self.chunks)
            else:
                self.held[number] = numpy.full(self.chunks, self.fill, self.kind)
        return self.held[number]

    def whole(self):
        if 0 in self.shape:
            return numpy.zeros(self.shape, self.kind)
        count = -(-self.shape[0] // self.chunks[0])
        return numpy.concatenate([self.chunk(i) for i in range(count)])[: self.shape[0]]

    def __getitem__(self, frame):
        return self.chunk(frame // self.chunks[0])[frame % self.chunks[0]]


class Store:
    """A trajectory with the interface of Pile, read from the Zarr store."""

    def __init__(self, path):
        self.path = path
        try:
            with open(os.path.join(path, ".zattrs"), encoding="utf-8") as file:
                self.attributes = json.load(file)
        except OSError as fault:
            raise NoPile(f"{path} is no trajectory: choose the output directory of pilesim simulate") from fault
        found = self.attributes.get("format"), self.attributes.get("format_version")
        if found != ("pilesim-trajectory", 3):
            raise NoPile(f"{path} is {found[0]} of version {found[1]}; this add-on reads pilesim-trajectory of version 3")
        self.unpack = decompressor()
        self.position, self.orientation, self.state = (self.stored(n) for n in ("position", "orientation", "state"))
        self.frame = numpy.arange(len(self.position))
        if not len(self.frame):
            raise NoPile(f"{path} holds no frames")
        self.shape = self.stored("body_shape").whole()
        material, colour = self.stored("body_material").whole(), self.stored("body_colour").whole()
        painted = numpy.zeros(len(material), bool)
        if os.path.isdir(os.path.join(path, "body_painted")):
            painted = self.stored("body_painted").whole().astype(bool)
        gloss = self.gloss_of_bodies()
        of_body = list(zip(material.tolist(), map(tuple, colour.tolist()), painted.tolist(), map(tuple, gloss.tolist())))
        looks = sorted(set(of_body))
        number = {look: i for i, look in enumerate(looks)}
        self.look = numpy.array([number[key] for key in of_body], int)
        scene = self.attributes["scene"]
        size = scene["render"]["size"]
        self.about = {
            "body_name": self.attributes["body_name"],
            "shape_name": [shape["name"] for shape in self.attributes["shapes"]],
            "shape_plane": [shape["plane"] for shape in self.attributes["shapes"]],
            "look_name": [self.attributes["materials"][m] + " %02x%02x%02x" % c for m, c, _, _ in looks],
            "look_colour": [c for _, c, _, _ in looks],
            "look_painted": [p for _, _, p, _ in looks],
            "look_roughness": [g[0] for _, _, _, g in looks],
            "look_clear_coat": [g[1] for _, _, _, g in looks],
            "look_metallic": [g[2] for _, _, _, g in looks],
            "look_transmission": [g[3] for _, _, _, g in looks],
            "look_emission": [g[4] for _, _, _, g in looks],
            "frame_rate": self.attributes["frame_rate"],
            "aspect": size[0] / size[1],
        }
        self.origin = self.near_origin()
        self.made = {"id": numpy.arange(len(self.shape)), "moves": self.stored("body_moves").whole()}
        if "camera" in scene:
            self.made["camera"] = camera_rows(scene["camera"], self.frame / self.attributes["frame_rate"])

    def near_origin(self):
        """The world's origin or, if the pile is far away, the middle of all bodies but planes at the end."""
        is_plane = numpy.array(self.about["shape_plane"], bool)
        solid = self.position[len(self.frame) - 1][~is_plane[self.shape]]
        if not len(solid):
            return numpy.zeros(3)
        low, high = solid.min(0), solid.max(0)
        middle = (low + high) / 2
        extent = numpy.linalg.norm(high - low) + self.largest_radius()
        return middle.astype("f4").astype(float) if numpy.linalg.norm(middle) > 64 * extent else numpy.zeros(3)

    def largest_radius(self):
        radii = [0.0]
        for number, is_plane in enumerate(self.about["shape_plane"]):
            if not is_plane:
                radii.append(numpy.linalg.norm(self.stored(f"shapes/{number}/vertices").whole(), axis=-1).max(initial=0))
        return max(radii)

    def gloss_of_bodies(self):
        """Roughness, clear coat, metallic, transmission and emission, as in pilesim export: rounded if there
        are many, and planes matt."""
        gloss = numpy.full((len(self.shape), 2), PLAIN_GLOSS)
        if os.path.isdir(os.path.join(self.path, "body_gloss")):
            gloss = self.stored("body_gloss").whole().astype(float)
        if len(numpy.unique(gloss, axis=0)) > MOST_GLOSSES:
            gloss = numpy.round(gloss * GLOSS_STEPS) / GLOSS_STEPS
        plane = numpy.array([shape["plane"] for shape in self.attributes["shapes"]])
        gloss[plane[self.shape]] = 1, 0
        substance = numpy.zeros((len(self.shape), 3))
        if os.path.isdir(os.path.join(self.path, "body_substance")):
            substance = self.stored("body_substance").whole().astype(float)
        substance[plane[self.shape]] = 0
        return numpy.hstack([gloss, substance])

    def stored(self, name):
        return Array(os.path.join(self.path, *name.split("/")), self.unpack)

    def has(self, name):
        return name in self.made or os.path.isdir(os.path.join(self.path, self.place(name)))

    @staticmethod
    def place(name):
        """Path in the store of one of Pile's arrays: shape_2_uv is shapes/2/uv, texture_0 is textures/0."""
        kind, *inner = name.split("_")
        return os.path.join(kind + "s", *inner)

    def array(self, name):
        if name in self.made:
            return self.made[name]
        kind, shape, *what = name.split("_")
        if kind == "texture" or what[0] in ("colours", "texture", "uv"):
            return self.stored(self.place(name)).whole()
        if f"shape_{shape}_vertices" not in self.made:
            self.made[f"shape_{shape}_vertices"], self.made[f"shape_{shape}_triangles"] = self.mesh(int(shape))
        return self.made[name]

    def mesh(self, shape):
        """Distinct vertices, and triangles; a plane is a square twice as wide as the bodies' first and last positions."""
        if self.attributes["shapes"][shape]["plane"]:
            ends = numpy.concatenate([self.position[0], self.position[len(self.frame) - 1]]) - self.origin
            if self.origin.any():  # move planes there
                ends = numpy.delete(ends, numpy.tile(numpy.array(self.about["shape_plane"])[self.shape], 2), axis=0)
            r = 2 * float(abs(ends).max()) + 1
            return numpy.array([[-r, 0, -r], [-r, 0, r], [r, 0, r], [r, 0, -r]], "f4"), numpy.array([[0, 1, 2], [0, 2, 3]])
        vertices, triangles = (self.stored(f"shapes/{shape}/{part}").whole() for part in ("vertices", "triangles"))
        points, place = numpy.unique(vertices, axis=0, return_inverse=True)
        return points, place.reshape(-1)[triangles]


def camera_rows(camera, times):
    """Position, orientation w x y z and vertical field of view at these times, by the camera paths of docs/scene.md."""
    keys = camera["keys"] if "keys" in camera else [{"time_s": 0, **camera}]
    at = numpy.array([key["time_s"] for key in keys])
    values = numpy.array([[*key["position"], *key["target"], key["field_of_view_deg"], key.get("roll_deg", 0)] for key in keys], float)
    slopes = numpy.zeros_like(values)
    if len(keys) > 2:
        slopes[1:-1] = (values[2:] - values[:-2]) / (at[2:] - at[:-2])[:, None]
    rows = []
    for time in times if len(keys) > 1 else times[:1]:
        i = int(numpy.clip(numpy.searchsorted(at, time, "right") - 1, 0, max(0, len(keys) - 2)))
        j = min(i + 1, len(keys) - 1)
        span = max(at[j] - at[i], 1e-9)
        u = numpy.clip((time - at[i]) / span, 0, 1)
        value = ((2 * u**3 - 3 * u**2 + 1) * values[i] + (u**3 - 2 * u**2 + u) * span * slopes[i]
                 + (3 * u**2 - 2 * u**3) * values[j] + (u**3 - u**2) * span * slopes[j])
        rows.append([*value[:3], *towards(value[3:6] - value[:3], numpy.radians(value[7])), numpy.radians(value[6])])
    return numpy.array(rows)


def towards(way, roll):
    """w, x, y, z of a camera that looks along `way` with y up, rolled clockwise as seen from behind."""
    from mathutils import Matrix, Quaternion

    back = -way / numpy.linalg.norm(way)
    right = numpy.cross([0, 1, 0] if abs(back[1]) < 0.9999 else [0, 0, -1], back)
    right /= numpy.linalg.norm(right)
    axes = Matrix(numpy.stack([right, numpy.cross(back, right), back], axis=-1).tolist())
    return axes.to_quaternion() @ Quaternion((0, 0, 1), -roll)


def store_in(folder):
    folder = os.path.abspath(bpy.path.abspath(folder)).rstrip(os.sep)
    inner = os.path.join(folder, "trajectory.zarr")
    return inner if os.path.isdir(inner) else folder


def open_pile(path):
    return Store(path)


def is_mine(path):
    return path.endswith(".zarr")


class ImportPilesim(bpy.types.Operator):
    """Import a pile: choose the output directory of pilesim simulate"""

    bl_idname = "import_scene.pilesim"
    bl_label = "Import pilesim"
    bl_options = {"UNDO"}

    directory: bpy.props.StringProperty(subtype="DIR_PATH", description="The output directory of pilesim simulate")
    filter_folder: bpy.props.BoolProperty(default=True, options={"HIDDEN"})
    form: bpy.props.EnumProperty(
        name="Bodies as",
        items=[
            ("auto", "By their number", "Objects up to 1,000 bodies, instances of more"),
            ("objects", "Objects", "Each body an object with keys where it moves"),
            ("instances", "Instances", "Points of a mesh, with geometry nodes"),
        ],
        default="auto",
    )

    def invoke(self, context, _):
        context.window_manager.fileselect_add(self)
        return {"RUNNING_MODAL"}

    def execute(self, _):
        try:
            pile = Store(store_in(self.directory))
        except NoPile as fault:
            self.report({"ERROR"}, str(fault))
            return {"CANCELLED"}
        form = self.form
        if form == "auto":
            form = "objects" if len(pile.shape) <= MOST_OBJECTS else "instances"
        if form == "objects":
            pile.position, pile.orientation, pile.state = (a.whole() for a in (pile.position, pile.orientation, pile.state))
        build_scene(pile, os.path.basename(os.path.dirname(pile.path)) or "pile", form)
        return {"FINISHED"}


def menu(self, _):
    self.layout.operator(ImportPilesim.bl_idname, text="pilesim (directory of a run)")


def register():
    bpy.utils.register_class(ImportPilesim)
    bpy.types.TOPBAR_MT_file_import.append(menu)
    bpy.app.handlers.frame_change_pre.append(follow)


def unregister():
    bpy.app.handlers.frame_change_pre.remove(follow)
    bpy.types.TOPBAR_MT_file_import.remove(menu)
    bpy.utils.unregister_class(ImportPilesim)


if __name__ == "__main__":
    register()
