// Bins, tables, shelves and stairs as boxes that do not overlap: their mass is exact, and so are
// their collision shapes.
#pragma once

#include <vector>

#include "scene/scene.h"

namespace pilesim {

struct BoxPart {
  Vec3 centre;  // m, in the shape's own frame
  Vec3 size;    // m, full edges
};

// The boxes of one of the four shapes.
std::vector<BoxPart> furniture_parts(const Shape& shape);

// The origin of each is in the middle of its foot.
std::vector<BoxPart> parts_of(const BinShape& bin);
std::vector<BoxPart> parts_of(const TableShape& table);
std::vector<BoxPart> parts_of(const ShelfShape& shelf);
std::vector<BoxPart> parts_of(const StairsShape& stairs);

}  // namespace pilesim
