// bop/ of a batch: one dataset whose files are links to those of the jobs.
#pragma once

#include "batch/collection.h"

namespace pilesim {

// Makes DIR/bop/ and counts its scenes and models. Existing scenes of the same job are kept.
void collect_bop(const BatchPlace& place, const JobRecords& records, CollectionSummary& summary);

}  // namespace pilesim
