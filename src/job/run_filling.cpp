#include "job/run_filling.h"

#include <algorithm>
#include <map>

#include "model/keep_bodies.h"

namespace pilesim {

void take_filling(const TrajectoryHeader& run, const std::vector<bool>& is_there, Model& model) {
  if (!model.guide_fill) return;
  const GuideFill fill = *model.guide_fill;
  std::map<std::string, uint32_t> of_run;
  for (uint32_t i = 0; i < run.body_count(); ++i) {
    if (is_there[i]) of_run.emplace(run.body_name[i], i);
  }
  // Names went on in order when some were left out, and so may be another shape's now. An emitter
  // gives each of its shapes one material.
  std::map<std::string, ModelBody> of_shape;
  for (uint32_t i = fill.first; i < fill.first + fill.count; ++i) {
    of_shape.emplace(model.shapes[model.bodies[i].shape].name, model.bodies[i]);
  }
  std::vector<bool> stays(model.bodies.size(), true);
  bool any = false;
  for (uint32_t i = fill.first; i < fill.first + fill.count; ++i) {
    ModelBody& body = model.bodies[i];
    const auto found = of_run.find(body.name);
    stays[i] = found != of_run.end();
    if (!stays[i]) continue;
    any = true;
    const auto like = of_shape.find(run.shapes[run.body_shape[found->second]].name);
    if (like == of_shape.end()) continue;
    body.shape = like->second.shape;
    body.material = like->second.material;
    body.mass_kg = like->second.mass_kg;
    body.is_painted = like->second.is_painted;
    body.start_s = kFromTheStart;
  }
  if (!any) return;
  keep_bodies(stays, model);
  if (fill.is_mould) model.moulded = *model.guide_fill;
  model.guide_fill.reset();
}

}  // namespace pilesim
