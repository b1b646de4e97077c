#include "simulate/mixed/mixed_simulator.h"

#include <algorithm>
#include <cassert>
#include <functional>
#include <string>
#include <type_traits>
#include <vector>

#include "core/error.h"
#include "core/parallel_for.h"
#include "model/kinematic_motion.h"
#include "simulate/dissertation/drawn_world.h"
#include "simulate/exact_engine.h"
#include "simulate/lifecycle.h"
#include "simulate/mixed/drawn_coupling.h"
#include "simulate/mixed/exact_boxes.h"
#include "simulate/mixed/kept_contacts.h"
#include "simulate/mixed/level_of_detail.h"
#include "simulate/mixed/mixed_constants.h"
#include "simulate/mixed/mixed_coupling.h"
#include "simulate/mixed/mixed_figures.h"
#include "simulate/rolling_resistance.h"
#include "simulate/sphere/body_signature.h"
#include "simulate/sphere/dispatch_table.h"
#include "simulate/sphere/sphere_world.h"

namespace pilesim {
namespace {

using namespace mixed_constants;

bool prefers_spheres(const ModelBody& body) {
  return body.role == Role::dynamic && body.preference == Preference::prefer_statistical;
}

// Bodies no pair of which is ever solved.
std::vector<uint32_t> never_solved(const Model& model, const DispatchTable& dispatch) {
  std::vector<uint32_t> bodies;
  if (dispatch.may_solve_spheres()) return bodies;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    const bool stands = body.role != Role::dynamic || body.held;
    if (body.preference != Preference::prefer_statistical) continue;
    if (!stands || !dispatch.may_solve_standing()) bodies.push_back(i);
  }
  return bodies;
}

BodySignatures make_objects(const Model& model, const DispatchTable& dispatch) {
  for (const ModelBody& body : model.bodies) {
    if (!body.hinge || !prefers_spheres(body)) continue;
    throw Error(ErrorKind::input,
                {.found = "'" + body.name + "' has a hinge and is prefer_statistical",
                 .expected = "hinges of must_impulse bodies only in the mixed mode",
                 .remedy = R"(Give the body "preference": "must_impulse")"});
  }
  refuse_rolling_friction(model, prefers_spheres);
  return dispatch.uses(PairMethod::statistical) ? load_signatures(model, prefers_spheres)
                                                : particle_spheres(model);
}

SphereWorldSettings sphere_settings(const Scene& scene, const DispatchTable& dispatch) {
  return {.gravity = scene.gravity.cast<float>(),
          .step_s = static_cast<float>(scene.actual_step_s()),
          .seed = scene.seed,
          .sleeping = scene.simulator.sleeping,
          .rest_control = scene.simulator.rest_control,
          .sweeps = scene.simulator.solver_iterations,
          .dispatch = &dispatch,
          .blocks = scene.simulator.method == Method::own};
}

// This goes from step to step beside the states of both worlds and of the parts below. (B): by body
// of the model.
struct MixedState {
  std::vector<Behaviour> behaviours;  // (B) by set_behaviour(), as the next one
  std::vector<uint8_t> level_set;     // (B) as the dispatch table has it
  std::vector<double> friction;       // (B) by the director, or less than 0; empty: by no one
  KeptContacts kept_contacts;         // by change_with_contacts(), for a director

  static void fields(auto& self, auto& stream) {
    stream(self.behaviours, self.level_set, self.friction, self.kept_contacts);
  }
};

// `World` is SphereWorld with MixedCoupling, or, as the dissertation is written, DrawnWorld with
// DrawnCoupling.
template <class World, class Coupling>
class MixedSimulator final : public Simulator, public BodyControl {
 public:
  MixedSimulator(const Scene& scene, const Model& model, std::unique_ptr<ExactEngine> engine,
                 StepDirector* director);

  FrameStatistics step_frame() override;
  const BodyStates& states() const override { return life_.states(); }
  const Lifecycle& life() const override { return life_; }
  std::vector<std::string> notes() const override { return life_.notes(); }
  std::vector<uint32_t> broken_joints() const override { return exact_.broken_joints(); }
  FrameStatistics statistics() const override;
  std::vector<std::string> signatures() const override {
    return describe_signatures(model_, objects_);
  }
  std::string figures() const override { return figures_.json(); }

  double time_s() const override { return life_.time_s(); }
  double step_s() const override { return life_.step_s(); }
  bool is_in_world(uint32_t body) const override { return life_.is_in_world(body); }
  BodyMotion motion(uint32_t body) const override;
  void put_to_sleep(uint32_t body) override;
  void wake(uint32_t body) override;
  bool is_asleep(uint32_t body) const override;
  void set_velocity(uint32_t body, const Vec3& linear, const Vec3& angular) override;
  void set_friction(uint32_t body, double friction) override;
  void read_contacts(std::vector<BodyContact>& contacts) const override;

  void save(StateWriter& writer) const override;
  void load(StateReader& reader) override;

 private:
  bool has(uint32_t body, uint8_t flags) const { return life_.has(body, flags); }
  bool is_free(uint32_t body) const { return life_.is_free(body); }
  bool is_sphere(uint32_t body) const {
    return is_free(body) && prefers_spheres(model_.bodies[body]);
  }
  bool is_near(uint32_t body) const { return state_.behaviours[body] == Behaviour::near_exact; }

  static constexpr bool kAsWritten = std::is_same_v<World, DrawnWorld>;

  void step();
  void add(uint32_t body);
  void remove(uint32_t body);
  void apply_impulse(uint32_t body, const ModelEvent& event);
  Pose pose_now(uint32_t body) const;
  void move_kinematic_bodies();
  void choose_levels();
  void set_behaviour(uint32_t body, Behaviour behaviour);
  void update_behaviours();
  void change_with_contacts(const std::function<bool(uint32_t body)>& changes,
                            const std::function<void()>& change);
  void switch_engines();
  void wake_hit_bodies();
  bool stands(uint32_t body) const;
  double margin_m(uint32_t body) const;
  bool is_attracted(uint32_t body) const;
  bool stands_on_edge(uint32_t body) const;
  bool is_at_edge(uint32_t body) const;
  void attract_to_edges();
  void read_states();

  const Scene& scene_;
  const Model& model_;
  Lifecycle life_;
  LifeHandlers handlers_;
  DispatchTable dispatch_;
  BodySignatures objects_;
  World spheres_;
  std::unique_ptr<ExactEngine> engine_;
  ExactEngine& exact_;
  Coupling coupling_;
  ExactBoxes boxes_;
  LevelSelector levels_;
  MixedState state_;
  std::vector<uint32_t> kinematic_;
  std::vector<uint32_t> running_;  // bodies with a surface velocity
  std::vector<Behaviour> next_;    // by body: of the spheres, by the last update_behaviours()
  std::vector<uint32_t> edges_;    // near bodies that stand on their edge, by the same
  std::vector<uint32_t> entered_;  // in the step at hand
  std::vector<std::pair<uint32_t, BodyMotion>>
      switched_;  // in it, to either engine, awake; as they were
  MixedFigures figures_;
  StageTimer timer_;
  StepDirector* director_;
};

template <class World, class Coupling>
MixedSimulator<World, Coupling>::MixedSimulator(const Scene& scene, const Model& model,
                                                std::unique_ptr<ExactEngine> engine,
                                                StepDirector* director)
    : scene_(scene),
      model_(model),
      life_(scene, model),
      handlers_{
          .add = [this](uint32_t body) { add(body); },
          .remove = [this](uint32_t body) { remove(body); },
          .push = [this](uint32_t body, const ModelEvent& event) { apply_impulse(body, event); },
          .pose = [this](uint32_t body) { return pose_now(body); }},
      dispatch_(scene.simulator.detail, model),
      objects_(make_objects(model, dispatch_)),
      spheres_(model, objects_, sphere_settings(scene, dispatch_)),
      engine_(std::move(engine)),
      exact_(*engine_),
      coupling_(scene.gravity, life_.step_s(), exact_, spheres_),
      boxes_(model, dispatch_, exact_, !kAsWritten),
      levels_(scene, model),
      state_{.behaviours = std::vector<Behaviour>(model.bodies.size(), Behaviour::exact),
             .level_set = std::vector<uint8_t>(model.bodies.size())},
      next_(model.bodies.size(), Behaviour::statistical),
      figures_(scene, model),
      director_(director) {
  exact_.set_pair_filter(
      [this](uint32_t a, uint32_t b) { return dispatch_.method(a, b) == PairMethod::impulse; });
  exact_.keep_apart(never_solved(model, dispatch_));
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    if (body.role == Role::kinematic && !body.motion.empty()) kinematic_.push_back(i);
    if (body.surface_velocity) running_.push_back(i);
  }
  life_.bring_bodies(handlers_);
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::add(uint32_t body) {
  BodyStates& states = life_.states();
  const ModelBody& source = model_.bodies[body];
  const Pose pose{states.position[body], states.orientation[body]};
  if (is_sphere(body)) {
    states.flags[body] |= kStatistical;
    spheres_.add(body, pose, states.linear_velocity[body], states.angular_velocity[body],
                 source.asleep);
    levels_.choose(time_s(), life_.states(), {&body, 1});
    return set_behaviour(body, Behaviour::statistical);
  }
  const bool is_exact = source.preference == Preference::must_impulse;
  if (source.role == Role::dynamic) states.flags[body] |= kImpulse;
  exact_.add(body,
             {pose.position, pose.orientation, states.linear_velocity[body],
              states.angular_velocity[body]},
             has(body, kHeld), source.asleep);
  if (is_exact) boxes_.add(body);
  if (!is_exact || (!is_free(body) && dispatch_.is_sphere_surface(body))) {
    spheres_.surfaces().place(body, pose, Vec3::Zero(), Vec3::Zero());
  }
  set_behaviour(body, is_exact ? Behaviour::exact : Behaviour::standing);
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::remove(uint32_t body) {
  state_.kept_contacts.forget([&](uint32_t a, uint32_t b) { return a != body && b != body; });
  boxes_.remove(body);
  if (is_near(body)) {
    coupling_.leave(body);
  } else if (exact_.contains(body)) {
    exact_.remove(body);
  }
  if (is_sphere(body)) {
    spheres_.remove(body);
  } else {
    spheres_.wake_near(body);
    spheres_.surfaces().remove(body);
  }
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::apply_impulse(uint32_t body, const ModelEvent& event) {
  if constexpr (!kAsWritten) {
    if (is_near(body) && spheres_.body(body).put_to_sleep) wake(body);
  }
  if (exact_.contains(body)) return exact_.apply_impulse(body, event);
  spheres_.push(body, event.impulse, event.point);
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::move_kinematic_bodies() {
  for (const uint32_t i : kinematic_) {
    if (!has(i, kPresent)) continue;
    exact_.move_by_keys(i, time_s());
    const BodyMotion motion = exact_.motion(i);
    const bool is_surface =
        state_.behaviours[i] == Behaviour::standing || dispatch_.is_sphere_surface(i);
    if (!is_surface) continue;
    spheres_.surfaces().place(i, {motion.position, motion.orientation}, motion.linear_velocity,
                              motion.angular_velocity);
    if (!motion.linear_velocity.isZero() || !motion.angular_velocity.isZero()) {
      spheres_.wake_near(i);
    }
  }
  for (const uint32_t i : running_) {
    if (has(i, kPresent)) spheres_.wake_near(i);
  }
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::choose_levels() {
  if (!levels_.is_variable()) return;
  levels_.choose(time_s(), life_.states(), spheres_.members());
  change_with_contacts([&](uint32_t body) { return levels_.level(body) != state_.level_set[body]; },
                       [&] {
                         for (const uint32_t body : spheres_.members()) {
                           set_behaviour(body, state_.behaviours[body]);
                         }
                       });
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::set_behaviour(uint32_t body, Behaviour behaviour) {
  state_.behaviours[body] = behaviour;
  state_.level_set[body] = static_cast<uint8_t>(levels_.level(body));
  dispatch_.set(body, behaviour, state_.level_set[body]);
}

// By which it may come nearer in the step, and is not to be farther before it leaves.
template <class World, class Coupling>
double MixedSimulator<World, Coupling>::margin_m(uint32_t body) const {
  const auto& sphere = spheres_.body(body);
  const double outer = spheres_.kind(body).outer_m;
  const double way = step_s() * (static_cast<double>(sphere.velocity.norm()) +
                                 outer * static_cast<double>(sphere.spin.norm()) +
                                 step_s() * scene_.gravity.norm());
  const bool lingers = is_near(body) && !kAsWritten;
  return way + (lingers ? kLeaveMargin * outer : 0);
}

template <class World, class Coupling>
bool MixedSimulator<World, Coupling>::is_attracted(uint32_t body) const {
  const auto& sphere = spheres_.body(body);
  if (dispatch_.level(levels_.level(body)).exact) return true;
  if (sphere.asleep && is_near(body)) return true;
  const double outer = spheres_.kind(body).outer_m, margin = margin_m(body);
  const Vec3 centre = sphere.position.template cast<double>();
  if (!boxes_.may_touch(centre, outer + margin, sphere.asleep)) return false;
  return boxes_.touches({.body = body,
                         .pose = {centre, sphere.orientation.template cast<double>().normalized()},
                         .radius_m = outer,
                         .margin_m = margin,
                         .only_moving = sphere.asleep});
}

// A ring that hangs on a pole's tip, but none that tumbles, and no rabbit: they have no edge.
template <class World, class Coupling>
bool MixedSimulator<World, Coupling>::stands_on_edge(uint32_t body) const {
  const SphereKind& kind = spheres_.kind(body);
  const auto& sphere = spheres_.body(body);
  const float speed = sphere.velocity.norm() + kind.outer_m * sphere.spin.norm();
  if (kind.is_round || speed > spheres_.impact_speed(body)) return false;
  const auto ellipsoid = kind.form.placed(sphere.orientation, 1);
  const Vec3f up = -scene_.gravity.normalized().cast<float>();
  return ellipsoid.shortest_m < kOnEdge * ellipsoid.support_m(up);
}

// Whether it may come to lie on one of those that stand so. Sleepers are left where they are.
template <class World, class Coupling>
bool MixedSimulator<World, Coupling>::is_at_edge(uint32_t body) const {
  const auto& sphere = spheres_.body(body);
  if (sphere.asleep && !is_near(body)) return false;
  const double outer = spheres_.kind(body).outer_m + margin_m(body);
  const Vec3f up = -scene_.gravity.normalized().cast<float>();
  return std::ranges::any_of(edges_, [&](uint32_t edge) {
    const Vec3f apart = sphere.position - spheres_.body(edge).position;
    const float distance = apart.norm();
    return distance < outer + spheres_.kind(edge).outer_m && apart.dot(up) > kOverEdge * distance;
  });
}

// A body that comes to lie on the edge of a near body is solved against it: as an ellipsoid it
// would be balanced there.
template <class World, class Coupling>
void MixedSimulator<World, Coupling>::attract_to_edges() {
  edges_.clear();
  for (const uint32_t body : coupling_.bodies()) {
    if (next_[body] == Behaviour::near_exact && stands_on_edge(body)) edges_.push_back(body);
  }
  if (edges_.empty()) return;
  const std::vector<uint32_t>& members = spheres_.members();
  parallel_for(members.size(), 512, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const uint32_t body = members[i];
      const DetailLevel& level = dispatch_.level(levels_.level(body));
      if (level.near_near == PairMethod::impulse && is_at_edge(body)) {
        next_[body] = Behaviour::near_exact;
      }
    }
  });
}

// Algorithm 1: after the broad phase each body that prefers to be a sphere is I' if its box touches
// that of an I body, else S.
template <class World, class Coupling>
void MixedSimulator<World, Coupling>::update_behaviours() {
  entered_.clear();
  switched_.clear();
  const std::vector<uint32_t>& members = spheres_.members();
  if (members.empty()) return;
  boxes_.update();
  parallel_for(members.size(), 512, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      next_[members[i]] = is_attracted(members[i]) ? Behaviour::near_exact : Behaviour::statistical;
    }
  });
  if constexpr (!kAsWritten) attract_to_edges();
  change_with_contacts([&](uint32_t body) { return next_[body] != state_.behaviours[body]; },
                       [&] { switch_engines(); });
  if constexpr (!kAsWritten) wake_hit_bodies();
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::switch_engines() {
  for (const uint32_t body : spheres_.members()) {
    const Behaviour next = next_[body];
    if (next == state_.behaviours[body]) continue;
    const bool is_near_now = next != Behaviour::statistical;
    if (is_near_now != is_near(body) && !is_asleep(body)) {
      switched_.emplace_back(body, motion(body));
    }
    if (is_near_now && !is_near(body)) {
      coupling_.enter(body);
      const double friction = state_.friction.empty() ? -1 : state_.friction[body];
      if (friction >= 0) exact_.set_friction(body, friction);
      entered_.push_back(body);
    } else if (!is_near_now) {
      coupling_.leave(body);
    }
    set_behaviour(body, next);
  }
}

// A structure gives way in the step of the impact: sleeping bodies would stand like a wall in it,
// and keep the momentum that passes through the bodies in between.
template <class World, class Coupling>
void MixedSimulator<World, Coupling>::wake_hit_bodies() {
  bool is_hit = false;
  for (const uint32_t body : coupling_.bodies()) {
    const auto& sphere = spheres_.body(body);
    if (!sphere.asleep || sphere.put_to_sleep) continue;
    const SphereKind& kind = spheres_.kind(body);
    const double impulse_ns =
        boxes_.impulse_bound_ns({.body = body,
                                 .pose = {sphere.position.template cast<double>(),
                                          sphere.orientation.template cast<double>().normalized()},
                                 .radius_m = kind.outer_m,
                                 .margin_m = 0,
                                 .only_moving = true},
                                spheres_.impact_speed(body));
    if (impulse_ns == 0) continue;
    spheres_.wake_hit(body, static_cast<float>(impulse_ns));
    is_hit = true;
  }
  if (is_hit) coupling_.wake();
}

// That other bodies may lie on.
template <class World, class Coupling>
bool MixedSimulator<World, Coupling>::stands(uint32_t body) const {
  if (is_free(body)) return is_asleep(body);
  if (model_.bodies[body].role != Role::kinematic) return true;
  const BodyMotion motion = exact_.motion(body);
  return motion.linear_velocity.isZero() && motion.angular_velocity.isZero();
}

// Sleepers that change engines or levels keep their contacts, for a director.
template <class World, class Coupling>
void MixedSimulator<World, Coupling>::change_with_contacts(
    const std::function<bool(uint32_t body)>& changes, const std::function<void()>& change) {
  if (director_ == nullptr) return change();
  const auto stand = [&](uint32_t a, uint32_t b) { return stands(a) && stands(b); };
  state_.kept_contacts.forget(stand);
  std::vector<uint8_t> changing(states().size());
  for (const uint32_t body : spheres_.members()) {
    changing[body] = is_asleep(body) && changes(body) ? 1 : 0;
  }
  if (std::ranges::count(changing, 1) == 0) return change();
  std::vector<BodyContact> before, after;
  read_contacts(before);
  change();
  read_contacts(after);
  state_.kept_contacts.keep(before, after, [&](uint32_t a, uint32_t b) {
    return stand(a, b) && (changing[a] != 0 || changing[b] != 0);
  });
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::step() {
  coupling_.pull();
  {
    StageTimer::Scope scope(timer_, Stage::broad_phase);
    update_behaviours();
  }
  coupling_.get_ready();
  spheres_.begin_step(timer_);
  coupling_.hand_over();
  figures_.begin_exact_step(exact_, entered_);
  exact_.step(timer_, [] {});
  figures_.end_exact_step(
      exact_, coupling_.bodies(), [this](size_t i) { return coupling_.handed_motion(i); },
      entered_);
  coupling_.take_back();
  spheres_.end_step(timer_);
  coupling_.nudge();
  for (const auto& [body, before] : switched_) figures_.count_switch(before, motion(body));
}

template <class World, class Coupling>
FrameStatistics MixedSimulator<World, Coupling>::step_frame() {
  timer_.take();
  life_.begin_frame();
  choose_levels();
  const int steps = scene_.steps_per_frame();
  for (int i = 0; i < steps; ++i) {
    life_.bring_bodies(handlers_);
    life_.bring_events(handlers_);
    move_kinematic_bodies();
    if (director_ != nullptr) {
      coupling_.pull();
      director_->direct(*this);
    }
    step();
    life_.end_step();
  }
  life_.bring_bodies(handlers_);
  if (director_ != nullptr) {
    coupling_.pull();
    director_->end_frame(*this);
  }
  life_.end_frame();
  read_states();
  figures_.count_frame(life_.states(), [&](uint32_t body) { return levels_.level(body); });
  FrameStatistics statistics = this->statistics();
  statistics.steps = steps;
  statistics.times = timer_.take();
  return statistics;
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::read_states() {
  BodyStates& states = life_.states();
  coupling_.pull();
  for (const uint32_t i : spheres_.members()) {
    auto& sphere = spheres_.body(i);
    const bool near = is_near(i);
    if (!sphere.changed && near == has(i, kImpulse)) continue;
    sphere.changed = false;
    states.flags[i] &= static_cast<uint8_t>(~(kAsleep | kImpulse));
    if (sphere.asleep) states.flags[i] |= kAsleep;
    if (near) states.flags[i] |= kImpulse;
    if (near) continue;
    states.position[i] = sphere.position.template cast<double>();
    states.orientation[i] = sphere.orientation.template cast<double>().normalized();
    states.linear_velocity[i] = sphere.velocity.template cast<double>();
    states.angular_velocity[i] = sphere.spin.template cast<double>();
    life_.check_finite(i);
  }
  for (uint32_t i = 0; i < states.size(); ++i) {
    const ModelBody& body = model_.bodies[i];
    if (!exact_.contains(i) || body.role == Role::fixed) continue;
    const BodyMotion motion = exact_.motion(i);
    if (body.role == Role::dynamic) {
      states.position[i] = motion.position;
      states.orientation[i] = motion.orientation;
    } else if (!body.motion.empty()) {
      const Pose pose = pose_at(model_.shapes[body.shape], body.motion, time_s());
      states.position[i] = pose.position;
      states.orientation[i] = pose.orientation;
    }
    if (!has(i, kHeld)) {
      states.linear_velocity[i] = motion.linear_velocity;
      states.angular_velocity[i] = motion.angular_velocity;
    }
    states.flags[i] &= static_cast<uint8_t>(~kAsleep);
    if (is_free(i) && !exact_.is_active(i)) states.flags[i] |= kAsleep;
    life_.check_finite(i);
  }
}

template <class World, class Coupling>
FrameStatistics MixedSimulator<World, Coupling>::statistics() const {
  const BodyStates& states = life_.states();
  FrameStatistics statistics;
  for (uint32_t i = 0; i < states.size(); ++i) {
    if (!has(i, kPresent)) continue;
    ++statistics.bodies_present;
    if (!is_free(i)) continue;
    if (!has(i, kAsleep)) {
      ++statistics.bodies_awake;
      statistics.kinetic_energy_j +=
          figures_.kinetic_energy_j(i, {states.position[i], states.orientation[i],
                                        states.linear_velocity[i], states.angular_velocity[i]});
    }
    statistics.potential_energy_j -=
        model_.bodies[i].mass_kg * scene_.gravity.dot(states.position[i]);
  }
  exact_.add_contacts_to(statistics);
  statistics.contacts += spheres_.contact_count();
  statistics.deepest_penetration_m =
      std::max<double>(statistics.deepest_penetration_m, spheres_.deepest_penetration_m());
  return statistics;
}

template <class World, class Coupling>
Pose MixedSimulator<World, Coupling>::pose_now(uint32_t body) const {
  const ModelBody& source = model_.bodies[body];
  if (!source.motion.empty()) return pose_at(model_.shapes[source.shape], source.motion, time_s());
  const BodyMotion now = motion(body);
  return {now.position, now.orientation};
}

template <class World, class Coupling>
BodyMotion MixedSimulator<World, Coupling>::motion(uint32_t body) const {
  if (exact_.contains(body)) return exact_.motion(body);
  const auto& sphere = spheres_.body(body);
  return {sphere.position.template cast<double>(),
          sphere.orientation.template cast<double>().normalized(),
          sphere.velocity.template cast<double>(), sphere.spin.template cast<double>()};
}

// I' bodies are in both engines.
template <class World, class Coupling>
void MixedSimulator<World, Coupling>::put_to_sleep(uint32_t body) {
  if (exact_.contains(body)) exact_.put_to_sleep(body);
  if (is_sphere(body)) spheres_.put_to_sleep(body);
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::wake(uint32_t body) {
  if (!is_asleep(body)) return;
  if (exact_.contains(body)) exact_.wake(body);
  if (is_sphere(body)) spheres_.wake(body);
}

template <class World, class Coupling>
bool MixedSimulator<World, Coupling>::is_asleep(uint32_t body) const {
  return exact_.contains(body) ? !exact_.is_active(body) : spheres_.body(body).asleep;
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::set_velocity(uint32_t body, const Vec3& linear,
                                                   const Vec3& angular) {
  if (exact_.contains(body)) return exact_.set_velocity(body, linear, angular);
  spheres_.set_velocity(body, linear, angular);
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::set_friction(uint32_t body, double friction) {
  if (exact_.contains(body)) exact_.set_friction(body, friction);
  if (!is_sphere(body)) return;
  if constexpr (!kAsWritten) spheres_.set_friction(body, friction);
  if (state_.friction.empty()) state_.friction.assign(states().size(), -1);
  state_.friction[body] = friction;
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::read_contacts(std::vector<BodyContact>& contacts) const {
  exact_.read_contacts(contacts);
  if constexpr (!kAsWritten) spheres_.read_contacts(contacts);
  state_.kept_contacts.put_into(contacts);
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::save(StateWriter& writer) const {
  life_.save(writer);
  dispatch_.save(writer);
  spheres_.save(writer);
  exact_.save(writer);
  coupling_.save(writer);
  boxes_.save(writer);
  levels_.save(writer);
  writer(state_, figures_);
  if (director_ != nullptr) director_->save(writer);
}

template <class World, class Coupling>
void MixedSimulator<World, Coupling>::load(StateReader& reader) {
  const size_t levels = figures_.level_count();
  life_.load(reader);
  dispatch_.load(reader);
  spheres_.load(reader);
  exact_.load(reader);
  coupling_.load(reader);
  boxes_.load(reader);
  levels_.load(reader);
  reader(state_, figures_);
  const size_t count = model_.bodies.size();
  StateReader::require(state_.behaviours.size() == count && state_.level_set.size() == count &&
                           (state_.friction.empty() || state_.friction.size() == count),
                       "an entry for each body");
  for (const uint8_t level : state_.level_set) {
    StateReader::require(level < dispatch_.level_count(), "a level of the scene");
  }
  StateReader::require(figures_.level_count() == levels, "a count for each level");
  StateReader::require(state_.kept_contacts.is_of(count), "contacts of bodies of the scene");
  for (uint32_t body = 0; body < count; ++body) {
    StateReader::require(state_.behaviours[body] <= Behaviour::standing, "a behaviour");
    const bool is_shared = std::ranges::binary_search(coupling_.bodies(), body);
    StateReader::require(is_near(body) == is_shared, "each I' body in both worlds");
    const bool is_member = std::ranges::binary_search(spheres_.members(), body);
    StateReader::require(is_member == (is_sphere(body) && has(body, kPresent)),
                         "each sphere that is present in the world of spheres");
    StateReader::require(!has(body, kPresent) || is_member || exact_.contains(body),
                         "each other body that is present in the exact world");
  }
  if (director_ != nullptr) director_->load(reader);
}

}  // namespace

std::vector<ObjectKey> mixed_objects_to_measure(const Scene& scene, const Model& model) {
  const DispatchTable dispatch(scene.simulator.detail, model);
  if (!dispatch.uses(PairMethod::statistical)) return {};
  return objects_to_measure(model, prefers_spheres);
}

std::unique_ptr<Simulator> make_mixed_simulator(const Scene& scene, const Model& model,
                                                std::unique_ptr<ExactEngine> engine,
                                                StepDirector* director) {
  if (scene.simulator.method == Method::dissertation) {
    assert(director == nullptr);  // the scene's checks refuse it
    return std::make_unique<MixedSimulator<DrawnWorld, DrawnCoupling>>(scene, model,
                                                                       std::move(engine), nullptr);
  }
  return std::make_unique<MixedSimulator<SphereWorld, MixedCoupling>>(scene, model,
                                                                      std::move(engine), director);
}

}  // namespace pilesim
