#include "dynakin/contacts.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace dynakin {
namespace {

constexpr double k_nan = std::numeric_limits<double>::quiet_NaN();

Force force_of(const Vector6& w) { return {w.head<3>(), w.tail<3>()}; }

}  // namespace

ContactMoments::ContactMoments(const Model& model, std::vector<int> feet)
    : model_(model),
      feet_(std::move(feet)),
      loads_(feet_.size()),
      wrench_(feet_.size(), Vector6::Zero()),
      adjustment_(wrench_),
      share_(feet_.size(), Matrix6::Zero()),
      remainder_(Vector6::Zero()),
      source_(model.coordinates().size(), MomentSource::measured),
      external_(model.segments().size()),
      work_(model),
      variances_(static_cast<Eigen::Index>(model.coordinates().size()), model.state_size()) {
  const int n_segments = static_cast<int>(model.segments().size());
  for (std::size_t i = 0; i < feet_.size(); ++i) {
    if (feet_[i] < 0 || feet_[i] >= n_segments)
      throw std::invalid_argument("feet: segment " + std::to_string(feet_[i]) + ", expected 0 to " +
                                  std::to_string(n_segments - 1));
    if (std::count(feet_.begin(), feet_.end(), feet_[i]) > 1)
      throw std::invalid_argument("feet: segment '" + model.segments()[feet_[i]].name +
                                  "' is given twice, expected different ones");
  }
  const auto nc = static_cast<Eigen::Index>(model.coordinates().size());
  lever_.assign(feet_.size(), Lever::Zero(nc, 6));
  common_.setZero(nc, 6);
  wrench_J_.setZero(6, model.state_size());
  wrench_JP_ = wrench_J_;
  J_.setZero(nc, model.state_size());
}

bool ContactMoments::distribute(const DynamicState& dynamics, const std::vector<FootLoad>& loads) {
  std::copy(loads.begin(), loads.end(), loads_.begin());
  Vector6 missing = dynamics.wrench.vector();
  Matrix6 S = Matrix6::Zero();
  int measured = 0, unmeasured = 0;
  for (const FootLoad& load : loads_) {
    unmeasured += load.contact == Contact::unmeasured;
    if (load.contact != Contact::measured) continue;
    ++measured;
    missing -= load.wrench;
    S += load.covariance;
  }
  // Where one contact is not measured, it takes all that is missing; where several are, nobody knows who does.
  const bool adjusts = measured > 0 && unmeasured == 0;
  Eigen::LLT<Matrix6> factor;
  if (adjusts && factor.compute(S).info() != Eigen::Success) return false;
  remainder_ = missing;
  if (unmeasured > 1) remainder_.setConstant(k_nan);
  std::fill(external_.begin(), external_.end(), Force{});
  for (std::size_t i = 0; i < feet_.size(); ++i) {
    const Contact contact = loads_[i].contact;
    wrench_[i].setZero();
    adjustment_[i].setZero();
    share_[i].setZero();
    if (contact == Contact::measured) {
      if (adjusts) {
        share_[i] = factor.solve(loads_[i].covariance).transpose();  // R_i S^-1
        adjustment_[i] = share_[i] * missing;
      }
      wrench_[i] = loads_[i].wrench + adjustment_[i];
    } else if (contact == Contact::unmeasured) {
      share_[i].setIdentity();
      wrench_[i] = missing;
      if (unmeasured > 1) wrench_[i].setConstant(k_nan);
    }
    if (unmeasured <= 1) remainder_ -= share_[i] * missing;
    if (wrench_[i].allFinite()) external_[feet_[i]] = force_of(wrench_[i]);
  }
  mark_sources(loads_, unmeasured > 1);
  return true;
}

void ContactMoments::mark_sources(const std::vector<FootLoad>& loads, bool several) {
  std::fill(source_.begin(), source_.end(), MomentSource::measured);
  for (std::size_t i = 0; i < feet_.size(); ++i) {
    if (loads[i].contact != Contact::unmeasured) continue;
    for (int j = feet_[i]; j != k_none; j = model_.segments()[j].parent)
      for (int a = model_.segments()[j].first_axis; a < model_.segments()[j].end_axis; ++a)
        source_[model_.axes()[a].coordinate] = several ? MomentSource::unknown : MomentSource::derived;
  }
}

void ContactMoments::moments(const KinematicState& state, const DynamicState& dynamics,
                             Eigen::Ref<Eigen::VectorXd> out) const {
  joint_moments(model_, state, dynamics, &external_, out);
  for (std::size_t c = 0; c < source_.size(); ++c)
    if (source_[c] == MomentSource::unknown) out(static_cast<Eigen::Index>(c)) = k_nan;
}

void ContactMoments::levers(const KinematicState& state) {
  common_.setZero();
  for (std::size_t i = 0; i < feet_.size(); ++i) {
    Lever& G = lever_[i];
    G.setZero();
    for (int j = feet_[i]; j != k_none; j = model_.segments()[j].parent)
      for (int a = model_.segments()[j].first_axis; a < model_.segments()[j].end_axis; ++a) {
        const AxisState& axis = state.axes[a];
        auto row = G.row(model_.axes()[a].coordinate);
        row.head<3>() += axis.motion.ds_dq * axis.screw.lin.transpose();
        row.tail<3>() += axis.motion.ds_dq * axis.screw.ang.transpose();
      }
    common_.noalias() += G.lazyProduct(share_[i]);
  }
}

// The wrenches' sum follows the state: each foot takes its share of the change, and that goes off its side of the
// moments.
void ContactMoments::jacobian(const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                              Eigen::Ref<Eigen::MatrixXd> out) {
  moment_jacobian(model_, x, state, dynamics, &external_, work_, out);
  wrench_jacobian(model_, state, dynamics, wrench_J_);
  levers(state);
  for (const int c : model_.wrench_columns()) out.col(c) -= common_.lazyProduct(wrench_J_.col(c));
}

void ContactMoments::deviations(const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                                const Eigen::MatrixXd& P, double* moments_sd, double* wrench_sd) {
  jacobian(x, state, dynamics, J_);
  variances_(J_, P, moments_sd);
  for (std::size_t c = 0; c < source_.size(); ++c) {
    const auto row = static_cast<Eigen::Index>(c);
    for (std::size_t i = 0; i < feet_.size(); ++i) {
      if (loads_[i].contact != Contact::measured) continue;
      const Vector6 lever = (common_.row(row) - lever_[i].row(row)).transpose();
      moments_sd[c] += lever.dot(loads_[i].covariance * lever);
    }
    moments_sd[c] = source_[c] == MomentSource::unknown ? k_nan : std::sqrt(std::max(moments_sd[c], 0.0));
  }
  wrench_JP_.setZero();
  for (const int c : model_.wrench_columns()) wrench_JP_.noalias() += wrench_J_.col(c) * P.col(c).transpose();
  Matrix6 needed = Matrix6::Zero();  // covariance of what the state needs
  for (const int c : model_.wrench_columns()) needed.noalias() += wrench_JP_.col(c) * wrench_J_.col(c).transpose();
  for (std::size_t k = 0; k < feet_.size(); ++k) {
    Matrix6 C = share_[k] * needed * share_[k].transpose();
    for (std::size_t i = 0; i < feet_.size(); ++i) {
      if (loads_[i].contact != Contact::measured) continue;
      Matrix6 by = -share_[k];
      if (i == k) by += Matrix6::Identity();
      C += by * loads_[i].covariance * by.transpose();
    }
    Eigen::Map<Vector6> sd(wrench_sd + 6 * k);
    sd = C.diagonal().cwiseMax(0.0).cwiseSqrt();
    if (!wrench_[k].allFinite()) sd.setConstant(k_nan);
  }
}

}  // namespace dynakin
