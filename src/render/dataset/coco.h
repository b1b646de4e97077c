// Annotations in the format of the COCO dataset: boxes and masks of visible bodies.
#pragma once

#include <filesystem>
#include <memory>

#include "render/dataset/annotations.h"

namespace pilesim {

// `file`: all of it, written by finish(). Pictures are named relative to its directory.
std::unique_ptr<AnnotationWriter> make_coco_writer(const TrajectoryHeader& header,
                                                   const std::filesystem::path& file);

}  // namespace pilesim
