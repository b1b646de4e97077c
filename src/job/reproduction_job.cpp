#include "job/reproduction_job.h"

#include <algorithm>
#include <sstream>

#include "core/atomic_file.h"
#include "core/clock.h"
#include "core/error.h"
#include "core/hash.h"
#include "core/interrupt.h"
#include "core/naming.h"
#include "core/output_directory.h"
#include "core/printable.h"
#include "core/temporary_file.h"
#include "job/child_run.h"
#include "json/json_text.h"
#include "report/charts.h"
#include "report/report_json.h"
#include "report/reproduction_page.h"
#include "report/run_measures.h"
#include "trajectory/trajectory.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

fs::path directory_of(const fs::path& output, const std::string& run) {
  return output / "runs" / run;
}

std::vector<std::string> arguments_of(const ReproductionRun& run, ReproductionSize size,
                                      const fs::path& output) {
  std::vector<std::pair<std::string, std::string>> places = {
      {"{out}", directory_of(output, run.name).string()}};
  for (const std::string& needed : run.needs) {
    places.emplace_back('{' + needed + '}', directory_of(output, needed).string());
  }
  std::vector<std::string> arguments = run.at(size).arguments;
  for (std::string& argument : arguments) {
    for (const auto& [name, path] : places) {
      const size_t at = argument.find(name);
      if (at != std::string::npos) argument.replace(at, name.size(), path);
    }
  }
  return arguments;
}

// Results of runs, each file read once.
class Results {
 public:
  explicit Results(fs::path output) : output_(std::move(output)) {}

  // `place` is "RUN/FILE.json#/POINTER".
  const Json& at(const std::string& place) {
    const size_t mark = place.find('#');
    const std::string pointer = place.substr(std::min(mark, place.size() - 1) + 1);
    const fs::path file = output_ / "runs" / place.substr(0, mark);
    const auto [found, is_new] = files_.try_emplace(file);
    if (is_new) found->second = read_json_file(file);
    const Json::json_pointer path(pointer);
    if (!found->second.contains(path)) {
      throw Error(ErrorKind::input, Problem{.file = file.string(),
                                            .pointer = pointer,
                                            .found = "is not there",
                                            .expected = "the number that the entry takes"});
    }
    return found->second.at(path);
  }

  // The second run's error against the first one's.
  const MotionError& motion(const Json& runs) {
    const std::string reference = runs.at(0), other = runs.at(1);
    const auto [found, is_new] = motions_.try_emplace({reference, other});
    if (is_new) {
      TrajectoryReader first(directory_of(output_, reference));
      TrajectoryReader second(directory_of(output_, other));
      found->second = motion_error(first, second);
    }
    return found->second;
  }

  double bytes(const std::string& place) const {
    return static_cast<double>(fs::file_size(output_ / "runs" / place));
  }

  // A column of the timing.csv of `run`, without the frame that is there at the start.
  std::vector<double> timing(const std::string& run, const std::string& column) const {
    std::istringstream rows(read_file(directory_of(output_, run) / "timing.csv"));
    std::string row, cell;
    std::getline(rows, row);
    std::istringstream head(row);
    int index = 0;
    while (std::getline(head, cell, ',') && cell != column) ++index;
    std::vector<double> values;
    std::getline(rows, row);
    while (std::getline(rows, row)) {
      std::istringstream cells(row);
      for (int i = 0; i <= index; ++i) std::getline(cells, cell, ',');
      values.push_back(std::stod(cell));
    }
    return values;
  }

 private:
  fs::path output_;
  std::map<fs::path, Json> files_;
  std::map<std::pair<std::string, std::string>, MotionError> motions_;
};

// {"value", "low", "high"} where the result has an interval.
Json scaled(const Json& value, double factor) {
  if (value.is_number()) return value.get<double>() * factor;
  if (!value.is_object()) return value;
  Json result;
  for (const auto& [name, part] : value.items()) result[name] = scaled(part, factor);
  return result;
}

double plain(const Json& value) { return value.is_object() ? value.at("value") : value; }

// A number of a result, with its interval, or the sum of several.
Json figure(const Json& places, Results& results) {
  if (places.is_string()) return results.at(places);
  double sum = 0;
  for (const Json& place : places) sum += plain(results.at(place));
  return sum;
}

// A cell of the page: the dissertation's, as it is, or ours.
Json cell_value(const Json& cell, Results& results) {
  if (!cell.is_object()) return cell;
  double factor = cell.value("scale", 1.0);
  if (cell.contains("motion")) return factor * results.motion(cell.at("motion")).relative;
  if (cell.contains("bytes")) return factor * results.bytes(cell.at("bytes"));
  if (cell.contains("over")) factor /= plain(figure(cell.at("over"), results));
  const Json value = figure(cell.at("at"), results);
  return value.is_null() ? Json() : scaled(value, factor);
}

Json rows_json(const Json& rows, Results& results) {
  Json values = Json::array();
  for (const Json& row : rows) {
    Json& cells = values.emplace_back(Json::array());
    for (const Json& cell : row) cells.push_back(cell_value(cell, results));
  }
  return values;
}

std::vector<double> line_values(const Json& line, Results& results) {
  if (line.contains("motion")) return results.motion(line.at("motion")).absolute_by_frame;
  return results.timing(line.at("frames"), "total_ms");
}

// Writes the chart and gives its place below the output.
std::string draw_chart(const Json& json, const std::string& name, const fs::path& output,
                       Results& results) {
  const Json& lines = json.at("lines");
  std::vector<double> time_s = results.timing(json.at("time"), "time_s");
  std::vector<ChartLine> drawn;
  for (const Json& line : lines) {
    drawn.push_back({line.at("name"), line_values(line, results)});
    time_s.resize(std::min(time_s.size(), drawn.back().values.size()));
  }
  const std::string file = "charts/" + name + ".svg";
  make_output_directory(output / "charts");
  write_file_atomically(output / file,
                        line_chart(json.at("title"), json.at("unit"), time_s, drawn).svg);
  return file;
}

Json charts_json(const ReproductionEntry& entry, const fs::path& output, Results& results,
                 std::string& missing) {
  Json charts = Json::array();
  for (const Json& chart : entry.content.value("charts", Json::array())) {
    std::string name = entry.number + '_' + std::to_string(charts.size() + 1);
    std::ranges::replace(name, ' ', '_');
    std::ranges::replace(name, '.', '_');
    try {
      charts.push_back(
          {{"file", draw_chart(chart, name, output, results)}, {"caption", chart.at("title")}});
    } catch (const Error& error) {
      if (error.kind() != ErrorKind::io) throw;
      missing = std::string("charts are missing: ") + error.what();
    }
  }
  return charts;
}

Json entry_json(const ReproductionEntry& entry, const fs::path& output, Results& results,
                std::string& missing) {
  Json pictures = Json::array();
  for (const Json& picture : entry.content.value("pictures", Json::array())) {
    pictures.push_back(
        {{"file", "runs/" + picture.at(0).get<std::string>()}, {"caption", picture.at(1)}});
  }
  return {{"number", entry.number},
          {"chapter", entry.chapter},
          {"kind", entry.kind},
          {"title", entry.title},
          {"about", entry.content.value("about", "")},
          {"columns", entry.content.value("columns", Json::array())},
          {"rows", rows_json(entry.content.value("rows", Json::array()), results)},
          {"pictures", pictures},
          {"charts", charts_json(entry, output, results, missing)},
          {"method", entry.content.value("method", Json::object())},
          {"runs", entry.runs}};
}

// The seeds that a comparison or a simulation tells.
Json seeds_of(const fs::path& directory) {
  if (fs::exists(directory / "compare.json")) {
    return read_json_file(directory / "compare.json").at("seeds");
  }
  if (fs::exists(directory / "report.json")) {
    return Json::array({read_json_file(directory / "report.json").at("seed")});
  }
  return Json::array();
}

void stop_if_interrupted(const ReproductionJob& job) {
  if (!interrupted()) return;
  throw Error(ErrorKind::interrupted,
              Problem{.file = job.output.string(),
                      .found = "interrupted; the runs that were complete are kept",
                      .remedy = "Go on with the same command and --resume"});
}

// The figures of a run for reproduction.json, and for a file beside its directory: with it the run
// is complete.
Json make_run(const ReproductionJob& job, const ReproductionRun& run, const std::string& number,
              const std::string& program_hash) {
  const fs::path directory = directory_of(job.output, run.name);
  const fs::path record = directory.string() + ".json";
  const std::string command = command_line(run, job.size, job.output);
  if (job.resume && fs::exists(record)) {
    const Json made = read_json_file(record);
    if (made.value("command", "") == command && made.value("program", "") == program_hash) {
      return made;
    }
  }
  job.tell(number + ": " + command);
  remove_in_one_go(record);
  remove_in_one_go(directory);
  make_output_directory(directory);
  std::vector<std::string> words = arguments_of(run, job.size, fs::absolute(job.output));
  words.insert(words.begin(), job.program.string());
  const Stopwatch watch;
  const SubprocessResult result =
      run_child(words, job.directory, {.file = number, .found = '"' + command + "\" failed:"});
  stop_if_interrupted(job);
  const Json made = {{"name", run.name},
                     {"command", command},
                     {"seeds", seeds_of(directory)},
                     {"wall_s", watch.seconds()},
                     {"processor_s", result.processor_s},
                     {"memory_bytes", result.peak_memory_bytes},
                     {"program", program_hash}};
  write_file_atomically(record, made.dump(2) + "\n");
  return made;
}

}  // namespace

std::string command_line(const ReproductionRun& run, ReproductionSize size,
                         const fs::path& output) {
  std::string line = "pilesim";
  for (const std::string& word : arguments_of(run, size, output)) line += ' ' + shell_word(word);
  return line;
}

std::string run_reproduction(const Reproduction& reproduction,
                             const std::vector<const ReproductionEntry*>& entries,
                             const ReproductionJob& job) {
  OutputLock lock(job.output);
  const auto there = claim_output(job.output, kReproductionEntries, job.force || job.resume);
  install_interrupt_handler();
  lock.make_directory();
  if (!job.resume) remove_output(there);
  const std::string program_hash = content_hash(read_file(job.program));

  Results results(job.output);
  std::map<std::string, Json> made;
  Json told_entries = Json::array();
  std::string missing;
  for (const ReproductionEntry* entry : entries) {
    for (const std::string& name : entry->runs) {
      if (made.contains(name)) continue;
      made[name] = make_run(job, reproduction.runs.at(name), entry->number, program_hash);
    }
    told_entries.push_back(
        naming(entry->number, [&] { return entry_json(*entry, job.output, results, missing); }));
  }
  Json told_runs = Json::array();
  for (const ReproductionRun* run : runs_of(reproduction, entries)) {
    told_runs.push_back(made.at(run->name));
  }
  const Json figures = {{"format", "pilesim reproduction"},
                        {"format_version", 1},
                        {"size", job.size == ReproductionSize::full ? "full" : "quick"},
                        {"machine", machine_json()},
                        {"directory", job.directory.string()},
                        {"entries", told_entries},
                        {"runs", told_runs}};
  write_file_atomically(job.output / "reproduction.md", reproduction_markdown(figures));
  write_file_atomically(job.output / "reproduction.html", reproduction_html(figures));
  write_file_atomically(job.output / "reproduction.json", figures.dump(2) + "\n");
  return missing;
}

}  // namespace pilesim
