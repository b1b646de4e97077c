#include "model/emitters.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <unordered_map>

#include "core/error.h"
#include "core/parallel_for.h"
#include "core/philox.h"
#include "geometry/inside_test.h"
#include "model/kinematic_motion.h"
#include "scene/scene_format.h"

namespace pilesim {

namespace {

// Uses of a body's random numbers. Each has its own counter, so that a further draw of one moves no
// other.
enum Draw : uint32_t {
  kPosition,
  kOrientation,
  kPositionJitter,
  kLinearJitter,
  kAngularJitter,
  kShape,
  kSize,
  kColour,
  kRoughness,
  kClearCoat,
  kDrawnAgain = 1000,  // .. kDrawnAgain + 999
};

struct Dice {
  uint64_t seed;
  uint64_t emitter;
  Philox of(size_t body, uint32_t draw) const {
    return {seed, Stream::emitter, emitter << 32 | body, draw};
  }
};

std::vector<Vec3> grid_positions(const GridSource& grid) {
  const std::array<int, 3>& count = grid.count;
  const Vec3 middle = Vec3(count[0] - 1, count[1] - 1, count[2] - 1) / 2;
  std::vector<Vec3> positions;
  positions.reserve(static_cast<size_t>(count[0]) * count[1] * count[2]);
  for (int y = 0; y < count[1]; ++y) {
    for (int z = 0; z < count[2]; ++z) {
      for (int x = 0; x < count[0]; ++x) {
        positions.push_back(grid.centre + (Vec3(x, y, z) - middle).cwiseProduct(grid.spacing));
      }
    }
  }
  return positions;
}

// Points by cells of a cubic lattice: answers how near a point's nearest neighbour is.
class NeighbourGrid {
 public:
  explicit NeighbourGrid(double cell) : cell_(cell) {}

  void insert(const Vec3& point) { cells_[key(cell_of(point))].push_back(point); }

  // Distance to the nearest point, or the cell's edge length if none is nearer.
  double nearest_distance(const Vec3& point) const {
    double nearest_squared = cell_ * cell_;
    const std::array<int64_t, 3> home = cell_of(point);
    for (int64_t dx = -1; dx <= 1; ++dx) {
      for (int64_t dy = -1; dy <= 1; ++dy) {
        for (int64_t dz = -1; dz <= 1; ++dz) {
          const auto found = cells_.find(key({home[0] + dx, home[1] + dy, home[2] + dz}));
          if (found == cells_.end()) continue;
          for (const Vec3& other : found->second) {
            nearest_squared = std::min(nearest_squared, (other - point).squaredNorm());
          }
        }
      }
    }
    return std::sqrt(nearest_squared);
  }

 private:
  std::array<int64_t, 3> cell_of(const Vec3& point) const {
    const Vec3 cell = (point / cell_).array().floor();
    return {static_cast<int64_t>(cell.x()), static_cast<int64_t>(cell.y()),
            static_cast<int64_t>(cell.z())};
  }
  // Cells whose keys meet share a list, which costs time but changes no distance.
  static uint64_t key(const std::array<int64_t, 3>& cell) {
    constexpr uint64_t kMask = (1u << 21) - 1;
    return (static_cast<uint64_t>(cell[0]) & kMask) << 42 |
           (static_cast<uint64_t>(cell[1]) & kMask) << 21 |
           (static_cast<uint64_t>(cell[2]) & kMask);
  }

  double cell_;
  std::unordered_map<uint64_t, std::vector<Vec3>> cells_;
};

Vec3 in_cylinder(const DiskSource& disk, Philox& dice) {
  const double r = disk.radius * std::sqrt(dice.uniform());
  const double azimuth = 2 * kPi * dice.uniform();
  const double y = disk.height * (dice.uniform() - 0.5);
  return disk.centre + Vec3(r * std::cos(azimuth), y, r * std::sin(azimuth));
}

// Uniform; with `clearance` > 0 each takes the first of some candidates that keeps this distance
// from all before it, or the one that comes closest to it.
std::vector<Vec3> disk_positions(const DiskSource& disk, size_t count, double clearance,
                                 const Dice& dice) {
  constexpr int kCandidates = 64;
  std::vector<Vec3> positions(count);
  NeighbourGrid neighbours(clearance > 0 ? clearance : 1);
  for (size_t i = 0; i < count; ++i) {
    Philox draws = dice.of(i, kPosition);
    positions[i] = in_cylinder(disk, draws);
    if (clearance == 0) continue;
    double best = neighbours.nearest_distance(positions[i]);
    for (int candidate = 1; candidate < kCandidates && best < clearance; ++candidate) {
      const Vec3 position = in_cylinder(disk, draws);
      const double distance = neighbours.nearest_distance(position);
      if (distance > best) {
        best = distance;
        positions[i] = position;
      }
    }
    neighbours.insert(positions[i]);
  }
  return positions;
}

std::vector<Vec3> line_positions(const LineSource& line, size_t count, double rate_hz) {
  std::vector<Vec3> positions(count);
  for (size_t i = 0; i < count; ++i) {
    const double periods = static_cast<double>(i) / (rate_hz * line.period_s);
    const double phase = periods - std::floor(periods);
    const double share = phase < 0.5 ? 2 * phase : 2 - 2 * phase;
    positions[i] = line.from + share * (line.to - line.from);
  }
  return positions;
}

// Points of one horizontal layer of the lattice, row by row.
std::vector<Vec3> layer_inside(const InsideTest& inside, const Vec3& corner, double spacing,
                               size_t columns, size_t rows) {
  std::vector<uint8_t> is_inside(columns * rows);
  const auto point = [&](size_t i) -> Vec3 {
    const size_t row = i / columns, column = i % columns;
    return corner + spacing * Vec3(static_cast<double>(column), 0, static_cast<double>(row));
  };
  constexpr size_t kGrain = 256;
  parallel_for(is_inside.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) is_inside[i] = inside.contains(point(i)) ? 1 : 0;
  });
  std::vector<Vec3> points;
  for (size_t i = 0; i < is_inside.size(); ++i) {
    if (is_inside[i] != 0) points.push_back(point(i));
  }
  return points;
}

std::vector<Vec3> volume_positions(const VolumeSource& volume, size_t limit, TriangleMesh mesh) {
  for (Vec3& vertex : mesh.vertices) vertex = volume.pose.apply(vertex);
  const Bounds bounds = mesh.bounds();
  const Vec3 cells = (bounds.sizes() / volume.spacing).array().floor();
  constexpr double kMostPoints = 1e8;
  if ((cells.array() + 1).prod() > kMostPoints) {
    throw Error(ErrorKind::input,
                Problem{.found = "gives more than 1e8 lattice points in the bounds of the mesh",
                        .expected = "a spacing that suits the size of the mesh"});
  }
  // Centred in the bounds.
  const Vec3 corner = bounds.center() - volume.spacing * cells / 2;
  const InsideTest inside(mesh);
  std::vector<Vec3> positions;
  for (double y = 0; y <= cells.y() && positions.size() < limit; ++y) {
    const std::vector<Vec3> layer =
        layer_inside(inside, corner + Vec3(0, y * volume.spacing, 0), volume.spacing,
                     static_cast<size_t>(cells.x()) + 1, static_cast<size_t>(cells.z()) + 1);
    positions.insert(positions.end(), layer.begin(), layer.end());
  }
  if (positions.size() > limit) positions.resize(limit);
  return positions;
}

std::vector<Vec3> start_positions(const Emitter& emitter, const Dice& dice, double bounding_radius,
                                  const TriangleMesh* volume_mesh) {
  const size_t count = static_cast<size_t>(emitter.count);
  if (const auto* grid = std::get_if<GridSource>(&emitter.source)) return grid_positions(*grid);
  if (const auto* disk = std::get_if<DiskSource>(&emitter.source)) {
    // Bodies that start at different times have fallen out of each other's way.
    const double clearance = emitter.rate_hz > 0 ? 0 : 2 * bounding_radius;
    return disk_positions(*disk, count, clearance, dice);
  }
  if (const auto* line = std::get_if<LineSource>(&emitter.source)) {
    return line_positions(*line, count, emitter.rate_hz);
  }
  if (const auto* stream = std::get_if<PointSource>(&emitter.source)) {
    return std::vector<Vec3>(count, stream->position);
  }
  if (fills_guide(emitter)) {
    return std::vector<Vec3>(count, Vec3::Zero());  // until the guide is filled
  }
  assert(volume_mesh != nullptr);
  // One more than a scene may have is enough to tell that there are too many.
  const size_t limit = count == 0 ? static_cast<size_t>(kMostBodies) + 1 : count;
  return volume_positions(std::get<VolumeSource>(emitter.source), limit, *volume_mesh);
}

double start_of(const Emitter& emitter, size_t body) {
  const double delay_s = emitter.rate_hz > 0 ? static_cast<double>(body) / emitter.rate_hz : 0;
  return emitter.start_s + delay_s;
}

// The motion of the nozzle; empty: it stands still.
Motion nozzle_motion(const Emitter& emitter) {
  const auto* stream = std::get_if<PointSource>(&emitter.source);
  if (stream == nullptr) return {};
  Motion motion = stream->motion;
  if (motion.empty() && !motion.motors.empty()) {
    motion.push_back({.pose = {stream->position, Quat::Identity()}});
  }
  return motion;
}

// Moves the start of a body from a nozzle that is not turned to where `nozzle` is.
void launch_from(const Pose& nozzle, bool is_oriented, EmittedBody& body) {
  body.pose.position = nozzle.position;
  if (is_oriented) {
    body.pose.orientation = (nozzle.orientation * body.pose.orientation).normalized();
  }
  body.linear_velocity = nozzle.orientation * body.linear_velocity;
  body.angular_velocity = nozzle.orientation * body.angular_velocity;
}

Vec3 in_ball(double radius, Philox dice) {
  if (radius == 0) return Vec3::Zero();
  const Vec3 direction = dice.direction();
  return radius * std::cbrt(dice.uniform()) * direction;
}

Vec3 in_cube(double half_width, Philox dice) {
  if (half_width == 0) return Vec3::Zero();
  const double x = dice.uniform(-half_width, half_width);
  const double y = dice.uniform(-half_width, half_width);
  const double z = dice.uniform(-half_width, half_width);
  return {x, y, z};
}

// The index of one of `weights`, which are >= 0 and not all 0.
size_t drawn_by(const std::vector<double>& weights, Philox dice) {
  double sum = 0;
  for (const double weight : weights) sum += weight;
  double left = sum * dice.uniform();
  size_t chosen = 0;
  for (size_t i = 0; i < weights.size() && left >= 0; ++i) {
    if (weights[i] == 0) continue;
    chosen = i;
    left -= weights[i];
  }
  return chosen;
}

std::optional<double> drawn_from(const std::optional<std::array<double, 2>>& range, Philox dice) {
  if (!range) return std::nullopt;
  return dice.uniform((*range)[0], (*range)[1]);
}

// How likely each of size_steps() is.
std::vector<double> size_weights(const Sizes& sizes) {
  std::vector<double> weights(static_cast<size_t>(sizes.steps), 1);
  if (sizes.distribution != SizeDistribution::normal) return weights;
  constexpr double kEnd = 2;  // standard deviations
  for (size_t i = 0; i < weights.size(); ++i) {
    const double x = kEnd * (2 * static_cast<double>(i) / (sizes.steps - 1) - 1);
    weights[i] = std::exp(-x * x / 2);
  }
  return weights;
}

}  // namespace

std::vector<double> size_steps(const Sizes& sizes) {
  std::vector<double> steps;
  for (int i = 0; i < sizes.steps; ++i) {
    const double share = static_cast<double>(i) / (sizes.steps - 1);
    steps.push_back(sizes.distribution == SizeDistribution::log_uniform
                        ? sizes.from * std::pow(sizes.to / sizes.from, share)
                        : sizes.from + share * (sizes.to - sizes.from));
  }
  return steps;
}

std::vector<EmittedBody> unroll(const Emitter& emitter, size_t emitter_index, uint64_t seed,
                                double bounding_radius, const TriangleMesh* volume_mesh) {
  const Dice dice{seed, emitter_index};
  const std::vector<Vec3> positions = start_positions(emitter, dice, bounding_radius, volume_mesh);
  std::vector<EmittedBody> bodies(positions.size());
  const std::vector<double> steps =
      emitter.sizes ? size_steps(*emitter.sizes) : std::vector<double>();
  const std::vector<double> likely =
      emitter.sizes ? size_weights(*emitter.sizes) : std::vector<double>();
  const Motion nozzle = nozzle_motion(emitter);
  for (size_t i = 0; i < bodies.size(); ++i) {
    EmittedBody& body = bodies[i];
    body.start_s = start_of(emitter, i);
    body.pose = {positions[i],
                 emitter.orientation ? *emitter.orientation : dice.of(i, kOrientation).rotation()};
    body.linear_velocity = emitter.linear_velocity;
    body.angular_velocity = emitter.angular_velocity;
    if (!nozzle.empty()) {
      launch_from(pose_at(nozzle, body.start_s), emitter.orientation.has_value(), body);
    }
    body.pose.position += in_cube(emitter.position_jitter_m, dice.of(i, kPositionJitter));
    body.linear_velocity += in_ball(emitter.linear_velocity_jitter, dice.of(i, kLinearJitter));
    body.angular_velocity += in_ball(emitter.angular_velocity_jitter, dice.of(i, kAngularJitter));
    body.shape = static_cast<uint32_t>(emitter.weights.empty()
                                           ? i % emitter.shapes.size()
                                           : drawn_by(emitter.weights, dice.of(i, kShape)));
    if (emitter.sizes) body.size = steps[drawn_by(likely, dice.of(i, kSize))];
    if (!emitter.palette.empty()) {
      const auto colours = static_cast<uint32_t>(emitter.palette.size());
      body.colour = emitter.palette[dice.of(i, kColour).index(colours)];
    }
    body.roughness = drawn_from(emitter.roughness, dice.of(i, kRoughness));
    body.clear_coat = drawn_from(emitter.clear_coat, dice.of(i, kClearCoat));
  }
  return bodies;
}

bool can_be_drawn_again(const Emitter& emitter) {
  return std::holds_alternative<DiskSource>(emitter.source);
}

Pose drawn_again(const Emitter& emitter, size_t emitter_index, uint64_t seed, size_t body,
                 uint32_t draw) {
  Philox dice = Dice{seed, emitter_index}.of(body, kDrawnAgain + draw);
  const Vec3 place = in_cylinder(std::get<DiskSource>(emitter.source), dice);
  return {place, emitter.orientation ? *emitter.orientation : dice.rotation()};
}

}  // namespace pilesim
