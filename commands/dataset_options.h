// Options of render that make a dataset of pictures.
#pragma once

#include <CLI/CLI.hpp>
#include <vector>

#include "render/dataset/pass_files.h"

namespace pilesim {

struct DatasetOptions {
  std::vector<Pass> passes;
  bool coco = false, bop = false;

  bool any() const { return !passes.empty() || coco || bop; }
};

// --passes and --annotations.
std::vector<CLI::Option*> add_dataset_options(CLI::App& command, DatasetOptions& options);

}  // namespace pilesim
