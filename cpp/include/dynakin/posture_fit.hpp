// Coordinates that bring a model's markers nearest to measured places: least squares within bounds, one frame alone.
#pragma once

#include <Eigen/Core>

#include "dynakin/kinematics.hpp"

namespace dynakin {

// What a posture is fitted to. Vectors have an element a free coordinate; NaN in targets: not measured.
struct PostureProblem {
  Eigen::Matrix3Xd targets;      // (3, M) m, ground frame
  Eigen::VectorXd lower, upper;  // rad or m
  Eigen::VectorXd scale;         // what counts as a step of one
  Eigen::VectorXd pull, rest;    // pull * (q - rest) is minimised with the distances: what no marker shows stays there
};

struct PostureFit {
  Eigen::VectorXd q;
  double cost;  // half the sum of squares, pull and all
  bool converged;
};

// Levenberg-Marquardt (Nielsen 1999, IMM-REP-1999-05) on the scaled coordinates; those at a bound that the gradient
// pushes outwards rest there for the step, and a step is cut off at the bounds (projected, Kanzow et al. 2004, J
// Comput Appl Math 172:375-397). All else in x0, lengths and marker places, stays. Throws std::invalid_argument where
// sizes do not fit or no component is measured.
PostureFit fit_posture(const Model& model, const Eigen::VectorXd& x0, const PostureProblem& problem,
                       const Eigen::VectorXd& start);

}  // namespace dynakin
