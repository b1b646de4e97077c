#include "scene/joint_checks.h"

#include <algorithm>
#include <string>
#include <vector>

#include "core/text.h"
#include "json/codec.h"

namespace pilesim {
namespace {

class JointChecker {
 public:
  JointChecker(const Scene& scene, ProblemLog& log) : scene_(scene), log_(log) {
    for (const Body& body : scene.bodies) names_.push_back(body.name);
  }

  void check() {
    const Path root;
    check_modes(root / "joints", !scene_.joints.empty());
    check_modes(root / "chains", !scene_.chains.empty());
    const Path joints = root / "joints";
    for (size_t i = 0; i < scene_.joints.size(); ++i) check_joint(scene_.joints[i], joints / i);
    const Path chains = root / "chains";
    for (size_t i = 0; i < scene_.chains.size(); ++i) check_chain(scene_.chains[i], chains / i);
  }

 private:
  void check_modes(const Path& path, bool is_given) {
    if (!is_given || !log_.is_sound_itself(path)) return;
    const SimulatorMode mode = scene_.simulator.mode;
    if (mode == SimulatorMode::statistical || mode == SimulatorMode::particle) {
      log_.report(path, "stands beside the " + mode_name(mode) + " mode",
                  "joints in the impulse and the mixed mode only",
                  R"(Set /simulator/mode to "impulse")");
    } else if (scene_.simulator.engine == EngineKind::bullet) {
      log_.report(path, R"(stands beside "engine": "bullet")", "no joints",
                  R"(Use "engine": "exact" in "simulator")");
    }
  }

  // The body called `name`, or null and a report.
  const Body* body(const std::string& name, const Path& path) {
    if (!log_.is_sound(path)) return nullptr;
    const auto found = std::ranges::find(scene_.bodies, name, &Body::name);
    if (found != scene_.bodies.end()) return &*found;
    const bool is_link = std::ranges::any_of(
        scene_.chains, [&](const Chain& chain) { return name.starts_with(chain.name + '/'); });
    log_.report(path, "is \"" + name + "\", which is no body of the scene", "the name of a body",
                is_link ? R"(Joints name no links of chains: use the chain's "start" and "end")"
                        : did_you_mean(name, names_));
    return nullptr;
  }

  void check_joined(const Body* body, const Path& path) {
    if (body == nullptr || body->role != Role::dynamic) return;
    if (scene_.simulator.mode != SimulatorMode::mixed) return;
    if (body->preference == Preference::must_impulse) return;
    log_.report(path, "is \"" + body->name + "\", which is prefer_statistical",
                "joints of must_impulse bodies only in the mixed mode",
                R"(Give the body "preference": "must_impulse")");
  }

  void check_joint(const Joint& joint, const Path& path) {
    const Body* const a = body(joint.a, path / "a");
    if (a != nullptr && a->role != Role::dynamic) {
      log_.report(path / "a", "is \"" + joint.a + "\", which does not move freely",
                  "a dynamic body", "Make it b, and the dynamic one a");
    }
    check_joined(a, path / "a");
    if (joint.b) {
      check_joined(body(*joint.b, path / "b"), path / "b");
      if (*joint.b == joint.a && log_.is_sound(path / "b")) {
        log_.report(path / "b", "is \"" + joint.a + "\" like a", "another body");
      }
    }
    if (!log_.is_sound(path / "type")) return;
    const auto of_hinges = [&](bool is_given, const char* key) {
      if (!is_given || joint.kind == JointKind::hinge || !log_.is_sound(path / key)) return;
      log_.report_key(path / key, "belongs to a joint that is no hinge", "this key on hinges only");
    };
    of_hinges(joint.axis.has_value(), "axis");
    of_hinges(joint.limits.has_value(), "limits_deg");
    of_hinges(joint.motor.has_value(), "motor");
    if (joint.kind == JointKind::hinge && !joint.axis && log_.is_sound(path / "axis")) {
      log_.report(path, "is a hinge without \"axis\"", "the direction that it turns about",
                  R"(Add "axis": [x, y, z])");
    }
    if (joint.collide && !joint.b) {
      log_.report_key(path / "collide", "belongs to a joint with the world",
                      "this key on joints of two bodies only");
    }
    const Path limits = path / "limits_deg";
    if (joint.limits && log_.is_sound(limits)) {
      const auto [least, most] = *joint.limits;
      if (least > 0 || most < 0) {
        log_.report(limits, "does not hold 0, the turn at the start",
                    "a least turn of at most 0, and a most of at least 0");
      }
    }
  }

  void check_chain(const Chain& chain, const Path& path) {
    const auto check_end = [&](const std::optional<std::string>& name, const char* key) {
      if (!name) return;
      if (*name != kWorldName) return check_joined(body(*name, path / key), path / key);
      if (std::ranges::find(names_, kWorldName) == names_.end() || !log_.is_sound(path / key))
        return;
      log_.report(path / key, "is \"world\", and a body has that name, too", "one meaning",
                  "Give the body another name");
    };
    check_end(chain.start, "start");
    check_end(chain.end, "end");
  }

  const Scene& scene_;
  ProblemLog& log_;
  std::vector<std::string> names_;
};

}  // namespace

void check_joints(const Scene& scene, ProblemLog& log) { JointChecker(scene, log).check(); }

}  // namespace pilesim
