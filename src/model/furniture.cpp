#include "model/furniture.h"

namespace pilesim {
namespace {

// From its lowest corner to its highest.
BoxPart between(const Vec3& low, const Vec3& high) { return {(low + high) / 2, high - low}; }

}  // namespace

std::vector<BoxPart> parts_of(const BinShape& bin) {
  const double t = bin.thickness, top = t + bin.size.y();
  const double x = bin.size.x() / 2, z = bin.size.z() / 2;  // of the inside
  return {between({-x - t, 0, -z - t}, {x + t, t, z + t}),
          between({-x - t, t, -z - t}, {-x, top, z + t}),
          between({x, t, -z - t}, {x + t, top, z + t}), between({-x, t, -z - t}, {x, top, -z}),
          between({-x, t, z}, {x, top, z + t})};
}

std::vector<BoxPart> parts_of(const TableShape& table) {
  const double t = table.thickness, leg = table.leg;
  const double x = table.size.x() / 2, top = table.size.y(), z = table.size.z() / 2;
  std::vector<BoxPart> parts = {between({-x, top - t, -z}, {x, top, z})};
  for (const double side_x : {-x, x - leg}) {
    for (const double side_z : {-z, z - leg}) {
      parts.push_back(between({side_x, 0, side_z}, {side_x + leg, top - t, side_z + leg}));
    }
  }
  return parts;
}

std::vector<BoxPart> parts_of(const ShelfShape& shelf) {
  const double t = shelf.thickness;
  const double x = shelf.size.x() / 2, top = shelf.size.y(), z = shelf.size.z() / 2;
  std::vector<BoxPart> parts = {between({-x, 0, -z}, {-x + t, top, z}),
                                between({x - t, 0, -z}, {x, top, z})};
  const double back = shelf.has_back ? t : 0;
  if (shelf.has_back) parts.push_back(between({-x + t, 0, -z}, {x - t, top, -z + t}));
  for (int board = 0; board < shelf.boards; ++board) {
    const double y = board * (top - t) / (shelf.boards - 1);
    parts.push_back(between({-x + t, y, -z + back}, {x - t, y + t, z}));
  }
  return parts;
}

std::vector<BoxPart> parts_of(const StairsShape& stairs) {
  const double x = stairs.size.x() / 2, z = stairs.size.z() / 2;
  const double rise = stairs.size.y() / stairs.steps, run = stairs.size.z() / stairs.steps;
  std::vector<BoxPart> parts;
  for (int step = 0; step < stairs.steps; ++step) {
    parts.push_back(between({-x, 0, z - (step + 1) * run}, {x, (step + 1) * rise, z - step * run}));
  }
  return parts;
}

std::vector<BoxPart> furniture_parts(const Shape& shape) {
  if (const auto* bin = std::get_if<BinShape>(&shape)) return parts_of(*bin);
  if (const auto* table = std::get_if<TableShape>(&shape)) return parts_of(*table);
  if (const auto* shelf = std::get_if<ShelfShape>(&shape)) return parts_of(*shelf);
  return parts_of(std::get<StairsShape>(shape));
}

}  // namespace pilesim
