#include "scene/scene_hints.h"

#include <algorithm>
#include <variant>

#include "core/text.h"

namespace pilesim {

std::vector<std::string> scene_hints(const Scene& scene) {
  std::vector<std::string> hints;
  const std::string end =
      ", after the end of the run at " + with_digits(scene.duration_s, 6) + " s";
  const auto is_late = [&](double time_s) { return time_s > scene.duration_s; };
  for (size_t i = 0; i < scene.events.size(); ++i) {
    const double time_s = scene.events[i].time_s;
    if (!is_late(time_s)) continue;
    hints.push_back("an event happens at " + with_digits(time_s, 6) + " s" + end +
                    R"(; give it an earlier "time_s" or the scene a longer "duration_s")");
  }
  for (const Emitter& emitter : scene.emitters) {
    if (!is_late(emitter.start_s)) continue;
    hints.push_back("the emitter \"" + emitter.name + "\" starts at " +
                    with_digits(emitter.start_s, 6) + " s" + end +
                    R"(; give it an earlier "start_s" or the scene a longer "duration_s")");
  }
  const bool releases = std::ranges::any_of(scene.events, [](const Event& event) {
    return std::holds_alternative<ReleaseEvent>(event.action);
  });
  const auto held = std::ranges::find_if(scene.bodies, &Body::held);
  if (held != scene.bodies.end() && !releases) {
    hints.push_back("the body \"" + held->name +
                    R"(" is held and no event of type "release" lets it go; for one that never )"
                    R"(moves take "role": "static")");
  }
  for (const Body& body : scene.bodies) {
    if (body.role != Role::kinematic || !body.motion.empty() || !body.motion.motors.empty() ||
        body.surface_velocity) {
      continue;
    }
    hints.push_back("the body \"" + body.name +
                    R"(" is kinematic and has no "motion", "motors" or "surface_velocity": it )"
                    "stands still");
  }
  if (scene.gravity.y() > 0) {
    hints.emplace_back(
        R"("gravity" points up: y is up here; for things that fall it is [0, -9.81, 0])");
  }
  return hints;
}

}  // namespace pilesim
