#include <nanobind/eigen/dense.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/vector.h>

#include <optional>

#include "arrays.hpp"
#include "dynakin/measurement.hpp"
#include "dynakin/moment_derivatives.hpp"
#include "dynakin/posture_fit.hpp"
#include "module.hpp"

using namespace dynakin;

namespace {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

void check_size(const Model& model, const StateRef& x) {
  if (x.size() != model.state_size())
    throw std::invalid_argument("x: expected " + std::to_string(model.state_size()) + " numbers, found " +
                                std::to_string(x.size()));
}

// Everything at one state; convenient and allocating, for looking at a model. A Filter holds its own workspace.
struct At {
  At(const Model& model, const StateRef& x) : kinematics(model), dynamics(model) {
    check_size(model, x);
    forward_kinematics(model, x, kinematics);
    subtree_dynamics(model, x, kinematics, dynamics);
  }
  KinematicState kinematics;
  DynamicState dynamics;
};

RowMatrix marker_positions(const Model& model, const StateRef& x) {
  const At at(model, x);
  RowMatrix p(at.kinematics.markers.size(), 3);
  for (std::size_t m = 0; m < at.kinematics.markers.size(); ++m) p.row(m) = at.kinematics.markers[m].transpose();
  return p;
}

RowMatrix dense_marker_jacobian(const Model& model, const StateRef& x) {
  const At at(model, x);
  RowMatrix J = RowMatrix::Zero(3 * model.markers().size(), model.state_size());
  std::vector<int> identity(model.state_size());
  for (int i = 0; i < model.state_size(); ++i) identity[i] = i;
  MarkerMatrix rows(3, model.state_size());
  for (std::size_t m = 0; m < model.markers().size(); ++m) {
    marker_jacobian(model, at.kinematics, static_cast<int>(m), identity, rows);
    J.middleRows<3>(3 * m) = rows;
  }
  return J;
}

RowMatrix dense_wrench_jacobian(const Model& model, const StateRef& x) {
  const At at(model, x);
  Eigen::Matrix<double, 6, Eigen::Dynamic> J(6, model.state_size());
  J.setZero();
  wrench_jacobian(model, at.kinematics, at.dynamics, J);
  return J;
}

// Of the filter's own measurement, with nothing but the plates in it.
struct PlatesAt {
  PlatesAt(const Model& model, const StateRef& x) : settings(blind(model)), measurement(model, settings) {
    check_size(model, x);
    measurement.linearise(x, MarkerMatrix::Zero(3, model.markers().size()), Vector6::Zero());
  }
  static FilterSettings blind(const Model& model) {
    FilterSettings settings;
    settings.marker_variance.setConstant(model.markers().size(), k_infinity);
    return settings;
  }
  FilterSettings settings;
  Measurement measurement;
};

Vector6 plates(const Model& model, const StateRef& x) {
  return PlatesAt(model, x).measurement.predicted().segment<6>(3 * model.markers().size());
}

RowMatrix plates_jacobian(const Model& model, const StateRef& x) {
  const PlatesAt at(model, x);
  const auto n_markers = static_cast<int>(model.markers().size());
  const RowBlock& block = at.measurement.blocks()[n_markers];
  RowMatrix J = RowMatrix::Zero(6, model.state_size());
  for (int r = 0; r < block.rows; ++r)
    for (std::size_t c = 0; c < block.columns->size(); ++c)
      J(block.channel[r] - 3 * n_markers, (*block.columns)[c]) = block.H(r, c);
  return J;
}

using External = std::optional<std::vector<Force>>;

External external_of(const Model& model, const std::optional<RowMatrix>& external) {
  if (!external) return std::nullopt;
  const auto n = static_cast<Eigen::Index>(model.segments().size());
  if (external->rows() != n || external->cols() != 6)
    throw std::invalid_argument("external: expected a wrench a segment (" + std::to_string(n) + ", 6)");
  std::vector<Force> wrenches;
  for (Eigen::Index i = 0; i < n; ++i)
    wrenches.push_back({external->row(i).head<3>().transpose(), external->row(i).tail<3>().transpose()});
  return wrenches;
}

Eigen::VectorXd moments(const Model& model, const StateRef& x, const std::optional<RowMatrix>& external) {
  const At at(model, x);
  const External wrenches = external_of(model, external);
  Eigen::VectorXd tau(model.coordinates().size());
  joint_moments(model, at.kinematics, at.dynamics, wrenches ? &*wrenches : nullptr, tau);
  return tau;
}

RowMatrix dense_moment_jacobian(const Model& model, const StateRef& x, const std::optional<RowMatrix>& external) {
  const At at(model, x);
  const External wrenches = external_of(model, external);
  MomentWorkspace work(model);
  Eigen::MatrixXd J(model.coordinates().size(), model.state_size());
  moment_jacobian(model, x, at.kinematics, at.dynamics, wrenches ? &*wrenches : nullptr, work, J);
  return J;
}

nb::tuple segment_poses(const Model& model, const StateRef& x) {
  const At at(model, x);
  const std::size_t n = at.kinematics.segments.size();
  std::vector<double> R(9 * n), p(3 * n);
  for (std::size_t i = 0; i < n; ++i) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(R.data() + 9 * i) = at.kinematics.segments[i].R_GB;
    Eigen::Map<Vector3>(p.data() + 3 * i) = at.kinematics.segments[i].p_GB;
  }
  return nb::make_tuple(owned(std::move(R), {n, 3, 3}), owned(std::move(p), {n, 3}));
}

nb::tuple coordinates(const Model& model, const StateRef& x) {
  check_size(model, x);
  const Eigen::Index n = static_cast<Eigen::Index>(model.coordinates().size());
  Eigen::VectorXd q(n), qd(n), qdd(n);
  for (int i = 0; i < n; ++i) {
    const CoordinateValue value = coordinate_value(model, x, i);
    q(i) = value.q;
    qd(i) = value.qd;
    qdd(i) = value.qdd;
  }
  return nb::make_tuple(q, qd, qdd);
}

nb::tuple fitted(const Model& model, const Eigen::VectorXd& x, const RowMatrix& targets, const Eigen::VectorXd& lower,
                 const Eigen::VectorXd& upper, const Eigen::VectorXd& scale, const Eigen::VectorXd& pull,
                 const Eigen::VectorXd& rest) {
  check_size(model, x);
  if (targets.cols() != 3) throw std::invalid_argument("targets: expected three columns");
  const PostureProblem problem{targets.transpose(), lower, upper, scale, pull, rest};
  const PostureFit fit = fit_posture(model, x, problem, x.head(model.n_free()));
  return nb::make_tuple(fit.q, fit.cost, fit.converged);
}

}  // namespace

void bind_mechanics(nb::module_& m) {
  const auto model = nb::arg("model");
  const auto x = nb::arg("x");
  m.def("marker_positions", &marker_positions, model, x, "Marker positions p_GM (M, 3), m, ground frame.");
  m.def("segment_poses", &segment_poses, model, x,
        "Orientations R_GB (S, 3, 3) and origins p_GB (S, 3) of all segments.");
  m.def("coordinates", &coordinates, model, x, "q, qd, qdd of all coordinates, locked ones too: three arrays (C,).");
  m.def(
      "wrench", [](const Model& model, const StateRef& x) -> Vector6 { return At(model, x).dynamics.wrench.vector(); },
      model, x, "Total external wrench (6,), N and N m, ground on person, about the ground origin.");
  m.def("total_mass", [](const Model& model, const StateRef& x) { return At(model, x).dynamics.mass; }, model, x, "kg");
  m.def("joint_moments", &moments, model, x, nb::arg("external") = nb::none(),
        "Joint moments (1), (C,), N m or N, less the external wrenches (S, 6) that act on the segments, if given.");
  m.def("moment_jacobian", &dense_moment_jacobian, model, x, nb::arg("external") = nb::none(),
        "d joint_moments / dx (C, n), N m or N per unit of x; the external wrenches (S, 6) stay while x varies.");
  m.def("fit_posture", &fitted, model, x, nb::arg("targets"), nb::arg("lower"), nb::arg("upper"), nb::arg("scale"),
        nb::arg("pull"), nb::arg("rest"),
        "Free coordinates (F,) that bring the markers nearest to targets (M, 3), m, ground frame (NaN: not measured), "
        "within bounds (F,), from those of x (n,), of which all else stays; half the sum of squares, of distances and "
        "of pull * (q - rest) (F,); whether that is a minimum.");
  m.def("marker_jacobian", &dense_marker_jacobian, model, x, "d p_GM / dx (3 M, n), dense: for tests and study.");
  m.def("wrench_jacobian", &dense_wrench_jacobian, model, x, "d wrench / dx (6, n), dense: for tests and study.");
  m.def("plates", &plates, model, x,
        "What the plates should say (6,): the wrench, late by their delay, with their slow error.");
  m.def("plates_jacobian", &plates_jacobian, model, x,
        "d plates / dx (6, n) as the filter has it; components that are not measured are 0.");
}
