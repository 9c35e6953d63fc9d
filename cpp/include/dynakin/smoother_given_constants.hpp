// A smoother of what moves, given what does not: a stretch of frames backwards.
#pragma once

#include "dynakin/correction.hpp"
#include "dynakin/given_constants.hpp"
#include "dynakin/panels.hpp"

namespace dynakin {

class SmootherGivenConstants {
 public:
  // apart: of the same model and settings; both it and the model must outlive it.
  SmootherGivenConstants(const Model& model, const GivenConstants& apart, int max_rows);

  // The last frame of all: nothing is said by later ones, and the constants are as it has them.
  void end(const Belief& last);
  // From a stretch's last frame to its first: the frame's state from all frames, and its covariance (n, n) of all pairs
  // of elements of which none is a marker's own, and of those that move the same marker. Other entries are of no
  // meaning before complete().
  void look(const FrameGivenConstants& frame, Eigen::VectorXd& x);
  const Eigen::MatrixXd& covariance() const { return covariance_; }
  void complete();
  // Over the frame's update and what led to it. last: as of FilterGivenConstants::step.
  void undo(const FrameGivenConstants& frame, const FrameGivenConstants* last);

 private:
  using Frame = FrameGivenConstants;
  void undo_chunk(const Frame& frame, int from, int end);
  void undo_transition(const Transition& how, const Frame* last);

  const Model& model_;
  const GivenConstants& apart_;
  Eigen::MatrixXd Ct_;  // C', upper triangular
  // The adjoints of m, S and V.
  Eigen::VectorXd lambda_;
  Eigen::MatrixXd Lambda_, Wt_;
  Eigen::MatrixXd P_, Yt_;  // (d, d) covariance given z from all frames, V' from all frames (c, d)
  bool there_ = false;      // they are of the frame that is looked at
  bool ended_ = false;      // no later frame has said anything yet
  int since_ = 0;           // frames since they were not carried here from the frame after
  double decayed_ = 1.0;    // least that was kept of an element on the way
  Panels Z_panels_, D_panels_;
  Eigen::MatrixXd G_, M_, X_, T_, Bt_, U_, Yw_, Pw_, Pwc_, covariance_;
};

}  // namespace dynakin
