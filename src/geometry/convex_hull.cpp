#include "geometry/convex_hull.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <string>

#include "core/error.h"

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace pilesim {
namespace {

bool lexicographically_less(const Vec3& a, const Vec3& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
}

// In an order of their own, each once: the hull then depends on the set of points only.
std::vector<Vec3> sorted_distinct(std::span<const Vec3> points) {
  std::vector<Vec3> sorted(points.begin(), points.end());
  std::sort(sorted.begin(), sorted.end(), lexicographically_less);
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  return sorted;
}

Error degenerate_points(const std::string& found) {
  return {ErrorKind::input, Problem{.found = found,
                                    .expected = "points that span a volume",
                                    .remedy = "Give the shape some thickness in every direction"}};
}

template <typename Distance>
size_t farthest(std::span<const Vec3> points, const Distance& distance) {
  size_t best = 0;
  for (size_t i = 1; i < points.size(); ++i) {
    if (distance(points[i]) > distance(points[best])) best = i;
  }
  return best;
}

// Four points that span much of the volume of all: the first is far out, each following one the
// farthest from the point, line and plane of those before it.
struct Simplex {
  std::array<size_t, 4> corners;
  double thickness;  // m, the distance of the last corner from the plane of the others
};

Simplex wide_simplex(std::span<const Vec3> points) {
  const size_t a = farthest(points, [&](const Vec3& p) { return (p - points[0]).squaredNorm(); });
  const Vec3 origin = points[a];
  const size_t b = farthest(points, [&](const Vec3& p) { return (p - origin).squaredNorm(); });
  const Vec3 line = (points[b] - origin).normalized();
  const size_t c =
      farthest(points, [&](const Vec3& p) { return (p - origin).cross(line).squaredNorm(); });
  const Vec3 normal = line.cross(points[c] - origin).normalized();
  const auto height = [&](const Vec3& p) { return std::abs((p - origin).dot(normal)); };
  const size_t d = farthest(points, height);
  return {.corners = {a, b, c, d}, .thickness = height(points[d])};
}

void require_volume(std::span<const Vec3> points) {
  for (const Vec3& point : points) {
    if (!point.allFinite()) throw degenerate_points("a point is not finite");
  }
  if (points.size() < 4) {
    throw degenerate_points("there are " + std::to_string(points.size()) +
                            " distinct points, too few for a hull");
  }
  Bounds bounds;
  for (const Vec3& point : points) bounds.extend(point);
  if (!(wide_simplex(points).thickness > 1e-9 * bounds.diagonal().norm())) {
    throw degenerate_points("all points lie in one plane");
  }
}

// Qhull's state for one hull, with its messages caught instead of printed.
class QhullRun {
 public:
  explicit QhullRun(std::vector<coordT>& coordinates) {
    messages_ = open_memstream(&text_, &text_size_);
    if (messages_ == nullptr) throw io_error("", "cannot open a memory stream", errno);
    qh_zero(&qh_, messages_);
    char command[] = "qhull Pp";
    status_ = qh_new_qhull(&qh_, 3, static_cast<int>(coordinates.size() / 3), coordinates.data(),
                           False, command, nullptr, messages_);
    std::fflush(messages_);
  }
  ~QhullRun() {
    qh_freeqhull(&qh_, !qh_ALL);
    int long_memory = 0, long_blocks = 0;
    qh_memfreeshort(&qh_, &long_memory, &long_blocks);
    std::fclose(messages_);
    std::free(text_);
  }
  QhullRun(const QhullRun&) = delete;
  QhullRun& operator=(const QhullRun&) = delete;

  qhT* state() { return &qh_; }
  void require_success() const {
    if (status_ == 0) return;
    throw Error(ErrorKind::internal, Problem{.found = "qhull failed on a point set that spans a "
                                                      "volume: " +
                                                      std::string(text_, text_size_)});
  }

 private:
  qhT qh_;
  FILE* messages_ = nullptr;
  char* text_ = nullptr;
  size_t text_size_ = 0;
  int status_ = 0;
};

using Polygon = std::vector<uint32_t>;

// The vertices of a facet in order, counter-clockwise from outside. A facet that Qhull merged out
// of coplanar ones has more than three.
Polygon polygon_of(qhT* qh, facetT* facet) {
  const auto index = [qh](void* vertex) {
    return static_cast<uint32_t>(qh_pointid(qh, static_cast<vertexT*>(vertex)->point));
  };
  if (facet->simplicial) {
    void** v = &facet->vertices->e[0].p;
    if (facet->toporient) return {index(v[0]), index(v[2]), index(v[1])};
    return {index(v[0]), index(v[1]), index(v[2])};
  }
  std::map<uint32_t, uint32_t> next;
  ridgeT *ridge, **ridgep;
  FOREACHridge_(facet->ridges) {
    const uint32_t a = index(ridge->vertices->e[0].p), b = index(ridge->vertices->e[1].p);
    if (ridge->top == facet) {
      next[b] = a;
    } else {
      next[a] = b;
    }
  }
  Polygon polygon;
  for (uint32_t vertex = next.begin()->first; polygon.size() < next.size(); vertex = next[vertex]) {
    polygon.push_back(vertex);
  }
  return polygon;
}

// Cuts corners off a simple polygon until nothing is left. Facets that Qhull finds within rounding
// of one plane may share a bent border, so they need not be convex in that plane.
void triangulate(std::span<const Vec3> points, Polygon polygon, std::vector<Triangle>& triangles) {
  Vec3 normal = Vec3::Zero();
  const Vec3& origin = points[polygon[0]];
  for (size_t i = 2; i < polygon.size(); ++i) {
    normal += (points[polygon[i - 1]] - origin).cross(points[polygon[i]] - origin);
  }
  const auto turn = [&](uint32_t a, uint32_t b, uint32_t c) {
    return (points[b] - points[a]).cross(points[c] - points[b]).dot(normal);
  };
  while (polygon.size() > 3) {
    const size_t count = polygon.size();
    const auto corner = [&](size_t i) {
      return Triangle{polygon[(i + count - 1) % count], polygon[i], polygon[(i + 1) % count]};
    };
    const auto is_ear = [&](size_t i) {
      const Triangle at = corner(i);
      const uint32_t a = at[0], b = at[1], c = at[2];
      if (turn(a, b, c) <= 0) return false;
      return std::none_of(polygon.begin(), polygon.end(), [&](uint32_t p) {
        return p != a && p != b && p != c && turn(a, b, p) >= 0 && turn(b, c, p) >= 0 &&
               turn(c, a, p) >= 0;
      });
    };
    size_t ear = 0;
    while (ear < count && !is_ear(ear)) ++ear;
    if (ear == count) ear = 0;  // the rest has no area
    triangles.push_back(corner(ear));
    polygon.erase(polygon.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  triangles.push_back({polygon[0], polygon[1], polygon[2]});
}

std::vector<Polygon> hull_polygons(std::span<const Vec3> points) {
  // Centred and scaled by a power of two, so that Qhull's tolerances follow the extent of the
  // points, wherever they are, and coplanar points stay so.
  Bounds bounds;
  for (const Vec3& point : points) bounds.extend(point);
  const Vec3 centre = bounds.center();
  const double scale = std::exp2(-std::ilogb(bounds.diagonal().norm()));
  std::vector<coordT> coordinates;
  coordinates.reserve(3 * points.size());
  for (const Vec3& point : points) {
    for (const double x : ((point - centre) * scale).eval()) coordinates.push_back(x);
  }

  QhullRun run(coordinates);
  run.require_success();
  qhT* qh = run.state();
  std::vector<Polygon> polygons;
  facetT* facet;
  FORALLfacets { polygons.push_back(polygon_of(qh, facet)); }
  return polygons;
}

// The mesh of some of `points`, which are sorted, in an order that depends on nothing else.
TriangleMesh canonical_mesh(std::span<const Vec3> points, std::vector<Triangle> triangles) {
  std::vector<uint32_t> new_index(points.size(), 0);
  for (const Triangle& triangle : triangles) {
    for (const uint32_t vertex : triangle) new_index[vertex] = 1;
  }
  TriangleMesh mesh;
  for (size_t i = 0; i < points.size(); ++i) {
    if (new_index[i] == 0) continue;
    new_index[i] = static_cast<uint32_t>(mesh.vertices.size());
    mesh.vertices.push_back(points[i]);
  }
  for (Triangle& triangle : triangles) {
    for (uint32_t& vertex : triangle) vertex = new_index[vertex];
    std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()),
                triangle.end());
  }
  std::sort(triangles.begin(), triangles.end());
  mesh.triangles = std::move(triangles);
  return mesh;
}

}  // namespace

TriangleMesh convex_hull(std::span<const Vec3> points) {
  const std::vector<Vec3> sorted = sorted_distinct(points);
  require_volume(sorted);
  std::vector<Triangle> triangles;
  for (const Polygon& polygon : hull_polygons(sorted)) triangulate(sorted, polygon, triangles);
  return canonical_mesh(sorted, std::move(triangles));
}

namespace {

// Grows a hull from a simplex, each time by the point that adds the most volume.
class GreedyHull {
 public:
  explicit GreedyHull(std::span<const Vec3> points) : points_(points), gain_(points.size(), 0.0) {
    const auto [a, b, c, d] = wide_simplex(points).corners;
    std::array<uint32_t, 4> corner{static_cast<uint32_t>(a), static_cast<uint32_t>(b),
                                   static_cast<uint32_t>(c), static_cast<uint32_t>(d)};
    const double volume = volume_above({corner[0], corner[1], corner[2]}, corner[3]);
    if (volume > 0) std::swap(corner[0], corner[1]);
    volume_ = std::abs(volume);
    const auto& [p, q, r, s] = corner;
    for (const Triangle& facet : {Triangle{p, q, r}, {p, s, q}, {q, s, r}, {r, s, p}}) add(facet);
    chosen_.assign(corner.begin(), corner.end());
  }

  // False if no point lies noticeably outside.
  bool grow() {
    const size_t best =
        static_cast<size_t>(std::max_element(gain_.begin(), gain_.end()) - gain_.begin());
    if (gain_[best] <= 1e-12 * volume_) return false;
    const auto apex = static_cast<uint32_t>(best);
    const auto hidden =
        std::stable_partition(facets_.begin(), facets_.end(),
                              [&](const Triangle& f) { return volume_above(f, apex) <= 0; });
    const std::vector<Triangle> removed(hidden, facets_.end());
    facets_.erase(hidden, facets_.end());
    for (const Triangle& facet : removed) change_gains(facet, -1);
    for (const auto& [from, to] : border(removed)) add({from, to, apex});
    volume_ += gain_[best];
    gain_[best] = 0;
    chosen_.push_back(apex);
    return true;
  }

  std::vector<Vec3> chosen_points() const {
    std::vector<Vec3> chosen;
    for (const uint32_t index : chosen_) chosen.push_back(points_[index]);
    return chosen;
  }
  size_t size() const { return chosen_.size(); }

 private:
  using Edge = std::pair<uint32_t, uint32_t>;

  // Volume of the tetrahedron of a facet and a point, m^3; positive if the point is outside.
  double volume_above(const Triangle& facet, uint32_t point) const {
    const Vec3& a = points_[facet[0]];
    return (points_[facet[1]] - a).cross(points_[facet[2]] - a).dot(points_[point] - a) / 6.0;
  }

  void change_gains(const Triangle& facet, double sign) {
    const Vec3& a = points_[facet[0]];
    const Vec3 normal = (points_[facet[1]] - a).cross(points_[facet[2]] - a) / 6.0;
    for (size_t i = 0; i < points_.size(); ++i) {
      gain_[i] += sign * std::max(0.0, normal.dot(points_[i] - a));
    }
  }

  void add(const Triangle& facet) {
    facets_.push_back(facet);
    change_gains(facet, 1);
  }

  // Directed edges of `facets` whose opposites are not among them.
  static std::vector<Edge> border(const std::vector<Triangle>& facets) {
    std::vector<Edge> edges;
    for (const auto& [a, b, c] : facets) edges.insert(edges.end(), {{a, b}, {b, c}, {c, a}});
    std::sort(edges.begin(), edges.end());
    std::vector<Edge> open;
    std::copy_if(edges.begin(), edges.end(), std::back_inserter(open), [&](const Edge& edge) {
      return !std::binary_search(edges.begin(), edges.end(), Edge{edge.second, edge.first});
    });
    return open;
  }

  std::span<const Vec3> points_;
  std::vector<Triangle> facets_;
  std::vector<uint32_t> chosen_;
  std::vector<double> gain_;  // per point: volume it would add, m^3
  double volume_ = 0;         // m^3, of the hull so far
};

}  // namespace

TriangleMesh simplified_hull(std::span<const Vec3> points, int max_vertices) {
  assert(max_vertices >= 4);
  TriangleMesh full = convex_hull(points);
  const auto limit = static_cast<size_t>(max_vertices);
  if (full.vertices.size() <= limit) return full;
  GreedyHull hull(full.vertices);
  while (hull.size() < limit && hull.grow()) {
  }
  return convex_hull(hull.chosen_points());
}

}  // namespace pilesim
