#include "dynakin/backward_pass.hpp"

#include <algorithm>
#include <stdexcept>

#include "dynakin/process.hpp"
#include "mirror.hpp"

namespace dynakin {
namespace {

// out += A B. In panels of the inner dimension, so that Eigen's packed panels stay on the stack.
template <class Out, class A, class B>
void add_product(const A& a, const B& b, Out&& out) {
  constexpr Eigen::Index panel = 32;
  for (Eigen::Index k = 0; k < a.cols(); k += panel) {
    const Eigen::Index w = std::min(panel, a.cols() - k);
    out.noalias() += a.middleCols(k, w) * b.middleRows(k, w);
  }
}

}  // namespace

// The smoother undoes optimal gains; (7) restricts the gain, and a sigmoid bends the state between frames.
const FilterSettings& smoothable(const FilterSettings& settings) {
  const bool plain = settings.constraint == ConstraintKind::none || settings.constraint == ConstraintKind::projection;
  if (!plain && (settings.lower.array().isFinite().any() || settings.upper.array().isFinite().any()))
    throw std::invalid_argument(std::string("smoothing: bounds are kept by constraint '") +
                                (settings.constraint == ConstraintKind::gain ? "gain" : "sigmoid") +
                                "', which has no smoother, expected 'projection' or 'none'");
  return settings;
}

BackwardPass::BackwardPass(const Model& model, const FilterSettings& settings, int max_rows, bool covariance)
    : model_(model), settings_(smoothable(settings)), projection_(model, settings), covariance_(covariance) {
  const int n = model.state_size();
  lambda_.setZero(n);
  y_.setZero(max_rows);
  if (!covariance) return;
  Lambda_.setZero(n, n);
  LambdaP_.setZero(n, n);
  G_.setZero(n, max_rows);
  B_.setZero(n, max_rows);
  T_.setZero(max_rows, max_rows);
  touched_.reserve(n);
  Au_.setZero(n, max_rows);
  U_.setZero(n, n);
}

void BackwardPass::start() {
  zero_ = true;
  lambda_.setZero();
  Lambda_.setZero();
}

void BackwardPass::undo(const FrameTape& tape, double dt) {
  if (tape.cut) {  // the frames before know nothing of those after
    start();
    return;
  }
  if (tape.pulled) lambda_ -= tape.pull;
  for (std::size_t c = tape.ends.size(); c-- > 0;) {
    const int from = c == 0 ? 0 : tape.ends[c - 1];
    undo_chunk(tape, from, tape.ends[c] - from);
    zero_ = false;
  }
  if (tape.any_forgotten)
    for (int i = 0; i < model_.state_size(); ++i) {
      if (!tape.forgotten[i]) continue;
      lambda_(i) = 0.0;
      if (!covariance_) continue;
      Lambda_.row(i).setZero();
      Lambda_.col(i).setZero();
    }
  transpose_transition(model_, settings_, dt, lambda_);
  if (covariance_) transpose_transition(model_, settings_, dt, Lambda_);
}

// lambda - A'(w + Z lambda), and (1 - Z'A)' Lambda (1 - Z'A) + A'A = Lambda + A'B + B'A with
// B = (1 + Z Lambda Z') A / 2 - Z Lambda. A and Z stand transposed on the tape.
void BackwardPass::undo_chunk(const FrameTape& tape, int from, int rows) {
  const auto At = tape.A.middleCols(from, rows);
  const auto Zt = tape.Z.middleCols(from, rows);
  auto y = y_.head(rows);
  y = tape.w.segment(from, rows);
  y.noalias() += Zt.transpose() * lambda_;
  lambda_.noalias() -= At * y;
  if (!covariance_) return;
  auto Gt = G_.leftCols(rows);
  auto Bt = B_.leftCols(rows);
  auto T = T_.topLeftCorner(rows, rows);
  Gt.setZero();
  if (!zero_) add_product(Lambda_, Zt, Gt);
  T.noalias() = Zt.transpose() * Gt;
  T *= 0.5;
  T.diagonal().array() += 0.5;
  Bt = -Gt;
  Bt.noalias() += At * T;
  // A' B + B' A: most rows of A' are zero, as a marker moves with few states.
  touched_.clear();
  for (Eigen::Index i = 0; i < At.rows(); ++i) {
    if (At.row(i).isZero(0.0)) continue;
    Au_.row(static_cast<Eigen::Index>(touched_.size())).head(rows) = At.row(i);
    touched_.push_back(static_cast<int>(i));
  }
  const auto some = static_cast<Eigen::Index>(touched_.size());
  auto U = U_.topRows(some);
  constexpr Eigen::Index width = 128;  // what Eigen packs stays on the stack
  for (Eigen::Index c = 0; c < U.cols(); c += width) {
    const Eigen::Index w = std::min(width, U.cols() - c);
    U.middleCols(c, w).noalias() = Au_.topLeftCorner(some, rows) * Bt.middleRows(c, w).transpose();
  }
  for (Eigen::Index c = 0; c < U.cols(); ++c)
    for (Eigen::Index k = some; k-- > 0 && touched_[k] >= c;) Lambda_(touched_[k], c) += U(k, c);
  for (Eigen::Index k = 0; k < some; ++k) {
    const Eigen::Index c = touched_[k], below = U.cols() - c;
    Lambda_.col(c).tail(below) += U.row(k).tail(below).transpose();
  }
  mirror_lower(Lambda_);
}

void BackwardPass::smooth(const Eigen::VectorXd& x, const Eigen::MatrixXd& P, Eigen::VectorXd& x_smooth) const {
  x_smooth = x;
  x_smooth.noalias() -= P * lambda_;
}

void BackwardPass::smooth(const Eigen::MatrixXd& P, Eigen::MatrixXd& P_smooth) {
  P_smooth = P;
  if (zero_) return;
  LambdaP_.setZero();
  add_product(Lambda_, P, LambdaP_);
  constexpr Eigen::Index panel = 32;
  for (Eigen::Index k = 0; k < P.cols(); k += panel) {
    const Eigen::Index w = std::min(panel, P.cols() - k);
    P_smooth.triangularView<Eigen::Lower>() -= P.middleCols(k, w) * LambdaP_.middleRows(k, w);
  }
  mirror_lower(P_smooth);
}

void BackwardPass::bound(Eigen::VectorXd& x, const Eigen::MatrixXd& P) {
  if (settings_.constraint == ConstraintKind::projection) projection_.bound(x, P);
}

}  // namespace dynakin
