// A pendulum of one hinge, and what the filter makes of its one marker in a single step.
#include <cmath>
#include <cstdio>
#include <dynakin/filter.hpp>

int main() {
  using namespace dynakin;
  ModelSpec spec;
  spec.coordinates = {{"swing"}};
  spec.segments.resize(1);
  spec.segments[0].name = "rod";
  spec.segments[0].axes = {{"swing"}};
  spec.markers = {{"tip", "rod", {0.0, -0.5, 0.0}, {true, true, true}, {false, false, false}}};
  const Model model(spec);

  FilterSettings settings;
  const Eigen::VectorXd nothing = Eigen::VectorXd::Zero(model.state_size());
  settings.process_variance = settings.process_density = settings.decay_rate = nothing;
  settings.marker_variance = Eigen::VectorXd::Constant(1, 1e-6);  // m^2
  settings.lower = nothing.array() - k_infinity;
  settings.upper = nothing.array() + k_infinity;
  settings.equality.resize(0, nothing.size());

  Filter filter(model, settings, nothing, Eigen::MatrixXd::Identity(nothing.size(), nothing.size()) * 0.01);
  const MarkerMatrix tip = Vector3(0.5 * std::sin(0.1), -0.5 * std::cos(0.1), 0.0);
  filter.update(tip, Vector6::Constant(std::nan("")));
  std::printf("angle %.3f rad, sd %.3f rad, marker %s\n", filter.state()(0), std::sqrt(filter.covariance()(0, 0)),
              describe(filter.verdicts()[0]));
}
