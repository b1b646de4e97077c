#include "simulate/exact/narrow_phase.h"

#include <algorithm>
#include <cmath>

#include "core/parallel_for.h"

namespace pilesim::exact {
namespace {

// What all but reaches the surface within the step, to this share of its way, bounces in it.
constexpr double kAsGood = 0.01;
// What comes nearer by more than this share of the smaller extent in a step hits hard.
constexpr double kHard = 0.01;
// What turns by more until it touches is advanced to there, rad.
constexpr double kTurnAhead = 0.02;
constexpr size_t kPairGrain = 64;
constexpr size_t kBodyGrain = 256;

// What take(begin, end, list) puts into the lists of its chunks, in their order.
template <typename Take>
void collect(size_t count, size_t grain, std::vector<uint32_t>& collected, const Take& take) {
  std::vector<std::vector<uint32_t>> parts((count + grain - 1) / grain);
  parallel_for(count, grain,
               [&](size_t begin, size_t end) { take(begin, end, parts[begin / grain]); });
  collected.clear();
  for (const std::vector<uint32_t>& part : parts) {
    collected.insert(collected.end(), part.begin(), part.end());
  }
}

}  // namespace

NarrowPhase::NarrowPhase(std::span<const CollisionShape> shapes, EngineState& state, double step_s,
                         const Vec3& gravity)
    : shapes_(shapes),
      bodies_(state.bodies),
      pairs_(state.pairs),
      settings_{step_s, gravity.norm()},
      gravity_(gravity),
      placed_(state.bodies.size()) {}

void NarrowPhase::find(const PairFilter& filter) {
  parallel_for(bodies_.size(), kBodyGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Body& body = bodies_[i];
      if (body.moves != Moves::not_there) placed_[i] = Placed(body, shapes_[body.shape]);
    }
  });
  find_all(filter);
  if (find_again(filter)) {
    touching_.clear();
    for (uint32_t i = 0; i < pairs_.size(); ++i) {
      if (!pairs_[i].contacts.empty()) touching_.push_back(i);
    }
  }
}

void NarrowPhase::find_all(const PairFilter& filter) {
  collect(pairs_.size(), kPairGrain, touching_,
          [&](size_t begin, size_t end, std::vector<uint32_t>& touching) {
            NarrowScratch scratch;
            for (size_t i = begin; i < end; ++i) {
              Pair& pair = pairs_[i];
              const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
              if (!a.may_move() && !b.may_move() && a.moved_m == 0 && b.moved_m == 0) {
                // As it was.
              } else if (filter && !filter(pair.a, pair.b)) {
                pair.contacts.clear();
                pair.slack_m = pair.list_slack_m = -1;  // its bodies move unseen
                pair.pieces.clear();
              } else {
                find_one(pair, scratch);
              }
              if (!pair.contacts.empty()) touching.push_back(static_cast<uint32_t>(i));
            }
          });
}

void NarrowPhase::find_one(Pair& pair, NarrowScratch& scratch) {
  find_contacts(pair, bodies_[pair.a], bodies_[pair.b], placed_[pair.a], placed_[pair.b],
                shape_of(pair.a), shape_of(pair.b), settings_, scratch);
  if (!pair.contacts.empty()) bounce(pair);
}

// Contacts are solved with the inertia and the levers of the moment at which bodies touch. Whether
// there are any that are not there yet.
bool NarrowPhase::find_again(const PairFilter& filter) {
  ahead_s_.assign(bodies_.size(), 0);
  bool any = false;
  for (const uint32_t touching : touching_) {
    const Pair& pair = pairs_[touching];
    for (const Contact& contact : pair.contacts) {
      if (contact.time_s <= 0) continue;
      for (const uint32_t i : {pair.a, pair.b}) {
        const double time_s = contact.time_s;
        if (!bodies_[i].is_awake() || bodies_[i].spin.norm() * time_s < kTurnAhead) continue;
        ahead_s_[i] = ahead_s_[i] > 0 ? std::min(ahead_s_[i], time_s) : time_s;
        any = true;
      }
    }
  }
  if (!any) return false;
  for (uint32_t i = 0; i < bodies_.size(); ++i) {
    if (ahead_s_[i] == 0) continue;
    bodies_[i].moved_m = 0;
    fly(bodies_[i], shape_of(i), gravity_, ahead_s_[i]);
    placed_[i] = Placed(bodies_[i], shape_of(i));
    bodies_[i].velocity -= ahead_s_[i] * gravity_;  // the step's own comes whole
  }
  NarrowScratch scratch;
  for (Pair& pair : pairs_) {
    if (ahead_s_[pair.a] == 0 && ahead_s_[pair.b] == 0) continue;
    if (filter && !filter(pair.a, pair.b)) continue;
    find_one(pair, scratch);
  }
  return true;
}

// A bounce reverses the speed of approach as it was before gravity, at the place where the body
// is: with parabolic steps that keeps the energy. What would not outlive the step's gravity comes
// to rest.
void NarrowPhase::bounce(Pair& pair) const {
  const Body &a = bodies_[pair.a], &b = bodies_[pair.b];
  const double step_s = settings_.step_s;
  const double restitution = std::sqrt(a.restitution * b.restitution);
  const double hard = kHard * smaller_extent(shape_of(pair.a), shape_of(pair.b));
  const double pull = step_s * settings_.gravity;
  const double fastest =
      (a.velocity - b.velocity).norm() + placed_[pair.a].turning_m_s + placed_[pair.b].turning_m_s;
  if (fastest * step_s <= hard && restitution * fastest <= pull) return;
  const Vec3 falls = gravity_ * ((b.is_awake() ? 1 : 0) - (a.is_awake() ? 1 : 0));
  for (Contact& contact : pair.contacts) {
    const Vec3 normal = contact.normal.cast<double>();
    const double speed = normal.dot(velocity_at(b, contact.arm_b.cast<double>()) -
                                    velocity_at(a, contact.arm_a.cast<double>()));
    const double at_end =
        contact.distance_m + speed * step_s + normal.dot(falls) * step_s * step_s / 2;
    if (at_end > -kAsGood * speed * step_s) continue;
    contact.hits = -speed * step_s > hard;
    if (-restitution * speed > pull) contact.bounce = static_cast<float>(-restitution * speed);
  }
}

}  // namespace pilesim::exact
