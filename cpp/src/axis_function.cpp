#include "dynakin/axis_function.hpp"

#include <utility>

namespace dynakin {

AxisFunction::AxisFunction(std::vector<double> coefficients, int scale_parameter, std::vector<ScalarFunction> inner)
    : coefficients_(std::move(coefficients)),
      scale_parameter_(scale_parameter),
      inner_(std::move(inner)),
      identity_(scale_parameter < 0 && inner_.empty() && coefficients_ == std::vector<double>{0.0, 1.0}) {}

AxisMotion AxisFunction::evaluate(double q, double qd, double qdd, double scale) const {
  if (identity_) return {q, qd, qdd, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  Derivatives f;
  if (inner_.empty()) {
    f = polynomial(coefficients_, q);
  } else {
    f = inner_.front().evaluate(q);
    for (std::size_t k = 1; k < inner_.size(); ++k) f = compose(inner_[k].evaluate(f.value), f);
    f = compose(polynomial(coefficients_, f.value), f);
  }
  const double rate = f.first * qd;
  const double second_rate = f.first * qdd + f.second * qd * qd;
  return {scale * f.value,
          scale * rate,
          scale * second_rate,
          scale * f.first,
          scale * f.second * qd,
          scale * (f.second * qdd + f.third * qd * qd),
          scale * 2.0 * f.second * qd,
          f.value,
          rate,
          second_rate};
}

}  // namespace dynakin
