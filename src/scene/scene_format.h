// The scene format: every key with its range, default and description, once.
#pragma once

#include "json/codec.h"
#include "scene/scene.h"

namespace pilesim {

inline constexpr int kSceneVersion = 1;
inline constexpr int kMostBodies = 2'000'000;
// Bounds of bodies. Beyond them inertia, its inverse and their products leave the range of numbers.
inline constexpr double kSmallestLength = 1e-6;  // m
inline constexpr double kLargestMoving = 1e6;    // m
inline constexpr double kThinnestMoving = 1e-6;  // of the longest side
inline constexpr double kLeastDensity = 1e-3;    // kg/m^3

// Built at the first call.
const Codec<Scene>& scene_codec();

// Its parts.
Codec<Shape> shape_codec();
Codec<Body> body_codec();
Codec<MotionKey> motion_key_codec();
Codec<Motor> kinematic_motor_codec();
Codec<Emitter> emitter_codec();
Codec<Joint> joint_codec();
Codec<Chain> chain_codec();
Codec<Event> event_codec();
Codec<Camera> camera_codec();
Codec<NamedCamera> named_camera_codec();
// field_of_view of the keys that say a focal length.
void apply_focal_lengths(Scene& scene);
// For meshes that leave it open: the mesh itself for rooms and terrain, the hull for bodies that
// move.
void choose_collisions(Scene& scene);
Codec<Guide> guide_codec();
Codec<Pile> pile_codec();
Codec<Method> method_codec();
Codec<SimulatorSettings> simulator_codec();
Codec<Preference> preference_codec();
// "an array [least, most] of two numbers", in the file `scale` times as large.
Codec<std::array<double, 2>> two_numbers(Range range, const std::string& meaning, double scale = 1);
inline constexpr const char* kPreferenceText =
    "Mixed mode. must_impulse: all contacts of the body are solved exactly; prefer_statistical: "
    "its level of detail decides.";

}  // namespace pilesim
