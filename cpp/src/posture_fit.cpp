#include "dynakin/posture_fit.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace dynakin {
namespace {

constexpr int k_most_steps = 200;
constexpr double k_first_damping = 1e-3;  // of the largest diagonal element
constexpr double k_small_step = 1e-11;    // scaled: rad, or 3e-12 m
constexpr double k_small_cosine = 1e-9;   // between what is left and what a coordinate could take off it
constexpr double k_rounding = 1e-26;      // m^2: markers that are met to rounding

class Problem {
 public:
  Problem(const Model& model, const Eigen::VectorXd& x0, const PostureProblem& given)
      : model_(model), given_(given), x_(x0), state_(model), columns_(model.state_size()) {
    const Eigen::Index n = model.n_free();
    if (x0.size() != model.state_size() || given.targets.cols() != static_cast<Eigen::Index>(model.markers().size()))
      throw std::invalid_argument("posture: expected a state of " + std::to_string(model.state_size()) + " and " +
                                  std::to_string(model.markers().size()) + " markers, found " +
                                  std::to_string(x0.size()) + " and " + std::to_string(given.targets.cols()));
    for (const Eigen::VectorXd* each : {&given.lower, &given.upper, &given.scale, &given.pull, &given.rest})
      if (each->size() != n)
        throw std::invalid_argument("posture: expected " + std::to_string(n) + " numbers, a coordinate each, found " +
                                    std::to_string(each->size()));
    for (int m = 0; m < given.targets.cols(); ++m)
      for (int k = 0; k < 3; ++k)
        if (std::isfinite(given.targets(k, m))) rows_.push_back({m, k});
    if (rows_.empty()) throw std::invalid_argument("posture: no marker is measured");
    for (int c = 0; c < model.state_size(); ++c) columns_[c] = c;
    away_.resize(rows_.size());
    J_.resize(rows_.size(), n);
    marker_.resize(3, model.state_size());
  }

  double cost(const Eigen::VectorXd& q) {
    x_.head(q.size()) = q;
    forward_kinematics(model_, x_, state_);
    for (std::size_t r = 0; r < rows_.size(); ++r)
      away_(r) = state_.markers[rows_[r].marker](rows_[r].axis) - given_.targets(rows_[r].axis, rows_[r].marker);
    return 0.5 * (away_.squaredNorm() + given_.pull.cwiseProduct(q - given_.rest).squaredNorm());
  }

  // Gradient and Gauss-Newton matrix w.r.t. scaled coordinates, where `cost` was asked for last.
  void linearise(const Eigen::VectorXd& q, Eigen::VectorXd& gradient, Eigen::MatrixXd& H) {
    const Eigen::Index n = q.size();
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      if (r == 0 || rows_[r].marker != rows_[r - 1].marker)
        marker_jacobian(model_, state_, rows_[r].marker, columns_, marker_);
      J_.row(r) = marker_.row(rows_[r].axis).head(n);
    }
    J_ *= given_.scale.asDiagonal();
    const Eigen::VectorXd pull = given_.pull.cwiseProduct(given_.scale);
    gradient = J_.transpose() * away_ + pull.cwiseProduct(given_.pull.cwiseProduct(q - given_.rest));
    H.noalias() = J_.transpose() * J_;
    H.diagonal() += pull.cwiseAbs2();
  }

 private:
  struct Row {
    int marker, axis;
  };
  const Model& model_;
  const PostureProblem& given_;
  Eigen::VectorXd x_;
  KinematicState state_;
  std::vector<int> columns_;
  std::vector<Row> rows_;
  Eigen::VectorXd away_;
  Eigen::MatrixXd J_;
  Eigen::Matrix3Xd marker_;
};

}  // namespace

PostureFit fit_posture(const Model& model, const Eigen::VectorXd& x0, const PostureProblem& problem,
                       const Eigen::VectorXd& start) {
  Problem residual(model, x0, problem);
  const Eigen::Index n = model.n_free();
  if (start.size() != n)
    throw std::invalid_argument("posture: expected a start of " + std::to_string(n) + " coordinates, found " +
                                std::to_string(start.size()));
  PostureFit fit{start.cwiseMax(problem.lower).cwiseMin(problem.upper), 0.0, false};
  fit.cost = residual.cost(fit.q);
  if (n == 0) {
    fit.converged = true;
    return fit;
  }
  Eigen::VectorXd gradient(n), step(n), next(n), moved;
  Eigen::MatrixXd H(n, n), reduced;
  Eigen::LDLT<Eigen::MatrixXd> factor;
  std::vector<Eigen::Index> free;
  residual.linearise(fit.q, gradient, H);
  double damping = k_first_damping * H.diagonal().maxCoeff(), growth = 2.0;
  for (int done = 0; done < k_most_steps && !fit.converged; ++done) {
    free.clear();
    for (Eigen::Index i = 0; i < n; ++i) {
      const bool held = problem.lower(i) >= problem.upper(i) || (fit.q(i) <= problem.lower(i) && gradient(i) > 0.0) ||
                        (fit.q(i) >= problem.upper(i) && gradient(i) < 0.0);
      if (!held) free.push_back(i);
    }
    double cosine = 0.0;
    for (const Eigen::Index i : free)
      if (H(i, i) > 0.0) cosine = std::max(cosine, std::abs(gradient(i)) / std::sqrt(2.0 * fit.cost * H(i, i)));
    if (free.empty() || fit.cost < k_rounding || cosine < k_small_cosine) {
      fit.converged = true;
      break;
    }
    reduced = H(free, free);
    reduced.diagonal().array() += damping;
    factor.compute(reduced);
    step.setZero();
    moved = -gradient(free);
    factor.solveInPlace(moved);
    step(free) = moved;
    next = (fit.q + problem.scale.cwiseProduct(step)).cwiseMax(problem.lower).cwiseMin(problem.upper);
    step = (next - fit.q).cwiseQuotient(problem.scale);
    const double expected = -gradient.dot(step) - 0.5 * step.dot(H * step);
    const double cost = residual.cost(next);
    const double gain = fit.cost - cost;
    if (gain >= 0.0) {
      fit.converged = step.cwiseAbs().maxCoeff() < k_small_step;
      fit.q = next;
      fit.cost = cost;
      residual.linearise(fit.q, gradient, H);
      const double ratio = expected > 0.0 ? gain / expected : 0.0;
      damping *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * ratio - 1.0, 3));
      growth = 2.0;
    } else {
      fit.converged = step.cwiseAbs().maxCoeff() < k_small_step;
      damping *= growth;
      growth *= 2.0;
    }
  }
  return fit;
}

}  // namespace dynakin
