#include "batch/plan.h"

#include <algorithm>
#include <cmath>

#include "batch/steps.h"
#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/philox.h"
#include "json/codec.h"
#include "scene/scene_loader.h"

namespace pilesim {
namespace {

// Most values of a grid to check in the scene before a run.
constexpr size_t kMostChecked = 200;
// Events of a job's random numbers: variations count from 0, attempts from here.
constexpr uint32_t kAttempts = 1u << 24;

Json drawn(const Draw& draw, Philox& random) {
  switch (draw.kind) {
    case Draw::Kind::uniform:
      return random.uniform(draw.low, draw.high);
    case Draw::Kind::log_uniform:
      return std::exp(random.uniform(std::log(draw.low), std::log(draw.high)));
    case Draw::Kind::integers: {
      const double count = draw.high - draw.low + 1;
      return static_cast<int64_t>(draw.low +
                                  std::min(std::floor(random.uniform() * count), count - 1));
    }
    case Draw::Kind::choice:
      return draw.choices[random.index(static_cast<uint32_t>(draw.choices.size()))];
  }
  return {};
}

std::string file_hash(const std::filesystem::path& file) { return content_hash(read_file(file)); }

// Hash of a mesh, or of a run's scene and number of frames.
std::string input_hash(const std::filesystem::path& input) {
  if (!std::filesystem::is_directory(input)) return file_hash(input);
  const std::filesystem::path store = input / "trajectory.zarr";
  return content_hash(read_file(store / ".zattrs") + read_file(store / "position" / ".zarray"));
}

std::vector<std::string> texts_of(const BatchJob& job) {
  std::vector<std::string> texts;
  for (const JobValue& value : job.values) {
    if (value.is_in_scene()) texts.push_back(override_text(value));
  }
  return texts;
}

bool is_varied(const BatchPlan& plan, const std::string& pointer) {
  return std::ranges::any_of(plan.vary, [&](const Variation& variation) {
    return std::ranges::find(variation.pointers, pointer) != variation.pointers.end();
  });
}

// Loads the scene once with each value of the grid, and with the first job's other values.
void check_values(const BatchPlan& plan) {
  const BatchJob first = batch_job(plan, 0);
  size_t checked = 0, at = 0;
  for (const Variation& variation : plan.vary) {
    for (size_t row = 1; row < variation.rows.size() && checked < kMostChecked; ++row, ++checked) {
      BatchJob job = first;
      for (size_t i = 0; i < variation.pointers.size(); ++i) {
        job.values[at + i].value = variation.rows[row][i];
      }
      load_scene(plan.scene, texts_of(job));
    }
    at += variation.pointers.size();
  }
}

}  // namespace

uint64_t BatchPlan::jobs() const {
  auto jobs = static_cast<uint64_t>(count);
  for (const Variation& variation : vary) jobs *= std::max<size_t>(variation.rows.size(), 1);
  return jobs;
}

bool BatchPlan::collects(Collection what) const {
  return std::ranges::find(collect, what) != collect.end();
}

std::filesystem::path BatchPlan::base_of(const std::string& pointer) const {
  return (pointer.starts_with('/') && !scene.empty() ? scene : file).parent_path();
}

std::string BatchJob::name() const {
  std::string digits = std::to_string(index);
  return std::string(digits.size() < 7 ? 7 - digits.size() : 0, '0') + digits;
}

BatchJob batch_job(const BatchPlan& plan, uint64_t index) {
  BatchJob job{.index = index};
  // The row of each variation in the grid; the last variation runs fastest. The whole grid comes
  // before repetitions, so that a larger count leaves existing jobs unchanged.
  std::vector<size_t> rows(plan.vary.size());
  uint64_t point = index;
  for (size_t i = plan.vary.size(); i-- > 0;) {
    const size_t size = std::max<size_t>(plan.vary[i].rows.size(), 1);
    rows[i] = point % size;
    point /= size;
  }
  for (size_t i = 0; i < plan.vary.size(); ++i) {
    const Variation& variation = plan.vary[i];
    if (variation.draw) {
      Philox random(plan.seed, Stream::batch, index, static_cast<uint32_t>(i));
      job.values.push_back({variation.pointers.front(), drawn(*variation.draw, random)});
      continue;
    }
    for (size_t p = 0; p < variation.pointers.size(); ++p) {
      job.values.push_back({variation.pointers[p], variation.rows[rows[i]][p]});
    }
  }
  return job;
}

uint64_t scene_seed(const BatchPlan& plan, const BatchJob& job, int attempt) {
  for (const JobValue& value : job.values) {
    if (attempt == 0 && value.pointer == "/seed" && value.value.is_number_integer()) {
      return value.value.get<uint64_t>();
    }
  }
  Philox random(plan.seed, Stream::batch, job.index, kAttempts + static_cast<uint32_t>(attempt));
  const uint64_t high = random.bits();
  const uint64_t low = random.bits();
  return (high << 32 | low) >> 11;
}

std::string override_text(const JobValue& value) {
  return value.pointer + '=' + value.value.dump();
}

JobKeys::JobKeys(const BatchPlan& plan) : plan_(plan) {
  Hasher hasher;
  const auto add = [&](const std::string& text) {
    const uint64_t size = text.size();
    hasher.add_values(std::span(&size, 1));
    hasher.add(std::as_bytes(std::span(text)));
  };
  if (!plan.scene.empty()) {
    const LoadedScene loaded = load_scene(plan.scene, texts_of(batch_job(plan, 0)));
    check_values(plan);
    add(file_hash(plan.scene));
    for (const NamedFile& named : loaded.files) {
      if (!is_varied(plan, named.pointer)) add(file_hash(named.path));
    }
  }
  for (const BatchStep& step : plan.steps) {
    for (const std::string& word : step) add(word);
    add("");
  }
  for (const std::string& path : plan.drop) add(path);
  add(std::to_string(plan.seed));
  base_ = hasher.digest();
  for (const Variation& variation : plan.vary) {
    if (!variation.are_files) continue;
    const std::filesystem::path base = plan.base_of(variation.pointers.front());
    for (const std::vector<Json>& row : variation.rows) {
      const std::string name = row.front().get<std::string>();
      file_hashes_.emplace_back(name, file_hash(base / name));
    }
  }
  std::ranges::sort(file_hashes_);
}

std::string JobKeys::key(const BatchJob& job) const {
  std::string text = base_ + ' ' + std::to_string(job.index);
  if (plan_.scene.empty()) text += ' ' + input_hash(step_input(plan_, job));
  for (const JobValue& value : job.values) {
    text += '\n' + override_text(value);
    if (!value.value.is_string()) continue;
    const auto name = value.value.get<std::string>();
    const auto found = std::ranges::lower_bound(file_hashes_, name, {},
                                                &std::pair<std::string, std::string>::first);
    if (found != file_hashes_.end() && found->first == name) text += ' ' + found->second;
  }
  return content_hash(text);
}

}  // namespace pilesim
