// Contacts between faces, at the level of velocities: see face_patch.h. The pressure between two
// faces may be anywhere in the patch in which they lie on each other: besides the push at its
// middle a contact holds back tipping by as much as the push at the patch's edge would, sliding by
// friction, and twisting by the friction of the patch. In groups of eight, as those of spheres.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "simulate/sphere/contact_groups.h"
#include "simulate/sphere/face_patch.h"

namespace pilesim {

struct PatchContact {
  uint32_t a, b;           // as of SphereContact
  Vec3f lever_a, lever_b;  // m, from the centres to the patch's middle
  FacePatch patch;
  float friction;  // Coulomb's
  float lift;      // as of SphereContact
  float slop_m;    // penetration slop
  ContactImpulse impulse;
};

// The normal, gap, friction and impulses of its base are those of patches; arm_a is the slop, and
// normal_mass that of a push at which nothing turns.
struct alignas(32) PatchGroup : ContactGroup {
  Rows lever_a, lever_b;
  Rows along;                   // unit, in the patch
  Row half_along, half_across;  // m, from the middle to the edge
  Row tilt_along, tilt_across;  // rad, about those two: a is to turn by it until faces are parallel
  Row twist_m;                  // of the friction: its lever
};

class PatchGroups : public ColouredGroups<PatchGroup> {
 public:
  uint32_t add(const PatchContact& contact, std::vector<uint64_t>& used);  // its slot
};

// As those of spheres.
void prepare(std::span<PatchGroup> groups, std::span<SphereMotion> motions);
void solve(float inverse_step, std::span<PatchGroup> groups, std::span<SphereMotion> motions);
void separate(std::span<const PatchGroup> groups, std::span<SphereShift> shifts);

}  // namespace pilesim
