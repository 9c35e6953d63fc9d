// predict, innovate, correct, constrain: one step of the constrained extended Kalman filter.
#pragma once

#include <Eigen/Core>
#include <stdexcept>
#include <string>

#include "dynakin/constraints.hpp"
#include "dynakin/measurement.hpp"
#include "dynakin/process.hpp"
#include "dynakin/update.hpp"

namespace dynakin {

enum class StepStatus { ok, no_measurement, innovation_not_definite, not_finite, variance_not_positive };
const char* describe(StepStatus status);

struct StepReport {
  StepStatus status = StepStatus::ok;
  int rows = 0;                 // measured in this step
  int constrained = 0;          // elements moved onto a bound
  double nis = 0.0;             // normalised innovation squared, over all rows
  double log_likelihood = 0.0;  // of the innovation

  bool diverged() const { return status != StepStatus::ok && status != StepStatus::no_measurement; }
};

class DivergenceError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Filter {
 public:
  // x0 and P0: state and covariance at the time of the first frame. Throws std::invalid_argument.
  Filter(const Model& model, const FilterSettings& settings, const Eigen::VectorXd& x0, const Eigen::MatrixXd& P0);
  Filter(const Filter&) = delete;
  Filter& operator=(const Filter&) = delete;

  void predict(double dt);
  // markers (3, M) m and wrench (N, N m about the ground origin), NaN where missing. After a step that diverged the
  // state is not to be used; further updates report the same until reset().
  StepReport update(const Eigen::Ref<const MarkerMatrix>& markers, const Vector6& wrench);
  StepReport step(double dt, const Eigen::Ref<const MarkerMatrix>& markers, const Vector6& wrench) {
    predict(dt);
    return update(markers, wrench);
  }
  void reset(const Eigen::VectorXd& x, const Eigen::MatrixXd& P);

  const Model& model() const { return model_; }
  const Eigen::VectorXd& state() const { return x_; }
  const Eigen::MatrixXd& covariance() const { return P_; }
  // z predicted before the last update, all channels.
  const Eigen::VectorXd& predicted() const { return predicted_; }
  // Kinematics and dynamics at the present state, for what is reported of it.
  const Measurement& evaluate();

 private:
  StepStatus check() const;

  const Model model_;  // copies: a filter stands alone
  const FilterSettings settings_;
  Eigen::VectorXd x_, dx_, predicted_;
  Eigen::MatrixXd P_;
  Measurement measurement_;
  ChunkedUpdate update_;
  GainConstraint constraint_{model_.state_size()};
  StepReport last_;
};

}  // namespace dynakin
