"""Builds a pile in Blender, in a scene of its own.

    blender --python THIS_FILE

or open it in Blender's text editor and run it there. The file of arrays named below lies beside it
and stays there: where bodies are instances, Blender reads their places from it in every frame, by
a handler that is saved with the .blend as a text (allow it to run scripts).
"""

import json
import os
import struct
import zipfile

import bpy
import numpy
from bpy.app.handlers import persistent

DATA, FORM = "pile.npz", "objects"

LINEAR, CONSTANT = 1, 0  # interpolations of keys
PAINT = "paint"  # the attribute with the colours of a mesh's own file
COAT_ROUGHNESS = 0.08  # of a body's clear coat


class Pile:
    """The arrays, y up as in pilesim, and read from disk only where they are used."""

    def __init__(self, path):
        self.path = path
        self.about = json.loads(bytes(self.array("about_json")))
        self.frame, self.shape, self.look = (self.array(n) for n in ("frame", "shape", "look"))
        self.position, self.orientation, self.state = (
            self.array(n) for n in ("position", "orientation", "state"))
        self.origin = numpy.array(self.about["origin_m"])

    def array(self, name):
        """An array of the uncompressed archive, mapped from the file."""
        with zipfile.ZipFile(self.path) as archive:
            place = archive.getinfo(name + ".npy").header_offset
        with open(self.path, "rb") as file:
            file.seek(place + 26)
            file.seek(sum(struct.unpack("<HH", file.read(4))), os.SEEK_CUR)
            numpy.lib.format.read_magic(file)
            shape, _, kind = numpy.lib.format.read_array_header_1_0(file)
            if 0 in shape:
                return numpy.zeros(shape, kind)
            return numpy.memmap(self.path, kind, "r", file.tell(), shape)

    def has(self, name):
        with zipfile.ZipFile(self.path) as archive:
            return name + ".npy" in archive.namelist()


# Blender has z up: rotate everything by 90 degrees about x.


def from_origin(pile, p, orientations=None, is_plane=False):
    """Positions relative to pile.origin, for Blender's single precision. A distant plane is at its nearest point."""
    p = p - pile.origin
    if not is_plane or not pile.origin.any():
        return p
    w, x, y, z = (orientations[..., i].astype(float) for i in range(4))
    normal = numpy.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], axis=-1)
    return (p * normal).sum(-1, keepdims=True) * normal


def turned_positions(p):
    return numpy.stack([p[..., 0], -p[..., 2], p[..., 1]], axis=-1)


def turned_orientations(q):
    w, x, y, z = (q[..., i] for i in range(4))
    return numpy.stack([w - x, x + w, y - z, z + y], axis=-1) * numpy.float32(0.5**0.5)


def eulers(q):
    """XYZ angles of unit quaternions; z follows from x, so that both fit where y is a right angle."""
    w, x, y, z = (q[..., i].astype(float) for i in range(4))
    down = 2 * (x * z - w * y)
    about_x = numpy.arctan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    s, c = numpy.sin(about_x), numpy.cos(about_x)
    about_y = numpy.arctan2(-down, 2 * (y * z + w * x) * s + (1 - 2 * (x * x + y * y)) * c)
    about_z = numpy.arctan2(2 * (x * z + w * y) * s - 2 * (x * y - w * z) * c,
                            (1 - 2 * (x * x + z * z)) * c - 2 * (y * z - w * x) * s)
    return numpy.stack([about_x, about_y, about_z], axis=-1)


def linear_of(srgb):
    c = numpy.asarray(srgb) / 255
    return numpy.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)


def make_image(name, pixels):
    """A picture packed into the .blend. `pixels`: sRGB bytes, rows from the top; Blender's start at the bottom."""
    height, width, _ = pixels.shape
    rows = numpy.ones((height, width, 4), numpy.float32)
    rows[..., :3] = pixels[::-1] / numpy.float32(255)
    image = bpy.data.images.new(name, width, height)
    image.pixels.foreach_set(rows.ravel())
    image.update()
    image.pack()
    return image


class Materials:
    """Materials by look and texture, each made when it is first needed."""

    def __init__(self, pile):
        self.pile, self.made, self.images = pile, {}, {}

    def of(self, look, texture):
        """`texture`: 1 + number of the picture, 0: none."""
        if (look, texture) not in self.made:
            self.made[look, texture] = self.make(look, texture)
        return self.made[look, texture]

    def make(self, look, texture):
        name, colour, painted, roughness, coat = (
            self.pile.about["look_" + what][look] for what in ("name", "colour", "painted", "roughness", "clear_coat"))
        material = bpy.data.materials.new(name + (f" texture {texture}" if texture else ""))
        material.use_nodes = True
        nodes, linear = material.node_tree.nodes, linear_of(colour)
        shader = next(n for n in nodes if n.type == "BSDF_PRINCIPLED")
        shader.inputs["Base Color"].default_value = (*linear, 1)
        shader.inputs["Roughness"].default_value = roughness
        new = bpy.app.version >= (4, 0, 0)
        shader.inputs["Coat Weight" if new else "Clearcoat"].default_value = coat
        shader.inputs["Coat Roughness" if new else "Clearcoat Roughness"].default_value = COAT_ROUGHNESS
        metallic, transmission, emission = (
            self.pile.about["look_" + what][look] for what in ("metallic", "transmission", "emission"))
        shader.inputs["Metallic"].default_value = metallic
        shader.inputs["Transmission Weight" if new else "Transmission"].default_value = transmission
        shader.inputs["Emission Color" if new else "Emission"].default_value = (*linear, 1)
        shader.inputs["Emission Strength"].default_value = emission
        material.diffuse_color = (*linear, 1)
        if texture:
            paint = nodes.new("ShaderNodeTexImage")
            paint.image = self.image(texture)
        elif painted:
            paint = nodes.new("ShaderNodeAttribute")
            paint.attribute_name = PAINT
        if painted:
            material.node_tree.links.new(paint.outputs["Color"], shader.inputs["Base Color"])
        return material

    def image(self, texture):
        if texture not in self.images:
            pixels = numpy.asarray(self.pile.array(f"texture_{texture - 1}"))
            self.images[texture] = make_image(f"texture {texture}", pixels)
        return self.images[texture]


def add_materials(mesh, pile, materials, shape, look):
    """The look's material or, if painted, one per texture of the mesh, with texture coordinates."""
    texture = f"shape_{shape}_texture"
    if not pile.about["look_painted"][look] or not pile.has(texture):
        mesh.materials.append(materials.of(look, 0))
        return
    numbers, of_triangle = numpy.unique(pile.array(texture), return_inverse=True)
    for number in numbers.tolist():
        mesh.materials.append(materials.of(look, number))
    mesh.polygons.foreach_set("material_index", of_triangle.astype(numpy.int32))
    places = numpy.array(pile.array(f"shape_{shape}_uv"), numpy.float32)
    places[..., 1] = 1 - places[..., 1]  # from the lower edge
    mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", places.ravel())


def make_meshes(pile):
    """(shape, look) -> the mesh that all such bodies share."""
    materials, meshes = Materials(pile), {}
    for shape, look in sorted(set(zip(pile.shape.tolist(), pile.look.tolist()))):
        name = pile.about["shape_name"][shape]
        vertices = pile.array(f"shape_{shape}_vertices")
        triangles = pile.array(f"shape_{shape}_triangles")
        mesh = bpy.data.meshes.new(name)
        mesh.vertices.add(len(vertices))
        mesh.vertices.foreach_set("co", vertices.ravel())
        mesh.loops.add(3 * len(triangles))
        mesh.loops.foreach_set("vertex_index", triangles.astype(numpy.int32).ravel())
        mesh.polygons.add(len(triangles))
        starts = numpy.arange(0, 3 * len(triangles), 3, dtype=numpy.int32)
        mesh.polygons.foreach_set("loop_start", starts)
        if bpy.app.version < (4, 1, 0):
            mesh.polygons.foreach_set("loop_total", numpy.full(len(triangles), 3, numpy.int32))
        mesh.polygons.foreach_set("use_smooth", numpy.ones(len(triangles), bool))
        add_materials(mesh, pile, materials, shape, look)
        if pile.about["look_painted"][look]:
            colours = linear_of(pile.array(f"shape_{shape}_colours"))
            paint = mesh.attributes.new(PAINT, "FLOAT_COLOR", "CORNER")
            rows = numpy.concatenate([colours, numpy.ones((len(colours), 1))], axis=1)
            paint.data.foreach_set("color", numpy.repeat(rows, 3, axis=0).astype(numpy.float32).ravel())
        mesh.update(calc_edges=True)
        if hasattr(mesh, "use_auto_smooth"):  # up to 4.0
            mesh.use_auto_smooth = True
            mesh.auto_smooth_angle = numpy.radians(38)
        elif hasattr(mesh, "set_sharp_from_angle"):
            mesh.set_sharp_from_angle(angle=numpy.radians(38))
        meshes[shape, look] = mesh
    return meshes


def set_keys(action, path, frames, values, interpolation=LINEAR):
    """`values`: one row per frame, one column per axis."""
    for axis in range(values.shape[1]):
        curve = action.fcurves.new(path, index=axis)
        curve.keyframe_points.add(len(frames))
        keys = numpy.stack([frames, values[:, axis]], axis=-1).astype(numpy.float32)
        curve.keyframe_points.foreach_set("co", keys.ravel())
        curve.keyframe_points.foreach_set("interpolation", [interpolation] * len(frames))
        curve.update()


def place(thing, frames, positions, orientations):
    """Keys at both ends of every stretch of rest, and in each frame with motion."""
    thing.rotation_mode = "QUATERNION"
    thing.location, thing.rotation_quaternion = positions[0], orientations[0]
    moved = (positions[1:] != positions[:-1]).any(1) | (orientations[1:] != orientations[:-1]).any(1)
    if not moved.any():
        return
    keep = numpy.append(True, moved) | numpy.append(moved, False)
    action = thing.animation_data_create().action = bpy.data.actions.new(thing.name)
    set_keys(action, "location", frames[keep], positions[keep])
    set_keys(action, "rotation_quaternion", frames[keep], orientations[keep])


def hide_where_absent(thing, frames, present):
    if present.all():
        return
    animation = thing.animation_data_create()
    if animation.action is None:
        animation.action = bpy.data.actions.new(thing.name)
    keep = numpy.append(True, present[1:] != present[:-1])
    for path in ("hide_viewport", "hide_render"):
        curve = animation.action.fcurves.new(path)
        for frame, there in zip(frames[keep], present[keep]):
            curve.keyframe_points.insert(frame, 0 if there else 1).interpolation = "CONSTANT"


def build_objects(pile, collection):
    meshes = make_meshes(pile)
    for body, name in enumerate(pile.about.get("body_name", [])):
        mesh = meshes[int(pile.shape[body]), int(pile.look[body])]
        thing = bpy.data.objects.new(name, mesh)
        collection.objects.link(thing)
        places = from_origin(pile, pile.position[:, body], pile.orientation[:, body],
                             pile.about["shape_plane"][int(pile.shape[body])])
        place(thing, pile.frame, turned_positions(places),
              turned_orientations(pile.orientation[:, body]))
        hide_where_absent(thing, pile.frame, pile.state[:, body] & 1 == 1)
        thing["pilesim_id"] = int(pile.array("id")[body])


def make_nodes(prototypes):
    """Geometry nodes that instance at each point the prototype its attributes select."""
    tree = bpy.data.node_groups.new("pile", "GeometryNodeTree")
    if hasattr(tree, "interface"):  # from 4.0 on
        tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
        tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    else:
        tree.inputs.new("NodeSocketGeometry", "Geometry")
        tree.outputs.new("NodeSocketGeometry", "Geometry")

    def attribute(name, kind):
        node = tree.nodes.new("GeometryNodeInputNamedAttribute")
        node.data_type = kind
        node.inputs["Name"].default_value = name
        return next(s for s in node.outputs if s.enabled and s.name == "Attribute")

    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    source = tree.nodes.new("GeometryNodeCollectionInfo")
    source.inputs["Collection"].default_value = prototypes
    source.inputs["Separate Children"].default_value = True
    source.inputs["Reset Children"].default_value = True
    instance = tree.nodes.new("GeometryNodeInstanceOnPoints")
    instance.inputs["Pick Instance"].default_value = True
    for output, socket in [
        (start.outputs[0], "Points"),
        (attribute("present", "BOOLEAN"), "Selection"),
        (source.outputs[0], "Instance"),
        (attribute("prototype", "INT"), "Instance Index"),
        (attribute("rotation", "FLOAT_VECTOR"), "Rotation"),
    ]:  # fmt: skip
        tree.links.new(output, instance.inputs[socket])
    tree.links.new(instance.outputs[0], end.inputs[0])
    return tree


def build_instances(pile, collection):
    meshes = make_meshes(pile)
    prototypes = bpy.data.collections.new("prototypes")
    collection.children.link(prototypes)
    # Nodes index them in the order of their names.
    number = {key: i for i, key in enumerate(sorted(meshes))}
    for key, mesh in meshes.items():
        prototypes.objects.link(bpy.data.objects.new(f"{number[key]:06d} {mesh.name}", mesh))
    nodes = make_nodes(prototypes)
    moves = pile.array("moves") == 1
    for name, bodies in (("moving", numpy.flatnonzero(moves)), ("resting", numpy.flatnonzero(~moves))):
        mesh = bpy.data.meshes.new("pile " + name)
        mesh.vertices.add(len(bodies))
        of_body = numpy.array([number[key] for key in zip(pile.shape.tolist(), pile.look.tolist())])
        for attribute, kind, values in (
            ("rotation", "FLOAT_VECTOR", None),
            ("present", "BOOLEAN", None),
            ("prototype", "INT", of_body[bodies] if len(bodies) else bodies),
            ("pilesim_id", "INT", pile.array("id")[bodies]),
        ):
            layer = mesh.attributes.new(attribute, kind, "POINT")
            if values is not None:
                layer.data.foreach_set("value", values.astype(numpy.int32))
        mesh["pilesim_bodies"] = name
        set_points(pile, mesh, bodies, 0)
        thing = bpy.data.objects.new("pile " + name, mesh)
        thing.modifiers.new("pile", "NODES").node_group = nodes
        collection.objects.link(thing)
    return prototypes


def set_points(pile, mesh, bodies, frame):
    """Poses at a frame of the trajectory, linear in between."""
    last = len(pile.frame) - 1
    after = int(numpy.clip(numpy.searchsorted(pile.frame, frame, "right"), min(1, last), last))
    before = max(0, after - 1)
    span = max(1, pile.frame[after] - pile.frame[before])
    share = numpy.float32(numpy.clip((frame - pile.frame[before]) / span, 0, 1))

    def at(array):
        start, end = array[before][bodies], array[after][bodies]
        return start if share == 0 else end if share == 1 else start + share * (end - start)

    q = at(pile.orientation)
    q = q / numpy.linalg.norm(q, axis=-1, keepdims=True)
    is_plane = numpy.array(pile.about["shape_plane"], bool)[pile.shape[bodies]]
    places = from_origin(pile, at(pile.position))
    places[is_plane] = from_origin(pile, at(pile.position)[is_plane], q[is_plane], True)
    points = turned_positions(places).astype(numpy.float32)
    angles = eulers(turned_orientations(q)).astype(numpy.float32)
    now = after if share == 1 else before
    mesh.vertices.foreach_set("co", points.ravel())
    mesh.attributes["rotation"].data.foreach_set("vector", angles.ravel())
    mesh.attributes["present"].data.foreach_set("value", pile.state[now][bodies] & 1 == 1)
    mesh.update()


def open_pile(path):
    return Pile(path)


def is_mine(path):
    """True if a scene with this data follows its frames with this script."""
    return path.endswith(".npz")


@persistent
def follow(scene, _=None):
    """Moves the points of scenes built by this script to the scene's frame."""
    path = scene.get("pilesim_data")
    if path is None or not is_mine(path):
        return
    if not os.path.exists(path):  # it moved with the .blend
        path = bpy.path.abspath("//" + os.path.basename(path))
    if getattr(follow, "pile", None) is None or follow.pile.path != path:
        follow.pile = open_pile(path)
    bodies = numpy.flatnonzero(follow.pile.array("moves") == 1)
    for thing in scene.objects:
        if thing.type == "MESH" and thing.data.get("pilesim_bodies") == "moving":
            set_points(follow.pile, thing.data, bodies, scene.frame_current_final)


def add_camera(pile, scene, collection):
    if not pile.has("camera"):
        return
    rows = pile.array("camera")
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.sensor_fit = "VERTICAL"
    camera.data.angle = rows[0, 7]
    camera.data.clip_end = 1e4
    collection.objects.link(camera)
    place(camera, pile.frame[:len(rows)], turned_positions(from_origin(pile, rows[:, :3])),
          turned_orientations(rows[:, 3:7]))
    if (rows[:, 7] != rows[0, 7]).any():
        lens = camera.data.sensor_height / 2 / numpy.tan(rows[:, 7:] / 2)
        action = camera.data.animation_data_create().action = bpy.data.actions.new("lens")
        set_keys(action, "lens", pile.frame, lens)
    scene.camera = camera


def add_light(scene, collection):
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    sky = next(n for n in scene.world.node_tree.nodes if n.type == "BACKGROUND")
    sky.inputs["Color"].default_value = (0.5, 0.55, 0.6, 1)
    sun = bpy.data.objects.new("sun", bpy.data.lights.new("sun", "SUN"))
    sun.data.energy = 3
    sun.rotation_euler = (0.6, -0.5, 0)
    collection.objects.link(sun)


def build_scene(pile, name, form):
    """A scene with the pile. `form`: "objects" or "instances"."""
    scene = bpy.data.scenes.new(name)
    if bpy.context.window:
        bpy.context.window.scene = scene
    rate = pile.about["frame_rate"]
    scene.render.fps = max(1, round(rate))
    scene.render.fps_base = scene.render.fps / rate
    scene.frame_start, scene.frame_end = int(pile.frame[0]), int(pile.frame[-1])
    scene.render.resolution_y = round(scene.render.resolution_x / pile.about["aspect"])
    collection = bpy.data.collections.new("pile")
    collection["pilesim_origin_m"] = pile.origin.tolist()
    scene.collection.children.link(collection)
    if form == "objects":
        build_objects(pile, collection)
    else:
        prototypes = build_instances(pile, collection)
        layers = scene.view_layers[0].layer_collection.children[collection.name]
        layers.children[prototypes.name].exclude = True
        scene["pilesim_data"] = pile.path
    add_camera(pile, scene, collection)
    add_light(scene, collection)
    scene.frame_set(scene.frame_start)
    return scene


def keep_script():
    """Saves the script in the .blend, so that the scene follows its frames when opened."""
    name = os.path.splitext(DATA)[0] + ".py"
    text = bpy.data.texts.get(name)
    if text is None and os.path.isfile(__file__):
        text = bpy.data.texts.load(os.path.abspath(__file__), internal=True)
        text.name = name
    if text is not None:
        text.use_module = True


def folder_of_data():
    if os.path.isfile(__file__):
        return os.path.dirname(os.path.abspath(__file__))
    # Run in the text editor, where its name is not a file's.
    text = bpy.data.texts.get(os.path.basename(__file__))
    return os.path.dirname(bpy.path.abspath(text.filepath)) if text else os.getcwd()


def build():
    path = os.path.join(folder_of_data(), DATA)
    build_scene(Pile(path), os.path.splitext(DATA)[0], FORM)
    if FORM == "instances":
        keep_script()


def register():
    if FORM == "instances":
        bpy.app.handlers.frame_change_pre.append(follow)


def is_built():
    """Blender runs a text saved with the .blend when it is opened."""
    return any(os.path.basename(scene.get("pilesim_data", "")) == DATA for scene in bpy.data.scenes)


if __name__ == "__main__":
    if not is_built():
        build()
    register()
