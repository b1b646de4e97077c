#include "geometry/convex_partition.h"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "core/parallel_for.h"
#include "geometry/cut_search.h"
#include "geometry/hollow_depth.h"
#include "geometry/hull_volume.h"

namespace pilesim {
namespace {

constexpr double kTie = 1e-9;         // of the solid's volume: smaller gains are rounding
constexpr size_t kOversplit = 2;      // parts per part allowed, before merging
constexpr int kMaxRounds = 4;         // of improvement
constexpr double kWorthwhile = 0.02;  // share of the excess that a further round has to save
constexpr double kFarApart = 1.3;     // joint hull over both hulls: no neighbours

ConvexPart make_part(FacetedSolid solid) {
  ConvexPart part;
  HullVolume hull;
  part.hull_volume_m3 = hull.compute(solid.vertices);
  for (const uint32_t v : hull.vertices()) part.hull_points.push_back(solid.vertices[v]);
  part.volume_m3 = solid.volume();
  part.solid = std::move(solid);
  return part;
}

double joint_hull_volume(const ConvexPart& a, const ConvexPart& b, HullVolume& hull) {
  std::vector<Vec3> points = a.hull_points;
  points.insert(points.end(), b.hull_points.begin(), b.hull_points.end());
  return hull.compute(points);
}

class Partition {
 public:
  Partition(const FacetedSolid& solid, const PartitionOptions& options) : options_(options) {
    parts_.push_back({make_part(solid), 0, {}});
    min_gain_ = kTie * parts_.front().part.volume_m3;
  }

  size_t size() const { return parts_.size(); }
  double excess() const;
  // Cuts the part with the largest excess until there are more parts than asked for.
  void bisect();
  // Merges the cheapest pairs until the parts are few enough and another merge would cost too much.
  // Gives the excess before each merge, from the most parts on.
  std::vector<double> merge();
  // Searches the cut between each two neighbours again.
  void recut_neighbours();
  // Merges the cheapest pair and cuts another part instead, if that gains.
  bool exchange();
  // Cuts the parts with the deepest hollows while there may be more of them. Gives what is left, m.
  double open_hollows();
  std::vector<ConvexPart> take();

 private:
  struct Entry {
    ConvexPart part;
    uint64_t id;              // never used again for another part
    std::optional<Cut> best;  // searched on demand
  };
  struct Merge {
    double cost = std::numeric_limits<double>::infinity();  // m^3 of hull volume gained
    size_t first = 0, second = 0;
  };

  using Ids = std::pair<uint64_t, uint64_t>;
  Ids ids(size_t i, size_t j) const { return std::minmax(parts_[i].id, parts_[j].id); }

  void replace(size_t index, ConvexPart part) { parts_[index] = {std::move(part), ++last_id_, {}}; }
  void append(ConvexPart part) { parts_.push_back({std::move(part), ++last_id_, {}}); }
  void cut(size_t index);
  double gain(size_t index);
  Merge cheapest_merge();
  void merge(const Merge& pair);

  PartitionOptions options_;
  double min_gain_;
  std::vector<Entry> parts_;
  uint64_t last_id_ = 0;
  std::map<Ids, double> merge_costs_;  // m^3, of pairs that were looked at
  std::set<Ids> settled_;              // pairs that no new cut improves
};

double Partition::excess() const {
  double sum = 0;
  for (const Entry& entry : parts_) sum += entry.part.excess();
  return sum;
}

// Hull volume saved by the part's best cut.
double Partition::gain(size_t index) {
  Entry& entry = parts_[index];
  if (entry.part.excess() <= min_gain_) return 0;
  if (!entry.best) entry.best = best_cut(entry.part.solid);
  return entry.part.hull_volume_m3 - entry.best->hull_volume_m3;
}

void Partition::cut(size_t index) {
  if (!parts_[index].best) parts_[index].best = best_cut(parts_[index].part.solid);
  SplitSolid halves = split(parts_[index].part.solid, parts_[index].best->plane);
  replace(index, make_part(std::move(halves.below)));
  append(make_part(std::move(halves.above)));
}

void Partition::bisect() {
  const auto limit = kOversplit * static_cast<size_t>(options_.max_parts);
  // Half of the excess allowed leaves room for merges.
  while (parts_.size() < limit && excess() > 0.5 * options_.max_excess_m3) {
    size_t worst = 0;
    for (size_t k = 1; k < parts_.size(); ++k) {
      if (parts_[k].part.excess() > parts_[worst].part.excess() + min_gain_) worst = k;
    }
    if (parts_[worst].part.excess() <= min_gain_) return;
    cut(worst);
  }
}

Partition::Merge Partition::cheapest_merge() {
  struct Pair {
    size_t first, second;
  };
  std::vector<Pair> unknown;
  for (size_t i = 0; i < parts_.size(); ++i) {
    for (size_t j = i + 1; j < parts_.size(); ++j) {
      if (!merge_costs_.contains(ids(i, j))) unknown.push_back({i, j});
    }
  }
  std::vector<double> costs(unknown.size());
  parallel_for(unknown.size(), 8, [&](size_t begin, size_t end) {
    HullVolume hull;
    for (size_t k = begin; k < end; ++k) {
      const ConvexPart& a = parts_[unknown[k].first].part;
      const ConvexPart& b = parts_[unknown[k].second].part;
      costs[k] = joint_hull_volume(a, b, hull) - a.hull_volume_m3 - b.hull_volume_m3;
    }
  });
  for (size_t k = 0; k < unknown.size(); ++k) {
    merge_costs_[ids(unknown[k].first, unknown[k].second)] = costs[k];
  }
  Merge cheapest;
  for (size_t i = 0; i < parts_.size(); ++i) {
    for (size_t j = i + 1; j < parts_.size(); ++j) {
      const double cost = merge_costs_[ids(i, j)];
      if (cost < cheapest.cost - min_gain_) cheapest = {cost, i, j};
    }
  }
  return cheapest;
}

void Partition::merge(const Merge& pair) {
  ConvexPart joint =
      make_part(united(parts_[pair.first].part.solid, parts_[pair.second].part.solid));
  parts_.erase(parts_.begin() + static_cast<std::ptrdiff_t>(pair.second));
  replace(pair.first, std::move(joint));
}

std::vector<double> Partition::merge() {
  std::vector<double> passed;
  for (;;) {
    passed.push_back(excess());
    if (parts_.size() == 1) return passed;
    const Merge pair = cheapest_merge();
    const bool too_many = static_cast<int>(parts_.size()) > options_.max_parts;
    if (!too_many && passed.back() + pair.cost > options_.max_excess_m3) return passed;
    merge(pair);
  }
}

void Partition::recut_neighbours() {
  HullVolume hull;
  const double relevant = kWorthwhile / 4 * excess() + min_gain_;
  for (size_t i = 0; i < parts_.size(); ++i) {
    for (size_t j = i + 1; j < parts_.size(); ++j) {
      const ConvexPart& a = parts_[i].part;
      const ConvexPart& b = parts_[j].part;
      if (a.excess() + b.excess() <= relevant) continue;
      if (settled_.contains(ids(i, j))) continue;
      const double hulls = a.hull_volume_m3 + b.hull_volume_m3;
      if (joint_hull_volume(a, b, hull) > kFarApart * hulls) continue;
      const FacetedSolid joint = united(a.solid, b.solid);
      const Cut cut = best_cut(joint);
      if (cut.hull_volume_m3 < hulls - min_gain_) {
        SplitSolid halves = split(joint, cut.plane);
        replace(i, make_part(std::move(halves.below)));
        replace(j, make_part(std::move(halves.above)));
      } else {
        settled_.insert(ids(i, j));
      }
    }
  }
}

bool Partition::exchange() {
  if (parts_.size() < 3) return false;
  const Merge pair = cheapest_merge();
  size_t best = 0;
  double best_gain = -1;
  for (size_t k = 0; k < parts_.size(); ++k) {
    if (k == pair.first || k == pair.second) continue;
    if (gain(k) > best_gain + min_gain_) {
      best_gain = gain(k);
      best = k;
    }
  }
  if (best_gain <= pair.cost + min_gain_) return false;
  cut(best);
  merge(pair);
  return true;
}

double Partition::open_hollows() {
  if (options_.max_depth_m <= 0) return 0;
  std::map<uint64_t, double> depths;  // m, by part
  for (;;) {
    size_t deepest = 0;
    double depth = 0;
    for (size_t k = 0; k < parts_.size(); ++k) {
      const auto [known, is_new] = depths.try_emplace(parts_[k].id, 0);
      if (is_new && parts_[k].part.excess() > min_gain_) {
        known->second = hollow_depth(parts_[k].part, options_.max_depth_m);
      }
      if (known->second > depth) {
        depth = known->second;
        deepest = k;
      }
    }
    if (depth == 0 || static_cast<int>(parts_.size()) >= options_.max_parts) return depth;
    cut(deepest);
  }
}

std::vector<ConvexPart> Partition::take() {
  std::vector<ConvexPart> result;
  for (Entry& entry : parts_) result.push_back(std::move(entry.part));
  return result;
}

}  // namespace

ConvexPartition partition_into_convex(const FacetedSolid& solid, const PartitionOptions& options) {
  Partition partition(solid, options);
  partition.bisect();
  ConvexPartition result;
  // Where there are too many they are merged down to max_parts at least, which is the last that
  // counts here; where there are not, the first is of as many as there are.
  const size_t most = partition.size();
  result.excess_with_more = partition.merge();
  const size_t more = most - std::min(most, static_cast<size_t>(options.max_parts));
  result.excess_with_more.resize(more + 1);
  std::ranges::reverse(result.excess_with_more);
  for (int round = 0; round < kMaxRounds; ++round) {
    const double before = partition.excess();
    partition.recut_neighbours();
    while (partition.exchange()) {
    }
    partition.merge();
    if (partition.excess() > (1 - kWorthwhile) * before) break;
  }
  result.hollow_m = partition.open_hollows();
  result.parts = partition.take();
  return result;
}

}  // namespace pilesim
