#include "dynakin/settings.hpp"

#include <Eigen/Cholesky>
#include <cmath>
#include <stdexcept>

namespace dynakin {
namespace {

[[noreturn]] void fail(const std::string& name, const std::string& message) {
  throw std::invalid_argument("filter settings: " + name + ": " + message);
}

void check_size(const std::string& name, const Eigen::VectorXd& value, Eigen::Index expected) {
  if (value.size() != expected)
    fail(name, "expected " + std::to_string(expected) + " numbers, found " + std::to_string(value.size()));
}

bool holds(const Block& block, int element) { return element >= block.offset && element < block.offset + block.size; }

}  // namespace

void FilterSettings::check(const Model& model) const {
  const int n = model.state_size();
  const auto& names = model.layout().names();
  check_size("process_variance", process_variance, n);
  check_size("process_density", process_density, n);
  check_size("decay_rate", decay_rate, n);
  check_size("marker_variance", marker_variance, static_cast<Eigen::Index>(model.markers().size()));
  check_size("lower", lower, n);
  check_size("upper", upper, n);
  for (int i = 0; i < n; ++i) {
    for (const auto& [name, value] :
         {std::pair{"process_variance", process_variance(i)}, {"process_density", process_density(i)}})
      if (!(value >= 0.0) || std::isinf(value))
        fail(name, "of '" + names[i] + "' is " + std::to_string(value) + ", expected 0 or more");
    const auto in = [&](const char* block) { return holds(model.layout().block(block), i); };
    const bool may_decay = in("soft_tissue") || in("plates") || in("contacts");
    if (!(decay_rate(i) >= 0.0) || std::isinf(decay_rate(i)) || (decay_rate(i) > 0.0 && !may_decay))
      fail("decay_rate",
           "of '" + names[i] + "' is " + std::to_string(decay_rate(i)) +
               (may_decay ? ", expected 0 or more" : ", expected 0: only soft tissue, plates and contacts decay"));
    if (!(lower(i) <= upper(i)))
      fail("bounds", "of '" + names[i] + "' are " + std::to_string(lower(i)) + " and " + std::to_string(upper(i)) +
                         ", expected lower <= upper");
  }
  for (std::size_t m = 0; m < model.markers().size(); ++m)
    if (!(marker_variance(m) > 0.0))
      fail("marker_variance",
           "of '" + model.markers()[m].name + "' is " + std::to_string(marker_variance(m)) + ", expected more than 0");
  for (int i = 0; i < 6; ++i)
    if (!(wrench_covariance(i, i) > 0.0))
      fail("wrench_covariance", "variance of component " + std::to_string(i) + " is " +
                                    std::to_string(wrench_covariance(i, i)) + ", expected more than 0");
  if (wrench_covariance.hasNaN()) fail("wrench_covariance", "holds a NaN");
  if (wrench_covariance.allFinite() && !wrench_covariance.isApprox(wrench_covariance.transpose(), 1e-12))
    fail("wrench_covariance", "is not symmetric");
  Matrix6 finite = wrench_covariance;
  for (int i = 0; i < 6; ++i) {
    if (std::isfinite(finite(i, i))) continue;
    finite.row(i).setZero();
    finite.col(i).setZero();
    finite(i, i) = 1.0;
  }
  if (Eigen::LLT<Matrix6>(finite).info() != Eigen::Success) fail("wrench_covariance", "is not positive definite");
  if (!reference_point.allFinite()) fail("reference_point", "is not finite");
  if (total_mass && !(*total_mass > 0.0 && std::isfinite(*total_mass)))
    fail("total_mass", "is " + std::to_string(*total_mass) + " kg, expected more than 0");
  if (total_mass && !(total_mass_variance > 0.0))
    fail("total_mass_variance", "is " + std::to_string(total_mass_variance) + ", expected more than 0");
  if (equality.rows() > 0 && equality.cols() != n)
    fail("equality", "expected " + std::to_string(n) + " columns, found " + std::to_string(equality.cols()));
  check_size("equality_value", equality_value, equality.rows());
  if (!equality.allFinite() || !equality_value.allFinite()) fail("equality", "is not finite");
  if (equality.rows() > 0 && constraint != ConstraintKind::projection)
    fail("equality", "needs constraint 'projection'");
  for (const GateLimits& gate : {marker_gate, wrench_gate})
    for (double limit : gate)
      if (!(limit > 0.0)) fail("gate", "is " + std::to_string(limit) + ", expected more than 0");
  if (!(iterate_beyond > 0.0))
    fail("iterate_beyond", "is " + std::to_string(iterate_beyond) + ", expected more than 0");
  const RecoverySettings& r = recovery;
  for (double value : {r.blind_s, r.fit_m, r.coordinate_sd, r.speed_sd, r.acceleration_sd})
    if (!(value > 0.0) || std::isinf(value))
      fail("recovery", "holds " + std::to_string(value) + ", expected more than 0");
  if (!(recovery.unseen_sd > 0.0))
    fail("recovery", "unseen_sd is " + std::to_string(recovery.unseen_sd) + ", expected more than 0");
}

}  // namespace dynakin
