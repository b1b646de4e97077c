#include "geometry/symmetry.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "geometry/triangle_tree.h"

namespace pilesim {
namespace {

constexpr size_t kPoints = 1000;  // of vertices, and of triangles' middles
constexpr size_t kMostOutermost = 200;
constexpr int kMostFold = 12;  // of rotations about a principal axis
// Share by which moments across an axis may differ where there are more than half turns about it.
constexpr double kSameMoment = 0.05;
// Two that take the outermost point to places not farther apart than so many tolerances are one; of
// those that are beyond a quarter of it, which may be a better one that is turned a little, so
// many.
constexpr double kSameTurn = 4, kLikeTurn = 8;

struct Candidate {
  Mat3 turn;
  double error_m;
};

Mat3 turn_about(const Vec3& axis, double angle) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

// The frame of two directions, the first along x.
std::optional<Mat3> frame_of(const Vec3& a, const Vec3& b) {
  const Vec3 normal = a.cross(b);
  if (!(normal.norm() > 1e-6 * a.norm() * b.norm())) return {};
  Mat3 frame;
  frame << a.normalized(), normal.cross(a).normalized(), normal.normalized();
  return frame;
}

class SymmetrySearch {
 public:
  SymmetrySearch(const TriangleMesh& mesh, double tolerance_m)
      : mesh_(mesh), tree_(mesh), tolerance_m_(tolerance_m) {
    const auto each = [](size_t count) { return count / kPoints + 1; };
    for (size_t i = 0; i < mesh.vertices.size(); i += each(mesh.vertices.size())) {
      points_.push_back(mesh.vertices[i]);
    }
    for (size_t i = 0; i < mesh.triangles.size(); i += each(mesh.triangles.size())) {
      points_.push_back(middle(mesh.triangles[i]));
    }
    // The farthest ones first: most rotations fail there.
    std::ranges::stable_sort(points_, std::ranges::greater(),
                             [](const Vec3& point) { return point.squaredNorm(); });
  }

  Symmetries run() {
    find_principal_axes();
    Symmetries found;
    for (Eigen::Index i = 0; i < 3; ++i) {
      const Vec3 axis = axes_.col(i);
      Eigen::Index along = 0;
      axis.cwiseAbs().maxCoeff(&along);
      if (is_axis_of_rotation(axis))
        found.continuous.emplace_back(axis * (axis(along) < 0 ? -1 : 1));
    }
    if (found.continuous.size() > 1) return {{}, {Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()}};
    if (found.continuous.size() == 1) {
      try_turn(turn_about(found.continuous.front().unitOrthogonal(), kPi));
    } else {
      try_principal_turns();
      try_turns_of_vertices();
    }
    found.discrete = best_turns();
    return found;
  }

 private:
  Vec3 corner(const Triangle& triangle, size_t i) const { return mesh_.vertices[triangle[i]]; }
  Vec3 middle(const Triangle& triangle) const {
    return (corner(triangle, 0) + corner(triangle, 1) + corner(triangle, 2)) / 3;
  }

  // Axes of the surface's second moments, which do not depend on its triangles.
  void find_principal_axes() {
    Mat3 moments = Mat3::Zero();
    for (const Triangle& triangle : mesh_.triangles) {
      const Vec3 a = corner(triangle, 0), b = corner(triangle, 1), c = corner(triangle, 2);
      const Vec3 sum = a + b + c;
      moments += (b - a).cross(c - a).norm() * (a * a.transpose() + b * b.transpose() +
                                                c * c.transpose() + sum * sum.transpose());
    }
    const Eigen::SelfAdjointEigenSolver<Mat3> solver(moments);
    axes_ = solver.eigenvectors();
    moments_ = solver.eigenvalues();
  }

  // How far the surface comes out from itself at most; infinite: beyond the tolerance. A rotation
  // that takes a surface into itself takes it onto itself, so one direction is enough.
  double error_of(const Mat3& turn) const {
    const double limit_m = std::nextafter(tolerance_m_, std::numeric_limits<double>::infinity());
    double most_m = 0;
    for (const Vec3& point : points_) {
      most_m = std::max(most_m, tree_.distance(turn * point, limit_m));
      if (most_m > tolerance_m_) return std::numeric_limits<double>::infinity();
    }
    return most_m;
  }

  bool is_axis_of_rotation(const Vec3& axis) const {
    for (const double angle : {0.1, 0.27, 0.5, 0.83, 1.3, 2.2, 3.0}) {
      if (!std::isfinite(error_of(turn_about(axis, angle)))) return false;
    }
    return true;
  }

  void try_turn(const Mat3& turn) {
    const double error_m = error_of(turn);
    if (std::isfinite(error_m)) passed_.push_back({turn, error_m});
  }

  // The best of those that are nearly one.
  std::vector<Mat3> best_turns() {
    std::vector<Mat3> kept = {Mat3::Identity()};
    std::ranges::stable_sort(passed_, {}, &Candidate::error_m);
    for (const Candidate& passed : passed_) {
      const double same = (passed.error_m > tolerance_m_ / 4 ? kLikeTurn : kSameTurn) *
                          tolerance_m_ / points_.front().norm();
      const bool is_new = std::ranges::none_of(kept, [&](const Mat3& turn) {
        return Eigen::AngleAxisd(Mat3(turn.transpose() * passed.turn)).angle() < same;
      });
      if (is_new) kept.push_back(passed.turn);
    }
    kept.erase(kept.begin());
    return kept;
  }

  void try_principal_turns() {
    for (Eigen::Index i = 0; i < 3; ++i) {
      const double one = moments_((i + 1) % 3), other = moments_((i + 2) % 3);
      const bool alike = std::abs(one - other) < kSameMoment * std::max(one, other);
      for (int fold = 2; fold <= (alike ? kMostFold : 2); ++fold) {
        for (int k = 1; k < fold; ++k) try_turn(turn_about(axes_.col(i), 2 * kPi * k / fold));
      }
    }
  }

  // A rotation is known by where it takes two vertices.
  void try_turns_of_vertices() {
    const std::vector<Vec3>& vertices = mesh_.vertices;
    const Vec3 first = *std::ranges::max_element(vertices, {}, &Vec3::squaredNorm);
    const Vec3 second = *std::ranges::max_element(
        vertices, {}, [&](const Vec3& vertex) { return first.cross(vertex).squaredNorm(); });
    const std::optional<Mat3> from = frame_of(first, second);
    if (!from) return;
    std::vector<Vec3> outermost;
    std::ranges::copy_if(vertices, std::back_inserter(outermost), [&](const Vec3& vertex) {
      return vertex.norm() > first.norm() - tolerance_m_;
    });
    if (outermost.size() > kMostOutermost) return;
    const double apart_m = (first - second).norm();
    for (const Vec3& image : outermost) {
      for (const Vec3& other : vertices) {
        if (std::abs(other.norm() - second.norm()) > tolerance_m_ ||
            std::abs((image - other).norm() - apart_m) > 2 * tolerance_m_) {
          continue;
        }
        if (const std::optional<Mat3> to = frame_of(image, other)) {
          try_turn(*to * from->transpose());
        }
      }
    }
  }

  const TriangleMesh& mesh_;
  TriangleTree tree_;
  double tolerance_m_;
  std::vector<Vec3> points_;
  Mat3 axes_;  // columns
  Vec3 moments_;
  std::vector<Candidate> passed_;
};

}  // namespace

Symmetries find_symmetries(const TriangleMesh& mesh, double tolerance_m) {
  return SymmetrySearch(mesh, tolerance_m).run();
}

}  // namespace pilesim
