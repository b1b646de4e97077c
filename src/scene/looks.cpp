#include "scene/looks.h"

namespace pilesim {

// Colours of metals are their reflectances at right angles, in sRGB, as tables of them have it.
// Those without a colour are painted by the palette.
const std::vector<std::pair<std::string, Look>>& named_looks() {
  static const std::vector<std::pair<std::string, Look>> kLooks = {
      {"steel", {.colour = Colour{196, 199, 201}, .roughness = 0.3, .metallic = 1}},
      {"brass", {.colour = Colour{232, 200, 116}, .roughness = 0.25, .metallic = 1}},
      {"gold", {.colour = Colour{255, 219, 145}, .roughness = 0.2, .metallic = 1}},
      {"copper", {.colour = Colour{246, 186, 158}, .roughness = 0.25, .metallic = 1}},
      {"glass", {.colour = Colour{238, 248, 244}, .roughness = 0, .transmission = 1}},
      {"clear_plastic", {.roughness = 0.05, .transmission = 1}},
      {"porcelain", {.colour = Colour{236, 234, 226}, .roughness = 0.5, .clear_coat = 1}},
      {"rubber", {.colour = Colour{42, 42, 44}, .roughness = 0.8}},
      {"oak", {.colour = Colour{178, 132, 84}, .roughness = 0.55, .clear_coat = 0.2}},
      {"slate", {.colour = Colour{84, 92, 100}, .roughness = 0.7}},
      {"paper", {.colour = Colour{242, 240, 232}, .roughness = 1}},
      {"glow", {.roughness = 1, .emission = 3}},
      {"concrete",
       {.colour = Colour{168, 165, 160},
        .roughness = 0.9,
        .pattern = Pattern::concrete,
        .pattern_m = 2}},
      {"wood",
       {.colour = Colour{186, 138, 92},
        .roughness = 0.6,
        .pattern = Pattern::planks,
        .pattern_m = 0.15}},
      {"dark", {.colour = Colour{38, 39, 42}, .roughness = 0.7}},
      {"checker", {.colour = Colour{226, 226, 222}, .roughness = 0.6, .pattern = Pattern::checker}},
  };
  return kLooks;
}

const std::vector<std::pair<std::string, Light>>& named_lights() {
  static const std::vector<std::pair<std::string, Light>> kLights = {
      {"studio", {}},
      {"noon",
       {.azimuth = radians(-30),
        .elevation = radians(68),
        .sun = 1.5,
        .sky = 0.65,
        .sky_colour = {232, 242, 255},
        .horizon_colour = Colour{226, 236, 246},
        .zenith_colour = Colour{84, 142, 208}}},
      {"evening",
       {.azimuth = radians(-62),
        .elevation = radians(13),
        .sun = 1.7,
        .sky = 0.6,
        .sun_colour = {255, 196, 132},
        .sky_colour = {214, 214, 255},
        .horizon_colour = Colour{255, 202, 150},
        .zenith_colour = Colour{92, 112, 172}}},
      {"dark",
       {.elevation = radians(58),
        .sun = 1.35,
        .sky = 0.4,
        .horizon_colour = Colour{60, 61, 66},
        .zenith_colour = Colour{26, 27, 30}}},
      {"overcast",
       {.elevation = radians(75),
        .sun = 0.18,
        .sky = 1.75,
        .sky_colour = {250, 252, 255},
        .horizon_colour = Colour{176, 180, 184},
        .zenith_colour = Colour{148, 154, 162}}},
  };
  return kLights;
}

Codec<Look> look_codec() { return enumeration<Look>(named_looks()); }

}  // namespace pilesim
