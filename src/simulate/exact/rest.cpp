#include "simulate/exact/rest.h"

#include <algorithm>
#include <cmath>

#include "core/parallel_for.h"
#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

namespace {

constexpr size_t kGrain = 256;

}  // namespace

Rest::Rest(const Model& model, std::span<const CollisionShape> shapes, EngineState& state,
           const std::vector<uint32_t>& active, const Vec3& gravity)
    : shapes_(shapes),
      state_(state),
      bodies_(state.bodies),
      active_(active),
      constants_(model.bodies.size()) {
  const double g = gravity.norm();
  for (size_t i = 0; i < model.bodies.size(); ++i) {
    runs_.push_back(model.bodies[i].surface_velocity ? 1 : 0);
    if (model.bodies[i].role != Role::dynamic) continue;
    const ModelShape& shape = model.shapes[model.bodies[i].shape];
    const Vec3& moments = shapes_[model.bodies[i].shape].moments;
    const double radius = shape.bounding_radius;
    BodyConstants& c = constants_[i];
    c.rest_speed = kRestSpeed * std::sqrt(g * radius);
    c.rest_reach = radius * (moments / moments.maxCoeff()).cwiseSqrt();  // as felt_turn_rate()
    c.time_to_sleep_s = g > 0 ? kRestTime * std::sqrt(radius / g) : 0;
    c.rest_drift_m = kRestDrift * radius;
    c.held_drift_m = kHeldDrift * radius;
    c.rest_depth_m = kRestDepth * shape.smallest_extent;
    c.wedged_depth_m = kWedgedDepth * shape.smallest_extent;
  }
}

// Whether they touch, now or within the step.
bool Rest::touches(const Pair& pair, std::span<const Contact> contacts,
                   const Throws& throws) const {
  const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
  const double near_m = kResolution * smaller_extent(shapes_[a.shape], shapes_[b.shape]);
  return std::ranges::any_of(contacts, [&](const Contact& contact) {
    if (contact.distance_m <= near_m || contact.normal_force_n > 0) return true;
    const Vec3 normal = contact.normal.cast<double>();
    const double closing = normal.dot(velocity_at(a, contact.arm_a.cast<double>()) -
                                      velocity_at(b, contact.arm_b.cast<double>()));
    return contact.distance_m <= near_m + (closing + throws.closing_speed(pair, contact)) * step_s_;
  });
}

bool Rest::joins(uint32_t body) const {
  return bodies_[body].moves == Moves::by_contacts && !bodies_[body].put_to_sleep;
}

bool Rest::wake_driven() {
  bool any = false;
  const auto wake = [&](uint32_t body) {
    if (!bodies_[body].asleep) return;
    wake_up(bodies_[body]);
    any = true;
  };
  for (const Joint& joint : state_.joints) {
    if (!joint.drives()) continue;
    wake(joint.a);
    if (joint.b != Joint::kWorld) wake(joint.b);
  }
  if (std::ranges::find(runs_, 1) == runs_.end()) return any;
  for (const Pair& pair : state_.pairs) {
    if (pair.bound_m > kUntested || pair.contact_count > 0) continue;
    if (runs_[pair.a] != 0) wake(pair.b);
    if (runs_[pair.b] != 0) wake(pair.a);
  }
  return any;
}

bool Rest::wake_islands(double step_s, std::span<const uint32_t> touching, const Throws& throws) {
  step_s_ = step_s;
  const auto runs = [&](uint32_t i) {  // a surface that moves
    const Body& body = bodies_[i];
    return runs_[i] != 0 ||
           (body.moves == Moves::by_keys && !(body.velocity.isZero(0) && body.spin.isZero(0)));
  };
  supports_.assign(bodies_.size(), {});
  islands_.reset(bodies_.size());
  carried_.assign(bodies_.size(), 0);
  linked_.clear();
  links_.resize(touching.size());
  parallel_for(touching.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Pair& pair = state_.pairs[touching[i]];
      const bool of_a = joins(pair.a), of_b = joins(pair.b);
      const bool matters = (of_a && of_b) || (of_a && runs(pair.b)) || (of_b && runs(pair.a));
      links_[i] = !matters || !touches(pair, state_.contacts_of(pair), throws) ? Link::none
                  : of_a && of_b                                               ? Link::both
                  : of_a                                                       ? Link::a_on_b
                                                                               : Link::b_on_a;
    }
  });
  for (size_t i = 0; i < touching.size(); ++i) {
    const Pair& pair = state_.pairs[touching[i]];
    if (links_[i] == Link::both) link(pair.a, pair.b);
    if (links_[i] == Link::a_on_b) carry_along(pair.a);
    if (links_[i] == Link::b_on_a) carry_along(pair.b);
  }
  for (const Joint& joint : state_.joints) {
    const bool of_b = joint.b != Joint::kWorld;
    if (joint.is_of_model()) {  // it holds them as contacts do
      carry(joint.a);
      if (of_b) carry(joint.b);
    }
    // A body that a motor turns does not rest, however slow it is.
    if (joins(joint.a) && (joint.drives() || (of_b && runs(joint.b)))) carry_along(joint.a);
    if (!of_b || !joins(joint.b)) continue;
    if (joins(joint.a)) link(joint.a, joint.b);
    if (joint.drives()) carry_along(joint.b);
  }
  if (!wake_linked()) return false;
  // With what has slept beside it.
  const std::vector<Pair>& resting = state_.resting.pairs;
  links_.resize(resting.size());
  parallel_for(resting.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Pair& pair = resting[i];
      const bool joined =
          joins(pair.a) && joins(pair.b) && touches(pair, state_.resting.contacts_of(pair), throws);
      links_[i] = joined ? Link::both : Link::none;
    }
  });
  for (size_t i = 0; i < resting.size(); ++i) {
    if (links_[i] == Link::both) link(resting[i].a, resting[i].b);
  }
  wake_linked();
  return true;
}

void Rest::link(uint32_t a, uint32_t b) {
  islands_.unite(a, b);
  linked_.insert(linked_.end(), {a, b});
}

void Rest::carry_along(uint32_t body) {
  carried_[body] = 1;
  linked_.push_back(body);
}

// Those with something awake in them; whether anything was woken.
bool Rest::wake_linked() {
  std::vector<uint8_t> woken_sets(bodies_.size(), 0);
  for (const uint32_t i : active_) {
    if (bodies_[i].is_awake()) woken_sets[islands_.find(i)] = 1;
  }
  for (const uint32_t i : linked_) {
    if (carried_[i] != 0) woken_sets[islands_.find(i)] = 1;
  }
  bool any = false;
  for (const uint32_t i : linked_) {
    if (!bodies_[i].asleep || woken_sets[islands_.find(i)] == 0) continue;
    wake_up(bodies_[i]);
    any = true;
  }
  return any;
}

void Rest::note_support(std::span<const uint32_t> touching) {
  loads_.resize(touching.size());
  parallel_for(touching.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Pair& pair = state_.pairs[touching[i]];
      const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
      Load& load = loads_[i] = {};
      if (!a.is_awake() && !b.is_awake()) continue;
      const auto friction = static_cast<float>(kAtLimit * std::sqrt(a.friction * b.friction));
      for (const Contact& contact : state_.contacts_of(pair)) {
        if (contact.normal_force_n <= 0 || contact.bounce > 0) continue;
        ++load.count;
        load.sticks = load.sticks || contact.friction_n.norm() < friction * contact.normal_force_n;
        load.depth_m = std::max(load.depth_m, -contact.distance_m);
      }
    }
  });
  for (size_t t = 0; t < touching.size(); ++t) {
    const Load& load = loads_[t];
    if (load.count == 0) continue;
    const Pair& pair = state_.pairs[touching[t]];
    for (const uint32_t i : {pair.a, pair.b}) {
      Load& support = supports_[i];
      support.sticks = support.sticks || load.sticks;
      support.count += load.count;
      support.depth_m = std::max(support.depth_m, load.depth_m);
    }
  }
}

void Rest::carry(uint32_t body) {
  Load& support = supports_[body];
  support.sticks = true;
  support.count += 2;
}

void Rest::count_rest(uint32_t index) {
  Body& body = bodies_[index];
  const BodyConstants& c = constants_[index];
  const Load& s = supports_[index];
  const bool held = s.sticks && s.count >= 2;
  const Vec3 spin = (body.orientation * shapes_[body.shape].axes).conjugate() * body.spin;
  const double limit2 = c.rest_speed * c.rest_speed;
  const bool slow = body.velocity.squaredNorm() < limit2 &&
                    spin.cwiseProduct(c.rest_reach).squaredNorm() < limit2;
  const bool strays =
      (body.position - body.rest_place).norm() > (held ? c.held_drift_m : c.rest_drift_m);
  if (!slow || s.depth_m > c.wedged_depth_m || strays) {
    body.rest_time_s = 0;
    body.rest_place = body.position;
  } else if (s.count > 0) {
    body.rest_time_s += s.depth_m > c.rest_depth_m ? step_s_ / kWedgedTimes : step_s_;
  }
}

void Rest::end_step(bool may_sleep) {
  std::vector<uint8_t> restless(bodies_.size(), 0);
  for (const uint32_t i : active_) {
    if (!bodies_[i].is_awake()) continue;
    count_rest(i);
    if (!may_sleep || carried_[i] != 0 ||
        !(bodies_[i].rest_time_s > constants_[i].time_to_sleep_s)) {
      restless[islands_.find(i)] = 1;
    }
  }
  for (const uint32_t i : active_) {
    if (bodies_[i].is_awake() && restless[islands_.find(i)] == 0) fall_asleep(bodies_[i]);
  }
}

}  // namespace pilesim::exact
