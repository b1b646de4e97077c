#include "pile/repose/pile_bodies.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pile/repose/height_field.h"

namespace pilesim {
namespace {

constexpr double kSurfaceSpacing = 0.2;  // relative to the edge of a cube of the same box volume

double at_share(std::vector<double>& values, double share) {
  const double last = static_cast<double>(values.size() - 1);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * last);
  std::ranges::nth_element(values, at);
  return *at;
}

// Pairs of value and weight; the weighted median has half of the weight below it.
using Weighted = std::pair<double, double>;
double weighted_median(std::vector<Weighted> values) {
  std::ranges::sort(values);
  double half = 0;
  for (const auto& [value, weight] : values) half += weight / 2;
  for (const auto& [value, weight] : values) {
    half -= weight;
    if (half <= 0) return value;
  }
  return values.back().first;
}

}  // namespace

PileBodies::PileBodies(const Model& model) {
  for (const ModelShape& shape : model.shapes) {
    PileBodyShape& body = shapes.emplace_back();
    if (shape.mesh.vertices.empty()) continue;  // a plane
    const Vec3 box = shape.mesh.bounds().sizes();
    body.box_m3 = box.prod();
    body.longest_m = box.norm();
    body.smallest_m = box.minCoeff();
  }
  std::vector<double> longest;
  std::vector<Weighted> box_m3, mass;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    if (model.bodies[i].role != Role::dynamic) continue;
    dynamic.push_back(i);
    PileBodyShape& shape = shapes[model.bodies[i].shape];
    if (shape.surface.empty()) {
      shape.surface = surface_points(model.shapes[model.bodies[i].shape].mesh,
                                     kSurfaceSpacing * std::cbrt(shape.box_m3));
    }
    box_m3.emplace_back(shape.box_m3, shape.box_m3);
    longest.push_back(shape.longest_m);
    mass.emplace_back(model.bodies[i].mass_kg, shape.box_m3);
  }
  if (dynamic.empty()) return;
  size_m = std::cbrt(weighted_median(std::move(box_m3)));
  longest_m = at_share(longest, 0.95);
  mass_kg = weighted_median(std::move(mass));
}

}  // namespace pilesim
