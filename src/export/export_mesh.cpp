#include "export/export_mesh.h"

#include <algorithm>
#include <map>

#include "render/draw_list.h"

namespace pilesim {
namespace {

SplitMesh split_of(const RenderMesh& mesh) {
  SplitMesh split;
  const MeshLevel& full = mesh.levels.front();
  const size_t count = mesh.levels.size() > 1 ? mesh.levels[1].first_vertex : mesh.vertices.size();
  for (size_t i = 0; i < count; ++i) {
    const RenderVertex& vertex = mesh.vertices[i];
    split.points.emplace_back(vertex.position[0], vertex.position[1], vertex.position[2]);
    split.normals.emplace_back(vertex.normal[0], vertex.normal[1], vertex.normal[2]);
    split.colours.push_back(albedo_of(vertex.paint));
    split.places.push_back(vertex.uv);
  }
  split.corners.assign(mesh.indices.begin(), mesh.indices.begin() + full.index_count);
  split.runs = full.runs;
  return split;
}

}  // namespace

ExportMesh make_export_mesh(const TrajectoryShape& shape, float plane_reach_m) {
  TrajectoryShape drawn = shape;
  if (shape.is_plane) {
    const float r = plane_reach_m;
    drawn.vertices = {{-r, 0, -r}, {-r, 0, r}, {r, 0, r}, {r, 0, -r}};
    drawn.triangles = {{0, 1, 2}, {0, 2, 3}};
  }
  ExportMesh mesh;
  const RenderMesh split =
      make_render_mesh(drawn.vertices, drawn.triangles, drawn.colours, drawn.texture_map);
  mesh.split = split_of(split);
  mesh.radius_m = split.radius_m;
  CornerMesh told = make_corner_mesh(drawn.vertices, drawn.triangles);
  mesh.normals = std::move(told.normals);
  // The positions may still contain both 0 and -0.
  std::map<std::array<float, 3>, uint32_t> place;
  std::vector<uint32_t> point_of;
  for (const Vec3f& p : told.positions) {
    const auto [found, is_new] =
        place.try_emplace({p.x(), p.y(), p.z()}, static_cast<uint32_t>(mesh.points.size()));
    if (is_new) mesh.points.push_back(p);
    point_of.push_back(found->second);
  }
  for (const uint32_t corner : told.corners) mesh.corners.push_back(point_of[corner]);
  mesh.texture_map.textures = drawn.texture_map.textures;
  for (const uint32_t triangle : told.source) {
    if (!drawn.colours.empty()) mesh.colours.push_back(drawn.colours[triangle]);
    if (!drawn.texture_map.empty()) mesh.texture_map.add(drawn.texture_map, triangle);
  }
  return mesh;
}

uint32_t NumberedTextures::number(const Texture& texture) {
  const auto found = std::ranges::find(all_, &texture);
  const auto number = static_cast<uint32_t>(1 + (found - all_.begin()));
  if (found == all_.end()) all_.push_back(&texture);
  return number;
}

std::vector<uint32_t> NumberedTextures::numbers(const TextureMap& map) {
  std::vector<uint32_t> numbers;
  for (const uint32_t own : map.texture) {
    numbers.push_back(own == 0 ? 0 : number(*map.textures[own - 1]));
  }
  return numbers;
}

}  // namespace pilesim
