// Chooses the method for a pair of bodies in the mixed mode (dissertation 4.2.2, 4.2.3, Table 4.1).
#pragma once

#include <cstdint>
#include <vector>

#include "core/state_stream.h"
#include "model/model.h"
#include "scene/scene.h"

namespace pilesim {

// The treatment of a body in a step. A prefer-statistical body that stands is `standing`: near (I')
// to must-impulse bodies (I), statistical (S) to statistical ones, so that a ground under one
// must-impulse body does not become exact for all.
enum class Behaviour : uint8_t {
  exact,        // I: must-impulse
  near_exact,   // near (I'): prefer-statistical, and its box touches that of a must-impulse body
  statistical,  // S: prefer-statistical
  standing,     // prefer-statistical, and static, kinematic or fixed
};

inline bool by_spheres(PairMethod method) {
  return method == PairMethod::statistical || method == PairMethod::particle;
}

class DispatchTable {
 public:
  // All bodies start as exact or statistical at level 0, by their preference and role. Throws
  // Error(input) if the rules for pairs distinguish more than 64 kinds of bodies.
  DispatchTable(const LevelOfDetail& detail, const Model& model);

  // `level` counts from 0.
  void set(uint32_t body, Behaviour behaviour, uint32_t level);
  // For bodies that are I, S or I' now. None for pairs that never touch: two standing bodies, or
  // (I, S), which the update rule prevents.
  PairMethod method(uint32_t a, uint32_t b) const {
    return methods_[class_[a] * classes_ + class_[b]];
  }
  // True if touching boxes make the prefer-statistical `body` a near body (I'), so that its pairs
  // with the must-impulse body `exact` are solved.
  bool attracts(uint32_t exact, uint32_t body) const;
  // True if some rule lets spheres touch this must-impulse body.
  bool is_sphere_surface(uint32_t exact) const { return has_rule_[group_[exact]]; }
  // True if supports turn the body to a rest pose; particles are not turned.
  bool is_posed(uint32_t body) const { return posed_[class_[body]] != 0; }
  bool uses(PairMethod method) const;  // in any level or rule
  // True if, by a rule or a level in use, some pair of dynamic prefer-statistical bodies may be
  // solved, or a pair of such a body with a standing one.
  bool may_solve_spheres() const { return may_solve_spheres_; }
  bool may_solve_standing() const { return may_solve_standing_; }
  const DetailLevel& level(uint32_t index) const { return levels_[index]; }
  uint32_t level_count() const { return static_cast<uint32_t>(levels_.size()); }

  // The classes that set() has assigned.
  void save(StateWriter& writer) const { writer(class_); }
  void load(StateReader& reader);  // throws Error(input) if it belongs to another table

 private:
  static constexpr uint32_t kBehaviours = 4;
  void make_groups(const Model& model);
  void find_what_is_solved(const Model& model, uint32_t finest_level);
  PairMethod method_of(uint32_t class_a, uint32_t class_b) const;
  PairMethod by_level(Behaviour a, uint32_t level_a, Behaviour b, uint32_t level_b) const;
  const PairMethod& rule(uint32_t group_a, uint32_t group_b) const {
    return rules_[group_a * groups_ + group_b];
  }

  std::vector<DetailLevel> levels_;
  bool may_solve_spheres_ = false, may_solve_standing_ = false;
  uint32_t groups_ = 1;              // of bodies that the same rules name
  std::vector<uint8_t> group_;       // by body
  std::vector<PairMethod> rules_;    // (groups, groups); none: no rule
  std::vector<uint8_t> has_rule_;    // by group
  uint32_t classes_ = 0;             // (groups, levels, behaviours)
  std::vector<uint16_t> class_;      // by body
  std::vector<uint8_t> posed_;       // by class
  std::vector<PairMethod> methods_;  // (classes, classes)
};

}  // namespace pilesim
