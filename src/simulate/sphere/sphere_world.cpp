#include "simulate/sphere/sphere_world.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "simulate/sphere/structure_radii.h"

namespace pilesim {

using namespace sphere_constants;

SphereWorld::SphereWorld(const Model& model, const BodySignatures& objects,
                         const SphereWorldSettings& settings)
    : model_(model, objects, settings),
      surfaces_(model),
      sleepers_(model_),
      search_(model_, surfaces_),
      solver_(model_),
      rest_(model_, surfaces_) {
  state_.bodies.resize(model.bodies.size());
  step_.place_of.resize(model.bodies.size());
  for (const uint32_t kind : model_.kind_of) {
    state_.radius_m.push_back(model_.kinds[kind].radius_m);
  }
  if (model_.has_structures) state_.radius_m = radii_in_structures(model, state_.radius_m);
}

void SphereWorld::add(uint32_t body, const Pose& pose, const Vec3& velocity, const Vec3& spin,
                      bool asleep) {
  SphereBody& added = state_.bodies[body];
  added = {};
  added.position = pose.position.cast<float>();
  added.orientation = pose.orientation.cast<float>();
  added.velocity = velocity.cast<float>();
  added.spin = spin.cast<float>();
  added.surface_radius_m =
      asleep ? reach_below_at_start_m(model_.model, body) : kind(body).radius_m;
  added.changed = true;
  added.asleep = asleep;
  added.block = asleep && kind(body).block && state_.radius_m[body] < kind(body).radius_m &&
                model_.method(body, body) == PairMethod::statistical;
  for (std::vector<uint32_t>* bodies : {&state_.members, &state_.active}) {
    bodies->insert(std::ranges::lower_bound(*bodies, body), body);
  }
}

void SphereWorld::remove(uint32_t body) {
  wake_near(body);
  std::erase(state_.members, body);
  std::erase(state_.active, body);
  std::erase(state_.woken, body);
  state_.bodies[body].still = false;
}

void SphereWorld::push(uint32_t body, const Vec3& impulse, const std::optional<Vec3>& point) {
  SphereBody& pushed = state_.bodies[body];
  const SphereKind& kind = this->kind(body);
  pushed.velocity += kind.inverse_mass * impulse.cast<float>();
  if (point) {
    const Vec3f arm = point->cast<float>() - pushed.position;
    pushed.spin += kind.inverse_inertia * arm.cross(impulse.cast<float>());
  }
  wake(body);
}

void SphereWorld::put_to_sleep(uint32_t body) {
  SphereBody& sleeper = state_.bodies[body];
  sleeper.asleep = sleeper.put_to_sleep = sleeper.changed = true;
  sleeper.velocity.setZero();
  sleeper.spin.setZero();
}

void SphereWorld::set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) {
  state_.bodies[body].velocity = linear.cast<float>();
  state_.bodies[body].spin = angular.cast<float>();
}

void SphereWorld::set_friction(uint32_t body, double friction) {
  std::vector<float>& roots = state_.root_friction;
  if (roots.empty()) {
    for (const uint32_t kind : model_.kind_of) roots.push_back(model_.kinds[kind].root_friction);
  }
  roots[body] = static_cast<float>(std::sqrt(friction)) * kind(body).object->interlocking;
}

void SphereWorld::step(StageTimer& timer) {
  begin_step(timer);
  end_step(timer);
}

void SphereWorld::begin_step(StageTimer& timer) {
  ++state_.steps;
  SphereSleepers::join_woken(state_);
  size_t awake = 0, blocks = 0;
  for (const uint32_t body : state_.active) {
    if (state_.bodies[body].asleep) continue;
    ++awake;
    if (state_.bodies[body].block) ++blocks;
  }
  is_idle_ = awake == 0;
  solver_.begin_sweeps(is_idle_);
  if (is_idle_) return;
  if (SphereSleepers::is_crowded(awake, state_)) sleepers_.lay_down(state_);
  step_.worth_threads = awake + kBlockWork * blocks > kBodiesForThreads;
  {
    StageTimer::Scope scope(timer, Stage::integration);
    speed_up();
  }
  search(timer);
  if (sleepers_.wake_by_contacts(step_, state_)) {
    SphereSleepers::join_woken(state_);
    search(timer);
  }
  StageTimer::Scope scope(timer, Stage::solver);
  solver_.collide({state_.bodies, state_.radius_m, state_.root_friction, state_.steps}, step_);
}

void SphereWorld::speed_up() {
  const Vec3f change = model_.settings.step_s * model_.settings.gravity;
  step_.mean_velocity.setZero();
  for (const uint32_t body : state_.active) {
    if (!state_.bodies[body].asleep) state_.bodies[body].velocity += change;
    step_.mean_velocity += state_.bodies[body].velocity;
  }
  step_.mean_velocity /= static_cast<float>(state_.active.size());
}

void SphereWorld::search(StageTimer& timer) {
  const SphereContactSearch::Input input{state_.active, state_.bodies, state_.radius_m,
                                         state_.root_friction, state_.kept};
  {
    StageTimer::Scope scope(timer, Stage::broad_phase);
    search_.sort(input, step_);
    search_.gather(input, step_);
  }
  StageTimer::Scope scope(timer, Stage::narrow_phase);
  search_.find_contacts(input, sleepers_.lying(), step_);
}

std::vector<uint32_t> SphereWorld::shared_with_contacts() const {
  std::vector<uint32_t> bodies;
  if (is_idle_) return bodies;
  const auto note = [&](uint32_t body) {
    if (state_.bodies[body].shared) bodies.push_back(body);
  };
  for (const SphereBatch& batch : step_.batches) {
    for (const SphereTouch& touch : batch.touches) {
      note(step_.body[touch.a]);
      if ((touch.other & kSurface) == 0) note(touch.other);
    }
  }
  std::ranges::sort(bodies);
  bodies.erase(std::unique(bodies.begin(), bodies.end()), bodies.end());
  return bodies;
}

void SphereWorld::end_step(StageTimer& timer) {
  state_.are_active_sleepers_sorted = false;
  if (is_idle_) return;
  {
    StageTimer::Scope scope(timer, Stage::solver);
    while (!is_swept()) sweep();
    solver_.separate(state_.bodies, step_);
  }
  {
    StageTimer::Scope scope(timer, Stage::integration);
    rest_.move(step_, state_.bodies, state_.radius_m);
    state_.kept.swap(step_.kept);
    for (const SphereBatch& batch : step_.batches) {
      for (const SphereHit& hit : batch.pushed) wake_hit(hit.body, hit.impulse_ns);
    }
    SphereSleepers::join_woken(state_);
  }
  count_contacts();
}

void SphereWorld::count_contacts() {
  state_.contacts = 0;
  state_.deepest_m = 0;
  for (const SphereBatch& batch : step_.batches) {
    state_.contacts += batch.pressed;
    state_.deepest_m = std::max(state_.deepest_m, batch.deepest_m);
  }
}

namespace {

void require_in_order(const std::vector<uint32_t>& bodies) {
  StateReader::require(std::ranges::adjacent_find(bodies, std::greater_equal()) == bodies.end(),
                       "bodies in ascending order");
}

void require_places(const SleeperSpheres& sleepers) {
  StateReader::require(sleepers.centre.size() == sleepers.body.size() &&
                           sleepers.reach_m.size() == sleepers.body.size(),
                       "a place for each sleeper");
  for (size_t i = 0; i < sleepers.body.size(); ++i) {
    StateReader::require(sleepers.centre[i].allFinite() && std::isfinite(sleepers.reach_m[i]),
                         "places that are finite");
  }
}

// Checks values that are used as indices or converted to one.
void require_sound(const SphereModel& model, const SphereState& state) {
  const size_t count = model.model.bodies.size();
  StateReader::require(state.bodies.size() == count && state.radius_m.size() == count &&
                           (state.root_friction.empty() || state.root_friction.size() == count),
                       "an entry for each body");
  for (const auto* bodies : {&state.members, &state.sleepers.body, &state.active_sleepers.body}) {
    StateReader::require_below(*bodies, count);
  }
  require_in_order(state.members);
  require_in_order(state.active);
  for (const auto* bodies : {&state.active, &state.woken}) {
    for (const uint32_t body : *bodies) {
      StateReader::require(std::ranges::binary_search(state.members, body), "a body in the world");
    }
  }
  require_places(state.sleepers);
  require_places(state.active_sleepers);
  for (size_t i = 0; i < state.kept.size(); ++i) {
    const uint32_t next = state.kept[i].next;
    StateReader::require(next == KeptImpulse::kLast || next < i, "impulses in their order");
  }
  for (const uint32_t i : state.members) {
    const SphereBody& body = state.bodies[i];
    const BodySignature* object = model.kind(i).object;
    StateReader::require(object != nullptr, "members that are dynamic");
    StateReader::require(body.kept == SphereBody::kKeepsNone || body.kept < state.kept.size(),
                         "an impulse that is kept");
    StateReader::require(
        body.rest_target == SphereBody::kNoTarget || body.rest_target < object->rest_targets.size(),
        "a pose of the object");
    StateReader::require(body.position.allFinite() && body.velocity.allFinite() &&
                             body.spin.allFinite() && std::isfinite(state.radius_m[i]),
                         "a state that is finite");
  }
}

}  // namespace

void SphereWorld::load(StateReader& reader) {
  std::vector<SurfaceState> surfaces;
  reader(state_, surfaces);
  require_sound(model_, state_);
  for (const SurfaceState& surface : surfaces) {
    StateReader::require(surface.body < state_.bodies.size(), "a surface of a body");
  }
  surfaces_.set_state(surfaces);
  sleepers_.sort_again(state_);
}

}  // namespace pilesim
