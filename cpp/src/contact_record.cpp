#include "dynakin/contact_record.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace dynakin {

ContactRecord::ContactRecord(const Model& model, const FeetTrial& of)
    : trial(of),
      moments(model, of.segments),
      foot_wrench(of.wrench.size()),
      foot_wrench_sd(of.wrench.size()),
      foot_adjustment(of.wrench.size()),
      remainder(of.frames * 6),
      source(of.frames * model.coordinates().size()),
      loads_(of.segments.size()) {}

void ContactRecord::report(std::size_t k, const StateRef& x, const KinematicState& state, const DynamicState& dynamics,
                           const Eigen::MatrixXd* P, double* moments_out, double* moments_sd) {
  const std::size_t feet = trial.segments.size(), first = k * feet;
  for (std::size_t i = 0; i < feet; ++i) {
    loads_[i].contact = trial.contact[first + i];
    loads_[i].wrench = Eigen::Map<const Vector6>(trial.wrench.data() + 6 * (first + i));
    loads_[i].covariance = Eigen::Map<const Matrix6>(trial.covariance.data() + 36 * (first + i));
  }
  if (!moments.distribute(dynamics, loads_))
    throw std::invalid_argument("frame " + std::to_string(k) +
                                ": the covariances of the feet's wrenches do not sum to a positive definite one");
  const auto nc = static_cast<Eigen::Index>(moments.sources().size());
  moments.moments(state, dynamics, Eigen::Map<Eigen::VectorXd>(moments_out, nc));
  if (P) moments.deviations(x, state, dynamics, *P, moments_sd, foot_wrench_sd.data() + 6 * first);
  for (std::size_t i = 0; i < feet; ++i) {
    Eigen::Map<Vector6>(foot_wrench.data() + 6 * (first + i)) = moments.wrenches()[i];
    Eigen::Map<Vector6>(foot_adjustment.data() + 6 * (first + i)) = moments.adjustments()[i];
  }
  Eigen::Map<Vector6>(remainder.data() + 6 * k) = moments.remainder();
  std::transform(moments.sources().begin(), moments.sources().end(),
                 source.begin() + static_cast<std::ptrdiff_t>(k * moments.sources().size()),
                 [](MomentSource s) { return static_cast<std::uint8_t>(s); });
}

}  // namespace dynakin
