// Constraints by restricting the Kalman gain (6)-(9).
#pragma once

#include <Eigen/Core>

#include "dynakin/settings.hpp"

namespace dynakin {

class GainConstraint {
 public:
  explicit GainConstraint(int state_size) : correction_(Eigen::VectorXd::Zero(state_size)) {}

  // Restricts the gain (7) so that every element of x beyond its bound lands on it. For bounds A A' = I, and (8), taken
  // from the prediction, gives x + K^R v = x - A'(A x - b): the correction d. The covariance that belongs to the
  // restricted gain is P + d d'/s with s = v' S^-1 v (docs/derivations.md). Without innovation (s at rounding level) no
  // gain can move the state: then the mean alone is moved. Returns how many elements were moved.
  int apply(const FilterSettings& settings, double s, Eigen::VectorXd& x, Eigen::MatrixXd& P);

 private:
  Eigen::VectorXd correction_;
};

}  // namespace dynakin
