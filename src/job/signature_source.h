// The mesh and material of a scene that sample-signature measures.
#pragma once

#include <filesystem>
#include <string>

#include "signature/signature_sampling.h"

namespace pilesim {

// Sets in `options` the mesh, its scale, upward axis and solid, and the material of the shape
// called `shape` in the scene file; empty: of the only mesh that moves there. Throws as
// load_scene(), and Error(usage) where the shape is none that can be sampled or has several
// materials.
void take_from_scene(const std::filesystem::path& scene_file, const std::string& shape,
                     SignatureOptions& options);

}  // namespace pilesim
