#!/usr/bin/env python3
"""Writes the meshes of this folder as artists' programs leave them: in centimetres, z up, of parts that run into each other, with faces
missing where nobody looks and leaves of one face. None of them is a solid.

Run it here after a change:  python3 make_things.py
"""
import math

COLOURS = {
    "glaze": (0.16, 0.38, 0.43), "porcelain": (0.93, 0.91, 0.86), "wood": (0.72, 0.47, 0.27), "paint": (0.78, 0.27, 0.20),
    "terracotta": (0.76, 0.40, 0.26), "soil": (0.20, 0.14, 0.10), "leaf": (0.30, 0.50, 0.22), "stem": (0.42, 0.52, 0.24),
    "floor": (0.62, 0.49, 0.37), "floor_dark": (0.56, 0.43, 0.32), "wall": (0.86, 0.83, 0.77), "table": (0.42, 0.28, 0.19), "trim": (0.95, 0.94, 0.91),
}


class Mesh:
    """Faces by object and material; corners are counted from 0."""

    def __init__(self):
        self.vertices, self.parts = [], []

    def part(self, name, material):
        self.parts.append((name, material, []))

    def vertex(self, x, y, z):
        self.vertices.append((x, y, z))
        return len(self.vertices) - 1

    def face(self, *corners):
        self.parts[-1][2].append(corners)

    def rows(self, rows, closed=True):
        """Joins rows of corners, the next one above, seen from outside from left to right."""
        for low, high in zip(rows, rows[1:]):
            count = len(low)
            for i in range(count if closed else count - 1):
                j = (i + 1) % count
                self.face(low[i], low[j], high[j], high[i])

    def box(self, low, high, missing=(), slant=(0, 0)):
        """A box without the sides that are missing, such as "top"; its top is moved by `slant`."""
        corners = {}
        for x in (0, 1):
            for y in (0, 1):
                for z in (0, 1):
                    corners[x, y, z] = self.vertex((low[0], high[0])[x] + slant[0] * z, (low[1], high[1])[y] + slant[1] * z, (low[2], high[2])[z])
        sides = {
            "bottom": ((0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)), "top": ((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
            "front": ((0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)), "back": ((0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)),
            "left": ((0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)), "right": ((1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)),
        }
        for name, side in sides.items():
            if name not in missing:
                self.face(*(corners[key] for key in side))

    def lathe(self, profile, sides):
        """A profile of (radius, z) turned about z, from below outside to its end; what has no radius is a point."""
        last = None
        for radius, z in profile:
            if radius == 0:
                ring = [self.vertex(0, 0, z)]
            else:
                ring = [self.vertex(radius * math.cos(2 * math.pi * i / sides), radius * math.sin(2 * math.pi * i / sides), z) for i in range(sides)]
            if last is not None and len(last) == len(ring):
                self.rows([last, ring])
            elif last is not None and len(ring) == 1:
                for i in range(sides):
                    self.face(last[i], last[(i + 1) % sides], ring[0])
            elif last is not None:
                for i in range(sides):
                    self.face(last[0], ring[(i + 1) % sides], ring[i])
            last = ring

    def tube(self, path, radius, sides):
        """Along points of a plane that holds z; both ends are open."""
        rows = []
        for i, (x, y, z) in enumerate(path):
            a, b = path[max(i - 1, 0)], path[min(i + 1, len(path) - 1)]
            along = [q - p for p, q in zip(a, b)]
            length = math.sqrt(sum(v * v for v in along))
            dx, dy, dz = (v / length for v in along)
            flat = math.hypot(dx, dy)
            side = (-dy / flat, dx / flat, 0) if flat > 1e-6 else (0, 1, 0)
            up = (dy * side[2] - dz * side[1], dz * side[0] - dx * side[2], dx * side[1] - dy * side[0])
            rows.append([self.vertex(*(p + radius * (math.cos(t) * s + math.sin(t) * u) for p, s, u in zip((x, y, z), side, up)))
                         for t in (2 * math.pi * k / sides for k in range(sides))])
        self.rows(rows)

    def write(self, name):
        lines = ["mtllib things.mtl"] + ["v " + " ".join(f"{v:.4f}" for v in vertex) for vertex in self.vertices]
        for part, material, faces in self.parts:
            lines += [f"o {part}", f"usemtl {material}"] + ["f " + " ".join(str(c + 1) for c in face) for face in faces]
        with open(name, "w", encoding="utf-8") as file:
            file.write("\n".join(lines) + "\n")


def mug():
    """The glaze has no bottom, and the ends of the handle are open and stick in the wall."""
    mesh = Mesh()
    mesh.part("cup_outside", "glaze")
    mesh.lathe([(1.6, 0), (3.4, 0), (3.8, 0.5), (4.1, 2), (4.1, 8.8), (3.95, 9.0)], 40)
    mesh.part("cup_inside", "porcelain")
    mesh.lathe([(3.95, 9.0), (3.7, 8.8), (3.7, 2), (3.3, 0.9), (0, 0.7)], 40)
    mesh.part("handle", "glaze")
    mesh.tube([(3.9 + 2.7 * math.sin(t), 0, 4.9 + 2.6 * math.cos(t)) for t in (math.pi * k / 14 for k in range(15))], 0.55, 12)
    mesh.write("mug.obj")


def chair():
    """A doll's chair: legs without tops that end in the seat, rails that run through the posts."""
    mesh = Mesh()
    mesh.part("seat", "paint")
    mesh.box((-4, -4, 6), (4, 4, 6.9))
    mesh.part("legs", "wood")
    for x in (-1, 1):
        for y in (-1, 1):
            mesh.box((3.2 * x - 0.45, 3.2 * y - 0.45, 0), (3.2 * x + 0.45, 3.2 * y + 0.45, 6.5), missing=("top",))
    mesh.part("posts", "wood")
    for x in (-1, 1):
        mesh.box((3.2 * x - 0.45, 3.2, 6.3), (3.2 * x + 0.45, 4, 13.5), missing=("bottom",), slant=(0, 1.4))
    mesh.part("rails", "paint")
    for z, shift in ((8.6, 0.45), (10.6, 0.85), (12.4, 1.2)):
        mesh.box((-3.5, 3.35 + shift, z), (3.5, 3.85 + shift, z + 0.9))
    mesh.part("rungs", "wood")
    for y in (-1, 1):
        mesh.box((-3.3, 3.2 * y - 0.25, 2.6), (3.3, 3.2 * y + 0.25, 3.1), missing=("left", "right"))
    mesh.write("chair.obj")


def plant():
    """A pot with a lid of soil, stems that begin in it, leaves of one face."""
    mesh = Mesh()
    mesh.part("pot", "terracotta")
    mesh.lathe([(0, 0), (2.6, 0), (3.5, 4.6), (3.9, 4.6), (3.9, 5.8), (3.3, 5.8), (2.5, 0.8), (0, 0.8)], 32)
    mesh.part("soil", "soil")
    mesh.lathe([(3.4, 5.1), (0, 5.4)], 24)
    for k in range(7):
        turn, lean, high = 2 * math.pi * k / 7 + 0.3 * (k % 2), 2.2 + 0.5 * (k % 3), 8.6 + 0.9 * (k % 3)
        c, s = math.cos(turn), math.sin(turn)
        path = [(0.6 * c + lean * t * t * c, 0.6 * s + lean * t * t * s, 4.8 + (high - 4.8) * t) for t in (i / 5 for i in range(6))]
        mesh.part(f"stem_{k}", "stem")
        mesh.tube(path, 0.22, 6)
        mesh.part(f"leaf_{k}", "leaf")
        x, y, z = path[-1]
        length, wide = 3.6, 1.35
        rows = []
        for i in range(9):
            t = i / 8
            half = wide * math.sin(math.pi * min(1, t ** 0.8)) * (1 - 0.25 * t) + 0.02
            out, up = length * (t - 0.15 * t * t), 1.5 * t - 2.2 * t * t
            rows.append([mesh.vertex(x + out * c - side * half * s, y + out * s + side * half * c, z + up + 0.35 * abs(side) * half) for side in (-1, 0, 1)])
        mesh.rows(rows, closed=False)
    mesh.write("plant.obj")


def room():
    """Two walls of a set and a floor of boards, all one face thick, and a table whose legs end in its top."""
    mesh = Mesh()
    boards = 14
    for k in range(boards):
        mesh.part(f"board_{k}", "floor_dark" if k % 3 == 1 else "floor")
        low, high = -350 + 700 * k / boards, -350 + 700 * (k + 1) / boards
        mesh.face(*(mesh.vertex(*v, 0) for v in ((-400, low), (400, low), (400, high), (-400, high))))
    mesh.part("walls", "wall")
    # Around a window in the left one.
    x, near, far, sill, head = -400, -120, 120, 90, 220
    for y0, y1, z0, z1 in ((-350, near, 0, 290), (far, 350, 0, 290), (near, far, 0, sill), (near, far, head, 290)):
        mesh.face(*(mesh.vertex(x, *v) for v in ((y0, z0), (y1, z0), (y1, z1), (y0, z1))))
    mesh.face(*(mesh.vertex(*v) for v in ((-400, 350, 0), (400, 350, 0), (400, 350, 290), (-400, 350, 290))))
    mesh.part("frame", "trim")
    mesh.box((-404, near - 6, sill - 6), (-394, far + 6, sill))
    mesh.box((-404, near - 6, head), (-394, far + 6, head + 6))
    for y in (near - 6, -3, far):
        mesh.box((-404, y, sill - 2), (-394, y + 6, head + 2))
    mesh.part("skirting", "trim")
    mesh.box((-400, 348, 0), (400, 350, 10), missing=("back", "bottom"))
    mesh.box((-400, -350, 0), (-398, 350, 10), missing=("left", "bottom"))
    mesh.part("table", "table")
    mesh.box((-150, -85, 70), (150, 85, 75))
    for x in (-1, 1):
        for y in (-1, 1):
            mesh.box((138 * x - 5, 73 * y - 5, 0), (138 * x + 5, 73 * y + 5, 72), missing=("top", "bottom"))
    for y in (-1, 1):
        mesh.box((-138, 73 * y - 2, 60), (138, 73 * y + 2, 71), missing=("left", "right"))
    for x in (-1, 1):
        mesh.box((138 * x - 2, -73, 60), (138 * x + 2, 73, 71), missing=("front", "back"))
    mesh.write("room.obj")


def materials():
    with open("things.mtl", "w", encoding="utf-8") as file:
        for name, colour in COLOURS.items():
            file.write(f"newmtl {name}\nKd " + " ".join(f"{c:.3f}" for c in colour) + "\n")


if __name__ == "__main__":
    materials()
    mug()
    chair()
    plant()
    room()
