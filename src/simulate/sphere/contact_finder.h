// Finds the contacts of one batch of a step: of a block of the grid, or of all bodies much larger
// or faster than most.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "simulate/sphere/face_patch.h"
#include "simulate/sphere/sphere_contact_search.h"
#include "simulate/sphere/sphere_model.h"
#include "simulate/sphere/sphere_sleepers.h"
#include "simulate/sphere/sphere_step.h"
#include "simulate/sphere/surface_geometry.h"

namespace pilesim {

// Writes the batch, and the parts of the step and its bodies that belong to the search. `used`,
// `patches_used`: see ColouredGroups.
class ContactFinder {
 public:
  ContactFinder(const SphereModel& model, const SurfaceGeometry& surfaces,
                const SphereContactSearch::Input& input, const SleeperGrid& sleepers,
                SphereStep& step, std::vector<uint64_t>& used, std::vector<uint64_t>& patches_used,
                SphereBatch& batch)
      : model_(model),
        surfaces_(surfaces),
        input_(input),
        sleepers_(sleepers),
        step_(step),
        used_(used),
        patches_used_(patches_used),
        batch_(batch) {}

  void find_of_block(uint32_t block);
  void find_of_coarse_levels();

 private:
  // The other body of a contact: in the grid, or asleep.
  struct Partner {
    uint32_t body, row;  // row of motions, or fixed; see SphereContact
    Vec3f centre, velocity;
    const SphereKind& kind;
    float radius_m;
    uint32_t kept;  // see SphereBody
    const BodyEllipsoid& ellipsoid;
  };

  void touch_sleepers(uint32_t p);
  void touch_if_near(uint32_t p, uint32_t q);
  void touch(uint32_t p, uint32_t q);
  void touch(uint32_t p, const Partner& partner);
  bool lie_on_faces(uint32_t p, const Partner& partner) const;
  void touch_by_faces(uint32_t p, const Partner& partner);
  void note_left(uint32_t p, const Partner& partner, const Vec3f& normal);
  void note_impact(uint32_t p, const Partner& partner, const SphereImpact& impact, float closing);
  void find_surface_contacts(SphereGrid::Range places);
  void find_surface_contacts(uint32_t p, float reach, std::span<const uint32_t> near);
  void add_contact(const SphereContact& contact, uint32_t other, SurfaceFace face);
  void add_patch(const PatchContact& contact, uint32_t other, SurfaceFace face);
  ContactImpulse former_impulse(uint32_t kept, uint32_t other, const Vec3f& normal) const;
  ContactImpulse former_impulse(uint32_t p, const Partner& partner, const Vec3f& normal) const;
  bool collides(float closing, float gap, float arm_m) const {
    return gap <= closing * model_.settings.step_s && closing > model_.impact_speed(arm_m);
  }
  float friction(uint32_t body, const SphereKind& kind) const {
    return input_.root_friction.empty() ? kind.root_friction : input_.root_friction[body];
  }
  // Surfaces and faces do not catch on bodies that rest on them.
  float surface_friction(uint32_t body, const SphereKind& kind) const {
    return friction(body, kind) / kind.object->interlocking;
  }
  PlacedBlock block(uint32_t body) const {
    return {*model_.kind(body).block, input_.bodies[body].position,
            input_.bodies[body].orientation};
  }

  const SphereModel& model_;
  const SurfaceGeometry& surfaces_;
  const SphereContactSearch::Input& input_;
  const SleeperGrid& sleepers_;
  SphereStep& step_;
  std::vector<uint64_t>&used_, &patches_used_;
  SphereBatch& batch_;
  std::optional<PlacedBlock> placed_;  // the most recent block
  uint32_t placed_of_ = 0;
};

}  // namespace pilesim
