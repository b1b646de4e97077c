// Parts that the pages of reports share.
#pragma once

#include <filesystem>
#include <string>

namespace pilesim {

// Plain text as it stands in HTML.
std::string escaped(const std::string& text);

// A page that needs no other file; `title` and `body` are HTML. It fits a phone: what is wider
// scrolls by itself.
std::string html_page(const std::string& title, const std::string& body);

// A table in a frame of its own, of rows in HTML.
std::string html_table(const std::string& rows);
// A chart under its title; where the page is too narrow to read it, it scrolls by itself.
std::string html_chart(const std::string& title, const std::string& svg);

// Where a picture goes that is drawn later; `label` is HTML.
std::string picture_place(const std::string& name, const std::string& label);
// The picture of the end of a run in its report.html, and its caption.
inline constexpr const char* kEndPicture = "end";
inline constexpr const char* kEndLabel = "The pile at its end";
// Puts the bytes of a PNG file there, as part of the page, under `label` (empty: what stands
// there). `page` is one that pilesim wrote; one that is missing or has no such place stays as it
// is. Throws Error(io).
void put_picture(const std::filesystem::path& page, const std::string& name, const std::string& png,
                 const std::string& label = {});
// Whether that place of `page` is still without one; false where there is no such page or place.
bool lacks_picture(const std::filesystem::path& page, const std::string& name);

}  // namespace pilesim
