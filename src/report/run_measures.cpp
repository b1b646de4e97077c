#include "report/run_measures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "core/counted.h"
#include "core/error.h"
#include "geometry/convex_hull.h"
#include "geometry/mass_properties.h"
#include "signature/rest/rest_poses.h"

namespace pilesim {
namespace {

constexpr double kMoving = 0.05;        // D/T: slower bodies count as settled
constexpr double kLeastMotion = 0.001;  // D
// Share of the bodies whose heights define the pile's ground.
constexpr double kLowestShare = 0.005;

struct ShapeFigures {
  double radius_m = 0;
  double volume_m3 = 0;
  Mat3 inertia_m5 = Mat3::Zero();
  std::vector<Vec3> rest_ups;
};

ShapeFigures shape_figures(const TrajectoryShape& shape) {
  ShapeFigures figures;
  if (shape.vertices.empty()) return figures;
  TriangleMesh mesh;
  for (const Vec3f& vertex : shape.vertices) {
    mesh.vertices.push_back(vertex.cast<double>());
    figures.radius_m = std::max(figures.radius_m, mesh.vertices.back().norm());
  }
  mesh.triangles = shape.triangles;
  MassProperties mass = mass_properties(mesh);
  // An improper solid was simulated with the mass of its hull.
  if (!(mass.volume_m3 > 0)) mass = mass_properties(convex_hull(mesh.vertices));
  figures.volume_m3 = mass.volume_m3;
  figures.inertia_m5 = mass.inertia_m5;
  const std::vector<RestPose> all = mesh_rest_poses(mesh, Vec3::Zero());
  std::vector<RestPose> likely = cluster_rest_poses(all, kRestPoseAngle, kLeastRestProbability);
  if (likely.empty()) likely = all;
  for (const RestPose& pose : likely) figures.rest_ups.push_back(pose.up);
  return figures;
}

// An error for the scene in a trajectory, which may have been edited.
Error no_scene(const nlohmann::json::exception& fault) {
  return {ErrorKind::input,
          Problem{.found = std::string("the trajectory's scene is none (") + fault.what() + ')',
                  .expected = "the scene that was simulated",
                  .remedy = "Run the simulation again"}};
}

Vec3 gravity_of(const TrajectoryHeader& header) try {
  const auto scene = nlohmann::json::parse(header.resolved_scene);
  if (!scene.contains("gravity")) return Vec3(0, -9.81, 0);
  const auto& gravity = scene["gravity"];
  return Vec3(gravity.at(0).get<double>(), gravity.at(1).get<double>(),
              gravity.at(2).get<double>());
} catch (const nlohmann::json::exception& fault) {
  throw no_scene(fault);
}

class Measurement {
 public:
  Measurement(TrajectoryReader& trajectory, int times);
  RunMeasures run();

 private:
  bool counts(size_t body) const {
    return dynamic_[body] != 0 && (now_.state[body] & kPresent) != 0;
  }
  const ShapeFigures& shape(size_t body) const { return shapes_[header_.body_shape[body]]; }
  void set_units();
  void difference();
  void measure_frame(uint64_t frame);
  void measure_end();
  void take(const std::string& name, const std::string& unit, std::vector<double> values);
  template <typename Value>
  std::vector<double> of_bodies(const Value& value) const;
  double energy() const;
  double pile_angle_deg() const;
  double packing_fraction() const;
  double tilt_deg(size_t body) const;
  double height_m(size_t body) const { return up_.dot(now_.position[body]); }
  double radial_m(size_t body) const {
    const Vec3 from_axis = now_.position[body] - centre_;
    return (from_axis - up_.dot(from_axis) * up_).norm();
  }

  TrajectoryReader& trajectory_;
  const TrajectoryHeader& header_;
  std::vector<uint8_t> dynamic_;
  std::vector<ShapeFigures> shapes_;
  std::vector<uint64_t> sampled_frames_;
  Vec3 up_ = Vec3::UnitY();
  double gravity_ = 0;          // m/s^2
  Vec3 centre_ = Vec3::Zero();  // of the initial positions
  TrajectoryFrame before_, now_;
  std::vector<double> speed_, spin_;  // (B) m/s, rad/s, in this frame
  std::vector<Vec3> turn_rate_;       // (B) rad/s, body frame
  std::vector<double> last_moved_s_;  // (B)
  RunMeasures measures_;
};

Measurement::Measurement(TrajectoryReader& trajectory, int times)
    : trajectory_(trajectory),
      header_(trajectory.header()),
      dynamic_(dynamic_bodies(header_)),
      speed_(header_.body_count()),
      spin_(header_.body_count()),
      turn_rate_(header_.body_count(), Vec3::Zero()),
      last_moved_s_(header_.body_count(), 0) {
  const auto last = static_cast<double>(trajectory.frame_count() - 1);
  for (int i = 1; i <= times; ++i) {
    sampled_frames_.push_back(static_cast<uint64_t>(std::lround(last * i / times)));
    measures_.times_s.push_back(static_cast<double>(sampled_frames_.back()) / header_.frame_rate);
  }
  for (const TrajectoryShape& one : header_.shapes) {
    shapes_.push_back(one.is_plane ? ShapeFigures{} : shape_figures(one));
  }
  set_units();
}

void Measurement::set_units() {
  const Vec3 gravity = gravity_of(header_);
  gravity_ = gravity.norm();
  if (gravity_ > 0) up_ = -gravity / gravity_;
  trajectory_.read(0, now_);
  double count = 0;
  for (size_t body = 0; body < dynamic_.size(); ++body) {
    if (dynamic_[body] == 0) continue;
    ++count;
    measures_.diameter_m += 2 * shape(body).radius_m;
    centre_ += now_.position[body];
  }
  if (count == 0) {
    throw Error(ErrorKind::input, Problem{.found = "the scene has no dynamic body",
                                          .expected = "bodies whose motion can be compared"});
  }
  measures_.diameter_m /= count;
  centre_ /= count;
  measures_.unit_time_s = gravity_ > 0 ? std::sqrt(measures_.diameter_m / gravity_) : 1;
}

// Velocities between `before_` and `now_`; none for bodies that were absent.
void Measurement::difference() {
  for (size_t body = 0; body < dynamic_.size(); ++body) {
    speed_[body] = spin_[body] = 0;
    turn_rate_[body].setZero();
    if (!counts(body) || (before_.state[body] & kPresent) == 0) continue;
    speed_[body] = header_.frame_rate * (now_.position[body] - before_.position[body]).norm();
    const Eigen::AngleAxisd turn(
        (before_.orientation[body].conjugate() * now_.orientation[body]).cast<double>());
    turn_rate_[body] = header_.frame_rate * turn.angle() * turn.axis();
    spin_[body] = header_.frame_rate * turn.angle();
  }
}

template <typename Value>
std::vector<double> Measurement::of_bodies(const Value& value) const {
  std::vector<double> values;
  for (size_t body = 0; body < dynamic_.size(); ++body) {
    if (counts(body)) values.push_back(value(body));
  }
  return values;
}

void Measurement::take(const std::string& name, const std::string& unit,
                       std::vector<double> values) {
  std::ranges::sort(values);
  auto place = std::ranges::find(measures_.quantities, name, &MeasuredQuantity::name);
  if (place == measures_.quantities.end()) {
    measures_.quantities.push_back({name, unit, {}});
    place = std::prev(measures_.quantities.end());
  }
  place->samples.push_back(std::move(values));
}

double Measurement::energy() const {
  double energy = 0;
  double volume_m3 = 0;
  for (size_t body = 0; body < dynamic_.size(); ++body) {
    if (!counts(body)) continue;
    const ShapeFigures& figures = shape(body);
    const Vec3& turn = turn_rate_[body];
    volume_m3 += figures.volume_m3;
    energy += figures.volume_m3 * (0.5 * speed_[body] * speed_[body] + gravity_ * height_m(body)) +
              0.5 * turn.dot(figures.inertia_m5 * turn);
  }
  return volume_m3 > 0 ? energy / volume_m3 : 0;
}

void Measurement::measure_frame(uint64_t frame) {
  const double diameter = measures_.diameter_m, unit_time = measures_.unit_time_s;
  const double limit = kMoving * diameter / unit_time;
  for (size_t body = 0; body < dynamic_.size(); ++body) {
    if (speed_[body] > limit || spin_[body] * shape(body).radius_m > limit) {
      last_moved_s_[body] = static_cast<double>(frame) / header_.frame_rate;
    }
  }
  take("energy", "(D/T)^2", {energy() * unit_time * unit_time / (diameter * diameter)});
  // One frame may represent several moments of a short run.
  for (auto i = std::ranges::count(sampled_frames_, frame); i > 0; --i) {
    take("radial_distance", "D", of_bodies([&](size_t b) { return radial_m(b) / diameter; }));
    take("height", "D", of_bodies([&](size_t b) { return height_m(b) / diameter; }));
    take("speed", "D/T", of_bodies([&](size_t b) { return speed_[b] * unit_time / diameter; }));
    take("spin", "1/T", of_bodies([&](size_t b) { return spin_[b] * unit_time; }));
  }
}

double Measurement::tilt_deg(size_t body) const {
  const Vec3 up = now_.orientation[body].cast<double>().conjugate() * up_;
  double nearest = -1;
  for (const Vec3& rest : shape(body).rest_ups) nearest = std::max(nearest, up.dot(rest));
  return degrees(std::acos(std::clamp(nearest, -1.0, 1.0)));
}

// Averaged over the volume of a cone of radius R and height H, the radius is R/2 and the height
// H/4.
double Measurement::pile_angle_deg() const {
  std::vector<double> heights = of_bodies([&](size_t body) { return height_m(body); });
  if (heights.empty()) return 0;
  std::ranges::sort(heights);
  const double ground =
      heights[static_cast<size_t>(kLowestShare * static_cast<double>(heights.size()))];
  double height = 0, radius = 0;
  for (const double one : heights) height += std::max(0.0, one - ground);
  for (const double one : of_bodies([&](size_t body) { return radial_m(body); })) radius += one;
  return degrees(std::atan2(2 * height, radius));
}

double Measurement::packing_fraction() const {
  const double width = measures_.diameter_m;
  const Vec3 side = up_.unitOrthogonal();
  const Vec3 across = up_.cross(side);
  std::map<std::pair<int64_t, int64_t>, double> tops;  // by column, m
  double volume_m3 = 0, floor_m = std::numeric_limits<double>::infinity();
  for (size_t body = 0; body < dynamic_.size(); ++body) {
    if (!counts(body)) continue;
    const double volume = shape(body).volume_m3;
    const double radius = std::cbrt(0.75 / kPi * volume);
    volume_m3 += volume;
    floor_m = std::min(floor_m, height_m(body) - radius);
    const Vec3 place = (now_.position[body] - centre_) / width;
    const auto column = std::pair(static_cast<int64_t>(std::floor(side.dot(place))),
                                  static_cast<int64_t>(std::floor(across.dot(place))));
    const double top = height_m(body) + radius;
    const auto [at, fresh] = tops.emplace(column, top);
    if (!fresh) at->second = std::max(at->second, top);
  }
  double columns_m3 = 0;
  for (const auto& [column, top] : tops) columns_m3 += width * width * (top - floor_m);
  return columns_m3 > 0 ? volume_m3 / columns_m3 : 0;
}

void Measurement::measure_end() {
  take("settling_time", "T",
       of_bodies([&](size_t body) { return last_moved_s_[body] / measures_.unit_time_s; }));
  take("tilt", "degrees", of_bodies([&](size_t body) { return tilt_deg(body); }));
  take("pile_angle", "degrees", {pile_angle_deg()});
  take("packing_fraction", "1", {packing_fraction()});
  measures_.bodies_at_end = of_bodies([](size_t) { return 0.0; }).size();
}

RunMeasures Measurement::run() {
  for (uint64_t frame = 1; frame < trajectory_.frame_count(); ++frame) {
    std::swap(before_, now_);
    trajectory_.read(frame, now_);
    difference();
    measure_frame(frame);
    for (size_t body = 0; body < dynamic_.size(); ++body) measures_.mean_bodies += counts(body);
  }
  measures_.mean_bodies /= static_cast<double>(trajectory_.frame_count() - 1);
  measure_end();
  return std::move(measures_);
}

void require_two_frames(const TrajectoryReader& trajectory) {
  if (trajectory.frame_count() >= 2) return;
  throw Error(ErrorKind::input,
              Problem{.found = "the trajectory has " + counted(trajectory.frame_count(), "frame"),
                      .expected = "at least 2"});
}

}  // namespace

std::vector<uint8_t> dynamic_bodies(const TrajectoryHeader& header) try {
  std::vector<uint8_t> dynamic = header.body_moves;
  const auto scene = nlohmann::json::parse(header.resolved_scene);
  if (!scene.contains("bodies")) return dynamic;
  // Bodies of emitters, all dynamic, follow those of the scene file.
  size_t index = 0;
  for (const auto& body : scene["bodies"]) {
    if (index < dynamic.size() && body.value("role", "dynamic") == "kinematic") dynamic[index] = 0;
    ++index;
  }
  return dynamic;
} catch (const nlohmann::json::exception& fault) {
  throw no_scene(fault);
}

RunMeasures measure_run(TrajectoryReader& trajectory, int times) {
  require_two_frames(trajectory);
  return Measurement(trajectory, times).run();
}

MotionError motion_error(TrajectoryReader& reference, TrajectoryReader& other) {
  require_two_frames(reference);
  const uint64_t frames = reference.frame_count();
  const std::vector<uint8_t> dynamic = dynamic_bodies(reference.header());
  if (other.frame_count() != frames || other.header().body_count() != dynamic.size()) {
    throw Error(ErrorKind::input, Problem{.found = "the trajectories differ in frames or bodies",
                                          .expected = "two runs of the same scene"});
  }
  double diameter_m = 0, count = 0;
  for (size_t body = 0; body < dynamic.size(); ++body) {
    if (dynamic[body] == 0) continue;
    float radius = 0;
    for (const Vec3f& vertex :
         reference.header().shapes[reference.header().body_shape[body]].vertices) {
      radius = std::max(radius, vertex.norm());
    }
    diameter_m += 2.0 * static_cast<double>(radius);
    ++count;
  }
  diameter_m /= std::max(1.0, count);

  MotionError error;
  double relative_count = 0, absolute_count = 0;
  TrajectoryFrame a, b, next_a, next_b;
  reference.read(0, a);
  other.read(0, b);
  for (uint64_t frame = 1; frame < frames; ++frame) {
    reference.read(frame, next_a);
    other.read(frame, next_b);
    double sum = 0, bodies = 0;
    for (size_t body = 0; body < dynamic.size(); ++body) {
      if (dynamic[body] == 0) continue;
      if ((a.state[body] & b.state[body] & next_a.state[body] & next_b.state[body] & kPresent) ==
          0) {
        continue;
      }
      const Vec3 motion = next_a.position[body] - a.position[body];
      const Vec3 other_motion = next_b.position[body] - b.position[body];
      const double way = motion.norm();
      const double difference = (motion - other_motion).norm();
      ++bodies;
      sum += difference / diameter_m;
      if (way < kLeastMotion * diameter_m) continue;
      error.relative += difference / way;
      ++relative_count;
    }
    error.absolute_by_frame.push_back(bodies > 0 ? sum / bodies : 0);
    error.absolute += sum;
    absolute_count += bodies;
    std::swap(a, next_a);
    std::swap(b, next_b);
  }
  error.relative /= std::max(1.0, relative_count);
  error.absolute /= std::max(1.0, absolute_count);
  return error;
}

}  // namespace pilesim
