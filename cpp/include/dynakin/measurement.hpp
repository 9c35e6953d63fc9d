// The measurements (5) as row blocks: few rows, a fixed list of columns, a small dense matrix; no dense H.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "dynakin/dynamics.hpp"
#include "dynakin/settings.hpp"

namespace dynakin {

using MarkerMatrix = Eigen::Matrix<double, 3, Eigen::Dynamic>;  // a column a marker, m, ground frame; NaN missing
using MarkerRef = Eigen::Ref<const MarkerMatrix>;

// One sensor's rows. `channel` numbers a row among all channels of the model: 3 a marker, 6 wrench components, total
// mass.
struct RowBlock {
  const std::vector<int>* columns = nullptr;
  Eigen::MatrixXd H;              // (capacity rows, columns)
  Eigen::Matrix<double, 6, 1> v;  // innovation
  Matrix6 R;
  std::array<int, 6> channel{};
  int rows = 0;  // of these, how many are measured in this frame
};

// How the total wrench of a frame is measured, where what bears the person changes from frame to frame: about the
// ground origin, measured = body's wrench - effects * (states of the contacts) + white errors.
struct WrenchModel {
  Matrix6 covariance;                                // of the white errors, positive definite
  Eigen::Matrix<double, 6, Eigen::Dynamic> effects;  // (6, 6 contacts) of the model
};

class Measurement {
 public:
  Measurement(const Model& model, const FilterSettings& settings);

  static int channel_count(const Model& model) { return 3 * static_cast<int>(model.markers().size()) + 7; }
  int max_rows() const { return max_rows_; }
  // Markers of which the recording measures something, with finite noise.
  int markers_in_use() const { return markers_in_use_; }
  const std::vector<RowBlock>& blocks() const { return blocks_; }
  // Takes a sensor's rows out of this frame, a marker's or with n_markers the plates': also when it is linearised anew,
  // until all are admitted again.
  void leave_out(int sensor) {
    left_out_[sensor] = 1;
    blocks_[sensor].rows = 0;
  }
  void admit_all() { std::fill(left_out_.begin(), left_out_.end(), 0); }
  // v + H d: innovations as seen from a state that lies d before the one of the last linearise().
  void shift_innovations(const Eigen::VectorXd& d);
  // z predicted at the state of the last evaluate(), all channels (also those that are not measured). Its wrench is
  // what the plates should say: late by their delay, with their slow error; dynamics().wrench is the body's own.
  const Eigen::VectorXd& predicted() const { return predicted_; }
  const KinematicState& kinematics() const { return kinematics_; }
  const DynamicState& dynamics() const { return dynamics_; }

  // Kinematics, dynamics and h(x), no derivatives.
  void evaluate(const Eigen::VectorXd& x);
  // For the frames to come; nullptr: the covariance is the settings', and the contacts' states have no effect. Throws
  // std::invalid_argument for a model of other contacts, or numbers that are not finite.
  void expect(const WrenchModel* wrench);
  // Fills the blocks for what this frame measures. wrench: ground on person, about the ground origin; NaN missing.
  void linearise(const Eigen::VectorXd& x, const MarkerRef& markers, const Vector6& wrench);

 private:
  void marker_rows(int marker, const Vector3& measured);
  void wrench_rows(const Vector6& measured);
  void delayed_jacobian();
  void mass_rows();

  const Model& model_;
  const FilterSettings& settings_;
  Matrix6 declared_covariance_;  // of the settings, about the ground origin
  Matrix6 offset_carry_;         // takes the plates' slow error there
  WrenchModel wrench_model_;
  std::array<bool, 6> wrench_used_{};
  std::vector<std::vector<int>> slot_;  // a marker: state column -> place in its list
  MarkerMatrix marker_scratch_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> wrench_scratch_;
  KinematicState kinematics_, late_kinematics_;
  DynamicState dynamics_, late_dynamics_;
  Eigen::VectorXd late_state_;  // as it was when the plates measured; used where their delay is estimated
  Eigen::VectorXd predicted_;
  std::vector<RowBlock> blocks_;
  std::vector<char> left_out_;  // a sensor each
  int max_rows_ = 0, markers_in_use_ = 0;
};

}  // namespace dynakin
