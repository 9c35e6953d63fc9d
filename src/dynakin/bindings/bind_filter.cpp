#include <nanobind/eigen/dense.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/unique_ptr.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "dynakin/filter.hpp"
#include "module.hpp"
#include "trial.hpp"

using namespace dynakin;

namespace {

ConstraintKind constraint_kind(const std::string& name) {
  if (name == "gain") return ConstraintKind::gain;
  if (name == "projection") return ConstraintKind::projection;
  if (name == "sigmoid") return ConstraintKind::sigmoid;
  if (name == "none") return ConstraintKind::none;
  throw nb::value_error(
      ("constraint: expected 'projection', 'gain', 'sigmoid' or 'none', found '" + name + "'").c_str());
}

}  // namespace

void bind_filter(nb::module_& m) {
  nb::register_exception_translator([](const std::exception_ptr& p, void*) {
    try {
      std::rethrow_exception(p);
    } catch (const DivergenceError& e) {
      PyErr_SetString(nb::module_::import_("dynakin.errors").attr("DivergenceError").ptr(), e.what());
    }
  });

  nb::class_<RecoverySettings>(m, "RecoverySettings", "When the motion counts as lost, and how it is sought anew.")
      .def(
          "__init__",
          [](RecoverySettings* self, double blind_s, double coordinate_sd, double speed_sd, double acceleration_sd,
             double unseen_sd, double fit_m) {
            new (self) RecoverySettings{true, blind_s, fit_m, coordinate_sd, speed_sd, acceleration_sd, unseen_sd};
          },
          nb::arg("blind_s") = RecoverySettings{}.blind_s, nb::arg("coordinate_sd") = RecoverySettings{}.coordinate_sd,
          nb::arg("speed_sd") = RecoverySettings{}.speed_sd,
          nb::arg("acceleration_sd") = RecoverySettings{}.acceleration_sd,
          nb::arg("unseen_sd") = RecoverySettings{}.unseen_sd, nb::arg("fit_m") = RecoverySettings{}.fit_m);

  nb::class_<FilterSettings>(m, "FilterSettings", "Noise, bounds and constraints of a Filter, SI units.")
      .def(
          "__init__",
          [](FilterSettings* self, Eigen::VectorXd process_variance, Eigen::VectorXd marker_variance,
             const Matrix6& wrench_covariance, const Vector3& reference_point, std::optional<double> total_mass,
             double total_mass_variance, Eigen::VectorXd lower, Eigen::VectorXd upper, const std::string& constraint,
             std::optional<Eigen::VectorXd> process_density, std::optional<Eigen::VectorXd> decay_rate,
             std::optional<Eigen::MatrixXd> equality, std::optional<Eigen::VectorXd> equality_value,
             std::optional<GateLimits> marker_gate, std::optional<GateLimits> wrench_gate, bool wrench_needs_markers,
             double iterate_beyond, std::optional<RecoverySettings> recovery) {
            const Eigen::VectorXd none = Eigen::VectorXd::Zero(process_variance.size());
            auto* s = new (self) FilterSettings;
            s->process_variance = std::move(process_variance);
            s->process_density = process_density.value_or(none);
            s->decay_rate = decay_rate.value_or(none);
            s->marker_variance = std::move(marker_variance);
            s->wrench_covariance = wrench_covariance;
            s->reference_point = reference_point;
            s->total_mass = total_mass;
            s->total_mass_variance = total_mass_variance;
            s->lower = std::move(lower);
            s->upper = std::move(upper);
            s->constraint = constraint_kind(constraint);
            s->equality = equality.value_or(Eigen::MatrixXd(0, none.size()));
            s->equality_value = equality_value.value_or(Eigen::VectorXd(0));
            s->marker_gate = marker_gate.value_or(no_gate);
            s->wrench_gate = wrench_gate.value_or(no_gate);
            s->wrench_needs_markers = wrench_needs_markers;
            s->iterate_beyond = iterate_beyond;
            if (recovery) s->recovery = *recovery;
          },
          nb::arg("process_variance"), nb::arg("marker_variance"), nb::arg("wrench_covariance"),
          nb::arg("reference_point"), nb::arg("total_mass").none(), nb::arg("total_mass_variance"), nb::arg("lower"),
          nb::arg("upper"), nb::arg("constraint") = "gain", nb::arg("process_density") = nb::none(),
          nb::arg("decay_rate") = nb::none(), nb::arg("equality") = nb::none(), nb::arg("equality_value") = nb::none(),
          nb::arg("marker_gate") = nb::none(), nb::arg("wrench_gate") = nb::none(),
          nb::arg("wrench_needs_markers") = false, nb::arg("iterate_beyond") = k_infinity,
          nb::arg("recovery") = nb::none())
      .def_ro("process_variance", &FilterSettings::process_variance, nb::rv_policy::copy)
      .def_ro("marker_variance", &FilterSettings::marker_variance, nb::rv_policy::copy)
      .def_ro("wrench_covariance", &FilterSettings::wrench_covariance, nb::rv_policy::copy)
      .def_ro("lower", &FilterSettings::lower, nb::rv_policy::copy)
      .def_ro("upper", &FilterSettings::upper, nb::rv_policy::copy);

  nb::class_<StepReport>(m, "StepReport", "What one step did.")
      .def_prop_ro("status", [](const StepReport& r) { return std::string(describe(r.status)); })
      .def_prop_ro("diverged", &StepReport::diverged)
      .def_prop_ro(
          "tracking", [](const StepReport& r) { return std::string(describe(r.tracking)); },
          "following, doubtful, lost, found or restarted")
      .def_ro("n_rows", &StepReport::rows, "measured rows that were used")
      .def_ro("constrained", &StepReport::constrained, "elements moved onto a bound, or constraints that bind")
      .def_ro("constraints_met", &StepReport::constraints_met)
      .def_ro("nis", &StepReport::nis, "normalised innovation squared, summed over the rows")
      .def_ro("log_likelihood", &StepReport::log_likelihood);

  nb::class_<Filter> filter(m, "Filter", "The constrained extended Kalman filter; one thread at a time.");
  filter
      .def(nb::init<const Model&, const FilterSettings&, const Eigen::VectorXd&, const Eigen::MatrixXd&>(),
           nb::arg("model"), nb::arg("settings"), nb::arg("x0"), nb::arg("P0"))
      .def_prop_ro("state", &Filter::state, nb::rv_policy::copy, "x (n,)")
      .def_prop_ro("covariance", &Filter::covariance, nb::rv_policy::copy, "P (n, n)")
      .def_prop_ro(
          "verdicts",
          [](const Filter& f) {
            std::vector<std::string> words;
            for (Verdict verdict : f.verdicts()) words.emplace_back(describe(verdict));
            return words;
          },
          "missing, accepted or refused: each marker in the last update and, last, the plates")
      .def("report_sensors", &Filter::report_sensors, nb::arg("on"),
           "From now on, or no longer, each update also works out what `sensors` gives.")
      .def_prop_ro(
          "sensors",
          [](const Filter& f) {
            nb::dict out;
            out["innovation"] = f.sensors().innovation;
            out["innovation_sd"] = f.sensors().innovation_sd;
            out["test_ratio"] = f.sensors().test_ratio;
            return out;
          },
          "What each sensor said in the last update, if `report_sensors` is on: innovation (measured less predicted) "
          "and innovation_sd (3 M + 6,), 3 a marker, then the plates'; test_ratio (M + 1,): normalised innovation "
          "squared over the gate's limit, 0 without a gate. NaN: not measured.")
      .def("reset", &Filter::reset, nb::arg("x"), nb::arg("P"))
      .def("predict", &Filter::predict, nb::arg("dt"), "Moves the state by dt seconds.")
      .def(
          "update",
          [](Filter& f, const Array2& markers, const Vector6& wrench, const std::optional<Matrix6>& wrench_covariance,
             const std::optional<Eigen::MatrixXd>& wrench_effects) {
            return f.update(marker_map(markers, f.model()), wrench,
                            GivenWrenchModel(f.model(), wrench_covariance, wrench_effects));
          },
          nb::arg("markers"), nb::arg("wrench"), nb::arg("wrench_covariance") = nb::none(),
          nb::arg("wrench_effects") = nb::none(),
          "Corrects with markers (M, 3), m, and wrench (6,), N and N m about the ground origin; NaN: missing. "
          "wrench_covariance (6, 6), about the ground origin, takes the place of the settings' in this frame.")
      .def(
          "step",
          [](Filter& f, double dt, const Array2& markers, const Vector6& wrench,
             const std::optional<Matrix6>& wrench_covariance, const std::optional<Eigen::MatrixXd>& wrench_effects) {
            return f.step(dt, marker_map(markers, f.model()), wrench,
                          GivenWrenchModel(f.model(), wrench_covariance, wrench_effects));
          },
          nb::arg("dt"), nb::arg("markers"), nb::arg("wrench"), nb::arg("wrench_covariance") = nb::none(),
          nb::arg("wrench_effects") = nb::none(), "predict(dt), then update(markers, wrench, wrench_covariance).");
  bind_run(filter);
  bind_score(filter);
}
