// The mesh that a signature was sampled from, which the signature itself does not hold.
#pragma once

#include <filesystem>

#include "geometry/mesh.h"
#include "signature/signature.h"

namespace pilesim {

// Throws what import_mesh() throws, and Error(input) where the file holds another mesh.
TriangleMesh import_sampled_mesh(const std::filesystem::path& file, const SignatureBody& body);

}  // namespace pilesim
