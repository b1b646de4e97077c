#include "render/pile_overlay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "render/view.h"

namespace pilesim {
namespace {

using Point = Eigen::Vector2f;

constexpr int kSides = 96;
constexpr float kFill = 0.13f, kEdge = 0.75f;  // opacity
constexpr float kEdgeWidth = 1.3f;             // pixels
const std::array<Eigen::Vector3f, 2> kColours = {Eigen::Vector3f(56, 118, 190),
                                                 Eigen::Vector3f(232, 150, 52)};

float cross(const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); }

std::vector<Point> drawn(const std::vector<Eigen::Vector2d>& points) {
  std::vector<Point> result;
  for (const Eigen::Vector2d& point : points) result.push_back(point.cast<float>());
  return result;
}

// Andrew's monotone chain; turning left.
std::vector<Point> convex_hull_of(std::vector<Point> points) {
  std::ranges::sort(points, [](const Point& a, const Point& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Point> hull;
  for (int pass = 0; pass < 2; ++pass) {
    const size_t first = hull.size();
    for (const Point& point : points) {
      while (hull.size() > first + 1 &&
             cross(hull.back() - hull[hull.size() - 2], point - hull.back()) <= 0) {
        hull.pop_back();
      }
      hull.push_back(point);
    }
    hull.pop_back();
    std::ranges::reverse(points);
  }
  return hull;
}

struct Pixels {
  int first, last;  // none where last < first
};
Pixels clipped(float low, float high, int size) {
  return {static_cast<int>(std::max(0.0f, std::floor(low))),
          static_cast<int>(std::min(static_cast<float>(size - 1), std::ceil(high)))};
}

// Opacity falls to nothing over the last pixel before the edge.
void fill_convex(Image& image, const std::vector<Point>& hull, const Eigen::Vector3f& colour) {
  Eigen::AlignedBox2f box;
  for (const Point& point : hull) box.extend(point);
  const Pixels rows = clipped(box.min().y(), box.max().y(), image.height);
  const Pixels columns = clipped(box.min().x(), box.max().x(), image.width);
  for (int y = rows.first; y <= rows.last; ++y) {
    for (int x = columns.first; x <= columns.last; ++x) {
      const Point middle(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      float inside = std::numeric_limits<float>::infinity();
      for (size_t i = 0; i < hull.size() && inside > 0; ++i) {
        const Point along = (hull[(i + 1) % hull.size()] - hull[i]).normalized();
        inside = std::min(inside, cross(along, middle - hull[i]));
      }
      if (inside > 0) blend(image, x, y, colour, kFill * std::min(1.0f, inside));
    }
  }
}

void draw_line(Image& image, const Point& from, const Point& to, const Eigen::Vector3f& colour) {
  const Point way = to - from;
  const float length = way.norm();
  if (length <= 0) return;
  const Eigen::AlignedBox2f box(from.cwiseMin(to), from.cwiseMax(to));
  const Pixels rows = clipped(box.min().y() - 2, box.max().y() + 2, image.height);
  const Pixels columns = clipped(box.min().x() - 2, box.max().x() + 2, image.width);
  for (int y = rows.first; y <= rows.last; ++y) {
    for (int x = columns.first; x <= columns.last; ++x) {
      const Point middle(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      const float along = way.dot(middle - from) / length;
      if (along < 0 || along >= length) continue;  // the next line of the ring has the rest
      const float off = std::abs(cross(way, middle - from)) / length;
      const float cover = std::clamp(kEdgeWidth / 2 + 0.5f - off, 0.0f, 1.0f);
      if (cover > 0) blend(image, x, y, colour, kEdge * cover);
    }
  }
}

}  // namespace

PileOverlay::PileOverlay(const std::filesystem::path& file) : changes_(read_pile_layers(file)) {}

std::vector<Eigen::Vector2f> PileOverlay::outline(const LayeredPile& pile, float radius_m) {
  const std::vector<Point> core = drawn(pile.core), walls = drawn(pile.walls);
  std::vector<Point> points;
  for (int side = 0; side < kSides; ++side) {
    const double angle = 2 * kPi * side / kSides;
    const Point outward(static_cast<float>(std::cos(angle)), static_cast<float>(std::sin(angle)));
    const Point from = *std::ranges::max_element(
        core, {}, [&](const Point& corner) { return outward.dot(corner); });
    float share = 1;
    for (size_t i = 0; i < walls.size(); ++i) {
      const Point& corner = walls[i];
      const Point along = walls[(i + 1) % walls.size()] - corner;
      const float inside = cross(along, from - corner);
      const float after = inside + cross(along, radius_m * outward);
      if (after < 0) share = std::min(share, inside / (inside - after));
    }
    points.push_back(from + std::max(0.0f, share) * radius_m * outward);
  }
  return points;
}

void PileOverlay::draw(uint64_t index, const TrajectoryFrame&, const CameraKey& camera,
                       Image& image) const {
  const auto after = std::ranges::upper_bound(changes_, index, {}, &PileLayersChange::frame);
  if (after == changes_.begin()) return;
  const auto width = static_cast<float>(image.width);
  const auto height = static_cast<float>(image.height);
  const Vec3 origin = view_origin(camera);
  const View view = make_view(from_origin(camera, origin), width / height, 0.01f, 1000);
  for (const LayeredPile& at : std::prev(after)->piles) {
    const LayeredPile pile = moved(at, -origin);
    for (size_t i = 0; i < pile.layers.size(); ++i) {
      const PileLayer& layer = pile.layers[i];
      std::array<std::vector<Point>, 2> rings;
      bool before_camera = true;
      for (const Point& point : outline(pile, static_cast<float>(layer.radius_m))) {
        for (size_t end = 0; end < 2; ++end) {
          const auto y = static_cast<float>(end == 0 ? layer.bottom_m : layer.top_m);
          const Vec3f place(point.x(), y, point.y());
          before_camera &= view.depth_of(place) > 0.01f;
          rings[end].push_back(view.project(place, width, height));
        }
      }
      if (!before_camera) continue;
      std::vector<Point> both = rings[0];
      both.insert(both.end(), rings[1].begin(), rings[1].end());
      const Eigen::Vector3f& colour = kColours[i % kColours.size()];
      fill_convex(image, convex_hull_of(std::move(both)), colour);
      for (const std::vector<Point>& ring : rings) {
        for (size_t side = 0; side < ring.size(); ++side) {
          draw_line(image, ring[side], ring[(side + 1) % ring.size()], colour);
        }
      }
    }
  }
}

}  // namespace pilesim
