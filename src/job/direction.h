// A director that steers a run besides the events of its scene, and its report at the end.
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

// The report of a direction on a run.
struct DirectedRun {
  std::string figures;             // JSON, for SimulationReport::piles; empty: none
  std::vector<std::string> lines;  // for people
  std::optional<GuideQuality> guide;
};

class Direction {
 public:
  virtual ~Direction() = default;
  // To be called once. It must outlive the simulator.
  virtual std::unique_ptr<Simulator> make_simulator() = 0;
  // When the last frame is done, of what make_simulator() gave. Writes the files that belong beside
  // the trajectory into `directory`. Throws Error(io).
  virtual DirectedRun finish(const Simulator& simulator,
                             const std::filesystem::path& directory) const = 0;
};

// None: the scene's own simulator. Both must outlive it.
std::unique_ptr<Direction> no_direction(const Scene& scene, const Model& model);

// By the scene's guide, or else by the angles of repose of its piles. All but `filling`, which is
// of this model, must outlive it. Throws Error(input), naming `scene_file`, for a scene that cannot
// be directed.
std::unique_ptr<Direction> direction_of(const std::filesystem::path& scene_file, const Scene& scene,
                                        const Model& model, const GuideFilling& filling);

}  // namespace pilesim
