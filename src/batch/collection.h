// Collections of the jobs of a batch that are done, in their order.
//
//   DIR/coco.json                  annotations of all pictures
//   DIR/bop/                       one dataset: models once, a scene for each camera of each job
//   DIR/tar/000000.tar, .json      pictures, passes and what is told of them, a few jobs a file
//
// One job after another: memory holds the annotations of one camera. Files that are there and of
// the same jobs are kept, so that a collection that was killed goes on; the bytes are the same
// either way.
#pragma once

#include <cstdint>

#include "batch/job_records.h"

namespace pilesim {

struct CollectionSummary {
  uint64_t pictures = 0, annotations = 0;      // in coco.json
  uint64_t scenes = 0, models = 0;             // in bop/
  uint64_t tars = 0, samples = 0, packed = 0;  // tar files, and how many jobs are in them
};

// All that the plan collects. Throws Error(io), Error(input) where what a job left is not as
// pilesim writes it, and Error(interrupted) after Ctrl-C.
CollectionSummary collect_datasets(const BatchPlace& place, const JobRecords& records);

// The tar files of the jobs from `begin` to before `end` alone, of which it takes those that have
// all their jobs there.
CollectionSummary pack_tars(const BatchPlace& place, const JobRecords& records, uint64_t begin,
                            uint64_t end);

}  // namespace pilesim
