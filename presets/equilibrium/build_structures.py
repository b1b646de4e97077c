#!/usr/bin/env python3
"""Writes the presets of this folder whose piles are given body by body.

Run it here after a change:  python3 build_structures.py
"""
import json
import math
import random
import re


def about_y(angle):
    return [math.cos(angle / 2), 0, math.sin(angle / 2), 0]


def about_z(angle):
    return [math.cos(angle / 2), 0, 0, math.sin(angle / 2)]


def times(a, b):
    w, x, y, z = a
    p, q, r, s = b
    return [w * p - x * q - y * r - z * s, w * q + x * p + y * s - z * r,
            w * r - x * s + y * p + z * q, w * s + x * r - y * q + z * p]


def body(name, shape, material, position, orientation, colour):
    return {"name": name, "shape": shape, "material": material,
            "position": [round(v, 6) for v in position],
            "orientation": [round(v, 7) for v in orientation], "colour": colour}


def thrown(shape, material, position, velocity, colour):
    return [{"name": shape, "type": "stream", "shape": shape, "material": material,
             "position": position, "linear_velocity": velocity, "count": 1, "rate_hz": 1,
             "start_s": 5, "orientation": [1, 0, 0, 0], "colour": colour}]


GROUND = {"name": "ground", "shape": "ground", "material": "ground", "role": "static"}


def write(name, comment, scene):
    text = json.dumps({"version": 1, **scene}, indent=2)
    text = re.sub(r"\[\s+([^\[\]{}]*?)\s+\]",
                  lambda m: "[" + re.sub(r"\s+", " ", m.group(1)) + "]", text)
    text = re.sub(r"\{\s+(\"name\": [^{}]*?)\s+\}",
                  lambda m: "{" + re.sub(r"\s+", " ", m.group(1)) + "}", text)
    with open(name + ".json", "w", encoding="utf-8") as file:
        file.write("// %s\n// Written by build_structures.py.\n%s\n" % (comment, text))


def card_tower():
    length, thickness, lean, spacing, gap = 0.088, 0.0003, math.radians(25), 0.084, 2e-5
    s, c = math.sin(lean), math.cos(lean)
    height = length * c + thickness * s
    half_width = length / 2 * s + thickness / 2 * c + gap
    half_height = length / 2 * c + thickness / 2 * s
    lying = about_y(math.pi / 2)  # the long edge along x
    cards = []

    def card(name, x, y, angle, colour):
        cards.append(body(name, "card", "card", [x, y, 0], times(about_z(angle), lying), colour))

    storeys = 5
    feet = [((i - (storeys - 1) / 2) * spacing, gap) for i in range(storeys)]
    for storey in range(storeys, 0, -1):
        apex = []
        for i, (x, y) in enumerate(feet):
            light = (i + storey) % 2
            card("left %d.%d" % (storey, i), x - half_width, y + half_height, math.pi / 2 - lean,
                 "#e8e2d4" if light else "#c9d4e0")
            card("right %d.%d" % (storey, i), x + half_width, y + half_height, lean - math.pi / 2,
                 "#d8cdb8" if light else "#b4c3d3")
            apex.append((x, y + height + gap))
        feet = []
        for i in range(storey - 1):
            # Every other card lies on the ends of its neighbours.
            left, right = apex[i][1], apex[i + 1][1]
            if i % 2:
                left += thickness + gap
                right += thickness + gap if i + 2 < storey else 0
            angle = math.atan2(right - left, spacing)
            x, y = (apex[i][0] + apex[i + 1][0]) / 2, (left + right) / 2
            card("flat %d.%d" % (storey, i), x, y + thickness / 2, angle, "#b0402f")
            reach = 2 * half_width * math.tan(abs(angle))
            feet.append((x, y + reach + thickness + gap))
    write("card_tower", "A tower of 40 playing cards stands until cubes fall on it (example 1).", {
        "name": "Card tower", "duration_s": 9, "frame_rate": 30,
        "materials": {"ground": {"restitution": 0, "friction": 0.7, "colour": "#2f6b4f"},
                      "card": {"restitution": 0, "friction": 0.7, "density_kg_m3": 1100},
                      "wood": {"restitution": 0.1, "friction": 0.6, "density_kg_m3": 600}},
        "shapes": {"ground": {"type": "plane"},
                   "card": {"type": "mesh", "file": "../../assets/playing_card.obj"},
                   "cube": {"type": "box", "size": [0.03, 0.03, 0.03]}},
        "bodies": [GROUND] + cards,
        "emitters": [{"name": "cubes", "type": "line", "shape": "cube", "material": "wood",
                      "from": [-0.06, 0.75, 0.005], "to": [0.07, 0.75, -0.01], "period_s": 3.4,
                      "count": 4, "rate_hz": 1.5, "start_s": 6, "colour": "#e8b23a"}],
        "guide": {"hold": "freeze"},
        "render": {"light": {"name": "studio", "azimuth_deg": 40, "elevation_deg": 40, "horizon_colour": "#6f9a85",
                             "zenith_colour": "#2c5546"}},
        "camera": {"position": [0.42, 0.3, 0.8], "target": [0, 0.225, 0], "field_of_view_deg": 32}})


def books():
    thickness, around, layers, radius, sway = 0.03, 9, 98, 0.5, 0.45
    stack = []
    colours = ["#7d3b34", "#34506b", "#8a7a4d", "#3f5f4a", "#6b4a6e", "#a3623a", "#4a4e57"]
    for layer in range(layers):
        along = 2 * math.pi * 0.8 * layer / layers  # the axis of the pile is a helix
        for i in range(around):
            angle = 2 * math.pi * (i + 0.5 * (layer % 2)) / around
            place = [radius * math.cos(angle) + sway * (1 - math.cos(along)),
                     thickness / 2 + layer * thickness,
                     -radius * math.sin(angle) + sway * math.sin(along)]
            # The spine outwards, the long edge around.
            stack.append(body("book %d.%d" % (layer, i), "book", "paper", place, about_y(angle),
                              colours[(3 * i + 5 * layer) % len(colours)]))
    write("book_spiral", "%d books, stacked in a ring that winds upwards, stand until a giant ball hits "
          "them (example 4)." % len(stack), {
              "name": "Book spiral", "duration_s": 8, "frame_rate": 30,
              "materials": {"ground": {"restitution": 0, "friction": 0.7, "colour": "#9a8f80"},
                            "paper": {"restitution": 0, "friction": 0.7, "density_kg_m3": 800},
                            "iron": {"restitution": 0.1, "friction": 0.5, "density_kg_m3": 400}},
              "shapes": {"ground": {"type": "plane"},
                         "book": {"type": "mesh", "file": "../../assets/book.obj"},
                         "ball": {"type": "sphere", "radius": 0.6}},
              "bodies": [GROUND] + stack,
              "emitters": thrown("ball", "iron", [-6.0, 4.6, 0.4], [6, 0, -0.4], "#4a4e57"),
              "guide": {"hold": "freeze"},
              "render": {"light": {"name": "evening", "azimuth_deg": -35, "elevation_deg": 30}, "exposure": 0.6},
              "camera": {"position": [1.4, 0.6, 5.6], "target": [0.1, 1.55, 0], "field_of_view_deg": 38}})


def sticks():
    layers, side, gap = 110, 0.02, -1e-5
    stack = []
    for layer in range(layers):
        height = layer * (side + gap)
        sway = [0.5 * math.sin(1.35 * height) ** 2, 0.12 * math.sin(2.8 * height)]
        turn = math.radians(1.2) * layer + (math.pi / 2 if layer % 2 else 0)
        for i, across in enumerate((-0.36, 0, 0.36)):
            place = [sway[0] + across * math.sin(turn), side / 2 + height,
                     sway[1] + across * math.cos(turn)]
            stack.append(body("stick %d.%d" % (layer, i), "stick", "wood", place, about_y(turn),
                              ["#c9a06a", "#b58550", "#d9bb8c"][(layer + i) % 3]))
    write("stick_tower", "%d sticks, laid crosswise into a twisted tower that leans; a cube hits it."
          % len(stack), {
              "name": "Stick tower", "duration_s": 8, "frame_rate": 30,
              "materials": {"ground": {"restitution": 0, "friction": 0.7, "colour": "#6f7f8a"},
                            "wood": {"restitution": 0, "friction": 0.7, "density_kg_m3": 600}},
              "shapes": {"ground": {"type": "plane"},
                         "stick": {"type": "box", "size": [1, 0.02, 0.02]},
                         "cube": {"type": "box", "size": [0.3, 0.3, 0.3]}},
              "bodies": [GROUND] + stack,
              "emitters": thrown("cube", "wood", [-2.5, 2.4, 0], [7, 0, 0], "#4a4e57"),
              "guide": {"hold": "freeze"},
              "render": {"light": {"name": "evening", "azimuth_deg": -35, "elevation_deg": 28}, "exposure": 0.5},
              "camera": {"position": [1.5, 0.6, 4.1], "target": [0.15, 1.1, 0], "field_of_view_deg": 35}})


def tyres():
    high, columns, gap = 0.2, 5, -1e-4
    stack = []
    for layer in range(14):
        spread = 0.68 + 0.026 * layer
        for row in (0, 1):
            for i in range(columns):
                x = (i - (columns - 1) / 2) * spread
                z = (row - 0.5) * 0.68
                stack.append(body("tyre %d.%d.%d" % (layer, row, i), "tyre", "rubber",
                                  [x, high / 2 + layer * (high + gap), z], [1, 0, 0, 0],
                                  ["#2f3136", "#3a3d43", "#26282c"][(layer + row + i) % 3]))
    write("tyre_fan", "%d tyres placed by hand as a fan of leaning columns (example 6); a ball hits "
          "it." % len(stack), {
              "name": "Tyre fan", "duration_s": 8, "frame_rate": 30,
              "materials": {"ground": {"restitution": 0, "friction": 0.8, "colour": "#b8ae9c"},
                            "rubber": {"restitution": 0.1, "friction": 0.8, "density_kg_m3": 300},
                            "iron": {"restitution": 0.1, "friction": 0.5, "density_kg_m3": 3000}},
              "shapes": {"ground": {"type": "plane"},
                         "tyre": {"type": "mesh", "file": "../../assets/tyre.obj",
                            "hull_max_vertices": 255},
                         "ball": {"type": "sphere", "radius": 0.5}},
              "bodies": [GROUND] + stack,
              "emitters": thrown("ball", "iron", [-4.5, 3.4, 0.2], [6, 0, 0], "#b0402f"),
              "guide": {"hold": "freeze"},
              "render": {"light": {"name": "noon", "azimuth_deg": -45, "elevation_deg": 42}},
              "camera": {"position": [1.6, 1.0, 7.2], "target": [-0.25, 1.5, 0], "field_of_view_deg": 33}})


def crates():
    side, across, storeys = 0.2, 5, 12
    draw = random.Random(4).uniform
    stack = []
    for storey in range(storeys):
        for i in range(across):
            out = i - (across - 1) / 2
            place = [out * (0.25 + 0.015 * storey) + draw(-0.005, 0.005),
                     side / 2 + storey * 0.19 + (draw(-0.004, 0.004) if storey else 0),
                     draw(-0.01, 0.01)]
            stack.append(body("crate %d.%d" % (storey, i), "crate", "wood", place,
                              about_y(draw(-0.1, 0.1)),
                              ["#b58550", "#c9a06a", "#9c7040", "#d9bb8c"][(2 * storey + 3 * i) % 4]))
    write("rough_crates", "%d crates set up roughly by hand, up to 2 cm into one another, as a fan of leaning "
          "columns; a ball hits it." % len(stack), {
              "name": "Rough crates", "duration_s": 8, "frame_rate": 30,
              "materials": {"ground": {"restitution": 0, "friction": 0.7},
                            "wood": {"restitution": 0.1, "friction": 0.7, "density_kg_m3": 400},
                            "iron": {"restitution": 0.1, "friction": 0.5, "density_kg_m3": 3000}},
              "shapes": {"ground": {"type": "plane"},
                         "crate": {"type": "box", "size": [side, side, side]},
                         "ball": {"type": "sphere", "radius": 0.3}},
              "bodies": [GROUND] + stack,
              "emitters": thrown("ball", "iron", [-4.2, 2.6, 0.1], [6, 0, 0], "#4a4e57"),
              "guide": {"hold": "freeze"},
              "render": {"light": {"name": "noon", "azimuth_deg": -45, "elevation_deg": 42}},
              "camera": {"position": [1.2, 0.7, 4.6], "target": [0, 1.15, 0], "field_of_view_deg": 34}})


def wedged():
    side, storeys, into = 0.2, 9, 1e-4
    stack = []
    for storey in range(storeys):
        height = side / 2 + storey * side
        # A crate that falls past the others must not catch on the edges of those that no crate has pushed apart.
        out = 0.01 if storey == 0 else 0
        for i, across in enumerate((-side + into - out, side - into + out)):
            stack.append(body("crate %d.%d" % (storey, i), "crate", "wood", [across, height, 0],
                              [1, 0, 0, 0], ["#b58550", "#c9a06a"][(storey + i) % 2]))
        if storey in (2, 4, 6, 8):
            stack.append(body("wedged %d" % storey, "crate", "wood", [0, height - side / 2, 0], [1, 0, 0, 0],
                              "#b0402f"))
    write("wedged_crates", "Crates between two columns, with nothing below them: with contacts alone that point up "
          "(as here) they\n// fall, with all contacts they hang there (Figure 6.12): --set /guide/least_normal_up=-1",
          {
              "name": "Wedged crates", "duration_s": 4, "frame_rate": 30,
              "materials": {"ground": {"restitution": 0, "friction": 0.7},
                            "wood": {"restitution": 0.1, "friction": 0.7, "density_kg_m3": 400}},
              "shapes": {"ground": {"type": "plane"},
                         "crate": {"type": "box", "size": [side, side, side]}},
              "bodies": [GROUND] + stack,
              "guide": {"hold": "freeze", "least_normal_up": 0.1},
              "render": {"light": {"name": "noon", "azimuth_deg": -45, "elevation_deg": 42}},
              "camera": {"position": [0.9, 0.6, 3.4], "target": [0, 0.9, 0], "field_of_view_deg": 34}})


card_tower()
crates()
books()
sticks()
tyres()
wedged()
