// The measurement update by row blocks in chunks: the joint update of all rows, without ever forming it whole.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "dynakin/frame_tape.hpp"
#include "dynakin/measurement.hpp"

namespace dynakin {

struct UpdateSums {
  int rows = 0;
  double nis = 0.0;              // v' S^-1 v
  double log_determinant = 0.0;  // log det S
  bool factored = true;          // false: S of some chunk was not positive definite
};

class ChunkedUpdate {
 public:
  ChunkedUpdate(int state_size, int chunk_rows, int max_rows);

  // Each update is also written to the tape, if there is one.
  void record_to(FrameTape* tape) { tape_ = tape; }
  // H and v of all blocks belong to the same predicted state; dx gathers the correction, v of later chunks is lessened
  // by H dx. The sums equal those of one joint update. P stays symmetric: its lower triangle is updated, then mirrored.
  UpdateSums apply(const std::vector<RowBlock>& blocks, Eigen::MatrixXd& P, Eigen::VectorXd& dx);

 private:
  void apply_chunk(int first_block, int end_block, int rows, const std::vector<RowBlock>& blocks, Eigen::MatrixXd& P,
                   Eigen::VectorXd& dx, UpdateSums& sums);

  int chunk_rows_;
  FrameTape* tape_ = nullptr;
  Eigen::MatrixXd PHt_;  // (n, rows)
  Eigen::MatrixXd Z_;    // (rows, n): H P, then L^-1 H P with S = L L'
  Eigen::MatrixXd S_;
  Eigen::VectorXd v_;
};

}  // namespace dynakin
