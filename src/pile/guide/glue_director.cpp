#include "pile/guide/glue_director.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "core/clock.h"
#include "pile/guide/guide_constants.h"
#include "simulate/modes/make_simulator.h"

namespace pilesim {

using namespace guide_constants;

GlueDirector::GlueDirector(const Scene& scene, const Model& model)
    : scene_(scene),
      model_(model),
      guide_(*scene.guide),
      gravity_(scene.gravity.norm()),
      up_(-scene.gravity / std::max(gravity_, std::numeric_limits<double>::min())),
      state_(model.bodies.size()),
      parts_(model.bodies.size()),
      local_(*scene.guide, scene.gravity),
      graph_(model) {
  if (!model.guide.triangles.empty()) shape_.emplace(model.guide);
}

void GlueDirector::direct(ImpulseControl& control) {
  // Contacts are known only after a step; a pile without contacts falls onto its support first.
  const auto period = static_cast<uint64_t>(guide_.period_steps);
  // The filling of a mould may wait for its release.
  const bool waits = model_.moulded && model_.moulded->count > 0 &&
                     model_.bodies[model_.moulded->first].held &&
                     !control.is_in_world(model_.moulded->first);
  if (waits && state_.start == state_.step) ++state_.start;
  const bool is_due = is_starting() || state_.step % period == 0;
  if (state_.step > state_.start && is_due && gravity_ > 0) {
    const Stopwatch watch;
    control_step(control);
    state_.control_s += watch.seconds();
  }
  ++state_.step;
}

void GlueDirector::control_step(ImpulseControl& control) {
  ++state_.control_steps;
  drop_torn(control);
  find_parts(control);
  end_forces(control);
  if (is_analysis_due(control)) {
    control.read_contacts(contacts_);
    judge_each(control);
    analyse(control);
  } else if (is_left_due(control)) {
    control.read_contacts(contacts_);
    analyse_left(control);
  }
}

// `most_speed` in sqrt(g r).
bool GlueDirector::is_slow(const ImpulseControl& control, uint32_t body, double most_speed) const {
  const double radius = model_.shapes[model_.bodies[body].shape].bounding_radius;
  const BodyMotion motion = control.motion(body);
  return motion.linear_velocity.norm() + motion.angular_velocity.norm() * radius <=
         most_speed * std::sqrt(gravity_ * radius);
}

// True for all moving bodies; with a filled mould, only for its filling. Otherwise bodies thrown at
// the pile would count once they rest, and the whole pile would be glued again.
bool GlueDirector::may_be_pile(uint32_t body) const {
  return model_.bodies[body].role == Role::dynamic &&
         (!model_.moulded || model_.moulded->contains(body));
}

void GlueDirector::find_parts(const ImpulseControl& control) {
  state_.counts.in_guide = 0;
  for (uint32_t body = 0; body < parts_.size(); ++body) {
    const ModelBody& source = model_.bodies[body];
    parts_[body] = Part::none;
    if (stands_still(source) ||
        (source.role == Role::dynamic && source.held && !control.is_in_world(body))) {
      parts_[body] = Part::anchor;
    } else if (may_be_pile(body) && control.is_in_world(body) &&
               (!shape_ || shape_->contains(control.motion(body).position))) {
      parts_[body] = Part::pile;
      ++state_.counts.in_guide;
    }
  }
}

bool GlueDirector::is_starting() const {
  return state_.step <= state_.start + static_cast<uint64_t>(guide_.period_steps);
}

// True for a pile with less glue than it needed.
bool GlueDirector::has_slumped(const ImpulseControl& control) const {
  if (!state_.figures || state_.figures->given == 1) return false;
  for (uint32_t body = 0; body < parts_.size(); ++body) {
    const double radius = model_.shapes[model_.bodies[body].shape].bounding_radius;
    if (parts_[body] == Part::pile &&
        (control.motion(body).position - state_.place[body]).norm() > kSlumps * radius) {
      return true;
    }
  }
  return false;
}

// True if resting bodies have not been analysed, or have moved since.
bool GlueDirector::is_analysis_due(const ImpulseControl& control) const {
  const bool all = has_slumped(control);
  bool is_new = false;
  for (uint32_t body = 0; body < parts_.size(); ++body) {
    if (parts_[body] != Part::pile || (!all && state_.covered[body] != 0)) continue;
    is_new = true;
    // The initial state counts as at rest, even where overlaps already push bodies apart.
    const bool is_start = is_starting();
    const double most_speed = all ? kSlumped : guide_.most_speed;
    if (!is_start && !is_slow(control, body, most_speed)) return false;
  }
  return is_new;
}

// Applies the local rule of chapter 6, for the colours in pictures and for comparisons.
void GlueDirector::judge_each(ImpulseControl& control) {
  graph_.build(contacts_);
  state_.counts.passed = state_.counts.filtered = state_.counts.failed = 0;
  for (uint32_t body = 0; body < parts_.size(); ++body) {
    if (parts_[body] != Part::pile) continue;
    const double radius = model_.shapes[model_.bodies[body].shape].bounding_radius;
    const Standing standing =
        local_.standing(control.motion(body).position, radius, graph_.supports(body));
    uint8_t flags = 0;
    if (standing == Standing::passed || standing == Standing::filtered) flags |= kPassed;
    if (standing == Standing::failed || standing == Standing::filtered) flags |= kFailed;
    state_.counts.passed += standing == Standing::passed;
    state_.counts.filtered += standing == Standing::filtered;
    state_.counts.failed += standing == Standing::failed;
    control.mark(body, kPassed | kFailed, flags);
  }
}

// Due once glue has torn or bodies have moved, and the analysed bodies have been at rest for a
// while, except for a few that roll away. Due again when those rest too, if glue was missing.
bool GlueDirector::is_left_due(const ImpulseControl& control) {
  if (!guide_.control || !state_.figures || state_.figures->given < 1) return false;
  const bool has_changed =
      state_.counts.torn > state_.torn_seen || (state_.had_forces && !is_as_analysed());
  if (has_changed) state_.left.reset();  // the earlier result was about another pile
  const bool lacks = state_.left && !stands(*state_.left);
  if (!has_changed && !lacks) return false;
  double seen = 0, moving = 0;
  for (uint32_t body = 0; body < parts_.size(); ++body) {
    if (state_.covered[body] == 0 || !control.is_in_world(body)) continue;
    seen += 1;
    moving += is_slow(control, body, kSlumped) ? 0 : 1;
  }
  const bool is_at_rest =
      has_changed ? moving <= kMostRolling * seen : moving == 0 && seen > state_.left->bodies;
  state_.rest_looks = is_at_rest ? state_.rest_looks + 1 : 0;
  return state_.rest_looks >= kRestLooks;
}

namespace {

// The load on the glue of a pair of bodies.
struct Need {
  Vec3 middle = Vec3::Zero();                       // kg m
  Vec3 pull = Vec3::Zero(), torque = Vec3::Zero();  // kg, kg m about the origin
  double glue_kg = 0, patch_kgm = 0;

  double torque_kgm(const Vec3& about) const {
    return (torque - about.cross(pull)).norm() + patch_kgm;
  }
};

struct Pair {
  Vec3 place = Vec3::Zero();  // position of one of its contacts
  std::vector<Need> needs;    // (cases)
};

std::map<std::pair<uint32_t, uint32_t>, Pair> pairs_of(std::span<const GlueContact> contacts,
                                                       std::span<const GlueSolution> cases) {
  const auto key = [](uint32_t a, uint32_t b) {
    return std::pair<uint32_t, uint32_t>(std::minmax(a, b));
  };
  std::map<std::pair<uint32_t, uint32_t>, Pair> pairs;
  for (size_t c = 0; c < contacts.size(); ++c) {
    const GlueContact& contact = contacts[c];
    Pair& pair = pairs[key(contact.a, contact.b)];
    pair.place = contact.position;
    pair.needs.resize(cases.size());
    for (size_t i = 0; i < cases.size(); ++i) {
      const double glue = cases[i].glue_kg[c];
      const Vec3 pull = (contact.a < contact.b ? -glue : glue) * contact.normal;
      Need& need = pair.needs[i];
      need.middle += glue * contact.position;
      need.pull += pull;
      need.torque += contact.position.cross(pull);
      need.glue_kg += glue;
    }
  }
  for (size_t i = 0; i < cases.size(); ++i) {
    for (const GluePatch& patch : cases[i].patches) {
      pairs[key(patch.a, patch.b)].needs[i].patch_kgm += patch.torque.norm();
    }
  }
  return pairs;
}

}  // namespace

// Mean mass of the pile; 0 if it is empty.
double GlueDirector::mean_kg() const {
  double all_kg = 0, count = 0;
  for (uint32_t body = 0; body < parts_.size(); ++body) {
    if (parts_[body] != Part::pile) continue;
    all_kg += model_.bodies[body].mass_kg;
    ++count;
  }
  return count > 0 ? all_kg / count : 0;
}

// Radius of the smaller body of the two that belongs to the pile; `a` does.
double GlueDirector::radius_of(uint32_t a, uint32_t b) const {
  const double radius = model_.shapes[model_.bodies[a].shape].bounding_radius;
  if (parts_[b] != Part::pile) return radius;
  return std::min(radius, model_.shapes[model_.bodies[b].shape].bounding_radius);
}

// With less glue than the pile needs, fill from below: lower bodies stand without the ones above
// them, but not the reverse.
void GlueDirector::leave_out_highest(std::vector<GlueSpot>& spots) const {
  if (state_.figures->given == 1) return;
  std::ranges::stable_sort(spots, {}, [&](const GlueSpot& spot) { return spot.point.dot(up_); });
  double left = 0;
  for (const GlueSpot& spot : spots) left += state_.figures->given * spot.strength_n;
  const auto out = std::ranges::find_if(spots, [&](const GlueSpot& spot) {
    left -= spot.strength_n;
    return left < 0;
  });
  spots.erase(out, spots.end());
}

// One spot for each pair that needs glue in any load case, as strong as the glue of its contacts
// and its patch together, and as wide as a spot. Old spots are removed.
void GlueDirector::put_on(ImpulseControl& control, std::span<const GlueContact> contacts,
                          std::span<const GlueSolution> cases) {
  for (GlueState::Spot& spot : state_.spots) {
    if (spot.holds) control.remove_constraint(spot.id);
  }
  std::erase_if(state_.spots, [](const GlueState::Spot& spot) { return spot.holds; });
  const double strength = kGlueStrength * gravity_;
  std::vector<GlueSpot> spots;
  for (const auto& [bodies, pair] : pairs_of(contacts, cases)) {
    GlueSpot spot{.a = bodies.first, .b = bodies.second};
    if (parts_[spot.a] != Part::pile) std::swap(spot.a, spot.b);
    const double radius = radius_of(spot.a, spot.b);
    const Need& most = *std::ranges::max_element(pair.needs, {}, &Need::glue_kg);
    spot.point = most.glue_kg > 0 ? Vec3(most.middle / most.glue_kg) : pair.place;
    for (const Need& need : pair.needs) {
      spot.strength_n =
          std::max(spot.strength_n, strength * (need.glue_kg + need.patch_kgm / radius));
      spot.strength_nm = std::max(spot.strength_nm, strength * need.torque_kgm(spot.point));
    }
    spot.strength_nm = std::max(spot.strength_nm, kGlueWidth * radius * spot.strength_n);
    if (spot.strength_n > 0) spots.push_back(spot);
  }
  leave_out_highest(spots);
  const double weight_n = gravity_ * mean_kg();
  for (GlueSpot& spot : spots) {
    const double radius = radius_of(spot.a, spot.b);
    spot.tears_m = kTears * radius;
    spot.tears_rad = kTears;
    const auto arm = [&](uint32_t body) {
      const BodyMotion motion = control.motion(body);
      return Vec3(motion.orientation.conjugate() * (spot.point - motion.position));
    };
    state_.spots.push_back({control.add_glue(spot),
                            {.a = spot.a,
                             .b = spot.b,
                             .b_stands = parts_[spot.b] != Part::pile,
                             .arm = arm(spot.a),
                             .weights = spot.strength_n / weight_n,
                             .from_s = control.time_s()},
                            arm(spot.b),
                            spot.strength_n / gravity_,
                            spot.strength_nm / gravity_});
  }
  state_.counts.glue =
      static_cast<uint32_t>(std::ranges::count(state_.spots, true, &GlueState::Spot::holds));
}

// Ends the lines between bodies that have moved relative to each other since the analysis; ends all
// once so many have ended that the rest carries another load.
void GlueDirector::end_forces(const ImpulseControl& control) {
  const auto has_gone = [&](const PairLine& line) {
    if (!control.is_in_world(line.a)) return true;
    Vec3 way = control.motion(line.a).position - state_.place[line.a];
    if (!line.b_stands) {
      if (!control.is_in_world(line.b)) return true;
      way -= control.motion(line.b).position - state_.place[line.b];
    }
    return way.norm() > kParted * radius_of(line.a, line.b);
  };
  double of_last = 0, gone = 0;
  for (PairLine& line : state_.forces) {
    if (line.from_s < state_.forces.back().from_s) continue;
    if (has_gone(line)) line.until_s = std::min(line.until_s, control.time_s());
    of_last += 1;
    gone += std::isfinite(line.until_s) ? 1 : 0;
  }
  if (gone > kMostGone * of_last) {
    for (PairLine& line : state_.forces) line.until_s = std::min(line.until_s, control.time_s());
  }
}

// True while forces of the last analysis persist.
bool GlueDirector::is_as_analysed() const {
  return std::ranges::any_of(state_.forces,
                             [](const PairLine& line) { return !std::isfinite(line.until_s); });
}

void GlueDirector::drop_torn(const ImpulseControl& control) {
  state_.counts.glue = state_.counts.torn = 0;
  state_.counts.glue_weights = 0;
  for (GlueState::Spot& spot : state_.spots) {
    if (spot.holds && !control.holds(spot.id)) {
      spot.holds = false;
      spot.line.until_s = control.time_s();
    }
    state_.counts.glue += spot.holds ? 1 : 0;
    state_.counts.torn += spot.holds ? 0 : 1;
    if (spot.holds) state_.counts.glue_weights += spot.line.weights;
  }
}

std::vector<PairLine> GlueDirector::glue() const {
  std::vector<PairLine> lines;
  for (const GlueState::Spot& spot : state_.spots) lines.push_back(spot.line);
  return lines;
}

void GlueDirector::load(StateReader& reader) {
  reader(state_);
  const size_t count = model_.bodies.size();
  StateReader::require(state_.covered.size() == count && state_.place.size() == count,
                       "an entry for each body");
  for (const GlueState::Spot& spot : state_.spots) {
    StateReader::require(spot.line.a < count && spot.line.b < count, "glue of bodies");
  }
  for (const PairLine& line : state_.forces) {
    StateReader::require(line.a < count && line.b < count, "forces of bodies");
  }
}

double step_with_guide_s(const Scene& scene, double radius_m) {
  const double longest_s = kLongestStep * std::sqrt(radius_m / scene.gravity.norm());
  return scene.step_s.value_or(std::min(Scene::kFixedStep, longest_s));
}

GlueVerdict judge_start(const Scene& scene, const Model& model) {
  const double radius_m = least_radius_m(model);
  Scene start = scene;
  start.simulator.mode = SimulatorMode::impulse;
  start.guide->control = false;
  // Contacts are known after one step, those with the ground perhaps a few later. A pile without
  // ground falls meanwhile: by little of a body's size.
  start.step_s = std::min(scene.actual_step_s(), step_with_guide_s(scene, radius_m));
  start.frame_rate = 1 / (kStepsOfStart * *start.step_s);
  // Bodies released later are judged in their present pose.
  Model released = model;
  if (released.moulded) {
    for (uint32_t i = 0; i < released.moulded->count; ++i) {
      released.bodies[released.moulded->first + i].held = false;
    }
  }
  GlueDirector director(start, released);
  make_directed_simulator(start, released, static_cast<ImpulseDirector&>(director))->step_frame();
  const std::optional<GlueFigures> figures = director.glue_figures();
  return {!figures || are_found(*figures), director.hanging()};
}

}  // namespace pilesim
