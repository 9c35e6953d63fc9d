// The lower triangle of a symmetric matrix is the truth; the upper one is its copy.
#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace dynakin {

inline void mirror_lower(Eigen::MatrixXd& P) {
  const Eigen::Index n = P.rows();
  constexpr Eigen::Index tile = 8;  // a tile and its mirror image stay in the cache
  for (Eigen::Index j = 0; j < n; j += tile) {
    const Eigen::Index w = std::min(tile, n - j);
    for (Eigen::Index c = 1; c < w; ++c) P.col(j + c).segment(j, c) = P.row(j + c).segment(j, c).transpose();
    for (Eigen::Index i = j + w; i < n; i += tile) {
      const Eigen::Index h = std::min(tile, n - i);
      P.block(j, i, w, h) = P.block(i, j, h, w).transpose();
    }
  }
}

}  // namespace dynakin
