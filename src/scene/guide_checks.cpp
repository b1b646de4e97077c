#include "scene/guide_checks.h"

#include <array>
#include <utility>
#include <variant>

namespace pilesim {
namespace {

// Bodies that fill a guide start at rest, at places that follow from the guide.
void check_start(const Emitter& emitter, const Path& path, ProblemLog& log) {
  const std::array<std::pair<const char*, bool>, 6> given = {
      {{"asleep", emitter.asleep},
       {"linear_velocity", !emitter.linear_velocity.isZero(0)},
       {"angular_velocity", !emitter.angular_velocity.isZero(0)},
       {"position_jitter_m", emitter.position_jitter_m > 0},
       {"linear_velocity_jitter", emitter.linear_velocity_jitter > 0},
       {"angular_velocity_jitter", emitter.angular_velocity_jitter > 0}}};
  for (const auto& [key, is_given] : given) {
    if (!is_given) continue;
    log.report(path / key, R"(stands beside "type": "upside_down" or "mould")",
               "bodies that start at rest, where the filling leaves them", "Take it out");
  }
}

// Keys that section 6.2 as written does not have, and alpha, which only it has.
void check_hold(const Guide& guide, const Path& path, ProblemLog& log) {
  const Guide usual;
  if (guide.hold != HoldKind::nail) {
    if (guide.alpha != usual.alpha) {
      log.report(path / "alpha", R"(stands without "hold": "nail")",
                 R"("least_spread", its counterpart for "freeze")");
    }
    return;
  }
  const std::array<std::pair<const char*, bool>, 6> given = {
      {{"max_glue", guide.max_glue.has_value()},
       {"least_normal_up", guide.least_normal_up != usual.least_normal_up},
       {"least_spread", guide.least_spread != usual.least_spread},
       {"neighbours", guide.neighbours != usual.neighbours},
       {"most_speed", guide.most_speed != usual.most_speed},
       {"break_speed", guide.break_speed != usual.break_speed}}};
  for (const auto& [key, is_given] : given) {
    if (!is_given) continue;
    log.report(path / key, R"(stands beside "hold": "nail")",
               R"("period_steps", "kinetic_share", "least_contacts" and "alpha" only)",
               "Take it out");
  }
}

}  // namespace

void check_guide(const Scene& scene, ProblemLog& log) {
  const Path root;
  if (scene.guide && !scene.piles.empty()) {
    log.report(root / "guide", "stands beside \"piles\"", "one way to direct a pile",
               "Take out one of the two");
  }
  if (scene.guide) check_hold(*scene.guide, root / "guide", log);
  const Path emitters = root / "emitters";
  bool is_filled = false;
  for (size_t i = 0; i < scene.emitters.size(); ++i) {
    const Emitter& emitter = scene.emitters[i];
    const Path place = emitters / i;
    if (!fills_guide(emitter)) continue;
    if (!scene.guide || scene.guide->is_everywhere()) {
      log.report(place, "fills a guide, and the scene has none with a mesh",
                 R"("guide": {"file": ...} in the scene)");
    }
    if (std::exchange(is_filled, true)) {
      log.report(place, "fills the guide a second time", "one emitter that fills it",
                 R"(Name all shapes in its "shapes")");
    }
    if (scene.gravity.isZero(0)) {
      log.report(root / "gravity", "is zero, and falling bodies fill a guide", "not zero");
    }
    check_start(emitter, place, log);
  }
}

}  // namespace pilesim
