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

// The sum of signed solid angles of triangles (Van Oosterom and Strackee 1983), positive where the
// outside of a triangle faces away from `point`. The tangent of half of each is the ratio of two
// products; the half angles are added as the directions of complex numbers are when these are
// multiplied, and one arc tangent is taken at the end.
class SolidAngle {
 public:
  explicit SolidAngle(const Vec3& point) : point_(point) {}

  void add(const Vec3& corner_a, const Vec3& corner_b, const Vec3& corner_c) {
    const Vec3 a = corner_a - point_, b = corner_b - point_, c = corner_c - point_;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    const double y = a.dot(b.cross(c));
    const double x = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    const double size = std::abs(x) + std::abs(y);
    if (size == 0) return;
    const double turned_x = (x_ * x - y_ * y) / size, turned_y = (x_ * y + y_ * x) / size;
    // The direction is kept within half a turn; two of one sign whose sum has the other have passed
    // it.
    const bool up = y_ >= 0, also_up = y >= 0, ends_up = turned_y >= 0;
    if (up == also_up && up != ends_up) half_turns_ += up ? 2 : -2;
    const double scale = 1 / (std::abs(turned_x) + std::abs(turned_y));
    x_ = scale * turned_x;
    y_ = scale * turned_y;
  }
  double steradians() const { return 2 * (std::atan2(y_, x_) + kPi * half_turns_); }

 private:
  Vec3 point_;
  double x_ = 1, y_ = 0;
  int half_turns_ = 0;
};

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

  void add_below(uint32_t index, const Vec3& point, SolidAngle& sum) const {
    const TriangleTree::Node& node = triangles.nodes()[index];
    const Cap& cap = caps[index];
    if (cap.exists && !node.box.contains(point)) {
      const Vec3 apex = node.box.center();
      for (const auto& [a, b] : std::span(cap_edges).subspan(cap.first, cap.count)) {
        sum.add(apex, vertices[a], vertices[b]);
      }
      return;
    }
    if (!node.is_leaf()) {
      add_below(index + 1, point, sum);
      add_below(node.right, point, sum);
      return;
    }
    for (uint32_t i = node.first; i < node.first + node.count; ++i) {
      const auto& [a, b, c] = triangles.corners()[i];
      sum.add(a, b, c);
    }
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
  SolidAngle sum(point);
  tree_->add_below(0, point, sum);
  return sum.steradians() / (4.0 * kPi);
}

}  // namespace pilesim
