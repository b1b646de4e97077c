// Bodies that fly over the plane y = 0 without gravity and rotate freely, and their times of
// contact.
//
// Conservative advancement finds the time of contact over the vertices that can be lowest within a
// step. A concave cubic bounds the height of a vertex from below, so a step with a non-negative
// bound at its end misses no contact. Rotation is torque-free with the full inertia tensor.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "signature/trial/contact_body.h"
#include "signature/trial/free_rotation.h"

namespace pilesim {

// One body in flight. World axes: y is the plane's normal. The orientation is stored as two world
// axes in the body frame, as the search for contacts needs it.
struct Flight {
  Vec3 x_axis = Vec3::UnitX();   // world x in the body frame, unit
  Vec3 normal = Vec3::UnitY();   // world y in the body frame, unit
  Vec3 spin = Vec3::Zero();      // angular velocity in the body frame, rad/s
  Vec3 velocity = Vec3::Zero();  // of the centre of mass, world, m/s
  double height = 0;             // of the centre of mass over the plane, m
  double time_s = 0;             // since the start of the flight

  Vec3 z_axis() const { return x_axis.cross(normal); }
  Vec3 to_world(const Vec3& body) const {
    return {x_axis.dot(body), normal.dot(body), z_axis().dot(body)};
  }
  Vec3 to_body(const Vec3& world) const {
    return world.x() * x_axis + world.y() * normal + world.z() * z_axis();
  }
  Vec3 world_spin() const { return to_world(spin); }
  // Takes body coordinates to world coordinates.
  Quat orientation() const;
};

// The lowest vertex of the body, and the height of its centre of mass when it touches there.
struct Support {
  uint32_t vertex;
  double height_m;
};
Support lowest_vertex(const ContactBody& body, const Vec3& normal);

enum class FlightEnd {
  contact,  // a vertex touches the plane and is about to pass through
  resting,  // a vertex rests on the plane without motion; nothing further happens
  gone,     // the body leaves and can no longer touch the plane
};

// Flies `count` bodies to their ends, kFlightLanes at a time. The caller owns the flights. After
// each end the caller decides whether that flight continues or which one replaces it, so that no
// lane waits for the slowest. Flights are independent of each other.
class FlightCrew {
 public:
  virtual ~FlightCrew() = default;
  // Puts the next flight into `flight`; false when there are no more.
  virtual bool next(size_t lane, Flight& flight) = 0;
  // `flight` came to `end`, at `vertex` unless it is gone. Return true if it has new velocities or
  // was replaced and continues, false to free the lane.
  virtual bool ended(size_t lane, FlightEnd end, uint32_t vertex, Flight& flight) = 0;
};
void fly(const ContactBody& body, FlightCrew& crew);

}  // namespace pilesim
