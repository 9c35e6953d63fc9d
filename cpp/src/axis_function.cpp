#include "dynakin/axis_function.hpp"

#include <utility>

namespace dynakin {

AxisFunction::AxisFunction(std::vector<double> coefficients, int scale_parameter)
    : coefficients_(std::move(coefficients)),
      scale_parameter_(scale_parameter),
      identity_(scale_parameter < 0 && coefficients_ == std::vector<double>{0.0, 1.0}) {}

AxisMotion AxisFunction::evaluate(double q, double qd, double qdd, double scale) const {
  if (identity_) return {q, qd, qdd, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  double f0 = 0.0, f1 = 0.0, f2 = 0.0, f3 = 0.0;  // f and its derivatives, by Horner's scheme
  for (auto c = coefficients_.rbegin(); c != coefficients_.rend(); ++c) {
    f3 = f3 * q + 3.0 * f2;
    f2 = f2 * q + 2.0 * f1;
    f1 = f1 * q + f0;
    f0 = f0 * q + *c;
  }
  const double rate = f1 * qd;
  const double second_rate = f1 * qdd + f2 * qd * qd;
  return {scale * f0,
          scale * rate,
          scale * second_rate,
          scale * f1,
          scale * f2 * qd,
          scale * (f2 * qdd + f3 * qd * qd),
          scale * 2.0 * f2 * qd,
          f0,
          rate,
          second_rate};
}

}  // namespace dynakin
