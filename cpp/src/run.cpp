#include "dynakin/run.hpp"

#include <algorithm>
#include <chrono>
#include <string>

namespace dynakin {

namespace {

// States from which a share of an update takes longer than to wake who does it.
constexpr int k_worth_sharing = 200;

StepReport step(Filter& filter, const Trial& trial, std::size_t frame, WrenchModel& how) {
  try {
    return trial.step(filter, frame, how);
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument("frame " + std::to_string(frame) + ": " + e.what());
  }
}

}  // namespace

StateRecord::StateRecord(const Model& of, std::size_t frames, Said what)
    : model(of),
      said(what),
      state(frames * model.state_size()),
      state_sd(state.size()),
      markers(said == Said::state ? 0 : frames * 3 * model.markers().size()),
      markers_sd(said == Said::deviations ? markers.size() : 0),
      wrench(said == Said::state ? 0 : frames * 6),
      wrench_sd(said == Said::deviations ? wrench.size() : 0),
      moments(said == Said::state ? 0 : frames * model.coordinates().size()),
      moments_sd(said == Said::deviations ? moments.size() : 0),
      waiting(said == Said::deviations ? 8 : 0),
      kinematics_(of),
      dynamics_(of) {
  if (said == Said::deviations) deviation.emplace(model);
}

void StateRecord::report(std::size_t k, const Eigen::VectorXd& x, const Eigen::MatrixXd& P, ContactRecord* contacts,
                         Helper* helper) {
  const std::size_t n = x.size(), m = kinematics_.markers.size(), nc = model.coordinates().size();
  Eigen::Map<Eigen::VectorXd>(state.data() + k * n, x.size()) = x;
  Eigen::Map<Eigen::VectorXd>(state_sd.data() + k * n, x.size()) = P.diagonal().cwiseMax(0.0).cwiseSqrt();
  if (said == Said::state) return;
  forward_kinematics(model, x, kinematics_);
  subtree_dynamics(model, x, kinematics_, dynamics_);
  for (std::size_t i = 0; i < m; ++i) Eigen::Map<Vector3>(markers.data() + 3 * (k * m + i)) = kinematics_.markers[i];
  Eigen::Map<Vector6>(wrench.data() + 6 * k) = dynamics_.wrench.vector();
  double* const moment = moments.data() + k * nc;
  if (contacts)
    contacts->report(k, x, kinematics_, dynamics_, moment);
  else
    joint_moments(model, kinematics_, dynamics_, nullptr, Eigen::Map<Eigen::VectorXd>(moment, nc));
  if (!deviation) return;
  const auto deviations = [&](int of_moments) {
    double* const moment_sd = moments_sd.data() + k * nc;
    if (!of_moments) {
      deviation->markers(kinematics_, P, markers_sd.data() + 3 * k * m);
      deviation->wrench(kinematics_, dynamics_, P, wrench_sd.data() + 6 * k);
    } else if (contacts) {
      contacts->deviations(k, x, kinematics_, dynamics_, P, moment_sd);
    } else {
      deviation->moments(x, kinematics_, dynamics_, P, moment_sd);
    }
  };
  if (helper) return helper->share(2, deviations);
  for (const int of_moments : {1, 0}) deviations(of_moments);
}

RunRecord::RunRecord(const Model& of, std::size_t frames, Said what, bool of_sensors)
    : StateRecord(of, frames, what),
      sensors(of_sensors),
      markers_predicted(sensors ? frames * 3 * of.markers().size() : 0),
      wrench_predicted(sensors ? frames * 6 : 0),
      innovation(markers_predicted.size() + wrench_predicted.size()),
      innovation_sd(innovation.size()),
      test_ratio(sensors ? frames * (of.markers().size() + 1) : 0),
      nis(frames),
      log_likelihood(frames),
      step_us(frames),
      rows(frames),
      constrained(frames),
      verdicts(frames * (of.markers().size() + 1)),
      tracking(frames),
      constraints_met(frames),
      at_limit(frames * static_cast<std::size_t>(of.n_free())) {}

namespace {

// Smoothed, such a coordinate lies inside: later frames pull at it, and skin takes what it may not have.
void note_limits(const Filter& filter, std::uint8_t* held, Eigen::Index coordinates) {
  const auto x = filter.state().head(coordinates).array();
  const auto &lower = filter.settings().lower, &upper = filter.settings().upper;
  for (Eigen::Index i = 0; i < coordinates; ++i) held[i] = x(i) <= lower(i) || x(i) >= upper(i);
}

}  // namespace

Helped::Helped(Filter& filter)
    : filter_(filter), other_(most_threads()), helper_(other_ && filter.model().state_size() >= k_worth_sharing) {
  filter_.share_with(&helper_);
}

void run_frames(Filter& filter, const Trial& trial, std::size_t first, std::size_t end, RunRecord& record,
                ContactRecord* contacts) {
  using clock = std::chrono::steady_clock;
  const std::size_t m = 3 * filter.model().markers().size();
  const int n_free = filter.model().n_free();
  filter.report_sensors(record.sensors);
  WrenchModel how;
  std::optional<Helped> helped;
  if (end - first > 1) helped.emplace(filter);  // else whoever goes frame by frame sees to that
  for (std::size_t k = first; k < end; ++k) {
    const auto start = clock::now();
    const StepReport report = step(filter, trial, k, how);
    record.step_us[k] = std::chrono::duration<double, std::micro>(clock::now() - start).count();
    if (report.diverged())
      throw DivergenceError("the filter diverged at frame " + std::to_string(k) + " (" + std::to_string(trial.time[k]) +
                            " s): " + describe(report.status));
    record.nis[k] = report.nis;
    record.log_likelihood[k] = report.log_likelihood;
    record.rows[k] = report.rows;
    record.constrained[k] = report.constrained;
    record.tracking[k] = static_cast<std::uint8_t>(report.tracking);
    record.constraints_met[k] = report.constraints_met;
    note_limits(filter, record.at_limit.data() + k * static_cast<std::size_t>(n_free), n_free);
    std::transform(filter.verdicts().begin(), filter.verdicts().end(),
                   record.verdicts.begin() + static_cast<std::ptrdiff_t>(k * filter.verdicts().size()),
                   [](Verdict verdict) { return static_cast<std::uint8_t>(verdict); });
    if (record.sensors) {
      std::copy_n(filter.predicted().data(), m, record.markers_predicted.data() + k * m);
      std::copy_n(filter.predicted().data() + m, 6, record.wrench_predicted.data() + 6 * k);
      const auto keep = [k](const Eigen::VectorXd& numbers, std::vector<double>& all) {
        std::copy(numbers.begin(), numbers.end(), all.begin() + static_cast<std::ptrdiff_t>(k) * numbers.size());
      };
      keep(filter.sensors().innovation, record.innovation);
      keep(filter.sensors().innovation_sd, record.innovation_sd);
      keep(filter.sensors().test_ratio, record.test_ratio);
    }
    record.report(k, filter.state(), filter.covariance(), contacts, helped ? &helped->helper() : nullptr);
  }
}

}  // namespace dynakin
