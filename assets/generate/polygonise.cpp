#include "generate/polygonise.h"

#include <limits>

#include "core/parallel_for.h"

namespace pilesim {
namespace {

constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();

// Each cube is cut into six tetrahedra along the paths of its edges from corner 000 to corner 111,
// so that neighbouring cubes agree on their common faces and the surface comes out closed.
constexpr int kPaths[6][2] = {{1, 3}, {1, 5}, {2, 3}, {2, 6}, {4, 5}, {4, 6}};

class Marcher {
 public:
  Marcher(const Field& field, const Bounds& region, double cell_m)
      : field_(field), origin_(region.min()), cell_m_(cell_m) {
    for (int axis = 0; axis < 3; ++axis) {
      size_[axis] = static_cast<int>(std::ceil(region.sizes()[axis] / cell_m)) + 1;
    }
    values_.resize(static_cast<size_t>(size_[0]) * size_[1] * size_[2]);
    edge_vertices_.assign(values_.size() * 7, kNone);
  }

  TriangleMesh march() {
    parallel_for(values_.size(), 4096, [this](size_t begin, size_t end) {
      for (size_t index = begin; index < end; ++index) values_[index] = field_(point(index));
    });
    for (int z = 0; z + 1 < size_[2]; ++z) {
      for (int y = 0; y + 1 < size_[1]; ++y) {
        for (int x = 0; x + 1 < size_[0]; ++x) march_cube(index_of(x, y, z));
      }
    }
    return std::move(mesh_);
  }

 private:
  size_t index_of(int x, int y, int z) const {
    return (static_cast<size_t>(z) * size_[1] + y) * size_[0] + x;
  }
  // Grid index of a corner of the cube at `cube`; bits 0, 1, 2 of `corner` step along x, y, z.
  size_t corner_index(size_t cube, int corner) const {
    return cube + index_of(corner & 1, (corner >> 1) & 1, corner >> 2);
  }
  Vec3 point(size_t index) const {
    const size_t row = index / size_[0];
    return origin_ + cell_m_ * Vec3(static_cast<double>(index % size_[0]),
                                    static_cast<double>(row % size_[1]),
                                    static_cast<double>(row / size_[1]));
  }

  void march_cube(size_t cube) {
    int inside = 0;
    for (int corner = 0; corner < 8; ++corner) inside += values_[corner_index(cube, corner)] < 0;
    if (inside == 0 || inside == 8) return;
    for (const auto& path : kPaths) march_tetrahedron(cube, {0, path[0], path[1], 7});
  }

  void march_tetrahedron(size_t cube, const std::array<int, 4>& corners) {
    std::array<int, 4> inside{};
    std::array<int, 4> outside{};
    int inside_count = 0;
    int outside_count = 0;
    for (const int corner : corners) {
      if (values_[corner_index(cube, corner)] < 0) {
        inside[inside_count++] = corner;
      } else {
        outside[outside_count++] = corner;
      }
    }
    if (inside_count == 0 || outside_count == 0) return;
    const Vec3 outward =
        point(corner_index(cube, outside[0])) - point(corner_index(cube, inside[0]));
    const auto vertex = [&](int in, int out) {
      return edge_vertex(cube, inside[in], outside[out]);
    };
    if (inside_count == 1) {
      add(vertex(0, 0), vertex(0, 1), vertex(0, 2), outward);
    } else if (outside_count == 1) {
      add(vertex(0, 0), vertex(1, 0), vertex(2, 0), outward);
    } else {
      add(vertex(0, 0), vertex(0, 1), vertex(1, 1), outward);
      add(vertex(0, 0), vertex(1, 1), vertex(1, 0), outward);
    }
  }

  // `outward` leads from a corner inside to one outside.
  void add(uint32_t a, uint32_t b, uint32_t c, const Vec3& outward) {
    const auto& v = mesh_.vertices;
    const bool faces_out = (v[b] - v[a]).cross(v[c] - v[a]).dot(outward) > 0;
    mesh_.triangles.push_back(faces_out ? Triangle{a, b, c} : Triangle{a, c, b});
  }

  // The crossing on the edge between two corners, shared by all tetrahedra around the edge.
  uint32_t edge_vertex(size_t cube, int inside, int outside) {
    const size_t lower = corner_index(cube, inside & outside);
    const int direction = inside ^ outside;
    uint32_t& vertex = edge_vertices_[lower * 7 + direction - 1];
    if (vertex == kNone) {
      vertex = static_cast<uint32_t>(mesh_.vertices.size());
      mesh_.vertices.push_back(
          crossing(point(corner_index(cube, inside)), point(corner_index(cube, outside))));
    }
    return vertex;
  }

  Vec3 crossing(const Vec3& inside, const Vec3& outside) const {
    double low = 0;
    double high = 1;
    for (int step = 0; step < 10; ++step) {
      const double middle = (low + high) / 2;
      (field_(inside + middle * (outside - inside)) < 0 ? low : high) = middle;
    }
    // Kept off the grid points, where triangles would shrink to nothing.
    return inside + std::clamp((low + high) / 2, 0.03, 0.97) * (outside - inside);
  }

  const Field& field_;
  Vec3 origin_;
  double cell_m_;
  std::array<int, 3> size_{};
  std::vector<double> values_;           // of each grid point, x fastest
  std::vector<uint32_t> edge_vertices_;  // of each grid point and each of the 7 edges up from it
  TriangleMesh mesh_;
};

}  // namespace

TriangleMesh polygonise(const Field& field, const Bounds& region, double cell_m) {
  return Marcher(field, region, cell_m).march();
}

}  // namespace pilesim
