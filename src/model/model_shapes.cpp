#include "model/model_shapes.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "core/counted.h"
#include "core/text.h"
#include "geometry/cache_file.h"
#include "geometry/convex_decomposition.h"
#include "geometry/convex_hull.h"
#include "geometry/height_field.h"
#include "geometry/mesh_import.h"
#include "geometry/mesh_mirror.h"
#include "geometry/primitive_fit.h"
#include "geometry/primitives.h"
#include "geometry/round_crossings.h"
#include "geometry/solid.h"
#include "geometry/solid_difference.h"
#include "geometry/surface_distance.h"
#include "json/json_text.h"
#include "model/furniture.h"
#include "model/solid_shapes.h"

namespace pilesim {

namespace {

constexpr int kFewestPieceVertices = 8;  // of DecompositionOptions

std::string format(const char* pattern, double value) {
  std::array<char, 64> buffer;
  std::snprintf(buffer.data(), buffer.size(), pattern, value);
  return buffer.data();
}

std::string percent(double share) { return format("%.1f %%", 100 * share); }
std::string in_metres(double length) { return format("%.3g m", length); }

void move(TriangleMesh& mesh, const Vec3& offset) {
  for (Vec3& vertex : mesh.vertices) vertex += offset;
}

CollisionPiece hull_piece(TriangleMesh hull) {
  return {.kind = CollisionPiece::Kind::hull, .size = Vec3::Zero(), .hull = std::move(hull)};
}

CollisionPiece round_piece(const RoundSector& round, const Pose& pose = {}) {
  return {.kind = CollisionPiece::Kind::round, .pose = pose, .round = round};
}

CollisionPiece primitive_piece(CollisionPiece::Kind kind, const Vec3& size,
                               const Vec3& centre = Vec3::Zero()) {
  return {.kind = kind, .pose = {.position = centre}, .size = size};
}

// How far a primitive in the body frame reaches from the origin, m; 0 of a hull.
double reach_of(const CollisionPiece& piece) {
  using Kind = CollisionPiece::Kind;
  if (piece.kind == Kind::hull) return 0;
  const Vec3 centre = piece.pose.orientation.conjugate() * piece.pose.position;
  if (piece.kind == Kind::sphere) return centre.norm() + piece.size.x();
  if (piece.kind == Kind::box) return (centre.cwiseAbs() + piece.size / 2).norm();
  const double aside = std::hypot(centre.x(), centre.z()), half = piece.round.height / 2;
  return piece.round.margin + std::max(std::hypot(centre.y() - half, aside + piece.round.bottom),
                                       std::hypot(centre.y() + half, aside + piece.round.top));
}

// By area, of a mesh with colours.
Colour mean_colour(const TriangleMesh& mesh) {
  Vec3 sum = Vec3::Zero();
  double area = 0;
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto [a, b, c] = mesh.triangles[i];
    const Vec3& corner = mesh.vertices[a];
    const double own = (mesh.vertices[b] - corner).cross(mesh.vertices[c] - corner).norm();
    for (int k = 0; k < 3; ++k) sum[k] += own * linear_from_srgb(mesh.colours[i][k]);
    area += own;
  }
  Colour mean;
  for (int k = 0; k < 3; ++k) mean[k] = srgb_from_linear(sum[k] / area);
  return mean;
}

// Fills the members that follow from mesh and mass, and puts the origin at the centre of mass.
// Pieces and `solid` are in the same frame as the mesh.
void finish(ModelShape& shape, const TriangleMesh& solid) {
  shape.smallest_extent = solid.bounds().sizes().minCoeff();
  const Vec3 centre = shape.mass.centre_of_mass;
  // Before the mesh is moved, which may be the solid.
  for (const Vec3& vertex : solid.vertices) {
    shape.bounding_radius = std::max(shape.bounding_radius, (vertex - centre).norm());
  }
  shape.origin_offset = centre;
  shape.mass.centre_of_mass = Vec3::Zero();
  move(shape.mesh, -centre);
  for (RoundSurface& round : shape.round) round.pose.position -= centre;
  for (CollisionPiece& piece : shape.pieces) {
    if (piece.kind == CollisionPiece::Kind::hull) {
      move(piece.hull, -centre);
    } else {
      piece.pose.position -= centre;
    }
  }
  for (const Vec3& vertex : shape.mesh.vertices) {
    shape.bounding_radius = std::max(shape.bounding_radius, vertex.norm());
  }
}

// Finishes a shape whose mesh is its solid.
void finish(ModelShape& shape) { finish(shape, shape.mesh); }

class MeshShapeBuilder {
 public:
  MeshShapeBuilder(const MeshShape& source, const TriangleMesh& mesh, const std::string& pointer)
      : source_(source), pointer_(pointer), origin_(origin_near(mesh.bounds())) {
    shape_.mesh = mesh;
    shape_.mesh_hash = mesh_hash(mesh);
    move(shape_.mesh, -origin_);
    shape_.signature_file = source.signature.value_or(std::filesystem::path());
  }

  ModelShape build() {
    if (source_.collision == CollisionKind::mesh) {
      // Never moved by forces: no mass, and it need not be a solid.
      shape_.collides_as_mesh = true;
      shape_.mass.centre_of_mass = shape_.mesh.bounds().center();
      shape_.collision_report =
          "mesh: " + counted(shape_.mesh.triangles.size(), "triangle") + ", exact";
      finish(shape_);
    } else {
      prepare_solid();
      shape_.mass = mass_properties(solid_);
      add_pieces();
      shape_.collision_report += note_;
      finish(shape_, solid_);
      // Collision pieces may reach out of their mesh.
      for (const CollisionPiece& piece : shape_.pieces) {
        shape_.bounding_radius = std::max(shape_.bounding_radius, reach_of(piece));
      }
    }
    shape_.origin_offset += origin_;
    return std::move(shape_);
  }

 private:
  // A mesh with the coordinates of a map is built near its own place, so that no digits are lost.
  // In steps that are exact in binary; of a mesh that is near its origin, that.
  static Vec3 origin_near(const Bounds& bounds) {
    const double step = std::exp2(std::ilogb(bounds.diagonal().norm()) + 2);
    return (bounds.center() / step).array().round().matrix() * step;
  }

  // Throws where the mesh has none by the scene's rule.
  void prepare_solid() {
    Solid solid = make_solid(shape_.mesh, solid_options(source_), user_cache_directory());
    if (!solid.note.empty()) note_ = "; solid: " + solid.note;
    solid_ = std::move(solid.mesh);
    if (solid.way == SolidWay::as_it_is) note_overlap_of_groups();
  }

  // Such a mesh touches itself, yet its mass is right unless groups overlap: that is counted twice.
  void note_overlap_of_groups() {
    constexpr double kNoticed = 1e-3;  // solid_difference errs by half of it
    if (solid_.groups.size() < 2) return;
    if (find_mesh_defects(solid_).empty()) return;
    const Decomposition groups = decompose(solid_, decomposition_options(), user_cache_directory());
    const double overlap = 1 - groups.union_volume_m3 / groups.mesh_volume_m3;
    if (overlap > kNoticed) {
      note_ = "; its groups overlap: " + percent(overlap) + " of its mass is counted twice";
    }
  }

  void add_pieces() {
    switch (source_.collision) {
      case CollisionKind::automatic:
        return add_primitive_or_hull();
      case CollisionKind::hull:
        return add_hull();
      case CollisionKind::decomposition:
        return add_decomposition();
      case CollisionKind::spheres:
        return add_spheres();
      case CollisionKind::sphere:
        return add_sphere();
      case CollisionKind::mesh:
        break;  // has no pieces
    }
  }

  // A ball that is finely divided rolls as one.
  void add_primitive_or_hull() {
    const std::optional<FittedPrimitive> fitted = fit_primitive(solid_);
    if (!fitted) return add_hull();
    static constexpr const char* kNames[] = {"a ball", "a box", "a cylinder", "a cone",
                                             "a capsule"};
    const char* name = kNames[static_cast<size_t>(fitted->kind)];
    add_pieces_of(*fitted);
    shape_.collision_report = std::string("recognised as ") + name + ": " +
                              counted(shape_.pieces.size(), "piece") + ", exact, volume error " +
                              percent(std::abs(fitted->volume_m3() / shape_.mass.volume_m3 - 1)) +
                              ", surface error " + in_metres(fitted->surface_error_m);
    note_if_coarse(fitted->volume_m3() / shape_.mass.volume_m3 - 1);
  }

  void add_pieces_of(const FittedPrimitive& fitted) {
    using Kind = CollisionPiece::Kind;
    using Form = FittedPrimitive::Kind;
    if (fitted.kind == Form::capsule) {
      shape_.pieces = capsule_pieces(fitted.pose, fitted.size.x(), fitted.size.y());
      return;
    }
    if (fitted.kind == Form::cylinder || fitted.kind == Form::cone) {
      const double radius = fitted.size.x(), top = fitted.kind == Form::cone ? 0 : radius;
      shape_.pieces.push_back(
          round_piece(RoundSector::frustum(radius, top, fitted.size.y()), fitted.pose));
      return;
    }
    const Kind kind = fitted.kind == Form::ball ? Kind::sphere : Kind::box;
    shape_.pieces.push_back({.kind = kind, .pose = fitted.pose, .size = fitted.size});
  }

  void note_if_coarse(double volume_error) {
    // From here on another way is worth its time.
    constexpr double kCoarse = 0.1;
    if (volume_error > kCoarse) {
      shape_.collision_report += R"(; "collision": "decomposition" would follow its hollows)";
    }
  }

  void add_hull() {
    TriangleMesh hull = simplified_hull(solid_.vertices, source_.hull_max_vertices);
    const Measured measured = measure(hull);
    shape_.collision_report =
        "hull: 1 piece of " + std::to_string(hull.vertices.size()) + " vertices" + errors(measured);
    note_if_coarse(measured.volume_error);
    shape_.pieces.push_back(hull_piece(std::move(hull)));
  }

  DecompositionOptions decomposition_options() const {
    return {.max_pieces = source_.decomposition_max_pieces,
            .max_volume_error = source_.decomposition_max_volume_error,
            .max_piece_vertices = std::max(kFewestPieceVertices, source_.hull_max_vertices)};
  }

  void add_decomposition() {
    Decomposition decomposition =
        decompose(solid_, decomposition_options(), user_cache_directory());
    shape_.collision_report = "decomposition: " + counted(decomposition.pieces.size(), "piece") +
                              (decomposition.from_groups ? " named by the mesh" : "") +
                              errors({decomposition.volume_error(), decomposition.surface_error_m,
                                      decomposition.mean_surface_error_m}) +
                              of_length(decomposition) + offer(decomposition);
    for (TriangleMesh& piece : decomposition.pieces) {
      shape_.pieces.push_back(hull_piece(std::move(piece)));
    }
  }

  static std::string of_length(const Decomposition& decomposition) {
    if (decomposition.from_groups) return "";
    return ", " + percent(decomposition.surface_share) + " of its length";
  }

  // Advice for a decomposition that misses the asked error.
  std::string offer(const Decomposition& decomposition) const {
    const DecompositionOptions asked = decomposition_options();
    std::string text;
    if (decomposition.hollow_share > 0) {
      text = "; it fills hollows as deep as " + percent(decomposition.hollow_share) +
             " of its length: more \"decomposition_max_pieces\" open them";
    }
    if (decomposition.volume_error() <= asked.max_volume_error) return text;
    text += "; misses the " + percent(asked.max_volume_error) + " asked for";
    if (decomposition.more_pieces > 0) {
      text += ": \"decomposition_max_pieces\": " + std::to_string(decomposition.more_pieces) +
              " would come to about " + percent(decomposition.error_with_more);
    }
    return text;
  }

  void add_spheres() {
    const SphereFit fit = fit_spheres(solid_, source_.sphere_count);
    for (const FittedSphere& sphere : fit.spheres) {
      shape_.pieces.push_back(primitive_piece(CollisionPiece::Kind::sphere,
                                              Vec3::Constant(sphere.radius), sphere.centre));
    }
    shape_.collision_report = "spheres: " + counted(fit.spheres.size(), "piece") +
                              ", volume error " + percent(fit.volume_error) +
                              ", mean surface error " + in_metres(fit.mean_surface_error_m);
  }

  void add_sphere() {
    const double radius = std::cbrt(3 * shape_.mass.volume_m3 / (4 * kPi));
    const Vec3 centre = shape_.mass.centre_of_mass;
    TriangleMesh ball = sphere_mesh(radius);
    move(ball, centre);
    shape_.pieces.push_back(
        primitive_piece(CollisionPiece::Kind::sphere, Vec3::Constant(radius), centre));
    shape_.collision_report = "sphere: 1 piece of equal volume" + errors(measure(ball));
  }

  // How far pieces are from the solid.
  struct Measured {
    double volume_error, surface_error_m, mean_error_m;
  };

  // Errors of one convex piece in place of the mesh, measured as those of a decomposition.
  Measured measure(const TriangleMesh& piece) const {
    const SolidDifference difference = solid_difference(solid_, {&piece, 1});
    const SurfaceDistance distance = surface_distance(piece, solid_);
    return {(difference.excess_m3() + difference.missing_m3()) / difference.mesh_volume_m3,
            distance.hausdorff_m, distance.mean_m};
  }

  static std::string errors(const Measured& measured) {
    return ", volume error " + percent(measured.volume_error) + ", surface error " +
           in_metres(measured.surface_error_m) + " (mean " + in_metres(measured.mean_error_m) + ')';
  }

  const MeshShape& source_;
  const std::string& pointer_;
  Vec3 origin_;  // m, the frame of the mesh; the other members are measured from here
  ModelShape shape_;
  TriangleMesh solid_;
  std::string note_;
};

// All of a mesh stands for what `outline` sweeps; an empty one for nothing.
void set_round(ModelShape& shape, RoundOutline outline) {
  if (outline.empty()) return;
  shape.round = {{.triangle_count = static_cast<uint32_t>(shape.mesh.triangles.size()),
                  .outline = std::move(outline)}};
}

ModelShape primitive(CollisionPiece piece, TriangleMesh mesh, const MassProperties& mass,
                     RoundOutline outline = {}) {
  ModelShape shape;
  shape.mesh = std::move(mesh);
  set_round(shape, std::move(outline));
  shape.mass = mass;
  shape.pieces.push_back(std::move(piece));
  finish(shape);
  shape.collision_report = "1 piece, exact";
  return shape;
}

// None: `source` is made in another way.
std::optional<SolidShape> solid_shape_at(const std::string& pointer, const Shape& source) {
  try {
    return solid_shape(source);
  } catch (const Error& error) {
    std::vector<Problem> problems = error.problems();
    for (Problem& problem : problems) problem.pointer = pointer;
    throw Error(error.kind(), std::move(problems));
  }
}

ModelShape build_solid(SolidShape solid) {
  ModelShape shape;
  shape.mesh = std::move(solid.mesh);
  set_round(shape, std::move(solid.outline));
  shape.mass = solid.mass;
  shape.pieces = std::move(solid.pieces);
  shape.collision_report = std::move(solid.collision_report);
  finish(shape);
  // Pieces of rings reach out of their mesh.
  for (const CollisionPiece& piece : shape.pieces) {
    for (const Vec3& vertex : piece.hull.vertices) {
      shape.bounding_radius = std::max(shape.bounding_radius, vertex.norm());
    }
  }
  return shape;
}

// Appends `part`, whose own frame stands at `pose`, and returns its mass there.
MassProperties append_part(ModelShape& whole, const ModelShape& part, const Pose& pose) {
  const Pose body_frame = {pose.apply(part.origin_offset), pose.orientation};
  const auto first_vertex = static_cast<uint32_t>(whole.mesh.vertices.size());
  const auto first_triangle = static_cast<uint32_t>(whole.mesh.triangles.size());
  for (RoundSurface round : part.round) {
    round.first_triangle += first_triangle;
    round.pose = {body_frame.apply(round.pose.position),
                  body_frame.orientation * round.pose.orientation};
    whole.round.push_back(std::move(round));
  }
  for (const Vec3& vertex : part.mesh.vertices) {
    whole.mesh.vertices.push_back(body_frame.apply(vertex));
  }
  for (const Triangle& t : part.mesh.triangles) {
    whole.mesh.triangles.push_back({t[0] + first_vertex, t[1] + first_vertex, t[2] + first_vertex});
  }
  for (CollisionPiece piece : part.pieces) {
    if (piece.kind == CollisionPiece::Kind::hull) {
      for (Vec3& vertex : piece.hull.vertices) vertex = body_frame.apply(vertex);
    } else {
      piece.pose = {body_frame.apply(piece.pose.position),
                    body_frame.orientation * piece.pose.orientation};
    }
    whole.pieces.push_back(std::move(piece));
  }
  return transformed(part.mass, body_frame);
}

ModelShape build_furniture(const std::vector<BoxPart>& parts) {
  ModelShape whole;
  std::vector<MassProperties> masses;
  for (const BoxPart& part : parts) {
    const ModelShape box = primitive(primitive_piece(CollisionPiece::Kind::box, part.size),
                                     box_mesh(part.size), box_mass_properties(part.size));
    masses.push_back(append_part(whole, box, {part.centre, Quat::Identity()}));
  }
  whole.mass = combine(masses);
  whole.collision_report = counted(parts.size(), "piece") + ", exact";
  finish(whole);
  return whole;
}

// It is never moved by forces and needs no mass.
ModelShape build_terrain(const TerrainShape& terrain) {
  ModelShape shape;
  shape.mesh = height_field_mesh(terrain.file, terrain.size[0], terrain.size[1], terrain.height[0],
                                 terrain.height[1]);
  shape.collides_as_mesh = shape.solid_behind = true;
  shape.collision_report =
      "terrain: " + counted(shape.mesh.triangles.size(), "triangle") + ", exact";
  finish(shape);
  return shape;
}

ModelShape build_compound(const Scene& scene, const CompoundShape& compound,
                          const std::string& pointer, MeshLibrary& meshes) {
  ModelShape whole;
  std::vector<MassProperties> masses;
  std::map<std::string, ModelShape> built_parts;
  size_t triangles = 0;
  for (const CompoundPart& part : compound.parts) {
    const auto [found, is_new] = built_parts.try_emplace(part.shape);
    if (is_new) found->second = build_shape(scene, part.shape, meshes);
    triangles += triangles_of(found->second);
    if (triangles > kMostTriangles) throw too_many_triangles(pointer);
  }
  for (const CompoundPart& part : compound.parts) {
    const ModelShape& built = built_parts.at(part.shape);
    masses.push_back(append_part(whole, built, part.pose));
    whole.collision_report += (whole.collision_report.empty() ? "compound of " : "; ") +
                              part.shape + " (" + built.collision_report + ')';
  }
  whole.mass = combine(masses);
  finish(whole);
  return whole;
}

// One number for three: the same where they are equal, else that of a cube of the same volume.
double file_scale_of(const Vec3& scale) {
  return scale == Vec3::Constant(scale.x()) ? std::abs(scale.x())
                                            : std::cbrt(std::abs(scale.prod()));
}

ModelShape build_mesh_shape(const MeshShape& source, const std::string& pointer,
                            MeshLibrary& meshes) {
  try {
    const Vec3 scale = source.size_m
                           ? Vec3(Vec3::Constant(scale_to(*source.size_m, source.file, meshes)))
                           : source.scale;
    const UpAxis up = source.up.value_or(UpAxis::y);
    ModelShape shape =
        MeshShapeBuilder(source, meshes.load(source.file, scale, up), pointer).build();
    shape.file_scale = file_scale_of(scale);
    shape.file_up = up;
    if (!shape.mesh.colours.empty()) shape.mean_colour = mean_colour(shape.mesh);
    return shape;
  } catch (const Error& error) {
    std::vector<Problem> problems = error.problems();
    for (Problem& problem : problems) {
      if (problem.file.empty()) problem.file = source.file.string();
      if (problem.pointer.empty()) problem.pointer = pointer;
    }
    throw Error(error.kind(), std::move(problems));
  }
}

}  // namespace

const TriangleMesh& MeshLibrary::load(const std::filesystem::path& file, const Vec3& scale,
                                      UpAxis up) {
  const auto key = std::tuple(file, std::array{scale.x(), scale.y(), scale.z()}, up);
  if (const auto found = meshes_.find(key); found != meshes_.end()) return found->second;
  TriangleMesh mesh = import_mesh(file, is_uniform(scale) ? scale.x() : 1);
  if (!is_uniform(scale)) stretch(mesh, scale);
  if (up == UpAxis::z) turn_z_up_to_y_up(mesh);
  return meshes_.emplace(key, std::move(mesh)).first->second;
}

const Solid& MeshLibrary::load_solid(const std::filesystem::path& file, double scale) {
  const auto key = std::pair(file, scale);
  if (const auto found = solids_.find(key); found != solids_.end()) return found->second;
  TriangleMesh mesh = load(file, scale);
  mesh.groups.clear();
  return solids_.emplace(key, make_solid(mesh, {}, user_cache_directory())).first->second;
}

double scale_to(double size_m, const std::filesystem::path& file, MeshLibrary& meshes) {
  return size_m / meshes.load(file, 1).bounds().sizes().maxCoeff();
}

ModelShape resized(const ModelShape& shape, double size) {
  ModelShape other = shape;
  other.size = size * shape.size;
  other.name = shape.source + " x " + with_digits(other.size, 4);
  for (Vec3& vertex : other.mesh.vertices) vertex *= size;
  for (RoundSurface& round : other.round) {
    round.pose.position *= size;
    for (OutlinePoint& point : round.outline) {
      point.radius *= size;
      point.y *= size;
    }
  }
  for (CollisionPiece& piece : other.pieces) {
    piece.pose.position *= size;
    piece.size *= size;
    for (Vec3& vertex : piece.hull.vertices) vertex *= size;
  }
  other.mass.volume_m3 *= std::pow(size, 3);
  other.mass.inertia_m5 *= std::pow(size, 5);
  other.origin_offset *= size;
  other.bounding_radius *= size;
  other.smallest_extent *= size;
  if (!shape.mesh_hash.empty()) {
    TriangleMesh own = other.mesh;
    move(own, other.origin_offset);
    other.mesh_hash = mesh_hash(own);  // a signature is of one size
  }
  other.collision_report = shape.source + " at " + with_digits(other.size, 4) + " of its size";
  return other;
}

SolidOptions solid_options(const MeshShape& shape) {
  return {.rule = shape.solid,
          .thickness_m = shape.thickness_m,
          .hull_max_vertices = shape.hull_max_vertices};
}

std::string shape_pointer(const std::string& name) {
  return "/shapes/" + escape_pointer_token(name);
}

size_t triangles_of(const ModelShape& shape) {
  size_t count = shape.mesh.triangles.size();
  for (const CollisionPiece& piece : shape.pieces) count += piece.hull.triangles.size();
  return count;
}

Error too_many_triangles(const std::string& pointer) {
  return {ErrorKind::input,
          Problem{.pointer = pointer,
                  .found = "makes more than " + std::to_string(kMostTriangles) + " triangles",
                  .expected = "no more of all shapes together, with each part of a compound and "
                              "each size of an emitter",
                  .remedy = "Use smaller meshes, fewer parts or fewer steps of sizes"}};
}

ModelShape build_shape(const Scene& scene, const std::string& name, MeshLibrary& meshes) {
  using Kind = CollisionPiece::Kind;
  const Shape& source = scene.shapes.at(name);
  ModelShape shape;
  if (const auto* mesh = std::get_if<MeshShape>(&source)) {
    shape = build_mesh_shape(*mesh, shape_pointer(name), meshes);
  } else if (const auto* box = std::get_if<BoxShape>(&source)) {
    shape = primitive(primitive_piece(Kind::box, box->size), box_mesh(box->size),
                      box_mass_properties(box->size));
  } else if (const auto* ball = std::get_if<SphereShape>(&source)) {
    shape = primitive(primitive_piece(Kind::sphere, Vec3::Constant(ball->radius)),
                      sphere_mesh(ball->radius), sphere_mass_properties(ball->radius),
                      ball_outline(ball->radius));
  } else if (const auto* cylinder = std::get_if<CylinderShape>(&source)) {
    const auto& [radius, height] = *cylinder;
    shape = primitive(round_piece(RoundSector::cylinder(radius, height)),
                      cylinder_mesh(radius, height), cylinder_mass_properties(radius, height),
                      frustum_outline(radius, radius, height));
  } else if (const auto* compound = std::get_if<CompoundShape>(&source)) {
    shape = build_compound(scene, *compound, shape_pointer(name), meshes);
  } else if (const auto* terrain = std::get_if<TerrainShape>(&source)) {
    try {
      shape = build_terrain(*terrain);
    } catch (const Error& error) {
      throw in_file(error, terrain->file.string());
    }
  } else if (std::holds_alternative<PlaneShape>(source)) {
    shape.is_plane = true;
    shape.collision_report = "half-space, exact";
  } else if (std::optional<SolidShape> solid = solid_shape_at(shape_pointer(name), source)) {
    shape = build_solid(std::move(*solid));
  } else {
    shape = build_furniture(furniture_parts(source));
  }
  shape.name = shape.source = name;
  return shape;
}

}  // namespace pilesim
