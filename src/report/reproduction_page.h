// Tables and figures of the dissertation beside ours, as a page and as Markdown. Pictures stay
// where they are, below the directory of the page.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace pilesim {

// `figures` is what run_reproduction() writes into reproduction.json.
std::string reproduction_html(const nlohmann::ordered_json& figures);
std::string reproduction_markdown(const nlohmann::ordered_json& figures);

}  // namespace pilesim
