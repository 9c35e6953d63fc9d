#include "dynakin/score.hpp"

#include <algorithm>
#include <cmath>

namespace dynakin {
namespace {

using Frame = Eigen::Map<const MarkerMatrix>;

void add(double measured, double said, std::size_t channel, ChannelSums& sums) {
  if (std::isnan(measured)) return;
  const double d = measured - said;
  sums.squares[channel] += d * d;
  ++sums.counts[channel];
}

void add_markers(const Model& model, const Frame& measured, const double* said, ChannelSums& sums) {
  for (std::size_t m = 0; m < model.markers().size(); ++m)
    for (std::size_t k = 0; k < 3; ++k)
      if (model.markers()[m].measured[k]) add(measured(k, m), said[3 * m + k], 3 * m + k, sums);
}

void add_wrench(const Model& model, const double* measured, const Vector6& said, ChannelSums& sums) {
  const std::size_t first = 3 * model.markers().size();
  for (std::size_t k = 0; k < 6; ++k)
    if (model.spec().wrench_measured[k]) add(measured[k], said(k), first + k, sums);
}

// RMS distance, m, over the markers that were measured; NaN without any.
double distance(const Model& model, const Frame& measured, const double* said) {
  double squares = 0.0;
  int markers = 0;
  for (std::size_t m = 0; m < model.markers().size(); ++m) {
    double one = 0.0;
    for (std::size_t k = 0; k < 3; ++k)
      if (model.markers()[m].measured[k]) one += std::pow(measured(k, m) - said[3 * m + k], 2);
    if (std::isnan(one)) continue;
    squares += one;
    ++markers;
  }
  return std::sqrt(squares / markers);
}

}  // namespace

Score::Score(const Model& model, std::size_t frames, const ScoreOptions& options)
    : estimated(3 * model.markers().size() + 6),
      predicted(estimated),
      ahead(estimated),
      state(options.trace ? frames * model.state_size() : 0, std::nan("")),
      moments(options.trace ? frames * model.coordinates().size() : 0, std::nan("")) {}

Score score_trial(Filter& filter, const Trial& trial, const ScoreOptions& options) {
  const Model& model = filter.model();
  const std::size_t n_markers = model.markers().size(), m = 3 * n_markers, n = model.state_size(),
                    nc = model.coordinates().size();
  const std::size_t end = std::min(trial.frames, options.end);
  Score score(model, trial.frames, options);
  int lost = 0;
  WrenchModel how;
  for (std::size_t k = 0; k < end; ++k) {
    const Frame z = trial.markers_at(k, n_markers);
    const double* w = trial.wrench + 6 * k;
    const StepReport report = trial.step(filter, k, how);
    if (report.diverged()) {
      score.divergence = describe(report.status);
      return score;
    }
    ++score.done;
    const Measurement& now = filter.evaluate();
    const double off = distance(model, z, now.predicted().data());
    lost = off > options.lost_m ? lost + 1 : 0;
    if (lost >= options.lost_frames) {
      score.divergence = "the markers are lost";
      return score;
    }
    if (options.trace) {
      std::copy_n(filter.state().data(), n, score.state.data() + k * n);
      joint_moments(model, now.kinematics(), now.dynamics(), nullptr,
                    Eigen::Map<Eigen::VectorXd>(score.moments.data() + k * nc, static_cast<Eigen::Index>(nc)));
    }
    if (k >= options.first) {
      add_markers(model, z, now.predicted().data(), score.estimated);
      add_wrench(model, w, now.dynamics().wrench.vector(), score.estimated);
      add_markers(model, z, filter.predicted().data(), score.predicted);
      add_wrench(model, w, filter.predicted().segment<6>(static_cast<Eigen::Index>(m)), score.predicted);
      score.nis += report.nis;
      score.log_likelihood += report.log_likelihood;
      score.rows += static_cast<std::size_t>(report.rows);
      score.refused +=
          static_cast<std::size_t>(std::count(filter.verdicts().begin(), filter.verdicts().end(), Verdict::refused));
      ++score.counted;
    }
    const std::size_t then = k + options.ahead;
    if (options.ahead == 0 || then < options.first || then >= end) continue;
    const Measurement& foreseen = filter.foresee(trial.time[then] - trial.time[k]);
    add_markers(model, trial.markers_at(then, n_markers), foreseen.predicted().data(), score.ahead);
    add_wrench(model, trial.wrench + 6 * then, foreseen.dynamics().wrench.vector(), score.ahead);
  }
  return score;
}

}  // namespace dynakin
