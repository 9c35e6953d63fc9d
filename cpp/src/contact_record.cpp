#include "dynakin/contact_record.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace dynakin {

ContactRecord::ContactRecord(const Model& model, const ContactTrial& of)
    : trial(of),
      moments(model, of.segments),
      wrench(of.wrench.size()),
      wrench_sd(of.wrench.size()),
      adjustment(of.wrench.size()),
      remainder(of.frames * 6),
      source(of.frames * model.coordinates().size()),
      loads_(of.segments.size(), of.states) {
  if (static_cast<int>(of.states) != model.contacts())
    throw std::invalid_argument("contacts: effects of the states of " + std::to_string(of.states) +
                                " contacts, expected " + std::to_string(model.contacts()) + " as the model has");
}

void ContactRecord::report(std::size_t k, const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                           double* moments_out) {
  const std::size_t n = trial.segments.size(), first = k * n;
  const auto size = static_cast<Eigen::Index>(6 * n);
  std::copy_n(trial.contact.begin() + static_cast<std::ptrdiff_t>(first), n, loads_.contact.begin());
  loads_.wrench = Eigen::Map<const Eigen::VectorXd>(trial.wrench.data() + 6 * first, size);
  loads_.covariance = Eigen::Map<const Eigen::MatrixXd>(trial.covariance.data() + 36 * first * n, size, size);
  using Effects = Eigen::Matrix<double, 6, Eigen::Dynamic, Eigen::RowMajor>;
  loads_.effects = Eigen::Map<const Effects>(trial.effects.data() + 36 * trial.states * k, 6,
                                             static_cast<Eigen::Index>(6 * trial.states));
  if (!moments.distribute(x, dynamics, loads_))
    throw std::invalid_argument("frame " + std::to_string(k) +
                                ": the covariance of the sum of the contacts' wrenches is not positive definite");
  const auto nc = static_cast<Eigen::Index>(moments.sources().size());
  moments.moments(state, dynamics, Eigen::Map<Eigen::VectorXd>(moments_out, nc));
  for (std::size_t i = 0; i < n; ++i) {
    Eigen::Map<Vector6>(wrench.data() + 6 * (first + i)) = moments.wrenches()[i];
    Eigen::Map<Vector6>(adjustment.data() + 6 * (first + i)) = moments.adjustments()[i];
  }
  Eigen::Map<Vector6>(remainder.data() + 6 * k) = moments.remainder();
  std::transform(moments.sources().begin(), moments.sources().end(),
                 source.begin() + static_cast<std::ptrdiff_t>(k * moments.sources().size()),
                 [](MomentSource s) { return static_cast<std::uint8_t>(s); });
}

void ContactRecord::deviations(std::size_t k, const StateRef& x, const KinematicState& state,
                               const DynamicState& dynamics, const Eigen::MatrixXd& P, double* moments_sd) {
  moments.deviations(x, state, dynamics, P, moments_sd, wrench_sd.data() + 6 * k * trial.segments.size());
}

}  // namespace dynakin
