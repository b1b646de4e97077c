#include "model/mesh_hints.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "core/text.h"
#include "geometry/convex_hull.h"
#include "geometry/mass_properties.h"
#include "geometry/surface_distance.h"

namespace pilesim {
namespace {

// Files are mistaken by 100 (centimetres, Blender's FBX) or 1000 (millimetres). Each limit leaves
// room to the right scenes of presets/ and lies below the sizes that such a mistake gives them.
constexpr double kLongestMoving = 5, kLongest = 20, kShortest = 2e-3;  // m, at "scale" 1
constexpr double kOfStanding = 5;        // longest that moves against all that stands
constexpr double kOfMoving = 3000;       // longest that stands against all that moves
constexpr double kOfOthers = 30;         // against the others that move
constexpr double kLeastOfOthers = 0.01;  // against them, whether it moves or not
constexpr double kOfCamera = 2;          // against the camera's way to its target
constexpr double kLeastOfCamera = 3e-4;  // a fifth of a pixel or so

// A mesh stands on an axis that ends in a flat base.
constexpr double kBaseHeight = 1e-3;  // of the mesh's length
constexpr double kLeastBase = 0.01;   // of the area below it
constexpr double kFlattest = 0.25;    // a thing that stands is no flatter

std::string metres(double length) { return with_digits(length, 3) + " m"; }

// Fixed objects of the scene other than the ground, and moving ones.
class Surroundings {
 public:
  explicit Surroundings(const Model& model) {
    std::vector<uint8_t> moves(model.shapes.size(), 0);
    Bounds standing;
    for (const ModelBody& body : model.bodies) {
      const ModelShape& shape = model.shapes[body.shape];
      used_.insert(shape.source);
      if (body.role == Role::dynamic) {
        moves[body.shape] = 1;
      } else if (!shape.mesh.vertices.empty()) {
        const Vec3 reach = Vec3::Constant(shape.bounding_radius);
        standing.extend(Bounds(body.pose.position - reach, body.pose.position + reach));
      }
    }
    if (!standing.isEmpty()) standing_m_ = standing.sizes().maxCoeff();
    for (size_t i = 0; i < model.shapes.size(); ++i) {
      if (moves[i] == 0) continue;
      moving_.emplace_back(model.shapes[i].source,
                           model.shapes[i].mesh.bounds().sizes().maxCoeff());
    }
  }

  bool moves(const std::string& source) const {
    return std::ranges::any_of(moving_, [&](const auto& each) { return each.first == source; });
  }
  bool is_there(const std::string& source) const { return used_.contains(source); }
  double standing_m() const { return standing_m_; }  // 0: nothing
  double longest_moving_m() const {
    double longest = 0;
    for (const auto& [source, length_m] : moving_) longest = std::max(longest, length_m);
    return longest;
  }
  // The median length of moving bodies of other shapes; 0: there are none.
  double others_m(const std::string& source) const {
    std::vector<double> lengths;
    for (const auto& [other, length_m] : moving_) {
      if (other != source) lengths.push_back(length_m);
    }
    if (lengths.empty()) return 0;
    const auto middle = lengths.begin() + static_cast<std::ptrdiff_t>(lengths.size() / 2);
    std::ranges::nth_element(lengths, middle);
    return *middle;
  }

 private:
  std::vector<std::pair<std::string, double>> moving_;  // source and length, m
  double standing_m_ = 0;
  std::set<std::string> used_;
};

// The longest way from the camera to its target; 0: there is none.
double camera_distance(const Scene& scene) {
  double farthest = 0;
  for (const CameraKey& key : scene.camera.keys) {
    farthest = std::max(farthest, (key.position - key.target).norm());
  }
  return farthest;
}

std::string too_long(const Scene& scene, const Surroundings& around, const ModelShape& shape,
                     double length) {
  const bool moves = around.moves(shape.source);
  const bool has_unit = shape.file_scale != 1;  // somebody has thought of it
  if (!moves) {
    if (length > kLongest && !has_unit) return "it is large";
    const double moving = around.longest_moving_m();
    if (moving > 0 && length > kOfMoving * moving)
      return "what moves is " + metres(moving) + " long";
    return "";
  }
  if (around.standing_m() > 0 && length > kOfStanding * around.standing_m()) {
    return "all that stands there is " + metres(around.standing_m()) + " long";
  }
  if (const double others = around.others_m(shape.source);
      others > 0 && length > kOfOthers * others) {
    return "others that move are " + metres(others) + " long";
  }
  if (const double away = camera_distance(scene); away > 0 && length > kOfCamera * away) {
    return "the camera is " + metres(away) + " from its target";
  }
  if (const double g = scene.gravity.norm(); g > 0) {
    const double falls_s = std::sqrt(2 * length / g);
    if (falls_s > scene.duration_s) {
      return "it takes " + with_digits(falls_s, 3) + " s to fall by its own length, and the run " +
             with_digits(scene.duration_s, 3) + " s";
    }
  }
  return length > kLongestMoving && !has_unit ? "it is large" : "";
}

std::string too_short(const Scene& scene, const Surroundings& around, const ModelShape& shape,
                      double length) {
  if (length < kShortest && shape.file_scale == 1) return "it is tiny";
  if (const double others = around.others_m(shape.source); length < kLeastOfOthers * others) {
    return "others that move are " + metres(others) + " long";
  }
  if (!around.moves(shape.source)) return "";
  if (length < around.standing_m() / kOfMoving) {
    return "all that stands there is " + metres(around.standing_m()) + " long";
  }
  const double away = camera_distance(scene);
  if (length < kLeastOfCamera * away) return "the camera is " + metres(away) + " from its target";
  return "";
}

// Whether there is one.
bool add_unit_hint(const Scene& scene, const Surroundings& around, const ModelShape& shape,
                   std::vector<std::string>& hints) {
  const double length = shape.mesh.bounds().sizes().maxCoeff();
  const auto hint = [&](const std::string& reason, double first, const std::string& first_unit,
                        double second, const std::string& second_unit) {
    const auto way = [&](double factor, const std::string& unit) {
      return with_digits(factor * shape.file_scale, 4) + " makes it " + metres(factor * length) +
             " (" + unit + ')';
    };
    hints.push_back(shape.source + " is " + metres(length) + " long, and " + reason +
                    ": if that is wrong, \"scale\": " + way(first, first_unit) + ", " +
                    way(second, second_unit) +
                    "; if it is right, say \"size_m\": " + with_digits(length, 3));
  };
  if (const std::string large = too_long(scene, around, shape, length); !large.empty()) {
    hint(large, 0.01, "from centimetres, or Blender's FBX", 0.001, "from millimetres");
  } else if (const std::string small = too_short(scene, around, shape, length); !small.empty()) {
    hint(small, 100, "a scale for centimetres was too much", 1000, "one for millimetres");
  } else {
    return false;
  }
  return true;
}

// Hint for primitives, whose size may be in another unit. A camera as near as such a small object
// needs shows that the size is meant.
void add_size_hint(const Scene& scene, const Surroundings& around, const ModelShape& shape,
                   std::vector<std::string>& hints) {
  if (shape.mesh.vertices.empty() || !around.is_there(shape.source)) return;
  const double length = shape.mesh.bounds().sizes().maxCoeff();
  const double others = around.others_m(shape.source);
  if (length >= kLeastOfOthers * others) return;
  if (length > kLeastOfOthers * camera_distance(scene) && !scene.camera.keys.empty()) return;
  hints.push_back(shape.source + " is " + metres(length) + " long, and others that move are " +
                  metres(others) + " long: lengths of a scene are in metres");
}

// The area of triangles that lie in the lowest plane of an axis, as a share of the bounds'
// rectangle there.
double base_of(const TriangleMesh& mesh, int axis) {
  const Bounds bounds = mesh.bounds();
  const Vec3 sizes = bounds.sizes();
  const double highest = bounds.min()[axis] + kBaseHeight * sizes.maxCoeff();
  double area = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
    if (std::max({p[axis], q[axis], r[axis]}) > highest) continue;
    area += 0.5 * std::abs((q - p).cross(r - p)[axis]);
  }
  const double rectangle = sizes[(axis + 1) % 3] * sizes[(axis + 2) % 3];
  return rectangle > 0 ? area / rectangle : 0;
}

// That it stands with its z up on the file's origin, which is in the middle of its y.
bool stands_on_z(const ModelShape& shape) {
  const Bounds bounds = shape.mesh.bounds();
  const Vec3 sizes = bounds.sizes(), middle = bounds.center() + shape.origin_offset;
  const double bottom = bounds.min().z() + shape.origin_offset.z();
  if (std::abs(bottom) > kBaseHeight * sizes.maxCoeff()) return false;
  if (std::abs(middle.y()) > 0.25 * sizes.y()) return false;
  if (sizes.z() < kFlattest * std::max(sizes.x(), sizes.y())) return false;
  return base_of(shape.mesh, 2) > kLeastBase;
}

// That a body or an emitter has it as it stands in its file, or turned about the vertical.
bool is_placed_upright(const Scene& scene, const std::string& shape) {
  const auto keeps_up = [](const Quat& orientation) {
    return (orientation * Vec3::UnitY()).y() > 1 - 1e-6;
  };
  return std::ranges::any_of(scene.bodies,
                             [&](const Body& body) {
                               return body.shape == shape && keeps_up(body.pose.orientation);
                             }) ||
         std::ranges::any_of(scene.emitters, [&](const Emitter& emitter) {
           return emitter.orientation && keeps_up(*emitter.orientation) &&
                  std::ranges::find(emitter.shapes, shape) != emitter.shapes.end();
         });
}

void add_axis_hint(const Scene& scene, const MeshShape& source, const ModelShape& shape,
                   std::vector<std::string>& hints) {
  if (source.up || !is_placed_upright(scene, shape.source)) return;
  std::string ending = source.file.extension().string();
  std::ranges::transform(ending, ending.begin(), [](unsigned char c) { return std::tolower(c); });
  const bool is_usually_z_up = ending == ".stl" || ending == ".ply";
  const bool stands_on_y = base_of(shape.mesh, 1) > kLeastBase;
  if (!stands_on_z(shape) && (!is_usually_z_up || stands_on_y)) return;
  hints.push_back(shape.source + " seems to lie: " +
                  (is_usually_z_up ? "in most " + ending.substr(1) + " files z is up"
                                   : "it stands on its file's z = 0") +
                  "; \"up\": \"z\" turns it, \"up\": \"y\" says that it is right");
}

// Hint for a hull that loses much by its vertex limit.
void add_hull_hint(const MeshShape& source, const ModelShape& shape,
                   std::vector<std::string>& hints) {
  constexpr double kMostLost = 0.01;  // of the volume of the whole hull
  constexpr int kMostVertices = 255;
  const bool is_hull =
      source.collision == CollisionKind::automatic || source.collision == CollisionKind::hull;
  if (!is_hull || shape.pieces.size() != 1) return;
  const TriangleMesh& hull = shape.pieces[0].hull;
  if (hull.vertices.size() != static_cast<size_t>(source.hull_max_vertices)) return;
  const TriangleMesh whole = convex_hull(shape.mesh.vertices);
  const double volume = mass_properties(whole).volume_m3;
  const auto lost = [&](const TriangleMesh& part) {
    return 1 - mass_properties(part).volume_m3 / volume;
  };
  if (lost(hull) <= kMostLost) return;
  // How many vertices are enough is found by halves: with each one less is lost.
  int few = source.hull_max_vertices, enough = kMostVertices;
  const double least = lost(simplified_hull(whole.vertices, enough));
  while (least <= kMostLost && enough - few > 1) {
    const int middle = (few + enough) / 2;
    (lost(simplified_hull(whole.vertices, middle)) <= kMostLost ? enough : few) = middle;
  }
  const auto percent = [](double share) { return with_digits(100 * share, 2) + " %"; };
  hints.push_back(shape.source + ": its hull of " + std::to_string(hull.vertices.size()) +
                  " vertices loses " + percent(lost(hull)) +
                  " of the volume of the whole hull, of " + std::to_string(whole.vertices.size()) +
                  ", and up to " + metres(surface_distance(hull, whole).hausdorff_m) +
                  "; \"hull_max_vertices\": " + std::to_string(enough) + " loses " +
                  (least <= kMostLost ? std::string("no more than 1 %") : percent(least)));
}

// Names only the first few of many textures.
void add_lost_textures(const MeshShape& source, const TriangleMesh& mesh,
                       std::vector<std::string>& hints) {
  constexpr size_t kMostSaid = 4;
  const size_t count = mesh.lost_textures.size();
  for (size_t i = 0; i < std::min(count, kMostSaid); ++i) {
    hints.push_back(source.file.string() + ": " + mesh.lost_textures[i] +
                    ", and the material is drawn without it; expected a PNG, JPEG, BMP or TGA of "
                    "at most 8192 pixels a side, beside the mesh or inside of it");
  }
  if (count > kMostSaid) {
    hints.push_back(source.file.string() + ": " + std::to_string(count - kMostSaid) +
                    " more textures that cannot be read");
  }
}

}  // namespace

std::vector<std::string> describe_unlikely_meshes(const Scene& scene, const Model& model) {
  const Surroundings around(model);
  std::vector<std::string> hints;
  std::set<std::filesystem::path> files;
  bool has_unit_hint = false;
  for (const ModelShape& shape : model.shapes) {
    const auto* source = std::get_if<MeshShape>(&scene.shapes.at(shape.source));
    if (source == nullptr || shape.size != 1) continue;
    if (!source->size_m) has_unit_hint |= add_unit_hint(scene, around, shape, hints);
    add_axis_hint(scene, *source, shape, hints);
    add_hull_hint(*source, shape, hints);
    if (files.insert(source->file).second) add_lost_textures(*source, shape.mesh, hints);
  }
  // Beside a mesh of a wrong unit all others seem to be wrong.
  if (!has_unit_hint) {
    for (const ModelShape& shape : model.shapes) {
      const bool is_file = std::holds_alternative<MeshShape>(scene.shapes.at(shape.source));
      if (!is_file && shape.size == 1) add_size_hint(scene, around, shape, hints);
    }
  }
  return hints;
}

}  // namespace pilesim
