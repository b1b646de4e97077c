#include "render/pose_sheet.h"

#include <algorithm>
#include <cassert>

#include "core/rotation.h"
#include "render/image_output.h"

namespace pilesim {
namespace {

constexpr int kWidth = 360, kHeight = 300;  // pixels of a picture
constexpr int kColumns = 4;
constexpr std::array<uint8_t, 3> kBodyColour = {214, 158, 96}, kPlaneColour = {200, 200, 200};
const Vec3 kViewDirection = Vec3(0.55, 0.5, 1).normalized();
constexpr double kFieldOfView = radians(28);

// The body, and the plane under it.
TrajectoryHeader header_of(const TriangleMesh& mesh, const Vec3& centre_of_mass) {
  TrajectoryHeader header;
  TrajectoryShape& body = header.shapes.emplace_back();
  for (const Vec3& v : mesh.vertices) {
    body.vertices.push_back((v - centre_of_mass).cast<float>());
  }
  body.triangles = mesh.triangles;
  header.shapes.push_back({.name = "plane", .is_plane = true, .vertices = {}, .triangles = {}});
  header.body_name = {"body", "plane"};
  header.body_shape = {0, 1};
  header.body_colour = {kBodyColour, kPlaneColour};
  header.body_moves = {1, 0};
  return header;
}

}  // namespace

Image draw_pose_sheet(const TriangleMesh& mesh, const Vec3& centre_of_mass,
                      std::span<const LabelledPose> poses) {
  assert(!poses.empty());
  const TrajectoryHeader header = header_of(mesh, centre_of_mass);
  float radius = 0;
  for (const Vec3f& v : header.shapes[0].vertices) radius = std::max(radius, v.norm());
  SceneRenderer renderer(header, {.size = {kWidth, kHeight}});
  // The same for all poses, so that they compare.
  const double distance = 1.15 * radius / std::sin(kFieldOfView / 2);
  TrajectoryFrame frame{.position = {Vec3::Zero(), Vec3::Zero()},
                        .orientation = {Quatf::Identity(), Quatf::Identity()},
                        .state = {kPresent, kPresent}};
  std::vector<Image> pictures;
  std::vector<std::string> labels;
  for (const LabelledPose& pose : poses) {
    const Vec3 centre(0, pose.height_m, 0);
    frame.position[0] = centre;
    frame.orientation[0] = rotation_between(pose.up, Vec3::UnitY()).cast<float>();
    pictures.push_back(renderer.draw(frame, {.position = centre + distance * kViewDirection,
                                             .target = centre,
                                             .field_of_view = kFieldOfView}));
    labels.push_back(pose.label);
  }
  return contact_sheet(pictures, labels, std::min(kColumns, static_cast<int>(poses.size())));
}

}  // namespace pilesim
