#include "geometry/mesh_check.h"

#include <algorithm>
#include <map>
#include <span>
#include <sstream>

#include "core/disjoint_sets.h"
#include "geometry/half_edges.h"
#include "geometry/inside_test.h"
#include "geometry/mass_properties.h"
#include "geometry/self_touching.h"

namespace pilesim {
namespace {

// Triangles lower than this part of the mesh's diagonal have no area.
constexpr double kDegenerateHeight = 1e-9;

std::string place(const Vec3& point) {
  std::ostringstream text;
  text << '(' << point.x() << ", " << point.y() << ", " << point.z() << ')';
  return text.str();
}

std::string triangle_text(const TriangleMesh& mesh, uint32_t index) {
  const auto& [a, b, c] = mesh.triangles[index];
  const Vec3 middle = (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3.0;
  return "triangle " + std::to_string(index) + " (vertices " + std::to_string(a) + ", " +
         std::to_string(b) + ", " + std::to_string(c) + ") at " + place(middle);
}

// Collects one kind of defect: how often, and the first place.
class Finding {
 public:
  explicit Finding(MeshDefectKind kind) : defect_{.kind = kind, .count = 0, .text = {}} {}
  template <typename Text>
  void add(const Text& text) {
    if (defect_.count++ == 0) defect_.text = text();
  }
  void report(const std::string& noun, std::vector<MeshDefect>& defects) const {
    if (defect_.count == 0) return;
    defects.push_back(defect_);
    if (defect_.count > 1) {
      defects.back().text += "; " + std::to_string(defect_.count) + ' ' + noun + " in all";
    }
  }

 private:
  MeshDefect defect_;
};

void find_degenerate(const TriangleMesh& mesh, double diagonal, std::vector<MeshDefect>& defects) {
  Finding finding(MeshDefectKind::degenerate);
  for (uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& [ia, ib, ic] = mesh.triangles[i];
    const Vec3 &a = mesh.vertices[ia], &b = mesh.vertices[ib], &c = mesh.vertices[ic];
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    const double doubled_area = (b - a).cross(c - a).norm();
    if (doubled_area > longest * kDegenerateHeight * diagonal) continue;
    finding.add([&] { return triangle_text(mesh, i) + " has no area"; });
  }
  finding.report("such triangles", defects);
}

std::string edge_text(const TriangleMesh& mesh, const HalfEdge& edge) {
  return "edge (" + std::to_string(edge.low) + ", " + std::to_string(edge.high) + ") from " +
         place(mesh.vertices[edge.low]) + " to " + place(mesh.vertices[edge.high]);
}

void find_bad_edges(const TriangleMesh& mesh, std::vector<MeshDefect>& defects) {
  Finding open(MeshDefectKind::open_edge), crowded(MeshDefectKind::non_manifold),
      inconsistent(MeshDefectKind::inconsistent);
  const HalfEdges sides(mesh.triangles, mesh.vertices.size());
  sides.for_each_edge([&](std::span<const HalfEdge> edge) {
    const HalfEdge& first = edge[0];
    if (edge.size() == 1) {
      open.add([&] {
        return edge_text(mesh, first) + " has one triangle only (" +
               std::to_string(first.triangle) + "): the surface is open there";
      });
    } else if (edge.size() > 2) {
      crowded.add([&] {
        return edge_text(mesh, first) + " has " + std::to_string(edge.size()) +
               " triangles: the inside is not clear there";
      });
    } else if (first.forward == edge[1].forward) {
      inconsistent.add([&] {
        return edge_text(mesh, first) + " has neighbours of opposite orientation (triangles " +
               std::to_string(first.triangle) + " and " + std::to_string(edge[1].triangle) + ')';
      });
    }
  });
  open.report("open edges", defects);
  crowded.report("such edges", defects);
  inconsistent.report("such edges", defects);
}

// A connected piece of the surface, by one triangle of it: the largest.
std::vector<uint32_t> largest_triangle_of_each_piece(const TriangleMesh& mesh) {
  DisjointSets pieces;
  pieces.reset(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    pieces.unite(a, b);
    pieces.unite(a, c);
  }
  const auto area = [&](uint32_t triangle) {
    const auto& [a, b, c] = mesh.triangles[triangle];
    const Vec3& origin = mesh.vertices[a];
    return (mesh.vertices[b] - origin).cross(mesh.vertices[c] - origin).norm();
  };
  std::map<uint32_t, uint32_t> largest;  // by piece
  for (uint32_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto [place, is_new] = largest.try_emplace(pieces.find(mesh.triangles[i][0]), i);
    if (!is_new && area(i) > area(place->second)) place->second = i;
  }
  std::vector<uint32_t> triangles;
  for (const auto& [piece, triangle] : largest) triangles.push_back(triangle);
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

// How many solids lie just outside of each piece: 0 is proper, below 0 the piece is inside out,
// above 0 it lies inside another one and its volume would count twice.
struct Orientation {
  Finding inside_out{MeshDefectKind::inside_out};
  Finding nested{MeshDefectKind::self_touching};
};

// Half of the distance within which triangles touch, as a share of the diagonal, so that nothing
// lies between.
constexpr double kJustOutside = 5e-13;

Orientation find_orientation(const TriangleMesh& mesh, double diagonal) {
  Orientation found;
  const std::vector<uint32_t> pieces = largest_triangle_of_each_piece(mesh);
  if (pieces.size() == 1) {
    const double volume = mass_properties(mesh).volume_m3;
    if (volume < 0) {
      found.inside_out.add([&] {
        std::ostringstream text;
        text << "all triangles face inward: the volume is " << volume << " m^3";
        return text.str();
      });
    }
    return found;
  }
  const InsideTest inside(mesh);
  for (const uint32_t piece : pieces) {
    const auto& [ia, ib, ic] = mesh.triangles[piece];
    const Vec3 &a = mesh.vertices[ia], &b = mesh.vertices[ib], &c = mesh.vertices[ic];
    const Vec3 normal = (b - a).cross(c - a).normalized();
    const Vec3 outside = (a + b + c) / 3.0 + kJustOutside * diagonal * normal;
    const double solids = inside.winding_number(outside);
    if (solids < -0.5) {
      found.inside_out.add(
          [&] { return "the piece with " + triangle_text(mesh, piece) + " faces inward"; });
    } else if (solids > 0.5) {
      found.nested.add([&] {
        return "the piece with " + triangle_text(mesh, piece) +
               " lies inside another one, so that their volume counts twice";
      });
    }
  }
  return found;
}

void find_self_touching(const TriangleMesh& mesh, std::vector<MeshDefect>& defects) {
  const TouchingTriangles touching = find_touching_triangles(mesh);
  if (touching.count == 0) return;
  const uint32_t first = touching.first.first, second = touching.first.second;
  Finding finding(MeshDefectKind::self_touching);
  finding.add([&] {
    return triangle_text(mesh, first) + " touches or crosses " + triangle_text(mesh, second);
  });
  for (size_t more = 1; more < touching.count; ++more) finding.add([] { return std::string(); });
  finding.report("such pairs", defects);
}

std::vector<MeshDefect> find_defects(const TriangleMesh& mesh, bool may_touch) {
  Bounds used;
  for (const Triangle& triangle : mesh.triangles) {
    for (const uint32_t vertex : triangle) used.extend(mesh.vertices[vertex]);
  }
  const double diagonal = used.isEmpty() ? 0.0 : used.diagonal().norm();
  if (!(diagonal > 0)) {
    return {{MeshDefectKind::empty, 1,
             mesh.triangles.empty() ? "there are no triangles" : "all vertices are one point"}};
  }
  std::vector<MeshDefect> defects;
  find_degenerate(mesh, diagonal, defects);
  find_bad_edges(mesh, defects);
  if (!defects.empty()) return defects;

  const Orientation orientation = find_orientation(mesh, diagonal);
  orientation.inside_out.report("such pieces", defects);
  if (!defects.empty()) return defects;
  std::vector<MeshDefect> nested;
  orientation.nested.report("such pieces", nested);
  if (may_touch && nested.empty()) return {};
  find_self_touching(mesh, defects);
  if (defects.empty()) return nested;
  return may_touch ? std::vector<MeshDefect>() : defects;
}

}  // namespace

std::vector<MeshDefect> find_mesh_defects(const TriangleMesh& mesh) {
  return find_defects(mesh, false);
}

std::vector<MeshDefect> find_volume_defects(const TriangleMesh& mesh) {
  return find_defects(mesh, true);
}

}  // namespace pilesim
