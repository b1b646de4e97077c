#include "signature/signature_document.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <span>

#include "signature/rest/known_rest_poses.h"
#include "signature/typed_array.h"

namespace pilesim {
namespace {

using nlohmann::json;

// Most cells of a table; the dissertation's has 29,120. A few bytes of splines can describe many
// cells: this bounds their expansion.
constexpr size_t kMostCells = size_t{1} << 18;
constexpr size_t kMostNodes = 1024;  // most nodes of an axis; the longest has 26
constexpr const char* kGeometry = "geometry";
constexpr const char* kSimulation = "simulation";

json to_numbers(const Vec3& v) { return json::array({v.x(), v.y(), v.z()}); }
Vec3 vector_of(const json& j) {
  const auto v = j.get<std::array<double, 3>>();
  return {v[0], v[1], v[2]};
}

// --- Enumerations --------------------------------------------------------------------------------

template <typename T, size_t N>
T from_name(const std::array<std::pair<T, const char*>, N>& names, const std::string& text) {
  for (const auto& [value, name] : names) {
    if (text == name) return value;
  }
  damaged("\"" + text + "\"", "a name that this version knows");
}
template <typename T, size_t N>
std::string to_name(const std::array<std::pair<T, const char*>, N>& names, T value) {
  for (const auto& [v, name] : names) {
    if (v == value) return name;
  }
  return {};
}
constexpr std::array kKinds = {std::pair(TrialKind::micro, "micro"),
                               std::pair(TrialKind::macro, "macro")};
constexpr std::array kSolidRules = {
    std::pair(SolidRule::automatic, "auto"), std::pair(SolidRule::exact, "exact"),
    std::pair(SolidRule::wrap, "wrap"), std::pair(SolidRule::hull, "hull")};
constexpr std::array kLayouts = {std::pair(TableLayout::dissertation, "dissertation"),
                                 std::pair(TableLayout::scale_free, "scale-free")};

// --- Parts ---------------------------------------------------------------------------------------

json to_json(const Axis& axis) {
  return {{"name", axis.name}, {"unit", axis.unit}, {"period", axis.period}, {"nodes", axis.nodes}};
}

Axis axis_of(const json& j) {
  Axis axis{
      .name = j.at("name"), .unit = j.at("unit"), .nodes = j.at("nodes"), .period = j.at("period")};
  const bool finite = std::ranges::all_of(axis.nodes, [](float x) { return std::isfinite(x); });
  if (axis.nodes.empty() || !finite || !std::ranges::is_sorted(axis.nodes)) {
    damaged("axis " + axis.name + " has no ascending nodes", "at least one node");
  }
  if (axis.nodes.size() > kMostNodes) {
    damaged("axis " + axis.name + " has " + std::to_string(axis.nodes.size()) + " nodes",
            "at most " + std::to_string(kMostNodes));
  }
  if (axis.period != 0 && !(axis.period > axis.nodes.back() - axis.nodes.front())) {
    damaged("axis " + axis.name + " has nodes beyond its period", "all within one");
  }
  return axis;
}

// Number of cells for axes of these sizes, checked against kMostCells.
size_t cells_of(std::initializer_list<size_t> sizes) {
  size_t cells = 1;
  for (const size_t size : sizes) {
    if (size > kMostCells / cells) {
      damaged("a table of more than " + std::to_string(kMostCells) + " cells", "fewer");
    }
    cells *= size;
  }
  return cells;
}

json to_json(const SignatureBody& body) {
  const Quat& q = body.principal_axes;
  json j = {{"mesh", body.mesh},
            {"mesh_hash", body.mesh_hash},
            {"scale", body.scale},
            {"hull_vertices", body.hull_vertices},
            {"volume_m3", body.volume_m3},
            {"centre_of_mass_m", to_numbers(body.centre_of_mass)},
            {"principal_inertia_m2", to_numbers(body.inertia_m2)},
            {"principal_axes_wxyz", json::array({q.w(), q.x(), q.y(), q.z()})},
            {"gyration_m", body.gyration_m},
            {"outer_radius_m", body.outer_radius_m}};
  if (body.solid != SolidOptions{}) {
    j["solid"] = {{"rule", to_name(kSolidRules, body.solid.rule)},
                  {"thickness_m", body.solid.thickness_m},
                  {"hull_max_vertices", body.solid.hull_max_vertices}};
  }
  return j;
}

SolidOptions solid_of(const json& j) {
  return {.rule = from_name(kSolidRules, j.at("rule")),
          .thickness_m = number_of(j, "thickness_m", 0, 1e30),
          .hull_max_vertices = static_cast<int>(whole_number_of<uint8_t>(j, "hull_max_vertices"))};
}

SignatureBody body_of(const json& j) {
  const auto q = j.at("principal_axes_wxyz").get<std::array<double, 4>>();
  constexpr double kLeast = 1e-30, kMost = 1e30;
  return {.mesh = j.at("mesh"),
          .mesh_hash = j.at("mesh_hash"),
          .scale = number_of(j, "scale", kLeast, kMost),
          .solid = j.contains("solid") ? solid_of(j.at("solid")) : SolidOptions{},
          .hull_vertices = whole_number_of<uint32_t>(j, "hull_vertices"),
          .volume_m3 = number_of(j, "volume_m3", kLeast, kMost),
          .centre_of_mass = vector_of(j.at("centre_of_mass_m")),
          .inertia_m2 = vector_of(j.at("principal_inertia_m2")),
          .principal_axes = Quat(q[0], q[1], q[2], q[3]),
          .gyration_m = number_of(j, "gyration_m", kLeast, kMost),
          .outer_radius_m = number_of(j, "outer_radius_m", kLeast, kMost)};
}

json to_json(const CollisionHeightTable& table) {
  return {{"layout", to_name(kLayouts, table.layout)},
          {"spin", to_json(table.spin)},
          {"tilt", to_json(table.tilt)},
          {"trials", to_array(table.trials)},
          {"mean_m", to_array(table.mean_m)},
          {"deviation_m", to_array(table.deviation_m)},
          {"error_m", to_array(table.error_m)}};
}

CollisionHeightTable heights_of(const json& j) {
  CollisionHeightTable table{.layout = from_name(kLayouts, j.at("layout")),
                             .spin = axis_of(j.at("spin")),
                             .tilt = axis_of(j.at("tilt"))};
  const size_t cells = cells_of({table.spin.size(), table.tilt.size()});
  table.trials = from_array<float>(j, "trials", cells);
  table.mean_m = from_array<float>(j, "mean_m", cells);
  table.deviation_m = from_array<float>(j, "deviation_m", cells);
  table.error_m = from_array<float>(j, "error_m", cells);
  return table;
}

json to_json(const ResponseTable& table) {
  json axes = json::array();
  for (const Axis& axis : table.axes) axes.push_back(to_json(axis));
  return {{"layout", to_name(kLayouts, table.layout)}, {"axes", axes},
          {"trials", to_array(table.trials)},          {"mean", to_array(table.mean)},
          {"spread", to_array(table.spread)},          {"mean_error", to_array(table.mean_error)},
          {"most_growth", table.most_growth},          {"exemplar_count", table.exemplar_count},
          {"exemplar_unit", table.exemplar_unit},      {"exemplars", to_array(table.exemplars)}};
}

// The table of a fitted signature: axes without cells.
ResponseTable axes_of(const json& j) {
  ResponseTable table{.layout = from_name(kLayouts, j.at("layout"))};
  const json& axes = j.at("axes");
  if (axes.size() != table.axes.size()) damaged(std::to_string(axes.size()) + " axes", "4");
  for (size_t i = 0; i < table.axes.size(); ++i) table.axes[i] = axis_of(axes[i]);
  cells_of(
      {table.axes[0].size(), table.axes[1].size(), table.axes[2].size(), table.axes[3].size()});
  table.most_growth = static_cast<float>(number_of(j, "most_growth", 1, 1e30));
  return table;
}

ResponseTable responses_of(const json& j) {
  ResponseTable table = axes_of(j);
  const size_t cells = table.cell_count();
  table.trials = from_array<float>(j, "trials", cells);
  table.mean = from_array<float>(j, "mean", 6 * cells);
  table.spread = from_array<float>(j, "spread", table.spread_size() * cells);
  table.mean_error = from_array<float>(j, "mean_error", 6 * cells);
  table.exemplar_count = whole_number_of<uint32_t>(j, "exemplar_count");
  table.exemplar_unit = static_cast<float>(number_of(j, "exemplar_unit", 0, 1e30));
  table.exemplars = from_array<int8_t>(j, "exemplars", 6 * cells * table.exemplar_count);
  return table;
}

// --- Fits ----------------------------------------------------------------------------------------

json to_json(const SplineField& field) {
  std::vector<int> degrees, points;
  std::vector<float> parameters;
  for (const SplineAxis& axis : field.axes) {
    degrees.push_back(axis.basis.degree());
    points.push_back(axis.basis.control_points());
    parameters.insert(parameters.end(), axis.parameters.begin(), axis.parameters.end());
  }
  return {{"degree", degrees},
          {"control_points", points},
          {"parameters", to_array(parameters)},
          {"low", to_array(field.low)},
          {"step", to_array(field.step)},
          {"bits", to_array(field.bits)},
          {"levels", to_array(pack_levels(field))}};
}

// A field over the axes of the table it replaces.
SplineField field_of(const json& j, std::span<const Axis> axes, size_t width) {
  SplineField field{.width = width};
  const auto degrees = j.at("degree").get<std::vector<int>>();
  const auto points = j.at("control_points").get<std::vector<int>>();
  if (degrees.size() != axes.size() || points.size() != axes.size()) {
    damaged("a spline over " + std::to_string(degrees.size()) + " axes",
            std::to_string(axes.size()));
  }
  size_t nodes = 0;
  for (const Axis& axis : axes) nodes += axis.size();
  const auto parameters = from_array<float>(j, "parameters", nodes);
  auto from = parameters.begin();
  for (size_t i = 0; i < axes.size(); ++i) {
    const auto size = static_cast<ptrdiff_t>(axes[i].size());
    if (degrees[i] < 0 || degrees[i] > kMostDegree || points[i] <= degrees[i] || points[i] > size) {
      damaged("degree " + std::to_string(degrees[i]) + " with " + std::to_string(points[i]) +
                  " control points on axis " + axes[i].name,
              "a spline that this version evaluates");
    }
    if (!std::is_sorted(from, from + size) || *from < 0 || *(from + size - 1) > 1) {
      damaged("parameters of axis " + axes[i].name, "ascending ones from 0 to 1");
    }
    field.axes.push_back({.axis = axes[i],
                          .parameters = {from, from + size},
                          .basis = BSplineBasis(degrees[i], points[i], axes[i].period > 0)});
    from += size;
  }
  field.low = from_array<float>(j, "low", width);
  field.step = from_array<float>(j, "step", width);
  field.bits = from_array<uint8_t>(j, "bits", width);
  for (const uint8_t bits : field.bits) {
    if (bits > kMostBits) damaged(std::to_string(bits) + " bits", "at most 16");
  }
  unpack_levels(from_array<uint8_t>(j, "levels", packed_size(field.control_points(), field.bits)),
                field);
  return field;
}

constexpr std::array kCoordinates = {std::pair(ResponseCoordinates::cartesian, "cartesian"),
                                     std::pair(ResponseCoordinates::spherical, "spherical")};
constexpr std::array kParametrisations = {std::pair(Parametrisation::uniform, "uniform"),
                                          std::pair(Parametrisation::centripetal, "centripetal")};

// Adds the parts that differ in a fitted signature: heights, responses and fit.
void add_fit(const Signature& signature, json& document) {
  const ResponseTable& table = signature.responses;
  const ResponseFit& fit = *signature.fit;
  json axes = json::array();
  for (const Axis& axis : table.axes) axes.push_back(to_json(axis));
  document["responses"] = {{"layout", to_name(kLayouts, table.layout)},
                           {"axes", axes},
                           {"most_growth", table.most_growth}};
  document["fit"] = {{"coordinates", to_name(kCoordinates, fit.coordinates)},
                     {"parametrisation", to_name(kParametrisations, fit.parametrisation)},
                     {"mean", to_json(fit.mean)},
                     {"spread", to_json(fit.spread)}};
  document["heights"] = {{"layout", to_name(kLayouts, signature.heights.layout)},
                         {"spin", to_json(signature.heights.spin)},
                         {"tilt", to_json(signature.heights.tilt)},
                         {"fit", to_json(signature.height_fit)}};
}

void read_fit(const json& document, Signature& signature) {
  const json& j = document.at("fit");
  ResponseTable& table = signature.responses = axes_of(document.at("responses"));
  ResponseFit& fit = signature.fit.emplace();
  fit.coordinates = from_name(kCoordinates, j.at("coordinates"));
  fit.parametrisation = from_name(kParametrisations, j.at("parametrisation"));
  fit.mean = field_of(j.at("mean"), table.axes, mean_width(fit.coordinates));
  fit.spread = field_of(j.at("spread"), table.axes, table.spread_size());
  const json& heights = document.at("heights");
  signature.heights = {.layout = from_name(kLayouts, heights.at("layout")),
                       .spin = axis_of(heights.at("spin")),
                       .tilt = axis_of(heights.at("tilt"))};
  const std::array axes = {signature.heights.spin, signature.heights.tilt};
  cells_of({axes[0].size(), axes[1].size()});
  signature.height_fit = field_of(heights.at("fit"), axes, 2);
  expand_heights(signature.height_fit, signature.heights);
}

// --- Rest poses ----------------------------------------------------------------------------------

// One array per column, since a fitted signature spends few bytes on a pose. The interval of a
// probability is not stored: it follows from the drops.
json to_json(const std::vector<KnownRestPose>& poses) {
  std::vector<float> up, height, probability;
  std::vector<uint8_t> simulated;
  std::vector<uint32_t> family;
  for (const KnownRestPose& pose : poses) {
    for (const double component : pose.up) up.push_back(static_cast<float>(component));
    height.push_back(static_cast<float>(pose.height_m));
    probability.push_back(static_cast<float>(pose.probability));
    simulated.push_back(pose.source == kSimulation ? 1 : 0);
    family.push_back(pose.family);
  }
  return {{"count", poses.size()},
          {"up", to_array(up)},
          {"height_m", to_array(height)},
          {"probability", to_array(probability)},
          {"simulated", to_array(simulated)},
          {"family", to_array(family)}};
}

std::vector<KnownRestPose> rest_poses_of(const json& j, uint32_t drops) {
  const auto count = whole_number_of<uint32_t>(j, "count");
  const auto up = from_array<float>(j, "up", size_t{3} * count);
  const auto height = from_array<float>(j, "height_m", count);
  const auto probability = from_array<float>(j, "probability", count);
  const auto simulated = from_array<uint8_t>(j, "simulated", count);
  const auto family = from_array<uint32_t>(j, "family", count);
  std::vector<KnownRestPose> poses;
  for (size_t i = 0; i < count; ++i) {
    KnownRestPose pose{.up = Vec3(up[3 * i], up[3 * i + 1], up[3 * i + 2]),
                       .height_m = height[i],
                       .probability = probability[i],
                       .probability_low = probability[i],
                       .probability_high = probability[i],
                       .source = simulated[i] != 0 ? kSimulation : kGeometry,
                       .family = family[i]};
    if (std::abs(pose.up.norm() - 1) > 1e-5 || !(pose.height_m > 0) ||
        !(pose.probability >= 0 && pose.probability <= 1)) {
      damaged("rest pose " + std::to_string(i) + " is none",
              "a unit direction, a height above 0 and a probability");
    }
    if (simulated[i] != 0) {
      if (drops == 0) damaged("a rest pose by simulation without drops", "drops");
      const ShareInterval interval = wilson_interval(std::round(pose.probability * drops), drops);
      pose.probability_low = interval.low;
      pose.probability_high = interval.high;
    }
    poses.push_back(pose);
  }
  return poses;
}

// --- Packing -------------------------------------------------------------------------------------

std::vector<float> numbers_of(const PackingFigures& f) {
  std::vector<float> numbers;
  for (const auto figure : kPackingFigures) numbers.push_back(static_cast<float>(f.*figure));
  return numbers;
}

PackingFigures packing_figures_of(const json& j, const char* name) {
  const std::vector<float> numbers = from_array<float>(j, name, kPackingFigures.size());
  PackingFigures figures;
  for (size_t i = 0; i < numbers.size(); ++i) {
    if (numbers[i] < 0) damaged(std::string(name) + " of the packing has a number below 0", "none");
    figures.*kPackingFigures[i] = numbers[i];
  }
  return figures;
}

json to_json(const Packing& packing) {
  return {{"pours", packing.pours},
          {"measured", to_array(numbers_of(packing.measured))},
          {"error", to_array(numbers_of(packing.error))},
          {"spheres", to_array(numbers_of(packing.spheres))},
          {"radius_m", packing.radius_m},
          {"rolling", packing.rolling},
          {"turning", packing.turning},
          {"leaning", packing.leaning},
          {"rebound", packing.rebound}};
}

// A radius is a float in the simulators, and lies within the object's own.
Packing packing_of(const json& j, double outer_radius_m) {
  const double least_m = 1e-3 * outer_radius_m, most_m = 1.001 * outer_radius_m;
  Packing packing{.pours = whole_number_of<uint32_t>(j, "pours"),
                  .measured = packing_figures_of(j, "measured"),
                  .error = packing_figures_of(j, "error"),
                  .spheres = packing_figures_of(j, "spheres"),
                  .radius_m = number_of(j, "radius_m", least_m, most_m),
                  .rolling = number_of(j, "rolling", 0, 10),
                  .turning = number_of(j, "turning", 0, 10),
                  .leaning = number_of(j, "leaning", 0, 10),
                  .rebound = number_of(j, "rebound", 0, 1)};
  if (packing.pours == 0) damaged("a packing of no pours", "some");
  return packing;
}

// --- Accuracy ------------------------------------------------------------------------------------

json to_json(const AccuracyReport& report) {
  json models = json::array();
  for (const ModelAccuracy& m : report.models) {
    models.push_back({{"model", m.model},
                      {"distance", m.distance},
                      {"worst", m.worst},
                      {"energy_gain", m.energy_gain},
                      {"inward", m.inward}});
  }
  return {{"collisions", report.collisions},
          {"trials", report.trials},
          {"noise_floor", report.noise_floor},
          {"true_energy_gain", report.true_energy_gain},
          {"height_unexplained", report.height_unexplained},
          {"models", models}};
}

AccuracyReport accuracy_of(const json& j) {
  AccuracyReport report{.collisions = whole_number_of<uint32_t>(j, "collisions"),
                        .trials = whole_number_of<uint32_t>(j, "trials"),
                        .noise_floor = j.at("noise_floor"),
                        .true_energy_gain = j.at("true_energy_gain"),
                        .height_unexplained = j.at("height_unexplained")};
  for (const json& m : j.at("models")) {
    report.models.push_back({.model = m.at("model"),
                             .distance = m.at("distance"),
                             .worst = m.at("worst"),
                             .energy_gain = m.at("energy_gain"),
                             .inward = m.at("inward")});
  }
  return report;
}

}  // namespace

json signature_document(const Signature& signature) {
  const ContactMaterial& m = signature.material;
  json document = {{"body", to_json(signature.body)},
                   {"material",
                    {{"restitution", m.restitution},
                     {"friction", m.friction},
                     {"restitution_threshold_m_s", m.restitution_threshold_m_s}}},
                   {"kind", to_name(kKinds, signature.kind)},
                   {"seed", signature.seed},
                   {"sampling",
                    {{"trials_per_cell", signature.sampling.trials_per_cell},
                     {"target_error", signature.sampling.target_error}}}};
  if (signature.fit) {
    add_fit(signature, document);
  } else {
    document["heights"] = to_json(signature.heights);
    document["responses"] = to_json(signature.responses);
  }
  document["rest_poses"] = to_json(signature.rest_poses);
  document["rest_drops"] = signature.rest_drops;
  if (signature.collisions) {
    document["collisions"] = {{"file", signature.collisions->file},
                              {"count", signature.collisions->count}};
  }
  if (signature.packing) document["packing"] = to_json(*signature.packing);
  if (signature.accuracy) document["accuracy"] = to_json(*signature.accuracy);
  return document;
}

Signature signature_of(const json& document) {
  const json& material = document.at("material");
  Signature signature{.body = body_of(document.at("body")),
                      .material = {.restitution = number_of(material, "restitution", 0, 1),
                                   .friction = number_of(material, "friction", 0, 1e30),
                                   .restitution_threshold_m_s =
                                       number_of(material, "restitution_threshold_m_s", 0, 1e30)},
                      .kind = from_name(kKinds, document.at("kind")),
                      .seed = whole_number_of<uint64_t>(document, "seed"),
                      .sampling = {.trials_per_cell = whole_number_of<uint32_t>(
                                       document.at("sampling"), "trials_per_cell"),
                                   .target_error = document.at("sampling").at("target_error")}};
  if (document.contains("fit")) {
    read_fit(document, signature);
  } else {
    signature.heights = heights_of(document.at("heights"));
    signature.responses = responses_of(document.at("responses"));
    signature.sampling.exemplars = signature.responses.exemplar_count;
  }
  signature.rest_drops = whole_number_of<uint32_t>(document, "rest_drops");
  signature.rest_poses = rest_poses_of(document.at("rest_poses"), signature.rest_drops);
  if (document.contains("collisions")) {
    const json& from = document.at("collisions");
    signature.collisions = {.file = from.at("file"),
                            .count = whole_number_of<uint64_t>(from, "count")};
  }
  if (document.contains("packing")) {
    signature.packing = packing_of(document.at("packing"), signature.body.outer_radius_m);
  }
  if (document.contains("accuracy")) signature.accuracy = accuracy_of(document.at("accuracy"));
  return signature;
}

}  // namespace pilesim
