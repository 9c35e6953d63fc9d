#include "dynakin/smoother.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>

namespace dynakin {
namespace {

std::size_t stretch_of(std::size_t frames, std::size_t asked) {
  const auto root = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(frames))));
  return std::clamp<std::size_t>(asked == 0 ? root : asked, 1, std::max<std::size_t>(frames, 1));
}

}  // namespace

Smoother::Smoother(Filter& filter, const Trial& trial, std::size_t stretch)
    : filter_(filter),
      trial_(trial),
      stretch_(stretch_of(trial.frames, stretch)),
      left_(trial.frames),
      checkpoints_((trial.frames + stretch_ - 1) / stretch_ + 1),
      pass_(filter.model(), filter.settings(), filter.tape_rows(), true),
      kinematics_(filter.model()),
      dynamics_(filter.model()) {
  pass_.start();
}

void Smoother::forward(std::size_t first, std::size_t end, RunRecord& record, ContactRecord* contacts) {
  while (first < end) {
    if (first % stretch_ == 0) filter_.save(checkpoints_[first / stretch_]);
    const std::size_t next = std::min(end, (first / stretch_ + 1) * stretch_);
    run_frames(filter_, trial_, first, next, record, contacts);
    first = next;
  }
  if (end == trial_.frames) filter_.save(checkpoints_.back());
}

// The same steps once more from their checkpoint, taped.
void Smoother::replay(std::size_t first, std::size_t end, const RunRecord& record) {
  const Model& model = filter_.model();
  const auto n = static_cast<std::size_t>(model.state_size());
  while (replayed_.size() < end - first) replayed_.push_back({{}, FrameTape(model.state_size(), filter_.tape_rows())});
  filter_.restore(checkpoints_[first / stretch_]);
  filter_.report_sensors(false);
  WrenchModel how;
  for (std::size_t k = first; k < end; ++k) {
    Frame& frame = replayed_[k - first];
    filter_.record_to(&frame.tape);
    trial_.step(filter_, k, how);
    frame.filtered = filter_.belief();
    const Eigen::VectorXd& x = frame.filtered.x;
    if (!std::equal(x.begin(), x.end(), record.state.begin() + static_cast<std::ptrdiff_t>(k * n)))
      throw std::logic_error("smoothing: frame " + std::to_string(k) + " does not repeat itself from its checkpoint");
  }
  filter_.record_to(nullptr);
  filter_.report_sensors(true);
}

std::size_t Smoother::backward(const RunRecord& record, SmoothRecord& out, ContactRecord* contacts) {
  using clock = std::chrono::steady_clock;
  if (left_ == 0) return 0;
  const std::size_t first = (left_ - 1) / stretch_ * stretch_;
  replay(first, left_, record);
  for (std::size_t k = left_; k-- > first;) {
    const Frame& frame = replayed_[k - first];
    const auto start = clock::now();
    pass_.smooth(frame.filtered.x, frame.filtered.P, smoothed_.x);
    pass_.smooth(frame.filtered.P, smoothed_.P);
    pass_.bound(smoothed_.x, smoothed_.P);
    forward_kinematics(filter_.model(), smoothed_.x, kinematics_);
    subtree_dynamics(filter_.model(), smoothed_.x, kinematics_, dynamics_);
    out.report(k, smoothed_.x, smoothed_.P, kinematics_, dynamics_, contacts);
    pass_.undo(frame.tape, trial_.dt(k));
    out.backward_us[k] = std::chrono::duration<double, std::micro>(clock::now() - start).count();
  }
  left_ = first;
  if (left_ == 0) filter_.restore(checkpoints_.back());
  return left_;
}

}  // namespace dynakin
