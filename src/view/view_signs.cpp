#include "view/view_signs.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "render/pile_overlay.h"
#include "trajectory/guide_file.h"

namespace pilesim {
namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kOfRim = 2;  // every second point of a layer's outline

double rounded(double value_m) { return std::round(value_m * 1e4) / 1e4; }

void append(Json& list, const Vec3& point) {
  for (const double value : point) list.push_back(rounded(value));
}

// Converts a frame of the trajectory to one of the page; earlier frames give the first.
double frame_of_page(double frame, const ExportSource& source, const ViewData& data) {
  const auto first = static_cast<double>(source.frame(0));
  const double apart =
      data.frames > 1 ? (static_cast<double>(source.frame(data.every)) - first) : 1;
  return std::max(0.0, rounded((frame - first) / apart));
}
double frame_of_page(uint64_t frame, const ExportSource& source, const ViewData& data) {
  return frame_of_page(static_cast<double>(frame), source, data);
}

// [body, other or -1 if fixed, position in the frame of the first, from, until or null]
Json glue_of(const PairLine& line, const ExportSource& source, const ViewData& data) {
  const double rate = source.header().frame_rate;
  Json glue = {line.a, line.b_stands ? -1 : static_cast<int64_t>(line.b)};
  append(glue, line.arm);
  glue.push_back(frame_of_page(rate * line.from_s, source, data));
  glue.push_back(std::isfinite(line.until_s)
                     ? Json(frame_of_page(rate * line.until_s, source, data))
                     : Json());
  return glue;
}

// Coordinates are relative to `origin`.
Json layers_of(const PileLayersChange& change, const Vec3& origin) {
  Json layers = Json::array();
  for (const LayeredPile& at : change.piles) {
    const LayeredPile pile = moved(at, -origin);
    for (const PileLayer& layer : pile.layers) {
      Json ring = {rounded(layer.bottom_m), rounded(layer.top_m)};
      const std::vector<Eigen::Vector2f> rim =
          PileOverlay::outline(pile, static_cast<float>(layer.radius_m));
      for (size_t i = 0; i < rim.size(); i += kOfRim) {
        ring.push_back(rounded(rim[i].x()));
        ring.push_back(rounded(rim[i].y()));
      }
      layers.push_back(std::move(ring));
    }
  }
  return layers;
}

}  // namespace

std::string view_signs(const std::filesystem::path& directory, const ExportSource& source,
                       const ViewData& data) {
  Json signs = Json::object();
  if (std::filesystem::exists(directory / "guide.json")) {
    const GuideFile guide = read_guide_file(directory / "guide.json");
    Json triangles = Json::array();
    for (const auto& triangle : guide.triangles) {
      for (const uint32_t corner : triangle)
        append(triangles, guide.vertices[corner] - source.origin());
    }
    if (!triangles.empty()) signs["guide"] = std::move(triangles);
    Json constraints = Json::array();
    bool is_held = false;
    for (const GuideConstraints& change : guide.constraints) {
      Json points = Json::array();
      for (const Vec3& point : change.points) append(points, point - source.origin());
      is_held = is_held || !points.empty();
      constraints.push_back({frame_of_page(change.frame, source, data), std::move(points)});
    }
    if (is_held) signs["constraints"] = std::move(constraints);
    Json glue = Json::array();
    for (const PairLine& line : guide.glue) glue.push_back(glue_of(line, source, data));
    if (!glue.empty()) signs["glue"] = std::move(glue);
  }
  if (std::filesystem::exists(directory / "piles.json")) {
    Json layers = Json::array();
    for (const PileLayersChange& change : read_pile_layers(directory / "piles.json")) {
      layers.push_back(
          {frame_of_page(change.frame, source, data), layers_of(change, source.origin())});
    }
    if (!layers.empty()) signs["layers"] = std::move(layers);
  }
  return signs.dump();
}

}  // namespace pilesim
