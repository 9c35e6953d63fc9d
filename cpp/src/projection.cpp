#include "dynakin/projection.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <utility>

namespace dynakin {
namespace {

constexpr int k_cut = -1;            // kind of a half space that keeps a segment possible
constexpr double rounding = 1e-9;    // of a standard deviation: not a violation
constexpr double dependent = 1e-12;  // of a' P a: what is left of it when the other constraints hold

// out = P a, of columns that may have to be made first.
void times(const HalfSpace& row, const Eigen::MatrixXd& P, const Projection::MakeColumn& make,
           Eigen::Ref<Eigen::VectorXd> out) {
  if (make)
    for (int k = 0; k < row.size; ++k) make(row.index[k]);
  row.times(P, out);
}

}  // namespace

Projection::Projection(const Model& model, const FilterSettings& settings)
    : settings_(settings), consistency_(model), last_(model.initial_state()), start_(last_) {
  const int n = model.state_size();
  // No more than n constraints can bind at once; far fewer do, and the small factors stay small.
  capacity_ = std::min(n, 96);
  active_.resize(capacity_);
  before_.resize(capacity_);
  PN_.setZero(n, capacity_);
  gram_.setZero(capacity_, capacity_);
  chol_.setZero(capacity_, capacity_);
  Pa_.setZero(n);
  step_.setZero(n);
  wanted_.setZero(n);
  r_.setZero(capacity_);
  for (const auto& a : settings.equality.rowwise()) {
    equality_columns_.emplace_back();
    for (int i = 0; i < n; ++i)
      if (a(i) != 0.0) equality_columns_.back().push_back(i);
  }
}

void Projection::forget() {
  k_ = 0;
  last_ = start_;
}

ProjectionReport Projection::apply(Eigen::VectorXd& x, Eigen::MatrixXd& P, FrameTape* tape) {
  const bool equal = keep_equalities(x, P, tape);
  ProjectionReport report = bound(x, P);
  report.solved = report.solved && equal;
  if (tape && k_ > 0) {  // else nothing moved the mean, or no P N' u
    tape->pulled = true;
    tape->pull.setZero();
    for (int k = 0; k < k_; ++k)
      for (int i = 0; i < active_[k].row.size; ++i)
        tape->pull(active_[k].row.index[i]) += active_[k].multiplier * active_[k].row.value[i];
  }
  if (tape && tape->records_update() && fell_back_) {
    tape->fell_back = true;
    tape->moved = x - wanted_;
  }
  return report;
}

void Projection::save(Memory& out) const {
  out.active.assign(active_.begin(), active_.begin() + k_);
  out.last = last_;
}

void Projection::restore(const Memory& memory) {
  k_ = static_cast<int>(memory.active.size());
  std::copy(memory.active.begin(), memory.active.end(), active_.begin());
  last_ = memory.last;
}

ProjectionReport Projection::bound(Eigen::VectorXd& x, const Eigen::MatrixXd& P, const MakeColumn& make) {
  ProjectionReport report;
  wanted_ = x;
  warm_start(P, make, x);
  Active worst;
  for (int round = 0; report.solved && worst_violation(x, P, worst); ++round)
    report.solved = round < 8 * capacity_ && add(worst, P, make, x);
  if (!report.solved) {
    x = wanted_;
    k_ = 0;
    fall_back(x);
  }
  fell_back_ = !report.solved;
  for (int k = 0; k < k_; ++k)  // to the last bit
    if (const int i = active_[k].kind; i != k_cut) x(i) = active_[k].row.value[0] * active_[k].row.bound;
  x = x.cwiseMax(settings_.lower).cwiseMin(settings_.upper);  // what is left is rounding
  report.active = k_;
  last_ = x;
  return report;
}

// x + P a (b - a x) / a' P a, and P without what it had along a. A row of which P leaves nothing open is left alone;
// false where it does not hold.
bool Projection::keep_equalities(Eigen::VectorXd& x, Eigen::MatrixXd& P, FrameTape* tape) {
  bool all_hold = true;
  for (Eigen::Index r = 0; r < settings_.equality.rows(); ++r) {
    const auto a = settings_.equality.row(r);
    const double missing = settings_.equality_value(r) - a.dot(x);
    Pa_.noalias() = P * a.transpose();
    const double aPa = a.dot(Pa_);
    const double most = (a.transpose().array().square() * P.diagonal().array()).sum();
    if (!(aPa > dependent * most)) {
      const double size = (a.transpose().array() * x.array()).abs().sum() + std::abs(settings_.equality_value(r));
      all_hold = all_hold && std::abs(missing) <= rounding * size;
      continue;
    }
    if (tape) tape->add_equality(equality_columns_[static_cast<std::size_t>(r)], a.transpose(), Pa_, aPa, missing);
    x += Pa_ * (missing / aPa);
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      // An element that the equality decides alone: nothing is left, rounding neither.
      if (Pa_(i) * Pa_(i) < (1.0 - dependent) * P(i, i) * aPa) continue;
      P.row(i).setZero();
      P.col(i).setZero();
      Pa_(i) = 0.0;
    }
    P.selfadjointView<Eigen::Lower>().rankUpdate(Pa_, -1.0 / aPa);
    P.triangularView<Eigen::StrictlyUpper>() = P.transpose();
  }
  return all_hold;
}

// The bounds that were active before, less those that would hold the state back from where it wants to go anyway:
// a state and multipliers that are optimal for these constraints alone, from which the dual method may go on.
void Projection::warm_start(const Eigen::MatrixXd& P, const MakeColumn& make, Eigen::VectorXd& x) {
  const int n = std::exchange(k_, 0);
  std::copy_n(active_.begin(), n, before_.begin());
  for (int k = 0; k < n; ++k) {
    const Active& old = before_[k];
    if (old.kind != k_cut && old.row.dot(x) < old.row.bound) push(old, P, make);
  }
  while (k_ > 0) {
    auto u = r_.head(k_);
    for (int k = 0; k < k_; ++k) u(k) = active_[k].row.bound - active_[k].row.dot(x);
    const auto L = chol_.topLeftCorner(k_, k_).triangularView<Eigen::Lower>();
    L.solveInPlace(u);
    L.transpose().solveInPlace(u);
    Eigen::Index least = 0;
    if (u.minCoeff(&least) < 0.0) {
      drop(static_cast<int>(least));
      continue;
    }
    for (int k = 0; k < k_; ++k) active_[k].multiplier = u(k);
    x.noalias() += PN_.leftCols(k_) * u;
    return;
  }
}

bool Projection::worst_violation(const Eigen::VectorXd& x, const Eigen::MatrixXd& P, Active& out) const {
  double worst = rounding;
  int found = k_cut;
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    const double excess = std::max(settings_.lower(i) - x(i), x(i) - settings_.upper(i));
    if (excess <= 0.0 || excess * excess <= worst * worst * P(i, i)) continue;
    worst = P(i, i) > 0.0 ? excess / std::sqrt(P(i, i)) : k_infinity;
    found = static_cast<int>(i);
  }
  if (found != k_cut) {
    const bool below = x(found) < settings_.lower(found);
    out.row.set(found, below ? 1.0 : -1.0, below ? settings_.lower(found) : -settings_.upper(found));
    out.kind = found;
    return true;
  }
  out.kind = k_cut;
  bool any = false;
  HalfSpace cut;
  for (int b = 0; b < consistency_.size(); ++b) {
    if (!consistency_.cut(b, x, cut)) continue;
    const double variance = cut.variance(P), missing = cut.bound - cut.dot(x);
    const double excess = variance > 0.0 ? missing / std::sqrt(variance) : k_infinity;
    if (any && excess <= worst) continue;
    any = true;
    worst = excess;
    out.row = cut;
  }
  return any;
}

bool Projection::add(Active incoming, const Eigen::MatrixXd& P, const MakeColumn& make, Eigen::VectorXd& x) {
  incoming.multiplier = 0.0;
  times(incoming.row, P, make, Pa_);
  const double aPa = incoming.row.dot(Pa_);
  if (!(aPa > 0.0)) return false;
  while (true) {
    auto r = r_.head(k_);
    for (int k = 0; k < k_; ++k) r(k) = active_[k].row.dot(Pa_);
    const auto L = chol_.topLeftCorner(k_, k_).triangularView<Eigen::Lower>();
    L.solveInPlace(r);
    L.transpose().solveInPlace(r);
    step_ = Pa_;
    step_.noalias() -= PN_.leftCols(k_) * r;
    const double curvature = incoming.row.dot(step_);
    const double missing = incoming.row.bound - incoming.row.dot(x);
    const double full = curvature > dependent * aPa ? missing / curvature : k_infinity;
    double t = full;
    int blocking = -1;
    for (int k = 0; k < k_; ++k)
      if (r(k) > 0.0 && active_[k].multiplier < t * r(k)) {
        t = active_[k].multiplier / r(k);
        blocking = k;
      }
    if (std::isinf(t)) return false;
    if (!std::isinf(full)) x += t * step_;
    for (int k = 0; k < k_; ++k) active_[k].multiplier -= t * r(k);
    incoming.multiplier += t;
    if (blocking < 0) return push(incoming, P, make);
    drop(blocking);
  }
}

// False where there is no room, or where the row depends on those that are there.
bool Projection::push(const Active& active, const Eigen::MatrixXd& P, const MakeColumn& make) {
  if (k_ == capacity_) return false;
  active_[k_] = active;
  times(active.row, P, make, PN_.col(k_));
  for (int j = 0; j <= k_; ++j) gram_(k_, j) = gram_(j, k_) = active_[j].row.dot(PN_.col(k_));
  ++k_;
  if (factor()) return true;
  --k_;
  factor();
  return false;
}

void Projection::drop(int k) {
  for (int j = k + 1; j < k_; ++j) {
    active_[j - 1] = active_[j];
    PN_.col(j - 1) = PN_.col(j);
  }
  --k_;
  for (int i = 0; i < k_; ++i)
    for (int j = 0; j <= i; ++j) gram_(i, j) = gram_(j, i) = active_[j].row.dot(PN_.col(i));
  factor();
}

bool Projection::factor() {
  if (k_ == 0) return true;
  auto L = chol_.topLeftCorner(k_, k_);
  L = gram_.topLeftCorner(k_, k_);
  return Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>>(L).info() == Eigen::Success;  // in place
}

// Bounds one by one, and an impossible body moved towards the last possible one: both sets are convex.
void Projection::fall_back(Eigen::VectorXd& x) const {
  x = x.cwiseMax(settings_.lower).cwiseMin(settings_.upper);
  HalfSpace row;
  for (int b = 0; b < consistency_.size(); ++b)
    for (int halving = 0; halving < 60 && consistency_.cut(b, x, row); ++halving)
      for (int k = 0; k < row.size; ++k) {
        const int i = row.index[k];
        x(i) = halving < 59 ? 0.5 * (x(i) + last_(i)) : last_(i);
      }
}

}  // namespace dynakin
