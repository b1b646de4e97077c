// Creates a first scene for a mesh: `pilesim new`.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace pilesim {

// pile: bodies poured onto a plane. bin: bodies poured into a bin. guide: bodies fill a cone that a
// guide holds, for direct-pile. dataset: a bin in which each seed samples count, materials and
// camera.
enum class NewSceneKind : uint8_t { pile, bin, guide, dataset };

struct NewSceneJob {
  NewSceneKind kind = NewSceneKind::pile;
  std::filesystem::path mesh;
  double scale = 1;             // metres per unit of the file, > 0
  std::optional<bool> is_z_up;  // up axis of the file; none: y, with a question if it looks like z
  // Bodies, >= 1; none: 120 for a pile, else 60, or more if a guide needs them.
  std::optional<int> count;
  std::filesystem::path output;  // the scene file; a guide's mesh goes beside it
  bool force = false;            // replace existing files
};

struct NewSceneSummary {
  std::string text;                    // of the scene
  double diameter_m = 0;               // of a body
  std::filesystem::path guide;         // the guide's mesh; empty: none
  int guided = 0;                      // number of bodies that about fill it
  std::vector<std::string> questions;  // about improbable units and axes, with the option to set
};

// Derives all sizes from the mesh, and writes the scene with comments, and the guide's mesh. Throws
// Error(input) or Error(io) as import_mesh(), Error(usage) or Error(io) as claim_output_file(), and
// Error(usage) if an output file is the mesh itself or a guide would have too few bodies.
NewSceneSummary write_new_scene(const NewSceneJob& job);

}  // namespace pilesim
