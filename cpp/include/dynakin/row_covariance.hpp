// J P J' of rows that hang on some of the states alone. P is symmetric: only the half at and below its diagonal is
// read.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "dynakin/spatial.hpp"

namespace dynakin {

// Of as many rows as one likes, the variances.
class RowVariances {
 public:
  RowVariances(Eigen::Index rows, Eigen::Index states);
  // out[k] = (J P J')_kk, J (rows, n).
  void operator()(const Eigen::Ref<const Eigen::MatrixXd>& J, const Eigen::MatrixXd& P, double* out);

 private:
  std::vector<Eigen::Index> columns_;  // of J, those that are not zero
  Eigen::MatrixXd J_, P_, JP_;         // over these
};

// Of six rows at most, their whole covariance.
class RowCovariance {
 public:
  explicit RowCovariance(Eigen::Index states);
  // H (rows, columns): of these columns of P, other states do not matter. In the first rows and columns of the result,
  // the others are zero.
  const Matrix6& operator()(const Eigen::Ref<const Eigen::MatrixXd>& H, const std::vector<int>& columns,
                            const Eigen::MatrixXd& P);
  // The same of J (6, n), zero but in these columns.
  const Matrix6& of_states(const Eigen::Matrix<double, 6, Eigen::Dynamic>& J, const std::vector<int>& columns,
                           const Eigen::MatrixXd& P);

 private:
  const Matrix6& of_columns(const std::vector<int>& columns, const Eigen::MatrixXd& P);

  Eigen::Matrix<double, 8, Eigen::Dynamic> H_;  // as long as the widest vector: rows of zero below
  Matrix6 covariance_;
};

}  // namespace dynakin
