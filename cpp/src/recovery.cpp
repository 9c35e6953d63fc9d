#include "dynakin/recovery.hpp"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "dynakin/process.hpp"

namespace dynakin {

const char* describe(Tracking tracking) {
  static constexpr const char* words[] = {"following", "doubtful", "lost", "found", "restarted"};
  return words[static_cast<int>(tracking)];
}

Recovery::Recovery(Correction& correction)
    : c_(correction),
      model_(correction.model),
      settings_(correction.settings.recovery),
      measurement_(correction.measurement),
      gate_(correction.gate),
      now_(correction.now),
      unsure_(correction.model.n_free()),
      forgotten_(correction.model.state_size()) {
  from_.setZero(3, static_cast<Eigen::Index>(model_.markers().size()));
  to_ = from_;
}

void Recovery::start() {
  start_ = kept_ = sought_ = c_.before = now_;
  ahead_ = posture_ = best_ = now_.x;
  memory_ = {};
}

void Recovery::restart() {
  now_ = start_;
  memory_.unbelieved_s = k_infinity;
  memory_.vain_s = memory_.pause_s = 0.0;
  memory_.held = true;
  if (c_.tape) c_.tape->cut = true;
}

double Recovery::carry_on(double dt) {
  const double little = 0.25 * settings_.unseen_sd * settings_.unseen_sd;
  for (int i = 0; i < model_.n_free(); ++i) unsure_[i] = now_.P(i, i) > little;
  return carried_ = carried_of(dt);
}

double Recovery::carried_of(double dt) {
  constexpr double rounding = 1e-9;
  const double blind = settings_.blind_s;
  const double unbelieved = memory_.unbelieved_s;
  memory_.unbelieved_s += dt;
  memory_.sought_s += dt;
  memory_.vain_s += dt;
  memory_.pause_s -= dt;
  if (!settings_.enabled) return dt;
  if (dt > 0.0) memory_.shortest_step_s = std::min(memory_.shortest_step_s, dt);
  const double left = memory_.held ? 0.0 : std::clamp(1.5 * memory_.shortest_step_s, blind, 2.0 * blind) - unbelieved;
  if (!memory_.held && dt <= left + rounding) return dt;
  if (!memory_.held) memory_.vain_s = memory_.pause_s = 0.0;
  memory_.held = true;
  return std::clamp(left, 0.0, dt);
}

// A joint whose markers have not been seen for long would be carried on with the speed it last had, to the end of its
// range; it is held instead. One that the last frame knew is not: at the start of a motion a speed that nobody knows
// takes it beyond the limit in a single step.
void Recovery::hold() {
  if (memory_.held) return hold_motion();
  if (!settings_.enabled) return;
  const double most = settings_.unseen_sd * settings_.unseen_sd;
  unseen_ = false;
  for (int i = 0; i < model_.n_free(); ++i) {
    if (!unsure_[i] || !(now_.P(i, i) > most)) continue;
    hold_coordinate(i);
    unseen_ = true;
  }
}

// Believes a frame if at most half of its markers are refused. Where that has not been so for longer than blind_s, the
// markers may be right and the motion wrong: it is held, and sought from the markers alone. A motion that is held is so
// uncertain that no gate would refuse a marker: it has to be found, not merely agreed with.
Tracking Recovery::correct(const MarkerRef& markers, const Vector6& wrench) {
  Tracking tracking = Tracking::following;
  if (settings_.enabled && !memory_.held) expect_impact();
  if (memory_.held)
    tracking = seek(markers);
  else if (settings_.enabled && !(gate_.markers_measured() > 0 && believes_most()))
    tracking = doubt();
  if (settings_.enabled && tracking == Tracking::following) return fit(markers, wrench);
  if (tracking != Tracking::found) c_.correct(markers, wrench);
  return tracking;
}

// A landing changes speeds within a few frames by more than the jerk that is declared for moving allows: several
// markers at once are then refused, rightly placed. Where a denser jerk over the last moments would have at most half
// as many refused, it was an impact; markers that are astray stay so.
void Recovery::expect_impact() {
  constexpr int least = 3;
  constexpr double times = 30.0, lasts_s = 0.04;  // speeds by 0.8 m/s and 4 rad/s, of the jerk declared for walking
  const int refused = gate_.markers_refused();
  if (refused < least) return;
  kept_.P = now_.P;
  stir(model_, c_.settings, times, lasts_s, now_.P);
  gate_.judge(c_.settings, measurement_.blocks(), now_.P);
  if (2 * gate_.markers_refused() <= refused) {
    if (c_.tape) c_.tape->stirred = times, c_.tape->stirred_s = lasts_s;
    return;
  }
  now_.P = kept_.P;
  gate_.judge(c_.settings, measurement_.blocks(), now_.P);
}

// Nothing of this frame is used, or where no marker is measured perhaps the plates.
Tracking Recovery::doubt() {
  const int measured = gate_.markers_measured();
  const int plates = static_cast<int>(model_.markers().size());
  for (int sensor = 0; sensor < plates; ++sensor) measurement_.leave_out(sensor);
  if (measured > 0 || c_.settings.wrench_needs_markers) measurement_.leave_out(plates);
  return measured > 0 ? Tracking::doubtful : Tracking::following;
}

// Of a motion that is held: from where it is and from the posture of the first frame, then from both turned as a whole
// to where the markers are. What leaves the fewest refused, half of them at most, is taken. A search takes as long as
// many frames, and finds hardly more in the next one than in this: after one in vain the next waits for a tenth of the
// time since the first of them, so that a motion is found a tenth later at most than it could be.
Tracking Recovery::seek(const MarkerRef& markers) {
  constexpr double share = 0.1, longest_s = 1.0;
  const int n = model_.n_free(), measured = gate_.markers_measured();
  bool found = false;
  kept_ = now_;
  int fewest = measured / 2 + 1;
  const bool enough = measured > 0 && 2 * measured >= measurement_.markers_in_use();
  if (!enough) memory_.vain_s = memory_.pause_s = 0.0;  // markers that come back are looked at as soon as they do
  const bool seeks = enough && memory_.pause_s <= 0.0;
  for (int k = 0; seeks && k < 4 && fewest > 0; ++k) {
    now_.x.head(n) = (k % 2 == 0 ? kept_ : start_).x.head(n);
    now_.P = kept_.P;
    if (k >= 2 && !turn_towards(markers)) continue;
    posture_ = now_.x;
    if (!seek_motion(markers, fewest - 1)) continue;
    fewest = gate_.markers_refused();
    best_ = posture_;
    found = true;
  }
  if (seeks) memory_.pause_s = std::min(share * memory_.vain_s, longest_s);
  if (found) {
    if (fewest > 0) {
      now_.x = best_;
      now_.P = kept_.P;
      seek_motion(markers, fewest);
    }
    memory_.unbelieved_s = 0.0;
    memory_.held = false;
    return Tracking::found;
  }
  now_ = kept_;
  for (std::size_t sensor = 0; sensor <= model_.markers().size(); ++sensor)
    measurement_.leave_out(static_cast<int>(sensor));
  return Tracking::lost;
}

// Turns and shifts the posture as a whole, as the markers would have it if they were a rigid body (Kabsch 1976), in
// steps that a tangent can follow; P stays. False where that is hardly a turn.
bool Recovery::turn_towards(const MarkerRef& markers) {
  constexpr double step = 0.5;  // rad
  constexpr int most_iterations = 8;
  const int n = model_.n_free(), count = static_cast<int>(model_.markers().size());
  measurement_.evaluate(now_.x);
  to_ = markers;
  Vector3 from_centre = Vector3::Zero(), to_centre = Vector3::Zero();
  for (int m = 0; m < count; ++m) {
    from_.col(m) = measurement_.kinematics().markers[m];
    for (int k = 0; k < 3; ++k)
      if (!model_.markers()[m].measured[k]) to_(k, m) = from_(k, m);
    if (gate_.verdicts()[m] == Verdict::missing) continue;
    from_centre += from_.col(m) / gate_.markers_measured();
    to_centre += to_.col(m) / gate_.markers_measured();
  }
  Matrix3 spread = Matrix3::Zero();
  for (int m = 0; m < count; ++m)
    if (gate_.verdicts()[m] != Verdict::missing)
      spread += (to_.col(m) - to_centre) * (from_.col(m) - from_centre).transpose();
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
      to_.col(m) = from_centre + part * (to_centre - from_centre) + R_part * (from_.col(m) - from_centre);
    }
    measurement_.linearise(now_.x, to_, no_wrench_);
    c_.iterate(to_, no_wrench_, most_iterations);
    if (!c_.sums.factored || !c_.dx.allFinite()) return false;
    now_.x.head(n) += c_.dx.head(n);
    now_.P = kept_.P;
  }
  return true;
}

// Seeks a motion for a trial, of the coordinates that are held unseen or else of all: true, and found, where so many
// markers at most are refused then; else nothing has changed.
bool Recovery::seek_better(const MarkerRef& markers, const Vector6& wrench, int refused) {
  if (c_.tape) forgotten_ = c_.tape->forgotten;
  const bool any_forgotten = c_.tape && c_.tape->any_forgotten;
  const double stirred = c_.tape ? c_.tape->stirred : 0.0;
  if (2 * gate_.markers_measured() >= measurement_.markers_in_use()) {
    if (unseen_ && seek_motion(markers, refused)) return true;
    hold_motion();
    if (seek_motion(markers, refused)) return true;
  }
  now_ = kept_;
  if (c_.tape) {
    c_.tape->forgotten = forgotten_;
    c_.tape->any_forgotten = any_forgotten;
    c_.tape->stirred = stirred;
  }
  c_.measure(markers, wrench);
  return false;
}

// Of a marker from where the last evaluation has it, m^2, on the axes that are measured.
double Recovery::squared_distance(const MarkerRef& markers, std::size_t m) const {
  double sum = 0.0;
  for (int k = 0; k < 3; ++k)
    if (model_.markers()[m].measured[k]) sum += std::pow(markers(k, m) - measurement_.kinematics().markers[m](k), 2);
  return sum;
}

// RMS over the markers that are accepted, m; 0 without any.
double Recovery::distance(const MarkerRef& markers) const {
  double sum = 0.0;
  int count = 0;
  for (std::size_t m = 0; m < model_.markers().size(); ++m) {
    if (gate_.verdicts()[m] != Verdict::accepted) continue;
    sum += squared_distance(markers, m);
    ++count;
  }
  return count == 0 ? 0.0 : std::sqrt(sum / count);
}

// The same of ahead_, put within its bounds: a posture that no joint allows fits nothing.
double Recovery::distance_within_bounds(const MarkerRef& markers) {
  if (c_.settings.constraint != ConstraintKind::none)
    ahead_ = ahead_.cwiseMax(c_.settings.lower).cwiseMin(c_.settings.upper);
  measurement_.evaluate(ahead_);
  return distance(markers);
}

// Corrects so that the markers used lie within fit_m of the estimate; those that lie further off are refused, and the
// rest is used without them. False, and all as in kept_, where most would have to be refused.
bool Recovery::correct_to_fit(const MarkerRef& markers, const Vector6& wrench) {
  constexpr int rounds = 3;
  const double most = settings_.fit_m;
  for (int round = 0; round < rounds; ++round) {
    c_.correct(markers, wrench);
    if (!c_.sums.factored) return true;  // broken down, which the step will say
    ahead_ = now_.x;
    retract(ahead_, c_.dx);
    if (distance_within_bounds(markers) <= most) return true;
    for (std::size_t m = 0; m < model_.markers().size(); ++m)
      if (gate_.verdicts()[m] == Verdict::accepted && !(squared_distance(markers, m) <= most * most))
        gate_.decide(static_cast<int>(m), Verdict::refused);
    now_ = kept_;
    measurement_.linearise(now_.x, markers, wrench);
    if (!believes_most()) return false;
  }
  return false;
}

// Corrects a motion that is followed. Where the markers used are far from what was predicted it is known so badly that
// the gate may have agreed with anything; where a coordinate is held unseen, the gate, which knows tangents only, may
// refuse the markers of a segment that has turned too far. If some do not fit the corrected estimate either, or were
// refused, as all those of a segment that went astray, then a motion that leaves half as many out is sought; that takes
// long and costs all that is known of speeds, so it is not tried again before blind_s has passed.
Tracking Recovery::fit(const MarkerRef& markers, const Vector6& wrench) {
  const int measured = gate_.markers_measured();
  const bool astray = unseen_ && gate_.markers_refused() > 0;
  if (measured == 0 || (distance(markers) <= settings_.fit_m && !astray)) {
    c_.correct(markers, wrench);
    if (measured > 0) memory_.unbelieved_s = 0.0;
    return Tracking::following;
  }
  kept_ = now_;
  Tracking tracking = Tracking::following;
  bool fits = correct_to_fit(markers, wrench);
  if ((!fits || gate_.markers_refused() > 0) && memory_.sought_s > settings_.blind_s) {
    memory_.sought_s = 0.0;
    now_ = kept_;
    if (seek_better(markers, wrench, (fits ? gate_.markers_refused() : measured) / 2)) tracking = Tracking::found;
    fits = tracking == Tracking::found || correct_to_fit(markers, wrench);
  }
  if (fits) {
    memory_.unbelieved_s = 0.0;
    return tracking;
  }
  tracking = doubt();
  c_.correct(markers, wrench);
  return tracking;
}

// The coordinate stays, at rest, and knows nothing of anything else.
void Recovery::hold_coordinate(int i) {
  const int n = model_.n_free();
  now_.x(n + i) = now_.x(2 * n + i) = 0.0;
  for (const double sd : {settings_.coordinate_sd, settings_.speed_sd, settings_.acceleration_sd}) {
    now_.P.row(i).setZero();
    now_.P.col(i).setZero();
    now_.P(i, i) = sd * sd;
    if (c_.tape) c_.tape->forget(i);
    i += n;
  }
}

// All coordinates. What is known of constants, soft tissue and plates stays, apart from what it had to do with the
// motion.
void Recovery::hold_motion() {
  for (int i = 0; i < model_.n_free(); ++i) hold_coordinate(i);
  if (c_.tape) c_.tape->stirred = 0.0;
}

// Fits the motion to the markers, leaves out those that do not fit, and fits again, until the same ones fit: a marker
// astray pulls others from their places at first, and these are taken back. On success, with so many misfits at most,
// state and covariance are those before the fit, with its correction in dx, and the misfits are refused; otherwise
// nothing has changed.
bool Recovery::seek_motion(const MarkerRef& markers, int refused) {
  constexpr int rounds = 6, most_iterations = 20;
  sought_ = now_;
  gate_.accept_measured();
  for (int round = 0; round < rounds; ++round) {
    now_ = sought_;
    measurement_.admit_all();
    measurement_.linearise(now_.x, markers, no_wrench_);
    c_.iterate(markers, no_wrench_, most_iterations);
    retract(now_.x, c_.dx);
    if (!c_.sums.factored || !now_.x.allFinite()) break;
    const bool settled = !judge_by_distance(markers);
    if (!believes_most()) break;
    if (!settled) continue;
    ahead_ = now_.x;
    if (gate_.markers_refused() > refused || !(distance_within_bounds(markers) <= settings_.fit_m)) break;
    now_.x = sought_.x;  // dx is still to be taken
    return true;
  }
  now_ = sought_;
  measurement_.linearise(now_.x, markers, no_wrench_);
  return false;
}

// Refuses the markers that lie further from where the fit has them, with the soft tissue that was expected before it,
// than noise, place and soft tissue explain, and accepts the others. True where a verdict changed.
bool Recovery::judge_by_distance(const MarkerRef& markers) {
  ahead_ = now_.x;
  for (const Marker& marker : model_.markers())
    for (int c : marker.soft_tissue)
      if (c != k_none) ahead_(c) = c_.before.x(c);
  bool changed = false;
  measurement_.evaluate(ahead_);
  for (std::size_t m = 0; m < model_.markers().size(); ++m) {
    if (gate_.verdicts()[m] == Verdict::missing) continue;
    const Marker& marker = model_.markers()[m];
    double variance = 0.0;
    for (int k = 0; k < 3; ++k)
      for (int c : {marker.column[k], marker.soft_tissue[k]})
        if (c != k_none) variance = std::max(variance, c_.before.P(c, c));
    variance = 2.0 * variance + c_.settings.marker_variance(m);
    const bool fits = squared_distance(markers, m) <= c_.settings.marker_gate[marker.n_measured - 1] * variance;
    const Verdict verdict = fits ? Verdict::accepted : Verdict::refused;
    changed = changed || verdict != gate_.verdicts()[m];
    gate_.decide(static_cast<int>(m), verdict);
  }
  return changed;
}

}  // namespace dynakin
