// Whether the place where a body is to appear is clear of the bodies that move.
#pragma once

#include <cstdint>
#include <functional>
#include <unordered_map>
#include <vector>

#include "model/body_distances.h"
#include "model/model.h"
#include "simulate/body_state.h"

namespace pilesim {

// Places of a moment. Bodies that stand still are no matter of time: model/clear_starts.h judges
// them beforehand.
class ClearPlaces {
 public:
  using PoseOf = std::function<Pose(uint32_t)>;  // of the body frame, now

  // The present bodies that are dynamic or moved by keys. `distances` must outlive it.
  ClearPlaces(const Model& model, const BodyDistances& distances, const BodyStates& states,
              const PoseOf& pose_of);

  // By the collision shapes, exactly: none of them overlaps the body's start.
  bool is_clear(uint32_t body) const;
  // `body` has appeared where it starts.
  void add(uint32_t body) { add(body, model_.bodies[body].pose); }

 private:
  struct Present {
    uint32_t body;
    Pose pose;
  };
  void add(uint32_t body, const Pose& pose);
  double radius_m(uint32_t body) const {
    return model_.shapes[model_.bodies[body].shape].bounding_radius;
  }
  bool overlap(const Present& there, const PlacedShape& start) const;

  const Model& model_;
  const BodyDistances& distances_;
  double cell_m_ = 1;  // of a lattice: the largest diameter of bodies that can appear
  std::unordered_map<uint64_t, std::vector<Present>> cells_;  // by their centres
  std::vector<Present> large_;                                // wider than a cell
};

}  // namespace pilesim
