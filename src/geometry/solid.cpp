#include "geometry/solid.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>

#include "core/counted.h"
#include "core/disjoint_sets.h"
#include "core/error.h"
#include "geometry/convex_decomposition.h"
#include "geometry/convex_hull.h"
#include "geometry/half_edges.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_repair.h"
#include "geometry/solid_cache.h"
#include "geometry/surface_distance.h"
#include "geometry/wrap.h"

namespace pilesim {
namespace {

constexpr int kMostCells = 384;
// A sheet's thickness is at least so many cells.
constexpr double kCellsOfThickness = 2.5;
// A mesh encloses nothing if its mean thickness is below this share of its length.
constexpr double kFlat = 1e-6;
// A wrap that closes more than this share of itself where there are no triangles, or that leaves so
// much of the mesh outside, is a guess.
constexpr double kMostClosing = 0.03;
constexpr double kMostLost = 0.02;

constexpr char kExpected[] = "a closed mesh with outward triangles";
constexpr char kWays[] = R"("solid": "wrap" takes what it encloses, "hull" its convex hull)";

std::string metres(double length) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g m", length);
  return text;
}

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, share < 0.0995 ? "%.2g %%" : "%.0f %%", 100 * share);
  return text;
}

// Connected pieces of surface that enclose something, and those that do not: they are open, or
// closed and flat, front and back.
struct Parts {
  TriangleMesh closed, open;
};

Parts parts_of(const TriangleMesh& mesh) {
  DisjointSets sets;
  sets.reset(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    sets.unite(a, b);
    sets.unite(a, c);
  }
  std::vector<uint8_t> is_open(mesh.vertices.size(), 0);
  const HalfEdges sides(mesh.triangles, mesh.vertices.size());
  sides.for_each_edge([&](std::span<const HalfEdge> edge) {
    if (edge.size() == 1) is_open[sets.find(edge[0].low)] = 1;
  });
  const double longest = mesh.bounds().sizes().maxCoeff();
  std::vector<double> volume(mesh.vertices.size(), 0), area(mesh.vertices.size(), 0);
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3& corner = mesh.vertices[a];
    const Vec3 twice = (mesh.vertices[b] - corner).cross(mesh.vertices[c] - corner);
    const uint32_t part = sets.find(a);
    volume[part] += twice.dot(corner - mesh.vertices[part]) / 6;
    area[part] += twice.norm() / 2;
  }
  for (size_t part = 0; part < volume.size(); ++part) {
    if (std::abs(volume[part]) < kFlat * longest * area[part] / 2) is_open[part] = 1;
  }
  Parts parts;
  parts.closed.vertices = parts.open.vertices = mesh.vertices;
  for (const Triangle& triangle : mesh.triangles) {
    (is_open[sets.find(triangle[0])] ? parts.open : parts.closed).triangles.push_back(triangle);
  }
  return parts;
}

[[noreturn]] void refuse(const std::vector<MeshDefect>& defects, std::string remedy) {
  std::vector<Problem> problems;
  for (const MeshDefect& defect : defects) {
    problems.push_back({.found = defect.text, .expected = kExpected});
  }
  problems.back().remedy = std::move(remedy);
  throw Error(ErrorKind::input, std::move(problems));
}

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
  return text;
}

Solid hull_of(const TriangleMesh& mesh, int most_vertices) {
  Solid solid{.mesh = simplified_hull(mesh.vertices, most_vertices), .way = SolidWay::hull};
  solid.note = "its hull, of " + counted(solid.mesh.vertices.size(), "vertex", "vertices") +
               ", in place of the mesh";
  return solid;
}

[[noreturn]] void refuse_sheets(const std::vector<MeshDefect>& defects, double lost_share) {
  refuse(defects, percent(lost_share) +
                      " of its surface encloses nothing: it is made of sheets. Give them a "
                      "thickness (\"thickness_m\"), or \"solid\": \"hull\" takes its convex hull");
}

Solid wrap_of(const TriangleMesh& mesh, const Repair& repair,
              const std::vector<MeshDefect>& defects, const SolidOptions& options) {
  TriangleMesh enclosing = repair.mesh, sheets;
  const bool is_flat = enclosing.triangles.empty();  // all of it was there twice
  if (options.thickness_m > 0) {
    Parts parts = is_flat ? Parts{.open = mesh} : parts_of(repair.mesh);
    enclosing = std::move(parts.closed);
    sheets = std::move(parts.open);
  } else if (is_flat) {
    refuse_sheets(defects, 1);
  }
  WrapOptions grid{.cells = options.cells, .thickness_m = options.thickness_m};
  if (!sheets.triangles.empty()) {
    const double longest = repair.mesh.bounds().sizes().maxCoeff() + options.thickness_m;
    grid.cells =
        std::max(options.cells,
                 static_cast<int>(std::ceil(kCellsOfThickness * longest / options.thickness_m)));
    if (grid.cells > kMostCells) {
      throw Error(
          ErrorKind::input,
          Problem{.found = "a thickness of " + metres(options.thickness_m) +
                           " is too little for a thing " + metres(longest) + " long",
                  .expected = "at least " + metres(kCellsOfThickness * longest / kMostCells)});
    }
  }
  Wrap wrap = wrap_mesh(enclosing, sheets, grid);
  const bool may_guess = options.rule == SolidRule::wrap;
  // Parts finer than the grid get a finer grid.
  while (wrap.lost_share > kMostLost && 2 * grid.cells <= kMostCells) {
    grid.cells *= 2;
    wrap = wrap_mesh(enclosing, sheets, grid);
  }
  if (wrap.mesh.triangles.empty() || (!may_guess && wrap.lost_share > kMostLost)) {
    refuse_sheets(defects, wrap.lost_share);
  }
  if (!may_guess && wrap.closing_share > kMostClosing) {
    refuse(defects,
           "It is open wide" +
               (repair.largest_opening_m > 0 ? " (" + metres(repair.largest_opening_m) + " across)"
                                             : std::string()) +
               ": if it is a sheet, give it a thickness (\"thickness_m\"); " + kWays);
  }
  Solid solid{.mesh = std::move(wrap.mesh), .way = SolidWay::wrapped};
  solid.note = "wrapped with cells of " + metres(wrap.cell_m) + ", at most " +
               metres(wrap.distance_m) + " from the mesh";
  if (wrap.closing_share > 0)
    solid.note += ", " + percent(wrap.closing_share) + " of it closes openings";
  if (!sheets.triangles.empty()) solid.note += ", sheets " + metres(options.thickness_m) + " thick";
  if (wrap.lost_share > 0) solid.note += ", " + percent(wrap.lost_share) + " of the mesh left out";
  solid.note += " (" + defects.front().text + ')';
  return solid;
}

Solid computed_solid(const TriangleMesh& mesh, const SolidOptions& options) {
  const std::vector<MeshDefect> defects = find_mesh_defects(mesh);
  const bool is_empty = !defects.empty() && defects.front().kind == MeshDefectKind::empty;
  if (is_empty) refuse(defects, "");
  if (options.rule == SolidRule::hull) return hull_of(mesh, options.hull_max_vertices);
  const bool is_proper = defects.empty() || !convex_groups(mesh).empty();
  if (is_proper && options.rule != SolidRule::wrap) return {.mesh = mesh};
  if (options.rule == SolidRule::exact) {
    refuse(defects, std::string("Mend it, or leave \"solid\" at \"auto\"; ") + kWays);
  }
  const Repair repair = repair_mesh(mesh);
  if (options.rule == SolidRule::automatic && !repair.done.empty() &&
      !repair.mesh.triangles.empty() && find_mesh_defects(repair.mesh).empty()) {
    return {.mesh = repair.mesh, .way = SolidWay::repaired, .note = joined(repair.done)};
  }
  const std::vector<MeshDefect> closed = {{MeshDefectKind::empty, 0, "as asked"}};
  return wrap_of(mesh, repair, defects.empty() ? closed : defects, options);
}

}  // namespace

Solid make_solid(const TriangleMesh& mesh, const SolidOptions& options,
                 const std::optional<std::filesystem::path>& cache_directory) {
  if (!cache_directory) return computed_solid(mesh, options);
  const SolidCache cache(*cache_directory, mesh, options);
  if (std::optional<Solid> stored = cache.load()) return std::move(*stored);
  Solid solid = computed_solid(mesh, options);
  if (solid.way == SolidWay::repaired || solid.way == SolidWay::wrapped) cache.store(solid);
  return solid;
}

}  // namespace pilesim
