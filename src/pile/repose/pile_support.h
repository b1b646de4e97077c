// Finds sleeping bodies that are supported, from the graph of contacts, starting at fixed bodies.
#pragma once

#include <cstdint>
#include <vector>

#include "pile/repose/pile_bodies.h"
#include "simulate/body_control.h"

namespace pilesim {

struct PileSupport {
  std::vector<uint8_t> grounded;  // (B) touches a fixed or a grounded body
  std::vector<uint8_t> on_fixed;  // (B) rests on a fixed or kinematic body
  // (B) rests on a fixed body or a supported sleeper; a sleeping body also if such bodies wedge it.
  std::vector<uint8_t> is_supported;
  std::vector<uint8_t> is_balanced;  // (B) awake, and its supports surround its centre
  std::vector<double> depth_m;       // (B) largest penetration depth
  std::vector<uint32_t> deepest_in;  // (B) the other body, where depth_m > 0

  PileSupport(const Model& model, const PileBodies& bodies);
  // Reads the contacts of the last step. `asleep` is (B); `motion` (B), for bodies in the world.
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
  std::vector<std::vector<Beside>> beside_;   // (B) bodies that it may help to wedge
  std::vector<std::vector<double>> wedging_;  // (B) bearings of the bodies that wedge it
  std::vector<uint32_t> queue_;
  std::vector<uint32_t> joined_to_;  // (B + 1) disjoint sets: touching bodies share a root
  uint32_t fixed_;                   // the last index, for all fixed bodies
  std::vector<std::vector<double>> bearings_;  // (B) bearings of its supports from its centre, rad

  void note_bearing(uint32_t body, const Vec3& point, const Vec3& centre);
  void note_beside(uint32_t body, uint32_t other, const Vec3& point,
                   const std::vector<BodyMotion>& motion);
  uint32_t root(uint32_t body);
  bool surrounded(std::vector<double>& bearings) const;
};

// Sleepers that penetrate beyond this share of a body's smallest extent count as inside another.
inline constexpr double kInsideShare = 0.1;

// Counts that must be zero at the end: sleepers in mid-air, and sleepers inside other bodies.
struct PlausibilityCounts {
  uint32_t asleep = 0, hanging = 0, inside = 0;

  static void fields(auto& self, auto& stream) { stream(self.asleep, self.hanging, self.inside); }
};
PlausibilityCounts count_implausible(const PileBodies& bodies, const Model& model,
                                     const PileSupport& support,
                                     const std::vector<uint8_t>& asleep);

}  // namespace pilesim
