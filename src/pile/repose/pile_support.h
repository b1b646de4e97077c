// Which sleepers stand on something: contacts read as a graph from fixed bodies upwards.
#pragma once

#include <cstdint>
#include <vector>

#include "pile/repose/pile_bodies.h"
#include "simulate/body_control.h"

namespace pilesim {

struct PileSupport {
  std::vector<uint8_t> grounded;  // (B) touches a fixed or a grounded body
  std::vector<uint8_t> on_fixed;  // (B) rests on a fixed or kinematic body
  // (B) rests on something fixed or on a sleeper that does; of the asleep also what such hold
  // between them.
  std::vector<uint8_t> is_supported;
  std::vector<uint8_t> is_balanced;  // (B) of the awake: its supports stand around its centre
  std::vector<double> depth_m;       // (B) deepest overlap with anything
  std::vector<uint32_t> deepest_in;  // (B) with which, where depth_m > 0

  PileSupport(const Model& model, const PileBodies& bodies);
  // From the contacts of the last step. `asleep` is (B); `motion` (B), of bodies in the world.
  void read(const std::vector<BodyContact>& contacts, const std::vector<uint8_t>& asleep,
            const std::vector<BodyMotion>& motion);

 private:
  const Model& model_;
  const PileBodies& bodies_;
  struct Beside {
    uint32_t body;
    double bearing;  // rad, from that body's centre
  };
  std::vector<std::vector<uint32_t>> above_;  // (B) bodies that rest on it
  std::vector<std::vector<Beside>> beside_;   // (B) bodies that it could help to wedge
  std::vector<std::vector<double>> wedging_;  // (B) bearings of what wedges it
  std::vector<uint32_t> queue_;
  std::vector<uint32_t> joined_to_;            // (B + 1) a forest: bodies that touch have one root
  uint32_t fixed_;                             // index of the last, for all that is fixed
  std::vector<std::vector<double>> bearings_;  // (B) of its supports from its centre, rad

  void note_bearing(uint32_t body, const Vec3& point, const Vec3& centre);
  void note_beside(uint32_t body, uint32_t other, const Vec3& point,
                   const std::vector<BodyMotion>& motion);
  uint32_t root(uint32_t body);
  bool surrounded(std::vector<double>& bearings) const;
};

// Overlaps of sleepers beyond this share of a body's smallest extent count as one being inside the
// other.
inline constexpr double kInsideShare = 0.1;

// Counts that must be zero at the end: sleepers that hang in the air, and that are inside others.
struct PlausibilityCounts {
  uint32_t asleep = 0, hanging = 0, inside = 0;

  static void fields(auto& self, auto& stream) { stream(self.asleep, self.hanging, self.inside); }
};
PlausibilityCounts count_implausible(const PileBodies& bodies, const Model& model,
                                     const PileSupport& support,
                                     const std::vector<uint8_t>& asleep);

}  // namespace pilesim
