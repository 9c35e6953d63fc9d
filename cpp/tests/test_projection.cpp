// given bounds, equalities and inertia that must be possible, when a state is projected, then the result is the nearest
// one in the metric of P^-1. Judged by the conditions of Karush, Kuhn and Tucker, which are sufficient here.
#include <Eigen/Cholesky>
#include <cmath>
#include <random>

#include "check.hpp"
#include "dynakin/projection.hpp"
#include "models.hpp"

using namespace dynakin;

namespace {

std::mt19937 generator(7);
double normal() { return std::normal_distribution<>()(generator); }
double uniform(double a, double b) { return std::uniform_real_distribution<>(a, b)(generator); }

ModelSpec without_inertia(ModelSpec spec) {
  for (SegmentSpec& s : spec.segments) s.inertia_estimated.fill(false);
  return spec;
}

// Variances from 1e-8 to 1e4, correlations of any size.
Eigen::MatrixXd random_covariance(int n, int common) {
  Eigen::MatrixXd root = Eigen::MatrixXd::NullaryExpr(n, common, [] { return normal(); });
  Eigen::MatrixXd P = root * root.transpose() + uniform(1e-3, 1.0) * Eigen::MatrixXd::Identity(n, n);
  for (int i = 0; i < n; ++i) {
    const double s = std::sqrt(std::pow(10.0, uniform(-8.0, 4.0)) / P(i, i));
    P.row(i) *= s;
    P.col(i) *= s;
  }
  return 0.5 * (P + P.transpose());
}

struct Problem {
  FilterSettings settings;
  Eigen::VectorXd x;
  Eigen::MatrixXd P;
};

Problem random_problem(const Model& model, double bounded) {
  const int n = model.state_size();
  Problem p{settings_for(model), Eigen::VectorXd(n), random_covariance(n, n / 2)};
  p.settings.constraint = ConstraintKind::projection;
  for (int i = 0; i < n; ++i) {
    const double sd = std::sqrt(p.P(i, i)), middle = model.initial_state()(i);
    p.x(i) = middle + sd * normal();
    if (uniform(0.0, 1.0) < bounded) p.settings.lower(i) = middle - sd * uniform(0.0, 1.5);
    if (uniform(0.0, 1.0) < bounded) p.settings.upper(i) = middle + sd * uniform(0.0, 1.5);
  }
  return p;
}

// Largest violation of: y within bounds; P^-1 (y - x) presses against bounds that y lies on, and elsewhere is 0.
// All in standard deviations.
double optimality_gap(const Problem& p, const Eigen::VectorXd& y) {
  const Eigen::VectorXd sd = p.P.diagonal().cwiseSqrt();
  const Eigen::MatrixXd C = sd.cwiseInverse().asDiagonal() * p.P * sd.cwiseInverse().asDiagonal();
  const Eigen::VectorXd pull = C.llt().solve(Eigen::VectorXd((y - p.x).cwiseQuotient(sd)));
  double gap = 0.0;
  for (int i = 0; i < y.size(); ++i) {
    gap = std::max({gap, (p.settings.lower(i) - y(i)) / sd(i), (y(i) - p.settings.upper(i)) / sd(i)});
    const bool below = y(i) == p.settings.lower(i), above = y(i) == p.settings.upper(i);
    if (!(below && above)) gap = std::max(gap, below ? -pull(i) : above ? pull(i) : std::abs(pull(i)));
  }
  return gap;
}

}  // namespace

TEST(the_projection_is_the_nearest_state_within_many_bounds) {
  for (const ModelSpec& spec : {without_inertia(planar_chain()), without_inertia(spatial_tree())}) {
    const Model model(spec);
    int most = 0;
    for (int k = 0; k < 60; ++k) {
      Problem p = random_problem(model, uniform(0.1, 0.9));
      Projection projection(model, p.settings);
      Eigen::VectorXd y = p.x;
      Eigen::MatrixXd P = p.P;
      const ProjectionReport report = projection.apply(y, P);
      CHECK(report.solved);
      CHECK(P == p.P);  // inequalities move the mean only
      CHECK(optimality_gap(p, y) < 1e-6);
      most = std::max(most, report.active);
    }
    CHECK(most > 20);
  }
}

TEST(a_start_from_the_wrong_constraints_ends_at_the_same_state) {
  const Model model(without_inertia(planar_chain()));
  Problem p = random_problem(model, 0.7);
  Projection warm(model, p.settings);
  int released = 0, before = 0;
  for (int k = 0; k < 100; ++k) {
    // Little or nothing in common with the problem before.
    if (k % 2 == 0) p.P = random_covariance(model.state_size(), 20);
    for (int i = 0; i < p.x.size(); ++i)
      p.x(i) = model.initial_state()(i) + std::sqrt(p.P(i, i)) * normal() * (k % 3 == 0 ? 0.3 : 2.0);
    Projection cold(model, p.settings);
    Eigen::VectorXd from_before = p.x, anew = p.x;
    Eigen::MatrixXd P = p.P;
    const int active = warm.apply(from_before, P).active;
    CHECK(cold.apply(anew, P).active == active);
    CHECK(optimality_gap(p, from_before) < 1e-6);
    CHECK((from_before - anew).cwiseQuotient(p.P.diagonal().cwiseSqrt()).cwiseAbs().maxCoeff() < 1e-7);
    released += active < before;
    before = active;
  }
  CHECK(released > 10);
}

TEST(a_constraint_is_released_when_others_take_over) {
  // Two elements that move together: the second bound, met on the way, carries the first one past its own.
  const Model model(without_inertia(planar_chain()));
  const int n = model.state_size();
  Problem p{settings_for(model), model.initial_state(), Eigen::MatrixXd::Identity(n, n)};
  p.settings.constraint = ConstraintKind::projection;
  p.P(0, 1) = p.P(1, 0) = 0.9;
  p.settings.upper(0) = p.x(0);
  p.settings.upper(1) = p.x(1);
  p.x(0) += 1.0;
  p.x(1) += 1.5;
  Projection projection(model, p.settings);
  Eigen::VectorXd y = p.x;
  Eigen::MatrixXd P = p.P;
  CHECK(projection.apply(y, P).active == 1);
  CHECK(y(1) == p.settings.upper(1));
  CHECK_NEAR(y(0), p.x(0) - 0.9 * 1.5, 1e-12);
  CHECK(optimality_gap(p, y) < 1e-9);
}

TEST(a_state_that_keeps_everything_is_left_alone) {
  for (const ModelSpec& spec : {planar_chain(), spatial_tree()}) {
    const Model model(spec);
    FilterSettings settings = settings_for(model);
    settings.lower = model.initial_state().array() - 1.0;
    settings.upper = model.initial_state().array() + 1.0;
    Projection projection(model, settings);
    Eigen::VectorXd x = model.initial_state();
    Eigen::MatrixXd P = prior_for(model);
    const ProjectionReport report = projection.apply(x, P);
    CHECK(report.active == 0 && report.solved);
    CHECK(x == model.initial_state() && P == prior_for(model));
  }
}

TEST(constraints_that_exclude_each_other_are_reported_and_bounds_kept) {
  const Model model(without_inertia(planar_chain()));
  Problem p = random_problem(model, 0.0);
  p.settings.lower(3) = model.initial_state()(3) - 1e-3;
  p.settings.upper(3) = model.initial_state()(3) + 1e-3;
  p.settings.equality = Eigen::MatrixXd::Zero(1, p.x.size());
  p.settings.equality(0, 3) = 2.0;
  p.settings.equality_value = Eigen::VectorXd::Constant(1, 2.0 * (p.settings.upper(3) + 0.1));
  Projection projection(model, p.settings);
  Eigen::VectorXd y = p.x;
  CHECK(!projection.apply(y, p.P).solved);
  CHECK((y.array() >= p.settings.lower.array()).all() && (y.array() <= p.settings.upper.array()).all());
  CHECK(y(3) == p.settings.upper(3));
  CHECK(y.allFinite() && p.P.allFinite());
}

TEST(equalities_hold_after_inequalities_and_leave_no_variance) {
  for (int k = 0; k < 40; ++k) {
    const Model model(without_inertia(k % 2 == 0 ? planar_chain() : spatial_tree()));
    Problem p = random_problem(model, 0.5);
    const int n = model.state_size();
    p.P = random_covariance(n, 2 * n);
    const Eigen::VectorXd sd = p.P.diagonal().cwiseSqrt();
    p.settings.equality = Eigen::MatrixXd::NullaryExpr(3, n, [] { return normal(); }) * sd.cwiseInverse().asDiagonal();
    p.settings.equality_value = p.settings.equality * model.initial_state();
    Projection projection(model, p.settings);
    Eigen::VectorXd y = p.x;
    Eigen::MatrixXd P = p.P;
    CHECK(projection.apply(y, P).solved);
    const Eigen::MatrixXd A = p.settings.equality;
    const double size = (A.cwiseAbs() * y.cwiseAbs()).maxCoeff();
    CHECK((A * y - p.settings.equality_value).cwiseAbs().maxCoeff() < 1e-9 * size);
    CHECK((A * P * A.transpose()).cwiseAbs().maxCoeff() < 1e-11 * (A * p.P * A.transpose()).maxCoeff());
    CHECK(P == P.transpose());
    // The covariance given all three at once, as of a measurement without noise.
    const Eigen::MatrixXd PA = p.P * A.transpose();
    const Eigen::MatrixXd expected = p.P - PA * (A * PA).ldlt().solve(Eigen::MatrixXd(PA.transpose()));
    CHECK((sd.cwiseInverse().asDiagonal() * (P - expected) * sd.cwiseInverse().asDiagonal()).cwiseAbs().maxCoeff() <
          1e-9);
  }
}

TEST(an_element_that_an_equality_decides_alone_is_sure_and_stays_so) {
  const Model model(without_inertia(planar_chain()));
  Problem p = random_problem(model, 0.0);
  p.settings.equality = Eigen::MatrixXd::Zero(1, p.x.size());
  p.settings.equality(0, 30) = 3.0;
  p.settings.equality_value = Eigen::VectorXd::Constant(1, 0.6);
  Projection projection(model, p.settings);
  CHECK(projection.apply(p.x, p.P).solved);
  CHECK_NEAR(p.x(30), 0.2, 1e-15);
  CHECK(p.P.row(30).isZero(0.0) && p.P.col(30).isZero(0.0));
  CHECK(projection.apply(p.x, p.P).solved);
  p.settings.equality_value(0) = 0.9;  // another value of what is already known for sure
  CHECK(!projection.apply(p.x, p.P).solved);
}
