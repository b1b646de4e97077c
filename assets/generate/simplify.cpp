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

}  // namespace

TriangleMesh simplify(const TriangleMesh& mesh, int triangle_count) {
  SurfaceMesh surface = to_cgal(mesh);
  // A closed triangle mesh has three edges to every two triangles; the predicate stops below.
  const sms::Count_stop_predicate<SurfaceMesh> stop(static_cast<size_t>(triangle_count) * 3 / 2 +
                                                    1);
  using Placement = sms::LindstromTurk_placement<SurfaceMesh>;
  sms::edge_collapse(surface, stop,
                     CGAL::parameters::get_cost(sms::LindstromTurk_cost<SurfaceMesh>())
                         .get_placement(Placement())
                         .filter(sms::Bounded_normal_change_filter<>()));
  return from_cgal(surface);
}

}  // namespace pilesim
