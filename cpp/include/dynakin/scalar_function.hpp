// A function of one number with its first three derivatives: a polynomial, or cubics between knots.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "dynakin/spec.hpp"

namespace dynakin {

struct Derivatives {
  double value, first, second, third;
};

// (outer o inner) at one place: outer evaluated at inner.value.
Derivatives compose(const Derivatives& outer, const Derivatives& inner);

Derivatives polynomial(const std::vector<double>& coefficients, double x);

class ScalarFunction {
 public:
  // Throws std::invalid_argument, the message opened by where: lists of different or too small sizes, numbers that are
  // not finite, knots that do not increase.
  ScalarFunction(const FunctionSpec& spec, const std::string& where);

  Derivatives evaluate(double x) const;

 private:
  void join_linearly();
  void join_by_spline();

  std::vector<double> coefficients_;  // of the polynomial; empty where there are knots
  std::vector<double> knots_, values_;
  std::vector<std::array<double, 3>> pieces_;  // b, c, d behind each knot: y + b h + c h^2 + d h^3; last: slope only
};

}  // namespace dynakin
