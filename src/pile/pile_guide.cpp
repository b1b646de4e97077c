#include "pile/pile_guide.h"

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {

constexpr double kFewestReach = 3.5;  // L, of a pile with slopes

}  // namespace

void PileGuide::update(const PileShape& shape, const std::vector<SurfaceCell>& surface,
                       double cell_m, double size_m, std::span<const MovingBulk> moving) {
  slope_ = shape.slope();
  reach_m_ = reach_of_bulk(shape, surface, cell_m);
  surplus_m_ = {};
  outflow_ = {};
  if (reach_m_ <= 0) return;
  Profile cells{}, sum_m{};
  for (const SurfaceCell& cell : surface) {
    if (cell.distance_m >= reach_m_) continue;
    const auto ring = std::min(
        kRings - 1, static_cast<size_t>(cell.distance_m / reach_m_ * static_cast<double>(kRings)));
    cells[ring] += 1;
    sum_m[ring] += cell.height_m - height_m(cell.distance_m);
  }
  const double ring_m = reach_m_ / static_cast<double>(kRings);
  const double cell_m2 = cell_m * cell_m;
  Profile passing_m3{};  // at the rings' outer edges
  for (const MovingBulk& bulk : moving) {
    // What is within its way of an edge passes it; on the mean over a ring's width.
    const double place = bulk.distance_m / ring_m;
    for (size_t ring = 0; ring < kRings; ++ring) {
      const double share = 1 - std::abs(place - static_cast<double>(ring + 1));
      if (share > 0) passing_m3[ring] += share * bulk.volume_m3 * bulk.ahead_m / ring_m;
    }
  }
  double inside_m3 = 0;
  for (size_t ring = 0; ring < kRings; ++ring) {
    if (cells[ring] == 0) continue;  // walls or other piles leave nothing of it
    surplus_m_[ring] = sum_m[ring] / cells[ring];
    inside_m3 += sum_m[ring] * cell_m2;
    const double line_m = cells[ring] * cell_m2 / ring_m;
    outflow_[ring] = (inside_m3 - passing_m3[ring]) / (line_m * size_m * size_m);
  }
  if (reach_m_ < kFewestReach * size_m) outflow_ = {};
}

double PileGuide::at(const Profile& profile, double distance_m, double first) const {
  if (distance_m >= reach_m_) return 0;
  const double place = std::clamp(distance_m / reach_m_ * static_cast<double>(kRings) - first, 0.0,
                                  static_cast<double>(kRings - 1));
  const size_t ring = std::min(kRings - 2, static_cast<size_t>(place));
  return std::lerp(profile[ring], profile[ring + 1], place - static_cast<double>(ring));
}

double PileGuide::surplus_m(double distance_m) const { return at(surplus_m_, distance_m, 0.5); }

double PileGuide::outflow(double distance_m) const { return at(outflow_, distance_m, 1); }

}  // namespace pilesim
