// Contacts between faces, at velocity level: see face_patch.h. The pressure between two faces may
// act anywhere in their common patch. Besides the normal impulse at its middle, a contact resists
// tipping by as much as that impulse at the patch's edge could, sliding by friction, and twisting
// by the friction of the patch. In groups of eight, like those of spheres.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "simulate/sphere/contact_groups.h"
#include "simulate/sphere/face_patch.h"

namespace pilesim {

struct PatchContact {
  uint32_t a, b;           // as in SphereContact
  Vec3f lever_a, lever_b;  // m, from the centres to the patch's middle
  FacePatch patch;
  float friction;  // Coulomb's
  float lift;      // as in SphereContact
  float slop_m;    // penetration slop
  ContactImpulse impulse;
};

// Normal, gap, friction and impulses of the base class belong to the patches; arm_a is the slop,
// and normal_mass that of an impulse without rotation.
struct alignas(32) PatchGroup : ContactGroup {
  Rows lever_a, lever_b;
  Rows along;                   // unit, in the patch
  Row half_along, half_across;  // m, from the middle to the edge
  // Rad, about those two axes: rotation of a that makes the faces parallel.
  Row tilt_along, tilt_across;
  Row twist_m;  // lever of the friction
};

class PatchGroups : public ColouredGroups<PatchGroup> {
 public:
  uint32_t add(const PatchContact& contact, std::vector<uint64_t>& used);  // returns its slot
};

// As for spheres.
void prepare(std::span<PatchGroup> groups, std::span<SphereMotion> motions);
void solve(float inverse_step, std::span<PatchGroup> groups, std::span<SphereMotion> motions);
void separate(std::span<const PatchGroup> groups, std::span<SphereShift> shifts);

}  // namespace pilesim
