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

// The same of what decays alone, over a time in which nothing is seen: coordinates and constants stay as they are.
void decay(const Model& model, const FilterSettings& settings, double dt, Eigen::VectorXd& scratch, Eigen::VectorXd& x,
           Eigen::MatrixXd& P);

// P <- P + what white jerk, so many times as dense as declared, adds to the motion over dt.
void stir(const Model& model, const FilterSettings& settings, double times, double dt, Eigen::MatrixXd& P);

// x <- f(x) over dt alone: where the state is expected to be then, whatever is measured meanwhile.
void predict_mean(const Model& model, const FilterSettings& settings, double dt, Eigen::VectorXd& x);

// x <- F' x, and M <- F' M F of a symmetric M: the backward pass of a smoother.
void transpose_transition(const Model& model, const FilterSettings& settings, double dt, Eigen::Ref<Eigen::VectorXd> x);
void transpose_transition(const Model& model, const FilterSettings& settings, double dt, Eigen::MatrixXd& M);

}  // namespace dynakin
