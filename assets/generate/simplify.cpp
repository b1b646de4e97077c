#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include "generate/polygonise.h"

namespace pilesim {
namespace {

namespace sms = CGAL::Surface_mesh_simplification;
using Point = CGAL::Simple_cartesian<double>::Point_3;
using SurfaceMesh = CGAL::Surface_mesh<Point>;

SurfaceMesh to_cgal(const TriangleMesh& mesh) {
  SurfaceMesh surface;
  for (const Vec3& vertex : mesh.vertices) {
    surface.add_vertex(Point(vertex.x(), vertex.y(), vertex.z()));
  }
  using Index = SurfaceMesh::Vertex_index;
  for (const Triangle& triangle : mesh.triangles) {
    surface.add_face(Index(triangle[0]), Index(triangle[1]), Index(triangle[2]));
  }
  return surface;
}

TriangleMesh from_cgal(SurfaceMesh& surface) {
  surface.collect_garbage();
  TriangleMesh mesh;
  for (const auto vertex : surface.vertices()) {
    const Point& point = surface.point(vertex);
    mesh.vertices.emplace_back(point.x(), point.y(), point.z());
  }
  for (const auto face : surface.faces()) {
    Triangle triangle{};
    size_t corner = 0;
    for (const auto vertex : surface.vertices_around_face(surface.halfedge(face))) {
      triangle[corner++] = static_cast<uint32_t>(vertex.idx());
    }
    mesh.triangles.push_back(triangle);
  }
  return mesh;
}

// A closed triangle mesh has three edges to every two triangles; the predicate stops below.
sms::Count_stop_predicate<SurfaceMesh> stop_at(int triangle_count) {
  return sms::Count_stop_predicate<SurfaceMesh>(static_cast<size_t>(triangle_count) * 3 / 2 + 1);
}

// Where Lindstrom and Turk put the vertex, but inside of `bounds`: at low counts their wish to keep
// the volume drives vertices out to spikes.
struct BoundedPlacement {
  sms::LindstromTurk_placement<SurfaceMesh> base;
  Bounds bounds;

  template <typename Profile>
  boost::optional<Point> operator()(const Profile& profile) const {
    const boost::optional<Point> wished = base(profile);
    if (!wished) return wished;
    const Vec3 kept =
        Vec3(wished->x(), wished->y(), wished->z()).cwiseMax(bounds.min()).cwiseMin(bounds.max());
    return Point(kept.x(), kept.y(), kept.z());
  }
};

// The lens swells space around the focus, so that the simplification finds its details large;
// `unswell` is the inverse.
double swollen_radius(double radius, const Focus& focus) {
  const double relative = radius / focus.radius_m;
  return radius * (1 + (focus.zoom - 1) * std::exp(-relative * relative));
}

Vec3 swell(const Vec3& point, const Focus& focus) {
  const double radius = (point - focus.centre).norm();
  if (radius == 0) return point;
  return focus.centre + (point - focus.centre) * (swollen_radius(radius, focus) / radius);
}

Vec3 unswell(const Vec3& point, const Focus& focus) {
  const double swollen = (point - focus.centre).norm();
  if (swollen == 0) return point;
  double low = swollen / focus.zoom;
  double high = swollen;
  for (int step = 0; step < 50; ++step) {
    const double middle = (low + high) / 2;
    (swollen_radius(middle, focus) < swollen ? low : high) = middle;
  }
  return focus.centre + (point - focus.centre) * (low / swollen);
}

}  // namespace

TriangleMesh simplify(const TriangleMesh& mesh, int triangle_count, const Focus& focus) {
  TriangleMesh lens_view = mesh;
  for (Vec3& vertex : lens_view.vertices) vertex = swell(vertex, focus);
  SurfaceMesh surface = to_cgal(lens_view);
  sms::edge_collapse(surface, stop_at(triangle_count),
                     CGAL::parameters::get_cost(sms::LindstromTurk_cost<SurfaceMesh>())
                         .get_placement(BoundedPlacement{{}, lens_view.bounds()})
                         .filter(sms::Bounded_normal_change_filter<>()));
  TriangleMesh simplified = from_cgal(surface);
  for (Vec3& vertex : simplified.vertices) vertex = unswell(vertex, focus);
  return simplified;
}

}  // namespace pilesim
