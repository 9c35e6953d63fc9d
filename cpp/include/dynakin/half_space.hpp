// a' x >= bound with few coefficients.
#pragma once

#include <Eigen/Core>
#include <array>

namespace dynakin {

struct HalfSpace {
  int size = 0;
  std::array<int, 10> index{};
  std::array<double, 10> value{};
  double bound = 0.0;

  void set(int i, double a, double b) {
    size = 1;
    index[0] = i;
    value[0] = a;
    bound = b;
  }
  double dot(const Eigen::Ref<const Eigen::VectorXd>& x) const {
    double sum = 0.0;
    for (int k = 0; k < size; ++k) sum += value[k] * x(index[k]);
    return sum;
  }
  // a' P a
  double variance(const Eigen::MatrixXd& P) const {
    double sum = 0.0;
    for (int k = 0; k < size; ++k)
      for (int l = 0; l < size; ++l) sum += value[k] * value[l] * P(index[k], index[l]);
    return sum;
  }
  // out = M a
  template <class Out>
  void times(const Eigen::MatrixXd& M, Out&& out) const {
    out.setZero();
    for (int k = 0; k < size; ++k) out += value[k] * M.col(index[k]);
  }
};

}  // namespace dynakin
