// The measurement update: all rows at once, by row blocks, without ever forming H whole.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynakin/frame_tape.hpp"
#include "dynakin/helper.hpp"
#include "dynakin/measurement.hpp"
#include "dynakin/panels.hpp"

namespace dynakin {

struct UpdateSums {
  int rows = 0;
  double nis = 0.0;              // v' S^-1 v
  double log_determinant = 0.0;  // log det S
  bool factored = true;          // false: S was not positive definite
};

class JointUpdate {
 public:
  JointUpdate(int state_size, int max_rows);

  // Each update is also written to the tape, if there is one.
  void record_to(FrameTape* tape) { tape_ = tape; }
  // Panels are shared with it; nullptr: no longer.
  void share_with(Helper* helper) { helper_ = helper; }
  // H and v of all blocks belong to the same predicted state; dx is the correction. P stays symmetric to the bit. Where
  // S is not positive definite nothing has changed but dx, which is zero.
  UpdateSums apply(const std::vector<RowBlock>& blocks, Eigen::MatrixXd& P, Eigen::VectorXd& dx);

 private:
  void gather(const std::vector<RowBlock>& blocks, int rows, const Eigen::MatrixXd& P);
  void add_up(const std::vector<RowBlock>& blocks, int rows);
  template <class Part>
  void each_panel(const Part& part);

  FrameTape* tape_ = nullptr;
  Helper* helper_ = nullptr;
  Panels Z_;            // (n, rows) P H', then P H' L^-T with S = L L'
  Eigen::MatrixXd HP_;  // (rows, n)
  Eigen::MatrixXd S_;
  Eigen::VectorXd v_;
};

}  // namespace dynakin
