#include "geometry/wrap.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <unordered_map>
#include <unordered_set>

#include "core/parallel_for.h"
#include "geometry/decimation.h"
#include "geometry/fast_winding.h"
#include "geometry/mesh_check.h"
#include "geometry/self_touching.h"

namespace pilesim {
namespace {

// Grid points along a block's side: blocks that the surface does not come near are never looked at.
constexpr int kBlock = 8;
// Crossings of an edge stay this far from its ends, in its length, so that no triangle is flat.
constexpr double kFromEnds = 0.05;
// Where the surface is found by halves, on an edge that crosses no triangle.
constexpr int kHalves = 10;
// Farther from the triangles than 1.5 diagonals of a cell, distances play no part in it.
constexpr double kFarInCells = 2.6;
constexpr double kRounded = 1e-9;  // cells
// How far simplification may move the surface, in cells.
constexpr double kSimplified = 0.1;

// The six tetrahedra of a cube around its diagonal (Kuhn), by corners: bit 0 is x, 1 is y, 2 is z.
// Neighbouring cubes cut their common face alike.
constexpr std::array<std::array<int, 4>, 6> kTetrahedra = {
    {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7}, {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}}};

struct Cell {
  int x, y, z;
};

class Wrapper {
 public:
  Wrapper(const TriangleMesh& mesh, const TriangleMesh& sheets, const WrapOptions& options)
      : thickness_m_(sheets.triangles.empty() ? 0 : options.thickness_m) {
    if (!mesh.triangles.empty()) enclosing_.emplace(mesh);
    if (!sheets.triangles.empty()) sheets_.emplace(sheets);
    Bounds box;
    for (const TriangleMesh* each : {&mesh, &sheets}) {
      for (const Triangle& triangle : each->triangles) {
        for (const uint32_t vertex : triangle) box.extend(each->vertices[vertex]);
      }
    }
    const double longest = box.sizes().maxCoeff() + thickness_m_;
    cell_ = longest / options.cells;
    // A margin of two cells, and nowhere on the grid where meshes like to have faces.
    origin_ = box.min() - Vec3::Constant(thickness_m_ / 2 + 2.37 * cell_);
    const Vec3 sizes = box.sizes() + Vec3::Constant(thickness_m_ + 4.9 * cell_);
    for (int k = 0; k < 3; ++k) {
      blocks_[k] = static_cast<int>(std::ceil(sizes[k] / cell_ / kBlock)) + 1;
    }
  }

  double cell() const { return cell_; }

  // To the surface that the wrap is to follow, m.
  double distance(const Vec3& point) const {
    double distance = std::numeric_limits<double>::infinity();
    if (enclosing_) distance = enclosing_->triangles().distance(point);
    if (sheets_)
      distance = std::min(distance, std::abs(sheets_->distance(point) - thickness_m_ / 2));
    return distance;
  }
  bool encloses(const Vec3& point) const { return enclosing_ && enclosing_->contains(point); }

  TriangleMesh surface() {
    find_blocks();
    march();
    place_openings();
    return std::move(mesh_);
  }

 private:
  // Grid points of a block and the next ones: its cells' corners.
  static constexpr int kPoints = kBlock + 1;

  struct Block {
    std::array<float, size_t{kPoints} * kPoints * kPoints>
        value;  // below 0 inside; |value| in cells: from kFarInCells on it may be less than it is
  };

  static constexpr size_t kPointsOfBlock = size_t{kPoints} * kPoints * kPoints;
  using BlockValues = std::array<double, kPointsOfBlock>;

  template <class Visit>
  static void for_each_point(const Visit& visit) {  // in the order of place()
    for (int z = 0; z < kPoints; ++z) {
      for (int y = 0; y < kPoints; ++y) {
        for (int x = 0; x < kPoints; ++x) visit(x, y, z);
      }
    }
  }
  // visit(place) of those along the axes, within the block.
  template <class Visit>
  static void for_each_neighbour(int x, int y, int z, const Visit& visit) {
    if (x > 0) visit(place(x - 1, y, z));
    if (y > 0) visit(place(x, y - 1, z));
    if (z > 0) visit(place(x, y, z - 1));
    if (x + 1 < kPoints) visit(place(x + 1, y, z));
    if (y + 1 < kPoints) visit(place(x, y + 1, z));
    if (z + 1 < kPoints) visit(place(x, y, z + 1));
  }

  // visit(place, how far away in cells) of all 26, within the block.
  template <class Visit>
  static void for_each_around(const Eigen::Vector3i& at, const Visit& visit) {
    static const std::array<double, 4> kAway = {0, 1, std::sqrt(2.0), std::sqrt(3.0)};
    const Eigen::Vector3i low = (at.array() - 1).max(0), high = (at.array() + 1).min(kPoints - 1);
    for (int z = low.z(); z <= high.z(); ++z) {
      for (int y = low.y(); y <= high.y(); ++y) {
        for (int x = low.x(); x <= high.x(); ++x) {
          const int steps = (x != at.x()) + (y != at.y()) + (z != at.z());
          if (steps > 0) visit(place(x, y, z), kAway[static_cast<size_t>(steps)]);
        }
      }
    }
  }

  Vec3 point_of(const Cell& b, int x, int y, int z) const {
    return point(b.x * kBlock + x, b.y * kBlock + y, b.z * kBlock + z);
  }
  Vec3 point(int x, int y, int z) const { return origin_ + cell_ * Vec3(x, y, z); }
  size_t index(int x, int y, int z) const {
    return (static_cast<size_t>(z) * static_cast<size_t>(blocks_[1]) + static_cast<size_t>(y)) *
               static_cast<size_t>(blocks_[0]) +
           static_cast<size_t>(x);
  }

  bool is_inside(const Vec3& at) const {
    return encloses(at) || (sheets_ && sheets_->distance(at) < thickness_m_ / 2);
  }

  // Distances of a block's points from the enclosing triangles, in cells. From kFarInCells on those
  // of their neighbours tell enough.
  void measure(const Cell& b, BlockValues& distance) const {
    std::array<double, kPointsOfBlock> most;  // no farther
    for_each_point([&](int x, int y, int z) {
      const size_t i = place(x, y, z);
      double least = 0;
      most[i] = std::numeric_limits<double>::infinity();
      for_each_neighbour(x, y, z, [&](size_t other) {
        if (other > i) return;
        least = std::max(least, distance[other] - 1 - kRounded);
        most[i] = std::min(most[i], most[other] + 1 + kRounded);
      });
      if (least < kFarInCells) {
        least = enclosing_->triangles().distance(point_of(b, x, y, z), most[i] * cell_) / cell_;
        most[i] = least;
      }
      distance[i] = least;
    });
  }

  // Gives distances of points that are inside the other sign. From the farthest one on, points take
  // the side of a neighbour where no triangle lies between them and winding numbers cannot change
  // so much otherwise.
  void sign(const Cell& b, BlockValues& distance) const {
    constexpr double kFarthestSame = 4;  // cells
    std::array<uint16_t, kPointsOfBlock> order;
    std::iota(order.begin(), order.end(), uint16_t{0});
    std::ranges::sort(order, [&](uint16_t i, uint16_t j) {
      return distance[i] != distance[j] ? distance[i] > distance[j] : i < j;
    });
    struct Known {
      FastWinding::Side side;
      uint16_t asked;  // the point that it is of
      bool is_known = false;
    };
    std::array<Known, kPointsOfBlock> known{};
    const auto at = [](size_t i) {
      const auto n = static_cast<int>(i);
      return Eigen::Vector3i(n % kPoints, n / kPoints % kPoints, n / kPoints / kPoints);
    };
    for (const uint16_t i : order) {
      const Eigen::Vector3i own = at(i);
      Known& found = known[i];
      for_each_around(own, [&](size_t other, double away) {
        const Known& next = known[other];
        if (found.is_known || !next.is_known) return;
        // The balls about both that hold no triangle meet.
        if (!(distance[i] + distance[other] > away + kRounded)) return;
        const double way = cell_ * (own - at(next.asked)).cast<double>().norm();
        if (way < next.side.reach_m) found = next;
      });
      if (found.is_known) continue;
      found = {enclosing_->side(point_of(b, own.x(), own.y(), own.z()), kFarthestSame * cell_), i,
               true};
    }
    for (size_t i = 0; i < kPointsOfBlock; ++i) {
      if (known[i].side.is_inside) distance[i] = -distance[i];
    }
  }

  void fill(const Cell& b, Block& block) const {
    BlockValues value;
    value.fill(std::numeric_limits<double>::infinity());
    if (enclosing_) {
      measure(b, value);
      sign(b, value);
    }
    for_each_point([&](int x, int y, int z) {
      double& v = value[place(x, y, z)];
      if (sheets_) {
        v = std::min(v, (sheets_->distance(point_of(b, x, y, z)) - thickness_m_ / 2) / cell_);
      }
      block.value[place(x, y, z)] = v == 0 ? 1e-6f : static_cast<float>(v);
    });
  }

  // Blocks near the triangles, and those into which the border of the inside goes on.
  void find_blocks() {
    const size_t count = static_cast<size_t>(blocks_[0]) * static_cast<size_t>(blocks_[1]) *
                         static_cast<size_t>(blocks_[2]);
    std::vector<uint8_t> wanted(count, 0);
    std::vector<Cell> front;
    const double reach = cell_ * (kBlock * std::sqrt(3.0) / 2 + 1);
    std::vector<uint8_t> near(count, 0);
    parallel_for(count, 64, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        const Cell b = block_at(i);
        const double half = kBlock / 2.0;
        const Vec3 centre =
            origin_ + cell_ * Vec3(b.x * kBlock + half, b.y * kBlock + half, b.z * kBlock + half);
        near[i] = distance(centre) < reach;
      }
    });
    for (size_t i = 0; i < count; ++i) {
      if (near[i]) front.push_back(block_at(i));
      wanted[i] = near[i];
    }
    blocks_of_.assign(count, UINT32_MAX);
    while (!front.empty()) {
      const size_t first = store_.size();
      store_.resize(first + front.size());
      parallel_for(front.size(), 1, [&](size_t begin, size_t end) {
        for (size_t i = begin; i < end; ++i) {
          fill(front[i], store_[first + i]);
        }
      });
      std::vector<Cell> next;
      for (size_t i = 0; i < front.size(); ++i) {
        const Cell& b = front[i];
        blocks_of_[index(b.x, b.y, b.z)] = static_cast<uint32_t>(first + i);
        for (int side = 0; side < 6; ++side) {
          if (!changes_on_side(store_[first + i], side)) continue;
          const int step = side % 2 == 0 ? -1 : 1;
          const Cell n = {b.x + (side / 2 == 0 ? step : 0), b.y + (side / 2 == 1 ? step : 0),
                          b.z + (side / 2 == 2 ? step : 0)};
          const bool is_there = n.x >= 0 && n.y >= 0 && n.z >= 0 && n.x < blocks_[0] &&
                                n.y < blocks_[1] && n.z < blocks_[2];
          if (!is_there || wanted[index(n.x, n.y, n.z)]) continue;
          wanted[index(n.x, n.y, n.z)] = 1;
          next.push_back(n);
        }
      }
      front = std::move(next);
    }
  }

  Cell block_at(size_t i) const {
    const auto nx = static_cast<size_t>(blocks_[0]), ny = static_cast<size_t>(blocks_[1]);
    return {static_cast<int>(i % nx), static_cast<int>(i / nx % ny), static_cast<int>(i / nx / ny)};
  }

  static bool changes_on_side(const Block& block, int side) {
    bool has_inside = false, has_outside = false;
    const int fixed = side % 2 == 0 ? 0 : kPoints - 1;
    for (int u = 0; u < kPoints; ++u) {
      for (int v = 0; v < kPoints; ++v) {
        const int x = side / 2 == 0 ? fixed : u;
        const int y = side / 2 == 1 ? fixed : side / 2 == 0 ? u : v;
        const int z = side / 2 == 2 ? fixed : v;
        (block.value[place(x, y, z)] < 0 ? has_inside : has_outside) = true;
      }
    }
    return has_inside && has_outside;
  }

  static size_t place(int x, int y, int z) {
    const int place = (z * kPoints + y) * kPoints + x;
    return static_cast<size_t>(place);
  }

  uint64_t grid_id(int x, int y, int z) const {
    const uint64_t nx = uint64_t{kBlock} * static_cast<uint64_t>(blocks_[0]) + 2;
    const uint64_t ny = uint64_t{kBlock} * static_cast<uint64_t>(blocks_[1]) + 2;
    return (static_cast<uint64_t>(z) * ny + static_cast<uint64_t>(y)) * nx +
           static_cast<uint64_t>(x);
  }

  void march() {
    const size_t count = blocks_of_.size();
    crossings_.reserve(store_.size() * size_t{kBlock} * kBlock * 4);  // of a flat through each
    for (size_t i = 0; i < count; ++i) {
      if (blocks_of_[i] == UINT32_MAX) continue;
      const Cell b = block_at(i);
      const Block& block = store_[blocks_of_[i]];
      for (int z = 0; z < kBlock; ++z) {
        for (int y = 0; y < kBlock; ++y) {
          for (int x = 0; x < kBlock; ++x) march_cell(b, block, x, y, z);
        }
      }
    }
  }

  void march_cell(const Cell& b, const Block& block, int x, int y, int z) {
    std::array<float, 8> value;
    int inside = 0;
    for (int k = 0; k < 8; ++k) {
      value[static_cast<size_t>(k)] =
          block.value[place(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2))];
      inside += value[static_cast<size_t>(k)] < 0;
    }
    if (inside == 0 || inside == 8) return;
    const Cell corner = {b.x * kBlock + x, b.y * kBlock + y, b.z * kBlock + z};
    for (const auto& tetrahedron : kTetrahedra) march_tetrahedron(corner, value, tetrahedron);
  }

  void march_tetrahedron(const Cell& corner, const std::array<float, 8>& value,
                         const std::array<int, 4>& t) {
    std::array<int, 4> in{}, out{};
    int ins = 0, outs = 0;
    for (const int k : t) {
      (value[static_cast<size_t>(k)] < 0 ? in[static_cast<size_t>(ins++)]
                                         : out[static_cast<size_t>(outs++)]) = k;
    }
    if (ins == 0 || outs == 0) return;
    const auto cut = [&](int a, int b) { return crossing(corner, value, a, b); };
    if (ins == 1) {
      add({cut(in[0], out[0]), cut(in[0], out[1]), cut(in[0], out[2])}, corner, in[0]);
    } else if (outs == 1) {
      add({cut(in[0], out[0]), cut(in[1], out[0]), cut(in[2], out[0])}, corner, in[0]);
    } else {
      const uint32_t p = cut(in[0], out[0]), q = cut(in[0], out[1]), r = cut(in[1], out[1]),
                     s = cut(in[1], out[0]);
      add({p, q, r}, corner, in[0]);
      add({p, r, s}, corner, in[0]);
    }
  }

  Vec3 corner_point(const Cell& corner, int k) const {
    return point(corner.x + (k & 1), corner.y + (k >> 1 & 1), corner.z + (k >> 2));
  }

  // With the grid point `inside` behind it.
  void add(Triangle t, const Cell& corner, int inside) {
    const Vec3& a = mesh_.vertices[t[0]];
    const Vec3 normal = (mesh_.vertices[t[1]] - a).cross(mesh_.vertices[t[2]] - a);
    if (normal.dot(corner_point(corner, inside) - a) > 0) std::swap(t[1], t[2]);
    mesh_.triangles.push_back(t);
  }

  uint32_t crossing(const Cell& corner, const std::array<float, 8>& value, int a, int b) {
    const auto id = [&](int k) {
      return grid_id(corner.x + (k & 1), corner.y + (k >> 1 & 1), corner.z + (k >> 2));
    };
    // The lower end first; the seven directions of edges tell which.
    if (id(a) > id(b)) std::swap(a, b);
    const int difference =
        (b & 1) - (a & 1) + 2 * ((b >> 1 & 1) - (a >> 1 & 1)) + 4 * ((b >> 2) - (a >> 2));
    const uint64_t key = id(a) * 8 + static_cast<uint64_t>(difference);
    const auto [found, is_new] =
        crossings_.try_emplace(key, static_cast<uint32_t>(mesh_.vertices.size()));
    if (!is_new) return found->second;
    const Vec3 from = corner_point(corner, a), to = corner_point(corner, b);
    const double at_a = value[static_cast<size_t>(a)], at_b = value[static_cast<size_t>(b)];
    const double length = (to - from).norm() / cell_;
    // Farther from the triangles than the edge is long: there are none between.
    if (std::abs(at_a) + std::abs(at_b) > 1.5 * length) {
      openings_.push_back({found->second, from, to});
      mesh_.vertices.emplace_back((from + to) / 2);
    } else {
      mesh_.vertices.push_back(between(from, to, at_a / (at_a - at_b)));
    }
    return found->second;
  }

  static Vec3 between(const Vec3& from, const Vec3& to, double share) {
    return from + std::clamp(share, kFromEnds, 1 - kFromEnds) * (to - from);
  }

  // Where the surface closes openings; which way triangles face does not depend on it.
  void place_openings() {
    parallel_for(openings_.size(), 64, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        const auto& [vertex, from, to] = openings_[i];
        mesh_.vertices[vertex] = between(from, to, sheets_ ? halved(from, to) : secant(from, to));
      }
    });
  }

  double halved(const Vec3& from, const Vec3& to) const {
    const bool starts_inside = is_inside(from);
    double low = 0, high = 1;
    for (int i = 0; i < kHalves; ++i) {
      const double middle = (low + high) / 2;
      (is_inside(from + middle * (to - from)) == starts_inside ? low : high) = middle;
    }
    return (low + high) / 2;
  }

  // The winding number is smooth there: twice where a straight line through its ends is one half.
  double secant(const Vec3& from, const Vec3& to) const {
    const auto excess = [&](double share) {
      return enclosing_->exact(from + share * (to - from)) - 0.5;
    };
    double low = 0, high = 1, at_low = excess(low), at_high = excess(high), share = 0.5;
    for (int i = 0; i < 2 && at_low != at_high; ++i) {
      share = low + (high - low) * at_low / (at_low - at_high);
      const double at_share = excess(share);
      const bool is_low = (at_share > 0) == (at_low > 0);
      (is_low ? low : high) = share;
      (is_low ? at_low : at_high) = at_share;
    }
    return low + (high - low) * (at_low != at_high ? at_low / (at_low - at_high) : 0.5);
  }

  std::optional<FastWinding> enclosing_;
  std::optional<TriangleTree> sheets_;
  double thickness_m_, cell_ = 0;
  Vec3 origin_;
  std::array<int, 3> blocks_{};
  std::vector<uint32_t> blocks_of_;  // places in store_, by block
  std::vector<Block> store_;
  std::unordered_map<uint64_t, uint32_t> crossings_;  // grid edge -> vertex
  struct Opening {
    uint32_t vertex;
    Vec3 from, to;  // the edge that it is on
  };
  std::vector<Opening> openings_;
  TriangleMesh mesh_;
};

// Places on a grid of its own, marked around lines.
class MarkedPlaces {
 public:
  MarkedPlaces(const Vec3& corner, double spacing) : corner_(corner), spacing_(spacing) {}

  // All that is nearer to the edges of the triangle than a spacing, and some more.
  void mark_edges(const Vec3& a, const Vec3& b, const Vec3& c) {
    for (const auto& [from, to] : {std::pair(a, b), std::pair(b, c), std::pair(c, a)}) {
      const auto steps = static_cast<int>(std::ceil((to - from).norm() / spacing_)) + 1;
      for (int i = 0; i <= steps; ++i) mark_around(from + i * (to - from) / steps);
    }
  }
  bool has(const Vec3& point) const { return marked_.contains(key(place(point))); }

 private:
  using Place = Eigen::Array<int64_t, 3, 1>;

  Place place(const Vec3& point) const {
    return ((point - corner_) / spacing_).array().floor().cast<int64_t>() + 1;
  }
  static uint64_t key(const Place& p) {
    return static_cast<uint64_t>(p[0] << 42 | p[1] << 21 | p[2]);  // each far below 2^21
  }
  void mark_around(const Vec3& point) {
    const Place middle = place(point);
    for (int64_t x = -1; x <= 1; ++x) {
      for (int64_t y = -1; y <= 1; ++y) {
        for (int64_t z = -1; z <= 1; ++z) marked_.insert(key(middle + Place(x, y, z)));
      }
    }
  }

  Vec3 corner_;
  double spacing_;
  std::unordered_set<uint64_t> marked_;
};

// With fewer triangles, at most so far away. Where that would make it touch itself it stays as it
// is, which is found out by trying.
TriangleMesh simplified(const TriangleMesh& mesh, double error_m, double cell_m) {
  constexpr int kMostTries = 12;
  MarkedPlaces places(mesh.bounds().min(), cell_m);
  std::vector<uint8_t> keeps(mesh.vertices.size(), 0);
  for (int tries = 0; tries < kMostTries; ++tries) {
    TriangleMesh result = decimated(mesh, error_m, keeps);
    const std::vector<uint32_t> touching = find_touching_triangles(result).triangles;
    if (touching.empty()) {
      if (!find_mesh_defects(result).empty()) break;
      return result;
    }
    for (const uint32_t i : touching) {
      const auto [a, b, c] = result.triangles[i];
      places.mark_edges(result.vertices[a], result.vertices[b], result.vertices[c]);
    }
    for (size_t v = 0; v < keeps.size(); ++v) keeps[v] = places.has(mesh.vertices[v]) ? 1 : 0;
  }
  return mesh;
}

void measure(const TriangleMesh& mesh, const Wrapper& wrapper, Wrap& wrap) {
  // Distances of the wrap, by its triangles' middles and corners.
  double area = 0, closing = 0;
  for (const auto& [ia, ib, ic] : wrap.mesh.triangles) {
    const Vec3 &a = wrap.mesh.vertices[ia], &b = wrap.mesh.vertices[ib],
               &c = wrap.mesh.vertices[ic];
    const double own = (b - a).cross(c - a).norm() / 2;
    const double distance = wrapper.distance((a + b + c) / 3);
    wrap.distance_m = std::max(wrap.distance_m, distance);
    area += own;
    if (distance > wrap.cell_m) closing += own;
  }
  wrap.closing_share = area > 0 ? closing / area : 0;
  // Distances of the mesh's triangles, by their middles, which the wrap must hold or pass through.
  const bool is_empty = wrap.mesh.triangles.empty();
  const TriangleTree own_tree(is_empty ? mesh : wrap.mesh);
  double total = 0, lost = 0;
  for (const auto& [ia, ib, ic] : mesh.triangles) {
    const Vec3 &a = mesh.vertices[ia], &b = mesh.vertices[ib], &c = mesh.vertices[ic];
    const double own = (b - a).cross(c - a).norm() / 2;
    const Vec3 middle = (a + b + c) / 3;
    total += own;
    if (!is_empty && own_tree.distance(middle) <= wrap.cell_m) continue;
    const Vec3 aside = wrap.cell_m * (b - a).cross(c - a).normalized();
    if (!wrapper.encloses(middle + aside) && !wrapper.encloses(middle - aside)) lost += own;
  }
  wrap.lost_share = total > 0 ? lost / total : 0;
}

}  // namespace

Wrap wrap_mesh(const TriangleMesh& mesh, const TriangleMesh& sheets, const WrapOptions& options) {
  Wrapper wrapper(mesh, sheets, options);
  Wrap wrap;
  wrap.cell_m = wrapper.cell();
  const TriangleMesh surface = wrapper.surface();
  if (!surface.triangles.empty())
    wrap.mesh = simplified(surface, kSimplified * wrap.cell_m, wrap.cell_m);
  if (!mesh.triangles.empty()) measure(mesh, wrapper, wrap);
  return wrap;
}

}  // namespace pilesim
