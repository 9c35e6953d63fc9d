#include "check.hpp"
#include "dynakin/filter.hpp"
#include "models.hpp"

using namespace dynakin;

namespace {

const Vector6 no_wrench = Vector6::Constant(std::nan(""));

Eigen::MatrixXd after(const FilterSettings& settings, const Model& model, int frames) {
  Filter filter(model, settings, model.initial_state(), prior_for(model));
  auto markers = markers_at(model, model.initial_state());
  markers.array() += 0.01;
  for (int k = 0; k < frames; ++k) filter.step(0.01, markers, Vector6::Constant(5.0));
  Eigen::MatrixXd both(filter.state().size(), filter.state().size() + 1);
  both << filter.state(), filter.covariance();
  return both;
}

}  // namespace

TEST(covariance_stays_symmetric_to_the_last_bit) {
  const Model model(spatial_tree());
  const Eigen::MatrixXd both = after(settings_for(model), model, 10);
  const Eigen::MatrixXd P = both.rightCols(both.rows());
  CHECK(P == P.transpose());
}

TEST(a_frame_without_measurements_only_predicts) {
  const Model model(planar_chain());
  FilterSettings settings = settings_for(model);
  settings.total_mass.reset();
  Filter filter(model, settings, model.initial_state(), prior_for(model));
  auto markers = markers_at(model, model.initial_state());
  markers.setConstant(std::nan(""));
  filter.predict(0.01);
  const Eigen::MatrixXd P = filter.covariance();
  const StepReport report = filter.update(markers, no_wrench);
  CHECK(report.status == StepStatus::no_measurement && report.rows == 0 && !report.diverged());
  CHECK(filter.covariance() == P);
}

TEST(an_infinite_measurement_is_refused_before_it_touches_the_state) {
  const Model model(planar_chain());
  Filter filter(model, settings_for(model), model.initial_state(), prior_for(model));
  auto markers = markers_at(model, model.initial_state());
  markers(0, 0) = std::numeric_limits<double>::infinity();
  check_refused([&] { filter.update(markers, no_wrench); }, "infinite");
  CHECK(filter.state() == model.initial_state());
}

TEST(a_measurement_beyond_all_numbers_is_announced_as_divergence_and_stays_so) {
  const Model model(planar_chain());
  Filter filter(model, settings_for(model), model.initial_state(), prior_for(model));
  auto markers = markers_at(model, model.initial_state());
  const auto good = markers;
  markers(0, 0) = 1e300;
  CHECK(filter.step(0.01, markers, no_wrench).diverged());
  CHECK(filter.step(0.01, good, no_wrench).diverged());
  filter.reset(model.initial_state(), prior_for(model));
  CHECK(!filter.step(0.01, good, no_wrench).diverged());
}

TEST(wrong_starts_and_settings_are_refused_by_name) {
  const Model model(planar_chain());
  const Eigen::VectorXd x = model.initial_state();
  const Eigen::MatrixXd P = prior_for(model);
  FilterSettings settings = settings_for(model);
  check_refused([&] { Filter(model, settings, x.head(3), P); }, "x0: expected 89 numbers, found 3");
  check_refused([&] { Filter(model, settings, x, P.topLeftCorner(3, 3)); }, "P0: expected a 89 x 89");
  check_refused([&] { Filter(model, settings, x, -P); }, "variance of 'q0'");
  Eigen::MatrixXd indefinite = P;
  indefinite(0, 1) = indefinite(1, 0) = 0.02;
  check_refused([&] { Filter(model, settings, x, indefinite); }, "not positive definite");
  settings.marker_variance(2) = 0.0;
  check_refused([&] { Filter(model, settings, x, P); }, "marker_variance: of 'm02'");
  settings = settings_for(model);
  settings.lower(0) = 2.0;
  settings.upper(0) = 1.0;
  check_refused([&] { Filter(model, settings, x, P); }, "bounds: of 'q0'");
  settings = settings_for(model);
  settings.total_mass = 0.0;
  check_refused([&] { Filter(model, settings, x, P); }, "total_mass");
}
