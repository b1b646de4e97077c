#include "packing/pour_trial.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/interrupt.h"
#include "core/philox.h"
#include "geometry/convex_hull.h"

namespace pilesim {
namespace {

// Starting positions, in R and sqrt(g R): bodies are out of each other's reach in any orientation.
constexpr double kSpacing = 2.1, kJitter = 0.04, kLowest = 1.5, kSpin = 0.3;
constexpr int kHeapSide = 6, kLargeHeapSide = 8;  // bodies along each side
// Width of a column, in diameters of a ball of the object's volume and at least in R; and its
// height in widths if half of it were solid.
constexpr double kColumnWidth = 6, kLeastColumnWidth = 8, kColumnHeight = 0.65;
constexpr double kLikelyFraction = 0.5;
constexpr int kMostInColumn = 400;
// Single bodies: rows of this many, every other row thrown; in R, sqrt(g R).
constexpr int kAloneSide = 8;
constexpr double kAlone = 100, kDropHeight = 4, kThrow = 2;
constexpr double kWalls = 2;  // R, thick enough that nothing passes through
// In sqrt(R / g).
constexpr double kFrame = 1.0 / 8, kStep = 1.0 / 32, kLongest = 40;
constexpr double kStillAwake = 0.03;  // share of the bodies; with fewer awake a pile is at rest
// The bulk of a column, in R: at least this far from walls and ground, and below this height.
constexpr double kFromWalls = 1.2, kFromGround = 1.5, kBulkByMean = 1.6, kLeastBulk = 1;

int bodies_in_column(double width_m, double volume_m3) {
  const double bodies = kLikelyFraction * kColumnHeight * std::pow(width_m, 3) / volume_m3;
  return static_cast<int>(std::min<double>(kMostInColumn, bodies));
}

Body fixed_body(const std::string& shape) {
  return {.name = shape, .shape = shape, .material = "stuff", .role = Role::fixed};
}

}  // namespace

PourTrial::PourTrial(const PouredObject& object, PourKind kind)
    : volume_m3_(object.volume_m3),
      radius_m_(object.outer_radius_m),
      time_s_(std::sqrt(object.outer_radius_m / scene_.gravity.norm())),
      kind_(kind) {
  scene_.name = "pour";
  scene_.frame_rate = 1 / (kFrame * time_s_);
  scene_.step_s = kStep * time_s_;
  scene_.materials["stuff"] = object.material;
  // A stand-in for the object, which need not be a shape that scenes can describe.
  scene_.shapes["object"] = SphereShape{radius_m_};
  const bool alone = kind == PourKind::alone;
  const int side = kind == PourKind::heap ? kHeapSide : kLargeHeapSide;
  std::array<int, 3> count = {side, side, side};
  if (alone) count = {kAloneSide, 1, kAloneSide};
  if (kind == PourKind::column) {
    const double ball_m = std::cbrt(6 * volume_m3_ / kPi);
    const double width_m = std::max(kColumnWidth * ball_m, kLeastColumnWidth * radius_m_);
    half_width_ = width_m / 2 / radius_m_;
    const int across = static_cast<int>(2 * (half_width_ - 1 - kJitter) / kSpacing) + 1;
    const int layers = std::max(1, bodies_in_column(width_m, volume_m3_) / (across * across));
    count = {across, layers, across};
    const double height_m = (kLowest + kSpacing * (layers + 1)) * radius_m_;
    scene_.shapes["walls"] = BinShape{{width_m, height_m, width_m}, kWalls * radius_m_};
    scene_.bodies.push_back(fixed_body("walls"));
    // Puts the wall's floor at ground level.
    scene_.bodies.back().pose.position.y() = -kWalls * radius_m_;
  } else {
    scene_.shapes["ground"] = PlaneShape{};
    scene_.bodies.push_back(fixed_body("ground"));
  }
  const Vec3 middle(0.5 * (count[0] - 1), 0, 0.5 * (count[2] - 1));
  for (int y = 0; y < count[1]; ++y) {
    for (int z = 0; z < count[2]; ++z) {
      for (int x = 0; x < count[0]; ++x) {
        const Vec3 place = (alone ? kAlone : kSpacing) * (Vec3(x, y, z) - middle) +
                           Vec3(0, alone ? kDropHeight : kLowest, 0);
        places_.emplace_back(radius_m_ * place);
        scene_.bodies.push_back(
            {.name = std::to_string(places_.size()), .shape = "object", .material = "stuff"});
        scene_.bodies.back().pose.position = places_.back();
      }
    }
  }
  model_ = build_model(scene_);
  for (uint32_t i = 0; i < model_.bodies.size(); ++i) {
    if (model_.bodies[i].role == Role::dynamic) poured_.push_back(i);
  }
  model_.shapes[model_.bodies[poured_.front()].shape] = object.shape;
  for (const uint32_t body : poured_) {
    model_.bodies[body].mass_kg = object.shape.mass.volume_m3 * object.material.density_kg_m3;
  }
  for (const Vec3& corner : convex_hull(object.shape.mesh.vertices).vertices) {
    corners_.push_back(corner / radius_m_);
  }
}

Model PourTrial::starts(uint64_t seed) const {
  Model model = model_;
  for (size_t i = 0; i < poured_.size(); ++i) {
    Philox random(seed, Stream::pour, i);
    const double x = random.uniform(-1, 1), y = random.uniform(-1, 1), z = random.uniform(-1, 1);
    ModelBody& body = model.bodies[poured_[i]];
    body.pose.position = places_[i] + kJitter * radius_m_ * Vec3(x, y, z);
    body.pose.orientation = random.rotation();
    const Vec3 axis = random.direction();
    body.angular_velocity = random.uniform() * kSpin / time_s_ * axis;
    if (is_thrown(i)) body.linear_velocity.x() = kThrow * radius_m_ / time_s_;
  }
  return model;
}

PourFigures PourTrial::run(Simulator& simulator) const {
  const int frames = static_cast<int>(kLongest / kFrame);
  int frame = 0;
  for (double awake = 1; frame < frames && awake > kStillAwake && !interrupted(); ++frame) {
    awake = simulator.step_frame().bodies_awake / static_cast<double>(poured_.size());
  }
  PourFigures figures{.time = kFrame * frame};
  std::vector<Vec3> places;  // R
  for (const uint32_t body : poured_) {
    const Vec3 place = simulator.states().position[body] / radius_m_;
    // Needles and sheets may pass a wall at hard impacts: they do not belong to the pile.
    const double across = std::max(std::abs(place.x()), std::abs(place.z()));
    if (!(place.y() > 0 && (half_width_ == 0 || across < half_width_))) continue;
    places.push_back(place);
    figures.reach += reach_below(simulator.states().orientation[body]);
  }
  figures.reach /= std::max(1.0, static_cast<double>(places.size()));
  const auto count = static_cast<double>(places.size());
  for (const Vec3& place : places) {
    figures.height += place.y() / count;
    figures.spread += std::hypot(place.x(), place.z()) / count;
  }
  if (half_width_ > 0) judge_bulk(places, figures);
  if (kind_ == PourKind::alone) judge_ways(simulator.states().position, figures);
  return figures;
}

bool PourTrial::is_thrown(size_t body) const {
  return kind_ == PourKind::alone && body / kAloneSide % 2 == 1;
}

void PourTrial::judge_ways(const std::vector<Vec3>& positions, PourFigures& figures) const {
  for (size_t i = 0; i < poured_.size(); ++i) {
    const Vec3 way = positions[poured_[i]] - places_[i];
    (is_thrown(i) ? figures.thrown : figures.dropped) +=
        std::hypot(way.x(), way.z()) / radius_m_ / (0.5 * static_cast<double>(poured_.size()));
  }
}

double PourTrial::reach_below(const Quat& orientation) const {
  const Vec3 down = orientation.conjugate() * -Vec3::UnitY();
  double reach = 0;
  for (const Vec3& corner : corners_) reach = std::max(reach, corner.dot(down));
  return reach;
}

void PourTrial::judge_bulk(const std::vector<Vec3>& places, PourFigures& figures) const {
  const double half = half_width_ - kFromWalls;
  const double high = kBulkByMean * figures.height;
  if (high < kFromGround + kLeastBulk) return;
  const double middle = (kFromGround + high) / 2;
  double amid = 0, deep = 0;
  for (const Vec3& place : places) {
    if (std::max(std::abs(place.x()), std::abs(place.z())) >= half) continue;
    if (place.y() <= kFromGround || place.y() >= high) continue;
    ++amid;
    deep += place.y() < middle ? 1 : 0;
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vec3& other : places) {
      if (&other != &place) nearest = std::min(nearest, (other - place).squaredNorm());
    }
    figures.nearest += std::sqrt(nearest);
  }
  if (amid == 0) return;
  figures.nearest /= amid;
  const double solid = volume_m3_ / std::pow(radius_m_, 3);
  const double room = 4 * half * half * (high - kFromGround);
  figures.fraction = amid * solid / room;
  figures.deep_fraction = 2 * deep * solid / room;
}

}  // namespace pilesim
