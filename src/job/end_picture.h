// The pictures that reports open with: piles as they lie in the end.
#pragma once

#include <filesystem>
#include <span>
#include <string>

#include "scene/scene.h"

namespace pilesim {

// A run, and where its end is shown on a page: html.h, picture_place().
struct EndPicture {
  std::filesystem::path run;  // directory
  std::string place, label;   // HTML; an empty label leaves what stands there
};

// Draws the last frame of each run into `page`, small, by one camera: the scene's own or one that
// frames the events of the first run. Faults of drawing are not thrown, since the runs are whole
// without pictures: the result says why pictures are missing, else it is empty. Throws Error(io)
// where `page` cannot be written.
std::string put_end_pictures(const std::filesystem::path& page, const Scene& scene,
                             std::span<const EndPicture> runs);

// The same of one run, into its own report.html.
std::string put_end_picture(const std::filesystem::path& run, const Scene& scene);
// Only where there is none: what a run that was complete may have been killed before.
std::string put_missing_end_picture(const std::filesystem::path& run, const Scene& scene);

}  // namespace pilesim
