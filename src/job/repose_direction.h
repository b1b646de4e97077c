// Piles with an angle of repose: their director, their figures, and their layers for pictures.
#pragma once

#include <filesystem>
#include <memory>

#include "job/direction.h"

namespace pilesim {

class ReposeDirection final : public Direction {
 public:
  // All arguments must outlive it. Throws Error(input) naming `scene_file` if the scene has no
  // piles, another mode than impulse or mixed, or a boundary smaller than a body.
  ReposeDirection(const std::filesystem::path& scene_file, const Scene& scene, const Model& model);
  ~ReposeDirection() override;

  std::unique_ptr<Simulator> make_simulator() override;
  // Writes piles.json: the layers of each pile, for frames in which they change.
  DirectedRun finish(const Simulator& simulator,
                     const std::filesystem::path& directory) const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim
