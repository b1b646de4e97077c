#include "simulate/sphere/surface_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "simulate/sphere/sphere_constants.h"

namespace pilesim {
namespace {

using namespace sphere_constants;

Bounds box_around(const Bounds& box, const Pose& pose) {
  Bounds result;
  for (int corner = 0; corner < 8; ++corner) {
    result.extend(pose.apply(box.corner(static_cast<Bounds::CornerType>(corner))));
  }
  return result;
}

// Where the segment crosses the triangle, as a share of its length; 1 if it does not.
double crossing(const Corners& corners, const Vec3& from, const Vec3& way) {
  const Vec3 a = corners[1] - corners[0], b = corners[2] - corners[0];
  const Vec3 p = way.cross(b);
  const double volume = a.dot(p);
  if (volume == 0) return 1;
  const Vec3 start = from - corners[0];
  const double u = start.dot(p) / volume;
  const Vec3 q = start.cross(a);
  const double v = way.dot(q) / volume;
  if (u < 0 || v < 0 || u + v > 1) return 1;
  const double share = b.dot(q) / volume;
  return share >= 0 ? std::min(share, 1.0) : 1;
}

}  // namespace

SurfaceGeometry::SurfaceGeometry(const Model& model) : model_(model), trees_(model.shapes.size()) {}

void SurfaceGeometry::place(uint32_t body, const Pose& pose, const Vec3& velocity,
                            const Vec3& turn_rate) {
  const ModelShape& shape = model_.shapes[model_.bodies[body].shape];
  std::unique_ptr<TriangleTree>& tree = trees_[model_.bodies[body].shape];
  if (!shape.is_plane && !tree) tree = std::make_unique<TriangleTree>(shape.mesh);
  Placed placed{{body, pose, velocity, turn_rate},
                shape.is_plane,
                pose.orientation * Vec3::UnitY(),
                {},
                tree.get()};
  if (tree) placed.box = box_around(tree->nodes().front().box, pose);
  const auto at = std::ranges::lower_bound(placed_, body, {}, &Placed::body);
  if (at != placed_.end() && at->body == body) {
    *at = placed;
  } else {
    placed_.insert(at, placed);
  }
}

void SurfaceGeometry::remove(uint32_t body) {
  std::erase_if(placed_, [&](const Placed& placed) { return placed.body == body; });
}

std::vector<SurfaceState> SurfaceGeometry::state() const {
  return {placed_.begin(), placed_.end()};
}

void SurfaceGeometry::set_state(const std::vector<SurfaceState>& state) {
  placed_.clear();
  for (const SurfaceState& surface : state) {
    place(surface.body, surface.pose, surface.velocity, surface.turn_rate);
  }
}

void SurfaceGeometry::select(const Eigen::AlignedBox3f& box, float reach,
                             std::vector<uint32_t>& surfaces) const {
  surfaces.clear();
  const Bounds all = box.cast<double>();
  for (uint32_t i = 0; i < placed_.size(); ++i) {
    const Placed& placed = placed_[i];
    if (placed.is_plane) {
      const Vec3& normal = placed.normal;
      const Vec3 nearest = (normal.array() > 0).select(all.min(), all.max());
      if (normal.dot(nearest - placed.pose.position) <= reach) surfaces.push_back(i);
    } else if (all.squaredExteriorDistance(placed.box) <= static_cast<double>(reach) * reach) {
      surfaces.push_back(i);
    }
  }
}

void SurfaceGeometry::find(std::span<const uint32_t> surfaces, const Vec3f& centre, float radius,
                           float reach, std::vector<SurfaceContact>& contacts) const {
  const Vec3 point = centre.cast<double>();
  for (const uint32_t surface : surfaces) {
    const Placed& placed = placed_[surface];
    if (!placed.is_plane) {
      find_on_mesh(placed, point, radius, reach, contacts);
      continue;
    }
    const Vec3& normal = placed.normal;
    const double gap = normal.dot(point - placed.pose.position) - radius;
    if (gap > reach) continue;
    const Vec3 arm = point - (gap + radius) * normal - placed.pose.position;
    const Vec3 velocity = placed.velocity + placed.turn_rate.cross(arm);
    contacts.push_back({placed.body, normal.cast<float>(), static_cast<float>(gap),
                        velocity.cast<float>(), normal.y() > kLevelGround && velocity.isZero(),
                        true});
  }
}

void SurfaceGeometry::find_on_mesh(const Placed& placed, const Vec3& centre, double radius,
                                   double reach, std::vector<SurfaceContact>& contacts) const {
  const double farthest = radius + reach;
  if (placed.box.squaredExteriorDistance(centre) > farthest * farthest) return;
  const Quat to_local = placed.pose.orientation.conjugate();
  const Vec3 local = to_local * (centre - placed.pose.position);
  const Vec3 around = Vec3::Constant(farthest);
  struct Near {
    Vec3 normal;
    double distance;
    bool face;
  };
  thread_local std::vector<Near> near;
  near.clear();
  placed.tree->for_each_near(Bounds(local - around, local + around), 0, [&](uint32_t i) {
    const Corners& corners = placed.tree->corners()[i];
    const Vec3 outward =
        (corners[1] - corners[0]).cross(corners[2] - corners[0]).stableNormalized();
    // From behind a triangle keeps nothing out: the front of the solid does.
    const double above = outward.dot(local - corners[0]);
    if (above > farthest || above < -kEdgeOn * farthest) return;
    const Vec3 apart = local - closest_point(corners, local);
    const double distance = apart.norm();
    if (distance > farthest || above < -kEdgeOn * distance) return;
    const Vec3 normal = distance > 0 ? Vec3(apart / distance) : outward;
    near.push_back({normal, distance, normal.dot(outward) > 0.999});
  });
  std::ranges::stable_sort(near, {}, &Near::distance);
  std::array<Vec3, kMostContacts> taken;
  size_t count = 0;
  for (const Near& n : near) {
    if (count == kMostContacts) break;
    if (std::any_of(taken.begin(), taken.begin() + count,
                    [&](const Vec3& t) { return t.dot(n.normal) > kSameSurface; })) {
      continue;
    }
    taken[count++] = n.normal;
    const Vec3 normal = placed.pose.orientation * n.normal;
    const Vec3 arm = centre - n.distance * normal - placed.pose.position;
    const Vec3 velocity = placed.velocity + placed.turn_rate.cross(arm);
    contacts.push_back({placed.body, normal.cast<float>(), static_cast<float>(n.distance - radius),
                        velocity.cast<float>(),
                        n.face && normal.y() > kLevelGround && velocity.isZero(), n.face});
  }
}

bool SurfaceGeometry::may_touch(uint32_t body, const Vec3f& centre, float radius) const {
  const auto at = std::ranges::lower_bound(placed_, body, {}, &Placed::body);
  if (at == placed_.end() || at->body != body) return false;
  if (at->is_plane) return true;
  return at->box.squaredExteriorDistance(centre.cast<double>()) <=
         static_cast<double>(radius) * radius;
}

double SurfaceGeometry::first_hit(const Vec3& from, const Vec3& to) const {
  double first = 1;
  for (const Placed& placed : placed_) {
    if (placed.is_plane) {
      const double a = placed.normal.dot(from - placed.pose.position);
      const double b = placed.normal.dot(to - placed.pose.position);
      if (a > 0 && b < 0) first = std::min(first, a / (a - b));
      continue;
    }
    const Quat to_local = placed.pose.orientation.conjugate();
    const Vec3 a = to_local * (from - placed.pose.position);
    const Vec3 b = to_local * (to - placed.pose.position);
    Bounds way(a);
    way.extend(b);
    placed.tree->for_each_near(way, 0, [&](uint32_t i) {
      first = std::min(first, crossing(placed.tree->corners()[i], a, b - a));
    });
  }
  return first;
}

}  // namespace pilesim
