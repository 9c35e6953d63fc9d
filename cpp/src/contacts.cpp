#include "dynakin/contacts.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace dynakin {
namespace {

Force force_of(const Vector6& w) { return {w.head<3>(), w.tail<3>()}; }

}  // namespace

ContactLoads::ContactLoads(std::size_t contacts, std::size_t states)
    : contact(contacts, Contact::none),
      wrench(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(6 * contacts))),
      covariance(Eigen::MatrixXd::Identity(wrench.size(), wrench.size())),
      effects(Eigen::MatrixXd::Zero(6, static_cast<Eigen::Index>(6 * states))) {}

ContactMoments::ContactMoments(const Model& model, std::vector<int> segments)
    : model_(model),
      segments_(std::move(segments)),
      loads_(segments_.size(), static_cast<std::size_t>(model.contacts())),
      wrench_(segments_.size(), Vector6::Zero()),
      adjustment_(wrench_),
      with_sum_(segments_.size(), Matrix6::Zero()),
      share_(with_sum_),
      remainder_(Vector6::Zero()),
      source_(model.coordinates().size(), MomentSource::measured),
      external_(model.segments().size()),
      work_(model),
      variances_(static_cast<Eigen::Index>(model.coordinates().size()), model.state_size()),
      row_covariance_(model.state_size()) {
  if (model.contacts() > contacts())
    throw std::invalid_argument("contacts: " + std::to_string(contacts()) + " segments, expected one for each of the " +
                                std::to_string(model.contacts()) + " that the model has states of");
  const int n_segments = static_cast<int>(model.segments().size());
  for (const int segment : segments_)
    if (segment < 0 || segment >= n_segments)
      throw std::invalid_argument("contacts: segment " + std::to_string(segment) + ", expected 0 to " +
                                  std::to_string(n_segments - 1));
  const auto nc = static_cast<Eigen::Index>(model.coordinates().size());
  lever_.assign(segments_.size(), Lever::Zero(nc, 6));
  common_.setZero(nc, 6);
  wrench_J_.setZero(6, model.state_size());
  J_.setZero(nc, model.state_size());
}

bool ContactMoments::distribute(const StateRef& x, const DynamicState& dynamics, const ContactLoads& loads) {
  const std::size_t n = segments_.size();
  std::copy(loads.contact.begin(), loads.contact.end(), loads_.contact.begin());
  loads_.wrench = loads.wrench;
  loads_.covariance = loads.covariance;
  loads_.effects = loads.effects;
  Vector6 missing = dynamics.wrench.vector();
  Matrix6 S = Matrix6::Zero();
  bool any = false;
  for (std::size_t i = 0; i < n; ++i) {
    with_sum_[i].setZero();
    if (!touches(i)) continue;
    any = true;
    wrench_[i] = loads_.wrench.segment<6>(static_cast<Eigen::Index>(6 * i));
    if (const int c = column(i); c != k_none) wrench_[i].noalias() += effects(i) * x.segment<6>(c);
    missing -= wrench_[i];
    for (std::size_t j = 0; j < n; ++j)
      if (touches(j)) with_sum_[i] += block(i, j);
    S += with_sum_[i];
  }
  const Eigen::LLT<Matrix6> factor(any ? S : Matrix6(Matrix6::Identity()));
  if (factor.info() != Eigen::Success) return false;
  remainder_ = missing;
  std::fill(external_.begin(), external_.end(), Force{});
  for (std::size_t i = 0; i < n; ++i) {
    adjustment_[i].setZero();
    share_[i].setZero();
    if (!touches(i)) {
      wrench_[i].setZero();
      continue;
    }
    share_[i] = factor.solve(with_sum_[i].transpose()).transpose();
    const Vector6 change = share_[i] * missing;
    wrench_[i] += change;
    remainder_ -= change;
    adjustment_[i] = wrench_[i] - loads_.wrench.segment<6>(static_cast<Eigen::Index>(6 * i));
    external_[segments_[i]] = external_[segments_[i]] + force_of(wrench_[i]);
  }
  mark_sources();
  return true;
}

void ContactMoments::mark_sources() {
  std::fill(source_.begin(), source_.end(), MomentSource::measured);
  const auto unmeasured = std::count(loads_.contact.begin(), loads_.contact.end(), Contact::unmeasured);
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    const Contact contact = loads_.contact[i];
    if (contact == Contact::none || contact == Contact::measured) continue;
    const MomentSource source =
        contact == Contact::shared || unmeasured > 1 ? MomentSource::prior : MomentSource::derived;
    for (int j = segments_[i]; j != k_none; j = model_.segments()[j].parent)
      for (int a = model_.segments()[j].first_axis; a < model_.segments()[j].end_axis; ++a) {
        MomentSource& of = source_[model_.axes()[a].coordinate];
        of = std::max(of, source);
      }
  }
}

void ContactMoments::moments(const KinematicState& state, const DynamicState& dynamics,
                             Eigen::Ref<Eigen::VectorXd> out) const {
  joint_moments(model_, state, dynamics, &external_, out);
}

void ContactMoments::levers(const KinematicState& state) {
  common_.setZero();
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    Lever& G = lever_[i];
    G.setZero();
    for (int j = segments_[i]; j != k_none; j = model_.segments()[j].parent)
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
  for (std::size_t i = 0; column(i) != k_none; ++i) {
    const int c = column(i);
    for (int k = 0; k < 6; ++k) {  // of a contact that nothing touches the states add nothing
      wrench_J_.col(c + k).setZero();
      if (!touches(i)) continue;
      wrench_J_.col(c + k) = -effects(i).col(k);
      out.col(c + k) -= lever_[i].lazyProduct(effects(i).col(k));
    }
  }
  for (const int c : model_.wrench_columns()) out.col(c) -= common_.lazyProduct(wrench_J_.col(c));
}

void ContactMoments::deviations(const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                                const Eigen::MatrixXd& P, double* moments_sd, double* wrench_sd) {
  const std::size_t n = segments_.size();
  jacobian(x, state, dynamics, J_);
  variances_(J_, P, moments_sd);
  for (std::size_t c = 0; c < source_.size(); ++c) {
    const auto row = static_cast<Eigen::Index>(c);
    for (std::size_t i = 0; i < n; ++i) {
      if (!touches(i)) continue;
      const Vector6 own = (common_.row(row) - lever_[i].row(row)).transpose();
      for (std::size_t j = 0; j < n; ++j)
        if (touches(j)) moments_sd[c] += own.dot(block(i, j) * (common_.row(row) - lever_[j].row(row)).transpose());
    }
    moments_sd[c] = std::sqrt(std::max(moments_sd[c], 0.0));
  }
  // covariance of what the state needs
  const Matrix6& needed = row_covariance_.of_states(wrench_J_, model_.wrench_columns(), P);
  for (std::size_t k = 0; k < n; ++k) {
    Eigen::Map<Vector6> sd(wrench_sd + 6 * k);
    if (!touches(k)) {
      sd.setZero();
      continue;
    }
    Matrix6 C = share_[k] * needed * share_[k].transpose() + block(k, k) - share_[k] * with_sum_[k].transpose();
    if (const int c = column(k); c != k_none) {
      Matrix6 JP = Matrix6::Zero();  // of what the state needs with the contact's states
      for (const int j : model_.wrench_columns()) JP += wrench_J_.col(j) * P.block<6, 1>(c, j).transpose();
      const Matrix6 own = effects(k), with_need = share_[k] * JP * own.transpose();
      C += with_need + with_need.transpose() + own * P.block<6, 6>(c, c) * own.transpose();
    }
    sd = C.diagonal().cwiseMax(0.0).cwiseSqrt();
  }
}

}  // namespace dynakin
