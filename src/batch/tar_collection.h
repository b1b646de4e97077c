// tar/ of a batch: pictures, passes and what is told of them, a few jobs a file, as WebDataset has
// them.
#pragma once

#include "batch/collection.h"

namespace pilesim {

// The tar files of the jobs from `begin` to before `end`, of which it takes those that have all
// their jobs there, and counts them, their samples and their jobs. Entries that the plan drops once
// they are packed are removed. Files that are there and of the same jobs are kept.
void collect_tars(const BatchPlace& place, const JobRecords& records, uint64_t begin, uint64_t end,
                  CollectionSummary& summary);

// Those of an earlier plan of more jobs: from number `first` on.
void remove_tars_from(const BatchPlace& place, uint64_t first);

}  // namespace pilesim
