#include "render/pair_lines.h"

#include <algorithm>
#include <cmath>

#include "core/body_flags.h"
#include "render/overlay.h"
#include "render/view.h"

namespace pilesim {
namespace {

constexpr float kNear = 0.01f, kFar = 1000;
// Half the width for the root of the strength in weights, of the picture's height.
constexpr float kRadius = 0.0008f, kOpacity = 0.75f;

void draw_line(Image& image, const Eigen::Vector2f& from, const Eigen::Vector2f& to, float radius,
               const Eigen::Vector3f& colour) {
  const Eigen::Vector2f along = to - from;
  const float length2 = std::max(along.squaredNorm(), 1e-6f);
  const Eigen::AlignedBox2f box(from.cwiseMin(to), from.cwiseMax(to));
  const int last_x = std::min(image.width - 1, static_cast<int>(box.max().x() + radius + 1));
  const int last_y = std::min(image.height - 1, static_cast<int>(box.max().y() + radius + 1));
  for (int y = std::max(0, static_cast<int>(box.min().y() - radius - 1)); y <= last_y; ++y) {
    for (int x = std::max(0, static_cast<int>(box.min().x() - radius - 1)); x <= last_x; ++x) {
      const Eigen::Vector2f middle(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      const float share = std::clamp((middle - from).dot(along) / length2, 0.0f, 1.0f);
      const float distance = (middle - from - share * along).norm();
      const float cover = std::clamp(radius + 0.5f - distance, 0.0f, 1.0f);
      if (cover > 0) blend(image, x, y, colour, kOpacity * cover);
    }
  }
}

}  // namespace

void draw_pair_lines(const GuideFile& guide, std::span<const PairLine> lines, bool push_apart,
                     uint64_t index, const TrajectoryFrame& frame, const CameraKey& camera,
                     Image& image) {
  if (index == 0 || index > guide.frames.size()) return;
  const double time_s = guide.frames[index - 1].time_s;
  const auto width = static_cast<float>(image.width), height = static_cast<float>(image.height);
  const Vec3 origin = view_origin(camera);
  const View view = make_view(from_origin(camera, origin), width / height, kNear, kFar);
  const auto centre_of = [&](uint32_t body) -> Vec3f {
    return (frame.position[body] - origin).cast<float>();
  };
  const auto is_there = [&](uint32_t body) {
    return body < frame.state.size() && (frame.state[body] & kPresent) != 0;
  };
  for (const PairLine& line : lines) {
    if (time_s < line.from_s || time_s >= line.until_s) continue;
    if (!is_there(line.a) || !is_there(line.b)) continue;
    const auto strength = static_cast<float>(std::sqrt(std::abs(line.weights)));
    const float radius = std::max(0.5f, kRadius * height * strength);
    const Vec3f place = centre_of(line.a) + frame.orientation[line.a] * line.arm.cast<float>();
    for (const uint32_t body : {line.a, line.b}) {
      if (body == line.b && line.b_stands) continue;
      const Vec3f centre = centre_of(body);
      if (view.depth_of(centre) <= kNear || view.depth_of(place) <= kNear) continue;
      draw_line(image, view.project(centre, width, height), view.project(place, width, height),
                radius, push_apart && line.weights > 0 ? kPushColour : kPullColour);
    }
  }
}

}  // namespace pilesim
