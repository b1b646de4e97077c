#include "batch/collection.h"

#include "batch/bop_collection.h"
#include "batch/coco_collection.h"
#include "batch/collected_jobs.h"
#include "batch/tar_collection.h"

namespace pilesim {

CollectionSummary pack_tars(const BatchPlace& place, const JobRecords& records, uint64_t begin,
                            uint64_t end) {
  CollectionSummary summary;
  if (place.plan.collects(Collection::tar)) collect_tars(place, records, begin, end, summary);
  return summary;
}

CollectionSummary collect_datasets(const BatchPlace& place, const JobRecords& records) {
  CollectionSummary summary = pack_tars(place, records, 0, place.plan.jobs());
  if (place.plan.collects(Collection::tar)) remove_tars_from(place, summary.tars);
  if (place.plan.collects(Collection::coco)) collect_coco(place, records, summary);
  if (place.plan.collects(Collection::bop)) collect_bop(place, records, summary);
  return summary;
}

}  // namespace pilesim
