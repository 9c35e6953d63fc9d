#include "check.hpp"
#include "dynakin/axis_function.hpp"

using dynakin::AxisFunction;
using dynakin::FunctionKind;
using dynakin::FunctionSpec;
using dynakin::ScalarFunction;

namespace {

ScalarFunction spline() {
  return ScalarFunction({FunctionKind::spline, {}, {-0.5, 0.1, 0.6, 1.0, 1.7}, {0.0, 0.2, 0.5, 0.3, 0.1}}, "here");
}

}  // namespace

TEST(a_spline_goes_through_its_points_and_bends_without_a_break) {
  const ScalarFunction f = spline();
  const double x[] = {-0.5, 0.1, 0.6, 1.0, 1.7}, y[] = {0.0, 0.2, 0.5, 0.3, 0.1}, h = 1e-9;
  for (int k = 0; k < 5; ++k) {
    CHECK_NEAR(f.evaluate(x[k]).value, y[k], 1e-15);
    const auto before = f.evaluate(x[k] - h), after = f.evaluate(x[k] + h);
    CHECK_NEAR(before.value, after.value, 1e-8);
    CHECK_NEAR(before.first, after.first, 1e-7);
    if (k > 0 && k < 4) CHECK_NEAR(before.second, after.second, 1e-6);
  }
  const auto beyond = f.evaluate(3.0);
  CHECK(beyond.second == 0.0 && beyond.third == 0.0);
  CHECK_NEAR(beyond.value, 0.1 + 1.3 * f.evaluate(1.7).first, 1e-14);
}

TEST(a_spline_through_four_points_is_their_cubic) {
  std::vector<double> x = {-1.0, 0.0, 0.7, 2.0}, y;
  const std::vector<double> cubic = {0.3, -1.0, 0.5, 0.2};
  for (double v : x) y.push_back(dynakin::polynomial(cubic, v).value);
  const ScalarFunction f({FunctionKind::spline, {}, x, y}, "here");
  for (double at : {-0.9, 0.3, 1.5}) {
    const auto got = f.evaluate(at), expected = dynakin::polynomial(cubic, at);
    CHECK_NEAR(got.value, expected.value, 1e-13);
    CHECK_NEAR(got.first, expected.first, 1e-13);
    CHECK_NEAR(got.second, expected.second, 1e-12);
    CHECK_NEAR(got.third, expected.third, 1e-12);
  }
}

TEST(rates_of_a_chain_are_the_time_derivatives_of_its_value) {
  const ScalarFunction line({FunctionKind::polynomial, {0.1, 0.8, 0.3}, {}, {}}, "here");
  const AxisFunction f({0.3, -1.0, 0.7, 0.2}, 0, {line, spline()});
  const double q = 0.4, qd = 1.3, qdd = -2.0, L = 0.8, h = 1e-5;
  const auto at = [&](double t) { return f.evaluate(q + qd * t + 0.5 * qdd * t * t, qd + qdd * t, qdd, L); };
  const auto moved = [&](double by) { return f.evaluate(q + by, qd, qdd, L); };
  CHECK_NEAR(at(0).sd, (at(h).s - at(-h).s) / (2 * h), 1e-8);
  CHECK_NEAR(at(0).sdd, (at(h).sd - at(-h).sd) / (2 * h), 1e-7);
  CHECK_NEAR(at(0).dsdd_dq, (moved(h).sdd - moved(-h).sdd) / (2 * h), 1e-6);
}

TEST(rates_of_a_curved_axis_are_the_time_derivatives_of_its_value) {
  const AxisFunction f({0.3, -1.0, 0.7, 0.2}, 0);
  const double q = 0.4, qd = 1.3, qdd = -2.0, L = 0.8, h = 1e-5;
  const auto at = [&](double t) { return f.evaluate(q + qd * t + 0.5 * qdd * t * t, qd + qdd * t, qdd, L); };
  CHECK_NEAR(at(0).sd, (at(h).s - at(-h).s) / (2 * h), 1e-9);
  CHECK_NEAR(at(0).sdd, (at(h).sd - at(-h).sd) / (2 * h), 1e-8);
}

TEST(partial_derivatives_of_a_curved_axis_are_its_differences) {
  const AxisFunction f({0.3, -1.0, 0.7, 0.2}, 0);
  const double q = 0.4, qd = 1.3, qdd = -2.0, L = 0.8, h = 1e-6;
  const auto m = f.evaluate(q, qd, qdd, L);
  const auto dq = [&](auto member) {
    return (f.evaluate(q + h, qd, qdd, L).*member - f.evaluate(q - h, qd, qdd, L).*member) / (2 * h);
  };
  const auto dqd = [&](auto member) {
    return (f.evaluate(q, qd + h, qdd, L).*member - f.evaluate(q, qd - h, qdd, L).*member) / (2 * h);
  };
  const auto dL = [&](auto member) {
    return (f.evaluate(q, qd, qdd, L + h).*member - f.evaluate(q, qd, qdd, L - h).*member) / (2 * h);
  };
  using M = dynakin::AxisMotion;
  CHECK_NEAR(m.ds_dq, dq(&M::s), 1e-8);
  CHECK_NEAR(m.dsd_dq, dq(&M::sd), 1e-8);
  CHECK_NEAR(m.dsdd_dq, dq(&M::sdd), 1e-7);
  CHECK_NEAR(m.ds_dq, dqd(&M::sd), 1e-8);
  CHECK_NEAR(m.dsdd_dqd, dqd(&M::sdd), 1e-7);
  CHECK_NEAR(m.ds_dL, dL(&M::s), 1e-9);
  CHECK_NEAR(m.dsd_dL, dL(&M::sd), 1e-9);
  CHECK_NEAR(m.dsdd_dL, dL(&M::sdd), 1e-8);
}

TEST(an_identity_axis_is_its_coordinate) {
  const auto m = AxisFunction().evaluate(0.5, 2.0, -3.0, 1.0);
  CHECK(m.s == 0.5 && m.sd == 2.0 && m.sdd == -3.0 && m.ds_dq == 1.0 && m.dsdd_dqd == 0.0);
}
