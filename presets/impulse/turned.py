#!/usr/bin/env python3
"""Writes drum.obj, bowl.obj, jar.obj, plate.obj, goblet.obj and bottle.obj of this folder: closed surfaces turned
about an axis.

Run it here after a change:  python3 turned.py
"""
import math

SIDES = 72


def turned(profile, point):
    """Vertices and triangles of a closed profile [(radius, along), ...] that begins and ends on the
    axis; `point` takes radius, along and angle to a vertex."""
    vertices, rows = [], []
    for radius, along in profile:
        if radius == 0:
            vertices.append(point(0, along, 0))
            rows.append([len(vertices)] * SIDES)
            continue
        first = len(vertices) + 1
        for i in range(SIDES):
            vertices.append(point(radius, along, 2 * math.pi * i / SIDES))
        rows.append([first + i for i in range(SIDES)])
    triangles = []
    for a, b in zip(rows, rows[1:]):
        for i in range(SIDES):
            j = (i + 1) % SIDES
            for corners in ((a[i], b[i], b[j]), (a[i], b[j], a[j])):
                if len(set(corners)) == 3:
                    triangles.append(corners)
    return vertices, triangles


def volume(vertices, triangles):
    total = 0
    for corners in triangles:
        (a, b, c), (d, e, f), (g, h, i) = (vertices[k - 1] for k in corners)
        total += a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return total / 6


def write(name, vertices, triangles):
    if volume(vertices, triangles) < 0:
        triangles = [(a, c, b) for a, b, c in triangles]
    with open(name, "w") as file:
        for x, y, z in vertices:
            file.write(f"v {x:.5g} {y:.5g} {z:.5g}\n")
        for a, b, c in triangles:
            file.write(f"f {a} {b} {c}\n")


def drum_point(radius, along, angle):
    # Eight lifters stand on the inside of the wall.
    if radius == 0.5:
        radius -= 0.06 * max(0, math.cos(8 * angle)) ** 2
    return radius * math.cos(angle), radius * math.sin(angle), along


def bowl_point(radius, along, angle):
    return radius * math.cos(angle), along, radius * math.sin(angle)


# Back, wall, the lip in front, and the inside.
DRUM = [(0, -0.28), (0.54, -0.28), (0.54, 0.28), (0.36, 0.28), (0.36, 0.25), (0.5, 0.25),
        (0.5, -0.25), (0, -0.25)]
# The floor rises a little towards its middle, so that parts walk along the wall.
BOWL = [(0, -0.01), (0.16, -0.015), (0.215, 0.075), (0.207, 0.075), (0.155, 0), (0, 0.012)]
# A foot, a belly and a lip.
JAR = [(0, 0), (0.085, 0), (0.115, 0.035), (0.118, 0.11), (0.105, 0.15), (0.111, 0.165),
       (0.105, 0.166), (0.099, 0.15), (0.112, 0.11), (0.109, 0.037), (0.082, 0.006), (0, 0.006)]

# A rim that rises 2 cm.
PLATE = [(0, 0), (0.075, 0), (0.085, 0.004), (0.125, 0.019), (0.125, 0.022), (0.082, 0.009), (0, 0.006)]
# A foot, a stem and a thin cup.
GOBLET = [(0, 0), (0.036, 0), (0.036, 0.002), (0.012, 0.006), (0.0045, 0.014), (0.004, 0.07), (0.008, 0.08),
          (0.03, 0.096), (0.04, 0.125), (0.038, 0.155), (0.034, 0.175), (0.033, 0.175), (0.0365, 0.155),
          (0.0385, 0.125), (0.029, 0.099), (0.012, 0.088), (0, 0.086)]
# Full: without an inside.
BOTTLE = [(0, 0), (0.034, 0), (0.037, 0.004), (0.037, 0.185), (0.033, 0.205), (0.016, 0.235), (0.0145, 0.25),
          (0.0145, 0.285), (0.0165, 0.287), (0.0165, 0.297), (0, 0.297)]

write("drum.obj", *turned(DRUM, drum_point))
write("bowl.obj", *turned(BOWL, bowl_point))
write("jar.obj", *turned(JAR, bowl_point))
write("plate.obj", *turned(PLATE, bowl_point))
write("goblet.obj", *turned(GOBLET, bowl_point))
write("bottle.obj", *turned(BOTTLE, bowl_point))
