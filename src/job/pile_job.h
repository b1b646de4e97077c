// What `pilesim direct-pile` adds to a simulation: its director, its figures, the layers for
// pictures.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "model/model.h"
#include "scene/scene.h"
#include "simulate/simulator.h"

namespace pilesim {

class PileJob {
 public:
  // All three must outlive it. Throws Error(input), naming `scene_file`, for a scene without piles,
  // in another mode than impulse or mixed, or with a boundary smaller than a body.
  PileJob(const std::filesystem::path& scene_file, const Scene& scene, const Model& model);
  ~PileJob();
  PileJob(const PileJob&) = delete;
  PileJob& operator=(const PileJob&) = delete;

  std::unique_ptr<Simulator> make_simulator();  // to be called once
  // Of the frames so far.
  std::string figures() const;             // JSON, for SimulationReport::piles
  std::vector<std::string> lines() const;  // one a pile, for people
  // piles.json: the layers of each pile, frame by frame where they change. Throws Error(io).
  void write_layers(const std::filesystem::path& directory) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim
