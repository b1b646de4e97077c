// Bodies and an independent, slow double-precision flight for signature tests.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/philox.h"
#include "geometry/convex_hull.h"
#include "geometry/mass_properties.h"
#include "geometry/primitives.h"
#include "signature/trial/contact_body.h"
#include "signature/trial/free_flight.h"
#include "support/random_vectors.h"

namespace pilesim::test {

inline ContactBody box_body(const Vec3& size) { return make_contact_body(box_mesh(size), "box"); }

// The hull of `points` random points in a box of random proportions.
inline ContactBody random_body(Philox& random, int points) {
  const Vec3 size = random_in_box(random, 0.2, 2);
  std::vector<Vec3> cloud;
  for (int i = 0; i < points; ++i) cloud.push_back(random.direction().cwiseProduct(size));
  return make_contact_body(convex_hull(cloud), "random hull");
}

// With the body at `orientation` (body frame to world), and the spin in the world frame.
inline Flight make_flight(const Quat& orientation, const Vec3& velocity, const Vec3& world_spin,
                          double height) {
  const Quat to_body = orientation.conjugate();
  Flight flight;
  flight.x_axis = to_body * Vec3::UnitX();
  flight.normal = to_body * Vec3::UnitY();
  flight.spin = to_body * world_spin;
  flight.velocity = velocity;
  flight.height = height;
  return flight;
}

// One flight to its next end.
struct FlightResult {
  FlightEnd end;
  uint32_t vertex = 0;  // undefined if gone
  Flight flight;        // at that moment
};
inline FlightResult fly_one(const ContactBody& body, const Flight& start) {
  struct One : FlightCrew {
    explicit One(const Flight& flight) : start(flight) {}
    bool next(size_t, Flight& flight) override {
      if (started) return false;
      flight = start;
      return started = true;
    }
    bool ended(size_t, FlightEnd end, uint32_t vertex, Flight& flight) override {
      result = {end, vertex, flight};
      return false;
    }
    Flight start;
    bool started = false;
    FlightResult result{};
  } crew(start);
  fly(body, crew);
  return crew.result;
}

inline Flight random_flight(const ContactBody& body, Philox& random, double most_spin) {
  const Vec3 velocity = random_in_box(random, {-1, -1, -1}, {1, -0.1, 1});
  const Vec3 spin = random_arrow(random, 0, most_spin) / body.gyration_m;
  return make_flight(random.rotation(), velocity, spin, body.outer_radius_m);
}

// Torque-free motion by the classical Runge-Kutta method with small steps, in plain formulas of the
// rotation matrix and the world's angular momentum.
class SlowFlight {
 public:
  SlowFlight(const ContactBody& body, const Flight& start)
      : body_(body),
        height_(start.height),
        rise_(start.velocity.y()),
        rotation_(start.orientation().toRotationMatrix()) {
    momentum_ = rotation_ * body.inertia_m2.cwiseProduct(start.spin);
  }

  Vec3 world_spin(const Mat3& rotation) const {
    return rotation * body_.inverse_inertia.cwiseProduct(rotation.transpose() * momentum_);
  }
  Vec3 world_spin() const { return world_spin(rotation_); }
  const Mat3& rotation() const { return rotation_; }
  double height() const { return height_; }

  void advance(double dt) {
    const auto rate = [&](const Mat3& r) -> Mat3 {
      const Vec3 w = world_spin(r);
      Mat3 cross;
      cross << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
      return cross * r;
    };
    const Mat3 k1 = rate(rotation_);
    const Mat3 k2 = rate(rotation_ + 0.5 * dt * k1);
    const Mat3 k3 = rate(rotation_ + 0.5 * dt * k2);
    const Mat3 k4 = rate(rotation_ + dt * k3);
    rotation_ += dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    height_ += dt * rise_;
  }

  // Height of the lowest vertex over the plane.
  double gap() const {
    double lowest = 1e300;
    for (const Vec3& v : body_.vertices) lowest = std::min(lowest, rotation_.row(1).dot(v));
    return height_ + lowest;
  }

 private:
  const ContactBody& body_;
  double height_, rise_;
  Mat3 rotation_;
  Vec3 momentum_;
};

}  // namespace pilesim::test
