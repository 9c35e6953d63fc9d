#include "dynakin/smoother_given_constants.hpp"

#include <algorithm>

#include "column_dots.hpp"
#include "given_transition.hpp"
#include "mirror.hpp"

namespace dynakin {

SmootherGivenConstants::SmootherGivenConstants(const Model& model, const GivenConstants& apart, int max_rows)
    : model_(model), apart_(apart) {
  const int d = apart.d(), c = apart.c(), n = model.state_size(), chunk = chunk_rows(max_rows);
  Ct_.setZero(c, c);
  lambda_ = Eigen::VectorXd::Zero(d);
  Lambda_.setZero(d, d);
  P_ = X_ = M_ = Lambda_;
  panels_ = Panels(d, chunk);
  B_.setZero(d, chunk);
  Bt_.setZero(chunk, d);
  T_.setZero(chunk, chunk);
  U_.setZero(panels_.max_columns(), chunk);
  std::size_t most_own = 0, most = 0;
  for (std::size_t m = 0; m < apart.own.size(); ++m) {
    most_own = std::max(most_own, apart.own[m].size());
    most = std::max({most, apart.movers[m].size(), model.marker_columns(static_cast<int>(m)).size()});
  }
  d_ = y_ = lambda_;
  c_.setZero(c);
  dots_.setZero(static_cast<Eigen::Index>(most_own), static_cast<Eigen::Index>(most));
  covariance_.setZero(n, n);
}

void SmootherGivenConstants::end(const Belief& last) {
  covariance_ = last.P;
  Eigen::MatrixXd C = last.P(apart_.constant, apart_.constant);
  factor_covariance(C);
  Ct_ = C.transpose();
  lambda_.setZero();
  Lambda_.setZero();
  ended_ = true;
}

// S - S Lambda S
void SmootherGivenConstants::form(const Frame& frame) {
  M_.noalias() = Lambda_ * frame.S;
  P_ = frame.S;
  P_.noalias() -= frame.S * M_;
  mirror_lower(P_);
}

void SmootherGivenConstants::look(const Frame& frame, Eigen::VectorXd& x) {
  if (frame.anew) form(frame);
  if (ended_) {  // to the last bit; the covariance is the last one's
    x = frame.after;
    return;
  }
  x(apart_.constant) = frame.constants;
  x(apart_.moving) = frame.mean - frame.S * lambda_;
  const Eigen::Index wide = apart_.wide, constants = apart_.wide_constants;
  const auto Yt = frame.Vt.leftCols(wide);
  dd_.setZero(wide, wide);
  if (apart_.c() > 0) dd_.selfadjointView<Eigen::Lower>().rankUpdate(Yt.transpose());
  mirror_lower(dd_);
  dd_ += P_.topLeftCorner(wide, wide);
  dc_.resize(wide, constants);
  dc_.noalias() = Yt.topRows(constants).transpose() * Ct_.topLeftCorner(constants, constants);
  for (Eigen::Index k = 0; k < wide; ++k) {
    double* const column = covariance_.col(apart_.moving[k]).data();
    for (Eigen::Index l = 0; l < wide; ++l) column[apart_.moving[l]] = dd_(l, k);
    for (Eigen::Index l = 0; l < constants; ++l) column[apart_.constant[l]] = dc_(k, l);
  }
  for (Eigen::Index l = 0; l < constants; ++l) {
    double* const column = covariance_.col(apart_.constant[l]).data();
    for (Eigen::Index k = 0; k < wide; ++k) column[apart_.moving[k]] = dc_(k, l);
  }
  const auto factors_of = [&](const std::vector<int>& columns, std::vector<const double*>& factors) {
    factors.clear();  // rows of V, or of C
    for (const int column : columns) {
      const int i = apart_.place[column];
      factors.push_back(i >= 0 ? frame.Vt.col(i).data() : Ct_.col(-1 - i).data());
    }
  };
  for (std::size_t m = 0; m < apart_.own.size(); ++m) {
    const std::vector<int>& columns = model_.marker_columns(static_cast<int>(m));
    factors_of(apart_.own[m], a_);
    factors_of(columns, b_);
    dots_.setZero();
    add_dots(a_, b_, apart_.c(), dots_);
    for (std::size_t k = 0; k < a_.size(); ++k)
      for (std::size_t l = 0; l < b_.size(); ++l) {
        const int own = apart_.own[m][k], other = columns[l], i = apart_.place[own], j = apart_.place[other];
        if (i < 0 && j < 0) continue;
        double value = dots_(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l));
        if (i >= 0 && j >= 0) value += P_(i, j);
        covariance_(own, other) = covariance_(other, own) = value;
      }
  }
}

void SmootherGivenConstants::complete(const Frame& frame, int column) {
  if (ended_) return;
  const int i = apart_.place[column];
  if (i >= 0) {
    y_.noalias() = Lambda_ * frame.S.col(i);
    d_ = frame.S.col(i);
    d_.noalias() -= frame.S * y_;
    d_.noalias() += frame.Vt.transpose() * frame.Vt.col(i);
    c_.noalias() = Ct_.transpose() * frame.Vt.col(i);
    covariance_(apart_.constant, column) = c_;
  } else {
    d_.noalias() = frame.Vt.transpose() * Ct_.col(-1 - i);
  }
  covariance_(apart_.moving, column) = d_;
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
  }
  if (last && !last->anew) carry_back(frame.how, last->S);
  transposed_transition_of(frame.how, lambda_);
  by_transposed_transition(frame.how, Lambda_);
  for (int j = 0; j < apart_.d(); ++j) transposed_transition_of(frame.how, Lambda_.col(j));
  mirror_lower(Lambda_);
}

// lambda - H' L^-T (w + Z' lambda), Lambda - H' B' - B H with B = (Lambda Z - H' L^-T T / 2) L^-1, T = 1 + Z' Lambda Z.
void SmootherGivenConstants::undo_chunk(const Frame& frame, int from, int end) {
  const int rows = end - from;
  const auto Z = frame.Z.middleCols(from, rows);
  const auto L = frame.L.block(0, from, rows, rows).triangularView<Eigen::Lower>();
  const auto Lt = frame.L.block(0, from, rows, rows).transpose().triangularView<Eigen::Upper>();
  auto y = T_.col(0).head(rows);
  y = frame.w.segment(from, rows);
  y.noalias() += Z.transpose() * lambda_;
  Lt.solveInPlace(y);
  for (int r = 0; r < rows; ++r)
    for (int k = frame.begin(from + r); k < frame.row_ends[from + r]; ++k)
      lambda_(frame.columns[k]) -= frame.values[k] * y(r);
  auto B = B_.leftCols(rows);
  auto T = T_.topLeftCorner(rows, rows);
  B.noalias() = Lambda_ * Z;
  T.noalias() = Z.transpose() * B;
  T.diagonal().array() += 1.0;
  auto U = U_.topLeftCorner(rows, rows);
  U = frame.L.block(0, from, rows, rows).transpose();
  panels_.set(B);
  panels_.divide_back(U, rows);
  panels_.get(0, B);
  L.solveInPlace<Eigen::OnTheRight>(T);
  Lt.solveInPlace(T);
  T *= 0.5;
  auto Bt = Bt_.topRows(rows);  // T is symmetric, and columns are read faster than rows
  Bt = B.transpose();
  frame.add_product(-1.0, T, from, end, Bt);
  B = Bt.transpose();
  X_.setZero();
  frame.add_product(1.0, B, from, end, X_);
  add_both(-1.0, X_, Lambda_);
}

// F P F' = P - Q + Q Lambda Q + F S F' Lambda Q + (the same transposed), S of the frame before, and of P what look
// needs: all pairs that are no marker's own, and each marker's own with what moves it.
void SmootherGivenConstants::carry_back(const Transition& how, const Eigen::MatrixXd& S) {
  const int n = model_.n_free(), d = apart_.d(), wide = apart_.wide;
  X_.setZero();
  add_noise(how, Lambda_, X_);
  const Eigen::VectorXd& q = how.variance;
  const Eigen::ArrayXd s0 = how.shared.col(0), s1 = how.shared.col(1), s2 = how.shared.col(2);
  for (int j = 0; j < d; ++j) {
    auto to = P_.col(j);
    const auto x = X_.col(j);
    to.array() += q.array() * x.array();
    to.segment(0, n).array() += s0 * x.segment(n, n).array() + s1 * x.segment(2 * n, n).array();
    to.segment(n, n).array() += s0 * x.segment(0, n).array() + s2 * x.segment(2 * n, n).array();
    to.segment(2 * n, n).array() += s1 * x.segment(0, n).array() + s2 * x.segment(n, n).array();
    to(j) -= q(j);
  }
  for (int i = 0; i < n; ++i) {
    P_(i, n + i) -= s0(i);
    P_(n + i, i) -= s0(i);
    P_(i, 2 * n + i) -= s1(i);
    P_(2 * n + i, i) -= s1(i);
    P_(n + i, 2 * n + i) -= s2(i);
    P_(2 * n + i, n + i) -= s2(i);
  }
  by_transition_back(how, P_);
  by_transition_back(how, X_);
  for (int j = 0; j < d; ++j) {
    transition_back_of(how, P_.col(j));
    transposed_transition_of(how, X_.col(j));
  }
  auto M = M_.topLeftCorner(wide, wide);
  M.noalias() = S.topRows(wide) * X_.leftCols(wide);
  add_both(1.0, M, P_.topLeftCorner(wide, wide));
  const auto columns_of = [](const Eigen::MatrixXd& A, const std::vector<int>& places,
                             std::vector<const double*>& columns) {
    columns.clear();
    for (const int place : places) columns.push_back(A.col(place).data());
  };
  for (std::size_t m = 0; m < apart_.own.size(); ++m) {
    const std::vector<int>&own = apart_.own_moving[m], &movers = apart_.movers[m];
    if (own.empty()) continue;
    dots_.setZero();
    columns_of(S, own, a_);
    columns_of(X_, movers, b_);
    add_dots(a_, b_, d, dots_);
    columns_of(X_, own, a_);
    columns_of(S, movers, b_);
    add_dots(a_, b_, d, dots_);
    for (std::size_t k = 0; k < own.size(); ++k)
      for (std::size_t l = 0; l < movers.size(); ++l) {
        const double more = dots_(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(l));
        P_(own[k], movers[l]) += more;
        if (movers[l] < wide) P_(movers[l], own[k]) = P_(own[k], movers[l]);
      }
  }
}

}  // namespace dynakin
