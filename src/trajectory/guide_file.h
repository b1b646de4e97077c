// guide.json, beside a trajectory of a pile that was held in a guide: counts of each frame, the
// guide, and where bodies are held. The whole format: these structs, and the names of their
// members.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "core/types.h"

namespace pilesim {

// Of the last control step, but for `knocked_loose`.
struct GuideCounts {
  uint32_t in_guide = 0;  // bodies that are controlled, by their centre of mass
  uint32_t passed = 0, filtered = 0, failed = 0;
  uint32_t held = 0;           // bodies that sleep or have a nail
  uint32_t nails = 0;          // that are in place
  uint64_t knocked_loose = 0;  // bodies that hits woke since the start

  static void fields(auto& self, auto& stream) {
    stream(self.in_guide, self.passed, self.filtered, self.failed, self.held, self.nails,
           self.knocked_loose);
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

struct GuideFile {
  std::vector<GuideFrame> frames;
  std::vector<Vec3> vertices;  // m, world, of the guide; written as points are; empty: no mesh
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<GuideConstraints> constraints;  // in the order of frames
};

// An object with a member for each number, as in the file.
nlohmann::ordered_json guide_frame_json(const GuideFrame& frame);

// Throws Error(io).
void write_guide_file(const std::filesystem::path& file, const GuideFile& guide);
// Throws Error(io), or Error(input) for a file of another format or version, and where a triangle
// names a vertex that is not there.
GuideFile read_guide_file(const std::filesystem::path& file);

}  // namespace pilesim
