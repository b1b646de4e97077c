#include "simulate/sphere/dispatch_table.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "core/error.h"

namespace pilesim {
namespace {

constexpr size_t kMostGroups = 64;

bool stands(const ModelBody& body) { return body.role != Role::dynamic || body.held; }

}  // namespace

DispatchTable::DispatchTable(const LevelOfDetail& detail, const Model& model)
    : levels_(detail.levels), class_(model.bodies.size()) {
  make_groups(model);
  find_what_is_solved(model, static_cast<uint32_t>(detail.level - 1));
  classes_ = groups_ * level_count() * kBehaviours;
  methods_.resize(size_t{classes_} * classes_);
  for (uint32_t a = 0; a < classes_; ++a) {
    for (uint32_t b = 0; b < classes_; ++b) methods_[a * classes_ + b] = method_of(a, b);
    const PairMethod lying = by_level(static_cast<Behaviour>(a % kBehaviours),
                                      a / kBehaviours % level_count(), Behaviour::standing, 0);
    posed_.push_back(lying != PairMethod::particle ? 1 : 0);
  }
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    set(i,
        body.preference == Preference::must_impulse ? Behaviour::exact
        : stands(body)                              ? Behaviour::standing
                                                    : Behaviour::statistical,
        0);
  }
}

// Bodies named on the same sides of the same rules form a group.
void DispatchTable::make_groups(const Model& model) {
  const std::vector<ModelPairRule>& rules = model.pair_rules;
  std::vector<std::vector<bool>> named(model.bodies.size(),
                                       std::vector<bool>(2 * rules.size(), false));
  for (size_t r = 0; r < rules.size(); ++r) {
    for (const uint32_t body : rules[r].a) named[body][2 * r] = true;
    for (const uint32_t body : rules[r].b) named[body][2 * r + 1] = true;
  }
  std::map<std::vector<bool>, uint8_t> known;
  std::vector<std::vector<bool>> names;
  for (const std::vector<bool>& name : named) {
    const auto [group, is_new] = known.try_emplace(name, static_cast<uint8_t>(names.size()));
    if (is_new) names.push_back(name);
    if (names.size() > kMostGroups) {
      throw Error(ErrorKind::input, {.pointer = "/simulator/level_of_detail/pairs",
                                     .found = "tell too many kinds of bodies apart",
                                     .expected = "at most " + std::to_string(kMostGroups)});
    }
    group_.push_back(group->second);
  }
  groups_ = std::max<uint32_t>(1, static_cast<uint32_t>(names.size()));
  rules_.assign(size_t{groups_} * groups_, PairMethod::none);
  has_rule_.assign(groups_, 0);
  for (uint32_t a = 0; a < names.size(); ++a) {
    for (uint32_t b = 0; b < names.size(); ++b) {
      for (size_t r = 0; r < rules.size(); ++r) {
        const bool applies =
            (names[a][2 * r] && names[b][2 * r + 1]) || (names[b][2 * r] && names[a][2 * r + 1]);
        if (!applies) continue;
        rules_[a * groups_ + b] = rules[r].method;
        has_rule_[a] = has_rule_[b] = 1;
      }
    }
  }
}

void DispatchTable::find_what_is_solved(const Model& model, uint32_t finest_level) {
  std::set<uint8_t> free, standing;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    if (body.preference != Preference::prefer_statistical) continue;
    if (body.role == Role::dynamic) free.insert(group_[i]);
    if (stands(body)) standing.insert(group_[i]);
  }
  const auto may_solve = [&](const std::set<uint8_t>& ones, Behaviour one,
                             const std::set<uint8_t>& others, Behaviour other) {
    bool at_some_level = false;
    for (uint32_t level = finest_level; level < level_count(); ++level) {
      at_some_level |= by_level(one, level, other, level) == PairMethod::impulse;
    }
    bool found = false;
    for (const uint8_t a : ones) {
      for (const uint8_t b : others) {
        const PairMethod by_rule = rule(a, b);
        found |= by_rule == PairMethod::impulse || (by_rule == PairMethod::none && at_some_level);
      }
    }
    return found;
  };
  constexpr Behaviour kNear = Behaviour::near_exact;
  may_solve_spheres_ = may_solve(free, kNear, free, kNear);
  may_solve_standing_ = may_solve(free, kNear, standing, Behaviour::standing);
}

void DispatchTable::set(uint32_t body, Behaviour behaviour, uint32_t level) {
  class_[body] = static_cast<uint16_t>((group_[body] * level_count() + level) * kBehaviours +
                                       static_cast<uint32_t>(behaviour));
}

PairMethod DispatchTable::method_of(uint32_t class_a, uint32_t class_b) const {
  const auto behaviour = [](uint32_t c) { return static_cast<Behaviour>(c % kBehaviours); };
  const auto level = [&](uint32_t c) { return c / kBehaviours % level_count(); };
  const auto group = [&](uint32_t c) { return c / kBehaviours / level_count(); };
  const Behaviour a = behaviour(class_a), b = behaviour(class_b);
  if (a == Behaviour::standing && b == Behaviour::standing) return PairMethod::none;
  const PairMethod by_rule = rule(group(class_a), group(class_b));
  if (by_rule != PairMethod::none) return by_rule;
  return by_level(a, level(class_a), b, level(class_b));
}

PairMethod DispatchTable::by_level(Behaviour a, uint32_t level_a, Behaviour b,
                                   uint32_t level_b) const {
  using enum Behaviour;
  if (a > b) return by_level(b, level_b, a, level_a);
  if (a == exact) return b == statistical ? PairMethod::none : PairMethod::impulse;
  const DetailLevel& finer = levels_[b == standing ? level_a : std::min(level_a, level_b)];
  if (a == near_exact) return b == statistical ? finer.near_far : finer.near_near;
  return finer.far_far;
}

bool DispatchTable::attracts(uint32_t exact, uint32_t body) const {
  return rule(group_[exact], group_[body]) == PairMethod::none;
}

bool DispatchTable::uses(PairMethod method) const {
  return std::ranges::any_of(levels_,
                             [&](const DetailLevel& level) {
                               return level.near_near == method || level.near_far == method ||
                                      level.far_far == method;
                             }) ||
         std::ranges::find(rules_, method) != rules_.end();
}

void DispatchTable::load(StateReader& reader) {
  const size_t bodies = class_.size();
  reader(class_);
  StateReader::require(class_.size() == bodies, "a class for each body");
  for (const uint16_t of_body : class_) StateReader::require(of_body < classes_, "a class");
}

}  // namespace pilesim
