// A camera as OpenCV has it: what is written to cameras.json and by which pixels find their rays.
#pragma once

#include "core/types.h"
#include "scene/scene.h"

namespace pilesim {

// Camera frame: x right, y down, z forward along the optical axis. A point p of the world (m) is at
// q = rotation p + translation there, and in the picture at column fx q.x / q.z + cx and row
// fy q.y / q.z + cy, in pixels from the middle of the upper left pixel: (0, 0) is that middle, and
// the picture ends half a pixel further out.
struct Pinhole {
  int width = 0, height = 0;         // pixels
  double fx = 1, fy = 1;             // pixels
  double cx = 0, cy = 0;             // pixels
  Mat3 rotation = Mat3::Identity();  // world to camera
  Vec3 translation = Vec3::Zero();   // m

  Vec3 eye() const { return -(rotation.transpose() * translation); }
  Vec3 in_camera(const Vec3& world) const { return rotation * world + translation; }
  // Column and row of a point in the camera frame, z > 0.
  Eigen::Vector2d project(const Vec3& in_camera) const {
    return {fx * in_camera.x() / in_camera.z() + cx, fy * in_camera.y() / in_camera.z() + cy};
  }
  // Camera frame, with z = 1.
  Vec3 ray(double column, double row) const { return {(column - cx) / fx, (row - cy) / fy, 1}; }
};

// The view of a camera of the scene in a picture of width x height pixels; pixels are square.
Pinhole make_pinhole(const CameraKey& camera, int width, int height);

// For depth in 16 bits: 1, 2 or 5 times a power of ten of a millimetre, the finest that reaches
// four times as far as from the camera to what it looks at.
double depth_unit_mm(const CameraKey& camera);

}  // namespace pilesim
