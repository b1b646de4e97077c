#include "geometry/decimation.h"

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

constexpr uint32_t kGone = UINT32_MAX;
constexpr double kLeastHeight = 1e-6;  // of a triangle, in the extent
constexpr double kLeastTurn = 0.3;     // cosine between a triangle's normals before and after
// Rounds at growing errors, so that the flattest parts go first; the last one as often as it helps.
constexpr double kShares[] = {0.03, 0.3, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
constexpr double kWorthwhileShare = 0.01;  // share of the vertices that a further round has to take

// Mean square of the distances from planes, by their weights.
struct Quadric {
  Mat3 a = Mat3::Zero();
  Vec3 b = Vec3::Zero();
  double c = 0, weight = 0;

  void add_plane(const Vec3& normal, double offset, double own_weight) {
    a += own_weight * normal * normal.transpose();
    b -= own_weight * offset * normal;
    c += own_weight * offset * offset;
    weight += own_weight;
  }
  void add(const Quadric& other) {
    a += other.a;
    b += other.b;
    c += other.c;
    weight += other.weight;
  }
  double operator()(const Vec3& p) const {
    return weight > 0 ? (p.dot(a * p) + 2 * b.dot(p) + c) / weight : 0;
  }
};

class Decimation {
 public:
  explicit Decimation(const TriangleMesh& mesh)
      : triangles_(mesh.triangles),
        around_(mesh.vertices.size()),
        quadrics_(mesh.vertices.size()),
        in_ring_(mesh.vertices.size()),
        counted_(mesh.vertices.size()) {
    const Bounds box = mesh.bounds();
    extent_ = box.diagonal().norm();
    for (const Vec3& vertex : mesh.vertices) places_.push_back(vertex - box.center());
    constexpr size_t kUsual = 8;
    for (std::vector<uint32_t>& around : around_) around.reserve(kUsual);
    for (uint32_t i = 0; i < triangles_.size(); ++i) {
      const auto [a, b, c] = triangles_[i];
      const Vec3 doubled = normal_of(triangles_[i]);
      const double area = doubled.norm();
      for (const uint32_t v : triangles_[i]) around_[v].push_back(i);
      if (!(area > 0)) continue;
      const Vec3 normal = doubled / area;
      for (const uint32_t v : {a, b, c}) {
        quadrics_[v].add_plane(normal, normal.dot(places_[a]), area);
      }
    }
  }

  // How many vertices it took.
  size_t round(double error_m, const std::vector<uint8_t>& keeps) {
    const double limit = error_m * error_m;
    size_t taken = 0;
    // Neighbours of removed vertices wait for the next round: else a whole flat goes to one vertex.
    std::vector<uint8_t> waits = keeps;
    waits.resize(around_.size(), 0);
    for (uint32_t v = 0; v < around_.size(); ++v) {
      if (around_[v].empty() || waits[v] != 0) continue;
      find_neighbours(v);
      choices_.clear();
      for (const uint32_t u : ring_) {
        Quadric sum = quadrics_[v];
        sum.add(quadrics_[u]);
        const double error = sum(places_[u]);
        if (error <= limit) choices_.emplace_back(error, u);
      }
      std::ranges::sort(choices_);
      const auto choice =
          std::ranges::find_if(choices_, [&](const auto& each) { return may_go(v, each.second); });
      if (choice == choices_.end()) continue;
      give(v, choice->second);
      for (const uint32_t u : ring_) waits[u] = 1;
      ++taken;
    }
    return taken;
  }

  TriangleMesh result(const TriangleMesh& mesh) const {
    TriangleMesh fewer;
    std::vector<uint32_t> place(mesh.vertices.size(), kGone);
    for (Triangle triangle : triangles_) {
      if (triangle[0] == kGone) continue;
      for (uint32_t& v : triangle) {
        if (place[v] == kGone) {
          place[v] = static_cast<uint32_t>(fewer.vertices.size());
          fewer.vertices.push_back(mesh.vertices[v]);
        }
        v = place[v];
      }
      fewer.triangles.push_back(triangle);
    }
    return fewer;
  }

 private:
  Vec3 normal_of(const Triangle& t) const {
    return (places_[t[1]] - places_[t[0]]).cross(places_[t[2]] - places_[t[0]]);
  }

  // Into ring_, and marks them.
  void find_neighbours(uint32_t v) {
    ring_.clear();
    ++mark_;
    for (const uint32_t i : around_[v]) {
      for (const uint32_t u : triangles_[i]) {
        if (u == v || in_ring_[u] == mark_) continue;
        in_ring_[u] = mark_;
        ring_.push_back(u);
      }
    }
  }

  // Number of vertices in ring_ that are next to `u`.
  size_t common_neighbours(uint32_t u) {
    ++count_mark_;
    size_t common = 0;
    for (const uint32_t i : around_[u]) {
      for (const uint32_t w : triangles_[i]) {
        if (w == u || in_ring_[w] != mark_ || counted_[w] == count_mark_) continue;
        counted_[w] = count_mark_;
        ++common;
      }
    }
    return common;
  }

  // That the surface around stays one, and all triangles have a height and face as they did.
  bool may_go(uint32_t v, uint32_t u) {
    if (ring_.size() < 4 || common_neighbours(u) != 2) return false;
    for (const uint32_t i : around_[v]) {
      Triangle triangle = triangles_[i];
      if (std::ranges::find(triangle, u) != triangle.end()) continue;
      const Vec3 before = normal_of(triangle);
      std::ranges::replace(triangle, v, u);
      const Vec3 after = normal_of(triangle);
      double longest = 0;
      for (size_t k = 0; k < 3; ++k) {
        longest = std::max(longest, (places_[triangle[k]] - places_[triangle[(k + 1) % 3]]).norm());
      }
      if (after.norm() < kLeastHeight * extent_ * longest) return false;
      if (before.dot(after) < kLeastTurn * before.norm() * after.norm()) return false;
    }
    return true;
  }

  void give(uint32_t v, uint32_t u) {
    for (const uint32_t i : around_[v]) {
      Triangle& triangle = triangles_[i];
      if (std::ranges::find(triangle, u) == triangle.end()) {
        std::ranges::replace(triangle, v, u);
        around_[u].push_back(i);
        continue;
      }
      for (const uint32_t w : triangle) {
        if (w != v) std::erase(around_[w], i);
      }
      triangle = {kGone, kGone, kGone};
    }
    around_[v].clear();
    quadrics_[u].add(quadrics_[v]);
  }

  std::vector<Triangle> triangles_;            // those that are gone have no corners
  std::vector<Vec3> places_;                   // about the middle, m
  std::vector<std::vector<uint32_t>> around_;  // (vertex) its triangles; none: it is gone
  std::vector<Quadric> quadrics_;              // (vertex)
  std::vector<std::pair<double, uint32_t>> choices_;
  std::vector<uint32_t> ring_;               // around the vertex that is looked at
  std::vector<uint64_t> in_ring_, counted_;  // (vertex) the last mark that it got
  uint64_t mark_ = 0, count_mark_ = 0;
  double extent_ = 0;
};

}  // namespace

TriangleMesh decimated(const TriangleMesh& mesh, double error_m,
                       const std::vector<uint8_t>& keeps) {
  Decimation decimation(mesh);
  size_t left = mesh.vertices.size();
  for (const double share : kShares) {
    const size_t taken = decimation.round(share * error_m, keeps);
    left -= taken;
    if (share == 1 && static_cast<double>(taken) < kWorthwhileShare * static_cast<double>(left))
      break;
  }
  return decimation.result(mesh);
}

}  // namespace pilesim
