// Cholesky factors of a sparse symmetric positive definite matrix of 6 x 6 blocks whose nodes have
// positions in space. Geometric nested dissection (George 1973) and dense fronts (Duff and Reid
// 1983) turn nearly all the work into products of dense matrices.
#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "core/types.h"

namespace pilesim {

class BlockCholesky {
 public:
  static constexpr int kBlock = 6;
  using Block = Eigen::Matrix<double, kBlock, kBlock>;
  using Edge = std::pair<uint32_t, uint32_t>;

  // Nodes at `places`, m; `edges` are the blocks off the diagonal, each pair of nodes once.
  BlockCholesky(std::span<const Vec3> places, std::vector<Edge> edges);

  // `diagonal` (nodes); `beside` (edges): rows of the first node, columns of the second. Gives
  // false if the matrix is not positive definite.
  bool factor(std::span<const Block> diagonal, std::span<const Block> beside);
  // After factor(); `x` (6 nodes) is the right-hand side and becomes the solution.
  void solve(Eigen::VectorXd& x) const;

 private:
  // Nodes that are eliminated together, after those of its children.
  struct Front {
    std::vector<uint32_t> rows;  // nodes: first those eliminated here, then those they touch
    uint32_t pivots = 0;         // number of rows eliminated here
    std::vector<uint32_t> children;
    std::vector<uint32_t> edges;  // edges assembled here
    Eigen::MatrixXd columns;      // (6 rows, 6 pivots): factors
    Eigen::MatrixXd rest;         // lower half, for the parent; only during factor()
  };
  uint32_t dissect(std::vector<uint32_t> nodes, int depth);
  void find_rows();
  bool eliminate(Front& front, std::span<const Block> diagonal, std::span<const Block> beside);

  std::vector<Vec3> places_;
  std::vector<Edge> edges_;
  std::vector<std::vector<uint32_t>> neighbours_;  // by node
  std::vector<Front> fronts_;                      // children before parents
  std::vector<std::vector<uint32_t>> levels_;      // fronts by depth
  std::vector<uint32_t> rank_;                     // order of elimination, by node
  std::vector<uint8_t> side_;                      // scratch of dissect()
};

}  // namespace pilesim
