#include "support/pile_equilibrium.h"

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

// A motion counts as unresisted if the largest power of a contact is below this share of its size.
constexpr double kNoPower = 1e-6;

// Iterations between two checks for convergence.
constexpr int kLook = 20;

// The nearest point of the cone |tangential| <= mu normal.
Vec3 project(const Vec3& force, const Vec3& normal, double friction) {
  const double along = force.dot(normal);
  const Vec3 across = force - along * normal;
  const double size = across.norm();
  if (size <= friction * along) return force;
  if (friction * size <= -along) return Vec3::Zero();
  const double share = (along + friction * size) / (1 + friction * friction);
  return share * (normal + (size > 0 ? Vec3(friction / size * across) : Vec3::Zero()));
}

class Problem {
 public:
  Problem(std::span<const PileBody> bodies, std::span<const PileContact> contacts, const Vec3& up)
      : bodies_(bodies), contacts_(contacts), up_(up), push(bodies.size()), turn(bodies.size()) {
    std::vector<double> count(bodies.size());
    for (const PileContact& contact : contacts) {
      ++count[contact.a];
      ++count[contact.b];
    }
    // With this scale of the forces the largest curvature is at most 1: for a body the square of a
    // sum is at most its number of terms times the sum of the squares.
    for (const PileContact& contact : contacts) {
      double curvature = 0;
      for (const uint32_t i : {contact.a, contact.b}) {
        if (bodies[i].mass_kg == 0) continue;
        const double arm = (contact.position - bodies[i].centre).norm() / bodies[i].radius_m;
        curvature += count[i] * (1 + arm * arm) / (bodies[i].mass_kg * bodies[i].mass_kg);
      }
      scale_.push_back(curvature > 0 ? 1 / std::sqrt(curvature) : 0);
    }
  }

  double scale(size_t contact) const { return scale_[contact]; }

  // push and turn of every body from `scaled` forces and gravity.
  void leave(const std::vector<Vec3>& scaled) {
    for (size_t i = 0; i < bodies_.size(); ++i) {
      push[i] = bodies_[i].mass_kg > 0 ? Vec3(-up_) : Vec3::Zero();
      turn[i].setZero();
    }
    for (size_t c = 0; c < contacts_.size(); ++c) {
      const Vec3 force = scale_[c] * scaled[c];
      add(contacts_[c].a, contacts_[c].position, force);
      add(contacts_[c].b, contacts_[c].position, -force);
    }
  }

  // From the bodies at contact c: the gradient of half the squares by its scaled force.
  Vec3 gradient(size_t c) const {
    const PileContact& contact = contacts_[c];
    return scale_[c] * (motion(contact.a, contact.position) - motion(contact.b, contact.position));
  }

  double largest() const {
    double most = 0;
    for (size_t i = 0; i < bodies_.size(); ++i) {
      most = std::max(most, push[i].squaredNorm() + turn[i].squaredNorm());
    }
    return std::sqrt(most);
  }
  // Gravity's power in the motion.
  double drive() const {
    double sum = 0;
    for (const Vec3& p : push) sum -= p.dot(up_);
    return sum;
  }
  double size() const {
    double sum = 0;
    for (size_t i = 0; i < bodies_.size(); ++i) {
      sum += push[i].squaredNorm() + turn[i].squaredNorm();
    }
    return std::sqrt(sum);
  }

 private:
  void add(uint32_t i, const Vec3& position, const Vec3& force) {
    const PileBody& body = bodies_[i];
    if (body.mass_kg == 0) return;
    push[i] += force / body.mass_kg;
    turn[i] += (position - body.centre).cross(force) / (body.mass_kg * body.radius_m);
  }
  Vec3 motion(uint32_t i, const Vec3& position) const {
    const PileBody& body = bodies_[i];
    if (body.mass_kg == 0) return Vec3::Zero();
    return (push[i] + turn[i].cross(position - body.centre) / body.radius_m) / body.mass_kg;
  }

  std::span<const PileBody> bodies_;
  std::span<const PileContact> contacts_;
  Vec3 up_;
  std::vector<double> scale_;

 public:
  std::vector<Vec3> push, turn;
};

}  // namespace

PileVerdict analyse_pile(std::span<const PileBody> bodies, std::span<const PileContact> contacts,
                         const Vec3& up, const PileEquilibriumSettings& settings) {
  Problem problem(bodies, contacts, up);
  const size_t count = contacts.size();
  std::vector<Vec3> force(count, Vec3::Zero()), ahead = force;
  PileVerdict verdict;
  // The largest total residual of a stable pile.
  const double enough = settings.tolerance * std::sqrt(static_cast<double>(bodies.size()));
  double momentum = 1;
  for (;; ++verdict.sweeps) {
    if (verdict.sweeps % kLook == 0) {
      problem.leave(force);
      verdict.unbalanced = problem.largest();
      const double size = problem.size();
      double power = 0;
      for (size_t c = 0; c < count; ++c) {
        const Vec3 motion = problem.gradient(c);
        const double along = motion.dot(contacts[c].normal);
        const double across = (motion - along * contacts[c].normal).norm();
        power = std::max(power, contacts[c].friction * across - along);
      }
      verdict.resistance = size > 0 ? power / size : 0;
      // No forces leave a smaller total residual than gravity's share of such a motion.
      const bool falls = verdict.resistance <= kNoPower && problem.drive() > enough * size;
      if (verdict.unbalanced <= settings.tolerance) {
        verdict.kind = PileVerdict::Kind::stable;
      } else if (falls) {
        verdict.kind = PileVerdict::Kind::unstable;
      }
      if (verdict.kind != PileVerdict::Kind::undecided) break;
      if (verdict.sweeps >= settings.most_sweeps) break;
    }
    problem.leave(ahead);
    const double next = (1 + std::sqrt(1 + 4 * momentum * momentum)) / 2;
    double uphill = 0;
    for (size_t c = 0; c < count; ++c) {
      const Vec3 gradient = problem.gradient(c);
      const Vec3 stepped = project(ahead[c] - gradient, contacts[c].normal, contacts[c].friction);
      const Vec3 way = stepped - force[c];
      uphill += (ahead[c] - stepped).dot(way);
      force[c] = stepped;
      ahead[c] = stepped + (momentum - 1) / next * way;
    }
    // The momentum restarts where it leads uphill (O'Donoghue and Candes 2015).
    momentum = next;
    if (uphill > 0) {
      momentum = 1;
      ahead = force;
    }
  }
  for (size_t c = 0; c < count; ++c) force[c] *= problem.scale(c);
  verdict.force = std::move(force);
  verdict.push = std::move(problem.push);
  verdict.turn = std::move(problem.turn);
  return verdict;
}

}  // namespace pilesim
