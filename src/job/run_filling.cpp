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
  // Names went on in order when some were left out, and so may be another shape's now.
  const std::vector<ModelBody> before(model.bodies.begin() + fill.first,
                                      model.bodies.begin() + fill.first + fill.count);
  const auto like = [&](uint32_t in_run) {
    const std::string& shape = run.shapes[run.body_shape[in_run]].name;
    const auto has_shape = [&](const ModelBody& body) {
      return model.shapes[body.shape].name == shape;
    };
    const auto exact = std::ranges::find_if(before, [&](const ModelBody& body) {
      return has_shape(body) && body.material == run.body_material[in_run];
    });
    // Another scene may have its materials in another order.
    return exact != before.end() ? exact : std::ranges::find_if(before, has_shape);
  };
  std::vector<bool> stays(model.bodies.size(), true);
  bool any = false;
  for (uint32_t i = fill.first; i < fill.first + fill.count; ++i) {
    ModelBody& body = model.bodies[i];
    const auto found = of_run.find(body.name);
    stays[i] = found != of_run.end();
    if (!stays[i]) continue;
    any = true;
    const uint32_t in_run = found->second;
    const auto alike = like(in_run);
    if (alike == before.end()) continue;
    const std::string name = body.name;
    body = *alike;
    body.name = name;
    body.start_s = kFromTheStart;
    if (!run.body_colour.empty()) body.colour = run.body_colour[in_run];
    if (!run.body_painted.empty()) body.is_painted = run.body_painted[in_run] != 0;
    if (!run.body_gloss.empty()) {
      body.roughness = run.body_gloss[in_run][0];
      body.clear_coat = run.body_gloss[in_run][1];
    }
  }
  if (!any) return;
  keep_bodies(stays, model);
  if (fill.is_mould) model.moulded = *model.guide_fill;
  model.guide_fill.reset();
}

}  // namespace pilesim
