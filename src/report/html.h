// Parts shared by the pages of reports.
#pragma once

#include <filesystem>
#include <string>

namespace pilesim {

// Escapes plain text for HTML.
std::string escaped(const std::string& text);

// A self-contained page; `title` and `body` are HTML. On narrow screens wide parts scroll on their
// own.
std::string html_page(const std::string& title, const std::string& body);

// A table in its own frame, from rows in HTML.
std::string html_table(const std::string& rows);
// A chart under its title; on a page too narrow to read it, it scrolls on its own.
std::string html_chart(const std::string& title, const std::string& svg);

// A placeholder for a picture that is added later; `label` is HTML.
std::string picture_place(const std::string& name, const std::string& label);
// The picture of the end of a run in its report.html, and its caption.
inline constexpr const char* kEndPicture = "end";
inline constexpr const char* kEndLabel = "The pile at its end";
// Embeds a PNG file at a placeholder of `page`, with `label` (empty: keep the present one). `page`
// was written by pilesim; a missing page, or one without the placeholder, stays unchanged. Throws
// Error(io).
void put_picture(const std::filesystem::path& page, const std::string& name, const std::string& png,
                 const std::string& label = {});
// True if the placeholder of `page` is still empty; false if page or placeholder is missing.
bool lacks_picture(const std::filesystem::path& page, const std::string& name);

}  // namespace pilesim
