// Bodies that start inside something else: moved where their place is drawn at random, reported
// otherwise.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "model/model.h"

namespace pilesim {

// The bodies of a model that an emitter made, all of them in one row.
struct EmittedRow {
  uint32_t first = 0, count = 0;  // in Model::bodies
  uint32_t emitter = 0;           // index into Scene::emitters
};

// Pairs of bodies that overlap, by their collision shapes, by more than a thousandth of the smaller
// one's bounding radius when the later of the two appears; as far as that is known beforehand:
// bodies that appear at the start, and fixed bodies. A body that comes later waits for those that
// move. Bodies that fill a guide are left out. Ascending.
std::vector<StartOverlap> find_start_overlaps(const Model& model);

// The same, after each body of a disk that overlaps others was drawn again in the disk, by random
// numbers of its own, until it is clear of all that is there; one for which no place is found in 64
// draws stays. The others are as they were. Fills model.start_overlaps and model.starts_moved.
void clear_starts(const Scene& scene, const std::vector<EmittedRow>& rows, Model& model);

// For people, a line each; empty: nothing. They say which bodies were moved and which still
// overlap.
std::vector<std::string> describe_moved_starts(const Model& model);
std::vector<std::string> describe_start_overlaps(const Model& model);

}  // namespace pilesim
