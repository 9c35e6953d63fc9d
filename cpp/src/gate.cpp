#include "dynakin/gate.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace dynakin {

const char* describe(Verdict verdict) {
  static constexpr const char* words[] = {"missing", "accepted", "refused"};
  return words[static_cast<int>(verdict)];
}

namespace {

// v' S^-1 v of the first rows, from the lower triangle of S; 0 where S is not definite, which the update will say.
double normalised_square(const Matrix6& S, const Vector6& v, int rows) {
  Matrix6 padded = Matrix6::Identity();
  padded.topLeftCorner(rows, rows) = S.topLeftCorner(rows, rows);
  const Eigen::LLT<Matrix6> llt(padded);
  if (llt.info() != Eigen::Success) return 0.0;
  Vector6 w = Vector6::Zero();
  w.head(rows) = v.head(rows);
  llt.matrixL().solveInPlace(w);
  return w.squaredNorm();
}

}  // namespace

Gate::Gate(const Model& model)
    : n_markers_(static_cast<int>(model.markers().size())),
      verdicts_(n_markers_ + 1, Verdict::missing),
      covariance_(model.state_size()) {
  sensors_.innovation = sensors_.innovation_sd = Eigen::VectorXd::Constant(3 * n_markers_ + 6, std::nan(""));
  sensors_.test_ratio = Eigen::VectorXd::Constant(n_markers_ + 1, std::nan(""));
}

void Gate::judge(const FilterSettings& settings, const std::vector<RowBlock>& blocks, const Eigen::MatrixXd& P) {
  measured_ = refused_ = 0;
  for (auto* numbers : {&sensors_.innovation, &sensors_.innovation_sd, &sensors_.test_ratio})
    if (reports_) numbers->setConstant(std::nan(""));
  for (int b = 0; b <= n_markers_; ++b) {
    verdicts_[b] = judge(b, blocks[b], b < n_markers_ ? settings.marker_gate : settings.wrench_gate, P);
    if (b == n_markers_ || verdicts_[b] == Verdict::missing) continue;
    ++measured_;
    refused_ += verdicts_[b] == Verdict::refused;
  }
}

void Gate::accept_measured() {
  for (int m = 0; m < n_markers_; ++m)
    if (verdicts_[m] == Verdict::refused) verdicts_[m] = Verdict::accepted;
  refused_ = 0;
}

void Gate::decide(int marker, Verdict verdict) {
  refused_ += (verdict == Verdict::refused) - (verdicts_[marker] == Verdict::refused);
  verdicts_[marker] = verdict;
}

Verdict Gate::judge(int sensor, const RowBlock& block, const GateLimits& limits, const Eigen::MatrixXd& P) {
  const int rows = block.rows;
  if (rows == 0) return Verdict::missing;
  const double limit = limits[rows - 1];
  // S = H P H' + R is no smaller than R: what R alone explains needs no more, and that is nearly every frame.
  const bool explained = std::isinf(limit) || normalised_square(block.R, block.v, rows) <= limit;
  if (explained && !reports_) return Verdict::accepted;
  const Matrix6 S = block.R + covariance_(block.H.topRows(rows), *block.columns, P);
  const double square = normalised_square(S, block.v, rows);
  for (int r = 0; reports_ && r < rows; ++r) {
    sensors_.innovation(block.channel[r]) = block.v(r);
    sensors_.innovation_sd(block.channel[r]) = std::sqrt(S(r, r));
  }
  if (reports_) sensors_.test_ratio(sensor) = square / limit;
  return explained || square <= limit ? Verdict::accepted : Verdict::refused;
}

}  // namespace dynakin
