#include "signature/sampled_mesh.h"

#include "core/error.h"
#include "geometry/mesh_import.h"

namespace pilesim {

TriangleMesh import_sampled_mesh(const std::filesystem::path& file, const SignatureBody& body) {
  TriangleMesh mesh = import_mesh(file, body.scale);
  const std::string hash = mesh_hash(mesh);
  if (hash == body.mesh_hash) return mesh;
  throw Error(ErrorKind::input, {.file = file.string(),
                                 .found = "mesh " + hash,
                                 .expected = "the mesh that was sampled, " + body.mesh +
                                             " with hash " + body.mesh_hash});
}

}  // namespace pilesim
