#include <algorithm>

#include "render/scene_renderer.h"

namespace pilesim {
}  // namespace pilesim
