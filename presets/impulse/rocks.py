#!/usr/bin/env python3
"""Writes rock_1.obj to rock_3.obj of this folder: balls of radius 0.5 that random planes have cut.

Run it here after a change:  python3 rocks.py
"""
import math
import random

CUTS = 22


def ball(rings, sides):
    """Directions to the vertices and triangles of a ball."""
    directions = [(0, 1, 0)]
    for ring in range(1, rings):
        polar = math.pi * ring / rings
        for side in range(sides):
            around = 2 * math.pi * (side + 0.5 * (ring % 2)) / sides
            directions.append((math.sin(polar) * math.cos(around), math.cos(polar), math.sin(polar) * math.sin(around)))
    directions.append((0, -1, 0))
    last = len(directions) - 1
    triangles = []
    for side in range(sides):
        after = (side + 1) % sides
        triangles.append((0, 1 + after, 1 + side))
        triangles.append((last, last - sides + side, last - sides + after))
        for ring in range(rings - 2):
            upper, lower = 1 + ring * sides, 1 + (ring + 1) * sides
            # The ring of odd number stands half a side farther around.
            to = (after, side) if ring % 2 == 0 else (side, after)
            triangles.append((upper + side, upper + after, lower + to[0]))
            triangles.append((lower + side, upper + to[1], lower + after))
    return directions, triangles


def rock(seed):
    draw = random.Random(seed)
    planes = []
    for _ in range(CUTS):
        normal = [draw.gauss(0, 1) for _ in range(3)]
        length = math.hypot(*normal)
        planes.append(([v / length for v in normal], draw.uniform(0.3, 0.46)))
    directions, triangles = ball(8, 13)
    vertices = []
    for direction in directions:
        radius = 0.5
        for normal, distance in planes:
            towards = sum(a * b for a, b in zip(normal, direction))
            if towards > 0:
                radius = min(radius, distance / towards)
        vertices.append([radius * v for v in direction])
    return vertices, triangles


for number in (1, 2, 3):
    vertices, triangles = rock(number)
    with open(f"rock_{number}.obj", "w") as file:
        for vertex in vertices:
            file.write("v %.4f %.4f %.4f\n" % tuple(vertex))
        for triangle in triangles:
            file.write("f %d %d %d\n" % tuple(i + 1 for i in triangle))
