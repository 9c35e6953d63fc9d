#include "dynakin/filter.hpp"

#include <cmath>
#include <numbers>

namespace dynakin {
namespace {

const FilterSettings& checked(const FilterSettings& settings, const Model& model) {
  settings.check(model);
  return settings;
}

}  // namespace

const char* describe(StepStatus status) {
  switch (status) {
    case StepStatus::ok:
      return "ok";
    case StepStatus::no_measurement:
      return "nothing measured";
    case StepStatus::innovation_not_definite:
      return "the innovation covariance is not positive definite";
    case StepStatus::not_finite:
      return "the state is not finite";
    case StepStatus::variance_not_positive:
      return "a variance is not positive";
  }
  return "unknown";
}

Filter::Filter(const Model& model, const FilterSettings& settings, const Eigen::VectorXd& x0, const Eigen::MatrixXd& P0)
    : model_(model),
      settings_(checked(settings, model_)),
      dx_(Eigen::VectorXd::Zero(model.state_size())),
      predicted_(Eigen::VectorXd::Zero(Measurement::channel_count(model))),
      measurement_(model_, settings_),
      update_(model.state_size(), settings.chunk_rows, measurement_.max_rows()) {
  reset(x0, P0);
}

void Filter::reset(const Eigen::VectorXd& x, const Eigen::MatrixXd& P) {
  const int n = model_.state_size();
  if (x.size() != n)
    throw std::invalid_argument("x0: expected " + std::to_string(n) + " numbers, found " + std::to_string(x.size()));
  if (P.rows() != n || P.cols() != n)
    throw std::invalid_argument("P0: expected a " + std::to_string(n) + " x " + std::to_string(n) + " matrix, found " +
                                std::to_string(P.rows()) + " x " + std::to_string(P.cols()));
  if (!x.allFinite()) throw std::invalid_argument("x0: not finite");
  if (!P.allFinite() || !P.isApprox(P.transpose(), 1e-12)) throw std::invalid_argument("P0: not finite and symmetric");
  for (int i = 0; i < n; ++i)
    if (!(P(i, i) > 0.0))
      throw std::invalid_argument("P0: variance of '" + model_.layout().names()[i] + "' is " + std::to_string(P(i, i)) +
                                  ", expected more than 0");
  // Units differ by orders of magnitude between blocks, so definiteness is judged on the correlations.
  const Eigen::VectorXd scale = P.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlation = scale.asDiagonal() * P * scale.asDiagonal();
  if (correlation.llt().info() != Eigen::Success) throw std::invalid_argument("P0: not positive definite");
  x_ = x;
  P_ = P;
  last_ = StepReport{};
}

void Filter::predict(double dt) {
  if (!(dt >= 0.0) || !std::isfinite(dt))
    throw std::invalid_argument("dt: expected 0 s or more, found " + std::to_string(dt));
  predict_diagonal(model_, dt, settings_.process_variance, x_, P_);
}

StepReport Filter::update(const Eigen::Ref<const MarkerMatrix>& markers, const Vector6& wrench) {
  if (markers.cols() != static_cast<Eigen::Index>(model_.markers().size()))
    throw std::invalid_argument("markers: expected " + std::to_string(model_.markers().size()) + " columns, found " +
                                std::to_string(markers.cols()));
  if (markers.array().isInf().any() || wrench.array().isInf().any())
    throw std::invalid_argument("markers or wrench: infinite, expected a number, or NaN where nothing is measured");
  if (last_.diverged()) return last_;
  measurement_.linearise(x_, markers, wrench);
  predicted_ = measurement_.predicted();
  const UpdateSums sums = update_.apply(measurement_.blocks(), P_, dx_);
  retract(x_, dx_);

  StepReport report;
  report.rows = sums.rows;
  report.nis = sums.nis;
  report.log_likelihood = -0.5 * (sums.nis + sums.log_determinant + sums.rows * std::log(2.0 * std::numbers::pi));
  if (!sums.factored) {
    report.status = StepStatus::innovation_not_definite;
  } else if (!x_.allFinite() || !std::isfinite(sums.nis)) {  // asked before a bound could hide what is lost
    report.status = StepStatus::not_finite;
  } else {
    if (settings_.constraint == ConstraintKind::gain)
      report.constrained = constraint_.apply(settings_, sums.nis, x_, P_);
    report.status = check();
    if (report.status == StepStatus::ok && sums.rows == 0) report.status = StepStatus::no_measurement;
  }
  last_ = report;
  return report;
}

StepStatus Filter::check() const {
  if (!x_.allFinite() || !P_.allFinite()) return StepStatus::not_finite;
  if ((P_.diagonal().array() <= 0.0).any()) return StepStatus::variance_not_positive;
  return StepStatus::ok;
}

const Measurement& Filter::evaluate() {
  measurement_.evaluate(x_);
  return measurement_;
}

}  // namespace dynakin
