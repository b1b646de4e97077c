// A valid scene and the texts of errors, for the tests of src/scene.
#pragma once

#include <string>
#include <vector>

#include "core/error.h"
#include "scene/scene_loader.h"

namespace pilesim {

// Uses every kind of object that a scene can have, each on its own lines.
inline const std::string kFullScene = R"({
  // A comment.
  "$schema": "scene.schema.json",
  "version": 1,
  "name": "everything",
  "seed": 18446744073709551615,
  "duration_s": 2.5,
  "frame_rate": 30,
  "gravity": [0, -1.62, 0],
  "materials": {
    "wood": {"restitution": 0.1, "friction": 0.7, "density_kg_m3": 600},
    "steel": {}
  },
  "shapes": {
    "rabbit": {"type": "mesh", "file": "meshes/rabbit.obj", "scale": 0.1,
               "collision": "decomposition", "decomposition_max_pieces": 12},
    "crate": {"type": "mesh", "file": "/meshes/crate.obj", "collision": "mesh"},
    "brick": {"type": "box", "size": [0.2, 0.1, 0.4]},
    "ball": {"type": "sphere", "radius": 0.1},
    "can": {"type": "cylinder", "radius": 0.05, "height": 0.2},
    "ground": {"type": "plane"},
    "hammer": {"type": "compound", "parts": [
      {"shape": "brick"},
      {"shape": "can", "position": [0, -0.1, 0], "rotation_deg": [10, 20, 30]}]}
  },
  "bodies": [
    {"shape": "ground", "material": "wood", "role": "static"},
    {"name": "crate", "shape": "crate", "material": "wood", "role": "kinematic", "motion": [
      {"time_s": 0, "position": [0, 1, 0]},
      {"time_s": 1.1, "position": [0, 2, 0], "rotation_deg": [0, 90, 0]}]},
    {"name": "swing", "shape": "hammer", "material": "steel", "position": [0.1, 3, -2],
     "rotation_deg": [12.3, -45.6, 78.9], "hinge": {"axis": [1, 1, 0]}, "colour": "#A0b1C2"},
    {"name": "hung", "shape": "ball", "material": "steel", "position": [0, 5, 0], "held": true,
     "linear_velocity": [1, 0, 0], "angular_velocity": [0, 0.1, 0]}
  ],
  "emitters": [
    {"name": "rain", "type": "disk", "shapes": ["rabbit", "ball"], "material": "wood",
     "centre": [0, 4, 0], "radius": 1.5, "height": 2, "count": 20, "position_jitter_m": 0.01},
    {"type": "grid", "shape": "brick", "material": "wood", "centre": [0, 9, 0], "count": [2, 3, 4],
     "spacing": [0.5, 0.5, 0.5], "orientation": [1, 0, 0, 0]},
    {"type": "line", "shape": "can", "material": "wood", "from": [0, 5, 0], "to": [1, 5, 0],
     "period_s": 0.7, "count": 3, "rate_hz": 3, "start_s": 0.1},
    {"type": "stream", "shape": "can", "material": "wood", "position": [0, 5, 1], "count": 3,
     "rate_hz": 3, "linear_velocity": [0, -1, 0], "linear_velocity_jitter": 0.1},
    {"type": "volume", "shape": "can", "material": "wood", "file": "../cone.obj", "spacing": 0.1,
     "mesh_position": [0, 1, 0], "mesh_rotation_deg": [0, 0, 1], "colour": "#000000"}
  ],
  "events": [
    {"type": "remove", "time_s": 2, "bodies": ["rain", "emitter/1/23"]},
    {"type": "release", "time_s": 0.5, "bodies": ["hung"]},
    {"type": "impulse", "time_s": 1, "bodies": ["swing"], "impulse": [0, 0, 9], "point": [0, 3, -2]}
  ],
  "simulator": {"sleeping": false, "solver_iterations": 30},
  "camera": {"position": [3, 2, 3.3], "target": [0, 1, 0], "field_of_view_deg": 41.7},
  "render": {"size": [640, 360], "samples": 8}
}
)";

inline LoadedScene parse(const std::string& text, const std::vector<std::string>& overrides = {}) {
  return parse_scene(text, "/scenes/scene.json", overrides);
}

// The problems of a text as their printed lines; empty if there are none.
inline std::vector<std::string> problems_of(const std::string& text,
                                            const std::vector<std::string>& overrides = {}) {
  std::vector<std::string> lines;
  try {
    parse_scene(text, "s.json", overrides);
  } catch (const Error& error) {
    for (const Problem& problem : error.problems()) lines.push_back(to_string(problem));
  }
  return lines;
}

// `text` with the first `from` replaced, which must be there.
inline std::string replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

}  // namespace pilesim
