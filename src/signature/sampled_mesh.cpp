#include "signature/sampled_mesh.h"

#include "core/error.h"
#include "core/naming.h"
#include "geometry/cache_file.h"
#include "geometry/mesh_import.h"
#include "signature/trial/contact_body.h"

namespace pilesim {

TriangleMesh solid_to_sample(const TriangleMesh& mesh, const SolidOptions& options,
                             std::string* note) {
  const bool may_stay = options.rule == SolidRule::automatic || options.rule == SolidRule::exact;
  if (may_stay && has_mass_and_hull(mesh)) return mesh;
  Solid solid = make_solid(mesh, options, user_cache_directory());
  if (note != nullptr) *note = solid.note;
  return std::move(solid.mesh);
}

TriangleMesh import_sampled_mesh(const std::filesystem::path& file, const SignatureBody& body) {
  TriangleMesh mesh = import_mesh(file, body.scale);
  const std::string hash = mesh_hash(mesh);
  const auto solid = [&] {
    return naming(file.string(), [&] { return solid_to_sample(mesh, body.solid); });
  };
  if (hash == body.mesh_hash) return solid();
  turn_z_up_to_y_up(mesh);
  if (mesh_hash(mesh) == body.mesh_hash) return solid();
  throw Error(ErrorKind::input, {.file = file.string(),
                                 .found = "mesh " + hash,
                                 .expected = "the mesh that was sampled, " + body.mesh +
                                             " with hash " + body.mesh_hash});
}

}  // namespace pilesim
