#include "pile/height_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace pilesim {
namespace {

constexpr double kFlankFoot = 0.2, kFlankTop = 0.9;  // shares of the pile's height
constexpr size_t kFewestBins = 4;                    // of a line worth fitting
constexpr double kMostTaken = 0.25;                  // of a flank, by neighbours

double median(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

struct Bin {
  double sum = 0;
  int cells = 0;
  int taken = 0;  // further cells, that belong to another pile
  double mean() const { return cells > 0 ? sum / cells : 0; }
};

// Bins [first, last) of the mean profile between the two shares of its height, on the way out from
// its top.
std::pair<size_t, size_t> flank_of(const std::vector<Bin>& profile) {
  double top_m = 0;
  size_t first = 0;
  for (size_t i = 0; i < profile.size(); ++i) {
    if (profile[i].mean() <= top_m) continue;
    top_m = profile[i].mean();
    first = i;
  }
  while (first < profile.size() && profile[first].mean() > kFlankTop * top_m) ++first;
  size_t last = first;
  while (last < profile.size() && profile[last].mean() >= kFlankFoot * top_m) ++last;
  return {first, last};
}

// Slope of height over the bins' index; NaN where there are too few of them, or too little is free.
double flank_slope(const std::vector<Bin>& profile, size_t first, size_t last) {
  double own = 0, taken = 0;
  for (size_t i = first; i < std::min(last, profile.size()); ++i) {
    own += profile[i].cells;
    taken += profile[i].taken;
  }
  if (taken > kMostTaken * (own + taken)) return std::nan("");
  std::vector<std::pair<double, double>> flank;
  for (size_t i = first; i < std::min(last, profile.size()); ++i) {
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
  std::map<std::array<long, 3>, Vec3> kept;  // one a cube
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

HeightField::HeightField(const GroundPoint& middle, double half_width_m, double cell_m,
                         double base_m)
    : corner_(middle - GroundPoint::Constant(half_width_m)),
      cell_m_(cell_m),
      base_m_(base_m),
      width_(static_cast<size_t>(std::ceil(2 * half_width_m / cell_m))),
      height_(width_ * width_, 0.0) {}

void HeightField::add(const std::vector<Vec3>& points, const Pose& pose) {
  for (const Vec3& point : points) {
    const Vec3 p = pose.apply(point);
    const double column = (p.x() - corner_.x()) / cell_m_;
    const double row = (p.z() - corner_.y()) / cell_m_;
    const auto width = static_cast<double>(width_);
    if (column < 0 || row < 0 || column >= width || row >= width) continue;
    double& height = height_[static_cast<size_t>(row) * width_ + static_cast<size_t>(column)];
    height = std::max(height, p.y() - base_m_);
  }
}

double reach_of_bulk(const PileShape& shape, const HeightField& field, const Territory& territory) {
  std::vector<std::pair<double, double>> cells;  // distance, height
  field.for_each([&](const GroundPoint& point, double height) {
    if (territory(point)) cells.emplace_back(shape.distance(point), height);
  });
  std::ranges::sort(cells);
  // Heights equal those of the ideal surface on the mean over the first k cells where
  // sum(height) = slope * sum(reach - distance); the reach must end at those cells.
  // The last such reach: what is steep in the middle still has its foot to be filled.
  double heights = 0;
  double distances = 0;
  double last_reach = 0;
  for (size_t k = 0; k < cells.size(); ++k) {
    distances += cells[k].first;
    heights += cells[k].second;
    const double reach = (heights / shape.slope() + distances) / static_cast<double>(k + 1);
    if (heights > 0 && reach >= cells[k].first) last_reach = reach;
  }
  return std::min(last_reach, shape.most_reach());
}

std::vector<double> slope_angles(const PileShape& shape, const HeightField& field,
                                 const Territory& territory) {
  std::array<std::vector<Bin>, kAzimuths> profile;
  const GroundPoint middle = shape.middle();
  std::vector<Bin> all;
  field.for_each([&](const GroundPoint& point, double height) {
    if (!shape.inside_walls(point)) return;
    const bool own = territory(point);
    const GroundPoint way = point - middle;
    const double turn = std::atan2(way.y(), way.x()) / (2 * kPi) + 0.5;
    const auto azimuth = std::min<size_t>(kAzimuths - 1, static_cast<size_t>(turn * kAzimuths));
    const auto bin = static_cast<size_t>(shape.distance(point) / field.cell_m());
    for (std::vector<Bin>* bins : {&profile[azimuth], &all}) {
      if (bins->size() <= bin) bins->resize(bin + 1);
      Bin& here = (*bins)[bin];
      ++(own ? here.cells : here.taken);
      if (own) here.sum += height;
    }
  });
  const auto [first, last] = flank_of(all);
  std::vector<double> angles;
  for (const std::vector<Bin>& bins : profile) {
    const double slope = flank_slope(bins, first, last) / field.cell_m();
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
