#include "dynakin/fixed_lag.hpp"

#include <stdexcept>
#include <string>

namespace dynakin {

FixedLag::FixedLag(Filter& filter, int lag)
    : filter_(filter),
      lag_(lag),
      mean_(filter.model(), filter.settings(), filter.tape_rows()),
      covariance_(filter.model(), filter.settings(), filter.tape_rows()),
      x_(filter.state()) {
  if (lag < 1) throw std::invalid_argument("lag: expected 1 frame or more, found " + std::to_string(lag));
  ring_.reserve(static_cast<std::size_t>(lag) + 1);
  for (int k = 0; k <= lag; ++k)
    ring_.push_back({0.0, filter.belief(), FrameTape(filter.model().state_size(), filter.tape_rows())});
}

void FixedLag::open(double dt) {
  ++frames_;
  Frame& now = back(0);
  now.dt = dt;
  now.tape.clear();
  filter_.record_to(&now.tape);
}

void FixedLag::close() {
  filter_.record_to(nullptr);
  back(0).filtered = filter_.belief();
}

StepReport FixedLag::step(double dt, const MarkerRef& markers, const Vector6& wrench, const WrenchModel* how) {
  const bool first = frames_ == 0;
  if (!first) filter_.predict(dt);
  open(first ? 0.0 : dt);
  StepReport report;
  try {
    report = filter_.update(markers, wrench, how);
  } catch (...) {
    close();
    throw;
  }
  close();
  if (ready() && !report.diverged()) look_back(lag_);
  return report;
}

void FixedLag::look_back(int by) {
  mean_.start();
  delay_ = 0.0;
  for (int k = 0; k < by; ++k) {
    mean_.undo(back(k).tape, back(k).dt);
    delay_ += back(k).dt;
  }
  const Belief& then = back(by).filtered;
  mean_.smooth(then, x_);
  mean_.bound(x_, then.P);
  by_ = by;
  has_covariance_ = false;
}

const Eigen::MatrixXd& FixedLag::covariance() {
  if (!has_covariance_) {
    int known = by_;  // until which frame; those after everything started again say nothing
    while (known > 0 && !back(known - 1).tape.cut) --known;
    covariance_.start(back(by_).filtered.P);
    for (int k = by_; k-- > known;) covariance_.add_frame(back(k).tape, back(k).dt, k == known);
    covariance_.end(back(known).filtered.P);
    has_covariance_ = true;
  }
  return covariance_.covariance();
}

}  // namespace dynakin
