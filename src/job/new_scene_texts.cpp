#include "job/new_scene_texts.h"

#include <cctype>

namespace pilesim {
namespace {

constexpr const char* kHead = R"({
  "version": 1,
  "name": $name,
  "duration_s": $duration,  // at the latest
$until  "frame_rate": 30,
)";

constexpr const char* kShape = R"("body": {"type": "mesh", "file": $file, "scale": $scale,$up
             // "hull" is fastest, "decomposition" follows hollows and legs
             "collision": "$collision"$solid})";

constexpr const char* kPile = R"(  "materials": {
    "ground": {"friction": 0.7},
    "body": {"restitution": 0.2, "friction": 0.6, "density_kg_m3": 700}
  },
  "shapes": {
    "ground": {"type": "plane"},
    $shape
  },
  "bodies": [
    {"name": "ground", "shape": "ground", "material": "ground", "role": "static"}
  ],
  "emitters": [
    // poured from just above the heap, so many a second; a body waits until its place is clear
    {"name": "heap", "type": "disk", "shape": "body", "material": "body", "count": $count,
     "rate_hz": $rate, "centre": [0, $centre, 0], "radius": $radius, "height": $height}
  ]
  // without a "camera" the pictures show the heap as large as it is; to set one:
  // "camera": {"position": [2, 1.5, 3], "target": [0, 0.5, 0]}
}
)";

constexpr const char* kBin = R"(  "materials": {
    "bin": {"friction": 0.5},
    "body": {"restitution": 0.2, "friction": 0.6, "density_kg_m3": 700}
  },
  "shapes": {
    "ground": {"type": "plane"},
    // the size is of its inside; it stands on its origin
    "bin": {"type": "bin", "size": [$bin, $depth, $bin], "thickness": $wall},
    $shape
  },
$bodies  "emitters": [
    // poured in, so many a second; a body waits until its place is clear
    {"name": "poured", "type": "disk", "shape": "body", "material": "body", "count": $count,
     "rate_hz": $rate, "centre": [0, $centre, 0], "radius": $radius, "height": $height}
  ],
$camera,
  "render": {"size": $size}
}
)";

constexpr const char* kDataset =
    R"(  // Each seed is another scene: pilesim simulate THIS -o out/7 --seed 7
  // --print-config shows what a seed has drawn.
  "seed": 1,
  "materials": {
    "bin": {"friction": 0.5},
    "plastic": {"restitution": 0.3, "friction": {"random": {"from": 0.2, "to": 0.5}}, "density_kg_m3": 950},
    "wood": {"restitution": 0.1, "friction": {"random": {"from": 0.4, "to": 0.8}}, "density_kg_m3": 600},
    "metal": {"restitution": 0.2, "friction": {"random": {"from": 0.2, "to": 0.4}}, "density_kg_m3": 2700}
  },
  "shapes": {
    "ground": {"type": "plane"},
    "bin": {"type": "bin", "size": [$bin, $depth, $bin], "thickness": $wall},
    $shape
  },
$bodies  "emitters": [
    {"name": "poured", "type": "disk", "shape": "body",
     "material": {"random": {"of": ["plastic", "wood", "metal"]}},
     "count": {"random": {"from": $fewest, "to": $count, "integer": true}},
     "rate_hz": $rate, "centre": [0, $centre, 0], "radius": $radius, "height": $height,
     // of each body one of these
     "palette": ["#c8553d", "#f28f3b", "#588b8b", "#ffd5c2", "#2d3047"]}
  ],
  "camera": {"position": [{"random": {"from": -$away, "to": $away}}, $above, $away],
             "target": [0, $target, 0]},
  "render": {"size": $size}
}
)";

constexpr const char* kGuide = R"(  "materials": {
    "ground": {"restitution": 0, "friction": 0.7},
    "body": {"restitution": 0, "friction": 0.7, "density_kg_m3": 700}
  },
  "shapes": {
    "ground": {"type": "plane"},
    $shape
  },
  "bodies": [
    {"name": "ground", "shape": "ground", "material": "ground", "role": "static"}
  ],
  "emitters": [
    // the guide is filled like a mould$limit; the least glue holds them
    {"name": "heap", "type": "mould", "shape": "body", "material": "body"$most}
  ],
  // the shape that the heap is to keep: any closed mesh with a level base
  "guide": {"file": $guide}
}
)";

constexpr const char* kBinBodies = R"(  "bodies": [
    {"name": "ground", "shape": "ground", "material": "bin", "role": "static"},
    {"name": "bin", "shape": "bin", "material": "bin", "role": "static"}
  ],
)";

const char* text_of(NewSceneKind kind) {
  switch (kind) {
    case NewSceneKind::pile:
      return kPile;
    case NewSceneKind::bin:
      return kBin;
    case NewSceneKind::guide:
      return kGuide;
    case NewSceneKind::dataset:
      return kDataset;
  }
  return kPile;
}

// Replaces each $NAME in `text`; a name consists of letters and digits.
std::string filled(const std::string& text, const NewSceneValues& values) {
  std::string result;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '$') {
      result += text[i];
      continue;
    }
    size_t end = i + 1;
    while (end < text.size() && std::isalnum(static_cast<unsigned char>(text[end])) != 0) ++end;
    result += values.at(text.substr(i + 1, end - i - 1));
    i = end - 1;
  }
  return result;
}

}  // namespace

std::string new_scene_text(NewSceneKind kind, NewSceneValues values) {
  values["shape"] = filled(kShape, values);
  values["bodies"] = kBinBodies;
  return filled(std::string(kHead) + text_of(kind), values);
}

}  // namespace pilesim
