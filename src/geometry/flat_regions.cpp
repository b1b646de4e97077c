#include "geometry/flat_regions.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <functional>
#include <map>
#include <numeric>
#include <span>
#include <utility>

namespace pilesim {
namespace {

using Loop = std::vector<uint32_t>;

constexpr double kNoArea = 1e-10;  // twice the area of three points that count as on a line
constexpr double kOnLine = 1e-9;   // distance of a point from a line that goes through it

// Twice the area of a triangle, > 0 if it is counter-clockwise.
double turn(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c) {
  const FlatPoint ab = b - a, ac = c - a;
  return ab.x() * ac.y() - ab.y() * ac.x();
}

double area_of(const Outline& outline) {
  double twice = 0;
  for (size_t i = 0; i < outline.size(); ++i) {
    twice += turn(outline[0], outline[i], outline[(i + 1) % outline.size()]);
  }
  return twice / 2;
}

// Without points that add no corner.
Outline cleaned(Outline outline) {
  for (size_t i = 0; outline.size() >= 3 && i < outline.size();) {
    const size_t count = outline.size();
    const FlatPoint& before = outline[(i + count - 1) % count];
    const FlatPoint& after = outline[(i + 1) % count];
    if (std::abs(turn(before, outline[i], after)) > kNoArea) {
      ++i;
    } else {
      outline.erase(outline.begin() + static_cast<std::ptrdiff_t>(i));
      i = i == 0 ? 0 : i - 1;
    }
  }
  if (outline.size() < 3) outline.clear();
  return outline;
}

bool is_inside(const Outline& outline, const FlatPoint& point) {
  bool inside = false;
  for (size_t i = 0; i < outline.size(); ++i) {
    const FlatPoint& a = outline[i];
    const FlatPoint& b = outline[(i + 1) % outline.size()];
    if ((a.y() > point.y()) == (b.y() > point.y())) continue;
    if ((turn(a, b, point) > 0) == (b.y() > a.y())) inside = !inside;
  }
  return inside;
}

bool is_on_segment(const FlatPoint& point, const FlatPoint& a, const FlatPoint& b) {
  const FlatPoint along = b - a;
  const double share = std::clamp((point - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (a + share * along - point).norm() <= kOnLine;
}

// Whether the segments have a point in common, other than ends that are the same point of both.
bool touch(const FlatPoint& a, const FlatPoint& b, const FlatPoint& c, const FlatPoint& d) {
  if (std::max(a.x(), b.x()) < std::min(c.x(), d.x()) - kOnLine ||
      std::max(c.x(), d.x()) < std::min(a.x(), b.x()) - kOnLine) {
    return false;
  }
  const auto is_left = [](const FlatPoint& p, const FlatPoint& q, const FlatPoint& r) {
    return turn(p, q, r) > 0;
  };
  const bool crosses = is_left(a, b, c) != is_left(a, b, d) && is_left(c, d, a) != is_left(c, d, b);
  const bool share_end = a == c || a == d || b == c || b == d;
  if (share_end) {
    return (a != c && a != d && is_on_segment(a, c, d)) ||
           (b != c && b != d && is_on_segment(b, c, d)) ||
           (c != a && c != b && is_on_segment(c, a, b)) ||
           (d != a && d != b && is_on_segment(d, a, b));
  }
  return crosses || is_on_segment(a, c, d) || is_on_segment(b, c, d) || is_on_segment(c, a, b) ||
         is_on_segment(d, a, b);
}

// Whether a segment from `from` to the corner `at` of a polygon arrives from its inside.
bool is_in_corner(const FlatPoint& before, const FlatPoint& at, const FlatPoint& after,
                  const FlatPoint& from) {
  const bool left_of_first = turn(before, at, from) > 0, left_of_second = turn(at, after, from) > 0;
  return turn(before, at, after) > 0 ? left_of_first && left_of_second
                                     : left_of_first || left_of_second;
}

class Filler {
 public:
  explicit Filler(FlatRegion& region) : region_(region) {}

  // `outlines`: an outer one, then its holes. Returns whether it could be filled.
  bool fill(const std::vector<Outline>& outlines) {
    for (const Outline& outline : outlines) {
      Loop& loop = region_.outlines.emplace_back(outline.size());
      std::iota(loop.begin(), loop.end(), static_cast<uint32_t>(region_.points.size()));
      region_.points.insert(region_.points.end(), outline.begin(), outline.end());
    }
    Loop loop = region_.outlines[0];
    std::vector<Loop> holes(region_.outlines.begin() + 1, region_.outlines.end());
    // The rightmost first: no other hole lies between it and the loop on its right.
    for (Loop& hole : holes) {
      const auto rightmost = std::ranges::max_element(
          hole, {}, [&](uint32_t i) { return std::pair(at(i).x(), at(i).y()); });
      std::rotate(hole.begin(), rightmost, hole.end());
    }
    std::ranges::stable_sort(
        holes, [&](const Loop& a, const Loop& b) { return at(a[0]).x() > at(b[0]).x(); });
    for (size_t k = 0; k < holes.size(); ++k) {
      if (!bridge(loop, std::span(holes).subspan(k))) return false;
    }
    return clip(std::move(loop));
  }

 private:
  const FlatPoint& at(uint32_t index) const { return region_.points[index]; }

  bool is_clear(uint32_t a, uint32_t b, const Loop& loop) const {
    for (size_t i = 0; i < loop.size(); ++i) {
      if (touch(at(a), at(b), at(loop[i]), at(loop[(i + 1) % loop.size()]))) return false;
    }
    return true;
  }

  // Joins the first of `holes` to the loop, there and back along one segment.
  bool bridge(Loop& loop, std::span<const Loop> holes) const {
    const Loop& hole = holes[0];
    const uint32_t end = hole[0];
    std::vector<size_t> corners(loop.size());
    std::iota(corners.begin(), corners.end(), size_t{0});
    std::ranges::stable_sort(corners, {},
                             [&](size_t i) { return (at(loop[i]) - at(end)).squaredNorm(); });
    for (const size_t i : corners) {
      const uint32_t before = loop[(i + loop.size() - 1) % loop.size()];
      const uint32_t after = loop[(i + 1) % loop.size()];
      if (!is_in_corner(at(before), at(loop[i]), at(after), at(end))) continue;
      const bool clear =
          is_clear(end, loop[i], loop) && std::ranges::all_of(holes, [&](const Loop& other) {
            return is_clear(end, loop[i], other);
          });
      if (!clear) continue;
      Loop inserted = hole;
      inserted.push_back(end);
      inserted.push_back(loop[i]);
      loop.insert(loop.begin() + static_cast<std::ptrdiff_t>(i) + 1, inserted.begin(),
                  inserted.end());
      return true;
    }
    return false;
  }

  bool is_ear(const Loop& loop, size_t tip) const {
    const size_t count = loop.size();
    const FlatPoint& a = at(loop[(tip + count - 1) % count]);
    const FlatPoint& b = at(loop[tip]);
    const FlatPoint& c = at(loop[(tip + 1) % count]);
    if (turn(a, b, c) <= kNoArea) return false;
    for (size_t i = 0; i < count; ++i) {
      const FlatPoint& p = at(loop[i]);
      const bool is_corner = p == a || p == b || p == c;
      if (!is_corner && turn(a, b, p) >= -kNoArea && turn(b, c, p) >= -kNoArea &&
          turn(c, a, p) >= -kNoArea) {
        return false;
      }
      // Where bridges pass its corners, an edge that goes on from there may cut it.
      const FlatPoint& q = at(loop[(i + 1) % count]);
      const bool is_side = (p == a || p == c) && (q == a || q == c);
      if (!is_side && touch(a, c, p, q)) return false;
    }
    return true;
  }

  // Ears one after another, going on where the last one was.
  bool clip(Loop loop) {
    size_t tip = 0, failures = 0;
    while (loop.size() > 3) {
      tip %= loop.size();
      if (is_ear(loop, tip)) {
        const size_t count = loop.size();
        region_.triangles.push_back(
            {loop[(tip + count - 1) % count], loop[tip], loop[(tip + 1) % count]});
        loop.erase(loop.begin() + static_cast<std::ptrdiff_t>(tip));
        failures = 0;
      } else if (++failures > loop.size()) {
        return false;
      }
      ++tip;
    }
    region_.triangles.push_back({loop[0], loop[1], loop[2]});
    return turn(at(loop[0]), at(loop[1]), at(loop[2])) > kNoArea;
  }

  FlatRegion& region_;
};

bool any_touch(const std::vector<Outline>& outlines) {
  for (size_t i = 0; i < outlines.size(); ++i) {
    for (size_t j = i; j < outlines.size(); ++j) {
      const size_t m = outlines[i].size(), n = outlines[j].size();
      for (size_t k = 0; k < m; ++k) {
        for (size_t l = i == j ? k + 1 : 0; l < n; ++l) {
          const FlatPoint &a = outlines[i][k], &b = outlines[i][(k + 1) % m];
          const FlatPoint &c = outlines[j][l], &d = outlines[j][(l + 1) % n];
          const bool are_neighbours = i == j && (l == k + 1 || (l + 1) % n == k);
          const bool share_end = a == c || a == d || b == c || b == d;
          if ((share_end && !are_neighbours) || touch(a, b, c, d)) return true;
        }
      }
    }
  }
  return false;
}

}  // namespace

double FlatRegion::area() const {
  double twice = 0;
  for (const auto& [a, b, c] : triangles) twice += turn(points[a], points[b], points[c]);
  return twice / 2;
}

std::optional<std::vector<FlatRegion>> fill_outlines(const std::vector<Outline>& given) {
  std::vector<Outline> outlines;
  for (const Outline& outline : given) {
    outlines.push_back(cleaned(outline));
    if (outlines.back().empty()) outlines.pop_back();
  }
  if (outlines.empty()) return std::vector<FlatRegion>();
  // The largest first: it is an outer one, and the last that contains a hole is the nearest.
  std::ranges::stable_sort(outlines, std::greater(),
                           [](const Outline& outline) { return std::abs(area_of(outline)); });
  const bool outer_is_left = area_of(outlines[0]) > 0;
  std::vector<std::vector<Outline>> shapes;  // an outer outline and its holes
  for (Outline& outline : outlines) {
    const bool is_left = area_of(outline) > 0;
    if (!outer_is_left) std::ranges::reverse(outline);
    if (is_left == outer_is_left) {
      shapes.push_back({std::move(outline)});
      continue;
    }
    const auto around = std::find_if(shapes.rbegin(), shapes.rend(), [&](const auto& shape) {
      return is_inside(shape[0], outline[0]);
    });
    if (around == shapes.rend()) return std::nullopt;
    around->push_back(std::move(outline));
  }
  std::vector<FlatRegion> regions;
  for (const std::vector<Outline>& shape : shapes) {
    if (any_touch(shape) || !Filler(regions.emplace_back()).fill(shape)) return std::nullopt;
  }
  return regions;
}

std::vector<std::vector<uint32_t>> convex_polygons(const FlatRegion& region) {
  const auto at = [&](uint32_t i) -> const FlatPoint& { return region.points[i]; };
  std::vector<Loop> polygons;
  std::map<std::pair<uint32_t, uint32_t>, size_t> owners;  // polygon left of each edge
  std::vector<std::pair<uint32_t, uint32_t>> diagonals;    // a < b, that two triangles share
  for (const Triangle& triangle : region.triangles) {
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t a = triangle[k], b = triangle[(k + 1) % 3];
      owners[{a, b}] = polygons.size();
      if (owners.contains({b, a})) diagonals.push_back(std::minmax(a, b));
    }
    polygons.emplace_back(triangle.begin(), triangle.end());
  }
  // The longest first, for parts that are compact.
  std::ranges::stable_sort(diagonals, [&](const auto& a, const auto& b) {
    return (at(a.first) - at(a.second)).squaredNorm() > (at(b.first) - at(b.second)).squaredNorm();
  });
  for (const auto& [a, b] : diagonals) {
    const size_t left = owners.at({a, b}), right = owners.at({b, a});
    if (left == right) continue;
    // From b around the left one to a, then around the right one.
    Loop joint = polygons[left], rest = polygons[right];
    std::rotate(joint.begin(), std::ranges::find(joint, b), joint.end());
    std::rotate(rest.begin(), std::ranges::find(rest, a), rest.end());
    const size_t corner_a = joint.size() - 1;
    joint.insert(joint.end(), rest.begin() + 1, rest.end() - 1);
    const auto is_convex = [&](size_t i) {
      const uint32_t before = joint[(i + joint.size() - 1) % joint.size()];
      const uint32_t after = joint[(i + 1) % joint.size()];
      return before != after && turn(at(before), at(joint[i]), at(after)) > -kNoArea;
    };
    if (!is_convex(0) || !is_convex(corner_a)) continue;
    owners.erase({a, b});
    owners.erase({b, a});
    for (size_t i = 0; i < rest.size(); ++i) {
      const std::pair edge(rest[i], rest[(i + 1) % rest.size()]);
      if (const auto found = owners.find(edge); found != owners.end()) found->second = left;
    }
    polygons[left] = std::move(joint);
    polygons[right].clear();
  }
  std::erase_if(polygons, [](const Loop& polygon) { return polygon.empty(); });
  return polygons;
}

TriangleMesh extruded(const FlatRegion& region, double depth) {
  assert(depth > 0);
  const auto count = static_cast<uint32_t>(region.points.size());
  TriangleMesh mesh;
  for (const double z : {depth / 2, -depth / 2}) {
    for (const FlatPoint& point : region.points)
      mesh.vertices.emplace_back(point.x(), point.y(), z);
  }
  for (const auto& [a, b, c] : region.triangles) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({c + count, b + count, a + count});
  }
  for (const std::vector<uint32_t>& outline : region.outlines) {
    for (size_t i = 0; i < outline.size(); ++i) {
      const uint32_t a = outline[i], b = outline[(i + 1) % outline.size()];
      mesh.triangles.push_back({a + count, b + count, b});
      mesh.triangles.push_back({a + count, b, a});
    }
  }
  return mesh;
}

}  // namespace pilesim
