#include "models.hpp"

#include <limits>

#include "dynakin/kinematics.hpp"

using namespace dynakin;

namespace {

InertiaVector rod(double mass, double length) {  // along Y from the origin, slender but not flat
  InertiaVector phi = InertiaVector::Zero();
  const double moment = mass * length * length / 3.0;
  phi(k_mass) = mass;
  phi(k_my) = 0.5 * mass * length;
  phi(k_ixx) = phi(k_izz) = moment;
  phi(k_iyy) = 0.05 * moment;
  return phi;
}

}  // namespace

ModelSpec planar_chain() {
  ModelSpec spec;
  spec.name = "planar chain";
  spec.wrench_measured = {true, true, false, false, false, true};
  const int markers[7] = {3, 4, 3, 2, 2, 2, 1};
  for (int i = 0; i < 7; ++i) {
    const std::string n = std::to_string(i);
    spec.coordinates.push_back({"q" + n, 0.1 * i, false});
    SegmentSpec segment;
    segment.name = "s" + n;
    segment.axes = {{"q" + n, AxisKind::rotation, Vector3::UnitZ(), {0.0, 1.0}, ""}};
    segment.inertia = rod(8.0, 0.4);
    segment.inertia_estimated = {true, true, true, false, false, false, true, false, false, false};
    if (i > 0) {
      segment.parent = "s" + std::to_string(i - 1);
      segment.lengths = {{"l" + n, Vector3::UnitY()}};
      spec.parameters.push_back({"l" + n, 0.4, true});
    }
    spec.segments.push_back(segment);
    for (int k = 0; k < markers[i]; ++k)
      spec.markers.push_back({"m" + n + std::to_string(k),
                              "s" + n,
                              Vector3(0.05 - 0.04 * k, 0.1 * (k + 1), 0.08),
                              {true, true, false},
                              {true, true, false}});
  }
  return spec;
}

ModelSpec spatial_tree() {
  ModelSpec spec;
  spec.name = "spatial tree";
  spec.parameters = {{"a", 0.4, true}, {"b", 0.3, true}, {"c", 0.2, false}};
  const auto add = [&](const std::string& name, const std::string& parent, std::vector<AxisSpec> axes) {
    SegmentSpec segment;
    segment.name = name;
    segment.parent = parent;
    segment.axes = std::move(axes);
    segment.rotation = Eigen::AngleAxisd(0.3, Vector3(1.0, 2.0, 2.0) / 3.0).toRotationMatrix();
    segment.translation = Vector3(0.02, -0.01, 0.03);
    if (parent != "ground") segment.lengths = {{"a", Vector3(0.1, 0.9, 0.0)}, {"c", Vector3(0.0, 0.2, 1.0)}};
    segment.inertia = rod(5.0, 0.35);
    segment.inertia_estimated.fill(true);
    spec.segments.push_back(segment);
    for (int k = 0; k < 3; ++k)
      spec.markers.push_back(
          {name + std::to_string(k), name, Vector3(0.05 * k, 0.1, -0.03 * k), {true, true, true}, {true, true, true}});
  };
  std::vector<AxisSpec> base;
  for (int k = 0; k < 6; ++k) {
    spec.coordinates.push_back({"base" + std::to_string(k), 0.1, false});
    base.push_back({"base" + std::to_string(k),
                    k < 3 ? AxisKind::translation : AxisKind::rotation,
                    Vector3::Unit(k % 3),
                    {0.0, 1.0},
                    ""});
  }
  spec.coordinates.push_back({"knee", 0.4, false});
  spec.coordinates.push_back({"slide", 0.1, false});
  spec.coordinates.push_back({"fixed", 0.2, true});
  add("trunk", "ground", base);
  add("thigh", "trunk",
      {{"knee", AxisKind::rotation, Vector3::UnitZ(), {0.1, -1.0, 0.2}, ""},
       {"knee", AxisKind::translation, Vector3::UnitX(), {0.0, 0.1, 0.05}, "b"},
       {"knee",
        AxisKind::translation,
        Vector3::UnitY(),
        {0.0, 0.9},
        "a",
        {{FunctionKind::polynomial, {0.1, 0.9}},
         {FunctionKind::spline, {}, {-0.5, 0.1, 0.6, 1.0, 1.7}, {0.0, 0.02, 0.05, 0.03, 0.01}}}}});
  add("shank", "thigh",
      {{"slide", AxisKind::translation, Vector3::UnitY(), {0.0, 1.0}, ""},
       {"fixed", AxisKind::rotation, Vector3::UnitX(), {0.0, 1.0}, ""}});
  add("arm", "trunk", {});
  return spec;
}

ModelSpec with_contact(ModelSpec spec) {
  spec.contacts = {"foot"};
  return spec;
}

WrenchModel wrench_model_for(const Model& model) {
  WrenchModel how{Matrix6::Constant(0.5), Eigen::MatrixXd::Constant(6, 6 * model.contacts(), 10.0)};
  how.covariance.diagonal().array() += 4.0;
  for (Eigen::Index k = 0; k < how.effects.cols(); ++k) how.effects(k % 6, k) += 90.0;
  return how;
}

FilterSettings settings_for(const Model& model) {
  const int n = model.state_size();
  FilterSettings settings;
  settings.process_variance = Eigen::VectorXd::Constant(n, 1e-4);
  settings.process_density = Eigen::VectorXd::Zero(n);
  settings.decay_rate = Eigen::VectorXd::Zero(n);
  settings.equality.resize(0, n);
  settings.marker_variance = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(model.markers().size()), 1e-4);
  settings.wrench_covariance.diagonal() << 4.0, 4.0, 4.0, 1.0, 1.0, 1.0;
  settings.reference_point = Vector3(0.1, 0.0, 0.2);
  settings.total_mass = 50.0;
  settings.lower = Eigen::VectorXd::Constant(n, -std::numeric_limits<double>::infinity());
  settings.upper = -settings.lower;
  return settings;
}

Eigen::MatrixXd prior_for(const Model& model) {
  return Eigen::MatrixXd::Identity(model.state_size(), model.state_size()) * 0.01;
}

Eigen::Matrix<double, 3, Eigen::Dynamic> markers_at(const Model& model, const Eigen::VectorXd& x) {
  KinematicState state(model);
  forward_kinematics(model, x, state);
  Eigen::Matrix<double, 3, Eigen::Dynamic> markers(3, model.markers().size());
  for (std::size_t m = 0; m < model.markers().size(); ++m) markers.col(m) = state.markers[m];
  return markers;
}
