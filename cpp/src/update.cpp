#include "dynakin/update.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace dynakin {

using Eigen::Index;

JointUpdate::JointUpdate(int state_size, int max_rows) : Z_(state_size, std::max(max_rows, 1)) {
  const Index capacity = Z_.max_columns();
  HP_.setZero(capacity, state_size);
  S_.setZero(capacity, capacity);
  v_.setZero(capacity);
}

template <class Part>
void JointUpdate::each_panel(const Part& part) {
  const int count = static_cast<int>(Z_.count());
  if (helper_) return helper_->share(count, part);
  for (int p = 0; p < count; ++p) part(p);
}

UpdateSums JointUpdate::apply(const std::vector<RowBlock>& blocks, Eigen::MatrixXd& P, Eigen::VectorXd& dx) {
  dx.setZero();
  if (tape_) tape_->clear_chunks();
  UpdateSums sums;
  for (const RowBlock& block : blocks) {
    v_.segment(sums.rows, block.rows) = block.v.head(block.rows);
    sums.rows += block.rows;
  }
  const int rows = sums.rows;
  if (rows == 0) return sums;
  gather(blocks, rows, P);
  add_up(blocks, rows);
  auto S = S_.topLeftCorner(rows, rows);
  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(S);  // in place; reads the lower triangle
  if (llt.info() != Eigen::Success || !S.diagonal().allFinite()) {
    sums.factored = false;
    return sums;
  }
  auto v = v_.head(rows);
  S.triangularView<Eigen::Lower>().solveInPlace(v);
  each_panel([&](int p) { Z_.divide(p, S, rows); });
  if (tape_) tape_->add_update(blocks, S, Z_, v);
  each_panel([&](int p) { Z_.take_square(p, rows, P); });
  Z_.add_product(v, dx);
  sums.nis = v.squaredNorm();
  sums.log_determinant = 2.0 * S.diagonal().array().log().sum();
  return sums;
}

// Z <- P H' and HP <- its transpose, panel by panel: each part of P is read from afar once.
void JointUpdate::gather(const std::vector<RowBlock>& blocks, int rows, const Eigen::MatrixXd& P) {
  each_panel([&](int p) {
    Index at = 0;
    for (const RowBlock& block : blocks) {
      Z_.combine(p, at, {*block.columns, block.H.data(), block.rows, 1, block.H.outerStride()}, P);
      at += block.rows;
    }
    Z_.get_transposed(p, HP_.topRows(rows));
  });
}

// S <- H P H' + R below its diagonal.
void JointUpdate::add_up(const std::vector<RowBlock>& blocks, int rows) {
  const auto HP = HP_.topRows(rows);
  auto S = S_.topLeftCorner(rows, rows);
  int at = 0;
  for (const RowBlock& block : blocks) {
    const int below = rows - at;
    for (int r = 0; r < block.rows; ++r) {
      auto column = S.col(at + r).tail(below);
      column.setZero();
      for (std::size_t c = 0; c < block.columns->size(); ++c)
        column += block.H(r, c) * HP.col((*block.columns)[c]).tail(below);
    }
    S.block(at, at, block.rows, block.rows) += block.R.topLeftCorner(block.rows, block.rows);
    at += block.rows;
  }
}

}  // namespace dynakin
