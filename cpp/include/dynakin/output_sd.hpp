// Standard deviations of what is reported of a state: J P J' for markers, wrench and moments.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynakin/moment_derivatives.hpp"
#include "dynakin/row_covariance.hpp"

namespace dynakin {

// Allocated once for a model. x, kinematics and dynamics belong together; P is the covariance of x.
class OutputDeviation {
 public:
  explicit OutputDeviation(const Model& model);

  // out (3 markers): along the ground's axes.
  void markers(const KinematicState& state, const Eigen::MatrixXd& P, double* out);
  // out (6): of the body's own wrench, about the ground origin.
  void wrench(const KinematicState& state, const DynamicState& dynamics, const Eigen::MatrixXd& P, double* out);
  // out (coordinates), locked ones too.
  void moments(const StateRef& x, const KinematicState& state, const DynamicState& dynamics, const Eigen::MatrixXd& P,
               double* out);

 private:
  const Model& model_;
  std::vector<std::vector<int>> slot_;  // a marker: state column -> place in its list
  Eigen::Matrix<double, 3, Eigen::Dynamic> marker_J_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> wrench_J_;
  MomentWorkspace work_;
  Eigen::MatrixXd moment_J_;
  RowCovariance row_covariance_;
  RowVariances moment_variances_;
};

}  // namespace dynakin
