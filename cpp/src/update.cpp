#include "dynakin/update.hpp"

#include <cmath>

#include "mirror.hpp"

namespace dynakin {

ChunkedUpdate::ChunkedUpdate(int state_size, int chunk_rows, int max_rows) : chunk_rows_(chunk_rows) {
  const int capacity = std::min(std::max(chunk_rows, 6), std::max(max_rows, 1));  // a block is never split
  PHt_.setZero(state_size, capacity);
  Z_.setZero(capacity, state_size);
  S_.setZero(capacity, capacity);
  v_.setZero(capacity);
}

UpdateSums ChunkedUpdate::apply(const std::vector<RowBlock>& blocks, Eigen::MatrixXd& P, Eigen::VectorXd& dx) {
  dx.setZero();
  if (tape_) tape_->clear_chunks();
  UpdateSums sums;
  const int n_blocks = static_cast<int>(blocks.size());
  int first = 0;
  while (first < n_blocks && sums.factored) {
    int end = first, rows = 0;
    while (end < n_blocks && (rows == 0 || rows + blocks[end].rows <= chunk_rows_)) rows += blocks[end++].rows;
    if (rows > 0) apply_chunk(first, end, rows, blocks, P, dx, sums);
    first = end;
  }
  return sums;
}

void ChunkedUpdate::apply_chunk(int first_block, int end_block, int rows, const std::vector<RowBlock>& blocks,
                                Eigen::MatrixXd& P, Eigen::VectorXd& dx, UpdateSums& sums) {
  auto PHt = PHt_.leftCols(rows);
  PHt.setZero();
  int at = 0;
  for (int b = first_block; b < end_block; ++b) {
    const RowBlock& block = blocks[b];
    const std::vector<int>& columns = *block.columns;
    for (int r = 0; r < block.rows; ++r) {
      double v = block.v(r);
      for (std::size_t c = 0; c < columns.size(); ++c) {
        const double h = block.H(r, c);
        PHt.col(at + r) += h * P.col(columns[c]);
        v -= h * dx(columns[c]);
      }
      v_(at + r) = v;
    }
    at += block.rows;
  }

  auto Z = Z_.topRows(rows);
  Z = PHt.transpose();
  auto S = S_.topLeftCorner(rows, rows);
  S.setZero();
  at = 0;
  for (int b = first_block; b < end_block; ++b) {
    const RowBlock& block = blocks[b];
    const std::vector<int>& columns = *block.columns;
    for (int r = 0; r < block.rows; ++r)
      for (std::size_t c = 0; c < columns.size(); ++c) S.col(at + r) += block.H(r, c) * Z.col(columns[c]);
    S.block(at, at, block.rows, block.rows) += block.R.topLeftCorner(block.rows, block.rows);
    at += block.rows;
  }

  Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> llt(S);  // in place; reads the lower triangle
  if (llt.info() != Eigen::Success || !S.allFinite()) {
    sums.factored = false;
    return;
  }
  const auto L = S.triangularView<Eigen::Lower>();
  L.solveInPlace(Z);
  auto v = v_.head(rows);
  L.solveInPlace(v);
  if (tape_) tape_->add_chunk(blocks, first_block, end_block, S, Z, v);
  P.selfadjointView<Eigen::Lower>().rankUpdate(Z.transpose(), -1.0);
  mirror_lower(P);
  dx.noalias() += Z.transpose() * v;
  sums.rows += rows;
  sums.nis += v.squaredNorm();
  sums.log_determinant += 2.0 * S.diagonal().array().log().sum();
}

}  // namespace dynakin
