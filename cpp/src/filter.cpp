#include "dynakin/filter.hpp"

#include <algorithm>
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
      step_(dx_),
      predicted_(Eigen::VectorXd::Zero(Measurement::channel_count(model))),
      measurement_(model_, settings_),
      gate_(model_),
      update_(model.state_size(), settings.chunk_rows, measurement_.max_rows()),
      projection_(model_, settings_) {
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
  x_ = x0_ = x_before_ = x_ahead_ = x;
  P_ = P0_ = P_before_ = P;
  unbelieved_s_ = 0.0;
  sought_s_ = shortest_step_s_ = k_infinity;
  held_ = false;
  last_ = StepReport{};
}

void Filter::predict(double dt) {
  if (!(dt >= 0.0) || !std::isfinite(dt))
    throw std::invalid_argument("dt: expected 0 s or more, found " + std::to_string(dt));
  const double carried = settings_.recovery.enabled ? carried_on(dt) : dt;
  if (carried == dt || carried > 0.0) dynakin::predict(model_, settings_, carried, step_, x_, P_);
  if (carried < dt) decay(model_, settings_, dt - carried, step_, x_, P_);
  unbelieved_s_ += dt;
  sought_s_ += dt;
}

StepReport Filter::update(const Eigen::Ref<const MarkerMatrix>& markers, const Vector6& wrench) {
  if (markers.cols() != static_cast<Eigen::Index>(model_.markers().size()))
    throw std::invalid_argument("markers: expected " + std::to_string(model_.markers().size()) + " columns, found " +
                                std::to_string(markers.cols()));
  if (markers.array().isInf().any() || wrench.array().isInf().any())
    throw std::invalid_argument("markers or wrench: infinite, expected a number, or NaN where nothing is measured");
  if (last_.diverged()) return last_;
  StepReport report;
  if (tape_) tape_->clear();
  if (held_)
    hold_motion();
  else if (settings_.recovery.enabled)
    hold_unseen();
  measurement_.admit_all();
  measurement_.linearise(x_, markers, wrench);
  predicted_ = measurement_.predicted();
  gate_.judge(settings_, measurement_.blocks(), P_);
  if (settings_.recovery.enabled) report.tracking = believe(markers);
  if (report.tracking == Tracking::following && settings_.recovery.enabled)
    report.tracking = fit(markers, wrench);
  else if (report.tracking != Tracking::found)
    sums_ = correct(markers, wrench);
  report.rows = sums_.rows;
  report.nis = sums_.nis;
  report.log_likelihood = -0.5 * (sums_.nis + sums_.log_determinant + sums_.rows * std::log(2.0 * std::numbers::pi));
  if (!sums_.factored) {
    report.status = StepStatus::innovation_not_definite;
  } else if (!dx_.allFinite() || !x_.allFinite() || !std::isfinite(sums_.nis)) {  // before a bound could hide it
    report.status = StepStatus::not_finite;
  } else {
    constrain(sums_.nis, report);
    report.status = check();
    if (report.status == StepStatus::ok && sums_.rows == 0) report.status = StepStatus::no_measurement;
  }
  if (report.broken() && settings_.recovery.enabled) {
    x_ = x0_;
    P_ = P0_;
    unbelieved_s_ = k_infinity;
    held_ = true;
    report.tracking = Tracking::restarted;
    if (tape_) tape_->cut = true;
  }
  last_ = report;
  return report;
}

void Filter::leave_out_refused() {
  const auto& verdicts = gate_.verdicts();
  for (std::size_t sensor = 0; sensor < verdicts.size(); ++sensor)
    if (verdicts[sensor] == Verdict::refused) measurement_.leave_out(static_cast<int>(sensor));
  if (settings_.wrench_needs_markers && gate_.markers_refused() == gate_.markers_measured())
    measurement_.leave_out(static_cast<int>(verdicts.size()) - 1);
}

// Largest standard deviation of the coordinates that move a marker of this frame: of others it tells nothing, however
// often it is linearised.
double Filter::uncertainty_seen() const {
  double most = 0.0;
  for (std::size_t m = 0; m < model_.markers().size(); ++m) {
    const RowBlock& block = measurement_.blocks()[m];
    if (block.rows == 0) continue;
    for (const int c : *block.columns)
      if (c < model_.n_free()) most = std::max(most, P_(c, c));
  }
  return std::sqrt(most);
}

// P is corrected and dx_ is what the state has still to take. A state that is known badly is linearised again where the
// measurements have it.
UpdateSums Filter::correct(const MarkerRef& markers, const Vector6& wrench) {
  constexpr int most_iterations = 8;
  if (uncertainty_seen() > settings_.iterate_beyond) return iterate(markers, wrench, most_iterations);
  leave_out_refused();
  return update_.apply(measurement_.blocks(), P_, dx_);
}

// Gauss-Newton steps of the one update (iterated extended Kalman filter, Bell and Cathey 1993), from a measurement that
// has been linearised at x_. The sums are those of the first step: of the innovation as it was predicted.
UpdateSums Filter::iterate(const MarkerRef& markers, const Vector6& wrench, int most) {
  constexpr double settled = 1e-3;  // rad or m: a tangent is off by about half the square of its step
  x_before_ = x_;
  P_before_ = P_;
  UpdateSums first;
  for (int k = 0;; ++k) {
    leave_out_refused();
    if (k > 0) measurement_.shift_innovations(dx_);
    step_ = dx_;
    const UpdateSums sums = update_.apply(measurement_.blocks(), P_, dx_);
    if (k == 0) {
      first = sums;
      step_.setZero();
    }
    step_ -= dx_;
    const bool done =
        !sums.factored || k + 1 == most || step_.head(model_.n_free()).lpNorm<Eigen::Infinity>() < settled;
    if (!sums.factored) first.factored = false;
    if (done) break;
    x_ = x_before_ + dx_;
    P_ = P_before_;
    measurement_.linearise(x_, markers, wrench);
  }
  x_ = x_before_;
  return first;
}

void Filter::constrain(double nis, StepReport& report) {
  if (settings_.constraint == ConstraintKind::sigmoid) {
    report.constrained = sigmoid_.apply(settings_, dx_, x_, P_);
    return;
  }
  retract(x_, dx_);
  if (settings_.constraint == ConstraintKind::gain) report.constrained = gain_.apply(settings_, nis, x_, P_);
  if (settings_.constraint == ConstraintKind::projection) {
    const ProjectionReport projected = projection_.apply(x_, P_, tape_);
    report.constrained = projected.active;
    report.constraints_met = projected.solved;
  }
}

StepStatus Filter::check() const {
  if (!x_.allFinite() || !P_.allFinite()) return StepStatus::not_finite;
  const double least = P_.diagonal().minCoeff();
  const bool may_be_sure = settings_.equality.rows() > 0;  // of an element that an equality alone decides
  if (least < 0.0 || (least == 0.0 && !may_be_sure)) return StepStatus::variance_not_positive;
  return StepStatus::ok;
}

void Filter::record_to(FrameTape* tape) {
  tape_ = tape;
  update_.record_to(tape);
}

void Filter::save(Checkpoint& out) const {
  out.x = x_;
  out.P = P_;
  projection_.save(out.projection);
  out.unbelieved_s = unbelieved_s_;
  out.sought_s = sought_s_;
  out.shortest_step_s = shortest_step_s_;
  out.held = held_;
  out.last = last_;
}

void Filter::restore(const Checkpoint& checkpoint) {
  x_ = checkpoint.x;
  P_ = checkpoint.P;
  projection_.restore(checkpoint.projection);
  unbelieved_s_ = checkpoint.unbelieved_s;
  sought_s_ = checkpoint.sought_s;
  shortest_step_s_ = checkpoint.shortest_step_s;
  held_ = checkpoint.held;
  last_ = checkpoint.last;
}

const Measurement& Filter::evaluate() {
  measurement_.evaluate(x_);
  return measurement_;
}

const Measurement& Filter::foresee(double dt) {
  x_ahead_ = x_;
  predict_mean(model_, settings_, dt, x_ahead_);
  measurement_.evaluate(x_ahead_);
  return measurement_;
}

}  // namespace dynakin
