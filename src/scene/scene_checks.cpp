#include "scene/scene_checks.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <filesystem>
#include <set>
#include <string_view>

#include "core/counted.h"
#include "core/text.h"
#include "core/utf8.h"
#include "json/codec.h"
#include "scene/detail_checks.h"
#include "scene/engine_checks.h"
#include "scene/guide_checks.h"
#include "scene/joint_checks.h"
#include "scene/pile_checks.h"
#include "scene/scene_format.h"

namespace pilesim {

namespace {

std::string quoted(const std::string& name) { return '"' + name + '"'; }

template <class T>
std::vector<std::string> names_of(const std::map<std::string, T>& entries) {
  std::vector<std::string> names;
  for (const auto& [name, entry] : entries) names.push_back(name);
  return names;
}

// Bodies in all, none where a mesh decides.
double known_count(const Emitter& emitter) {
  if (const auto* grid = std::get_if<GridSource>(&emitter.source)) {
    return static_cast<double>(grid->count[0]) * grid->count[1] * grid->count[2];
  }
  return emitter.count;
}

// `name` is "<owner>/<index>": an emitter or a chain, and the index of its body.
struct OwnedName {
  std::string owner;
  uint64_t index = 0;
};
std::optional<OwnedName> split_owned_name(const std::string& name) {
  const size_t slash = name.rfind('/');
  if (slash == name.npos || slash + 1 == name.size()) return std::nullopt;
  OwnedName split{.owner = name.substr(0, slash)};
  const char* const end = name.data() + name.size();
  const auto parsed = std::from_chars(name.data() + slash + 1, end, split.index);
  if (parsed.ec != std::errc() || parsed.ptr != end) return std::nullopt;
  return split;
}

class Checker {
 public:
  Checker(const Scene& scene, const Json& document, ProblemLog& log)
      : scene_(scene),
        document_(document),
        log_(log),
        shape_names_(names_of(scene.shapes)),
        material_names_(names_of(scene.materials)) {
    for (size_t i = 0; i < scene.bodies.size(); ++i) bodies_.emplace(scene.bodies[i].name, i);
    for (size_t i = 0; i < scene.emitters.size(); ++i) {
      const Emitter& emitter = scene.emitters[i];
      owners_.emplace(emitter.name, Owner{"emitters", i, known_count(emitter)});
    }
    for (size_t i = 0; i < scene.chains.size(); ++i) {
      const Chain& chain = scene.chains[i];
      owners_.emplace(chain.name, Owner{"chains", i, static_cast<double>(chain.count)});
    }
    for (const auto& [name, index] : bodies_) body_names_.push_back(name);
    for (const auto& [name, owner] : owners_) body_names_.push_back(name);
  }

  void check() {
    for (const auto& [name, shape] : scene_.shapes) {
      const Path place = shapes_ / name;
      if (const auto* compound = std::get_if<CompoundShape>(&shape)) {
        check_compound(*compound, place / "parts");
      }
      if (log_.is_sound(place)) check_measures(shape, place);
    }
    const Path bodies = root_ / "bodies";
    for (size_t i = 0; i < scene_.bodies.size(); ++i) check_body(scene_.bodies[i], i, bodies / i);
    const Path emitters = root_ / "emitters";
    for (size_t i = 0; i < scene_.emitters.size(); ++i) {
      check_emitter(scene_.emitters[i], i, emitters / i);
    }
    const Path chains = root_ / "chains";
    for (size_t i = 0; i < scene_.chains.size(); ++i) check_chain(scene_.chains[i], i, chains / i);
    const Path events = root_ / "events";
    for (size_t i = 0; i < scene_.events.size(); ++i) check_event(scene_.events[i], events / i);
    if (scene_.guide && scene_.guide->shape) check_guide_shape(*scene_.guide);
    check_method();
    check_spheres_of_materials();
    check_counts();
    check_camera(scene_.camera, root_ / "camera");
    check_cameras(root_ / "cameras");
  }

 private:
  // The shape called `name`, or null and a report.
  const Shape* shape(const std::string& name, const Path& path) {
    if (!log_.is_sound(path) || !log_.is_sound_itself(shapes_)) return nullptr;
    const auto found = scene_.shapes.find(name);
    if (found != scene_.shapes.end()) {
      // A shape of unknown type is reported there and not judged here.
      return log_.is_sound(shapes_ / name) ? &found->second : nullptr;
    }
    log_.report(path, "is " + quoted(name) + ", which is no shape of the scene",
                listed(shape_names_, "shapes"), did_you_mean(name, shape_names_));
    return nullptr;
  }

  static std::string listed(const std::vector<std::string>& names, const std::string& kind) {
    constexpr size_t kMostListed = 12;
    if (names.empty()) return "a name from /" + kind + ", which is empty";
    if (names.size() > kMostListed) return "a name from /" + kind;
    return "one of " + quoted_list(names);
  }

  void check_material(const std::string& name, const Path& path) {
    if (!log_.is_sound(path) || !log_.is_sound_itself(materials_)) return;
    if (scene_.materials.contains(name)) return;
    log_.report(path, "is " + quoted(name) + ", which is no material of the scene",
                listed(material_names_, "materials"), did_you_mean(name, material_names_));
  }

  static bool collides_as_mesh(const Shape& shape) {
    if (std::holds_alternative<TerrainShape>(shape)) return true;
    const auto* mesh = std::get_if<MeshShape>(&shape);
    return mesh != nullptr && mesh->collision == CollisionKind::mesh;
  }

  void check_compound(const CompoundShape& compound, const Path& path) {
    for (size_t i = 0; i < compound.parts.size(); ++i) {
      const std::string& name = compound.parts[i].shape;
      const Path part = path / i;
      const Path place = part / "shape";
      const Shape* const found = shape(name, place);
      if (found == nullptr) continue;
      const std::string expected = "a shape that is neither a plane nor a compound";
      if (std::holds_alternative<PlaneShape>(*found)) {
        log_.report(place, "is " + quoted(name) + ", a plane", expected);
      } else if (std::holds_alternative<CompoundShape>(*found)) {
        log_.report(place, "is " + quoted(name) + ", a compound", expected,
                    "List its parts here instead");
      } else if (collides_as_mesh(*found)) {
        log_.report(place, "is " + quoted(name) + ", which collides as a mesh",
                    "a shape that collides as convex pieces",
                    R"(Give it "collision": "hull" or "decomposition")");
      }
    }
  }

  void check_text(const std::string& text, const Path& path) {
    size_t count = 0, printed = 0, control = 0;
    for (std::string_view rest = text; !rest.empty(); ++count) {
      const char32_t character = take_character(rest);
      if (character > 0x20) ++printed;
      if (character < 0x20 || (character >= 0x7F && character < 0xA0)) ++control;
    }
    const std::string expected = "letters in one line, at most " + std::to_string(kLongestText);
    if (printed == 0) {
      log_.report(path, "is blank", expected);
    } else if (control > 0) {
      log_.report(path, "has a line break or another control character", expected,
                  R"(Make a shape of each line, and a "compound" of them)");
    } else if (count > kLongestText) {
      log_.report(path, "has " + std::to_string(count) + " characters", expected);
    }
  }

  void check_guide_shape(const Guide& guide) {
    const Path place = root_ / "guide";
    const Path path = place / "shape";
    const Shape* const found = shape(*guide.shape, path);
    if (found == nullptr) return;
    if (std::holds_alternative<PlaneShape>(*found) ||
        std::holds_alternative<TerrainShape>(*found)) {
      log_.report(path, "is " + quoted(*guide.shape) + ", which has no end",
                  "a shape that encloses the pile");
    }
    if (guide.scale != 1) {
      log_.report(place / "scale", R"(stands beside "shape")", R"(a scale beside "file" only)",
                  R"(Give the shape a "scale")");
    }
  }

  // Walls, legs and boards need room between them, rings a hole.
  void check_measures(const Shape& shape, const Path& path) {
    const auto check = [&](const char* key, double value, double limit, const char* what) {
      if (value < limit) return;
      log_.report(path / key, "is " + number_text(value),
                  "less than " + number_text(limit) + ", " + what);
    };
    if (const auto* table = std::get_if<TableShape>(&shape)) {
      check("thickness", table->thickness, table->size.y(), "the height");
      check("leg", table->leg, std::min(table->size.x(), table->size.z()) / 2, "half of the width");
    } else if (const auto* shelf = std::get_if<ShelfShape>(&shape)) {
      check("thickness", shelf->thickness, shelf->size.x() / 2, "half of the width");
      check("thickness", shelf->thickness, shelf->size.y() / shelf->boards,
            "the height that a board has");
      if (shelf->has_back) check("thickness", shelf->thickness, shelf->size.z(), "the depth");
    } else if (const auto* torus = std::get_if<TorusShape>(&shape)) {
      check("tube_radius", torus->tube_radius, torus->radius, "the ring's radius");
    } else if (const auto* tube = std::get_if<TubeShape>(&shape)) {
      check("thickness", tube->thickness, tube->radius, "the outer radius");
    } else if (const auto* capsule = std::get_if<CapsuleShape>(&shape)) {
      if (capsule->height <= 2 * capsule->radius) {
        log_.report(path / "height", "is " + number_text(capsule->height),
                    "more than " + number_text(2 * capsule->radius) + ", two radii",
                    R"(Use a "sphere" if it has no straight part)");
      }
    } else if (const auto* text = std::get_if<TextShape>(&shape)) {
      check_text(text->text, path / "text");
    } else if (const auto* terrain = std::get_if<TerrainShape>(&shape)) {
      if (terrain->height[0] == terrain->height[1]) {
        log_.report(path / "height", "has the same for black and white", "two different heights");
      }
    }
  }

  void check_body(const Body& body, size_t index, const Path& path) {
    const Path shape_place = path / "shape";
    const Shape* const found = shape(body.shape, shape_place);
    check_material(body.material, path / "material");
    if (log_.is_sound(path / "name")) check_body_name(body, index, path / "name");
    if (!log_.is_sound(path / "role")) return;
    if (found != nullptr) check_role_of_shape(body, *found, path / "role");
    if (body.role != Role::kinematic && !body.motion.empty()) {
      log_.report_key(path / "motion", "belongs to a body that is " + role_name(body.role),
                      "no motion keys", R"(Give it "role": "kinematic")");
    }
    if (body.role != Role::kinematic && !body.motion.motors.empty()) {
      log_.report_key(path / "motors", "belongs to a body that is " + role_name(body.role),
                      "no motors", R"(Give it "role": "kinematic")");
    }
    check_motors(body.motion.motors, path / "motors");
    if (body.role == Role::dynamic && body.surface_velocity) {
      log_.report_key(path / "surface_velocity", "belongs to a body that is dynamic",
                      "this key on static and kinematic bodies only",
                      R"(Give it "role": "static" or "kinematic")");
    }
    check_ascending(body.motion, path / "motion");
    if (body.asleep && body.held) {
      log_.report_key(path / "asleep", "stands beside \"held\"", "one of the two");
    }
    if (body.role == Role::dynamic) return;
    const auto only_dynamic = [&](bool stands, const char* key) {
      if (stands && log_.is_sound(path / key)) {
        log_.report_key(path / key, "belongs to a body that is " + role_name(body.role),
                        "this key on dynamic bodies only");
      }
    };
    only_dynamic(body.hinge.has_value(), "hinge");
    only_dynamic(body.held, "held");
    only_dynamic(body.asleep, "asleep");
    only_dynamic(!body.linear_velocity.isZero(0), "linear_velocity");
    only_dynamic(!body.angular_velocity.isZero(0), "angular_velocity");
  }

  // Ramps fit between start and end, and a step follows each motor: beyond half a turn in a step
  // the body would seem to turn the other way.
  void check_motors(const std::vector<Motor>& motors, const Path& path) {
    constexpr double kMostTurn = kPi / 2;         // in a step, rad
    constexpr double kMostRate = 2 * kPi * 1000;  // rad/s
    const bool is_fixed = scene_.step_s || scene_.guide ||
                          scene_.simulator.mode != SimulatorMode::impulse ||
                          scene_.simulator.engine == EngineKind::bullet;
    const double step_s = scene_.actual_step_s();
    const double most = is_fixed ? std::min(kMostTurn / step_s, kMostRate) : kMostRate;
    const std::string remedy = most < kMostRate ? R"(Set a smaller "step_s")" : "";
    for (size_t i = 0; i < motors.size(); ++i) {
      const Motor& motor = motors[i];
      const Path place = path / i;
      if (!log_.is_sound(place)) continue;
      const double least_s = motor.start_s + 2 * motor.ramp_s;
      if (motor.end_s && !(*motor.end_s >= least_s && *motor.end_s > motor.start_s)) {
        log_.report(place / "end_s", "is " + number_text(*motor.end_s),
                    motor.ramp_s > 0
                        ? "at least " + number_text(least_s) + ", start_s and two ramps"
                        : "more than " + number_text(motor.start_s) + ", its start_s",
                    motor.ramp_s > 0 ? R"(Give it a shorter "ramp_s")" : "");
      }
      if (const auto* spin = std::get_if<SpinMotor>(&motor.action)) {
        const double rate = spin->angular_velocity.norm();
        if (rate <= most) continue;
        log_.report(place / "angular_velocity", "is " + with_digits(rate, 3) + " rad/s",
                    "at most " + with_digits(most, 3) + " rad/s" +
                        (most < kMostRate
                             ? ", a quarter of a turn in a step of " + with_digits(step_s, 3) + " s"
                             : ", 1000 turns a second"),
                    remedy);
        continue;
      }
      if (motor.ramp_s == 0) {
        log_.report(place / "ramp_s", "is 0, with which the body would jump", "more than 0",
                    "Leave it out: then it is a period");
      }
      const auto* sway = std::get_if<SwayMotor>(&motor.action);
      const double turns = sway != nullptr ? std::max(1.0, sway->amplitude) : 1;  // rad
      const double most_hz = most / (2 * kPi * turns);
      if (motor.frequency_hz <= most_hz) continue;
      log_.report(
          place / "frequency_hz", "is " + number_text(motor.frequency_hz),
          "at most " + with_digits(most_hz, 3) +
              (most < kMostRate ? ", which steps of " + with_digits(step_s, 3) + " s follow" : ""),
          remedy);
    }
  }

  static std::string role_name(Role role) {
    return role == Role::dynamic ? "dynamic" : role == Role::fixed ? "static" : "kinematic";
  }

  void check_role_of_shape(const Body& body, const Shape& found, const Path& path) {
    if (std::holds_alternative<PlaneShape>(found) && body.role != Role::fixed) {
      log_.report(
          path,
          "is \"" + role_name(body.role) + "\" but the shape " + quoted(body.shape) + " is a plane",
          "\"static\"", R"(Give the body "role": "static")");
    } else if (collides_as_mesh(found) && body.role == Role::dynamic) {
      log_.report(path,
                  "is \"dynamic\" but the shape " + quoted(body.shape) + " collides as a mesh",
                  R"("static" or "kinematic")",
                  std::holds_alternative<TerrainShape>(found)
                      ? ""
                      : R"(Give the shape "collision": "decomposition" to let it move freely)");
    }
  }

  void check_body_name(const Body& body, size_t index, const Path& path) {
    const std::string expected = "a name that no other body, emitter or chain has";
    if (const size_t first = bodies_.at(body.name); first != index) {
      log_.report(path, "is " + quoted(body.name) + " like /bodies/" + std::to_string(first),
                  expected);
    }
    if (const auto owner = owners_.find(body.name); owner != owners_.end()) {
      log_.report(path, "is " + quoted(body.name) + " like " + owner->second.pointer(), expected);
    }
    const std::optional<OwnedName> owned = split_owned_name(body.name);
    if (!owned) return;
    if (const auto owner = owners_.find(owned->owner); owner != owners_.end()) {
      log_.report(path, "is " + quoted(body.name) + " like a body of " + owner->second.pointer(),
                  expected);
    }
  }

  void check_owner_name(const std::string& name, const std::string& list, size_t index,
                        const Path& path) {
    const Owner& first = owners_.at(name);
    if (first.list == list && first.index == index) return;
    log_.report(path, "is " + quoted(name) + " like " + first.pointer(),
                "a name that no other emitter or chain has");
  }

  // A shape of bodies that emitters and chains make.
  void check_moving_shape(const std::string& name, const Path& path) {
    const Shape* const found = shape(name, path);
    if (found == nullptr) return;
    if (std::holds_alternative<PlaneShape>(*found)) {
      log_.report(path, "is " + quoted(name) + ", a plane", "a shape that can move");
    } else if (collides_as_mesh(*found)) {
      log_.report(path, "is " + quoted(name) + ", which collides as a mesh",
                  "a shape that can move",
                  std::holds_alternative<TerrainShape>(*found)
                      ? ""
                      : R"(Give it "collision": "hull" or "decomposition")");
    }
  }

  void check_chain(const Chain& chain, size_t index, const Path& path) {
    check_moving_shape(chain.shape, path / "shape");
    check_material(chain.material, path / "material");
    if (log_.is_sound(path / "to") && (chain.to - chain.from).norm() == 0) {
      log_.report(path / "to", "is where the chain begins", "another place");
    }
    if (log_.is_sound(path / "name")) check_owner_name(chain.name, "chains", index, path / "name");
  }

  void check_emitter(const Emitter& emitter, size_t index, const Path& path) {
    const bool is_single = document_["emitters"][index].contains("shape");
    const Path shapes = path / (is_single ? "shape" : "shapes");
    for (size_t i = 0; i < emitter.shapes.size(); ++i) {
      const Path listed_place = shapes / i;
      check_moving_shape(emitter.shapes[i], is_single ? shapes : listed_place);
    }
    if (emitter.materials.empty()) check_material(emitter.material, path / "material");
    check_mix(emitter, path);
    if (const auto* stream = std::get_if<PointSource>(&emitter.source)) {
      check_ascending(stream->motion, path / "motion");
      check_motors(stream->motion.motors, path / "motors");
    }
    check_owner_name(emitter.name, "emitters", index, path / "name");
  }

  // Weights, materials and other keys of an emitter with several shapes.
  void check_mix(const Emitter& emitter, const Path& path) {
    const size_t shapes = emitter.shapes.size();
    const auto check_size = [&](const char* key, size_t size) {
      if (size == 0 || size == shapes || !log_.is_sound(path / key)) return;
      log_.report(path / key, "has " + counted(size, "entry", "entries"),
                  std::to_string(shapes) + ", as many as there are shapes");
    };
    check_size("weights", emitter.weights.size());
    check_size("materials", emitter.materials.size());
    const Path materials = path / "materials";
    for (size_t i = 0; i < emitter.materials.size(); ++i) {
      check_material(emitter.materials[i], materials / i);
    }
    const auto is_zero = [](double weight) { return weight == 0; };
    if (!emitter.weights.empty() && log_.is_sound(path / "weights") &&
        std::ranges::all_of(emitter.weights, is_zero)) {
      log_.report(path / "weights", "are all 0", "at least one above 0");
    }
    const Path sizes = path / "sizes";
    if (emitter.sizes && log_.is_sound(sizes) && emitter.sizes->to <= emitter.sizes->from) {
      log_.report(sizes / "to", "is " + number_text(emitter.sizes->to),
                  "more than " + number_text(emitter.sizes->from) + ", which it is from");
    }
    const auto check_range = [&](const char* key, const auto& range) {
      const Path place = path / key;
      if (!range || !log_.is_sound(place) || (*range)[0] <= (*range)[1]) return;
      log_.report(place / 1, "is " + number_text((*range)[1]),
                  "at least " + number_text((*range)[0]) + ", the least");
    };
    check_range("roughness", emitter.roughness);
    check_range("clear_coat", emitter.clear_coat);
    if (!emitter.palette.empty() && emitter.colour) {
      log_.report_key(path / "palette", "stands beside \"colour\"", "one of the two");
    }
  }

  void check_event(const Event& event, const Path& path) {
    // An event of no known type is not judged as if it were another.
    if (!log_.is_sound(path / "type")) return;
    const auto* removal = std::get_if<RemoveEvent>(&event.action);
    if (removal != nullptr && removal->highest > 0 && scene_.gravity.isZero(0)) {
      log_.report(path / "highest", "needs gravity, which is zero", "\"bodies\" by name");
    }
    const Path names = path / "bodies";
    std::visit(
        [&](const auto& action) {
          for (size_t i = 0; i < action.bodies.size(); ++i) {
            const Path place = names / i;
            if (log_.is_sound(place)) check_target(event, action.bodies[i], place);
          }
        },
        event.action);
  }

  // That the bodies of `name` exist and that the event can do something to them.
  void check_target(const Event& event, const std::string& name, const Path& path) {
    const bool releases = std::holds_alternative<ReleaseEvent>(event.action);
    if (const auto found = bodies_.find(name); found != bodies_.end()) {
      const Body& body = scene_.bodies[found->second];
      if (releases && !body.held) {
        log_.report(path, "is " + quoted(name) + ", which is not held",
                    "a body with \"held\": true");
      } else if (std::holds_alternative<ImpulseEvent>(event.action) && body.role != Role::dynamic) {
        log_.report(path, "is " + quoted(name) + ", which is " + role_name(body.role),
                    "a dynamic body");
      }
      return;
    }
    const std::optional<OwnedName> owned = split_owned_name(name);
    const auto whole = owners_.find(name);
    const auto part = owned ? owners_.find(owned->owner) : owners_.end();
    if (whole == owners_.end() && part == owners_.end()) {
      log_.report(path, "is " + quoted(name) + ", which is no body, emitter or chain of the scene",
                  "the name of a body, an emitter or a chain", did_you_mean(name, body_names_));
      return;
    }
    if (releases) {
      log_.report(path, "is " + quoted(name) + ", but bodies of emitters and chains are never held",
                  "a body with \"held\": true");
    }
    if (whole != owners_.end()) return;
    const Owner& owner = part->second;
    const Path list = root_ / owner.list;
    const Path place = list / owner.index;
    if (!log_.is_sound(place / "count")) return;
    const bool depends_on_mesh = owner.count == 0;
    if (!depends_on_mesh && static_cast<double>(owned->index) >= owner.count) {
      log_.report(path,
                  "is " + quoted(name) + ", but " + quoted(part->first) + " has " +
                      counted(static_cast<uint64_t>(owner.count), "body", "bodies"),
                  "an index below " + number_text(owner.count) + " (they count from 0)");
    }
  }

  void check_method() {
    const SimulatorSettings& simulator = scene_.simulator;
    if (simulator.method == Method::own) return;
    const Path place = root_ / "simulator";
    if (simulator.mode != SimulatorMode::statistical && simulator.mode != SimulatorMode::mixed) {
      log_.report(place / "method",
                  R"(is "dissertation" in the )" + mode_name(simulator.mode) + " mode",
                  R"("own": chapter 3 is the statistical mode's, chapter 4 the mixed one's)",
                  R"(Set /simulator/mode to "statistical" or "mixed", or take the key away)");
    }
    if (simulator.mode == SimulatorMode::mixed && !scene_.piles.empty()) {
      log_.report(root_ / "piles", R"(stand beside /simulator/method "dissertation")",
                  "none: sampled contacts cannot be steered", R"(Set /simulator/method to "own")");
    }
  }

  // Spheres that stand for bodies have the rolling resistance of their mode.
  void check_spheres_of_materials() {
    const SimulatorMode mode = scene_.simulator.mode;
    if (mode == SimulatorMode::impulse || !log_.is_sound_itself(materials_)) return;
    const bool is_mixed = mode == SimulatorMode::mixed;
    std::map<std::string, std::string> first;  // material -> who is a sphere of it
    const auto note = [&](const std::string& material, Preference preference,
                          const std::string& name) {
      if (is_mixed && preference == Preference::must_impulse) return;
      first.emplace(material, name);
    };
    for (const Body& body : scene_.bodies) {
      if (body.role == Role::dynamic) note(body.material, body.preference, body.name);
    }
    for (const Emitter& emitter : scene_.emitters) {
      const auto& materials =
          emitter.materials.empty() ? std::vector{emitter.material} : emitter.materials;
      for (const std::string& material : materials) {
        note(material, emitter.preference, emitter.name);
      }
    }
    for (const auto& sphere : first) {
      const std::string &material = sphere.first, &name = sphere.second;
      const auto found = scene_.materials.find(material);
      if (found == scene_.materials.end()) continue;
      const auto check = [&](const char* key, double value) {
        const Path place = materials_ / material;
        if (value == 0 || !log_.is_sound(place / key)) return;
        log_.report(place / key,
                    "is " + number_text(value) + ", and " + quoted(name) +
                        " of this material is a sphere in the " + mode_name(mode) + " mode",
                    "0: spheres have the rolling resistance of their mode",
                    is_mixed ? R"(Give the body "preference": "must_impulse" or another material)"
                             : R"(Set /simulator/mode to "impulse", or take the key away)");
      };
      check("rolling_friction", found->second.rolling_friction);
      check("spinning_friction", found->second.spinning_friction);
    }
  }

  void check_counts() {
    double bodies = static_cast<double>(scene_.bodies.size());
    for (const Emitter& emitter : scene_.emitters) bodies += known_count(emitter);
    if (bodies > kMostBodies) {
      log_.report(root_, "has " + number_text(bodies) + " bodies",
                  "at most " + std::to_string(kMostBodies));
    }
    constexpr double kMostFrames = 10'000'000;
    const double frames = scene_.duration_s * scene_.frame_rate;
    if (frames > kMostFrames) {
      log_.report(root_ / "duration_s",
                  "gives " + number_text(std::floor(frames)) + " frames at frame_rate " +
                      number_text(scene_.frame_rate),
                  "at most " + number_text(kMostFrames) + " frames");
    }
  }

  void check_camera(const Camera& camera, const Path& path) {
    const bool is_keyed = camera.keys.size() > 1;
    const Path keys = path / "keys";
    for (size_t i = 0; i < camera.keys.size(); ++i) {
      const CameraKey& key = camera.keys[i];
      const Path keyed = keys / i;
      const Path& place = is_keyed ? keyed : path;
      if (log_.is_sound(path) && key.position == key.target) {
        log_.report(place, "has its position at its target", "two different points");
      }
    }
    check_ascending(camera.keys, keys);
  }

  void check_cameras(const Path& path) {
    std::set<std::string> names = {"camera", "all"};
    for (size_t i = 0; i < scene_.cameras.size(); ++i) {
      const NamedCamera& camera = scene_.cameras[i];
      const Path place = path / i;
      if (!log_.is_sound(place)) continue;
      const auto is_plain = [](unsigned char c) {
        return std::isalnum(c) != 0 || c == '_' || c == '-';
      };
      if (!std::ranges::all_of(camera.name, is_plain)) {
        log_.report(place / "name", "is " + quoted(camera.name),
                    "letters, digits, _ and -: a directory is called so");
      } else if (!names.insert(camera.name).second) {
        log_.report(place / "name", "is " + quoted(camera.name),
                    "a name of its own; \"camera\" is the scene's own one, and \"all\" means all");
      }
      if (camera.path) {
        check_camera(*camera.path, camera.path->keys.size() > 1 ? place : place / "view");
      }
      if (camera.random_views) check_ranges(*camera.random_views, place / "random_views");
    }
  }

  void check_ranges(const RandomViews& views, const Path& path) {
    const auto check = [&](const std::array<double, 2>& range, const char* key) {
      if (range[0] <= range[1]) return;
      log_.report(path / key, "begins above its end", "[least, most]");
    };
    check(views.distance_m, "distance_m");
    check(views.elevation, "elevation_deg");
  }

  template <class Key>
  void check_ascending(const std::vector<Key>& keys, const Path& path) {
    if (!log_.is_sound(path)) return;
    for (size_t i = 1; i < keys.size(); ++i) {
      if (keys[i].time_s > keys[i - 1].time_s) continue;
      const Path key = path / i;
      log_.report(key / "time_s", "is " + number_text(keys[i].time_s),
                  "a time after " + number_text(keys[i - 1].time_s) + ", that of the key before");
    }
  }

  const Scene& scene_;
  const Json& document_;
  ProblemLog& log_;
  const Path root_;
  const Path shapes_ = root_ / "shapes";
  const Path materials_ = root_ / "materials";
  std::vector<std::string> shape_names_, material_names_, body_names_;
  // An emitter or a chain; its bodies are called "<name>/<index>".
  struct Owner {
    std::string list;  // of the scene
    size_t index = 0;
    double count = 0;  // 0: a mesh decides
    std::string pointer() const { return '/' + list + '/' + std::to_string(index); }
  };
  std::map<std::string, size_t> bodies_;  // name -> first index
  std::map<std::string, Owner> owners_;   // by name: the first
};

// `kind`: "a mesh file".
void check_file(const std::filesystem::path& file, const std::string& kind, const Path& path,
                ProblemLog& log) {
  if (file.empty()) return;  // reported when it was read
  std::error_code fault;
  const auto status = std::filesystem::status(file, fault);
  const std::string found = "is " + quoted(file.lexically_normal().string());
  if (status.type() == std::filesystem::file_type::not_found) {
    log.report(path, found + ", which does not exist", kind);
  } else if (std::filesystem::is_directory(status)) {
    log.report(path, found + ", a directory", kind);
  } else if (status.type() == std::filesystem::file_type::none) {
    log.report(path, found + ", which cannot be read: " + fault.message(), kind);
  }
}

}  // namespace

void check_mesh_files(const Scene& scene, ProblemLog& log) {
  const std::string kMesh = "a mesh file";
  const Path root;
  const Path shapes = root / "shapes";
  for (const auto& [name, shape] : scene.shapes) {
    const Path place = shapes / name;
    const auto* mesh = std::get_if<MeshShape>(&shape);
    if (mesh != nullptr) check_file(mesh->file, kMesh, place / "file", log);
    const auto* terrain = std::get_if<TerrainShape>(&shape);
    if (terrain != nullptr) check_file(terrain->file, "a PNG", place / "file", log);
    const auto* text = std::get_if<TextShape>(&shape);
    if (text != nullptr && text->font) check_file(*text->font, "a font file", place / "font", log);
  }
  const Path emitters = root / "emitters";
  for (size_t i = 0; i < scene.emitters.size(); ++i) {
    const Path place = emitters / i;
    const auto* volume = std::get_if<VolumeSource>(&scene.emitters[i].source);
    if (volume != nullptr) check_file(volume->file, kMesh, place / "file", log);
  }
  if (const auto& sky = scene.render.light.sky_file) {
    const Path render = root / "render", light = render / "light";
    check_file(*sky, "a picture of the sky", light / "sky_file", log);
  }
  if (scene.guide && scene.guide->file) {
    const Path place = root / "guide";
    check_file(*scene.guide->file, kMesh, place / "file", log);
  }
}

void check_scene(const Scene& scene, const Json& document, ProblemLog& log) {
  Checker(scene, document, log).check();
  check_piles(scene, log);
  check_guide(scene, log);
  check_detail(scene, log);
  check_engine(scene, log);
  check_joints(scene, log);
}

}  // namespace pilesim
