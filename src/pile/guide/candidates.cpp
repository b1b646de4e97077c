#include "pile/guide/candidates.h"

namespace pilesim {

CandidateAnalysis::CandidateAnalysis(const Guide& guide, const Vec3& gravity)
    : guide_(guide), up_(gravity.norm() > 0 ? Vec3(-gravity.normalized()) : Vec3::UnitY()) {}

Standing CandidateAnalysis::standing(const Vec3& centre, double radius_m,
                                     std::span<const SupportPoint> supports) {
  chosen_.clear();
  for (const SupportPoint& support : supports) {
    if (support.normal.dot(up_) > guide_.least_normal_up) chosen_.push_back(support);
  }
  solver_.set_body(centre, radius_m, chosen_);
  solver_.scale_friction(guide_.kinetic_share);
  if (solver_.solve(up_).stable) {
    const bool spread = static_cast<int>(chosen_.size()) >= guide_.least_contacts &&
                        contact_spread(chosen_, radius_m) >= guide_.least_spread;
    return spread ? Standing::passed : Standing::filtered;
  }
  solver_.scale_friction(1);
  return solver_.solve(up_).stable ? Standing::filtered : Standing::failed;
}

}  // namespace pilesim
