// What a user declares to the filter: noise, gates, bounds, and how constraints are kept.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>

#include "dynakin/model.hpp"

namespace dynakin {

enum class ConstraintKind { none, gain, projection, sigmoid };

// Largest normalised innovation squared of a sensor's k rows that is believed, at [k - 1].
using GateLimits = std::array<double, 6>;
inline constexpr double k_infinity = std::numeric_limits<double>::infinity();
inline constexpr GateLimits no_gate = {k_infinity, k_infinity, k_infinity, k_infinity, k_infinity, k_infinity};

// When markers stop fitting, or stop coming, the motion is sought anew; see recovery.hpp.
struct RecoverySettings {
  bool enabled = false;
  double blind_s = 0.2;        // s without a marker that is believed until the motion counts as lost
  double fit_m = 0.03;         // RMS distance of the markers used from the estimate that is still called a fit
  double coordinate_sd = 0.5;  // rad or m: the motion's standard deviations when it is sought anew
  double speed_sd = 2.0;       // rad/s or m/s
  double acceleration_sd = 20.0;
  double unseen_sd = k_infinity;  // rad or m: a coordinate less sure than this is held instead of carried on
};

struct FilterSettings {
  Eigen::VectorXd process_variance;  // (n,) Q of (4), added at each step, SI units squared
  Eigen::VectorXd process_density;   // (n,) continuous white noise on each element's rate, SI units squared per s; of
                                     // an acceleration: its jerk
  Eigen::VectorXd decay_rate;        // (n,) 1/s, of soft tissue, plates, contacts: 0 for a constant or a random walk
  Eigen::VectorXd marker_variance;   // (markers,) m^2 on each measured axis; infinite: the marker is not used
  Matrix6 wrench_covariance = Matrix6::Identity();  // [N, N m] about reference_point; an infinite variance: not used
  Vector3 reference_point = Vector3::Zero();        // m, ground frame
  std::optional<double> total_mass;                 // kg, measured at each frame (5); absent: no such row
  double total_mass_variance = 1e-4;                // kg^2
  Eigen::VectorXd lower, upper;                     // (n,) bounds (9), -inf/+inf where there is none
  ConstraintKind constraint = ConstraintKind::gain;
  Eigen::MatrixXd equality;        // (k, n) with projection: rows a of a x = b
  Eigen::VectorXd equality_value;  // (k,)
  GateLimits marker_gate = no_gate, wrench_gate = no_gate;
  bool wrench_needs_markers = false;   // true: a wrench is not used in a frame without a marker that is believed
  double iterate_beyond = k_infinity;  // rad or m: a larger correction of a coordinate is linearised anew
  RecoverySettings recovery;

  // Throws std::invalid_argument naming the setting, what was found and what was expected.
  void check(const Model& model) const;
};

}  // namespace dynakin
