// report.json: writes and reads the figures of a simulation, in a fixed order.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "report/report_writer.h"

namespace pilesim {

// `report` must have rows.
nlohmann::ordered_json report_json(const SimulationReport& report);

// The first inspection with the deepest penetration; there must be at least one.
const FrameQuality& deepest_of(const std::vector<FrameQuality>& inspections);

// The parts of a run's report that are read back.
struct ReportedRun {
  PileQuality quality;                // at the end
  std::optional<GuideQuality> guide;  // at the end; none if there was no guide mesh
  double setup_s = 0;                 // wall
  StageTimes times;                   // wall, of all frames
  double cpu_s = 0;
  uint64_t steps = 0;
  uint64_t peak_memory_bytes = 0;
  std::vector<std::string> collision_shapes;
};

// Throws Error(io), or Error(input) if the file has another format or version, or lacks any of it.
ReportedRun read_report(const std::filesystem::path& file);

nlohmann::ordered_json quality_json(const PileQuality& quality);

// machine_info() as reports have it.
nlohmann::ordered_json machine_json();

}  // namespace pilesim
