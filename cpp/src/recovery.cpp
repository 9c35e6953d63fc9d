// How a filter loses and finds its motion again: the part of Filter that seldom runs.
#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
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

// Seconds of dt over which the motion is carried on. White jerk says nothing of what a person does meanwhile that is
// worth having: beyond blind_s without a marker that is believed the motion is held where it was. Where frames are
// further apart than that, blind_s reaches to the next one, but never twice as far.
double Filter::carried_on(double dt) {
  constexpr double rounding = 1e-9;
  const double blind = settings_.recovery.blind_s;
  if (dt > 0.0) shortest_step_s_ = std::min(shortest_step_s_, dt);
  const double left = held_ ? 0.0 : std::clamp(1.5 * shortest_step_s_, blind, 2.0 * blind) - unbelieved_s_;
  if (!held_ && dt <= left + rounding) return dt;
  held_ = true;
  return std::clamp(left, 0.0, dt);
}

// Believes a frame if at most half of its markers are refused. Where that has not been so for longer than blind_s, the
// markers may be right and the motion wrong: it is held, and sought from the markers alone. A motion that is held is so
// uncertain that no gate would refuse a marker: it has to be found, not merely agreed with.
Tracking Filter::believe(const MarkerRef& markers) {
  if (held_) return seek(markers);
  const int measured = gate_.markers_measured();
  return measured > 0 && 2 * gate_.markers_refused() <= measured ? Tracking::following : doubt();
}

// Nothing of this frame is used, or where no marker is measured perhaps the plates.
Tracking Filter::doubt() {
  const int measured = gate_.markers_measured();
  const int plates = static_cast<int>(model_.markers().size());
  for (int sensor = 0; sensor < plates; ++sensor) measurement_.leave_out(sensor);
  if (measured > 0 || settings_.wrench_needs_markers) measurement_.leave_out(plates);
  return measured > 0 ? Tracking::doubtful : Tracking::following;
}

// Of a motion that is held: from where it is and from the posture of the first frame, then from both turned as a whole
// to where the markers are. What leaves the fewest refused, half of them at most, is taken.
Tracking Filter::seek(const MarkerRef& markers) {
  const int n = model_.n_free(), measured = gate_.markers_measured();
  const Eigen::VectorXd held = x_.head(n);
  const Eigen::MatrixXd wide = P_;
  Eigen::VectorXd start, best;
  int fewest = measured / 2 + 1;
  const bool enough = measured > 0 && 2 * measured >= measurement_.markers_in_use();
  for (int k = 0; enough && k < 4 && fewest > 0; ++k) {
    x_.head(n) = k % 2 == 0 ? held : x0_.head(n);
    P_ = wide;
    if (k >= 2 && !turn_towards(markers)) continue;
    start = x_.head(n);
    if (!seek_motion(markers, fewest - 1)) continue;
    fewest = gate_.markers_refused();
    best = start;
  }
  if (best.size() > 0) {
    if (fewest > 0) {
      x_.head(n) = best;
      P_ = wide;
      seek_motion(markers, fewest);
    }
    unbelieved_s_ = 0.0;
    held_ = false;
    return Tracking::found;
  }
  x_.head(n) = held;
  P_ = wide;
  for (std::size_t sensor = 0; sensor <= model_.markers().size(); ++sensor)
    measurement_.leave_out(static_cast<int>(sensor));
  return Tracking::lost;
}

// Turns and shifts the posture as a whole, as the markers would have it if they were a rigid body (Kabsch 1976), in
// steps that a tangent can follow. False where that is hardly a turn.
bool Filter::turn_towards(const MarkerRef& markers) {
  constexpr double step = 0.5;  // rad
  constexpr int most_iterations = 8;
  const int n = model_.n_free(), count = static_cast<int>(model_.markers().size());
  const Vector6 no_wrench = Vector6::Constant(std::nan(""));
  const Eigen::MatrixXd wide = P_;
  measurement_.evaluate(x_);
  MarkerMatrix from(3, count), to = markers;
  Vector3 from_centre = Vector3::Zero(), to_centre = Vector3::Zero();
  for (int m = 0; m < count; ++m) {
    from.col(m) = measurement_.kinematics().markers[m];
    for (int k = 0; k < 3; ++k)
      if (!model_.markers()[m].measured[k]) to(k, m) = from(k, m);
    if (gate_.verdicts()[m] == Verdict::missing) continue;
    from_centre += from.col(m) / gate_.markers_measured();
    to_centre += to.col(m) / gate_.markers_measured();
  }
  Matrix3 spread = Matrix3::Zero();
  for (int m = 0; m < count; ++m)
    if (gate_.verdicts()[m] != Verdict::missing)
      spread += (to.col(m) - to_centre) * (from.col(m) - from_centre).transpose();
  const Eigen::JacobiSVD<Matrix3> svd(spread, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  const Matrix3 R = svd.matrixU() * Vector3(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose();
  const Eigen::AngleAxisd turn(R);
  if (!(turn.angle() > step)) return false;
  const int steps = static_cast<int>(std::ceil(turn.angle() / step));
  measurement_.admit_all();
  gate_.accept_measured();
  for (int s = 1; s <= steps; ++s) {
    const double part = static_cast<double>(s) / steps;
    const Matrix3 R_part = Eigen::AngleAxisd(part * turn.angle(), turn.axis()).toRotationMatrix();
    for (int m = 0; m < count; ++m) {
      if (gate_.verdicts()[m] == Verdict::missing) continue;
      to.col(m) = from_centre + part * (to_centre - from_centre) + R_part * (from.col(m) - from_centre);
    }
    measurement_.linearise(x_, to, no_wrench);
    if (!iterate(to, no_wrench, most_iterations).factored || !dx_.allFinite()) return false;
    x_.head(n) += dx_.head(n);
    P_ = wide;
  }
  return true;
}

// Seeks a motion for a trial, of the coordinates that are held unseen or else of all: true, and found, where so many
// markers at most are refused then; else nothing has changed.
bool Filter::seek_better(const MarkerRef& markers, const Vector6& wrench, int refused) {
  const Eigen::VectorXd x = x_;
  const Eigen::MatrixXd P = P_;
  const std::vector<std::uint8_t> forgotten = tape_ ? tape_->forgotten : std::vector<std::uint8_t>();
  const bool any_forgotten = tape_ && tape_->any_forgotten;
  if (2 * gate_.markers_measured() >= measurement_.markers_in_use()) {
    if (unseen_ && seek_motion(markers, refused)) return true;
    hold_motion();
    if (seek_motion(markers, refused)) return true;
  }
  x_ = x;
  P_ = P;
  if (tape_) {
    tape_->forgotten = forgotten;
    tape_->any_forgotten = any_forgotten;
  }
  measurement_.admit_all();
  measurement_.linearise(x_, markers, wrench);
  gate_.judge(settings_, measurement_.blocks(), P_);
  return false;
}

// Of a marker from where the last evaluation has it, m^2, on the axes that are measured.
double Filter::squared_distance(const MarkerRef& markers, std::size_t m) const {
  double sum = 0.0;
  for (int k = 0; k < 3; ++k)
    if (model_.markers()[m].measured[k]) sum += std::pow(markers(k, m) - measurement_.kinematics().markers[m](k), 2);
  return sum;
}

// RMS over the markers that are accepted, m; 0 without any.
double Filter::distance(const MarkerRef& markers) const {
  double sum = 0.0;
  int count = 0;
  for (std::size_t m = 0; m < model_.markers().size(); ++m) {
    if (gate_.verdicts()[m] != Verdict::accepted) continue;
    sum += squared_distance(markers, m);
    ++count;
  }
  return count == 0 ? 0.0 : std::sqrt(sum / count);
}

// The same of x_ahead_, put within its bounds: a posture that no joint allows fits nothing.
double Filter::distance_within_bounds(const MarkerRef& markers) {
  if (settings_.constraint != ConstraintKind::none)
    x_ahead_ = x_ahead_.cwiseMax(settings_.lower).cwiseMin(settings_.upper);
  measurement_.evaluate(x_ahead_);
  return distance(markers);
}

// Corrects so that the markers used lie within fit_m of the estimate; those that lie further off are refused, and the
// rest is used without them. False, and nothing done, where most would have to be refused.
bool Filter::correct_to_fit(const MarkerRef& markers, const Vector6& wrench) {
  constexpr int rounds = 3;
  const double most = settings_.recovery.fit_m;
  const Eigen::VectorXd x = x_;
  const Eigen::MatrixXd P = P_;
  for (int round = 0; round < rounds; ++round) {
    sums_ = correct(markers, wrench);
    if (!sums_.factored) return true;  // broken down, which the step will say
    x_ahead_ = x_;
    retract(x_ahead_, dx_);
    if (distance_within_bounds(markers) <= most) return true;
    for (std::size_t m = 0; m < model_.markers().size(); ++m)
      if (gate_.verdicts()[m] == Verdict::accepted && !(squared_distance(markers, m) <= most * most))
        gate_.decide(static_cast<int>(m), Verdict::refused);
    x_ = x;
    P_ = P;
    measurement_.linearise(x_, markers, wrench);
    if (2 * gate_.markers_refused() > gate_.markers_measured()) return false;
  }
  return false;
}

// Corrects a motion that is followed. Where the markers used are far from what was predicted it is known so badly that
// the gate may have agreed with anything; where a coordinate is held unseen, the gate, which knows tangents only, may
// refuse the markers of a segment that has turned too far. If some do not fit the corrected estimate either, or were
// refused, as all those of a segment that went astray, then a motion that leaves half as many out is sought; that takes
// long and costs all that is known of speeds, so it is not tried again before blind_s has passed.
Tracking Filter::fit(const MarkerRef& markers, const Vector6& wrench) {
  if (gate_.markers_measured() == 0) {
    sums_ = correct(markers, wrench);
    return Tracking::following;
  }
  const bool astray = unseen_ && gate_.markers_refused() > 0;
  if (distance(markers) <= settings_.recovery.fit_m && !astray) {
    sums_ = correct(markers, wrench);
  } else {
    const Eigen::VectorXd x = x_;
    const Eigen::MatrixXd P = P_;
    bool fits = correct_to_fit(markers, wrench);
    if ((!fits || gate_.markers_refused() > 0) && sought_s_ > settings_.recovery.blind_s) {
      sought_s_ = 0.0;
      x_ = x;
      P_ = P;
      if (seek_better(markers, wrench, (fits ? gate_.markers_refused() : gate_.markers_measured()) / 2)) {
        unbelieved_s_ = 0.0;
        return Tracking::found;
      }
      fits = correct_to_fit(markers, wrench);
    }
    if (!fits) {
      const Tracking tracking = doubt();
      sums_ = correct(markers, wrench);
      return tracking;
    }
  }
  unbelieved_s_ = 0.0;
  return Tracking::following;
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
  unseen_ = false;
  for (int i = 0; i < model_.n_free(); ++i) {
    if (!(P_(i, i) > most)) continue;
    hold_coordinate(i);
    unseen_ = true;
  }
}

// All coordinates. What is known of constants, soft tissue and plates stays, apart from what it had to do with the
// motion.
void Filter::hold_motion() {
  for (int i = 0; i < model_.n_free(); ++i) hold_coordinate(i);
}

// Fits the motion to the markers, leaves out those that do not fit, and fits again, until the same ones fit: a marker
// astray pulls others from their places at first, and these are taken back. On success, with so many misfits at most,
// state and covariance are those before the fit, with its correction in dx_, and the misfits are refused; otherwise
// nothing has changed.
bool Filter::seek_motion(const MarkerRef& markers, int refused) {
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
    x_ahead_ = x_;
    if (gate_.markers_refused() > refused || !(distance_within_bounds(markers) <= settings_.recovery.fit_m)) break;
    x_ = held;  // dx_ is still to be taken
    return true;
  }
  x_ = held;
  P_ = wide;
  measurement_.linearise(x_, markers, no_wrench);
  return false;
}

// Refuses the markers that lie further from where the fit has them, with the soft tissue that was expected before it,
// than noise, place and soft tissue explain, and accepts the others. True where a verdict changed.
bool Filter::judge_by_distance(const MarkerRef& markers) {
  x_ahead_ = x_;
  for (const Marker& marker : model_.markers())
    for (int c : marker.soft_tissue)
      if (c != k_none) x_ahead_(c) = x_before_(c);
  bool changed = false;
  measurement_.evaluate(x_ahead_);
  for (std::size_t m = 0; m < model_.markers().size(); ++m) {
    if (gate_.verdicts()[m] == Verdict::missing) continue;
    const Marker& marker = model_.markers()[m];
    double variance = 0.0;
    for (int k = 0; k < 3; ++k)
      for (int c : {marker.column[k], marker.soft_tissue[k]})
        if (c != k_none) variance = std::max(variance, P_before_(c, c));
    variance = 2.0 * variance + settings_.marker_variance(m);
    const bool fits = squared_distance(markers, m) <= settings_.marker_gate[marker.n_measured - 1] * variance;
    const Verdict verdict = fits ? Verdict::accepted : Verdict::refused;
    changed = changed || verdict != gate_.verdicts()[m];
    gate_.decide(static_cast<int>(m), verdict);
  }
  return changed;
}

}  // namespace dynakin
