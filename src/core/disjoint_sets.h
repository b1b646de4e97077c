// Sets of things that are counted from 0 (union-find). A set is named by its smallest member, so
// that names do not depend on the order in which sets were united.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <vector>

namespace pilesim {

class DisjointSets {
 public:
  void reset(size_t count) {  // each alone
    parent_.resize(count);
    std::iota(parent_.begin(), parent_.end(), 0U);
  }
  size_t size() const { return parent_.size(); }
  // It is alone again; look up no former member of its set until that is parted, too.
  void part(uint32_t i) { parent_[i] = i; }
  uint32_t find(uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void unite(uint32_t i, uint32_t j) {
    i = find(i);
    j = find(j);
    parent_[std::max(i, j)] = std::min(i, j);
  }

 private:
  std::vector<uint32_t> parent_;
};

}  // namespace pilesim
