#include "pile/repose/stacking_structure.h"

#include <algorithm>
#include <cmath>

namespace pilesim {

StackingStructure::StackingStructure(const PileShape& shape, double volume_m3, double layer_m)
    : reach_(shape.reach_of_volume(volume_m3)), slope_(shape.slope()) {
  const double height = shape.apex_height(reach_);
  const auto count = static_cast<size_t>(std::max(1.0, std::floor(height / layer_m)));
  layers_.resize(count);
  for (size_t i = 0; i < count; ++i) {
    StackingLayer& layer = layers_[i];
    layer.bottom_m = height * static_cast<double>(i) / static_cast<double>(count);
    layer.top_m = height * static_cast<double>(i + 1) / static_cast<double>(count);
    layer.reach_m = reach_ - layer.bottom_m / slope_;
    layer.volume_m3 = shape.volume(reach_, layer.bottom_m, layer.top_m);
  }
}

void StackingStructure::clear() {
  for (StackingLayer& layer : layers_) {
    layer.occupied_m3 = 0;
    layer.bodies = layer.asleep = 0;
  }
}

size_t StackingStructure::layer_at(double height_m) const {
  if (height_m < 0 || height_m >= height()) return layers_.size();
  const double thickness = layers_.front().top_m;
  return std::min(layers_.size() - 1, static_cast<size_t>(height_m / thickness));
}

bool StackingStructure::count(double height_m, double distance_m, double bulk_m3, bool asleep) {
  const size_t i = layer_at(height_m);
  if (i == layers_.size() || distance_m >= layers_[i].reach_m) return false;
  StackingLayer& layer = layers_[i];
  layer.occupied_m3 += bulk_m3;
  ++layer.bodies;
  if (asleep) ++layer.asleep;
  return true;
}

double StackingStructure::occupation() const {
  double occupied = 0;
  double volume = 0;
  for (const StackingLayer& layer : layers_) {
    occupied += layer.occupied_m3;
    volume += layer.volume_m3;
  }
  return occupied / volume;
}

bool StackingStructure::layers_below_sleep(size_t layer) const {
  return std::all_of(layers_.begin(), layers_.begin() + static_cast<std::ptrdiff_t>(layer),
                     [](const StackingLayer& below) { return below.asleep > 0; });
}

double StackingStructure::closeness(size_t layer, double distance_m) const {
  const double reach = layers_[layer].reach_m;
  return std::max(reach - distance_m, 0.0) / reach;
}

}  // namespace pilesim
