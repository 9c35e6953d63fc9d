// predict, innovate, correct, constrain: one step of the constrained extended Kalman filter.
#pragma once

#include <Eigen/Core>
#include <stdexcept>
#include <string>

#include "dynakin/constraints.hpp"
#include "dynakin/process.hpp"
#include "dynakin/projection.hpp"
#include "dynakin/recovery.hpp"

namespace dynakin {

enum class StepStatus { ok, no_measurement, innovation_not_definite, not_finite, variance_not_positive };
const char* describe(StepStatus status);

struct StepReport {
  StepStatus status = StepStatus::ok;
  Tracking tracking = Tracking::following;
  int rows = 0;                 // measured in this step, and believed
  int constrained = 0;          // elements moved onto a bound; with projection: active constraints
  bool constraints_met = true;  // false: no state within reach kept them all, bounds were kept one by one
  double nis = 0.0;             // normalised innovation squared, over all rows
  double log_likelihood = 0.0;  // of the innovation

  // Given up: the status says why. With recovery the filter starts again instead, and the status says why it had to.
  bool diverged() const { return broken() && tracking != Tracking::restarted; }
  bool broken() const { return status != StepStatus::ok && status != StepStatus::no_measurement; }
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

  // With recovery the motion is carried on for recovery.blind_s without a marker that is believed, over a long dt as
  // over many short ones; after that it is held.
  void predict(double dt);
  // markers (3, M) m and wrench (N, N m about the ground origin), NaN where missing. After a step that diverged the
  // state is not to be used; further updates report the same until reset().
  // how: the wrench of this frame is measured, see Measurement::expect.
  StepReport update(const MarkerRef& markers, const Vector6& wrench, const WrenchModel* how = nullptr);
  StepReport step(double dt, const MarkerRef& markers, const Vector6& wrench, const WrenchModel* how = nullptr) {
    predict(dt);
    return update(markers, wrench, how);
  }
  void reset(const Eigen::VectorXd& x, const Eigen::MatrixXd& P);

  // From now on each update also writes what it did, to a tape of tape_rows(); nullptr: no longer. One listener at a
  // time.
  void record_to(FrameTape* tape) { correction_.record_to(tape); }
  // From now on updates share their largest products with it; nullptr: no longer. No bit of them changes.
  void share_with(Helper* helper) { correction_.share_with(helper); }
  int tape_rows() const { return correction_.measurement.max_rows() + static_cast<int>(settings_.equality.rows()); }
  std::size_t tape_sensors() const { return correction_.measurement.blocks().size(); }
  // Of the last predict: see Recovery::carry_on.
  double carried() const { return recovery_.carried(); }
  // All that later steps depend on: restored, they give the same numbers to the last bit.
  struct Checkpoint {
    Belief belief;
    Projection::Memory projection;
    Recovery::Memory recovery;
    StepReport last;
  };
  void save(Checkpoint& out) const;
  void restore(const Checkpoint& checkpoint);

  const Model& model() const { return model_; }
  const FilterSettings& settings() const { return settings_; }
  const Belief& belief() const { return correction_.now; }
  const Eigen::VectorXd& state() const { return correction_.now.x; }
  const Eigen::MatrixXd& covariance() const { return correction_.now.P; }
  // z predicted before the last update, all channels.
  const Eigen::VectorXd& predicted() const { return predicted_; }
  // What became of each marker and, last, of the plates in the last update.
  const std::vector<Verdict>& verdicts() const { return correction_.gate.verdicts(); }
  // From now on, or no longer, each update also fills sensors().
  void report_sensors(bool on) { correction_.gate.report_sensors(on); }
  const SensorReport& sensors() const { return correction_.gate.sensors(); }
  // Kinematics and dynamics at the present state, for what is reported of it.
  const Measurement& evaluate();
  // The same at the state that is expected in dt seconds; the filter stays where it is.
  const Measurement& foresee(double dt);

 private:
  void constrain(StepReport& report);
  StepStatus check() const;

  const Model model_;  // copies: a filter stands alone
  const FilterSettings settings_;
  Correction correction_;
  Recovery recovery_;
  GainConstraint gain_{model_.state_size()};
  SigmoidBounds sigmoid_{model_.state_size()};
  Projection projection_;
  Eigen::VectorXd predicted_;
  StepReport last_;
};

}  // namespace dynakin
