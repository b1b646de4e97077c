// The part of the contact solver that says which contacts are solved side by side, and in which
// order.
//
// Bodies are cut into parts by their order. Contacts within a part are gone through by one thread,
// whatever there are; then those between the two halves of each pair of parts, then of each four
// parts, and so on. So a sweep has few points at which threads wait for each other. Parts depend on
// the number of contacts alone.
#include <algorithm>
#include <array>
#include <bit>

#include "simulate/exact/contact_solver.h"

namespace pilesim::exact {

namespace {

// A part has at least so many contacts: the fewer it has, the more are between parts.
constexpr size_t kLeastOfPart = 400;
constexpr size_t kMostParts = 32;
// Blocks that are not full yet, while contacts of a part are packed.
constexpr size_t kOpen = 32;

// Ranges that have as many points had better be in one block, and so had those that collide.
constexpr size_t kClasses = 2 * kMostOfPlane;
size_t class_of(const ContactRange& range) {
  return (range.collides ? 0 : kMostOfPlane) + kMostOfPlane - range.count;
}

}  // namespace

void ContactSolver::arrange(std::span<const ContactRange> contacts) {
  blocks_.clear();
  order_.clear();
  batches_.clear();
  stage_first_ = {0};
  const size_t parts =
      std::bit_floor(std::clamp<size_t>(contacts.size() / kLeastOfPart, 1, kMostParts));
  std::vector<uint32_t> first;
  const std::vector<uint32_t> sorted = sort_by_node(contacts, parts, first);
  size_t node = 0;
  for (size_t of_level = parts; of_level > 0; of_level /= 2) {
    for (const size_t end = node + of_level; node < end; ++node) {
      const auto before = static_cast<uint32_t>(blocks_.size());
      pack(contacts, std::span(sorted).subspan(first[node], first[node + 1] - first[node]));
      batches_.push_back({before, static_cast<uint32_t>(blocks_.size())});
    }
    stage_first_.push_back(static_cast<uint32_t>(batches_.size()));
  }
  size_points();
}

void ContactSolver::size_points() {
  const uint32_t points = blocks_.empty() ? 0 : blocks_.back().first_point + blocks_.back().points;
  points_.resize(points);
  starts_.resize(points);
}

// Contacts by the nodes of a tree over the parts: each is at the lowest one that has both its
// bodies. Parts come first, then what is between two, between four, and so on; within a node they
// are by class. `node_first` is in these.
std::vector<uint32_t> ContactSolver::sort_by_node(std::span<const ContactRange> contacts,
                                                  size_t parts,
                                                  std::vector<uint32_t>& node_first) const {
  // Parts have as many contacts, all but.
  std::vector<uint32_t> met(moving_, 0);
  std::vector<uint8_t> part_of(moving_, 0);
  if (parts > 1) {
    uint64_t all = 0, before = 0;
    for (const ContactRange& c : contacts) {
      for (const uint32_t body : {c.a, c.b}) {
        if (body >= moving_) continue;
        ++met[body];
        ++all;
      }
    }
    for (size_t i = 0; i < moving_; ++i) {
      part_of[i] = static_cast<uint8_t>(before * parts / std::max<uint64_t>(all, 1));
      before += met[i];
      if (part_of[i] >= parts) part_of[i] = static_cast<uint8_t>(parts - 1);
    }
  }
  const size_t nodes = 2 * parts - 1;
  const auto bucket_of = [&](const ContactRange& c) {
    const size_t a = c.a < moving_ ? part_of[c.a] : part_of[c.b];
    const size_t b = c.b < moving_ ? part_of[c.b] : a;
    const auto level = static_cast<size_t>(std::bit_width(a ^ b));
    const size_t first_of_level = 2 * parts - (2 * parts >> level);
    return (first_of_level + (a >> level)) * kClasses + class_of(c);
  };
  std::vector<uint32_t> next(nodes * kClasses + 1, 0);
  std::vector<uint16_t> buckets(contacts.size());
  for (size_t i = 0; i < contacts.size(); ++i) {
    buckets[i] = static_cast<uint16_t>(bucket_of(contacts[i]));
    ++next[buckets[i] + 1];
  }
  for (size_t i = 1; i < next.size(); ++i) next[i] += next[i - 1];
  node_first.clear();
  for (size_t node = 0; node <= nodes; ++node) node_first.push_back(next[node * kClasses]);
  std::vector<uint32_t> sorted(contacts.size());
  for (size_t i = 0; i < contacts.size(); ++i) {
    sorted[next[buckets[i]]++] = static_cast<uint32_t>(i);
  }
  return sorted;
}

void ContactSolver::add_block(std::span<const ContactRange> contacts,
                              std::span<const uint32_t> lanes) {
  const uint32_t first_point =
      blocks_.empty() ? 0 : blocks_.back().first_point + blocks_.back().points;
  Block& block = blocks_.emplace_back();
  block.first_point = first_point;
  for (const uint32_t lane : lanes) block.points = std::max(block.points, contacts[lane].count);
  order_.insert(order_.end(), lanes.begin(), lanes.end());
  order_.insert(order_.end(), kLanes - lanes.size(), kNone);
}

// Into blocks whose lanes share no body, for one thread: each contact goes to the first of the open
// ones that it may.
void ContactSolver::pack(std::span<const ContactRange> contacts, std::span<const uint32_t> which) {
  struct Open {
    std::array<uint32_t, kLanes> lanes;
    size_t count = 0;
  };
  std::array<Open, kOpen> open;
  open_of_.resize(moving_, 0);  // of bodies; nothing is open now
  const auto mark = [&](uint32_t body, uint32_t bits) {
    if (body < moving_) open_of_[body] ^= bits;
  };
  const auto close = [&](size_t slot) {
    const std::span<const uint32_t> lanes(open[slot].lanes.data(), open[slot].count);
    if (lanes.empty()) return;
    add_block(contacts, lanes);
    for (const uint32_t lane : lanes) {
      mark(contacts[lane].a, uint32_t{1} << slot);
      mark(contacts[lane].b, uint32_t{1} << slot);
    }
    open[slot].count = 0;
  };
  const auto close_all = [&] {
    for (size_t slot = 0; slot < kOpen; ++slot) close(slot);
  };
  for (const uint32_t i : which) {
    const ContactRange& c = contacts[i];
    uint32_t taken = 0;
    if (c.a < moving_) taken |= open_of_[c.a];
    if (c.b < moving_) taken |= open_of_[c.b];
    auto slot = static_cast<size_t>(std::countr_one(taken));
    if (slot == kOpen) close(slot = 0);
    open[slot].lanes[open[slot].count++] = i;
    mark(c.a, uint32_t{1} << slot);
    mark(c.b, uint32_t{1} << slot);
    if (open[slot].count == kLanes) close(slot);
  }
  close_all();
}

}  // namespace pilesim::exact
