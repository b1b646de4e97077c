// The stacking structure of a pile: its layers and the bodies in them (dissertation 5.2.1, 5.2.2).
#pragma once

#include <cstddef>
#include <vector>

#include "pile/repose/pile_shape.h"

namespace pilesim {

// Heights over the base. Volumes are bulk volumes: the space that bodies take in a pile.
struct StackingLayer {
  double bottom_m = 0, top_m = 0;
  double reach_m = 0;      // at its bottom; the radius of a cone's layer
  double volume_m3 = 0;    // of the layer
  double occupied_m3 = 0;  // by bodies with their centre of mass in it
  uint32_t bodies = 0;
  uint32_t asleep = 0;

  // m_i / c_i, by volume instead of number, so that bodies of several sizes add up.
  double density() const { return occupied_m3 / volume_m3; }

  static void fields(auto& self, auto& stream) {
    stream(self.bottom_m, self.top_m, self.reach_m, self.volume_m3, self.occupied_m3, self.bodies,
           self.asleep);
  }
};

inline constexpr double kMostOccupation = 0.5;  // above it the structure's volume doubles

class StackingStructure {
 public:
  StackingStructure() = default;  // without layers, before load()
  // A structure of the given volume, divided into floor(height / layer_m) layers, at least one.
  // `layer_m` is the longest extent D of the bodies.
  StackingStructure(const PileShape& shape, double volume_m3, double layer_m);

  double reach() const { return reach_; }
  double height() const { return layers_.back().top_m; }
  const std::vector<StackingLayer>& layers() const { return layers_; }

  void clear();
  // Counts a body with its centre of mass `height_m` over the base at `distance_m` from the core.
  // False, without counting it, if it is outside the structure.
  bool count(double height_m, double distance_m, double bulk_m3, bool asleep);
  // The layer at a height; layers().size() above or below all layers.
  size_t layer_at(double height_m) const;

  double occupation() const;                    // total occupied volume over total volume
  bool layers_below_sleep(size_t layer) const;  // bottom-up, each holds a sleeper
  // Eq. 5.2: 1 at the core, 0 at the layer's edge and beyond.
  double closeness(size_t layer, double distance_m) const;

  static void fields(auto& self, auto& stream) { stream(self.reach_, self.slope_, self.layers_); }

 private:
  double reach_ = 0;
  double slope_ = 0;
  std::vector<StackingLayer> layers_;
};

}  // namespace pilesim
