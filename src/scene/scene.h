// A scene as its author wrote it: typed, checked, immutable. No geometry is loaded here;
// build_model() (model/model.h) makes a model for simulators of it. Lengths in metres, times in
// seconds, angles in radians (scene files say degrees where a key ends in _deg), y up.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "core/colour.h"
#include "core/solid_rule.h"
#include "core/types.h"

namespace pilesim {

// Variation over a surface (shaders/pattern.glsl). The numbers are those of files and shaders.
enum class Pattern : uint8_t { none, checker, concrete, planks };

// How a surface looks in pictures (scene/looks.h has some by name).
struct Look {
  std::optional<Colour> colour;  // none: the mesh file's, or from the palette
  double roughness = 0.45;       // of its gloss, (0, 1]: 0 a mirror, 1 matt
  double clear_coat = 0;         // [0, 1]: how much of a clear layer lies over it
  double metallic = 0;           // [0, 1]: share that mirrors in its colour, as metals do
  // [0, 1]: share of the light that goes through, refracted by an index of 1.5. White light that
  // has crossed the body where it is widest has the colour.
  double transmission = 0;
  double emission = 0;  // >= 0: light that it sends, times its colour; 1: as bright as white
  Pattern pattern = Pattern::none;
  // m, > 0: edge of a square of a checker, width of a plank, side of a slab of concrete.
  double pattern_m = 0.25;

  bool operator==(const Look&) const = default;
};

struct Material {
  double restitution = 0.3;     // 0 .. 1; of a pair: the product's square root
  double friction = 0.5;        // Coulomb, >= 0; of a pair: the product's square root
  double density_kg_m3 = 1000;  // > 0
  // Resistance to rolling, and to spinning about the normal of a contact: a torque of up to this
  // share of the force along the normal times the radius of the smaller body, as a ball of its
  // volume (simulate/rolling_resistance.h). >= 0; of a pair: the product's square root.
  double rolling_friction = 0, spinning_friction = 0;
  Look look;
};

inline constexpr float kCoatRoughness = 0.08f;  // of that layer

// How a mesh collides. `mesh`: its triangles, for static and kinematic bodies only. `automatic`: a
// scene that was read has none; in one that was not it is the hull.
enum class CollisionKind { automatic, hull, decomposition, spheres, sphere, mesh };

// Which axis of a mesh file points up.
enum class UpAxis : uint8_t { y, z };

struct MeshShape {
  std::filesystem::path file;  // absolute
  // Metres per unit of the file, along its own axes, none 0; a negative one mirrors.
  Vec3 scale = Vec3::Ones();
  std::optional<double> size_m;  // > 0: the longest side, in place of the scale
  std::optional<UpAxis> up;      // of the file; none: y
  CollisionKind collision = CollisionKind::automatic;
  int hull_max_vertices = 96;                      // 4 .. 255: of the hull, or of each piece
  int decomposition_max_pieces = 32;               // 1 .. 256
  double decomposition_max_volume_error = 0.05;    // > 0
  int sphere_count = 7;                            // 1 .. 64, for `spheres`
  std::optional<std::filesystem::path> signature;  // absolute; for the statistical mode
  SolidRule solid = SolidRule::automatic;          // how it becomes a solid
  double thickness_m = 0;  // of parts that are sheets, >= 0; 0: there are to be none
};
// Whether a scale is one factor above 0 for all axes.
bool is_uniform(const Vec3& scale);
struct BoxShape {
  Vec3 size = Vec3::Zero();  // full edge lengths, > 0
};
struct SphereShape {
  double radius = 0;  // > 0
};
struct CylinderShape {
  double radius = 0, height = 0;  // > 0, axis y
};
// Between a circle of `radius` at -height / 2 and one of `top_radius`, which may be 0.
struct ConeShape {
  double radius = 0, height = 0;  // > 0, axis y
  double top_radius = 0;          // >= 0
};
struct CapsuleShape {
  double radius = 0;  // > 0
  double height = 0;  // over all, > 2 radius; axis y
};
struct TorusShape {
  double radius = 0;       // from the axis y to the middle of the tube
  double tube_radius = 0;  // > 0, < radius
};
// Open at both ends.
struct TubeShape {
  double radius = 0, height = 0;  // outer, > 0, axis y
  double thickness = 0;           // of the wall, > 0, < radius
};
// Half of a box about its centre, which rises from +z to -z.
struct WedgeShape {
  Vec3 size = Vec3::Zero();  // full edge lengths, > 0
};
inline constexpr size_t kLongestText = 100;  // characters
// Letters in a line in the x-y plane, about the centre of their bounds.
struct TextShape {
  std::string text;                           // not blank, at most kLongestText characters
  double height = 0;                          // of a capital letter, > 0
  double depth = 0;                           // along z, > 0
  std::optional<std::filesystem::path> font;  // absolute; none: the program's own
};
struct PlaneShape {};  // the half-space y <= 0 of the body; static only
struct CompoundPart {
  std::string shape;  // not a plane, not a compound
  Pose pose;          // of the part's own frame in the compound's
};
struct CompoundShape {
  std::vector<CompoundPart> parts;  // they do not overlap
};
// Made of boxes that do not overlap; the origin of each is in the middle of its base.
struct BinShape {
  Vec3 size = Vec3::Zero();  // of its inside, > 0; open at the top
  double thickness = 0.02;   // of floor and walls, > 0
};
struct TableShape {
  Vec3 size = Vec3::Zero();  // over all, > 0
  double thickness = 0.03;   // of the top, > 0, less than the height
  double leg = 0.05;         // edge of a leg, > 0, at most half of the width
};
struct ShelfShape {
  Vec3 size = Vec3::Zero();  // over all, > 0; its front is at +z
  int boards = 4;            // 2 .. 100: with the lowest and the highest
  double thickness = 0.02;   // of all boards, > 0
  bool has_back = true;
};
struct StairsShape {
  Vec3 size = Vec3::Zero();  // over all, > 0; they rise from +z to -z
  int steps = 5;             // 1 .. 1000
};
// The surface over a grey picture; static only.
struct TerrainShape {
  std::filesystem::path file;             // absolute, PNG
  std::array<double, 2> size = {0, 0};    // along x and z, m, > 0
  std::array<double, 2> height = {0, 0};  // of black and of white, m
};
using Shape = std::variant<MeshShape, BoxShape, SphereShape, CylinderShape, ConeShape, CapsuleShape,
                           TorusShape, TubeShape, WedgeShape, TextShape, PlaneShape, CompoundShape,
                           BinShape, TableShape, ShelfShape, StairsShape, TerrainShape>;

enum class Role { dynamic, fixed, kinematic };  // scene files say "static" for fixed

// Mixed mode: bodies that touch a must-impulse body are solved exactly, others may be spheres
// (dissertation 4.2.2).
enum class Preference { must_impulse, prefer_statistical };

struct Hinge {
  Vec3 axis = Vec3::UnitY();   // unit, world frame at the start
  Vec3 anchor = Vec3::Zero();  // m, world frame; defaults to the body's position
};

// How the surface of a body that contacts do not move runs along it, as that of a belt or a roller:
// in the shape's own frame, about its origin. A body on it feels the part that is tangential at its
// contact.
struct SurfaceVelocity {
  Vec3 linear = Vec3::Zero();   // m/s
  Vec3 angular = Vec3::Zero();  // rad/s
};

struct MotionKey {
  double time_s = 0;
  Pose pose;
  // Intrinsic x, y, z, where the key is written so: `pose.orientation` is that of these angles,
  // which also count whole turns.
  std::optional<Vec3> rotation_deg = {};
};

// Straight from key to key, or without jerks, at rest at the first and the last one.
enum class Interpolation { linear, smooth };

// Turns about an axis through `anchor`, at a rate.
struct SpinMotor {
  Vec3 angular_velocity = Vec3::Zero();  // rad/s, own frame
  Vec3 anchor = Vec3::Zero();            // m, own frame
};
// Turns to and fro about an axis through `anchor`, as a sine.
struct SwayMotor {
  Vec3 axis = Vec3::UnitY();   // unit, own frame
  Vec3 anchor = Vec3::Zero();  // m, own frame
  double amplitude = 0;        // rad
};
// Moves to and fro, as a sine.
struct ShakeMotor {
  Vec3 amplitude_m = Vec3::Zero();  // own frame
};
struct Motor {
  std::variant<SpinMotor, SwayMotor, ShakeMotor> action;
  double frequency_hz = 1;      // > 0; of a motion to and fro
  double phase = 0;             // rad, of the sine at start_s
  double start_s = 0;           // >= 0
  std::optional<double> end_s;  // none: it never ends; else start_s + 2 ramp_s or later
  // In which rate or amplitude grow from nothing, and before end_s shrink to it, without jerks;
  // >= 0.
  double ramp_s = 0;
};

// Motion of a kinematic body: it stands at the first key before it and at the last one after it.
// Motors move it from there in its own frame; the first one moves those after it.
// model/kinematic_motion.h interpolates.
struct Motion : std::vector<MotionKey> {
  using std::vector<MotionKey>::vector;
  Interpolation interpolation = Interpolation::linear;
  std::vector<Motor> motors;
};

// Linear RGB is made of it by the renderer.

// `pose` places the shape's own frame (the mesh file's frame, or the centre of a primitive), not
// its centre of mass.
struct Body {
  std::string name;
  std::string shape;
  std::string material;
  Pose pose;
  Vec3 linear_velocity = Vec3::Zero();   // m/s, of the centre of mass
  Vec3 angular_velocity = Vec3::Zero();  // rad/s, world frame
  Role role = Role::dynamic;
  bool held = false;    // dynamic, but fixed until a release event names it
  bool asleep = false;  // dynamic, but out of the solver until something hits it
  Preference preference = Preference::prefer_statistical;
  std::optional<Hinge> hinge;
  Motion motion;                                    // kinematic only, times ascending
  std::optional<SurfaceVelocity> surface_velocity;  // static and kinematic only
  std::optional<Look> look;                         // none: the material's
  std::optional<Colour> colour;                     // none: the look's, or from the palette
};

// Two bodies, or one and the world, that are joined at a point. ball: both turn freely about it.
// hinge: about an axis. fixed: they move as one.
enum class JointKind : uint8_t { ball, hinge, fixed };
struct HingeMotor {
  double turns_per_s = 0;  // of a against b
  double torque_nm = 0;    // at most, >= 0
};
struct Joint {
  JointKind kind = JointKind::ball;
  std::string a;                 // a dynamic body
  std::optional<std::string> b;  // another body; none: the world
  Vec3 point = Vec3::Zero();     // m, world frame at the start
  std::optional<Vec3> axis;      // unit, world frame at the start; hinges have one
  // Least and most turn of a against b about a hinge's axis, rad, right-handed; <= 0 and >= 0.
  std::optional<std::array<double, 2>> limits;
  std::optional<HingeMotor> motor;         // of a hinge
  std::optional<double> breaking_force_n;  // > 0
  std::optional<bool> collide;             // a with b; none: where the joint can break
};
inline constexpr const char* kWorldName = "world";
// Links joined end to end by ball joints: each link's y axis lies along the chain.
struct Chain {
  std::string name;
  std::string shape, material;
  int count = 1;             // links, >= 1
  Vec3 from = Vec3::Zero();  // m
  Vec3 to = Vec3::Zero();
  std::optional<std::string> start, end;   // bodies that its ends hang on, or kWorldName
  std::optional<double> breaking_force_n;  // of its joints, > 0
  std::optional<Colour> colour;            // none: from the palette
};

// Where the bodies of an emitter start. Positions are of centres of mass.
struct GridSource {
  Vec3 centre = Vec3::Zero();            // m
  std::array<int, 3> count = {1, 1, 1};  // along x, y, z, each >= 1
  Vec3 spacing = Vec3::Ones();           // m, > 0
};
// Uniform in a cylinder, axis y.
struct DiskSource {
  Vec3 centre = Vec3::Zero();  // m
  double radius = 1;           // m, > 0
  double height = 0;           // m, full, >= 0
};
// The drop point goes to and fro in a period.
struct LineSource {
  Vec3 from = Vec3::Zero(), to = Vec3::Zero();  // m
  double period_s = 1;                          // > 0
};
// A stream from a nozzle. Where it moves, `motion` places it and turns its bodies.
struct PointSource {
  Vec3 position = Vec3::Zero();  // m
  Motion motion;
};
// A lattice inside a closed mesh, filled from the bottom up.
struct VolumeSource {
  std::filesystem::path file;  // absolute
  double scale = 1;            // metres per unit of the file, > 0
  Pose pose;                   // of the mesh file's frame in the world
  double spacing = 1;          // m, > 0
};
// The guide, turned over and filled like a vessel, then turned back (dissertation 6.3.1): bodies
// wait where they came to lie there and are released from the bottom up.
struct GuideSource {};
// The guide as a closed mould, filled right way up; no base is asked for. They are there from
// start_s on.
struct MouldSource {};
using EmitterSource = std::variant<GridSource, DiskSource, LineSource, PointSource, VolumeSource,
                                   GuideSource, MouldSource>;

// The shapes of an emitter in several sizes, drawn for each body.
enum class SizeDistribution : uint8_t { uniform, log_uniform, normal };
struct Sizes {
  double from = 1, to = 1;  // times the shape's own size, > 0
  int steps = 5;            // 2 .. 64: so many sizes there are, `from` and `to` among them
  SizeDistribution distribution = SizeDistribution::uniform;
};

// An emitter stops once a body rests with its centre in this box.
struct UntilFull {
  Vec3 min = Vec3::Zero(), max = Vec3::Zero();  // m, world; min < max
};

struct Emitter {
  std::string name;
  std::vector<std::string> shapes;  // >= 1, taken in turn
  std::vector<double> weights;      // one a shape: drawn by these instead; empty: in turn
  std::string material;
  std::vector<std::string> materials;  // one a shape, instead of `material`; or empty
  std::optional<Sizes> sizes;
  std::vector<Colour> palette;  // one is drawn for each body; empty: `colour`
  std::optional<Look> look;     // of every body; none: the material's
  // Least and most, [0, 1]: drawn for each body, evenly; none: the look's.
  std::optional<std::array<double, 2>> roughness, clear_coat;
  EmitterSource source;
  // How many bodies. A grid has its own count; a volume or a guide is filled and `count` limits it
  // (0: no limit).
  int count = 0;
  double rate_hz = 0;  // bodies a second, one by one from start_s on; 0: all at start_s
  double start_s = 0;  // >= 0; of a guide's bodies: of their release
  Vec3 linear_velocity = Vec3::Zero();   // m/s
  Vec3 angular_velocity = Vec3::Zero();  // rad/s
  double position_jitter_m = 0;          // uniform in a cube of this half width
  double linear_velocity_jitter = 0;     // m/s, uniform in a ball
  double angular_velocity_jitter = 0;    // rad/s, uniform in a ball
  std::optional<Quat> orientation;       // none: uniform over rotations
  bool asleep = false;                   // each out of the solver until something hits it
  Preference preference = Preference::prefer_statistical;
  std::optional<Colour> colour;
  // With a rate only.
  std::optional<double> end_s;  // > start_s; `count` has no bodies that would start then or later
  std::optional<UntilFull> until;
};

inline bool fills_guide(const Emitter& emitter) {
  return std::holds_alternative<GuideSource>(emitter.source) ||
         std::holds_alternative<MouldSource>(emitter.source);
}

struct ReleaseEvent {
  std::vector<std::string> bodies;
};
struct RemoveEvent {
  std::vector<std::string> bodies;
  int highest = 0;  // without bodies: so many of those that are there, from the top; else 0
};
struct ImpulseEvent {
  std::vector<std::string> bodies;
  Vec3 impulse = Vec3::Zero();  // N s, world frame
  std::optional<Vec3> point;    // m, world frame; none: at the centre of mass
};
struct Event {
  double time_s = 0;
  std::variant<ReleaseEvent, RemoveEvent, ImpulseEvent> action;
};

// impulse: contacts are solved (the reference). statistical: collisions are drawn from signatures.
// particle: bodies are spheres that bounce. mixed: each pair in one of these ways.
enum class SimulatorMode { impulse, statistical, particle, mixed };
std::string mode_name(SimulatorMode mode);

// How the mixed mode treats a pair of bodies that may touch. none: not at all.
enum class PairMethod : uint8_t { none, impulse, statistical, particle };

// One level of detail: the methods for pairs of prefer-statistical bodies, I' where a must-impulse
// body is near and S elsewhere. Pairs with a must-impulse body are always solved.
struct DetailLevel {
  PairMethod near_near = PairMethod::impulse;     // (I', I')
  PairMethod near_far = PairMethod::statistical;  // (I', S)
  PairMethod far_far = PairMethod::statistical;   // (S, S)
  bool exact = false;  // all bodies of the level are I', wherever they are
};

// Pairs that one method takes whatever their level: bodies and emitters by name.
struct PairRule {
  std::string a, b;
  PairMethod method = PairMethod::statistical;  // statistical or particle
};

// Which level a body has: the coarsest one that any rule asks for. Limits have an entry less than
// there are levels, or none: then the rule is not used.
struct LevelOfDetail {
  std::vector<DetailLevel> levels = {  // finest first, 1 .. 8
      {},
      {PairMethod::particle, PairMethod::particle, PairMethod::particle}};
  int level = 1;                     // the finest that is used, from 1
  std::vector<double> distances_m;   // ascending; from the camera, beyond which the next one holds
  std::vector<double> screen_sizes;  // descending; of the picture's height, below which it holds
  std::vector<double> speeds;        // ascending, m/s; above which it holds
  std::optional<int> out_of_view;    // the level of bodies that the camera does not see, from 1
  double hysteresis = 0.1;           // share of a limit by which a level outlasts it, 0 .. 0.9
  std::vector<PairRule> pairs;

  // Default of Method::dissertation.
  static std::vector<DetailLevel> table_4_1();
};

// Engine that solves the contacts: pilesim's own, or, in the impulse mode, Bullet as a second
// opinion (scene/engine_checks.h).
enum class EngineKind { exact, bullet };

// The project's own, or the dissertation's as it is written: of the statistical mode (chapter 3),
// the mixed one (4.2, 4.3), of piles (5.2), of guides (6.2).
enum class Method { own, dissertation };

struct SimulatorSettings {
  SimulatorMode mode = SimulatorMode::impulse;
  EngineKind engine = EngineKind::exact;
  Method method = Method::own;
  bool sleeping = true;        // bodies at rest leave the solver until they are touched
  bool rest_control = true;    // statistical: bodies on level ground end in a rest pose
  int solver_iterations = 20;  // 1 .. 1000 sweeps in a step, but of the exact engine alone
  LevelOfDetail detail;        // mixed
};

// How a pile is held. glue: by the least glue at its contacts with which the whole stands. Or by
// bodies that stand (dissertation, chapter 6): freeze: clusters of them that rest on the ground
// stop moving; nail: each is nailed to its neighbours.
enum class HoldKind { glue, freeze, nail };

// A pile kept in a shape until something knocks it down (dissertation, chapter 6; docs/guides.md).
// Defaults are the project's own; docs/equilibrium.md has the dissertation's.
struct Guide {
  std::optional<std::filesystem::path> file;  // absolute, a closed mesh
  double scale = 1;                           // metres per unit of the file, > 0
  std::optional<std::string> shape;           // of the scene, instead; neither: everywhere
  Pose pose;                                  // of the frame of file or shape in the world
  bool control = true;                        // false: bodies are analysed and not held
  HoldKind hold = HoldKind::glue;
  double alpha = 0.5;  // of nails: (6.2), in r^2, >= 0
  // Most glue, in the pile's weight, >= 0; none: no limit.
  std::optional<double> max_glue;
  int period_steps = 20;           // of the control, >= 1
  double least_normal_up = -0.5;   // contacts with less of their normal upwards do not support
  double kinetic_share = 6.0 / 7;  // of the friction, at which a body must stand to be held, 0 .. 1
  int least_contacts = 3;          // that support a body that is held
  double least_spread = 0.01;      // of these contacts: twice a triangle's area, in r^2
  bool neighbours = true;          // all that touch it must be fit to be held too
  double most_speed = 0.25;        // of a body that is held, in sqrt(g r)
  double break_speed = 0.3;        // of a hit, in sqrt(g r): see docs/equilibrium.md

  bool is_everywhere() const { return !file && !shape; }
  std::string file_name() const { return file ? file->string() : ""; }  // for messages
};

// A point of the ground plan: (x, z), m.
using GroundPoint = Eigen::Vector2d;

// Walls that a pile grows against: a convex polygon and how high it can be filled.
struct PileBoundary {
  std::vector<GroundPoint> polygon;  // >= 3 corners
  double rim_m = 0;                  // y of the lowest place of the walls' top
};

// A pile that `pilesim direct-pile` lets grow to an angle of repose (dissertation 5.2).
struct Pile {
  double angle = radians(30);         // of repose, (0, 80 degrees]
  double tau = 0.5;                   // of the sleep score, (0, 1)
  Method method = Method::own;        // the same for all piles of a scene
  double base_m = 0;                  // y of the ground below it
  std::optional<GroundPoint> centre;  // none (and no footprint): where the first bodies land
  // Instead of a centre: 2 points of a line or a convex polygon, from which slopes fall on all
  // sides. Empty: a cone.
  std::vector<GroundPoint> footprint;
  std::optional<PileBoundary> boundary;
};

struct CameraKey {
  double time_s = 0;
  Vec3 position = Vec3::Zero();        // m
  Vec3 target = Vec3::Zero();          // m
  double field_of_view = radians(35);  // vertical, (0, pi)
  // Focal length of the lens, > 0, and width of the sensor, which is as wide as the picture; they
  // set field_of_view if given.
  std::optional<double> focal_length_mm;
  double sensor_width_mm = 36;
  double roll = 0;  // clockwise about the optical axis, as seen from behind the camera
  // How far the picture lies right and up of the optical axis, in widths of the picture.
  std::array<double, 2> lens_shift = {0, 0};
};
// One key: a fixed camera. Several: cubic in between. None: the renderer frames the action.
struct Camera {
  std::vector<CameraKey> keys;
};

// Around a point at one height, at a constant speed.
struct CameraOrbit {
  std::optional<Vec3> target;  // m; none: the middle of the pile at the end
  double distance_m = 1;       // > 0, from the target
  double elevation = 0;        // above it, (-90, 90 degrees)
  double azimuth = 0;          // at the start; 0 is +z, then towards +x
  double period_s = 10;        // of a turn; negative: clockwise as seen from above
};
// Fixed views from everywhere on a part of a hemisphere, drawn by the scene's seed.
struct RandomViews {
  int count = 1;                                       // >= 1
  std::optional<Vec3> target;                          // as of an orbit
  std::array<double, 2> distance_m = {1, 1};           // from, to; > 0
  std::array<double, 2> elevation = {0, radians(90)};  // from, to
};
// One of several cameras: exactly one member after the name says where it is.
struct NamedCamera {
  std::string name;
  std::optional<Camera> path;
  std::optional<CameraOrbit> orbit;
  std::optional<RandomViews> random_views;
  double field_of_view = radians(35);  // of an orbit and of random views
};

// Renderer: OpenGL, which is fast, or rays.
enum class Renderer : uint8_t { raster, rays };

// How long the renderer by rays takes for a picture. Settings that the scene leaves out follow from
// `quality`.
enum class RayQuality : uint8_t {
  preview,  // a sample, the sun's shadow and the open sky
  good,     // four of them
  final     // 16 samples, light from surface to surface
};
struct RaySettings {
  RayQuality quality = RayQuality::final;
  std::optional<int> samples;  // a pixel, >= 1
  std::optional<int> bounces;  // of light from surface to surface, >= 0
  bool denoise = true;
  double sun_angle = radians(8);           // the sun's angular size, [0, 90 degrees]
  double shutter = 0;                      // how long it is open, in frames, [0, 1]
  double lens_diameter_m = 0;              // 0: all is sharp
  std::optional<double> focus_distance_m;  // along the optical axis; none: the camera's target
};

// Angles as those of cameras: azimuth 0 is in the direction of z, 90 degrees in that of x.
struct Light {
  double azimuth = radians(-50), elevation = radians(51);  // of the sun, as seen from the scene
  double sun = 1, sky = 1;                                 // times as bright as by itself, >= 0
  Colour sun_colour = {255, 255, 255};                     // times its own, a little warm
  Colour sky_colour = {255, 255, 255};                     // times the sky's light
  // Backdrop at the horizon and above; none: the usual, of pale blue.
  std::optional<Colour> horizon_colour, zenith_colour;
  // Absolute: a picture of all directions whose light the sky's is, times `sky` and `sky_colour`.
  // Its middle column is in the direction of z at a turn of 0, and turns from there towards x.
  std::optional<std::filesystem::path> sky_file;
  double sky_turn = 0;

  bool operator==(const Light&) const = default;
};

struct RenderSettings {
  std::array<int, 2> size = {960, 540};  // pixels
  int samples = 4;                       // anti-aliasing: 1, 2, 4 or 8
  bool analysis = false;                 // colour bodies by their equilibrium
  Renderer renderer = Renderer::raster;
  RaySettings rays;
  Light light;
  double exposure = 0;  // stops: each doubles the light of the picture
};

// by_mode: in the statistical and the mixed mode, which leave overlaps, if the pile is at rest.
enum class Finishing : uint8_t { by_mode, never, always };

// The pile is made sound at the end of a run, and its motion is eased to end so (docs/finish.md).
struct Finish {
  Finishing when = Finishing::by_mode;
  std::optional<double> longest_s;  // > 0, simulated; none: by the size of the bodies
  bool visible_only = false;        // bodies that no camera can see may still overlap
};

// When a run ends: after its duration, or, at the latest then, when all has come to rest.
enum class Until : uint8_t { duration, settled };

struct Scene {
  std::string name;
  uint64_t seed = 1;
  double duration_s = 5;  // > 0
  Until until = Until::duration;
  double frame_rate = 60;  // frames a second, > 0
  // Longest step; a frame takes the fewest equal steps that fit. None: the impulse mode chooses it
  // from the state in each step, the other modes take kFixedStep, or less for small bodies
  // (choose_fixed_step()).
  std::optional<double> step_s;
  // Penetration at rest that the automatic step and the substeps allow, in D; 20 times that at an
  // impact. 1e-5 .. 0.1
  double accuracy = 1e-3;
  Vec3 gravity = {0, -9.81, 0};  // m/s^2
  std::map<std::string, Material> materials;
  std::map<std::string, Shape> shapes;
  std::vector<Body> bodies;
  std::vector<Emitter> emitters;
  std::vector<Joint> joints;
  std::vector<Chain> chains;
  std::vector<Event> events;  // ordered by time
  SimulatorSettings simulator;
  std::optional<Guide> guide;
  std::vector<Pile> piles;
  Finish finish;
  Camera camera;
  std::vector<NamedCamera> cameras;  // others, for `render --camera`
  RenderSettings render;

  int frame_count() const;                         // frames 0 (the start) .. frame_count() - 1
  static constexpr double kFixedStep = 1.0 / 240;  // s
  // Where steps are of one length.
  int steps_per_frame() const;
  double actual_step_s() const { return 1.0 / (frame_rate * steps_per_frame()); }
  // The mode leaves overlaps that the scene does not ask for: see Finishing::by_mode.
  bool finishes_by_mode() const;
};

}  // namespace pilesim
