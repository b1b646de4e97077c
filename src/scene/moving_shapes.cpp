#include "scene/moving_shapes.h"

namespace pilesim {

std::map<std::string, std::set<std::string>> moving_shapes(const Scene& scene) {
  std::map<std::string, std::set<std::string>> shapes;
  for (const Body& body : scene.bodies) {
    if (body.role == Role::dynamic) shapes[body.shape].insert(body.material);
  }
  for (const Emitter& emitter : scene.emitters) {
    for (size_t i = 0; i < emitter.shapes.size(); ++i) {
      const bool has_own = i < emitter.materials.size();
      shapes[emitter.shapes[i]].insert(has_own ? emitter.materials[i] : emitter.material);
    }
  }
  for (const Chain& chain : scene.chains) shapes[chain.shape].insert(chain.material);
  return shapes;
}

}  // namespace pilesim
