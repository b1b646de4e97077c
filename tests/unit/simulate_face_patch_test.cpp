// The patch on which two blocks touch, and the loads it carries.

#include "simulate/sphere/face_patch.h"

#include <gtest/gtest.h>

#include "geometry/primitives.h"
#include "simulate/sphere/patch_groups.h"

namespace pilesim {
namespace {

const BlockShape kBrick{{0, 0, 0}, {0.15F, 0.05F, 0.1F}};

PlacedBlock brick(const Vec3f& position, const Quatf& orientation = Quatf::Identity()) {
  return {kBrick, position, orientation};
}
Quatf turned(float angle, const Vec3f& axis) { return Quatf(Eigen::AngleAxisf(angle, axis)); }

TEST(FacePatch, BlocksAreWhatFillsItsBox) {
  const TriangleMesh box = box_mesh({0.3, 0.1, 0.2});
  const auto block = block_shape(box, 0.006);
  ASSERT_TRUE(block);
  EXPECT_NEAR((block->half_m - kBrick.half_m).norm(), 0, 1e-6);
  EXPECT_FALSE(block_shape(box, 0.005));  // a hollow one
  EXPECT_FALSE(block_shape(sphere_mesh(0.1), 4.0 / 3 * kPi * 1e-3));
}

TEST(FacePatch, IsWhatTwoFacesShare) {
  // A brick half over another one, with a gap of a millimetre.
  const auto patch = patch_between(brick({0.15F, 0.101F, 0}), brick({0, 0, 0}), 0.01F);
  ASSERT_TRUE(patch);
  EXPECT_NEAR((patch->normal - Vec3f::UnitY()).norm(), 0, 1e-6);
  EXPECT_NEAR(patch->gap_m, 0.001F, 1e-6);
  EXPECT_NEAR((patch->middle - Vec3f(0.075F, 0.05F, 0)).norm(), 0, 1e-6);
  EXPECT_NEAR(patch->tilt.norm(), 0, 1e-6);
  const bool along_x = std::abs(patch->along.x()) > 0.5F;
  EXPECT_NEAR(along_x ? patch->half_along_m : patch->half_across_m, 0.075F, 1e-6);
  EXPECT_NEAR(along_x ? patch->half_across_m : patch->half_along_m, 0.1F, 1e-6);
}

TEST(FacePatch, IsTheSameEitherWayRound) {
  const PlacedBlock a = brick({0.1F, 0.11F, 0.03F}, turned(0.2F, Vec3f(1, 2, 3).normalized()));
  const PlacedBlock b = brick({0, 0, 0}, turned(-0.1F, Vec3f(2, 0, 1).normalized()));
  const auto one = patch_between(a, b, 0.1F), other = patch_between(b, a, 0.1F);
  ASSERT_TRUE(one && other);
  EXPECT_NEAR((one->normal + other->normal).norm(), 0, 1e-5);
  EXPECT_NEAR((one->tilt + other->tilt).norm(), 0, 1e-5);
  EXPECT_NEAR((one->middle - other->middle).norm(), 0, 1e-5);
  EXPECT_NEAR(one->gap_m, other->gap_m, 1e-6);
}

TEST(FacePatch, ThereIsNoneAlongAnEdgeOrAfar) {
  EXPECT_FALSE(patch_between(brick({0.3F, 0.1F, 0}), brick({0, 0, 0}), 0.01F));
  EXPECT_FALSE(patch_between(brick({0, 0.12F, 0}), brick({0, 0, 0}), 0.01F));
}

TEST(FacePatch, TiltBringsTheFacesTogether) {
  const Quatf askew = turned(0.1F, Vec3f::UnitZ());
  const auto patch = patch_between(brick({0, 0.12F, 0}, askew), brick({0, 0, 0}), 0.1F);
  ASSERT_TRUE(patch);
  EXPECT_NEAR((patch->tilt - Vec3f(0, 0, -std::sin(0.1F))).norm(), 0, 1e-5);
  // The lowest edge.
  const float lowest = 0.12F - 0.05F * std::cos(0.1F) - 0.15F * std::sin(0.1F);
  EXPECT_NEAR(patch->gap_m, lowest - 0.05F, 1e-5);
  const FacePatch on_plane =
      patch_on_plane(brick({0, 0.07F, 0}, askew), {0, 0.07F, 0}, Vec3f::UnitY(), 0.07F);
  EXPECT_NEAR((on_plane.tilt - patch->tilt).norm(), 0, 1e-5);
  EXPECT_NEAR(on_plane.gap_m, lowest - 0.05F, 1e-5);
  EXPECT_NEAR(on_plane.middle.y(), 0, 1e-6);
}

// A block on the ground in a step of 1/240 s, with a torque about z as a share of that which tips
// it: its angular speed after the sweeps, rad/s.
float turning(float part) {
  constexpr float kStep = 1 / 240.0F, kMass = 3, kGravity = 9.81F;
  const FacePatch patch =
      patch_on_plane(brick({0, 0.05F, 0}), {0, 0.05F, 0}, Vec3f::UnitY(), 0.05F);
  std::vector<SphereMotion> motions(1);
  const float inertia = kMass * 0.01F;
  const float torque = part * kMass * kGravity * kBrick.half_m.x();
  motions[0] = {
      {0, -kStep * kGravity, 0}, 1 / kMass, {0, 0, kStep * torque / inertia}, 1 / inertia};
  PatchGroups patches;
  std::vector<uint64_t> used(1, 0);
  patches.add({.a = 0,
               .b = PatchGroups::kFixed,
               .lever_a = patch.middle - Vec3f(0, 0.05F, 0),
               .lever_b = Vec3f::Zero(),
               .patch = patch,
               .friction = 0.8F,
               .lift = 0,
               .slop_m = 0,
               .impulse = {}},
              used);
  patches.close(1);
  motions.emplace_back();
  prepare(patches.groups(), motions);
  for (int sweep = 0; sweep < 50; ++sweep) solve(1 / kStep, patches.groups(), motions);
  EXPECT_NEAR(motions[0].velocity.x(), 0, 0.01);
  return motions[0].spin.z();
}

TEST(FacePatch, HoldsWhatDoesNotTipOverItsEdge) {
  EXPECT_NEAR(turning(0.9F), 0, 1e-3);
  EXPECT_GT(turning(1.2F), 0.01F);
}

}  // namespace
}  // namespace pilesim
