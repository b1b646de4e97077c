#include "pile/guide/guided_simulator.h"

#include <algorithm>
#include <limits>

#include "core/error.h"
#include "core/text.h"
#include "pile/guide/glue_director.h"
#include "pile/guide/guide_director.h"
#include "pile/guide/nail_director.h"
#include "simulate/modes/make_simulator.h"

namespace pilesim {
namespace {

const Scene& checked(const Scene& scene) {
  if (!scene.guide) {
    throw Error(ErrorKind::input, Problem{.found = "the scene has no guide",
                                          .expected = "\"guide\": {...}",
                                          .remedy = "docs/equilibrium.md describes its keys"});
  }
  if (scene.simulator.mode != SimulatorMode::impulse) {
    throw Error(
        ErrorKind::input,
        Problem{.pointer = "/simulator/mode",
                .found = "is \"" + mode_name(scene.simulator.mode) + "\"",
                .expected = "\"impulse\" in a scene with a guide",
                .remedy = "Only the impulse mode knows the contacts that the analysis needs"});
  }
  return scene;
}

std::unique_ptr<PileHolder> holder_of(const Scene& scene, const Model& model) {
  switch (scene.guide->hold) {
    case HoldKind::glue:
      return std::make_unique<GlueDirector>(scene, model);
    case HoldKind::nail:
      return std::make_unique<NailDirector>(scene, model);
    case HoldKind::freeze:
      break;
  }
  return std::make_unique<GuideDirector>(scene, model);
}

}  // namespace

GuidedSimulator::GuidedSimulator(const Scene& scene, const Model& model)
    : scene_(checked(scene)),
      model_(model),
      holder_(holder_of(scene, model)),
      simulator_(make_directed_simulator(scene, model, static_cast<ImpulseDirector&>(*holder_))),
      record_{.start = std::vector<Vec3>(model.bodies.size(), Vec3::Zero()),
              .has_start = std::vector<uint8_t>(model.bodies.size())} {}

FrameStatistics GuidedSimulator::step_frame() {
  FrameStatistics statistics = simulator_->step_frame();
  record_.total_s += statistics.times.total_s;
  record_.steps += static_cast<uint64_t>(statistics.steps);
  record_frame();
  return statistics;
}

std::vector<std::string> GuidedSimulator::notes() const {
  std::vector<std::string> notes = simulator_->notes();
  const std::optional<GlueFigures> glue = glue_figures();
  if (glue && !are_found(*glue)) {
    notes.push_back("/guide: " +
                    (glue->is_solved
                         ? "the glue that was found leaves " + with_digits(glue->unbalanced, 2) +
                               " of a body's weight unbalanced"
                         : std::string("no glue was found that holds the pile")) +
                    ", and it may fall; another \"seed\", fewer bodies or smaller ones may stand");
  } else if (glue && glue->leaning_unsolved > 0) {
    notes.push_back("/guide: no glue was found for " + std::to_string(glue->leaning_unsolved) +
                    " of the three ways in which the pile may lean: it is held upright, but may "
                    "rock; another \"seed\" may stand more firmly");
  }
  return notes;
}

double GuidedSimulator::control_share() const {
  return record_.total_s > 0 ? holder_->control_s() / record_.total_s : 0;
}

double GuidedSimulator::control_step_s() const {
  return holder_->control_s() /
         static_cast<double>(std::max<uint64_t>(1, holder_->control_steps()));
}

double GuidedSimulator::simulation_step_s() const {
  return (record_.total_s - holder_->control_s()) /
         static_cast<double>(std::max<uint64_t>(1, record_.steps));
}

void GuidedSimulator::record_frame() {
  GuideFrame frame;
  frame.time_s = static_cast<double>(record_.frames.size() + 1) / scene_.frame_rate;
  frame.counts = holder_->counts();
  const BodyStates& now = states();
  double bodies = 0;
  double lowest = std::numeric_limits<double>::infinity(), highest = -lowest;
  for (uint32_t body = 0; body < now.size(); ++body) {
    const bool moves = model_.bodies[body].role == Role::dynamic &&
                       (now.flags[body] & kPresent) != 0 && (now.flags[body] & kHeld) == 0;
    if (!moves) continue;
    if (record_.has_start[body] == 0) {
      record_.start[body] = now.position[body];
      record_.has_start[body] = 1;
    }
    const double drift = (now.position[body] - record_.start[body]).norm();
    frame.mean_drift_m += drift;
    frame.largest_drift_m = std::max(frame.largest_drift_m, drift);
    lowest = std::min(lowest, now.position[body].y());
    highest = std::max(highest, now.position[body].y());
    ++bodies;
  }
  if (bodies > 0) {
    frame.mean_drift_m /= bodies;
    frame.height_m = highest - lowest;
  }
  record_.frames.push_back(frame);
  std::vector<Vec3> points = holder_->constraint_points();
  if (record_.constraints.empty() || record_.constraints.back().points != points) {
    record_.constraints.push_back({record_.frames.size(), std::move(points)});
  }
}

void GuidedSimulator::save(StateWriter& writer) const {
  simulator_->save(writer);
  writer(record_);
}

void GuidedSimulator::load(StateReader& reader) {
  simulator_->load(reader);
  reader(record_);
  const size_t count = model_.bodies.size();
  StateReader::require(record_.start.size() == count && record_.has_start.size() == count,
                       "an entry for each body");
}

}  // namespace pilesim
