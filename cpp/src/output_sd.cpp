#include "dynakin/output_sd.hpp"

#include <algorithm>

namespace dynakin {

OutputDeviation::OutputDeviation(const Model& model)
    : model_(model),
      slot_(marker_column_slots(model)),
      work_(model),
      row_covariance_(model.state_size()),
      moment_variances_(static_cast<Eigen::Index>(model.coordinates().size()), model.state_size()) {
  std::size_t widest = 0;
  for (std::size_t m = 0; m < model.markers().size(); ++m)
    widest = std::max(widest, model.marker_columns(static_cast<int>(m)).size());
  marker_J_.setZero(3, static_cast<Eigen::Index>(widest));
  wrench_J_.setZero(6, model.state_size());
  moment_J_.setZero(static_cast<Eigen::Index>(model.coordinates().size()), model.state_size());
}

void OutputDeviation::markers(const KinematicState& state, const Eigen::MatrixXd& P, double* out) {
  for (std::size_t m = 0; m < model_.markers().size(); ++m) {
    const auto& columns = model_.marker_columns(static_cast<int>(m));
    auto J = marker_J_.leftCols(static_cast<Eigen::Index>(columns.size()));
    marker_jacobian(model_, state, static_cast<int>(m), slot_[m], J);
    Eigen::Map<Vector3>(out + 3 * m) = row_covariance_(J, columns, P).diagonal().head<3>().cwiseMax(0.0).cwiseSqrt();
  }
}

void OutputDeviation::wrench(const KinematicState& state, const DynamicState& dynamics, const Eigen::MatrixXd& P,
                             double* out) {
  wrench_jacobian(model_, state, dynamics, wrench_J_);
  Eigen::Map<Vector6> sd(out);
  sd = row_covariance_.of_states(wrench_J_, model_.wrench_columns(), P).diagonal().cwiseMax(0.0).cwiseSqrt();
}

void OutputDeviation::moments(const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                              const Eigen::MatrixXd& P, double* out) {
  moment_jacobian(model_, x, state, dynamics, nullptr, work_, moment_J_);
  moment_variances_(moment_J_, P, out);
  for (Eigen::Index k = 0; k < moment_J_.rows(); ++k) out[k] = std::sqrt(std::max(out[k], 0.0));
}

}  // namespace dynakin
