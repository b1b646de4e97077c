#include "finish/easing.h"

#include <algorithm>
#include <cmath>

#include "core/parallel_for.h"

namespace pilesim {

namespace {

constexpr size_t kBodyGrain = 1024;
constexpr uint32_t kNever = ~uint32_t{0};

// A body has arrived within this distance of its end, relative to its radius.
constexpr double kThere = 0.01;
// A body has contact from the first frame whose motion differs from free flight by more than this:
// in gravity's displacement per frame, and, because files round, in its radius.
constexpr double kNoFlight = 0.1;
constexpr double kRounding = 4e-6;
// Shortest time of a correction, in sqrt(D / g) of the body.
constexpr double kLeastTime = 3;
// Steepest slope of eased().
constexpr double kSteepest = 1.5;

// From 0 to 1, with zero slope at both ends.
double eased(double share) {
  const double x = std::clamp(share, 0.0, 1.0);
  return x * x * (3 - 2 * x);
}

}  // namespace

RestStretches::RestStretches(const Model& model, const Vec3& gravity, double frame_rate,
                             TrajectoryFrame end, uint64_t frames)
    : model_(model),
      fall_(gravity / (frame_rate * frame_rate)),
      end_(std::move(end)),
      frames_(frames),
      present_from_(model.bodies.size(), kNever),
      contact_(model.bodies.size(), kNever),
      moved_(model.bodies.size(), 0) {
  double radius = 0;
  for (const ModelBody& body : model.bodies) {
    if (body.role == Role::dynamic) {
      radius = std::max(radius, model.shapes[body.shape].bounding_radius);
    }
  }
  const double gravity_m_s2 = gravity.norm();
  least_ = gravity_m_s2 > 0 ? kLeastTime * std::sqrt(2 * radius / gravity_m_s2) * frame_rate
                            : frame_rate;
}

void RestStretches::take(const TrajectoryFrame& frame) {
  const auto index = static_cast<uint32_t>(taken_++);
  parallel_for(model_.bodies.size(), kBodyGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      constexpr uint8_t kMayMove = kPresent | kHeld;
      if (model_.bodies[i].role != Role::dynamic || (frame.state[i] & kMayMove) != kPresent) {
        continue;
      }
      if (present_from_[i] == kNever) present_from_[i] = index;
      const double radius = model_.shapes[model_.bodies[i].shape].bounding_radius;
      const double away = (frame.position[i] - end_.position[i]).norm() +
                          radius * frame.orientation[i].angularDistance(end_.orientation[i]);
      if (away > kThere * radius) moved_[i] = index;
      if (contact_[i] != kNever || index < present_from_[i] + 2) continue;
      const Vec3 bend =
          frame.position[i] - 2 * before_.position[i] + before_that_.position[i] - fall_;
      if (bend.norm() > kNoFlight * fall_.norm() + kRounding * radius) contact_[i] = index - 1;
    }
  });
  before_that_ = std::move(before_);
  before_ = frame;
}

std::vector<RestStretches::Stretch> RestStretches::stretches() const {
  std::vector<Stretch> stretches(model_.bodies.size());
  const auto end = static_cast<double>(frames_ - 1);
  for (size_t i = 0; i < stretches.size(); ++i) {
    if (present_from_[i] == kNever) continue;
    Stretch& stretch = stretches[i];
    stretch.last = std::min<double>(end, moved_[i] + 1.0);
    stretch.first = std::min<double>(contact_[i], stretch.last);
    stretch.last = std::min(end, std::max(stretch.last, stretch.first + least_));
    stretch.first =
        std::max<double>(present_from_[i], std::min(stretch.first, stretch.last - least_));
  }
  return stretches;
}

EasedFrames::EasedFrames(std::vector<RestStretches::Stretch> stretches, const TrajectoryFrame& from,
                         const BodyStates& to, std::vector<WayPoint> ways)
    : stretches_(std::move(stretches)) {
  size_t next = 0;
  for (uint32_t i = 0; i < to.size(); ++i) {
    const Vec3& start = from.position[i];
    const Quat attitude = from.orientation[i].cast<double>().normalized();
    const bool has_way = next < ways.size() && ways[next].body == i;
    if (!has_way && to.position[i] == start && to.orientation[i].coeffs() == attitude.coeffs()) {
      continue;
    }
    const Quat back = attitude.conjugate();
    const auto first = static_cast<uint32_t>(points_.size());
    const auto add = [&](const Vec3& position, const Quat& orientation) {
      const Vec3 offset = position - start;
      const double before = points_.size() == first ? 0 : points_.back().at_m;
      const Vec3 last = points_.size() == first ? Vec3(Vec3::Zero()) : points_.back().offset;
      points_.push_back(
          {offset, (orientation * back).normalized(), before + (offset - last).norm()});
    };
    add(start, attitude);
    for (; next < ways.size() && ways[next].body == i; ++next) {
      add(ways[next].position, ways[next].orientation.cast<double>().normalized());
    }
    add(to.position[i], to.orientation[i]);
    ways_.push_back({i, first, static_cast<uint32_t>(points_.size() - first), points_.back().at_m});
  }
}

void EasedFrames::ease(uint64_t index, TrajectoryFrame& frame) const {
  parallel_for(ways_.size(), kBodyGrain, [&](size_t begin, size_t end) {
    for (size_t w = begin; w < end; ++w) {
      const Way& way = ways_[w];
      const auto& [first, last] = stretches_[way.body];
      const auto now = static_cast<double>(index);
      if (now <= first && now < last) continue;
      const double share = now >= last ? 1 : eased((now - first) / (last - first));
      const double at_m = share * way.length_m;
      uint32_t b = way.first + 1;
      while (b + 1 < way.first + way.count && points_[b].at_m < at_m) ++b;
      const Point &before = points_[b - 1], &after = points_[b];
      const double part_m = after.at_m - before.at_m;
      const double part = part_m > 0 ? std::clamp((at_m - before.at_m) / part_m, 0.0, 1.0) : share;
      const Vec3 offset = before.offset + part * (after.offset - before.offset);
      const Quat turn = before.turn.slerp(part, after.turn);
      frame.position[way.body] += offset;
      frame.orientation[way.body] =
          (turn * frame.orientation[way.body].cast<double>()).normalized().cast<float>();
    }
  });
}

double EasedFrames::largest_extra_speed(double frame_rate) const {
  double largest = 0;
  for (const Way& way : ways_) {
    const auto& [first, last] = stretches_[way.body];
    if (last > first) {
      largest = std::max(largest, kSteepest * way.length_m * frame_rate / (last - first));
    }
  }
  return largest;
}

}  // namespace pilesim
