// The mesh that a signature was sampled from; the signature itself does not contain it.
#pragma once

#include <filesystem>

#include "geometry/mesh.h"
#include "geometry/solid.h"
#include "signature/signature.h"

namespace pilesim {

// The solid to sample for a mesh. A mesh with mass and hull is used unchanged if `options` ask for
// nothing else; otherwise make_solid() converts it and `note` says how. Throws as make_solid()
// does.
TriangleMesh solid_to_sample(const TriangleMesh& mesh, const SolidOptions& options,
                             std::string* note = nullptr);

// The solid of the mesh in `file`, with the up axis it was sampled with. Throws as import_mesh()
// does, and Error(input) if the file holds another mesh.
TriangleMesh import_sampled_mesh(const std::filesystem::path& file, const SignatureBody& body);

}  // namespace pilesim
