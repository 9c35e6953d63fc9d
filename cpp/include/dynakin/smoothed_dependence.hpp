// How what moves hangs on the constants, from all frames: the part of the way back that needs no covariance from it.
#pragma once

#include <span>

#include "dynakin/given_constants.hpp"
#include "dynakin/panels.hpp"

namespace dynakin {

class SmoothedDependence {
 public:
  // apart must outlive it.
  SmoothedDependence(const GivenConstants& apart, int max_rows);

  // The last frame of all.
  void end() { Wt_.setZero(); }
  // A stretch that FilterGivenConstants went through, the last one first: each frame's V becomes that from all frames.
  void smooth(std::span<FrameGivenConstants> frames);

 private:
  void undo_chunk(const FrameGivenConstants& frame, int from, int end);

  const GivenConstants& apart_;
  Eigen::MatrixXd Wt_;  // (c, d) the adjoint of V
  Eigen::MatrixXd M_, U_;
  Panels panels_;
};

}  // namespace dynakin
