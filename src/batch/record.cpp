#include "batch/record.h"

#include <algorithm>
#include <set>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/text.h"
#include "json/document.h"
#include "json/object_codec.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

constexpr int kVersion = 1;

// Files whose content differs between runs, since it contains times, or is the batch's own.
constexpr std::string_view kTimed[] = {
    "report.json",           "report.html", "timing.csv", "checkpoint.bin",
    "render_checkpoint.bin", "log.txt",     "lock",       kJobFile};

const std::vector<std::pair<std::string, AttemptEnd>> kEnds = {{"done", AttemptEnd::done},
                                                               {"gate", AttemptEnd::gate},
                                                               {"failed", AttemptEnd::failed},
                                                               {"died", AttemptEnd::died},
                                                               {"too long", AttemptEnd::too_long}};

Codec<std::string> any_text() {
  Codec<std::string> codec = text();
  codec.expected = "a string";
  codec.read = [](const Json& json, const Path& path, std::string& value, ReadContext& context) {
    if (json.is_string()) {
      value = json.get<std::string>();
    } else {
      context.log.report(path, describe_value(json), "a string");
    }
  };
  return codec;
}

Codec<Json> values_object() {
  Codec<Json> codec;
  codec.expected = "an object";
  codec.schema = {{"type", "object"}};
  codec.read = [](const Json& json, const Path& path, Json& value, ReadContext& context) {
    if (json.is_object()) {
      value = json;
    } else {
      context.log.report(path, describe_value(json), "an object");
    }
  };
  codec.write = [](const Json& value) { return value; };
  return codec;
}

ObjectDescription<Attempt> attempt() {
  using A = Attempt;
  return {.noun = "an attempt",
          .fields = {required_field<A>("seed", &A::seed, unsigned_integer(), ""),
                     required_field<A>("end", &A::end, enumeration(kEnds), ""),
                     required_field<A>("what", &A::what, any_text(), ""),
                     required_field<A>("wall_s", &A::wall_s, number(at_least(0)), ""),
                     required_field<A>("processor_s", &A::processor_s, number(at_least(0)), ""),
                     required_field<A>("peak_memory_bytes", &A::peak_memory_bytes,
                                       unsigned_integer(), "")}};
}

struct Stored {
  int version = kVersion;
  JobRecord record;
};

const Codec<Stored>& record_codec() {
  const auto of = [](auto member) {
    return [member](auto& stored) -> auto& { return stored.record.*member; };
  };
  using S = Stored;
  using R = JobRecord;
  static const Codec<Stored> codec = object(ObjectDescription<Stored>{
      .noun = "the record of a job",
      .fields = {required_field<S>("version", &S::version, integer_choice({kVersion}), ""),
                 required_field<S>("index", of(&R::index), unsigned_integer(), ""),
                 required_field<S>("key", of(&R::key), any_text(), ""),
                 required_field<S>("values", of(&R::values), values_object(), ""),
                 required_field<S>("attempts", of(&R::attempts), list(object(attempt())), ""),
                 required_field<S>("steps_done", of(&R::steps_done), integer(0, 1'000'000), ""),
                 required_field<S>("hash", of(&R::hash), any_text(), ""),
                 required_field<S>("files", of(&R::files), unsigned_integer(), ""),
                 required_field<S>("bytes", of(&R::bytes), unsigned_integer(), "")}});
  return codec;
}

std::string csv_field(const std::string& text) {
  // Spreadsheets read cells that begin like this as formulas, but not after an apostrophe.
  const bool is_formula = !text.empty() && std::string_view("=@").find(text[0]) != text.npos;
  if (!is_formula && text.find_first_of(",\"\n\r") == text.npos) return text;
  std::string quoted = is_formula ? "\"'" : "\"";
  for (const char c : text) {
    quoted += c;
    if (c == '"') quoted += c;
  }
  return quoted + '"';
}

std::string end_of(const JobRecord& record) {
  if (record.attempts.empty()) return "";
  return std::string(attempt_end_name(record.attempts.back().end));
}

BatchJob job_of(const JobRecord& record) { return {.index = record.index, .values = {}}; }

}  // namespace

std::string_view attempt_end_name(AttemptEnd end) {
  for (const auto& [name, value] : kEnds) {
    if (value == end) return name;
  }
  return "";
}

int JobRecord::verdicts() const {
  return static_cast<int>(std::ranges::count_if(
      attempts, [](const Attempt& attempt) { return attempt.end != AttemptEnd::died; }));
}

double JobRecord::wall_s() const {
  double sum = 0;
  for (const Attempt& attempt : attempts) sum += attempt.wall_s;
  return sum;
}

double JobRecord::processor_s() const {
  double sum = 0;
  for (const Attempt& attempt : attempts) sum += attempt.processor_s;
  return sum;
}

uint64_t JobRecord::peak_memory_bytes() const {
  uint64_t peak = 0;
  for (const Attempt& attempt : attempts) peak = std::max(peak, attempt.peak_memory_bytes);
  return peak;
}

JobRecord parse_record(const std::string& text, const std::string& file) {
  const Json document = parse_json(text, file);
  ReadContext context;
  Stored stored;
  record_codec().read(document, Path(), stored, context);
  throw_findings(context.log, text, file);
  return std::move(stored.record);
}

JobRecord read_job_record(const fs::path& file) {
  return parse_record(read_file(file, kMostJsonBytes), file.string());
}

void write_job_record(const fs::path& file, const JobRecord& record) {
  const Json json = record_codec().write({.record = record});
  write_file_atomically(file, json.dump(2, ' ', false, Json::error_handler_t::replace) + '\n');
}

std::string record_line(const JobRecord& record) {
  const Json json = record_codec().write({.record = record});
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
}

std::string index_line(const JobRecord& record) {
  Json seeds = Json::array();
  for (const Attempt& attempt : record.attempts) {
    // Ignored: the job succeeded later.
    if (record.is_done() && attempt.end == AttemptEnd::died) continue;
    seeds.push_back({{"seed", attempt.seed}, {"end", attempt_end_name(attempt.end)}});
  }
  const Json json = {{"id", job_of(record).name()}, {"end", end_of(record)},
                     {"values", record.values},     {"attempts", std::move(seeds)},
                     {"key", record.key},           {"hash", record.hash}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
}

std::string table_head(const BatchPlan& plan) {
  std::string text = "id,end,tries,seed";
  for (const Variation& variation : plan.vary) {
    for (const std::string& pointer : variation.pointers) text += ',' + csv_field(pointer);
  }
  return text + ",wall_s,processor_s,peak_memory_bytes,files,bytes,hash,what\n";
}

std::string table_row(const BatchPlan& plan, const JobRecord& record) {
  const bool is_tried = !record.attempts.empty();
  std::string text = job_of(record).name() + ',' + end_of(record) + ',' +
                     std::to_string(record.attempts.size()) + ',' +
                     (is_tried ? std::to_string(record.attempts.back().seed) : "");
  for (const Variation& variation : plan.vary) {
    for (const std::string& pointer : variation.pointers) {
      const auto value = record.values.find(pointer);
      text += ',';
      if (value == record.values.end()) continue;
      text += csv_field(value->is_string() ? value->get<std::string>() : value->dump());
    }
  }
  return text + ',' + with_digits(record.wall_s(), 6) + ',' + with_digits(record.processor_s(), 6) +
         ',' + std::to_string(record.peak_memory_bytes()) + ',' + std::to_string(record.files) +
         ',' + std::to_string(record.bytes) + ',' + record.hash + ',' +
         csv_field(is_tried ? record.attempts.back().what : "") + '\n';
}

ResultSum sum_results(const fs::path& directory) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::recursive_directory_iterator(directory)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  ResultSum sum;
  Hasher hasher;
  for (const fs::path& file : files) {
    ++sum.files;
    sum.bytes += fs::file_size(file);
    const std::string name = file.filename().string();
    if (std::ranges::find(kTimed, name) != std::end(kTimed)) continue;
    const std::string entry =
        file.lexically_relative(directory).string() + '\n' + content_hash(read_file(file)) + '\n';
    hasher.add(std::as_bytes(std::span(entry)));
  }
  sum.hash = hasher.digest();
  return sum;
}

}  // namespace pilesim
