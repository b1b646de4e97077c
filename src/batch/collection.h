// Collections of the finished jobs of a batch, in order.
//
//   DIR/coco.json                  annotations of all pictures
//   DIR/bop/                       one dataset: models once, a scene for each camera of each job
//   DIR/tar/000000.tar, .json      pictures, passes and annotations, several jobs per file
//
// Jobs are processed one at a time: memory holds the annotations of one camera. Existing files of
// the same jobs are kept, so that a killed collection can continue; the bytes are the same
// either way.
#pragma once

#include <cstdint>

#include "batch/job_records.h"

namespace pilesim {

struct CollectionSummary {
  uint64_t pictures = 0, annotations = 0;      // in coco.json
  uint64_t scenes = 0, models = 0;             // in bop/
  uint64_t tars = 0, samples = 0, packed = 0;  // tar files, samples in them, and jobs in them
};

// Makes all collections of the plan. Throws Error(io), Error(input) if a job's output is not in
// pilesim's format, and Error(interrupted) after Ctrl-C.
CollectionSummary collect_datasets(const BatchPlace& place, const JobRecords& records);

// Makes only the tar files for the jobs in [begin, end) whose jobs are all finished.
CollectionSummary pack_tars(const BatchPlace& place, const JobRecords& records, uint64_t begin,
                            uint64_t end);

}  // namespace pilesim
