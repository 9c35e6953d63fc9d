// Motion along one axis as a function of its coordinate: s = L p(f_n(... f_1(q))), p a polynomial, L a geometry
// parameter or 1.
#pragma once

#include <vector>

#include "dynakin/scalar_function.hpp"

namespace dynakin {

// Value, rate and second rate of s, and their partial derivatives w.r.t. q, qd, qdd and L.
// ds/dq = dsd/dqd = dsdd/dqdd, so one number serves the three.
struct AxisMotion {
  double s, sd, sdd;
  double ds_dq, dsd_dq, dsdd_dq, dsdd_dqd;
  double ds_dL, dsd_dL, dsdd_dL;
};

class AxisFunction {
 public:
  AxisFunction() = default;
  AxisFunction(std::vector<double> coefficients, int scale_parameter, std::vector<ScalarFunction> inner = {});

  int scale_parameter() const { return scale_parameter_; }
  AxisMotion evaluate(double q, double qd, double qdd, double scale) const;

 private:
  std::vector<double> coefficients_ = {0.0, 1.0};
  int scale_parameter_ = -1;  // index of a geometry parameter, -1: none
  std::vector<ScalarFunction> inner_;
  bool identity_ = true;
};

}  // namespace dynakin
