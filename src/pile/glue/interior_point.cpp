// Mehrotra's predictor-corrector method on the cones of a glue program, with Nesterov and Todd's
// scaling.
#include <algorithm>
#include <cmath>

#include "core/parallel_for.h"
#include "pile/glue/glue_program.h"

namespace pilesim::glue {
namespace {

constexpr size_t kGrain = 64;
// Share of the distance to the boundary of the cones.
constexpr double kStepShare = 0.99;
// Relative to the diagonal: keeps nearly singular matrices factorable.
constexpr double kLeastShift = 1e-13, kMostShift = 1e-6;

}  // namespace

void Program::for_each(const std::function<void(Variable&, const Pair&)>& visit) {
  parallel_for(pairs_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) {
      for (size_t v = pairs_[p].first; v < pairs_[p].last; ++v) visit(variables_[v], pairs_[p]);
    }
  });
}

// The total wrench of the variables' values on all bodies.
VectorX Program::sum(const std::function<Vec4(const Variable&)>& values) const {
  VectorX total = VectorX::Zero(wanted_.size());
  for (const Pair& pair : pairs_) {
    Wrench a = Wrench::Zero(), b = Wrench::Zero();
    for (size_t v = pair.first; v < pair.last; ++v) {
      const Vec4 value = values(variables_[v]);
      a += variables_[v].on_a * value;
      b += variables_[v].on_b * value;
    }
    if (pair.a != kFixed) total.segment<6>(Eigen::Index{6} * pair.a) += a;
    if (pair.b != kFixed) total.segment<6>(Eigen::Index{6} * pair.b) += b;
  }
  return total;
}

Vec4 Program::pull(const Variable& variable, const Pair& pair, const VectorX& on_rows,
                   double Limit::*on_limit) const {
  Vec4 value = Vec4::Zero();
  if (variable.limit >= 0) value[0] = pair.limits[static_cast<size_t>(variable.limit)].*on_limit;
  if (pair.a != kFixed)
    value += variable.on_a.transpose() * on_rows.segment<6>(Eigen::Index{6} * pair.a);
  if (pair.b != kFixed)
    value += variable.on_b.transpose() * on_rows.segment<6>(Eigen::Index{6} * pair.b);
  return value;
}

void Program::begin() {
  y_ = VectorX::Zero(wanted_.size());
  for (Variable& variable : variables_) {
    variable.x = variable.s = Vec4(1, 0, 0, 0);
  }
  // Start with all limits met: a large residual in one would delay all others.
  for (Pair& pair : pairs_) {
    for_limited(pair, [](Variable& v, const Limit& limit) {
      const double given = std::min(1.0, limit.most / 2);
      v.x[0] = v.is_rest() ? limit.most - given : given;
      v.s[0] = 1 / v.x[0];
    });
  }
}

void Program::leave() {
  left_ = wanted_ - sum([](const Variable& v) { return v.x; });
  for (Pair& pair : pairs_) {
    for (Limit& limit : pair.limits) limit.left = limit.most;
    for_limited(pair, [](const Variable& v, Limit& limit) { limit.left -= v.x[0]; });
  }
  for_each([&](Variable& v, const Pair& pair) {
    v.dual_left = v.cost - pull(v, pair, y_, &Limit::y) - v.s;
  });
}

double Program::gap() const {
  double total = 0;
  for (const Variable& v : variables_) total += v.x.dot(v.s);
  return total;
}

bool Program::is_done() const {
  double dual = 0, cost = 0, largest = 0;
  for (const Variable& v : variables_) {
    dual = std::max(dual, v.dual_left.cwiseAbs().maxCoeff());
    cost += v.cost.dot(v.x);
    if (!v.is_rest()) largest = std::max(largest, v.x[0]);
  }
  double limits = 0;
  for (const Pair& pair : pairs_) {
    for (const Limit& limit : pair.limits) limits = std::max(limits, std::abs(limit.left));
  }
  const double tolerance = settings_.tolerance;
  return limits <= tolerance * (1 + largest) &&
         left_.cwiseAbs().maxCoeff() <= tolerance * (1 + largest) && dual <= tolerance &&
         gap() <= tolerance * (1 + cost);
}

bool Program::factor() {
  parallel_for(pairs_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) {
      Pair& pair = pairs_[p];
      pair.aa.setZero();
      pair.ab.setZero();
      pair.bb.setZero();
      for (size_t i = pair.first; i < pair.last; ++i) {
        Variable& v = variables_[i];
        v.scaling = cone::Scaling(v.x, v.s);
        const Effect a = v.on_a * v.scaling.square, b = v.on_b * v.scaling.square;
        pair.aa.noalias() += a * v.on_a.transpose();
        pair.ab.noalias() += a * v.on_b.transpose();
        pair.bb.noalias() += b * v.on_b.transpose();
      }
      take_out(pair);
    }
  });
  for (double shift = kLeastShift; shift <= kMostShift; shift *= 100) {
    for (Block& block : diagonal_) block.setZero();
    for (const Pair& pair : pairs_) {
      if (pair.a != kFixed) diagonal_[pair.a] += pair.aa;
      if (pair.b != kFixed) diagonal_[pair.b] += pair.bb;
      if (pair.edge) beside_[*pair.edge] = pair.ab;
    }
    for (Block& block : diagonal_) block.diagonal() *= 1 + shift;
    if (matrix_->factor(diagonal_, beside_)) return true;
  }
  return false;
}

// Eliminates the rows of its limits by their coupling to the bodies' rows.
void Program::take_out(Pair& pair) {
  for (Limit& limit : pair.limits) limit = {.most = limit.most, .y = limit.y, .left = limit.left};
  for_limited(pair, [](const Variable& v, Limit& limit) {
    const Vec4 column = v.scaling.square.col(0);
    limit.pivot += column[0];
    limit.on_a.noalias() += v.on_a * column;
    limit.on_b.noalias() += v.on_b * column;
  });
  for (const Limit& limit : pair.limits) {
    pair.aa.noalias() -= limit.on_a * limit.on_a.transpose() / limit.pivot;
    pair.ab.noalias() -= limit.on_a * limit.on_b.transpose() / limit.pivot;
    pair.bb.noalias() -= limit.on_b * limit.on_b.transpose() / limit.pivot;
  }
}

// The step whose scaled parts add up to `wanted` and that removes all residuals.
void Program::find_step(const std::function<Vec4(const Variable&)>& wanted) {
  const auto given = [&](const Variable& v) -> Vec4 {
    return v.scaling.w * wanted(v) - v.scaling.square * v.dual_left;
  };
  VectorX total = left_ - sum(given);
  for (Pair& pair : pairs_) {
    for (Limit& limit : pair.limits) limit.known = limit.left;
    for_limited(pair, [&](const Variable& v, Limit& limit) { limit.known -= given(v)[0]; });
    for (const Limit& limit : pair.limits) {
      const double along = limit.known / limit.pivot;
      if (pair.a != kFixed) total.segment<6>(Eigen::Index{6} * pair.a) -= along * limit.on_a;
      if (pair.b != kFixed) total.segment<6>(Eigen::Index{6} * pair.b) -= along * limit.on_b;
    }
  }
  const auto follow = [&] {
    for (Pair& pair : pairs_) {
      for (Limit& limit : pair.limits) {
        double rest = limit.known;
        if (pair.a != kFixed) rest -= limit.on_a.dot(step_y_.segment<6>(Eigen::Index{6} * pair.a));
        if (pair.b != kFixed) rest -= limit.on_b.dot(step_y_.segment<6>(Eigen::Index{6} * pair.b));
        limit.step_y = rest / limit.pivot;
      }
    }
    for_each([&](Variable& v, const Pair& pair) {
      v.step_s = v.dual_left - pull(v, pair, step_y_, &Limit::step_y);
      v.step_x = v.scaling.w * wanted(v) - v.scaling.square * v.step_s;
    });
  };
  step_y_ = total;
  matrix_->solve(step_y_);
  follow();
  // Near the end scalings differ by many powers of ten: one refinement step removes the errors of
  // rounding and of the diagonal's shift.
  VectorX rest = left_ - sum([](const Variable& v) -> Vec4 { return v.step_x; });
  matrix_->solve(rest);
  step_y_ += rest;
  follow();
}

std::pair<double, double> Program::most_steps() const {
  double primal = 1, dual = 1;
  for (const Variable& v : variables_) {
    primal = std::min(primal, cone::most_step(v.x, v.step_x));
    dual = std::min(dual, cone::most_step(v.s, v.step_s));
  }
  return {primal, dual};
}

void Program::take_step(double primal, double dual) {
  y_ += dual * step_y_;
  for (Pair& pair : pairs_) {
    for (Limit& limit : pair.limits) limit.y += dual * limit.step_y;
  }
  for (Variable& v : variables_) {
    v.x += primal * v.step_x;
    v.s += dual * v.step_s;
  }
}

GlueSolution Program::run() {
  begin();
  bool is_solved = variables_.empty();
  int iterations = 0;
  const auto degree = static_cast<double>(variables_.size());
  for (; !is_solved && iterations < settings_.most_iterations; ++iterations) {
    leave();
    is_solved = is_done();
    if (is_solved || !factor()) break;
    const double mean = gap() / degree;
    if (!std::isfinite(mean)) break;
    // Mehrotra (1992): predict a straight step to the end, then correct for the curvature it
    // reveals.
    find_step([](const Variable& v) -> Vec4 { return -v.scaling.scaled; });
    const auto [primal, dual] = most_steps();
    double ahead = 0;
    for (const Variable& v : variables_) {
      ahead += (v.x + primal * v.step_x).dot(v.s + dual * v.step_s);
    }
    const double centring = std::pow(std::clamp(ahead / degree / mean, 0.0, 1.0), 3);
    std::vector<Vec4> curve(variables_.size());
    for (size_t i = 0; i < variables_.size(); ++i) {
      Variable& v = variables_[i];
      const Vec4& size = v.scaling.scaled;
      curve[i] = -cone::product(size, size) -
                 cone::product(v.scaling.inverse * v.step_x, v.scaling.w * v.step_s);
      curve[i][0] += centring * mean;
      curve[i] = cone::quotient(curve[i], size);
    }
    find_step([&](const Variable& v) { return curve[&v - variables_.data()]; });
    const auto [most_primal, most_dual] = most_steps();
    take_step(most_primal < 1 ? kStepShare * most_primal : 1,
              most_dual < 1 ? kStepShare * most_dual : 1);
  }
  GlueSolution solution = read();
  solution.is_solved = is_solved;
  solution.iterations = iterations;
  return solution;
}

}  // namespace pilesim::glue
