// The mesh that a signature was sampled from, which the signature itself does not hold.
#pragma once

#include <filesystem>

#include "geometry/mesh.h"
#include "geometry/solid.h"
#include "signature/signature.h"

namespace pilesim {

// The solid that is sampled for a mesh: itself where it has mass and hull and `options` ask for
// nothing else, or as make_solid() makes it; then `note` says how. Throws as that does.
TriangleMesh solid_to_sample(const TriangleMesh& mesh, const SolidOptions& options,
                             std::string* note = nullptr);

// The solid of the mesh in `file`, y or z up as it was sampled. Throws what import_mesh() throws,
// and Error(input) where the file holds another mesh.
TriangleMesh import_sampled_mesh(const std::filesystem::path& file, const SignatureBody& body);

}  // namespace pilesim
