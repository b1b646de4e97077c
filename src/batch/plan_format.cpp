// The file format of plans: its keys and their meaning.

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include "batch/plan.h"
#include "batch/steps.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/naming.h"
#include "core/philox.h"
#include "json/document.h"
#include "json/object_codec.h"

namespace pilesim {
namespace {

constexpr size_t kMostRows = 1'000'000;
constexpr size_t kLongestWord = 100'000;  // bytes, of a step: the system's limit

struct WrittenVariation {
  std::vector<std::string> pointers;
  std::optional<std::vector<Json>> values, choice;
  std::optional<std::vector<double>> range, uniform, log_uniform;
  std::optional<std::array<int, 2>> integers;
  std::optional<std::string> files;
};

struct WrittenPlan {
  int version = 0;
  std::string name;
  std::filesystem::path scene;
  uint64_t seed = 1;
  int count = 1, tries = 1;
  double longest_s = 3600;
  std::vector<WrittenVariation> vary;
  std::vector<BatchStep> steps;
  std::vector<std::string> drop, drop_packed;
  std::vector<Collection> collect;
  int tar_jobs = 100;
};

// A word of a step; it may be longer than a name.
Codec<std::string> word() {
  Codec<std::string> codec = text();
  codec.expected = "a string of 1 to " + std::to_string(kLongestWord) + " bytes";
  codec.read = [expected = codec.expected](const Json& json, const Path& path, std::string& value,
                                           ReadContext& context) {
    const size_t size = json.is_string() ? json.get_ref<const std::string&>().size() : 0;
    if (size == 0 || size > kLongestWord) {
      context.log.report(path, describe_value(json), expected);
    } else {
      value = json.get<std::string>();
    }
  };
  return codec;
}

Codec<Json> any_value() {
  Codec<Json> codec;
  codec.expected = "any value";
  codec.schema = Json::object();
  codec.read = [](const Json& json, const Path&, Json& value, ReadContext&) { value = json; };
  codec.write = [](const Json& value) { return value; };
  return codec;
}

bool is_pointer(const std::string& text) {
  try {
    return text.starts_with('/') && !Json::json_pointer(text).empty();
  } catch (const Json::exception&) {
    return false;
  }
}

bool is_name(const std::string& text) {
  return !text.empty() && std::ranges::all_of(text, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '_';
  });
}

// "/seed", "mesh", or an array of them.
Codec<std::vector<std::string>> pointers() {
  Codec<std::vector<std::string>> codec;
  codec.expected =
      "a JSON pointer into the scene (\"/seed\"), a name that steps have in braces (\"mesh\"), or "
      "an "
      "array of them";
  codec.schema = {
      {"anyOf", {{{"type", "string"}}, {{"type", "array"}, {"items", {{"type", "string"}}}}}}};
  codec.read = [expected = codec.expected](const Json& json, const Path& path,
                                           std::vector<std::string>& value, ReadContext& context) {
    const Json all = json.is_array() ? json : Json::array({json});
    value.clear();
    for (const Json& each : all) {
      if (!each.is_string()) break;
      if (!is_pointer(each.get<std::string>()) && !is_name(each.get<std::string>())) break;
      value.push_back(each.get<std::string>());
    }
    if (value.empty() || value.size() != all.size()) {
      context.log.report(path, describe_value(json), expected);
    }
  };
  codec.write = [](const std::vector<std::string>& value) { return Json(value); };
  return codec;
}

// Two numbers, the second no smaller; with `step` a third one above 0.
Codec<std::vector<double>> bounds(const Range& each, bool with_step) {
  Codec<std::vector<double>> codec;
  codec.expected = with_step ? "[first, last] or [first, last, step above 0]"
                             : "[low, high], each " + each.phrase("a number");
  codec.schema = {{"type", "array"}, {"items", {{"type", "number"}}}};
  codec.read = [each, with_step, expected = codec.expected](const Json& json, const Path& path,
                                                            std::vector<double>& value,
                                                            ReadContext& context) {
    value.clear();
    const bool is_sized = json.is_array() && (json.size() == 2 || (with_step && json.size() == 3));
    for (const Json& number : is_sized ? json : Json::array()) {
      if (number.is_number() && each.contains(number.get<double>())) {
        value.push_back(number.get<double>());
      }
    }
    if (!is_sized || value.size() != json.size() || value[1] < value[0] ||
        (value.size() == 3 && value[2] <= 0)) {
      context.log.report(path, describe_value(json), expected);
      value = {0, 0};
    }
  };
  codec.write = [](const std::vector<double>& value) { return Json(value); };
  return codec;
}

ObjectDescription<WrittenVariation> variation() {
  using V = WrittenVariation;
  const auto source = [](Field<V> field) {
    field.key.is_required = true;
    return in_group("source", std::move(field));
  };
  return {.noun = "a variation",
          .fields = {
              required_field<V>("set", &V::pointers, pointers(),
                                "Target: a JSON pointer into the scene, a name that steps have in "
                                "braces, or several."),
              source(optional_field<V>(
                  "values", &V::values, list(any_value(), 1),
                  "Values in order; for several pointers, an array of values for each.")),
              source(optional_field<V>(
                  "range", &V::range, bounds(kAnyNumber, true),
                  "Numbers from the first to the last, in steps of 1 or of the third number.")),
              source(optional_field<V>(
                  "files", &V::files, word(),
                  "Files by name, with the wildcards * and ?, relative to the plan.")),
              source(optional_field<V>("uniform", &V::uniform, bounds(kAnyNumber, false),
                                       "Random for each job, uniform between two numbers.")),
              source(optional_field<V>("log_uniform", &V::log_uniform, bounds(above(0), false),
                                       "Random for each job, with a uniform logarithm.")),
              source(optional_field<V>("integers", &V::integers,
                                       integers<2>(-1'000'000'000, 1'000'000'000, "first and last"),
                                       "Random integer for each job, including both ends.")),
              source(optional_field<V>("choice", &V::choice, list(any_value(), 1),
                                       "One of these at random for each job."))}};
}

const std::vector<std::pair<std::string, Collection>> kCollections = {
    {"coco", Collection::coco}, {"bop", Collection::bop}, {"tar", Collection::tar}};

ObjectDescription<WrittenPlan> plan_description() {
  using P = WrittenPlan;
  return {
      .noun = "a plan",
      .fields = {
          required_field<P>("version", &P::version, integer_choice({1}), "Version of the format."),
          field<P>("name", &P::name, text(), "Name of the plan in messages."),
          field<P>("scene", &P::scene, file_path(), "Path of the scene, relative to the plan."),
          field<P>("seed", &P::seed, unsigned_integer(), "Seed of all random values."),
          field<P>("count", &P::count, integer(1, 100'000'000),
                   "Jobs for each combination of values, ranges and files."),
          field<P>("vary", &P::vary, list(object(variation())), "Differences between jobs."),
          required_field<P>("steps", &P::steps, list(list(word(), 1), 1),
                            "Commands of pilesim with their options, in order."),
          field<P>("tries", &P::tries, integer(1, 1000),
                   "Most attempts at a job, each with another seed."),
          field<P>("longest_s", &P::longest_s, number(above(0)), "Longest wall time of a step."),
          field<P>("drop", &P::drop, list(word()),
                   "Paths in the directory of a finished job to remove."),
          field<P>("collect", &P::collect, list(enumeration(kCollections)),
                   "Datasets of all jobs together."),
          field<P>("tar_jobs", &P::tar_jobs, integer(1, 1'000'000), "Jobs in a tar file."),
          field<P>("drop_packed", &P::drop_packed, list(word()),
                   "Paths in a job's directory to remove once the job is in a tar file.")}};
}

// `*` and `?` are wildcards.
bool matches(std::string_view name, std::string_view pattern) {
  if (pattern.empty()) return name.empty();
  if (pattern.front() == '*') {
    for (size_t taken = 0; taken <= name.size(); ++taken) {
      if (matches(name.substr(taken), pattern.substr(1))) return true;
    }
    return false;
  }
  return !name.empty() && (pattern.front() == '?' || pattern.front() == name.front()) &&
         matches(name.substr(1), pattern.substr(1));
}

// Rows of regular files, ordered by name, relative to `base`.
std::vector<std::vector<Json>> file_rows(const std::string& pattern,
                                         const std::filesystem::path& plan,
                                         const std::filesystem::path& base) {
  const std::filesystem::path whole = plan.parent_path() / pattern;
  std::vector<std::string> names;
  std::error_code fault;
  for (const auto& entry : std::filesystem::directory_iterator(whole.parent_path(), fault)) {
    const std::string name = entry.path().filename().string();
    const bool is_hidden = name.starts_with('.');
    if (!is_hidden && entry.is_regular_file(fault) && matches(name, whole.filename().string())) {
      names.push_back(name);
    }
  }
  std::ranges::sort(names);
  const std::filesystem::path folder =
      whole.parent_path().lexically_normal().lexically_relative(base);
  std::vector<std::vector<Json>> rows;
  for (const std::string& name : names)
    rows.push_back({(folder / name).lexically_normal().string()});
  return rows;
}

std::vector<std::vector<Json>> range_rows(const std::vector<double>& range) {
  const double step = range.size() == 3 ? range[2] : 1;
  // Half a millionth of a step covers rounding.
  const double count = std::floor((range[1] - range[0]) / step + 5e-7) + 1;
  if (count > static_cast<double>(kMostRows)) return {};
  std::vector<std::vector<Json>> rows;
  for (double i = 0; i < count; ++i) {
    const double value = range[0] + i * step;
    const bool is_whole = value == std::round(value) && std::abs(value) < 0x1p53;
    rows.push_back({is_whole ? Json(static_cast<int64_t>(value)) : Json(value)});
  }
  return rows;
}

Draw draw_of(Draw::Kind kind, const std::vector<double>& range) {
  return {.kind = kind, .low = range[0], .high = range[1], .choices = {}};
}

Variation to_variation(const WrittenVariation& written, const Path& path, const BatchPlan& plan,
                       ProblemLog& log) {
  Variation made{.pointers = written.pointers};
  const size_t width = written.pointers.size();
  if (written.values) {
    for (size_t i = 0; i < written.values->size(); ++i) {
      const Json& value = (*written.values)[i];
      if (width == 1) {
        made.rows.push_back({value});
      } else if (value.is_array() && value.size() == width) {
        made.rows.emplace_back(value.begin(), value.end());
      } else {
        const Path values = path / "values";
        log.report(
            values / i, describe_value(value),
            "an array of " + std::to_string(width) + " values, one for each pointer of \"set\"");
      }
    }
    return made;
  }
  if (width > 1) {
    log.report(path / "set", "has " + std::to_string(width) + " pointers",
               "one, or \"values\" with arrays");
  }
  if (written.range) {
    made.rows = range_rows(*written.range);
    if (made.rows.empty()) {
      log.report(path / "range", "has too many values", "at most " + std::to_string(kMostRows));
    }
  } else if (written.files) {
    made.are_files = true;
    made.rows = file_rows(*written.files, plan.file, plan.base_of(written.pointers.front()));
    if (made.rows.empty()) {
      log.report(path / "files", "is \"" + *written.files + "\", and no file has such a name",
                 "the name of a file, with * and ? in its last part, relative to the plan");
    }
  } else if (written.uniform) {
    made.draw = draw_of(Draw::Kind::uniform, *written.uniform);
  } else if (written.log_uniform) {
    made.draw = draw_of(Draw::Kind::log_uniform, *written.log_uniform);
  } else if (written.integers) {
    const auto [low, high] = *written.integers;
    made.draw =
        draw_of(Draw::Kind::integers, {static_cast<double>(low), static_cast<double>(high)});
    if (high < low) {
      log.report(path / "integers", "ends before it begins", "the smaller number first");
    }
  } else if (written.choice) {
    made.draw = Draw{.kind = Draw::Kind::choice, .choices = *written.choice};
  }
  return made;
}

void check_grid(const BatchPlan& plan, ProblemLog& log) {
  double jobs = plan.count;
  for (const Variation& variation : plan.vary) {
    jobs *= static_cast<double>(std::max<size_t>(variation.rows.size(), 1));
  }
  const Path root;
  if (jobs > static_cast<double>(kMostJobs)) {
    log.report(root, "has more than " + std::to_string(kMostJobs) + " jobs", "fewer combinations");
  }
  std::set<std::string> seen;
  const Path vary = root / "vary";
  for (size_t i = 0; i < plan.vary.size(); ++i) {
    const Path path = vary / i;
    for (const std::string& pointer : plan.vary[i].pointers) {
      if (!seen.insert(pointer).second) {
        log.report(path / "set", "sets \"" + pointer + "\" again", "each pointer once in a plan");
      }
    }
  }
}

// Checks that some step draws the pictures for the collections.
void check_collections(const BatchPlan& plan, ProblemLog& log) {
  const Path root, collect = root / "collect";
  const auto draws = [&](const std::string& annotations) {
    return std::ranges::any_of(plan.steps, [&](const BatchStep& step) {
      const auto names = [&](const std::string& word) {
        return word.find(annotations) != word.npos;
      };
      return step[0] == "render" && std::any_of(step.begin() + 1, step.end(), names);
    });
  };
  for (size_t i = 0; i < plan.collect.size(); ++i) {
    const bool is_coco = plan.collect[i] == Collection::coco;
    if (plan.collect[i] == Collection::tar) continue;
    const std::string word = is_coco ? "coco" : "bop";
    if (draws(word)) continue;
    log.report(collect / i, "is \"" + word + "\", and no step draws it",
               "a step \"render\" with --annotations " + word);
  }
}

void check_drop(const char* key, const std::vector<std::string>& drop, ProblemLog& log) {
  const Path root, path = root / key;
  for (size_t i = 0; i < drop.size(); ++i) {
    const auto normal = std::filesystem::path(drop[i]).lexically_normal();
    if (normal.is_absolute() || normal.empty() || *normal.begin() == ".." || normal == ".") {
      log.report(path / i, "is \"" + drop[i] + '"', "a path below the job's directory");
    }
  }
}

}  // namespace

BatchPlan load_batch_plan(const std::filesystem::path& file) {
  const std::string text = advising(file, "Copy an example: pilesim presets copy batch/bins.plan",
                                    [&] { return read_file(file, kMostJsonBytes); });
  const Json document = parse_json(text, file.string());
  const bool is_scene =
      document.is_object() && !document.contains("steps") &&
      (document.contains("shapes") || document.contains("bodies") || document.contains("emitters"));
  if (is_scene) {
    throw Error(ErrorKind::input,
                Problem{.file = file.string(),
                        .found = "is a scene",
                        .expected = "a plan, which names a scene and has \"steps\"",
                        .remedy = "Run the scene with pilesim simulate, or name it in a plan: "
                                  "{\"version\": 1, \"scene\": \"" +
                                  file.filename().string() +
                                  "\", \"count\": 10, \"steps\": [[\"simulate\"]]}"});
  }
  ReadContext context{.directory = std::filesystem::absolute(file).parent_path()};
  WrittenPlan written;
  object(plan_description()).read(document, Path(), written, context);

  // The next checks need at least the scene's name.
  throw_findings(context.log, text, file.string());
  BatchPlan plan{.name = written.name,
                 .file = std::filesystem::absolute(file).lexically_normal(),
                 .scene = written.scene.empty()
                              ? std::filesystem::path()
                              : std::filesystem::absolute(written.scene).lexically_normal(),
                 .seed = written.seed,
                 .count = written.count,
                 .steps = written.steps,
                 .tries = written.tries,
                 .longest_s = written.longest_s,
                 .drop = written.drop,
                 .collect = written.collect,
                 .tar_jobs = written.tar_jobs,
                 .drop_packed = written.drop_packed,
                 .document = document};
  const Path root, vary = root / "vary";
  for (size_t i = 0; i < written.vary.size(); ++i) {
    plan.vary.push_back(to_variation(written.vary[i], vary / i, plan, context.log));
  }
  check_steps(plan, context.log);
  check_grid(plan, context.log);
  check_drop("drop", plan.drop, context.log);
  check_drop("drop_packed", plan.drop_packed, context.log);
  check_collections(plan, context.log);
  if (!plan.drop_packed.empty() && !plan.collects(Collection::tar)) {
    context.log.report(root / "drop_packed", "stands without tar files", "\"tar\" in \"collect\"");
  }
  if (!plan.drop_packed.empty() &&
      (plan.collects(Collection::coco) || plan.collects(Collection::bop))) {
    context.log.report(root / "drop_packed", "would remove files that \"coco\" and \"bop\" collect",
                       "\"tar\" alone in \"collect\"");
  }
  throw_findings(context.log, text, file.string());
  return plan;
}

}  // namespace pilesim
