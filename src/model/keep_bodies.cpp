#include "model/keep_bodies.h"

#include <utility>

namespace pilesim {

void keep_bodies(const std::vector<bool>& stays, Model& model) {
  std::vector<uint32_t> number(stays.size() + 1);  // of those before, that stay
  std::vector<ModelBody> bodies;
  for (uint32_t i = 0; i < stays.size(); ++i) {
    number[i] = static_cast<uint32_t>(bodies.size());
    if (stays[i]) bodies.push_back(std::move(model.bodies[i]));
  }
  number.back() = static_cast<uint32_t>(bodies.size());
  model.bodies = std::move(bodies);
  const auto renumber = [&](std::vector<uint32_t>& of) {
    std::erase_if(of, [&](uint32_t i) { return !stays[i]; });
    for (uint32_t& i : of) i = number[i];
  };
  for (ModelEvent& event : model.events) renumber(event.bodies);
  std::erase_if(model.events,
                [](const ModelEvent& event) { return event.bodies.empty() && event.highest == 0; });
  for (ModelPairRule& rule : model.pair_rules) {
    renumber(rule.a);
    renumber(rule.b);
  }
  std::erase_if(model.start_overlaps,
                [&](const StartOverlap& pair) { return !stays[pair.a] || !stays[pair.b]; });
  for (StartOverlap& pair : model.start_overlaps) {
    pair.a = number[pair.a];
    pair.b = number[pair.b];
  }
  const auto narrow = [&](BodyRange& range) {
    const uint32_t first = number[range.first], end = number[range.first + range.count];
    range.first = first;
    range.count = end - first;
  };
  if (model.guide_fill) narrow(*model.guide_fill);
  if (model.moulded) narrow(*model.moulded);
  for (EmitterStop& stop : model.stops) narrow(stop);
}

}  // namespace pilesim
