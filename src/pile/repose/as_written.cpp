// Section 5.2 of the dissertation to the letter: it changes only the criterion for sleep, and
// steers nothing. docs/dissertation.md lists the choices where the text is open.

#include <algorithm>
#include <cmath>

#include "pile/repose/repose_constants.h"
#include "pile/repose/repose_director.h"

namespace pilesim {

using namespace repose_constants;

void ReposeDirector::decide_as_written(BodyControl& control) {
  state_.now_s = control.time_s();
  read_bodies(control);
  piles_.place_new(state_.motion, support_.on_fixed);
  piles_.merge();
  piles_.count(state_.motion);
  if (is_avalanche()) state_.woken_by_avalanches += wake_all(control);
  if (is_hit_hard()) state_.wakes_by_momentum += wake_all(control) > 0 ? 1 : 0;
  for (const uint32_t body : bodies_.dynamic) {
    if (!state_.motion.present[body] || state_.motion.asleep[body]) continue;
    if (state_.now_s >= state_.grace_until_s[body] && scores(body)) put_to_sleep(control, body);
  }
}

// 5.2.4: true if a layer has become denser than the threshold. A layer that stays denser has had
// its avalanche.
bool ReposeDirector::is_avalanche() {
  bool starts = false;
  const std::vector<PileState>& piles = piles_.piles();
  state_.dense.resize(piles.size());
  for (size_t i = 0; i < piles.size(); ++i) {
    if (!piles[i].structure) continue;
    const std::vector<StackingLayer>& layers = piles[i].structure->layers();
    std::vector<uint8_t>& dense = state_.dense[i];
    if (dense.size() != layers.size()) dense.assign(layers.size(), 0);  // the structure has grown
    for (size_t k = 0; k < layers.size(); ++k) {
      const bool is_dense = layers[k].density() > kAvalancheDensity;
      starts = starts || (is_dense && dense[k] == 0);
      dense[k] = is_dense ? 1 : 0;
    }
  }
  return starts;
}

// 5.2.4: by the momentum before an impact.
bool ReposeDirector::is_hit_hard() const {
  return std::ranges::any_of(bodies_.dynamic, [&](uint32_t body) {
    if (!state_.motion.present[body] || state_.motion.asleep[body]) return false;
    if (momentum_of(body) < kHeavy) return false;
    const double speed = state_.motion.motion[body].linear_velocity.norm();
    const double near_m = model_.shapes[model_.bodies[body].shape].bounding_radius +
                          speed * 2 * kDecisionPeriod * time_unit_s_ + bodies_.longest_m;
    return flies_at_a_sleeper(body, near_m);
  });
}

uint32_t ReposeDirector::wake_all(BodyControl& control) {
  uint32_t woken = 0;
  for (const uint32_t body : bodies_.dynamic) {
    if (!state_.motion.present[body] || !state_.motion.asleep[body]) continue;
    wake(control, body, kGrace * time_unit_s_);
    ++woken;
  }
  return woken;
}

// 5.2.3: rho_i d / (1 + |v|) > tau, in m/s, and all layers below hold sleepers.
bool ReposeDirector::scores(uint32_t body) const {
  const BodyMotion& motion = state_.motion.motion[body];
  return std::ranges::any_of(piles_.piles(), [&](const PileState& pile) {
    if (!pile.structure) return false;
    const StackingStructure& structure = *pile.structure;
    const GroundPoint point(motion.position.x(), motion.position.z());
    if (!pile.shape->inside_walls(point)) return false;
    const size_t layer = structure.layer_at(motion.position.y() - pile.settings.base_m);
    if (layer == structure.layers().size() || !structure.layers_below_sleep(layer)) return false;
    const double score = structure.layers()[layer].density() *
                         structure.closeness(layer, pile.shape->distance(point)) /
                         (1 + motion.linear_velocity.norm());
    return score > pile.settings.tau;
  });
}

}  // namespace pilesim
