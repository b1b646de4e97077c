#include "pile/repose/ideal_surface.h"

#include <algorithm>
#include <cmath>

#include "pile/repose/repose_constants.h"

namespace pilesim {
namespace {

using namespace repose_constants;

// Distributes items over sections, each with its shares in the two nearest ones.
template <class Item>
std::vector<std::vector<Item>> in_sections(const std::vector<Item>& items, size_t sections,
                                           double Item::*amount) {
  if (sections == 1) return {items};
  std::vector<std::vector<Item>> parts(sections);
  for (const Item& item : items) {
    const double place = item.round * static_cast<double>(sections);
    const auto section = std::min(sections - 1, static_cast<size_t>(place));
    const double share = place - static_cast<double>(section);
    Item part = item;
    part.*amount = item.*amount * (1 - share);
    parts[section].push_back(part);
    part.*amount = item.*amount * share;
    parts[(section + 1) % sections].push_back(part);
  }
  return parts;
}

}  // namespace

void IdealSurface::update(const PileShape& shape, const std::vector<SurfaceCell>& cells,
                          double cell_m, double size_m, const std::vector<MovingBulk>& moving) {
  slope_ = shape.slope();
  reach_m_ = reach_of_bulk(shape, cells, cell_m);
  const double length_m = shape.way_round_m(reach_m_ / 2) / (kSectionLength * size_m);
  const auto count = static_cast<size_t>(std::max(1.0, std::floor(length_m)));
  sections_.assign(count, {});
  if (reach_m_ <= 0) return;
  const auto parts = in_sections(cells, count, &SurfaceCell::weight);
  const auto moving_parts = in_sections(moving, count, &MovingBulk::volume_m3);
  for (size_t i = 0; i < count; ++i) {
    Section& section = sections_[i];
    const double own_m = reach_of_bulk(shape, parts[i], cell_m);
    section.reach_m = std::clamp(own_m, (1 - kReachTolerance) * reach_m_,
                                 std::min((1 + kReachTolerance) * reach_m_, shape.most_reach()));
    section.update(parts[i], cell_m, size_m, slope_, moving_parts[i]);
    if (reach_m_ < kFewestReach * size_m) section.outflow = {};
  }
}

void IdealSurface::Section::update(const std::vector<SurfaceCell>& surface, double cell_m,
                                   double size_m, double slope,
                                   const std::vector<MovingBulk>& moving) {
  Profile cells{}, sum_m{};
  for (const SurfaceCell& cell : surface) {
    if (cell.distance_m >= reach_m) continue;
    const auto ring = std::min(
        kRings - 1, static_cast<size_t>(cell.distance_m / reach_m * static_cast<double>(kRings)));
    cells[ring] += cell.weight;
    sum_m[ring] += cell.weight * (cell.height_m - (reach_m - cell.distance_m) * slope);
  }
  const double ring_m = reach_m / static_cast<double>(kRings);
  const double cell_m2 = cell_m * cell_m;
  Profile passing_m3{};  // at the rings' outer edges
  for (const MovingBulk& bulk : moving) {
    // Volume that can still reach an edge passes it; averaged over a ring's width.
    const double place = bulk.distance_m / ring_m;
    for (size_t ring = 0; ring < kRings; ++ring) {
      const double share = 1 - std::abs(place - static_cast<double>(ring + 1));
      if (share > 0) passing_m3[ring] += share * bulk.volume_m3 * bulk.ahead_m / ring_m;
    }
  }
  double inside_m3 = 0;
  for (size_t ring = 0; ring < kRings; ++ring) {
    if (cells[ring] == 0) continue;  // walls or other piles leave none of it
    surplus_m[ring] = sum_m[ring] / cells[ring];
    inside_m3 += sum_m[ring] * cell_m2;
    const double line_m = cells[ring] * cell_m2 / ring_m;
    outflow[ring] = (inside_m3 - passing_m3[ring]) / (line_m * size_m * size_m);
  }
}

double IdealSurface::Section::at(const Profile& profile, double distance_m, double first) const {
  if (distance_m >= reach_m) return 0;
  const double place = std::clamp(distance_m / reach_m * static_cast<double>(kRings) - first, 0.0,
                                  static_cast<double>(kRings - 1));
  const size_t ring = std::min(kRings - 2, static_cast<size_t>(place));
  return std::lerp(profile[ring], profile[ring + 1], place - static_cast<double>(ring));
}

template <class Use>
double IdealSurface::between(double round, const Use& use) const {
  const size_t count = sections_.size();
  if (count == 1) return use(sections_[0]);
  const double place = round * static_cast<double>(count);
  const auto section = std::min(count - 1, static_cast<size_t>(place));
  return std::lerp(use(sections_[section]), use(sections_[(section + 1) % count]),
                   place - static_cast<double>(section));
}

double IdealSurface::reach_m(double round) const {
  return between(round, [](const Section& section) { return section.reach_m; });
}

double IdealSurface::surplus_m(double distance_m, double round) const {
  return between(round, [&](const Section& section) {
    return section.at(section.surplus_m, distance_m, 0.5);
  });
}

double IdealSurface::outflow(double distance_m, double round) const {
  return between(
      round, [&](const Section& section) { return section.at(section.outflow, distance_m, 1); });
}

}  // namespace pilesim
