#include "simulate/exact/narrow_phase.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel_for.h"
#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

namespace {

constexpr size_t kPairGrain = 64;
constexpr size_t kPartGrain = 8;
constexpr size_t kBodyGrain = 256;

}  // namespace

NarrowPhase::NarrowPhase(std::span<const CollisionShape> shapes, EngineState& state,
                         const std::vector<uint32_t>& active, const Vec3& gravity,
                         const ModelSurroundings& surroundings)
    : shapes_(shapes),
      state_(state),
      bodies_(state.bodies),
      active_(active),
      settings_{0, gravity.norm(), &surroundings},
      gravity_(gravity),
      posed_(state.bodies.size()),
      motion_bounds_(state.bodies.size()),
      throws_(shapes, state) {
  reload();
}

void NarrowPhase::reload() {
  moving_before_.clear();
  for (uint32_t i = 0; i < bodies_.size(); ++i) motion_bounds_[i] = still(i);
}

MotionBound NarrowPhase::still(uint32_t index) const {
  return {.extent_m = static_cast<float>(shape_of(index).own_extent()), .stands_still = true};
}

void NarrowPhase::pose_bodies() {
  for (const uint32_t i : moving_before_) motion_bounds_[i] = still(i);
  moving_before_ = active_;
  parallel_for(active_.size(), kBodyGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) pose(active_[i]);
  });
}

void NarrowPhase::find(double step_s, const PairFilter& filter) {
  settings_.step_s = step_s;
  advanced_s_.assign(bodies_.size(), 0);
  pose_bodies();
  const size_t pairs = state_.pairs.size(), count = (pairs + kPairGrain - 1) / kPairGrain;
  parts_.resize(std::max(parts_.size(), count));
  for (Part& part : std::span(parts_).subspan(count)) part = {};
  const auto parts = std::span(parts_).first(count);
  parallel_for(pairs, kPairGrain, [&](size_t begin, size_t end) {
    find_part(begin, end, filter, parts[begin / kPairGrain]);
  });
  if (advance(parts)) {
    parallel_for(pairs, kPairGrain, [&](size_t begin, size_t end) {
      find_again(begin, end, filter, parts[begin / kPairGrain]);
    });
  }
  list(parts);
  throws_.find(touching_, step_s);
}

void NarrowPhase::pose(uint32_t index) {
  const Body& body = bodies_[index];
  const CollisionShape& shape = shapes_[body.shape];
  posed_[index] = PosedBody(body, shape);
  motion_bounds_[index] = {body.velocity.cast<float>(),
                           static_cast<float>(PosedBody::turning_m_s_of(body, shape)),
                           body.moved.cast<float>(),
                           static_cast<float>(body.turned_m),
                           static_cast<float>(shape.own_extent()),
                           body.is_awake(),
                           false};
}

// `own`: where it is made, if it is not there yet.
const PosedBody& NarrowPhase::posed(uint32_t index, PosedBody& own) const {
  if (!motion_bounds_[index].stands_still) return posed_[index];
  return own = PosedBody(bodies_[index], shape_of(index));
}

// One after the other, what parts have found.
void NarrowPhase::list(std::span<const Part> parts) {
  std::vector<uint32_t> first_contact;
  size_t contacts = 0;
  touching_.clear();
  still_pairs_ = 0;
  for (const Part& part : parts) {
    still_pairs_ += part.still;
    first_contact.push_back(static_cast<uint32_t>(contacts));
    contacts += part.contacts.size();
    touching_.insert(touching_.end(), part.touching.begin(), part.touching.end());
  }
  state_.contacts.resize(contacts);
  parallel_for(parts.size(), kPartGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      std::ranges::copy(parts[i].contacts, state_.contacts.begin() + first_contact[i]);
      for (const uint32_t t : parts[i].touching) state_.pairs[t].first_contact += first_contact[i];
    }
  });
}

void NarrowPhase::list_touching() {
  touching_.clear();
  for (uint32_t i = 0; i < state_.pairs.size(); ++i) {
    if (state_.pairs[i].contact_count > 0) touching_.push_back(i);
  }
}

void NarrowPhase::find_thrown(const PairFilter& filter) {
  struct Found {
    uint32_t pair;
    std::vector<Contact> contacts;
  };
  while (!throws_.is_none()) {
    std::vector<Found> found;
    for (uint32_t i = 0; i < state_.pairs.size(); ++i) {
      const Pair& pair = state_.pairs[i];
      if (pair.contact_count > 0 || (!throws_.is_thrown(pair.a) && !throws_.is_thrown(pair.b))) {
        continue;
      }
      if (!filter || filter(pair.a, pair.b)) found.push_back({i, {}});
    }
    parallel_for(found.size(), kPartGrain, [&](size_t begin, size_t end) {
      for (Found& of_pair : std::span(found).subspan(begin, end - begin)) {
        find_thrown(state_.pairs[of_pair.pair], of_pair.contacts);
      }
    });
    std::erase_if(found, [](const Found& of_pair) { return of_pair.contacts.empty(); });
    for (const auto& [i, contacts] : found) {
      state_.pairs[i].first_contact = static_cast<uint32_t>(state_.contacts.size());
      state_.pairs[i].contact_count = static_cast<uint32_t>(contacts.size());
      state_.contacts.insert(state_.contacts.end(), contacts.begin(), contacts.end());
    }
    if (!found.empty()) list_touching();
    if (!throws_.spread(touching_)) return;
  }
}

// The faster one is thrown at the other; they bounce as they are.
void NarrowPhase::find_thrown(Pair& pair, std::vector<Contact>& contacts) const {
  const Vec3f &of_a = throws_.velocity(pair.a), &of_b = throws_.velocity(pair.b);
  const bool is_a = of_a.squaredNorm() > of_b.squaredNorm();
  const Vec3f thrown = is_a ? of_a : -of_b;  // of a against b
  MotionBound bound_a = motion_bounds_[pair.a], bound_b = motion_bounds_[pair.b];
  bound_a.velocity += thrown;
  for (MotionBound* bound : {&bound_a, &bound_b}) {
    bound->moved.setZero();
    bound->turned_m = 0;
  }
  if (!may_touch(pair, bound_a, bound_b, settings_)) return;
  PosedBody own_a, own_b;
  const PosedBody &a = posed(pair.a, own_a), &b = posed(pair.b, own_b);
  PosedBody thrown_a = a, thrown_b = b;
  (is_a ? thrown_a : thrown_b).velocity += (is_a ? of_a : of_b).cast<double>();
  thread_local NarrowScratch scratch;
  find_contacts(pair, thrown_a, thrown_b, settings_, {}, contacts, scratch);
  bounce(a, b, std::max(advanced_s_[pair.a], advanced_s_[pair.b]), contacts);
}

void NarrowPhase::find_part(size_t begin, size_t end, const PairFilter& filter, Part& part) {
  part.touching.clear();
  part.contacts.clear();
  part.still = 0;
  part.is_advanced = false;
  std::array<bool, kPairGrain> is_tested{};
  for (size_t i = begin; i < end; ++i) {
    Pair& pair = state_.pairs[i];
    const MotionBound &a = motion_bounds_[pair.a], &b = motion_bounds_[pair.b];
    if (a.stands_still && b.stands_still) {  // as it was
      ++part.still;
      continue;
    }
    const bool look = is_to_be_tested(pair, filter);
    is_tested[i - begin] = look;
    if (!look) pair.contact_count = 0;
    if (!look) continue;
    __builtin_prefetch(pair.pieces.data());
    __builtin_prefetch(&posed_[pair.b].position);
    __builtin_prefetch(&posed_[pair.b].velocity);
  }
  for (size_t i = begin; i < end; ++i) {
    update(static_cast<uint32_t>(i), is_tested[i - begin], state_.contacts_of(state_.pairs[i]),
           part);
  }
}

// Only pairs of bodies that have advanced.
void NarrowPhase::find_again(size_t begin, size_t end, const PairFilter& filter, Part& part) {
  const auto has_advanced = [&](const Pair& pair) {
    return advanced_s_[pair.a] > 0 || advanced_s_[pair.b] > 0;
  };
  const auto pairs = std::span(state_.pairs).subspan(begin, end - begin);
  if (std::ranges::none_of(pairs, has_advanced)) return;
  part.touching.clear();
  thread_local std::vector<Contact> found;  // before some bodies have advanced
  std::swap(part.contacts, found);
  part.contacts.clear();
  for (size_t i = begin; i < end; ++i) {
    Pair& pair = state_.pairs[i];
    bool look = false;
    if (has_advanced(pair)) {
      look = is_to_be_tested(pair, filter);
      if (!look) pair.contact_count = 0;
    }
    update(static_cast<uint32_t>(i), look,
           std::span(found).subspan(pair.first_contact, pair.contact_count), part);
  }
}

// Else its bodies cannot touch in the step.
bool NarrowPhase::is_to_be_tested(Pair& pair, const PairFilter& filter) const {
  if (filter && !filter(pair.a, pair.b)) {
    pair.bound_m = pair.list_bound_m = kUntested;  // its bodies move unseen
    pair.pieces.clear();
    return false;
  }
  return may_touch(pair, motion_bounds_[pair.a], motion_bounds_[pair.b], settings_);
}

// Adds its contacts to those of the part: as they are now, or as they were.
void NarrowPhase::update(uint32_t index, bool is_tested, std::span<const Contact> former,
                         Part& part) {
  Pair& pair = state_.pairs[index];
  const size_t first = part.contacts.size();
  if (is_tested) {
    thread_local NarrowScratch scratch;
    PosedBody own_a, own_b;
    const PosedBody &a = posed(pair.a, own_a), &b = posed(pair.b, own_b);
    if (!reuse_contacts(pair, a, b, settings_, former, part.contacts)) {
      find_contacts(pair, a, b, settings_, former, part.contacts, scratch);
    }
    bounce(a, b, std::max(advanced_s_[pair.a], advanced_s_[pair.b]),
           std::span(part.contacts).subspan(first));
  } else if (!former.empty()) {
    part.contacts.insert(part.contacts.end(), former.begin(), former.end());
  }
  pair.contact_count = static_cast<uint32_t>(part.contacts.size() - first);
  pair.first_contact = 0;
  if (pair.contact_count == 0) return;
  pair.first_contact = static_cast<uint32_t>(first);  // of the part, as yet
  part.touching.push_back(index);
  for (const Contact& contact : std::span(part.contacts).subspan(first)) {
    part.is_advanced = part.is_advanced || contact.time_s > 0;
  }
}

// Contacts are solved with the inertia and the levers of the moment at which bodies touch, and
// among what is there then: what turns until then, or leaves its place, is moved there. Whether
// there is any.
bool NarrowPhase::advance(std::span<const Part> parts) {
  bool any = false;
  for (const Part& part : parts) {
    if (!part.is_advanced) continue;
    for (const uint32_t touching : part.touching) {
      const Pair& pair = state_.pairs[touching];
      for (const Contact& contact :
           std::span(part.contacts).subspan(pair.first_contact, pair.contact_count)) {
        if (contact.time_s <= 0) continue;
        for (const uint32_t i : {pair.a, pair.b}) {
          const double time_s = contact.time_s;
          const Body& body = bodies_[i];
          const double displacement = body.velocity.norm() * time_s;
          const bool stays = displacement <= shapes_[body.shape].own_extent();
          if (!body.is_awake() || (stays && body.spin.norm() * time_s < kLeastTurn)) continue;
          advanced_s_[i] = advanced_s_[i] > 0 ? std::min(advanced_s_[i], time_s) : time_s;
          any = true;
        }
      }
    }
  }
  if (!any) return false;
  for (const uint32_t i : active_) {
    motion_bounds_[i].moved.setZero();
    motion_bounds_[i].turned_m = 0;
    if (advanced_s_[i] == 0) continue;
    bodies_[i].moved.setZero();
    bodies_[i].turned_m = 0;
    fly(bodies_[i], shape_of(i), gravity_, advanced_s_[i]);
    bodies_[i].velocity -= advanced_s_[i] * gravity_;  // the step's own comes whole
    pose(i);
  }
  return true;
}

// A bounce reverses the speed at which bodies touch, some time into the step, and is told as the
// speed that the whole step's gravity turns into what is left of it when the step ends. A bounce
// that would not outlive the step's gravity comes to rest. A body that is not there yet keeps its
// speed until it is.
void NarrowPhase::bounce(const PosedBody& a, const PosedBody& b, double advanced_s,
                         std::span<Contact> contacts) const {
  if (contacts.empty()) return;
  const double step_s = settings_.step_s;
  const double restitution = std::sqrt(a.restitution * b.restitution);
  const double extent = smaller_extent(*a.shape, *b.shape);
  const double hard = kContactMargin * extent;
  const double pull =
      std::max(step_s * settings_.gravity, kRounding * kResolution * extent / step_s);
  const double fastest = (a.velocity - b.velocity).norm() + a.turning_m_s + b.turning_m_s;
  if (fastest * step_s <= hard && restitution * fastest <= pull) return;
  const Vec3 falls = gravity_ * ((b.is_awake ? 1 : 0) - (a.is_awake ? 1 : 0));
  // Whether it comes so near within the step, as a share of its motion; what it does then.
  const auto comes = [&](Contact& contact, double share) {
    const Vec3 normal = contact.normal.cast<double>();
    const double speed = normal.dot(b.velocity + b.spin.cross(contact.arm_b.cast<double>()) -
                                    a.velocity - a.spin.cross(contact.arm_a.cast<double>()));
    const double fall = normal.dot(falls);  // m/s^2
    const double at_end = contact.distance_m + speed * step_s + fall * step_s * step_s / 2;
    const bool hits = !(at_end > -share * speed * step_s);
    const bool is_hard = -speed * step_s > hard, outlives = -restitution * speed > pull;
    if (hits) contact.hits = is_hard;
    if (!outlives && (hits || !is_hard)) return hits;
    const double gap = std::max<double>(0, contact.distance_m);
    const double now = speed + advanced_s * fall;
    const double there = std::sqrt(std::max(0.0, now * now - 2 * fall * gap)) - now;
    const double impact_s =
        gap > 0 && there > 0 ? std::min(2 * gap / there, step_s - advanced_s) : 0;
    const double closing = -now - impact_s * fall;
    const double bounce = restitution * closing - (advanced_s + impact_s) * fall;
    contact.bounce = static_cast<float>(hits ? bounce : -closing);
    contact.impact_s = static_cast<float>(hits ? impact_s : 0);
    return hits;
  };
  // All corners of a face that falls flat hit at once.
  size_t hits = 0;
  for (Contact& contact : contacts) hits += comes(contact, kAsGood) ? 1 : 0;
  if (hits == 0) return;
  if (hits < contacts.size()) {
    for (Contact& contact : contacts) comes(contact, 2 * kAsGood);
  }
  close_gap(a, b, contacts);
}

// Levers of what collides are those of when it touches: with the gap that is left until then
// friction would turn bodies too much. Where one body is not moved by contacts, points lie on the
// other; else both come to where the first points touch, if all do so along the same normal.
void NarrowPhase::close_gap(const PosedBody& a, const PosedBody& b, std::span<Contact> contacts) {
  const Contact& first = *std::ranges::min_element(contacts, {}, &Contact::gap_m);
  const bool both_move = a.is_moved_by_contacts && b.is_moved_by_contacts;
  const bool is_flat = std::ranges::all_of(contacts, [&](const Contact& contact) {
    return contact.normal.dot(first.normal) > kSamePlane;
  });
  if (both_move && !is_flat) return;
  const Vec3f closed = std::max(0.0F, first.gap_m) / 2 * first.normal;
  for (Contact& contact : contacts) {
    const Vec3f half = std::max(0.0F, contact.gap_m) / 2 * contact.normal;
    contact.arm_a += both_move ? -closed : b.is_moved_by_contacts ? half : -half;
    contact.arm_b += both_move ? closed : b.is_moved_by_contacts ? half : -half;
  }
}

}  // namespace pilesim::exact
