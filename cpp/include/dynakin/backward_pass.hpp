// What later frames say about a state, carried backwards through what the filter did (modified Bryson-Frazier).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynakin/frame_tape.hpp"
#include "dynakin/projection.hpp"
#include "dynakin/settings.hpp"

namespace dynakin {

// Throws std::invalid_argument where constraints are kept in a way that has no smoother.
const FilterSettings& smoothable(const FilterSettings& settings);

// With lambda and Lambda at a frame whose filtered state and covariance are x and P, the smoothed ones are x - P lambda
// and P - P Lambda P. No predicted covariance is inverted (docs/derivations.md, section 9). Allocates at construction.
class BackwardPass {
 public:
  // max_rows: of one chunk. Without covariance Lambda is not carried. Throws std::invalid_argument where constraints
  // are kept in a way that has no smoother.
  BackwardPass(const Model& model, const FilterSettings& settings, int max_rows, bool covariance);

  void start();  // no later frame
  // Over the update of a frame, then over the transition of dt that led to it.
  void undo(const FrameTape& tape, double dt);

  void smooth(const Eigen::VectorXd& x, const Eigen::MatrixXd& P, Eigen::VectorXd& x_smooth) const;
  void smooth(const Eigen::MatrixXd& P, Eigen::MatrixXd& P_smooth);
  // Inequalities, where the filter keeps them by projection: the nearest state that keeps them, in the metric of P^-1.
  void bound(Eigen::VectorXd& x, const Eigen::MatrixXd& P);

 private:
  void undo_chunk(const FrameTape& tape, int from, int rows);

  const Model& model_;
  const FilterSettings& settings_;
  Projection projection_;
  bool covariance_;
  bool zero_ = true;  // lambda and Lambda still are
  Eigen::VectorXd lambda_, y_;
  Eigen::MatrixXd Lambda_;
  Eigen::MatrixXd G_, B_;  // (n, rows)
  Eigen::MatrixXd T_;      // (rows, rows)
  Eigen::MatrixXd LambdaP_;
  std::vector<int> touched_;  // rows of a chunk's A' that are not zero
  Eigen::MatrixXd Au_, U_;    // these, and Au B'
};

}  // namespace dynakin
