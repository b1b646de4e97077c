// The part of SphereWorld that a director uses: see BodyControl.

#include <algorithm>
#include <cmath>

#include "simulate/sphere/sphere_world.h"

namespace pilesim {

void SphereWorld::put_to_sleep(uint32_t body) {
  SphereBody& sleeper = bodies_[body];
  sleeper.asleep = sleeper.put_to_sleep = sleeper.changed = true;
  sleeper.velocity.setZero();
  sleeper.spin.setZero();
}

void SphereWorld::set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  bodies_[body].velocity = linear.cast<float>();
  bodies_[body].spin = angular.cast<float>();
}

void SphereWorld::set_friction(uint32_t body, double friction) {
  if (root_friction_.empty()) {
    for (uint32_t i = 0; i < bodies_.size(); ++i) root_friction_.push_back(kind(i).root_friction);
  }
  root_friction_[body] = static_cast<float>(std::sqrt(friction)) * kind(body).object->interlocking;
}

void SphereWorld::read_contacts(std::vector<BodyContact>& contacts) const {
  std::vector<Vec3f> centres;
  std::vector<float> reaches;
  for (const uint32_t body : members_) {
    centres.push_back(bodies_[body].position);
    reaches.push_back(radius_m_[body] * (1 + kNearby));
  }
  if (members_.empty()) return;
  SphereGrid grid;
  grid.sort(centres, reaches);
  const std::span<const uint32_t> order = grid.order();
  const auto meet = [&](uint32_t i, uint32_t j) {
    read_contact(members_[std::min(i, j)], members_[std::max(i, j)], contacts);
  };
  for (size_t colour = 0; colour < SphereGrid::kColours; ++colour) {
    for (const uint32_t block : grid.blocks(colour)) {
      grid.for_each_pair(block, [&](uint32_t p, uint32_t q) { meet(order[p], order[q]); });
    }
  }
  for (size_t p = grid.small_count(); p < order.size(); ++p) {
    const Vec3f around = Vec3f::Constant(reaches[order[p]] + grid.widest_m());
    const Vec3f& centre = centres[order[p]];
    grid.for_each_in(centre - around, centre + around,
                     [&](uint32_t q) { meet(order[p], order[q]); });
    for (size_t q = p + 1; q < order.size(); ++q) meet(order[p], order[q]);
  }
  for (const uint32_t body : members_) read_surface_contacts(body, contacts);
}

void SphereWorld::read_contact(uint32_t a, uint32_t b, std::vector<BodyContact>& contacts) const {
  const Vec3f apart = bodies_[a].position - bodies_[b].position;
  const float distance = apart.norm();
  const float gap = distance - radius_m_[a] - radius_m_[b];
  if (gap > kNearby * std::min(radius_m_[a], radius_m_[b]) || !by_spheres(method(a, b))) return;
  // As in touch().
  const Vec3f normal = distance > 0 ? Vec3f(apart / distance) : Vec3f::UnitY();
  contacts.push_back({.a = a,
                      .b = b,
                      .point = (bodies_[b].position + radius_m_[b] * normal).cast<double>(),
                      .normal = normal.cast<double>(),
                      .distance_m = gap});
}

void SphereWorld::read_surface_contacts(uint32_t body, std::vector<BodyContact>& contacts) const {
  const Vec3f& centre = bodies_[body].position;
  const float radius = bodies_[body].surface_radius_m;
  const float reach = radius * (1 + kNearby);
  thread_local std::vector<uint32_t> near;
  thread_local std::vector<SurfaceContact> found;
  surfaces_.select({centre, centre}, reach, near);
  found.clear();
  surfaces_.find(near, centre, 0, reach, found);
  for (const SurfaceContact& contact : found) {
    if (!by_spheres(method(body, contact.body))) continue;
    contacts.push_back({.a = body,
                        .b = contact.body,
                        .point = (centre - contact.gap * contact.normal).cast<double>(),
                        .normal = contact.normal.cast<double>(),
                        .distance_m = contact.gap - radius});
  }
}

}  // namespace pilesim
