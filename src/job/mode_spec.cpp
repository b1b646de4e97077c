#include "job/mode_spec.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "core/error.h"
#include "core/text.h"
#include "json/json_text.h"
#include "scene/moving_shapes.h"

namespace pilesim {
namespace {

Error mode_error(const std::string& text, std::string found, std::string expected) {
  return {ErrorKind::usage,
          Problem{.file = "mode \"" + text + "\"",
                  .found = std::move(found),
                  .expected = std::move(expected),
                  .remedy =
                      "Write MODE[:COLLISION[COUNT]][@STEP][+finish][+/POINTER=VALUE], for example "
                      "impulse:spheres7@1/240"}};
}

// Splits `text` at the first `mark` and returns the part after it, or none without a mark.
std::optional<std::string> cut(std::string& text, char mark) {
  const size_t place = text.find(mark);
  if (place == text.npos) return std::nullopt;
  std::string rest = text.substr(place + 1);
  text.resize(place);
  return rest;
}

std::optional<double> number(const std::string& text) {
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, fault] = std::from_chars(text.data(), end, value);
  if (fault != std::errc() || rest != end) return std::nullopt;
  return value;
}

double parse_step(const std::string& text, const std::string& step) {
  std::string above = step;
  const std::optional<std::string> below = cut(above, '/');
  const std::optional<double> numerator = number(above);
  const std::optional<double> denominator = below ? number(*below) : std::optional(1.0);
  const double value = numerator && denominator ? *numerator / *denominator : 0;
  if (!(value > 0) || !std::isfinite(value)) {
    throw mode_error(text, "the step is \"" + step + '"', "seconds above 0, such as 1/240");
  }
  return value;
}

void add_collision(const std::string& text, const std::string& collision, const Scene& scene,
                   std::vector<std::string>& overrides) {
  static const std::map<std::string, std::string> kCounts = {
      {"hull", "hull_max_vertices"},
      {"decomposition", "decomposition_max_pieces"},
      {"spheres", "sphere_count"},
      {"sphere", ""}};
  const size_t digits = std::min(collision.find_first_of("0123456789"), collision.size());
  const std::string kind = collision.substr(0, digits);
  const std::string count = collision.substr(digits);
  const auto known = kCounts.find(kind);
  if (known == kCounts.end() || count.find_first_not_of("0123456789") != count.npos ||
      (!count.empty() && known->second.empty())) {
    throw mode_error(text, "the collision is \"" + collision + '"',
                     "hull, decomposition, spheres, each with a count if wanted, or sphere");
  }
  const std::set<std::string> meshes = dynamic_meshes(scene);
  if (meshes.empty()) {
    throw mode_error(text, "the collision is \"" + collision + "\", but no dynamic body has a mesh",
                     "a mode without collision: only meshes have one to choose");
  }
  for (const std::string& name : meshes) {
    const std::string shape = "/shapes/" + escape_pointer_token(name) + '/';
    overrides.push_back(shape + "collision=" + kind);
    if (!count.empty()) overrides.push_back(shape + known->second + '=' + count);
  }
}

}  // namespace

std::set<std::string> dynamic_meshes(const Scene& scene) {
  std::set<std::string> meshes;
  for (const auto& [name, materials] : moving_shapes(scene)) {
    const Shape& shape = scene.shapes.at(name);
    if (std::holds_alternative<MeshShape>(shape)) meshes.insert(name);
    if (const auto* compound = std::get_if<CompoundShape>(&shape)) {
      for (const CompoundPart& part : compound->parts) {
        if (std::holds_alternative<MeshShape>(scene.shapes.at(part.shape))) {
          meshes.insert(part.shape);
        }
      }
    }
  }
  return meshes;
}

std::vector<std::string> split_modes(const std::string& text) {
  std::vector<std::string> modes(1);
  int depth = 0;
  for (const char c : text) {
    if (c == '[' || c == '{') ++depth;
    if (c == ']' || c == '}') --depth;
    if (c == ',' && depth <= 0) {
      modes.emplace_back();
    } else {
      modes.back() += c;
    }
  }
  if (std::ranges::any_of(modes, &std::string::empty)) {
    throw mode_error(text, "there is an empty name", "names with commas in between");
  }
  return modes;
}

ModeSpec resolve_mode(const std::string& text, const Scene& scene) {
  ModeSpec spec{.name = text};
  for (const char c : text) spec.directory += std::isalnum(c) != 0 || c == '.' ? c : '_';
  std::string mode = text;
  std::optional<std::string> more = cut(mode, '+');
  const std::optional<std::string> step = cut(mode, '@');
  const std::optional<std::string> collision = cut(mode, ':');
  if (mode.empty()) throw mode_error(text, "it begins with no mode", "impulse, statistical, ...");

  spec.overrides.push_back("/simulator/mode=" + mode);
  // Runs are compared frame by frame, so they need the same length.
  if (scene.until == Until::settled) spec.overrides.push_back("/until=duration");
  if (mode != mode_name(scene.simulator.mode)) {
    const Scene defaults;
    spec.overrides.push_back("/step_s=\"auto\"");
    spec.overrides.push_back("/simulator/solver_iterations=" +
                             std::to_string(defaults.simulator.solver_iterations));
  }
  if (collision) add_collision(text, *collision, scene, spec.overrides);
  if (step) spec.overrides.push_back("/step_s=" + with_digits(parse_step(text, *step), 17));
  // A comparison is of what the modes simulate.
  if (scene.finish.when == Finishing::by_mode) spec.overrides.push_back("/finish=false");
  while (more) {
    std::string one = *more;
    more = cut(one, '+');
    if (one == "finish") {
      spec.overrides.push_back("/finish=true");
      continue;
    }
    if (!one.starts_with('/') || one.find('=') == one.npos) {
      throw mode_error(text, "\"+" + one + '"', "+finish or +/POINTER=VALUE");
    }
    spec.overrides.push_back(one);
  }
  return spec;
}

}  // namespace pilesim
