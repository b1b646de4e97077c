#include "model/clear_starts.h"

#include <algorithm>
#include <cstdio>
#include <map>

#include "core/counted.h"
#include "core/parallel_for.h"
#include "geometry/box_tree.h"
#include "model/body_distances.h"
#include "model/emitters.h"

namespace pilesim {
namespace {

constexpr double kNoticed = 1e-3;  // of a bounding radius
constexpr uint32_t kDraws = 64;
constexpr uint32_t kLeafSize = 4;
constexpr size_t kBodiesPerTask = 256;

class Starts {
 public:
  explicit Starts(const Model& model) : model_(model), distances_(model) {
    place_all();
    moved_.resize(model.bodies.size());
  }

  std::vector<StartOverlap> overlaps() const;
  // Both come later and neither is fixed: one of them waits until the other has left.
  bool wait(const StartOverlap& pair) const {
    return start_s(pair.a) > 0 && start_s(pair.b) > 0 && !is_fixed(pair.a) && !is_fixed(pair.b);
  }
  // Nothing that is there when `body` starts is within `pose`. Not of bodies that begin later.
  bool is_clear(uint32_t body, const Pose& pose) const;
  void move(uint32_t body, const Pose& pose);

 private:
  void place_all();
  bool is_dynamic(uint32_t body) const { return model_.bodies[body].role == Role::dynamic; }
  // It is where it starts for ever.
  bool is_fixed(uint32_t body) const { return !is_dynamic(body) && !is_moved_by_keys(body); }
  bool is_moved_by_keys(uint32_t body) const { return !model_.bodies[body].motion.empty(); }
  bool is_plane(uint32_t body) const { return model_.shapes[model_.bodies[body].shape].is_plane; }
  double start_s(uint32_t body) const { return std::max(0.0, model_.bodies[body].start_s); }
  bool fills_guide(uint32_t body) const {
    return model_.guide_fill && model_.guide_fill->contains(body);
  }
  // Both are there, and where they are is known, when the later of them appears.
  bool meet(uint32_t a, uint32_t b) const;
  double noticed_m(uint32_t a, uint32_t b) const;

  const Model& model_;
  BodyDistances distances_;
  std::vector<PlacedShape> placed_;  // by body
  std::vector<uint8_t> moved_;       // by body: 1: the tree has it where it was
  std::vector<uint32_t> newly_;      // the bodies that were moved
  std::vector<uint32_t> planes_;
  std::vector<uint32_t> boxed_;  // body of each box of the tree
  std::optional<BoxTree> tree_;
};

void Starts::place_all() {
  const auto count = static_cast<uint32_t>(model_.bodies.size());
  placed_.resize(count);
  parallel_for(count, kBodiesPerTask, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      placed_[i] = distances_.place(model_.bodies[i].shape, model_.bodies[i].pose);
    }
  });
  std::vector<Bounds> boxes;
  std::vector<Vec3> centres;
  for (uint32_t i = 0; i < count; ++i) {
    if (is_plane(i)) {
      planes_.push_back(i);
    } else if (!fills_guide(i)) {
      boxed_.push_back(i);
      boxes.push_back(placed_[i].box);
      centres.push_back(placed_[i].box.center());
    }
  }
  tree_.emplace(boxes, centres, kLeafSize);
}

bool Starts::meet(uint32_t a, uint32_t b) const {
  if (!is_dynamic(a) && !is_dynamic(b)) return false;
  if (!may_collide(model_, a, b)) return false;
  return start_s(a) == start_s(b) || is_fixed(a) || is_fixed(b);
}

double Starts::noticed_m(uint32_t a, uint32_t b) const {
  double radius_m = std::numeric_limits<double>::infinity();
  for (const uint32_t body : {a, b}) {
    if (is_dynamic(body)) {
      radius_m = std::min(radius_m, model_.shapes[model_.bodies[body].shape].bounding_radius);
    }
  }
  return kNoticed * radius_m;
}

std::vector<StartOverlap> Starts::overlaps() const {
  std::vector<std::vector<StartOverlap>> found(boxed_.size());
  parallel_for(boxed_.size(), kBodiesPerTask, [&](size_t begin, size_t end) {
    for (size_t place = begin; place < end; ++place) {
      const uint32_t a = boxed_[tree_->items()[place]];
      const auto judge = [&](uint32_t b) {
        if (!meet(a, b)) return;
        const double depth_m = -distances_.distance(placed_[a], placed_[b], 0);
        if (depth_m > noticed_m(a, b)) {
          found[place].push_back({std::min(a, b), std::max(a, b), depth_m});
        }
      };
      for (const uint32_t plane : planes_) judge(plane);
      tree_->for_each_near(placed_[a].box, static_cast<uint32_t>(place) + 1, [&](uint32_t i) {
        const uint32_t b = boxed_[tree_->items()[i]];
        if (placed_[a].box.intersects(placed_[b].box)) judge(b);
      });
    }
  });
  std::vector<StartOverlap> all;
  for (const auto& some : found) all.insert(all.end(), some.begin(), some.end());
  std::ranges::sort(all, {}, [](const StartOverlap& pair) { return std::pair(pair.a, pair.b); });
  return all;
}

bool Starts::is_clear(uint32_t body, const Pose& pose) const {
  const PlacedShape there = distances_.place(model_.bodies[body].shape, pose);
  bool clear = true;
  const auto judge = [&](uint32_t other) {
    if (!clear || other == body || !meet(body, other)) return;
    if (!is_plane(other) && !there.box.intersects(placed_[other].box)) return;
    clear = distances_.distance(there, placed_[other], 0) > 0;
  };
  for (const uint32_t plane : planes_) judge(plane);
  for (const uint32_t other : newly_) judge(other);
  tree_->for_each_near(there.box, 0, [&](uint32_t i) {
    const uint32_t other = boxed_[tree_->items()[i]];
    if (moved_[other] == 0) judge(other);
  });
  return clear;
}

void Starts::move(uint32_t body, const Pose& pose) {
  placed_[body] = distances_.place(model_.bodies[body].shape, pose);
  if (moved_[body] == 0) newly_.push_back(body);
  moved_[body] = 1;
}

std::string length_text(double length_m) {
  std::array<char, 32> text;
  std::snprintf(text.data(), text.size(), "%.2g m", length_m);
  return text.data();
}

// The part of a body's name that its emitter gave; empty for others, which make one group.
std::string source_of(const std::string& name) {
  const size_t slash = name.rfind('/');
  return slash == name.npos ? "" : name.substr(0, slash);
}

}  // namespace

std::vector<StartOverlap> find_start_overlaps(const Model& model) {
  const Starts starts(model);
  std::vector<StartOverlap> all = starts.overlaps();
  std::erase_if(all, [&](const StartOverlap& pair) { return starts.wait(pair); });
  return all;
}

void clear_starts(const Scene& scene, const std::vector<EmittedRow>& rows, Model& model) {
  Starts starts(model);
  const std::vector<StartOverlap> before = starts.overlaps();
  const auto row_of = [&](uint32_t body) -> const EmittedRow* {
    for (const EmittedRow& row : rows) {
      if (body >= row.first && body - row.first < row.count) {
        return can_be_drawn_again(scene.emitters[row.emitter]) ? &row : nullptr;
      }
    }
    return nullptr;
  };
  // The later of two gives way.
  std::vector<uint32_t> in_the_way;
  for (const StartOverlap& pair : before) {
    if (row_of(pair.b) != nullptr) {
      in_the_way.push_back(pair.b);
    } else if (row_of(pair.a) != nullptr) {
      in_the_way.push_back(pair.a);
    }
  }
  std::ranges::sort(in_the_way);
  in_the_way.erase(std::unique(in_the_way.begin(), in_the_way.end()), in_the_way.end());
  std::vector<uint8_t> moved(model.bodies.size());
  for (const uint32_t body : in_the_way) {
    const EmittedRow& row = *row_of(body);
    Pose& pose = model.bodies[body].pose;
    // Another gave way before.
    bool clear = starts.is_clear(body, pose);
    for (uint32_t draw = 0; draw < kDraws && !clear; ++draw) {
      const Pose drawn =
          drawn_again(scene.emitters[row.emitter], row.emitter, scene.seed, body - row.first, draw);
      clear = starts.is_clear(body, drawn);
      if (!clear) continue;
      pose = drawn;
      starts.move(body, pose);
      moved[body] = 1;
      ++model.starts_moved;
    }
  }
  for (const StartOverlap& pair : before) {
    const bool stay = moved[pair.a] == 0 && moved[pair.b] == 0;
    if (stay && !starts.wait(pair)) model.start_overlaps.push_back(pair);
  }
}

std::vector<std::string> describe_moved_starts(const Model& model) {
  if (model.starts_moved == 0) return {};
  const bool one = model.starts_moved == 1;
  return {counted(model.starts_moved, "body", "bodies") + " would have started inside others and " +
          (one ? "was" : "were") + " drawn again, clear of them"};
}

std::vector<std::string> describe_start_overlaps(const Model& model) {
  std::vector<std::string> lines;
  // By who meets whom: the pairs of two emitters make one line.
  struct Group {
    uint64_t pairs = 0;
    const StartOverlap* deepest = nullptr;
  };
  std::map<std::pair<std::string, std::string>, Group> groups;
  for (const StartOverlap& pair : model.start_overlaps) {
    Group& group =
        groups[{source_of(model.bodies[pair.a].name), source_of(model.bodies[pair.b].name)}];
    ++group.pairs;
    if (group.deepest == nullptr || pair.depth_m > group.deepest->depth_m) group.deepest = &pair;
  }
  constexpr size_t kMostLines = 8;
  for (const auto& [sources, group] : groups) {
    if (lines.size() == kMostLines) {
      lines.push_back("and " + counted(groups.size() - kMostLines, "more such line"));
      break;
    }
    const StartOverlap& deepest = *group.deepest;
    lines.push_back(counted(group.pairs, "pair") + " of bodies " +
                    (group.pairs == 1 ? "starts" : "start") + " inside one another: '" +
                    model.bodies[deepest.a].name + "' and '" + model.bodies[deepest.b].name +
                    "' by " + length_text(deepest.depth_m) + (group.pairs == 1 ? "" : ", deepest") +
                    "; move them apart, or give their emitters more room");
  }
  return lines;
}

}  // namespace pilesim
