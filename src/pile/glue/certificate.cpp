#include <algorithm>
#include <cmath>
#include <limits>

#include "pile/glue/glue.h"

namespace pilesim {
namespace {

using Long3 = Eigen::Matrix<long double, 3, 1>;

Long3 exact(const Vec3& v) { return v.cast<long double>(); }

}  // namespace

GlueCertificate certify(std::span<const GlueBody> bodies, std::span<const GlueContact> contacts,
                        const Vec3& up, const GlueSolution& solution, double patch,
                        std::span<const GlueThere> there) {
  std::vector<Long3> push(bodies.size(), Long3::Zero()), turn(bodies.size(), Long3::Zero());
  long double mass = 0, moving = 0, outside = 0, total = 0;
  bool is_sound = true;
  for (const GlueBody& body : bodies) {
    mass += body.mass_kg;
    moving += body.mass_kg > 0 ? 1 : 0;
  }
  for (size_t c = 0; c < contacts.size(); ++c) {
    const GlueContact& contact = contacts[c];
    const Long3 force = exact(solution.force[c]), normal = exact(contact.normal);
    const long double glue = solution.glue_kg[c], along = force.dot(normal) + glue;
    const long double across = (force - force.dot(normal) * normal).norm();
    outside = std::max({outside, -along,
                        (across - static_cast<long double>(contact.friction) * along) /
                            (1 + static_cast<long double>(contact.friction))});
    is_sound = is_sound && glue >= 0;
    total += glue;
    push[contact.a] += force;
    push[contact.b] -= force;
    turn[contact.a] += (exact(contact.position) - exact(bodies[contact.a].centre)).cross(force);
    turn[contact.b] -= (exact(contact.position) - exact(bodies[contact.b].centre)).cross(force);
  }
  for (size_t i = 0; i < there.size(); ++i) {
    const GlueThere& spot = there[i];
    const Long3 force = exact(solution.there_force[i]), torque = exact(solution.there_torque[i]);
    const long double lacks = solution.there_lacks[i];
    const auto smaller = static_cast<long double>(
        std::min(bodies[spot.a].mass_kg > 0 ? bodies[spot.a].radius_m : 1e300,
                 bodies[spot.b].mass_kg > 0 ? bodies[spot.b].radius_m : 1e300));
    outside = std::max(
        {outside, force.norm() - spot.most_kg - lacks, (torque.norm() - spot.most_kgm) / smaller});
    is_sound = is_sound && lacks >= 0;
    total += lacks;
    const Long3 place = exact(spot.position);
    push[spot.a] += force;
    push[spot.b] -= force;
    turn[spot.a] += (place - exact(bodies[spot.a].centre)).cross(force) + torque;
    turn[spot.b] -= (place - exact(bodies[spot.b].centre)).cross(force) + torque;
  }
  for (const GluePatch& held : solution.patches) {
    double radius = std::numeric_limits<double>::infinity();
    for (const uint32_t body : {held.a, held.b}) {
      if (bodies[body].mass_kg > 0) radius = std::min(radius, bodies[body].radius_m);
    }
    const Long3 torque = exact(held.torque);
    turn[held.a] += torque;
    turn[held.b] -= torque;
    // The glue's strength, > 0, times its lever.
    is_sound = is_sound && torque.norm() <= (1 + 1e-9L) * patch * radius * held.glue_kg;
    total += held.glue_kg;
  }
  GlueCertificate certificate;
  for (size_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].mass_kg == 0 || solution.hangs[i] != 0) continue;
    const long double weight = bodies[i].mass_kg;
    const Long3 left = push[i] / weight - exact(up);
    const Long3 twist = turn[i] / (weight * bodies[i].radius_m);
    certificate.unbalanced =
        std::max(certificate.unbalanced,
                 static_cast<double>(std::sqrt(left.squaredNorm() + twist.squaredNorm())));
  }
  certificate.outside = moving > 0 ? static_cast<double>(outside / (mass / moving)) : 0;
  certificate.total_kg = is_sound ? static_cast<double>(total) : -1;
  return certificate;
}

}  // namespace pilesim
