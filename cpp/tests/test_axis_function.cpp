#include "check.hpp"
#include "dynakin/axis_function.hpp"

using dynakin::AxisFunction;

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
