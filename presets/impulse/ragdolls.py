#!/usr/bin/env python3
"""Writes ragdolls.json of this folder: jointed dolls of 0.6 m that fall into a box.

Run it here after a change:  python3 ragdolls.py
"""
import json
import math
import random

DOLLS = 30
SHIRTS = ["red", "mustard", "teal", "cream"]
TROUSERS = ["navy", "brown", "grey"]

HEAD = """// Thirty dolls fall into a box. Their necks are ball joints, all other joints hinges with limits and friction:
// a motor that drives at no speed. Made by ragdolls.py.
{
  "version": 1,
  "name": "Ragdolls",
  "duration_s": 10,
  "until": "settled",
  "frame_rate": 30,
  "variables": {
%s
  },
  "materials": {
    "floor": {"friction": 0.8, "colour": "#b9b2a6"},
    "box": {"friction": 0.6, "look": "oak"},
%s
  },
  "shapes": {
    "floor": {"type": "plane"},
    "box": {"type": "bin", "size": [1.1, 0.3, 1.1], "thickness": 0.03},
    "head": {"type": "capsule", "radius": 0.042, "height": 0.115},
    "chest": {"type": "box", "size": [0.13, 0.16, 0.075]},
    "hips": {"type": "capsule", "radius": 0.035, "height": 0.13},
    "arm": {"type": "capsule", "radius": 0.02, "height": 0.13},
    "forearm": {"type": "capsule", "radius": 0.018, "height": 0.13},
    "thigh": {"type": "capsule", "radius": 0.027, "height": 0.165},
    "calf": {"type": "cylinder", "radius": 0.02, "height": 0.125},
    "foot": {"type": "box", "size": [0.04, 0.024, 0.085]},
    "shin": {"type": "compound", "parts": [
      {"shape": "calf", "position": [0, 0.012, 0]}, {"shape": "foot", "position": [0, -0.0625, 0.022]}]}
  },
  "bodies": [
    {"name": "floor", "shape": "floor", "material": "floor", "role": "static"},
    {"name": "box", "shape": "box", "material": "box", "role": "static"},
%s
  ],
  "joints": [
%s
  ],
  "render": {"light": {"name": "studio"}},
  "camera": {"keys": [
    {"time_s": 0, "position": [1.9, 2.1, 3.7], "target": [0, 0.88, 0]},
    {"time_s": 1.8, "position": [1.15, 1.75, 1.95], "target": [0, 0.2, 0]}]}
}
"""
FRICTION_NM = {"waist": 0.03, "shoulder": 0.008, "elbow": 0.003, "hip": 0.02, "knee": 0.006}
COLOURS = {"skin": "#e0ac8a", "red": "#b8402f", "mustard": "#d9a62e", "teal": "#2f8578", "cream": "#e8dcc0",
           "navy": "#2c3c5e", "brown": "#6b4a34", "grey": "#6a6c70"}


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def turn(axis, angle):
    """About a coordinate axis, in degrees."""
    c, s = math.cos(math.radians(angle)), math.sin(math.radians(angle))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix = [[float(row == column) for column in range(3)] for row in range(3)]
    matrix[i][i] = matrix[j][j] = c
    matrix[i][j], matrix[j][i] = -s, s
    return matrix


def rotation_deg(matrix):
    """Its angles about x, y and z, each about the axis as the ones before have turned it."""
    angles = (math.atan2(-matrix[1][2], matrix[2][2]), math.asin(max(-1, min(1, matrix[0][2]))),
              math.atan2(-matrix[0][1], matrix[0][0]))
    return [round(math.degrees(angle)) for angle in angles]


class Doll:
    """Faces +z, with the middle of its hips at the origin; `place` and `attitude` bring it into the world."""

    def __init__(self, number, place, attitude, shirt, trousers, spread):
        self.number, self.place, self.attitude = number, place, attitude
        self.bodies, self.joints = [], []
        self.body("hips", "hips", trousers, (0, 0, 0), turn(2, 90))
        self.body("chest", "chest", shirt, (0, 0.117, 0))
        self.hinge("chest", "hips", (0, 0, 0), (1, 0, 0), (-25, 75), "waist")
        self.body("head", "head", "skin", (0, 0.2625, 0))
        self.ball("head", "chest", (0, 0.201, 0))
        for side, sign in (("left", 1), ("right", -1)):
            shoulder = (sign * 0.088, 0.174, 0)
            elbow = self.limb(side + " arm", "arm", shirt, shoulder, sign * 35, 0.045, 0.09)
            self.hinge(side + " arm", "chest", shoulder, (1, 0, sign * spread), (-160, 50), "shoulder")
            down = self.limb(side + " forearm", "forearm", "skin", elbow, sign * 25, 0.047, 0.094, True)
            self.hinge(side + " forearm", side + " arm", elbow, (down[1], -down[0], 0), (0, 140), "elbow")
            hip = (sign * 0.04, -0.065, 0)
            knee = self.limb(side + " thigh", "thigh", trousers, hip, sign * 8, 0.0555, 0.111)
            self.hinge(side + " thigh", "hips", hip, (1, 0, sign * spread), (-110, 25), "hip")
            down = self.limb(side + " shin", "shin", trousers, knee, sign * 4, 0.0745, 0.149, True)
            self.hinge(side + " shin", side + " thigh", knee, (-down[1], down[0], 0), (0, 140), "knee")

    def limb(self, name, shape, material, top, outward, half, length, gives_direction=False):
        """Hangs from `top`, its own middle `half` below; returns its lower end, or where it points."""
        down = (math.sin(math.radians(outward)), -math.cos(math.radians(outward)), 0)
        self.body(name, shape, material, [t + half * d for t, d in zip(top, down)], turn(2, outward))
        return down if gives_direction else [t + length * d for t, d in zip(top, down)]

    def world(self, point):
        return [round(p + sum(row[k] * point[k] for k in range(3)), 3) for p, row in zip(self.place, self.attitude)]

    def direction(self, axis):
        return [round(sum(row[k] * axis[k] for k in range(3)), 2) for row in self.attitude]

    def body(self, name, shape, material, middle, own=None):
        attitude = product(self.attitude, own) if own else self.attitude
        self.bodies.append({"name": f"{self.number} {name}", "shape": shape, "material": material,
                            "position": self.world(middle), "rotation_deg": rotation_deg(attitude)})

    def join(self, a, b, point, keys):
        self.joints.append({"a": f"{self.number} {a}", "b": f"{self.number} {b}", "point": self.world(point)} | keys)

    def ball(self, a, b, point):
        """They collide, so that neither turns into the other."""
        self.join(a, b, point, {"type": "ball", "collide": True})

    def hinge(self, a, b, point, axis, limits, friction):
        """A motor that drives at no speed is friction: limbs that hang come to rest."""
        self.join(a, b, point, {"type": "hinge", "axis": self.direction(axis), "limits_deg": limits,
                                "motor": {"var": friction}})


def main():
    draw = random.Random(4)
    dolls = []
    for number in range(DOLLS):
        # Four in a layer, like the sails of a windmill, so that none begins inside another.
        layer, quarter = divmod(number, 4)
        around = turn(1, 90 * quarter)
        place = [sum(row[k] * (-0.2, 0, -0.33)[k] for k in range(3)) for row in around]
        place[1] = 0.3 + 0.27 * layer
        lies = product(turn(0, draw.choice((-90, 90)) + draw.uniform(-12, 12)), turn(1, draw.uniform(-25, 25)))
        attitude = product(around, product(turn(1, draw.choice((-90, 90)) + draw.uniform(-8, 8)), lies))
        dolls.append(Doll(number + 1, place, attitude, draw.choice(SHIRTS), draw.choice(TROUSERS),
                          draw.uniform(0, 0.5)))
    own = '"friction": 0.7, "restitution": 0.05, "density_kg_m3": 300, "rolling_friction": 0.1'
    materials = [f'    "{name}": {{{own}, "colour": "{colour}"}}' for name, colour in COLOURS.items()]
    friction = [f'    "{joint}": {{"turns_per_s": 0, "torque_nm": {most}}}' for joint, most in FRICTION_NM.items()]
    bodies = ["    " + json.dumps(body) for doll in dolls for body in doll.bodies]
    joints = ["    " + json.dumps(joint) for doll in dolls for joint in doll.joints]
    with open("ragdolls.json", "w", encoding="utf-8") as file:
        file.write(HEAD % tuple(",\n".join(lines) for lines in (friction, materials, bodies, joints)))


main()
