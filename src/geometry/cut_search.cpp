#include "geometry/cut_search.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel_for.h"
#include "geometry/hull_volume.h"

namespace pilesim {
namespace {

// Smaller differences, relative to the size of the part, are rounding: the earlier candidate stays,
// so that the same shape at another scale is cut the same way.
constexpr double kTieShare = 1e-9;
constexpr int kOffsets = 11;  // planes tried along each direction
constexpr int kOffsetsAhead = 3;
// Where the best cut saves less of the hull's excess, cuts are judged by the savings of one more
// cut on each side: the first cut of a ring or a tube saves nothing.
constexpr double kFairShare = 0.35;
constexpr size_t kReentrantEdges = 12;
constexpr size_t kStarts = 6;        // candidates that are improved
constexpr double kClearance = 1e-6;  // of the extent, between a plane and the face it extends

// Coarseness of the hulls that compare cuts during the search; the last comparison is exact.
constexpr double kSearchCoarseness = 3e-3;

// The solid as the search needs it.
struct CutProblem {
  const std::vector<Vec3>& vertices;
  std::vector<FacetedSolid::Edge> edges;  // each once
  double extent = 0;
  Vec3 centre;  // of its bounds
};

struct Scratch {
  HullVolume hull;
  std::vector<double> distance;
  std::vector<Vec3> below, above;
};

double hull_volume_of_cut(const CutProblem& problem, const ClipPlane& plane, Scratch& scratch,
                          double coarseness = kSearchCoarseness) {
  scratch.below.clear();
  scratch.above.clear();
  scratch.distance.resize(problem.vertices.size());
  for (size_t v = 0; v < problem.vertices.size(); ++v) {
    const double distance = plane.distance(problem.vertices[v]);
    scratch.distance[v] = distance;
    (distance < 0 ? scratch.below : scratch.above).push_back(problem.vertices[v]);
  }
  if (scratch.below.empty() || scratch.above.empty()) {
    return std::numeric_limits<double>::infinity();
  }
  for (const auto& edge : problem.edges) {
    const double from = scratch.distance[edge.from];
    const double to = scratch.distance[edge.to];
    if ((from < 0) == (to < 0)) continue;
    const Vec3 crossing =
        plane_crossing(problem.vertices[edge.from], from, problem.vertices[edge.to], to);
    scratch.below.push_back(crossing);
    scratch.above.push_back(crossing);
  }
  const double below = scratch.hull.compute(scratch.below, coarseness);
  return below + scratch.hull.compute(scratch.above, coarseness);
}

std::vector<Vec3> cutting_directions(const std::vector<Vec3>& vertices) {
  std::vector<Vec3> directions;
  for (int x = -1; x <= 1; ++x) {
    for (int y = -1; y <= 1; ++y) {
      for (int z = -1; z <= 1; ++z) {
        const Vec3 direction(x, y, z);
        if (x * 9 + y * 3 + z > 0 && direction.squaredNorm() < 2.5) {
          directions.push_back(direction.normalized());
        }
      }
    }
  }
  Vec3 mean = Vec3::Zero();
  for (const Vec3& vertex : vertices) mean += vertex;
  mean /= static_cast<double>(vertices.size());
  Mat3 covariance = Mat3::Zero();
  for (const Vec3& vertex : vertices) covariance += (vertex - mean) * (vertex - mean).transpose();
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(covariance);
  // Axes of a round body are anything, so only those that stand out are used.
  const Vec3& moments = axes.eigenvalues();
  for (int k = 0; k < 3; ++k) {
    const bool distinct = (k == 0 || moments[k] - moments[k - 1] > 0.01 * moments[2]) &&
                          (k == 2 || moments[k + 1] - moments[k] > 0.01 * moments[2]);
    Vec3 axis = axes.eigenvectors().col(k);
    int largest = 0;
    axis.cwiseAbs().maxCoeff(&largest);
    if (distinct) directions.push_back(axis[largest] < 0 ? Vec3(-axis) : axis);
  }
  return directions;
}

struct ReentrantEdge {
  double weight;
  Vec3 point;
  Vec3 normal_a, normal_b;
};

// The edges at which the solid is most strongly concave, by length times sine of the angle.
std::vector<ReentrantEdge> reentrant_edges(const FacetedSolid& solid, double extent) {
  struct HalfEdge {
    uint64_t key;
    uint32_t edge, face;
  };
  std::vector<HalfEdge> half_edges;
  half_edges.reserve(solid.edges.size());
  for (uint32_t f = 0; f < solid.faces.size(); ++f) {
    const FacetedSolid::Face& face = solid.faces[f];
    for (uint32_t e = face.first_edge; e < face.first_edge + face.edge_count; ++e) {
      const auto [low, high] = std::minmax(solid.edges[e].from, solid.edges[e].to);
      half_edges.push_back({static_cast<uint64_t>(low) << 32 | high, e, f});
    }
  }
  std::ranges::stable_sort(half_edges, {}, &HalfEdge::key);
  std::vector<ReentrantEdge> result;
  for (size_t k = 0; k + 1 < half_edges.size(); ++k) {
    if (half_edges[k].key != half_edges[k + 1].key) continue;
    const FacetedSolid::Edge& edge = solid.edges[half_edges[k].edge];
    const Vec3& normal = solid.faces[half_edges[k].face].normal;
    const Vec3& other_normal = solid.faces[half_edges[k + 1].face].normal;
    const Vec3& from = solid.vertices[edge.from];
    const double weight = -normal.cross(other_normal).dot(solid.vertices[edge.to] - from);
    if (weight > 1e-6 * extent) result.push_back({weight, from, normal, other_normal});
  }
  std::ranges::stable_sort(result, std::ranges::greater{}, [&](const ReentrantEdge& edge) {
    return std::round(edge.weight / (kTieShare * extent));
  });
  if (result.size() > kReentrantEdges) result.resize(kReentrantEdges);
  return result;
}

// So many along each direction, in equal distances.
std::vector<ClipPlane> planes_across(const std::vector<Vec3>& vertices, int offsets) {
  std::vector<ClipPlane> planes;
  for (const Vec3& direction : cutting_directions(vertices)) {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    for (const Vec3& vertex : vertices) {
      low = std::min(low, direction.dot(vertex));
      high = std::max(high, direction.dot(vertex));
    }
    for (int k = 1; k <= offsets; ++k) {
      planes.push_back({direction, low + (high - low) * k / (offsets + 1)});
    }
  }
  return planes;
}

std::vector<ClipPlane> candidate_planes(const FacetedSolid& solid, double extent) {
  std::vector<ClipPlane> planes = planes_across(solid.vertices, kOffsets);
  for (const ReentrantEdge& edge : reentrant_edges(solid, extent)) {
    for (const Vec3& normal : {edge.normal_a, edge.normal_b}) {
      for (const double side : {-1.0, 1.0}) {
        planes.push_back({normal, normal.dot(edge.point) + side * kClearance * extent});
      }
    }
    // Along the edge, halving the angle between its faces.
    const Vec3 bisector = edge.normal_a - edge.normal_b;
    if (bisector.norm() > 1e-3) {
      planes.push_back({bisector.normalized(), bisector.normalized().dot(edge.point)});
    }
  }
  return planes;
}

// Turns the plane about the point `pivot` on it.
ClipPlane tilted(const ClipPlane& plane, const Vec3& pivot, const Vec3& change) {
  const Vec3 normal = (plane.normal + change).normalized();
  const Vec3 point = pivot - plane.distance(pivot) * plane.normal;
  return {normal, normal.dot(point)};
}

// Pattern search: small tilts and shifts, with steps that halve when none helps.
Cut improved(const CutProblem& problem, Cut cut, Scratch& scratch) {
  double shift = 0.04 * problem.extent;
  double tilt = 0.15;
  for (int halvings = 0; halvings < 5;) {
    const Vec3 u = cut.plane.normal.unitOrthogonal();
    const Vec3 v = cut.plane.normal.cross(u);
    Cut best = cut;
    for (const double sign : {-1.0, 1.0}) {
      for (const ClipPlane& plane : {ClipPlane{cut.plane.normal, cut.plane.offset + sign * shift},
                                     tilted(cut.plane, problem.centre, sign * tilt * u),
                                     tilted(cut.plane, problem.centre, sign * tilt * v)}) {
        const double volume = hull_volume_of_cut(problem, plane, scratch);
        if (volume < best.hull_volume_m3 * (1 - kTieShare)) best = {plane, volume};
      }
    }
    if (best.hull_volume_m3 < cut.hull_volume_m3) {
      cut = best;
    } else {
      shift /= 2;
      tilt /= 2;
      ++halvings;
    }
  }
  return cut;
}

// The best candidates, no two nearly the same plane.
std::vector<Cut> best_distinct(std::vector<Cut> cuts, double extent) {
  const double tie = kTieShare * extent * extent * extent;
  std::ranges::stable_sort(cuts, {},
                           [&](const Cut& cut) { return std::round(cut.hull_volume_m3 / tie); });
  std::vector<Cut> chosen;
  for (const Cut& cut : cuts) {
    const bool repeated = std::ranges::any_of(chosen, [&](const Cut& other) {
      const double cosine = cut.plane.normal.dot(other.plane.normal);
      return std::abs(cosine) > 0.95 &&
             std::abs(cut.plane.offset - std::copysign(other.plane.offset,
                                                       cosine * other.plane.offset)) < 0.1 * extent;
    });
    if (!repeated) chosen.push_back(cut);
    if (chosen.size() == kStarts) break;
  }
  return chosen;
}

CutProblem cut_problem(const FacetedSolid& solid) {
  Bounds bounds;
  for (const Vec3& vertex : solid.vertices) bounds.extend(vertex);
  CutProblem problem{solid.vertices, {}, bounds.diagonal().norm(), bounds.center()};
  for (const auto& edge : solid.edges) {
    if (edge.from < edge.to) problem.edges.push_back(edge);
  }
  return problem;
}

// The least volume of hulls after one more cut, by a few planes.
double after_another_cut(const FacetedSolid& solid, Scratch& scratch) {
  const CutProblem problem = cut_problem(solid);
  double least = scratch.hull.compute(problem.vertices, kSearchCoarseness);
  for (const ClipPlane& plane : planes_across(problem.vertices, kOffsetsAhead)) {
    least = std::min(least, hull_volume_of_cut(problem, plane, scratch));
  }
  return least;
}

// Volume after each cut if each of its sides is cut once more.
std::vector<double> volumes_ahead(const FacetedSolid& solid, const std::vector<Cut>& cuts) {
  std::vector<double> volumes(2 * cuts.size());
  parallel_for(volumes.size(), 1, [&](size_t begin, size_t end) {
    Scratch scratch;
    for (size_t k = begin; k < end; ++k) {
      const SplitSolid halves = split(solid, cuts[k / 2].plane);
      volumes[k] = after_another_cut(k % 2 == 0 ? halves.below : halves.above, scratch);
    }
  });
  for (size_t k = 0; k < cuts.size(); ++k) volumes[k] = volumes[2 * k] + volumes[2 * k + 1];
  volumes.resize(cuts.size());
  return volumes;
}

const Cut& least(const std::vector<Cut>& cuts, const std::vector<double>& volumes) {
  size_t best = 0;
  for (size_t k = 1; k < cuts.size(); ++k) {
    if (volumes[k] < volumes[best] * (1 - kTieShare)) best = k;
  }
  return cuts[best];
}

}  // namespace

Cut best_cut(const FacetedSolid& solid) {
  const CutProblem problem = cut_problem(solid);
  std::vector<Cut> cuts;
  for (const ClipPlane& plane : candidate_planes(solid, problem.extent)) cuts.push_back({plane, 0});
  parallel_for(cuts.size(), 8, [&](size_t begin, size_t end) {
    Scratch scratch;
    for (size_t k = begin; k < end; ++k) {
      cuts[k].hull_volume_m3 = hull_volume_of_cut(problem, cuts[k].plane, scratch);
    }
  });
  std::vector<Cut> starts = best_distinct(std::move(cuts), problem.extent);
  parallel_for(starts.size(), 1, [&](size_t begin, size_t end) {
    Scratch scratch;
    for (size_t k = begin; k < end; ++k) {
      starts[k] = improved(problem, starts[k], scratch);
      starts[k].hull_volume_m3 = hull_volume_of_cut(problem, starts[k].plane, scratch, 0);
    }
  });
  std::vector<double> volumes;
  for (const Cut& cut : starts) volumes.push_back(cut.hull_volume_m3);
  Cut best = least(starts, volumes);
  HullVolume hull;
  const double whole = hull.compute(solid.vertices);
  if (whole - best.hull_volume_m3 > kFairShare * (whole - solid.volume())) return best;
  Scratch scratch;
  for (const ClipPlane& plane : planes_across(problem.vertices, 1)) {
    starts.push_back({plane, hull_volume_of_cut(problem, plane, scratch, 0)});
  }
  std::erase_if(starts, [](const Cut& cut) { return !std::isfinite(cut.hull_volume_m3); });
  if (starts.empty()) return best;
  return least(starts, volumes_ahead(solid, starts));
}

}  // namespace pilesim
