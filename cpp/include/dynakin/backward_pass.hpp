// What later frames say about a state, carried backwards through what the filter did (modified Bryson-Frazier).
#pragma once

#include <Eigen/Core>

#include "dynakin/correction.hpp"
#include "dynakin/frame_tape.hpp"
#include "dynakin/projection.hpp"
#include "dynakin/settings.hpp"

namespace dynakin {

// Throws std::invalid_argument where constraints are kept in a way that has no smoother.
const FilterSettings& smoothable(const FilterSettings& settings);

// With lambda at a frame whose filtered state and covariance are x and P, the smoothed state is x - P lambda. No
// predicted covariance is inverted (docs/derivations.md, section 9). Allocates at construction.
class BackwardPass {
 public:
  // Throws std::invalid_argument where constraints are kept in a way that has no smoother.
  BackwardPass(const Model& model, const FilterSettings& settings, int max_rows);

  void start() { lambda_.setZero(); }  // no later frame
  // Over the update of a frame, then over the transition of dt that led to it.
  void undo(const FrameTape& tape, double dt);

  void smooth(const Belief& filtered, Eigen::VectorXd& x) const;
  // Inequalities, where the filter keeps them by projection: the nearest state that keeps them, in the metric of P^-1.
  void bound(Eigen::VectorXd& x, const Eigen::MatrixXd& P);

 private:
  void undo_chunk(const FrameTape& tape, const FrameTape::Chunk& chunk);

  const Model& model_;
  const FilterSettings& settings_;
  Projection projection_;
  Eigen::VectorXd lambda_, y_;
};

}  // namespace dynakin
