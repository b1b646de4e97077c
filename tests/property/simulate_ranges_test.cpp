// Simulators run all valid scenes: values over their whole ranges, with extreme sizes and speeds.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "core/error.h"
#include "core/philox.h"
#include "json/codec.h"
#include "model/model.h"
#include "scene/scene_format.h"
#include "scene/scene_loader.h"
#include "simulate/modes/make_simulator.h"
#include "support/thrown_error.h"

namespace pilesim {
namespace {

// A ground and a few bodies of one shape over it.
class RandomScene {
 public:
  explicit RandomScene(uint32_t number) : random_(7, Stream::test, number) {}

  std::string text() {
    longest_m_ = between(10 * kSmallestLength, kLargestMoving);
    thinnest_m_ = std::max(kSmallestLength, between(kThinnestMoving, 1) * longest_m_);
    const std::string shape = this->shape(), mode = this->mode(), material = this->material();
    return R"({"version": 1, "duration_s": 1, "frame_rate": )" + text_of(between(30, 1e5)) +
           gravity() + mode + R"(, "materials": {"m": )" + material +
           R"(}, "shapes": {"ground": {"type": "plane"}, "s": )" + shape +
           R"(}, "bodies": [{"shape": "ground", "material": "m", "role": "static"}],
               "emitters": [)" +
           emitter() + "]}";
  }

 private:
  bool tossed() { return random_.index(2) == 0; }
  double between(double low, double high) {
    return std::exp(random_.uniform(std::log(low), std::log(high)));
  }
  double signed_number() {
    const double sign = tossed() ? 1 : -1;
    return sign * between(1e-9, kLargestNumber);
  }
  static std::string text_of(double number) {
    char text[32];
    std::snprintf(text, sizeof text, "%.17g", number);
    return text;
  }
  static std::string array(const std::vector<double>& numbers) {
    std::string text;
    for (const double number : numbers) text += (text.empty() ? "[" : ", ") + text_of(number);
    return text + ']';
  }

  std::string shape() {
    const uint32_t kind = random_.index(3);
    if (kind == 0) return R"({"type": "sphere", "radius": )" + text_of(longest_m_ / 2) + '}';
    if (kind == 1) {
      const double radius = tossed() ? longest_m_ / 2 : std::max(kSmallestLength, thinnest_m_ / 2);
      return R"({"type": "cylinder", "radius": )" + text_of(radius) + R"(, "height": )" +
             text_of(radius == longest_m_ / 2 ? thinnest_m_ : longest_m_) + '}';
    }
    std::vector<double> sides = {longest_m_, between(thinnest_m_, longest_m_), thinnest_m_};
    std::swap(sides[0], sides[random_.index(3)]);
    return R"({"type": "box", "size": )" + array(sides) + '}';
  }
  std::string material() {
    std::string text = R"({"density_kg_m3": )" + text_of(between(kLeastDensity, kLargestNumber));
    if (tossed()) text += R"(, "restitution": )" + text_of(random_.index(2));
    const double most_friction = is_bullet_ ? 10 : kLargestNumber;
    if (tossed()) text += R"(, "friction": )" + text_of(between(1e-9, most_friction));
    if (is_exact_ && tossed()) text += R"(, "rolling_friction": )" + text_of(between(1e-9, 1e3));
    return text + '}';
  }
  std::string gravity() {
    if (tossed()) return "";
    return R"(, "gravity": [0, )" + text_of(signed_number()) + ", 0]";
  }
  std::string mode() {
    const uint32_t kind = random_.index(5);
    is_exact_ = kind > 1;
    is_bullet_ = kind == 1;
    if (kind == 0) return R"(, "simulator": {"mode": "particle"})";
    return is_bullet_ ? R"(, "simulator": {"engine": "bullet"})" : "";
  }
  std::string emitter() {
    const double apart_m = 2 * longest_m_ * between(0.6, 3);
    std::string text = R"({"type": "grid", "shape": "s", "material": "m", "count": [2, 1, 2],
                           "centre": [0, )" +
                       text_of(1.1 * apart_m) + R"(, 0], "spacing": )" +
                       array({apart_m, apart_m, apart_m});
    for (const char* key : {"linear_velocity", "angular_velocity"}) {
      if (tossed()) continue;
      std::vector<double> speeds;
      for (int k = 0; k < 3; ++k) speeds.push_back(signed_number());
      text += std::string(R"(, ")") + key + R"(": )" + array(speeds);
    }
    return text + '}';
  }

  Philox random_;
  double longest_m_ = 0, thinnest_m_ = 0;
  bool is_exact_ = true, is_bullet_ = false;
};

void expect_runs(const std::string& text) {
  try {
    const LoadedScene loaded = parse_scene(text, "/scene.json");
    const Model model = build_model(loaded.scene);
    const auto simulator = make_simulator(loaded.scene, model);
    for (int frame = 0; frame < 3; ++frame) simulator->step_frame();
    for (const Vec3& position : simulator->states().position) {
      EXPECT_TRUE(position.allFinite()) << text;
    }
  } catch (const Error& error) {
    ADD_FAILURE() << error.what() << '\n' << text;
  }
}

TEST(Ranges, SimulatorsRunAllValidScenes) {
  for (uint32_t i = 0; i < 60; ++i) expect_runs(RandomScene(i).text());
}

// Squares of their response to a torque overflow a float, or its two directions differ by more than
// a float's precision.
TEST(Ranges, HeavyBallsAndLongRodsAreHeldBackFromRolling) {
  for (const char* shape : {R"({"type": "sphere", "radius": 2400})",
                            R"({"type": "box", "size": [0.04, 0.06, 1240]})"}) {
    expect_runs(
        R"({"version": 1, "duration_s": 1, "frame_rate": 30, "step_s": 0.004,
            "materials": {"m": {"rolling_friction": 0.5}},
            "shapes": {"ground": {"type": "plane"}, "s": )" +
        std::string(shape) + R"(},
            "bodies": [{"shape": "ground", "material": "m", "role": "static"},
                       {"shape": "s", "material": "m", "position": [0, 20, 0],
                        "rotation_deg": [20, 30, 40]}]})");
  }
}

TEST(Ranges, BodiesThatNoNumbersHoldAreRefused) {
  const auto refusal = [](const std::string& size, const std::string& density) {
    return test::error_text(
        [&] {
          build_model(parse_scene(R"({"version": 1, "duration_s": 1, "materials":
                                  {"m": {"density_kg_m3": )" +
                                      density + R"(}}, "shapes": {"s": {"type": "box", "size": )" +
                                      size + R"(}}, "bodies": [{"shape": "s", "material": "m"}]})",
                                  "/scene.json")
                          .scene);
        },
        ErrorKind::input);
  };
  EXPECT_NE(refusal("[1, 1, 1]", "1e-320").find("/materials/m/density_kg_m3"), std::string::npos);
  EXPECT_NE(refusal("[1, 1, 5e-324]", "1").find("/shapes/s/size/2"), std::string::npos);
  for (const char* size : {"[1e6, 1e-6, 1e-6]", "[1e9, 1e9, 1e9]", "[1e-3, 1e4, 1e4]"}) {
    EXPECT_NE(refusal(size, "1").find("is as heavy to turn as a box"), std::string::npos) << size;
  }
}

TEST(Ranges, AnImpulseGivesNoSpeedThatNoBodyMayBeginWith) {
  const std::string error = test::error_text(
      [] {
        build_model(parse_scene(R"({"version": 1, "duration_s": 1, "materials": {"m": {}},
                                    "shapes": {"s": {"type": "box", "size": [0.01, 0.01, 0.01]}},
                                    "bodies": [{"name": "b", "shape": "s", "material": "m"}],
                                    "events": [{"time_s": 0, "type": "impulse", "bodies": ["b"],
                                                "impulse": [0, 1e7, 0]}]})",
                                "/scene.json")
                        .scene);
      },
      ErrorKind::input);
  EXPECT_NE(error.find("/events/0/impulse: gives 'b', of 0.001 kg, 1e+10 m/s"), std::string::npos)
      << error;
}

}  // namespace
}  // namespace pilesim
