#include "finish/burial.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "core/parallel_for.h"

namespace pilesim {

namespace {

constexpr size_t kLineGrain = 256;
constexpr size_t kMostCells = 256;  // per body
// Bodies beyond these quantiles along an axis have rolled away and count as in the open.
constexpr double kOutlying = 0.002;

// Radius of the probe that passes through gaps, in radii of the smallest ball. Narrower gaps give
// little view into a pile.
constexpr double kProbe = 0.5;

using Cell = Eigen::Array3i;

struct Ball {
  uint32_t body;
  Vec3 centre;  // m, world
  double radius_m;
};

std::vector<Ball> balls_of(const Model& model, const BodyStates& states) {
  std::vector<Ball> balls;
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    constexpr uint8_t kFree = kPresent | kHeld;
    if (model.bodies[i].role != Role::dynamic || (states.flags[i] & kFree) != kPresent) continue;
    if (!states.position[i].allFinite()) continue;
    balls.push_back({i, states.position[i], model.shapes[model.bodies[i].shape].bounding_radius});
  }
  return balls;
}

// Bounds of all balls except outliers.
Bounds box_of(const std::vector<Ball>& balls) {
  Bounds box;
  const auto outlying = static_cast<size_t>(kOutlying * static_cast<double>(balls.size()));
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> low, high;
    for (const Ball& ball : balls) {
      low.push_back(ball.centre[axis] - ball.radius_m);
      high.push_back(ball.centre[axis] + ball.radius_m);
    }
    std::ranges::nth_element(low, low.begin() + static_cast<std::ptrdiff_t>(outlying));
    std::ranges::nth_element(high, high.end() - 1 - static_cast<std::ptrdiff_t>(outlying));
    box.min()[axis] = low[outlying];
    box.max()[axis] = high[high.size() - 1 - outlying];
  }
  return box;
}

// The cells around a pile, with a rim of at least one cell that no ball reaches.
class Air {
 public:
  explicit Air(const std::vector<Ball>& balls) {
    const Bounds box = box_of(balls);
    double least = std::numeric_limits<double>::infinity();
    for (const Ball& ball : balls) least = std::min(least, ball.radius_m);
    const double most = static_cast<double>(kMostCells * balls.size());
    probe_m_ = kProbe * least;
    side_m_ = std::max(least / 2, std::cbrt(box.volume() / most));
    const double rim_m = 2 * side_m_ + probe_m_;
    origin_ = box.min() - Vec3::Constant(rim_m);
    count_ = ((box.sizes().array() + 2 * rim_m) / side_m_).ceil().cast<int>();
    is_closed_.assign(count_.cast<size_t>().prod(), 0);
  }

  // Closes cells that the probe's centre cannot enter.
  void close(const Ball& ball) {
    const double reach_m = ball.radius_m + probe_m_;
    const Vec3 reach = Vec3::Constant(reach_m);
    for_each(Bounds(Vec3(ball.centre - reach), Vec3(ball.centre + reach)),
             [&](size_t index, const Vec3& centre) {
               if ((centre - ball.centre).squaredNorm() < reach_m * reach_m) is_closed_[index] = 1;
             });
  }

  void close_behind(const Vec3& point, const Vec3& normal) {
    const Vec3 end = origin_ + side_m_ * count_.cast<double>().matrix();
    for_each(Bounds(origin_, end), [&](size_t index, const Vec3& centre) {
      if (normal.dot(centre - point) < probe_m_) is_closed_[index] = 1;
    });
  }

  // Opens cells from the rim inwards.
  void flood() {
    std::vector<Cell> front;
    is_open_.assign(is_closed_.size(), 0);
    const auto enter = [&](const Cell& cell) {
      const size_t index = index_of(cell);
      if (is_closed_[index] != 0 || is_open_[index] != 0) return;
      is_open_[index] = 1;
      front.push_back(cell);
    };
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      Cell cell;
      for (cell[u] = 0; cell[u] < count_[u]; ++cell[u]) {
        for (cell[v] = 0; cell[v] < count_[v]; ++cell[v]) {
          for (const int end : {0, count_[axis] - 1}) {
            cell[axis] = end;
            enter(cell);
          }
        }
      }
    }
    while (!front.empty()) {
      const Cell from = front.back();
      front.pop_back();
      for (int axis = 0; axis < 3; ++axis) {
        for (const int step : {-1, 1}) {
          Cell to = from;
          to[axis] += step;
          if (to[axis] >= 0 && to[axis] < count_[axis]) enter(to);
        }
      }
    }
    // Planes on all sides: treat the space between them as open.
    if (std::ranges::count(is_open_, 1) > 0) return;
    std::ranges::transform(is_closed_, is_open_.begin(), std::logical_not<>());
  }

  // Squared distance of each cell to the nearest open one, in cells: one axis at a time, by the
  // lower envelope of parabolas (Felzenszwalb and Huttenlocher, 2012).
  void measure() {
    constexpr float kFar = 1e12F;
    squared_.resize(is_open_.size());
    std::ranges::transform(is_open_, squared_.begin(),
                           [](uint8_t open) { return open != 0 ? 0.0F : kFar; });
    for (int axis = 0; axis < 3; ++axis) {
      const int u = (axis + 1) % 3, v = (axis + 2) % 3;
      const auto lines = static_cast<size_t>(count_[u]) * static_cast<size_t>(count_[v]);
      parallel_for(lines, kLineGrain, [&](size_t begin, size_t end) {
        Envelope envelope(static_cast<size_t>(count_[axis]));
        for (size_t line = begin; line < end; ++line) {
          Cell cell;
          cell[axis] = 0;
          cell[u] = static_cast<int>(line % static_cast<size_t>(count_[u]));
          cell[v] = static_cast<int>(line / static_cast<size_t>(count_[u]));
          envelope.lower(&squared_[index_of(cell)], stride(axis));
        }
      });
    }
  }

  // A lower bound on the depth, m; 0 outside the cells.
  double depth_m(const Ball& ball) const {
    const Cell cell = cell_at(place_of(ball.centre));
    if ((cell < 0).any() || (cell >= count_).any()) return 0;
    const double way = std::sqrt(squared_[index_of(cell)]);
    // The centres of ball and probe are each within half a cell's diagonal of their cells' centres.
    return std::max(0.0, (way - std::sqrt(3.0)) * side_m_ - ball.radius_m - probe_m_);
  }

 private:
  class Envelope {
   public:
    explicit Envelope(size_t count)
        : value_(count), apex_(count), from_(count + 1), count_(static_cast<int>(count)) {}

    void lower(float* line, size_t stride) {
      for (int i = 0; i < count_; ++i) value_[at(i)] = line[at(i) * stride];
      int last = 0;
      apex_[0] = 0;
      from_[0] = -std::numeric_limits<double>::infinity();
      from_[1] = std::numeric_limits<double>::infinity();
      for (int i = 1; i < count_; ++i) {
        double meet = crossing(apex_[at(last)], i);
        while (meet <= from_[at(last)]) meet = crossing(apex_[at(--last)], i);
        apex_[at(++last)] = i;
        from_[at(last)] = meet;
        from_[at(last) + 1] = std::numeric_limits<double>::infinity();
      }
      int part = 0;
      for (int i = 0; i < count_; ++i) {
        while (from_[at(part) + 1] < static_cast<double>(i)) ++part;
        const auto away = static_cast<double>(i - apex_[at(part)]);
        line[at(i) * stride] = static_cast<float>(away * away + value_[at(apex_[at(part)])]);
      }
    }

   private:
    static size_t at(int i) { return static_cast<size_t>(i); }
    double crossing(int a, int b) const {
      const auto x = static_cast<double>(a), y = static_cast<double>(b);
      return ((value_[at(b)] + y * y) - (value_[at(a)] + x * x)) / (2 * (y - x));
    }

    std::vector<double> value_;
    std::vector<int> apex_;
    std::vector<double> from_;
    int count_;
  };

  size_t stride(int axis) const {
    size_t stride = 1;
    for (int k = 0; k < axis; ++k) stride *= static_cast<size_t>(count_[k]);
    return stride;
  }
  size_t index_of(const Cell& cell) const {
    size_t index = 0;
    for (int k = 0; k < 3; ++k) index += stride(k) * static_cast<size_t>(cell[k]);
    return index;
  }
  Vec3 middle(const Cell& cell) const {
    return origin_ + side_m_ * (cell.cast<double>() + 0.5).matrix();
  }
  // Position in cells, from the corner of the first one, and the cell that contains it.
  Eigen::Array3d place_of(const Vec3& point) const { return (point - origin_).array() / side_m_; }
  Cell cell_at(const Eigen::Array3d& place) const {
    // Clamp cells far away to numbers that fit.
    return place.floor().max(-1.0).min(count_.cast<double>()).cast<int>();
  }
  // Calls visit(index, middle) for all cells whose centre is in the box.
  template <class Visit>
  void for_each(const Bounds& box, const Visit& visit) {
    const Cell first = cell_at(place_of(box.min()) + 0.5).max(0);
    const Cell last = cell_at(place_of(box.max()) - 0.5).min(count_ - 1);
    Cell cell;
    for (cell[2] = first[2]; cell[2] <= last[2]; ++cell[2]) {
      for (cell[1] = first[1]; cell[1] <= last[1]; ++cell[1]) {
        for (cell[0] = first[0]; cell[0] <= last[0]; ++cell[0]) {
          visit(index_of(cell), middle(cell));
        }
      }
    }
  }

  double probe_m_ = 0, side_m_ = 0;
  Vec3 origin_;  // m, world
  Cell count_;
  std::vector<uint8_t> is_closed_, is_open_;
  std::vector<float> squared_;
};

}  // namespace

std::vector<double> depths_under_surface(const Model& model, const BodyStates& states) {
  std::vector<double> depths(model.bodies.size(), 0);
  const std::vector<Ball> balls = balls_of(model, states);
  if (balls.empty()) return depths;
  Air air(balls);
  for (const Ball& ball : balls) air.close(ball);
  for (uint32_t i = 0; i < model.bodies.size(); ++i) {
    const ModelBody& body = model.bodies[i];
    if (!model.shapes[body.shape].is_plane || (states.flags[i] & kPresent) == 0) continue;
    air.close_behind(states.position[i], states.orientation[i] * Vec3::UnitY());
  }
  air.flood();
  air.measure();
  for (const Ball& ball : balls) depths[ball.body] = air.depth_m(ball);
  return depths;
}

}  // namespace pilesim
