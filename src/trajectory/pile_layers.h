// piles.json, beside a trajectory of directed piles: the layers of each pile, for pictures. This
// struct and its members' names define the whole format.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/types.h"

namespace pilesim {

// Heights in world y, m.
struct PileLayer {
  double bottom_m = 0, top_m = 0;
  double radius_m = 0;  // beyond the core

  bool operator==(const PileLayer&) const = default;
  static void fields(auto& self, auto& stream) { stream(self.bottom_m, self.top_m, self.radius_m); }
};

struct LayeredPile {
  std::vector<Eigen::Vector2d> core;   // m, x and z: a point, a line or a counter-clockwise polygon
  std::vector<Eigen::Vector2d> walls;  // m, x and z, counter-clockwise; empty: none
  std::vector<PileLayer> layers;

  bool operator==(const LayeredPile&) const = default;
  static void fields(auto& self, auto& stream) { stream(self.core, self.walls, self.layers); }
};

// All piles, from a frame on.
struct PileLayersChange {
  uint64_t frame = 0;
  std::vector<LayeredPile> piles;

  static void fields(auto& self, auto& stream) { stream(self.frame, self.piles); }
};

LayeredPile moved(LayeredPile pile, const Vec3& by);

// Rounds to a tenth of a millimetre, the resolution of the file.
double rounded_for_pictures(double value_m);

// `changes` are in frame order. Throws Error(io).
void write_pile_layers(const std::filesystem::path& file,
                       const std::vector<PileLayersChange>& changes);
// Throws Error(io), or Error(input) if the file has another format or version, or a pile has no
// core.
std::vector<PileLayersChange> read_pile_layers(const std::filesystem::path& file);

}  // namespace pilesim
