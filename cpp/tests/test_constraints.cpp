#include <Eigen/Cholesky>
#include <limits>

#include "check.hpp"
#include "dynakin/constraints.hpp"

using namespace dynakin;

namespace {

FilterSettings bounded(double lower, double upper) {
  FilterSettings settings;
  settings.lower = Eigen::VectorXd::Constant(3, lower);
  settings.upper = Eigen::VectorXd::Constant(3, upper);
  return settings;
}

const Eigen::MatrixXd P0 = (Eigen::MatrixXd(3, 3) << 2.0, 0.5, 0.1, 0.5, 1.0, 0.2, 0.1, 0.2, 3.0).finished();

}  // namespace

TEST(an_element_beyond_its_bound_lands_on_it_exactly) {
  Eigen::VectorXd x(3);
  x << 0.1, 1.7, -0.4;
  Eigen::MatrixXd P = P0;
  CHECK(GainConstraint(3).apply(bounded(-0.3, 1.1), 5.0, x, P) == 2);
  CHECK(x(0) == 0.1 && x(1) == 1.1 && x(2) == -0.3);
}

TEST(the_covariance_grows_by_the_correction_over_the_innovation) {
  Eigen::VectorXd x(3), d(3);
  x << 0.1, 1.7, -0.4;
  d << 0.0, -0.6, 0.1;
  Eigen::MatrixXd P = P0;
  GainConstraint(3).apply(bounded(-0.3, 1.1), 5.0, x, P);
  CHECK((P - P0 - d * d.transpose() / 5.0).cwiseAbs().maxCoeff() < 1e-15);
  CHECK(P == P.transpose());
  CHECK(P.llt().info() == Eigen::Success);
}

TEST(without_innovation_only_the_mean_moves) {
  Eigen::VectorXd x(3);
  x << 0.1, 1.7, -0.4;
  Eigen::MatrixXd P = P0;
  CHECK(GainConstraint(3).apply(bounded(-0.3, 1.1), 0.0, x, P) == 2);
  CHECK(x(1) == 1.1 && P == P0);
}

TEST(a_state_within_its_bounds_is_left_alone) {
  Eigen::VectorXd x(3);
  x << 0.1, 1.7, -0.4;
  const Eigen::VectorXd before = x;
  Eigen::MatrixXd P = P0;
  const double inf = std::numeric_limits<double>::infinity();
  CHECK(GainConstraint(3).apply(bounded(-inf, inf), 5.0, x, P) == 0);
  CHECK(x == before && P == P0);
}
