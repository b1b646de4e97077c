// Selects the bodies of a pile that may be fixed (dissertation 6.2.1 and 6.2.2).
#pragma once

#include <cstdint>
#include <vector>

#include "pile/guide/equilibrium.h"
#include "pile/guide/support_graph.h"
#include "scene/scene.h"

namespace pilesim {

enum class Standing : uint8_t {
  unknown,  // not analysed: outside the guide, moving, or not dynamic
  failed,   // cannot stand on its contacts
  // Stands, but with little margin, on too few contacts, or on contacts too close together.
  filtered,
  passed,
};

// The BodyFlag of a body, fixed or not.
uint8_t flags_of(Standing standing, bool held);

// True for fixed bodies, and for dynamic ones that wait for their release.
bool stands_by_itself(const Model& model, const BodyControl& control, uint32_t body);

class CandidateAnalysis {
 public:
  CandidateAnalysis(const Guide& guide, const Vec3& gravity);

  // A body that stands with kinetic friction is a candidate; one that needs static friction is
  // filtered out. (6.1) intends this, but tests only one of many solutions.
  Standing standing(const Vec3& centre, double radius_m, std::span<const SupportPoint> supports);

 private:
  const Guide& guide_;
  Vec3 up_;
  EquilibriumSolver solver_;
  std::vector<SupportPoint> chosen_;
};

}  // namespace pilesim
