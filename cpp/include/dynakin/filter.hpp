// predict, innovate, correct, constrain: one step of the constrained extended Kalman filter.
#pragma once

#include <Eigen/Core>
#include <stdexcept>
#include <string>

#include "dynakin/constraints.hpp"
#include "dynakin/gate.hpp"
#include "dynakin/measurement.hpp"
#include "dynakin/process.hpp"
#include "dynakin/projection.hpp"
#include "dynakin/update.hpp"

namespace dynakin {

enum class StepStatus { ok, no_measurement, innovation_not_definite, not_finite, variance_not_positive };
const char* describe(StepStatus status);

// What the filter makes of its own estimate. doubtful: most markers were refused, or would be further than
// recovery.fit_m from the estimate that they gave, so nothing of the frame was used; lost: so, or unseen, for longer
// than recovery.blind_s, the motion is held until it is found; found: sought anew in this frame, and the markers fit;
// restarted: the numbers had broken down, everything starts again from x0, and the motion is to be found.
enum class Tracking : std::uint8_t { following, doubtful, lost, found, restarted };
const char* describe(Tracking tracking);

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
  StepReport update(const Eigen::Ref<const MarkerMatrix>& markers, const Vector6& wrench);
  StepReport step(double dt, const Eigen::Ref<const MarkerMatrix>& markers, const Vector6& wrench) {
    predict(dt);
    return update(markers, wrench);
  }
  void reset(const Eigen::VectorXd& x, const Eigen::MatrixXd& P);

  // From now on each update also writes what it did, to a tape of tape_rows(); nullptr: no longer. One listener at a
  // time.
  void record_to(FrameTape* tape);
  int tape_rows() const { return measurement_.max_rows() + static_cast<int>(settings_.equality.rows()); }
  // All that later steps depend on: restored, they give the same numbers to the last bit.
  struct Checkpoint {
    Eigen::VectorXd x;
    Eigen::MatrixXd P;
    Projection::Memory projection;
    double unbelieved_s = 0.0, sought_s = k_infinity, shortest_step_s = k_infinity;
    bool held = false;
    StepReport last;
  };
  void save(Checkpoint& out) const;
  void restore(const Checkpoint& checkpoint);

  const Model& model() const { return model_; }
  const FilterSettings& settings() const { return settings_; }
  const Eigen::VectorXd& state() const { return x_; }
  const Eigen::MatrixXd& covariance() const { return P_; }
  // z predicted before the last update, all channels.
  const Eigen::VectorXd& predicted() const { return predicted_; }
  // What became of each marker and, last, of the plates in the last update.
  const std::vector<Verdict>& verdicts() const { return gate_.verdicts(); }
  // Kinematics and dynamics at the present state, for what is reported of it.
  const Measurement& evaluate();
  // The same at the state that is expected in dt seconds; the filter stays where it is.
  const Measurement& foresee(double dt);

 private:
  using MarkerRef = Eigen::Ref<const MarkerMatrix>;
  double carried_on(double dt);
  Tracking believe(const MarkerRef& markers);
  Tracking doubt();
  Tracking seek(const MarkerRef& markers);
  double squared_distance(const MarkerRef& markers, std::size_t m) const;
  double distance(const MarkerRef& markers) const;
  double distance_within_bounds(const MarkerRef& markers);
  bool correct_to_fit(const MarkerRef& markers, const Vector6& wrench);
  Tracking fit(const MarkerRef& markers, const Vector6& wrench);
  void leave_out_refused();
  double uncertainty_seen() const;
  UpdateSums correct(const MarkerRef& markers, const Vector6& wrench);
  UpdateSums iterate(const MarkerRef& markers, const Vector6& wrench, int most);
  void constrain(double nis, StepReport& report);
  void forget(int element, double variance);
  void hold_coordinate(int i);
  void hold_unseen();
  void hold_motion();
  bool seek_motion(const MarkerRef& markers, int refused);
  bool turn_towards(const MarkerRef& markers);
  bool seek_better(const MarkerRef& markers, const Vector6& wrench, int refused);
  bool judge_by_distance(const MarkerRef& markers);
  StepStatus check() const;

  const Model model_;  // copies: a filter stands alone
  const FilterSettings settings_;
  Eigen::VectorXd x_, dx_, step_, predicted_, x0_, x_before_, x_ahead_;
  Eigen::MatrixXd P_, P0_, P_before_;
  Measurement measurement_;
  Gate gate_;
  ChunkedUpdate update_;
  GainConstraint gain_{model_.state_size()};
  SigmoidBounds sigmoid_{model_.state_size()};
  Projection projection_;
  UpdateSums sums_;
  double unbelieved_s_ = 0.0;     // since a frame whose markers were believed
  double sought_s_ = k_infinity;  // since a better motion was last sought than one that is followed
  double shortest_step_s_ = k_infinity;
  bool unseen_ = false;  // coordinates are held in this frame, because nothing is seen of them
  bool held_ = false;    // the motion is lost, and to be found before anything is believed
  StepReport last_;
  FrameTape* tape_ = nullptr;
};

}  // namespace dynakin
