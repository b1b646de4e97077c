// A scene to start from, for one mesh: `pilesim new`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace pilesim {

// pile: bodies are poured on a plane. bin: they are poured into a bin. guide: they fill a cone that
// a guide holds them in, for direct-pile. dataset: a bin in which count, materials and camera are
// drawn by each seed.
enum class NewSceneKind : uint8_t { pile, bin, guide, dataset };

struct NewSceneJob {
  NewSceneKind kind = NewSceneKind::pile;
  std::filesystem::path mesh;
  double scale = 1;              // metres per unit of the file, > 0
  std::optional<bool> is_z_up;   // the file; none: y, and it is said where it looks like z
  std::optional<int> count;      // bodies, >= 1; none: 120 of a pile, else 60, or more that a guide
                                 // takes
  std::filesystem::path output;  // the scene file; a guide's mesh is written beside it
  bool force = false;            // replace what is there
};

struct NewSceneSummary {
  std::string text;                    // of the scene
  double diameter_m = 0;               // of a body
  std::filesystem::path guide;         // the guide's mesh; empty: none
  int guided = 0;                      // about so many bodies fill it
  std::vector<std::string> questions;  // about units and axes that are unlikely, with the option
};

// Sizes all by the mesh and writes the scene, with comments, and the guide's mesh. Throws
// Error(input) or Error(io) as import_mesh(), Error(usage) or Error(io) as claim_output_file(), and
// Error(usage) where a file is the mesh or a guide is to have too few bodies.
NewSceneSummary write_new_scene(const NewSceneJob& job);

}  // namespace pilesim
