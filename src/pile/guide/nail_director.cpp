#include "pile/guide/nail_director.h"

#include <algorithm>
#include <cmath>

#include "core/clock.h"
#include "core/philox.h"
#include "pile/guide/guide_constants.h"

namespace pilesim {

using namespace guide_constants;

double area_of_triples(std::span<const SupportPoint> contacts) {
  double area = 0;
  for (size_t i = 2; i < contacts.size(); ++i) {
    const Vec3& point = contacts[i].position;
    area += (point - contacts[i - 1].position).cross(point - contacts[i - 2].position).norm() / 2;
  }
  return area;
}

NailDirector::NailDirector(const Scene& scene, const Model& model)
    : scene_(scene),
      model_(model),
      guide_(*scene.guide),
      up_(scene.gravity.norm() > 0 ? Vec3(-scene.gravity.normalized()) : Vec3::UnitY()),
      graph_(model),
      standing_(model.bodies.size(), Standing::unknown),
      nailed_(model.bodies.size()) {
  if (!model.guide.triangles.empty()) shape_.emplace(model.guide);
}

// "if i++ % ctrlcycle == 0", after a step.
void NailDirector::direct(ImpulseControl& control) {
  const auto period = static_cast<uint64_t>(guide_.period_steps);
  if (state_.step > 0 && (state_.step - 1) % period == 0) {
    const Stopwatch watch;
    control_step(control);
    state_.control_s += watch.seconds();
  }
  ++state_.step;
}

void NailDirector::control_step(ImpulseControl& control) {
  ++state_.control_steps;
  for (const DrivenNail& nail : state_.nails) control.remove_constraint(nail.id);
  state_.nails.clear();
  control.read_contacts(contacts_);
  graph_.build(contacts_);
  GuideCounts counts;
  for (uint32_t body = 0; body < standing_.size(); ++body) {
    const bool is_inside =
        control.is_in_world(body) && (!shape_ || shape_->contains(control.motion(body).position));
    standing_[body] = is_inside ? standing(control, body) : Standing::unknown;
    counts.in_guide += is_inside;
    counts.passed += standing_[body] == Standing::passed;
    counts.filtered += standing_[body] == Standing::filtered;
    counts.failed += standing_[body] == Standing::failed;
  }
  std::ranges::fill(nailed_, uint8_t{0});
  if (guide_.control) nail(control);
  counts.nails = static_cast<uint32_t>(state_.nails.size());
  for (uint32_t body = 0; body < standing_.size(); ++body) {
    counts.held += nailed_[body];
    control.mark(body, kFrozen | kPassed | kFailed, flags_of(standing_[body], nailed_[body] != 0));
  }
  state_.counts = counts;
}

// 6.2.1 with (2.28); then (6.1), at least three contacts, and (6.2).
Standing NailDirector::standing(const ImpulseControl& control, uint32_t body) {
  chosen_.clear();
  for (const SupportPoint& support : graph_.supports(body)) {
    if (support.normal.dot(up_) > 0) chosen_.push_back(support);
  }
  const double radius = model_.shapes[model_.bodies[body].shape].bounding_radius;
  if (!pyramids_.solve(control.motion(body).position, radius, chosen_, up_)) {
    return Standing::failed;
  }
  for (size_t i = 0; i < chosen_.size(); ++i) {
    const PyramidForce& force = pyramids_.forces()[i];
    const double most = guide_.kinetic_share * chosen_[i].friction * force.normal + kForceTolerance;
    if (std::abs(force.tangent_1) >= most || std::abs(force.tangent_2) >= most) {
      return Standing::filtered;
    }
  }
  const bool is_spread = static_cast<int>(chosen_.size()) >= guide_.least_contacts &&
                         area_of_triples(chosen_) >= guide_.alpha * radius * radius;
  return is_spread ? Standing::passed : Standing::filtered;
}

// True for a candidate whose neighbours are all candidates or stand by themselves.
bool NailDirector::may_nail(const ImpulseControl& control, uint32_t body) const {
  return standing_[body] == Standing::passed &&
         std::ranges::all_of(graph_.neighbours(body), [&](uint32_t other) {
           return standing_[other] == Standing::passed || stands_by_itself(model_, control, other);
         });
}

// Drives one nail between the body and each of them, at a random contact of the pair.
void NailDirector::nail(ImpulseControl& control) {
  std::map<std::pair<uint32_t, uint32_t>, std::vector<const BodyContact*>> pairs;
  for (const BodyContact& contact : contacts_) {
    pairs[std::minmax(contact.a, contact.b)].push_back(&contact);
  }
  for (const auto& [pair, contacts] : pairs) {
    const bool first_may = may_nail(control, pair.first);
    if (!first_may && !may_nail(control, pair.second)) continue;
    Philox random(scene_.seed, Stream::nail, uint64_t{pair.first} << 32 | pair.second,
                  static_cast<uint32_t>(state_.control_steps));
    const BodyContact& contact = *contacts[random.index(static_cast<uint32_t>(contacts.size()))];
    Nail nail{contact.a, contact.b, contact.point, contact.normal, 0};
    if (!control.is_in_world(nail.a)) std::swap(nail.a, nail.b);
    const uint32_t candidate = first_may ? pair.first : pair.second;
    nail.breaking_impulse_ns = kKappa * model_.bodies[candidate].mass_kg;
    state_.nails.push_back({control.add_nail(nail), contact.point});
    for (const uint32_t body : {pair.first, pair.second}) {
      if (standing_[body] == Standing::passed) nailed_[body] = 1;
    }
  }
}

std::vector<Vec3> NailDirector::constraint_points() const {
  std::vector<Vec3> points;
  for (const DrivenNail& nail : state_.nails) points.push_back(nail.point);
  return points;
}

void NailDirector::load(StateReader& reader) { reader(state_); }

}  // namespace pilesim
