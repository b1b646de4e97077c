// guide.json, beside a trajectory of a pile in a guide: counts for each frame, the guide, the
// positions of fixed bodies, glue, and the forces of the analysis. These structs and their members'
// names define the whole format.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "core/types.h"

namespace pilesim {

// Counts of the last control step, except `knocked_loose`.
struct GuideCounts {
  uint32_t in_guide = 0;  // controlled bodies, by their centre of mass
  uint32_t passed = 0, filtered = 0, failed = 0;
  uint32_t held = 0;           // bodies that sleep or have a nail
  uint32_t nails = 0;          // that are in place
  uint64_t knocked_loose = 0;  // bodies woken by impacts since the start
  // Number of pairs with intact glue, its total strength in mean body weights, and number of pairs
  // with torn glue.
  uint32_t glue = 0, torn = 0;
  double glue_weights = 0;

  static void fields(auto& self, auto& stream) {
    stream(self.in_guide, self.passed, self.filtered, self.failed, self.held, self.nails,
           self.knocked_loose, self.glue, self.torn, self.glue_weights);
  }
};

// At the end of a frame; the first is frame 1.
struct GuideFrame {
  double time_s = 0;
  GuideCounts counts;
  // Vertical distance from the lowest to the highest centre of mass of a dynamic body.
  double height_m = 0;
  // Mean and largest displacement of the dynamic bodies since the pile was complete; for bodies
  // that appear or are released later, since then.
  double mean_drift_m = 0, largest_drift_m = 0;

  static void fields(auto& self, auto& stream) {
    stream(self.time_s, self.counts, self.height_m, self.mean_drift_m, self.largest_drift_m);
  }
};

// Positions where bodies are fixed, from a frame on.
struct GuideConstraints {
  uint64_t frame = 0;
  std::vector<Vec3> points;  // m, world; written to a tenth of a millimetre

  static void fields(auto& self, auto& stream) { stream(self.frame, self.points); }
};

// A force or a spot of glue between two bodies, with its duration.
struct PairLine {
  uint32_t a = 0, b = 0;    // bodies; a is dynamic
  bool b_stands = false;    // b is static or fixed
  Vec3 arm = Vec3::Zero();  // m, from a's centre to the contact or spot, in a's frame
  double weights = 0;       // its strength, in mean body weights
  double from_s = 0;        // simulated time
  double until_s = std::numeric_limits<double>::infinity();  // absent in the file: until the end

  static void fields(auto& self, auto& stream) {
    stream(self.a, self.b, self.b_stands, self.arm, self.weights, self.from_s, self.until_s);
  }
};

// Result of the analysis of a whole pile; in report.json, not in guide.json.
struct GlueFigures {
  bool is_solved = false;
  uint32_t contacts = 0, glued_contacts = 0;
  uint32_t pairs = 0;    // pairs with glue
  uint32_t hanging = 0;  // bodies without a connection to a fixed one
  double weights = 0;    // of all glue, in the pile's weight
  double given = 1;      // share of that glue that the pile has, 0 .. 1: Guide::max_glue
  // From its certificate, in long double: the largest residual force and torque of any body, in m g
  // and m g r, and the largest distance of a force from its cone, in mean weights.
  double unbalanced = 0, outside = 0;
  double largest_force = 0;       // largest compressive force of a pair, in mean weights
  uint32_t leaning_unsolved = 0;  // load cases with tilted gravity for which no forces were found

  static void fields(auto& self, auto& stream) {
    stream(self.is_solved, self.contacts, self.glued_contacts, self.pairs, self.hanging,
           self.weights, self.given, self.unbalanced, self.outside, self.largest_force,
           self.leaning_unsolved);
  }
};

// Result of the analysis of a glued pile after an impact: all resting bodies in the world, with
// their full friction. In report.json, not in guide.json.
struct GlueLeft {
  double time_s = 0;
  bool is_solved = false;
  uint32_t bodies = 0, hanging = 0;  // of the pile; those without a connection to a fixed body
  uint32_t pairs = 0, needed = 0;    // with intact glue; those whose glue carries load
  double weights = 0;                // strength of the needed intact glue, in the bodies' weight
  // Additional glue needed, in mean body weights.
  double missing = 0;
  double unbalanced = 0, outside = 0;  // as in GlueFigures

  static void fields(auto& self, auto& stream) {
    stream(self.time_s, self.is_solved, self.bodies, self.hanging, self.pairs, self.needed,
           self.weights, self.missing, self.unbalanced, self.outside);
  }
};

struct GuideFile {
  std::vector<GuideFrame> frames;
  std::vector<Vec3> vertices;  // m, world, of the guide; rounded as points are; empty: no mesh
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<GuideConstraints> constraints;  // in the order of frames
  std::vector<PairLine> glue;                 // until it tore
  // Forces with which the analysis found the pile to stand: > 0 for net compression, < 0 where glue
  // pulls. Each lasts until the two bodies have separated, or many others have.
  std::vector<PairLine> forces;
};

// An object with a member for each number, as in the file.
nlohmann::ordered_json guide_frame_json(const GuideFrame& frame);

// Writes the file. Throws Error(io).
void write_guide_file(const std::filesystem::path& file, const GuideFile& guide);
// Throws Error(io), or Error(input) if the file has another format or version, or a triangle names
// a missing vertex.
GuideFile read_guide_file(const std::filesystem::path& file);

}  // namespace pilesim
