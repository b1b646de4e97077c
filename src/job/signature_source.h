// Takes the mesh and material for sample-signature from a scene.
#pragma once

#include <filesystem>
#include <string>

#include "signature/signature_sampling.h"

namespace pilesim {

// Sets in `options` the mesh, its scale, up axis and solid, and the material of the shape named
// `shape` in the scene file; empty: of the only moving mesh. Throws as load_scene(), and
// Error(usage) if the shape cannot be sampled, has several materials, or is one of jointed bodies
// alone.
void take_from_scene(const std::filesystem::path& scene_file, const std::string& shape,
                     SignatureOptions& options);

// Throws Error(usage) with the command that samples a shape of the scene to `output`.
[[noreturn]] void refuse_scene_as_mesh(const std::filesystem::path& scene_file,
                                       const std::string& output);

}  // namespace pilesim
