#include "render/forces_overlay.h"

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "render/pair_lines.h"

namespace pilesim {

ForcesOverlay::ForcesOverlay(const std::filesystem::path& file) : guide_(read_guide_file(file)) {
  if (guide_.forces.empty()) {
    throw Error(ErrorKind::input,
                Problem{.file = file.string(),
                        .pointer = "/forces",
                        .found = "is empty",
                        .expected = "forces between bodies, of a pile that was analysed as a whole",
                        .remedy = "Direct a pile with \"hold\": \"glue\" in its guide"});
  }
  std::ranges::stable_sort(guide_.forces, {},
                           [](const PairLine& line) { return std::abs(line.weights); });
}

void ForcesOverlay::draw(uint64_t index, const TrajectoryFrame& frame, const CameraKey& camera,
                         Image& image) const {
  draw_pair_lines(guide_, guide_.forces, true, index, frame, camera, image);
}

}  // namespace pilesim
