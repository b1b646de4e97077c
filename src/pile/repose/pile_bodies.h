// Sizes and surfaces of a model's bodies, for piles.
#pragma once

#include <vector>

#include "model/model.h"
#include "simulate/body_control.h"

namespace pilesim {

struct PileBodyShape {
  double box_m3 = 0;      // volume of the bounding box: the conservative volume of section 5.2.1
  double longest_m = 0;   // the box's diagonal
  double smallest_m = 0;  // the box's smallest edge
  std::vector<Vec3> surface;  // m, body frame
};

struct PileBodies {
  std::vector<PileBodyShape> shapes;  // as Model::shapes
  std::vector<uint32_t> dynamic;      // indices of dynamic bodies
  // Typical sizes: a single much larger body, such as a ball shot into a pile, does not count.
  // Medians are weighted by volume: the large ones of several sizes carry the pile.
  double size_m = 0;     // edge of a cube of the median box volume: L
  double longest_m = 0;  // D: longest extent of all but the largest twentieth
  double mass_kg = 0;    // median

  explicit PileBodies(const Model& model);

  const PileBodyShape& shape_of(const Model& model, uint32_t body) const {
    return shapes[model.bodies[body].shape];
  }
};

// Motion of a model's bodies as of the last step. All (B).
struct PileMotion {
  std::vector<BodyMotion> motion;  // of bodies in the world
  std::vector<uint8_t> present;    // dynamic and present
  std::vector<uint8_t> asleep;
  std::vector<uint8_t> landed;  // asleep, or in contact

  explicit PileMotion(size_t bodies)
      : motion(bodies), present(bodies), asleep(bodies), landed(bodies) {}

  static void fields(auto& self, auto& stream) {
    stream(self.motion, self.present, self.asleep, self.landed);
  }
};

}  // namespace pilesim
