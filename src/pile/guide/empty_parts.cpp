#include "pile/guide/empty_parts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <queue>

#include "core/parallel_for.h"
#include "core/text.h"
#include "geometry/triangle_tree.h"
#include "pile/guide/cell_grid.h"
#include "pile/guide/guide_constants.h"
#include "pile/guide/obstacle.h"
#include "pile/guide/room.h"

namespace pilesim {
namespace {

using namespace guide_constants;

constexpr double kMostCells = 4e5;
constexpr size_t kGrain = 1024;
constexpr uint32_t kNoPart = std::numeric_limits<uint32_t>::max();

// The guide's box divided into cells, addressed by index.
class Cells {
 public:
  Cells(const Scene& scene, const Model& model, double cell_m);

  size_t size() const { return wall_m_.size(); }
  double cell_m() const { return grid_.cell_m; }
  // Distance from its centre to the walls, m; < 0: outside or occupied.
  double wall_m(size_t cell) const { return wall_m_[cell]; }
  bool is_inside(size_t cell) const { return wall_m_[cell] >= 0; }
  Vec3 middle_of(size_t cell) const { return grid_.middle_of(cell); }
  size_t cell_of(const Vec3& point) const { return grid_.cell_of(point); }
  // Calls of(neighbour, distance in cells) for the inside cells among its 26 neighbours.
  template <typename Visit>
  void around(size_t cell, const Visit& of) const;
  // Numbers the connected sets of cells that satisfy `is_in`; other cells get kNoPart.
  template <typename IsIn>
  std::vector<uint32_t> components(const IsIn& is_in, uint32_t& count) const;

 private:
  CellGrid grid_;
  std::vector<double> wall_m_;
};

Cells::Cells(const Scene& scene, const Model& model, double cell_m)
    : grid_(model.guide.bounds(), cell_m, kMostCells), wall_m_(grid_.size(), -1) {
  const std::vector<uint8_t> inside = grid_.inside(model.guide, 0);
  const TriangleTree surface(model.guide);
  const Vec3 up = -scene.gravity.normalized();
  std::vector<Obstacle> obstacles;
  for (const ModelBody& body : model.bodies) {
    if (!stands_still(body)) continue;
    obstacles.emplace_back(model.shapes[body.shape], body.pose, model.guide, up);
  }
  parallel_for(wall_m_.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Vec3 middle = middle_of(i);
      const bool is_free =
          inside[i] != 0 && std::ranges::none_of(obstacles, [&](const Obstacle& one) {
            return one.is_at(middle, 0);
          });
      if (is_free) wall_m_[i] = surface.distance(middle);
    }
  });
}

template <typename Visit>
void Cells::around(size_t cell, const Visit& of) const {
  const std::array<size_t, 3>& count = grid_.count;
  const auto x = static_cast<int64_t>(cell % count[0]),
             y = static_cast<int64_t>(cell / count[0] % count[1]),
             z = static_cast<int64_t>(cell / (count[0] * count[1]));
  for (int64_t k = std::max<int64_t>(0, z - 1); k <= z + 1; ++k) {
    for (int64_t j = std::max<int64_t>(0, y - 1); j <= y + 1; ++j) {
      for (int64_t i = std::max<int64_t>(0, x - 1); i <= x + 1; ++i) {
        if (i >= static_cast<int64_t>(count[0]) || j >= static_cast<int64_t>(count[1]) ||
            k >= static_cast<int64_t>(count[2])) {
          continue;
        }
        const size_t other =
            static_cast<size_t>(i) +
            count[0] * (static_cast<size_t>(j) + count[1] * static_cast<size_t>(k));
        const auto steps = std::abs(i - x) + std::abs(j - y) + std::abs(k - z);
        if (steps == 0 || !is_inside(other)) continue;
        of(other, std::sqrt(static_cast<double>(steps)));
      }
    }
  }
}

template <typename IsIn>
std::vector<uint32_t> Cells::components(const IsIn& is_in, uint32_t& count) const {
  std::vector<uint32_t> part(size(), kNoPart);
  std::vector<size_t> open;
  count = 0;
  for (size_t seed = 0; seed < size(); ++seed) {
    if (part[seed] != kNoPart || !is_in(seed)) continue;
    part[seed] = count;
    open.push_back(seed);
    while (!open.empty()) {
      const size_t cell = open.back();
      open.pop_back();
      around(cell, [&](size_t other, double) {
        if (part[other] != kNoPart || !is_in(other)) return;
        part[other] = count;
        open.push_back(other);
      });
    }
    ++count;
  }
  return part;
}

// Distance (m) within the guide from each cell to the nearest marked one; infinite where none is
// reachable.
std::vector<double> distance_to_marked(const Cells& cells, const std::vector<uint8_t>& marked) {
  using Step = std::pair<double, size_t>;
  std::vector<double> way(cells.size(), std::numeric_limits<double>::infinity());
  std::priority_queue<Step, std::vector<Step>, std::greater<>> open;
  for (size_t cell = 0; cell < cells.size(); ++cell) {
    if (marked[cell] == 0) continue;
    way[cell] = 0;
    open.emplace(0, cell);
  }
  while (!open.empty()) {
    const double so_far = open.top().first;
    const size_t cell = open.top().second;
    open.pop();
    if (so_far > way[cell]) continue;
    cells.around(cell, [&](size_t other, double step) {
      const double there = so_far + step * cells.cell_m();
      if (there >= way[other]) return;
      way[other] = there;
      open.emplace(there, other);
    });
  }
  return way;
}

// By cell: the widest bottleneck of all paths from the lowest cells of its part, as a distance to
// the walls, m.
std::vector<double> reach_from_base(const Cells& cells, const Vec3& up) {
  using Step = std::pair<double, size_t>;
  double base_m = std::numeric_limits<double>::infinity();
  for (size_t cell = 0; cell < cells.size(); ++cell) {
    if (cells.is_inside(cell)) base_m = std::min(base_m, cells.middle_of(cell).dot(up));
  }
  std::vector<double> reach(cells.size(), 0);
  std::priority_queue<Step> open;
  for (size_t cell = 0; cell < cells.size(); ++cell) {
    if (!cells.is_inside(cell) || cells.middle_of(cell).dot(up) > base_m + cells.cell_m() / 2) {
      continue;
    }
    reach[cell] = std::numeric_limits<double>::infinity();  // the base is open
    open.emplace(reach[cell], cell);
  }
  while (!open.empty()) {
    const double so_far = open.top().first;
    const size_t cell = open.top().second;
    open.pop();
    if (so_far < reach[cell]) continue;
    cells.around(cell, [&](size_t other, double) {
      const double there = std::min(so_far, cells.wall_m(other));
      if (there <= reach[other]) return;
      reach[other] = there;
      open.emplace(there, other);
    });
  }
  return reach;
}

struct Found {
  EmptyParts told;
  std::vector<std::vector<size_t>> cells;  // of each reported part
};

std::string metres(double length_m) { return with_digits(length_m, 2) + " m"; }

std::string range(const char* axis, double from, double to) {
  // Round to a tenth of a millimetre, and avoid "-0".
  const auto rounded = [](double value) { return std::round(1e4 * value) / 1e4 + 0.0; };
  return std::string(axis) + ' ' + with_digits(rounded(from), 3) + " to " +
         with_digits(rounded(to), 3);
}

std::string place_of(const EmptyPart& part, const char* side) {
  constexpr double kAll = 0.95;
  const std::string share =
      part.part_share > kAll
          ? "all"
          : (side[0] == '\0' ? std::string() : "the " + std::string(side) + ' ') +
                std::to_string(std::lround(100 * part.part_share)) + " %";
  const std::string whole = part.parts == 1 ? "the guide"
                                            : "part " + std::to_string(part.part) + " of " +
                                                  std::to_string(part.parts) + " of the guide";
  const Vec3 low = part.box.min(), high = part.box.max();
  return share + " of " + whole + " (" + range("x", low.x(), high.x()) + ", " +
         range("y", low.y(), high.y()) + ", " + range("z", low.z(), high.z()) + " m)";
}

Found find_empty(const Cells& cells, const std::vector<uint8_t>& covered, double radius_m,
                 const Vec3& up) {
  const std::vector<double> way = distance_to_marked(cells, covered);
  uint32_t region_count = 0, part_count = 0;
  const std::vector<uint32_t> region = cells.components(
      [&](size_t cell) { return cells.is_inside(cell) && way[cell] > kEmptyEdge * radius_m; },
      region_count);
  const std::vector<uint32_t> part =
      cells.components([&](size_t cell) { return cells.is_inside(cell); }, part_count);

  struct Part {
    double cells = 0, left = std::numeric_limits<double>::infinity();
    uint32_t number = 0;  // from 1; 0: too small to count
  };
  struct Region {
    std::vector<size_t> cells;
    bool is_empty = false;
  };
  std::vector<Part> parts(part_count);
  std::vector<Region> regions(region_count);
  double all = 0;
  for (size_t cell = 0; cell < cells.size(); ++cell) {
    if (!cells.is_inside(cell)) continue;
    const Vec3 middle = cells.middle_of(cell);
    Part& one = parts[part[cell]];
    all += 1;
    one.cells += 1;
    one.left = std::min(one.left, middle.x());
    if (region[cell] == kNoPart) continue;
    Region& of = regions[region[cell]];
    of.cells.push_back(cell);
    of.is_empty = of.is_empty || way[cell] > kEmptyCore * radius_m;
  }
  std::vector<uint32_t> order;
  for (uint32_t i = 0; i < part_count; ++i) {
    if (parts[i].cells >= kCrumb * all) order.push_back(i);
  }
  std::ranges::stable_sort(order, {}, [&](uint32_t i) { return parts[i].left; });
  for (uint32_t i = 0; i < order.size(); ++i) parts[order[i]].number = i + 1;

  Found found;
  std::ranges::stable_sort(regions, std::ranges::greater(),
                           [](const Region& of) { return of.cells.size(); });
  double empty = 0;
  for (Region& of : regions) {
    if (!of.is_empty) continue;
    const auto count = static_cast<double>(of.cells.size());
    empty += count;
    const Part& home = parts[part[of.cells.front()]];
    EmptyPart one{.part = home.number,
                  .parts = static_cast<uint32_t>(order.size()),
                  .part_share = count / home.cells,
                  .guide_share = count / all};
    const bool is_much = one.guide_share > kMuchOfGuide || one.part_share > kMuchOfPart;
    if (home.number == 0 || !is_much) continue;
    // Height in the whole part, and whether it is empty.
    std::vector<std::pair<double, bool>> heights;
    for (size_t cell = 0; cell < cells.size(); ++cell) {
      if (part[cell] != part[of.cells.front()]) continue;
      heights.emplace_back(cells.middle_of(cell).dot(up), region[cell] == region[of.cells.front()]);
    }
    std::ranges::sort(heights);
    const auto length = static_cast<std::ptrdiff_t>(of.cells.size());
    const auto is_empty = [](const std::pair<double, bool>& cell) { return cell.second; };
    const auto below = std::count_if(heights.begin(), heights.begin() + length, is_empty);
    const auto above = std::count_if(heights.end() - length, heights.end(), is_empty);
    for (const size_t cell : of.cells) {
      const Vec3 half = Vec3::Constant(cells.cell_m() / 2);
      one.box.extend(Bounds(cells.middle_of(cell) - half, cells.middle_of(cell) + half));
      one.width_m = std::max(one.width_m, 2 * cells.wall_m(cell));
    }
    const bool is_lower = static_cast<double>(below) > kSide * count;
    const bool is_upper = static_cast<double>(above) > kSide * count;
    one.place = place_of(one, is_lower ? "lower" : is_upper ? "upper" : "");
    found.told.parts.push_back(std::move(one));
    found.cells.push_back(std::move(of.cells));
  }
  found.told.filled_share = all > 0 ? 1 - empty / all : 1;
  return found;
}

void cover(const Cells& cells, const Model& model, std::span<const PlacedBody> bodies,
           std::vector<uint8_t>& covered) {
  std::map<uint32_t, std::vector<Vec3>> points;  // by shape
  for (const auto& [shape, pose] : bodies) {
    std::vector<Vec3>& own = points[shape];
    if (own.empty()) own = points_of(model.shapes[shape], cells.cell_m());
    for (const Vec3& point : own) {
      const size_t cell = cells.cell_of(pose.apply(point));
      if (cell < cells.size() && cells.is_inside(cell)) covered[cell] = 1;
    }
  }
}

// Sizes of the bodies that fill a guide, m.
struct BodySizes {
  double radius_m = 0;                                           // mean bounding radius
  double thickness_m = std::numeric_limits<double>::infinity();  // smallest thickness
};

BodySizes sizes_of(const Model& model, const BodyRange& bodies) {
  BodySizes sizes;
  for (uint32_t i = bodies.first; i < bodies.first + bodies.count; ++i) {
    const ModelShape& shape = model.shapes[model.bodies[i].shape];
    sizes.radius_m += shape.bounding_radius / bodies.count;
    sizes.thickness_m = std::min(sizes.thickness_m, shape.smallest_extent);
  }
  return sizes;
}

double cell_for(const BodySizes& sizes) {
  return kEmptyCell * std::min(sizes.radius_m, 2 * sizes.thickness_m);
}

std::string too_narrow(double width_m, const BodySizes& sizes) {
  return "it is " + metres(width_m) + " wide, and the bodies are at least " +
         metres(sizes.thickness_m) + " thick: smaller ones fill it, or a larger \"scale\"";
}

}  // namespace

std::string describe(const EmptyPart& part) {
  return part.place + " is empty" + (part.reason.empty() ? "" : ": " + part.reason);
}

EmptyParts empty_parts(const Scene& scene, const Model& model, double radius_m,
                       std::span<const PlacedBody> bodies) {
  if (model.guide.triangles.empty()) return {};
  const Cells cells(scene, model, kEmptyCell * radius_m);
  std::vector<uint8_t> covered(cells.size(), 0);
  cover(cells, model, bodies, covered);
  return find_empty(cells, covered, radius_m, -scene.gravity.normalized()).told;
}

EmptyParts too_narrow_parts(const Scene& scene, const Model& model) {
  if (!model.guide_fill || model.guide_fill->count == 0) return {};
  const BodySizes sizes = sizes_of(model, *model.guide_fill);
  const Cells cells(scene, model, cell_for(sizes));
  // Cells where a ball as thick as the thinnest body fits.
  std::vector<uint8_t> covered(cells.size(), 0);
  for (size_t cell = 0; cell < cells.size(); ++cell) {
    covered[cell] = cells.wall_m(cell) >= (sizes.thickness_m - cells.cell_m()) / 2 ? 1 : 0;
  }
  Found found = find_empty(cells, covered, sizes.radius_m, -scene.gravity.normalized());
  for (EmptyPart& part : found.told.parts) part.reason = too_narrow(part.width_m, sizes);
  return std::move(found.told);
}

EmptyParts empty_parts_of_filling(const Scene& scene, const Model& model,
                                  const FillingFacts& facts) {
  if (model.guide.triangles.empty() || facts.bodies.count == 0) return {};
  const BodySizes sizes = sizes_of(model, facts.bodies);
  const Vec3 up = -scene.gravity.normalized();
  const Cells cells(scene, model, cell_for(sizes));
  std::vector<PlacedBody> bodies;
  for (uint32_t i = facts.bodies.first; i < facts.bodies.first + facts.bodies.count; ++i) {
    bodies.emplace_back(model.bodies[i].shape, model.bodies[i].pose);
  }
  std::vector<uint8_t> covered(cells.size(), 0), fallen(cells.size(), 0);
  cover(cells, model, bodies, covered);
  cover(cells, model, facts.left_out, fallen);
  Found found = find_empty(cells, covered, sizes.radius_m, up);
  if (found.told.parts.empty()) return std::move(found.told);
  const std::vector<double> reach =
      facts.through_base ? reach_from_base(cells, up) : std::vector<double>();
  for (size_t i = 0; i < found.cells.size(); ++i) {
    EmptyPart& part = found.told.parts[i];
    double had_bodies = 0, neck_m = 0;
    for (const size_t cell : found.cells[i]) {
      had_bodies += fallen[cell];
      if (facts.through_base)
        neck_m = std::max(neck_m, 2 * std::min(reach[cell], cells.wall_m(cell)));
    }
    const double narrow_m = sizes.thickness_m - cells.cell_m();
    if (had_bodies > kHadBodies * static_cast<double>(found.cells[i].size())) {
      part.reason =
          "the bodies in it touched no fixed body, and would fall; put a static body below it";
    } else if (part.width_m < narrow_m) {
      part.reason = too_narrow(part.width_m, sizes);
    } else if (facts.all_in) {
      part.reason = "all bodies are in: the emitter has a \"count\"";
    } else if (facts.through_base && neck_m < narrow_m) {
      part.reason = "bodies at least " + metres(sizes.thickness_m) +
                    " thick do not pass its neck of " + metres(neck_m) + "; a \"mould\" needs none";
    } else if (facts.through_base) {
      part.reason =
          "bodies that fall in through the base do not reach it; a \"mould\" fills every part";
    } else if (part.width_m > 4 * sizes.radius_m) {
      part.reason = "no more bodies found room there by chance: smaller ones fill it closer";
    } else {
      part.reason = "it is " + metres(part.width_m) + " wide, and bodies " +
                    metres(2 * sizes.radius_m) +
                    " across found no room there: smaller ones fill it, or a larger \"scale\"";
    }
  }
  return std::move(found.told);
}

}  // namespace pilesim
