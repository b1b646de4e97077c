// What steers a run besides the events of its scene, and what that leaves beside the trajectory.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "pile/guide/upside_down.h"
#include "simulate/simulator.h"

namespace pilesim {

class Direction {
 public:
  virtual ~Direction() = default;
  // To be called once.
  virtual std::unique_ptr<Simulator> make_simulator() = 0;
  // When the last frame is done; before the three below.
  virtual void measure(const Simulator& /*simulator*/) {}
  virtual std::string figures() const { return {}; }  // JSON, for SimulationReport::piles
  virtual std::vector<std::string> lines() const { return {}; }  // for people
  // Files beside the trajectory. Throws Error(io).
  virtual void write_files(const std::filesystem::path& /*directory*/) const {}
};

// None: the scene's own simulator. Both must outlive it.
std::unique_ptr<Direction> no_direction(const Scene& scene, const Model& model);

// By the scene's guide, or else by the angles of repose of its piles. All but `filling`, which is
// of this model, must outlive it. Throws Error(input), naming `scene_file`, for a scene that cannot
// be directed.
std::unique_ptr<Direction> direction_of(const std::filesystem::path& scene_file, const Scene& scene,
                                        const Model& model, const GuideFilling& filling);

}  // namespace pilesim
