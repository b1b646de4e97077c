// Piles that take an angle of repose: their director, their figures, the layers for pictures.
#pragma once

#include <filesystem>
#include <memory>

#include "job/direction.h"

namespace pilesim {

class ReposeDirection final : public Direction {
 public:
  // All three must outlive it. Throws Error(input), naming `scene_file`, for a scene without piles,
  // in another mode than impulse or mixed, or with a boundary smaller than a body.
  ReposeDirection(const std::filesystem::path& scene_file, const Scene& scene, const Model& model);
  ~ReposeDirection() override;

  std::unique_ptr<Simulator> make_simulator() override;
  // Writes piles.json: the layers of each pile, frame by frame where they change.
  DirectedRun finish(const Simulator& simulator,
                     const std::filesystem::path& directory) const override;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim
