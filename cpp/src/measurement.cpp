#include "dynakin/measurement.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

namespace dynakin {
namespace {

// A wrench at r, about the ground origin: m_O = m_r + r x f.
Matrix6 carry(const Vector3& r) {
  Matrix6 X = Matrix6::Identity();
  X.bottomLeftCorner<3, 3>() = skew(r);
  return X;
}

// Covariance of a wrench declared at r, carried to the ground origin: force noise becomes moment noise. An infinite
// variance there makes every component that depends on it infinite too; infinity times zero is zero.
Matrix6 carried(const Matrix6& R, const Vector3& r, std::array<bool, 6>& used) {
  const Matrix6 X = carry(r);
  Matrix6 finite = R;
  for (int k = 0; k < 6; ++k) {
    if (std::isfinite(R(k, k))) continue;
    finite.row(k).setZero();
    finite.col(k).setZero();
    for (int i = 0; i < 6; ++i)
      if (X(i, k) != 0.0) used[i] = false;
  }
  return X * finite * X.transpose();
}

}  // namespace

Measurement::Measurement(const Model& model, const FilterSettings& settings)
    : model_(model),
      settings_(settings),
      offset_carry_(carry(model.spec().wrench_offset_point)),
      wrench_used_(model.spec().wrench_measured),
      slot_(marker_column_slots(model)),
      wrench_scratch_(6, model.state_size()),
      kinematics_(model),
      late_kinematics_(model),
      dynamics_(model),
      late_dynamics_(model),
      late_state_(model.state_size()),
      predicted_(channel_count(model)),
      left_out_(model.markers().size() + 1) {
  declared_covariance_ = carried(settings.wrench_covariance, settings.reference_point, wrench_used_);
  wrench_model_ = {declared_covariance_, Eigen::MatrixXd::Zero(6, 6 * model.contacts())};
  wrench_scratch_.setZero();
  std::size_t widest = 0;
  for (std::size_t m = 0; m < model.markers().size(); ++m) {
    const auto& columns = model.marker_columns(static_cast<int>(m));
    widest = std::max(widest, columns.size());
    blocks_.emplace_back();
    blocks_.back().columns = &columns;
    blocks_.back().H.setZero(3, columns.size());
    max_rows_ += model.markers()[m].n_measured;
    markers_in_use_ += model.markers()[m].n_measured > 0 && std::isfinite(settings.marker_variance(m));
  }
  marker_scratch_.setZero(3, widest);
  blocks_.emplace_back();
  blocks_.back().columns = &model.wrench_columns();
  blocks_.back().H.setZero(6, model.wrench_columns().size());
  for (bool used : wrench_used_) max_rows_ += used;
  if (settings.total_mass && !model.mass_columns().empty()) {
    blocks_.emplace_back();
    blocks_.back().columns = &model.mass_columns();
    blocks_.back().H.setOnes(1, model.mass_columns().size());
    max_rows_ += 1;
  }
}

void Measurement::evaluate(const Eigen::VectorXd& x) {
  forward_kinematics(model_, x, kinematics_);
  subtree_dynamics(model_, x, kinematics_, dynamics_);
  const int n_markers = static_cast<int>(model_.markers().size());
  for (int m = 0; m < n_markers; ++m) predicted_.segment<3>(3 * m) = kinematics_.markers[m];
  auto wrench = predicted_.segment<6>(3 * n_markers);
  if (model_.delay_column() == k_none) {
    wrench = dynamics_.wrench.vector();
  } else {
    const int n = model_.n_free();
    const double d = x(model_.delay_column());
    late_state_ = x;
    late_state_.segment(0, n) += d * (0.5 * d * x.segment(2 * n, n) - x.segment(n, n));
    late_state_.segment(n, n) -= d * x.segment(2 * n, n);
    forward_kinematics(model_, late_state_, late_kinematics_);
    subtree_dynamics(model_, late_state_, late_kinematics_, late_dynamics_);
    wrench = late_dynamics_.wrench.vector();
  }
  for (int k = 0; k < 6; ++k)
    if (const int c = model_.offset_columns()[k]; c != k_none) wrench += x(c) * offset_carry_.col(k);
  if (model_.contacts() > 0)
    wrench.noalias() -= wrench_model_.effects * x.segment(model_.contact_column(0), 6 * model_.contacts());
  predicted_(3 * n_markers + 6) = dynamics_.mass;
}

void Measurement::expect(const WrenchModel* wrench) {
  if (!wrench) {
    wrench_model_.covariance = declared_covariance_;
    wrench_model_.effects.setZero();
    return;
  }
  if (wrench->effects.cols() != wrench_model_.effects.cols())
    throw std::invalid_argument("wrench model: effects of " + std::to_string(wrench->effects.cols()) +
                                " columns, expected " + std::to_string(wrench_model_.effects.cols()));
  if (!wrench->covariance.allFinite() || !wrench->effects.allFinite())
    throw std::invalid_argument("wrench model: not finite");
  wrench_model_ = *wrench;
}

void Measurement::linearise(const Eigen::VectorXd& x, const MarkerRef& markers, const Vector6& wrench) {
  evaluate(x);
  for (std::size_t m = 0; m < model_.markers().size(); ++m) marker_rows(static_cast<int>(m), markers.col(m));
  wrench_rows(wrench);
  if (blocks_.size() > model_.markers().size() + 1) mass_rows();
}

void Measurement::shift_innovations(const Eigen::VectorXd& d) {
  for (RowBlock& block : blocks_)
    for (std::size_t c = 0; c < block.columns->size(); ++c)
      block.v.head(block.rows) += block.H.col(c).head(block.rows) * d((*block.columns)[c]);
}

void Measurement::marker_rows(int marker, const Vector3& measured) {
  RowBlock& block = blocks_[marker];
  block.rows = 0;
  const double variance = settings_.marker_variance(marker);
  const Marker& site = model_.markers()[marker];
  if (std::isinf(variance) || left_out_[marker]) return;
  for (int k = 0; k < 3; ++k)
    if (site.measured[k] && std::isnan(measured(k))) return;
  auto J = marker_scratch_.leftCols(block.H.cols());
  marker_jacobian(model_, kinematics_, marker, slot_[marker], J);
  for (int k = 0; k < 3; ++k) {
    if (!site.measured[k]) continue;
    block.H.row(block.rows) = J.row(k);
    block.v(block.rows) = measured(k) - kinematics_.markers[marker](k);
    block.channel[block.rows] = 3 * marker + k;
    ++block.rows;
  }
  block.R.setZero();
  block.R.diagonal().setConstant(variance);
}

void Measurement::wrench_rows(const Vector6& measured) {
  const int n_markers = static_cast<int>(model_.markers().size());
  RowBlock& block = blocks_[n_markers];
  block.rows = 0;
  if (left_out_[n_markers]) return;
  std::array<int, 6> component{};
  for (int k = 0; k < 6; ++k)
    if (wrench_used_[k] && !std::isnan(measured(k))) component[block.rows++] = k;
  if (block.rows == 0) return;
  if (model_.delay_column() == k_none)
    wrench_jacobian(model_, kinematics_, dynamics_, wrench_scratch_);
  else
    delayed_jacobian();
  for (int k = 0; k < 6; ++k)
    if (const int c = model_.offset_columns()[k]; c != k_none) wrench_scratch_.col(c) = offset_carry_.col(k);
  if (model_.contacts() > 0)
    wrench_scratch_.middleCols(model_.contact_column(0), 6 * model_.contacts()) = -wrench_model_.effects;
  const std::vector<int>& columns = *block.columns;
  for (std::size_t c = 0; c < columns.size(); ++c)
    for (int r = 0; r < block.rows; ++r) block.H(r, c) = wrench_scratch_(component[r], columns[c]);
  const Vector6 predicted = predicted_.segment<6>(3 * n_markers);
  for (int r = 0; r < block.rows; ++r) {
    block.v(r) = measured(component[r]) - predicted(component[r]);
    block.channel[r] = 3 * n_markers + component[r];
    for (int s = 0; s < block.rows; ++s) block.R(r, s) = wrench_model_.covariance(component[r], component[s]);
  }
}

// The plates saw q - d qd + d^2/2 qdd, qd - d qdd and qdd: the chain rule through that.
void Measurement::delayed_jacobian() {
  auto& J = wrench_scratch_;
  wrench_jacobian(model_, late_kinematics_, late_dynamics_, J);
  const int n = model_.n_free(), c = model_.delay_column();
  const double d = late_state_(c);
  J.col(c).setZero();
  for (int i = 0; i < n; ++i) {
    J.col(c) -= J.col(i) * late_state_(n + i) + J.col(n + i) * late_state_(2 * n + i);
    J.col(2 * n + i) += d * (0.5 * d * J.col(i) - J.col(n + i));
    J.col(n + i) -= d * J.col(i);
  }
}

void Measurement::mass_rows() {
  RowBlock& block = blocks_.back();
  block.rows = std::isinf(settings_.total_mass_variance) ? 0 : 1;
  block.v(0) = *settings_.total_mass - dynamics_.mass;
  block.channel[0] = channel_count(model_) - 1;
  block.R(0, 0) = settings_.total_mass_variance;
}

}  // namespace dynakin
