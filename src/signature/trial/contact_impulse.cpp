#include "signature/trial/contact_impulse.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

// K of (2.14) per unit of mass, in the body frame: the change of the velocity of point r per unit
// impulse there.
Mat3 contact_compliance(const ContactBody& body, const Vec3& r) {
  const Vec3& j = body.inverse_inertia;
  Mat3 k;
  k(0, 0) = 1 + r.y() * r.y() * j.z() + r.z() * r.z() * j.y();
  k(1, 1) = 1 + r.x() * r.x() * j.z() + r.z() * r.z() * j.x();
  k(2, 2) = 1 + r.x() * r.x() * j.y() + r.y() * r.y() * j.x();
  k(0, 1) = k(1, 0) = -r.x() * r.y() * j.z();
  k(0, 2) = k(2, 0) = -r.x() * r.z() * j.y();
  k(1, 2) = k(2, 1) = -r.y() * r.z() * j.x();
  return k;
}

// Largest share, 0 .. 1, of the way from impulse `from` to `to` at which the energy stays at most
// that before the contact. It does at `from`.
double energy_limit(const Mat3& compliance, const Vec3& u, const Vec3& from, const Vec3& to) {
  // An impulse j changes the energy by j.u + j.K j / 2, here along from + s (to - from).
  const Vec3 along = to - from;
  const Vec3 k_from = compliance * from, k_along = compliance * along;
  const double c0 = from.dot(u) + 0.5 * from.dot(k_from);
  const double c1 = along.dot(u) + along.dot(k_from);
  const double c2 = 0.5 * along.dot(k_along);
  // Without friction the two impulses are equal.
  if (c0 + c1 + c2 <= 0 || c2 <= 0) return 1;
  // c2 > 0 and c0 <= 0 here: the only root above 0.
  const double root = std::sqrt(std::max(0.0, c1 * c1 - 4 * c2 * c0));
  const double limit = c1 > 0 ? -2 * c0 / (c1 + root) : (root - c1) / (2 * c2);
  return std::clamp(limit, 0.0, 1.0);
}

Vec3 contact_impulse(const Mat3& compliance, const ContactMaterial& material, const Vec3& normal,
                     const Vec3& u) {
  const double u_normal = normal.dot(u);
  const double restitution =
      -u_normal < material.restitution_threshold_m_s ? 0.0 : material.restitution;
  const Vec3 k_normal = compliance * normal;
  const double rebound = -(1 + restitution) * u_normal;
  const Vec3 frictionless = rebound / normal.dot(k_normal) * normal;

  // Static friction (2.19): the point stops sliding.
  Vec3 impulse = compliance.inverse() * (-u - restitution * u_normal * normal);
  const double j_normal = normal.dot(impulse);
  const Vec3 j_tangent = impulse - j_normal * normal;
  if (j_tangent.norm() > material.friction * j_normal) {
    // Kinetic friction (2.20, 2.24) against the present sliding, or the sliding that would begin.
    const Vec3 sliding = u - u_normal * normal;
    const double speed = sliding.norm();
    const Vec3 against = speed > 0 ? Vec3(-sliding / speed) : Vec3(j_tangent.normalized());
    const Vec3 direction = normal + material.friction * against;
    const double denominator = k_normal.dot(direction);
    // If not positive, friction alone would drive the point into the plane: no impulse along this
    // direction separates them.
    impulse = denominator > 0 ? Vec3(rebound / denominator * direction) : frictionless;
  }
  const double limit = energy_limit(compliance, u, frictionless, impulse);
  return frictionless + limit * (impulse - frictionless);
}

}  // namespace

double apply_contact_impulse(const ContactBody& body, const ContactMaterial& material,
                             uint32_t vertex, Flight& flight) {
  const Vec3& r = body.vertices[vertex];
  const Vec3 u = flight.to_body(flight.velocity) + flight.spin.cross(r);
  const double approach = -flight.normal.dot(u);
  if (approach <= 0) return approach;
  const Vec3 impulse = contact_impulse(contact_compliance(body, r), material, flight.normal, u);
  flight.velocity += flight.to_world(impulse);
  flight.spin += body.inverse_inertia.cwiseProduct(r.cross(impulse));
  return approach;
}

}  // namespace pilesim
