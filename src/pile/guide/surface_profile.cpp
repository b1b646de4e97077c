#include "pile/guide/surface_profile.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace pilesim {
namespace {

constexpr double kMostColumns = 200;   // across the guide
constexpr int kSamples = 4;            // per column, along each side
constexpr double kLeastHeight = 1e-9;  // of the guide's extent; lower heights count as none

// Height maps of both surfaces, in columns.
class HeightMap {
 public:
  HeightMap(const Bounds& guide, double width_m) : base_(guide.min().y()) {
    const Vec3 size = guide.sizes();
    width_ = std::max(width_m, std::max(size.x(), size.z()) / kMostColumns);
    origin_ = guide.min() - size / 2;
    columns_x_ = static_cast<int>(std::ceil(2 * size.x() / width_)) + 1;
    columns_z_ = static_cast<int>(std::ceil(2 * size.z() / width_)) + 1;
    height_.assign(static_cast<size_t>(columns_x_) * static_cast<size_t>(columns_z_), 0.0);
  }

  double width() const { return width_; }
  const std::vector<double>& heights() const { return height_; }
  Vec3 middle(size_t column) const {
    const auto z = static_cast<int>(column) % columns_z_, x = static_cast<int>(column) / columns_z_;
    return origin_ + width_ * Vec3(x + 0.5, 0, z + 0.5);
  }

  void raise(const TriangleMesh& mesh, const Pose& pose) {
    for (const Triangle& triangle : mesh.triangles) {
      raise(pose.apply(mesh.vertices[triangle[0]]), pose.apply(mesh.vertices[triangle[1]]),
            pose.apply(mesh.vertices[triangle[2]]));
    }
  }

 private:
  // Raises samples (at the centres of their cells) inside the triangle's projection.
  void raise(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 normal = (b - a).cross(c - a);
    if (normal.y() == 0) return;
    const double cell = width_ / kSamples;
    const auto range = [&](int axis, int columns) {
      const auto [low, high] = std::minmax({a(axis), b(axis), c(axis)});
      const double most = columns * kSamples - 1;
      return std::pair(static_cast<int>(std::clamp(std::ceil((low - origin_(axis)) / cell - 0.5),
                                                   0.0, most + 1)),
                       static_cast<int>(std::clamp(std::floor((high - origin_(axis)) / cell - 0.5),
                                                   -1.0, most)));
    };
    const auto [x_begin, x_end] = range(0, columns_x_);
    const auto [z_begin, z_end] = range(2, columns_z_);
    for (int x = x_begin; x <= x_end; ++x) {
      for (int z = z_begin; z <= z_end; ++z) {
        const Vec3 at = origin_ + cell * Vec3(x + 0.5, 0, z + 0.5);
        if (!is_over(a, b, c, at, normal.y())) continue;
        const double y =
            a.y() - (normal.x() * (at.x() - a.x()) + normal.z() * (at.z() - a.z())) / normal.y();
        const int column = x / kSamples * columns_z_ + z / kSamples;
        double& height = height_[static_cast<size_t>(column)];
        height = std::max(height, y - base_);
      }
    }
  }

  // True if `at` lies in the projection of the triangle; `area` is twice its signed area.
  static bool is_over(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& at, double area) {
    const auto side = [&](const Vec3& from, const Vec3& to) {
      return (to.z() - from.z()) * (at.x() - from.x()) - (to.x() - from.x()) * (at.z() - from.z());
    };
    const double sign = area > 0 ? 1 : -1;
    return sign * side(a, b) >= 0 && sign * side(b, c) >= 0 && sign * side(c, a) >= 0;
  }

  double base_, width_ = 0;
  Vec3 origin_;
  int columns_x_ = 0, columns_z_ = 0;
  std::vector<double> height_;  // (columns_x_, columns_z_), m above the base; 0: empty
};

// The angle of the line through (radius, height), by least squares; falling is positive.
double slope_deg(const std::vector<double>& radius, const std::vector<double>& height) {
  const auto n = static_cast<double>(radius.size());
  double r = 0, h = 0, rr = 0, rh = 0;
  for (size_t i = 0; i < radius.size(); ++i) {
    r += radius[i] / n;
    h += height[i] / n;
  }
  for (size_t i = 0; i < radius.size(); ++i) {
    rr += (radius[i] - r) * (radius[i] - r);
    rh += (radius[i] - r) * (height[i] - h);
  }
  return rr > 0 ? degrees(std::atan2(-rh, rr)) : 0;
}

}  // namespace

SurfaceProfile measure_surface(const Model& model, const BodyStates& states, double width_m) {
  SurfaceProfile profile;
  if (model.guide.triangles.empty()) return profile;
  const Bounds bounds = model.guide.bounds();
  HeightMap guide(bounds, width_m), pile(bounds, width_m);
  guide.raise(model.guide, Pose());
  bool any = false;
  for (size_t body = 0; body < states.size(); ++body) {
    if (model.bodies[body].role != Role::dynamic || (states.flags[body] & kPresent) == 0) continue;
    pile.raise(model.shapes[model.bodies[body].shape].mesh,
               {states.position[body], states.orientation[body]});
    any = true;
  }
  if (!any) return profile;
  profile.column_m = guide.width();

  const double least = kLeastHeight * bounds.sizes().maxCoeff();
  double apart = 0, volume = 0;
  std::vector<size_t> plan;
  Vec3 middle = Vec3::Zero();
  for (size_t column = 0; column < guide.heights().size(); ++column) {
    apart += std::abs(guide.heights()[column] - pile.heights()[column]);
    volume += guide.heights()[column];
    if (guide.heights()[column] <= least) continue;
    plan.push_back(column);
    middle += guide.middle(column);
  }
  if (plan.empty()) return profile;
  middle /= static_cast<double>(plan.size());
  profile.difference = apart / volume;

  std::vector<double> radius, of_pile, of_guide;
  for (const size_t column : plan) {
    const Vec3 off = guide.middle(column) - middle;
    radius.push_back(std::hypot(off.x(), off.z()));
    of_pile.push_back(pile.heights()[column]);
    of_guide.push_back(guide.heights()[column]);
  }
  profile.slope_deg = slope_deg(radius, of_pile);
  profile.guide_slope_deg = slope_deg(radius, of_guide);

  const double ring_m = std::max(*std::ranges::max_element(radius), least) / kSurfaceRings;
  std::array<double, kSurfaceRings> count{};
  profile.rings.resize(kSurfaceRings);
  for (size_t i = 0; i < radius.size(); ++i) {
    const auto ring = std::min<size_t>(kSurfaceRings - 1, static_cast<size_t>(radius[i] / ring_m));
    count[ring] += 1;
    profile.rings[ring].height_m += of_pile[i];
    profile.rings[ring].guide_height_m += of_guide[i];
  }
  for (size_t ring = 0; ring < profile.rings.size(); ++ring) {
    SurfaceRing& of = profile.rings[ring];
    of.radius_m = (static_cast<double>(ring) + 0.5) * ring_m;
    of.height_m /= std::max(1.0, count[ring]);
    of.guide_height_m /= std::max(1.0, count[ring]);
  }
  return profile;
}

}  // namespace pilesim
