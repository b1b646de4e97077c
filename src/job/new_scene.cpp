#include "job/new_scene.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/naming.h"
#include "core/output_directory.h"
#include "core/text.h"
#include "geometry/cache_file.h"
#include "geometry/convex_hull.h"
#include "geometry/mass_properties.h"
#include "geometry/mesh_import.h"
#include "geometry/obj_writer.h"
#include "geometry/solid.h"
#include "job/new_scene_texts.h"
#include "json/json_text.h"
#include "render/scene_renderer.h"
#include "scene/scene.h"

namespace pilesim {
namespace {

namespace fs = std::filesystem;

// Share of the hull's volume above which the hull is accurate enough.
constexpr double kNearlyConvex = 0.9;
constexpr double kGravity = 9.81;
constexpr double kThicknessOfFlat = 0.02;          // relative to the diameter
constexpr int kUsualCount = 60, kUsualHeap = 120;  // bodies

std::string number(double value) { return with_digits(value, 3); }

// The number as the scene file will contain it.
double rounded(double value) { return std::stod(number(value)); }

// True if even its hull has no volume.
bool is_flat(const TriangleMesh& mesh) {
  try {
    convex_hull(mesh.vertices);
    return false;
  } catch (const Error&) {
    return true;
  }
}

// Measures from which the sizes of a scene follow.
struct Measured {
  double radius_m = 0;  // about the centre of the bounds
  double hull_m3 = 0;   // of its hull: other bodies hardly enter its cavities
  bool has_inside = false, is_convex = false;
  double thickness_m = 0;  // for a flat mesh, thickness to give it
};

Measured measure(const TriangleMesh& mesh) {
  Measured measured;
  const Vec3 middle = mesh.bounds().center();
  for (const Vec3& vertex : mesh.vertices) {
    measured.radius_m = std::max(measured.radius_m, (vertex - middle).norm());
  }
  if (is_flat(mesh)) measured.thickness_m = rounded(kThicknessOfFlat * 2 * measured.radius_m);
  measured.is_convex = true;
  try {
    const TriangleMesh solid =
        make_solid(mesh, {.thickness_m = measured.thickness_m}, user_cache_directory()).mesh;
    measured.hull_m3 = mass_properties(convex_hull(solid.vertices)).volume_m3;
    const double volume_m3 = mass_properties(solid).volume_m3;
    measured.is_convex = volume_m3 > kNearlyConvex * measured.hull_m3;
    measured.has_inside = true;
  } catch (const Error&) {
    if (measured.thickness_m > 0) throw;
    // Use its hull; the scene says so.
    measured.hull_m3 = mass_properties(convex_hull(mesh.vertices)).volume_m3;
  }
  return measured;
}

std::string quoted(const std::string& text) { return Json(text).dump(); }

// Space that a body takes among its kind, m^3, if their hulls fill the share `packed`. Cylinders of
// length L and diameter D pack randomly to 5.4 D / L (Philipse 1996); this expresses it by hull and
// bounding sphere.
double room_of_each(const Measured& body, double packed) {
  constexpr double kLongPacked = 4.4;
  const double ball_m3 = 4 / 3.0 * kPi * std::pow(body.radius_m, 3);
  return std::max(body.hull_m3 / packed, std::sqrt(ball_m3 * body.hull_m3) / kLongPacked);
}

// Random loose packing of poured balls.
constexpr double kPoured = 0.55;

// A truncated cone with its base on the ground.
TriangleMesh cone(double base_m, double top_m, double height_m) {
  constexpr int kSides = 32;
  std::vector<Vec3> corners;
  for (int i = 0; i < kSides; ++i) {
    const double angle = 2 * kPi * i / kSides;
    const Vec3 out(std::cos(angle), 0, std::sin(angle));
    corners.push_back(base_m * out);
    corners.push_back(top_m * out + Vec3(0, height_m, 0));
  }
  return convex_hull(corners);
}

using Values = NewSceneValues;

// Bodies start at random in a cylinder of one body's height. Sets the rate: as many as fit through
// the mouth in the time in which a body falls by its diameter.
void set_mouth(const Measured& body, double radius, double centre, Values& values) {
  const double r = body.radius_m;
  values["radius"] = number(radius);
  values["height"] = number(2 * r);
  values["centre"] = number(centre);
  const double leaves_s = std::sqrt(4 * r / kGravity);
  values["rate"] = number(std::max(1.0, 0.5 * (radius / r) * (radius / r)) / leaves_s);
}

// A cone of `count` bodies at 30 degrees, and an emitter above its tip.
void size_pile(const Measured& body, int count, Values& values) {
  constexpr double kMouth = 2.5;  // radii of a body
  const double slope = std::tan(radians(30));
  const double height = std::cbrt(3 / kPi * slope * slope * count * room_of_each(body, kPoured));
  set_mouth(body, kMouth * body.radius_m, height + 2 * body.radius_m, values);
}

// Pixels of the pictures of a bin, and of the scene of a dataset.
constexpr std::array kBinPicture = {720, 720}, kDatasetPicture = {640, 480};

// A bin that the bodies fill slightly more than half, so that few rest above its rim. It is at
// least large enough for a body to turn over in it. It fills a picture of so many pixels.
void size_bin(const Measured& body, int count, const std::array<int, 2>& picture, Values& values) {
  constexpr double kFull = 0.55, kDepth = 0.6;           // depth relative to the side
  constexpr double kLeastSide = 2.6, kLeastDepth = 0.6;  // radii of a body
  const double r = body.radius_m, room_m3 = count * room_of_each(body, kPoured) / kFull;
  const double side = std::max(std::cbrt(room_m3 / kDepth), kLeastSide * r);
  const double depth = std::max(room_m3 / (side * side), kLeastDepth * r);
  const double wall = 0.05 * side, centre = depth + 2 * r;
  values["bin"] = number(side);
  values["depth"] = number(depth);
  values["wall"] = number(wall);
  // As low as the rim allows, and well within it: bodies that fall far, or onto others near the
  // rim, bounce out.
  set_mouth(body, std::max(0.1 * r, 0.5 * side - 1.6 * r), centre, values);
  // High enough that the near wall hides little; bin and emitter are both in the picture.
  const Vec3 direction = Vec3(0.45, 1.4, 0.9).normalized();
  std::vector<Vec3> corners;
  for (const double x : {-1, 1}) {
    for (const double z : {-1, 1}) {
      const double outside = 0.5 * side + wall, mouth = 0.5 * side - 0.2 * r;
      corners.emplace_back(x * outside, 0, z * outside);
      corners.emplace_back(x * outside, depth, z * outside);
      corners.emplace_back(x * mouth, centre + 2 * r, z * mouth);
    }
  }
  constexpr double kFilled = 0.92;  // of the picture
  const auto [width, height] = picture;
  const CameraKey key =
      frame_places(direction, corners, 0, static_cast<double>(width) / height, kFilled);
  const auto place = [](const Vec3& at) {
    return "[" + number(at.x()) + ", " + number(at.y()) + ", " + number(at.z()) + "]";
  };
  values["camera"] = "  \"camera\": {\"position\": " + place(key.position) +
                     ", \"target\": " + place(key.target) + "}";
  values["size"] = "[" + std::to_string(width) + ", " + std::to_string(height) + "]";
  values["away"] = number(std::hypot(key.position.x(), key.position.z()));
  values["above"] = number(key.position.y());
  values["target"] = number(key.target.y());
}

// A cone that about this many bodies fill. Rejects a given count that cannot form its shape.
TriangleMesh size_guide(const Measured& body, const NewSceneJob& job, Values& values) {
  constexpr double kTop = 0.3;  // relative to the base
  // Packing in a mould including its losses at the walls, by hull volume. From 60 bodies on it is
  // right within a third for boxes and cups; rings, which interlock, need half as many again.
  constexpr double kPacked = 0.7;
  const double each_m3 = room_of_each(body, kPacked);
  const double wall = body.radius_m;  // width of the empty zone at the walls
  // Radius of a base that is three bodies wide inside the empty zone, each as a ball of its share
  // of the space. The longest body can lie in it in any direction.
  const double least = std::max(wall + 3 * std::cbrt(3 / (4 * kPi) * each_m3), 2 * body.radius_m);
  // Volume of a cone of height 1.4 R whose top is kTop of its base, in R^3.
  const double share = kPi * 1.4 / 3 * (1 + kTop + kTop * kTop);
  const auto fewest = static_cast<int>(std::ceil(share * std::pow(least - wall, 3) / each_m3));
  if (job.count && *job.count < fewest) {
    throw Error(ErrorKind::usage,
                Problem{.file = "--count",
                        .found = std::to_string(*job.count) + " are too few to show a shape",
                        .expected = "at least " + std::to_string(fewest) +
                                    ", which fill a cone that is three of them wide"});
  }
  const int count = std::max(job.count.value_or(kUsualCount), fewest);
  values["count"] = std::to_string(count);
  // Long bodies side by side leave room for a few more for a long time.
  const bool is_long = each_m3 > body.hull_m3 / kPacked;
  values["limit"] = is_long ? ": about so many long ones fill it, more lie denser"
                            : ": as many as fit, about " + values.at("count");
  values["most"] = is_long ? ", \"count\": " + values.at("count") : "";
  const double base = wall + std::cbrt(count * each_m3 / share);
  return cone(base, kTop * base, 1.4 * base);
}

// Questions about a mesh file whose units or up axis look wrong.
std::vector<std::string> doubts(const NewSceneJob& job, const Eigen::AlignedBox3d& bounds,
                                double diameter_m) {
  constexpr double kLarge = 5, kSmall = 0.001;  // m
  std::vector<std::string> questions;
  const auto scaled = [&](double by) {
    return "--scale " + with_digits(by * job.scale, 6) + ", " + with_digits(by * diameter_m, 3) +
           " m across";
  };
  if (diameter_m > kLarge) {
    questions.push_back("is the file in millimetres (" + scaled(0.001) + "), or in centimetres (" +
                        scaled(0.01) + ")?");
  } else if (diameter_m < kSmall && job.scale < 1) {
    questions.push_back("is the file in metres? Then leave --scale out: " +
                        with_digits(diameter_m / job.scale, 3) + " m across");
  }
  if (job.is_z_up) return questions;
  // A body modelled to stand on the ground starts at 0 of its up axis.
  const Vec3 size = bounds.sizes(), low = bounds.min();
  const auto stands_on = [&](int axis) {
    return std::abs(low[axis]) < 1e-3 * size.norm() && size[axis] > 0.05 * size.norm();
  };
  if (stands_on(1)) return questions;
  const std::string ending = job.mesh.extension();
  if (stands_on(2) && low.y() < -0.1 * size.y()) {
    questions.emplace_back("it stands on z = 0: does z point up? Then say --up z");
  } else if (ending == ".stl" || ending == ".STL") {
    questions.emplace_back("z points up in most STL files: here, too? Then say --up z");
  }
  return questions;
}

void claim(const fs::path& file, const NewSceneJob& job) {
  std::error_code missing;
  if (fs::equivalent(file, job.mesh, missing)) {
    throw Error(ErrorKind::usage, Problem{.file = file.string(),
                                          .found = "is the mesh itself",
                                          .expected = "another file to write to",
                                          .remedy = "Choose another -o"});
  }
  claim_output_file(file, job.force);
}

}  // namespace

NewSceneSummary write_new_scene(const NewSceneJob& job) {
  claim(job.output, job);
  const bool has_guide = job.kind == NewSceneKind::guide;
  NewSceneSummary summary;
  if (has_guide) {
    summary.guide = fs::path(job.output).replace_extension(".guide.obj");
    claim(summary.guide, job);
  }
  TriangleMesh mesh = import_mesh(job.mesh, job.scale);
  const auto bounds = mesh.bounds();
  const bool is_z_up = job.is_z_up.value_or(false);
  if (is_z_up) turn_z_up_to_y_up(mesh);
  const Measured body = naming(job.mesh.string(), [&] { return measure(mesh); });
  summary.diameter_m = 2 * body.radius_m;
  summary.questions = doubts(job, bounds, summary.diameter_m);
  const fs::path directory = fs::absolute(job.output).parent_path();
  const fs::path relative = fs::absolute(job.mesh).lexically_proximate(directory);
  Values values = {
      {"name", quoted(job.mesh.stem().string())},
      {"file", quoted(relative.generic_string())},
      {"scale", with_digits(job.scale, 15)},
      {"up", is_z_up ? " \"up\": \"z\"," : ""},
      {"collision", !body.is_convex ? "decomposition" : "hull"},
      {"solid", body.thickness_m > 0 ? ",\n             // the mesh is flat\n"
                                       "             \"thickness_m\": " +
                                           number(body.thickness_m)
                : body.has_inside ? ""
                                  : ",\n             // the mesh is open: or give its sheets a "
                                    "\"thickness_m\"\n"
                                    "             \"solid\": \"hull\""},
      {"until",
       has_guide ? "" : "  \"until\": \"settled\",  // the run ends as soon as all is at rest\n"}};
  double busy_s = 0;
  int count = 0;
  if (job.kind == NewSceneKind::pile) {
    count = job.count.value_or(kUsualHeap);
    size_pile(body, count, values);
  } else if (has_guide) {
    write_obj(size_guide(body, job, values), summary.guide);
    summary.guided = std::stoi(values.at("count"));
    values["guide"] = quoted(summary.guide.filename().generic_string());
  } else {
    count = job.count.value_or(kUsualCount);
    size_bin(body, count, job.kind == NewSceneKind::bin ? kBinPicture : kDatasetPicture, values);
    values["fewest"] = std::to_string(std::max(1, count / 3));
  }
  if (!has_guide) {
    values["count"] = std::to_string(count);
    busy_s = 2 * count / std::stod(values.at("rate"));
  }
  // Long enough for rocking and rolling, which scale with the root of the size.
  values["duration"] = number(std::ceil(busy_s + 5 + 60 * std::sqrt(body.radius_m / kGravity)));
  summary.text = new_scene_text(job.kind, std::move(values));
  write_file_atomically(job.output, summary.text);
  return summary;
}

}  // namespace pilesim
