// guide.json, beside a trajectory of a pile that was held in a guide: counts of each frame, the
// guide, where bodies are held, what is glued, and the forces of the analysis. The whole format:
// these structs, and the names of their members.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "core/types.h"

namespace pilesim {

// Counts of the last control step, but for `knocked_loose`.
struct GuideCounts {
  uint32_t in_guide = 0;  // bodies that are controlled, by their centre of mass
  uint32_t passed = 0, filtered = 0, failed = 0;
  uint32_t held = 0;           // bodies that sleep or have a nail
  uint32_t nails = 0;          // that are in place
  uint64_t knocked_loose = 0;  // bodies that hits woke since the start
  // Pairs of bodies with glue that holds, how strong it is in all, in weights of a mean body, and
  // those whose glue is torn.
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
  double height_m = 0;  // from the lowest centre of mass of a dynamic body to the highest
  // Mean and largest way of the dynamic bodies from where they were when the pile was whole: a body
  // that appears or is released later counts from then on.
  double mean_drift_m = 0, largest_drift_m = 0;

  static void fields(auto& self, auto& stream) {
    stream(self.time_s, self.counts, self.height_m, self.mean_drift_m, self.largest_drift_m);
  }
};

// Where bodies are held from a frame on.
struct GuideConstraints {
  uint64_t frame = 0;
  std::vector<Vec3> points;  // m, world; written to a tenth of a millimetre

  static void fields(auto& self, auto& stream) { stream(self.frame, self.points); }
};

// A force or a spot of glue between two bodies, while it lasts.
struct PairLine {
  uint32_t a = 0, b = 0;    // bodies; a is dynamic
  bool b_stands = false;    // b is not: fixed, or held
  Vec3 arm = Vec3::Zero();  // m, from a's centre to the place of it, a's frame
  double weights = 0;       // its strength, in weights of a mean body
  double from_s = 0;        // of simulated time
  double until_s = std::numeric_limits<double>::infinity();  // not in the file: to the end

  static void fields(auto& self, auto& stream) {
    stream(self.a, self.b, self.b_stands, self.arm, self.weights, self.from_s, self.until_s);
  }
};

// Result of the analysis of a whole pile; not in guide.json but in report.json.
struct GlueFigures {
  bool is_solved = false;
  uint32_t contacts = 0, glued_contacts = 0;
  uint32_t pairs = 0;    // of bodies that are glued
  uint32_t hanging = 0;  // bodies with no way to anything that stands
  double weights = 0;    // of glue, in the pile's weight
  double given = 1;      // share of it that the pile has, 0 .. 1: Guide::max_glue
  // From its certificate, in long double: the largest unbalanced force and torque of any body, in
  // its m g and m g r; the most by which a force leaves its cone, in mean weights.
  double unbalanced = 0, outside = 0;
  double largest_force = 0;       // of two that push each other, in mean weights
  uint32_t leaning_unsolved = 0;  // cases of gravity that leans for which no forces were found

  static void fields(auto& self, auto& stream) {
    stream(self.is_solved, self.contacts, self.glued_contacts, self.pairs, self.hanging,
           self.weights, self.given, self.unbalanced, self.outside, self.largest_force,
           self.leaning_unsolved);
  }
};

// Result of the analysis of a glued pile after a hit: all bodies that rest and are in the world,
// with all of their friction. Not in guide.json but in report.json.
struct GlueLeft {
  double time_s = 0;
  bool is_solved = false;
  uint32_t bodies = 0, hanging = 0;  // of the pile; of them, with no way to anything that stands
  uint32_t pairs = 0, needed = 0;    // that are still glued; of them, that bear something
  double weights = 0;                // of the glue that is there and needed, in that of the bodies
  // Additional glue that would be needed, in mean weights of a body.
  double missing = 0;
  double unbalanced = 0, outside = 0;  // as above

  static void fields(auto& self, auto& stream) {
    stream(self.time_s, self.is_solved, self.bodies, self.hanging, self.pairs, self.needed,
           self.weights, self.missing, self.unbalanced, self.outside);
  }
};

struct GuideFile {
  std::vector<GuideFrame> frames;
  std::vector<Vec3> vertices;  // m, world, of the guide; written as points are; empty: no mesh
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<GuideConstraints> constraints;  // in the order of frames
  std::vector<PairLine> glue;                 // until it tore
  // With which the analysis found the pile to stand: > 0 where two push each other apart in all,
  // < 0 where glue draws them together. Until the two have parted, or many
  // others have.
  std::vector<PairLine> forces;
};

// An object with a member for each number, as in the file.
nlohmann::ordered_json guide_frame_json(const GuideFrame& frame);

// Throws Error(io).
void write_guide_file(const std::filesystem::path& file, const GuideFile& guide);
// Throws Error(io), or Error(input) for a file of another format or version, and where a triangle
// names a vertex that is not there.
GuideFile read_guide_file(const std::filesystem::path& file);

}  // namespace pilesim
