#include "dynakin/process.hpp"

namespace dynakin {

void predict_diagonal(const Model& model, double dt, const Eigen::VectorXd& process_variance, Eigen::VectorXd& x,
                      Eigen::MatrixXd& P) {
  const int n = model.n_free();
  const int rest = model.state_size() - 3 * n;
  const double half = 0.5 * dt * dt;

  x.segment(0, n) += dt * x.segment(n, n) + half * x.segment(2 * n, n);
  x.segment(n, n) += dt * x.segment(2 * n, n);

  // P F', then F (P F') on the 3n rows that it changes; the lower triangle is the truth, mirrored.
  P.middleCols(0, n) += dt * P.middleCols(n, n) + half * P.middleCols(2 * n, n);
  P.middleCols(n, n) += dt * P.middleCols(2 * n, n);
  auto top = P.topLeftCorner(3 * n, 3 * n);
  top.middleRows(0, n) += dt * top.middleRows(n, n) + half * top.middleRows(2 * n, n);
  top.middleRows(n, n) += dt * top.middleRows(2 * n, n);
  for (int j = 1; j < 3 * n; ++j) top.col(j).head(j) = top.row(j).head(j).transpose();
  P.topRightCorner(3 * n, rest) = P.bottomLeftCorner(rest, 3 * n).transpose();
  P.diagonal() += process_variance;
}

}  // namespace dynakin
