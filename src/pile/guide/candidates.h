// Which bodies of a pile may be held (dissertation 6.2.1 and 6.2.2).
#pragma once

#include <cstdint>
#include <vector>

#include "pile/guide/equilibrium.h"
#include "pile/guide/support_graph.h"
#include "scene/scene.h"

namespace pilesim {

enum class Standing : uint8_t {
  unknown,   // not analysed: out of the guide, moving, or not dynamic
  failed,    // cannot stand on its contacts
  filtered,  // can, but only just, or on too few contacts, or on contacts too close together
  passed,
};

// As BodyFlag has it, of a body that is held or not.
uint8_t flags_of(Standing standing, bool held);

// Fixed bodies, and dynamic ones that wait for their release.
bool stands_by_itself(const Model& model, const BodyControl& control, uint32_t body);

class CandidateAnalysis {
 public:
  CandidateAnalysis(const Guide& guide, const Vec3& gravity);

  // A body that stands at the friction of motion is a candidate; one that stands at the friction of
  // rest only is filtered. (6.1) is meant to say this, but asks it of one of many solutions.
  Standing standing(const Vec3& centre, double radius_m, std::span<const SupportPoint> supports);

 private:
  const Guide& guide_;
  Vec3 up_;
  EquilibriumSolver solver_;
  std::vector<SupportPoint> chosen_;
};

}  // namespace pilesim
