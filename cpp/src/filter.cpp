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
  static constexpr const char* words[] = {"ok", "nothing measured",
                                          "the innovation covariance is not positive definite",
                                          "the state is not finite", "a variance is not positive"};
  return words[static_cast<int>(status)];
}

Filter::Filter(const Model& model, const FilterSettings& settings, const Eigen::VectorXd& x0, const Eigen::MatrixXd& P0)
    : model_(model),
      settings_(checked(settings, model_)),
      correction_(model_, settings_),
      recovery_(correction_),
      projection_(model_, settings_),
      predicted_(Eigen::VectorXd::Zero(Measurement::channel_count(model))) {
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
  projection_.forget();
  correction_.now = {x, P};
  recovery_.start();
  last_ = StepReport{};
}

void Filter::predict(double dt) {
  if (!(dt >= 0.0) || !std::isfinite(dt))
    throw std::invalid_argument("dt: expected 0 s or more, found " + std::to_string(dt));
  auto& [x, P] = correction_.now;
  const double carried = recovery_.carry_on(dt);
  if (carried == dt || carried > 0.0) dynakin::predict(model_, settings_, carried, correction_.scratch, x, P);
  if (carried < dt) decay(model_, settings_, dt - carried, correction_.scratch, x, P);
}

StepReport Filter::update(const MarkerRef& markers, const Vector6& wrench, const WrenchModel* how) {
  if (markers.cols() != static_cast<Eigen::Index>(model_.markers().size()))
    throw std::invalid_argument("markers: expected " + std::to_string(model_.markers().size()) + " columns, found " +
                                std::to_string(markers.cols()));
  if (markers.array().isInf().any() || wrench.array().isInf().any())
    throw std::invalid_argument("markers or wrench: infinite, expected a number, or NaN where nothing is measured");
  if (last_.diverged()) return last_;
  StepReport report;
  if (correction_.tape) correction_.tape->clear();
  recovery_.hold();
  correction_.measurement.expect(how);
  correction_.measure(markers, wrench);
  predicted_ = correction_.measurement.predicted();
  report.tracking = recovery_.correct(markers, wrench);
  if (FrameTape* tape = correction_.tape; tape && tape->records_update()) {
    tape->before = state();
    const auto& blocks = correction_.measurement.blocks();
    for (std::size_t b = 0; b < blocks.size(); ++b) tape->used[b] = blocks[b].rows > 0;
  }
  const UpdateSums& sums = correction_.sums;
  report.rows = sums.rows;
  report.nis = sums.nis;
  report.log_likelihood = -0.5 * (sums.nis + sums.log_determinant + sums.rows * std::log(2.0 * std::numbers::pi));
  if (!sums.factored) {
    report.status = StepStatus::innovation_not_definite;
  } else if (!correction_.dx.allFinite() || !state().allFinite() || !std::isfinite(sums.nis)) {
    report.status = StepStatus::not_finite;  // before a bound could hide it
  } else {
    constrain(report);
    report.status = check();
    if (report.status == StepStatus::ok && sums.rows == 0) report.status = StepStatus::no_measurement;
  }
  if (report.broken() && settings_.recovery.enabled) {
    recovery_.restart();
    report.tracking = Tracking::restarted;
  }
  last_ = report;
  return report;
}

void Filter::constrain(StepReport& report) {
  auto& [x, P] = correction_.now;
  if (settings_.constraint == ConstraintKind::sigmoid) {
    report.constrained = sigmoid_.apply(settings_, correction_.dx, x, P);
    return;
  }
  retract(x, correction_.dx);
  if (settings_.constraint == ConstraintKind::gain) report.constrained = gain_.apply(settings_, report.nis, x, P);
  if (settings_.constraint == ConstraintKind::projection) {
    const ProjectionReport projected = projection_.apply(x, P, correction_.tape);
    report.constrained = projected.active;
    report.constraints_met = projected.solved;
  }
}

StepStatus Filter::check() const {
  // What is not finite off the diagonal of P - Z Z' is not finite on it.
  if (!state().allFinite() || !covariance().diagonal().allFinite()) return StepStatus::not_finite;
  const double least = covariance().diagonal().minCoeff();
  const bool may_be_sure = settings_.equality.rows() > 0;  // of an element that an equality alone decides
  if (least < 0.0 || (least == 0.0 && !may_be_sure)) return StepStatus::variance_not_positive;
  return StepStatus::ok;
}

void Filter::save(Checkpoint& out) const {
  out.belief = correction_.now;
  projection_.save(out.projection);
  out.recovery = recovery_.memory();
  out.last = last_;
}

void Filter::restore(const Checkpoint& checkpoint) {
  correction_.now = checkpoint.belief;
  projection_.restore(checkpoint.projection);
  recovery_.restore(checkpoint.recovery);
  last_ = checkpoint.last;
}

const Measurement& Filter::evaluate() {
  correction_.measurement.evaluate(state());
  return correction_.measurement;
}

const Measurement& Filter::foresee(double dt) {
  correction_.scratch = state();
  predict_mean(model_, settings_, dt, correction_.scratch);
  correction_.measurement.evaluate(correction_.scratch);
  return correction_.measurement;
}

}  // namespace dynakin
