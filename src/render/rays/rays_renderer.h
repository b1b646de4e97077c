// Draws frames by tracing rays: full meshes at any count, soft shadows, light from surface to
// surface, depth of field and motion blur.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>

#include "render/body_colours.h"
#include "render/frame_renderer.h"
#include "render/rays/film.h"
#include "render/rays/film_store.h"

namespace pilesim {

// The settings that a quality stands for, with those given by themselves.
struct RayPlan {
  uint32_t samples;
  int bounces;
  bool denoise;
};
RayPlan plan_of(const RaySettings& settings);

class RaysRenderer final : public FrameRenderer {
 public:
  // `materials`: of the scene, by name, for trajectories that do not say how glossy bodies are;
  // what is not among them looks as by default. `films`: where they are kept, if they are. Throws
  // Error(internal) where Embree does not start.
  RaysRenderer(const TrajectoryHeader& header, const RenderSettings& settings,
               const std::map<std::string, Material>& materials,
               BodyColours colours = BodyColours::own, std::optional<FilmPlace> films = {});
  ~RaysRenderer() override;

  // With films, throws Error(interrupted) between samples: those so far are kept then.
  const Image& draw(const DrawnFrame& drawn) override;
  bool wants_neighbours() const override;

  // The film of the last picture, before the filter.
  const Film& film() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace pilesim
