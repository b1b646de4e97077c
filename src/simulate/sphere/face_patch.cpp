#include "simulate/sphere/face_patch.h"

#include <algorithm>
#include <cmath>

#include "simulate/sphere/sphere_constants.h"

namespace pilesim {
namespace {

using namespace sphere_constants;

// The face of `block` that points most directly against `normal`.
struct NearestFace {
  Vec3f outward;  // unit
  Vec3f middle;   // m
  int axis;       // of the box
};

NearestFace nearest_face(const PlacedBlock& block, const Vec3f& normal) {
  const Vec3f along = block.axes.transpose() * normal;
  int axis = 0;
  along.cwiseAbs().maxCoeff(&axis);
  const Vec3f outward = along[axis] > 0 ? Vec3f(-block.axes.col(axis)) : block.axes.col(axis);
  return {outward, block.centre + block.half_m[axis] * outward, axis};
}

// Extent of the face from its middle along a direction.
float reach(const PlacedBlock& block, int face, const Vec3f& direction) {
  const int i = (face + 1) % 3, j = (face + 2) % 3;
  return std::abs(block.axes.col(i).dot(direction)) * block.half_m[i] +
         std::abs(block.axes.col(j).dot(direction)) * block.half_m[j];
}

// Mean distance from the middle of a rectangle.
float mean_lever(float half_a, float half_b) { return 0.54F * std::hypot(half_a, half_b); }

}  // namespace

std::optional<BlockShape> block_shape(const TriangleMesh& mesh, double volume_m3) {
  Bounds box;
  for (const Vec3& vertex : mesh.vertices) box.extend(vertex);
  if (box.isEmpty() || volume_m3 < kBlockFill * box.volume()) return std::nullopt;
  return BlockShape{box.center().cast<float>(), (box.sizes() / 2).cast<float>()};
}

std::optional<FacePatch> patch_between(const PlacedBlock& a, const PlacedBlock& b, float reach_m) {
  const Vec3f apart = a.centre - b.centre;
  const Vec3f in_a = a.axes.transpose() * apart, in_b = b.axes.transpose() * apart;
  const Eigen::Matrix3f turn = (a.axes.transpose() * b.axes).cwiseAbs();
  const Vec3f gaps_a = in_a.cwiseAbs() - a.half_m - turn * b.half_m;
  if (gaps_a.maxCoeff() > reach_m) return std::nullopt;
  const Vec3f gaps_b = in_b.cwiseAbs() - b.half_m - turn.transpose() * a.half_m;
  if (gaps_b.maxCoeff() > reach_m) return std::nullopt;
  int of_a = 0, of_b = 0;
  const float gap_a = gaps_a.maxCoeff(&of_a), gap_b = gaps_b.maxCoeff(&of_b);
  const bool on_b = gap_b >= gap_a;  // on the plane of b's face
  const PlacedBlock &base = on_b ? b : a, &upper = on_b ? a : b;
  const int axis = on_b ? of_b : of_a;
  const float side = (on_b ? in_b : in_a)[axis];
  // From the base towards the other block.
  const Vec3f up = ((side > 0) == on_b ? 1.0F : -1.0F) * base.axes.col(axis);
  const NearestFace face = nearest_face(upper, up);
  const Vec3f to_face = face.middle - base.centre;
  FacePatch patch;
  Vec3f middle = base.centre + base.half_m[axis] * up;
  std::array<float, 2> half;
  for (size_t k = 0; k < 2; ++k) {
    const int i = (axis + 1 + static_cast<int>(k)) % 3;
    const Vec3f direction = base.axes.col(i);
    const float at = to_face.dot(direction), wide = reach(upper, face.axis, direction);
    const float low = std::max(-base.half_m[i], at - wide);
    const float high = std::min(base.half_m[i], at + wide);
    half[k] = 0.5F * (high - low);
    if (half[k] < kLeastPatch * std::min(base.half_m[i], wide)) return std::nullopt;
    middle += 0.5F * (high + low) * direction;
  }
  patch.normal = on_b ? up : Vec3f(-up);
  patch.gap_m = std::max(gap_a, gap_b);
  patch.middle = middle;
  patch.along = base.axes.col((axis + 1) % 3);
  patch.half_along_m = half[0];
  patch.half_across_m = half[1];
  // Rotation of the upper block's outward normal to -up; if that is b, a turns the other way.
  patch.tilt = (on_b ? 1.0F : -1.0F) * face.outward.cross(-up);
  patch.twist_m = mean_lever(half[0], half[1]);
  return patch;
}

FacePatch patch_on_plane(const PlacedBlock& a, const Vec3f& position, const Vec3f& normal,
                         float height_m) {
  const NearestFace face = nearest_face(a, normal);
  const int i = (face.axis + 1) % 3, j = (face.axis + 2) % 3;
  const Vec3f direction = a.axes.col(i);
  FacePatch patch;
  patch.normal = normal;
  const float below = (a.axes.transpose() * normal).cwiseAbs().dot(a.half_m);
  patch.gap_m = height_m + (a.centre - position).dot(normal) - below;
  patch.along = (direction - direction.dot(normal) * normal).normalized();
  patch.half_along_m = reach(a, face.axis, patch.along);
  patch.half_across_m = reach(a, face.axis, normal.cross(patch.along));
  const float above = height_m + (face.middle - position).dot(normal);
  patch.middle = face.middle - above * normal;
  patch.tilt = face.outward.cross(-normal);
  patch.twist_m = mean_lever(a.half_m[i], a.half_m[j]);
  return patch;
}

}  // namespace pilesim
