#include "trajectory/pile_layers.h"

#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"
#include "trajectory/side_file.h"

namespace pilesim {
namespace {

constexpr SideFile kPilesFormat{.format = "pilesim piles", .version = 2};

Json points_json(const std::vector<Eigen::Vector2d>& points) {
  Json json = Json::array();
  for (const Eigen::Vector2d& point : points) json.push_back({point.x(), point.y()});
  return json;
}

std::vector<Eigen::Vector2d> ground_points_of(const Json& json) {
  std::vector<Eigen::Vector2d> points;
  for (const Json& point : json) points.emplace_back(point.at(0), point.at(1));
  return points;
}

Json pile_json(const LayeredPile& pile) {
  Json layers = Json::array();
  for (const PileLayer& layer : pile.layers) {
    layers.push_back(
        {{"bottom_m", layer.bottom_m}, {"top_m", layer.top_m}, {"radius_m", layer.radius_m}});
  }
  return {{"core", points_json(pile.core)},
          {"walls", points_json(pile.walls)},
          {"layers", std::move(layers)}};
}

LayeredPile pile_of(const std::filesystem::path& file, const Json& json) {
  LayeredPile pile{.core = ground_points_of(json.at("core")),
                   .walls = ground_points_of(json.at("walls"))};
  if (pile.core.empty()) kPilesFormat.refuse(file, "a pile has a core of no points");
  for (const Json& layer : json.at("layers")) {
    pile.layers.push_back({layer.at("bottom_m"), layer.at("top_m"), layer.at("radius_m")});
  }
  return pile;
}

}  // namespace

LayeredPile moved(LayeredPile pile, const Vec3& by) {
  for (auto* points : {&pile.core, &pile.walls}) {
    for (Eigen::Vector2d& point : *points) point += Eigen::Vector2d(by.x(), by.z());
  }
  for (PileLayer& layer : pile.layers) {
    layer.bottom_m += by.y();
    layer.top_m += by.y();
  }
  return pile;
}

double rounded_for_pictures(double value_m) {
  constexpr double kUnit = 1e-4;
  return std::round(value_m / kUnit) * kUnit;
}

void write_pile_layers(const std::filesystem::path& file,
                       const std::vector<PileLayersChange>& changes) {
  Json list = Json::array();
  for (const PileLayersChange& change : changes) {
    Json piles = Json::array();
    for (const LayeredPile& pile : change.piles) piles.push_back(pile_json(pile));
    list.push_back({{"frame", change.frame}, {"piles", std::move(piles)}});
  }
  Json json = kPilesFormat.head();
  json["changes"] = std::move(list);
  write_file_atomically(file, json.dump() + "\n");
}

std::vector<PileLayersChange> read_pile_layers(const std::filesystem::path& file) {
  return kPilesFormat.read(file, [&](const Json& json) {
    std::vector<PileLayersChange> changes;
    for (const Json& change : json.at("changes")) {
      PileLayersChange& stored = changes.emplace_back();
      stored.frame = change.at("frame");
      for (const Json& pile : change.at("piles")) stored.piles.push_back(pile_of(file, pile));
    }
    return changes;
  });
}

}  // namespace pilesim
