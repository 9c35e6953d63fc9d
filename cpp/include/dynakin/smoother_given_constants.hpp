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
  // meaning but in a column that complete() made. SmoothedDependence went through the stretch before.
  void look(const FrameGivenConstants& frame, Eigen::VectorXd& x);
  const Eigen::MatrixXd& covariance() const { return covariance_; }
  void complete(const FrameGivenConstants& frame, int column);
  // Over the frame's update and what led to it. last: as of FilterGivenConstants::step.
  void undo(const FrameGivenConstants& frame, const FrameGivenConstants* last);

 private:
  using Frame = FrameGivenConstants;
  void form(const Frame& frame);
  void undo_chunk(const Frame& frame, int from, int end);
  void carry_back(const Transition& how, const Eigen::MatrixXd& S);

  const Model& model_;
  const GivenConstants& apart_;
  Eigen::MatrixXd Ct_;  // C', upper triangular
  // The adjoints of m and S.
  Eigen::VectorXd lambda_;
  Eigen::MatrixXd Lambda_;
  Eigen::MatrixXd P_;   // (d, d) covariance given z from all frames, of the frame that is looked at
  bool ended_ = false;  // no later frame has said anything yet
  Panels panels_;
  Eigen::MatrixXd B_, Bt_, T_, U_, X_, M_, dd_, dc_, covariance_;
  Eigen::VectorXd d_, y_, c_;
  std::vector<const double*> a_, b_;
  Eigen::MatrixXd dots_;
};

}  // namespace dynakin
