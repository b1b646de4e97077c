// Which method takes a pair of bodies in the mixed mode (dissertation 4.2.2, 4.2.3, Table 4.1).
#pragma once

#include <cstdint>
#include <vector>

#include "core/state_stream.h"
#include "model/model.h"
#include "scene/scene.h"

namespace pilesim {

// How a body is treated in a step. A prefer-statistical body that stands is `standing`: it is I' to
// I bodies and S to S bodies, so that a ground that a must-impulse body lies on does not become
// exact for all. I' bodies are solved on it, unless they are particles. Balls cannot stand for
// bodies with another body through them: rings on a pole would lie as far apart as the balls, which
// cannot go aside.
enum class Behaviour : uint8_t {
  exact,        // I: must-impulse
  threaded,     // I', and an I body reaches into its hull
  near_exact,   // I': prefer-statistical, its box touches that of an I body
  statistical,  // S: prefer-statistical
  standing,     // prefer-statistical, static, kinematic or held
};

// It has several convex pieces: there may be room for something within its hull.
inline bool may_be_threaded(const ModelShape& shape) { return shape.pieces.size() > 1; }

inline bool by_spheres(PairMethod method) {
  return method == PairMethod::statistical || method == PairMethod::particle;
}

class DispatchTable {
 public:
  // All bodies begin as exact or statistical ones of level 0, by their preference and role. Throws
  // Error(input) where the rules for pairs make more than 64 different kinds of bodies. As written
  // (Method::dissertation) the table holds without an exception: nothing is threaded, and standing
  // bodies are I' to I' bodies at all levels.
  DispatchTable(const LevelOfDetail& detail, const Model& model, Method method = Method::own);

  // `level` counts from 0.
  void set(uint32_t body, Behaviour behaviour, uint32_t level);
  // For bodies that are I, S or I' now; none where they do not touch: two that stand, or (I, S),
  // which the update rule keeps from happening.
  PairMethod method(uint32_t a, uint32_t b) const {
    return methods_[class_[a] * classes_ + class_[b]];
  }
  // Whether touching boxes make an I' body of `body`, prefer-statistical: that pairs with the I
  // body `exact` are solved.
  bool attracts(uint32_t exact, uint32_t body) const;
  // Whether some rule lets spheres touch this I body.
  bool is_sphere_surface(uint32_t exact) const { return has_rule_[group_[exact]]; }
  // Whether what the body lies on turns it to a rest pose: particles are left as they are.
  bool is_posed(uint32_t body) const { return posed_[class_[body]] != 0; }
  // Whether bodies of this level that are threaded are solved among each other.
  bool tells_threaded(uint32_t level) const {
    return has_exceptions_ && levels_[level].near_near == PairMethod::statistical;
  }
  bool uses(PairMethod method) const;  // anywhere in levels and rules
  // Whether some pair of dynamic bodies that prefer to be spheres may be solved, or one of such a
  // body and a prefer-statistical one that stands: by a rule, or at a level that is used.
  bool may_solve_spheres() const { return may_solve_spheres_; }
  bool may_solve_standing() const { return may_solve_standing_; }
  const DetailLevel& level(uint32_t index) const { return levels_[index]; }
  uint32_t level_count() const { return static_cast<uint32_t>(levels_.size()); }

  // The classes that set() has given the bodies.
  void save(StateWriter& writer) const { writer(class_); }
  void load(StateReader& reader);  // throws Error(input) for that of another table

 private:
  static constexpr uint32_t kBehaviours = 5;
  void make_groups(const Model& model);
  void find_what_is_solved(const Model& model, uint32_t finest_level);
  PairMethod method_of(uint32_t class_a, uint32_t class_b) const;
  PairMethod by_level(Behaviour a, uint32_t level_a, Behaviour b, uint32_t level_b) const;
  const PairMethod& rule(uint32_t group_a, uint32_t group_b) const {
    return rules_[group_a * groups_ + group_b];
  }

  std::vector<DetailLevel> levels_;
  bool has_exceptions_;
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
