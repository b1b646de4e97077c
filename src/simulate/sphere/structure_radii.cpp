#include "simulate/sphere/structure_radii.h"

#include <algorithm>
#include <cmath>

#include "simulate/sphere/sphere_constants.h"
#include "simulate/sphere/sphere_grid.h"

namespace pilesim {
namespace {

using namespace sphere_constants;

}  // namespace

std::vector<float> radii_in_structures(const Model& model, const std::vector<float>& full_m) {
  std::vector<uint32_t> asleep;
  std::vector<Vec3f> centres;
  std::vector<float> full;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    if (!model.bodies[i].asleep || full_m[i] == 0) continue;
    asleep.push_back(i);
    centres.push_back(model.bodies[i].pose.position.cast<float>());
    full.push_back(full_m[i]);
  }
  std::vector<float> radii = full_m;
  if (asleep.empty()) return radii;
  SphereGrid grid;
  grid.sort(centres, full);
  const std::span<const uint32_t> order = grid.order();
  for (size_t i = 0; i < asleep.size(); ++i) {
    const Vec3f around = Vec3f::Constant(full[i] + grid.widest_m());
    grid.for_each_in(centres[i] - around, centres[i] + around, [&](uint32_t place) {
      const uint32_t other = order[place];
      const float apart = (centres[other] - centres[i]).norm();
      if (other == i || apart == 0) return;
      float& radius = radii[asleep[i]];
      radius = std::min(radius, apart * full[i] / (full[i] + full[other]));
    });
  }
  return radii;
}

float reach_below_at_start_m(const Model& model, uint32_t body) {
  const ModelBody& source = model.bodies[body];
  const Vec3 down = source.pose.orientation.conjugate() * -Vec3::UnitY();
  double reach = 0;
  for (const Vec3& vertex : model.shapes[source.shape].mesh.vertices) {
    reach = std::max(reach, down.dot(vertex));
  }
  return static_cast<float>(reach);
}

bool has_left_place(const ModelBody& body, float radius_m, const Vec3f& position,
                    const Quatf& orientation) {
  return (position - body.pose.position.cast<float>()).norm() > radius_m ||
         orientation.angularDistance(body.pose.orientation.cast<float>()) > kTurned;
}

}  // namespace pilesim
