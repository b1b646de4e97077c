#include "pile/pile_bodies.h"

#include <algorithm>
#include <cmath>

#include "pile/height_field.h"

namespace pilesim {
namespace {

constexpr double kSurfaceSpacing = 0.2;  // of a cube of the same box volume

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
  double box_m3 = 0;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    if (model.bodies[i].role != Role::dynamic) continue;
    dynamic.push_back(i);
    PileBodyShape& shape = shapes[model.bodies[i].shape];
    if (shape.surface.empty()) {
      shape.surface = surface_points(model.shapes[model.bodies[i].shape].mesh,
                                     kSurfaceSpacing * std::cbrt(shape.box_m3));
    }
    box_m3 += shape.box_m3;
    longest_m = std::max(longest_m, shape.longest_m);
  }
  if (!dynamic.empty()) size_m = std::cbrt(box_m3 / static_cast<double>(dynamic.size()));
}

}  // namespace pilesim
