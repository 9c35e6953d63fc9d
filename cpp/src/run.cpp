#include "dynakin/run.hpp"

#include <algorithm>
#include <chrono>
#include <string>

namespace dynakin {

namespace {

StepReport step(Filter& filter, double dt, const Eigen::Map<const MarkerMatrix>& markers, const Vector6& wrench,
                std::size_t frame) {
  try {
    if (frame > 0) filter.predict(dt);
    return filter.update(markers, wrench);
  } catch (const std::invalid_argument& e) {
    throw std::invalid_argument("frame " + std::to_string(frame) + ": " + e.what());
  }
}

}  // namespace

RunRecord::RunRecord(const Model& model, std::size_t frames, bool output_sd)
    : state(frames * model.state_size()),
      state_sd(state.size()),
      markers_predicted(frames * 3 * model.markers().size()),
      markers_estimated(markers_predicted.size()),
      wrench_predicted(frames * 6),
      wrench_estimated(frames * 6),
      moments(frames * model.coordinates().size()),
      markers_sd(output_sd ? markers_estimated.size() : 0),
      wrench_sd(output_sd ? frames * 6 : 0),
      moments_sd(output_sd ? moments.size() : 0),
      nis(frames),
      log_likelihood(frames),
      step_us(frames),
      rows(frames),
      constrained(frames),
      verdicts(frames * (model.markers().size() + 1)),
      tracking(frames),
      constraints_met(frames) {
  if (output_sd) deviation.emplace(model);
}

void run_frames(Filter& filter, const double* time, const double* markers, const double* wrench, std::size_t first,
                std::size_t end, RunRecord& record, ContactRecord* contacts) {
  using clock = std::chrono::steady_clock;
  const Model& model = filter.model();
  const auto n = static_cast<std::size_t>(model.state_size());
  const std::size_t m = 3 * model.markers().size();
  const std::size_t nc = model.coordinates().size();
  for (std::size_t k = first; k < end; ++k) {
    const Eigen::Map<const MarkerMatrix> z(markers + k * m, 3, m / 3);
    const Vector6 w = Eigen::Map<const Vector6>(wrench + 6 * k);
    const auto start = clock::now();
    const StepReport report = step(filter, k == 0 ? 0.0 : time[k] - time[k - 1], z, w, k);
    record.step_us[k] = std::chrono::duration<double, std::micro>(clock::now() - start).count();
    if (report.diverged())
      throw DivergenceError("the filter diverged at frame " + std::to_string(k) + " (" + std::to_string(time[k]) +
                            " s): " + describe(report.status));
    record.nis[k] = report.nis;
    record.log_likelihood[k] = report.log_likelihood;
    record.rows[k] = report.rows;
    record.constrained[k] = report.constrained;
    record.tracking[k] = static_cast<std::uint8_t>(report.tracking);
    record.constraints_met[k] = report.constraints_met;
    std::transform(filter.verdicts().begin(), filter.verdicts().end(),
                   record.verdicts.begin() + static_cast<std::ptrdiff_t>(k * filter.verdicts().size()),
                   [](Verdict verdict) { return static_cast<std::uint8_t>(verdict); });
    std::copy_n(filter.predicted().data(), m, record.markers_predicted.data() + k * m);
    std::copy_n(filter.predicted().data() + m, 6, record.wrench_predicted.data() + 6 * k);
    Eigen::Map<Eigen::VectorXd>(record.state.data() + k * n, n) = filter.state();
    Eigen::Map<Eigen::VectorXd>(record.state_sd.data() + k * n, n) = filter.covariance().diagonal().cwiseSqrt();
    const Measurement& now = filter.evaluate();
    std::copy_n(now.predicted().data(), m, record.markers_estimated.data() + k * m);
    Eigen::Map<Vector6>(record.wrench_estimated.data() + 6 * k) = now.dynamics().wrench.vector();
    const Eigen::MatrixXd& P = filter.covariance();
    if (contacts)
      contacts->report(k, filter.state(), now.kinematics(), now.dynamics(), record.deviation ? &P : nullptr,
                       record.moments.data() + k * nc, record.moments_sd.data() + (record.deviation ? k * nc : 0));
    else
      joint_moments(model, now.kinematics(), now.dynamics(), nullptr,
                    Eigen::Map<Eigen::VectorXd>(record.moments.data() + k * nc, nc));
    if (!record.deviation) continue;
    record.deviation->markers(now.kinematics(), P, record.markers_sd.data() + k * m);
    record.deviation->wrench(now.kinematics(), now.dynamics(), P, record.wrench_sd.data() + 6 * k);
    if (!contacts)
      record.deviation->moments(filter.state(), now.kinematics(), now.dynamics(), P, record.moments_sd.data() + k * nc);
  }
}

}  // namespace dynakin
