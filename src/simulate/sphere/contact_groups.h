// Contacts of spheres with each other and with surfaces, at velocity level: support of resting
// bodies, friction and rolling resistance, by projected Gauss-Seidel. Collisions are not solved
// here but sampled from signatures.
//
// Contacts are stored in groups of eight that share no sphere, so that SIMD registers solve a group
// at once.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "core/types.h"

namespace pilesim {

inline constexpr size_t kLanes = 8;

// A body's motion for contacts. Bodies that nothing moves have zero inverses.
struct alignas(32) SphereMotion {
  Vec3f velocity = Vec3f::Zero();  // m/s
  float inverse_mass = 0;          // 1/kg
  Vec3f spin = Vec3f::Zero();      // rad/s
  float inverse_inertia = 0;       // 1/(kg m^2), the same about every axis
};

// Displacement of a sphere in a step.
struct alignas(16) SphereShift {
  Vec3f way = Vec3f::Zero();  // m
  float inverse_mass = 0;     // 1/kg
};

// Accumulated impulse of a contact in this step or the previous one, on `a`.
struct ContactImpulse {
  float normal = 0;                                         // N s
  Vec3f friction = Vec3f::Zero(), rolling = Vec3f::Zero();  // N s, N m s
};

struct SphereContact {
  uint32_t a, b;       // places: rows in the arrays of motions and shifts
  Vec3f normal;        // unit, from b to a
  float gap;           // m, at the start of the step
  float arm_a, arm_b;  // m, from the centres to the contact
  float friction;      // Coulomb's
  float rolling_m;     // rolling resistance: bounds the torque by this times the normal impulse
  float lift;          // share of its depth that a sweep of separate() removes
  ContactImpulse impulse;
};

// Rows are fields, columns are contacts. Vectors are rows x, y, z.
struct alignas(32) ContactGroup {
  using Row = std::array<float, kLanes>;
  using Rows = std::array<Row, 3>;
  std::array<uint32_t, kLanes> a, b;
  Rows normal;
  Row gap, arm_a, arm_b, friction, rolling_m, lift;
  Row normal_impulse;
  Rows friction_impulse, rolling_impulse;
  Row normal_mass, tangent_mass, turn_inertia;  // effective; prepare() sets them for all groups

  Vec3f normal_of(size_t lane) const;
  ContactImpulse impulse(size_t lane) const;
};

// Sorts contacts into groups as they arrive: a group's contacts share no sphere.
template <class Group>
class ColouredGroups {
 public:
  // Flag in `b`: a row of the contacts' own that nothing moves. close() replaces it by rows from
  // `begin` on. Row 0 is for lanes without a contact.
  static constexpr uint32_t kFixed = 0x80000000;

  void clear() {
    groups_.clear();
    open_.fill({});
  }
  // Makes room for a contact between two places. `used`, by place, is zero before the first
  // contact; clear_marks() resets it. Returns the contact's slot: group * kLanes + lane.
  uint32_t take(uint32_t a, uint32_t b, std::vector<uint64_t>& used) {
    const bool fixed = (b & kFixed) != 0;
    const uint64_t taken = used[a] | (fixed ? 0 : used[b]);
    const auto colour = static_cast<size_t>(std::countr_one(taken));
    auto group = static_cast<uint32_t>(groups_.size());
    uint32_t lane = 0;
    // When all colours are used, each contact has a group of its own.
    if (colour < kColours) {
      used[a] |= uint64_t{1} << colour;
      if (!fixed) used[b] |= uint64_t{1} << colour;
      Open& open = open_[colour];
      if (open.lanes % kLanes == 0) open = {group, 0};
      group = open.group;
      lane = open.lanes++;
    }
    if (lane == 0) {
      Group& fresh = groups_.emplace_back();
      fresh.a.fill(kFixed);
      fresh.b.fill(kFixed);
    }
    groups_[group].a[lane] = a;
    groups_[group].b[lane] = b;
    return group * static_cast<uint32_t>(kLanes) + lane;
  }
  void clear_marks(std::vector<uint64_t>& used) const {
    for (const Group& g : groups_) {
      for (const auto* places : {&g.a, &g.b}) {
        for (const uint32_t place : *places) {
          if ((place & kFixed) == 0) used[place] = 0;
        }
      }
    }
  }
  void close(uint32_t begin) {
    for (Group& g : groups_) {
      for (auto* places : {&g.a, &g.b}) {
        for (uint32_t& place : *places) {
          if ((place & kFixed) != 0) place = begin + (place & ~kFixed);
        }
      }
    }
  }

  std::span<Group> groups() { return groups_; }
  std::span<const Group> groups() const { return groups_; }
  Group& of(uint32_t slot) { return groups_[slot / kLanes]; }
  const Group& of(uint32_t slot) const { return groups_[slot / kLanes]; }

 private:
  static constexpr size_t kColours = 63;
  struct Open {
    uint32_t group = 0, lanes = 0;
  };
  std::vector<Group> groups_;
  std::array<Open, kColours> open_{};  // by colour: contacts of one colour share no sphere
};

class ContactGroups : public ColouredGroups<ContactGroup> {
 public:
  uint32_t add(const SphereContact& contact, std::vector<uint64_t>& used);  // returns its slot
};

// Computes the effective masses and applies the initial impulses.
void prepare(std::span<ContactGroup> groups, std::span<SphereMotion> motions);
// One sweep. `inverse_step` in 1/s: a gap may close within the step.
void solve(float inverse_step, std::span<ContactGroup> groups, std::span<SphereMotion> motions);
// One sweep that separates contacts deeper than `slop` times their arm.
void separate(float slop, std::span<const ContactGroup> groups, std::span<SphereShift> shifts);

}  // namespace pilesim
