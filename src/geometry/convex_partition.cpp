#include "geometry/convex_partition.h"

#include <algorithm>
#include <limits>
#include <optional>

#include "core/parallel_for.h"
#include "geometry/cut_search.h"
#include "geometry/hull_volume.h"

#include <cstdio>
#include <cstdlib>
namespace pilesim {
namespace {

constexpr double kTie = 1e-9;  // of the solid's volume: smaller gains are rounding

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

  void bisect(int max_parts, double max_excess);
  void merge();
  bool recut_neighbours();
  bool exchange();
  double excess() const;
  size_t size() const { return parts_.size(); }
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

  void replace(size_t index, ConvexPart part) { parts_[index] = {std::move(part), ++last_id_, {}}; }
  void append(ConvexPart part) { parts_.push_back({std::move(part), ++last_id_, {}}); }
  void cut(size_t index);
  double gain(size_t index);
  Merge cheapest_merge() const;
  void merge(const Merge& pair);

  PartitionOptions options_;
  double min_gain_;
  std::vector<Entry> parts_;
  uint64_t last_id_ = 0;
  std::vector<std::pair<uint64_t, uint64_t>> settled_;  // pairs that no new cut improves
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

void Partition::bisect(int max_parts, double max_excess) {
  while (static_cast<int>(parts_.size()) < max_parts && excess() > max_excess) {
    size_t worst = 0;
    for (size_t k = 1; k < parts_.size(); ++k) {
      if (parts_[k].part.excess() > parts_[worst].part.excess() + min_gain_) worst = k;
    }
    if (parts_[worst].part.excess() <= min_gain_) return;
    cut(worst);
  }
}

Partition::Merge Partition::cheapest_merge() const {
  std::vector<Merge> best(parts_.size());
  parallel_for(parts_.size(), 1, [&](size_t begin, size_t end) {
    HullVolume hull;
    for (size_t i = begin; i < end; ++i) {
      for (size_t j = i + 1; j < parts_.size(); ++j) {
        const ConvexPart& a = parts_[i].part;
        const ConvexPart& b = parts_[j].part;
        const double cost = joint_hull_volume(a, b, hull) - a.hull_volume_m3 - b.hull_volume_m3;
        if (cost < best[i].cost - min_gain_ || best[i].second == 0) best[i] = {cost, i, j};
      }
    }
  });
  Merge cheapest;
  for (const Merge& merge : best) {
    if (merge.cost < cheapest.cost - min_gain_) cheapest = merge;
  }
  return cheapest;
}

void Partition::merge(const Merge& pair) {
  ConvexPart joint =
      make_part(united(parts_[pair.first].part.solid, parts_[pair.second].part.solid));
  parts_.erase(parts_.begin() + static_cast<std::ptrdiff_t>(pair.second));
  replace(pair.first, std::move(joint));
}

void Partition::merge() {
  while (parts_.size() > 1) {
    const Merge pair = cheapest_merge();
    const bool too_many = static_cast<int>(parts_.size()) > options_.max_parts;
    if (!too_many && excess() + pair.cost > options_.max_excess_m3) return;
    merge(pair);
  }
}

bool Partition::recut_neighbours() {
  bool improved = false;
  HullVolume hull;
  for (size_t i = 0; i < parts_.size(); ++i) {
    for (size_t j = i + 1; j < parts_.size(); ++j) {
      const auto ids = std::minmax(parts_[i].id, parts_[j].id);
      if (std::ranges::find(settled_, std::pair<uint64_t, uint64_t>(ids)) != settled_.end())
        continue;
      const ConvexPart& a = parts_[i].part;
      const ConvexPart& b = parts_[j].part;
      if (a.excess() + b.excess() <= min_gain_) continue;
      if (joint_hull_volume(a, b, hull) > 1.3 * (a.hull_volume_m3 + b.hull_volume_m3)) continue;
      const FacetedSolid joint = united(a.solid, b.solid);
      const Cut cut = best_cut(joint);
      if (cut.hull_volume_m3 < a.hull_volume_m3 + b.hull_volume_m3 - min_gain_) {
        SplitSolid halves = split(joint, cut.plane);
        replace(i, make_part(std::move(halves.below)));
        replace(j, make_part(std::move(halves.above)));
        improved = true;
      } else {
        settled_.push_back(ids);
      }
    }
  }
  return improved;
}

// Merges where that costs little and cuts where it gains more.
bool Partition::exchange() {
  if (parts_.size() < 2) return false;
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

std::vector<ConvexPart> Partition::take() {
  std::vector<ConvexPart> result;
  for (Entry& entry : parts_) result.push_back(std::move(entry.part));
  return result;
}

}  // namespace

std::vector<ConvexPart> partition_into_convex(const FacetedSolid& solid,
                                              const PartitionOptions& options) {
  Partition partition(solid, options);
  partition.bisect(2 * options.max_parts, 0.5 * options.max_excess_m3);
  partition.merge();
  for (int round = 0; round < 8; ++round) {
    bool improved = partition.recut_neighbours();
    while (partition.exchange()) improved = true;
    partition.merge();
    if (!improved) break;
  }
  return partition.take();
}

}  // namespace pilesim
