// The covariance of a past frame, from the frames after it: what it has to do with the present is carried forwards.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynakin/frame_tape.hpp"
#include "dynakin/given_constants.hpp"
#include "dynakin/panels.hpp"

namespace dynakin {

// Of s, what moves, at the past frame, it keeps P = Cov(s, s) and M = Cov(s, x) with the present state x, and repeats
// with them what the filter did to x (docs/derivations.md, section 9). What does not move is the same at all frames.
// Allocates at construction.
class PastCovariance {
 public:
  // The model and the settings must outlive it. max_rows: of a tape.
  PastCovariance(const Model& model, const FilterSettings& settings, int max_rows);

  void start(const Eigen::MatrixXd& P);  // the past frame, as it was filtered
  // The next frame, dt later, which may not be one with which everything started again. last: end() follows.
  void add_frame(const FrameTape& tape, double dt, bool last);
  void end(const Eigen::MatrixXd& P);  // of the filter after the last frame

  // (n, n), of all pairs of elements of which none is a marker's own, and of those that move the same marker; others
  // are zero.
  const Eigen::MatrixXd& covariance() const { return covariance_; }

 private:
  void take(const FrameTape& tape, const FrameTape::Chunk& chunk, bool last);

  const Model& model_;
  const FilterSettings& settings_;
  const GivenConstants apart_;
  Transition how_;    // without its noise
  Panels M_, P_, U_;  // (d, n), (d, d) below its diagonal, (d, rows)
  // Of each panel, groups of columns that the covariance needs: of P, and of M in the end.
  std::vector<std::vector<Eigen::Index>> past_, present_;
  Eigen::MatrixXd covariance_;
};

}  // namespace dynakin
