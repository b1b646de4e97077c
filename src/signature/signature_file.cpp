#include "signature/signature_file.h"

#include <array>
#include <bit>
#include <cstring>
#include <nlohmann/json.hpp>
#include <span>

#include "core/atomic_file.h"
#include "core/error.h"

namespace pilesim {
namespace {

using nlohmann::json;
static_assert(std::endian::native == std::endian::little, "typed arrays are written as they lie");

constexpr const char* kFormat = "pilesim signature";
constexpr const char* kPartialFormat = "pilesim partial signature";

// --- Typed arrays --------------------------------------------------------------------------------

// The tag of RFC 8746 for little-endian arrays of T.
template <typename T>
constexpr uint64_t array_tag() {
  if constexpr (std::is_same_v<T, float>) return 85;
  if constexpr (std::is_same_v<T, double>) return 86;
  if constexpr (std::is_same_v<T, int8_t>) return 72;
  if constexpr (std::is_same_v<T, uint32_t>) return 70;
  if constexpr (std::is_same_v<T, uint8_t>) return 64;
}

template <typename T>
json to_array(const std::vector<T>& values) {
  std::vector<uint8_t> bytes(values.size() * sizeof(T));
  if (!bytes.empty()) std::memcpy(bytes.data(), values.data(), bytes.size());
  return json::binary(std::move(bytes), array_tag<T>());
}

[[noreturn]] void damaged(const std::string& found, const std::string& expected) {
  // The file's name is added where it is known.
  throw Error(ErrorKind::input, {.found = found, .expected = expected});
}

template <typename T>
std::vector<T> from_array(const json& from, const char* name, size_t count) {
  const json& field = from.at(name);
  if (!field.is_binary() || !field.get_binary().has_subtype() ||
      field.get_binary().subtype() != array_tag<T>()) {
    damaged(std::string(name) + " is no array of the right type",
            "CBOR tag " + std::to_string(array_tag<T>()));
  }
  const json::binary_t& bytes = field.get_binary();
  if (bytes.size() != count * sizeof(T)) {
    damaged(std::string(name) + " has " + std::to_string(bytes.size()) + " bytes",
            std::to_string(count * sizeof(T)));
  }
  std::vector<T> values(count);
  if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

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
constexpr std::array kLayouts = {std::pair(TableLayout::dissertation, "dissertation"),
                                 std::pair(TableLayout::scale_free, "scale-free")};

// --- Parts ---------------------------------------------------------------------------------------

json to_json(const Axis& axis) {
  return {{"name", axis.name}, {"unit", axis.unit}, {"period", axis.period}, {"nodes", axis.nodes}};
}

Axis axis_of(const json& j) {
  Axis axis{
      .name = j.at("name"), .unit = j.at("unit"), .nodes = j.at("nodes"), .period = j.at("period")};
  if (axis.nodes.empty() || !std::is_sorted(axis.nodes.begin(), axis.nodes.end())) {
    damaged("axis " + axis.name + " has no ascending nodes", "at least one node");
  }
  return axis;
}

json to_json(const SignatureBody& body) {
  const Quat& q = body.principal_axes;
  return {{"mesh", body.mesh},
          {"mesh_hash", body.mesh_hash},
          {"scale", body.scale},
          {"hull_vertices", body.hull_vertices},
          {"volume_m3", body.volume_m3},
          {"centre_of_mass_m", to_numbers(body.centre_of_mass)},
          {"principal_inertia_m2", to_numbers(body.inertia_m2)},
          {"principal_axes_wxyz", json::array({q.w(), q.x(), q.y(), q.z()})},
          {"gyration_m", body.gyration_m},
          {"outer_radius_m", body.outer_radius_m}};
}

SignatureBody body_of(const json& j) {
  const auto q = j.at("principal_axes_wxyz").get<std::array<double, 4>>();
  return {.mesh = j.at("mesh"),
          .mesh_hash = j.at("mesh_hash"),
          .scale = j.at("scale"),
          .hull_vertices = j.at("hull_vertices"),
          .volume_m3 = j.at("volume_m3"),
          .centre_of_mass = vector_of(j.at("centre_of_mass_m")),
          .inertia_m2 = vector_of(j.at("principal_inertia_m2")),
          .principal_axes = Quat(q[0], q[1], q[2], q[3]),
          .gyration_m = j.at("gyration_m"),
          .outer_radius_m = j.at("outer_radius_m")};
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
  const size_t cells = table.cell_count();
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

// What a fit leaves of a table.
ResponseTable axes_of(const json& j) {
  ResponseTable table{.layout = from_name(kLayouts, j.at("layout"))};
  const json& axes = j.at("axes");
  if (axes.size() != table.axes.size()) damaged(std::to_string(axes.size()) + " axes", "4");
  for (size_t i = 0; i < table.axes.size(); ++i) table.axes[i] = axis_of(axes[i]);
  table.most_growth = j.at("most_growth");
  return table;
}

ResponseTable responses_of(const json& j) {
  ResponseTable table = axes_of(j);
  const size_t cells = table.cell_count();
  table.trials = from_array<float>(j, "trials", cells);
  table.mean = from_array<float>(j, "mean", 6 * cells);
  table.spread = from_array<float>(j, "spread", table.spread_size() * cells);
  table.mean_error = from_array<float>(j, "mean_error", 6 * cells);
  table.exemplar_count = j.at("exemplar_count");
  table.exemplar_unit = j.at("exemplar_unit");
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

// Over the axes of the table it stands for.
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

// The parts of a signature that differ where it is fitted: heights, responses and fit.
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
  signature.height_fit = field_of(heights.at("fit"), axes, 2);
  expand_heights(signature.height_fit, signature.heights);
}

// --- The rest ------------------------------------------------------------------------------------

json to_json(const KnownRestPose& pose) {
  return {{"up", to_numbers(pose.up)},
          {"height_m", pose.height_m},
          {"probability", pose.probability},
          {"probability_95", json::array({pose.probability_low, pose.probability_high})},
          {"source", pose.source},
          {"family", pose.family}};
}

KnownRestPose rest_pose_of(const json& j) {
  const auto interval = j.at("probability_95").get<std::array<double, 2>>();
  return {.up = vector_of(j.at("up")),
          .height_m = j.at("height_m"),
          .probability = j.at("probability"),
          .probability_low = interval[0],
          .probability_high = interval[1],
          .source = j.at("source"),
          .family = j.at("family")};
}

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
  AccuracyReport report{.collisions = j.at("collisions"),
                        .trials = j.at("trials"),
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

// --- Files ---------------------------------------------------------------------------------------

void write_cbor(const json& document, const std::filesystem::path& file) {
  const std::vector<uint8_t> bytes = json::to_cbor(document);
  write_file_atomically(file, std::as_bytes(std::span(bytes)));
}

// Parses `file`, checks that it is a `format`, and gives it to `parse`; what is wrong becomes an
// Error(input) that names the file.
template <typename Parse>
auto read_cbor(const std::filesystem::path& file, const char* format, const Parse& parse) {
  const std::string bytes = read_file(file);
  const auto refuse = [&](const std::string& found, const std::string& expected) {
    return Error(ErrorKind::input, {.file = file.string(),
                                    .found = found,
                                    .expected = expected,
                                    .remedy = "Make it again with pilesim sample-signature."});
  };
  json document;
  try {
    document = json::from_cbor(bytes, true, true, json::cbor_tag_handler_t::store);
  } catch (const json::exception& error) {
    throw refuse(std::string("no complete CBOR (") + error.what() + ")", "a signature of pilesim");
  }
  try {
    if (!document.is_object() || document.value("format", "") != format) {
      throw refuse("another kind of file", std::string("a ") + format);
    }
    const int version = document.at("version");
    if (version != kSignatureVersion) {
      throw refuse("format version " + std::to_string(version),
                   "version " + std::to_string(kSignatureVersion));
    }
    return parse(document);
  } catch (const json::exception& error) {
    throw refuse(std::string("a damaged signature: ") + error.what(), "a complete one");
  } catch (const Error& error) {
    if (!error.problems().front().file.empty()) throw;
    throw refuse(error.problems().front().found, error.problems().front().expected);
  }
}

}  // namespace

std::vector<uint8_t> encode_signature(const Signature& signature) {
  const ContactMaterial& m = signature.material;
  json document = {{"format", kFormat},
                   {"version", kSignatureVersion},
                   {"body", to_json(signature.body)},
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
  json poses = json::array();
  for (const KnownRestPose& pose : signature.rest_poses) poses.push_back(to_json(pose));
  document["rest_poses"] = poses;
  document["rest_drops"] = signature.rest_drops;
  if (signature.accuracy) document["accuracy"] = to_json(*signature.accuracy);
  return json::to_cbor(document);
}

void write_signature(const Signature& signature, const std::filesystem::path& file) {
  const std::vector<uint8_t> bytes = encode_signature(signature);
  write_file_atomically(file, std::as_bytes(std::span(bytes)));
}

Signature read_signature(const std::filesystem::path& file) {
  return read_cbor(file, kFormat, [](const json& document) {
    const json& material = document.at("material");
    Signature signature{
        .body = body_of(document.at("body")),
        .material = {.restitution = material.at("restitution"),
                     .friction = material.at("friction"),
                     .restitution_threshold_m_s = material.at("restitution_threshold_m_s")},
        .kind = from_name(kKinds, document.at("kind")),
        .seed = document.at("seed"),
        .sampling = {.trials_per_cell = document.at("sampling").at("trials_per_cell"),
                     .target_error = document.at("sampling").at("target_error")}};
    if (document.contains("fit")) {
      read_fit(document, signature);
    } else {
      signature.heights = heights_of(document.at("heights"));
      signature.responses = responses_of(document.at("responses"));
      signature.sampling.exemplars = signature.responses.exemplar_count;
    }
    for (const json& pose : document.at("rest_poses")) {
      signature.rest_poses.push_back(rest_pose_of(pose));
    }
    signature.rest_drops = document.at("rest_drops");
    if (document.contains("accuracy")) signature.accuracy = accuracy_of(document.at("accuracy"));
    return signature;
  });
}

void write_partial_sampling(const PartialSampling& partial, const std::filesystem::path& file) {
  const SamplingState& state = partial.state;
  write_cbor({{"format", kPartialFormat},
              {"version", kSignatureVersion},
              {"fingerprint", partial.fingerprint},
              {"cells", state.launched.size()},
              {"trials", state.responses.first.size()},
              {"launched", to_array(state.launched)},
              {"wanted", to_array(state.wanted)},
              {"first_node", to_array(state.responses.first)},
              {"keys", to_array(state.responses.keys)},
              {"responses", to_array(state.responses.values)}},
             file);
}

PartialSampling read_partial_sampling(const std::filesystem::path& file) {
  return read_cbor(file, kPartialFormat, [](const json& document) {
    const size_t cells = document.at("cells"), trials = document.at("trials");
    PartialSampling partial{.fingerprint = document.at("fingerprint")};
    SamplingState& state = partial.state;
    state.launched = from_array<uint32_t>(document, "launched", cells);
    state.wanted = from_array<uint32_t>(document, "wanted", cells);
    state.responses.first = from_array<uint32_t>(document, "first_node", trials);
    state.responses.keys = from_array<float>(document, "keys", 3 * trials);
    state.responses.values = from_array<float>(document, "responses", 6 * trials);
    return partial;
  });
}

}  // namespace pilesim
