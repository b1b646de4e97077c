#include "simulate/sphere/sphere_contact_search.h"

#include <algorithm>
#include <cmath>

#include "simulate/sphere/contact_finder.h"

namespace pilesim {

using namespace sphere_constants;

// Spheres are sorted at mid-step positions. Their reach covers their motion until then, relative to
// the mean motion.
void SphereContactSearch::sort(const Input& input, SphereStep& step) const {
  const size_t count = input.active.size();
  const float half_step = 0.5F * model_.settings.step_s;
  step.body.resize(count);
  step.middle.resize(count);
  std::vector<uint32_t>&waiting = step.waiting, &large = step.large;
  std::vector<Vec3f>& middle = step.sorted_middle;
  std::vector<float>& reach = step.sorted_reach;
  waiting.assign(input.active.begin(), input.active.end());
  uint32_t offset = 0;
  size_t level = 0;
  while (!waiting.empty()) {
    if (step.levels.size() <= level) step.levels.emplace_back();
    SphereStep::Level& here = step.levels[level++];
    middle.resize(waiting.size());
    reach.resize(waiting.size());
    step.share_out(waiting.size(), kBodiesPerTask, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        const uint32_t body = waiting[i];
        const Vec3f& velocity = input.bodies[body].velocity;
        middle[i] = input.bodies[body].position + half_step * velocity;
        reach[i] = model_.reach_m(body, input.bodies[body].block, input.radius_m[body]) +
                   half_step * (velocity - step.mean_velocity).norm();
      }
    });
    here.grid.sort(middle, reach);
    here.offset = offset;
    const std::span<const uint32_t> order = here.grid.order();
    step.share_out(here.grid.small_count(), kBodiesPerTask, [&](size_t begin, size_t end) {
      for (size_t p = begin; p < end; ++p) {
        step.body[offset + p] = waiting[order[p]];
        step.middle.set(offset + p, middle[order[p]], reach[order[p]]);
      }
    });
    offset += static_cast<uint32_t>(here.grid.small_count());
    large.clear();
    for (size_t p = here.grid.small_count(); p < order.size(); ++p) {
      large.push_back(waiting[order[p]]);
    }
    waiting.swap(large);
  }
  step.levels.resize(level);
}

void SphereContactSearch::gather(const Input& input, SphereStep& step) const {
  const size_t count = step.body.size();
  for (auto* places : {&step.kind, &step.last_touch, &step.kept_of}) places->resize(count);
  step.faced.assign(count, 0);
  for (auto* pushes :
       {&step.surface_push, &step.body_push, &step.ground_push, &step.collision_change}) {
    pushes->assign(count, 0.0F);
  }
  step.surface_normal.assign(count, Vec3f::UnitY());
  step.ground_velocity.assign(count, Vec3f::Zero());
  step.centre.resize(count);
  step.motion.resize(count);
  step.shift.resize(count);
  step.radius_m.resize(count);
  step.ellipsoid.resize(count);
  step.share_out(count, kBodiesPerTask, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) {
      const uint32_t index = step.body[p];
      SphereBody& body = input.bodies[index];
      step.kind[p] = model_.kind_of[index];
      step.place_of[index] = static_cast<uint32_t>(p);
      const SphereKind& kind = model_.kinds[step.kind[p]];
      step.centre[p] = body.position;
      step.radius_m[p] = input.radius_m[index];
      step.ellipsoid[p] = model_.ellipsoid(index, body.orientation, input.radius_m[index]);
      // A body that is also solved exactly turns as in the exact engine.
      const bool by_energy = kind.object != nullptr && !body.shared;
      step.motion[p] = {body.velocity, body.asleep ? 0 : kind.inverse_mass,
                        by_energy ? kind.object->spin_of(body.orientation, body.spin) : body.spin,
                        body.asleep ? 0 : kind.inverse_inertia};
      step.shift[p] = {Vec3f::Zero(), step.motion[p].inverse_mass};
      step.last_touch[p] = KeptImpulse::kLast;
      step.kept_of[p] = body.kept;
      body.kept = SphereBody::kKeepsNone;
    }
  });
}

void SphereContactSearch::find_contacts(const Input& input, const SleeperGrid& sleepers,
                                        SphereStep& step) const {
  const SphereGrid& grid = step.levels.front().grid;
  step.colours.resize(SphereGrid::kColours + 1);
  uint32_t count = 0;
  std::vector<uint32_t> block_of;
  for (size_t colour = 0; colour < SphereGrid::kColours; ++colour) {
    step.colours[colour].clear();
    for (const uint32_t block : grid.blocks(colour)) {
      step.colours[colour].push_back(count++);
      block_of.push_back(block);
    }
  }
  step.colours.back() = {count};
  step.batches.resize(count + 1);
  step.share_out(count + 1, 1, [&](size_t begin, size_t end) {
    thread_local std::vector<uint64_t> used, patches_used;
    for (auto* marks : {&used, &patches_used}) {
      if (marks->size() < step.body.size()) marks->resize(step.body.size());
    }
    for (size_t i = begin; i < end; ++i) {
      SphereBatch& batch = step.batches[i];
      batch.contacts.clear();
      batch.patches.clear();
      batch.fixed.assign(1, {});
      batch.touches.clear();
      batch.impacts.clear();
      batch.hit.clear();
      batch.pushed.clear();
      batch.left.clear();
      batch.pressed = 0;
      batch.deepest_m = 0;
      ContactFinder finder(model_, surfaces_, input, sleepers, step, used, patches_used, batch);
      if (i < count) {
        finder.find_of_block(block_of[i]);
      } else {
        finder.find_of_coarse_levels();
      }
      batch.contacts.clear_marks(used);
      batch.patches.clear_marks(patches_used);
    }
  });
  auto rows = static_cast<uint32_t>(step.body.size());
  uint32_t touches = 0;
  for (SphereBatch& batch : step.batches) {
    batch.kept_begin = touches;
    touches += static_cast<uint32_t>(batch.touches.size());
    batch.fixed_begin = rows;
    rows += static_cast<uint32_t>(batch.fixed.size());
  }
  step.motion.resize(rows);
  step.shift.resize(rows);
  step.kept.resize(touches);
}

void SphereContactSearch::read_contacts(const SphereState& state,
                                        std::vector<BodyContact>& contacts) const {
  const std::vector<uint32_t>& members = state.members;
  if (members.empty()) return;
  std::vector<Vec3f> centres;
  std::vector<float> reaches;
  for (const uint32_t body : members) {
    centres.push_back(state.bodies[body].position);
    reaches.push_back(model_.reach_m(body, false, state.radius_m[body]));
  }
  SphereGrid grid;
  grid.sort(centres, reaches);
  const std::span<const uint32_t> order = grid.order();
  const auto meet = [&](uint32_t i, uint32_t j) {
    read_contact(members[std::min(i, j)], members[std::max(i, j)], state, contacts);
  };
  for (size_t colour = 0; colour < SphereGrid::kColours; ++colour) {
    for (const uint32_t block : grid.blocks(colour)) {
      grid.for_each_pair(block, [&](uint32_t p, uint32_t q) { meet(order[p], order[q]); });
    }
  }
  for (size_t p = grid.small_count(); p < order.size(); ++p) {
    const Vec3f around = Vec3f::Constant(reaches[order[p]] + grid.widest_m());
    const Vec3f& centre = centres[order[p]];
    grid.for_each_in(centre - around, centre + around,
                     [&](uint32_t q) { meet(order[p], order[q]); });
    for (size_t q = p + 1; q < order.size(); ++q) meet(order[p], order[q]);
  }
  for (const uint32_t body : members) read_surface_contacts(body, state, contacts);
}

void SphereContactSearch::read_contact(uint32_t a, uint32_t b, const SphereState& state,
                                       std::vector<BodyContact>& contacts) const {
  const Vec3f apart = state.bodies[a].position - state.bodies[b].position;
  const float radius_a = state.radius_m[a], radius_b = state.radius_m[b];
  const auto ellipsoid = [&](uint32_t body, float radius_m) {
    return model_.ellipsoid(body, state.bodies[body].orientation, radius_m);
  };
  const float reach = kNearby * std::min(radius_a, radius_b);
  const std::optional<EllipsoidContact> contact =
      contact_of(ellipsoid(a, radius_a), ellipsoid(b, radius_b), apart, reach);
  if (!contact || contact->gap > reach || !by_spheres(model_.method(a, b))) return;
  const Vec3f point = state.bodies[b].position + contact->arm_b * contact->normal;
  contacts.push_back({.a = a,
                      .b = b,
                      .point = point.cast<double>(),
                      .normal = contact->normal.cast<double>(),
                      .distance_m = contact->gap});
}

void SphereContactSearch::read_surface_contacts(uint32_t body, const SphereState& state,
                                                std::vector<BodyContact>& contacts) const {
  const Vec3f& centre = state.bodies[body].position;
  const SphereKind& kind = model_.kind(body);
  const float reach = kind.outer_m * (1 + kNearby);
  thread_local std::vector<uint32_t> near;
  thread_local std::vector<SurfaceContact> found;
  surfaces_.select({centre, centre}, reach, near);
  found.clear();
  SurfaceProbe probe{.centre = centre,
                     .farthest_m = reach,
                     .near_m = reach,
                     .radius_m = state.bodies[body].surface_radius_m,
                     .orientation = state.bodies[body].orientation};
  for (const uint32_t surface : near) {
    const bool has_extent =
        model_.has_extent(body, state.bodies[body], state.radius_m[body], surfaces_.body(surface));
    probe.hull = has_extent ? &kind.hull : nullptr;
    surfaces_.find(surface, probe, found);
  }
  for (const SurfaceContact& contact : found) {
    if (!by_spheres(model_.method(body, contact.body))) continue;
    const float radius = contact.reach_m;
    if (contact.gap > radius * (1 + kNearby)) continue;
    contacts.push_back({.a = body,
                        .b = contact.body,
                        .point = (centre - contact.gap * contact.normal).cast<double>(),
                        .normal = contact.normal.cast<double>(),
                        .distance_m = contact.gap - radius});
  }
}

}  // namespace pilesim
