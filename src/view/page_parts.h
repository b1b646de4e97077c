// The files of the page, embedded by CMake.
#pragma once

#include <string_view>

namespace pilesim::page_parts {

extern const std::string_view page_html;  // with @TITLE@, @STYLE@, @ABOUT@, @DATA@, @SCRIPT@
extern const std::string_view page_css;
extern const std::string_view page_data_js, page_math_js, page_renderer_js, page_camera_js,
    page_colours_js, page_main_js, page_shaders_js;

}  // namespace pilesim::page_parts
