// Signs that a page draws over the pile: the guide, where bodies are held, and layers of piles.
#pragma once

#include <filesystem>
#include <string>

#include "view/view_data.h"

namespace pilesim {

// JSON text of an object with "guide": coordinates of triangles; "constraints": [frame, [x, y, z,
// ...]]; "layers": [frame, [[bottom, top, x, z, ...]]]; of what there are files in `directory`.
// m, frames of the page. Throws Error(input) for files that are not what their names say.
std::string view_signs(const std::filesystem::path& directory, const ExportSource& source,
                       const ViewData& data);

}  // namespace pilesim
