#include "geometry/hull_volume.h"

#include <algorithm>
#include <cmath>

namespace pilesim {
namespace {
constexpr uint32_t kNone = ~0u;
}

double HullVolume::compute(std::span<const Vec3> points, double coarseness) {
  points_ = points;
  faces_.clear();
  next_outside_.assign(points.size(), kNone);
  face_from_.assign(points.size(), kNone);
  if (!start_with_tetrahedron(coarseness)) {
    faces_.clear();
    return 0;
  }
  // Faces made on the way are appended, so this visits them all.
  for (uint32_t f = 0; f < faces_.size(); ++f) {
    while (!faces_[f].removed && faces_[f].first_outside != kNone) add_point(f);
  }
  double six_volumes = 0;
  const Vec3& origin = points[faces_.front().corner[0]];
  for (const Face& face : faces_) {
    if (face.removed) continue;
    six_volumes +=
        (points[face.corner[0]] - origin)
            .dot((points[face.corner[1]] - origin).cross(points[face.corner[2]] - origin));
  }
  return std::max(six_volumes / 6.0, 0.0);
}

std::vector<uint32_t> HullVolume::vertices() const {
  std::vector<uint32_t> result;
  for (const Face& face : faces_) {
    if (!face.removed) result.insert(result.end(), face.corner.begin(), face.corner.end());
  }
  std::ranges::sort(result);
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

bool HullVolume::start_with_tetrahedron(double coarseness) {
  if (points_.size() < 4) return false;
  Bounds bounds;
  for (const Vec3& point : points_) bounds.extend(point);
  const double extent = bounds.sizes().maxCoeff();
  tolerance_ = 1e-10 * extent;

  const auto farthest = [&](const auto& measure) {
    uint32_t best = 0;
    double best_value = -1;
    for (uint32_t p = 0; p < points_.size(); ++p) {
      const double value = measure(points_[p]);
      if (value > best_value) {
        best_value = value;
        best = p;
      }
    }
    return std::pair(best, best_value);
  };
  int axis = 0;
  bounds.sizes().maxCoeff(&axis);
  const uint32_t a = farthest([&](const Vec3& p) { return p[axis] - bounds.min()[axis]; }).first;
  const auto [b, length] = farthest([&](const Vec3& p) { return (p - points_[a]).norm(); });
  if (!(length > tolerance_)) return false;
  const Vec3 direction = (points_[b] - points_[a]) / length;
  const auto [c, width] =
      farthest([&](const Vec3& p) { return (p - points_[a]).cross(direction).norm(); });
  if (!(width > tolerance_)) return false;
  const Vec3 normal = direction.cross(points_[c] - points_[a]).normalized();
  const auto [d, height] =
      farthest([&](const Vec3& p) { return std::abs((p - points_[a]).dot(normal)); });
  if (!(height > tolerance_)) return false;

  outside_ = std::max(tolerance_, coarseness * height);

  const bool above = (points_[d] - points_[a]).dot(normal) > 0;
  const uint32_t second = above ? c : b;  // seen from d, a b c turns clockwise
  const uint32_t third = above ? b : c;
  add_face(a, second, third);
  add_face(a, third, d);
  add_face(third, second, d);
  add_face(second, a, d);
  faces_[0].neighbour = {3, 2, 1};
  faces_[1].neighbour = {0, 2, 3};
  faces_[2].neighbour = {0, 3, 1};
  faces_[3].neighbour = {0, 1, 2};
  for (uint32_t p = 0; p < points_.size(); ++p) give_point(p, 0, 4);
  return true;
}

uint32_t HullVolume::add_face(uint32_t a, uint32_t b, uint32_t c) {
  const Vec3& corner = points_[a];
  const Vec3 normal = (points_[b] - corner).cross(points_[c] - corner).stableNormalized();
  faces_.push_back({{a, b, c},
                    {kNone, kNone, kNone},
                    normal,
                    normal.dot(corner),
                    kNone,
                    kNone,
                    0,
                    false,
                    false});
  return static_cast<uint32_t>(faces_.size() - 1);
}

// To the first face of the range that sees the point; a point that none sees is inside.
void HullVolume::give_point(uint32_t point, uint32_t first_face, uint32_t end_face) {
  for (uint32_t f = first_face; f < end_face; ++f) {
    Face& face = faces_[f];
    const double distance = face.normal.dot(points_[point]) - face.offset;
    if (distance <= outside_) continue;
    next_outside_[point] = face.first_outside;
    face.first_outside = point;
    if (distance > face.farthest_distance) {
      face.farthest_distance = distance;
      face.farthest = point;
    }
    return;
  }
}

// Faces that `eye` lies above by more than `above`, m, into visible_, and the edges around them,
// into horizon_.
void HullVolume::collect_horizon(uint32_t start_face, const Vec3& eye, double above) {
  for (const uint32_t f : visible_) faces_[f].visited = false;
  visible_.clear();
  horizon_.clear();
  stack_.assign(1, start_face);
  faces_[start_face].visited = true;
  while (!stack_.empty()) {
    const uint32_t f = stack_.back();
    stack_.pop_back();
    visible_.push_back(f);
    for (int k = 0; k < 3; ++k) {
      const uint32_t n = faces_[f].neighbour[k];
      Face& neighbour = faces_[n];
      if (neighbour.visited) continue;
      if (neighbour.normal.dot(eye) - neighbour.offset > above) {
        neighbour.visited = true;
        stack_.push_back(n);
      }
    }
  }
  for (const uint32_t f : visible_) {
    for (int k = 0; k < 3; ++k) {
      const uint32_t n = faces_[f].neighbour[k];
      if (!faces_[n].visited) {
        horizon_.push_back({faces_[f].corner[k], faces_[f].corner[(k + 1) % 3], n});
      }
    }
  }
}

// Each vertex of the horizon has one edge that comes and one that goes. Among faces that are all
// but in one plane rounding decides which of them are seen, and the seen part may have holes.
bool HullVolume::is_one_ring() {
  for (const HorizonEdge& edge : horizon_) face_from_[edge.from] = kNone;
  bool is_ring = true;
  for (const HorizonEdge& edge : horizon_) {
    is_ring = is_ring && face_from_[edge.from] == kNone;
    face_from_[edge.from] = edge.to;
  }
  if (!is_ring || horizon_.empty()) return false;
  size_t length = 0;
  uint32_t at = horizon_.front().from;
  do {
    at = face_from_[at];
    ++length;
  } while (at != horizon_.front().from && length <= horizon_.size());
  return length == horizon_.size();
}

// Takes `point` off the list of the face.
void HullVolume::leave_out(uint32_t face, uint32_t point) {
  uint32_t next = faces_[face].first_outside;
  faces_[face].first_outside = faces_[face].farthest = kNone;
  faces_[face].farthest_distance = 0;
  for (uint32_t p = next; p != kNone; p = next) {
    next = next_outside_[p];
    if (p != point) give_point(p, face, face + 1);
  }
}

void HullVolume::add_point(uint32_t start_face) {
  const uint32_t eye = faces_[start_face].farthest;
  visible_.clear();
  collect_horizon(start_face, points_[eye], tolerance_);
  if (!is_one_ring()) collect_horizon(start_face, points_[eye], -tolerance_);
  if (!is_one_ring()) {  // it would stand out by no more than rounding does
    for (const uint32_t f : visible_) faces_[f].visited = false;
    return leave_out(start_face, eye);
  }
  const auto first_new = static_cast<uint32_t>(faces_.size());
  for (const HorizonEdge& edge : horizon_) {
    const uint32_t f = add_face(edge.from, edge.to, eye);
    faces_[f].neighbour[0] = edge.outer_face;
    face_from_[edge.from] = f;
    Face& outer = faces_[edge.outer_face];
    for (int k = 0; k < 3; ++k) {
      if (outer.corner[k] == edge.to && outer.corner[(k + 1) % 3] == edge.from) {
        outer.neighbour[k] = f;
      }
    }
  }
  for (const HorizonEdge& edge : horizon_) {
    const uint32_t f = face_from_[edge.from];
    const uint32_t next = face_from_[edge.to];
    faces_[f].neighbour[1] = next;
    faces_[next].neighbour[2] = f;
  }
  const auto end_new = static_cast<uint32_t>(faces_.size());
  for (const uint32_t f : visible_) {
    faces_[f].removed = true;
    uint32_t next = kNone;
    for (uint32_t p = faces_[f].first_outside; p != kNone; p = next) {
      next = next_outside_[p];
      if (p != eye) give_point(p, first_new, end_new);
    }
  }
}

}  // namespace pilesim
