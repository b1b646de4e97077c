#include "pile/glue/glue_program.h"

#include <algorithm>
#include <map>

namespace pilesim {
namespace glue {
namespace {

constexpr size_t kNone = ~size_t{0};
// Below it a contact counts as frictionless: its cone is a line.
constexpr double kNoFriction = 1e-3;
// In the mean weight: less glue counts as none.
constexpr double kNoGlue = 1e-5;
// Price of existing glue, where new glue costs 1.
constexpr double kPriceThere = 0.01;

std::pair<uint32_t, uint32_t> ordered(uint32_t a, uint32_t b) { return std::minmax(a, b); }

}  // namespace

Program::Program(std::span<const GlueBody> bodies, std::span<const GlueContact> contacts,
                 const Vec3& up, const GlueSettings& settings, std::span<const GlueThere> there)
    : bodies_(bodies), contacts_(contacts), there_(there), up_(up), settings_(settings) {
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
  const auto pair_of = [&](uint32_t c) { return ordered(contacts[c].a, contacts[c].b); };
  std::map<std::pair<uint32_t, uint32_t>, size_t> spot_of;
  for (size_t i = 0; i < there.size(); ++i) spot_of[ordered(there[i].a, there[i].b)] = i;
  spots_.assign(there.size(), kNone);
  for (uint32_t c = 0; c < contacts.size(); ++c) {
    if (row_[contacts[c].a] != kFixed || row_[contacts[c].b] != kFixed) sorted_.push_back(c);
  }
  std::ranges::stable_sort(sorted_, {}, pair_of);
  for (size_t first = 0, last = 0; first < sorted_.size(); first = last) {
    while (last < sorted_.size() && pair_of(sorted_[last]) == pair_of(sorted_[first])) ++last;
    const GlueContact& contact = contacts[sorted_[first]];
    Pair& pair = add_pair(contact.a, contact.b, std::span(sorted_).subspan(first, last - first));
    const auto spot = spot_of.find(pair_of(sorted_[first]));
    if (spot == spot_of.end()) continue;
    add_spot(pair, spot->second);
    spot_of.erase(spot);
  }
  for (const auto& [bodies_of, spot] : spot_of) {  // has stretched until the bodies no longer touch
    if (row_[there[spot].a] == kFixed && row_[there[spot].b] == kFixed) continue;
    add_spot(add_pair(there[spot].a, there[spot].b, {}), spot);
  }
  std::vector<BlockCholesky::Edge> edges;
  for (Pair& pair : pairs_) {
    if (pair.a == kFixed || pair.b == kFixed) continue;
    pair.edge = static_cast<uint32_t>(edges.size());
    edges.emplace_back(pair.a, pair.b);
  }
  diagonal_.resize(places.size());
  beside_.resize(edges.size());
  matrix_.emplace(places, std::move(edges));
}

// Marks bodies that no chain of contacts and spots joins to a fixed one.
void Program::find_hanging() {
  std::vector<std::vector<uint32_t>> touching(bodies_.size());
  for (const GlueContact& contact : contacts_) {
    touching[contact.a].push_back(contact.b);
    touching[contact.b].push_back(contact.a);
  }
  for (const GlueThere& spot : there_) {
    touching[spot.a].push_back(spot.b);
    touching[spot.b].push_back(spot.a);
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

// The effect of forces `force` x at a position, with their torques.
Effect Program::effect(uint32_t body, const Vec3& position,
                       const Eigen::Matrix<double, 3, 4>& force, double sign) const {
  if (row_[body] == kFixed) return Effect::Zero();
  const Vec3 arm = (position - bodies_[body].centre) / bodies_[body].radius_m;
  Effect effect;
  effect.topRows<3>() = sign * force;
  for (int k = 0; k < 4; ++k) effect.block<3, 1>(3, k) = arm.cross(sign * force.col(k));
  return effect;
}

Pair& Program::add_pair(uint32_t a, uint32_t b, std::span<const uint32_t> contacts) {
  Pair& pair = pairs_.emplace_back(Pair{.a = row_[a], .b = row_[b]});
  pair.first = variables_.size();
  for (const uint32_t c : contacts) {
    const GlueContact& contact = contacts_[c];
    const Vec3& normal = contact.normal;
    const double side = contact.a == a ? 1 : -1;
    const bool slides = contact.friction < kNoFriction;
    Eigen::Matrix<double, 3, 4> force = Eigen::Matrix<double, 3, 4>::Zero();
    force.col(0) = slides ? normal : Vec3(normal / contact.friction);
    if (!slides) {
      force.col(1) = normal.unitOrthogonal();
      force.col(2) = normal.cross(force.col(1));
    }
    variable_[c] = variables_.size();
    add_force(a, b, contact.position, side * force).cost[0] =
        slides ? settings_.push_cost : settings_.push_cost / contact.friction;
    force.setZero();
    force.col(0) = -normal;
    add_force(a, b, contact.position, side * force).cost[0] = 1;
  }
  patches_.push_back({a, b, variables_.size()});
  add_torque(a, b, 1).cost[0] = 1 / settings_.patch;
  pair.last = variables_.size();
  return pair;
}

// Adds the spot to the most recent pair.
void Program::add_spot(Pair& pair, size_t there) {
  const GlueThere& spot = there_[there];
  const bool is_first = row_[spot.a] == pair.a;
  const uint32_t a = is_first ? spot.a : spot.b, b = is_first ? spot.b : spot.a;
  const double side = is_first ? 1 : -1;
  Eigen::Matrix<double, 3, 4> force = Eigen::Matrix<double, 3, 4>::Zero();
  force.rightCols<3>() = side * Mat3::Identity();
  spots_[there] = variables_.size();
  const auto limit = [&](Variable& variable, double most, double cost) {
    const int index = static_cast<int>(pair.limits.size());
    variable.cost[0] = cost;
    variable.limit = index;
    variables_.emplace_back().limit = index;  // the rest
    pair.limits.push_back({.most = most});
  };
  limit(add_force(a, b, spot.position, force), spot.most_kg / unit_kg_, kPriceThere);
  limit(add_torque(a, b, side), spot.most_kgm / (unit_kg_ * patch_radius(a, b)),
        kPriceThere / settings_.patch);
  add_force(a, b, spot.position, force).cost[0] = 1;
  pair.last = variables_.size();
}

// A force x at a position, on a, and its reaction on b.
Variable& Program::add_force(uint32_t a, uint32_t b, const Vec3& position,
                             const Eigen::Matrix<double, 3, 4>& force) {
  Variable& made = variables_.emplace_back();
  made.on_a = effect(a, position, force, 1);
  made.on_b = effect(b, position, force, -1);
  return made;
}

// A torque, times the smaller radius, and its reaction on b; with `side` -1 the sign is reversed.
Variable& Program::add_torque(uint32_t a, uint32_t b, double side) {
  Variable& made = variables_.emplace_back();
  const double radius = patch_radius(a, b);
  for (int k = 0; k < 3; ++k) {
    if (row_[a] != kFixed) made.on_a(3 + k, 1 + k) = side * radius / bodies_[a].radius_m;
    if (row_[b] != kFixed) made.on_b(3 + k, 1 + k) = -side * radius / bodies_[b].radius_m;
  }
  return made;
}

// From the radius of the smaller body that can move.
double Program::patch_radius(uint32_t a, uint32_t b) const {
  return std::min(bodies_[a].mass_kg > 0 ? bodies_[a].radius_m : 1e300,
                  bodies_[b].mass_kg > 0 ? bodies_[b].radius_m : 1e300);
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
    const double radius = patch_radius(patch.a, patch.b);
    solution.patches.push_back(
        {patch.a, patch.b, unit_kg_ * radius * x.tail<3>(), unit_kg_ * glue});
    solution.total_kg += unit_kg_ * glue;
  }
  solution.there_force.assign(there_.size(), Vec3::Zero());
  solution.there_torque = solution.there_force;
  solution.there_lacks.assign(there_.size(), 0);
  for (size_t i = 0; i < there_.size(); ++i) {
    if (spots_[i] == kNone) continue;
    const Variable* const spot = &variables_[spots_[i]];
    const Variable &force = spot[0], &torque = spot[2], &lacks = spot[4];
    solution.there_force[i] = unit_kg_ * force.x.tail<3>();
    solution.there_torque[i] =
        unit_kg_ * patch_radius(there_[i].a, there_[i].b) * torque.x.tail<3>();
    if (lacks.x[0] < kNoGlue) continue;
    solution.there_force[i] += unit_kg_ * lacks.x.tail<3>();
    solution.there_lacks[i] = unit_kg_ * lacks.x[0];
    solution.total_kg += solution.there_lacks[i];
  }
  return solution;
}

}  // namespace glue

GlueSolution least_glue(std::span<const GlueBody> bodies, std::span<const GlueContact> contacts,
                        const Vec3& up, const GlueSettings& settings,
                        std::span<const GlueThere> there) {
  return glue::Program(bodies, contacts, up, settings, there).run();
}

}  // namespace pilesim
