#include "pile/glue/block_cholesky.h"

#include <algorithm>
#include <atomic>

#include <Eigen/Cholesky>

#include "core/parallel_for.h"

namespace pilesim {
namespace {

constexpr size_t kLeaf = 12;  // smaller sets of nodes are not cut any further

void copy_block(Eigen::MatrixXd& to, uint32_t row, uint32_t column,
                const BlockCholesky::Block& block) {
  constexpr Eigen::Index kSize = BlockCholesky::kBlock;
  to.block<kSize, kSize>(kSize * row, kSize * column) += block;
}

}  // namespace

BlockCholesky::BlockCholesky(std::span<const Vec3> places, std::vector<Edge> edges)
    : places_(places.begin(), places.end()),
      edges_(std::move(edges)),
      neighbours_(places.size()),
      rank_(places.size()),
      side_(places.size(), 0) {
  for (const auto& [a, b] : edges_) {
    neighbours_[a].push_back(b);
    neighbours_[b].push_back(a);
  }
  std::vector<uint32_t> all(places.size());
  for (uint32_t i = 0; i < all.size(); ++i) all[i] = i;
  if (!all.empty()) dissect(std::move(all), 0);
  find_rows();
}

// Cuts across the longest extent. Nodes of the near half at the cut are eliminated after both
// halves.
uint32_t BlockCholesky::dissect(std::vector<uint32_t> nodes, int depth) {
  Front front;
  if (nodes.size() <= kLeaf) {
    front.rows = std::move(nodes);
  } else {
    Bounds box;
    for (const uint32_t node : nodes) box.extend(places_[node]);
    Eigen::Index axis = 0;
    box.sizes().maxCoeff(&axis);
    std::ranges::sort(nodes, [&](uint32_t i, uint32_t j) {
      return std::pair(places_[i][axis], i) < std::pair(places_[j][axis], j);
    });
    const size_t half = nodes.size() / 2;
    std::vector<uint32_t> near, far(nodes.begin() + half, nodes.end());
    for (const uint32_t node : far) side_[node] = 1;
    for (size_t i = 0; i < half; ++i) {
      const bool at_cut =
          std::ranges::any_of(neighbours_[nodes[i]], [&](uint32_t n) { return side_[n] != 0; });
      (at_cut ? front.rows : near).push_back(nodes[i]);
    }
    for (const uint32_t node : far) side_[node] = 0;
    if (!near.empty()) front.children.push_back(dissect(std::move(near), depth + 1));
    front.children.push_back(dissect(std::move(far), depth + 1));
  }
  front.pivots = static_cast<uint32_t>(front.rows.size());
  const auto index = static_cast<uint32_t>(fronts_.size());
  if (levels_.size() <= static_cast<size_t>(depth)) levels_.resize(depth + 1);
  levels_[depth].push_back(index);
  fronts_.push_back(std::move(front));
  return index;
}

void BlockCholesky::find_rows() {
  constexpr uint32_t kNone = ~uint32_t{0};
  uint32_t rank = 0;
  for (const Front& front : fronts_) {
    for (const uint32_t node : front.rows) rank_[node] = rank++;
  }
  std::vector<uint32_t> seen_by(places_.size(), kNone), front_of(places_.size());
  for (uint32_t f = 0; f < fronts_.size(); ++f) {
    Front& front = fronts_[f];
    const std::vector<uint32_t> pivots = front.rows;
    for (const uint32_t node : pivots) {
      seen_by[node] = f;
      front_of[node] = f;
    }
    const uint32_t last = pivots.empty() ? 0 : rank_[pivots.back()];
    const auto touch = [&](uint32_t node) {
      if (seen_by[node] == f) return;
      seen_by[node] = f;
      front.rows.push_back(node);
    };
    for (const uint32_t node : pivots) {
      for (const uint32_t other : neighbours_[node]) {
        if (rank_[other] > last) touch(other);
      }
    }
    for (const uint32_t child : front.children) {
      const Front& of = fronts_[child];
      for (size_t i = of.pivots; i < of.rows.size(); ++i) touch(of.rows[i]);
    }
    std::sort(front.rows.begin() + front.pivots, front.rows.end(),
              [&](uint32_t i, uint32_t j) { return rank_[i] < rank_[j]; });
  }
  for (uint32_t e = 0; e < edges_.size(); ++e) {
    const auto& [a, b] = edges_[e];
    fronts_[front_of[rank_[a] < rank_[b] ? a : b]].edges.push_back(e);
  }
}

bool BlockCholesky::eliminate(Front& front, std::span<const Block> diagonal,
                              std::span<const Block> beside) {
  const auto rows = static_cast<Eigen::Index>(front.rows.size()) * kBlock;
  const auto pivots = static_cast<Eigen::Index>(front.pivots) * kBlock;
  const auto by_rank = [&](uint32_t node) { return rank_[node]; };
  // Pivots rank before all nodes that they touch.
  const auto place_of = [&](uint32_t node) {
    return static_cast<uint32_t>(std::ranges::lower_bound(front.rows, rank_[node], {}, by_rank) -
                                 front.rows.begin());
  };
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(rows, rows);
  for (uint32_t i = 0; i < front.pivots; ++i) copy_block(all, i, i, diagonal[front.rows[i]]);
  for (const uint32_t e : front.edges) {
    const uint32_t a = place_of(edges_[e].first), b = place_of(edges_[e].second);
    if (a > b) {
      copy_block(all, a, b, beside[e]);
    } else {
      copy_block(all, b, a, beside[e].transpose());
    }
  }
  for (const uint32_t index : front.children) {
    Front& child = fronts_[index];
    std::vector<uint32_t> at;
    for (size_t i = child.pivots; i < child.rows.size(); ++i) at.push_back(place_of(child.rows[i]));
    for (size_t j = 0; j < at.size(); ++j) {
      for (size_t i = j; i < at.size(); ++i) {
        all.block<kBlock, kBlock>(Eigen::Index{kBlock} * at[i], Eigen::Index{kBlock} * at[j]) +=
            child.rest.block<kBlock, kBlock>(kBlock * i, kBlock * j);
      }
    }
    child.rest.resize(0, 0);
  }
  if (pivots > 0) {
    auto corner = all.topLeftCorner(pivots, pivots);
    Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factors(corner);
    if (factors.info() != Eigen::Success) return false;
    auto below = all.bottomLeftCorner(rows - pivots, pivots);
    if (rows > pivots) {
      corner.triangularView<Eigen::Lower>().transpose().solveInPlace<Eigen::OnTheRight>(below);
      all.bottomRightCorner(rows - pivots, rows - pivots)
          .selfadjointView<Eigen::Lower>()
          .rankUpdate(below, -1);
    }
  }
  front.columns = all.leftCols(pivots);
  front.rest = all.bottomRightCorner(rows - pivots, rows - pivots);
  return true;
}

bool BlockCholesky::factor(std::span<const Block> diagonal, std::span<const Block> beside) {
  std::atomic<bool> is_definite = true;
  for (size_t depth = levels_.size(); depth-- > 0;) {
    const std::vector<uint32_t>& level = levels_[depth];
    parallel_for(level.size(), 1, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        if (!eliminate(fronts_[level[i]], diagonal, beside)) is_definite = false;
      }
    });
    if (!is_definite) return false;
  }
  return true;
}

void BlockCholesky::solve(Eigen::VectorXd& x) const {
  Eigen::VectorXd own, other;
  const auto gather = [&](const Front& front) {
    own.resize(Eigen::Index{kBlock} * front.pivots);
    other.resize(static_cast<Eigen::Index>(kBlock * (front.rows.size() - front.pivots)));
    for (size_t i = 0; i < front.rows.size(); ++i) {
      const auto from = x.segment<kBlock>(Eigen::Index{kBlock} * front.rows[i]);
      if (i < front.pivots) {
        own.segment<kBlock>(kBlock * i) = from;
      } else {
        other.segment<kBlock>(kBlock * (i - front.pivots)) = from;
      }
    }
  };
  const auto put_back = [&](const Front& front, size_t first, size_t last,
                            const Eigen::VectorXd& values) {
    for (size_t i = first; i < last; ++i) {
      x.segment<kBlock>(Eigen::Index{kBlock} * front.rows[i]) =
          values.segment<kBlock>(kBlock * (i - first));
    }
  };
  for (const Front& front : fronts_) {
    gather(front);
    const Eigen::Index pivots = own.size();
    front.columns.topRows(pivots).triangularView<Eigen::Lower>().solveInPlace(own);
    other.noalias() -= front.columns.bottomRows(other.size()) * own;
    put_back(front, 0, front.pivots, own);
    put_back(front, front.pivots, front.rows.size(), other);
  }
  for (size_t f = fronts_.size(); f-- > 0;) {
    const Front& front = fronts_[f];
    gather(front);
    const Eigen::Index pivots = own.size();
    own.noalias() -= front.columns.bottomRows(other.size()).transpose() * other;
    front.columns.topRows(pivots).triangularView<Eigen::Lower>().transpose().solveInPlace(own);
    put_back(front, 0, front.pivots, own);
  }
}

}  // namespace pilesim
