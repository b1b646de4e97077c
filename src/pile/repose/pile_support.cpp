#include "pile/repose/pile_support.h"

#include <algorithm>
#include <numeric>

#include "pile/repose/repose_constants.h"

namespace pilesim {
namespace {

using namespace repose_constants;

}  // namespace

PileSupport::PileSupport(const Model& model, const PileBodies& bodies)
    : grounded(model.bodies.size()),
      on_fixed(model.bodies.size()),
      is_supported(model.bodies.size()),
      is_balanced(model.bodies.size()),
      depth_m(model.bodies.size()),
      deepest_in(model.bodies.size()),
      model_(model),
      bodies_(bodies),
      above_(model.bodies.size()),
      beside_(model.bodies.size()),
      wedging_(model.bodies.size()),
      joined_to_(model.bodies.size() + 1),
      fixed_(static_cast<uint32_t>(model.bodies.size())),
      bearings_(model.bodies.size()) {}

void PileSupport::note_bearing(uint32_t body, const Vec3& point, const Vec3& centre) {
  const Vec3 arm = point - centre;
  const double smallest_m = bodies_.shapes[model_.bodies[body].shape].smallest_m;
  // A support right below the centre counts for all directions.
  if (std::hypot(arm.x(), arm.z()) < kBelowShare * smallest_m) {
    bearings_[body].insert(bearings_[body].end(), {0, 2 * kPi / 3, -2 * kPi / 3});
  } else {
    bearings_[body].push_back(std::atan2(arm.z(), arm.x()));
  }
}

void PileSupport::note_beside(uint32_t body, uint32_t other, const Vec3& point,
                              const std::vector<BodyMotion>& motion) {
  if (model_.bodies[body].role != Role::dynamic) return;
  const Vec3 arm = point - motion[body].position;
  beside_[other].push_back({body, std::atan2(arm.z(), arm.x())});
}

uint32_t PileSupport::root(uint32_t body) {
  while (joined_to_[body] != body) body = joined_to_[body] = joined_to_[joined_to_[body]];
  return body;
}

// True if no half-plane is free of supports.
bool PileSupport::surrounded(std::vector<double>& bearings) const {
  if (bearings.size() < 2) return false;
  std::ranges::sort(bearings);
  double widest = bearings.front() + 2 * kPi - bearings.back();
  for (size_t i = 1; i < bearings.size(); ++i) {
    widest = std::max(widest, bearings[i] - bearings[i - 1]);
  }
  return widest < kPi + kBearingTolerance;
}

void PileSupport::read(const std::vector<BodyContact>& contacts, const std::vector<uint8_t>& asleep,
                       const std::vector<BodyMotion>& motion) {
  std::iota(joined_to_.begin(), joined_to_.end(), 0u);
  std::ranges::fill(on_fixed, 0);
  std::ranges::fill(is_supported, 0);
  std::ranges::fill(depth_m, 0.0);
  for (std::vector<uint32_t>& list : above_) list.clear();
  for (std::vector<Beside>& list : beside_) list.clear();
  for (auto* lists : {&bearings_, &wedging_}) {
    for (std::vector<double>& list : *lists) list.clear();
  }
  const auto is_fixed = [&](uint32_t body) { return model_.bodies[body].role != Role::dynamic; };
  for (const BodyContact& contact : contacts) {
    double touch_m = 0;
    for (const uint32_t body : {contact.a, contact.b}) {
      if (!is_fixed(body)) {
        touch_m =
            std::max(touch_m, kTouchShare * bodies_.shapes[model_.bodies[body].shape].smallest_m);
      }
    }
    if (contact.distance_m > touch_m) continue;
    // Fixed bodies count as one.
    joined_to_[root(is_fixed(contact.a) ? fixed_ : contact.a)] =
        root(is_fixed(contact.b) ? fixed_ : contact.b);
    for (const uint32_t body : {contact.a, contact.b}) {
      if (-contact.distance_m <= depth_m[body]) continue;
      depth_m[body] = -contact.distance_m;
      deepest_in[body] = body == contact.a ? contact.b : contact.a;
    }
    for (const uint32_t body : {contact.a, contact.b}) {
      const double up = body == contact.a ? contact.normal.y() : -contact.normal.y();
      if (up > 0 && !is_fixed(body) && !asleep[body]) {
        note_bearing(body, contact.point, motion[body].position);
      }
    }
    if (std::abs(contact.normal.y()) < kUpward) {
      note_beside(contact.a, contact.b, contact.point, motion);
      note_beside(contact.b, contact.a, contact.point, motion);
      continue;
    }
    const bool a_is_above = contact.normal.y() > 0;
    const uint32_t lower = a_is_above ? contact.b : contact.a;
    const uint32_t upper = a_is_above ? contact.a : contact.b;
    if (is_fixed(upper)) continue;
    above_[lower].push_back(upper);
    if (is_fixed(lower)) on_fixed[upper] = 1;
  }
  queue_.clear();
  for (uint32_t body = 0; body < above_.size(); ++body) {
    if (is_fixed(body) && !(above_[body].empty() && beside_[body].empty())) queue_.push_back(body);
  }
  const auto support = [&](uint32_t body) {
    if (is_supported[body]) return;
    is_supported[body] = 1;
    if (asleep[body]) queue_.push_back(body);
  };
  for (size_t i = 0; i < queue_.size(); ++i) {
    const uint32_t lower = queue_[i];
    for (const uint32_t upper : above_[lower]) support(upper);
    for (const Beside& wedged : beside_[lower]) {
      if (!asleep[wedged.body] || is_supported[wedged.body]) continue;
      wedging_[wedged.body].push_back(wedged.bearing);
      if (surrounded(wedging_[wedged.body])) support(wedged.body);
    }
  }
  for (const uint32_t body : bodies_.dynamic)
    is_balanced[body] = surrounded(bearings_[body]) ? 1 : 0;
  for (const uint32_t body : bodies_.dynamic) grounded[body] = root(body) == root(fixed_) ? 1 : 0;
}

PlausibilityCounts count_implausible(const PileBodies& bodies, const Model& model,
                                     const PileSupport& support,
                                     const std::vector<uint8_t>& asleep) {
  PlausibilityCounts counts;
  for (const uint32_t body : bodies.dynamic) {
    if (!asleep[body]) continue;
    ++counts.asleep;
    if (!support.is_supported[body]) ++counts.hanging;
    const double smallest_m = bodies.shapes[model.bodies[body].shape].smallest_m;
    if (support.depth_m[body] > kInsideShare * smallest_m) ++counts.inside;
  }
  return counts;
}

}  // namespace pilesim
