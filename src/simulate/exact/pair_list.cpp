#include "simulate/exact/pair_list.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/parallel_for.h"
#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

namespace {

// The tree of what moves is built again when so many boxes have been renewed for each of its
// bodies.
constexpr size_t kRebuild = 4;
constexpr size_t kGrain = 64;
constexpr size_t kBodyGrain = 256;
constexpr size_t kPairGrain = 1024;
constexpr WideBox kNothing = {{1, 1, 1}, {-1, -1, -1}, {0, 0, 0}, 0};

bool is_none(const WideBox& box) { return box.low[0] > box.high[0]; }

Bounds box_of(const CollisionShape& shape, const Body& body) {
  const Mat3 turn = body.orientation.toRotationMatrix();
  const Vec3 centre = body.position + turn * shape.box.center();
  const Vec3 half = turn.cwiseAbs() * (shape.box.sizes() / 2);
  return {Vec3(centre - half), Vec3(centre + half)};
}

// The space that the box sweeps along `displacement`, wider by `around`.
Bounds swept(const Bounds& box, const Vec3& displacement, double around) {
  return {Vec3((box.min() + displacement.cwiseMin(0)).array() - around),
          Vec3((box.max() + displacement.cwiseMax(0)).array() + around)};
}

}  // namespace

PairList::PairList(const Model& model, std::span<const CollisionShape> shapes, EngineState& state,
                   const std::vector<uint32_t>& active)
    : model_(model), shapes_(shapes), state_(state), active_(active) {
  state_.boxes.assign(state.bodies.size(), kNothing);
}

void PairList::reload() {
  planes_.clear();
  present_.clear();
  for (uint32_t i = 0; i < state_.bodies.size(); ++i) {
    const Body& body = state_.bodies[i];
    if (body.moves == Moves::not_there) continue;
    (shapes_[body.shape].is_plane ? planes_ : present_).push_back(i);
  }
  changed_ = true;
  note_resting();
}

void PairList::add(uint32_t body) {
  if (shapes_[state_.bodies[body].shape].is_plane) {
    planes_.insert(std::ranges::lower_bound(planes_, body), body);
  } else {
    present_.insert(std::ranges::lower_bound(present_, body), body);
  }
  state_.boxes[body] = kNothing;
  state_.fresh.push_back(body);
  changed_ = true;
}

void PairList::remove(uint32_t body) {
  std::erase(planes_, body);
  std::erase(present_, body);
  std::erase(state_.fresh, body);
  const auto has_body = [body](const Pair& pair) { return pair.a == body || pair.b == body; };
  if (rests(body)) bring_back_if(has_body);
  std::erase_if(state_.pairs, has_body);
  changed_ = true;
}

bool PairList::may_touch(uint32_t a, uint32_t b) const {
  const Body &first = state_.bodies[a], &second = state_.bodies[b];
  if (first.moves != Moves::by_contacts && second.moves != Moves::by_contacts) return false;
  return !(first.kept_apart && second.kept_apart) && may_collide(model_, a, b);
}

// Whether the body has a new box.
bool PairList::renew(uint32_t i, double step_s, double gravity) {
  const Body& body = state_.bodies[i];
  WideBox& box = state_.boxes[i];
  const bool is_fresh = is_none(box);
  if (!is_fresh && body.stands_still()) return false;
  const CollisionShape& shape = shapes_[body.shape];
  const Bounds tight = box_of(shape, body);
  WideBox renewed;
  if (!body.may_move() && !body.asleep) {
    renewed = WideBox::around(tight, body.position, shape.radius_m);
    if (!is_fresh && box.holds(renewed)) return false;
  } else {
    const Vec3 displacement = step_s * body.velocity;
    const double fall = step_s * step_s * gravity;
    const double turning = step_s * body.spin.norm() * shape.turning_radius_m;
    const double extent = shape.smallest_extent_m;
    // After so many steps, and so much wider.
    const auto reached = [&](double steps, double margin) {
      const Bounds passed = swept(tight, steps * displacement, steps * (turning + fall) + margin);
      const double radius = shape.radius_m + steps * (displacement.norm() / 2 + fall) + margin;
      return WideBox::around(passed, body.position + steps / 2 * displacement, radius);
    };
    const double margin = (kContactMargin + kBoxMargin) * extent;
    if (!is_fresh && box.holds(reached(1, kContactMargin * extent)) &&
        reached(1 + kBoxSteps, margin + kBoxLoose * extent).holds(box)) {
      return false;
    }
    renewed = reached(1 + kBoxSteps, margin);
  }
  former_[i] = box;
  box = renewed;
  is_moved_[i] = 1;
  return true;
}

void PairList::update(double step_s, double gravity) {
  bring_back();
  std::vector<uint32_t> moved = renew_boxes(step_s, gravity);
  renewed_ += moved.size();
  if (changed_ || renewed_ > kRebuild * moving_tree_.size()) {
    build_trees();
  } else {
    moving_tree_.refit(state_.boxes, moved);
  }
  // A plane that has come meets all that is there.
  const bool all = std::ranges::any_of(
      state_.fresh, [&](uint32_t i) { return shapes_[state_.bodies[i].shape].is_plane; });
  if (all) {
    moved = present_;
    // Pairs that are known are found again, and left out where they are listed.
    bring_back_if([](const Pair&) { return true; });
  }
  state_.fresh.clear();
  if (moved.empty()) return;
  look_up(moved, all);
  merge();
}

// Those that are new, ascending.
std::vector<uint32_t> PairList::renew_boxes(double step_s, double gravity) {
  former_.resize(state_.bodies.size());
  is_moved_.assign(state_.bodies.size(), 0);
  std::vector<uint32_t> fresh = state_.fresh, bodies;
  std::ranges::sort(fresh);
  std::ranges::set_union(active_, fresh, std::back_inserter(bodies));
  std::erase_if(bodies, [&](uint32_t i) { return shapes_[state_.bodies[i].shape].is_plane; });
  std::vector<std::vector<uint32_t>> parts((bodies.size() + kBodyGrain - 1) / kBodyGrain);
  parallel_for(bodies.size(), kBodyGrain, [&](size_t begin, size_t end) {
    for (size_t m = begin; m < end; ++m) {
      if (renew(bodies[m], step_s, gravity)) parts[begin / kBodyGrain].push_back(bodies[m]);
    }
  });
  std::vector<uint32_t> moved;
  for (const std::vector<uint32_t>& part : parts) {
    moved.insert(moved.end(), part.begin(), part.end());
  }
  return moved;
}

void PairList::build_trees() {
  std::vector<uint32_t> moving, fixed;
  for (const uint32_t i : present_) {
    (state_.bodies[i].moves == Moves::never ? fixed : moving).push_back(i);
  }
  moving_tree_.build(state_.boxes, std::move(moving));
  if (changed_) fixed_tree_.build(state_.boxes, std::move(fixed));
  changed_ = false;
  renewed_ = 0;
}

// Whether their boxes overlapped before they were renewed: then the pair is listed.
bool PairList::is_known(uint32_t i, uint32_t j) const {
  const WideBox& box_i = is_moved_[i] != 0 ? former_[i] : state_.boxes[i];
  const WideBox& box_j = is_moved_[j] != 0 ? former_[j] : state_.boxes[j];
  return !is_none(box_i) && !is_none(box_j) && box_i.overlaps(box_j);
}

// `all`: boxes are none the newer for it.
void PairList::look_up(std::span<const uint32_t> moved, bool all) {
  std::vector<std::vector<uint64_t>> parts((moved.size() + kGrain - 1) / kGrain);
  parallel_for(moved.size(), kGrain, [&](size_t begin, size_t end) {
    std::vector<uint32_t> near;
    std::vector<uint64_t>& keys = parts[begin / kGrain];
    const auto add = [&](uint32_t i, uint32_t j) {
      keys.push_back(uint64_t{std::min(i, j)} << 32 | std::max(i, j));
    };
    for (size_t m = begin; m < end; ++m) {
      const uint32_t i = moved[m];
      near.clear();
      moving_tree_.find(state_.boxes[i], near);
      if (state_.bodies[i].moves == Moves::by_contacts) {
        fixed_tree_.find(state_.boxes[i], near);
        for (const uint32_t plane : planes_) {
          const Body& body = state_.bodies[plane];
          const Vec3 normal = body.orientation * Vec3::UnitY();
          Vec3 lowest;
          for (int k = 0; k < 3; ++k) {
            const auto e = static_cast<size_t>(k);
            lowest[k] = normal[k] > 0 ? state_.boxes[i].low[e] : state_.boxes[i].high[e];
          }
          if (normal.dot(lowest - body.position) <= 0 && may_touch(i, plane)) add(i, plane);
        }
      }
      for (const uint32_t j : near) {
        if (i == j || !state_.boxes[i].overlaps(state_.boxes[j])) continue;
        if ((all || !is_known(i, j)) && may_touch(i, j)) add(i, j);
      }
    }
  });
  found_.clear();
  for (const std::vector<uint64_t>& keys : parts) {
    found_.insert(found_.end(), keys.begin(), keys.end());
  }
  std::ranges::sort(found_);
  found_.erase(std::unique(found_.begin(), found_.end()), found_.end());
}

// Pairs whose boxes have parted go, those that were found come.
void PairList::merge() {
  std::vector<Pair>& pairs = state_.pairs;
  const size_t parts = std::max<size_t>(1, (pairs.size() + kPairGrain - 1) / kPairGrain);
  const auto stays = [&](const Pair& pair) {
    if (is_moved_[pair.a] == 0 && is_moved_[pair.b] == 0) return true;
    if (shapes_[state_.bodies[pair.a].shape].is_plane) return true;
    return state_.boxes[pair.a].overlaps(state_.boxes[pair.b]);
  };
  // Visits those of a part in their order: pairs that stay, keys of new ones.
  const auto visit = [&](size_t part, const auto& keep, const auto& add) {
    const auto found_from = [&](size_t of_part) {
      if (of_part == 0) return found_.begin();
      if (of_part == parts) return found_.end();
      return std::ranges::lower_bound(found_, pairs[of_part * kPairGrain].key());
    };
    auto found = found_from(part);
    const auto found_end = found_from(part + 1);
    const size_t end = std::min(pairs.size(), (part + 1) * kPairGrain);
    for (size_t i = part * kPairGrain; i < end; ++i) {
      const uint64_t key = pairs[i].key();
      for (; found != found_end && *found < key; ++found) add(*found);
      if (found != found_end && *found == key) ++found;
      if (stays(pairs[i])) keep(pairs[i]);
    }
    for (; found != found_end; ++found) add(*found);
  };
  std::vector<size_t> first(parts + 1, 0);
  std::vector<uint8_t> is_changed(parts, 0);
  parallel_for(parts, 1, [&](size_t part, size_t) {
    size_t kept = 0, added = 0;
    visit(
        part, [&](const Pair&) { ++kept; }, [&](uint64_t) { ++added; });
    first[part + 1] = kept + added;
    is_changed[part] = added > 0 || kept < std::min(kPairGrain, pairs.size() - part * kPairGrain);
  });
  if (std::ranges::count(is_changed, 0) == static_cast<std::ptrdiff_t>(parts)) return;
  std::partial_sum(first.begin(), first.end(), first.begin());
  make_room(first.back());
  const auto stands = [&](uint32_t body) {
    const CollisionShape& shape = shapes_[state_.bodies[body].shape];
    return shape.is_plane || shape.surface != nullptr;
  };
  parallel_for(parts, 1, [&](size_t part, size_t) {
    auto next = merged_.begin() + static_cast<std::ptrdiff_t>(first[part]);
    visit(
        part, [&](Pair& pair) { *next++ = std::move(pair); },
        [&](uint64_t key) {
          auto a = static_cast<uint32_t>(key >> 32), b = static_cast<uint32_t>(key);
          if (stands(b)) std::swap(a, b);
          *next++ = {a, b};
        });
  });
  std::swap(pairs, merged_);
}

bool PairList::is_still(const Pair& pair) const {
  return state_.bodies[pair.a].stands_still() && state_.bodies[pair.b].stands_still();
}

void PairList::note_resting() {
  rests_.assign(state_.bodies.size(), 0);
  for (const Pair& pair : state_.resting.pairs) rests_[pair.a] = rests_[pair.b] = 1;
  resting_contacts_ = {};
  resting_contacts_.add(state_.resting.contacts);
}

// Not for twice as many, as a vector would.
void PairList::make_room(size_t pairs) {
  if (merged_.capacity() < pairs) {
    std::vector<Pair>().swap(merged_);
    merged_.reserve(pairs + pairs / 8);
  }
  merged_.resize(pairs);
}

// Both by key; `more` is of no use after.
void PairList::put_in(std::vector<Pair>& more, std::vector<Pair>& pairs) {
  make_room(pairs.size() + more.size());
  std::merge(std::move_iterator(pairs.begin()), std::move_iterator(pairs.end()),
             std::move_iterator(more.begin()), std::move_iterator(more.end()), merged_.begin(),
             [](const Pair& a, const Pair& b) { return a.key() < b.key(); });
  std::swap(pairs, merged_);
}

void PairList::bring_back_if(const auto& comes) {
  RestingPairs& resting = state_.resting;
  std::vector<Pair> back;
  std::vector<Contact> left;
  left.reserve(resting.contacts.size());
  const auto take = [](Pair& pair, std::span<const Contact> from, std::vector<Contact>& to) {
    const auto first = static_cast<uint32_t>(to.size());
    to.insert(to.end(), from.begin(), from.end());
    pair.first_contact = first;
  };
  size_t kept = 0;
  for (Pair& pair : resting.pairs) {
    const std::span<const Contact> contacts = resting.contacts_of(pair);
    if (comes(pair)) {
      take(pair, contacts, state_.contacts);
      back.push_back(std::move(pair));
    } else {
      take(pair, contacts, left);
      if (&resting.pairs[kept] != &pair) resting.pairs[kept] = std::move(pair);
      ++kept;
    }
  }
  resting.pairs.resize(kept);
  resting.contacts = std::move(left);
  put_in(back, state_.pairs);
  note_resting();
}

bool PairList::bring_back() {
  const auto is_woken = [&](uint32_t body) { return rests(body); };
  if (state_.resting.pairs.empty() || std::ranges::none_of(active_, is_woken)) return false;
  bring_back_if([&](const Pair& pair) { return !is_still(pair); });
  return true;
}

void PairList::set_aside(size_t still) {
  const double pairs = static_cast<double>(state_.pairs.size());
  if (still == 0 || static_cast<double>(still) < kShareToRest * pairs) return;
  std::vector<Pair> resting;
  std::vector<Contact> left;
  resting.reserve(still);
  left.reserve(state_.contacts.size());
  size_t kept = 0;
  for (Pair& pair : state_.pairs) {
    const bool rests = is_still(pair);
    std::vector<Contact>& to = rests ? state_.resting.contacts : left;
    const std::span<const Contact> contacts = state_.contacts_of(pair);
    pair.first_contact = static_cast<uint32_t>(to.size());
    to.insert(to.end(), contacts.begin(), contacts.end());
    if (rests) {
      resting.push_back(std::move(pair));
    } else {
      if (&state_.pairs[kept] != &pair) state_.pairs[kept] = std::move(pair);
      ++kept;
    }
  }
  state_.pairs.resize(kept);
  state_.contacts = std::move(left);
  put_in(resting, state_.resting.pairs);
  note_resting();
}

}  // namespace pilesim::exact
