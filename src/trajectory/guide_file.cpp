#include "trajectory/guide_file.h"

#include <cmath>

#include "core/atomic_file.h"
#include "trajectory/side_file.h"

namespace pilesim {
namespace {

constexpr SideFile kGuideFormat{.format = "pilesim guide", .version = 3};

// Calls use(name, member) for each member of a frame.
void for_each_member(auto& frame, const auto& use) {
  use("time_s", frame.time_s);
  use("in_guide", frame.counts.in_guide);
  use("passed", frame.counts.passed);
  use("filtered", frame.counts.filtered);
  use("failed", frame.counts.failed);
  use("held", frame.counts.held);
  use("nails", frame.counts.nails);
  use("knocked_loose", frame.counts.knocked_loose);
  use("glue", frame.counts.glue);
  use("torn", frame.counts.torn);
  use("glue_weights", frame.counts.glue_weights);
  use("height_m", frame.height_m);
  use("mean_drift_m", frame.mean_drift_m);
  use("largest_drift_m", frame.largest_drift_m);
}

// Rounded to a tenth of a millimetre, for pictures.
Json rounded(const Vec3& point) {
  Json json = Json::array();
  for (const double value : point) json.push_back(std::round(value * 1e4) / 1e4);
  return json;
}

Json rounded(const std::vector<Vec3>& points) {
  Json json = Json::array();
  for (const Vec3& point : points) json.push_back(rounded(point));
  return json;
}

std::vector<Vec3> points_of(const Json& json) {
  std::vector<Vec3> points;
  for (const Json& point : json) {
    points.emplace_back(point.at(0).get<double>(), point.at(1).get<double>(),
                        point.at(2).get<double>());
  }
  return points;
}

Json line_json(const PairLine& line) {
  Json json = {{"a", line.a},
               {"b", line.b},
               {"b_stands", line.b_stands},
               {"arm", rounded(line.arm)},
               {"weights", line.weights},
               {"from_s", line.from_s}};
  if (std::isfinite(line.until_s)) json["until_s"] = line.until_s;
  return json;
}

Json lines_json(const std::vector<PairLine>& lines) {
  Json json = Json::array();
  for (const PairLine& line : lines) json.push_back(line_json(line));
  return json;
}

PairLine line_of(const Json& json) {
  PairLine line{.a = json.at("a"), .b = json.at("b")};
  json.at("b_stands").get_to(line.b_stands);
  for (size_t k = 0; k < 3; ++k) line.arm[k] = json.at("arm").at(k).get<double>();
  json.at("weights").get_to(line.weights);
  json.at("from_s").get_to(line.from_s);
  if (json.contains("until_s")) json.at("until_s").get_to(line.until_s);
  return line;
}

void read_triangles(const std::filesystem::path& file, const Json& json, GuideFile& guide) {
  for (const Json& triangle : json) {
    std::array<uint32_t, 3>& corners = guide.triangles.emplace_back();
    for (size_t i = 0; i < 3; ++i) {
      const Json& corner = triangle.at(i);
      if (!corner.is_number_unsigned() || corner.get<uint64_t>() >= guide.vertices.size()) {
        kGuideFormat.refuse(file, "/guide/triangles names vertex " + corner.dump() + " of " +
                                      std::to_string(guide.vertices.size()));
      }
      corners[i] = corner.get<uint32_t>();
    }
  }
}

}  // namespace

Json guide_frame_json(const GuideFrame& frame) {
  Json json;
  for_each_member(frame, [&](const char* name, const auto& value) { json[name] = value; });
  return json;
}

void write_guide_file(const std::filesystem::path& file, const GuideFile& guide) {
  Json frames = Json::array(), constraints = Json::array(), triangles = Json::array();
  for (const GuideFrame& frame : guide.frames) frames.push_back(guide_frame_json(frame));
  for (const auto& corners : guide.triangles) triangles.push_back(corners);
  for (const GuideConstraints& change : guide.constraints) {
    constraints.push_back({{"frame", change.frame}, {"points", rounded(change.points)}});
  }
  Json json = kGuideFormat.head();
  json["frames"] = std::move(frames);
  json["guide"] = {{"vertices", rounded(guide.vertices)}, {"triangles", std::move(triangles)}};
  json["constraints"] = std::move(constraints);
  json["glue"] = lines_json(guide.glue);
  json["forces"] = lines_json(guide.forces);
  write_file_atomically(file, json.dump() + "\n");
}

GuideFile read_guide_file(const std::filesystem::path& file) {
  return kGuideFormat.read(file, [&](const Json& json) {
    GuideFile guide;
    for (const Json& frame : json.at("frames")) {
      for_each_member(guide.frames.emplace_back(),
                      [&](const char* name, auto& value) { frame.at(name).get_to(value); });
    }
    guide.vertices = points_of(json.at("guide").at("vertices"));
    read_triangles(file, json.at("guide").at("triangles"), guide);
    for (const Json& change : json.at("constraints")) {
      guide.constraints.push_back({change.at("frame"), points_of(change.at("points"))});
    }
    for (const Json& line : json.at("glue")) guide.glue.push_back(line_of(line));
    for (const Json& line : json.at("forces")) guide.forces.push_back(line_of(line));
    return guide;
  });
}

}  // namespace pilesim
