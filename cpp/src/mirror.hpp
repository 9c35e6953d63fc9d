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

// A + sign (X + X') of a symmetric A, X (n, n).
template <class Matrix, class Symmetric>
void add_both(double sign, const Matrix& X, Symmetric&& A) {
  const Eigen::Index n = A.rows();
  constexpr Eigen::Index tile = 8;
  using Tile = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, tile, tile>;
  for (Eigen::Index j = 0; j < n; j += tile) {
    const Eigen::Index w = std::min(tile, n - j);
    for (Eigen::Index i = j; i < n; i += tile) {
      const Eigen::Index h = std::min(tile, n - i);
      if (w == tile && h == tile && i != j) {
        const Eigen::Matrix<double, tile, tile> sum =
            A.template block<tile, tile>(i, j) +
            sign * (X.template block<tile, tile>(i, j) + X.template block<tile, tile>(j, i).transpose());
        A.template block<tile, tile>(i, j) = sum;
        A.template block<tile, tile>(j, i) = sum.transpose();
      } else {
        Tile sum = A.block(i, j, h, w) + sign * (X.block(i, j, h, w) + X.block(j, i, w, h).transpose());
        if (i == j) sum.template triangularView<Eigen::StrictlyUpper>() = sum.transpose();
        A.block(i, j, h, w) = sum;
        if (i != j) A.block(j, i, w, h) = sum.transpose();
      }
    }
  }
}

}  // namespace dynakin
