// How a body rolls without inertia, over the sphere of directions (see rest_poses.h).
#pragma once

#include <cstdint>
#include <vector>

#include "signature/rest/gauss_map.h"

namespace pilesim {

// Where a body stands on an edge and may tip over either way.
struct Saddle {
  GaussMap::Side side;
};

// The flow that falls along the height of the centre of mass, U. Within a cell U(d) = d . v: it
// runs along great circles away from v / |v|. Every path ends, whatever rounding makes of the
// steps.
class RestFlow {
 public:
  // `map` must outlive the flow.
  explicit RestFlow(const GaussMap& map) : map_(map) {}

  // The foot of the centre of mass lies within the face.
  bool stable(uint32_t face) const;

  // The stable face that the flow from a face's normal, or from any direction, reaches.
  uint32_t from_face(uint32_t face) const;
  uint32_t from_direction(const Vec3& down) const;

  std::vector<Saddle> saddles() const;

  // The flow lines that come down into the saddle, from peak to peak: points at which they turn.
  // The face before the saddle's side, face(side), is to their left.
  std::vector<Vec3> border(const Saddle& saddle) const;

  // Vertices that are a maximum of U.
  size_t peak_count() const;

 private:
  std::vector<GaussMap::Side> cells_round(uint32_t face) const;
  GaussMap::Side way_out(const GaussMap::Side& in, const Vec3& left) const;
  Vec3 crossing(const GaussMap::Side& side, const Vec3& left) const;
  uint32_t leave_face(uint32_t face) const;
  uint32_t descend(GaussMap::Side out, Vec3 d) const;
  void climb(GaussMap::Side in, std::vector<Vec3>& points) const;

  const GaussMap& map_;
};

}  // namespace pilesim
