// A Kalman filter of what moves, given what does not: a stretch of frames forwards.
#pragma once

#include "dynakin/correction.hpp"
#include "dynakin/given_constants.hpp"
#include "dynakin/panels.hpp"

namespace dynakin {

class FilterGivenConstants {
 public:
  // apart: of the same model and settings; all three must outlive it.
  FilterGivenConstants(const Model& model, const FilterSettings& settings, const GivenConstants& apart, int max_rows);

  // The last frame of all: the constants are as it has them.
  void end(const Belief& last);
  // A stretch, the last one first: from what is known before its first frame, through its frames, in their order.
  // moved: by how much `Decision::moved` moves the state in the stretch, (n,).
  void start(const Belief& before, const Eigen::VectorXd& moved);
  // decided, dt, before and after are given, the rest is found. last: the frame before, nullptr of the first; blocks
  // are linearised where the filter had them, and those that it did not use have no rows.
  void step(const std::vector<RowBlock>& blocks, const FrameGivenConstants* last, FrameGivenConstants& frame);

 private:
  using Frame = FrameGivenConstants;
  void predict(const Eigen::MatrixXd& S, const Eigen::MatrixXd& Vt, Frame& frame);
  void gather(const std::vector<RowBlock>& blocks, Frame& frame);
  void correct(int from, int end, Frame& frame);
  void keep_equalities(Frame& frame);

  const Model& model_;
  const FilterSettings& settings_;
  const GivenConstants& apart_;
  Eigen::VectorXd c_, c_now_;  // (c,) where the stretch begins, and now
  Eigen::MatrixXd Ct_;         // C', upper triangular
  // Where the stretch begins.
  Eigen::MatrixXd S_, Vt_;
  Eigen::VectorXd shift_;  // (d,) m less the whole filter's mean
  Transition how_;         // to the present frame, of all states
  // Of the present frame's rows.
  std::vector<int> c_ends_, c_columns_;
  std::vector<double> c_values_, innovation_;
  Eigen::MatrixXd R_, Zt_, S_rows_;  // R_: (6, rows)
  Panels Z_panels_, D_panels_;
};

}  // namespace dynakin
