// How a filter loses and finds its motion again: the part of Filter that seldom runs.
#include <cmath>

#include "dynakin/filter.hpp"

namespace dynakin {

const char* describe(Tracking tracking) {
  switch (tracking) {
    case Tracking::following:
      return "following";
    case Tracking::doubtful:
      return "doubtful";
    case Tracking::lost:
      return "lost";
    case Tracking::found:
      return "found";
    case Tracking::restarted:
      return "restarted";
  }
  return "unknown";
}

// Believes a frame if at most half of its markers are refused. Where that has not been so for longer than blind_s, the
// markers may be right and the motion wrong: it is held, and sought from the markers alone. A motion that is held is so
// uncertain that no gate would refuse a marker: it has to be found, not merely agreed with.
Tracking Filter::believe(const MarkerRef& markers) {
  const int measured = gate_.markers_measured();
  const int plates = static_cast<int>(model_.markers().size());
  const bool held = last_.tracking == Tracking::lost || last_.tracking == Tracking::restarted;
  if (!held && measured > 0 && 2 * gate_.markers_refused() <= measured) {
    unbelieved_s_ = 0.0;
    return Tracking::following;
  }
  if (held || unbelieved_s_ > settings_.recovery.blind_s) {
    hold_motion();
    if (2 * measured >= measurement_.markers_in_use() && (seek_motion(markers) || seek_motion_from_start(markers))) {
      unbelieved_s_ = 0.0;
      return Tracking::found;
    }
    for (int sensor = 0; sensor <= plates; ++sensor) measurement_.leave_out(sensor);
    return Tracking::lost;
  }
  for (int sensor = 0; sensor < plates; ++sensor) measurement_.leave_out(sensor);
  if (measured > 0 || settings_.wrench_needs_markers) measurement_.leave_out(plates);
  return measured > 0 ? Tracking::doubtful : Tracking::following;
}

void Filter::forget(int element, double variance) {
  P_.row(element).setZero();
  P_.col(element).setZero();
  P_(element, element) = variance;
  if (tape_) tape_->forget(element);
}

// The coordinate stays, at rest, and knows nothing of anything else.
void Filter::hold_coordinate(int i) {
  const int n = model_.n_free();
  const RecoverySettings& r = settings_.recovery;
  x_(n + i) = x_(2 * n + i) = 0.0;
  forget(i, r.coordinate_sd * r.coordinate_sd);
  forget(n + i, r.speed_sd * r.speed_sd);
  forget(2 * n + i, r.acceleration_sd * r.acceleration_sd);
}

// A joint whose markers have not been seen for long would be carried on with the speed it last had, to the end of its
// range; it is held instead.
void Filter::hold_unseen() {
  const double most = settings_.recovery.unseen_sd * settings_.recovery.unseen_sd;
  for (int i = 0; i < model_.n_free(); ++i)
    if (P_(i, i) > most) hold_coordinate(i);
}

// All coordinates; and the soft tissue goes back to where it is on average.
void Filter::hold_motion() {
  const int n = model_.n_free();
  for (int i = 0; i < n; ++i) hold_coordinate(i);
  for (int i = 3 * n; i < model_.state_size(); ++i) {
    if (settings_.decay_rate(i) == 0.0) continue;
    x_(i) = 0.0;
    forget(i, settings_.process_density(i) / (2.0 * settings_.decay_rate(i)) + 1e-12);
  }
}

// Fits the motion to the markers, leaves out those that do not fit, and fits again, until the same ones fit: a marker
// astray pulls others from their places at first, and these are taken back. On success state and covariance are
// those before the fit, with its correction in dx_, and the misfits are refused; otherwise nothing has changed.
bool Filter::seek_motion(const MarkerRef& markers) {
  constexpr int rounds = 6, most_iterations = 20;
  const Vector6 no_wrench = Vector6::Constant(std::nan(""));
  const Eigen::VectorXd held = x_;
  const Eigen::MatrixXd wide = P_;
  gate_.accept_measured();
  for (int round = 0; round < rounds; ++round) {
    x_ = held;
    P_ = wide;
    measurement_.admit_all();
    measurement_.linearise(x_, markers, no_wrench);
    sums_ = iterate(markers, no_wrench, most_iterations);
    retract(x_, dx_);
    if (!sums_.factored || !x_.allFinite()) break;
    const bool settled = !judge_by_distance(markers);
    if (2 * gate_.markers_refused() > gate_.markers_measured()) break;
    if (!settled) continue;
    x_ = held;  // dx_ is still to be taken
    return true;
  }
  x_ = held;
  P_ = wide;
  measurement_.linearise(x_, markers, no_wrench);
  return false;
}

// The same from the posture of the first frame: the one held may be too far from where the person is now.
bool Filter::seek_motion_from_start(const MarkerRef& markers) {
  const int n = model_.n_free();
  const Eigen::VectorXd held = x_.head(n);
  x_.head(n) = x0_.head(n);
  if (seek_motion(markers)) return true;
  x_.head(n) = held;
  return false;
}

// Refuses the markers that lie further from where the fit has them, soft tissue left out, than noise, place and soft
// tissue explain, and accepts the others. True where a verdict changed.
bool Filter::judge_by_distance(const MarkerRef& markers) {
  x_before_ = x_;
  for (const Marker& marker : model_.markers())
    for (int c : marker.soft_tissue)
      if (c != k_none) x_before_(c) = 0.0;
  bool changed = false;
  measurement_.evaluate(x_before_);
  for (std::size_t m = 0; m < model_.markers().size(); ++m) {
    if (gate_.verdicts()[m] == Verdict::missing) continue;
    const Marker& marker = model_.markers()[m];
    double variance = 0.0;
    for (int k = 0; k < 3; ++k)
      for (int c : {marker.column[k], marker.soft_tissue[k]})
        if (c != k_none) variance = std::max(variance, P_before_(c, c));
    variance = 2.0 * variance + settings_.marker_variance(m);
    double distance = 0.0;
    for (int k = 0; k < 3; ++k)
      if (marker.measured[k]) distance += std::pow(markers(k, m) - measurement_.kinematics().markers[m](k), 2);
    const bool fits = distance <= settings_.marker_gate[marker.n_measured - 1] * variance;
    const Verdict verdict = fits ? Verdict::accepted : Verdict::refused;
    changed = changed || verdict != gate_.verdicts()[m];
    gate_.decide(static_cast<int>(m), verdict);
  }
  return changed;
}

}  // namespace dynakin
