#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "json/object_codec.h"
#include "scene/moving_shapes.h"
#include "scene/pose_fields.h"
#include "scene/scene_format.h"
#include "scene/variant_fields.h"

namespace pilesim {

namespace {

Codec<CollisionKind> collision_codec() {
  return enumeration<CollisionKind>({{"auto", CollisionKind::automatic},
                                     {"hull", CollisionKind::hull},
                                     {"decomposition", CollisionKind::decomposition},
                                     {"spheres", CollisionKind::spheres},
                                     {"sphere", CollisionKind::sphere},
                                     {"mesh", CollisionKind::mesh}});
}

constexpr char kAutomatic[] = "auto";

Codec<SolidRule> solid_codec() {
  return enumeration<SolidRule>({{"auto", SolidRule::automatic},
                                 {"exact", SolidRule::exact},
                                 {"wrap", SolidRule::wrap},
                                 {"hull", SolidRule::hull}});
}

Codec<UpAxis> up_codec() { return enumeration<UpAxis>({{"y", UpAxis::y}, {"z", UpAxis::z}}); }

Codec<std::optional<std::filesystem::path>> signature_codec() {
  const Codec<std::filesystem::path> file = file_path();
  Codec<std::optional<std::filesystem::path>> codec;
  codec.expected = "\"auto\" or " + file.expected;
  codec.schema = file.schema;
  codec.read = [file, expected = codec.expected](const Json& json, const Path& path,
                                                 std::optional<std::filesystem::path>& value,
                                                 ReadContext& context) {
    if (json == kAutomatic) {
      value.reset();
    } else if (json.is_string()) {
      file.read(json, path, value.emplace(), context);
    } else {
      context.log.report(path, describe_value(json), expected);
    }
  };
  codec.write = [file](const std::optional<std::filesystem::path>& value) {
    return value ? file.write(*value) : Json(kAutomatic);
  };
  return codec;
}

// One number, or three.
Codec<Vec3> scale_codec() {
  const Codec<double> one = number();
  const Codec<Vec3> three = vector3();
  Codec<Vec3> codec;
  codec.expected = "a number other than 0, or three of them [x, y, z]";
  codec.schema = {{"oneOf", Json::array({one.schema, three.schema})}};
  codec.read = [one, three, expected = codec.expected](const Json& json, const Path& path,
                                                       Vec3& value, ReadContext& context) {
    Vec3 scale = Vec3::Ones();
    if (json.is_array()) {
      three.read(json, path, scale, context);
    } else if (json.is_number()) {
      one.read(json, path, scale.x(), context);
      scale = Vec3::Constant(scale.x());
    } else {
      return context.log.report(path, describe_value(json), expected);
    }
    if (!context.log.is_sound(path)) return;
    if ((scale.array() == 0).any()) {
      return context.log.report(path, json.is_array() ? "has a 0" : "is 0", expected);
    }
    value = scale;
  };
  codec.write = [one, three](const Vec3& value) {
    return is_uniform(value) ? one.write(value.x()) : three.write(value);
  };
  return codec;
}

// Left out where the size says it.
Field<Shape> scale_field() {
  Field<Shape> field = pilesim::field<Shape>(
      "scale", of(&MeshShape::scale), scale_codec(),
      "Metres per unit of the file: one number, or three [x, y, z] along the file's own axes; "
      "negative ones mirror, a single one along all three.");
  field.write = [write = field.write](const Shape& shape) {
    return std::get<MeshShape>(shape).size_m ? std::nullopt : write(shape);
  };
  return field;
}

Fields<Shape> mesh_fields() {
  using M = MeshShape;
  return {
      required_field<Shape>("file", of(&M::file), file_path(),
                            "Mesh file (obj, stl, ply, glb, ...), relative to the scene file."),
      in_group("size", scale_field()),
      in_group("size",
               optional_field<Shape>("size_m", of(&M::size_m), number(at_least(kSmallestLength)),
                                     "Length of its longest side, m, instead of a scale.")),
      optional_field<Shape>(
          "up", of(&M::up), up_codec(),
          "The file's axis that points up: y (default), or z, as in most STL and PLY files. With z "
          "the file's x, z and -y become the shape's x, y and z."),
      field<Shape>(
          "collision", of(&M::collision), collision_codec(),
          "Collision shape. auto: the triangles if only static and kinematic bodies have it, else "
          "the ball, box, cylinder or capsule that the mesh is, else the hull; hull: the convex "
          "hull; decomposition: convex pieces; spheres: fitted spheres; sphere: one sphere of "
          "equal volume; mesh: the triangles, for static and kinematic bodies only."),
      field<Shape>("hull_max_vertices", of(&M::hull_max_vertices), integer(4, 255),
                   "Greatest number of vertices of the hull, or of each piece of a decomposition."),
      field<Shape>("decomposition_max_pieces", of(&M::decomposition_max_pieces), integer(1, 256),
                   "Greatest number of pieces of a decomposition."),
      field<Shape>("decomposition_max_volume_error", of(&M::decomposition_max_volume_error),
                   number({.minimum = 0, .maximum = 1, .excludes_minimum = true}),
                   "A decomposition stops once its error is below this share of the volume."),
      field<Shape>("sphere_count", of(&M::sphere_count), integer(1, 64),
                   "Number of spheres for collision spheres."),
      field<Shape>(
          "signature", of(&M::signature), signature_codec(),
          "Signature of the mesh, for the statistical and the mixed mode. auto: measured "
          "when it is needed; or a file of pilesim sample-signature, relative to the scene "
          "file."),
      field<Shape>("solid", of(&M::solid), solid_codec(),
                   "The solid that has mass and collides. auto: the mesh if it is closed, else the "
                   "mended mesh, else a wrap; exact: the mesh, or an error if it is not closed; "
                   "wrap: a closed surface around the mesh; hull: its convex hull."),
      field<Shape>("thickness_m", of(&M::thickness_m), number(at_least(0)),
                   "Thickness of parts that are sheets, m; 0: the mesh has no sheets."),
  };
}

// The measures of a primitive are multiplied when it is read. `apply` multiplies them and returns
// an empty text, or returns which scale it would take. `limits`: for the schema.
template <class V>
Field<Shape> primitive_scale(std::string (*apply)(V&, const Vec3&),
                             const std::string& limits = "") {
  const Codec<Vec3> codec = scale_codec();
  Field<Shape> field;
  field.key = {.name = "scale", .expected = codec.expected};
  field.schema =
      described(codec.schema, "Times the measures above: one number, or [x, y, z]" + limits + ".");
  field.read = [apply, read = codec.read](const Json& json, const Path& path, Shape& shape,
                                          ReadContext& context) {
    Vec3 scale = Vec3::Ones();
    read(json, path, scale, context);
    if (!context.log.is_sound(path)) return;
    V scaled = std::get<V>(shape);
    const std::string expected = apply(scaled, scale);
    if (expected.empty()) {
      shape = scaled;
    } else {
      context.log.report(path, "is " + json.dump(), expected,
                         R"(Use a "mesh" of it, which takes any scale)");
    }
  };
  field.write = [](const Shape&) { return std::optional<Json>(); };
  return field;
}

// Empty where the smallest measure can be.
std::string enough(double smallest_m, const std::string& what) {
  if (smallest_m >= kSmallestLength) return "";
  return what + " of at least " + number_text(kSmallestLength) + " m";
}

bool is_of_one_magnitude(const Vec3& scale) {
  return scale.cwiseAbs() == Vec3::Constant(std::abs(scale.x()));
}

std::string scale_box(BoxShape& box, const Vec3& scale) {
  box.size = box.size.cwiseProduct(scale.cwiseAbs());
  return enough(box.size.minCoeff(), "a box");
}

std::string scale_sphere(SphereShape& sphere, const Vec3& scale) {
  if (!is_of_one_magnitude(scale)) {
    return "three numbers of one magnitude, as a stretched sphere is none";
  }
  sphere.radius *= std::abs(scale.x());
  return enough(sphere.radius, "a radius");
}

std::string scale_cylinder(CylinderShape& cylinder, const Vec3& scale) {
  if (std::abs(scale.x()) != std::abs(scale.z())) {
    return "numbers of one magnitude for x and z, as a cylinder is round about y";
  }
  cylinder.radius *= std::abs(scale.x());
  cylinder.height *= std::abs(scale.y());
  return enough(std::min(cylinder.radius, cylinder.height), "a radius and a height");
}

std::string scale_cone(ConeShape& cone, const Vec3& scale) {
  if (std::abs(scale.x()) != std::abs(scale.z())) {
    return "numbers of one magnitude for x and z, as a cone is round about y";
  }
  if (scale.y() < 0) {
    return "a number above 0 for y, as a cone points up until its body is turned";
  }
  cone.radius *= std::abs(scale.x());
  cone.top_radius *= std::abs(scale.x());
  cone.height *= scale.y();
  return enough(std::min(cone.radius, cone.height), "a radius and a height");
}

std::string scale_capsule(CapsuleShape& capsule, const Vec3& scale) {
  if (!is_of_one_magnitude(scale)) {
    return "three numbers of one magnitude, as a stretched capsule is none";
  }
  capsule.radius *= std::abs(scale.x());
  capsule.height *= std::abs(scale.x());
  return enough(capsule.radius, "a radius");
}

std::string scale_torus(TorusShape& torus, const Vec3& scale) {
  if (!is_of_one_magnitude(scale)) {
    return "three numbers of one magnitude, as a stretched torus is none";
  }
  torus.radius *= std::abs(scale.x());
  torus.tube_radius *= std::abs(scale.x());
  return enough(torus.tube_radius, "a radius of the tube");
}

std::string scale_tube(TubeShape& tube, const Vec3& scale) {
  if (std::abs(scale.x()) != std::abs(scale.z())) {
    return "numbers of one magnitude for x and z, as a tube is round about y";
  }
  tube.radius *= std::abs(scale.x());
  tube.thickness *= std::abs(scale.x());
  tube.height *= std::abs(scale.y());
  return enough(std::min(tube.thickness, tube.height), "a thickness and a height");
}

std::string scale_wedge(WedgeShape& wedge, const Vec3& scale) {
  if (std::min(scale.y(), scale.z()) < 0) {
    return "numbers above 0 for y and z, as a wedge rises to -z until its body is turned";
  }
  wedge.size = wedge.size.cwiseProduct(scale.cwiseAbs());
  return enough(wedge.size.minCoeff(), "a wedge");
}

std::string scale_text(TextShape& text, const Vec3& scale) {
  if (scale.x() != scale.y() || scale.x() < 0) {
    return "one number above 0 for x and y, as letters keep their shape";
  }
  text.height *= scale.y();
  text.depth *= std::abs(scale.z());
  return enough(std::min(text.height, text.depth), "a height and a depth");
}

template <class V>
Field<Shape> outer_size() {
  return required_field<Shape>("size", of(&V::size), vector3(at_least(kSmallestLength)),
                               "Full edge lengths over all [x, y, z], m.");
}

template <class V>
Field<Shape> thickness(const std::string& description) {
  return field<Shape>("thickness", of(&V::thickness), number(at_least(kSmallestLength)),
                      description);
}

// A measure that has to be there, m.
template <class V>
Field<Shape> measure(const std::string& key, double V::*member, const std::string& description) {
  return required_field<Shape>(key, of(member), number(at_least(kSmallestLength)), description);
}

std::vector<Alternative<Shape>> primitives() {
  return {
      alternative<Shape, BoxShape>(
          "box", "A box about its centre.",
          {required_field<Shape>("size", of(&BoxShape::size), vector3(at_least(kSmallestLength)),
                                 "Full edge lengths [x, y, z], m."),
           primitive_scale<BoxShape>(scale_box)}),
      alternative<Shape, SphereShape>("sphere", "A sphere about its centre.",
                                      {measure("radius", &SphereShape::radius, "Radius, m."),
                                       primitive_scale<SphereShape>(scale_sphere)}),
      alternative<Shape, CylinderShape>(
          "cylinder", "A cylinder about its centre, axis y.",
          {measure("radius", &CylinderShape::radius, "Radius, m."),
           measure("height", &CylinderShape::height, "Full height, m."),
           primitive_scale<CylinderShape>(scale_cylinder)}),
      alternative<Shape, ConeShape>(
          "cone", "A cone that points up, about the middle of its axis, y.",
          {measure("radius", &ConeShape::radius, "Radius of its base, m."),
           measure("height", &ConeShape::height, "Full height, m."),
           field<Shape>("top_radius", of(&ConeShape::top_radius), number(at_least(0)),
                        "Radius of a flat top, m; 0: it has a tip."),
           primitive_scale<ConeShape>(scale_cone, ", y above 0")}),
      alternative<Shape, CapsuleShape>(
          "capsule", "A cylinder between two half spheres, about its centre, axis y.",
          {measure("radius", &CapsuleShape::radius, "Radius, m."),
           measure("height", &CapsuleShape::height, "Height over all, m: above two radii."),
           primitive_scale<CapsuleShape>(scale_capsule)}),
      alternative<Shape, TorusShape>(
          "torus", "A ring of round section about its centre, axis y.",
          {measure("radius", &TorusShape::radius, "From the axis to the middle of its tube, m."),
           measure("tube_radius", &TorusShape::tube_radius,
                   "Radius of its tube, m: below the ring's."),
           primitive_scale<TorusShape>(scale_torus)}),
      alternative<Shape, TubeShape>(
          "tube", "A tube, open at both ends, about its centre, axis y.",
          {measure("radius", &TubeShape::radius, "Outer radius, m."),
           measure("height", &TubeShape::height, "Full height, m."),
           measure("thickness", &TubeShape::thickness, "Thickness of its wall, m."),
           primitive_scale<TubeShape>(scale_tube)}),
      alternative<Shape, WedgeShape>(
          "wedge", "A ramp: half of a box about its centre, which rises from +z to -z.",
          {required_field<Shape>("size", of(&WedgeShape::size), vector3(at_least(kSmallestLength)),
                                 "Full edge lengths [x, y, z], m."),
           primitive_scale<WedgeShape>(scale_wedge, ", y and z above 0")}),
      alternative<Shape, TextShape>(
          "text", "Letters in a line, one solid about the centre of its bounds, seen from +z.",
          {required_field<Shape>("text", of(&TextShape::text), text(),
                                 "The letters: at most " + std::to_string(kLongestText) + "."),
           measure("height", &TextShape::height, "Height of a capital letter, m."),
           measure("depth", &TextShape::depth, "Depth along z, m."),
           optional_field<Shape>("font", of(&TextShape::font), file_path(),
                                 "TrueType or OpenType file, relative to the scene file. Default: "
                                 "DejaVu Sans, which is part of the program."),
           primitive_scale<TextShape>(scale_text, ", x and y the same and above 0")}),
  };
}

std::vector<Alternative<Shape>> furniture() {
  return {
      alternative<Shape, BinShape>(
          "bin", "An open box of walls; its origin is below the middle of its floor.",
          {required_field<Shape>("size", of(&BinShape::size), vector3(at_least(kSmallestLength)),
                                 "Size of its inside [x, y, z], m."),
           thickness<BinShape>("Thickness of floor and walls, m.")}),
      alternative<Shape, TableShape>(
          "table", "A top on four legs; its origin is on the floor in their middle.",
          {outer_size<TableShape>(), thickness<TableShape>("Thickness of the top, m."),
           field<Shape>("leg", of(&TableShape::leg), number(at_least(kSmallestLength)),
                        "Edge of a leg, m.")}),
      alternative<Shape, ShelfShape>(
          "shelf", "Boards between two sides, open to +z; its origin is below their middle.",
          {outer_size<ShelfShape>(),
           field<Shape>("boards", of(&ShelfShape::boards), integer(2, 100),
                        "Number of boards, with the lowest and the highest."),
           thickness<ShelfShape>("Thickness of all boards, m."),
           field<Shape>("back", of(&ShelfShape::has_back), boolean(),
                        "Whether it has a back at -z.")}),
      alternative<Shape, StairsShape>(
          "stairs", "Solid steps that rise from +z to -z; the origin is below their middle.",
          {outer_size<StairsShape>(),
           field<Shape>("steps", of(&StairsShape::steps), integer(1, 1000), "Number of steps.")}),
      alternative<Shape, TerrainShape>(
          "terrain", "The surface over a grey picture, about its origin; for static bodies.",
          {required_field<Shape>("file", of(&TerrainShape::file), file_path(),
                                 "PNG of 8 or 16 bits, relative to the scene file. Its right is "
                                 "+x, its lower edge +z."),
           required_field<Shape>("size", of(&TerrainShape::size),
                                 two_numbers(at_least(kSmallestLength), "[x, z]"),
                                 "Size along x and z, m."),
           required_field<Shape>("height", of(&TerrainShape::height),
                                 two_numbers(kAnyNumber, "[of black, of white]"),
                                 "Heights y of black and of white, m.")}),
  };
}

Codec<CompoundPart> part_codec() {
  return object<CompoundPart>(
      {.noun = "a part of a compound",
       .fields = Fields<CompoundPart>{required_field<CompoundPart>(
                     "shape", &CompoundPart::shape, text(),
                     "Name of a shape other than a plane or a compound.")} +
                 pose_fields<CompoundPart>(&CompoundPart::pose, "the part in the compound")});
}

}  // namespace

Codec<Shape> shape_codec() {
  std::vector<Alternative<Shape>> alternatives = {
      alternative<Shape, MeshShape>("mesh", "A triangle mesh from a file.", mesh_fields())};
  for (Alternative<Shape>& each : primitives()) alternatives.push_back(std::move(each));
  std::vector<Alternative<Shape>> others = {
      alternative<Shape, PlaneShape>("plane",
                                     "The half-space y <= 0 of its body, for static bodies.", {}),
      alternative<Shape, CompoundShape>(
          "compound", "Shapes joined rigidly; they should not overlap.",
          {required_field<Shape>("parts", of(&CompoundShape::parts), list(part_codec(), 1),
                                 "The shapes and their poses.")}),
  };
  for (Alternative<Shape>& each : others) alternatives.push_back(std::move(each));
  for (Alternative<Shape>& each : furniture()) alternatives.push_back(std::move(each));
  return object<Shape>(
      {.noun = "a shape", .choice_key = "type", .alternatives = std::move(alternatives)});
}

void choose_collisions(Scene& scene) {
  std::set<std::string> moves, stands;
  for (const auto& [name, materials] : moving_shapes(scene)) moves.insert(name);
  for (const Body& body : scene.bodies) stands.insert(body.shape);
  for (const auto& [name, shape] : scene.shapes) {
    const auto* compound = std::get_if<CompoundShape>(&shape);
    if (compound == nullptr) continue;
    for (const CompoundPart& part : compound->parts) moves.insert(part.shape);
  }
  for (auto& [name, shape] : scene.shapes) {
    auto* mesh = std::get_if<MeshShape>(&shape);
    if (mesh == nullptr || mesh->collision != CollisionKind::automatic) continue;
    // A scene that sets the solid wants the solid to collide.
    const bool asks_for_solid = mesh->solid != SolidRule::automatic || mesh->thickness_m > 0;
    const bool only_stands = stands.contains(name) && !moves.contains(name);
    if (only_stands && !asks_for_solid) mesh->collision = CollisionKind::mesh;
  }
}

}  // namespace pilesim
