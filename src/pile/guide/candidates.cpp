#include "pile/guide/candidates.h"

#include "core/body_flags.h"

namespace pilesim {

uint8_t flags_of(Standing standing, bool held) {
  uint8_t flags = held ? uint8_t{kFrozen} : uint8_t{0};
  if (standing == Standing::passed || standing == Standing::filtered) flags |= kPassed;
  if (standing == Standing::failed || standing == Standing::filtered) flags |= kFailed;
  return flags;
}

bool stands_by_itself(const Model& model, const BodyControl& control, uint32_t body) {
  const ModelBody& source = model.bodies[body];
  return source.role == Role::fixed || (source.role == Role::kinematic && source.motion.empty()) ||
         (source.role == Role::dynamic && !control.is_in_world(body));
}

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
