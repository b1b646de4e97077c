#include "simulate/sphere/surface_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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

// Intersection of the segment with the triangle, as a share of its length; 1 if there is none.
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

// Largest extent against `outward` of points below `height` whose projections are within the
// triangle; 0 if there are none. Points and triangle share an origin in the surface's frame.
float reach_below(const Corners& corners, const Vec3& outward, float height,
                  const ConvexExtent::Points& points) {
  using Row = Eigen::Array<float, 1, Eigen::Dynamic>;
  const auto along = [&](const Vec3& way) {
    const Vec3f w = way.cast<float>();
    return w.x() * points.row(0) + w.y() * points.row(1) + w.z() * points.row(2);
  };
  thread_local Row above, inside;
  above = along(outward);
  if (above.minCoeff() >= height) return 0;
  inside = Row::Ones(points.cols());
  for (size_t k = 0; k < 3; ++k) {
    const Vec3 inwards = outward.cross(corners[(k + 1) % 3] - corners[k]);
    const auto edge = static_cast<float>(inwards.dot(corners[k]));
    inside = (along(inwards) >= edge).select(inside, 0.0F);
  }
  const float lowest = (inside > 0.0F).select(above, height).minCoeff();
  return lowest < height ? -lowest : 0;
}

}  // namespace

SurfaceGeometry::SurfaceGeometry(const Model& model)
    : model_(model), meshes_(model.shapes.size()) {}

SurfaceGeometry::MeshSurface::MeshSurface(const TriangleMesh& mesh) : tree(mesh) {
  for (const Corners& corners : tree.corners()) {
    outward.push_back((corners[1] - corners[0]).cross(corners[2] - corners[0]).stableNormalized());
  }
}

void SurfaceGeometry::place(uint32_t body, const Pose& pose, const Vec3& velocity,
                            const Vec3& turn_rate) {
  const ModelShape& shape = model_.shapes[model_.bodies[body].shape];
  std::unique_ptr<LazyMesh>& mesh = meshes_[model_.bodies[body].shape];
  if (!shape.is_plane && !mesh) mesh = std::make_unique<LazyMesh>(shape.mesh);
  Placed placed{{body, pose, velocity, turn_rate},
                shape.is_plane,
                pose.orientation * Vec3::UnitY(),
                {},
                mesh.get(),
                {}};
  if (model_.bodies[body].surface_velocity) {
    placed.running = world_surface_velocity(model_, body, pose.orientation);
  }
  if (mesh) placed.box = box_around(mesh->box, pose);
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

// m/s, of the surface at `arm` from its body's centre.
Vec3 SurfaceGeometry::velocity_at(const Placed& placed, const Vec3& normal, const Vec3& arm) {
  Vec3 velocity = placed.velocity + placed.turn_rate.cross(arm);
  if (placed.running) {
    const Vec3 runs = placed.running->linear + placed.running->angular.cross(arm);
    velocity += runs - normal.dot(runs) * normal;
  }
  return velocity;
}

SurfaceContact SurfaceGeometry::contact_of(const Placed& placed, const Vec3& normal, double gap,
                                           bool is_face, const SurfaceProbe& probe) {
  const Vec3 arm = probe.centre.cast<double>() - gap * normal - placed.pose.position;
  const Vec3 velocity = velocity_at(placed, normal, arm);
  SurfaceContact contact{placed.body,
                         normal.cast<float>(),
                         static_cast<float>(gap),
                         velocity.cast<float>(),
                         is_face && normal.y() > kLevelGround && velocity.isZero(),
                         is_face,
                         probe.radius_m};
  if (probe.hull != nullptr) {
    const Vec3f down = probe.orientation.conjugate() * -contact.normal;
    contact.reach_m = is_face ? probe.hull->support_m(down) : probe.hull->surface_m(down);
  }
  return contact;
}

void SurfaceGeometry::find(uint32_t surface, const SurfaceProbe& probe,
                           std::vector<SurfaceContact>& contacts) const {
  const Placed& placed = placed_[surface];
  if (!placed.is_plane) return find_on_mesh(placed, probe, contacts);
  const double gap = placed.normal.dot(probe.centre.cast<double>() - placed.pose.position);
  if (gap <= probe.farthest_m)
    contacts.push_back(contact_of(placed, placed.normal, gap, true, probe));
}

// A body in contact with a mesh, and its possible contacts. Surface's frame, except for contacts.
class SurfaceGeometry::MeshSearch {
 public:
  // A triangle that the centre is not above.
  struct Beside {
    uint32_t triangle;
    Vec3 way;  // from its nearest point to the centre, unit
    double above, distance;
  };
  // Reused by consecutive searches.
  struct Scratch {
    std::vector<SurfaceContact> near;  // contacts found; faces come first
    std::vector<Beside> beside;
    ConvexExtent::Points corners;  // of the hull, relative to the centre
  };

  MeshSearch(const Placed& placed, const SurfaceProbe& probe, Scratch& scratch)
      : placed_(placed),
        probe_(probe),
        to_local_(placed.pose.orientation.conjugate()),
        centre_(to_local_ * (probe.centre.cast<double>() - placed.pose.position)),
        near_(scratch.near),
        beside_(scratch.beside),
        corners_(scratch.corners) {
    near_.clear();
    beside_.clear();
  }

  void run();

 private:
  void look_at(uint32_t triangle);
  void add(const SurfaceContact& contact) {
    if (contact.gap - contact.reach_m <= probe_.near_m) near_.push_back(contact);
  }
  SurfaceContact contact(const Vec3& way, double gap, bool is_face) const {
    return contact_of(placed_, placed_.pose.orientation * way, gap, is_face, probe_);
  }
  bool is_tested_by_face(const Beside& triangle) const;
  void test_corners(const Beside& triangle);

  const Placed& placed_;
  const SurfaceProbe& probe_;
  Quat to_local_;
  Vec3 centre_;
  std::vector<SurfaceContact>& near_;
  size_t faces_ = 0;
  std::vector<Beside>& beside_;
  ConvexExtent::Points& corners_;
  bool has_corners_ = false;  // rotated on demand
};

void SurfaceGeometry::MeshSearch::run() {
  const Vec3 around = Vec3::Constant(probe_.farthest_m);
  (*placed_.mesh)
      ->tree.for_each_near(Bounds(centre_ - around, centre_ + around), 0,
                           [&](uint32_t triangle) { look_at(triangle); });
  faces_ = near_.size();
  for (const Beside& triangle : beside_) {
    add(contact(triangle.way, triangle.distance, false));
    if (probe_.hull != nullptr && !is_tested_by_face(triangle)) test_corners(triangle);
  }
}

void SurfaceGeometry::MeshSearch::look_at(uint32_t triangle) {
  const double farthest = probe_.farthest_m;
  const Corners& corners = (*placed_.mesh)->tree.corners()[triangle];
  const Vec3& outward = (*placed_.mesh)->outward[triangle];
  // From behind, a triangle blocks nothing: the front of the solid does.
  const double above = outward.dot(centre_ - corners[0]);
  if (above > farthest || above < -kEdgeOn * farthest) return;
  const Vec3 apart = centre_ - closest_point(corners, centre_);
  const double distance = apart.norm();
  if (distance > farthest || above < -kEdgeOn * distance) return;
  const Vec3 way = distance > 0 ? Vec3(apart / distance) : outward;
  if (way.dot(outward) > 0.999) {
    add(contact(way, distance, true));
  } else {
    beside_.push_back({triangle, way, above, distance});
  }
}

// Where the face under the centre continues, all corners have been tested already.
bool SurfaceGeometry::MeshSearch::is_tested_by_face(const Beside& triangle) const {
  const Vec3 normal = placed_.pose.orientation * (*placed_.mesh)->outward[triangle.triangle];
  return std::any_of(near_.begin(), near_.begin() + static_cast<ptrdiff_t>(faces_),
                     [&](const SurfaceContact& face) {
                       return face.normal.cast<double>().dot(normal) > kOnePlane &&
                              std::abs(face.gap - triangle.above) <
                                  (1 - kOnePlane) * probe_.farthest_m;
                     });
}

// The hull's corners may be over triangles next to the one below the centre.
void SurfaceGeometry::MeshSearch::test_corners(const Beside& triangle) {
  if (!has_corners_) {
    const Quatf turn = to_local_.cast<float>() * probe_.orientation;
    corners_.resize(3, probe_.hull->corners.cols());
    corners_.matrix().noalias() = turn.toRotationMatrix() * probe_.hull->corners.matrix();
    has_corners_ = true;
  }
  const Vec3& outward = (*placed_.mesh)->outward[triangle.triangle];
  Corners from_centre = (*placed_.mesh)->tree.corners()[triangle.triangle];
  for (Vec3& corner : from_centre) corner -= centre_;
  const auto height = static_cast<float>(probe_.near_m - triangle.above);
  const float reach_m = reach_below(from_centre, outward, height, corners_);
  if (reach_m <= 0) return;
  SurfaceContact met = contact(outward, triangle.above, true);
  met.reach_m = reach_m;
  add(met);
}

void SurfaceGeometry::find_on_mesh(const Placed& placed, const SurfaceProbe& probe,
                                   std::vector<SurfaceContact>& contacts) {
  const double farthest = probe.farthest_m;
  if (placed.box.squaredExteriorDistance(probe.centre.cast<double>()) > farthest * farthest) return;
  thread_local MeshSearch::Scratch scratch;
  MeshSearch(placed, probe, scratch).run();
  std::vector<SurfaceContact>& near = scratch.near;
  // Next to a face that continues, its edge is equally deep: rounding must not choose the edge.
  const auto order = [](const SurfaceContact& contact) {
    return contact.gap - contact.reach_m * (contact.face ? 1.0001F : 1.0F);
  };
  std::ranges::stable_sort(near, {}, order);
  const auto first = static_cast<ptrdiff_t>(contacts.size());
  for (const SurfaceContact& n : near) {
    const std::span<const SurfaceContact> taken(contacts.begin() + first, contacts.end());
    if (taken.size() == kMostContacts) break;
    const auto is_same = [&](const SurfaceContact& t) {
      return t.normal.dot(n.normal) > kSameSurface;
    };
    if (std::ranges::none_of(taken, is_same)) contacts.push_back(n);
  }
}

bool SurfaceGeometry::may_touch(uint32_t body, const Vec3f& centre, float radius) const {
  const auto at = std::ranges::lower_bound(placed_, body, {}, &Placed::body);
  if (at == placed_.end() || at->body != body) return false;
  if (at->is_plane) {
    return at->normal.dot(centre.cast<double>() - at->pose.position) <= static_cast<double>(radius);
  }
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
    (*placed.mesh)->tree.for_each_near(way, 0, [&](uint32_t i) {
      first = std::min(first, crossing((*placed.mesh)->tree.corners()[i], a, b - a));
    });
  }
  return first;
}

}  // namespace pilesim
