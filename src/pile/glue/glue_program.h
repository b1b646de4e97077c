// The cone program that least_glue() solves: glue_program.cpp sets it up, interior_point.cpp solves
// it.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "pile/glue/block_cholesky.h"
#include "pile/glue/cone.h"
#include "pile/glue/glue.h"

namespace pilesim::glue {

constexpr uint32_t kFixed = ~uint32_t{0};

using cone::Vec4;
using Block = BlockCholesky::Block;
using Wrench = Eigen::Matrix<double, 6, 1>;  // force, torque over the body's radius
using Effect = Eigen::Matrix<double, 6, 4>;  // effect of a variable on a body
using VectorX = Eigen::VectorXd;

// Variables in one cone, and the wrenches that they exert on two bodies.
struct Variable {
  Effect on_a = Effect::Zero(), on_b = Effect::Zero();
  Vec4 cost = Vec4::Zero();
  int limit = -1;  // index in the pair of the limit that x[0] counts for; -1: none
  Vec4 x = Vec4::Zero(), s = Vec4::Zero();
  // Scratch of one step.
  cone::Scaling scaling;
  Vec4 dual_left, step_x, step_s;

  // True for the unused strength of a spot, which costs nothing.
  bool is_rest() const { return limit >= 0 && cost[0] == 0; }
};

// The constraint that a spot gives at most its strength; a slack variable takes the rest. Its row
// is independent of other pairs', so it is eliminated before the system is factored.
struct Limit {
  double most = 0;                     // in mean weights; for a torque also times the body's radius
  double y = 0, left = 0, step_y = 0;  // as for bodies
  double pivot = 0, known = 0;
  Wrench on_a = Wrench::Zero(), on_b = Wrench::Zero();  // its column in the rows of the bodies
};

// The coupling of two bodies: variables [first, last).
struct Pair {
  uint32_t a, b;  // rows, or kFixed
  size_t first = 0, last = 0;
  std::optional<uint32_t> edge;  // of the matrix, if both move
  std::vector<Limit> limits;     // for force and torque of a spot, or none
  Block aa = Block::Zero(), ab = Block::Zero(), bb = Block::Zero();
};

// Units: the mean weight and the bodies' radii.
class Program {
 public:
  Program(std::span<const GlueBody> bodies, std::span<const GlueContact> contacts, const Vec3& up,
          const GlueSettings& settings, std::span<const GlueThere> there);
  GlueSolution run();

 private:
  void find_hanging();
  Pair& add_pair(uint32_t a, uint32_t b, std::span<const uint32_t> contacts);
  void add_spot(Pair& pair, size_t there);
  Variable& add_force(uint32_t a, uint32_t b, const Vec3& position,
                      const Eigen::Matrix<double, 3, 4>& force);
  Variable& add_torque(uint32_t a, uint32_t b, double side);
  double patch_radius(uint32_t a, uint32_t b) const;
  Effect effect(uint32_t body, const Vec3& position, const Eigen::Matrix<double, 3, 4>& force,
                double sign) const;
  void begin();
  void leave();
  bool is_done() const;
  bool factor();
  template <typename Visit>
  void for_limited(Pair& pair, const Visit& visit);
  void take_out(Pair& pair);
  void find_step(const std::function<Vec4(const Variable&)>& wanted);
  std::pair<double, double> most_steps() const;
  void take_step(double primal, double dual);
  VectorX sum(const std::function<Vec4(const Variable&)>& values) const;
  Vec4 pull(const Variable& variable, const Pair& pair, const VectorX& on_rows,
            double Limit::*on_limit) const;
  void for_each(const std::function<void(Variable&, const Pair&)>& visit);
  double gap() const;
  GlueSolution read() const;

  std::span<const GlueBody> bodies_;
  std::span<const GlueContact> contacts_;
  std::span<const GlueThere> there_;
  Vec3 up_;
  GlueSettings settings_;
  double unit_kg_ = 1;  // mean mass
  std::vector<uint8_t> hangs_;
  std::vector<uint32_t> row_;     // by body: kFixed, or the first of its six rows
  std::vector<uint32_t> sorted_;  // contacts sorted by pair
  // By contact: the variable of its normal force; that of its glue is the next.
  std::vector<size_t> variable_;
  std::vector<Variable> variables_;
  std::vector<Pair> pairs_;
  struct Patch {
    uint32_t a, b;
    size_t variable;
  };
  std::vector<Patch> patches_;
  // (there) variable of its force; then its slack, its torque, that slack, and the shortage.
  std::vector<size_t> spots_;
  VectorX wanted_, y_, left_, step_y_;  // (6 rows)
  std::vector<Block> diagonal_, beside_;
  std::optional<BlockCholesky> matrix_;
};

// Visits the variables that a limit counts.
template <typename Visit>
void Program::for_limited(Pair& pair, const Visit& visit) {
  if (pair.limits.empty()) return;
  for (size_t i = pair.first; i < pair.last; ++i) {
    Variable& v = variables_[i];
    if (v.limit >= 0) visit(v, pair.limits[static_cast<size_t>(v.limit)]);
  }
}

}  // namespace pilesim::glue
