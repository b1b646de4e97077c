#include "job/run_filling.h"

#include <map>
#include <utility>

#include "model/keep_bodies.h"

namespace pilesim {

void take_filling(const TrajectoryHeader& run, const std::vector<bool>& is_there, Model& model) {
  if (!model.guide_fill) return;
  const GuideFill fill = *model.guide_fill;
  std::map<std::string, uint32_t> of_run;
  for (uint32_t i = 0; i < run.body_count(); ++i) {
    if (is_there[i]) of_run.emplace(run.body_name[i], i);
  }
  // Removed bodies changed the numbering of names, so a name may now belong to another shape: keep
  // one example body per shape and material.
  std::map<std::pair<std::string, uint32_t>, ModelBody> kinds;
  for (uint32_t i = fill.first; i < fill.first + fill.count; ++i) {
    const ModelBody& body = model.bodies[i];
    kinds.try_emplace({model.shapes[body.shape].name, body.material}, body);
  }
  const auto like = [&](uint32_t in_run) {
    const std::string& shape = run.shapes[run.body_shape[in_run]].name;
    const auto exact = kinds.find({shape, run.body_material[in_run]});
    if (exact != kinds.end()) return exact;
    // Another scene may order its materials differently.
    const auto of_shape = kinds.lower_bound({shape, 0});
    return of_shape != kinds.end() && of_shape->first.first == shape ? of_shape : kinds.end();
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
    const auto kind = like(in_run);
    if (kind == kinds.end()) continue;
    const std::string name = body.name;
    body = kind->second;
    body.name = name;
    body.start_s = kFromTheStart;
    if (!run.body_colour.empty()) body.colour = run.body_colour[in_run];
    if (!run.body_painted.empty()) body.is_painted = run.body_painted[in_run] != 0;
    if (!run.body_gloss.empty()) {
      body.look.roughness = run.body_gloss[in_run][0];
      body.look.clear_coat = run.body_gloss[in_run][1];
    }
    if (!run.body_substance.empty()) {
      body.look.metallic = run.body_substance[in_run][0];
      body.look.transmission = run.body_substance[in_run][1];
      body.look.emission = run.body_substance[in_run][2];
    }
    if (!run.body_pattern.empty()) {
      body.look.pattern = static_cast<Pattern>(run.body_pattern[in_run][0]);
      body.look.pattern_m = run.body_pattern[in_run][1];
    }
  }
  if (!any) return;
  keep_bodies(stays, model);
  if (fill.is_mould) model.moulded = *model.guide_fill;
  model.guide_fill.reset();
}

}  // namespace pilesim
