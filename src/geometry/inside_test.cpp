#include "geometry/inside_test.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <tuple>
#include <vector>

#include "geometry/triangle_tree.h"

namespace pilesim {
namespace {

using Edge = std::array<uint32_t, 2>;  // vertex indices, directed

// Directed edges after opposite ones cancel: the border of their cluster of triangles. A tangled
// cluster may have an edge several times.
std::vector<Edge> cancelled(std::vector<Edge> edges) {
  const auto undirected = [](const Edge& e) { return std::minmax(e[0], e[1]); };
  std::sort(edges.begin(), edges.end(),
            [&](const Edge& a, const Edge& b) { return undirected(a) < undirected(b); });
  std::vector<Edge> border;
  for (auto begin = edges.begin(); begin != edges.end();) {
    const auto [low, high] = undirected(*begin);
    int surplus = 0;
    auto end = begin;
    for (; end != edges.end() && std::minmax((*end)[0], (*end)[1]) == std::minmax(low, high);
         ++end) {
      surplus += (*end)[0] == low ? 1 : -1;
    }
    const Edge edge = surplus > 0 ? Edge{low, high} : Edge{high, low};
    border.insert(border.end(), static_cast<size_t>(std::abs(surplus)), edge);
    begin = end;
  }
  return border;
}

// Signed solid angle of a triangle (Van Oosterom and Strackee 1983), sr. Positive if its outside
// faces away from `point`.
double solid_angle(const Vec3& corner_a, const Vec3& corner_b, const Vec3& corner_c,
                   const Vec3& point) {
  const Vec3 a = corner_a - point, b = corner_b - point, c = corner_c - point;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  const double volume = a.dot(b.cross(c));
  const double scale = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
  return 2.0 * std::atan2(volume, scale);
}

}  // namespace

struct InsideTest::Tree {
  explicit Tree(const TriangleMesh& mesh) : triangles(mesh, 8), vertices(mesh.vertices) {
    const std::vector<TriangleTree::Node>& nodes = triangles.nodes();
    caps.resize(nodes.size());
    std::vector<std::vector<Edge>> borders(nodes.size());
    for (size_t i = nodes.size(); i-- > 0;) {  // children lie behind their parents
      const TriangleTree::Node& node = nodes[i];
      std::vector<Edge> edges;
      if (node.is_leaf()) {
        for (uint32_t k = node.first; k < node.first + node.count; ++k) {
          const auto& [a, b, c] = mesh.triangles[triangles.triangles()[k]];
          edges.insert(edges.end(), {{a, b}, {b, c}, {c, a}});
        }
      } else {
        edges = std::move(borders[i + 1]);
        edges.insert(edges.end(), borders[node.right].begin(), borders[node.right].end());
        borders[node.right] = {};
      }
      borders[i] = cancelled(std::move(edges));
      store_cap(i, borders[i]);
    }
  }

  // A cap of more triangles than the cluster has is of no use.
  void store_cap(size_t index, const std::vector<Edge>& border) {
    if (border.size() >= triangles.nodes()[index].count) return;
    caps[index] = {static_cast<uint32_t>(cap_edges.size()), static_cast<uint32_t>(border.size()),
                   true};
    cap_edges.insert(cap_edges.end(), border.begin(), border.end());
  }

  double solid_angle_below(uint32_t index, const Vec3& point) const {
    const TriangleTree::Node& node = triangles.nodes()[index];
    const Cap& cap = caps[index];
    double sum = 0;
    if (cap.exists && !node.box.contains(point)) {
      const Vec3 apex = node.box.center();
      for (const auto& [a, b] : std::span(cap_edges).subspan(cap.first, cap.count)) {
        sum += solid_angle(apex, vertices[a], vertices[b], point);
      }
      return sum;
    }
    if (!node.is_leaf()) {
      return solid_angle_below(index + 1, point) + solid_angle_below(node.right, point);
    }
    for (uint32_t i = node.first; i < node.first + node.count; ++i) {
      const auto& [a, b, c] = triangles.corners()[i];
      sum += solid_angle(a, b, c, point);
    }
    return sum;
  }

  // The fan from the middle of a node's box over the border of its triangles.
  struct Cap {
    uint32_t first = 0;  // of cap_edges
    uint32_t count = 0;
    bool exists = false;
  };

  TriangleTree triangles;
  std::vector<Vec3> vertices;
  std::vector<Cap> caps;  // per node
  std::vector<Edge> cap_edges;
};

InsideTest::InsideTest(const TriangleMesh& mesh) : tree_(std::make_unique<Tree>(mesh)) {}
InsideTest::~InsideTest() = default;
InsideTest::InsideTest(InsideTest&&) noexcept = default;
InsideTest& InsideTest::operator=(InsideTest&&) noexcept = default;

double InsideTest::winding_number(const Vec3& point) const {
  return tree_->solid_angle_below(0, point) / (4.0 * kPi);
}

}  // namespace pilesim
