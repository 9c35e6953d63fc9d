// A transition of what moves, of matrices with a column for each that moves: coordinates, speeds and accelerations
// first, then what only decays.
#pragma once

#include <Eigen/Core>

#include "dynakin/process.hpp"

namespace dynakin {

// M F'
template <class Matrix>
void by_transition(const Transition& how, Matrix&& M) {
  const Eigen::Index n = how.shared.rows();
  const double dt = how.step, half = 0.5 * dt * dt;
  M.middleCols(0, n) += dt * M.middleCols(n, n) + half * M.middleCols(2 * n, n);
  M.middleCols(n, n) += dt * M.middleCols(2 * n, n);
  for (Eigen::Index j = 3 * n; j < M.cols(); ++j)
    if (how.kept(j) != 1.0) M.col(j) *= how.kept(j);
}

// M F^-T
inline void by_transition_back(const Transition& how, Eigen::MatrixXd& M) {
  const Eigen::Index n = how.shared.rows();
  const double dt = how.step, half = 0.5 * dt * dt;
  M.middleCols(0, n) += half * M.middleCols(2 * n, n) - dt * M.middleCols(n, n);
  M.middleCols(n, n) -= dt * M.middleCols(2 * n, n);
  for (Eigen::Index j = 3 * n; j < M.cols(); ++j)
    if (how.kept(j) != 1.0) M.col(j) /= how.kept(j);
}

// M F
inline void by_transposed_transition(const Transition& how, Eigen::MatrixXd& M) {
  const Eigen::Index n = how.shared.rows();
  const double dt = how.step, half = 0.5 * dt * dt;
  M.middleCols(2 * n, n) += dt * M.middleCols(n, n) + half * M.middleCols(0, n);
  M.middleCols(n, n) += dt * M.middleCols(0, n);
  for (Eigen::Index j = 3 * n; j < M.cols(); ++j)
    if (how.kept(j) != 1.0) M.col(j) *= how.kept(j);
}

// F x, F^-1 x and F' x: of matrices a column at a time, which stays in the cache.
template <class Column>
void transition_of(const Transition& how, Column&& x) {
  const Eigen::Index n = how.shared.rows(), rest = x.size() - 3 * n;
  const double dt = how.step;
  x.segment(0, n) += dt * x.segment(n, n) + (0.5 * dt * dt) * x.segment(2 * n, n);
  x.segment(n, n) += dt * x.segment(2 * n, n);
  x.tail(rest).array() *= how.kept.tail(rest).array();
}
template <class Column>
void transition_back_of(const Transition& how, Column&& x) {
  const Eigen::Index n = how.shared.rows(), rest = x.size() - 3 * n;
  const double dt = how.step;
  x.segment(0, n) += (0.5 * dt * dt) * x.segment(2 * n, n) - dt * x.segment(n, n);
  x.segment(n, n) -= dt * x.segment(2 * n, n);
  x.tail(rest).array() /= how.kept.tail(rest).array();
}
template <class Column>
void transposed_transition_of(const Transition& how, Column&& x) {
  const Eigen::Index n = how.shared.rows(), rest = x.size() - 3 * n;
  const double dt = how.step;
  x.segment(2 * n, n) += dt * x.segment(n, n) + (0.5 * dt * dt) * x.segment(0, n);
  x.segment(n, n) += dt * x.segment(0, n);
  x.tail(rest).array() *= how.kept.tail(rest).array();
}

// out + M Q
inline void add_noise(const Transition& how, const Eigen::MatrixXd& M, Eigen::MatrixXd& out) {
  const Eigen::Index n = how.shared.rows();
  const auto& q = how.variance;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double q_qd = how.shared(i, 0), q_qdd = how.shared(i, 1), qd_qdd = how.shared(i, 2);
    out.col(i) += q(i) * M.col(i) + q_qd * M.col(n + i) + q_qdd * M.col(2 * n + i);
    out.col(n + i) += q_qd * M.col(i) + q(n + i) * M.col(n + i) + qd_qdd * M.col(2 * n + i);
    out.col(2 * n + i) += q_qdd * M.col(i) + qd_qdd * M.col(n + i) + q(2 * n + i) * M.col(2 * n + i);
  }
  for (Eigen::Index i = 3 * n; i < M.cols(); ++i) out.col(i) += q(i) * M.col(i);
}

}  // namespace dynakin
