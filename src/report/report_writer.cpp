#include "report/report_writer.h"

#include <fcntl.h>
#include <unistd.h>

#include <cassert>
#include <cerrno>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/text.h"
#include "report/charts.h"
#include "report/report_html.h"
#include "report/report_json.h"

namespace pilesim {
namespace {

std::string number(double value) { return with_digits(value, 9); }

}  // namespace

TimingCsv::TimingCsv(const std::filesystem::path& file)
    : descriptor_(open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666)),
      path_(file.string()) {
  if (descriptor_ < 0) throw io_error(path_, "cannot be created", errno);
  std::string header = "frame,time_s,steps,total_ms";
  for (size_t stage = 0; stage < kStageCount; ++stage) {
    header += "," + std::string(stage_name(static_cast<Stage>(stage))) + "_ms";
  }
  write_row(header + ",other_ms,bodies,bodies_awake,kinetic_energy_j,potential_energy_j\n");
}

TimingCsv::~TimingCsv() { close(descriptor_); }

void TimingCsv::append(const FrameRow& row) {
  std::string line = std::to_string(row.frame) + "," + number(row.time_s) + "," +
                     std::to_string(row.steps) + "," + number(1e3 * row.times.total_s);
  for (const double seconds : row.times.seconds) line += "," + number(1e3 * seconds);
  line += "," + number(1e3 * row.times.other_s()) + "," + std::to_string(row.bodies) + "," +
          std::to_string(row.bodies_awake) + "," + number(row.kinetic_energy_j) + "," +
          number(row.potential_energy_j) + "\n";
  write_row(line);
}

void TimingCsv::write_row(const std::string& row) {
  try {
    write_all(descriptor_, path_, row);
  } catch (const Error&) {
    // A full disk may accept the first part of a row.
    static_cast<void>(ftruncate(descriptor_, whole_rows_));
    throw;
  }
  whole_rows_ += static_cast<off_t>(row.size());
}

std::string write_report(const SimulationReport& report, const std::filesystem::path& directory) {
  assert(!report.rows.empty());
  const nlohmann::ordered_json figures = report_json(report);
  write_file_atomically(directory / "report.json", figures.dump(2) + "\n");
  std::vector<Chart> charts;
  std::string missing;
  try {
    charts = simulation_charts(report.rows);
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::io) throw;
    missing = std::string("report.html has no charts: ") + error.what();
  }
  write_file_atomically(directory / "report.html", report_html(figures, charts, missing));
  return missing;
}

// Not getrusage(): for a child process it includes the memory of its parent.
uint64_t peak_memory_bytes() {
  std::ifstream status("/proc/self/status");
  for (std::string key; status >> key;) {
    uint64_t kibibytes = 0;
    if (key == "VmHWM:" && status >> kibibytes) return kibibytes * 1024;
  }
  return 0;
}

}  // namespace pilesim
