#include "job/repose_direction.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/clock.h"
#include "core/error.h"
#include "core/naming.h"
#include "core/text.h"
#include "pile/repose/repose_director.h"
#include "simulate/body_control.h"
#include "simulate/modes/make_simulator.h"
#include "trajectory/pile_layers.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

void check(const std::filesystem::path& scene_file, const Scene& scene) {
  Problem problem{.file = scene_file.string()};
  if (scene.piles.empty()) {
    problem.pointer = "/piles";
    problem.found = "is empty or missing";
    problem.expected = "at least one pile, such as {\"angle_deg\": 30}";
  } else if (scene.simulator.mode != SimulatorMode::impulse &&
             scene.simulator.mode != SimulatorMode::mixed) {
    problem.pointer = "/simulator/mode";
    problem.found = "is \"" + mode_name(scene.simulator.mode) + "\"";
    problem.expected = "\"impulse\" or \"mixed\", which take a director";
    problem.remedy = "Set \"mixed\": there bodies are spheres, too, unless they are must_impulse";
  } else {
    return;
  }
  throw Error(ErrorKind::input, problem);
}

double rounded(double value, double unit) { return std::round(value / unit) * unit; }

std::vector<GroundPoint> drawn(std::vector<GroundPoint> points) {
  for (GroundPoint& point : points) {
    point = {rounded_for_pictures(point.x()), rounded_for_pictures(point.y())};
  }
  return points;
}

LayeredPile layers_of(const PileState& pile) {
  LayeredPile layered{.core = drawn(pile.shape->core()), .walls = drawn(pile.shape->walls())};
  for (const StackingLayer& layer : pile.structure->layers()) {
    layered.layers.push_back({rounded_for_pictures(layer.bottom_m + pile.settings.base_m),
                              rounded_for_pictures(layer.top_m + pile.settings.base_m),
                              rounded_for_pictures(layer.reach_m)});
  }
  return layered;
}

}  // namespace

// Directs, measures time, and records the layers at the end of every frame.
struct ReposeDirection::State final : StepDirector {
  State(const Scene& s, const Model& m) : scene(s), model(m), director(s, m) {}

  void direct(BodyControl& control) override {
    const Stopwatch watch;
    director.direct(control);
    seconds += watch.seconds();
  }

  void end_frame(BodyControl& control) override {
    ++frames;
    std::vector<LayeredPile> now;
    for (const PileState& pile : director.piles()) {
      if (pile.shape && pile.structure) now.push_back(layers_of(pile));
    }
    if (changes.empty() || changes.back().piles != now) changes.push_back({frames, std::move(now)});
    const bool is_last = frames + 1 == static_cast<uint64_t>(scene.frame_count());
    if (is_last || frames % kMeasurePeriod == 0) director.measure(control);
  }

  void save(StateWriter& writer) const override {
    director.save(writer);
    writer(seconds, frames, changes);
  }
  void load(StateReader& reader) override {
    director.load(reader);
    reader(seconds, frames, changes);
  }

  static constexpr uint64_t kMeasurePeriod = 30;  // so that an interrupted run has figures too

  const Scene& scene;
  const Model& model;
  ReposeDirector director;
  double seconds = 0;
  uint64_t frames = 0;
  std::vector<PileLayersChange> changes;
};

ReposeDirection::ReposeDirection(const std::filesystem::path& scene_file, const Scene& scene,
                                 const Model& model) {
  check(scene_file, scene);
  state_ = naming(scene_file.string(), [&] { return std::make_unique<State>(scene, model); });
}

ReposeDirection::~ReposeDirection() = default;

std::unique_ptr<Simulator> ReposeDirection::make_simulator() {
  return make_directed_simulator(state_->scene, state_->model, *state_);
}

DirectedRun ReposeDirection::finish(const Simulator& /*simulator*/,
                                    const std::filesystem::path& directory) const {
  write_pile_layers(directory / "piles.json", state_->changes);
  Json figures = Json::object();
  size_t index = 0;
  for (const PileState& pile : state_->director.piles()) {
    const bool has_slope = pile.slope.azimuths > 0;
    figures["pile " + std::to_string(index++)] = {
        {"angle_asked_deg", rounded(degrees(pile.settings.angle), 0.01)},
        {"angle_got_deg", has_slope ? Json(rounded(degrees(pile.slope.angle), 0.01)) : Json()},
        {"spread_deg", has_slope ? Json(rounded(degrees(pile.slope.spread), 0.01)) : Json()},
        {"azimuths_fitted", pile.slope.azimuths},
        {"tau", pile.settings.tau},
        {"radius_m", pile.settings.method == Method::own ? pile.ideal.reach_m()
                     : pile.structure                    ? pile.structure->reach()
                                                         : 0.0}};
  }
  const PlausibilityCounts& counts = state_->director.plausibility();
  figures["all"] = {{"asleep", counts.asleep},
                    {"asleep_in_the_air", counts.hanging},
                    {"asleep_inside_another", counts.inside},
                    {"woken_by_avalanches", state_->director.woken_by_avalanches()},
                    {"wakes_by_momentum", state_->director.wakes_by_momentum()},
                    {"director_s", state_->seconds}};
  std::vector<std::string> lines;
  for (const PileState& pile : state_->director.piles()) {
    const std::string asked = with_digits(degrees(pile.settings.angle), 3);
    lines.push_back("pile: asked " + asked + " degrees, got " +
                    (pile.slope.azimuths == 0
                         ? "no slope that can be measured"
                         : with_digits(degrees(pile.slope.angle), 3) + " +- " +
                               with_digits(degrees(pile.slope.spread), 2) + " over " +
                               std::to_string(pile.slope.azimuths) + " azimuths"));
  }
  lines.push_back("piles: " + std::to_string(counts.asleep) + " asleep, of them " +
                  std::to_string(counts.hanging) + " in the air and " +
                  std::to_string(counts.inside) + " inside another; " +
                  with_digits(state_->seconds, 3) + " s for directing");
  return {figures.dump(), std::move(lines)};
}

}  // namespace pilesim
