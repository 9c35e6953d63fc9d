// Bounds kept by restricting the Kalman gain (6)-(9), and by a smooth map; projection.hpp has the default.
#pragma once

#include <Eigen/Core>

#include "dynakin/settings.hpp"

namespace dynakin {

class GainConstraint {
 public:
  explicit GainConstraint(int state_size) : correction_(Eigen::VectorXd::Zero(state_size)) {}

  // Restricts the gain (7) so that every element of x beyond its bound lands on it. For bounds A A' = I, and (8), taken
  // from the prediction, gives x + K^R v = x - A'(A x - b): the correction d. The covariance that belongs to the
  // restricted gain is P + d d'/s with s = v' S^-1 v (docs/derivations.md, section 7). Without innovation (s at
  // rounding level) no gain can move the state: then the mean alone is moved. Returns how many elements were moved.
  int apply(const FilterSettings& settings, double s, Eigen::VectorXd& x, Eigen::MatrixXd& P);

 private:
  Eigen::VectorXd correction_;
};

// Smooth bounds (Joukov et al. 2015): an element between finite bounds moves as lower + (upper - lower) sigmoid(theta),
// and the filter corrects theta. Its covariance is kept in units of the element, so it scales with the slope.
class SigmoidBounds {
 public:
  explicit SigmoidBounds(int state_size) : slope_(Eigen::VectorXd::Ones(state_size)) {}

  // x, which lies between its bounds, moved by dx along the map; P scaled to the slope there. Returns how many elements
  // lie so close to a bound that the slope has all but vanished.
  int apply(const FilterSettings& settings, const Eigen::VectorXd& dx, Eigen::VectorXd& x, Eigen::MatrixXd& P);

 private:
  Eigen::VectorXd slope_;
};

}  // namespace dynakin
