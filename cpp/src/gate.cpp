#include "dynakin/gate.hpp"

#include <Eigen/Cholesky>
#include <cmath>

namespace dynakin {

const char* describe(Verdict verdict) {
  switch (verdict) {
    case Verdict::missing:
      return "missing";
    case Verdict::accepted:
      return "accepted";
    case Verdict::refused:
      return "refused";
  }
  return "unknown";
}

Gate::Gate(const Model& model)
    : n_markers_(static_cast<int>(model.markers().size())), verdicts_(n_markers_ + 1, Verdict::missing) {
  HP_.setZero(model.state_size(), 6);
  gathered_.setZero(model.state_size());
}

void Gate::judge(const FilterSettings& settings, const std::vector<RowBlock>& blocks, const Eigen::MatrixXd& P) {
  measured_ = refused_ = 0;
  for (int b = 0; b <= n_markers_; ++b) {
    verdicts_[b] = judge(blocks[b], b < n_markers_ ? settings.marker_gate : settings.wrench_gate, P);
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

Verdict Gate::judge(const RowBlock& block, const GateLimits& limits, const Eigen::MatrixXd& P) {
  const int rows = block.rows;
  if (rows == 0) return Verdict::missing;
  if (std::isinf(limits[rows - 1])) return Verdict::accepted;
  const std::vector<int>& columns = *block.columns;
  const int n = static_cast<int>(columns.size());
  // H P H' over the block's own columns of P, gathered one at a time.
  auto HP = HP_.topLeftCorner(n, rows);
  auto gathered = gathered_.head(n);
  HP.setZero();
  for (int c = 0; c < n; ++c) {
    const double* column = P.col(columns[c]).data();
    for (int d = 0; d < n; ++d) gathered(d) = column[columns[d]];
    for (int r = 0; r < rows; ++r) HP.col(r) += block.H(r, c) * gathered;
  }
  Matrix6 S = Matrix6::Identity();
  S.topLeftCorner(rows, rows) = block.R.topLeftCorner(rows, rows);
  for (int c = 0; c < n; ++c)
    for (int r = 0; r < rows; ++r)
      for (int s = 0; s <= r; ++s) S(r, s) += HP(c, r) * block.H(s, c);
  const Eigen::LLT<Matrix6> llt(S);
  if (llt.info() != Eigen::Success) return Verdict::accepted;  // the update will say that S is not definite
  Vector6 v = Vector6::Zero();
  v.head(rows) = block.v.head(rows);
  llt.matrixL().solveInPlace(v);
  return v.squaredNorm() <= limits[rows - 1] ? Verdict::accepted : Verdict::refused;
}

}  // namespace dynakin
