#include "scene/detail_checks.h"

#include <algorithm>
#include <string>

#include "core/counted.h"
#include "json/codec.h"

namespace pilesim {
namespace {

class DetailChecker {
 public:
  DetailChecker(const Scene& scene, ProblemLog& log) : scene_(scene), log_(log) {}

  void check() {
    const LevelOfDetail& detail = scene_.simulator.detail;
    const size_t count = detail.levels.size();
    const auto number = [&](int level, const char* key) {
      if (!log_.is_sound(detail_ / key) || static_cast<size_t>(level) <= count) return;
      log_.report(detail_ / key, "is " + std::to_string(level),
                  "at most " + std::to_string(count) + ", the number of levels");
    };
    number(detail.level, "level");
    if (detail.out_of_view) number(*detail.out_of_view, "out_of_view");
    check_limits(detail.distances_m, "distances_m", true);
    check_limits(detail.screen_sizes, "screen_sizes", false);
    check_limits(detail.speeds, "speeds", true);
    for (size_t i = 0; i < detail.pairs.size(); ++i) {
      const Path rules = detail_ / "pairs";
      const Path rule = rules / i;
      check_name(detail.pairs[i].a, rule / "a");
      check_name(detail.pairs[i].b, rule / "b");
    }
    check_camera();
    if (scene_.simulator.mode != SimulatorMode::mixed) return;
    check_hinges();
    if (scene_.simulator.method == Method::own) check_near_bodies();
  }

 private:
  void check_near_bodies() {
    const Path levels = detail_ / "levels";
    for (size_t i = 0; i < scene_.simulator.detail.levels.size(); ++i) {
      if (scene_.simulator.detail.levels[i].near_near != PairMethod::statistical) continue;
      const Path level = levels / i;
      log_.report_key(level / "near_near", "is \"statistical\"", "\"impulse\" or \"particle\"",
                      R"(Bodies near must-impulse ones are solved among each other unless )"
                      R"("method" is "dissertation")");
    }
  }

  void check_limits(const std::vector<double>& limits, const char* key, bool ascending) {
    const Path place = detail_ / key;
    if (limits.empty() || !log_.is_sound(place)) return;
    const size_t wanted = scene_.simulator.detail.levels.size() - 1;
    if (limits.size() != wanted) {
      log_.report(place, "has " + counted(limits.size(), "limit"),
                  std::to_string(wanted) + ", one less than there are levels");
      return;
    }
    for (size_t i = 1; i < limits.size(); ++i) {
      if (ascending ? limits[i] > limits[i - 1] : limits[i] < limits[i - 1]) continue;
      log_.report(place / i,
                  "is " + number_text(limits[i]) + " after " + number_text(limits[i - 1]),
                  ascending ? "ascending limits" : "descending limits");
    }
  }

  // Reports a `name` that means no bodies with spheres.
  void check_name(const std::string& name, const Path& path) {
    if (!log_.is_sound(path)) return;
    std::vector<std::string> names;
    for (const Body& body : scene_.bodies) {
      names.push_back(body.name);
      if (body.name == name) return check_sphere(body, path);
    }
    for (const Emitter& emitter : scene_.emitters) {
      names.push_back(emitter.name);
      if (emitter.name != name) continue;
      if (emitter.preference == Preference::must_impulse) report_exact(name, path);
      return;
    }
    log_.report(path, "is \"" + name + "\", which is no body or emitter of the scene",
                "the name of a body or an emitter", did_you_mean(name, names));
  }

  void check_sphere(const Body& body, const Path& path) {
    if (body.role == Role::dynamic && body.preference == Preference::must_impulse) {
      report_exact(body.name, path);
    }
  }

  void report_exact(const std::string& name, const Path& path) {
    log_.report(path, "is \"" + name + "\", which is dynamic and must_impulse",
                "bodies that may be spheres", R"(Give it "preference": "prefer_statistical")");
  }

  void check_camera() {
    const LevelOfDetail& detail = scene_.simulator.detail;
    if (!scene_.camera.keys.empty()) return;
    const auto needs = [&](bool given, const Path& place) {
      if (given) {
        log_.report_key(place, "needs a camera, and the scene has none", "a camera in the scene");
      }
    };
    needs(!detail.distances_m.empty(), detail_ / "distances_m");
    needs(!detail.screen_sizes.empty(), detail_ / "screen_sizes");
    needs(detail.out_of_view.has_value(), detail_ / "out_of_view");
  }

  void check_hinges() {
    const Path bodies = root_ / "bodies";
    for (size_t i = 0; i < scene_.bodies.size(); ++i) {
      const Body& body = scene_.bodies[i];
      if (!body.hinge || body.preference == Preference::must_impulse) continue;
      const Path place = bodies / i;
      log_.report_key(place / "hinge", "belongs to a body that is prefer_statistical",
                      "spheres without hinges in the mixed mode",
                      R"(Give the body "preference": "must_impulse")");
    }
  }

  const Scene& scene_;
  ProblemLog& log_;
  const Path root_;
  const Path simulator_ = root_ / "simulator";
  const Path detail_ = simulator_ / "level_of_detail";
};

}  // namespace

void check_detail(const Scene& scene, ProblemLog& log) { DetailChecker(scene, log).check(); }

}  // namespace pilesim
