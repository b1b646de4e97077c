#include "scene/camera_path.h"

#include <algorithm>
#include <vector>

namespace pilesim {

CameraKey camera_at(const Camera& camera, double time_s) {
  const std::vector<CameraKey>& keys = camera.keys;
  const auto after = std::ranges::upper_bound(keys, time_s, {}, &CameraKey::time_s);
  if (after == keys.begin()) return keys.front();
  if (after == keys.end()) return keys.back();
  const auto k = static_cast<size_t>(after - keys.begin());
  const CameraKey& a = keys[k - 1];
  const CameraKey& b = keys[k];
  const double span = b.time_s - a.time_s;
  const double u = (time_s - a.time_s) / span;

  // Cubic Hermite with the slopes of the neighbouring keys; it starts and stops at rest.
  const auto blend = [&](auto value) {
    using T = decltype(value(a));
    const auto slope = [&](size_t i) -> T {
      if (i == 0 || i + 1 == keys.size()) return T(0 * value(keys[i]));
      const double dt = keys[i + 1].time_s - keys[i - 1].time_s;
      return T((value(keys[i + 1]) - value(keys[i - 1])) / dt);
    };
    const double u2 = u * u;
    const double u3 = u2 * u;
    return T((2 * u3 - 3 * u2 + 1) * value(a) + (u3 - 2 * u2 + u) * span * slope(k - 1) +
             (3 * u2 - 2 * u3) * value(b) + (u3 - u2) * span * slope(k));
  };
  return {.time_s = time_s,
          .position = blend([](const CameraKey& key) { return key.position; }),
          .target = blend([](const CameraKey& key) { return key.target; }),
          .field_of_view = blend([](const CameraKey& key) { return key.field_of_view; })};
}

}  // namespace pilesim
