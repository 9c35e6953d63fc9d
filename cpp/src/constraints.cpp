#include "dynakin/constraints.hpp"

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

}  // namespace dynakin
