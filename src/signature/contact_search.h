// The first contact of a body with the plane within a step of its flight.
//
// Over a step the height of a vertex r is a polynomial of the time, height + rise s + r . n(s) with
// the series n of the plane's normal seen from the body. Bounds in float, first of the balls around
// groups of vertices, then of the vertices, leave those that may touch. The deepest of them are
// solved in double precision, and the search goes on in what is left of the step before their first
// contact, until there is no vertex that may touch earlier.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "signature/contact_body.h"
#include "signature/free_flight.h"
#include "signature/free_rotation.h"

namespace pilesim {

// The motion of one body over a segment of a step; s goes from 0 to 1 over the whole step.
struct SegmentMotion {
  const RotationSeries* series;  // of the plane's normal
  const DirectionSegment* segment;
  size_t lane;    // of both
  double height;  // of the centre of mass at the step's begin, m
  double rise;    // its change over the whole step, m
  // Parts of the step: where the segment begins, and before which no vertex touches the plane, at
  // least `begin`.
  double begin, free;
};

struct StepEnd {
  double part = 1;    // s up to where no vertex passes through the plane
  bool ends = false;  // there `vertex` touches or rests
  FlightEnd end = FlightEnd::contact;
  uint32_t vertex = 0;
};

class ContactSearch {
 public:
  explicit ContactSearch(const ContactBody& body);
  // What ends the motion before `part`.
  StepEnd find(const SegmentMotion& motion, double part);

 private:
  // Vertices that may touch: of each lane the deepest.
  struct Deepest {
    std::array<uint32_t, ContactBody::kGroup> vertex;
    size_t count = 0;
    bool more = false;  // that may touch
  };
  struct Cubic;
  Deepest find_deepest(const Cubic& cubic, float part) const;
  void solve(const SegmentMotion& motion, std::span<const uint32_t> vertices, StepEnd& end) const;

  const ContactBody& body_;
  // Balls around blocks of kBlock groups, padded with copies to a multiple of kGroup.
  static constexpr size_t kBlock = 64;
  std::vector<float> block_x_, block_y_, block_z_, block_extent_;
  std::vector<uint32_t> solved_;
};

}  // namespace pilesim
