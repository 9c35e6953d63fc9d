#include "dynakin/constraints.hpp"

#include <algorithm>
#include <cmath>

namespace dynakin {

int GainConstraint::apply(const FilterSettings& settings, double s, Eigen::VectorXd& x, Eigen::MatrixXd& P) {
  constexpr double no_innovation = 1e-12;
  int moved = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double bound = x(i) < settings.lower(i)   ? settings.lower(i)
                         : x(i) > settings.upper(i) ? settings.upper(i)
                                                    : x(i);
    correction_(i) = bound - x(i);
    if (correction_(i) == 0.0) continue;
    ++moved;
    x(i) = bound;
  }
  if (moved == 0 || s < no_innovation) return moved;
  for (Eigen::Index j = 0; j < x.size(); ++j) {
    if (correction_(j) == 0.0) continue;
    for (Eigen::Index i = 0; i < x.size(); ++i)
      if (correction_(i) != 0.0) P(i, j) += correction_(i) * correction_(j) / s;
  }
  return moved;
}

int SigmoidBounds::apply(const FilterSettings& settings, const Eigen::VectorXd& dx, Eigen::VectorXd& x,
                         Eigen::MatrixXd& P) {
  constexpr double edge = 1e-3;  // of the width: nearer than this to a bound the map would let nothing move
  int held = 0;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    slope_(i) = 1.0;
    const double lower = settings.lower(i), width = settings.upper(i) - lower;
    if (!std::isfinite(width) || width <= 0.0) {
      x(i) += dx(i);
      continue;
    }
    const double s = std::clamp((x(i) - lower) / width, edge, 1.0 - edge);
    const double slope = s * (1.0 - s);  // of sigmoid(theta) at s = sigmoid(theta)
    const double theta = std::log(s / (1.0 - s)) + dx(i) / (width * slope);
    const double moved = std::clamp(1.0 / (1.0 + std::exp(-theta)), edge, 1.0 - edge);
    held += moved == edge || moved == 1.0 - edge;
    x(i) = lower + width * moved;
    slope_(i) = moved * (1.0 - moved) / slope;
  }
  P.array().colwise() *= slope_.array();
  P.array().rowwise() *= slope_.transpose().array();
  return held;
}

}  // namespace dynakin
