#include "geometry/mesh_clip.h"

#include <algorithm>
#include <cassert>
#include <unordered_map>

namespace pilesim {
namespace {

using Edge = FacetedSolid::Edge;
using Face = FacetedSolid::Face;

// One side of a cut while it is being built.
class SideBuilder {
 public:
  SideBuilder(const FacetedSolid& source, FacetedSolid& side)
      : source_(source), side_(side), index_(source.vertices.size(), kNone) {}

  uint32_t old_vertex(uint32_t vertex) {
    if (index_[vertex] == kNone) index_[vertex] = new_vertex(source_.vertices[vertex]);
    return index_[vertex];
  }
  uint32_t new_vertex(const Vec3& position) {
    side_.vertices.push_back(position);
    return static_cast<uint32_t>(side_.vertices.size() - 1);
  }
  void add_edge(uint32_t from, uint32_t to) { side_.edges.push_back({from, to}); }
  void add_cap_edge(uint32_t from, uint32_t to) { cap_.push_back({from, to}); }
  // Ends a face made of the edges added since the last one.
  void end_face(const Vec3& normal, bool is_cap) {
    const uint32_t first =
        side_.faces.empty() ? 0 : side_.faces.back().first_edge + side_.faces.back().edge_count;
    const auto count = static_cast<uint32_t>(side_.edges.size()) - first;
    if (count > 0) side_.faces.push_back({normal, first, count, is_cap});
  }
  void add_cap(const Vec3& normal) {
    side_.edges.insert(side_.edges.end(), cap_.begin(), cap_.end());
    end_face(normal, true);
  }

 private:
  static constexpr uint32_t kNone = ~0u;
  const FacetedSolid& source_;
  FacetedSolid& side_;
  std::vector<uint32_t> index_;
  std::vector<Edge> cap_;
};

// Where an edge of the solid crosses the plane: the vertex of each side's solid.
struct Crossing {
  Vec3 position;
  uint32_t below, above;
};

struct FaceCrossing {
  double along;  // position along the line in which the face meets the plane
  const Crossing* crossing;
};

bool by_position(const FaceCrossing& a, const FaceCrossing& b) { return a.along < b.along; }

}  // namespace

double FacetedSolid::volume() const {
  if (vertices.empty()) return 0;
  const Vec3 origin = vertices.front();
  double six_volumes = 0;
  for (const Face& face : faces) {
    const Vec3 anchor = vertices[edges[face.first_edge].from];
    Vec3 twice_area = Vec3::Zero();
    for (uint32_t e = face.first_edge; e < face.first_edge + face.edge_count; ++e) {
      twice_area += (vertices[edges[e].from] - anchor).cross(vertices[edges[e].to] - anchor);
    }
    six_volumes += (anchor - origin).dot(twice_area);
  }
  return six_volumes / 6.0;
}

double FacetedSolid::volume_above(const ClipPlane& plane) const {
  std::vector<double> distance(vertices.size());
  for (size_t v = 0; v < distance.size(); ++v) distance[v] = plane.distance(vertices[v]);
  // Seen from a point of the plane the cap has no volume, and seen from a point of the line in
  // which a face meets the plane that side of the face has no area: neither needs to be built.
  const Vec3 origin = plane.offset * plane.normal;
  std::vector<std::pair<Vec3, Vec3>> above;  // the parts of the face's edges above
  double six_volumes = 0;
  for (const Face& face : faces) {
    above.clear();
    Vec3 anchor = vertices[edges[face.first_edge].from];
    for (uint32_t e = face.first_edge; e < face.first_edge + face.edge_count; ++e) {
      const auto [from, to] = edges[e];
      if (distance[from] < 0 && distance[to] < 0) continue;
      if (distance[from] >= 0 && distance[to] >= 0) {
        above.push_back({vertices[from], vertices[to]});
        continue;
      }
      anchor = plane_crossing(vertices[from], distance[from], vertices[to], distance[to]);
      above.push_back(distance[to] < 0 ? std::pair(vertices[from], anchor)
                                       : std::pair(anchor, vertices[to]));
    }
    Vec3 twice_area = Vec3::Zero();
    for (const auto& [from, to] : above) twice_area += (from - anchor).cross(to - anchor);
    six_volumes += (anchor - origin).dot(twice_area);
  }
  return six_volumes / 6.0;
}

FacetedSolid faceted_solid(const TriangleMesh& mesh) {
  FacetedSolid solid;
  solid.vertices = mesh.vertices;
  solid.edges.reserve(3 * mesh.triangles.size());
  solid.faces.reserve(mesh.triangles.size());
  for (const Triangle& t : mesh.triangles) {
    const Vec3& a = mesh.vertices[t[0]];
    const Vec3 normal = (mesh.vertices[t[1]] - a).cross(mesh.vertices[t[2]] - a).stableNormalized();
    solid.faces.push_back({normal, static_cast<uint32_t>(solid.edges.size()), 3, false});
    for (int k = 0; k < 3; ++k) solid.edges.push_back({t[k], t[(k + 1) % 3]});
  }
  return solid;
}

SplitSolid split(const FacetedSolid& solid, const ClipPlane& plane) {
  SplitSolid result;
  SideBuilder below(solid, result.below);
  SideBuilder above(solid, result.above);
  std::vector<double> distance(solid.vertices.size());
  for (size_t v = 0; v < distance.size(); ++v) distance[v] = plane.distance(solid.vertices[v]);

  std::unordered_map<uint64_t, Crossing> crossings;  // by edge; never iterated over
  const auto crossing_of = [&](const Edge& edge) -> const Crossing* {
    const auto [low, high] = std::minmax(edge.from, edge.to);
    const auto [entry, added] = crossings.try_emplace(static_cast<uint64_t>(low) << 32 | high);
    Crossing& crossing = entry->second;
    if (added) {
      crossing.position =
          plane_crossing(solid.vertices[low], distance[low], solid.vertices[high], distance[high]);
      crossing.below = below.new_vertex(crossing.position);
      crossing.above = above.new_vertex(crossing.position);
    }
    return &crossing;
  };

  std::vector<FaceCrossing> upward, downward;  // crossings of one face's boundary
  for (const Face& face : solid.faces) {
    upward.clear();
    downward.clear();
    // A new edge of the part below runs along this direction, its solid to the left.
    const Vec3 line = face.normal.cross(plane.normal);
    for (uint32_t e = face.first_edge; e < face.first_edge + face.edge_count; ++e) {
      const Edge& edge = solid.edges[e];
      const bool from_above = distance[edge.from] >= 0;
      const bool to_above = distance[edge.to] >= 0;
      if (from_above && to_above) {
        above.add_edge(above.old_vertex(edge.from), above.old_vertex(edge.to));
      } else if (!from_above && !to_above) {
        below.add_edge(below.old_vertex(edge.from), below.old_vertex(edge.to));
      } else {
        const Crossing* crossing = crossing_of(edge);
        const double along = line.dot(crossing->position);
        if (to_above) {
          below.add_edge(below.old_vertex(edge.from), crossing->below);
          above.add_edge(crossing->above, above.old_vertex(edge.to));
          upward.push_back({along, crossing});
        } else {
          above.add_edge(above.old_vertex(edge.from), crossing->above);
          below.add_edge(crossing->below, below.old_vertex(edge.to));
          downward.push_back({along, crossing});
        }
      }
    }
    assert(upward.size() == downward.size());
    std::ranges::stable_sort(upward, by_position);
    std::ranges::stable_sort(downward, by_position);
    for (size_t k = 0; k < upward.size(); ++k) {
      const Crossing& start = *upward[k].crossing;
      const Crossing& end = *downward[k].crossing;
      below.add_edge(start.below, end.below);
      above.add_edge(end.above, start.above);
      below.add_cap_edge(end.below, start.below);
      above.add_cap_edge(start.above, end.above);
    }
    below.end_face(face.normal, face.is_cap);
    above.end_face(face.normal, face.is_cap);
  }
  below.add_cap(plane.normal);
  above.add_cap(-plane.normal);
  return result;
}

FacetedSolid united(const FacetedSolid& a, const FacetedSolid& b) {
  FacetedSolid result = a;
  const auto vertex_shift = static_cast<uint32_t>(a.vertices.size());
  const auto edge_shift = static_cast<uint32_t>(a.edges.size());
  result.vertices.insert(result.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const Edge& edge : b.edges) {
    result.edges.push_back({edge.from + vertex_shift, edge.to + vertex_shift});
  }
  for (const Face& face : b.faces) {
    result.faces.push_back(face);
    result.faces.back().first_edge += edge_shift;
  }
  return result;
}

}  // namespace pilesim
