#include "job/rest_drops.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>

#include "core/error.h"
#include "core/interrupt.h"
#include "core/parallel_for.h"
#include "core/philox.h"
#include "geometry/convex_hull.h"
#include "geometry/mass_properties.h"
#include "simulate/modes/make_simulator.h"
#include "simulate/simulator.h"

namespace pilesim {
namespace {

constexpr int kMostHullVertices = 255;  // of the impulse simulator
// Under the lowest point, in bounding radii: bodies in scenes fall, and tip over faces on which a
// gently placed body would stay.
constexpr double kClearance = 2;

// In sqrt(r / g), the time in which a body tips over.
constexpr double kFrame = 0.25;
constexpr double kLongestFall = 400;
// In sqrt(d / g), where d is the smaller of r and the smallest extent: a thin stick rolls from
// facet to facet in a time independent of its length.
constexpr double kStep = 1.0 / 32;

constexpr uint32_t kBody = 1;  // index in the model; the plane comes first

ModelShape shape_of(const TriangleMesh& mesh) {
  ModelShape shape{.name = "body"};
  shape.mass = mass_properties(mesh);
  shape.origin_offset = shape.mass.centre_of_mass;
  shape.mass.centre_of_mass = Vec3::Zero();
  TriangleMesh hull = simplified_hull(mesh.vertices, kMostHullVertices);
  for (Vec3& v : hull.vertices) {
    v -= shape.origin_offset;
    shape.bounding_radius = std::max(shape.bounding_radius, v.norm());
  }
  shape.smallest_extent = hull.bounds().sizes().minCoeff();
  shape.mesh = hull;
  shape.pieces.push_back(
      {.kind = CollisionPiece::Kind::hull, .size = Vec3::Zero(), .hull = std::move(hull)});
  return shape;
}

Model make_model(const TriangleMesh& mesh, const ContactMaterial& material) {
  Model model;
  model.materials.push_back(
      {.restitution = material.restitution, .friction = material.friction, .density_kg_m3 = 1000});
  model.shapes.push_back({.name = "ground", .is_plane = true});
  model.shapes.push_back(shape_of(mesh));
  const ModelBody at_rest{.linear_velocity = Vec3::Zero(), .angular_velocity = Vec3::Zero()};
  ModelBody& ground = model.bodies.emplace_back(at_rest);
  ground.name = "ground";
  ground.role = Role::fixed;
  ModelBody& body = model.bodies.emplace_back(at_rest);
  body.name = "body";
  body.shape = 1;
  body.mass_kg = model.materials[0].density_kg_m3 * model.shapes[1].mass.volume_m3;
  return model;
}

double time_of_size_s(const Scene& scene, double size_m) {
  return std::sqrt(size_m / scene.gravity.norm());
}

// None if it did not come to rest.
std::optional<ObservedRest> drop(const Scene& scene, Model model, const Quat& orientation) {
  ModelBody& body = model.bodies[kBody];
  const ModelShape& shape = model.shapes[body.shape];
  double lowest = 0;
  for (const Vec3& v : shape.mesh.vertices) lowest = std::min(lowest, (orientation * v).y());
  body.pose = {Vec3(0, kClearance * shape.bounding_radius - lowest, 0), orientation};
  const std::unique_ptr<Simulator> simulator = make_simulator(scene, model);
  for (int frame = 0; frame < static_cast<int>(kLongestFall / kFrame); ++frame) {
    simulator->step_frame();
    const BodyStates& states = simulator->states();
    if ((states.flags[kBody] & kAsleep) == 0) continue;
    return ObservedRest{.up = states.orientation[kBody].conjugate() * Vec3::UnitY(),
                        .height_m = states.position[kBody].y()};
  }
  return std::nullopt;
}

}  // namespace

RestDrops drop_to_rest(const TriangleMesh& mesh, const RestDropSettings& settings) {
  const Model model = make_model(mesh, settings.material);
  Scene scene;
  const ModelShape& shape = model.shapes[model.bodies[kBody].shape];
  scene.frame_rate = 1 / (kFrame * time_of_size_s(scene, shape.bounding_radius));
  scene.step_s =
      kStep * time_of_size_s(scene, std::min(shape.bounding_radius, shape.smallest_extent));

  Progress progress(settings.progress, "dropping", settings.drops, "drops");
  std::mutex progress_mutex;
  uint32_t done = 0;
  std::vector<std::optional<ObservedRest>> ends(settings.drops);
  parallel_for(settings.drops, 1, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end && !interrupted(); ++i) {
      Philox random(settings.seed, Stream::rest, i);
      ends[i] = drop(scene, model, random.rotation());
      const std::lock_guard lock(progress_mutex);
      progress.update(++done);
    }
  });
  if (interrupted()) {
    throw Error(ErrorKind::interrupted, {.found = "interrupted while bodies were dropped"});
  }
  RestDrops result;
  for (const std::optional<ObservedRest>& end : ends) {
    if (end) {
      result.rests.push_back(*end);
    } else {
      ++result.unsettled;
    }
  }
  return result;
}

}  // namespace pilesim
