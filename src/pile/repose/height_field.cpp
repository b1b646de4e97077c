#include "pile/repose/height_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

namespace pilesim {
namespace {

constexpr double kFlankFoot = 0.2, kFlankTop = 0.9;  // shares of the pile's height
constexpr size_t kFewestBins = 4;                    // fewest bins for a fit
constexpr double kCellsOffWalls = 3;                 // about one body, which walls may hold up
constexpr double kMostTaken = 0.05;  // share of a flank that neighbouring piles may take

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

struct Bin {
  double sum = 0;
  int cells = 0;
  int taken = 0;  // cells farther out that belong to another pile
  void add(double height, bool own) {
    ++(own ? cells : taken);
    if (own) sum += height;
  }
  double mean() const { return cells > 0 ? sum / cells : 0; }
};

// Bins [first, last) of the flank of a profile, from the core outwards: where a straight slope of
// the same volume would be between the two shares of its height. Selecting by the heights
// themselves would be biased on a rough surface: low parts near the top, high ones at the foot.
std::pair<size_t, size_t> flank_of(const std::vector<Bin>& profile) {
  double bulk = 0;
  for (const Bin& bin : profile) bulk += bin.mean();
  const auto bin_at = [&](double height_share) {
    double inside = (1 - height_share * height_share) * bulk;
    size_t i = 0;
    while (i < profile.size() && inside > profile[i].mean()) inside -= profile[i++].mean();
    return i;
  };
  return {bin_at(kFlankTop), std::min(profile.size(), bin_at(kFlankFoot) + 1)};
}

// True if no other pile takes too much of the bins [first, last).
bool is_free(const std::vector<Bin>& profile, size_t first, size_t last) {
  double own = 0, taken = 0;
  for (size_t i = first; i < std::min(last, profile.size()); ++i) {
    own += profile[i].cells;
    taken += profile[i].taken;
  }
  return taken <= kMostTaken * (own + taken);
}

// Slope of the height over the bins' index; NaN if there are too few bins.
double flank_slope(const std::vector<Bin>& profile) {
  const auto [first, last] = flank_of(profile);
  std::vector<std::pair<double, double>> flank;
  for (size_t i = first; i < last; ++i) {
    if (profile[i].cells > 0) flank.emplace_back(static_cast<double>(i), profile[i].mean());
  }
  if (flank.size() < kFewestBins) return std::nan("");
  std::vector<double> slopes;
  for (size_t i = 0; i < flank.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      slopes.push_back((flank[i].second - flank[j].second) / (flank[i].first - flank[j].first));
    }
  }
  return median(slopes);
}

}  // namespace

std::vector<Vec3> surface_points(const TriangleMesh& mesh, double spacing_m) {
  std::map<std::array<long, 3>, Vec3> kept;  // one per cube
  const auto keep = [&](const Vec3& point) {
    const Vec3 cube = point / spacing_m;
    kept.try_emplace({std::lround(cube.x()), std::lround(cube.y()), std::lround(cube.z())}, point);
  };
  for (const auto& triangle : mesh.triangles) {
    const Vec3& a = mesh.vertices[triangle[0]];
    const Vec3 u = mesh.vertices[triangle[1]] - a;
    const Vec3 v = mesh.vertices[triangle[2]] - a;
    const int parts = static_cast<int>(
        std::ceil(std::max({u.norm(), v.norm(), (u - v).norm(), spacing_m}) / spacing_m));
    for (int i = 0; i <= parts; ++i) {
      for (int j = 0; i + j <= parts; ++j) keep(a + (u * i + v * j) / parts);
    }
  }
  std::vector<Vec3> points;
  for (const auto& [cube, point] : kept) points.push_back(point);
  return points;
}

std::vector<Column> columns_of(const std::vector<Vec3>& points, const Pose& pose, double cell_m) {
  const Eigen::Matrix3d turn = pose.orientation.toRotationMatrix();
  std::vector<Column> columns;
  columns.reserve(points.size());
  for (const Vec3& point : points) {
    const Vec3 p = turn * point + pose.position;
    columns.push_back({static_cast<int32_t>(std::floor(p.x() / cell_m)),
                       static_cast<int32_t>(std::floor(p.z() / cell_m)), p.y()});
  }
  std::ranges::sort(columns, [](const Column& a, const Column& b) {
    return std::tuple(a.z, a.x, b.top_m) < std::tuple(b.z, b.x, a.top_m);
  });
  const auto is_same = [](const Column& a, const Column& b) { return a.x == b.x && a.z == b.z; };
  columns.erase(std::unique(columns.begin(), columns.end(), is_same), columns.end());
  return columns;
}

HeightField::HeightField(const GroundBox& area, double cell_m, double base_m)
    : cell_m_(cell_m),
      base_m_(base_m),
      first_x_(static_cast<int32_t>(std::floor(area.min().x() / cell_m))),
      first_z_(static_cast<int32_t>(std::floor(area.min().y() / cell_m))),
      width_(static_cast<size_t>(std::ceil(area.max().x() / cell_m) - first_x_)),
      depth_(static_cast<size_t>(std::ceil(area.max().y() / cell_m) - first_z_)),
      height_(width_ * depth_, 0.0) {}

void HeightField::add(const std::vector<Column>& columns) {
  for (const Column& column : columns) {
    // The index of a cell before the first one wraps to a huge number.
    const auto x = static_cast<size_t>(static_cast<int64_t>(column.x) - first_x_);
    const auto z = static_cast<size_t>(static_cast<int64_t>(column.z) - first_z_);
    if (x >= width_ || z >= depth_) continue;
    double& height = height_[z * width_ + x];
    height = std::max(height, column.top_m - base_m_);
  }
}

double reach_of_bulk(const PileShape& shape, const std::vector<SurfaceCell>& cells, double cell_m) {
  struct Ring {
    double cells = 0, distances = 0, heights = 0;
  };
  const double width_m = cell_m / 8;
  std::vector<Ring> rings;
  for (const SurfaceCell& cell : cells) {
    const auto i = static_cast<size_t>(cell.distance_m / width_m);
    if (i >= rings.size()) rings.resize(i + 1);
    rings[i].cells += cell.weight;
    rings[i].distances += cell.weight * cell.distance_m;
    rings[i].heights += cell.weight * cell.height_m;
  }
  // The mean heights over the first rings equal those of the ideal surface where sum(height) =
  // slope * sum(reach - distance), and the reach must end at those rings. Use the last such reach:
  // a steep middle still has its foot to fill.
  Ring inside;
  double last_reach = 0;
  for (size_t i = 0; i < rings.size(); ++i) {
    inside.cells += rings[i].cells;
    inside.distances += rings[i].distances;
    inside.heights += rings[i].heights;
    if (inside.heights <= 0) continue;
    const double reach = (inside.heights / shape.slope() + inside.distances) / inside.cells;
    if (reach >= static_cast<double>(i) * width_m) last_reach = reach;
  }
  return std::min(last_reach, shape.most_reach());
}

std::vector<double> slope_angles(const PileShape& shape, const HeightField& field,
                                 const Territory& territory) {
  const double end_m = shape.to_wall() - kCellsOffWalls * field.cell_m();
  double held_m = 0;  // held up by walls
  // Calls use(bin of the distance, cell's centre, height, whether it belongs to the pile).
  const auto for_each = [&](const auto& use) {
    field.for_each([&](const GroundPoint& point, double height) {
      const double distance = shape.distance(point);
      if (distance >= end_m || !shape.inside_walls(point)) return;
      use(static_cast<size_t>(distance / field.cell_m()), point, std::max(0.0, height - held_m),
          territory(point));
    });
  };
  const auto mean_profile = [&] {
    std::vector<Bin> bins;
    for_each([&](size_t bin, const GroundPoint&, double height, bool own) {
      if (bins.size() <= bin) bins.resize(bin + 1);
      bins[bin].add(height, own);
    });
    return bins;
  };
  std::vector<Bin> all = mean_profile();
  if (shape.has_walls() && !all.empty()) {
    held_m = all.back().mean();
    all = mean_profile();
  }
  const auto [first, last] = flank_of(all);
  const double middle_m = (static_cast<double>(first + last) / 2) * field.cell_m();
  std::array<std::vector<Bin>, kAzimuths> profile;
  for_each([&](size_t bin, const GroundPoint& point, double height, bool own) {
    const double round = shape.way_round(point, middle_m);
    std::vector<Bin>& bins =
        profile[std::min<size_t>(kAzimuths - 1, static_cast<size_t>(round * kAzimuths))];
    if (bins.size() <= bin) bins.resize(bin + 1);
    bins[bin].add(height, own);
  });
  std::vector<double> angles;
  for (const std::vector<Bin>& bins : profile) {
    if (!is_free(bins, first, last)) continue;
    const double slope = flank_slope(bins) / field.cell_m();
    if (!std::isnan(slope)) angles.push_back(std::atan(-slope));
  }
  return angles;
}

SlopeFit fit_slope(std::vector<double> angles) {
  SlopeFit fit{.azimuths = static_cast<int>(angles.size())};
  if (angles.empty()) return fit;
  fit.angle = median(angles);
  std::ranges::sort(angles);
  fit.spread = (angles[angles.size() * 5 / 6] - angles[angles.size() / 6]) / 2;
  return fit;
}

}  // namespace pilesim
