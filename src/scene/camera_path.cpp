#include "scene/camera_path.h"

#include <algorithm>
#include <vector>

namespace pilesim {

CameraKey camera_at(const Camera& camera, double time_s) {
  const std::vector<CameraKey>& keys = camera.keys;
  const auto after = std::ranges::upper_bound(keys, time_s, {}, &CameraKey::time_s);
  if (after == keys.begin()) return keys.front();
  if (after == keys.end()) return keys.back();
  const auto next = static_cast<size_t>(after - keys.begin());
  const CameraKey& a = keys[next - 1];
  const CameraKey& b = keys[next];
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
    return T((2 * u3 - 3 * u2 + 1) * value(a) + (u3 - 2 * u2 + u) * span * slope(next - 1) +
             (3 * u2 - 2 * u3) * value(b) + (u3 - u2) * span * slope(next));
  };
  CameraKey key = a;
  key.time_s = time_s;
  key.focal_length_mm.reset();  // keys may have different ones
  key.position = blend([](const CameraKey& k) { return k.position; });
  key.target = blend([](const CameraKey& k) { return k.target; });
  key.field_of_view = blend([](const CameraKey& k) { return k.field_of_view; });
  key.roll = blend([](const CameraKey& k) { return k.roll; });
  for (size_t i = 0; i < 2; ++i) {
    key.lens_shift[i] = blend([i](const CameraKey& k) { return k.lens_shift[i]; });
  }
  return key;
}

}  // namespace pilesim
