#include "job/guide_direction.h"

#include <cmath>

#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/naming.h"
#include "core/text.h"
#include "pile/guide/guide_fit.h"
#include "pile/guide/surface_profile.h"
#include "report/verdict.h"
#include "trajectory/guide_file.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

// Share of bodies held only by the mould, above which a hint is printed.
constexpr double kManyHang = 0.05;

std::string percent(double share) {
  const double all = 100 * share;
  return (all < 1000 ? with_digits(all, 3) : grouped(std::llround(all))) + " %";
}

Json surface_json(const SurfaceProfile& surface) {
  Json rings = Json::array();
  for (const SurfaceRing& ring : surface.rings) {
    rings.push_back({{"radius_m", ring.radius_m},
                     {"height_m", ring.height_m},
                     {"guide_height_m", ring.guide_height_m}});
  }
  return {{"difference", surface.difference},
          {"slope_deg", surface.slope_deg},
          {"guide_slope_deg", surface.guide_slope_deg},
          {"column_m", surface.column_m},
          {"rings", rings}};
}

Json empty_json(const EmptyParts& empty) {
  Json parts = Json::array();
  for (const EmptyPart& part : empty.parts) {
    const Vec3 low = part.box.min(), high = part.box.max();
    parts.push_back({{"part", part.part},
                     {"of_parts", part.parts},
                     {"part_share", part.part_share},
                     {"guide_share", part.guide_share},
                     {"low_m", {low.x(), low.y(), low.z()}},
                     {"high_m", {high.x(), high.y(), high.z()}},
                     {"width_m", part.width_m},
                     {"what", describe(part)}});
  }
  return parts;
}

std::string figures_of(const GuidedSimulator& simulator, const GuideFit& fit,
                       const SurfaceProfile& surface, const GuideFilling& filling,
                       double outline_m) {
  Json figures = Json::object();
  if (fit.voxel_m > 0) {
    figures["bodies_inside"] = fit.bodies_inside;
    figures["volume_inside"] = fit.volume_inside;
    figures["overlap"] = fit.overlap;
    figures["voxel_m"] = fit.voxel_m;
    figures["filled_share"] = fit.filled_share;
  }
  if (surface.column_m > 0) figures["surface"] = surface_json(surface);
  if (filling.dropped > 0) {
    figures["outline_moved_m"] = outline_m;
    figures["filling"] = {{"dropped", filling.dropped},
                          {"kept", filling.kept},
                          {"volume_share", filling.volume_share},
                          {"filled_share", filling.empty.filled_share},
                          {"simulated_s", filling.simulated_s}};
    if (filling.is_mould) {
      figures["filling"]["outside_m"] = filling.outside_m;
      figures["filling"]["tries"] = filling.tries;
      figures["filling"]["hanging"] = filling.hanging;
      figures["filling"]["floats"] = filling.floats;
    }
    figures["filling"]["empty"] = empty_json(filling.empty);
  }
  if (const std::optional<GlueFigures> glue = simulator.glue_figures()) {
    figures["glue_needed"] = {{"solved", glue->is_solved},
                              {"weights", glue->weights},
                              {"given", glue->given},
                              {"pairs", glue->pairs},
                              {"contacts", glue->contacts},
                              {"glued_contacts", glue->glued_contacts},
                              {"hanging", glue->hanging},
                              {"unbalanced", glue->unbalanced},
                              {"outside", glue->outside},
                              {"largest_force", glue->largest_force},
                              {"leaning_unsolved", glue->leaning_unsolved}};
  }
  if (const std::optional<GlueLeft> left = simulator.glue_left()) {
    figures["glue_left"] = {
        {"time_s", left->time_s},   {"solved", left->is_solved}, {"bodies", left->bodies},
        {"hanging", left->hanging}, {"pairs", left->pairs},      {"needed", left->needed},
        {"weights", left->weights}, {"missing", left->missing},  {"unbalanced", left->unbalanced},
        {"outside", left->outside}, {"stands", stands(*left)}};
  }
  if (!simulator.frames().empty()) figures.update(guide_frame_json(simulator.frames().back()));
  figures["control_share"] = simulator.control_share();
  figures["control_step_s"] = simulator.control_step_s();
  figures["simulation_step_s"] = simulator.simulation_step_s();
  return Json{{"guide", figures}}.dump();
}

std::vector<std::string> lines_of(const GuidedSimulator& simulator, const GuideFit& fit,
                                  const SurfaceProfile& surface, const GuideFilling& filling,
                                  double outline_m) {
  std::vector<std::string> lines;
  if (filling.dropped > 0) {
    lines.push_back(
        std::string("guide: filled ") + (filling.is_mould ? "as a mould; " : "upside down; ") +
        std::to_string(filling.kept) + " of " + std::to_string(filling.dropped) +
        " bodies lie inside, " + percent(filling.volume_share) + " of its volume, and leave " +
        percent(1 - filling.empty.filled_share) + " of it empty" +
        (filling.tries > 1 ? "; the filling of try " + std::to_string(filling.tries) +
                                 ", as no glue holds those before"
                           : "") +
        (filling.hanging > 0
             ? "; " + std::to_string(filling.hanging) + " that touched the mould alone are left out"
             : ""));
    if (filling.hanging > kManyHang * filling.kept) {
      lines.emplace_back(
          "guide: smaller bodies fill parts in which these jam; a part in the air needs a static "
          "body below it");
    }
  }
  if (const std::optional<GlueFigures> glue = simulator.glue_figures()) {
    lines.push_back(glue->is_solved
                        ? "guide: held by glue of " + percent(glue->weights) +
                              " of the pile's weight, at " + std::to_string(glue->glued_contacts) +
                              " of " + std::to_string(glue->contacts) + " contacts"
                        : "guide: no glue was found that holds it; it may fall");
    if (glue->is_solved && glue->given < 1) {
      lines.push_back("guide: it may have " + percent(glue->given) +
                      " of that glue (/guide/max_glue): the rest slumps");
    }
    if (glue->hanging > 0) {
      lines.push_back("guide: " + std::to_string(glue->hanging) +
                      " bodies have no chain of contacts to a fixed body, and fall");
    }
  }
  if (const std::optional<GlueLeft> left = simulator.glue_left()) {
    lines.push_back("guide: analysed again at " + with_digits(left->time_s, 3) + " s: " +
                    (stands(*left)
                         ? "the rest stands, by " + std::to_string(left->needed) + " of " +
                               std::to_string(left->pairs) + " pairs that are glued"
                     : left->is_solved && left->missing > 0
                         ? "for the rest to stand, glue of " + with_digits(left->missing, 2) +
                               " bodies' weight is missing"
                         : "no forces were found that hold the rest"));
  }
  if (!simulator.frames().empty()) {
    const GuideFrame& last = simulator.frames().back();
    lines.push_back(
        "guide: " +
        (simulator.glue_figures() ? std::to_string(last.counts.glue) + " pairs glued, " +
                                        std::to_string(last.counts.torn) + " torn"
                                  : std::to_string(last.counts.held) + " held") +
        ", " + std::to_string(last.counts.passed) + " passed, " +
        std::to_string(last.counts.filtered) + " filtered, " + std::to_string(last.counts.failed) +
        " failed; height " + with_digits(last.height_m, 3) + " m, mean drift " +
        with_digits(last.mean_drift_m, 2) + " m; control " + percent(simulator.control_share()) +
        " of the time");
  }
  if (fit.voxel_m > 0) {
    lines.push_back("guide: " + percent(fit.bodies_inside) + " of the bodies inside, " +
                    percent(fit.volume_inside) + " of their volume; " + percent(fit.filled_share) +
                    " of it is filled; overlap " + percent(fit.overlap) +
                    (filling.dropped > 0
                         ? "; its outline has moved by " + with_digits(outline_m, 2) + " m"
                         : ""));
    if (fit.bodies_inside < kKeptShape) {
      lines.push_back("guide: the pile has not kept its shape: " + percent(1 - fit.bodies_inside) +
                      " of its bodies lie outside; it has slumped, or something hit it");
    }
  }
  if (surface.column_m > 0) {
    lines.push_back("guide: the pile's surface is " + percent(surface.difference) +
                    " of the guide's height off it in the mean; it falls at " +
                    with_digits(surface.slope_deg, 3) +
                    " degrees from the middle, the guide's at " +
                    with_digits(surface.guide_slope_deg, 3));
  }
  return lines;
}

}  // namespace

GuideFilling fill_guide_of(const std::filesystem::path& scene_file, const Scene& scene,
                           Model& model) {
  return naming(scene_file.string(), [&] { return fill_guide(scene, model); });
}

std::unique_ptr<Simulator> GuideDirection::make_simulator() {
  auto simulator = naming(scene_file_.string(),
                          [&] { return std::make_unique<GuidedSimulator>(scene_, model_); });
  simulator_ = simulator.get();
  return simulator;
}

DirectedRun GuideDirection::finish(const Simulator& simulator,
                                   const std::filesystem::path& directory) const {
  write_guide_file(directory / "guide.json", {.frames = simulator_->frames(),
                                              .vertices = model_.guide.vertices,
                                              .triangles = model_.guide.triangles,
                                              .constraints = simulator_->constraints(),
                                              .glue = simulator_->glue(),
                                              .forces = simulator_->forces()});
  const GuideFit fit = measure_guide_fit(scene_, model_, simulator.states());
  const SurfaceProfile surface = measure_surface(model_, simulator.states(), fit.voxel_m);
  const double outline_m = fit.voxel_m > 0
                               ? outline_moved_m(scene_, model_, {filling_.first, filling_.kept},
                                                 simulator.states(), fit.voxel_m)
                               : 0;
  DirectedRun run{figures_of(*simulator_, fit, surface, filling_, outline_m),
                  lines_of(*simulator_, fit, surface, filling_, outline_m), std::nullopt};
  if (fit.voxel_m > 0) run.guide = {1 - fit.bodies_inside, 1 - fit.filled_share};
  return run;
}

}  // namespace pilesim
