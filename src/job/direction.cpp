#include "job/direction.h"

#include "job/guide_direction.h"
#include "job/repose_direction.h"
#include "simulate/modes/make_simulator.h"

namespace pilesim {
namespace {

class NoDirection final : public Direction {
 public:
  NoDirection(const Scene& scene, const Model& model) : scene_(scene), model_(model) {}
  std::unique_ptr<Simulator> make_simulator() override {
    return pilesim::make_simulator(scene_, model_);
  }
  DirectedRun finish(const Simulator&, const std::filesystem::path&) const override { return {}; }

 private:
  const Scene& scene_;
  const Model& model_;
};

}  // namespace

std::unique_ptr<Direction> no_direction(const Scene& scene, const Model& model) {
  return std::make_unique<NoDirection>(scene, model);
}

std::unique_ptr<Direction> direction_of(const std::filesystem::path& scene_file, const Scene& scene,
                                        const Model& model, const GuideFilling& filling) {
  if (scene.guide) return std::make_unique<GuideDirection>(scene_file, scene, model, filling);
  return std::make_unique<ReposeDirection>(scene_file, scene, model);
}

}  // namespace pilesim
