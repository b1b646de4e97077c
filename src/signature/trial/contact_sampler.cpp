#include "signature/trial/contact_sampler.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/philox.h"
#include "signature/trial/contact_impulse.h"
#include "signature/trial/flight_reach.h"
#include "signature/trial/free_flight.h"

namespace pilesim {
namespace {

// A macro trial ends when impacts approach more slowly than this share of the initial speeds.
// Otherwise a body that lands flat without restitution rattles on for ever with ever smaller
// impacts.
constexpr double kStill = 1e-6;

// Points that fill the unit cube evenly from the first one on: multiples of (1/g, 1/g^2, ...)
// modulo 1, where g solves g^(d+1) = g + 1 (Roberts 2018), with a random shift per request.
constexpr size_t kDimensions = 6;
using Point = std::array<double, kDimensions>;

std::array<uint64_t, kDimensions> lattice_steps() {
  double g = 1.1;
  for (int i = 0; i < 60; ++i) g = std::pow(1 + g, 1.0 / (kDimensions + 1));
  std::array<uint64_t, kDimensions> steps;
  double step = 1;
  for (uint64_t& s : steps) {
    step /= g;
    s = static_cast<uint64_t>(std::ldexp(step, 64));
  }
  return steps;
}

class Lattice {
 public:
  Lattice(uint64_t seed, uint64_t object) {
    Philox random(seed, Stream::signature, object);
    for (uint64_t& s : shift_) {
      const uint64_t high = random.bits();
      s = high << 32 | random.bits();
    }
  }
  Point at(uint32_t index) const {
    static const std::array<uint64_t, kDimensions> steps = lattice_steps();
    Point point;
    for (size_t i = 0; i < kDimensions; ++i) {
      const uint64_t bits = shift_[i] + steps[i] * index;
      point[i] = (static_cast<double>(bits >> 12) + 0.5) * 0x1p-52;
    }
    return point;
  }

 private:
  std::array<uint64_t, kDimensions> shift_;
};

Vec3 unit_vector(double u, double v) {
  const double y = 1 - 2 * u;
  const double r = std::sqrt(std::max(0.0, 1 - y * y));
  return {r * std::cos(2 * kPi * v), y, r * std::sin(2 * kPi * v)};
}

// Some unit vector perpendicular to the unit vector n (Duff et al. 2017).
Vec3 across(const Vec3& n) {
  const double sign = std::copysign(1.0, n.z());
  const double a = -1 / (sign + n.z());
  return {1 + sign * n.x() * n.x() * a, sign * n.x() * n.y() * a, -sign * n.x()};
}

Vec3 turned_about(const Vec3& axis, double angle, const Vec3& v) {
  const Vec3 along = axis.dot(v) * axis;
  const Vec3 rest = v - along;
  return along + std::cos(angle) * rest + std::sin(angle) * axis.cross(rest);
}

Vec3 candidate_spin(const TrialRequest& request, const Point& point) {
  switch (request.spread) {
    case SpinSpread::cone:
      return turned_about(request.velocity.normalized(), 2 * kPi * point[4], request.spin);
    case SpinSpread::ring:
      return turned_about(Vec3::UnitY(), 2 * kPi * point[4], request.spin);
    case SpinSpread::everywhere:
      return request.spin.norm() * unit_vector(point[5], point[4]);
    case SpinSpread::fixed:
      break;
  }
  return request.spin;
}

// The highest speed at which a lowest vertex can approach the plane in any candidate.
double approach_bound(const TrialSetup& setup, const TrialRequest& request) {
  const ContactBody& body = *setup.body;
  if (setup.spins == SpinMeasure::energy) {
    return -request.velocity.y() + request.spin.norm() * body.energy_reach_m;
  }
  const bool any_tilt =
      request.spread == SpinSpread::cone || request.spread == SpinSpread::everywhere;
  const double tilted =
      any_tilt ? request.spin.norm() : std::hypot(request.spin.x(), request.spin.z());
  return -request.velocity.y() + tilted * body.reach_m;
}

class TrialCrew : public FlightCrew {
 public:
  TrialCrew(const TrialSetup& setup, std::span<const TrialRequest> requests, TrialResult* results)
      : setup_(setup), requests_(requests), results_(results) {}

  bool next(size_t lane, Flight& flight) override {
    for (; request_ < requests_.size(); ++request_, candidate_ = 0) {
      const TrialRequest& request = requests_[request_];
      if (candidate_ == request.count) continue;
      if (candidate_ == 0) {
        lattice_ = Lattice(setup_.seed, request.object);
        bound_ = approach_bound(setup_, request);
      }
      while (candidate_ < request.count) {
        const Point point = lattice_.at(request.first + candidate_++);
        Trial& trial = trials_[lane];
        trial.result = results_++;
        *trial.result = {};
        if (request.start == TrialStart::launch) return launch(request, point, trial, flight);
        if (place(request, point, trial, flight)) return true;
      }
    }
    return false;
  }

  bool ended(size_t lane, FlightEnd end, uint32_t vertex, Flight& flight) override {
    Trial& trial = trials_[lane];
    if (trial.phase == Phase::backwards) {
      if (end != FlightEnd::gone) return next(lane, flight);
      flight = trial.contact;
      vertex = trial.vertex;
      meet(trial, flight);
    } else if (trial.phase == Phase::approach) {
      assert(end == FlightEnd::contact);
      meet(trial, flight);
    } else if (end != FlightEnd::contact) {
      return finish(lane, flight);
    }
    if (setup_.kind == TrialKind::height) return next(lane, flight);
    const double approach = apply_contact_impulse(*setup_.body, setup_.material, vertex, flight);
    TrialResult& result = *trial.result;
    ++result.impacts;
    result.velocity = flight.velocity;
    result.spin = measured_spin(flight);
    result.unsettled = result.impacts == kMostImpacts;
    const bool done = setup_.kind == TrialKind::micro || result.unsettled ||
                      approach < kStill * trial.first_speed;
    return done ? finish(lane, flight) : true;
  }

 private:
  enum class Phase { approach, backwards, impacts };
  struct Trial {
    TrialResult* result;
    Phase phase;
    double first_speed;
    // The vertex of a trial that flies backwards.
    uint32_t vertex;
    Flight contact;
  };

  static void orient(const Point& point, Flight& flight) {
    flight.normal = unit_vector(point[0], point[1]);
    const Vec3 side = across(flight.normal);
    const double angle = 2 * kPi * point[2];
    flight.x_axis = std::cos(angle) * side + std::sin(angle) * flight.normal.cross(side);
    flight.time_s = 0;
  }

  // See SpinMeasure.
  void set_spin(const Vec3& spin, Flight& flight) const {
    flight.spin = flight.to_body(spin);
    if (setup_.spins == SpinMeasure::energy) {
      flight.spin = setup_.body->gyration_m *
                    flight.spin.cwiseProduct(setup_.body->inverse_inertia.cwiseSqrt());
    }
  }
  Vec3 measured_spin(const Flight& flight) const {
    if (setup_.spins == SpinMeasure::angular_velocity) return flight.world_spin();
    return flight.to_world(flight.spin.cwiseProduct(setup_.body->inertia_m2.cwiseSqrt())) /
           setup_.body->gyration_m;
  }

  bool launch(const TrialRequest& request, const Point& point, Trial& trial, Flight& flight) const {
    orient(point, flight);
    set_spin(candidate_spin(request, point), flight);
    flight.velocity = request.velocity;
    flight.height = reach_of_flight(*setup_.body, flight.normal, flight.spin);
    trial.phase = Phase::approach;
    return true;
  }

  // Records the first contact.
  void meet(Trial& trial, const Flight& flight) const {
    trial.phase = Phase::impacts;
    trial.first_speed = flight.velocity.norm() + flight.spin.norm() * setup_.body->gyration_m;
    trial.result->kept = true;
    trial.result->height_m = flight.height;
    trial.result->spin_before = measured_spin(flight);
  }

  // Puts the body on its lowest vertex in a random orientation and starts the flight backwards.
  // False if the candidate is dropped, since it moves away or approaches too slowly.
  bool place(const TrialRequest& request, const Point& point, Trial& trial, Flight& flight) const {
    const ContactBody& body = *setup_.body;
    orient(point, flight);
    const Support support = lowest_vertex(body, flight.normal);
    set_spin(candidate_spin(request, point), flight);
    flight.velocity = request.velocity;
    flight.height = support.height_m;
    const Vec3& r = body.vertices[support.vertex];
    const double approach = -request.velocity.y() - flight.normal.dot(flight.spin.cross(r));
    if (approach <= point[3] * bound_) return false;
    trial.contact = flight;
    trial.vertex = support.vertex;
    trial.phase = Phase::backwards;
    flight.velocity = -flight.velocity;
    flight.spin = -flight.spin;
    return true;
  }

  bool finish(size_t lane, Flight& flight) {
    TrialResult& result = *trials_[lane].result;
    // Only a macro trial that was cut short can still move down.
    if (setup_.kind == TrialKind::macro) result.velocity.y() = std::max(0.0, result.velocity.y());
    return next(lane, flight);
  }

  const TrialSetup& setup_;
  std::span<const TrialRequest> requests_;
  TrialResult* results_;
  size_t request_ = 0;
  uint32_t candidate_ = 0;
  Lattice lattice_{0, 0};
  double bound_ = 0;
  std::array<Trial, kFlightLanes> trials_;
};

}  // namespace

double contact_acceptance(const TrialSetup& setup, const TrialRequest& request) {
  assert(request.velocity.y() < 0);
  return -request.velocity.y() / approach_bound(setup, request);
}

uint32_t candidates_for(const TrialSetup& setup, const TrialRequest& request, uint32_t trials) {
  return static_cast<uint32_t>(std::ceil(trials / contact_acceptance(setup, request)));
}

void run_trials(const TrialSetup& setup, std::span<const TrialRequest> requests,
                std::vector<TrialResult>& results) {
  size_t candidates = 0;
  for (const TrialRequest& request : requests) candidates += request.count;
  results.resize(candidates);
  TrialCrew crew(setup, requests, results.data());
  fly(*setup.body, crew);
}

}  // namespace pilesim
