#include "dynakin/smoother_given_constants.hpp"

#include <algorithm>

#include "mirror.hpp"

namespace dynakin {
namespace {

// M F^-T
void by_transition_back(const Transition& how, const std::vector<int>& moving, int n, Eigen::MatrixXd& M) {
  const double dt = how.step, half = 0.5 * dt * dt;
  M.middleCols(0, n) += half * M.middleCols(2 * n, n) - dt * M.middleCols(n, n);
  M.middleCols(n, n) -= dt * M.middleCols(2 * n, n);
  for (std::size_t j = 3 * n; j < moving.size(); ++j)
    if (const double kept = how.kept(moving[j]); kept != 1.0) M.col(j) /= kept;
}

// M F
void by_transposed_transition(const Transition& how, const std::vector<int>& moving, int n, Eigen::MatrixXd& M) {
  const double dt = how.step, half = 0.5 * dt * dt;
  M.middleCols(2 * n, n) += dt * M.middleCols(n, n) + half * M.middleCols(0, n);
  M.middleCols(n, n) += dt * M.middleCols(0, n);
  for (std::size_t j = 3 * n; j < moving.size(); ++j)
    if (const double kept = how.kept(moving[j]); kept != 1.0) M.col(j) *= kept;
}

// F' M by rows: a column at a time, which stays in the cache.
template <class Column>
void rows_by_transposed(double dt, int n, Column&& x) {
  x.segment(2 * n, n) += dt * x.segment(n, n) + (0.5 * dt * dt) * x.segment(0, n);
  x.segment(n, n) += dt * x.segment(0, n);
}

}  // namespace

SmootherGivenConstants::SmootherGivenConstants(const Model& model, const GivenConstants& apart, int max_rows)
    : model_(model), apart_(apart) {
  const int d = apart.d(), c = apart.c(), n = model.state_size(), chunk = chunk_rows(max_rows);
  Ct_.setZero(c, c);
  lambda_ = Eigen::VectorXd::Zero(d);
  Lambda_.setZero(d, d);
  P_ = X_ = Lambda_;
  Wt_.setZero(c, d);
  Yt_ = Wt_;
  Bt_.setZero(chunk, d);
  Z_panels_ = Panels(d, chunk);
  D_panels_ = Panels(c, chunk);
  U_.setZero(Z_panels_.max_columns(), chunk);
  G_.setZero(d, chunk);
  M_.setZero(std::max(c, d), std::max(chunk, d));
  T_.setZero(chunk, chunk);
  Yw_.setZero(c, static_cast<Eigen::Index>(apart.wide.size()));
  covariance_.setZero(n, n);
}

void SmootherGivenConstants::end(const Belief& last) {
  covariance_ = last.P;
  Eigen::MatrixXd C = last.P(apart_.constant, apart_.constant);
  factor_covariance(C);
  Ct_ = C.transpose();
  lambda_.setZero();
  Lambda_.setZero();
  Wt_.setZero();
  there_ = false;
  ended_ = true;
}

void SmootherGivenConstants::look(const Frame& frame, Eigen::VectorXd& x) {
  const int d = apart_.d(), c = apart_.c();
  if (!there_) {
    auto M = M_.topLeftCorner(d, d);
    M.noalias() = Lambda_ * frame.S;
    P_ = frame.S;
    P_.noalias() -= frame.S * M;
    mirror_lower(P_);
    Yt_ = frame.Vt;
    Yt_.noalias() -= Wt_ * frame.S;
    there_ = true;
    since_ = 0;
    decayed_ = 1.0;
  }
  if (ended_) {  // to the last bit; the covariance is the last one's
    x = frame.after;
    return;
  }
  x(apart_.constant) = frame.constants;
  x(apart_.moving) = frame.mean - frame.S * lambda_;
  const auto wide = static_cast<Eigen::Index>(apart_.wide.size());
  for (Eigen::Index k = 0; k < wide; ++k) Yw_.col(k) = Yt_.col(apart_.wide[k]);
  Pw_.setZero(wide, wide);
  if (c > 0) Pw_.selfadjointView<Eigen::Lower>().rankUpdate(Yw_.transpose());
  mirror_lower(Pw_);
  Pwc_.resize(wide, apart_.wide_constants);
  Pwc_.noalias() =
      Yw_.topRows(apart_.wide_constants).transpose() * Ct_.topLeftCorner(apart_.wide_constants, apart_.wide_constants);
  for (Eigen::Index k = 0; k < wide; ++k) {
    double* const column = covariance_.col(apart_.moving[apart_.wide[k]]).data();
    const double* const given = P_.col(apart_.wide[k]).data();
    for (Eigen::Index l = 0; l < wide; ++l) column[apart_.moving[apart_.wide[l]]] = given[apart_.wide[l]] + Pw_(l, k);
    for (int l = 0; l < apart_.wide_constants; ++l) column[apart_.constant[l]] = Pwc_(k, l);
  }
  for (int l = 0; l < apart_.wide_constants; ++l) {
    double* const column = covariance_.col(apart_.constant[l]).data();
    for (Eigen::Index k = 0; k < wide; ++k) column[apart_.moving[apart_.wide[k]]] = Pwc_(k, l);
  }
  const auto factor_of = [&](int i) {  // its row of V, or of C
    return i >= 0 ? Yt_.col(i) : Ct_.col(-1 - i);
  };
  for (std::size_t m = 0; m < apart_.own.size(); ++m)
    for (const int own : apart_.own[m]) {
      const int i = apart_.place[own];
      for (const int other : model_.marker_columns(static_cast<int>(m))) {
        const int j = apart_.place[other];
        if (i < 0 && j < 0) continue;
        const int length = i < 0 ? -i : j < 0 ? -j : c;  // C' is triangular
        double value = factor_of(i).head(length).dot(factor_of(j).head(length));
        if (i >= 0 && j >= 0) value += P_(i, j);
        covariance_(own, other) = covariance_(other, own) = value;
      }
    }
}

void SmootherGivenConstants::complete() {
  if (ended_) return;
  const Eigen::MatrixXd dd = P_ + Yt_.transpose() * Yt_, dc = Yt_.transpose() * Ct_;
  covariance_(apart_.moving, apart_.moving) = dd;
  covariance_(apart_.moving, apart_.constant) = dc;
  covariance_(apart_.constant, apart_.moving) = dc.transpose();
}

void SmootherGivenConstants::undo(const Frame& frame, const Frame* last) {
  ended_ = false;
  const Decision& decided = *frame.decided;
  for (const auto& [column, u] : decided.pull)
    if (const int i = apart_.place[column]; i >= 0) lambda_(i) -= u;
  for (std::size_t k = frame.chunk_ends.size(); k-- > 0;)
    undo_chunk(frame, k == 0 ? 0 : frame.chunk_ends[k - 1], frame.chunk_ends[k]);
  for (const int i : decided.forgotten) {
    lambda_(i) = 0.0;
    Lambda_.row(i).setZero();
    Lambda_.col(i).setZero();
    Wt_.col(i).setZero();
  }
  // Carried on from frame to frame, P and V from all frames gather rounding that the way back from what decayed
  // enlarges; so they start anew every so often.
  constexpr int most_frames = 16;
  constexpr double least_kept = 0.3;
  double kept = 1.0;
  for (const int i : apart_.moving) kept = std::min(kept, frame.how.kept(i));
  decayed_ *= kept;
  there_ = last && decided.forgotten.empty() && ++since_ < most_frames && decayed_ > least_kept;
  undo_transition(frame.how, there_ ? last : nullptr);
}

// lambda - H' L^-T (w + Z' lambda), Lambda - H' B' - B H with B = (Lambda Z - H' L^-T T / 2) L^-1, T = 1 + Z' Lambda Z,
// and of W' W' - (W' Z - D') L^-1 H.
void SmootherGivenConstants::undo_chunk(const Frame& frame, int from, int end) {
  const int rows = end - from, c = apart_.c();
  const auto Z = frame.Z.middleCols(from, rows);
  const auto L = frame.L.block(0, from, rows, rows).triangularView<Eigen::Lower>();
  auto y = T_.col(0).head(rows);
  y = frame.w.segment(from, rows);
  y.noalias() += Z.transpose() * lambda_;
  frame.L.block(0, from, rows, rows).transpose().triangularView<Eigen::Upper>().solveInPlace(y);
  for (int r = 0; r < rows; ++r)
    for (int k = frame.begin(from + r); k < frame.row_ends[from + r]; ++k)
      lambda_(frame.columns[k]) -= frame.values[k] * y(r);
  // out + sign * M H by columns; those of a block's rows are the same, so that three rows go in one pass.
  const auto spread = [&](double sign, const auto& M, auto&& out) {
    for (int row = from; row < end;) {
      const int r = row - from, begin = frame.begin(row), size = frame.row_ends[row] - begin;
      const bool three = row + 2 < end && frame.block_first[row + 2] == frame.block_first[row];
      for (int k = 0; k < size; ++k) {
        const double* const h = &frame.values[begin + k];
        auto to = out.col(frame.columns[begin + k]);
        if (three)
          to += sign * h[0] * M.col(r) + sign * h[size] * M.col(r + 1) + sign * h[2 * size] * M.col(r + 2);
        else
          to += sign * h[0] * M.col(r);
      }
      row += three ? 3 : 1;
    }
  };
  auto B = G_.leftCols(rows);
  auto T = T_.topLeftCorner(rows, rows);
  B.noalias() = Lambda_ * Z;
  T.noalias() = Z.transpose() * B;
  T.diagonal().array() += 1.0;
  auto U = U_.topLeftCorner(rows, rows);
  U = frame.L.block(0, from, rows, rows).transpose();
  Z_panels_.set(B);
  Z_panels_.divide_back(U, rows);
  Z_panels_.get(0, B);
  L.solveInPlace<Eigen::OnTheRight>(T);
  frame.L.block(0, from, rows, rows).transpose().triangularView<Eigen::Upper>().solveInPlace(T);
  T *= 0.5;
  auto Bt = Bt_.topRows(rows);  // T is symmetric, and columns are read faster than rows
  Bt = B.transpose();
  spread(-1.0, T, Bt);
  B = Bt.transpose();
  X_.setZero();
  spread(1.0, B, X_);
  add_both(-1.0, X_, Lambda_);
  if (c == 0) return;
  auto M = M_.topLeftCorner(c, rows);
  M = -frame.Dt.middleCols(from, rows);
  M.noalias() += Wt_ * Z;
  D_panels_.set(M);
  D_panels_.divide_back(U, rows);
  D_panels_.get(0, M);
  spread(-1.0, M, Wt_);
}

// Lambda <- F' Lambda F, W <- F' W. With the frame before also P and V from all frames: F V = V + Q W and
// F P F' = P - Q + Q Lambda Q + F S F' Lambda Q + (the same transposed).
void SmootherGivenConstants::undo_transition(const Transition& how, const Frame* last) {
  const int n = model_.n_free(), d = apart_.d();
  const double dt = how.step;
  const auto keep = [&](auto&& column, bool back) {
    for (int i = 3 * n; i < d; ++i)
      back ? column(i) /= how.kept(apart_.moving[i]) : column(i) *= how.kept(apart_.moving[i]);
  };
  if (last) {
    const auto q = how.variance(apart_.moving);
    // M Q by columns.
    const auto by_noise = [&](const Eigen::MatrixXd& M, Eigen::MatrixXd& out) {
      for (int i = 0; i < n; ++i) {
        out.col(i) += q(i) * M.col(i) + how.shared(i, 0) * M.col(n + i) + how.shared(i, 1) * M.col(2 * n + i);
        out.col(n + i) += how.shared(i, 0) * M.col(i) + q(n + i) * M.col(n + i) + how.shared(i, 2) * M.col(2 * n + i);
        out.col(2 * n + i) +=
            how.shared(i, 1) * M.col(i) + how.shared(i, 2) * M.col(n + i) + q(2 * n + i) * M.col(2 * n + i);
      }
      for (int i = 3 * n; i < d; ++i) out.col(i) += q(i) * M.col(i);
    };
    by_noise(Wt_, Yt_);
    by_transition_back(how, apart_.moving, n, Yt_);
    X_.setZero();
    by_noise(Lambda_, X_);
    const Eigen::VectorXd variance = q;
    const Eigen::ArrayXd s0 = how.shared.col(0), s1 = how.shared.col(1), s2 = how.shared.col(2);
    for (int j = 0; j < d; ++j) {
      auto to = P_.col(j);
      const auto x = X_.col(j);
      to.array() += variance.array() * x.array();
      to.segment(0, n).array() += s0 * x.segment(n, n).array() + s1 * x.segment(2 * n, n).array();
      to.segment(n, n).array() += s0 * x.segment(0, n).array() + s2 * x.segment(2 * n, n).array();
      to.segment(2 * n, n).array() += s1 * x.segment(0, n).array() + s2 * x.segment(n, n).array();
      to(j) -= variance(j);
    }
    for (int i = 0; i < n; ++i) {
      P_(i, n + i) -= s0(i);
      P_(n + i, i) -= s0(i);
      P_(i, 2 * n + i) -= s1(i);
      P_(2 * n + i, i) -= s1(i);
      P_(n + i, 2 * n + i) -= s2(i);
      P_(2 * n + i, n + i) -= s2(i);
    }
    by_transition_back(how, apart_.moving, n, P_);
    for (int j = 0; j < d; ++j) {
      auto x = P_.col(j);
      x.segment(0, n) += (0.5 * dt * dt) * x.segment(2 * n, n) - dt * x.segment(n, n);
      x.segment(n, n) -= dt * x.segment(2 * n, n);
      keep(x, true);
    }
    by_transition_back(how, apart_.moving, n, X_);
    for (int j = 0; j < d; ++j) {
      auto x = X_.col(j);
      rows_by_transposed(dt, n, x);
      keep(x, false);
    }
    auto M = M_.topLeftCorner(d, d);
    M.noalias() = last->S * X_;
    add_both(1.0, M, P_);
  }
  rows_by_transposed(dt, n, lambda_);
  keep(lambda_, false);
  by_transposed_transition(how, apart_.moving, n, Wt_);
  by_transposed_transition(how, apart_.moving, n, Lambda_);
  for (int j = 0; j < d; ++j) {
    auto x = Lambda_.col(j);
    rows_by_transposed(dt, n, x);
    keep(x, false);
  }
  mirror_lower(Lambda_);
}

}  // namespace dynakin
