#include "dynakin/scalar_function.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace dynakin {
namespace {

void check_finite(const std::vector<double>& numbers, const std::string& where, const char* what) {
  for (double v : numbers)
    if (!std::isfinite(v)) throw std::invalid_argument(where + ": " + what + " is not a finite number");
}

void check_knots(const FunctionSpec& spec, const std::string& where) {
  if (spec.x.size() != spec.y.size())
    throw std::invalid_argument(where + ": a function of " + std::to_string(spec.x.size()) + " x and " +
                                std::to_string(spec.y.size()) + " y, expected as many");
  if (spec.x.size() < 2)
    throw std::invalid_argument(where + ": a function through " + std::to_string(spec.x.size()) +
                                " points, expected 2 or more");
  check_finite(spec.x, where, "an x of a function");
  check_finite(spec.y, where, "a y of a function");
  for (std::size_t k = 1; k < spec.x.size(); ++k)
    if (spec.x[k] <= spec.x[k - 1])
      throw std::invalid_argument(where + ": x of a function must increase, found " + std::to_string(spec.x[k]) +
                                  " after " + std::to_string(spec.x[k - 1]));
}

}  // namespace

// Faa di Bruno's formula.
Derivatives compose(const Derivatives& f, const Derivatives& g) {
  return {f.value, f.first * g.first, f.second * g.first * g.first + f.first * g.second,
          f.third * g.first * g.first * g.first + 3.0 * f.second * g.first * g.second + f.first * g.third};
}

Derivatives polynomial(const std::vector<double>& coefficients, double x) {
  double f0 = 0.0, f1 = 0.0, f2 = 0.0, f3 = 0.0;  // by Horner's scheme
  for (auto c = coefficients.rbegin(); c != coefficients.rend(); ++c) {
    f3 = f3 * x + 3.0 * f2;
    f2 = f2 * x + 2.0 * f1;
    f1 = f1 * x + f0;
    f0 = f0 * x + *c;
  }
  return {f0, f1, f2, f3};
}

ScalarFunction::ScalarFunction(const FunctionSpec& spec, const std::string& where) {
  if (spec.kind == FunctionKind::polynomial) {
    if (spec.coefficients.empty()) throw std::invalid_argument(where + ": a polynomial without coefficients");
    check_finite(spec.coefficients, where, "a coefficient");
    coefficients_ = spec.coefficients;
    return;
  }
  check_knots(spec, where);
  knots_ = spec.x;
  values_ = spec.y;
  pieces_.resize(knots_.size(), {0.0, 0.0, 0.0});
  if (spec.kind == FunctionKind::piecewise_linear || knots_.size() == 2)
    join_linearly();
  else
    join_by_spline();
}

void ScalarFunction::join_linearly() {
  for (std::size_t k = 0; k + 1 < knots_.size(); ++k)
    pieces_[k][0] = (values_[k + 1] - values_[k]) / (knots_[k + 1] - knots_[k]);
  pieces_.back()[0] = pieces_[pieces_.size() - 2][0];
}

// Twice continuously differentiable cubics; at either end the third derivative is that of the cubic through the four
// outermost points, 0 of three points (Forsythe, Malcolm and Moler, Computer methods for mathematical computations,
// 1977, section 4.4: what OpenSim's SimmSpline does). Unknowns: sixths of the second derivatives at the knots.
void ScalarFunction::join_by_spline() {
  const std::size_t n = knots_.size();
  std::vector<double> width(n - 1), slope(n - 1), diagonal(n), sixth(n);
  for (std::size_t k = 0; k + 1 < n; ++k) {
    width[k] = knots_[k + 1] - knots_[k];
    slope[k] = (values_[k + 1] - values_[k]) / width[k];
  }
  const auto third_difference = [&](std::size_t k) {  // of the points k to k + 3
    const double left = (slope[k + 1] - slope[k]) / (knots_[k + 2] - knots_[k]);
    const double right = (slope[k + 2] - slope[k + 1]) / (knots_[k + 3] - knots_[k + 1]);
    return (right - left) / (knots_[k + 3] - knots_[k]);
  };
  diagonal[0] = -width[0];
  diagonal[n - 1] = -width[n - 2];
  sixth[0] = n > 3 ? width[0] * width[0] * third_difference(0) : 0.0;
  sixth[n - 1] = n > 3 ? -width[n - 2] * width[n - 2] * third_difference(n - 4) : 0.0;
  for (std::size_t k = 1; k + 1 < n; ++k) {
    diagonal[k] = 2.0 * (width[k - 1] + width[k]);
    sixth[k] = slope[k] - slope[k - 1];
  }
  for (std::size_t k = 1; k < n; ++k) {  // a symmetric tridiagonal system, widths off the diagonal
    const double factor = width[k - 1] / diagonal[k - 1];
    diagonal[k] -= factor * width[k - 1];
    sixth[k] -= factor * sixth[k - 1];
  }
  sixth[n - 1] /= diagonal[n - 1];
  for (std::size_t k = n - 1; k-- > 0;) sixth[k] = (sixth[k] - width[k] * sixth[k + 1]) / diagonal[k];
  for (std::size_t k = 0; k + 1 < n; ++k)
    pieces_[k] = {slope[k] - width[k] * (sixth[k + 1] + 2.0 * sixth[k]), 3.0 * sixth[k],
                  (sixth[k + 1] - sixth[k]) / width[k]};
  pieces_[n - 1][0] = slope[n - 2] + width[n - 2] * (sixth[n - 2] + 2.0 * sixth[n - 1]);
}

// Straight on beyond the first and the last knot.
Derivatives ScalarFunction::evaluate(double x) const {
  if (!coefficients_.empty()) return polynomial(coefficients_, x);
  if (x < knots_.front())
    return {values_.front() + pieces_.front()[0] * (x - knots_.front()), pieces_.front()[0], 0, 0};
  if (x > knots_.back()) return {values_.back() + pieces_.back()[0] * (x - knots_.back()), pieces_.back()[0], 0, 0};
  const auto above = std::upper_bound(knots_.begin() + 1, knots_.end() - 1, x);
  const std::size_t k = static_cast<std::size_t>(above - knots_.begin()) - 1;
  const auto& [b, c, d] = pieces_[k];
  const double h = x - knots_[k];
  return {values_[k] + h * (b + h * (c + h * d)), b + h * (2.0 * c + h * 3.0 * d), 2.0 * c + 6.0 * d * h, 6.0 * d};
}

}  // namespace dynakin
