#include "pile/glue/glue.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "core/parallel_for.h"
#include "pile/glue/block_cholesky.h"
#include "pile/glue/cone.h"

namespace pilesim {
namespace {

using cone::Mat4;
using cone::Vec4;
using Block = BlockCholesky::Block;
using Wrench = Eigen::Matrix<double, 6, 1>;  // force, torque over the body's radius
using Effect = Eigen::Matrix<double, 6, 4>;  // of a variable on a body
using VectorX = Eigen::VectorXd;

constexpr size_t kGrain = 64;
constexpr uint32_t kFixed = ~uint32_t{0};
// Below it a contact counts as without friction: its cone is a line.
constexpr double kNoFriction = 1e-3;
// Of the way to the boundary of the cones.
constexpr double kStepShare = 0.99;
// Of the diagonal: keeps factors of nearly singular matrices.
constexpr double kLeastShift = 1e-13, kMostShift = 1e-6;
// In the mean weight: less glue is none.
constexpr double kNoGlue = 1e-5;

// Variables that lie in one cone, and the wrenches that they give two bodies.
struct Variable {
  Effect on_a, on_b;
  Vec4 cost = Vec4::Zero();
  Vec4 x = Vec4::Zero(), s = Vec4::Zero();
  // Of a step.
  cone::Scaling scaling;
  Vec4 dual_left, way_x, way_s;
};

// What two bodies have in common: variables [first, last).
struct Pair {
  uint32_t a, b;  // rows, or kFixed
  size_t first = 0, last = 0;
  std::optional<uint32_t> edge;  // of the matrix, where both move
  Block aa = Block::Zero(), ab = Block::Zero(), bb = Block::Zero();
};

class Program {
 public:
  Program(std::span<const GlueBody> bodies, std::span<const GlueContact> contacts, const Vec3& up,
          const GlueSettings& settings);
  GlueSolution run();

 private:
  void find_hanging();
  void add_pair(std::span<const uint32_t> contacts);
  Effect effect(uint32_t body, const Vec3& position, const Eigen::Matrix<double, 3, 4>& force,
                double sign) const;
  void begin();
  void leave();
  bool is_done() const;
  bool factor();
  void find_way(const std::function<Vec4(const Variable&)>& wanted);
  std::pair<double, double> most_steps() const;
  void take_step(double primal, double dual);
  VectorX sum(const std::function<Vec4(const Variable&)>& values) const;
  Vec4 pull(const Variable& variable, const Pair& pair, const VectorX& on_rows) const;
  void for_each(const std::function<void(Variable&, const Pair&)>& visit);
  double gap() const;
  GlueSolution read() const;

  std::span<const GlueBody> bodies_;
  std::span<const GlueContact> contacts_;
  Vec3 up_;
  GlueSettings settings_;
  double unit_kg_ = 1;  // mean mass
  std::vector<uint8_t> hangs_;
  std::vector<uint32_t> row_;     // of bodies: kFixed, or where their six rows are
  std::vector<uint32_t> sorted_;  // contacts by pair
  std::vector<size_t> variable_;  // of contacts: of their push; that of their glue is the next
  std::vector<Variable> variables_;
  std::vector<Pair> pairs_;
  struct Patch {
    uint32_t a, b;
    size_t variable;
  };
  std::vector<Patch> patches_;
  VectorX wanted_, y_, left_, way_y_;  // (6 rows)
  std::vector<Block> diagonal_, beside_;
  std::optional<BlockCholesky> matrix_;
};

Program::Program(std::span<const GlueBody> bodies, std::span<const GlueContact> contacts,
                 const Vec3& up, const GlueSettings& settings)
    : bodies_(bodies), contacts_(contacts), up_(up), settings_(settings) {
  find_hanging();
  row_.assign(bodies.size(), kFixed);
  std::vector<Vec3> places;
  double mass_kg = 0;
  for (uint32_t i = 0; i < bodies.size(); ++i) {
    if (bodies[i].mass_kg == 0 || hangs_[i] != 0) continue;
    row_[i] = static_cast<uint32_t>(places.size());
    places.push_back(bodies[i].centre);
    mass_kg += bodies[i].mass_kg;
  }
  if (!places.empty()) unit_kg_ = mass_kg / static_cast<double>(places.size());
  wanted_ = VectorX::Zero(static_cast<Eigen::Index>(6 * places.size()));
  for (uint32_t i = 0; i < bodies.size(); ++i) {
    if (row_[i] != kFixed)
      wanted_.segment<3>(Eigen::Index{6} * row_[i]) = bodies[i].mass_kg / unit_kg_ * up;
  }
  variable_.assign(contacts.size(), 0);
  const auto pair_of = [&](uint32_t c) {
    return std::pair<uint32_t, uint32_t>(std::minmax({contacts[c].a, contacts[c].b}));
  };
  for (uint32_t c = 0; c < contacts.size(); ++c) {
    if (row_[contacts[c].a] != kFixed || row_[contacts[c].b] != kFixed) sorted_.push_back(c);
  }
  std::ranges::stable_sort(sorted_, {}, pair_of);
  std::vector<BlockCholesky::Edge> edges;
  for (size_t first = 0, last = 0; first < sorted_.size(); first = last) {
    while (last < sorted_.size() && pair_of(sorted_[last]) == pair_of(sorted_[first])) ++last;
    add_pair(std::span(sorted_).subspan(first, last - first));
    Pair& pair = pairs_.back();
    if (pair.a == kFixed || pair.b == kFixed) continue;
    pair.edge = static_cast<uint32_t>(edges.size());
    edges.emplace_back(pair.a, pair.b);
  }
  diagonal_.resize(places.size());
  beside_.resize(edges.size());
  matrix_.emplace(places, std::move(edges));
}

// Whom no chain of contacts joins to what stands by itself.
void Program::find_hanging() {
  std::vector<std::vector<uint32_t>> touching(bodies_.size());
  for (const GlueContact& contact : contacts_) {
    touching[contact.a].push_back(contact.b);
    touching[contact.b].push_back(contact.a);
  }
  hangs_.assign(bodies_.size(), 1);
  std::vector<uint32_t> queue;
  for (uint32_t i = 0; i < bodies_.size(); ++i) {
    if (bodies_[i].mass_kg > 0) continue;
    hangs_[i] = 0;
    queue.push_back(i);
  }
  for (size_t next = 0; next < queue.size(); ++next) {
    for (const uint32_t other : touching[queue[next]]) {
      if (hangs_[other] == 0) continue;
      hangs_[other] = 0;
      queue.push_back(other);
    }
  }
}

// Of forces `force` x at a place, and their torques.
Effect Program::effect(uint32_t body, const Vec3& position,
                       const Eigen::Matrix<double, 3, 4>& force, double sign) const {
  if (row_[body] == kFixed) return Effect::Zero();
  const Vec3 arm = (position - bodies_[body].centre) / bodies_[body].radius_m;
  Effect effect;
  effect.topRows<3>() = sign * force;
  for (int k = 0; k < 4; ++k) effect.block<3, 1>(3, k) = arm.cross(sign * force.col(k));
  return effect;
}

void Program::add_pair(std::span<const uint32_t> contacts) {
  const uint32_t a = contacts_[contacts[0]].a, b = contacts_[contacts[0]].b;
  Pair& pair = pairs_.emplace_back(Pair{.a = row_[a], .b = row_[b]});
  pair.first = variables_.size();
  const auto add = [&](uint32_t c, const Eigen::Matrix<double, 3, 4>& force, double cost) {
    const GlueContact& contact = contacts_[c];
    Variable& made = variables_.emplace_back();
    const double sign = contact.a == a ? 1 : -1;
    made.on_a = effect(a, contact.position, force, sign);
    made.on_b = effect(b, contact.position, force, -sign);
    made.cost[0] = cost;
  };
  for (const uint32_t c : contacts) {
    const Vec3& normal = contacts_[c].normal;
    variable_[c] = variables_.size();
    Eigen::Matrix<double, 3, 4> force = Eigen::Matrix<double, 3, 4>::Zero();
    if (contacts_[c].friction < kNoFriction) {
      force.col(0) = normal;
      add(c, force, settings_.push_cost);
    } else {
      force.col(0) = normal / contacts_[c].friction;
      force.col(1) = normal.unitOrthogonal();
      force.col(2) = normal.cross(force.col(1));
      add(c, force, settings_.push_cost / contacts_[c].friction);
    }
    force.setZero();
    force.col(0) = -normal;
    add(c, force, 1);
  }
  Variable& patch = variables_.emplace_back();
  patch.on_a.setZero();
  patch.on_b.setZero();
  const double radius = std::min(bodies_[a].mass_kg > 0 ? bodies_[a].radius_m : 1e300,
                                 bodies_[b].mass_kg > 0 ? bodies_[b].radius_m : 1e300);
  for (int k = 0; k < 3; ++k) {
    if (pair.a != kFixed) patch.on_a(3 + k, 1 + k) = radius / bodies_[a].radius_m;
    if (pair.b != kFixed) patch.on_b(3 + k, 1 + k) = -radius / bodies_[b].radius_m;
  }
  patch.cost[0] = 1 / settings_.patch;
  patches_.push_back({a, b, variables_.size() - 1});
  pair.last = variables_.size();
}

void Program::for_each(const std::function<void(Variable&, const Pair&)>& visit) {
  parallel_for(pairs_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t p = begin; p < end; ++p) {
      for (size_t v = pairs_[p].first; v < pairs_[p].last; ++v) visit(variables_[v], pairs_[p]);
    }
  });
}

// The wrenches that values of the variables give all bodies.
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

Vec4 Program::pull(const Variable& variable, const Pair& pair, const VectorX& on_rows) const {
  Vec4 value = Vec4::Zero();
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
}

void Program::leave() {
  left_ = wanted_ - sum([](const Variable& v) { return v.x; });
  for_each([&](Variable& v, const Pair& pair) { v.dual_left = v.cost - pull(v, pair, y_) - v.s; });
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
    largest = std::max(largest, v.x[0]);
  }
  const double tolerance = settings_.tolerance;
  return left_.cwiseAbs().maxCoeff() <= tolerance * (1 + largest) && dual <= tolerance &&
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

// The step whose scaled parts add up to `wanted`, and that leaves no residual.
void Program::find_way(const std::function<Vec4(const Variable&)>& wanted) {
  const VectorX total = left_ - sum([&](const Variable& v) -> Vec4 {
                          return v.scaling.w * wanted(v) - v.scaling.square * v.dual_left;
                        });
  const auto follow = [&] {
    for_each([&](Variable& v, const Pair& pair) {
      v.way_s = v.dual_left - pull(v, pair, way_y_);
      v.way_x = v.scaling.w * wanted(v) - v.scaling.square * v.way_s;
    });
  };
  way_y_ = total;
  matrix_->solve(way_y_);
  follow();
  // Near the end scalings differ by many powers of ten: what rounding and the shift of the diagonal
  // have left is solved for once more.
  VectorX rest = total - sum([](const Variable& v) -> Vec4 {
                   return v.scaling.square * (v.dual_left - v.way_s);
                 });
  matrix_->solve(rest);
  way_y_ += rest;
  follow();
}

std::pair<double, double> Program::most_steps() const {
  double primal = 1, dual = 1;
  for (const Variable& v : variables_) {
    primal = std::min(primal, cone::most_step(v.x, v.way_x));
    dual = std::min(dual, cone::most_step(v.s, v.way_s));
  }
  return {primal, dual};
}

void Program::take_step(double primal, double dual) {
  y_ += dual * way_y_;
  for (Variable& v : variables_) {
    v.x += primal * v.way_x;
    v.s += dual * v.way_s;
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
    // Mehrotra (1992): straight to the end, then with what that shows of the curve.
    find_way([](const Variable& v) -> Vec4 { return -v.scaling.scaled; });
    const auto [primal, dual] = most_steps();
    double ahead = 0;
    for (const Variable& v : variables_) {
      ahead += (v.x + primal * v.way_x).dot(v.s + dual * v.way_s);
    }
    const double centring = std::pow(std::clamp(ahead / degree / mean, 0.0, 1.0), 3);
    std::vector<Vec4> curve(variables_.size());
    for (size_t i = 0; i < variables_.size(); ++i) {
      Variable& v = variables_[i];
      const Vec4& size = v.scaling.scaled;
      curve[i] = -cone::product(size, size) -
                 cone::product(v.scaling.inverse * v.way_x, v.scaling.w * v.way_s);
      curve[i][0] += centring * mean;
      curve[i] = cone::quotient(curve[i], size);
    }
    find_way([&](const Variable& v) { return curve[&v - variables_.data()]; });
    const auto [most_primal, most_dual] = most_steps();
    take_step(most_primal < 1 ? kStepShare * most_primal : 1,
              most_dual < 1 ? kStepShare * most_dual : 1);
  }
  GlueSolution solution = read();
  solution.is_solved = is_solved;
  solution.iterations = iterations;
  return solution;
}

GlueSolution Program::read() const {
  GlueSolution solution;
  solution.hangs = hangs_;
  solution.force.assign(contacts_.size(), Vec3::Zero());
  solution.glue_kg.assign(contacts_.size(), 0);
  for (const uint32_t c : sorted_) {
    const Vec3& normal = contacts_[c].normal;
    const Vec4& push = variables_[variable_[c]].x;
    double glue = variables_[variable_[c] + 1].x[0];
    if (glue < kNoGlue) glue = 0;
    Vec3 force = push[0] * normal;
    if (contacts_[c].friction >= kNoFriction) {
      const Vec3 u = normal.unitOrthogonal();
      force = push[0] / contacts_[c].friction * normal + push[1] * u + push[2] * normal.cross(u);
    }
    solution.force[c] = unit_kg_ * (force - glue * normal);
    solution.glue_kg[c] = unit_kg_ * glue;
    solution.total_kg += solution.glue_kg[c];
  }
  for (const Patch& patch : patches_) {
    const Vec4& x = variables_[patch.variable].x;
    const double glue = x[0] / settings_.patch;
    if (glue < kNoGlue) continue;
    const double radius =
        std::min(bodies_[patch.a].mass_kg > 0 ? bodies_[patch.a].radius_m : 1e300,
                 bodies_[patch.b].mass_kg > 0 ? bodies_[patch.b].radius_m : 1e300);
    solution.patches.push_back(
        {patch.a, patch.b, unit_kg_ * radius * x.tail<3>(), unit_kg_ * glue});
    solution.total_kg += unit_kg_ * glue;
  }
  return solution;
}

}  // namespace

GlueSolution least_glue(std::span<const GlueBody> bodies, std::span<const GlueContact> contacts,
                        const Vec3& up, const GlueSettings& settings) {
  return Program(bodies, contacts, up, settings).run();
}

}  // namespace pilesim
