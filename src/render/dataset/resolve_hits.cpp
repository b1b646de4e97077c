#include "render/dataset/resolve_hits.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel_for.h"
#include "geometry/round_crossings.h"

namespace pilesim {
namespace {

constexpr float kNothing = std::numeric_limits<float>::quiet_NaN();

Quat rotation_of(const TrajectoryFrame& frame, size_t body) {
  return frame.orientation[body].cast<double>().normalized();
}

// In the camera frame.
struct CameraPlane {
  size_t body;
  Vec3 normal;    // unit, towards the camera
  double offset;  // normal . p there, < 0
};

// Those that show their upper side.
std::vector<CameraPlane> planes_in_view(const TrajectoryHeader& header, const Moment& now) {
  std::vector<CameraPlane> planes;
  for (size_t body = 0; body < header.body_count(); ++body) {
    if (!header.shapes[header.body_shape[body]].is_plane) continue;
    if ((now.frame.state[body] & kPresent) == 0) continue;
    const Vec3 normal = now.camera.rotation * (rotation_of(now.frame, body) * Vec3::UnitY());
    const double offset = normal.dot(now.camera.in_camera(now.frame.position[body]));
    if (offset < 0) planes.push_back({body, normal, offset});
  }
  return planes;
}

// A point of a surface on a pixel's ray, camera frame.
struct Surface {
  double depth_m = std::numeric_limits<double>::infinity();
  Vec3 normal = Vec3::Zero();  // unit, towards the camera
};

Surface on_triangle(const TrajectoryShape& shape, uint32_t triangle, const Mat3& rotation,
                    const Vec3& place, const Vec3& ray) {
  std::array<Vec3, 3> corner;
  for (size_t k = 0; k < 3; ++k) {
    const Vec3f& vertex = shape.vertices[shape.triangles[triangle][k]];
    corner[k] = rotation * vertex.cast<double>() + place;
  }
  const Vec3 across = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
  const auto [near, far] = std::minmax({corner[0].z(), corner[1].z(), corner[2].z()});
  const double slope = across.dot(ray);
  // Whoever found the triangle may round its edges to a part of a pixel: one that is seen nearly
  // edge-on keeps to where it is.
  const double depth = std::clamp(across.dot(corner[0]) / slope, std::max(near, 0.0), far);
  const Vec3 normal = across.normalized();
  return {std::isfinite(depth) ? depth : far, slope > 0 ? Vec3(-normal) : normal};
}

// `rotation`, `place`: the body in the camera frame. `depth_m`: about what comes out.
Surface on_round(const RoundSurface& round, const Mat3& rotation, const Vec3& place,
                 const Vec3& ray, double depth_m) {
  const Vec3 origin = -(rotation.transpose() * place), direction = rotation.transpose() * ray;
  // Where the ray only grazes it, whoever found it may round to the other side.
  double nearest = depth_m, off = std::numeric_limits<double>::infinity();
  for (const double distance : crossings(round, origin, direction)) {
    if (std::abs(distance - depth_m) >= off) continue;
    off = std::abs(distance - depth_m);
    nearest = distance;
  }
  const Vec3 normal = rotation * outward_normal(round, origin + nearest * direction);
  return {nearest, normal.dot(ray) > 0 ? Vec3(-normal) : normal};
}

// A body's pose in the camera frame, and in the next one.
class Resolver {
 public:
  Resolver(const TrajectoryHeader& header, const Moment& now, const Moment* next)
      : header_(header), now_(now), next_(next), planes_(planes_in_view(header, now)) {
    if (next_ != nullptr) {
      camera_stands_ = now.camera.rotation == next->camera.rotation &&
                       now.camera.translation == next->camera.translation &&
                       now.camera.fx == next->camera.fx && now.camera.fy == next->camera.fy &&
                       now.camera.cx == next->camera.cx && now.camera.cy == next->camera.cy;
    }
  }

  void resolve(size_t at, int column, int row, SurfaceHits& hits, PassImages& images) const {
    const Vec3 ray = now_.camera.ray(column, row);
    uint32_t& instance = hits.instance[at];
    Surface surface;
    if (instance != kNoInstance && shape_of(instance - 1).is_plane) instance = kNoInstance;
    if (instance != kNoInstance)
      surface = on_body(instance - 1, hits.triangle[at], ray, hits.depth[at]);
    for (const CameraPlane& plane : planes_) {
      const double slope = plane.normal.dot(ray);
      if (slope >= 0 || plane.offset / slope >= surface.depth_m) continue;
      surface = {plane.offset / slope, plane.normal};
      instance = static_cast<uint32_t>(plane.body + 1);
      hits.triangle[at] = 0;
    }
    images.instance[at] = instance;
    images.shape[at] = instance == kNoInstance ? 0 : header_.body_shape[instance - 1] + 1;
    images.depth[at] = static_cast<float>(surface.depth_m);
    for (int i = 0; i < 3; ++i) {
      images.normal[3 * at + static_cast<size_t>(i)] = static_cast<float>(surface.normal[i]);
    }
    const std::array<float, 2> motion =
        instance == kNoInstance ? std::array{kNothing, kNothing}
                                : motion_of(instance - 1, surface.depth_m * ray, column, row);
    std::copy(motion.begin(), motion.end(), images.motion.begin() + static_cast<ptrdiff_t>(2 * at));
  }

 private:
  const TrajectoryShape& shape_of(size_t body) const {
    return header_.shapes[header_.body_shape[body]];
  }

  Surface on_body(size_t body, uint32_t triangle, const Vec3& ray, double depth_m) const {
    const Mat3 rotation = now_.camera.rotation * rotation_of(now_.frame, body).toRotationMatrix();
    const Vec3 place = now_.camera.in_camera(now_.frame.position[body]);
    const TrajectoryShape& shape = shape_of(body);
    const size_t flat = shape.triangles.size();
    return triangle < flat ? on_triangle(shape, triangle, rotation, place, ray)
                           : on_round(shape.round[triangle - flat], rotation, place, ray, depth_m);
  }

  // Motion of the body's point that is at `seen` in the camera frame.
  std::array<float, 2> motion_of(size_t body, const Vec3& seen, int column, int row) const {
    if (next_ == nullptr || (next_->frame.state[body] & kPresent) == 0) {
      return {kNothing, kNothing};
    }
    if (camera_stands_ && now_.frame.position[body] == next_->frame.position[body] &&
        now_.frame.orientation[body].coeffs() == next_->frame.orientation[body].coeffs()) {
      return {0, 0};
    }
    const Vec3 world = now_.camera.rotation.transpose() * (seen - now_.camera.translation);
    const Vec3 local =
        rotation_of(now_.frame, body).conjugate() * (world - now_.frame.position[body]);
    const Vec3 later = next_->camera.in_camera(rotation_of(next_->frame, body) * local +
                                               next_->frame.position[body]);
    if (later.z() <= 0) return {kNothing, kNothing};
    const Eigen::Vector2d moved = next_->camera.project(later) - Eigen::Vector2d(column, row);
    return {static_cast<float>(moved.x()), static_cast<float>(moved.y())};
  }

  const TrajectoryHeader& header_;
  const Moment now_;
  const Moment* next_;
  bool camera_stands_ = false;
  std::vector<CameraPlane> planes_;
};

void resize(PassImages& images, int width, int height) {
  const auto pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  images.width = width;
  images.height = height;
  images.depth.resize(pixels);
  images.instance.resize(pixels);
  images.shape.resize(pixels);
  images.normal.resize(3 * pixels);
  images.motion.resize(2 * pixels);
}

// The smallest box that holds both; an empty one holds nothing.
PixelBox with_pixel(const PixelBox& box, int column, int row) {
  if (box.width == 0) return {column, row, 1, 1};
  const int left = std::min(box.column, column);
  const int top = std::min(box.row, row);
  return {left, top, std::max(box.column + box.width, column + 1) - left,
          std::max(box.row + box.height, row + 1) - top};
}

void count_visible(const PassImages& images, std::vector<BodyVisibility>& bodies) {
  for (int row = 0; row < images.height; ++row) {
    for (int column = 0; column < images.width; ++column) {
      const uint32_t instance =
          images.instance[static_cast<size_t>(row) * static_cast<size_t>(images.width) +
                          static_cast<size_t>(column)];
      if (instance == kNoInstance) continue;
      BodyVisibility& body = bodies[instance - 1];
      ++body.visible_pixels;
      body.visible_box = with_pixel(body.visible_box, column, row);
    }
  }
}

void count_alone(const Silhouette& alone, int width, int height, BodyVisibility& body) {
  size_t at = 0;
  for (int row = alone.box.row; row < alone.box.row + alone.box.height; ++row) {
    for (int column = alone.box.column; column < alone.box.column + alone.box.width; ++column) {
      if (alone.covered[at++] == 0) continue;
      ++body.pixels_alone;
      body.alone_box = with_pixel(body.alone_box, column, row);
      if (column >= 0 && column < width && row >= 0 && row < height) ++body.pixels_inside;
    }
  }
}

}  // namespace

void resolve_hits(const TrajectoryHeader& header, const Moment& now, const Moment* next,
                  SurfaceHits& hits, PassImages& images) {
  resize(images, hits.width, hits.height);
  const Resolver resolver(header, now, next);
  const auto width = static_cast<size_t>(hits.width);
  parallel_for(static_cast<size_t>(hits.height), 8, [&](size_t begin, size_t end) {
    for (size_t at = begin * width; at < end * width; ++at) {
      resolver.resolve(at, static_cast<int>(at % width), static_cast<int>(at / width), hits,
                       images);
    }
  });
}

void find_visibility(const TrajectoryHeader& header, const TrajectoryFrame& frame,
                     RayHits& renderer, PassImages& images, const TakeSilhouette& take) {
  std::vector<BodyVisibility> bodies(header.body_count());
  count_visible(images, bodies);
  images.visibility.clear();
  Silhouette alone;
  for (size_t i = 0; i < bodies.size(); ++i) {
    BodyVisibility& body = bodies[i];
    body.instance = static_cast<uint32_t>(i + 1);
    body.shape = header.body_shape[i] + 1;
    if (header.shapes[header.body_shape[i]].is_plane || (frame.state[i] & kPresent) == 0) continue;
    renderer.outline(i, alone);
    count_alone(alone, images.width, images.height, body);
    if (body.pixels_inside == 0) continue;
    images.visibility.push_back(body);
    if (take) take(i, alone);
  }
}

}  // namespace pilesim
