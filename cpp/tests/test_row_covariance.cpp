// Half of a covariance gives what J P J' gives, with any number of states and columns of zeros between the others.
#include <cstdlib>
#include <vector>

#include "check.hpp"
#include "dynakin/row_covariance.hpp"

namespace {

using Eigen::MatrixXd;
constexpr int k_states[] = {1, 7, 63, 64, 65, 150, 200};

MatrixXd covariance(int states) {
  const MatrixXd A = MatrixXd::Random(states, states);
  MatrixXd P = A * A.transpose();
  P.triangularView<Eigen::StrictlyUpper>() = P.transpose();
  return P;
}

// Every third state does not matter.
std::vector<int> columns_of(int states) {
  std::vector<int> found;
  for (int c = 0; c < states; ++c)
    if (c % 3 != 1) found.push_back(c);
  return found;
}

}  // namespace

TEST(variances_of_rows_are_those_of_the_whole_product) {
  std::srand(1);
  for (const int states : k_states) {
    const MatrixXd P = covariance(states);
    MatrixXd J = MatrixXd::Random(31, states);
    for (int c = 1; c < states; c += 3) J.col(c).setZero();
    dynakin::RowVariances variances(J.rows(), states);
    for (int round = 0; round < 2; ++round, J.col(0).setZero()) {  // nothing is left of the round before
      Eigen::VectorXd found(J.rows());
      variances(J, P, found.data());
      const Eigen::VectorXd expected = (J * P * J.transpose()).diagonal();
      CHECK((found - expected).norm() <= 1e-12 * expected.norm());
    }
  }
}

TEST(a_covariance_of_few_rows_is_the_whole_product) {
  std::srand(2);
  for (const int states : k_states) {
    const MatrixXd P = covariance(states);
    const std::vector<int> columns = columns_of(states);
    dynakin::RowCovariance covariance(states);
    for (const int rows : {6, 1, 3}) {
      Eigen::Matrix<double, 6, Eigen::Dynamic> J = Eigen::Matrix<double, 6, Eigen::Dynamic>::Zero(6, states);
      MatrixXd H(rows, columns.size());
      for (std::size_t c = 0; c < columns.size(); ++c) {
        H.col(static_cast<Eigen::Index>(c)).setRandom();
        J.col(columns[c]).head(rows) = H.col(static_cast<Eigen::Index>(c));
      }
      const dynakin::Matrix6 expected = J * P * J.transpose();
      CHECK((covariance(H, columns, P) - expected).norm() <= 1e-12 * expected.norm());
      CHECK((covariance.of_states(J, columns, P) - expected).norm() <= 1e-12 * expected.norm());
    }
  }
}
