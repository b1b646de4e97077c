"""Compares an export in Blender with the trajectory; by hand, no part of the test suite.

    blender -b --factory-startup --python tests/external/check_in_blender.py -- FILE OUT [FORM]

FILE: a .glb, .gltf or .py of pilesim export of all frames and bodies of OUT, or the add-on import_pilesim.py, which
reads OUT itself (FORM: objects or instances). Prints the largest
differences of places (m) and of quaternions' components, and how often a body is shown or hidden wrongly.
Wants python3-zarr in Blender's Python, as Debian's has it.
"""

import runpy
import sys

import bpy
import numpy
import zarr
from mathutils import Quaternion

# The glTF importer of Blender 3.4 asks for what numpy 1.24 no longer has.
if not hasattr(numpy, "bool"):
    numpy.bool = bool

Z_UP = Quaternion((0.5**0.5, 0.5**0.5, 0, 0))


def open_file(file, rate, out, form):
    """Whether mesh coordinates were turned to z up, too."""
    if file.endswith("import_pilesim.py"):
        runpy.run_path(file, run_name="__main__")
        bpy.ops.import_scene.pilesim(directory=out, form=form)
        return False
    if file.endswith(".py"):
        runpy.run_path(file, run_name="__main__")
        return False
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    bpy.context.scene.render.fps, bpy.context.scene.render.fps_base = round(rate), round(rate) / rate
    bpy.ops.import_scene.gltf(filepath=file)
    return True


def shown_bodies(names, turned):
    """(index, world matrix) of the objects that have the name of a body and are to be seen."""
    graph = bpy.context.evaluated_depsgraph_get()
    for thing in bpy.context.scene.objects:
        index = names.get(thing.name)
        now = thing.evaluated_get(graph)
        matrix = now.matrix_world
        if index is not None and not now.hide_render and min(matrix.to_scale()) > 0.5:
            yield index, matrix @ Z_UP.to_matrix().to_4x4() if turned else matrix


def shown_instances(places):
    """The same of instances, which have no names: the nearest body."""
    for instance in bpy.context.evaluated_depsgraph_get().object_instances:
        if instance.is_instance:
            matrix = instance.matrix_world.copy()
            yield int(abs(places - numpy.array(matrix.translation)).max(1).argmin()), matrix


def main():
    file, out, *more = sys.argv[sys.argv.index("--") + 1 :]
    store = zarr.open(out + "/trajectory.zarr", "r")
    turned = open_file(file, store.attrs["frame_rate"], out, *(more or ["auto"]))
    names = {name: i for i, name in enumerate(store.attrs["body_name"])}
    instances = any(thing.modifiers for thing in bpy.context.scene.objects)
    worst_place = worst_turn = wrong = poses = 0
    for frame in range(len(store["position"])):
        bpy.context.scene.frame_set(frame)
        present = store["state"][frame] & 1 == 1
        p = store["position"][frame]
        places = numpy.stack([p[:, 0], -p[:, 2], p[:, 1]], -1)
        visible = places + numpy.where(present, 0, 1e9)[:, None]
        seen = list(shown_instances(visible) if instances else shown_bodies(names, turned))
        wrong += abs(len(seen) - present.sum()) + sum(not present[i] for i, _ in seen)
        for i, matrix in seen:
            q, expected = matrix.to_quaternion(), Z_UP @ Quaternion(store["orientation"][frame, i].tolist())
            if q.dot(expected) < 0:
                q.negate()
            worst_place = max(worst_place, abs(numpy.array(matrix.translation) - places[i]).max())
            worst_turn = max(worst_turn, *(abs(a - b) for a, b in zip(q, expected)))
            poses += 1
    print(f"Blender {bpy.app.version_string}, {file}: {poses} poses; places differ by {worst_place:.2g} m, "
          f"quaternions by {worst_turn:.2g}; {wrong} shown or hidden wrongly")


main()
