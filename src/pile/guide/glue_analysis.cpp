// The glue director's analyses: the forces, with glue, that hold a pile in its present pose.
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "pile/guide/glue_director.h"
#include "pile/guide/guide_constants.h"

namespace pilesim {

using namespace guide_constants;

// By body of the model.
std::vector<GlueBody> GlueDirector::bodies_of(const ImpulseControl& control) const {
  std::vector<GlueBody> bodies;
  for (uint32_t body = 0; body < parts_.size(); ++body) {
    const double radius = model_.shapes[model_.bodies[body].shape].bounding_radius;
    const bool moves = parts_[body] == Part::pile;
    bodies.push_back({moves ? control.motion(body).position : model_.bodies[body].pose.position,
                      radius, moves ? model_.bodies[body].mass_kg : 0});
  }
  return bodies;
}

// Contacts within the pile and with its supports; `of_friction`: share of the friction to rely on.
std::vector<GlueContact> GlueDirector::contacts_of(std::span<const GlueBody> bodies,
                                                   double of_friction) const {
  std::vector<GlueContact> contacts;
  for (const BodyContact& contact : contacts_) {
    if (parts_[contact.a] == Part::none || parts_[contact.b] == Part::none) continue;
    double radius = std::numeric_limits<double>::infinity();
    for (const uint32_t body : {contact.a, contact.b}) {
      if (parts_[body] == Part::pile) radius = std::min(radius, bodies[body].radius_m);
    }
    if (!std::isfinite(radius) || contact.distance_m > kGlueGap * radius) continue;
    contacts.push_back({contact.a, contact.b, contact.point, contact.normal,
                        of_friction * friction_of(contact.a, contact.b)});
  }
  return contacts;
}

double GlueDirector::friction_of(uint32_t a, uint32_t b) const {
  const auto friction = [&](uint32_t body) {
    return model_.materials[model_.bodies[body].material].friction;
  };
  return std::sqrt(friction(a) * friction(b));
}

void GlueDirector::analyse(ImpulseControl& control) {
  const std::vector<GlueBody> bodies = bodies_of(control);
  const std::vector<GlueContact> contacts = contacts_of(bodies, kGlueFriction);
  const GlueSolution solution = least_glue(bodies, contacts, up_);
  GlueFigures figures;
  figures.is_solved = solution.is_solved;
  figures.contacts = static_cast<uint32_t>(contacts.size());
  hanging_.clear();
  double mass_kg = 0;
  for (uint32_t body = 0; body < parts_.size(); ++body) {
    if (parts_[body] != Part::pile) continue;
    mass_kg += bodies[body].mass_kg;
    if (solution.hangs[body] != 0) hanging_.push_back(body);
  }
  figures.hanging = static_cast<uint32_t>(hanging_.size());
  for (uint32_t body = 0; body < parts_.size(); ++body) {
    if (parts_[body] == Part::pile && figures.hanging < state_.counts.in_guide) {
      state_.covered[body] = 1;
    }
  }
  if (solution.is_solved) {
    const GlueCertificate proof = certify(bodies, contacts, up_, solution, GlueSettings().patch);
    figures.unbalanced = proof.unbalanced;
    figures.outside = proof.outside;
    figures.weights = solution.total_kg / mass_kg;
    if (guide_.max_glue && *guide_.max_glue < figures.weights) {
      figures.given = *guide_.max_glue / figures.weights;
    }
    for (const double glue : solution.glue_kg) figures.glued_contacts += glue > 0 ? 1 : 0;
    for (const Vec3& force : solution.force) {
      figures.largest_force = std::max(figures.largest_force, force.norm());
    }
    figures.largest_force /= mass_kg / state_.counts.in_guide;
    note_forces(control, contacts, solution);
  }
  note_analysis(control);
  state_.left.reset();
  state_.figures = figures;
  if (solution.is_solved && guide_.control) {
    // A pile that stands with gravity tilted to three sides stands with every direction between
    // them: forces, and the strengths they need, can be averaged.
    std::vector<GlueSolution> cases = {solution};
    const Vec3 side = up_.unitOrthogonal();
    for (int i = 0; i < 3; ++i) {
      const Vec3 aside = Eigen::AngleAxisd(2 * kPi * i / 3, up_) * side;
      GlueSolution turned = least_glue(bodies, contacts, (up_ + kGlueTilt * aside).normalized());
      if (turned.is_solved) {
        cases.push_back(std::move(turned));
      } else {
        ++state_.figures->leaning_unsolved;
      }
    }
    put_on(control, contacts, cases);
  }
  state_.figures->pairs = state_.counts.glue;
}

void GlueDirector::note_analysis(const ImpulseControl& control) {
  for (uint32_t body = 0; body < parts_.size(); ++body) {
    if (parts_[body] == Part::pile) state_.place[body] = control.motion(body).position;
  }
  state_.torn_seen = state_.counts.torn;
  state_.had_forces = is_as_analysed();
  state_.rest_looks = 0;
}

// The pile is now every resting body, wherever it has come to lie.
void GlueDirector::find_left(const ImpulseControl& control) {
  for (uint32_t body = 0; body < parts_.size(); ++body) {
    if (parts_[body] == Part::anchor || model_.bodies[body].role != Role::dynamic) continue;
    const bool lies = control.is_in_world(body) && is_slow(control, body, kSlumped);
    parts_[body] = lies ? Part::pile : Part::none;
  }
}

// Analyses the pile after an impact: the forces that hold it with glue that has not torn, and the
// glue that is missing. It adds and removes no glue: the engine decides whether the pile stands.
void GlueDirector::analyse_left(ImpulseControl& control) {
  find_left(control);
  const std::vector<GlueBody> bodies = bodies_of(control);
  const std::vector<GlueContact> contacts = contacts_of(bodies, 1);
  GlueLeft left{.time_s = control.time_s()};
  std::vector<GlueThere> there;
  for (const GlueState::Spot& spot : state_.spots) {
    if (!spot.holds || parts_[spot.line.a] != Part::pile || parts_[spot.line.b] == Part::none) {
      continue;
    }
    const BodyMotion a = control.motion(spot.line.a), b = control.motion(spot.line.b);
    // A stretched spot acts at its midpoint, as in the engine.
    const Vec3 at_a = a.position + a.orientation * spot.line.arm;
    const Vec3 at_b = b.position + b.orientation * spot.arm_b;
    there.push_back(
        {spot.line.a, spot.line.b, (at_a + at_b) / 2, spot.strength_kg, spot.strength_kgm});
  }
  left.pairs = static_cast<uint32_t>(there.size());
  const GlueSolution solution = least_glue(bodies, contacts, up_, GlueSettings(), there);
  left.is_solved = solution.is_solved;
  double mass_kg = 0;
  for (uint32_t body = 0; body < parts_.size(); ++body) {
    if (parts_[body] != Part::pile || state_.covered[body] == 0) continue;
    ++left.bodies;
    mass_kg += bodies[body].mass_kg;
    left.hanging += solution.hangs[body];
  }
  if (left.is_solved && left.bodies > 0) {
    const GlueCertificate proof =
        certify(bodies, contacts, up_, solution, GlueSettings().patch, there);
    left.unbalanced = proof.unbalanced;
    left.outside = proof.outside;
    for (size_t i = 0; i < there.size(); ++i) {
      const double kg = std::min(solution.there_force[i].norm(), there[i].most_kg);
      const double of_torque_kg =
          solution.there_torque[i].norm() / radius_of(there[i].a, there[i].b);
      left.weights += kg / mass_kg;
      left.needed += std::max(kg, of_torque_kg) > kLeastShown * mass_kg / left.bodies ? 1 : 0;
    }
    left.missing = solution.total_kg * left.bodies / mass_kg;
    note_forces(control, contacts, solution, there);
  } else {
    for (PairLine& line : state_.forces) line.until_s = std::min(line.until_s, control.time_s());
  }
  note_analysis(control);
  state_.left = left;
}

// One line per pair of bodies: the sum over their contacts and their spot of glue.
void GlueDirector::note_forces(const ImpulseControl& control, std::span<const GlueContact> contacts,
                               const GlueSolution& solution, std::span<const GlueThere> there) {
  struct Sum {
    Vec3 force = Vec3::Zero(), middle = Vec3::Zero();  // kg, on the first; kg m
    double push_kg = 0, kg = 0;
  };
  std::map<std::pair<uint32_t, uint32_t>, Sum> sums;
  for (size_t c = 0; c < contacts.size(); ++c) {
    const GlueContact& contact = contacts[c];
    const Vec3& force = solution.force[c];
    Sum& sum = sums[std::minmax(contact.a, contact.b)];
    sum.force += contact.a < contact.b ? force : Vec3(-force);
    sum.push_kg += force.dot(contact.normal);
    sum.middle += force.norm() * contact.position;
    sum.kg += force.norm();
  }
  for (size_t i = 0; i < there.size(); ++i) {
    const auto [a, b] = std::pair(there[i].a, there[i].b);
    const Vec3& force = solution.there_force[i];
    const Vec3 way = parts_[b] == Part::pile
                         ? Vec3(control.motion(a).position - control.motion(b).position)
                         : up_;
    Sum& sum = sums[std::minmax(a, b)];
    sum.force += a < b ? force : Vec3(-force);
    sum.push_kg += force.dot(way.normalized());
    sum.middle += force.norm() * there[i].position;
    sum.kg += force.norm();
  }
  const double unit_kg = mean_kg();
  for (PairLine& line : state_.forces) line.until_s = std::min(line.until_s, control.time_s());
  for (const auto& [bodies, sum] : sums) {
    const double weights = sum.force.norm() / unit_kg;
    if (weights < kLeastShown) continue;
    auto [a, b] = bodies;
    if (parts_[a] != Part::pile) std::swap(a, b);
    const BodyMotion motion = control.motion(a);
    state_.forces.push_back(
        {.a = a,
         .b = b,
         .b_stands = parts_[b] != Part::pile,
         .arm = motion.orientation.conjugate() * (sum.middle / sum.kg - motion.position),
         .weights = sum.push_kg < -kLeastShown * unit_kg ? -weights : weights,
         .from_s = control.time_s()});
  }
}

bool stands(const GlueLeft& left) {
  return left.is_solved && left.bodies > 0 && left.hanging == 0 &&
         left.missing <= kNothingMissing && left.unbalanced <= kMostUnbalanced &&
         left.outside <= kMostUnbalanced;
}

bool are_found(const GlueFigures& figures) {
  return figures.is_solved && figures.unbalanced <= kMostUnbalanced;
}

}  // namespace pilesim
