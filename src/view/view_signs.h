// Signs drawn over the pile: the guide, positions of fixed bodies, and layers of piles.
#pragma once

#include <filesystem>
#include <string>

#include "view/view_data.h"

namespace pilesim {

// JSON text of an object with "guide": coordinates of triangles; "constraints": [frame, [x, y, z,
// ...]]; "layers": [frame, [[bottom, top, x, z, ...]]]. Members exist as far as `directory` has the
// files. Units: m, frames of the page. Throws Error(input) for invalid files.
std::string view_signs(const std::filesystem::path& directory, const ExportSource& source,
                       const ViewData& data);

}  // namespace pilesim
