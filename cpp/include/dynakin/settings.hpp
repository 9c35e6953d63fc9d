// What a user declares to the filter: noise, bounds, and how constraints are kept.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>

#include "dynakin/model.hpp"

namespace dynakin {

enum class ConstraintKind { none, gain };

struct FilterSettings {
  Eigen::VectorXd process_variance;  // (n,) Q of (4), added at each step, SI units squared
  Eigen::VectorXd marker_variance;   // (markers,) m^2 on each measured axis; infinite: the marker is not used
  Matrix6 wrench_covariance = Matrix6::Identity();  // [N, N m] about reference_point; an infinite variance: not used
  Vector3 reference_point = Vector3::Zero();        // m, ground frame
  std::optional<double> total_mass;                 // kg, measured at each frame (5); absent: no such row
  double total_mass_variance = 1e-4;                // kg^2
  Eigen::VectorXd lower, upper;                     // (n,) bounds (9), -inf/+inf where there is none
  ConstraintKind constraint = ConstraintKind::gain;
  int chunk_rows = 28;  // rows of one sequential update

  // Throws std::invalid_argument naming the setting, what was found and what was expected.
  void check(const Model& model) const;
};

}  // namespace dynakin
