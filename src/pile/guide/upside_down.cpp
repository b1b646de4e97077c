#include "pile/guide/upside_down.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numeric>
#include <optional>
#include <span>
#include <utility>

#include "core/error.h"
#include "core/philox.h"
#include "geometry/inside_test.h"
#include "geometry/mass_properties.h"
#include "model/keep_bodies.h"
#include "pile/guide/guide_constants.h"
#include "pile/guide/mould.h"
#include "pile/guide/vessel.h"
#include "simulate/body_control.h"
#include "simulate/modes/make_simulator.h"

namespace pilesim {
namespace {

using namespace guide_constants;

// Puts bodies at rest to sleep for good: a vessel full of bodies that tremble under new arrivals
// takes ten times as long and packs no better.
class Settling final : public StepDirector {
 public:
  Settling(size_t bodies, double slow, double radius_m)
      : looks_(bodies), slow_(slow), radius_m_(radius_m) {}

  void direct(BodyControl& control) override {
    if (step_++ % kLookSteps != 0) return;
    for (uint32_t body = 0; body < looks_.size(); ++body) {
      if (!control.is_in_world(body) || looks_[body] == kLooks) continue;
      const BodyMotion motion = control.motion(body);
      const bool is_slow =
          motion.linear_velocity.norm() + radius_m_ * motion.angular_velocity.norm() < slow_;
      looks_[body] = is_slow ? looks_[body] + 1 : 0;
      if (looks_[body] == kLooks) control.put_to_sleep(body);
    }
  }
  bool lies(uint32_t body) const { return looks_[body] == kLooks; }

 private:
  uint64_t step_ = 0;
  std::vector<int> looks_;  // (B) consecutive checks at which it was slow
  double slow_;             // m/s
  double radius_m_;
};

// The world upside down: the vessel and the bodies that fall into it.
class Fill {
 public:
  Fill(const Scene& scene, const Model& model);
  GuideFilling run();
  // Poses of the bodies inside, with their indices, from the base up.
  std::vector<std::pair<uint32_t, Pose>> kept() const;

 private:
  bool is_full() const;
  bool all_lie() const;
  double lowest_point(uint32_t body) const;  // upwards, m

  const Model& model_;
  GuideFill fill_;
  Vec3 up_;
  double gravity_;
  double radius_ = 0;  // largest of the bodies, m
  Vessel vessel_;
  Scene upside_down_;
  Model dropped_;  // body 0 is the vessel
  std::optional<Settling> settling_;
  std::unique_ptr<Simulator> simulator_;
};

Fill::Fill(const Scene& scene, const Model& model)
    : model_(model),
      fill_(*model.guide_fill),
      up_(-scene.gravity.normalized()),
      gravity_(scene.gravity.norm()) {
  const auto bodies = std::span(model.bodies).subspan(fill_.first, fill_.count);
  double thickness = std::numeric_limits<double>::infinity(), volume = 0;
  for (const ModelBody& body : bodies) {
    const ModelShape& shape = model.shapes[body.shape];
    radius_ = std::max(radius_, shape.bounding_radius);
    thickness = std::min(thickness, shape.smallest_extent);
    volume += shape.mass.volume_m3;
  }
  vessel_ = open_guide(model.guide, up_, (kDropBelow + 2) * radius_);
  if (vessel_.base.empty()) {
    throw Error(ErrorKind::input,
                Problem{.file = scene.guide->file_name(),
                        .pointer = "/guide",
                        .found = "has no level base for bodies to be dropped in through",
                        .expected = "triangles in the mesh's lowest level",
                        .remedy = "Cut it off level at the base of the pile"});
  }
  upside_down_ = scene;
  upside_down_.gravity = -scene.gravity;
  upside_down_.guide.reset();
  upside_down_.step_s = filling_step_s(scene, radius_);
  upside_down_.simulator = {};
  dropped_.crowded = true;  // the filling sets its own interval
  dropped_.materials = model.materials;
  for (Material& material : dropped_.materials) {
    material.friction *= kSlippery;
    material.rolling_friction *= kSlippery;
    material.spinning_friction *= kSlippery;
  }
  dropped_.shapes = model.shapes;
  ModelShape& walls = dropped_.shapes.emplace_back();
  walls.name = "guide";
  walls.mesh = vessel_.walls;
  walls.collides_as_mesh = true;
  walls.smallest_extent = thickness;
  ModelBody vessel{.name = "guide",
                   .shape = static_cast<uint32_t>(model.shapes.size()),
                   .material = bodies.front().material};
  vessel.role = Role::fixed;
  vessel.linear_velocity = vessel.angular_velocity = Vec3::Zero();
  dropped_.bodies.push_back(std::move(vessel));

  // Bounding spheres of long bodies may overlap, those of compact ones not.
  const double size = std::sqrt(radius_ * std::cbrt(volume / static_cast<double>(fill_.count)));
  const double abreast = std::max(1.0, std::floor(vessel_.base_m2 / (4 * kPi * radius_ * radius_)));
  const Vec3 speed = kDropSpeed * std::sqrt(gravity_ * radius_) * up_;
  const double interval_s = 2 * size / (speed.norm() * abreast);
  for (uint32_t i = 0; i < fill_.count; ++i) {
    ModelBody body = bodies[i];
    const uint64_t key = uint64_t{fill_.emitter} << 32 | i;
    body.pose.position = drop_point(vessel_, radius_, {scene.seed, Stream::emitter, key}) -
                         kDropBelow * radius_ * up_;
    body.linear_velocity = speed;
    body.start_s = i == 0 ? kFromTheStart : i * interval_s;
    dropped_.bodies.push_back(std::move(body));
  }
  settling_.emplace(dropped_.bodies.size(), kSlow * std::sqrt(gravity_ * radius_), radius_);
  simulator_ = make_directed_simulator(upside_down_, dropped_, *settling_);
}

bool Fill::is_full() const {
  const BodyStates& states = simulator_->states();
  int lie = 0;
  for (uint32_t body = 1; body < states.size(); ++body) {
    const bool is_out = states.position[body].dot(up_) < vessel_.level_m - kFullBelow * radius_;
    lie += (states.flags[body] & kPresent) != 0 && is_out && settling_->lies(body) ? 1 : 0;
  }
  return lie >= kFullBodies;
}

bool Fill::all_lie() const {
  for (uint32_t body = 1; body < dropped_.bodies.size(); ++body) {
    if (!settling_->lies(body)) return false;
  }
  return true;
}

GuideFilling Fill::run() {
  const double end_s = std::max(0.0, dropped_.bodies.back().start_s) +
                       kSettle * std::sqrt(vessel_.height_m / gravity_);
  GuideFilling filling;
  do {
    simulator_->step_frame();
    filling.simulated_s += 1 / upside_down_.frame_rate;
  } while (filling.simulated_s < end_s && !is_full() && !all_lie());
  filling.dropped = static_cast<uint32_t>(
      std::ranges::count_if(simulator_->states().flags,
                            [](uint8_t flags) { return (flags & kPresent) != 0; }) -
      1);
  return filling;
}

double Fill::lowest_point(uint32_t body) const {
  const BodyStates& states = simulator_->states();
  const ModelShape& shape = dropped_.shapes[dropped_.bodies[body].shape];
  const double centre = states.position[body].dot(up_);
  if (shape.mesh.vertices.empty()) return centre - shape.bounding_radius;
  const Vec3 up = states.orientation[body].conjugate() * up_;
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vec3& vertex : shape.mesh.vertices) lowest = std::min(lowest, vertex.dot(up));
  return centre + lowest;
}

std::vector<std::pair<uint32_t, Pose>> Fill::kept() const {
  const BodyStates& states = simulator_->states();
  const InsideTest inside(model_.guide);
  std::vector<std::pair<uint32_t, Pose>> kept;
  double lowest = std::numeric_limits<double>::infinity();
  for (uint32_t body = 1; body < states.size(); ++body) {
    if ((states.flags[body] & kPresent) == 0) continue;
    const double low = lowest_point(body);
    if (low < vessel_.level_m - kPoke * radius_ || !inside.contains(states.position[body]))
      continue;
    lowest = std::min(lowest, low);
    kept.emplace_back(body - 1, Pose{states.position[body], states.orientation[body]});
  }
  std::ranges::stable_sort(kept, {}, [&](const auto& one) { return one.second.position.dot(up_); });
  // Bodies that stood out of the base are gone: move the others down to it.
  for (auto& [body, pose] : kept) pose.position -= (lowest - vessel_.level_m) * up_;
  return kept;
}

void take_out(std::span<const uint32_t> gone, Model& model) {
  std::vector<bool> stays(model.bodies.size(), true);
  for (const uint32_t body : gone) stays[body] = false;
  keep_bodies(stays, model);
}

// Removes bodies that only the mould held, and numbers the names of the others consecutively.
void leave_out(const std::vector<uint32_t>& hanging, uint32_t first, const TriangleMesh& guide,
               Model& model, GuideFilling& filling) {
  filling.hanging = static_cast<uint32_t>(hanging.size());
  double volume = 0;
  for (const uint32_t body : hanging)
    volume += model.shapes[model.bodies[body].shape].mass.volume_m3;
  filling.volume_share -= volume / mass_properties(guide).volume_m3;
  std::vector<std::string> names;
  for (uint32_t i = 0; i < filling.kept; ++i) names.push_back(model.bodies[first + i].name);
  filling.kept -= filling.hanging;
  take_out(hanging, model);
  for (uint32_t i = 0; i < filling.kept; ++i) model.bodies[first + i].name = names[i];
}

void release(double time_s, uint32_t body, Model& model) {
  model.bodies[body].held = true;
  if (!model.events.empty() && model.events.back().kind == ModelEvent::Kind::release &&
      model.events.back().time_s == time_s) {
    model.events.back().bodies.push_back(body);
  } else {
    model.events.push_back({time_s, ModelEvent::Kind::release, {body}, Vec3::Zero(), {}});
  }
}

GuideFilling fill_once(const Scene& scene, Model& model, uint32_t attempt) {
  const GuideFill range = *model.guide_fill;
  GuideFilling filling;
  std::vector<std::pair<uint32_t, Pose>> kept;
  if (range.is_mould) {
    MouldFilling filled = fill_mould(scene, model, attempt);
    filling = filled.figures;
    kept = std::move(filled.kept);
  } else {
    Fill fill(scene, model);
    filling = fill.run();
    kept = fill.kept();
  }
  if (kept.empty()) {
    throw Error(
        ErrorKind::input,
        Problem{.pointer = "/emitters/" + std::to_string(range.emitter),
                .found = "leaves no body within the guide",
                .expected = range.is_mould ? "bodies that fit into it"
                                           : "bodies that fit through its base and into it"});
  }
  filling.kept = static_cast<uint32_t>(kept.size());
  const std::vector<ModelBody> before(model.bodies.begin() + range.first,
                                      model.bodies.begin() + range.first + range.count);
  double volume = 0;
  for (uint32_t i = 0; i < filling.kept; ++i) {
    ModelBody& body = model.bodies[range.first + i];
    body = before[kept[i].first];
    body.name = before[i].name;
    body.pose = kept[i].second;
    body.start_s = kFromTheStart;
    volume += model.shapes[body.shape].mass.volume_m3;
  }
  filling.volume_share = volume / mass_properties(model.guide).volume_m3;
  std::vector<uint32_t> gone(range.count - filling.kept);
  std::iota(gone.begin(), gone.end(), range.first + filling.kept);
  take_out(gone, model);
  for (uint32_t i = 0; i < filling.kept; ++i) {
    if (before[i].start_s > 0) release(before[i].start_s, range.first + i, model);
  }
  std::ranges::stable_sort(model.events, {}, &ModelEvent::time_s);
  model.guide_fill.reset();
  if (range.is_mould) model.moulded = {range.first, filling.kept};
  return filling;
}

GuideFilling fill_until_held(const Scene& scene, Model& model, const JudgeStart& judge,
                             std::vector<PlacedBody>& left_out) {
  const GuideFill range = *model.guide_fill;
  if (!range.is_mould || scene.guide->hold != HoldKind::glue) return fill_once(scene, model, 0);
  for (uint32_t attempt = 0;; ++attempt) {
    Model filled = model;
    GuideFilling filling = fill_once(scene, filled, attempt);
    filling.tries = attempt + 1;
    const GlueVerdict verdict = judge(scene, filled);
    if (!verdict.holds && filling.tries < kMostFillings) continue;
    filling.floats = verdict.hanging.size() == filling.kept;
    if (!filling.floats) {
      for (const uint32_t body : verdict.hanging) {
        left_out.emplace_back(filled.bodies[body].shape, filled.bodies[body].pose);
      }
      leave_out(verdict.hanging, range.first, model.guide, filled, filling);
    }
    model = std::move(filled);
    return filling;
  }
}

}  // namespace

double filling_step_s(const Scene& scene, double radius_m) {
  return kStep * step_with_guide_s(scene, radius_m);
}

GuideFilling fill_guide(const Scene& scene, Model& model, const JudgeStart& judge) {
  if (!model.guide_fill) return {};
  const GuideFill range = *model.guide_fill;
  std::vector<PlacedBody> left_out;
  GuideFilling filling = fill_until_held(scene, model, judge, left_out);
  filling.first = range.first;
  filling.empty = empty_parts_of_filling(scene, model,
                                         {.bodies = {range.first, filling.kept},
                                          .all_in = filling.dropped == range.count,
                                          .through_base = !range.is_mould,
                                          .left_out = std::move(left_out)});
  return filling;
}

}  // namespace pilesim
