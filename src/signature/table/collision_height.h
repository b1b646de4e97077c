// Height of the centre of mass above the plane at first touch: the radius of the sphere that stands
// for the body (dissertation 3.2.3.1).
#pragma once

#include <cstdint>
#include <vector>

#include "signature/table/axis.h"
#include "signature/table/response_table.h"
#include "signature/trial/contact_sampler.h"

namespace pilesim {

// One row per cell; cells in row-major order of the axes. Dissertation's layout: |w| / |v| (1/m),
// one node of tilt; the body falls straight down, and its spin has any direction. Scale-free
// layout: atan(k |w| / v_n) and the angle of the spin to the plane's normal. The time to the
// contact depends on these two alone.
struct CollisionHeightTable {
  TableLayout layout = TableLayout::scale_free;
  Axis spin;
  Axis tilt;
  std::vector<float> trials;       // (cells) effective number
  std::vector<float> mean_m;       // (cells)
  std::vector<float> deviation_m;  // (cells)
  std::vector<float> error_m;      // (cells) standard error of the mean

  size_t cell_count() const { return spin.size() * tilt.size(); }
};

struct CollisionHeight {
  float mean_m, deviation_m;
};
// For a body that approaches (velocity . normal < 0) the plane of unit normal `normal`.
CollisionHeight collision_height(const CollisionHeightTable& table, float gyration_m,
                                 const Vec3f& normal, const Vec3f& velocity, const Vec3f& spin);

inline constexpr uint32_t kDissertationHeightTrials = 100;
inline constexpr uint32_t kHeightTrials = 256;

// Measures the table in parallel, with `trials` contacts per cell (in the scale-free layout: on
// average).
CollisionHeightTable sample_collision_heights(const TrialSetup& setup, TableLayout layout,
                                              uint32_t trials);

}  // namespace pilesim
