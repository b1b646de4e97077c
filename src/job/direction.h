// A director that steers a run in addition to the scene's events, and its final report.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/pile_quality.h"
#include "pile/guide/upside_down.h"
#include "simulate/simulator.h"

namespace pilesim {

// A direction's report on a run.
struct DirectedRun {
  std::string figures;             // JSON, for SimulationReport::piles; empty: none
  std::vector<std::string> lines;  // for people
  std::optional<GuideQuality> guide;
};

class Direction {
 public:
  virtual ~Direction() = default;
  // Call it once. The direction must outlive the simulator.
  virtual std::unique_ptr<Simulator> make_simulator() = 0;
  // Call it after the last frame, with the result of make_simulator(). Writes the files that belong
  // beside the trajectory into `directory`. Throws Error(io).
  virtual DirectedRun finish(const Simulator& simulator,
                             const std::filesystem::path& directory) const = 0;
};

// The scene's own simulator without a director. Both arguments must outlive the result.
std::unique_ptr<Direction> no_direction(const Scene& scene, const Model& model);

// Directs by the scene's guide, or otherwise by the angles of repose of its piles. All arguments
// except `filling`, which belongs to this model, must outlive the result. Throws Error(input)
// naming `scene_file` if the scene cannot be directed.
std::unique_ptr<Direction> direction_of(const std::filesystem::path& scene_file, const Scene& scene,
                                        const Model& model, const GuideFilling& filling);

}  // namespace pilesim
