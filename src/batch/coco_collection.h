// coco.json of a batch: the annotations of all pictures.
#pragma once

#include "batch/collection.h"

namespace pilesim {

// Writes DIR/coco.json and counts its pictures and annotations.
void collect_coco(const BatchPlace& place, const JobRecords& records, CollectionSummary& summary);

}  // namespace pilesim
