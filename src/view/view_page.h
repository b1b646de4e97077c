// Assembles the page from its texts and data.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace pilesim {

// HTML. page_main.js reads `about`; page_data.js reads `bytes` (given before compression).
std::string view_page(const nlohmann::ordered_json& about, const std::string& bytes);

// zlib's format (RFC 1950), which browsers call deflate.
std::string deflated(const std::string& bytes);
// RFC 4648.
std::string base64(const std::string& bytes);

}  // namespace pilesim
