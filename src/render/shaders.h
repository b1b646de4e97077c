// The GLSL files of shaders/, embedded at build time (shaders/embed.cmake).
#pragma once

#include <string_view>

namespace pilesim::shaders {

extern const std::string_view background_glsl;
extern const std::string_view clear_frag;
extern const std::string_view clear_vert;
extern const std::string_view display_frag;
extern const std::string_view display_glsl;
extern const std::string_view lighting_glsl;
extern const std::string_view pattern_glsl;
extern const std::string_view scene_view_glsl;
extern const std::string_view surface_glsl;
extern const std::string_view tone_glsl;
extern const std::string_view body_vert;
extern const std::string_view body_frag;
extern const std::string_view shadow_vert;
extern const std::string_view shadow_frag;
extern const std::string_view ground_vert;
extern const std::string_view ground_frag;
extern const std::string_view screen_vert;
extern const std::string_view key_light_frag;
extern const std::string_view occlusion_depth_frag;
extern const std::string_view occlusion_frag;
extern const std::string_view occlusion_blur_frag;
extern const std::string_view farthest_depth_frag;
extern const std::string_view picture_frag;

}  // namespace pilesim::shaders
