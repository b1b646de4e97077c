#include "view/view_job.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/atomic_file.h"
#include "core/clock.h"
#include "core/counted.h"
#include "core/output_directory.h"
#include "core/text.h"
#include "render/lighting.h"
#include "view/view_page.h"
#include "view/view_signs.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

Json camera_json(const ExportSource& source, const ViewData& data) {
  Json keys = Json::array();
  for (size_t k = 0; k < (source.camera_moves() ? data.frames : 1); ++k) {
    const CameraKey key = source.camera(k * data.every);
    Json numbers = Json::array();
    for (const double value : Vec3(key.position - source.origin())) numbers.push_back(value);
    for (const double value : Vec3(key.target - source.origin())) numbers.push_back(value);
    numbers.push_back(key.field_of_view);
    keys.push_back(std::move(numbers));
  }
  return keys;
}

Json meshes_json(const ViewData& data) {
  Json meshes = Json::array();
  for (const ViewMesh& mesh : data.meshes) {
    Json levels = Json::array(), runs = Json::array();
    for (const ViewLevel& level : mesh.levels) {
      levels.push_back(level.indices.size());
      runs.push_back(level.runs);
    }
    meshes.push_back({{"name", mesh.name},
                      {"is_plane", mesh.is_plane},
                      {"radius_m", mesh.radius_m},
                      {"chord", mesh.radius_m > 0 ? 0.5f * mesh.mean_chord_m / mesh.radius_m : 0},
                      {"vertices", mesh.vertices.size()},
                      {"is_painted", mesh.is_painted},
                      {"is_textured", mesh.is_textured},
                      {"levels", levels},
                      {"runs", runs}});
  }
  return meshes;
}

std::string number(size_t count, const std::string& one, const std::string& many) {
  return grouped(count) + ' ' + (count == 1 ? one : many);
}

// Text about the bodies and frames that the page omits.
std::string thinned_text(const ExportSource& source, const ViewData& data) {
  std::string text;
  if (data.moving_bodies < data.all_moving_bodies) {
    text += "Shows " + grouped(data.moving_bodies) + " of " + grouped(data.all_moving_bodies) +
            " bodies, spread evenly over all of them. ";
  }
  if (data.every > 1) {
    text += "Has " + grouped(data.frames) + " of " + grouped(source.frame_count()) +
            " frames; in between bodies move straight. ";
  }
  return text;
}

std::string overlaps_text(const ViewOverlaps& overlaps, size_t frames) {
  std::string text =
      "Overlap: how deep a body is in the one that it is deepest in, by exact distances of "
      "collision shapes, as a share of the mean body (" +
      with_digits(overlaps.diameter_m, 3) + " m)";
  if (overlaps.frames.size() < frames) {
    text += "; measured at " + number(overlaps.frames.size(), "moment", "moments") +
            ", in between it is that of the nearest one";
  }
  return text;
}

Json lines_json(const ViewData& data) {
  Json lines = Json::array();
  for (const ViewMesh& mesh : data.meshes) {
    const size_t triangles = mesh.levels[0].indices.size() / 3;
    if (triangles == 0 || triangles >= mesh.full_triangles) continue;
    lines.push_back(mesh.name + ": drawn with " + grouped(triangles) + " of its " +
                    grouped(mesh.full_triangles) + " triangles");
  }
  if (data.pictures_are_shrunk) lines.push_back("Textures are at most 1,024 texels wide and high");
  float step_m = 0;
  for (const ViewTrack& track : data.tracks) step_m = std::max(step_m, track.step_m);
  lines.push_back("Places are true to " + with_digits(1e3 * 0.5 * step_m, 2) +
                  " mm, turns to 0.02 degrees");
  if (!data.overlaps.frames.empty()) lines.push_back(overlaps_text(data.overlaps, data.frames));
  lines.push_back(
      "Drag to turn, with Shift or two fingers to move, wheel or pinch for near and far");
  lines.push_back("Click a body for its data");
  lines.push_back("Space plays, arrows step, Home and End, R for the first view");
  return lines;
}

Json picture_sizes(const ViewData& data) {
  Json sizes = Json::array();
  for (const std::string& picture : data.pictures) sizes.push_back(picture.size());
  return sizes;
}

// As the rasteriser has it. A sky from a file is shown by its mean light.
Json light_json(const RenderSettings& settings) {
  const Lighting light = make_lighting(settings.light);
  const auto numbers = [](const Vec3f& v) { return Json{v.x(), v.y(), v.z()}; };
  Vec3f sky = light.sky, bounce = light.bounce, horizon = light.horizon, zenith = light.zenith;
  Vec3f to_sun = light.to_sun, sun = light.sun;
  if (light.map) {
    const RasterSky raster = raster_sky(*light.map, std::nullopt, !sun.isZero());
    sky = irradiance(raster.harmonics, Vec3f::UnitY());
    bounce = irradiance(raster.harmonics, -Vec3f::UnitY());
    horizon = 0.5f * (sky + bounce);
    zenith = sky;
    if (sun.isZero()) {
      to_sun = raster.to_sun;
      sun = raster.sun;
    }
  }
  return {{"to_sun", numbers(to_sun)},   {"sun", numbers(sun)},
          {"sky", numbers(sky)},         {"bounce", numbers(bounce)},
          {"horizon", numbers(horizon)}, {"zenith", numbers(zenith)},
          {"backdrop", light.backdrop},  {"exposure", exposure_factor(settings.exposure)}};
}

Json about_json(const ExportSource& source, const ViewData& data, const ViewJob& job) {
  const double last_s = source.time_s(data.every * (data.frames - 1)), first_s = source.time_s(0);
  const double apart = data.frames > 1 ? (last_s - first_s) / static_cast<double>(data.frames - 1)
                                       : 1 / source.header().frame_rate;
  const double every = std::round(apart * source.header().frame_rate);
  const Vec3f& c = data.centre;
  return {{"title", job.title},
          {"summary", number(data.all_moving_bodies, "body", "bodies") + ", " +
                          with_digits(last_s - first_s, 3) + " s, " + job.mode + " mode"},
          {"thinned", thinned_text(source, data)},
          {"lines", lines_json(data)},
          {"mode", job.mode},
          {"frames", data.frames},
          {"frame_rate", 1 / apart},
          {"first_s", first_s},
          {"first_frame", source.frame(0)},
          {"every", every},
          {"bodies", data.shown.size()},
          {"states", data.states},
          {"fast_m_s", data.fast_m_s},
          {"moving", data.moving},
          {"overlaps",
           {{"frames", data.overlaps.frames},
            {"units", kDepthUnits},
            {"diameter_m", data.overlaps.diameter_m}}},
          {"camera", camera_json(source, data)},
          {"scene",
           {{"centre", {c.x(), c.y(), c.z()}},
            {"radius", data.radius_m},
            {"reach", kGroundReach * data.radius_m}}},
          {"light", light_json(job.render)},
          {"meshes", meshes_json(data)},
          {"pictures", picture_sizes(data)}};
}

}  // namespace

ViewSummary run_view(TrajectoryReader& trajectory, const ViewJob& job) {
  const Stopwatch watch;
  claim_output_file(job.output, job.force);
  ExportSource source(trajectory, job.choice);
  const ViewData data = make_view_data(source, job.most_bodies, job.overlaps);
  const std::string page =
      view_page(about_json(source, data, job),
                view_bytes(source, data, view_signs(job.beside, source, data)));
  write_file_atomically(job.output, page);
  return {.bytes = page.size(),
          .bodies = data.moving_bodies,
          .all_bodies = data.all_moving_bodies,
          .frames = data.frames,
          .all_frames = source.frame_count(),
          .wall_s = watch.seconds()};
}

}  // namespace pilesim
