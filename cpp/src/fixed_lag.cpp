#include "dynakin/fixed_lag.hpp"

#include <stdexcept>
#include <string>

namespace dynakin {

FixedLag::FixedLag(Filter& filter, int lag, bool deviations)
    : filter_(filter),
      lag_(lag),
      deviations_(deviations),
      pass_(filter.model(), filter.settings(), filter.tape_rows(), deviations),
      x_(filter.state()) {
  if (lag < 1) throw std::invalid_argument("lag: expected 1 frame or more, found " + std::to_string(lag));
  if (deviations) P_ = filter.covariance();
  ring_.reserve(static_cast<std::size_t>(lag) + 1);
  for (int k = 0; k <= lag; ++k)
    ring_.push_back({0.0, filter.belief(), FrameTape(filter.model().state_size(), filter.tape_rows())});
}

// A frame that is refused counts as one in which nothing was measured.
StepReport FixedLag::record(Frame& now, double dt, const MarkerRef& markers, const Vector6& wrench,
                            const WrenchModel* how) {
  const auto keep = [&] {
    filter_.record_to(nullptr);
    now.dt = dt;
    now.filtered = filter_.belief();
  };
  now.tape.clear();
  filter_.record_to(&now.tape);
  try {
    const StepReport report = filter_.update(markers, wrench, how);
    keep();
    return report;
  } catch (...) {
    keep();
    throw;
  }
}

StepReport FixedLag::step(double dt, const MarkerRef& markers, const Vector6& wrench, const WrenchModel* how) {
  const bool first = frames_ == 0;
  if (!first) filter_.predict(dt);
  ++frames_;
  const StepReport report = record(back(0), first ? 0.0 : dt, markers, wrench, how);
  if (!ready() || report.diverged()) return report;

  pass_.start();
  delay_ = 0.0;
  for (int by = 0; by < lag_; ++by) {
    pass_.undo(back(by).tape, back(by).dt);
    delay_ += back(by).dt;
  }
  const Belief& then = back(lag_).filtered;
  pass_.smooth(then.x, then.P, x_);
  if (deviations_) pass_.smooth(then.P, P_);
  pass_.bound(x_, deviations_ ? P_ : then.P);
  return report;
}

}  // namespace dynakin
