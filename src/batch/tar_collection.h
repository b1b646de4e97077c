// tar/ of a batch: pictures, passes and annotations in the WebDataset layout, several jobs per
// file.
#pragma once

#include "batch/collection.h"

namespace pilesim {

// Writes the tar files for the jobs in [begin, end) whose jobs are all finished, and counts files,
// samples and jobs. Removes entries that the plan drops once they are packed. Existing files of the
// same jobs are kept.
void collect_tars(const BatchPlace& place, const JobRecords& records, uint64_t begin, uint64_t end,
                  CollectionSummary& summary);

// Removes the files of an earlier, larger plan from number `first` on.
void remove_tars_from(const BatchPlace& place, uint64_t first);

}  // namespace pilesim
