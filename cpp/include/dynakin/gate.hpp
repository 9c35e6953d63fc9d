// Which sensors to believe: innovation, its covariance, test ratio, accepted or refused.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "dynakin/measurement.hpp"
#include "dynakin/row_covariance.hpp"

namespace dynakin {

enum class Verdict : std::uint8_t { missing, accepted, refused };
const char* describe(Verdict verdict);

// What each sensor said in the last update, against what was expected of it. NaN: not measured.
struct SensorReport {
  Eigen::VectorXd innovation, innovation_sd;  // measured less predicted, sqrt(H P H' + R): 3 a marker, 6 of the plates
  Eigen::VectorXd test_ratio;  // a sensor each: normalised innovation squared over the gate's limit; 0: no gate
};

class Gate {
 public:
  explicit Gate(const Model& model);

  // Normalised innovation squared of each sensor alone, at the predicted state, against the limit for its number of
  // rows. The rows stay as they are.
  void judge(const FilterSettings& settings, const std::vector<RowBlock>& blocks, const Eigen::MatrixXd& P);
  // Takes the refusals of all markers back, or decides on a measured one, for reasons of the caller's.
  void accept_measured();
  void decide(int marker, Verdict verdict);
  // A sensor a marker, then the plates.
  const std::vector<Verdict>& verdicts() const { return verdicts_; }
  // On demand, as H P H' of all sensors takes about a tenth of a step.
  void report_sensors(bool on) { reports_ = on; }
  const SensorReport& sensors() const { return sensors_; }
  int markers_measured() const { return measured_; }
  int markers_refused() const { return refused_; }

 private:
  Verdict judge(int sensor, const RowBlock& block, const GateLimits& limits, const Eigen::MatrixXd& P);

  int n_markers_;
  int measured_ = 0, refused_ = 0;
  std::vector<Verdict> verdicts_;
  bool reports_ = false;
  SensorReport sensors_;
  RowCovariance covariance_;
};

}  // namespace dynakin
