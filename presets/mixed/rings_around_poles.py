#!/usr/bin/python3
"""The share of rings that end around a pole, of runs of rings_and_poles.json:
rings_around_poles.py OUT... (needs python3-zarr)"""
import sys

import numpy
import zarr

INNER_RADIUS_M = 0.09
POLE_HEIGHT_M = 1.5


def share_around(directory):
    store = zarr.open(directory + "/trajectory.zarr", "r")
    names = list(store.attrs["body_name"])
    position = store["position"][-1].astype(float)
    w, x, y, z = store["orientation"][-1].astype(float).T
    # The ring's axis, its own y, in the world.
    axis = numpy.stack([2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)], axis=1)
    rings = [i for i, name in enumerate(names) if name.startswith("rings/")]
    poles = [i for i, name in enumerate(names) if name.startswith("body/")]
    around = 0
    for ring in rings:
        # Where a pole's line goes through the plane of the ring.
        to_pole = position[poles] - position[ring]
        rise = -(to_pole @ axis[ring]) / axis[ring][1] if axis[ring][1] != 0 else numpy.inf
        through = to_pole + numpy.outer(rise, [0, 1, 0])
        in_hole = numpy.linalg.norm(through, axis=1) < INNER_RADIUS_M
        below_tip = position[ring][1] + through[:, 1] < POLE_HEIGHT_M
        around += bool(numpy.any(in_hole & below_tip))
    return around / len(rings)


for argument in sys.argv[1:]:
    print(f"{argument}: {100 * share_around(argument):.1f} %")
