#include "scene/engine_checks.h"

#include <string>

#include "json/codec.h"

namespace pilesim {
namespace {

constexpr double kMostFriction = 10;  // Bullet's, of a pair

void refuse(ProblemLog& log, const Path& path, const std::string& found,
            const std::string& expected, const std::string& other_way) {
  if (!log.is_sound_itself(path)) return;
  log.report(path, found, expected, R"(Use "engine": "exact" in "simulator", or )" + other_way);
}

}  // namespace

void check_engine(const Scene& scene, ProblemLog& log) {
  if (scene.simulator.engine != EngineKind::bullet) return;
  const Path root;
  const std::string beside = R"(stands beside "engine": "bullet")";
  if (scene.guide) {
    refuse(log, root / "guide", beside, "no guide: Bullet neither glues, nails nor freezes bodies",
           "take it out");
  }
  if (!scene.piles.empty()) {
    refuse(log, root / "piles", beside, "no piles: Bullet's bodies cannot be steered",
           "take them out");
  }
  const SimulatorMode mode = scene.simulator.mode;
  const Path simulator = root / "simulator";
  if (mode == SimulatorMode::mixed) {
    refuse(log, simulator / "engine", R"(is "bullet", and the mode is "mixed")",
           "a mode in which Bullet solves all bodies", R"("mode": "impulse")");
  }
  if (mode != SimulatorMode::impulse) return;
  const Path bodies = root / "bodies";
  for (size_t i = 0; i < scene.bodies.size(); ++i) {
    if (!scene.bodies[i].surface_velocity) continue;
    const Path body = bodies / i;
    refuse(log, body / "surface_velocity", beside, "no such key: Bullet has no moving surfaces",
           R"(move the body by "motion")");
  }
  const Path materials = root / "materials";
  for (const auto& [name, material] : scene.materials) {
    const Path place = materials / name;
    const auto require_at_most = [&](const char* key, double value, double most,
                                     const std::string& expected) {
      if (value <= most) return;
      refuse(log, place / key, "is " + number_text(value) + R"( beside "engine": "bullet")",
             expected, "a smaller value");
    };
    require_at_most("friction", material.friction, kMostFriction, "at most 10, Bullet's limit");
    const std::string none = "0: Bullet holds heavy bodies back by too little";
    require_at_most("rolling_friction", material.rolling_friction, 0, none);
    require_at_most("spinning_friction", material.spinning_friction, 0, none);
  }
}

}  // namespace pilesim
