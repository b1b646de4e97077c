#include "export/export_mesh.h"

#include <map>

#include "render/render_mesh.h"

namespace pilesim {
namespace {

// As pack_material() packed it: to within a step of 255.
Colour unpacked(const PackedMaterial& paint) {
  Colour colour;
  for (size_t i = 0; i < 3; ++i) {
    const double root = paint[i] / 255.0;
    colour[i] = srgb_from_linear(root * root);
  }
  return colour;
}

}  // namespace

ExportMesh make_export_mesh(const TrajectoryShape& shape, float plane_reach_m) {
  const float r = plane_reach_m;
  const RenderMesh source =
      shape.is_plane
          ? make_render_mesh(
                std::array{Vec3f(-r, 0, -r), Vec3f(-r, 0, r), Vec3f(r, 0, r), Vec3f(r, 0, -r)},
                std::array<std::array<uint32_t, 3>, 2>{{{0, 1, 2}, {0, 2, 3}}})
          : make_render_mesh(shape.vertices, shape.triangles, shape.colours);
  ExportMesh mesh;
  mesh.radius_m = source.radius_m;
  std::map<std::array<float, 3>, uint32_t> place;
  std::vector<uint32_t> point_of;  // of a split one
  const MeshLevel full = source.levels.empty() ? MeshLevel{} : source.levels.front();
  uint32_t split_count = 0;
  for (uint32_t i = 0; i < full.index_count; ++i) {
    const uint32_t corner = source.indices[full.first_index + i];
    mesh.split_corners.push_back(corner);
    split_count = std::max(split_count, corner + 1);
  }
  for (uint32_t i = 0; i < split_count; ++i) {
    const RenderVertex& vertex = source.vertices[full.first_vertex + i];
    mesh.split_points.emplace_back(vertex.position[0], vertex.position[1], vertex.position[2]);
    mesh.split_normals.emplace_back(vertex.normal[0], vertex.normal[1], vertex.normal[2]);
    const auto [found, is_new] =
        place.try_emplace(vertex.position, static_cast<uint32_t>(mesh.points.size()));
    if (is_new) mesh.points.push_back(mesh.split_points.back());
    point_of.push_back(found->second);
  }
  for (const uint32_t corner : mesh.split_corners) mesh.corners.push_back(point_of[corner]);
  if (!shape.colours.empty()) {
    for (uint32_t i = 0; i < full.index_count; i += 3) {
      const uint32_t vertex = full.first_vertex + source.indices[full.first_index + i];
      mesh.colours.push_back(unpacked(source.vertices[vertex].paint));
    }
  }
  return mesh;
}

}  // namespace pilesim
