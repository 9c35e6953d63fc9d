// How the state moves between frames: constant acceleration for the coordinates (4), decay for soft tissue and plate
// errors, constants for the rest.
#pragma once

#include <Eigen/Core>

#include "dynakin/settings.hpp"

namespace dynakin {

// x <- f(x), P <- F P F' + Q over dt. F is never formed: it mixes the first three blocks of P and scales what decays.
// Q is the sum of a diagonal added at each call, the paper's, and of continuous white noise integrated over dt, which
// makes two half steps equal one (docs/derivations.md, section 10).
// scratch: (n,).
void predict(const Model& model, const FilterSettings& settings, double dt, Eigen::VectorXd& scratch,
             Eigen::VectorXd& x, Eigen::MatrixXd& P);

// F and Q of predict (but for what keeps it clear of rounding) over `carried` and then decay over the rest of dt, by
// their entries; carried 0 of a dt that is not: the coordinates are held.
struct Transition {
  explicit Transition(const Model& model);

  double step = 0.0;                                // of the coordinates, s
  Eigen::VectorXd kept;                             // (n,) what is left of each element, 1 of all but what decays
  Eigen::VectorXd variance;                         // (n,) diagonal of Q
  Eigen::Matrix<double, Eigen::Dynamic, 3> shared;  // (free,) Q between q and qd, q and qdd, qd and qdd
};
void transition(const Model& model, const FilterSettings& settings, double carried, double dt, Transition& out);
// Q plus what stir adds.
void stir(const Model& model, const FilterSettings& settings, double times, double dt, Transition& out);

// The same of what decays alone, over a time in which nothing is seen: coordinates and constants stay as they are.
void decay(const Model& model, const FilterSettings& settings, double dt, Eigen::VectorXd& scratch, Eigen::VectorXd& x,
           Eigen::MatrixXd& P);

// P <- P + what white jerk, so many times as dense as declared, adds to the motion over dt.
void stir(const Model& model, const FilterSettings& settings, double times, double dt, Eigen::MatrixXd& P);

// x <- f(x) over dt alone: where the state is expected to be then, regardless of what is measured meanwhile.
void predict_mean(const Model& model, const FilterSettings& settings, double dt, Eigen::VectorXd& x);

// x <- F' x: the backward pass of a smoother.
void transpose_transition(const Model& model, const FilterSettings& settings, double dt, Eigen::VectorXd& x);

}  // namespace dynakin
