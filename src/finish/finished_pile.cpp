#include "finish/finished_pile.h"

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "core/clock.h"
#include "core/counted.h"
#include "core/error.h"
#include "core/text.h"

namespace pilesim {

namespace {

bool is_free(const Model& model, const BodyStates& states, uint32_t body) {
  return model.bodies[body].role == Role::dynamic && (states.flags[body] & kPresent) != 0;
}

void measure_change(const Scene& scene, const Model& model, const BodyStates& before,
                    const FinishedPile& pile, FinishFigures& figures) {
  std::vector<uint8_t> is_left(before.size(), 0);
  for (const uint32_t body : pile.left) is_left[body] = 1;
  const double diameter = mean_diameter_m(model);
  const Vec3 up =
      scene.gravity.norm() > 0 ? Vec3(-scene.gravity.normalized()) : Vec3(Vec3::UnitY());
  std::vector<double> moved;
  double lowest = std::numeric_limits<double>::infinity(), height = 0, rise = 0, count = 0;
  for (uint32_t i = 0; i < before.size(); ++i) {
    if (!is_free(model, before, i)) continue;
    const Vec3 way = pile.states.position[i] - before.position[i];
    if (is_left[i] == 0 || !way.isZero(0)) moved.push_back(way.norm() / diameter);
    ++count;
    lowest = std::min(lowest, up.dot(before.position[i]));
    height += up.dot(before.position[i]);
    rise += up.dot(way);
  }
  if (moved.empty()) return;
  std::ranges::sort(moved);
  figures.median_moved = moved[moved.size() / 2];
  figures.largest_moved = moved.back();
  // A single layer has the height of its bodies.
  figures.mean_height_change = rise / count / (height / count - lowest + diameter / 2);
}

}  // namespace

std::string to_json(const FinishFigures& figures) {
  const nlohmann::ordered_json json = {{"bodies", figures.bodies},
                                       {"left_as_they_were", figures.left},
                                       {"not_at_rest", figures.not_at_rest},
                                       {"interrupted", figures.interrupted},
                                       {"settled_s", figures.settled_s},
                                       {"steps", figures.steps},
                                       {"wall_s", figures.wall_s},
                                       {"median_moved_diameters", figures.median_moved},
                                       {"largest_moved_diameters", figures.largest_moved},
                                       {"mean_height_change", figures.mean_height_change},
                                       {"largest_extra_speed_m_s", figures.largest_extra_speed},
                                       {"deepest_before_diameters", figures.deepest_before},
                                       {"deepest_after_diameters", figures.deepest_after},
                                       {"deepest_left_diameters", figures.deepest_left}};
  return json.dump();
}

std::string describe(const FinishFigures& figures) {
  return "finished " + counted(figures.bodies, "body", "bodies") + " in " +
         with_digits(figures.wall_s, 3) + " s: overlaps of " +
         with_digits(figures.deepest_before, 2) + " D became " +
         with_digits(figures.deepest_after, 2) + " D, bodies moved by " +
         with_digits(figures.median_moved, 2) + " D in the median and " +
         with_digits(figures.largest_moved, 2) + " D at most, the mean height changed by " +
         with_digits(100 * figures.mean_height_change, 2) + " %, at most " +
         with_digits(figures.largest_extra_speed, 2) + " m/s were added on the way; " +
         std::to_string(figures.not_at_rest) + " not at rest" +
         (figures.left == 0 ? ""
                            : "; " + counted(figures.left, "body", "bodies") +
                                  " that cannot be seen were left in each other, by up to " +
                                  with_digits(figures.deepest_left, 2) + " D");
}

BodyStates last_states(TrajectoryReader& trajectory, const Model& model, const std::string& place) {
  return states_at(trajectory, trajectory.frame_count() - 1, model, place);
}

BodyStates states_at(TrajectoryReader& trajectory, uint64_t index, const Model& model,
                     const std::string& place) {
  const TrajectoryHeader& header = trajectory.header();
  // A trajectory without frames has no last one.
  const bool is_same = header.body_count() == model.bodies.size() &&
                       std::ranges::equal(header.body_name, model.bodies, {}, {}, &ModelBody::name);
  if (!is_same || trajectory.frame_count() == 0) {
    throw Error(ErrorKind::input,
                Problem{.file = place,
                        .found = "has " + counted(trajectory.frame_count(), "frame") + " of " +
                                 counted(header.body_count(), "body", "bodies"),
                        .expected = "frames of the bodies of its scene, " +
                                    std::to_string(model.bodies.size())});
  }
  TrajectoryFrame frame;
  trajectory.read(index, frame);
  BodyStates states;
  states.flags = frame.state;
  states.linear_velocity.assign(frame.state.size(), Vec3::Zero());
  states.angular_velocity.assign(frame.state.size(), Vec3::Zero());
  for (size_t i = 0; i < frame.state.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    const bool is_fixed = body.role == Role::fixed;
    states.position.push_back(is_fixed ? body.pose.position : frame.position[i]);
    states.orientation.push_back(is_fixed ? body.pose.orientation
                                          : frame.orientation[i].cast<double>().normalized());
  }
  return states;
}

FinishedPile bring_to_rest(const Scene& scene, const Model& model, const BodyStates& start,
                           ExactRest& rest, RestProgress progress,
                           const std::function<bool(const RestProgress&)>& goes_on) {
  const Stopwatch watch;
  const double before_s = progress.wall_s;
  FinishedPile pile;
  pile.steps_before = progress.steps.size();
  while (!rest.is_over() && !pile.figures.interrupted) {
    progress.steps.push_back(rest.step());
    progress.wall_s = before_s + watch.seconds();
    pile.figures.interrupted = !goes_on(progress);
  }
  pile.states = rest.states();
  pile.left = rest.left();
  pile.ways = rest.take_ways();
  pile.figures.bodies = rest.movable();
  pile.figures.left = pile.left.size();
  pile.figures.not_at_rest = rest.is_at_rest() ? 0 : rest.movable() - rest.still();
  pile.figures.settled_s = rest.time_s();
  pile.figures.steps = progress.steps.size();
  pile.figures.wall_s = progress.wall_s;
  measure_change(scene, model, start, pile, pile.figures);
  pile.steps = std::move(progress.steps);
  return pile;
}

uint64_t write_eased(TrajectoryReader& source, const Scene& scene, const Model& model,
                     FinishedPile& pile, TrajectoryWriter& writer,
                     const std::function<bool(uint64_t)>& goes_on) {
  const uint64_t frames = source.frame_count();
  const double rate = source.header().frame_rate;
  TrajectoryFrame frame;
  source.read(frames - 1, frame);
  const TrajectoryFrame end = frame;
  RestStretches stretches(model, scene.gravity, rate, end, frames);
  for (uint64_t i = 0; i < frames; ++i) {
    source.read(i, frame);
    stretches.take(frame);
  }
  const EasedFrames eased(stretches.stretches(), end, pile.states, std::move(pile.ways));
  pile.figures.largest_extra_speed = eased.largest_extra_speed(rate);
  for (uint64_t i = 0; i < frames; ++i) {
    source.read(i, frame);
    eased.ease(i, frame);
    if (i + 1 == frames) frame.state = pile.states.flags;
    writer.append(frame);
    if (!goes_on(i + 1)) return i + 1;
  }
  return frames;
}

}  // namespace pilesim
