// Hand-made models for tests of simulators: no files, no loader.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "geometry/convex_hull.h"
#include "geometry/primitives.h"
#include "model/model.h"
#include "simulate/body_state.h"

namespace pilesim {

namespace test {
inline constexpr double kGravity = 9.81;  // of a scene that names none, m/s^2
}

struct SmallModel {
  Scene scene;
  Model model;

  uint32_t material(double restitution, double friction, double density_kg_m3 = 1000) {
    model.materials.push_back({restitution, friction, density_kg_m3});
    return static_cast<uint32_t>(model.materials.size() - 1);
  }

  uint32_t plane() {
    ModelShape shape;
    shape.name = "plane";
    shape.is_plane = true;
    return add(std::move(shape));
  }

  uint32_t box(const Vec3& size) {
    ModelShape shape;
    shape.name = "box";
    shape.mesh = box_mesh(size);
    shape.mass = box_mass_properties(size);
    shape.bounding_radius = size.norm() / 2;
    shape.smallest_extent = size.minCoeff();
    shape.pieces.push_back({CollisionPiece::Kind::box, {}, size, {}});
    return add(std::move(shape));
  }

  uint32_t sphere(double radius) {
    ModelShape shape;
    shape.name = "sphere";
    shape.mass = sphere_mass_properties(radius);
    shape.bounding_radius = radius;
    shape.smallest_extent = 2 * radius;
    shape.pieces.push_back({CollisionPiece::Kind::sphere, {}, Vec3::Constant(radius), {}});
    return add(std::move(shape));
  }

  // About its y axis.
  uint32_t cylinder(double radius, double height) {
    ModelShape shape;
    shape.name = "cylinder";
    shape.mesh = cylinder_mesh(radius, height);
    shape.mass = cylinder_mass_properties(radius, height);
    shape.bounding_radius = std::hypot(radius, height / 2);
    shape.smallest_extent = std::min(2 * radius, height);
    shape.pieces.push_back(
        {.kind = CollisionPiece::Kind::round, .round = RoundSector::cylinder(radius, height)});
    return add(std::move(shape));
  }

  // The hull of `points`, with its centre of mass at the origin.
  uint32_t hull(const std::vector<Vec3>& points) {
    ModelShape shape;
    shape.name = "hull";
    shape.mesh = convex_hull(points);
    const Vec3 centre = mass_properties(shape.mesh).centre_of_mass;
    for (Vec3& vertex : shape.mesh.vertices) {
      vertex -= centre;
      shape.bounding_radius = std::max(shape.bounding_radius, vertex.norm());
    }
    shape.mass = mass_properties(shape.mesh);
    shape.smallest_extent = shape.mesh.bounds().sizes().minCoeff();
    shape.pieces.push_back({CollisionPiece::Kind::hull, {}, Vec3::Zero(), shape.mesh});
    return add(std::move(shape));
  }

  // Bodies are named "body/i". The reference stays valid until the next call.
  ModelBody& body(uint32_t shape, uint32_t material, const Vec3& position,
                  Role role = Role::dynamic) {
    ModelBody body;
    body.name = "body/" + std::to_string(model.bodies.size());
    body.shape = shape;
    body.material = material;
    body.pose.position = position;
    body.linear_velocity = body.angular_velocity = Vec3::Zero();
    body.role = role;
    body.colour = {200, 200, 200};
    if (role == Role::dynamic) {
      body.mass_kg = model.shapes[shape].mass.volume_m3 * model.materials[material].density_kg_m3;
    }
    model.bodies.push_back(std::move(body));
    return model.bodies.back();
  }

  // All bodies as given, present and at rest.
  BodyStates states() const {
    BodyStates states;
    for (const ModelBody& body : model.bodies) {
      states.position.push_back(body.pose.position);
      states.orientation.push_back(body.pose.orientation);
    }
    states.linear_velocity.assign(model.bodies.size(), Vec3::Zero());
    states.angular_velocity = states.linear_velocity;
    states.flags.assign(model.bodies.size(), kPresent);
    return states;
  }

 private:
  uint32_t add(ModelShape shape) {
    model.shapes.push_back(std::move(shape));
    return static_cast<uint32_t>(model.shapes.size() - 1);
  }
};

}  // namespace pilesim
