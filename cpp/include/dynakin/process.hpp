// How the state moves between frames: constant acceleration for the coordinates, constants for the rest (4).
#pragma once

#include <Eigen/Core>

#include "dynakin/model.hpp"

namespace dynakin {

// x <- f(x), P <- F P F' + Q with the paper's diagonal Q. F is never formed: it only mixes the first three blocks of P.
void predict_diagonal(const Model& model, double dt, const Eigen::VectorXd& process_variance, Eigen::VectorXd& x,
                      Eigen::MatrixXd& P);

}  // namespace dynakin
