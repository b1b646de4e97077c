// bop/ of a batch: one dataset, of which files are links to those of the jobs.
#pragma once

#include "batch/collection.h"

namespace pilesim {

// Makes DIR/bop/ and counts its scenes and models. Scenes that are there and of the same job are
// kept.
void collect_bop(const BatchPlace& place, const JobRecords& records, CollectionSummary& summary);

}  // namespace pilesim
