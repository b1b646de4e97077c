#include "render/guide_overlay.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "render/pair_lines.h"
#include "render/view.h"

namespace pilesim {
namespace {

constexpr float kNear = 0.01f, kFar = 1000;
constexpr float kFacing = 0.16f, kGrazing = 0.55f;  // opacity of the guide by its slope to the view
constexpr int kSubpixels = 2;                       // along an edge of a pixel
constexpr float kDot = 0.0045f;                     // radius, of the picture's height
const Eigen::Vector3f kGuideColour(244, 248, 255), kBlack(16, 16, 18);

// The nearest surface at each point of a grid finer than the picture.
struct Surface {
  Surface(int columns, int rows)
      : width(columns),
        height(rows),
        depth(static_cast<size_t>(columns) * rows, std::numeric_limits<float>::infinity()),
        opacity(depth.size()) {}

  // Corners in points of the grid, with depths in m.
  void cover(const std::array<Eigen::Vector2f, 3>& corner, const std::array<float, 3>& corner_depth,
             float value) {
    const Eigen::Vector2f a = corner[1] - corner[0], b = corner[2] - corner[0];
    const float area = a.x() * b.y() - a.y() * b.x();
    if (area == 0) return;
    Eigen::AlignedBox2f box;
    for (const Eigen::Vector2f& point : corner) box.extend(point);
    const int last_x = std::min(width - 1, static_cast<int>(box.max().x()));
    const int last_y = std::min(height - 1, static_cast<int>(box.max().y()));
    for (int y = std::max(0, static_cast<int>(box.min().y())); y <= last_y; ++y) {
      for (int x = std::max(0, static_cast<int>(box.min().x())); x <= last_x; ++x) {
        const Eigen::Vector2f p =
            Eigen::Vector2f(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) - corner[0];
        const float u = (p.x() * b.y() - p.y() * b.x()) / area;
        const float v = (a.x() * p.y() - a.y() * p.x()) / area;
        if (u < 0 || v < 0 || u + v > 1) continue;
        const float here =
            (1 - u - v) * corner_depth[0] + u * corner_depth[1] + v * corner_depth[2];
        const size_t index = static_cast<size_t>(y) * width + x;
        if (here >= depth[index]) continue;
        depth[index] = here;
        opacity[index] = value;
      }
    }
  }

  int width, height;
  std::vector<float> depth, opacity;  // (height, width)
};

void draw_dot(Image& image, const Eigen::Vector2f& at, float radius) {
  const int last_x = std::min(image.width - 1, static_cast<int>(at.x() + radius + 1));
  const int last_y = std::min(image.height - 1, static_cast<int>(at.y() + radius + 1));
  for (int y = std::max(0, static_cast<int>(at.y() - radius - 1)); y <= last_y; ++y) {
    for (int x = std::max(0, static_cast<int>(at.x() - radius - 1)); x <= last_x; ++x) {
      const Eigen::Vector2f middle(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      const float cover = std::clamp(radius + 0.5f - (middle - at).norm(), 0.0f, 1.0f);
      if (cover > 0) blend(image, x, y, kBlack, cover);
    }
  }
}

}  // namespace

GuideOverlay::GuideOverlay(const std::filesystem::path& file) : guide_(read_guide_file(file)) {}

// Draws faces towards the camera like thin glass: denser where they are seen at a slant.
void GuideOverlay::draw_guide(const CameraKey& camera, Image& image) const {
  Surface surface(kSubpixels * image.width, kSubpixels * image.height);
  const auto width = static_cast<float>(surface.width), height = static_cast<float>(surface.height);
  const Vec3 origin = view_origin(camera);
  const View view = make_view(from_origin(camera, origin), width / height, kNear, kFar);
  for (const std::array<uint32_t, 3>& triangle : guide_.triangles) {
    std::array<Vec3f, 3> corner;
    for (size_t i = 0; i < 3; ++i)
      corner[i] = (guide_.vertices[triangle[i]] - origin).cast<float>();
    const Vec3f normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]).normalized();
    const Vec3f to_eye = (view.eye - corner[0]).normalized();
    const float facing = normal.dot(to_eye);
    if (!(facing > 0)) continue;
    std::array<Eigen::Vector2f, 3> at;
    std::array<float, 3> depth;
    for (size_t i = 0; i < 3; ++i) {
      depth[i] = view.depth_of(corner[i]);
      if (depth[i] > kNear) at[i] = view.project(corner[i], width, height);
    }
    if (std::ranges::min(depth) <= kNear) continue;
    const float slant = 1 - facing;
    surface.cover(at, depth, std::lerp(kFacing, kGrazing, slant * slant * slant));
  }
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      float opacity = 0;
      for (int sub = 0; sub < kSubpixels * kSubpixels; ++sub) {
        const int row = kSubpixels * y + sub / kSubpixels,
                  column = kSubpixels * x + sub % kSubpixels;
        opacity += surface.opacity[static_cast<size_t>(row) * surface.width + column];
      }
      if (opacity > 0) blend(image, x, y, kGuideColour, opacity / (kSubpixels * kSubpixels));
    }
  }
}

void GuideOverlay::draw(uint64_t index, const TrajectoryFrame& frame, const CameraKey& camera,
                        Image& image) const {
  draw_guide(camera, image);
  draw_pair_lines(guide_, guide_.glue, false, index, frame, camera, image);
  const auto after =
      std::ranges::upper_bound(guide_.constraints, index, {}, &GuideConstraints::frame);
  if (after == guide_.constraints.begin()) return;
  const auto width = static_cast<float>(image.width), height = static_cast<float>(image.height);
  const Vec3 origin = view_origin(camera);
  const View view = make_view(from_origin(camera, origin), width / height, kNear, kFar);
  for (const Vec3& place : std::prev(after)->points) {
    const Vec3f point = (place - origin).cast<float>();
    if (view.depth_of(point) <= kNear) continue;
    draw_dot(image, view.project(point, width, height), std::max(1.0f, kDot * height));
  }
}

}  // namespace pilesim
