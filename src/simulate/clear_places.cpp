#include "simulate/clear_places.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pilesim {
namespace {

std::array<int64_t, 3> cell_of(const Vec3& point, double cell_m) {
  const Vec3 cell = (point / cell_m).array().floor();
  return {static_cast<int64_t>(cell.x()), static_cast<int64_t>(cell.y()),
          static_cast<int64_t>(cell.z())};
}

// Cells whose keys meet share a list, which costs time and changes no answer.
uint64_t key_of(const std::array<int64_t, 3>& cell) {
  constexpr uint64_t kMask = (1u << 21) - 1;
  return (static_cast<uint64_t>(cell[0]) & kMask) << 42 |
         (static_cast<uint64_t>(cell[1]) & kMask) << 21 | (static_cast<uint64_t>(cell[2]) & kMask);
}

}  // namespace

ClearPlaces::ClearPlaces(const Model& model, const BodyDistances& distances,
                         const BodyStates& states, const PoseOf& pose_of)
    : model_(model), distances_(distances) {
  double largest_m = 0;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    if (model.bodies[i].start_s > 0) largest_m = std::max(largest_m, radius_m(i));
  }
  if (largest_m > 0) cell_m_ = 2 * largest_m;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    const bool moves = body.role == Role::dynamic || !body.motion.empty();
    if (moves && (states.flags[i] & kPresent) != 0) add(i, pose_of(i));
  }
}

void ClearPlaces::add(uint32_t body, const Pose& pose) {
  if (!pose.position.allFinite()) return;  // reported at the end of the frame
  auto& list =
      2 * radius_m(body) > cell_m_ ? large_ : cells_[key_of(cell_of(pose.position, cell_m_))];
  list.push_back({body, pose});
}

bool ClearPlaces::overlap(const Present& there, const PlacedShape& start) const {
  const double reach_m = radius_m(there.body) + model_.shapes[start.shape].bounding_radius;
  if ((there.pose.position - start.pose.position).squaredNorm() >= reach_m * reach_m) return false;
  const PlacedShape placed = distances_.place(model_.bodies[there.body].shape, there.pose);
  return distances_.distance(start, placed, 0) < 0;
}

bool ClearPlaces::is_clear(uint32_t body) const {
  const PlacedShape start = distances_.place(model_.bodies[body].shape, model_.bodies[body].pose);
  const auto overlaps = [&](const Present& there) { return overlap(there, start); };
  if (std::ranges::any_of(large_, overlaps)) return false;
  const std::array<int64_t, 3> home = cell_of(start.pose.position, cell_m_);
  for (int64_t x = -1; x <= 1; ++x) {
    for (int64_t y = -1; y <= 1; ++y) {
      for (int64_t z = -1; z <= 1; ++z) {
        const auto found = cells_.find(key_of({home[0] + x, home[1] + y, home[2] + z}));
        if (found != cells_.end() && std::ranges::any_of(found->second, overlaps)) return false;
      }
    }
  }
  return true;
}

}  // namespace pilesim
