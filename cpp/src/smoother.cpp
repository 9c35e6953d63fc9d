#include "dynakin/smoother.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "dynakin/backward_pass.hpp"

namespace dynakin {
namespace {

using clock = std::chrono::steady_clock;

std::size_t stretch_of(std::size_t frames, std::size_t asked) {
  const auto root = static_cast<std::size_t>(std::ceil(std::sqrt(static_cast<double>(frames))));
  return std::clamp<std::size_t>(asked == 0 ? root : asked, 1, std::max<std::size_t>(frames, 1));
}

double us_since(clock::time_point start) {
  return std::chrono::duration<double, std::micro>(clock::now() - start).count();
}

}  // namespace

Smoother::Smoother(Filter& filter, const Trial& trial, std::size_t stretch)
    : filter_(filter),
      trial_(trial),
      stretch_(stretch_of(trial.frames, stretch)),
      left_(trial.frames),
      checkpoints_((trial.frames + stretch_ - 1) / stretch_ + 1),
      decisions_(trial.frames),
      tape_(filter.model().state_size(), 0, filter.tape_sensors()),
      apart_(filter.model(), smoothable(filter.settings())),
      forwards_(filter.model(), filter.settings(), apart_, filter.tape_rows()),
      dependence_(apart_, filter.tape_rows()),
      measurement_(filter.model(), filter.settings()),
      backwards_(filter.model(), apart_, filter.tape_rows()),
      projection_(filter.model(), filter.settings()),
      x_(filter.state()) {}

void Smoother::forward(std::size_t first, std::size_t end, RunRecord& record, ContactRecord* contacts) {
  const Helped helped(filter_);
  filter_.record_to(&tape_);
  for (std::size_t k = first; k < end; ++k) {
    if (k % stretch_ == 0) filter_.save(checkpoints_[k / stretch_]);
    x_ = filter_.state();
    run_frames(filter_, trial_, k, k + 1, record, contacts);
    decisions_[k] = decision(k, x_);
    if (tape_.cut) restarted_ = filter_.belief();
  }
  filter_.record_to(nullptr);
  if (end == trial_.frames) filter_.save(checkpoints_.back());
}

// Of the frame on the tape; last: the state after the frame before.
Decision Smoother::decision(std::size_t k, const Eigen::VectorXd& last) const {
  Decision out;
  out.cut = tape_.cut;
  out.carried = k == 0 ? 0.0 : filter_.carried();
  out.used = tape_.used;
  if (tape_.before != predicted(k, out.carried, last)) out.before = tape_.before;
  if (tape_.linearised != tape_.before) out.linearised = tape_.linearised;
  const int n = filter_.model().state_size();
  for (int i = 0; i < n; ++i) {
    if (tape_.any_forgotten && tape_.forgotten[i]) out.forgotten.push_back(i);
    if (tape_.pulled && tape_.pull(i) != 0.0) out.pull.emplace_back(i, tape_.pull(i));
  }
  out.stirred = tape_.stirred;
  out.stirred_s = tape_.stirred_s;
  if (tape_.fell_back) out.moved = tape_.moved;
  return out;
}

Eigen::VectorXd Smoother::predicted(std::size_t k, double carried, Eigen::VectorXd x) const {
  if (k == 0) return x;
  const double dt = trial_.dt(k);
  if (carried == dt || carried > 0.0) predict_mean(filter_.model(), filter_.settings(), carried, x);
  const Eigen::VectorXd& rate = filter_.settings().decay_rate;
  if (carried < dt)
    for (Eigen::Index i = 3 * filter_.model().n_free(); i < x.size(); ++i)
      if (rate(i) != 0.0) x(i) *= std::exp(-rate(i) * (dt - carried));
  return x;
}

Eigen::Map<const Eigen::VectorXd> Smoother::state(std::size_t k, const RunRecord& record) const {
  const Eigen::Index n = filter_.model().state_size();
  return {record.state.data() + static_cast<Eigen::Index>(k) * n, n};
}

// After frame k. Needed where a frame gains nothing from later ones, which is rare: the filter goes there again.
Belief Smoother::belief_at(std::size_t k, const RunRecord& record) {
  if (k + 1 == trial_.frames) return checkpoints_.back().belief;
  if (decisions_[k].cut) return restarted_;
  filter_.restore(checkpoints_[k / stretch_]);
  WrenchModel how;
  for (std::size_t j = k / stretch_ * stretch_; j <= k; ++j) trial_.step(filter_, j, how);
  if (filter_.state() != state(k, record))
    throw std::logic_error("smoothing: frame " + std::to_string(k) + " does not repeat itself from its checkpoint");
  return filter_.belief();
}

// Up to a frame that ends a stretch. Nothing of it is found by the look back through what comes after.
void Smoother::replay(std::size_t end, const RunRecord& record, Stretch& out) {
  out.first = end - 1;
  while (out.first % stretch_ != 0 && !decisions_[out.first].cut) --out.first;
  out.last.reset();
  if (end == trial_.frames || decisions_[end].cut) {
    out.last = belief_at(end - 1, record);
    forwards_.end(*out.last);
    dependence_.end();
  }
  const bool cut = decisions_[out.first].cut;
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(filter_.model().state_size());
  for (std::size_t k = out.first + cut; k < end; ++k)
    if (decisions_[k].moved.size() > 0) moved += decisions_[k].moved;
  forwards_.start(cut ? restarted_ : checkpoints_[out.first / stretch_].belief, moved);
  while (out.frames.size() < end - out.first) out.frames.emplace_back(filter_.model());
  for (std::size_t k = out.first; k < end; ++k) {
    FrameGivenConstants* const frame = &out.frames[k - out.first];
    replay_frame(k, record, k == out.first ? nullptr : frame - 1, *frame);
  }
  dependence_.smooth({out.frames.data(), end - out.first});
  out.end = end;
}

// The filter's update once more, given the constants: its rows come from where it linearised them.
void Smoother::replay_frame(std::size_t k, const RunRecord& record, const FrameGivenConstants* last,
                            FrameGivenConstants& frame) {
  const bool cut = decisions_[k].cut;
  const Decision& decided = cut ? nothing_ : decisions_[k];
  frame.decided = &decided;
  frame.dt = trial_.dt(k);
  frame.first = k == 0 || cut;
  frame.after = state(k, record);
  if (decided.before.size() > 0)
    frame.before = decided.before;
  else if (cut)
    frame.before = frame.after;
  else
    frame.before =
        predicted(k, decided.carried, k == 0 ? checkpoints_[0].belief.x : Eigen::VectorXd(state(k - 1, record)));
  measurement_.admit_all();
  for (std::size_t b = 0; b <= filter_.model().markers().size(); ++b)
    if (cut || !decided.used[b]) measurement_.leave_out(static_cast<int>(b));
  measurement_.expect(trial_.wrench_model(k, filter_.model().contacts(), how_));
  measurement_.linearise(decided.linearised.size() > 0 ? decided.linearised : frame.before,
                         trial_.markers_at(k, filter_.model().markers().size()), trial_.wrench_at(k));
  forwards_.step(measurement_.blocks(), last, frame);
}

void Smoother::look_back(const Stretch& stretch, Reports& reports) {
  if (stretch.last) backwards_.end(*stretch.last);
  for (std::size_t k = stretch.end; k-- > stretch.first;) {
    const FrameGivenConstants* const frame = &stretch.frames[k - stretch.first];
    backwards_.look(*frame, x_);
    if (filter_.settings().constraint == ConstraintKind::projection)
      projection_.bound(x_, backwards_.covariance(), [this, frame](int i) { backwards_.complete(*frame, i); });
    reports.add(k, x_, backwards_.covariance());
    backwards_.undo(*frame, k == stretch.first ? nullptr : frame - 1);
  }
}

std::size_t Smoother::backward(const RunRecord& record, SmoothRecord& out, ContactRecord* contacts) {
  if (left_ == 0) return 0;
  const auto start = clock::now();
  if (now_.end != left_) replay(left_, record, now_);
  left_ = now_.first;
  const AtWork other(most_threads());
  Reports reports(out, contacts, static_cast<bool>(other), [this, &record] {
    if (left_ > 0) replay(left_, record, before_);
  });
  look_back(now_, reports);
  reports.end();
  const double us = us_since(start) / static_cast<double>(now_.end - now_.first);
  std::fill(out.backward_us.begin() + static_cast<std::ptrdiff_t>(now_.first),
            out.backward_us.begin() + static_cast<std::ptrdiff_t>(now_.end), us);
  if (before_.end == left_) std::swap(now_, before_);
  if (left_ == 0) filter_.restore(checkpoints_.back());
  return left_;
}

}  // namespace dynakin
