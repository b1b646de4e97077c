// The pictures at the top of reports: piles at the end of runs.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "scene/scene.h"

namespace pilesim {

// A run, and the placeholder for its picture on a page: html.h, picture_place().
struct EndPicture {
  std::filesystem::path run;  // its directory
  std::string place, label;   // HTML; an empty label keeps the present one
};

// Draws the last frame of each run into `page`, small, with one camera: the scene's own, or one
// that frames the first run. Errors of drawing are not thrown, since the runs are complete without
// pictures: the returned text says why pictures are missing; otherwise it is empty. Throws
// Error(io) if `page` cannot be written.
std::string put_end_pictures(const std::filesystem::path& page, const Scene& scene,
                             std::span<const EndPicture> runs);

// The same for one run, into its own report.html.
std::string put_end_picture(const std::filesystem::path& run, const Scene& scene);
// Only if it is missing: a complete run may have been killed before its picture.
std::string put_missing_end_picture(const std::filesystem::path& run, const Scene& scene);

}  // namespace pilesim
