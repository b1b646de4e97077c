// Inertia-free rolling of a body as a flow on the sphere of directions (see rest_poses.h).
#pragma once

#include <cstdint>
#include <vector>

#include "signature/rest/gauss_map.h"

namespace pilesim {

// A pose balanced on an edge, from which the body may tip either way.
struct Saddle {
  GaussMap::Side side;
};

// The flow down the gradient of U, the height of the centre of mass. Within a cell U(d) = d . v, so
// the flow follows great circles away from v / |v|. Every path ends, whatever the rounding of its
// steps.
class RestFlow {
 public:
  // `map` must outlive the flow.
  explicit RestFlow(const GaussMap& map) : map_(map) {}

  // The centre of mass projects into the face.
  bool stable(uint32_t face) const;

  // The stable face that the flow reaches from a face's normal, or from any direction.
  uint32_t from_face(uint32_t face) const;
  uint32_t from_direction(const Vec3& down) const;

  std::vector<Saddle> saddles() const;

  // The flow lines that descend into the saddle, from peak to peak, as their turning points. The
  // face before the saddle's side, face(side), is to their left.
  std::vector<Vec3> border(const Saddle& saddle) const;

  // Number of vertices that are a maximum of U.
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
