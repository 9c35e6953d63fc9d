#include "dynakin/row_covariance.hpp"

#include <algorithm>

namespace dynakin {

// With T the half of P that has half its diagonal, P = T + T': J P J' = J T J' + (J T J')'.

RowVariances::RowVariances(Eigen::Index rows, Eigen::Index states) : columns_(states) {
  J_.setZero(rows, states);
  JP_ = J_;
  P_.setZero(states, states);
}

void RowVariances::operator()(const Eigen::Ref<const Eigen::MatrixXd>& J, const Eigen::MatrixXd& P, double* out) {
  constexpr Eigen::Index depth = 32, width = 64;  // what Eigen packs of such a product stays on the stack
  Eigen::Index used = 0;
  for (Eigen::Index c = 0; c < J.cols(); ++c)
    if (!J.col(c).isZero(0.0)) columns_[used++] = c;
  auto Ju = J_.leftCols(used);
  auto T = P_.topLeftCorner(used, used);
  for (Eigen::Index k = 0; k < used; ++k) {
    Ju.col(k) = J.col(columns_[k]);
    const double* column = P.col(columns_[k]).data();
    const Eigen::Index block = k / width * width;  // from here on products read it
    T.col(k).segment(block, k - block).setZero();
    T(k, k) = 0.5 * column[columns_[k]];
    for (Eigen::Index r = k + 1; r < used; ++r) T(r, k) = column[columns_[r]];
  }
  auto JT = JP_.leftCols(used);
  JT.setZero();
  for (Eigen::Index c = 0; c < used; c += width)
    for (Eigen::Index k = c; k < used; k += depth) {
      const Eigen::Index nc = std::min(width, used - c), nk = std::min(depth, used - k);
      JT.middleCols(c, nc).noalias() += Ju.middleCols(k, nk) * T.block(k, c, nk, nc);
    }
  for (Eigen::Index r = 0; r < J.rows(); ++r) out[r] = 2.0 * JT.row(r).dot(Ju.row(r));
}

RowCovariance::RowCovariance(Eigen::Index states) : covariance_(Matrix6::Zero()) { H_.setZero(8, states); }

const Matrix6& RowCovariance::operator()(const Eigen::Ref<const Eigen::MatrixXd>& H, const std::vector<int>& columns,
                                         const Eigen::MatrixXd& P) {
  H_.leftCols(H.cols()).topRows(H.rows()) = H;
  H_.leftCols(H.cols()).bottomRows(8 - H.rows()).setZero();
  return of_columns(columns, P);
}

const Matrix6& RowCovariance::of_states(const Eigen::Matrix<double, 6, Eigen::Dynamic>& J,
                                        const std::vector<int>& columns, const Eigen::MatrixXd& P) {
  for (std::size_t c = 0; c < columns.size(); ++c)
    H_.col(static_cast<Eigen::Index>(c)) << J.col(columns[c]), Eigen::Vector2d::Zero();
  return of_columns(columns, P);
}

const Matrix6& RowCovariance::of_columns(const std::vector<int>& columns, const Eigen::MatrixXd& P) {
  using Column = Eigen::Matrix<double, 8, 1>;
  constexpr int few = 4;  // sums side by side, each of which would wait for the one before
  Eigen::Matrix<double, 8, 8> half = Eigen::Matrix<double, 8, 8>::Zero();  // J T J'
  const auto n = static_cast<Eigen::Index>(columns.size());
  for (Eigen::Index c = 0; c < n; ++c) {
    const double* const column = P.col(columns[c]).data();
    Column sum[few] = {0.5 * column[columns[c]] * H_.col(c), Column::Zero(), Column::Zero(), Column::Zero()};
    Eigen::Index d = c + 1;
    for (; d + few <= n; d += few)
      for (int k = 0; k < few; ++k) sum[k] += column[columns[d + k]] * H_.col(d + k);
    for (; d < n; ++d) sum[0] += column[columns[d]] * H_.col(d);
    sum[0] += sum[1];
    sum[2] += sum[3];
    sum[0] += sum[2];
    half.noalias() += sum[0] * H_.col(c).transpose();
  }
  covariance_ = half.topLeftCorner<6, 6>() + half.topLeftCorner<6, 6>().transpose();
  return covariance_;
}

}  // namespace dynakin
