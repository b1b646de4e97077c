#include "simulate/exact/pair_list.h"

#include <algorithm>
#include <cmath>

#include "core/parallel_for.h"
#include "simulate/exact/exact_constants.h"

namespace pilesim::exact {

using namespace exact_constants;

namespace {

// The order of the trees is made anew after so many steps.
constexpr int kRebuild = 16;
constexpr size_t kGrain = 64;
constexpr WideBox kNothing = {{1, 1, 1}, {-1, -1, -1}};

Bounds box_of(const CollisionShape& shape, const Body& body) {
  const Mat3 turn = body.orientation.toRotationMatrix();
  const Vec3 centre = body.position + turn * shape.box.center();
  const Vec3 half = turn.cwiseAbs() * (shape.box.sizes() / 2);
  return {Vec3(centre - half), Vec3(centre + half)};
}

Bounds wider(const Bounds& box, double by) {
  return {Vec3(box.min().array() - by), Vec3(box.max().array() + by)};
}

// What the box passes on its `way`.
Bounds swept(const Bounds& box, const Vec3& way, double around) {
  return wider(Bounds(Vec3(box.min() + way.cwiseMin(0)), Vec3(box.max() + way.cwiseMax(0))),
               around);
}

}  // namespace

PairList::PairList(std::span<const CollisionShape> shapes, EngineState& state)
    : shapes_(shapes), state_(state) {
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
  std::erase_if(state_.pairs,
                [body](const Pair& pair) { return pair.a == body || pair.b == body; });
  changed_ = true;
}

bool PairList::may_meet(uint32_t a, uint32_t b) const {
  const Body &first = state_.bodies[a], &second = state_.bodies[b];
  if (first.moves != Moves::by_contacts && second.moves != Moves::by_contacts) return false;
  return !(first.kept_apart && second.kept_apart);
}

void PairList::update(double step_s, double gravity) {
  std::vector<uint32_t> moved;
  for (const uint32_t i : present_) {
    const Body& body = state_.bodies[i];
    const bool is_fresh = state_.boxes[i].low[0] > state_.boxes[i].high[0];
    if (!is_fresh && body.stands_still()) continue;
    const CollisionShape& shape = shapes_[body.shape];
    const Bounds tight = box_of(shape, body);
    if (!body.may_move()) {
      const WideBox box = WideBox::around(tight);
      if (!is_fresh && state_.boxes[i].holds(box)) continue;
      state_.boxes[i] = box;
      moved.push_back(i);
      continue;
    }
    const Vec3 way = step_s * body.velocity;
    const double around = step_s * (body.spin.norm() * shape.radius_m + step_s * gravity);
    const double extent = shape.smallest_extent_m;
    const Bounds needed = swept(tight, way, around + kContactMargin * extent);
    const Bounds wide = swept(tight, (1 + kBoxSteps) * way,
                              (1 + kBoxSteps) * around + (kContactMargin + kBoxMargin) * extent);
    if (!is_fresh && state_.boxes[i].holds(WideBox::around(needed)) &&
        WideBox::around(wider(wide, kBoxLoose * extent)).holds(state_.boxes[i])) {
      continue;
    }
    state_.boxes[i] = WideBox::around(wide);
    moved.push_back(i);
  }
  if (changed_ || steps_++ % kRebuild == 0) {
    std::vector<uint32_t> moving, fixed;
    for (const uint32_t i : present_) {
      (state_.bodies[i].moves == Moves::never ? fixed : moving).push_back(i);
    }
    moving_tree_.build(state_.boxes, std::move(moving));
    if (changed_) fixed_tree_.build(state_.boxes, std::move(fixed));
    changed_ = false;
  } else if (!moved.empty()) {
    moving_tree_.refit(state_.boxes);
  }
  found_.clear();
  // A plane that has come meets all that is there.
  for (const uint32_t plane : state_.fresh) {
    if (!shapes_[state_.bodies[plane].shape].is_plane) continue;
    moved = present_;
  }
  state_.fresh.clear();
  if (moved.empty()) return;
  is_moved_.assign(state_.bodies.size(), 0);
  for (const uint32_t i : moved) is_moved_[i] = 1;
  look_up(moved);
  merge();
}

void PairList::look_up(std::span<const uint32_t> moved) {
  std::vector<std::vector<uint64_t>> parts((moved.size() + kGrain - 1) / kGrain);
  parallel_for(moved.size(), kGrain, [&](size_t begin, size_t end) {
    std::vector<uint32_t> near;
    std::vector<uint64_t>& keys = parts[begin / kGrain];
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
          if (normal.dot(lowest - body.position) <= 0) near.push_back(plane);
        }
      }
      for (const uint32_t j : near) {
        if (i == j || !may_meet(i, j)) continue;
        keys.push_back(uint64_t{std::min(i, j)} << 32 | std::max(i, j));
      }
    }
  });
  for (const std::vector<uint64_t>& keys : parts) {
    found_.insert(found_.end(), keys.begin(), keys.end());
  }
  std::ranges::sort(found_);
  found_.erase(std::unique(found_.begin(), found_.end()), found_.end());
}

// Pairs whose boxes have parted go.
void PairList::merge() {
  std::vector<Pair>& merged = merged_;
  merged.clear();
  auto found = found_.begin();
  const auto add = [&](uint64_t key) {
    auto a = static_cast<uint32_t>(key >> 32), b = static_cast<uint32_t>(key);
    const auto stands = [&](uint32_t body) {
      const CollisionShape& shape = shapes_[state_.bodies[body].shape];
      return shape.is_plane || shape.surface != nullptr;
    };
    if (stands(b)) std::swap(a, b);
    merged.push_back({a, b});
  };
  const auto meet = [&](const Pair& pair) {
    if (shapes_[state_.bodies[pair.a].shape].is_plane) return true;
    return state_.boxes[pair.a].meets(state_.boxes[pair.b]);
  };
  for (Pair& pair : state_.pairs) {
    for (; found != found_.end() && *found < pair.key(); ++found) add(*found);
    const bool known = found != found_.end() && *found == pair.key();
    if (known) ++found;
    const bool stays = is_moved_[pair.a] == 0 && is_moved_[pair.b] == 0;
    if (known || stays || meet(pair)) merged.push_back(std::move(pair));
  }
  for (; found != found_.end(); ++found) add(*found);
  std::swap(state_.pairs, merged);
}

}  // namespace pilesim::exact
