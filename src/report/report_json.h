// report.json: the figures of a simulation, in a fixed order, as they are written and read.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "report/report_writer.h"

namespace pilesim {

// `report` has rows.
nlohmann::ordered_json report_json(const SimulationReport& report);

// The one with the deepest penetration, the first of such; there are some.
const FrameQuality& deepest_of(const std::vector<FrameQuality>& inspections);

// The parts of a run's report that others read.
struct ReportedRun {
  PileQuality quality;                // at the end
  std::optional<GuideQuality> guide;  // at the end; none: no mesh was followed
  double setup_s = 0;                 // wall
  StageTimes times;                   // wall, of all frames
  double cpu_s = 0;
  uint64_t steps = 0;
  uint64_t peak_memory_bytes = 0;
  std::vector<std::string> collision_shapes;
};

// Throws Error(io), or Error(input) for a file of another format or version, and for one that lacks
// any of it.
ReportedRun read_report(const std::filesystem::path& file);

nlohmann::ordered_json quality_json(const PileQuality& quality);

}  // namespace pilesim
